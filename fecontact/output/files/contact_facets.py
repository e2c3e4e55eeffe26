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
        Their mesh nodes, counter-clockwise seen from outside.
    owner : (k,) integer array
        Contact node of each.
    own : (k,) bool array
        Whether it belongs to the patch of its contact node, not to the other side.
    """

    facets: Integers
    owner: Integers
    own: Any

    @cached_property
    def patches(self) -> "ContactFacets":
        """Those of the patches alone."""
        return ContactFacets(self.facets[self.own], self.owner[self.own], self.own[self.own])

    def at_nodes(self, count: int) -> Integers:
        """Contact node (N,) of each of the mesh nodes, -1 where none is.

        Mesh nodes between patches take one of them.
        """
        found = np.full(count, -1)
        found[self.facets] = self.owner[:, None]
        return found

    def at_cells(self, cells: Integers, count: int) -> Integers:
        """Which of the facets (M,) each cell has, -1 for none."""
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
    at, node = _candidates(field, basis.contact_nodes, touching)
    corners = field.nodes[facets[at]]
    vectors = facet_vectors(field.nodes, facets[at])
    looks, size = (vectors * basis.normals[node]).sum(axis=1), np.linalg.norm(vectors, axis=1)
    facing = np.abs(looks) > _FACING * size
    at, node, own = at[facing], node[facing], looks[facing] < 0.0
    # Of several contact nodes whose nodes a facet has all, the nearest one.
    away = np.linalg.norm(corners[facing].mean(axis=1) - basis.contact_places[node], axis=1)
    order = np.lexsort((away, at))
    first = order[np.flatnonzero(np.diff(at[order], prepend=-1))]
    return ContactFacets(facets[at[first]], node[first], own[first])


def _candidates(field: ModeShapes, n: int, touching: Any) -> tuple[Integers, Integers]:
    """Facets and contact nodes in whose rows all nodes of the facet take part."""
    import scipy.sparse as sp

    rows = sp.coo_array(field.restriction.tocsr()[12 : 12 + 6 * n])
    node, place, size = rows.row // 6, rows.col // 3, np.abs(rows.data)
    # Rotations weigh with their arms: they hold corners on which displacements do not depend.
    turns = (rows.row % 6 >= 3).astype(int)
    largest = np.zeros((2, n))
    np.maximum.at(largest, (turns, node), size)
    used = (size > _PART * largest[turns, node]) & touching[node]
    part = sp.csr_array((np.ones(np.count_nonzero(used)), (node[used], place[used])),
                        shape=(n, len(field.nodes)))
    part.sum_duplicates()
    part.data[:] = 1.0
    k, corners = field.outline.shape
    facets = sp.csr_array((np.ones(k * corners), (field.outline.ravel(),
                                                  np.repeat(np.arange(k), corners))),
                          shape=(len(field.nodes), k))
    shared = sp.coo_array(part @ facets)
    whole = shared.data == corners
    return shared.col[whole].astype(np.int64), shared.row[whole].astype(np.int64)


def facet_vectors(nodes: Array, facets: Integers) -> Array:
    """Normals (k, 3) of facets out of the body, as long as their areas [m^2]."""
    corners = nodes[facets]
    across = corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]
    if facets.shape[1] == 3:
        across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * np.cross(*across))
