"""Compiled loops of collocation over the intervals of a mesh and their Gauss points.

Nodes are (N m, d): the last node of an interval is the first one of the next. Basis values and
slopes are (m, m + 1).
"""

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import Block, Matrix, Vector

# Smallest range of a state to which an error of it is related: in its scale (Newton's method leaves
# errors of 1e-8 of that), in its largest value, and in the largest range of all states.
_LEAST_OF_SCALE, _LEAST_OF_VALUE, _LEAST_OF_ALL = 1e-2, 1e-6, 1e-11
# Part of an interval, in widths of a neighbour, in which the derivative between both counts.
_MOST_REACH = 2.0
# Rate times width of an interval above which an error is not carried on to the next one.
_CARRIED = 8.0


@kernel
def fill_mesh(
    mesh: Vector, points: Vector, scales: Vector, widths: Vector, times: Vector, weights: Vector,
) -> None:
    """Fill widths (N,), times (N m,) of the Gauss points, and weights of the inner product.

    The first d scales are those of the states, the others those of the last unknowns.
    """
    N, m = len(widths), len(points)
    common = len(weights) % (N * m)
    d = (len(weights) - common) // (N * m)
    for j in range(N):
        widths[j] = mesh[j + 1] - mesh[j]
        for k in range(m):
            times[j * m + k] = mesh[j] + widths[j] * points[k]
            for i in range(d):
                weights[(j * m + k) * d + i] = widths[j] / m / scales[i] ** 2
    for k in range(1, common + 1):
        weights[len(weights) - k] = 1.0 / scales[len(scales) - k] ** 2


