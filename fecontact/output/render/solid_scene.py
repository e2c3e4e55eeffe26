"""Scene of a picture of solids, drawn by VTK: bodies, the ground below them or their faces."""

from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.output.files.contact_facets import contact_facets
from fecontact.output.render.face_maps import PRESSURE_MAP
from fecontact.output.render.offscreen import known_window
from fecontact.output.render.scene import COLOUR_MAPS, DARK, blend, label_image, reduced
from fecontact.output.render.solid_ground import GroundScene
from fecontact.output.render.solid_motion import SolidMotion
from fecontact.output.render.surfaces import shaded_surface, sharp_edges
from fecontact.reduction.mode_shapes import ModeShapes

# From where bodies are seen, along t, t2 and n of their contact faces.
_ABOVE, _BELOW = (0.46, -0.80, 0.42), (0.40, -0.62, -0.68)
_MARGIN = 0.05  # of the picture around what is drawn
_LABEL_SIZE = 13.0  # height of the bodies' names, in thin lines
_REFERENCE = "#b5b5b5"
_TRIAD = 0.055  # length of the axes in the corner, of the picture's height
_TRIAD_COLOURS = ("#a03030", "#2f7d32", "#2b5ea8")


class SolidShown(Protocol):
    """Solids that move: what :class:`SolidScene` draws; see :class:`SolidMotion`."""

    @property
    def mode_shapes(self) -> ModeShapes:
        """Nodes and surface of the bodies."""

    @property
    def colour(self) -> str:
        """What the bodies are coloured by, one of :data:`COLOUR_MAPS`."""

    @property
    def largest_colour(self) -> float:
        """Upper end of the colour range; the lower end is zero."""

    @property
    def bounds(self) -> Array:
        """Smallest and largest coordinates (2, 3) that the drawn bodies reach [m]."""

    @property
    def labels(self) -> tuple[tuple[str, int], ...]:
        """Names of the bodies of several, and the nodes at which they stand."""

    def body(self, frame: int) -> tuple[Array, Array]:
        """Drawn positions (N, 3) of the nodes [m] and their colour values (N,)."""


class Camera:
    """A parallel projection that shows places of all frames, and where it shows a place."""

    def __init__(self, looks: Array, up: Array, places: Array, aspect: float) -> None:
        back = looks / np.linalg.norm(looks)
        right = np.cross(up, back)
        self.right = right / np.linalg.norm(right)
        self.up, self.back = np.cross(back, self.right), back
        across, high = places @ self.right, places @ self.up
        width, height = np.ptp(across), np.ptp(high)
        self.height = float(max(height, width / aspect) / (1.0 - 2.0 * _MARGIN))
        depth = places @ back
        self.depth = float(np.ptp(depth)) or self.height
        self.focus = (0.5 * (across.max() + across.min()) * self.right
                      + 0.5 * (high.max() + high.min()) * self.up
                      + 0.5 * (depth.max() + depth.min()) * back)

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
        """Row and column of a place in a picture."""
        size, away = self.height / shape[0], place - self.focus
        return (round(0.5 * shape[0] - float(away @ self.up) / size),
                round(0.5 * shape[1] + float(away @ self.right) / size))

    def place(self, row: float, column: float, aspect: float) -> Array:
        """The place in front of everything at a part of the picture's height and width."""
        return np.asarray(self.focus + self.height * (0.5 - row) * self.up
                          + self.height * aspect * (column - 0.5) * self.right
                          + (self.depth + 0.5 * self.height) * self.back)


