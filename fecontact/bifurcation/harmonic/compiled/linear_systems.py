"""Linear systems of compiled steps, with the modes that contact couples over the harmonics.

Modes far above the harmonics follow their loads almost statically, and contact is soft beside their
stiffness: their coefficients are solved for each by itself, with the mean derivatives, the others
together. What that neglects is made good by iteration with all derivatives at the samples.
"""

import math

from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.harmonic.compiled.evaluation import balance, take_pushes, take_states
from fecontact.core.compiled import helper, routine
from fecontact.core.dense_lu import factorise, solve

# Coupling of a mode, relative to its own stiffness, from which it is solved for with the others,
# and the one up to which it may be left.
_COUPLED, _LEFT = 0.03, 0.2
# Iterations of a solution, and relative error of one that is precise.
_ROUNDS, PRECISE = 40, 1e-11


@helper
def inner(a, b):
    """Sum a b."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@routine
def choose_coupled(T, e):
    """Order the modes by how much they are coupled, and fill what is left ``alone``.

    Derivatives at the samples are those evaluated last. As many modes are coupled as there is room
    for; returns 0 if that leaves more than it may, else 1.
    """
    workspace = e.workspace
    most = int(math.sqrt(float(len(workspace.a)))) // e.values.shape[1]
    m, L, N = e.springs.shape[1], e.values.shape[1], len(e.tau)
    linear, coupling, extent = workspace.linear, workspace.perturbed, workspace.extent
    fastest = 2.0 * math.pi * (L // 2) / T
    for i in range(m):
        for j in range(2 * m):
            extent[0, i, j], extent[1, i, j], extent[2, i, j] = math.inf, -math.inf, 0.0
    for n in range(N):
        for i in range(m):
            for j in range(2 * m):
                value = workspace.J[n, m + i, j]
                extent[0, i, j] = min(extent[0, i, j], value)
                extent[1, i, j] = max(extent[1, i, j], value)
                extent[2, i, j] += value / N
    for i in range(m):
        total = 0.0
        for part in range(2):
            for j in range(m):
                k = part * m + j
                spread = extent[1, i, k] - extent[0, i, k]
                fixed = linear[part, i, j] - extent[2, i, k]
                if j == i:
                    workspace.alone[part, i] = fixed
                else:
                    spread += abs(fixed)
                total += fastest * spread if part == 1 else spread
        own = math.inf
        for k in range(L // 2 + 1):
            turn = 2.0 * math.pi * k / T
            a, b = workspace.alone[0, i] - turn * turn, turn * workspace.alone[1, i]
            own = min(own, math.sqrt(a * a + b * b))
        coupling[i] = total / own if own > 0.0 else math.inf
        workspace.order[i] = i
    order = workspace.order
    for i in range(m):
        for j in range(i, 0, -1):
            if coupling[order[j]] > coupling[order[j - 1]]:
                order[j], order[j - 1] = order[j - 1], order[j]
    count = 0
    while count < m and not coupling[order[count]] <= _COUPLED:
        count += 1
    workspace.coupled[0] = max(1, min(count, most))
    left = workspace.coupled[0]
    return 1 if left == m or coupling[workspace.order[left]] <= _LEFT else 0


@helper
def _alone(j, k, T, e, a, b):
    """Coefficients of the cosine and sine k > 0 of mode j for right sides a, b."""
    turn = 2.0 * math.pi * k / T
    own, loss = e.workspace.alone[0, j] - turn * turn, turn * e.workspace.alone[1, j]
    size = own * own + loss * loss
    return (own * a - loss * b) / size, (loss * a + own * b) / size


@helper
def _each_alone(T, e, x):
    """Solve in x (n,) for the modes that are left alone."""
    m, H = e.springs.shape[1], e.values.shape[1] // 2
    for place in range(e.workspace.coupled[0], m):
        j = e.workspace.order[place]
        x[j] /= e.workspace.alone[0, j]
        for k in range(1, H + 1):
            c, s = (2 * k - 1) * m + j, 2 * k * m + j
            x[c], x[s] = _alone(j, k, T, e, x[c], x[s])


@helper
def factorise_with(row, T, e):
    """Factorise ``condensed`` with a further row (n + 1,)."""
    workspace = e.workspace
    m, L, count = e.springs.shape[1], e.values.shape[1], workspace.coupled[0]
    n = len(workspace.residual)
    whole, k = L * count, len(e.kept) * count
    condensed = workspace.condensed[: whole * (whole + 1)].reshape((whole, whole + 1))
    a = workspace.a[: (k + 1) * (k + 1)].reshape((k + 1, k + 1))
    for r in range(len(e.kept)):
        q = e.kept[r]
        for place in range(count):
            i, found = r * count + place, condensed[q * count + place]
            for other in range(len(e.kept)):
                first, column = other * count, e.kept[other] * count
                for j in range(count):
                    a[i, first + j] = found[column + j]
            a[i, k] = found[whole]
            a[k, i] = row[q * m + workspace.order[place]]
    a[k, k] = row[n]
    if count < m:
        for i in range(n):
            workspace.perturbed[i] = workspace.column[i]
        _each_alone(T, e, workspace.perturbed)
        for place in range(count, m):
            for q in range(L):
                i = q * m + workspace.order[place]
                a[k, k] -= row[i] * workspace.perturbed[i]
    factorise(a, k + 1, workspace.pivots[: k + 1])


@helper
def _once(row, T, e, x):
    """Replace x (n + 1,) by the solution, modes that are left alone being so."""
    workspace, parts = e.workspace, e.workspace.vectors[7]
    m, L, count = e.springs.shape[1], e.values.shape[1], workspace.coupled[0]
    n = len(workspace.residual)
    k = len(e.kept) * count
    a = workspace.a[: (k + 1) * (k + 1)].reshape((k + 1, k + 1))
    if count < m:
        _each_alone(T, e, x)
        for place in range(count, m):
            for q in range(L):
                i = q * m + workspace.order[place]
                x[n] -= row[i] * x[i]
    known = parts[: k + 1]
    for r in range(len(e.kept)):
        for place in range(count):
            known[r * count + place] = x[e.kept[r] * m + workspace.order[place]]
    known[k] = x[n]
    solve(a, workspace.pivots[: k + 1], known)
    for r in range(len(e.kept)):
        for place in range(count):
            x[e.kept[r] * m + workspace.order[place]] = known[r * count + place]
    x[n] = known[k]
    for place in range(count, m):
        for q in range(L):
            i = q * m + workspace.order[place]
            x[i] -= workspace.perturbed[i] * x[n]


@helper
def _applied(row, x, T, e, out):
    """Fill out (n + 1,) with the derivatives at the samples, and the row, times x (n + 1,)."""
    workspace, forces = e.workspace, e.workspace.vectors[7]
    m, N, n = e.springs.shape[1], len(e.tau), len(workspace.residual)
    take_states(x, T, e, workspace.y)
    for k in range(N):
        for i in range(m):
            total = 0.0
            for j in range(2 * m):
                total += workspace.J[k, m + i, j] * workspace.y[k, j]
            forces[i] = total
        for i in range(m):
            workspace.y[k, m + i] = forces[i]
    take_pushes(workspace.y, e)
    balance(x, T, 0.0, e, out)
    for i in range(n):
        out[i] += workspace.column[i] * x[n]
    out[n] = inner(row, x)


@routine
def solve_with(row, weights, T, tolerance, e, x):
    """Replace the right side x (n + 1,) by the solution, to a relative tolerance.

    Returns 0 if the iteration does not converge, else 1.
    """
    workspace = e.workspace
    if workspace.coupled[0] == e.springs.shape[1]:
        _once(row, T, e, x)
        return 1
    wanted, change, seen = workspace.vectors[6], workspace.vectors[8], workspace.vectors[9]
    n = len(workspace.residual)
    for i in range(n + 1):
        wanted[i] = x[i]
    _once(row, T, e, x)
    for _ in range(_ROUNDS):
        _applied(row, x, T, e, seen)
        for i in range(n + 1):
            change[i] = wanted[i] - seen[i]
        _once(row, T, e, change)
        for i in range(n + 1):
            x[i] += change[i]
        size = weighted_norm(weights, x)
        off = weighted_norm(weights, change)
        if not off < math.inf:
            return 0
        if off <= tolerance * size:
            return 1
    return 0
