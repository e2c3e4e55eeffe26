"""Plot of pressures and friction between half-spaces."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.half_space.friction import HalfSpaceFriction
from fecontact.half_space.normal_contact import HalfSpaceContact
from fecontact.output.diagrams.diagram import Diagram
from fecontact.output.diagrams.maps import Map, Scale
from fecontact.output.plots.drawing import colour_bar, draw
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.solids.maps import OPEN

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_half_space(
    found: HalfSpaceContact | HalfSpaceFriction, point: int = -1, *,
    path: str | Path | None = None,
) -> "Figure":
    """Plot maps of pressure and gap between two half-spaces, or of pressure, traction and slip.

    Slip is the distance slid since the start, zero where the surfaces stick.

    Parameters
    ----------
    found : HalfSpaceContact or HalfSpaceFriction
        Result of :func:`fecontact.half_space.half_space_contact`, or of
        :func:`fecontact.half_space.half_space_friction`.
    point : int
        Point of the path of friction, from 0; by default the last.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a point that does not exist, another suffix, or a file that cannot be written.
    """
    owner = "plot_half_space"
    require_kind(owner, (HalfSpaceContact, HalfSpaceFriction), found=found)
    require_kind(owner, int, point=point)
    contact = found if isinstance(found, HalfSpaceContact) else found.contact
    maps = [("pressure [Pa]", contact.pressure, "inferno", contact.touching)]
    if isinstance(found, HalfSpaceContact):
        maps.append(("gap [m]", contact.gap, "viridis", ~contact.touching))
    else:
        steps = len(found.loss)
        if not -steps <= point < steps:
            raise InputError(f"{owner}: point = {point} must be from 0 to {steps - 1}, or from "
                             f"-{steps} to -1 from the end.")
        maps += [("traction [Pa]", np.linalg.norm(found.traction[point], axis=-1), "inferno",
                  contact.touching),
                 ("slip [m]", np.linalg.norm(found.slip[point], axis=-1), "viridis",
                  contact.touching)]
    x, y = (side * (np.arange(count + 1) - 0.5 * count) for side, count in zip(
        contact.sides, contact.pressure.shape, strict=True))
    with new_figure(4.3 * len(maps), 3.8, path) as figure:
        axes = figure.subplots(1, len(maps), squeeze=False)[0]
        for axis, (label, values, colours, shown) in zip(axes, maps, strict=True):
            one = Map(x, y, np.where(shown, values, np.nan).T, Scale(label, colours, low=0.0), OPEN)
            (image,) = draw(axis, Diagram("x [m]", "y [m]", maps=(one,)))
            axis.set_aspect("equal")
            colour_bar(image, one, axis)
    return figure
