"""Vibration modes of the finite-element body: rigid ones exactly, elastic ones by Lanczos."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.basis import fixed_signs
from fecontact.errors import AnalysisError, InputError

if TYPE_CHECKING:
    from fecontact.body import ElasticBody

Array = NDArray[np.float64]

# Below this size, and for a large share of all modes, the dense solver is quicker and as exact.
_DENSE = 600


def eigenmodes(body: "ElasticBody", count: int) -> tuple[Array, Array]:
    """The lowest angular frequencies (m,) [rad/s] and mass-normalised shapes (2 N, m).

    Rigid modes that the supports leave are built from the geometry: frequency exactly zero,
    translation in x, in y, rotation (counter-clockwise). The elastic modes follow with ascending
    frequency; a mode's first largest component is positive.

    Raises
    ------
    InputError
        For less than one mode, or more than there are unknowns.
    AnalysisError
        If a computed mode misses ``|K s - w^2 M s| < 1e-10 |K| |s|``.
    """
    free = body.free_dofs
    if not 1 <= count <= len(free):
        raise InputError(f"modes = {count} must be at least 1 and at most the number of unknowns "
                         f"of the body, {len(free)}.")
    K, M = body.stiffness, body.mass
    rigid = rigid_modes(body)[:, :count]
    elastic = count - rigid.shape[1]
    squares, shapes = np.zeros(0), np.zeros((len(K.indptr) - 1, 0))
    if elastic:
        if len(free) < len(K.indptr) - 1:
            K, M = K[free][:, free].tocsc(), M[free][:, free].tocsc()
        squares, small = elastic_modes(K, M, rigid[free], elastic, _shift(body))
        shapes = np.zeros((2 * len(body.nodes), elastic))
        shapes[free] = small * fixed_signs(small)
    return (np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(squares)]),
            np.hstack([rigid, shapes]))


def rigid_modes(body: "ElasticBody") -> Array:
    """Mass-normalised rigid modes (2 N, r) that the supports leave, r = 0 ... 3."""
    M = body.mass
    motions = np.zeros((2 * len(body.nodes), 3))
    motions[0::2, 0] = motions[1::2, 1] = 1.0
    centre = np.array([(M @ motions[:, axis])[axis::2] @ body.nodes[:, axis]
                       for axis in range(2)]) / (motions[:, 0] @ (M @ motions[:, 0]))
    scale = body.mesh.extent
    motions[0::2, 2] = -(body.nodes[:, 1] - centre[1]) / scale
    motions[1::2, 2] = (body.nodes[:, 0] - centre[0]) / scale
    held = motions[body.fixed_dofs]
    free = np.eye(3)
    if len(held):
        _, size, directions = np.linalg.svd(held, full_matrices=True)
        kept = np.concatenate([size, np.zeros(3 - len(size))]) <= 1e-9 * size[0]
        free = directions[kept].T
    if not free.size:
        return np.zeros((len(motions), 0))
    # Translations first: reduce the free directions to echelon form before orthogonalising.
    for column in range(free.shape[1]):
        pivot = next(i for i in range(3) if np.abs(free[i, column:]).max() > 1e-9)
        swap = column + int(np.argmax(np.abs(free[pivot, column:])))
        free[:, [column, swap]] = free[:, [swap, column]]
        free[:, column] /= free[pivot, column]
        for other in range(column + 1, free.shape[1]):
            free[:, other] -= free[pivot, other] * free[:, column]
    shapes = motions @ free
    shapes[body.fixed_dofs] = 0.0
    for column in range(shapes.shape[1]):
        for _ in range(2):
            earlier = shapes[:, :column]
            shapes[:, column] -= earlier @ (earlier.T @ (M @ shapes[:, column]))
        shapes[:, column] /= np.sqrt(shapes[:, column] @ (M @ shapes[:, column]))
    turning = free[2] < 0.0
    return shapes * np.where(turning, -1.0, 1.0)


def elastic_modes(
    K: Any, M: Any, rigid: Array, count: int, shift: float
) -> tuple[Array, Array]:
    """Squares of the lowest non-zero angular frequencies and their mass-normalised shapes.

    Shift-invert Lanczos about ``-shift``, with a factorisation for symmetric matrices, on the
    complement of the ``rigid`` modes, which is kept exactly.
    """
    size = K.shape[0]
    if size <= _DENSE or 3 * count > size:
        from scipy.linalg import eigh

        inertia = M @ rigid
        # Lift the rigid modes above all others instead of removing them.
        lifted = K.toarray() + (inertia @ inertia.T) * _largest(K, M)
        squares, shapes = eigh(lifted, M.toarray(), subset_by_index=[0, count - 1])
    else:
        squares, shapes = _lanczos(K, M, rigid, count, shift)
    shapes = shapes - rigid @ (rigid.T @ (M @ shapes))
    inertia = M @ shapes
    shapes /= np.sqrt((shapes * inertia).sum(axis=0))
    # Rayleigh quotients do not carry the shift's round-off.
    forces = K @ shapes
    squares = (shapes * forces).sum(axis=0)
    order = np.argsort(squares)
    squares, shapes, forces = squares[order], shapes[:, order], forces[:, order]
    error = backward_error(K, M, squares, shapes).max()
    if not error < 1e-10 or squares[0] <= 0.0:
        raise AnalysisError(
            f"The eigenmodes are not accurate: the residual is {error:.1e} of |K| |mode|, and the "
            f"lowest squared frequency {squares[0]:.3g}; look for nearly degenerate cells or parts "
            f"that hang on a single node."
        )
    return squares, shapes


def backward_error(K: Any, M: Any, squares: Array, shapes: Array) -> Array:
    """``|K s - w^2 M s| / (|K| |s|)`` (m,) of each mode, with the 1-norm of K."""
    residual = np.linalg.norm(K @ shapes - (M @ shapes) * squares, axis=0)
    largest = float(abs(K).sum(axis=0).max())
    return np.asarray(residual / (largest * np.linalg.norm(shapes, axis=0)))


def _lanczos(K: Any, M: Any, rigid: Array, count: int, shift: float) -> tuple[Array, Array]:
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    # K + shift M is positive definite, so that no pivoting is needed and the fill of an ordering
    # for symmetric matrices is kept.
    factors = splu((K + shift * M).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                   options={"SymmetricMode": True})
    inertia = M @ rigid

    def solve(force: Array) -> Array:
        motion = factors.solve(force)
        return np.asarray(motion - rigid @ (inertia.T @ motion))

    start = np.random.default_rng(0).standard_normal(K.shape[0])
    start -= rigid @ (inertia.T @ start)
    squares, shapes = eigsh(K, k=count, M=M, sigma=-shift, v0=start,
                            OPinv=LinearOperator(K.shape, solve, dtype=float))
    return squares, shapes


def _shift(body: "ElasticBody") -> float:
    """A quarter of the square of a slender body's lowest bending frequency, roughly [1/s^2]."""
    length = body.mesh.extent
    height = body.mesh.area / length
    speed = np.sqrt(body.material.youngs_modulus / body.material.density)
    return float((0.5 * speed * height / length**2) ** 2)


def _largest(K: Any, M: Any) -> float:
    """An upper bound of the largest squared frequency, from element-like diagonal ratios."""
    return float(10.0 * (K.diagonal() / M.diagonal()).max())
