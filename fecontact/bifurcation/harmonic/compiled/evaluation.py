"""Residual of harmonic balance of a contact system and its derivatives, in compiled code.

The equations are those of :class:`fecontact.bifurcation.harmonic.balance.Balance`. What is linear
is taken harmonic by harmonic, contact forces at the samples.
"""

import math

import numpy as np

from fecontact.bifurcation.harmonic.compiled.arrays import (
    PERIOD,
    PLAIN,
    STEADY,
    TIMED,
    TURN,
    Equations,
)
from fecontact.bifurcation.harmonic.compiled.kinks import SampledRates, add_kinks
from fecontact.bifurcation.harmonic.compiled.memoryless_forces import (
    combine,
    memoryless_forces,
    project,
)
from fecontact.bifurcation.harmonic.elements import Displacements, ElementForces, element_forces_at
from fecontact.bifurcation.harmonic.memory import LEAK, difference, march, solve_around
from fecontact.bifurcation.harmonic.series import fill_blocks
from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import Vector
from fecontact.system.jacobian import batch_derivatives, batch_rates

# Relative steps of one-sided and of central differences in the parameter.
_ONE_SIDED, _CENTRAL = 1e-6, 1e-5


@helper
def take_parameter(p, e):
    """Set the arrays of the system and the times for a parameter; returns the period."""
    for k in range(len(e.flat)):
        e.flat[k] = e.base[k] + p * e.slope[k]
    T = e.numbers[TURN] / p if e.numbers[TURN] != 0.0 else e.numbers[PERIOD]
    for k in range(len(e.tau)):
        e.workspace.t[k] = e.tau[k] * T
    linear = e.workspace.linear
    for part in range(2):
        for i in range(linear.shape[1]):
            for j in range(linear.shape[1]):
                linear[part, i, j] = e.body[part, i, j] + p * e.body[2 + part, i, j]
    return T


