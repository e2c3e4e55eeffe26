"""Lowest modes by LOBPCG: locally optimal block preconditioned conjugate gradients.

Each step seeks the lowest modes in the span of the present ones X, their preconditioned residuals
W = T (K X - M X L) and the last changes P, all orthogonal in mass to the rigid modes. The
convergence of a mode is judged by the energy norm of its residual,

    eta^2 = r^T T r / w^2,        r = K x - w^2 M x,        x^T M x = 1,

which estimates the relative error of the shape's strain energy whatever the slenderness of body
and cells; the relative error of the frequency is about eta^2 / 2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh, solve_triangular

from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array

Product = Callable[[Array], Array]

# Largest eta that counts as converged where round-off allows no less: 1e-8 of the frequency.
_WORST = 1e-4


@dataclass(frozen=True, eq=False)
class Found:
    """Result of :func:`lowest_modes`.

    Attributes
    ----------
    squares : (m,) array
        Squared angular frequencies, ascending.
    shapes : (n, m) array
        Mass-normalised.
    errors : (m,) array
        eta of each mode.
    converged : bool
    steps : int
    """

    squares: Array
    shapes: Array
    errors: Array
    converged: bool
    steps: int


@one_blas_thread
def lowest_modes(
    stiffness: Product, mass: Product, precondition: Product, start: Array, count: int,
    rigid: Array, *, tolerance: float, noise: Array, most: int = 60,
) -> Found:
    """The lowest elastic modes of a body.

    Parameters
    ----------
    stiffness, mass, precondition : callables
        K x, M x, and T x of vectors (n, k), T an approximate inverse of K.
    start : (n, k) array
        Start vectors, more than ``count``: the further ones speed up the convergence.
    count : int
        Number of modes.
    rigid : (n, r) array
        Mass-normalised rigid modes, which are left out.
    tolerance : float
        Largest eta.
    noise : (r,) array
        Energies ``(K z)^T T (K z)`` that rigid modes z have by round-off; residuals cannot become
        smaller.
    most : int
        Largest number of steps.
    """
    inertia = mass(rigid) if rigid.shape[1] else rigid
    floor = 4.0 * float(noise.max(initial=0.0))

    def elastic(x: Array) -> Array:
        return x - rigid @ (inertia.T @ x) if rigid.shape[1] else x

    X = elastic(start)
    MX = mass(X)
    X, MX = _normalised(X, MX)
    KX = stiffness(X)
    width = X.shape[1]
    squares, turn = eigh(X.T @ KX)
    # Modes X and changes P side by side, orthonormal in mass, their images, and K between them.
    S, KS, MS = X @ turn, KX @ turn, MX @ turn
    energies = np.diag(squares)
    errors = np.full(width, np.inf)
    step = 0
    for step in range(most + 1):
        residual = KS[:, :width] - MS[:, :width] * squares
        W = precondition(residual)
        errors = np.sqrt(np.abs(np.einsum("ij,ij->j", residual, W)) / squares)
        limit = np.clip(np.sqrt(floor / squares), tolerance, _WORST)
        # Guard vectors need no accuracy of their own, but help the last modes.
        active = errors > limit
        if not active[:count].any() or step == most or not np.isfinite(errors).all():
            break
        W = np.ascontiguousarray(W[:, active])
        for _ in range(2):
            W = elastic(W)
            W -= S @ (MS.T @ W)
        MW = mass(W)
        W, MW = _normalised(W, MW)
        KW = stiffness(W)
        squares, C, energies = _best(energies, S.T @ KW, W.T @ KW, width, active)
        # One after the other: two sets of three would be most of the memory.
        S = _combined(S, W, C)
        KS = _combined(KS, KW, C)
        MS = _combined(MS, MW, C)
    converged = bool((errors[:count] <= limit[:count]).all())
    return Found(squares[:count], S[:, :count], errors[:count], converged, step)


def _combined(one: Array, new: Array, C: Array) -> Array:
    found = one @ C[: one.shape[1]]
    found += new @ C[one.shape[1] :]
    return found


def _best(
    known: Array, cross: Array, fresh: Array, width: int, active: Any
) -> tuple[Array, Array, Array]:
    """The lowest modes in an orthonormal span, and the changes that lead to them.

    ``known`` (s, s), ``cross`` (s, w) and ``fresh`` (w, w) are the stiffness in the span of the
    present modes and changes and of the new vectors. Returns squared frequencies (k,),
    coefficients (s + w, k + p) of the next modes and changes, and the stiffness between them. The
    changes, the parts of the active modes outside of the present ones, are made orthonormal to the
    modes here, at no cost.
    """
    K = np.block([[known, cross], [cross.T, fresh]])
    values, vectors = eigh(0.5 * (K + K.T))
    C = vectors[:, :width]
    changes = C[:, active].copy()
    changes[:width] = 0.0
    for _ in range(2):
        changes -= C @ (C.T @ changes)
    directions, sizes, _ = np.linalg.svd(changes, full_matrices=False)
    changes = directions[:, sizes > 1e-10 * sizes[0]]
    changes -= C @ (C.T @ changes)
    changes = np.linalg.qr(changes)[0]
    C = np.hstack([C, changes])
    return values[:width], C, C.T @ K @ C


def _normalised(X: Array, MX: Array, *others: Array) -> tuple[Array, ...]:
    """Mass-orthonormal columns of the same span, without those that depend on the others."""
    gram = X.T @ MX
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    gram = gram * np.outer(scale, scale)
    try:
        factor = np.linalg.cholesky(gram)
        if np.diag(factor).min() < 1e-5:
            raise np.linalg.LinAlgError
        inverse = solve_triangular(factor, np.eye(len(gram)), lower=True).T
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(gram)
        kept = values > 1e-10 * values[-1]
        inverse = vectors[:, kept] / np.sqrt(values[kept])
    turn = scale[:, None] * inverse
    return tuple(one @ turn for one in (X, MX, *others))
