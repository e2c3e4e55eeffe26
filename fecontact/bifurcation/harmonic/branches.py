"""Branches of orbits by harmonic balance, from motions, Hopf points and points of branches."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import HopfPoint
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    sizes_of,
)
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.method import MOST, HarmonicBalance
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.core.errors import AnalysisError, FecontactError, InputError, require_positive
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

# Factors of the first step, tried in this order to leave a special point.
_FIRST_STEPS = (1.0, 0.2, 0.04)
# Factor by which harmonics grow until the tolerance is met.
_MORE = 1.5
# Size below which orbits are at rest, in that of the largest on the branch, means included.
_AT_REST = 1e-8
# Points at which two branches meet.
_ON_TWO = ("branch point", HALVING)


def from_motion(
    field: VectorField, values: Array, free: int, motion: PeriodicMotion, method: HarmonicBalance,
    options: ContinuationOptions, widths: Array, limits: Array | None, direction: float,
    both: bool,
) -> Branch:
    """Branch through the orbit to which a motion has settled.

    ``widths`` (d + 1,) are scales of states and parameter, ``limits`` (d,) those of their growth.
    """
    problem, u = starts.corrected(*starts.from_samples(
        field, values, free, motion.times, motion.states, motion.period, method, motion.periods,
        widths))
    return follow(replace(problem, limits=limits), u, None, method, options,
                  direction=direction, both=both)


def born(
    field: VectorField, point: HopfPoint, method: HarmonicBalance, options: ContinuationOptions,
    scales: ArrayLike | None, width: float | None,
) -> Branch:
    """Branch of the orbits that are born at a Hopf point."""
    failed: FecontactError = InputError("There is nothing to start from.")
    for problem, u, leaving in starts.at_hopf(field, point, method, options, scales, width):
        try:
            return follow(problem, u, leaving, method, options)
        except FecontactError as error:
            failed = error
    raise failed


def beyond(
    field: VectorField, point: BranchPoint, method: HarmonicBalance | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
) -> Branch:
    """The other orbits at a period doubling or branch point; doubled ones have 2 H harmonics."""
    problem, u, tangent = starts.restored(field, point)
    problem = _rescaled(problem, scales, width)
    problem, u, tangent = (starts.doubled(problem, u) if point.kind == "period doubling"
                           else starts.crossing(problem, u, tangent))
    own = _method_of(problem)
    if method is not None:
        _, tangent = starts.with_more(problem, tangent, method)
        problem, u = starts.with_more(problem, u, method)
        own = method
    tangent = np.copysign(1.0, direction) * tangent / np.sqrt(problem.weights() @ tangent**2)
    failed: FecontactError = InputError("There is nothing to start from.")
    for part in _FIRST_STEPS:
        step = max(part * options.step, options.smallest_step)
        try:
            return follow(problem, u + step * tangent, tangent, own, replace(options, step=step))
        except FecontactError as error:
            failed = error
    raise failed


def goes_on(
    field: VectorField, point: BranchPoint, method: HarmonicBalance | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, sign: float,
    both: bool,
) -> Branch:
    """Continue a branch from one of its points, or backwards if ``sign`` is -1."""
    problem, u, tangent = starts.restored(field, point)
    problem = _rescaled(problem, scales, width)
    if method is None:
        return follow(problem, u, sign * tangent, _method_of(problem), options, both=both)
    _, tangent = starts.with_more(problem, tangent, method)
    problem, u = starts.with_more(problem, u, method)
    return follow(problem, u, sign * tangent, method, options, both=both)


def method_of(point: BranchPoint) -> HarmonicBalance:
    """Harmonic balance as the branch of a point has it."""
    return starts.method_of(point.branch.attributes)


def _method_of(problem: HarmonicProblem) -> HarmonicBalance:
    return HarmonicBalance(problem.harmonics, problem.samples, stability=problem.stability)


def _rescaled(
    problem: HarmonicProblem, scales: ArrayLike | None, width: float | None
) -> HarmonicProblem:
    """The problem with other scales of the states and another width of the diagram, if given."""
    changed, d, limits = problem.scales.copy(), problem.field.dimension, problem.limits
    if scales is not None:
        changed[:d], limits = sizes_of(scales, changed[:d])[0], None
    if width is not None:
        require_positive("A branch", width=width)
        changed[-1] = width
    return replace(problem, scales=changed, limits=limits)


def attributes_of(problem: HarmonicProblem) -> dict[str, Any]:
    """What a branch stores of its problem, so that its points can be restored."""
    field, layout = problem.field, problem.layout
    found = {} if problem.limits is None else {"limits": problem.limits}
    return {**found, "state_names": list(field.state_names),
            "parameter_names": list(field.parameters),
            "parameter_values": problem.values, "scales": problem.scales,
            "harmonics": problem.harmonics, "samples": problem.samples,
            "stability": problem.stability or "none", "periods": problem.periods,
            "displacements": layout.displacements, "memory": layout.memory,
            "memory_nodes": layout.nodes,
            **({"kept_deflections": problem.kept.offsets} if layout.memory else {})}


def follow(
    problem: HarmonicProblem, u: Array, tangent: Array | None, method: HarmonicBalance,
    options: ContinuationOptions, further: Mapping[str, Any] | None = None, **how: Any,
) -> Branch:
    """Follow a branch, with more harmonics and samples until its errors meet the tolerances.

    ``further`` are attributes of the branch.

    Raises
    ------
    AnalysisError
        If they do not with as many as the method allows.
    """
    name = list(problem.field.parameters)[problem.free]
    stops = [options.stop_at] if isinstance(options.stop_at, str) else list(options.stop_at)
    ended = replace(options, stop_at=[*stops, HALVING])
    while True:
        branch = continue_branch(problem, u, ended, name=name, tangent=tangent,
                                 attributes={**attributes_of(problem), **(further or {})},
                                 **how)
        if branch.points[-1].kind == HALVING and HALVING not in stops:
            branch = replace(branch, status=BranchStatus.CLOSED)
        if not method.refines or branch.status is BranchStatus.INTERRUPTED:
            return branch
        finer = _with_more_harmonics(method, branch)
        if finer is None and method.sampling_tolerance is not None:
            error = _largest_error(problem, branch.points)
            branch = replace(branch, attributes={**branch.attributes, "sampling_error": error})
            finer = _with_more_samples(method, error)
        if finer is None:
            return branch
        method = finer
        if tangent is not None:
            _, tangent = starts.with_more(problem, tangent, method)
        problem, u = starts.with_more(problem, u, method)


def _with_more_harmonics(method: HarmonicBalance, branch: Branch) -> HarmonicBalance | None:
    """The method for less truncation; None where that is small enough."""
    if method.tolerance is None:
        return None
    worst = float(np.max(branch.column("truncation_error")))
    if worst <= method.tolerance:
        return None
    harmonics = int(np.ceil(_MORE * method.harmonics))
    if harmonics > method.most_harmonics:
        raise AnalysisError(f"The truncation error of the branch is {worst:.2g} with "
                            f"{method.harmonics} harmonics, above tolerance = "
                            f"{method.tolerance:g}; raise most_harmonics = "
                            f"{method.most_harmonics} or the tolerance.")
    samples = None if method.samples is None else int(
        np.ceil(method.samples * harmonics / method.harmonics))
    return replace(method, harmonics=harmonics, samples=samples)


def _with_more_samples(method: HarmonicBalance, error: float) -> HarmonicBalance | None:
    """The method with twice the samples; None where an error from samples is small enough."""
    assert method.sampling_tolerance is not None
    if error <= method.sampling_tolerance:
        return None
    if 2 * method.count > MOST:
        raise AnalysisError(f"The error of the branch from its {method.count} samples is "
                            f"{error:.2g}, above sampling_tolerance = "
                            f"{method.sampling_tolerance:g}; raise the tolerance.")
    return replace(method, samples=2 * method.count)


def sampling_error(
    problem: HarmonicProblem, u: Array, tangent: Array, least: float = 0.0
) -> float:
    """Estimate of the error of an orbit u relative to its size; infinite where there is none.

    A step of Newton's method leads to the orbits of twice the samples, at right angles to the
    tangent, so that at folds it is as long as elsewhere. What is left of the residual with as many
    samples as the problem has is no error of theirs, and taken off. Kinks of laws make errors of
    order 1 / N^2, of which a fourth is left there: the error is four thirds of that step.

    Its length is the root of three squares: the root mean square of harmonics 1 to H, relative to
    that of the orbit or ``least``, whichever is larger; the change of an unknown period, relative
    to it; that of the parameter, in widths of the diagram.
    """
    finer = replace(problem, samples=2 * problem.samples, before=(), bend=None)
    try:
        linearised = finer.linearise(u)
        residual = linearised.residual - problem.evaluate(u).residual
        size = max(_size(problem, u, problem.reference.shape[1]), least)
        if not residual.any() or not size > 0.0:
            return np.inf if residual.any() else 0.0
        weights = problem.weights().copy()
        weights[: problem.reference.shape[1]] = 0.0
        weights[: problem.size] /= size**2
        if problem.autonomous:
            weights[-2] = problem.period(u) ** -2.0
        step = linearised.solve(weights * tangent, -np.append(residual, 0.0))
    except AnalysisError:
        return np.inf
    off = 4.0 / 3.0 * float(np.sqrt(weights @ step**2))
    return off if np.isfinite(off) else np.inf


def _size(problem: HarmonicProblem, u: Array, first: int = 0) -> float:
    """Root mean square of an orbit in the scales of the problem, from one of its coefficients."""
    return float(np.sqrt(problem.weights()[first : problem.size] @ u[first : problem.size] ** 2))


def _largest_error(problem: HarmonicProblem, points: Iterable[BranchPoint]) -> float:
    """The largest such error of the points of a branch, but for those on two branches.

    There the equations are singular with any last row; the points beside them tell the same.
    """
    found = [(np.asarray(point.u), np.asarray(point.tangent)) for point in points
             if point.kind not in _ON_TWO]
    least = _AT_REST * max(_size(problem, u) for u, _ in found)
    return max(sampling_error(problem, u, tangent, least) for u, tangent in found)
