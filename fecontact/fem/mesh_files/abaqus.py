"""Abaqus input files: parts with plane or solid elements, their sets and surfaces.

Unlike meshio this reads plane-strain and reduced-integration elements, several blocks of nodes,
sets named on *ELEMENT, and surfaces.
"""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fecontact.core.checks import whole_number
from fecontact.core.errors import MeshError, ModelWarning, shown
from fecontact.core.types import Integers
from fecontact.fem.mesh_files.raw import NODES, PLANE, SOLID, RawMesh

_PLANE = re.compile(r"(?:C(?:PS|PE|PEG|GPE)|DC2D|AC2D|M3D|R3D|SFM3D|STRI|S)(\d)")
_PLANE_KINDS = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
_LINE = re.compile(r"(?:T[23]D|R2D)([23])|B[23]([123])")
_LINE_KINDS = {("2", None): "line", ("3", None): "line3",
               (None, "1"): "line", (None, "2"): "line3", (None, "3"): "line"}
_SOLID = re.compile(r"(?:C3D|DC3D|AC3D|SC)(\d+)")
_SOLID_KINDS = {4: "tetra", 10: "tetra10", 8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}
# Corners of the faces S1, S2, ...
_FACES = {4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
          8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))}

# Numbers, ranges of numbers (GENERATE) and names of other sets.
Members = list[int | range | str]

_ENCLOSED = ("PART", "INSTANCE", "ASSEMBLY")  # each closed by *END PART and so on
_WITH_DATA = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")


