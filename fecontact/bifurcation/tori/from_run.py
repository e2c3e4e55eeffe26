"""Fourier series of two angles from runs."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from fecontact.bifurcation.harmonic.series import functions_at
from fecontact.bifurcation.tori.series import orders
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Last samples of a run that are used, and harmonics of the fit at most.
_SAMPLES, _MOST = 6000, 5
# Relative error of the fit above which the motion is not quasi-periodic with these frequencies.
_WORST = 0.2
# Rounds of the search of a frequency, and candidates in each.
_ROUNDS, _CANDIDATES = 8, 9


def fitted(
    times: Array, x: Array, known: tuple[float | None, float | None], wanted: tuple[int, int]
) -> tuple[Array, tuple[float, float], tuple[int, int]]:
    """Coefficients (L, b) of a motion x (k, b), its frequencies [Hz], and their H1 and H2.

    Frequencies that are not known are those of the largest peaks of the spectrum, refined by least
    squares.

    Raises
    ------
    AnalysisError
        If the motion has no second frequency, or is not quasi-periodic.
    """
    at, sampled = _evenly(times[-_SAMPLES:], x[-_SAMPLES:])
    span = float(at[-1] - at[0])
    size = sampled.std(axis=0)
    size = np.where(size > 1e-9 * size.max(), size, 1.0)
    scaled = (sampled - sampled.mean(axis=0)) / size
    H = (min(wanted[0], _MOST), min(wanted[1], _MOST))
    found: list[float] = []
    for given in known:
        if given is not None:
            found.append(given)
            continue
        rest = scaled - _fit(at, scaled, (found[0], 0.0), (wanted[0], 0))[1] if found else scaled
        if np.abs(rest).max() < 1e-6 * np.abs(scaled).max():
            raise AnalysisError("The motion has no second frequency: it is periodic; start from a "
                                "quasi-periodic one, or from a Neimark-Sacker point.")
        found.append(_refined(at, rest, _peak(at, rest), span))
    first, second = found
    if known[1] is None:
        # All harmonics together place the frequency better.
        second = _searched(at, scaled, first, second, span, H)
    X, model = _fit(at, scaled, (first, second), H)
    error = float(np.sqrt(((scaled - model) ** 2).mean() / (scaled**2).mean()))
    if not error < _WORST:
        raise AnalysisError(f"The motion is not quasi-periodic with the frequencies {first:.6g} Hz "
                            f"and {second:.6g} Hz: a series of them is off by {error:.2g} of its "
                            f"size; run it until it has settled, and over more periods.")
    X = X * size
    X[0] += sampled.mean(axis=0)
    return X, (first, second), H


def _evenly(times: Array, x: Array) -> tuple[Array, Array]:
    """The motion at equidistant times, by cubic splines where it is given at others."""
    at = np.linspace(times[0], times[-1], len(times))
    if np.abs(at - times).max() <= 1e-6 * (at[1] - at[0]):
        return at, x
    times, first = np.unique(times, return_index=True)
    return at, np.asarray(CubicSpline(times, x[first])(at))


def _peak(at: Array, x: Array) -> float:
    """Frequency [Hz] of the largest peak of the spectrum."""
    window = np.hanning(len(at))[:, None]
    power = (np.abs(np.fft.rfft(x * window, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0
    return float(np.argmax(power)) / float(at[-1] - at[0])


def _refined(at: Array, x: Array, frequency: float, span: float) -> float:
    """Frequency near another one at which one harmonic takes most of x."""
    window = np.hanning(len(at))[:, None]
    return _narrowed(lambda f: -float((np.abs(
        np.exp(-2.0j * np.pi * f * at) @ (x * window)) ** 2).sum()), frequency, 1.0 / span)


def _searched(
    at: Array, x: Array, first: float, second: float, span: float, H: tuple[int, int]
) -> float:
    few = (min(H[0], 3), min(H[1], 3))
    some = slice(None, None, max(1, len(at) // 1500))
    return _narrowed(lambda f: float(((x[some] - _fit(
        at[some], x[some], (first, f), few)[1]) ** 2).sum()), second, 0.2 / span)


def _narrowed(value: Callable[[float], float], middle: float, width: float) -> float:
    """Place of the smallest value, by narrowing intervals."""
    for _ in range(_ROUNDS):
        places = middle + width * np.linspace(-1.0, 1.0, _CANDIDATES)
        middle = float(places[int(np.argmin([value(float(place)) for place in places]))])
        width *= 2.5 / (_CANDIDATES - 1)
    return middle


def _fit(
    at: Array, x: Array, frequencies: tuple[float, float], H: tuple[int, int]
) -> tuple[Array, Array]:
    """Coefficients (L, b) by least squares, and the series (k, b)."""
    basis = functions_at(2.0 * np.pi * np.outer(at, orders(*H)[1:] @ np.array(frequencies)))
    X = np.asarray(np.linalg.lstsq(basis, x, rcond=1e-6)[0], dtype=np.float64)
    return X, np.asarray(basis @ X)
