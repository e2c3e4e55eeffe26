"""Error that few samples a period make in orbits by harmonic balance."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array


def sampling_error(problem: HarmonicProblem, u: Array) -> float:
    """Estimate of the error of an orbit u relative to its size; infinite where there is none.

    One step of Newton's method leads to the orbit of twice the samples, at the same parameter.
    Kinks of laws make errors of order 1 / N^2, of which a fourth is left there: the error is four
    thirds of that step. Both are root mean squares of harmonics 1 to H, in the scales of the
    problem.
    """
    finer = replace(problem, samples=2 * problem.samples, before=(), bend=None)
    row = np.zeros_like(u)
    row[-1] = 1.0
    try:
        linearised = finer.linearise(u)
        step = linearised.solve(row, -np.append(linearised.residual, 0.0))
    except AnalysisError:
        return np.inf
    weights = problem.weights()[problem.reference.shape[1] : problem.size]
    size, off = (float(np.sqrt(weights @ x[problem.reference.shape[1] : problem.size] ** 2))
                 for x in (u, step))
    return 4.0 / 3.0 * off / size if size > 0.0 and np.isfinite(off) else np.inf


def largest_error(problem: HarmonicProblem, points: Iterable[BranchPoint]) -> float:
    """The largest such error of the points of a branch."""
    return max(sampling_error(problem, np.asarray(point.u)) for point in points)
