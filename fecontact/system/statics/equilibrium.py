"""Static equilibria at rest and in steady sliding."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, require_choice, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed, quantity
from fecontact.laws.excitation import AXES, Load
from fecontact.laws.friction.planar import clear
from fecontact.laws.signals.harmonic import Constant
from fecontact.laws.signatures import friction_law, planar_friction_law
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system import columns
from fecontact.system.complex_modes import unstable_count
from fecontact.system.contact_quantities import Instant, total_friction
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import without_elements
from fecontact.system.friction_memory import steady_memory
from fecontact.system.loads import mean_load, under_constant
from fecontact.system.model_limits import limits_exceeded, named_motion, warn_of_limits
from fecontact.system.nodes import SystemArrays
from fecontact.system.statics.balance import Balance

Kind = Literal["rest", "sliding"]

# Longest step down the slope of waves, as a fraction of a wavelength.
_LONGEST_SLIDE = 0.125
# Longest step on the way to a stable state, in parts of the fitted range of large deflections.
_PART_OF_RANGE = 0.1


@friction_law
def follower(v, F, p):
    """R = p[0] F, whatever the slip velocity: a contact that slides on at rest."""
    return p[0] * F, 0.0, p[0]


@planar_friction_law
def planar_follower(law, v1, v2, F, z, p, force, rates):
    """R = (p[0], p[1]) F along the tangents, whatever the slip velocity."""
    clear(force, rates)
    second = 4 + len(rates)
    force[0], force[2] = p[0] * F, p[0]
    force[second], force[second + 2] = p[1] * F, p[1]


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ContactEquilibrium(Summarised, Instant):
    """An equilibrium of a contact system, see :func:`equilibrium`.

    Attributes
    ----------
    system : ContactSystem
    time : float
        [s]
    modal_coordinates, modal_velocities : (m,) arrays
        q, and zeros.
    memory : (n s,) array
        Internal variables z of friction: zeros at rest, their steady values in sliding.
    kind : 'rest' or 'sliding'
        At rest the contacts have no friction and no slip, however the ground moves.
    stable : bool
        At rest whether the energy has a minimum; in sliding whether no eigenvalue has a positive
        real part.
    """

    kind: Kind
    stable: bool

    def summary(self) -> list[tuple[str, str]]:
        """Kind, stability, nodes in contact and their total normal and friction force."""
        normal = self.normal_force[~self.system.basis.spring_nodes]
        return [("kind", self.kind), ("stable", "yes" if self.stable else "no"),
                ("nodes in contact", f"{np.count_nonzero(normal)} of {len(normal)}"),
                ("normal force", quantity(float(normal.sum()), "N", 4)),
                ("friction force", quantity(total_friction(self.friction_forces), "N", 4))]

    @cached_property
    def _contact(self) -> Array:
        found = super()._contact
        if self.kind == "rest":
            found = found.copy()
            found[..., self._columns(columns.FRICTION_FORCE, columns.FRICTION_ACROSS)] = 0.0
            found[..., self._columns(columns.SLIP_VELOCITY, columns.SLIP_ACROSS)] = 0.0
        return found


def equilibrium(
    system: ContactSystem, kind: Kind = "rest", *, time: float = 0.0
) -> ContactEquilibrium:
    """Rest without friction, or steady sliding, under the constant load.

    Solves ``K q = T^T f``, with the stiffness matrix of the modes and the mean values of drive and
    loads, by Newton's method, with continuation in the load if it does not converge.

    At rest, waves push a body down their slopes (:class:`fecontact.Ground`): it rests
    where the springs along the ground carry this, ``c_x x = -sum F y_R'``, and without springs in
    a trough. Of several places of rest the result is the stable one downhill from where the body
    stands. Runs with ``initial="rest"`` start from where it stands: they leave the forces along
    the ground to friction. With ``ground.normal = "vertical"`` both are the same.

    Bodies that nothing holds in space, under loads in balance, keep their place: rigid motion that
    changes no contact is left out.

    Parameters
    ----------
    system : ContactSystem
        Contact system; its ground is flat for steady sliding.
    kind : 'rest' or 'sliding'
        Rest on the ground as it is at ``time``, without friction; or steady sliding on flat ground,
        x' = 0 and slip velocity -V at every node, with the friction and the internal variables that
        belong to it.
    time : float
        Time at which position and speed of the ground are evaluated [s].

    Raises
    ------
    AnalysisError
        If there is no equilibrium, naming the unsupported direction of motion or the load that
        lifts or tips the body; and for steady sliding on wavy ground.

    Warns
    -----
    ModelWarning
        If the body moves by more than its own size, or penetrates the ground by more than a hundred
        times the roughness height.
    """
    require_kind("equilibrium", ContactSystem, system=system)
    require_choice("equilibrium", "kind", kind, get_args(Kind))
    require_finite("equilibrium", time=time)
    state = equilibrium_state(system, kind, time)
    here = system.at(state, time=time)
    warn_of_limits(limits_exceeded(system, np.array([time]), state[None]), "In equilibrium")
    if kind == "rest":
        problem = Balance(_at_rest_at(system, time), time, system.penetration_scale)
        stable = problem.stable(here.modal_coordinates)
    else:
        stable = not unstable_count(here.eigenvalues)
    return ContactEquilibrium(system, here.time, here.modal_coordinates, here.modal_velocities,
                              here.memory, kind, stable)


def equilibrium_state(
    system: ContactSystem, kind: Kind, time: float, *, standing: bool = False
) -> Array:
    """State [q, 0, z] of an equilibrium, with friction's steady internal variables in sliding."""
    q = equilibrium_coordinates(system, kind, time, standing=standing)
    state = np.concatenate([q, np.zeros(system.size - len(q))])
    return steady_memory(time, state, system.arrays) if kind == "sliding" else state


