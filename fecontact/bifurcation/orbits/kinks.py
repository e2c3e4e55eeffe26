"""Kinks of the Jacobian along an orbit, where the second derivative of the vector field jumps.

Let f_xx jump by D across a surface s(x) = 0 with normal n, as friction with exp(-b |v|) does at
zero slip, and let the orbit pass the surface at the time tau with the rate s'. The Jacobian along
the orbit then has a kink: its slope in time jumps by K = |s'| D n^T. The third derivative has a
delta there, and along a direction v

    int w f_xxx v v v dt = ... + w (K v) r^2,    r = (n v) / s'

at the kink, where r is the shift of the time of passage. The jump of f_xx v in time is r K, which
gives r.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.orbits.collocation_equations import CollocationLinearisation
from fecontact.core.types import Array, Integers

# Samples of an interval in which the largest bend is sought, bisections about it, those before
# the first judgement, and the least part of the bend that two bisections leave: of a smooth
# Jacobian they leave a quarter or less, of a kink half or more.
_SAMPLES, _BISECTIONS, _FIRST, _LEFT = 16, 14, 3, 0.35
# Distance from a kink at which slopes to both sides are taken, in intervals; largest relative
# difference of the jump from that over twice the distance.
_BESIDE, _AGREEMENT = 1.0 / 64.0, 0.2
# Largest change of a Jacobian by rounding and by its own differences, in its size.
_ROUNDING = 1e-7
# Largest and smallest step along a direction, in ranges of the states.
_STEP, _LEAST_STEP = 1e-4, 1e-10
# Numbers in an array of Jacobians of which intervals are searched at once.
_AT_ONCE = 200_000


class Passage(NamedTuple):
    """One kink of the Jacobian.

    Attributes
    ----------
    interval : int
    place : float
        Position in the interval, 0 to 1.
    jump : (d, d) array
        K, per period of the orbit.
    error : float
        Relative error of K.
    """

    interval: int
    place: float
    jump: Array
    error: float


class JacobianKinks:
    """All kinks of the Jacobian along an orbit by collocation."""

    def __init__(self, linearised: CollocationLinearisation) -> None:
        self._at, self._problem = linearised, linearised.problem
        m = self._problem.degree
        self._of_nodes = np.linalg.inv(np.vander(np.linspace(0.0, 1.0, m + 1)))
        self._of_points = np.linalg.inv(np.vander(self._problem.rule.points))
        nodes = self._problem.nodes(linearised.u)
        closed = np.concatenate([nodes, nodes[:1]])
        self._states = closed[np.arange(self._problem.intervals)[:, None] * m + np.arange(m + 1)]
        rows = max(1, _AT_ONCE // nodes.shape[1] ** 2)
        every = np.arange(self._problem.intervals)
        self.passages = [passage for start in range(0, len(every), rows)
                         for passage in self._found(every[start : start + rows])]

    def second(self, direction: Array, step: float, span: Array) -> tuple[Array, Array]:
        """Correction (N m, d, d) of second differences of the Jacobian, and its error.

        Parameters
        ----------
        direction : (N m, d) array
            v at the Gauss points.
        step : float
            Step h of the differences (-J(2h) + 16 J(h) - 30 J(0) + 16 J(-h) - J(-2h)) / 12 h^2.
        span : (d,) array
            Ranges of the states.

        Returns
        -------
        correction : (N m, d, d) array
            The delta of each kink, spread over the Gauss points of its interval, without what the
            differences at points beside the kink contain of it.
        error : (N m, d, d) array
        """
        problem, m = self._problem, self._problem.degree
        out = np.zeros((len(direction), direction.shape[1], direction.shape[1]))
        errors = np.zeros_like(out)
        for passage in self.passages:
            j = passage.interval
            r, error = self._shift(passage, direction[j * m : (j + 1) * m], span)
            basis = (np.vander([passage.place], m) @ self._of_points)[0]
            parts = np.zeros(len(direction))
            parts[j * m : (j + 1) * m] = r * r * basis / (problem.rule.weights * problem.widths[j])
            time = problem.mesh[j] + passage.place * problem.widths[j]
            off, a = np.abs((problem.times - time + 0.5) % 1.0 - 0.5), step * abs(r)
            one, two = (np.abs(off + k * a) + np.abs(off - k * a) - 2.0 * off for k in (1.0, 2.0))
            parts -= np.where(off < 2.0 * a, (16.0 * one - two) / (24.0 * step * step), 0.0)
            rows = np.flatnonzero(parts)
            change = parts[rows, None, None] * passage.jump
            out[rows] += change
            errors[rows] += error * change
        return out, errors

    def _found(self, intervals: Integers) -> list[Passage]:
        """Kinks in some intervals, at most one in each."""
        quarter = 1.0 / _SAMPLES
        every = np.stack([self._jacobians(intervals, np.full(len(intervals), k * quarter))
                          for k in range(-3, _SAMPLES + 4)])
        second = every[2:] + every[:-2] - 2.0 * every[1:-1]
        jumps = np.abs(second[2:-2] - (second[:-4] + second[4:]) / 2.0).max(axis=(2, 3))
        sharpest = jumps.argmax(0)
        centre = sharpest * quarter
        J = [every[sharpest + k, np.arange(len(intervals))] for k in range(1, 6)]
        sizes: list[Array] = []
        for level in range(_BISECTIONS):
            second = np.array([J[k - 1] + J[k + 1] - 2.0 * J[k] for k in (1, 2, 3)])
            # A kink bends the first or the third, not both: the smaller one is the smooth part.
            outer = np.abs(second[::2]).max(axis=(2, 3))
            smooth = np.where((outer[0] < outer[1])[:, None, None], second[0], second[2])
            found = np.abs(second - smooth).max(axis=(2, 3))
            largest = found.argmax(axis=0)
            sizes.append(found.max(axis=0) / quarter)
            kept = np.full(len(intervals), True)
            if level >= _FIRST:
                kept = (sizes[-1] > 0.0) & (sizes[-1] >= _LEFT * sizes[-3])
            every, chosen = np.stack(J), largest + 1
            rows = np.flatnonzero(kept)
            ends = [every[chosen[rows] + k, rows] for k in (-1, 0, 1)]
            centre = (centre + (chosen - 2) * quarter)[rows]
            intervals, sizes = intervals[rows], [size[rows] for size in sizes]
            quarter /= 2.0
            if not len(rows):
                return []
            left, right = (self._jacobians(intervals, centre + k * quarter) for k in (-1, 1))
            J = [ends[0], left, ends[1], right, ends[2]]
        return [passage for j, place in zip(intervals.tolist(), centre.tolist(), strict=True)
                if (passage := self._passage(j, place)) is not None]

    def _passage(self, j: int, place: float) -> Passage | None:
        """The kink at a place, None if the slope of the Jacobian does not jump there."""
        sides = np.array([-6.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0]) * _BESIDE
        J = dict(zip((sides / _BESIDE).astype(int).tolist(), self._jacobians(
            np.full(len(sides), j), place + sides), strict=True))

        def jump(k: int) -> Array:
            # Slopes at the kink, by parabolas through three points on one side of it.
            after, before = ((8.0 * J[s * 2 * k] - 5.0 * J[s * k] - 3.0 * J[s * 3 * k]) / 2.0
                             for s in (1, -1))
            return np.asarray((after + before) / (k * _BESIDE * self._problem.widths[j]))

        near, far = jump(1), jump(2)
        size, change = np.abs(near).max(), np.abs(near - far).max()
        noise = _ROUNDING * np.abs(J[0]).max() / (_BESIDE * self._problem.widths[j])
        if not (0.0 <= place < 1.0 and size > noise and change <= _AGREEMENT * size):
            return None
        return Passage(j, place, near, float(change / size))

    def _shift(self, passage: Passage, direction: Array, span: Array) -> tuple[float, float]:
        """Shift r of the time of passage along a direction (m, d), and its relative error."""
        j, place, K, m = passage.interval, passage.place, passage.jump, len(direction)
        largest = float(np.max(np.abs(direction) / span))
        if largest == 0.0:
            return 0.0, 0.0
        width = float(self._problem.widths[j])
        sides = np.array([-2.0, -1.0, 1.0, 2.0]) * _BESIDE + place
        basis = np.vander(np.append(sides, place), m) @ self._of_points
        moves, v = basis[:-1] @ direction, basis[-1] @ direction
        slopes = self._of_nodes[:-1] * np.arange(m, 0, -1)[:, None]
        rate = (np.vander([place], m) @ slopes)[0] @ self._states[j] / width
        # Moved states must stay on their side of the surface.
        along, across = float(np.abs(K @ v).max()), float(np.abs(K @ rate).max())
        step = min(_STEP / largest, 0.25 * _BESIDE * width * across / max(along, 1e-300))
        step = max(step, _LEAST_STEP / largest)
        found = [self._ratio(passage, sides, moves, part * step) for part in (1.0, 0.5, 0.25)]
        # At one of them the differences of a Jacobian may reach across the kink.
        (r, error), (other, _) = min(pairwise(found), key=lambda two: abs(two[0][0] - two[1][0]))
        return r, passage.error + error + abs(r - other) / max(abs(r), abs(other), 1e-300)

    def _ratio(
        self, passage: Passage, places: Array, moves: Array, h: float
    ) -> tuple[float, float]:
        """Jump of f_xx v over K, from two places before the kink and two behind, and its error.

        The relative error is what the jump has in other directions than K.
        """
        j, K = np.full(len(places), passage.interval), passage.jump
        first = (self._jacobians(j, places, h * moves) - self._jacobians(j, places, -h * moves)) / (
            2.0 * h)
        jump = 2.0 * (first[2] - first[1]) - (first[3] - first[0])
        r, size = float((jump * K).sum() / (K * K).sum()), float(np.abs(jump).max())
        return r, float(np.abs(jump - r * K).max()) / size if size > 0.0 else 0.0

    def _jacobians(self, intervals: Integers, places: Array, moves: Array | float = 0.0) -> Array:
        """Jacobians (k, d, d) at places in intervals (k,), beside the orbit by moves (k, d)."""
        problem = self._problem
        basis = np.vander(places, problem.degree + 1) @ self._of_nodes
        x = np.einsum("kn,knd->kd", basis, self._states[intervals]) + moves
        times = np.zeros(len(x))
        if not problem.autonomous:
            times = (problem.mesh[intervals] + places * problem.widths[intervals]) * self._at.period
        x, values = np.ascontiguousarray(x), problem.parameters(self._at.u)
        # Those at the points of the orbit have been checked; these need not be once more.
        found = problem.field.rough_derivatives(times, x, values, (), problem.ranges, None)
        return (found or problem.field.derivatives(times, x, values, ()))[1]
