"""Compiled Jacobian of the reduced contact system; see :mod:`fecontact.system.kernels`."""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import borrowing, helper, kernel, routine
from fecontact.core.copies import put
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import fused, read, spread, write
from fecontact.core.types import Array
from fecontact.system.kernels import linear_rates, prescribed_at, rates_under
from fecontact.system.node_forces import (
    axis_force,
    force_workspace,
    friction_entry,
    node_gradients,
    slip_entry,
)
from fecontact.system.nodes import (
    GroundMotion,
    SystemArrays,
    ground_motion,
    memory_of,
    most_memory,
    node_motion,
)
from fecontact.system.parameter_derivatives import (
    DerivativesWorkspace,
    given_rates,
    moves,
    node_rates,
    offset_laws,
    set_shifts,
)
from fecontact.system.polynomial_forces import (
    add_polynomial,
    add_polynomial_stiffness,
    has_polynomial,
    set_polynomial_gradient,
)

# From so many modes on the products of all nodes are added together.
_MANY_MODES = 8


@helper
def _body_jacobian(s, out):
    """Set the parts of the Jacobian that do not depend on the state."""
    m = s.rows.shape[2]
    for i in range(m):
        out[i, m + i] = 1.0
        for k in range(m):
            out[m + i, k] = -s.stiffness[i, k]
            out[m + i, m + k] = -s.damping[i, k]


@helper
def _memory_jacobian(j, s, force, rates, partial, out):
    """Add to the Jacobian what the internal variables of node j do, and what moves them."""
    _, d, m = s.rows.shape
    states = len(rates)
    first = 2 * m + j * states
    for k in range(s.memory[j]):
        row = first + k
        for axis in range(d):
            by_place = rates[k, 2] * partial[d, axis]
            by_speed = rates[k, 2] * partial[d, d + axis]
            for i in range(m):
                out[row, i] += by_place * s.rows[j, axis, i]
                out[row, m + i] += by_speed * s.rows[j, axis, i]
        for tangent in range(d - 1):
            by_slip = rates[k, slip_entry(tangent, states)]
            friction = force[friction_entry(tangent, states) + 3 + k]
            for i in range(m):
                out[row, m + i] += by_slip * s.rows[j, 2 * tangent, i]
                out[m + i, row] -= friction * s.rows[j, 2 * tangent, i]
        for other in range(s.memory[j]):
            out[row, first + other] += rates[k, 3 + other]


@helper
def _set_gradients(j, s, partial, out):
    """Fill out (d, 2 m) with the derivatives of the forces of node j to q and q'."""
    _, d, m = s.rows.shape
    for axis in range(d):
        a, b, a_rate, b_rate = (partial[axis, 0], partial[axis, 1], partial[axis, d],
                                partial[axis, d + 1])
        for i in range(m):
            along, away = s.rows[j, 0, i], s.rows[j, 1, i]
            out[axis, i] = a * along + b * away
            out[axis, m + i] = a_rate * along + b_rate * away
        for other in range(2, d):
            by_place, by_speed = partial[axis, other], partial[axis, d + other]
            for i in range(m):
                out[axis, i] += by_place * s.rows[j, other, i]
                out[axis, m + i] += by_speed * s.rows[j, other, i]


@kernel
def fill_jacobian(
    t: float, y: Vector, s: SystemArrays, rows: Block, gradients: Block, out: Matrix
) -> int:
    """Fill the Jacobian ``out``, but for the forces of contact nodes; how many nodes have forces.

    Fills ``rows`` (n, d, m) with the rows of these nodes, and ``gradients`` (n, d, 2 m) with the
    derivatives of their forces to q and q'.
    """
    n, d, m = s.rows.shape
    out[:, :] = 0.0
    _body_jacobian(s, out)
    if has_polynomial(s):
        gradient = np.empty_like(s.polynomial_rows)
        set_polynomial_gradient(y, s, gradient)
        add_polynomial_stiffness(-1.0, gradient, s, out[m:])
    moved = ground_motion(t, s)
    force, rates = force_workspace(s)
    partial = np.empty((d + 1, 2 * d))
    count = 0
    for j in range(n):
        node = node_gradients(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force,
                              rates, partial)
        _memory_jacobian(j, s, force, rates, partial, out)
        if node.normal == 0.0:
            continue
        for axis in range(d):
            for i in range(m):
                rows[count, axis, i] = s.rows[j, axis, i]
        _set_gradients(j, s, partial, gradients[count])
        count += 1
    return count


