"""Rigid modes of a stiffness matrix without geometry: displacements without strain energy.

A displacement r is rigid if its strain energy is below the round-off of its computation:
``r^T K r <= 1e-15 |r|^T |K| |r|``. An elastic mode below this limit could not be computed from
the matrix either.
"""

from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers

_ROUND_OFF = 1e-15
_DENSE = 600
# More than half this number of rigid modes is an error.
_MANY = 1000


def relative_energies(K: Any, shapes: Array) -> Array:
    """``r^T K r / |r|^T |K| |r|`` (k,) of displacements (d, k); zero where K is."""
    terms = (np.abs(shapes) * (abs(K) @ np.abs(shapes))).sum(axis=0)
    energies = (shapes * (K @ shapes)).sum(axis=0)
    return np.divide(energies, terms, out=np.zeros_like(terms), where=terms > 0.0)


def lowest_vectors(K: Any, M: Any, name: str, rigid: int | None) -> Array:
    """Approximate null space (d, r) of K, of given or detected dimension.

    Parameters
    ----------
    K, M : sparse (d, d) arrays
        Symmetric; M positive definite.
    name : str
        Name of K in messages.
    rigid : int or None
        Number of vectors; None to detect it.

    Raises
    ------
    InputError
        If K is not positive semi-definite, or the number is out of range.
    """
    d = K.shape[0]
    if rigid is not None and (isinstance(rigid, bool) or not isinstance(rigid, (int, np.integer))
                              or not 0 <= rigid <= d):
        raise InputError(f"rigid = {rigid!r} must be None or a whole number from 0 to the number "
                         f"of degrees of freedom, {d}.")
    values, vectors = (_dense if d <= _DENSE else _sparse)(K, M, rigid, name)
    energies = relative_energies(K, vectors)
    free = int(np.count_nonzero(energies <= _ROUND_OFF))
    if rigid is None and energies.min(initial=0.0) < -_ROUND_OFF:
        raise _not_definite(name, f"its lowest eigenvalue relative to the mass is "
                                  f"{values.min():.3e} 1/s^2")
    if rigid is not None and free > rigid:
        raise InputError(f"rigid = {rigid}, but {name[0].lower()}{name[1:]} leaves {free} "
                         f"displacements without resistance.")
    return vectors[:, :free if rigid is None else int(rigid)]


def null_space(K: Any, M: Any, vectors: Array) -> Array:
    """Mass-normalised null space (d, r) of K from approximate vectors (d, r).

    r degrees of freedom support the body isostatically; the null space is the static response to
    their unit displacements. It depends on the matrices only, not on the starting vectors.
    """
    d, count = vectors.shape
    if not count:
        return np.zeros((d, 0))
    supports = _supports(vectors)
    held = np.setdiff1d(np.arange(d), supports)
    found = np.zeros((d, count))
    found[supports] = np.eye(count)
    if held.size:
        factors = symmetric_factors(K[held][:, held].tocsc())
        for _ in range(2):
            found[held] -= factors.solve(np.ascontiguousarray((K @ found)[held]))
    for column in range(count):
        for _ in range(2):
            earlier = found[:, :column]
            found[:, column] -= earlier @ (earlier.T @ (M @ found[:, column]))
        found[:, column] /= np.sqrt(found[:, column] @ (M @ found[:, column]))
    return found


def symmetric_factors(matrix: Any) -> Any:
    """Factors of a sparse symmetric matrix with pivots on its diagonal."""
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                options={"SymmetricMode": True})


def _supports(vectors: Array) -> Integers:
    """Degrees of freedom (r,) that fix r vectors (d, r); the first of nearly equal ones."""
    left = vectors.copy()
    chosen = []
    for _ in range(vectors.shape[1]):
        size = np.linalg.norm(left, axis=1)
        first = int(np.argmax(size >= 0.9 * size.max()))
        chosen.append(first)
        direction = left[first] / size[first]
        left -= np.outer(left @ direction, direction)
    return np.array(chosen)


def _dense(K: Any, M: Any, rigid: int | None, name: str) -> tuple[Array, Array]:
    from scipy.linalg import eigh

    full, mass = K.toarray(), M.toarray()
    values = eigh(full, mass, eigvals_only=True)
    count = max(int(rigid or 0), int(np.count_nonzero(values <= 1e-9 * np.abs(values).max())))
    if not count:
        return values[:0], np.zeros((len(full), 0))
    return eigh(full, mass, subset_by_index=[0, count - 1])


def _sparse(K: Any, M: Any, rigid: int | None, name: str) -> tuple[Array, Array]:
    """Lowest eigenpairs by block inverse iteration, which also finds multiple ones."""
    d = K.shape[0]
    largest = float((K.diagonal() / M.diagonal()).max())
    if largest <= 0.0 and K.nnz and abs(K).max() > 0.0:
        raise _not_definite(name, "its diagonal is not positive anywhere")
    # Well above round-off, below the squares of frequencies that can be resolved.
    shift = (largest or 1.0) * (1e-13 if rigid is None else 1e-8)
    factors = symmetric_factors((K + shift * M).tocsc())
    negative = int(np.count_nonzero(factors.U.diagonal() < 0.0))
    if negative:
        raise _not_definite(name, f"it has {negative} negative eigenvalue{'s' * (negative > 1)}")
    random = np.random.default_rng(0)
    count = 8 if rigid is None else int(rigid) + 4
    while count <= min(d, _MANY):
        vectors = random.standard_normal((d, count))
        for _ in range(5):
            values, vectors = _ritz(K, M, factors.solve(np.asarray(M @ vectors)))
        if rigid is not None or relative_energies(K, vectors)[-1] > _ROUND_OFF:
            return values, vectors
        count *= 2
    if d <= _MANY:
        return _dense(K, M, rigid, name)
    raise InputError(f"{name} leaves more than {_MANY // 2} displacements without resistance; "
                     f"leave out degrees of freedom without stiffness.")


def _ritz(K: Any, M: Any, vectors: Array) -> tuple[Array, Array]:
    """Ascending Ritz values (k,) and mass-normalised vectors (d, k) of a span."""
    from scipy.linalg import eigh

    vectors = np.linalg.qr(vectors)[0]
    values, turn = eigh(vectors.T @ (K @ vectors), vectors.T @ (M @ vectors))
    return values, vectors @ turn


def _not_definite(name: str, what: str) -> InputError:
    return InputError(f"{name} is not positive semi-definite: {what}; if it was written with few "
                      f"digits or condensed, say how many modes are rigid (rigid=3 for a free "
                      f"plane body), else look for a preload or a wrong sign.")
