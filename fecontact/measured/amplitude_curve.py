"""Frequency and damping of one mode over its amplitude, from any source."""

from dataclasses import dataclass

import numpy as np

from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Summarised, span
from fecontact.reduction.modal_basis import ModalBasis

_COLUMNS = ("frequency_hz", "damping_ratio", "frequency_deviation_hz", "damping_deviation",
            "amplitude_deviation", "time")
_DEGREE = 3  # of the polynomials in log amplitude whose slopes are taken


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class AmplitudeCurve(Summarised):
    r"""Frequency and damping of one mode over its amplitude.

    With the local rate :math:`s = A'/A + i \varphi'` of a decaying vibration
    :math:`x = A \cos \varphi`

    .. math:: f = \frac{|s|}{2 \pi}, \qquad \zeta = -\frac{A'}{A\,|s|}

    so that a linear oscillator has its undamped frequency and its damping ratio at all amplitudes,
    as nonlinear modes have them.

    Attributes
    ----------
    amplitude : (N,) array
        Amplitudes in ``unit``.
    frequency_hz : (N,) array
        Undamped frequencies [Hz].
    damping_ratio : (N,) array
        Damping ratios [-].
    frequency_deviation_hz, damping_deviation : (N,) arrays or None
        Standard deviations of both; None if they are not known.
    time : (N,) array or None
        Times to which the points belong [s]; None unless they come from a ring-down.
    unit : str
        Unit of the amplitude.
    observed : str
        Title of the amplitude, such as 'B x'.
    note : str
        Part of the data that was left out and the reason; empty for none.
    deviation_freedom : float
        Degrees of freedom with which the deviations were estimated, at least; infinite if they are
        known.
    amplitude_deviation : (N,) array or None
        Standard deviations of the amplitudes; None if the amplitudes are exact.
    correlation : (N, 3, 3) array or None
        Correlations of the errors of log amplitude, frequency and damping ratio; None if they are
        independent.

    Raises
    ------
    InputError
        For arrays of unequal lengths or without points, and for amplitudes or frequencies that are
        not above zero.
    """

    amplitude: Array
    frequency_hz: Array
    damping_ratio: Array
    frequency_deviation_hz: Array | None = None
    damping_deviation: Array | None = None
    time: Array | None = None
    unit: str = "m"
    observed: str = ""
    note: str = ""
    deviation_freedom: float = float("inf")
    amplitude_deviation: Array | None = None
    correlation: Array | None = None

    def __post_init__(self) -> None:
        amplitude = as_floats(self.amplitude, "AmplitudeCurve: amplitude")
        object.__setattr__(self, "amplitude", amplitude)
        if amplitude.ndim != 1 or not len(amplitude):
            raise InputError("AmplitudeCurve: amplitude must be a list of one number or more.")
        for name in _COLUMNS:
            if (given := getattr(self, name)) is None:
                continue
            values = as_floats(given, f"AmplitudeCurve: {name}")
            if values.shape != amplitude.shape:
                raise InputError(f"AmplitudeCurve: {name} has the shape {values.shape}; it must "
                                 f"have one value for each of the {len(amplitude)} amplitudes.")
            object.__setattr__(self, name, values)
        if self.correlation is not None:
            known = as_floats(self.correlation, "AmplitudeCurve: correlation")
            if known.shape != (len(amplitude), 3, 3):
                raise InputError(f"AmplitudeCurve: correlation has the shape {known.shape}; it "
                                 f"must be ({len(amplitude)}, 3, 3).")
            object.__setattr__(self, "correlation", known)
        for name in ("amplitude", "frequency_hz"):
            if not (getattr(self, name) > 0.0).all():
                raise InputError(f"AmplitudeCurve: every {name} must be above zero.")

    def __len__(self) -> int:
        return len(self.amplitude)

    def at(self, amplitude: ArrayLike) -> tuple[Array, Array]:
        """Frequency [Hz] and damping ratio at amplitudes, by monotone cubics over their logarithm.

        Raises
        ------
        InputError
            If an amplitude lies outside of the curve.
        """
        wanted = as_floats(amplitude, "AmplitudeCurve.at: amplitude")
        from scipy.interpolate import PchipInterpolator

        known, order = np.unique(self.amplitude, return_index=True)
        if not ((wanted >= known[0]) & (wanted <= known[-1])).all():
            raise InputError(f"AmplitudeCurve.at: amplitude = {amplitude!r} must lie within the "
                             f"curve, from {known[0]:.6g} to {known[-1]:.6g} {self.unit}.")
        if len(known) == 1:
            return (np.full(wanted.shape, self.frequency_hz[order[0]]),
                    np.full(wanted.shape, self.damping_ratio[order[0]]))
        found = PchipInterpolator(np.log(known), np.stack(
            [self.frequency_hz[order], self.damping_ratio[order]], axis=1))(np.log(wanted))
        return np.asarray(found[..., 0]), np.asarray(found[..., 1])

    def covariance_at_amplitude(self, slopes: Array | None = None) -> Array | None:
        r"""Covariance of the errors of frequency and damping ratio at the stated amplitudes.

        To first order an error of the amplitude moves both along their slopes: with the errors e
        of log amplitude, frequency and damping ratio,

        .. math:: C = B \, \mathrm{Cov}(e) \, B^T, \qquad B = \begin{pmatrix}
            -df / d \ln A & 1 & 0 \\ -d \zeta / d \ln A & 0 & 1 \end{pmatrix}

        Parameters
        ----------
        slopes : (2, N) array, optional
            Slopes of frequency [Hz] and damping ratio over log A, such as those of a model; by
            default those of the curve itself, by polynomials in log A, cubic ones for four points
            or more. Of their squares the part that the deviations alone would give is left out.

        Returns
        -------
        (N, 2, 2) array or None
            Covariances, with frequencies in Hz; None if the deviations of frequency or damping are
            not known.
        """
        if self.frequency_deviation_hz is None or self.damping_deviation is None:
            return None
        moved = (np.zeros(len(self)) if self.amplitude_deviation is None
                 else self.amplitude_deviation / self.amplitude)
        deviation = np.stack([moved, self.frequency_deviation_hz, self.damping_deviation], axis=1)
        covariance = deviation[:, :, None] * deviation[:, None, :] * (
            np.eye(3) if self.correlation is None else self.correlation)
        turned = np.zeros((len(self), 2, 3))
        turned[:, :, 0] = -(self._slopes() if slopes is None else np.asarray(slopes)).T
        turned[:, 0, 1] = turned[:, 1, 2] = 1.0
        return np.asarray(turned @ covariance @ np.swapaxes(turned, 1, 2))

    def _slopes(self) -> Array:
        """Slopes (2, N) of frequency and damping ratio over log amplitude."""
        level = np.log(self.amplitude)
        level -= level.mean()
        powers = np.vander(level, min(_DEGREE, len(self) - 1) + 1, increasing=True)
        rates = np.zeros(powers.shape)
        rates[:, 1:] = powers[:, :-1] * np.arange(1.0, powers.shape[1])
        found = []
        for values, deviation in ((self.frequency_hz, self.frequency_deviation_hz),
                                  (self.damping_ratio, self.damping_deviation)):
            assert deviation is not None
            # Slopes are the weighted values times these rows.
            rows = rates @ np.linalg.pinv(powers / deviation[:, None])
            slopes = rows @ (values / deviation)
            squares = np.maximum(slopes**2 - (rows**2).sum(axis=1), 0.0)
            found.append(np.copysign(np.sqrt(squares), slopes))
        return np.stack(found)

    def summary(self) -> list[tuple[str, str]]:
        """Amplitudes, frequencies, damping ratios, and the note."""
        return [("observed", self.observed or "unnamed"), ("points", f"{len(self)}"),
                ("amplitude", span(self.amplitude, self.unit)),
                ("frequency", span(self.frequency_hz, "Hz")),
                ("damping ratio", span(self.damping_ratio)),
                *([("note", self.note)] if self.note else [])]


