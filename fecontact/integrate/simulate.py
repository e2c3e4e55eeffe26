"""Running a contact system in time."""

from collections.abc import Callable
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.errors import InputError, choices, nearest
from fecontact.integrate.initial import Initial, initial_state
from fecontact.integrate.scipy_solvers import METHODS, integrate
from fecontact.integrate.trajectory import Trajectory
from fecontact.system import ContactSystem


def simulate(
    system: ContactSystem,
    t_end: float,
    *,
    t_start: float | None = None,
    initial: Initial = "rest",
    outputs: int | ArrayLike = 1001,
    method: str = "Radau",
    rtol: float = 1e-6,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Integrate a contact system in time.

    Parameters
    ----------
    system : ContactSystem
        What moves.
    t_end : float
        End of the run [s].
    t_start : float, optional
        Its start [s]; default the end of the run that it continues, else zero.
    initial : 'rest', 'sliding', RigidStart, Trajectory or (2 m + n s,) array
        Where it starts; see :func:`fecontact.integrate.initial.initial_state`.
    outputs : int or (N,) array
        Number of equally spaced output times, both ends included, or the times themselves,
        ascending, the first ``t_start``, the last ``t_end``.
    method : 'Radau', 'BDF' or 'LSODA'
        Stiff solver of scipy.
    rtol : float
        Relative tolerance; absolute ones follow from it, the roughness height and the width of
        the friction smoothing.
    progress : callable, optional
        Called with the time reached [s] after every step.

    Returns
    -------
    Trajectory
        Also of a run that ended early: by Ctrl-C, or because the solver could not go on; its
        ``status`` says which.

    Raises
    ------
    InputError
        For values out of range.
    AnalysisError
        If there is no equilibrium to start from.
    """
    if t_start is None:
        t_start = float(initial.time[-1]) if isinstance(initial, Trajectory) else 0.0
    times = _output_times(t_start, t_end, outputs)
    if not (isinstance(rtol, Real) and 1e-13 <= rtol <= 1e-2):
        raise InputError(f"rtol = {rtol!r} must be a number from 1e-13 to 0.01.")
    if method not in METHODS:
        raise InputError(f"method = {method!r} must be one of {choices(METHODS)}"
                         f"{nearest(str(method), METHODS)}.")
    state = initial_state(system, initial, t_start)
    reached, states, work, status, statistics = integrate(
        system, state, times, method=method, rtol=rtol, progress=progress)
    m = system.basis.modes
    return Trajectory(system, reached, states[:, :m], states[:, m : 2 * m], work, status,
                      statistics, memory=states[:, 2 * m :] if system.memory else None)


def _output_times(t_start: float, t_end: float, outputs: Any) -> NDArray[np.float64]:
    if not (isinstance(t_start, Real) and isinstance(t_end, Real)
            and -np.inf < t_start < t_end < np.inf):
        raise InputError(f"t_end = {t_end!r} must be a finite time after t_start = {t_start!r}.")
    if isinstance(outputs, int | np.integer) and not isinstance(outputs, bool):
        if outputs < 2:
            raise InputError(f"outputs = {outputs} must be at least 2.")
        return np.linspace(t_start, t_end, int(outputs))
    try:
        times = np.array(outputs, dtype=float)
    except (TypeError, ValueError):
        times = np.zeros(0)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0.0).all() or (
            times[0] != t_start or times[-1] != t_end):
        raise InputError("outputs must be a number of times, or ascending times from t_start to "
                         "t_end.")
    return times
