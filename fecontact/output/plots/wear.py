"""Plots of the worn profile of a contact face."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.units import suitable_unit
from fecontact.integrate.wear import WearHistory
from fecontact.output.diagrams.colours import COLOURS
from fecontact.output.plots.face_panels import scale_row
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import legend_label
from fecontact.reduction.assembly.contact_faces import ContactFace, shown_faces
from fecontact.reduction.modal_basis import ModalBasis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PROFILES = 6  # drawn, the first and the last among them


def plot_wear(
    history: WearHistory, *, basis: ModalBasis | None = None, path: str | Path | None = None
) -> "Figure":
    """Plot the worn profile and the line load along the face, and the depth over the cycles.

    Columns of similar values have one scale. Of solids, whose basis has to be given, depth and mean
    pressure over the faces, and the depth over the cycles.

    Parameters
    ----------
    history : WearHistory
        Result of :func:`fecontact.integrate.wear_history`.
    basis : ModalBasis, optional
        Modal basis of the worn system: each of its interfaces or contact groups gets a column.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a basis of other contact nodes, another suffix, or a file that cannot be written.
    """
    from matplotlib import colormaps

    require_kind("plot_wear", WearHistory, history=history)
    length, blocks = history.tributary, len(history.cycles) - 1
    faces = _faces(history, basis)
    if basis is not None and basis.dimension == 3:
        from fecontact.output.plots.solids.maps import wear_maps

        return wear_maps(history, basis, _title(history), path)
    shown = np.unique(np.linspace(1, blocks, _PROFILES).round().astype(int))
    title = _title(history)
    with new_figure(max(9.0, 5.0 * len(faces)), 8.0, path) as figure:
        panels = figure.subplots(3, len(faces), squeeze=False)
        deepest = [float(history.depth[:, face.nodes].max()) for face in faces]
        loads = [float(np.abs(history.line_load[:, face.nodes]).max()) for face in faces]
        depth_units = scale_row(panels[0], deepest, "worn profile", "m")
        load_units = scale_row(panels[1], loads, "line load", "N/m")
        scale_row(panels[2], deepest, "worn depth", "m")
        for face, (profile, load, growth), depth_unit, load_unit in zip(
                faces, panels.T, depth_units, load_units, strict=True):
            order = np.argsort(face.abscissa)
            x, width = face.abscissa[order], face.tributary[order]
            edges = np.append(x - 0.5 * width, x[-1] + 0.5 * width[-1])
            unit, symbol = suitable_unit(float(np.abs(edges).max()), "m")
            depth = history.depth[:, face.nodes]
            for k in shown:
                colour = colormaps["viridis"](0.9 * (1.0 - k / blocks))
                profile.stairs(-depth[k][order] / depth_unit, edges / unit, baseline=None,
                               color=colour, label=_cycles(history.cycles[k]),
                               linewidth=1.5)
                load.stairs(history.line_load[k - 1][face.nodes][order] / load_unit, edges / unit,
                            baseline=None, color=colour, linewidth=1.5)
            profile.axhline(0.0, color="#303030", linewidth=0.8)
            load.set_xlabel(f"{face.label} [{symbol}]")
            area = length[face.nodes] / length[face.nodes].sum()
            for values, name, colour in ((depth.max(axis=1), "largest", COLOURS[1]),
                                         (depth @ area, "mean", COLOURS[0])):
                growth.plot(history.cycles, values / depth_unit, color=colour,
                            label=legend_label(name))
            growth.set_xlabel("cycles")
            profile.set_title(face.title or title)
        for panel in panels[1]:
            panel.set_ylim(bottom=0.0)  # not before all of the row are drawn
        if faces[0].title:
            figure.suptitle(title)
        for panel in panels[[0, 2], -1]:
            panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        figure.align_ylabels(panels[:, 0])
    return figure


def _title(history: WearHistory) -> str:
    return (f"{type(history.law).__name__}, {_cycles(history.acceleration, 4)} per computed "
            f"period")


def _cycles(number: float, digits: int = 6) -> str:
    """``1 cycle``, ``2500 cycles``."""
    return f"{number:.{digits}g} cycle" + ("" if number == 1.0 else "s")


def _faces(history: WearHistory, basis: ModalBasis | None) -> tuple[ContactFace, ...]:
    if basis is None:
        return (ContactFace("", (), slice(0, len(history.x)), history.x, "x", history.tributary),)
    require_kind("plot_wear", ModalBasis, basis=basis)
    if basis.contact_nodes != len(history.x):
        raise InputError(f"plot_wear: the basis has {basis.contact_nodes} contact nodes, but the "
                         f"wear history {len(history.x)}; give the basis of the worn system.")
    return shown_faces(basis, "wear")
