"""Plot of pressure and state of contact nodes over time and place, one map an interface."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.resolved import resolved
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.wear import WearLaw
from fecontact.output.diagrams.colours import STATE_COLOURS
from fecontact.output.diagrams.diagram import Diagram
from fecontact.output.diagrams.maps import Map, Scale
from fecontact.output.plots.drawing import colour_bar, draw
from fecontact.output.plots.face_panels import similar
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import add_note, state_names
from fecontact.reduction.assembly.contact_faces import ContactFace, shown_faces

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = {"open": "#e3e0da", **STATE_COLOURS}
_COLUMNS = 1500


def plot_contact_map(
    trajectory: Trajectory, *, times: Sequence[float] | None = None, wear: WearLaw | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot pressure [Pa] and state of the contact nodes over time and position.

    For a basis without thickness, the line load [N/m] takes the place of the pressure. In runs with
    more output times than columns of the picture, a column shows the largest pressure and the most
    frequent state of its times. The band of a node is as wide as its tributary length; places
    without contact face stay blank. States are open, stick and slip, or open and contact if all
    friction forces of the run are zero.

    Of several bodies each interface has a row of its own, of one body each contact group: over x on
    the ground and on faces along x, else over the arc length of the face, which increases along its
    tangents. Maps of similar loads share one scale.

    Faces of solids have two directions: below the shares of the states over time are maps of
    pressure, friction on the body as arrows, and state at some times. They are seen along the
    normals, from the body through its face; faces around an axis are unrolled.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    times : sequence of float, optional
        Times of the maps of solids, up to eight [s]; by default four, over the last period of a
        motion that has become periodic, else over the run.
    wear : EnergyWear or ArchardWear, optional
        Law of wear: for solids, adds maps of the depth worn since the start of the run.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written; for times out of the run, and for
        times or wear of plane bodies.
    """
    require_kind("plot_contact_map", Trajectory, trajectory=trajectory)
    require_kind("plot_contact_map", (WearLaw, type(None)), wear=wear)
    if trajectory.basis.dimension == 3:
        from fecontact.output.plots.solids.maps import contact_maps

        return contact_maps(trajectory, times, wear, path)
    for name, given in (("times", times), ("wear", wear)):
        if given is not None:
            raise InputError(f"plot_contact_map: {name} = {given!r} is for solids, but this run "
                             f"has plane bodies, whose maps show all times; leave it out.")
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    basis = trajectory.basis
    faces = shown_faces(basis, "contact map")
    single = not faces[0].name
    size = (10.0, 6.2) if single else (12.0, 0.9 + 2.6 * len(faces))
    with new_figure(*size, path) as figure:
        add_note(figure, drawn)
        grid = figure.subplots(2, 1, sharex=True).reshape(1, 2) if single else (
            figure.subplots(len(faces), 2, sharex=True, squeeze=False))
        columns = np.linspace(trajectory.time[0], trajectory.time[-1], _COLUMNS + 1)[:-1]
        starts = np.unique(np.searchsorted(trajectory.time, columns))
        edges = _time_edges(trajectory.time, starts)
        rows = [_face_rows(face) for face in faces]

        label, load = ("line load [N/m]", trajectory.line_load) if (
            basis.thickness is None) else ("contact pressure [Pa]", trajectory.pressure)
        highest = np.maximum.reduceat(load, starts, axis=0)
        limits = [float(highest[:, face.nodes].max()) for face in faces]
        common = similar(limits)
        states, spans = state_names(trajectory), _spans(trajectory.time)
        of_states = Scale("state", tuple(_COLOURS[name] for name in states), states)
        for number, (face, row) in enumerate(zip(faces, rows, strict=True)):
            top = max(limits) if common else limits[number]
            shown = _frequent_states(trajectory.contact_state[:, face.nodes], len(states), spans,
                                     starts)
            maps = (Map(edges, row.edges, row.of_nodes(highest[:, face.nodes]),
                        Scale(label, low=0.0, high=top or 1.0)),
                    Map(edges, row.edges, row.of_nodes(shown), of_states))
            for column, one in enumerate(maps):
                axis = grid[number, column]
                (image,) = draw(axis, Diagram("time [s]", row.label, maps=(one,)))
                shared = column == 1 or common
                if not shared or number == 0:
                    colour_bar(image, one, grid[:, column].tolist() if shared else axis)
                if len(row.edges) == 2:
                    axis.set_yticks([0.5 * (row.edges[0] + row.edges[1])], ["0"])
                if single or column == 0:
                    axis.set_title(face.title, loc="left")
        for axis in grid.ravel():
            axis.label_outer()
        figure.align_ylabels(grid.reshape(-1) if single else grid[:, 0])
    return figure


