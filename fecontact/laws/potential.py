"""Energy stored by any normal law, by quadrature."""

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import f8, i8, kernel, matrix
from fecontact.laws.contract import NormalLaw, normal_at

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(20)


def stored_energy(
    law: NormalLaw, penetration: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u.

    Gauss-Legendre quadrature with 20 points on each side of the law's ``penetration_scale``;
    laws that change their character elsewhere give a closed form instead.

    Parameters
    ----------
    law : NormalLaw
        One law for all nodes.
    penetration : (..., n) array
        u of the contact nodes [m]. Below zero the energy is that of the way from 0 down to u.
    share : (n,) array
        Part of the contact face that belongs to each node.
    """
    given = np.asarray(penetration, dtype=float)
    rows = np.ascontiguousarray(given.reshape(-1, len(share)))
    energy = np.empty_like(rows)
    _energy(law.kernel.address, rows, law.table(share), law.penetration_scale, energy)
    return energy.reshape(given.shape)


@kernel(types.void(i8, matrix, matrix, f8, matrix))
def _energy(address, penetration, p, scale, out):  # type: ignore[no-untyped-def]
    """Fill out (N, n) from penetrations (N, n) and parameters (n, k)."""
    force = normal_at(address)
    for i in range(penetration.shape[0]):
        for j in range(penetration.shape[1]):
            end = penetration[i, j]
            middle = min(max(end, -scale), scale)
            total = 0.0
            for low, high in ((0.0, middle), (middle, end)):
                if low == high:
                    continue
                half, mean = 0.5 * (high - low), 0.5 * (high + low)
                for k in range(len(_POINTS)):
                    total += half * _WEIGHTS[k] * force(mean + half * _POINTS[k], 0.0, p[j])[0]
            out[i, j] = total
