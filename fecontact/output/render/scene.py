"""Scene of a picture, drawn by VTK: parts that move, seen by a camera that stands still.

Plane bodies lie flat before the camera, solids stand in the light of lamps; both are parts of the
same scene. See :func:`fecontact.output.render.scenes.scene_of`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.output.diagrams.colours import STATE_COLOURS
from fecontact.output.render.offscreen import known_window
from fecontact.output.render.pixels import blend, label_image, reduced
from fecontact.reduction.mode_shapes import ModeShapes

COLOUR_MAPS = {"displacement": "viridis", "von_mises": "cividis"}
NODE_COLOURS = {"open": "#ffffff", **STATE_COLOURS}
FORCE_COLOUR = "#b2182b"
MARGIN = 0.05  # of the picture, around what is drawn
_LABEL_SIZE = 13.0  # height of names, in thin lines


def state_shades(names: Sequence[str]) -> NDArray[np.uint8]:
    """Colours (k, 3) of contact states, from 0 to 255."""
    from matplotlib.colors import to_rgba_array

    return np.rint(255.0 * to_rgba_array([NODE_COLOURS[name] for name in names])[:, :3]).astype(
        np.uint8)


class Shown(Protocol):
    """Bodies that move: what every scene draws, of a run or of a mode."""

    @property
    def mode_shapes(self) -> ModeShapes:
        """Nodes, cells and outline of the bodies."""

    @property
    def colour(self) -> str:
        """Quantity that colours the bodies, one of :data:`COLOUR_MAPS`."""

    @property
    def largest_colour(self) -> float:
        """Upper end of the colour range; the lower end is zero."""

    @property
    def bounds(self) -> Array:
        """Smallest and largest coordinates (2, d) that the drawn bodies reach [m]."""

    @property
    def labels(self) -> tuple[tuple[str, int], ...]:
        """Names of the bodies of several, and the nodes at which they stand."""

    def body(self, frame: int) -> tuple[Array, Array]:
        """Drawn positions (N, d) of the nodes [m] and their colour values (N,)."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection.

    Attributes
    ----------
    right, up, back : (3,) arrays
        Unit vectors of the picture, the last one towards the viewer.
    focus : (3,) array
        Place in the middle of the picture [m].
    height, depth : float
        Height and depth of the visible scene [m].
    """

    right: Array
    up: Array
    back: Array
    focus: Array
    height: float
    depth: float

    @classmethod
    def around(cls, looks: Array, up: Array, places: Array, aspect: float) -> Self:
        """The camera in a direction from which all of some places (k, 3) are seen."""
        back = looks / np.linalg.norm(looks)
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        up = np.cross(back, right)
        across, high, depth = places @ right, places @ up, places @ back
        height = float(max(np.ptp(high), np.ptp(across) / aspect) / (1.0 - 2.0 * MARGIN))
        middle = [0.5 * (one.max() + one.min()) for one in (across, high, depth)]
        return cls(right, up, back, middle[0] * right + middle[1] * up + middle[2] * back, height,
                   float(np.ptp(depth)) or height)

    @classmethod
    def facing(cls, middle: float, bottom: float, height: float) -> Self:
        """The camera on the normal of the plane of x and y."""
        right, up, back = np.eye(3)
        return cls(right, up, back, np.array([middle, bottom + 0.5 * height, 0.0]), height, height)

    def apply(self, camera: Any) -> None:
        """Set a camera of pyvista."""
        far = 2.0 * (self.depth + self.height)
        camera.focal_point = self.focus
        camera.position = self.focus + far * self.back
        camera.up = self.up
        camera.parallel_projection = True
        camera.parallel_scale = 0.5 * self.height
        camera.clipping_range = (0.05 * far, 3.0 * far)

    def pixel(self, place: Array, shape: tuple[int, ...]) -> tuple[int, int]:
        """Row and column of a place (3,), or (2,) in the plane, in a picture."""
        size, away = self.height / shape[0], place - self.focus[: len(place)]
        return (round(0.5 * shape[0] - float(away @ self.up[: len(place)]) / size),
                round(0.5 * shape[1] + float(away @ self.right[: len(place)]) / size))

    def place(self, row: float, column: float, aspect: float) -> Array:
        """The place in front of everything at a part of the picture's height and width."""
        return np.asarray(self.focus + self.height * (0.5 - row) * self.up
                          + self.height * aspect * (column - 0.5) * self.right
                          + (self.depth + 0.5 * self.height) * self.back)


class Part:
    """Part of a scene."""

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""

    def names(self) -> Sequence[tuple[NDArray[np.float64], Array]]:
        """Names, as pictures, and the places of their centres in the frame drawn last."""
        return ()


