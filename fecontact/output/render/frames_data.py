"""Data of the frames of a movie: positions, colours, forces and ground."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_scale
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array
from fecontact.core.units import quantity, round_125
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.ground.sliding import Sliding, SlidingRotation
from fecontact.output.files.frames import (
    blocks,
    contact_forces,
    displacement,
    require_field,
    von_mises,
)
from fecontact.output.plots.style import state_names, stress_limit
from fecontact.reduction.assembly.contact_faces import contact_faces, contact_sides, several_bodies
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes

Colour = Literal["displacement", "von_mises"]

COLOURS = {"displacement": ("displacement", "m"), "von_mises": ("von Mises stress", "Pa")}

_VISIBLE = 0.1  # largest motion drawn, as a part of the body's extent
_ROUND_OFF = 1e-12  # of the extent, below which a motion is not magnified
_LABEL_ROOM = 0.1  # of the extent of all bodies, from a body's name to the nearest contact node


def _way(sliding: Sliding) -> str:
    """Direction and speed of a prescribed sliding."""
    speed = abs(sliding.speed)
    if isinstance(sliding, SlidingRotation):
        arrow = "↺" if sliding.speed * sliding.axis[2] >= 0.0 else "↻"
        size = quantity(speed, "rad/s")
    else:
        x, y = np.sign(sliding.speed) * np.asarray(sliding.direction)[:2]
        arrow = "→↗↑↖←↙↓↘"[round(np.arctan2(y, x) / (0.25 * np.pi)) % 8]
        size = quantity(speed, "m/s")
    return f"{arrow} {size}" if sliding.motion is None else f"{arrow} in time"


def body_labels(basis: ModalBasis) -> tuple[tuple[str, int], ...]:
    """Names of the bodies of an assembled basis, and for each the mesh node to write it at.

    Well inside its body and, where there is room, away from the arrows of contact forces.
    """
    from scipy.spatial import KDTree

    field, found = basis.mode_shapes, []
    if field is None:
        return ()
    # Arrows of the ground's forces lie below a body, those of other bodies inside.
    contacts = basis.positions[2 : 2 + basis.contact_nodes][
        ~basis.ground_nodes & ~basis.spring_nodes]
    for part in basis.parts:
        first, count = part.nodes
        if not count:
            continue  # a body without a mesh, such as a shaker
        nodes = field.nodes[first : first + count]
        edge = np.unique(field.outline)
        edge = edge[(first <= edge) & (edge < first + count)]
        inside = KDTree(field.nodes[edge]).query(nodes)[0]
        away = KDTree(contacts).query(nodes)[0] if len(contacts) else np.full(count, np.inf)
        room = _LABEL_ROOM * float(np.linalg.norm(np.ptp(field.nodes, axis=0)))
        centre = np.linalg.norm(nodes - 0.5 * (nodes.min(axis=0) + nodes.max(axis=0)), axis=1)
        deep = np.flatnonzero(inside >= 0.8 * inside.max())
        reach = np.minimum(away[deep], room)
        deep = deep[reach >= reach.max() * (1.0 - 1e-6)]
        found.append((part.name, first + int(deep[np.argmin(centre[deep])])))
    return tuple(found)


def visible_scale(extent: float, size: float) -> float:
    """A round factor of at least one that makes a motion well visible on bodies of an extent."""
    return max(1.0, round_125(_VISIBLE * extent / size)) if size > _ROUND_OFF * extent else 1.0


@dataclass(frozen=True, eq=False)
class Motion:
    """A run prepared for drawing, with one scale and colour range for all frames.

    Attributes
    ----------
    trajectory : Trajectory
        Run whose modal basis holds shapes over the body.
    indices : (F,) integer array
        Output times to draw.
    colour : "displacement" or "von_mises"
        Quantity that colours the body.
    given_scale : float or None
        Factor of all displacements; None for one that makes the largest well visible.

    Raises
    ------
    InputError
        For a basis without shapes, another colour, or a scale that is not positive.
    """

    trajectory: Trajectory
    indices: NDArray[np.intp]
    colour: Colour = "displacement"
    given_scale: float | None = None

    def __post_init__(self) -> None:
        require_field(self.trajectory)
        if self.colour not in COLOURS:
            raise InputError(f"colour = '{self.colour}' is not known"
                             f"{nearest(self.colour, COLOURS)}; choose from {choices(COLOURS)}.")
        if self.given_scale is not None:
            require_scale("The deformation", self.given_scale)

    @cached_property
    def mode_shapes(self) -> ModeShapes:
        """Modes over the body."""
        return require_field(self.trajectory)

    @cached_property
    def times(self) -> Array:
        """Times (F,) of the frames [s]."""
        return self.trajectory.time[self.indices]

    @cached_property
    def forces(self) -> Array:
        """Forces (F, n + f, d) on the contact nodes and on their feet, along the axes [N]."""
        forces = contact_forces(self.trajectory, self.indices)
        return np.concatenate([forces, -forces[:, self.footed]], axis=1)

    @cached_property
    def states(self) -> NDArray[np.int8]:
        """States (F, n + f) of contact nodes and feet, as numbers of :attr:`state_names`."""
        states = np.minimum(self.trajectory.contact_state[self.indices],
                            len(self.state_names) - 1)
        return np.concatenate([states, states[:, self.footed]], axis=1)

    @cached_property
    def footed(self) -> NDArray[np.intp]:
        """Contact nodes (f,) whose other side is a body, not the ground."""
        basis = self.trajectory.basis
        return np.flatnonzero(~basis.ground_nodes & ~basis.spring_nodes)

    @cached_property
    def has_ground(self) -> bool:
        """Whether there is a ground under any of the bodies."""
        return bool(self.trajectory.basis.ground_nodes.any())

    @cached_property
    def sliding(self) -> tuple[str, ...]:
        """Bodies with prescribed sliding, and its direction, such as ``disc ↺ 3 rad/s``.

        A body whose sliding varies in time has no number; it stands still in the picture.
        """
        system = self.trajectory.system
        if not system.sliding:
            return ()
        feet, d = contact_sides(system.basis)[1], system.basis.dimension
        found: dict[str, None] = {}
        for face in contact_faces(system.basis):
            if face.name not in system.sliding:
                continue
            nodes = feet[d * face.nodes.start : d * face.nodes.stop].indices // d
            other = [part.name for part in system.basis.parts
                     if len(nodes) and part.nodes[0] <= nodes[0] < sum(part.nodes)]
            found[f"{other[0] if other else 'ground'} {_way(system.sliding[face.name])}"] = None
        return tuple(found)

    @cached_property
    def labels(self) -> tuple[tuple[str, int], ...]:
        """Names of the bodies of several, and the nodes at which they stand."""
        return body_labels(self.trajectory.basis)

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: without any friction force a node is open or in contact."""
        return state_names(self.trajectory)

    @cached_property
    def largest_force(self) -> float:
        """Largest force on a contact node [N]."""
        return float(np.linalg.norm(self.forces, axis=2).max(initial=0.0))

    @cached_property
    def scale(self) -> float:
        """Factor of all displacements, a round number of at least one unless it was given."""
        if self.given_scale is not None:
            return float(self.given_scale)
        extent = float(np.linalg.norm(np.ptp(self.mode_shapes.nodes, axis=0)))
        return visible_scale(extent, max(self._largest["shape"], self.still_size))

    @property
    def still_size(self) -> float:
        """Size of what is magnified beside the bodies: waves of the ground and the gap [m]."""
        low, high = self.trajectory.system.ground.height_range if self.has_ground else (0.0, 0.0)
        return max(0.5 * (high - low), self.gap)

    @cached_property
    def largest_colour(self) -> float:
        """Upper end of the colour range, in SI units; the lower end is zero.

        The largest value of all frames; where few nodes have much higher stresses than all others,
        the 99th percentile of the largest stress of each node.
        """
        return stress_limit(self._stress) if self.colour == "von_mises" else self.peak

    @cached_property
    def peak(self) -> float:
        """Largest value of what colours the body, of all nodes and frames, in SI units."""
        return float(self._stress.max()) if self.colour == "von_mises" else (
            self._largest["displacement"])

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest coordinates (2, d) that the drawn body reaches [m]."""
        return np.stack([np.minimum(self.mode_shapes.nodes.min(axis=0), self._extremes[0]),
                         np.maximum(self.mode_shapes.nodes.max(axis=0), self._extremes[1])])

    @cached_property
    def ground_level(self) -> float:
        """Drawn height of the flat ground: under the lowest contact node by its gap [m]."""
        if not self.has_ground:
            return float(self.bounds[0, -1])
        basis = self.trajectory.basis
        heights = basis.contact_places[basis.ground_nodes, -1]
        return float(heights.min() - self.scale * self.gap)

    def body(self, frame: int) -> tuple[Array, Array]:
        """Drawn positions (N, d) of the nodes [m] and their colour values (N,) in SI units."""
        q = self._q(frame)
        motion = displacement(self.mode_shapes, q)[0]
        colours = np.linalg.norm(motion, axis=1) if self.colour == "displacement" else \
            von_mises(self.mode_shapes, q)[0]
        return self.mode_shapes.nodes + self._scaled(motion[None], q)[0], colours

    def contact_places(self, frame: int) -> Array:
        """Drawn positions (n + f, d) of the contact nodes and of their feet [m]."""
        q = self._q(frame)
        places, rows = self.contact_rows
        return places + self._scaled((rows @ q[0])[None], q)[0]

    def ground(self, frame: int, x: Array) -> Array:
        """Drawn heights (k,) of the ground at the drawn abscissae x (k,) [m]."""
        height = self.trajectory.system.ground.height(x, float(self.times[frame]))
        return self.ground_level + self.scale * height

    @cached_property
    def travel(self) -> Array:
        """Drawn travel (F,) of the ground [m]."""
        ground = self.trajectory.system.ground
        return self._drift_scale * np.array([ground.travel(float(time)) for time in self.times])

    @cached_property
    def ground_speed(self) -> float:
        """Mean speed of the ground over the frames, positive in +x [m/s]."""
        ground, first, last = self.trajectory.system.ground, self.times[0], self.times[-1]
        if last == first:
            return ground.velocity(float(first))
        return (ground.travel(float(last)) - ground.travel(float(first))) / float(last - first)

    @cached_property
    def contact_rows(self) -> tuple[Array, Array]:
        """Places (n + f, d) of contact nodes and feet, and their displacements (n + f, d, m)."""
        basis, field = self.trajectory.basis, self.mode_shapes
        places, d = basis.contact_places, basis.dimension
        if not several_bodies(basis):
            return places, basis.contact_T[:, :d]
        own, feet = contact_sides(basis)
        shapes = field.shapes.reshape(d * len(field.nodes), basis.modes)
        rows = [np.asarray(side @ shapes).reshape(-1, d, basis.modes) for side in (own, feet)]
        foot_places = np.asarray(feet @ field.nodes.reshape(-1)).reshape(-1, d)
        return (np.concatenate([places, foot_places[self.footed]]),
                np.concatenate([rows[0], rows[1][self.footed]]))

    @cached_property
    def gap(self) -> float:
        """Smallest gap of a contact node above the ground [m]."""
        gap = self.trajectory.system.gap
        if not isinstance(gap, tuple):
            return float(cast(float, gap))
        below = np.asarray(gap)[self.trajectory.basis.ground_nodes]
        return float(below.min()) if len(below) else 0.0

    @property
    def _drift_scale(self) -> float:
        """Factor of the ground's travel and of the body's drift along it.

        Both have the same factor, so that a node that sticks stays with the marks of the ground.
        Over waves, which are drawn in their true length, the factor is one.
        """
        return 1.0 if self._wavy else self.scale

    @property
    def _wavy(self) -> bool:
        return self.has_ground and self.trajectory.system.ground.wavy

    def _drift(self, q: Array) -> Array:
        """Mean displacement (k, d - 1) along the ground of the contact nodes on it [m]."""
        basis = self.trajectory.basis
        along = basis.dimension - 1
        if not self.has_ground:
            return np.zeros((len(q), along))
        return np.asarray(q @ basis.contact_T[basis.ground_nodes, :along].mean(axis=0).T)

    def _scaled(self, motion: Array, q: Array) -> Array:
        """Drawn motion (k, N, d) from displacements (k, N, d) at coordinates q (k, m)."""
        drawn = self.scale * motion
        drawn[..., :-1] += (self._drift_scale - self.scale) * self._drift(q)[:, None]
        return drawn

    def _q(self, frame: int) -> Array:
        which = self.indices[frame]
        return self.trajectory.modal_coordinates[which : which + 1]

    @cached_property
    def _extremes(self) -> tuple[Array, Array]:
        low, high = np.full((2, self.trajectory.basis.dimension), [[np.inf], [-np.inf]])
        for which in blocks(self.indices, len(self.mode_shapes.nodes)):
            q = self.trajectory.modal_coordinates[which]
            places = self.mode_shapes.nodes + self._scaled(displacement(self.mode_shapes, q), q)
            low = np.minimum(low, places.min(axis=(0, 1)))
            high = np.maximum(high, places.max(axis=(0, 1)))
        return low, high

    @cached_property
    def _largest(self) -> dict[str, float]:
        largest = {"displacement": 0.0, "shape": 0.0}
        for which in blocks(self.indices, len(self.mode_shapes.nodes)):
            q = self.trajectory.modal_coordinates[which]
            motion = displacement(self.mode_shapes, q)
            size = np.linalg.norm(motion, axis=2).max()
            largest["displacement"] = max(largest["displacement"], float(size))
            motion[..., :-1] -= self._wavy * self._drift(q)[:, None]
            size = np.linalg.norm(motion, axis=2).max()
            largest["shape"] = max(largest["shape"], float(size))
        return largest

    @cached_property
    def _stress(self) -> Array:
        """Largest von Mises stress (N,) of each node in all frames [Pa]."""
        largest = np.zeros(len(self.mode_shapes.nodes))
        for which in blocks(self.indices, len(largest)):
            found = von_mises(self.mode_shapes, self.trajectory.modal_coordinates[which])
            np.maximum(largest, found.max(axis=0), out=largest)
        return largest
