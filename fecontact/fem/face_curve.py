"""A face of a body as a smooth curve through its nodes, and the places of it closest to others.

Meshes are straight-sided: the chords of a circle of radius R miss it by h^2 / (8 R), easily as much
as the gaps that matter. Where successive edges meet at up to 30 degrees and their neighbours bend
the same way, the face is taken for a smooth curve: at each node the tangent of the circle through
it and its two neighbours, along each edge a cubic. Everything else stays a corner.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.contact_face import face_chains
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.mesh import Mesh

_SHARP = np.radians(30.0) * (1.0 + 1e-6)  # edges that meet at more than this form a corner
_FLAT = 1e-9  # angle [rad] below which they do not meet at any
_ALIKE = 0.25  # of a node's curvature: with less at its neighbour, it is a kink between flats
_NEAR = 1e-6  # of an edge: below this distance the direction to a corner has no meaning
_STEPS = 60
_TOGETHER = 128  # successive places looked at together


@dataclass(frozen=True, eq=False)
class Closest:
    """Closest places on a face, one for each of several places; those without one are not valid.

    ``normals`` point out of the face, ``gaps`` are measured along them and negative inside the
    body. ``nearest`` is the distance to the closest place that looks back (inf without any), also
    where it is out of reach; ``averted`` marks places above or below the face that look away.
    """

    valid: NDArray[np.bool_]
    edges: Integers
    s: Array
    places: Array
    normals: Array
    gaps: Array
    nearest: Array
    averted: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Face:
    """A named boundary of a body, with the body on the left of its edges."""

    body: ElasticBody
    boundary: str
    label: str

    @cached_property
    def nodes(self) -> Integers:
        """Displacement nodes (k, degree + 1) of the edges."""
        return np.concatenate(face_chains(self.body, self.boundary))

    @cached_property
    def lengths(self) -> Array:
        """Lengths (k,) of the edges [m]."""
        return np.asarray(np.linalg.norm(self._ends[1] - self._ends[0], axis=1))

    @property
    def spacing(self) -> float:
        """Mean distance of displacement nodes [m]."""
        return float(self.lengths.mean()) / self.body.degree

    @property
    def extent(self) -> float:
        """Diagonal of the face's bounding box [m]."""
        return float(np.linalg.norm(np.ptp(np.concatenate(self._ends), axis=0)))

    def at(self, edges: Integers, s: Array) -> Array:
        """Places (n, 2) on the curve, at s = 0 ... 1 along edges [m]."""
        return self._cubic(edges, s)[0]

    def outward(self, edges: Integers, s: Array) -> Array:
        """Unit normals (n, 2) out of the body."""
        return _turned(_unit(self._cubic(edges, s)[1]))

    def straight(self, edges: Integers, s: Array) -> Array:
        """Places (n, 2) on the straight edges, where the mesh has its displacements [m]."""
        start, end = self._ends
        return np.asarray(start[edges] + s[:, None] * (end - start)[edges])

    def shape_functions(self, s: Array) -> Array:
        """Values (n, degree + 1) of the edge's shape functions."""
        if self.body.degree == 1:
            return np.column_stack([1.0 - s, s])
        return np.column_stack([(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s),
                                                s * (2.0 * s - 1.0)])

    @cached_property
    def neighbours(self) -> tuple[Integers, Integers]:
        """The edges (k,) of the face before and after each, -1 at its ends."""
        after = _followers(self.nodes[:, [0, -1]], len(self.body.nodes))
        return _inverted(after), after

    def closest(self, places: Array, looks: Array, reach: float, least: float,
                slack: float = 0.0) -> Closest:
        """Closest places on the face to given ones.

        ``looks`` (n, 2, 2) are two directions in which each place looks; one must be opposed to
        the normal of the face, with a cosine of at least ``least``. A place beyond the ends of the
        face by more than ``slack`` edges has none, nor has one farther away than ``reach``.
        """
        parts = [self._closest(places[k : k + _TOGETHER], looks[k : k + _TOGETHER], reach, least,
                               slack)
                 for k in range(0, len(places), _TOGETHER)]
        names = Closest.__dataclass_fields__
        return Closest(**{name: np.concatenate([getattr(part, name) for part in parts])
                          for name in names})

    def _closest(self, places: Array, looks: Array, reach: float, least: float,
                 slack: float) -> Closest:
        place, edge, s, normal, gap = self._feet(places, looks, slack)
        faced = (np.einsum("kx,kax->ka", normal, looks[place]).min(axis=1) <= -least)
        distance = np.abs(gap)
        near = distance <= reach
        count = len(places)
        nearest = np.full(count, np.inf)
        np.minimum.at(nearest, place[faced], distance[faced])
        averted = np.bincount(place[near & ~faced], minlength=count) > 0
        place, edge, s, normal, gap, distance = (
            part[near & faced] for part in (place, edge, s, normal, gap, distance))
        order = np.lexsort((distance, place))
        found, first = np.unique(place[order], return_index=True)
        best = order[first]
        valid = np.zeros(count, dtype=bool)
        valid[found] = True
        edges, at, gaps = np.zeros(count, dtype=int), np.zeros(count), np.zeros(count)
        normals = np.zeros((count, 2))
        edges[found], at[found], gaps[found], normals[found] = (
            edge[best], s[best], gap[best], normal[best])
        return Closest(valid, edges, at, self.at(edges, at), normals, gaps, nearest,
                       averted & ~valid)

    def _feet(
        self, places: Array, looks: Array, slack: float
    ) -> tuple[Integers, Integers, Array, Array, Array]:
        """All perpendicular feet: number of place, edge, s, normal and signed distance."""
        start, end = self._ends
        first, last = self._tangents
        before, after = self.neighbours
        beyond = slack * self.lengths
        below, above = np.where(before < 0, beyond, 0.0), np.where(after < 0, -beyond, 0.0)
        # Most edges have no foot of any of these places, which lie in a box.
        (left, lower), (right, upper) = places.min(axis=0), places.max(axis=0)
        box = np.array([[left, lower], [left, upper], [right, lower], [right, upper]])
        near = np.flatnonzero((_slopes(first, start, box).min(axis=1) <= below)
                              & (_slopes(last, end, box).max(axis=1) >= above))
        low = _slopes(first[near], start[near], places)
        high = _slopes(last[near], end[near], places)
        edge, place = np.nonzero((low <= below[near, None]) & (high >= above[near, None]))
        low, high, edge = low[edge, place], high[edge, place], near[edge]
        s = self._roots(places[place], edge, low, high)
        at, slope, _ = self._cubic(edge, s)
        normal = _turned(_unit(slope))
        gap = np.einsum("kx,kx->k", normal, places[place] - at)
        # Between the normals on both sides of a corner, the corner itself is closest.
        joined = np.flatnonzero((after >= 0) & (last != first[after]).any(axis=1))
        which, at_corner = np.nonzero((_slopes(last[joined], end[joined], places) < 0.0) & (
            _slopes(first[after[joined]], start[after[joined]], places) > 0.0))
        which = joined[which]
        normals, gaps = _corner_normals(
            places[at_corner] - end[which], _turned(last[which]),
            _turned(first[after[which]]), looks[at_corner].sum(axis=1),
            _NEAR * self.lengths[which])
        return (np.concatenate([place, at_corner]), np.concatenate([edge, which]),
                np.concatenate([s, np.ones(len(which))]), np.concatenate([normal, normals]),
                np.concatenate([gap, gaps]))

    def _roots(self, places: Array, edges: Integers, low: Array, high: Array) -> Array:
        """Perpendicular feet on edges, by Newton's method with bisection as its guard."""
        start, end = self._ends
        along = (end - start)[edges]
        s = np.einsum("kx,kx->k", places - start[edges], along) / self.lengths[edges] ** 2
        s = np.clip(s, 0.0, 1.0)
        # Just beyond the ends of the face, or on a node.
        s = np.where(low >= 0.0, 0.0, np.where(high <= 0.0, 1.0, s))
        left, right = np.where(high <= 0.0, s, 0.0), np.where(low >= 0.0, s, 1.0)
        for _ in range(_STEPS):
            at, slope, bend = self._cubic(edges, s)
            away = at - places
            value = np.einsum("kx,kx->k", away, slope)
            rate = np.einsum("kx,kx->k", slope, slope) + np.einsum("kx,kx->k", away, bend)
            left, right = np.where(value <= 0.0, s, left), np.where(value >= 0.0, s, right)
            step = s - value / np.where(rate > 0.0, rate, np.inf)
            inside = (left <= step) & (step <= right) & (rate > 0.0)
            step = np.where(inside, step, 0.5 * (left + right))
            done = np.abs(step - s).max(initial=0.0) < 1e-15
            s = step
            if done:
                break
        return s

    def _cubic(self, edges: Integers, s: Array) -> tuple[Array, Array, Array]:
        """Places on the curve and their first two derivatives over s."""
        start, end = (side[edges] for side in self._ends)
        first, last = (self._stretch[edges, None] * side[edges] for side in self._tangents)
        s = s[:, None]
        chord = end - start
        # Hermite's cubic, as the chord plus what bends away from it: exact for straight edges.
        p, q = first - chord, last - chord
        one = 1.0 - s
        return (start + s * chord + s * one * (one * p - s * q),
                chord + one * (1.0 - 3.0 * s) * p + s * (3.0 * s - 2.0) * q,
                (6.0 * s - 4.0) * p + (6.0 * s - 2.0) * q)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        return self.body.nodes[self.nodes[:, 0]], self.body.nodes[self.nodes[:, -1]]

    @cached_property
    def _tangents(self) -> tuple[Array, Array]:
        """Unit tangents (k, 2) at start and end of the edges."""
        outline = self.body.mesh.outline
        size = len(self.body.mesh.nodes)
        keys = outline[:, 0] * size + outline[:, 1]
        order = np.argsort(keys)
        wanted = self.nodes[:, 0] * size + self.nodes[:, -1]
        chosen = order[np.searchsorted(keys[order], wanted)]
        first, last = _outline_tangents(self.body.mesh)
        return first[chosen], last[chosen]

    @cached_property
    def _stretch(self) -> Array:
        """Length of the cubics' end tangents [m]: the cubic of a circle meets it in its middle."""
        first, last = self._tangents
        cosine = np.clip(np.einsum("kx,kx->k", first, last), -1.0, 1.0)
        return np.asarray(self.lengths / np.cos(0.25 * np.arccos(cosine)) ** 2)


