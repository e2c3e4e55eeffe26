"""The /VTKHDF group of a case: a temporal unstructured grid that ParaView opens."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.frames import (
    blocks,
    body_numbers,
    cell_stress,
    contact_owners,
    displacement,
    nodal_contact_force,
    nodal_contact_states,
    require_field,
    von_mises,
)

_CELL_TYPE = {3: 5, 4: 9}  # VTK_TRIANGLE, VTK_QUAD
_VECTOR = ("x", "y", "z")


@dataclass(frozen=True)
class _Field:
    """A field of each step: components as VTK orders and ParaView names them, and the unit."""

    name: str
    of: str  # Point or Cell
    components: tuple[str, ...]
    unit: str
    kind: Any = np.float32


_FIELDS = (
    _Field("displacement", "Point", _VECTOR, "m"),
    _Field("velocity", "Point", _VECTOR, "m/s"),
    _Field("von_mises", "Point", (), "Pa"),
    _Field("contact_force", "Point", _VECTOR, "N"),
    _Field("contact_state", "Point", (), "-1 no contact node, 0 open, 1 stick, 2 slip", np.int8),
    _Field("stress", "Cell", ("xx", "yy", "zz", "xy", "yz", "xz"), "Pa"),
)


def write_vtkhdf(file: Any, trajectory: Trajectory, indices: NDArray[np.intp]) -> None:
    """Write the body and its fields at the chosen output times into a new group /VTKHDF.

    Point data of each step are ``displacement`` [m] and ``velocity`` [m/s] (3 components),
    ``von_mises`` [Pa], ``contact_force`` (3 components) [N], the forces of the other side spread
    over the nodes of the contact faces, and ``contact_state`` there: 0 open, 1 stick, 2 slip, and
    -1 at all other nodes. Cell data are the means of ``stress`` over each cell [Pa], as xx, yy, zz,
    xy, yz, xz. All are in single precision but the states. The attributes ``unit`` and
    ``component_names`` of each are for readers of HDF5: the format has no place for them. Points
    and cells are stored once; those of several bodies hold their number ``body``, counted from 0 as
    the names in its attribute.

    Parameters
    ----------
    file : h5py.File or Group
        Parent of the new group.
    trajectory : Trajectory
        Its modal basis must hold shapes over the body.
    indices : (F,) integer array
        Indices of the output times.

    Raises
    ------
    InputError
        If the modal basis holds no shapes over the body.
    """
    field = require_field(trajectory)
    nodes, steps = len(field.nodes), len(indices)
    group = file.create_group("VTKHDF")
    group.attrs["Version"] = np.array([2, 0], dtype=np.int64)
    group.attrs["Type"] = np.bytes_("UnstructuredGrid")
    _write_grid(group, field.nodes, field.cells)
    sizes = {"Point": nodes, "Cell": len(field.cells)}
    _write_steps(group.create_group("Steps"), trajectory.time[indices], sizes)

    parts = trajectory.system.basis.parts
    if parts:
        body = body_numbers(trajectory.system.basis)
        for kind, numbers in (("Point", body), ("Cell", body[field.cells[:, 0]])):
            group[f"{kind}Data/body"] = numbers
            group[f"{kind}Data/body"].attrs["names"] = [part.name for part in parts]
            group[f"Steps/{kind}DataOffsets/body"] = np.zeros(steps, dtype=np.int64)
    data = {}
    for one in _FIELDS:
        shape = (steps * sizes[one.of], *([len(one.components)] if one.components else []))
        data[one.name] = group.create_dataset(f"{one.of}Data/{one.name}", shape, dtype=one.kind)
        data[one.name].attrs["unit"] = one.unit
        if one.components:
            data[one.name].attrs["component_names"] = list(one.components)
    owners = contact_owners(field, trajectory.system.basis.contact_nodes)
    first = 0
    for which in blocks(indices, nodes):
        q, rate = (values[which] for values in (trajectory.modal_coordinates,
                                                trajectory.modal_velocities))
        found: dict[str, NDArray[Any]] = {
            "displacement": displacement(field, q), "velocity": displacement(field, rate),
            "von_mises": von_mises(field, q),
            "contact_force": nodal_contact_force(trajectory, which),
            "contact_state": nodal_contact_states(trajectory, which, owners),
            "stress": cell_stress(field, q)}
        for one in _FIELDS:
            rows = slice(first * sizes[one.of], (first + len(which)) * sizes[one.of])
            data[one.name][rows] = _flat(found[one.name], one)
        first += len(which)


def _write_grid(group: Any, nodes: Array, cells: Integers) -> None:
    count, corners = cells.shape
    points = np.zeros((len(nodes), 3))
    points[:, :2] = nodes
    group["Points"] = points
    group["Points"].attrs["unit"] = "m"
    group["Connectivity"] = cells.astype(np.int64).reshape(-1)
    group["Offsets"] = np.arange(count + 1, dtype=np.int64) * corners
    group["Types"] = np.full(count, _CELL_TYPE[corners], dtype=np.uint8)
    group["NumberOfPoints"] = np.array([len(nodes)], dtype=np.int64)
    group["NumberOfCells"] = np.array([count], dtype=np.int64)
    group["NumberOfConnectivityIds"] = np.array([cells.size], dtype=np.int64)


def _write_steps(group: Any, times: Array, sizes: dict[str, int]) -> None:
    """Write the offsets of each step: zero for the grid, consecutive for its data."""
    zeros = np.zeros(len(times), dtype=np.int64)
    group.attrs["NSteps"] = np.int64(len(times))
    group["Values"] = times
    group["Values"].attrs["unit"] = "s"
    group["NumberOfParts"] = zeros + 1
    for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
        group[name] = zeros
    for one in _FIELDS:
        group[f"{one.of}DataOffsets/{one.name}"] = (
            np.arange(len(times), dtype=np.int64) * sizes[one.of])


def _flat(values: NDArray[Any], one: _Field) -> NDArray[Any]:
    """Values (F, N) or (F, N, k) as rows of VTK, components that a plane lacks zero."""
    if not one.components:
        return values.reshape(-1).astype(one.kind)
    out = np.zeros((values.shape[0] * values.shape[1], len(one.components)), dtype=one.kind)
    out[:, : values.shape[2]] = values.reshape(-1, values.shape[2])
    return out
