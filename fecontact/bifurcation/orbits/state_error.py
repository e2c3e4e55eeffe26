"""Errors of periodic orbits by collocation, between the ends of intervals and at these."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cache
from math import comb, factorial

import numpy as np

from fecontact.bifurcation.linalg.condensation import with_left_ends
from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.collocation_kernels import (
    at_points,
    fill_carried,
    fill_ranges,
    fill_smooth_errors,
    integrate_defect,
)
from fecontact.bifurcation.orbits.mesh import basis_at_points, lagrange, rule
from fecontact.core.types import Array

# Factor between integrated defect and smooth error from which on the error itself counts, and the
# numbers of intervals on which it is solved for at once and in all.
_ODD, _AT_ONCE, _MOST_SOLVED = 2.0, 8, 32
# Rate times width of an interval above which the source of an error fades: from there on the defect
# does not tell it.
_RESOLVED = 64.0
# Parts of an interval, in which modes of this rate turn by 1; a power of two, and even.
_PARTS = 64
# Angle by which the fastest mode has to turn in an interval for collocation to delay it.
_LEAST_TURN = 0.5
# Least ratio of angular frequency and decay of such a mode.
_WEAK = 5.0
# Intervals whose matrices are worked on at once.
_BLOCK = 64


@dataclass(frozen=True, eq=False)
class _Halves:
    """Gauss points of both halves of an interval, for polynomials of degree m on the whole of it.

    Attributes
    ----------
    points : (2 m,) array
        Their places in [0, 1].
    values, slopes : (2 m, m + 1) array
        The basis polynomials and their derivatives there.
    integrals : (3 m, 2 m) array
        Weights of the integrals from 0 to k / (2 m), k = 1 ... 2 m, and to the Gauss points of the
        whole interval, where smooth errors are largest.
    """

    points: Array
    values: Array
    slopes: Array
    integrals: Array


@cache
def _halves(degree: int) -> _Halves:
    gauss = rule(degree).points
    points = np.concatenate([gauss, 1.0 + gauss]) / 2.0
    through = [p.integ() for p in lagrange(gauss)]
    ends = np.concatenate([np.arange(1, 2 * degree + 1) / (2 * degree), gauss])
    both = np.clip(2.0 * ends[:, None] - np.arange(2.0), 0.0, 1.0)
    integrals = 0.5 * np.concatenate(
        [np.array([p(place) - p(0.0) for p in through]).T for place in both.T], axis=1)
    return _Halves(points, *basis_at_points(degree, points), np.ascontiguousarray(integrals))


def state_error(
    problem: CollocationEquations, u: Array, linearisation: CollocationLinearisation | None = None,
    beside: Callable[[CollocationLinearisation, Array], Array] | None = None,
) -> float:
    r"""Largest error of a state, in its range over the orbit.

    The range counts as a hundredth of the state's scale at least. On each interval the error is the
    integral of the defect,

    .. math:: e(s) = x_h(s) - x(s) = \int_0^s (x_h' - h T f(x_h)) \, dr

    with s from 0 to 1, but for the part h T (f(x_h) - f(x)) that the error itself adds. The defect
    is zero at the Gauss points, and taken at those of both halves of the interval; a layer between
    the former shows there. Where motion is smooth this is the leading term of the error,
    h^(m+1) x^(m+1); at the ends of intervals it is of the order 2 m. Where it is much more, a layer
    begins or errors decay as in stick: the linear equations of e are then solved on both halves,
    on the intervals with the largest errors. It is infinite where the field is not finite there.

    The contribution of the intervals before is e at their ends, see :func:`_carried`. It needs the
    equations about the orbit, and ``beside``, their solution for a right-hand side; the larger
    error counts.
    Where modes turn by a good part of a turn in an interval, both are combined after the former is
    computed as they really turn, see :func:`_turned`.
    """
    halves, nodes, found = _halves(problem.degree), problem.nodes(u), rule(problem.degree)
    count = len(halves.points) * problem.intervals
    x, slopes = (np.empty((count, nodes.shape[1])) for _ in range(2))
    at_points(nodes, halves.values, halves.slopes, x, slopes)
    T = problem.period(u)
    times = np.zeros(count) if problem.autonomous else T * (
        problem.mesh[:-1, None] + problem.widths[:, None] * halves.points).ravel()
    f = problem.field.rates(times, x, problem.parameters(u))
    sizes = np.empty(nodes.shape[1])
    errors, smooth = np.empty(problem.intervals), np.empty(problem.intervals)
    fill_ranges(nodes, problem.scales, sizes)
    integrate_defect(slopes, f, problem.widths, T, halves.integrals, sizes, errors)
    if not np.isfinite(errors).all():
        return np.inf
    fill_smooth_errors(problem.widths, nodes, found.top, sizes, smooth)
    is_odd = errors > _ODD * found.bump * smooth
    # Those below the largest of the others need no better ones.
    others = errors.max(where=~is_odd, initial=0.0)
    odd = np.flatnonzero(is_odd & (errors > others))
    odd = odd[np.argsort(errors[odd])[::-1]]
    for first in range(0, min(len(odd), _MOST_SOLVED), _AT_ONCE):
        several = odd[first : first + _AT_ONCE]
        rows = (several[:, None] * len(halves.points) + np.arange(len(halves.points))).ravel()
        J = problem.field.derivatives(times[rows], np.ascontiguousarray(x[rows]),
                                      problem.parameters(u), ())[1]
        step = T * problem.widths[several]
        shape = (len(several), len(halves.points), nodes.shape[1])
        defect = slopes[rows].reshape(shape) - step[:, None, None] * f[rows].reshape(shape)
        try:
            solved = _solved(defect, J.reshape(*shape, -1), step, sizes, problem.degree)
        except np.linalg.LinAlgError:
            break
        errors[several] = np.where(np.isfinite(solved), solved, np.inf)
        rest = odd[first + _AT_ONCE :]
        if not len(rest) or max(others, errors[odd[: first + _AT_ONCE]].max()) >= errors[rest[0]]:
            break
    between = float(errors.max())
    if linearisation is None or beside is None:
        return between
    carried = _carried(linearisation, beside, slopes, f, sizes)
    # In a layer the equations change much from one step of Newton's method to the next.
    step = np.abs((u - linearisation.u)[: problem.size].reshape(nodes.shape) / sizes).max()
    if between < carried and problem.second is None:
        if carried < step:
            linearisation = CollocationLinearisation(problem, u)
            carried = _carried(linearisation, beside, slopes, f, sizes)
        defect = (slopes - T * np.repeat(problem.widths, len(halves.points))[:, None] * f).reshape(
            problem.intervals, -1, len(sizes))
        exact = _turned(linearisation, defect, halves.points, sizes)
        if exact is not None:
            # Ends of intervals are not where a vibration is largest.
            carried = float(np.hypot(
                _at_ends(exact[0], beside, exact[1], sizes), 0.75 * between))
    return max(between, carried)


def _carried(
    linearisation: CollocationLinearisation,
    beside: Callable[[CollocationLinearisation, Array], Array], slopes: Array, f: Array,
    sizes: Array,
) -> float:
    """Largest |e| / size at the ends of intervals, from the defect of the whole orbit.

    With p(s) the integral of the defect on an interval and w = e - p, w' = h T J (w + p) is solved
    by the equations of the orbit itself, periodic and with the steps of p between intervals. These
    carry errors on as they are where a rate times the width of an interval is small, but modes much
    faster than that undamped and in a wrong phase, although such an error is that of its own
    interval; p is therefore filtered.
    """
    problem = linearisation.problem
    points, d = problem.degree, len(sizes)
    side = np.zeros(problem.size + problem.common)
    fill_carried(slopes, f, linearisation.derivatives[1], problem.widths, linearisation.period,
                 problem.rule.values, problem.rule.slopes, problem.rule.weights,
                 _halves(points).integrals, side[: problem.size].reshape(-1, d))
    return _at_ends(linearisation, beside, side, sizes)


def _at_ends(
    linearisation: CollocationLinearisation,
    beside: Callable[[CollocationLinearisation, Array], Array], side: Array, sizes: Array,
) -> float:
    """Largest |e| / size at the ends of intervals, for a right-hand side of the equations."""
    problem = linearisation.problem
    e = beside(linearisation, side)[: problem.size].reshape(-1, problem.degree, len(sizes))
    ends = np.abs(e[:, 0] / sizes)
    return float(ends.max()) if np.isfinite(ends).all() else np.inf


def _solved(defect: Array, J: Array, step: Array, sizes: Array, degree: int) -> Array:
    """Largest |e| / size (k,) of e' = h T J e + defect by collocation on halves of k intervals."""
    found = rule(degree)
    count, d = len(step), len(sizes)
    start: Array = np.zeros((count, d))
    most = np.zeros(count)
    steps = (0.5 * step)[:, None, None, None] * J
    matrices = (found.slopes[:, None, :, None] * np.eye(d)[:, None, :]) - (
        steps.reshape(count, 2, degree, d, 1, d) * found.values[:, None, :, None])
    sides = 0.5 * defect.reshape(count, 2, degree, d)
    for half in range(2):
        matrix = matrices[:, half]
        side = sides[:, half] - (matrix[:, :, :, 0] @ start[:, None, :, None])[..., 0]
        solution = np.linalg.solve(
            matrix[:, :, :, 1:].reshape(count, degree * d, degree * d),
            side.reshape(count, degree * d, 1))
        inner = np.asarray(solution, dtype=float).reshape(count, degree, d)
        most = np.maximum(most, np.abs(inner / sizes).max(axis=(1, 2)))
        start = inner[:, -1]
    return most


@cache
def _approximant(degree: int) -> tuple[float, ...]:
    """Coefficients of the numerator of the diagonal Pade approximant to exp(z)."""
    m = degree
    return tuple(comb(m, k) * factorial(2 * m - k) / factorial(2 * m) for k in range(m + 1))


@cache
def _samples(places: tuple[float, ...]) -> Array:
    """Weights (parts + 1, k) of values at k places for Simpson's terms of their polynomial."""
    at, x = np.array(places), np.linspace(0.0, 1.0, _PARTS + 1)
    simpson = np.where(np.arange(_PARTS + 1) % 2, 4.0, 2.0) / (3.0 * _PARTS)
    simpson[[0, -1]] /= 2.0
    return np.stack([simpson * np.prod([(x - b) / (a - b) for b in np.delete(at, k)], axis=0)
                     for k, a in enumerate(at)], axis=1)


def _turned(
    linearisation: CollocationLinearisation, defect: Array, places: Array, sizes: Array
) -> tuple[CollocationLinearisation, Array] | None:
    r"""Equations that carry errors on as the modes really turn, and their right-hand side (n,).

    On an interval, with s from 0 to 1 and A the mean of h T J, an error goes on as

    .. math:: e(1) = \exp(A) \, e(0) + \int_0^1 \exp((1 - s) A) \, defect(s) \, ds

    Collocation has the approximant of Pade instead of exp(A); its phase is wrong by 4e-8 theta^9
    for degree 4 where a mode turns by theta. Over a period in which that hardly decays, this
    decides whether the error is in step with the orbit. ``defect`` (N, k, d) at ``places`` (k,) of
    each interval, ``sizes`` (d,) of the states. None where no mode turns so far.
    """
    problem = linearisation.problem
    N, m, d = problem.intervals, problem.degree, defect.shape[2]
    step = problem.widths * linearisation.period
    J = linearisation.derivatives[1].reshape(N, m, d, d)
    A = np.einsum("k,jkab->jab", problem.rule.weights, J) * step[:, None, None]
    square = A @ A
    if not np.median(np.abs(square * sizes / sizes[:, None]).max(axis=(1, 2))) > _LEAST_TURN**2:
        return None
    # Large, too, where errors decay as in stick: on the median and the widest interval modes turn.
    rates = np.linalg.eigvals(A[np.argsort(step)[[N // 2, -1]]])
    turns = np.abs(rates.imag)
    if not turns[turns > _WEAK * np.abs(rates.real)].max(initial=0.0) > _LEAST_TURN:
        return None
    later, q = np.empty_like(A), np.empty((N, d))
    terms = _samples(tuple(places.tolist())) @ defect
    for first in range(0, N, _BLOCK):
        some = slice(first, first + _BLOCK)
        later[some], q[some] = _exactly(A[some], square[some], terms[some], m)
    rule = problem.rule
    side = np.zeros(problem.size + problem.common)
    side[: problem.size] = (rule.slopes[None, :, m, None] * q[:, None] - step[:, None, None]
                            * rule.values[None, :, m, None] * (J @ q[:, None, :, None])[..., 0]
                            ).ravel()
    local = linearisation.factors.local
    found = copy(linearisation)
    found.factors = with_left_ends(linearisation.factors,
                                   local[:, :, :d] - local[:, :, d : 2 * d] @ later)
    found.forget_borders()
    return found, side


def _exactly(A: Array, square: Array, terms: Array, degree: int) -> tuple[Array, Array]:
    """exp(A) less its approximant (k, d, d), and int exp((1 - s) A) defect ds (k, d).

    ``terms`` (k, parts + 1, d) are those of the integral without the exponential.
    """
    one = np.eye(A.shape[1])
    part = first = _pade(A / _PARTS, square / _PARTS**2, degree)
    # Of neighbours the earlier one goes on by a part: two, four, ... parts become one.
    found: Array = terms[:, :-1].transpose(0, 2, 1)
    while found.shape[2] > 1:
        found = part @ found[:, :, ::2] + found[:, :, 1::2]
        part = part @ part
    found = np.asarray(first @ found, dtype=float) + terms[:, -1, :, None]
    filtering = one - np.sqrt(2.0) / _RESOLVED * A + square / _RESOLVED**2
    solved: Array = np.linalg.solve(filtering, np.linalg.solve(filtering, found))
    return part - _pade(A, square, degree), solved[..., 0]


def _pade(A: Array, square: Array, degree: int) -> Array:
    """The approximant of exp(A) that collocation has."""
    c = _approximant(degree)
    one = np.eye(A.shape[1])
    even, odd = (np.zeros_like(A) for _ in range(2))
    for part, first in ((even, 0), (odd, 1)):
        last = degree - (degree - first) % 2
        part += c[last] * one
        for k in range(last - 2, -1, -2):
            part[:] = square @ part + c[k] * one
    change = A @ odd
    return np.asarray(np.linalg.solve(even - change, even + change), dtype=float)
