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
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.fem.contact_face import check_faces_down, face_nodes, face_segments
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.face_curve import Closest, Face
from fecontact.fem.face_samples import (
    Samples,
    covered,
    lumped_lengths,
    node_samples,
    opposite_ends,
    pressure_samples,
    segment_samples,
)
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.faces.solid_pairing import (
    SolidFace,
    check_solids_apart,
    grounded_solid,
    paired_solids,
)
from fecontact.fem.pairing_report import SAME, PairingReport, closed_gaps, no_partner, reasons
from fecontact.fem.points import Pieces, edge_weights, node_matrix, patch_rows, whole

_COUNT = "pair_faces: nodes"
_FINER = 0.999  # ratio of spacings from which a face is finer than another


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Pairing(Summarised):
    """Contact nodes on a face of one body, each with its foot on another body or on the ground.

    The relative displacement of node j, with opposite forces at node and foot, is
    ``nodes @ u_body - feet @ u_other`` in its rows 3 j (x), 3 j + 1 (y), of solids 6 j, 6 j + 1,
    6 j + 2; made by :func:`pair_faces`.

    Parameters
    ----------
    body, other : str
        Names of the body with the nodes and of the other one; None for the ground.
    places, feet_places : (n, d) array
        Reference places of nodes and feet, on the smooth face, of solids of patches [m].
    normals, tangents : (n, 2) array, of solids (n, 3) and (n, 2, 3)
        Unit normals n out of the other side into ``body``, and ``t = (n_y, -n_x)``; in space t and
        t2 as in :attr:`fecontact.ModalBasis.tangents`.
    gaps : (n,) array
        Initial gaps, not negative [m].
    tributary : (n,) array
        Length of the face that each node stands for [m], of solids area [m^2].
    nodes, feet : sparse (3 n, 2 N), of solids (6 n, 3 N) array
        Displacements and rotations of each node from the nodal displacements of ``body``, and of
        its foot from those of ``other`` (None for the ground).
    report : PairingReport
    swapped : bool
        Whether the nodes lie on the face that was given as the other one, because it is finer.
    patches : Patches, optional
        Facets that belong to each contact node of solids.
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
    swapped: bool = False
    patches: Any = None

    def summary(self) -> list[tuple[str, str]]:
        """Names and values of the report."""
        return self.report.summary()

    @property
    def passes(self) -> "tuple[Pairing, ...]":
        """The pairing itself."""
        return (self,)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class TwoPassPairing(Summarised):
    """Two faces paired twice, with contact nodes on either; one interface.

    Each pass stands for half of the lengths, so that totals of the interface, such as its
    stiffness, are shared out over both. Made by :func:`pair_both_faces`.

    Parameters
    ----------
    first : Pairing
        Pass with the nodes on the first face.
    second : Pairing
        Pass with the nodes on the other face, whose normals are the opposite ones.
    """

    first: Pairing
    second: Pairing

    def summary(self) -> list[tuple[str, str]]:
        """Names and values of the reports of both passes."""
        return [(f"{name}, pass {number}", text) for number, one in enumerate(self.passes, start=1)
                for name, text in one.report.summary()]

    @property
    def passes(self) -> tuple[Pairing, ...]:
        """Both passes, the first one first."""
        return (self.first, self.second)

    @property
    def body(self) -> str:
        """Name of the body with the first face."""
        return self.first.body

    @property
    def other(self) -> str | None:
        """Name of the body with the other face."""
        return self.first.other

    @property
    def gaps(self) -> Array:
        """Initial gaps (n,) of the nodes of both passes [m]."""
        return np.concatenate([one.gaps for one in self.passes])


def pair_faces(
    bodies: Mapping[str, ElasticBody], face: str, other: str, *,
    nodes: Count = "all", nodes_on: Literal["finer", "face"] = "finer",
    reach: float | None = None, overlap: float = 0.01,
) -> Pairing:
    """Pair contact nodes on one face with the closest places on another face or the ground.

    Faces whose edges meet at up to 30 degrees are smooth curves through their nodes. Nodes beyond
    the ends of the other face have no partner, are left out and stand in the report.

    Parameters
    ----------
    bodies : mapping of name to ElasticBody
        In the places where they are assembled.
    face, other : str
        "BODY.BOUNDARY"; ``other`` may be "ground", y = 0 (of solids z = 0), and both may be of one
        body.
    nodes : "all" or int, of solids also (int, int)
        Every displacement node, or so many segments of equal length with their mean displacement,
        whose loads are even also where the meshes do not match. Of solids every facet, or patches
        of about equal area; two numbers are those along the first and the second tangent.
    nodes_on : "finer" or "face"
        Face with the nodes: ``other`` if it is finer than ``face``, or ``face`` in any case.
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
    if isinstance(first, SolidFace):
        return _in_space(bodies, first, other, nodes, nodes_on, reach, overlap)
    if other == "ground":
        return _on_ground(first, nodes, reach, overlap)
    second = _plane_face(bodies, other, first)
    _check_apart(first, second)
    if nodes_on == "finer" and finer_face(bodies, face, other) == other:
        return replace(_paired(second, first, nodes, reach, overlap), swapped=True)
    return _paired(first, second, nodes, reach, overlap)


