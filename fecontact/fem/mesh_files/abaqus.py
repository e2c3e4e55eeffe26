"""Abaqus input files: parts and instances with plane or solid elements, their sets and surfaces.

Unlike meshio this reads plane-strain and reduced-integration elements, several blocks of nodes,
sets named on *ELEMENT, surfaces, local coordinate systems, displaced instances and included files.
"""

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import whole_number
from fecontact.core.errors import (
    FecontactError,
    InputError,
    MeshError,
    ModelWarning,
    choices,
    nearest,
    shown,
)
from fecontact.core.types import Array, Integers
from fecontact.fem.constraints import Constraint, LinearEquation
from fecontact.fem.elements.quadrature import Integration
from fecontact.fem.material import AnisotropicMaterial, AnyMaterial
from fecontact.fem.mesh_files.abaqus_attachments import (
    TYPES,
    PointElement,
    attachments_of,
    is_point_element,
    refused,
)
from fecontact.fem.mesh_files.abaqus_constraints import (
    READ,
    Block,
    Names,
    constraints_of,
    sections_of,
)
from fecontact.fem.mesh_files.abaqus_keywords import Deck, Options, as_number
from fecontact.fem.mesh_files.abaqus_loads import LOADS, add_loads, groups_of_nodes
from fecontact.fem.mesh_files.abaqus_materials import Given, material, orientation
from fecontact.fem.mesh_files.abaqus_temperatures import is_temperature, temperature_of
from fecontact.fem.mesh_files.coordinates import cartesian
from fecontact.fem.mesh_files.distributed_loads import DistributedLoads
from fecontact.fem.mesh_files.raw import CORNERS, NODES, PLANE, SOLID, RawMesh

_PLANE = re.compile(r"(?:C(?:PS|PE|PEG|GPE)|DC2D|AC2D|M3D|R3D|SFM3D|STRI|S)(\d)")
_PLANE_KINDS = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
_LINE = re.compile(r"(?:T[23]D|R2D)([23])|B[23]([123])")
_LINE_KINDS = {("2", None): "line", ("3", None): "line3",
               (None, "1"): "line", (None, "2"): "line3", (None, "3"): "line"}
_SOLID = re.compile(r"(?:C3D|DC3D|AC3D|SC)(\d+)")
_SOLID_KINDS = {4: "tetra", 10: "tetra10", 5: "pyramid", 13: "pyramid13", 6: "wedge", 15: "wedge15",
                8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}
# Corners of the faces S1, S2, ...
_FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    5: ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    6: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))}

# Keywords that join or stiffen bodies, and stop the reading.
_UNREAD = ("DISTRIBUTING COUPLING", "SHELL TO SOLID COUPLING", "EMBEDDED ELEMENT",
           "FASTENER", "CONNECTOR SECTION", "JOINT", "USER ELEMENT", "SUBSTRUCTURE PROPERTY",
           "MATRIX ASSEMBLE")
# Keywords that change stiffness, mass or shape of bodies, and are left out with a warning.
_LEFT_OUT = ("FOUNDATION", "NONSTRUCTURAL MASS", "MASS ADJUST", "MODEL CHANGE", "IMPERFECTION")
_TRUSSES = ("T2D", "T3D")
# Sections of elements that bend or stretch outside of the solids that they are joined to.
_STRUCTURAL = ("SHELL SECTION", "SHELL GENERAL SECTION", "MEMBRANE SECTION", "BEAM SECTION",
               "BEAM GENERAL SECTION", "FRAME SECTION")
# Letters behind the number of nodes of solid elements.
# Types with a full and a reduced rule of quadrature, and those that have the reduced one.
_REDUCIBLE = re.compile(r"C3D(?:8|20)|C(?:PS|PE|PEG|GPE)[48]")
_REDUCED = re.compile(rf"(?:{_REDUCIBLE.pattern})[HMPT]*R")
_VARIANT = re.compile(r"[EHIMPRSTV]*(?:OF|CO)?$")
_GENERATING = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY")
_KINDS = {"NSET": "nodes", "ELSET": "elements"}
_PARALLEL = 1e-9  # sine of the angle between directions that span no plane


@dataclass(frozen=True)
class _NodesOf:
    """The nodes of the elements in a set."""

    elements: "Members"


_T = TypeVar("_T")
# Numbers, and ranges of numbers (GENERATE).
Members = list[Integers | range | _NodesOf]


@dataclass
class _Sets:
    """Sets, and surfaces of (set, number of the side), by name."""

    nodes: dict[str, Members] = field(default_factory=dict)
    elements: dict[str, Members] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[Members, int]]] = field(default_factory=dict)

    def of(self, kind: str) -> dict[str, Members]:
        return self.nodes if kind == "nodes" else self.elements

    def copy(self) -> "_Sets":
        return _Sets({name: [*members] for name, members in self.nodes.items()},
                     {name: [*members] for name, members in self.elements.items()},
                     {name: [*rows] for name, rows in self.surfaces.items()})


