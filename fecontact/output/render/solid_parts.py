"""Parts of a scene of solids: the bodies with the patches of their contact faces, and the axes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.output.files.contact_facets import contact_facets
from fecontact.output.render.face_maps import PRESSURE_MAP
from fecontact.output.render.pixels import DARK
from fecontact.output.render.scene import COLOUR_MAPS, Camera, Scene, Shown, move, paint, shade
from fecontact.output.render.solid_motion import SolidMotion
from fecontact.output.render.surfaces import ShadedSurface, shaded_surface, sharp_edges

# From where bodies are seen, along t, t2 and n of their contact faces.
_ABOVE, _BELOW = (0.46, -0.80, 0.42), (0.40, -0.62, -0.68)
_REFERENCE = "#b5b5b5"
_TRIAD = 0.055  # length of the axes in the corner, of the picture's height
_TRIAD_COLOURS = ("#a03030", "#2f7d32", "#2b5ea8")
_GLOSS = {"lighting": True, "ambient": 0.55, "diffuse": 0.58, "specular": 0.05,
          "specular_power": 12.0, "smooth_shading": False}
# Lamps over the shoulder and at the camera: to the right, up, towards the viewer, and how strong.
_LAMPS = ((-0.55, 0.85, 0.8, 0.72), (0.7, 0.1, 0.9, 0.38))


def from_below(motion: Shown) -> bool:
    """True if the view is from below, onto the contact faces of a run."""
    return isinstance(motion, SolidMotion) and motion.view == "below"


def seen_nodes(motion: Shown) -> Integers:
    """Nodes of the bodies that are drawn; from below without those under other ones' faces."""
    nodes = np.arange(len(motion.mode_shapes.nodes))
    if not isinstance(motion, SolidMotion) or motion.view != "below":
        return nodes
    basis = motion.trajectory.basis
    patches = contact_facets(basis).patches.facets
    parts = [np.arange(part.nodes[0], sum(part.nodes)) for part in basis.parts]
    seen = [own for own in parts if np.isin(patches, own).any()]
    return np.concatenate(seen) if seen else nodes


def solid_camera(motion: Shown, ground: Array, aspect: float) -> Camera:
    """The camera that shows bodies, and corners (k, 3) of the ground, in all frames."""
    from fecontact.fem.faces.frames import tangents_of

    low, high = motion.bounds
    rest, seen = motion.mode_shapes.nodes, seen_nodes(motion)
    if len(seen) < len(rest):
        # Only what is seen, with as much room around it as the motion takes.
        out = np.maximum(rest.min(axis=0) - low, high - rest.max(axis=0)).max()
        outline = motion.mode_shapes.outline
        drawn = rest[np.unique(outline[np.isin(outline[:, 0], seen)])]
        low, high = drawn.min(axis=0) - out, drawn.max(axis=0) + out
    corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(-1, 3)
    normal = np.array([0.0, 0.0, 1.0])
    if isinstance(motion, SolidMotion) and from_below(motion):
        basis = motion.trajectory.basis
        mean = basis.contact_areas @ basis.normals
        if np.linalg.norm(mean) > 0.1 * basis.contact_areas.sum():
            normal = mean / np.linalg.norm(mean)
    t, t2 = tangents_of(normal[None])[0]
    where = np.array(_BELOW if from_below(motion) else _ABOVE)
    return Camera.around(where @ np.stack([t, t2, normal]), normal,
                         np.concatenate([corners, ground]), aspect)


