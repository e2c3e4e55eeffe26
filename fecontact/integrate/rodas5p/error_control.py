"""Errors of a step as multiples of what is allowed."""

import numpy as np

from fecontact.core.compiled import helper
from fecontact.integrate.rodas5p import dynamics, tableau
from fecontact.integrate.rodas5p.state import ENERGY, SPEED_SCALE, WORST_NODE


@helper
def state_error(control, progress, room):  # type: ignore[no-untyped-def]
    """Error of a step as a multiple of what is allowed, of modes and internal variables."""
    m = len(control.largest)
    difference = room.stages[tableau.STAGES - 1]
    speed_scale = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    error = 0.0
    for i in range(m):
        scale = max(max(progress.extremes[i], abs(room.after[i])), control.displacement_scale[i])
        error = max(error, abs(difference[i]) / scale)
        error = max(error, abs(difference[m + i]) * control.largest[i] / speed_scale)
    for k in range(len(control.memory_scale)):
        error = max(error, abs(difference[2 * m + k]) / control.memory_scale[k])
    # Comparisons with NaN are false: make sure that it is not lost.
    for k in range(len(difference)):
        if not abs(room.after[k]) < np.inf:
            error = np.inf
    return error / control.rtol


@helper
def slip_error(error, s, shapes, control, progress, room):  # type: ignore[no-untyped-def]
    """The larger of the error and that of the slip velocities at the end of the step.

    Only where friction has no memory: there the force follows the slip velocity alone.
    """
    m, rows = shapes.shape
    n = rows // 2
    difference = room.stages[tableau.STAGES - 1]
    for j in range(n):
        if s.memory[j] == 0 and room.nodes[2, n + j] != 0.0:
            slip = 0.0
            for i in range(m):
                slip += shapes[i, j] * difference[m + i]
            distance = abs(room.nodes[1, j] - room.given[dynamics.SPEED])
            part = abs(slip) / (control.slip_part * (control.slip_scale[j] + distance))
            if part > error:
                error = part
                progress.counts[WORST_NODE] = j
    return error


@helper
def energy_scale(control, progress, room):  # type: ignore[no-untyped-def]
    """The largest of kinetic energy, work of a power and the energy scale so far [J]."""
    m = len(control.largest)
    kinetic = 0.0
    for i in range(m):
        kinetic += 0.5 * room.after[m + i] ** 2
    energy = max(max(progress.numbers[ENERGY], kinetic), control.energy_scale)
    for k in range(8):
        energy = max(energy, abs(progress.work[k]))
    progress.numbers[ENERGY] = energy
    return energy


@helper
def set_scale(control, progress, room):  # type: ignore[no-untyped-def]
    """Fill ``room.right`` with the sizes of the state: what its errors count relative to."""
    m = len(control.largest)
    speed_scale = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    for i in range(m):
        room.right[i] = max(progress.extremes[i], control.displacement_scale[i])
        room.right[m + i] = speed_scale / control.largest[i]
    for k in range(len(control.memory_scale)):
        room.right[2 * m + k] = control.memory_scale[k]
