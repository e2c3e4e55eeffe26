"""Panels along contact faces: one column an interface, or a contact group of a single body."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.core.units import suitable_unit
from fecontact.reduction.assembly.contact_faces import ContactFace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIMILAR = 0.2  # of the largest, from which on panels have one scale


def face_panels(
    figure: "Figure", faces: Sequence[ContactFace], rows: int, *, label: str | None = None
) -> NDArray[np.object_]:
    """Axes (rows, faces) that share their scales along a face.

    Titles name interface and bodies, the labels of the lowest row the position along the face, or
    ``label`` for a single body.
    """
    panels = figure.subplots(rows, len(faces), sharex="col", squeeze=False)
    for face, column in zip(faces, panels.T, strict=True):
        column[0].set_title(face.title)
        symbol = suitable_unit(_extent(face), "m")[1]
        column[-1].set_xlabel(f"{label if label and not face.name else face.label} [{symbol}]")
    return np.asarray(panels)


def similar(sizes: Sequence[float]) -> bool:
    """Whether the largest values of several panels are so much alike that one scale suits all."""
    above = [size for size in sizes if size > 0.0] or [0.0]
    return min(above) >= _SIMILAR * max(above)


def scale_row(
    row: Sequence["Axes"], sizes: Sequence[float], name: str, unit: str
) -> list[float]:
    """Label a row of panels before anything is drawn into it, and return the factors of units.

    Panels of similar ``sizes``, the largest values of each in SI units, share one scale and one
    label; others have their own.
    """
    if similar(sizes):
        factor, symbol = suitable_unit(max(sizes), unit)
        row[0].set_ylabel(f"{name} [{symbol}]")
        for panel in row[1:]:
            panel.sharey(row[0])
            panel.tick_params(labelleft=False)
        return [factor] * len(row)
    chosen = [suitable_unit(size, unit) for size in sizes]
    for panel, size, (_, symbol) in zip(row, sizes, chosen, strict=True):
        panel.set_ylabel(f"{name} [{symbol}]")
        if size == 0.0:
            panel.set_yticks([0.0])
    return [factor for factor, _ in chosen]


def abscissa_unit(face: ContactFace) -> float:
    """Factor of the unit [m] in which :func:`face_panels` labels places along a face."""
    return suitable_unit(_extent(face), "m")[0]


def _extent(face: ContactFace) -> float:
    return float(np.abs(face.abscissa).max(initial=0.0) or face.tributary.max(initial=0.0))
