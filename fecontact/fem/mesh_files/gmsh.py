"""Gmsh meshes: reading of versions 2.2 and 4.1, text and binary, and writing of 4.1 as text.

Unlike meshio this reads files saved with all elements, several physical groups on one curve,
reversed curves, and groups of one name in two dimensions.
"""

import re
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import MeshError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import blocks_of, row_numbers
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files.raw import NODES, PLANE, RawMesh

_KINDS = {15: "vertex", 1: "line", 8: "line3", 2: "triangle", 9: "triangle6",
          3: "quad", 16: "quad8", 10: "quad9", 4: "tetra", 11: "tetra10", 5: "hexahedron",
          17: "hexahedron20", 12: "hexahedron27", 6: "wedge", 18: "wedge15",
          13: "wedge18", 7: "pyramid", 19: "pyramid13", 14: "pyramid14"}

# Elements of one kind with their physical groups (2.2: one or none, 4.1: those of the entity).
_Block = tuple[str, Integers, list[int]]


def read_msh(path: Path) -> RawMesh:
    """Nodes, elements and physical groups (those without a name by their number) of a Gmsh file.

    Raises
    ------
    MeshError
        If the file is not complete, or of another version.
    """
    sections = {match[1].decode(): match[2] for match in re.finditer(
        rb"^\$(\w+)[ \t\r]*\n(.*?)\$End\1", path.read_bytes(), re.DOTALL | re.MULTILINE)}
    missing = [name for name in ("MeshFormat", "Nodes", "Elements") if name not in sections]
    if missing:
        raise MeshError(f"The file has no complete section ${missing[0]}; save it again from Gmsh.")
    version, binary, size = sections["MeshFormat"].split()[:3]
    if version not in (b"2", b"2.2", b"4.1"):
        raise MeshError(f"The file is of Gmsh's mesh format {version.decode()}, but 2.2 and 4.1 "
                        f"are read; save it again as 4.1.")
    if binary == b"1" and b"\n\1\0\0\0" not in sections["MeshFormat"]:
        raise MeshError("The file is binary and comes from a machine of another byte order; save "
                        "it as text.")
    if "PartitionedEntities" in sections:
        raise MeshError("The mesh is partitioned; save it without partitions.")
    numbers = {name: _Numbers(sections[name], binary == b"1")
               for name in ("Entities", "Nodes", "Elements") if name in sections}
    if version == b"4.1":
        groups = _entity_groups(numbers["Entities"], int(size)) if "Entities" in numbers else {}
        tags, points = _nodes_41(numbers["Nodes"], int(size))
        blocks = _elements_41(numbers["Elements"], int(size), groups)
    else:
        tags, points = _nodes_22(numbers["Nodes"])
        blocks = _elements_22(numbers["Elements"])
    return _raw_mesh(tags, points, blocks, _names(sections.get("PhysicalNames", b"")))


class _Numbers:
    """Sequential reader of the numbers of a section."""

    def __init__(self, data: bytes, binary: bool) -> None:
        self.data: Any = data if binary else data.split()
        self.binary = binary
        self.at = 0

    def take(self, dtype: str, count: int) -> NDArray[Any]:
        if self.binary:
            values = np.frombuffer(self.data, dtype, count, self.at)
            self.at += values.nbytes
            return values
        words = self.data[self.at:self.at + count]
        if len(words) < count:
            raise MeshError("A section of the file is too short; save it again from Gmsh.")
        self.at += count
        try:
            return np.array(words, dtype="S").astype(dtype)
        except ValueError:
            raise MeshError("A section of the file holds words in place of numbers; save it again "
                            "from Gmsh.") from None

    def one(self, dtype: str) -> int:
        return int(self.take(dtype, 1)[0])


def _names(section: bytes) -> dict[tuple[int, int], str]:
    """Name of each physical group by dimension and number."""
    return {(int(match[1]), int(match[2])): match[3].decode(errors="replace")
            for match in re.finditer(rb'^\s*(\d+)\s+(\d+)\s+"(.*)"', section, re.MULTILINE)}


