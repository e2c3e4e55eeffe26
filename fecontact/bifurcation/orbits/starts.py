"""Starts of branches of periodic orbits: at Hopf points, from samples, on other branches.

A start is a problem, its unknowns u and the direction in which the branch leaves.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.points import HopfPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, sizes_of, width_of
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, default_scales
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.mesh import (
    equidistributed,
    interpolate,
    node_times,
    require_mesh,
)
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.unknowns import forcing_period
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

Start = tuple[CollocationProblem, Array, Array]
# The direction is not known of an orbit near a motion.
Begun = tuple[CollocationProblem, Array, Array | None]

_CORRECTIONS = 25
# Times the intervals on which an orbit is found where the number asked for does not lead there.
_FINER = (2, 4)
# First amplitudes of orbits at a Hopf point, tried in this order. With a strongly curved friction
# law only the smallest orbits have the shape of the eigenvector; where the parameter hardly changes
# along the branch, only larger ones are distinct from the equilibrium.
AMPLITUDES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-2, 1e-7)


def at_hopf(
    field: VectorField, point: HopfPoint, intervals: int, degree: int, options: ContinuationOptions,
    scales: ArrayLike | None, width: float | None,
) -> Iterator[tuple[Start, Array | None]]:
    """Starts on the orbits born at a Hopf point, x = state + eps Re(eigenvector exp(i w t)).

    One for each of the amplitudes eps to try, with limits of the scales.

    Raises
    ------
    InputError
        If the mesh cannot be used.
    """
    require_mesh(intervals, degree)
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    state, w = np.ascontiguousarray(point.u[:-1]), point.angular_frequency
    require_positive("A Hopf point", angular_frequency=w)
    sizes, limits = sizes_of(scales, default_scales(Equilibrium(field, values, state)))
    widths = np.append(sizes, width_of(
        width, options, point.parameter, point.branch.attributes.get("width")))
    mesh = np.linspace(0.0, 1.0, intervals + 1)
    phase = 2.0j * np.pi * node_times(mesh, degree)
    shape = np.array((np.exp(phase)[:, None] * np.asarray(point.eigenvector)).real, order="C")
    period = 2.0 * np.pi / w
    leaving = np.concatenate([shape.reshape(-1), [0.0, 0.0]])
    at = np.concatenate([np.tile(state, len(shape)), [period, values[free]]])
    for amplitude in AMPLITUDES:
        problem = CollocationProblem(field, values.copy(), free, mesh, degree, shape,
                                     _with_period(widths, period))
        away = leaving / np.sqrt(problem.weights() @ leaving**2)
        # At the Hopf point itself the system is singular: period and parameter do not affect the
        # orbit.
        yield (problem, at + amplitude * away, away), limits


@dataclass(frozen=True, eq=False)
class MotionStart:
    """A nearly periodic motion from which a branch starts.

    Attributes
    ----------
    field : VectorField
    values : (k,) array
        Parameters of the field there.
    free : int
        Index of the one that varies.
    motion : PeriodicMotion
    widths : (d + 1,) array
        Scales of the states and of the parameter in the step length.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow; None keeps them.
    """

    field: VectorField
    values: Array
    free: int
    motion: PeriodicMotion
    widths: Array
    limits: Array | None = None

    def on_mesh(self, intervals: int, degree: int) -> tuple[CollocationProblem, Array]:
        """Problem and first guess: the last period on a mesh of so many intervals.

        Forced systems take ``motion.periods`` times the period of the forcing, motions of unknown
        period the time since they last passed their end point.

        Raises
        ------
        InputError
            If the samples do not cover a period, or are not periodic.
        """
        require_mesh(intervals, degree)
        field, motion, t, x = self.field, self.motion, self.motion.times, self.motion.states
        if x.shape[1] != field.dimension or len(t) < 5:
            raise InputError(f"An orbit of this field needs times (k,) and states (k, "
                             f"{field.dimension}), k at least 5, not {t.shape} and {x.shape}.")
        forcing = forcing_period(field, self.values, self.free)
        if forcing is not None:
            T = motion.periods * forcing
        else:
            T = _return_time(t, x) if motion.period is None else float(motion.period)
        require_positive("A motion", period=T)
        if t[-1] - t[0] < T * (1.0 - 1e-9):
            raise InputError(f"The samples cover {t[-1] - t[0]:g} s, but the period is {T:g} s; "
                             f"give at least one period.")
        fine = np.linspace(0.0, 1.0, 4 * intervals + 1)
        sampled = partial(_at_phases, t, x, T, forcing is not None)
        mesh = equidistributed(fine, sampled(node_times(fine, degree)), degree, intervals)
        nodes = sampled(node_times(mesh, degree))
        problem = CollocationProblem(field, self.values.copy(), self.free, mesh, degree, nodes,
                                     _with_period(self.widths, T), motion.periods)
        return problem, np.concatenate([nodes.reshape(-1), [T] if forcing is None else [],
                                        [self.values[self.free]]])


def _at_phases(t: Array, x: Array, period: float, forced: bool, phases: Array) -> Array:
    """States (k, d) of a motion in its last period; phases of forced systems count from t = 0."""
    offset = 0.0 if forced else t[-1] / period
    place = t[-1] - period * np.mod(t[-1] / period - offset - phases, 1.0)
    return np.stack([np.interp(place, t, column) for column in x.T], axis=1)


def along(problem: CollocationProblem, u: Array, ahead: PeriodicMotion, distance: float) -> Array:
    """Direction (N + 1,) from an orbit u to a motion at this distance, on the mesh of u."""
    assert ahead.period is not None
    assert ahead.parameter_values is not None
    nodes = _at_phases(ahead.times, ahead.states, ahead.period, not problem.autonomous,
                       node_times(problem.mesh, problem.degree))
    there = np.concatenate([nodes.reshape(-1), [ahead.period] if problem.autonomous else [],
                            [ahead.parameter_values[problem.free]]])
    return (there - u) / distance


def _with_period(scales: Array, period: float) -> Array:
    return np.concatenate([scales[:-1], [period, scales[-1]]])


def _return_time(t: Array, x: Array) -> float:
    """Time since the motion last passed its end point in the same direction."""
    scale = np.ptp(x, axis=0)
    scaled = x / np.where(scale > 0.0, scale, 1.0)
    away = np.linalg.norm(scaled - scaled[-1], axis=1)
    far = np.flatnonzero(away > 0.5 * away.max())
    before = np.arange(len(t)) < far[-1] if len(far) else np.zeros(len(t), dtype=bool)
    near = np.flatnonzero(before & (away < 0.2 * away.max()))
    if not len(near):
        raise InputError("The samples do not come back to where they end; give more than one "
                         "period, or the period.")
    gaps = np.flatnonzero(np.diff(near) > 1)
    first = near[gaps[-1] + 1] if len(gaps) else near[0]
    best = first + int(np.argmin(away[first : near[-1] + 1]))
    return float(t[-1] - t[best])


def converged_orbit(
    problem: CollocationProblem, u: Array, tolerance: float = 1e-10, family: bool = False
) -> tuple[CollocationProblem, Array]:
    """The orbit near u at fixed parameter, on a mesh equidistributed for it.

    Of a ``family`` at a fixed parameter that of its size, where the parameter may move.

    Raises
    ------
    AnalysisError
        If Newton's method does not converge, or converges to an equilibrium.
    """
    for fresh in (False, True):
        if fresh:
            mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree,
                                   problem.intervals)
            problem, u, _ = problem.on_mesh(mesh, u, np.zeros_like(u))
        u = _newton(problem, u, tolerance, family)
        problem = replace(problem, reference=problem.nodes(u).copy(), age=0)
    return problem, u


def corrected_samples(
    sampled: Callable[[int], tuple[CollocationProblem, Array]], intervals: int,
    family: bool = False,
) -> tuple[CollocationProblem, Array]:
    """The orbit on so many intervals, near samples that ``sampled(intervals)`` puts on a mesh.

    Where a coarse mesh does not lead from the samples to the orbit, a finer one does first.

    Raises
    ------
    AnalysisError
        As :func:`converged_orbit`, if none does.
    """
    try:
        return converged_orbit(*sampled(intervals), family=family)
    except AnalysisError:
        for finer in _FINER:
            try:
                problem, u = converged_orbit(*sampled(finer * intervals), family=family)
                problem, u, _ = on_intervals((problem, u, np.zeros_like(u)), intervals)
                return converged_orbit(problem, u, family=family)
            except AnalysisError:
                continue
        raise


def size_row(problem: CollocationProblem, u: Array) -> Array:
    """Row (N + 1,) of the size of an orbit u: what moves its states away from their means."""
    nodes = problem.nodes(u)
    row = np.zeros_like(u)
    row[: problem.size] = (nodes - nodes.mean(axis=0)).reshape(-1)
    return problem.weights() * row / np.sqrt(problem.weights() @ row**2)


def _newton(problem: CollocationProblem, u: Array, tolerance: float, family: bool) -> Array:
    row = size_row(problem, u) if family else unit(len(u))
    where = f"at {problem.parameter_name} = {u[-1]:.6g}, from the period {problem.period(u):.6g} s"
    size = float(np.linalg.norm(np.ptp(problem.nodes(u), axis=0)))
    linearised = problem.linearise(u)
    norm = float(np.linalg.norm(linearised.residual))
    for _ in range(_CORRECTIONS):
        step = linearised.solve(row, -np.append(linearised.residual, 0.0))
        if not np.isfinite(step).all():
            break
        factor = 1.0
        while True:
            trial = problem.linearise(u + factor * step)
            found = float(np.linalg.norm(trial.residual)) if trial.period > 0.0 else np.inf
            if found < (1.0 - 0.1 * factor) * norm or found < tolerance * (1.0 + size):
                break
            factor /= 2.0
            if factor < 1e-3:
                break
        if factor < 1e-3 and not np.abs(step).max() < 1e-6 * (1.0 + np.abs(u).max()):
            break
        u, linearised, norm = u + factor * step, trial, found
        if factor == 1.0 and np.abs(step).max() < tolerance * (1.0 + np.abs(u).max()):
            if not _at_rest(problem, u, size):
                return u
            break
    if _at_rest(problem, u, size):
        raise AnalysisError(f"No periodic orbit was found {where}: the iteration ends without "
                            f"any motion, as at an equilibrium; start from a motion of larger "
                            f"amplitude.")
    raise AnalysisError(f"No periodic orbit was found {where}: Newton's method does not converge "
                        f"(residual {norm:.3g}); start nearer to it, from a longer settled run, or "
                        f"take more than {problem.intervals} intervals.")


def _at_rest(problem: CollocationProblem, u: Array, size: float) -> bool:
    return float(np.linalg.norm(np.ptp(problem.nodes(u), axis=0))) <= 1e-4 * size


def doubled(problem: CollocationProblem, u: Array) -> Start:
    """Start on the doubled orbits at a period doubling u, with twice the intervals.

    The direction is the eigenfunction of the multiplier -1, which changes sign after one period.
    """
    linearised = problem.linearise(u)
    bordered = linearised.bordered(unit(len(u)), -1.0)
    d = problem.field.dimension
    _, _, vectors = np.linalg.svd(bordered.matrix[:d, :d])
    shape = bordered.expand(np.concatenate([vectors[-1], np.zeros(problem.common)]))
    shape = shape[: problem.size].reshape(problem.reference.shape)
    nodes = problem.nodes(u)
    mesh = np.concatenate([problem.mesh[:-1] / 2.0, 0.5 + problem.mesh / 2.0])
    common = u[problem.size :].copy()
    periods = problem.periods
    if problem.autonomous:
        common[0] *= 2.0
    else:
        periods *= 2
    twice = np.concatenate([nodes, nodes])
    result = replace(problem, mesh=mesh, reference=twice, periods=periods, age=0)
    start = np.concatenate([twice.reshape(-1), common])
    leaving = np.concatenate([shape.reshape(-1), -shape.reshape(-1), np.zeros(problem.common)])
    return result, start, leaving


def on_intervals(start: Start, intervals: int | None) -> Start:
    """The start on another number of intervals; None keeps it."""
    problem, u, tangent = start
    if intervals is None or intervals == problem.intervals:
        return start
    mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree, intervals)
    return problem.on_mesh(mesh, u, tangent)


def crossing(problem: CollocationProblem, u: Array, incoming: Array) -> Start:
    """Start on the other branch of orbits through a branch point u.

    ``incoming`` is the direction of the first branch nearby; at the point itself the equations
    cannot distinguish the two directions.
    """
    row = problem.weights() * incoming
    bordered = problem.linearise(u).bordered(row)
    d = problem.field.dimension
    # In the scales of the states, as one of these equations may be zero within rounding.
    sizes = np.concatenate([problem.scales[:d], problem.scales[-problem.common :]])
    equations = bordered.matrix[:-1] * sizes
    equations[:d] /= sizes[:d, None]
    equations[d:] /= np.abs(equations[d:]).max(axis=1)[:, None]
    _, _, vectors = np.linalg.svd(equations)
    first, second = (bordered.expand(sizes * vector) for vector in vectors[-2:])
    other = (row @ second) * first - (row @ first) * second
    return replace(problem, reference=problem.nodes(u).copy()), u, other


def at_phase(problem: CollocationProblem, u: Array, phases: Array) -> Array:
    """States (k, d) of the orbit at phases (k,), in periods."""
    return interpolate(problem.mesh, problem.nodes(u), np.mod(phases, 1.0))
