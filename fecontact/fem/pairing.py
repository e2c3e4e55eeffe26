"""Pairing of two faces: contact nodes on the one, their feet on the other, normals and gaps."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_choice,
    require_not_negative,
    require_positive,
)
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, count, listed, quantity
from fecontact.fem.contact_face import check_faces_down
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.face_curve import Closest, Face
from fecontact.fem.face_samples import Samples, pressure_samples, sampled_nodes
from fecontact.fem.points import edge_weights, node_matrix

_FACING = 0.1  # least cosine between opposed normals: 84 degrees
_SAME = 1e-9  # of an edge: gaps below this are round-off
_FINER = 0.999  # ratio of spacings from which a face is finer than another


@dataclass(frozen=True, eq=False, repr=False)
class PairingReport(Summarised):
    """What came of the pairing of two faces.

    Parameters
    ----------
    face, other : str
        The face with the contact nodes and the other side, "BODY.BOUNDARY" or "ground".
    nodes : int
        Contact nodes with a partner.
    left_out : (k, 2) array
        Places of the nodes without a partner [m].
    reasons : tuple of str
        Why each of them has none.
    unevenness : float
        Largest error of the loads that a uniform pressure puts on the nodes of the other side, over
        the load of a node whose edges are wholly in contact: 0 where the loads are exact.
    largest_gap, closed_overlap : float
        Largest initial gap, and largest overlap set to zero [m].
    largest_offset : float
        Largest distance along the tangent between the places where opposite normal forces act [m];
        times the force, the moment by which they do not balance.
    """

    face: str
    other: str
    nodes: int
    left_out: Array
    reasons: tuple[str, ...]
    unevenness: float
    largest_gap: float
    closed_overlap: float
    largest_offset: float

    def summary(self) -> list[tuple[str, str]]:
        """Numbers of nodes, gaps, overlaps, and how evenly the other side is loaded."""
        where = [f"({x:.4g}, {y:.4g}) m {reason}"
                 for (x, y), reason in zip(self.left_out.tolist(), self.reasons, strict=True)]
        return [
            ("faces", f"{self.face} on {self.other}"),
            ("nodes", f"{self.nodes}"),
            ("without partner", f"{count(len(where), 'node')}: {listed(where, 3)}" if where
             else "none"),
            ("largest gap", quantity(self.largest_gap, "m")),
            ("overlap closed", quantity(self.closed_overlap, "m")),
            ("unevenness", f"{100.0 * self.unevenness:.3g} %"),
            ("largest offset", quantity(self.largest_offset, "m")),
        ]


@dataclass(frozen=True, eq=False, repr=False)
class Pairing(Summarised):
    """Contact nodes on a face of one body, each with its foot on another body or on the ground.

    The relative displacement of node j, with opposite forces at node and foot, is
    ``nodes @ u_body - feet @ u_other`` in its rows 3 j (x), 3 j + 1 (y); made by
    :func:`pair_faces`.

    Parameters
    ----------
    body, other : str
        Names of the body with the nodes and of the other one; None for the ground.
    places, feet_places : (n, 2) array
        Reference places of nodes and feet, on the smooth face [m].
    normals, tangents : (n, 2) array
        Unit normals n out of the other side into ``body``, and ``t = (n_y, -n_x)``.
    gaps : (n,) array
        Initial gaps, not negative [m].
    tributary : (n,) array
        Length of the face that each node stands for [m].
    nodes, feet : sparse (3 n, 2 N) array
        Displacement x, y and rotation of each node from the nodal displacements of ``body``, and of
        its foot from those of ``other`` (None for the ground).
    report : PairingReport
    """

    body: str
    other: str | None
    places: Array
    normals: Array
    tangents: Array
    gaps: Array
    tributary: Array
    nodes: Any
    feet: Any
    feet_places: Array
    report: PairingReport

    def summary(self) -> list[tuple[str, str]]:
        """That of the report."""
        return self.report.summary()


def pair_faces(
    bodies: Mapping[str, ElasticBody], face: str, other: str, *,
    nodes: Literal["all"] | int = "all", nodes_on: Literal["finer", "face"] = "finer",
    reach: float | None = None, overlap: float = 0.01,
) -> Pairing:
    """Pair contact nodes on one face with the closest places on another face or the ground.

    Faces whose edges meet below 30 degrees are smooth curves through their nodes. Nodes beyond the
    ends of the other face have no partner, are left out and stand in the report.

    Parameters
    ----------
    bodies : mapping of name to ElasticBody
        In the places where they are assembled.
    face, other : str
        "BODY.BOUNDARY"; ``other`` may be "ground", y = 0, and both may be of one body.
    nodes : "all" or int
        Every displacement node, or so many segments of equal length with their mean displacement.
    nodes_on : "finer" or "face"
        Which face has the nodes: ``other`` if it is finer than ``face``, or ``face`` in any case.
    reach : float or None
        Largest distance of a partner [m]; None: the extent of the larger face; any above ground.
    overlap : float
        Depth up to which faces inside each other are set to zero gap, in mean edges of the finer
        face.

    Returns
    -------
    Pairing

    Raises
    ------
    InputError
        For unknown bodies, faces that share edges, look the same way, overlap deeper or have no
        partner at all; ground faces that look up; values out of range.
    MeshError
        If a mesh has no such boundary.
    """
    first = _face(bodies, face, "face")
    _check_options(nodes_on, reach, overlap)
    if other == "ground":
        return _on_ground(first, nodes, reach, overlap)
    second = _face(bodies, other, "other")
    _check_apart(first, second)
    if nodes_on == "finer" and finer_face(bodies, face, other) == other:
        first, second = second, first
    return _paired(first, second, nodes, reach, overlap)


def pair_both_faces(
    bodies: Mapping[str, ElasticBody], face: str, other: str, *,
    nodes: Literal["all"] | int = "all", reach: float | None = None, overlap: float = 0.01,
) -> tuple[Pairing, Pairing]:
    """Pair two faces twice, with nodes on ``face`` and on ``other``, each with half its length.

    Loads are more even than in one pass. For compliant normal laws only: rigid constraints would be
    redundant. Arguments and errors are those of :func:`pair_faces`.
    """
    first, second = _face(bodies, face, "face"), _face(bodies, other, "other")
    _check_options("face", reach, overlap)
    _check_apart(first, second)
    one, two = (_paired(*pair, nodes, reach, overlap)
                for pair in ((first, second), (second, first)))
    return (replace(one, tributary=0.5 * one.tributary),
            replace(two, tributary=0.5 * two.tributary))


def finer_face(bodies: Mapping[str, ElasticBody], face: str, other: str) -> str:
    """The one of two faces "BODY.BOUNDARY" whose displacement nodes are closer; ``face`` if equal.

    Raises
    ------
    InputError, MeshError
        If there is no such body or boundary.
    """
    first, second = _face(bodies, face, "face"), _face(bodies, other, "other")
    return other if second.spacing < _FINER * first.spacing else face


def _face(bodies: Mapping[str, ElasticBody], name: str, key: str) -> Face:
    require_kind("pair_faces", Mapping, bodies=bodies)
    require_kind("pair_faces", str, **{key: name})
    body, dot, boundary = name.partition(".")
    if not (body and dot and boundary):
        either = " or 'ground'" if key == "other" else ""
        raise InputError(f"pair_faces: {key} = {name!r} must be 'BODY.BOUNDARY'{either}; bodies "
                         f"are {choices(bodies)}.")
    if body not in bodies:
        raise InputError(f"pair_faces: {key} = {name!r} names no body{nearest(body, bodies)}; "
                         f"bodies are {choices(bodies)}.")
    require_kind("pair_faces", ElasticBody, **{f"bodies['{body}']": bodies[body]})
    bodies[body].mesh.boundary(boundary)
    return Face(bodies[body], boundary, name)


def _check_options(nodes_on: str, reach: float | None, overlap: float) -> None:
    require_choice("pair_faces", "nodes_on", nodes_on, ("finer", "face"))
    require_not_negative("pair_faces", overlap=overlap)
    if reach is not None:
        require_positive("pair_faces", reach=reach)


def _check_apart(first: Face, second: Face) -> None:
    if first.body is not second.body:
        return
    edges = [np.sort(face.nodes[:, [0, -1]], axis=1) for face in (first, second)]
    both = np.concatenate([np.unique(one, axis=0) for one in edges])
    if len(np.unique(both, axis=0)) < len(both):
        raise InputError(f"pair_faces: '{first.label}' and '{second.label}' share edges; a face "
                         f"cannot touch itself, give two boundaries.")


def _paired(
    face: Face, other: Face, nodes: Literal["all"] | int, reach: float | None, overlap: float
) -> Pairing:
    import scipy.sparse as sp

    rows, samples, shared = sampled_nodes(face, nodes, other)
    limit = max(face.extent, other.extent) if reach is None else float(reach)
    found = other.closest(samples.places, samples.looks, limit, _FACING)
    size = len(rows.tributary)
    hit = samples.only(found.valid)
    covered = np.bincount(hit.owner, hit.share, size)
    kept = (covered > 0.5 - 1e-9) & ~shared
    _check_partners(kept, shared, found, face, other, limit)
    total = np.where(kept, covered, 1.0)

    def mean(values: Array) -> Array:
        return (hit.mean(values[found.valid], size) / total[:, None])[kept]

    normals = mean(found.normals)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    places, feet_places = samples.mean(samples.places, size)[kept], mean(found.places)
    gaps = mean(found.gaps[:, None])[:, 0]
    edge = min(face.lengths.mean(), other.lengths.mean())
    gaps, closed = _closed(gaps, places, overlap * edge, _SAME * edge, face, other.label)

    columns, weights = _foot_weights(other, found)
    chosen = np.unique(other.nodes)
    W = sp.csr_array(sp.coo_array(
        (((hit.share / total[hit.owner])[:, None] * weights).ravel(), (
            np.repeat(hit.owner, columns.shape[1]), np.searchsorted(chosen, columns).ravel())),
        shape=(size, len(chosen))))[np.flatnonzero(kept)]
    feet = sp.csr_array(sp.kron(W, sp.eye_array(3)) @ node_matrix(other.body, chosen))
    arms = samples.mean(samples.straight, size)[kept] - mean(other.straight(found.edges, found.s))
    tributary = rows.tributary[kept]
    report = PairingReport(
        face.label, other.label, len(tributary), samples.mean(samples.places, size)[~kept],
        _reasons(kept, shared, samples, found, other.label),
        _unevenness(face, other, chosen, W.T @ tributary, limit),
        float(gaps.max()), closed,
        float(np.abs(np.einsum("kx,kx->k", _tangents(normals), arms)).max()))
    return Pairing(
        _body(face), _body(other), places, normals, _tangents(normals), gaps, tributary,
        _rows_of(rows.matrix, kept), feet, feet_places, report)


def _on_ground(
    face: Face, nodes: Literal["all"] | int, reach: float | None, overlap: float
) -> Pairing:
    check_faces_down(face.body, face.boundary)
    rows, samples, _ = sampled_nodes(face, nodes, None)
    places = samples.mean(samples.places, len(rows.tributary))
    kept = places[:, 1] <= (np.inf if reach is None else reach)
    if not kept.any():
        raise InputError(f"pair_faces: no node of '{face.label}' is within reach = {reach:g} m of "
                         f"the ground, y = 0; the lowest is {places[:, 1].min():.4g} m above it.")
    edge = float(face.lengths.mean())
    gaps, closed = _closed(places[kept, 1], places[kept], overlap * edge, _SAME * edge, face,
                           "the ground, y = 0")
    feet_places = places[kept] * [1.0, 0.0]
    normals = np.tile([0.0, 1.0], (len(gaps), 1))
    report = PairingReport(face.label, "ground", len(gaps), places[~kept],
                           ("is out of reach",) * int((~kept).sum()), 0.0, float(gaps.max()),
                           closed, 0.0)
    return Pairing(_body(face), None, places[kept], normals, _tangents(normals), gaps,
                   rows.tributary[kept], _rows_of(rows.matrix, kept), None, feet_places, report)


def _body(face: Face) -> str:
    return face.label.partition(".")[0]


def _tangents(normals: Array) -> Array:
    return np.column_stack([normals[:, 1], -normals[:, 0]])


def _rows_of(matrix: Any, kept: Array) -> Any:
    return matrix[np.flatnonzero(np.repeat(kept, 3))]


def _foot_weights(other: Face, found: Closest) -> tuple[Integers, Array]:
    """Displacement nodes (k, degree + 1) of the edges of the feet that exist, and their weights."""
    return (other.nodes[found.edges[found.valid]],
            other.shape_functions(found.s[found.valid]))


def _check_partners(
    kept: Array, shared: Array, found: Closest, face: Face, other: Face, limit: float
) -> None:
    if kept.any():
        return
    names = f"pair_faces: no node of '{face.label}' has a partner on '{other.label}'"
    if np.isfinite(found.nearest).any():
        closest = found.nearest.min()
        if closest > limit:
            raise InputError(f"{names}: the closest is {closest:.4g} m away, beyond reach = "
                             f"{limit:.4g} m; move the bodies closer or raise reach.")
        raise InputError(f"{names}, but for less than half a segment or nodes that belong to both; "
                         f"use more nodes or other faces.")
    if found.averted.any():
        raise InputError(f"{names}: their outward normals point the same way; give faces that look "
                         f"at each other.")
    raise InputError(f"{names}: all of them lie beyond its ends; move the bodies opposite to each "
                     f"other or give other faces.")


def _reasons(
    kept: Array, shared: Array, samples: Samples, found: Closest, other: str
) -> tuple[str, ...]:
    """Why each node that is not kept has no partner."""
    near, averted = np.full(len(kept), np.inf), np.zeros(len(kept), dtype=bool)
    np.minimum.at(near, samples.owner[~found.valid], found.nearest[~found.valid])
    np.logical_or.at(averted, samples.owner, found.averted)
    return tuple(
        "is on both faces" if shared[j] else f"is {near[j]:.3g} m away, out of reach"
        if np.isfinite(near[j]) else f"looks away from {other}" if averted[j]
        else f"is beyond the ends of {other}" for j in np.flatnonzero(~kept))


def _closed(
    gaps: Array, places: Array, allowed: float, tiny: float, face: Face, other: str
) -> tuple[Array, float]:
    """Gaps without overlaps, and the largest of these."""
    deepest = int(np.argmin(gaps))
    if -gaps[deepest] > max(allowed, tiny):
        x, y = places[deepest]
        raise InputError(f"pair_faces: '{face.label}' starts {-gaps[deepest]:.4g} m inside {other} "
                         f"at ({x:.4g}, {y:.4g}) m, more than the {allowed:.4g} m that overlap "
                         f"closes; move the bodies apart, give faces that look at each other, or "
                         f"raise overlap.")
    closed = -gaps[deepest] if gaps[deepest] < -tiny else 0.0
    return np.where(gaps < tiny, 0.0, gaps), float(closed)


def _unevenness(
    face: Face, other: Face, chosen: Integers, loads: Array, limit: float
) -> float:
    """Largest error of the nodal loads (k,) of a uniform pressure, over those of whole edges."""
    samples = pressure_samples(face)
    found = other.closest(samples.places, samples.looks, limit, _FACING)
    exact, whole = np.zeros(len(chosen)), np.zeros(len(chosen))
    columns, values = _foot_weights(other, found)
    np.add.at(exact, np.searchsorted(chosen, columns),
              samples.share[found.valid, None] * values)
    np.add.at(whole, np.searchsorted(chosen, other.nodes), edge_weights(other.body, other.nodes))
    return float((np.abs(loads - exact) / whole).max())
