"""What is done part by part of the contact nodes, and how the parts are put together.

The parts depend on the number of near nodes alone, and their sums are added in their order: results
are the same bit for bit for any number of threads, one too.
"""

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.integrate.rodas5p import dynamics, stage_solver, state, tableau
from fecontact.integrate.rodas5p.blocks import block_at, within
from fecontact.integrate.rodas5p.error_control import add_some_powers, largest_slip_error
from fecontact.integrate.shared_nodes.tasks import (
    DONE,
    END,
    JACOBIAN,
    NUMBERS,
    PAUSE,
    POWERS,
    PRODUCTS,
    SLEEP,
    SLIP_ERROR,
    STAGE,
    TIME,
    TIME_RATE,
    VALUE,
    WORDS,
    YIELD,
    add,
    announce,
    rest,
    take_first,
    take_last,
    wait_for,
    work_at,
)
from fecontact.integrate.shared_nodes.team import (
    ALONE,
    Team,
    ends_of,
    parts_for,
    parts_of,
    parts_of_modes,
)
from fecontact.integrate.shared_nodes.waiting import how_to_wait
from fecontact.system.powers import POWER_COUNT


@helper
def _tile_within(tile, begin, end, near):
    """A block of the rows from one place of the near nodes to another."""
    n = len(near.nodes)
    top, bottom, left, right = block_at(near.tiles, tile)
    first = np.int64(left) // n * n
    left, right = within(left, right, first + begin, first + end)
    return top, bottom, left, right


@helper
def _begin_places(begin, end, near, out):
    n = len(near.nodes)
    for first in range(0, near.shapes.shape[1], n):
        for j in range(first + begin, first + end):
            out[j] = 0.0


@helper
def _project(begin, end, near, y, places, speeds):
    """As :func:`dynamics.project` from one place to another."""
    _begin_places(begin, end, near, places)
    _begin_places(begin, end, near, speeds)
    for tile in range(len(near.tiles)):
        dynamics.project_block(_tile_within(tile, begin, end, near), near.shapes, y, places, speeds)


@helper
def _push(begin, end, near, forces, out):
    """Fill the first entries of ``out`` with the modal forces by node forces, as ``push`` does."""
    for i in range(len(near.shapes)):
        out[i] = 0.0
    for tile in range(len(near.tiles)):
        dynamics.push_block(_tile_within(tile, begin, end, near), near.shapes, forces, out)


@routine
def _stage_part(part, begin, end, problem, room):
    s, near, w = problem.system, room.near, room.nodes
    _project(begin, end, near, room.stage, w[0], w[1])
    dynamics.set_some_forces(begin, end, room.stage, s, near, dynamics.motion_given(room.given), w,
                             room.scratch, room.base)
    _push(begin, end, near, w[2], room.team.sums[part])


@routine
def _end_part(part, begin, end, problem, room):
    s, near = problem.system, room.near
    w = room.nodes if near.used[0] == len(s.gap) else room.slots
    _project(begin, end, near, room.after, w[0], w[1])
    dynamics.set_some_gradients(begin, end, room.after, s, near,
                                dynamics.motion_given(room.given), w, room.gradients_after)
    _push(begin, end, near, w[2], room.team.sums[part])


@routine
def _time_rate_part(part, begin, end, problem, progress, room):
    near, forces = room.near, room.nodes[2]
    acceleration = room.team.numbers[TIME], room.team.numbers[TIME + 1]
    dynamics.set_some_time_rates(begin, end, problem.system, near, room.given, acceleration,
                                 progress.gradients, forces, room.time_rate)
    _push(begin, end, near, forces, room.team.sums[part])


@routine
def _answer_part(begin, end, progress, room):
    stage_solver.set_some_answers(begin, end, room.near, progress.gradients, room.reduced,
                                  room.reduced.answers)


