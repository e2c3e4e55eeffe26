"""Lyapunov exponents: mean growth rates of small differences."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError, require_positive
from fecontact.core.progress import progress_bar, shown
from fecontact.core.types import Array
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.rodas5p import step_loop
from fecontact.integrate.rodas5p.driver import ENDS, finish, start
from fecontact.system.contact_system import ContactSystem
from fecontact.system.forcing_period import forcing_period

# Intervals integrated in one call, and blocks for the error of the mean.
_INTERVALS, _BLOCKS = 256, 10


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
    system: ContactSystem,
    duration: float,
    *,
    initial: Initial = "rest",
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
    system : ContactSystem
        What moves.
    duration : float
        Time over which growth is averaged [s].
    initial : 'rest', 'sliding', RigidStart, Trajectory or (size,) array
        Where the motion starts.
    transient : float
        Time before that [s].
    interval : float, optional
        Time between orthogonalisations [s]; default the period of the excitation, or a thousandth
        of the duration.
    count : int
        Number of exponents.
    rtol : float
        Relative tolerance of the run.
    progress : bool or callable, optional
        True for a progress bar on a terminal or in a notebook; a function is called with the time
        reached [s] now and then.

    Raises
    ------
    InputError
        For values out of range.
    AnalysisError
        If the run could not reach its end.

    References
    ----------
    G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9.
    """
    require_kind("lyapunov_exponents", ContactSystem, system=system)
    require_positive("lyapunov_exponents", duration=duration, rtol=rtol,
                     **({} if interval is None else {"interval": interval}))
    if not (isinstance(transient, Real) and 0.0 <= transient < np.inf):
        raise InputError(f"transient = {transient!r} must be zero or above [s].")
    if not (isinstance(count, Integral) and 1 <= count <= system.size):
        raise InputError(f"count = {count!r} must be a whole number from 1 to {system.size}.")
    if interval is None:
        try:
            interval = min(forcing_period(system), duration)
        except FecontactError:
            interval = duration / 1000.0
    state, time = initial_state(system, initial, 0.0), float(transient)
    steps = max(round(duration / interval), 1)
    instants = time + interval * np.arange(steps + 1)
    Q = np.linalg.qr(np.random.default_rng(0).normal(size=(system.size, count)))[0]
    growth = np.empty((steps, count))
    with shown(progress, lambda: progress_bar("Lyapunov exponents", instants[-1])) as tell:
        if transient > 0.0:
            run = start(system, state, np.array([0.0, transient]), rtol=rtol, work=False)
            _reach_end(finish(run, tell), run.time)
            state = run.states[-1]
        for first in range(0, steps, _INTERVALS):
            piece = instants[first : first + _INTERVALS + 1]
            run = start(system, state, piece, rtol=rtol, work=False, vary=True)
            _reach_end(finish(run, tell), run.time)
            state = run.states[-1]
            for k, columns in enumerate(run.variation.transitions[1:], first):
                Q, R = np.linalg.qr(columns.T @ Q)
                growth[k] = np.log(np.maximum(np.abs(np.diag(R)), np.finfo(float).tiny))
    times = instants[1:] - time
    history = np.cumsum(growth, axis=0) / times[:, None]
    parts = np.array([part.mean(axis=0) / interval
                      for part in np.array_split(growth, min(_BLOCKS, steps))])
    error = parts.std(axis=0, ddof=1) / np.sqrt(len(parts)) if len(parts) > 1 else (
        np.full(count, np.nan))
    return LyapunovExponents(history[-1], error, history, times, state)


def _reach_end(status: int, time: float) -> None:
    if status != step_loop.FINISHED:
        raise AnalysisError(f"The run ended at t = {time:.9g} s before its end: "
                            f"{ENDS[status].value}")
