"""Compiled Jacobian of the reduced contact system; see :mod:`fecontact.system.kernels`."""

import numpy as np

from fecontact.core.compiled import borrowing, helper, kernel, routine
from fecontact.core.records import Block, Matrix, Vector
from fecontact.system.kernels import (
    body_rates,
    friction_across,
    given_at,
    node_gradients,
    rates_under,
)
from fecontact.system.nodes import (
    GroundMotion,
    SystemArrays,
    force_room,
    ground_motion,
    in_space,
    leaning,
    memory_of,
    node_motion,
)
from fecontact.system.parameter_derivatives import (
    given_rates,
    laws_beside,
    moves,
    node_rates,
    set_shifts,
)


@helper
def _body_jacobian(s, out):
    """Set the parts of the Jacobian that do not depend on the state."""
    m = s.Tx.shape[1]
    for i in range(m):
        out[i, m + i] = 1.0
        for k in range(m):
            out[m + i, k] = -s.stiffness[i, k]
            out[m + i, m + k] = -s.damping[i, k]


@helper
def _memory_jacobian(j, s, force, rates, partial, out):
    """Set the rows and columns of the Jacobian that belong to the internal variables of node j."""
    m = s.Tx.shape[1]
    first = 2 * m + j * len(rates)
    for k in range(s.memory[j]):
        row = first + k
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            out[row, i] = rates[k, 2] * (partial[2, 0] * tx + partial[2, 1] * ty)
            out[row, m + i] = rates[k, 1] * tx + rates[k, 2] * (partial[2, 2] * tx
                                                                + partial[2, 3] * ty)
            out[m + i, row] = -force[3 + k] * tx
        for other in range(s.memory[j]):
            out[row, first + other] = rates[k, 3 + other]
        if in_space(s):
            _memory_jacobian_across(j, k, s, force, rates, partial, out)


@helper
def _memory_jacobian_across(j, k, s, force, rates, partial, out):
    """Add what the motion of node j across does to its internal variable k, and the reverse."""
    m, states = s.Tx.shape[1], len(rates)
    row = 2 * m + j * states + k
    by_slip = rates[k, 3 + states]
    for i in range(m):
        across = s.T2[j, i]
        out[row, i] += rates[k, 2] * partial[2, 4] * across
        out[row, m + i] += (by_slip + rates[k, 2] * partial[2, 5]) * across
        out[m + i, row] -= force[7 + states + k] * across


@helper
def _add_across(j, count, s, partial, gradients, active):
    """Complete the rows of a node by its motion and its force along the second tangent."""
    m = s.Tx.shape[1]
    for i in range(m):
        tx, ty, across = s.Tx[j, i], s.Ty[j, i], s.T2[j, i]
        active[count, 2 * m + i] = across
        for part in range(2):
            gradients[2 * part, count, i] -= partial[1, 4 + part] * across
            gradients[2 * part + 1, count, i] += partial[0, 4 + part] * across
            gradients[4 + part, count, i] = -(
                partial[3, 2 * part] * tx + partial[3, 2 * part + 1] * ty
                + partial[3, 4 + part] * across)


@routine
def _contact_gradients(t, y, s, gradients, active, out):
    """Rows of the Jacobian's contact part, for the nodes whose normal force is not zero.

    Fills ``active`` (n, 2 m) with the rows Tx, Ty of these nodes and ``gradients`` (4, n, m) with
    the derivatives of [-T, F] of each to q (first two) and to q' (last two), applied to the
    modes. In space these are (n, 3 m) and (6, n, m), the rows T2 and the derivatives of the force
    along the second tangent last. Returns their number. The parts of friction with memory are put
    into the Jacobian ``out`` at once.
    """
    n, m = s.Tx.shape
    moved = ground_motion(t, s)
    states = s.memory.max()
    length, width = force_room(states, in_space(s))
    force, rates = np.empty(length), np.empty((states, width))
    partial = np.empty((4, 6)) if in_space(s) else np.empty((3, 4))
    count = 0
    for j in range(n):
        F, _, _ = node_gradients(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force,
                                 rates, partial)
        _memory_jacobian(j, s, force, rates, partial, out)
        if F == 0.0:
            continue
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            active[count, i] = tx
            active[count, m + i] = ty
            gradients[0, count, i] = -partial[1, 0] * tx - partial[1, 1] * ty
            gradients[1, count, i] = partial[0, 0] * tx + partial[0, 1] * ty
            gradients[2, count, i] = -partial[1, 2] * tx - partial[1, 3] * ty
            gradients[3, count, i] = partial[0, 2] * tx + partial[0, 3] * ty
        if in_space(s):
            _add_across(j, count, s, partial, gradients, active)
        count += 1
    return count


