"""Time integration by scipy's stiff solvers, with the compiled right-hand side and Jacobian."""

import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.integrate.trajectory import Solution, Status
from fecontact.system import jacobian as contact_jacobian
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import (
    book_stored,
    exact_arrays,
    excesses,
    slider_counts,
    stick_again,
    stored_in_sliders,
    within_limits,
)
from fecontact.system.kernels import right_hand_side
from fecontact.system.loads import work_of_loads
from fecontact.system.model_limits import MOST_PERIODS
from fecontact.system.powers import NODE_POWERS, POWERS, powers


def integrate(
    system: ContactSystem,
    state: Array,
    times: Array,
    *,
    method: str,
    rtol: float,
    progress: Callable[[float], None] | None,
    max_step: float | None = None,
) -> Solution:
    """Integrate from ``times[0]`` to ``times[-1]``.

    The powers of drive, ground, belt, damping and friction are integrated with the state, with
    error control, so that the energy balance closes to the tolerance.
    ``method`` is 'Radau', 'BDF' or 'LSODA'.
    """
    import scipy.integrate

    begin = clock.perf_counter()
    size, extra = len(state), len(POWERS)
    rhs, jacobian, tolerance, counts = with_work(system, state, rtol)
    pieces = smooth_pieces(system, times)
    longest = longest_step(system, times, max_step)
    sliders = slider_counts(system)

    def started(y: Array, since: float | None = None) -> Any:
        begin, end = pieces[0].begin if since is None else since, pieces[0].end
        latest = before_break(begin, end)
        return getattr(scipy.integrate, method)(
            lambda t, y: rhs(min(max(t, pieces[0].after), latest), y), begin, y, end,
            jac=jacobian, rtol=rtol, atol=tolerance, max_step=longest)

    result = np.empty((len(times), size + extra))
    done, y = pass_break(system, float(times[0]), pieces[0].begin, times, 0, result,
                         np.concatenate([state, np.zeros(extra)]))
    solver = started(y)
    steps, stalled = 0, 0
    status = Status.FINISHED
    try:
        while pieces:
            before = solver.t
            message = _step(solver)
            # LSODA repeats steps that do not advance time forever.
            stalled = stalled + 1 if solver.t == before else 0
            if stalled == 100:
                message = "Required step size is less than spacing between numbers."
            if message is not None:
                status = Status.FAILED
                counts["message"] = message
                break
            steps += 1
            if sliders.any():
                # A step within which slip of an element ends is left there.
                left = _end_of_slip(system, sliders, solver)
                if left is not None:
                    slipped = float(left[0])
                    reached = done + int(np.searchsorted(times[done:], slipped, side="right"))
                    if reached > done:
                        result[done:reached] = solver.dense_output()(times[done:reached]).T
                        done = reached
                    solver = started(left[1], slipped)
                    continue
            ended = solver.status == "finished"
            reached = done + int(np.searchsorted(times[done:], solver.t,
                                                 side="left" if ended else "right"))
            if reached > done:
                result[done:reached] = solver.dense_output()(times[done:reached]).T
                done = reached
            if ended:
                last = pieces.pop(0)
                done, y = pass_break(system, before_break(last.begin, last.end), last.until, times,
                                     done, result, solver.y)
                if pieces:
                    solver = started(y)
            if progress is not None:
                progress(float(solver.t))
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    statistics = {"steps": steps, **counts, "seconds": clock.perf_counter() - begin}
    times, result = times[:done], result[:done]
    if status is not Status.FINISHED and solver.t > times[-1] and np.isfinite(solver.y).all():
        times, result = np.append(times, solver.t), np.vstack([result, solver.y])
    states, work = result[:, :size], result[:, size:]
    if sliders.any():
        states, work = within_limits(system, times, states, sliders), work.copy()
        book_stored(work, stored_in_sliders(system, states, sliders))
    return Solution(times, states, work, status, statistics)


# Parts of a step at which excesses of elastic Coulomb elements are looked at, and a part of it
# within which slip of several elements ends at once.
_LOOKS, _ONE_PLACE = 4, 1e-6


