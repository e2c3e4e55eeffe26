"""Diagrams of a run over time: named curves with a unit, for pictures and pages alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.histories import Point, is_relative, point_name
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.style import COLOURS, ENERGY_COLOURS, distinct_colours, legend_label
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = ("x", "y", "z")
# Title of each diagram of energies, attribute of their sum, attributes of the terms.
_ENERGIES = (
    ("stored energy", "stored", ("kinetic", "elastic", "drive_spring", "contact", "bristles")),
    ("work put in", "work", ("drive_work", "belt_normal_work", "belt_friction_work", "load_work",
                             "circulatory_work", "bristle_work")),
    ("energy lost", "lost", ("modal_damping", "dashpots", "contact_damping", "friction")),
)
_DARK, _PALE = "#303030", "#b8b4ad"
_FLAT = 1e-9  # of the largest motion, below which a curve is round-off
_LINE_BINS = 2000  # a long line is drawn by minimum and maximum of each


@dataclass(frozen=True, eq=False)
class Curve:
    """Values (N,) over time; without a colour in that of text. Lines have their width in points."""

    name: str
    colour: str
    values: Array
    width: float = 1.2


@dataclass(frozen=True, eq=False)
class Diagram:
    """Curves of one unit over the same times."""

    title: str
    unit: str
    curves: tuple[Curve, ...]

    @cached_property
    def largest(self) -> float:
        """Largest size of all values."""
        return max((float(np.abs(one.values).max(initial=0.0)) for one in self.curves), default=0.0)

    @cached_property
    def scale(self) -> tuple[float, str]:
        """Factor and symbol of a unit that suits the values."""
        return suitable_unit(self.largest, self.unit)

    def draw(self, axes: "Axes", time: Array) -> None:
        """Draw the curves over times in the unit of their axis, and label the axis of values."""
        factor, symbol = self.scale
        axes.set_ylabel(f"{self.title} [{symbol}]")
        for one in self.curves:
            # Thick lines lie behind thin ones.
            axes.plot(*thinned(time, one.values / factor), color=one.colour or _DARK,
                      linewidth=one.width, zorder=2.5 - 0.1 * one.width,
                      label=legend_label(one.name))
        low = min((float(one.values.min()) for one in self.curves), default=0.0)
        high = max((float(one.values.max()) for one in self.curves), default=0.0)
        if 0.0 <= high - low < _FLAT * self.largest:
            # Do not magnify round-off about a constant.
            axes.set_ylim((low - 0.05 * self.largest) / factor,
                          (high + 0.05 * self.largest) / factor)


def motion_diagrams(
    run: Trajectory, points: Sequence[Point]
) -> dict[tuple[str, int], Diagram]:
    """Displacements and velocities of points, by their name and the number of their axis.

    Without the curves of points that do not move along an axis.
    """
    d = run.system.basis.dimension
    motions = {what: [getattr(run, what)(point)[:, :d] for point in points]
               for what in ("displacement", "velocity")}
    names, colours = [labelled(point, run) for point in points], distinct_colours(len(points))
    found: dict[tuple[str, int], Diagram] = {}
    for (what, values), unit in zip(motions.items(), ("m", "m/s"), strict=True):
        largest = max((float(np.abs(one).max()) for one in values), default=0.0)
        for axis in range(d):
            found[what, axis] = Diagram(f"{what} {AXES[axis]}", unit, tuple(
                Curve(name, colour, one[:, axis], 1.2 if number else 2.0)
                for number, (name, colour, one) in enumerate(zip(names, colours, values,
                                                                 strict=True))
                if np.abs(one[:, axis]).max() > _FLAT * largest))
    return found


def force_diagrams(run: Trajectory) -> list[Diagram]:
    """Total normal force of each face, then their total friction, along tangents or its size."""
    faces, basis = contact_faces(run.system.basis), run.system.basis
    if not basis.contact_nodes:
        return []
    single = not faces[0].name
    colours = [""] if single else distinct_colours(len(faces))

    def of_faces(title: str, values: Array) -> Diagram:
        return Diagram(title, "N", tuple(
            Curve(face.name, colour, values[:, face.nodes].sum(axis=1))
            for face, colour in zip(faces, colours, strict=True)))

    normal = of_faces("total normal force", run.normal_force)
    friction = run.friction_forces
    if basis.dimension == 2:
        return [normal, of_faces(f"total friction force in -{'x' if single else 't'}",
                                 friction[:, :, 0])]
    on_body = -np.einsum("fnk,nkd->fnd", friction, basis.tangents)
    totals = [on_body[:, face.nodes].sum(axis=1) for face in faces]
    if single:
        size = np.linalg.norm(totals[0], axis=1)
        return [normal, Diagram("total friction on the body", "N", (
            Curve("size", _PALE, size, 2.4), Curve("x", "", totals[0][:, 0]),
            Curve("y", COLOURS[1], totals[0][:, 1])))]
    sizes = Diagram("size of total friction", "N", tuple(
        Curve(face.name, colour, np.linalg.norm(total, axis=1))
        for face, colour, total in zip(faces, colours, totals, strict=True)))
    ways = ("t", "t2") if several_bodies(basis) else ("-x", "-y")
    return [normal, sizes, *(of_faces(f"total friction force along {way}", friction[:, :, k])
                             for k, way in enumerate(ways))]


def energy_diagrams(run: Trajectory) -> list[Diagram]:
    """Stored energy, work put in and energy lost, each with its terms and total.

    Without terms that stay zero, and without diagrams of such terms alone.
    """
    energies = run.energies
    found: list[Diagram] = []
    for title, total, names in _ENERGIES:
        terms = {name: getattr(energies, name) for name in names}
        curves = [Curve(name.removesuffix("_work").replace("_", " "), ENERGY_COLOURS[name], term)
                  for name, term in terms.items() if term.any()]
        if curves or not found:
            found.append(Diagram(title, "J", (
                *curves, Curve("total", "", getattr(energies, total), 1.8))))
    # Without drive, friction and damping nothing is put in or lost.
    shown = [one for one in found if len(one.curves) > 1]
    return shown or found[:1]


def labelled(point: Point, run: Trajectory) -> str:
    """Name of a point, and whether its motion is relative to another body."""
    basis = run.system.basis
    way = ", relative (t, n)" if basis.dimension == 2 else ", relative (t, t2, n)"
    return point_name(point, basis) + way * is_relative(point, basis)


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """A long line by what it is where it enters and leaves each of many narrow columns, and by its
    lowest and highest points there, so that no peak is lost.
    """
    if len(x) < 4 * _LINE_BINS:
        return x, y
    columns = np.linspace(x[0], x[-1], _LINE_BINS + 1)[:-1]
    starts = np.unique(np.searchsorted(x, columns))
    low, high = (_places(extreme.reduceat(y, starts), y, starts)
                 for extreme in (np.minimum, np.maximum))
    ends = np.append(starts[1:], len(x)) - 1
    chosen = np.unique(np.concatenate([starts, low, high, ends]))
    return x[chosen], y[chosen]


def _places(extremes: Array, y: Array, starts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the extreme in each column of points."""
    counts = np.diff(np.append(starts, len(y)))
    met = np.flatnonzero(y == np.repeat(extremes, counts))
    columns = np.searchsorted(starts, met, side="right")
    return np.asarray(met[np.unique(columns, return_index=True)[1]])