@one_blas_thread
def equilibrium_coordinates(
    system: ContactSystem, kind: Kind, time: float, *, standing: bool = False
) -> Array:
    """Modal coordinates (m,) of :func:`equilibrium`, without checking the limits of the model.

    ``standing`` leaves forces along the ground out: the normal equilibrium of a body that stays
    where it is.
    """
    system.require_compliance("equilibrium")
    friction = kind == "sliding"
    ground = system.ground
    if friction and ground.wavy:
        raise AnalysisError("There is no steady sliding on wavy ground; start from rest or "
                            "flatten the ground.")
    if friction and ground.friction_scale_kernel is not None:
        raise AnalysisError("There is no steady sliding on ground whose friction varies along it "
                            "(ground.friction_variation); start from rest.")
    arrays = _at_mean(system) if friction else _at_rest_at(system, time)
    # On level ground, and with its normal vertical, contact forces have no part along the surface.
    slides = bool(arrays.follows_surface and ground.wavy and arrays.rows[:, ::2].any()
                  and not standing)
    upright = arrays._replace(follows_surface=0)
    reach = [_PART_OF_RANGE * np.abs(one.ranges).max(axis=1)
             for one in system.basis.large_deflections]
    problem = Balance(upright, time, system.penetration_scale,
                      np.concatenate([np.zeros(0), *reach]))
    solution = problem.equilibrium()
    if system.basis.springs or system.basis.large_deflections:
        solution = _that_is_stable(system, problem, solution, friction)
    if solution is None:
        raise AnalysisError(_reason(system, problem, friction))
    if not slides:
        return solution
    whole = Balance(arrays, time, system.penetration_scale)
    longest = _LONGEST_SLIDE * (ground.shortest_wavelength or np.inf)
    found = whole.slide(solution, longest, system.stored_energy)
    if found is None:
        raise AnalysisError("There is no static equilibrium: without friction the waves of the "
                            "ground carry the body away; give it a spring at B along the ground "
                            "(drive.stiffness_x) or a support.")
    return found


def _that_is_stable(
    system: ContactSystem, problem: Balance, solution: Array | None, friction: bool
) -> Array | None:
    """A stable equilibrium beside springs or large deflections, whose energy is not convex."""
    if solution is not None and (friction or problem.stable(solution)):
        return solution
    # From a crest it may go down on the side on which a softening spring never holds.
    for start in (solution, np.zeros(system.basis.modes)):
        if start is not None:
            found = problem.slide(start, system.penetration_scale, system.stored_energy)
            if found is not None:
                return found
    return None


def _at_rest_at(system: ContactSystem, time: float) -> SystemArrays:
    """Arrays without friction under the mean loads, on the ground as it is at a time."""
    return at_rest(_at_mean(system),
                   *(one.travel(time) for one in system.prescribed_motion.motions))


def at_rest(
    arrays: SystemArrays, travel: float, second_travel: float = 0.0
) -> SystemArrays:
    """Arrays of a system without friction, on ground at rest that has travelled [m]."""
    return without_elements(arrays)._replace(
        ground_motion=Constant.kernel.address,
        ground_motion_parameters=np.array([travel], dtype=float),
        second_motion=Constant.kernel.address if len(arrays.planar) else 0,
        second_motion_parameters=np.array([second_travel], dtype=float))