def pair_both_faces(
    bodies: Mapping[str, ElasticBody], face: str, other: str, *,
    nodes: Count = "all", reach: float | None = None, overlap: float = 0.01,
) -> TwoPassPairing:
    """Pair two faces twice, with nodes on ``face`` and on ``other``, each with half its length.

    Loads are more even than in one pass. For compliant normal laws only: rigid constraints would be
    redundant. Arguments and errors are those of :func:`pair_faces`. One interface takes both:
    ``Interface(name, pair_both_faces(bodies, face, other), normal, friction)``.
    """
    first = _face(bodies, face, "face")
    _check_options("face", reach, overlap)
    if isinstance(first, SolidFace):
        one, two = (_in_space(bodies, _solid_face(bodies, here, first), there, nodes, "face", reach,
                              overlap) for here, there in ((face, other), (other, face)))
    else:
        second = _plane_face(bodies, other, first)
        _check_apart(first, second)
        one, two = (_paired(*pair, nodes, reach, overlap)
                    for pair in ((first, second), (second, first)))
    return TwoPassPairing(replace(one, tributary=0.5 * one.tributary),
                          replace(two, tributary=0.5 * two.tributary, swapped=True))


def finer_face(bodies: Mapping[str, ElasticBody], face: str, other: str) -> str:
    """The one of two faces "BODY.BOUNDARY" whose displacement nodes are closer; ``face`` if equal.

    Raises
    ------
    InputError, MeshError
        If there is no such body or boundary.
    """
    first = _face(bodies, face, "face")
    second = (_solid_face(bodies, other, first) if isinstance(first, SolidFace)
              else _plane_face(bodies, other, first))
    return other if second.spacing < _FINER * first.spacing else face


def _in_space(
    bodies: Mapping[str, ElasticBody], first: SolidFace, other: str, nodes: Count,
    nodes_on: str, reach: float | None, overlap: float,
) -> Pairing:
    if other == "ground":
        return Pairing(**grounded_solid(first, nodes, reach, overlap))
    second = _solid_face(bodies, other, first)
    check_solids_apart(first, second)
    if nodes_on == "finer" and second.spacing < _FINER * first.spacing:
        return Pairing(**paired_solids(second, first, nodes, reach, overlap), swapped=True)
    return Pairing(**paired_solids(first, second, nodes, reach, overlap))


def _plane_face(bodies: Mapping[str, ElasticBody], name: str, first: Face | SolidFace) -> Face:
    found = _face(bodies, name, "other")
    if isinstance(found, SolidFace):
        raise _mixed(found, first)
    return found


