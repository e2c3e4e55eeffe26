"""Forces and stresses of large deflections in the modes of a basis, from those of the body."""

from itertools import combinations_with_replacement, permutations

import numpy as np

from fecontact.core.types import Array
from fecontact.reduction.large_deflections.fit import CondensedBody
from fecontact.reduction.large_deflections.forces import LargeDeflectionForces
from fecontact.reduction.mode_shapes import NonlinearStress

# Part of the energy of all linear coordinates below which one does not take part.
_NO_PART = 1e-12


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
    fitted: CondensedBody, response: Array, w: Array, size: float
) -> LargeDeflectionForces:
    """Forces in a basis with the frequencies w (m,).

    Parameters
    ----------
    fitted : CondensedBody
        Potential of the modes, which are coordinates of the basis too.
    response : (m, d, d) array
        Static response, see :func:`static_response`.
    w : (m,) array
        Angular frequencies [rad/s].
    size : float
        Displacement up to which the forces were fitted [m].
    """
    modes, d, m = fitted.modes, len(fitted.modes), len(w)
    stiff = w[:, None, None] ** 2 * response
    quartic = fitted.quartic + 4.0 * _symmetric(
        0.125 * np.einsum("kij,kln->ijln", response, stiff))
    pairs = np.array(list(combinations_with_replacement(range(d), 2)))
    i, j = pairs.T
    # A product of two coordinates stands for both orders.
    orders = np.where(i == j, 1.0, 2.0)
    cubic = -0.5 * orders[:, None] * stiff[:, i, j].T
    cubic[:, modes] += orders[:, None] * fitted.cubic[i, j] / 3.0
    return LargeDeflectionForces(
        np.eye(m)[modes], pairs, cubic,
        0.5 * np.outer(orders, orders) * quartic[i[:, None], j[:, None], i, j],
        fitted.ranges, size, fitted.largest_strain, fitted.force_error,
        fitted.displacement_error, fitted.stress_error, fitted.other_load_error, fitted.states)


def _symmetric(tensor: Array) -> Array:
    """Mean over all orders of four indices."""
    return np.asarray(sum(np.transpose(tensor, order) for order in permutations(range(4))) / 24.0)
