"""Places on a face at which contact nodes, and a uniform pressure, are looked at."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.contact_face import ContactNodes, face_nodes
from fecontact.fem.face_curve import Face
from fecontact.fem.points import Pieces

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_CUTS = 4  # parts of an edge in which a uniform pressure is integrated


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

    def only(self, which: Array) -> "Samples":
        """Those that are marked."""
        return Samples(*(getattr(self, name)[which] for name in Samples.__dataclass_fields__))


def sampled_nodes(
    face: Face, nodes: Literal["all"] | int, other: Face | None
) -> tuple[ContactNodes, Samples, Array]:
    """Contact nodes, their samples, and which of the nodes belong to the other face as well."""
    rows, parts = face_nodes(face.body, face.boundary, nodes, "nodes")
    shared = np.zeros(len(rows.tributary), dtype=bool)
    if not isinstance(parts, list):
        if other is not None and other.body is face.body:
            shared = np.isin(parts, other.nodes)
        degree = face.body.degree
        edges, local = np.divmod(np.arange(face.nodes.size), degree + 1)
        first, last = (np.zeros(len(face.body.nodes), dtype=int) for _ in range(2))
        last[face.nodes.ravel()] = np.arange(face.nodes.size)
        first[face.nodes.ravel()[::-1]] = np.arange(face.nodes.size)[::-1]
        s = local / degree
        sides = [which[parts] for which in (first, last)]
        looks = np.stack([face.outward(edges[side], s[side]) for side in sides], axis=1)
        places = face.at(edges[sides[0]], s[sides[0]])
        return rows, Samples(np.arange(len(parts)), np.ones(len(parts)), places,
                              face.body.nodes[parts], looks), shared
    sizes = [len(part.nodes) for part in parts]
    owner = np.repeat(np.arange(len(parts)), sizes)
    pieces = Pieces(*(np.concatenate([getattr(part, name) for part in parts])
                      for name in ("nodes", "start", "end")))
    edges, s, weights = _gauss(face, pieces)
    owner = np.repeat(owner, len(_GAUSS))
    share = weights / np.bincount(owner, weights)[owner]
    return rows, _at(face, owner, share, edges, s), shared


def _at(face: Face, owner: Integers, share: Array, edges: Integers, s: Array) -> Samples:
    looks = np.repeat(face.outward(edges, s)[:, None], 2, axis=1)
    return Samples(owner, share, face.at(edges, s), face.straight(edges, s), looks)


def _gauss(face: Face, pieces: Pieces) -> tuple[Integers, Array, Array]:
    """Edges, s and lengths (k g,) of the Gauss points of pieces of edges."""
    size = len(face.body.nodes)
    keys = face.nodes[:, 0] * size + face.nodes[:, -1]
    order = np.argsort(keys)
    edges = order[np.searchsorted(keys[order], pieces.nodes[:, 0] * size + pieces.nodes[:, -1])]
    half = 0.5 * (pieces.end - pieces.start)
    s = pieces.start[:, None] + half[:, None] * (1.0 + _GAUSS)
    weights = (face.lengths[edges] * half)[:, None] * _WEIGHTS
    return np.repeat(edges, len(_GAUSS)), s.ravel(), weights.ravel()


def pressure_samples(face: Face) -> Samples:
    """Gauss points all over a face, with the lengths that they stand for as their shares [m]."""
    cuts = np.arange(_CUTS) / _CUTS
    pieces = Pieces(np.repeat(face.nodes, _CUTS, axis=0), np.tile(cuts, len(face.nodes)),
                    np.tile(cuts + 1.0 / _CUTS, len(face.nodes)))
    edges, s, weights = _gauss(face, pieces)
    return _at(face, np.arange(len(s)), weights, edges, s)
