"""Stages of the columns of derivatives in a step of the integrator.

The stage systems are those of :mod:`fecontact.integrate.rodas5p.variational`, with the derivatives
of the node forces ``inside`` a stage and ``ahead``, along it. A column goes from node to node.

Forces of a node depend on its own motion and internal variables only. So the derivatives ``ahead``
are sums, over these few directions, of what a stage moves the node and how its derivatives bend
there; this is found once a step, by differences.
"""

from fecontact.core.compiled import helper, routine
from fecontact.integrate.rodas5p import dynamics, stage_solver, tableau
from fecontact.integrate.rodas5p.moving_ground import increments_in
from fecontact.integrate.step_polynomials import STEEPEST
from fecontact.system.elastic_sliders import deflection_of
from fecontact.system.node_forces import friction_entry, node_gradients, slip_entry
from fecontact.system.nodes import (
    GroundMotion,
    NodeMotion,
    ground_moved,
    ground_speed,
    ground_travel,
    memory_of,
    node_contact,
)
from fecontact.system.polynomial_forces import (
    add_polynomial_product,
    has_polynomial,
    set_polynomial_change,
)

# Differences are taken over this part of the scales of the laws.
_PART = 1e-4
# Shorter ones, as of internal variables that have decayed, would overflow the quotients.
_SHORTEST = 1e-200
# Differences of larger parts of the usual size of a derivative are jumps.
_JUMP = 3.0 * _PART
# The same of differences to parameters, which may be a tenth of the smoothing of friction wide.
_STEEP = 0.3


@helper
def learn(here, usual):
    """Let the usual sizes be the largest seen."""
    n, states, width = here.rates.shape
    for j in range(n):
        for row in range(here.partial.shape[1]):
            for k in range(here.partial.shape[2]):
                usual.partial[j, row, k] = max(usual.partial[j, row, k],
                                               abs(here.partial[j, row, k]))
        for k in range(here.force.shape[1]):
            usual.force[j, k] = max(usual.force[j, k], abs(here.force[j, k]))
        for k in range(width):
            for row in range(states):
                usual.rates[j, row, k] = max(usual.rates[j, row, k], abs(here.rates[j, row, k]))


@routine
def set_paths(step, varying, ground, s, blocks, stages, v):
    """Fill v.paths (STAGES, D, n) with what each stage moves the nodes against the other side.

    Along the D directions of a node: its motion, in the order of the columns of
    ``Gradients.partial``, and its internal variables. ``ground`` is the motion of the ground in
    the stages if that is ``varying``.
    """
    paths, w = v.paths, v.nodes
    m, n, d = len(v.none), len(s.gap), s.rows.shape[1]
    states = v.inside.rates.shape[1]
    for i in range(tableau.STAGES):
        dynamics.project(blocks, stages[i], w[0], w[1])
        part = tableau.TIME[i] * step.h
        moved = GroundMotion(part * step.moved.speed, 0.0, part * step.moved.second_speed, 0.0)
        if varying:
            moved = increments_in(i, ground)
        for j in range(n):
            for axis in range(d):
                paths[i, axis, j], paths[i, d + axis, j] = w[0, axis * n + j], w[1, axis * n + j]
            for tangent in range(d - 1):
                axis = 2 * tangent
                paths[i, axis, j] -= ground_travel(tangent, j, moved, s)
                paths[i, d + axis, j] -= ground_speed(tangent, j, moved, s)
            for k in range(states):
                paths[i, 2 * d + k, j] = stages[i, 2 * m + j * states + k]


