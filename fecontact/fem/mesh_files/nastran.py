"""Files of Nastran's bulk data: mesh, constraints, loads, supports and materials."""

from pathlib import Path

from fecontact.fem.mesh_files.nastran_bulk import BulkData
from fecontact.fem.mesh_files.nastran_constraints import add_constraints
from fecontact.fem.mesh_files.nastran_loads import add_load_groups
from fecontact.fem.mesh_files.nastran_materials import add_materials
from fecontact.fem.mesh_files.raw import RawMesh


def read_nastran(path: Path) -> RawMesh:
    """Contents of a file of bulk data, with groups by the numbers of properties.

    Raises
    ------
    MeshError, InputError
        For damaged files, and cards that are not read and stiffen the mesh.
    """
    bulk = BulkData(path)
    raw = bulk.raw()
    add_constraints(bulk, raw)
    add_load_groups(bulk, raw)
    add_materials(bulk, raw, path)
    return raw
