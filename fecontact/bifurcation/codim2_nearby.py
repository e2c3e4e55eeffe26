"""Curves of orbits that begin at points of codimension two; a point of each is sought."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.codim2_resonances import (
    fold_at_third,
    folds_at_quarter,
    neutral_saddle_at_third,
)
from fecontact.bifurcation.codim2_switch import (
    other_curve,
    tangent_at,
    values_at,
    widths_of,
)
from fecontact.bifurcation.continuation.attempts import first_found
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint, attributes_of
from fecontact.bifurcation.continuation.points import (
    DoubleHopfPoint,
    FoldPoint,
    HopfPoint,
    ZeroHopfPoint,
    over_first,
    special_point,
)
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    Problem,
)
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.equilibria.codim2 import equilibrium_curve
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, default_scales, newton
from fecontact.bifurcation.equilibria.normal_forms import hopf
from fecontact.bifurcation.orbit_methods import Collocation
from fecontact.bifurcation.orbits.branches import orbit_branch
from fecontact.bifurcation.orbits.curves.codim2 import orbit_curve
from fecontact.core.errors import AnalysisError, InputError, choices
from fecontact.core.ties import first_largest, first_least
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Distances from the Bautin point along the second parameter, in the width of the diagram, at which
# the fold is sought, and the range of the first parameter about the Hopf point there.
_AWAY, _ABOUT = (0.02, 0.05, 0.005), 0.1
_TOLERANCE = 1e-12
_SEARCH = ContinuationOptions(step=2e-3, largest_step=0.02, points=150, stop_at=("fold",))


def fold_at_bautin(field: VectorField, point: BranchPoint, parameter: str) -> FoldPoint:
    """A fold of orbits beside a Bautin point of a curve of Hopf points.

    Near the point the amplitude r of the orbits satisfies b + l1 r^2 + l2 r^4 = 0 with the distance
    b from the curve: on the side with l1 l2 < 0 they turn at r^2 = -l1 / (2 l2) (Kuznetsov,
    Elements of Applied Bifurcation Theory, section 8.3). Both sides are tried, at one value of the
    second parameter, from the Hopf point on.

    Raises
    ------
    InputError
        If the curve is not over this second parameter, or does not know those of its field.
    AnalysisError
        If no fold is found on either side.
    """
    values, index = values_at(field, point, parameter), field.index(parameter)
    width = widths_of(point)

    def find(away: float) -> FoldPoint | None:
        values[index] = point.u[-2] + away * width[parameter]
        return _fold(field, point, values.copy(), width[point.branch.parameter_name])

    return first_found((side * away for away in _AWAY for side in (1.0, -1.0)), find,
                       f"{point.place}: no fold of orbits was found beside it; follow orbits from "
                       f"a Hopf point near it to their fold, and start from there.")


def _fold(
    field: VectorField, point: BranchPoint, values: Array, width: float
) -> FoldPoint | None:
    """The fold of the orbits at one value of the second parameter, if there is one."""
    state = np.ascontiguousarray(np.asarray(point.values["state"], dtype=float))
    rest = newton(field, state, values, _TOLERANCE)
    if rest is None:
        return None
    about = (point.parameter - _ABOUT * width, point.parameter + _ABOUT * width)
    branch = equilibrium_branch(field, Equilibrium(field, values, rest[0]),
                                point.branch.parameter_name, bounds=about, both=True, width=width)
    hopf = branch.of_kind("Hopf")
    if not hopf:
        return None
    away = [abs(at.frequency_hz - float(point.values["frequency_hz"])) for at in hopf]
    orbits = orbit_branch(field, hopf[first_least(away)], options=_SEARCH, bounds=about,
                          width=width)
    end = orbits.points[-1]
    return end if isinstance(end, FoldPoint) else None


# Steps along the curve of Hopf points away from a point of codimension two, in widths of the
# diagram, and the points of it, one after the other, from which orbits are followed.
_STEPS = ContinuationOptions(step=5e-3, largest_step=0.02, points=6, locate=False)
_CHOSEN = (2, 5, 1)
_TORI = replace(_SEARCH, stop_at=("Neimark-Sacker",), largest_step=0.05, points=60)
_LONG = replace(_SEARCH, stop_at=(), largest_step=0.1, points=200)
_INTERVALS = 40
# Least scale of a state of an orbit that has grown, in the largest one.
_EVEN = 0.1


def nearby_torus(field: VectorField, point: BranchPoint, parameter: str) -> BranchPoint:
    """A Neimark-Sacker point of the orbits with the frequency of a zero-Hopf or double Hopf point.

    Near a double Hopf point, with r1' = r1 (m1 + p11 r1^2 + p12 r2^2) and likewise r2, the orbits
    r1^2 = -m1 / p11 lose stability to a torus at m2 = p21 m1 / p11 (Kuznetsov, Elements of Applied
    Bifurcation Theory, section 8.6). Near a zero-Hopf point, with u' = m1 + b u^2 + c r^2 and
    r' = r (m2 + d u), they do at u = m2 = 0 if c d < 0 (section 8.5). They are followed from Hopf
    points on both sides.

    Raises
    ------
    InputError
        As :func:`fecontact.bifurcation.codim2_switch.other_curve`.
    AnalysisError
        If c d > 0, or none is found on either side.
    """
    assert isinstance(point, ZeroHopfPoint | DoubleHopfPoint)
    form = point.normal_form if isinstance(point, ZeroHopfPoint) else {}
    if form and form["c"] * form["d"] > 0.0:
        raise AnalysisError(f"{point.place}: no tori begin there; its normal form has c d = "
                            f"{form['c'] * form['d']:.4g}, which must be below 0.")
    square = (2.0 * np.pi * point.frequency_hz) ** 2
    return _first(field, point, parameter, square, _TORI,
                  lambda branch: branch.points[-1].kind == "Neimark-Sacker",
                  "no torus was found beside it; follow orbits from a Hopf point near it, and "
                  "start from their Neimark-Sacker point.")


def nearby_homoclinic(field: VectorField, point: BranchPoint, parameter: str) -> BranchPoint:
    """An orbit next to a homoclinic one, beside a Bogdanov-Takens point.

    Raises
    ------
    InputError
        As :func:`nearby_torus`.
    AnalysisError
        If none is found.
    """
    return _first(field, point, parameter, 0.0, _LONG,
                  lambda branch: branch.status is BranchStatus.HOMOCLINIC,
                  "no homoclinic orbit was found beside it; follow orbits from a Hopf point near "
                  "it, and start from their end.")


def _first(
    field: VectorField, point: BranchPoint, parameter: str, square: float,
    options: ContinuationOptions, wanted: Callable[[Branch], bool], missing: str,
) -> BranchPoint:
    """The end of the first branch of orbits that is wanted, from Hopf points beside a point.

    Raises
    ------
    AnalysisError
        If there is none; ``missing`` says so.
    """
    begin = other_curve(field, point, parameter)[0]
    width, first = widths_of(point), point.branch.parameter_name
    problem, u, _ = equilibrium_curve(begin, (first, parameter), square, width, None)
    tangent = tangent_at(problem, u, 1.0)
    if square == 0.0:
        tangent = np.copysign(1.0, tangent[field.dimension]) * tangent
    beside = list(_along(problem, u, tangent, first, both=square != 0.0))
    # Tori of some zero-Hopf points lie across the other parameter alone, or beyond where orbits
    # over one parameter go on over the other one, forward or back.
    across = _across(tangent, first, parameter, width)
    sides = (0.0, 1.0, -1.0) if isinstance(point, ZeroHopfPoint) else (0.0,)
    tried = [(over, at, side) for side in sides
             for over in sorted(width, key=lambda name: name != across) for at in beside]

    def find(attempt: tuple[str, BranchPoint, float]) -> BranchPoint | None:
        over, at, side = attempt
        reach = _ABOUT * width[over]
        hopf_point = _hopf_at(field, begin, at, (first, parameter), over)
        branch = orbit_branch(
            field, hopf_point, method=Collocation(_INTERVALS), options=options,
            bounds=(hopf_point.parameter - reach, hopf_point.parameter + reach),
            width=width[over])
        if side != 0.0:
            over, = {first, parameter} - {over}
            end = branch.points[-1]
            value = float(end.parameter_values(field)[field.index(over)])
            reach = _ABOUT * width[over]
            # The orbit has become much larger than those at the Hopf point.
            sizes = np.asarray(end.values["maximum"]) - np.asarray(end.values["minimum"])
            branch = orbit_branch(
                field, end, over, options=options, direction=side,
                scales=np.maximum(sizes, _EVEN * sizes.max()),
                bounds=(value - reach, value + reach), width=width[over])
        return _over(field, branch.points[-1], first, width[first]) if wanted(branch) else None

    return first_found(tried, find, f"{point.place}: {missing}")


def _across(tangent: Array, first: str, second: str, width: Mapping[str, float]) -> str:
    """The parameter over which a curve with this tangent is crossed."""
    along = abs(tangent[-2]) / width[second], abs(tangent[-1]) / width[first]
    return (first, second)[first_largest(along)]


def _along(
    problem: Problem, u: Array, tangent: Array, name: str, *, both: bool = True,
    attributes: dict[str, Any] | None = None,
) -> Iterator[BranchPoint]:
    """Points of a curve beside its start, on both sides or ahead."""
    sides = [continue_branch(problem, u, _STEPS, name=name, tangent=side * tangent,
                             attributes=attributes).points for side in (1.0, -1.0)[: 1 + both]]
    for place in _CHOSEN:
        yield from (points[place] for points in sides if place < len(points))


def _over(field: VectorField, point: BranchPoint, name: str, width: float) -> BranchPoint:
    """A point of a branch of orbits as one of a branch over another parameter."""
    if point.branch.parameter_name == name:
        return point
    values = point.parameter_values(field)
    scales = np.array(point.branch.attributes["scales"], dtype=float)
    scales[-1] = width
    header = BranchHeader(name, {**point.branch.attributes, "parameter_values": values,
                                 "scales": scales})
    u = np.append(point.u[:-1], values[field.index(name)])
    return special_point(u, np.zeros_like(u), point.values, point.kind, {}, header)


def _hopf_at(
    field: VectorField, begin: Equilibrium, at: BranchPoint, names: tuple[str, str], over: str
) -> HopfPoint:
    """A point of a curve of Hopf points as one of a branch over one of both parameters."""
    values = begin.values.copy()
    for name, value in zip(names, at.u[[-1, -2]].tolist(), strict=True):
        values[field.index(name)] = value
    state = np.ascontiguousarray(at.u[: field.dimension])
    there = Equilibrium(field, values, state)
    w = float(np.sqrt(at.u[field.dimension]))
    found = hopf(field, state, values, default_scales(there), 1j * w)
    header = BranchHeader(over, attributes_of(field, values))
    u = np.append(state, values[field.index(over)])
    made = special_point(u, np.zeros_like(u), {"state": state}, "Hopf", found.details, header)
    assert isinstance(made, HopfPoint)
    return made


def of_doubled(field: VectorField, point: BranchPoint, kind: str) -> BranchPoint:
    """A fold or a Neimark-Sacker point of the doubled orbits beside a point of codimension two.

    At a generalised period doubling, where the multiplier -1 obeys b a + c a^3 + e a^5 on the
    orbits beyond, these turn at a^2 = -c / (2 e); at a resonance 1:2 a torus may begin on them
    (Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.4 and 9.5).

    Raises
    ------
    AnalysisError
        If none is found on either side.
    """
    single = over_first(point, "period doubling")
    first, width = point.branch.parameter_name, widths_of(point)
    second = str(point.branch.attributes["parameters"][1])
    problem, u, attributes = orbit_curve(field, single, second, width, None, "period doubling")
    attributes |= {"parameters": [first, second]}
    tangent = tangent_at(problem, u, 1.0)
    over = _across(tangent, first, second, width)
    reach = _ABOUT * width[over]

    def find(at: BranchPoint) -> BranchPoint | None:
        begin = _over(field, over_first(at, "period doubling"), over, width[over])
        branch = orbit_branch(field, begin, options=replace(_TORI, stop_at=(kind,)),
                              bounds=(begin.parameter - reach, begin.parameter + reach))
        end = branch.points[-1]
        return _over(field, end, first, width[first]) if end.kind == kind else None

    return first_found(_along(problem, u, tangent, first, attributes=attributes), find,
                       f"{point.place}: no {kind} of doubled orbits was found beside it; follow "
                       f"these from a period doubling near it.")


def _over_that_of(field: VectorField, point: BranchPoint, found: BranchPoint) -> BranchPoint:
    """An orbit beside a point of a curve, as one of a branch over the curve's first parameter."""
    first = point.branch.parameter_name
    return _over(field, found, first, widths_of(point)[first])


