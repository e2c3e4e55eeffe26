"""Truncated Fourier series on equidistant samples, and operators in their coefficients.

A periodic function of tau in [0, 1] is x = X_0 + sum_k (A_k cos 2 pi k tau + B_k sin 2 pi k tau),
k = 1..H. Its coefficients stand in the order X_0, A_1, B_1, A_2, B_2, ...
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Array4, Matrix
from fecontact.core.types import Array, ComplexArray, Integers


@dataclass(frozen=True, eq=False)
class Series:
    """Transforms between samples and coefficients.

    Attributes
    ----------
    harmonics : int
        H.
    times : (N,) array
        Equidistant samples of tau.
    values : (N, 2 H + 1) array
        From coefficients to samples.
    projection : (2 H + 1, N) array
        From samples to coefficients.
    cosines, sines : (2 H + 1, N) arrays
        2 / N cos 2 pi k tau and 2 / N sin 2 pi k tau, k = 0..2 H.
    """

    harmonics: int
    times: Array
    values: Array
    projection: Array
    cosines: Array
    sines: Array


@cache
def series(harmonics: int, samples: int) -> Series:
    """Transforms for H harmonics and N samples."""
    times = np.arange(samples) / samples
    values = basis_at(times, harmonics)
    projection = 2.0 / samples * values.T
    projection[0] *= 0.5
    angles = 2.0 * np.pi * np.outer(np.arange(2 * harmonics + 1), times)
    return Series(harmonics, times, values, np.ascontiguousarray(projection),
                  2.0 / samples * np.cos(angles), 2.0 / samples * np.sin(angles))


def basis_at(times: Array, harmonics: int) -> Array:
    """From coefficients to values (k, 2 H + 1) at times tau (k,)."""
    return functions_at(2.0 * np.pi * np.outer(times, np.arange(1, harmonics + 1)))


def functions_at(angles: Array) -> Array:
    """Functions 1, cos, sin, cos, ... (..., 2 K + 1) of a series for K angles (..., K)."""
    values = np.ones((*angles.shape[:-1], 2 * angles.shape[-1] + 1))
    values[..., 1::2], values[..., 2::2] = np.cos(angles), np.sin(angles)
    return values


def complex_harmonics(X: Array) -> ComplexArray:
    """Harmonics (H + 1, ...) of x = sum_k Re(X_k exp(2 pi i k tau)) from coefficients."""
    return np.asarray(np.concatenate([X[:1], X[1::2] - 1j * X[2::2]]))


def real_coefficients(harmonics: ComplexArray) -> Array:
    """Coefficients (2 H + 1, ...) from complex harmonics (H + 1, ...)."""
    X = np.empty((2 * len(harmonics) - 1, *harmonics.shape[1:]))
    X[0], X[1::2], X[2::2] = harmonics[0].real, harmonics[1:].real, -harmonics[1:].imag
    return X


@cache
def uniform_basis(count: int, harmonics: int) -> Array:
    """From coefficients to values (k, 2 H + 1) at equidistant times."""
    return basis_at(np.arange(count) / count, harmonics)


def differentiated(X: Array) -> Array:
    """Coefficients (..., 2 H + 1, b) of dx/dtau."""
    return turned(X, _turns(X.shape[-2] // 2))


@cache
def _turns(harmonics: int) -> Array:
    """2 pi k (H + 1,) of the harmonics."""
    return np.asarray(2.0 * np.pi * np.arange(harmonics + 1))


def turned(X: Array, turns: Array) -> Array:
    """Coefficients (..., L, b) of sum_k turns_k (B_k cos - A_k sin); turns (K,), the mean first."""
    out, rates = np.empty_like(X), turns[1:, None]
    out[..., 0, :] = 0.0
    np.multiply(rates, X[..., 2::2, :], out=out[..., 1::2, :])
    np.multiply(-rates, X[..., 1::2, :], out=out[..., 2::2, :])
    return out


def rows_of(orders: tuple[int, ...] | None, harmonics: int) -> Integers:
    """Rows of coefficients (2 H + 1, b) that belong to some harmonics; all of them for None."""
    if orders is None:
        return np.arange(2 * harmonics + 1)
    return np.array([row for k in orders for row in ((2 * k - 1, 2 * k) if k else (0,))])


def shifted(X: Array, shift: float) -> Array:
    """Coefficients (2 H + 1, b) of x(tau + shift)."""
    angles = 2.0 * np.pi * shift * np.arange(1, len(X) // 2 + 1)[:, None]
    c, s = np.cos(angles), np.sin(angles)
    out = X.copy()
    out[1::2] = c * X[1::2] + s * X[2::2]
    out[2::2] = c * X[2::2] - s * X[1::2]
    return out


def with_harmonics(X: Array, harmonics: int) -> Array:
    """Coefficients (2 H + 1, b) for another H, cut off or filled with zeros."""
    out = np.zeros((2 * harmonics + 1, X.shape[1]))
    kept = min(len(out), len(X))
    out[:kept] = X[:kept]
    return out


@helper
def _fill(Cx, Sx, Cv, Sv, T, m, b, out):
    H = len(out) // 2
    for k in range(H + 1):
        row_c, row_s = max(2 * k - 1, 0), 2 * k
        half = 0.25 if k == 0 else 0.5
        for q in range(H + 1):
            col_c, col_s = max(2 * q - 1, 0), 2 * q
            plus, minus = k + q, abs(k - q)
            sign = 1.0 if k >= q else -1.0
            turn = 2.0 * np.pi * q / T
            for i in range(b):
                for j in range(b):
                    e = i * b + j
                    cp, cm, sp, sm = Cx[plus, e], Cx[minus, e], Sx[plus, e], sign * Sx[minus, e]
                    cc, cs = half * (cm + cp), half * (sp - sm)
                    sc, ss = 0.5 * (sp + sm), 0.5 * (cm - cp)
                    if j < m:
                        e = i * m + j
                        cp, cm, sp, sm = (Cv[plus, e], Cv[minus, e], Sv[plus, e],
                                          sign * Sv[minus, e])
                        cc -= turn * half * (sp - sm)
                        cs += turn * half * (cm + cp)
                        sc -= turn * 0.5 * (cm - cp)
                        ss += turn * 0.5 * (sp + sm)
                    out[row_c, i, col_c, j] = -cc
                    if q > 0:
                        out[row_c, i, col_s, j] = -cs
                    if k > 0:
                        out[row_s, i, col_c, j] = -sc
                        if q > 0:
                            out[row_s, i, col_s, j] = -ss
        if k == 0:
            continue
        turn = 2.0 * np.pi * k / T
        for i in range(b):
            if i < m:
                out[row_c, i, row_c, i] -= turn * turn
                out[row_s, i, row_s, i] -= turn * turn
            else:
                out[row_c, i, row_s, i] += turn
                out[row_s, i, row_c, i] -= turn


@kernel
def fill_blocks(
    Cx: Matrix, Sx: Matrix, Cv: Matrix, Sv: Matrix, T: float, displacements: int, rows: int,
    out: Array4,
) -> None:
    """Fill out (2 H + 1, b, 2 H + 1, b) with the derivatives of the balance to coefficients.

    Cx, Sx (2 H + 1, b^2) are the cosine and sine coefficients k = 0..2 H, with the factor 2 / N for
    k = 0 too, of the derivatives J of the rates to the unknown functions; Cv, Sv (2 H + 1, b m)
    those to the velocities x' / T of the first m functions. The matrix is that of x'' / T^2 - f for
    these m, and of x' / T - f for the others.
    """
    # One function alone is common, and its loops of one round take most of the time.
    if rows == 1 and displacements == 1:
        _fill(Cx, Sx, Cv, Sv, T, 1, 1, out)
    else:
        _fill(Cx, Sx, Cv, Sv, T, displacements, rows, out)
