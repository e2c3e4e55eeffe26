"""Polynomials of a step by collocation: error, work, and places where forces switch."""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import factorise, solve
from fecontact.integrate import bernstein
from fecontact.integrate.collocation.stages import move_back, place_scale, set_stage, speed_scale
from fecontact.integrate.collocation.tableau import (
    AT_PLACES,
    LOOKS,
    PLACE_PART,
    PLACE_POWERS,
    PLACE_TERMS,
    PLACES,
    POINTS,
    RATE_POWERS,
    RATE_TERMS,
    SPEED_PART,
    SPEED_POWERS,
    SPEED_TERMS,
    STAGES,
    TO_BERNSTEIN,
)
from fecontact.integrate.rodas5p import dynamics, stage_solver
from fecontact.integrate.rodas5p.error_control import largest_energy
from fecontact.integrate.rodas5p.state import ENERGY, WORST_NODE
from fecontact.integrate.step_loop import RATES
from fecontact.system.node_forces import normal_force
from fecontact.system.nodes import ground_motion, node_motion
from fecontact.system.powers import (
    POWER_COUNT,
    add_node_powers,
    given_powers,
    matrix_powers,
    set_losses,
)

# Resolution of 2 s - 1 where a force begins or ends.
_RESOLVED = 1e-14
# Looks at a normal force within a step, and golden sections about a minimum between them.
_FORCE_LOOKS, _SECTIONS, _GOLDEN = 4, 16, 0.6180339887498949
# Parts of what a gap or a slip velocity is the sum of that are its rounding.
_NOISE = 1e-14


@helper
def value_at(c, k, x):
    """Value at x = 2 s - 1 of the polynomial whose coefficients are column k of c."""
    total = 0.0
    for power in range(len(c) - 1, -1, -1):
        total = total * x + c[power, k]
    return total


@helper
def set_state(x, c, out):
    """Fill ``out`` (2 m,) with the state at x = 2 s - 1."""
    m = len(out) // 2
    for k in range(m):
        out[k] = value_at(c.places, k, x)
        out[m + k] = value_at(c.rates, k, x)


@helper
def _set_powers(factor, table, values, out):
    """Fill the coefficients ``out`` (p, k) by values (s + 1, k) at the begin and the stages."""
    for power in range(len(out)):
        for k in range(out.shape[1]):
            total = 0.0
            for i in range(RATE_TERMS):
                total += table[power, i] * values[i, k]
            out[power, k] = factor * total


@routine
def set_polynomials(h, progress, c):
    """Fill the coefficients of displacements and velocities over a step, and its end."""
    m = c.accelerations.shape[1]
    _set_powers(h * h, PLACE_POWERS, c.accelerations, c.places)
    _set_powers(h, SPEED_POWERS, c.accelerations, c.rates)
    for k in range(m):
        c.rates[0, k] += progress.state[m + k]
        # The begin is at x = -1.
        c.places[0, k] += progress.state[k] + 0.5 * h * progress.state[m + k]
        c.places[1, k] += 0.5 * h * progress.state[m + k]
    set_stage(STAGES - 1, h, progress.state, c.accelerations, c.after)


@helper
def keep_rates(c):
    """Keep the coefficients of the accelerations for the next step, which begins at the end."""
    _set_powers(1.0, RATE_POWERS, c.accelerations, c.before)
    put(c.accelerations[STAGES], c.accelerations[0])


@helper
def look(place, c):
    """Put the state at one of the places into ``c.y``."""
    set_state(2.0 * PLACES[place] - 1.0, c, c.y)


@helper
def factorise_defect(at, h, J, c):
    """Factorise ``c.small``, which makes the velocity that is missing at a place of a defect there.

    Return by what this is multiplied for the errors of velocities and displacements.
    """
    m, g, to_place = len(J), SPEED_PART[at] * h, PLACE_PART[at] * h * h
    for k in range(m):
        for l in range(m):
            c.small[k, l] = -g * J[k, m + l] - to_place * J[k, l]
        c.small[k, k] += 1.0
    factorise(c.small, m, c.small_pivots)
    return g, to_place


