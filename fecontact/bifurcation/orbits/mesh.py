"""Piecewise polynomials of collocation: values, slopes and error monitor.

On each mesh interval the solution is a polynomial of degree m, given at m + 1 equally spaced nodes
including the ends; it satisfies the equation at the m Gauss points.
"""

from dataclasses import dataclass
from functools import cache
from math import factorial

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.errors import InputError
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array


@dataclass(frozen=True, eq=False)
class Rule:
    """Polynomials of degree m on [0, 1] and the Gauss points.

    Attributes
    ----------
    points, weights : (m,) array
        Gauss points and weights.
    values, slopes : (m, m + 1) array
        The basis polynomials and their derivatives there.
    top : (m + 1,) array
        Derivatives of order m of the basis polynomials.
    bump : float
        Largest |int_0^s prod (r - c_k) dr| / m! over s, c_k the Gauss points.
    fine : (k, m + 1) array
        The basis polynomials at many ascending points.
    """

    points: Array
    weights: Array
    values: Array
    slopes: Array
    top: Array
    bump: float
    fine: Array


def lagrange(nodes: Array) -> list[np.polynomial.Polynomial]:
    """Polynomials that are one at one of some nodes, and zero at the others."""
    found = [np.polynomial.Polynomial.fromroots(np.delete(nodes, k)) for k in range(len(nodes))]
    return [p / p(node) for p, node in zip(found, nodes, strict=True)]


def basis_polynomials(degree: int) -> list[np.polynomial.Polynomial]:
    """The polynomials of :func:`lagrange` for m + 1 equidistant nodes in [0, 1]."""
    return lagrange(np.linspace(0.0, 1.0, degree + 1))


def basis_at_points(degree: int, points: Array) -> tuple[Array, Array]:
    """Values and slopes (s, m + 1) of the basis polynomials at points (s,)."""
    basis = basis_polynomials(degree)
    return (np.array([[p(x) for p in basis] for x in points]),
            np.array([[p.deriv()(x) for p in basis] for x in points]))


@cache
def rule(degree: int) -> Rule:
    """The rule with m = ``degree`` Gauss points."""
    roots, weights = np.polynomial.legendre.leggauss(degree)
    points = (roots + 1.0) / 2.0
    basis = basis_polynomials(degree)
    bump = np.polynomial.Polynomial.fromroots(points).integ()
    # Its extremes lie at the Gauss points, the zeros of its derivative.
    highest = float(np.abs(bump(points)).max()) / factorial(degree)
    return Rule(
        points, weights / 2.0, *basis_at_points(degree, points),
        np.array([p.deriv(degree)(0.0) for p in basis]), highest,
        np.array([[p(x) for p in basis] for x in np.linspace(0.0, 1.0, 8 * degree + 1)]))


@helper
def _scales_of_basis(m):
    """Normalisation of each basis polynomial to one at its own node."""
    scales = np.ones(m + 1)
    for k in range(m + 1):
        for other in range(m + 1):
            if other != k:
                scales[k] /= k - other
    return scales


@helper
def _basis_at(mesh, t, j, scales, weights):
    """Fill node weights (m + 1,) at t; returns the index of its interval, searched from j on."""
    N, m = len(mesh) - 1, len(weights) - 1
    while j > 0 and t < mesh[j]:
        j -= 1
    while j < N - 1 and t >= mesh[j + 1]:
        j += 1
    place = (t - mesh[j]) / (mesh[j + 1] - mesh[j]) * m
    for k in range(m + 1):
        weight = scales[k]
        for other in range(m + 1):
            if other != k:
                weight *= place - other
        weights[k] = weight
    return j


@helper
def _combined(nodes, j, weights, out):
    """Fill out (d,) with the weighted nodes of interval j."""
    total, d = nodes.shape
    m = len(weights) - 1
    for i in range(d):
        out[i] = 0.0
    for k in range(m + 1):
        node = j * m + k
        if node == total:
            node = 0
        for i in range(d):
            out[i] += weights[k] * nodes[node, i]


@kernel
def _interpolate(mesh: Vector, nodes: Matrix, times: Vector, out: Matrix) -> None:
    """Fill out (k, d); the times need not be in order."""
    m = len(nodes) // (len(mesh) - 1)
    weights, scales = np.empty(m + 1), _scales_of_basis(m)
    j = 0
    for row in range(len(times)):
        j = _basis_at(mesh, times[row], j, scales, weights)
        _combined(nodes, j, weights, out[row])


