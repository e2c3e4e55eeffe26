"""Compiled transitions at rigid stops with friction: impacts, closed stops, sticking clusters.

Impacts follow Newton's law in the form of Moreau or Poisson's law, with normal impulses L_j of the
touching nodes, tangential ones P_c of the clusters, penetration rates u' and slip velocities s:

    Newton    0 <= L_j  complementary to  -(u'+ + e max(u'-, 0)) >= 0,
              P_c in Sgn(s+ + e_T s-) sum mu_j L_j
    Poisson   compression: Newton's law with e = e_T = 0, impulses L^C; then expansion from there:
              0 <= L_j - e L_j^C  complementary to  -u'+ >= 0,  P_c in Sgn(s+) sum mu_j L_j

mu_j is that of the slip velocity before the impact. Closed stops beside those that are struck take
part. After an impact, or where a force has reached its limit, the same conditions for forces and
accelerations tell which stops stay closed and which clusters stick; where they have no solution,
or several, the run ends (Painleve's paradox).

References
----------
J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM Courses and
Lectures 302 (1988). F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley
1996. P. Painleve, Sur les lois du frottement de glissement, Comptes Rendus 121 (1895).
"""

# Compiled functions: their types are those of their signatures for numba.

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, routine
from fecontact.core.copies import put
from fecontact.core.records import Vector
from fecontact.integrate.nonsmooth.contact_conditions import (
    Conditions,
    friction_limit,
    new_case,
    solve_conditions,
    solve_uniquely,
)
from fecontact.integrate.nonsmooth.equations import (
    coupling,
    derivative,
    force_size,
    held_row,
    hold,
    pushing_row,
    residual,
    set_prescribed,
    slipping_force,
    speed_rate,
    stick_limit,
)
from fecontact.integrate.nonsmooth.event_search import ROUNDING, Workspace
from fecontact.integrate.nonsmooth.problem import (
    CLOSED,
    FIXED,
    GAINED,
    GRIP,
    HELD,
    IMPACTS,
    OPEN,
    PENETRATION,
    RATE,
    RATE_SIZE,
    SLIP_SIZE,
    SLOPE,
    STICK,
    Evaluation,
    NonsmoothProblem,
    Progress,
)
from fecontact.integrate.nonsmooth.steps.flights import begin_flight
from fecontact.laws.friction_curve import CREEP
from fecontact.system.nodes import ground_motion
from fecontact.system.powers import (
    BELT_FRICTION,
    BELT_NORMAL,
    CONTACT_DAMPING,
    FRICTION,
    POWER_COUNT,
    belt_normal_power,
)

# Returned instead of a time of flight, which is zero at least.
NO_ACCELERATION, NO_IMPULSES = -1.0, -2.0
# Slip velocities below this part of the largest are none, energies gained rounding.
_NEAR, _GAIN = 1e-9, 1e-10
# Rounding of penetration rates relative to the largest slip velocity or rate.
RATE_ROUNDING = 1e-14
# Corrections of the places of stops that close or open.
_MOST_CORRECTIONS = 5


class Rebound(NamedTuple):
    """Rebounds after which a stop closes if a force presses it.

    Their penetration rate is at most ``slow`` [m/s], or they are lower than the rounding of the
    ``height`` [m], or shorter than the time ``brief`` [s].
    """

    slow: float
    height: float
    brief: float


class Moment(NamedTuple):
    """A moment at which contacts change: its time, what a run knows of it, and Y' there.

    ``near`` is a slip velocity that counts as none [m/s]; ``struck`` says that a node had an
    impact.
    """

    t: float
    problem: NonsmoothProblem
    progress: Progress
    workspace: Workspace
    evaluation: Evaluation
    rates: Vector
    near: float
    struck: bool


CHANGE = Callable[[
    float, NonsmoothProblem, Progress, Workspace, Evaluation, Rebound, Vector,
], float]
change_contacts_at = function_at(CHANGE)


@routine
def _place(t, p, progress, workspace, w, out):
    """Move stops that are touched or part onto their ground, by Newton's method.

    The correction ends where it no longer halves the largest distance; w and ``out`` are those at
    the end.
    """
    Y, status, closed = progress.state, progress.status, progress.closed
    before = math.inf
    for _ in range(_MOST_CORRECTIONS):
        count, distance = 0, 0.0
        for j in range(len(p.cluster)):
            if workspace.touched[j] or workspace.parting[j]:
                w.indices[count], w.right[count] = j, w.nodes[j, PENETRATION]
                distance = max(distance, abs(w.nodes[j, PENETRATION]))
                count += 1
        if distance == 0.0 or distance > 0.5 * before:
            break
        w.friction[:] = 0.0
        hold(count, p, w, Y)
        derivative(t, Y, p, status, closed, w, out)
        before = distance


