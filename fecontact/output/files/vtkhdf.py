"""The /VTKHDF group of a case: a temporal unstructured grid that ParaView opens."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.frames import (
    blocks,
    body_numbers,
    displacement,
    nodal_contact_force,
    require_field,
    von_mises,
)

_CELL_TYPE = {3: 5, 4: 9}  # VTK_TRIANGLE, VTK_QUAD
_POINT_DATA = (("displacement", 3, "m"), ("von_mises", 1, "Pa"), ("contact_force", 3, "N"))


def write_vtkhdf(file: Any, trajectory: Trajectory, indices: NDArray[np.intp]) -> None:
    """Write the body and its fields at the chosen output times into a new group /VTKHDF.

    Point data of each step are ``displacement`` (3 components) [m], ``von_mises`` [Pa] and
    ``contact_force`` (3 components) [N], the forces of the other side spread over the nodes of the
    contact faces, all in single precision. Points and cells are stored once; those of several
    bodies hold their number ``body``, counted from 0 as the names in its attribute.

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
    _write_steps(group.create_group("Steps"), trajectory.time[indices], nodes)

    parts = trajectory.system.basis.parts
    if parts:
        body = body_numbers(trajectory.system.basis)
        for kind, numbers in (("Point", body), ("Cell", body[field.cells[:, 0]])):
            group[f"{kind}Data/body"] = numbers
            group[f"{kind}Data/body"].attrs["names"] = [part.name for part in parts]
            group[f"Steps/{kind}DataOffsets/body"] = np.zeros(steps, dtype=np.int64)
    data = {}
    for name, components, unit in _POINT_DATA:
        shape = (steps * nodes, 3) if components == 3 else (steps * nodes,)
        data[name] = group.create_dataset(f"PointData/{name}", shape, dtype=np.float32)
        data[name].attrs["unit"] = unit
    row = 0
    for which in blocks(indices, nodes):
        q = trajectory.modal_coordinates[which]
        end = row + len(which) * nodes
        data["displacement"][row:end] = _three(displacement(field, q))
        data["von_mises"][row:end] = von_mises(field, q).astype(np.float32).reshape(-1)
        data["contact_force"][row:end] = _three(nodal_contact_force(trajectory, which))
        row = end


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


def _write_steps(group: Any, times: Array, nodes: int) -> None:
    """Write the offsets of each step: zero for the grid, consecutive for point data."""
    zeros = np.zeros(len(times), dtype=np.int64)
    group.attrs["NSteps"] = np.int64(len(times))
    group["Values"] = times
    group["Values"].attrs["unit"] = "s"
    group["NumberOfParts"] = zeros + 1
    for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
        group[name] = zeros
    for name, _, _ in _POINT_DATA:
        group[f"PointDataOffsets/{name}"] = np.arange(len(times), dtype=np.int64) * nodes


def _three(vectors: Array) -> NDArray[np.float32]:
    """Convert plane vectors (F, N, 2) to (F N, 3) in single precision."""
    out = np.zeros((vectors.shape[0] * vectors.shape[1], 3), dtype=np.float32)
    out[:, :2] = vectors.reshape(-1, 2)
    return out
