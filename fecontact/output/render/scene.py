"""Scene of a picture, drawn by VTK: body, ground, contact nodes and forces."""

from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.output.plots.style import STATE_COLOURS
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.offscreen import known_window
from fecontact.reduction.assembly.contact_faces import contact_faces
from fecontact.reduction.mode_shapes import ModeShapes

COLOUR_MAPS = {"displacement": "viridis", "von_mises": "cividis"}
NODE_COLOURS = {"open": "#ffffff", **STATE_COLOURS}
FORCE_COLOUR = "#b2182b"
DARK = "#303030"
_GROUND, _SURFACE, _MARKS, _OUTLINE = "#e9e7e3", "#4d4d4d", "#9b978f", "#8c8c8c"

# Height of each layer towards the viewer, relative to the view's height.
_LAYERS = {"ground": 0.0, "marks": 0.01, "surface": 0.02, "body": 0.03, "reference": 0.04,
           "outline": 0.05, "force": 0.06, "rim": 0.07, "node": 0.08}

_MARGIN = 0.05  # of the view, beside and above the body
_DEPTH = 0.20  # of the view's height, for the ground
_LOW = 0.62  # of the height that body and waves leave, what is drawn of the ground
_ARROW = 0.15  # longest arrow, of the unit of sizes
_CORNERS = 20
_COLUMNS, _MOST_COLUMNS = 2, 8  # of the ground per pixel
_FOOT = 0.6  # radius of a foot on another body, of that of its contact node
_LABEL_SIZE = 13.0  # height of the bodies' names, in thin lines
_POINTS = 16  # per wave of the ground, to draw short waves smoothly


