"""The ground below solids: a slab with lines that move with it, waves, and arrows of its motion."""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.scene import Arrows, Part, Scene, arrow_corners, move, shade
from fecontact.output.render.surfaces import ShadedSurface

_BESIDE = 0.16  # ground drawn on either side of the bodies, of their extent
_THICK = 0.035  # of the slab
_COLOUR, _LINES, _ARROW = "#efece6", "#b7b1a5", "#5c574e"
_FINE = 96  # cells of wavy ground along its longer side
_PER_LINE = 72  # points of a line over waves
_FEWEST, _MOST = 4, 12  # lines over the longer side
_SLOW = 1e-3  # of the largest speed, below which no arrow is drawn


def _extents(motion: Motion) -> tuple[float, Array, Array]:
    """Size of the bodies, and lower and upper corner (2,) of the ground that is drawn [m]."""
    low, high = motion.bounds[:, :2]
    extent = float((high - low).max())
    return extent, low - _BESIDE * extent, high + _BESIDE * extent


def ground_corners(motion: Motion) -> Array:
    """Corners (4, 3) of the part that is drawn [m]."""
    _, low, high = _extents(motion)
    x, y = np.meshgrid(*np.stack([low, high], axis=1))
    return np.column_stack([x.ravel(), y.ravel(), np.full(4, motion.ground_level)])


