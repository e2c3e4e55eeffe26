"""Craig-Bampton reduction: fixed-interface modes and constraint modes, diagonalised.

The interface is the set of rows W of the points (displacements x and y of B, C and the contact
nodes). Fixed-interface modes satisfy W u = 0; a constraint mode is the static deflection for a unit
value of one interface displacement, with all others zero. For a body with rigid modes the responses
to interface forces balanced by inertia are added, so that its static compliance at the interface is
exact as well.
"""

from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.solvers.congruence import as_matrix
from fecontact.reduction.static_modes.flexibility import Flexibility
from fecontact.reduction.static_modes.residual_vectors import diagonalised, flexibility_of

# Squared size of a direction, in that of the largest, below which products know nothing of it.
_LEAST = 1e-15


def craig_bampton(
    system: FreeSystem, rows: Any, count: int, loads: Array | None = None
) -> tuple[Array, Array]:
    """Frequencies (m,) and mass-normalised shapes (f, m) of a Craig-Bampton basis.

    Parameters
    ----------
    system : FreeSystem
        The body.
    rows : sparse (k, f) array
        The interface; dependent and motionless rows are left out.
    count : int
        Number of fixed-interface modes, zero or more.
    loads : (f, l) array, optional
        Further loads whose static response is added.

    Returns
    -------
    w, shapes
        First the rigid modes, with frequency exactly zero, then the modes of the reduced body;
        m is at most ``count`` plus the numbers of independent rows, of loads and of rigid modes.
    """
    flexibility = flexibility_of(system, rows)
    patterns = _independent(flexibility)
    motion = patterns.T @ (flexibility.rows @ system.rigid)
    deflections = flexibility.deflections(patterns)
    fixed = _fixed_interface_modes(system, flexibility.rows.T @ patterns, deflections, motion,
                                   count)
    responses = [] if loads is None else [system.deflection(loads)]
    squares, shapes = diagonalised(system, _distinguished(
        system, system.without_rigid(np.hstack([deflections, fixed, *responses]))))
    rigid = system.rigid.shape[1]
    return (np.concatenate([np.zeros(rigid), np.sqrt(squares)]),
            np.hstack([system.rigid, shapes]))


def _distinguished(system: FreeSystem, vectors: Array) -> Array:
    """Vectors (f, p) of the same span, with similar energies and nearly orthogonal.

    Products of nearly dependent vectors lose their differences to rounding, about 1e-16 of their
    squares; the differences themselves lose only its root. Constraint modes and
    fixed-interface modes of slender bodies are such vectors.
    """
    stiffness = vectors.T @ (system.stiffness @ vectors)
    scale = 1.0 / np.sqrt(np.diag(stiffness))
    values, directions = np.linalg.eigh(stiffness * np.outer(scale, scale))
    values = np.maximum(values, _LEAST * values[-1])
    return np.asarray(vectors @ (scale[:, None] * directions / np.sqrt(values)))


def _independent(flexibility: Flexibility) -> Array:
    """Independent combinations (k, p) of the rows, scaled to similar compliance."""
    motion = np.asarray(flexibility.rows @ flexibility.system.rigid)
    elastic = flexibility.compliance
    part = np.trace(elastic) / max(float((motion**2).sum()), 1e-300)
    whole = elastic + part * motion @ motion.T
    own = np.sqrt(np.diag(whole))
    moves = own > 1e-7 * own.max()
    scale = np.where(moves, 1.0 / np.where(moves, own, 1.0), 0.0)
    values, directions = np.linalg.eigh(whole * np.outer(scale, scale))
    real = values > 1e-11 * values[-1]
    return np.asarray(scale[:, None] * directions[:, real] / np.sqrt(values[real]))


def _fixed_interface_modes(
    system: FreeSystem, held: Array, deflections: Array, motion: Array, count: int
) -> Array:
    """Shapes (f, count) of the lowest modes that do not move the interface.

    ``held`` (f, p) are the interface's forces, ``deflections`` (f, p) the elastic response to
    them, ``motion`` (p, r) the interface displacements of the rigid modes. The response to a load
    is that of the free body with the interface forces and rigid motion that fix the interface.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    K, M = as_matrix(system.stiffness), as_matrix(system.mass)
    size, interface = K.shape[0], held.shape[1]
    if not count:
        return np.zeros((size, 0))
    if isinstance(count, bool) or not isinstance(count, int) or not 0 < count <= (
            size - interface - 2):
        raise InputError(f"modes = {count!r} must be a whole number from 0 to "
                         f"{size - interface - 2}: the body has {size} unknowns and its "
                         f"interface {interface}.")
    r = motion.shape[1]
    saddle = np.block([[held.T @ deflections, motion], [motion.T, np.zeros((r, r))]])
    inverse = np.linalg.pinv(saddle, rcond=1e-12, hermitian=True)
    responses = np.hstack([deflections, system.rigid])

    def still(force: Array) -> Array:
        return np.asarray(system.deflection(force) - responses @ (inverse @ (responses.T @ force)))

    start = still(M @ np.random.default_rng(0).standard_normal(size))
    _, shapes = eigsh(K, k=count, M=M, sigma=0.0, v0=start, ncv=min(max(2 * count + 1, 20), size),
                      OPinv=LinearOperator(K.shape, still, dtype=float))
    return np.asarray(shapes)
