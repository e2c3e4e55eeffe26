"""Plots of shapes: modes of a body and of a wheel, buckling; and of their convergence."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.output.plots.bodies import DRAWN_DISPLACEMENT, draw_body, in_picture
from fecontact.output.plots.figure import new_figure
from fecontact.reduction.assembly.contact_faces import mode_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import BodyPart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fecontact.reduction.assembly.bodies_convergence import BodiesConvergence
    from fecontact.reduction.convergence import ModeConvergence
    from fecontact.reduction.sector_modes import SectorModes
    from fecontact.system.statics.buckling import BucklingLoads

_WIDTH = 10.0  # inches


def plot_modes(
    basis: ModalBasis, *, count: int = 12, path: str | Path | None = None
) -> "Figure":
    """Plot the first modes: deformed body, coloured by amplitude, over its undeformed outline.

    Of several bodies, the first modes of each. Each is scaled to the same largest displacement.

    Parameters
    ----------
    basis : ModalBasis
        Modal basis with shapes over the body.
    count : int
        Largest number of modes.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a basis without shapes, a count below one, another suffix, or a file that cannot be
        written.
    """
    require_kind("plot_modes", ModalBasis, basis=basis)
    if basis.mode_shapes is None:
        raise InputError("These modes cannot be drawn: the modal basis holds no shapes over the "
                         "body; make it with ElasticBody.modal_basis.")
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise InputError(f"count = {count!r} must be a whole number of at least one mode.")
    field, names = basis.mode_shapes, mode_names(basis)
    chosen = _first_modes(basis, min(count, basis.modes))
    hertz = basis.frequencies_hz
    titles = [names[mode] + ("\n" if basis.parts else ": ")
              + ("rigid" if hertz[mode] == 0.0 else f"{hertz[mode]:.5g} Hz") for mode in chosen]
    return _shapes_figure(field, field.shapes[..., chosen], titles, path, basis.parts)


def plot_buckling(found: "BucklingLoads", *, path: str | Path | None = None) -> "Figure":
    """Plot the shapes in which a body buckles, with their load factors.

    Parameters
    ----------
    found : BucklingLoads
        Result of :func:`fecontact.analysis.buckling_loads`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without load factors, for another suffix, or a file that cannot be written.
    """
    from fecontact.system.statics.buckling import BucklingLoads

    require_kind("plot_buckling", BucklingLoads, found=found)
    if not len(found.load_factors):
        raise InputError("plot_buckling: there are no shapes, since the loads do not make the body "
                         "buckle.")
    titles = [f"{factor:.5g} times the load" for factor in found.load_factors]
    return _shapes_figure(found.state, found.shapes, titles, path)


def plot_wheel(
    found: "SectorModes", shown: Sequence[tuple[int, int]], *, phase: float = 0.0,
    path: str | Path | None = None,
) -> "Figure":
    """Plot modes of a sector over the whole wheel.

    Parameters
    ----------
    found : SectorModes
        Result of :func:`fecontact.reduction.sector_modes`.
    shown : sequence of (int, int)
        Nodal diameter and number of each mode, from 0.
    phase : float
        Phase of the vibration [rad]; pi / 2 for the other mode of each pair.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For modes that are not there, another suffix, or a file that cannot be written.
    """
    from fecontact.reduction.sector_modes import SectorModes

    require_kind("plot_wheel", SectorModes, found=found)
    require_kind("plot_wheel", (Sequence, np.ndarray), shown=shown)
    if not len(shown):
        raise InputError("plot_wheel: shown is empty; give a nodal diameter and a number of a mode "
                         "at least.")
    wheels = [found.on_wheel(diameter, mode, phase) for diameter, mode in shown]
    titles = [f"diameter {diameter}, " + (f"{hertz:.5g} Hz" if hertz else "rigid")
              for diameter, mode in shown
              for hertz in [float(found.frequencies_hz[found.row(diameter), mode])]]
    return _shapes_figure(wheels[0], np.stack([one.displacement for one in wheels], axis=2),
                          titles, path)


def _shapes_figure(
    body: Any, shapes: Array, titles: Sequence[str], path: str | Path | None,
    parts: Sequence[BodyPart] = (),
) -> "Figure":
    """Draw shapes (N, d, k) beside each other, each scaled to the same largest displacement."""
    shown = len(titles)
    reach = DRAWN_DISPLACEMENT * float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    seen = in_picture(body.nodes)
    low, high = seen.min(axis=0) - reach, seen.max(axis=0) + reach
    aspect = float(np.divide(*(high - low)))
    columns = min(shown, 6, int(np.ceil(np.sqrt(1.8 * shown / aspect))))
    rows = -(-shown // columns)
    height = min(_WIDTH / columns / aspect, 3.5)
    above = 0.6 if parts else 0.4
    with new_figure(_WIDTH, rows * (height + above) + 0.8, path) as figure:
        grid = figure.subplots(rows, columns, squeeze=False)
        for axis in grid.flat:
            axis.set_axis_off()
        for title, shape, axis in zip(titles, np.moveaxis(shapes, 2, 0), grid.flat, strict=False):
            amplitude = np.linalg.norm(shape, axis=1)
            largest = float(amplitude.max()) or 1.0
            drawn = draw_body(axis, body, body.nodes + reach / largest * shape, amplitude / largest,
                              cmap="viridis", low=0.0, high=1.0, parts=parts)
            axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", title=title)
        figure.colorbar(drawn, ax=grid, location="bottom", aspect=50, shrink=0.5, pad=0.02,
                        label="amplitude, relative to the largest")
    return figure


def _first_modes(basis: ModalBasis, count: int) -> list[int]:
    """Numbers of as many modes, of several bodies evenly from each."""
    ranks = np.arange(basis.modes)
    for part in basis.parts:
        ranks[part.modes[0] : sum(part.modes)] = np.arange(part.modes[1])
    return sorted(np.argsort(ranks, kind="stable")[:count].tolist())


def plot_convergence(
    result: "ModeConvergence | BodiesConvergence", *, path: str | Path | None = None
) -> "Figure":
    """Plot the convergence of frequencies and contact compliance with mesh and modes.

    Parameters
    ----------
    result : ModeConvergence or BodiesConvergence
        Result of :func:`fecontact.reduction.mode_convergence`, or of several bodies
        :func:`fecontact.study.study_convergence`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from fecontact.reduction.assembly.bodies_convergence import BodiesConvergence
    from fecontact.reduction.convergence import ModeConvergence

    require_kind("plot_convergence", (ModeConvergence, BodiesConvergence), result=result)
    from matplotlib.ticker import NullLocator

    several = isinstance(result, BodiesConvergence)
    with new_figure(1.2 * _WIDTH, 5.0 if several else 4.0, path) as figure:
        meshes, modes = figure.subplots(1, 2)
        counts = (_bodies_convergence(meshes, modes, result)
                  if isinstance(result, BodiesConvergence)
                  else _body_convergence(meshes, modes, result))
        sizes = (np.sum(list(result.unknowns.values()), axis=0)
                 if isinstance(result, BodiesConvergence) else result.unknowns)[:-1]
        meshes.set_xticks(sizes, [str(size) for size in sizes])
        meshes.xaxis.set_minor_locator(NullLocator())
        meshes.set(xlabel="unknowns of the mesh" + "es" * several,
                   ylabel="relative distance from the finest mesh")
        meshes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0),
                      fontsize="x-small" if several else None)
        modes.set(xlabel="modes of all bodies" if several else "modes",
                  ylabel="missing contact compliance, worst " + (
                      "load [%]" if several else "node [%]"))
        modes.set_xticks(counts, [str(count) for count in counts])
        modes.minorticks_off()
        modes.set_ylim(bottom=0.0)
        if modes.lines:
            modes.legend()
    return figure


