"""Branches of orbits by shooting that begin on others: at Hopf points and period doublings."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation.continuation.branch import Branch, BranchPoint, Status, require_on_branch
from fecontact.bifurcation.continuation.problem import Settings, settings_of, sizes_of, width_of
from fecontact.bifurcation.continuation.pseudo_arclength import follow
from fecontact.bifurcation.equilibria.branches import default_scales
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import require_field
from fecontact.bifurcation.orbits import starts as orbit_starts
from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.shooting import Shooting, ShootingLinearisation, shooting_from
from fecontact.core.errors import FecontactError, InputError
from fecontact.core.types import Array

# Part of their largest distance below which the two halves of an orbit come together. Closer to
# single orbits Newton's method finds either, as both solve the equations.
_CLOSE = 0.1


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
                       float(known.get("rtol", 1e-9)), known.get("derivative_rtol"))
    return problem, point.u


def hopf_orbits_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, *, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None, segments: int = 4, rtol: float = 1e-9,
    scales: ArrayLike | None = None, width: float | None = None,
) -> Branch:
    """The branch of orbits that is born at a Hopf point, by shooting.

    For orbits that come to stick on steep friction; the arguments are those of
    :func:`fecontact.bifurcation.orbits.branches.orbits_from_hopf` and
    :func:`fecontact.bifurcation.orbits.branches.orbits_by_shooting`, the branch that of the
    latter.

    Raises
    ------
    InputError
        If the point is no Hopf point, or there are no orbits near it.
    """
    require_field(field)
    require_on_branch("hopf_orbits_by_shooting", branch, point)
    if point.kind != "Hopf":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, is no Hopf point.")
    free = field.index(branch.name)
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    values[free] = point.parameter
    state = np.ascontiguousarray(point.u[:-1])
    chosen = settings_of(settings, bounds)
    sizes, _ = sizes_of(scales, default_scales(Equilibrium(field, values, state)))
    widths = np.append(sizes, width_of(width, chosen, point.parameter))
    for amplitude in orbit_starts.AMPLITUDES:
        found, u, leaving = orbit_starts.from_hopf(
            field, values, free, state, float(point.details["angular_frequency"]),
            point.details["eigenvector"], 50, 4, widths, amplitude)
        problem, start = shooting_from(found, u, segments, rtol)
        shape = interpolate(found.mesh, found.nodes(leaving), problem.mesh[:-1])
        tangent = np.concatenate([shape.reshape(-1), leaving[found.size :]])
        attributes = {"state_names": list(field.state_names),
                      "parameter_names": list(field.parameters), "parameter_values": values,
                      "scales": problem.scales, "segments": segments, "periods": 1, "rtol": rtol}
        try:
            return follow(problem, start, chosen, name=branch.name,
                          tangent=tangent / np.sqrt(problem.weights() @ tangent**2),
                          attributes=attributes)
        except FecontactError as error:
            failed = error
    raise failed


def doubled_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
) -> Branch:
    """The branch of orbits of twice the period that begins at a period doubling.

    They leave along the eigenvector of the multiplier -1, carried along the orbit; the second
    round takes it with the other sign. Where the two rounds become the same again, at another
    doubling of the single orbit, the branch ends with a point 'period halving': beyond it are the
    same orbits with their halves exchanged. The arguments are those of
    :func:`fecontact.bifurcation.orbits.branches.orbits_beyond`, the branch that of
    :func:`fecontact.bifurcation.orbits.branches.orbits_by_shooting`.

    Raises
    ------
    InputError
        If the point is no period doubling of such a branch.
    """
    require_field(field)
    require_on_branch("doubled_by_shooting", branch, point)
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
    twice, start, tangent = twice.adapted(start + chosen.step * tangent, tangent)
    found = follow(twice, start, replace(chosen, stop_at=[*stops, HALVING]), name=branch.name,
                   tangent=tangent, attributes=attributes)
    return _ended(found, problem, chosen)


def _halves(u: Array, common: int) -> tuple[Array, Array]:
    first, second = np.split(u[:-common], 2)
    return first, second


@dataclass(frozen=True, eq=False)
class _Doubled(Shooting):
    """Orbits of twice a period, with a test for those that come back to single ones.

    ``apart`` (K d / 2,) is by how much the halves of the last orbit differed, ``largest`` the
    largest length of such a difference so far.
    """

    apart: Array = field(default_factory=lambda: np.zeros(0))
    largest: float = 0.0

    def length(self, apart: Array) -> float:
        """Length of a difference of the halves."""
        return float(np.sqrt(self.weights()[: len(apart)] @ apart**2))

    def adapted(self, u: Array, tangent: Array) -> "tuple[_Doubled, Array, Array]":
        first, second = _halves(u, self.common)
        return replace(self, reference=self.starts(u)[0].copy(), values=self.parameters(u),
                       apart=first - second,
                       largest=max(self.largest, self.length(first - second))), u, tangent

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        first, second = _halves(u, self.common)
        along = self.weights()[: len(first)] * self.apart @ (first - second)
        return {**super().tests(u, linearisation, tangent), HALVING: float(
            along / (self.length(self.apart) * self.largest) - _CLOSE)}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        return {} if kind == HALVING else super().examine(kind, u, linearisation, tangent)


def _ended(branch: Branch, single: Shooting, settings: Settings) -> Branch:
    """The branch, with an end that comes back to single orbits located on these.

    Where that was passed in one step, what follows are single orbits, and is left out.
    """
    common = single.common
    weights = single.weights()[:-common]
    sizes = np.array([np.sqrt(weights @ np.subtract(*_halves(point.u, common)) ** 2)
                      for point in branch.points])
    close = np.flatnonzero(sizes <= 1.1 * _CLOSE * np.maximum.accumulate(sizes))
    if not len(close):
        return branch
    points = branch.points[: close[0] + 1]
    branch = replace(branch, status=Status.CLOSED, message="")
    before, last = points[-2:]
    # The parameter is even in what parts the halves.
    one, other = sizes[close[0] - 1 : close[0] + 1] ** 2
    there = last.parameter + other * (last.parameter - before.parameter) / (other - one)
    first, second = _halves(last.u, common)
    tail = last.u[-common:].copy()
    tail[:-1] /= 2.0
    tail[-1] = there
    near = _doublings_near(single, np.concatenate([(first + second) / 2.0, tail]), settings,
                           abs(there - last.parameter), branch.name)
    if not near:
        return replace(branch, points=points[:-1])
    closest = min(near, key=lambda point: abs(point.parameter - there))
    start, tail = closest.u[:-common], closest.u[-common:].copy()
    tail[:-1] *= 2.0
    end = replace(last, kind=HALVING, u=np.concatenate([start, start, tail]), values={
        **last.values, "period": 2.0 * closest.values["period"],
        "multipliers": closest.values["multipliers"] ** 2})
    return replace(branch, points=(*points[:-1], end))


def _doublings_near(
    single: Shooting, u: Array, settings: Settings, off: float, name: str
) -> tuple[BranchPoint, ...]:
    """Doublings of the single orbits, ``off`` or so in the parameter from that near u."""
    step = max(4.0 * off / float(single.scales[-1]), settings.step)
    low, high = settings.bounds
    beside = replace(settings, step=step, largest_step=step, points=4, stop_at=(),
                     bounds=(min(low, u[-1] - 20.0 * off), max(high, u[-1] + 20.0 * off)))
    try:
        return follow(single, u, beside, name=name, both=True).of_kind("period doubling")
    except FecontactError:
        return ()


def _doubled(problem: Shooting, u: Array) -> tuple[_Doubled, Array, Array]:
    """The orbit run through twice, and the direction (of length one) in which it parts."""
    starts = problem.starts(u)
    rounds = [run.monodromy for run in ShootingLinearisation(problem, u).runs]
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
                     2 * problem.periods, problem.rtol, problem.derivative_rtol)
    tangent = np.concatenate([shape, -shape, np.zeros(problem.common)])
    return twice, start, tangent / np.sqrt(twice.weights() @ tangent**2)
