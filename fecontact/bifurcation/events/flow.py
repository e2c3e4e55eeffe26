"""Compiled motion with friction and stops whose states are kept: which stick, slip, touch.

Between two events a set-valued system is smooth: sticking clusters and closed stops are
constraints, and what slips keeps its sense. Here this motion goes on beyond its own end too, and
backwards, so that it is a smooth function of its start and of its duration. Its derivatives go
through the same steps of the method of order 8 (the variational equations at its stages); those of
the equations are differences of fourth order, taken to one side where a slip velocity would
change its sign.
"""

# Compiled functions: their types are those of their signatures for numba.

import math

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.integrate.nonsmooth.dop853 import ERROR_3, ERROR_5, STAGES, A, B, C
from fecontact.integrate.nonsmooth.equations import (
    derivative,
    held_row,
    pushing_row,
    slipping_force,
)
from fecontact.integrate.nonsmooth.event_search import Room
from fecontact.integrate.nonsmooth.problem import (
    CREEP,
    FORCE,
    GRIP,
    PENETRATION,
    RATE,
    SLIP,
    STICK,
    NonsmoothProblem,
    Progress,
    Workspace,
)
from fecontact.integrate.nonsmooth.rigid_stops import change_contacts_at
from fecontact.integrate.nonsmooth.transitions import decide_clusters
from fecontact.laws.signatures import normal_at

# Step of differences, in sizes of the states or in the longest step, and their weights: to both
# sides from -2 to 2, to one from 0 to 4.
PART = 3e-4
_BOTH = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
_ONE = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
_SHORTEST = 1e-13
# Penetration at first contact [m].
_FIRST = 1e-100


@helper
def _rates(t, y, p, status, closed, w, full, rate, out):
    d = len(out)
    for i in range(d):
        full[i] = y[i]
    derivative(t, full, p, status, closed, w, rate)
    for i in range(d):
        out[i] = rate[i]


@helper
def _direction(i, step, p, status, w):
    """0 if slip keeps its sense two steps to both sides of state i, else the side to which."""
    m = p.rows.shape[1]
    if i < m:
        return 0
    side, least = 0, math.inf
    for c in range(len(p.rows)):
        change = p.rows[c, i - m] * step
        if (status[c] == 1 or status[c] == -1) and change != 0.0:
            left = status[c] * w.slip[c] - 2.0 * abs(change)
            if left < 0.0 and left < least:
                side, least = (1 if status[c] * change > 0.0 else -1), left
    return side


@helper
def _add_differences(t, y, p, above, below, change, sizes, tick, status, closed, w, full, rate,
                     around, near, out):
    """Fill out (d, d + 2) with the derivatives of the rates: by states, time and parameter."""
    d = len(y)
    out[:] = 0.0
    _rates(t, y, p, status, closed, w, full, rate, near)
    for i in range(d):
        step = PART * sizes[i]
        side = _direction(i, step, p, status, w)
        for k in range(5):
            weight = _BOTH[k] if side == 0 else _ONE[k] * side
            if weight == 0.0:
                continue
            around[:] = y
            around[i] += step * (k - 2 if side == 0 else k * side)
            _rates(t, around, p, status, closed, w, full, rate, near)
            for j in range(d):
                out[j, i] += weight * near[j] / step
        # The slip velocities at y itself, for the next state.
        _rates(t, y, p, status, closed, w, full, rate, near)
    if tick > 0.0:
        for k in range(5):
            if _BOTH[k] != 0.0:
                _rates(t + (k - 2) * tick, y, p, status, closed, w, full, rate, near)
                for j in range(d):
                    out[j, d] += _BOTH[k] * near[j] / tick
    _rates(t, y, above, status, closed, w, full, rate, near)
    for j in range(d):
        out[j, d + 1] += near[j] / (2.0 * change)
    _rates(t, y, below, status, closed, w, full, rate, near)
    for j in range(d):
        out[j, d + 1] -= near[j] / (2.0 * change)


@helper
def _stages(t, h, y, p, status, closed, w, full, rate, places, slopes):
    """Fill the states and slopes of all stages of a step, the last of which is its end."""
    d = len(y)
    for stage in range(STAGES + 1):
        for i in range(d):
            total = 0.0
            for k in range(stage):
                total += (A[stage, k] if stage < STAGES else B[k]) * slopes[k, i]
            places[stage, i] = y[i] + h * total
        node = C[stage] if stage < STAGES else 1.0
        _rates(t + node * h, places[stage], p, status, closed, w, full, rate, slopes[stage])


