"""Periodicity: Poincare sections, the returns after which a motion repeats, and steady motion."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Literal

import numpy as np

from fecontact.analysis.histories import Point, usual_point
from fecontact.analysis.resolved import resolved
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.trajectory import Trajectory

if TYPE_CHECKING:
    from fecontact.system.contact_system import ContactSystem

_LEAST_CHECKS = 8  # returns that must agree before a motion is called periodic
_SLOW = 0.05  # of the range of the velocity: slower reversals are no maxima of the motion

_FEWEST = 32  # output times of a run that can be called steady
_MOST_GRID, _MOST_CHECKS = 2**15, 2000  # times of the search for a lag, and of its check
_TRIED, _MOST_LINES = 8, 33  # candidates of a lag, and multiples of the period of a spectral line


def drive_period(system: "ContactSystem") -> float:
    """Period of the drive at B [s]; InputError if it has none."""
    frequency = system.drive.fundamental_hz
    if not frequency > 0.0:
        raise InputError("The drive of the system does not repeat, so it has no period; give the "
                         "period.")
    return 1.0 / frequency


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Strobe:
    """States of a motion on a Poincare section: once per period, or at maxima of a displacement.

    Attributes
    ----------
    time : (k,) array
        [s].
    states : (k, 2 m + n s) array
        y = [q, q', z].
    period : float
        [s]; for maxima their mean distance.
    maxima_of : (point, component) or None
        The displacement whose maxima these are; None for states once per period.
    """

    time: Array
    states: Array
    period: float
    maxima_of: tuple[Point, str] | None = None


@dataclass(frozen=True)
class Periodicity:
    """Result of :func:`count_periods`.

    Attributes
    ----------
    periods : int or None
        Number of drive periods, without a drive of maxima of the motion, after which it repeats;
        None if it does not.
    misfit : float
        Largest difference between points ``periods`` periods apart (the best number tried if the
        motion does not repeat), relative to the size of the attractor.
    settled : bool
        False if the motion still approaches or leaves an orbit of fewer periods; ``periods`` is
        then None, and a longer run is needed.
    period : float or None
        Time after which the motion repeats [s]; None if it does not.
    """

    periods: int | None
    misfit: float
    settled: bool = True
    period: float | None = None


@dataclass(frozen=True)
class Steadiness:
    """Result of :func:`steadiness`.

    Attributes
    ----------
    kind : 'at rest', 'periodic', 'not steady' or 'unknown'
        'unknown' if the run has too few output times to decide.
    period : float or None
        Period of a periodic motion [s].
    misfit : float
        Largest difference to the motion one lag earlier, relative to the largest deviation from the
        mean; the lag is the best between an eighth and a quarter of the run. Zero at rest.
    """

    kind: Literal["at rest", "periodic", "not steady", "unknown"]
    period: float | None = None
    misfit: float = 0.0

    @property
    def steady(self) -> bool:
        """True for motion at rest and periodic motion."""
        return self.kind in ("at rest", "periodic")


def strobed_states(
    trajectory: Trajectory,
    *,
    period: float | None = None,
    phase: float = 0.0,
    t_start: float | None = None,
) -> Strobe:
    """States of a run once per period, at the times ``(k + phase) period``.

    Without a drive and a period, as for self-excited motion, at the maxima of a displacement; see
    :func:`section_states`.

    Where outputs are too far apart, what the run has kept between them is used too. States are
    interpolated by cubic Hermite polynomials; those at output times are returned unchanged.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    period : float, optional
        Period [s]; that of the drive by default.
    phase : float
        Phase as a fraction of the period, 0 to 1, counted from t = 0.
    t_start : float, optional
        Start of the evaluation, after the transient [s]; the middle of the run by default.

    Raises
    ------
    InputError
        For values out of range, or if the run ends before ``t_start``.
    """
    require_kind("strobed_states", Trajectory, trajectory=trajectory)
    t = trajectory.time
    if period is None and not trajectory.system.drive.fundamental_hz > 0.0:
        return section_states(trajectory, t_start=t_start)
    if period is None:
        period = drive_period(trajectory.system)
    require_positive("strobed_states", period=period)
    if not (isinstance(phase, Real) and 0.0 <= phase <= 1.0):
        raise InputError(f"strobed_states: phase = {phase!r} must be from 0 to 1.")
    begin = _start(trajectory, t_start)
    tiny = 1e-9 * period
    first = int(np.ceil((begin - tiny) / period - phase))
    last = int(np.floor((t[-1] + tiny) / period - phase))
    if last < first:
        raise InputError(f"The run ends at {t[-1]:g} s, before a period of {period:g} s is over "
                         f"after {begin:g} s; run it for longer.")
    times = np.clip((np.arange(first, last + 1) + phase) * period, t[0], t[-1])
    nearest = np.minimum(np.searchsorted(t, times), len(t) - 1)
    apart = np.minimum(np.abs(t[nearest] - times), np.abs(t[np.maximum(nearest - 1, 0)] - times))
    run = trajectory if (apart <= tiny).all() else resolved(trajectory).trajectory
    return Strobe(times, _states_at(run, times, tiny), period)


def section_states(
    trajectory: Trajectory, point: Point | None = None, component: str = "x", *,
    t_start: float | None = None,
) -> Strobe:
    """States of a run at the maxima of a displacement: its velocity falls through zero.

    A Poincare section of self-excited motion, which has no period of its own to be strobed with.
    The velocity must exceed a twentieth of its range between two maxima, so that creep in stick is
    none. Where outputs are too far apart, what the run has kept between them is used too.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    point, component
        See :meth:`Trajectory.displacement`; by default the component with the fastest motion of
        B and the contact nodes.
    t_start : float, optional
        Start of the evaluation, after the transient [s]; the middle of the run by default.

    Raises
    ------
    InputError
        For a point or component that does not exist, a time out of range, or a motion with fewer
        than two maxima.
    """
    require_kind("section_states", Trajectory, trajectory=trajectory)
    begin = _start(trajectory, t_start)
    basis, m = trajectory.basis, trajectory.basis.modes
    if point is None:
        points: list[str | int] = [usual_point(basis), *range(basis.contact_nodes)]
        axes = basis.components[: basis.dimension]
        rates = trajectory.modal_velocities[trajectory.time >= begin]
        ranges = {(one, axis): float(np.ptp(rates.dot(basis.point_row(one, axis))))
                  for one in points for axis in axes}
        point, component = max(ranges, key=lambda key: ranges[key])
    run = resolved(trajectory).trajectory
    t, states = run.time, run.states
    row = trajectory._rows(point)[basis.components.index(component)]
    v = states[:, m : 2 * m] @ row
    late = t >= begin
    least = _SLOW * float(np.ptp(v[late]))
    crossing, risen = [], False
    for k in np.flatnonzero(late[:-1]).tolist():
        risen = risen or v[k] > least
        if risen and v[k] > 0.0 >= v[k + 1]:
            crossing.append(k)
            risen = False
    if len(crossing) < 2:
        raise InputError(f"The displacement {component} of {point} has {len(crossing)} maxima "
                         f"after {begin:g} s, too few for a section; run it for longer, choose "
                         f"another point, or give a period.")
    times = np.array([_crossing(run, k, row) for k in crossing])
    return Strobe(times, _states_at(run, times, 0.0), float(np.diff(times).mean()),
                  (point, component))


def _crossing(run: Trajectory, k: int, row: Array) -> float:
    """Time within interval k at which a velocity, interpolated in cubics, falls through zero."""
    m = run.basis.modes
    t0, t1 = float(run.time[k]), float(run.time[k + 1])
    low, high = t0, t1
    for _ in range(40):
        middle = 0.5 * (low + high)
        velocity = float(_states_at(run, np.array([middle]), 0.0)[0, m : 2 * m] @ row)
        low, high = (middle, high) if velocity > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _states_at(run: Trajectory, times: Array, tiny: float) -> Array:
    """States (k, 2 m + n s) of a run, cubic between outputs, unchanged within ``tiny`` of one."""
    t, states = run.time, run.states
    interval = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    points = np.empty((len(times), states.shape[1]))
    for k, i in enumerate(interval):
        h = t[i + 1] - t[i]
        s = (times[k] - t[i]) / h
        if min(s, 1.0 - s) * h <= tiny:
            points[k] = states[i if s < 0.5 else i + 1]
            continue
        y0, y1 = states[i], states[i + 1]
        r0, r1 = h * run.system.rhs(t[i], y0), h * run.system.rhs(t[i + 1], y1)
        rise = y1 - y0
        points[k] = y0 + s * (r0 + s * ((3.0 * rise - 2.0 * r0 - r1)
                                        + s * (r0 + r1 - 2.0 * rise)))
    return points


def count_periods(
    points: ArrayLike, scale: ArrayLike, *, largest: int = 16, tolerance: float = 2e-3
) -> Periodicity:
    """Number of steps after which a sequence of points repeats.

    This is the smallest k for which ``|x_(i+k) - x_i| <= tolerance scale`` holds in every
    component for the last returns, at least 8 and at least 2 k of them. If the difference at a
    divisor of k still shrinks or grows from return to return, the sequence has not settled: it
    slowly approaches or leaves an orbit of fewer steps.

    Parameters
    ----------
    points : (N, d) array
        States once per period after the transient; or (N,) of one quantity.
    scale : float or (d,) array
        Size of the attractor in each component. Take it from the whole motion: the strobed points
        of a period-one motion coincide.
    largest : int
        Largest number of periods tried; ``2 largest + largest`` points are needed.
    tolerance : float
        Tolerance relative to the scale.

    Raises
    ------
    InputError
        For too few points, points that are not finite, or values out of range.
    """
    x = np.asarray(points, dtype=float)
    x = x[:, None] if x.ndim == 1 else x
    size = np.broadcast_to(np.asarray(scale, dtype=float), x.shape[-1:])
    require_positive("count_periods", tolerance=tolerance)
    if isinstance(largest, bool) or not isinstance(largest, Integral) or largest < 1:
        raise InputError(f"count_periods: largest = {largest!r} must be a whole number above zero.")
    if x.ndim != 2 or not np.isfinite(x).all() or not (size > 0.0).all():
        raise InputError("count_periods: points must be finite, of shape (N,) or (N, d), and "
                         "scale above zero.")
    needed = largest + max(2 * largest, _LEAST_CHECKS)
    if len(x) < needed:
        raise InputError(f"count_periods: {len(x)} points cannot show {largest} periods; "
                         f"{needed} are needed.")
    misfits = np.array([_returns(x / size, k).max() for k in range(1, largest + 1)])
    fitting = np.flatnonzero(misfits <= tolerance)
    if not len(fitting):
        return Periodicity(None, float(misfits.min()))
    periods = int(fitting[0]) + 1
    misfit = float(misfits[periods - 1])
    for divisor in range(1, periods + 1):
        if periods % divisor == 0 and _drifts(x / size, divisor, periods, misfit, tolerance):
            return Periodicity(None, misfit, settled=False)
    return Periodicity(periods, misfit)


def periodicity(
    trajectory: Trajectory,
    *,
    period: float | None = None,
    t_start: float | None = None,
    largest: int = 16,
    tolerance: float = 2e-3,
) -> Periodicity:
    """Number of drive periods after which a run repeats, or None.

    Without a drive and a period, the number of maxima of its fastest displacement; see
    :func:`section_states`.

    Compares displacements and velocities of B and the contact nodes once per period. The
    tolerance of each is relative to its range in the run after ``t_start``.

    Parameters
    ----------
    trajectory : Trajectory
        A run over at least ``3 largest`` periods after ``t_start``, with at least eight outputs
        per period to measure the size of the attractor.
    period, t_start
        See :func:`strobed_states`.
    largest, tolerance
        See :func:`count_periods`.

    Raises
    ------
    InputError
        As in :func:`strobed_states` and :func:`count_periods`, and for too few outputs per period.
    """
    require_kind("periodicity", Trajectory, trajectory=trajectory)
    basis = trajectory.basis
    found = strobed_states(trajectory, period=period, t_start=t_start)
    late = trajectory.time >= _start(trajectory, t_start)
    if np.count_nonzero(late) < 8 * (len(found.time) - 1):
        raise InputError(f"The run has {np.count_nonzero(late)} outputs in {len(found.time) - 1} "
                         f"periods, too few to show the size of the motion; give it at least "
                         f"eight per period.")
    m = basis.modes
    points = [0, *range(2, 2 + basis.contact_nodes)]
    rows = basis.T[points, : basis.dimension].reshape(-1, m)

    def observed(states: Array) -> Array:
        return np.hstack([states[:, :m] @ rows.T, states[:, m : 2 * m] @ rows.T])

    size = np.ptp(observed(trajectory.states[late]), axis=0)
    # Ignore quantities that do not move, or by less than a billionth of the others.
    halves = np.split(size, 2)
    moves = np.concatenate([half > 1e-9 * half.max(initial=0.0) for half in halves])
    if not moves.any():
        return Periodicity(1, 0.0, period=found.period)
    counted = count_periods(observed(found.states)[:, moves], size[moves], largest=largest,
                            tolerance=tolerance)
    time = None if counted.periods is None else counted.periods * found.period
    return replace(counted, period=time)


def steadiness(trajectory: Trajectory, *, tolerance: float = 1e-2) -> Steadiness:
    """Determine whether a run has become steady: at rest, periodic, or neither.

    The displacements x of B and the contact nodes are observed in the last quarter of the run.

    - *At rest*: x deviates from its mean there by at most 1e-3 of the largest deviation from it
      in the whole run, or by at most 1e-9 of the largest displacement.
    - *Periodic*: a lag L between an eighth and a quarter of the run exists for which
      ``|x(t) - x(t - L)| <= tolerance max |x - mean|`` holds at all times t of the last quarter.
      The period is the shortest lag L/k that meets the tolerance, too.

    Motion that still grows or decays by more than the tolerance within a quarter of the run,
    quasi-periodic and chaotic motion are not steady. Drives of any period are treated alike.

    Parameters
    ----------
    trajectory : Trajectory
        The run. At least 32 output times and about five for each period are needed.
    tolerance : float
        Tolerance relative to the size of the motion.

    Raises
    ------
    InputError
        For a tolerance that is not positive.
    """
    require_kind("steadiness", Trajectory, trajectory=trajectory)
    require_positive("steadiness", tolerance=tolerance)
    t = trajectory.time
    if len(t) < _FEWEST or not np.isfinite(trajectory.states).all():
        return Steadiness("unknown")
    x, v = _observed_motion(trajectory)
    end, length = float(t[-1]), float(t[-1] - t[0])
    late = t >= end - 0.25 * length
    mean = x[late].mean(axis=0)
    away = np.linalg.norm(x - mean, axis=1)
    size = float(away[late].max())
    if size <= max(1e-3 * float(away.max()), 1e-9 * float(np.linalg.norm(x, axis=1).max())):
        return Steadiness("at rest")
    count = min(len(t), _MOST_GRID)
    even = np.linspace(float(t[0]), end, count)
    step = float(even[1] - even[0])
    grid = _hermite(t, x, v, even)
    # Displacements between outputs are interpolated; every second one must do for that.
    rough = _hermite(t[::2], x[::2], v[::2], t[late][:-1]) - x[late][:-1]
    if float(np.linalg.norm(rough, axis=1).max()) > 16.0 * tolerance * size:
        return Steadiness("unknown")
    window = count // 4
    times = np.linspace(end - 0.25 * length, end, min(window, _MOST_CHECKS))
    now = _hermite(t, x, v, times)

    def misfit(lag: float) -> float:
        return float(np.linalg.norm(now - _hermite(t, x, v, times - lag), axis=1).max()) / size

    lags = np.arange(count // 8, window + 1)
    distance = _lagged_distance(grid, window)[lags]
    best, found = np.inf, 0.0
    for place in _lowest(distance):
        lag, value = _refined(misfit, step * lags[place], step, 0.3 * length)
        if value < best:
            best, found = value, lag
    if best > tolerance:
        return Steadiness("not steady", misfit=best)
    # Multiples of the period of the largest spectral line, which may be a harmonic.
    power = (np.abs(np.fft.rfft(grid[-2 * window :] - mean, axis=0)) ** 2).sum(axis=1)
    line = max(int(np.argmax(power[1:])) + 1, 1) / (2 * window * step)
    period = found
    for multiple in range(1, _MOST_LINES):
        parts = round(found * line / multiple)
        if parts < 1:
            break
        if misfit(found / parts) <= max(tolerance, 1.5 * best):
            period = found / parts
            break
    return Steadiness("periodic", period, best)


def _observed_motion(trajectory: Trajectory) -> tuple[Array, Array]:
    """Displacements and velocities (N, m) with the norm of those of B and the contact nodes."""
    basis, m = trajectory.basis, trajectory.basis.modes
    points = [0, *range(2, 2 + basis.contact_nodes)]
    rows = basis.T[points, : basis.dimension].reshape(-1, m)
    if not rows.any():
        rows = np.eye(m)
    square, ways = np.linalg.eigh(rows.T @ rows)
    kept = square > 1e-14 * square[-1]
    root = ways[:, kept] * np.sqrt(square[kept])
    return trajectory.modal_coordinates @ root, trajectory.modal_velocities @ root


def _hermite(t: Array, x: Array, v: Array, at: Array) -> Array:
    """Cubic Hermite interpolation (k, m) of motion x (N, m) with velocities v."""
    place = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    h = (t[place + 1] - t[place])[:, None]
    s = (at - t[place])[:, None] / h
    x0, x1, r0, r1 = x[place], x[place + 1], h * v[place], h * v[place + 1]
    rise = x1 - x0
    return np.asarray(x0 + s * (r0 + s * ((3.0 * rise - 2.0 * r0 - r1)
                                          + s * (r0 + r1 - 2.0 * rise))))


def _lagged_distance(grid: Array, window: int) -> Array:
    """Sums of ``|x(t) - x(t - lag)|^2`` over the last ``window`` times, by the lag in steps."""
    size = len(grid)
    centred = grid - grid[-window:].mean(axis=0)
    last = np.zeros_like(centred)
    last[-window:] = centred[-window:]
    padded = 2 * size
    product = (np.fft.rfft(last, padded, axis=0)
               * np.fft.rfft(centred, padded, axis=0).conj()).sum(axis=1)
    together = np.fft.irfft(product, padded)[:size]
    square = np.concatenate([[0.0], np.cumsum((centred**2).sum(axis=1))])
    lags = np.arange(size - window)
    earlier = square[size - lags] - square[size - window - lags]
    return np.asarray(earlier[0] + earlier - 2.0 * together[lags])


def _lowest(distance: Array) -> list[int]:
    """Places of the lowest local minima."""
    inner = np.concatenate([[np.inf], distance, [np.inf]])
    minima = np.flatnonzero((inner[1:-1] <= inner[:-2]) & (inner[1:-1] <= inner[2:]))
    return [int(place) for place in minima[np.argsort(distance[minima], kind="stable")][:_TRIED]]


def _refined(
    misfit: Callable[[float], float], lag: float, step: float, most: float
) -> tuple[float, float]:
    """Lag of the smallest misfit within a step of a lag, and that misfit."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(misfit, bounds=(max(lag - step, step), min(lag + step, most)),
                            method="bounded", options={"xatol": 1e-4 * step})
    return float(found.x), float(found.fun)


