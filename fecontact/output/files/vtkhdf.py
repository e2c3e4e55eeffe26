"""The /VTKHDF group of a case: a temporal unstructured grid that ParaView opens."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.fields_of_frames import FrameFields
from fecontact.output.files.frames import blocks, body_numbers, require_field
from fecontact.output.files.hdf5 import COMPRESSED, store_compressed
from fecontact.output.files.vtk_cells import cells_of_vtk

_CHUNK = 2**14  # fewest values of a compressed chunk


def write_vtkhdf(file: Any, trajectory: Trajectory, indices: NDArray[np.intp]) -> None:
    """Write the body and its fields at the chosen output times into a new group /VTKHDF.

    Point data of each step are ``displacement`` [m] and ``velocity`` [m/s] (3 components),
    ``von_mises`` [Pa], ``contact_force`` (3 components) [N], the forces of the other side spread
    over the nodes of the contact faces, and ``contact_state`` there: 0 open, 1 stick, 2 slip, and
    -1 at all other nodes. Cell data are the means of ``stress`` over each cell [Pa], as xx, yy, zz,
    xy, yz, xz. Of solids the nodes of contact faces have ``contact_pressure`` [Pa], and cells with
    a facet there ``contact_pressure``, ``contact_traction`` (3 components) [Pa], what acts on their
    body, and ``contact_state``; all are zero and -1 elsewhere. All are in single precision but the
    states; motion and stresses are rounded to 16 significant bits, 1.6e-5 of each value. All
    are compressed (byte shuffle and deflate). The attributes ``unit`` and ``component_names`` of
    each are for readers of HDF5: the format has no place for them. Points and cells are stored
    once; those of several bodies hold their number ``body``, counted from 0 as the names in its
    attribute.

    Parameters
    ----------
    file : h5py.File or Group
        Parent of the new group.
    trajectory : Trajectory
        Run whose modal basis holds shapes over the body.
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
    fields = FrameFields(trajectory)
    _write_grid(group, field.nodes, fields.cells)
    _write_steps(group.create_group("Steps"), trajectory.time[indices], fields)

    parts = trajectory.basis.parts
    if parts:
        body = body_numbers(trajectory.basis)
        for kind, numbers in (("Point", body), ("Cell", body[fields.cells[:, 0]])):
            group[f"{kind}Data/body"] = numbers
            group[f"{kind}Data/body"].attrs["names"] = [part.name for part in parts]
            group[f"Steps/{kind}DataOffsets/body"] = np.zeros(steps, dtype=np.int64)
    data = {}
    for one in fields.kinds:
        size = fields.sizes[one.of]
        shape = (steps * size, *([len(one.components)] if one.components else []))
        data[one] = group.create_dataset(
            f"{one.of}Data/{one.name}", shape, dtype=one.kind,
            chunks=(min(max(size, _CHUNK), shape[0]), *(1 for _ in shape[1:])), **COMPRESSED)
        data[one].attrs["unit"] = one.unit
        if one.components:
            data[one].attrs["component_names"] = list(one.components)
    first = 0
    for which in blocks(indices, nodes):
        found = fields.at(which)
        for one in fields.kinds:
            size = fields.sizes[one.of]
            data[one][first * size : (first + len(which)) * size] = one.flat(
                found[one.of, one.name])
        first += len(which)


def _write_grid(group: Any, nodes: Array, cells: Integers) -> None:
    connectivity, offsets, types = cells_of_vtk(cells, nodes.shape[1])
    points = np.zeros((len(nodes), 3))
    points[:, : nodes.shape[1]] = nodes
    store_compressed(group, "Points", points)
    group["Points"].attrs["unit"] = "m"
    store_compressed(group, "Connectivity", connectivity)
    store_compressed(group, "Offsets", offsets)
    store_compressed(group, "Types", types)
    group["NumberOfPoints"] = np.array([len(nodes)], dtype=np.int64)
    group["NumberOfCells"] = np.array([len(cells)], dtype=np.int64)
    group["NumberOfConnectivityIds"] = np.array([connectivity.size], dtype=np.int64)


def _write_steps(group: Any, times: Array, fields: FrameFields) -> None:
    """Write the offsets of each step: zero for the grid, consecutive for its data."""
    zeros = np.zeros(len(times), dtype=np.int64)
    group.attrs["NSteps"] = np.int64(len(times))
    group["Values"] = times
    group["Values"].attrs["unit"] = "s"
    group["NumberOfParts"] = zeros + 1
    for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
        group[name] = zeros
    for one in fields.kinds:
        group[f"{one.of}DataOffsets/{one.name}"] = (
            np.arange(len(times), dtype=np.int64) * fields.sizes[one.of])
