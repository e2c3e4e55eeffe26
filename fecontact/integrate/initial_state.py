"""Initial states of runs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import as_floats, is_numeric, require_kind, require_state
from fecontact.core.errors import InputError, choices, nearest, require_finite, shown
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array
from fecontact.fem.faces.frames import turned
from fecontact.integrate.trajectory import Trajectory
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.given import travelled
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState
from fecontact.system.statics.equilibrium import equilibrium_state

RigidMotion = (tuple[float, float, float]
               | tuple[float, float, float, float, float, float])


@dataclass(frozen=True)
class RigidStart:
    """Initial rigid-body displacement and velocity.

    Parameters
    ----------
    displacement : (x, y, phi), of solids (x, y, z, phi_x, phi_y, phi_z)
        Of the origin of coordinates [m, m, rad]; phi counter-clockwise.
    velocity : (x, y, phi), of solids (x, y, z, phi_x, phi_y, phi_z)
        Of the origin of coordinates [m/s, m/s, rad/s].

    Raises
    ------
    InputError
        If either is not three or six numbers from -1e60 to 1e60.
    """

    displacement: RigidMotion = (0.0, 0.0, 0.0)
    velocity: RigidMotion = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("displacement", "velocity"):
            given = getattr(self, name)
            values = as_floats(given, name) if is_numeric(given) else np.zeros(0)
            if values.shape not in ((3,), (6,)) or not np.isfinite(values).all():
                raise InputError(f"RigidStart: {name} = {shown(given)} must be three finite "
                                 f"numbers: x [m], y [m] and phi [rad], or their rates; of a solid "
                                 f"six: x, y, z, phi_x, phi_y and phi_z.")
            for value in values.tolist():
                require_finite("RigidStart", **{name: value})
            object.__setattr__(self, name, tuple(values.tolist()))


PointMotion = tuple[float | None, ...] | Mapping[str, float]

_COUNTS = {2: ("x", "y"), 6: ("x", "y", "z", "phi_x", "phi_y", "phi_z")}
_NAMES = ("x", "y", "z", "phi", "phi_x", "phi_y", "phi_z")


@dataclass(frozen=True)
class PointStart:
    """Initial displacements and velocities of points, in physical coordinates.

    Of all motions with these values the one of least mass: the smallest sum of squares of the modal
    coordinates. All coordinates of point masses follow from those of the masses; what is not given
    stays where least mass leaves it, for masses that no spring joins at rest.

    Parameters
    ----------
    displacements : mapping of point to motion
        Points by name, as ``body.point`` of several bodies, or contact nodes by number. A motion is
        ``(x, y)`` or ``(x, y, phi)`` of a point of a plane body, ``(x, y, z)`` or ``(x, y, z,
        phi_x, phi_y, phi_z)`` of a solid [m, rad], with None for a component that is not
        prescribed; or a table of the prescribed components, ``{"y": 1e-3, "phi": 0.01}``.
        Components of contact nodes are those of their frames: along tangents and normal.
    velocities : mapping of point to motion
        Likewise [m/s, rad/s].

    Raises
    ------
    InputError
        If values are neither numbers from -1e60 to 1e60 nor None, or components are unknown.
    """

    displacements: Mapping[str | int, PointMotion] = field(default_factory=dict)
    velocities: Mapping[str | int, PointMotion] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("displacements", "velocities"):
            require_kind("PointStart", Mapping, **{name: getattr(self, name)})
            object.__setattr__(self, name, {
                int(point) if isinstance(point, str) and point.isdecimal() else point:
                _point_motion(motion, f"PointStart: {name} of {point!r}")
                for point, motion in getattr(self, name).items()})

    def require_writable(self, where: str) -> None:
        """Raise :class:`InputError` unless study files, which have no None, can hold it."""
        for name in ("displacements", "velocities"):
            for point, motion in getattr(self, name).items():
                if not isinstance(motion, Mapping) and None in motion:
                    raise InputError(f"{where}: {name} of {point!r} = {motion} holds None, which a "
                                     f"study file cannot; name the components that are prescribed "
                                     f"in a table such as {{x = 1e-3}}.")


def _point_motion(given: Any, where: str) -> PointMotion:
    """A motion of a point; a table of components where some of a list are None.

    The meaning of the third of three components depends on the body: such lists stay as they are.
    """
    if isinstance(given, Mapping):
        if unknown := [name for name in given if name not in _NAMES]:
            raise InputError(f"{where}: the component {unknown[0]!r} must be one of "
                             f"{choices(_NAMES)}.")
        values = list(given.values())
    else:
        values = list(given) if isinstance(given, list | tuple) else []
        if len(values) not in (2, 3, 6):
            values = [np.nan]
    known = [value for value in values if value is not None]
    if known and (not is_numeric(known) or not np.isfinite(as_floats(known, where)).all()):
        raise InputError(f"{where} = {shown(given)} must be two, three or six finite numbers (x, "
                         f"y, then phi in the plane, z, phi_x, phi_y, phi_z in space), None for "
                         f"those that are not prescribed, or a table such as {{x = 1e-3}}.")
    for value in known:
        require_finite("PointStart", **{where.partition(": ")[2]: value})
    if isinstance(given, Mapping):
        return {str(name): float(value) for name, value in given.items() if value is not None}
    if None not in values:
        return tuple(float(value) for value in values)
    names = _COUNTS.get(len(values)) or (_COUNTS[2] if values[2] is None else ())
    if not names:
        return tuple(None if value is None else float(value) for value in values)
    return {name: float(value) for name, value in zip(names, values, strict=False)
            if value is not None}


Initial = TypeAliasType("Initial", Literal["rest", "sliding"] | RigidStart | PointStart
                        | Trajectory | LoadHistory | RestState | Array)


@one_blas_thread
def initial_state(system: ContactSystem, initial: Initial, time: float) -> Array:
    """State y = [q, q', z] (2 m + n s,) for the start of a run.

    Parameters
    ----------
    system : ContactSystem
        The system.
    initial : 'rest', 'sliding', RigidStart, PointStart, Trajectory, LoadHistory, RestState or array
        Normal equilibrium where the body stands, all forces of the ground along x left to
        friction; steady sliding; rigid motion; motion of points; the end of another run;
        rest under friction after quasi-static loading; or a state (2 m + n s,). Internal variables
        of friction with memory are zero, in steady sliding their steady values. What friction does
        not hold on waves begins to slide down their slopes:
        :func:`fecontact.equilibrium` finds where it rests.

        After loading, Jenkins and Iwan elements keep their deflections, and with ``SetValued``
        friction is again what equilibrium needs. Smoothed friction without memory has no force at
        rest: its contacts keep their places, but creep from there at velocities of order 1/k_s.
    time : float
        Start of the run [s].

    Raises
    ------
    InputError
        For an unknown kind, a state of wrong size or with values that are NaN or beyond 1e60, or a
        rigid motion that the supports prevent.
    AnalysisError
        If there is no equilibrium to start from.
    """
    m = system.basis.modes
    if isinstance(initial, str):
        if initial not in ("rest", "sliding"):
            names = ("rest", "sliding")
            raise InputError(f"initial = '{initial}' must be one of {choices(names)}"
                             f"{nearest(initial, names)}, or a rigid displacement and velocity.")
        return equilibrium_state(system, initial, time, standing=initial == "rest")
    if isinstance(initial, RigidStart):
        return np.concatenate([_rigid(system.basis, initial.displacement, "displacement"),
                               _rigid(system.basis, initial.velocity, "velocity"),
                               np.zeros(system.size - 2 * m)])
    if isinstance(initial, PointStart):
        return np.concatenate([_of_points(system.basis, initial.displacements, "displacements"),
                               _of_points(system.basis, initial.velocities, "velocities"),
                               np.zeros(system.size - 2 * m)])
    if isinstance(initial, LoadHistory | RestState):
        return _rest_under_friction(system, initial, time)
    given = initial.states[-1] if isinstance(initial, Trajectory) else initial
    if not is_numeric(given):
        raise InputError(f"initial = {shown(given)} must be 'rest', 'sliding', a RigidStart, a "
                         f"Trajectory or an array of real numbers.")
    state = np.array(as_floats(given, "initial"))
    if state.shape != (system.size,):
        raise InputError(f"The initial state must have {system.size} values [q, q', z], not shape "
                         f"{state.shape}.")
    require_state(state)
    return state


def _rest_under_friction(
    system: ContactSystem, initial: LoadHistory | RestState, time: float
) -> Array:
    """State at rest with what its friction remembers."""
    rest = initial.state() if isinstance(initial, LoadHistory) else initial
    memory = rest.memory(system)
    ground, nodes = system.ground, system.basis.ground_nodes
    before = travelled(system, rest.travels)[nodes]
    now = system.prescribed_motion.travel(time)[nodes]
    if (ground.wavy or ground.friction_scale_kernel is not None) and (before != now).any():
        away = int(np.argmax(np.abs(now - before).reshape(len(now), -1).max(axis=1)))
        found, wanted = (", ".join(f"{value:g}" for value in np.atleast_1d(one[away]))
                        for one in (before, now))
        raise InputError(f"The ground has travelled {found} m in the state at rest, but {wanted} m "
                         f"at the start of the run, where it has other heights or friction; end "
                         f"the path of loads where the ground of the run begins, or start the run "
                         f"at another time.")
    q = rest.modal_coordinates
    return np.concatenate([q, np.zeros(len(q)), memory.reshape(-1)])


def _of_points(basis: ModalBasis, given: Mapping[str | int, PointMotion], what: str) -> Array:
    """Modal coordinates (m,) of least norm with given motions of points."""
    found = [(basis.point_row(point, component), value) for point, motion in given.items()
             for component, value in _components(basis, point, motion, what)]
    if not found:
        return np.zeros(basis.modes)
    rows, values = np.array([row for row, _ in found]), np.array([value for _, value in found])
    # Displacements [m] and rotations [rad] count by their own sizes.
    sizes = np.linalg.norm(rows, axis=1)
    sizes[sizes == 0.0] = 1.0
    rows, values = rows / sizes[:, None], values / sizes
    q = np.asarray(np.linalg.lstsq(rows, values, rcond=None)[0])
    if np.abs(rows @ q - values).max() > 1e-9 * np.abs(values).max():
        raise InputError(f"PointStart: {what} = {shown(dict(given))} are not a motion that the "
                         f"modes can make; leave out what they hold, or keep more modes.")
    return q


def _components(
    basis: ModalBasis, point: str | int, motion: PointMotion, what: str,
) -> list[tuple[str, float]]:
    """Names and values of the prescribed components of a point."""
    names = basis.components
    if isinstance(motion, Mapping):
        if unknown := [name for name in motion if name not in names]:
            raise InputError(f"PointStart: {what} of {point!r}: the component {unknown[0]!r} must "
                             f"be one of {choices(names)}.")
        return list(motion.items())
    if (len(motion) == 2 and basis.dimension == 3) or len(motion) > len(names):
        allowed = "two or three numbers" if basis.dimension == 2 else "three or six numbers"
        raise InputError(f"PointStart: {what} of {point!r} = {motion} must be {allowed}, "
                         f"{', '.join(names)}.")
    return [(name, value) for name, value in zip(names, motion, strict=False) if value is not None]


def _rigid(basis: ModalBasis, motion: RigidMotion, what: str) -> Array:
    q = np.zeros(basis.modes)
    wanted = np.array(motion)
    if not wanted.any():
        return q
    if len(wanted) != len(basis.components):
        raise InputError(f"initial: {what} = {tuple(motion)} must have {len(basis.components)} "
                         f"numbers, {', '.join(basis.components)}.")
    target = _rigid_in_space(basis, wanted) if basis.dimension == 3 else _rigid_in_plane(
        basis, wanted)
    # Ignore points without rows (such as a missing B or C) and unused components.
    rigid = basis.angular_frequencies == 0.0
    rows = basis.T.reshape(-1, basis.modes)[:, rigid]
    used = np.abs(basis.T.reshape(-1, basis.modes)).any(axis=1)
    wanted_rows = target.reshape(-1)[used]
    if rigid.any():
        q[rigid] = np.linalg.lstsq(rows[used], wanted_rows, rcond=None)[0]
    missed = np.abs(basis.T.reshape(-1, basis.modes)[used] @ q - wanted_rows).max()
    if missed > 1e-6 * np.abs(wanted_rows).max():
        raise InputError(f"initial: {what} = {tuple(motion)} is not a motion that the body is free "
                         f"to make; it has {basis.rigid_modes} rigid modes.")
    return q


def _rigid_in_plane(basis: ModalBasis, wanted: Array) -> Array:
    """Motion (P, 3) of the points of a plane body that moves rigidly."""
    x, y = basis.positions.T
    return np.stack([wanted[0] - wanted[2] * y, wanted[1] + wanted[2] * x,
                     np.full(len(x), wanted[2])], axis=1)


def _rigid_in_space(basis: ModalBasis, wanted: Array) -> Array:
    """Motion (P, 6) of the points of a solid; of contact nodes in their frames."""
    found = np.tile(wanted, (len(basis.positions), 1))
    found[:, :3] += np.cross(wanted[3:], basis.positions)
    nodes = slice(2, 2 + basis.contact_nodes)
    found[nodes] = turned(found[nodes, :, None], basis.normals)[:, :, 0]
    return found
