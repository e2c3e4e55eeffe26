"""Plain steps of a branch of forced orbits, made by compiled code, with all that points store.

What a call of :func:`~fecontact.bifurcation.harmonic.compiled.steps.steps` returns is looked at as
a whole; it ends before the first step that needs more: a special point, a bound, a start met again.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.newton import Solution
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Stride
from fecontact.bifurcation.harmonic import estimates
from fecontact.bifurcation.harmonic.compiled import arrays
from fecontact.bifurcation.harmonic.compiled.steps import COUPLED, steps
from fecontact.bifurcation.harmonic.series import differentiated
from fecontact.bifurcation.harmonic.stability import along_orbits
from fecontact.bifurcation.orbits.floquet import Floquet
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Points in the first and in later calls, numbers that a call may return, and entries of derivatives
# at the samples that it may make (a second or so, in which it cannot be interrupted).
_FIRST, _LATER, _NUMBERS, _ENTRIES = 8, 64, 4_000_000, 8_000_000
# Without stability folds alone end a call, and compiled code sees these itself.
_WITHOUT_STABILITY = 256
# Steps that are made one by one where modes cannot be separated, before compiled code is tried.
_APART = 10
# Steps shorter than this part of the first one are made one by one: they may lead to a corner.
_SHORTEST = 1e-2


@dataclass(eq=False)
class Strides:
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
    def of(cls, problem: Any, options: ContinuationOptions) -> "Strides | None":
        """None where the steps of this problem are not made by compiled code."""
        if (problem.compiled is None or options.events
                or problem.stability not in (None, "transitions")):
            return None
        return cls(options)

    def stride(
        self, problem: Any, here: Solution, step: float, most: int, start: Solution
    ) -> Stride | None:
        """Plain steps from a solution; see :class:`Stride`. None where there are none."""
        if self.waits > 0:
            self.waits -= 1
            return None
        e = problem.equations(float(here.u[-1]))
        if e is None:
            return None
        options = self.options
        e.numbers[arrays.FIRST_BOUND :] = [
            *options.bounds, options.tolerance, options.largest_step, options.largest_turn,
            problem.rounding]
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
            np.array([step]))
        why = np.empty(1)
        bend = np.zeros(n) if problem.bend is None else problem.bend.copy()
        scales = np.append(problem.scales[:m], problem.scales[-1])
        made = steps(here.u.copy(), here.tangent.copy(), bend, scales, e, out, why)
        self.waits = _APART if why[0] == COUPLED else 0
        made = self._before_corner(problem, here, made, out)
        if made == 0:
            return None
        return self._seen(problem, here, made, out, e, start)

    def _before_corner(self, problem: Any, here: Solution, made: int, out: arrays.Reached) -> int:
        """Number of points before steps that shorten towards a corner without end."""
        weights, shortest = problem.weights(), _SHORTEST * self.options.step
        way = np.diff(np.vstack([here.u, out.u[:made]]), axis=0)
        lengths = np.sqrt((weights * way**2).sum(axis=1))
        if out.step[0] >= shortest or (lengths >= shortest).all():
            return made
        made = int(np.argmax(lengths < shortest))
        out.step[0] = lengths[made - 1] if made else shortest
        return made

    def _seen(
        self, problem: Any, here: Solution, made: int, out: arrays.Reached,
        e: arrays.Equations, start: Solution,
    ) -> Stride | None:
        """The points that were reached before the first step at which something happens."""
        m = problem.layout.displacements
        u, tangents = out.u[:made], out.tangent[:made]
        values = _values(problem, u, out, made)
        found: list[Floquet] = []
        if problem.stability is not None:
            found = along_orbits(problem, u, out.z[:made], e)
            for value, floquet in zip(values, found, strict=True):
                value |= {"multipliers": floquet.multipliers, "unstable": floquet.unstable,
                          "stable": floquet.stable, "trivial_error": 0.0}
        tests = [_tests(problem, found[k] if found else None, tangents[k], self.options)
                 for k in range(made)]
        weights = _weights(problem, np.vstack([np.append(problem.scales[:m], problem.scales[-1]),
                                               out.scales[: made - 1]]))
        before = np.vstack([here.u, u[:-1]])
        directions = np.vstack([here.tangent, tangents[:-1]])
        lengths = (weights * directions * (u - before)).sum(axis=1) / np.sqrt(
            (weights * directions**2).sum(axis=1))
        whole = self._eventless(problem, here, values, tests, start, u, weights, lengths)
        later = _LATER if problem.stability is not None else _WITHOUT_STABILITY
        self.count = later if whole == made else max(_FIRST, min(self.count // 2, 2 * whole))
        # The last tangent is made exact: what lies behind it relies on its signs.
        while whole > 0 and not self._made_exact(problem, u[whole - 1], weights[whole - 1],
                                                 tangents[whole - 1]):
            whole -= 1
        if whole == 0:
            return None
        last = whole - 1
        if "fold" in tests[last]:
            tests[last] = _tests(problem, found[last] if found else None, tangents[last],
                                 self.options)
        points = [Solution(u[k], None, tangents[k], 0, values[k], tests[k])  # type: ignore[arg-type]
                  for k in range(whole)]
        scales = problem.scales.copy()
        scales[:m], scales[-1] = out.scales[last, :m], out.scales[last, m]
        tangent = tangents[last] / np.sqrt(_weights(problem, out.scales[last : last + 1])[0]
                                           @ tangents[last]**2)
        grown = not np.array_equal(scales, problem.scales)
        bend = None if grown else (tangents[last] - directions[last]) / lengths[last]
        reached = replace(
            problem, reference=problem.coefficients(u[last]).copy(),
            values=problem.parameters(u[last]), scales=scales, before=(u[last], tangent),
            bend=bend)
        points[-1] = replace(points[-1], linearisation=reached.linearise(u[last]))
        previous = points[-2] if whole > 1 else here
        step = float(out.step[0]) if whole == made else float(min(
            1.5 * lengths[last], self.options.largest_step))
        return Stride(points, reached, replace(points[-1], tangent=tangent), previous, step)

    def _eventless(
        self, problem: Any, here: Solution, values: list[dict[str, Any]],
        tests: list[dict[str, float]], start: Solution, u: Array, weights: Array, lengths: Array,
    ) -> int:
        """Number of points before the first step at which something happens."""
        # The branch may meet its start again; with several periods of the forcing in another phase.
        before = np.vstack([here.u, u[:-1]])
        if problem.periods == 1 and len(start.u) == u.shape[1]:
            off = start.u - before
            chord = np.sqrt((weights * (u - before) ** 2).sum(axis=1))
            along = (weights * (u - before) * off).sum(axis=1) / chord
            near = np.sqrt((weights * off**2).sum(axis=1)) < 3.0 * chord
            met = np.flatnonzero(near & (along > -0.1 * chord))
        else:
            ends = np.abs(np.append(here.u[-1], u[:, -1]) - start.u[-1])
            met = np.flatnonzero(np.minimum(ends[:-1], ends[1:]) * np.sqrt(weights[:, -1])
                                 <= lengths)
        first = int(met[0]) if len(met) else len(u)
        one = here
        for k in range(first if self.options.locate else 0):
            tested, previous = tests[k], (one.tests if k == 0 else tests[k - 1])
            if any(previous.get(name, 0.0) * value <= 0.0 for name, value in tested.items()):
                return k
            if problem.stability is not None:
                known = one.values["unstable"] if k == 0 else values[k - 1]["unstable"]
                if values[k]["unstable"] != known:
                    return k
        return first


    def _made_exact(
        self, problem: Any, u: Array, weights: Array, tangent: Array
    ) -> bool:
        """Replace a tangent by that of the equations at u itself; False if its slope changes sign.

        Tangents come from the derivatives where Newton's method began.
        """
        unit = np.zeros(len(u))
        unit[-1] = 1.0
        try:
            exact = problem.linearise(u).solve(weights * tangent, unit)
        except AnalysisError:
            return False
        exact = exact / np.sqrt(weights @ exact**2)
        if not np.isfinite(exact).all() or exact[-1] * tangent[-1] <= 0.0:
            return False
        tangent[:] = exact
        return True


def _tests(
    problem: Any, floquet: Floquet | None, tangent: Array,
    options: ContinuationOptions,
) -> dict[str, float]:
    if not options.locate:
        return {}
    slope = float(tangent[-1])
    if floquet is None:
        return {"fold": slope}
    return {"fold": slope, **floquet.tests(slope / float(problem.scales[-1]))}


def _weights(problem: Any, scales: Array) -> Array:
    """Weights (K, n + 1) for scales (K, m + 1)."""
    over = np.full((2 * problem.harmonics + 1, 1), 0.5)
    over[0] = 1.0
    sizes = scales[:, None, :-1] ** -2.0
    return np.concatenate([(over * sizes).reshape(len(scales), -1), scales[:, -1:] ** -2.0], axis=1)


def _values(
    problem: Any, u: Array, out: arrays.Reached, made: int
) -> list[dict[str, Any]]:
    """What is stored of each point but its stability."""
    m = problem.layout.displacements
    X = u[:, :-1].reshape(made, -1, m)
    periods = (problem.periods * problem.turn / u[:, -1] if problem.turn is not None
               else np.full(made, problem.period(u[0])))
    speeds = np.moveaxis(differentiated(np.moveaxis(X, 1, 0)), 0, 1) / periods[:, None, None]
    low, high = estimates.extremes(np.concatenate([X, speeds], axis=2), out.z[:made])
    errors, residuals = estimates.neglected(X, out.forces[:made], out.mean[:made], periods,
                                            out.scales[:made, :m], m)
    found: list[dict[str, Any]] = [
        {"period": period, "truncation_error": error, "residual": residual, "minimum": low[k],
         "maximum": high[k]}
        for k, (period, error, residual) in enumerate(zip(
            periods.tolist(), errors.tolist(), residuals.tolist(), strict=True))]
    if problem.layout.memory:
        for k, value in enumerate(found):
            value["memory"] = out.z[k]
    return found
