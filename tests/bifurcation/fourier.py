"""Periodic motions by harmonic balance of another kind, for comparison; SciPy's hybrid method.

The linear rest is condensed to the displacements of the elements where there is a load, and kept
where there is none.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root


def sampled(x, samples):
    """Samples (N, e) over a period of harmonics (H + 1, e): x = Re sum x_k exp(i k w t)."""
    bins = np.zeros((samples // 2 + 1, x.shape[1]), complex)
    bins[: len(x)] = 0.5 * samples * x
    bins[0] *= 2.0
    return np.fft.irfft(bins, samples, axis=0)


def half_range(x):
    """Half the range of a displacement with harmonics (H + 1,)."""
    return 0.5 * np.ptp(sampled(x[:, None], 4096))


def unpacked(x):
    """Mean, real and imaginary parts of harmonics (H + 1, e) as one array."""
    return np.concatenate([x[0].real, x[1:].real.ravel(), x[1:].imag.ravel()])


def packed(z, count):
    """The harmonics of such an array."""
    parts = z[count:].reshape(2, -1, count)
    return np.vstack([z[:count] + 0j, parts[0] + 1j * parts[1]])


@dataclass(frozen=True, eq=False)
class Structure:
    """Matrices (d, d) and forces ``law(u, u')`` (N, e) of displacements u = rows @ x at samples."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    rows: np.ndarray
    law: Callable

    def forces(self, u, w, samples):
        """Harmonics (H + 1, e) of the forces."""
        rates = 1j * w * np.arange(len(u))[:, None] * u
        f = self.law(sampled(u, samples), sampled(rates, samples))
        found = 2.0 / samples * np.fft.rfft(f, axis=0)[: len(u)]
        found[0] /= 2.0
        return found

    def dynamic(self, k, w, loss=0.0):
        """K - (k w)^2 M + i k w (C - loss M)."""
        return self.K - (k * w)**2 * self.M + 1j * k * w * (self.C - loss * self.M)

    def response(self, load, w, harmonics, samples, *, seen, start=None, mean=0.0):
        """Harmonics (H + 1,) of the displacement ``seen`` under Re(load exp(i w t)) + mean, and
        those (H + 1, e) of the elements, from which the next one can start.
        """
        G = np.array([np.linalg.inv(self.dynamic(k, w)) for k in range(harmonics + 1)])
        driven = np.zeros((harmonics + 1, len(self.K)), complex)
        driven[1] = G[1] @ load
        driven[0] = G[0].real @ (np.zeros(len(self.K)) + mean)

        def moved(u):
            f = self.forces(u, w, samples) @ self.rows
            return driven - np.einsum("kij,kj->ki", G, f)

        count, scale = len(self.rows), np.abs(driven @ self.rows.T).max()

        def equations(z):
            u = packed(z * scale, count)
            return unpacked(u - moved(u) @ self.rows.T) / scale

        begin = driven @ self.rows.T if start is None else start
        found = root(equations, unpacked(begin) / scale, tol=1e-13)
        assert np.abs(found.fun).max() < 1e-9, found.message
        u = packed(found.x * scale, count)
        return moved(u) @ seen, u

    def mode(self, seen, amplitude, start, samples):
        """Angular frequency, loss and harmonics (H + 1, d) of a motion without load.

        The first harmonic of the displacement ``seen`` has this amplitude and the phase zero; the
        loss is the negative mass damping that makes the motion periodic. ``start`` are frequency,
        loss and harmonics near it.
        """
        size, largest = len(self.K), np.abs(self.K).max() * amplitude

        def equations(z):
            x, w, loss = packed(z[:-2] * amplitude, size), z[-2] * start[0], z[-1] * start[0]
            f = self.forces(x @ self.rows.T, w, samples) @ self.rows
            rest = np.array([f[k] + self.dynamic(k, w, loss) @ x[k] for k in range(len(x))])
            first = x[1] @ seen / amplitude
            return np.concatenate([unpacked(rest) / largest, [first.real - 1.0, first.imag]])

        found = root(equations, np.concatenate([unpacked(start[2]) / amplitude,
                                                [1.0, start[1] / start[0]]]), tol=1e-14)
        assert np.abs(found.fun).max() < 1e-9, (amplitude, np.abs(found.fun).max())
        return (*(found.x[-2:] * start[0]), packed(found.x[:-2] * amplitude, size))
