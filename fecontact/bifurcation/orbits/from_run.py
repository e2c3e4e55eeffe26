"""Periodic motions from runs, as starts for branches of orbits."""

from typing import Any

import numpy as np

from fecontact.analysis.periodicity import count_periods
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.errors import AnalysisError, InputError, require_not_negative
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.initial_state import Initial
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import AUTO, Solver
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving, in_time
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import common_period

_SAMPLES = 1000
_TRANSIENT_PERIODS, _LARGEST = 200, 16
# Largest relative difference of the motion after one period.
_MISFIT = 1e-2


@one_blas_thread
def periodic_motion(
    system: Moving, *, initial: Initial | FieldRun = "rest", transient: float | None = None,
    longest_period: float | None = None, solver: Solver = AUTO, rtol: float = 1e-8,
) -> PeriodicMotion:
    """Run a system until its motion repeats.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with a common period, or not at all; a field at its base values, which the motion
        keeps.
    initial : any
        Start; see :func:`fecontact.simulate`.
    transient : float, optional
        Transient before the motion is examined [s]; 200 excitation periods by default.
    longest_period : float, optional
        Longest period considered [s]; 16 excitation periods by default.
    solver : Auto, SetValued, Scipy, CVODE and others
        Solver of the run; see :func:`fecontact.simulate`.
    rtol : float
        Relative tolerance.

    Returns
    -------
    PeriodicMotion
        One period of the motion, or at least two for a self-excited one; a start for
        :func:`fecontact.bifurcation.orbit_branch`.

    Raises
    ------
    InputError
        If the system is not excited and the times are not given.
    AnalysisError
        If the motion does not repeat, or comes to rest.
    """
    moving = in_time("periodic_motion", system)
    values = system.values if isinstance(system, VectorField) else None
    names = system.state_names if isinstance(system, VectorField) else ()
    for name, value in (("transient", transient), ("longest_period", longest_period)):
        if value is not None:
            require_not_negative("periodic_motion", **{name: value})
    excitation = (common_period(moving) if isinstance(moving, ContactSystem)
                  else moving.forcing_period(moving.values))
    if excitation is None:
        if transient is None or longest_period is None:
            raise InputError("Nothing excites the system with a period; give transient, the time "
                             "until its motion settles, and longest_period, both in s.")
        end = transient + 2.2 * longest_period
        run = _run(moving, initial, end, np.linspace(transient, end, 6 * _SAMPLES), solver, rtol)
        if _at_rest(run):
            raise AnalysisError(f"The run comes to rest, or slides steadily, after {transient:g} "
                                f"s; there is no periodic orbit to start from, so take another "
                                f"start, or equilibria and their Hopf points.")
        return PeriodicMotion(run.time, run.states, _period(run, longest_period), 1, values,
                              names)
    first = _TRANSIENT_PERIODS if transient is None else max(1, round(transient / excitation))
    largest = _LARGEST if longest_period is None else max(1, round(longest_period / excitation))
    checks = largest + max(2 * largest, 8)
    instants: Array = excitation * np.arange(first, first + checks + 1, dtype=float)
    run = _run(moving, initial, float(instants[-1]), instants, solver, rtol)
    fine = _run(moving, run, float(instants[-1] + excitation * largest),
                float(instants[-1]) + excitation * np.linspace(0.0, largest,
                                                               largest * _SAMPLES + 1),
                solver, rtol, float(instants[-1]))
    size = np.ptp(fine.states, axis=0)
    size = np.maximum(size, 1e-9 * np.abs(fine.states).max(axis=0)) + 1e-300
    if isinstance(moving, ContactSystem):
        # States that a stop holds at rest move by rounding.
        m = moving.basis.modes
        for kind in (slice(0, m), slice(m, 2 * m)):
            size[kind] = np.maximum(size[kind], 1e-9 * size[kind].max())
    found = count_periods(run.states, size, largest=largest)
    if found.periods is None:
        why = "does not repeat" if found.settled else "has not settled"
        raise AnalysisError(f"The motion {why} within {largest} periods of the excitation after "
                            f"{first * excitation:.4g} s (it misses by {found.misfit:.1e} of its "
                            f"size); start at another value of the parameter, or run it longer.")
    count = found.periods * _SAMPLES + 1
    return PeriodicMotion(fine.time[:count], fine.states[:count], found.periods * excitation,
                          found.periods, values, names)


def _run(
    system: Moving, initial: Any, end: float, outputs: Array, solver: Solver, rtol: float,
    begin: float = 0.0,
) -> Trajectory | FieldRun:
    """Run with the requested outputs; the start is included only if requested."""
    extra = outputs[0] > begin
    times = np.append(begin, outputs) if extra else outputs
    times[-1] = end
    run = simulate(system, end, t_start=begin, initial=initial, outputs=times, solver=solver,
                   rtol=rtol, keep_steps=False)
    if run.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if run.status is not Status.FINISHED:
        raise AnalysisError(f"The run to the periodic motion did not reach its end: "
                            f"{run.status.value}")
    if not extra:
        return run
    return run.between(float(outputs[0]))


def _period(run: Trajectory | FieldRun, longest: float) -> float:
    """Period [s] from repeated mean crossings of the largest modal displacement, or state.

    Slip velocities hardly change during stick, so distances between states determine the period
    poorly.
    """
    t, states = run.time, run.states
    # Displacements, velocities and internal variables, each by the largest of them.
    size, m = np.ptp(states, axis=0), _displacements(run)
    if isinstance(run, Trajectory):
        for group in (slice(0, m), slice(m, 2 * m), slice(2 * m, None)):
            size[group] = size[group].max(initial=0.0) or 1.0
    fastest = int(np.argmax(np.ptp(states[:, :m], axis=0)))
    x = states[:, fastest] - (states[:, fastest].max() + states[:, fastest].min()) / 2.0
    rising = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    part = -x[rising] / (x[rising + 1] - x[rising])
    passed = t[rising] + part * (t[rising + 1] - t[rising])
    there = states[rising] + part[:, None] * (states[rising + 1] - states[rising])
    for back in range(2, len(passed) + 1):
        period = float(passed[-1] - passed[-back])
        if period > longest:
            break
        if (np.abs(there[-1] - there[-back]) <= _MISFIT * size).all():
            return period
    raise AnalysisError(f"The motion does not repeat within {longest:g} s; run it longer until it "
                        f"has settled, raise longest_period, or start at another value of the "
                        f"parameter.")


def _at_rest(run: Trajectory | FieldRun) -> bool:
    moved = run.states[:, : _displacements(run)]
    return bool(float(np.ptp(moved, axis=0).max()) <= 1e-7 * np.abs(moved).max())


def _displacements(run: Trajectory | FieldRun) -> int:
    """Number of the first states that are examined: modal displacements, or all of a field."""
    return run.states.shape[1] if isinstance(run, FieldRun) else run.system.basis.modes
