"""Panels along contact faces: one column an interface, one for all nodes of a single body."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.core.units import suitable_unit
from fecontact.reduction.assembly.contact_faces import ContactFace

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def face_panels(
    figure: "Figure", faces: Sequence[ContactFace], rows: int, *, label: str | None = None
) -> NDArray[np.object_]:
    """Axes (rows, faces) that share their scales along a row and along a face.

    Titles name interface and bodies, the labels of the lowest row the position along the face, or
    ``label`` for a single body.
    """
    panels = figure.subplots(rows, len(faces), sharex="col", sharey="row", squeeze=False)
    for face, column in zip(faces, panels.T, strict=True):
        column[0].set_title(face.title)
        symbol = suitable_unit(_extent(face), "m")[1]
        column[-1].set_xlabel(f"{label if label and not face.name else face.label} [{symbol}]")
    return np.asarray(panels)


def abscissa_unit(face: ContactFace) -> float:
    """Factor of the unit [m] in which :func:`face_panels` labels places along a face."""
    return suitable_unit(_extent(face), "m")[0]


def _extent(face: ContactFace) -> float:
    return float(np.abs(face.abscissa).max(initial=0.0) or face.tributary.max(initial=0.0))