@one_blas_thread
def resting(
    system: ContactSystem, arrays: SystemArrays, load: Array, motion: Array, travel: Array
) -> tuple[Balance, Array]:
    """Problem and equilibrium (m,) without friction under modal loads (m,) and drive motions (d,).

    ``arrays`` are those of the system with the motions of which ``travel`` (1,), in space (2,), is
    that of the other sides. AnalysisError if there is none.
    """
    drive_forces = (arrays.drive_stiffness * motion) @ arrays.drive_shapes
    arrays = under_constant(at_rest(arrays, *travel.tolist()), load + drive_forces)
    problem = Balance(arrays, 0.0, system.penetration_scale)
    solution = problem.equilibrium()
    if solution is None:
        raise AnalysisError(_reason(system, problem, False))
    return problem, solution


def _at_mean(system: ContactSystem) -> SystemArrays:
    """The system's arrays with the mean values of drive and loads as constant loads.

    Only constant signals contribute; time-dependent ones are taken to have zero mean.
    """
    return under_constant(system.arrays, mean_load(system.arrays, system.drive, system.load))


def _reason(system: ContactSystem, problem: Balance, friction: bool) -> str:
    kind = "steady sliding" if friction else "static equilibrium"
    direction = problem.loose(problem.guess(1.0))
    if direction is not None:
        body, motion = named_motion(system.basis, direction)
        springs = ", ".join(f"drive.stiffness_{axis}" for axis in AXES[: system.basis.dimension])
        remedy = (f"a spring at B ({springs}) or a support"
                  if not system.basis.parts else "a support, an interface or a link")
        return (f"There is no {kind}: nothing holds {body} against {motion}; give it {remedy}, or "
                f"balance the loads.")
    names = [name for name, count in system.basis.groups for _ in range(count)]
    falls = problem.face_stiffness < 0.0
    giving = sorted({name for name, fall in zip(names, falls, strict=True)
                     if fall and name in system.basis.springs})
    if giving:
        return (f"There is no {kind}: the force of the spring {listed(giving)} falls with its "
                f"elongation, and nothing else holds the load; check its stiffnesses and preload, "
                f"or add a spring that holds.")
    load = system.load
    more = " and the further loads" if load != Load(load.normal) else ""
    return (f"There is no {kind}: under load.normal = {load.normal:g} N{more} the body lifts off "
            f"or tips over{_places(system, problem.load)}; check the sign and place of the load, "
            f"and the length of the contact: more contact nodes or patches reach closer to the "
            f"ends of the face.")


def _places(system: ContactSystem, load: Array) -> str:
    """Sentence on where the resultant of modal loads (m,) meets the ground, beside the contacts.

    Empty for several bodies, and where supports or links keep the body from rigid motion.
    """
    basis = system.basis
    d, places = basis.dimension, basis.contact_places
    if basis.parts or not len(places):
        return ""
    force, moment = resultant(basis, load)
    level = float(places[:, d - 1].mean())
    if not np.isfinite(moment[: d - 1]).all() or not abs(force[-1]) > 0.0:
        return ""
    along = np.nan_to_num(force[:-1])
    # Point of the ground about which the loads have no moment along it.
    if d == 2:
        at = np.array([(moment[0] + level * along[0]) / force[1]])
    else:
        at = np.array([level * along[0] - moment[1], moment[0] + level * along[1]]) / force[2]
    shown = ", ".join(f"{axis} = {value:.4g} m" for axis, value in zip("xy", at, strict=False))
    reach = ", ".join(
        f"{axis} = {values.min():.4g} to {values.max():.4g} m"
        for axis, values in zip("xy", places.T[: d - 1], strict=False))
    return (f" (its loads have the resultant {force[-1]:.4g} N in {AXES[d - 1]}, which meets the "
            f"ground at {shown}; the contact nodes hold it at {reach})")


def resultant(basis: ModalBasis, load: Array) -> tuple[Array, Array]:
    """Resultant force (d,) [N] and moment (1 or 3,) about the origin [N m] of modal loads (m,).

    The work of the loads in unit rigid motions; NaN for motions that the basis does not have.
    """
    d = basis.dimension
    used, free = np.abs(basis.T).any(axis=(1, 2)), basis.angular_frequencies == 0.0
    places, rows = basis.positions[used], basis.T[used, :d].reshape(-1, basis.modes)[:, free]
    if d == 2:
        turns = [np.column_stack([-places[:, 1], places[:, 0]])]
    else:
        turns = [np.cross(axis, places) for axis in np.eye(3)]
    shifts = [np.tile(axis, (len(places), 1)) for axis in np.eye(d)]
    work = []
    for motion in (*shifts, *turns):
        q = np.linalg.lstsq(rows, motion.ravel(), rcond=1e-10)[0]
        rigid = np.linalg.norm(rows @ q - motion.ravel()) <= 1e-6 * np.linalg.norm(motion)
        work.append(float(q @ load[free]) if rigid else np.nan)
    return np.array(work[:d]), np.array(work[d:])
