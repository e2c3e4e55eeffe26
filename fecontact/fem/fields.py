"""Displacement and stress over a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.core.checks import as_pair
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, quantity, span
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.interpolation import interpolation


@dataclass(frozen=True, eq=False, repr=False)
class BodyFields(Summarised):
    """Displacement and stress over a body in one state.

    Attributes
    ----------
    nodes : (N, 2) array
        Reference places of the displacement nodes [m].
    elements : (E, k) integer array
        Nodes of each element: corners, mid-sides, centre.
    displacement : (N, 2) array
        In x and y [m].
    stress : (N, 4) array
        Stresses xx, yy, zz, xy, means over the adjacent elements [Pa].
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
        """First-order cells (M, 3) or (M, 4) between the nodes."""
        return linear_cells(self.nodes, self.elements)

    @cached_property
    def outline(self) -> Integers:
        """Edges (k, 2) of these cells on the outline."""
        cells = self.cells
        sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2))
        edges, count = np.unique(sides, axis=0, return_counts=True)
        return np.asarray(edges[count == 1])

    @property
    def von_mises(self) -> Array:
        """Von Mises stress (N,) [Pa]."""
        xx, yy, zz, xy = self.stress.T
        return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
                                  + 3.0 * xy**2))

    def at(self, place: Sequence[float]) -> tuple[Array, Array]:
        """Displacement (2,) [m] and stress (4,) [Pa] at a place, interpolated within its element.

        InputError for a place outside the body.
        """
        which, weights = interpolation(self.nodes, self.elements, as_pair(place, "at: place"),
                                       "at: place")
        return weights[0] @ self.displacement[which], weights[0] @ self.stress[which]


def body_elements(body: ElasticBody) -> Integers:
    """Nodes (E, k) of each element of a body: corners, mid-sides, centre."""
    # 64-bit indices, as in files.
    return np.ascontiguousarray(body.basis.element_dofs.T.astype(np.int64))


def linear_cells(nodes: Array, elements: Integers) -> Integers:
    """First-order cells between all nodes of elements, counter-clockwise."""
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


def stress_of(body: ElasticBody, displacements: Array) -> Array:
    """Stresses xx, yy, zz, xy (N, 4, m) of displacements (2 N, m), means at the nodes [Pa]."""
    dx, dy = body.gradients
    direct, lateral, shear = body.elasticity
    u, v = displacements[0::2], displacements[1::2]
    xx, yy, slide = dx @ u, dy @ v, dy @ u + dx @ v
    sxx, syy = direct * xx + lateral * yy, lateral * xx + direct * yy
    szz = body.material.poisson_ratio * (sxx + syy) * (body.plane == "strain")
    return np.stack([sxx, syy, szz, shear * slide], axis=1)
