"""Instantaneous frequency and damping of a decaying vibration, by local fits of one mode."""

from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np

from fecontact.analysis.spectra import amplitude_spectrum, evenly_sampled
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.measured.amplitude_curve import AmplitudeCurve
from fecontact.measured.series import Source, series_of

# Half the width of the main lobe of the Blackman-Harris window, in inverse lengths of the window.
_LOBE = 4.0
# Fewest samples in a period and periods in a window.
_SAMPLES, _PERIODS = 4.0, 4.0
# Iterations of a local fit, and the relative change of the rate at which it ends.
_ITERATIONS, _CONVERGED = 60, 1e-13
# Largest standard deviation of the logarithm of an amplitude; weaker vibrations are noise.
_WEAK = 0.2
# Distances from the mode at which noise is looked at, in inverse lengths of the window, and the
# number of neighbouring windows over which it is averaged.
_BESIDE, _AVERAGED = (5.0, 6.0, 7.0, 8.0), 9
_CHUNK = 400_000  # samples fitted at a time


def ring_down(
    source: Source, values: ArrayLike | None = None, *, frequency_hz: float | None = None,
    window: float = 10.0, overlap: float = 0.5, t_start: float | None = None,
    t_end: float | None = None, derivative: int | None = None, resample: bool = False,
    **channel: Any,
) -> AmplitudeCurve:
    r"""Frequency and damping over amplitude from a free decay, by local fits of one mode.

    About the middle of each window the samples are fitted, with Blackman-Harris weights, by

    .. math:: x(\tau) = \operatorname{Re} [a\, e^{s \tau + s_2 \tau^2 / 2}], \quad
        s = A'/A + i \varphi'

    The window of length L is a band-pass of +-4 / L about the mode, beyond which other modes must
    lie. Linear decays are found exactly; where the rate bends, the bias is ``s'' <tau^4> / (6
    <tau^2>)``, about 0.0088 L^2 s''. Half a window at both ends has no points. The damping ratio is
    that of the action A^2 w, ``-(A'/A + w'/(2 w)) / |s|``, for which a frequency that changes with
    the amplitude is no damping.

    Parameters
    ----------
    source, values
        Times [s] and values; or a ``Trajectory`` or ``Measurement`` alone.
    frequency_hz : float, optional
        Frequency of the mode [Hz], to a fifth; by default that of the highest peak of the spectrum.
    window : float
        Length L of the windows, in periods.
    overlap : float
        Part by which windows overlap, below 1; beyond one half, errors of neighbours correlate.
    t_start, t_end : float, optional
        Part of the record [s], such as without the blow at its beginning.
    derivative : 0, 1 or 2, optional
        Order of the time derivative of displacement that the values are; by default by their unit.
    resample : bool
        Whether to interpolate uneven times by splines.
    **channel
        ``quantity``, ``point`` and ``component`` of a run, as for
        :func:`fecontact.analysis.history`; ``channel`` of a measurement, by name or number.

    Returns
    -------
    AmplitudeCurve
        One point for each window, with deviations and correlations by the noise beside the mode.

    Raises
    ------
    InputError, AnalysisError
        For uneven or coarse times, values out of range, and if no mode stands out from the rest.
    """
    series = series_of(source, values, "ring_down", channel)
    if derivative not in (None, 0, 1, 2) or isinstance(derivative, bool):
        raise InputError(f"ring_down: derivative = {derivative!r} must be 0 for displacements, 1 "
                         f"for velocities or 2 for accelerations.")
    order = series.derivative if derivative is None else derivative
    t, x = evenly_sampled(series.time, series.values, resample=resample)
    t, x = _part(t, x, t_start, t_end)
    if not (isinstance(overlap, Real) and 0.0 <= overlap < 1.0):
        raise InputError(f"ring_down: overlap = {overlap!r} must be from 0 to below 1.")
    step = float(t[1] - t[0])
    f = _frequency(t, x, frequency_hz)
    half = _half_window(t, step, f, window)
    apart = max(1, round(2 * half * (1.0 - overlap)))
    middles = np.arange(half, len(x) - half, apart)
    scale = float(np.abs(x).max())
    if not scale > 0.0:
        raise AnalysisError("ring_down: all values are zero; there is no vibration to follow.")
    amplitude, rate, bend, covariance = _local_fits(x / scale, middles, half, step, f)
    size = np.abs(rate)
    with np.errstate(invalid="ignore"):
        kept = (np.isfinite(size) & (covariance[:, 0, 0] < _WEAK**2)
                & (np.abs(rate.imag / (2.0 * np.pi * f) - 1.0) < _LOBE / (2.0 * half * step * f)))
    if not kept.any():
        raise AnalysisError(f"ring_down: no window holds a vibration near {f:.5g} Hz that stands "
                            f"out from the rest; give its frequency, or a longer window.")
    size, rate, bend = size[kept], rate[kept], bend[kept]
    ratio = -(rate.real + bend.imag / (2.0 * rate.imag)) / size
    covariance = _of_curve(covariance[kept], rate, bend, ratio, order)
    deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    found = scale * amplitude[kept] / size**order
    return AmplitudeCurve(
        found, size / (2.0 * np.pi), ratio, deviation[:, 1], deviation[:, 2], t[middles[kept]],
        _displacement(series.unit, order), series.title,
        _note(half * step, int(np.count_nonzero(~kept)), len(kept)),
        _noise_freedom(half, step, f, apart, len(middles)), found * deviation[:, 0],
        covariance / (deviation[:, :, None] * deviation[:, None, :]))


