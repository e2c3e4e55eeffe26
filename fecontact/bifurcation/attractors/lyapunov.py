"""Lyapunov exponents: mean growth rates of small differences."""

import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real

import numpy as np

from fecontact.core.checks import as_count
from fecontact.core.errors import (
    LARGEST,
    AnalysisError,
    FecontactError,
    InputError,
    ModelWarning,
    require_positive,
)
from fecontact.core.errors import shown as text_of
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array
from fecontact.integrate import step_loop
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.field_runs.start import start_any, start_state
from fecontact.integrate.initial_state import Initial
from fecontact.integrate.simulate import require_resolved_span
from fecontact.integrate.step_runs import ENDS, finish
from fecontact.system.fields.in_time import Moving, in_time, state_size
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import forcing_period

# Intervals integrated in one call, and blocks for the error of the mean.
_INTERVALS, _BLOCKS = 256, 10
# Growth over an interval, relative to the largest, that is lost in rounding.
_LOST = 1e-13
# Change of differences over an interval, as a power of e, that leaves what shrinks resolved.
_KEPT = 10.0


@read_only_arrays
@dataclass(frozen=True, eq=False)
class LyapunovExponents:
    """Mean rates at which small differences grow along a motion.

    Attributes
    ----------
    exponents : (k,) array
        From the largest down [1/s]; above zero where the motion is chaotic.
    uncertainty : (k,) array
        Standard error of each from the means over ten parts of the run [1/s].
    history : (N, k) array
        Means up to each of the ``times`` [1/s].
    times : (N,) array
        Time from the end of the transient [s].
    state : (size,) array
        State at the end.
    """

    exponents: Array
    uncertainty: Array
    history: Array
    times: Array
    state: Array


