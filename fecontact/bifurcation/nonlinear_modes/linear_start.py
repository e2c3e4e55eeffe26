"""Start of a nonlinear mode: the system without excitation, and its linear mode at rest."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.equilibria.equilibrium import find_equilibrium, steady_sliding
from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.fields.parametrised_system import ParametrisedSystem
from fecontact.bifurcation.harmonic.engine_order import EngineOrder, WaveField, Waves
from fecontact.bifurcation.harmonic.forced_starts import rest_state
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ComplexArray
from fecontact.laws.excitation import BOUNDARY_STRESSES, BoundaryLoad
from fecontact.laws.signals.base import Signal
from fecontact.laws.signals.harmonic import Constant
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField

XI = "xi"
# Largest |xi| of a conservative system, relative to the frequency.
CONSERVATIVE = 1e-8
# Part of the largest eigenvalue up to which eigenvalues count as zero, those of rigid modes.
_ZERO = 1e-7
# Part of the largest stiffness that is rounding.
_LOOSE = 1e-14
_ITERATIONS = 60
# Part by which deflections of a preload are lowered, so that elements at their limits stick.
_BELOW_LIMIT = 1e-6
# Change of xi, in the largest eigenvalue, at which the search for the undamped motion ends.
_SETTLED = 1e-13
# Rates at the equilibrium, relative to the size of the equations, that are rounding.
_AT_REST = 1e-9


@dataclass(frozen=True, eq=False)
class LinearStart:
    """An undamped motion state + Re(shape exp(i w t)) of the linearised system with -xi M q'.

    Attributes
    ----------
    field : VectorField
        The system without excitation, over xi.
    values : (k,) array
        Its parameters, with xi.
    free : int
        Index of xi among them.
    state : (d,) array
        Rest, or steady sliding.
    shape : (d,) complex array
        Of the state, of length one.
    angular_frequency, xi : float
        w [rad/s] and xi [1/s], which may be below zero.
    loose : (r, m) array
        Orthonormal directions in which no stiffness holds the displacements.
    """

    field: VectorField
    values: Array
    free: int
    state: Array
    shape: ComplexArray
    angular_frequency: float
    xi: float
    loose: Array

    @property
    def displacements(self) -> int:
        """Number m of displacements, the first states; all d states of a user's field."""
        found = self.field
        return found.system().basis.modes if isinstance(found, ContactField) else found.dimension

    @property
    def lossless(self) -> bool:
        """Whether nothing is lost in the linear mode."""
        return abs(self.xi) <= CONSERVATIVE * self.angular_frequency


def unforced(system: ContactSystem) -> ContactSystem:
    """The system without the parts of drive and loads that depend on time; constant ones stay."""
    drive, load = system.drive, system.load
    kept: dict[str, Any] = {
        f"motion_{axis}": motion if isinstance(motion, Constant) else None
        for axis, motion in zip("xyz", (drive.motion_x, drive.motion_y, drive.motion_z),
                                strict=True)}
    none: dict[str, Any] = {f"amplitude_{axis}": 0.0 for axis in "xyz"}
    boundaries = [replace(one, **{name: _constant(getattr(one, name))
                                  for name in BOUNDARY_STRESSES})
                  for one in load.boundaries if _remains(one)]
    forces = [one for one in load.forces if isinstance(one.signal, Constant)]
    accelerations: dict[str, Any] = {
        f"base_acceleration_{axis}": signal if isinstance(signal, Constant) else None
        for axis, signal in zip("xyz", load.base_accelerations, strict=True)}
    return system.with_(
        drive=replace(drive, frequency_hz=0.0, **none, **kept),
        load=replace(load, forces=tuple(forces), boundaries=tuple(boundaries), **accelerations))


def _constant(given: float | Signal) -> Any:
    return 0.0 if isinstance(given, Signal) and not isinstance(given, Constant) else given