def _end_of_slip(
    system: ContactSystem, counts: Integers, solver: Any,
) -> tuple[float, Array] | None:
    """Time in the last step at which slip of an element ends, and the state after it; or None."""
    from scipy.optimize import minimize_scalar

    begin, h, dense = solver.t_old, solver.t - solver.t_old, solver.dense_output()
    arrays, size = exact_arrays(system.arrays, counts), system.size

    def excess(part: float) -> Array:
        out = np.empty((len(counts), int(counts.max())))
        t = begin + part * h
        excesses(t, np.ascontiguousarray(dense(t)[:size]), arrays, counts, out)
        return out

    parts = np.linspace(0.0, 1.0, _LOOKS + 1)
    values = np.array([excess(part) for part in parts])
    places = np.full(values.shape[1:], np.inf)
    falls = values[:-1] - values[1:] > 1e-12 * np.abs(values[:-1])
    for at in np.argwhere(falls.any(axis=0) & (values.max(axis=0) > -np.inf)):
        j, i = (int(one) for one in at)
        look = int(np.argmax(falls[:, j, i]))
        low, high = parts[max(look - 1, 0)], parts[look + 1]
        place = float(minimize_scalar(lambda part, j=j, i=i: -float(excess(part)[j, i]),
                                      bounds=(low, high), method="bounded",
                                      options={"xatol": 1e-10}).x)
        if low == 0.0 and values[0, j, i] >= excess(place)[j, i]:
            place = 0.0
        if excess(place)[j, i] > 0.0:
            places[j, i] = place
    first = float(places.min())
    if first == np.inf:
        return None
    t = begin + first * h
    y = dense(t)
    # The state without the works that follow it.
    stick_again(t, y[:size], arrays, counts, np.where(places <= first + _ONE_PLACE, 1.0, 0.0))
    return t, y


def with_work(
    system: ContactSystem, state: Array, rtol: float,
) -> tuple[Callable[[float, Array], Array], Callable[[float, Array], Array], Array, dict[str, Any]]:
    """Right-hand side and Jacobian of state and work, their absolute tolerances, and counts.

    The error of the work counts a hundredth of that of the energies, so that the balance closes.
    """
    size, extra = len(state), len(POWERS)
    arrays = exact_arrays(system.arrays, slider_counts(system))
    n = system.basis.contact_nodes
    of_nodes, stick_speed = np.empty(NODE_POWERS * n), np.zeros(n)
    counts: dict[str, Any] = {"right_hand_sides": 0, "jacobians": 0}

    def rhs(t: float, y: Array) -> Array:
        counts["right_hand_sides"] += 1
        out = np.empty(size + extra)
        state = np.ascontiguousarray(y[:size])
        right_hand_side(t, state, arrays, out[:size])
        powers(t, state, arrays, stick_speed, out[size:], of_nodes)
        return out

    def jacobian(t: float, y: Array) -> Array:
        counts["jacobians"] += 1
        out = np.zeros((size + extra, size + extra))
        slopes = np.empty((size, size))
        contact_jacobian.jacobian(t, np.ascontiguousarray(y[:size]), arrays, slopes)
        out[:size, :size] = slopes
        return out

    energy = 0.01 * rtol * energy_scale(system, state)
    tolerance = np.concatenate([absolute_tolerances(system, rtol), np.full(extra, energy)])
    return rhs, jacobian, tolerance, counts


class Piece(NamedTuple):
    """A time in which all that is given is smooth: ``begin`` to ``end``, then breaks ``until``.

    Signals are as ``after`` the break at its begin from there on.
    """

    begin: float
    after: float
    end: float
    until: float


def breaks(
    system: ContactSystem, times: Array, also: ArrayLike = (),
) -> tuple[float, Array]:
    """The last break at the start, or the start; and first and last (k, 2) of those after it.

    Breaks that only rounding tells apart are one, for no step fits between such: 0.1 + 0.2 and 0.3
    are meant to be one time. So are those at the end.
    """
    start, end = float(times[0]), float(times[-1])
    close = _close(times)
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


