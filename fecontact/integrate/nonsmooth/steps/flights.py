r"""Compiled heights of flights that have just begun at stops on level ground.

A brief flight may rise less than the rounding of places, or even of velocities. Its height g is
therefore the double integral of its acceleration from the moment at which the stop opened:

.. math::

    g(t) = g_0 + g'_0 (t - t_0) + \int_{t_0}^t (t - \tau)\, g''(\tau)\, d\tau

over each step, until places tell it from zero.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.records import Flags
from fecontact.core.types import Array
from fecontact.integrate.bernstein import NOWHERE, first_below, from_nested, value
from fecontact.integrate.nonsmooth.dop853 import DENSE, PARTS, SLOPES, STAGES, B
from fecontact.integrate.nonsmooth.equations import force_size, place_size
from fecontact.integrate.nonsmooth.problem import PENETRATION, RATE, RATE_SIZE
from fecontact.system.nodes import NODES

# Rounding of an acceleration relative to its terms, and heights that places tell from zero,
# relative to the places.
_ROUNDING, _CLEAR = 1e-15, 2e-12
# The same relative to errors of places at the begin of a flight.
_ABOVE = 10.0
# Looks before a landing at which the height may be above zero, and halvings between these.
_LOOKS, _HALVINGS = 64, 50
# The tick of a problem in longest steps.
_TICK = 1e-4


class Flights(NamedTuple):
    """Whether flights have just begun, their heights and the rates of these, (n,).

    ``sunk`` is how far places were from the stop where they began.
    """

    young: Annotated[Flags, NODES]
    height: Annotated[Array, NODES]
    climb: Annotated[Array, NODES]
    sunk: Annotated[Array, NODES]


@helper
def begin_flight(j, noise, p, w, workspace):
    """Begin a flight at a stop that has just opened, as w sees it; rates below ``noise`` are none.

    Its height is counted from where it is, up to rounding and the errors of the steps at rest.
    """
    level, rate = p.relief[2] == np.inf or not p.system.on_ground[j], w.nodes[j, RATE]
    flights = workspace.flights
    flights.young[j], flights.height[j] = level, 0.0
    flights.climb[j] = -rate if -rate > noise else 0.0
    flights.sunk[j] = abs(w.nodes[j, PENETRATION])


@helper
def _acceleration_size(j, p, progress, w, workspace):
    """Size of the terms of the acceleration of the height of stop j."""
    s, Y = p.system, progress.state
    m, total = s.rows.shape[2], 0.0
    for i in range(m):
        size = force_size(i, Y, w.applied_forces, s) + abs(workspace.slopes[0, m + i])
        total += abs(s.rows[j, 1, i]) * size
    return total


@routine
def _rise(j, step, p, progress, w, workspace):
    """Fill ``workspace.heights`` with Bernstein coefficients of a young flight over the step.

    Coefficients of its rate go into ``workspace.along``. Returns the rounding of the height at the
    end.
    """
    row, c, h = p.system.rows[j, 1], workspace.nested, step.h
    node_acceleration = workspace.node_acceleration
    rate, heights, m = workspace.along, workspace.heights, p.rows.shape[1]
    for k in range(SLOPES):
        node_acceleration[k] = 0.0
        for i in range(m):
            node_acceleration[k] += row[i] * workspace.slopes[k, m + i]
    change = 0.0
    for k in range(STAGES):
        change += h * B[k] * node_acceleration[k]
    c[0], c[1] = workspace.flights.climb[j], change
    c[2] = h * node_acceleration[0] - change
    c[3] = 2.0 * change - h * (node_acceleration[STAGES] + node_acceleration[0])
    for q in range(len(DENSE)):
        c[4 + q] = 0.0
        for k in range(SLOPES):
            c[4 + q] += h * DENSE[q, k] * node_acceleration[k]
    from_nested(c, rate)
    heights[0] = workspace.flights.height[j]
    for k in range(PARTS + 1):
        heights[k + 1] = heights[k] + h / (PARTS + 1) * rate[k]
    # Prescribed values have the rounding of the time, a speed that of the largest so far.
    return (_ROUNDING * (1.0 + _TICK * abs(step.t) / p.tick)
            * _acceleration_size(j, p, progress, w, workspace) * h * h
            + _ROUNDING * progress.largest[RATE_SIZE] * h)


@routine
def first_landing(j, step, p, progress, w, workspace):
    """First part of the step at which a young flight is at its end; NOWHERE if it is not.

    A fall below the rounding of the height tells that it has ended, its height when.
    """
    rounding = _rise(j, step, p, progress, w, workspace)
    heights, scratch = workspace.heights, workspace.halves[0]
    for i in range(len(heights)):
        heights[i] += rounding
    high = first_below(heights, workspace.halves)
    if high > 1.0:
        return NOWHERE
    for look in range(_LOOKS):
        low = high * (1.0 - (look + 1) / _LOOKS)
        if value(heights, low, scratch) <= rounding:
            continue
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if value(heights, middle, scratch) > rounding:
                low = middle
            else:
                high = middle
        break
    return high


@routine
def advance(part, step, p, progress, w, workspace):
    """Take young flights up to a part of the step, of which ``workspace`` knows."""
    s, Y, flights = p.system, progress.state, workspace.flights
    for j in range(len(flights.young)):
        if not flights.young[j]:
            continue
        _rise(j, step, p, progress, w, workspace)
        size = place_size(j, Y, p)
        for i in range(p.rows.shape[1]):
            size += abs(s.rows[j, 1, i] * workspace.parts[0, i])
        flights.height[j] = max(value(workspace.heights, part, workspace.halves[0]), 0.0)
        flights.climb[j] = value(workspace.along, part, workspace.halves[0])
        flights.young[j] = flights.height[j] <= _CLEAR * size + _ABOVE * flights.sunk[j]