@helper
def _reach(direction, j, y, s, control, v):
    """Distance along a direction that is small against the law's scale, and against the stages.

    Along the deflection of an elastic element it is small against that too, which may be far below
    its scale. Zero where no stage moves the node.
    """
    motions = v.inside.partial.shape[2]
    reach = 0.0
    for i in range(tableau.STAGES):
        reach = max(reach, abs(v.paths[i, direction, j]))
    if direction == 1:
        reach = min(reach, control.depth[j])
    elif motions // 2 <= direction < motions and direction != motions // 2 + 1:
        reach = min(reach, control.slip_scale[j])
    elif direction >= motions:
        states, own = v.paths.shape[1] - motions, direction - motions
        reach = min(reach, control.memory_scale[j * states + own])
        if control.slider_counts[j] > 0:
            element = own // (s.rows.shape[1] - 1)
            reach = min(reach, deflection_of(memory_of(j, y, s), element, s))
    return _PART * reach if _PART * reach > _SHORTEST else 0.0


@helper
def _onward(direction, j, acceleration, step, s, v, between, rate):
    """Rate of a node's motion or internal variable; of places, that towards the other side.

    Its sign says on which side of a kink the step goes on. ``between`` (2, d n) holds velocities
    and accelerations of the nodes, ``rate`` (size,) is y'.
    """
    n, d = len(s.gap), s.rows.shape[1]
    if direction >= 2 * d:
        states = v.paths.shape[1] - 2 * d
        return rate[2 * len(v.none) + j * states + direction - 2 * d]
    if direction >= d:
        axis = direction - d
        rate_of_speed = between[1, axis * n + j]
        return rate_of_speed if axis == 1 else rate_of_speed - ground_moved(
            axis // 2, j, acceleration[0], acceleration[1], s)
    contact = node_contact(j, dynamics.motion_of(j, v.nodes, s), step.moved, s)
    if direction == 1:
        return -contact.rate
    slope = contact.slope[direction // 2]
    return slope * contact.rate if slope != 0.0 else contact.slip[direction // 2]


@routine
def _offset_gradients(direction, e, j, moved, s, v, out):
    """Fill row j of the gradients ``out`` at the distance e along a direction.

    v.nodes holds the motions of the nodes, v.vectors[0] internal variables where the state does.
    """
    motion, z = dynamics.motion_of(j, v.nodes, s), v.vectors[0]
    states, motions = out.rates.shape[1], out.partial.shape[2]
    first, d = 2 * len(v.none) + j * states, motions // 2
    places, speeds = motion.places, motion.speeds
    offset = NodeMotion(
        (places[0] + (e if direction == 0 else 0.0), places[1] + (e if direction == 1 else 0.0),
         places[2] + (e if direction == 2 and d > 2 else 0.0)),
        (speeds[0] + (e if direction == d else 0.0), speeds[1] + (e if direction == d + 1 else 0.0),
         speeds[2] + (e if direction == 5 and d > 2 else 0.0)))
    changed, before = first + direction - motions, 0.0
    if direction >= motions:
        before = z[changed]
        z[changed] += e
    node_gradients(j, offset, moved, z[first : first + s.memory[j]], s, out.force[j], out.rates[j],
                   out.partial[j])
    if direction >= motions:
        z[changed] = before


@helper
def _difference(ahead, here, behind, factor, forward, usual):
    """Difference quotient, that of one side where a kink or a jump lies within reach.

    A difference that is not small against the ``usual`` size has met a jump. Of two sides that
    differ without one, that of the step itself counts.
    """
    a, b = ahead - here, here - behind
    jump_ahead, jump_behind = abs(a) > _JUMP * usual, abs(b) > _JUMP * usual
    if jump_ahead or jump_behind:
        if jump_ahead and jump_behind:
            return factor * (a if abs(a) < abs(b) else b)
        return factor * (b if jump_ahead else a)
    if abs(a - b) <= 0.5 * max(abs(a), abs(b)):
        return 0.5 * factor * (a + b)
    return factor * (a if forward else b)


@helper
def _set_bend(j, row, factor, forward, here, v):
    """Fill a row of v.second_derivatives with the differences of the gradients of node j."""
    ahead, behind, usual, out = v.ahead, v.behind, v.usual, v.second_derivatives
    states, width = here.rates.shape[1], here.rates.shape[2]
    for k in range(here.partial.shape[1]):
        for c in range(here.partial.shape[2]):
            out.partial[row, k, c] = _difference(
                ahead.partial[j, k, c], here.partial[j, k, c], behind.partial[j, k, c], factor,
                forward, usual.partial[j, k, c])
    if states == 0:
        return
    for k in range(here.force.shape[1]):
        out.force[row, k] = _difference(ahead.force[j, k], here.force[j, k], behind.force[j, k],
                                        factor, forward, usual.force[j, k])
    for k in range(states):
        for c in range(width):
            out.rates[row, k, c] = _difference(
                ahead.rates[j, k, c], here.rates[j, k, c], behind.rates[j, k, c], factor, forward,
                usual.rates[j, k, c])


@routine
def set_second_derivatives(step, acceleration, problem, progress, workspace, v):
    """Fill v.second_derivatives: row D_k n + j has those of the forces of node j along direction k.

    Where no stage moves a node along it, or nothing depends on it, v.paths becomes zero instead.
    """
    s, blocks, control = problem.system, problem.blocks, problem.control
    n, motions = len(s.gap), v.inside.partial.shape[2]
    w, between, z = v.nodes, workspace.between, v.vectors[0]
    dynamics.project(blocks, progress.state, w[0], w[1])
    dynamics.project(blocks, progress.rate, between[0], between[1])
    even = control.ground[STEEPEST] == 0.0 and s.friction_scale == 0
    for k in range(2 * len(v.none), len(z)):
        z[k] = progress.state[k]
    for j in range(n):
        for direction in range(v.paths.shape[1]):
            reach = _reach(direction, j, progress.state, s, control, v)
            if reach == 0.0 or (even and (direction == 0 or (direction == 2 and motions > 4))):
                for i in range(tableau.STAGES):
                    v.paths[i, direction, j] = 0.0
                continue
            _offset_gradients(direction, reach, j, step.moved, s, v, v.ahead)
            _offset_gradients(direction, -reach, j, step.moved, s, v, v.behind)
            forward = _onward(direction, j, acceleration, step, s, v, between, progress.rate) >= 0.0
            _set_bend(j, direction * n + j, 1.0 / reach, forward, progress.gradients, v)


@routine
def set_ahead(i, y, s, stages, v):
    """Fill v.ahead with the change of the gradients along stage i of a step from y."""
    g, second_derivatives, paths = v.ahead, v.second_derivatives, v.paths
    if has_polynomial(s):
        set_polynomial_change(y, stages[i], s, g.polynomial)
    states, width = g.rates.shape[1], g.rates.shape[2]
    n, entries = paths.shape[2], g.partial.shape[1] * g.partial.shape[2]
    partial = g.partial.reshape((n, entries))
    changes = second_derivatives.partial.reshape((len(second_derivatives.partial), entries))
    length = g.force.shape[1] if states > 0 else 0
    partial[:] = 0.0
    g.force[:, :length] = 0.0
    g.rates[:] = 0.0
    for direction in range(paths.shape[1]):
        for j in range(n):
            path, row = paths[i, direction, j], direction * n + j
            if path == 0.0:
                continue
            out, change = partial[j], changes[row]
            for k in range(entries):
                out[k] += path * change[k]
            for k in range(length):
                g.force[j, k] += path * second_derivatives.force[row, k]
            for k in range(states):
                for c in range(width):
                    g.rates[j, k, c] += path * second_derivatives.rates[row, k, c]


@helper
def _between(above, here, below, width, central, usual):
    """Difference quotient to a parameter; where one side has met a jump, that of the other."""
    a, b = above - here, here - below
    if central and abs(a + b) > _STEEP * usual and abs(a - b) > 0.5 * max(abs(a), abs(b)):
        return 2.0 / width * (a if abs(a) < abs(b) else b)
    return (a + b) / width


@helper
def set_between(above, here, below, width, central, usual, out):
    """Fill ``out`` with the derivatives of the gradients to a parameter."""
    n, states, length = here.rates.shape
    for j in range(n):
        for row in range(here.partial.shape[1]):
            for k in range(here.partial.shape[2]):
                out.partial[j, row, k] = _between(
                    above.partial[j, row, k], here.partial[j, row, k], below.partial[j, row, k],
                    width, central, usual.partial[j, row, k])
        for k in range(here.force.shape[1]):
            out.force[j, k] = _between(above.force[j, k], here.force[j, k], below.force[j, k],
                                       width, central, usual.force[j, k])
        for row in range(states):
            for k in range(length):
                out.rates[j, row, k] = _between(
                    above.rates[j, row, k], here.rates[j, row, k], below.rates[j, row, k], width,
                    central, usual.rates[j, row, k])


@helper
def add_node_forces(g, s, blocks, x, w, rate):
    """Add to w[2] (d n,) the node forces, and to ``rate`` the z', that x makes by gradients g."""
    n, states, _ = g.rates.shape
    m, d = len(blocks.position), s.rows.shape[1]
    dynamics.project(blocks, x, w[0], w[1])
    for j in range(n):
        for axis in range(d):
            w[2, axis * n + j] += dynamics.change_of(g.partial[j, axis], j, n, w)
        first = 2 * m + j * states
        for tangent in range(d - 1):
            entry = friction_entry(tangent, states) + 3
            for k in range(s.memory[j]):
                w[2, 2 * tangent * n + j] -= g.force[j, entry + k] * x[first + k]
        if s.memory[j] == 0:
            continue
        pressing = dynamics.change_of(g.partial[j, d], j, n, w)
        for k in range(s.memory[j]):
            total = g.rates[j, k, 2] * pressing
            for tangent in range(d - 1):
                total += g.rates[j, k, slip_entry(tangent, states)] * w[1, 2 * tangent * n + j]
            for other in range(s.memory[j]):
                total += g.rates[j, k, 3 + other] * x[first + other]
            rate[first + k] += total


@routine
def solve_stage(i, h, problem, progress, workspace, vary):
    """Solve stage i of all columns, one by one.

    v.vectors[3] holds what the parameter adds to the rates of its column.
    """
    s, blocks, v = problem.system, problem.blocks, vary.variation
    G, forced = 1.0 / (h * tableau.GAMMA), v.vectors[3]
    count, size = v.columns.shape
    m = len(v.none)
    w, right, X, rate = v.nodes, v.vectors[1], v.vectors[2], v.vectors[4]
    for c in range(count):
        own = v.stages[tableau.STAGES * c : tableau.STAGES * (c + 1)]
        tableau.combined(tableau.A[i], 1.0, v.columns[c], own, X)
        for k in range(w.shape[1]):
            w[2, k] = 0.0
        for k in range(2 * m, size):
            rate[k] = 0.0
        add_node_forces(v.ahead, s, blocks, v.columns[c], w, rate)
        add_node_forces(v.inside, s, blocks, X, w, rate)
        dynamics.gather(X, s, blocks, v.none, w[2], rate)
        if has_polynomial(s):
            add_polynomial_product(-1.0, v.inside.polynomial, X, s, rate[m : 2 * m])
            add_polynomial_product(-1.0, v.ahead.polynomial, v.columns[c], s, rate[m : 2 * m])
        if vary.width != 0.0 and c == count - 1:
            for k in range(size):
                rate[k] += forced[k]
        tableau.combined(tableau.C[i], 1.0 / h, rate, own, right)
        stage_solver.solve_stage(G, s, blocks, progress.gradients, workspace.reduced, right, w,
                                 own[i])
        if i == tableau.STAGES - 1:
            for k in range(size):
                v.after[c, k] = X[k] + own[i, k]
