"""Elements of one kind of a body: their nodes, quadrature and gradients of shape functions."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import CellKind, shape_functions
from fecontact.fem.elements.quadrature import extrapolation

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
        Rule of quadrature of the stiffness over the reference cell.
    mass_rule : (p, d) and (p,) arrays
        Rule of quadrature of the mass.
    incompatible : bool
        True for bricks with incompatible modes, see :mod:`fecontact.fem.incompatible_modes`.
    """

    kind: CellKind
    numbers: Integers
    nodes: Integers
    places: Array
    geometry: int
    local: Array
    weights: Array
    mass_rule: tuple[Array, Array]
    incompatible: bool = False

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
        if self.has_mean_strain:
            gradients, volumes = self.exact.gradients()
            volume = volumes.sum(axis=1, keepdims=True)
            return np.einsum("eqkd,eq->ekd", gradients, volumes / volume)[:, None], volume
        gradients, determinants = self.gradients_at(self.local)
        # Rules of tetrahedra have negative weights.
        return gradients, np.abs(determinants) * self.weights

    @property
    def exact(self) -> "ElementBlock":
        """The elements with the rule of their mass for all integrals."""
        local, weights = self.mass_rule
        return replace(self, local=local, weights=weights)

    @property
    def has_mean_strain(self) -> bool:
        """True for quadrilaterals and hexahedra that have one strain, the mean over the element.

        They get a stiffness against hourglasses, see :mod:`fecontact.fem.mean_strain`.
        """
        return len(self.weights) == 1 and self.kind.has_centre

    def nodal_gradients(self) -> Array:
        """Gradients (e, k, k, d), at each node, of shape functions.

        Elements with fewer points of quadrature than the exact rule has get those extrapolated
        from these points, where strains are most accurate.
        """
        if self.incompatible or len(self.weights) == len(self.mass_rule[1]):
            return self.gradients_at(self.at_nodes)[0]
        weights = extrapolation(self.kind, self.nodes.shape[1], self.local)
        return np.einsum("nq,eqkd->enkd", weights, self.gradients()[0])

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

