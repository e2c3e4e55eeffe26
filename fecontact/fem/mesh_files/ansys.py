"""Ansys archives (CDWRITE), read by mapdl-archive: plane and solid elements, components, materials.

Wedges, pyramids and tetrahedra are hexahedra there whose nodes repeat; middles of edges that were
dropped are 0, for straight edges.
"""

import re
import warnings
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, MeshError, ModelWarning, choices
from fecontact.core.extras import optional
from fecontact.core.types import Array, Integers
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial, Material
from fecontact.fem.mesh_files.ansys_loads import archive_loads, plane_states
from fecontact.fem.mesh_files.raw import RawMesh

# Numbers of element types.
_BRICKS = (45, 64, 95, 185, 186)
_TETRAHEDRA = (72, 73, 92, 187, 285)
_PLANE = (2, 42, 82, 182, 183)
# Meshes without stiffness, surfaces for loads and contact, which the study gives.
_WITHOUT_STIFFNESS = (152, 153, 154, 155, 156, 169, 170, 171, 172, 173, 174, 175, 176, 177, 178,
                      200)
# Distinct corners I J K L M N O P of a brick that repeats some, and the middles of their edges.
_SHAPES = {
    "hexahedron": (tuple(range(8)), tuple(range(8, 20))),
    "wedge": ((0, 1, 2, 4, 5, 6), (8, 9, 11, 12, 13, 15, 16, 17, 18)),
    "pyramid": ((0, 1, 2, 3, 4), (8, 9, 10, 11, 16, 17, 18, 19)),
    "tetra": ((0, 1, 2, 4), (8, 9, 11, 16, 17, 18)),
}
# The edges whose middles these are, by the corners of the cell.
_EDGES = {
    "hexahedron": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
                   (2, 6), (3, 7)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
}
_CORNERS = {"hexahedron": 8, "wedge": 6, "pyramid": 5, "tetra": 4, "triangle": 3, "quad": 4}
_BY_CORNERS = {8: "hexahedron", 6: "wedge", 5: "pyramid", 4: "tetra"}
_DAMPING = {"ALPD", "BETD", "DAMP", "DMPR", "DMPS"}
# Group of the cells with reduced integration, where others have full integration.
_REDUCED = "reduced integration"
# Corners of the faces 1, 2, ... of a brick, whose nodes may repeat, and of a tetrahedron.
_FACES = {8: ((1, 0, 3, 2), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)),
          4: ((1, 0, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3))}
# Commands of an archive that stiffen the model and are not read.
_REFUSED = {"CE": "constraint equations (CE)", "CP": "coupled degrees of freedom (CP)",
            "CPBLOCK": "coupled degrees of freedom (CPBLOCK)"}
_COMMAND = re.compile(r"^\s*([A-Za-z/*]+)\s*,", re.MULTILINE)
_DATA = re.compile(r"^\s*MPDATA\s*,\s*R5\.0\s*,\s*(\d+)\s*,\s*(\w+)\s*,\s*(\d+)\s*,\s*\d+\s*,"
                   r"\s*([^,\s]+)", re.MULTILINE | re.IGNORECASE)
_ONE = re.compile(r"^\s*MP\s*,\s*(\w+)\s*,\s*(\d+)\s*,\s*([-+.\dED]+)\s*,?\s*$",
                  re.MULTILINE | re.IGNORECASE)