@helper
def _cut(mode, left, right):
    """Where the columns from left to right are cut at a mode: not within fours of them."""
    return min(left + (max(mode - left, 0) + 3) // 4 * 4, right)


@routine
def _product_part(part, parts, room):
    """Columns of the Jacobian of some modes, the same numbers whatever the parts.

    They are products of fours of modes of a block, and of what is left behind the last four.
    """
    near, w = room.near, room.reduced
    m = len(near.shapes)
    begin, end = part * m // parts, (part + 1) * m // parts
    for pair in range(len(near.pairs)):
        top, bottom, left, right = block_at(near.pairs, pair)
        for half in (0, m):
            low, high = max(np.int64(left), half), min(np.int64(right), half + m)
            first, last = _cut(half + begin, low, high), _cut(half + end, low, high)
            if first < last:
                stage_solver.add_products(
                    near.shapes, w.answers, (top, bottom, np.uint64(first), np.uint64(last)),
                    (np.uint64(near.pairs[pair, 4]), np.uint64(near.pairs[pair, 5])), w.J)


@routine
def _slip_part(part, begin, end, problem, room):
    near, slips, out = room.near, room.between[0], room.team.sums[part]
    m = len(problem.control.largest)
    _begin_places(begin, end, near, slips)
    for tile in range(len(near.tiles)):
        dynamics.project_block_once(_tile_within(tile, begin, end, near), near.shapes,
                                    room.stages[tableau.STAGES - 1, m : 2 * m], slips)
    error, worst = largest_slip_error(begin, end, room.team.numbers[VALUE], problem.system,
                                      problem.control, room)
    out[0], out[1] = error, worst


@routine
def _power_part(part, begin, end, problem, room):
    point, out = int(room.team.numbers[VALUE]), room.team.sums[part]
    y = room.right if point < 3 else room.after
    _project(begin, end, room.near, y, room.between[0], room.between[1])
    for k in range(POWER_COUNT):
        out[k] = 0.0
    add_some_powers(begin, end, room.team.numbers[TIME], y, problem, room, out,
                    room.power[point, POWER_COUNT:])


@kernel(by_address=True)
def work(
    task: int, part: int, parts: int, problem: state.Problem, progress: state.Progress,
    room: state.Room,
) -> int:
    """Do a part of a task."""
    if task == PRODUCTS:
        _product_part(part, parts, room)
        return 0
    begin, end = ends_of(part, parts, room.near.used[0])
    if task == STAGE:
        _stage_part(part, begin, end, problem, room)
    elif task == END:
        _end_part(part, begin, end, problem, room)
    elif task == TIME_RATE:
        _time_rate_part(part, begin, end, problem, progress, room)
    elif task == JACOBIAN:
        _answer_part(begin, end, progress, room)
    elif task == SLIP_ERROR:
        _slip_part(part, begin, end, problem, room)
    elif task == POWERS:
        _power_part(part, begin, end, problem, room)
    return 0


@helper
def _set_free(task, problem, room):
    """Fill the results of a task with what they are without nodes."""
    s, near = problem.system, room.near
    if task == STAGE:
        dynamics.set_free_rate(room.stage, s, near, room.load, room.base)
    elif task == END:
        dynamics.set_free_rate(room.after, s, near, room.load, room.rate_after)
    elif task == TIME_RATE:
        dynamics.set_free_time_rate(s, room.given, room.pull_rate, room.time_rate)
    elif task == JACOBIAN:
        stage_solver.set_free_jacobian(s, near, room.reduced.J)


@helper
def _add_sums(parts, sums, out):
    for part in range(parts):
        for i in range(len(out)):
            out[i] += sums[part, i]


@helper
def _add_parts(task, value, parts, problem, progress, room):
    """Add up the parts of a task; the error, where that is asked for."""
    sums, m = room.team.sums, len(problem.control.largest)
    if task == STAGE:
        _add_sums(parts, sums, room.base[m : 2 * m])
    elif task == END:
        dynamics.set_memory_rates(m, problem.system, room.gradients_after, room.rate_after)
        _add_sums(parts, sums, room.rate_after[m : 2 * m])
    elif task == TIME_RATE:
        _add_sums(parts, sums, room.time_rate[m : 2 * m])
    elif task == POWERS:
        _add_sums(parts, sums, room.power[int(value), :POWER_COUNT])
    elif task == SLIP_ERROR:
        for part in range(parts):
            if sums[part, 0] > value:
                value = sums[part, 0]
                progress.counts[state.WORST_NODE] = int(sums[part, 1])
    return value


@helper
def _take_parts(parts, task, problem, progress, room):
    """Do the parts of a task that was announced, and wait for those of others."""
    words = room.team.words
    part = take_first(words)
    while part >= 0:
        work_at(room.team.work)(task, part, parts, problem, progress, room)
        add(words, DONE, 1)
        part = take_first(words)
    wait_for(parts, words)


@kernel(by_address=True)
def share(
    task: int, value: float, problem: state.Problem, progress: state.Progress, room: state.Room,
) -> float:
    """Do a task, together with the helpers that are there."""
    words, parts = room.team.words, parts_of(room)
    room.team.numbers[VALUE] = value
    announce(task, parts, words)
    _set_free(task, problem, room)
    _take_parts(parts, task, problem, progress, room)
    if task == JACOBIAN:
        # Sums over all nodes, in the caches of cores for some modes at a time.
        parts = parts_of_modes(room)
        announce(PRODUCTS, parts, words)
        _take_parts(parts, PRODUCTS, problem, progress, room)
    return _add_parts(task, value, parts, problem, progress, room)


@kernel(nogil=True)
def assist(problem: state.Problem, progress: state.Progress, room: state.Room) -> int:
    """Take parts of the tasks of a run until it ends, or none has been offered for about a second.

    Returns how many it did.
    """
    words = room.team.words
    looks, done = 0, 0
    while rest(looks, words):
        task, part, parts = take_last(words)
        looks += 1
        if part >= 0:
            work_at(room.team.work)(task, part, parts, problem, progress, room)
            add(words, DONE, 1)
            looks, done = 0, done + 1
    return done


def team_for(modes: int, nodes: int, helpers: int) -> Team:
    """What the thread of a run and its helpers share the nodes with; ``ALONE`` for few nodes."""
    parts = parts_for(nodes)
    if not parts:
        return ALONE
    words = np.zeros(WORDS, dtype=np.int64)
    words[[YIELD, SLEEP, PAUSE]] = how_to_wait()
    width = max(modes, POWER_COUNT)
    return Team(words, np.zeros(NUMBERS), np.zeros((parts, -(-width // 8) * 8)),
                parts, helpers, share.address, work.address)
