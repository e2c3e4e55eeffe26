"""MED files (Salome, Code_Aster): one mesh and its groups of nodes and elements.

Unlike meshio this reads files in which a family has no group, or a kind of element no families.
"""

from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.files.hdf5_check import open_hdf5
from fecontact.core.files.stored import member, values
from fecontact.core.types import Integers
from fecontact.fem.mesh_files.raw import RawMesh

_KINDS = {"PO1": "vertex", "SE2": "line", "SE3": "line3", "TR3": "triangle", "TR6": "triangle6",
          "QU4": "quad", "QU8": "quad8", "QU9": "quad9", "TE4": "tetra", "T10": "tetra10",
          "HE8": "hexahedron", "H20": "hexahedron20", "H27": "hexahedron27", "PE6": "wedge",
          "P15": "wedge15", "PY5": "pyramid", "P13": "pyramid13"}


def read_med(path: Path) -> RawMesh:
    """Nodes, elements and groups of a MED file.

    Raises
    ------
    MeshError
        If the file is not HDF5, holds no mesh, several meshes or several time steps.
    """
    try:
        file = open_hdf5(path)
    except OSError:
        raise MeshError("The file is not HDF5, or is damaged.") from None
    with file:
        if "ENS_MAA" not in file or not len(file["ENS_MAA"]):
            raise MeshError("The file is HDF5, but holds no MED mesh.")
        if len(file["ENS_MAA"]) > 1:
            raise MeshError(f"The file holds {len(file['ENS_MAA'])} meshes; save one alone.")
        name, mesh = next(iter(file["ENS_MAA"].items()))
        step = mesh
        if "NOE" not in mesh:
            if len(mesh) != 1:
                raise MeshError(f"The mesh holds {len(mesh)} time steps; save one alone.")
            step = next(iter(mesh.values()))
        families = file.get(f"FAS/{name}", {})
        return _raw_mesh(step, int(mesh.attrs["ESP"]), _families(families, "NOEUD"),
                         _families(families, "ELEME"))


def _families(families: Any, support: str) -> dict[int, list[str]]:
    """Names of the groups that each family belongs to, by the number of the family."""
    groups = {}
    for family in families.get(support, {}).values():
        rows = values(member(family, "GRO/NOM")) if "GRO" in family else []
        groups[int(family.attrs["NUM"])] = [
            np.asarray(row, np.int8).tobytes().split(b"\0")[0].decode(errors="replace").strip()
            for row in rows
        ]
    return groups


def _raw_mesh(step: Any, dimension: int, of_nodes: dict[int, list[str]],
              of_cells: dict[int, list[str]]) -> RawMesh:
    points = values(member(step, "NOE/COO")).reshape(dimension, -1).T
    nodes: dict[str, list[Integers]] = {}
    edges: dict[str, list[Integers]] = {}
    cells: list[tuple[str, Integers]] = []
    parts: dict[str, list[tuple[str, Integers]]] = {}

    def collect(into: dict[str, list[Integers]], names: dict[int, list[str]], stored: Any,
                members: Integers) -> None:
        if "FAM" not in stored:
            return
        family = values(stored["FAM"])
        for number in np.unique(family):
            for name in names.get(int(number), []):
                into.setdefault(name, []).append(members[family == number])

    collect(nodes, of_nodes, step["NOE"], np.arange(len(points)))
    for code, stored in step["MAI"].items():
        kind = _KINDS.get(code, "solid")
        if kind == "solid" and code.startswith(("TR", "QU", "PO")):
            raise MeshError(f"The mesh holds elements {code}, which are not read; mesh with "
                            f"triangles, quadrilaterals, tetrahedra or hexahedra.")
        number = int(stored["NOD"].attrs["NBR"])
        members = values(stored["NOD"]).reshape(-1, number).T.astype(np.int64) - 1
        if kind == "vertex":
            collect(nodes, of_cells, stored, members[:, 0])
        elif kind.startswith("line"):
            collect(edges, of_cells, stored, members[:, :2])
        else:
            cells.append((kind, members))
            found: dict[str, list[Integers]] = {}
            collect(found, of_cells, stored, members)
            for name, rows in found.items():
                parts.setdefault(name, []).append((kind, np.concatenate(rows)))
    return RawMesh(
        points, cells,
        edges={name: np.concatenate(rows) for name, rows in edges.items()},
        nodes={name: np.concatenate(rows) for name, rows in nodes.items()},
        sets_are_boundaries=True,
        parts=parts,
    )
