"""Switching at points of codimension two to the other curves that pass or begin there."""

import numpy as np

from fecontact.bifurcation.continuation.points import (
    BranchPoint,
    DoubleHopfPoint,
    FoldPoint,
    HopfPoint,
    ZeroHopfPoint,
)
from fecontact.bifurcation.continuation.problem import ContinuationOptions
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, newton
from fecontact.bifurcation.orbits.branches import orbit_branch
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Distances from the Bautin point along the second parameter, in the width of the diagram, at which
# the fold is looked for, and the range of the first parameter about the Hopf point there.
_AWAY, _ABOUT = (0.02, 0.05, 0.005), 0.1
_TOLERANCE = 1e-12
_SEARCH = ContinuationOptions(step=2e-3, largest_step=0.02, points=150, stop_at=("fold",))


def other_curve(
    field: VectorField, point: BranchPoint, parameter: str
) -> tuple[Equilibrium, float | None]:
    """The equilibrium at a zero-Hopf, double Hopf or Bogdanov-Takens point of a curve, and the
    square of the angular frequency on the other curve through it; None if that is one of folds.

    Raises
    ------
    InputError
        If the curve is not over this second parameter, or does not know those of its field, or
        the point is Bogdanov and Takens' on a curve of folds.
    """
    folds = point.branch.attributes["kind"] == "fold"
    if point.kind == "Bogdanov-Takens" and folds:
        raise InputError(f"{point.place} on a curve of folds starts no other curve here; start the "
                         f"curve of Hopf points from a Hopf point beside it.")
    values = _values(field, point, parameter)
    begin = Equilibrium(field, values, np.ascontiguousarray(point.values["state"], dtype=float))
    if isinstance(point, DoubleHopfPoint):
        return begin, (2.0 * np.pi * point.second_frequency_hz) ** 2
    if isinstance(point, ZeroHopfPoint) and folds:
        return begin, (2.0 * np.pi * point.frequency_hz) ** 2
    return begin, None


def widths_of(point: BranchPoint) -> dict[str, float]:
    """Widths of the diagram in both parameters of the curve of a point, by name."""
    first, second = map(str, point.branch.attributes["parameters"])
    width = np.asarray(point.branch.attributes["widths"], dtype=float).tolist()
    return {second: width[0], first: width[1]}


def _values(field: VectorField, point: BranchPoint, parameter: str) -> Array:
    """Parameter values (k,) at a point of a curve of equilibria."""
    known = point.branch.attributes
    both = tuple(map(str, known["parameters"]))
    if parameter != both[1]:
        raise InputError(f"{point.place} is one over {both[0]!r} and {both[1]!r}: parameter = "
                         f"{parameter!r} must be the latter.")
    if "widths" not in known:
        raise InputError(f"{point.place} does not know the other parameters of its field: follow "
                         f"its curve once more.")
    values = field.values
    for name, value in zip(known["parameter_names"], np.asarray(known["parameter_values"]),
                           strict=True):
        values[field.index(str(name))] = value
    for name, value in zip(both, point.u[[-1, -2]].tolist(), strict=True):
        values[field.index(name)] = value
    return values


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
    values, index = _values(field, point, parameter), field.index(parameter)
    width = widths_of(point)
    for away in _AWAY:
        for side in (1.0, -1.0):
            values[index] = point.u[-2] + side * away * width[parameter]
            try:
                found = _fold(field, point, values.copy(), width[point.branch.parameter_name])
            except FecontactError:
                continue
            if found is not None:
                return found
    raise AnalysisError(f"{point.place}: no fold of orbits was found beside it; follow orbits from "
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
    hopf: list[HopfPoint] = sorted(branch.of_kind("Hopf"), key=lambda at: abs(
        at.frequency_hz - float(point.values["frequency_hz"])))
    if not hopf:
        return None
    orbits = orbit_branch(field, hopf[0], options=_SEARCH, bounds=about, width=width)
    end = orbits.points[-1]
    return end if isinstance(end, FoldPoint) else None
