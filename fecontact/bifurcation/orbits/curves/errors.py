"""Errors of the special points of curves of orbits over two parameters, from a finer mesh."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch, BranchStatus
from fecontact.bifurcation.continuation.newton import norm
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import details_of, with_details
from fecontact.bifurcation.continuation.sharpening import found_near, reach
from fecontact.bifurcation.orbits.codim2 import OrbitCurve
from fecontact.bifurcation.orbits.curves.singularity import ContinuedSign
from fecontact.bifurcation.orbits.mesh import equidistributed
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.core.types import Array

# Names of the coefficients of a normal form and of their errors.
_FORM = ("normal_form", "normal_form_error")


class Finer(NamedTuple):
    """A curve on a finer mesh, unknowns and tangent."""

    problem: OrbitCurve
    u: Array
    tangent: Array


def with_errors(curve: OrbitCurve, branch: Branch, events: Sequence[str]) -> Branch:
    """The special points with the change of both parameters on twice the intervals as their errors.

    Normal forms are those on the finer mesh. Of points that are not found there the errors are the
    changes over the stretch that was searched, and the branch's message tells of them; their normal
    forms are left out.
    """
    points, missing = list(branch.points), []
    try:
        for index, point in enumerate(points):
            if point.kind is None or point.kind == HALVING or point.kind in events:
                continue
            place = _on_twice(curve, point)
            finer = found_near(place, point.kind)
            if finer is None:
                first, second = reach(place), reach(place, -2)
                missing.append(f"{point.kind} at {point.parameter:.6g}")
            else:
                first, second = (abs(float(finer.u[k] - point.u[k])) for k in (-1, -2))
            points[index] = with_details(point, parameter_error=first,
                                         second_parameter_error=second, **_form(point, finer))
    except KeyboardInterrupt:
        branch = replace(branch, status=BranchStatus.INTERRUPTED)
    said = (f"On twice the intervals these special points are not found nearby: "
            f"{', '.join(missing)}." if missing else "")
    return replace(branch, points=tuple(points),
                   message=" ".join(filter(None, (branch.message, said))))


def _form(point: BranchPoint, finer: BranchPoint | None) -> dict[str, Array]:
    """The normal form on the finer mesh, its change being part of its error; none without that."""
    one, other = ({} if at is None else details_of(at) for at in (point, finer))
    if not ("normal_form" in one and "normal_form" in other):
        return dict.fromkeys(_FORM, np.zeros(0)) if "normal_form" in one else {}
    value = np.asarray(other["normal_form"])
    change = np.abs(value - np.asarray(one["normal_form"]))
    return dict(zip(_FORM, (value, change + np.asarray(other["normal_form_error"])), strict=True))


def _on_twice(curve: OrbitCurve, point: BranchPoint) -> Finer:
    """The curve near a point, on twice its intervals."""
    mesh, d = np.asarray(point.values["mesh"], dtype=float), curve.orbit.field.dimension
    nodes = point.u[: (len(mesh) - 1) * curve.orbit.degree * d].reshape(-1, d).copy()
    orbit = replace(curve.orbit, mesh=mesh, reference=nodes, before=(), renewal=0)
    twice = equidistributed(mesh, orbit.nodes(point.u), orbit.degree, 2 * orbit.intervals)
    orbit, u, tangent = orbit.on_mesh(twice, point.u, point.tangent)
    problem = replace(curve, orbit=orbit, sign=ContinuedSign())
    return Finer(problem, u, tangent / norm(problem, tangent))
