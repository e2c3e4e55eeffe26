"""Step-size limits of runs with set-valued friction and rigid stops."""

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate.run_limits import largest_motions, longest_step
from fecontact.system.contact_system import ContactSystem
from fecontact.system.loads import work_of_loads
from fecontact.system.powers import POWER_COUNT

# Longest step in periods of the excitation, where it is the only thing given in time.
_PERIOD_PART = 0.125
# Change of a signal within rounding of a time, in parts of its largest value, that is a jump.
_JUMP = 1e-9
# Errors of velocities count relative to this part of what drive and loads bring about.
_DRIVEN = 1e-3


def stops_of(system: ContactSystem, start: float, end: float) -> Array:
    """Breaks (k,) up to the end; where signals jump right after one, the next number instead."""
    found = np.array(system.breakpoints(float(np.nextafter(start, -np.inf)),
                                        float(np.nextafter(end, np.inf))), dtype=float)
    near = np.stack([np.nextafter(found, -np.inf), found, np.nextafter(found, np.inf)])
    jumps = np.zeros((2, len(found)), dtype=bool)
    for signal in (*system.drive.motions, *system.load.signals.values()) if len(found) else ():
        value, rate = signal.history(near.ravel()).T.reshape(2, 3, -1)
        steepest = np.abs(rate).max(axis=0) * np.diff(near, axis=0).max(axis=0)
        jumps |= np.abs(np.diff(value, axis=0)) > 2.0 * steepest + _JUMP * signal.largest
    stops = np.union1d(found[jumps[0] | ~jumps[1]], near[2, jumps[1]])
    return stops[(stops > start) & (stops <= end)]


def longest_between_events(system: ContactSystem, times: Array) -> float:
    """Longest step [s] of an event-driven run with compliant contact."""
    if not system.prescribed_motion.constant or system.ground.wavy:
        return longest_step(system, times)
    start, end = float(times[0]), float(times[-1])
    return min((end - start) / 50.0, _PERIOD_PART * system.shortest_period(start, end))


def floor_of(system: ContactSystem, state: Array, times: Array, longest: float) -> Array:
    """Values (2 m + p + n,) below which the error is not measured relative to the state."""
    m, n = system.basis.modes, system.basis.contact_nodes
    arrays, drive = system.arrays, system.drive
    largest = largest_motions(system)
    depth = system.penetration_scale
    fastest = system.prescribed_motion.largest_speed(float(times[0]), float(times[-1]))
    speed = max(0.01 * fastest,
                depth / longest)
    # Velocities that drive and loads bring about in each mode, within a step where it is slow.
    springs = arrays.drive_stiffness[:, None] * arrays.drive_shapes
    applied_forces = [(springs, [motion.largest for motion in drive.motions[: len(springs)]]),
              (arrays.load_shapes, [signal.largest for signal in system.load.signals.values()])]
    applied = sum(np.array(sizes) @ np.abs(shapes) for shapes, sizes in applied_forces)
    slowest = np.maximum(np.diag(arrays.stiffness), 1.0 / longest**2)
    driven = applied / np.sqrt(slowest)
    energy = (0.5 * state[m : 2 * m] @ state[m : 2 * m]
              + 0.5 * abs(state[:m] @ system.arrays.stiffness @ state[:m])
              + work_of_loads(system.basis, system.load, depth)
              + sum(0.5 * c * motion.largest**2 for c, motion in zip(
                  drive.stiffness, drive.motions, strict=True))
              + 0.5 * driven @ driven)
    return np.concatenate([depth / largest, np.maximum(speed / largest, _DRIVEN * driven),
                           np.full(POWER_COUNT + n, energy or 0.5 * speed**2)])