@routine
def settle(t, p, status, closed, w, out, Y):
    """Change q' so that closed stops do not sink and sticking clusters do not slip."""
    n, _, m = p.system.rows.shape
    if not closed.any():
        return
    derivative(t, Y, p, status, closed, w, out)
    count = 0
    for j in range(n):
        if closed[j]:
            w.indices[count], w.right[count] = j, w.nodes[j, RATE]
            count += 1
    for c in range(len(p.rows)):
        if status[c] == STICK:
            w.indices[count], w.right[count] = n + c, -w.slip[c]
            count += 1
    w.friction[:] = 0.0
    hold(count, p, w, Y[m : 2 * m])


@routine
def _size(sizes, p, w):
    """Largest size of the terms of a penetration or a slip from those of the modes, ``sizes``."""
    m = len(sizes)
    largest = 0.0
    for a in range(len(p.cluster) + len(p.rows)):
        total = 0.0
        for i in range(m):
            total += abs(held_row(a, i, p, w)) * sizes[i]
        largest = max(largest, total)
    return largest


@routine
def _conditions(touching, sizes, status, p, w):
    """Conditions of contact at the touching nodes, all of whose clusters may stick or slip.

    Clusters on which friction has no effect are left out. Coefficients are those of the slip
    velocities in w; nothing is given yet. ``sizes`` (m,) are those of the terms of modal velocities
    or accelerations.
    """
    n, k = len(p.cluster), len(p.rows)
    matrix, mode = np.empty((n + k, n + k)), np.zeros(k, np.int64)
    sticking, slipping = np.zeros(n), np.zeros(n)
    w.friction[:] = 0.0
    for a in range(n + k):
        for b in range(n + k):
            # Of [-u', -s] by unit impulses.
            matrix[a, b] = coupling(a, b, p, w) if a < n else -coupling(a, b, p, w)
    for j in range(n):
        c = p.cluster[j]
        if touching[j]:
            grip = w.nodes[j, GRIP]
            slipping[j] = slipping_force(j, abs(w.slip[c]), 1.0, grip, p.system)
            sticking[j] = max(stick_limit(j, grip, p),
                              slipping_force(j, CREEP, 1.0, grip, p.system))
            mode[c] = OPEN if status[c] == FIXED else STICK
    return Conditions(matrix, np.zeros(n + k), np.zeros(n), sticking, slipping, p.cluster,
                      touching, mode, _size(sizes, p, w))


@routine
def _strike(t, touching, p, progress, w):
    """Change q' by the impact of the touching nodes, as w sees them; whether it was solved.

    Its losses go to the works of normal damping and friction; that of friction never falls.
    """
    s, Y = p.system, progress.state
    n, _, m = s.rows.shape
    k = len(p.rows)
    conditions = _conditions(touching, np.abs(Y[m : 2 * m]), progress.status, p, w)
    case = new_case(n, k)
    given, x = conditions.given, np.zeros(n + k)
    # An impact knows one coefficient, whether its contact sticks or slips.
    put(conditions.slipping, conditions.sticking)
    poisson = p.poisson != 0
    for j in range(n):
        rate = w.nodes[j, RATE]
        given[j] = -rate if poisson else -(rate + p.restitution[j] * max(rate, 0.0))
    for c in range(k):
        given[n + c] = -w.slip[c] if poisson else -(1.0 + p.tangential[c]) * w.slip[c]
    if not solve_conditions(conditions, case):
        return False
    put(case.x, x)
    if poisson:
        put(case.y, given)
        for j in range(n):
            conditions.least[j] = p.restitution[j] * case.x[j]
        if not solve_conditions(conditions, case):
            return False
        x += case.x

    speed, first = ground_motion(t, s).speed, 2 * m
    energy, lost = 0.0, 0.0
    w.friction[:] = 0.0
    mean = 0.5 * (conditions.matrix @ x)
    for i in range(m):
        energy += 0.5 * Y[m + i] * Y[m + i]
    for a in range(n + k):
        for i in range(m):
            Y[m + i] += pushing_row(a, i, p, w) * x[a]
    for j in range(n):
        c = p.cluster[j]
        slip, damped = w.slip[c], x[j] * (w.nodes[j, RATE] - mean[j])
        lost += damped
        Y[first + CONTACT_DAMPING] += damped
        if progress.status[c] != FIXED:
            slip -= mean[n + c]
            limit = friction_limit(c, conditions.slipping, conditions, x)
            if limit > 0.0:
                rubbed = x[n + c] * conditions.slipping[j] * x[j] / limit
                Y[first + BELT_FRICTION] -= rubbed * s.sliding[j, 0, 0] * speed
                # Where normal impulses turn slip round, friction may give energy back in part.
                worn = max(rubbed * slip, 0.0)
                Y[first + FRICTION] += worn
                Y[first + POWER_COUNT + j] += worn
                Y[first + CONTACT_DAMPING] += rubbed * slip - worn
                lost += rubbed * slip
        Y[first + BELT_NORMAL] += belt_normal_power(x[j], w.nodes[j, SLOPE], slip,
                                                    s.sliding[j, 0, 0] * speed, s)
    if lost < -_GAIN * energy:
        progress.counts[GAINED] += 1
    return True