def _remains(load: BoundaryLoad) -> bool:
    """Whether a constant part of a boundary load is left."""
    return any(isinstance(value, Constant) or bool(value)
               for value in (_constant(getattr(load, name)) for name in BOUNDARY_STRESSES))


def with_mass_damping(system: ContactSystem, xi: float) -> ContactSystem:
    """The system with the forces xi M q' added: modal damping D - xi I."""
    basis = system.basis
    return system.with_(basis=replace(basis, damping=basis.damping - xi * np.eye(basis.modes)))


def field_over_xi(
    system: ContactSystem, xi: float, wave: EngineOrder | None = None
) -> ContactField:
    """The system without excitation over xi; that of a wave in the coordinates of its sector."""
    free = unforced(system if wave is None else wave.system(system))
    if wave is None:
        return contact_field(free, {XI: (xi, with_mass_damping)})
    # The negative damping of all masses of the wheel stands in the equations of the wave.
    return WaveField(ParametrisedSystem(free, {XI: (xi, unchanged)}), wave, unfolded=True)


def unchanged(system: ContactSystem, value: float) -> ContactSystem:
    """The system as it is, for a parameter that acts elsewhere."""
    return system


def linear_start(
    system: ContactSystem, number: int, preloaded: Array | None = None,
    wave: EngineOrder | None = None,
) -> LinearStart:
    """The linear mode ``number``, from 1, of the system at rest under its constant loads.

    The modes of a travelling wave are the modes of its nodal diameter.

    Friction with memory sticks in it, with the deflections of the state ``preloaded`` (d,) or none.
    Modes are counted by their damped frequencies at xi = 0; xi is then the negative damping under
    which the mode neither grows nor decays.

    Raises
    ------
    InputError
        If there is no such mode, or the ground shakes the system.
    """
    field = field_over_xi(system, 0.0, wave)
    free = field.system()
    if field.forcing_period(field.values) is not None:
        raise InputError("Waves of the moving ground excite the system; nonlinear modes need flat "
                         "ground, or ground at rest.")
    moves = free.prescribed_motion.largest_speed(0.0, 1.0) > 0.0
    state = ((steady_sliding if moves else rest_state)(field, field.values) if preloaded is None
             else _stuck(preloaded, free.basis.modes))
    state = _sliding_where_open(free, state)
    A = field.derivatives(np.zeros(1), state[None], field.values)[1][0]
    b = free.basis.modes
    # The mean of a wave is that of the diameter 0.
    means = b if wave is None else wave.wheel.basis.modes
    _, sizes, rows = np.linalg.svd(A[b : b + means, :means])
    loose = np.pad(rows[sizes <= _LOOSE * means * sizes[0]], ((0, 0), (0, b - means)))
    back: Array | ComplexArray = np.eye(len(A))
    if wave is not None:
        A, back = Waves(wave, unfolded=True).linearised(A)
    m = b if wave is None else len(wave.wheel.of(wave.order).stiffness)
    slope = np.zeros_like(A)
    slope[m : 2 * m, m : 2 * m] = np.eye(m)
    value, shape, xi = _undamped(A, slope, _eigenvalue(A, number))
    shape = back @ shape
    # The parameter's own scale is that of the mode.
    field = field_over_xi(system, xi, wave)
    return LinearStart(field, field.values, 0, state, shape / np.linalg.norm(shape), value, xi,
                       loose)


