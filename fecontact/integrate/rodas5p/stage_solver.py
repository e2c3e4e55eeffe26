"""Linear systems of an implicit step, reduced to the size of the modes.

With G = 1 / (h gamma) a stage solves (G - J) u = r for u = [u_q, u_v, u_z]. The parts of J are

    q' = v                  v' = Jq q + Jv v - sum_j Tx_j R_z z_j          z' = Zw w + Zz z

with w the place and velocity of the node. Per node z is eliminated,

    u_z = (G - Zz)^-1 (r_z + Zw w),

which adds e Zw, e = R_z (G - Zz)^-1, to the derivatives of the friction force; and u_q = (r_q +
u_v) / G leaves

    (G^2 - G Jv - Jq) u_v = G (r_v - sum_j Tx_j e_j r_z) + Jq r_q.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.dense_lu import factorise_within, solve_within
from fecontact.core.records import Matrix, allocate
from fecontact.core.simd.functions import at_unknown_place, by_kind
from fecontact.core.simd.vectors import select
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.integrate.rodas5p.dynamics import change_of, project
from fecontact.system.node_forces import friction_entry, slip_entry
from fecontact.system.nodes import AXES, MEMORY, MODES, NODES
from fecontact.system.polynomial_forces import add_polynomial_stiffness, has_polynomial


class Reduced(NamedTuple):
    """The reduced system of a step.

    J = [Jq, Jv] (m, 2 m); factors (m, m), their first columns and pivots (m,) of its matrix; per
    node the inverse of G - Zz (n, s, s) and e (n, s), in space (n, 2 s), for both tangents; room to
    work in: (m,), (4, 2 n) and (2 m, 2 n), in space (6, 3 n) and (2 m, 3 n). For few modes the
    ``solver`` (m, 2 m) of :func:`set_solver`.
    """

    J: Annotated[Array, MODES, 2 * MODES]
    factors: Annotated[Array, MODES, MODES]
    starts: Annotated[Integers, MODES]
    pivots: Annotated[Integers, MODES]
    inverse: Annotated[Array, NODES, MEMORY, MEMORY]
    weights: Annotated[Array, NODES, (AXES - 1) * MEMORY]
    workspace: Annotated[Array, MODES]
    coefficients: Annotated[Array, 2 * AXES, AXES * NODES]
    force_jacobian: Annotated[Array, 2 * MODES, AXES * NODES]
    solver: Matrix


# So few modes are solved for by the matrix that makes u_v of right sides.
_FEW = 4


def reduced_for(modes: int, nodes: int, states: int, dimension: int) -> Reduced:
    """Zeros for a system of so many modes, contact nodes and internal variables per node."""
    return allocate(Reduced, {MODES: modes, NODES: nodes, MEMORY: states, AXES: dimension},
                    solver=np.zeros((modes, 2 * modes) if modes <= _FEW else (0, 0)))


@routine
def eliminate_memory(G, s, g, w):
    """Fill the inverse and the weights of the nodes, by Gauss-Jordan elimination.

    The inverse itself is wanted, of a few rows that need no pivoting: G outweighs the diagonal of
    Zz, which is negative for all that relaxes.
    """
    n, states = w.inverse.shape[0], w.inverse.shape[1]
    for j in range(n):
        inverse = w.inverse[j]
        for k in range(states):
            for other in range(states):
                inverse[k, other] = -g.rates[j, k, 3 + other]
            inverse[k, k] += G
        for k in range(states):
            pivot = 1.0 / inverse[k, k]
            inverse[k, k] = 1.0
            for c in range(states):
                inverse[k, c] *= pivot
            for i in range(states):
                if i != k:
                    factor = inverse[i, k]
                    inverse[i, k] = 0.0
                    for c in range(states):
                        inverse[i, c] -= factor * inverse[k, c]
        for tangent in range(w.weights.shape[1] // max(states, 1)):
            first = friction_entry(tangent, states) + 3
            for k in range(states):
                total = 0.0
                for other in range(s.memory[j]):
                    total += g.force[j, first + other] * inverse[other, k]
                w.weights[j, tangent * states + k] = total


# Columns that are multiplied at a time: what the rows hold there stays in the caches.
_PANEL = 512


@helper
def add_products(a, b, ends, columns, out):
    """Add to out[i, k] the products of parts of the rows a_i and b_k, four by four at a time.

    ``ends`` are first and last i, first and last k; ``columns`` those of a and b.
    """
    top, bottom, first, last = ends[0], ends[1], np.int64(ends[2]), np.int64(ends[3])
    below, beyond = bottom - (bottom - top) % 4, last - (last - first) % 4
    left, right = np.int64(columns[0]), np.int64(columns[1])
    while left < right:
        end = min(left + _PANEL, right)
        if below > top and beyond > first:
            _add_by_fours(a, b, (top, below, first, beyond), (left, end), out)
        if beyond < last:
            _add_by_twos(a, b, (top, below, beyond, last), (left, end), out)
        if below < bottom:
            _add_by_twos(a, b, (below, bottom, first, last), (left, end), out)
        left = end


@routine
def _add_by_fours(a, b, ends, columns, out):
    """Body of :func:`add_products` for numbers of rows that four divides."""
    # Unsigned: loops over indices that might be negative are not vectorised.
    left, right = np.uint64(columns[0]), np.uint64(columns[1])
    for i in range(ends[0], ends[1], 4):
        for k in range(ends[2], ends[3], 4):
            s00, s01, s02, s03, s10, s11, s12, s13 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            s20, s21, s22, s23, s30, s31, s32, s33 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(left, right):
                w, x, y, z = a[i, j], a[i + 1, j], a[i + 2, j], a[i + 3, j]
                p, q, u, v = b[k, j], b[k + 1, j], b[k + 2, j], b[k + 3, j]
                s00 += w * p
                s01 += w * q
                s02 += w * u
                s03 += w * v
                s10 += x * p
                s11 += x * q
                s12 += x * u
                s13 += x * v
                s20 += y * p
                s21 += y * q
                s22 += y * u
                s23 += y * v
                s30 += z * p
                s31 += z * q
                s32 += z * u
                s33 += z * v
            for row, sums in ((i, (s00, s01, s02, s03)), (i + 1, (s10, s11, s12, s13)),
                              (i + 2, (s20, s21, s22, s23)), (i + 3, (s30, s31, s32, s33))):
                out[row, k] += sums[0]
                out[row, k + 1] += sums[1]
                out[row, k + 2] += sums[2]
                out[row, k + 3] += sums[3]


@routine
def _add_by_twos(a, b, ends, columns, out):
    """Body of :func:`add_products` for few rows, two by two at a time."""
    top, bottom, first, last = ends
    left, right = np.uint64(columns[0]), np.uint64(columns[1])
    for i in range(top, bottom - 1, 2):
        for k in range(first, last - 1, 2):
            a00, a01, a10, a11 = 0.0, 0.0, 0.0, 0.0
            for j in range(left, right):
                x, y = a[i, j], a[i + 1, j]
                u, v = b[k, j], b[k + 1, j]
                a00 += x * u
                a01 += x * v
                a10 += y * u
                a11 += y * v
            out[i, k] += a00
            out[i, k + 1] += a01
            out[i + 1, k] += a10
            out[i + 1, k + 1] += a11
        if (last - first) % 2:
            a00, a10 = 0.0, 0.0
            for j in range(left, right):
                a00 += a[i, j] * b[last - 1, j]
                a10 += a[i + 1, j] * b[last - 1, j]
            out[i, last - 1] += a00
            out[i + 1, last - 1] += a10
    if (bottom - top) % 2:
        for k in range(first, last):
            total = 0.0
            for j in range(left, right):
                total += a[bottom - 1, j] * b[k, j]
            out[bottom - 1, k] += total


@helper
def set_force_jacobian(blocks, g, w, force_jacobian):
    """Fill the answers of the node forces to the motion of each mode, (2 m, 2 n) or (2 m, 3 n).

    ``g`` are the Gradients, ``w`` holds the weights and workspace for coefficients.
    """
    shapes = blocks.shapes
    m, n, d = len(shapes), len(g.partial), g.partial.shape[2] // 2
    c = w.coefficients
    for at in range(blocks.used[0]):
        j = blocks.nodes[at]
        for axis in range(d):
            for k in range(2 * d):
                c[k, axis * n + at] = g.partial[j, axis, k]
        _add_memory(at, j, g, w)
    for part in range(len(blocks.parts)):
        top, bottom, left, right = block_at(blocks.parts, part)
        for k in range(top, bottom):
            along, away, across = shapes[k, :n], shapes[k, n:], shapes[k, n:]
            if d > 2:
                across = shapes[k, 2 * n :]
            for first in range(0, shapes.shape[1], n):
                by_place, by_speed = force_jacobian[k, first:], force_jacobian[m + k, first:]
                # Named outside the loop, or it is not vectorised.
                c0, c1, c2, c3 = c[0, first:], c[1, first:], c[d, first:], c[d + 1, first:]
                for j in range(left, right):
                    by_place[j] = c0[j] * along[j] + c1[j] * away[j]
                    by_speed[j] = c2[j] * along[j] + c3[j] * away[j]
                if d > 2:
                    c4, c5 = c[2, first:], c[5, first:]
                    for j in range(left, right):
                        by_place[j] += c4[j] * across[j]
                        by_speed[j] += c5[j] * across[j]


@helper
def _add_memory(at, j, g, w):
    """Add to the coefficients of node j, at a place, what its internal variables do meanwhile."""
    n, d, states = len(g.partial), g.partial.shape[2] // 2, w.inverse.shape[1]
    if states == 0:
        return
    c = w.coefficients
    for tangent in range(d - 1):
        place, weights = 2 * tangent * n + at, w.weights[j, tangent * states :]
        pressing = 0.0
        for k in range(states):
            pressing += weights[k] * g.rates[j, k, 2]
        for k in range(2 * d):
            c[k, place] -= pressing * g.partial[j, d, k]
        for other in range(d - 1):
            slip = 0.0
            for k in range(states):
                slip += weights[k] * g.rates[j, k, slip_entry(other, states)]
            c[d + 2 * other, place] -= slip


@routine
def assemble(s, blocks, g, w):
    """Fill J = [Jq, Jv] by the matrices, polynomial forces, and node forces.

    The latter by shapes applied to what the modes' motion does to the node forces.
    """
    set_force_jacobian(blocks, g, w, w.force_jacobian)
    m = len(w.J)
    for part in range(len(blocks.coupled)):
        top, bottom, left, right = block_at(blocks.coupled, part)
        for i in range(top, bottom):
            by_place, by_speed = w.J[i, :m], w.J[i, m:]
            for k in range(left, right):
                by_place[k] = -s.stiffness[i, k]
                by_speed[k] = -s.damping[i, k]
    if has_polynomial(s):
        add_polynomial_stiffness(-1.0, g.polynomial, s, w.J)
    for pair in range(len(blocks.pairs)):
        add_products(blocks.shapes, w.force_jacobian, block_at(blocks.pairs, pair),
                     (np.uint64(blocks.pairs[pair, 4]), np.uint64(blocks.pairs[pair, 5])), w.J)


@routine
def factorise_step(G, blocks, w):
    """Factorise G^2 - G Jv - Jq."""
    m = len(w.pivots)
    if len(blocks.coupled) > 1:
        for i in range(m):
            w.factors[i, w.starts[i] : blocks.reach[1, i]] = 0.0
    for part in range(len(blocks.coupled)):
        top, bottom, left, right = block_at(blocks.coupled, part)
        row, column = blocks.coupled[part, 4] - top, blocks.coupled[part, 5]
        for i in range(top, bottom):
            by_place, by_speed = w.J[i, left:right], w.J[i, m + np.int64(left) :]
            factors = w.factors[row + i, column:]
            for k in range(len(by_place)):
                factors[k] = -G * by_speed[k] - by_place[k]
    for i in range(m):
        w.factors[i, i] += G * G
    eliminate_modes(G, blocks, w)


@helper
def _factorise(G, blocks, w):
    """Factorise ``w.factors``; for few modes fill ``w.solver`` too."""
    factorise_within(w.factors, blocks.reach, w.starts, w.pivots)
    if len(w.pivots) <= _FEW:
        set_solver(G, blocks, w, w.solver)
        if not G * G < np.inf:  # noqa: SIM300
            # All answers would be zero.
            w.solver[0, 0] = np.nan


@helper
def _invert(G, blocks, w):
    """Fill ``w.solver`` for eight systems of few modes and one block.

    Gauss-Jordan elimination with row interchanges, lane by lane by selection.
    """
    m, work, inverse = len(w.pivots), w.factors, w.solver[:, len(w.pivots) :]
    for i in range(m):
        for k in range(m):
            inverse[i, k] = G if i == k else 0.0
    for k in range(m):
        for i in range(k + 1, m):
            larger = abs(work[i, k]) > abs(work[k, k])
            _exchange(larger, work[:, k:], k, i)
            _exchange(larger, inverse, k, i)
        pivot = 1.0 / work[k, k]
        for c in range(k + 1, m):
            work[k, c] *= pivot
        for c in range(m):
            inverse[k, c] *= pivot
        for i in range(m):
            if i != k:
                factor = work[i, k]
                for c in range(k + 1, m):
                    work[i, c] -= factor * work[k, c]
                for c in range(m):
                    inverse[i, c] -= factor * inverse[k, c]
    per_G = 1.0 / G
    for i in range(m):
        for k in range(m):
            total = 0.0
            for c in range(m):
                total += inverse[i, c] * w.J[c, k]
            w.solver[i, k] = total * per_G


@helper
def _exchange(where, table, k, i):
    """Exchange two rows of a table in the lanes where a condition holds."""
    before = at_unknown_place(table)
    for c in range(table.shape[1]):
        above, below = before[k, c], before[i, c]
        table[k, c], table[i, c] = select(where, below, above), select(where, above, below)


eliminate_modes = by_kind(_factorise, _invert)


@routine
def set_solver(G, blocks, w, out):
    """Fill out (m, 2 m), which makes u_v of a right side: the factors' F^-1 [Jq, G I]."""
    m = len(w.pivots)
    x = w.workspace
    for c in range(m):
        for i in range(m):
            x[i] = 0.0
        x[blocks.position[c]] = G
        solve_within(w.factors, blocks.reach, w.starts, w.pivots, x)
        for i in range(m):
            out[i, m + c] = x[blocks.position[i]]
    for i in range(m):
        for k in range(m):
            out[i, k] = 0.0
        for c in range(m):
            part = out[i, m + c] / G
            for k in range(m):
                out[i, k] += part * w.J[c, k]