def _body_convergence(meshes: "Axes", modes: "Axes", result: "ModeConvergence") -> Integers:
    """Draw that of a single body; returns the numbers of modes."""
    sizes = result.unknowns[:-1]
    for i, values in enumerate(_distance(result.frequencies_hz).T):
        hertz = result.frequencies_hz[-1, i]
        meshes.loglog(sizes, values, "o-", label=f"f{i + 1} = {hertz:.5g} Hz")
    for values, axis, style in zip(_distance(result.compliance).T, "xyz", ("s--", "^--", "v--"),
                                   strict=False):
        meshes.loglog(sizes, values, style, color="#707070", label=f"contact compliance in {axis}")
    for values, axis, style in zip(result.missing.T, "xyz", ("s-", "^-", "v-"), strict=False):
        modes.semilogx(result.modes, 100.0 * values, style, label=f"in {axis}")
    return result.modes


def _bodies_convergence(meshes: "Axes", modes: "Axes", result: "BodiesConvergence") -> Integers:
    """Draw that of several bodies; returns the numbers of modes of all of them."""
    sizes = np.sum(list(result.unknowns.values()), axis=0)[:-1]
    groups = dict(result.frequencies_hz)
    if result.joined_hz is not None:
        groups[result.joined] = result.joined_hz
    for colour, (name, frequencies) in enumerate(groups.items()):
        for i, values in enumerate(_distance(frequencies).T):
            meshes.loglog(sizes, values, "o-", color=f"C{colour}", alpha=1.0 - 0.13 * i,
                          label=f"{name}: f{i + 1} = {frequencies[-1, i]:.5g} Hz")
    counts = np.sum(list(result.modes.values()), axis=0)
    for number, (name, compliance) in enumerate(result.compliance.items()):
        grey = str(0.2 + 0.6 * number / len(result.compliance))
        for values, load, style in zip(_distance(compliance).T, ("traction", "pressure"),
                                       ("s--", "^--"), strict=True):
            meshes.loglog(sizes, values, style, color=grey,
                          label=f"{name}: compliance under {load}")
        for values, way, style in zip(result.missing[name].T, ("tangential", "normal"),
                                      ("s-", "^-"), strict=True):
            modes.semilogx(counts, 100.0 * values, style, label=f"{name}, {way}")
    return np.asarray(counts)


def _distance(values: Array) -> Array:
    """Relative distance (L - 1, k) of each mesh but the last from it."""
    return np.asarray(np.abs(values[:-1] / values[-1] - 1.0))
