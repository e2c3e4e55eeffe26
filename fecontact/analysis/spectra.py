"""Spectra and spectrograms of histories at evenly spaced times."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, require_positive
from fecontact.core.magnitude import magnitude
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, ArrayLike

_EVEN = 1e-6  # largest deviation of times from even spacing, relative to the spacing
# Fewest periods of the mean frequency in a window, and those in a window by default.
FEWEST_PERIODS, _USUAL = 5.0, 10.0


class Peak(NamedTuple):
    """A maximum of a spectrum.

    frequency_hz : [Hz]
    value : amplitude or density there
    """

    frequency_hz: float
    value: float


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided spectrum of a real history.

    Attributes
    ----------
    frequency_hz : (F,) array
        Frequencies from zero to half the sampling rate [Hz].
    values : (F,) array
        Amplitudes in the unit u of the history, or power spectral density in u^2/Hz.
    kind : 'amplitude' or 'density'
    resolution_hz : float
        Inverse of the length of one transform [Hz]; frequencies may be spaced more closely.
    """

    frequency_hz: Array
    values: Array
    kind: Literal["amplitude", "density"]
    resolution_hz: float

    def peaks(self, count: int = 5, *, least: float = 0.01) -> list[Peak]:
        """Highest local maxima, interpolated by a parabola through the logarithms.

        Parameters
        ----------
        count : int
            Largest number of peaks.
        least : float
            Peaks below this fraction of the highest one are omitted, as are those within four
            resolutions of a higher one; beyond, side lobes of the window 'hann' are below a
            hundredth.
        """
        f, y = self.frequency_hz, self.values
        tops = np.flatnonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])) + 1
        tops = tops[np.argsort(-y[tops])]
        found: list[Peak] = []
        for k in tops:
            if len(found) == count or (found and y[k] < least * found[0].value):
                break
            a, b, c = np.log(np.maximum(y[k - 1 : k + 2], 1e-300))
            shift = 0.5 * (a - c) / (a - 2.0 * b + c)
            peak = Peak(float(f[k] + shift * (f[1] - f[0])),
                        float(np.exp(b - 0.25 * (a - c) * shift)))
            if all(abs(peak.frequency_hz - other.frequency_hz) > 4.0 * self.resolution_hz
                   for other in found):
                found.append(peak)
        return found


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Spectrogram:
    """Amplitude spectra of successive segments of a history.

    Attributes
    ----------
    time : (P,) array
        Centres of the segments [s].
    frequency_hz : (F,) array
        [Hz].
    values : (F, P) array
        Amplitudes in the unit of the history.
    resolution_hz : float
        Inverse of the length of a segment [Hz].
    """

    time: Array
    frequency_hz: Array
    values: Array
    resolution_hz: float


def evenly_sampled(
    time: ArrayLike, values: ArrayLike, *, resample: bool = False
) -> tuple[Array, Array]:
    """Check or resample a history to evenly spaced times.

    Parameters
    ----------
    time, values : (N,) arrays
        Ascending times [s] and values.
    resample : bool
        Whether to interpolate unevenly spaced values by cubic splines at as many even times over
        the same interval. Motion faster than the widest spacing is then lost.

    Raises
    ------
    InputError
        For fewer than eight values, non-finite values, times that do not ascend, and uneven times
        without ``resample``.
    """
    t, x = as_floats(time, "The times of a spectrum"), as_floats(values, "Its values")
    if t.ndim != 1 or t.shape != x.shape or len(t) < 8:
        raise InputError(f"A spectrum needs times and values of one length, at least 8, not shapes "
                         f"{t.shape} and {x.shape}.")
    if not (np.isfinite(t).all() and np.isfinite(x).all()):
        raise InputError("A spectrum needs finite times and values; these hold others.")
    step = np.diff(t)
    if not (step > 0.0).all():
        raise InputError("A spectrum needs times that ascend; these do not.")
    even = np.linspace(t[0], t[-1], len(t))
    # Each time may deviate by rounding, without accumulation.
    if np.abs(t - even).max() <= _EVEN * step.mean() + 4.0 * np.spacing(np.abs(t).max()):
        return even, x
    if not resample:
        raise InputError(f"The times lie {step.min():.4g} to {step.max():.4g} s apart, and a "
                         f"spectrum needs even ones; leave out the uneven part, or give resample = "
                         f"True.")
    from scipy.interpolate import CubicSpline

    return even, np.asarray(CubicSpline(t, x)(even))


