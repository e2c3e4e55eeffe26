"""Modes over the whole body, and how they relate to it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Field:
    """Modes over the whole body: what is needed to draw it and to load it anywhere.

    Attributes
    ----------
    nodes : (N, 2) array
        Reference places of the displacement nodes [m].
    cells : (M, 3) or (M, 4) integer array
        First-order cells between these nodes (each finite element is cut into four).
    outline : (k, 2) integer array
        Edges on the outline, as pairs of nodes.
    shapes : (N, 2, m) array
        Mass-normalised mode shapes, x and y.
    stress : (N, 4, m) array
        Stresses xx, yy, zz, xy of the modes, averaged at the nodes [Pa per unit coordinate].
    restriction : sparse (3 P, 2 N) array
        Displacements and rotation of the P points from those of the nodes (node by node, x then
        y), so that ``T = restriction @ shapes``; its transpose spreads a force at a point over
        the body.
    """

    nodes: Array
    cells: NDArray[np.int64]
    outline: NDArray[np.int64]
    shapes: Array
    stress: Array
    restriction: Any


@dataclass(frozen=True, eq=False)
class Quality:
    """How a basis relates to the finite-element body that it came from.

    Attributes
    ----------
    mass : float
        Mass of the body [kg].
    vibration_modes : int
        Number of leading modes that are eigenmodes of the body; the others complete them.
    residuals : (m,) array
        ``|K s - w^2 M s| / (|K| |s|)`` of each mode s; small for eigenmodes only.
    orthogonality : float
        Largest entry of ``shapes^T M shapes - 1``.
    participation : (2, m) array
        ``s^T M 1`` for translations in x and in y [kg^(1/2)]; its square is the effective mass.
    compliance : (P, 2) array
        Elastic displacement of each point in x and y per unit force there, of the whole body
        (inertia balances what the supports do not) [m/N].
    """

    mass: float
    vibration_modes: int
    residuals: Array
    orthogonality: float
    participation: Array
    compliance: Array
