"""Errors of periodic orbits by collocation, between the ends of intervals and at these."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from fecontact.bifurcation.orbits.collocation_kernels import (
    at_points,
    fill_carried,
    fill_ranges,
    fill_smooth_errors,
    integrate_defect,
)
from fecontact.bifurcation.orbits.discretisation import CollocationLinearisation, Discretisation
from fecontact.bifurcation.orbits.mesh import rule
from fecontact.core.types import Array

# Factor between integrated defect and smooth error from which on the error itself counts, and the
# numbers of intervals on which it is solved for at once and in all.
_ODD, _AT_ONCE, _MOST_SOLVED = 2.0, 8, 32


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
    nodes = np.linspace(0.0, 1.0, degree + 1)
    basis = [np.polynomial.Polynomial.fromroots(np.delete(nodes, k)) for k in range(degree + 1)]
    basis = [p / p(node) for p, node in zip(basis, nodes, strict=True)]
    through = [np.polynomial.Polynomial.fromroots(np.delete(gauss, k)) for k in range(degree)]
    through = [(p / p(c)).integ() for p, c in zip(through, gauss, strict=True)]
    ends = np.concatenate([np.arange(1, 2 * degree + 1) / (2 * degree), gauss])
    both = np.clip(2.0 * ends[:, None] - np.arange(2.0), 0.0, 1.0)
    integrals = 0.5 * np.concatenate(
        [np.array([p(place) - p(0.0) for p in through]).T for place in both.T], axis=1)
    return _Halves(points, np.array([[p(x) for p in basis] for x in points]),
                   np.array([[p.deriv()(x) for p in basis] for x in points]),
                   np.ascontiguousarray(integrals))


def state_error(
    problem: Discretisation, u: Array, linearisation: CollocationLinearisation | None = None,
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

    What the intervals before add is e at their ends, see :func:`_carried`. It needs the equations
    about the orbit, and ``beside``, their solution for a right-hand side; the larger error counts.
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
    odd = np.flatnonzero(errors > _ODD * found.bump * smooth)
    # Those below the largest of the others need no better ones.
    others = np.delete(errors, odd).max(initial=0.0)
    odd = odd[errors[odd] > others]
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
    if between < carried < step and problem.second is None:
        carried = _carried(CollocationLinearisation(problem, u), beside, slopes, f, sizes)
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
    e = beside(linearisation, side)[: problem.size].reshape(-1, points, d)
    ends = np.abs(e[:, 0] / sizes)
    return float(ends.max()) if np.isfinite(ends).all() else np.inf


def _solved(defect: Array, J: Array, step: Array, sizes: Array, degree: int) -> Array:
    """Largest |e| / size (k,) of e' = h T J e + defect by collocation on halves of k intervals."""
    found = rule(degree)
    count, d = len(step), len(sizes)
    start: Array = np.zeros((count, d))
    most = np.zeros(count)
    for half in range(2):
        at = slice(half * degree, (half + 1) * degree)
        change = 0.5 * step[:, None, None, None, None] * (
            J[:, at, :, None, :] * found.values[None, :, None, :, None])
        matrix = (found.slopes[:, None, :, None] * np.eye(d)[:, None, :]) - change
        side = 0.5 * defect[:, at] - (matrix[:, :, :, 0] @ start[:, None, :, None])[..., 0]
        solution = np.linalg.solve(
            matrix[:, :, :, 1:].reshape(count, degree * d, degree * d),
            side.reshape(count, degree * d, 1))
        inner = np.asarray(solution, dtype=float).reshape(count, degree, d)
        most = np.maximum(most, np.abs(inner / sizes).max(axis=(1, 2)))
        start = inner[:, -1]
    return most