def _start(trajectory: Trajectory, t_start: float | None) -> float:
    t = trajectory.time
    if t_start is None:
        return 0.5 * float(t[0] + t[-1])
    if not (isinstance(t_start, Real) and t[0] <= t_start < t[-1]):
        raise InputError(f"t_start = {t_start!r} must be a time of the run, from {t[0]:g} s to "
                         f"below {t[-1]:g} s.")
    return float(t_start)


def _returns(x: Array, k: int) -> Array:
    """Largest component of the differences of the last points k apart."""
    checks = max(2 * k, _LEAST_CHECKS)
    return np.asarray(np.abs(x[-checks:] - x[-checks - k : -k]).max(axis=1))


def _drifts(x: Array, divisor: int, periods: int, misfit: float, tolerance: float) -> bool:
    """Whether the differences of points ``divisor`` apart shrink or grow steadily.

    Differences below a twentieth of the tolerance are ignored: they are integration errors,
    amplified by orbits close to grazing.
    """
    window = max(2 * max(2 * periods, _LEAST_CHECKS), len(x) // 2)
    distance = np.abs(x[divisor:] - x[:-divisor]).max(axis=1)[-window:]
    half = len(distance) // 2
    early, late = (float(distance[part].max()) for part in (slice(None, half), slice(half, None)))
    if max(early, late) < 0.05 * tolerance:
        return False
    if divisor == periods:
        # Below the tolerance only growth counts: the motion leaves the orbit it is close to.
        return late > 2.0 * early
    # For an orbit of more periods they vary by no more than the misfit of the orbit.
    return abs(late - early) > 0.02 * max(early, late) + 2.0 * misfit
