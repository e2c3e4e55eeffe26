"""Running a contact system in time."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.memory import require_memory
from fecontact.core.types import Array
from fecontact.integrate.events import Watched, as_watched
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.system.contact_system import ContactSystem
from fecontact.system.kernels import PENETRATION, POWERS
from fecontact.system.model_limits import warn_of_limits

# Starts deeper than so many penetration scales are warned of.
_DEEP = 100.0
# Growth of energy without a source, relative to the largest energy, that is an error, and the
# output times that are looked at for it.
_GROWTH, _LOOKS = 1e-2, 200
# Shortest run [s], and in spacings of floating-point numbers at its times.
_SHORTEST, _SPACINGS = 1e-100, 1e5

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
    keep_checkpoint: bool = False,
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
        Where it starts; see :func:`fecontact.integrate.initial_state.initial_state`.
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
    keep_checkpoint : bool
        Leave the file there at the end, to be removed once the run is written.
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

    Warns
    -----
    ModelWarning
        For each of :attr:`Trajectory.limits_exceeded`.
    """
    if not isinstance(system, ContactSystem):
        raise InputError(f"simulate needs a ContactSystem, not {type(system).__name__}.")
    if t_start is None:
        t_start = float(initial.time[-1]) if isinstance(initial, Trajectory) else 0.0
    if isinstance(outputs, int | np.integer) and not isinstance(outputs, bool):
        require_memory("outputs", int(outputs), _row_size(system))
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
    if checkpoint is not None and not as_path(checkpoint, "a checkpoint").parent.is_dir():
        raise InputError(f"checkpoint = {str(checkpoint)!r} cannot be written: there is no folder "
                         f"{Path(checkpoint).parent}.")
    if progress is not None and not callable(progress):
        raise InputError(f"progress = {progress!r} must be a function of the time reached.")
    watched = as_watched(events)
    state = initial_state(system, initial, t_start)
    if not isinstance(initial, str | Trajectory):
        _warn_of_depth(system, state, t_start)
    m = system.basis.modes
    rest: dict[str, Any] = {}
    if method == "Rodas5P":
        from fecontact.integrate.rodas5p.driver import integrate

        run = integrate(system, state, times, rtol=rtol, max_step=max_step, progress=progress,
                        checkpoint=None if checkpoint is None else Path(checkpoint),
                        events=watched)
        times, states, work, status, statistics, found = run
        if checkpoint is not None and not keep_checkpoint and status is not Status.INTERRUPTED:
            Path(checkpoint).unlink(missing_ok=True)
        rest["events"] = found if watched else None
        rest["node_friction_work"] = work[:, len(POWERS) :]
        work = work[:, : len(POWERS)]
    elif method == "set-valued":
        from fecontact.integrate.nonsmooth.driver import integrate_set_valued
        from fecontact.integrate.reference.scipy import longest_step

        longest = None if max_step is None else longest_step(system, times, max_step)
        found = integrate_set_valued(system, state, times, rtol=rtol, restitution=restitution,
                                     static_coefficient=static_coefficient,
                                     scheme=scheme or "auto", longest=longest,
                                     progress=progress)
        times, states, work = found.time, found.states, found.work
        status = found.status
        # With what the run was told, it can be repeated.
        statistics = found.statistics | {
            "restitution": restitution, "static_coefficient": None if static_coefficient is None
            else np.asarray(static_coefficient, dtype=float).tolist()}
        rest = {"node_friction_work": found.node_friction_work,
                "held_normal_force": found.normal_force,
                "held_friction_force": found.friction_force}
    elif method == "CVODE":
        from fecontact.integrate.reference import cvode

        times, states, work, status, statistics = cvode.integrate(
            system, state, times, rtol=rtol, max_step=max_step, progress=progress)
    else:
        from fecontact.integrate.reference import scipy as scipy_solvers

        times, states, work, status, statistics = scipy_solvers.integrate(
            system, state, times, method=method, rtol=rtol, max_step=max_step,
            progress=progress)
    trajectory = Trajectory(
        system, times, states[:, :m], states[:, m : 2 * m], work, status, statistics,
        memory=states[:, 2 * m :] if system.memory else None, **rest)
    if status in (Status.FINISHED, Status.EVENT):
        trajectory = replace(trajectory, status=_checked(trajectory, method, rtol))
    warn_of_limits(trajectory.limits_exceeded, "In this run")
    return trajectory


def _checked(run: Trajectory, method: str, rtol: float) -> Status:
    """The status of a run that has come to its end, by its energies at some output times."""
    some = np.unique(np.linspace(0, len(run.time) - 1, min(len(run.time), _LOOKS)).astype(int))
    histories = ("time", "modal_coordinates", "modal_velocities", "work", "memory",
                 "held_normal_force", "held_friction_force")
    part = replace(run, **{name: value[some] for name in histories
                           if (value := getattr(run, name)) is not None})
    with np.errstate(over="ignore", invalid="ignore"):
        energies = part.energies
        amounts = np.array([getattr(energies, entry.name) for entry in fields(energies)])
        forces = np.array([part.normal_force, part.friction_force])
        if not (np.isfinite(amounts).all() and np.isfinite(forces).all()
                and np.isfinite(run.states).all() and np.isfinite(run.work).all()):
            return Status.ENERGY_NOT_FINITE
        grown = method != "set-valued" and energies.growth > max(_GROWTH, 1e3 * rtol)
    return Status.ENERGY_GREW if grown and run.status is Status.FINISHED else run.status


def _row_size(system: ContactSystem) -> float:
    """Memory for an output time [bytes]: states and work, copied once, and contact quantities."""
    n = system.basis.contact_nodes
    states = 2 * system.basis.modes + n * system.memory
    return 8.0 * (2 * (states + len(POWERS) + n) + 10 * n)


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


def output_times(t_start: float, t_end: float, outputs: Any) -> Array:
    """Output times (N,) of a run; see :func:`simulate`.

    Raises
    ------
    InputError
        If they are not ascending from ``t_start`` to ``t_end``.
    """
    if not (isinstance(t_start, Real) and isinstance(t_end, Real)
            and -np.inf < t_start < t_end < np.inf):
        raise InputError(f"t_end = {t_end!r} must be a finite time after t_start = {t_start!r}.")
    latest = max(abs(t_start), abs(t_end))
    if t_end - t_start < max(_SHORTEST, _SPACINGS * float(np.spacing(latest))):
        raise InputError(f"t_end = {t_end!r} is too near t_start = {t_start!r} for steps in "
                         f"between: floating-point numbers cannot tell their times apart; end "
                         f"later.")
    if isinstance(outputs, int | np.integer) and not isinstance(outputs, bool):
        if outputs < 2:
            raise InputError(f"outputs = {outputs} must be at least 2.")
        times = np.linspace(t_start, t_end, int(outputs))
        if not (np.diff(times) > 0.0).all():
            raise InputError(f"outputs = {outputs} are too many from t_start = {t_start!r} to "
                             f"t_end = {t_end!r}: floating-point numbers cannot tell so many "
                             f"times apart; end later or take fewer outputs.")
        return times
    try:
        times = np.array(outputs, dtype=float)
    except (TypeError, ValueError):
        times = np.zeros(0)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0.0).all() or (
            times[0] != t_start or times[-1] != t_end):
        raise InputError("outputs must be a number of times, or ascending times from t_start to "
                         "t_end.")
    return times
