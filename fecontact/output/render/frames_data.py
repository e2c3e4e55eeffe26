"""Data of the frames of a movie: positions, colours, forces and ground."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind, require_scale
from fecontact.core.errors import InputError, choices, nearest, require_choice
from fecontact.core.types import Array
from fecontact.core.units import quantity, round_125
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.sliding import Sliding, SlidingRotation
from fecontact.laws.wear import WearLaw
from fecontact.output.files.frames import (
    contact_forces,
    displacement,
    ground_shape,
    require_field,
    von_mises,
)
from fecontact.output.plots.solids.plans import FacePlan, face_plans
from fecontact.output.plots.style import state_names
from fecontact.output.render.ranges import Ranges
from fecontact.reduction.assembly.contact_faces import contact_faces, contact_sides, several_bodies
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes

Colour = Literal["displacement", "von_mises"]
View = Literal["above", "below"]
VIEWS = ("above", "below")

COLOURS = {"displacement": ("displacement", "m"), "von_mises": ("von Mises stress", "Pa")}

_VISIBLE = 0.1  # largest motion drawn, as a part of the body's extent
_ROUND_OFF = 1e-12  # of the extent, below which a motion is not magnified
_LABEL_ROOM = 0.1  # of the extent of all bodies, from a body's name to the nearest contact node
_MOST_FACES = 4  # of solids with maps beside the picture


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


def ground_travel(ground: Ground, times: Array) -> Array:
    """Travel (F, 2) of the ground along x and y at some times [m]."""
    across = Ground(speed=ground.speed_y, motion=ground.motion_y)
    return np.array([(ground.travel(time), across.travel(time)) for time in times.tolist()])


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
    view : "above" or "below"
        View of solids; from below their contact faces show.
    wear : WearLaw or None
        For a map of the worn depth of solids.

    Raises
    ------
    InputError
        For a basis without shapes, another colour or view, a scale that is not positive, and for
        a view or wear of plane bodies.
    """

    trajectory: Trajectory
    indices: NDArray[np.intp]
    colour: Colour = "displacement"
    given_scale: float | None = None
    view: View = "above"
    wear: WearLaw | None = None

    def __post_init__(self) -> None:
        require_field(self.trajectory)
        if self.colour not in COLOURS:
            raise InputError(f"colour = '{self.colour}' is not known"
                             f"{nearest(self.colour, COLOURS)}; choose from {choices(COLOURS)}.")
        if self.given_scale is not None:
            require_scale("The deformation", self.given_scale)
        for name, given, usual in (("view", self.view, "above"), ("wear", self.wear, None)):
            if given != usual and not self.solid:
                raise InputError(f"{name} = {given!r} is for solids, but this run has plane "
                                 f"bodies; leave it out.")
        require_choice("A picture of solids", "view", self.view, VIEWS)
        require_kind("A picture of solids", (WearLaw, type(None)), wear=self.wear)

    @property
    def solid(self) -> bool:
        """True for bodies in space, False for plane ones."""
        return self.trajectory.basis.dimension == 3

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
    def on_ground(self) -> bool:
        """True if any of the bodies stands on the ground."""
        return bool(self.trajectory.basis.ground_nodes.any())

    @property
    def has_ground(self) -> bool:
        """True if the ground is drawn: seen from below it would hide everything."""
        return self.on_ground and self.view == "above"

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
    def ranges(self) -> Ranges:
        """Largest values over all frames."""
        field, q = self.mode_shapes, self.trajectory.modal_coordinates[self.indices]
        return Ranges(field.nodes, field.shapes, field.stress_terms, field.stress_coordinates(q),
                      self.drift)

    @cached_property
    def scale(self) -> float:
        """Factor of all displacements, a round number of at least one unless it was given."""
        if self.given_scale is not None:
            return float(self.given_scale)
        extent = float(np.linalg.norm(np.ptp(self.mode_shapes.nodes, axis=0)))
        return visible_scale(extent, max(self.ranges.largest_magnified, self.still_size))

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
        return self.ranges.stress_range if self.colour == "von_mises" else self.peak

    @property
    def peak(self) -> float:
        """Largest value of what colours the body, of all nodes and frames, in SI units."""
        return (self.ranges.largest_stress if self.colour == "von_mises"
                else self.ranges.largest_displacement)

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest coordinates (2, d) that the drawn body reaches [m]."""
        return self.ranges.box(self.scale)

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
        motion = displacement(self.mode_shapes, q[None])[0]
        colours = np.linalg.norm(motion, axis=1) if self.colour == "displacement" else \
            von_mises(self.mode_shapes, q[None])[0]
        return self.mode_shapes.nodes + self._scaled(motion, q), colours

    def contact_places(self, frame: int) -> Array:
        """Drawn positions (n + f, d) of the contact nodes and of their feet [m]."""
        q, (places, rows) = self._q(frame), self.contact_rows
        return places + self._scaled(rows @ q, q)

    def ground(self, frame: int, places: Array) -> Array:
        """Drawn heights (...,) of the ground at drawn places (..., d - 1) [m]."""
        ground = self.trajectory.system.ground
        if not ground.wavy:
            return np.full(places.shape[:-1], self.ground_level)
        at = places - self.ground_pose[0][frame, : places.shape[-1]]
        x, y = at[..., 0], at[..., 1] if self.solid else np.zeros(at.shape[:-1])
        return self.ground_level + self.scale * ground_shape(ground, x, y)[..., 0]

    @cached_property
    def ground_pose(self) -> tuple[Array, Array, Array]:
        """Drawn travel (F, 2) [m] and turn (F,) [rad] of the ground, and the centre (2,) of it.

        Over waves, which are drawn in their true length, it is not magnified; elsewhere as much as
        the bodies, so that a node that sticks stays with the marks of the ground. Steady travel
        beside a turn is a turn about another centre.
        """
        ground = self.trajectory.system.ground
        way, rate = ground_travel(ground, self.times), ground.rotation_speed
        centre = np.array(ground.centre)
        if rate and ground.motion is None and ground.motion_y is None:
            centre = centre + np.array([-ground.speed_y, ground.speed]) / rate
            way = np.zeros_like(way)
        scale = 1.0 if self._wavy else self.scale
        return scale * way, scale * rate * self.times, centre

    def ground_velocity(self, frame: int, places: Array) -> Array:
        """Velocity (k, 2) of the ground at places (k, 2) [m/s]."""
        ground, t = self.trajectory.system.ground, float(self.times[frame])
        arms = places - np.array(ground.centre)
        turning = ground.rotation_speed * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        across = Ground(speed=ground.speed_y, motion=ground.motion_y)
        return turning + np.array([ground.velocity(t), across.velocity(t)])

    @cached_property
    def ground_speed(self) -> float:
        """Mean speed of the ground along x over the frames [m/s]."""
        ground, first, last = self.trajectory.system.ground, self.times[0], self.times[-1]
        if last == first:
            return ground.velocity(float(first))
        return (ground.travel(float(last)) - ground.travel(float(first))) / float(last - first)

    @cached_property
    def moving(self) -> str:
        """Words for the motion of the ground and of bodies with prescribed sliding."""
        return "   ".join([*(_ground_words(self) if self.on_ground else []), *self.sliding])

    @cached_property
    def plans(self) -> tuple[FacePlan, ...]:
        """The first few contact faces of solids, laid flat."""
        return face_plans(self.trajectory.basis, "contact map")[:_MOST_FACES]

    @cached_property
    def pressures(self) -> Array:
        """Contact pressures (F, n) [Pa]."""
        return self.trajectory.pressure[self.indices]

    @cached_property
    def largest_pressure(self) -> float:
        """Upper end of the range of pressures [Pa]."""
        return float(self.pressures.max(initial=0.0))

    @cached_property
    def worn(self) -> Array | None:
        """Depth (F, n) worn off since the start of the run [m]; None without wear law."""
        if self.wear is None:
            return None
        return self.trajectory.wear_depth(self.wear)[self.indices]

    @cached_property
    def friction(self) -> Array:
        """Friction (F, n, 3) on solids at each contact node, along the axes [N]."""
        forces = -self.trajectory.friction_forces[self.indices]
        return np.einsum("fnk,nkd->fnd", forces, self.trajectory.basis.tangents)

    @cached_property
    def largest_friction(self) -> float:
        """Largest friction force on a contact node [N]."""
        return float(np.linalg.norm(self.friction, axis=2).max(initial=0.0))

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

    @cached_property
    def drift(self) -> Array:
        """Mean displacement (d - 1, m) along wavy ground of the contact nodes on it.

        Wavy ground is drawn in its true length, so that it is not magnified; zero on flat ground.
        """
        basis = self.trajectory.basis
        rows = basis.contact_T[:, : basis.dimension - 1]
        if not self._wavy:
            return np.zeros(rows.shape[1:])
        return np.asarray(rows[basis.ground_nodes].mean(axis=0))

    @property
    def _wavy(self) -> bool:
        return self.has_ground and self.trajectory.system.ground.wavy

    def _q(self, frame: int) -> Array:
        return self.trajectory.modal_coordinates[self.indices[frame]]

    def _scaled(self, motion: Array, q: Array) -> Array:
        """Drawn motion (N, d) of displacements (N, d) at coordinates q (m,)."""
        drawn = self.scale * motion
        drawn[:, :-1] += (1.0 - self.scale) * (self.drift @ q)
        return drawn


def _ground_words(motion: Motion) -> list[str]:
    """Speed and direction of the ground, in space also its rotation."""
    ground = motion.trajectory.system.ground
    if not motion.solid:
        speed = motion.ground_speed
        return [f"ground {'→' if speed > 0.0 else '←'} {quantity(abs(speed), 'm/s')}"] * (
            speed != 0.0)
    found = []
    if ground.motion is not None or ground.motion_y is not None:
        found.append("ground moves, speed varies")
    elif ground.speed or ground.speed_y:
        speed = float(np.hypot(ground.speed, ground.speed_y))
        degrees = round(np.degrees(np.arctan2(ground.speed_y, ground.speed)))
        way = {0: "along x", 90: "along y", 180: "along -x", -180: "along -x", -90: "along -y"}
        found.append(f"ground {quantity(speed, 'm/s')} "
                     + way.get(degrees, f"at {degrees}° from x"))
    if ground.rotation_speed:
        arrow = "↺" if ground.rotation_speed > 0.0 else "↻"
        found.append(f"ground {arrow} {quantity(abs(ground.rotation_speed), 'rad/s')}")
    return found
