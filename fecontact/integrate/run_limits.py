"""Limits of the steps of a run: breaks, periods, and scales of motion and energy."""

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.system.contact_system import ContactSystem
from fecontact.system.loads import work_of_loads
from fecontact.system.model_limits import MOST_PERIODS


def breaks(
    system: ContactSystem, times: Array, also: ArrayLike = (),
) -> tuple[float, Array]:
    """The last break at the start, or the start; and first and last (k, 2) of those after it.

    Breaks that only rounding tells apart are one, for no step fits between such: 0.1 + 0.2 and 0.3
    are meant to be one time. So are those at the end.
    """
    start, end = float(times[0]), float(times[-1])
    close = resolution(times)
    # Those at the very start and end too.
    jumps = system.breakpoints(float(np.nextafter(start, -np.inf)),
                               float(np.nextafter(end, np.inf)))
    groups = [[start]]
    for one in np.sort(np.concatenate([jumps, np.asarray(also, dtype=float)])):
        if one - groups[-1][-1] <= close:
            groups[-1].append(float(one))
        else:
            groups.append([float(one)])
    if len(groups) > 1 and end - groups[-1][-1] <= close:
        groups[-1].append(end)
    return groups[0][-1], np.array([[one[0], one[-1]] for one in groups[1:]]).reshape(-1, 2)


def work_of_jump(system: ContactSystem, before: float, after: float, y: Array) -> float:
    """Work that the drive puts in where its motions jump between two times, in a state [J]."""
    work, q = 0.0, y[: system.basis.modes]
    for motion, stiffness, shape in zip(system.drive.motions, system.arrays.drive_stiffness,
                                        system.arrays.drive_shapes, strict=False):
        old, new = motion.history([before, after])[:, 0]
        if new != old:
            work += stiffness * (0.5 * (old + new) - shape @ q) * (new - old)
    return float(work)


def largest_motions(system: ContactSystem) -> Array:
    """Largest motion (m,) of each mode at any point; 1 for one that moves none.

    Coordinates of large deflections also move as far as their forces feel them.
    """
    basis = system.basis
    largest = np.abs(basis.T[:, : basis.dimension]).max(axis=(0, 1))
    for one in basis.large_deflections:
        largest = np.maximum(largest, np.abs(
            one.displacements(basis.angular_frequencies)).max(axis=0))
    return np.where(largest > 0.0, largest, 1.0)


def energy_scale(system: ContactSystem, state: Array) -> float:
    """Energy at the start, of the drive's springs and of the load over the roughness [J].

    Where all these are zero, that of the mode that moves most at the scale of velocities.
    """
    m, drive = system.basis.modes, system.drive
    q, rate = state[:m], state[m : 2 * m]
    # Rotation may leave modes with a stiffness below zero.
    start = 0.5 * (rate @ rate + abs(q @ system.arrays.stiffness @ q))
    springs = 0.5 * sum(
        c * motion.largest**2
        for c, motion in zip(drive.stiffness, drive.motions, strict=True))
    pressed = work_of_loads(system.basis, system.load, system.penetration_scale)
    slow = 0.5 * (system.velocity_scale / largest_motions(system).max()) ** 2
    return float(start + springs + pressed) or float(slow)


def bounded_period(system: ContactSystem, times: Array, max_step: float | None = None) -> float:
    """Shortest period of drive, loads and waves [s], infinite if none; see :func:`longest_step`.

    Raises
    ------
    InputError
        If the run holds more than :data:`MOST_PERIODS` of these periods, or of steps ``max_step``.
    """
    start, end = float(times[0]), float(times[-1])
    period = system.shortest_period(start, end)
    for size, what, remedy in (
            (period, "periods of the fastest of drive, loads, ground and waves",
             "end it earlier or lower that frequency"),
            (max_step or np.inf, "steps of max_step", "end it earlier or raise max_step")):
        count = (end - start) / size
        if count > MOST_PERIODS:
            raise InputError(f"The run from {start:g} s to {end:g} s holds {count:.2g} {what} of "
                             f"{size:.3g} s, but can have {MOST_PERIODS:.0e} at most; {remedy}.")
    return period


def longest_step(
    system: ContactSystem, times: Array, max_step: float | None = None,
    of_run: float = 50.0, of_period: float = 20.0,
) -> float:
    """Limit of the step [s]: a part of the run, one of the shortest period, or ``max_step``.

    The period is that of drive, loads and waves. Longer steps could miss an excitation that starts
    from rest.
    """
    longest = min((float(times[-1]) - float(times[0])) / of_run,
                  bounded_period(system, times, max_step) / of_period)
    return longest if max_step is None else min(longest, float(max_step))


def resolution(times: Array) -> float:
    """Times that are no farther apart than this are one [s]."""
    return 1e-14 * max(abs(float(times[0])), abs(float(times[-1])))
