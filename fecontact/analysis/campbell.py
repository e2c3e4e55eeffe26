"""Campbell diagrams: frequencies of a rotating body over its speed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray
from fecontact.core.units import Summarised, span
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.complex_modes import followed

# Part of the largest eigenvalue below which a line counts as a rigid motion.
_ZERO = 1e-6


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class CampbellDiagram(Summarised):
    """Eigenvalues of a rotating body over its speed, seen in the frame of its rotation.

    Attributes
    ----------
    speeds : (n,) array
        Speeds of rotation, ascending [rad/s].
    eigenvalues : (n, k) complex array
        One column for each mode, the lowest frequency at the first speed first [1/s].
    """

    speeds: Array
    eigenvalues: ComplexArray

    def summary(self) -> list[tuple[str, str]]:
        """Speeds, frequencies and instability."""
        growing = self.speeds[(self.eigenvalues.real > self._rounding).any(axis=1)]
        return [("speeds", span(self.speeds, "rad/s")), ("modes", f"{self.eigenvalues.shape[1]}"),
                ("frequencies", span(self.frequencies_hz.ravel(), "Hz")),
                ("unstable", f"from {growing[0]:.5g} rad/s" if len(growing) else "at none of them")]

    @property
    def frequencies_hz(self) -> Array:
        """Frequencies (n, k) in the frame of the rotation [Hz]; zero where none oscillates."""
        return np.abs(self.eigenvalues.imag) / (2.0 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios (n, k), negative for modes that grow; zero for an eigenvalue of zero."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros(size.shape), where=size > 0.0)

    @property
    def _rounding(self) -> float:
        return 1e-7 * float(np.abs(self.eigenvalues).max(initial=0.0))

    def critical_speeds(self, order: float) -> Array:
        """Speeds at which a frequency is ``order`` times that of rotation, ascending [rad/s].

        A force at rest in space with ``order`` waves around the circumference excites the body
        there; order 0 stands for a constant force of the frame, which in that at rest is a force at
        rest. Between the speeds of the
        diagram frequencies count as linear. InputError for a negative order.
        """
        require_finite("critical_speeds", order=order)
        if order < 0.0:
            raise InputError(f"critical_speeds: order = {order!r} must be zero or above.")
        # Signed frequencies pass through zero in straight lines.
        found = []
        for sign in (1.0, -1.0):
            apart = self.eigenvalues.imag - sign * order * self.speeds[:, None]
            at, mode = np.nonzero((apart[:-1] * apart[1:] < 0.0) | (
                (apart[1:] == 0.0) & (apart[:-1] != 0.0)))
            part = apart[at, mode] / (apart[at, mode] - apart[at + 1, mode])
            found.append(self.speeds[at] + part * (self.speeds[at + 1] - self.speeds[at]))
        return np.unique(np.concatenate(found[: 1 if order == 0.0 else 2]))


def campbell(
    basis: ModalBasis, speeds: Sequence[float] | Array, *, count: int | None = None
) -> CampbellDiagram:
    """Frequencies and damping of a rotating body over its speed.

    Modes are followed from speed to speed: choose speeds so close that frequencies move little
    between them. The modes at rest of the basis have to represent the shapes at speed; more of
    them show whether they do.

    Parameters
    ----------
    basis : ModalBasis
        Modal basis of a rotating body, ``modal_basis(body, ..., rotation=Rotation(speed))``.
    speeds : (n,) sequence
        Ascending [rad/s].
    count : int, optional
        Number k of modes, the lowest at the first speed; all by default.

    Raises
    ------
    InputError
        For a body that does not rotate, or speeds that do not ascend.
    """
    require_kind("campbell", ModalBasis, basis=basis)
    values = as_floats(speeds, "campbell: speeds")
    if values.ndim != 1 or len(values) < 2 or not (np.diff(values) > 0.0).all() or (
            not np.isfinite(values).all()):
        raise InputError("campbell: speeds must be two finite numbers or more, in ascending "
                         "order [rad/s].")
    require_kind("campbell", (int, type(None)), count=count)
    if count is not None and count < 1:
        raise InputError(f"campbell: count = {count!r} must be at least 1.")
    m = basis.modes
    all_of_them = np.empty((len(values), 2 * m), dtype=complex)
    for row, speed in zip(all_of_them, values.tolist(), strict=True):
        turning = basis.with_rotation_speed(speed)
        row[:] = np.linalg.eigvals(np.block([
            [np.zeros((m, m)), np.eye(m)], [-turning.stiffness_matrix, -turning.damping]]))
    # Order rows such that pairs stand together, the positive frequency first.
    all_of_them[0] = all_of_them[0][np.lexsort((-all_of_them[0].imag, np.abs(all_of_them[0].imag)))]
    lines = followed(all_of_them)
    size = np.abs(lines).max(initial=0.0)
    moving = np.abs(lines.imag).max(axis=0) > _ZERO * size
    upward = lines[0].imag > _ZERO * size
    # Modes at rest at the first speed oscillate later: take the one of each pair that rises.
    upward |= (np.abs(lines[0].imag) <= _ZERO * size) & (lines[-1].imag > 0.0)
    chosen = np.flatnonzero(moving & upward)
    order = chosen[np.argsort(np.abs(lines[0, chosen].imag), kind="stable")]
    return CampbellDiagram(values, lines[:, order[:count]])
