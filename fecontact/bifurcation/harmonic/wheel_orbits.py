"""Whole wheels in the wave that one sector has under engine order: motion and stability."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.engine_order import WaveField, Waves
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.series import real_coefficients
from fecontact.bifurcation.nonlinear_modes.linear_start import field_over_xi, unchanged
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray
from fecontact.core.units import listed
from fecontact.laws.excitation import Load
from fecontact.laws.signals.harmonic import Constant, Harmonic
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.cyclic.whole_wheel import WholeWheel
from fecontact.system.contact_system import ContactSystem


@read_only_arrays
@dataclass(frozen=True, eq=False)
class WheelMotion:
    """Motion of a wheel in a wave, from one orbit of harmonic balance.

    Sector s moves, in coordinates that turn with it, by the sum over harmonics h of
    ``Re(shape_h amplitude_h exp(i h (w t - m s alpha)))``.

    Attributes
    ----------
    wheel : CyclicBasis
    order : int
        Engine order m.
    period : float
        T [s].
    amplitudes : mapping of harmonic to (m_h,) complex array
        Coordinates of the modes of its diameter.
    """

    wheel: CyclicBasis
    order: int
    period: float
    amplitudes: dict[int, ComplexArray]

    def harmonic(self, body: str, h: int, sector: int = 0) -> ComplexArray:
        """Complex displacements (N, d) of harmonic h of the nodes of a body of a sector [m].

        Components are along the axes of sector 0, turned with the sector; InputError for a body
        or harmonic that is not there.
        """
        bodies = self.wheel.bodies
        if body not in bodies:
            raise InputError(f"WheelMotion: there is no body {body!r}{nearest(str(body), bodies)}; "
                             f"the bodies are {choices(bodies)}.")
        if h not in self.amplitudes:
            raise InputError(f"WheelMotion: h = {h!r} must be one of its harmonics, "
                             f"{listed([str(one) for one in sorted(self.amplitudes)])}.")
        shape = self.wheel.of(-h * self.order).shapes[body] @ self.amplitudes[h]
        turn = np.exp(-1j * h * self.order * sector * self.wheel.symmetry.angle)
        return np.asarray(turn * shape)

    def displacement(self, body: str, time: float, sector: int = 0) -> Array:
        """Displacements (N, d) of the nodes of a body of a sector at a time [m].

        Components are along the axes of sector 0, turned with the sector.
        """
        phase = 2.0 * np.pi * time / self.period
        return np.asarray(sum((self.harmonic(body, h, sector) * np.exp(1j * h * phase)).real
                              for h in self.amplitudes))

    def on_wheel(self, time: float) -> dict[str, tuple[Array, Array]]:
        """Places and displacements (N sectors, n, d) of the nodes of each body at a time [m]."""
        symmetry, found = self.wheel.symmetry, {}
        for name, body in self.wheel.bodies.items():
            d = body.dimension
            found[name] = (
                np.array([symmetry.turned(body.nodes, s) for s in range(symmetry.sectors)]),
                np.array([self.displacement(name, time, s) @ symmetry.rotation(d, s).T
                          for s in range(symmetry.sectors)]))
        return found

    def coordinates(self, whole: WholeWheel, harmonics: int) -> Array:
        """Coefficients (2 H + 1, M) of the coordinates of the whole wheel."""
        N, symmetry = self.wheel.symmetry.sectors, self.wheel.symmetry
        found = np.zeros((harmonics + 1, whole.modes), dtype=complex)
        for h, y in self.amplitudes.items():
            k = -h * self.order % N
            folded = min(k, N - k)
            first, m = next((start, size) for number, start, size in whole.blocks
                            if number == folded)
            a = np.sqrt(N if symmetry.is_real(folded) else 0.5 * N) * y
            found[h, first : first + m] = a
            if not symmetry.is_real(folded):
                # Beyond N / 2 shapes are conjugates, so that the wave runs the other way.
                found[h, first + m : first + 2 * m] = (-1j if k == folded else 1j) * a
        return real_coefficients(found)


def wheel_motion(field: WaveField, point: BranchPoint) -> WheelMotion:
    """The motion of the whole wheel at a point of a branch under engine order.

    At a point of a nonlinear mode the field is any one of its wave and system.

    Raises
    ------
    InputError
        For a field that is not that of a wave, or a point of another field.
    """
    require_kind("wheel_motion", WaveField, field=field)
    own: ContactField = field
    if _of_mode(point):
        own = field_over_xi(field.waves.at_rest(field.system()), point.parameter, field.waves)
    problem, u, _ = starts.restored(own, point)
    linearised, waves = problem.evaluate(u), problem.waves
    assert isinstance(waves, Waves)
    period, wheel = problem.period(u), field.waves.wheel
    X, free = problem.coefficients(u), linearised.free_balance
    found = {0: X[0, : waves.means].astype(complex)}
    for h in problem.harmonics_kept:
        if h > 0:
            found[int(h)] = waves.amplitudes(int(h), X, free, period, float(u[-1]))
    return WheelMotion(wheel, field.waves.order, period, found)


def _of_mode(point: BranchPoint) -> bool:
    return "mode_number" in point.branch.attributes


@read_only_arrays
@dataclass(frozen=True, eq=False)
class WheelStability:
    """Stability of a wave among all motions of the wheel.

    Attributes
    ----------
    multipliers : (d,) complex array
        Floquet multipliers of the whole wheel.
    stable : bool
        True if none lies outside the unit circle.
    difference : float
        Largest difference of a modal coordinate between the wave and the orbit of the whole wheel
        near it, relative to the largest one.
    """

    multipliers: ComplexArray
    stable: bool
    difference: float


def wheel_stability(
    field: WaveField, point: BranchPoint, whole: WholeWheel | None = None
) -> WheelStability:
    """Floquet multipliers of the whole wheel in the wave at a point of a branch.

    All sectors are taken together: the effort grows with the cube of their number. The orbit is
    found again by harmonic balance of the whole wheel.

    Parameters
    ----------
    field : WaveField
        The wave of one sector.
    point : BranchPoint
        Of a branch of this field.
    whole : WholeWheel, optional
        By default the tuned wheel; a mistuned one starts from the wave and finds its own orbit.

    Raises
    ------
    InputError
        For a wheel that lacks diameters, loads that are not harmonic, points of nonlinear modes,
        and as :func:`wheel_motion`.
    AnalysisError
        If the whole wheel has no orbit near the wave.
    """
    if _of_mode(point):
        raise InputError("wheel_stability: the negative damping of a nonlinear mode says nothing "
                         "of the stability of the wheel; take a point of a response.")
    motion = wheel_motion(field, point)
    whole = WholeWheel(field.waves.wheel) if whole is None else whole
    require_kind("wheel_stability", WholeWheel, whole=whole)
    problem, u, _ = starts.restored(field, point)
    system = field.waves.at_rest(field.system(problem.parameters(u)))
    every = contact_field(wheel_system(system, whole, field.waves.order), {"time scale": (
        1.0, unchanged)})
    method = HarmonicBalance(problem.orders or problem.harmonics, problem.samples)
    X = motion.coordinates(whole, problem.harmonics)
    largest = float(np.abs(X).max()) or 1.0
    scales = np.full(every.dimension + 2, largest)
    scales[-1], scales[-2] = 1.0, motion.period
    found = starts.problem_for(every, every.values, 0, method, scales)
    rest = np.zeros(every.dimension)
    rest[: whole.modes] = X[0]
    found = replace(found, kept=found.kept.left_by(rest[None]))
    start = np.append(X.reshape(-1), every.values)
    found, orbit = starts.converged_orbit(found, start)
    floquet = found.linearise(orbit).floquet
    return WheelStability(floquet.multipliers, bool(floquet.stable),
                          float(np.abs(orbit - start)[:-1].max()) / largest)


def wheel_system(system: ContactSystem, whole: WholeWheel, order: int) -> ContactSystem:
    """All sectors of a wheel under engine order m, from the system of one sector.

    Harmonic loads reach sector s with the phase ``-2 pi m s / N``; constant ones act on all alike.

    Raises
    ------
    InputError
        For another system than ``ContactSystem(wheel.basis, ...)``, loads on boundaries or the
        ground, and loads in time that are not :class:`~fecontact.laws.Harmonic`.
    """
    require_kind("wheel_system", ContactSystem, system=system)
    require_kind("wheel_system", WholeWheel, whole=whole)
    if system.basis is not whole.wheel.basis:
        raise InputError("wheel_system: the system must be that of the basis of the wheel, "
                         "ContactSystem(wheel.basis, ...).")
    if system.load.boundaries or system.load.normal:
        raise InputError("wheel_system: loads must be those of points; leave out boundaries and "
                         "normal.")
    N, names = whole.sectors, [name for name, _ in whole.wheel.basis.groups]
    forces = []
    for one in system.load.forces:
        signal = one.signal
        if not isinstance(signal, Harmonic | Constant) or not isinstance(one.point, str):
            raise InputError(f"wheel_system: the load at {one.point!r} must be Harmonic or "
                             f"constant, at a named point.")
        for s in range(N):
            later = signal if isinstance(signal, Constant) else replace(
                signal, phase=signal.phase - 2.0 * np.pi * order * s / N)
            forces.append(replace(one, point=f"{s}.{one.point}", signal=later))
    laws: dict[str, Any] = {}
    for kind in ("normal", "friction"):
        given = getattr(system, kind)
        each = given if hasattr(given, "items") else dict.fromkeys(names, given)
        laws[kind] = whole.per_sector(each) or given
    return ContactSystem(whole.basis, **laws, gap=whole.gaps(np.asarray(system.gap)).tolist(),
                         load=Load(forces=tuple(forces)))