@routine
def step_error(step, problem, progress, workspace, c):
    """Error of a step in units of what is allowed, by the residual of the equations within it.

    The acceleration that is missing at a place in the step is a velocity over the time in which it
    decays, or over the step where that is shorter.
    """
    s, control, blocks = problem.system, problem.control, problem.blocks
    m, n, h = c.accelerations.shape[1], len(s.gap), step.h
    speeds, error = speed_scale(problem, progress), 0.0
    for at in range(LOOKS):
        look(at, c)
        dynamics.set_given(min(step.t + PLACES[at] * h, step.latest), s, workspace.given,
                           workspace.load)
        dynamics.set_rate_and_gradients(c.y, s, blocks, workspace.given, workspace.load,
                                        workspace.nodes, workspace.scratch, c.rate)
        stage_solver.assemble(s, blocks, workspace.scratch, workspace.reduced)
        g, to_place = factorise_defect(at, h, workspace.reduced.J, c)
        for k in range(m):
            missing = c.rate[m + k]
            for i in range(RATE_TERMS):
                missing -= AT_PLACES[at, i] * c.accelerations[i, k]
            c.small_right[k] = missing
        solve(c.small, c.small_pivots, c.small_right)
        for k in range(m):
            missing = abs(c.small_right[k])
            # Comparisons with NaN are false, and the larger of it and a number is the number.
            if not missing < np.inf:
                return np.inf
            error = max(error, missing * g * control.largest[k] / (speeds * c.tolerance))
            scale = max(place_scale(k, problem, progress), abs(c.after[k])) * c.tolerance
            error = max(error, missing * to_place / scale)
        for j in range(n):
            if workspace.nodes[2, n + j] != 0.0:
                slip = 0.0
                for k in range(m):
                    slip += s.rows[j, 0, k] * c.small_right[k]
                moved = s.sliding[j, 0, 0] * workspace.given[dynamics.SPEED]
                distance = abs(workspace.nodes[1, j] - moved)
                part = abs(slip) * g / (control.slip_part * (control.slip_scale[j] + distance))
                if part > error:
                    error = part
                    progress.numbers[WORST_NODE] = j
    progress.counts[RATES] += LOOKS
    return error


@routine
def powers_at(t, y, problem, workspace, out):
    """Fill ``out`` (P,) with the powers of the system and of its nodes."""
    s = problem.system
    m = s.rows.shape[2]
    given_powers(t, y, s, out)
    matrix_powers((0, m, 0, m), y, s, out)
    moved = ground_motion(t, s)
    for j in range(len(s.gap)):
        lost, speed = add_node_powers(j, node_motion(j, y, s), moved, y[2 * m :], s,
                                      workspace.scratch.force[0], workspace.scratch.rates[0], out)
        set_losses(j, lost, speed, problem.control.stick_speed[j], out[POWER_COUNT:])


@routine
def work_error(step, before, problem, progress, workspace, c):
    """Error of the work of a step in units of what is allowed; fills the powers and their works.

    The last powers are taken that part of the step ``before`` its end, as the forces are.
    """
    h, count = step.h, len(c.looked)
    put(progress.power, c.powers[0])
    for i in range(STAGES):
        set_stage(i, h, progress.state, c.accelerations, c.y)
        if i == STAGES - 1 and before > 0.0:
            move_back(before, h, c)
        powers_at(min(step.t + POINTS[i] * h, step.latest), c.y, problem, workspace,
                  c.powers[i + 1])
    energy, missing = largest_energy(c.after, problem.control, progress), 0.0
    for k in range(POWER_COUNT):
        energy = max(energy, h * abs(c.powers[STAGES, k]))
    progress.numbers[ENERGY] = energy
    for at in range(LOOKS):
        look(at, c)
        powers_at(min(step.t + PLACES[at] * h, step.latest), c.y, problem, workspace, c.looked)
        for k in range(count):
            power = c.looked[k]
            for i in range(RATE_TERMS):
                power -= AT_PLACES[at, i] * c.powers[i, k]
            missing = max(missing, abs(power) * SPEED_PART[at])
            if not abs(power) < np.inf:
                missing = np.inf
    _set_powers(h, SPEED_POWERS, c.powers, c.work)
    for k in range(count):
        c.work[0, k] += progress.work[k]
    return h * missing / (c.tolerance * energy)


@routine
def _first_change(after, noise, c):
    """First part of the step beyond ``after`` at which a polynomial changes its sign, 2 if none.

    Its coefficients are in ``c.line[0]``, by powers of x. One below ``noise`` has no sign.
    """
    b = c.line[1]
    for i in range(PLACE_TERMS):
        total = 0.0
        for power in range(PLACE_TERMS):
            total += TO_BERNSTEIN[i, power] * c.line[0, power]
        b[i] = total
    low, high = bernstein.smallest(b), bernstein.largest(b)
    if low > 0.0 or high < 0.0 or max(-low, high) <= noise:
        return 2.0
    for k in range(bernstein.sign_changes(b, c.found, c.halves)):
        if c.found[k] > after:
            return c.found[k]
    return 2.0


@routine
def _normal_force(x, j, s, c):
    """Normal force of node j at x = 2 s - 1."""
    u, v = -s.gap[j], 0.0
    for k in range(c.accelerations.shape[1]):
        u -= s.rows[j, 1, k] * value_at(c.places, k, x)
        v -= s.rows[j, 1, k] * value_at(c.rates, k, x)
    return normal_force(j, u, v, s)[0]


@helper
def _presses(x, j, s, c):
    """True if node j has a normal force at x = 2 s - 1."""
    return _normal_force(x, j, s, c) != 0.0