@kernel
def jacobian(t: float, y: Vector, s: SystemArrays, out: Matrix) -> None:
    """Fill out (2 m + n s, 2 m + n s) with dy'/dy."""
    n, m = s.Tx.shape
    rows = 3 if in_space(s) else 2
    gradients, active = np.empty((2 * rows, n, m)), np.empty((n, rows * m))
    out[:] = 0.0
    count = _contact_gradients(t, y, s, gradients, active, out)
    _body_jacobian(s, out)
    if count:
        Tx = np.ascontiguousarray(active[:count, :m].T)
        Ty = np.ascontiguousarray(active[:count, m : 2 * m].T)
        end = 2 * m
        out[m:end, :m] += np.dot(Tx, gradients[0, :count]) + np.dot(Ty, gradients[1, :count])
        out[m:end, m:end] += np.dot(Tx, gradients[2, :count]) + np.dot(Ty, gradients[3, :count])
        if rows == 3:
            T2 = np.ascontiguousarray(active[:count, end:].T)
            out[m:end, :m] += np.dot(T2, gradients[4, :count])
            out[m:end, m:end] += np.dot(T2, gradients[5, :count])


@borrowing
def _fill_rates(t, x, s, load, force, rates, f):
    moved = GroundMotion(0.0, 0.0, 0.0, 0.0)
    for c in range(len(t)):
        if c == 0 or t[c] != t[c - 1]:
            moved = given_at(t[c], s, load)
        rates_under(load, moved, x[c], s, force, rates, f[c])


@kernel
def batch_rates(t: Vector, x: Matrix, s: SystemArrays, f: Matrix) -> None:
    """Fill f (N, 2 m + n s) with y' at times t (N,) and states x (N, 2 m + n s)."""
    states = s.memory.max()
    length, width = force_room(states, in_space(s))
    force, rates = np.empty(length), np.empty((states, width))
    load = np.empty(s.Tx.shape[1])
    _fill_rates(t, x, s, load, force, rates, f)


@helper
def _add_contact(j, F, T, T2, s, partial, gradient, rate, out):
    """Add the forces of node j, F and those against its tangents, and their derivatives.

    ``gradient`` (2, 2 m), in space (3, 2 m), is filled with those of -T and F, and of the force
    along the second tangent, to the state.
    """
    m = s.Tx.shape[1]
    space = in_space(s)
    for k in range(m):
        tx, ty = s.Tx[j, k], s.Ty[j, k]
        for part in range(2):
            gradient[0, part * m + k] = (-partial[1, 2 * part] * tx
                                         - partial[1, 2 * part + 1] * ty)
            gradient[1, part * m + k] = (partial[0, 2 * part] * tx
                                         + partial[0, 2 * part + 1] * ty)
            if space:
                across = s.T2[j, k]
                gradient[0, part * m + k] -= partial[1, 4 + part] * across
                gradient[1, part * m + k] += partial[0, 4 + part] * across
                gradient[2, part * m + k] = -(
                    partial[3, 2 * part] * tx + partial[3, 2 * part + 1] * ty
                    + partial[3, 4 + part] * across)
    for i in range(m):
        tx, ty = s.Tx[j, i], s.Ty[j, i]
        rate[m + i] += ty * F - tx * T
        for k in range(2 * m):
            out[m + i, k] += tx * gradient[0, k] + ty * gradient[1, k]
    if space:
        for i in range(m):
            across = s.T2[j, i]
            rate[m + i] -= across * T2
            for k in range(2 * m):
                out[m + i, k] += across * gradient[2, k]


