"""Curves of special points over two parameters."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from fecontact.bifurcation.codim2_nearby import begun, on_its_curve
from fecontact.bifurcation.codim2_switch import other_curve, tangent_at, widths_of
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.continuation.newton import newton
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import (
    DiscontinuityPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    require_no_family,
)
from fecontact.bifurcation.continuation.problem import (
    ContinuationOptions,
    Problem,
    options_of,
    require_direction,
)
from fecontact.bifurcation.equilibria.codim2 import critical_square, equilibrium_curve
from fecontact.bifurcation.equilibria.problem import equilibrium_at
from fecontact.bifurcation.events.curves import border_curve
from fecontact.bifurcation.homoclinic.starts import homoclinic_curve
from fecontact.bifurcation.orbits.curves.codim2 import OrbitCurve, orbit_curve
from fecontact.bifurcation.orbits.curves.errors import with_errors
from fecontact.core.checks import require_flags, require_kind
from fecontact.core.errors import (
    AnalysisError,
    FecontactError,
    InputError,
    shown,
)
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField, require_field

# Points beyond which a curve is one of neutral saddles, by its kind.
_ENDS = {"Hopf": ("Bogdanov-Takens",), "Neimark-Sacker": ("resonance 1:1", "resonance 1:2")}
# Points of curves of equilibria through which another one passes.
_CROSSINGS = ("zero-Hopf", "double Hopf", "Bogdanov-Takens")
# Part of the first step at which a curve begins that leaves a point to one side.
_BESIDE = 4e-4
# Distances, in first steps, at which the two sides of such a start are compared; the first one at
# which the curve has points on both sides counts.
_SIDES = (1.0, 0.3, 0.1, 0.01, 1e-3)
# Part of a range within which a start on its end may lie beside it.
_ON_BOUND = 1e-9


@one_blas_thread
def codim2_curve(
    field: VectorField, point: BranchPoint, parameter: str, *,
    options: ContinuationOptions | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None, scales: ArrayLike | None = None,
    direction: float = 1.0, both: bool = True, keep: Literal["kind", "period"] = "kind",
    to: str | None = None,
) -> Branch:
    """Follow a special point over two parameters, such as the border of flutter or stick-slip.

    The page docs/bifurcation.md lists the stored values and special points of each kind of curve.

    Parameters
    ----------
    field : VectorField
        The system, with both parameters. For equilibria its rates must not depend on time.
    point : FoldPoint, HopfPoint, PeriodDoublingPoint, NeimarkSackerPoint, DiscontinuityPoint
        A point of a branch over the first parameter, of orbits by collocation or between events; a
        point of a curve, which it continues, or one such as 'zero-Hopf', where other curves begin.
    parameter : str
        The second parameter.
    options : ContinuationOptions, optional
        Steps, tolerances, stopping conditions; bounds of parameters without ``bounds``.
    bounds : mapping, optional
        Range of each parameter by name, ``{"B": (0.0, 30.0)}``, at which the curve ends; it also
        scales the arclength (by default the branch does, or the values at the point).
    scales : (d,) sequence, optional
        Sizes of the states that count as one in the arclength; by default they grow with the states
        of equilibria, and are those of the branch for orbits.
    direction : float
        Sign of the first change of the first parameter, or of the second where the first is
        constant.
    both : bool
        Go to both sides; the points then run from one end of the curve to the other.
    keep : 'kind' or 'period'
        Common property of the points; 'period' takes any orbit of a system without excitation.
    to : str, optional
        Kind of curve, where several begin, such as 'homoclinic', also from orbits of long period.

    Returns
    -------
    Branch
        With ``parameter_names`` (first, second); each point stores both by name.

    Raises
    ------
    InputError
        If the point starts no curve or lies outside the bounds, or a parameter is unknown.
    AnalysisError
        If the curve has no direction at the point.
    """
    require_field(field)
    require_kind("codim2_curve", BranchPoint, point=point)
    require_kind("codim2_curve", str, parameter=parameter)
    require_kind("codim2_curve", (Mapping, type(None)), bounds=bounds)
    require_direction("codim2_curve", direction)
    require_kind("codim2_curve", (str, type(None)), to=to)
    require_flags("codim2_curve", both=both)
    if not (isinstance(keep, str) and keep in ("kind", "period")):
        raise InputError(f"codim2_curve: keep = {shown(keep)} must be 'kind' or 'period'.")
    if keep == "period" and to is not None:
        raise InputError(f"codim2_curve: keep = 'period' takes the orbit itself, and to = {to!r} "
                         f"another curve; leave one of them out.")
    require_no_family(point)
    given = point
    point = on_its_curve(given, keep, to)
    goes_on = point is not given
    if keep == "kind" and not goes_on:
        point = begun(field, point, parameter, to)
    homoclinic = to == "homoclinic" or point.is_homoclinic
    crossing = point.kind in _CROSSINGS
    if keep == "kind" and not (crossing or homoclinic) and not isinstance(
            point, FoldPoint | HopfPoint | PeriodDoublingPoint | NeimarkSackerPoint
            | DiscontinuityPoint) and point.kind != "neutral saddle":
        raise InputError(f"{point.place} starts no curve; take a point of the kind 'fold', 'Hopf', "
                         f"'period doubling', 'Neimark-Sacker' or 'Bautin', a border that "
                         f"set-valued orbits meet, or an orbit with keep='period'.")
    if keep == "period" and not point.is_orbit:
        raise InputError(f"{point.place} is no orbit, whose period keep='period' could keep.")
    if keep == "period" and isinstance(point, DiscontinuityPoint):
        raise InputError(f"{point.place} is a border of set-valued orbits, which keep='period' "
                         f"cannot leave; leave keep out to follow the border.")
    names = (point.branch.parameter_name, parameter)
    field.index(parameter)
    if names[0] == parameter:
        raise InputError(f"codim2_curve: parameter = {parameter!r} is that of the branch; name "
                         f"another one.")
    ranges = _ranges(names, bounds)
    chosen = options_of(options, ranges.get(names[0]))
    widths = {name: high - low for name, (low, high) in ranges.items() if np.isfinite(high - low)}
    if goes_on or (point is not given and not given.is_orbit):
        widths = {**widths_of(given), **widths}
    problem: Problem
    grows: Callable[[Array], float] | None = None
    kind = "period" if keep == "period" else str(point.kind)
    if homoclinic:
        kind = "homoclinic"
        problem, u, attributes = homoclinic_curve(field, point, parameter, widths, scales)
    elif isinstance(point, DiscontinuityPoint):
        problem, u, attributes = border_curve(field, point, parameter, widths, scales)
    elif point.is_orbit:
        # Neutral saddles too have two multipliers whose product is one.
        curve, u, attributes = orbit_curve(field, point, parameter, widths, scales, (
            "Neimark-Sacker" if kind == "neutral saddle" else kind))
        problem = curve
        if given.kind == "resonance 1:1" and kind == "Neimark-Sacker":
            # To the other side lie neutral saddles, whose multipliers are real.
            grows = lambda u: -curve.linearise(u).singularity.cosine  # noqa: E731
    else:
        if crossing:
            begin, square = other_curve(field, point, parameter)
            widths = {**widths_of(point), **widths}
        else:
            begin = equilibrium_at(field, point)
            square = critical_square(begin, point)
            # The tangent is at most as long as the diagram is wide; the value may be near zero.
            along = max(abs(float(point.tangent[-1])), abs(point.parameter))
            widths = {names[0]: along or 1.0, **widths}
        kind = "fold" if square is None else "Hopf"
        problem, u, attributes = equilibrium_curve(begin, names, square, widths, scales)
        # Beyond a Bogdanov-Takens point the curve is one of neutral saddles.
        grows = (lambda u: float(u[field.dimension])) if square == 0.0 else None
    attributes |= {"parameters": list(names), "kind": kind,
                   "state_names": list(field.state_names)}
    return _followed(problem, u, names, chosen, ranges.get(parameter, chosen.second_bounds),
                     direction=direction, both=both, attributes=attributes, grows=grows)


def _ranges(
    names: tuple[str, str], bounds: Mapping[str, tuple[float, float]] | None
) -> dict[str, tuple[float, float]]:
    """The bounds as given, checked."""
    found = {}
    for name, given in (bounds or {}).items():
        if name not in names:
            raise InputError(f"bounds are given for {name!r}, which is none of the parameters of "
                             f"the curve: {names[0]!r}, {names[1]!r}.")
        try:
            low, high = (float(value) for value in given)
            fine = low < high
        except (TypeError, ValueError):
            fine = False
        if not fine:
            raise InputError(f"bounds[{name!r}] = {given!r} must be two values of the parameter, "
                             f"the smaller one first.")
        found[name] = low, high
    return found


def _followed(
    problem: Problem, u: Array, names: tuple[str, str], options: ContinuationOptions,
    second: tuple[float, float], *, direction: float, both: bool, attributes: dict[str, Any],
    grows: Callable[[Array], float] | None,
) -> Branch:
    """The curve through u = [..., second parameter, first parameter], within both ranges.

    It goes to the side alone on which ``grows`` of the unknowns is larger, if that is given.
    """
    value, size = float(u[-2]), float(np.ptp(second)) if np.isfinite(second).all() else 1.0
    near = _ON_BOUND * size
    if not second[0] - near <= value <= second[1] + near:
        raise InputError(f"The start lies at {names[1]} = {value:.6g}, outside its bounds, "
                         f"{second[0]:g} to {second[1]:g}.")
    u[-2] = min(max(value, second[0]), second[1])
    ends = _ENDS.get(attributes["kind"], ())
    chosen = replace(options, stop_at=(*options.stop_at, *ends), second_bounds=second)
    if isinstance(problem, OrbitCurve) and problem.orbit.sizes is not None:
        chosen = replace(chosen, tolerance=problem.orbit.sizes.newton(chosen.tolerance))
    tangent = tangent_at(problem, u, direction)
    if grows is not None:
        tangent = _towards_growth(problem, u, tangent, chosen, grows)
        u, both = u + _BESIDE * options.step * tangent, False
    curve = continue_branch(problem, u, chosen, name=names[0], tangent=tangent, both=both,
                            attributes=attributes)
    if not isinstance(problem, OrbitCurve):
        return curve
    return with_errors(problem, curve, list(options.events))


def _towards_growth(
    problem: Problem, u: Array, tangent: Array, options: ContinuationOptions,
    grows: Callable[[Array], float],
) -> Array:
    """Direction of the curve to the side on which ``grows`` of the unknowns is larger.

    At a point of codimension two the equations may have more than one direction, and rounding then
    decides which part of the other ones the tangent has. Therefore ``grows`` is compared at points
    of the curve itself, a step away from u on both sides, or nearer where there are none; the
    direction is that from one of them to the other.

    Raises
    ------
    AnalysisError
        If Newton's method reaches no points of the curve beside u.
    """
    row = problem.weights() * tangent
    for part in _SIDES:
        try:
            behind, ahead = (newton(problem, u + side * part * options.step * tangent, row,
                                       options.tolerance, 2 * options.iterations)
                             for side in (-1.0, 1.0))
        except FecontactError:
            continue
        if behind is not None and ahead is not None:
            one, other = behind[0], ahead[0]
            chord = one - other if grows(one) > grows(other) else other - one
            return np.asarray(chord / weighted_norm(problem.weights(), chord))
    raise AnalysisError(f"The curve has no points within {_SIDES[0] * options.step:.3g} of its "
                        f"start on both sides; start from another point of it, or with a shorter "
                        f"step than step = {options.step:g}.")
