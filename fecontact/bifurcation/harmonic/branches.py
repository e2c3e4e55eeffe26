"""Branches of orbits by harmonic balance, from motions, Hopf points and points of branches."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.heading import heading
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
)
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.method import MOST, MOST_SAMPLED, HarmonicBalance
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.orbits.restored import rescaled
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.starts import Begun
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.model_limits import beyond_fit, warn_of_limits

# Factors of the first step, tried in this order to leave a special point.
_FIRST_STEPS = (1.0, 0.2, 0.04)
# Factor by which harmonics grow until the tolerance is met.
_MORE = 1.5
# Size below which orbits are at rest, in that of the largest on the branch, means included.
_AT_REST = 1e-8
# Number of points at which the error from few samples is estimated by default, and the error above
# which a branch carries a note.
_LOOKED_AT, _NOTED = 24, 5e-3
_FEW = ("The error of the branch from its {} samples is {:.2g} of the orbit: folds may be those of "
        "kinks of the contact laws between samples; take more samples or smoother laws.")
_CORNERS = ("The parameter turns at corners of the branch at {} folds: forces have kinks between "
            "samples; take more samples, or smoother forces.")
# Distance of the nearest multiplier from 1 at a fold from which multipliers count as wrong.
_OFF_AT_FOLD = 0.1
# Points at which two branches meet.
_ON_TWO = ("branch point", HALVING)


def followed(
    start: Begun, method: HarmonicBalance, options: ContinuationOptions, limits: Array | None,
    **how: Any,
) -> Branch:
    """Branch from a start by collocation; ``limits`` (d,) are those of the growth of scales."""
    problem, u, tangent = starts.start_of(start, method, limits)
    if tangent is None:
        problem, u = starts.converged_orbit(problem, u)
    return follow(problem, u, tangent, method, options, **how)


def beyond(
    field: VectorField, point: BranchPoint, method: HarmonicBalance | None,
    options: ContinuationOptions, scales: ArrayLike | None, width: float | None, direction: float,
) -> Branch:
    """The other orbits at a period doubling or branch point; doubled ones have 2 H harmonics."""
    problem, u, tangent = starts.restored(field, point)
    problem = _rescaled(problem, scales, width)
    if problem.orders is not None:
        # The other orbits may have harmonics that these leave out.
        every = replace(_method_of(problem), harmonics=problem.harmonics)
        _, tangent = starts.with_more(problem, tangent, every)
        problem, u = starts.with_more(problem, u, every)
    problem, u, tangent = (starts.doubled(problem, u) if point.kind == "period doubling"
                           else starts.crossing(problem, u, tangent))
    own = _method_of(problem)
    if method is not None:
        _, tangent = starts.with_more(problem, tangent, method)
        problem, u = starts.with_more(problem, u, method)
        own = method
    tangent = np.copysign(1.0, direction) * heading(tangent, problem.weights())
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
    return HarmonicBalance(problem.orders or problem.harmonics, problem.samples,
                           stability=problem.stability,
                           repeats=None if problem.waves is None else problem.waves.repeats)


def _rescaled(
    problem: HarmonicProblem, scales: ArrayLike | None, width: float | None
) -> HarmonicProblem:
    """The problem with other scales and width, if given; given scales no longer grow."""
    return replace(rescaled(problem, scales, width),
                   limits=problem.limits if scales is None else None)


def attributes_of(problem: HarmonicProblem) -> dict[str, Any]:
    """Attributes of a branch from which the problem of its points is restored."""
    field, layout = problem.field, problem.layout
    found: dict[str, Any] = {} if problem.limits is None else {"limits": problem.limits}
    if problem.orders is not None:
        found["orders"] = np.array(problem.orders)
    if problem.waves is not None:
        found |= problem.waves.repeats.attributes()
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

    ``further`` are attributes of the branch. Stability is left out where folds show it to be wrong.

    Raises
    ------
    AnalysisError
        If they do not with as many as the method allows.
    """
    if problem.stability is None or problem.autonomous or not problem.kinked:
        return _watched(*_refined(problem, u, tangent, method, options, further, how)[:2])
    # Multipliers and special points take the time: they are computed once, on the final samples.
    branch, plain, u, tangent = _refined(
        replace(problem, stability=None), u, tangent, replace(method, stability=None), options,
        further, how)
    if branch.status is BranchStatus.INTERRUPTED:
        return branch
    whole = replace(plain, stability=problem.stability)
    wrong = _wrong_at_folds(whole, branch)
    if wrong:
        return replace(_watched(branch, whole), message=_joined(branch.message, wrong))
    known = {name: branch.attributes[name] for name in ("sampling_error",)
             if name in branch.attributes}
    found = _followed(whole, u, tangent, options, {**(further or {}), **known}, how)
    return replace(_watched(found, whole), message=_joined(found.message, branch.message)
                   if _FEW[:20] in branch.message else found.message)


def _watched(branch: Branch, problem: HarmonicProblem) -> Branch:
    """The branch, with a warning if large deflections leave the range of their forces."""
    field = problem.field
    if isinstance(field, ContactField) and (basis := field.system().basis).large_deflections:
        moved = [problem.series.values @ problem.coefficients(point.u)[:, : basis.modes]
                 for point in branch.points]
        sentence = beyond_fit(basis, np.concatenate(moved))
        warn_of_limits([sentence] if sentence else [], "On this branch")
    return branch


def _followed(
    problem: HarmonicProblem, u: Array, tangent: Array | None, options: ContinuationOptions,
    further: Mapping[str, Any] | None, how: Mapping[str, Any],
) -> Branch:
    """Follow a branch with the harmonics and samples of a problem."""
    name = list(problem.field.parameters)[problem.free]
    stops = [options.stop_at] if isinstance(options.stop_at, str) else list(options.stop_at)
    branch = continue_branch(
        problem, u, replace(options, stop_at=[*stops, HALVING]), name=name, tangent=tangent,
        attributes={**attributes_of(problem), **(further or {})}, **how)
    if branch.points[-1].kind == HALVING and HALVING not in stops:
        branch = replace(branch, status=BranchStatus.CLOSED)
    return branch