class Scene:
    """Renderer of frames; a context manager.

    Parameters
    ----------
    camera : Camera
    parts : sequence of callables
        Each adds a :class:`Part` to the scene that it is given; later ones are in front.
    width, height : int
        Size of the images in pixels.
    line : float
        Width of thin lines in pixels of the image.
    fineness : int
        Pixels rendered for each pixel of the image, in both directions; their mean is what one
        sees. VTK's own smoothing of edges is slower in software and looks worse.

    Attributes
    ----------
    line : float
        Width of thin lines in rendered pixels.
    pixel : float
        Size of a rendered pixel [m].
    aspect : float
        Width of the image over its height.
    """

    def __init__(
        self, camera: Camera, parts: Sequence[Callable[["Scene"], Part]], width: int, height: int,
        *, line: float = 1.0, fineness: int = 2,
    ) -> None:
        with known_window():
            import pyvista

            self._pyvista: Any = pyvista
            self.camera, self.width, self.aspect = camera, width, width / height
            self.line, self.pixel = fineness * line, camera.height / (fineness * height)
            self._fineness, self._name_size = fineness, _LABEL_SIZE * line
            self.plotter: Any = self._pyvista.Plotter(
                off_screen=True, window_size=[fineness * width, fineness * height])
            self.plotter.disable_anti_aliasing()
            self.plotter.set_background("white")
            camera.apply(self.plotter.camera)
            self.parts = [part(self) for part in parts]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.plotter.close()

    def image(self, frame: int) -> NDArray[np.uint8]:
        """Picture (height, width, 3) of a frame."""
        for part in self.parts:
            part.draw(frame)
        self.plotter.render()
        image = reduced(np.asarray(self.plotter.screenshot(None, return_img=True)),
                        self._fineness)
        for part in self.parts:
            for label, place in part.names():
                blend(image, label, *self.camera.pixel(place, image.shape))
        return image

    def name(self, text: str, size: float = 1.0) -> NDArray[np.float64]:
        """A name as a picture; ``size`` is relative to that of names of bodies."""
        return label_image(text, size * self._name_size)

    def mesh(
        self, places: Array, *, faces: Integers | None = None, lines: Integers | None = None,
        point_data: Mapping[str, Array] | None = None, cell_data: Mapping[str, Array] | None = None,
        behind: float = 0.0, smooth: bool = False, **options: Any,
    ) -> Any:
        """Add a mesh of places (k, 3) with ``faces`` or ``lines`` between them; it is returned.

        ``behind`` moves it away from the viewer, so that lines on it are seen; ``smooth`` shades it
        by the normals of its points. Others are options of ``pyvista.Plotter.add_mesh``.
        """
        cells = {kind: np.hstack([np.full((len(rows), 1), rows.shape[1]), rows]).ravel()
                 for kind, rows in (("faces", faces), ("lines", lines)) if rows is not None}
        mesh = self._pyvista.PolyData(places.astype(np.float32), **cells)
        mesh.point_data.update(point_data or {})
        mesh.cell_data.update(cell_data or {})
        if "Normals" in mesh.point_data:
            mesh.point_data.active_normals_name = "Normals"
        actor = self.plotter.add_mesh(
            mesh, **{"lighting": False} | options, show_scalar_bar=False, reset_camera=False,
            copy_mesh=False, render=False)
        if behind:
            actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
            actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(behind, behind)
        if smooth:
            actor.prop.SetInterpolationToPhong()
        return mesh

    def lamp(self, direction: Array, strength: float) -> None:
        """Add a lamp far away in a direction."""
        self.plotter.add_light(self._pyvista.Light(
            position=self.camera.focus + 10.0 * self.camera.depth * direction,
            focal_point=self.camera.focus, color="white", intensity=strength,
            light_type="scene light"))


def move(mesh: Any, places: Array) -> None:
    """Put the points of a mesh to places (k, 3), or (k, 2) at their heights."""
    mesh.points[:, : places.shape[1]] = places
    mesh.GetPoints().Modified()


def paint(data: Any, values: Array) -> None:
    """Set the colours of the points or cells of a mesh, by its ``point_data`` or ``cell_data``."""
    data["colour"][:] = values
    data.VTKObject.GetScalars().Modified()


def shade(mesh: Any, normals: Array) -> None:
    """Set the normals of the points of a mesh."""
    mesh.point_data["Normals"][:] = normals
    mesh.GetPointData().GetNormals().Modified()


class Bodies(Part):
    """Bodies in their colours, whose surfaces and lines move with their mesh nodes."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        self.motion, self.places = motion, motion.mode_shapes.nodes
        # Meshes with the mesh nodes of their points; the last one has the colours of the bodies.
        self.surfaces: list[tuple[Any, Integers]] = []
        self.lines: list[Any] = []
        self.labels = [(scene.name(name), node) for name, node in motion.labels]
        self.colours: Any = {"cmap": COLOUR_MAPS[motion.colour], "n_colors": 256,
                             "clim": (0.0, motion.largest_colour or 1.0),
                             "interpolate_before_map": True}

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        self.places, colours = self.motion.body(frame)
        mesh, nodes = self.surfaces[-1]
        paint(mesh.point_data, colours[nodes])
        for mesh, nodes in self.surfaces:
            move(mesh, self.places[nodes])
        for mesh in self.lines:
            move(mesh, self.places)

    def names(self) -> Sequence[tuple[NDArray[np.float64], Array]]:
        """Names and places of several bodies in the frame drawn last."""
        return [(name, self.places[node]) for name, node in self.labels]


class Arrows:
    """Flat arrows of one colour, each a shaft and a head."""

    def __init__(self, scene: Scene, places: Array, colour: str) -> None:
        """``places`` (7 k, 3) are those of the corners to begin with."""
        first = 7 * np.arange(len(places) // 7)[:, None]
        self._meshes = [scene.mesh(places, faces=first + cells, color=colour)
                        for cells in (np.arange(4), np.arange(4, 7))]

    def move(self, corners: Array) -> None:
        """Put the corners to places (7 k, 2 or 3)."""
        for mesh in self._meshes:
            move(mesh, corners)


def arrow_corners(
    tips: Array, along: Array, length: Array, head: Array, shaft: Array, wing: Array
) -> Array:
    """Corners (7 k, 2) of arrows that end at tips (k, 2), with directions ``along`` (k, 2).

    Lengths (k, 1) of arrows and heads; half widths (k, 1) of shafts and heads.
    """
    across = np.column_stack([-along[:, 1], along[:, 0]])
    tail, neck = tips - length * along, tips - head * along
    shaft, wing = shaft * across, wing * across
    return np.stack([tail - shaft, neck - shaft, neck + shaft, tail + shaft,
                     neck - wing, tips, neck + wing], axis=1).reshape(-1, 2)
