"""Branches of equilibria over one parameter, with folds, Hopf points and branch points."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import by_sides, continue_branch, labelled
from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.points import CrossingPoint
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    options_of,
    require_direction,
    sizes_of,
    width_of,
)
from fecontact.bifurcation.continuation.pseudo_arclength import End
from fecontact.bifurcation.equilibria.equilibrium import (
    Equilibrium,
    default_scales,
    find_equilibrium,
    require_autonomous,
)
from fecontact.bifurcation.equilibria.problem import EquilibriumProblem, equilibrium_at
from fecontact.core.checks import require_flags
from fecontact.core.errors import InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField, require_field

_GROWTH = 1e4


@one_blas_thread
def equilibrium_branch(
    field: VectorField,
    start: Equilibrium | BranchPoint | ArrayLike | None = None,
    parameter: str | None = None,
    *,
    options: ContinuationOptions | None = None,
    bounds: tuple[float, float] | None = None,
    direction: float = 1.0,
    both: bool | None = None,
    scales: ArrayLike | None = None,
    width: float | None = None,
) -> Branch:
    """Follow an equilibrium over a parameter.

    Each point stores 'state' (d,), 'eigenvalues' (d,), 'unstable' (number of eigenvalues with
    positive real part) and 'stable'. Special points are 'fold', 'Hopf', 'branch point' and
    'unresolved' (a change of 'unstable' without a zero of a test function); see the classes of
    points, such as :class:`fecontact.bifurcation.HopfPoint`, for what they add.

    Parameters
    ----------
    field : VectorField
        The system; its rates must not depend on time.
    start : Equilibrium, BranchPoint or (d,) sequence, optional
        An equilibrium or a guess, see :func:`fecontact.bifurcation.find_equilibrium`; a 'branch
        point', to follow the other branch through it; or another point of a branch of equilibria,
        to continue it.
    parameter : str, optional
        The parameter to vary; by default that of the point, or the only one of the field.
    options : ContinuationOptions, optional
        Step lengths, tolerances and stopping conditions.
    bounds : (float, float), optional
        Range of the parameter, in place of that of the options.
    direction : float
        Sign of the first change of the parameter; from a point, 1 goes forward along its branch and
        -1 back. From a branch point 1 goes where the parameter grows or, at a fork, the state that
        changes most.
    both : bool, optional
        Whether to go to both sides; by default only from a branch point.
    scales : (d,) sequence, optional
        Sizes of the states that count as one in the arclength; by default those of the field or the
        largest state at the start, growing with the states up to 1e4 times that.
    width : float, optional
        Parameter range that counts as one; by default that of the bounds, or that of the branch of
        the point, or the value at the start.

    Raises
    ------
    InputError
        If the parameter is unknown, or the point does not belong to a branch of equilibria.
    AnalysisError
        If no equilibrium is found at the start, or the rates depend on time there or at a bound.
    """
    require_field(field)
    require_direction("equilibrium_branch", direction)
    if both is not None:
        require_flags("equilibrium_branch", both=both)
    if isinstance(start, str):
        raise InputError(f"equilibrium_branch: start = {start!r} must be an equilibrium or a point "
                         f"of a branch; give the parameter by its name, parameter={start!r}.")
    tangent, crossed, known_width = None, None, None
    if isinstance(start, BranchPoint):
        known = start.branch.parameter_name
        parameter = known if parameter is None else parameter
        begin = equilibrium_at(field, start)
        if parameter == known:
            known_width = start.branch.attributes.get("width")
            crossed = start if isinstance(start, CrossingPoint) else None
            tangent = np.copysign(1.0, direction) * (
                start.tangent if crossed is None else crossed.other_tangent)
    else:
        begin = _start(field, start)
    parameter = field.parameter_or_only(parameter)
    index = field.index(parameter)
    chosen = options_of(options, bounds)
    width = width_of(width, chosen, begin.values[index], known_width)
    problem = _problem(field, begin, index, chosen, scales, width)
    u = np.append(begin.state, begin.values[index])
    attributes = {**attributes_of(field, begin.values), "width": width}
    if crossed is not None and tangent is not None:
        return _crossing(problem, crossed, tangent, chosen, parameter, both is not False,
                         attributes)
    return continue_branch(problem, u, chosen, name=parameter, tangent=tangent, direction=direction,
                           both=bool(both), attributes=attributes)


def _crossing(
    problem: EquilibriumProblem, point: BranchPoint, tangent: Array, options: ContinuationOptions,
    parameter: str, both: bool, attributes: dict[str, Any],
) -> Branch:
    """The other branch through a branch point."""
    weights = problem.weights()
    tangent = tangent / np.sqrt(weights * tangent @ tangent)

    def side(wanted: ContinuationOptions, *, turned: bool) -> tuple[list[BranchPoint], End]:
        ahead = -tangent if turned else tangent
        start = replace(point, tangent=ahead)
        # At the branch point the system is singular; correct the first step away from it.
        first = point.u + options.step * ahead
        if not options.bounds[0] <= first[-1] <= options.bounds[1]:
            return [start], End(BranchStatus.BOUND)
        found = continue_branch(problem, first, wanted, name=parameter, tangent=ahead)
        return [start, *found.points], End(found.status, found.message)

    points, end = by_sides(side, options, both=both)
    if len(points) == 1:
        raise InputError(f"The other branch leaves the bounds of {parameter} at once, at "
                         f"{point.parameter:.6g}; widen them.")
    return Branch(parameter, tuple(points), end.status, end.message,
                  labelled(problem, parameter, attributes))


def _start(field: VectorField, start: Equilibrium | ArrayLike | None) -> Equilibrium:
    if isinstance(start, Equilibrium):
        require_autonomous(field, start.values)
        return start
    return find_equilibrium(field, start=start)


def _problem(
    field: VectorField, begin: Equilibrium, index: int, options: ContinuationOptions,
    scales: ArrayLike | None, width: float,
) -> EquilibriumProblem:
    for bound in map(float, options.bounds):
        # The parameter may be the excitation itself, as an amplitude that starts at zero.
        there = begin.values.copy()
        there[index] = bound
        with suppress(InputError):
            if np.isfinite(bound):
                require_autonomous(field, there)
    sizes = default_scales(begin) if scales is None else sizes_of(scales, begin.state)[0]
    limits = _GROWTH * sizes if scales is None else None
    return EquilibriumProblem(field, begin.values, index, np.append(sizes, width), limits)