def _of_curve(
    covariance: Array, rate: ComplexArray, bend: ComplexArray, ratio: Array, order: int
) -> Array:
    """Covariances (P, 3, 3) of log amplitude, frequency [Hz] and damping ratio.

    They follow from those (P, 4, 4) of log |a|, both parts of s and the imaginary part of s_2.
    """
    size = np.abs(rate)
    of_size = np.zeros((len(size), 4))  # change of log |s|
    of_size[:, 1], of_size[:, 2] = rate.real / size**2, rate.imag / size**2
    turned = np.zeros((len(size), 3, 4))
    turned[:, 0] = -order * of_size
    turned[:, 0, 0] += 1.0
    turned[:, 1] = (size / (2.0 * np.pi))[:, None] * of_size
    turned[:, 2] = -ratio[:, None] * of_size
    turned[:, 2, 1] -= 1.0 / size
    turned[:, 2, 2] += bend.imag / (2.0 * rate.imag**2 * size)
    turned[:, 2, 3] -= 1.0 / (2.0 * rate.imag * size)
    return np.asarray(turned @ covariance @ np.swapaxes(turned, 1, 2))


def _displacement(unit: str, order: int) -> str:
    for rate in ("/s^2", "/s")[2 - order:] if order else ():
        if unit.endswith(rate):
            return unit.removesuffix(rate)
    return unit


def _note(half: float, weak: int, windows: int) -> str:
    text = f"{half:.4g} s at both ends are left out, half a window"
    if weak:
        text += f"; in {weak} of {windows} windows the mode does not stand out from the rest"
    return text


def _part(t: Array, x: Array, t_start: float | None, t_end: float | None) -> tuple[Array, Array]:
    from fecontact.integrate.trajectory import output_part

    chosen = output_part(t, t_start, t_end)
    return t[chosen], x[chosen]


def _frequency(t: Array, x: Array, given: float | None) -> float:
    """Frequency of the mode [Hz], given or by the highest peak of the spectrum."""
    if given is not None:
        require_positive("ring_down", frequency_hz=given)
        return float(given)
    peaks = amplitude_spectrum(t, x).peaks(1) if len(t) >= 8 else []
    if not peaks or not peaks[0].frequency_hz > 0.0:
        raise AnalysisError("ring_down: the spectrum has no peak; give the frequency of the mode.")
    return peaks[0].frequency_hz


