"""Compiled loops over many states for a vector field that is given by its address."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import borrowing, helper, kernel
from fecontact.core.copies import put
from fecontact.core.records import (
    Block,
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
# Ways to form derivatives: the complex step, compared with differences or not; differences that are
# extrapolated, or over one step.
COMPLEX, UNCHECKED, EXTRAPOLATED, ONE_STEP = range(4)
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


class Steps(NamedTuple):
    """How derivatives are formed, from the addresses of the rates of real and complex numbers.

    One ``step`` is in the typical sizes, others are in the larger of these and the entry.
    """

    way: int
    step: float
    rates: int
    complex_rates: int


class Place(NamedTuple):
    """One place: time, state and parameters that may be moved, and the rates there."""

    t: float
    y: Array
    q: Array
    f: Array


class Workspace(NamedTuple):
    """Workspace for one place, whose state is y and z, and whose parameters are q and w.

    ``best`` and ``error`` (d,) are results of differences.
    """

    y: Vector
    q: Vector
    above: Vector
    below: Vector
    orders: Matrix
    best: Vector
    error: Vector
    z: ComplexVector
    w: ComplexVector
    out: ComplexVector


@helper
def _set_beside(function, place, moved, at, h, workspace):
    """Fill ``above`` and ``below`` with the rates at ``moved[at]`` + h and - h; their distance."""
    value = moved[at]
    moved[at] = value + h
    function(place.t, place.y, place.q, workspace.above)
    moved[at] = value - h
    function(place.t, place.y, place.q, workspace.below)
    moved[at] = value
    return (value + h) - (value - h)


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
    f, h = place.f, _WIDEST * size
    above, below, orders, best, error = (workspace.above, workspace.below, workspace.orders,
                                         workspace.best, workspace.error)
    for i in range(len(f)):
        best[i], error[i], orders[4, i] = np.nan, np.inf, 0.0
    for level in range(_LEVELS):
        width = _set_beside(function, place, moved, at, h, workspace)
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


@helper
def _roughness(function, place, moved, at, size, workspace):
    """Fill ``workspace.orders[0]`` with how much the rates jump beside x.

    That is their rounding, cancellation included. It shows in second differences over steps, 1e-6
    and less, over which the function is straight. Rates that hardly depend on the value, and are
    rounded to something large that cancels, change by whole units of this rounding or not at all:
    where short steps change nothing, the least change is that unit. Where none changes anything,
    states and parameters tell what may cancel.
    """
    y, q = place.y, place.q
    above, below, orders = workspace.above, workspace.below, workspace.orders
    value, h = moved[at], _WIDEST * size
    for i in range(len(above)):
        orders[0, i] = 0.0
    for sample in range(_PROBES):
        moved[at] = value + h
        function(place.t, y, q, above)
        for i in range(len(above)):
            orders[1, i] = -2.0 * above[i]
        part = 1e-9 * 4.0 ** (sample % 6) * size
        _set_beside(function, place, moved, at, part, workspace)
        for i in range(len(above)):
            jump = abs(above[i] + below[i] + orders[1, i])
            if jump > orders[0, i]:
                orders[0, i] = jump
        h *= -0.4
    moved[at] = value
    for i in range(len(above)):
        orders[1, i], orders[2, i] = 1.0, np.inf
    part = _WIDEST * size
    while part > 1e-13 * size:
        _set_beside(function, place, moved, at, part, workspace)
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


@helper
def _correct(function, place, moved, at, size, workspace, column):
    """Put differences into ``column`` (d,) where the complex step is wrong; True if it is."""
    f = place.f
    above, below, best, error = (workspace.above, workspace.below, workspace.best,
                                 workspace.error)
    width = _set_beside(function, place, moved, at, _CHECK * size, workspace)
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
def move_to(x, p, workspace):
    """Set state and parameters of the workspace, real and complex."""
    put(x, workspace.y)
    put(x, workspace.z)
    put(p, workspace.q)
    put(p, workspace.w)


@helper
def set_column(steps, place, moved, shifted, at, scale, workspace, column):
    """Fill ``column`` (d,) with the derivative to ``moved[at]``, an entry of the place's y or q.

    ``shifted`` is z or w. True if a complex step was wrong, and differences take its place.
    """
    function, size = rates_at(steps.rates), max(abs(moved[at]), scale)
    if steps.way == EXTRAPOLATED:
        _extrapolated(function, place, moved, at, size, workspace)
        put(workspace.best, column)
        return False
    if steps.way == ONE_STEP:
        h = steps.step * scale
        _set_beside(function, place, moved, at, h, workspace)
        for i in range(len(column)):
            column[i] = (workspace.above[i] - workspace.below[i]) / (2.0 * h)
        return False
    shifted[at] = complex(moved[at], _TINY)
    complex_rates_at(steps.complex_rates)(place.t, workspace.z, workspace.w, workspace.out)
    shifted[at] = moved[at]
    for i in range(len(column)):
        column[i] = workspace.out[i].imag / _TINY
    return steps.way == COMPLEX and _correct(function, place, moved, at, size, workspace, column)


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


@borrowing
def _fill_columns(steps, places, workspace, J, P, wrong):
    x, active, y, q, z, w = (places.x, places.active, workspace.y, workspace.q, workspace.z,
                             workspace.w)
    d = x.shape[1]
    for n in range(len(x)):
        move_to(x[n], places.p, workspace)
        place = Place(places.t[n], y, q, places.f[n])
        for c in range(0 if places.states else d, d + len(active)):
            if c < d:
                at, scale, moved, shifted, column = c, places.scales[c], y, z, J[n, :, c]
            else:
                at = active[c - d]
                scale, moved, shifted, column = places.sizes[at], q, w, P[n, :, c - d]
            if set_column(steps, place, moved, shifted, at, scale, workspace, column):
                wrong[c] += 1


@kernel
def fill_derivatives(
    steps: Steps, places: Places, workspace: Workspace, J: Block, P: Block, wrong: IntegerVector,
) -> None:
    """Fill J (N, d, d) if wanted, and P (N, d, a), by central differences or the complex step.

    ``wrong`` (d + a,) counts the places at which differences took the place of a complex step, by
    columns of J and P.
    """
    wrong[:] = 0
    _fill_columns(steps, places, workspace, J, P, wrong)


def workspace_for(states: int, parameters: int) -> Workspace:
    """Workspace for a function of so many states and parameters."""
    y, above, below, best, error = np.empty((5, states))
    z, out = np.empty((2, states), dtype=complex)
    return Workspace(y, np.empty(parameters), above, below, np.empty((6, states)), best, error, z,
                     np.empty(parameters, dtype=complex), out)
