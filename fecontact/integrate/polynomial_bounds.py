"""Bounds on the step polynomials, which show that no contact can have changed within a step.

Most steps need no search for changes: a mode deviates from the straight line between its ends by
at most the deviation of its coefficients from that line, and a node by at most the sum over the
modes. For few nodes on flat ground it is cheaper to evaluate the coefficients themselves.
"""

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.simd.vectors import opposite
from fecontact.core.types import Array
from fecontact.integrate.near_nodes import reach_out
from fecontact.integrate.rodas5p import dynamics as motion
from fecontact.integrate.rodas5p import state
from fecontact.integrate.step_polynomials import (
    FASTEST,
    HIGHEST,
    LOWEST,
    QUICKEST,
    SEARCH,
    STEEPEST,
    set_heights,
)
from fecontact.system.nodes import ground_speed

# Largest number of nodes that counts as few.
_FEW = 4


@helper
def coefficient_range(first, last, k1, k2, k3):
    """Smallest and largest coefficient of an interpolant, and whether they are monotonic.

    Of one interpolant, or of eight in SIMD lanes.
    """
    a, c = 0.75 * first + 0.25 * (last + k1), 0.25 * (first + k1 + k2 + k3) + 0.75 * last
    b = 0.5 * (first + last) + k1 * (1.0 / 3.0) + k2 * (1.0 / 6.0)
    low, high = min(min(first, a), min(b, c)), max(max(first, a), max(b, c))
    rising = (first <= a) & (a <= b) & (b <= c) & (c <= last)
    falling = (first >= a) & (a >= b) & (b >= c) & (c >= last)
    return min(low, last), max(high, last), rising | falling


@helper
def _nodes_may_switch(moved, h, s, blocks, control, workspace):
    """Tests of :func:`needs_search` for few nodes on flat ground, without slip of open nodes."""
    levels, ends, nodes, dense = control.levels, workspace.ends, workspace.nodes, workspace.dense
    shapes = blocks.shapes
    n, m = len(s.gap), len(control.largest)
    some = False
    for j in range(n):
        spread = abs(s.sliding[j, 0, 0]) * control.ground[QUICKEST] * h
        passing = ground_speed(0, j, moved, s)
        k1, k2, k3, r1, r2, r3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for span in range(blocks.spans.shape[1]):
            for i in range(blocks.spans[j, span, 0], blocks.spans[j, span, 1]):
                along, away = shapes[i, j], shapes[i, n + j]
                k1 += away * dense[0, i]
                k2 += away * dense[1, i]
                k3 += away * dense[2, i]
                r1 += along * dense[0, m + i]
                r2 += along * dense[1, m + i]
                r3 += along * dense[2, m + i]
        first, last = ends[0, n + j], nodes[0, n + j]
        low, high, monotone = coefficient_range(first, last, k1, k2, k3)
        touching = nodes[2, n + j] != 0.0
        for level in range(levels.shape[0]):
            shift = s.gap[j] + levels[level, j] - control.ground[HIGHEST]
            bottom = low + shift
            at_ends = 2.0 * min(min(first, last) + shift, 0.0)
            mixed = (bottom < 0.0) & (high + shift > 0.0)
            some = some | ((mixed | (bottom < at_ends)) & opposite(monotone))
            touching = touching | (bottom < 0.0) | (level > 0)
        if s.rows.shape[1] > 2:
            continue
        first, last = ends[1, j] - passing, nodes[1, j] - passing
        low, high, monotone = coefficient_range(first, last, r1, r2, r3)
        largest = max(-low, high) + spread
        mixed = (low < spread) & (high > -spread) & (largest > control.slip_scale[j])
        at_ends = 2.0 * max(max(abs(first), abs(last)), control.slip_scale[j]) + spread
        some = some | (touching & (mixed | (largest > at_ends))
                       & opposite(monotone & (spread == 0.0)))
    return some


def counts_as_few(nodes: int, ground: Array) -> bool:
    """Whether so many nodes over ground of these bounds are looked at one by one."""
    return nodes <= _FEW and ground[STEEPEST] == 0.0


@helper
def _departure(k1, k2, k3):
    """Bound on the distance of the interpolant from the straight line between its ends."""
    return max(max(0.25 * abs(k1), abs(2.0 * k1 + k2) / 6.0), 0.25 * abs(k1 + k2 + k3))


