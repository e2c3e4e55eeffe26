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
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.copies import put
from fecontact.core.records import ANY, Matrix, Size, Vector
from fecontact.core.types import Array, Integers
from fecontact.integrate.nonsmooth.dop853 import (
    ERROR_3,
    ERROR_5,
    STAGES,
    A,
    B,
    C,
    shortened,
)
from fecontact.integrate.nonsmooth.equations import (
    derivative,
    held_row,
    pushing_row,
    slipping_force,
)
from fecontact.integrate.nonsmooth.event_search import Workspace
from fecontact.integrate.nonsmooth.problem import (
    CLUSTERS,
    FORCE,
    GRIP,
    PENETRATION,
    RATE,
    SLIP,
    STICK,
    WITH_WORK,
    ContactState,
    Evaluation,
    NonsmoothProblem,
    Progress,
)
from fecontact.integrate.nonsmooth.rigid_stops import Rebound, change_contacts_at
from fecontact.integrate.nonsmooth.transitions import decide_clusters
from fecontact.integrate.step_loop import (
    COUNTS,
    FAILED,
    NOT_A_NUMBER,
    OUTPUTS,
    RUNNING,
    STEP,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.laws.friction_curve import CREEP
from fecontact.system.node_forces import normal_force
from fecontact.system.nodes import MODES, NODES

# Step of differences, in sizes of the states or in the longest step, and their weights: to both
# sides from -2 to 2, to one from 0 to 4.
PART = 3e-4
_BOTH = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
_ONE = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
_SHORTEST = 1e-13


# Number of states, and that of the directions of derivatives: states, time and parameter.
STATES = Size("states")
DIRECTIONS = STATES + 2


class RatesWorkspace(NamedTuple):
    """Workspace of the rates at a state: what acts there; a state with its work, and its rates."""

    evaluation: Evaluation
    full: Annotated[Array, WITH_WORK]
    rate: Annotated[Array, WITH_WORK]


@helper
def _rates(t, y, p, contact, workspace, out):
    """Fill out (d,) with the rates of the states y (d,) at a time."""
    d = len(out)
    for i in range(d):
        workspace.full[i] = y[i]
    derivative(t, workspace.full, p, contact.status, contact.closed, workspace.evaluation,
               workspace.rate)
    for i in range(d):
        out[i] = workspace.rate[i]


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


class Given(NamedTuple):
    """A motion with friction and stops whose states are kept.

    Attributes
    ----------
    problem, above, below : NonsmoothProblem
        The system, and that with the parameter changed by ``change`` to either side.
    tick : float
        Step of differences in time [s], 0 for equations that do not depend on it.
    rtol, longest : float
        Tolerance, and longest step [s].
    begin, sign : float
        Time at the begin [s]; -1 for a motion backwards. Times of the run are sizes of the times
        since then.
    contact : ContactState
        The state that is kept.
    sizes : (d,) array
        Sizes of the states.
    """

    problem: NonsmoothProblem
    above: NonsmoothProblem
    below: NonsmoothProblem
    change: float
    tick: float
    rtol: float
    longest: float
    begin: float
    sign: float
    contact: ContactState
    sizes: Annotated[Array, STATES]


class Reached(NamedTuple):
    """State that a motion has reached."""

    numbers: Annotated[Array, STEP + 1]
    counts: Annotated[Integers, COUNTS]
    state: Annotated[Array, STATES]


class Rows(NamedTuple):
    """Times (N,), ascending, and states (N, d) at these."""

    times: Vector
    states: Annotated[Array, ANY, STATES]


class FlowWorkspace(NamedTuple):
    """Workspace of a step: rates, stages and derivatives."""

    rates: RatesWorkspace
    around: Annotated[Array, STATES]
    near: Annotated[Array, STATES]
    places: Annotated[Array, STAGES + 1, STATES]
    stages: Annotated[Array, STAGES + 1, STATES]
    J: Annotated[Array, STATES, DIRECTIONS]
    moved: Annotated[Array, STATES, DIRECTIONS]
    varied: Annotated[Array, STAGES, STATES, DIRECTIONS]


class Data(NamedTuple):
    """A motion that is followed.

    Unless it has no rows, ``slopes`` (d, d + 2) is the derivative of the state by that at the
    start, by the time ``begin``, and by the parameter.
    """

    given: Given
    progress: Reached
    output: Rows
    slopes: Matrix
    workspace: FlowWorkspace


class Step(NamedTuple):
    """A step that is tried; ``wanted`` is the length it should have had."""

    t: float
    h: float
    target: float
    wanted: float


@routine
def _add_differences(t, y, given, workspace):
    """Fill ``workspace.J`` with the derivatives of the rates: by states, time and parameter."""
    p, near, around, out, d = given.problem, workspace.near, workspace.around, workspace.J, len(y)
    contact, work = given.contact, workspace.rates
    out[:] = 0.0
    for i in range(d + 1 if given.tick > 0.0 else d):
        step, side, moment = given.tick, 0, t
        if i < d:
            step = PART * given.sizes[i]
            # The slip velocities at y itself.
            _rates(t, y, p, contact, work, near)
            side = _direction(i, step, p, contact.status, work.evaluation)
        for k in range(5):
            weight = _BOTH[k] if side == 0 else _ONE[k] * side
            if weight == 0.0:
                continue
            offset = step * (k - 2 if side == 0 else k * side)
            put(y, around)
            if i < d:
                around[i] += offset
            else:
                moment = t + offset
            _rates(moment, around, p, contact, work, near)
            for j in range(d):
                out[j, i] += weight * near[j] / step
    _rates(t, y, given.above, contact, work, near)
    for j in range(d):
        out[j, d + 1] += near[j] / (2.0 * given.change)
    _rates(t, y, given.below, contact, work, near)
    for j in range(d):
        out[j, d + 1] -= near[j] / (2.0 * given.change)


@routine
def _set_stages(t, h, y, given, workspace):
    """Fill the states and slopes of all stages of a step, the last of which is its end."""
    places, slopes = workspace.places, workspace.stages
    for stage in range(STAGES + 1):
        for i in range(len(y)):
            total = 0.0
            for k in range(stage):
                total += (A[stage, k] if stage < STAGES else B[k]) * slopes[k, i]
            places[stage, i] = y[i] + h * total
        node = C[stage] if stage < STAGES else 1.0
        _rates(t + node * h, places[stage], given.problem, given.contact, workspace.rates,
               slopes[stage])


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


@routine
def _begin(t, data):
    """The derivatives are those of the start; a first time after it is left to the steps."""
    slopes = data.slopes
    for i in range(len(slopes)):
        for j in range(len(slopes[0])):
            slopes[i, j] = 1.0 if i == j else 0.0
    data.progress.counts[OUTPUTS] = 1 if data.output.times[0] == 0.0 else 0
    return RUNNING


@routine
def _next_target(t, h, last, smallest, data):
    """The next step to try, of the length h, to the next output at most."""
    goal = data.output.times[data.progress.counts[OUTPUTS]]
    reaching = h >= (goal - t) * (1.0 - 1e-10)
    return Step(t, goal - t if reaching else h, goal if reaching else t + h, h)


@routine
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one."""
    given, workspace, h = data.given, data.workspace, step.h
    _set_stages(given.begin + given.sign * step.t, given.sign * h, data.progress.state, given,
                workspace)
    size = _error(h, given.sizes, given.rtol, workspace.stages)
    if not size <= 1.0:
        shorter = shortened(h, size)
        if shorter < _SHORTEST * (data.output.times[-1] + abs(given.begin)):
            shorter = 0.0
        return FAILED if math.isfinite(size) else NOT_A_NUMBER, shorter
    grown = min(5.0, max(0.5, 0.9 * max(size, 1e-12) ** -0.125)) * h
    # A step that was cut at a time does not shorten the next one.
    return TAKEN, min(given.longest, max(step.wanted, grown) if h < step.wanted else grown)


@routine
def _close(step, writes, data):
    """Carry the derivatives over a step, by the same stages."""
    given, workspace, slopes = data.given, data.workspace, data.slopes
    J, moved, varied, length = workspace.J, workspace.moved, workspace.varied, given.sign * step.h
    d = len(slopes)
    for stage in range(STAGES if d > 0 else 0):
        _add_differences(given.begin + given.sign * step.t + C[stage] * length,
                         workspace.places[stage], given, workspace)
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


@helper
def _fill(row, output, step, data):
    """Fill a row of the output, which is at the end of the step."""
    put(data.workspace.places[STAGES], output.states[row])


@helper
def _go_on(step, h, data):
    """Make the end of the step the state of the motion."""
    put(data.workspace.places[STAGES], data.progress.state)
    return RUNNING, h


METHOD = Method("flow", Data, _next_target, _attempt, _fill, _go_on, _begin, close=_close)
flow = step_loop(METHOD)


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
    if depth > 0.0:
        return 2.0 * normal_force(j, depth, 0.0, s)[0] - normal_force(j, depth, abs(rate), s)[0]
    return -normal_force(j, -depth, max(-rate, 0.0), s)[0]


@kernel
def observe(
    p: NonsmoothProblem, contact: ContactState, workspace: RatesWorkspace, at: Rows,
    margins: Matrix, rates: Matrix,
) -> None:
    """Fill the margins of clusters and stops, (N, 2 k + n), and the rates (N, d), at states (N, d).

    Of a cluster c that slips the speed in its sense at 2 c and, on compliant contact, its normal
    force at 2 c + 1; of one that sticks the margins of its force to either side; of a closed stop j
    and of a node on compliant contact its force at 2 k + j, of an open stop its height. The rest is
    infinite. The force of an open node is what its law would pull.
    """
    clusters, n = len(p.rows), len(p.cluster)
    status, closed, w = contact.status, contact.closed, workspace.evaluation
    for row in range(len(at.times)):
        _rates(at.times[row], at.states[row], p, contact, workspace, rates[row])
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


class StrikeRows(NamedTuple):
    """Constraints at an impact.

    ``held`` (n + k, m) are the rows of the constraints, ``pushing`` (n + k, m) those of unit
    impulses, ``speeds`` (n + k,) the penetration rates and slip velocities, and ``coefficients``
    (n,) those of friction at these.
    """

    held: Annotated[Array, NODES + CLUSTERS, MODES]
    pushing: Annotated[Array, NODES + CLUSTERS, MODES]
    speeds: Annotated[Array, NODES + CLUSTERS]
    coefficients: Annotated[Array, NODES]


@kernel
def set_strike_rows(
    p: NonsmoothProblem, contact: ContactState, workspace: RatesWorkspace, t: float, state: Vector,
    out: StrikeRows,
) -> None:
    """Fill the constraints at an impact in a state (d,)."""
    clusters, n, m = len(p.rows), len(p.cluster), p.rows.shape[1]
    w = workspace.evaluation
    _rates(t, state, p, contact, workspace, workspace.rate[: len(state)].copy())
    w.friction[:] = 0.0
    for a in range(n + clusters):
        for i in range(m):
            out.held[a, i], out.pushing[a, i] = held_row(a, i, p, w), pushing_row(a, i, p, w)
    for j in range(n):
        slip = w.nodes[j, SLIP]
        out.speeds[j] = w.nodes[j, RATE]
        out.coefficients[j] = slipping_force(j, abs(slip), 1.0, w.nodes[j, GRIP], p.system)
    for c in range(clusters):
        out.speeds[n + c] = w.slip[c]


@kernel
def decide(
    p: NonsmoothProblem, w: Evaluation, progress: Progress, workspace: Workspace,
    t: float, near: float, slow: float,
) -> float:
    """Change the contact state at a moment as a run does; NO_ACCELERATION or NO_IMPULSES where that
    is impossible, else the time of a flight.

    What ``workspace`` marks changes: see :func:`fecontact.integrate.nonsmooth.rigid_stops` and
    :func:`fecontact.integrate.nonsmooth.transitions.decide_clusters`.
    """
    if p.rigid != 0:
        return change_contacts_at(p.change)(t, p, progress, workspace, w, Rebound(slow, 0.0, 0.0),
                                            workspace.slopes[0])
    decide_clusters(t, p, progress, workspace, near, w, workspace.slopes[0])
    return 0.0


@kernel
def kinetic_coefficients(p: NonsmoothProblem, out: Vector) -> None:
    """Fill out (n,) with the coefficients of friction at the begin of slip."""
    for j in range(len(out)):
        out[j] = slipping_force(j, CREEP, 1.0, 1.0, p.system)