class SolidScene:
    """Renderer of the frames of solids; a context manager.

    Parameters
    ----------
    motion : SolidMotion or SolidShown
        A run, which shows the ground or contact faces too, or the motion of bodies alone.
    width, height : int
        Size of the images in pixels.
    line : float
        Width of thin lines in pixels of the image.
    fineness : int
        Pixels rendered for each pixel of the image, in both directions.
    """

    def __init__(self, motion: SolidShown, width: int, height: int, *, line: float = 1.0,
                 fineness: int = 2) -> None:
        with known_window():
            import pyvista

            self._pyvista: Any = pyvista
            self._motion, self._fineness = motion, fineness
            self._run = motion if isinstance(motion, SolidMotion) else None
            self._below = self._run is not None and self._run.view == "below"
            self._plotter: Any = self._pyvista.Plotter(
                off_screen=True, window_size=[fineness * width, fineness * height])
            self._plotter.disable_anti_aliasing()
            self._plotter.set_background("white")
            self._ground = GroundScene(self._plotter, self._run, fineness * line) if (
                self._run is not None and self._run.has_ground) else None
            facets = self._seen_facets()
            self._camera = self._aimed(facets, width / height)
            self._camera.apply(self._plotter.camera)
            self._light()
            self._add_bodies(facets, fineness * line)
            self._add_triad(width / height, fineness * line)
            self._names = [(label_image(name, _LABEL_SIZE * line), node)
                           for name, node in motion.labels if np.isin(node, self._whole)]
            self._axes = [label_image(name, _LABEL_SIZE * line) for name in "xyz"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._plotter.close()

    def image(self, frame: int) -> NDArray[np.uint8]:
        """Picture (height, width, 3) of a frame."""
        places, colours = self._motion.body(frame)
        self._draw_bodies(frame, places, colours)
        if self._ground is not None:
            self._ground.draw(frame)
        self._plotter.render()
        image = reduced(np.asarray(self._plotter.screenshot(None, return_img=True)),
                         self._fineness)
        for label, node in self._names:
            blend(image, label, *self._camera.pixel(places[node], image.shape))
        for label, end in zip(self._axes, self._triad_ends, strict=True):
            blend(image, label, *self._camera.pixel(end, image.shape))
        return image

    def _seen_facets(self) -> Integers:
        """Facets of the bodies; from below without those that lie under other ones' faces."""
        outline = self._motion.mode_shapes.outline
        self._whole = np.arange(len(self._motion.mode_shapes.nodes))
        if self._run is None or not self._below or not self._run.trajectory.system.basis.parts:
            return outline
        basis = self._run.trajectory.system.basis
        patches = contact_facets(basis).patches.facets
        seen = [np.arange(part.nodes[0], sum(part.nodes)) for part in basis.parts
                if np.isin(patches, np.arange(part.nodes[0], sum(part.nodes))).any()]
        self._whole = np.concatenate(seen) if seen else self._whole
        return np.asarray(outline[np.isin(outline[:, 0], self._whole)])

    def _aimed(self, facets: Integers, aspect: float) -> Camera:
        from fecontact.fem.faces.frames import tangents_of

        motion = self._motion
        low, high = motion.bounds
        if len(self._whole) < len(motion.mode_shapes.nodes):
            # Only what is seen, with as much room around it as the motion takes.
            rest = motion.mode_shapes.nodes
            out = np.maximum(rest.min(axis=0) - low, high - rest.max(axis=0)).max()
            seen = rest[np.unique(facets)]
            low, high = seen.min(axis=0) - out, seen.max(axis=0) + out
        corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(-1, 3)
        if self._ground is not None:
            corners = np.concatenate([corners, self._ground.corners])
        normal = np.array([0.0, 0.0, 1.0])
        if self._run is not None and self._below:
            basis = self._run.trajectory.system.basis
            mean = basis.contact_areas @ basis.normals
            if np.linalg.norm(mean) > 0.1 * basis.contact_areas.sum():
                normal = mean / np.linalg.norm(mean)
        t, t2 = tangents_of(normal[None])[0]
        where = _BELOW if self._below else _ABOVE
        return Camera(np.array(where) @ np.stack([t, t2, normal]), normal, corners, aspect)

    def _light(self) -> None:
        """A lamp over the shoulder and a weaker one at the camera, whatever is looked at."""
        plotter, camera = self._plotter, self._camera
        plotter.remove_all_lights()
        for right, up, back, strength in ((-0.55, 0.85, 0.8, 0.72), (0.7, 0.1, 0.9, 0.38)):
            direction = right * camera.right + up * camera.up + back * camera.back
            plotter.add_light(self._pyvista.Light(
                position=camera.focus + 10.0 * camera.depth * direction,
                focal_point=camera.focus, color="white", intensity=strength,
                light_type="scene light"))

    def _add_bodies(self, facets: Integers, line: float) -> None:
        motion, field = self._motion, self._motion.mode_shapes
        self._painted = None
        if self._run is not None and self._below:
            patches = contact_facets(self._run.trajectory.system.basis).patches
            chosen = np.isin(_keys(facets), _keys(patches.facets))
            self._painted = self._surface(patches.facets, cell_data={
                "colour": np.zeros((len(patches.facets), 3), np.uint8)}, rgb=True,
                lighting=False)
            self._owner, facets = patches.owner, facets[~chosen]
            edges = self._borders(patches)
            self._patch_edges = self._lines(field.nodes, edges, DARK, line)
        self._bodies = self._surface(
            facets, point_data={}, cmap=COLOUR_MAPS[motion.colour],
            clim=(0.0, motion.largest_colour or 1.0), interpolate_before_map=True, n_colors=256)
        whole = field.outline[np.isin(field.outline[:, 0], self._whole)]
        sharp = sharp_edges(field.nodes, whole)
        self._edges = self._lines(field.nodes, sharp, DARK, 1.2 * line)
        self._lines(field.nodes, sharp, _REFERENCE, line)

    @staticmethod
    def _borders(patches: Any) -> Integers:
        """Edges between patches and around them."""
        facets, owner = patches.facets, patches.owner
        ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2),
                       axis=1)
        rows = np.column_stack([ends, np.repeat(owner, facets.shape[1])])
        once, times = np.unique(rows, axis=0, return_counts=True)
        return np.unique(once[times == 1][:, :2], axis=0)

    def _surface(self, facets: Integers, *, point_data: Any = None, cell_data: Any = None,
                 **options: Any) -> Any:
        """A shaded surface that moves with the mesh nodes: its mesh and what it is made of."""
        surface = shaded_surface(self._motion.mode_shapes.nodes, facets)
        places = self._motion.mode_shapes.nodes[surface.nodes]
        cells = np.hstack([np.full((len(facets), 1), facets.shape[1]), surface.facets]).ravel()
        mesh = self._pyvista.PolyData(places.astype(np.float32), faces=cells)
        mesh.point_data["Normals"] = surface.normals(places).astype(np.float32)
        mesh.point_data.active_normals_name = "Normals"
        if point_data is not None:
            mesh.point_data["colour"] = np.zeros(len(places))
        for name, values in (cell_data or {}).items():
            mesh.cell_data[name] = values
        actor = self._plotter.add_mesh(
            mesh, scalars="colour", show_scalar_bar=False, reset_camera=False, copy_mesh=False,
            render=False, ambient=0.55, diffuse=0.58, specular=0.05, specular_power=12.0,
            smooth_shading=False, **{"lighting": True} | options)
        # Lines on the surface stay in front of it.
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(1.0, 1.0)
        actor.prop.SetInterpolationToPhong()
        return mesh, surface

    def _lines(self, places: Array, edges: Integers, colour: str, width: float) -> Any:
        cells = np.hstack([np.full((len(edges), 1), 2), edges]).ravel()
        mesh = self._pyvista.PolyData(places.astype(np.float32), lines=cells)
        self._plotter.add_mesh(mesh, color=colour, line_width=width, lighting=False,
                               reset_camera=False, copy_mesh=False, render=False)
        return mesh

    def _draw_bodies(self, frame: int, places: Array, colours: Array) -> None:
        meshes = [self._bodies]
        self._bodies[0].point_data["colour"][:] = colours[self._bodies[1].nodes]
        self._bodies[0].GetPointData().GetScalars().Modified()
        if self._run is not None and self._painted is not None:
            from matplotlib import colormaps

            meshes.append(self._painted)
            part = self._run.pressures[frame] / (self._run.largest_pressure or 1.0)
            shades = (255.0 * colormaps[PRESSURE_MAP](part)[:, :3]).astype(np.uint8)
            self._painted[0].cell_data["colour"][:] = shades[self._owner]
            self._painted[0].GetCellData().GetScalars().Modified()
            _move(self._patch_edges, places)
        for mesh, surface in meshes:
            at = places[surface.nodes]
            _move(mesh, at)
            mesh.point_data["Normals"][:] = surface.normals(at)
            mesh.GetPointData().GetNormals().Modified()
        _move(self._edges, places)

    def _add_triad(self, aspect: float, line: float) -> None:
        """The axes in the lower left corner."""
        camera = self._camera
        start = camera.place(0.85 if self._below else 0.92, 0.07 / max(aspect, 0.5), aspect)
        ends = start + _TRIAD * camera.height * np.eye(3)
        for end, colour in zip(ends, _TRIAD_COLOURS, strict=True):
            self._lines(np.stack([start, end]), np.array([[0, 1]]), colour, 2.0 * line)
        self._triad_ends = start + 1.45 * (ends - start)


def _move(mesh: Any, places: Array) -> None:
    mesh.points[:] = places
    mesh.GetPoints().Modified()


def _keys(facets: Integers) -> Any:
    """One value for each facet, the same for the same nodes."""
    rows = np.ascontiguousarray(np.sort(facets, axis=1))
    return rows.view([("", rows.dtype)] * rows.shape[1]).ravel()