def _outline_tangents(mesh: Mesh) -> tuple[Array, Array]:
    """Unit tangents (k, 2) at start and end of all edges of the outline."""
    outline = mesh.outline
    chord = mesh.nodes[outline[:, 1]] - mesh.nodes[outline[:, 0]]
    length = np.linalg.norm(chord, axis=1)
    along = chord / length[:, None]
    after = _followers(outline, len(mesh.nodes))
    before = _inverted(after)
    # Values at an edge belong to the node at its end from here on.
    turn = np.arctan2(_cross(along, along[after]), np.einsum("kx,kx->k", along, along[after]))
    turn[np.abs(turn) < _FLAT] = 0.0
    bent = turn / np.minimum(length, length[after])
    corner = (after < 0) | (np.abs(turn) > _SHARP)
    smooth = ~corner
    for other in (before, after):
        alike = np.sign(bent) * bent[other] >= _ALIKE * np.abs(bent)
        smooth &= alike | corner[other] | (other < 0)
    inverse = chord / length[:, None] ** 2
    tangent = _unit(np.where(smooth[:, None], inverse + inverse[after], along))
    at_start = np.where(before < 0, False, smooth[before])
    first = np.where(at_start[:, None], tangent[before], along)
    last = np.where(smooth[:, None], tangent, along)
    # At a corner the edge goes on as the arc of a circle that it is at its other end.
    first, last = (np.where((at_start | ~smooth)[:, None], first, _mirrored(last, along)),
                   np.where((smooth | ~at_start)[:, None], last, _mirrored(first, along)))
    return first, last


