"""Estimates of the next kink of the forces, by what is known at the begin of a step.

A step that has failed as forces change within it is tried again so that it ends there. Nodes move
on by their velocities, accelerations and the rates of these. It is an estimate, and nothing depends
on its accuracy.
"""

import math

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.functions import copysign
from fecontact.core.simd.vectors import select, somewhere
from fecontact.integrate.rodas5p import dynamics
from fecontact.integrate.rodas5p.state import CAUTIOUS
from fecontact.integrate.rodas5p.step_length import LAST_STEP, REJECTED_LAST
from fecontact.system import nodes
from fecontact.system.node_forces import normal_force

# Accelerations are compared over this part of the time that is looked ahead.
_PART = 1e-3
# Steps end rather a little too far than too short. Where the time of a kink is in doubt by more
# than a part of the time that is looked ahead, or a step that ended beyond it has been too far, as
# with stiff contacts, they end too early: by a part of that time, and by so many times the doubt.
# The rest is then known better, and a short step leads over the kink.
_BEYOND, _SHORT = 1.00001, 1e-3
_LARGEST_DOUBT, _DOUBTS = 1e-5, 2.0
# A step that failed though it ended at a kink is not tried again; its kink lies beyond this part.
_BEFORE = 0.99
# Nearer kinks, as parts of the step that failed, would shrink the steps without end: they are left
# to the error control. Those that a step has ended before may be so near.
_NEAREST, _VERY_NEAR = 1e-4, 1e-6
# Where a step fails at such a kink, one of that length leads over it, but only where the failed one
# and the last one that was taken were longer by this factor.
_LONGER = 10.0
# Times are improved by less than this part of them.
_LARGEST_CHANGE = 0.5
# Forces are looked at before they end, while this part of the time is left, then its square.
_TRIALS, _LEFT = 2, 0.1


@helper
def up_to_kink(t, target, stop, smallest, moved, problem, progress, workspace):
    """End of a step from t towards ``target``, and its caution.

    The latter is that of :class:`fecontact.integrate.rodas5p.state.Step`.

    After a step that has failed it is at the next kink of the forces that lies ahead. ``moved`` is
    the motion of the ground just after t, and ``stop`` the latest end. ``workspace.given`` and
    ``workspace.load`` are overwritten then.
    """
    caution = progress.numbers[CAUTIOUS]
    if somewhere(caution != 0.0):
        numbers = progress.numbers
        limit, failed = abs(caution), numbers[REJECTED_LAST] != 0.0
        reach = max(target - t, limit)
        kink, doubt = _next_kink(t, stop, reach, caution > 0.0, moved, problem, progress, workspace)
        least, too_far = _SHORT * reach, (caution < 0.0) & failed
        short = (too_far | (doubt > _LARGEST_DOUBT * reach)) & (kink > 2.0 * least)
        gap = min(max(least, _DOUBTS * doubt), 0.5 * kink)
        length = select(short, kink - gap, _BEYOND * kink)
        nearest = min(limit, target - t) * select(caution < 0.0, _VERY_NEAR, _NEAREST)
        nearest = max(nearest, 100.0 * smallest)
        over = (length <= nearest) & failed & (
            _LONGER * nearest < min(limit, numbers[LAST_STEP]))
        cut = (limit > 0.0) & (kink < _BEFORE * reach) & (over | (length > nearest))
        length = select(over, nearest, length)
        target = select(cut, min(t + length, stop), target)
        caution = select(cut, select(short | too_far, -limit, limit), 0.0)
        numbers[CAUTIOUS] = 0.0
    return target, caution


@helper
def caution_after_failure(step):
    """The caution of the next attempt: to end at a kink, or before one that has been too far."""
    too_far = (step.caution > 0.0) & (step.h > 2.0 * _SHORT * step.caution)
    return select(step.caution == 0.0, step.h, select(too_far, -step.caution, 0.0))


@routine
def _next_kink(t, stop, within, slips, moved, problem, progress, workspace):
    """Time until the forces of a node change their character, or ``within``, and its doubt.

    Where it seems to be earlier than ``within``, it is looked for anew with the rates of the
    accelerations. If these change the time by a part, what is left out changes it by about the
    square of that. ``slips`` says if forces of friction count.
    """
    blocks, w, between = problem.blocks, workspace.nodes, workspace.between
    dynamics.project(blocks, progress.state, w[0], w[1])
    dynamics.project(blocks, progress.rate, w[1], w[2])
    for k in range(between.shape[1]):
        between[1, k] = 0.0
    first = _first_of_nodes(within, slips, moved, False, problem, workspace)
    better = first
    if somewhere(first < within):
        _set_rate_of_rate(min(t + _PART * within, stop), t, problem, progress, workspace)
        dynamics.project(blocks, workspace.base, between[0], between[1])
        better = _first_of_nodes(within, slips, moved, True, problem, workspace)
    change = better - first
    return better, change * change / better


