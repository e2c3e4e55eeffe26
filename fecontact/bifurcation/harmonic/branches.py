"""Branches of orbits by harmonic balance, from motions, Hopf points and points of branches."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.predictor import BENT
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.method import MOST, MOST_SAMPLED, HarmonicBalance
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.orbits import starts as orbit_starts
from fecontact.bifurcation.orbits.discretisation import (
    Discretisation,
    Request,
    follow_orbits,
    stepped_off,
)
from fecontact.bifurcation.orbits.orbit_points import BalancedPoints
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.starts import Begun
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.model_limits import beyond_fit, warn_of_limits

# Steps to each side within which a special point is found again with few harmonics.
_AROUND = 4
# Factor by which harmonics grow until the tolerance is met.
_MORE = 1.5
# Size below which orbits are at rest, in that of the largest on the branch, means included.
_AT_REST = 1e-8
# Number of points at which the error from few samples is estimated by default, and the error above
# which a branch carries a note. Every sixth of them and the largest orbit, which slips if any does,
# is enough if their errors are so much smaller.
_LOOKED_AT, _NOTED, _SIXTH, _FAR = 24, 5e-3, 6, 0.01
_FEW = ("The error of the branch from its {} samples is {:.2g} of the orbit: folds may be those of "
        "kinks of the contact laws between samples; take more samples or smoother laws.")
_CORNERS = ("The parameter turns at corners of the branch at {} folds: forces have kinks between "
            "samples; take more samples, or smoother forces.")
# Distance of the nearest multiplier from 1 at a fold from which multipliers count as wrong.
_OFF_AT_FOLD = 0.1
# Points at which two branches meet.
_ON_TWO = ("branch point", HALVING)


class ByHarmonics(BalancedPoints, Discretisation):
    """Harmonic balance."""

    own_starts = frozenset({"period doubling", "branch point"})
    finds_responses = True

    def suits(self, point: BranchPoint, method: HarmonicBalance) -> bool:
        """Whether unknowns of a point are those of the options, but for their number."""
        return True

    def require_family(self, method: HarmonicBalance, field: VectorField) -> None:
        """Raise InputError for a field or options without families."""
        if method.stability is None or method.refines:
            raise InputError("orbit_family: harmonic balance needs stability, and takes the "
                             "harmonics and samples that it is given; leave out stability = None "
                             "and tolerances.")

    def projected(
        self, start: Begun, method: HarmonicBalance, limits: Array | None
    ) -> tuple[HarmonicProblem, Array, Array | None]:
        """Problem, unknowns and direction of a start on a mesh."""
        return starts.start_of(start, method, limits)

    def followed(
        self, start: Begun, method: HarmonicBalance, options: ContinuationOptions,
        limits: Array | None, **how: Any,
    ) -> Branch:
        """Branch from a start on a mesh."""
        problem, u, tangent = starts.start_of(start, method, limits)
        if tangent is None:
            problem, u = starts.converged_orbit(problem, u)
        return follow(problem, u, tangent, method, options, **how)

    def goes_on(self, point: BranchPoint, request: Request) -> Branch:
        """Branch that continues from one of its own points."""
        problem, u, tangent = request.restored(point)
        method = request.method
        if method is None:
            method = problem.method
        else:
            problem, u, tangent = starts.with_more(problem, u, tangent, method)
        return follow(problem, u, request.sign * tangent, method, request.options,
                      both=request.both)

    def beyond(self, point: BranchPoint, request: Request) -> Branch:
        """The other orbits at one of its points; doubled ones have 2 H harmonics."""
        problem, u, tangent = request.restored(point)
        if problem.orders is not None:
            # The other orbits may have harmonics that these leave out.
            every = replace(problem.method, harmonics=problem.harmonics)
            problem, u, tangent = starts.with_more(problem, u, tangent, every)
        problem, u, tangent = (starts.doubled(problem, u) if point.kind == "period doubling"
                               else starts.crossing(problem, u, tangent))
        own = problem.method
        if request.method is not None:
            own = request.method
            problem, u, tangent = starts.with_more(problem, u, tangent, own)
        return stepped_off(
            (problem, u, tangent), request,
            lambda u, tangent, options: follow(problem, u, tangent, own, options))

    def beyond_on_mesh(
        self, point: BranchPoint, start: orbit_starts.Start, request: Request,
        method: HarmonicBalance,
    ) -> Branch:
        """The other orbits at a point whose orbit was put on a mesh."""
        there = self._found_again(point, start, method, request.options)
        return self.beyond(there, replace(request, method=method))

    def _found_again(
        self, point: BranchPoint, start: orbit_starts.Start, method: HarmonicBalance,
        options: ContinuationOptions,
    ) -> BranchPoint:
        """A special point as few harmonics have it, a little beside that of all of them."""
        problem, u, tangent = start
        how = replace(method, harmonics=max(method.highest // 2, 1)
                      if point.kind == "period doubling" else method.highest)
        step = options.step
        near = replace(options, points=2 * _AROUND + 1, largest_step=step,
                       bounds=(-np.inf, np.inf), stop_at=(), events={}, progress=None, locate=True)
        found = self.followed((problem, u - _AROUND * step * tangent, tangent), how, near,
                              None).of_kind(str(point.kind))
        if not found:
            raise AnalysisError(f"{point.place} is none with {how.highest} harmonics; take more.")
        return min(found, key=lambda one: abs(one.parameter - point.parameter))


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
    branch, final, u, tangent, notes = _refined(problem, u, tangent, method, options, further, how)
    if branch.status is BranchStatus.INTERRUPTED:
        return _watched(branch, final)
    judged = problem.stability is not None and _once(problem)
    whole = replace(final, stability=problem.stability)
    wrong = _wrong_at_folds(whole, branch) if judged else ""
    if judged and (final.stability is None) != bool(wrong):
        known = {name: value for name, value in branch.attributes.items()
                 if name == "sampling_error"}
        branch = follow_orbits(replace(whole, stability=None) if wrong else whole, u, options,
                               {**(further or {}), **known}, tangent=tangent, **how)
    return replace(_watched(branch, final), message=_joined(branch.message, notes, wrong))


def _once(problem: HarmonicProblem) -> bool:
    """Whether samples are chosen by an estimate, and multipliers wait for the last of them."""
    return problem.kinked and not problem.autonomous


def _watched(branch: Branch, problem: HarmonicProblem) -> Branch:
    """The branch, with a warning if large deflections leave the range of their forces."""
    field = problem.field
    if isinstance(field, ContactField) and (basis := field.system().basis).large_deflections:
        moved = [problem.series.values @ problem.coefficients(point.u)[:, : basis.modes]
                 for point in branch.points]
        sentence = beyond_fit(basis, np.concatenate(moved))
        warn_of_limits([sentence] if sentence else [], "On this branch")
    return branch


def _refined(
    problem: HarmonicProblem, u: Array, tangent: Array | None, method: HarmonicBalance,
    options: ContinuationOptions, further: Mapping[str, Any] | None, how: Mapping[str, Any],
) -> tuple[Branch, HarmonicProblem, Array, Array | None, str]:
    """A branch that meets the tolerances, with its problem, start, tangent and notes.

    Multipliers and special points take the time: if it needs more samples, they are left out.
    """
    explicit = method.sampling_tolerance is not None
    sampling = method.sampling_tolerance if problem.autonomous else method.sampling
    most, error = MOST if explicit else max(MOST_SAMPLED, method.count), 0.0
    while True:
        branch = follow_orbits(problem, u, options, further, tangent=tangent, **how)
        if branch.status is BranchStatus.INTERRUPTED:
            return branch, problem, u, tangent, ""
        finer = _with_more_harmonics(method, branch)
        if finer is None and (explicit or _once(problem)):
            error = (_largest_error(problem, branch.points, branch.points) if explicit
                     else _error_of_some(problem, branch.points, sampling or _NOTED))
            if sampling is not None:
                branch = replace(branch, attributes={**branch.attributes, "sampling_error": error})
                finer = _with_more_samples(method, error, sampling, most)
        if finer is None:
            break
        method = replace(finer, stability=None) if _once(problem) else finer
        problem, u, tangent = starts.with_more(problem, u, tangent, method)
    corners = sum(point.kind == "fold" and not point.located for point in branch.points)
    return branch, problem, u, tangent, _joined(
        _FEW.format(method.count, error) if error > max(_NOTED, sampling or 0.0) else "",
        _CORNERS.format(corners) if corners and not problem.autonomous else "")


def _joined(*sentences: str) -> str:
    return " ".join(filter(None, sentences))


def _error_of_some(
    problem: HarmonicProblem, points: Sequence[BranchPoint], allowed: float
) -> float:
    """The largest error from few samples at some points of a branch."""
    # Static deflections do not slip.
    moving = problem.reference.shape[1]
    largest = int(np.argmax([_size(problem, np.asarray(point.u), moving) for point in points]))
    first, others = _examined(points, largest)
    error = _largest_error(problem, first, points)
    return error if error <= _FAR * allowed else max(
        error, _largest_error(problem, others, points))


def _examined(
    points: Sequence[BranchPoint], largest: int
) -> tuple[list[BranchPoint], list[BranchPoint]]:
    """Few points, evenly distributed, with the largest and the folds; others between them."""
    step = -(-len(points) // _LOOKED_AT)
    first = {k for k, point in enumerate(points)
             if k % (_SIXTH * step) == 0 or k == largest or point.kind == "fold"}
    others = sorted(set(range(0, len(points), step)) - first)
    return [points[k] for k in sorted(first)], [points[k] for k in others]


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

    A step with the matrix of the orbit leads to the orbits of twice the samples, at right angles to
    the tangent, so that at folds it is as long as elsewhere. The remaining residual with as many
    samples as the problem has is no error of theirs, and taken off. Kinks of laws make errors of
    order 1 / N^2, of which a fourth is left there: the error is four thirds of that step. Forces
    whose second half of a period mirrors the first are the same at an odd number of samples and at
    twice as many: these are taken four times.

    Its length is the root of three squares: the root mean square of harmonics 1 to H, relative to
    that of the orbit or ``least``, whichever is larger; the change of an unknown period, relative
    to it; that of the parameter, in widths of the diagram.
    """
    samples = problem.samples * (4 if problem.samples % 2 else 2)
    finer = replace(problem, samples=samples, predictor=BENT)
    try:
        linearised = problem.linearise(u)
        residual = finer.evaluate(u).residual - linearised.residual
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


def _largest_error(
    problem: HarmonicProblem, examined: Iterable[BranchPoint], points: Iterable[BranchPoint]
) -> float:
    """The largest such error of points of a branch, but for those on two branches.

    There the equations are singular with any last row; the points beside them tell the same.
    """
    least = _AT_REST * max(_size(problem, np.asarray(point.u)) for point in points)
    return max((sampling_error(problem, np.asarray(point.u), np.asarray(point.tangent), least)
                for point in examined if point.kind not in _ON_TWO), default=0.0)
