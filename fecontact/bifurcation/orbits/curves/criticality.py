"""Test functions of curves of orbits, and their derivatives.

An orbit is on the curve where the test function g is zero. All of them come from vectors v along
the orbit for which all collocation equations ``G_u v = 0`` hold but those of a few end conditions;
with the multiples w of the collocation rows that make up these, the derivative along d is

    dg = -w (G_uu d) v = sum h w [T f_xx v d_x + d_T f_x v + T f_xp v d_p + v_T (f_x d_x + f_p d_p)]

over all Gauss points, with the interval widths h. One difference of the Jacobian along v at each
point gives f_xx v and f_xp v; the condensed equations of the orbit serve for v and w, too. (These
are minimally augmented systems: Govaerts, Kuznetsov and Dhooge, SIAM J. Sci. Comput. 27, 2005.)
Where g is not zero, the derivative is wrong by a multiple of g, which leaves Newton's method
quadratic.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from fecontact.bifurcation.linalg.bordered import expand_open, original_rows
from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.bifurcation.orbits.collocation_kernels import to_nodes
from fecontact.bifurcation.orbits.discretisation import CollocationLinearisation, Discretisation
from fecontact.core.types import Array

# Step of the differences of the Jacobian, in ranges of the states over the orbit.
_STEP = 1e-5
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


class Criticality(NamedTuple):
    """Value of a test function, and what its derivative is made of; at folds v (n,) too."""

    value: float
    terms: tuple[Term, ...]
    v: Array | None = None


class ContinuedSign:
    """Sign of a test function that is a singular value: its vectors turn little along a curve."""

    def __init__(self) -> None:
        self._before: Term | None = None

    def keep(self, term: Term) -> None:
        """Let vectors that follow have the direction of these."""
        self._before = term

    def aligned(self, found: Criticality, widths: Array) -> Criticality:
        """The test function for w and v of length one, in the direction of those before."""
        term, = found.terms
        h = np.repeat(widths, len(term.left) // len(widths))
        factors = []
        for number, part in enumerate((term.left, term.states)):
            factor = 1.0 / float(np.sqrt(h @ (part * part).sum(axis=1)))
            if self._before is not None and self._before.left.shape == part.shape:
                factor = float(np.copysign(factor, (part * self._before[number]).sum()))
            factors.append(factor)
        one, other = factors
        return Criticality(one * other * found.value,
                           (Term(one * term.left, other * term.states, other * term.period),),
                           None if found.v is None else other * found.v)


def of_fold(at: CollocationLinearisation) -> Criticality:
    """Smallest singular value of the equations at fixed parameters."""
    problem = at.problem
    value, left, v = at.at_fixed_parameters().weakest()
    period = float(v[problem.size]) if problem.autonomous else 0.0
    nodes = v[: problem.size].reshape(-1, problem.field.dimension)
    term = Term(-left.reshape(nodes.shape), at_points(problem, nodes, nodes[0]), period)
    return Criticality(value, (term,), v)


def along_parameter(at: CollocationLinearisation, term: Term) -> float:
    """Derivative of the residual to the first parameter, along the multiples w."""
    h = np.repeat(at.problem.widths, at.problem.degree)[:, None]
    return -float((h * term.left * at.derivatives[2][:, :, -1]).sum()) * at.period


def of_doubling(at: CollocationLinearisation) -> Criticality:
    """Smallest singular value of the equations at the ends of v for v(1) = -v(0)."""
    start, end, balance = _ends(at.factors)
    lefts, sizes, rights = np.linalg.svd(start - end)
    v = rights[-1]
    return Criticality(float(sizes[-1]), (_term(at, -lefts[:, -1] * balance, v, -v),))


def of_torus(at: CollocationLinearisation) -> Criticality:
    """mu_1 mu_2 - 1 of the two multipliers whose product is nearest to one."""
    start, end, balance = _ends(at.factors)
    mu, lefts, rights = eig(start, -end, left=True, right=True)
    one, other = _critical_pair(mu, at.problem.autonomous)
    terms: list[Term] = []
    conjugate = abs(mu[one].imag) > 0.0
    for place, partner in ((one, other), (other, one)):
        left, v = lefts[:, place].conj(), rights[:, place]
        left = mu[partner] / (left @ end @ v) * left * balance
        if conjugate:
            terms.append(_term(at, 2.0 * left.real, v.real, (mu[place] * v).real))
            terms.append(_term(at, -2.0 * left.imag, v.imag, (mu[place] * v).imag))
            break
        terms.append(_term(at, left.real, v.real, (mu[place] * v).real))
    return Criticality(float((mu[one] * mu[other]).real - 1.0), tuple(terms))


def gradient(at: CollocationLinearisation, terms: tuple[Term, ...]) -> Array:
    """Derivative (n,) of a test function to all unknowns."""
    problem, T = at.problem, at.period
    _, J, P = at.derivatives
    h = np.repeat(problem.widths, problem.degree)[:, None]
    points, out = np.zeros(J.shape[:2]), np.zeros(len(at.u))
    for term, (bend, shift) in zip(terms, _bends(at, [term.states for term in terms]), strict=True):
        points += (term.left[:, None, :] @ (T * bend + term.period * J))[:, 0, :]
        weighted = (h * term.left).ravel()
        if problem.autonomous:
            out[problem.size] += weighted @ (J @ term.states[:, :, None]).ravel()
        out[-len(problem.active) :] += weighted @ (T * shift + term.period * P).reshape(
            len(weighted), -1)
    to_nodes(points, problem.rule.values, problem.widths,
             out[: problem.size].reshape(-1, problem.field.dimension))
    return out


def _bends(at: CollocationLinearisation, directions: list[Array]) -> list[tuple[Array, Array]]:
    """Derivatives of df/dx and df/dp at the Gauss points along directions (N m, d)."""
    span = np.ptp(at.problem.nodes(at.u), axis=0)
    span = np.maximum(span, _LEAST_RANGE * span.max())
    steps = [_STEP / max(float(np.abs(one / span).max()), 1e-300) for one in directions]
    moves = [step * one for step, one in zip(steps, directions, strict=True)]
    _, J, P = at.derivatives_beside([move * sign for move in moves for sign in (1.0, -1.0)])
    return [((J[2 * k] - J[2 * k + 1]) / (2.0 * step), (P[2 * k] - P[2 * k + 1]) / (2.0 * step))
            for k, step in enumerate(steps)]


def _ends(factors: CondensedFactors) -> tuple[Array, Array, Array]:
    """Equations (d, d) of x_0 and x_N, in rows of the same size, and the factors (d,) for that."""
    d = len(factors.end)
    balance = 1.0 / np.abs(factors.end[:, : 2 * d]).max(axis=1)
    even = factors.end[:, : 2 * d] * balance[:, None]
    return even[:, :d], even[:, d:], balance


def _critical_pair(mu: Array, autonomous: bool) -> tuple[int, int]:
    """Places of the two multipliers with product nearest to one, the trivial one left out."""
    size = np.where(np.isfinite(mu), mu, np.inf)
    off = np.abs(np.outer(size, size) - 1.0)
    off[~np.isfinite(off)] = np.inf
    np.fill_diagonal(off, np.inf)
    if autonomous:
        trivial = int(np.argmin(np.abs(size - 1.0)))
        off[trivial] = off[:, trivial] = np.inf
    one, other = np.unravel_index(np.argmin(off), off.shape)
    return int(one), int(other)


def _term(at: CollocationLinearisation, left: Array, start: Array, end: Array) -> Term:
    """Term of a vector between two ends, and of multiples of the equations of the ends."""
    shape = (-1, at.problem.field.dimension)
    nodes = expand_open(at.factors, start, end).reshape(shape)
    rows = original_rows(at.factors, left).reshape(shape)
    return Term(rows, at_points(at.problem, nodes, end))


def at_points(problem: Discretisation, nodes: Array, end: Array) -> Array:
    """Values (N m, D) at the Gauss points of v with these nodes (N m, D) and this end (D,)."""
    N, m, values = problem.intervals, problem.degree, problem.rule.values
    patches = nodes.reshape(N, m, -1)
    last = np.concatenate([patches[1:, 0], end[None]])
    return np.ascontiguousarray(
        (values[:, :m] @ patches + values[:, m:] * last[:, None, :]).reshape(nodes.shape))