def _close(times: Array) -> float:
    """Times that are no farther apart than this are one [s]."""
    return 1e-14 * max(abs(float(times[0])), abs(float(times[-1])))


def smooth_pieces(system: ContactSystem, times: Array) -> list[Piece]:
    """Pieces of a run, from its start or the last break there to its end."""
    first, groups = breaks(system, times)
    end = float(times[-1])
    if not len(groups) or groups[-1, 1] < end:
        groups = np.vstack([groups, [end, end]])
    begins = np.append(first, groups[:-1, 1])
    return [Piece(float(begin), float(np.nextafter(begin, end)), float(low), float(high))
            for begin, (low, high) in zip(begins, groups, strict=True)]


def before_break(t: float, end: float) -> float:
    """The last time before a breakpoint at ``end``, where signals may jump, of a step from t."""
    return float(np.nextafter(end, t))


def pass_break(
    system: ContactSystem, before: float, until: float, times: Array, done: int, result: Array,
    y: Array,
) -> tuple[int, Array]:
    """Fill the rows of outputs from ``done`` on that lie at breaks; how many are done, and y after.

    At the breaks from ``before`` to ``until`` jumps of the drive do work, and nothing moves.
    """
    def jumped(after: float) -> Array:
        moved = y.copy()
        moved[system.size] += work_of_jump(system, before, after, y)
        return moved

    while done < len(times) and times[done] <= until + _close(times):
        result[done] = jumped(float(times[done]))
        done += 1
    return done, jumped(float(np.nextafter(until, times[-1])))


def work_of_jump(system: ContactSystem, before: float, after: float, y: Array) -> float:
    """Work that the drive puts in where its motions jump between two times, in a state [J]."""
    work, q = 0.0, y[: system.basis.modes]
    for motion, stiffness, shape in zip(system.drive.motions, system.arrays.drive_stiffness,
                                        system.arrays.drive_shapes, strict=False):
        old, new = motion.history([before, after])[:, 0]
        if new != old:
            work += stiffness * (0.5 * (old + new) - shape @ q) * (new - old)
    return float(work)


def _step(solver: Any) -> str | None:
    """Take one step; return a message if it failed."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            message = solver.step()
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        # scipy's linear algebra raises this for values that are not finite.
        return "The motion grew beyond all numbers."
    if solver.status == "failed":
        return str(message)
    return None if np.isfinite(solver.y).all() else "The motion grew beyond all numbers."


def absolute_tolerances(system: ContactSystem, rtol: float) -> Array:
    """Absolute tolerances (2 m + n s,) of the state.

    Displacements: ``rtol`` times the smallest penetration scale. Velocities: a tenth of the
    smallest velocity scale of friction, or less for a smaller ``rtol``, since steps that do not
    resolve it miss stick. Both are divided by the mode's largest motion at any point. Internal
    variables: ``rtol`` times their scales.
    """
    largest = largest_motions(system)
    velocity = min(0.1, 1e5 * rtol) * system.velocity_scale
    return np.concatenate([rtol * system.penetration_scale / largest, velocity / largest,
                           rtol * system.memory_scales])


def largest_motions(system: ContactSystem) -> Array:
    """Largest motion (m,) of each mode at any point; 1 for one that moves none."""
    largest = np.abs(system.basis.T[:, : system.basis.dimension]).max(axis=(0, 1))
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


def longest_step(system: ContactSystem, times: Array, max_step: float | None = None) -> float:
    """Limit of the step [s]: 1/50 of the run, 1/20 of the shortest period, or ``max_step``.

    The period is that of drive, loads and waves. Longer steps could miss an excitation that starts
    from rest.
    """
    start, end = float(times[0]), float(times[-1])
    longest = min((end - start) / 50.0, bounded_period(system, times, max_step) / 20.0)
    return longest if max_step is None else min(longest, float(max_step))
