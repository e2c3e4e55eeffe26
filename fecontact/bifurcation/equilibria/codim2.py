"""Curves of folds and of Hopf points of equilibria in two parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.equilibria.codim2_problems import (
    FoldCurve,
    HopfCurve,
    PlaneCurve,
    hopf_borders,
    scaled,
)
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, default_scales
from fecontact.bifurcation.equilibria.normal_forms import critical_pair, null_vectors
from fecontact.bifurcation.equilibria.problem import equilibrium_at
from fecontact.bifurcation.fields.vector_field import VectorField, require_field
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array

_GROWTH = 1e4


def fold_curve(
    field: VectorField, parameters: tuple[str, str], point: BranchPoint | Equilibrium, *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    options: ContinuationOptions | None = None, scales: ArrayLike | None = None, both: bool = True,
) -> Branch:
    """Curve of folds of equilibria in two parameters.

    Each point stores both parameters by name, 'state' and 'unstable_besides', the number of
    eigenvalues with positive real part besides the one that is zero. Special points are 'cusp',
    'Bogdanov-Takens' and 'zero-Hopf'.

    Parameters
    ----------
    field : VectorField
        Its rates must not depend on time.
    parameters : (str, str)
        Those that change; the others stay as they are at the point.
    point : BranchPoint or Equilibrium
        The fold, on a branch of equilibria.
    bounds : mapping, optional
        Range of each parameter; the curve ends there. They also set the width of the diagram.
    options : ContinuationOptions, optional
        How the curve is followed.
    scales : sequence, optional
        Sizes (d,) of the states in the diagram; by default they grow with the states.
    both : bool
        Go to both sides.

    Raises
    ------
    InputError
        If a parameter is unknown, or there is no fold near the point, or it is none of a branch of
        equilibria.
    """
    begin, active, sizes, limits, widths = _beginning(field, parameters, point, bounds, scales)
    v, w = null_vectors(scaled(begin.jacobian, sizes))
    problem = FoldCurve(field, begin.values, active, np.concatenate([sizes, widths]),
                        np.concatenate([limits, widths]), w, v)
    u = np.concatenate([begin.state, begin.values[list(active)]])
    return _followed(problem, u, parameters, bounds, options, both, ())


def hopf_curve(
    field: VectorField, parameters: tuple[str, str], point: BranchPoint | Equilibrium, *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    options: ContinuationOptions | None = None, scales: ArrayLike | None = None, both: bool = True,
) -> Branch:
    """Curve of Hopf points in two parameters, such as the border of flutter or stick-slip.

    Each point stores both parameters by name, 'state', 'frequency_hz', 'first_lyapunov' (see
    :func:`fecontact.bifurcation.equilibria.normal_forms.hopf`) and 'unstable_besides', the number
    of eigenvalues with positive real part besides the critical pair. Special points are 'Bautin'
    (generalised Hopf), 'double Hopf', 'zero-Hopf' and 'Bogdanov-Takens', where the curve ends.

    The parameters are those of :func:`fold_curve`, the point being a Hopf point.

    Raises
    ------
    InputError
        If a parameter is unknown, or there is no Hopf point near the point.
    """
    begin, active, sizes, limits, widths = _beginning(field, parameters, point, bounds, scales)
    if not (begin.eigenvalues.imag > 0.0).any():
        raise InputError(f"There is no Hopf point near {parameters[0]} = "
                         f"{begin.values[active[0]]:.6g}: all eigenvalues are real.")
    square = critical_pair(begin.jacobian)[0].imag ** 2
    b, c = hopf_borders(scaled(begin.jacobian, sizes), square)
    problem = HopfCurve(field, begin.values, active, np.concatenate([sizes, [square], widths]),
                        np.concatenate([limits, [_GROWTH * square], widths]), b, c)
    u = np.concatenate([begin.state, [square], begin.values[list(active)]])
    return _followed(problem, u, parameters, bounds, options, both, ("Bogdanov-Takens",))


def _beginning(
    field: VectorField, parameters: tuple[str, str], point: BranchPoint | Equilibrium,
    bounds: Mapping[str, tuple[float, float]] | None, scales: ArrayLike | None,
) -> tuple[Equilibrium, tuple[int, int], Array, Array, list[float]]:
    """Start, indices of the parameters, sizes of the states, their limits, widths."""
    require_field(field)
    require_kind("A curve", Sequence, parameters=parameters)
    require_kind("A curve", (BranchPoint, Equilibrium), point=point)
    if isinstance(parameters, str) or len(parameters) != 2:
        raise InputError(f"A curve needs the names of two parameters, not {parameters!r}.")
    active = (field.index(parameters[0]), field.index(parameters[1]))
    if active[0] == active[1]:
        raise InputError(f"A curve needs two different parameters, not {parameters[0]!r} twice.")
    for name in bounds or {}:
        if name not in parameters:
            raise InputError(f"bounds are given for {name!r}, which is none of the parameters of "
                             f"the curve: {parameters[0]!r}, {parameters[1]!r}.")
    begin = point if isinstance(point, Equilibrium) else equilibrium_at(field, point)
    if scales is None:
        sizes = np.maximum(default_scales(begin), np.abs(begin.state))
        limits = _GROWTH * sizes
    else:
        sizes = limits = np.array(scales, dtype=float)
    widths = []
    for name, index in zip(parameters, active, strict=True):
        low, high = (bounds or {}).get(name, (-np.inf, np.inf))
        finite = np.isfinite(high - low)
        widths.append(high - low if finite else abs(float(begin.values[index])) or 1.0)
    return begin, active, sizes, limits, widths


def _followed(
    problem: PlaneCurve, u: Array, parameters: tuple[str, str],
    bounds: Mapping[str, tuple[float, float]] | None, options: ContinuationOptions | None,
    both: bool, ends: tuple[str, ...],
) -> Branch:
    chosen = options or ContinuationOptions()
    first = parameters[0]
    events = dict(chosen.events)
    borders: list[str] = []
    stops = [chosen.stop_at] if isinstance(chosen.stop_at, str) else [*chosen.stop_at]
    for bound in (bounds or {}).get(first, ()):
        if np.isfinite(bound):
            name = f"{first} = {bound:g}"
            events[name] = _distance(first, bound)
            borders.append(name)
    chosen = replace(chosen, events=events, stop_at=(*stops, *borders, *ends),
                     bounds=(bounds or {}).get(parameters[1], chosen.bounds))
    field = problem.field
    branch = continue_branch(problem, u, chosen, name=parameters[1], both=both, attributes={
        "parameters": list(parameters), "state_names": list(field.state_names)})
    points = tuple(replace(point, kind=None) if point.kind in borders else point
                   for point in branch.points)
    reached = branch.points[-1].kind in borders
    return replace(branch, points=points, status=BranchStatus.BOUND if reached else branch.status)


def _distance(name: str, bound: float) -> Any:
    return lambda stored: stored[name] - bound
