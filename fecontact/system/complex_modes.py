"""Complex modes of linearised equations: eigenvalues, right and left eigenvectors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, ComplexArray, Integers
from fecontact.core.units import Summarised, span
from fecontact.reduction.modal_basis import ModalBasis

# Eigenvalues nearer than this, relative to the largest, share a space of eigenvectors.
_REPEATED = 1e-9
# Imaginary part, relative to the largest eigenvalue, that is rounding.
_ROUNDED = 1e-13
# Overlap of left and right eigenvectors below which there is no full set of them.
_DEFECTIVE = 1e-14


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ComplexModes(Summarised):
    """Complex modes of x' = A x, one for each pair l = -D w +- i w sqrt(1 - D^2).

    As in brake-squeal analysis. Right eigenvectors r, ``A r = l r``, are the shapes; left ones s,
    ``s^T A = l s^T`` without conjugation, say how strongly forces excite a mode and how it changes
    with the parameters. They are biorthonormal, ``left.T @ right = 1``.

    Attributes
    ----------
    eigenvalues : (r,) complex array
        Eigenvalues with imaginary part above zero, the lowest frequency first [1/s].
    frequencies_hz : (r,) array
        Im l / (2 pi) [Hz].
    damping_ratios : (r,) array
        D = -Re l / |l|; negative for a mode that grows, the flutter mode.
    right : (d, r) complex array
        Right eigenvectors of the state [q, q', z], of length one, the largest entry real and
        positive.
    left : (d, r) complex array
        Left eigenvectors, scaled to ``left.T @ right = 1``; NaN where modes coincide so that there
        is no full set, exactly at the onset of undamped flutter.
    real_eigenvalues : array
        Eigenvalues without a frequency [1/s], the largest first.
    """

    eigenvalues: ComplexArray
    frequencies_hz: Array
    damping_ratios: Array
    right: ComplexArray
    left: ComplexArray
    real_eigenvalues: Array

    @classmethod
    def of(
        cls, matrix: ArrayLike, *, within: Array | None = None, zero: float = 0.0
    ) -> "ComplexModes":
        """The modes of a real square matrix A (d, d).

        Parameters
        ----------
        matrix : (d, d) array
            A.
        within : (d, k) array, optional
            Orthonormal columns that span the states which constraints allow.
        zero : float
            Part of the largest frequency up to which eigenvalues count as zero: rigid modes are
            double roots, which rounding parts.

        Raises
        ------
        InputError
            If it is not square, or holds values that are not finite.
        """
        from scipy.linalg import eig

        A = np.asarray(matrix, dtype=float)
        if A.ndim != 2 or A.shape[0] != A.shape[1] or not np.isfinite(A).all():
            raise InputError(f"Complex modes need a square matrix of finite numbers, not an array "
                             f"of shape {A.shape}{'' if np.isfinite(A).all() else ' with others'}.")
        free = np.eye(len(A)) if within is None else within
        eigenvalues, left, right = eig(free.T @ A @ free, left=True)
        left, right = free @ left, free @ right
        # Fast decays, such as those of sliders without normal force, say nothing on frequencies.
        largest, size = (np.abs(part).max(initial=0.0) for part in (eigenvalues, eigenvalues.imag))
        size = size if size > _ROUNDED * largest else largest
        eigenvalues = np.where(np.abs(eigenvalues) <= zero * size, 0.0, eigenvalues)
        chosen = np.flatnonzero(eigenvalues.imag > 0.0)
        # Frequencies that coincide in flutter differ by rounding; the growing one comes first.
        frequencies = np.round(eigenvalues[chosen].imag / (_REPEATED * size or 1.0))
        chosen = chosen[np.lexsort((-eigenvalues[chosen].real, frequencies))]
        found = np.asarray(eigenvalues[chosen], dtype=complex)
        shapes = right[:, chosen].astype(complex)
        if len(chosen):
            leading = shapes[np.abs(shapes).argmax(axis=0), np.arange(len(chosen))]
            shapes = shapes * (np.abs(leading) / leading)
        duals = _biorthonormal(left[:, chosen].conj().astype(complex), shapes, found,
                               _REPEATED * size)
        real = np.sort(eigenvalues[eigenvalues.imag == 0.0].real)[::-1]
        return cls(found, found.imag / (2.0 * np.pi), -found.real / np.abs(found), shapes, duals,
                   real)

    def summary(self) -> list[tuple[str, str]]:
        """Numbers of modes, their frequencies and damping, and those that grow."""
        return [
            ("modes", f"{len(self.eigenvalues)}, {len(self.real_eigenvalues)} real eigenvalues"),
            ("frequencies", span(self.frequencies_hz, "Hz")),
            ("damping ratios", span(self.damping_ratios)),
            ("growing", ", ".join(f"{value:.5g} Hz" for value in self.growing()) or "none"),
        ]

    @property
    def condition(self) -> Array:
        """Condition numbers |left| |right| (r,) of the eigenvalues: one for normal matrices.

        A change of A moves an eigenvalue by at most this times its norm; infinite at the onset of
        undamped flutter, where two modes coincide.
        """
        size = np.linalg.norm(self.left, axis=0) * np.linalg.norm(self.right, axis=0)
        return np.asarray(np.where(np.isnan(size), np.inf, size))

    def sensitivity(self, derivative: ArrayLike) -> ComplexArray:
        """Derivatives (r,) of the eigenvalues, s^T (dA/dp) r, from dA/dp (d, d).

        Raises
        ------
        InputError
            If it does not have the shape of A.
        """
        change = np.asarray(derivative, dtype=float)
        d = len(self.right)
        if change.shape != (d, d):
            raise InputError(f"The derivative of the matrix must have shape ({d}, {d}), not "
                             f"{change.shape}.")
        return np.asarray(np.einsum("ik,ij,jk->k", self.left, change, self.right))

    def displacement(self, basis: ModalBasis, mode: int) -> ComplexArray:
        """Complex displacement (points, 3) of one mode at B, C, the contact and further points."""
        return np.asarray(basis.T @ self.right[: basis.modes, mode])

    @property
    def grows(self) -> NDArray[np.bool_]:
        """Whether each mode grows (r,); real parts of the size of round-off count as zero."""
        size = np.abs(self.eigenvalues)
        largest = max(size.max(initial=0.0), np.abs(self.real_eigenvalues).max(initial=0.0))
        return np.asarray(self.eigenvalues.real > 1e-10 * size + 1e-13 * largest)

    def growing(self) -> Array:
        """Frequencies of the modes that grow [Hz]."""
        return self.frequencies_hz[self.grows]


def followed(eigenvalues: ComplexArray) -> ComplexArray:
    """Eigenvalues (N, d), sorted so that each column follows one mode from point to point.

    Each is taken to go on in a straight line, so that lines that cross stay apart.
    """
    from scipy.optimize import linear_sum_assignment

    result = eigenvalues.copy()
    for k in range(1, len(result)):
        ahead = 2.0 * result[k - 1] - result[k - 2] if k > 1 else result[0]
        distance = np.abs(ahead[:, None] - eigenvalues[k][None, :])
        result[k] = eigenvalues[k][linear_sum_assignment(distance)[1]]
    return result


def _biorthonormal(
    left: ComplexArray, right: ComplexArray, eigenvalues: ComplexArray, near: float
) -> ComplexArray:
    """Left eigenvectors (d, r) combined within repeated eigenvalues so that left^T right = 1."""
    found = np.full(left.shape, np.nan + 0j)
    rest = list(range(len(eigenvalues)))
    while rest:
        group = [k for k in rest if abs(eigenvalues[k] - eigenvalues[rest[0]]) <= near]
        rest = [k for k in rest if k not in group]
        overlap = left[:, group].T @ right[:, group]
        if np.linalg.svd(overlap, compute_uv=False)[-1] > _DEFECTIVE:
            found[:, group] = left[:, group] @ np.linalg.inv(overlap).T
    return found


def sorted_eigenvalues(jacobian: Array) -> ComplexArray:
    """Eigenvalues (d,), the largest real part first, pairs with the positive frequency first."""
    found = np.linalg.eigvals(jacobian).astype(complex)
    return np.asarray(found[np.lexsort((-found.imag, -found.real))])


def unstable_count(eigenvalues: ComplexArray) -> Integers:
    """Number (...) of eigenvalues (..., d) with positive real parts.

    Real parts below 1e-10 of the eigenvalue, or 1e-13 of the largest one, count as zero: those of
    undamped modes and of rigid ones are round-off.
    """
    size = np.abs(eigenvalues)
    least = 1e-10 * size + 1e-13 * size.max(axis=-1, keepdims=True)
    return np.asarray((eigenvalues.real > least).sum(axis=-1))