def read_inp(path: Path) -> RawMesh:
    """Nodes, elements, node sets, sets of line elements and element surfaces of an Abaqus file.

    Raises
    ------
    MeshError
        If the file is cut off, includes a missing file or itself, makes its mesh by keywords such
        as *NGEN, or names nodes, elements, sets, parts or instances that it does not hold.

    Warns
    -----
    ModelWarning
        If the file ends with elements and some nodes belong to none of them, or holds springs,
        masses or constraints of kinds that are not read.
    """
    deck, assembly = Deck(path), _Assembly()
    try:
        for keyword, options, lines in deck.blocks():
            with _named(keyword, lines):
                assembly.add(keyword, options, lines)
    except MeshError:
        if deck.is_read:  # a cut file explains why its last block is wrong
            deck.require_end()
        raise
    if deck.keywords["NODE"]:
        deck.require_end()
    bodies = assembly.bodies()
    if not bodies:
        raise MeshError("The file holds no *NODE or no *ELEMENT data.")
    joining = [f"{deck.keywords[name]} *{name}" for name in _UNREAD if deck.keywords[name]]
    if joining:
        raise MeshError(f"The file holds {', '.join(joining)}, which join or stiffen bodies and "
                        f"are not read; delete them in a copy of the file, and give ties, "
                        f"couplings or links in their place.")
    for body in bodies:
        for found, what, last in (
                (body.numbered.moved_nodes, "node", "at another place"),
                (body.numbered.replaced_elements, "element", "with its own line")):
            if len(found):
                of = f" of '{body.name}'" if body.name else ""
                more = f", as are {len(found) - 1} others" if len(found) > 1 else ""
                warnings.warn(f"{path}: {what} {found[0]}{of} is given a second time, {last}{more};"
                              f" the last one counts.", ModelWarning, stacklevel=4)
    assembly.name_sections_apart(bodies)
    integration = _integration(bodies)
    joined, unread, without = _constrained(assembly, bodies)
    count = sum(len(body.numbered.places) for body in bodies)
    unused = sum(body.part.unused_nodes for body in bodies) if deck.ends_with_elements else 0
    if unused:
        cut = deck.ends_with_elements[0]
        name = "" if cut == path.name else f" {cut}"
        warnings.warn(f"{path}: the file{name} ends with *ELEMENT data, and {unused} of "
                      f"{count} nodes belong to no element; if the file is cut off, "
                      f"elements are missing.", ModelWarning, stacklevel=4)
    if unread:
        warnings.warn(f"{path}: the file holds {', '.join(unread)}, which are not read; the mesh "
                      f"has none of their stiffness or mass, so give supports, links and welds "
                      f"beside it.", ModelWarning, stacklevel=4)
    left_out = [f"{deck.keywords[name]} *{name}" for name in _LEFT_OUT if deck.keywords[name]]
    left_out += [f"{number} {what}" for what, number in assembly.left_out.items()]
    if left_out:
        warnings.warn(f"{path}: the file holds {', '.join(left_out)}, which act on bodies and are "
                      f"not read; results are those without them.", ModelWarning, stacklevel=4)
    if without:
        warnings.warn(f"{path}: the file holds {without}, which is not read, so that no "
                      f"temperature of the file is taken; give it beside the mesh.", ModelWarning,
                      stacklevel=4)
    if any("C3D8I" in name for body in bodies for name in body.part.element_types):
        joined.bricks = "incompatible"
    joined.integration = integration
    joined.materials, unread = assembly.section_materials(bodies)
    for one in unread:
        warnings.warn(f"{path}: {one}, so that no material of the file is taken; give material to "
                      f"the body.", ModelWarning, stacklevel=4)
    return joined


def local_axes(path: Path) -> Callable[[str], Array]:
    """Function that gives the local axes (k, 3, 3), by rows, of the k nodes of a set or of a node.

    They are those of ``*TRANSFORM``, or else those of the coordinates.

    Raises
    ------
    MeshError
        As in :func:`read_inp`.
    """
    raw = read_inp(path)
    groups = {name.upper(): nodes for name, nodes in raw.nodes.items()}

    def axes_of(word: str) -> Array:
        # Sets of an instance alone are without its name.
        names = (word.upper(), f"NODE {word}", word.upper().rpartition(".")[2])
        nodes = next((groups[name] for name in names if name in groups), np.empty(0, np.int64))
        found = [raw.axes.get(node, np.eye(3)) for node in nodes.tolist()]
        return np.array(found).reshape(-1, 3, 3)

    return axes_of


def _integration(bodies: list["_Instance"]) -> Integration | dict[str, Integration]:
    """Rules of quadrature of the types of elements.

    Where some quadrilaterals or hexahedra have a reduced rule and others have not, those of each
    such type become a set of elements.
    """
    types = {name for body in bodies for name in body.part.element_types
             if _REDUCIBLE.match(name)}
    reduced = {name for name in types if _REDUCED.match(name)}
    if reduced in (set(), types):
        return "reduced" if reduced else "full"
    for name in reduced:
        for body in bodies:
            if name in body.part.element_types:
                body.sets.elements[name] = list(body.part.element_types[name])
    return dict.fromkeys(sorted(reduced), "reduced")


def _constrained(
    assembly: "_Assembly", bodies: list["_Instance"]
) -> tuple[RawMesh, list[str], str]:
    """Mesh with constraints, attachments and temperatures, and keywords of these not read.

    Nodes of reference points, which belong to no body, follow those of the bodies.
    """
    parts = {body.title or body.name: body.raw_mesh() for body in bodies}
    joined = _joined(parts)
    if not assembly.constraints and not assembly.attachments and not assembly.temperatures:
        return joined, [], ""
    owners = [*bodies, *assembly.reference_points()]
    places = [*(raw.points for raw in parts.values()),
              *(one.placed(one.numbered.places) for one in owners[len(bodies):])]
    first = np.cumsum([0, *map(len, places)])
    joined.points = np.concatenate(places)

    def nodes(kind: str, word: str) -> Integers | None:
        found = []
        for one, start in zip(owners, first, strict=False):
            members = one.find(kind, word)
            if members is None and whole_number(word) is not None and one.takes_numbers:
                members = [np.array([int(word)])]
            if members is not None:
                found.append(start + one.numbered.nodes_of(
                    members if kind == "nodes" else [_NodesOf(members)]))
        return np.unique(np.concatenate(found)) if found else None

    def group(word: str, faces: bool) -> str | None:
        for name in (*joined.faces, *joined.edges, *(() if faces else joined.nodes)):
            if name.upper() == word.upper():
                return name
        # Of an instance: a surface, or a set of nodes, that other instances have too.
        for (title, raw), one, start in zip(parts.items(), bodies, first, strict=False):
            prefix = f"{one.name or title}."
            for name in ([] if not word.upper().startswith(prefix.upper())
                         else [*raw.faces, *raw.edges]):
                if name.upper() == word[len(prefix):].upper():
                    if name in raw.faces:
                        joined.faces[word] = [block + start for block in raw.faces[name]]
                    else:
                        joined.edges[word] = raw.edges[name] + start
                    return word
        if not faces and (held := nodes("nodes", word)) is not None and len(held):
            joined.nodes[word] = held
            return word
        return None

    names = Names(joined.points, nodes, group, joined.nodes, not joined.is_solid,
                  assembly.unsorted)
    joined.constraints, unread = constraints_of(assembly.constraints, names)
    for part, (keyword, options, lines) in assembly.attachments:
        name = options.get("ELSET", "")
        elements = assembly.point_elements(part, name, owners)
        if what := refused(keyword, options, elements):
            unread.append(what)
        else:
            joined.attachments += attachments_of(keyword, options, lines, elements, names)
    joined.sections = list(sections_of(assembly.constraints, names))
    joined.temperature, without = temperature_of(assembly.temperatures, names)
    joined.axes = names.axes
    joined.apart = bool(joined.constraints or joined.sections)
    joined.separate &= not _connected(joined, joined.constraints, first[: len(bodies)])
    return joined, unread, without