def _half_window(t: Array, step: float, f: float, window: float) -> int:
    """Half the number of samples in a window; InputError if it does not fit."""
    if not (isinstance(window, Real) and window >= _PERIODS):
        raise InputError(f"ring_down: window = {window!r} must be at least {_PERIODS:g} periods.")
    if f * step * _SAMPLES > 1.0:
        raise InputError(f"ring_down: the samples are {step:.4g} s apart, {1.0 / (f * step):.3g} "
                         f"in a period at {f:.4g} Hz; at least {_SAMPLES:g} are needed.")
    half = round(0.5 * window / (f * step))
    if 2 * half + 1 > len(t):
        raise InputError(f"ring_down: a window of {window:g} periods at {f:.4g} Hz is "
                         f"{window / f:.4g} s long, the record {t[-1] - t[0]:.4g} s; take a "
                         f"shorter window or a longer record.")
    return half


def _local_fits(
    x: Array, middles: Sequence[int] | Array, half: int, step: float, f: float
) -> tuple[Array, ComplexArray, ComplexArray, Array]:
    """Amplitudes, rates s and s_2, and the covariance of their errors.

    Covariances (P, 4, 4) are those of log amplitude, both parts of s, the imaginary part of s_2.
    """
    from scipy.signal import windows as shapes

    tau = np.asarray(step * np.arange(-half, half + 1), dtype=np.float64)
    weights = shapes.blackmanharris(len(tau))
    found = [_fits(np.stack([x[k - half : k + half + 1] for k in part]), tau, weights, f)
             for part in np.array_split(np.asarray(middles),
                                        max(1, len(middles) * len(tau) // _CHUNK))]
    amplitude, rate, bend, unit, noise = (np.concatenate(parts) for parts in zip(
        *found, strict=True))
    count = min(_AVERAGED, len(noise))
    near = np.convolve(noise, np.ones(count), "same") / np.convolve(
        np.ones(len(noise)), np.ones(count), "same")
    return amplitude, rate, bend, unit * near[:, None, None]


def _fits(
    x: Array, tau: Array, weights: Array, f: float
) -> tuple[Array, ComplexArray, ComplexArray, Array, Array]:
    """Results of :func:`_local_fits` for windows x (P, L).

    Covariances are those for white noise of variance one; last comes the variance of the noise.
    """
    length = float(tau[-1])
    u = tau / length
    count = len(x)
    s: ComplexArray = np.full(count, 2j * np.pi * f * length)
    bend: ComplexArray = np.zeros(count, dtype=complex)
    powers = np.stack([np.ones_like(u), u, u**2])
    moving = np.ones(count, dtype=bool)
    for _ in range(_ITERATIONS):
        _, normal, right = _equations(x[moving], s[moving], bend[moving], u, powers, weights)
        c = _solved(normal, right)
        with np.errstate(all="ignore"):
            turn = c[:, 1] / c[:, 0]
            curve = 2.0 * c[:, 2] / c[:, 0] - turn**2
        # Steps of at most one radian over half a window.
        limit = np.maximum(1.0, np.maximum(np.abs(turn), np.abs(curve)))
        s[moving] += turn / limit
        bend[moving] += curve / limit
        left = ~(np.abs(turn) + np.abs(curve) < _CONVERGED * np.abs(s[moving]))
        left &= np.isfinite(s[moving])
        moving[np.flatnonzero(moving)] = left
        if not moving.any():
            break
    basis, normal, right = _equations(x, s, bend, u, powers, weights)
    c = _solved(normal, right)
    residual = x - np.einsum("pkl,pk->pl", basis, np.concatenate([c.real, c.imag], axis=1))
    inverse = np.linalg.pinv(normal)
    spread = inverse @ np.einsum("pkl,l,pjl->pkj", basis, weights**2, basis) @ inverse
    amplitude = np.asarray(np.abs(c[:, 0]), dtype=np.float64)
    # Changes of log a, s and s_2 are those of c_0, c_1 and 2 c_2 over c_0.
    with np.errstate(all="ignore"):
        over = np.array([1.0, 1.0 / length, 2.0 / length**2]) / c[:, :1]
    turned = np.zeros((count, 4, 6))
    for row, power, part in ((0, 0, "real"), (1, 1, "real"), (2, 1, "imag"), (3, 2, "imag")):
        turned[:, row, power] = getattr(over[:, power], part)
        turned[:, row, 3 + power] = getattr(1j * over[:, power], part)
    with np.errstate(all="ignore"):
        covariance = turned @ spread @ np.swapaxes(turned, 1, 2)
    return (amplitude, s / length, bend / length**2, covariance,
            _noise(residual * weights, tau, f) / float(weights @ weights))


def _noise(weighted: Array, tau: Array, f: float) -> Array:
    """Mean power (P,) of weighted residuals (P, L) at frequencies beside the mode."""
    bin_ = 1.0 / float(tau[-1] - tau[0])
    waves = np.exp(-2j * np.pi * _beside(f, bin_)[:, None] * tau)
    return np.asarray((np.abs(weighted @ waves.T) ** 2).mean(axis=1))


def _beside(f: float, bin_: float) -> Array:
    """Frequencies beside the mode at which noise is looked at [Hz]."""
    places = np.array([f + sign * k * bin_ for k in _BESIDE for sign in (-1.0, 1.0)])
    return places[places > 0.0]


def _noise_freedom(half: int, step: float, f: float, apart: int, windows: int) -> float:
    r"""Degrees of freedom of the variance of the noise at the ends of a record, the least.

    It is the mean of M powers of transforms y_j of white noise, over frequencies and windows:
    ``2 M^2 / sum (|C_jk|^2 + |P_jk|^2)`` with the correlations C of the y_j, and P of y_j with the
    conjugate of y_k, which matters near frequency zero.
    """
    from scipy.signal import windows as shapes

    shape = shapes.blackmanharris(2 * half + 1)
    averaged = (min(_AVERAGED, windows) + 1) // 2
    places = _beside(f, 1.0 / (2.0 * half * step))
    turn = np.exp(-2j * np.pi * step * places[:, None] * np.arange(-half, half + 1))
    y = np.zeros((averaged, len(places), 2 * half + 1 + apart * (averaged - 1)), dtype=complex)
    for k in range(averaged):
        y[k, :, k * apart : k * apart + 2 * half + 1] = turn * shape
    rows = y.reshape(averaged * len(places), -1)
    squares = sum((np.abs(rows @ other.T) ** 2).sum() for other in (rows, rows.conj()))
    return float(2.0 * len(rows) ** 2 * (shape @ shape) ** 2 / squares)


def _equations(
    x: Array, s: ComplexArray, bend: ComplexArray, u: Array, powers: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Basis functions (P, 6, L) of the linear fit, and its normal equations."""
    with np.errstate(over="ignore", invalid="ignore"):
        E = np.exp(s[:, None] * u + 0.5 * bend[:, None] * u**2)
    E = np.where(np.isfinite(E), E, 0.0)
    basis = np.concatenate([E.real[:, None] * powers, -E.imag[:, None] * powers], axis=1)
    weighted = basis * weights
    return basis, np.einsum("pkl,pjl->pkj", weighted, basis), np.einsum("pkl,pl->pk", weighted, x)


def _solved(normal: Array, right: Array) -> ComplexArray:
    """Complex coefficients (P, 3) of the linear fit."""
    real = (np.linalg.pinv(normal, rcond=1e-14) @ right[..., None])[..., 0]
    return np.asarray(real[:, :3] + 1j * real[:, 3:])
