"""Contact nodes on a boundary: equal segments or patches, or every displacement node or facet."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array, Integers
from fecontact.fem.body_forces import along_outline
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import (
    Count,
    check_facets_down,
    contact_patches,
    face_surface,
)
from fecontact.fem.points import Pieces, edge_weights, node_matrix, patch_rows, whole


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """Rows (3 n, 2 N), places (n, 2) [m] and tributary lengths (n,) [m] of the contact nodes.

    Of a solid rows (6 n, 3 N), places (n, 3), areas (n,) [m^2] and outward normals (n, 3).
    ``groups`` holds the name of each boundary and its number of nodes, ``owner`` the contact node
    of each facet of a solid's boundaries, one boundary after the other.
    """

    matrix: Any
    positions: Array
    tributary: Array
    groups: tuple[tuple[str, int], ...]
    normals: Array | None = None
    owner: Integers | None = None


def contact_groups(
    body: ElasticBody, boundaries: str | Sequence[str],
    counts: Count | Sequence[Count],
) -> ContactNodes:
    """Contact nodes on one or several boundaries, in the order of the boundaries, or on none.

    ``counts`` is common to all boundaries or has one entry per boundary, see :func:`contact_nodes`;
    two numbers for the one boundary of a solid are those along both of its directions.

    Raises
    ------
    InputError
        See :func:`contact_nodes`; if a boundary is named twice, two of them share an edge, or the
        number of counts differs from that of the boundaries.
    """
    import scipy.sparse as sp

    require_kind("modal_basis", (str, Sequence), contact=boundaries)
    if not isinstance(boundaries, str):
        for item in boundaries:
            require_kind("modal_basis: contact", str, name=item)
    names = (boundaries,) if isinstance(boundaries, str) else tuple(boundaries)
    grid = body.dimension == 3 and len(names) == 1 and isinstance(counts, list | tuple) and (
        len(counts) == 2)
    each: tuple[Any, ...] = (tuple(counts) if isinstance(counts, list | tuple) and not grid
                             else (counts,) * len(names))
    if not names:
        return ContactNodes(sp.csr_array((0, body.nodes.size)), np.zeros((0, body.dimension)),
                            np.zeros(0), ())
    if len(set(names)) < len(names):
        raise InputError(f"contact = {boundaries!r} must name boundaries, each once.")
    if len(each) != len(names):
        raise InputError(f"contact_nodes = {counts!r} must be one entry for all boundaries, or "
                         f"one for each of the {len(names)}.")
    edges = np.concatenate([np.sort(body.mesh.boundary(name), axis=1) for name in names])
    if len(np.unique(edges, axis=0)) < len(edges):
        one, many = ("an edge", "edges") if body.dimension == 2 else ("a facet", "facets")
        raise InputError(f"The contact boundaries {choices(names)} share {many}; {one} can "
                         f"belong to only one interface.")
    faces = [contact_nodes(body, name, count)
             for name, count in zip(names, each, strict=True)]
    whole = ContactNodes(
        sp.csr_array(sp.vstack([face.matrix for face in faces])),
        np.concatenate([face.positions for face in faces]),
        np.concatenate([face.tributary for face in faces]),
        tuple(group for face in faces for group in face.groups),
    )
    if body.dimension == 2:
        return whole
    first = np.cumsum([0, *(len(face.tributary) for face in faces)])
    return replace(whole, normals=np.concatenate([face.normals for face in faces]),
                   owner=np.concatenate([start + face.owner for start, face in zip(
                       first, faces, strict=False)]))


def contact_nodes(
    body: ElasticBody, boundary: str, count: Count
) -> ContactNodes:
    """Contact nodes on a named boundary, in their order along it.

    With a number, the boundary is cut into that many segments of equal length (distributed over
    connected parts in proportion to their length); a node represents its segment, moves with the
    segment's mean displacement and loads it with a uniform traction. With 'all', every
    displacement node of the boundary is a contact node, with the integral of its shape function as
    tributary length.

    The face of a solid is cut into patches of facets of nearly equal area, which move and are
    loaded likewise; with 'all', every facet is one; two numbers are those along its first and
    second tangent, or around and across the axis of a ring, bore or shaft. (The integrals of shape
    functions over quadratic facets are zero or negative at corners.)

    Raises
    ------
    MeshError
        If the mesh has no such boundary.
    InputError
        If the boundary faces up, or has fewer nodes, or facets, than requested.
    """
    import scipy.sparse as sp

    check_faces_down(body, boundary)
    if body.dimension == 3:
        patches = contact_patches(face_surface(body, boundary), boundary, count)
        return ContactNodes(patches.rows(), patches.centres, patches.areas,
                            ((boundary, patches.count),), patches.normals, patches.owner)
    if count == "all":
        nodes = face_nodes(body, boundary)
        tributary = np.zeros(len(body.nodes))
        edges = np.concatenate(face_chains(body, boundary))
        np.add.at(tributary, edges, edge_weights(body, edges))
        return ContactNodes(node_matrix(body, nodes), body.nodes[nodes], tributary[nodes],
                            ((boundary, len(nodes)),))
    segments, lengths = face_segments(body, boundary, count)
    rows = [patch_rows(body, segment) for segment in segments]
    return ContactNodes(
        sp.csr_array(sp.vstack([row.matrix for row in rows])),
        np.array([row.position for row in rows]),
        lengths,
        ((boundary, len(rows)),),
    )


def face_nodes(body: ElasticBody, boundary: str) -> Integers:
    """Displacement nodes of a boundary, in the order of :func:`face_chains`."""
    return np.concatenate([_in_order(chain) for chain in face_chains(body, boundary)])


def face_segments(
    body: ElasticBody, boundary: str, count: Count, runs: Sequence[Pieces] | None = None,
    key: str = "contact_nodes",
) -> tuple[list[Pieces], Array]:
    """Segments of equal length of a boundary, or of the successive pieces ``runs`` of it.

    Each segment is the pieces of edges that it consists of; beside them stand their lengths [m].
    ``key`` names the count in messages.
    """
    parts = ([whole(chain) for chain in face_chains(body, boundary)] if runs is None
             else list(runs))
    most = len(np.unique(np.concatenate([part.nodes.ravel() for part in parts])))
    if isinstance(count, bool) or not isinstance(count, int) or not len(parts) <= count <= most:
        raise InputError(f"{key} = {count!r} must be 'all' or a whole number from {len(parts)} to "
                         f"{most}, the number of nodes on boundary '{boundary}'; refine the "
                         f"mesh for more.")
    segments: list[Pieces] = []
    each: list[float] = []
    totals = np.array([_lengths(body, part).sum() for part in parts])
    for part, share, total in zip(parts, _shared_out(count, totals), totals, strict=True):
        segments += _cut(body, part, share)
        each += [total / share] * share
    return segments, np.array(each)


def face_chains(body: ElasticBody, boundary: str) -> list[Integers]:
    """Displacement nodes (k, degree + 1) of each connected part of a boundary, edge by edge.

    The body lies on the left of successive edges; the parts are in the order of their smallest
    abscissae.
    """
    chains = _chains(along_outline(body.mesh, body.mesh.boundary(boundary)))
    chains.sort(key=lambda chain: float(body.mesh.nodes[chain, 0].min()))
    return [body.edge_nodes(chain) for chain in chains]


def check_faces_down(body: ElasticBody, boundary: str) -> None:
    """Raise :class:`InputError` unless all edges or facets of a boundary face the ground below."""
    if body.dimension == 3:
        check_facets_down(face_surface(body, boundary), boundary)
        return
    edges = along_outline(body.mesh, body.mesh.boundary(boundary))
    # The body lies on the left of its edges: a face that looks down runs to +x.
    runs = body.mesh.nodes[edges[:, 1], 0] - body.mesh.nodes[edges[:, 0], 0]
    length = np.linalg.norm(body.mesh.nodes[edges[:, 1]] - body.mesh.nodes[edges[:, 0]], axis=1)
    if runs.sum() < 0.5 * length.sum() or (runs < -1e-9 * length).any():
        raise InputError(f"Boundary '{boundary}' does not face the ground, which lies below the "
                         f"body (towards -y), with all its edges; turn the mesh or choose another "
                         f"contact boundary.")


def _chains(edges: Integers) -> list[Integers]:
    """Directed edges as chains (k, 2) of successive edges, each from one end to the other."""
    ahead: dict[int, list[int]] = {}
    for start, end in edges.tolist():
        ahead.setdefault(start, []).append(end)
    ends = set(edges[:, 1].tolist())
    chains = []
    for start in sorted(ahead, key=lambda node: (node in ends, node)):
        chain, node = [], start
        while ahead.get(node):
            chain.append((node, ahead[node].pop(0)))
            node = chain[-1][1]
        if chain:
            chains.append(np.array(chain))
    return chains


def _in_order(nodes: Integers) -> Integers:
    """Nodes of successive edges, each once, along the chain."""
    along = nodes[:, :-1].ravel()
    closed = nodes[0, 0] == nodes[-1, -1]
    return along if closed else np.append(along, nodes[-1, -1])


def _lengths(body: ElasticBody, pieces: Pieces) -> Array:
    ends = body.nodes[pieces.nodes[:, -1]] - body.nodes[pieces.nodes[:, 0]]
    return np.asarray((pieces.end - pieces.start) * np.linalg.norm(ends, axis=1))


def _shared_out(count: int, totals: Array) -> list[int]:
    """Integers of sum ``count``, at least one each, in proportion to ``totals``."""
    shares = np.ones(len(totals), dtype=int)
    for _ in range(count - len(totals)):
        shares[np.argmax(totals / shares)] += 1
    return [int(share) for share in shares]


def _cut(body: ElasticBody, run: Pieces, count: int) -> list[Pieces]:
    length = _lengths(body, run)
    reached = np.concatenate([[0.0], np.cumsum(length)])
    cuts = np.linspace(0.0, reached[-1], count + 1)
    pieces = []
    for low, high in itertools.pairwise(cuts):
        start = np.clip((low - reached[:-1]) / length, 0.0, 1.0)
        end = np.clip((high - reached[:-1]) / length, 0.0, 1.0)
        kept = end - start > 1e-12
        part = run.end - run.start
        pieces.append(Pieces(run.nodes[kept], (run.start + start * part)[kept],
                             (run.start + end * part)[kept]))
    return pieces
