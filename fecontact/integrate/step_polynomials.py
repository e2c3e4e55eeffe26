r"""Polynomials of gaps and slip velocities of the contact nodes over a step.

On the interpolant of a step gaps and slip velocities are polynomials of degree four in the
normalised time s, minus the contribution of the ground, its height under the node or its speed.
Their Bernstein coefficients bound the polynomials. On flat ground at constant speed that
contribution is constant, and sign changes are found exactly. Otherwise its bounds are used,

.. math:: |y_R(\xi) - y_R(\xi_0)| \le \max|y_R'|\,|\xi - \xi_0|, \qquad
    |V(t) - V(t_0)| \le \max|V'|\,|t - t_0|

over intervals that are bisected until the sign is decided, or they are as short as _FINEST.
"""

from typing import Any, NamedTuple

from fecontact.core.compiled import helper, routine
from fecontact.core.types import Array
from fecontact.integrate import bernstein
from fecontact.integrate.rodas5p import dynamics as motion
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.system.nodes import ground_motion, ground_speed, ground_under, node_place

# Entries of Control.ground: bounds of the ground.
LOWEST, HIGHEST, STEEPEST, FASTEST, QUICKEST = range(5)
# Rows of coefficients: five coefficients, then a mark of doubt.
COEFFICIENTS, SEARCH = 5, 5
# Columns of the workspace for changes of sign: coefficients, a width, and the ground at both ends.
COLUMNS = COEFFICIENTS + 3
_BEGIN, _END = COEFFICIENTS + 1, COEFFICIENTS + 2
# Quantities of a node.
SLIP, GAP = range(2)

_FINEST = 2.0**-6
# Largest number of sign changes of one quantity in a step.
MOST = 8


class StepPolynomial(NamedTuple):
    """Polynomial of the slip velocity (SLIP) or the gap (GAP) of a node over a step.

    Attributes
    ----------
    what, node : int
        SLIP or GAP; number of the node.
    shift : float
        Number that is added.
    step, system : Step, SystemArrays
        The step, and what moves.
    bounds, coefficients : arrays
        Bounds of the ground; results of :func:`set_polynomials`.
    row : (5,) array
        Work arrays.
    """

    what: int
    node: int
    shift: float
    step: Any
    system: Any
    bounds: Array
    coefficients: Array
    row: Array


@helper
def _project(blocks, v, columns, out):
    """Fill out with velocities along and displacements away from the ground, then along it.

    In space displacements along the second tangent follow.
    """
    m, n = len(blocks.shapes), len(blocks.spans)
    along, away = blocks.shapes[:, :n], blocks.shapes[:, n:]
    slip, height, place = out[:n], out[n : 2 * n], out[2 * n :]
    for j in range(columns):
        out[j] = 0.0
    for part in range(len(blocks.parts)):
        i, end, left, right = block_at(blocks.parts, part)
        if columns > 2 * n:
            for k in range(i, end):
                for j in range(left, right):
                    place[j] += along[k, j] * v[k]
        if columns > 3 * n:
            across, rows = out[3 * n :], blocks.shapes[:, 2 * n :]
            for k in range(i, end):
                for j in range(left, right):
                    across[j] += rows[k, j] * v[k]
        while i + 3 < end:
            for j in range(left, right):
                slip[j] += (along[i, j] * v[m + i] + along[i + 1, j] * v[m + i + 1]
                            + along[i + 2, j] * v[m + i + 2] + along[i + 3, j] * v[m + i + 3])
                height[j] += (away[i, j] * v[i] + away[i + 1, j] * v[i + 1]
                              + away[i + 2, j] * v[i + 2] + away[i + 3, j] * v[i + 3])
            i += 4
        while i < end:
            for j in range(left, right):
                slip[j] += along[i, j] * v[m + i]
                height[j] += away[i, j] * v[i]
            i += 1


@routine
def set_polynomials(s, blocks, bounds, before, after, workspace):
    """Fill ``workspace.polynomials`` (6, 2 n, 3 n or 4 n) with the coefficients over a step.

    Velocities of the nodes along the ground, heights with their gap, and where the ground is not
    flat displacements along it, in space along both tangents. ``workspace.nodes`` holds what
    :func:`fecontact.integrate.rodas5p.dynamics.project` says of the end.
    """
    out, inner = workspace.polynomials, workspace.inner
    n = len(s.gap)
    columns = 2 * n
    if bounds[STEEPEST] != 0.0:
        columns = (s.rows.shape[1] + 1) * n
    tableau.inner_coefficients(before, after, workspace.dense, inner)
    _project(blocks, before, columns, out[0])
    for k in range(3):
        _project(blocks, inner[k], columns, out[1 + k])
    for j in range(n):
        out[4, j] = workspace.nodes[1, j]
        out[4, n + j] = workspace.nodes[0, n + j]
    for first in range(2 * n, columns, n):
        for j in range(n):
            out[4, first + j] = workspace.nodes[0, 2 * (first - 2 * n) + j]
    for k in range(COEFFICIENTS):
        for j in range(n):
            out[k, n + j] += s.gap[j]


@routine
def set_ends(t, y, s, blocks, bounds, ends):
    """Fill ``ends`` (3, d n) with displacements and velocities of the nodes, and heights below."""
    n = len(s.gap)
    motion.project(blocks, y, ends[0], ends[1])
    set_heights(ground_motion(t, s), s, bounds, ends[0], ends[2, :n])