def amplitude_spectrum(
    time: ArrayLike,
    values: ArrayLike,
    *,
    window: str = "hann",
    padding: int = 8,
    resample: bool = False,
) -> Spectrum:
    r"""Amplitude spectrum of a history.

    .. math:: A_k = \frac{2}{\sum_n w_n} \Big| \sum_n w_n (x_n - \bar x) e^{-2 \pi i f_k t_n} \Big|

    A sine of amplitude A gives a peak of height A; the mean is subtracted.

    Parameters
    ----------
    time, values, resample
        See :func:`evenly_sampled`.
    window : str
        Window of :func:`scipy.signal.get_window`: 'hann', 'flattop' for exact heights, 'boxcar'
        for histories of whole periods.
    padding : int
        Zero-padding factor: frequencies are spaced this much more closely than the resolution.
    """
    from scipy.signal import get_window

    t, x = evenly_sampled(time, values, resample=resample)
    if isinstance(padding, bool) or not isinstance(padding, int) or padding < 1:
        raise InputError(f"amplitude_spectrum: padding = {padding!r} must be a whole number above "
                         f"zero.")
    n, step = len(x), float(t[1] - t[0])
    weights = get_window(window, n)
    # The padded values, their transform, amplitudes and frequencies.
    require_memory("amplitude_spectrum: padding", padding, 32.0 * n)
    transform = np.fft.rfft(weights * (x - x.mean()), padding * n)
    amplitude = np.asarray(2.0 / weights.sum() * np.abs(transform), dtype=np.float64)
    # Zero and the Nyquist frequency have no counterpart at negative frequencies.
    amplitude[0] *= 0.5
    if (padding * n) % 2 == 0:
        amplitude[-1] *= 0.5
    return Spectrum(_frequencies(padding * n, step), amplitude, "amplitude", 1.0 / (n * step))


def power_spectral_density(
    time: ArrayLike,
    values: ArrayLike,
    *,
    piece: float | None = None,
    window: str = "hann",
    resample: bool = False,
) -> Spectrum:
    r"""Power spectral density by Welch's method, one-sided.

    .. math:: \int_0^\infty S(f) df = \overline{(x - \bar x)^2}

    in the squared unit of the history per Hz: the mean over half-overlapping segments, suited to
    noise and chaos.

    Parameters
    ----------
    time, values, resample
        See :func:`evenly_sampled`.
    piece : float, optional
        Length of the segments [s]; by default an eighth of the history, or ten periods of its
        mean frequency if these are longer.
    window : str
        Name of a window of :func:`scipy.signal.get_window`.

    Raises
    ------
    InputError
        For a segment longer than the history, or shorter than eight of its times or five periods
        of its mean frequency.
    """
    from scipy.signal import welch

    t, x = evenly_sampled(time, values, resample=resample)
    step = float(t[1] - t[0])
    count = _piece(t, x, piece, 8.0)
    unit = magnitude(x)
    f, density = welch(x / unit, 1.0 / step, window, count, detrend="constant", scaling="density")
    with np.errstate(over="ignore"):
        density = density * unit * unit
    if not np.isfinite(density).all():
        raise InputError(f"A power spectral density of values up to {np.abs(x).max():.3g} is "
                         f"beyond the largest number; take an amplitude spectrum.")
    return Spectrum(f, density, "density", 1.0 / (count * step))


