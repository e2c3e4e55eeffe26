"""Masses on one contact node."""

import numpy as np

from fecontact import ContactSystem, basis_from_matrices, equilibrium
from fecontact.laws import RoughSurface

SURFACE = RoughSurface(0.3e6, 5.2e-6, 6.0)


def mass_above(mass: float = 1.0, spring: float = 0.0, **parts: object) -> ContactSystem:
    """A mass that moves up and down only."""
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = basis_from_matrices([[mass]], [[spring]], {"contact": rows[None], "C": rows})
    return ContactSystem(basis, **{"normal": SURFACE, **parts})


def mass_in_plane(mass: float = 1.0, stiffness: np.ndarray | None = None,
                  damping: np.ndarray | None = None, **parts: object) -> ContactSystem:
    """A mass that moves along the ground and up and down.

    ``stiffness`` [N/m] and ``damping`` [Ns/m] (2, 2) are those of what holds it to the frame.
    """
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(
        mass * np.eye(2), np.zeros((2, 2)) if stiffness is None else stiffness,
        {"contact": rows[None], "B": rows, "C": rows},
        damping=np.zeros((2, 2)) if damping is None else damping)
    return ContactSystem(basis, **{"normal": SURFACE, **parts})


def above(system: ContactSystem, height: float, rate: float) -> np.ndarray:
    """State of a mass above the ground, from its height [m] and its rate [m/s]."""
    return np.array([height, rate]) / system.basis.T[2, 1, 0]


def in_plane(system: ContactSystem, x: float, rate: float = 0.0) -> np.ndarray:
    """State of a mass that rests on the ground, from its x [m] and rate [m/s]."""
    rows = system.basis.T[2, :2]
    return np.concatenate([equilibrium(system).modal_coordinates + np.linalg.solve(rows, [x, 0.0]),
                           np.linalg.solve(rows, [rate, 0.0])])