@helper
def _height_at(j, along, across, moved, s):
    """Height of the ground under node j, displaced so far along both tangents."""
    return ground_under(j, node_place(j, along, across, moved, s), s)[0]


@helper
def set_heights(moved, s, bounds, places, heights):
    """Fill ``heights`` (n,) with the heights of the ground under the nodes."""
    n = len(heights)
    for j in range(len(heights)):
        heights[j] = bounds[HIGHEST]
        if bounds[STEEPEST] != 0.0:
            across = places[2 * n + j] if s.rows.shape[1] > 2 else 0.0
            heights[j] = _height_at(j, places[j], across, moved, s)


@helper
def keep_ends(n, workspace):
    """Copy the end of the step to the start of the next."""
    for k in range(2):
        for j in range(workspace.ends.shape[1]):
            workspace.ends[k, j] = workspace.nodes[k, j]
    for j in range(n):
        workspace.ends[2, j] = workspace.ends[2, n + j]


@helper
def ground_part(part, polynomial):
    """Contribution of the ground at a part of the step: height under the node, or its speed."""
    s, step = polynomial.system, polynomial.step
    now = min(step.t + part * step.h, step.latest)
    if polynomial.what == SLIP:
        return ground_speed(0, polynomial.node, ground_motion(now, s), s)
    if polynomial.bounds[STEEPEST] == 0.0:
        return polynomial.bounds[HIGHEST]
    if not s.on_ground[polynomial.node]:
        return 0.0
    n, d, _ = s.rows.shape
    along, across = _displaced(part, 2 * n + polynomial.node, polynomial), 0.0
    if d > 2:
        across = _displaced(part, 3 * n + polynomial.node, polynomial)
    return _height_at(polynomial.node, along, across, ground_motion(now, s), s)


@helper
def _displaced(part, column, polynomial):
    """Value of a column of the coefficients at a part of the step."""
    return bernstein.value(polynomial.coefficients[:COEFFICIENTS, column], part, polynomial.row)


@helper
def at(part, b, polynomial):
    """Value of a polynomial at a part of the step.

    b (5,) are the coefficients of the node's own motion.
    """
    own = bernstein.value(b, part, polynomial.row)
    return own + polynomial.shift - ground_part(part, polynomial)


@helper
def _set_own(polynomial, b):
    """Fill b (5,) with the coefficients of the node's own motion."""
    own = polynomial.node
    if polynomial.what == GAP:
        own += polynomial.system.gap.shape[0]
    for k in range(COEFFICIENTS):
        b[k] = polynomial.coefficients[k, own]


@helper
def _ground_bound(polynomial):
    """Largest rate of change of what the ground adds, over the step."""
    bounds, h = polynomial.bounds, polynomial.step.h
    if polynomial.what == SLIP:
        return abs(polynomial.system.sliding[polynomial.node, 0, 0]) * bounds[QUICKEST] * h
    if bounds[STEEPEST] == 0.0 or not polynomial.system.on_ground[polynomial.node]:
        return 0.0
    # The node's own motion over the ground, and that of the ground.
    n, d, _ = polynomial.system.rows.shape
    bound = 0.0
    for first in range(2, d + 1):
        column, most, c = first * n + polynomial.node, 0.0, polynomial.coefficients
        for k in range(COEFFICIENTS - 1):
            most = max(most, 4.0 * abs(c[k + 1, column] - c[k, column]))
        bound += most
    return bounds[STEEPEST] * (bound + bounds[FASTEST] * h)


@helper
def _signs_on_moving_ground(part, begin, width, rows, data):
    """Signs of a step polynomial, for :func:`fecontact.integrate.bernstein.changes_of_sign`.

    ``data`` are a bound on the rate of change of the ground over the step, and the polynomial. The
    last two columns of ``rows`` have what the ground adds at the begin and at the end of a part.
    """
    bound, polynomial = data
    at_begin, at_end, reach = rows[0, _BEGIN], rows[0, _END], 0.5 * bound * width
    ground = 0.5 * (at_begin + at_end) - polynomial.shift
    low, high = bernstein.smallest(part) - ground, bernstein.largest(part) - ground
    if low > reach or high < -reach:
        return low, low, begin
    if width > _FINEST:
        middle = ground_part(begin + 0.5 * width, polynomial)
        rows[0, _BEGIN], rows[1, _BEGIN], rows[1, _END] = middle, at_begin, middle
        return 0.0, 0.0, bernstein.UNDECIDED
    first = part[0] + polynomial.shift - at_begin
    last = part[COEFFICIENTS - 1] + polynomial.shift - at_end
    share = first / (first - last) if first * last < 0.0 else 0.0
    return first, last, begin + share * width


@helper
def changes(b, polynomial, halves, places):
    """Fill ``places`` with the parts of the step at which a step polynomial changes its sign.

    Returns how many there are. Sets b (5,) to the coefficients of the node's own motion;
    ``halves`` (bernstein.DEPTH, COLUMNS) is workspace.
    """
    _set_own(polynomial, b)
    bound = _ground_bound(polynomial)
    if bound > 0.0:
        halves[0, _BEGIN] = ground_part(0.0, polynomial)
        halves[0, _END] = ground_part(1.0, polynomial)
        return bernstein.changes_of_sign(_signs_on_moving_ground, (bound, polynomial), b, 0.0,
                                         places, halves)
    constant = polynomial.shift - ground_part(0.0, polynomial)
    for k in range(COEFFICIENTS):
        b[k] += constant
    found = bernstein.sign_changes(b, places, halves)
    for k in range(COEFFICIENTS):
        b[k] -= constant
    return found
