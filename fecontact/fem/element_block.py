"""Elements of one kind of a body: their nodes, quadrature and gradients of shape functions."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import CellKind, shape_functions

# Directions of the components of a strain, by dimension.
PAIRS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))}

# Elements whose matrices fit into a few hundred MB.
_AT_ONCE = 2000


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ElementBlock:
    """Elements of one kind.

    Attributes
    ----------
    kind : CellKind
    numbers : (e,) integer array
        Numbers of the cells in the mesh, ascending.
    nodes : (e, k) integer array
        Displacement nodes, in the order of ``kind.places``.
    places : (N, d) array
        Places of all displacement nodes [m].
    geometry : int
        Number of the leading nodes whose shape functions map the reference cell: the corners, or
        all of elements that follow curved edges.
    local, weights : (q, d) and (q,) arrays
        Rule of quadrature over the reference cell.
    """

    kind: CellKind
    numbers: Integers
    nodes: Integers
    places: Array
    geometry: int
    local: Array
    weights: Array

    def only(self, rows: Any) -> "ElementBlock":
        """Some of the elements, by their rows."""
        return replace(self, numbers=self.numbers[rows], nodes=self.nodes[rows])

    def parts(self) -> Iterator["ElementBlock"]:
        """Parts of the elements whose matrices fit into memory."""
        for first in range(0, len(self.nodes), _AT_ONCE):
            yield self.only(slice(first, first + _AT_ONCE))

    @property
    def values(self) -> Array:
        """Shape functions (q, k) at the points of quadrature."""
        return shape_functions(self.kind.dimension, self.nodes.shape[1], self.local)[0]

    def gradients(self) -> tuple[Array, Array]:
        """Gradients (e, q, k, d) of shape functions and volumes (e, q) at points of quadrature.

        The volumes of a plane body are areas [m^d].
        """
        gradients, determinants = self.gradients_at(self.local)
        # Rules of tetrahedra have negative weights.
        return gradients, np.abs(determinants) * self.weights

    def gradients_at(self, local: Array) -> tuple[Array, Array]:
        """Gradients (e, q, k, d) and determinants (e, q) of the map at local coordinates (q, d)."""
        d, count = self.kind.dimension, self.nodes.shape[1]
        _, slopes = shape_functions(d, count, local)
        geometry = slopes if self.geometry == count else shape_functions(
            d, self.geometry, local)[1]
        jacobian = np.einsum("qkj,eki->eqij", geometry, self.places[self.nodes[:, :self.geometry]])
        gradients = np.einsum("qkj,eqji->eqki", slopes, np.linalg.inv(jacobian))
        return np.ascontiguousarray(gradients), np.linalg.det(jacobian)

    @property
    def at_nodes(self) -> Array:
        """Local coordinates (k, d) of the nodes."""
        return np.array(self.kind.places[: self.nodes.shape[1]], float)

    @property
    def volumes(self) -> Array:
        """Volume (e,) of each element, in the plane its area [m^d]."""
        return np.concatenate([np.empty(0), *(part.gradients()[1].sum(axis=1)
                                              for part in self.parts())])
