"""Parts of a scene of solids: the bodies with the patches of their contact faces, and the axes."""

from collections.abc import Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import numbered_rows, unordered
from fecontact.output.diagrams.colours import PRESSURE_MAP
from fecontact.output.files.contact_facets import contact_facets
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.pixels import DARK
from fecontact.output.render.scene import Bodies, Camera, Part, Scene, Shown, paint, shade
from fecontact.output.render.surfaces import ShadedSurface, borders, shaded_surface, sharp_edges

# From where bodies are seen, along t, t2 and n of their contact faces.
_ABOVE, _BELOW = (0.46, -0.80, 0.42), (0.40, -0.62, -0.68)
_REFERENCE = "#b5b5b5"
_TRIAD = 0.055  # length of the axes in the corner, of the picture's height
_TRIAD_COLOURS = ("#a03030", "#2f7d32", "#2b5ea8")
_GLOSS = {"lighting": True, "ambient": 0.55, "diffuse": 0.58, "specular": 0.05,
          "specular_power": 12.0, "smooth_shading": False}
# Lamps over the shoulder and at the camera: to the right, up, towards the viewer, and how strong.
_LAMPS = ((-0.55, 0.85, 0.8, 0.72), (0.7, 0.1, 0.9, 0.38))


def from_below(motion: Shown) -> TypeGuard[Motion]:
    """True if the view is from below, onto the contact faces of a run."""
    return isinstance(motion, Motion) and motion.view == "below"


def seen_nodes(motion: Shown) -> Integers:
    """Nodes of the bodies that are drawn; from below without those under other ones' faces."""
    nodes = np.arange(len(motion.mode_shapes.nodes))
    if not from_below(motion):
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
    if from_below(motion):
        basis = motion.trajectory.basis
        mean = basis.contact_areas @ basis.normals
        if np.linalg.norm(mean) > 0.1 * basis.contact_areas.sum():
            normal = mean / np.linalg.norm(mean)
    t, t2 = tangents_of(normal[None])[0]
    where = np.array(_BELOW if from_below(motion) else _ABOVE)
    return Camera.around(where @ np.stack([t, t2, normal]), normal,
                         np.concatenate([corners, ground]), aspect)


class SolidBodies(Bodies):
    """The bodies in their colours, shaded; from below their patches in those of the pressures."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        super().__init__(scene, motion)
        field, seen, camera = motion.mode_shapes, seen_nodes(motion), scene.camera
        self._shaded: list[ShadedSurface] = []
        scene.plotter.remove_all_lights()
        for right, up, back, strength in _LAMPS:
            scene.lamp(right * camera.right + up * camera.up + back * camera.back, strength)
        facets = whole = field.outline[np.isin(field.outline[:, 0], seen)]
        if from_below(motion):
            patches = contact_facets(motion.trajectory.basis).patches
            self._owner = patches.owner
            self._add(scene, patches.facets, rgb=True, lighting=False, cell_data={
                "colour": np.zeros((len(patches.facets), 3), np.uint8)})
            numbers = numbered_rows(unordered(np.concatenate([whole, patches.facets])))[1]
            facets = whole[~np.isin(numbers[: len(whole)], numbers[len(whole) :])]
            self.lines.append(_lines(scene, field.nodes, borders(patches.facets, patches.owner),
                                     DARK, scene.line))
        self._add(scene, facets, **self.colours)
        sharp = sharp_edges(field.nodes, whole)
        self.lines.append(_lines(scene, field.nodes, sharp, DARK, 1.2 * scene.line))
        _lines(scene, field.nodes, sharp, _REFERENCE, scene.line)
        self.labels = [(name, node) for name, node in self.labels if node in seen]

    def _add(self, scene: Scene, facets: Integers, **options: Any) -> None:
        """Add a shaded surface that moves with the mesh nodes."""
        surface = shaded_surface(self.places, facets)
        places = self.places[surface.nodes]
        data = {"Normals": surface.normals(places)}
        if "cell_data" not in options:
            data["colour"] = np.zeros(len(places))
        mesh = scene.mesh(places, faces=surface.facets, scalars="colour", behind=1.0, smooth=True,
                          point_data=data, **_GLOSS | options)
        self.surfaces.append((mesh, surface.nodes))
        self._shaded.append(surface)

    def draw(self, frame: int) -> None:
        """Bring everything to where it is at a frame."""
        super().draw(frame)
        for (mesh, nodes), surface in zip(self.surfaces, self._shaded, strict=True):
            shade(mesh, surface.normals(self.places[nodes]))
        if from_below(self.motion):
            from matplotlib import colormaps

            part = self.motion.pressures[frame] / (self.motion.largest_pressure or 1.0)
            shades = colormaps[PRESSURE_MAP](part, bytes=True)[:, :3]
            paint(self.surfaces[0][0].cell_data, shades[self._owner])


class Corners(Part):
    """The axes in the lower left corner; in the right one words for what moves below the bodies."""

    def __init__(self, scene: Scene, motion: Shown) -> None:
        camera = scene.camera
        start = camera.place(0.85 if from_below(motion) else 0.92, 0.07 / max(scene.aspect, 0.5),
                             scene.aspect)
        ends = start + _TRIAD * camera.height * np.eye(3)
        for end, colour in zip(ends, _TRIAD_COLOURS, strict=True):
            _lines(scene, np.stack([start, end]), np.array([[0, 1]]), colour, 2.0 * scene.line)
        self._names = [(scene.name(name), start + 1.45 * (end - start))
                       for name, end in zip("xyz", ends, strict=True)]
        if isinstance(motion, Motion) and motion.moving:
            self._names.append((scene.name(motion.moving, 0.9),
                                camera.place(0.955, 1.0, scene.aspect)))

    def names(self) -> Sequence[tuple[NDArray[np.float64], Array]]:
        """x, y and z at the ends of the axes, and the words."""
        return self._names


def _lines(scene: Scene, places: Array, edges: Integers, colour: str, width: float) -> Any:
    return scene.mesh(places, lines=edges, color=colour, line_width=width)
