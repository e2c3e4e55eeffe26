"""Data over frequency: natural frequencies, backbones, receptances, responses at one level."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from fecontact.analysis.complex_modes import complex_modes, prestressed_modes
from fecontact.analysis.receptance import (
    Kind,
    Place,
    receptance,
    receptance_derivative,
    response_unit,
)
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.response import frequency_response
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import nonlinear_mode
from fecontact.core.checks import as_integers, as_numbers, require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray, Integers
from fecontact.fitting.data import Curve, FitData, finite_columns, freeze, spread
from fecontact.fitting.data_in_time import CurveData
from fecontact.measured.amplitude_curve import AmplitudeCurve, mode_curve
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.loading import load_history
from fecontact.system.quasistatic.path import LoadPath

_MARGIN = 1.05  # by which a computed mode reaches beyond the measured amplitudes
_RIGID = 1e-6  # part of the highest frequency up to which a mode counts as rigid
# Relative distance of frequencies below which their derivatives are not those of single modes;
# second differences of matrices that depend linearly, and their rounding.
_APART, _BENT, _ROUNDED = 1e-6, 1e-6, 1e-13


@read_only_arrays
@dataclass(frozen=True, eq=False)
class FrequencyData(FitData):
    """Natural frequencies, compared with those of the linearised model.

    Parameters
    ----------
    frequencies_hz : (n,) array
        Measured natural frequencies [Hz].
    deviation : float or (n,) array, optional
        Standard deviations [Hz]; without any, they follow from the residuals.
    modes : (n,) integers, optional
        Numbers of the model's modes, from 1 by ascending frequency, rigid ones left out;
        by default the first ones. Pair modes by their shapes first, see
        :func:`fecontact.measured.pair_modes`.
    about : 'rest', 'sliding' or LoadPath, optional
        State about which the contact is linearised: an equilibrium, or the end of quasi-static
        loading, where friction sticks. By default the contact is left out.

    Raises
    ------
    InputError
        For values that are not finite, or numbers of modes that do not fit to them.
    """

    compared: ClassVar[str] = "frequencies_hz"

    frequencies_hz: Array
    deviation: Any = None
    modes: Integers | None = None
    about: Any = None

    def __post_init__(self) -> None:
        values = finite_columns("FrequencyData", frequencies_hz=self.frequencies_hz)
        n = len(values["frequencies_hz"])
        modes = (np.arange(1, n + 1) if self.modes is None
                 else as_integers(self.modes, "FrequencyData: modes"))
        if modes.shape != (n,) or (modes < 1).any():
            raise InputError(f"FrequencyData: modes must be {n} whole numbers from 1, one for each "
                             f"frequency.")
        freeze(self, **values, modes=modes, deviation=spread(self.deviation, n, "FrequencyData"))

    def predicted(self, system: ContactSystem) -> Array:
        """Frequencies (n,) of the model [Hz]."""
        assert self.modes is not None
        if isinstance(self.about, LoadPath):
            found = prestressed_modes(system, load_history(system, self.about))
        else:
            found = complex_modes(system, self.about)
        hertz = np.sort(found.frequencies_hz[found.frequencies_hz > _RIGID * float(
            found.frequencies_hz.max(initial=0.0))])
        if len(hertz) < self.modes.max():
            raise AnalysisError(f"The model has {len(hertz)} vibrating modes, fewer than the mode "
                                f"{self.modes.max()} that was measured.")
        return np.asarray(hertz[self.modes - 1])

    def derivative(self, system: ContactSystem, parameter: str) -> Array | None:
        """Derivative (n,) of the eigenvalues, s^T (dA/dp) r, if the contact is left out.

        None at frequencies that coincide, and for parameters on which K and C do not depend
        linearly.
        """
        changes = _matrix_changes(system, parameter) if self.about is None else None
        if changes is None:
            return None
        assert self.modes is not None
        found = complex_modes(system)
        hertz = found.frequencies_hz
        kept = np.flatnonzero(hertz > _RIGID * float(hertz.max(initial=0.0)))
        kept = kept[np.argsort(hertz[kept])]
        if len(kept) < self.modes.max() or (np.diff(hertz[kept]) < _APART * hertz[kept[1:]]).any():
            return None
        zero = np.zeros_like(changes[0])
        moved = found.sensitivity(np.block([[zero, zero], [-changes[0], -changes[1]]]))
        return np.asarray(moved.imag[kept[self.modes - 1]] / (2.0 * np.pi))

    def curves(self) -> list[Curve]:
        """Frequencies over the numbers of their modes."""
        assert self.modes is not None
        return [Curve("mode", self.modes.astype(float), "frequency [Hz]",
                      slice(0, len(self.modes)), joined=False)]


@read_only_arrays
@dataclass(frozen=True, eq=False)
class BackboneData(CurveData):
    """Frequency and damping over amplitude, compared with a nonlinear mode by harmonic balance.

    Parameters
    ----------
    curve : AmplitudeCurve
        Measured frequencies and damping ratios, with their deviations.
    mode : int
        Number of the linear mode, from 1.
    point, component
        Displacement whose half range is the amplitude.
    method : HarmonicBalance, optional
        Harmonics and samples.
    options : ContinuationOptions, optional
        Steps along the branch.

    Raises
    ------
    InputError
        For a curve or method that is none.
    """

    curve: AmplitudeCurve
    mode: int = 1
    point: str | int = "B"
    component: str = "x"
    method: HarmonicBalance | None = None
    options: ContinuationOptions | None = None

    def __post_init__(self) -> None:
        require_kind("BackboneData", AmplitudeCurve, curve=self.curve)
        require_kind("BackboneData", (HarmonicBalance, type(None)), method=self.method)

    def at(self, system: ContactSystem, amplitude: Array) -> Array:
        """Frequencies [Hz], then damping ratios of the mode, over amplitudes."""
        A = amplitude
        mode = nonlinear_mode(system, (float(A.min()) / _MARGIN, float(A.max()) * _MARGIN),
                              self.mode, observe=(self.point, self.component), method=self.method,
                              options=self.options)
        if mode.branch.status is BranchStatus.INTERRUPTED:
            raise KeyboardInterrupt
        found = mode_curve(mode)
        if found.amplitude.max() < A.max():
            raise AnalysisError(f"The nonlinear mode ends at the amplitude "
                                f"{found.amplitude.max():.4g}, below the largest measured one, "
                                f"{A.max():.4g}.")
        return np.concatenate(found.at(np.maximum(A, found.amplitude.min())))


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ReceptanceData(FitData):
    """A frequency response function, compared with that of the linear or linearised model.

    Parameters
    ----------
    frequency_hz : (F,) array
        Frequencies [Hz].
    values : (F,) complex array
        Measured response per force.
    excitation, response : (point, component)
        Point and component of the excitation and of the response in the measurement.
    deviation : float or (F,) array, optional
        Standard deviations of real and of imaginary part; without any, they follow from the
        residuals.
    kind : 'receptance', 'mobility' or 'accelerance'
        Displacement, velocity or acceleration per force.
    about : 'rest' or 'sliding', optional
        Equilibrium about which the contact is linearised; by default it is left out.

    Raises
    ------
    InputError
        For arrays that do not fit together or are not finite.
    """

    frequency_hz: Array
    values: ComplexArray
    excitation: Place = ("B", "x")
    response: Place = ("B", "x")
    deviation: Any = None
    kind: Kind = "receptance"
    about: Any = None

    def __post_init__(self) -> None:
        H = np.asarray(as_numbers(self.values, "ReceptanceData: values"), dtype=complex)
        columns = finite_columns("ReceptanceData", frequency_hz=self.frequency_hz, real=H.real,
                                 imaginary=H.imag)
        freeze(self, frequency_hz=columns["frequency_hz"], values=H,
               deviation=spread(self.deviation, len(H), "ReceptanceData"))

    @property
    def measured(self) -> Array:
        """Real parts, then imaginary parts (2 F,)."""
        return np.concatenate([self.values.real, self.values.imag])

    @property
    def deviations(self) -> Array | None:
        """Standard deviations (2 F,)."""
        return None if self.deviation is None else np.tile(self.deviation, 2)

    def predicted(self, system: ContactSystem) -> Array:
        """Real and imaginary parts of the model (2 F,)."""
        H = receptance(system, self.frequency_hz, [self.excitation], [self.response],
                       kind=self.kind, linearised_at=self.about).values[:, 0, 0]
        return np.concatenate([H.real, H.imag])

    def derivative(self, system: ContactSystem, parameter: str) -> Array | None:
        """Derivative (2 F,) of the response, if the contact is left out.

        None for parameters on which K and C do not depend linearly.
        """
        changes = _matrix_changes(system, parameter) if self.about is None else None
        if changes is None:
            return None
        H = receptance_derivative(system, self.frequency_hz, self.excitation, self.response,
                                  self.kind, *changes)
        return np.concatenate([H.real, H.imag])

    def curves(self) -> list[Curve]:
        """Real and imaginary part over frequency."""
        n = len(self.frequency_hz)
        unit = response_unit(self.kind, self.response, self.excitation)
        return [Curve("frequency [Hz]", self.frequency_hz, f"{part} {self.kind} [{unit}]", where)
                for part, where in (("real", slice(0, n)), ("imaginary", slice(n, 2 * n)))]


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ResponseData(FitData):
    """Amplitudes over the frequency of the excitation, compared with harmonic balance.

    Of several amplitudes at a frequency the one nearest to the measured one counts. Several levels
    are several data, with ``changes={"drive.amplitude_x": 2e-3}``.

    Parameters
    ----------
    frequency_hz, amplitude : (n,) arrays
        Frequencies [Hz] and half ranges of the displacement.
    deviation : float or (n,) array, optional
        Standard deviations of the amplitudes; without any, they follow from the residuals.
    point, component
        Displacement that was measured.
    parameter : str
        Dotted name of the frequency of the excitation [Hz].
    method : HarmonicBalance, optional
        Harmonics and samples.
    options : ContinuationOptions, optional
        Steps along the branch.

    Raises
    ------
    InputError
        For arrays that do not fit together or are not finite.
    """

    compared: ClassVar[str] = "amplitude"

    frequency_hz: Array
    amplitude: Array
    deviation: Any = None
    point: str | int = "B"
    component: str = "x"
    parameter: str = "drive.frequency_hz"
    method: HarmonicBalance | None = None
    options: ContinuationOptions | None = None

    def __post_init__(self) -> None:
        columns = finite_columns("ResponseData", frequency_hz=self.frequency_hz,
                                 amplitude=self.amplitude)
        require_kind("ResponseData", (HarmonicBalance, type(None)), method=self.method)
        if len(columns["amplitude"]) < 2 or not (columns["frequency_hz"] > 0.0).all():
            raise InputError("ResponseData: give two frequencies or more, all above zero.")
        freeze(self, **columns, deviation=spread(self.deviation, len(columns["amplitude"]),
                                                 "ResponseData"))

    def predicted(self, system: ContactSystem) -> Array:
        """Amplitudes of the model (n,)."""
        wanted = self.frequency_hz
        low, high = float(wanted.min()), float(wanted.max())
        method = self.method or HarmonicBalance(stability=None)
        found = frequency_response(
            system, (low, high * (1.0 + 1e-9)), self.parameter,
            observe=(self.point, self.component), method=method, options=self.options)
        if found.branches[0].status is BranchStatus.INTERRUPTED:
            raise KeyboardInterrupt
        curve = _spline(found.branches[0].parameter, found.amplitude())
        return np.array([_nearest(*curve, at, seen)
                         for at, seen in zip(wanted, self.amplitude, strict=True)])

    def curves(self) -> list[Curve]:
        """Amplitude over frequency."""
        return [Curve("frequency [Hz]", self.frequency_hz, "amplitude [m]",
                      slice(0, len(self.amplitude)))]


def _matrix_changes(system: ContactSystem, parameter: str) -> tuple[Array, Array] | None:
    """Derivatives of stiffness and damping (m, m) over a parameter on which they depend linearly.

    Differences over a half of its value, which are exact then; None for other parameters, those of
    the study that the system does not have, and those that are zero.
    """
    try:
        value = system.parameter(parameter)
        if not isinstance(value, float) or value == 0.0:
            return None
        low, here, high = (np.stack([one.arrays.stiffness, one.arrays.damping]) for one in (
            system.with_({parameter: factor * value}) for factor in (0.5, 1.0, 1.5)))
    except InputError:
        return None
    bent = np.abs(high - 2.0 * here + low).max(axis=(1, 2))
    size = np.abs(here).max(axis=(1, 2))
    if (bent > _BENT * np.abs(high - low).max(axis=(1, 2)) + _ROUNDED * size).any():
        return None
    stiffness, damping = (high - low) / value
    return stiffness, damping


def _spline(f: Array, A: Array) -> tuple[Array, Any]:
    """Places s (k,) of the points of a branch, and a cubic spline of f and log A over s."""
    from scipy.interpolate import CubicSpline

    points = np.column_stack([f / np.mean(f), np.log(A)])
    chords = np.hypot(*np.diff(points, axis=0).T)
    # Special points repeat their neighbours.
    kept = np.append(True, chords > 1e-9)
    s = np.append(0.0, np.cumsum(chords[kept[1:]]))
    if len(s) < 2:
        raise AnalysisError("The response of the model has a single point.")
    return s, CubicSpline(s, np.column_stack([f, np.log(A)])[kept])


def _nearest(s: Array, curve: Any, at: float, seen: float) -> float:
    """Amplitude of a branch at a frequency, of several the nearest to a measured one."""
    from scipy.optimize import brentq

    off = curve(s)[:, 0] - at
    off[np.abs(off) < 1e-12 * at] = 0.0
    found = [float(np.exp(curve(place)[1])) for place in s[off == 0.0]]
    found += [float(np.exp(curve(brentq(lambda x: float(curve(x)[0]) - at, s[k], s[k + 1]))[1]))
              for k in np.flatnonzero(off[:-1] * off[1:] < 0.0)]
    if not found:
        raise AnalysisError(f"The response of the model ends before {at:.5g} Hz.")
    return min(found, key=lambda value: abs(value - seen))