@helper
def _fill_other_mesh(mesh, renewed, given, weights, scales, out):
    m = len(weights) - 1
    total, renewed_total = (len(mesh) - 1) * m, (len(renewed) - 1) * m
    d = given.shape[1] // total
    common = given.shape[1] - total * d
    j = 0
    for node in range(renewed_total):
        interval = node // m
        width = renewed[interval + 1] - renewed[interval]
        t = renewed[interval] + width * (node - interval * m) / m
        j = _basis_at(mesh, t, j, scales, weights)
        for index in range(len(given)):
            for i in range(d):
                value = 0.0
                for k in range(m + 1):
                    first = j * m + k if j * m + k < total else 0
                    value += weights[k] * given[index, first * d + i]
                out[index, node * d + i] = value
    for index in range(len(given)):
        for k in range(common):
            out[index, renewed_total * d + k] = given[index, total * d + k]


@kernel
def carry_over(mesh: Vector, renewed: Vector, m: int, given: Matrix, out: Matrix) -> None:
    """Fill out (k, N' m d + e) with k periodic solutions (k, N m d + e) on another mesh.

    The last e entries, which are not nodes, are copied.
    """
    _fill_other_mesh(mesh, renewed, given, np.empty(m + 1), _scales_of_basis(m), out)


def interpolate(mesh: Array, nodes: Array, times: Array) -> Array:
    """Values (k, d) at times (k,) in [0, 1] of the periodic solution with nodes (N m, d)."""
    result = np.empty((len(times), nodes.shape[1]))
    _interpolate(mesh, nodes, times, result)
    return result


@kernel
def compare_halves(
    mesh: Vector, weights: Vector, nodes: Matrix, before: Matrix, out: Vector,
) -> None:
    """Fill out (3,) with weighted sums: products of both differences, squares of those before, and
    squares of the nodes before about their mean.

    Differences are those between a half of an orbit and the other, half a period later. Both
    orbits have nodes (N m, d).
    """
    total, d = nodes.shape
    N = len(mesh) - 1
    m = total // N
    basis, scales = np.empty(m + 1), _scales_of_basis(m)
    later, before_later, mean = np.empty(d), np.empty(d), np.zeros(d)
    for row in range(total):
        for i in range(d):
            mean[i] += before[row, i] / total
    out[:] = 0.0
    j = 0
    for row in range(total):
        start = row // m
        t = mesh[start] + (mesh[start + 1] - mesh[start]) * (row % m) / m + 0.5
        if t >= 1.0:
            t -= 1.0
        j = _basis_at(mesh, t, j, scales, basis)
        _combined(nodes, j, basis, later)
        _combined(before, j, basis, before_later)
        for i in range(d):
            weight = weights[row * d + i]
            apart = before[row, i] - before_later[i]
            out[0] += weight * apart * (nodes[row, i] - later[i])
            out[1] += weight * apart * apart
            out[2] += weight * (before[row, i] - mean[i]) ** 2