def _entity_groups(numbers: _Numbers, size: int) -> dict[tuple[int, int], list[int]]:
    """Physical groups of each entity, by its dimension and number."""
    groups = {}
    for dimension, count in enumerate(numbers.take(f"u{size}", 4)):
        for _ in range(count):
            tag = numbers.one("i4")
            numbers.take("f8", 6 if dimension else 3)
            physical = numbers.take("i4", numbers.one(f"u{size}"))
            groups[dimension, tag] = np.abs(physical).tolist()  # a minus sign reverses the entity
            if dimension:
                numbers.take("i4", numbers.one(f"u{size}"))
    return groups


def _nodes_41(numbers: _Numbers, size: int) -> tuple[Integers, Array]:
    tags, points = [], []
    for _ in range(numbers.take(f"u{size}", 4)[0]):
        dimension, _, parametric = numbers.take("i4", 3)
        count = numbers.one(f"u{size}")
        tags.append(numbers.take(f"u{size}", count).astype(np.int64))
        columns = 3 + (int(dimension) if parametric else 0)
        points.append(numbers.take("f8", columns * count).reshape(count, columns)[:, :3])
    return np.concatenate(tags), np.concatenate(points)


def _elements_41(
    numbers: _Numbers, size: int, groups: dict[tuple[int, int], list[int]]
) -> list[_Block]:
    blocks = []
    for _ in range(numbers.take(f"u{size}", 4)[0]):
        dimension, entity, code = (int(number) for number in numbers.take("i4", 3))
        count = numbers.one(f"u{size}")
        kind, nodes = _kind(code)
        rows = numbers.take(f"u{size}", count * (1 + nodes)).astype(np.int64)
        blocks.append((kind, rows.reshape(count, 1 + nodes)[:, 1:],
                       groups.get((dimension, entity), [])))
    return blocks


def _nodes_22(numbers: _Numbers) -> tuple[Integers, Array]:
    if numbers.binary:
        count, rest = numbers.data.split(b"\n", 1)
        rows = np.frombuffer(rest, [("tag", "i4"), ("xyz", "f8", 3)], int(count))
        return rows["tag"].astype(np.int64), rows["xyz"]
    table = numbers.take("f8", 4 * numbers.one("i8")).reshape(-1, 4)
    return table[:, 0].astype(np.int64), table[:, 1:]


def _elements_22(numbers: _Numbers) -> list[_Block]:
    rows: dict[tuple[str, int], list[Integers]] = {}
    if numbers.binary:
        count, numbers.data = numbers.data.split(b"\n", 1)
        left = int(count)
        while left > 0:
            code, following, tags = (int(number) for number in numbers.take("i4", 3))
            kind, nodes = _kind(code)
            table = numbers.take("i4", following * (1 + tags + nodes)).reshape(following, -1)
            physical = np.abs(table[:, 1]) if tags else np.zeros(following, np.int64)
            for group in np.unique(physical):
                rows.setdefault((kind, int(group)), []).append(
                    table[physical == group, 1 + tags:].astype(np.int64))
            left -= following
    else:
        for _ in range(numbers.one("i8")):
            _, code, tags = numbers.data[numbers.at:numbers.at + 3]
            kind, nodes = _kind(int(code))
            numbers.at += 3
            labels = numbers.take("i8", int(tags) + nodes)
            group = abs(int(labels[0])) if int(tags) else 0
            rows.setdefault((kind, group), []).append(labels[int(tags):][None])
    return [(kind, np.concatenate(parts), [group] if group else [])
            for (kind, group), parts in rows.items()]


def _kind(code: int) -> tuple[str, int]:
    if code in _KINDS:
        return _KINDS[code], NODES[_KINDS[code]]
    raise MeshError(f"The mesh holds elements of Gmsh's type {code}, which are not read; mesh with "
                    f"triangles, quadrilaterals, tetrahedra, hexahedra or wedges.")