def _connected(raw: RawMesh, constraints: list[Constraint], first: Integers) -> bool:
    """Whether constraints join all bodies, whose nodes begin at ``first``."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not constraints:
        return len(first) == 1
    size = len(raw.points)
    links = []
    for number, one in enumerate(constraints):
        if isinstance(one, LinearEquation):
            held = [np.array([term.at for term in one.terms], np.int64)]
        else:
            held = [nodes for name in one.groups for nodes in (
                *(block.ravel() for block in raw.faces.get(name, ())),
                raw.edges.get(name, np.empty(0, np.int64)).ravel(),
                raw.nodes.get(name, np.empty(0, np.int64)))]
        links += [(size + number, int(node)) for node in np.unique(np.concatenate(held))]
    for start, end in zip(first, [*first[1:], len(raw.points)], strict=True):
        of_cells = np.concatenate([block.ravel() for _, block in raw.cells])
        own = np.unique(of_cells[(of_cells >= start) & (of_cells < end)])
        links += [(int(own[0]), int(node)) for node in own]
    rows, columns = np.array(links).T
    graph = coo_array((np.ones(len(links)), (rows, columns)), shape=(size + len(constraints),) * 2)
    label = connected_components(graph, directed=False)[1]
    return len(np.unique(label[[int(block[0, 0]) for _, block in raw.cells if len(block)]])) == 1


def _joined(parts: dict[str, RawMesh]) -> RawMesh:
    """Several parts, each with its own numbers, in one mesh with equally named groups joined."""
    if len(parts) == 1:
        (name, raw), = parts.items()
        if name:
            raw.parts.setdefault(name, raw.cells)
        return raw
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
        for title, elements in raw.parts.items():
            joined.cell_sets.setdefault(title, []).extend(
                (kind, block + first) for kind, block in elements)
        for title, blocks in raw.faces.items():
            joined.faces.setdefault(title, []).extend(block + first for block in blocks)
        first += len(raw.points)
    return joined


@contextmanager
def _named(keyword: str, lines: list[str]) -> Iterator[None]:
    """Begin messages of words that are no numbers, and of what lacks, with the keyword."""
    try:
        yield
    except FecontactError:
        raise
    except KeyError as error:
        raise MeshError(f"A line *{keyword} lacks {str(error).strip(chr(39))}=; add it.") from None
    except (ValueError, IndexError) as error:
        raise MeshError(f"The data below a line *{keyword}, which begin with "
                        f"{shown(lines[0] if lines else '')}, cannot be read ({error}); correct "
                        f"them.") from None


def _words(line: str) -> list[str]:
    return [word.strip() for word in line.split(",")]


def _values(line: str) -> list[float]:
    return [as_number(word) for word in _words(line.rstrip(", "))]


def _place(values: list[float]) -> Array:
    """Return three coordinates; those that are left out are zero."""
    return np.array([*values, 0.0, 0.0, 0.0][:3])


def _find(sets: dict[str, Members], name: str) -> Members | None:
    if name in sets:
        return sets[name]
    return next((found for key, found in sets.items() if key.upper() == name.upper()), None)


def _members(owner: "_Part | _Instance", kind: str, word: str) -> Members:
    """The number that a word is, or the members of the set that it names."""
    if (number := whole_number(word)) is not None:
        return [np.array([number])]
    if (found := owner.find(kind, word)) is None:
        raise MeshError(f"The file refers to a set '{word}' that it does not hold.")
    return found


def _add_set(
    owner: "_Part | _Instance", keyword: str, options: Options, lines: list[str]
) -> None:
    kind = _KINDS[keyword]
    members = owner.sets.of(kind).setdefault(options[keyword], [])
    if keyword == "NSET" and "ELSET" in options:
        members.append(_NodesOf(_members(owner, "elements", options["ELSET"])))
    numbers: list[int] = []
    for line in lines:
        words = [word for word in _words(line) if word]
        if "GENERATE" in options:
            first, last, *step = (int(word) for word in words)
            members.append(range(first, last + 1, *step))
            continue
        for word in words:
            if (number := whole_number(word)) is None:
                members += _members(owner, kind, word)
            else:
                numbers.append(number)
    members.append(np.array(numbers, np.int64))


def _local_system(lines: list[str]) -> tuple[Array, Array] | None:
    """Origin and axes (rows) of the data lines of *SYSTEM; None for the global system."""
    if not lines:
        return None
    values = _values(lines[0])
    origin = _place(values[:3])
    if len(values) <= 3:
        return origin, np.eye(3)
    x = _place(values[3:]) - origin
    if len(lines) > 1:
        in_plane = _place(_values(lines[1])) - origin
    else:  # Abaqus keeps the z axis and projects the x axis on the x-y plane.
        x[2] = 0.0
        in_plane = np.array([-x[1], x[0], 0.0])
    z = np.cross(x, in_plane)
    if not np.linalg.norm(z) > _PARALLEL * np.linalg.norm(x) * np.linalg.norm(in_plane):
        raise MeshError(f"The points of the lines {shown('; '.join(lines[:2]))} below *SYSTEM do "
                        f"not span an x-y plane; give an origin, a point on the x axis and a point "
                        f"beside this axis.")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return origin, np.array([x, np.cross(z, x), z])


@dataclass(frozen=True, eq=False)
class _Placement:
    """A translation, and then a rotation about an axis through two points [degrees]."""

    shift: Array
    first: Array
    axis: Array
    degrees: float = 0.0

    @classmethod
    def read(cls, lines: list[str], name: str) -> "_Placement | None":
        """Placement of the data lines of *INSTANCE; None if it moves nothing."""
        if not lines:
            return None
        values, turn = _values(lines[0]), _values(lines[1]) if len(lines) > 1 else [0.0] * 7
        first, axis, degrees = _place(turn), _place(turn[3:6]) - _place(turn), turn[-1]
        length = float(np.linalg.norm(axis))
        if len(values) > 3 or len(turn) != 7 or (degrees and not length > 0.0):
            raise MeshError(f"The lines {shown('; '.join(lines))} of the instance '{name}' must be "
                            f"a translation x, y, z and, on a second line, a rotation: two points "
                            f"of its axis, x, y, z each, and the angle in degrees.")
        moves = any(values) or degrees % 360.0
        return cls(_place(values), first, axis / (length or 1.0), degrees) if moves else None

    @property
    def matrix(self) -> tuple[Array, Array]:
        """Rotation (3, 3) and shift (3,): places are ``matrix @ place + shift``."""
        shift = self.moved(np.zeros((1, 3)))[0]
        return (self.moved(np.eye(3)) - shift).T, shift

    def moved(self, places: Array) -> Array:
        arms = places + self.shift - self.first
        angle = np.radians(self.degrees)
        along = np.outer(arms @ self.axis, self.axis)
        turned = along + np.cos(angle) * (arms - along) + np.sin(angle) * np.cross(self.axis, arms)
        return self.first + (turned if self.degrees else arms)


class _Assembly:
    """Parts and instances as read so far; the part without a name holds a mesh outside of parts."""

    def __init__(self) -> None:
        self.parts: dict[str, _Part] = {"": _Part("")}
        self.instances: list[_Instance] = []
        # Nodes of the assembly itself are reference points; elements of it are not read.
        self.current: _Part | None = self.parts[""]
        self.own = _Instance("", _Part(""))
        self.constraints: list[Block] = []
        self.attachments: list[tuple[_Part | None, Block]] = []
        self.unsorted: set[str] = set()
        self.temperatures: list[Block] = []
        self.loads, self.first_step_ended = DistributedLoads(), False
        self.sections: list[tuple[_Part | None, Options]] = []
        self.materials: dict[str, dict[str, Given]] = {}
        self.orientations: dict[str, Given] = {}
        self.distributions: dict[str, list[str]] = {}
        # Number of elements and blocks that are left out with a warning.
        self.left_out: Counter[str] = Counter()

    def add(self, keyword: str, options: Options, lines: list[str]) -> None:
        part = self.current
        match keyword:
            case "NODE":
                (part or self.own.part).add_nodes(options, lines)
            case "ELEMENT" if part is not None:
                part.add_elements(options, lines)
                self._count_left_out(options["TYPE"].upper(), lines)
            case "ELEMENT" if is_point_element(options["TYPE"].upper()):
                self.own.part.add_elements(options, lines)
            case "ELEMENT":
                self._count_left_out(options["TYPE"].upper(), lines)
            case "SYSTEM" if part is not None:
                part.system = _local_system(lines)
            case "NSET" | "ELSET":
                self._add_set(keyword, options, lines)
            case "SURFACE" if options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
                self._add_surface(options["NAME"], lines)
            case _ if keyword in LOADS and not self.first_step_ended:
                for name, sides in add_loads(self.loads, keyword, options, lines).items():
                    self._add_surface(name, [f"{word}, S{side}" for word, side in sides])
            case "BOUNDARY" | "CLOAD" if not self.first_step_ended:
                for name, node, instance in groups_of_nodes(keyword, lines):
                    if part is not None or instance:
                        within = {"INSTANCE": instance} if instance else {}
                        self._add_set("NSET", {"NSET": name, **within}, [node])
            case "END STEP":
                self.first_step_ended = True
            case "SURFACE" if options["TYPE"].upper() == "NODE":
                sets = [",".join(_words(line)[:1]) for line in lines]
                self._add_set("NSET", {**options, "NSET": options["NAME"]}, sets)
            case "PART":
                name = options["NAME"]
                self.current = self.parts[name.upper()] = _Part(name)
            case "END PART":
                self.current = self.parts[""]
            case "ASSEMBLY" | "END INSTANCE":
                self.current = None
            case "INSTANCE":
                self._add_instance(options, lines)
            case _ if keyword in _STRUCTURAL:
                of = shown(options["ELSET"]) if "ELSET" in options else "some elements"
                raise MeshError(f"The file holds shells or beams (*{keyword} of {of}), which are "
                                f"not read; mesh them with solid elements, or leave elements and "
                                f"section out if they stiffen nothing.")
            case "SOLID SECTION":
                self.sections.append((part, options))
            case "MATERIAL":
                self.materials[options["NAME"].upper()] = {}
            case "ORIENTATION":
                self.orientations[options["NAME"].upper()] = options, lines
            case "DISTRIBUTION":
                self.distributions[options["NAME"].upper()] = lines
            case "ELASTIC" | "DENSITY" | "DAMPING" | "EXPANSION" if self.materials:
                self.materials[next(reversed(self.materials))][keyword] = options, lines
            case _ if is_temperature(keyword, options):
                self.temperatures.append((keyword, options, lines))
            case "INITIAL CONDITIONS":
                self.left_out[f"*INITIAL CONDITIONS of type {options['TYPE'].upper()}"] += 1
            case _ if keyword in READ:
                self.constraints.append((keyword, options, lines))
            case _ if keyword in TYPES:
                self.attachments.append((part, (keyword, options, lines)))
            case _ if keyword in _GENERATING:
                raise MeshError(f"The file makes nodes or elements by *{keyword}, which is not "
                                f"read; write all nodes and elements as data of *NODE and "
                                f"*ELEMENT.")

    def _count_left_out(self, kind: str, lines: list[str]) -> None:
        """Count elements of a type that is neither read nor given a meaning elsewhere."""
        # Gaps are contact, which a study gives.
        if _kind(kind) is None and not is_point_element(kind) and not kind.startswith("GAP"):
            self.left_out[f"*ELEMENT of type {kind}"] += len(lines)

    def _require_no_trusses(
        self, part: "_Part | None", name: str, bodies: "list[_Instance]"
    ) -> None:
        """MeshError if the element set of a section holds trusses."""
        for one in bodies:
            if part is not None and not self._is_of(one, part):
                continue
            for kind, blocks in one.part.element_types.items():
                if kind.startswith(_TRUSSES) and any(
                        np.isin(numbers, np.asarray(member)).any() for numbers in blocks
                        for member in one.find("elements", name) or ()
                        if not isinstance(member, _NodesOf)):
                    raise MeshError(f"The file holds trusses ({kind} with *SOLID SECTION of "
                                    f"'{name}'), which are not read; give springs (SPRINGA) in "
                                    f"their place, or leave out elements and section if they "
                                    f"stiffen nothing.")

    def bodies(self) -> list["_Instance"]:
        """Return the meshes of the file.

        They have the names of parts if each part has one instance at most and none is displaced,
        and those of instances otherwise.
        """
        of_part = {one.source: one for one in self.instances if one.source}
        independent = [one for one in self.instances if not one.source]
        once = len(of_part) + len(independent) == len(self.instances)
        displaced = any(one.placement for one in of_part.values())
        distinct = self.parts.keys().isdisjoint(one.name.upper() for one in independent)
        found = [_Instance("", self.parts[""]), *self.instances]
        if once and distinct and not displaced:
            found = [*(of_part.get(key) or _Instance(part.name, part)
                       for key, part in self.parts.items()), *independent]
            for key, one in of_part.items():
                one.title = self.parts[key].name
        return [one for one in found if one.part.node_blocks and one.part.element_blocks]

    def name_sections_apart(self, bodies: "list[_Instance]") -> None:
        """Give element sets of sections names of their own, PART.SET, where parts use one name."""
        owners = {(id(part), options.get("ELSET", "").upper()) for part, options in self.sections}
        names = Counter(name for _, name in owners)
        for place, (part, options) in enumerate(self.sections):
            name = options.get("ELSET", "").upper()
            if part is None or names[name] == 1:
                continue
            own = f"{part.name}.{name}"
            self.sections[place] = (part, {**options, "ELSET": own})
            for one in (part, *(body.part for body in bodies if self._is_of(body, part))):
                if (members := one.find("elements", name)) is not None:
                    one.sets.elements[own] = members

    def _is_of(self, body: "_Instance", part: "_Part") -> bool:
        return body.part is part or self.parts.get(body.source) is part

    def section_materials(
        self, bodies: "list[_Instance]"
    ) -> tuple[dict[str, AnyMaterial], list[str]]:
        """Materials of the element sets of sections, in units of the file, and what lacks.

        Raises
        ------
        InputError, MeshError
            For a section without a set or a material, or with one that the file does not hold, and
            constants that are not admissible.
        """
        found: dict[str, AnyMaterial] = {}
        if self.materials and not self.sections:
            return {}, ["its materials belong to no elements, for want of a *SOLID SECTION"]
        held = [*(part.sets for part in self.parts.values()),
                *(one.sets for one in (*self.instances, self.own))]
        sets = {name.upper(): name for one in held for name in one.elements}
        for part, options in self.sections:
            name, wanted = options.get("ELSET", ""), options.get("MATERIAL", "")
            if not name or not wanted:
                raise MeshError(f"A line *SOLID SECTION has no "
                                f"{'ELSET' if not name else 'MATERIAL'}=; add it.")
            if name.upper() not in sets:
                raise MeshError(f"A line *SOLID SECTION names the element set '{name}', which the "
                                f"file does not hold{nearest(name, sets.values())}; its element "
                                f"sets are: {choices(sets.values())}.")
            self._require_no_trusses(part, name, bodies)
            if wanted.upper() not in self.materials:
                raise MeshError(f"The section of '{name}' names the material '{wanted}', which the "
                                f"file does not hold{nearest(wanted.upper(), self.materials)}; its "
                                f"materials are: {choices(self.materials)}.")
            turned = options.get("ORIENTATION", "")
            if turned and turned.upper() not in self.orientations:
                raise MeshError(f"The section of '{name}' names the orientation '{turned}', which "
                                f"the file does not hold"
                                f"{nearest(turned.upper(), self.orientations)}; its orientations "
                                f"are: {choices(self.orientations)}.")
            try:
                made = material(wanted, self.materials[wanted.upper()])
            except (InputError, MeshError) as error:
                raise MeshError(f"The material '{wanted}' cannot be read: {error}") from None
            if isinstance(made, AnisotropicMaterial):
                made = self._oriented(made, part, turned, name, bodies)
            if isinstance(made, str):
                return {}, [made]
            found[self._set_name(part, name)] = made
        return found, []

    def _oriented(
        self, made: AnisotropicMaterial, part: "_Part | None", wanted: str, name: str,
        bodies: "list[_Instance]",
    ) -> AnisotropicMaterial | str:
        """Material of a section in its orientation, placed as its part; or what is not read."""
        own = [one for one in bodies if part is not None and self._is_of(one, part)]
        if wanted:
            axes = orientation(wanted, self.orientations,
                               lambda word: self._directions(word, name, own))
            if isinstance(axes, str):
                return axes
            made = replace(made, axes=axes)
        placements = {one.placement for one in own}
        if len(placements) > 1:
            return (f"the section of '{name}' has a material with axes, and its part has instances "
                    f"in different places")
        placement = next(iter(placements), None)
        return made if placement is None else made.moved(*placement.matrix)

    def _directions(
        self, word: str, name: str, bodies: "list[_Instance]"
    ) -> tuple[Array, Array, Array] | None:
        """Centres of the elements of a set, and two directions there by a *DISTRIBUTION.

        None for other words. The first line without an element holds for all that no other names.
        """
        if word.upper() not in self.distributions or not bodies:
            return None
        one, mesh = bodies[0], bodies[0].numbered
        given = np.full((len(mesh.elements.numbers), 6), np.nan)
        for line in self.distributions[word.upper()]:
            of, *words = _words(line)
            try:
                a, b, c, d, e, f = map(float, words)
            except ValueError:
                raise MeshError(f"The distribution '{word}' has the line {shown(line)}; it must be "
                                f"an element or a set, and two directions of three numbers."
                                ) from None
            which = mesh.elements_of(_members(one, "elements", of)) if of else slice(None)
            given[which] = a, b, c, d, e, f
        held = mesh.elements_of(_members(one, "elements", name))
        without = held[np.isnan(given[held]).any(axis=1)]
        if len(without):
            raise MeshError(f"The distribution '{word}' has no directions for {len(without)} "
                            f"elements of '{name}'; add a first line without an element.")
        return mesh.centres[held], given[held, :3], given[held, 3:]

    def point_elements(
        self, part: "_Part | None", name: str, owners: "list[_Instance]"
    ) -> list[PointElement]:
        """Elements in a set to which a block of a part, or of the assembly, gives values."""
        found: list[PointElement] = []
        for one in (*owners, *([] if self.own in owners else [self.own])):
            if part is not None and one.part is not part and self.parts.get(one.source) is not part:
                continue
            members = one.find("elements", name) if name else None
            wanted = [member for member in members or () if not isinstance(member, _NodesOf)]
            prefix = f"{one.name}." if one.name else ""
            found += [replace(element, nodes=tuple(prefix + word for word in element.nodes))
                      for element in one.part.point_elements
                      if any(element.number in member for member in wanted)]
        return found

    def _set_name(self, part: "_Part | None", name: str) -> str:
        """Spelling of the name of an element set where it is made."""
        sets = [one.sets.elements for one in ((part,) if part else self.parts.values())]
        return next((known for held in sets for known in held if known.upper() == name.upper()),
                    name)

    def reference_points(self) -> list["_Instance"]:
        """Return the assembly itself, instances and parts that hold nodes without elements."""
        parts = [_Instance(part.name, part) for part in self.parts.values() if part.name]
        return [one for one in (self.own, *self.instances, *([] if self.instances else parts))
                if one.part.node_blocks and not one.part.element_blocks]

    def _add_instance(self, options: Options, lines: list[str]) -> None:
        name, source = options["NAME"], options.get("PART", "").upper()
        if any(one.name.upper() == name.upper() for one in self.instances):
            raise MeshError(f"The file holds two instances '{name}'; rename one of them.")
        if "LIBRARY" in options:
            raise MeshError(f"The instance '{name}' takes its mesh from results (LIBRARY="
                            f"{options['LIBRARY']}), which are not read; write its mesh into the "
                            f"file.")
        if source not in self.parts:
            known = [part.name for part in self.parts.values() if part.name]
            raise MeshError(f"The instance '{name}' is of the part '{options['PART']}', which the "
                            f"file does not hold{nearest(options['PART'], known)}; its parts are: "
                            f"{choices(known)}.")
        part = self.parts[source] if source else _Part("")
        held = bool(part.node_blocks)
        self.current = replace(
            part, system=None, node_blocks=[*part.node_blocks],
            element_blocks=[*part.element_blocks], other_elements=[*part.other_elements],
            other_nodes=[*part.other_nodes], sets=part.sets.copy(),
            point_elements=[*part.point_elements],
            element_types={name: [*held] for name, held in part.element_types.items()})
        self.instances.append(_Instance(name, self.current, _Placement.read(lines, name),
                                        source if held else ""))

    def _add_set(self, keyword: str, options: Options, lines: list[str]) -> None:
        if "UNSORTED" in options:
            self.unsorted.add(options[keyword].upper())
        if "INSTANCE" in options:
            _add_set(self._instance(options["INSTANCE"], options[keyword]), keyword, options, lines)
        elif self.current is not None:
            _add_set(self.current, keyword, options, lines)
        else:
            words = [word for line in lines for word in _words(line)]
            of_elements = options.get("ELSET", "") if keyword == "NSET" else ""
            for one in self.instances:
                own = [word for word in words if one.find(_KINDS[keyword], word) is not None]
                if own or one.find("elements", of_elements) is not None:
                    _add_set(one, keyword, options, [",".join(own)])
            if keyword == "NSET" and self.own.part.node_blocks:
                known = self.own.part.sets.nodes
                _add_set(self.own, keyword, options, lines if "GENERATE" in options else [
                    word for word in words if whole_number(word) is not None or word in known])

    def _add_surface(self, name: str, lines: list[str]) -> None:
        rows = [(words[0], int(words[1][1:])) for words in map(_words, lines)
                if len(words) > 1 and re.fullmatch(r"[SE]\d+", words[1].upper())]
        for one in self.instances if self.current is None else (self.current,):
            # In the assembly, numbers belong to the only instance.
            own = [row for row in rows if one is self.current
                   or one.find("elements", row[0]) is not None
                   or (len(self.instances) == 1 and whole_number(row[0]) is not None)]
            if own or one is self.current:
                one.sets.surfaces.setdefault(name, []).extend(
                    (_members(one, "elements", word), side) for word, side in own)

    def _instance(self, name: str, of_set: str) -> "_Instance":
        for one in self.instances:
            if one.name.upper() == name.upper():
                return one
        known = [one.name for one in self.instances]
        raise MeshError(f"The set '{of_set}' is of the instance '{name}', which the file does not "
                        f"hold{nearest(name, known)}; its instances are: {choices(known)}.")


@dataclass
class _Part:
    """A part as read so far: blocks of numbers with places, of elements with Abaqus' numbers."""

    name: str
    node_blocks: list[tuple[Integers, Array]] = field(default_factory=list)
    element_blocks: list[tuple[str, Integers, Integers]] = field(default_factory=list)
    # Numbers of the elements that are not read (masses, springs), and of their nodes.
    other_elements: list[int] = field(default_factory=list)
    other_nodes: list[int] = field(default_factory=list)
    sets: _Sets = field(default_factory=_Sets)
    system: tuple[Array, Array] | None = None
    point_elements: list[PointElement] = field(default_factory=list)
    # Numbers of the elements of each type that is read.
    element_types: dict[str, list[Integers]] = field(default_factory=dict)

    @property
    def unused_nodes(self) -> int:
        """Number of nodes that belong to no element."""
        used = [nodes.ravel() for _, _, nodes in self.element_blocks]
        numbers = np.concatenate([numbers for numbers, _ in self.node_blocks])
        return len(np.setdiff1d(numbers, np.concatenate([*used, self.other_nodes])))

    def find(self, kind: str, word: str) -> Members | None:
        """Members of a set; None if there is no such set."""
        return _find(self.sets.of(kind), word)

    def add_nodes(self, options: Options, lines: list[str]) -> None:
        numbers, places = _numbered_places(lines)
        system = options.get("SYSTEM", "R").upper()
        if system not in ("R", "C", "S"):
            raise MeshError(f"The line *NODE, SYSTEM={system} names an unknown system; it may be R "
                            f"(rectangular), C (cylindrical) or S (spherical).")
        places = cartesian(places, system)
        if self.system is not None:
            origin, axes = self.system
            places = origin + places @ axes
        if lines:
            self.node_blocks.append((numbers, places))
        if "NSET" in options:
            self.sets.nodes.setdefault(options["NSET"], []).append(numbers)

    def add_elements(self, options: Options, lines: list[str]) -> None:
        kind = _kind(options["TYPE"].upper())
        if kind is None:
            for line in lines:
                number, *nodes = _words(line)
                self.other_elements.append(int(number))
                self.other_nodes += [one for node in nodes
                                     if (one := whole_number(node)) is not None]
        if is_point_element(options["TYPE"].upper()):
            made = [PointElement(options["TYPE"].upper(), int(number), tuple(filter(None, nodes)))
                    for number, *nodes in map(_words, lines)]
            self.point_elements += made
            if "ELSET" in options:
                self.sets.elements.setdefault(options["ELSET"], []).append(
                    np.array([one.number for one in made], np.int64))
        if kind is None:
            return
        count = 1 + NODES[kind]
        numbers = np.fromiter((int(word) for line in lines for word in line.split(",")
                               if word and not word.isspace()), np.int64)
        if len(numbers) % count:
            raise MeshError(f"The file has elements {options['TYPE']} of another number of nodes "
                            f"than {count - 1}.")
        rows = numbers.reshape(-1, count)
        self.element_types.setdefault(options["TYPE"].upper(), []).append(rows[:, 0])
        if lines:
            self.element_blocks.append((kind, rows[:, 0], rows[:, 1:]))
        if "ELSET" in options:
            self.sets.elements.setdefault(options["ELSET"], []).append(rows[:, 0])


