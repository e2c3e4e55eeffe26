"""The contact system: a modal basis, laws at its contact nodes, drive and load."""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact import contact_kernels as kernels
from fecontact.basis import ModalBasis
from fecontact.errors import InputError, choices, nearest
from fecontact.gap import Gap, gap_values
from fecontact.laws.drive import Drive, Load
from fecontact.laws.friction import ExponentialFriction, FrictionLaw
from fecontact.laws.ground import Ground
from fecontact.laws.normal import NormalLaw, RoughSurface

Array = NDArray[np.float64]

PARTS = ("normal", "friction", "ground", "drive", "load")

# What each part must offer; normal and friction functions have the same signature.
_CONTRACTS = {
    "basis": ("T", "tributary"),
    "normal": ("kernel", "table", "stored_energy"),
    "friction": ("kernel", "table", "stick_velocity"),
    "ground": ("profile_kernel", "motion_kernel"),
    "drive": ("motion_kernel", "stiffness_x"),
    "load": ("normal",),
}


@dataclass(frozen=True, eq=False)
class ContactSystem:
    """Reduced equations of an elastic body in contact with moving ground, (4.1-1) to (4.1-23).

    ``q'' + D q' + w^2 q = T^T f`` with, at B, the drive's springs and dashpots, at C the load,
    and at contact node j ``[-R_j, F_j, 0]`` from the normal and the friction law. Immutable; see
    :meth:`with_`.

    Attributes
    ----------
    basis : ModalBasis
    normal : normal law
        Normal force F (zero or above, on the body, upwards) from penetration and its rate.
    friction : friction law
        Friction force R (on the body, against the slip velocity).
    ground : Ground
        Profile and speed of the ground.
    drive : Drive
        Base excitation of B.
    load : Load
        Constant load at C.
    gap : float, (n,) sequence, Crown or function of x
        Initial distance g_j of the contact nodes from flat ground, zero or above [m]; kept as
        numbers.
    """

    basis: ModalBasis
    normal: NormalLaw = field(default_factory=RoughSurface)
    friction: FrictionLaw = field(default_factory=ExponentialFriction)
    ground: Ground = field(default_factory=Ground)
    drive: Drive = field(default_factory=Drive)
    load: Load = field(default_factory=Load)
    gap: Gap = 0.0

    def __post_init__(self) -> None:
        for name, needs in _CONTRACTS.items():
            part = getattr(self, name)
            if not all(hasattr(part, need) for need in needs):
                raise InputError(f"ContactSystem: {name} = {part!r} cannot serve as {name}; it "
                                 f"must have {', '.join(needs)}.")
        object.__setattr__(self, "gap", gap_values(self.gap, self.basis.contact_x))
        _ = self.arrays

    @property
    def share(self) -> Array:
        """Part (n,) of the contact face that belongs to each node; their sum is one."""
        return self.basis.tributary / self.basis.tributary.sum()

    @cached_property
    def arrays(self) -> kernels.SystemArrays:
        """The system as the compiled kernels take it."""
        basis, drive = self.basis, self.drive
        B, C = basis.T[0], basis.T[1]
        stiffness = np.diag(basis.angular_frequencies**2)
        damping = basis.damping.copy()
        for axis, c, b in ((0, drive.stiffness_x, drive.damping_x),
                           (1, drive.stiffness_y, drive.damping_y)):
            stiffness += c * np.outer(B[axis], B[axis])
            damping += b * np.outer(B[axis], B[axis])
        n = basis.contact_nodes
        return kernels.SystemArrays(
            stiffness=stiffness,
            damping=damping,
            constant_load=-self.load.normal * C[1],
            drive_shapes=np.array([drive.stiffness_x * B[0], drive.stiffness_y * B[1]]),
            drive_stiffness=np.array([drive.stiffness_x, drive.stiffness_y], dtype=float),
            Tx=basis.contact_T[:, 0].copy(),
            Ty=basis.contact_T[:, 1].copy(),
            abscissa=basis.contact_x.copy(),
            gap=np.array(np.broadcast_to(np.asarray(self.gap, dtype=float), n)),
            normal_parameters=self.normal.table(self.share),
            friction_parameters=self.friction.table(self.share),
            profile_parameters=self.ground.profile_parameters(),
            ground_motion_parameters=self.ground.motion_parameters(),
            drive_parameters=drive.motion_parameters(),
            normal=self.normal.kernel.address,
            friction=self.friction.kernel.address,
            profile=self.ground.profile_kernel.address,
            ground_motion=self.ground.motion_kernel.address,
            drive=drive.motion_kernel.address,
        )

    def rhs(self, t: float, y: Array) -> Array:
        """Rate y' (2 m,) of the state y = [q, q']."""
        out = np.empty(2 * self.basis.modes)
        kernels.right_hand_side(float(t), self._checked(y), self.arrays, out)
        return out

    def jacobian(self, t: float, y: Array) -> Array:
        """Jacobian dy'/dy (2 m, 2 m)."""
        size = 2 * self.basis.modes
        out = np.empty((size, size))
        kernels.jacobian(float(t), self._checked(y), self.arrays, out)
        return out

    def contact_history(self, times: Array, states: Array) -> Array:
        """Contact quantities (N, n, 6) at N times and states (N, 2 m).

        The columns are normal force [N], friction force [N], penetration [m], its rate [m/s],
        slip velocity [m/s] and the rate of the ground's height under the node [m/s].
        """
        times = np.ascontiguousarray(times, dtype=float)
        states = np.ascontiguousarray(states, dtype=float)
        if times.ndim != 1 or states.shape != (len(times), 2 * self.basis.modes):
            raise InputError(f"The states at {times.size} times must have shape ({times.size}, "
                             f"{2 * self.basis.modes}), not {states.shape}.")
        out = np.empty((len(times), self.basis.contact_nodes, kernels.STATE_COLUMNS))
        kernels.contact_history(times, states, self.arrays, out)
        return out

    def with_(self, **changes: Any) -> "ContactSystem":
        """A copy with other parameters, by their dotted names.

        ``system.with_(**{"friction.static_coefficient": 0.7, "gap": 1e-6})``; a whole part can be
        replaced too, ``system.with_(ground=Ground(speed=0.1))``.

        Raises
        ------
        InputError
            If there is no such parameter (with those that exist), or the value is out of range.
        """
        whole = {entry.name for entry in fields(self)}
        parts = {name: value for name, value in changes.items() if name in whole}
        parameters: dict[str, dict[str, Any]] = {}
        for name, value in changes.items():
            part, _, parameter = name.partition(".")
            if name in whole:
                continue
            if part not in PARTS or parameter not in {
                    entry.name for entry in fields(parts.get(part, getattr(self, part)))}:
                raise self._unknown(name)
            parameters.setdefault(part, {})[parameter] = value
        for part, values in parameters.items():
            parts[part] = replace(parts.get(part, getattr(self, part)), **values)
        return replace(self, **parts)

    def parameters(self) -> dict[str, float | tuple[float, ...]]:
        """All parameters by their dotted names, ``{"friction.static_coefficient": 0.8, ...}``."""
        return {
            f"{part}.{entry.name}": getattr(getattr(self, part), entry.name)
            for part in PARTS
            for entry in fields(getattr(self, part))
        }

    def _checked(self, y: Array) -> Array:
        state = np.ascontiguousarray(y, dtype=float)
        if state.shape != (2 * self.basis.modes,):
            raise InputError(f"A state of this system has {2 * self.basis.modes} values [q, q'], "
                             f"not shape {state.shape}.")
        return state

    def _unknown(self, name: str) -> InputError:
        names = (*self.parameters(), "gap", *PARTS)
        return InputError(f"The system has no parameter '{name}'{nearest(name, names)}; "
                          f"its parameters are: {choices(names)}.")