def linear_start_of_field(
    field: VectorField, unfolding: str | None, number: int
) -> LinearStart:
    """The linear mode ``number``, from 1, of a user's field about its equilibrium.

    The rates are linear in the unfolding parameter xi, which leaves the equilibrium where it is;
    modes are counted at xi = 0.

    Raises
    ------
    InputError
        If there is no such mode, xi moves the equilibrium, or the field depends on time.
    """
    name = field.parameter_or_only(unfolding)
    free = field.index(name)
    if field.forcing_period(field.values) is not None:
        raise InputError("nonlinear_mode: the field depends on time; leave out what excites it.")
    rest = find_equilibrium(field, {name: 0.0})
    beside = rest.values.copy()
    beside[free] = 1.0
    rates, A, _ = field.derivatives(np.zeros(1), rest.state[None], beside)
    if np.abs(rates).max() > _AT_REST * float(np.linalg.norm(A[0])) * (
            1.0 + float(np.linalg.norm(rest.state))):
        raise InputError(f"nonlinear_mode: {name!r} moves the equilibrium of the field; unfolding "
                         f"must name a damping, such as xi in x'' + f(x, x') - xi x' = 0.")
    value, shape, xi = _undamped(rest.jacobian, A[0] - rest.jacobian,
                                 _eigenvalue(rest.jacobian, number))
    values = rest.values.copy()
    values[free] = xi
    return LinearStart(field, values, free, rest.state, shape, value, xi,
                       np.zeros((0, field.dimension)))


def _eigenvalue(A: Array | ComplexArray, number: int) -> complex:
    """Eigenvalue of the mode ``number``, from 1; InputError if there is none."""
    values = np.linalg.eigvals(A)
    found = values[values.imag > _ZERO * np.abs(values).max(initial=0.0)]
    found = found[np.argsort(found.imag)]
    count = len(found)
    if not (isinstance(number, int | np.integer) and not isinstance(number, bool)
            and 1 <= number <= count):
        known = listed_frequencies(found.imag / (2.0 * np.pi)) if count else "none"
        raise InputError(f"mode = {number!r} must be the number of an oscillating mode, from 1 to "
                         f"{count}; the frequencies at rest are: {known}.")
    return complex(found[number - 1])


def _stuck(state: Array, modes: int) -> Array:
    """The state with elements that are at their limits just below them: they stick."""
    found = np.array(state, dtype=float)
    found[2 * modes :] *= 1.0 - _BELOW_LIMIT
    return found


def _sliding_where_open(system: ContactSystem, state: Array) -> Array:
    """The state with friction that slides at nodes without normal force.

    There the limit of an element is zero, and at zero deflection it would count as stuck.
    """
    found, s = state.copy(), system.memory
    if s:
        force = system.at(state).normal_force
        z = found[2 * system.basis.modes :].reshape(-1, s)
        z[force == 0.0] = np.finfo(float).tiny
    return found


def listed_frequencies(frequencies_hz: Array) -> str:
    """Frequencies (r,) of modes in words, for messages."""
    shown = [f"{value:.5g}" for value in frequencies_hz[:8]]
    return ", ".join(shown) + (" ..." if len(frequencies_hz) > 8 else "") + " Hz"


def _undamped(
    A: Array | ComplexArray, E: Array | ComplexArray, value: complex
) -> tuple[float, ComplexArray, float]:
    """Frequency, shape and xi for which the eigenvalue followed from ``value`` is i w.

    The matrix is A + xi E, of the state [q, q', z] of a contact system with E = diag(0, I, 0);
    Newton's method for the real part, with the slope ``s^T E r / s^T r`` of left and right
    eigenvectors.
    """
    from scipy.linalg import eig

    xi = 0.0
    for _ in range(_ITERATIONS):
        eigenvalues, left, right = eig(A + xi * E, left=True)
        at = int(np.argmin(np.abs(eigenvalues - value)))
        value, s, r = complex(eigenvalues[at]), left[:, at].conj(), right[:, at]
        if not value.imag > 0.0:
            break
        slope = complex(s @ E @ r / (s @ r))
        change = -value.real / slope.real
        xi, value = xi + change, value + change * slope
        # Eigenvalues have the rounding of the largest one.
        if abs(change) <= _SETTLED * np.abs(eigenvalues).max():
            return float(value.imag), np.asarray(r / np.linalg.norm(r)), float(xi)
    raise AnalysisError(f"The linear mode at {value.imag / (2.0 * np.pi):.5g} Hz is damped too "
                        f"strongly to be followed: with less damping it does not become an "
                        f"oscillation of its own.")
