"""The saddle of a homoclinic orbit: its invariant subspaces, leading eigenvalues and linear flow.

All vectors are in units of the scales of the states.
"""

from dataclasses import dataclass

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, ComplexArray

# Part of the vector that the eigenvectors must give back for their flow to be used.
_REPRODUCED = 0.1
# Largest imaginary part, relative to the modulus, of an eigenvalue that counts as real.
_REAL = 1e-12


@dataclass(frozen=True, eq=False)
class Saddle:
    """Eigenvalues of a saddle, those next to the imaginary axis first.

    Attributes
    ----------
    jacobian : (d, d) array
    stable, unstable : (n,) complex arrays
        Eigenvalues with negative and with positive real parts.
    """

    jacobian: Array
    stable: ComplexArray
    unstable: ComplexArray

    @property
    def rates(self) -> tuple[float, float]:
        """Rates at which orbits leave it and approach it, those of the leading eigenvalues."""
        return float(self.unstable[0].real), -float(self.stable[0].real)


def saddle_of(jacobian: Array) -> Saddle:
    """The saddle with this Jacobian.

    Raises
    ------
    AnalysisError
        If it is none: all eigenvalues lie on one side of the imaginary axis, or one on it.
    """
    found = np.linalg.eigvals(jacobian).astype(complex)
    order = found[np.lexsort((-found.imag, np.abs(found.real)))]
    stable, unstable = order[order.real < 0.0], order[order.real > 0.0]
    if not len(stable) or not len(unstable) or len(stable) + len(unstable) < len(found):
        raise AnalysisError("The equilibrium of the homoclinic orbit is no saddle there.")
    return Saddle(jacobian, stable, unstable)


def left_subspaces(jacobian: Array) -> tuple[Array, Array]:
    """Orthonormal rows that span the left invariant subspaces, stable (n, d) and unstable (m, d).

    The first vanish on the unstable subspace, the others on the stable one.
    """
    from scipy.linalg import schur

    found = []
    for side in ("lhp", "rhp"):
        _, basis, count = schur(jacobian.T, sort=side)
        found.append(basis[:, :count].T)
    return found[0], found[1]


def like(rows: Array, reference: Array) -> Array:
    """The basis L of the same subspace with L R^T = 1, smooth where the subspace is.

    Raises
    ------
    AnalysisError
        If the subspace has another dimension, or a direction at right angles to the reference R.
    """
    if rows.shape != reference.shape:
        raise AnalysisError("The saddle of the homoclinic orbit has an eigenvalue zero nearby.")
    try:
        return np.asarray(np.linalg.solve(rows @ reference.T, rows))
    except np.linalg.LinAlgError:
        raise AnalysisError("The subspaces of the saddle turn too far in one step.") from None


def leading_rows(jacobian: Array, eigenvalue: complex) -> tuple[Array, Array] | None:
    """Left and right eigenvectors (d,) of a leading eigenvalue; None if that is not real.

    The left one has the length one, their product is one.
    """
    if abs(eigenvalue.imag) > _REAL * abs(eigenvalue):
        return None
    found = []
    for matrix in (jacobian.T, jacobian):
        values, vectors = np.linalg.eig(matrix)
        found.append(vectors[:, int(np.argmin(np.abs(values - eigenvalue)))].real)
    row = found[0] / np.linalg.norm(found[0])
    return row, found[1] / float(row @ found[1])


def flown(saddle: Saddle, away: Array, times: Array, leaving: bool) -> Array:
    """Linear motion (k, d) along the unstable (leaving) or stable subspace, from ``away`` at 0."""
    values, vectors = np.linalg.eig(saddle.jacobian.astype(complex))
    parts = np.linalg.lstsq(vectors, away.astype(complex), rcond=None)[0]
    others = (values.real > 0.0) != leaving
    parts[others], values[others] = 0.0, 0.0
    begin = (vectors @ parts).real
    if np.linalg.norm(begin - away) > _REPRODUCED * np.linalg.norm(away):
        rate = saddle.rates[0] if leaving else -saddle.rates[1]
        return np.asarray(np.exp(rate * times)[:, None] * away)
    return np.asarray(((parts * np.exp(times[:, None] * values)) @ vectors.T).real)


def discriminant(leading: ComplexArray) -> float | None:
    """(a - b)^2 / |a|^2 of the two leading eigenvalues a, b; None if there is no second one.

    It is negative for a complex pair, whose transition to real ones is a zero.
    """
    if len(leading) < 2:
        return None
    first, second = leading[:2]
    return float(((first - second) ** 2).real / abs(first) ** 2)
