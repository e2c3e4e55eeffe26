r"""Condensed potential and displacement of a few modes, from statics with large deflections.

Under loads :math:`M \Phi a` the body has the displacement u, of which the modes have the part
:math:`q = \Phi^T M u`. No load acts on what is left of it, so that the potential V(q) of the body,
condensed to these modes, has the derivative

.. math::

    \frac{\partial V}{\partial q_i} = a_i, \qquad
    V = \tfrac12 \sum_i w_i^2 q_i^2 + V_3(q) + V_4(q), \qquad
    u = \Phi q + \tfrac12 \sum_{ij} \theta_{ij}\,q_i q_j .

The coefficients of the cubic and quartic parts V_3 and V_4 and the fields theta follow by least
squares from paths of equilibria in many directions a, of both signs; frequencies w are exact.
(Implicit condensation: Hollkamp and Gordon, J. Sound Vib. 318, 2008.)
"""

from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement, permutations, product
from typing import Annotated, Any

import numpy as np

from fecontact.core.errors import AnalysisError, InputError, require_not_negative, require_positive
from fecontact.core.types import Array, Integers
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.load_steps import DeflectionSteps, follow
from fecontact.reduction.eigenmodes import FreeSystem

# Most modes: the numbers of loads and springs grow with their third and fourth power.
MOST = 6
# Modes that are loaded at once, and random loads on which the fit is tried.
_TOGETHER, _TRIALS = 3, 4
# Arcs between the fitted states and between those of trials, in the linear response to a load.
_STEP, _TRIAL_STEP = 0.3, 0.43
# Length of a field relative to the longest below which it is rounding or of no weight.
_NO_FIELD = 1e-4