def _numbered_places(lines: list[str]) -> tuple[Integers, Array]:
    """Numbers (n,) and coordinates (n, 3) of rows ``number, x, y, z``."""
    try:
        rows = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None)
    except ValueError:  # rows of different lengths, or with empty fields
        rows = np.array([[float(number), *_place([as_number(word) for word in place])]
                         for number, *place in map(_words, lines)]).reshape(-1, 4)
    numbers = rows[:, 0].astype(np.int64)
    if (rows[:, 0] != numbers).any():
        raise ValueError(f"{rows[rows[:, 0] != numbers][0, 0]:g} is no number of a node")
    places = np.zeros((len(rows), 3))
    places[:, :min(rows.shape[1] - 1, 3)] = rows[:, 1:4]
    return numbers, places


class _Index:
    """Positions of numbers in an array of distinct ones."""

    def __init__(self, numbers: Integers) -> None:
        self.order = np.argsort(numbers, kind="stable")
        self.numbers = numbers[self.order]

    def __call__(self, wanted: Integers) -> Integers:
        """Positions, -1 for numbers that are not there."""
        if not len(self.numbers):
            return np.full(np.shape(wanted), -1)
        at = np.minimum(np.searchsorted(self.numbers, wanted), len(self.numbers) - 1)
        found: Integers = np.where(self.numbers[at] == wanted, self.order[at], -1)
        return found

    def of_range(self, members: range) -> Integers:
        if not members:
            return np.empty(0, np.int64)
        low, high = sorted((members[0], members[-1]))
        inside = ((self.numbers >= low) & (self.numbers <= high)
                  & ((self.numbers - low) % members.step == 0))
        return self.order[inside]


