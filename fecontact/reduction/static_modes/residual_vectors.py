"""Residual vectors: the static response at the points that the kept modes lack.

A force pattern f over the rows W of the points loads the free degrees of freedom with
``W^T f``. Beside the kept modes Phi with squared frequencies L, the elastic static response is

    W^T f -> Phi_e L_e^-1 Phi_e^T W^T f + Y f,       Y = (G - Phi_e L_e^-1 Phi_e^T) W^T

where G, the elastic flexibility, acts on loads that the inertia of the rigid modes balances. Y
holds the residual vectors of MacNeal and Rubin, ``W Y`` is the residual compliance.
"""

from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import FreeSystem, fixed_signs
from fecontact.reduction.solvers.factorisation import SymmetricFactors
from fecontact.reduction.solvers.solid_solver import WIDTH

# Rows for which a system that is solved iteratively needs no factors, and unknowns above which
# these cost more than iterations for any number of rows.
_FEW = 64
_LARGE = 80_000
# Energy norm of the residuals of iterated deflections; the error of compliances is its square. Of
# many rows that are completed to a tolerance it is this part of the tolerance.
_ACCURACY = 1e-5
_PART = 0.05
# Bytes of deflections that are kept.
_ROOM = 3e9


class Flexibility:
    """Elastic static response of a free system to unit forces at the rows W (k, f), sparse.

    ``accuracy`` is that of deflections, in the energy norm and relative.
    """

    accuracy = 0.0

    def __init__(self, system: FreeSystem, rows: Any) -> None:
        self.system = system
        self.rows = rows.tocsr()
        self._factors = SymmetricFactors(system.factors)
        self._places, self._half = self._factors.forward_substitute(self.rows[:, system.held])

    def of_rows(self, which: NDArray[np.bool_]) -> "Flexibility":
        """The same for some rows alone."""
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


class IteratedFlexibility(Flexibility):
    """The same of a system that is solved iteratively.

    ``accuracy`` is the energy norm of the residuals of the deflections under unit forces, relative
    to theirs; what each of them says of its own row is accurate to the square.
    """

    def __init__(self, system: FreeSystem, rows: Any, accuracy: float = _ACCURACY) -> None:
        self.system = system
        self.rows = rows.tocsr()
        self.accuracy = accuracy
        self._whole: tuple[IteratedFlexibility, NDArray[np.bool_]] | None = None

    def of_rows(self, which: NDArray[np.bool_]) -> "IteratedFlexibility":
        """The same for some rows alone."""
        part = IteratedFlexibility(self.system, self.rows[which], self.accuracy)
        part._whole = self, which
        return part

    @cached_property
    def compliance(self) -> Array:
        """W G W^T (k, k): elastic displacements at the rows per unit force there [m/N]."""
        if self._whole is None:
            return self._solved[0]
        whole, which = self._whole
        return whole.compliance[np.ix_(which, which)]

    @cached_property
    def _solved(self) -> tuple[Array, Array | None]:
        """The compliance, and the deflections (f, k) if there is room for them."""
        count, size = self.rows.shape
        found = np.zeros((count, count))
        kept = np.zeros((size, count)) if 8.0 * size * count <= _ROOM else None
        loaded = np.flatnonzero(np.diff(self.rows.indptr))
        for first in range(0, len(loaded), WIDTH):
            part = loaded[first : first + WIDTH]
            answer = self.system.deflection(self.rows[part].T.toarray(), self.accuracy)
            found[:, part] = self.rows @ answer
            if kept is not None:
                kept[:, part] = answer
        return 0.5 * (found + found.T), kept

    def deflections(self, patterns: Array) -> Array:
        """G W^T patterns (f, p): elastic displacements under force patterns (k, p) [m/N]."""
        if self._whole is not None:
            whole, which = self._whole
            further = np.zeros((len(which), patterns.shape[1]))
            further[which] = patterns
            return whole.deflections(further)
        answers = self._solved[1]
        if answers is not None:
            return np.asarray(answers @ patterns)
        return self.system.deflection(np.asarray(self.rows.T @ patterns), self.accuracy)


def flexibility_of(system: FreeSystem, rows: Any, tolerance: float = 0.0) -> Flexibility:
    """The elastic flexibility at rows W (k, f), by the solver that suits system and rows.

    Substitution costs little for each row once there are factors, and less than iterations for many
    rows of bodies with less than 80,000 unknowns. Where larger ones are iterated and are completed
    to a tolerance, a twentieth of it is left to the iterations.
    """
    few = rows.shape[0] <= _FEW
    if (few or rows.shape[1] > _LARGE) and system.iterates:
        loose = 0.0 if few else np.sqrt(_PART * tolerance)
        return IteratedFlexibility(system, rows, max(_ACCURACY, float(loose)))
    return Flexibility(system, rows)