@dataclass(frozen=True)
class LargeDeflections:
    """Options of ``modal_basis(large_deflections=)``: forces of large deflections of some modes.

    Parameters
    ----------
    largest_displacement : float
        Displacement in the first of the modes up to which the forces are fitted, such as twice the
        thickness of a clamped plate, a third of the length of a cantilever, twice the rise of an
        arch [m]. Other modes are deflected with the same energy at most.
    modes : int or sequence of int
        Number of modes with large deflections, lowest first, or their numbers from 0; six at most.
        All other coordinates of the basis stay linear beside them.
    stretching_damping : float
        Least damping ratio of the vectors that complete the modes, from zero to below 1. Without
        damping they keep ringing at frequencies far above those of the modes, which runs have to
        resolve; 0.1 takes the ringing away and hardly changes the motion of the modes.

    Raises
    ------
    InputError
        For values out of range.
    """

    largest_displacement: Annotated[float, Unit("m")]
    modes: int | tuple[int, ...] = 1
    stretching_damping: float = 0.0

    def __post_init__(self) -> None:
        require_positive("LargeDeflections", largest_displacement=self.largest_displacement)
        require_not_negative("LargeDeflections", stretching_damping=self.stretching_damping)
        if self.stretching_damping >= 1.0:
            raise InputError(f"LargeDeflections: stretching_damping = {self.stretching_damping!r} "
                             f"must be below 1.")
        given = self.modes
        chosen = range(given) if type(given) is int else given
        if not isinstance(chosen, range | tuple | list) or not 1 <= len(chosen) <= MOST or (
                len(set(chosen)) < len(chosen)
                or any(type(one) is not int or one < 0 for one in chosen)):
            raise InputError(f"LargeDeflections: modes = {given!r} must be a number of modes from "
                             f"1 to {MOST}, or up to {MOST} different numbers from 0.")
        if not isinstance(given, int):
            object.__setattr__(self, "modes", tuple(given))

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the modes from 0."""
        return tuple(range(self.modes)) if isinstance(self.modes, int) else self.modes


@dataclass(frozen=True, eq=False)
class CondensedBody:
    """Fitted potential and displacement of d modes.

    Attributes
    ----------
    modes : (d,) integer array
        Numbers of the modes.
    cubic, quartic : (d, d, d) and (d, d, d, d) arrays
        Symmetric tensors A and B of the force, ``dV/dq_i - w_i^2 q_i = A_ijk q_j q_k +
        B_ijkl q_j q_k q_l``.
    fields : (f, d, d) array
        Quadratic displacements theta of the free unknowns.
    ranges : (d, 2) array
        Least and largest coordinate of the fitted states [m kg^(1/2)].
    force_error, displacement_error : float
        Largest errors in states that were not fitted: of the loads, relative to the largest one
        of each path, and of the displacement, relative to ``largest_displacement``.
    states : int
        Number of static solutions that were fitted.
    """

    modes: Integers
    cubic: Array
    quartic: Array
    fields: Array
    ranges: Array
    force_error: float
    displacement_error: float
    states: int

    def independent_fields(self, system: FreeSystem, kept: Array) -> Array:
        """Displacements (f, p) beyond the shapes ``kept`` that together make up the fields."""
        d, reach = len(self.modes), np.abs(self.ranges).max(axis=1)
        vectors = np.column_stack([self.fields[:, i, j] * (reach[i] * reach[j])
                                   for i, j in combinations_with_replacement(range(d), 2)])
        inertia = system.mass @ kept
        for _ in range(2):
            vectors = vectors - kept @ (inertia.T @ vectors)
        energy, turn = np.linalg.eigh(vectors.T @ (system.stiffness @ vectors))
        return np.asarray(vectors @ turn[:, energy > _NO_FIELD**2 * energy[-1]])


def condensed_body(
    body: ElasticBody, system: FreeSystem, w: Array, shapes: Array, given: LargeDeflections
) -> CondensedBody:
    """Fit the potential of modes with frequencies (m,) and free shapes (f, m).

    Raises
    ------
    InputError
        For a body that can move without strain, or modes that the basis does not have.
    AnalysisError
        If the statics do not reach the largest displacement.
    """
    if system.rigid.shape[1]:
        raise InputError("large_deflections is for bodies that supports hold against all rigid "
                         "motions; support the body with fixed.")
    numbers = np.array(given.numbers)
    if numbers.max() >= len(w):
        raise InputError(f"large_deflections: mode {numbers.max()} is not among the {len(w)} modes "
                         f"of the basis, which count from 0; ask for more modes.")
    statics = _Statics(body, system, w[numbers], shapes[:, numbers], given.largest_displacement)
    d = len(numbers)
    fitted = _Samples.of([statics.path(load, _STEP) for load in _loads(d)])
    rng = np.random.default_rng(0)
    trials = [statics.path(load, _TRIAL_STEP) for load in (
        (np.eye(1), -np.eye(1)) if d == 1 else rng.standard_normal((_TRIALS, 1, d)))]
    potential = _fitted_potential(fitted)
    fields = _fitted_fields(fitted)
    errors = []
    for one in trials:
        tried = _Samples.of([one])
        forces = tried.q + _slopes(tried.q) @ potential
        moved = _monomials(tried.q, 2) @ fields
        errors.append((np.linalg.norm(forces - tried.loads, axis=1).max()
                       / np.linalg.norm(tried.loads, axis=1).max(),
                       np.abs(moved - tried.rest).max()))
    force_error, displacement_error = np.max(errors, axis=0)
    unit = statics.unit
    cubic, quartic = _tensors(potential, d, float(w[numbers[0]] * unit[0]) ** 2, unit)
    return CondensedBody(
        numbers, cubic, quartic, _full_fields(fields, d, unit, statics.size),
        np.stack([fitted.q.min(axis=0), fitted.q.max(axis=0)], axis=1) * unit[:, None],
        float(force_error), float(displacement_error), len(fitted.q))


def _loads(d: int) -> list[Array]:
    """Directions (1, d) of loads: each mode alone, and up to three together, with all signs."""
    found = []
    for count in range(1, min(d, _TOGETHER) + 1):
        for chosen in combinations(range(d), count):
            for signs in product((1.0, -1.0), repeat=count):
                load = np.zeros((1, d))
                load[0, list(chosen)] = signs
                found.append(load)
    return found


@dataclass(frozen=True, eq=False)
class _Samples:
    """States of equilibrium: coordinates (n, d), loads (n, d), remaining displacements (n, f).

    Coordinates and loads are in units of equal energy, one where the first mode alone has the
    largest displacement; displacements are in units of this one.
    """

    q: Array
    loads: Array
    rest: Array

    @classmethod
    def of(cls, paths: list["_Samples"]) -> "_Samples":
        return cls(*(np.concatenate([getattr(one, name) for one in paths])
                     for name in ("q", "loads", "rest")))


class _Statics:
    """Paths of equilibria under loads in proportion to the inertia of modes."""

    def __init__(
        self, body: ElasticBody, system: FreeSystem, w: Array, shapes: Array, size: float
    ) -> None:
        self.model, self.shapes, self.size = FiniteStrainModel(body), shapes, size
        self.inertia = np.asarray(system.mass @ shapes)
        moved = np.asarray(body.expansion @ shapes).reshape(-1, body.dimension, len(w))
        # Displacements of equal energy, that of the first mode ``size``.
        self.unit = size / np.linalg.norm(moved[..., 0], axis=1).max() * w[0] / w
        self.force = w**2 * self.unit

    def path(self, load: Array, step: float) -> _Samples:
        """States up to the largest displacement under a load (1, d) and its multiples."""
        (direction,) = load / np.abs(load).sum()
        free = len(self.shapes)
        forces = np.zeros(self.model.expansion.shape[1])
        forces[:free] = self.inertia @ (self.force * direction)

        def far(q: Array) -> bool:
            return bool(np.abs(self.inertia.T @ q[:free] / self.unit).sum() >= 1.0)

        options = DeflectionSteps("arc", first=step, largest=step, most=400)
        found = follow(self.model, lambda q: (forces, None), options, far)
        if not found.reached:
            raise AnalysisError(f"large_deflections: the statics under the loads of the modes do "
                                f"not reach largest_displacement = {self.size:g} m. "
                                f"{found.message} Take a smaller one.")
        u = np.array([one.q[:free] for one in found.points[1:]])
        q = u @ self.inertia
        factors = np.array([one.factor for one in found.points[1:]])
        return _Samples(q / self.unit, factors[:, None] * direction,
                        (u - q @ self.shapes.T) / self.size)


def _powers(d: int, degree: int) -> Integers:
    """Exponents (n, d) of all monomials of a degree."""
    return np.array([[places.count(k) for k in range(d)]
                     for places in combinations_with_replacement(range(d), degree)])


def _monomials(q: Array, degree: int) -> Array:
    """Values (n, k) of the monomials of a degree at coordinates (n, d)."""
    return np.asarray(np.prod(q[:, None] ** _powers(q.shape[1], degree), axis=2))


def _slopes(q: Array) -> Array:
    """Derivatives (n, d, k) of the monomials of degrees three and four."""
    d = q.shape[1]
    powers = np.concatenate([_powers(d, 3), _powers(d, 4)])
    lower = np.maximum(powers - np.eye(d, dtype=int)[:, None], 0)
    return np.asarray(np.prod(q[:, None, None] ** lower, axis=3) * powers.T)


def _fitted_potential(given: _Samples) -> Array:
    """Coefficients (k,) of the monomials of degrees three and four of the potential."""
    matrix = _slopes(given.q)
    found, *_ = np.linalg.lstsq(matrix.reshape(-1, matrix.shape[2]),
                                (given.loads - given.q).ravel(), rcond=None)
    return np.asarray(found)


def _fitted_fields(given: _Samples) -> Array:
    """Displacements (k, f) of the quadratic monomials, in the largest displacement.

    Cubic displacements are fitted beside them and left out.
    """
    quadratic, cubic = _monomials(given.q, 2), _monomials(given.q, 3)
    found, *_ = np.linalg.lstsq(np.hstack([quadratic, cubic]), given.rest, rcond=None)
    return np.asarray(found[: quadratic.shape[1]])


def _tensors(potential: Array, d: int, energy: float, unit: Array) -> tuple[Array, Array]:
    """Symmetric tensors of the quadratic and cubic forces."""
    found: list[Any] = []
    first = 0
    for degree in (3, 4):
        tensor = np.zeros((d,) * degree)
        places = list(combinations_with_replacement(range(d), degree))
        for where, coefficient in zip(places, potential[first : first + len(places)], strict=True):
            orders = set(permutations(where))
            for one in orders:
                tensor[one] = degree * coefficient / len(orders)
        first += len(places)
        found.append(energy * scaled(tensor, 1.0 / unit))
    return found[0], found[1]


def scaled(tensor: Array, factors: Array) -> Array:
    """A tensor over d coordinates with a factor (d,) for every index."""
    for axis in range(tensor.ndim):
        tensor = tensor * factors.reshape([-1 if k == axis else 1 for k in range(tensor.ndim)])
    return tensor


def _full_fields(fields: Array, d: int, unit: Array, size: float) -> Array:
    """Fields theta (f, d, d) in modal coordinates."""
    found = np.zeros((fields.shape[1], d, d))
    for (i, j), field in zip(combinations_with_replacement(range(d), 2), fields, strict=True):
        value = size * field / (unit[i] * unit[j])
        found[:, i, j] = found[:, j, i] = 2.0 * value if i == j else value
    return found