def _refined(
    problem: HarmonicProblem, u: Array, tangent: Array | None, method: HarmonicBalance,
    options: ContinuationOptions, further: Mapping[str, Any] | None, how: Mapping[str, Any],
) -> tuple[Branch, HarmonicProblem, Array, Array | None]:
    """A branch that meets the tolerances, with the problem, start and tangent that it has."""
    explicit = method.sampling_tolerance is not None
    sampling = method.sampling_tolerance if problem.autonomous else method.sampling
    most = MOST if explicit else max(MOST_SAMPLED, method.count)
    while True:
        branch = _followed(problem, u, tangent, options, further, how)
        if branch.status is BranchStatus.INTERRUPTED:
            break
        finer, error = _with_more_harmonics(method, branch), 0.0
        if finer is None and (explicit or (problem.kinked and not problem.autonomous)):
            # By default a part of the points is examined.
            error = _largest_error(problem, branch.points if explicit else _some(branch.points))
            if sampling is not None:
                branch = replace(branch, attributes={**branch.attributes, "sampling_error": error})
                finer = _with_more_samples(method, error, sampling, most)
        if finer is None:
            if error > max(_NOTED, sampling or 0.0):
                branch = replace(branch, message=_joined(
                    branch.message, _FEW.format(method.count, error)))
            corners = sum(point.kind == "fold" and not point.located for point in branch.points)
            if corners and not problem.autonomous:
                branch = replace(branch, message=_joined(branch.message, _CORNERS.format(corners)))
            break
        method = finer
        if tangent is not None:
            _, tangent = starts.with_more(problem, tangent, method)
        problem, u = starts.with_more(problem, u, method)
    return branch, problem, u, tangent


def _joined(*sentences: str) -> str:
    return " ".join(filter(None, sentences))


def _some(points: Sequence[BranchPoint]) -> Sequence[BranchPoint]:
    """Some points of a branch, evenly distributed, and its folds."""
    step = max(1, len(points) // _LOOKED_AT)
    return [point for k, point in enumerate(points) if k % step == 0 or point.kind == "fold"]


def _wrong_at_folds(problem: HarmonicProblem, branch: Branch) -> str:
    """Why multipliers of a branch are not to be trusted; empty where its folds say nothing.

    One of them is 1 at a fold of forced orbits.
    """
    worst, place = 0.0, np.nan
    for point in branch.points:
        if point.kind == "fold" and point.located:
            found = problem.linearise(np.asarray(point.u)).floquet.multipliers
            off = float(np.abs(found - 1.0).min())
            if off > worst:
                worst, place = off, point.parameter
    if worst <= _OFF_AT_FOLD:
        return ""
    return (f"Stability is left out: at the fold at {branch.parameter_name} = {place:.6g} one "
            f"multiplier must be 1, but the nearest is off by {worst:.2g} with "
            f"{problem.harmonics} harmonics; take more harmonics.")


def _with_more_harmonics(method: HarmonicBalance, branch: Branch) -> HarmonicBalance | None:
    """The method for less truncation; None where that is small enough."""
    if method.tolerance is None:
        return None
    worst = float(np.max(branch.column("truncation_error")))
    if worst <= method.tolerance:
        return None
    harmonics = int(np.ceil(_MORE * method.highest))
    # Even numbers stay even, which large deflections need.
    harmonics += harmonics % 2 if method.highest % 2 == 0 else 0
    if harmonics > method.most_harmonics:
        raise AnalysisError(f"The truncation error of the branch is {worst:.2g} with "
                            f"{method.highest} harmonics, above tolerance = "
                            f"{method.tolerance:g}; raise most_harmonics = "
                            f"{method.most_harmonics} or the tolerance.")
    samples = None if method.samples is None else int(
        np.ceil(method.samples * harmonics / method.highest))
    return replace(method, harmonics=harmonics, samples=samples)


def _with_more_samples(
    method: HarmonicBalance, error: float, allowed: float, most: int
) -> HarmonicBalance | None:
    """The method with twice the samples; None where an error from samples is small enough.

    Also where there would be more than ``most``, unless these are the most of all.
    """
    if error <= allowed:
        return None
    if 2 * method.count > most:
        if most < MOST:
            return None
        raise AnalysisError(f"The error of the branch from its {method.count} samples is "
                            f"{error:.2g}, above sampling_tolerance = {allowed:g}; raise the "
                            f"tolerance.")
    return replace(method, samples=2 * method.count)


def sampling_error(
    problem: HarmonicProblem, u: Array, tangent: Array, least: float = 0.0
) -> float:
    """Estimate of the error of an orbit u relative to its size; infinite where there is none.

    A step of Newton's method leads to the orbits of twice the samples, at right angles to the
    tangent, so that at folds it is as long as elsewhere. The remaining residual with as many
    samples as the problem has is no error of theirs, and taken off. Kinks of laws make errors of
    order 1 / N^2, of which a fourth is left there: the error is four thirds of that step. Forces
    whose second half of a period mirrors the first are the same at an odd number of samples and at
    twice as many: these are taken four times.

    Its length is the root of three squares: the root mean square of harmonics 1 to H, relative to
    that of the orbit or ``least``, whichever is larger; the change of an unknown period, relative
    to it; that of the parameter, in widths of the diagram.
    """
    samples = problem.samples * (4 if problem.samples % 2 else 2)
    finer = replace(problem, samples=samples, before=(), bend=None)
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
