"""Parts of a scene of plane bodies: the bodies, the ground, contact nodes with their forces."""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.faces.surface import as_triangles
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.pixels import DARK
from fecontact.output.render.scene import (
    FORCE_COLOUR,
    MARGIN,
    Arrows,
    Bodies,
    Camera,
    Part,
    Scene,
    Shown,
    arrow_corners,
    move,
    paint,
    state_shades,
)
from fecontact.reduction.assembly.contact_faces import contact_faces

_GROUND, _SURFACE, _MARKS, _OUTLINE = "#e9e7e3", "#4d4d4d", "#9b978f", "#8c8c8c"

# Height of each layer towards the viewer, relative to the view's height.
_LAYERS = {"ground": 0.0, "marks": 0.01, "surface": 0.02, "body": 0.03, "reference": 0.04,
           "outline": 0.05, "force": 0.06, "rim": 0.07, "node": 0.08}

_DEPTH = 0.20  # of the view's height, for the ground
_LOW = 0.62  # of the height that body and waves leave, what is drawn of the ground
_ARROW = 0.15  # longest arrow, of the unit of sizes
_CORNERS = 20
_COLUMNS, _MOST_COLUMNS = 2, 8  # of the ground per pixel
_FOOT = 0.6  # radius of a foot on another body, of that of its contact node
_POINTS = 16  # per wave of the ground, to draw short waves smoothly


def plane_camera(motion: Shown, aspect: float) -> Camera:
    """The camera that shows body and ground in all frames."""
    (left, bottom), (right, top) = motion.bounds
    middle, width = 0.5 * (left + right), (right - left) / (1.0 - 2.0 * MARGIN)
    if not isinstance(motion, Motion) or not motion.has_ground:
        height = max(width / aspect, (top - bottom) / (1.0 - 2.0 * MARGIN))
        return Camera.facing(middle, 0.5 * (bottom + top - height), height)
    body, below = _reach(motion)
    height = max(width / aspect, _needed(body, below))
    # Spare height goes to the ground: left blank above the body it would look like a gap.
    depth = max(_DEPTH * height, _LOW * (height - body), below + 2.0 * MARGIN * height)
    return Camera.facing(middle, motion.ground_level - depth, height)


def needed_height(motion: Motion) -> float:
    """Height of the scene that body and ground need, as a part of its width."""
    (left, bottom), (right, top) = motion.bounds
    if not motion.has_ground:
        return float((top - bottom) / (right - left))
    return float(_needed(*_reach(motion)) * (1.0 - 2.0 * MARGIN) / (right - left))


def _reach(motion: Motion) -> tuple[float, float]:
    """Heights drawn above and below the level of the ground, of the body or the ground [m]."""
    bottom, top = motion.bounds[:, 1]
    low, high = motion.trajectory.system.ground.height_range
    return (max(top - motion.ground_level, motion.scale * high, 0.0),
            max(motion.ground_level - bottom, -motion.scale * low))


def _needed(body: float, below: float) -> float:
    return max(body / (1.0 - _DEPTH - MARGIN), (body + below) / (1.0 - 3.0 * MARGIN))


def _lifted(scene: Scene, layer: str, points: Array) -> Array:
    """Points (k, 2) on their layer (k, 3)."""
    return np.column_stack([points, np.full(len(points), _LAYERS[layer] * scene.camera.height)])


def _unit(scene: Scene) -> float:
    """Size that those of arrows and marks relate to."""
    return scene.camera.height * float(np.clip(1.0, 0.25 * scene.aspect, 0.5 * scene.aspect))


