"""Branches of periodic orbits: following them, and going over to others at special points."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation import orbit_starts
from fecontact.bifurcation.branch import Branch, BranchPoint
from fecontact.bifurcation.collocation import Collocation
from fecontact.bifurcation.continuation import Settings
from fecontact.bifurcation.follow import follow
from fecontact.bifurcation.vector_field import VectorField
from fecontact.errors import InputError

Array = NDArray[np.float64]


def orbits_from_hopf(
    field: VectorField, name: str, values: Array, state: Array, settings: Settings, *,
    intervals: int = 50, degree: int = 4, scales: ArrayLike | None = None,
) -> Branch:
    """The branch of orbits that is born at a Hopf point.

    Parameters
    ----------
    field : VectorField
    name : str
        The parameter.
    values : (k,) array
        All parameters at the Hopf point.
    state : (d,) array
        The equilibrium there; its Jacobian has a pair i w, whose eigenvector gives the first
        orbits.
    settings : Settings
        How the branch is followed.
    intervals, degree : int
        Collocation at ``degree`` Gauss points on each of so many intervals.
    scales : (d + 1,) sequence, optional
        What counts as one in the length of a step: amplitudes of the states, and the parameter.
        Without it those of the field, and the width of the settings' bounds.

    Returns
    -------
    Branch
        Stored of each orbit: period, Floquet multipliers, number outside the unit circle, mesh,
        minimum and maximum of each state. Special points: 'fold', 'period doubling',
        'Neimark-Sacker', 'branch point'.

    Raises
    ------
    InputError
        If the Jacobian has no pair near the imaginary axis, or there are no orbits near.
    """
    free = field.index(name)
    _, J, _ = field.derivatives(np.zeros(1), np.array([state], dtype=float), values)
    roots, vectors = np.linalg.eig(J[0])
    pairs = np.flatnonzero(roots.imag > 0.0)
    if not len(pairs):
        raise InputError(f"At {name} = {values[free]:.6g} no eigenvalues of the equilibrium are "
                         f"complex; orbits are born at Hopf points.")
    best = pairs[np.argmin(np.abs(roots[pairs].real))]
    if abs(roots[best].real) > 1e-4 * abs(roots[best]):
        raise InputError(f"At {name} = {values[free]:.6g} the eigenvalue nearest the imaginary "
                         f"axis is {roots[best]:.6g}; this is no Hopf point.")
    start = orbit_starts.from_hopf(field, values, free, state, float(roots[best].imag),
                                   vectors[:, best], intervals, degree,
                                   _scales(field, values, settings, scales))
    return _followed(start, settings)


def orbits_from_motion(
    field: VectorField, name: str, values: Array, times: ArrayLike, states: ArrayLike,
    settings: Settings, *, period: float | None = None, periods: int = 1, intervals: int = 50,
    degree: int = 4, scales: ArrayLike | None = None, direction: float = 1.0, both: bool = False,
) -> Branch:
    """The branch through the orbit to which a motion has settled.

    Parameters
    ----------
    times, states : (k,) and (k, d) array
        The motion, over at least one period; its end counts.
    period : float, optional
        Its period [s]; without it the last return to where the motion ends.
    periods : int
        Periods of the forcing in one of the orbit, for forced systems.
    direction, both
        See :func:`fecontact.bifurcation.follow.follow`.

    Other parameters and the result are those of :func:`orbits_from_hopf`.

    Raises
    ------
    InputError
        If the samples do not cover a period.
    AnalysisError
        If Newton's method finds no orbit near them.
    """
    free = field.index(name)
    problem, u = orbit_starts.from_samples(
        field, values, free, times, states, period, intervals, degree, periods,
        _scales(field, values, settings, scales))
    problem, u = orbit_starts.corrected(problem, u)
    return _followed((problem, u, None), settings, direction=direction, both=both)


def orbits_beyond(
    field: VectorField, branch: Branch, point: BranchPoint, settings: Settings, *,
    intervals: int | None = None, direction: float = 1.0,
) -> Branch:
    """The other branch at a special point of a branch of orbits.

    At a 'period doubling' it is that of the orbits of twice the period (with twice the intervals,
    unless ``intervals`` says otherwise), at a 'branch point' the one that crosses. ``direction``
    chooses the half of a branch that crosses.

    Raises
    ------
    InputError
        If no other orbits begin at a point of this kind.
    """
    problem, u, tangent = restored(field, branch, point)
    if point.kind == "period doubling":
        start = orbit_starts.doubled(problem, u, intervals)
    elif point.kind == "branch point":
        start = orbit_starts.crossing(problem, u, tangent)
    else:
        raise InputError(f"At the point of kind {point.kind!r} no other orbits begin; choose one "
                         f"of kind 'period doubling' or 'branch point'.")
    problem, u, tangent = start
    tangent = np.copysign(1.0, direction) * tangent / np.sqrt(problem.weights() @ tangent**2)
    # A little off the point, where the branches are apart.
    return _followed((problem, u + settings.step * tangent, tangent), settings)


def restored(
    field: VectorField, branch: Branch, point: BranchPoint
) -> tuple[Collocation, Array, Array]:
    """Problem, unknowns and tangent of a point of a branch of orbits, to go on from."""
    known = branch.attributes
    if "values" not in known or "mesh" not in point.values:
        raise InputError("The branch is not one of periodic orbits.")
    mesh, values = np.asarray(point.values["mesh"]), np.array(known["values"], dtype=float)
    values[field.index(branch.name)] = point.parameter
    degree, d = int(known["degree"]), field.dimension
    nodes = point.u[: (len(mesh) - 1) * degree * d].reshape(-1, d).copy()
    problem = Collocation(field, values, field.index(branch.name), mesh, degree, nodes,
                          np.asarray(known["scales"]), int(known["periods"]))
    return problem, point.u, point.tangent


def _scales(
    field: VectorField, values: Array, settings: Settings, given: ArrayLike | None
) -> Array:
    if given is not None:
        scales = np.asarray(given, dtype=float)
        if scales.shape != (field.dimension + 1,) or not (scales > 0.0).all():
            raise InputError(f"scales = {given!r} must hold {field.dimension + 1} numbers above "
                             f"zero: one for each state, and one for the parameter.")
        return scales
    width = settings.bounds[1] - settings.bounds[0]
    return np.append(field.state_scales(values), width if np.isfinite(width) else 1.0)


def _followed(
    start: tuple[Collocation, Array, Array | None], settings: Settings, **options: Any
) -> Branch:
    problem, u, tangent = start
    attributes: dict[str, Any] = {"values": problem.values, "scales": problem.scales,
                                  "degree": problem.degree, "periods": problem.periods}
    branch = follow(problem, u, settings, name=list(problem.field.parameters)[problem.free],
                    tangent=tangent, attributes=attributes, **options)
    return replace(branch, attributes=attributes)
