"""The elastic body: mesh, material and supports as stiffness and mass."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import (
    InputError,
    MeshError,
    choices,
    nearest,
    require_choice,
    require_positive,
)
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, listed, span
from fecontact.fem.attachments import (
    Attachment,
    PointMass,
    PointSpring,
    added_mass,
    check_attachments,
    counted_attachments,
    spring_rows,
)
from fecontact.fem.constraints import (
    Constraint,
    LinearEquation,
    check_constraints,
    counted,
    reference_points,
)
from fecontact.fem.element_block import ElementBlock
from fecontact.fem.elements.cell_geometry import centres_of
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    HEXAHEDRON,
    blocks_of,
    edges_around,
    padded,
    row_numbers,
)
from fecontact.fem.elements.quadrature import Integration, rule_of, stiffness_rule
from fecontact.fem.elimination import Elimination, eliminated
from fecontact.fem.equations import Unknowns
from fecontact.fem.incompatible_modes import reductions
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial, Material
from fecontact.fem.mean_strain import stiffness as mean_strain_stiffness
from fecontact.fem.mesh import Bricks, Mesh, check_integration
from fecontact.fem.reference_motions import displacement_rows, reference_motions
from fecontact.fem.supports import HingeSupport, check_supports, fixed_dofs, hinges

_MATERIALS = (Material, AnisotropicMaterial)
# Memory per unknown for modes [bytes], by dimension and number of corners.
_BYTES = {(2, 3): 7e3, (2, 4): 9.5e3, (3, 4): 7.5e3, (3, 5): 9e3, (3, 6): 1e4, (3, 8): 1.2e4}


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ElasticBody(Summarised):
    """A linear elastic body, plane or solid, of quadratic (or linear) finite elements.

    Displacement nodes are the mesh nodes, then the middles of the edges, then, of elements that are
    not serendipity ones, those of four-sided faces of solids, then the centres of quadrilaterals
    and hexahedra; the degrees of freedom d k, d k + 1, ... are the displacements of node k in x, y,
    ..., d = 2 or 3 being the dimension. Quadratic elements follow curved edges of the mesh
    (isoparametric); linear ones are straight.

    Parameters
    ----------
    mesh : Mesh
        Triangles or quadrilaterals; for a solid tetrahedra, pyramids, wedges or hexahedra.
    material : Material, AnisotropicMaterial or mapping of name to material, optional
        One material, or that of each group of cells of the mesh, which together hold each cell
        once; by default those of the mesh, or steel if it has none.
    thickness : float
        Out-of-plane thickness of a plane body, positive [m].
    plane : 'stress' or 'strain'
        Plane stress or plane strain; solids have neither thickness nor plane.
    degree : 2 or 1
        Quadratic (P2, Q2) or linear (P1, Q1) displacements.
    fixed : mapping of name to 'x', 'y', 'xy', of solids also 'z', 'xz', 'yz', 'xyz', or a hinge
        Supports on named boundaries or points of the mesh: displacements fixed at zero, or a
        hinge, whose nodes (such as the boundary of a hole) rotate rigidly about their centre. In
        space 'hinge_x', 'hinge_y', 'hinge_z' name the axis; 'hinge' takes that of a round face.
        On reference points also 'clamped', or components such as 'x phi_z'; see
        :func:`fecontact.fem.supports.held_components`.
    constraints : sequence of LinearEquation, Tie or Coupling, optional
        Linear equations between displacements, see :mod:`fecontact.fem.constraints`; by default
        those of the mesh, which a file may hold.
    bricks : 'full', 'incompatible' or 'serendipity', optional
        Kind of quadrilaterals, hexahedra, wedges and pyramids; by default that of the mesh.
        ``'incompatible'`` lets hexahedra with ``degree = 1`` bend without locking, see
        :mod:`fecontact.fem.incompatible_modes`. ``'serendipity'`` with ``degree = 2`` are elements
        of 8, 20, 15 and 13 nodes, without those in the middles of faces and cells.
    integration : 'exact', 'full', 'reduced' or mapping of name to these, optional
        Points of quadrature of the stiffness, see :mod:`fecontact.fem.elements.quadrature`; by
        default those of the mesh. ``'full'`` and ``'reduced'`` are those of the elements of Abaqus,
        CalculiX and Ansys. Reduced elements of degree 1 have a mean strain and hourglass stiffness,
        see :mod:`fecontact.fem.mean_strain`. A mapping gives the rule of groups of cells; others
        are integrated fully.
    attachments : sequence of PointMass or PointSpring, optional
        Masses, springs and dashpots at points, see :mod:`fecontact.fem.attachments`; by default
        those of the mesh, which a file may hold.
    hourglass : float
        Stiffness of hourglasses over the shear modulus, above zero, see
        :mod:`fecontact.fem.mean_strain`.

    Raises
    ------
    InputError
        For values out of range.
    MeshError
        For names that the mesh does not have, or a mesh in pieces that no constraint joins.
    """

    mesh: Mesh
    material: AnyMaterial | Mapping[str, AnyMaterial] | None = None
    thickness: float = 1.0
    plane: Literal["stress", "strain"] = "stress"
    degree: int = 2
    fixed: Mapping[str, str] = field(default_factory=dict)
    constraints: Sequence[Constraint] | None = None
    bricks: Bricks | None = None
    integration: Integration | Mapping[str, Integration] | None = None
    attachments: Sequence[Attachment] | None = None
    hourglass: float = 0.005

    def __post_init__(self) -> None:
        require_kind("ElasticBody", Mesh, mesh=self.mesh)
        if self.material is None:
            object.__setattr__(self, "material", self.mesh.materials or Material())
        require_kind("ElasticBody", (*_MATERIALS, Mapping), material=self.material)
        require_kind("ElasticBody", Mapping, fixed=self.fixed)
        for name, directions in self.fixed.items():
            require_kind("ElasticBody: fixed", str, name=name, directions=directions)
        require_positive("ElasticBody", thickness=self.thickness, hourglass=self.hourglass)
        if self.plane not in ("stress", "strain"):
            raise InputError(f"ElasticBody: plane = {self.plane!r} must be 'stress' or 'strain'.")
        if self.degree not in (1, 2) or type(self.degree) is not int:
            raise InputError(f"ElasticBody: degree = {self.degree!r} must be 1 or 2.")
        if self.dimension == 3 and (self.thickness, self.plane) != (1.0, "stress"):
            raise InputError("ElasticBody: thickness and plane are those of plane bodies; leave "
                             "them out for a solid.")
        if self.bricks is None:
            object.__setattr__(self, "bricks", self.mesh.bricks)
        require_choice("ElasticBody", "bricks", self.bricks, get_args(Bricks))
        if self.integration is None:
            object.__setattr__(self, "integration", self.mesh.integration)
        check_integration("ElasticBody", self.integration, self.mesh.cell_groups)
        _ = self.anisotropic
        if self.constraints is not None:
            require_kind("ElasticBody", Sequence, constraints=self.constraints)
            check_constraints(self.constraints, self.mesh.boundaries, self.mesh.points,
                              self.dimension, len(self.mesh.nodes))
        if self.attachments is not None:
            require_kind("ElasticBody", Sequence, attachments=self.attachments)
        check_attachments(self.added, self.equations, self.mesh.points, self.dimension,
                          len(self.mesh.nodes))
        check_supports(self.mesh, self.fixed, self.references)
        pieces = self._joined_pieces()
        if pieces > 1:
            raise MeshError(f"The mesh consists of {pieces} pieces that share no node, and no "
                            f"constraint joins them; a body must be connected.")

    def summary(self) -> list[tuple[str, str]]:
        """Mesh, material, kind of elements and supports."""
        mesh, of = self.mesh, self.material
        named = of.items() if isinstance(of, Mapping) else [("", one) for one in self.materials]
        curved = f", {len(mesh.curved_cells)} curved" if len(mesh.curved_cells) else ""
        return [
            ("mesh", f"{mesh.cells_in_words}{curved}, {len(mesh.nodes)} nodes, degree "
             f"{self.degree}{', incompatible modes' if self.has_incompatible_modes else ''}"
             f"{', serendipity' if self.serendipity else ''}{self._integration_in_words}"),
            *((axis, span(values, "m")) for axis, values in zip("xyz", mesh.nodes.T, strict=False)),
            ("thickness", f"{self.thickness:.4g} m, plane {self.plane}") if self.dimension == 2
            else ("volume", f"{mesh.volume:.4g} m³"),
            *((f"material {name}".rstrip(), material.description) for name, material in named),
            ("fixed", listed([f"{name} in {way}" for name, way in self.fixed.items()])),
            *([("constraints", counted(self.equations))] if self.equations else []),
            *([("attachments", counted_attachments(self.added))] if self.added else []),
        ]

    @property
    def _integration_in_words(self) -> str:
        some = len(set(self._integrations.tolist())) > 1
        return f", reduced integration{' of some' * some}" * (
            "reduced" in self._integrations)

    @property
    def has_incompatible_modes(self) -> bool:
        """True if some bricks of eight nodes have incompatible modes."""
        return any(block.incompatible for block in self.blocks)

    @property
    def has_reduced_integration(self) -> bool:
        """True if some elements of degree 2 have fewer points than full integration has."""
        return self.degree == 2 and "reduced" in self._integrations

    @property
    def has_mean_strain(self) -> bool:
        """True if some elements of degree 1 have a mean strain and hourglass stiffness."""
        return any(block.has_mean_strain for block in self.blocks)

    @property
    def serendipity(self) -> bool:
        """True for quadratic elements without nodes in the middles of faces and cells."""
        return self.degree == 2 and self.bricks == "serendipity"

    @property
    def dimension(self) -> int:
        """2 for a plane body, 3 for a solid."""
        return self.mesh.dimension

    @property
    def unknowns(self) -> int:
        """Number of degrees of freedom without supports, d times that of displacement nodes."""
        return self.dimension * len(self.nodes)

    @property
    def curved(self) -> bool:
        """Whether the elements follow curved edges of the mesh."""
        return self.degree == 2 and len(self.mesh.curved_edges) > 0

    @cached_property
    def total_mass(self) -> float:
        """Mass of the body with the edges of its mesh, and of point masses [kg]."""
        added = sum(one.mass for one in self.added if isinstance(one, PointMass))
        if len(self.materials) == 1:
            size = self.mesh.area * self.thickness if self.dimension == 2 else self.mesh.volume
            return float(size * self.materials[0].density) + added
        return float(self.component_mass.sum()) + added

    @property
    def materials(self) -> tuple[AnyMaterial, ...]:
        """The materials, in the order in which they are given."""
        assert self.material is not None
        return tuple(self.material.values()) if isinstance(self.material, Mapping) else (
            self.material,)

    @cached_property
    def cell_materials(self) -> Integers:
        """Number (M,) of the material of each cell."""
        if not isinstance(self.material, Mapping):
            return np.zeros(len(self.mesh.cells), np.int64)
        groups = self.mesh.cell_groups
        found = np.full(len(self.mesh.cells), -1)
        for number, (name, one) in enumerate(self.material.items()):
            require_kind("ElasticBody: material", str, name=name)
            require_kind("ElasticBody: material", _MATERIALS, **{name: one})
            if name not in groups:
                raise MeshError(f"ElasticBody: material names '{name}', which is no group of cells "
                                f"of the mesh{nearest(name, groups)}; its groups of cells are: "
                                f"{choices(groups)}.")
            if (found[groups[name]] >= 0).any():
                earlier = list(self.material)[int(found[groups[name]].max())]
                raise InputError(f"ElasticBody: material gives cells of '{name}' a second one, "
                                 f"beside that of '{earlier}'; give groups that share no cell.")
            found[groups[name]] = number
        if (found < 0).any():
            first = np.flatnonzero(found < 0)[0]
            where = ", ".join(f"{x:g}" for x in centres_of(self.mesh.nodes, self.mesh.cells)[first])
            raise InputError(f"ElasticBody: material leaves {np.count_nonzero(found < 0)} of "
                             f"{len(found)} cells without a material, the first at ({where}); give "
                             f"the groups of these cells too.")
        return found

    @cached_property
    def blocks(self) -> tuple[ElementBlock, ...]:
        """Elements of each kind, with their rule of quadrature."""
        found = []
        for number, block in enumerate(self.mesh.blocks):
            kind, own = block.kind, self._integrations[block.numbers]
            members = (block.ordered if self.degree == 1 else self.mesh._second_order.members[
                number][:, : kind.count(2, self.serendipity)])
            count = members.shape[1]
            for integration in get_args(Integration):
                rows = np.flatnonzero(own == integration)
                if len(rows):
                    found.append(ElementBlock(
                        kind, block.numbers[rows], np.ascontiguousarray(members[rows]), self.nodes,
                        count if self.curved else kind.corners,
                        *stiffness_rule(kind, count, self.curved, integration),
                        rule_of(kind, self.degree, self.curved),
                        self.bricks == "incompatible" and integration != "reduced"
                        and (kind, self.degree) == (HEXAHEDRON, 1)))
        return tuple(found)

    @property
    def _integrations(self) -> NDArray[np.str_]:
        """Rule (M,) of each cell, by its name."""
        given = self.integration
        if not isinstance(given, Mapping):
            return np.full(len(self.mesh.cells), given)
        found = np.full(len(self.mesh.cells), "full", dtype="<U8")
        for name, integration in given.items():
            found[self.mesh.cell_groups[name]] = integration
        return found

    def parts(self, cells: Integers | None = None) -> Iterator[ElementBlock]:
        """Elements of all or the given cells, in parts of one kind whose matrices fit in memory."""
        for block in self.blocks:
            chosen = block if cells is None else block.only(np.isin(block.numbers, cells))
            yield from chosen.parts()

    @cached_property
    def elements(self) -> Integers:
        """Displacement nodes (M, k) of each element, in the order of ``CellKind.places``.

        Rows of elements with fewer nodes than others are filled by their last one.
        """
        width = max(block.nodes.shape[1] for block in self.blocks)
        found = np.empty((len(self.mesh.cells), width), np.int64)
        for block in self.blocks:
            found[block.numbers] = padded([block.nodes], width)
        return found

    @cached_property
    def nodes(self) -> Array:
        """Reference places (N, d) of the displacement nodes [m]."""
        if self.degree == 1:
            return self.mesh.nodes
        places, mesh = self.mesh._second_order.places, self.mesh
        return places[: len(mesh.nodes) + len(mesh.edges[0])] if self.serendipity else places

    @cached_property
    def stiffness(self) -> Any:
        """Stiffness K of elements and springs, sparse (d N, d N), without supports [N/m]."""
        import scipy.sparse as sp

        rows, k, _ = self.springs
        if not k.any():
            return self._element_stiffness
        return sp.csc_array(self._element_stiffness + rows.T @ sp.diags_array(k) @ rows)

    @property
    def _element_stiffness(self) -> Any:
        import scipy.sparse as sp

        if self.dimension == 2:
            return sp.csc_array(self.thickness * self._assembled[0])
        rows = self.stiffness_blocks.tocsr()
        return sp.csc_array((rows.data, rows.indices, rows.indptr), shape=rows.shape)

    @property
    def stiffness_blocks(self) -> Any:
        """Stiffness of the elements of a solid, sparse (3 N, 3 N) of 3 x 3 blocks [N/m]."""
        return self._assembled[0]

    @cached_property
    def _assembled(self) -> tuple[Any, Any]:
        """Stiffness and mass of one component of a solid, or of a plane body 1 m thick.

        InputError if modes would not fit into memory.
        """
        from fecontact.fem.assembly import assembled, subtract

        plain, count = "triangles" if self.dimension == 2 else "tetrahedra", len(self.mesh.cells)
        needed = sum(len(block.nodes) * block.kind.unknowns(int(self.degree), self.serendipity)
                     * _BYTES[self.dimension, block.kind.corners] for block in self.mesh.blocks)
        require_memory("ElasticBody: the number of cells", count, needed / count,
                       f", by a larger element_size, or {plain} or degree = 1")
        _, lateral, shear = self.elasticity.T
        K, M = assembled(self.blocks, lateral, shear, self.densities, self.anisotropic)
        for block in self.blocks:
            for part in block.parts() if block.incompatible or block.has_mean_strain else ():
                if part.incompatible:
                    lower = reductions(self, part)
                    subtract(K, part.nodes, np.swapaxes(lower, 1, 2) @ lower)
                else:
                    subtract(K, part.nodes, -mean_strain_stiffness(self, part))
        return K, M

    @cached_property
    def component_mass(self) -> Any:
        """Mass of one displacement component in the elements, sparse (N, N) by rows [kg]."""
        import scipy.sparse as sp

        M = self._assembled[1]
        return M if self.dimension == 3 else sp.csr_array(self.thickness * M)

    @cached_property
    def mass(self) -> Any:
        """Mass M of elements and point masses, sparse (d N, d N), without supports [kg]."""
        import scipy.sparse as sp

        M = sp.kron(self.component_mass, sp.eye_array(self.dimension))
        return sp.csc_array(M + added_mass(self) if self.added else M)

    @cached_property
    def gradients(self) -> tuple[Any, ...]:
        """Derivatives in x, y (, z) at the nodes, sparse (N, N): means of the adjacent elements."""
        return _nodal_gradients(self.blocks)

    @cached_property
    def material_gradients(self) -> list[tuple[Array, tuple[Any, ...]]]:
        """Elastic constants (3,) of each isotropic material, and its part of ``gradients``."""
        if self.is_uniform:
            return [(self.elasticity[0], self.gradients)]
        return [(_elasticity(one, self.dimension, self.plane),
                 _nodal_gradients(self.blocks, self.cell_materials == number))
                for number, one in enumerate(self.materials) if isinstance(one, Material)]

    @property
    def is_uniform(self) -> bool:
        """True if the body has one material, which is isotropic."""
        return len(self.materials) == 1 and isinstance(self.materials[0], Material)

    @cached_property
    def anisotropic(self) -> tuple[Array, Integers]:
        """Stiffnesses (n, 6, 6) of anisotropic materials [Pa], and the number (M,) of each cell's.

        Components are xx, yy, zz, xy, yz, xz; see
        :meth:`fecontact.fem.AnisotropicMaterial.stiffness_at`. Isotropic cells have the number -1.
        """
        materials, number = self.cell_materials, np.full(len(self.mesh.cells), -1)
        tensors = [np.empty((0, 6, 6))]
        count = 0
        for which, one in enumerate(self.materials):
            if isinstance(one, Material):
                continue
            cells = np.flatnonzero(materials == which)
            found = one.stiffness_at(self.cell_centres(cells), self.dimension, self.plane)
            number[cells] = count + (np.arange(len(cells)) if len(found) > 1 else 0)
            tensors.append(found)
            count += len(found)
        return np.concatenate(tensors), number

    def cell_centres(self, cells: Integers) -> Array:
        """Mean places (n, 3) of the corners of cells [m]; z is zero in a plane body."""
        centres = np.zeros((len(cells), 3))
        centres[:, : self.dimension] = centres_of(self.mesh.nodes, self.mesh.cells[cells])
        return centres

    @cached_property
    def shear_moduli(self) -> Array:
        """Least stiffness (M,) of each cell of a solid against shear along two axes [Pa]."""
        tensors, number = self.anisotropic
        least = np.append(tensors[:, [3, 4, 5], [3, 4, 5]].min(axis=1), 0.0)
        return np.where(number < 0, self.elasticity[:, 2], least[number])

    @property
    def elasticity(self) -> Array:
        """Elastic constants (M, 3) of each cell [Pa].

        s_xx = first e_xx + second (e_yy + e_zz), s_xy = third g_xy. Those of a plane body hold
        without e_zz. Zero for anisotropic materials, see ``anisotropic``.
        """
        constants = [_elasticity(one, self.dimension, self.plane) for one in self.materials]
        return np.array(constants)[self.cell_materials]

    def cell_stiffness(self, cells: Any = slice(None)) -> Array:
        """Stiffness (n, 6, 6) of cells for xx, yy, zz, xy, yz, xz [Pa].

        In a plane body rows and columns of zz, yz and xz have no meaning.
        """
        (direct, lateral, shear), (tensors, number) = self.elasticity[cells].T, self.anisotropic
        number, axes = number[cells], np.arange(3)
        found = np.zeros((len(number), 6, 6))
        found[:, :3, :3] = lateral[:, None, None]
        found[:, axes, axes], found[:, 3 + axes, 3 + axes] = direct[:, None], shear[:, None]
        found[number >= 0] = tensors[number[number >= 0]]
        return found

    @property
    def densities(self) -> Array:
        """Density (M,) of each cell [kg/m^3]."""
        return np.array([one.density for one in self.materials])[self.cell_materials]

    @cached_property
    def fixed_dofs(self) -> Integers:
        """Degrees of freedom fixed at zero by the supports, ascending."""
        return fixed_dofs(self.dimension, self.fixed, self._supported)

    @property
    def equations(self) -> Sequence[Constraint]:
        """Constraints between displacements beside the supports."""
        return self.mesh.constraints if self.constraints is None else self.constraints

    @cached_property
    def expansion(self) -> Any:
        """All degrees of freedom from the free ones, sparse (d N, f).

        Supports and constraints are eliminated; see
        :attr:`fecontact.fem.Elimination.expansion`.
        """
        return self.elimination.expansion

    @cached_property
    def elimination(self) -> Elimination:
        """Supports and constraints, substituted into each other."""
        return eliminated(Unknowns(self))

    @property
    def added(self) -> Sequence[Attachment]:
        """Masses and springs at points."""
        return self.mesh.attachments if self.attachments is None else self.attachments

    @cached_property
    def springs(self) -> tuple[Any, Array, Array]:
        """Rows (k, d N) of elongations of the springs at points, their stiffness and damping."""
        return spring_rows(self)

    @cached_property
    def references(self) -> tuple[str, ...]:
        """Names of the reference points of constraints."""
        return reference_points(self.equations, self.mesh.points)

    @cached_property
    def _reference_motions(self) -> dict[str, Any]:
        return reference_motions(self)

    def motion_rows(self, at: str | int | tuple[int, int]) -> Any:
        """Rows, sparse (3, 2 N) or (6, 3 N), of displacement and rotation of a point.

        ``at`` is that of a :class:`~fecontact.fem.Term`. Nodes have no rotation: their rows of it
        are zero. Those of reference points hold for displacements that meet all constraints.
        """
        if isinstance(at, str) and at in self.references:
            return self._reference_motions[at]
        node = int(self.mesh.points[at][0]) if isinstance(at, str) else at
        return displacement_rows(self, node)

    @cached_property
    def hinges(self) -> list[HingeSupport]:
        """Nodes, centre and axis of each boundary that rotates rigidly."""
        return hinges(self.mesh, self.nodes, self.fixed, self._supported)

    @cached_property
    def _supported(self) -> dict[str, Integers]:
        return {name: self.group_nodes(name) for name in self.fixed if name not in self.references}

    def group_nodes(self, name: str) -> Integers:
        """Displacement nodes (k,) of a boundary, or else of points of the mesh."""
        # A group may be both points and a boundary; only the boundary has mid-side nodes.
        boundaries, points = self.mesh.boundaries, self.mesh.points
        return (np.unique(self.facet_nodes(boundaries[name])) if name in boundaries
                else self._along(np.asarray(points[name])))

    def _along(self, points: Integers) -> Integers:
        """Nodes of a solid's points, with the middles of edges of the outline between them.

        Points that hold such edges are lines, such as the edge of a face.
        """
        if self.dimension == 2 or self.degree == 1 or len(points) < 2:
            return points
        ends, _ = edges_around(self.mesh.outline)
        ends = np.unique(ends[np.isin(ends, points).all(axis=1)], axis=0)
        return np.unique(np.concatenate([points, self.edge_nodes(ends)[:, 1]]))

    @cached_property
    def pieces(self) -> tuple[int, Integers]:
        """Number of pieces that share no node, and the piece (N,) of each displacement node."""
        count, piece = self.mesh.pieces
        found = np.empty(len(self.nodes), np.int64)
        found[self.elements] = piece[self.mesh.cells[:, :1]]
        return count, found

    def _joined_pieces(self) -> int:
        """Number of pieces of the mesh that neither nodes nor constraints join."""
        import scipy.sparse as sp
        from scipy.sparse.csgraph import connected_components

        mesh = self.mesh
        pieces, piece = mesh.pieces
        if pieces == 1 or not (self.equations or self.added):
            return pieces
        groups: dict[Any, int] = {}
        links = []
        for number, one in enumerate((*self.equations, *self.added)):
            own = [term.at for term in one.terms] if isinstance(
                one, LinearEquation | PointSpring) else one.groups
            for name in own:
                held = mesh.boundaries.get(name, mesh.points.get(name)) if isinstance(
                    name, str) else np.array(name)
                hub = groups.setdefault(number, len(groups))
                links += [(pieces + hub, int(at)) for at in np.unique(piece[held])] if (
                    held is not None) else [
                        (pieces + hub, pieces + groups.setdefault(name, len(groups)))]
        rows, columns = np.array(links).T
        graph = sp.coo_array((np.ones(len(links)), (rows, columns)),
                             shape=(pieces + len(groups),) * 2)
        return int(connected_components(graph, directed=False, return_labels=False))

    def facet_nodes(self, facets: Integers) -> Integers:
        """Displacement nodes (k, n) of mesh edges (k, 2) or of faces (k, 3) or (k, 4).

        Edges: start, (middle,) end. Faces: corners, then of quadratic elements the middles between
        successive corners, then the centre of four-sided ones: 3 or 6 of triangles, 4, 9 or, of
        serendipity elements, 8 of quadrilaterals; rows of triangles beside quadrilaterals are
        filled by their last node.
        """
        if self.dimension == 2 or self.degree == 1:
            return self.edge_nodes(facets) if self.dimension == 2 else np.asarray(facets)
        kind = CELL_KINDS[2, facets.shape[1]]
        found = np.empty((len(facets), kind.count(2, self.serendipity)), np.int64)
        for which, some in blocks_of(facets):
            count = some.shape[1]
            parts = [some, *(self.edge_nodes(some[:, [i, (i + 1) % count]])[:, 1:2]
                             for i in range(count))]
            if count == 4 and not self.serendipity:
                first = len(self.mesh.nodes) + len(self.mesh.edges[0])
                faces = self.mesh._second_order.faces
                parts.append(first + row_numbers(faces, np.sort(some, axis=1))[:, None])
            found[which] = padded([np.concatenate(parts, axis=1)], found.shape[1])
        return found

    def edge_nodes(self, edges: Integers) -> Integers:
        """Displacement nodes (k, degree + 1) of mesh edges (k, 2): start, (middle,) end."""
        if self.degree == 1:
            return np.asarray(edges)
        size, known = len(self.mesh.nodes), self.mesh.edges[0]
        ends = np.sort(edges, axis=1)
        middle = size + np.searchsorted(known[:, 0] * size + known[:, 1],
                                        ends[:, 0] * size + ends[:, 1])
        return np.column_stack([edges[:, 0], middle, edges[:, 1]])


def _elasticity(material: AnyMaterial, dimension: int, plane: str) -> Array:
    if not isinstance(material, Material):
        return np.zeros(3)
    E, nu = material.youngs_modulus, material.poisson_ratio
    shear = E / (2.0 * (1.0 + nu))
    if dimension == 2 and plane == "stress":
        return np.array([E / (1.0 - nu**2), nu * E / (1.0 - nu**2), shear])
    lateral = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return np.array([lateral + 2.0 * shear, lateral, shear])


def _nodal_gradients(blocks: Sequence[ElementBlock], chosen: Any = None) -> tuple[Any, ...]:
    """Derivatives in x, y (, z) at the nodes, sparse (N, N).

    Each is the volume-weighted mean of the gradients of the adjacent elements at the node, to which
    those that are not ``chosen`` (M,) add nothing.
    """
    import scipy.sparse as sp

    count, d = blocks[0].places.shape
    around = np.zeros(count)
    slopes, rows, columns = [], [], []
    for block in blocks:
        nodes, volumes = block.nodes, block.volumes
        size = nodes.shape[1]
        around += np.bincount(nodes.ravel(), np.repeat(volumes, size), minlength=count)
        own = volumes if chosen is None else volumes * chosen[block.numbers]
        gradients = block.nodal_gradients() * own[:, None, None, None]
        slopes.append(gradients.reshape(-1, d))
        rows.append(np.repeat(nodes, size, axis=1).ravel())
        columns.append(np.tile(nodes, size).ravel())
    row, column, slope = (np.concatenate(one) for one in (rows, columns, slopes))
    return tuple(sp.csr_array(sp.coo_array((one / around[row], (row, column)),
                                           shape=(count, count))) for one in slope.T)
