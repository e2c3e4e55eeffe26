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

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement, permutations, product
from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError, InputError, ModelWarning
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.large_deflections.options import MOST, LargeDeflections
from fecontact.reduction.large_deflections.samples import LoadedStates, Samples

# Modes that are loaded at once, and random loads on which the fit is tried.
_TOGETHER, _TRIALS = 3, 4
# Part of the energy of a mode that a load of another shape has in trials.
_OTHER = 0.05
# Arcs between the fitted states and between those of trials, in the linear response to a load.
_STEP, _TRIAL_STEP = 0.3, 0.43
# Length of a field relative to the longest below which it is rounding or of no weight.
_NO_FIELD = 1e-4
# Relative difference of frequencies in internal resonance, and displacement of a mode left out,
# relative to the largest displacement, from which it counts.
_RESONANT, _COUPLED = 0.05, 1e-3


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
    powers : (p, d) integer array
        Exponents of the products of coordinates of the degrees two and three.
    stress : (N, c, p) array
        Stress at the nodes that belongs to each of them.
    ranges : (d, 2) array
        Least and largest coordinate of the fitted states [m kg^(1/2)].
    largest_strain : float
        Largest component of the strain in the fitted states.
    force_error, displacement_error, stress_error : float
        Largest errors in states that were not fitted: of the loads, relative to the largest one
        of each path, of the displacement, relative to ``largest_displacement``, and of the stress,
        relative to the largest one.
    other_load_error : float
        Larger of the errors of loads and displacements where a load of another shape, which the
        modes do not see, acts beside theirs: of uniform acceleration, with a twentieth of their
        energy.
    states : int
        Number of static solutions that were fitted.
    """

    modes: Integers
    cubic: Array
    quartic: Array
    fields: Array
    powers: Integers
    stress: Array
    ranges: Array
    largest_strain: float
    force_error: float
    displacement_error: float
    stress_error: float
    other_load_error: float
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
    body: ElasticBody, system: FreeSystem, w: Array, shapes: Array, given: LargeDeflections,
    geometric: Any = None,
) -> CondensedBody:
    """Fit the potential of modes with frequencies (m,) and free shapes (f, m).

    ``geometric``, sparse (d N, d N), is the geometric stiffness of a stress in the body, that of
    ``system`` too.

    Raises
    ------
    InputError
        For modes that the basis does not have, and rigid ones.
    AnalysisError
        If the statics do not reach the largest displacement, or the fit not its accuracy.

    Warns
    -----
    ModelWarning
        For modes left out whose frequencies and displacements are those of an internal resonance.
    """
    rigid = system.rigid.shape[1]
    numbers = np.array(given.numbers) + (rigid if isinstance(given.modes, int) else 0)
    if numbers.min() < rigid:
        raise InputError(f"large_deflections: mode {numbers.min()} is a rigid motion; name modes "
                         f"from {rigid}.")
    if numbers.max() >= len(w):
        raise InputError(f"large_deflections: mode {numbers.max()} is not among the {len(w)} modes "
                         f"of the basis, which count from 0; ask for more modes.")
    states = LoadedStates(body, system, w, shapes, int(numbers[0]), given.largest_displacement,
                          geometric)
    while True:
        fit = _Fit(states, numbers)
        errors = fit.force_error, fit.displacement_error, fit.other_load_error
        if given.accuracy is None or max(errors) <= given.accuracy:
            break
        left = np.setdiff1d(np.arange(rigid, len(w)), numbers)
        if len(numbers) == MOST or not len(left):
            raise AnalysisError(
                f"large_deflections: with the modes {', '.join(map(str, numbers))} the forces are "
                f"off by {100.0 * errors[0]:.2g} % and the displacements by "
                f"{100.0 * errors[1]:.2g} %, beside another load by {100.0 * errors[2]:.2g} %, "
                f"above accuracy = {given.accuracy:g}; lower largest_displacement" + (
                    "." if len(numbers) == MOST else ", or ask for more modes of the basis."))
        numbers = np.append(numbers, left[fit.lacking[left].argmax()])
    for sentence in _resonances(states, fit, w):
        warnings.warn(f"large_deflections: {sentence}", ModelWarning, stacklevel=4)
    return fit.condensed(w)


class _Fit:
    """Potential, displacements and stress of some modes, and their errors."""

    def __init__(self, states: LoadedStates, modes: Integers) -> None:
        self.states, self.modes, d = states, modes, len(modes)
        self.fitted = fitted = states.samples(modes, _loads(d), _STEP)
        rng = np.random.default_rng(0)
        loads = [np.ones(1), -np.ones(1)] if d == 1 else list(rng.standard_normal((_TRIALS, d)))
        self.potential = _fitted_potential(fitted)
        self.fields, self.stress = _fitted(fitted.q, fitted.rest), _fitted(fitted.q, fitted.stress)
        errors, largest = [], 0.0
        self.lacking = np.zeros(len(states.unit))
        for load in loads:
            tried = states.samples(modes, [load], _TRIAL_STEP)
            products = _products(tried.q)
            forces = tried.q + _slopes(tried.q) @ self.potential - tried.loads
            quadratic = _monomials(tried.q, 2)
            moved = quadratic @ self.fields[: quadratic.shape[1]] - tried.rest
            errors.append((np.linalg.norm(forces, axis=1).max()
                           / np.linalg.norm(tried.loads, axis=1).max(), np.abs(moved).max(),
                           np.abs(products @ self.stress - tried.stress).max()))
            largest = max(largest, tried.largest_stress)
            self.lacking = np.maximum(self.lacking, np.abs(
                moved @ states.inertia).max(axis=0) * states.reach)
        self.force_error, self.displacement_error, off = map(float, np.max(errors, axis=0))
        self.stress_error = off / largest
        self.other_load_error = max(self._other_load(loads[0], sign) for sign in (1.0, -1.0))

    def _other_load(self, load: Array, sign: float) -> float:
        """Larger error of loads and displacements beside a load of another shape.

        The modes do not see it, but the quadratic displacements do: with ``p . u`` it has the
        potential ``-p . theta q q / 2``.
        """
        states, modes = self.states, self.modes
        forces, moved = (sign * one for one in states.other_load(modes, _OTHER))
        tried = states.samples(modes, [load], _TRIAL_STEP, forces)
        direction = load / np.abs(load).sum()
        factors = tried.loads @ direction / (direction @ direction)
        quadratic = _monomials(tried.q, 2)
        fields = self.fields[: quadratic.shape[1]]
        pull = _slopes(tried.q, (2,)) @ (fields @ forces * states.size)
        off = (tried.q + _slopes(tried.q) @ self.potential
               - factors[:, None] * pull / states.energy - tried.loads)
        apart = quadratic @ fields + np.outer(factors, moved) / states.size - tried.rest
        self.lacking = np.maximum(self.lacking, np.abs(
            apart @ states.inertia).max(axis=0) * states.reach)
        return float(max(np.linalg.norm(off, axis=1).max()
                         / np.linalg.norm(tried.loads, axis=1).max(), np.abs(apart).max()))

    def condensed(self, w: Array) -> CondensedBody:
        """The fit in modal coordinates."""
        modes, fitted, d = self.modes, self.fitted, len(self.modes)
        unit = self.states.unit[modes]
        cubic, quartic = _tensors(self.potential, d, float(w[modes[0]] * unit[0]) ** 2, unit)
        powers = np.concatenate([_powers(d, 2), _powers(d, 3)])
        components = 4 if self.states.model.body.dimension == 2 else 6
        stress = (self.stress / np.prod(unit**powers, axis=1)[:, None]).T
        return CondensedBody(
            modes, cubic, quartic,
            _full_fields(self.fields[: d * (d + 1) // 2], d, unit, self.states.size), powers,
            stress.reshape(-1, components, len(powers)),
            np.stack([fitted.q.min(axis=0), fitted.q.max(axis=0)], axis=1) * unit[:, None],
            fitted.strain, self.force_error, self.displacement_error, self.stress_error,
            self.other_load_error, len(fitted.q))


def _resonances(states: LoadedStates, fit: _Fit, w: Array) -> Iterator[str]:
    """Sentences about internal resonances of modes with large deflections and others."""
    powers = np.concatenate([_powers(len(fit.modes), 2), _powers(len(fit.modes), 3)])
    moved = np.abs(fit.fields @ states.inertia) * states.reach
    for k in np.setdiff1d(np.flatnonzero(w), fit.modes):
        for part, exponents in zip(moved[:, k], powers, strict=True):
            if part < _COUPLED:
                continue
            chosen = np.repeat(fit.modes, exponents)
            sums = [abs(float(np.dot(signs, w[chosen]))) for signs in product(
                (1.0, -1.0), repeat=len(chosen))]
            if min(abs(one / w[k] - 1.0) for one in sums) < _RESONANT:
                names = " + ".join(f"{count} x mode {mode}" for mode, count in zip(
                    fit.modes, exponents, strict=True) if count)
                yield (f"mode {k}, {w[k] / (2.0 * np.pi):.4g} Hz, is in internal resonance with "
                       f"{names} and moves by {100.0 * part:.2g} % of largest_displacement with "
                       f"them; add it to modes.")
                break


def _loads(d: int) -> list[Array]:
    """Directions (d,) of loads: each mode alone, and up to three together, with all signs."""
    found = []
    for count in range(1, min(d, _TOGETHER) + 1):
        for chosen in combinations(range(d), count):
            for signs in product((1.0, -1.0), repeat=count):
                load = np.zeros(d)
                load[list(chosen)] = signs
                found.append(load)
    return found


def _powers(d: int, degree: int) -> Integers:
    """Exponents (n, d) of all monomials of a degree."""
    return np.array([[places.count(k) for k in range(d)]
                     for places in combinations_with_replacement(range(d), degree)])


def _monomials(q: Array, degree: int) -> Array:
    """Values (n, k) of the monomials of a degree at coordinates (n, d)."""
    return np.asarray(np.prod(q[:, None] ** _powers(q.shape[1], degree), axis=2))


def _slopes(q: Array, degrees: tuple[int, ...] = (3, 4)) -> Array:
    """Derivatives (n, d, k) of the monomials of some degrees."""
    d = q.shape[1]
    powers = np.concatenate([_powers(d, degree) for degree in degrees])
    lower = np.maximum(powers - np.eye(d, dtype=int)[:, None], 0)
    return np.asarray(np.prod(q[:, None, None] ** lower, axis=3) * powers.T)


def _fitted_potential(given: Samples) -> Array:
    """Coefficients (k,) of the monomials of degrees three and four of the potential."""
    matrix = _slopes(given.q)
    found, *_ = np.linalg.lstsq(matrix.reshape(-1, matrix.shape[2]),
                                (given.loads - given.q).ravel(), rcond=None)
    return np.asarray(found)


def _fitted(q: Array, values: Array) -> Array:
    """Coefficients (k, v) of the monomials of degrees two and three of values (n, v)."""
    found, *_ = np.linalg.lstsq(_products(q), values, rcond=None)
    return np.asarray(found)


def _products(q: Array) -> Array:
    """Values (n, k) of the monomials of the degrees two and three."""
    return np.hstack([_monomials(q, 2), _monomials(q, 3)])


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