_Found = Callable[[VectorField, BranchPoint, str], BranchPoint]
# Curves of orbits that begin at points of curves, by the kind of the point and of the curve; the
# first of a point is that which is followed without being named, where no curve of equilibria is.
BEGIN: Mapping[str, Mapping[str, _Found]] = {
    "Bautin": {"fold": fold_at_bautin},
    "zero-Hopf": {"Neimark-Sacker": nearby_torus},
    "double Hopf": {"Neimark-Sacker": nearby_torus},
    "Bogdanov-Takens": {"homoclinic": nearby_homoclinic},
    "generalised period doubling": {
        "fold": lambda field, point, parameter: of_doubled(field, point, "fold")},
    "resonance 1:1": {
        "fold": lambda field, point, parameter: over_first(point, "fold"),
        "Neimark-Sacker": lambda field, point, parameter: over_first(point, "Neimark-Sacker")},
    "resonance 1:2": {
        "period doubling": lambda field, point, parameter: over_first(point, "period doubling"),
        "Neimark-Sacker": lambda field, point, parameter: of_doubled(
            field, point, "Neimark-Sacker")},
    "resonance 1:3": {
        "fold": lambda field, point, parameter: _over_that_of(
            field, point, fold_at_third(field, point, parameter)),
        "neutral saddle": neutral_saddle_at_third},
    "resonance 1:4": {
        "fold": lambda field, point, parameter: _over_that_of(
            field, point, folds_at_quarter(field, point, parameter, 1.0)),
        "other fold": lambda field, point, parameter: _over_that_of(
            field, point, folds_at_quarter(field, point, parameter, -1.0))},
}
# Points of which a curve of equilibria is followed without a curve being named.
_OF_EQUILIBRIA = ("zero-Hopf", "double Hopf", "Bogdanov-Takens")