def _solid_face(
    bodies: Mapping[str, ElasticBody], name: str, first: Face | SolidFace
) -> SolidFace:
    found = _face(bodies, name, "other")
    if not isinstance(found, SolidFace):
        raise _mixed(first, found)
    return found


def _mixed(solid: Face | SolidFace, plane: Face | SolidFace) -> InputError:
    return InputError(f"pair_faces: '{solid.label}' is a face of a solid and '{plane.label}' of a "
                      f"plane body, which cannot touch each other; model both alike.")


def _face(bodies: Mapping[str, ElasticBody], name: str, key: str) -> Face | SolidFace:
    require_kind("pair_faces", Mapping, bodies=bodies)
    require_kind("pair_faces", str, **{key: name})
    body, dot, boundary = name.partition(".")
    if not (body and dot and boundary):
        raise InputError(f"pair_faces: {key} = {name!r} must be 'BODY.BOUNDARY'; bodies are "
                         f"{choices(bodies)}, and the other side of one pass may be 'ground'.")
    if body not in bodies:
        raise InputError(f"pair_faces: {key} = {name!r} names no body{nearest(body, bodies)}; "
                         f"bodies are {choices(bodies)}.")
    require_kind("pair_faces", ElasticBody, **{f"bodies['{body}']": bodies[body]})
    bodies[body].mesh.boundary(boundary)
    if bodies[body].dimension == 3:
        return SolidFace(bodies[body], boundary, name)
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
    face: Face, other: Face, nodes: Count, reach: float | None, overlap: float
) -> Pairing:
    limit = max(face.extent, other.extent) if reach is None else float(reach)
    present = face_nodes(face.body, face.boundary)
    samples = node_samples(face, present)
    found = samples.closest(other, limit)
    shared = np.isin(present, other.nodes) & (face.body is other.body)
    runs, marks = covered(face, other, limit), opposite_ends(face, other, limit)
    partnered = np.zeros(len(face.body.nodes), dtype=bool)
    partnered[present[found.valid & ~shared]] = True
    lengths = lumped_lengths(face, runs, partnered)[present]
    kept = lengths > SAME * face.spacing
    if not kept.any():
        raise InputError(no_partner(samples, found, face, other, limit))
    alone = samples.places[~kept]
    why = reasons(found, shared, other.label, kept)
    if nodes == "all":
        samples = node_samples(face, present[kept])
        matrix, tributary = node_matrix(face.body, present[kept]), lengths[kept]
    else:
        segments, tributary = face_segments(face.body, face.boundary, nodes, runs, _COUNT)
        samples, matrix = segment_samples(face, segments, marks), _segment_matrix(face, segments)
    found = samples.closest(other, limit)
    return _described(face, other, samples, found, matrix, tributary, overlap,
                      alone=(alone, why), limit=limit, pressure=pressure_samples(face, runs, marks))


def _described(
    face: Face, other: Face, samples: Samples, found: Closest, matrix: Any, tributary: Array,
    overlap: float, *, alone: tuple[Array, tuple[str, ...]], limit: float, pressure: Samples,
) -> Pairing:
    """The pairing of contact nodes all of which have a partner."""
    import scipy.sparse as sp

    size = len(tributary)
    hit = samples.only(found.valid)
    hit = replace(hit, share=hit.share / np.bincount(hit.owner, hit.share, size)[hit.owner])
    normals = hit.mean(found.normals[found.valid], size)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    tangents = np.column_stack([normals[:, 1], -normals[:, 0]])
    places = samples.mean(samples.places, size)
    gaps, closed = closed_gaps(hit.mean(found.gaps[found.valid], size), places, overlap,
                           min(face.lengths.mean(), other.lengths.mean()), face.label,
                               other.label)
    at_node = _at_nodes(other, hit, found, size)
    chosen = np.unique(other.nodes)
    feet = sp.csr_array(sp.kron(at_node[:, chosen], sp.eye_array(3))
                        @ node_matrix(other.body, chosen))
    arms = samples.mean(samples.straight, size) - hit.mean(
        other.straight(found.edges, found.s)[found.valid], size)
    report = PairingReport(
        face.label, other.label, size, *alone, float(pressure.share.sum() / face.lengths.sum()),
        _unevenness(other, at_node.T @ tributary, pressure, limit),
        float(gaps.max()), closed, float(np.abs((tangents * arms).sum(axis=1)).max()))
    return Pairing(_body(face), _body(other), places, normals, tangents, gaps, tributary, matrix,
                   feet, hit.mean(found.places[found.valid], size), report)


