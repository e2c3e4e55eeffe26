"""Static equilibria at rest and in steady sliding."""

from collections.abc import Callable

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, require_finite
from fecontact.core.types import Array
from fecontact.laws.excitation import Load
from fecontact.laws.friction.planar import along_slip
from fecontact.laws.signals.harmonic import Constant
from fecontact.laws.signatures import friction_law, signal
from fecontact.system import kernels
from fecontact.system.arrays import with_sides
from fecontact.system.contact_system import ContactSystem
from fecontact.system.friction_memory import settled
from fecontact.system.jacobian import jacobian
from fecontact.system.model_limits import limits_exceeded, named_motion, warn_of_limits
from fecontact.system.nodes import SystemArrays

# Largest out-of-balance fraction of the load, regardless of the rounding of other forces.
_UNBALANCED = 1e-6
# Steps down the slopes of waves: their number, and the longest as a fraction of a wavelength.
_SLIDES, _LONGEST_SLIDE = 3000, 0.125


@friction_law
def _frictionless(v, F, p):
    return 0.0, 0.0, 0.0


@friction_law
def follower(v, F, p):
    """R = p[0] F, whatever the slip velocity: a contact that slides on at rest."""
    return p[0] * F, 0.0, p[0]


@signal
def _still(t, p):
    return p[0], 0.0