# Curves that any of their points continues.
_GO_ON = ("fold", "Hopf", "period doubling", "Neimark-Sacker")


def on_its_curve(point: BranchPoint, keep: str, to: str | None) -> BranchPoint:
    """A point of a curve over two parameters as one that starts it again, over the first.

    Points of other branches, and those at which another curve is named or begins by itself, are
    returned as they are.
    """
    known = point.branch.attributes
    kind = known.get("kind")
    if "parameters" not in known:
        return point
    if keep == "period" and point.is_orbit:
        return over_first(point, None)
    begins = point.kind in BEGIN or point.kind in _OF_EQUILIBRIA
    if keep == "kind" and kind in _GO_ON and to is None and not begins:
        return over_first(point, str(kind))
    return point


def begun(field: VectorField, point: BranchPoint, parameter: str, to: str | None) -> BranchPoint:
    """The point from which a curve is followed: itself, or one of the orbits that begin there.

    Raises
    ------
    InputError
        If no such curve begins at the point.
    AnalysisError
        If none is found.
    """
    known = BEGIN.get(str(point.kind), {})
    if to is None and (not known or point.kind in _OF_EQUILIBRIA):
        return point
    if to is not None and to not in known:
        if to == "homoclinic" and (point.is_orbit or point.is_homoclinic):
            return point
        others = (f"known are: {choices(known)}" if known else
                  "leave it out to follow the curve on which the point lies")
        raise InputError(f"{point.place}: no curve to = {to!r} begins there; {others}.")
    return known[to or next(iter(known))](field, point, parameter)