@helper
def speed_coefficient(u, k, j, m, T):
    """Coefficient k of velocity j from the coefficients u of the displacements."""
    turn = 2.0 * math.pi * ((k + 1) // 2) / T
    if k == 0:
        return 0.0
    return turn * u[(k + 1) * m + j] if k % 2 == 1 else -turn * u[(k - 1) * m + j]


@helper
def take_motion(u, T, e):
    """Fill the rows of displacements and velocities at the samples."""
    X, motion = e.workspace.coefficients, e.workspace.motion
    m, L, N = X.shape[1], X.shape[2], len(e.tau)
    for j in range(m):
        for k in range(L):
            # The rows of the projection are those of the series, but for their size.
            size = N if k == 0 else 0.5 * N
            X[0, j, k] = size * u[k * m + j]
            X[1, j, k] = size * speed_coefficient(u, k, j, m, T)
        for part in range(2):
            combine(e.projection, X[part, j], L, motion[part * m + j])


@helper
def take_states(u, T, e, x):
    """Fill displacements and velocities of the states (N, d) at the samples."""
    motion = e.workspace.motion
    take_motion(u, T, e)
    for j in range(len(motion)):
        for n in range(len(x)):
            x[n, j] = motion[j, n]


@helper
def _take_differences(T, e):
    """Fill the states in which internal variables are marched, and their targets."""
    x, y, m = e.workspace.x, e.workspace.y, e.springs.shape[1]
    N = len(x)
    rate = N / T
    for n in range(N):
        for j in range(m):
            y[n, j] = x[n, j]
            y[n, m + j] = rate * difference(x, n, j)
        for i in range(len(e.offsets)):
            total = e.offsets[i]
            for j in range(m):
                total += e.springs[i, j] * x[n, j]
            e.workspace.target[n, i] = total


@helper
def _marched_rate(k, i, T, e):
    """Rate that internal variable i must have at sample k, leak included."""
    z = e.workspace.z
    return LEAK / T * (z[k, i] - e.workspace.target[k, i]) + len(z) / T * difference(z, k, i)


@helper
def take_pushes(f, e):
    """Fill the rows of the forces from f (N, d) at the samples."""
    contact_forces = e.workspace.contact_forces
    m = len(contact_forces)
    for j in range(m):
        for n in range(len(f)):
            contact_forces[j, n] = f[n, m + j]


@helper
def balance(u, T, loads, e, out):
    """Fill out (n,) with the harmonics of q'' - f; ``contact_forces`` are without what is linear.

    ``loads`` is the factor of the loads.
    """
    m, L = e.springs.shape[1], e.values.shape[1]
    linear, p = e.workspace.linear, u[len(u) - 1]
    force_harmonics = e.workspace.coefficients[0]
    for j in range(m):
        project(e.projection, e.workspace.contact_forces[j], force_harmonics[j])
    for k in range(L * m):
        out[k] = 0.0
    for k in e.kept:
        turn = 2.0 * math.pi * ((k + 1) // 2) / T
        for j in range(m):
            load = e.load_harmonics[0, k, j] + p * e.load_harmonics[1, k, j]
            total = force_harmonics[j, k] + loads * load
            out[k * m + j] = -turn * turn * u[k * m + j] - total
        for i in range(m):
            place, speed = u[k * m + i], speed_coefficient(u, k, i, m, T)
            for j in range(m):
                out[k * m + j] += linear[0, j, i] * place + linear[1, j, i] * speed


@helper
def _follow(u, T, derivatives, e, friction, z):
    """Fill friction (t n, N) of elements along their tangents; 0 if they do not repeat."""
    m, L = e.springs.shape[1], e.values.shape[1]
    return element_forces_at(e.element_forces)(
        Displacements(u[: L * m].reshape((L, m)), T, e.values), e.whole, e.elements, e.kept_offsets,
        derivatives, ElementForces(friction, z, e.workspace.by_node))


@helper
def _add_friction(e):
    """Add the friction of elements that was found to the rows of the forces, or to the rates."""
    workspace, plain = e.workspace, e.numbers[PLAIN] != 0.0
    m, rows = e.springs.shape[1], e.contact.rows
    tangents = rows.shape[1] - 1
    for r in range(tangents * len(e.elements)):
        friction = workspace.friction[0, r]
        for i in range(m):
            factor = rows[r // tangents, 2 * (r % tangents), i]
            for n in range(len(friction)):
                if plain:
                    workspace.contact_forces[i, n] -= factor * friction[n]
                else:
                    workspace.f[n, m + i] -= factor * friction[n]


@routine
def _friction_of_elements(u, T, derivatives, e):
    """Find and add the friction of elements; 0 if they do not repeat."""
    e.numbers[TIMED] = _follow(u, T, derivatives, e, e.workspace.friction[0], e.workspace.z)
    _add_friction(e)
    return e.numbers[TIMED]


@kernel(by_address=True)
def evaluate_plain(u: Vector, derivatives: bool, e: Equations) -> float:
    """Residual at u, with derivatives at the samples if asked for; returns the period.

    Of plain contact forces. Zero where elements do not come to repeat.
    """
    T = take_parameter(u[len(u) - 1], e)
    take_motion(u, T, e)
    memoryless_forces(derivatives, T / len(e.tau), e)
    if len(e.elements) > 0 and _friction_of_elements(u, T, derivatives, e) == 0.0:
        return 0.0
    balance(u, T, 1.0, e, e.workspace.residual)
    return T


@kernel(by_address=True)
def evaluate_sampled(u: Vector, derivatives: bool, e: Equations) -> float:
    """Like :func:`evaluate_plain`, for any contact forces, internal variables included."""
    workspace = e.workspace
    m, c = e.springs.shape[1], len(e.offsets)
    T = take_parameter(u[len(u) - 1], e)
    take_states(u, T, e, workspace.x)
    if c > 0:
        _take_differences(T, e)
        for n in range(len(workspace.t)):
            for i in range(c):
                workspace.y[n, 2 * m + i] = 0.0
        if march(workspace.t, workspace.y, e.contact, T, e.blocks, workspace.target,
                 workspace.z) == 0:
            return 0.0
        for n in range(len(workspace.t)):
            for i in range(c):
                workspace.x[n, 2 * m + i] = workspace.z[n, i]
                workspace.y[n, 2 * m + i] = workspace.z[n, i]
    if derivatives:
        batch_derivatives(workspace.t, workspace.x, e.contact, e.contact, 0.0, workspace.f,
                          workspace.J, np.empty((0, 0)))
    else:
        batch_rates(workspace.t, workspace.x, e.contact, workspace.f)
    add_kinks(workspace.t, workspace.x, e.contact, e.onsets, T / len(e.tau), derivatives,
              SampledRates(workspace.f, workspace.J, workspace.widths))
    if len(e.elements) > 0 and _friction_of_elements(u, T, derivatives, e) == 0.0:
        return 0.0
    take_pushes(workspace.f, e)
    balance(u, T, 1.0, e, workspace.residual)
    return T


evaluation_at = function_at(evaluate_plain)


@helper
def _take_rows(s, e):
    """Fill the rows of the derivatives of the forces of s coupled modes."""
    workspace = e.workspace
    m = e.springs.shape[1]
    for part in range(2):
        for i in range(s):
            for j in range(s):
                row = workspace.rows[(part * s + i) * s + j]
                for n in range(len(row)):
                    row[n] = workspace.J[n, m + workspace.order[i], part * m + workspace.order[j]]


@routine
def _harmonics_of_derivatives(T, s, e):
    """Fill the derivatives of the balance of s coupled modes to their coefficients, z held.

    The rows hold those of the forces.
    """
    workspace = e.workspace
    L = e.values.shape[1]
    spectra = workspace.spectra[: 4 * L * s * s].reshape((4, L, s * s))
    square = workspace.square[: L * s * L * s].reshape((L, s, L, s))
    for part in range(2):
        for i in range(s):
            for j in range(s):
                row = workspace.rows[(part * s + i) * s + j]
                same = True
                for n in range(1, len(row)):
                    same = same and row[n] == row[0]
                cosines, sines = workspace.along[:L], workspace.perturbed[:L]
                if same:
                    for k in range(L):
                        cosines[k], sines[k] = 0.0, 0.0
                    cosines[0] = 2.0 * row[0]
                else:
                    project(e.cosines, row, cosines)
                    project(e.sines, row, sines)
                p = i * s + j
                for k in range(L):
                    spectra[2 * part, k, p], spectra[2 * part + 1, k, p] = cosines[k], sines[k]
    fill_blocks(spectra[0], spectra[1], spectra[2], spectra[3], T, s, s, square)
    for k in range(L):
        turn = 2.0 * math.pi * ((k + 1) // 2) / T
        for i in range(s):
            for j in range(s):
                a, b = workspace.order[i], workspace.order[j]
                square[k, i, k, j] += workspace.linear[0, a, b]
                if k % 2 == 1:
                    square[k, i, k + 1, j] += turn * workspace.linear[1, a, b]
                    square[k + 1, i, k, j] -= turn * workspace.linear[1, a, b]


@routine
def _by_parameter(u, T, e):
    """Fill as :func:`_by_differences`, if forces depend on the parameter by speeds alone."""
    workspace = e.workspace
    p, m, L = u[len(u) - 1], e.springs.shape[1], e.values.shape[1]
    N, c = len(e.tau), len(e.offsets)
    # Relative change of the period; that of speeds is the opposite.
    rise = -1.0 / p if e.numbers[TURN] != 0.0 else 0.0
    plain, row = e.numbers[PLAIN] != 0.0, workspace.node[0]
    force_harmonics = workspace.coefficients[0]
    for j in range(m):
        for n in range(N):
            row[n] = 0.0
        moves = not plain
        for i in range(m):
            by_speed = workspace.rows[(m + j) * m + i]
            for n in range(N):
                slope = by_speed[n] if plain else workspace.J[n, m + j, m + i]
                moves = moves or slope != 0.0
                row[n] -= rise * workspace.motion[m + i, n] * slope
        if moves and len(e.onsets) > 0:
            for n in range(N):
                row[n] += rise * workspace.widths[j, n]
        if moves:
            project(e.projection, row, force_harmonics[j])
        else:
            for k in range(L):
                force_harmonics[j, k] = 0.0
    for k in range(L):
        turn = 2.0 * math.pi * ((k + 1) // 2) / T
        for j in range(m):
            total = e.load_harmonics[1, k, j] + force_harmonics[j, k]
            workspace.column[k * m + j] = 2.0 * rise * turn * turn * u[k * m + j] - total
        for i in range(m):
            place, speed = u[k * m + i], speed_coefficient(u, k, i, m, T)
            for j in range(m):
                workspace.column[k * m + j] += (e.body[2, i, j] * place + e.body[3, i, j] * speed
                                                - rise * workspace.linear[1, i, j] * speed)
    for k in range(N):
        for i in range(c):
            total = _marched_rate(k, i, T, e)
            for j in range(m):
                total -= workspace.J_marched[k, 2 * m + i, m + j] * workspace.y[k, m + j]
            workspace.followed[k, i, len(u) - 1] = rise * total


@helper
def _step_of(p, central):
    """Step of differences in the parameter, and the distance of both sides."""
    h = (_CENTRAL if central else _ONE_SIDED) * max(abs(p), 1e-3)
    return h, 2.0 * h if central else h


@routine
def _by_differences(u, central, e, followed):
    """Fill ``column``, and the last columns of ``followed``, by differences.

    z is held, and so is the friction of elements that are followed one by one.
    """
    workspace = e.workspace
    n, p = len(workspace.residual), u[len(u) - 1]
    m, c, N = e.springs.shape[1], len(e.offsets), len(e.tau)
    h, width = _step_of(p, central)
    # Without a second side what is marched meets its equations.
    for k in range(n):
        workspace.column[k] = 0.0 if central else -workspace.residual[k] / h
    there = workspace.vectors[7]
    for k in range(n):
        there[k] = u[k]
    for side in range(2 if central else 1):
        sign = 1.0 if side == 0 else -1.0
        there[n] = p + sign * h
        T = take_parameter(there[n], e)
        take_states(there, T, e, workspace.x)
        batch_rates(workspace.t, workspace.x, e.contact, workspace.f)
        add_kinks(workspace.t, workspace.x, e.contact, e.onsets, T / len(e.tau), 0,
                  SampledRates(workspace.f, workspace.J, workspace.widths))
        _add_friction(e)
        take_pushes(workspace.f, e)
        balance(there, T, 1.0, e, workspace.perturbed)
        for k in range(n):
            workspace.column[k] += sign * workspace.perturbed[k] / width
        if c > 0:
            _take_differences(T, e)
            batch_rates(workspace.t, workspace.y, e.contact, workspace.f_marched)
            for k in range(N):
                for i in range(c):
                    off = workspace.f_marched[k, 2 * m + i] - _marched_rate(k, i, T, e)
                    followed[k, i, n] = (sign * off / width
                                         + (followed[k, i, n] if side > 0 else 0.0))
    take_parameter(p, e)


@routine
def _add_memory(T, e):
    """Add what internal variables contribute to ``condensed`` (n, n + 1) and ``column``.

    ``followed`` holds its last column, ``J_marched`` the derivatives at the states in which they
    were marched.
    """
    workspace = e.workspace
    m, L, N, c = e.springs.shape[1], e.values.shape[1], len(e.tau), len(e.offsets)
    n, rate = L * m, N / T
    s = c // e.nodes
    followed, J = workspace.followed, workspace.J_marched
    square = workspace.square.reshape((n, n))
    for k in range(N):
        for i in range(c):
            node = i // s
            for other in range(s):
                workspace.slopes[k, node, i - node * s, other] = J[k, 2 * m + i,
                                                             2 * m + node * s + other]
            for q in range(L):
                speed = rate * difference(e.values, k, q)
                for j in range(m):
                    followed[k, i, q * m + j] = (
                        e.values[k, q] * (J[k, 2 * m + i, j] + LEAK / T * e.springs[i, j])
                        + speed * J[k, 2 * m + i, m + j])
    solve_around(workspace.slopes, T, e.blocks, followed)
    workspace.forces[:, :, :] = 0.0
    for k in range(N):
        for j in range(m):
            for i in range(c):
                by_memory = workspace.J[k, m + j, 2 * m + i]
                if by_memory != 0.0:
                    for column in range(n + 1):
                        workspace.forces[k, j, column] += by_memory * followed[k, i, column]
    for q in range(L):
        for j in range(m):
            row = square[q * m + j]
            # Four samples at a time: the row is read a quarter as often.
            for k in range(0, N - N % 4, 4):
                p0, p1, p2, p3 = (e.projection[q, k], e.projection[q, k + 1],
                                  e.projection[q, k + 2], e.projection[q, k + 3])
                f0, f1, f2, f3 = (workspace.forces[k, j], workspace.forces[k + 1, j],
                                  workspace.forces[k + 2, j], workspace.forces[k + 3, j])
                for column in range(n):
                    row[column] -= (p0 * f0[column] + p1 * f1[column] + p2 * f2[column]
                                    + p3 * f3[column])
                workspace.column[q * m + j] -= p0 * f0[n] + p1 * f1[n] + p2 * f2[n] + p3 * f3[n]
            for k in range(N - N % 4, N):
                for column in range(n):
                    row[column] -= e.projection[q, k] * workspace.forces[k, j, column]
                workspace.column[q * m + j] -= e.projection[q, k] * workspace.forces[k, j, n]


@routine
def _add_by_elements(u, T, central, e):
    """Add what elements that are followed one by one contribute to ``square`` and ``column``.

    They give the derivatives to the parameter by differences.
    """
    workspace, rows = e.workspace, e.contact.rows
    m, L, N = e.springs.shape[1], e.values.shape[1], len(e.tau)
    square = workspace.square[: L * m * L * m].reshape((L, m, L, m))
    axes = rows.shape[1]
    tangents, spectrum = axes - 1, np.empty((L, axes * L))
    for r in range(tangents * len(e.elements)):
        j, tangent = r // tangents, 2 * (r % tangents)
        if e.elements[j] == 0:
            continue
        spectrum[:, :] = 0.0
        for q in range(L):
            row = spectrum[q]
            for n in range(N):
                factor, change = e.projection[q, n], workspace.by_node[r, n]
                for k in range(axes * L):
                    row[k] += factor * change[k]
        for q in range(L):
            for i in range(m):
                along = rows[j, tangent, workspace.order[i]]
                for axis in range(axes):
                    for k in range(L):
                        for o in range(m):
                            square[q, i, k, o] += (along * rows[j, axis, workspace.order[o]]
                                                   * spectrum[q, axis * L + k])
    if e.numbers[STEADY] != 0.0 and e.numbers[TIMED] < 2.0:
        return
    n, p = L * m, u[len(u) - 1]
    there, (h, width) = workspace.vectors[7], _step_of(p, central)
    for k in range(n):
        there[k] = u[k]
    for side in range(2 if central else 1):
        there[n] = p + h if side == 0 else p - h
        _follow(there, take_parameter(there[n], e), False, e, workspace.friction[1 + side],
                workspace.left)
    take_parameter(p, e)
    change, force_harmonics = workspace.node[0], workspace.along[:L]
    for r in range(tangents * len(e.elements)):
        j, tangent = r // tangents, 2 * (r % tangents)
        above, below = workspace.friction[1, r], workspace.friction[2 if central else 0, r]
        for i in range(N):
            change[i] = (above[i] - below[i]) / width
        project(e.projection, change, force_harmonics)
        for q in range(L):
            for i in range(m):
                workspace.column[q * m + i] += rows[j, tangent, i] * force_harmonics[q]


@helper
def _take_condensed(e):
    """Fill ``condensed`` with ``square`` and ``column``."""
    workspace = e.workspace
    s, m, L = workspace.coupled[0], e.springs.shape[1], e.values.shape[1]
    k = L * s
    condensed = workspace.condensed[: k * (k + 1)].reshape((k, k + 1))
    square = workspace.square[: k * k].reshape((k, k))
    for q in range(L):
        for place in range(s):
            i = q * s + place
            for j in range(k):
                condensed[i, j] = square[i, j]
            condensed[i, k] = workspace.column[q * m + workspace.order[place]]


@kernel(by_address=True)
def condense_plain(u: Vector, T: float, central: bool, e: Equations) -> None:
    """Fill ``condensed`` and ``column``, the derivatives of the residual evaluated at u.

    Of plain contact forces.
    """
    _harmonics_of_derivatives(T, e.workspace.coupled[0], e)
    _by_parameter(u, T, e)
    if len(e.elements) > 0:
        _add_by_elements(u, T, central, e)
    _take_condensed(e)


@kernel(by_address=True)
def condense_sampled(u: Vector, T: float, central: bool, e: Equations) -> None:
    """Like :func:`condense_plain`, for any contact forces, internal variables included."""
    workspace = e.workspace
    c, s = len(e.offsets), workspace.coupled[0]
    _take_rows(s, e)
    _harmonics_of_derivatives(T, s, e)
    if c > 0:
        batch_derivatives(workspace.t, workspace.y, e.contact, e.contact, 0.0, workspace.f_marched,
                          workspace.J_marched, np.empty((0, 0)))
    if e.numbers[STEADY] != 0.0:
        _by_parameter(u, T, e)
    else:
        _by_differences(u, central, e, workspace.followed)
    if c > 0:
        _add_memory(T, e)
    elif len(e.elements) > 0:
        _add_by_elements(u, T, central, e)
    _take_condensed(e)


condensation_at = function_at(condense_plain)


@helper
def take_forces(p, e, forces):
    """Fill forces (N, m) with the accelerations at the samples that were evaluated last."""
    workspace, linear = e.workspace, e.workspace.linear
    m, N = e.springs.shape[1], len(e.tau)
    if e.numbers[PLAIN] != 0.0:
        for j in range(m):
            found = workspace.contact_forces[j]
            for n in range(N):
                forces[n, j] = found[n] + e.given[0, n, j] + p * e.given[1, n, j]
            for i in range(m):
                places, speeds = workspace.motion[i], workspace.motion[m + i]
                stiffness, damping = linear[0, j, i], linear[1, j, i]
                for n in range(N):
                    forces[n, j] -= stiffness * places[n] + damping * speeds[n]
    else:
        for n in range(N):
            for j in range(m):
                forces[n, j] = workspace.f[n, m + j] + e.given[0, n, j] + p * e.given[1, n, j]
            for i in range(m):
                place, speed = workspace.x[n, i], workspace.x[n, m + i]
                for j in range(m):
                    forces[n, j] -= linear[0, j, i] * place + linear[1, j, i] * speed


@helper
def take_mean(e, mean):
    """Fill the mean derivatives (m, 2 m) of the accelerations to q and q'."""
    workspace = e.workspace
    m, N = e.springs.shape[1], len(e.tau)
    for i in range(m):
        for j in range(2 * m):
            mean[i, j] = 0.0
    if e.numbers[PLAIN] != 0.0:
        for i in range(m):
            for j in range(2 * m):
                row, total = workspace.rows[((j // m) * m + i) * m + j % m], 0.0
                for n in range(N):
                    total += row[n]
                mean[i, j] = total / N
    else:
        for n in range(N):
            for i in range(m):
                for j in range(2 * m):
                    mean[i, j] += workspace.J[n, m + i, j] / N
    for i in range(m):
        for j in range(m):
            mean[i, j] -= workspace.linear[0, i, j]
            mean[i, m + j] -= workspace.linear[1, i, j]
