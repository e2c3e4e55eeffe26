"""What people plot of a branch of orbits: extremes and histories of displacements."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation.continuation.branch import Branch, BranchPoint
from fecontact.bifurcation.orbits.mesh import extremes, interpolate
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError

Array = NDArray[np.float64]


def orbit_nodes(point: BranchPoint, states: int) -> tuple[Array, Array, int]:
    """Mesh (N + 1,), nodes (N m, d) and degree m of an orbit; ``states`` is d.

    Raises
    ------
    InputError
        If the orbit was not found by collocation.
    """
    require_kind("A periodic orbit", BranchPoint, point=point)
    if "mesh" not in point.values:
        raise InputError("The point is no periodic orbit.")
    mesh = np.asarray(point.values["mesh"], dtype=float)
    # Behind the nodes stand the parameter and, without forcing, the period.
    intervals = len(mesh) - 1
    degree = (len(point.u) - 1) // (intervals * states)
    if degree < 2:
        raise InputError("The orbit was found by shooting, which keeps the states at the ends of "
                         "its segments only; run it from there with simulate.")
    count = intervals * degree * states
    return mesh, np.ascontiguousarray(point.u[:count].reshape(-1, states)), degree


def orbit_history(point: BranchPoint, states: int, samples: int = 400) -> tuple[Array, Array]:
    """Times (k,) [s] and states (k, d) of an orbit over one period, both ends included."""
    _require_counts(states=states, samples=samples)
    mesh, nodes, _ = orbit_nodes(point, states)
    phases = np.linspace(0.0, 1.0, samples)
    return phases * float(point.values["period"]), interpolate(mesh, nodes, phases)


def _require_counts(**values: Any) -> None:
    for name, value in values.items():
        if not (isinstance(value, int | np.integer) and value >= 1):
            raise InputError(f"orbit_history: {name} = {value!r} must be a whole number from 1 on.")


def quantity_range(point: BranchPoint, row: ArrayLike) -> tuple[float, float]:
    """Smallest and largest value of a linear quantity ``row @ x`` over an orbit or equilibrium.

    ``row`` (d,) is a row of the states, such as that of a displacement
    (:meth:`fecontact.bifurcation.fields.contact_field.ContactField.displacement_row`).
    """
    require_kind("quantity_range", BranchPoint, point=point)
    weights = as_floats(row, "row")
    if weights.ndim != 1:
        raise InputError(f"row must hold one number for each state, not shape {weights.shape}.")
    if "mesh" not in point.values:
        value = float(weights @ np.asarray(point.values["state"]))
        return value, value
    _, nodes, degree = orbit_nodes(point, len(weights))
    low, high = extremes((nodes @ weights)[:, None].copy(), degree)
    return float(low[0]), float(high[0])


def amplitude(row: ArrayLike) -> Callable[[BranchPoint], float]:
    """A function of a branch's points: (max - min) / 2 of ``row @ x``; zero at equilibria."""
    def of(point: BranchPoint) -> float:
        low, high = quantity_range(point, row)
        return (high - low) / 2.0

    return of


def amplitudes(branch: Branch, row: ArrayLike) -> Array:
    """Amplitude (N,) of ``row @ x`` at all points of a branch; see :func:`amplitude`."""
    return np.array([amplitude(row)(point) for point in branch.points])
