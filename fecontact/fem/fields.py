"""Displacement and stress over a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from fecontact.core.checks import as_place
from fecontact.core.errors import InputError, require_choice
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, quantity, span
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.element_block import PAIRS
from fecontact.fem.elements.cell_geometry import oriented, sides_of
from fecontact.fem.elements.cell_kinds import (
    blocks_of,
    numbered_rows,
    padded,
    shape_functions,
    unordered,
)
from fecontact.fem.elements.refinement import PARTS
from fecontact.fem.elements.serendipity_parts import serendipity_parts
from fecontact.fem.faces.surface import drawn_facets
from fecontact.fem.incompatible_modes import mode_gradients
from fecontact.fem.interpolation import element_kind, interpolation
from fecontact.fem.material import Material
from fecontact.fem.material_axes import stress_rotation
from fecontact.fem.von_mises import von_mises_of

StressAxes = Literal["global", "material"]

# Values of strains that are computed at once, and the entry of a rotation above which an axis is
# not normal to a plane.
_AT_ONCE, _TILTED = 1_000_000, 1e-9


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class BodyFields(Summarised):
    """Displacement and stress over a body in one state.

    Attributes
    ----------
    nodes : (N, 2) array, of a solid (N, 3)
        Reference places of the displacement nodes [m].
    elements : (E, k) integer array
        Nodes of each element: corners, then middles of edges, of faces, of the element; rows of
        elements with fewer nodes than others are filled by their last one.
    displacement : (N, 2) array, of a solid (N, 3)
        In x, y (, z) [m].
    stress : (N, 4) array, of a solid (N, 6)
        Stresses xx, yy, zz, xy (, yz, xz), means over the adjacent elements [Pa]. After large
        deflections these are second Piola-Kirchhoff stresses, in axes that turn with the
        material; see :attr:`cauchy_stress`.
    temperature : (N,) array or None
        Change of temperature at the nodes, whose expansion makes no stress [K].
    """

    nodes: Array
    elements: Integers
    displacement: Array
    stress: Array
    temperature: Array | None = None

    def summary(self) -> list[tuple[str, str]]:
        """Size of the model and the largest values."""
        moved = float(np.linalg.norm(self.displacement, axis=1).max())
        return [
            ("nodes", f"{len(self.nodes)}"), ("elements", f"{len(self.elements)}"),
            ("largest displacement", quantity(moved, "m")),
            ("von Mises stress", span(self.von_mises, "Pa")),
        ]

    @cached_property
    def cells(self) -> Integers:
        """First-order cells (M, k) between the nodes, rows as those of :class:`~fecontact.Mesh`."""
        return linear_cells(self.nodes, self.elements)

    @cached_property
    def outline(self) -> Integers:
        """Edges (k, 2) or faces (k, 3) or (k, 4) of these cells on the outline."""
        sides, _ = sides_of(self.cells, self.nodes.shape[1])
        _, number, count = numbered_rows(unordered(sides))
        return drawn_facets(sides[count[number] == 1])[0]

    @property
    def von_mises(self) -> Array:
        """Von Mises stress (N,) [Pa]."""
        return von_mises_of(self.stress.T)

    @property
    def cauchy_stress(self) -> Array:
        r"""True stress in x, y (, z) after large deflections, in the order of ``stress`` [Pa].

        :math:`\sigma = F S F^T / \det F` with the deformation gradient F, a mean over the adjacent
        elements as the second stress S of Piola and Kirchhoff is. Strains across a plane body count
        as zero, an error of the size of the strain. For fields of small deflections ``stress``
        itself is the true stress.
        """
        count, d = self.nodes.shape
        F = np.eye(3) + np.zeros((count, 3, 3))
        F[:, :d, :d] += self._gradients()
        S = np.zeros((count, 3, 3))
        pairs = PAIRS[3][: self.stress.shape[1]]
        for values, (i, j) in zip(self.stress.T, pairs, strict=True):
            S[:, i, j] = S[:, j, i] = values
        true = F @ S @ F.transpose(0, 2, 1) / np.linalg.det(F)[:, None, None]
        return np.stack([true[:, i, j] for i, j in pairs], axis=1)

    def _gradients(self) -> Array:
        """Displacement gradients (N, d, d) at the nodes, means over the adjacent elements."""
        count, d = self.nodes.shape
        found, around = np.zeros((count, d, d)), np.zeros(count)
        for _, members in blocks_of(self.elements):
            width = members.shape[1]
            local = np.array(element_kind(d, width).places[:width], dtype=float)
            _, slopes = shape_functions(d, width, local)
            jacobian = np.einsum("nkj,eki->enij", slopes, self.nodes[members])
            grad = np.einsum("nkj,eki->enij", slopes, self.displacement[members]) @ (
                np.linalg.inv(jacobian))
            size = np.abs(np.linalg.det(jacobian)).mean(axis=1)
            np.add.at(found, members, size[:, None, None, None] * grad)
            np.add.at(around, members, size[:, None])
        return found / around[:, None, None]

    def at(self, place: Sequence[float]) -> tuple[Array, Array]:
        """Displacement (d,) [m] and stress [Pa] at a place, interpolated within its element.

        InputError for a place outside the body.
        """
        which, weights = interpolation(
            self.nodes, self.elements, as_place(place, "at: place", self.nodes.shape[1]),
            "at: place")
        return weights[0] @ self.displacement[which], weights[0] @ self.stress[which]


def of_one_width(cells: Sequence[Integers]) -> list[Integers]:
    """Rows of cells of several bodies filled by their last corner to one length."""
    width = max(array.shape[1] for array in cells)
    return [padded([array], width) for array in cells]


def linear_cells(nodes: Array, elements: Integers) -> Integers:
    """First-order cells between all nodes of elements, with positive orientation.

    Cells have their corners in the order of meshes, rows filled by their last one.
    """
    found, dimension = [], nodes.shape[1]
    for _, rows in blocks_of(elements):
        kind = element_kind(dimension, rows.shape[1])
        if rows.shape[1] == kind.corners:
            found.append(rows[:, np.argsort(kind.order)])
        elif rows.shape[1] < len(kind.places):
            found += serendipity_parts(kind, rows)
        else:
            found += [rows[:, list(part)] for part in PARTS[dimension, kind.corners]]
    return oriented(nodes, padded(found))[0]


def stress_of(
    body: ElasticBody, displacements: Array, axes: StressAxes = "global", *, finite: bool = False,
    factors: Array | None = None,
) -> Array:
    """Stresses (N, 4, m) of displacements (2 N, m), or (N, 6, m) of (3 N, m), at the nodes [Pa].

    In the order xx, yy, zz, xy (, yz, xz); means over the adjacent elements. With ``axes =
    'material'`` anisotropic cells give the components 11, 22, 33, 12 (, 23, 13) in their axes.

    Parameters
    ----------
    body : ElasticBody
        The body.
    displacements : (d N, m) array
        Displacements of the nodes in m states [m].
    axes : 'global' or 'material'
        Axes of the components.
    finite : bool
        True for Green-Lagrange strains and second Piola-Kirchhoff stresses, whose components belong
        to axes that turn with the material.
    factors : (9 M, m) array, optional
        Factors of incompatible modes of bricks, by cell, mode and axis; by default those without
        force in linear elasticity.

    Raises
    ------
    InputError
        For material axes of a plane body of which none is normal to its plane.
    """
    require_choice("stress_of", "axes", axes, get_args(StressAxes))
    chosen = np.flatnonzero((body.anisotropic[1] >= 0) | body.has_incompatible_modes | finite)
    parts = [_stress_by_cells(body, displacements, axes, chosen, finite, factors)] if len(
        chosen) else []
    if len(chosen) == len(body.mesh.cells):
        return parts[0]
    for constants, gradients in body.material_gradients:
        if body.dimension == 3:
            parts.append(_stress_in_space(constants, gradients, displacements))
            continue
        (dx, dy), (direct, lateral, shear) = gradients, constants
        u, v = displacements[0::2], displacements[1::2]
        xx, yy, slide = dx @ u, dy @ v, dy @ u + dx @ v
        sxx, syy = direct * xx + lateral * yy, lateral * xx + direct * yy
        szz = lateral * (xx + yy) * (body.plane == "strain")
        parts.append(np.stack([sxx, syy, szz, shear * slide], axis=1))
    return parts[0] if len(parts) == 1 else np.asarray(np.sum(parts, axis=0))


def _stress_by_cells(
    body: ElasticBody, displacements: Array, axes: StressAxes, chosen: Integers, finite: bool,
    factors: Array | None,
) -> Array:
    """Part of the chosen cells in the stresses, means over all elements at a node."""
    import scipy.sparse as sp

    d = body.dimension
    components, used = (4, [0, 1, 3]) if d == 2 else (6, list(range(6)))
    count, around = len(body.nodes), np.zeros(len(body.nodes))
    fields = displacements.reshape(count, d, -1)
    total = np.zeros((count, components * fields.shape[2]))
    for block in body.blocks:
        np.add.at(around, block.nodes, block.volumes[:, None])
    for block in body.blocks:
        local, volumes, width = block.at_nodes, block.volumes, block.nodes.shape[1]
        rows = np.flatnonzero(np.isin(block.numbers, chosen))
        parts = 1 + len(rows) * width * max(fields.shape[2], width) // _AT_ONCE
        for some in np.array_split(rows, parts):
            part = block.only(some)
            # grad (e, n, i, j, m): derivative of displacement i in direction j at node n
            grad = np.einsum("enkj,ekim->enijm", part.nodal_gradients(), fields[part.nodes])
            if part.incompatible:
                grad += mode_gradients(body, part, displacements, local, factors)
            strains = np.stack([_strain(grad, i, j, finite) for i, j in PAIRS[d]], axis=2)
            of_strain = body.cell_stiffness(part.numbers)[:, :components, used]
            if d == 2 and body.plane == "stress":
                of_strain[:, 2] = 0.0
            if axes == "material":
                of_strain = _to_material_axes(body, part.numbers, components) @ of_strain
            stress = np.einsum("ers,ensm->enrm", of_strain, strains)
            stress *= volumes[some, None, None, None]
            at = part.nodes.ravel()
            gather = sp.csr_array((1.0 / around[at], (at, np.arange(len(at)))),
                                  shape=(count, len(at)))
            total += gather @ stress.reshape(len(at), total.shape[1])
    return total.reshape(count, components, -1)


def _strain(slopes: Array, i: int, j: int, finite: bool) -> Array:
    """Strain (e, n, m), twice if it is a shear, of displacement gradients (e, n, d, d, m)."""
    found = 0.5 * (slopes[:, :, i, j] + slopes[:, :, j, i])
    if finite:
        found = found + 0.5 * (slopes[:, :, :, i] * slopes[:, :, :, j]).sum(axis=2)
    return np.asarray(found if i == j else 2.0 * found)


def _to_material_axes(body: ElasticBody, cells: Integers, components: int) -> Array:
    """Matrices (e, s, s) from stresses in x, y (, z) to the axes of the cells' materials."""
    turn = np.empty((len(cells), 6, 6))
    for which in np.unique(body.cell_materials[cells]):
        one = body.materials[which]
        inside = body.cell_materials[cells] == which
        turn[inside] = np.eye(6) if isinstance(one, Material) else stress_rotation(
            one.axes.at(body.cell_centres(cells[inside])))
    lost = turn[:, components:, :components]
    if np.abs(lost).max(initial=0.0) > _TILTED:
        raise InputError("stress_of: axes = 'material' of a plane body are those of a material "
                         "whose axis 3 is normal to the plane; give such axes, or take 'global'.")
    return turn[:, :components, :components]


def _stress_in_space(
    constants: Array, gradients: tuple[Any, ...], displacements: Array
) -> Array:
    (dx, dy, dz), (direct, lateral, shear) = gradients, constants
    u, v, w = (displacements[axis::3] for axis in range(3))
    xx, yy, zz = dx @ u, dy @ v, dz @ w
    all_round = lateral * (xx + yy + zz)
    own = direct - lateral
    return np.stack([all_round + own * xx, all_round + own * yy, all_round + own * zz,
                     shear * (dy @ u + dx @ v), shear * (dz @ v + dy @ w),
                     shear * (dz @ u + dx @ w)], axis=1)