def _slopes(tangents: Array, nodes: Array, places: Array) -> Array:
    """Slopes (k, n) of half the squared distance of n places along k tangents at nodes [m]."""
    return np.asarray(tangents[:, :1] * (nodes[:, :1] - places[:, 0])
                      + tangents[:, 1:] * (nodes[:, 1:] - places[:, 1]))


def _followers(edges: Integers, count: int) -> Integers:
    """Numbers (k,) of the edges that follow, -1 without one or where more than two meet."""
    start, end = edges[:, 0], edges[:, 1]
    follower = np.full(count, -1)
    follower[start] = np.arange(len(edges))
    several = np.bincount(start, minlength=count) > 1
    return np.asarray(np.where(several[end], -1, follower[end]))


def _inverted(after: Integers) -> Integers:
    before = np.full(len(after), -1)
    joined = after >= 0
    before[after[joined]] = np.flatnonzero(joined)
    return before


def _corner_normals(
    arm: Array, first: Array, second: Array, looks: Array, tolerance: Array
) -> tuple[Array, Array]:
    """Normals and signed distances of places (k, 2) relative to corners between two normals.

    The normal points from the corner to the place. A place on the corner takes what is opposed to
    its own normal, or the nearer of the corner's two.
    """
    sign = np.where(_cross(first, second) >= 0.0, 1.0, -1.0)
    distance = np.linalg.norm(arm, axis=1)
    full = np.arctan2(_cross(first, second), np.einsum("kx,kx->k", first, second))
    wanted = np.arctan2(_cross(first, -looks), np.einsum("kx,kx->k", first, -looks))
    angle = np.clip(wanted, np.minimum(full, 0.0), np.maximum(full, 0.0))
    c, s = np.cos(angle), np.sin(angle)
    own = np.column_stack([c * first[:, 0] - s * first[:, 1], s * first[:, 0] + c * first[:, 1]])
    apart = distance > tolerance
    to_place = sign[:, None] * arm / np.where(apart, distance, 1.0)[:, None]
    normals = np.where(apart[:, None], to_place, own)
    return normals, np.einsum("kx,kx->k", normals, arm)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _turned(tangents: Array) -> Array:
    """Normals to the right of tangents."""
    return np.column_stack([tangents[:, 1], -tangents[:, 0]])


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _mirrored(tangents: Array, axes: Array) -> Array:
    return np.asarray(2.0 * np.einsum("kx,kx->k", tangents, axes)[:, None] * axes - tangents)