def jacobian(t: float, y: Array, s: SystemArrays, out: Array) -> None:
    """Fill out (2 m + n s, 2 m + n s) with dy'/dy."""
    n, d, m = s.rows.shape
    rows, gradients = np.empty((n, d, m)), np.empty((n, d, 2 * m))
    count = fill_jacobian(t, y, s, rows, gradients, out)
    if count:
        out[m : 2 * m, : 2 * m] += (rows[:count].reshape(count * d, m).T
                                    @ gradients[:count].reshape(count * d, 2 * m))


@borrowing
def _fill_rates(t, x, s, load, force, rates, f):
    moved = GroundMotion(0.0, 0.0, 0.0, 0.0)
    for c in range(len(t)):
        if c == 0 or t[c] != t[c - 1]:
            moved = prescribed_at(t[c], s, load)
        rates_under(load, moved, x[c], s, force, rates, f[c])


@kernel
def batch_rates(t: Vector, x: Matrix, s: SystemArrays, f: Matrix) -> None:
    """Fill f (N, 2 m + n s) with y' at times t (N,) and states x (N, 2 m + n s)."""
    force, rates = force_workspace(s)
    load = np.empty(s.rows.shape[2])
    _fill_rates(t, x, s, load, force, rates, f)


@helper
def _add_contact(j, node_force, s, partial, gradient, rate, out):
    """Add the forces ``node_force`` (d,) of node j along its axes, and their derivatives.

    ``gradient`` (d, 2 m) is filled with those to q and q'.
    """
    _, d, m = s.rows.shape
    _set_gradients(j, s, partial, gradient)
    for i in range(m):
        along, away = s.rows[j, 0, i], s.rows[j, 1, i]
        rate[m + i] += along * node_force[0] + away * node_force[1]
        for k in range(2 * m):
            out[m + i, k] += along * gradient[0, k] + away * gradient[1, k]
    for axis in range(2, d):
        for i in range(m):
            row = s.rows[j, axis, i]
            rate[m + i] += row * node_force[axis]
            for k in range(2 * m):
                out[m + i, k] += row * gradient[axis, k]


@routine
def _keep_contact(count, j, node_force, s, partial, pushed, padded, rate):
    """Add the forces of node j, and keep its rows and gradients for :func:`_add_products`."""
    _, d, m = s.rows.shape
    _set_gradients(j, s, partial, padded[count : count + d])
    for axis in range(d):
        for i in range(m):
            pushed[count + axis, i] = s.rows[j, axis, i]
            rate[m + i] += s.rows[j, axis, i] * node_force[axis]


@routine
def _add_products(count, rows, gradients, sums, A):
    """Add the sum of the products of ``count`` rows (m,) and gradients (2 m,) to the rates of q'.

    Sums of eight columns stay in registers, those of four rows at a time.
    """
    m = rows.shape[1]
    for block in range(gradients.shape[1]):
        first = block * WIDTH
        width = min(WIDTH, 2 * m - first)
        i = 0
        while i + 3 < m:
            a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
            for k in range(count):
                gradient = read(gradients[k, block])
                a = fused(spread(rows[k, i]), gradient, a)
                b = fused(spread(rows[k, i + 1]), gradient, b)
                c = fused(spread(rows[k, i + 2]), gradient, c)
                d = fused(spread(rows[k, i + 3]), gradient, d)
            write(sums[0], a)
            write(sums[1], b)
            write(sums[2], c)
            write(sums[3], d)
            for row in range(4):
                for k in range(width):
                    A[m + i + row, first + k] += sums[row, k]
            i += 4
        while i < m:
            a = spread(0.0)
            for k in range(count):
                a = fused(spread(rows[k, i]), read(gradients[k, block]), a)
            write(sums[0], a)
            for k in range(width):
                A[m + i, first + k] += sums[0, k]
            i += 1


class Derivatives(NamedTuple):
    """Rates f (N, d) at N states, and their derivatives to the states and to a parameter.

    J is (N, d, d), P (N, d), or (0, 0) where no derivative to a parameter is wanted.
    """

    f: Matrix
    J: Block
    P: Matrix