@kernel
def fill_phase_row(
    nodes: Matrix, gauss_weights: Vector, values: Matrix, slopes: Matrix, row: Vector,
) -> None:
    """Fill row with the nodes' weights (N m d,) in int <x, y'>, y with these nodes, then zeros."""
    m = len(values)
    total, d = nodes.shape
    row[:] = 0.0
    for j in range(total // m):
        for point in range(m):
            for i in range(d):
                rate = 0.0
                for k in range(m + 1):
                    node = j * m + k if j * m + k < total else 0
                    rate += slopes[point, k] * nodes[node, i]
                rate *= gauss_weights[point]
                for k in range(m + 1):
                    node = j * m + k if j * m + k < total else 0
                    row[node * d + i] += values[point, k] * rate


@kernel
def at_points(nodes: Matrix, values: Matrix, slopes: Matrix, x: Matrix, rates: Matrix) -> None:
    """Fill x and rates (N k, d), values and interval-scaled slopes, from nodes (N m, d).

    Basis values and slopes (k, m + 1) are those at k points of an interval.
    """
    points, m = len(values), values.shape[1] - 1
    total, d = nodes.shape
    for j in range(total // m):
        for point in range(points):
            row = j * points + point
            for i in range(d):
                x[row, i] = 0.0
                rates[row, i] = 0.0
            for k in range(m + 1):
                node = j * m + k
                if node == total:
                    node = 0
                value, slope = values[point, k], slopes[point, k]
                for i in range(d):
                    x[row, i] += value * nodes[node, i]
                    rates[row, i] += slope * nodes[node, i]


@kernel
def fill_residual(
    slopes: Matrix, f: Matrix, widths: Vector, T: float, phase_row: Vector, u: Vector, out: Vector,
) -> None:
    """Fill out with slopes - h T f (N m d,) and, where there is room, the phase condition."""
    total, d = f.shape
    m = total // len(widths)
    for j in range(len(widths)):
        step = widths[j] * T
        for row in range(j * m, (j + 1) * m):
            for i in range(d):
                out[row * d + i] = slopes[row, i] - step * f[row, i]
    if len(out) > total * d:
        phase = 0.0
        for k in range(total * d):
            phase += phase_row[k] * u[k]
        out[total * d] = phase


@kernel
def to_nodes(at_points: Matrix, values: Matrix, widths: Vector, out: Matrix) -> None:
    """Fill out (N m, d), the nodes' weights in sum_j h_j sum_c values_ck at_points_jc x_jk."""
    m = len(values)
    total, d = out.shape
    out[:] = 0.0
    for j in range(total // m):
        for point in range(m):
            row = j * m + point
            for k in range(m + 1):
                node = j * m + k
                if node == total:
                    node = 0
                weight = widths[j] * values[point, k]
                for i in range(d):
                    out[node, i] += weight * at_points[row, i]


@kernel
def amplitude_along(weights: Vector, nodes: Matrix, before: Matrix) -> float:
    """Amplitude of nodes (N m, d) about their mean along that of those before, in the latter."""
    total, d = nodes.shape
    mixed, square = 0.0, 0.0
    for i in range(d):
        mean, mean_before = 0.0, 0.0
        for row in range(total):
            mean += nodes[row, i]
            mean_before += before[row, i]
        mean /= total
        mean_before /= total
        for row in range(total):
            weight, other = weights[row * d + i], before[row, i] - mean_before
            mixed += weight * other * (nodes[row, i] - mean)
            square += weight * other * other
    return mixed / square


@helper
def _power(x, m):
    result = x
    for _ in range(1, m):
        result *= x
    return result


@kernel
def fill_ranges(nodes: Matrix, scales: Vector, sizes: Vector) -> None:
    """Fill sizes (d,) with the range of each state, to which its errors are related."""
    most = 0.0
    for i in range(len(sizes)):
        low, high = nodes[0, i], nodes[0, i]
        for node in range(len(nodes)):
            low, high = min(low, nodes[node, i]), max(high, nodes[node, i])
        sizes[i] = max(high - low, _LEAST_OF_VALUE * max(abs(low), abs(high)),
                       _LEAST_OF_SCALE * scales[i])
        most = max(most, high - low)
    for i in range(len(sizes)):
        sizes[i] = max(sizes[i], _LEAST_OF_ALL * most)
        if sizes[i] == 0.0:
            sizes[i] = np.inf


@kernel
def integrate_defect(
    slopes: Matrix, f: Matrix, widths: Vector, T: float, integrals: Matrix, sizes: Vector,
    errors: Vector,
) -> None:
    """Fill errors (N,) with the largest |int (x' - h T f)| / size of all states.

    Infinite where rates are not finite.
    """
    rows, per = integrals.shape
    defect = np.empty(per)
    errors[:] = 0.0
    for j in range(len(widths)):
        for i in range(len(sizes)):
            for c in range(per):
                defect[c] = slopes[j * per + c, i] - widths[j] * T * f[j * per + c, i]
            for row in range(rows):
                value = 0.0
                for c in range(per):
                    value += integrals[row, c] * defect[c]
                # No comparison with NaN is true.
                value = abs(value) / sizes[i]
                if not value <= errors[j]:
                    errors[j] = value if value < np.inf else np.inf


@kernel
def fill_smooth_errors(
    widths: Vector, nodes: Matrix, top: Vector, sizes: Vector, errors: Vector,
) -> None:
    """Fill errors (N,) with the largest h^(m+1) |x^(m+1)| / size of all states.

    The derivative is the larger one of those between an interval and its neighbours, each from the
    jump of that of order m.
    """
    total, d = nodes.shape
    N, m = len(widths), len(top) - 1
    slopes = np.empty(N)
    errors[:] = 0.0
    for i in range(d):
        for j in range(N):
            value = 0.0
            for k in range(m + 1):
                node = j * m + k
                value += top[k] * nodes[node if node < total else 0, i]
            slopes[j] = value / _power(widths[j], m)
        for j in range(N):
            after = j + 1 if j + 1 < N else 0
            jump = abs(slopes[after] - slopes[j]) / sizes[i]
            rate = 2.0 * jump / (widths[j] + widths[after])
            # A derivative resolved by a much narrower neighbour does not span an interval.
            one = min(widths[j], _MOST_REACH * widths[after])
            other = min(widths[after], _MOST_REACH * widths[j])
            errors[j] = max(errors[j], rate * _power(one, m + 1))
            errors[after] = max(errors[after], rate * _power(other, m + 1))


@kernel
def fill_carried(
    slopes: Matrix, f: Matrix, J: Block, widths: Vector, T: float, values: Matrix, ends: Matrix,
    weights: Vector, integrals: Matrix, side: Matrix,
) -> None:
    """Fill side (N m, d), right-hand sides of the collocation rows for errors at ends of intervals.

    Slopes and rates (2 N m, d) at the Gauss points of halves; J (N m, d, d) at those of intervals,
    where values and ``ends`` (m, m + 1) are the basis polynomials and their derivatives.
    """
    m, d = len(weights), side.shape[1]
    per = 2 * m
    mean, filtering = np.empty((d, d)), np.empty((d, d))
    pivots = np.empty(d, dtype=np.int64)
    p, defect = np.empty((m + 1, d)), np.empty((per, d))
    for j in range(len(widths)):
        step = widths[j] * T
        for c in range(per):
            for i in range(d):
                defect[c, i] = slopes[j * per + c, i] - step * f[j * per + c, i]
        # At the Gauss points, and last at the end of the interval.
        for row in range(m + 1):
            place = per + row if row < m else per - 1
            for i in range(d):
                total = 0.0
                for c in range(per):
                    total += integrals[place, c] * defect[c, i]
                p[row, i] = total
        for i in range(d):
            for c in range(d):
                total = 0.0
                for k in range(m):
                    total += weights[k] * J[j * m + k, i, c]
                mean[i, c] = step * total / _CARRIED
        # 1 - 2^(1/2) z + z^2: of modes that vibrate, the amplitude falls with z^2 above one.
        for i in range(d):
            for c in range(d):
                filtering[i, c] = -np.sqrt(2.0) * mean[i, c]
            filtering[i, i] += 1.0
            for k in range(d):
                factor = mean[i, k]
                for c in range(d):
                    filtering[i, c] += factor * mean[k, c]
        factorise(filtering, d, pivots)
        for row in range(m + 1):
            solve(filtering, pivots, p[row])
            solve(filtering, pivots, p[row])
        for k in range(m):
            value, slope = values[k, m], ends[k, m]
            for c in range(d):
                defect[0, c] = step * (p[k, c] - value * p[m, c])
            for i in range(d):
                total = slope * p[m, i]
                for c in range(d):
                    total += J[j * m + k, i, c] * defect[0, c]
                side[j * m + k, i] = total
