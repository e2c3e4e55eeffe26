"""Test functions of curves of orbits, and their derivatives.

An orbit is on the curve where the test function g is zero. All of them come from vectors v along
the orbit for which all collocation equations ``G_u v = 0`` hold but those of a few end conditions;
with the multiples w of the collocation rows that make up these, the derivative along d is

    dg = -w (G_uu d) v = sum h w [T f_xx v d_x + d_T f_x v + T f_xp v d_p + v_T (f_x d_x + f_p d_p)]

over all Gauss points, with the interval widths h. Differences of the Jacobian along v at each point
give f_xx v and f_xp v, and f_xxx v v for normal forms; the condensed equations of the orbit serve
for v and w, too. (These are minimally augmented systems: Govaerts, Kuznetsov and Dhooge, SIAM J.
Sci. Comput. 27, 2005.)
Where g is not zero, the derivative is wrong by a multiple of g, which leaves Newton's method
quadratic.
"""

from cmath import isfinite
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dggev

from fecontact.bifurcation.linalg.bordered import expand_open, original_rows
from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.collocation_kernels import to_nodes
from fecontact.bifurcation.orbits.curves.kernels import (
    TermDerivatives,
    add_term,
    central,
    open_values,
    unit_factor,
)
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, ComplexArray

# Step of the differences of the Jacobian, in ranges of the states over the orbit.
_STEP = 1e-4
# Smallest range of a state, in the largest one of all.
_LEAST_RANGE = 0.1


class Term(NamedTuple):
    """One product w G_uu v of a derivative.

    left (N m, d) are the multiples w of the collocation rows, states (N m, d) the v at the Gauss
    points, period its v_T.
    """

    left: Array
    states: Array
    period: float = 0.0


class Singularity(NamedTuple):
    """Value of a test function, and what its derivative is made of.

    At folds v (n,) too, at tori the two multipliers.
    """

    value: float
    terms: tuple[Term, ...]
    v: Array | None = None
    pair: tuple[complex, complex] | None = None

    @property
    def cosine(self) -> float:
        """Mean of the two multipliers at a torus: the cosine of their angle."""
        assert self.pair is not None
        return sum(self.pair).real / 2.0

    @property
    def turns(self) -> bool:
        """Whether the multipliers of a torus are complex."""
        return len(self.terms) == 2 and self.pair is not None and self.pair[0].imag != 0.0


class ContinuedSign:
    """Sign of a test function that is a singular value: its vectors turn little along a curve."""

    def __init__(self) -> None:
        self._before: Term | None = None
        self._times = np.empty(0)

    def keep(self, term: Term, times: Array) -> None:
        """Let vectors that follow have the direction of these, which are given at some times."""
        self._before, self._times = term, times

    def aligned(self, found: Singularity, orbit: CollocationEquations) -> Singularity:
        """The test function for w and v of length one, in the direction of those before."""
        term, = found.terms
        left, states = self._at(orbit.times)
        one = float(unit_factor(orbit.widths, term.left, left))
        other = float(unit_factor(orbit.widths, term.states, states))
        return Singularity(one * other * found.value,
                           (Term(one * term.left, other * term.states, other * term.period),),
                           None if found.v is None else other * found.v)

    def _at(self, times: Array) -> tuple[Array, Array]:
        """The vectors w and v before, between their times where a mesh has other intervals.

        They are empty where there are none.
        """
        if self._before is None:
            return np.empty((0, 0)), np.empty((0, 0))
        if len(times) == len(self._times):
            return self._before[:2]
        left, states = (np.stack([np.interp(times, self._times, column) for column in part.T],
                                 axis=1) for part in self._before[:2])
        return left, states


