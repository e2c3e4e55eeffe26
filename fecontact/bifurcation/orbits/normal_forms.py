"""Normal forms of folds, and of period doublings and Neimark-Sacker points: sub- or supercritical.

On the centre manifold, with time in periods of the orbit and its phase moving with the flow,

    fold              xi' = b xi^2           v' = A v - a x', with the phase at the speed 1 + a xi
    period doubling   xi' = c xi^3           v' = A v, v(1) = -v(0)
    Neimark-Sacker    z' = i theta z + D z |z|^2        v' = A v, v(1) = exp(i theta) v(0)

where A = T df/dx along the orbit. The doubled orbit, or the torus, is stable and lies beyond the
point if c, or Re D, is negative (supercritical); else it is unstable and lies before it. The
coefficients follow from the terms up to third order (Kuznetsov, Govaerts, Doedel and Dhooge, SIAM
J. Numer. Anal. 43, 2005), as those that make the collocation equations solvable. The second and
third derivatives of f are differences of its Jacobian along directions.

Jumps of the second derivative of f along the orbit, as of friction with exp(-b |v|) at zero slip,
add a delta each to the third derivative, see :mod:`fecontact.bifurcation.orbits.kinks`.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linalg.bordered import solve_turned
from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.curves.kernels import applied, multiplied
from fecontact.bifurcation.orbits.curves.singularity import (
    SecondDerivatives,
    Singularity,
    at_points,
    mean_size,
    of_doubling,
    of_fold,
    of_torus,
    ranges_of,
    widths_at_points,
)
from fecontact.bifurcation.orbits.kinks import JacobianKinks

Array = NDArray[Any]

# Steps of the differences, in ranges of the states over the orbit; the first two that agree count.
_STEPS = (1e-3, 1e-4, 1e-5, 1e-6)
_AGREEMENT = 1e-3
# Least error of a coefficient, in the sum of the sizes of what adds up to it: that is how well
# meshes of orbits with large multipliers reproduce it.
_CANCELLED = 1e-5
# Largest relative error of a coefficient whose sign is trusted.
_DECIDED = 0.25


def examined(
    kind: str, problem: CollocationEquations, u: Array, linearised: CollocationLinearisation,
    details: bool = True
) -> dict[str, Any] | None:
    """Details of a special point of a branch of orbits; None if it is not one.

    'coefficient' is c or Re D for eigenfunctions of unit mean square in the scaled states,
    'coefficient_error' the change between two difference steps, 'criticality' their conclusion,
    see :func:`verdict`; at folds |b|, without conclusion. Without ``details`` these are omitted.
    """
    found = linearised.floquet.confirmed(kind)
    if found is None or not details:
        return found
    if kind == "period doubling":
        expansion = Expansion(problem, u, linearised, of_doubling(linearised))
        found |= _judged(expansion, expansion.doubling)
    elif kind == "torus":
        expansion = Expansion(problem, u, linearised, of_torus(linearised, found["angle"]))
        found |= _judged(expansion, expansion.torus)
    elif kind == "fold":
        expansion = Expansion(problem, u, linearised, of_fold(linearised))
        found |= _judged(expansion, expansion.fold)
        del found["criticality"]
    return found


def verdict(coefficient: float, error: float) -> dict[str, Any]:
    """A coefficient, its error, and 'supercritical', 'subcritical' or 'undecided'.

    It is undecided if the error exceeds a quarter of the coefficient or is unknown (NaN).
    """
    criticality = "undecided"
    if error <= _DECIDED * abs(coefficient) and coefficient != 0.0:
        criticality = "supercritical" if coefficient < 0.0 else "subcritical"
    return {"coefficient": coefficient, "coefficient_error": error, "criticality": criticality}


def _judged(
    expansion: "Expansion", formula: "Callable[[Sequence[SecondDerivatives]], Share]"
) -> dict[str, Any]:
    """The coefficient from the first two steps that agree, or else the best pair.

    Where none agree, the error is the largest difference from any step: two may be near each other
    by accident, on their way from one plateau to another.
    """
    values: list[float] = []
    pairs: list[tuple[float, float]] = []
    for step in _STEPS:
        (value, size), uncertain = expansion.coefficient(formula, step)
        values.append(value)
        if len(values) > 1:
            pairs.append((abs(value - values[-2]), value))
            if pairs[-1][0] <= _AGREEMENT * abs(value):
                return verdict(value, max(pairs[-1][0], _CANCELLED * size) + uncertain)
    _, value = min(pairs)
    return verdict(value, max(abs(one - value) for one in values) + uncertain)


class Share(NamedTuple):
    """A coefficient, and the sum of the sizes of what adds up to it."""

    value: float
    size: float


class Expansion:
    """The flow about an orbit, to third order, on the points of collocation.

    The singularity ``at`` gives the vector v at the points, and the multiples of the equations
    there that make up a sum: w' - A w = g - c v is solvable, with w closed like v, if
    c = sum left g / sum left v.
    """

    def __init__(
        self, problem: CollocationEquations, u: Array, linearised: CollocationLinearisation,
        at: Singularity,
    ) -> None:
        self._problem, self._linearised, self._at = problem, linearised, at
        self._u, self._T = u, linearised.period
        self._J = linearised.derivatives[1]
        self._h = widths_at_points(problem)

    def fold(self, second_derivatives: Sequence[SecondDerivatives]) -> Share:
        """Size of the coefficient b of a fold; its sign is that of the direction of v."""
        term, = self._at.terms
        V, drift = term.states, -term.period / self._T
        found, size = self._share(term.left, V, _applied(second_derivatives[0].first, V) / 2.0
                                  - drift * _applied(self._J, V))
        unit = mean_size(self._problem, V)
        return Share(abs(found.real) / unit, size / unit)

    def doubling(self, second_derivatives: Sequence[SecondDerivatives]) -> Share:
        """Coefficient c of a period doubling."""
        term, = self._at.terms
        V, (first, second, _) = term.states, second_derivatives[0]
        h2, drift = self._response(_applied(first, V))
        found, size = self._share(
            term.left, V, _applied(second, V) / 6.0 + _applied(first, h2) / 2.0
            - drift / 2.0 * _applied(self._J, V))
        unit = mean_size(self._problem, V) ** 2
        return Share(found.real / unit, size / unit)

    def torus(self, second_derivatives: Sequence[SecondDerivatives]) -> Share:
        """Coefficient Re D of a Neimark-Sacker point, whose multipliers are complex."""
        assert self._at.pair is not None
        (p, pp, _), (q, qq, _) = second_derivatives
        one, other = self._at.terms
        V = one.states + 1j * other.states
        angle = float(np.angle(self._at.pair[0]))
        h11, drift = self._response(_complex(p, q, V.conj()).real)
        h20 = self._turned(_complex(p, q, V), np.exp(2j * angle))
        along, across = pp + qq, np.zeros_like(p)
        third = (_complex(along, across, V) / 2.0 + _complex(p, q, h11.astype(complex))
                 + _complex(p, q, h20, -1.0) / 2.0
                 - drift * (_complex(self._J, across, V) - 1j * angle / self._T * V))
        found, size = self._share(one.left - 1j * other.left, V, third)
        unit = mean_size(self._problem, V) ** 2
        return Share(found.real / unit, size / unit)

    def coefficient(
        self, formula: Callable[[Sequence[SecondDerivatives]], Share], step: float
    ) -> tuple[Share, float]:
        """A coefficient with the share of jumps of second derivatives, and the error of that share.

        ``step`` is the step of the differences in ranges of the states.
        """
        second_derivatives = self.second_derivatives(step)
        # Coefficients of folds contain second derivatives only.
        if formula == self.fold or not self._kinks.passages:
            return formula(second_derivatives), 0.0
        found, perturbed = [], []
        span = ranges_of(self._problem, self._u)
        for bend, term in zip(second_derivatives, self._at.terms, strict=True):
            change, error = self._kinks.second(term.states, self._step(term.states, step), span)
            found.append(bend._replace(second=bend.second + change))
            perturbed.append(bend._replace(second=bend.second + change + error))
        whole = formula(found)
        return whole, abs(formula(perturbed).value - whole.value)

    @cached_property
    def _kinks(self) -> JacobianKinks:
        return JacobianKinks(self._linearised)

    def second_derivatives(self, step: float) -> list[SecondDerivatives]:
        """Differences of fourth order along v, over a step in ranges of the states."""
        return [self._bend(term.states, step) for term in self._at.terms]

    def _bend(self, direction: Array, step: float) -> SecondDerivatives:
        """Differences along a direction (N m, d)."""
        h = self._step(direction, step)
        if h == 0.0:
            return SecondDerivatives(*(np.zeros_like(self._J) for _ in range(3)))
        _, J, P = self._linearised.perturbed_derivatives(
            [part * h * direction for part in (1.0, -1.0, 2.0, -2.0)], states_alone=True)
        odd, far_odd = J[0] - J[1], J[2] - J[3]
        even, far_even = J[0] + J[1], J[2] + J[3]
        return SecondDerivatives(np.asarray((8.0 * odd - far_odd) / (12.0 * h)),
                    np.asarray((16.0 * even - far_even - 30.0 * self._J) / (12.0 * h * h)), P[0])

    def _step(self, direction: Array, step: float) -> float:
        """Factor of a direction (N m, d) for a step in ranges; 0 if the direction is zero."""
        largest = float(np.max(np.abs(direction) / ranges_of(self._problem, self._u)))
        return step / largest if largest > 0.0 else 0.0

    def _share(self, left: Array, V: Array, g: Array) -> tuple[complex, float]:
        """The c for which w' - A w = T g - c v is solvable, and the sum of the sizes in it."""
        weighted = self._h * left
        products, whole = weighted * g, (weighted * V).sum() / self._T
        return complex(products.sum() / whole), float(np.abs(products).sum() / abs(whole))

    def _response(self, bend: Array) -> tuple[Array, float]:
        """Periodic h with h' - A h = T bend - a x' at the points, and a."""
        problem = self._problem
        side = np.zeros(len(self._u))
        side[: bend.size] = (self._T * self._h * bend).reshape(-1)
        found = self._linearised.at_fixed_parameters().solve(side)
        nodes = found[: problem.size].reshape(bend.shape)
        return (at_points(problem, nodes, nodes[0]),
                -float(found[problem.size]) / self._T if problem.autonomous else 0.0)

    def _turned(self, bend: Array, closing: complex) -> Array:
        """The h with h' - A h = T bend at the points and h(1) = closing h(0), complex."""
        side = (self._T * self._h * bend).reshape(-1)
        shaped: Array = solve_turned(
            self._linearised.factors, side, closing).reshape(bend.shape)
        return at_points(self._problem, shaped, closing * shaped[0])


def _complex(real: Array, imaginary: Array, vectors: Array, sign: float = 1.0) -> Array:
    """Products (N m, d) of complex matrices, given as two parts (N m, d, d), with vectors."""
    out = np.empty_like(vectors)
    multiplied(real, imaginary, sign, vectors, out)
    return out


def _applied(matrices: Array, vectors: Array) -> Array:
    """Products (N m, d) of matrices (N m, d, d) with vectors (N m, d)."""
    out = np.empty_like(vectors)
    applied(matrices, vectors, out)
    return out
