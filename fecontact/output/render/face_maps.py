"""Maps of contact faces beside the picture of solids: pressure with friction, state, wear."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.output.plots.solids.plans import FacePlan, draw_arrows, draw_plan
from fecontact.output.render.canvas import canvas_of
from fecontact.output.render.pixels import DARK
from fecontact.output.render.scene import NODE_COLOURS
from fecontact.output.render.solid_motion import SolidMotion

Image = NDArray[np.uint8]

PRESSURE_MAP, WEAR_MAP = "inferno", "copper_r"
_SIDE = 0.03  # free on the left and right, of the width
_TITLE = 1.6  # room above each map, in sizes of text
_GAP = 0.5  # between maps


class _Map(NamedTuple):
    """One map: its title, face, the colours (k, 4) of a frame, and whether it has arrows."""

    title: str
    plan: FacePlan
    colours: Callable[[int], Array]
    arrows: bool


@dataclass(frozen=True, eq=False)
class FaceMaps:
    """A column of maps of the contact faces of solids.

    Attributes
    ----------
    motion : SolidMotion
    width, height : int
        Size in pixels.
    font : float
        Size of text in points, at 100 pixels an inch.
    """

    motion: SolidMotion
    width: int
    height: int
    font: float

    def image(self, frame: int) -> Image:
        """The column (height, width, 3) at a frame."""
        canvas, background, drawn = self._drawn
        canvas.restore_region(background)
        friction = self.motion.friction[frame]
        for one, axes, patches, arrows, lines in drawn:
            patches.set_facecolors(one.colours(frame))
            axes.draw_artist(patches)
            for line in lines:
                axes.draw_artist(line)
            if arrows is not None:
                along = one.plan.directions(friction[one.plan.face.nodes])
                arrows.set_UVC(*along.T)
                axes.draw_artist(arrows)
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()

    @cached_property
    def _maps(self) -> list[_Map]:
        from matplotlib import colormaps
        from matplotlib.colors import to_rgba_array

        motion, found = self.motion, []
        states = to_rgba_array([NODE_COLOURS[name] for name in motion.state_names])
        for plan in motion.plans:
            nodes, name = plan.face.nodes, f"{plan.face.name}: " if plan.face.name else ""

            def pressure(frame: int, nodes: slice = nodes) -> Array:
                part = motion.pressures[frame, nodes] / (motion.largest_pressure or 1.0)
                return np.asarray(colormaps[PRESSURE_MAP](part))

            def state(frame: int, nodes: slice = nodes) -> Array:
                return np.asarray(states[motion.states[frame, nodes]])

            has_friction = motion.largest_friction > 0.0
            found.append(_Map(f"{name}pressure" + " and friction" * has_friction, plan, pressure,
                              has_friction))
            found.append(_Map(f"{name}state", plan, state, False))
            if motion.worn is not None:
                deepest = float(motion.worn.max()) or 1.0

                def worn(frame: int, nodes: slice = nodes, deepest: float = deepest) -> Array:
                    assert motion.worn is not None
                    return np.asarray(colormaps[WEAR_MAP](motion.worn[frame, nodes] / deepest))

                found.append(_Map(f"{name}worn, up to {quantity(deepest, 'm')}", plan, worn,
                                  False))
        return found

    def _columns(self) -> int:
        """Number of columns that shows the maps largest."""
        maps = self._maps
        best, chosen = 0.0, 1
        for columns in range(1, len(maps) + 1):
            rows = -(-len(maps) // columns)
            width = self.width * (1.0 - 2.0 * _SIDE) / columns - _GAP * self._size
            height = self.height / rows - (_TITLE + _GAP) * self._size
            sizes = [min(width, height * one.plan.aspect) * min(width / one.plan.aspect, height)
                     for one in maps]
            if height > 0.0 and width > 0.0 and min(sizes) > best * 1.02:
                best, chosen = min(sizes), columns
        return chosen

    @property
    def _size(self) -> float:
        """Height of text in pixels."""
        return self.font * 100.0 / 72.0

    @cached_property
    def _drawn(self) -> tuple[Any, Any, list[Any]]:
        """Canvas, what does not change, and what does."""
        figure, canvas = canvas_of(self.width, self.height)
        maps, columns = self._maps, self._columns()
        rows, drawn = -(-len(maps) // columns), []
        wide, high = (1.0 - 2.0 * _SIDE) / columns, 1.0 / rows
        title, gap = _TITLE * self._size / self.height, _GAP * self._size
        for number, one in enumerate(maps):
            row, column = divmod(number, columns)
            left, below = _SIDE + column * wide, 1.0 - (row + 1) * high
            axes = figure.add_axes((left, below + gap / self.height, wide - gap / self.width,
                                    high - title - gap / self.height))
            patches = draw_plan(axes, one.plan, line=0.055 * self.font, frame=False)
            axes.set_axis_off()
            axes.set_anchor("N")
            first, second = one.plan.labels
            seen = f"   → {first}  ↑ {second}" if number == 0 or first not in "xyz" else ""
            axes.set_title(one.title + seen, parse_math=False, fontsize=0.92 * self.font,
                           color=DARK, loc="center",
                           family="DejaVu Sans", pad=0.35 * self.font)
            lines = [line for line in axes.collections if line is not patches]
            arrows = draw_arrows(axes, one.plan, np.zeros_like(one.plan.places),
                                 self.motion.largest_friction, line=0.05 * self.font) if (
                one.arrows) else None
            drawn.append((one, axes, patches, arrows, lines))
        changing = [artist for _, _, patches, arrows, lines in drawn
                    for artist in (patches, arrows, *lines) if artist is not None]
        for artist in changing:
            artist.set_visible(False)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
        for artist in changing:
            artist.set_visible(True)
        return canvas, background, drawn