def _raw_mesh(
    tags: Integers, points: Array, blocks: list[_Block],
    names: dict[tuple[int, int], str],
) -> RawMesh:
    order = np.argsort(tags, kind="stable")
    tags, points = tags[order], points[order]
    cells: list[tuple[str, Integers]] = []
    groups: tuple[dict[str, list[Integers]], dict[str, list[Integers]]] = ({}, {})
    bodies: dict[str, list[tuple[str, Integers]]] = {}
    for kind, block, physical in blocks:
        index = np.searchsorted(tags, block)
        if (tags[np.minimum(index, len(tags) - 1)] != block).any():
            raise MeshError("The elements name nodes that the file does not hold.")
        if kind not in ("vertex", "line", "line3"):
            cells.append((kind, index))
            dimension = 2 if kind in PLANE else 3
            for number in physical:
                bodies.setdefault(names.get((dimension, number), str(number)), []).append(
                    (kind, index))
            continue
        dimension = 0 if kind == "vertex" else 1
        for number in physical:
            name = names.get((dimension, number), str(number))
            groups[dimension].setdefault(name, []).append(index[:, :2])
    for (dimension, _), name in names.items():
        if dimension < 2:
            groups[dimension].setdefault(name, [np.empty((0, 1 + dimension), np.int64)])
    return RawMesh(
        points, cells,
        edges={name: np.concatenate(parts) for name, parts in groups[1].items()},
        nodes={name: np.concatenate(parts).ravel() for name, parts in groups[0].items()},
        parts=bodies,
    )


# Gmsh's types of elements by number of corners and dimension: of first order, serendipity elements
# and others of second order.
_CODES = {(2, 1): (1, 8, 8), (3, 2): (2, 9, 9), (4, 2): (3, 16, 10), (4, 3): (4, 11, 11),
          (5, 3): (7, 19, 14), (6, 3): (6, 18, 13), (8, 3): (5, 17, 12)}
# Edges of elements in the order of Gmsh's second-order nodes.
_EDGES = {
    (2, 1): ((0, 1),), (3, 2): ((0, 1), (1, 2), (2, 0)), (4, 2): ((0, 1), (1, 2), (2, 3), (3, 0)),
    (4, 3): ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)),
    (5, 3): ((0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 3), (2, 4), (3, 4)),
    (6, 3): ((0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)),
    (8, 3): ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6),
             (6, 7)),
}
# Four-sided faces in the order of the nodes in their middles.
_FACES = {
    (4, 2): ((0, 1, 2, 3),), (5, 3): ((0, 1, 2, 3),),
    (6, 3): ((0, 1, 4, 3), (0, 2, 5, 3), (1, 2, 5, 4)),
    (8, 3): ((0, 1, 2, 3), (0, 1, 5, 4), (0, 3, 7, 4), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)),
}


