r"""Forces of large deflections in a modal basis, as springs along sums of its coordinates.

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
Hill and Neild, Proc. R. Soc. A 476, 2020, of y = y^), and contact nodes follow. Each term is a sum
of powers of linear combinations of coordinates, the potentials of springs.
"""

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.laws.normal.bilateral import BilateralPolynomial
from fecontact.reduction.large_deflections.fit import CondensedBody, scaled
from fecontact.reduction.mode_shapes import NonlinearStress
from fecontact.reduction.polynomial_stiffness import polynomial_stiffness

GROUP = "large deflections"
# Part of the potential in the fitted range below which a spring is left out.
_NO_SPRING = 1e-10
# Part of the energy of all linear coordinates below which one does not take part.
_NO_PART = 1e-12


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class LargeDeflectionForces(Summarised):
    """Forces of large deflections in a modal basis with m coordinates.

    Attributes
    ----------
    group : str
        Name of the group of nodes whose normal motions are the elongations of the springs.
    quadratic, cubic : (n,) arrays
        Stiffness of the springs: tension ``quadratic e^2 + cubic e^3`` [N/m^2], [N/m^3].
    coordinates : (d, m) array
        Rows of the coordinates of the modes with large deflections.
    ranges : (d, 2) array
        Least and largest value of each of them in the states that were fitted.
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

    group: str
    quadratic: Array
    cubic: Array
    coordinates: Array
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
            ("springs", f"{len(self.quadratic)}"),
        ]

    @property
    def law(self) -> BilateralPolynomial:
        """Normal law of the nodes."""
        return BilateralPolynomial(
            stiffness=0.0, quadratic_stiffness=tuple(self.quadratic.tolist()),
            cubic_stiffness=tuple(self.cubic.tolist()))

    def reach(self, coordinates: Array) -> float:
        """Largest coordinate in states (N, m), by the end of its fitted range, which is 1."""
        q = coordinates @ self.coordinates.T
        low, high = self.ranges.T
        return float(np.max(np.where(q > 0.0, q / high, q / low), initial=0.0))


def static_response(fitted: CondensedBody, projected: Array, w: Array) -> Array:
    """Static response (m, d, d) of linear coordinates, from ``psi_k^T M theta_ij`` of all.

    Zero for the modes with large deflections themselves, and where it has no energy.
    """
    found = np.array(projected)
    found[fitted.modes] = 0.0
    reach = np.abs(fitted.ranges).max(axis=1)
    energy = (w[:, None, None] * found * np.outer(reach, reach)) ** 2
    found[energy < _NO_PART * energy.sum()] = 0.0
    return found


def nonlinear_stress(fitted: CondensedBody, response: Array, stress: Array) -> NonlinearStress:
    r"""Stress beside the linear one (N, c, m) of all coordinates.

    .. math:: \sigma = \sum_k \sigma_k x_k + \sigma_2(q) + \sigma_3(q)
        - \sum_k \sigma_k \hat y_k(q),

    so that the stress of statics, which is fitted, holds for y = y^(q).
    """
    m, d = len(response), len(fitted.modes)
    terms = np.array(fitted.stress)
    for k, powers in enumerate(fitted.powers):
        places = np.repeat(np.arange(d), powers)
        if len(places) == 2:
            i, j = places
            terms[..., k] -= stress @ (response[:, i, j] * (0.5 if i == j else 1.0))
    return NonlinearStress(np.eye(m)[fitted.modes], fitted.powers, terms)


def large_deflection_forces(
    fitted: CondensedBody, response: Array, w: Array, largest: Array, size: float
) -> tuple[LargeDeflectionForces, Array]:
    """Forces in a basis with the frequencies w (m,), and rows (n, m) of their springs.

    Parameters
    ----------
    fitted : CondensedBody
        Potential of the modes, which are coordinates of the basis too.
    response : (m, d, d) array
        Static response, see :func:`static_response`.
    w : (m,) array
        Angular frequencies [rad/s].
    largest : (d,) array
        Largest displacement of each mode's shape, which makes its coordinate one in metres.
    size : float
        Displacement up to which the forces were fitted [m].
    """
    modes, d, m = fitted.modes, len(fitted.modes), len(w)
    reach = np.abs(fitted.ranges).max(axis=1)
    stiff = w[:, None, None] ** 2 * response
    quartic = fitted.quartic + 4.0 * _symmetric(
        0.125 * np.einsum("kij,kln->ijln", response, stiff))
    rows, law = polynomial_stiffness(
        scaled(fitted.cubic, 1.0 / largest), scaled(quartic, 1.0 / largest))
    own = np.zeros((d, m))
    own[np.arange(d), modes] = largest
    springs = [(row, second, third) for row, second, third in zip(
        rows[:, 1] @ own, np.asarray(law.quadratic_stiffness), np.asarray(law.cubic_stiffness),
        strict=True)]
    for i in range(d):
        springs += _square_times(own[i], stiff[:, i, i] / largest[i] ** 2,
                                 response[:, i, i] * reach[i] ** 2, reach[i] * largest[i])
    for i, j in combinations(range(d), 2):
        pull = stiff[:, i, j] / (largest[i] * largest[j])
        moved, far = response[:, i, j] * reach[i] * reach[j], reach[i] * largest[i]
        springs += _product(own[i], own[j], pull, moved, far)
    reached = _reached(springs, fitted, response, reach)
    kept = [one for one, size_of in zip(springs, reached, strict=True)
            if size_of > _NO_SPRING * max(reached)]
    found = LargeDeflectionForces(
        GROUP, np.array([one[1] for one in kept]), np.array([one[2] for one in kept]),
        np.eye(m)[modes], fitted.ranges, size, fitted.largest_strain, fitted.force_error,
        fitted.displacement_error, fitted.stress_error, fitted.other_load_error, fitted.states)
    return found, np.array([one[0] for one in kept])


def _square_times(
    row: Array, pull: Array, moved: Array, far: float
) -> list[tuple[Array, float, float]]:
    """Springs with the potential ``-(row . x)^2 (pull . x) / 2``.

    ``s^2 z = ((s + c z)^3 - (s - c z)^3 - 2 (c z)^3) / (6 c)``, where c makes both comparable:
    ``moved`` is a displacement x that belongs to s = ``far``.
    """
    c = _comparable(pull, moved, far)
    # A spring with the potential g e^3 has the tension 3 g e^2.
    size = -0.25 / c if c else 0.0
    return [(row + c * pull, size, 0.0), (row - c * pull, -size, 0.0),
            (c * pull, -2.0 * size, 0.0)] if c else []


def _product(
    first: Array, second: Array, pull: Array, moved: Array, far: float
) -> list[tuple[Array, float, float]]:
    """Springs with the potential ``-(first . x) (second . x) (pull . x)``.

    ``24 a b c z = (a + b + c z)^3 - (-a + b + c z)^3 - (a - b + c z)^3 - (a + b - c z)^3``;
    ``moved`` and ``far`` are those of :func:`_square_times`.
    """
    c = _comparable(pull, moved, far)
    size = -0.125 / c if c else 0.0
    return [(row, sign * size, 0.0) for row, sign in (
        (first + second + c * pull, 1.0), (second - first + c * pull, -1.0),
        (first - second + c * pull, -1.0), (first + second - c * pull, -1.0))] if c else []


def _comparable(pull: Array, moved: Array, far: float) -> float:
    """Factor that makes ``pull . x`` as long as ``far`` under the displacement ``moved``, or 0."""
    along = abs(float(pull @ moved))
    return far / along if along else 0.0


def _reached(
    springs: list[tuple[Array, float, float]], fitted: CondensedBody, response: Array, reach: Array
) -> list[float]:
    """Largest energy of each spring in the fitted range."""
    state = 0.5 * np.abs(np.einsum("kij,i,j->k", np.abs(response), reach, reach))
    state[fitted.modes] = reach
    lengths = [float(np.abs(row) @ state) for row, _, _ in springs]
    return [abs(second) * e**3 / 3.0 + 0.25 * abs(third) * e**4
            for e, (_, second, third) in zip(lengths, springs, strict=True)]


def _symmetric(tensor: Array) -> Array:
    """Mean over all orders of four indices."""
    return np.asarray(sum(np.transpose(tensor, order) for order in permutations(range(4))) / 24.0)
