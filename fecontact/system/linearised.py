"""Equations of small motions about a state, without deflections that follow others."""

import numpy as np

from fecontact.core.types import Array
from fecontact.laws.friction.maxwell_slip import AT_LIMIT
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import SHORT, exact_arrays, excesses, slider_counts


def linearised(system: ContactSystem, t: float, state: Array) -> tuple[Array, Array]:
    r"""Matrix A (d, d) of small motions about a state, and columns (d, k) that span its states.

    Deflections of elastic Coulomb elements are no states of their own. An element that sticks is a
    spring, ``dz = dx``; the force of one that slides follows the limit, ``dR = mu dF``. In space
    the deflection z_t of a sliding element across the direction of sliding remains a state. With
    the slip speed V and the limit l,

    .. math:: \dot z_t = \dot x_t - \frac{V}{l} z_t

    An element at rest at its limit sticks. Elements of open contacts have no force. The columns
    are orthonormal.
    """
    counts = slider_counts(system)
    if not counts.any():
        return system.jacobian(t, state), np.eye(system.size)
    n, m, tangents = system.basis.contact_nodes, system.basis.modes, system.basis.dimension - 1
    y = np.array(state, dtype=float)
    beyond = np.empty((n, int(counts.max())))
    excesses(t, y, exact_arrays(system.arrays, counts), counts, beyond)
    history = system.contact_history(np.array([t]), y[None])[0]
    slips = history[:, [4, 7][:tangents]]
    elements = [(j, i, 2 * m + j * system.memory + tangents * i + np.arange(tangents))
                for j in range(n) for i in range(counts[j])]
    limits, sliding = np.empty_like(beyond), np.zeros(beyond.shape, dtype=bool)
    # Deflections clearly on one side of their limits.
    for j, i, at in elements:
        size = float(np.linalg.norm(y[at]))
        limits[j, i] = limit = size - beyond[j, i]
        slides = history[j, 0] == 0.0 or limit == 0.0 or (
            size >= (1.0 - AT_LIMIT) * limit and float(y[at] @ slips[j]) > 0.0)
        sliding[j, i] = slides
        if size > 0.0 and (slides or size > (1.0 - SHORT) * limit):
            y[at] *= limit / size * (1.0 + AT_LIMIT if slides else 1.0 - SHORT)
    A = system.jacobian(t, y)
    within = np.eye(system.size)
    kept = np.ones(system.size, dtype=bool)
    for j, i, at in elements:
        kept[at] = False
        if not sliding[j, i]:
            A[:, :m] += A[:, at] @ A[at, m : 2 * m]
        elif tangents == 2 and limits[j, i] > 0.0 and history[j, 0] != 0.0:
            along = y[at] / np.linalg.norm(y[at])
            across = np.array([-along[1], along[0]])
            A[np.ix_(at, at)] = -(along @ slips[j]) / limits[j, i] * np.eye(2)
            kept[at[0]] = True
            within[at, at[0]] = across
    return A, within[:, kept]
