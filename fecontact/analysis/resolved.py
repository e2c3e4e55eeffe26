"""Runs with what they have kept between their outputs, so that curves and peaks are resolved.

Sparse outputs may miss an impact or distort a closed curve.
"""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory

Flags = NDArray[np.bool_]

# Distance of a curve from its chords, relative to its range, beyond which rows are added, and
# beyond which a picture says so.
_ERROR, _TOLD_ERROR = 1.0 / 400.0, 1.0 / 50.0
# Ranges of displacements and velocities below these fractions of the largest one are noise, as are
# changes of forces below this fraction of the largest.
_SMALL, _SMALL_RATE, _SMALL_FORCE = 1e-5, 1e-4, 1e-6
_ROUNDING = 1e-11  # of the largest displacement, below which all motion of a run is rounding
_TOLD = 2e-3  # fraction of the time
_NODES = 8  # contact nodes monitored besides the named points


class Resolved(NamedTuple):
    """Result of :func:`resolved`.

    trajectory : the run with additional times, or the run itself
    coarse : fraction of the time in which chords between its times may cut off peaks
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
    """Add kept steps of a run wherever outputs are too far apart for straight lines between them.

    They are too far apart where chords deviate by more than 1/400 of the range from displacements
    and velocities of the named points, or from normal and friction forces. Existing outputs do not
    change. Friction work of the nodes is interpolated between them.

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
    flags, kept = _coarse(run, _ERROR), run.kept
    reason = "this run has kept nothing between them; give it more outputs"
    if flags.any() and kept is not None:
        between = np.searchsorted(run.time, kept.time) - 1
        rows = flags[np.clip(between, 0, len(flags) - 1)]
        if rows.any():
            run = run.joined(kept if rows.all() else kept.part(rows))
        reason = "it was too long to keep more between them; give it more outputs"
    if flags.any():
        flags = _coarse(run, _TOLD_ERROR)
    lost = float(np.diff(run.time)[flags].sum())
    return Resolved(run, min(1.0, lost / float(run.time[-1] - run.time[0])), reason)


def _coarse(run: Trajectory, error: float) -> Flags:
    """Flags (N - 1,) of the intervals in which straight lines have a larger error."""
    moved, rates = _motion(run)
    sizes, rate_sizes = _ranges(moved, rates, float(np.diff(run.time).max()))
    normal, friction = run.normal_force, run.friction_forces
    forces = np.vstack([normal.sum(axis=1), friction.sum(axis=1).T])
    large = np.abs(forces).max(axis=1)
    spread = np.maximum(np.ptp(forces, axis=1), _SMALL_FORCE * large)
    each_node = np.ascontiguousarray(normal.T)
    each = max(float(np.ptp(each_node, axis=1).max(initial=0.0)), _SMALL_FORCE * float(large[0]))
    flags = np.zeros(len(run.time) - 1, dtype=bool)
    for values, scale in ((moved, sizes), (rates, rate_sizes), (forces, spread),
                          (each_node, np.full(len(each_node), each))):
        flags |= _bent(run.time, values[scale > 0.0] / scale[scale > 0.0, None], error)
    # Outputs once per period look like rest; only their velocities reveal motion.
    h = np.diff(run.time)
    used = sizes > 0.0
    gone = np.diff(moved, axis=1) - 0.5 * h * (rates[:, 1:] + rates[:, :-1])
    flags |= (np.abs(gone[used]) > error * sizes[used, None]).any(axis=0)
    return np.asarray(flags)


def _bent(time: Array, values: Array, error: float) -> Flags:
    """Intervals in which values (k, N), scaled by their ranges, deviate too far from the chord.

    The curvature of an interval is the smaller of those at its ends: that at one end may be of a
    jump in the interval next to it.
    """
    flags = np.zeros(len(time) - 1, dtype=bool)
    if len(time) < 3 or not len(values):
        return flags
    h = np.diff(time)
    part = h[:-1] / (h[:-1] + h[1:])
    middle = (1.0 - part) * values[:, :-2] + part * values[:, 2:]
    # A parabola deviates from the chord of half an interval by a quarter of its deviation from
    # the chord of the whole interval.
    off = 0.25 * np.abs(values[:, 1:-1] - middle)
    at_end = off * np.minimum(h[:-1] / h[1:], 1.0) > error
    at_begin = off * np.minimum(h[1:] / h[:-1], 1.0) > error
    flags[0], flags[-1] = at_end[:, 0].any(), at_begin[:, -1].any()
    flags[1:-1] = (at_end[:, 1:] & at_begin[:, :-1]).any(axis=0)
    return flags


def _motion(run: Trajectory) -> tuple[Array, Array]:
    """Displacements and velocities (k, N) of the named points and selected contact nodes."""
    basis = run.basis
    n = basis.contact_nodes
    nodes = 2 + np.unique(np.linspace(0, n - 1, min(n, _NODES)).astype(int))
    points = np.concatenate([[0, 1], nodes, np.arange(2 + n, len(basis.T))])
    rows = basis.T[points, : basis.dimension].reshape(-1, basis.modes)
    # Ranges and curvatures over time are faster along rows.
    moved, rates = run.modal_coordinates @ rows.T, run.modal_velocities @ rows.T
    return np.ascontiguousarray(moved.T), np.ascontiguousarray(rates.T)


def _ranges(moved: Array, rates: Array, spacing: float) -> tuple[Array, Array]:
    """Ranges (k,) that scale displacements and velocities; infinite for a run at rest.

    At rest, displacements change by rounding only, also by the velocities over the ``spacing`` of
    outputs.
    """
    ranges, speeds = np.ptp(moved, axis=1), np.ptp(rates, axis=1)
    change = max(ranges.max(initial=0.0), spacing * np.abs(rates).max(initial=0.0))
    if change <= _ROUNDING * np.abs(moved).max(initial=0.0):
        return np.full_like(ranges, np.inf), np.full_like(speeds, np.inf)
    return (np.maximum(ranges, _SMALL * ranges.max(initial=0.0)),
            np.maximum(speeds, _SMALL_RATE * speeds.max(initial=0.0)))