@borrowing
def _fill_derivatives(t, x, s, r, laws, workspace, found):
    # Counting references to what is made for it costs as much as the laws.
    load, load_p, shifts = workspace.load, workspace.load_p, workspace.shifts
    force, rates, partial = workspace.force, workspace.rates, workspace.partial
    node_force, node_force_p = workspace.node_force, workspace.node_force_p
    stiffening, memory, pushed = workspace.stiffening, workspace.memory, workspace.pushed
    gradients = workspace.gradients
    padded = gradients.reshape((len(gradients), gradients.shape[1] * WIDTH))
    f, J, P = found.f, found.J, found.P
    n, d, m = s.rows.shape
    states = len(rates)
    differs = len(P) > 0
    moved, moved_p = GroundMotion(0.0, 0.0, 0.0, 0.0), GroundMotion(0.0, 0.0, 0.0, 0.0)
    body_moves = differs and (moves(r.stiffness) or moves(r.damping))
    basis_moves = differs and moves(r.rows.reshape((n, d * m)))
    for c in range(len(t)):
        y, out, A = x[c], f[c], J[c]
        if c == 0 or t[c] != t[c - 1]:
            moved = prescribed_at(t[c], s, load)
            if differs:
                moved_p = given_rates(t[c], s, r, laws, load_p)
        A[:, :] = 0.0
        linear_rates(load, y, s, out)
        _body_jacobian(s, A)
        if has_polynomial(s):
            add_polynomial(y, s, stiffening, out[m : 2 * m])
            add_polynomial_stiffness(-1.0, stiffening, s, A[m:])
        if differs:
            P[c, :] = 0.0
            if body_moves:
                linear_rates(load_p, y, r, P[c])
                P[c, :m] = 0.0
            else:
                put(load_p, P[c, m : 2 * m])
        count = 0
        for j in range(n):
            z = memory_of(j, y, s)
            node = node_gradients(j, node_motion(j, y, s), moved, z, s, force, rates, partial)
            first = 2 * m + j * states
            for k in range(s.memory[j]):
                out[first + k] = rates[k, 0]
            _memory_jacobian(j, s, force, rates, partial, A)
            for axis in range(d):
                node_force[axis] = axis_force(axis, node, force, rates, s)
            if differs:
                set_shifts(j, y, s, r, basis_moves, moved, moved_p, shifts)
                pressing_p = node_rates(j, node, z, s, laws, workspace)
                for axis in range(d):
                    for i in range(m):
                        P[c, m + i] += s.rows[j, axis, i] * node_force_p[axis]
                    if basis_moves and node.normal != 0.0:
                        for i in range(m):
                            P[c, m + i] += r.rows[j, axis, i] * node_force[axis]
                for k in range(s.memory[j]):
                    P[c, first + k] = rates[k, 2] * pressing_p + memory[k]
                    for tangent in range(d - 1):
                        P[c, first + k] += (rates[k, slip_entry(tangent, states)]
                                            * shifts[d + 2 * tangent])
            if node.normal != 0.0 and m < _MANY_MODES:
                _add_contact(j, node_force, s, partial, workspace.gradient, out, A)
            elif node.normal != 0.0:
                _keep_contact(count, j, node_force, s, partial, pushed, padded, out)
                count += d
        if count > 0:
            _add_products(count, pushed, gradients, workspace.sums, A)


@kernel
def batch_derivatives(
    t: Vector, x: Matrix, s: SystemArrays, r: SystemArrays, h: float, f: Matrix, J: Block,
    P: Matrix,
) -> None:
    """Fill f as :func:`batch_rates`, J (N, d, d) with dy'/dy, and P (N, d) with dy'/dp.

    The state has d = 2 m + n s entries. r holds the derivatives of all arrays to the parameter p,
    h is the step of differences in it, for laws; P is (0, 0) where no derivative to a parameter is
    wanted.
    """
    n, d, m = s.rows.shape
    step = h if len(P) > 0 else 0.0
    force, rates = force_workspace(s)
    offset_force, offset_rates = force_workspace(s)
    blocks = (2 * m + WIDTH - 1) // WIDTH
    workspace = DerivativesWorkspace(
        np.empty(m), np.empty(m), force, rates, np.empty((d + 1, 2 * d)), np.empty(d),
        np.empty((d, 2 * m)), np.empty((n * d, m)), np.zeros((n * d, blocks, WIDTH)),
        np.empty((4, WIDTH)), np.empty_like(s.polynomial_rows), offset_force, offset_rates,
        np.empty(most_memory(s)), np.empty(2 * d), np.empty(d))
    _fill_derivatives(t, x, s, r, offset_laws(s, r, step), workspace, Derivatives(f, J, P))
