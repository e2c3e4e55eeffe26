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

import numpy as np
from scipy.linalg import eigh, solve_triangular

from fecontact.core.types import Array

Product = Callable[[Array], Array]


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


def lowest_modes(
    stiffness: Product, mass: Product, precondition: Product, start: Array, count: int,
    rigid: Array, tolerance: float, noise: Array, most: int = 60,
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
    squares, turn = eigh(X.T @ KX)
    X, KX, MX = X @ turn, KX @ turn, MX @ turn
    P = KP = MP = X[:, :0]
    errors = np.full(X.shape[1], np.inf)
    step = 0
    for step in range(most + 1):
        residual = KX - MX * squares
        W = precondition(residual)
        energies = np.einsum("ij,ij->j", residual, W)
        errors = np.sqrt(np.abs(energies) / squares)
        limit = np.maximum(tolerance, np.sqrt(floor / squares))
        # Guard vectors need no accuracy of their own, but help the last modes.
        active = errors > limit
        if not active[:count].any() or step == most or not np.isfinite(errors).all():
            break
        W = np.ascontiguousarray(W[:, active])
        for _ in range(2):
            W = elastic(W)
            W -= X @ (MX.T @ W)
        MW = mass(W)
        W, MW = _normalised(W, MW)
        KW = stiffness(W)
        if P.shape[1]:
            cross = MW.T @ P
            P, KP, MP = P - W @ cross, KP - KW @ cross, MP - MW @ cross
            P, MP, KP = _normalised(P, MP, KP)
        squares, X, KX, MX, P, KP, MP = _best(squares, X, KX, MX, W, KW, MW, P, KP, MP, active)
    converged = bool((errors[:count] <= limit[:count]).all())
    return Found(squares[:count], X[:, :count], errors[:count], converged, step)


def _best(squares, X, KX, MX, W, KW, MW, P, KP, MP, active):
    """The lowest modes in the span of X, W and P, and the changes that lead to them."""
    k, w = X.shape[1], W.shape[1]
    size = k + w + P.shape[1]
    K, M = np.empty((size, size)), np.eye(size)
    parts = ((X, KX, MX), (W, KW, MW), (P, KP, MP))
    starts = (0, k, k + w, size)
    for i in range(3):
        for j in range(i, 3):
            rows, columns = slice(starts[i], starts[i + 1]), slice(starts[j], starts[j + 1])
            K[rows, columns] = np.diag(squares) if i == j == 0 else parts[i][0].T @ parts[j][1]
            if i != j:
                M[rows, columns] = parts[i][0].T @ parts[j][2]
    K, M = np.triu(K) + np.triu(K, 1).T, np.triu(M) + np.triu(M, 1).T
    values, C = eigh(K, M, subset_by_index=[0, k - 1])
    changes = C[k:, active]
    following = []
    for x, fresh, last in zip(*parts, strict=True):
        change = fresh @ changes[:w]
        best = x @ C[:k]
        best += fresh @ C[k : k + w]
        if last.shape[1]:
            change += last @ changes[w:]
            best += last @ C[k + w :]
        following.append((best, change))
    (X, P), (KX, KP), (MX, MP) = following
    return values, X, KX, MX, P, KP, MP


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
