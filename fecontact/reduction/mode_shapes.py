"""Mode shapes of a modal basis, quality of its reduction, and blocks of modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.interpolation import interpolation
from fecontact.fem.points import rotating_rows


@read_only_arrays
@dataclass(frozen=True, eq=False)
class NonlinearStress:
    """Stress beside that linear in the coordinates: a sum of their products.

    Of large deflections these are of the degrees two and three; the stress of a change of
    temperature in a body that is held has the degree zero.

    Term k is ``stress[..., k] prod_i Q_i^powers[k, i]`` with ``Q = coordinates @ q``.

    Attributes
    ----------
    coordinates : (d, m) array
        Rows of the coordinates of modes with large deflections.
    powers : (p, d) integer array
        Exponents of the coordinates in each of p products.
    stress : (N, 4, p), of solids (N, 6, p) array
        Stress at the nodes, of large deflections the second one of Piola and Kirchhoff [Pa per
        unit of each product].
    """

    coordinates: Array
    powers: Integers
    stress: Array

    def products(self, q: Array) -> Array:
        """Products (F, p) at modal coordinates (F, m)."""
        return np.asarray(np.prod((q @ self.coordinates.T)[:, None] ** self.powers, axis=2))


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ModeShapes:
    """Mode shapes over the whole body, for plots and for loads at any point.

    Attributes
    ----------
    nodes : (N, d) array
        Reference places of the displacement nodes [m], d = 2 in the plane, 3 in space.
    cells : (M, 3) or (M, 4), of solids (M, 4) or (M, 8) integer array
        First-order cells between these nodes (four per finite element, of solids eight).
    outline : (k, 2), of solids (k, 3) or (k, 4) integer array
        Edges on the outline, as pairs of nodes; first-order facets of the surface, their nodes
        counter-clockwise seen from outside.
    shapes : (N, d, m) array
        Mass-normalised mode shapes along the axes.
    stress : (N, 4, m), of solids (N, 6, m) array
        Stresses xx, yy, zz, xy, of solids also yz, zx, of the modes, averaged at the nodes [Pa per
        unit coordinate].
    restriction : sparse (3 P, 2 N), of solids (6 P, 3 N) array
        Displacements and rotations of the P points from those of the nodes (node by node), so that
        ``T = restriction @ shapes``; its transpose distributes a force at a point over the nodes.
    elements : (E, k) integer array, optional
        Nodes of each finite element: corners, mid-sides, centre; by default the cells.
    outline_nodes : (k,) integer array, optional
        Contact node to whose patch each facet of a solid's outline belongs, -1 for none.
    nonlinear_stress : NonlinearStress, optional
        Stress that is not linear in the coordinates, of large deflections or of temperature.
    temperature : (N,) array, optional
        Change of temperature at the nodes, whose expansion makes no stress [K].
    """

    nodes: Array
    cells: Integers
    outline: Integers
    shapes: Array
    stress: Array
    restriction: Any
    elements: Integers | None = None
    outline_nodes: Integers | None = None
    nonlinear_stress: NonlinearStress | None = None
    temperature: Array | None = None

    @cached_property
    def stress_terms(self) -> Array:
        """Stresses (N, c, m + p) of the m coordinates and of the p products behind them."""
        if self.nonlinear_stress is None:
            return self.stress
        return np.concatenate([self.stress, self.nonlinear_stress.stress], axis=2)

    def stress_coordinates(self, q: Array) -> Array:
        """Coordinates (F, m) followed by the products (F, p) that :attr:`stress_terms` need."""
        if self.nonlinear_stress is None:
            return q
        return np.hstack([q, self.nonlinear_stress.products(q)])

    def rows_at(self, place: Sequence[float], name: str) -> Array:
        """Displacements and rotations (3, m) of the modes at a place within an element, or (6, m).

        InputError, with ``name`` in front, for a place outside the body.
        """
        elements = self.cells if self.elements is None else self.elements
        rows = rotating_rows(len(self.nodes), *interpolation(self.nodes, elements, place, name))
        return np.asarray(rows @ self.shapes.reshape(self.nodes.size, -1))


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ReductionQuality:
    """Quality of a basis compared with its finite-element body.

    Attributes
    ----------
    mass : float
        Mass of the body [kg].
    vibration_modes : int
        Number of leading modes that are eigenmodes of the body.
    residuals : (m,) array
        ``|K s - w^2 M s| / (|K| |s|)`` of each mode s; small for eigenmodes only.
    orthogonality : float
        Largest entry of ``shapes^T M shapes - 1``.
    compliance : (P, d) array
        Elastic displacement of each point along each axis per unit force there, of the full body
        (loads are balanced by supports and inertia) [m/N].
    load_compliance : (1 + b, d) array
        Work ``f^T u`` of the loads in the elastic displacement under them, of the full body:
        gravity of 1 m/s^2 along each axis [N m], then for each of the b boundaries pressure and
        shear (in space shears) of 1 Pa.
    """

    mass: float
    vibration_modes: int
    residuals: Array
    orthogonality: float
    compliance: Array
    load_compliance: Array


@dataclass(frozen=True)
class BodyPart:
    """One of several bodies in a basis.

    Attributes
    ----------
    name : str
    modes : (int, int)
        First of its modal coordinates and their number, zero where modes are common to all bodies,
        as with links between them.
    nodes : (int, int)
        First of its nodes in ``mode_shapes.nodes`` and their number, zero for a body without
        shapes.
    """

    name: str
    modes: tuple[int, int]
    nodes: tuple[int, int] = (0, 0)