class SolidBodies:
    """The bodies in their colours, shaded; from below their patches in those of the pressures."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        self._motion, field, seen = motion, motion.mode_shapes, seen_nodes(motion)
        camera = scene.camera
        scene.plotter.remove_all_lights()
        for right, up, back, strength in _LAMPS:
            scene.lamp(right * camera.right + up * camera.up + back * camera.back, strength)
        whole = field.outline[np.isin(field.outline[:, 0], seen)]
        facets = whole
        self._surfaces: list[tuple[Any, ShadedSurface]] = []
        self._painted, self._lines = None, []
        if isinstance(motion, SolidMotion) and from_below(motion):
            patches = contact_facets(motion.trajectory.basis).patches
            self._painted = self._surface(
                scene, patches.facets, rgb=True,
                cell_data={"colour": np.zeros((len(patches.facets), 3), np.uint8)},
                **_GLOSS | {"lighting": False})
            self._owner = patches.owner
            facets = whole[~np.isin(_keys(whole), _keys(patches.facets))]
            self._lines.append(_lines(scene, field.nodes, _borders(patches), DARK, scene.line))
        self._bodies = self._surface(
            scene, facets, point_data={"colour": np.zeros(0)}, cmap=COLOUR_MAPS[motion.colour],
            clim=(0.0, motion.largest_colour or 1.0), interpolate_before_map=True, n_colors=256,
            **_GLOSS)
        sharp = sharp_edges(field.nodes, whole)
        self._lines.append(_lines(scene, field.nodes, sharp, DARK, 1.2 * scene.line))
        _lines(scene, field.nodes, sharp, _REFERENCE, scene.line)
        self._names = [(scene.name(name), node) for name, node in motion.labels
                       if np.isin(node, seen)]
        self._places = field.nodes

    def _surface(self, scene: Scene, facets: Integers, **options: Any) -> Any:
        """A shaded surface that moves with the mesh nodes: its mesh."""
        surface = shaded_surface(self._motion.mode_shapes.nodes, facets)
        places = self._motion.mode_shapes.nodes[surface.nodes]
        data: dict[str, Array] = {"Normals": surface.normals(places)}
        if "point_data" in options:
            data["colour"] = np.zeros(len(places))
        mesh = scene.mesh(places, faces=surface.facets, scalars="colour", behind=1.0, smooth=True,
                          **options | {"point_data": data})
        self._surfaces.append((mesh, surface))
        return mesh

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        self._places, colours = self._motion.body(frame)
        paint(self._bodies.point_data, colours[self._surfaces[-1][1].nodes])
        if isinstance(self._motion, SolidMotion) and self._painted is not None:
            from matplotlib import colormaps

            part = self._motion.pressures[frame] / (self._motion.largest_pressure or 1.0)
            shades = (255.0 * colormaps[PRESSURE_MAP](part)[:, :3]).astype(np.uint8)
            paint(self._painted.cell_data, shades[self._owner])
        for mesh, surface in self._surfaces:
            at = self._places[surface.nodes]
            move(mesh, at)
            shade(mesh, surface.normals(at))
        for mesh in self._lines:
            move(mesh, self._places)

    def names(self) -> Sequence[tuple[NDArray[np.float64], Array]]:
        """Names and places of several bodies in the frame drawn last."""
        return [(name, self._places[node]) for name, node in self._names]


class Triad:
    """The axes in the lower left corner."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        camera = scene.camera
        start = camera.place(0.85 if from_below(motion) else 0.92, 0.07 / max(scene.aspect, 0.5),
                             scene.aspect)
        ends = start + _TRIAD * camera.height * np.eye(3)
        for end, colour in zip(ends, _TRIAD_COLOURS, strict=True):
            _lines(scene, np.stack([start, end]), np.array([[0, 1]]), colour, 2.0 * scene.line)
        self._names = [(scene.name(name), start + 1.45 * (end - start))
                       for name, end in zip("xyz", ends, strict=True)]

    def draw(self, frame: int) -> None:
        """Do nothing: the axes stand still."""

    def names(self) -> Sequence[tuple[NDArray[np.float64], Array]]:
        """x, y and z at their ends."""
        return self._names


def _lines(scene: Scene, places: Array, edges: Integers, colour: str, width: float) -> Any:
    return scene.mesh(places, lines=edges, color=colour, line_width=width)


def _borders(patches: Any) -> Integers:
    """Edges between patches and around them."""
    facets, owner = patches.facets, patches.owner
    ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    rows = np.column_stack([ends, np.repeat(owner, facets.shape[1])])
    once, times = np.unique(rows, axis=0, return_counts=True)
    return np.unique(once[times == 1][:, :2], axis=0)


def _keys(facets: Integers) -> Any:
    """One value for each facet, the same for the same nodes."""
    rows = np.ascontiguousarray(np.sort(facets, axis=1))
    return rows.view([("", rows.dtype)] * rows.shape[1]).ravel()
