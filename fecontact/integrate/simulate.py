"""Running a contact system in time."""

import warnings
from collections.abc import Callable, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.contact_energy import POWERS
from fecontact.contact_kernels import PENETRATION
from fecontact.errors import InputError, choices, nearest
from fecontact.integrate.events import Watched, as_watched
from fecontact.integrate.initial import Initial, initial_state
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.system import ContactSystem

Array = NDArray[np.float64]

# Starts deeper than so many penetration scales are warned of.
_DEEP = 100.0
# Growth of energy without a source, relative to the largest energy, that is an error, and the
# output times that are looked at for it.
_GROWTH, _LOOKS = 1e-2, 200

METHODS = ("Rodas5P", "Radau", "BDF", "LSODA", "CVODE", "set-valued")


def simulate(
    system: ContactSystem,
    t_end: float,
    *,
    t_start: float | None = None,
    initial: Initial = "rest",
    outputs: int | ArrayLike = 1001,
    method: str = "Rodas5P",
    rtol: float = 1e-6,
    max_step: float | None = None,
    restitution: float | None = None,
    static_coefficient: float | Sequence[float] | None = None,
    scheme: str | None = None,
    checkpoint: str | Path | None = None,
    events: Watched | Sequence[Watched] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    r"""Integrate a contact system in time.

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
    method : 'Rodas5P', 'Radau', 'BDF', 'LSODA', 'CVODE' or 'set-valued'
        The compiled integrator; a stiff solver of scipy, or of scikit-sundae if that is
        installed, as a reference; or friction without smoothing, sticking by constraint.
    rtol : float
        Relative tolerance; absolute ones follow from it, the penetration scale of the normal law
        and the width of the friction smoothing.
    max_step : float, optional
        Longest step [s]; by default, and at most, a part of the shortest period of drive, loads
        and waves. Touches and slips within a step are found without it by 'Rodas5P'.
    restitution : float, optional
        For 'set-valued' alone: rigid stops with Newton's coefficient of restitution, from 0 to
        below 1, in place of the normal law.
    static_coefficient : float or (n,) sequence, optional
        For 'set-valued' alone: limit of \|R\|/F in stick [-]; default that of the law.
    scheme : 'auto', 'events' or 'stepping', optional
        For 'set-valued' alone: from event to event, for few nodes, or by implicit steps.
    checkpoint : path, optional
        For 'Rodas5P': a file that keeps a long run every minute and when it is interrupted. If it
        is there, the run goes on from it, to the same numbers; at the end it is removed.
    events : ContactEvents, Crossing, Event or sequence of them, optional
        For 'Rodas5P': what to watch for, located within the steps and kept in
        :attr:`Trajectory.events`; the run ends at those that say so.
    progress : callable, optional
        Called with the time reached [s] now and then.

    Returns
    -------
    Trajectory
        Also of a run that ended early: by Ctrl-C, or because the solver could not go on; its
        ``status`` says which.

    Raises
    ------
    InputError
        For values out of range, and a checkpoint of another run.
    AnalysisError
        If there is no equilibrium to start from.
    """
    if not isinstance(system, ContactSystem):
        raise InputError(f"simulate needs a ContactSystem, not {type(system).__name__}.")
    if t_start is None:
        t_start = float(initial.time[-1]) if isinstance(initial, Trajectory) else 0.0
    times = output_times(t_start, t_end, outputs)
    if not (isinstance(rtol, Real) and 1e-13 <= rtol <= 1e-2):
        raise InputError(f"rtol = {rtol!r} must be a number from 1e-13 to 0.01.")
    require_max_step(max_step)
    if method not in METHODS:
        raise InputError(f"method = {method!r} must be one of {choices(METHODS)}"
                         f"{nearest(str(method), METHODS)}.")
    for name, value in (("restitution", restitution), ("scheme", scheme),
                        ("static_coefficient", static_coefficient)):
        if value is not None and method != "set-valued":
            raise InputError(f"{name} = {value!r} is for method = 'set-valued' alone, not "
                             f"'{method}'; laws have damping and coefficients of their own.")
    if checkpoint is not None and method != "Rodas5P":
        raise InputError(f"A checkpoint is for method = 'Rodas5P' alone, not '{method}'.")
    if events is not None and method != "Rodas5P":
        raise InputError(f"Events are for method = 'Rodas5P' alone, not '{method}'.")
    watched = as_watched(events)
    state = initial_state(system, initial, t_start)
    if not isinstance(initial, str | Trajectory):
        _warn_of_depth(system, state, t_start)
    m = system.basis.modes
    rest: dict[str, Any] = {}
    if method == "Rodas5P":
        from fecontact.integrate.control import integrate

        run = integrate(system, state, times, rtol=rtol, max_step=max_step, progress=progress,
                        checkpoint=None if checkpoint is None else Path(checkpoint),
                        events=watched)
        times, states, work, status, statistics, found = run
        rest["events"] = found if watched else None
        rest["node_friction_work"] = work[:, len(POWERS) :]
        work = work[:, : len(POWERS)]
    elif method == "set-valued":
        from fecontact.integrate.scipy_solvers import longest_step
        from fecontact.integrate.set_valued import integrate_set_valued

        longest = None if max_step is None else longest_step(system, times, max_step)
        found = integrate_set_valued(system, state, times, rtol=rtol, restitution=restitution,
                                     static_coefficient=static_coefficient,
                                     scheme=scheme or "auto", longest=longest,
                                     progress=progress)
        times, states, work = found.time, found.states, found.work
        status, statistics = found.status, found.statistics
        rest = {"node_friction_work": found.node_friction_work,
                "held_normal_force": found.normal_force,
                "held_friction_force": found.friction_force}
    elif method == "CVODE":
        from fecontact.integrate import cvode

        times, states, work, status, statistics = cvode.integrate(
            system, state, times, rtol=rtol, max_step=max_step, progress=progress)
    else:
        from fecontact.integrate import scipy_solvers

        times, states, work, status, statistics = scipy_solvers.integrate(
            system, state, times, method=method, rtol=rtol, max_step=max_step,
            progress=progress)
    if status is Status.FINISHED and method != "set-valued" and _grows(
            system, times, states, work, rtol):
        status = Status.ENERGY_GREW
    return Trajectory(system, times, states[:, :m], states[:, m : 2 * m], work, status, statistics,
                      memory=states[:, 2 * m :] if system.memory else None, **rest)


def _grows(system: ContactSystem, times: Array, states: Array, work: Array, rtol: float) -> bool:
    """Whether energy came from nowhere, by some of the output times."""
    some = np.unique(np.linspace(0, len(times) - 1, min(len(times), _LOOKS)).astype(int))
    m = system.basis.modes
    run = Trajectory(system, times[some], states[some, :m], states[some, m : 2 * m], work[some],
                     memory=states[some, 2 * m :] if system.memory else None)
    return run.energies.growth > max(_GROWTH, 1e3 * rtol)


def _warn_of_depth(system: ContactSystem, state: Array, time: float) -> None:
    """Warn of a start so deep in the ground that a wrong unit is more likely than a wish."""
    depth = float(system.contact_history(np.array([time]), state[None])[0, :, PENETRATION].max())
    scale = system.penetration_scale
    if depth > _DEEP * scale:
        warnings.warn(f"The initial state is {depth:.3g} m deep in the ground, {depth / scale:.2g} "
                      f"times the {scale:.3g} m over which the normal law rises: the body will be "
                      f"thrown off.", stacklevel=3)


def require_max_step(max_step: Any) -> None:
    """InputError for what is no longest step: neither None nor a time above zero."""
    if max_step is not None and not (isinstance(max_step, Real) and not isinstance(max_step, bool)
                                     and 0.0 < float(max_step) < np.inf):
        raise InputError(f"max_step = {max_step!r} must be a finite time above zero [s]; leave it "
                         f"out for steps as long as the tolerance allows.")


def output_times(t_start: float, t_end: float, outputs: Any) -> NDArray[np.float64]:
    """Output times (N,) of a run; see :func:`simulate`.

    Raises
    ------
    InputError
        If they are not ascending from ``t_start`` to ``t_end``.
    """
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