def read_inp(path: Path) -> RawMesh:
    """Nodes, elements, node sets, sets of line elements and element surfaces of an Abaqus file.

    Raises
    ------
    MeshError
        If the file is cut off, holds a displaced part, or names nodes, elements or sets that it
        does not hold.

    Warns
    -----
    ModelWarning
        If the file ends with elements and some nodes belong to none of them.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    part = _Part()
    parts = {"": part}
    in_part: dict[str | None, str] = {}
    keyword = ""
    for keyword, options, rows in _blocks(text):
        match keyword:
            case "NODE":
                part.add_nodes(options, rows)
            case "ELEMENT":
                part.add_elements(options, rows)
            case "NSET":
                one = parts.get(in_part.get(options.get("INSTANCE"), "no instance"), part)
                one.add_set(one.node_sets, options["NSET"], options, rows)
            case "ELSET":
                one = parts.get(in_part.get(options.get("INSTANCE"), "no instance"), part)
                one.add_set(one.element_sets, options["ELSET"], options, rows)
            case "SURFACE" if options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
                for one in parts.values() if part.in_assembly else (part,):
                    one.add_surface(options["NAME"], rows, len(parts) > 2)
            case "SYSTEM" if rows:
                raise MeshError("The file gives nodes in a local coordinate system (*SYSTEM); "
                                "export them in the global one.")
            case "PART":
                part = parts[options["NAME"]] = _Part()
            case "ASSEMBLY":
                for one in parts.values():
                    one.in_assembly = True
            case "INSTANCE" if any(float(word or 0) for row in rows for word in row):
                raise MeshError("The file displaces its part in *INSTANCE; export the part itself.")
            case "INSTANCE":
                in_part[options.get("NAME")] = options.get("PART", "")
            case "INCLUDE":
                raise MeshError("The file includes another one (*INCLUDE), which is not read; put "
                                "everything into one file.")
    found = {name: one for name, one in parts.items() if one.nodes and one.elements}
    if not found:
        raise MeshError("The file holds no *NODE or no *ELEMENT data.")
    _require_end(text)
    joined = _joined({name: one.raw_mesh() for name, one in found.items()})
    if keyword == "ELEMENT" and (unused := part.unused_nodes):
        warnings.warn(f"{path}: the file ends with *ELEMENT data, and {unused} of "
                      f"{len(part.nodes)} nodes belong to no element; if the file is cut off, "
                      f"elements are missing.", ModelWarning, stacklevel=4)
    return joined


def _require_end(text: str) -> None:
    """Refuse a file that ends within data, within a part, or before the data of a keyword."""
    lines = [line.strip() for line in text.splitlines()]
    if not text.endswith("\n") and lines[-1] and not lines[-1].startswith("*"):
        raise MeshError(f"The last line, {shown(lines[-1])}, has no line break, so the file may be "
                        f"cut off; end it with a line break if it is complete.")
    lines = [line for line in lines if line and not line.startswith("**")]
    keywords = [line[1:].partition(",")[0].strip().upper() for line in lines if line[0] == "*"]
    for name in _ENCLOSED:
        if keywords.count(name) > keywords.count(f"END {name}"):
            raise MeshError(f"The file has a line *{name} without a line *END {name}, so it may be "
                            f"cut off; add the line if the file is complete.")
    nodes_of_elements = keywords[-1] == "NSET" and "ELSET" in lines[-1].upper()
    if lines[-1].startswith("*") and keywords[-1] in _WITH_DATA and not nodes_of_elements:
        raise MeshError(f"The file ends with the line {shown(lines[-1])} without its data, so it "
                        f"may be cut off; remove the line if the file is complete.")


def _joined(parts: dict[str, RawMesh]) -> RawMesh:
    """Several parts, each with its own numbers, in one mesh with equally named groups joined."""
    if len(parts) == 1:
        return next(iter(parts.values()))
    joined = RawMesh(np.concatenate([raw.points for raw in parts.values()]), [],
                     sets_are_boundaries=True, separate=True)
    first = 0
    for name, raw in parts.items():
        cells = [(kind, block + first) for kind, block in raw.cells]
        joined.cells += cells
        joined.parts[name] = cells
        for groups, all_groups in ((raw.edges, joined.edges), (raw.nodes, joined.nodes)):
            for title, group in groups.items():
                earlier = [all_groups[title]] if title in all_groups else []
                all_groups[title] = np.concatenate([*earlier, group + first])
        for title, blocks in raw.faces.items():
            joined.faces.setdefault(title, []).extend(block + first for block in blocks)
        first += len(raw.points)
    return joined


def _blocks(text: str) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Keyword, options and rows of data of each keyword block."""
    keyword = ""
    options: dict[str, str] = {}
    rows: list[list[str]] = []
    joined = re.sub(r"^(\*[^*\n].*,)[ \t\r]*\n(?!\*)", r"\1", text, flags=re.MULTILINE)
    for line in joined.splitlines():
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if not line.startswith("*"):
            rows.append([word.strip() for word in line.split(",")])
            continue
        yield keyword, options, rows
        words = [word.strip() for word in line[1:].split(",")]
        keyword, rows = words[0].upper(), []
        pairs = [word.partition("=") for word in words[1:]]
        options = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
    yield keyword, options, rows