@routine
def _set_gaining(t, p, progress, workspace, w, out):
    """Fill ``workspace.gaining`` from w and Y' in ``out`` before contacts change."""
    Y, status = progress.state, progress.status
    m = p.rows.shape[1]
    speed, ground = ground_motion(t, p.system).speed, speed_rate(t, p)
    for c in range(len(p.rows)):
        size = abs(p.sliding[c] * speed)
        for i in range(m):
            size += abs(p.rows[c, i] * Y[m + i])
        gain = -residual(len(p.cluster) + c, ground, out[m : 2 * m], p, w)
        changes = workspace.released[c] or workspace.arrived[c]
        slips = (status[c] == 1 or status[c] == -1) and not changes
        workspace.gaining[c] = ROUNDING * size if slips and status[c] * gain > 0.0 else math.inf


@routine
def _accelerate(moment, resting, fall, case):
    """Fill a case with the forces that ``fall`` (n,), u'' without contact, asks for.

    Whether there is one solution. A slip velocity below ``moment.near`` counts as none, unless the
    cluster slips ever faster; after a strike only clusters without slip may stick.
    """
    p, progress, workspace = moment.problem, moment.progress, moment.workspace
    w, near, struck = moment.evaluation, moment.near, moment.struck
    n, k = len(p.cluster), len(p.rows)
    status, friction = progress.status, False
    sizes = np.empty(p.rows.shape[1])
    set_prescribed(moment.t, p.system, w)
    for i in range(len(sizes)):
        sizes[i] = force_size(i, progress.state, w.applied_forces, p.system)
    conditions = _conditions(resting, sizes, status, p, w)
    ground = speed_rate(moment.t, p)
    for j in range(n):
        conditions.given[j] = -fall[j]
    for c in range(k):
        conditions.given[n + c] = residual(n + c, ground, workspace.rate, p, w)
        if conditions.mode[c] != STICK:
            continue
        friction = True
        least = max(workspace.gaining[c], RATE_ROUNDING / _NEAR * near if struck else 0.0)
        still = abs(w.slip[c]) <= near and not status[c] * w.slip[c] > least
        if workspace.released[c] and still:
            conditions.mode[c] = status[c]
        elif not (still or (not struck and (status[c] == STICK or workspace.arrived[c]))):
            conditions.mode[c] = 1 if w.slip[c] > 0.0 else -1
    for c in range(k):
        workspace.held[c] = conditions.mode[c] == STICK
        workspace.fresh[c] = workspace.held[c] or workspace.released[c]
    return solve_uniquely(conditions, case) if friction else solve_conditions(conditions, case)