@helper
def _error(h, sizes, rtol, slopes):
    """Error of a step in what is allowed, rtol times the sizes of the states."""
    fifth, third = 0.0, 0.0
    for i in range(len(sizes)):
        five, three = 0.0, 0.0
        for k in range(STAGES + 1):
            five += ERROR_5[k] * slopes[k, i]
            three += ERROR_3[k] * slopes[k, i]
        allowed = rtol * sizes[i]
        if not (math.isfinite(five) and math.isfinite(three)):
            return math.inf
        fifth, third = max(fifth, abs(five) / allowed), max(third, abs(three) / allowed)
    if fifth == 0.0:
        return 0.0
    return abs(h) * fifth * fifth / math.sqrt(fifth * fifth + 0.01 * third * third)


@kernel(nogil=True)
def flow(
    p: NonsmoothProblem, above: NonsmoothProblem, below: NonsmoothProblem,
    w: Workspace, change: float, tick: float, limits: Vector, begin: float, longest: float,
    times: Vector, start: Vector, status: IntegerVector, closed: IntegerVector, sizes: Vector,
    full: Vector, rate: Vector, states: Matrix, slopes: Matrix,
) -> int:
    """Fill ``states`` (N, d) at ``times`` (N,) after ``begin``, all of one sign and ascending in
    size; 1 if that fails, else 0.

    ``limits`` is (rtol,). Unless it has no rows, ``slopes`` (d, d + 2) becomes the derivative of
    the last state by the start, by the time ``begin``, and by the parameter, which ``above`` and
    ``below`` change by ``change`` to either side; ``tick`` is the step of differences in time, 0
    for equations that do not depend on it. ``full`` and ``rate`` are room for a state.
    """
    d = len(start)
    y, around, near = start.copy(), np.empty(d), np.empty(d)
    places, stages = np.empty((STAGES + 1, d)), np.empty((STAGES + 1, d))
    J, moved = np.empty((d, d + 2)), np.empty((d, d + 2))
    varied = np.empty((STAGES, d, d + 2))
    derivatives = len(slopes) > 0
    if derivatives:
        slopes[:] = 0.0
        for i in range(d):
            slopes[i, i] = 1.0
    t, span = 0.0, abs(times[-1])
    sign = 1.0 if times[-1] >= 0.0 else -1.0
    h = min(longest, span)
    for row in range(len(times)):
        while t != times[row]:
            left = abs(times[row] - t)
            reaching = h >= left * (1.0 - 1e-10)
            length = sign * (left if reaching else h)
            _stages(begin + t, length, y, p, status, closed, w, full, rate, places, stages)
            size = _error(length, sizes, limits[0], stages)
            if not size <= 1.0:
                h = abs(length) * (max(0.2, 0.9 * size**-0.125) if math.isfinite(size) else 0.1)
                if h < _SHORTEST * (span + abs(begin)):
                    return 1
                continue
            if derivatives:
                for stage in range(STAGES):
                    _add_differences(begin + t + C[stage] * length, places[stage], p, above, below,
                                     change, sizes, tick, status, closed, w, full, rate, around,
                                     near, J)
                    for i in range(d):
                        for j in range(d + 2):
                            moved[i, j] = slopes[i, j]
                            for k in range(stage):
                                moved[i, j] += length * A[stage, k] * varied[k, i, j]
                    for i in range(d):
                        for j in range(d + 2):
                            total = J[i, j] if j >= d else 0.0
                            for k in range(d):
                                total += J[i, k] * moved[k, j]
                            varied[stage, i, j] = total
                for i in range(d):
                    for j in range(d + 2):
                        for k in range(STAGES):
                            slopes[i, j] += length * B[k] * varied[k, i, j]
            y[:] = places[STAGES]
            t = times[row] if reaching else t + length
            grown = min(5.0, max(0.5, 0.9 * max(size, 1e-12) ** -0.125)) * abs(length)
            # A step that was cut at a time does not shorten the next one.
            h = min(longest, max(h, grown) if reaching else grown)
        states[row] = y
    return 0


@helper
def _pressed(j, p, w):
    """Normal force of a node on compliant contact; where it is open, below zero and smooth.

    The law without its limit, of damping that is proportional to the speed, and for a height what
    it would push at that penetration.
    """
    s = p.system
    force, depth, rate = w.nodes[j, FORCE], w.nodes[j, PENETRATION], w.nodes[j, RATE]
    if force > 0.0:
        return force
    law = normal_at(s.normal[j])
    if depth > 0.0:
        return (2.0 * law(depth, 0.0, s.normal_parameters[j])[0]
                - law(depth, abs(rate), s.normal_parameters[j])[0])
    return -law(-depth, max(-rate, 0.0), s.normal_parameters[j])[0]


