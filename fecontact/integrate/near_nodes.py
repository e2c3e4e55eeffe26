r"""Contact nodes near the other side: those that may touch it within a step.

Most normal laws are exactly zero below some penetration. A node whose clearance over that is larger
than any motion since the start of the step has no force, and is left out of stages and Jacobian.
How far nodes move follows from the modes alone,

.. math:: |y_j - y_j(t_0)| \le \sum_i L_i\, |q_i - q_i(t_0)|

with :math:`L_i` the largest motion of mode i anywhere. The near nodes are chosen for about twice
the motion that velocities and accelerations at the start suggest. Each state at which forces are
wanted is checked; if it is too far away, more nodes are taken as near.
"""

import math

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel
from fecontact.core.simd.vectors import opposite, somewhere
from fecontact.integrate.rodas5p import dynamics, state
from fecontact.integrate.step_polynomials import HIGHEST

# Chosen for so many times the motion that is expected.
_AMPLE = 1.5


@helper
def _take(reach, blocks, workspace):
    """Take the nodes of a clearance up to ``reach``; those taken count as without clearance."""
    near, clearance = workspace.near, workspace.clearance
    n = len(blocks.nodes)
    found, same, left_out = 0, 0, math.inf
    for j in range(n):
        if clearance[j] > reach:
            left_out = min(left_out, clearance[j])
        else:
            clearance[j] = -math.inf
            if same == found and near.nodes[found] == j:
                same += 1
            near.nodes[found] = j
            found += 1
    clearance[n] = left_out
    if same == found and found == near.used[0]:
        return
    near.used[0] = found
    for i in range(len(near.shapes)):
        here, there = near.shapes[i], blocks.shapes[i]
        for first in range(0, len(here), n):
            for at in range(same, found):
                here[first + at] = there[first + near.nodes[at]]
    _set_columns(blocks.parts, near.parts, 2, near)
    _set_columns(blocks.tiles, near.tiles, 2, near)
    _set_columns(blocks.pairs, near.pairs, 4, near)


@helper
def _set_columns(table, out, column, near):
    """Fill first and last columns of blocks, in two columns of a table, by those of all nodes."""
    n = len(near.nodes)
    for row in range(len(table)):
        first = table[row, column] // n * n
        for k in range(column, column + 2):
            out[row, k] = first + _number_below(table[row, k] - first, near)


@helper
def _number_below(j, near):
    """Number of near nodes whose number is below j."""
    low, high = 0, near.used[0]
    while low < high:
        middle = (low + high) // 2
        if near.nodes[middle] < j:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(by_address=True)
def take_near(
    h: float, reach: float, problem: state.Problem, progress: state.Progress,
    workspace: state.Workspace,
) -> None:
    """Let ``workspace.near`` be the nodes that may touch in a step of about the length h.

    Fills ``workspace.clearance`` (n + 1,): that of all nodes at the start of the step, then how far
    they may move without one that is left out touching. If h is zero, nodes of a clearance up to
    ``reach`` are taken too. ``Control.near`` is its address; zero where all nodes are near.
    """
    s, blocks, control = problem.system, problem.blocks, problem.control
    if h == 0.0:
        _take(reach, blocks, workspace)
        return
    n, m = len(blocks.nodes), len(control.largest)
    for j in range(n):
        workspace.clearance[j] = (workspace.ends[0, n + j] + s.gap[j] + control.untouched[j]
                                  - control.ground[HIGHEST])
    move = 0.0
    for i in range(m):
        move += control.largest[i] * h * (abs(progress.state[m + i])
                                          + 0.5 * h * abs(progress.rate[m + i]))
    if not _AMPLE * move < 1e300:
        _take(math.inf, blocks, workspace)
        return
    # Steps of about the same length have the same nodes.
    _take(2.0 ** math.ceil(math.log2(max(_AMPLE * move, 1e-300))), blocks, workspace)


_take_near_at = function_at(take_near)


@helper
def choose_near(h, problem, progress, workspace):
    """Take the nodes as near that may touch in a step of about the length h."""
    if problem.control.near != 0:
        _take_near_at(problem.control.near)(h, 0.0, problem, progress, workspace)


@helper
def extend_near(y, problem, progress, workspace):
    """Take all nodes as near that may touch where the modal displacements are y[:m]."""
    largest = problem.control.largest
    if problem.control.near != 0:
        move = 0.0
        for i in range(len(largest)):
            move += largest[i] * abs(y[i] - progress.state[i])
        reach_out(move, problem, progress, workspace)


@helper
def reach_out(move, problem, progress, workspace):
    """Take all nodes as near that may touch where no node has moved further than ``move``."""
    near = problem.control.near
    clearance = workspace.clearance[len(problem.blocks.nodes)]
    if near != 0 and somewhere(opposite(move < clearance)):
        _take_near_at(near)(0.0, 2.0 * move, problem, progress, workspace)


@helper
def set_end(problem, progress, workspace):
    """Fill rates and gradients after the step, and ``workspace.nodes``: all nodes and their forces.

    Gradients of nodes that are not near are left as they are, zero.
    """
    s, near = problem.system, workspace.near
    n = len(s.gap)
    extend_near(workspace.after, problem, progress, workspace)
    every = near.used[0] == n
    dynamics.set_rate_and_gradients(workspace.after, s, near, workspace.given, workspace.load,
                                    workspace.nodes if every else workspace.slots,
                                    workspace.gradients_after, workspace.rate_after)
    if every:
        return
    dynamics.project(problem.blocks, workspace.after, workspace.nodes[0], workspace.nodes[1])
    for j in range(workspace.nodes.shape[1]):
        workspace.nodes[2, j] = 0.0
    for at in range(near.used[0]):
        workspace.nodes[2, n + near.nodes[at]] = workspace.slots[2, n + at]
