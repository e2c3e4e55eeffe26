"""Switching at points of codimension two to the other curve of equilibria through them."""

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import DoubleHopfPoint, ZeroHopfPoint
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.ties import first_largest
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Smallest component of a tangent of length one that tells the sign of a parameter's change.
_RESTS = 1e-6


def other_curve(
    field: VectorField, point: BranchPoint, parameter: str
) -> tuple[Equilibrium, float | None]:
    """The equilibrium at a zero-Hopf, double Hopf or Bogdanov-Takens point of a curve, and the
    square of the angular frequency on the other curve through it; None if that is one of folds.

    Raises
    ------
    InputError
        If the curve is not over this second parameter, or does not know those of its field.
    """
    folds = point.branch.attributes["kind"] == "fold"
    values = values_at(field, point, parameter)
    begin = Equilibrium(field, values, np.ascontiguousarray(point.values["state"], dtype=float))
    if isinstance(point, DoubleHopfPoint):
        return begin, (2.0 * np.pi * point.second_frequency_hz) ** 2
    if isinstance(point, ZeroHopfPoint) and folds:
        return begin, (2.0 * np.pi * point.frequency_hz) ** 2
    if point.kind == "Bogdanov-Takens" and folds:
        return begin, 0.0
    return begin, None


def widths_of(point: BranchPoint) -> dict[str, float]:
    """Widths of the diagram in both parameters of the curve of a point, by name, second one first.

    Curves of orbits have them behind the scales of the states.
    """
    known = point.branch.attributes
    first, second = map(str, known["parameters"])
    width = np.asarray(known["widths" if "widths" in known else "scales"], dtype=float)[-2:]
    return dict(zip((second, first), width.tolist(), strict=True))


def values_at(field: VectorField, point: BranchPoint, parameter: str) -> Array:
    """Parameter values (k,) at a point of a curve of equilibria."""
    known = point.branch.attributes
    both = tuple(map(str, known["parameters"]))
    if parameter != both[1]:
        raise InputError(f"{point.place} is one over {both[0]!r} and {both[1]!r}: parameter = "
                         f"{parameter!r} must be the latter.")
    if "widths" not in known:
        raise InputError(f"{point.place} does not know the other parameters of its field: follow "
                         f"its curve once more.")
    return point._curve_values(field)


def tangent_at(problem: Problem, u: Array, direction: float) -> Array:
    """Tangent (N + 1,) of length one of a curve; ``direction`` as in the function codim2_curve.

    One parameter may rest where the curve starts; the other one then parametrises it.
    """
    linearised, weights = problem.linearise(u), problem.weights()
    found: list[Array] = []
    for place in (-1, -2):
        try:
            tangent = linearised.solve(unit(len(u), place), unit(len(u)))
        except FecontactError:
            continue
        size = float(np.sqrt(weights @ tangent**2))
        if np.isfinite(size) and size > 0.0:
            found.append(tangent / size)
    if not found:
        raise AnalysisError("The curve has no direction at its start: both parameters turn there. "
                            "Start from another point of it.")
    rates = [np.abs(tangent[-2:]) * np.sqrt(weights[-2:]) for tangent in found]
    tangent = found[first_largest([rate.max() for rate in rates])]
    first = abs(tangent[-1]) * np.sqrt(weights[-1]) > _RESTS
    return tangent * np.copysign(1.0, direction * tangent[-1 if first else -2])
