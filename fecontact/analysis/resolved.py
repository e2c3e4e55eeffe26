"""Refinement of runs between their outputs, so that plotted curves and peaks are resolved.

Sparse outputs may miss an impact or distort a closed curve. As the state at an output determines
the motion after it, the run is repeated from there with more outputs until curves are resolved.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import SOLVERS, SetValued, solver_by_name
from fecontact.integrate.trajectory import Status, Trajectory

Flags = NDArray[np.bool_]

# Largest distance of a curve from its chords, relative to its range.
_ERROR = 1.0 / 400.0
# Ranges of displacements and velocities below these fractions of the largest one are noise, as are
# changes of forces below this fraction of the largest.
_SMALL, _SMALL_RATE, _SMALL_FORCE = 1e-5, 1e-4, 1e-6
# Largest distance of a repeated motion from the outputs, relative to the range; beyond it, the
# motions differ.
_SAME = 0.01
_LEVELS = 4
_FEWEST, _MORE, _MOST = 8, 16, 64  # subdivisions of an interval
_WINDOW, _GAP = 256, 16  # intervals repeated in one run; largest gap skipped within it
_NUMBERS = 20_000_000  # stored per run
_STEPS = 1_000_000  # repeated per run
_SMALL_SOLID = 40  # values of a state of a solid up to which that many steps are repeated
# Times that a repeated run may report its progress, and more for each second that its part of the
# run has taken: twenty times as long.
_REPORTS, _REPORTS_MORE = 5, 100
_FAILURES = 8  # consecutive failures before the run is considered not repeatable
_LONG = "between them the run took too many steps"
_TOLD = 2e-3  # fraction of the time
_NODES = 8  # contact nodes monitored besides the named points

_COUNTED = ("work", "node_friction_work", "node_creep_work")  # relative to the first time of a run
_STATE = ("modal_coordinates", "modal_velocities", "memory", "held_normal_force",
          "held_friction_force")


class _TooManyStepsError(Exception):
    """A repeated run takes far more steps than the run itself."""


class Resolved(NamedTuple):
    """Result of :func:`resolved`.

    trajectory : the run with additional output times, or the run itself
    coarse : fraction of the time in which chords between outputs may cut off peaks
    reason : why it stayed coarse, as text
    """

    trajectory: Trajectory
    coarse: float
    reason: str

    @property
    def note(self) -> str:
        """Note for plots; empty if everything is resolved."""
        if self.coarse <= _TOLD:
            return ""
        return (f"straight lines between outputs in {max(self.coarse, 0.01):.0%} of the time, "
                f"which may cut peaks: {self.reason}")


_KNOWN: "WeakKeyDictionary[Trajectory, Resolved]" = WeakKeyDictionary()


def resolved(trajectory: Trajectory) -> Resolved:
    """Add output times wherever outputs are too far apart to be joined by straight lines.

    The chords then deviate by at most 1/400 of the range from displacements and velocities of the
    named points and from normal and friction forces. Existing outputs do not change. The motion
    between them is computed by ``simulate`` with the tolerance of the run. It stays coarse beyond
    a million steps, and where the repeated motion does not meet the next output, as for histories
    that were not computed by ``simulate``.

    Parameters
    ----------
    trajectory : Trajectory
        A run or a part of one.
    """
    if trajectory not in _KNOWN:
        found = _resolved(trajectory)
        if found.trajectory is trajectory:
            # A cached value must not hold a reference to its key.
            return found
        _KNOWN[trajectory] = found
    return _KNOWN[trajectory]


def _resolved(run: Trajectory) -> Resolved:
    if len(run.time) < 2 or not np.isfinite(run.states).all():
        return Resolved(run, 0.0, "")
    total = float(run.time[-1] - run.time[0])
    flags, reason = _coarse(run), "they are jumps"
    lost, left = 0.0, _most_steps(run)
    average = math.ceil(float(run.statistics.get("steps", 0)) / (len(run.time) - 1))
    for level in range(_LEVELS):
        if not flags.any():
            break
        parts = min(max(average, _FEWEST), _MOST) if level == 0 else _MORE
        parts = min(parts, _room(run) // int(flags.sum()))
        why = "this history was not computed by a run"
        if "solver" in run.statistics:
            why = _LONG if average > left else ""
        if parts < 2:
            why = "it moves too fast for its duration to be kept"
        if why:
            reason = why
            break
        time = run.time
        run, refined, steps, why = _repeated(run, flags, parts, left)
        left -= steps
        lost += float(np.diff(time)[flags & ~refined].sum())
        reason = why or reason
        # Skip intervals that are resolved or cannot be repeated.
        between = np.searchsorted(time, run.time[:-1], side="right") - 1
        flags = _coarse(run) & refined[between]
    lost += float(np.diff(run.time)[flags].sum())
    return Resolved(run, min(1.0, lost / total), reason)


def _most_steps(run: Trajectory) -> int:
    """Steps to repeat; of solids fewer, as each takes time by the third power of the state."""
    size = run.states.shape[1]
    if run.system.basis.dimension == 2 or size <= _SMALL_SOLID:
        return _STEPS
    return int(_STEPS * (_SMALL_SOLID / size) ** 3)


def _room(run: Trajectory) -> int:
    """Number of output times that can still be added."""
    size = run.states.shape[1] + 8 * (run.system.basis.contact_nodes + 1)
    return max(0, _NUMBERS // size - len(run.time))


def _coarse(run: Trajectory) -> Flags:
    """Flags (N - 1,) of the intervals that are too long for a straight line."""
    moved, rates = _motion(run)
    sizes, rate_sizes = _ranges(moved, rates)
    normal, friction = run.normal_force, run.friction_forces
    forces = np.column_stack([normal.sum(axis=1), friction.sum(axis=1)])
    large = np.abs(forces).max(axis=0)
    spread = np.maximum(np.ptp(forces, axis=0), _SMALL_FORCE * large)
    each = max(float(np.ptp(normal, axis=0).max(initial=0.0)), _SMALL_FORCE * float(large[0]))
    flags = np.zeros(len(run.time) - 1, dtype=bool)
    for values, scale in ((moved, sizes), (rates, rate_sizes), (forces, spread),
                          (normal, np.full(normal.shape[1], each))):
        flags |= _bent(run.time, values[:, scale > 0.0] / scale[scale > 0.0])
    # Outputs once per period look like rest; only their velocities reveal motion.
    h = np.diff(run.time)[:, None]
    used = sizes > 0.0
    gone = np.diff(moved, axis=0) - 0.5 * h * (rates[1:] + rates[:-1])
    flags |= (np.abs(gone[:, used]) > _ERROR * sizes[used]).any(axis=1)
    return np.asarray(flags)


def _bent(time: Array, values: Array) -> Flags:
    """Intervals in which values (N, k), scaled by their ranges, deviate too far from the chord."""
    flags = np.zeros(len(time) - 1, dtype=bool)
    if len(time) > 2 and values.shape[1]:
        h = np.diff(time)
        part = (h[:-1] / (h[:-1] + h[1:]))[:, None]
        middle = (1.0 - part) * values[:-2] + part * values[2:]
        # A parabola deviates from the chord of half an interval by a quarter of its deviation from
        # the chord of the whole interval.
        off = 0.25 * np.abs(values[1:-1] - middle).max(axis=1)
        flags[:-1] |= off * np.minimum(h[:-1] / h[1:], 1.0) > _ERROR
        flags[1:] |= off * np.minimum(h[1:] / h[:-1], 1.0) > _ERROR
    return flags


def _motion(run: Trajectory) -> tuple[Array, Array]:
    """Displacements and velocities (N, k) of the named points and selected contact nodes."""
    basis = run.system.basis
    n = basis.contact_nodes
    nodes = 2 + np.unique(np.linspace(0, n - 1, min(n, _NODES)).astype(int))
    points = np.concatenate([[0, 1], nodes, np.arange(2 + n, len(basis.T))])
    rows = basis.T[points, : basis.dimension].reshape(-1, basis.modes)
    return run.modal_coordinates @ rows.T, run.modal_velocities @ rows.T


def _ranges(moved: Array, rates: Array) -> tuple[Array, Array]:
    """Ranges (k,) that scale displacements and velocities."""
    ranges, speeds = np.ptp(moved, axis=0), np.ptp(rates, axis=0)
    return (np.maximum(ranges, _SMALL * ranges.max(initial=0.0)),
            np.maximum(speeds, _SMALL_RATE * speeds.max(initial=0.0)))


def _repeated(
    run: Trajectory, flags: Flags, parts: int, most: int
) -> tuple[Trajectory, Flags, int, str]:
    """Subdivide the flagged intervals; returns the refined run, the intervals that could be
    repeated, the steps taken, and the reason if some could not.
    """
    refined = np.zeros_like(flags)
    pieces: list[dict[str, Any]] = []
    steps, length, failures, first, why = 0, 16, 0, 0, ""
    t, sizes = run.time, _ranges(*_motion(run))
    while True:
        ahead = np.flatnonzero(flags[first:])
        if not len(ahead):
            break
        if steps > most:
            why = _LONG
            break
        if failures >= _FAILURES:
            break
        first += int(ahead[0])
        end = _end(flags, first, length)
        times = np.concatenate([
            *(np.linspace(t[k], t[k + 1], parts + 1)[:-1] if flags[k] else t[k : k + 1]
              for k in range(first, end)), t[end : end + 1]])
        try:
            again = _again(run, first, times)
        except _TooManyStepsError:
            why = _LONG
            break
        good = 0
        if again is not None:
            good = _agreeing(run, again, first, end, sizes)
            steps += int(again.statistics.get("steps", 0))
        if again is None or good == 0:
            why = "computed again, it does not lead from output to output"
            failures, length, first = failures + 1, max(1, length // 4), first + 1
            continue
        pieces.append(_new_rows(run, again, first, first + good))
        refined[first : first + good] = flags[first : first + good]
        length = min(2 * length, _WINDOW) if first + good == end else max(1, length // 2)
        failures, first = 0, first + good
    return _joined(run, pieces) if pieces else run, refined, steps, why


def _end(flags: Flags, first: int, length: int) -> int:
    """End of the intervals repeated in one run from a flagged one."""
    chosen = first + np.flatnonzero(flags[first : first + length])
    gaps = np.flatnonzero(np.diff(chosen) > _GAP)
    return int(chosen[gaps[0]] if len(gaps) else chosen[-1]) + 1


def _again(run: Trajectory, first: int, times: Array) -> Trajectory | None:
    """Repeat the run from an output; None if it does not reach the end.

    Raises
    ------
    _TooManyStepsError
        See :func:`_limit`.
    """
    rows = slice(first, first + 1)
    start = replace(run, time=run.time[rows], work=run.work[rows], node_friction_work=None,
                    node_creep_work=None, events=None, **_cut(run, rows, _STATE))
    used = run.statistics
    options: dict[str, Any] = {"rtol": min(float(used.get("rtol", 1e-6)), 1e-2)}
    try:
        if _set_valued(run):
            options["solver"] = solver_by_name(used["solver"], {
                entry.name: used[entry.name] for entry in fields(SetValued) if entry.name in used})
        with warnings.catch_warnings():
            # The original run has already issued these warnings.
            warnings.simplefilter("ignore")
            again = simulate(run.system, float(times[-1]), t_start=float(times[0]), initial=start,
                             outputs=times, progress=_limit(run, times), **options)
    except FecontactError:
        return None
    if again.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    # A run that ends early may have as many outputs: its last one is where it ended.
    if not np.array_equal(again.time, times) or not np.isfinite(again.states).all():
        return None
    return again


def _set_valued(run: Trajectory) -> bool:
    return isinstance(SOLVERS.get(run.statistics["solver"]), SetValued)


def _limit(run: Trajectory, times: Array) -> Callable[[float], None] | None:
    """Function of the progress that ends a repeated set-valued run that takes far too long.

    Where a node is at the border of stick and slip, steps from a state within them can become very
    short.
    """
    if not _set_valued(run):
        return None
    part = (times[-1] - times[0]) / (run.time[-1] - run.time[0])
    left = _REPORTS + _REPORTS_MORE * part * float(run.statistics.get("seconds", 0.0))

    def count(time: float) -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise _TooManyStepsError

    return count


def _agreeing(
    run: Trajectory, again: Trajectory, first: int, end: int, sizes: tuple[Array, Array]
) -> int:
    """Number of intervals over which a repeated run agrees with the outputs."""
    there = np.searchsorted(again.time, run.time[first : end + 1])
    part = replace(run, **_cut(run, slice(first, end + 1), ("time", "work", *_STATE)))
    off = np.zeros(end - first, dtype=bool)
    found = _motion(again)
    for values, others, outer, inner in zip(_motion(part), found, sizes, _ranges(*found),
                                            strict=True):
        # Outputs alone may underestimate the range of the motion.
        scale = np.maximum(outer, inner)
        off |= (np.abs(values[1:] - others[there[1:]]) > _SAME * scale).any(axis=1)
    return int(np.argmax(off)) if off.any() else end - first


def _cut(run: Trajectory, rows: slice, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(run, name)[rows] for name in names if getattr(run, name) is not None}


def _new_rows(run: Trajectory, again: Trajectory, first: int, end: int) -> dict[str, Any]:
    """Columns of a repeated run at the times strictly between two outputs."""
    kept = (again.time < run.time[end]) & ~np.isin(again.time, run.time[first:end])
    rows = {"time": again.time[kept]}
    for name in (*_STATE, *_COUNTED):
        if getattr(run, name) is not None:
            values = getattr(again, name)
            offset = getattr(run, name)[first] if name in _COUNTED else 0.0
            rows[name] = values[kept] + offset
    return rows


def _joined(run: Trajectory, pieces: list[dict[str, Any]]) -> Trajectory:
    """Insert the rows of repeated pieces into the run."""
    time = np.concatenate([run.time, *(piece["time"] for piece in pieces)])
    order = np.argsort(time, kind="stable")
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(run, name), *(piece[name] for piece in pieces)])[order]
        for name in pieces[0] if name != "time"}
    return replace(run, time=time[order], **columns)
