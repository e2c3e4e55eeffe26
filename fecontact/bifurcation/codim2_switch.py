"""Switching at points of codimension two: the curve of folds of orbits at a Bautin point."""

import numpy as np

from fecontact.bifurcation.continuation.points import BranchPoint, FoldPoint, HopfPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, newton
from fecontact.bifurcation.fields.vector_field import VectorField
from fecontact.bifurcation.orbits.branches import orbit_branch
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array

# Distances from the Bautin point along the second parameter, in the width of the diagram, at which
# the fold is looked for, and the range of the first parameter about the Hopf point there.
_AWAY, _ABOUT = (0.02, 0.05, 0.005), 0.1
_TOLERANCE = 1e-12
_SEARCH = ContinuationOptions(step=2e-3, largest_step=0.02, points=150, stop_at=("fold",))


def fold_at_bautin(field: VectorField, point: BranchPoint) -> FoldPoint:
    """A fold of orbits beside a Bautin point of a curve of Hopf points.

    Near the point the amplitude r of the orbits satisfies b + l1 r^2 + l2 r^4 = 0 with the distance
    b from the curve: on the side with l1 l2 < 0 they turn at r^2 = -l1 / (2 l2) (Kuznetsov, Elements
    of Applied Bifurcation Theory, section 8.3). Both sides are tried, at one value of the second
    parameter, from the Hopf point on.

    Raises
    ------
    InputError
        If the curve does not know the parameters of its field.
    AnalysisError
        If no fold is found on either side.
    """
    known = point.branch.attributes
    if "widths" not in known:
        raise InputError(f"{point.place} does not know the other parameters of its field: follow "
                         f"its curve once more.")
    second = str(known["parameters"][1])
    values = field.values
    for name, value in zip(known["parameter_names"], np.asarray(known["parameter_values"]),
                           strict=True):
        values[field.index(str(name))] = value
    values[field.index(point.branch.parameter_name)] = point.parameter
    width = np.asarray(known["widths"])
    for away in _AWAY:
        for side in (1.0, -1.0):
            values[field.index(second)] = point.u[-2] + side * away * width[0]
            try:
                found = _fold(field, point, values.copy(), float(width[1]))
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
