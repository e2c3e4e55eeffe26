"""Truncated Fourier series of two angles, on lines along the flow of a torus.

A function of two angles is x = X_0 + sum_k (A_k cos k.theta + B_k sin k.theta) over pairs k =
(k1, k2) of whole numbers, |k1| <= H1 and 0 <= k2 <= H2, of k and -k one. Its coefficients stand in
the order X_0, A_1, B_1, A_2, B_2, ... of :func:`orders`, those with k2 = 0 first.

A line starts on the section theta1 = 0 at theta2 = 2 pi phi. It follows theta1 = 2 pi tau, theta2 =
2 pi (phi + r tau), tau in [0, 1]: with the ratio r = f2 / f1 of the frequencies it is a motion in
time. Mean values over equidistant tau and phi are those over the torus for any r, as those over all
phi do not depend on where a line crosses.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.harmonic.series import real_coefficients
from fecontact.core.types import Array, Integers

Complex = NDArray[np.complex128]


@cache
def orders(first: int, second: int) -> Integers:
    """Pairs (K, 2) of whole numbers k, of k and -k one; (0, 0) first, then those with k2 = 0."""
    pairs = [(k1, 0) for k1 in range(first + 1)]
    pairs += [(k1, k2) for k2 in range(1, second + 1) for k1 in range(-first, first + 1)]
    return np.array(pairs)


def complex_coefficients(X: Array, first: int, second: int) -> Complex:
    """Coefficients c (2 H1 + 1, H2 + 1, b) of exp(i k.theta), k1 from -H1 on, k2 from 0 on."""
    k = orders(first, second)
    c = np.zeros((2 * first + 1, second + 1, X.shape[1]), dtype=complex)
    c[first, 0] = X[0]
    c[first + k[1:, 0], k[1:, 1]] = 0.5 * (X[1::2] - 1j * X[2::2])
    c[:first, 0] = c[: first : -1, 0].conj()
    return c


def on_lines(c: Complex, taus: Array, count: int, ratio: float) -> Array:
    """Values (count, P, b) at tau (P,) of lines with equidistant phi, from c of the series."""
    first, second = len(c) // 2, c.shape[1] - 1
    along = np.exp(2.0j * np.pi * np.outer(taus, np.arange(-first, first + 1)))
    g = np.tensordot(along, c, axes=1)
    g *= np.exp(2.0j * np.pi * ratio * np.outer(taus, np.arange(second + 1)))[:, :, None]
    return np.asarray(np.fft.irfft(g, count, axis=1).swapaxes(0, 1) * count)


def means(values: Array, first: int, second: int, ratio: float) -> Complex:
    """Means (2 K1 + 1, 2 K2 + 1, ...) of values (Q, P, ...) times exp(-i k.theta) over lines.

    |k1| <= K1 and |k2| <= K2; tau and phi are equidistant.
    """
    Q, P = values.shape[:2]
    rest = (1,) * (values.ndim - 2)
    across = np.fft.fft(values, axis=0)[np.arange(second + 1) % Q] / Q
    turn = np.exp(-2.0j * np.pi * ratio * np.outer(np.arange(second + 1), np.arange(P) / P))
    half = np.fft.fft(across * turn.reshape(second + 1, P, *rest), axis=1) / P
    half = half[:, np.arange(-first, first + 1) % P].swapaxes(0, 1)
    # Values are real: the mean for -k is the conjugate of that for k.
    return np.concatenate([half[::-1, : 0 : -1].conj(), half], axis=1)


def projected(values: Array, first: int, second: int, ratio: float) -> Array:
    """Coefficients (L, b) of values (Q, P, b) on lines."""
    k = orders(first, second)
    found = means(values, first, second, ratio)[first + k[:, 0], second + k[:, 1]]
    found[1:] *= 2.0
    return real_coefficients(found)


def products(hat: Complex, k: Integers) -> tuple[Array, Array, Array, Array]:
    """Coefficients (K, K, ...) of J cos q.theta and J sin q.theta: cc, cs, sc, ss.

    The first letter is that of the coefficient, the second that of the factor; ``hat`` (4 H1 + 1,
    4 H2 + 1, ...) are the :func:`means` of J up to 2 H1 and 2 H2.
    """
    middle = np.array(hat.shape[:2]) // 2
    less, more = k[:, None] - k[None] + middle, k[:, None] + k[None] + middle
    below, above = hat[less[..., 0], less[..., 1]], hat[more[..., 0], more[..., 1]]
    cc, cs = below.real + above.real, below.imag - above.imag
    sc, ss = -below.imag - above.imag, below.real - above.real
    for part in (cc, cs):
        part[0] *= 0.5
    return cc, cs, sc, ss


def with_orders(X: Array, known: tuple[int, int], wanted: tuple[int, int]) -> Array:
    """Coefficients for other H1 and H2, cut off or filled with zeros."""
    places = {tuple(k): place for place, k in enumerate(orders(*known).tolist())}
    out = np.zeros((2 * len(orders(*wanted)) - 1, X.shape[1]))
    out[0] = X[0]
    for place, k in enumerate(orders(*wanted).tolist()):
        if place and tuple(k) in places:
            at = places[tuple(k)]
            out[2 * place - 1 : 2 * place + 1] = X[2 * at - 1 : 2 * at + 1]
    return out