@kernel
def _extremes(nodes: Matrix, fine: Matrix, low: Vector, high: Vector) -> None:
    """Fill low and high (d,); fine (k, m + 1) are the basis polynomials at k points."""
    total, d = nodes.shape
    m = fine.shape[1] - 1
    for i in range(d):
        low[i], high[i] = nodes[0, i], nodes[0, i]
    for node in range(total):
        for i in range(d):
            low[i] = min(low[i], nodes[node, i])
            high[i] = max(high[i], nodes[node, i])
    values = np.empty(len(fine))
    for i in range(d):
        # The maximum lies near the highest node: search only adjacent intervals.
        margin = 0.002 * (high[i] - low[i])
        top, bottom = high[i], low[i]
        for j in range(total // m):
            near = False
            for k in range(m + 1):
                node = j * m + k
                value = nodes[node if node < total else 0, i]
                near = near or value > top - margin or value < bottom + margin
            if not near:
                continue
            for row in range(len(fine)):
                value = 0.0
                for k in range(m + 1):
                    node = j * m + k
                    value += fine[row, k] * nodes[node if node < total else 0, i]
                values[row] = value
            for row in range(1, len(fine) - 1):
                left, here, right = values[row - 1], values[row], values[row + 1]
                bend = left - 2.0 * here + right
                # At the ends of an interval the peak may lie between the outermost points.
                reach = 2.0 if row == 1 or row == len(fine) - 2 else 1.0
                if abs(right - left) <= reach * abs(bend) and bend != 0.0:
                    peak = here - (right - left) ** 2 / (8.0 * bend)
                    high[i], low[i] = max(high[i], peak), min(low[i], peak)


def extremes(nodes: Array, degree: int) -> tuple[Array, Array]:
    """Smallest and largest value (d,) of each state over the orbit with nodes (N m, d)."""
    low, high = np.empty(nodes.shape[1]), np.empty(nodes.shape[1])
    _extremes(nodes, rule(degree).fine, low, high)
    return low, high


def extremes_of_run(x: Array, slopes: Array) -> tuple[Array, Array]:
    """Extremes (d,) of states x (..., N, d) along runs, on cubics from each sample to the next.

    ``slopes`` (..., N, d) are those per step from a sample to the next.
    """
    before, after = x[..., :-1, :], x[..., 1:, :]
    first, last, rise = slopes[..., :-1, :], slopes[..., 1:, :], after - before
    a, b = first + last - 2.0 * rise, 3.0 * rise - 2.0 * first - last
    inside = b * b - 3.0 * a * first
    # Zeros of the slope first + 2 b s + 3 a s^2, without cancellation.
    half = -(b + np.copysign(np.sqrt(np.maximum(inside, 0.0)), b))
    low, high = (chosen(x.reshape(-1, x.shape[-1]), axis=0) for chosen in (np.min, np.max))
    with np.errstate(divide="ignore", invalid="ignore"):
        places = [half / (3.0 * a), first / half]
    for s in places:
        turns = (inside > 0.0) & (s > 0.0) & (s < 1.0)
        s = np.where(turns, s, 0.0)
        found = (before + s * (first + s * (b + s * a))).reshape(-1, x.shape[-1])
        low, high = np.minimum(low, found.min(axis=0)), np.maximum(high, found.max(axis=0))
    return low, high


def node_times(mesh: Array, degree: int) -> Array:
    """Times (N m,) of the nodes, without the last one."""
    return (mesh[:-1, None] + np.diff(mesh)[:, None] * np.arange(degree) / degree).reshape(-1)


@helper
def _monitor(mesh, nodes, top, share):
    """Fill share (N,) with h |x^(m+1)|^(1/(m+1)) of each interval."""
    N = len(share)
    total, d = nodes.shape
    m = total // N
    derivative, steep = np.empty(N), np.zeros(N)
    for i in range(d):
        low, high = nodes[0, i], nodes[0, i]
        for node in range(total):
            low, high = min(low, nodes[node, i]), max(high, nodes[node, i])
        if high <= low:
            continue
        for j in range(N):
            value = 0.0
            for k in range(m + 1):
                node = j * m + k
                value += top[k] * nodes[node if node < total else 0, i]
            derivative[j] = value / (mesh[j + 1] - mesh[j]) ** m
        for j in range(N):
            after = j + 1 if j + 1 < N else 0
            spacing = (mesh[j + 1] - mesh[j] + mesh[after + 1] - mesh[after]) / 2.0
            jump = abs(derivative[after] - derivative[j]) / (spacing * (high - low))
            steep[j] += jump / 2.0
            steep[after] += jump / 2.0
    for j in range(N):
        steep[j] = steep[j] ** (1.0 / (m + 1))
    for j in range(N):
        mean = (steep[j - 1] + 2.0 * steep[j] + steep[j + 1 if j + 1 < N else 0]) / 4.0
        share[j] = mean * (mesh[j + 1] - mesh[j])


@kernel
def _equidistribute(mesh: Vector, nodes: Matrix, top: Vector, renewed: Vector) -> None:
    """Fill a mesh, see :func:`equidistributed`."""
    N, intervals = len(mesh) - 1, len(renewed) - 1
    share = np.zeros(N)
    _monitor(mesh, nodes, top, share)
    total = share.sum()
    uniform = not 0.0 < total < np.inf
    # Add a uniform share, which limits intervals to ten times the mean.
    before, after, j = 0.0, 0.0, -1
    for row in range(1, intervals):
        goal = 1.1 * row / intervals
        while j < N - 1 and after < goal:
            j += 1
            before = after
            after += share[j] / total + 0.1 * (mesh[j + 1] - mesh[j])
        part = (goal - before) / (after - before)
        renewed[row] = mesh[j] + min(part, 1.0) * (mesh[j + 1] - mesh[j])
        if uniform:
            renewed[row] = row / intervals
    renewed[0], renewed[intervals] = 0.0, 1.0


def equidistributed(mesh: Array, nodes: Array, degree: int, intervals: int) -> Array:
    """Mesh that equidistributes the interpolation error (de Boor).

    The error on an interval of width h is h^(m+1) |x^(m+1)|; its root of order m + 1 is
    equidistributed. The derivative of order m + 1 follows from the jumps of that of order m. Each
    state is scaled by its range over the orbit.
    """
    result = np.empty(intervals + 1)
    _equidistribute(mesh, nodes, rule(degree).top, result)
    return result


def require_segments(segments: int) -> None:
    """Raise InputError for an invalid number of segments."""
    if not (isinstance(segments, int | np.integer) and segments >= 1):
        raise InputError(f"segments = {segments!r} must be a whole number of at least 1.")


def require_mesh(intervals: int, degree: int) -> None:
    """Raise :class:`InputError` unless this many intervals of this degree can be used."""
    if not (isinstance(intervals, int | np.integer) and intervals >= 2):
        raise InputError(f"intervals = {intervals!r} must be a whole number of at least 2.")
    if not (isinstance(degree, int | np.integer) and 2 <= degree <= 7):
        raise InputError(f"degree = {degree!r} must be a whole number from 2 to 7.")
