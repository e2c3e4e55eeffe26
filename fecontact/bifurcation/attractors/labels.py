"""Labels of runs by the motions on which they settle, in compiled code."""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Block, IntegerVector, Vector

EQUILIBRIUM, PERIODIC, APERIODIC = range(3)
_BOX = 0.2  # part of their size by which boxes of the same aperiodic motion may differ
# Of a motion that still settles, what is left between repeats: the most in each third of its
# points in parts of that in the third before, and in the last in parts of their box.
# Of fewer repeats than twelve, chaos might look so by chance.
_DECAY, _LEFT, _FEWEST = 0.7, 0.05, 12


class Settled(NamedTuple):
    """Last states of runs on a section, and whether the runs have settled.

    Attributes
    ----------
    points : (E, K, size) array
        Last states of each run on its section, the first ``rows`` of it.
    rows : (E,) integer array
        Number of these states; -1 for runs that could not go on or had not settled.
    still : (E,) integer array
        Whether the run is at rest, at its one point.
    """

    points: Block
    rows: IntegerVector
    still: IntegerVector


class Motions(NamedTuple):
    """Motions found so far, ``number[0]`` of them, and room for more.

    Attributes
    ----------
    points : (M, K, size) array
        States of each on its section, the first ``rows`` of it.
    rows, kind : (M,) integer arrays
        How many there are; EQUILIBRIUM, PERIODIC or APERIODIC.
    number : (1,) integer array
    """

    points: Block
    rows: IntegerVector
    kind: IntegerVector
    number: IntegerVector


@helper
def _period(points, count, scale, tolerance):
    """Number of points after which they repeat, or 0 if they do not."""
    for period in range(1, count // 2 + 1):
        repeats = True
        for k in range(count - period):
            for i in range(len(scale)):
                if not abs(points[k + period, i] - points[k, i]) < tolerance * scale[i]:
                    repeats = False
                    break
            if not repeats:
                break
        if repeats:
            return period
    return 0


@helper
def _settles(points, count, scale):
    """Whether the points come ever closer to a repetition, after some number of them."""
    largest = 0.0
    for i in range(len(scale)):
        low, high = points[0, i], points[0, i]
        for k in range(count):
            low, high = min(low, points[k, i]), max(high, points[k, i])
        largest = max(largest, (high - low) / scale[i])
    for period in range(1, min(count // 4, count - _FEWEST) + 1):
        pairs = count - period
        decays, before, apart = True, np.inf, 0.0
        for third in range(3):
            apart = 0.0
            for k in range(third * pairs // 3, (third + 1) * pairs // 3):
                for i in range(len(scale)):
                    apart = max(apart, abs(points[k + period, i] - points[k, i]) / scale[i])
            decays = decays and apart < _DECAY * before
            before = apart
        if decays and apart < _LEFT * largest:
            return True
    return False


@helper
def _all_near(one, first, last, other, begin, end, scale, most):
    """Whether every point of one is near a point of the other."""
    for k in range(first, last):
        near = False
        for j in range(begin, end):
            near = True
            for i in range(len(scale)):
                if not abs(one[k, i] - other[j, i]) < most * scale[i]:
                    near = False
                    break
            if near:
                break
        if not near:
            return False
    return True


@helper
def _same_box(one, first, last, other, count, scale, tolerance):
    """Whether two motions fill the same box, to a fifth of its size."""
    for i in range(len(scale)):
        low, high = one[first, i], one[first, i]
        for k in range(first, last):
            low, high = min(low, one[k, i]), max(high, one[k, i])
        lowest, highest = other[0, i], other[0, i]
        for k in range(count):
            lowest, highest = min(lowest, other[k, i]), max(highest, other[k, i])
        allowed = _BOX * max(high - low, highest - lowest) + tolerance * scale[i]
        if not max(abs(low - lowest), abs(high - highest)) <= allowed:
            return False
    return True


@helper
def _keep(points, first, last, kind, p, motions):
    """Make motion p that of these points."""
    for k in range(first, last):
        for i in range(points.shape[1]):
            motions.points[p, k - first, i] = points[k, i]
    motions.rows[p], motions.kind[p] = last - first, kind


@kernel
def label_runs(
    first: int, found: Settled, scale: Vector, tolerance: float, label: IntegerVector,
    motions: Motions,
) -> int:
    """Label runs from ``first`` on, and add the motions that are new; the run reached.

    Runs that could not go on, or still settle, have label -1.
    """
    for e in range(first, len(found.rows)):
        last = found.rows[e]
        label[e] = -1
        if last < 0:
            continue
        points, period, kind = found.points[e], 0, EQUILIBRIUM
        if not found.still[e]:
            period = _period(points, last, scale, tolerance)
            kind = PERIODIC if period > 0 else APERIODIC
            if period == 0 and _settles(points, last, scale):
                continue
        begin = last - period if period > 0 else 0
        for p in range(motions.number[0]):
            other, count = motions.points[p], motions.rows[p]
            if motions.kind[p] != kind:
                continue
            if kind == APERIODIC:
                same = _same_box(points, begin, last, other, count, scale, tolerance)
            else:
                same = _all_near(points, begin, last, other, 0, count, scale, 2.0 * tolerance) and (
                    _all_near(other, 0, count, points, begin, last, scale, 2.0 * tolerance))
            if same:
                label[e] = p
                # A run that has not quite settled repeats after a multiple of the period only.
                if last - begin < count and kind == PERIODIC:
                    _keep(points, begin, last, kind, p, motions)
                break
        if label[e] < 0:
            p = motions.number[0]
            if p == len(motions.rows):
                return e
            _keep(points, begin, last, kind, p, motions)
            motions.number[0] = p + 1
            label[e] = p
    return len(found.rows)