def static_equilibrium(
    system: ContactSystem, *, friction: bool = False, time: float = 0.0
) -> Array:
    """Modal coordinates q (m,) of an equilibrium under the constant load.

    Solves ``K q = T^T f``, with the stiffness matrix of the modes and the mean values of drive and
    loads, by Newton's method, with continuation in the load if it does not converge.

    Without friction, waves push a body down their slopes (:class:`fecontact.Ground`): it rests
    where the springs along the ground carry this, ``c_x x = -sum F y_R'``, and without springs in
    a trough. Of several places of rest the result is the stable one downhill from where the body
    stands. Runs with ``initial="rest"`` start from where it stands: they leave the forces along
    the ground to friction. With ``ground.normal = "vertical"`` both are the same.

    Parameters
    ----------
    system : ContactSystem
        Its ground is flat for steady sliding.
    friction : bool
        True for steady sliding on flat ground: x' = 0 and slip velocity -V at every node. False for
        rest without friction on the ground as it is at ``time``.
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
    require_kind("static_equilibrium", ContactSystem, system=system)
    require_finite("static_equilibrium", time=time)
    q = equilibrium(system, friction, time)
    state = np.concatenate([q, np.zeros(system.size - len(q))])
    warn_of_limits(limits_exceeded(system, np.array([time]), state[None]), "In equilibrium")
    return q


def equilibrium(
    system: ContactSystem, friction: bool, time: float, *, standing: bool = False
) -> Array:
    """As :func:`static_equilibrium`, without checking the limits of the model.

    ``standing`` leaves forces along the ground out: the normal equilibrium of a body that stays
    where it is.
    """
    ground = system.ground
    if friction and ground.wavy:
        raise AnalysisError("There is no steady sliding on wavy ground; start from rest or "
                            "flatten the ground.")
    if friction and ground.friction_scale_kernel is not None:
        raise AnalysisError("There is no steady sliding on ground whose friction varies along it "
                            "(ground.friction_variation); start from rest.")
    arrays = _at_mean(system)
    if not friction:
        arrays = at_rest(arrays, *(one.travel(time) for one in system.prescribed_motion.motions))
    # On level ground, and with its normal vertical, contact forces do not lean.
    slides = bool(arrays.leans and ground.wavy and (arrays.Tx.any() or arrays.T2.any())
                  and not standing)
    problem = Balance(with_sides(arrays._replace(leans=0)), time, system.penetration_scale)
    solution = problem.equilibrium()
    if system.basis.springs:
        solution = _among_springs(system, problem, solution, friction)
    if solution is None:
        raise AnalysisError(_reason(system, problem, friction))
    if not slides:
        return solution
    leaning = Balance(arrays, time, system.penetration_scale)
    longest = _LONGEST_SLIDE * (ground.shortest_wavelength or np.inf)
    found = leaning.slide(solution, longest, system.stored_energy)
    if found is None:
        raise AnalysisError("There is no static equilibrium: without friction the waves of the "
                            "ground carry the body away; give it a spring at B along the ground "
                            "(drive.stiffness_x) or a support.")
    return found


def _among_springs(
    system: ContactSystem, problem: "Balance", solution: Array | None, friction: bool
) -> Array | None:
    """A stable equilibrium beside springs that may soften, whose energy is not convex."""
    if solution is not None and (friction or problem.stable(solution)):
        return solution
    start = np.zeros(system.basis.modes) if solution is None else solution
    return problem.slide(start, system.penetration_scale, system.stored_energy)


def at_rest(
    arrays: SystemArrays, travel: float, second_travel: float = 0.0
) -> SystemArrays:
    """Arrays of a system without friction, on ground at rest that has travelled [m]."""
    return with_sides(arrays._replace(
        friction=np.full_like(arrays.friction, _frictionless.address),
        memory=np.zeros_like(arrays.memory),
        bristle_stiffness=np.zeros((2, len(arrays.gap), 0)), ground_motion=_still.address,
        planar=np.full_like(arrays.planar, along_slip.address),
        ground_motion_parameters=np.array([travel], dtype=float),
        second_motion=_still.address if len(arrays.planar) else 0,
        second_motion_parameters=np.array([second_travel], dtype=float)))


def resting(
    system: ContactSystem, load: Array, motion: Array, travel: float
) -> tuple["Balance", Array]:
    """Problem and equilibrium (m,) without friction under modal loads (m,) and drive motions (2,).

    AnalysisError if there is none.
    """
    arrays = system.arrays
    pulls = (arrays.drive_stiffness * motion) @ arrays.drive_shapes
    arrays = at_rest(arrays, travel)._replace(
        constant_load=load + pulls, drive_shapes=np.zeros_like(arrays.drive_shapes),
        load_shapes=np.zeros_like(arrays.load_shapes))
    problem = Balance(arrays, 0.0, system.penetration_scale)
    solution = problem.equilibrium()
    if solution is None:
        raise AnalysisError(_reason(system, problem, False))
    return problem, solution


class Balance:
    """Out-of-balance modal forces of a resting or steadily sliding body."""

    def __init__(self, arrays: SystemArrays, time: float, scale: float) -> None:
        self.arrays = arrays
        self.load = arrays.constant_load
        self._time = time
        n, m = arrays.Tx.shape
        states = int(arrays.memory.max())
        size = 2 * m + n * states
        self._rate, self._matrix = np.empty(size), np.empty((size, size))
        self._state = np.zeros(size)
        # Stiffness of the fully closed contact, and its force at zero displacement.
        far = np.full(n, max(10.0 * scale, 2.0 * self._penetration(scale)))
        values, self.face_stiffness = self.normal(far)
        columns = kernels.state_columns(arrays)
        undisplaced = np.empty((n, columns))
        kernels.contact_state(time, self._state, arrays, undisplaced)
        self.face_force = values + self.face_stiffness * (
            undisplaced[:, kernels.PENETRATION] - far)
        # Of preloaded springs, which cancel within their law.
        self._initial = np.abs(arrays.Ty).T @ np.where(
            arrays.on_ground, 0.0, np.abs(undisplaced[:, kernels.NORMAL_FORCE]))
        tangential = (arrays.Tx**2).T @ self.face_stiffness
        if len(arrays.T2):
            tangential = tangential + (arrays.T2**2).T @ self.face_stiffness
        normal = (arrays.Ty**2).T @ self.face_stiffness
        diagonal = np.abs(np.diag(arrays.stiffness))
        self.scale = diagonal + tangential + normal
        self.scale[self.scale == 0.0] = 1.0

    def _penetration(self, scale: float) -> float:
        """Uniform penetration under which the face carries the load, at most 1e6 scales."""
        # Work of the load in a unit mean rise of the contact nodes.
        rise = self.arrays.Ty.mean(axis=0)
        wanted = abs(float(self.load @ rise)) / max(float(rise @ rise), 1e-300)
        depth = scale
        while depth < 1e6 * scale and self.normal(np.full(len(self.arrays.gap), depth))[0].sum() < (
                wanted):
            depth *= 2.0
        return depth

    def normal(self, penetration: Array) -> tuple[Array, Array]:
        """Normal forces (n,) and their slopes at rest."""
        force, slope = np.empty(len(penetration)), np.empty(len(penetration))
        kernels.normal_values(self.arrays.normal, penetration, np.zeros(len(penetration)),
                              self.arrays.normal_parameters, force, slope)
        return force, slope

    def force(self, q: Array, load: float) -> Array:
        """Out-of-balance force (m,) under a fraction of the load."""
        m = len(q)
        part = self.arrays._replace(constant_load=load * self.load)
        kernels.right_hand_side(self._time, self._settled(q), part, self._rate)
        return self._rate[m : 2 * m].copy()

    def gradient(self, q: Array) -> Array:
        """Derivative (m, m) of the force."""
        m = len(q)
        jacobian(self._time, self._settled(q), self.arrays, self._matrix)
        gradient = self._matrix[m : 2 * m, :m].copy()
        if len(self._matrix) > 2 * m:
            # The internal variables follow the displacements: z' = 0.
            follow = np.linalg.pinv(self._matrix[2 * m :, 2 * m :]) @ self._matrix[2 * m :, :m]
            gradient -= self._matrix[m : 2 * m, 2 * m :] @ follow
        return gradient

    def _settled(self, q: Array) -> Array:
        self._state[: len(q)] = q
        self._state = settled(self._time, self._state, self.arrays)
        return self._state

    def guess(self, load: float) -> Array:
        """Equilibrium of a face in full contact that could also pull."""
        arrays = self.arrays
        stiffness = arrays.stiffness + (arrays.Ty.T * self.face_stiffness) @ arrays.Ty
        force = load * self.load + arrays.Ty.T @ self.face_force
        return self._solve(stiffness, force, 1e-10)

    def solve(self, q: Array, load: float) -> Array | None:
        """Newton's method with a shift that increases after failed steps; None if it fails."""
        shift = 1e-10
        force = self.force(q, load)
        best = self._size(force)
        settled = 0
        for _ in range(200):
            gradient = self.gradient(q)
            for _ in range(40):
                step = self._solve(-gradient, force, shift)
                trial = q + step
                trial_force = self.force(trial, load)
                size = self._size(trial_force)
                if size < best or (shift <= 1e-10 and size <= self._noise(trial, load)):
                    break
                shift = max(10.0 * shift, 1e-8)
                if shift > 1e8:
                    return q if best <= self._noise(q, load) else None
            q, force, best = trial, trial_force, size
            shift = max(0.1 * shift, 1e-10)
            if best <= self._noise(q, load):
                settled += 1
                if settled == 3:
                    return q
        return None

    def equilibrium(self) -> Array | None:
        """Equilibrium (m,) under the whole load, or None."""
        origin = np.zeros(len(self.load))
        if not self.force(origin, 1.0).any():
            return origin
        solution = self.solve(self.guess(1.0), 1.0)
        if solution is None:
            solution = self.solve(self.descend(self.guess(1.0), 1.0), 1.0)
        return _continued(self) if solution is None else solution

    def descend(self, q: Array, load: float) -> Array:
        """Newton steps with line search, each as long as the force acts along the step.

        Without friction the potential is convex and decreases to its minimum, for any distance of
        the ground and any nodes coming into contact. Stops if there is no progress.
        """
        for _ in range(200):
            force = self.force(q, load)
            step = self._solve(self._upright(q), force, 1e-10)
            low, high = 0.0, 1.0
            if force @ step <= 0.0 or self._size(force) <= self._noise(q, load):
                return q
            while self.force(q + high * step, load) @ step < 0.0:
                low, high = (0.0, 0.1 * high) if low == 0.0 else (low, high)
                if high < 1e-14:
                    return q
                if self.force(q + high * step, load) @ step >= 0.0:
                    low, high = high, 10.0 * high
                    break
            if low > 0.0:
                for _ in range(30):
                    middle = 0.5 * (low + high)
                    pushed = self.force(q + middle * step, load) @ step >= 0.0
                    low, high = (middle, high) if pushed else (low, middle)
                high = low
            q = q + high * step
        return q

    def slide(self, q: Array, longest: float, stored: Callable[[Array], Array]) -> Array | None:
        """Go down the slopes of waves from q to a stable place of rest; None if there is none.

        Newton steps with the magnitudes of the curvatures of the energy, which always lead
        downhill, no contact node farther than ``longest`` at once. ``stored`` gives the energy of
        the contact at penetrations (n,).
        """
        reach, energy = longest, self._energy(q, stored)
        for _ in range(_SLIDES):
            force, curvatures, shapes = self._curved(q)
            if self._size(force) <= self._noise(q, 1.0):
                if curvatures[0] >= -1e-9:
                    return q
                # Balanced on a crest: off it.
                q = q + self._limited(shapes[:, 0], 0.01 * longest, exactly=True)
                energy = self._energy(q, stored)
                continue
            step = shapes @ ((shapes.T @ force) / np.maximum(np.abs(curvatures), 1e-10))
            trial = self._pressed(q + self._limited(step, reach))
            found = self._energy(trial, stored)
            closer = self._size(self.force(trial, 1.0)) < self._size(force)
            if found < energy or (closer and found <= energy + 1e-13 * abs(energy)):
                q, energy, reach = trial, found, min(longest, 2.0 * reach)
            elif (reach := 0.5 * reach) < 1e-9 * longest:
                break
        rest = self.solve(q, 1.0)
        return rest if rest is not None and self.stable(rest) else None

    def stable(self, q: Array) -> bool:
        """Whether the energy has a minimum at an equilibrium q."""
        return bool(self._curved(q)[1][0] >= -1e-9)

    def _curved(self, q: Array) -> tuple[Array, Array, Array]:
        """Out-of-balance force (m,), curvatures of the energy and their directions, all scaled."""
        root = np.sqrt(self.scale)
        gradient = self.gradient(q)
        curvatures, shapes = np.linalg.eigh(-0.5 * (gradient + gradient.T) / np.outer(root, root))
        return self.force(q, 1.0), curvatures, shapes / root[:, None]

    def _pressed(self, q: Array) -> Array:
        """Q after some steps along the stiff directions alone, as waves curve below the nodes."""
        for _ in range(3):
            force, curvatures, shapes = self._curved(q)
            stiff = curvatures > 1e-3
            q = q + shapes[:, stiff] @ ((shapes[:, stiff].T @ force) / curvatures[stiff])
        return q

    def _limited(self, step: Array, longest: float, exactly: bool = False) -> Array:
        """A step in which no contact node moves farther than ``longest``."""
        moved = max(float(np.abs(self.arrays.Tx @ step).max()),
                    float(np.abs(self.arrays.Ty @ step).max()), 1e-300)
        return step * (longest / moved if exactly else min(1.0, longest / moved))

    def _energy(self, q: Array, stored: Callable[[Array], Array]) -> float:
        state = np.empty((len(self.arrays.gap), kernels.state_columns(self.arrays)))
        kernels.contact_state(self._time, self._settled(q), self.arrays, state)
        elastic = 0.5 * q @ self.arrays.stiffness @ q - self.load @ q
        return float(elastic + stored(state[:, kernels.PENETRATION]))

    def _upright(self, q: Array) -> Array:
        """Symmetric stiffness (m, m) at q, for ground that is level under each node."""
        arrays = self.arrays
        self._state[: len(q)] = q
        state = np.empty((len(arrays.gap), kernels.state_columns(arrays)))
        kernels.contact_state(self._time, self._state, arrays, state)
        slope = self.normal(state[:, kernels.PENETRATION].copy())[1]
        return np.asarray(arrays.stiffness + (arrays.Ty.T * slope) @ arrays.Ty)

    def loose(self, q: Array) -> Array | None:
        """Direction (m,) of an unbalanced force at q without any stiffness, or None."""
        root = np.sqrt(self.scale)
        scaled = -self.gradient(q) / np.outer(root, root)
        _, values, rows = np.linalg.svd(scaled)
        loose = rows[values < 1e-9]
        force = self.force(q, 1.0) / root
        push = loose.T @ (loose @ force)
        if np.linalg.norm(push) <= 1e-9 * np.linalg.norm(force):
            return None
        return np.asarray(push / root)

    def _solve(self, stiffness: Array, force: Array, shift: float) -> Array:
        return np.asarray(np.linalg.solve(stiffness + np.diag(shift * self.scale), force))

    def _size(self, force: Array) -> float:
        return float(np.linalg.norm(force / np.sqrt(self.scale)))

    def _noise(self, q: Array, load: float) -> float:
        """Size of the out-of-balance force that counts as rounding.

        A body that drifts away under an unsupported load has growing forces and rounding errors,
        which must stay below the load itself.
        """
        arrays = self.arrays
        terms = np.abs(arrays.stiffness) @ np.abs(q) + np.abs(load * self.load)
        contact = self.force(q, load) - load * self.load + arrays.stiffness @ q
        rounding = 1e-11 * self._size(terms + np.abs(contact) + self._initial)
        applied = self._size(load * self.load)
        return min(rounding, _UNBALANCED * applied) if applied > 0.0 else rounding


