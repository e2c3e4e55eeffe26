"""Branches of periodic orbits: following them, and going over to others at special points."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation.continuation.branch import Branch, BranchPoint, Status, require_on_branch
from fecontact.bifurcation.continuation.problem import Settings, settings_of, sizes_of, width_of
from fecontact.bifurcation.continuation.pseudo_arclength import follow, require_inside
from fecontact.bifurcation.continuation.sharpening import ROUGHLY, SHARPENED, sharpened
from fecontact.bifurcation.equilibria.branches import default_scales
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import VectorField, require_field
from fecontact.bifurcation.orbits import starts
from fecontact.bifurcation.orbits.collocation import Collocation
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.shooting import shooting_from
from fecontact.bifurcation.orbits.starts import from_samples
from fecontact.core.checks import as_floats
from fecontact.core.errors import (
    AnalysisError,
    FecontactError,
    InputError,
    require_finite,
)
from fecontact.core.types import Array

# Parts of the first step that are tried one after the other to leave a special point.
_FIRST = (1.0, 0.2, 0.04)


def orbits_from_hopf(
    field: VectorField, branch: Branch, point: BranchPoint, *, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None, intervals: int = 50, degree: int = 4,
    scales: ArrayLike | None = None, width: float | None = None,
) -> Branch:
    """The branch of orbits that is born at a Hopf point.

    Parameters
    ----------
    field : VectorField
        The system, with the parameters by which it was followed before.
    branch, point : Branch, BranchPoint
        A branch of equilibria, and a special point of the kind 'Hopf' on it.
    settings : Settings, optional
        How the branch is followed.
    bounds : (float, float), optional
        Range of the parameter, as in the settings.
    intervals, degree : int
        Collocation at ``degree`` Gauss points on each of so many intervals.
    scales : (d,) sequence, optional
        Amplitudes of the states that count as one in the length of a step. Without them they are
        those of the field, and grow with the orbits.
    width : float, optional
        Width of the diagram in the parameter; by default that of the bounds.

    Returns
    -------
    Branch
        Stored of each orbit: 'period' [s], 'multipliers' (d,), 'unstable' (number of those
        outside the unit circle), 'trivial_error' (distance from one of the multiplier that is
        one), 'mesh' (N + 1,), 'minimum' and 'maximum' (d,) of the states. Special points:

        - 'fold': with parameter_error, by which its parameter changes on a finer mesh,
        - 'period doubling' and 'Neimark-Sacker': with coefficient, coefficient_error,
          criticality ('supercritical', 'subcritical' or 'undecided') and parameter_error, see
          :mod:`fecontact.bifurcation.orbits.normal_forms` and
          :func:`fecontact.bifurcation.continuation.sharpening.sharpened`,
        - 'branch point': where two branches of orbits cross, with parameter_error as well,
        - 'unresolved': where 'unstable' changes though nothing of the kind was found; or what
          instead_of says on this mesh alone, though finer ones do not have it.

    Raises
    ------
    InputError
        If the point is no Hopf point, or there are no orbits near it.
    """
    require_field(field)
    require_on_branch("orbits_from_hopf", branch, point)
    if point.kind != "Hopf":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g} is "
                         f"{point.kind or 'a regular point'!r}, but orbits are born at points of "
                         f"the kind 'Hopf'.")
    free = field.index(branch.name)
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    values[free] = point.parameter
    state = np.ascontiguousarray(point.u[:-1])
    chosen = settings_of(settings, bounds)
    sizes, limits = sizes_of(scales, default_scales(Equilibrium(field, values, state)))
    widths = np.append(sizes, width_of(width, chosen, point.parameter))
    for amplitude in starts.AMPLITUDES:
        start = starts.from_hopf(
            field, values, free, state, float(point.details["angular_frequency"]),
            point.details["eigenvector"], intervals, degree, widths, amplitude)
        try:
            return _followed(start, chosen, limits)
        except FecontactError as error:
            failed = error
    raise failed


def orbits_from_motion(
    field: VectorField, parameter: str, times: ArrayLike, states: ArrayLike, *,
    values: ArrayLike | None = None, period: float | None = None, periods: int = 1,
    settings: Settings | None = None, bounds: tuple[float, float] | None = None,
    intervals: int = 50, degree: int = 4, scales: ArrayLike | None = None,
    width: float | None = None, direction: float = 1.0, both: bool = False,
) -> Branch:
    """The branch through the orbit to which a motion has settled.

    Parameters
    ----------
    parameter : str
        The one that is varied.
    times, states : (k,) and (k, d) array
        The motion, over at least one period; its end counts.
    values : (k,) sequence, optional
        Parameters of the motion, the base values of the field by default.
    period : float, optional
        Its period [s]; without it the last return to where the motion ends.
    periods : int
        Periods of the forcing in one of the orbit, for forced systems.
    direction, both
        Sign of the first change of the parameter; whether to go to both sides.

    field, settings, bounds, intervals, degree, scales, width
        See :func:`orbits_from_hopf`, and there for the result; the scales are the amplitudes of
        the motion by default.

    Raises
    ------
    InputError
        If the samples do not cover a period.
    AnalysisError
        If Newton's method finds no orbit near them.
    """
    require_field(field)
    free = field.index(parameter)
    given = field.values if values is None else np.array(values, dtype=float)
    chosen = settings_of(settings, bounds)
    amplitudes = np.ptp(np.asarray(states, dtype=float), axis=0) / 2.0
    sizes, limits = sizes_of(scales, np.maximum(amplitudes, 1e-3 * amplitudes.max()) + 1e-300)
    problem, u = starts.corrected(*starts.from_samples(
        field, given, free, times, states, period, intervals, degree, periods,
        np.append(sizes, width_of(width, chosen, given[free]))))
    return _followed((problem, u, None), chosen, limits, direction=direction, both=both)


def orbits_beyond(
    field: VectorField, branch: Branch, point: BranchPoint, *, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None, intervals: int | None = None,
    direction: float = 1.0,
) -> Branch:
    """The other branch at a special point of a branch of orbits.

    At a 'period doubling' it is that of the orbits of twice the period (with twice the intervals,
    unless ``intervals`` says otherwise), at a 'branch point' the one that crosses. ``direction``
    chooses the half of a branch that crosses. The others are those of :func:`orbits_from_hopf`.

    Raises
    ------
    InputError
        If no other orbits begin at a point of this kind.
    """
    require_field(field)
    require_on_branch("orbits_beyond", branch, point)
    require_finite("orbits_beyond", direction=direction)
    problem, u, tangent = restored(field, branch, point)
    chosen = settings_of(settings, bounds)
    if point.kind == "period doubling":
        problem, u, tangent = starts.doubled(problem, u, intervals)
    elif point.kind == "branch point":
        problem, u, tangent = starts.crossing(problem, u, tangent)
    else:
        raise InputError(f"At the point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, no other orbits begin; choose one "
                         f"of the kind 'period doubling' or 'branch point'.")
    tangent = np.copysign(1.0, direction) * tangent / np.sqrt(problem.weights() @ tangent**2)
    # The first step leaves the point, where the branches cannot be told apart; the new one may be
    # strongly bent there.
    for part in _FIRST:
        step = max(part * chosen.step, chosen.smallest_step)
        try:
            return _followed((problem, u + step * tangent, tangent), replace(chosen, step=step),
                             None)
        except InputError as error:
            failed = error
    raise failed


def restored(
    field: VectorField, branch: Branch, point: BranchPoint
) -> tuple[Collocation, Array, Array]:
    """Problem, unknowns and tangent of a point of a branch of orbits, to go on from."""
    known = branch.attributes
    if "degree" not in known or "mesh" not in point.values:
        raise InputError("The branch is not one of periodic orbits.")
    mesh, values = np.asarray(point.values["mesh"]), np.array(known["parameter_values"],
                                                                  dtype=float)
    values[field.index(branch.name)] = point.parameter
    degree, d = int(known["degree"]), field.dimension
    nodes = point.u[: (len(mesh) - 1) * degree * d].reshape(-1, d).copy()
    problem = Collocation(field, values, field.index(branch.name), mesh, degree, nodes,
                          np.asarray(known["scales"]), int(known["periods"]))
    return problem, point.u, point.tangent


def _followed(
    start: tuple[Collocation, Array, Array | None], settings: Settings, limits: Array | None,
    **options: Any,
) -> Branch:
    problem, u, tangent = start
    field = problem.field
    attributes: dict[str, Any] = {
        "state_names": list(field.state_names), "parameter_names": list(field.parameters),
        "parameter_values": problem.values, "scales": problem.scales, "degree": problem.degree,
        "periods": problem.periods}
    name = list(field.parameters)[problem.free]
    stops = [settings.stop_at] if isinstance(settings.stop_at, str) else list(settings.stop_at)
    ended = replace(settings, stop_at=[*stops, HALVING])
    # What is special is located once more below, on a mesh of its own.
    branch = follow(replace(problem, limits=limits, precision=ROUGHLY), u, ended, name=name,
                    tangent=tangent, attributes=attributes, **options)
    if branch.points[-1].kind == HALVING and HALVING not in stops:
        branch = replace(branch, status=Status.CLOSED)
    points = list(branch.points)
    try:
        for index, point in enumerate(branch.points):
            if point.kind in SHARPENED:
                points[index] = _sharpened(field, branch, index)
    except KeyboardInterrupt:
        branch = replace(branch, status=Status.INTERRUPTED)
    return replace(branch, points=tuple(points))


def _sharpened(field: VectorField, branch: Branch, index: int) -> BranchPoint:
    """A special point located once more, on the mesh that suits its own orbit."""
    point = branch.points[index]
    before = next((one for one in branch.points[index::-1] if one.kind is None), branch.points[-1])
    return sharpened(point, restored(field, branch, point), restored(field, branch, before))


def orbits_by_shooting(
    field: ContactField, parameter: str, times: ArrayLike, states: ArrayLike, *,
    values: ArrayLike | None = None, period: float | None = None, periods: int = 1,
    settings: Settings | None = None, bounds: tuple[float, float] | None = None,
    segments: int = 4, rtol: float = 1e-9, derivative_rtol: float | None = None,
    scales: ArrayLike | None = None, width: float | None = None, direction: float = 1.0,
    both: bool = False,
) -> Branch:
    """The branch through the orbit to which a motion of a contact system has settled.

    By multiple shooting with the compiled integrator, for steep friction and many states, where
    collocation (:func:`fecontact.bifurcation.orbits.branches.orbits_from_motion`) needs many
    intervals. The stored values have the same names; minimum and maximum are those of samples, and
    period doublings come without normal forms.

    Parameters
    ----------
    field : ContactField
        From :func:`fecontact.contact_field`.
    parameter : str
        The one that is varied.
    times, states : (k,) and (k, d) array
        The motion, over at least one period; its end counts. Orbits whose period is unknown begin
        where it is fastest, if it is at least two periods long.
    segments : int
        Pieces of the period, each run for itself: more of them for unstable orbits.
    rtol : float
        Relative tolerance of the runs.
    derivative_rtol : float, optional
        That of their derivatives, as for :func:`fecontact.sensitivity`. With many fast modes that
        the motion hardly excites, 1e-2 saves most of the time, and changes their small multipliers
        alone; with impacts it spoils all of them.
    values, period, periods, settings, bounds, scales, width, direction, both
        See :func:`fecontact.bifurcation.orbits.branches.orbits_from_motion`.

    Raises
    ------
    InputError
        If the samples do not cover a period, the field is not one of a contact system, or the
        bounds exclude the start.
    AnalysisError
        If Newton's method finds no orbit near them.
    """
    require_field(field)
    free = field.index(parameter)
    given = field.values if values is None else np.array(values, dtype=float)
    chosen = settings_of(settings, bounds)
    require_inside(float(given[free]), chosen)
    motion = as_floats(times, "times"), as_floats(states, "states")
    if motion[1].ndim != 2 or motion[1].size == 0:
        raise InputError(f"states must be those of a motion (k, d), not of shape "
                         f"{motion[1].shape}.")
    amplitudes = np.ptp(motion[1], axis=0) / 2.0
    sizes, _ = sizes_of(scales, np.maximum(amplitudes, 1e-3 * amplitudes.max()) + 1e-300)
    if (period is not None and isinstance(field, ContactField)
            and motion[1].shape == (motion[0].size, field.dimension)
            and field.forcing_period(given) is None):
        motion = _to_fastest(*motion, sizes, period, field.system().basis.modes)
    found = from_samples(field, given, free, *motion, period, 200, 4, periods,
                         np.append(sizes, width_of(width, chosen, given[free])))
    problem, u = shooting_from(*found, segments, rtol, derivative_rtol)
    attributes = {"state_names": list(field.state_names), "parameter_names": list(field.parameters),
                  "parameter_values": given, "scales": problem.scales, "segments": segments,
                  "periods": periods, "rtol": rtol}
    if derivative_rtol is not None:
        attributes["derivative_rtol"] = derivative_rtol
    try:
        return follow(problem, u, chosen, name=parameter, direction=direction, both=both,
                      attributes=attributes)
    except (AnalysisError, InputError) as error:
        raise AnalysisError(f"No periodic orbit was found at {parameter} = {given[free]:.6g} near "
                            f"the motion: Newton's method does not converge; run it longer until "
                            f"it has settled, or take more than {segments} segments.") from error


def _to_fastest(
    times: Array, states: Array, sizes: Array, period: float, modes: int
) -> tuple[Array, Array]:
    """The motion up to where it was fastest, within a period before its end.

    There the phase is fixed best; beside transitions of stick and slip an orbit that is guessed
    is far off.
    """
    last = np.flatnonzero(times > times[-1] - period)
    if len(last) == 0 or times[last[0]] - times[0] < period:
        return times, states
    speeds = np.linalg.norm(states[last, modes : 2 * modes] / sizes[:modes], axis=1)
    end = last[np.argmax(speeds)] + 1
    return times[:end], states[:end]