def of_fold(at: CollocationLinearisation) -> Singularity:
    """Smallest singular value of the equations at fixed parameters."""
    problem = at.problem
    value, left, v = at.at_fixed_parameters().weakest()
    period = float(v[problem.size]) if problem.autonomous else 0.0
    nodes = v[: problem.size].reshape(-1, problem.field.dimension)
    term = Term(-left.reshape(nodes.shape), at_points(problem, nodes, nodes[0]), period)
    return Singularity(value, (term,), v)


def along_parameter(at: CollocationLinearisation, term: Term) -> float:
    """Derivative of the residual to the first parameter, along the multiples w."""
    return -float((widths_at_points(at.problem) * term.left
                   * at.derivatives[2][:, :, -1]).sum()) * at.period


def of_doubling(at: CollocationLinearisation) -> Singularity:
    """Smallest singular value of the equations at the ends of v for v(1) = -v(0)."""
    start, end, balance = balanced_ends(at.factors)
    lefts, sizes, rights = np.linalg.svd(start - end)
    v = rights[-1]
    return Singularity(float(sizes[-1]), (_term(at, -lefts[:, -1] * balance, v, -v),))


def of_torus(
    at: CollocationLinearisation, angle: float | None = None, *, whole: bool = True
) -> Singularity:
    """mu_1 mu_2 - 1 of the two multipliers whose product is nearest to one.

    With an ``angle`` those that are nearest to exp(+- i angle); the value alone if not ``whole``.
    """
    start, end, balance = balanced_ends(at.factors)
    real, imag, size, lefts, rights, *_ = dggev(start, -end, compute_vl=whole, compute_vr=whole)
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = (real + 1j * imag) / size
    if angle is None:
        one, other = _critical_pair(mu.tolist(), at.problem.autonomous)
    else:
        one, other = (int(np.argmin(np.abs(mu - np.exp(side * angle)))) for side in (1j, -1j))
    pair = complex(mu[one]), complex(mu[other])
    value = (pair[0] * pair[1]).real - 1.0
    if not whole:
        return Singularity(value, ())
    terms: list[Term] = []
    conjugate = imag[one] != 0.0
    for place, partner in ((one, other), (other, one)):
        left, v = (_vector(vectors, imag, place) for vectors in (lefts, rights))
        left = left.conj()
        left = mu[partner] / (left @ end @ v) * left * balance
        if conjugate:
            terms.append(_term(at, 2.0 * left.real, v.real, (mu[place] * v).real))
            terms.append(_term(at, -2.0 * left.imag, v.imag, (mu[place] * v).imag))
            break
        terms.append(_term(at, left.real, v.real, (mu[place] * v).real))
    return Singularity(value, tuple(terms), pair=pair)


def _vector(vectors: Array, imag: Array, place: int) -> ComplexArray:
    """One eigenvector (d,); of a complex pair LAPACK gives both parts of the first one."""
    if imag[place] == 0.0:
        return vectors[:, place].astype(complex)
    first = place if imag[place] > 0.0 else place - 1
    side = 1j if imag[place] > 0.0 else -1j
    return np.asarray(vectors[:, first] + side * vectors[:, first + 1], dtype=complex)


class SecondDerivatives(NamedTuple):
    """First and second derivative of df/dx (N m, d, d) along a direction, first one of df/dp."""

    first: Array
    second: Array
    shift: Array


def second_derivatives(
    at: CollocationLinearisation, terms: tuple[Term, ...]
) -> list[SecondDerivatives]:
    """Derivatives along the states of each term at the Gauss points."""
    span = np.maximum(at.problem.ranges, _LEAST_RANGE * at.problem.ranges.max())
    steps = [_STEP / max(float(np.abs(term.states / span).max()), 1e-300) for term in terms]
    moves = [step * term.states for step, term in zip(steps, terms, strict=True)]
    J, P, here = at.bent([move * sign for move in moves for sign in (1.0, -1.0)])
    found = []
    for k, step in enumerate(steps):
        first, second = np.empty_like(here), np.empty_like(here)
        central(J[2 * k], J[2 * k + 1], here, step, first, second)
        found.append(SecondDerivatives(first, second, (P[2 * k] - P[2 * k + 1]) / (2.0 * step)))
    return found


