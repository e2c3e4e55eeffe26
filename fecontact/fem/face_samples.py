"""Places on a face at which it looks for a partner, and the parts of it that have one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.face_curve import Closest, Face
from fecontact.fem.points import Pieces, piece_weights

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_CUTS = 4  # parts of an edge between whose ends one end of the other face can be found
_PARTS = 2  # of a piece, in each of which a uniform pressure is integrated
_INSET = 1e-6  # of an edge, from its ends
_HALVINGS = 40
_FACING = 0.1  # least cosine between opposed normals: 84 degrees
_SLACK = 1e-3  # of an edge: how far a node may lie beyond the end of the other face


@dataclass(frozen=True, eq=False)
class Samples:
    """Places on a face with the contact node they belong to and their share of it.

    ``places`` lie on the smooth face, ``straight`` on the mesh [m]; ``looks`` (k, 2, 2) are the
    outward normals of the edges on both sides of a place.
    """

    owner: Integers
    share: Array
    places: Array
    straight: Array
    looks: Array

    def mean(self, values: Array, size: int) -> Array:
        """Sums (size, ...) of values over the samples of each node, times their shares."""
        out = np.zeros((size, *values.shape[1:]))
        np.add.at(out, self.owner, self.share.reshape(-1, *[1] * (values.ndim - 1)) * values)
        return out

    def only(self, which: NDArray[np.bool_]) -> "Samples":
        """Samples selected by a mask (k,)."""
        return Samples(*(getattr(self, name)[which] for name in Samples.__dataclass_fields__))

    def closest(self, other: Face, reach: float) -> Closest:
        """Closest places of the samples on another face."""
        return other.closest(self.places, self.looks, reach, _FACING, _SLACK)


def node_samples(face: Face, nodes: Integers) -> Samples:
    """One sample at each of some displacement nodes of a face."""
    degree = face.body.degree
    edges, local = np.divmod(np.arange(face.nodes.size), degree + 1)
    first, last = (np.zeros(len(face.body.nodes), dtype=int) for _ in range(2))
    last[face.nodes.ravel()] = np.arange(face.nodes.size)
    first[face.nodes.ravel()[::-1]] = np.arange(face.nodes.size)[::-1]
    s = local / degree
    sides = [which[nodes] for which in (first, last)]
    looks = np.stack([face.outward(edges[side], s[side]) for side in sides], axis=1)
    places = face.at(edges[sides[0]], s[sides[0]])
    return Samples(np.arange(len(nodes)), np.ones(len(nodes)), places, face.body.nodes[nodes],
                   looks)


@dataclass(frozen=True, eq=False)
class Marks:
    """Places on a face, by edge and s, opposite to which an edge of the other face ends."""

    edges: Integers
    s: Array


def opposite_ends(face: Face, other: Face, reach: float) -> Marks:
    """Places on a face opposite to the kinks of the other face's shape functions."""
    ends = node_samples(other, np.unique(other.nodes[:, [0, -1]]))
    found = ends.closest(face, reach)
    return Marks(found.edges[found.valid], found.s[found.valid])


def segment_samples(
    face: Face, segments: Sequence[Pieces], marks: Marks | None = None
) -> Samples:
    """Gauss points of segments, whose shares of each segment sum to one."""
    samples = pressure_samples(face, segments, marks)
    owner = np.repeat(np.arange(len(segments)), [len(part.nodes) for part in segments])
    owner = owner[samples.owner]
    total = np.bincount(owner, samples.share)
    return Samples(owner, samples.share / total[owner], samples.places, samples.straight,
                   samples.looks)


