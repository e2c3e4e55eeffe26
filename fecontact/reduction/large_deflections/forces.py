r"""Forces of large deflections in a modal basis, by one potential of its coordinates.

Beside the coordinates q of modes with large deflections a basis has linear ones y: other modes and
vectors of stretching, which take the displacement fields theta. With the static response of each
to q, :math:`\hat y_k = \tfrac12 \psi_k^T M \theta_{ij} q_i q_j`, the potential is

.. math::

    V(q, y) = V(q) + \tfrac12 \sum_k w_k^2 (y_k - \hat y_k(q))^2 ,

where V(q) is the condensed potential, which holds for y = y^(q). The squares of y are those of the
linear basis, so that what is added are terms of the degrees three and four,

.. math::

    V_3(q) + V_4(q) - \sum_k w_k^2 y_k \hat y_k(q) + \tfrac12 \sum_k w_k^2 \hat y_k(q)^2 .

The kinetic energy stays quadratic: y moves as the fields theta do, with their inertia (Nicolaidou,
Hill and Neild, Proc. R. Soc. A 476, 2020, of y = y^), and contact nodes follow. Over the products
p of two of the q all of this is ``p . L x + p . Q p / 2``, where x are all coordinates; see
:mod:`fecontact.system.polynomial_forces`.
"""

from dataclasses import dataclass, replace

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class LargeDeflectionForces(Summarised):
    r"""Forces of large deflections in a modal basis with m coordinates x.

    They have the potential

    .. math::

        V = p \cdot L x + \tfrac12\, p \cdot Q p, \qquad p_r = c_{i_r} c_{j_r}, \quad c = R x

    beside that of the linear stiffness, and are minus its derivative [N kg^(-1/2)].

    Attributes
    ----------
    coordinates : (d, m) array
        R, rows of the coordinates of the modes with large deflections.
    pairs : (P, 2) integer array
        i and j of each product, ``P = d (d + 1) / 2``.
    cubic : (P, m) array
        L, coefficients of the third degree.
    quartic : (P, P) array
        Q, those of the fourth degree, from a symmetric tensor.
    ranges : (d, 2) array
        Least and largest value of each coordinate in the states that were fitted.
    largest_displacement, largest_strain : float
        Displacement up to which they were fitted [m], and the strain there.
    force_error, displacement_error, stress_error : float
        Largest errors in static states that were not fitted, relative to the load, to the
        largest displacement and to the largest stress.
    other_load_error : float
        Larger of the errors of forces and displacements where a uniform acceleration acts beside
        loads on the modes, which do not see it.
    states : int
        Number of static solutions that were fitted.
    """

    coordinates: Array
    pairs: Integers
    cubic: Array
    quartic: Array
    ranges: Array
    largest_displacement: float
    largest_strain: float
    force_error: float
    displacement_error: float
    stress_error: float
    other_load_error: float
    states: int

    def summary(self) -> list[tuple[str, str]]:
        """Modes, range, and errors of the fit."""
        return [
            ("modes with large deflections", f"{len(self.ranges)}"),
            ("fitted up to", f"{self.largest_displacement:.4g} m, {self.states} static solutions"),
            ("largest strain there", f"{self.largest_strain:.2g}"),
            ("error of forces", f"{100.0 * self.force_error:.2g} %"),
            ("error of displacements", f"{100.0 * self.displacement_error:.2g} %"),
            ("error of stresses", f"{100.0 * self.stress_error:.2g} %"),
            ("error beside another load", f"{100.0 * self.other_load_error:.2g} %"),
        ]

    def in_modes(self, modes: Array) -> "LargeDeflectionForces":
        """Return the forces in other coordinates z, of which x = ``modes`` (m, k) z."""
        return replace(self, coordinates=self.coordinates @ modes, cubic=self.cubic @ modes)

    def displacements(self, w: Array) -> Array:
        """Rows (k, m) by which coordinates are displacements, as large as the fitted one [m].

        Those of the modes where they reach the ends of their ranges, those of the linear
        coordinates, of frequencies w (m,), in their static response to that.
        """
        R, reach = self.coordinates, np.abs(self.ranges).max(axis=1)
        beside = self.cubic - self.cubic @ np.linalg.pinv(R) @ R
        square = w**2
        compliance = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)
        moved = (beside**2) @ compliance * np.prod(reach[self.pairs], axis=1)
        felt = moved > 0.0
        return self.largest_displacement * np.vstack(
            [R / reach[:, None], beside[felt] / moved[felt, None]])

    def reach(self, coordinates: Array) -> float:
        """Largest coordinate in states (N, m), by the end of its fitted range, which is 1."""
        q = coordinates @ self.coordinates.T
        low, high = self.ranges.T
        return float(np.max(np.where(q > 0.0, q / high, q / low), initial=0.0))
