"""Elastic static response of a body to forces at its points.

A force pattern f over the rows W of the points loads the free degrees of freedom with ``W^T f``,
which the inertia of the rigid modes balances; G, the elastic flexibility, acts on such loads.
"""

from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.solvers.factorisation import SymmetricFactors

# Angular frequencies (m,) and mass-normalised shapes (f, m).
Modes = tuple[Array, Array]


class Flexibility:
    """Elastic static response of a free system to unit forces at the rows W (k, f), sparse.

    ``modes`` are those beside which deflections are of interest, by default the rigid ones.
    """

    def __init__(self, system: FreeSystem, rows: Any, modes: Modes | None = None) -> None:
        self.system = system
        self.modes = modes or (np.zeros(system.rigid.shape[1]), system.rigid)
        self.rows = rows.tocsr()
        self._factors = SymmetricFactors(system.factors)
        self._places, self._half = self._factors.forward_substitute(self.rows[:, system.held])

    def of_rows(self, which: NDArray[np.bool_]) -> "Flexibility":
        """Flexibility restricted to the rows of a mask."""
        part = copy(self)
        part.rows, part._half = self.rows[which], self._half[:, which]
        for name in ("compliance", "_balance"):
            part.__dict__.pop(name, None)
        return part

    @cached_property
    def _balance(self) -> tuple[Array, Array]:
        """Response (f, r) of the supported body to rigid-body inertia, and W rigid (k, r)."""
        system = self.system
        response = np.zeros_like(system.rigid)
        if system.rigid.shape[1]:
            response[system.held] = system.factors.solve(
                np.ascontiguousarray(system.inertia[system.held]))
        return response, np.asarray(self.rows @ system.rigid)

    @cached_property
    def compliance(self) -> Array:
        """W G W^T (k, k): elastic displacements at the rows per unit force there [m/N]."""
        response, motion = self._balance
        held = self._half.T @ self._half
        cross = np.asarray(self.rows @ response) @ motion.T
        rigid = motion @ (self.system.inertia.T @ response) @ motion.T
        return np.asarray(held - cross - cross.T + rigid)

    def deflections(self, patterns: Array) -> Array:
        """G W^T patterns (f, p): elastic displacements under force patterns (k, p) [m/N]."""
        response, motion = self._balance
        deflection = np.zeros((self.system.stiffness.shape[0], patterns.shape[1]))
        deflection[self.system.held] = self._factors.back_substitute(
            self._places, self._half @ patterns)
        deflection -= response @ (motion.T @ patterns)
        return self.system.without_rigid(deflection)


def modal_compliance(rows: Any, w: Array, shapes: Array) -> Array:
    """Contribution (k, k) of modes (f, m) to the elastic compliance at the rows [m/N]."""
    at_rows = np.asarray(rows @ shapes[:, w > 0.0]) / w[w > 0.0]
    return np.asarray(at_rows @ at_rows.T)
