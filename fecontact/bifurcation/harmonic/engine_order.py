r"""Harmonic balance of one elastic sector of a wheel under engine order.

Forces ``F cos(W t - 2 pi m s / N)`` on sectors s are engine order m. The wheel answers with a wave,
``u_s(t) = u_0(t - m s T / N)``, whose harmonic h belongs to the nodal diameter k with
``k = -h m mod N``. Of displacements d of contact nodes and points, each harmonic satisfies

.. math:: d_h = H_h (f_h + i S_k d_h), \qquad
    H_h = W_k (K_k - (h \Omega)^2 + i h \Omega (C_k - \xi) + i W_k^H S_k W_k)^{-1} W_k^H

with the modes and complex rows W_k of its own diameter, forces f_h by alternating frequency and
time. Nonlinear modes have a negative damping xi, and as they begin at resonances an imaginary
stiffness S_k, diagonal, which acts on both sides and changes no solution; it keeps H_h finite. Both
are zero for responses. The mean, harmonic 0, is that of the diameter 0 in its modal coordinates.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.parametrised_system import ParametrisedSystem
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ComplexArray, Integers
from fecontact.laws.excitation import BOUNDARY_STRESSES
from fecontact.laws.signals.harmonic import Constant, Harmonic, Signal
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.statics.equilibrium import equilibrium_coordinates

# Size of rows, relative to the largest, of displacements that are always zero.
_STILL = 1e-12
# Softness of displacements, relative to the softest one, below which it counts as this.
_SOFTEST = 1e-6


@dataclass(frozen=True, eq=False)
class EngineOrder:
    """The wave with which a wheel answers engine order m, for ``HarmonicBalance(repeats=)``.

    The system is that of the nodal diameter 0, ``wheel.basis``: there its loads act on all sectors
    alike. Under engine order those that vary in time reach sector s a time ``m s T / N`` later.

    Parameters
    ----------
    wheel : CyclicBasis
        With the diameters to which the harmonics h m fold.
    order : int
        m, from 1 to N; orders above N / 2 are waves that run backwards.

    Raises
    ------
    InputError
        For an order out of range: order m above N is the same as m - N.
    """

    wheel: CyclicBasis
    order: int

    def __post_init__(self) -> None:
        require_kind("EngineOrder", CyclicBasis, wheel=self.wheel)
        require_kind("EngineOrder", int, order=self.order)
        N = self.wheel.symmetry.sectors
        if not 1 <= self.order <= N:
            alias = f"; it acts as order {(self.order - 1) % N + 1}" if self.order > N else ""
            raise InputError(f"EngineOrder: order = {self.order} must be from 1 to the number of "
                             f"sectors, {N}{alias}.")

    def diameter(self, harmonic: int) -> int:
        """Nodal diameter from 0 to N / 2 to which a harmonic belongs."""
        N = self.wheel.symmetry.sectors
        k = harmonic * self.order % N
        return min(k, N - k)

    def attributes(self) -> dict[str, Any]:
        """Values by name, for branches to store."""
        return {"engine_order": self.order, "sectors": self.wheel.symmetry.sectors}

    @cached_property
    def places(self) -> tuple[tuple[int, int], ...]:
        """Displacements that waves have: number of the point or contact node, and component."""
        d = self.wheel.basis.dimension
        sizes = np.max([np.abs(one.T[:, :d]).max(axis=2) for one in self.wheel.diameters], axis=0)
        return tuple((int(point), int(component)) for point, component in
                     np.argwhere(sizes > _STILL * sizes.max(initial=0.0)))

    @cached_property
    def basis(self) -> ModalBasis:
        """Modes of the diameter 0, then one coordinate of unit mass for each displacement."""
        own, loads = self.wheel.basis, self.wheel.loads
        m, d = own.modes, own.dimension
        r = len(self.places) + d * len(loads)

        def further(matrix: Array) -> Array:
            found = np.zeros((m + r, m + r))
            found[:m, :m] = matrix
            return found

        T = np.concatenate([own.T, np.zeros((*own.T.shape[:2], r))], axis=2)
        for column, (point, component) in enumerate(self.places):
            T[point, component, m + column] = 1.0
        rows = np.concatenate([own.boundary_rows, np.zeros((*own.boundary_rows.shape[:2], r))],
                              axis=2)
        for number, name in enumerate(loads):
            first = m + len(self.places) + d * number
            rows[own.boundaries.index(name), :, first : first + d] = np.eye(d)
        return replace(
            own, angular_frequencies=np.append(own.angular_frequencies, np.zeros(r)),
            damping=further(own.damping), T=T, boundary_rows=rows,
            stiffness=further(own.stiffness_matrix), parts=(),
            constant_load=None if own.constant_load is None else np.append(
                own.constant_load, np.zeros(r)))

    def system(self, system: ContactSystem) -> ContactSystem:
        """The system with these coordinates, for harmonic balance alone.

        Raises
        ------
        InputError
            For a system of another basis, and loads that vary in time on boundaries that are not
            among ``loads`` of the wheel.
        """
        require_kind("EngineOrder", ContactSystem, system=system)
        if system.basis is self.basis:
            return system
        if system.basis is not self.wheel.basis:
            raise InputError("EngineOrder: the system must be that of the basis of its wheel, "
                             "ContactSystem(wheel.basis, ...).")
        for one in system.load.boundaries:
            varies = any(isinstance(getattr(one, name), Signal) and not isinstance(
                getattr(one, name), Constant) for name in BOUNDARY_STRESSES)
            if varies and one.boundary not in self.wheel.loads:
                raise InputError(f"EngineOrder: the load on '{one.boundary}' varies in time; make "
                                 f"the wheel by cyclic_basis(..., loads=['{one.boundary}']), in a "
                                 f"study by loads of [bodies.NAME.basis].")
        return replace(system, basis=self.basis)

    def field(self, field: VectorField) -> "WaveField":
        """The field of a system with these coordinates; errors as :meth:`system`."""
        if isinstance(field, WaveField) and field.waves is self:
            return field
        if not isinstance(field, ContactField):
            raise InputError("EngineOrder: only contact systems have sectors.")
        return WaveField(field.family.on(self.system(field.family.base)), self)

    def excited(self, field: ContactField, values: Array) -> "WaveField":
        """The field of the part of the harmonic forces that acts, its only parameter."""
        system = field.system(values)
        own = {f"load.forces.{number}.signal.amplitude": force.signal.amplitude
               for number, force in enumerate(system.load.forces)
               if isinstance(force.signal, Harmonic)}

        def scaled(system: ContactSystem, part: float) -> ContactSystem:
            return system.with_({name: part * value for name, value in own.items()})

        return WaveField(ParametrisedSystem(system, {"part": (1.0, scaled)}), self)

    def at_rest(self, system: ContactSystem) -> ContactSystem:
        """The system of the diameter 0 from one with the coordinates of waves."""
        return replace(system, basis=self.wheel.basis)

    def rest(self, field: ContactField, values: Array) -> Array:
        """State (d,) of rest under the loads' means, of the diameter 0."""
        state = np.zeros(field.dimension)
        q = equilibrium_coordinates(self.at_rest(field.system(values)), "rest", 0.0, standing=True)
        state[: len(q)] = q
        return state

    def state(self, field: ContactField, held: Array) -> Array:
        """State (d,) of the field from one [q, q', z] of the system of the diameter 0."""
        m, b = self.wheel.basis.modes, self.basis.modes
        found = np.zeros(field.dimension)
        found[:m], found[2 * b :] = held[:m], held[2 * m :]
        return found


