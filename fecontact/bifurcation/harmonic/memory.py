"""Internal variables of friction with memory, marched around a period until they repeat.

Their rates g have kinks, of which a few harmonics know nothing. They are found at the N samples
instead, by backward differences of second order, which damp what is stiff,

    (3 z_n - 4 z_(n-1) + z_(n-2)) N / (2 T) = g(q_n, q'_n, z_n) - e (z_n - s_n) / T,

with velocities q' that are the same differences of the displacements: a spring that sticks follows
its displacement exactly. Nothing but the leak e = 1e-6 determines the mean deflection of an element
that never slides: s is the deflection x + a of an element that has stuck since it was preloaded, a
the part that it slid back then (:class:`Kept`). One that slides a little gives up as much of a as
it must. What is found repeats, so that its derivatives are those of these equations, cyclic, node
by node and element by element.

Elastic Coulomb elements are marched so beside other internal variables. Along two tangents the same
equations are solved for all samples at once, see :func:`solve_around_limit`; elements that are
followed one by one are in :mod:`fecontact.bifurcation.harmonic.elements`.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import borrowing, helper, kernel
from fecontact.core.dense_lu import factorise, solve, solve_rows
from fecontact.core.records import Array4, Block, IntegerVector, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.system.node_forces import (
    force_workspace,
    node_forces,
    normal_force,
    pressing_force,
    set_friction,
)
from fecontact.system.nodes import (
    SystemArrays,
    ground_motion,
    most_memory,
    node_contact,
    node_motion,
)

LEAK = 1e-6
# Largest number of rounds, of Newton steps at a sample, and relative changes that end both.
_ROUNDS, _STEPS = 60, 40
_REPEATS, _SOLVED = 1e-12, 1e-14
# Elements along two tangents: first return time as a part of the period, and by which it is divided
# in turn, at least; largest number of Newton steps with each, change of a step that ends all but
# the last, and roundings in what the equations leave.
_SOFT, _STIFFER, _LEAST_STIFFER = 0.3, 10.0, 1.05
_MOST, _NEARLY, _ROUNDINGS = 40, 1e-6, 4e-15


@dataclass(frozen=True, eq=False)
class Kept:
    """Deflections that elements have which never slide: x + a.

    Attributes
    ----------
    rows : (c, m) array
        The displacement x from q, of springs; zero for other internal variables.
    offsets : (c,) array
        a [m].
    blocks : (n,) array
        How many internal variables of each node act on each other: those of an element, and all of
        others, 0.
    elements : (n,) array
        Numbers of elements of each node that are followed one by one, see
        :mod:`fecontact.bifurcation.harmonic.elements`; none or all are.
    """

    rows: Array
    offsets: Array
    blocks: Integers
    elements: Integers

    @property
    def exact(self) -> bool:
        """Whether all internal variables are those of elements that are followed one by one."""
        return bool(self.elements.any())

    def at(self, q: Array) -> Array:
        """Deflections (N, c) for displacements q (N, m)."""
        return np.asarray(q @ self.rows.T + self.offsets)

    def left_by(self, states: Array) -> "Kept":
        """Deflections that elements have after states (N, d), averaged over these."""
        c, m = self.rows.shape
        return Kept(self.rows, (states[:, states.shape[1] - c :]
                                - states[:, :m] @ self.rows.T).mean(axis=0), self.blocks,
                    self.elements)


def differences(z: Array) -> Array:
    """Derivatives (N, c) with respect to tau of samples (N, c) of a periodic function."""
    N = len(z)
    found: Array = N * (1.5 * z - 2.0 * np.roll(z, 1, axis=0) + 0.5 * np.roll(z, 2, axis=0))
    return found


@helper
def difference(z, n, i):
    """Backward difference of column i at sample n: the rate times the distance of samples."""
    return 1.5 * z[n, i] - 2.0 * z[n - 1, i] + 0.5 * z[n - 2, i]


@helper
def _before(z, place, i, c, columns):
    """Column c at both samples before a place: before the first, unit values behind ``columns``."""
    unit = 1.0 if c == columns + i else 0.0
    one = z[place - 1, i, c] if place > 0 else unit
    if place > 1:
        return one, z[place - 2, i, c]
    return one, unit if place == 1 else (1.0 if c == columns + z.shape[1] + i else 0.0)


@helper
def _ring_of(z, columns, ring, pivots):
    """Factorise the equations (2 s, 2 s) of starts that repeat, from the unit columns of z."""
    N, s = z.shape[:2]
    for last in range(2):
        for i in range(s):
            for k in range(2 * s):
                ring[last * s + i, k] = -z[N - 1 - last, i, columns + k]
            ring[last * s + i, last * s + i] += 1.0
    factorise(ring, 2 * s, pivots)


@kernel
def solve_around(slopes: Array4, T: float, blocks: IntegerVector, x: Block) -> None:
    """Replace right sides x (N, n s, columns) by the solutions z of D z / T - g_z z = x.

    ``slopes`` (N, n, s, s) holds the derivatives g_z of each of n nodes with s variables, of which
    as many in a row as ``blocks`` (n,) says act on each other, all for 0. The last two samples of a
    block are guessed as zero first; what this leaves around the period is the solution of two
    equations for each of its variables, since solutions of the homogeneous equations combine.
    """
    for node in range(slopes.shape[1]):
        s = blocks[node] if blocks[node] > 0 else slopes.shape[2]
        for first in range(0, slopes.shape[2], s):
            _solve_block(slopes, T, node, first, s, x)


@helper
def _solve_block(slopes, T, node, own, s, x):
    """Solve for s variables of a node, from ``own`` on; see :func:`solve_around`."""
    N, columns = len(slopes), x.shape[2]
    first = node * slopes.shape[2] + own
    rate = N / T
    wide = columns + 2 * s
    a, pivots = np.empty((s, s)), np.empty(s, dtype=np.int64)
    z = np.empty((N, s, wide))
    ring, ring_pivots = np.empty((2 * s, 2 * s)), np.empty(2 * s, dtype=np.int64)
    given = np.empty((2 * s, columns))
    for place in range(N):
        for i in range(s):
            for k in range(s):
                a[i, k] = -slopes[place, node, own + i, own + k]
            a[i, i] += 1.5 * rate + LEAK / T
            for c in range(wide):
                value = x[place, first + i, c] if c < columns else 0.0
                one, two = _before(z, place, i, c, columns)
                z[place, i, c] = value + rate * (2.0 * one - 0.5 * two)
        factorise(a, s, pivots)
        solve_rows(a, pivots, z[place])
    _ring_of(z, columns, ring, ring_pivots)
    for last in range(2):
        for i in range(s):
            for c in range(columns):
                given[last * s + i, c] = z[N - 1 - last, i, c]
    solve_rows(ring, ring_pivots, given)
    for place in range(N):
        for i in range(s):
            for c in range(columns):
                value = z[place, i, c]
                for k in range(2 * s):
                    value += z[place, i, columns + k] * given[k, c]
                x[place, first + i, c] = value


@helper
def _bracket(turn, start, off, brackets):
    """Narrow the brackets of starts between which Newton's method goes to and fro.

    An element that leaks towards its limit sticks with one start and slips much with the next; the
    start that repeats lies between them, where it slips as much as it has leaked. ``brackets``
    (5, 2 k) hold the last starts and how far off they were, lower and upper ends, and whether there
    are any.
    """
    k = len(start) // 2
    for i in range(k):
        gap = max(abs(off[i]), abs(off[k + i]))
        if brackets[4, i] > 0.0:
            ahead = 0.0
            for entry in (i, k + i):
                ahead += off[entry] * (brackets[3, entry] - brackets[2, entry])
            side = 2 if ahead > 0.0 else 3
            for entry in (i, k + i):
                brackets[side, entry] = start[entry]
        elif turn > 1 and gap > brackets[1, i]:
            for entry in (i, k + i):
                brackets[2, entry], brackets[3, entry] = brackets[0, entry], start[entry]
            brackets[4, i] = 1.0
        for entry in (i, k + i):
            brackets[0, entry] = start[entry]
        brackets[1, i] = gap


@helper
def _keep_within(start, brackets):
    """Halve the brackets that starts have left."""
    k = len(start) // 2
    for i in range(k):
        low, high = brackets[2, i], brackets[3, i]
        if brackets[4, i] > 0.0 and not min(low, high) < start[i] < max(low, high):
            for entry in (i, k + i):
                start[entry] = 0.5 * (brackets[2, entry] + brackets[3, entry])


@helper
def _factorise_block(rates, diagonal, a, pivots):
    """Factorise the derivatives (b, b) of the equations of b variables at a sample."""
    b = len(a)
    for i in range(b):
        for c in range(b):
            a[i, c] = -rates[i, 3 + c]
        a[i, i] += diagonal
    factorise(a, b, pivots)


@helper
def take_element(j, i, count, s, p):
    """Fill p (3,) with the parameters of element i of the ``count`` of node j."""
    own = s.friction_parameters[j]
    p[0], p[1], p[2] = own[0], own[1 + i], own[1 + count + i]


@borrowing
def _take_slip(j, t, y, s, slip):
    """Fill slip (N, 3) with slip velocities of node j and its pressing force; y (N, d)."""
    for n in range(len(t)):
        contact = node_contact(j, node_motion(j, y[n], s), ground_motion(t[n], s), s)
        F = normal_force(j, contact.penetration, contact.rate, s)[0]
        slip[n, 0], slip[n, 1] = contact.slip[0], contact.slip[1]
        slip[n, 2] = pressing_force(j, contact, F, s)


class Sliding(NamedTuple):
    """An elastic Coulomb element over a period, and what slides under it.

    ``parameters`` (3,) are the return time, the stiffness and the coefficient; ``slip`` (N, 3) are
    the slip velocities and the pressing force at the samples.
    """

    parameters: Vector
    slip: Matrix


class Samples(NamedTuple):
    """Times (N,) [s] and states (N, d) at the samples of a period [s]."""

    times: Vector
    states: Matrix
    period: float


@borrowing
def march_block(j, alone, samples, s, element, target, path):
    """Fill path (N, b) with variables of node j that repeat; 1 if they do, else 0.

    ``alone`` is for one element; otherwise these are all variables of the node. The deflections to
    which they leak are ``target`` (N, b).
    """
    N, b = path.shape
    p, slip = element.parameters, element.slip
    t, y, T = samples.times, samples.states, samples.period
    force, rates = force_workspace(s)
    if alone:
        force, rates = np.empty(2 * (4 + b)), np.empty((b, 4 + b))
    rate, leak = N / T, LEAK / T
    turned = np.empty((N, b, 2 * b))
    a, pivots = np.empty((b, b)), np.empty(b, dtype=np.int64)
    ring, ring_pivots = np.empty((2 * b, 2 * b)), np.empty(2 * b, dtype=np.int64)
    start, off, step = np.zeros(2 * b), np.empty(2 * b), np.empty(b)
    last_round, brackets, largest = np.empty(b), np.zeros((5, 2 * b)), 0.0
    for turn in range(_ROUNDS):
        alike = 0
        for place in range(N):
            here = path[place]
            for i in range(b):
                last_round[i] = here[i]
                here[i] = path[place - 1, i] if place > 0 else start[i]
            for _ in range(_STEPS):
                if alone:
                    set_friction(j, (slip[place, 0], slip[place, 1]), slip[place, 2], here, p, s,
                                 force, rates)
                else:
                    node_forces(j, node_motion(j, y[place], s), ground_motion(t[place], s), here, s,
                                force, rates)
                for i in range(b):
                    one = path[place - 1, i] if place > 0 else start[i]
                    two = (path[place - 2, i] if place > 1 else
                           start[i] if place == 1 else start[b + i])
                    step[i] = (rates[i, 0] - leak * (here[i] - target[place, i])
                               - rate * (1.5 * here[i] - 2.0 * one + 0.5 * two))
                _factorise_block(rates, 1.5 * rate + leak, a, pivots)
                solve(a, pivots, step)
                change, size = 0.0, 0.0
                for i in range(b):
                    here[i] += step[i]
                    change, size = max(change, abs(step[i])), max(size, abs(here[i]))
                largest = max(largest, size)
                if not change > _SOLVED * largest:
                    break
            for i in range(b):
                for c in range(2 * b):
                    one, two = _before(turned, place, i, c, 0)
                    turned[place, i, c] = rate * (2.0 * one - 0.5 * two)
            _factorise_block(rates, 1.5 * rate + leak, a, pivots)
            solve_rows(a, pivots, turned[place])
            # Where two samples are those of the last round, all behind them are.
            if turn > 0:
                moved_by = 0.0
                for i in range(b):
                    moved_by = max(moved_by, abs(here[i] - last_round[i]))
                alike = alike + 1 if moved_by <= _SOLVED * largest else 0
                if alike == 2:
                    break
        gap = 0.0
        for i in range(b):
            for last in range(2):
                off[last * b + i] = path[N - 1 - last, i] - start[last * b + i]
                gap = max(gap, abs(off[last * b + i]))
        if gap <= _REPEATS * largest:
            return 1
        if turn > 0:
            _bracket(turn, start, off, brackets)
            _ring_of(turned, 0, ring, ring_pivots)
            solve(ring, ring_pivots, off)
        for i in range(2 * b):
            start[i] += off[i]
        _keep_within(start, brackets)
    return 0


class LeftOver(NamedTuple):
    """Residual (N, 2, 1) of the equations of an element, its ``slopes`` g_z, and workspace."""

    left: Block
    slopes: Array4
    force: Vector
    rates: Matrix


@borrowing
def _left_over(j, s, T, element, target, path, out):
    """Fill ``out`` at the deflections ``path`` (N, 2).

    Returns the largest number that is left, and the largest deflection.
    """
    N, b = path.shape
    p, slip, left, slopes = element.parameters, element.slip, out.left, out.slopes
    force, rates = out.force, out.rates
    rate, most, largest = N / T, 0.0, 0.0
    for n in range(N):
        set_friction(j, (slip[n, 0], slip[n, 1]), slip[n, 2], path[n], p, s, force, rates)
        for i in range(b):
            left[n, i, 0] = (rates[i, 0] - LEAK / T * (path[n, i] - target[n, i])
                             - rate * difference(path, n, i))
            most, largest = max(most, abs(left[n, i, 0])), max(largest, abs(path[n, i]))
            for k in range(b):
                slopes[n, 0, i, k] = rates[i, 3 + k]
    return most, largest


@borrowing
def solve_around_limit(j, s, T, element, target, path):
    """Fill path (N, 2) with deflections of an element along two tangents that repeat; 1 if found.

    Newton's method for all samples at once, beginning with an element that never slides; if it does
    slide, with a return time that is reduced in turn. With z the deflection and x the displacement
    the equations are monotone in z - x: differences around a period give no energy, and the return
    to the limit is the gradient of a convex function. An element that slides a little forgets next
    to nothing in a period, so that marching around it does not end.
    """
    N, b = path.shape
    final, own = element.parameters[0], element.parameters.copy()
    left, slopes = np.empty((N, b, 1)), np.empty((N, 1, b, b))
    found = LeftOver(left, slopes, np.empty(2 * (4 + b)), np.empty((b, 4 + b)))
    softened = Sliding(own, element.slip)
    for n in range(N):
        for i in range(b):
            path[n, i] = target[n, i]
    enough = _ROUNDINGS * (3.0 * N / T + 1.0 / final)
    most, largest = _left_over(j, s, T, softened, target, path, found)
    if most <= enough * largest:
        return 1
    own[0], factor = _SOFT * T, _STIFFER
    known, before = path.copy(), own[0]
    while own[0] > final:
        own[0] = max(own[0] / factor, final)
        enough = _ROUNDINGS * (3.0 * N / T + 1.0 / own[0])
        nearly = _NEARLY if own[0] > final else _REPEATS
        most, largest = _left_over(j, s, T, softened, target, path, found)
        solved = False
        for _ in range(_MOST):
            _solve_block(slopes, T, 0, 0, b, left)
            change = 0.0
            for n in range(N):
                for i in range(b):
                    path[n, i] += left[n, i, 0]
                    change = max(change, abs(left[n, i, 0]))
            most, largest = _left_over(j, s, T, softened, target, path, found)
            if change <= nearly * largest or most <= enough * largest:
                solved = True
                break
        if solved:
            factor = min(factor * factor, _STIFFER)
        else:
            # From the last one again, by a smaller step.
            factor = math.sqrt(factor)
            if factor < _LEAST_STIFFER:
                return 0
            own[0] = before
        for n in range(N):
            for i in range(b):
                if solved:
                    known[n, i] = path[n, i]
                else:
                    path[n, i] = known[n, i]
        before = own[0]
    return 1


@kernel
def march(
    t: Vector, y: Matrix, s: SystemArrays, T: float, blocks: IntegerVector, target: Matrix,
    z: Matrix,
) -> int:
    """Fill z (N, c) with the internal variables that repeat; c = n nodes times their number.

    t (N,) are the times of the samples and y (N, d) the states, with the differences of the
    displacements as velocities; ``target`` (N, c) are the deflections to which they leak. Of a node
    as many variables in a row as ``blocks`` (n,) says act on each other, all for 0. Rounds begin
    without deflection; after two of them, Newton's method finds the start that repeats. Returns 1
    if every node has come to that, 0 if one has not.
    """
    N, n, states = len(t), len(s.rows), most_memory(s)
    slip, p = np.empty((N, 3)), np.empty(3)
    element, samples = Sliding(p, slip), Samples(t, y, T)
    z[:, :] = 0.0
    done = 1
    for j in range(n):
        k = s.memory[j]
        b = blocks[j] if blocks[j] > 0 else k
        if k > 0 and blocks[j] > 0:
            _take_slip(j, t, y, s, slip)
        for first in range(0, k, max(b, 1)):
            alone = blocks[j] > 0
            if alone:
                take_element(j, first // b, k // b, s, p)
            path = np.empty((N, b))
            at = j * states + first
            if alone and b == 2:
                if solve_around_limit(j, s, T, element, target[:, at : at + b], path) == 0:
                    done = 0
            elif march_block(j, alone, samples, s, element, target[:, at : at + b], path) == 0:
                done = 0
            for place in range(N):
                for i in range(b):
                    z[place, at + i] = path[place, i]
    return done