def spectrogram(
    time: ArrayLike,
    values: ArrayLike,
    *,
    piece: float | None = None,
    overlap: float = 0.75,
    window: str = "hann",
    resample: bool = False,
) -> Spectrogram:
    """Amplitude spectra of overlapping segments of a history.

    Each is scaled as by :func:`amplitude_spectrum`, after subtracting the mean of the segment.

    Parameters
    ----------
    time, values, resample
        See :func:`evenly_sampled`.
    piece : float, optional
        Length of the segments [s]; by default 1/32 of the history, or ten periods of its mean
        frequency if these are longer.
    overlap : float
        Fraction by which adjacent segments overlap, at least 0 and below 1.
    window : str
        Name of a window of :func:`scipy.signal.get_window`.

    Raises
    ------
    InputError
        As in :func:`power_spectral_density`, and for an overlap out of range.
    """
    from scipy.signal import get_window

    t, x = evenly_sampled(time, values, resample=resample)
    if not 0.0 <= overlap < 1.0:
        raise InputError(f"spectrogram: overlap = {overlap!r} must be from 0 to below 1.")
    step = float(t[1] - t[0])
    count = _piece(t, x, piece, 32.0)
    hop = max(1, round(count * (1.0 - overlap)))
    weights = get_window(window, count)
    pieces = np.lib.stride_tricks.sliding_window_view(x, count)[::hop]
    padded = 2 * count
    transform = np.fft.rfft(weights * (pieces - pieces.mean(axis=1, keepdims=True)), padded)
    amplitude = np.asarray(2.0 / weights.sum() * np.abs(transform).T, dtype=np.float64)
    amplitude[0] *= 0.5
    amplitude[-1] *= 0.5
    middles = t[0] + step * (0.5 * (count - 1) + hop * np.arange(len(pieces)))
    return Spectrogram(middles, _frequencies(padded, step), amplitude, 1.0 / (count * step))


def _frequencies(count: int, step: float) -> Array:
    return np.asarray(np.fft.rfftfreq(count, step), dtype=np.float64)


def mean_frequency(time: Array, values: Array) -> float:
    r"""Mean frequency of a history [Hz], ``rms(x') / (2 pi rms(x))`` about the mean of x.

    For a sine its frequency, for noise Rice's frequency of zero crossings; zero for a constant.
    """
    step = np.diff(time)
    duration = float(time[-1] - time[0])
    values = values / magnitude(values)  # squares of large numbers would overflow
    x = values - float(0.5 * (values[1:] + values[:-1]) @ step) / duration
    # Mean square of the straight lines between the samples.
    square = float((x[1:] ** 2 + x[1:] * x[:-1] + x[:-1] ** 2) @ step) / 3.0
    rate = float((np.diff(values) ** 2 / step).sum())
    if not square > 1e-24 * float(np.abs(values).max()) ** 2 * duration:
        return 0.0
    return float(np.sqrt(rate / square)) / (2.0 * np.pi)


def require_periods(t: Array, x: Array, window: float) -> None:
    """Refuse a window [s] of fewer than five periods of the mean frequency of a history."""
    frequency = mean_frequency(t, x)
    if 0.0 < window * frequency < FEWEST_PERIODS:
        raise InputError(f"A spectrum: a window of {window:.4g} s has {window * frequency:.2g} "
                         f"periods of the mean frequency of the history, {frequency:.4g} Hz, but "
                         f"needs {FEWEST_PERIODS:g}; run for longer, or take windows of at least "
                         f"{FEWEST_PERIODS / frequency:.4g} s.")


def _piece(t: Array, x: Array, piece: float | None, parts: float) -> int:
    """Number of samples in a segment of given length, or of a part of the history."""
    step, times = float(t[1] - t[0]), len(t)
    if piece is None:
        frequency = mean_frequency(t, x)
        piece = (t[-1] - t[0]) / parts
        if frequency > 0.0:
            piece = max(piece, _USUAL / frequency)
        count = min(max(round(piece / step), 8), times)
    else:
        require_positive("A spectrum", piece=piece)
        count = round(piece / step)
        if not 8 <= count <= times:
            raise InputError(f"A spectrum: piece = {piece!r} s must be from {8 * step:.4g} s, "
                             f"eight times of the history, to {times * step:.4g} s, all of it.")
    require_periods(t, x, count * step)
    return count
