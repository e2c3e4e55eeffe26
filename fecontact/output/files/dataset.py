"""A run as named arrays with dimensions and units, for other programs."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import MissingLibraryError
from fecontact.integrate.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray

_NODES = {
    "normal_force": "N", "friction_force": "N", "penetration": "m", "slip_velocity": "m/s",
    "line_load": "N/m", "friction_work": "J", "contact_state": "0 open, 1 stick, 2 slip",
}
# Where the name alone does not tell the sign.
_TITLES = {"friction_force": "friction force on the body in -x"}
_AXES = ("x", "y", "phi")


@dataclass(frozen=True, eq=False)
class Variable:
    """An array, its dimensions and its unit.

    Attributes
    ----------
    dims : tuple of str
        Names of dimensions: time, point, component, node, mode.
    values : array
    unit : str
    """

    dims: tuple[str, ...]
    values: NDArray[Any]
    unit: str


def coordinates(trajectory: Trajectory) -> dict[str, Variable]:
    """Coordinates of the dimensions: time, names of points, axes, nodes, modes."""
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    basis = trajectory.system.basis
    return {
        "time": Variable(("time",), trajectory.time, "s"),
        "point": Variable(("point",), np.array(_points(trajectory)), "1"),
        "component": Variable(("component",), np.array(_AXES), "1"),
        "node": Variable(("node",), np.arange(basis.contact_nodes), "1"),
        "node_x": Variable(("node",), basis.contact_x, "m"),
        "node_length": Variable(("node",), basis.tributary, "m"),
        "mode": Variable(("mode",), np.arange(basis.modes), "1"),
        "mode_frequency": Variable(("mode",), basis.frequencies_hz, "Hz"),
    }


def variables(trajectory: Trajectory) -> dict[str, Variable]:
    """Stored and derived quantities of a run.

    Displacements and velocities [x, y, phi] of B, C, other named points and the contact nodes,
    forces and states of the contact nodes, their pressures if the basis has a thickness, energies,
    modal coordinates.
    """
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    basis, q, rate = (trajectory.system.basis, trajectory.modal_coordinates,
                      trajectory.modal_velocities)
    points = [basis.point_index(name) for name in _points(trajectory)]
    nodes = slice(2, 2 + basis.contact_nodes)
    found = {}
    for name, modal, unit in (("displacement", q, "m, m, rad"),
                              ("velocity", rate, "m/s, m/s, rad/s")):
        for what, rows, dim in (("", basis.T[points], "point"), ("node_", basis.T[nodes], "node")):
            found[what + name] = Variable(("time", dim, "component"), np.einsum(
                "pam,tm->tpa", rows, modal), unit)
    for name, unit in _NODES.items():
        found[name] = Variable(("time", "node"), getattr(trajectory, name), unit)
    if basis.thickness is not None:
        found["pressure"] = Variable(("time", "node"), trajectory.pressure, "Pa")
    energies = trajectory.energies
    for name in energies.__dataclass_fields__:
        found[f"energy_{name}"] = Variable(("time",), getattr(energies, name), "J")
    found["modal_coordinates"] = Variable(("time", "mode"), q, "kg^0.5 m")
    found["modal_velocities"] = Variable(("time", "mode"), rate, "kg^0.5 m/s")
    return found


def columns(trajectory: Trajectory) -> dict[str, NDArray[Any]]:
    """All variables as single columns (N,) with headers, ``B displacement x [m]``.

    Modal coordinates are omitted: they have no meaning without the modes.
    """
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    names = {key: [str(value) for value in variable.values]
             for key, variable in coordinates(trajectory).items()}
    found: dict[str, NDArray[Any]] = {"time [s]": trajectory.time}
    for name, variable in variables(trajectory).items():
        title = _TITLES.get(name, name.removeprefix("node_").replace("_", " "))
        if "mode" in variable.dims:
            continue
        if variable.dims == ("time",):
            found[f"{title} [{variable.unit}]"] = variable.values
            continue
        units = variable.unit.split(", ") if "component" in variable.dims else [variable.unit]
        dim = variable.dims[1]
        for place, label in enumerate(names[dim]):
            owner = label if dim == "point" else f"node {label}"
            for component, unit in enumerate(units):
                ending = f" {_AXES[component]}" if "component" in variable.dims else ""
                values = variable.values[:, place]
                found[f"{owner} {title}{ending} [{unit}]"] = (
                    values[:, component] if values.ndim > 1 else values)
    return found


def to_xarray(trajectory: Trajectory) -> "xarray.Dataset":
    """A run as an :class:`xarray.Dataset`, with coordinates and an attribute ``units`` each.

    Dimensions are time, point, component, node and mode: ``ds.displacement.sel(point="B",
    component="x")``.

    Raises
    ------
    MissingLibraryError
        If xarray is not installed.
    """
    try:
        from xarray import DataArray, Dataset
    except ImportError:
        raise MissingLibraryError("xarray is not installed; install it with pip install "
                                  "'fecontact[xarray]'.") from None

    def array(name: str, variable: Variable) -> Any:
        named = {"long_name": _TITLES[name]} if name in _TITLES else {}
        return DataArray(variable.values, dims=variable.dims,
                         attrs={"units": variable.unit, **named})

    return Dataset(
        {name: array(name, variable) for name, variable in variables(trajectory).items()},
        coords={name: array(name, variable) for name, variable in coordinates(trajectory).items()},
        attrs={"title": "fecontact run", "status": trajectory.status.value})


def _points(trajectory: Trajectory) -> list[str]:
    """Names of the points that the body has."""
    basis = trajectory.system.basis
    return [name for name in ("B", "C", *basis.extra) if basis.T[basis.point_index(name)].any()]