def modal_compliance(rows: Any, w: Array, shapes: Array) -> Array:
    """Contribution (k, k) of modes (f, m) to the elastic compliance at the rows [m/N]."""
    at_rows = np.asarray(rows @ shapes[:, w > 0.0]) / w[w > 0.0]
    return np.asarray(at_rows @ at_rows.T)


def leading_patterns(whole: Array, kept: Array, tolerance: float) -> Array:
    """Force patterns (k, p) whose residual vectors leave no more than ``tolerance``.

    They are the leading singular vectors of the residual compliance ``whole - kept`` (k, k), each
    row scaled by the square root of its full elastic compliance; p is the smallest number for which
    no row lacks more than the fraction ``tolerance`` of its own compliance.
    """
    own = np.diag(whole)
    scale = np.where(own > 0.0, 1.0, 0.0) / np.sqrt(np.where(own > 0.0, own, 1.0))
    values, patterns = np.linalg.eigh((whole - kept) * np.outer(scale, scale))
    values, patterns = values[::-1], patterns[:, ::-1]
    real = values > 1e-12 * len(values)
    values, patterns = values[real], patterns[:, real]
    part = values * patterns**2
    missing = part.sum(axis=1)[:, None] - np.cumsum(np.hstack([0.0 * part[:, :1], part]), axis=1)
    enough = np.flatnonzero((missing <= tolerance + 1e-13).all(axis=0))
    count = int(enough[0]) if enough.size else len(values)
    return np.asarray(patterns[:, :count] * scale[:, None])


def residual_modes(
    flexibility: Flexibility, w: Array, shapes: Array, tolerance: float, loads: Array
) -> tuple[Array, Array]:
    """Frequencies (p,) and shapes (f, p) that complete the modes (f, m) at the rows.

    They span the residual vectors of the leading force patterns and those of loads (f, l) of whose
    static response more than the tolerance is missing, are orthogonal to the modes and to each
    other in mass and stiffness, and mass-normalised.
    """
    system = flexibility.system
    kept = modal_compliance(flexibility.rows, w, shapes)
    patterns = leading_patterns(flexibility.compliance, kept,
                                max(tolerance - flexibility.accuracy**2, 0.0))
    deflections = system.deflection(loads)
    whole_work = (loads * deflections).sum(axis=0)
    work = ((loads.T @ shapes[:, w > 0.0] / w[w > 0.0]) ** 2).sum(axis=1)
    lacking = whole_work - work > max(tolerance, 1e-12) * whole_work
    if not patterns.shape[1] and not lacking.any():
        return np.zeros(0), np.zeros((len(shapes), 0))
    vectors = np.hstack([flexibility.deflections(patterns), deflections[:, lacking]])
    inertia = system.mass @ shapes
    for _ in range(2):
        vectors -= shapes @ (inertia.T @ vectors)
    squares, found = diagonalised(system, vectors)
    return np.sqrt(squares), found


def diagonalised(system: FreeSystem, vectors: Array) -> tuple[Array, Array]:
    """Squared frequencies (p,) and mass-normalised shapes (f, p) of the span of some vectors."""
    stiffness = vectors.T @ (system.stiffness @ vectors)
    mass = vectors.T @ (system.mass @ vectors)
    scale = 1.0 / np.sqrt(np.diag(stiffness))
    values, directions = np.linalg.eigh(stiffness * np.outer(scale, scale))
    kept = values > 1e-11 * values[-1]
    span = scale[:, None] * directions[:, kept] / np.sqrt(values[kept])
    inverse, turned = np.linalg.eigh(span.T @ mass @ span)
    inverse, turned = inverse[::-1], turned[:, ::-1]
    shapes = vectors @ (span @ (turned / np.sqrt(inverse)))
    if inverse[0] * values[-1] > 1e6 * inverse[-1] * values[kept][0]:
        # One symmetric step squares the error of orthogonality.
        gram = shapes.T @ (system.mass @ shapes)
        shapes = shapes @ (1.5 * np.eye(len(gram)) - 0.5 * gram)
    return 1.0 / inverse, shapes * fixed_signs(shapes)