@kernel(by_address=True)
def modes_may_switch(
    step: state.Step, problem: state.Problem, progress: state.Progress, workspace: state.Workspace
) -> bool:
    """Tests of :func:`needs_search` for many nodes or wavy ground, by bounds on the modes.

    ``Control.many`` is its address, zero where nodes count as few.
    """
    s, blocks, control = problem.system, problem.blocks, problem.control
    bounds, levels, ends, nodes, dense = (control.ground, control.levels, workspace.ends,
                                          workspace.nodes, workspace.dense)
    h, moved, near = step.h, step.moved, workspace.near
    n, m = len(s.gap), len(control.largest)
    # Sums over the modes before each one.
    moves, speeds = workspace.inner[0], workspace.inner[1]
    moves[0], speeds[0] = 0.0, 0.0
    furthest = 0.0
    for i in range(m):
        largest = control.largest[i]
        furthest += largest * abs(workspace.after[i] - progress.state[i])
        moves[i + 1] = moves[i] + largest * _departure(dense[0, i], dense[1, i], dense[2, i])
        speeds[i + 1] = speeds[i] + largest * _departure(
            dense[0, m + i], dense[1, m + i], dense[2, m + i])
    reach_out(furthest + moves[m], problem, progress, workspace)
    wavy = bounds[STEEPEST] != 0.0
    if wavy:
        set_heights(motion.motion_given(workspace.given), s, bounds, nodes[0], ends[2, n : 2 * n])
    later = workspace.given[motion.SPEED]
    some = False
    for at in range(near.used[0]):
        j = near.nodes[at]
        move, quicken = 0.0, 0.0
        for span in range(blocks.spans.shape[1]):
            first_mode, last_mode = blocks.spans[j, span, 0], blocks.spans[j, span, 1]
            move += moves[last_mode] - moves[first_mode]
            quicken += speeds[last_mode] - speeds[first_mode]
        reach = move
        f, g = bounds[HIGHEST], bounds[HIGHEST]
        if wavy:
            f, g = ends[2, j], ends[2, n + j]
            shift = 0.0
            for first in range(0, len(nodes[0]), 2 * n):
                shift += abs(nodes[0, first + j] - ends[0, first + j]) + 2.0 * move
            reach += 0.5 * bounds[STEEPEST] * (shift + bounds[FASTEST] * h)
        touching = nodes[2, n + j] != 0.0
        for level in range(levels.shape[0]):
            shift = s.gap[j] + levels[level, j]
            first, last = ends[0, n + j] + shift - f, nodes[0, n + j] + shift - g
            low, high = min(first, last) - reach, max(first, last) + reach
            # Without branches, which cannot be predicted here.
            some |= ((low < 0.0) & (high > 0.0)) | (low < 2.0 * min(min(first, last), 0.0))
            touching |= (low < 0.0) | (level > 0)
        if s.rows.shape[1] > 2:
            continue
        factor = s.sliding[j, 0, 0]
        first, last = ends[1, j] - factor * moved.speed, nodes[1, j] - factor * later
        part = quicken + abs(factor) * bounds[QUICKEST] * h
        low, high = min(first, last) - part, max(first, last) + part
        largest = max(-low, high)
        mixed = (low < 0.0) & (high > 0.0) & (largest > control.slip_scale[j])
        at_ends = 2.0 * max(max(abs(first), abs(last)), control.slip_scale[j])
        some |= touching & (mixed | (largest > at_ends))
    return some


_modes_may_switch_at = function_at(modes_may_switch)


@routine
def may_switch(step, problem, progress, workspace):
    """True if :func:`needs_search` may return True; costs less.

    ``workspace.ends`` and ``workspace.nodes`` hold the nodes at both ends, ``workspace.given`` the
    motion of the ground at the end.
    """
    s, control = problem.system, problem.control
    if control.many != 0:
        return _modes_may_switch_at(control.many)(step, problem, progress, workspace)
    return _nodes_may_switch(step.moved, step.h, s, problem.blocks, control, workspace)


@routine
def needs_search(moved, h, s, bounds, levels, slip_scale, workspace):
    """True if forces within the step may differ from what the values at its ends suggest.

    A gap or slip velocity may change sign more often than its end values show, a contact be twice
    as deep in between, or slip begin and end. ``levels`` (k, n) are the penetrations at which
    normal forces begin; ``moved`` is the motion of the ground. Row SEARCH of
    ``workspace.polynomials`` marks the quantities concerned.
    """
    c = workspace.polynomials
    n = levels.shape[1]
    for j in range(n):
        if s.rows.shape[1] > 2:
            # Slip velocities turn there, and the error of a step sees it.
            c[SEARCH, j], c[SEARCH, n + j] = 0.0, 0.0
            continue
        spread = abs(s.sliding[j, 0, 0]) * bounds[QUICKEST] * h
        v = s.sliding[j, 0, 0] * moved.speed
        low = min(min(min(c[0, j], c[1, j]), min(c[2, j], c[3, j])), c[4, j]) - v - spread
        high = max(max(max(c[0, j], c[1, j]), max(c[2, j], c[3, j])), c[4, j]) - v + spread
        largest = max(-low, high)
        at_ends = 2.0 * max(max(abs(c[0, j] - v), abs(c[4, j] - v)), slip_scale[j])
        mixed = low < 0.0 and high > 0.0 and largest > slip_scale[j]
        c[SEARCH, j] = 1.0 if mixed or largest > at_ends + spread else 0.0
        c[SEARCH, n + j] = 0.0
    for level in range(levels.shape[0]):
        for j in range(n):
            k = n + j
            low = min(min(min(c[0, k], c[1, k]), min(c[2, k], c[3, k])), c[4, k])
            high = max(max(max(c[0, k], c[1, k]), max(c[2, k], c[3, k])), c[4, k])
            top = levels[level, j] - bounds[HIGHEST]
            bottom = levels[level, j] - bounds[LOWEST]
            at_ends = 2.0 * min(min(c[0, k], c[4, k]) + bottom, 0.0)
            mixed = low + top < 0.0 and high + bottom > 0.0
            c[SEARCH, k] += 1.0 if mixed or low + top < at_ends else 0.0
    some = 0.0
    for j in range(2 * n):
        some += c[SEARCH, j]
    if some == 0.0:
        return False
    some = 0.0
    for j in range(2 * n):
        # A monotonic control polygon implies a monotonic curve.
        if bounds[QUICKEST if j < n else STEEPEST] == 0.0 and (
                (c[0, j] <= c[1, j] <= c[2, j] <= c[3, j] <= c[4, j])
                or (c[0, j] >= c[1, j] >= c[2, j] >= c[3, j] >= c[4, j])):
            c[SEARCH, j] = 0.0
        some += c[SEARCH, j]
    return some != 0.0
