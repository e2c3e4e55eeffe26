"""Sampled periodic motions, from runs and from orbits of branches."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.core.checks import as_floats, as_texts
from fecontact.core.errors import InputError, require_positive, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, listed, span
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import Solver
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.columns import POWERS
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.powers import BRISTLES, FRICTION, NODE_POWERS, powers

# Distance of samples that coincide, in periods.
_COINCIDE = 1e-9
# Relative tolerance of the runs that sample an orbit by shooting.
_RTOL = 1e-7
# Histories of trajectories, and what they count from their start.
_WITH_TIME = ("modal_coordinates", "modal_velocities", "memory", "held_normal_force",
              "held_friction_force")
_COUNTED = ("work", "node_friction_work", "node_creep_work")


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class PeriodicMotion(Summarised):
    """A periodic motion over at least one period: a start for branches of orbits.

    Parameters
    ----------
    times, states : (k,) and (k, d) sequences
        Times [s] and states, y = [q, q', z] for contact systems. The last period is used.
    period : float, optional
        Period of the motion [s]. By default ``periods`` periods of the excitation, or for systems
        without excitation the time since the motion last passed its end point.
    periods : int
        Number of excitation periods in one period of the motion; 1 without excitation.
    parameter_values : (k,) sequence, optional
        Parameter values of the field for this motion; by default its base values. A branch begins
        at the one of the parameter that varies; the others are those of the field that it is given.
    state_names : sequence of str
        Names (d,) of the states, for plots; empty where they have none.

    Raises
    ------
    InputError
        If values are not numbers, or the period is not positive.
    """

    times: Array
    states: Array
    period: float | None = None
    periods: int = 1
    parameter_values: Array | None = None
    state_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("times", "states", "parameter_values"):
            given: ArrayLike | None = getattr(self, name)
            if given is not None or name != "parameter_values":
                object.__setattr__(self, name, as_floats(given, name))
        if self.states.ndim != 2 or self.states.size == 0:
            raise InputError(f"states must be those of a motion (k, d), not of shape "
                             f"{self.states.shape}.")
        if self.times.shape != (len(self.states),) or not np.isfinite(self.times).all() or (
                np.diff(self.times) < -1e-9 * np.ptp(self.times)).any():
            raise InputError(f"times must be {len(self.states)} finite numbers in ascending order, "
                             f"one for each state of the motion, not {shown(self.times)}.")
        if self.parameter_values is not None and not (
                self.parameter_values.ndim == 1 and np.isfinite(self.parameter_values).all()):
            raise InputError(f"parameter_values = {shown(self.parameter_values)} must be finite "
                             f"numbers, one for each parameter of the field.")
        names = as_texts(self.state_names, "PeriodicMotion: state_names")
        object.__setattr__(self, "state_names", names)
        if names and len(names) != self.states.shape[1]:
            raise InputError(f"PeriodicMotion: state_names = {shown(names)} must be "
                             f"{self.states.shape[1]} names.")
        if self.period is not None:
            require_positive("PeriodicMotion", period=self.period)
        if not (isinstance(self.periods, int | np.integer) and self.periods >= 1):
            raise InputError(f"PeriodicMotion: periods = {self.periods!r} must be a whole number "
                             f"from 1 on.")

    def summary(self) -> list[tuple[str, str]]:
        """Period, samples, states and their ranges."""
        names = self.state_names or [f"state {k}" for k in range(self.states.shape[1])]
        ranges = [f"{name} {span(column)}" for name, column in
                  zip(names, self.states.T, strict=True)]
        return [
            ("period", "that of the excitation" if self.period is None else f"{self.period:.7g}"),
            *([("periods of the excitation", f"{self.periods}")] if self.periods > 1 else []),
            ("samples", f"{len(self.times)}"), ("range", listed(ranges, 4))]

    def harmonics(
        self, count: int = 10, *, field: VectorField | None = None,
        observe: tuple[str | int, str] | ArrayLike | None = None,
    ) -> ComplexArray:
        r"""Fourier coefficients of the states, or of one quantity, over the last period.

        :math:`x(t) = \sum_{k=0}^{count} \mathrm{Re}(X_k e^{i k \omega t})` with
        :math:`\omega = 2 \pi / T`: X_0 is the mean, :math:`|X_k|` an amplitude in the unit of x,
        and :math:`a_k = \mathrm{Re} X_k`, :math:`b_k = -\mathrm{Im} X_k` are the coefficients of
        the cosine and the sine. T is the period of the motion, of orbits of several excitation
        periods a multiple of that of the excitation. Times count from zero as those of the
        excitation do. Samples at equal distances give the coefficients to rounding where the
        motion is smooth and has no harmonics above half their number.

        Parameters
        ----------
        count : int
            Highest harmonic, below half the number of samples in the period.
        field : VectorField, optional
            Field of the motion; needed for displacements of points.
        observe : (point, component) or (d,) sequence, optional
            A displacement of a contact system, such as ('B', 'x'), by its field, or a row of the
            states; by default all states.

        Returns
        -------
        (count + 1, d) or (count + 1,) complex array
            Of the states, or of what is observed [m, or rad for rotations].

        Raises
        ------
        InputError
            If the motion does not know its period or does not cover it, for too many harmonics,
            or a point without field.
        """
        states = self.states
        if observe is not None:
            states = states @ _observed_row(self.states.shape[1], field, observe)
        times, moved = _last_period(self, states)
        most = (len(times) - 1) // 2
        if not (isinstance(count, int | np.integer) and 0 <= count <= most):
            raise InputError(f"harmonics: count = {count!r} must be a whole number from 0 to "
                             f"{most}, half the {len(times)} samples in the period; take more "
                             f"samples, point.orbit(field, samples={4 * len(times)}).")
        assert self.period is not None
        waves = np.exp(-2.0j * np.pi / self.period * np.outer(np.arange(count + 1), times))
        found = waves @ moved * (2.0 / len(times))
        found[0] *= 0.5
        return np.asarray(found)

    def evenly(self) -> Array:
        """States (N, d) at equal distances over the last period, without its end."""
        return _last_period(self, self.states)[1]

    @property
    def amplitudes(self) -> Array:
        """Half the range (d,) of each state, at least 1e-3 of the largest."""
        found = np.ptp(self.states, axis=0) / 2.0
        return np.asarray(np.maximum(found, 1e-3 * found.max()))


def _observed_row(
    states: int, field: VectorField | None, observe: tuple[str | int, str] | ArrayLike
) -> Array:
    """Row (d,) of what is observed."""
    from fecontact.bifurcation.fields.observed_row import observed_row

    if field is not None:
        return observed_row(field, observe)[0]
    if isinstance(observe, tuple) and any(isinstance(one, str) for one in observe):
        raise InputError(f"harmonics: observe = {observe!r} is a point of a contact system; give "
                         f"its field too.")
    row = as_floats(observe, "observe")
    if row.shape != (states,):
        raise InputError(f"harmonics: observe must hold {states} numbers, one for each state.")
    return row


def _last_period(motion: PeriodicMotion, values: Array) -> tuple[Array, Array]:
    """Times (N,) at equal distances over the last period, without its end, and values there.

    Values of other samples are interpolated by cubic splines.
    """
    if motion.period is None:
        raise InputError("harmonics: the motion does not know its period; give it, "
                         "PeriodicMotion(times, states, period).")
    period, end = motion.period, float(motion.times[-1])
    times, first = np.unique(motion.times, return_index=True)
    kept = times >= end - period * (1.0 + _COINCIDE)
    if end - period < times[0] - _COINCIDE * period:
        raise InputError(f"harmonics: the motion covers {end - times[0]:.6g} s, less than its "
                         f"period of {period:.6g} s; run it longer.")
    count = max(int(np.count_nonzero(kept)) - 1, 2)
    wanted: Array = end - period + period / count * np.arange(count, dtype=np.float64)
    known = times[kept][:-1]
    if len(known) == count and np.abs(known - wanted).max() <= _COINCIDE * period:
        return known, np.asarray(values[first[kept][:-1]])
    from scipy.interpolate import CubicSpline

    return wanted, np.asarray(CubicSpline(times, values[first])(wanted))


def nodes_on_mesh(u: Array, mesh: Array, states: int) -> tuple[Array, int]:
    """Nodes (N m, d) and degree m of an orbit by collocation on N intervals.

    Raises
    ------
    InputError
        If the orbit was computed by shooting.
    """
    # After the nodes come the period (autonomous systems only) and the parameter.
    intervals = len(mesh) - 1
    degree = (len(u) - 1) // (intervals * states)
    if degree < 2:
        raise InputError("The orbit was found by shooting, which keeps the states at the ends of "
                         "its segments only; run it from there with point.orbit(field).")
    return np.ascontiguousarray(u[: intervals * degree * states].reshape(-1, states)), degree


def collocated(u: Array, mesh: Array, states: int, period: float, samples: int) -> PeriodicMotion:
    """Sample an orbit by collocation over one period, both ends included."""
    nodes, _ = nodes_on_mesh(u, mesh, states)
    phases = np.linspace(0.0, 1.0, samples)
    return PeriodicMotion(phases * period, interpolate(mesh, nodes, phases), period)


def run_again(
    system: ContactSystem, u: Array, mesh: Array, period: float, samples: int, solver: Solver,
) -> list[Trajectory]:
    """Run each segment of an orbit by shooting from its start.

    Together they give at least the requested number of samples, all ends included.
    """
    count = len(mesh) - 1
    starts, ends = u[: count * system.size].reshape(count, -1), mesh * period
    each = max(2, -(-samples // count))
    return [simulate(system, float(end), t_start=float(begin), initial=start, outputs=each,
                     solver=solver, rtol=_RTOL)
            for start, begin, end in zip(starts, ends[:-1], ends[1:], strict=True)]


def of_runs(runs: list[Trajectory], period: float) -> PeriodicMotion:
    """The motion of runs that follow each other."""
    return PeriodicMotion(np.concatenate([run.time for run in runs]),
                          np.concatenate([run.states for run in runs]), period)


def sampled_run(system: ContactSystem, motion: PeriodicMotion) -> Trajectory:
    """A motion in samples as a trajectory; work by the trapezoidal rule.

    The energy in bristles follows from their deflections, as their rates jump where they begin to
    slide.
    """
    m, states = system.basis.modes, np.ascontiguousarray(motion.states)
    run = Trajectory(system, motion.times, states[:, :m], states[:, m : 2 * m],
                     np.zeros((len(states), len(POWERS))),
                     memory=states[:, 2 * m :] if system.memory else None)
    steps = np.diff(motion.times)[:, None]
    work = _summed(_powers(system, motion.times, states), steps)
    if not system.memory:
        return replace(run, work=work)
    stored = _stored(run)
    lost = _summed(run.slip_power, steps) - stored
    work[:, BRISTLES], work[:, FRICTION] = stored.sum(axis=1), lost.sum(axis=1)
    return replace(run, work=work, node_friction_work=lost)


def _summed(power: Array, steps: Array) -> Array:
    """Integral (N, p) of powers (N, p) over steps (N - 1, 1) of time."""
    middle = 0.5 * (power[1:] + power[:-1]) * steps
    return np.concatenate([np.zeros((1, power.shape[1])), np.cumsum(middle, axis=0)])


def _stored(run: Trajectory) -> Array:
    """Energy (N, n) that has gone into the bristles of each node at constant normal force [J]."""
    assert run.memory is not None
    fixed, with_force = run.system.arrays.bristle_stiffness
    n, count = fixed.shape
    squares = run.memory.reshape(-1, n, count) ** 2
    stiffness = fixed + with_force * np.abs(run.normal_force)[:, :, None]
    changes = 0.25 * ((stiffness[1:] + stiffness[:-1]) * np.diff(squares, axis=0)).sum(axis=2)
    return np.concatenate([np.zeros((1, n)), np.cumsum(changes, axis=0)])


def _powers(system: ContactSystem, times: Array, states: Array) -> Array:
    """Powers (N, p) along a motion [W]."""
    n, arrays = system.basis.contact_nodes, system.arrays
    found, of_nodes = np.empty((len(times), len(POWERS))), np.empty(NODE_POWERS * n)
    stick_speed = np.zeros(n)
    for t, y, out in zip(times, states, found, strict=True):
        powers(float(t), y, arrays, stick_speed, out, of_nodes)
    return found


def joined(runs: list[Trajectory]) -> Trajectory:
    """Runs that follow each other in time as one; the first state of each but the first is left."""
    first, parts = runs[0], [slice(None), *(slice(1, None) for _ in runs[1:])]
    kept: dict[str, Any] = {"time": np.concatenate(
        [run.time[part] for run, part in zip(runs, parts, strict=True)])}
    for name in _WITH_TIME:
        if getattr(first, name) is not None:
            kept[name] = np.concatenate([getattr(run, name)[part]
                                         for run, part in zip(runs, parts, strict=True)])
    for name in _COUNTED:
        if getattr(first, name) is not None:
            ends = np.cumsum([getattr(run, name)[-1] for run in runs], axis=0)
            shifts = [np.zeros_like(ends[0]), *ends[:-1]]
            kept[name] = np.concatenate([getattr(run, name)[part] + shift for run, part, shift in
                                         zip(runs, parts, shifts, strict=True)])
    return replace(first, **kept)