@kernel
def observe(
    p: NonsmoothProblem, w: Workspace, times: Vector, states: Matrix,
    status: IntegerVector, closed: IntegerVector, full: Vector, rate: Vector, margins: Matrix,
    rates: Matrix,
) -> None:
    """Fill what clusters and stops have left, (N, 2 k + n), and the rates (N, d), at states (N, d).

    Of a cluster c that slips the speed in its sense at 2 c and, on compliant contact, its normal
    force at 2 c + 1; of one that sticks what its force has left to either side; of a closed stop j
    and of a node on compliant contact its force at 2 k + j, of an open stop its height. The rest is
    infinite. The force of an open node is what its law would pull.
    """
    clusters, n = len(p.rows), len(p.cluster)
    for row in range(len(times)):
        _rates(times[row], states[row], p, status, closed, w, full, rate, rates[row])
        margins[row] = np.inf
        for c in range(clusters):
            if status[c] == STICK:
                margins[row, 2 * c] = w.limit[c] - w.total[c]
                margins[row, 2 * c + 1] = w.limit[c] + w.total[c]
            elif status[c] == 1 or status[c] == -1:
                margins[row, 2 * c] = status[c] * w.slip[c]
                if p.rigid == 0:
                    margins[row, 2 * c + 1] = w.pressing[c]
                    if not w.pressing[c] > 0.0:
                        margins[row, 2 * c + 1] = -np.inf
        for j in range(n):
            place = 2 * clusters + j
            if p.rigid != 0:
                margins[row, place] = w.nodes[j, FORCE] if closed[j] else -w.nodes[j, PENETRATION]
                continue
            margins[row, place] = _pressed(j, p, w)
            c = p.cluster[j]
            if (status[c] == 1 or status[c] == -1) and not margins[row, 2 * c + 1] > 0.0:
                margins[row, 2 * c + 1] = max(margins[row, 2 * c + 1], margins[row, place])


@kernel
def strike_rows(
    p: NonsmoothProblem, w: Workspace, t: float, state: Vector, status: IntegerVector,
    closed: IntegerVector, full: Vector, rate: Vector, held: Matrix, pushing: Matrix,
    speeds: Vector, coefficients: Vector,
) -> None:
    """What an impact needs: rows held (n + k, m), pushing (n + k, m) of unit impulses, penetration
    rates and slip velocities (n + k,), and coefficients of friction (n,) at these.
    """
    clusters, n, m = len(p.rows), len(p.cluster), p.rows.shape[1]
    _rates(t, state, p, status, closed, w, full, rate, rate[: len(state)].copy())
    w.friction[:] = 0.0
    for a in range(n + clusters):
        for i in range(m):
            held[a, i], pushing[a, i] = held_row(a, i, p, w), pushing_row(a, i, p, w)
    for j in range(n):
        slip = w.nodes[j, SLIP]
        speeds[j] = w.nodes[j, RATE]
        coefficients[j] = slipping_force(j, abs(slip), 1.0, w.nodes[j, GRIP], p.system)
    for c in range(clusters):
        speeds[n + c] = w.slip[c]


@kernel
def decide(
    p: NonsmoothProblem, w: Workspace, progress: Progress, room: Room,
    t: float, near: float, slow: float,
) -> float:
    """Change the contact state at a moment as a run does; NO_ACCELERATION or NO_IMPULSES where that
    is impossible, else the time of a flight.

    What ``room`` marks changes: see :func:`fecontact.integrate.nonsmooth.rigid_stops` and
    :func:`fecontact.integrate.nonsmooth.transitions.decide_clusters`.
    """
    if p.rigid != 0:
        return change_contacts_at(p.change)(t, p, progress, room, w, slow, 0.0, 0.0,
                                            room.slopes[0])
    decide_clusters(t, p, progress, room, near, w, room.slopes[0])
    return 0.0


@kernel
def forces_of_touch(p: NonsmoothProblem, out: Vector) -> None:
    """Fill out (n,) with the normal forces at first contact of dashpots, at a unit rate."""
    for j in range(len(out)):
        law = normal_at(p.system.normal[j])
        out[j] = (law(_FIRST, 1.0, p.system.normal_parameters[j])[0]
                  - law(_FIRST, 0.0, p.system.normal_parameters[j])[0])


@kernel
def kinetic_coefficients(p: NonsmoothProblem, out: Vector) -> None:
    """Fill out (n,) with the coefficients of friction at the begin of slip."""
    for j in range(len(out)):
        out[j] = slipping_force(j, CREEP, 1.0, 1.0, p.system)
