"""Attractors: motions on which others settle, distinguished by their states on a section."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.bifurcation.attractors.labels import Motions, Settled, label_runs
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers

Kind = Literal["equilibrium", "periodic", "aperiodic"]
_KINDS: tuple[Kind, ...] = ("equilibrium", "periodic", "aperiodic")  # in the order of their numbers


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Attractor:
    """A motion that others settle on.

    Attributes
    ----------
    kind : 'equilibrium', 'periodic' or 'aperiodic'
        The last where its section has more points than were kept, or none that repeat.
    points : (k, size) array
        States on its section, each once; its place for an equilibrium.
    share : float
        Part of the starts that lead to it.
    """

    kind: Kind
    points: Array
    share: float


def distinguished(
    parts: Iterable[Callable[[], Settled]], scale: Array, tolerance: float,
) -> tuple[Integers, tuple[Attractor, ...]]:
    """Label (E,) of each run, and the motions by frequency, the most frequent first.

    States are the same where they differ by less than ``tolerance`` times ``scale`` (size,).
    Periodic motions are the same if every point of each is near one of the other, aperiodic ones
    if they fill the same box to a fifth of its size.
    """
    labels: list[Integers] = []
    motions = _workspace(0, 1, len(scale))
    for read in parts:
        found = read()
        found = found._replace(points=np.ascontiguousarray(found.points))
        label = np.full(len(found.rows), -1)
        if motions.points.shape[1] < found.points.shape[1] or not len(motions.rows):
            motions = _grown(motions, 8, found.points.shape[1])
        reached = 0
        while reached < len(label):
            reached = int(label_runs(reached, found, scale, tolerance, label, motions))
            if reached < len(label):
                motions = _grown(motions, 2 * len(motions.rows), motions.points.shape[1])
        labels.append(label)
    every = np.concatenate(labels)
    number = int(motions.number[0])
    counts = np.bincount(every[every >= 0], minlength=number)
    order = np.argsort(-counts, kind="stable")
    rank = np.empty(number, dtype=np.int64)
    rank[order] = np.arange(number)
    every[every >= 0] = rank[every[every >= 0]]
    return every, tuple(
        Attractor(_KINDS[motions.kind[k]], motions.points[k, : motions.rows[k]].copy(),
                  counts[k] / len(every)) for k in order)


def _workspace(number: int, rows: int, size: int) -> Motions:
    return Motions(np.zeros((number, rows, size)), np.zeros(number, dtype=np.int64),
                    np.zeros(number, dtype=np.int64), np.zeros(1, dtype=np.int64))


def _grown(motions: Motions, number: int, rows: int) -> Motions:
    """Motions in larger arrays, for ``number`` motions of ``rows`` states."""
    count = int(motions.number[0])
    made = _workspace(max(number, count), rows, motions.points.shape[2])
    made.points[:count, : motions.points.shape[1]] = motions.points[:count]
    made.rows[:count], made.kind[:count] = motions.rows[:count], motions.kind[:count]
    made.number[0] = count
    return made
