"""Branches of periodic orbits from any start, by any of the three methods."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.heading import heading
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import HopfPoint, require_no_family
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    options_of,
    sizes_of,
    width_of,
)
from fecontact.bifurcation.continuation.pseudo_arclength import inside
from fecontact.bifurcation.continuation.sharpening import ROUGHLY, SHARPENED, Accuracy, sharpened
from fecontact.bifurcation.fields.jumps import require_smooth_friction
from fecontact.bifurcation.harmonic import branches as harmonic_branches
from fecontact.bifurcation.harmonic import starts as harmonic_starts
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.orbit_methods import Collocation, Method, Shooting
from fecontact.bifurcation.orbits import shooting_branches, starts
from fecontact.bifurcation.orbits.collocation import CollocationProblem, Intervals
from fecontact.bifurcation.orbits.curves.resonant import (
    AWAY,
    StrongResonance,
    is_single,
    of_several,
)
from fecontact.bifurcation.orbits.motions import PeriodicMotion, solver_of
from fecontact.bifurcation.orbits.restored import rescaled, restored, restored_shooting
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.state_error import state_error
from fecontact.core.checks import require_flags, require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError, require_finite
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.fields.vector_field import VectorField, require_field

# Factors of the first step, tried in this order to leave a special point.
_FIRST_STEPS = (1.0, 0.2, 0.04)
# Special points of orbits at which other orbits branch off.
_BRANCHING = ("period doubling", "branch point")
# Points of curves of tori around which orbits of several periods lie.
_STRONG = {"resonance 1:3": 3, "resonance 1:4": 4}

# Mesh intervals on which a motion is put before it becomes a series, and samples of an orbit by
# another method; distance, in the step length, of the neighbour that tells the direction there.
_INTERVALS, _SAMPLES, _ALONG = 200, 8001, 1e-4
# Steps to each side within which a special point is found again with few harmonics.
_AROUND = 4

T = TypeVar("T")


@one_blas_thread
def orbit_branch(
    field: VectorField,
    start: BranchPoint | PeriodicMotion | Trajectory | FieldRun | tuple[ArrayLike, ArrayLike],
    parameter: str | None = None, *, method: Method | None = None,
    options: ContinuationOptions | None = None, bounds: tuple[float, float] | None = None,
    scales: ArrayLike | None = None, width: float | None = None, direction: float = 1.0,
    both: bool = False,
) -> Branch:
    """Follow periodic orbits over a parameter.

    Points store 'period' [s], 'multipliers' (d,), 'unstable' (number outside the unit circle),
    'stable', 'trivial_error', 'mesh' (N + 1,), 'minimum' and 'maximum' (d,), by collocation also
    'state_error'. Special points are 'fold', 'period doubling', 'Neimark-Sacker', 'branch point',
    'period halving' and 'unresolved'; see docs/orbits.md.

    Parameters
    ----------
    field : VectorField
        The system; that of the branch if ``start`` is a point of one.
    start : BranchPoint, PeriodicMotion, Trajectory, FieldRun or (times, states)
        A Hopf point of equilibria; a period doubling or branch point of orbits; a resonance 1:3 or
        1:4 of a curve; any other point of a branch of orbits, to continue it; or a steady periodic
        motion.
    parameter : str, optional
        The parameter to vary; by default that of the point, or the only one of the field.
    method : Collocation, Shooting or HarmonicBalance, optional
        Default: the method of the point's branch, with twice the intervals, segments or harmonics
        after a period doubling; else collocation. Every method starts from points of the others.
    options, bounds : ContinuationOptions and (float, float), optional
        Step lengths, tolerances, stopping conditions; range of the parameter in place of theirs.
    scales : (d,) sequence, optional
        Amplitudes of the states that count as one in the arclength; by default those of the point's
        branch or the motion, at a Hopf point those of the field.
    width : float, optional
        Parameter range that counts as one; by default that of the point's branch, or of the bounds.
    direction : float
        Sign of the first change of the parameter from a motion; from a point, 1 goes forward along
        its branch and -1 back, or to either side of a branch point or resonance.
    both : bool
        Follow the branch in both directions; not for Hopf points and period doublings.

    Raises
    ------
    InputError, AnalysisError
        If no orbits emanate from the start, it lies outside the bounds or covers no period, or no
        orbit is found near a motion.
    """
    require_field(field)
    require_kind("orbit_branch", (BranchPoint, PeriodicMotion, Trajectory, FieldRun, tuple),
                 start=start)
    require_kind("orbit_branch", (Collocation, Shooting, HarmonicBalance, type(None)),
                 method=method)
    require_finite("orbit_branch", direction=direction)
    require_flags("orbit_branch", both=both)
    chosen = options_of(options, bounds)
    if not isinstance(start, BranchPoint):
        return _from_motion(field, as_motion(start), field.parameter_or_only(parameter),
                            method or Collocation(), chosen, scales, width, direction, both)
    if isinstance(start, HopfPoint):
        _require_one_side(start, both)
        _require_parameter(start, parameter)
        return _from_hopf(field, start, method or Collocation(), chosen, scales, width)
    if not start.is_orbit:
        raise InputError(f"{start.place} has no orbits to follow: take a point of the kind 'Hopf', "
                         f"or one of a branch of orbits.")
    require_no_family(start)
    known = start.branch.parameter_name
    name = known if parameter is None else field.parameter_or_only(parameter)
    if start.kind in _STRONG:
        return _around(field, start, name, method, chosen, scales, width, direction, both)
    if name == known and start.kind in _BRANCHING:
        if both and start.kind == "branch point":
            return _both_halves(
                start, chosen, lambda side, options: _beyond(field, start, method, options, scales,
                                                             width, side * direction))
        _require_one_side(start, both)
        return _beyond(field, start, method, chosen, scales, width, direction)
    if name == known and _keeps(start, method):
        return _goes_on(field, start, method, chosen, scales, width, direction, both)
    if name == known:
        direction = direction * float(np.copysign(1.0, start.tangent[-1]))
    return _from_motion(field, start.orbit(field), name, method or _method_of(start), chosen,
                        scales, width, direction, both)


def as_motion(start: PeriodicMotion | Trajectory | FieldRun | tuple[Any, ...]) -> PeriodicMotion:
    """A run, or times and states, as a motion that orbits start from."""
    if isinstance(start, PeriodicMotion):
        return start
    if isinstance(start, Trajectory):
        return PeriodicMotion(start.time, start.states)
    if isinstance(start, FieldRun):
        return PeriodicMotion(start.time, start.states,
                              parameter_values=np.array(list(start.parameters.values())))
    if len(start) != 2:
        raise InputError(f"orbit_branch: start must be two arrays, times and states of a motion, "
                         f"not {len(start)}.")
    return PeriodicMotion(*start)


def _require_one_side(point: BranchPoint, both: bool) -> None:
    if both:
        raise InputError(f"{point.place} is where orbits begin, which leave it to one side; both = "
                         f"True goes with motions, resonances, regular and branch points.")


def _require_parameter(point: BranchPoint, parameter: str | None) -> None:
    if parameter is not None and parameter != point.branch.parameter_name:
        raise InputError(f"{point.place} starts a branch over {point.branch.parameter_name!r}, not "
                         f"{parameter!r}; follow the equilibrium over that one first.")


def _method_of(point: BranchPoint) -> Method:
    """Method by which an orbit was computed."""
    if point.by_harmonics:
        return harmonic_branches.method_of(point)
    known = point.branch.attributes
    if point.by_shooting:
        return Shooting(int(known["segments"]), float(known.get("rtol", 1e-9)),
                        known.get("derivative_rtol"), solver_of(known))
    usual = Collocation()
    # Special points may have more intervals than their branch.
    return Collocation(int(known.get("intervals", len(point.values["mesh"]) - 1)),
                       int(known["degree"]), float(known.get("tolerance", usual.tolerance)),
                       int(known.get("most_intervals", usual.most_intervals)),
                       known.get("state_tolerance"))


def method_of_several(at: StrongResonance) -> Collocation:
    """Collocation for a curve of tori: intervals for orbits of several periods near a resonance."""
    usual = _method_of(at.point)
    assert isinstance(usual, Collocation)
    return replace(usual, intervals=at.order * at.orbit.intervals,
                   most_intervals=at.order * usual.most_intervals)


def _keeps(point: BranchPoint, method: Method | None) -> bool:
    """Whether the unknowns of a point suit the method, apart from the number of intervals."""
    found = _method_of(point)
    if isinstance(found, HarmonicBalance):
        return method is None or isinstance(method, HarmonicBalance)
    if isinstance(found, Collocation):
        return method is None or (isinstance(method, Collocation)
                                  and method.degree == found.degree)
    return method is None or (isinstance(method, Shooting) and method.segments == found.segments)


def _mesh_of(method: Method) -> tuple[int, int]:
    """Intervals and degree of the mesh on which a start is put for a method."""
    if isinstance(method, Collocation):
        return method.intervals, method.degree
    usual = Collocation()
    return usual.intervals, usual.degree


def _first_that_goes(attempts: Iterator[T], go: Callable[[T], Branch]) -> Branch:
    """Branch of the first attempt that succeeds."""
    failed: FecontactError = InputError("There is nothing to start from.")
    for attempt in attempts:
        try:
            return go(attempt)
        except FecontactError as error:
            failed = error
    raise failed


def _from_hopf(
    field: VectorField, point: HopfPoint, method: Method,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None,
) -> Branch:
    if isinstance(method, Collocation):
        require_smooth_friction(field)
    return _first_that_goes(
        starts.at_hopf(field, point, *_mesh_of(method), options, scales, width),
        lambda found: _FOLLOWED[type(method)](found[0], method, options, found[1]))


def _from_motion(
    field: VectorField, motion: PeriodicMotion, parameter: str, method: Method,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
    both: bool,
) -> Branch:
    free = field.index(parameter)
    given = field.values if motion.parameter_values is None else motion.parameter_values.copy()
    if given.shape != field.values.shape:
        raise InputError(f"parameter_values of the motion must be {len(field.values)} numbers, one "
                         f"for each parameter of the field, not of shape {given.shape}.")
    given[free] = inside(float(given[free]), options)
    sizes, limits = sizes_of(scales, motion.amplitudes + 1e-300)
    widths = np.append(sizes, width_of(width, options, given[free]))
    if isinstance(method, Shooting):
        return shooting_branches.from_motion(field, given, free, motion, method, options, widths,
                                             limits, direction, both)

    def sampled(intervals: int) -> tuple[CollocationProblem, Array]:
        return starts.from_samples(field, given, free, motion.times, motion.states, motion.period,
                                   intervals, degree, motion.periods, widths)

    intervals, degree = _mesh_of(method)
    if isinstance(method, Collocation):
        require_smooth_friction(field)
        problem, u = starts.corrected_samples(sampled, intervals)
    else:
        problem, u = sampled(_INTERVALS)
    return _FOLLOWED[type(method)]((problem, u, None), method, options, limits,
                                   direction=direction, both=both)


def _around(
    field: VectorField, point: BranchPoint, name: str, method: Method | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
    both: bool,
) -> Branch:
    """Orbits of three or four periods around a strong resonance of a curve of tori."""
    first, second = map(str, point.branch.attributes["parameters"])
    if name not in (first, second):
        raise InputError(f"{point.place} is one over {first!r} and {second!r}: parameter = "
                         f"{name!r} must be one of them.")
    at = StrongResonance(field, point, second, _STRONG[str(point.kind)])
    place = at.names.index(name)
    chosen = method or method_of_several(at)

    def beside(side: float, options: ContinuationOptions, away: float) -> Branch:
        branch = _from_motion(
            field, of_several(at, side * away * np.eye(2)[place]), name, chosen, options, scales,
            width or float(at.widths[place]), side, False)
        if is_single(branch.points[0], at.order):
            raise AnalysisError(f"{point.place}: no orbit of {at.order} periods was found there.")
        return branch

    def go(side: float, options: ContinuationOptions) -> Branch:
        return _first_that_goes(iter(AWAY), lambda away: beside(side, options, away))

    sign = float(np.copysign(1.0, direction))
    if not both:
        return go(sign, options)
    return _both_halves(None, options, lambda side, options: go(sign * side, options))


def _both_halves(
    point: BranchPoint | None, options: ContinuationOptions,
    go: Callable[[float, ContinuationOptions], Branch],
) -> Branch:
    """Both halves of the other branch at a branch point, from end to end through it, if given."""
    halves: list[Branch | None] = []
    failed: FecontactError = InputError("There is nothing to start from.")
    for side in (1.0, -1.0):
        try:
            half = go(side, replace(options, points=max(options.points // 2, 2)))
            if point is None and half.status is BranchStatus.CLOSED:
                return half
            halves.append(half)
        except FecontactError as error:
            halves.append(None)
            failed = error
    ahead, back = halves
    if ahead is None or back is None:
        one = ahead or back
        if one is None:
            raise failed
        return one
    there = () if point is None else (replace(point, tangent=ahead.points[0].tangent),)
    return replace(ahead, points=(*back.reversed().points, *there, *ahead.points),
                   message=" ".join(filter(None, (ahead.message, back.message))))


def _beyond(
    field: VectorField, point: BranchPoint, method: Method | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
) -> Branch:
    """The other orbits at a special point of a branch of orbits, by any method."""
    doubling, own = point.kind == "period doubling", _method_of(point)
    chosen = method or own
    if isinstance(chosen, HarmonicBalance) and point.by_harmonics:
        return harmonic_branches.beyond(field, point, None if method is None else chosen, options,
                                        scales, width, direction)
    if isinstance(chosen, Shooting) and point.by_shooting and doubling:
        return shooting_branches.beyond(field, point, None if method is None else chosen, options,
                                        scales, width, direction)
    require_smooth_friction(field)
    if isinstance(own, Collocation) and _keeps(point, method or own):
        problem, u, tangent = restored(field, point)
    else:
        problem, u, tangent = _collocated(field, point, chosen)
    problem = rescaled(problem, scales, width)
    if isinstance(chosen, HarmonicBalance):
        there = _found_again(point, (problem, u, tangent), chosen, options)
        return harmonic_branches.beyond(field, there, chosen, options, scales, width, direction)
    if doubling and isinstance(chosen, Shooting):
        single, first = shooting_branches.start_of((problem, u, tangent), replace(
            chosen, segments=max(chosen.segments // 2, 1)), None)[:2]
        return shooting_branches.doubled(single, first, options, direction)
    found = starts.doubled(problem, u) if doubling else starts.crossing(problem, u, tangent)
    if isinstance(chosen, Collocation):
        if method is None and doubling:
            chosen = replace(chosen, intervals=2 * chosen.intervals)
        found = _on_own_intervals(found, chosen)
    problem, u, tangent = found
    tangent = np.copysign(1.0, direction) * heading(tangent, problem.weights())

    # At the point both branches are indistinguishable, and the new one may bend strongly: step off
    # it, by less if the corrector fails.
    def go(part: float) -> Branch:
        step = max(part * options.step, options.smallest_step)
        return _FOLLOWED[type(chosen)]((problem, u + step * tangent, tangent), chosen,
                                       replace(options, step=step), None)

    return _first_that_goes(iter(_FIRST_STEPS), go)


def _found_again(
    point: BranchPoint, start: starts.Start, method: HarmonicBalance, options: ContinuationOptions
) -> BranchPoint:
    """A special point as few harmonics have it, a little beside that of all of them."""
    problem, u, tangent = start
    how = replace(method, harmonics=max(method.highest // 2, 1)
                  if point.kind == "period doubling" else method.highest)
    step = options.step
    near = replace(options, points=2 * _AROUND + 1, largest_step=step, bounds=(-np.inf, np.inf),
                   stop_at=(), events={}, progress=None, locate=True)
    found = harmonic_branches.followed((problem, u - _AROUND * step * tangent, tangent), how, near,
                                       None).of_kind(str(point.kind))
    if not found:
        raise AnalysisError(f"{point.place} is none with {how.highest} harmonics; take more.")
    return min(found, key=lambda one: abs(one.parameter - point.parameter))


def _collocated(field: VectorField, point: BranchPoint, method: Method) -> starts.Start:
    """Orbit and direction of the branch, by collocation, of a point found by another method."""
    problem: Any
    problem, u, tangent = _restored(field, point)
    motions = [replace(point, u=there, values={**point.values, "period": problem.period(there)})
               .orbit(field, _SAMPLES) for there in (u, u + _ALONG * tangent)]
    at = motions[0]
    values, d = point.parameter_values(field), field.dimension
    intervals, degree = _mesh_of(method)
    found, nodes = starts.from_samples(
        field, values, problem.free, at.times, at.states, at.period,
        intervals if isinstance(method, Collocation) else _INTERVALS, degree, at.periods,
        np.append(problem.scales[:d], problem.scales[-1]))
    return found, nodes, starts.along(found, nodes, motions[1], _ALONG)


def _restored(field: VectorField, point: BranchPoint) -> tuple[Any, Array, Array]:
    """Problem, unknowns and tangent of a point of a branch of orbits, by its method."""
    if point.by_harmonics:
        return harmonic_starts.restored(field, point)
    return (restored_shooting if point.by_shooting else restored)(field, point)


def _goes_on(
    field: VectorField, point: BranchPoint, method: Method | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
    both: bool,
) -> Branch:
    """Continue a branch of orbits from one of its points."""
    sign = float(np.copysign(1.0, direction))
    if point.by_harmonics:
        assert method is None or isinstance(method, HarmonicBalance)
        return harmonic_branches.goes_on(field, point, method, options, scales, width, sign, both)
    if point.by_shooting:
        return shooting_branches.goes_on(
            field, point, method.rtol if isinstance(method, Shooting) else None, options, scales,
            width, sign, both)
    limits = None if scales is not None else point.branch.attributes.get("limits")
    problem, u, tangent = restored(field, point)
    problem = replace(rescaled(problem, scales, width), limits=limits)
    chosen: Any = method if isinstance(method, Collocation) else _method_of(point)
    problem, u, tangent = _on_own_intervals((problem, u, tangent), chosen)
    problem, u, tangent = problem.adapted(u, sign * tangent)
    return _followed((problem, u, tangent), chosen, options, limits, both=both)


def _on_own_intervals(start: starts.Start, method: Collocation) -> starts.Start:
    """The start on the intervals of the method, or on more where its orbit needs them."""
    problem, u, _ = start
    count, sizes = method.intervals, _sizes(method)
    if sizes is not None:
        error = state_error(problem, u)
        count = sizes.at_start(problem.intervals, error, problem.degree)
    return starts.on_intervals(start, count)


def _sizes(method: Collocation) -> Intervals | None:
    """Numbers of intervals along a branch; None where they are kept."""
    if method.state_tolerance is None:
        return None
    return Intervals(int(method.intervals), int(method.most_intervals), method.state_tolerance)


def attributes_of(problem: CollocationProblem, limits: Array | None) -> dict[str, Any]:
    """Attributes of a branch of orbits by collocation, besides its points."""
    field = problem.field
    kept: dict[str, Any] = {
        "state_names": list(field.state_names), "parameter_names": list(field.parameters),
        "parameter_values": problem.values, "scales": problem.scales, "degree": problem.degree,
        "periods": problem.periods, "intervals": problem.intervals}
    return kept if limits is None else kept | {"limits": limits}


def _followed(
    start: tuple[CollocationProblem, Array, Array | None], method: Collocation,
    options: ContinuationOptions, limits: Array | None, **how: Any,
) -> Branch:
    """Follow a branch by collocation and refine its special points."""
    problem, u, tangent = start
    field = problem.field
    attributes = attributes_of(problem, limits) | {
        "intervals": int(method.intervals), "tolerance": method.tolerance,
        "most_intervals": method.most_intervals}
    sizes, newton = _sizes(method), options.tolerance
    if sizes is not None:
        attributes["state_tolerance"] = sizes.tolerance
        newton = sizes.newton(newton)
    name = list(field.parameters)[problem.free]
    stops = [options.stop_at] if isinstance(options.stop_at, str) else list(options.stop_at)
    ended = replace(options, stop_at=[*stops, HALVING], tolerance=newton)
    # Locate special points coarsely here; they are refined below on meshes of their own.
    problem = replace(problem, limits=limits, precision=ROUGHLY, sizes=sizes)
    branch = continue_branch(problem, u, ended, name=name, tangent=tangent, attributes=attributes,
                             **how)
    if branch.points[-1].kind == HALVING and HALVING not in stops:
        branch = replace(branch, status=BranchStatus.CLOSED)
    points = list(branch.points)
    accuracy = Accuracy(method.tolerance, int(method.intervals), int(method.most_intervals))
    try:
        for index, point in enumerate(branch.points):
            if point.kind in SHARPENED:
                points[index] = _sharpened(field, branch, index, accuracy)
    except KeyboardInterrupt:
        branch = replace(branch, status=BranchStatus.INTERRUPTED)
    said = "" if sizes is None else sizes.note(points)
    return replace(branch, points=tuple(points),
                   message=" ".join(filter(None, (branch.message, said))))


def _sharpened(
    field: VectorField, branch: Branch, index: int, accuracy: Accuracy
) -> BranchPoint:
    """A special point, refined on the mesh of its own orbit."""
    point = branch.points[index]
    before = next((one for one in branch.points[index::-1] if one.kind is None), branch.points[-1])
    return sharpened(point, restored(field, point), restored(field, before), accuracy)


# How a start by collocation is followed by each method.
_FOLLOWED: dict[type, Callable[..., Branch]] = {
    Collocation: _followed, Shooting: shooting_branches.followed,
    HarmonicBalance: harmonic_branches.followed}