@routine
def _decide(touching, rebound, moment):
    """Decide which touching stops stay closed and which clusters stick; see `change_contacts`."""
    t, p, progress, workspace = moment.t, moment.problem, moment.progress, moment.workspace
    w, out = moment.evaluation, moment.rates
    s, Y, status, closed = p.system, progress.state, progress.status, progress.closed
    n, _, m = s.rows.shape
    k = len(p.rows)
    kept = closed == HELD
    closed[:] = 0
    # Without contact.
    derivative(t, Y, p, np.where(status == FIXED, FIXED, OPEN), closed, w, out)
    put(out[m : 2 * m], workspace.rate[:m])
    ground = speed_rate(t, p)
    fall, resting = np.empty(n), np.zeros(n, np.bool_)
    w.friction[:] = 0.0
    for j in range(n):
        fall[j] = residual(j, ground, workspace.rate, p, w)
        blurred = (30.0 * math.sqrt(2.2e-16 * rebound.height * abs(fall[j]))
                   + rebound.brief * abs(fall[j]))
        resting[j] = (touching[j] and not workspace.parting[j]
                      and abs(w.nodes[j, RATE]) <= max(rebound.slow, blurred))
    case = new_case(n, k)
    if not _accelerate(moment, resting, fall, case):
        return NO_ACCELERATION
    flight = math.inf
    for j in range(n):
        pressed = case.pressed[j] and case.x[j] > 0.0
        closed[j] = CLOSED if resting[j] and (pressed or kept[j]) else 0
        workspace.fresh[k + j] = touching[j] and closed[j] == 0
        if workspace.fresh[k + j] and fall[j] > 0.0:
            flight = min(flight, max(0.0, -2.0 * w.nodes[j, RATE] / fall[j]))
    begun = status.copy()
    for c in range(k):
        if status[c] == FIXED:
            continue
        status[c] = OPEN
        for j in range(n):
            if closed[j] and p.cluster[j] == c:
                status[c] = case.mode[c]
        workspace.fresh[c] = workspace.fresh[c] and (status[c] == 1 or status[c] == -1)
        # Slip that begins here starts from zero slip velocity.
        begun[c] = STICK if workspace.fresh[c] else status[c]
    settle(t, p, begun, closed, w, out, Y)
    derivative(t, Y, p, status, closed, w, out)
    noise = RATE_ROUNDING / _NEAR * moment.near
    for j in range(n):
        if closed[j]:
            workspace.flights.young[j] = False
        elif touching[j]:
            begin_flight(j, noise, p, w, workspace)
        elif moment.struck and abs(w.nodes[j, RATE]) > noise:
            workspace.flights.climb[j] = -w.nodes[j, RATE]
    return flight


def _change_contacts(t, p, progress, workspace, w, rebound, out):
    """Impact of ``workspace.touched`` nodes, then which stops stay closed and which clusters stick.

    An approach at a penetration rate within rounding is stopped, but is no impact;
    ``workspace.touched`` tells afterwards which nodes had one.
    ``workspace.parting`` nodes were closed and lift off, ``workspace.released`` clusters begin to
    slip in the sense of their status, ``workspace.arrived`` ones have come to rest; HELD stops that
    rest close. After an impact, stops close whose rebound is within ``rebound``.

    Returns the longest flight that a rebound may take [s], infinite if none, NO_ACCELERATION or
    NO_IMPULSES, and fills ``out`` with Y'.
    """
    Y, status, closed, largest = progress.state, progress.status, progress.closed, progress.largest
    n = len(p.cluster)
    touching = np.zeros(n, np.bool_)
    derivative(t, Y, p, status, closed, w, out)
    _set_gaining(t, p, progress, workspace, w, out)
    near = max(largest[SLIP_SIZE], largest[RATE_SIZE])
    for c in range(len(p.rows)):
        near = max(near, abs(w.slip[c]))
    for j in range(n):
        touching[j] = workspace.touched[j] or closed[j] or workspace.parting[j]
        if workspace.touched[j]:
            near = max(near, abs(w.nodes[j, RATE]))
    _place(t, p, progress, workspace, w, out)
    approached, struck = False, False
    for j in range(n):
        rate = w.nodes[j, RATE] if workspace.touched[j] else 0.0
        approached = approached or rate > 0.0
        workspace.touched[j] = rate > RATE_ROUNDING * near
        struck = struck or workspace.touched[j]
        progress.counts[IMPACTS] += 1 if workspace.touched[j] else 0
    if approached and not _strike(t, touching, p, progress, w):
        return NO_IMPULSES
    return _decide(touching, rebound,
                   Moment(t, p, progress, workspace, w, out, _NEAR * near, struck))


compiled_change = compile_law(
    CHANGE, "change_contacts(t, p, progress, workspace, w, rebound, out)", _change_contacts)