def write_msh(mesh: Mesh, stream: TextIO) -> None:
    """Write a mesh as Gmsh 4.1 text: groups are physical groups, all cells the group ``body``.

    Cells of the same groups stand together, in their order. Meshes with curved edges and those of
    serendipity elements are written with elements of second order.
    """
    group_names = sorted({*mesh.points, *mesh.boundaries})
    number = {name: k for k, name in enumerate(group_names, start=1)}
    vertices: dict[int, list[int]] = {}
    for name, nodes in mesh.points.items():
        for node in nodes.tolist():
            vertices.setdefault(node, []).append(number[name])
    sides: dict[tuple[int, ...], list[int]] = {}
    first: dict[tuple[int, ...], tuple[int, ...]] = {}
    for name, facets in mesh.boundaries.items():
        for facet in facets.tolist():
            key = tuple(sorted(facet))
            sides.setdefault(key, []).append(number[name])
            first.setdefault(key, key if len(facet) == 2 else tuple(facet))
    groups: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
    for key, owners in sides.items():
        groups.setdefault(tuple(owners), []).append(first[key])

    # All cells are one more group, unless a group has its name.
    bodies = {"body": np.arange(len(mesh.cells)), **mesh.cell_groups}
    member = np.zeros((len(mesh.cells), len(bodies)), bool)
    for column, held in enumerate(bodies.values()):
        member[held, column] = True
    owners_of, block = np.unique(member, axis=0, return_inverse=True)
    block = block.ravel()
    tags = [[int(column) + 1 for column in np.flatnonzero(row)] for row in owners_of]

    def lines(rows: list[Any]) -> None:
        stream.writelines(" ".join(map(repr, row)) + "\n" for row in rows)

    d = mesh.dimension
    names = [(0, number[name], name) for name in mesh.points]
    names += [(d - 1, number[name], name) for name in mesh.boundaries]
    names += [(d, tag, name) for tag, name in enumerate(bodies, start=1)]
    stream.write(f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{len(names)}\n")
    stream.writelines(f'{dimension} {tag} "{name}"\n' for dimension, tag, name in sorted(names))
    stream.write("$EndPhysicalNames\n$Entities\n")
    flat = [0.0] * (3 - d)
    box = [*mesh.nodes.min(axis=0).tolist(), *flat, *mesh.nodes.max(axis=0).tolist(), *flat]
    counts = [len(vertices), 0, 0, 0]
    counts[d - 1], counts[d] = len(groups), len(tags)
    lines([counts])
    lines([(tag, *mesh.nodes[node].tolist(), *flat, len(owners), *owners)
           for tag, (node, owners) in enumerate(vertices.items(), start=1)])
    lines([(tag, *box, len(owners), *owners, 0) for tag, owners in enumerate(groups, start=1)])
    lines([(entity, *box, len(owned), *owned, 0) for entity, owned in enumerate(tags, start=1)])
    places = _places(mesh)
    count = len(places)
    stream.write(f"$EndEntities\n$Nodes\n1 {count} 1 {count}\n{d} 1 0 {count}\n")
    lines([(tag,) for tag in range(1, count + 1)])
    lines([(*place, *flat) for place in places.tolist()])

    blocks: list[tuple[int, int, int, list[Any]]] = [
        (0, tag, 15, [(node,)]) for tag, node in enumerate(vertices, start=1)]
    blocks += [(d - 1, tag, *_elements(mesh, some, d - 1))
               for tag, rows in enumerate(groups.values(), start=1)
               for _, some in blocks_of(np.array(rows))]
    blocks += [(d, entity + 1, *_elements(mesh, one.nodes[chosen], d, one.numbers[chosen]))
               for entity in range(len(tags)) for one in mesh.blocks
               if (chosen := block[one.numbers] == entity).any()]
    total = sum(len(rows) for *_, rows in blocks)
    stream.write(f"$EndNodes\n$Elements\n{len(blocks)} {total} 1 {total}\n")
    tag = 0
    for dimension, entity, code, rows in blocks:
        lines([(dimension, entity, code, len(rows))])
        lines([(tag + k, *(node + 1 for node in row)) for k, row in enumerate(rows, start=1)])
        tag += len(rows)
    stream.write("$EndElements\n")


def _order(mesh: Mesh) -> int:
    """0 for elements of first order, 1 for serendipity elements, 2 for others of second order."""
    if mesh.bricks == "serendipity":
        return 1
    return 2 if len(mesh.curved_edges) else 0


def _places(mesh: Mesh) -> Array:
    """Nodes of elements of that order."""
    if _order(mesh) == 2:
        return mesh._second_order.places
    return np.concatenate([mesh.nodes, mesh.edge_middles]) if _order(mesh) else mesh.nodes


def _elements(
    mesh: Mesh, corners: Integers, dimension: int, numbers: Integers | None = None
) -> tuple[int, list[Any]]:
    """Gmsh's type and rows of nodes of elements (k, n); ``numbers`` (k,) are those of cells."""
    key, order = (corners.shape[1], dimension), _order(mesh)
    if not order:
        return _CODES[key][0], corners.tolist()
    ends = np.sort(corners[:, np.array(_EDGES[key])], axis=2)
    known, count = mesh.edges[0], len(mesh.nodes)
    keys = known[:, 0] * count + known[:, 1]
    rows = [corners, count + np.searchsorted(keys, ends[..., 0] * count + ends[..., 1])]
    if order == 2 and mesh.dimension == 3 and key in _FACES:
        faces, sides = mesh._second_order.faces, corners[:, np.array(_FACES[key])]
        found = row_numbers(faces, np.sort(sides.reshape(-1, 4), axis=1))
        rows.append(count + len(known) + found.reshape(len(corners), -1))
    if order == 2 and numbers is not None:
        which = next(k for k, one in enumerate(mesh.blocks) if one.nodes.shape[1] == key[0])
        if mesh.blocks[which].kind.has_centre:
            chosen = np.searchsorted(mesh.blocks[which].numbers, numbers)
            rows.append(mesh._second_order.members[which][chosen, -1:])
    return _CODES[key][order], np.concatenate(rows, axis=1).tolist()
