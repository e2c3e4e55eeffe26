"""Out-of-balance forces of bodies at rest or in steady sliding, and where they vanish."""

from collections.abc import Callable

import numpy as np

from fecontact.core.types import Array
from fecontact.system import columns, kernels
from fecontact.system.friction_memory import steady_memory
from fecontact.system.jacobian import jacobian
from fecontact.system.node_forces import normal_values
from fecontact.system.nodes import SystemArrays
from fecontact.system.polynomial_forces import polynomial_energy, polynomial_stiffness_at

# Largest out-of-balance fraction of the load, regardless of the rounding of other forces.
_UNBALANCED = 1e-6
# Part of a motion at the contacts, and of the loads along it, that counts as rounding.
_ROUNDING = 1e-9
# Forces at twice the depth that carries the load, in parts of those there, beyond which laws are
# steeper than powers: the stiffness is that at this depth.
_STEEP = 10.0
# Largest number of steps down the slopes of waves.
_SLIDES = 3000


class Balance:
    """Out-of-balance modal forces of a resting or steadily sliding body.

    ``reach`` (D,) bounds the steps of the combinations of coordinates on which polynomial forces
    depend, where :meth:`slide` goes down.
    """

    def __init__(
        self, arrays: SystemArrays, time: float, scale: float, reach: Array | None = None
    ) -> None:
        self._reach = np.full(len(arrays.polynomial_rows), np.inf) if reach is None else reach
        self.arrays = arrays = _without_free_motion(arrays)
        self.load = arrays.constant_load
        self._time = time
        n, _, m = arrays.rows.shape
        states = int(arrays.memory.max())
        size = 2 * m + n * states
        self._rate, self._matrix = np.empty(size), np.empty((size, size))
        self._state = np.zeros(size)
        # Stiffness of the fully closed contact, and its force at zero displacement.
        depth = self._depth_under_load(scale)
        far = np.full(n, max(10.0 * scale, 2.0 * depth))
        carried, beyond = (self.normal(np.full(n, at))[0].sum() for at in (depth, 2.0 * depth))
        if 0.0 < _STEEP * carried < beyond:
            far[:] = depth
        values, self.face_stiffness = self.normal(far)
        undisplaced = kernels.contact_at(time, self._state, arrays)
        self.face_force = values + self.face_stiffness * (
            undisplaced[:, columns.PENETRATION] - far)
        # Of preloaded springs, which cancel within their law.
        self._initial = np.abs(arrays.rows[:, 1]).T @ np.where(
            arrays.on_ground, 0.0, np.abs(undisplaced[:, columns.NORMAL_FORCE]))
        self.scale = np.abs(np.diag(arrays.stiffness)) + np.einsum(
            "jai,jai,j->i", arrays.rows, arrays.rows, np.abs(self.face_stiffness))
        # Free motion is as stiff as the stiffest one, so that rounding does not carry it away.
        largest = self.scale.max(initial=0.0) or 1.0
        self.scale[self.scale <= _ROUNDING**2 * 1e-2 * largest] = largest

    def _depth_under_load(self, scale: float) -> float:
        """Uniform penetration under which the face carries the load, at most 1e6 scales.

        It is ``scale`` for laws whose force falls with penetration, which never carry the load.
        """
        # Work of the load in a unit mean rise of the contact nodes.
        rise = self.arrays.rows[:, 1].sum(axis=0) / max(len(self.arrays.rows), 1)
        wanted = abs(float(self.load @ rise)) / max(float(rise @ rise), 1e-300)
        depth = scale
        while depth < 1e6 * scale and self.normal(np.full(len(self.arrays.gap), depth))[0].sum() < (
                wanted):
            depth *= 2.0
        falls = self.normal(np.full(len(self.arrays.gap), depth))[1].sum() < 0.0
        return scale if falls else depth

    def normal(self, penetration: Array) -> tuple[Array, Array]:
        """Normal forces (n,) and their slopes at rest."""
        force, slope = np.empty(len(penetration)), np.empty(len(penetration))
        normal_values(self.arrays.normal, penetration, np.zeros(len(penetration)),
                      self.arrays.normal_parameters, force, slope)
        return force, slope

    def penetration(self, q: Array) -> Array:
        """Penetration (n,) at rest."""
        self._state[: len(q)] = q
        state = kernels.contact_at(self._time, self._state, self.arrays)
        return state[:, columns.PENETRATION].copy()

    def force(self, q: Array, load: float) -> Array:
        """Out-of-balance force (m,) under a fraction of the load."""
        m = len(q)
        part = self.arrays._replace(constant_load=load * self.load)
        kernels.right_hand_side(self._time, self._steady(q), part, self._rate)
        return self._rate[m : 2 * m].copy()

    def gradient(self, q: Array) -> Array:
        """Derivative (m, m) of the force."""
        m = len(q)
        jacobian(self._time, self._steady(q), self.arrays, self._matrix)
        gradient = self._matrix[m : 2 * m, :m].copy()
        if len(self._matrix) > 2 * m:
            # The internal variables follow the displacements: z' = 0.
            follow = np.linalg.pinv(self._matrix[2 * m :, 2 * m :]) @ self._matrix[2 * m :, :m]
            gradient -= self._matrix[m : 2 * m, 2 * m :] @ follow
        return gradient

    def _steady(self, q: Array) -> Array:
        self._state[: len(q)] = q
        self._state = steady_memory(self._time, self._state, self.arrays)
        return self._state

    def guess(self, load: float) -> Array:
        """Equilibrium of a face in full contact that could also pull."""
        arrays = self.arrays
        normal = arrays.rows[:, 1]
        stiffness = arrays.stiffness + (normal.T * self.face_stiffness) @ normal
        force = load * self.load + normal.T @ self.face_force
        return self._solve(stiffness, force, 1e-10)

    def solve(self, q: Array, load: float) -> Array | None:
        """Newton's method with a shift that increases after failed steps; None if it fails."""
        shift = 1e-10
        force = self.force(q, load)
        best = self._size(force)
        steady_memory = 0
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
                steady_memory += 1
                if steady_memory == 3:
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
                    advances = self.force(q + middle * step, load) @ step >= 0.0
                    low, high = (middle, high) if advances else (low, middle)
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
                q = q + self._limited(shapes[:, 0], longest, 0.01, exactly=True)
                energy = self._energy(q, stored)
                continue
            step = shapes @ ((shapes.T @ force) / np.maximum(np.abs(curvatures), 1e-10))
            trial = self._pressed(q + self._limited(step, longest, reach / longest))
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

    def _limited(
        self, step: Array, longest: float, part: float, exactly: bool = False
    ) -> Array:
        """A step by which contact nodes move a ``part`` of ``longest``, combinations of the reach.

        Or less, where it need not be ``exactly`` so.
        """
        turned = np.abs(self.arrays.polynomial_rows @ step) / self._reach
        moved = np.abs(self.arrays.rows[:, :2] @ step) / longest
        factor = part / max(float(moved.max(initial=0.0)), float(turned.max(initial=0.0)), 1e-300)
        return step * (factor if exactly else min(1.0, factor))

    def _energy(self, q: Array, stored: Callable[[Array], Array]) -> float:
        state = kernels.contact_at(self._time, self._steady(q), self.arrays)
        elastic = (0.5 * q @ self.arrays.stiffness @ q - self.load @ q
                   + polynomial_energy(q, self.arrays))
        return float(elastic + stored(state[:, columns.PENETRATION]))

    def _upright(self, q: Array) -> Array:
        """Symmetric stiffness (m, m) at q, for ground that is level under each node."""
        arrays = self.arrays
        slope, normal = self.normal(self.penetration(q))[1], arrays.rows[:, 1]
        return np.asarray(arrays.stiffness + polynomial_stiffness_at(q, arrays)
                          + (normal.T * slope) @ normal)

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