@helper
def _solve_by_factors(G, blocks, w, r):
    """Fill ``w.workspace`` with u_v, in the order of elimination."""
    x, m = w.workspace, len(w.pivots)
    for i in range(m):
        x[blocks.position[i]] = G * r[m + i]
    for part in range(len(blocks.coupled)):
        top, bottom, left, right = block_at(blocks.coupled, part)
        row = blocks.coupled[part, 4]
        for i in range(top, bottom):
            total = 0.0
            for k in range(left, right):
                total += w.J[i, k] * r[k]
            x[row + i - top] += total
    solve_within(w.factors, blocks.reach, w.starts, w.pivots, x)


@helper
def _never(G, blocks, w, r):
    """Eight systems have few modes."""


solve_modes = by_kind(_solve_by_factors, _never)


@helper
def solve_stage(G, s, blocks, g, w, r, motion, out):
    """Fill ``out`` (size,) with u for the right side r, which is overwritten.

    ``motion`` (3, d n) is a work array.
    """
    shapes = blocks.shapes
    m, n, d = len(shapes), len(g.partial), g.partial.shape[2] // 2
    states = w.inverse.shape[1]
    if states > 0:
        for j in range(n):
            for tangent in range(d - 1):
                total = 0.0
                for k in range(states):
                    total += w.weights[j, tangent * states + k] * r[2 * m + j * states + k]
                motion[2, 2 * tangent * n + j] = -total
        for part in range(len(blocks.parts)):
            top, bottom, left, right = block_at(blocks.parts, part)
            for i in range(top, bottom):
                total = 0.0
                for tangent in range(d - 1):
                    rows, forces = shapes[i, 2 * tangent * n :], motion[2, 2 * tangent * n :]
                    for j in range(left, right):
                        total += rows[j] * forces[j]
                r[m + i] += total
    part = 1.0 / G
    if m <= _FEW:
        for i in range(m):
            speed = 0.0
            for k in range(m):
                speed += w.solver[i, k] * r[k] + w.solver[i, m + k] * r[m + k]
            out[i], out[m + i] = part * (r[i] + speed), speed
    else:
        solve_modes(G, blocks, w, r)
        x = w.workspace
        for i in range(m):
            out[i], out[m + i] = part * (r[i] + x[blocks.position[i]]), x[blocks.position[i]]
    if states == 0:
        return
    project(blocks, out, motion[0], motion[1])
    for j in range(n):
        pressing = change_of(g.partial[j, d], j, n, motion)
        first = 2 * m + j * states
        for k in range(states):
            total = 0.0
            for other in range(states):
                known = r[first + other] + g.rates[j, other, 2] * pressing
                for tangent in range(d - 1):
                    known += (g.rates[j, other, slip_entry(tangent, states)]
                              * motion[1, 2 * tangent * n + j])
                total += w.inverse[j, k, other] * known
            out[first + k] = total