def pressure_samples(face: Face, runs: Sequence[Pieces], marks: Marks | None = None) -> Samples:
    """Gauss points of pieces of a face, with the lengths that they stand for as shares [m].

    Between ``marks`` they integrate the shape functions of both sides of a flat face exactly. Their
    owners are the pieces, one after the other.
    """
    nodes, start, end = (np.concatenate([getattr(run, name) for run in runs])
                         for name in ("nodes", "start", "end"))
    size = len(face.body.nodes)
    keys = face.nodes[:, 0] * size + face.nodes[:, -1]
    order = np.argsort(keys)
    edges = order[np.searchsorted(keys[order], nodes[:, 0] * size + nodes[:, -1])]
    piece = np.arange(len(edges))
    if marks is not None:
        mark, cut = np.nonzero((marks.edges[:, None] == edges) & (start < marks.s[:, None])
                               & (marks.s[:, None] < end))
        piece, start = np.concatenate([piece, cut]), np.concatenate([start, marks.s[mark]])
        order = np.lexsort((start, piece))
        piece, start = piece[order], start[order]
        end = np.where(np.append(piece[1:] == piece[:-1], False), np.append(start[1:], 0.0),
                       end[piece])
    inside = ((np.arange(_PARTS)[:, None] + 0.5 * (1.0 + _GAUSS)) / _PARTS).ravel()
    weights = np.tile(0.5 * _WEIGHTS / _PARTS, _PARTS)
    s = (start[:, None] + (end - start)[:, None] * inside).ravel()
    share = (face.lengths[edges[piece]] * (end - start))[:, None] * weights
    piece = np.repeat(piece, len(inside))
    looks = np.repeat(face.outward(edges[piece], s)[:, None], 2, axis=1)
    return Samples(piece, share.ravel(), face.at(edges[piece], s), face.straight(edges[piece], s),
                   looks)


def covered(face: Face, other: Face, reach: float) -> list[Pieces]:
    """The parts of a face that have a partner on another one, as runs of successive pieces."""
    marks = np.linspace(0.0, 1.0, _CUTS + 1)
    marks[[0, -1]] += [_INSET, -_INSET]
    count = len(face.nodes)

    def has_partner(edges: Integers, s: Array) -> NDArray[np.bool_]:
        looks = np.repeat(face.outward(edges, s)[:, None], 2, axis=1)
        return other.closest(face.at(edges, s), looks, reach, _FACING).valid

    valid = has_partner(np.repeat(np.arange(count), len(marks)), np.tile(marks, count))
    valid = valid.reshape(count, -1)
    edge, step = np.nonzero(valid[:, 1:] != valid[:, :-1])
    opens = valid[edge, step + 1]
    inner, outer = (np.where(opens, marks[step + near], marks[step + 1 - near])
                    for near in (1, 0))
    for _ in range(_HALVINGS if len(edge) else 0):
        middle = 0.5 * (inner + outer)
        now = has_partner(edge, middle)
        inner, outer = np.where(now, middle, inner), np.where(now, outer, middle)
    # An edge's parts begin at its start or where it enters, and end where it leaves or at its end.
    begins = np.concatenate([np.flatnonzero(valid[:, 0]), edge[opens]])
    starts = np.concatenate([np.zeros(int(valid[:, 0].sum())), inner[opens]])
    ceases = np.concatenate([np.flatnonzero(valid[:, -1]), edge[~opens]])
    ends = np.concatenate([np.ones(int(valid[:, -1].sum())), inner[~opens]])
    first, last = np.lexsort((starts, begins)), np.lexsort((ends, ceases))
    edges, starts, ends = begins[first], starts[first], ends[last]
    if not len(edges):
        return []
    after = face.neighbours[1]
    following = np.roll(np.arange(len(edges)), -1)
    joined = ((ends == 1.0) & (starts[following] == 0.0)
              & (after[edges] == edges[following]))
    breaks = np.flatnonzero(~joined) + 1
    # Round a closed face, the last run goes on with the first edge.
    order = np.roll(np.arange(len(edges)), -breaks[0] if joined[-1] and len(breaks) else 0)
    cuts = breaks - breaks[0] if joined[-1] and len(breaks) else breaks
    return [Pieces(face.nodes[edges[part]], starts[part], ends[part])
            for part in np.split(order, cuts) if len(part)]


def lumped_lengths(face: Face, runs: Sequence[Pieces], kept: NDArray[np.bool_]) -> Array:
    """Integrals (N,) of the shape functions over parts of a face [m].

    What falls on nodes that are not ``kept`` (N,) goes to the others of the same edge.
    """
    lengths = np.zeros(len(face.body.nodes))
    for run in runs:
        weights = piece_weights(face.body, run)
        stays = kept[run.nodes]
        lost = np.where(stays, 0.0, weights).sum(axis=1) / np.maximum(stays.sum(axis=1), 1)
        np.add.at(lengths, run.nodes, np.where(stays, weights + lost[:, None], 0.0))
    return lengths