def read_cdb(path: Path) -> RawMesh:
    """Nodes, plane and solid elements, components and materials of an archive.

    Components of elements become groups of cells, those of nodes groups of nodes; the materials
    are those of the groups 'material 1' and so on.

    Raises
    ------
    MissingLibraryError
        If mapdl-archive is not installed.
    MeshError
        For shells, beams and other elements that stiffen the mesh, or constraints between nodes.

    Warns
    -----
    ModelWarning
        For body loads, and for materials that are not read.
    """
    mapdl_archive = optional("mapdl_archive", "Reading Ansys archives")
    text = path.read_text(encoding="utf-8", errors="replace")
    commands = _counted(text)
    refused = [f"{commands[name]} {what}" for name, what in _REFUSED.items() if commands[name]]
    if refused:
        raise MeshError(f"The file holds {' and '.join(refused)}, which stiffen the mesh and are "
                        f"not read; remove them, or write the model as an Abaqus deck.")
    if "NBLOCK" not in commands or "EBLOCK" not in commands:
        raise MeshError("The file holds no NBLOCK or no EBLOCK; write the archive by CDWRITE, DB "
                        "with blocked nodes and elements.")
    if "1" in plane_states(text):
        raise MeshError("The file holds axisymmetric elements (KEYOPT 3 of 1); fecontact's bodies "
                        "are plane.")
    found = mapdl_archive.Archive(str(path), parse_vtk=False)
    _require_whole(text, found)
    elements = _Elements(found)
    acting = archive_loads(text)
    if acting.counts["BF"]:
        warnings.warn(f"{path}: the file holds {acting.counts['BF']} body loads (BF), which are "
                      f"not read; give temperatures in the study.", ModelWarning, stacklevel=4)
    raw = RawMesh(elements.points, elements.blocks(np.arange(elements.count)),
                  sets_are_boundaries=True)
    for name, numbers in found.node_components.items():
        raw.nodes[name.strip()] = elements.rows_of(np.asarray(numbers))
    for name, numbers in found.element_components.items():
        raw.parts[name.strip()] = elements.blocks(elements.of_numbers(np.asarray(numbers)))
    for name, sides in acting.sides.items():
        raw.faces[name] = elements.faces(sides)
    for node in {node for node, *_ in acting.forces}:
        raw.nodes[f"node {node}"] = elements.rows_of(np.array([node]))
    for name, held in acting.supports.items():
        raw.nodes[name] = elements.rows_of(np.array(held))
    materials, unread = _materials(text)
    for number in np.unique(elements.materials).tolist():
        name = f"material {number}"
        raw.cell_sets[name] = elements.blocks(np.flatnonzero(elements.materials == number))
        if number in materials:
            raw.materials[name] = materials[number]
    turned = any(isinstance(one, AnisotropicMaterial) for one in materials.values())
    if damped := sorted(_properties(text) & _DAMPING):
        warnings.warn(f"{path}: the materials of the file have {', '.join(damped)}, which are not "
                      f"read; give damping to the basis.", ModelWarning, stacklevel=4)
    if not unread and turned and elements.turned:
        unread = "the file gives axes of materials by coordinate systems of elements (ESYS)"
    if unread:
        warnings.warn(f"{path}: {unread}, so that no material of the file is taken; give material "
                      f"to the body.", ModelWarning, stacklevel=4)
        raw.materials = {}
    if elements.incompatible:
        raw.bricks = "incompatible"
    raw.integration = "reduced" if elements.reduced.all() else "full"
    if raw.integration == "full" and elements.reduced.any():
        raw.cell_sets[_REDUCED] = elements.blocks(np.flatnonzero(elements.reduced))
        raw.integration = {_REDUCED: "reduced"}
    return raw


def _counted(text: str) -> defaultdict[str, int]:
    found: defaultdict[str, int] = defaultdict(int)
    for match in _COMMAND.finditer(text):
        found[match[1].upper()] += 1
    return found


def _require_whole(text: str, found: Any) -> None:
    """MeshError where a block has fewer rows than its first line declares."""
    for block, held in (("NBLOCK", len(found.nnum)), ("EBLOCK", len(found.enum))):
        line = re.search(rf"^\s*{block}\s*,([^\n]*)", text, re.MULTILINE | re.IGNORECASE)
        numbers = [word.strip() for word in line[1].split(",")] if line else []
        declared = int(numbers[-1]) if numbers and numbers[-1].isdigit() else held
        if declared > held:
            raise MeshError(f"The file declares {declared} rows of {block}, but holds {held}; it "
                            f"is cut off or damaged, write it again whole.")