def _on_ground(
    face: Face, nodes: Count, reach: float | None, overlap: float
) -> Pairing:
    check_faces_down(face.body, face.boundary)
    if nodes == "all":
        present = face_nodes(face.body, face.boundary)
        samples, matrix = node_samples(face, present), node_matrix(face.body, present)
        lengths = lumped_lengths(face, [whole(face.nodes)],
                                 np.ones(len(face.body.nodes), dtype=bool))[present]
    else:
        segments, lengths = face_segments(face.body, face.boundary, nodes, key=_COUNT)
        samples, matrix = segment_samples(face, segments), _segment_matrix(face, segments)
    places = samples.mean(samples.places, len(lengths))
    kept = places[:, 1] <= (np.inf if reach is None else reach)
    if not kept.any():
        raise InputError(f"pair_faces: no node of '{face.label}' is within reach = {reach:g} m of "
                         f"the ground, y = 0; the lowest is {places[:, 1].min():.4g} m above it.")
    alone, places = places[~kept], places[kept]
    gaps, closed = closed_gaps(places[:, 1], places, overlap, float(face.lengths.mean()),
                               face.label, "the ground, y = 0,")
    normals, tangents = np.tile([0.0, 1.0], (len(gaps), 1)), np.tile([1.0, 0.0], (len(gaps), 1))
    report = PairingReport(
        face.label, "ground", len(gaps), alone, ("is out of reach",) * len(alone),
        float(lengths[kept].sum() / lengths.sum()), 0.0, float(gaps.max()), closed, 0.0)
    return Pairing(_body(face), None, places, normals, tangents, gaps, lengths[kept],
                   matrix[np.flatnonzero(np.repeat(kept, 3))], None, places * [1.0, 0.0], report)


def _body(face: Face) -> str:
    return face.label.partition(".")[0]


def _segment_matrix(face: Face, segments: list[Pieces]) -> Any:
    import scipy.sparse as sp

    return sp.csr_array(sp.vstack([patch_rows(face.body, part).matrix for part in segments]))


def _at_nodes(other: Face, samples: Samples, found: Closest, size: int) -> Any:
    """Weights (size, N) of all displacement nodes of the other body at the feet."""
    import scipy.sparse as sp

    nodes = other.nodes[found.edges[found.valid]]
    weights = samples.share[:, None] * other.shape_functions(found.s[found.valid])
    owner = np.repeat(samples.owner, nodes.shape[1])
    return sp.csr_array(sp.coo_array((weights.ravel(), (owner, nodes.ravel())),
                                     shape=(size, len(other.body.nodes))))


def _unevenness(other: Face, loads: Array, pressure: Samples, reach: float) -> float:
    """Largest error of the nodal loads (N,) of a uniform pressure, over those of whole edges."""
    found = pressure.closest(other, reach)
    hit = replace(pressure.only(found.valid), owner=np.zeros(int(found.valid.sum()), dtype=int))
    exact = _at_nodes(other, hit, found, 1).toarray()[0]
    whole_edges = np.zeros(len(other.body.nodes))
    np.add.at(whole_edges, other.nodes, edge_weights(other.body, other.nodes))
    there = whole_edges > 0.0
    return float((np.abs(loads - exact)[there] / whole_edges[there]).max())
