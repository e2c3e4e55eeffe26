"""Branches of periodic orbits from any start, by any of the three methods."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_that_goes
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import HopfPoint, require_no_family
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    options_of,
    require_direction,
    sizes_of,
    width_of,
)
from fecontact.bifurcation.continuation.pseudo_arclength import inside
from fecontact.bifurcation.fields.jumps import require_smooth_friction
from fecontact.bifurcation.orbit_methods import Collocation, Method
from fecontact.bifurcation.orbits import starts
from fecontact.bifurcation.orbits.curves.resonant import (
    AWAY,
    StrongResonance,
    is_single,
    of_several,
)
from fecontact.bifurcation.orbits.discretisation import Request
from fecontact.bifurcation.orbits.discretisations import (
    DISCRETISATIONS,
    discretisation_by,
    discretisation_of,
)
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.restored import rescaled, restored, restored_orbit
from fecontact.core.checks import require_flags, require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.fields.vector_field import VectorField, require_field

# Special points of orbits at which other orbits branch off.
_BRANCHING = ("period doubling", "branch point")
# Points of curves of tori around which orbits of several periods lie.
_STRONG = {"resonance 1:3": 3, "resonance 1:4": 4}

# Samples of an orbit by another method; distance, in the step length, of the neighbour that tells
# the direction there.
_SAMPLES, _ALONG = 8001, 1e-4


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
        The system; that of the branch if ``start`` is a point of one. Parameters have its base
        values, at points of branches those of the branch.
    start : BranchPoint, PeriodicMotion, Trajectory, FieldRun or (times, states)
        A Hopf point of equilibria; a period doubling or branch point of orbits; a resonance 1:3 or
        1:4 of a curve; any other point of a branch of orbits, to continue it; or a steady periodic
        motion. If the motion knows the value of the parameter that varies, the branch begins there.
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
    require_kind("orbit_branch", (*(one.options for one in DISCRETISATIONS), type(None)),
                 method=method)
    require_direction("orbit_branch", direction)
    require_flags("orbit_branch", both=both)
    request = Request(field, method, options_of(options, bounds), scales, width, direction, both)
    if not isinstance(start, BranchPoint):
        return _from_motion(as_motion(start), field.parameter_or_only(parameter), request)
    if isinstance(start, HopfPoint):
        _require_one_side(start, both)
        _require_parameter(start, parameter)
        return _from_hopf(start, request)
    if not start.is_orbit:
        raise InputError(f"{start.place} has no orbits to follow: take a point of the kind 'Hopf', "
                         f"or one of a branch of orbits.")
    require_no_family(start)
    known = start.branch.parameter_name
    name = known if parameter is None else field.parameter_or_only(parameter)
    if start.kind in _STRONG:
        return _around(start, name, request)
    if name == known and start.kind in _BRANCHING:
        if both and start.kind == "branch point":
            return _both_halves(start, request, lambda half: _beyond(start, half))
        _require_one_side(start, both)
        return _beyond(start, request)
    by = discretisation_of(start)
    if name == known and (method is None or (by is discretisation_by(method)
                          and by.suits(start, method))):
        return by.goes_on(start, request)
    if name == known:
        direction = direction * float(np.copysign(1.0, start.tangent[-1]))
    return _from_motion(start.orbit(field), name, replace(
        request, field=based(field, start.parameter_values(field)),
        method=method or start.method, direction=direction))


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


def method_of_several(at: StrongResonance) -> Collocation:
    """Collocation for a curve of tori: intervals for orbits of several periods near a resonance."""
    usual: Collocation = at.point.branch.method
    return replace(usual, intervals=at.order * at.orbit.intervals,
                   most_intervals=at.order * usual.most_intervals)


def _from_hopf(point: HopfPoint, request: Request) -> Branch:
    method = request.method or Collocation()
    by, field, options = discretisation_by(method), request.field, request.options
    by.require(field)
    return first_that_goes(
        starts.at_hopf(field, point, *by.mesh(method), options, request.scales, request.width),
        lambda found: by.followed(found[0], method, options, found[1]))


def values_of(
    motion: PeriodicMotion, field: VectorField, free: int, options: ContinuationOptions
) -> Array:
    """Parameter values (k,) of the field, the free one that of a motion which has it, in bounds."""
    given, known = field.values, motion.parameter_values
    if known is not None:
        if known.shape != given.shape:
            raise InputError(f"parameter_values of the motion must be {len(given)} numbers, one "
                             f"for each parameter of the field, not of shape {known.shape}.")
        given[free] = known[free]
    given[free] = inside(float(given[free]), options)
    return given


def based(field: VectorField, values: Array) -> VectorField:
    """The field with these base values (k,)."""
    return field.with_(dict(zip(field.parameters, values.tolist(), strict=True)))


def _from_motion(motion: PeriodicMotion, parameter: str, request: Request) -> Branch:
    field, options, method = request.field, request.options, request.method or Collocation()
    free = field.index(parameter)
    given = values_of(motion, field, free, options)
    sizes, limits = sizes_of(request.scales, motion.amplitudes + 1e-300)
    widths = np.append(sizes, width_of(request.width, options, given[free]))
    return discretisation_by(method).from_motion(
        starts.MotionStart(field, given, free, motion, widths, limits), request, method)


def _around(point: BranchPoint, name: str, request: Request) -> Branch:
    """Orbits of three or four periods around a strong resonance of a curve of tori."""
    first, second = map(str, point.branch.attributes["parameters"])
    if name not in (first, second):
        raise InputError(f"{point.place} is one over {first!r} and {second!r}: parameter = "
                         f"{name!r} must be one of them.")
    at = StrongResonance(request.field, point, second, _STRONG[str(point.kind)])
    place = at.names.index(name)
    chosen = replace(request, method=request.method or method_of_several(at), both=False,
                     width=request.width or float(at.widths[place]))

    def beside(half: Request, away: float) -> Branch:
        motion = of_several(at, half.sign * away * np.eye(2)[place])
        assert motion.parameter_values is not None
        branch = _from_motion(motion, name, replace(
            half, field=based(half.field, motion.parameter_values)))
        if is_single(branch.points[0], at.order):
            raise AnalysisError(f"{point.place}: no orbit of {at.order} periods was found there.")
        return branch

    def go(half: Request) -> Branch:
        return first_that_goes(AWAY, lambda away: beside(half, away))

    if not request.both:
        return go(chosen)
    return _both_halves(None, chosen, go)


def _both_halves(
    point: BranchPoint | None, request: Request, go: Callable[[Request], Branch]
) -> Branch:
    """Both halves of the other branch at a branch point, from end to end through it, if given."""
    options = replace(request.options, points=max(request.options.points // 2, 2))
    halves: list[Branch | None] = []
    failed: FecontactError = InputError("There is nothing to start from.")
    for side in (1.0, -1.0):
        try:
            half = go(replace(request, options=options, direction=side * request.sign,
                              both=False))
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


def _beyond(point: BranchPoint, request: Request) -> Branch:
    """The other orbits at a special point of a branch of orbits, by any method."""
    own = discretisation_of(point)
    chosen = request.method or point.method
    by = discretisation_by(chosen)
    if by is own and point.kind in own.own_starts:
        return own.beyond(point, request)
    require_smooth_friction(request.field)
    whole = own.options is Collocation and (by is not own or own.suits(point, chosen))
    problem, u, tangent = (restored(request.field, point) if whole
                           else _collocated(request.field, point, *by.mesh(chosen)))
    problem = rescaled(problem, request.scales, request.width)
    return by.beyond_on_mesh(point, (problem, u, tangent), request, chosen)


def _collocated(
    field: VectorField, point: BranchPoint, intervals: int, degree: int
) -> starts.Start:
    """Orbit and direction of the branch, by collocation, of a point found by another method."""
    problem, u, tangent = restored_orbit(field, point)
    motions = [replace(point, u=there, values={**point.values, "period": problem.period(there)})
               .orbit(field, _SAMPLES) for there in (u, u + _ALONG * tangent)]
    d = field.dimension
    start = starts.MotionStart(field, point.parameter_values(field), problem.free, motions[0],
                               np.append(problem.scales[:d], problem.scales[-1]))
    found, nodes = start.on_mesh(intervals, degree)
    return found, nodes, starts.along(found, nodes, motions[1], _ALONG)