class BodyMotion(Protocol):
    """A body that moves: what :class:`BodyScene` draws; see :class:`Motion`."""

    @property
    def mode_shapes(self) -> ModeShapes:
        """Nodes, cells and outline of the body."""

    @property
    def colour(self) -> str:
        """What the body is coloured by, one of :data:`COLOUR_MAPS`."""

    @property
    def largest_colour(self) -> float:
        """Upper end of the colour range; the lower end is zero."""

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Smallest and largest x, smallest and largest y that the drawn body reaches [m]."""

    @property
    def labels(self) -> tuple[tuple[str, int], ...]:
        """Names of the bodies of several, and the nodes at which they stand."""

    def body(self, frame: int) -> tuple[Array, Array]:
        """Drawn positions (N, 2) of the nodes [m] and their colour values (N,)."""


class BodyScene:
    """Renderer of the frames of a body alone; a context manager.

    Parameters
    ----------
    motion : BodyMotion
    width, height : int
        Size of the images in pixels.
    line : float
        Width of thin lines in pixels of the image.
    fineness : int
        Pixels rendered for each pixel of the image, in both directions; their mean is what one
        sees. VTK's own smoothing of edges is slower in software and looks worse.
    """

    def __init__(self, motion: BodyMotion, width: int, height: int, *, line: float = 1.0,
                 fineness: int = 2) -> None:
        with known_window():
            import pyvista

            self._pyvista: Any = pyvista
            self._shown = motion
            self._fineness = fineness
            self._names = [(label_image(name, _LABEL_SIZE * line), node)
                           for name, node in motion.labels]
            self._plotter: Any = self._pyvista.Plotter(
                off_screen=True, window_size=[fineness * width, fineness * height])
            self._plotter.disable_anti_aliasing()
            self._plotter.set_background("white")
            self._aim(width / height)
            self._add_body(fineness * line)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._plotter.close()

    def image(self, frame: int) -> NDArray[np.uint8]:
        """Picture (height, width, 3) of a frame."""
        self._draw(frame)
        self._plotter.render()
        image = reduced(np.asarray(self._plotter.screenshot(None, return_img=True)),
                         self._fineness)
        for label, node in self._names:
            blend(image, label, *self._pixel(self._body.points[node, :2], image.shape))
        return image

    def _pixel(self, place: Array, shape: tuple[int, ...]) -> tuple[int, int]:
        """Row and column of a place in a picture."""
        size = self._height / shape[0]
        middle = self._plotter.camera.focal_point[0]
        return (round(shape[0] - (place[1] - self._bottom) / size),
                round(0.5 * shape[1] + (place[0] - middle) / size))

    def _draw(self, frame: int) -> None:
        places, colours = self._shown.body(frame)
        self._move(self._body, places)
        self._body.point_data["colour"][:] = colours
        self._body.GetPointData().GetScalars().Modified()
        self._move(self._edges, places)

    def _aim(self, aspect: float) -> None:
        """Place the camera so that the body fills the picture in all frames."""
        left, right, bottom, top = self._shown.box
        height = max((right - left) / aspect, top - bottom) / (1.0 - 2.0 * _MARGIN)
        self._point_camera(0.5 * (left + right), 0.5 * (bottom + top - height), height)

    def _point_camera(self, middle: float, bottom: float, height: float) -> None:
        self._height, self._bottom = height, bottom
        camera = self._plotter.camera
        centre = (middle, bottom + 0.5 * height, 0.0)
        camera.focal_point = centre
        camera.position = (centre[0], centre[1], 10.0 * height)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_projection = True
        camera.parallel_scale = 0.5 * height
        camera.clipping_range = (5.0 * height, 15.0 * height)

    def _add(self, layer: str, points: Array, **options: Any) -> Any:
        """A mesh of points (k, 2) and ``faces`` or ``lines``, on its layer."""
        style = {name: options.pop(name) for name in ("faces", "lines") if name in options}
        flat = {name: np.hstack([np.full((len(cells), 1), cells.shape[1]), cells]).ravel()
                for name, cells in style.items()}
        mesh = self._pyvista.PolyData(self._lifted(layer, points), **flat)
        for name in ("point_data", "cell_data"):
            getattr(mesh, name).update(options.pop(name, {}))
        self._plotter.add_mesh(mesh, lighting=False, show_scalar_bar=False, reset_camera=False,
                               copy_mesh=False, render=False, **options)
        return mesh

    def _lifted(self, layer: str, points: Array) -> NDArray[np.float32]:
        height = np.full((len(points), 1), _LAYERS[layer] * self._height)
        return np.hstack([points, height]).astype(np.float32)

    @staticmethod
    def _move(mesh: Any, points: Array) -> None:
        mesh.points[:, :2] = points
        mesh.GetPoints().Modified()

    def _add_body(self, line: float) -> None:
        motion, field = self._shown, self._shown.mode_shapes
        largest = motion.largest_colour or 1.0
        self._body = self._add(
            "body", field.nodes, faces=field.cells, scalars="colour",
            point_data={"colour": np.zeros(len(field.nodes))}, cmap=COLOUR_MAPS[motion.colour],
            clim=(0.0, largest), interpolate_before_map=True, n_colors=256)
        self._edges = self._add("outline", field.nodes, lines=field.outline, color=DARK,
                                line_width=line)
        self._add("reference", field.nodes, lines=field.outline, color=_OUTLINE,
                  line_width=line)


class Scene(BodyScene):
    """Renderer of the frames of a run, with ground, contact nodes and forces.

    Parameters as for :class:`BodyScene`, the motion one of a run.
    """

    def __init__(self, motion: Motion, width: int, height: int, *, line: float = 1.0,
                 fineness: int = 2) -> None:
        self._motion = motion
        super().__init__(motion, width, height, line=line, fineness=fineness)
        if motion.has_ground:
            self._add_ground(width, fineness * line)
        self._touches = motion.trajectory.system.basis.contact_nodes > 0
        if self._touches:
            self._add_contact(fineness * line)

    def _draw(self, frame: int) -> None:
        super()._draw(frame)
        if self._motion.has_ground:
            self._draw_ground(frame)
        if self._touches:
            self._draw_contact(frame)

    def _aim(self, aspect: float) -> None:
        """Place the camera so that body and ground fill the picture in all frames."""
        if not self._motion.has_ground:
            super()._aim(aspect)
            self._unit = _drawn_unit(self._height, aspect)
            return
        left, right, _, _ = self._motion.box
        level = self._motion.ground_level
        body, below = _reach(self._motion)
        height = max((right - left) / (1.0 - 2.0 * _MARGIN) / aspect, _needed(body, below))
        # What is left over goes to the ground: blank above the body it would look like a gap.
        depth = max(_DEPTH * height, _LOW * (height - body), below + 2.0 * _MARGIN * height)
        middle = 0.5 * (left + right)
        self._unit = _drawn_unit(height, aspect)
        self._x = (middle - 0.5 * aspect * height, middle + 0.5 * aspect * height)
        self._point_camera(middle, level - depth, height)

    def _add_ground(self, width: int, line: float) -> None:
        ground, view = self._motion.trajectory.system.ground, self._x[1] - self._x[0]
        wave = ground.shortest_wavelength if ground.wavy else None
        count = 2 if wave is None else int(np.clip(
            _POINTS * view / wave, _COLUMNS * width, _MOST_COLUMNS * width))
        self._ground_x = np.linspace(*self._x, count)
        top = np.column_stack([self._ground_x, np.full(count, self._motion.ground_level)])
        below = np.column_stack([self._ground_x, np.full(count, self._bottom - self._height)])
        number = np.arange(count - 1)
        cells = np.column_stack([number, number + 1, number + 1 + count, number + count])
        self._ground = self._add("ground", np.vstack([top, below]), faces=cells, color=_GROUND)
        self._surface = self._add("surface", top, lines=np.column_stack([number, number + 1]),
                                  color=_SURFACE, line_width=1.5 * line)
        self._place_marks()
        points = np.zeros((2 * len(self._marks), 2))
        self._mark_lines = self._add(
            "marks", points, lines=np.arange(len(points)).reshape(-1, 2), color=_MARKS,
            line_width=line)

    def _place_marks(self) -> None:
        """Slanted marks that move with the ground, spaced so that the eye can follow them."""
        view = self._x[1] - self._x[0]
        step = np.abs(np.diff(self._motion.travel)).max(initial=0.0)
        spacing = view / np.clip(view / max(4.0 * step, 1e-300), 4, 36)
        count = int(np.ceil(view / spacing)) + 4
        self._spacing, self._period = spacing, 4 * int(np.ceil(count / 4)) * spacing
        self._marks = np.arange(4 * int(np.ceil(count / 4))) * spacing
        size = min(0.035 * self._unit, 0.8 * spacing)
        self._mark_size = np.where(np.arange(len(self._marks)) % 4 == 0, 2.0 * size, size)

    def _draw_ground(self, frame: int) -> None:
        if self._motion.trajectory.system.ground.wavy:
            top = self._motion.ground(frame, self._ground_x)
            for mesh in (self._ground, self._surface):
                mesh.points[: len(top), 1] = top
                mesh.GetPoints().Modified()
        shifted = np.mod(self._marks + self._motion.travel[frame], self._period)
        x = self._x[0] - 2.0 * self._spacing + shifted
        y = self._motion.ground(frame, x)
        start = np.column_stack([x, y])
        end = start - self._mark_size[:, None] * np.array([0.7, 1.0])
        self._move(self._mark_lines, np.stack([start, end], axis=1).reshape(-1, 2))

    def _add_contact(self, line: float) -> None:
        basis = self._motion.trajectory.system.basis
        feet, pixel = len(self._motion.footed), self._height / self._plotter.window_size[1]
        n = basis.contact_nodes + feet
        spacing = min(np.ptp(face.abscissa) / max(len(face.abscissa) - 1, 1) or self._height
                      for face in contact_faces(basis))
        radius = float(np.clip(0.42 * spacing, 2.0 * line * pixel, 4.5 * line * pixel))
        # Feet are smaller than the nodes that they belong to.
        self._radius = radius * np.append(np.ones(n - feet), np.full(feet, _FOOT))[:, None]
        self._slim = float(np.clip(spacing / (14.0 * line * pixel), 0.35, 1.0))
        angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
        self._circle = np.column_stack([np.cos(angle), np.sin(angle)])
        rings = np.arange(n * _CORNERS).reshape(n, _CORNERS)
        places = np.zeros((n * _CORNERS, 2))
        self._rims = self._add("rim", places, faces=rings, color=DARK)
        self._nodes = self._add("node", places, faces=rings, scalars="colour", rgb=True,
                                cell_data={"colour": np.zeros((n, 3), dtype=np.uint8)})
        self._rim = line * pixel
        quads = np.arange(n)[:, None] * 7 + np.arange(4)
        heads = np.arange(n)[:, None] * 7 + np.arange(4, 7)
        corners = np.zeros((7 * n, 2))
        self._arrows = [self._add("force", corners, faces=cells, color=FORCE_COLOUR)
                        for cells in (quads, heads)]
        colours = [NODE_COLOURS[name] for name in self._motion.state_names]
        self._state_colours = np.array([[int(text[k : k + 2], 16) for k in (1, 3, 5)]
                                        for text in colours], dtype=np.uint8)

    def _draw_contact(self, frame: int) -> None:
        centres = self._motion.contact_places(frame)
        for mesh, radius in ((self._nodes, self._radius), (self._rims, self._radius + self._rim)):
            self._move(mesh, (centres[:, None] + radius[:, None] * self._circle).reshape(-1, 2))
        self._nodes.cell_data["colour"][:] = self._state_colours[self._motion.states[frame]]
        self._nodes.GetCellData().GetScalars().Modified()
        if self._motion.largest_force > 0.0:
            corners = self._arrow_corners(centres, self._motion.forces[frame])
            for mesh in self._arrows:
                self._move(mesh, corners)

    def _arrow_corners(self, tips: Array, forces: Array) -> Array:
        """Corners (7 k, 2) of arrows that end at k places: four of the shaft, then the head."""
        size = np.linalg.norm(forces, axis=1, keepdims=True)
        along = np.divide(forces, size, out=np.zeros_like(forces), where=size > 0.0)
        across = np.column_stack([-along[:, 1], along[:, 0]])
        length = _ARROW * self._unit * size / self._motion.largest_force
        thick = self._slim * np.minimum(1.0, length / (0.05 * self._unit)) * self._unit
        head = np.minimum(0.035 * thick, 0.6 * length)
        tips = tips - self._radius * along
        tail, neck = tips - length * along, tips - head * along
        shaft, wing = 0.0045 * thick * across, 0.014 * thick * across
        return np.stack([tail - shaft, neck - shaft, neck + shaft, tail + shaft,
                         neck - wing, tips, neck + wing], axis=1).reshape(-1, 2)


def _drawn_unit(height: float, aspect: float) -> float:
    """Size that those of arrows and marks relate to, for a view of this height and aspect."""
    return height * float(np.clip(1.0, 0.25 * aspect, 0.5 * aspect))


def needed_height(motion: Motion) -> float:
    """Height of the scene that body and ground need, as a part of its width."""
    left, right, bottom, top = motion.box
    if not motion.has_ground:
        return (top - bottom) / (right - left)
    return _needed(*_reach(motion)) * (1.0 - 2.0 * _MARGIN) / (right - left)


def _reach(motion: Motion) -> tuple[float, float]:
    """How far the body, or the ground, is drawn above and below the level of the ground [m]."""
    _, _, bottom, top = motion.box
    low, high = motion.trajectory.system.ground.height_range
    return (max(top - motion.ground_level, motion.scale * high, 0.0),
            max(motion.ground_level - bottom, -motion.scale * low))


def _needed(body: float, below: float) -> float:
    return max(body / (1.0 - _DEPTH - _MARGIN), (body + below) / (1.0 - 3.0 * _MARGIN))


def label_image(text: str, size: float) -> NDArray[np.float64]:
    """A name in dark letters with a pale rim, (h, w, 4) from 0 to 1; ``size`` in pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patheffects import withStroke

    rim = 0.28 * size
    figure = Figure(figsize=((len(text) + 2) * size / 100.0, 2.0 * size / 100.0), dpi=100)
    figure.patch.set_alpha(0.0)
    canvas = FigureCanvasAgg(figure)
    figure.text(0.5, 0.5, text, parse_math=False, ha="center", va="center", color=DARK,
                family="DejaVu Sans",
                fontsize=0.72 * size,
                path_effects=[withStroke(linewidth=0.72 * rim, foreground="white", alpha=0.8)])
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba()) / 255.0
    rows, columns = (np.flatnonzero(drawn[..., 3].any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return drawn
    return drawn[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def blend(image: NDArray[np.uint8], label: NDArray[np.float64], row: int, column: int) -> None:
    """Draw a label into a picture, centred at a pixel and moved inside where it would leave it."""
    height, width = (min(given, room) for given, room in zip(label.shape, image.shape[:2],
                                                             strict=False))
    top = int(np.clip(row - height // 2, 0, image.shape[0] - height))
    left = int(np.clip(column - width // 2, 0, image.shape[1] - width))
    part, drawn = image[top : top + height, left : left + width], label[:height, :width]
    alpha = drawn[..., 3:]
    part[:] = np.round((1.0 - alpha) * part + 255.0 * alpha * drawn[..., :3])


def reduced(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """Means of factor x factor pixels of an image."""
    rows = image[::factor].astype(np.uint16)
    for k in range(1, factor):
        rows += image[k::factor]
    total = rows[:, ::factor].copy()
    for k in range(1, factor):
        total += rows[:, k::factor]
    return ((total + factor**2 // 2) // factor**2).astype(np.uint8)
