"""Residual vectors: the static response at the points that the kept modes lack.

A force pattern f over the rows W of the points loads the free degrees of freedom with
``W^T f``. Beside the kept modes Phi with squared frequencies L, the elastic static response is

    W^T f -> Phi_e L_e^-1 Phi_e^T W^T f + Y f,       Y = (G - Phi_e L_e^-1 Phi_e^T) W^T

where G, the elastic flexibility, acts on loads that the inertia of the rigid modes balances. Y
holds the residual vectors of MacNeal and Rubin, ``W Y`` is the residual compliance.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import FreeSystem, fixed_signs
from fecontact.reduction.solvers.lobpcg import Product
from fecontact.reduction.static_modes.flexibility import Flexibility, Modes, modal_compliance
from fecontact.reduction.static_modes.iterated_flexibility import (
    ACCURACY,
    PART,
    IteratedFlexibility,
    TrialSpace,
)

# Rows for which a system that is solved iteratively needs no factors, and unknowns above which
# these cost more than iterations for any number of rows.
_FEW = 64
_LARGE = 80_000
# Size of residual vectors, relative to the static response, that is rounding.
_REST = 1e-6
# Columns of long vectors that are multiplied at once.
_COLUMNS = 128


def flexibility_of(
    system: FreeSystem, rows: Any, tolerance: float = 0.0, modes: Modes | None = None
) -> Flexibility:
    """The elastic flexibility at rows W (k, f), by the solver that suits system and rows.

    Substitution costs little for each row once there are factors, and less than iterations for many
    rows of bodies with less than 80,000 unknowns. Where larger ones are iterated and are completed
    to a tolerance beside modes, a twentieth of it is left to the iterations, and mostly less than a
    tenth to linear elements far from the rows.
    """
    few = rows.shape[0] <= _FEW
    if not ((few or rows.shape[1] > _LARGE) and system.iterates):
        return Flexibility(system, rows, modes)
    part = 0.0 if few else PART * tolerance
    if part <= ACCURACY**2:
        return IteratedFlexibility(system, rows, modes)
    return IteratedFlexibility(system, rows, modes, float(np.sqrt(part)),
                               tolerance)


def leading_patterns(whole: Array, kept: Array, tolerance: float | Array) -> Array:
    """Force patterns (k, p) whose residual vectors leave no more than ``tolerance``.

    They are the leading singular vectors of the residual compliance ``whole - kept`` (k, k), each
    row scaled by the square root of its full elastic compliance; p is the smallest number for which
    no row lacks more than the fraction ``tolerance`` (k,) of its own compliance.
    """
    own = np.diag(whole)
    scale = np.where(own > 0.0, 1.0, 0.0) / np.sqrt(np.where(own > 0.0, own, 1.0))
    values, patterns = np.linalg.eigh((whole - kept) * np.outer(scale, scale))
    values, patterns = values[::-1], patterns[:, ::-1]
    real = values > 1e-12 * len(values)
    values, patterns = values[real], patterns[:, real]
    part = values * patterns**2
    missing = part.sum(axis=1)[:, None] - np.cumsum(np.hstack([0.0 * part[:, :1], part]), axis=1)
    limit = np.broadcast_to(tolerance, own.shape)[:, None] + 1e-13
    enough = np.flatnonzero((missing <= limit).all(axis=0))
    count = int(enough[0]) if enough.size else len(values)
    return np.asarray(patterns[:, :count] * scale[:, None])


def residual_modes(
    flexibility: Flexibility, tolerance: float, loads: Array, fields: Array | None = None
) -> tuple[Array, Array]:
    """Frequencies (p,) and shapes (f, p) that complete the modes of a flexibility at its rows.

    They span the residual vectors of the leading force patterns, those of loads (f, l) of whose
    static response more than the tolerance is missing, and displacements ``fields`` (f, s). They
    are orthogonal to the modes and to each
    other in mass and stiffness, and mass-normalised.
    """
    system, (w, shapes) = flexibility.system, flexibility.modes
    missing = flexibility.missing if isinstance(flexibility, IteratedFlexibility) else 0.0
    patterns = leading_patterns(
        flexibility.compliance, modal_compliance(flexibility.rows, w, shapes),
        np.maximum(tolerance - missing, 0.0))
    deflections = system.deflection(loads)
    whole_work = (loads * deflections).sum(axis=0)
    work = ((loads.T @ shapes[:, w > 0.0] / w[w > 0.0]) ** 2).sum(axis=1)
    lacking = whole_work - work > max(tolerance, 1e-12) * whole_work
    fields = np.zeros((len(shapes), 0)) if fields is None else fields
    if not patterns.shape[1] and not lacking.any() and not fields.shape[1]:
        return np.zeros(0), np.zeros((len(shapes), 0))
    further = np.hstack([deflections[:, lacking], fields])
    iterated = isinstance(flexibility, IteratedFlexibility)
    vectors = further if iterated else np.hstack([flexibility.deflections(patterns), further])
    inertia = system.mass @ shapes
    for _ in range(2):
        vectors -= shapes @ (inertia.T @ vectors)
    if isinstance(flexibility, IteratedFlexibility):
        squares, found = _diagonalised_with(
            flexibility.space, flexibility.coordinates(patterns), shapes, inertia, vectors)
    else:
        squares, found = diagonalised(system, vectors)
    return np.sqrt(squares), found


def completing(system: FreeSystem, modes: Array, vectors: Array) -> Array:
    """Mass-normalised shapes (f, r) that span vectors (f, p) beside modes (f, m).

    What rounding leaves of vectors that the modes span is left out. Complex ones as for
    :func:`diagonalised`.
    """
    K, inertia = system.stiffness, system.mass @ modes
    sizes = np.sqrt(np.maximum((vectors.conj() * (K @ vectors)).sum(axis=0).real, 0.0))
    for _ in range(2):
        vectors = vectors - modes @ (inertia.conj().T @ vectors)
    left = np.sqrt(np.maximum((vectors.conj() * (K @ vectors)).sum(axis=0).real, 0.0))
    kept = left > _REST * sizes
    return diagonalised(system, vectors[:, kept])[1] if kept.any() else vectors[:, :0]


def diagonalised(system: FreeSystem, vectors: Array) -> tuple[Array, Array]:
    """Squared frequencies (p,) and mass-normalised shapes (f, p) of the span of some vectors.

    Stiffness and mass may be Hermitian, and vectors complex.
    """
    left = vectors.conj().T
    squares, turn, loose = _directions(
        left @ (system.stiffness @ vectors), left @ (system.mass @ vectors))
    shapes = vectors @ turn
    if loose:
        shapes = shapes @ _orthonormal(shapes.conj().T @ (system.mass @ shapes))
    return squares, shapes * fixed_signs(shapes)


def _diagonalised_with(
    space: TrialSpace, coordinates: Array, modes: Array, inertia: Array, vectors: Array
) -> tuple[Array, Array]:
    """Squared frequencies and shapes of displacements B v beside modes, and orthogonal vectors.

    All shapes are sums B Z + C c of coordinates Z (s, p) and of few long vectors C, which are the
    modes and the vectors orthogonal to them.
    """
    system, count, p = space.system, modes.shape[1], coordinates.shape[1]
    long = np.hstack([modes, vectors])
    pushed, moved = system.stiffness @ long, np.hstack([inertia, system.mass @ vectors])
    stiffness = _Gram(space.solver.stiffness_product, space.gather(pushed), long.T @ pushed)
    mass = _Gram(space.solver.mass_product, space.gather(moved), long.T @ moved)
    part = np.zeros((long.shape[1], p + vectors.shape[1]))
    part[count:, p:] = np.eye(vectors.shape[1])
    part[:count, :p] = -mass.cross[:, :count].T @ coordinates
    squares, turn, loose = _directions(stiffness.of(coordinates, part),
                                       mass.of(coordinates, part))
    coordinates, part = coordinates @ turn[:p], part @ turn
    if loose:
        turn = _orthonormal(mass.of(coordinates, part))
        coordinates, part = coordinates @ turn, part @ turn
    shapes = space.spread(coordinates)
    shapes += long @ part
    shapes *= fixed_signs(shapes)
    return squares, shapes


@dataclass(frozen=True, eq=False)
class _Gram:
    """Products (p, p) by K or M of sums B Z + C c with each other.

    ``product`` is that by B^T K B, ``cross`` (s, q) is B^T K C, and ``own`` (q, q) C^T K C.
    """

    product: Product
    cross: Array
    own: Array

    def of(self, coordinates: Array, part: Array) -> Array:
        """Products of sums with coordinates Z (s, p) and coefficients c (q, p + l).

        The last l sums have no Z.
        """
        p, n = coordinates.shape[1], part.shape[1]
        found = np.zeros((n, n))
        for first in range(0, p, _COLUMNS):
            last = min(first + _COLUMNS, p)
            image = self.product(np.ascontiguousarray(coordinates[:, first:last]))
            found[:last, first:last] = coordinates[:, :last].T @ image
        found = np.triu(found) + np.triu(found, 1).T
        mixed = (coordinates.T @ self.cross) @ part
        found[:p] += mixed
        found[:, :p] += mixed.T
        return found + part.T @ self.own @ part


def _directions(stiffness: Array, mass: Array) -> tuple[Array, Array, bool]:
    """Squared frequencies (p,) in a span, coefficients, and whether their mass is loose."""
    scale = 1.0 / np.sqrt(np.diag(stiffness).real)
    values, directions = np.linalg.eigh(stiffness * np.outer(scale, scale))
    kept = values > 1e-11 * values[-1]
    span = scale[:, None] * directions[:, kept] / np.sqrt(values[kept])
    inverse, turned = np.linalg.eigh(span.conj().T @ mass @ span)
    inverse, turned = inverse[::-1], turned[:, ::-1]
    loose = inverse[0] * values[-1] > 1e6 * inverse[-1] * values[kept][0]
    return 1.0 / inverse, span @ (turned / np.sqrt(inverse)), bool(loose)


def _orthonormal(gram: Array) -> Array:
    """One symmetric step, which squares the error of orthogonality of shapes with this product."""
    return 1.5 * np.eye(len(gram)) - 0.5 * gram
