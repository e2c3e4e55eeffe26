"""Compiled rates within steps from event to event: what a stage needs, and no more.

The rates are those of :mod:`fecontact.integrate.nonsmooth.equations`. Prescribed motions and loads
are evaluated once for each time, limits of stick where forces are compared with them, and powers at
the stages that enter the end of a step or its interpolation.
"""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.integrate.nonsmooth.equations import (
    add_contact_forces,
    contact_powers,
    set_limits,
    share_friction,
)
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import (
    add_drive_force,
    add_loads,
    body_acceleration,
    set_constant_load,
)
from fecontact.system.nodes import GroundMotion, ground_motion
from fecontact.system.powers import DASHPOTS, DRIVE, LOAD, POWER_COUNT, matrix_powers

# Entries of what is given in time: the time, travel and speed of the ground, and from MOTION on
# the motion of the drive along each axis and its rate.
GIVEN = 7
WHEN, TRAVEL, SPEED, MOTION = range(4)


def nothing_given() -> np.ndarray:
    """Arrays of prescribed motions and loads, before the first time."""
    return np.full(GIVEN, np.nan)


@helper
def set_prescribed(t, s, workspace):
    """Fill ``workspace.given``, ``loads``, and ``applied_forces`` (m,), with those of the drive."""
    given = workspace.given
    if given[WHEN] == t:
        return
    moved = ground_motion(t, s)
    given[WHEN], given[TRAVEL], given[SPEED] = t, moved.travel, moved.speed
    set_constant_load(s, workspace.loads)
    add_loads(t, s, workspace.loads)
    for i in range(len(workspace.loads)):
        workspace.applied_forces[i] = workspace.loads[i]
    for axis in range(len(s.drive)):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if stiffness != 0.0 or damping != 0.0:
            value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
            given[MOTION + 2 * axis], given[MOTION + 2 * axis + 1] = value, rate
            add_drive_force(stiffness * value + damping * rate, axis, s, workspace.applied_forces)


@helper
def _moved(given):
    """Motion of the ground in ``given``."""
    return GroundMotion(given[TRAVEL], given[SPEED], 0.0, 0.0)


@routine
def set_rates(t, Y, p, progress, w, workspace, out):
    """Fill out (2 m,) with q' and q'' at Y, and w with what acts, except for limits of stick."""
    s = p.system
    m = s.rows.shape[2]
    set_prescribed(t, s, workspace)
    acceleration = out[m : 2 * m]
    for i in range(m):
        out[i] = Y[m + i]
    body_acceleration(workspace.applied_forces, Y, s, acceleration)
    add_contact_forces(t, Y, _moved(workspace.given), p, progress.status, progress.closed, w,
                       acceleration)


@helper
def set_slips(t, Y, p, w):
    """Put the slip velocities of the clusters at Y into ``w.slip``."""
    clusters, m = p.rows.shape
    speed = ground_motion(t, p.system).speed
    for c in range(clusters):
        w.slip[c] = -p.sliding[c] * speed
        for i in range(m):
            w.slip[c] += p.rows[c, i] * Y[m + i]


@helper
def share(p, status, w):
    """Friction of the nodes of sticking clusters, put into ``w.friction``."""
    if len(p.rows) < len(p.cluster):
        set_limits(p, w)
    share_friction(p, status, w)


@helper
def _drive_powers(given, Y, s, out):
    """Powers of the drive, added to out."""
    m = s.rows.shape[2]
    for axis in range(len(s.drive)):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if stiffness == 0.0 and damping == 0.0:
            continue
        value, rate = given[MOTION + 2 * axis], given[MOTION + 2 * axis + 1]
        place, speed = 0.0, 0.0
        for i in range(m):
            place += s.drive_shapes[axis, i] * Y[i]
            speed += s.drive_shapes[axis, i] * Y[m + i]
        out[DRIVE] += (stiffness * (value - place) + damping * (rate - speed)) * rate
        out[DASHPOTS] += damping * rate * (rate - 2.0 * speed)


@routine
def set_powers(Y, p, progress, w, workspace, out):
    """Fill out (p + n,) with the powers at Y, where :func:`set_rates` has been last."""
    s = p.system
    m = s.rows.shape[2]
    share(p, progress.status, w)
    for k in range(POWER_COUNT):
        out[k] = 0.0
    _drive_powers(workspace.given, Y, s, out)
    for i in range(m):
        out[LOAD] += workspace.loads[i] * Y[m + i]
    matrix_powers((0, m, 0, m), Y, s, out)
    contact_powers(_moved(workspace.given), s, w.nodes, w.friction, p.rigid == 0, out)
