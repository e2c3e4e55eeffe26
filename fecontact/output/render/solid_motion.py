"""Data of the frames of solids: the ground below them in two directions, maps of their faces."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import require_choice
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.laws.ground.ground import Ground
from fecontact.laws.wear import WearLaw
from fecontact.output.files.frames import ground_shape
from fecontact.output.plots.solids.plans import FacePlan, face_plans
from fecontact.output.render.frames_data import Motion

View = Literal["above", "below"]
VIEWS = ("above", "below")
_MOST_FACES = 4  # with maps beside the picture


@dataclass(frozen=True, eq=False)
class SolidMotion(Motion):
    """A run of solids prepared for drawing.

    Attributes
    ----------
    view : "above" or "below"
        View of the bodies; from below their contact faces show.
    wear : WearLaw or None
        For a map of the worn depth.
    """

    view: View = "above"
    wear: WearLaw | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require_choice("A picture of solids", "view", self.view, VIEWS)
        require_kind("A picture of solids", (WearLaw, type(None)), wear=self.wear)

    @cached_property
    def has_ground(self) -> bool:
        """True if the ground is drawn: seen from below it would hide everything."""
        return self.on_ground and self.view == "above"

    @property
    def on_ground(self) -> bool:
        """True if any of the bodies stands on the ground."""
        return bool(self.trajectory.basis.ground_nodes.any())

    @cached_property
    def plans(self) -> tuple[FacePlan, ...]:
        """The first few contact faces, laid flat."""
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
        """Friction (F, n, 3) on the body of each contact node, along the axes [N]."""
        forces = -self.trajectory.friction_forces[self.indices]
        return np.einsum("fnk,nkd->fnd", forces, self.trajectory.basis.tangents)

    @cached_property
    def largest_friction(self) -> float:
        """Largest friction force on a contact node [N]."""
        return float(np.linalg.norm(self.friction, axis=2).max(initial=0.0))

    @cached_property
    def ground_pose(self) -> tuple[Array, Array, Array]:
        """Drawn travel (F, 2) [m] and turn (F,) [rad] of the ground, and the centre (2,) of it.

        Steady travel beside a turn is a turn about another centre.
        """
        ground = self.trajectory.system.ground
        along, across = ground, Ground(speed=ground.speed_y, motion=ground.motion_y)
        way = np.array([(along.travel(float(t)), across.travel(float(t))) for t in self.times])
        centre, rate = np.array(ground.centre), ground.rotation_speed
        if rate and ground.motion is None and ground.motion_y is None:
            centre = centre + np.array([-ground.speed_y, ground.speed]) / rate
            way = np.zeros_like(way)
        return self._drift_scale * way, self._drift_scale * rate * self.times, centre

    def ground_velocity(self, frame: int, places: Array) -> Array:
        """Velocity (k, 2) of the ground at places (k, 2) [m/s]."""
        ground, t = self.trajectory.system.ground, float(self.times[frame])
        arms = places - np.array(ground.centre)
        turning = ground.rotation_speed * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        across = Ground(speed=ground.speed_y, motion=ground.motion_y)
        return turning + np.array([ground.velocity(t), across.velocity(t)])

    def ground_heights(self, frame: int, places: Array) -> Array:
        """Drawn heights (...,) of the ground at drawn places (..., 2) [m]."""
        ground = self.trajectory.system.ground
        if not ground.wavy:
            return np.full(places.shape[:-1], self.ground_level)
        at = places - self.ground_pose[0][frame]  # drawn in its true length
        return self.ground_level + self.scale * ground_shape(ground, at[..., 0], at[..., 1])[..., 0]


def motion_words(motion: SolidMotion) -> list[str]:
    """Words for the motion of the ground: speed and direction, and rotation."""
    ground = motion.trajectory.system.ground
    if not motion.on_ground:
        return []
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