@routine
def _set_rate_of_rate(later, t, problem, progress, workspace):
    """Fill ``workspace.base`` with y'', as the difference of y' until a little later."""
    s, base, given, load = problem.system, workspace.base, workspace.given, workspace.load
    duration = later - t
    for k in range(len(base)):
        workspace.stage[k] = progress.state[k] + duration * progress.rate[k]
    dynamics.set_given(later, s, given, load)
    dynamics.set_rate(workspace.stage, s, problem.blocks, given, load, workspace.slots,
                      workspace.scratch, base)
    for k in range(len(base)):
        base[k] = (base[k] - progress.rate[k]) / duration


@routine
def _first_of_nodes(within, slips, moved, improve, problem, workspace):
    """The first time at which forces of a node change their character, or ``within`` if later.

    These are touch-down and lift-off on level ground, the penetrations ``control.depth`` (n,),
    normal forces that fall to zero, and slip velocities that fall to ``control.slow`` (n,) of
    either sign under friction without memory. With ``improve`` rates of the accelerations count.
    """
    s, w = problem.system, workspace.nodes
    depth, slow = problem.control.depth, problem.control.slow
    n, d = len(s.gap), s.rows.shape[1]
    first = within
    for j in range(n):
        row = n + j
        motion = (-w[0, row] - s.gap[j], -w[1, row], -w[2, row], -workspace.between[1, row])
        first = _crossing(motion, improve, first)
        first = _crossing((motion[0] - depth[j], motion[1], motion[2], motion[3]), improve,
                          first)
        force = normal_force(j, motion[0], motion[1], s)
        first = _letting_go(j, force, motion, improve, s, first)
        if s.memory[j] == 0:
            changes = nodes.motion_at(j, w[1], w[2], n, d)
            slip = nodes.slip_velocity(j, changes.places, moved, s)
            slowing = _slowing(slip, changes.speeds, slow[j], first)
            first = select(slips & (force[0] > 0.0), slowing, first)
    return first


@helper
def _later(motion, time):
    """Value, rate and second rate at a time of what has a value and three rates at time zero."""
    value, rate, second, third = motion
    return (value + time * (rate + time * (0.5 * second + time * third / 6.0)),
            rate + time * (second + 0.5 * time * third), second + time * third)


@helper
def _improved(time, better):
    """The ``better`` time if it is near the first one."""
    return select(abs(better - time) < _LARGEST_CHANGE * time, better, time)


@helper
def _crossing(motion, improve, within):
    """The first time at which a value with three rates is zero, or ``within`` if that is earlier.

    It is the root without the third rate, and is improved for that. Roots that do not exist are no
    numbers, which no comparison holds for.
    """
    u, v, a = motion[:3]
    q = -(v + copysign(math.sqrt(v * v - 2.0 * a * u), v))
    one, other, time = q / a, 2.0 * u / q, within
    time = select((one > 0.0) & (one < time), one, time)
    time = select((other > 0.0) & (other < time), other, time)
    if improve and somewhere(time < within):
        value, rate, _ = _later(motion, time)
        time = select(time < within, _improved(time, time - value / rate), time)
    return min(time, within)


@helper
def _letting_go(j, there, motion, improve, s, within):
    """The time at which the normal force of a node falls to zero, or ``within`` if earlier.

    ``there`` is the force now, and its derivatives to penetration and rate.
    """
    force, stiffness, damping = there
    time = -force / (stiffness * motion[1] + damping * motion[2])
    falls = (force > 0.0) & (time > 0.0) & (time < within)
    if improve and somewhere(falls):
        left = _LEFT
        for _ in range(_TRIALS):
            before = (1.0 - left) * time
            left *= _LEFT
            value, rate, second = _later(motion, before)
            force, stiffness, damping = normal_force(j, value, rate, s)
            better = before - force / (stiffness * rate + damping * second)
            time = select(force > 0.0, _improved(time, better), time)
    return select(falls, min(time, within), within)


@helper
def _slowing(slip, rates, slow, within):
    """The time at which a slip velocity falls to ``slow``, or ``within`` if that is earlier."""
    size = nodes.size_of(slip)
    towards = -(slip[0] * rates[0] + slip[1] * rates[2])
    time = (size - slow) * size / towards
    return select((size > 1.5 * slow) & (towards > 0.0) & (time < within), time, within)
