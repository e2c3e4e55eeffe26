"""Ranges of displacements and other linear quantities over the orbits of branches."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fecontact.analysis.histories import point_name
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.equilibria.equilibrium import find_equilibrium
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.orbits.orbit_points import orbit_points_of
from fecontact.bifurcation.tori.motion import torus_motion
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, choices, shown
from fecontact.core.types import Array, ArrayLike
from fecontact.reduction.modal_basis import Component
from fecontact.system.fields.vector_field import VectorField, require_field


def quantity_range(
    point: BranchPoint, row: ArrayLike, *, about: VectorField | None = None
) -> tuple[float, float]:
    """Smallest and largest value of a linear quantity ``row @ x`` over an orbit or equilibrium.

    Parameters
    ----------
    point : BranchPoint
        An orbit or equilibrium of a branch.
    row : (d,) sequence
        Row of the states, such as that of a displacement
        (:meth:`fecontact.bifurcation.ContactField.displacement_row`).
    about : VectorField, optional
        The field of the branch, for values relative to that of its equilibrium at the same
        parameters: of steady sliding for contact systems, else of the equilibrium that Newton's
        method finds from the middle of the orbit.

    Raises
    ------
    InputError
        If the row has another shape, or the field other parameters.
    AnalysisError
        If the field depends on time, or no equilibrium is found.
    """
    require_kind("quantity_range", BranchPoint, point=point)
    weights = as_floats(row, "row")
    states = next((len(point.values[name]) for name in ("minimum", "state")
                   if name in point.values), weights.size)
    if weights.shape != (states,) or not np.isfinite(weights).all():
        raise InputError(f"row = {shown(row)} must hold {states} finite numbers, one for each "
                         f"state.")
    low, high = _extremes(point, weights)
    if about is None:
        return low, high
    require_field(about)
    values = dict(zip(about.parameters, point.parameter_values(about).tolist(), strict=True))
    start = None
    if not isinstance(about, ContactField):
        start = (point.orbit(about).states[:-1].mean(axis=0) if point.is_orbit
                 else np.asarray(point.values["state"]))
    rest = float(weights @ find_equilibrium(about, values, start=start).state)
    return low - rest, high - rest


def _extremes(point: BranchPoint, weights: Array) -> tuple[float, float]:
    """The range of the quantity with so many weights."""
    if point.is_orbit:
        return orbit_points_of(point).range(point, weights)
    if point.is_torus:
        moved = torus_motion(point).grid(_ANGLES, _ANGLES) @ weights
        return float(moved.min()), float(moved.max())
    if "state" not in point.values:
        raise InputError(f"{point.place} stores no orbit, only its extremes: take 'minimum' "
                         f"and 'maximum' of the point.")
    value = float(weights @ np.asarray(point.values["state"]))
    return value, value


def amplitude(row: ArrayLike) -> Callable[[BranchPoint], float]:
    """Function of a branch point: (max - min) / 2 of ``row @ x``; zero at equilibria."""
    def of(point: BranchPoint) -> float:
        low, high = quantity_range(point, row)
        return (high - low) / 2.0

    return of


def amplitudes(branch: Branch, row: ArrayLike) -> Array:
    """Amplitude (N,) of ``row @ x`` at all points of a branch; see :func:`amplitude`."""
    return np.array([amplitude(row)(point) for point in branch.points])


# Samples of each angle of a torus, more than twice its harmonics at most.
_ANGLES = 401


def observe(
    field: ContactField, branch: Branch, point: str | int = "B", component: Component = "x"
) -> Branch:
    """Add the range of a displacement to each point of a branch.

    Adds 'observed_minimum', 'observed_maximum' and 'observed_amplitude' (half the range) [m], at
    an equilibrium or over one period. Orbits of excited systems also get 'observed_section' (n,),
    the values at the starts of the n excitation periods, as in
    :func:`fecontact.bifurcation.poincare_scan`.

    Parameters
    ----------
    field, branch : ContactField, Branch
        A branch of equilibria or orbits, by collocation or shooting, and its field.
    point, component
        'B', 'C', a named point or the number of a contact node; 'x', 'y' or 'phi', of
        solids also 'z', 'phi_x', 'phi_y', 'phi_z'.

    Raises
    ------
    InputError
        If there is no such point, or the branch is that of another field.
    """
    require_kind("observe", ContactField, field=field)
    require_kind("observe", Branch, branch=branch)
    _require_own(field, branch)
    row = field.displacement_row(point, component)
    points = []
    for one in branch.points:
        low, high, section = _range(field, branch, one, row)
        points.append(replace(one, values={
            **one.values, "observed_minimum": low, "observed_maximum": high,
            "observed_amplitude": (high - low) / 2.0, **section}))
    where = point_name(point, field.system().basis)
    unit = "rad" if component.startswith("phi") else "m"
    return replace(branch, points=tuple(points), attributes={
        **branch.attributes, "observed_label": f"displacement {component} of {where} [{unit}]"})


def _require_own(field: ContactField, branch: Branch) -> None:
    """Raise InputError if states or parameters show that a branch is that of another field."""
    known = branch.attributes
    states = len(known.get("state_names", field.state_names))
    names = [str(name) for name in known.get("parameter_names", field.parameters)]
    if states != field.dimension or not set(names) <= set(field.parameters):
        raise InputError(f"observe: the branch is that of another field, of {states} states and "
                         f"the parameters {choices(names)}, not of {field.dimension} and "
                         f"{choices(field.parameters)}; give the field of the branch.")


def _range(
    field: ContactField, branch: Branch, point: BranchPoint, row: Array
) -> tuple[float, float, dict[str, Array]]:
    if "period" not in point.values:
        return *quantity_range(point, row), {}
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    excited = field.forcing_period(values) is not None
    phases = np.arange(int(branch.attributes["periods"])) / int(branch.attributes["periods"])
    low, high, section = orbit_points_of(point).observed(point, field, row, phases)
    return low, high, {"observed_section": section} if excited else {}
