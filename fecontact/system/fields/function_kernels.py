"""Compiled loops over many states for a vector field that is given by its address."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel
from fecontact.core.copies import put
from fecontact.core.records import (
    Block,
    ComplexMatrix,
    ComplexVector,
    IntegerVector,
    Matrix,
    Vector,
)
from fecontact.core.types import Array

RATES = Callable[[float, Vector, Vector, Vector], None]
JACOBIAN = Callable[[float, Vector, Vector, Matrix], None]
COMPLEX_RATES = Callable[[float, ComplexVector, ComplexVector, ComplexVector], None]

rates_at = function_at(RATES)
jacobian_at = function_at(JACOBIAN)
complex_rates_at = function_at(COMPLEX_RATES)

# Step of the complex step: its square is lost against one.
_TINY = 1e-30
# Widest step of extrapolated differences, and step of those with which the complex step is
# compared, relative to the state or parameter, or to its scale if that is larger. No powers of two:
# these might be periods of the function.
_WIDEST, _CHECK = 2.1e-3, 2.3e-4
# Widest step of the differences that confirm others, in that of the others.
_NARROWER = 0.137
# Halvings of the widest step: enough for a function that changes over 1e-9 of the scale.
_LEVELS = 36
# Places beside the state at which the rounding of the rates is measured.
_PROBES = 16
# Relative error of the complex step that is let pass.
_RIGHT = 1e-7
_EPS = 2.220446049250313e-16


class Places(NamedTuple):
    """Points at which derivatives are computed, and which derivatives.

    Attributes
    ----------
    t, x, f : (N,), (N, d), (N, d) arrays
        Times, states, and the rates there.
    p : (k,) array
        Parameters.
    scales, sizes : (d,), (k,) arrays
        Typical sizes of states and parameters.
    active : (a,) integer array
        Parameters to which derivatives are wanted.
    states : bool
        Whether derivatives to the states are wanted.
    """

    t: Vector
    x: Matrix
    f: Matrix
    p: Vector
    scales: Vector
    sizes: Vector
    active: IntegerVector
    states: bool


class Place(NamedTuple):
    """One place: time, state and parameters that may be moved, and the rates there."""

    t: float
    y: Array
    q: Array
    f: Array


class Workspace(NamedTuple):
    """Workspace for one place; ``best`` and ``error`` (d,) are results of differences."""

    y: Vector
    q: Vector
    above: Vector
    below: Vector
    orders: Matrix
    best: Vector
    error: Vector
    column: Vector


@helper
def _extrapolated(function, place, moved, at, size, workspace):
    """Fill ``workspace.best`` with the derivative to ``moved[at]``, an entry of the place's y or q.

    Central differences over steps h that are halved again and again, extrapolated to order six.
    The error is the change from order four to order six, and rounding; the step with the least
    counts, for each rate, and is kept in ``workspace.orders[3]``. What lies between x - h and x + h
    is seen by f at x: a second difference that does not fall with h^2 shows a function that changes
    over less than h. Once a rate has converged, stop at the first step at which its error grows:
    over shorter ones only rounding is seen, and none at all where it keeps f from changing.
    """
    t, y, q, f = place
    above, below, orders, best, error = (workspace.above, workspace.below, workspace.orders,
                                         workspace.best, workspace.error)
    value, h = moved[at], _WIDEST * size
    for i in range(len(f)):
        best[i], error[i], orders[4, i] = np.nan, np.inf, 0.0
    for level in range(_LEVELS):
        moved[at] = value + h
        function(t, y, q, above)
        moved[at] = value - h
        function(t, y, q, below)
        width = (value + h) - (value - h)
        if not width > 0.0:
            break
        done, largest = level > 1, 0.0
        for i in range(len(f)):
            if abs(best[i]) > largest:
                largest = abs(best[i])
        for i in range(len(f)):
            change = above[i] - below[i]
            of_two = change / width
            of_four = (4.0 * of_two - orders[0, i]) / 3.0
            of_six = (16.0 * of_four - orders[1, i]) / 15.0
            size_f = max(abs(above[i]), abs(below[i]), abs(f[i]))
            noise = 4.0 * _EPS * size_f / h
            second = above[i] + below[i] - 2.0 * f[i]
            unseen = abs(second - orders[2, i]) - 0.1 * abs(orders[2, i]) - 0.01 * abs(change) \
                - 16.0 * _EPS * size_f
            off = abs(of_six - of_four) + noise + max(unseen, 0.0) / h
            if off > 2.0 * error[i] and error[i] <= 1e-6 * abs(best[i]) + 1e-12 * largest:
                orders[4, i] = 1.0
            if level > 1 and off < error[i] and orders[4, i] == 0.0:
                best[i], error[i], orders[3, i] = of_six, off, h
            if not (off <= 2.0 * noise or orders[4, i] == 1.0):
                done = False
            orders[0, i], orders[1, i], orders[2, i] = of_two, of_four, 0.25 * second
        if done:
            break
        h *= 0.5
    moved[at] = value


@helper
def _roughness(function, place, moved, at, size, workspace):
    """Fill ``workspace.orders[0]`` with how much the rates jump beside x.

    That is their rounding, cancellation included. It shows in second differences over steps, 1e-6
    and less, over which the function is straight. Rates that hardly depend on the value, and are
    rounded to something large that cancels, change by whole units of this rounding or not at all:
    where short steps change nothing, the least change is that unit. Where none changes anything,
    states and parameters tell what may cancel.
    """
    t, y, q = place.t, place.y, place.q
    above, below, orders = workspace.above, workspace.below, workspace.orders
    value, h = moved[at], _WIDEST * size
    for i in range(len(above)):
        orders[0, i] = 0.0
    for sample in range(_PROBES):
        place, part = value + h, 1e-9 * 4.0 ** (sample % 6) * size
        moved[at] = place
        function(t, y, q, above)
        for i in range(len(above)):
            orders[1, i] = -2.0 * above[i]
        moved[at] = place + part
        function(t, y, q, above)
        moved[at] = place - part
        function(t, y, q, below)
        for i in range(len(above)):
            jump = abs(above[i] + below[i] + orders[1, i])
            if jump > orders[0, i]:
                orders[0, i] = jump
        h *= -0.4
    for i in range(len(above)):
        orders[1, i], orders[2, i] = 1.0, np.inf
    part = _WIDEST * size
    while part > 1e-13 * size:
        moved[at] = value + part
        function(t, y, q, above)
        moved[at] = value - part
        function(t, y, q, below)
        for i in range(len(above)):
            change = abs(above[i] - below[i])
            orders[1, i] = min(orders[1, i], change)
            if 0.0 < change < orders[2, i]:
                orders[2, i] = change
        part *= 0.25
    hidden = max(np.abs(y).max(), np.abs(q).max()) if len(q) else np.abs(y).max()
    for i in range(len(above)):
        if orders[1, i] == 0.0:
            unit = orders[2, i] if orders[2, i] < np.inf else 64.0 * _EPS * hidden
            orders[0, i] = max(orders[0, i], unit)
    moved[at] = value


@helper
def _correct(function, place, moved, at, size, workspace):
    """Put differences into ``workspace.column`` where the complex step is wrong; True if it is."""
    t, y, q, f = place
    above, below, best, error, column = (workspace.above, workspace.below, workspace.best,
                                         workspace.error, workspace.column)
    value, h = moved[at], _CHECK * size
    moved[at] = value + h
    function(t, y, q, above)
    moved[at] = value - h
    function(t, y, q, below)
    moved[at] = value
    width = (value + h) - (value - h)
    right = True
    for i in range(len(f)):
        change = above[i] - below[i]
        noise = 64.0 * _EPS * (abs(above[i]) + abs(below[i]) + abs(f[i]))
        seen = abs(above[i] + below[i] - 2.0 * f[i]) <= 0.01 * abs(change) + noise
        near = abs(column[i] * width - change) <= _RIGHT * abs(change) + noise
        right = right and seen and near
    if right:
        return False
    # Where the function is not smooth within the widest step, such as beside the end of a root, the
    # change from order to order may vanish by accident: differences over other steps must agree.
    _extrapolated(function, place, moved, at, _NARROWER * size, workspace)
    for i in range(len(f)):
        workspace.orders[5, i] = best[i]
    _extrapolated(function, place, moved, at, size, workspace)
    wrong, largest = False, 0.0
    for i in range(len(f)):
        error[i] += abs(best[i] - workspace.orders[5, i])
        off = abs(column[i] - best[i])
        if error[i] < np.inf:
            largest = max(largest, abs(best[i]))
            if not off <= 4.0 * error[i] + _RIGHT * abs(best[i]):
                wrong = True
    if not wrong:
        return False
    _roughness(function, place, moved, at, size, workspace)
    orders = workspace.orders
    wrong = False
    for i in range(len(f)):
        off = abs(column[i] - best[i])
        # A derivative that is zero within rounding is another one in complex arithmetic.
        rough = 4.0 * error[i] + 16.0 * orders[0, i] / orders[3, i] + 1e-12 * largest
        if error[i] < np.inf and not off <= rough + _RIGHT * abs(best[i]):
            column[i] = best[i]
            wrong = True
    return wrong


@helper
def columns_by_complex_step(function, analytic, place, scales, workspace, complex_workspace, J,
                            wrong):
    """Fill J (d, d) at a place by the complex step; ``wrong`` counts columns put right.

    The workspaces hold the state and the parameters of the place.
    """
    x, d = place.y, len(J)
    z, w = complex_workspace[0, :d], complex_workspace[1, : len(place.q)]
    out = complex_workspace[2, :d]
    column = workspace.column
    for j in range(d):
        z[j] = complex(x[j], _TINY)
        analytic(place.t, z, w, out)
        z[j] = x[j]
        for i in range(d):
            column[i] = out[i].imag / _TINY
        size = max(abs(x[j]), scales[j])
        if _correct(function, place, place.y, j, size, workspace):
            wrong[j] += 1
        for i in range(d):
            J[i, j] = column[i]


@helper
def columns_by_differences(function, place, x, scales, workspace, J):
    """Fill J (d, d) by differences; ``workspace`` holds the state x and the parameters."""
    best = workspace.best
    for j in range(len(x)):
        size = max(abs(x[j]), scales[j])
        _extrapolated(function, place, place.y, j, size, workspace)
        for i in range(len(x)):
            J[i, j] = best[i]


@kernel
def batch_rates(address: int, t: Vector, x: Matrix, p: Vector, f: Matrix) -> None:
    """Fill f (N, d)."""
    function = rates_at(address)
    for k in range(len(t)):
        function(t[k], x[k], p, f[k])


@kernel
def batch_jacobians(address: int, t: Vector, x: Matrix, p: Vector, J: Block) -> None:
    """Fill J (N, d, d) by the function that gives one."""
    function = jacobian_at(address)
    for k in range(len(t)):
        function(t[k], x[k], p, J[k])


@kernel
def complex_steps(
    address: int, complex_address: int, places: Places, workspace: Workspace,
    complex_workspace: ComplexMatrix, J: Block, P: Block, wrong: IntegerVector,
) -> None:
    """Fill J (N, d, d) if wanted, and P (N, d, a), by the complex step.

    Each column is compared with differences, which take the place of what differs from them:
    ``wrong`` (d + a,) counts the places at which that is so, by columns of J and P.
    ``complex_workspace`` is that of :func:`complex_workspace_for`.
    """
    function, complex_function = rates_at(address), complex_rates_at(complex_address)
    t, x, p, active, column = places.t, places.x, places.p, places.active, workspace.column
    d, k = x.shape[1], len(p)
    y, q = workspace.y, workspace.q
    z, w, out = complex_workspace[0, :d], complex_workspace[1, :k], complex_workspace[2, :d]
    put(p, q)
    for a in range(k):
        w[a] = p[a]
    wrong[:] = 0
    for n in range(len(t)):
        place = Place(t[n], y, q, places.f[n])
        for i in range(d):
            z[i], y[i] = x[n, i], x[n, i]
        if places.states:
            columns_by_complex_step(function, complex_function, place, places.scales, workspace,
                                    complex_workspace, J[n], wrong)
        for a in range(len(active)):
            at = active[a]
            w[at] = complex(p[at], _TINY)
            complex_function(t[n], z, w, out)
            w[at] = p[at]
            for i in range(d):
                column[i] = out[i].imag / _TINY
            size = max(abs(p[at]), places.sizes[at])
            if _correct(function, place, q, at, size, workspace):
                wrong[d + a] += 1
            for i in range(d):
                P[n, i, a] = column[i]


@kernel
def differences(address: int, places: Places, workspace: Workspace, J: Block, P: Block) -> None:
    """Fill J (N, d, d) if wanted, and P (N, d, a), by extrapolated central differences."""
    function = rates_at(address)
    t, x, p, active, best = places.t, places.x, places.p, places.active, workspace.best
    d = x.shape[1]
    y, q = workspace.y, workspace.q
    put(p, q)
    for n in range(len(t)):
        place = Place(t[n], y, q, places.f[n])
        for i in range(d):
            y[i] = x[n, i]
        if places.states:
            columns_by_differences(function, place, x[n], places.scales, workspace, J[n])
        for a in range(len(active)):
            at = active[a]
            size = max(abs(p[at]), places.sizes[at])
            _extrapolated(function, place, q, at, size, workspace)
            for i in range(d):
                P[n, i, a] = best[i]


@kernel
def central_differences(
    address: int, places: Places, step: float, q: Vector, beside: Matrix, J: Block, P: Block,
) -> None:
    """Fill J (N, d, d) if wanted, and P (N, d, a), by central differences over one step in sizes.

    ``q`` (k,) and ``beside`` (3, d) are workspace.
    """
    function = rates_at(address)
    t, x, p, active = places.t, places.x, places.p, places.active
    d = x.shape[1]
    y, above, below = beside[0], beside[1], beside[2]
    put(p, q)
    for n in range(len(t)):
        for i in range(d):
            y[i] = x[n, i]
        for j in range(d if places.states else 0):
            h = step * places.scales[j]
            y[j] = x[n, j] + h
            function(t[n], y, q, above)
            y[j] = x[n, j] - h
            function(t[n], y, q, below)
            y[j] = x[n, j]
            for i in range(d):
                J[n, i, j] = (above[i] - below[i]) / (2.0 * h)
        for a in range(len(active)):
            at = active[a]
            h = step * places.sizes[at]
            q[at] = p[at] + h
            function(t[n], y, q, above)
            q[at] = p[at] - h
            function(t[n], y, q, below)
            q[at] = p[at]
            for i in range(d):
                P[n, i, a] = (above[i] - below[i]) / (2.0 * h)


@kernel
def unchecked_complex_steps(
    complex_address: int, places: Places, complex_workspace: ComplexMatrix, J: Block, P: Block,
) -> None:
    """Fill J and P as :func:`complex_steps`, without the comparison with differences.

    The comparison takes nearly all of the time of :func:`complex_steps`.
    """
    complex_function = complex_rates_at(complex_address)
    t, x, p, active = places.t, places.x, places.p, places.active
    d, k = x.shape[1], len(p)
    z, w, out = complex_workspace[0, :d], complex_workspace[1, :k], complex_workspace[2, :d]
    for a in range(k):
        w[a] = p[a]
    for n in range(len(t)):
        for i in range(d):
            z[i] = x[n, i]
        for j in range(d if places.states else 0):
            z[j] = complex(x[n, j], _TINY)
            complex_function(t[n], z, w, out)
            z[j] = x[n, j]
            for i in range(d):
                J[n, i, j] = out[i].imag / _TINY
        for a in range(len(active)):
            at = active[a]
            w[at] = complex(p[at], _TINY)
            complex_function(t[n], z, w, out)
            w[at] = p[at]
            for i in range(d):
                P[n, i, a] = out[i].imag / _TINY


def workspace_for(states: int, parameters: int) -> Workspace:
    """Workspace for a function of so many states and parameters."""
    y, above, below, best, error, column = np.empty((6, states))
    return Workspace(y, np.empty(parameters), above, below, np.empty((6, states)), best, error,
                     column)


def complex_workspace_for(states: int, parameters: int) -> NDArray[np.complex128]:
    """Workspace (3, max(d, k)) for the complex step of such a function."""
    return np.empty((3, max(states, parameters)), dtype=complex)
