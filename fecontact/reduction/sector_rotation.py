"""Rotation of a wheel of equal sectors, in the modes of one sector."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray
from fecontact.fem.cyclic_symmetry import CyclicSymmetry
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.rotation import (
    Rotation,
    centrifugal_force,
    coriolis_matrix,
    softening_matrix,
)
from fecontact.fem.stress_stiffness import stress_stiffness
from fecontact.reduction.eigenmodes import FreeSystem

# Part of the largest frequency below which a motion counts as one that does not oscillate.
_STILL = 1e-7


@read_only_arrays
@dataclass(frozen=True, eq=False)
class SectorRotation:
    """Rotation of a wheel in the modes of its K nodal diameters.

    Attributes
    ----------
    squares : (K, m) array
        Squares of the angular frequencies at rest [rad^2/s^2].
    coriolis : (K, m, m) complex array
        Skew-Hermitian; the damping is ``W coriolis``.
    stiffening : (K, m, m) complex array
        Hermitian; ``W^2 stiffening`` is part of the stiffness.
    """

    squares: Array
    coriolis: ComplexArray
    stiffening: ComplexArray

    def frequencies_hz(self, speed: float) -> tuple[Array, Array]:
        """Frequencies (K, a) of waves that run forwards and (K, b) backwards, at a speed [Hz].

        Both in the frame of the wheel, ascending, the speed in rad/s; forwards is from sector s to
        s + 1. Motions that do not oscillate are left out. There are m of both unless the wheel is
        free, whose shift runs backwards, twice; rows that have less end with NaN.
        """
        require_finite("frequencies_hz", speed=speed)
        m = self.squares.shape[1]
        waves: tuple[list[Array], list[Array]] = [], []
        for row, w2 in enumerate(self.squares):
            stiffness = np.diag(w2) + speed**2 * self.stiffening[row]
            found = np.linalg.eigvals(np.block([
                [np.zeros((m, m)), np.eye(m)], [-stiffness, -speed * self.coriolis[row]]])).imag
            # Re(u e^{i k s alpha + i w t}) runs to smaller s for w > 0.
            least = _STILL * np.abs(found).max(initial=0.0)
            waves[0].append(np.sort(-found[found < -least]))
            waves[1].append(np.sort(found[found > least]))
        forward, backward = (np.array([np.append(one, np.full(
            max(map(len, rows)) - len(one), np.nan)) for one in rows]) for rows in waves)
        return forward / (2.0 * np.pi), backward / (2.0 * np.pi)


def require_common_axis(
    body: ElasticBody, symmetry: CyclicSymmetry, rotation: Rotation, owner: str
) -> None:
    """Raise InputError for a rotation about another axis than that of the symmetry."""
    require_kind(owner, Rotation, rotation=rotation)
    if rotation.frame != "rotating":
        raise InputError(f"{owner}: rotation has frame = '{rotation.frame}'; sectors are those of "
                         f"the frame that rotates with them, leave frame out.")
    apart = np.cross(np.subtract((*rotation.centre, 0.0)[:3], (*symmetry.centre, 0.0)[:3]),
                     symmetry.axis)
    tilt = np.cross(rotation.axis, symmetry.axis)
    if max(np.abs(apart).max(), np.abs(tilt).max()) > 1e-9 * (1.0 + body.mesh.extent):
        raise InputError(f"{owner}: rotation is about the axis of the symmetry; give both the "
                         f"same axis and centre.")


def stiffening_matrix(
    body: ElasticBody, rotation: Rotation, motions: Any, system: FreeSystem
) -> Any:
    """Stiffness, sparse (d N, d N), of spin softening and centrifugal stress at unit speed.

    The stress is that of the static response in ``motions``, sparse (d N, n), whose stiffness and
    mass are those of the system.
    """
    extra = -softening_matrix(body, rotation) if rotation.spin_softening else 0.0 * body.mass
    if rotation.stress_stiffening:
        force = motions.T @ centrifugal_force(body, rotation)
        extra = extra + stress_stiffness(body, motions @ system.deflection(force))
    return extra


def sector_rotation(
    body: ElasticBody, symmetry: CyclicSymmetry, rotation: Rotation, squares: Array,
    shapes: ComplexArray, alike: tuple[Any, FreeSystem],
) -> SectorRotation:
    """Terms of a rotation in the shapes (K, N, d, m) of nodal diameters.

    ``alike`` are the motions of the diameter 0, in which the centrifugal load acts.

    Raises
    ------
    InputError
        For another axis than that of the symmetry.
    """
    require_common_axis(body, symmetry, rotation, "sector_modes")
    extra = stiffening_matrix(body, rotation, *alike)
    turning = coriolis_matrix(body, rotation) if rotation.coriolis else 0.0 * body.mass
    K, m = squares.shape
    coriolis, stiffening = np.zeros((2, K, m, m), dtype=complex)
    for row, shape in enumerate(shapes.reshape(K, body.unknowns, m)):
        coriolis[row], stiffening[row] = in_shapes(shape, turning, extra)
    return SectorRotation(squares, coriolis, stiffening)


def in_shapes(shape: Any, turning: Any, extra: Any) -> tuple[Any, Any]:
    """Skew-Hermitian and Hermitian matrix (m, m) of two matrices in shapes (d N, m)."""
    first, second = (shape.conj().T @ (one @ shape) for one in (turning, extra))
    return 0.5 * (first - first.conj().T), 0.5 * (second + second.conj().T)
