"""Facets of solids that belong to contact nodes: the patches of both sides, and cells beside them.

The rows of a contact node in the restriction hold the motion of its patch, less that of its foot on
the other side. Its patch are the facets of the outline whose nodes all take part in them, and that
look against its normal; facets that look along it are those under its foot.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes

_PART = 1e-9  # of the largest entry of a contact node's rows, from which on a mesh node takes part
_FACING = 0.1  # least cosine of a facet's normal against that of its contact node


@dataclass(frozen=True, eq=False)
class ContactFacets:
    """Facets of the outline of solids that belong to contact nodes.

    Attributes
    ----------
    facets : (k, 3) or (k, 4) integer array
        Mesh nodes of the facets, counter-clockwise seen from outside.
    owner : (k,) integer array
        Contact node of each.
    own : (k,) bool array
        True if the facet belongs to the patch of its contact node, not to the other side.
    """

    facets: Integers
    owner: Integers
    own: Any

    @cached_property
    def patches(self) -> "ContactFacets":
        """Facets of the patches, without those of the other side."""
        return ContactFacets(self.facets[self.own], self.owner[self.own], self.own[self.own])

    def at_nodes(self, count: int) -> Integers:
        """Contact node (N,) of each of the mesh nodes, -1 where none is.

        Mesh nodes between patches take one of them.
        """
        found = np.full(count, -1)
        found[self.facets] = self.owner[:, None]
        return found

    def at_cells(self, cells: Integers, count: int) -> Integers:
        """Index (c,) of the facet of each cell, -1 for none."""
        import scipy.sparse as sp

        found = np.full(len(cells), -1)
        if not len(self.facets):
            return found
        k, corners = self.facets.shape
        columns = np.repeat(np.arange(k), corners)
        facets = sp.csr_array((np.ones(k * corners), (self.facets.ravel(), columns)),
                              shape=(count, k))
        beside = np.isin(cells, self.facets).sum(axis=1) >= corners
        rows = np.repeat(np.arange(np.count_nonzero(beside)), cells.shape[1])
        members = sp.csr_array((np.ones(len(rows)), (rows, cells[beside].ravel())),
                               shape=(np.count_nonzero(beside), count))
        # Rows of cells may repeat their last corner.
        members.sum_duplicates()
        members.data[:] = 1.0
        shared = sp.coo_array(members @ facets)
        whole = shared.data == corners
        found[np.flatnonzero(beside)[shared.row[whole]]] = shared.col[whole]
        return found


def contact_facets(basis: ModalBasis) -> ContactFacets:
    """Facets of the contact nodes of solids with shapes over the body; springs have none."""
    field = basis.mode_shapes
    assert field is not None
    assert basis.dimension == 3
    facets = field.outline
    touching = ~basis.spring_nodes
    if field.outline_nodes is not None:
        chosen = np.flatnonzero(field.outline_nodes >= 0)
        owner = field.outline_nodes[chosen]
        kept = touching[owner]
        chosen, owner = chosen[kept], owner[kept]
        return ContactFacets(facets[chosen], owner, np.ones(len(chosen), dtype=bool))
    at, node, own = _candidates(basis, field, touching)
    corners = field.nodes[facets[at]]
    vectors = facet_vectors(field.nodes, facets[at])
    looks, size = (vectors * basis.normals[node]).sum(axis=1), np.linalg.norm(vectors, axis=1)
    facing = np.where(own, -looks, looks) > _FACING * size
    at, node, own = at[facing], node[facing], own[facing]
    # Of several contact nodes whose nodes a facet has all, the nearest one.
    away = np.linalg.norm(corners[facing].mean(axis=1) - basis.contact_places[node], axis=1)
    order = np.lexsort((away, at))
    first = order[np.flatnonzero(np.diff(at[order], prepend=-1))]
    return ContactFacets(facets[at[first]], node[first], own[first])


def _candidates(
    basis: ModalBasis, field: ModeShapes, touching: Any
) -> tuple[Integers, Integers, Any]:
    """Facets and contact nodes in whose motion all nodes of the facet take part, and on which side.

    True is the side of the contact node.
    """
    import scipy.sparse as sp

    n, N = basis.contact_nodes, len(field.nodes)
    rows = sp.coo_array(field.restriction.tocsr()[12 : 12 + 6 * n])
    row, column, values = rows.row, rows.col, rows.data
    node, place, size = row // 6, column // 3, np.abs(values)
    body = np.zeros(N, dtype=np.int64)
    for number, one in enumerate(basis.parts):
        body[one.nodes[0] : sum(one.nodes)] = number
    # The weights of displacements along the normal have the sum one on a contact node's own body.
    along = row % 6 == 2
    weights = np.zeros((n, max(len(basis.parts), 1)))
    np.add.at(weights, (node[along], body[place[along]]),
              values[along] * basis.normals[node[along], column[along] % 3])
    own = body[place] == weights.argmax(axis=1)[node]
    # Rotations hold corners on which displacements do not depend. Those of feet reach deeper.
    turns = row % 6 >= 3
    largest = np.zeros((2, n))
    np.maximum.at(largest, (turns.astype(int), node), size)
    used = (size > _PART * largest[turns.astype(int), node]) & touching[node] & (own | ~turns)
    k, corners = field.outline.shape
    members = sp.csr_array((np.ones(k * corners), (field.outline.ravel(),
                                                   np.repeat(np.arange(k), corners))),
                           shape=(N, k))
    found = []
    for side in (True, False):
        chosen = used & (own == side)
        part = sp.csr_array((np.ones(np.count_nonzero(chosen)), (node[chosen], place[chosen])),
                            shape=(n, N))
        part.sum_duplicates()
        part.data[:] = 1.0
        shared = sp.coo_array(part @ members)
        whole = shared.data == corners
        found.append((shared.col[whole].astype(np.int64), shared.row[whole].astype(np.int64),
                      np.full(np.count_nonzero(whole), side)))
    at, which, sides = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    return at, which, sides


def facet_vectors(nodes: Array, facets: Integers) -> Array:
    """Normals (k, 3) of facets out of the body, as long as their areas [m^2]."""
    corners = nodes[facets]
    across = corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]
    if facets.shape[1] == 3:
        across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * np.cross(*across))
