"""Influence coefficients: displacements of pixels of a regular grid under forces on other pixels.

A coefficient is the mean of a point-force kernel k over two rectangles of sides a and b at the
offset (x, y), the one that is loaded evenly and the one whose mean displacement is wanted:

    K(x, y) = 1 / (a b) D_x^2 D_y^2 F(x, y),       F_xxyy = k

with second differences D^2 over a and b. Means are symmetric and positive definite, and those of
patches of several pixels follow by addition.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.types import Array

# Distance in pixels beyond which quadrature is more accurate than differences that cancel.
_FAR = 20.0
# Nodes and weights of the density 1 - |t|, exact to the fifth order.
_NODES = np.array([-np.sqrt(0.4), 0.0, np.sqrt(0.4)])
_WEIGHTS = np.array([5.0, 14.0, 5.0]) / 24.0


@dataclass(frozen=True)
class Kernel:
    """Kernel of a point force, its fourfold integral F, and its transform on a periodic surface.

    The transform of wave numbers (k_x, k_y) is real, or imaginary for odd kernels.
    """

    point: Callable[[Array, Array], Array]
    integral: Callable[[Array, Array], Array]
    transform: Callable[[Array, Array], Any]


def _arsinh(x: Array, y: Array) -> Array:
    """``asinh(x / |y|)``, which enters where a factor y makes it zero for y = 0."""
    return np.arcsinh(np.divide(x, np.abs(y), out=np.zeros(np.shape(x)), where=y != 0.0))


def _along(x: Array, y: Array) -> Array:
    r = np.hypot(x, y)
    return 0.5 * x * x * r + 0.5 * x * y * y * _arsinh(x, y) - r**3 / 3.0


def _cross(x: Array, y: Array) -> Array:
    r = np.hypot(x, y)
    return -(2.0 * x * y * r + x**3 * _arsinh(y, x) + y**3 * _arsinh(x, y)) / 6.0


def _odd(x: Array, y: Array) -> Array:
    z = x + 1j * np.abs(y)
    logarithm = np.log(np.where(z == 0.0, 1.0, z))
    return np.asarray(-(z**3 * logarithm).real / 6.0 - 0.5 * np.pi * x * x * np.abs(y) * (x < 0.0)
                      + np.pi * np.abs(y) ** 3 / 12.0)


def _q(kx: Array, ky: Array) -> Array:
    return np.hypot(kx, ky)


# 1 / r
DIRECT = Kernel(lambda x, y: 1.0 / np.hypot(x, y), lambda x, y: _along(x, y) + _along(y, x),
                lambda kx, ky: 2.0 * np.pi / _q(kx, ky))
# x^2 / r^3
ALONG = Kernel(lambda x, y: x * x / np.hypot(x, y) ** 3, _along,
               lambda kx, ky: 2.0 * np.pi * ky**2 / _q(kx, ky) ** 3)
# y^2 / r^3
ACROSS = Kernel(lambda x, y: y * y / np.hypot(x, y) ** 3, lambda x, y: _along(y, x),
                lambda kx, ky: 2.0 * np.pi * kx**2 / _q(kx, ky) ** 3)
# x y / r^3
CROSS = Kernel(lambda x, y: x * y / np.hypot(x, y) ** 3, _cross,
               lambda kx, ky: -2.0 * np.pi * kx * ky / _q(kx, ky) ** 3)
# x / r^2 and y / r^2
ODD_X = Kernel(lambda x, y: x / np.hypot(x, y) ** 2, _odd,
               lambda kx, ky: -2.0j * np.pi * kx / _q(kx, ky) ** 2)
ODD_Y = Kernel(lambda x, y: y / np.hypot(x, y) ** 2, lambda x, y: _odd(y, x),
               lambda kx, ky: -2.0j * np.pi * ky / _q(kx, ky) ** 2)


def influence(kernel: Kernel, x: Array, y: Array, sides: tuple[float, float]) -> Array:
    """Means (...,) of a kernel over pixels at offsets x and y (...,) [m], of unit force on one."""
    a, b = sides
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    found = np.zeros(x.shape)
    far = np.maximum(np.abs(x) / a, np.abs(y) / b) > _FAR
    for s, w in zip(_NODES, _WEIGHTS, strict=True):
        for t, v in zip(_NODES, _WEIGHTS, strict=True):
            found[far] += w * v * kernel.point(x[far] + s * a, y[far] + t * b)
    near = ~far
    for i, w in ((-1, 1.0), (0, -2.0), (1, 1.0)):
        for j, v in ((-1, 1.0), (0, -2.0), (1, 1.0)):
            # In pixels, so that differences of F lose no digits to the units.
            found[near] += w * v * kernel.integral(x[near] + i * a, y[near] + j * b)
    found[near] /= (a * b) ** 2
    return found


class Convolution:
    """Displacements of the pixels of a grid (N, M) from the forces on them, by FFT.

    Free half-spaces are padded to twice the grid (discrete convolution, Liu, Wang and Liu, 2000).
    Periodic ones have the transform of the point force at the wave numbers of the grid, and no mean
    displacement.

    Parameters
    ----------
    terms : list of (float, Kernel)
        The kernel is their sum, factors included.
    shape, sides : (N, M) and (a, b)
        Numbers of pixels, and their sides [m].
    periodic : bool
        Whether the grid repeats itself in both directions.
    """

    def __init__(self, terms: list[tuple[float, Kernel]], shape: tuple[int, int],
                 sides: tuple[float, float], periodic: bool) -> None:
        from scipy import fft

        n, m = shape
        self._shape = shape
        self._size = shape if periodic else (2 * n, 2 * m)
        if periodic:
            kx = 2.0 * np.pi * fft.fftfreq(n, sides[0])[:, None]
            ky = 2.0 * np.pi * fft.rfftfreq(m, sides[1])[None, :]
            kx, ky = np.broadcast_arrays(kx, ky)
            waves = _q(kx, ky) > 0.0
            self._transform = np.zeros(kx.shape, dtype=complex)
            for factor, kernel in terms:
                self._transform[waves] += factor * kernel.transform(kx[waves], ky[waves])
            self._transform /= sides[0] * sides[1]
            return
        x, y = (side * (np.arange(2 * count) - 2 * count * (np.arange(2 * count) >= count))
                for count, side in zip(shape, sides, strict=True))
        kernel_sum = sum(factor * influence(kernel, x[:, None], y[None, :], sides)
                         for factor, kernel in terms)
        self._transform = fft.rfft2(kernel_sum)

    def __call__(self, forces: Array) -> Array:
        """Displacements (N, M) [m] of forces (N, M) [N]."""
        from scipy import fft

        whole = fft.irfft2(self._transform * fft.rfft2(forces, s=self._size), s=self._size)
        return np.ascontiguousarray(whole[: self._shape[0], : self._shape[1]])
