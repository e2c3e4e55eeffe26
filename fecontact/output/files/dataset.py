"""A run as named arrays with dimensions and units, for other programs."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import MissingLibraryError
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.frames import contact_forces
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies
from fecontact.reduction.modal_basis import ModalBasis

if TYPE_CHECKING:
    import pandas
    import xarray

_NODES = {
    "normal_force": "N", "friction_force": "N", "penetration": "m", "slip_velocity": "m/s",
    "line_load": "N/m", "friction_work": "J", "contact_state": "0 open, 1 stick, 2 slip",
}
# Of solids, where friction and slip have two directions and forces are those on areas.
_NODES_IN_SPACE = {
    "normal_force": "N", "friction_forces": "N", "penetration": "m", "slip_velocities": "m/s",
    "pressure": "Pa", "friction_work": "J", "contact_state": "0 open, 1 stick, 2 slip",
}
# Titles of quantities whose name does not define the sign.
_TITLES = {"friction_force": "friction force on the body in -x"}
# Between several bodies they act along the tangents of the contact nodes.
_TITLES_OF_SEVERAL = {"friction_force": "friction force on the body in -t"}
_TITLES_IN_SPACE = {"friction_forces": "friction force on the body in -",
                    "slip_velocities": "slip velocity "}
_RELATIVE = {2: ("t", "n", "phi"), 3: ("t", "t2", "n", "phi_t", "phi_t2", "phi_n")}
_TANGENTS = ("t", "t2")


@dataclass(frozen=True, eq=False)
class Variable:
    """An array, its dimensions and its unit.

    Attributes
    ----------
    dims : tuple of str
        Names of dimensions: time, point, component, node, mode; of several bodies also direction,
        of solids tangent.
    values : array
    unit : str
    """

    dims: tuple[str, ...]
    values: NDArray[Any]
    unit: str


def coordinates(trajectory: Trajectory) -> dict[str, Variable]:
    """Coordinates of the dimensions: time, names of points, axes, nodes, modes.

    Of several bodies also the interface, place along it and directions of each node, and the body
    of each mode. ``direction`` is along tangent t and normal n, which points out of the other side.
    Of solids ``tangent``, t and t2 (x and y on the ground), and areas of the nodes.
    """
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    basis = trajectory.basis
    found = {
        "time": Variable(("time",), trajectory.time, "s"),
        "point": Variable(("point",), np.array(_points(trajectory)), "1"),
        "component": Variable(("component",), np.array(basis.components), "1"),
        "node": Variable(("node",), np.arange(basis.contact_nodes), "1"),
        "node_x": Variable(("node",), basis.contact_x, "m"),
        **_sizes(basis),
        "mode": Variable(("mode",), np.arange(basis.modes), "1"),
        "mode_frequency": Variable(("mode",), basis.frequencies_hz, "Hz"),
    }
    if not len(found["point"].values):
        # The classic netCDF format takes a dimension of length zero for one that grows.
        del found["point"]
    if not several_bodies(basis):
        return found
    faces, normals = contact_faces(basis), basis.normals
    found |= {
        "direction": Variable(("direction",), np.array(_RELATIVE[basis.dimension]), "1"),
        "node_y": Variable(("node",), basis.positions[2 : 2 + basis.contact_nodes, 1], "m"),
        "node_interface": Variable(("node",), np.array(
            [face.name for face in faces for _ in face.abscissa]), "1"),
        "node_position": Variable(("node",), np.concatenate([face.abscissa for face in faces]),
                                  "m"),
        **{f"node_normal_{axis}": Variable(("node",), values, "1")
           for axis, values in zip("xyz", normals.T, strict=False)},
    }
    if basis.dimension == 3:
        del found["node_position"]  # of which there are two on a face
    owners = [part.name for part in basis.parts for _ in range(part.modes[1])]
    if len(owners) == basis.modes:  # modes of linked bodies have none
        found["mode_body"] = Variable(("mode",), np.array(owners), "1")
    return found


def _sizes(basis: ModalBasis) -> dict[str, Variable]:
    """Lengths of the contact nodes; of solids their places across, areas, and tangents."""
    if basis.dimension == 2:
        return {"node_length": Variable(("node",), basis.tributary, "m")}
    tangents = _TANGENTS if several_bodies(basis) else ("x", "y")
    return {"node_y": Variable(("node",), basis.contact_places[:, 1], "m"),
            "node_z": Variable(("node",), basis.contact_places[:, 2], "m"),
            "node_area": Variable(("node",), basis.contact_areas, "m^2"),
            "tangent": Variable(("tangent",), np.array(tangents), "1")}


def variables(trajectory: Trajectory) -> dict[str, Variable]:
    """Stored and derived quantities of a run.

    Displacements and velocities [x, y, phi] of B, C, other named points and the contact nodes,
    forces and states of the contact nodes, their pressures if the basis has a thickness, energies,
    modal coordinates. Contact nodes of several bodies move relative to the other side, [t, n, phi];
    ``contact_force`` is what acts on the body of the node along x and y, reversed on the other one.
    Of solids friction forces and slip velocities have two components, along the tangents.
    """
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    basis, q, rate = (trajectory.basis, trajectory.modal_coordinates,
                      trajectory.modal_velocities)
    points = [basis.point_index(name) for name in _points(trajectory)]
    nodes, several = slice(2, 2 + basis.contact_nodes), several_bodies(basis)
    node, axes = ("node_relative_", "direction") if several else ("node_", "component")
    found = {}
    d = basis.dimension
    metres, radians = ["m"] * d, ["rad"] * (2 * d - 3)
    for name, modal, unit in (("displacement", q, ", ".join(metres + radians)),
                              ("velocity", rate, ", ".join(f"{one}/s" for one in
                                                           metres + radians))):
        for what, rows, dim, last in (("", basis.T[points], "point", "component"),
                                      (node, basis.T[nodes], "node", axes)):
            if not len(rows):
                continue
            found[what + name] = Variable(("time", dim, last), np.einsum(
                "pam,tm->tpa", rows, modal), unit)
    if several:
        for axis, values in zip("xyz", np.moveaxis(contact_forces(trajectory), 2, 0),
                                strict=False):
            found[f"contact_force_{axis}"] = Variable(("time", "node"), values, "N")
    for name, unit in (_NODES if d == 2 else _NODES_IN_SPACE).items():
        values = getattr(trajectory, name)
        found[name] = Variable(("time", "node", *(["tangent"] * (values.ndim - 2))), values, unit)
    if basis.thickness is not None:
        found["pressure"] = Variable(("time", "node"), trajectory.pressure, "Pa")
    for name, values in trajectory.energies.terms.items():
        found[f"energy_{name}"] = Variable(("time",), values, "J")
    found["modal_coordinates"] = Variable(("time", "mode"), q, "kg^0.5 m")
    found["modal_velocities"] = Variable(("time", "mode"), rate, "kg^0.5 m/s")
    return found


def columns(trajectory: Trajectory) -> dict[str, NDArray[Any]]:
    """All variables as single columns (N,) with headers, ``B displacement x [m]``.

    Modal coordinates are omitted: they have no meaning without the modes.
    """
    require_kind("A table of a run", Trajectory, trajectory=trajectory)
    several = several_bodies(trajectory.basis)
    names = {key: [str(value) for value in variable.values]
             for key, variable in coordinates(trajectory).items()}
    titles = _titles(trajectory)
    found: dict[str, NDArray[Any]] = {"time [s]": trajectory.time}
    for name, variable in variables(trajectory).items():
        title = titles.get(name, name.removeprefix("node_").replace("_", " "))
        if "mode" in variable.dims:
            continue
        if variable.dims == ("time",):
            found[f"{title} [{variable.unit}]"] = variable.values
            continue
        axes = names[variable.dims[2]] if len(variable.dims) == 3 else []
        units = variable.unit.split(", ") if axes else [variable.unit]
        units *= len(axes) if len(units) < len(axes) else 1
        dim = variable.dims[1]
        for place, label in enumerate(names[dim]):
            owner = label if dim == "point" else f"node {label}"
            if several and dim == "node":
                owner = f"{names['node_interface'][place]}: {owner}"
            for component, unit in enumerate(units):
                ending = "" if not axes else axes[component] if title.endswith(("-", " ")) else (
                    f" {axes[component]}")
                values = variable.values[:, place]
                found[f"{owner} {title}{ending} [{unit}]"] = (
                    values[:, component] if values.ndim > 1 else values)
    return found


def to_xarray(trajectory: Trajectory) -> "xarray.Dataset":
    """A run as an :class:`xarray.Dataset`, with coordinates and an attribute ``units`` each.

    Dimensions are time, point, component, node and mode, with several bodies also direction, of
    solids also tangent:
    ``ds.displacement.sel(point="B", component="x")``.

    Raises
    ------
    MissingLibraryError
        If xarray is not installed.
    """
    require_kind("to_xarray", Trajectory, trajectory=trajectory)
    try:
        from xarray import DataArray, Dataset
    except ImportError:
        raise MissingLibraryError("xarray is not installed; install it with pip install "
                                  "'fecontact[xarray]'.") from None

    titles = _titles(trajectory)

    def array(name: str, variable: Variable) -> Any:
        named = {"long_name": titles[name].rstrip("- ")} if name in titles else {}
        return DataArray(variable.values, dims=variable.dims,
                         attrs={"units": variable.unit, **named})

    return Dataset(
        {name: array(name, variable) for name, variable in variables(trajectory).items()},
        coords={name: array(name, variable) for name, variable in coordinates(trajectory).items()},
        attrs={"title": "fecontact run", "status": trajectory.status.value})


def to_pandas(trajectory: Trajectory) -> "pandas.DataFrame":
    """A run as a :class:`pandas.DataFrame`, one row per output time.

    The index is ``time [s]``; columns are those of :func:`fecontact.io.export_csv`, such as
    ``B displacement x [m]`` and ``node 3 normal force [N]``. Modal coordinates are omitted.

    Raises
    ------
    MissingLibraryError
        If pandas is not installed.
    """
    require_kind("to_pandas", Trajectory, trajectory=trajectory)
    try:
        from pandas import DataFrame
    except ImportError:
        raise MissingLibraryError("pandas is not installed; install it with pip install "
                                  "'fecontact[pandas]'.") from None

    return DataFrame(columns(trajectory)).set_index("time [s]")


def _titles(trajectory: Trajectory) -> dict[str, str]:
    if trajectory.basis.dimension == 3:
        return _TITLES_IN_SPACE
    return _TITLES_OF_SEVERAL if several_bodies(trajectory.basis) else _TITLES


def _points(trajectory: Trajectory) -> list[str]:
    """Names of the points that the body has."""
    basis = trajectory.basis
    return [name for name in ("B", "C", *basis.extra) if basis.T[basis.point_index(name)].any()]
