"""Runs by solvers of other libraries, with the compiled right-hand side and Jacobian."""

import time as clock
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.integrate.kept_rows import GrowingRows, workspace_for_rows
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.reference.watched import Watched
from fecontact.integrate.run_limits import (
    breaks,
    energy_scale,
    largest_motions,
    longest_step,
    resolution,
    work_of_jump,
)
from fecontact.integrate.task import Task
from fecontact.integrate.trajectory import Solution, Status
from fecontact.system import jacobian as contact_jacobian
from fecontact.system.columns import POWERS
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import (
    booked,
    exact_arrays,
    excesses,
    slider_counts,
    stick_again,
)
from fecontact.system.kernels import right_hand_side
from fecontact.system.powers import NODE_POWERS, powers

# Steps that do not advance time, which LSODA repeats forever, after which a run is given up.
_STALLED = 100
# Rows between outputs are kept at so many places of a step.
_PLACES = 2


class Equations(NamedTuple):
    """Equations for a library's solver: y' of state and work, and its tolerances.

    ``rate(t, y)`` and ``jacobian(t, y)`` return new arrays; ``tolerance`` is the absolute one of
    each entry, ``longest`` the longest step [s].
    """

    rate: Callable[[float, Array], Array]
    jacobian: Callable[[float, Array], Array]
    rtol: float
    tolerance: Array
    longest: float


class Steps(ABC):
    """Steps of a library's solver, made of equations, a begin, a state and an end.

    Attributes
    ----------
    begin, t : float
        Begin and end of the last step [s].
    y : array
        The state at its end.
    """

    begin: float
    t: float
    y: Array

    def step(self) -> str | None:
        """Take one; why it failed if it did, after which begin, t and y are as before."""
        for _ in range(_STALLED):
            found = self.attempt()
            if isinstance(found, str):
                return found
            if found[0] > self.t:
                self.begin, (self.t, self.y) = self.t, found
                return None
        return "The steps became shorter than numbers can tell apart."

    @abstractmethod
    def attempt(self) -> tuple[float, Array] | str:
        """Time and state after a step of the library, or why it failed."""

    @abstractmethod
    def dense(self, t: float) -> Array:
        """The state at a time within the last step."""


def integrate(
    task: Task, start_steps: Callable[[Equations, float, Array, float], Steps],
) -> Solution:
    """Integrate by a library's solver, anew after each break and each end of slip of an element.

    The powers of drive, ground, belt, damping and friction are integrated with the state, with
    error control, so that the energy balance closes to the tolerance.
    """
    started, system, state, times = clock.perf_counter(), task.system, task.state, task.times
    size, extra = len(state), len(POWERS)
    equations, counts = with_work(system, state, task.rtol,
                                  longest_step(system, times, task.max_step))
    pieces, sliders = smooth_pieces(system, times), slider_counts(system)
    result = np.empty((len(times), size + extra))
    kept = GrowingRows(workspace_for_rows(task.keep_steps, size + extra))
    done, y = pass_break(system, float(times[0]), pieces[0].begin, times, 0, result,
                         np.concatenate([state, np.zeros(extra)]))
    t, status, stuck = pieces[0].begin, Status.FINISHED, -np.inf
    watched = Watched(task, t, y[:size]) if task.events else None
    try:
        for piece in pieces:
            # The last time before the break at its end, where signals may jump.
            latest = float(np.nextafter(piece.end, piece.begin))
            within = equations._replace(rate=_within(equations.rate, piece.after, latest))
            t, steps = piece.begin, start_steps(within, piece.begin, y, piece.end)
            while t < piece.end and status is Status.FINISHED:
                message = steps.step()
                if message is not None:
                    status, counts["message"] = Status.FAILED, message
                    break
                counts["steps"] += 1
                # A step within which slip of an element ends is left there.
                left = _end_of_slip(system, sliders, steps) if sliders.any() else None
                if left is not None and left[0] <= stuck:
                    left = None  # It began at that time.
                t, y = (steps.t, steps.y) if left is None else left
                stuck = stuck if left is None else t
                if watched is not None:
                    stop = watched.look(steps.begin, t, latest, steps.dense)
                    if stop is not None:
                        t, y, status = stop, steps.dense(stop), Status.EVENT
                # An output at the end of a step belongs to the next one, or to the break there.
                reached = done + int(np.searchsorted(times[done:], t))
                for row in range(done, reached):
                    result[row] = steps.dense(float(times[row]))
                done = reached
                for part in np.linspace(steps.begin, t, _PLACES + 1)[1:].tolist():
                    kept.add(part, steps.dense)
                if left is not None and t < piece.end:
                    steps = start_steps(within, t, y, piece.end)
                if task.progress is not None:
                    task.progress(t)
            if status is not Status.FINISHED:
                break
            done, y = pass_break(system, latest, piece.until, times, done, result, y)
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    statistics = {**counts, "seconds": clock.perf_counter() - started}
    times, result = times[:done], result[:done]
    if status is not Status.FINISHED and t > times[-1] and np.isfinite(y).all():
        times, result = np.append(times, t), np.vstack([result, y])

    def columns(times: Array, values: Array) -> tuple[Array, Array]:
        return booked(system, sliders, times, values[:, :size], values[:, size:],
                      (float(task.times[0]), result[0, :size]))

    between = KeptSteps(kept.time, *columns(kept.time, kept.values.reshape(-1, size + extra)))
    return Solution(times, *columns(times, result), status, statistics,
                    events=None if watched is None else watched.events,
                    kept=between.part(~np.isin(kept.time, times)) if task.keep_steps else None)