def _at_mean(system: ContactSystem) -> SystemArrays:
    """The system's arrays with the mean values of drive and loads as constant loads.

    Only constant signals contribute; time-dependent ones are taken to have zero mean.
    """
    arrays = system.arrays
    load = arrays.constant_load.copy()
    springs = arrays.drive_stiffness[:, None] * arrays.drive_shapes
    given = [*zip(springs, system.drive.motions[: len(springs)], strict=True),
             *zip(arrays.load_shapes, system.load.signals.values(), strict=True)]
    for shape, source in given:
        if isinstance(source, Constant):
            load += source.value * shape
    return arrays._replace(
        constant_load=load, drive_shapes=np.zeros_like(arrays.drive_shapes),
        load_shapes=np.zeros_like(arrays.load_shapes))


def _continued(problem: Balance) -> Array | None:
    """Follow the equilibrium from a small load, halving the load step on failure."""
    load, step = 1e-3, 0.1
    q = problem.solve(problem.guess(load), load)
    if q is None:
        return None
    while load < 1.0:
        trial = min(1.0, load + step)
        found = problem.solve(q, trial)
        if found is None:
            step *= 0.5
            if step < 1e-4:
                return None
            continue
        q, load, step = found, trial, 2.0 * step
    return q


def _reason(system: ContactSystem, problem: Balance, friction: bool) -> str:
    kind = "steady sliding" if friction else "static equilibrium"
    direction = problem.loose(problem.guess(1.0))
    if direction is not None:
        body, motion = named_motion(system.basis, direction)
        remedy = ("a spring at B (drive.stiffness_x, drive.stiffness_y) or a support"
                  if not system.basis.parts else "a support, an interface or a link")
        return f"There is no {kind}: nothing holds {body} against {motion}; give it {remedy}."
    load = system.load
    more = " and the further loads" if load != Load(load.normal) else ""
    return (f"There is no {kind}: under load.normal = {load.normal:g} N{more} the body lifts off "
            f"or tips over; check the sign and place of the load, and the length of the contact.")