class _Elements:
    """Elements of an archive by their rows, and the nodes, with middles of edges that lack one."""

    def __init__(self, found: Any) -> None:
        self.points: Array = np.asarray(found.nodes, float)
        if not len(self.points) or not len(found.enum):
            raise MeshError("The file holds no nodes or no elements.")
        kinds = np.asarray(found.etype)
        other = sorted({*kinds.tolist()} - {*_BRICKS, *_TETRAHEDRA, *_PLANE, *_WITHOUT_STIFFNESS})
        if other:
            raise MeshError(f"The file holds elements of the types {choices(map(str, other))} "
                            f"(shells, beams, springs, masses or others), which stiffen the mesh "
                            f"and are not read; SOLID185, 186, 187, 285 and PLANE182, 183 are.")
        kept = np.flatnonzero(~np.isin(kinds, _WITHOUT_STIFFNESS))
        self._corners = {int(found.elem[place][8]): found.elem[place][10:][: 8 if kind in _BRICKS
                                                                           else 4]
                         for place, kind in zip(kept, kinds[kept], strict=True)
                         if kind in (*_BRICKS, *_TETRAHEDRA)}
        rows = [np.asarray(found.elem[place], np.int64) for place in kept]
        heads = np.array([row[:10] for row in rows]).reshape(-1, 10)
        self.numbers, self.materials, self.count = heads[:, 8], heads[:, 0], len(kept)
        self.turned = bool(heads[:, 4].any())
        types = np.stack([kinds[kept], heads[:, 1]], axis=1)
        distinct, which = np.unique(types, axis=0, return_inverse=True)
        options = [(kind, {key: _option(found, number, key) for key in (1, 2, 3, 11)})
                   for kind, number in distinct.tolist()]
        if any(kind in (185, 186) and of[3] == 1 for kind, of in options):
            raise MeshError("The file holds layered solids (KEYOPT 3 of SOLID185 or 186), which "
                            "are not read; mesh each layer with elements of its own.")
        self.reduced = np.array([_is_reduced(*one) for one in options])[which.ravel()]
        self.incompatible = any((kind == 185 and of[2] in (2, 3))
                                or (kind == 45 and of[1] == of[2] == 0) for kind, of in options)
        self._row = np.full(int(found.nnum.max()) + 1, -1, np.int64)
        self._row[found.nnum] = np.arange(len(found.nnum))
        # Kind of the cells, which elements they are, and their nodes.
        self._groups: list[tuple[str, Integers, Integers]] = []
        lengths = np.array([len(row) - 10 for row in rows])
        for kind, length in np.unique(np.stack([kinds[kept], lengths], axis=1), axis=0).tolist():
            which = np.flatnonzero((kinds[kept] == kind) & (lengths == length))
            self._add(kind, which, np.array([rows[place][10:] for place in which]))

    def rows_of(self, numbers: Integers) -> Integers:
        """Rows of nodes, of those that the file holds."""
        rows = self._row[numbers[numbers < len(self._row)]]
        return rows[rows >= 0]

    def of_numbers(self, numbers: Integers) -> Integers:
        """Rows of elements by their numbers."""
        return np.flatnonzero(np.isin(self.numbers, numbers))

    def blocks(self, rows: Integers) -> list[tuple[str, Integers]]:
        """The elements of some rows, by their kinds."""
        chosen = [(kind, cells[np.isin(which, rows)]) for kind, which, cells in self._groups]
        return [(kind, cells) for kind, cells in chosen if len(cells)]

    def faces(self, sides: list[tuple[int, int]]) -> list[Integers]:
        """Corners (k, 3) and (k, 4) of faces by the numbers of their elements and their own.

        Raises
        ------
        MeshError
            For faces that the elements do not have.
        """
        found: dict[int, list[Integers]] = {}
        for element, face in sides:
            corners = self._corners.get(element, ())
            places = _FACES.get(len(corners), ())
            held = [corners[k] for k in places[face - 1]] if 1 <= face <= len(places) else []
            nodes = self._row[list(dict.fromkeys(held))]
            if len(nodes) < 3:
                raise MeshError(f"SFE gives a pressure on face {face} of element {element}, which "
                                f"no solid element of the file has.")
            found.setdefault(len(nodes), []).append(nodes)
        return [np.array(rows) for rows in found.values()]

    def _add(self, kind: int, which: Integers, nodes: Integers) -> None:
        """Cells of elements (M,) of one type with nodes (M, n)."""
        corners = nodes[:, : 8 if kind in _BRICKS else 4]
        distinct = 1 + (np.diff(np.sort(corners, axis=1), axis=1) > 0).sum(axis=1)
        size = nodes.shape[1]
        for count in np.unique(distinct).tolist():
            if kind in _BRICKS:
                if count not in _BY_CORNERS:
                    raise MeshError(f"An element has {count} different corners; those of a brick, "
                                    f"wedge, pyramid or tetrahedron are 8, 6, 5 or 4.")
                shape = _BY_CORNERS[count]
                first, middles = (list(places) for places in _SHAPES[shape])
            else:
                shape = ("tetra" if kind in _TETRAHEDRA
                         else "triangle" if size in (3, 6) or count == 3 else "quad")
                first = list(range(_CORNERS[shape]))
                # Of a triangle as a square K and L are one node, and so is the middle of the two.
                middles = ([4, 5, 7] if shape == "triangle" and size in (4, 8)
                           else [len(first) + k for k in range(len(_EDGES[shape]))])
            here = distinct == count
            self._add_shape(shape, which[here], nodes[here][:, first], [
                nodes[here, place] if place < size else np.zeros(here.sum(), np.int64)
                for place in middles])

    def _add_shape(
        self, shape: str, which: Integers, corners: Integers, middles: list[Integers]
    ) -> None:
        ends, given = self._row[corners], np.stack(middles, axis=1)
        straight = ~given.any(axis=1)
        if straight.any():
            self._groups.append((shape, which[straight], ends[straight]))
        if straight.all():
            return
        ends, given = ends[~straight], given[~straight]
        found = self._row[given]
        for column, (a, b) in enumerate(_EDGES[shape]):
            lacking = given[:, column] == 0
            added = 0.5 * (self.points[ends[lacking, a]] + self.points[ends[lacking, b]])
            found[lacking, column] = len(self.points) + np.arange(len(added))
            self.points = np.concatenate([self.points, added])
        self._groups.append((f"{shape}{_CORNERS[shape] + len(_EDGES[shape])}", which[~straight],
                             np.concatenate([ends, found], axis=1)))