def _last_of_each(numbers: Integers) -> NDArray[np.bool_]:
    """Mask of the last row of each number: later data replace earlier ones."""
    last = np.zeros(len(numbers), bool)
    last[len(numbers) - 1 - np.unique(numbers[::-1], return_index=True)[1]] = True
    return last


@dataclass
class _Instance:
    """An instance of a part, with the sets that the assembly makes of it."""

    name: str
    part: _Part
    placement: _Placement | None = None
    source: str = ""  # key of the part, if its mesh is that of the part
    title: str = ""  # name as a body, if not that of the instance
    sets: _Sets = field(default_factory=_Sets)

    @cached_property
    def numbered(self) -> "_NumberedMesh":
        """Nodes and elements by Abaqus' numbers."""
        return _NumberedMesh(self.part)

    @property
    def takes_numbers(self) -> bool:
        """Whether numbers without the name of an instance are those of its nodes."""
        return not self.name

    def placed(self, places: Array) -> Array:
        """Places of the part where the instance puts them."""
        return places if self.placement is None else self.placement.moved(places)

    def find(self, kind: str, word: str) -> Members | None:
        """Members that ``set``, ``instance.set`` or ``instance.number`` names; None for others."""
        prefix = f"{self.name}."
        if word.upper().startswith(prefix.upper()):
            own = word[len(prefix):]
            if (number := whole_number(own)) is not None:
                return [np.array([number])]
            found = self.part.find(kind, own)
            return _find(self.sets.of(kind), own) if found is None else found
        found = _find(self.sets.of(kind), word)
        return self.part.find(kind, word) if found is None else found

    def raw_mesh(self) -> RawMesh:
        mesh = self.numbered
        node_sets = self._named(self.part.sets.nodes, self.sets.nodes)
        element_sets = self._named(self.part.sets.elements, self.sets.elements)
        surfaces = self._named(self.part.sets.surfaces, self.sets.surfaces)
        mesh.require("node set", "node", node_sets)
        mesh.require("element set", "element", element_sets)
        mesh.require("surface", "element", {
            name: [one for members, _ in rows for one in members]
            for name, rows in surfaces.items()})
        held = {name: mesh.held(members) for name, members in element_sets.items()}
        sides = {name: mesh.sides(rows) for name, rows in surfaces.items()}
        edges = {name: blocks[2] for name, blocks in sides.items() if 2 in blocks}
        for name, cells in held.items():
            if lines := [rows[:, :2] for kind, rows in cells if kind.startswith("line")]:
                edges.setdefault(name, np.concatenate(lines))
        faces = {name: [blocks[count] for count in (3, 4) if count in blocks]
                 for name, blocks in sides.items()}
        parts = {name: [(kind, rows) for kind, rows in cells
                        if not kind.startswith("line")] for name, cells in held.items()}
        return RawMesh(
            self.placed(mesh.places),
            [(kind, rows) for kind, rows in mesh.cells.items() if not kind.startswith("line")],
            edges=edges,
            nodes={name: mesh.nodes_of(members) for name, members in node_sets.items()},
            sets_are_boundaries=True,
            faces={name: blocks for name, blocks in faces.items() if blocks},
            parts={name: cells for name, cells in parts.items() if cells},
            numbers=mesh.numbers,
        )

    def _named(self, of_part: dict[str, _T], of_assembly: dict[str, _T]) -> dict[str, _T]:
        """Groups by name; one of the part whose name the assembly takes is ``instance.name``."""
        taken = {name.upper() for name in of_assembly}
        return {**{f"{self.name}." * (name.upper() in taken) + name: group
                   for name, group in of_part.items()}, **of_assembly}