def _within(
    rate: Callable[[float, Array], Array], after: float, latest: float,
) -> Callable[[float, Array], Array]:
    """Rates with what is given in time as it is between two breaks."""
    return lambda t, y: rate(min(max(t, after), latest), y)


# Parts of a step at which excesses of elastic Coulomb elements are examined, and a part of it
# within which slip of several elements ends at once.
_LOOKS, _ONE_PLACE = 4, 1e-6


def _end_of_slip(
    system: ContactSystem, counts: Integers, steps: Steps,
) -> tuple[float, Array] | None:
    """Time in the last step at which slip of an element ends, and the state after it; or None."""
    from scipy.optimize import minimize_scalar

    begin, h, dense = steps.begin, steps.t - steps.begin, steps.dense
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
    system: ContactSystem, state: Array, rtol: float, longest: float,
) -> tuple[Equations, dict[str, Any]]:
    """The equations of state and work, and counts of what is evaluated.

    The error of the work counts a hundredth of that of the energies, so that the balance closes.
    """
    size, extra = len(state), len(POWERS)
    arrays = exact_arrays(system.arrays, slider_counts(system))
    n = system.basis.contact_nodes
    of_nodes, stick_speed = np.empty(NODE_POWERS * n), np.zeros(n)
    counts: dict[str, Any] = {"steps": 0, "right_hand_sides": 0, "jacobians": 0}

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
    return Equations(rhs, jacobian, rtol, tolerance, longest), counts


class Piece(NamedTuple):
    """A time in which all that is given is smooth: ``begin`` to ``end``, then breaks ``until``.

    Signals are as ``after`` the break at its begin from there on.
    """

    begin: float
    after: float
    end: float
    until: float


def smooth_pieces(system: ContactSystem, times: Array) -> list[Piece]:
    """Pieces of a run, from its start or the last break there to its end."""
    first, groups = breaks(system, times)
    end = float(times[-1])
    if not len(groups) or groups[-1, 1] < end:
        groups = np.vstack([groups, [end, end]])
    begins = np.append(first, groups[:-1, 1])
    return [Piece(float(begin), float(np.nextafter(begin, end)), float(low), float(high))
            for begin, (low, high) in zip(begins, groups, strict=True)]


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

    while done < len(times) and times[done] <= until + resolution(times):
        result[done] = jumped(float(times[done]))
        done += 1
    return done, jumped(float(np.nextafter(until, times[-1])))


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