@helper
def _least_force(left, right, j, s, c):
    """Place between left and right where the force of node j is least, or one where it is zero."""
    for _ in range(_SECTIONS):
        a, b = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
        at_a, at_b = abs(_normal_force(a, j, s, c)), abs(_normal_force(b, j, s, c))
        if at_a == 0.0:
            return a
        if at_b == 0.0:
            return b
        if at_a < at_b:
            right = b
        else:
            left = a
    return 0.5 * (left + right)


@routine
def _without_force(high, j, s, c):
    """First place x found up to ``high`` where node j, pressed at the start, has no force.

    2 if the force lasts. Between looks the force is followed to its minima by golden sections,
    where it is less than its second difference: the parabola through three looks goes no further
    below the least of them than an eighth of that.
    """
    width, forces = (high + 1.0) / _FORCE_LOOKS, c.line[1]
    for look in range(_FORCE_LOOKS + 1):
        forces[look] = abs(_normal_force(min(-1.0 + look * width, high), j, s, c))
    for look in range(_FORCE_LOOKS):
        now, after = forces[look], forces[look + 1]
        centre = max(look, 1)
        bent = forces[centre - 1] - 2.0 * forces[centre] + forces[centre + 1]
        if now <= after and now < abs(bent) and (look == 0 or now < forces[look - 1]):
            x = -1.0 + look * width
            least = _least_force(max(x - width, -1.0), x + width, j, s, c)
            if not _presses(least, j, s, c):
                return least
        if after == 0.0:
            return min(-1.0 + (look + 1) * width, high)
    return 2.0


@routine
def _release(high, j, s, c):
    """Part of the step up to x = ``high`` at which a normal force begins or ends, else 2.

    A force that is there at both ends may vanish in between; one that is at neither does not
    begin, as its penetration would pass a level.
    """
    presses = _presses(-1.0, j, s, c)
    if presses:
        high = _without_force(high, j, s, c)
        if high > 1.0:
            return 2.0
    elif not _presses(high, j, s, c):
        return 2.0
    low = -1.0
    while high - low > _RESOLVED:
        middle = 0.5 * (low + high)
        if _presses(middle, j, s, c) == presses:
            low = middle
        else:
            high = middle
    return 0.5 * (high + 1.0)


@routine
def first_switch(after, problem, c):
    """First part of a step beyond ``after`` where the force of a node may have a kink, 2 if none.

    Where normal forces begin or end, where penetrations pass the depth of their law, where slip of
    a node that is pressed changes its direction, and where it becomes creep or ceases to be. What
    stays within rounding, or so near that the run does not resolve it, does not count: a node at
    rest would switch without end.
    """
    s, control, line = problem.system, problem.control, c.line[0]
    m, first, levels = c.accelerations.shape[1], 2.0, control.levels.shape[0]
    for j in range(len(s.gap)):
        changes = 2.0
        size = abs(s.gap[j])
        for power in range(PLACE_TERMS):
            line[power] = 0.0
            for k in range(m):
                term = s.rows[j, 1, k] * c.places[power, k]
                line[power] -= term
                size += abs(term)
        line[0] -= s.gap[j]
        reached = abs(line[0])
        for power in range(1, PLACE_TERMS):
            reached += abs(line[power])
        # Levels are 1e100 where a force never ends: each is taken from the same number.
        centre, noise = line[0], max(_NOISE * size, c.tolerance * control.depth[j])
        presses, high = _presses(-1.0, j, s, c), 1.0
        for level in range(levels + 1):
            here = control.levels[level, j] if level < levels else control.depth[j]
            line[0] = centre - here
            found = _first_change(after, noise, c)
            # In a gap there is no law whose character could change, but where the force is there at
            # one of two passages it begins or ends between them.
            while level == levels and found < 2.0 and not _presses(2.0 * found - 1.0, j, s, c):
                if presses:
                    high = min(high, 2.0 * found - 1.0)
                found = _first_change(found, noise, c)
            if level == levels and found < 2.0 and not presses:
                high = min(high, 2.0 * found - 1.0)
            changes = min(changes, found)
        if reached > noise:
            release = _release(high, j, s, c)
            if after < release < changes:
                changes = release
        first = min(first, changes)
        # Slip of a node that is open all the time has no force.
        if changes > 1.0 and not (_presses(0.0, j, s, c) or _presses(1.0, j, s, c)):
            continue
        size = 0.0
        for power in range(PLACE_TERMS):
            line[power] = 0.0
        for power in range(SPEED_TERMS):
            for k in range(m):
                term = s.rows[j, 0, k] * c.rates[power, k]
                line[power] += term
                size += abs(term)
        for power in range(RATE_TERMS):
            ground = 0.0
            for i in range(RATE_TERMS):
                ground += RATE_POWERS[power, i] * c.speeds[i]
            line[power] -= s.sliding[j, 0, 0] * ground
            size += abs(ground)
        creep, noise = control.stick_speed[j], max(_NOISE * size,
                                                   c.tolerance * control.slip_scale[j])
        line[0] += creep
        for _ in range(3 if creep > 0.0 else 1):
            first = min(first, _first_change(after, noise, c))
            line[0] -= creep
    return first