def gradient(
    at: CollocationLinearisation, terms: tuple[Term, ...], bent: list[SecondDerivatives]
) -> Array:
    """Derivative (n,) of a test function to all unknowns, with its :func:`second_derivatives`."""
    problem, T = at.problem, at.period
    _, J, P = at.derivatives
    points, out = np.zeros(J.shape[:2]), np.zeros(len(at.u))
    for term, (bend, _, shift) in zip(terms, bent, strict=True):
        add_term(term.left, term.states, term.period, T, problem.widths,
                 TermDerivatives(J, P, bend, shift), points, out[problem.size :])
    to_nodes(points, problem.rule.values, problem.widths,
             out[: problem.size].reshape(-1, problem.field.dimension))
    return out


def balanced_ends(factors: CondensedFactors) -> tuple[Array, Array, Array]:
    """Equations (d, d) of x_0 and x_N, in rows of the same size, and the factors (d,) for that."""
    d = len(factors.end)
    balance = 1.0 / np.abs(factors.end[:, : 2 * d]).max(axis=1)
    even = factors.end[:, : 2 * d] * balance[:, None]
    return even[:, :d], even[:, d:], balance


def _critical_pair(mu: list[complex], autonomous: bool) -> tuple[int, int]:
    """Places of the two multipliers with product nearest to one, the trivial one left out."""
    places = [place for place, each in enumerate(mu) if isfinite(each)]
    if autonomous:
        places.remove(min(places, key=lambda place: abs(mu[place] - 1.0)))
    if len(places) < 2:
        raise AnalysisError("The multipliers beside the orbit are not finite.")
    return min(combinations(places, 2), key=lambda both: abs(mu[both[0]] * mu[both[1]] - 1.0))


def _term(at: CollocationLinearisation, left: Array, start: Array, end: Array) -> Term:
    """Term of a vector between two ends, and of multiples of the equations of the ends."""
    shape = (-1, at.problem.field.dimension)
    nodes = expand_open(at.factors, start, end).reshape(shape)
    rows = original_rows(at.factors, left).reshape(shape)
    return Term(rows, at_points(at.problem, nodes, end))


def at_points(problem: CollocationEquations, nodes: Array, end: Array) -> Array:
    """Values (N m, d) at the Gauss points of v with these nodes (N m, d) and this end (d,).

    Vectors may be complex.
    """
    if np.iscomplexobj(nodes) or np.iscomplexobj(end):
        real = at_points(problem, np.ascontiguousarray(nodes.real), end.real)
        return real + 1j * at_points(problem, np.ascontiguousarray(nodes.imag), end.imag)
    out = np.empty_like(nodes)
    open_values(nodes, np.ascontiguousarray(end), problem.rule.values, out)
    return out


def widths_at_points(problem: CollocationEquations) -> Array:
    """Width (N m, 1) of the interval of each Gauss point, in periods."""
    return np.repeat(problem.widths, problem.degree)[:, None]


def mean_size(problem: CollocationEquations, states: Array) -> float:
    """Root of the mean square of states (N m, d) at the Gauss points, in their scales."""
    weights = np.tile(problem.rule.weights, problem.intervals)[:, None] * widths_at_points(problem)
    scales = problem.scales[: states.shape[1]]
    return float(np.sqrt(np.sum(weights * np.abs(states / scales) ** 2)))


def ranges_of(problem: CollocationEquations, u: Array) -> Array:
    """Ranges (d,) of the states over the orbit, at least a tenth of the largest scaled one."""
    nodes = problem.nodes(u)
    scales = problem.scales[: nodes.shape[1]]
    size = np.ptp(nodes, axis=0) / scales
    return np.asarray(np.maximum(size, _LEAST_RANGE * size.max()) * scales)
