"""Contact nodes on a boundary: equal segments, or every displacement node."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.points import Pieces, edge_weights, node_matrix, patch_rows


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """Rows (3 n, 2 N), places (n, 2) [m] and tributary lengths (n,) [m] of the contact nodes.

    ``groups`` holds the name of each boundary and its number of nodes.
    """

    matrix: Any
    positions: Array
    tributary: Array
    groups: tuple[tuple[str, int], ...]


def contact_groups(
    body: ElasticBody, boundaries: str | Sequence[str],
    counts: Literal["all"] | int | Sequence[int | Literal["all"]],
) -> ContactNodes:
    """Contact nodes on one or several boundaries, in the order of the boundaries, or on none.

    ``counts`` is common to all boundaries or has one entry per boundary; see :func:`contact_nodes`.

    Raises
    ------
    InputError
        As :func:`contact_nodes`, or if a boundary is named twice, two of them share an edge, or the
        number of counts differs from that of the boundaries.
    """
    import scipy.sparse as sp

    require_kind("modal_basis", (str, Sequence), contact=boundaries)
    if not isinstance(boundaries, str):
        for item in boundaries:
            require_kind("modal_basis: contact", str, name=item)
    names = (boundaries,) if isinstance(boundaries, str) else tuple(boundaries)
    each: tuple[Any, ...] = (tuple(counts) if isinstance(counts, list | tuple)
                             else (counts,) * len(names))
    if not names:
        return ContactNodes(sp.csr_array((0, 2 * len(body.nodes))), np.zeros((0, 2)),
                            np.zeros(0), ())
    if len(set(names)) < len(names):
        raise InputError(f"contact = {boundaries!r} must name boundaries, each once.")
    if len(each) != len(names):
        raise InputError(f"contact_nodes = {counts!r} must be one entry for all boundaries, or "
                         f"one for each of the {len(names)}.")
    edges = np.concatenate([np.sort(body.mesh.boundary(name), axis=1) for name in names])
    if len(np.unique(edges, axis=0)) < len(edges):
        raise InputError(f"The contact boundaries {choices(names)} share edges; an edge can "
                         f"belong to only one interface.")
    faces = [contact_nodes(body, name, count)
             for name, count in zip(names, each, strict=True)]
    return ContactNodes(
        sp.csr_array(sp.vstack([face.matrix for face in faces])),
        np.concatenate([face.positions for face in faces]),
        np.concatenate([face.tributary for face in faces]),
        tuple(group for face in faces for group in face.groups),
    )


def contact_nodes(
    body: ElasticBody, boundary: str, count: int | Literal["all"]
) -> ContactNodes:
    """Contact nodes on a named boundary, in their order along it.

    With a number, the boundary is cut into that many segments of equal length (distributed over
    connected parts in proportion to their length); a node represents its segment, moves with the
    segment's mean displacement and loads it with a uniform traction. With 'all', every
    displacement node of the boundary is a contact node, with the integral of its shape function as
    tributary length.

    Raises
    ------
    MeshError
        If the mesh has no such boundary.
    InputError
        If the boundary faces up, or has fewer nodes than requested.
    """
    import scipy.sparse as sp

    chains = _chains(body.mesh.boundary(boundary))
    chains.sort(key=lambda chain: float(body.mesh.nodes[chain, 0].min()))
    chains = [chain if body.mesh.nodes[chain[0, 0], 0] <= body.mesh.nodes[chain[-1, 1], 0]
              else chain[::-1, ::-1] for chain in chains]
    _check_faces_down(body, boundary)
    edges = [body.edge_nodes(chain) for chain in chains]
    nodes = np.unique(np.concatenate([e.ravel() for e in edges]))
    if count == "all":
        ordered = np.concatenate([_in_order(e) for e in edges])
        tributary = np.zeros(len(body.nodes))
        for e in edges:
            np.add.at(tributary, e, edge_weights(body, e))
        return ContactNodes(node_matrix(body, ordered), body.nodes[ordered], tributary[ordered],
                            ((boundary, len(ordered)),))
    if isinstance(count, bool) or not isinstance(count, int) or not (
            len(chains) <= count <= len(nodes)):
        raise InputError(f"contact_nodes = {count!r} must be 'all' or a whole number from "
                         f"{len(chains)} to {len(nodes)}, the number of nodes on boundary "
                         f"'{boundary}'; refine the mesh for more.")
    segments, each = [], []
    totals = np.array([_lengths(body, e).sum() for e in edges])
    for e, share in zip(edges, _shared_out(count, totals), strict=True):
        segments += _cut(body, e, share)
        each += [_lengths(body, e).sum() / share] * share
    rows = [patch_rows(body, segment) for segment in segments]
    return ContactNodes(
        sp.csr_array(sp.vstack([row.matrix for row in rows])),
        np.array([row.position for row in rows]),
        np.array(each),
        ((boundary, len(rows)),),
    )


def _check_faces_down(body: ElasticBody, boundary: str) -> None:
    outline = {(min(e), max(e)): e for e in map(tuple, body.mesh.outline.tolist())}
    edges = np.array([outline[min(e), max(e)]
                      for e in map(tuple, body.mesh.boundary(boundary).tolist())])
    # The body lies on the left of its outline: a face that looks down runs to +x.
    runs = body.mesh.nodes[edges[:, 1], 0] - body.mesh.nodes[edges[:, 0], 0]
    length = np.linalg.norm(body.mesh.nodes[edges[:, 1]] - body.mesh.nodes[edges[:, 0]], axis=1)
    if runs.sum() < 0.5 * length.sum() or (runs < -1e-9 * length).any():
        raise InputError(f"Boundary '{boundary}' does not face the ground, which lies below the "
                         f"body (towards -y), with all its edges; turn the mesh or choose another "
                         f"contact boundary.")


def _chains(edges: Integers) -> list[Integers]:
    """The edges as chains (k, 2) of successive edges, each from one end to the other."""
    neighbours: dict[int, list[int]] = {}
    for index, edge in enumerate(edges.tolist()):
        for node in edge:
            neighbours.setdefault(node, []).append(index)
    left = set(range(len(edges)))
    chains = []
    ends = sorted(node for node, around in neighbours.items() if len(around) == 1)
    for start in [*ends, *sorted(neighbours)]:
        chain, node = [], start
        while ahead := [index for index in neighbours[node] if index in left]:
            left.discard(ahead[0])
            a, b = edges[ahead[0]].tolist()
            other = b if node == a else a
            chain.append((node, other))
            node = other
        if chain:
            chains.append(np.array(chain))
    return chains


def _in_order(nodes: Integers) -> Integers:
    """Nodes of successive edges, each once, along the chain."""
    along = nodes[:, :-1].ravel()
    closed = nodes[0, 0] == nodes[-1, -1]
    return along if closed else np.append(along, nodes[-1, -1])


def _lengths(body: ElasticBody, nodes: Integers) -> Array:
    ends = body.nodes[nodes[:, -1]] - body.nodes[nodes[:, 0]]
    return np.asarray(np.linalg.norm(ends, axis=1))


def _shared_out(count: int, totals: Array) -> list[int]:
    """Integers of sum ``count``, at least one each, in proportion to ``totals``."""
    shares = np.ones(len(totals), dtype=int)
    for _ in range(count - len(totals)):
        shares[np.argmax(totals / shares)] += 1
    return [int(share) for share in shares]


def _cut(body: ElasticBody, nodes: Integers, count: int) -> list[Pieces]:
    length = _lengths(body, nodes)
    reached = np.concatenate([[0.0], np.cumsum(length)])
    cuts = np.linspace(0.0, reached[-1], count + 1)
    pieces = []
    for low, high in itertools.pairwise(cuts):
        start = np.clip((low - reached[:-1]) / length, 0.0, 1.0)
        end = np.clip((high - reached[:-1]) / length, 0.0, 1.0)
        kept = end - start > 1e-12
        pieces.append(Pieces(nodes[kept], start[kept], end[kept]))
    return pieces
