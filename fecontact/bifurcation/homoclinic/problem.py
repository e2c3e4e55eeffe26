"""Continuation problem of orbits homoclinic to a saddle, over two parameters.

On an interval of length T about the excursion, x' = f(x, p) is solved by collocation with

    f(s, p) = 0                    the saddle s
    L_s (x(0) - s) = 0             the orbit leaves along the unstable subspace
    L_u (x(T) - s) = 0             and comes back along the stable one
    int <x, y'> dt = int <y, y'> dt   phase, y is the orbit before

where the rows of L_s and L_u span the left invariant subspaces of df/dx(s, p). The error of the
truncation falls as that of the tangents to the manifolds, in the square of the distances of both
ends from the saddle and faster (Beyn, IMA J. Numer. Anal. 10, 1990). T follows these distances.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.problem import BranchStatus, Problem
from fecontact.bifurcation.continuation.rounding import RestingParameter, Rounding
from fecontact.bifurcation.homoclinic import open_mesh
from fecontact.bifurcation.homoclinic.linearisation import HomoclinicLinearised, OpenOrbit
from fecontact.bifurcation.homoclinic.saddle import (
    Saddle,
    discriminant,
    flown,
    leading_rows,
    left_subspaces,
    saddle_of,
)
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.system.complex_modes import sorted_eigenvalues

# Distance of both ends from the saddle, in that of the farthest point, and the factor by which it
# may differ before the interval is lengthened or shortened.
DISTANCE, _WITHIN = 3e-4, 3.0
# Longest new interval, and longest step on a piece of linear flow, in the time of its rate.
_LONGEST, _STEP = 10.0, 0.4
# Lengthening of the interval for the error of the truncation, as a factor of the distances.
_LONGER = 10.0
# Amplitude and rates of the saddle, in the largest ones of the curve, at which it ends.
_LEAST, _SLOWEST = 1e-2, 0.2
# Part of an orbit, or of its adjoint solution, along a leading direction that is rounding.
_ABSENT = 1e-4
# Ratio of its rates at which the saddle counts as one that meets another equilibrium.
_MEETS = 1e-3


class _FlipRounding(RestingParameter):
    def kinds(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """Turns of a parameter that rests, and flips where nothing lies along the direction."""
        absent = {name for name in tests[0] if name.endswith("flip")
                  and max(abs(side.get(name, np.inf)) for side in tests) < _ABSENT}
        return super().kinds(tangents, values, tests) | absent


@dataclass(frozen=True, eq=False)
class HomoclinicProblem(OpenOrbit, Problem):
    """The problem of following homoclinic orbits; see :class:`OpenOrbit`.

    Attributes
    ----------
    leading : pair of (d,) arrays or None
        Left eigenvectors of the leading eigenvalues of the saddle of the orbit before, unstable
        and stable, where these are real.
    intervals : int
        Number of intervals after each step.
    distance : float
        Distance of both ends from the saddle to which T is fitted, in the farthest one.
    largest : (float, float)
        Largest amplitude and largest rate of the saddle up to here.
    """

    leading: tuple[Array | None, Array | None] = (None, None)
    intervals: int = 60
    distance: float = DISTANCE
    largest: tuple[float, float] = (0.0, 0.0)

    def linearise(self, u: Array) -> HomoclinicLinearised:
        """The equations about u."""
        return HomoclinicLinearised(self, u)

    @cached_property
    def _weights(self) -> Array:
        shares = np.repeat(np.diff(self.mesh) / self.degree, self.degree)
        shares = np.append(shares, shares[-1])
        return np.concatenate([(shares[:, None] / self.sizes**2).reshape(-1), self.scales[:-2]**-2,
                               self.scales[-2:]**-2])

    def weights(self) -> Array:
        """Mean over the interval of the scaled states, the saddle, both parameters."""
        return self._weights

    def saddle(self, u: Array) -> Saddle:
        """The saddle in units of the scales.

        Raises
        ------
        AnalysisError
            If the equilibrium is no saddle.
        """
        _, J, _ = self.field.derivatives(np.zeros(1), self.rest(u)[None], self.parameters(u))
        return saddle_of(J[0] * self.sizes / self.sizes[:, None])

    def away(self, u: Array) -> Array:
        """Differences (N m + 1, d) of the orbit from the saddle, in units of the scales."""
        return np.asarray((self.nodes(u) - self.rest(u)) / self.sizes)

    def amplitude(self, u: Array) -> float:
        """Largest distance from the saddle, in units of the scales."""
        return float(np.linalg.norm(self.away(u), axis=1).max())

    def distances(self, u: Array) -> tuple[float, float]:
        """Distances of both ends from the saddle, in the largest one."""
        whole = np.linalg.norm(self.away(u), axis=1)
        return float(whole[0] / whole.max()), float(whole[-1] / whole.max())

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Both parameters, the saddle, the interval, extremes, and the error of the truncation."""
        nodes = self.nodes(u)
        return {**self.named(u), "saddle": self.rest(u).copy(),
                "eigenvalues": sorted_eigenvalues(linearisation.jacobian), "time": self.time,
                "mesh": self.mesh, "minimum": nodes.min(axis=0), "maximum": nodes.max(axis=0),
                "end_distance": max(self.distances(u)),
                "truncation_error": self.truncation_error(u, tangent)}

    def truncation_error(self, u: Array, tangent: Array) -> float:
        """Change of the parameters, in widths of the diagram, by a Newton step on more time."""
        try:
            rates = self.saddle(u).rates
            more = [float(np.log(_LONGER)) / rate for rate in rates]
            problem, longer, turned = self.stretched(u, tangent, more[0], more[1])
            linearised = problem.linearise(longer)
            change = linearised.solve(problem.weights() * turned,
                                      -np.append(linearised.residual, 0.0))
        except FecontactError:
            return float("nan")
        return float(np.abs(change[-2:] / self.scales[-2:]).max())

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
        """Test functions of neutral saddles, double leading eigenvalues and flips."""
        saddle = self.saddle(u)
        out, back = saddle.rates
        found = {"neutral saddle": (out - back) / (out + back)}
        away, whole = self.away(u), self.amplitude(u)
        first, last, apart = linearisation.adjoint
        # Of one sign along the curve, to which the direction is at right angles.
        along = tangent[-2:] / self.scales[-2:]
        turn = float(np.sign(apart[0] * along[1] - apart[1] * along[0]))
        for name, leading, end, rate, known, adjoint in (
                ("unstable", saddle.unstable, away[0], out, self.leading[0], last),
                ("stable", saddle.stable, away[-1], back, self.leading[1], first)):
            value = discriminant(leading)
            if value is not None:
                found[f"{name} double eigenvalue"] = value
            rows = leading_rows(saddle.jacobian, leading[0])
            if value is not None and known is not None and rows is not None:
                # In units of the leading part at the middle, which does not depend on T.
                grown = np.exp(min(0.5 * rate * self.time, 100.0))
                side = float(np.sign(rows[0] @ known))
                found[f"{name} orbit flip"] = side * grown * float(rows[0] @ end) / whole
                found[f"{name} inclination flip"] = side * turn * grown * float(
                    (adjoint * self.sizes) @ rows[1])
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> Mapping[str, Any] | None:
        """A point where one parameter turns is no fold but a turning point."""
        return {"kind": "turning point"} if kind == "fold" else {}

    @property
    def rounding(self) -> Rounding:
        """Turns of a parameter that rests, flips where there is no part along the direction."""
        return _FlipRounding(float(self.scales[-1]))

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """HOPF where orbit and rates vanish, SADDLE_NODE where one rate does, else None.

        Orbit and rates vanish together at a Bogdanov-Takens point.
        """
        amplitude, rates = self.amplitude(u), self.saddle(u).rates
        if amplitude < _LEAST * self.largest[0] and max(rates) < _SLOWEST * self.largest[1]:
            return BranchStatus.HOPF
        return BranchStatus.SADDLE_NODE if min(rates) < _MEETS * max(rates) else None

    def adapted(self, u: Array, tangent: Array) -> "tuple[HomoclinicProblem, Array, Array]":
        """The problem for the next step: interval, mesh, phase and subspaces for this orbit."""
        problem = self
        rates = self.saddle(u).rates
        wanted = [float(np.log(end / self.distance)) for end in self.distances(u)]
        if max(map(abs, wanted)) > np.log(_WITHIN):
            times = [max(min(part / rate, _LONGEST * self.time), -spare) for part, rate, spare in
                     zip(wanted, rates, self._spare_times(u), strict=True)]
            problem, u, tangent = self.stretched(u, tangent, times[0], times[1])
        mesh = open_mesh.equidistributed(problem.mesh, problem.nodes(u), self.degree,
                                         self.intervals)
        return problem._renewed(mesh, u, tangent)

    def _spare_times(self, u: Array) -> tuple[float, float]:
        """Times [s] at both ends within the distance from the saddle to which T is fitted.

        An orbit without a part along a leading direction takes less time than its rate says.
        """
        away = np.linalg.norm(self.away(u), axis=1)
        far = np.flatnonzero(away >= self.distance * away.max())
        times = open_mesh.node_times(self.mesh, self.degree) * self.time
        return float(times[far[0]]), float(self.time - times[far[-1]])

    def _renewed(
        self, mesh: Array, u: Array, tangent: Array
    ) -> "tuple[HomoclinicProblem, Array, Array]":
        """Problem, u and tangent on another mesh, with all that follows the orbit."""
        places = open_mesh.node_times(mesh, self.degree)
        moved, turned = (np.concatenate([open_mesh.interpolate(
            self.mesh, self.nodes(each), self.degree, places).reshape(-1), each[self.size :]])
            for each in (u, tangent))
        saddle = self.saddle(u)
        rows = [leading_rows(saddle.jacobian, leading[0])
                for leading in (saddle.unstable, saddle.stable)]
        leading = [None if row is None else row[0] if known is None or row[0] @ known >= 0.0
                   else -row[0] for row, known in zip(rows, self.leading, strict=True)]
        largest = (max(self.largest[0], self.amplitude(u)), max(self.largest[1], *saddle.rates))
        return replace(self, mesh=mesh, reference=moved[: len(places) * len(self.sizes)].reshape(
            len(places), -1).copy(), rows=left_subspaces(saddle.jacobian),
            leading=(leading[0], leading[1]), largest=largest), moved, turned

    def stretched(
        self, u: Array, tangent: Array, before: float, after: float
    ) -> "tuple[HomoclinicProblem, Array, Array]":
        """Problem, u and tangent with more time before and after, on linear flow, or with less.

        Negative times cut whole intervals off. The others keep their nodes.
        """
        saddle, m = self.saddle(u), self.degree
        steps = np.diff(self.mesh) * self.time
        parts = [self.away(u), (self.nodes(tangent) - self.rest(tangent)) / self.sizes]
        for side, more in enumerate((before, after)):
            ahead = side == 1
            if more < 0.0:
                cut = int(np.searchsorted(np.cumsum(steps[::-1] if ahead else steps), -more))
                keep = slice(0, len(steps) - cut) if ahead else slice(cut, None)
                steps = steps[keep]
                parts = [part[: len(part) - cut * m] if ahead else part[cut * m :]
                         for part in parts]
            elif more > 0.0:
                count = max(2, int(np.ceil(more * saddle.rates[side] / _STEP)))
                times = np.linspace(0.0, more, count * m + 1)[1:]
                fresh = [flown(saddle, part[-1 if ahead else 0], times if ahead else -times,
                               not ahead) for part in parts]
                added = np.full(count, more / count)
                steps = np.concatenate([steps, added] if ahead else [added, steps])
                parts = [np.concatenate([part, new] if ahead else [new[::-1], part])
                         for part, new in zip(parts, fresh, strict=True)]
        time = float(steps.sum())
        mesh = np.append(0.0, np.cumsum(steps) / time)
        mesh[-1] = 1.0
        found = [np.concatenate([(part * self.sizes + self.rest(each)).reshape(-1),
                                 each[self.size :]])
                 for part, each in zip(parts, (u, tangent), strict=True)]
        reference = found[0][: len(parts[0]) * len(self.sizes)].reshape(len(parts[0]), -1).copy()
        return replace(self, mesh=mesh, time=time, reference=reference), found[0], found[1]