def mode_curve(mode: NonlinearMode) -> AmplitudeCurve:
    """Frequency and damping of a nonlinear mode over its amplitude.

    Parameters
    ----------
    mode : NonlinearMode
        Mode of :func:`fecontact.bifurcation.nonlinear_mode`.
    """
    require_kind("mode_curve", NonlinearMode, mode=mode)
    return AmplitudeCurve(mode.amplitude, mode.frequency_hz, mode.damping_ratio, unit=_unit(
        mode.observed), observed=mode.observed)


def backbone_curve(curve: ResonanceCurve, force: Array | None = None, *, modal_mass: float,
                   ) -> AmplitudeCurve:
    r"""Frequency and damping from a backbone of phase resonances.

    At phase resonance a force of amplitude P at the observed place, along the observed direction,
    balances the damping force of the mode: with the first harmonic X of the displacement and the
    modal mass m

    .. math:: \zeta = \frac{P}{2\, m\, \omega^2 |X|}

    Parameters
    ----------
    curve : ResonanceCurve
        Curve of :func:`fecontact.bifurcation.resonance_curve` over the amplitude of the force, with
        ``condition = "phase"``.
    force : (N,) array, optional
        Amplitudes of the force at the observed place [N]; by default the parameter of the curve.
    modal_mass : float
        Mass of the mode for a displacement of one at the observed place [kg], ``1 / phi^2`` for a
        mass-normalised shape; see :func:`modal_mass_at`.

    Raises
    ------
    InputError
        If the curve is not one of phase resonances, or the forces do not fit to its points.
    """
    require_kind("backbone_curve", ResonanceCurve, curve=curve)
    require_positive("backbone_curve", modal_mass=modal_mass)
    if curve.condition != "phase":
        raise InputError(f"backbone_curve: the resonances are those of the {curve.condition}; "
                         f"follow the curve with condition = 'phase'.")
    P = as_floats(curve.parameter if force is None else force, "backbone_curve: force")
    if P.shape != (len(curve),):
        raise InputError(f"backbone_curve: force has the shape {P.shape}; it must have one value "
                         f"for each of the {len(curve)} points.")
    w, X = 2.0 * np.pi * curve.frequency_hz, np.abs(curve.harmonic(1))
    return AmplitudeCurve(curve.amplitude, curve.frequency_hz, P / (2.0 * modal_mass * w**2 * X),
                          unit=_unit(curve.observed), observed=curve.observed)


def modal_mass_at(basis: ModalBasis, mode: int, point: str | int = "B", component: str = "x",
                  ) -> float:
    """Mass of a mode for a displacement of one at a point, ``1 / phi^2`` [kg].

    Parameters
    ----------
    basis : ModalBasis
        Basis with mass-normalised shapes phi.
    mode : int
        Number of the mode, from 1.
    point, component
        Place and direction of the displacement.

    Raises
    ------
    InputError
        If there is no such mode or point, or the mode does not move there.
    """
    require_kind("modal_mass_at", ModalBasis, basis=basis)
    row = basis.point_row(point, component)
    if isinstance(mode, bool) or not isinstance(mode, int) or not 1 <= mode <= basis.modes:
        raise InputError(f"modal_mass_at: mode = {mode!r} must be a whole number from 1 to "
                         f"{basis.modes}.")
    phi = float(row[mode - 1])
    if phi == 0.0:
        raise InputError(f"modal_mass_at: mode {mode} does not move {point} along {component}; "
                         f"take another place.")
    return 1.0 / phi**2


def _unit(observed: str) -> str:
    return "rad" if observed.split()[-1].startswith("phi") else "m"
