"""The friction curve R/F over slip velocity of laws without memory, and its extremes.

They are found by sampling the compiled law, so that user-defined laws work as well.
"""

from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.laws.sampling import law_values

# Smoothing slope and slip velocity at which every smoothed sign is 1 to the last digit while the
# curve of the coefficient has not begun to change.
STEEP, CREEP = 1e36, 1e-18
# Speeds searched for extremes, in units of the law's velocity scale.
_SEARCHED = np.geomspace(1e-6, 1e12, 4001)


def coefficient(law: Any, velocity: Array | float) -> Array:
    """R/F at slip velocities [m/s]; it has the sign of the velocity.

    Parameters
    ----------
    law : FrictionLaw
        A law without memory.
    velocity : (...) array or float
        Slip velocities [m/s]; with parameters per node, (n,) of them, they broadcast against (n,).

    Returns
    -------
    (...) array
    """
    return _curve(law, velocity, 0)


def slope(law: Any, velocity: Array | float) -> Array:
    """d(R/F)/dv [s/m] at slip velocities [m/s]; arguments as for :func:`coefficient`."""
    return _curve(law, velocity, 1)


def largest_coefficient(law: Any) -> tuple[Array, Array]:
    """Largest maximum of R/F over slip velocity, and the velocity where it lies [m/s].

    Without a maximum the velocity is infinite, and the coefficient is the limit of R/F, which is
    infinite with a viscous term.

    Returns
    -------
    (n,) array, (n,) array
        One value per contact node if a parameter is given per node, else one.
    """
    return _largest(law, _nodes(law))


def static_coefficient(law: Any, nodes: int) -> Array:
    """Coefficient (n,) that limits friction at rest: mu(0+) of the law without its smoothing.

    For laws without a ``smoothing_slope`` it is the largest maximum of R/F. InputError if R/F grows
    without bound.
    """
    names = [entry.name for entry in fields(law)]
    if "smoothing_slope" in names:
        steep = replace(law, smoothing_slope=STEEP)
        return _per_node(steep, nodes, lambda single, row: [
            _sampled(single, np.array([CREEP]), row)[0, 0]])[:, 0]
    found = _largest(law, nodes)[0]
    if not np.isfinite(found).all():
        raise InputError(f"{type(law).__name__} has no largest coefficient: its friction force "
                         f"grows with slip velocity without bound; use a law with a "
                         f"smoothing_slope, or one without the viscous term.")
    return found


def velocity_of_minimum(law: Any) -> Array:
    """Smallest slip velocity (n,) at which R/F has a minimum [m/s], infinite without one.

    Between the maximum and this minimum friction decreases with slip velocity, and steady sliding
    may be unstable.
    """
    def smallest(single: Any, row: Array) -> list[float]:
        minima = _turning_points(single, row, falling_before=True)
        return [min(minima, default=np.inf)]

    return _per_node(law, _nodes(law), smallest)[:, 0]


@lru_cache(maxsize=64)  # Many short runs may use the same law.
def stick_velocity(law: Any, nodes: int) -> Array:
    """Slip velocity (n,) of the largest maximum of R/F, else ten times the velocity scale."""
    velocity = _largest(law, nodes)[1]
    width = _per_node(law, nodes, lambda single, _: [10.0 * single.velocity_scale])[:, 0]
    found = np.where(np.isfinite(velocity), velocity, width)
    found.setflags(write=False)
    return found


def _largest(law: Any, nodes: int) -> tuple[Array, Array]:
    def largest(single: Any, row: Array) -> list[float]:
        maxima = _turning_points(single, row, falling_before=False)
        if maxima:
            values = _sampled(single, np.array(maxima), row)[:, 0]
            best = int(np.argmax(values))
            return [values[best], maxima[best]]
        far = single.velocity_scale * np.array([1e20, 1e30])
        below, limit = _sampled(single, far, row)[:, 0]
        return [limit if limit < 2.0 * below else np.inf, np.inf]

    value, velocity = _per_node(law, nodes, largest).T
    return value, velocity


def _turning_points(
    law: Any, row: Array, *, falling_before: bool
) -> list[float]:
    """Speeds at which the slope of the curve changes its sign."""
    speeds = law.velocity_scale * _SEARCHED
    slopes = _sampled(law, speeds, row)[:, 1] * (-1.0 if falling_before else 1.0)
    tilted = np.flatnonzero(slopes)
    before, after = tilted[:-1], tilted[1:]
    turns = np.flatnonzero((slopes[before] > 0.0) & (slopes[after] < 0.0))
    return [
        brentq(lambda v: _sampled(law, np.array([v]), row)[0, 1], speeds[before[i]],
               speeds[after[i]], xtol=1e-300, rtol=1e-12)
        for i in turns
    ]


def _curve(law: Any, velocity: Array | float, column: int) -> Array:
    nodes = _nodes(law)
    v = as_floats(velocity, f"{type(law).__name__}: velocity")
    if nodes == 1:
        return _sampled(law, v.reshape(-1), _table(law, 1)[0])[:, column].reshape(v.shape)
    v = np.broadcast_to(v, np.broadcast_shapes(v.shape, (nodes,)))
    values = np.empty(v.shape)
    for j, row in enumerate(_table(law, nodes)):
        part = v[..., j]
        values[..., j] = _sampled(law, part.reshape(-1), row)[:, column].reshape(part.shape)
    return values


def _sampled(law: Any, v: Array, row: Array) -> Array:
    if law.memory:
        raise InputError(f"{type(law).__name__} has memory: its force is not a curve over slip "
                         f"velocity.")
    # Under a normal force of 1 N.
    return law_values(law.kernel.address, row, v, np.ones(v.size))[:, :2]


def _nodes(law: Any) -> int:
    """Number of nodes with parameters of their own, else 1."""
    given = (getattr(law, entry.name) for entry in fields(law))
    return max((len(value) for value in given if isinstance(value, tuple)), default=1)


def _table(law: Any, nodes: int) -> Array:
    return law.table(np.full(nodes, 1.0 / max(nodes, 1)))


def _per_node(
    law: Any, nodes: int, answer: Callable[[Any, Array], list[float]]
) -> Array:
    """Results (n, ...) from the law and parameters of one node, computed once for equal nodes."""
    # Of one node without any: the shape of a result is known from one only.
    rows, first, inverse = np.unique(_table(law, max(nodes, 1)), axis=0, return_index=True,
                                     return_inverse=True)
    found = []
    for row, node in zip(rows, first, strict=True):
        own = {entry.name: value[node] for entry in fields(law)
               if isinstance(value := getattr(law, entry.name), tuple)}
        found.append(answer(replace(law, **own), np.ascontiguousarray(row)))
    return np.array(found)[inverse.reshape(-1)[:nodes]]
