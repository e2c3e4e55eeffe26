"""What a branch of a contact system does at one of its points: the range of a displacement."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation.continuation.branch import Branch, BranchPoint, require_on_branch
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import require_field
from fecontact.bifurcation.orbits.mesh import extremes, interpolate
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.simulate import simulate


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


_SAMPLES = 1000
# For extremes, which are met to the square of the spacing.
_FINE = 4000


def observe(
    field: ContactField, branch: Branch, point: str | int = "B", axis: Literal["x", "y"] = "x"
) -> Branch:
    """The branch with the range of a displacement at each of its points.

    Stored are the numbers 'observed_minimum', 'observed_maximum' and 'observed_amplitude', half of
    what lies between the two [m], of an equilibrium or over one period; for orbits of excited
    systems also 'observed_section' (n,), its values at the starts of the n periods of the
    excitation, as :func:`fecontact.brute_force` keeps them.

    Parameters
    ----------
    field, branch : ContactField, Branch
        A branch of equilibria or orbits, by collocation or shooting, and its field.
    point, axis
        'B', 'C', a named point or the number of a contact node; 'x' or 'y'.

    Raises
    ------
    InputError
        If there is no such point.
    """
    require_kind("observe", ContactField, field=field)
    require_kind("observe", Branch, branch=branch)
    row = field.displacement_row(point, axis)
    points = []
    for one in branch.points:
        low, high, section = _range(field, branch, one, row)
        points.append(replace(one, values={
            **one.values, "observed_minimum": low, "observed_maximum": high,
            "observed_amplitude": (high - low) / 2.0, **section}))
    return replace(branch, points=tuple(points))


def _range(
    field: ContactField, branch: Branch, point: BranchPoint, row: Array
) -> tuple[float, float, dict[str, Array]]:
    if "period" not in point.values:
        return *quantity_range(point, row), {}
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    excited = field.forcing_period(values) is not None
    phases = np.arange(int(branch.attributes["periods"])) / int(branch.attributes["periods"])
    if not shot(branch):
        mesh, nodes, _ = orbit_nodes(point, field.dimension)
        section = interpolate(mesh, nodes, phases) @ row
        return *quantity_range(point, row), {"observed_section": section} if excited else {}
    time, states = motion_of(field, branch, point, _FINE)
    motion = states @ row
    section = np.interp(phases, time / time[-1], motion)
    return (float(motion.min()), float(motion.max()),
            {"observed_section": section} if excited else {})


def shot(branch: Branch) -> bool:
    """Whether the branch holds orbits from shooting."""
    return "segments" in branch.attributes


def motion_of(
    field: ContactField, branch: Branch, point: BranchPoint, samples: int = _SAMPLES
) -> tuple[Array, Array]:
    """Times (k,) [s] and states (k, d) over one period of an orbit, both ends included.

    Orbits from shooting are run again, segment by segment.

    Raises
    ------
    InputError
        If the point is no orbit.
    """
    require_field(field)
    require_on_branch("motion_of", branch, point)
    if "period" not in point.values:
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g} is no periodic "
                         f"orbit.")
    if not shot(branch):
        return orbit_history(point, field.dimension, samples)
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    values[field.index(branch.name)] = point.parameter
    system, T = field.system(values), float(point.values["period"])
    ends = np.asarray(point.values["mesh"], dtype=float) * T
    count = len(ends) - 1
    starts = point.u[: count * field.dimension].reshape(count, -1)
    each = max(2, -(-samples // count))
    runs = [simulate(system, float(end), t_start=float(begin), initial=start, outputs=each,
                     rtol=1e-7)
            for start, begin, end in zip(starts, ends[:-1], ends[1:], strict=True)]
    return (np.concatenate([run.time for run in runs]),
            np.concatenate([run.states for run in runs]))