def _is_reduced(kind: int, options: dict[int, int]) -> bool:
    """True for a type of element whose key options give it reduced integration."""
    return ((kind == 186 and options[2] == 0) or (kind in (45, 185) and options[2] == 1)
            or kind in (82, 183) or (kind == 182 and options[1] == 1)
            or (kind == 95 and options[11] == 1))


def _option(found: Any, kind: int, key: int) -> int:
    """Key option of an element type; 0 by default."""
    return next((value for number, value in found.key_option.get(kind, ()) if number == key), 0)


def _properties(text: str) -> set[str]:
    """Names of the properties of materials of an archive."""
    return {name.upper() for _, name, *_ in _DATA.findall(text)} | {
        name.upper() for name, *_ in _ONE.findall(text)}


def _materials(text: str) -> tuple[dict[int, AnyMaterial], str]:
    """Materials by their numbers, in the units of the file, and why there are none."""
    known: dict[int, dict[str, float]] = {}
    several = set()
    for count, name, number, value in _DATA.findall(text):
        known.setdefault(int(number), {})[name.upper()] = float(value)
        if int(count) > 1:
            several.add(int(number))
    for name, number, value in _ONE.findall(text):
        known.setdefault(int(number), {})[name.upper()] = float(value)
    if several:
        return {}, f"the material {min(several)} depends on temperature"
    found: dict[int, AnyMaterial] = {}
    for number, values in known.items():
        if not {"EX", "DENS"} <= values.keys():
            continue
        try:
            found[number] = _material(values)
        except InputError as error:
            return {}, f"the material {number} is not admissible ({error})"
        except KeyError as error:
            return {}, f"the material {number} lacks {error}"
    return found, ""


def _material(values: dict[str, float]) -> AnyMaterial:
    """Isotropic, or orthotropic where there is a second modulus."""
    if "EY" not in values:
        return Material(values["EX"], values.get("PRXY", values.get("NUXY", 0.0)), values["DENS"],
                        thermal_expansion=values.get("ALPX", 0.0))
    moduli = [values[f"E{axis}"] for axis in "XYZ"]
    # Minor ratios, nu_yx / E_x = nu_xy / E_y, where major ones are not given.
    ratios = [values[f"PR{pair}"] if f"PR{pair}" in values
              else values.get(f"NU{pair}", 0.0) * moduli["XYZ".index(pair[0])]
              / moduli["XYZ".index(pair[1])] for pair in ("XY", "XZ", "YZ")]
    shear = [values[f"G{pair}"] for pair in ("XY", "XZ", "YZ")]
    return AnisotropicMaterial.orthotropic(tuple(moduli), tuple(ratios), tuple(shear),  # type: ignore[arg-type]
                                           values["DENS"])