class _FaceRows(NamedTuple):
    """Rows of a map: borders (k + 1,), their nodes (k,), -1 without contact face; the label."""

    edges: Array
    nodes: NDArray[np.intp]
    label: str

    def of_nodes(self, values: NDArray[Any]) -> Array:
        """Values (k, T) of the rows from those of the nodes (T, n)."""
        return np.where(self.nodes[:, None] < 0, np.nan, values.T[self.nodes])


def _frequent_states(
    state: NDArray[np.int8], count: int, spans: Array, starts: NDArray[np.intp]
) -> NDArray[np.intp]:
    """States (k, n) of the columns of a map, of those (N, n) of all times."""
    state = np.minimum(state, count - 1)
    counts = np.stack([np.add.reduceat((state == k) * spans[:, None], starts, axis=0)
                       for k in range(count)])
    # A column of several times shows contact if any of them has it, as the pressure does.
    counts[0] *= counts[1:].sum(axis=0) == 0
    return np.asarray(counts.argmax(axis=0))


def _spans(time: Array) -> Array:
    """Duration (N,) that each of the times represents."""
    if len(time) == 1:
        return np.ones(1)
    edges = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    return np.asarray(np.diff(edges))


def _time_edges(time: Array, starts: NDArray[np.intp]) -> Array:
    """Borders (k + 1,) of the columns that begin at the given output times."""
    if len(time) == 1:
        return np.array([time[0] - 0.5, time[0] + 0.5])
    between = 0.5 * (time[starts[1:] - 1] + time[starts[1:]])
    return np.concatenate([time[:1], between, time[-1:]])


def _face_rows(face: ContactFace) -> _FaceRows:
    x, n = face.abscissa, len(face.abscissa)
    low, high = _bands(x, face.tributary)
    order = np.argsort(low + high, kind="stable")
    low, high, x = low[order], high[order], x[order]
    tiny = 1e-6 * float(high.max() - low.min())
    overlap = high[:-1] > low[1:] + tiny
    middle = 0.5 * (x[:-1] + x[1:])
    high[:-1] = np.where(overlap, middle, high[:-1])
    low[1:] = np.where(overlap, middle, low[1:])
    # Nodes one above the other share a band.
    if n == 1 or (overlap & (np.diff(x) <= tiny)).any():
        return _FaceRows(np.arange(n + 1, dtype=np.float64) - 0.5, np.arange(n), "contact node")
    apart = np.flatnonzero(low[1:] > high[:-1] + tiny) + 1
    edges = np.insert(np.append(low, high[-1]), apart, high[apart - 1])
    return _FaceRows(edges, np.insert(order, apart, -1), f"{face.label} [m]")


def _bands(x: Array, length: Array) -> tuple[Array, Array]:
    """Lower and upper ends (n,) of the tributary lengths along the face [m].

    They lie centred about the nodes, but follow one another from end to end of a part whose
    outer nodes lie on its ends, as they do where the displacement nodes are the contact nodes.
    """
    low, high = x - 0.5 * length, x + 0.5 * length
    order = np.argsort(x, kind="stable")
    reach = length[order]
    apart = np.diff(x[order]) > (1.0 + 1e-6) * (reach[1:] + reach[:-1])
    for part in np.split(order, np.flatnonzero(apart) + 1):
        ends = x[part[0]] + np.append(0.0, np.cumsum(length[part]))
        beyond = abs(ends[-1] - x[part[-1]])
        inside = np.minimum(x[part] - ends[:-1], ends[1:] - x[part])[1:-1]
        if beyond < 0.05 * length[part].min() and (inside > 0.05 * length[part][1:-1]).all():
            low[part], high[part] = ends[:-1], ends[1:]
    return low, high
