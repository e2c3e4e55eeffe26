"""Energy stored by any normal law, by quadrature."""

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.core.compiled import f8, i8, kernel, matrix
from fecontact.laws.signatures import normal_at

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def stored_energy(
    address: int, penetration: NDArray[np.float64], parameters: NDArray[np.float64], scale: float
) -> NDArray[np.float64]:
    """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u.

    Gauss-Legendre quadrature with 16 points in each interval between 0 and 1, 3, 9, 27, ... times
    the scale; laws with joints elsewhere give a closed form instead.

    Parameters
    ----------
    address : int
        Address of the compiled function of the law.
    penetration : (..., n) array
        u of the contact nodes [m]. Below zero the energy is that of the way from 0 down to u.
    parameters : (n, k) array
        Parameters of the law at each node.
    scale : float
        Penetration over which the law changes its character [m].
    """
    given = np.asarray(penetration, dtype=float)
    rows = np.ascontiguousarray(given.reshape(-1, len(parameters)))
    energy = np.empty_like(rows)
    _energy(address, rows, parameters, scale, energy)
    return energy.reshape(given.shape)


@kernel(types.void(i8, matrix, matrix, f8, matrix))
def _energy(address, penetration, p, scale, out):  # type: ignore[no-untyped-def]
    """Fill out (N, n) from penetrations (N, n) and parameters (n, k)."""
    force = normal_at(address)
    for i in range(penetration.shape[0]):
        for j in range(penetration.shape[1]):
            end = penetration[i, j]
            direction = 1.0 if end > 0.0 else -1.0
            total, low, high = 0.0, 0.0, scale
            while low < abs(end):
                half, mean = 0.5 * (min(high, abs(end)) - low), 0.5 * (min(high, abs(end)) + low)
                for k in range(len(_POINTS)):
                    u = direction * (mean + half * _POINTS[k])
                    total += direction * half * _WEIGHTS[k] * force(u, 0.0, p[j])[0]
                low, high = high, 3.0 * high
            out[i, j] = total if end == end else end