class WaveField(ContactField):
    """A contact system of one sector under engine order as a vector field, for harmonic balance.

    ``EngineOrder(wheel, order).field(contact_field(system, names))`` makes it. The only parameter
    of an ``unfolded`` field is the negative damping xi of all masses of the wheel.
    """

    def __init__(
        self, family: ParametrisedSystem, waves: EngineOrder, unfolded: bool = False
    ) -> None:
        super().__init__(family)
        self.waves, self.unfolded = waves, unfolded


@dataclass(frozen=True, eq=False)
class Waves:
    """Equations d_h = H_h f_h of the harmonics of one sector.

    The first ``means`` coordinates are modes of the diameter 0, which have the mean alone; the
    others are displacements, which have harmonics 1 to H alone. The parameter is the negative
    damping xi if the field is ``unfolded``.
    """

    repeats: EngineOrder
    unfolded: bool = False
    _known: dict[int, tuple[ComplexArray, ComplexArray, ComplexArray, Array]] = field(
        default_factory=dict)

    @property
    def means(self) -> int:
        """Number of modes of the diameter 0."""
        return self.repeats.wheel.basis.modes

    @cached_property
    def softness(self) -> Array:
        """Factors (m,) of the equations of the mean, which make displacements of forces [s^2]."""
        stiff = np.diag(self.repeats.wheel.basis.stiffness_matrix)
        least = stiff[stiff > 0.0].min(initial=stiff.max(initial=1.0)) or 1.0
        return np.asarray(1.0 / np.maximum(stiff, least))

    def left_out(self, shape: tuple[int, int]) -> Integers:
        """Indices of the coefficients (2 H + 1, b) that are zero."""
        zero = np.zeros(shape, dtype=bool)
        zero[1:, : self.means] = True
        zero[0, self.means :] = True
        return np.flatnonzero(zero)

    def _of(self, harmonic: int) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array]:
        """Stiffness, damping (m, m), rows (r, m) and S (r,) of the diameter of a harmonic."""
        given = self.repeats
        k = -harmonic * given.order % given.wheel.symmetry.sectors
        if k not in self._known:
            one = given.wheel.of(k)
            points, components = np.array(given.places, dtype=int).reshape(-1, 2).T
            rows = np.concatenate([one.T[points, components],
                                   one.boundary_rows.reshape(-1, len(one.stiffness))])
            stiffness = (_stiffness_at(one.stiffness, rows) if self.unfolded
                         else np.zeros(len(rows)))
            self._known[k] = one.stiffness, one.damping, rows, stiffness
        return self._known[k]

    def _damping(self, parameter: float) -> float:
        """Negative damping xi [1/s] at a value of the parameter."""
        return parameter if self.unfolded else 0.0

    def compliance(
        self, harmonic: int, w: float, parameter: float
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H_h (r, r) at the angular frequency w of harmonic 1, its derivatives to w and xi."""
        K, C, W, _ = self._of(harmonic)
        unit, xi = np.eye(len(K)), self._damping(parameter)
        moved = self._solved(harmonic, w, xi, W.conj().T)
        change = 1j * harmonic * (C - xi * unit) - 2.0 * harmonic**2 * w * unit
        return (W @ moved, -W @ self._solved(harmonic, w, xi, change @ moved),
                1j * harmonic * w * W @ self._solved(harmonic, w, xi, moved))

    def amplitudes(
        self, harmonic: int, coefficients: Array, balance: Array, period: float, parameter: float
    ) -> ComplexArray:
        """Coordinates (m,) of the modes of a harmonic at a solution.

        ``balance`` (2 H + 1, b) is that of free masses.
        """
        w, (_, _, W, S) = 2.0 * np.pi / period, self._of(harmonic)
        q, free = self._harmonic(coefficients, balance, harmonic, w)
        return self._solved(harmonic, w, self._damping(parameter),
                            W.conj().T @ (1j * S * q - free))

    def mean_square_velocity(
        self, coefficients: Array, balance: Array, period: float, parameter: float,
        kept: Integers,
    ) -> float:
        """Twice the mean kinetic energy of one sector [J]; arguments as for others."""
        w = 2.0 * np.pi / period
        return float(sum(0.5 * (np.abs(h * w * self.amplitudes(
            h, coefficients, balance, period, parameter)) ** 2).sum() for h in kept[kept > 0]))

    def linearised(self, jacobian: Array) -> tuple[ComplexArray, ComplexArray]:
        """The linearised equations of harmonic 1 and how its states follow.

        Of the Jacobian (d, d) of the field's states [q, q', z] a matrix A (n, n) of the states
        [y, y', z] with the modes y of the diameter; and (d, n) of the former from the latter.
        """
        K, C, W, _ = self._of(1)
        m, b, c = len(K), self.means + len(W), len(jacobian) - 2 * (self.means + len(W))
        back = np.zeros((len(jacobian), 2 * m + c), dtype=complex)
        back[self.means : b, :m], back[b + self.means : 2 * b, m : 2 * m] = W, W
        back[2 * b :, 2 * m :] = np.eye(c)
        A = np.zeros((2 * m + c, 2 * m + c), dtype=complex)
        A[:m, m : 2 * m] = np.eye(m)
        A[m : 2 * m] = W.conj().T @ jacobian[b + self.means : 2 * b] @ back
        A[m : 2 * m, :m] -= K
        A[m : 2 * m, m : 2 * m] -= C
        A[2 * m :] = jacobian[2 * b :] @ back
        return A, back

    def _harmonic(
        self, coefficients: Array, balance: Array, h: int, w: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Displacements (r,) of a harmonic, and the forces on them with opposite sign."""
        c, s, first = 2 * h - 1, 2 * h, self.means
        q: ComplexArray = np.asarray(
            coefficients[c, first:] - 1j * coefficients[s, first:], dtype=complex)
        return q, balance[c, first:] - 1j * balance[s, first:] + (h * w) ** 2 * q

    def _solved(
        self, harmonic: int, w: float, xi: float, forces: ComplexArray
    ) -> ComplexArray:
        """Response of the modes to forces (m,) or (m, k)."""
        K, C, W, S = self._of(harmonic)
        own, unit = harmonic * w, np.eye(len(K))
        try:
            return np.asarray(np.linalg.solve(
                K - own**2 * unit + 1j * (own * (C - xi * unit) + W.conj().T * S @ W), forces))
        except np.linalg.LinAlgError:
            raise AnalysisError(f"Harmonic {harmonic} is at a resonance without damping at "
                                f"{w / (2.0 * np.pi):.6g} Hz; give the modes some damping."
                                ) from None

    def residual(
        self, coefficients: Array, found: Array, period: float, parameter: float, kept: Integers
    ) -> None:
        """Put the equations of the kept harmonics into found (2 H + 1, b).

        It holds the balance of free masses.
        """
        w, first = 2.0 * np.pi / period, self.means
        found[0, :first] *= self.softness
        for h in kept[kept > 0].tolist():
            c, s = 2 * h - 1, 2 * h
            q, free = self._harmonic(coefficients, found, h, w)
            S = self._of(h)[3]
            value = q + self.compliance(h, w, parameter)[0] @ (free - 1j * S * q)
            found[c, first:], found[s, first:] = value.real, -value.imag

    def derivatives(
        self, matrix: Array, coefficients: Array, balance: Array, period: float, parameter: float,
        by_common: Array, kept: Integers,
    ) -> None:
        """Put the derivatives into a matrix ((2 H + 1) b, columns) of those of the balance.

        ``balance`` (2 H + 1, b) is that of free masses, ``by_common`` the derivatives of the
        period to the last columns, of which the very last is that of the parameter.
        """
        w, (L, b), first = 2.0 * np.pi / period, coefficients.shape, self.means
        turning = -w / period * by_common
        matrix[:first] *= self.softness[:, None]
        for h in kept[kept > 0].tolist():
            c, s = 2 * h - 1, 2 * h
            cosines, sines = (np.arange(row * b + first, row * b + b) for row in (c, s))
            S, (H, slope, by_xi) = self._of(h)[3], self.compliance(h, w, parameter)
            q, free = self._harmonic(coefficients, balance, h, w)
            acting = free - 1j * S * q
            change = matrix[cosines] - 1j * matrix[sines]
            own = np.zeros_like(change)
            places = np.arange(b - first)
            own[places, cosines], own[places, sines] = 1.0, -1j
            change = own + H @ (change + ((h * w) ** 2 - 1j * S)[:, None] * own)
            change[:, L * b :] += np.outer(slope @ acting + 2.0 * h * h * w * (H @ q), turning)
            if self.unfolded:
                change[:, -1] += by_xi @ acting
            matrix[cosines], matrix[sines] = change.real, -change.imag

    def neglected(
        self, coefficients: Array, forces: Array, period: float, parameter: float, sizes: Array,
        kept: Integers,
    ) -> float:
        """Root mean square of harmonics that are left out over that of those that are kept.

        ``forces`` (N, b) are accelerations of free masses at the samples; stiffness of contacts is
        left out. NaN if the wheel has no modes of one of the diameters, up to three times the
        highest harmonic.
        """
        w, first, N = 2.0 * np.pi / period, self.means, len(forces)
        spectrum = 2.0 * np.fft.rfft(forces[:, first:], axis=0) / N
        highest = len(coefficients) // 2
        total = 0.0
        for h in range(1, min(3 * highest + 2, (N - 1) // 2) + 1):
            if h in kept:
                continue
            try:
                added = self.compliance(h, w, parameter)[0] @ spectrum[h]
            except InputError:
                return float("nan")
            total += float((np.abs(added / sizes[first:]) ** 2).sum())
        whole = float(((coefficients[1:, first:] / sizes[first:]) ** 2).sum())
        return float(np.sqrt(total / whole)) if whole > 0.0 else 0.0


def _stiffness_at(stiffness: ComplexArray, rows: ComplexArray) -> Array:
    """Stiffness (r,) of the sector at displacements, of the size that it has near resonances."""
    values, shapes = np.linalg.eigh(stiffness)
    sizes = np.abs(values) + np.abs(values).min(initial=np.inf, where=values != 0.0)
    softness = (np.abs(rows @ shapes) ** 2 / sizes).sum(axis=1)
    return np.asarray(1.0 / np.maximum(softness, _SOFTEST * softness.max(initial=0.0)))