def lyapunov_exponents(
    system: Moving,
    duration: float,
    *,
    initial: Initial | FieldRun = "rest",
    transient: float = 0.0,
    interval: float | None = None,
    count: int = 1,
    rtol: float = 1e-6,
    progress: bool | Callable[[float], None] | None = None,
) -> LyapunovExponents:
    r"""Lyapunov exponents from the derivative of the motion to its start.

    .. math::

        \lambda_i = \lim \frac{1}{t} \sum_k \ln R_{k,ii}, \qquad
        \frac{\partial y(t_{k+1})}{\partial y(t_k)} Q_k = Q_{k+1} R_{k+1}

    Parameters
    ----------
    system : ContactSystem or VectorField
        System to integrate; a field at its base values.
    duration : float
        Time over which growth is averaged [s].
    initial : 'rest', 'sliding', RigidStart, Trajectory, FieldRun or (size,) array
        Where the motion starts; a vector field needs one of the last two.
    transient : float
        Time before that [s].
    interval : float, optional
        Time between orthogonalisations [s]; default the period of the excitation, or a thousandth
        of the duration, for a vector field shorter where its rates are steep.
    count : int
        Number of exponents.
    rtol : float
        Relative tolerance of the run.
    progress : bool or callable, optional
        True for a progress bar on a terminal or in a notebook; a function is called with the time
        reached [s] now and then.

    A ModelWarning says so where the last of the exponents are lost in rounding.

    Raises
    ------
    InputError
        For values out of range.
    AnalysisError
        If the run could not reach its end, or the motion escapes beyond 1e60.

    References
    ----------
    G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9.
    """
    moving = in_time("lyapunov_exponents", system)
    size = state_size(moving)
    require_positive("lyapunov_exponents", duration=duration, rtol=rtol,
                     **({} if interval is None else {"interval": interval}))
    if not (isinstance(transient, Real) and 0.0 <= transient <= sys.float_info.max):
        raise InputError(f"transient = {text_of(transient)} must be zero or above [s].")
    if transient > 0.0:
        require_resolved_span("transient", transient, "the start", 0.0)
    require_resolved_span("the end of duration", transient + duration, "transient", transient)
    if as_count(count, "count") > size:
        raise InputError(f"count = {count} must be a whole number from 1 to {size}.")
    if interval is not None:
        _require_intervals(duration, interval, count)
    state, time = start_state(moving, initial, 0.0), float(transient)
    with (shown(progress, lambda: progress_bar("Lyapunov exponents", time + duration)) as tell,
          one_blas_thread):
        if transient > 0.0:
            run = start_any(moving, state, np.array([0.0, transient]), rtol=rtol)
            _reach_end(finish(run, tell), run.time, run.states)
            state = run.states[-1]
        if interval is None:
            interval = _usual_interval(moving, duration, state, count)
            _require_intervals(duration, interval, count)
        steps = max(round(duration / interval), 1)
        instants = time + interval * np.arange(steps + 1)
        Q = np.linalg.qr(np.random.default_rng(0).normal(size=(size, count)))[0]
        growth = np.empty((steps, count))
        for first in range(0, steps, _INTERVALS):
            piece = instants[first : first + _INTERVALS + 1]
            run = start_any(moving, state, piece, rtol=rtol, vary=True)
            _reach_end(finish(run, tell), run.time, run.states)
            state = run.states[-1]
            for k, transition in enumerate(run.transitions[1:], first):
                Q, R = np.linalg.qr(transition @ Q)
                growth[k] = np.log(np.maximum(np.abs(np.diag(R)), np.finfo(float).tiny))
    lost = growth.min(axis=1) - growth[:, 0] < np.log(_LOST)
    if lost.mean() > 0.01:
        warnings.warn(f"Directions that shrink most are lost in rounding within interval = "
                      f"{interval:g} s, and so are the last of the exponents; choose a shorter "
                      f"interval, or a smaller count.", ModelWarning, stacklevel=2)
    times = instants[1:] - time
    history = np.cumsum(growth, axis=0) / times[:, None]
    parts = np.array([part.mean(axis=0) / interval
                      for part in np.array_split(growth, min(_BLOCKS, steps))])
    error = parts.std(axis=0, ddof=1) / np.sqrt(len(parts)) if len(parts) > 1 else (
        np.full(count, np.nan))
    return LyapunovExponents(history[-1], error, history, times, state)


def _usual_interval(moving: Moving, duration: float, state: Array, count: int) -> float:
    """The period of the excitation, or a thousandth of the duration [s].

    Where several exponents of a field are wanted, not longer than its Jacobian at a state allows.
    """
    try:
        return min(forcing_period(moving), duration)
    except FecontactError:
        interval = duration / 1000.0
    if count == 1 or not isinstance(moving, VectorField):
        return interval
    sizes = np.maximum(np.abs(state), moving.state_scales(moving.values))
    J = moving.derivatives(np.zeros(1), state[np.newaxis], moving.values)[1][0]
    steep = float((np.abs(J) @ sizes / sizes).max())
    return min(interval, _KEPT / max(steep, 1e-300))


def _require_intervals(duration: float, interval: float, count: int) -> None:
    """Raise InputError unless so many intervals fit into memory."""
    # Instants, and per exponent the growth in each interval, its history and temporaries.
    require_memory("lyapunov_exponents: the number of intervals in duration",
                   duration / interval, 8.0 * (4 + 4 * count), ", by a longer interval")


def _reach_end(status: int, time: float, states: Array) -> None:
    if status != step_loop.FINISHED:
        raise AnalysisError(f"The run ended at t = {time:.9g} s before its end: "
                            f"{ENDS[status].value}")
    largest = float(np.abs(states[-1]).max())
    if not largest <= LARGEST:
        raise AnalysisError(f"The motion escapes: at t = {time:.9g} s a state is {largest:g}, and "
                            f"every one must be from {-LARGEST:g} to {LARGEST:g}; choose a start "
                            f"whose motion stays bounded, or a shorter duration.")
