"""Extremes, observed values and estimates of errors of orbits by harmonic balance, many at once."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.bifurcation.harmonic.layout import Layout, layout_from
from fecontact.bifurcation.harmonic.series import (
    basis_at,
    complex_harmonics,
    differentiated,
    uniform_basis,
)
from fecontact.core.types import Array, ComplexArray

# Points per harmonic, and at least, among which extremes are sought.
_FINE, _LEAST_FINE = 12, 96
# Samples a period of what is observed, and harmonics of it that are stored.
OBSERVED_SAMPLES, OBSERVED_HARMONICS = 512, 15
OBSERVED = ("observed_minimum", "observed_maximum", "observed_amplitude", "observed_harmonics")


def neglected(
    X: Array, forces: Array, mean: Array, periods: Array, sizes: Array,
    orders: tuple[int, ...] | None = None,
) -> tuple[Array, Array]:
    """Estimates (K,) of the errors of K orbits, and of those of their equations.

    The neglected harmonics of the rates, f_k, k > H or not among ``orders``, would add
    x_k = (i k w - J_0)^-1 f_k to the orbit, J_0 the mean derivative. The first number is their root
    mean square over that of harmonics 1 to H of displacements and other states, in their scales;
    the second that of f_k, the residual in time, over that of x'. Velocities are those of the
    series: none of their harmonics are neglected.

    Parameters
    ----------
    X : (K, 2 H + 1, b) array
        Coefficients of displacements or, without these, of all states.
    forces : (K, N, b) array
        Accelerations, or rates, at the samples.
    mean : (K, b, 2 b) or (K, b, b) array
        Mean derivatives J_0 of these to displacements and velocities, or states.
    periods : (K,) array
        T [s].
    sizes : (b,) or (K, b) array
        Scales.
    orders : tuple of int, optional
        Harmonics of the orbits where some of 0 to H are left out.
    """
    count, samples, b = forces.shape
    H = X.shape[1] // 2
    most = min(3 * H + 2, (samples - 1) // 2)
    if most <= H:
        return np.full(count, np.nan), np.full(count, np.nan)
    spectrum = 2.0 * np.fft.rfft(forces, axis=1) / samples
    spectrum[:, 0] *= np.sqrt(0.5)
    numbers = (np.arange(H + 1, most + 1) if orders is None
               else np.delete(np.arange(most + 1), orders))
    left = spectrum[:, numbers]
    added = responses(left, 2.0j * np.pi / periods[:, None] * numbers, mean[:, None, :, :b],
                      mean[:, None, :, b:])
    sizes = np.broadcast_to(sizes, (count, b))[:, None]
    kept = _norm(X[:, 1:] / sizes)
    rate_sizes = np.abs(spectrum[:, 1:]).max(axis=1, keepdims=True) + 1e-300
    return (_norm(added / sizes) / np.where(kept > 0.0, kept, 1.0),
            _norm(left / rate_sizes) / _norm(spectrum[:, 1 : H + 1] / rate_sizes))


def responses(
    f: ComplexArray, turns: ComplexArray, by_state: Array, by_velocity: Array
) -> ComplexArray:
    """Responses (..., b) of linear systems to forces f (..., b) in time; NaN at a resonance.

    They are ``(D - by_state - i w by_velocity)^-1 f`` with ``turns`` (...) = i w. D is (i w)^2 for
    the first m functions, the displacements with derivatives ``by_velocity`` (..., b, m), and i w
    for the others.
    """
    b, m = by_velocity.shape[-2:]
    turned = turns[..., None, None]
    matrix = turned * np.eye(b) - by_state
    matrix[..., :m] += turned * ((turned - 1.0) * np.eye(b)[:, :m] - by_velocity)
    if b == 1:
        return np.asarray(f / matrix[..., 0])
    try:
        return np.asarray(np.linalg.solve(matrix, f[..., None])[..., 0])
    except np.linalg.LinAlgError:
        return np.full_like(f, np.nan)


def _norm(x: Array | ComplexArray) -> Array:
    """Norms (K,) of arrays (K, ...)."""
    return np.sqrt((np.abs(x) ** 2).sum(axis=(1, 2)))


def extremes(whole: Array, z: Array) -> tuple[Array, Array]:
    """Smallest and largest value (K, d) of each state over K orbits.

    ``whole`` (K, 2 H + 1, d - c) are coefficients, z (K, N, c) the states behind at the samples.
    """
    count, L, b = whole.shape
    H = L // 2
    fine = max(_LEAST_FINE, _FINE * H)
    series = np.ascontiguousarray(np.moveaxis(whole, 1, 2)).reshape(-1, L)
    x = series @ uniform_basis(fine, H).T
    found = []
    for sign in (-1.0, 1.0):
        best, place = _peaks(x, sign)
        # The series where the parabola has its peak: exact but for the square of its error.
        there = (basis_at(place / fine, H) * series).sum(axis=1)
        best = np.maximum(best, sign * there).reshape(count, b)
        found.append(sign * np.concatenate([best, (sign * z).max(axis=1)], axis=1))
    return found[0], found[1]


def peaks(x: Array) -> tuple[Array, Array]:
    """Extremes (d,) of samples (d, N) around a period, on parabolas through three of them."""
    return -_peaks(x, -1.0)[0], _peaks(x, 1.0)[0]


def _peaks(x: Array, sign: float) -> tuple[Array, Array]:
    """Largest values (d,) of samples (d, N) times a sign, and their places counted in samples."""
    rows, place = np.arange(len(x)), x.argmax(axis=1) if sign > 0.0 else x.argmin(axis=1)
    here, left, right = (sign * x[rows, at % x.shape[1]] for at in (place, place - 1, place + 1))
    bend = left - 2.0 * here + right
    curved = bend < 0.0
    safe = np.where(curved, bend, -1.0)
    return (np.where(curved, here - (right - left) ** 2 / (8.0 * safe), here),
            np.where(curved, place - (right - left) / (2.0 * safe), place))


def observed_values(
    layout: Layout, X: Array, period: float, row: Array
) -> dict[str, Any]:
    """Values to store of an orbit with the coefficients X (2 H + 1, b) of q and y.

    'observed_minimum', 'observed_maximum', half their difference as 'observed_amplitude', and
    'observed_harmonics' (16,), complex.
    """
    found = observed_of_orbits(layout, X[None], np.array([period]), row)
    return {name: values[0] for name, values in found.items()}


def observed_of_orbits(
    layout: Layout, X: Array, periods: Array, row: Array
) -> dict[str, Any]:
    """Values of K orbits with coefficients X (K, 2 H + 1, b) and periods (K,), K by each name."""
    K, H, m = len(X), X.shape[1] // 2, layout.displacements
    observes = X[..., :m] @ row[:m] + X[..., m:] @ row[2 * m : m + layout.harmonic]
    if m and row[m : 2 * m].any():
        observes = observes + differentiated(X[..., :m]) @ row[m : 2 * m] / periods[:, None]
    low, high = peaks(observes @ uniform_basis(OBSERVED_SAMPLES, H).T)
    harmonics = np.zeros((K, max(H, OBSERVED_HARMONICS) + 1), dtype=complex)
    harmonics[:, : H + 1] = complex_harmonics(observes.T).T
    return dict(zip(OBSERVED, (low.tolist(), high.tolist(), ((high - low) / 2.0).tolist(),
                               harmonics[:, : OBSERVED_HARMONICS + 1]), strict=True))


def observed_of_series(points: Sequence[Any], row: Array) -> dict[str, Any]:
    """Values (N, ...) by name of orbits of one branch by harmonic balance."""
    known = points[0].branch.attributes
    layout, H = layout_from(known), known["method"].highest
    b = layout.harmonic
    X = np.array([point.u[: (2 * H + 1) * b] for point in points]).reshape(-1, 2 * H + 1, b)
    periods = np.array([float(point.values["period"]) for point in points])
    return observed_of_orbits(layout, X, periods, row)
