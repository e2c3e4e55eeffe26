"""Plain steps of a branch of forced orbits, made by compiled code, with all that points store.

What a call of :func:`~fecontact.bifurcation.harmonic.compiled.steps.steps` returns is examined as
a whole; it ends before the first step that needs more: a special point but a fold, a start met
again. Folds and the bound at the end are among its points.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit, weighted_norm
from fecontact.bifurcation.continuation.newton import Solution, completed
from fecontact.bifurcation.continuation.point import BranchHeader
from fecontact.bifurcation.continuation.points import branch_points
from fecontact.bifurcation.continuation.predictor import Bent
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, Stride
from fecontact.bifurcation.harmonic.compiled import arrays
from fecontact.bifurcation.harmonic.compiled.steps import BOUND, COUPLED, steps
from fecontact.bifurcation.harmonic.layout import orbit_weights
from fecontact.bifurcation.harmonic.stability import along_orbits
from fecontact.bifurcation.orbits.floquet import Floquet
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Points in the first and in later calls, numbers that a call may return, and entries of derivatives
# at the samples that it may make (a second or so, in which it cannot be interrupted).
_FIRST, _LATER, _NUMBERS, _ENTRIES = 8, 64, 4_000_000, 8_000_000
# Without stability there is nothing to look at but the start.
_WITHOUT_STABILITY = 512
# Steps that are made one by one where modes cannot be separated, before compiled code is tried.
_APART = 10
# Steps shorter than this part of the first one are made one by one: they may lead to a corner.
_SHORTEST = 1e-2


@dataclass(eq=False)
class StepBatches:
    """Makes plain steps of a :class:`fecontact.bifurcation.harmonic.problem.HarmonicProblem`.

    Attributes
    ----------
    options : ContinuationOptions
        Of the branch.
    count : int
        Points in the next call.
    waits : int
        Calls from now on that make no steps.
    """

    options: ContinuationOptions
    count: int = _FIRST
    waits: int = 0

    @classmethod
    def of(cls, problem: Any, options: ContinuationOptions) -> "StepBatches | None":
        """Steps of a problem; None if it has no compiled code."""
        if problem.compiled is None:
            return None
        return cls(options, _FIRST if problem.stability is not None else _WITHOUT_STABILITY)

    def start(self, problem: Any, u: Array, row: Array) -> Solution | None:
        """The solution at right angles to a row near u; None where it is not found."""
        found = problem.found(u, row, self.options.tolerance)
        if found is None:
            return None
        u, along, forces, mean, z = found
        values = None if problem.stability is not None else problem.stored(
            u[None], z[None], forces[None], mean[None],
            problem.sizes[None], {})[0]
        return completed(problem, u, problem.linearise(u),
                         along / weighted_norm(problem.weights(), along), 1, self.options, values)

    def batch(
        self, problem: Any, here: Solution, step: float, most: int, start: Solution,
        header: BranchHeader | None = None,
    ) -> Stride | None:
        """Plain steps from a solution; see :class:`Stride`. None where there are none.

        Events, and stability by other means, need points one by one.
        """
        if self.options.events or problem.stability not in (None, "transitions"):
            return None
        if self.waits > 0:
            self.waits -= 1
            return None
        e = problem.equations(float(here.u[-1]))
        if e is None or (here is start and problem.layout.memory):
            return None
        options = self.options
        e.numbers[arrays.FIRST_BOUND : arrays.RESTS] = [
            *options.bounds, options.tolerance, options.largest_step, options.largest_turn,
            problem.rounding.steps, options.locate and "fold" not in options.stop_at]
        if problem.limits is not None:
            e.limits[:] = problem.limits[: len(e.limits)]
        else:
            e.limits[:] = problem.scales[: len(e.limits)]
        n, m, N = len(here.u), problem.layout.displacements, problem.samples
        c = problem.layout.memory
        count = max(1, min(most, self.count, _NUMBERS // (N * (m + c) + 2 * n),
                           max(_FIRST, _ENTRIES // (N * (m + c) ** 2))))
        out = arrays.Reached(
            np.empty((count, n)), np.empty((count, n)), np.empty((count, N, c)),
            np.empty((count, N, m)), np.empty((count, m, 2 * m)), np.empty((count, m + 1)),
            np.empty(count), np.empty(count, dtype=np.int64), np.array([step]))
        why = np.empty(1)
        known = problem.predictor.bend
        bend = np.zeros(n) if known is None else known.copy()
        scales = np.append(problem.scales[:m], problem.scales[-1])
        made = steps(here.u.copy(), here.tangent.copy(), bend, scales, e, out, why)
        self.waits = _APART if why[0] == COUPLED else 0
        bound = why[0] == BOUND
        if not bound:
            made = self._before_corner(made, out)
        if made == 0:
            return None
        return self._seen(problem, here, made, out, e, start, header, bound)

    def _before_corner(self, made: int, out: arrays.Reached) -> int:
        """Number of points before steps that shorten towards a corner without end."""
        lengths, shortest = out.lengths[:made], _SHORTEST * self.options.step
        if out.step[0] >= shortest or not (lengths < shortest).any():
            return made
        made = int(np.argmax(lengths < shortest))
        out.step[0] = lengths[made - 1] if made else shortest
        return made

    def _seen(
        self, problem: Any, here: Solution, made: int, out: arrays.Reached,
        e: arrays.Equations, start: Solution, header: BranchHeader | None, bound: bool,
    ) -> Stride | None:
        """The points that were reached before the first step at which something happens."""
        m = problem.layout.displacements
        u, tangents, folds = out.u[:made], out.tangent[:made], out.folds[:made].tolist()
        found: list[Floquet] = []
        known: dict[str, Any] = {}
        if problem.stability is not None:
            found = along_orbits(problem, u, out.z[:made], e)
            known = {"multipliers": [each.multipliers for each in found],
                     "unstable": [each.unstable for each in found],
                     "stable": [each.stable for each in found], "trivial_error": [0.0] * made}
        sizes = np.vstack([np.append(problem.scales[:m], problem.scales[-1]),
                           out.scales[: made - 1]])
        whole = self._before_start(problem, here, start, u, sizes, out.lengths[:made])
        if problem.stability is not None and self.options.locate:
            whole = self._before_changes(problem, here, found, tangents, folds, whole)
        later = _LATER if problem.stability is not None else _WITHOUT_STABILITY
        self.count = later if whole == made else max(_FIRST, min(self.count // 2, 2 * whole))
        # The last tangent is made exact: later steps rely on its signs.
        while 0 < whole < made and (folds[whole - 1] or not self._made_exact(
                problem, u[whole - 1], _weights(problem, sizes[whole - 1]),
                tangents[whole - 1])):
            whole -= 1
        if whole == 0:
            return None
        # Points keep copies of their own rows, not the whole arrays.
        u, tangents = u[:whole].copy(), tangents[:whole].copy()
        values = problem.stored(
            u, *(each[:whole].copy() for each in (out.z, out.forces, out.mean, out.scales[:, :m])),
            {name: column[:whole] for name, column in known.items()})
        points = branch_points(u, tangents, values, folds[:whole], header)
        count = whole - sum(folds[:whole])
        if bound and whole == made:
            return Stride(points, count, problem, here, here, float(out.step[0]),
                          BranchStatus.BOUND)
        last = whole - 1
        scales = problem.scales.copy()
        scales[:m], scales[-1] = out.scales[last, :m], out.scales[last, m]
        grown = not np.array_equal(scales, problem.scales)
        # The last step began at a regular point: folds lie within steps.
        first = last - 1
        while first >= 0 and folds[first]:
            first -= 1
        before = tangents[first] if first >= 0 else here.tangent
        bend = None if grown else (tangents[last] - before) / out.lengths[last]
        tangent = tangents[last]
        if grown:
            tangent = tangent / np.sqrt(_weights(problem, out.scales[last]) @ tangent**2)
        reached = replace(
            problem, reference=problem.coefficients(u[last]).copy(),
            values=problem.parameters(u[last]), scales=scales,
            predictor=Bent.of(u[last], tangent, bend))
        ends = [Solution(u[k], reached.linearise(u[k]), way, 0, values[k],
                         _tests(problem, found[k] if found else None, way)
                         if self.options.locate else {})
                for k, way in ((first, before), (last, tangent)) if k >= 0]
        step = float(out.step[0]) if whole == made else float(min(
            1.5 * out.lengths[last], self.options.largest_step))
        return Stride(points, count, reached, ends[-1], ends[0] if first >= 0 else here, step)

    def _before_start(
        self, problem: Any, here: Solution, start: Solution, u: Array, scales: Array,
        lengths: Array,
    ) -> int:
        """Number of points before the first step that may meet the start of the branch again."""
        if len(start.u) != u.shape[1]:
            return len(u)
        width = float(problem.scales[-1])
        distances = np.abs(u[:, -1] - start.u[-1]) / width
        near = np.flatnonzero(distances <= 6.0 * lengths)
        if here is start:
            # The parameter does not come back to the start before it turns.
            p = u[:, -1]
            turned = np.flatnonzero((p[1:] - p[:-1]) * (p[0] - start.u[-1]) <= 0.0)
            near = near[near > turned[0]] if len(turned) else near[:0]
        # With several periods of the forcing in another phase.
        if problem.periods != 1:
            ends = np.append(abs(float(here.u[-1] - start.u[-1])) / width, distances)
            near = near[np.minimum(ends[near], ends[near + 1]) <= lengths[near]]
            return int(near[0]) if len(near) else len(u)
        if not len(near):
            return len(u)
        before = np.where(near[:, None] > 0, u[near - 1], here.u)
        weights, chord, off = _weights(problem, scales[near]), u[near] - before, start.u - before
        square = (weights * chord**2).sum(axis=1)
        met = near[((weights * off**2).sum(axis=1) < 9.0 * square)
                   & ((weights * chord * off).sum(axis=1) > -0.1 * square)]
        return int(met[0]) if len(met) else len(u)

    def _before_changes(
        self, problem: Any, here: Solution, found: list[Floquet], tangents: Array,
        folds: list[int], most: int,
    ) -> int:
        """Number of points before the first step on which a test or the stability changes.

        At a fold one multiplier passes one.
        """
        previous, unstable, turn = here.tests, here.values["unstable"], None
        for k in range(most):
            if folds[k]:
                turn = k
                continue
            tested = _tests(problem, found[k], tangents[k])
            changed = any(previous.get(name, 0.0) * value <= 0.0 for name, value in tested.items()
                          if turn is None or name != "fold")
            if changed or abs(found[k].unstable - unstable) != (turn is not None):
                return k if turn is None else turn
            previous, unstable, turn = tested, found[k].unstable, None
        return most

    def _made_exact(
        self, problem: Any, u: Array, weights: Array, tangent: Array
    ) -> bool:
        """Replace a tangent by that of the equations at u itself; False if its slope changes sign.

        Tangents come from the derivatives where Newton's method began.
        """
        try:
            exact = problem.linearise(u).solve(weights * tangent, unit(len(u)))
        except AnalysisError:
            return False
        exact = exact / np.sqrt(weights @ exact**2)
        if not np.isfinite(exact).all() or exact[-1] * tangent[-1] <= 0.0:
            return False
        tangent[:] = exact
        return True


def _tests(problem: Any, floquet: Floquet | None, tangent: Array) -> dict[str, float]:
    slope = float(tangent[-1])
    if floquet is None:
        return {"fold": slope}
    return {"fold": slope, **floquet.tests(slope / float(problem.scales[-1]))}


def _weights(problem: Any, scales: Array) -> Array:
    """Weights (..., n + 1) for scales (..., m + 1)."""
    return orbit_weights(scales[..., :-1], scales[..., -1:], len(problem.reference))
