"""Special points of curves of orbits over two parameters on finer meshes, and their errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch, BranchStatus
from fecontact.bifurcation.continuation.newton import norm
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import details_of, with_details
from fecontact.bifurcation.orbits.curves.codim2 import OrbitCurve
from fecontact.bifurcation.orbits.curves.singularity import ContinuedSign
from fecontact.bifurcation.orbits.mesh import equidistributed
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.sharpening import LEAST_FALL, found_near, reach
from fecontact.core.types import Array

# Distance from the point before last, in the change from the last one, of a point that rounding
# moves to and fro: finer meshes do not make it more accurate.
_RETURNS = 0.1
# Names of the coefficients of a normal form and of their errors.
_FORM = ("normal_form", "normal_form_error")


class Finer(NamedTuple):
    """A curve on a finer mesh, unknowns and tangent."""

    problem: OrbitCurve
    u: Array
    tangent: Array


def with_errors(curve: OrbitCurve, branch: Branch, events: Sequence[str]) -> Branch:
    """The special points, each on intervals that suffice for both parameters, with their errors.

    The errors are the changes on twice the intervals, and normal forms those on the finest mesh.
    Where a point is not found there, the error is the change over the stretch that was searched,
    the branch's message names the point, and its normal form is left out.
    """
    points, missing = list(branch.points), []
    try:
        for index, point in enumerate(points):
            if point.kind is None or point.kind == HALVING or point.kind in events:
                continue
            points[index], found = _sharpened(curve, point, branch.attributes)
            if not found:
                missing.append(f"{point.kind} at {point.parameter:.6g}")
    except KeyboardInterrupt:
        branch = replace(branch, status=BranchStatus.INTERRUPTED)
    sizes = curve.orbit.sizes
    said = (f"On twice the intervals these special points are not found nearby: "
            f"{', '.join(missing)}." if missing else "")
    poor = "" if sizes is None else sizes.note(points)
    return replace(branch, points=tuple(points),
                   message=" ".join(filter(None, (branch.message, poor, said))))


def _sharpened(
    curve: OrbitCurve, point: BranchPoint, known: Mapping[str, Any]
) -> tuple[BranchPoint, bool]:
    """A special point on the first mesh that suffices, and whether twice the intervals have it.

    Each mesh has twice the intervals of the one before, up to the most of the start's branch, or
    until rounding alone moves the point.
    """
    method, widths = known["method"], curve.orbit.scales[-2:]
    most, allowed = int(method.most_intervals), method.tolerance * widths
    best, here, errors = point, point, np.zeros(2)
    place = _on_twice(curve, here)
    found = finer = found_near(place, str(point.kind))
    form = _form(here, finer)
    if found is None:
        errors = np.array([reach(place, -2), reach(place)])
    while finer is not None:
        errors = np.maximum(np.abs(finer.u[-2:] - here.u[-2:]), LEAST_FALL * errors)
        form = _form(here, finer)
        if np.linalg.norm((finer.u[-2:] - best.u[-2:]) / widths) < _RETURNS * np.linalg.norm(
                errors / widths):
            break
        best, here = here, finer
        if (errors <= allowed).all() or place.problem.orbit.intervals > most:
            break
        place = _on_twice(curve, here)
        finer = found_near(place, str(point.kind))
    second, first = errors.tolist()
    return (with_details(best, parameter_error=first, second_parameter_error=second, **form),
            found is not None)


def _form(point: BranchPoint, finer: BranchPoint | None) -> dict[str, Array]:
    """The normal form on the finer mesh, its change being part of its error; none without that."""
    one, other = ({} if at is None else details_of(at) for at in (point, finer))
    if not ("normal_form" in one and "normal_form" in other):
        return dict.fromkeys(_FORM, np.zeros(0)) if "normal_form" in one else {}
    value = np.asarray(other["normal_form"])
    before = np.asarray(one["normal_form"])
    # Rounding decides which of two critical pairs comes first.
    orders = (before, before[::-1]) if point.kind == "double Neimark-Sacker" else (before,)
    change = np.abs(value - min(orders, key=lambda form: float(np.abs(value - form).max())))
    return dict(zip(_FORM, (value, change + np.asarray(other["normal_form_error"])), strict=True))


def _on_twice(curve: OrbitCurve, point: BranchPoint) -> Finer:
    """The curve near a point, on twice its intervals."""
    mesh, d = np.asarray(point.values["mesh"], dtype=float), curve.orbit.field.dimension
    nodes = point.u[: (len(mesh) - 1) * curve.orbit.degree * d].reshape(-1, d).copy()
    orbit = replace(curve.orbit, mesh=mesh, reference=nodes, renewal=0, sizes=None)
    twice = equidistributed(mesh, orbit.nodes(point.u), orbit.degree, 2 * orbit.intervals)
    orbit, u, tangent = orbit.on_mesh(twice, point.u, point.tangent)
    problem = replace(curve, orbit=orbit, sign=ContinuedSign())
    return Finer(problem, u, tangent / norm(problem, tangent))
