"""Displacement and stress over a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.checks import as_place
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, quantity, span
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_geometry import facets_of, oriented_solids
from fecontact.fem.elements.cell_kinds import CELL_KINDS, numbered_rows
from fecontact.fem.elements.refinement import PARTS
from fecontact.fem.interpolation import element_kind, interpolation


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class BodyFields(Summarised):
    """Displacement and stress over a body in one state.

    Attributes
    ----------
    nodes : (N, 2) array, of a solid (N, 3)
        Reference places of the displacement nodes [m].
    elements : (E, k) integer array
        Nodes of each element: corners, then middles of edges, of faces, of the element.
    displacement : (N, 2) array, of a solid (N, 3)
        In x, y (, z) [m].
    stress : (N, 4) array, of a solid (N, 6)
        Stresses xx, yy, zz, xy (, yz, xz), means over the adjacent elements [Pa].
    """

    nodes: Array
    elements: Integers
    displacement: Array
    stress: Array

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
        """First-order cells (M, 3) or (M, 4), of a solid (M, 4) or (M, 8), between the nodes."""
        return linear_cells(self.nodes, self.elements)

    @cached_property
    def outline(self) -> Integers:
        """Edges (k, 2) or faces (k, 3) or (k, 4) of these cells on the outline."""
        cells = self.cells
        if self.nodes.shape[1] == 3:
            faces = facets_of(cells, CELL_KINDS[3, cells.shape[1]])
            _, number, count = numbered_rows(np.sort(faces, axis=1))
            return np.asarray(faces[count[number] == 1])
        sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2))
        edges, count = np.unique(sides, axis=0, return_counts=True)
        return np.asarray(edges[count == 1])

    @property
    def von_mises(self) -> Array:
        """Von Mises stress (N,) [Pa]."""
        xx, yy, zz, xy = self.stress.T[:4]
        shears = xy**2 if self.stress.shape[1] == 4 else (self.stress[:, 3:] ** 2).sum(axis=1)
        return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
                                  + 3.0 * shears))

    def at(self, place: Sequence[float]) -> tuple[Array, Array]:
        """Displacement (d,) [m] and stress [Pa] at a place, interpolated within its element.

        InputError for a place outside the body.
        """
        which, weights = interpolation(
            self.nodes, self.elements, as_place(place, "at: place", self.nodes.shape[1]),
            "at: place")
        return weights[0] @ self.displacement[which], weights[0] @ self.stress[which]


def body_elements(body: ElasticBody) -> Integers:
    """Nodes (E, k) of each element of a body, in the order of ``CellKind.places``."""
    # 64-bit indices, as in files.
    return np.ascontiguousarray(body.basis.element_dofs.T.astype(np.int64))


def linear_cells(nodes: Array, elements: Integers) -> Integers:
    """First-order cells between all nodes of elements, with positive orientation.

    Cells of solids have their corners in the order of meshes, those of elements in scikit-fem's.
    """
    if nodes.shape[1] == 3:
        return _solid_cells(nodes, elements)
    if elements.shape[1] < 6:
        cells = elements
    elif elements.shape[1] == 6:
        a, b, c, ab, bc, ac = elements.T
        cells = np.concatenate([np.column_stack(cell) for cell in (
            (a, ab, ac), (ab, b, bc), (ac, bc, c), (ab, bc, ac))])
    else:
        a, b, c, d, ab, bc, cd, ad, m = elements.T
        cells = np.concatenate([np.column_stack(cell) for cell in (
            (a, ab, m, ad), (ab, b, bc, m), (m, bc, c, cd), (ad, m, cd, d))])
    side = nodes[cells[:, :3]]
    (ux, uy), (vx, vy) = (side[:, 1] - side[:, 0]).T, (side[:, 2] - side[:, 0]).T
    return np.where((ux * vy - uy * vx < 0.0)[:, None], cells[:, ::-1], cells)


def _solid_cells(nodes: Array, elements: Integers) -> Integers:
    kind = element_kind(3, elements.shape[1])
    if elements.shape[1] == kind.corners:
        inverse = np.argsort(kind.order)
        return np.ascontiguousarray(elements[:, inverse])
    cells = np.concatenate([elements[:, list(part)] for part in PARTS[3, kind.corners]])
    return oriented_solids(nodes, cells, kind)


def stress_of(body: ElasticBody, displacements: Array) -> Array:
    """Stresses (N, 4, m) of displacements (2 N, m), or (N, 6, m) of (3 N, m), at the nodes [Pa].

    In the order xx, yy, zz, xy (, yz, xz); means over the adjacent elements.
    """
    parts = []
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
