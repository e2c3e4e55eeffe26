"""Quality of a modal basis: frequencies, effective masses, compliance at the contact."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.core.errors import choices
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.reduction.modal_basis import ModalBasis

# Acceptable error of static compliance, below the uncertainty of contact laws.
_GOOD = 0.1


def usable_hz(basis: ModalBasis) -> float:
    """Frequency up to which a basis is usable [Hz], its highest vibration mode over 1.5.

    Infinite where it is not known: without a finite-element body, and without elastic modes.
    """
    if basis.quality is None:
        return np.inf
    known = basis.frequencies_hz[: basis.quality.vibration_modes]
    elastic = known[known > 0.0]
    if elastic.size:
        return float(elastic[-1]) / 1.5
    above = basis.frequencies_hz[basis.frequencies_hz > 0.0]
    return float(above[len(above) // 2]) / 1.5 if above.size else np.inf


def beyond_basis(frequency_hz: float | None, usable_hz: float) -> str:
    """Remark on a frequency above that up to which the basis is usable; else empty."""
    if frequency_hz is None or frequency_hz <= usable_hz:
        return ""
    return f"beyond {quantity(usable_hz, 'Hz')}, where the basis ends"


@read_only_arrays
@dataclass(frozen=True, eq=False)
class BasisReport:
    """Figures of merit of a basis; ``str(report)`` is a table with a recommendation.

    Figures that need the finite-element body are NaN for a basis without one.

    Attributes
    ----------
    basis : ModalBasis
    interfaces : tuple of str, optional
        Interfaces at which one of several bodies touches others; see
        :func:`fecontact.reduction.interface_compliance` for their compliance.
    """

    basis: ModalBasis
    interfaces: tuple[str, ...] | None = None

    @property
    def effective_mass(self) -> Array:
        """Share (d, m) of the body's mass that moves with each mode, along each axis."""
        quality, rows = self.basis.quality, self.basis.inertia_rows
        if quality is None or rows is None:
            return np.full((self.basis.dimension, self.basis.modes), np.nan)
        return np.asarray(rows**2 / quality.mass)

    @cached_property
    def compliance_error(self) -> Array:
        """Fraction (P, d) of each point's elastic compliance along each axis that is missing.

        Zero for points and directions that do not deflect.
        """
        quality = self.basis.quality
        if quality is None:
            return np.full((len(self.basis.T), self.basis.dimension), np.nan)
        return _missing(self.basis.elastic_compliance, quality.compliance)

    @cached_property
    def load_error(self) -> Array:
        """Fraction (1 + b, d) of the elastic response to loads that is missing in the basis.

        Gravity along each axis, then pressure and shear (in space two) on each of
        ``basis.boundaries``; zero for loads that do not deform the body.
        """
        quality, kept = self.basis.quality, self.basis.elastic_load_compliance
        if quality is None:
            return np.full(kept.shape, np.nan)
        return np.concatenate([_missing(kept[:1], quality.load_compliance[:1]),
                               _missing(kept[1:], quality.load_compliance[1:])])

    @property
    def contact_error(self) -> Array:
        """:attr:`compliance_error` (n, d) of the contact nodes."""
        return self.compliance_error[2 : 2 + self.basis.contact_nodes]

    @property
    def orthogonality(self) -> float:
        """Largest entry of ``shapes^T M shapes - 1``."""
        return np.nan if self.basis.quality is None else self.basis.quality.orthogonality

    @property
    def residuals(self) -> Array:
        """``|K s - w^2 M s| / (|K| |s|)`` of each mode (m,)."""
        quality = self.basis.quality
        return np.full(self.basis.modes, np.nan) if quality is None else quality.residuals

    @property
    def highest_frequency_hz(self) -> float:
        """Highest frequency of the basis [Hz]."""
        return float(self.basis.frequencies_hz.max())

    @property
    def time_step(self) -> float:
        """A twentieth of the shortest period [s], which resolves every mode."""
        highest = self.highest_frequency_hz
        return 0.05 / highest if highest > 0.0 else np.inf

    @property
    def recommendation(self) -> str:
        """Recommendation in one or two sentences."""
        if self.basis.parts:
            return ("The basis is that of several bodies; interface_compliance compares the "
                    "compliance of its interfaces with that of the finite-element bodies.")
        if self.basis.quality is None:
            return ("The basis came without a body, so its compliance at the contact cannot be "
                    "judged; compare it with a static solution of the full model.")
        if self.basis.rigid_modes == self.basis.modes:
            return ("The basis is rigid: the body moves, but does not deform. Keep more modes "
                    "where its vibration or its elasticity at the contact matters.")
        error = self.contact_error
        if self.interfaces:
            noun = "interface" if len(self.interfaces) == 1 else "interfaces"
            return (f"The body has contact at the {noun} {choices(self.interfaces)}; the basis "
                    f"can be used up to about {usable_hz(self.basis):.4g} Hz.")
        if not error.size:
            return ("The body touches nothing at an interface." if self.interfaces is not None else
                    "The basis has no contact nodes of its own; if the body is one of several, "
                    "interface_compliance judges its interfaces.")
        node, axis = np.unravel_index(int(np.argmax(error)), error.shape)
        worst = float(error[node, axis])
        if worst <= _GOOD:
            return (f"Static deflections of the contact nodes are right to {100 * worst:.2g} %; "
                    f"the basis can be used up to about {usable_hz(self.basis):.4g} Hz.")
        return (f"Contact node {node} is too stiff: {100 * worst:.0f} % of its elastic compliance "
                f"in {'xyz'[axis]} is missing. Complete the modes with reduction = \"residual\" "
                f"(tolerance {_GOOD:g} or less), or keep more modes.")

    def _loaded_points(self) -> list[tuple[str, str, float]]:
        """B along each axis, C along the normal, where they have rows."""
        d = self.basis.dimension
        rows = np.asarray(np.abs(self.basis.T[:2, :d]).max(axis=2)) > 0.0
        return [("BC"[point], "xyz"[axis], float(self.compliance_error[point, axis]))
                for point, axis in (*((0, axis) for axis in range(d)), (1, d - 1))
                if rows[point, axis]]

    def _load_lines(self) -> list[str]:
        assert self.basis.quality is not None
        gravity, *boundaries = self.load_error
        whole = self.basis.quality.load_compliance[1:]
        return [f"missing static response to gravity: {_along_axes(gravity)}",
                *(f"missing static response to any loads on '{name}': pressure {pressure:.2%}, "
                  f"shear {' and '.join(f'{shear:.2%}' for shear in shears)}"
                  for name, (pressure, *shears), work in zip(
                      self.basis.boundaries, boundaries, whole, strict=True) if work.any())]

    @property
    def kinds(self) -> list[str]:
        """Kind of each mode: rigid, vibration, residual vector, or reduced (without vibrations)."""
        quality = self.basis.quality
        vibrations = self.basis.modes if quality is None else quality.vibration_modes
        other = "reduced" if vibrations == self.basis.rigid_modes else "residual"
        return ["rigid" if w == 0.0 else "vibration" if mode < vibrations else other
                for mode, w in enumerate(self.basis.angular_frequencies)]

    def __str__(self) -> str:
        basis, mass = self.basis, self.effective_mass
        masses = " ".join(f"{f'mass {axis}':>8s}" for axis in "xyz"[: basis.dimension])
        lines = [f"{'mode':>4s} {'frequency [Hz]':>15s} {'damping':>9s} {masses}  kind"]
        diagonal = np.diag(basis.damping)
        first = {part.modes[0]: part.name for part in basis.parts if part.modes[1]}
        number = 0
        for i, (f, kind) in enumerate(zip(basis.frequencies_hz, self.kinds, strict=True)):
            if i in first:
                number = 0
                lines.append(f"body '{first[i]}':")
            w = basis.angular_frequencies[i]
            ratio = f"{diagonal[i] / (2.0 * w):9.3%}" if w > 0.0 else f"{'-':>9s}"
            shares = " ".join(f"{share:8.2%}" if np.isfinite(share) else f"{'-':>8s}"
                              for share in mass[:, i])
            lines.append(f"{number:4d} {f:15.6g} {ratio} {shares}  {kind}")
            number += 1
        if faces := [(name, count) for name, count in basis.groups if name not in basis.springs]:
            nodes = ", ".join(f"{count} on '{name}'" for name, count in faces)
            lines += ["", f"contact nodes: {nodes}"]
        error = self.contact_error
        if np.isfinite(error).all() and error.size and basis.rigid_modes < basis.modes:
            lines += ["", "missing static compliance at the contact nodes: "
                      f"{_along_axes(error.max(axis=0))} at most, "
                      f"{_along_axes(error.mean(axis=0))} on average",
                      *(f"missing static compliance at {name}: {axis} {error:.2%}"
                        for name, axis, error in self._loaded_points()),
                      *self._load_lines(),
                      f"effective mass kept: {_along_axes(mass.sum(axis=1))}",
                      f"mass-orthogonality: {self.orthogonality:.1e}"]
        if self.highest_frequency_hz > 0.0:
            lines.append(f"highest frequency: {self.highest_frequency_hz:.6g} Hz, resolved by time "
                         f"steps of {self.time_step:.2g} s")
        if basis.rotation is not None:
            lines.append(f"frequencies are those at rest, the body rotates at "
                         f"{quantity(basis.rotation.speed, 'rad/s')}")
        lines.append(self.recommendation)
        return "\n".join(lines)


def _along_axes(fractions: Array) -> str:
    return ", ".join(f"{axis} {value:.2%}" for axis, value in zip("xyz", fractions, strict=False))


def _missing(kept: Array, whole: Array) -> Array:
    """Missing fractions of compliances; zero where there is none."""
    # Compliances are differences of rigid contributions; smaller ones are round-off.
    real = whole > 1e-10 * whole.max(initial=0.0)
    error = 1.0 - np.divide(kept, whole, out=np.ones_like(whole), where=real)
    return np.asarray(np.where(real, np.maximum(error, 0.0), 0.0))
