"""Compiled powers of the drive, the loads and the dampers of the body."""

from fecontact.core.compiled import helper
from fecontact.laws.signatures import signal_at


@helper
def body_powers(t, y, s, out):  # type: ignore[no-untyped-def]
    """Fill out (8,) with the powers outside the contact, the others with zero."""
    m = s.Tx.shape[1]
    out[:8] = 0.0
    for axis in range(2):
        value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
        pull = s.drive_stiffness[axis] * value
        for i in range(m):
            pull -= s.drive_shapes[axis, i] * y[i]
        out[0] += pull * rate
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(m):
            out[3] += value * s.load_shapes[k, i] * y[m + i]
    for i in range(m):
        out[3] += s.constant_load[i] * y[m + i]
        for k in range(m):
            product = y[m + i] * y[m + k]
            out[4] += s.modal_damping[i, k] * product
            out[5] += (s.damping[i, k] - s.modal_damping[i, k]) * product


@helper
def drive_jump(before, after, y, s):  # type: ignore[no-untyped-def]
    """Work that the drive puts in where its motions jump, between two times on both sides [J]."""
    work = 0.0
    for axis in range(2):
        old = signal_at(s.drive[axis])(before, s.drive_parameters[axis])[0]
        new = signal_at(s.drive[axis])(after, s.drive_parameters[axis])[0]
        pull = 0.5 * s.drive_stiffness[axis] * (old + new)
        for i in range(s.Tx.shape[1]):
            pull -= s.drive_shapes[axis, i] * y[i]
        work += pull * (new - old)
    return work
