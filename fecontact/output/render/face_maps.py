"""Maps of contact faces beside the picture of solids: pressure with friction, state, wear."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.output.diagrams.colours import PRESSURE_MAP, WEAR_MAP
from fecontact.output.plots.solids.plans import FacePlan, draw_arrows, draw_plan
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.overlay import FONT, Overlay
from fecontact.output.render.pixels import DARK
from fecontact.output.render.scene import NODE_COLOURS

_SIDE = 0.03  # free on the left and right, of the width
_TITLE = 1.6  # height above each map, in sizes of text
_GAP = 0.5  # between maps


class _FaceMap(NamedTuple):
    """One map: its title, face, the colours (k, 4) of a frame, and whether it has arrows."""

    title: str
    plan: FacePlan
    colours: Callable[[int], Array]
    arrows: bool = False


def draw_face_maps(overlay: Overlay, motion: Motion, place: tuple[int, int, int, int]) -> None:
    """Draw maps of the contact faces of solids into a part of the picture.

    ``place`` is its left and upper end, its width and its height [pixels].
    """
    strip, width, height = overlay.strip(*place), place[2], place[3]
    font, text = FONT * overlay.size, FONT * overlay.size * 100.0 / 72.0
    maps, title, gap = _face_maps(motion), _TITLE * text, _GAP * text
    columns = _columns(maps, width, height, title, gap)
    wide, high = (1.0 - 2.0 * _SIDE) / columns, 1.0 / -(-len(maps) // columns)
    for number, one in enumerate(maps):
        row, column = divmod(number, columns)
        axes = strip.inset_axes((_SIDE + column * wide, 1.0 - (row + 1) * high + gap / height,
                                 wide - gap / width, high - (title + gap) / height))
        patches = draw_plan(axes, one.plan, line=0.055 * font, frame=False)
        axes.set_axis_off()
        axes.set_anchor("N")
        first, second = one.plan.labels
        seen = f"   → {first}  ↑ {second}" if number == 0 or first not in "xyz" else ""
        axes.set_title(one.title + seen, parse_math=False, fontsize=0.92 * font, color=DARK,
                       family="DejaVu Sans", pad=0.35 * font)
        artists = [patches, *(line for line in axes.collections if line is not patches)]
        if one.arrows:
            artists.append(draw_arrows(axes, one.plan, np.zeros_like(one.plan.places),
                                       motion.largest_friction, line=0.05 * font))
        overlay.changing(partial(_bring, one, motion, artists), *artists)


def _bring(one: _FaceMap, motion: Motion, artists: list[Any], frame: int) -> None:
    """Bring the patches and arrows of a map to a frame."""
    artists[0].set_facecolors(one.colours(frame))
    if one.arrows:
        along = one.plan.directions(motion.friction[frame, one.plan.face.nodes])
        artists[-1].set_UVC(*along.T)


def _face_maps(motion: Motion) -> list[_FaceMap]:
    from matplotlib.colors import to_rgba_array

    states = to_rgba_array([NODE_COLOURS[name] for name in motion.state_names])
    rubs = motion.largest_friction > 0.0
    found = []
    for plan in motion.plans:
        nodes, name = plan.face.nodes, f"{plan.face.name}: " if plan.face.name else ""
        found += [
            _FaceMap(f"{name}pressure" + " and friction" * rubs, plan, _shades(
                motion.pressures[:, nodes], motion.largest_pressure, PRESSURE_MAP), rubs),
            _FaceMap(f"{name}state", plan, partial(_of_states, states, motion.states[:, nodes]))]
        if motion.worn is not None:
            deepest = float(motion.worn.max()) or 1.0
            found.append(_FaceMap(f"{name}worn, up to {quantity(deepest, 'm')}", plan, _shades(
                motion.worn[:, nodes], deepest, WEAR_MAP)))
    return found


def _of_states(colours: Array, states: NDArray[np.int8], frame: int) -> Array:
    return colours[states[frame]]


def _shades(values: Array, largest: float, colours: str) -> Callable[[int], Array]:
    """Colours of values (F, k) in each frame."""
    from matplotlib import colormaps

    return lambda frame: np.asarray(colormaps[colours](values[frame] / (largest or 1.0)))


def _columns(
    maps: list[_FaceMap], width: float, height: float, title: float, gap: float
) -> int:
    """Number of columns that shows the maps largest."""
    best, chosen = 0.0, 1
    for columns in range(1, len(maps) + 1):
        wide = width * (1.0 - 2.0 * _SIDE) / columns - gap
        high = height / -(-len(maps) // columns) - title - gap
        sizes = [min(wide, high * one.plan.aspect) * min(wide / one.plan.aspect, high)
                 for one in maps]
        if high > 0.0 and wide > 0.0 and min(sizes) > best * 1.02:
            best, chosen = min(sizes), columns
    return chosen
