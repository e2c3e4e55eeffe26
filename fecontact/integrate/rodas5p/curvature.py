"""Second derivatives of the node forces along the stages of a step, by differences."""

from fecontact.core.compiled import helper
from fecontact.integrate.rodas5p import dynamics
from fecontact.laws.signatures import ground_at, signal_at

# Differences are taken over this part of the scales of the laws.
_PART = 1e-4
# Differences of larger parts of the usual size of a derivative are jumps.
_JUMP = 3.0 * _PART


@helper
def reach(u, shapes, slip_scale, depth, memory_scale, w):  # type: ignore[no-untyped-def]
    """Multiple e of the stage u that is small against the scales of all laws."""
    m, rows = shapes.shape
    n = rows // 2
    dynamics.project(shapes, u, w[0], w[1])
    largest = 1.0
    for j in range(n):
        largest = max(largest, abs(w[1, j]) / slip_scale[j])
        largest = max(largest, abs(w[0, n + j]) / depth[j])
    for k in range(len(memory_scale)):
        largest = max(largest, abs(u[2 * m + k]) / memory_scale[k])
    return _PART / largest


@helper
def _difference(ahead, here, behind, factor, forward, usual):  # type: ignore[no-untyped-def]
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
def learn(here, usual):  # type: ignore[no-untyped-def]
    """Let the usual sizes be the largest seen."""
    n, states, width = here.rates.shape
    for j in range(n):
        for row in range(3):
            for k in range(4):
                usual.partial[j, row, k] = max(usual.partial[j, row, k],
                                               abs(here.partial[j, row, k]))
        for k in range(width):
            usual.force[j, k] = max(usual.force[j, k], abs(here.force[j, k]))
            for row in range(states):
                usual.rates[j, row, k] = max(usual.rates[j, row, k], abs(here.rates[j, row, k]))


@helper
def set_sinking(t, y, s, shapes, v, out):  # type: ignore[no-untyped-def]
    """Fill out (2, n): slope of the ground under each node, and rate of its penetration."""
    n = len(s.abscissa)
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    dynamics.project(shapes, y, v.nodes[0], v.nodes[1])
    for j in range(n):
        xi = s.abscissa[j] + v.nodes[0, j] - travel
        slope = ground_at(s.profile)(xi, s.profile_parameters)[1]
        out[0, j] = slope
        out[1, j] = slope * (v.nodes[1, j] - speed) - v.nodes[1, n + j]


@helper
def differences(ahead, here, behind, usual, factor, u, travelled, sinking, shapes, w):  # type: ignore[no-untyped-def]
    """Put the difference quotients of gradients along the stage u into those ahead.

    A stage that moves a node as the step does shows with its forward side what is within the
    step.
    """
    n, states, width = ahead.rates.shape
    dynamics.project(shapes, u, w[0], w[1])
    for j in range(n):
        sunk = sinking[0, j] * (w[0, j] - travelled) - w[0, n + j]
        forward = sunk * sinking[1, j] >= 0.0
        for row in range(3):
            for k in range(4):
                ahead.partial[j, row, k] = _difference(
                    ahead.partial[j, row, k], here.partial[j, row, k], behind.partial[j, row, k],
                    factor, forward, usual.partial[j, row, k])
        for k in range(width):
            ahead.force[j, k] = _difference(ahead.force[j, k], here.force[j, k],
                                            behind.force[j, k], factor, forward,
                                            usual.force[j, k])
            for row in range(states):
                ahead.rates[j, row, k] = _difference(
                    ahead.rates[j, row, k], here.rates[j, row, k], behind.rates[j, row, k], factor,
                    forward, usual.rates[j, row, k])