class _NumberedMesh:
    """Nodes and elements of a part, found by Abaqus' numbers."""

    def __init__(self, part: _Part) -> None:
        numbers = np.concatenate([numbers for numbers, _ in part.node_blocks])
        last = _last_of_each(numbers)
        places = np.concatenate([places for _, places in part.node_blocks])
        self.places = places[last]
        self.numbers = numbers[last]
        self.nodes = _Index(self.numbers)
        before = np.flatnonzero(~last)
        elsewhere = (places[before] != self.places[self.nodes(numbers[before])]).any(axis=1)
        self.moved_nodes = np.unique(numbers[before][elsewhere])
        numbers = np.concatenate(
            [np.empty(0, np.int64), *(numbers for _, numbers, _ in part.element_blocks)])
        last = _last_of_each(numbers)
        self.replaced_elements = np.unique(numbers[~last])
        blocks: dict[str, list[tuple[Integers, Integers]]] = {}
        for kind, numbers, nodes in part.element_blocks:
            kept, last = last[:len(numbers)], last[len(numbers):]
            rows = self.nodes(nodes[kept])
            if (lost := (rows < 0).any(axis=1)).any():
                first = int(np.flatnonzero(lost)[0])
                node = nodes[kept][first][rows[first] < 0][0]
                raise MeshError(f"The element {numbers[kept][first]} names node {node}, which the "
                                f"file does not hold; {np.count_nonzero(lost)} of its elements "
                                f"name such nodes.")
            blocks.setdefault(kind, []).append((numbers[kept], rows))
        self.cells = {kind: np.concatenate([rows for _, rows in found])
                      for kind, found in blocks.items()}
        numbers = np.concatenate([np.empty(0, np.int64), *(
            numbers for found in blocks.values() for numbers, _ in found)])
        self.elements = _Index(numbers)
        others = np.array(part.other_elements, np.int64)
        self.known = {"node": self.nodes,
                      "element": _Index(np.unique(np.concatenate([numbers, others])))}

    def require(self, title: str, one: str, groups: dict[str, Members]) -> None:
        """Refuse sets and surfaces that name nodes or elements which the file does not hold."""
        for name, members in groups.items():
            for member in members:
                if isinstance(member, _NodesOf) or not len(member):
                    continue
                numbers = np.array([member[0], member[-1]] if isinstance(member, range) else member)
                unknown = numbers[self.known[one](numbers) < 0]
                if len(unknown):
                    raise MeshError(f"The {title} '{name}' names {one} {unknown[0]}, which the "
                                    f"file does not hold; the file may be cut off, save it again "
                                    f"whole.")

    def nodes_of(self, members: Members) -> Integers:
        """Positions of the nodes of a set."""
        found = [np.empty(0, np.int64)]
        for member in members:
            if isinstance(member, _NodesOf):
                found += [rows.ravel() for _, rows in self.held(member.elements)]
            else:
                found.append(_positions(self.nodes, member))
        return np.unique(np.concatenate(found))

    @property
    def centres(self) -> Array:
        """Mean places (m, 3) of the corners of all elements."""
        return np.concatenate([self.places[rows[:, : CORNERS.get(kind, 2)]].mean(axis=1)
                               for kind, rows in self.cells.items()])

    def elements_of(self, members: Members) -> Integers:
        """Positions of the elements of a set."""
        found = [_positions(self.elements, member) for member in members
                 if not isinstance(member, _NodesOf)]
        return np.unique(np.concatenate([np.empty(0, np.int64), *found]))

    def held(self, members: Members) -> list[tuple[str, Integers]]:
        """Elements of a set by kind, by the positions of their nodes."""
        chosen = np.zeros(len(self.elements.numbers), bool)
        chosen[self.elements_of(members)] = True
        found = []
        for kind, rows in self.cells.items():
            mine, chosen = chosen[:len(rows)], chosen[len(rows):]
            if mine.any():
                found.append((kind, rows[mine]))
        return found

    def sides(self, rows: list[tuple[Members, int]]) -> dict[int, Integers]:
        """Edges (k, 2) and faces (k, 3), (k, 4) of (elements, number of the side)."""
        found: dict[int, list[Integers]] = {}
        for members, side in rows:
            held = self.held(members)
            if held and all(kind in SOLID and side > len(_FACES[SOLID[kind]]) for kind, _ in held):
                raise MeshError(f"A surface has the side S{side} of elements whose last one is "
                                f"S{max(len(_FACES[SOLID[kind]]) for kind, _ in held)}; correct "
                                f"the number of the side.")
            for kind, nodes in held:
                if kind in SOLID and side <= len(_FACES[SOLID[kind]]):
                    corners = _FACES[SOLID[kind]][side - 1]
                elif kind in PLANE and side <= PLANE[kind]:
                    corners = side - 1, side % PLANE[kind]
                else:
                    continue
                found.setdefault(len(corners), []).append(nodes[:, corners])
        return {count: np.concatenate(blocks) for count, blocks in found.items()}


