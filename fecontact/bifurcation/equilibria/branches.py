"""Branches of equilibria over one parameter, their folds, Hopf and branch points."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation.continuation.branch import Branch, BranchPoint
from fecontact.bifurcation.continuation.problem import Settings, settings_of, sizes_of, width_of
from fecontact.bifurcation.continuation.pseudo_arclength import follow
from fecontact.bifurcation.equilibria.equilibrium import (
    Equilibrium,
    find_equilibrium,
    require_autonomous,
)
from fecontact.bifurcation.equilibria.problem import EquilibriumProblem
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import VectorField, require_field
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array

_GROWTH = 1e4


def equilibrium_branch(
    field: VectorField,
    parameter: str,
    start: Equilibrium | ArrayLike | None = None,
    *,
    settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
    direction: float = 1.0,
    both: bool = False,
    scales: ArrayLike | None = None,
    width: float | None = None,
) -> Branch:
    """Follow an equilibrium over a parameter.

    Each point stores 'state' (d,), 'eigenvalues' (d,), 'unstable' (number of eigenvalues with
    positive real part) and 'stable'. Special points are

    - 'fold': with its null_vector and quadratic coefficient,
    - 'Hopf': angular_frequency, frequency_hz, period, eigenvector, crossing_speed (rate of the real
      part with the parameter), first_lyapunov and criticality
      ('supercritical', 'subcritical' or 'undecided', see
      :func:`fecontact.bifurcation.equilibria.normal_forms.hopf`),
    - 'branch point': null_vector, and other_tangent for :func:`switched_branch`,
    - 'unresolved': where 'unstable' changes from unstable_before to unstable_after, though none of
      the others was found.

    Parameters
    ----------
    field : VectorField
        Its rates must not depend on time.
    parameter : str
        The one that is varied.
    start : Equilibrium or (d,) sequence, optional
        Where to begin; see :func:`fecontact.bifurcation.equilibria.equilibrium.find_equilibrium`.
    settings : Settings, optional
        How the branch is followed.
    bounds : (float, float), optional
        Range of the parameter, as in the settings.
    direction : float
        Sign of the first change of the parameter.
    both : bool
        Go to both sides.
    scales : sequence, optional
        Sizes (d,) of the states in the diagram, for arclengths; by default those of the field or
        the largest state at the start, growing with the
        states up to 1e4 times that.
    width : float, optional
        Width of the diagram in the parameter; by default that of the bounds, or the size of the
        parameter at the start.

    Raises
    ------
    InputError
        If the parameter is unknown.
    AnalysisError
        If no equilibrium is found at the start, or the rates depend on time there or at a bound.
    """
    require_field(field)
    index = field.index(parameter)
    begin = _start(field, start)
    problem, chosen = _problem(field, begin, index, settings, bounds, scales, width)
    u = np.append(begin.state, begin.values[index])
    return follow(problem, u, chosen, name=parameter, direction=direction, both=both,
                  attributes=_attributes(field, begin))


def switched_branch(
    field: VectorField,
    parameter: str,
    point: BranchPoint,
    start: Equilibrium | None = None,
    *,
    settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
    both: bool = True,
    scales: ArrayLike | None = None,
    width: float | None = None,
    values: ArrayLike | None = None,
) -> Branch:
    """The other branch through a branch point of :func:`equilibrium_branch`.

    ``values`` (k,) are the parameter values of the branch, the field's base values by default;
    the other arguments as there.

    Raises
    ------
    InputError
        If the point is no branch point, or no second branch crosses there.
    """
    require_field(field)
    require_kind("switched_branch", BranchPoint, point=point)
    index = field.index(parameter)
    if "other_tangent" not in point.details:
        raise InputError(f"The point at {parameter} = {point.parameter:.6g} "
                         f"({point.kind or 'a regular point'}) has no second branch; give a "
                         f"special point of the kind 'branch point' with other_tangent.")
    given = field.values if values is None else np.array(values, dtype=float)
    given[index] = point.parameter
    begin = start or Equilibrium(field, given, np.ascontiguousarray(point.u[:-1]))
    problem, chosen = _problem(field, begin, index, settings, bounds, scales, width)
    tangent = np.asarray(point.details["other_tangent"], dtype=float)
    weights = problem.weights()
    tangent = tangent / np.sqrt(weights * tangent @ tangent)
    points: list[BranchPoint] = []
    ends = []
    for side in (-1.0, 1.0) if both else (1.0,):
        # The first step leaves the branch point, where the two directions cannot be told apart.
        first = point.u + side * chosen.step * tangent
        if not chosen.bounds[0] <= first[-1] <= chosen.bounds[1]:
            continue
        branch = follow(problem, first, chosen, name=parameter, tangent=side * tangent,
                        attributes=_attributes(field, begin))
        ends.append(branch)
        if side < 0.0:
            points = [replace(each, tangent=-each.tangent) for each in branch.points[::-1]]
            points.append(replace(point, tangent=tangent))
        else:
            points = [*(points or [replace(point, tangent=tangent)]), *branch.points]
    if not ends:
        raise InputError(f"The other branch leaves the bounds of {parameter} at once, at "
                         f"{point.parameter:.6g}; widen them.")
    return replace(ends[-1], points=tuple(points))


def _start(field: VectorField, start: Equilibrium | ArrayLike | None) -> Equilibrium:
    if isinstance(start, Equilibrium):
        require_autonomous(field, start.values)
        return start
    return find_equilibrium(field, start=start)


def _problem(
    field: VectorField, begin: Equilibrium, index: int, settings: Settings | None,
    bounds: tuple[float, float] | None, scales: ArrayLike | None, width: float | None,
) -> tuple[EquilibriumProblem, Settings]:
    chosen = settings_of(settings, bounds)
    for bound in map(float, chosen.bounds):
        # A parameter may be what drives the system, as an amplitude that begins at zero.
        there = begin.values.copy()
        there[index] = bound
        with suppress(InputError):
            if np.isfinite(bound):
                require_autonomous(field, there)
    width = width_of(width, chosen, begin.values[index])
    sizes = default_scales(begin) if scales is None else sizes_of(scales, begin.state)[0]
    limits = _GROWTH * sizes if scales is None else None
    return EquilibriumProblem(field, begin.values, index, sizes, width, limits), chosen


def default_scales(begin: Equilibrium) -> Array:
    """Sizes (d,) of the states, for arclengths and differences.

    Those of the field; for contact systems the largest displacement, and for velocities that
    times the frequency of the least damped mode.
    """
    field = begin.field
    if not isinstance(field, ContactField):
        return field.state_scales(begin.values)
    system = field.system(begin.values)
    m = system.basis.modes
    displacement = float(np.abs(begin.state[:m]).max()) or 1.0
    modes = begin.modes
    w = (float(np.abs(modes.eigenvalues[np.argmin(modes.damping_ratios)]))
         if len(modes.eigenvalues) else 1.0)
    return np.concatenate([np.full(m, displacement), np.full(m, w * displacement),
                           system.memory_scales])


def _attributes(field: VectorField, begin: Equilibrium) -> dict[str, Any]:
    return {"state_names": list(field.state_names), "parameter_names": list(field.parameters),
            "parameter_values": begin.values}
