"""Modal bases from given mode shapes, and the normalisation of these."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.reduction.damping import Damping, LossFactor, Rayleigh
from fecontact.reduction.eigenmodes import fixed_signs
from fecontact.reduction.from_matrices import (
    basis_of_modes,
    check_recovery,
    given_matrix,
    inertia_of,
)
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.recovery import Recovery
from fecontact.reduction.restriction import stack_restriction

# Mode shapes are often written with five or six digits.
_EQUAL = 1e-4


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Normalisation:
    """Scaling and mass-orthogonality of mode shapes.

    Attributes
    ----------
    name : str
        'mass-normalised', 'largest component one', 'length one' (Euclidean) or 'other'.
    modal_masses : (m,) array
        ``s^T M s`` of each shape [kg, for shapes without a unit].
    worst_off_diagonal : float
        Largest ``|s_i^T M s_j|`` of two shapes after both are scaled to unit modal mass.
    worst_pair : (int, int)
        These two modes i < j, counted from 0; (0, 0) for a single mode.
    """

    name: str
    modal_masses: Array
    worst_off_diagonal: float
    worst_pair: tuple[int, int]


def normalisation(shapes: ArrayLike, mass: Any) -> Normalisation:
    """Determine how mode shapes are scaled.

    Parameters
    ----------
    shapes : (d, m) array
        One mode per column.
    mass : dense or sparse (d, d) array, or AssembledMatrix
        [kg].

    Raises
    ------
    InputError
        For arrays of wrong shape or with values that are not finite, and shapes without mass.
    """
    S = _shapes(shapes)
    given = given_matrix("mass", mass)
    if given.matrix.shape[0] != len(S):
        raise InputError(f"{given.name} must be {len(S)} x {len(S)}, as the shapes have {len(S)} "
                         f"rows, not {given.matrix.shape[0]} x {given.matrix.shape[0]}.")
    products = S.T @ (given.matrix @ S)
    masses = np.diag(products).copy()
    if (masses <= 0.0).any():
        mode = int(np.argmin(masses))
        raise InputError(f"Mode {mode} (counted from 0) has the modal mass {masses[mode]:.3g}; it "
                         f"must be above zero.")
    coupling = np.abs(products) / np.sqrt(np.outer(masses, masses))
    coupling[np.tril_indices(len(masses))] = 0.0
    first, second = np.unravel_index(int(np.argmax(coupling)), coupling.shape)
    scales = {
        "mass-normalised": masses,
        "largest component one": np.abs(S).max(axis=0),
        "length one": np.linalg.norm(S, axis=0),
    }
    name = next((name for name, scale in scales.items() if np.abs(scale - 1.0).max() < _EQUAL),
                "other")
    return Normalisation(name, masses, float(coupling[first, second]), (int(first), int(second)))


def basis_from_modes(
    shapes: ArrayLike,
    rows: Mapping[str, Any],
    *,
    frequencies_hz: ArrayLike | None = None,
    angular_frequencies: ArrayLike | None = None,
    mass: Any = None,
    modal_mass: ArrayLike | None = None,
    damping: Damping = 0.0,
    orthogonality: float = 1e-3,
    contact_x: ArrayLike | None = None,
    tributary: ArrayLike | None = None,
    thickness: float | None = None,
    translations: ArrayLike | None = None,
    dimension: Literal[2, 3] = 2,
    contact_places: ArrayLike | None = None,
    recovery: Recovery | None = None,
) -> ModalBasis:
    """Modal basis from computed or measured mode shapes.

    The shapes are scaled to unit modal mass, sorted by frequency, and given fixed signs;
    :func:`normalisation` determines their original scaling.

    Parameters
    ----------
    shapes : (d, m) array
        Real mode shapes, one per column.
    rows : mapping
        See :func:`~fecontact.basis_from_matrices`.
    frequencies_hz, angular_frequencies : (m,) array
        One of the two [Hz, rad/s]; exactly zero for rigid modes.
    mass : dense or sparse (d, d) array, or AssembledMatrix
        Mass matrix [kg], for the scale of the shapes and a check of their orthogonality.
    modal_mass : float or (m,) array
        Modal masses, instead of a mass matrix; 1 for mass-normalised shapes.
    damping : float, (m,) sequence, Rayleigh, LossFactor or (m, m) array
        Ratios in the order of the shapes, Rayleigh factors, a loss factor, or the modal
        damping matrix of the mass-normalised shapes [1/s].
    orthogonality : float
        Largest accepted product ``|s_i^T M s_j|`` of two mass-normalised shapes.
    contact_x, tributary, thickness, dimension, contact_places, recovery : optional
        See :func:`~fecontact.basis_from_matrices`.
    translations : (2, d) array, in space (3, d), optional
        Likewise; needs the mass matrix.

    Raises
    ------
    InputError
        For arrays of wrong shape, and for shapes that are complex or not mass-orthogonal.
    """
    S = _shapes(shapes)
    d, m = S.shape
    check_recovery(recovery, d, dimension)
    w = _frequencies(frequencies_hz, angular_frequencies, m)
    if (mass is None) == (modal_mass is None):
        raise InputError("Give either mass, the mass matrix, or modal_mass, the modal masses of "
                         "the shapes (1 for mass-normalised ones).")
    if translations is not None and mass is None:
        raise InputError("translations need mass, the mass matrix, for the inertia of the body; "
                         "give it instead of modal_mass.")
    inertia = None if mass is None else inertia_of(
        given_matrix("mass", mass).matrix, translations, dimension)
    if mass is not None:
        found = normalisation(S, mass)
        masses = found.modal_masses
        if found.worst_off_diagonal > orthogonality:
            i, j = found.worst_pair
            raise InputError(
                f"The modes are not mass-orthogonal: modes {i} and {j} (counted from 0) have the "
                f"product {found.worst_off_diagonal:.3g}, more than {orthogonality:g}; look "
                f"for another order of the degrees of freedom or another mass matrix, or raise "
                f"orthogonality for measured modes."
            )
    else:
        masses = np.asarray(modal_mass, dtype=float)
        if masses.shape not in ((), (m,)) or not (np.isfinite(masses) & (masses > 0.0)).all():
            raise InputError(f"modal_mass must be one number or {m} numbers (one per mode), finite "
                             f"and above zero, not {modal_mass!r}.")
    S = S / np.sqrt(masses)
    signs = fixed_signs(S)
    order = np.argsort(w, kind="stable")
    return basis_of_modes(
        w[order], (S * signs)[:, order], stack_restriction(rows, d, dimension),
        contact_x=contact_x, contact_places=contact_places, tributary=tributary,
        thickness=thickness, damping=_reordered(damping, order, signs), inertia=inertia,
        recovery=recovery)


def _shapes(shapes: ArrayLike) -> Array:
    if np.iscomplexobj(shapes):
        raise InputError("Mode shapes are complex; give real ones, as for an undamped system.")
    S = np.asarray(shapes, dtype=float)
    if S.ndim != 2 or 0 in S.shape:
        raise InputError(f"Mode shapes must have shape (d, m), one mode a column, not {S.shape}.")
    if not np.isfinite(S).all():
        raise InputError("Mode shapes hold values that are not finite.")
    return S


def _frequencies(hz: ArrayLike | None, angular: ArrayLike | None, m: int) -> Array:
    if (hz is None) == (angular is None):
        raise InputError("Give either frequencies_hz [Hz] or angular_frequencies [rad/s].")
    w = np.asarray(angular, dtype=float) if hz is None else 2.0 * np.pi * np.asarray(hz, float)
    if w.shape != (m,) or not (np.isfinite(w) & (w >= 0.0)).all():
        given = hz if angular is None else angular
        raise InputError(f"The frequencies must be {m} finite numbers of at least zero, one per "
                         f"mode (a column of the shapes), not {given!r}.")
    return w


def _reordered(damping: Damping, order: Integers, signs: Array) -> Damping:
    """Damping of the modes after reordering and sign changes."""
    if isinstance(damping, (LossFactor, Rayleigh)):
        return damping
    values = np.asarray(damping, dtype=float)
    if values.shape == (len(order),):
        return values[order]
    if values.shape == (len(order),) * 2:
        return np.asarray((values * np.outer(signs, signs))[np.ix_(order, order)])
    return damping
