"""Stages of the columns of derivatives in a step of the integrator.

The stage systems are those of :mod:`fecontact.integrate.rodas5p.variational`, with the derivatives
of the node forces ``inside`` a stage and ``ahead``, along it. Without internal variables all
columns go at once, by dense matrices of the size of the modes; else each goes from node to node.
"""

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.dense_lu import solve_within
from fecontact.integrate.rodas5p import dynamics, stage_solver, tableau
from fecontact.system.nodes import in_space

# Products of matrices with more multiplications than these go to BLAS.
_LARGE = 2000


@helper
def set_solver(G, blocks, reduced, v):
    """Fill v.solver (m, 2 m), which makes u_v of a right side: the factors' F^-1 [Jq, G I]."""
    m = len(reduced.pivots)
    x = reduced.room
    for c in range(2 * m):
        for i in range(m):
            x[blocks.position[i]] = reduced.J[i, c] if c < m else 0.0
        if c >= m:
            x[blocks.position[c - m]] = G
        solve_within(reduced.factors, blocks.reach, reduced.starts, reduced.pivots, x)
        for i in range(m):
            v.solver[i, c] = x[blocks.position[i]]


@helper
def _products(a, b, out):
    """As :func:`fecontact.integrate.rodas5p.stage_solver.products`; by BLAS where it pays."""
    if len(a) * len(b) * a.shape[1] > _LARGE:
        np.dot(a, b.T, out)
    else:
        stage_solver.products(a, b, out)


@helper
def all_at_once(i, h, G, s, blocks, reduced, forced, varies, v):
    """Solve stage i of all columns; systems without internal variables."""
    count, size = v.columns.shape
    m = len(v.none)
    for matrix, gradients in ((v.inside_matrix, v.inside), (v.ahead_matrix, v.ahead)):
        stage_solver.set_answers(blocks, gradients, reduced)
        _products(blocks.shapes, reduced.answers, matrix)
    for row in range(m):
        for k in range(m):
            v.inside_matrix[row, k] -= s.stiffness[row, k]
            v.inside_matrix[row, m + k] -= s.damping[row, k]
    for c in range(count):
        own = v.stages[tableau.STAGES * c : tableau.STAGES * (c + 1)]
        tableau.combined(tableau.A[i], 1.0, v.columns[c], own, v.moved[c])
    _products(v.moved, v.inside_matrix, v.pushed)
    _products(v.columns, v.ahead_matrix, v.bent)
    rate = v.vectors[4]
    for c in range(count):
        for k in range(m):
            rate[k] = v.moved[c, m + k]
            rate[m + k] = v.pushed[c, k] + v.bent[c, k]
        if varies and c == count - 1:
            for k in range(size):
                rate[k] += forced[k]
        own = v.stages[tableau.STAGES * c : tableau.STAGES * (c + 1)]
        tableau.combined(tableau.C[i], 1.0 / h, rate, own, v.right[c])
    _products(v.right, v.solver, v.pushed)
    for c in range(count):
        out = v.stages[tableau.STAGES * c + i]
        for k in range(m):
            out[m + k] = v.pushed[c, k]
            out[k] = (v.right[c, k] + v.pushed[c, k]) / G
        if i == tableau.STAGES - 1:
            for k in range(size):
                v.after[c, k] = v.moved[c, k] + out[k]


@helper
def _push(g, s, blocks, x, w, rate):
    """Add to w[2] (d n,) the node forces, and to ``rate`` the z', that x makes by gradients g."""
    n, states, _ = g.rates.shape
    m = len(blocks.position)
    dynamics.project(blocks, x, w[0], w[1])
    for j in range(n):
        a, b, c, d = w[0, j], w[0, n + j], w[1, j], w[1, n + j]
        p = g.partial[j]
        first = 2 * m + j * states
        tangential = p[1, 0] * a + p[1, 1] * b + p[1, 2] * c + p[1, 3] * d
        pressing = p[2, 0] * a + p[2, 1] * b + p[2, 2] * c + p[2, 3] * d
        normal = p[0, 0] * a + p[0, 1] * b + p[0, 2] * c + p[0, 3] * d
        f = 0.0
        if in_space(s):
            e, f = w[0, 2 * n + j], w[1, 2 * n + j]
            tangential += p[1, 4] * e + p[1, 5] * f
            pressing += p[2, 4] * e + p[2, 5] * f
            normal += p[0, 4] * e + p[0, 5] * f
            w[2, 2 * n + j] -= (p[3, 0] * a + p[3, 1] * b + p[3, 2] * c + p[3, 3] * d
                                + p[3, 4] * e + p[3, 5] * f)
            for k in range(s.memory[j]):
                w[2, 2 * n + j] -= g.force[j, 7 + states + k] * x[first + k]
        for k in range(s.memory[j]):
            tangential += g.force[j, 3 + k] * x[first + k]
            total = g.rates[j, k, 1] * c + g.rates[j, k, 2] * pressing
            if in_space(s):
                total += g.rates[j, k, 3 + states] * f
            for other in range(s.memory[j]):
                total += g.rates[j, k, 3 + other] * x[first + other]
            rate[first + k] += total
        w[2, j] -= tangential
        w[2, n + j] += normal


@helper
def one_by_one(i, h, G, s, blocks, gradients, reduced, forced, varies, v):
    """Solve stage i of all columns; ``gradients`` are those at the start of the step."""
    count, size = v.columns.shape
    m = len(v.none)
    w, right, X, rate = v.nodes, v.vectors[1], v.vectors[2], v.vectors[4]
    for c in range(count):
        own = v.stages[tableau.STAGES * c : tableau.STAGES * (c + 1)]
        tableau.combined(tableau.A[i], 1.0, v.columns[c], own, X)
        w[2, :] = 0.0
        rate[2 * m :] = 0.0
        _push(v.ahead, s, blocks, v.columns[c], w, rate)
        _push(v.inside, s, blocks, X, w, rate)
        dynamics.gather(X, s, blocks, v.none, w[2], rate)
        if varies and c == count - 1:
            for k in range(size):
                rate[k] += forced[k]
        tableau.combined(tableau.C[i], 1.0 / h, rate, own, right)
        stage_solver.solve_stage(G, s, blocks, gradients, reduced, right, w, own[i])
        if i == tableau.STAGES - 1:
            for k in range(size):
                v.after[c, k] = X[k] + own[i, k]