@borrowing
def _fill_derivatives(t, x, s, r, laws, vectors, matrices, f, J, P):
    # Counting references to what is made for it costs as much as the laws.
    load, load_p, force, room, memory, shifts = vectors
    rates, room_rates, partial, gradient = matrices
    n, m = s.Tx.shape
    states = len(rates)
    differs = len(P) > 0
    moved, moved_p = GroundMotion(0.0, 0.0, 0.0, 0.0), GroundMotion(0.0, 0.0, 0.0, 0.0)
    space = in_space(s)
    body_moves = differs and (moves(r.stiffness) or moves(r.damping))
    basis_moves = differs and (moves(r.Tx) or moves(r.Ty) or moves(r.T2))
    for c in range(len(t)):
        y, out, A = x[c], f[c], J[c]
        if c == 0 or t[c] != t[c - 1]:
            moved = given_at(t[c], s, load)
            if differs:
                moved_p = given_rates(t[c], s, r, laws, load_p)
        A[:, :] = 0.0
        body_rates(load, y, s, out)
        _body_jacobian(s, A)
        if differs:
            P[c, :] = 0.0
            if body_moves:
                body_rates(load_p, y, r, P[c])
                P[c, :m] = 0.0
            else:
                P[c, m : 2 * m] = load_p
        for j in range(n):
            z = memory_of(j, y, s)
            F, T, contact = node_gradients(j, node_motion(j, y, s), moved, z, s, force, rates,
                                           partial)
            first = 2 * m + j * states
            for k in range(s.memory[j]):
                out[first + k] = rates[k, 0]
            _memory_jacobian(j, s, force, rates, partial, A)
            T2 = 0.0
            if space:
                T2 = leaning(F, friction_across(force, rates), contact.slope_across, s)
            if differs:
                set_shifts(j, y, s, r, basis_moves, moved, moved_p, shifts)
                found = node_rates(j, contact, z, F, shifts, s, laws, force, partial,
                                   (room, room_rates, memory))
                for i in range(m):
                    P[c, m + i] += s.Ty[j, i] * found.F - s.Tx[j, i] * found.T
                if space:
                    for i in range(m):
                        P[c, m + i] -= s.T2[j, i] * found.T2
                if basis_moves and F != 0.0:
                    for i in range(m):
                        P[c, m + i] += r.Ty[j, i] * F - r.Tx[j, i] * T
                    if space:
                        for i in range(m):
                            P[c, m + i] -= r.T2[j, i] * T2
                for k in range(s.memory[j]):
                    P[c, first + k] = (rates[k, 1] * found.slip + rates[k, 2] * found.pressing
                                       + memory[k])
                    if space:
                        P[c, first + k] += rates[k, 3 + states] * found.slip_across
            if F != 0.0:
                _add_contact(j, F, T, T2, s, partial, gradient, out, A)


@kernel
def batch_derivatives(
    t: Vector, x: Matrix, s: SystemArrays, r: SystemArrays, h: float, f: Matrix, J: Block,
    P: Matrix,
) -> None:
    """As :func:`batch_rates`, and fill J (N, d, d), d = 2 m + n s, with dy'/dy and P with dy'/dp.

    r holds the derivatives of all arrays to the parameter p, h is the step of differences in it,
    for laws; P is (N, d), or (0, 0) where no derivative to a parameter is wanted.
    """
    m = s.Tx.shape[1]
    states = s.memory.max()
    step = h if len(P) > 0 else 0.0
    length, width = force_room(states, in_space(s))
    tangents = 2 if in_space(s) else 1
    _fill_derivatives(t, x, s, r, laws_beside(s, r, step),
                      (np.empty(m), np.empty(m), np.empty(length), np.empty(length),
                       np.empty(states), np.empty(2 + 2 * tangents)),
                      (np.empty((states, width)), np.empty((states, width)),
                       np.empty((2 + tangents, 2 + 2 * tangents)),
                       np.empty((1 + tangents, 2 * m))), f, J, P)