def _without_free_motion(arrays: SystemArrays) -> SystemArrays:
    """Arrays without rounding in motions that neither stiffness nor contacts resist.

    The rows of the contacts get no part along these motions, and neither do loads that are in
    balance along them. A motion along level faces without friction is one of them.
    """
    still = np.flatnonzero(~arrays.stiffness.any(axis=1))
    m = arrays.rows.shape[2]
    if not len(still):
        return arrays
    slides = not arrays.follows_surface and not arrays.memory.any()
    felt = arrays.rows[:, 1:2] if slides else arrays.rows
    size = np.linalg.norm(felt.reshape(-1, m), 2) if felt.size else 0.0
    _, values, ways = np.linalg.svd(felt[..., still].reshape(-1, len(still)))
    free = ways[np.count_nonzero(values > _ROUNDING * size):]
    rows, load = arrays.rows.copy(), arrays.constant_load.copy()
    columns = [1] if slides else slice(None)
    kept = rows[:, columns][..., still]
    kept = kept - kept @ free.T @ free
    kept[np.abs(kept) < _ROUNDING**1.5 * size] = 0.0
    block = rows[:, columns]
    block[..., still] = kept
    rows[:, columns] = block
    along = free @ load[still]
    if np.linalg.norm(along) <= _ROUNDING * np.linalg.norm(load):
        load[still] -= along @ free
    return arrays._replace(rows=rows, constant_load=load)


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
