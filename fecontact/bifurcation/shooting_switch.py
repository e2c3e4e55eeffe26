"""Branches of orbits by shooting that begin on others: at Hopf points and period doublings."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation import orbit_starts
from fecontact.bifurcation.branch import Branch, BranchPoint, Status
from fecontact.bifurcation.contact_field import ContactField
from fecontact.bifurcation.equilibria import Equilibrium
from fecontact.bifurcation.equilibrium_branch import default_scales
from fecontact.bifurcation.follow import follow
from fecontact.bifurcation.interpolation import interpolate
from fecontact.bifurcation.orbit_options import settings_of, sizes_of, width_of
from fecontact.bifurcation.problem import Settings
from fecontact.bifurcation.shooting import Shooting, Shot, shooting_from
from fecontact.errors import InputError

Array = NDArray[np.float64]

# How a branch of doubled orbits ends that has come back to single ones.
_HALVING = "period halving"
# Part of their usual distance within which the two halves of an orbit are the same.
_SAME = 0.05


def restored_shooting(
    field: ContactField, branch: Branch, point: BranchPoint
) -> tuple[Shooting, Array]:
    """Problem and unknowns of a point of a branch of :func:`orbits_by_shooting`.

    Raises
    ------
    InputError
        If the branch was not found by shooting.
    """
    known = branch.attributes
    if "segments" not in known or "mesh" not in point.values:
        raise InputError("The branch is not one of periodic orbits by shooting.")
    values = np.array(known["parameter_values"], dtype=float)
    free = field.index(branch.name)
    values[free] = point.parameter
    problem = Shooting(field, values, free, np.asarray(point.values["mesh"], dtype=float),
                       point.u[: field.dimension].copy(),
                       np.asarray(known["scales"], dtype=float), int(known["periods"]),
                       float(known.get("rtol", 1e-9)))
    return problem, point.u


def hopf_orbits_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, *, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None, segments: int = 4, rtol: float = 1e-9,
    scales: ArrayLike | None = None, width: float | None = None,
) -> Branch:
    """The branch of orbits that is born at a Hopf point, by shooting.

    For orbits that come to stick on steep friction; the arguments are those of
    :func:`fecontact.bifurcation.orbits.orbits_from_hopf` and
    :func:`fecontact.bifurcation.shooting_branch.orbits_by_shooting`, the branch that of the latter.

    Raises
    ------
    InputError
        If the point is no Hopf point, or there are no orbits near it.
    """
    if point.kind != "Hopf":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, is no Hopf point.")
    free = field.index(branch.name)
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    values[free] = point.parameter
    state = np.ascontiguousarray(point.u[:-1])
    chosen = settings_of(settings, bounds)
    sizes, _ = sizes_of(scales, default_scales(Equilibrium(field, values, state)))
    found, u, leaving = orbit_starts.from_hopf(
        field, values, free, state, float(point.details["angular_frequency"]),
        point.details["eigenvector"], 50, 4,
        np.append(sizes, width_of(width, chosen, point.parameter)))
    problem, start = shooting_from(found, u, segments, rtol)
    shape = interpolate(found.mesh, found.nodes(leaving), problem.mesh[:-1])
    tangent = np.concatenate([shape.reshape(-1), leaving[found.size :]])
    attributes = {"state_names": list(field.state_names),
                  "parameter_names": list(field.parameters), "parameter_values": values,
                  "scales": problem.scales, "segments": segments, "periods": 1, "rtol": rtol}
    return follow(problem, start, chosen, name=branch.name,
                  tangent=tangent / np.sqrt(problem.weights() @ tangent**2),
                  attributes=attributes)


def doubled_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
) -> Branch:
    """The branch of orbits of twice the period that begins at a period doubling.

    They leave along the eigenvector of the multiplier -1, carried along the orbit; the second
    round takes it with the other sign. Where the two rounds become the same again, at another
    doubling of the single orbit, the branch ends with a point 'period halving': beyond it are the
    same orbits with their halves exchanged. The arguments are those of
    :func:`fecontact.bifurcation.orbits.orbits_beyond`, the branch that of
    :func:`fecontact.bifurcation.shooting_branch.orbits_by_shooting`.

    Raises
    ------
    InputError
        If the point is no period doubling of such a branch.
    """
    if point.kind != "period doubling":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, is no period doubling.")
    problem, u = restored_shooting(field, branch, point)
    twice, start, tangent = _doubled(problem, u)
    chosen = settings_of(settings, bounds)
    attributes = {**branch.attributes, "parameter_values": problem.values,
                  "scales": twice.scales, "periods": twice.periods,
                  "segments": len(twice.mesh) - 1}
    stops = [chosen.stop_at] if isinstance(chosen.stop_at, str) else list(chosen.stop_at)
    found = follow(twice, start + chosen.step * tangent, replace(
        chosen, stop_at=[*stops, _HALVING]), name=branch.name, tangent=tangent,
        attributes=attributes)
    return _ended(found, problem, chosen)


def _halves(u: Array, common: int) -> tuple[Array, Array]:
    first, second = np.split(u[:-common], 2)
    return first, second


@dataclass(frozen=True, eq=False)
class _Doubled(Shooting):
    """Orbits of twice a period, with a test for those that have become single again.

    ``apart`` is what the second half of the last orbit lacked to the first. The difference of the
    halves, along it, passes zero where they are the same.
    """

    apart: Array | None = None

    def _along(self, u: Array) -> float:
        """Difference of the halves along ``apart``, one where it has not changed."""
        assert self.apart is not None
        first, second = _halves(u, self.common)
        weighted = self.weights()[: len(self.apart)] * self.apart
        return float(weighted @ (first - second) / (weighted @ self.apart))

    def adapted(self, u: Array, tangent: Array) -> "tuple[_Doubled, Array, Array]":
        problem, u, tangent = super().adapted(u, tangent)
        first, second = _halves(u, self.common)
        return replace(problem, apart=first - second), u, tangent  # type: ignore[call-arg]

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        return {**super().tests(u, linearisation, tangent), _HALVING: self._along(u)}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        if kind != _HALVING:
            return super().examine(kind, u, linearisation, tangent)
        assert self.apart is not None
        first, second = _halves(u, self.common)
        weights = self.weights()[: len(first)]
        left, usual = (float(weights @ part**2) for part in (first - second, self.apart))
        return {} if left <= _SAME**2 * usual else None


def _ended(branch: Branch, single: Shooting, settings: Settings) -> Branch:
    """The branch, with an end at single orbits located on these.

    Doubled and single orbits cross there, so that Newton's method for doubled ones may find either.
    The turn in the parameter at the crossing is none.
    """
    points = branch.points
    if branch.status is not Status.STOPPED or points[-1].kind != _HALVING:
        return branch
    last, common = points[-1], single.common
    halves = [_halves(point.u, common) for point in points[-3:-1]]
    apart = [float(np.abs(first - second).max()) for first, second in halves]
    if points[-2].kind == "fold" and apart[-1] <= _SAME * apart[0]:
        points = (*points[:-2], last)
    tail = last.u[-common:].copy()
    tail[:-1] /= 2.0
    beside = replace(settings, points=3, stop_at=(), largest_step=settings.step)
    near = follow(single, np.append(_halves(last.u, common)[0], tail), beside,
                  name=branch.name, both=True).of_kind("period doubling")
    if near:
        closest = min(near, key=lambda point: abs(point.parameter - last.parameter))
        start, tail = closest.u[:-common], closest.u[-common:].copy()
        tail[:-1] *= 2.0
        last = replace(last, u=np.concatenate([start, start, tail]), values={
            **last.values, "period": 2.0 * closest.values["period"],
            "multipliers": closest.values["multipliers"] ** 2})
    return replace(branch, points=(*points[:-1], last))


def _doubled(problem: Shooting, u: Array) -> tuple[Shooting, Array, Array]:
    """The orbit run through twice, and the direction (of length one) in which it parts."""
    starts = problem.starts(u)
    rounds = [run.monodromy for run in Shot(problem, u).runs]
    around = np.eye(starts.shape[1])
    for matrix in rounds:
        around = matrix @ around
    values, vectors = np.linalg.eig(around)
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    carried = [vector]
    for matrix in rounds[:-1]:
        carried.append(matrix @ carried[-1])
    mesh = np.concatenate([problem.mesh[:-1], 1.0 + problem.mesh]) / 2.0
    scales = problem.scales.copy()
    scales[-2] *= 2.0
    tail = u[-problem.common:].copy()
    if problem.autonomous:
        tail[0] *= 2.0
    start = np.concatenate([starts.reshape(-1), starts.reshape(-1), tail])
    shape = np.concatenate(carried)
    twice = _Doubled(problem.field, problem.values, problem.free, mesh, problem.reference, scales,
                     2 * problem.periods, problem.rtol, apart=2.0 * shape)
    tangent = np.concatenate([shape, -shape, np.zeros(problem.common)])
    return twice, start, tangent / np.sqrt(twice.weights() @ tangent**2)
