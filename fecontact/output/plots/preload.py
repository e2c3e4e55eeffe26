"""Plots of quasi-static loading: shear and slip over the face, hysteresis loops."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.laws.ground.sliding import SlidingRotation
from fecontact.output.diagrams.colours import COLOURS, DASHES, STATE_COLOURS
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.face_panels import abscissa_unit, face_panels, scale_row
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import legend_label
from fecontact.reduction.assembly.contact_faces import several_bodies, shown_faces
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STATE_COLOURS = {"open": "#c8c4bc", **STATE_COLOURS}
# Labels of the displacement and the force of an action.
_LABELS = {
    "load": ("work of the load per scale [N m]", "scale of the load [-]"),
    "motion_x": ("displacement of the drive x [m]", "force of the drive [N]"),
    "motion_y": ("displacement of the drive y [m]", "force of the drive [N]"),
    "motion_z": ("displacement of the drive z [m]", "force of the drive [N]"),
    "travel": ("travel of the ground [m]", "force of the ground on the body [N]"),
    "travel_y": ("travel of the ground along y [m]", "force of the ground on the body [N]"),
}


def plot_shear(
    history: LoadHistory, vertex: int = -1, *, path: str | Path | None = None
) -> "Figure":
    """Plot shear and its limit, and the state of the nodes, along the face at a vertex of a path.

    The forces of each node are divided by its tributary length [N/m]; shear acts on the body in -x
    and lies within plus and minus mu times the normal force. Slip is the displacement relative to
    the ground. Of several bodies each interface has a column: there shear acts in the negative
    direction of the tangents, and slip is relative to the other side. Of one body each contact
    group has one. Columns of similar values have one scale.

    Of solids: maps of pressure, friction (with arrows of the force on the body), displacement and
    state over each face, seen along its normal from the body through its face.

    Parameters
    ----------
    history : LoadHistory
        The loading.
    vertex : int
        The vertex of the path, by default the last; the last point of a path that ended early.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a vertex that does not exist or was not reached, another suffix, or a file that cannot
        be written.
    """
    require_kind("plot_shear", LoadHistory, history=history)
    early = vertex == -1 and history.status != "finished"
    row = len(history) - 1 if early else history.row(vertex)
    if history.system.basis.dimension == 3:
        from fecontact.output.plots.solids.maps import shear_maps

        return shear_maps(history, row, path)
    basis = history.system.basis
    faces, length = shown_faces(basis, "contact at a load step"), basis.tributary
    shear = history.friction_force[row] / length
    limit = history.friction_limit[row] / length
    slip, states = history.slip[row], history.state(row).contact_state
    with new_figure(max(8.0, 4.5 * len(faces)), 6.4, path) as figure:
        panels = face_panels(figure, faces, 2, label="place along the face")
        other = "other side" if several_bodies(basis) else "ground"
        largest = np.maximum(np.abs(limit), np.abs(shear))
        forces = scale_row(panels[0], [float(largest[face.nodes].max()) for face in faces],
                           "friction force per length", "N/m")
        factors = scale_row(panels[1], [float(np.abs(slip[face.nodes]).max()) for face in faces],
                            f"displacement relative\nto the {other}", "m")
        legend: dict[str, Any] = {}
        for face, upper, lower, force, factor in zip(faces, *panels, forces, factors, strict=True):
            order = np.argsort(face.abscissa, kind="stable")
            x, nodes = face.abscissa[order] / abscissa_unit(face), face.nodes.start + order
            _line(upper, x, np.stack([limit, -limit, shear])[:, nodes] / force)
            for code, name in enumerate(STATES):
                at = states[nodes] == code
                if at.any():
                    upper.plot(x[at], shear[nodes][at] / force, "o", color=_STATE_COLOURS[name],
                               markersize=4.5, label=legend_label(name))
            lower.plot(x, slip[nodes] / factor, color=COLOURS[0], marker="o", markersize=3.0)
            handles, names = upper.get_legend_handles_labels()
            legend = dict(zip(names, handles, strict=True)) | legend
        figure.legend(legend.values(), legend, loc="outside upper center", ncols=5)
        figure.align_ylabels(panels[:, 0])
    return figure


def _line(axis: "Axes", x: Array, curves: Array) -> None:
    """Limit on both sides, and the shear between."""
    axis.plot(x, curves[0], color="#6a6a6a", linestyle=DASHES, label="limit")
    axis.plot(x, curves[1], color="#6a6a6a", linestyle=DASHES)
    axis.plot(x, curves[2], color="#303030", linewidth=1.0)


def plot_loop(
    history: LoadHistory, first: int = 0, last: int = -1, action: str | None = None, *,
    path: str | Path | None = None,
) -> "Figure":
    """Plot force over displacement along a path of loads, with the loss between two vertices.

    Parameters
    ----------
    history : LoadHistory
        The loading.
    first, last, action
        See :meth:`LoadHistory.loop`: vertices, and what acts.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For vertices that do not exist or were not reached, an unknown action, another suffix, or
        a file that cannot be written.
    """
    require_kind("plot_loop", LoadHistory, history=history)
    if len(history) < 2:
        raise InputError("plot_loop: the loading has one point only, so there is no curve; lower "
                         "its loads.")
    part = history.loop(first, last, action)
    wide, high = _LABELS.get(part.action, ("displacement of the force [m]", "force [N]"))
    if part.action == "travel" and any(
            isinstance(one, SlidingRotation) for one in history.system.sliding.values()):
        wide, high = "turn of the other side [rad]", "its moment [N m]"
    vertices = [row for row in history.path.rows_of_vertices
                if history.row(first) <= row <= history.row(last)]
    marks = np.array(vertices) - vertices[0]
    diagram = Diagram(wide, high, (
        Curve("", COLOURS[0], part.displacement, part.force),
        Curve("vertices of the path", COLOURS[1], part.displacement[marks], part.force[marks],
              0.0, 6.0)), title=f"friction loses {quantity(part.loss, 'J', 4)}")
    with new_figure(6.4, 5.2, path) as figure:
        plane = figure.subplots()
        draw(plane, diagram)
        plane.legend(loc="best")
    return figure