@dataclass
class _Part:
    """The part as read so far; sets hold Abaqus' numbers and names of other sets."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    node_sets: dict[str, Members] = field(default_factory=dict)
    element_sets: dict[str, Members] = field(default_factory=dict)
    surfaces: dict[str, list[list[str]]] = field(default_factory=dict)
    # Numbers of the elements that are not read (masses, springs, wedges), and of their nodes.
    other_elements: set[int] = field(default_factory=set)
    other_nodes: set[int] = field(default_factory=set)
    in_assembly: bool = False

    @property
    def unused_nodes(self) -> int:
        """Number of nodes that belong to no element."""
        used = {node for _, nodes in self.elements.values() for node in nodes}
        return len(self.nodes.keys() - used - self.other_nodes)

    def add_nodes(self, options: dict[str, str], rows: list[list[str]]) -> None:
        if self.in_assembly:
            return  # reference points have their own numbering
        if options.get("SYSTEM", "R").upper() != "R":
            raise MeshError("The file gives nodes in cylindrical or spherical coordinates; export "
                            "Cartesian ones.")
        for row in rows:
            x, y, z = ([float(word or 0) for word in row[1:4]] + [0.0, 0.0])[:3]
            self.nodes[int(row[0])] = [x, y, z]
        if "NSET" in options:
            self.node_sets.setdefault(options["NSET"], []).extend(int(row[0]) for row in rows)

    def add_elements(self, options: dict[str, str], rows: list[list[str]]) -> None:
        kind = _kind(options["TYPE"].upper())
        if self.in_assembly:
            return
        if kind in (None, "solid"):
            self.other_elements.update(int(row[0]) for row in rows)
            self.other_nodes.update(number for row in rows for word in row[1:]
                                    if (number := whole_number(word)) is not None)
        if kind is None:
            return
        if kind == "solid":
            self.elements[0] = kind, []
            return
        count = 1 + NODES[kind]
        numbers = [int(word) for row in rows for word in row if word]
        if len(numbers) % count:
            raise MeshError(f"The file has elements {options['TYPE']} of another number of nodes "
                            f"than {count - 1}.")
        for at in range(0, len(numbers), count):
            self.elements[numbers[at]] = kind, numbers[at + 1:at + count]
        if "ELSET" in options:
            self.element_sets.setdefault(options["ELSET"], []).extend(numbers[::count])

    def add_set(
        self, sets: dict[str, Members], name: str, options: dict[str, str],
        rows: list[list[str]],
    ) -> None:
        if self.in_assembly and "INSTANCE" not in options:
            return  # reference points
        members = sets.setdefault(name, [])
        if sets is self.node_sets and "ELSET" in options:
            for element in self.resolve(self.element_sets, options["ELSET"]):
                members.extend(self.elements[element][1] if element in self.elements else [])
        for row in rows:
            words = [word for word in row if word]
            if "GENERATE" in options:
                first, last, *step = (int(word) for word in words)
                members.append(range(first, last + 1, *step))
            else:
                for word in words:
                    number = whole_number(word)
                    members.append(word if number is None else number)

    def add_surface(self, name: str, rows: list[list[str]], several: bool) -> None:
        """Add rows ``set or element, side``; of several parts, only sets that this one has."""
        known = {title.upper() for title in self.element_sets}
        self.surfaces.setdefault(name, []).extend(
            row for row in rows if not (several and self.in_assembly) or row[0].upper() in known)

    def resolve(self, sets: dict[str, Members], name: str) -> list[int]:
        """The numbers in a set; names in it refer to sets defined before."""
        by_name = {key.upper(): key for key in sets}
        pending: Members = [name]
        seen: set[str] = set()
        numbers: list[int] = []
        while pending:
            member = pending.pop()
            if isinstance(member, int):
                numbers.append(member)
            elif isinstance(member, range):
                numbers.extend(member)
            elif member.upper() not in by_name:
                raise MeshError(f"The file refers to a set '{member}' that it does not hold.")
            elif member.upper() not in seen:
                seen.add(member.upper())
                pending.extend(sets[by_name[member.upper()]])
        return numbers

    def require_members(self) -> None:
        """Refuse sets and surfaces that name nodes or elements which the file does not hold."""
        elements = self.elements.keys() | self.other_elements
        surfaces = {name: [number for row in rows if (number := whole_number(row[0])) is not None]
                    for name, rows in self.surfaces.items()}
        for title, one, groups, known in (
                ("node set", "node", self.node_sets, self.nodes.keys()),
                ("element set", "element", self.element_sets, elements),
                ("surface", "element", surfaces, elements)):
            for name, members in groups.items():
                for member in members:
                    ends = ((member,) if isinstance(member, int) else
                            (member[0], member[-1]) if isinstance(member, range) and member else ())
                    for number in ends:
                        if number not in known:
                            raise MeshError(
                                f"The {title} '{name}' names {one} {number}, which the file does "
                                f"not hold; the file may be cut off, save it again whole.")

    def surface(self, rows: list[list[str]]) -> list[list[int]]:
        """Edges or faces (Abaqus' node numbers) of ``set or element, S1`` rows."""
        sides = []
        for name, side, *_ in (row for row in rows if len(row) > 1):
            if not re.fullmatch(r"[SE][1-6]", side.upper()):
                continue
            given = whole_number(name)
            numbers = self.resolve(self.element_sets, name) if given is None else [given]
            for number in numbers:
                if number not in self.elements:
                    continue
                kind, nodes = self.elements[number]
                which = int(side[1]) - 1
                if kind in SOLID and which < len(_FACES[SOLID[kind]]):
                    sides.append([nodes[corner] for corner in _FACES[SOLID[kind]][which]])
                elif kind in PLANE and which < PLANE[kind]:
                    sides.append([nodes[which], nodes[(which + 1) % PLANE[kind]]])
        return sides

    def raw_mesh(self) -> RawMesh:
        index = {number: k for k, number in enumerate(self.nodes)}
        if not all(index.keys() >= set(nodes) for _, nodes in self.elements.values()):
            raise MeshError("The elements name nodes that the file does not hold.")
        self.require_members()
        blocks: dict[str, list[list[int]]] = {}
        for kind, nodes in self.elements.values():
            if not kind.startswith("line"):
                blocks.setdefault(kind, []).append([index[number] for number in nodes])
        parts: dict[str, list[tuple[str, Integers]]] = {}
        for name in self.element_sets:
            held: dict[str, list[list[int]]] = {}
            for number in self.resolve(self.element_sets, name):
                kind, nodes = self.elements.get(number, ("line", []))
                if not kind.startswith(("line", "solid")):
                    held.setdefault(kind, []).append([index[node] for node in nodes])
            if held:
                parts[name] = [(kind, np.array(rows)) for kind, rows in held.items()]
        surfaces = {name: self.surface(rows) for name, rows in self.surfaces.items()}
        edges = {name: found for name, sides in surfaces.items()
                 if (found := [side for side in sides if len(side) == 2])}
        faces = {name: [np.array([[index[node] for node in side] for side in found])
                        for count in (3, 4)
                        if (found := [side for side in sides if len(side) == count])]
                 for name, sides in surfaces.items()}
        for name in self.element_sets:
            found = [self.elements[number][1][:2]
                     for number in self.resolve(self.element_sets, name)
                     if number in self.elements and self.elements[number][0].startswith("line")]
            if found:
                edges.setdefault(name, found)
        return RawMesh(
            np.array(list(self.nodes.values())),
            [(kind, np.array(rows)) for kind, rows in blocks.items()],
            edges={name: np.array([[index[first], index[second]] for first, second in pairs])
                   for name, pairs in edges.items()},
            nodes={name: np.array([index[number]
                                   for number in self.resolve(self.node_sets, name)
                                   if number in index], np.int64)
                   for name in self.node_sets},
            sets_are_boundaries=True,
            faces={name: blocks for name, blocks in faces.items() if blocks},
            parts=parts,
        )


def _kind(name: str) -> str | None:
    """Kind of an element type; None for masses, springs, rigid links and the like."""
    if name == "CAX4P":
        return "quad"  # meshio writes every quadrilateral under this name
    if name.startswith(("CAX", "CGAX", "DCAX", "SAX", "MAX")):
        raise MeshError(f"The file holds axisymmetric elements ({name}); fecontact's bodies are "
                        f"plane.")
    if match := _SOLID.match(name):
        return _SOLID_KINDS.get(int(match[1]), "solid")
    if match := _LINE.match(name):
        return _LINE_KINDS[match[1], match[2]]
    if match := _PLANE.match(name):
        if name.startswith("STRI6"):
            return "triangle6"
        return _PLANE_KINDS.get(int(match[1]))
    return None
