"""Modal bases from mass and stiffness matrices of other programs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_floats, require_flags, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.reduction.damping import Damping, LossFactor, Rayleigh, modal_damping
from fecontact.reduction.eigenmodes import FreeSystem, fixed_signs, free_modes
from fecontact.reduction.matrix_files import AssembledMatrix
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.recovery import Recovery
from fecontact.reduction.restriction import Restriction, stack_restriction
from fecontact.reduction.static_modes.null_space import (
    lowest_vectors,
    null_space,
    relative_energies,
)

# Up to this size all modes are kept by default.
_ALL = 2000
# Below this size the dense solver is faster, as in fecontact.reduction.eigenmodes.
_DENSE = 600
# Abaqus writes 1e36 on the diagonal of the stiffness for boundary conditions.
_HELD = 1e35
_DECLARE = ("; give both triangles of a symmetric matrix, or symmetric=False if its skew part "
            "stands for circulatory forces")
_ASYMMETRY = 1e-10


@dataclass(frozen=True, eq=False)
class Given:
    """A square matrix as given: entries, and names of matrix and rows for messages."""

    name: str
    matrix: Any
    labels: Integers | None

    def dof(self, number: int) -> str:
        """A degree of freedom in words."""
        if self.labels is None:
            return f"degree of freedom {number} (counted from 0)"
        node, direction = self.labels[number]
        return f"node {node}, direction {direction}"

    def without(self, dofs: NDArray[np.bool_]) -> "Given":
        """The matrix without the marked degrees of freedom."""
        labels = None if self.labels is None else self.labels[~dofs]
        return replace(self, matrix=self.matrix[~dofs][:, ~dofs].tocsc(), labels=labels)


def basis_from_matrices(
    mass: Any,
    stiffness: Any,
    rows: Mapping[str, Any],
    *,
    damping: Any = 0.0,
    modes: int | None = None,
    rigid: int | None = None,
    contact_x: ArrayLike | None = None,
    tributary: ArrayLike | None = None,
    thickness: float | None = None,
    translations: ArrayLike | None = None,
    dimension: Literal[2, 3] = 2,
    contact_places: ArrayLike | None = None,
    symmetric: bool = True,
    recovery: Recovery | None = None,
) -> ModalBasis:
    """Modal basis of given matrices, for bodies meshed elsewhere or chains of masses.

    Modes of the symmetric part of the stiffness; :attr:`ModalBasis.stiffness` has the skew part.

    Parameters
    ----------
    mass, stiffness : dense or sparse (d, d) arrays, or AssembledMatrix
        Mass, symmetric and positive definite [kg]; stiffness with positive semi-definite symmetric
        part [N/m]. Diagonal entries of 1e35 or more fix a degree of freedom.
    rows : mapping
        ``contact``: displacements x, y and rotation of the n contact nodes as linear functions of
        the d degrees of freedom, (n, 3, d), sparse (3 n, d) or n sparse (3, d); for several contact
        groups a mapping of their names to such rows; none for a body that touches nothing. ``B``,
        ``C`` and further named points: (3, d), zero by default. Two rows, x and y, mean no
        rotation; in space six, or three. See :func:`fecontact.reduction.rows_from_dofs`.
    damping : float, (m,) sequence, Rayleigh, LossFactor or (d, d) array
        Ratios of the modes, factors, or the damping matrix in the given degrees of freedom [N s/m],
        whose skew part is gyroscopic.
    modes : int, optional
        Number m of modes, lowest first, rigid ones included; by default all, up to d = 2000.
    rigid : int, optional
        Number of rigid modes; by default determined from the stiffness.
    contact_x, contact_places, tributary : (n,), (n, 2 or 3), (n,) arrays, optional
        Abscissae or places (default zero) and lengths (default equal, of sum one; in space areas)
        of the contact nodes [m, m^2].
    thickness : float, optional
        Out-of-plane thickness of the contact face [m], for pressures; not in space.
    translations : (2, d) array, in space (3, d), optional
        The degrees of freedom in unit translations, fixed ones too; for gravity and base motion.
    dimension : 2 or 3
        3 for space.
    symmetric : bool
        False allows a stiffness with a skew (circulatory) part above 1e-10 of the largest entry.
    recovery : Recovery, optional
        Displacements of a body's nodes, where the points of the basis then lie, for pictures.

    Raises
    ------
    InputError
        For matrices of other kinds or sizes than these, and rows of wrong width.
    AnalysisError
        If the modes cannot be computed accurately.
    """
    require_flags("basis_from_matrices", symmetric=symmetric)
    M, K = given_matrix("mass", mass), given_matrix("stiffness", stiffness)
    same_dofs(M, K)
    d = M.matrix.shape[0]
    C = _damping_matrix(damping, M)
    given = stack_restriction(rows, d, dimension)
    inertia = inertia_of(M.matrix, translations, dimension)
    check_recovery(recovery, d, dimension)
    held = K.matrix.diagonal() >= _HELD
    if held.all():
        raise InputError(f"{K.name} holds every degree of freedom (entries of 1e35 or more).")
    if held.any():
        M, K = M.without(held), K.without(held)
        given = replace(given, restriction=given.restriction[:, ~held])
        C = None if C is None else C[~held][:, ~held]
        inertia = None if inertia is None else inertia[~held]
        recovery = None if recovery is None else recovery.without(held)
        d = M.matrix.shape[0]
    M, (K, skew) = _symmetric(M), _parts(_symmetric(K, _DECLARE) if symmetric else K)
    _require_positive_mass(M)
    w, shapes = _modes(K, M, _count(modes, d), rigid)
    return basis_of_modes(
        w, shapes, given, contact_x=contact_x, contact_places=contact_places,
        tributary=tributary, thickness=thickness, inertia=inertia, recovery=recovery,
        stiffness=None if skew is None else np.diag(w**2) + shapes.T @ (skew @ shapes),
        damping=damping if C is None else np.asarray(shapes.T @ (C @ shapes)))


def basis_of_modes(
    w: Array, shapes: Array, rows: Restriction, *, damping: Damping, contact_x: ArrayLike | None,
    tributary: ArrayLike | None, thickness: float | None, inertia: Array | None = None,
    stiffness: Array | None = None, contact_places: ArrayLike | None = None,
    recovery: Recovery | None = None,
) -> ModalBasis:
    """Modal basis of modes (d, m) from rows of the points, without geometry but for a recovery.

    ``inertia`` (d, 2) are forces of unit accelerations in x and y, in space (d, 3), see
    :func:`inertia_of`.
    """
    n, dimension = rows.contact_nodes, rows.dimension
    T = np.asarray(rows.restriction @ shapes).reshape(-1, 3 * (dimension - 1), len(w))
    positions = np.zeros((len(T), dimension)) if recovery is None else recovery.places(
        rows.restriction)
    if contact_places is not None:
        positions[2 : 2 + n] = _places(contact_places, contact_x, n, dimension)
    elif recovery is None or contact_x is not None:
        positions[2 : 2 + n, 0] = _per_node("contact_x", 0.0 if contact_x is None else contact_x, n)
    return ModalBasis(
        angular_frequencies=w,
        damping=modal_damping(damping, w),
        T=T,
        positions=positions,
        tributary=_per_node("tributary", 1.0 / max(n, 1) if tributary is None else tributary, n),
        extra=rows.extra,
        mode_shapes=None if recovery is None else recovery.mode_shapes(shapes, rows.restriction),
        groups=rows.groups,
        thickness=thickness,
        inertia_rows=None if inertia is None else inertia.T @ shapes,
        stiffness=stiffness,
    )


def check_recovery(recovery: Recovery | None, dofs: int, dimension: int) -> None:
    """Raise InputError for a recovery of another number of degrees of freedom, or dimension."""
    require_kind("recovery", (Recovery, type(None)), recovery=recovery)
    if recovery is None:
        return
    recovery.require_columns(dofs)
    if recovery.body.dimension != dimension:
        raise InputError(f"The body of the recovery has {recovery.body.dimension} dimensions; give "
                         f"dimension={recovery.body.dimension}.")


def inertia_of(mass: Any, translations: ArrayLike | None, dimension: int = 2) -> Array | None:
    """Forces (d, 2) of unit accelerations in x and y, from unit translations (2, d), if given.

    In space (d, 3) from (3, d). InputError for another shape, or values that are not finite.
    """
    if translations is None:
        return None
    given, d = as_floats(translations, "translations"), mass.shape[0]
    if given.shape != (dimension, d) or not np.isfinite(given).all():
        axes = "in x and in y" if dimension == 2 else "in x, y and z"
        raise InputError(f"translations must be ({dimension}, {d}) finite numbers, the degrees of "
                         f"freedom in unit translations {axes}, not of shape {given.shape}.")
    return np.asarray(mass @ given.T)


def given_matrix(kind: str, given: Any) -> Given:
    """Convert a dense, sparse or assembled matrix to a sparse one.

    Raises
    ------
    InputError
        If it is complex, not square or not finite.
    """
    import scipy.sparse as sp

    name, labels = f"The {kind} matrix", None
    if isinstance(given, AssembledMatrix):
        name, labels, given = f"{name} ({given.source})", given.labels, given.matrix
    if not sp.issparse(given):
        try:
            array = np.asarray(given)
            array = array if array.dtype.kind == "c" else array.astype(float)
        except (TypeError, ValueError):
            raise InputError(f"{kind} must be an array of real numbers or a sparse matrix, not "
                             f"{shown(given)}.") from None
        given = array
    if given.ndim != 2 or given.shape[0] != given.shape[1] or not given.shape[0]:
        raise InputError(f"{name} must be square and not empty, not of shape {given.shape}.")
    if given.dtype.kind == "c":
        raise InputError(f"{name} is complex; give its real part (structural damping belongs into "
                         f"damping).")
    matrix = sp.csc_array(given, dtype=float)
    matrix.sum_duplicates()
    wrong = np.flatnonzero(~np.isfinite(matrix.data))
    if wrong.size:
        at = sp.coo_array(matrix)
        row, column = at.row[wrong[0]], at.col[wrong[0]]
        raise InputError(f"{name} holds values that are not finite, the first one in row {row}, "
                         f"column {column} (counted from 0).")
    return Given(name, matrix, labels)


def same_dofs(first: Given, second: Given) -> None:
    """Raise InputError unless both matrices have the same degrees of freedom."""
    if first.labels is not None and second.labels is not None:
        for owner, other in ((first, second), (second, first)):
            alone = _named(owner) - _named(other)
            if alone:
                node, direction = min(alone)
                raise InputError(f"{owner.name} has node {node}, direction {direction}, but "
                                 f"{_inside(other)} has not; write both from one model.")
        if (first.labels != second.labels).any():
            raise InputError(f"{first.name} and {_inside(second)} have their degrees of freedom "
                             f"in different orders.")
    if first.matrix.shape != second.matrix.shape:
        raise InputError(f"{second.name} must be square and of the mass matrix's size, "
                         f"{first.matrix.shape}, not {second.matrix.shape}.")


def _named(given: Given) -> set[tuple[int, ...]]:
    labels = np.empty((0, 2), int) if given.labels is None else given.labels
    return set(map(tuple, labels.tolist()))


def _inside(given: Given) -> str:
    """The name as used within a sentence."""
    return given.name[0].lower() + given.name[1:]


def _damping_matrix(damping: Any, mass: Given) -> Any:
    """The damping matrix in the given degrees of freedom; None for ratios or factors."""
    import scipy.sparse as sp

    matrix = isinstance(damping, AssembledMatrix) or sp.issparse(damping) or np.ndim(damping) == 2
    if not matrix or isinstance(damping, (Rayleigh, LossFactor)):
        return None
    given = given_matrix("damping", damping)
    if given.matrix.shape != mass.matrix.shape:
        raise InputError(f"{given.name} must have shape {mass.matrix.shape}, one row for each "
                         f"given degree of freedom, not {given.matrix.shape}.")
    same_dofs(mass, given)
    return given.matrix


def _parts(given: Given) -> tuple[Given, Any]:
    """The symmetric part of a matrix, and its skew part; None where that is rounding."""
    import scipy.sparse as sp

    skew = 0.5 * (given.matrix - given.matrix.T)
    if not skew.nnz or 2.0 * abs(skew).max() <= _ASYMMETRY * abs(given.matrix).max():
        skew = None
    return replace(given, matrix=sp.csc_array(0.5 * (given.matrix + given.matrix.T))), skew


def _symmetric(given: Given, remedy: str = "") -> Given:
    """The symmetric part of a matrix that must be symmetric up to rounding, else InputError."""
    import scipy.sparse as sp

    symmetric, skew = _parts(given)
    if skew is not None:
        difference, largest = sp.coo_array(abs(2.0 * skew)), float(abs(given.matrix).max())
        worst = int(np.argmax(difference.data))
        row, column = sorted((int(difference.row[worst]), int(difference.col[worst])))
        raise InputError(
            f"{given.name} is not symmetric: the entries in row {row}, column {column} "
            f"({given.matrix[row, column]:.6g}) and in row {column}, column {row} "
            f"({given.matrix[column, row]:.6g}), counted from 0, differ by "
            f"{difference.data[worst] / largest:.1e} of the largest entry{remedy}."
        )
    return symmetric


def _require_positive_mass(mass: Given) -> None:
    diagonal = mass.matrix.diagonal()
    lowest = int(np.argmin(diagonal))
    if diagonal[lowest] <= 0.0:
        raise InputError(
            f"{mass.name} is not positive definite: its diagonal entry at {mass.dof(lowest)} is "
            f"{diagonal[lowest]:.6g}, as at {np.count_nonzero(diagonal <= 0.0) - 1} more; a "
            f"massless degree of freedom must be condensed statically or be given a mass."
        )
    if _negative_pivots(mass.matrix):
        raise InputError(f"{mass.name} is not positive definite, although its diagonal is.")


def _negative_pivots(matrix: Any) -> bool:
    """Whether a symmetric matrix with a positive diagonal is not positive definite."""
    if matrix.nnz == matrix.shape[0]:
        return False
    if matrix.shape[0] <= _DENSE:
        scale = 1.0 / np.sqrt(matrix.diagonal())
        lowest = np.linalg.eigvalsh(matrix.toarray() * np.outer(scale, scale))[0]
        return bool(lowest <= 1e-15 * len(scale))
    from fecontact.reduction.static_modes.null_space import symmetric_factors

    return bool((symmetric_factors(matrix).U.diagonal() <= 0.0).any())


def _count(modes: int | None, d: int) -> int:
    if modes is None:
        if d > _ALL:
            raise InputError(f"modes = None keeps all modes, but there are {d} degrees of freedom, "
                             f"more than {_ALL}; say how many of the lowest modes to keep.")
        return d
    if isinstance(modes, bool) or not isinstance(modes, (int, np.integer)) or not 1 <= modes <= d:
        raise InputError(f"modes = {modes!r} must be a whole number from 1 to the number of "
                         f"degrees of freedom, {d}.")
    return int(modes)


def _modes(stiffness: Given, mass: Given, count: int, rigid: int | None) -> tuple[Array, Array]:
    """The lowest angular frequencies (m,) and mass-normalised shapes (d, m)."""
    K, M = stiffness.matrix, mass.matrix
    vectors = lowest_vectors(K, M, stiffness.name, rigid)
    R = null_space(K, M, vectors)
    R = R * fixed_signs(R)
    if len(K.data) and R.shape[1] and relative_energies(K, R).max() > 1e-6:
        raise InputError(f"rigid = {rigid} modes are asked for, but {_inside(stiffness)} "
                         f"resists them.")
    d = K.shape[0]
    if d > _DENSE and 3 * count <= d:
        return free_modes(FreeSystem(K, M, R), count)
    elastic = count - R.shape[1]
    if elastic <= 0:
        return np.zeros(count), R[:, :count]
    squares, shapes = _dense_elastic(K, M, R, elastic)
    return (np.concatenate([np.zeros(R.shape[1]), np.sqrt(squares)]),
            np.hstack([R, shapes * fixed_signs(shapes)]))


def _dense_elastic(K: Any, M: Any, R: Array, count: int) -> tuple[Array, Array]:
    """Squares (m,) and shapes (d, m) of the lowest modes that are mass-orthogonal to R."""
    from scipy.linalg import eigh

    mass, lifted = M.toarray(), K.toarray()
    if R.shape[1]:
        # Shift the rigid modes above all others.
        top = eigh(lifted, mass, eigvals_only=True, subset_by_index=[len(mass) - 1] * 2)[0]
        inertia = M @ R
        lifted += 2.0 * top * (inertia @ inertia.T)
    shapes = eigh(lifted, mass, subset_by_index=[0, count - 1])[1]
    shapes -= R @ ((M @ R).T @ shapes)
    shapes /= np.sqrt((shapes * (M @ shapes)).sum(axis=0))
    squares = (shapes * (K @ shapes)).sum(axis=0)
    order = np.argsort(squares)
    return squares[order], shapes[:, order]


def _places(given: ArrayLike, abscissae: ArrayLike | None, n: int, dimension: int) -> Array:
    """Reference places (n, dimension) of the contact nodes as given."""
    if abscissae is not None:
        raise InputError("Give either contact_x, the abscissae of the contact nodes, or "
                         "contact_places, all their coordinates.")
    places = as_floats(given, "contact_places")
    if places.shape != (n, dimension):
        raise InputError(f"contact_places must have shape ({n}, {dimension}), a place for each "
                         f"contact node, not {places.shape}.")
    return places


def _per_node(name: str, values: ArrayLike, n: int) -> Array:
    """One value per contact node, from one each or one for all."""
    array = np.asarray(values, dtype=float)
    if array.shape not in ((), (n,)):
        raise InputError(f"{name} must have one value for each of the {n} contact nodes, not shape "
                         f"{array.shape}.")
    return np.array(np.broadcast_to(array, (n,)))
