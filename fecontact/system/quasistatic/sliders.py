"""Sliders of the contact nodes of a system: springs of friction laws, or of stuck contacts."""

import math
from collections.abc import Iterable, Sequence
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array
from fecontact.laws.base import FrictionLaw
from fecontact.laws.friction_curve import static_coefficient
from fecontact.system.arrays import LawGroup
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.pose import Sliders

# Penalty of rigid sticking, in stiffnesses of the contact or the body: forces round off with it.
_PENALTY = 1e2


def springs_of(law: FrictionLaw, share: Array) -> tuple[Array, Array]:
    """Springs and limits of :meth:`FrictionLaw.sliders`; InputError for a law without them."""
    found = law.sliders(share)
    if found is None:
        raise InputError(f"{type(law).__name__} has no quasi-static limit made of springs and "
                         f"sliders; use JenkinsFriction, IwanFriction or a law without memory.")
    return found


def friction_springs(
    groups: Iterable[LawGroup], n: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Springs (n, e) [N/m] and limits (n, e) of friction, and nodes (n,) without springs yet.

    These have laws without memory.
    """
    each = [(nodes, share, law) for nodes, share, law in groups]
    stiffness, limit = np.zeros((2, n, max(law.memory or 1 for _, _, law in each)))
    plain = np.ones(n, dtype=bool)
    for nodes, share, law in each:
        if law.memory:
            stiffness[nodes, : law.memory], limit[nodes, : law.memory] = springs_of(law, share)
            plain[nodes] = False
        else:
            limit[nodes, 0] = static_coefficient(law, nodes.stop - nodes.start)
    return stiffness, limit, plain


def sliders_of(
    system: ContactSystem, tangential_ratio: float,
    tangential_stiffness: float | Sequence[float] | None, normal_slope: Array,
) -> Sliders:
    """Springs and limits of all contact nodes.

    Parameters
    ----------
    system : ContactSystem
        Its Jenkins and Iwan laws have springs of their own.
    tangential_ratio : float
        c_T / c_N of all others, infinite for rigid sticking.
    tangential_stiffness : float or (n,) sequence, optional
        c_T of the whole face, or of each node [N/m], instead of the ratio.
    normal_slope : (n,) array
        c_N = dF/du under the preload [N/m]; nodes that are open there take the mean of the others
        by their share of the face.

    InputError for values that are not above zero, and where there is no c_N for the ratio.
    """
    n = system.basis.contact_nodes
    stiffness, limit, plain = friction_springs(system.law_groups("friction"), n)
    rigid = np.zeros_like(stiffness)
    if plain.any():
        share = system.share
        given = _given(tangential_ratio, tangential_stiffness, n, share)
        slope = _everywhere(normal_slope, share)
        if given is not None:
            held = given
        elif math.isinf(tangential_ratio):
            held = np.full(n, np.inf)
        elif slope.any() or not limit[plain].any():
            # Without friction no stiffness is needed.
            held = tangential_ratio * np.where(slope > 0.0, slope, 1.0)
        else:
            raise InputError("The normal law has no stiffness under the preload, from which that "
                             "of stuck contacts could follow; give tangential_stiffness, or "
                             "tangential_ratio = inf for rigid sticking.")
        infinite = np.isinf(held)
        held = np.where(infinite, _penalty(system, slope), held)
        stiffness[plain, 0], rigid[plain, 0] = held[plain], infinite[plain]
    return Sliders(stiffness, limit, rigid)


def components(values: Array, before: int = 0) -> Array:
    """Forces or places (..., n, e, k) of sliders along the k tangents of their nodes.

    From (..., n, e) in the plane and (..., n, e, 2) in space, with so many axes ``before`` n.
    """
    return values if values.ndim > before + 2 else values[..., None]


def _given(
    ratio: float, stiffness: float | Sequence[float] | None, n: int, share: Array
) -> Array | None:
    """Stiffness (n,) that was given, if it was."""
    if not (isinstance(ratio, Real) and not isinstance(ratio, bool) and ratio > 0.0):
        raise InputError(f"tangential_ratio = {shown(ratio)} must be a number above zero; inf for "
                         f"rigid sticking.")
    if stiffness is None:
        return None
    values = as_floats(stiffness, "tangential_stiffness")
    if values.shape not in ((), (n,)) or not (values > 0.0).all():
        raise InputError(f"tangential_stiffness = {shown(stiffness)} must be one number above "
                         f"zero, or one for each of the {n} contact nodes.")
    return values * share if values.ndim == 0 else values


def _everywhere(slope: Array, share: Array) -> Array:
    """Slopes (n,) of closed nodes, and for open ones the mean of these by share."""
    closed = slope > 0.0
    if not closed.any():
        return np.zeros_like(slope)
    return np.where(closed, slope, share * slope[closed].sum() / share[closed].sum())


def _penalty(system: ContactSystem, slope: Array) -> Array:
    """Penalty (n,) for rigid sticking, well above the stiffness of contact and body."""
    body = np.zeros_like(slope)
    for rows in system.arrays.rows[:, ::2].swapaxes(0, 1):
        size = (rows**2).sum(axis=1)
        # Nodes on supports do not move at all.
        moves = size > 1e-24 * size.max(initial=0.0)
        along = np.where(moves, (rows**2) @ np.abs(np.diag(system.arrays.stiffness)), 0.0)
        body = np.maximum(body, along / np.where(moves, size, 1.0) ** 2)
    return _PENALTY * np.maximum(np.maximum(slope, body), 1e-6 * max(
        body.max(initial=0.0), slope.max(initial=0.0), 1.0))
