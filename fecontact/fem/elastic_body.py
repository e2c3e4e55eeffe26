"""The elastic body: mesh, material and supports as stiffness and mass."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import (
    InputError,
    MeshError,
    choices,
    nearest,
    require_finite,
    require_positive,
)
from fecontact.core.memory import require_memory
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, listed, quantity, span
from fecontact.fem.mesh import Mesh
from fecontact.fem.supports import check_supports, expansion, fixed_dofs, hinges

# Unknowns of a cell by number of corners and degree, and memory per unknown for modes [bytes].
_UNKNOWNS = {(3, 1): 1, (3, 2): 4, (4, 1): 2, (4, 2): 8}
_BYTES = {3: 7e3, 4: 9.5e3}


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material.

    Parameters
    ----------
    youngs_modulus : float
        E, positive [Pa].
    poisson_ratio : float
        nu, above -1 and below 0.5.
    density : float
        rho, positive [kg/m^3].

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    youngs_modulus: float = 2.1e11
    poisson_ratio: float = 0.3
    density: float = 7850.0

    def __post_init__(self) -> None:
        require_positive("Material", youngs_modulus=self.youngs_modulus, density=self.density)
        require_finite("Material", poisson_ratio=self.poisson_ratio)
        if not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(f"Material: poisson_ratio = {self.poisson_ratio!r} must be above -1 "
                             f"and below 0.5.")

    @classmethod
    def named(cls, name: str) -> "Material":
        """'steel' or 'aluminium' with handbook values; InputError for other names."""
        require_kind("Material.named", str, name=name)
        if name not in _MATERIALS:
            raise InputError(f"There is no material '{name}'"
                             f"{nearest(str(name), _MATERIALS)}; named materials are "
                             f"{choices(_MATERIALS)}, or give youngs_modulus, poisson_ratio and "
                             f"density.")
        return cls(*_MATERIALS[name])


_MATERIALS = {"steel": (2.1e11, 0.3, 7850.0), "aluminium": (7.0e10, 0.33, 2700.0)}


@dataclass(frozen=True, eq=False, repr=False)
class ElasticBody(Summarised):
    """A plane linear elastic body of quadratic (or linear) finite elements.

    Displacement nodes are the mesh nodes, then the mid-points of the edges, then the centres of the
    quadrilaterals; degree of freedom 2 k is the displacement of node k in x, 2 k + 1 that in y.

    Parameters
    ----------
    mesh : Mesh
        Straight-sided triangles or quadrilaterals.
    material : Material
    thickness : float
        Out-of-plane thickness, positive [m].
    plane : 'stress' or 'strain'
    degree : 2 or 1
        Quadratic (P2, Q2) or linear (P1, Q1) displacements.
    fixed : mapping of name to 'x', 'y', 'xy' or 'hinge'
        Supports on named boundaries or points of the mesh: displacements fixed at zero, or a
        hinge, whose nodes (such as the boundary of a hole) rotate rigidly about their centre.

    Raises
    ------
    InputError
        For values out of range.
    MeshError
        For names that the mesh does not have, or a mesh in several pieces.
    """

    mesh: Mesh
    material: Material = field(default_factory=Material)
    thickness: float = 1.0
    plane: Literal["stress", "strain"] = "stress"
    degree: int = 2
    fixed: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_kind("ElasticBody", Mesh, mesh=self.mesh)
        require_kind("ElasticBody", Material, material=self.material)
        require_kind("ElasticBody", Mapping, fixed=self.fixed)
        for name, directions in self.fixed.items():
            require_kind("ElasticBody: fixed", str, name=name, directions=directions)
        require_positive("ElasticBody", thickness=self.thickness)
        if self.plane not in ("stress", "strain"):
            raise InputError(f"ElasticBody: plane = {self.plane!r} must be 'stress' or 'strain'.")
        if self.degree not in (1, 2) or type(self.degree) is not int:
            raise InputError(f"ElasticBody: degree = {self.degree!r} must be 1 or 2.")
        corners, degree = self.mesh.cells.shape[1], int(self.degree)
        require_memory("ElasticBody: the number of cells", len(self.mesh.cells),
                       _UNKNOWNS[corners, degree] * _BYTES[corners],
                       ", by a larger element_size, or triangles or degree = 1")
        check_supports(self.mesh, self.fixed)
        pieces = _pieces(self.mesh)
        if pieces > 1:
            raise MeshError(f"The mesh consists of {pieces} pieces that share no node; a body must "
                            f"be connected.")

    def summary(self) -> list[tuple[str, str]]:
        """Mesh, material, kind of elements and supports."""
        kind = "triangles" if self.mesh.cells.shape[1] == 3 else "quadrilaterals"
        x, y = self.mesh.nodes.T
        material = self.material
        return [
            ("mesh", f"{len(self.mesh.cells)} {kind}, {len(self.mesh.nodes)} nodes, degree "
             f"{self.degree}"),
            ("x", span(x, "m")), ("y", span(y, "m")),
            ("thickness", f"{self.thickness:.4g} m, plane {self.plane}"),
            ("material", f"{quantity(material.youngs_modulus, 'Pa')}, Poisson ratio "
             f"{material.poisson_ratio:.4g}, {material.density:.4g} kg/m³"),
            ("fixed", listed([f"{name} in {way}" for name, way in self.fixed.items()])),
        ]

    @cached_property
    def basis(self) -> Any:
        """Scalar scikit-fem basis of one displacement component."""
        import skfem

        kind = skfem.MeshTri1 if self.mesh.cells.shape[1] == 3 else skfem.MeshQuad1
        elements = {(3, 1): skfem.ElementTriP1, (3, 2): skfem.ElementTriP2,
                    (4, 1): skfem.ElementQuad1, (4, 2): skfem.ElementQuad2}
        element = elements[self.mesh.cells.shape[1], self.degree]()
        # Fourth order is exact for the mass of straight-sided triangles and parallelograms.
        return skfem.Basis(kind(self.mesh.nodes.T.copy(), self.mesh.cells.T.copy()), element,
                           intorder=4)

    @cached_property
    def nodes(self) -> Array:
        """Reference places (N, 2) of the displacement nodes [m]."""
        return np.ascontiguousarray(self.basis.doflocs.T)

    @cached_property
    def stiffness(self) -> Any:
        """Stiffness K, sparse (2 N, 2 N), without supports [N/m]."""
        import scipy.sparse as sp
        from skfem import BilinearForm

        # Three scalar forms of 9 x 9 pairs are much faster than one vector form of 18 x 18 pairs,
        # most of whose products are zero.
        gradients = [
            BilinearForm(lambda u, v, w, a=a, b=b: v.grad[a] * u.grad[b]).assemble(self.basis)
            for a, b in ((0, 0), (1, 1), (0, 1))
        ]
        xx, yy, xy = (matrix.tocsr() for matrix in gradients)
        direct, lateral, shear = self.elasticity
        blocks = [[direct * xx + shear * yy, lateral * xy + shear * xy.T],
                  [lateral * xy.T + shear * xy, direct * yy + shear * xx]]
        K = sum(sp.kron(blocks[i][j], sp.csr_array(([1.0], ([i], [j])), shape=(2, 2)))
                for i in range(2) for j in range(2))
        return sp.csc_array(0.5 * self.thickness * (K + K.T))

    @cached_property
    def component_mass(self) -> Any:
        """Mass of one displacement component, sparse (N, N) by rows, without supports [kg]."""
        import scipy.sparse as sp
        from skfem import BilinearForm

        scalar = BilinearForm(lambda u, v, w: u * v).assemble(self.basis)
        return sp.csr_array(0.5 * self.material.density * self.thickness * (scalar + scalar.T))

    @cached_property
    def mass(self) -> Any:
        """Mass M, sparse (2 N, 2 N), without supports [kg]."""
        import scipy.sparse as sp

        return sp.csc_array(sp.kron(self.component_mass, sp.eye_array(2)))

    @cached_property
    def gradients(self) -> tuple[Any, Any]:
        """Derivatives in x and y at the nodes, sparse (N, N): means of the adjacent elements."""
        return _nodal_gradients(self.basis)

    @property
    def elasticity(self) -> tuple[float, float, float]:
        """Plane elastic constants [Pa]: s_xx = first e_xx + second e_yy, s_xy = third g_xy."""
        E, nu = self.material.youngs_modulus, self.material.poisson_ratio
        shear = E / (2.0 * (1.0 + nu))
        if self.plane == "stress":
            return E / (1.0 - nu**2), nu * E / (1.0 - nu**2), shear
        lateral = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        return lateral + 2.0 * shear, lateral, shear

    @cached_property
    def fixed_dofs(self) -> Integers:
        """Degrees of freedom fixed at zero by the supports, ascending."""
        return fixed_dofs(self.fixed, self._supported)

    @cached_property
    def expansion(self) -> Any:
        """All degrees of freedom from the free ones, sparse (2 N, f); see the supports."""
        return expansion(self.nodes, self.fixed_dofs, self.hinges)

    @cached_property
    def hinges(self) -> list[tuple[Integers, Array]]:
        """Nodes and centre (2,) [m] of each boundary that rotates rigidly about its centre."""
        return hinges(self.mesh, self.nodes, self.fixed, self._supported)

    @cached_property
    def _supported(self) -> dict[str, Integers]:
        # A group may be both points and a boundary; only the boundary has mid-side nodes.
        boundaries, points = self.mesh.boundaries, self.mesh.points
        return {name: np.unique(self.edge_nodes(boundaries[name])) if name in boundaries
                else np.asarray(points[name]) for name in self.fixed}

    def edge_nodes(self, edges: Integers) -> Integers:
        """Displacement nodes (k, degree + 1) of mesh edges (k, 2): start, (middle,) end."""
        if self.degree == 1:
            return np.asarray(edges)
        facets = self.basis.mesh.facets.T
        size = len(self.mesh.nodes)
        order = np.argsort(facets[:, 0] * size + facets[:, 1])
        keys = (facets[:, 0] * size + facets[:, 1])[order]
        ends = np.sort(edges, axis=1)
        middle = size + order[np.searchsorted(keys, ends[:, 0] * size + ends[:, 1])]
        return np.column_stack([edges[:, 0], middle, edges[:, 1]])


def _pieces(mesh: Mesh) -> int:
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    first = np.repeat(mesh.cells[:, :1], mesh.cells.shape[1] - 1, axis=1).ravel()
    graph = sp.coo_array((np.ones(first.size), (first, mesh.cells[:, 1:].ravel())),
                         shape=(len(mesh.nodes),) * 2)
    return int(connected_components(graph, directed=False, return_labels=False))


def _nodal_gradients(basis: Any) -> tuple[Any, Any]:
    """Derivatives in x and y at the nodes, sparse (N, N).

    Each is the area-weighted mean of the gradients of the adjacent elements at the node.
    """
    import scipy.sparse as sp

    local = basis.elem.doflocs.T
    dofs = basis.element_dofs.T
    area = basis.dx.sum(axis=1)
    count, size = basis.doflocs.shape[1], dofs.shape[1]
    slopes = np.stack([basis.elem.gbasis(basis.mapping, local, i)[0].grad for i in range(size)])
    # slopes: (function, direction, element, node)
    slopes = np.moveaxis(slopes, (0, 1, 2, 3), (3, 0, 1, 2)) * area[None, :, None, None]
    row = np.broadcast_to(dofs[:, :, None], slopes.shape[1:]).ravel()
    column = np.broadcast_to(dofs[:, None, :], slopes.shape[1:]).ravel()
    around = np.bincount(dofs.ravel(), np.repeat(area, size), minlength=count)
    dx, dy = (
        sp.csr_array(sp.coo_array((slope.ravel() / around[row], (row, column)),
                                  shape=(count, count)))
        for slope in slopes
    )
    return dx, dy