class SolidGround(Part):
    """The ground of a run of solids."""

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self._scene, self._motion = scene, motion
        self._extent, self._low, self._high = _extents(motion)
        self._wavy = motion.trajectory.system.ground.wavy
        self._lift = 1e-4 * self._extent
        self._add_slab()
        self._add_lines()
        self._add_arrows()

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        if self._wavy:
            heights = self._motion.ground(frame, self._flat)
            self._top.points[:, 2] = heights
            self._top.GetPoints().Modified()
            shade(self._top, self._shaded.normals(np.column_stack([self._flat, heights])))
            self._skirt.points[: len(self._around), 2] = heights[self._around]
            self._skirt.GetPoints().Modified()
        self._draw_lines(frame)
        self._draw_arrows(frame)

    def _add_slab(self) -> None:
        """Add the slab: its top as a grid, and a skirt around it."""
        motion, size = self._motion, self._high - self._low
        count = np.maximum(np.round(_FINE * size / size.max()).astype(int), 2) if self._wavy else (
            np.array([1, 1]))
        x, y = (np.linspace(self._low[k], self._high[k], count[k] + 1) for k in (0, 1))
        self._flat = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        number = np.arange(len(self._flat)).reshape(count + 1)
        tops = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]],
                        axis=-1).reshape(-1, 4)
        self._around = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1],
                                       number[0, :0:-1]])
        low = motion.trajectory.system.ground.height_range[0]
        bottom = motion.ground_level + min(motion.scale * low, 0.0) - _THICK * self._extent
        places = np.column_stack([self._flat, np.full(len(self._flat), motion.ground_level)])
        self._shaded = ShadedSurface(tops, np.arange(len(places)))
        self._top = self._mesh(places, tops, 0.62, point_data={
            "Normals": self._shaded.normals(places).astype(np.float32)})
        rim = places[self._around]
        foot = np.column_stack([rim[:, :2], np.full(len(rim), bottom)])
        here = np.arange(len(rim))
        after = np.roll(here, -1)
        self._skirt = self._mesh(np.concatenate([rim, foot]), np.column_stack(
            [here + len(rim), after + len(rim), after, here]), 0.50)

    def _mesh(self, places: Array, facets: Any, diffuse: float, **options: Any) -> Any:
        return self._scene.mesh(places, faces=facets, behind=2.0, color=_COLOUR, lighting=True,
                                ambient=0.42, diffuse=diffuse, specular=0.0, **options)

    def _add_lines(self) -> None:
        """Two families of lines fixed to the ground, as far apart as the eye can follow them."""
        travel, turn, _ = self._motion.ground_pose
        view = float((self._high - self._low).max())
        steps = np.linalg.norm(np.diff(travel, axis=0), axis=1) + 0.5 * view * np.abs(np.diff(turn))
        step = float(steps.max(initial=0.0))
        self._spacing = view / float(np.clip(view / max(4.0 * step, 1e-300), _FEWEST, _MOST))
        reach = float(np.linalg.norm(self._high - self._low))
        self._count = int(np.ceil(reach / self._spacing)) + 2
        self._parts = _PER_LINE if self._wavy else 2
        total = 2 * self._count * self._parts
        self._lines = self._scene.mesh(
            np.zeros((total, 3)), lines=np.arange(total).reshape(-1, self._parts), color=_LINES,
            line_width=self._scene.line)

    def _draw_lines(self, frame: int) -> None:
        travel, turn, centre = self._motion.ground_pose
        angle = float(turn[frame])
        cosine, sine = np.cos(angle), np.sin(angle)
        origin = centre + travel[frame] - np.array(
            [[cosine, -sine], [sine, cosine]]) @ centre
        middle = 0.5 * (self._low + self._high)
        found = []
        for normal in (np.array([cosine, sine]), np.array([-sine, cosine])):
            # Lines normal . (r - origin) = k spacing for whole numbers k around the middle.
            nearest = np.round(float(normal @ (middle - origin)) / self._spacing)
            k = nearest + np.arange(self._count) - self._count // 2
            start = origin + (k * self._spacing)[:, None] * normal
            along = np.array([-normal[1], normal[0]])
            found.append(self._clipped(start + ((middle - start) @ along)[:, None] * along, along))
        ends = np.concatenate(found)
        part = np.linspace(0.0, 1.0, self._parts)[:, None]
        flat = ends[:, :1] * (1.0 - part) + ends[:, 1:] * part
        heights = self._motion.ground(frame, flat) + self._lift
        move(self._lines, np.concatenate([flat, heights[..., None]], axis=-1).reshape(-1, 3))

    def _clipped(self, start: Array, along: Array) -> Array:
        """Ends (k, 2, 2) of lines through places (k, 2) in the rectangle; one place outside it."""
        first, last = np.full(len(start), -np.inf), np.full(len(start), np.inf)
        for axis in (0, 1):
            if abs(along[axis]) < 1e-12:
                outside = (start[:, axis] < self._low[axis]) | (start[:, axis] > self._high[axis])
                last = np.where(outside, -np.inf, last)
                continue
            bounds = np.stack([self._low[axis] - start[:, axis],
                               self._high[axis] - start[:, axis]]) / along[axis]
            first = np.maximum(first, bounds.min(axis=0))
            last = np.minimum(last, bounds.max(axis=0))
        empty = first >= last
        first, last = np.where(empty, 0.0, first), np.where(empty, 0.0, last)
        ends = start[:, None] + np.stack([first, last], axis=1)[..., None] * along
        return np.where(empty[:, None, None], self._low, ends)

    def _add_arrows(self) -> None:
        """Add arrows along the front that show the velocity of the ground."""
        place = self._low[1] + 0.45 * _BESIDE * self._extent
        x = np.linspace(self._low[0], self._high[0], 7)[1::2]
        self._arrow_places = np.column_stack([x, np.full(3, place)])
        speeds = [np.linalg.norm(self._motion.ground_velocity(frame, self._arrow_places), axis=1)
                  for frame in range(len(self._motion.times))]
        self._fastest = float(np.max(speeds))
        self._arrows = Arrows(self._scene, np.zeros((21, 3)), _ARROW) if self._fastest else None

    def _draw_arrows(self, frame: int) -> None:
        if self._arrows is None:
            return
        velocity = self._motion.ground_velocity(frame, self._arrow_places)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        along = velocity / np.maximum(speed, np.finfo(float).tiny)
        shown = (speed > _SLOW * self._fastest) * self._extent
        half, head, shaft, wing = (part * shown for part in (0.07, 0.055, 0.009, 0.027))
        tips = self._arrow_places + half * along
        flat = arrow_corners(tips, along, 2.0 * half, head, shaft, wing)
        heights = self._motion.ground(frame, flat) + 4.0 * self._lift
        if self._wavy:
            heights[:] = heights.max() + 4.0 * self._lift
        self._arrows.move(np.column_stack([flat, heights]))