class PlaneBodies(Bodies):
    """The bodies in their colours, their outlines, and these at rest."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        super().__init__(scene, motion)
        field = motion.mode_shapes
        self.surfaces.append((scene.mesh(
            _lifted(scene, "body", field.nodes), faces=as_triangles(field.cells), scalars="colour",
            point_data={"colour": np.zeros(len(field.nodes))}, **self.colours),
            np.arange(len(field.nodes))))
        outline, _ = (
            scene.mesh(_lifted(scene, layer, field.nodes), lines=field.outline, color=colour,
                       line_width=scene.line)
            for layer, colour in (("outline", DARK), ("reference", _OUTLINE)))
        self.lines.append(outline)


class PlaneGround(Part):
    """The ground in section, with marks that move with it."""

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self._motion, camera = motion, scene.camera
        half, bottom = 0.5 * scene.aspect * camera.height, camera.focus[1] - 0.5 * camera.height
        self._x = camera.focus[0] - half, camera.focus[0] + half
        ground, view = motion.trajectory.system.ground, 2.0 * half
        wave = ground.shortest_wavelength if ground.wavy else None
        count = 2 if wave is None else int(np.clip(
            _POINTS * view / wave, _COLUMNS * scene.width, _MOST_COLUMNS * scene.width))
        self._along = np.linspace(*self._x, count)
        top = np.column_stack([self._along, np.full(count, motion.ground_level)])
        below = np.column_stack([self._along, np.full(count, bottom - camera.height)])
        number = np.arange(count - 1)
        cells = np.column_stack([number, number + 1, number + 1 + count, number + count])
        self._ground = scene.mesh(_lifted(scene, "ground", np.vstack([top, below])), faces=cells,
                                  color=_GROUND)
        self._surface = scene.mesh(_lifted(scene, "surface", top), color=_SURFACE,
                                   lines=np.column_stack([number, number + 1]),
                                   line_width=1.5 * scene.line)
        self._place_marks(_unit(scene))
        points = np.zeros((2 * len(self._marks), 2))
        self._lines = scene.mesh(_lifted(scene, "marks", points), color=_MARKS,
                                 lines=np.arange(len(points)).reshape(-1, 2),
                                 line_width=scene.line)

    def _place_marks(self, unit: float) -> None:
        """Slanted marks that move with the ground, spaced so that the eye can follow them."""
        view = self._x[1] - self._x[0]
        self._travel = self._motion.ground_pose[0][:, 0]
        step = np.abs(np.diff(self._travel)).max(initial=0.0)
        spacing = view / np.clip(view / max(4.0 * step, 1e-300), 4, 36)
        count = 4 * int(np.ceil((np.ceil(view / spacing) + 4) / 4))
        self._spacing, self._period = spacing, count * spacing
        self._marks = np.arange(count) * spacing
        size = min(0.035 * unit, 0.8 * spacing)
        self._mark_size = np.where(np.arange(count) % 4 == 0, 2.0 * size, size)

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        if self._motion.trajectory.system.ground.wavy:
            top = self._motion.ground(frame, self._along[:, None])
            for mesh in (self._ground, self._surface):
                mesh.points[: len(top), 1] = top
                mesh.GetPoints().Modified()
        shifted = np.mod(self._marks + self._travel[frame], self._period)
        x = self._x[0] - 2.0 * self._spacing + shifted
        start = np.column_stack([x, self._motion.ground(frame, x[:, None])])
        end = start - self._mark_size[:, None] * np.array([0.7, 1.0])
        move(self._lines, np.stack([start, end], axis=1).reshape(-1, 2))


class ContactMarks(Part):
    """Contact nodes in the colours of their states, and their forces as arrows."""

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self._motion, self._unit = motion, _unit(scene)
        basis = motion.trajectory.basis
        feet, line, pixel = len(motion.footed), scene.line, scene.pixel
        n = basis.contact_nodes + feet
        spacing = min(np.ptp(face.abscissa) / max(len(face.abscissa) - 1, 1) or scene.camera.height
                      for face in contact_faces(basis))
        radius = float(np.clip(0.42 * spacing, 2.0 * line * pixel, 4.5 * line * pixel))
        # Feet are smaller than the nodes that they belong to.
        self._radius = radius * np.append(np.ones(n - feet), np.full(feet, _FOOT))[:, None]
        self._slim = float(np.clip(spacing / (14.0 * line * pixel), 0.35, 1.0))
        angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
        self._circle = np.column_stack([np.cos(angle), np.sin(angle)])
        rings = np.arange(n * _CORNERS).reshape(n, _CORNERS)
        places = np.zeros((n * _CORNERS, 2))
        self._rims = scene.mesh(_lifted(scene, "rim", places), faces=rings, color=DARK)
        self._nodes: Any = scene.mesh(
            _lifted(scene, "node", places), faces=rings, scalars="colour", rgb=True,
            cell_data={"colour": np.zeros((n, 3), dtype=np.uint8)})
        self._rim = line * pixel
        self._arrows = Arrows(scene, _lifted(scene, "force", np.zeros((7 * n, 2))), FORCE_COLOUR)
        self._colours = state_shades(motion.state_names)

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        centres = self._motion.contact_places(frame)
        for mesh, radius in ((self._nodes, self._radius), (self._rims, self._radius + self._rim)):
            move(mesh, (centres[:, None] + radius[:, None] * self._circle).reshape(-1, 2))
        paint(self._nodes.cell_data, self._colours[self._motion.states[frame]])
        if self._motion.largest_force > 0.0:
            self._arrows.move(self.force_corners(centres, self._motion.forces[frame]))

    def force_corners(self, nodes: Array, forces: Array) -> Array:
        """Corners (7 k, 2) of the arrows of forces (k, 2) that end at nodes (k, 2)."""
        size = np.linalg.norm(forces, axis=1, keepdims=True)
        along = np.divide(forces, size, out=np.zeros_like(forces), where=size > 0.0)
        length = _ARROW * self._unit * size / self._motion.largest_force
        thick = self._slim * np.minimum(1.0, length / (0.05 * self._unit)) * self._unit
        return arrow_corners(nodes - self._radius * along, along, length,
                             np.minimum(0.035 * thick, 0.6 * length), 0.0045 * thick, 0.014 * thick)