def _positions(index: _Index, member: Integers | range) -> Integers:
    """Positions of the numbers of a set that an index holds."""
    found = index.of_range(member) if isinstance(member, range) else index(member)
    return found[found >= 0]


def _kind(name: str) -> str | None:
    """Kind of an element type; None for masses, springs, rigid links and the like."""
    if name == "CAX4P":
        return "quad"  # meshio writes every quadrilateral under this name
    if name.startswith(("CAX", "CGAX", "DCAX", "SAX", "MAX")):
        raise MeshError(f"The file holds axisymmetric elements ({name}); fecontact's bodies are "
                        f"plane.")
    if match := _SOLID.match(name):
        if not _VARIANT.match(name[match.end():]):
            raise MeshError(f"The file holds elements of the unknown type {name}; correct the "
                            f"type, such as C3D{match[1]}.")
        if int(match[1]) not in _SOLID_KINDS:
            known = choices(f"C3D{size}" for size in _SOLID_KINDS)
            raise MeshError(f"The file holds elements of the unknown type {name}, that are not "
                            f"read; correct the type, solids are {known}.")
        return _SOLID_KINDS[int(match[1])]
    if match := _LINE.match(name):
        return _LINE_KINDS[match[1], match[2]]
    if match := _PLANE.match(name):
        if name.startswith("STRI6"):
            return "triangle6"
        return _PLANE_KINDS.get(int(match[1]))
    return None
