"""Studies from mesh files: bodies, interfaces where surfaces face each other, and what is left."""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path
from fecontact.core.errors import FecontactError, ModelWarning
from fecontact.core.ties import first_largest
from fecontact.core.types import Array, Integers
from fecontact.core.units import count, listed, quantity
from fecontact.fem.attachments import counted_attachments
from fecontact.fem.constraints import Coupling, LinearEquation, Tie, reference_points
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files import read_bodies, single_nodes
from fecontact.fem.mesh_files.ansys_loads import archive_contents
from fecontact.fem.mesh_files.deck_contents import COMPONENTS, DeckContents, deck_contents
from fecontact.fem.mesh_files.nastran_loads import nastran_contents
from fecontact.fem.pairing import pair_faces
from fecontact.system.model_limits import implausible_body

# Faces look at each other if their normals are opposite within 45 degrees, and they lie closer
# than the longest edge of a facet; two surfaces do if a quarter of the smaller one's area does.
_OPPOSITE, _PART = -0.7, 0.25
_STIFFNESS = 1e13  # of a proposed contact [Pa/m]: a deflection of 0.1 um under 1 MPa
_CONSTRAINTS: Mapping[str, type] = {
    "ties": Tie, "couplings": Coupling, "equations": LinearEquation}
_MOST_NODES = 16  # of a proposed interface
_COINCIDENT = 1e-6  # distance of a node from the middle of an edge that it is, of the body's size
# Elements that are read as others, with the effect on frequencies (benchmarks/calculix.py).
_OTHERWISE = {
    r"C3D8R\w*": "bricks {} (one point) become second-order hexahedra. With degree = 1 in [body] "
                 "they are as in the deck, with a mean strain and Abaqus' hourglass stiffness.",
    r"C3D8I\w*": "bricks {} become second-order hexahedra, with nearly the same frequencies on "
                 "fine meshes. With degree = 1 in [body] they keep their incompatible modes.",
    r"C3D20R\w*": "bricks {} have reduced integration as in the deck, and the mass of full "
                  "integration as in Abaqus. With integration = \"full\" in [body] the stiffness "
                  "has all points.",
    r"C3D8(?![RI])\w*": "bricks {} become second-order hexahedra. With degree = 1 in [body] they "
                        "have full integration as in CalculiX, and are stiff in bending; Abaqus "
                        "also takes the mean of their change of volume.",
    r"C3D4\w*": "tetrahedra {} become second-order tetrahedra. With degree = 1 they stay "
                "first-order ones, which are much too stiff in bending.",
    r"C3D6\w*": "wedges {} become second-order wedges. With degree = 1 they stay first-order ones "
                "with two points of quadrature as in the deck.",
    r"C3D5\w*": "pyramids {} become second-order pyramids. With degree = 1 they stay first-order "
                "ones.",
}
# Functions that read loads and supports, by the suffix of the file.
_CONTENTS: Mapping[str, Callable[[Path], DeckContents]] = {
    ".inp": deck_contents, ".cdb": archive_contents,
    **dict.fromkeys((".bdf", ".fem", ".nas"), nastran_contents)}


@dataclass(frozen=True)
class Imported:
    """A mesh file as a study.

    Attributes
    ----------
    path : Path
        The file.
    scale : float
        Metres per unit of the file.
    meshes : mapping of name to Mesh
        Bodies of the file; one without parts has the name "body".
    contents : DeckContents
        Keywords of an Abaqus or CalculiX deck; empty for other formats.
    interfaces : tuple of (str, str)
        Pairs "BODY.BOUNDARY" of surfaces that face each other.
    notes : tuple of str
        Sentences on data that are not read or not proposed, and on implausible values.
    has_parts : bool
        Whether the names of the bodies are those of parts of the file.
    """

    path: Path
    scale: float
    meshes: Mapping[str, Mesh]
    contents: DeckContents = field(default_factory=DeckContents)
    interfaces: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    has_parts: bool = False

    def summary(self) -> Iterator[tuple[str, str]]:
        """Rows of name and value: bodies, materials, surfaces, constraints, loads."""
        for name, mesh in self.meshes.items():
            size = " × ".join(quantity(float(side), "m") for side in np.ptp(mesh.nodes, axis=0))
            yield (f"body {name}" if self.has_parts else name,
                   f"{mesh.cells_in_words}, {len(mesh.nodes)} nodes, {size}")
            for group, one in mesh.materials.items():
                yield f"  material of {group}", one.description
            for boundary, facets in mesh.boundaries.items():
                yield (f"  boundary {boundary}",
                       count(len(facets), "face" if mesh.dimension == 3 else "edge"))
            for plural, cls in _CONSTRAINTS.items():
                if held := [one.name for one in mesh.constraints if isinstance(one, cls)]:
                    yield f"  {plural}", f"{len(held)}: {listed(held)}"
            if mesh.attachments:
                yield "  attachments", counted_attachments(mesh.attachments)
        for kind, number in self.contents.elements.items():
            yield f"elements {kind}", f"{number}"
        for what, names in (("loads and supports", self.contents.loads),
                            ("contact", self.contents.contact),
                            ("skipped", self.contents.skipped)):
            if names:
                star = "*" if self.path.suffix.lower() == ".inp" else ""
                yield what, ", ".join(f"{number} {star}{name}" for name, number in names.items())
        for face, other in self.interfaces:
            yield "interface", f"{face} on {other}"

    def toml(self, folder: Path) -> str:
        """Text of a study file in a folder: all bodies that touch, or the largest one."""
        import tomli_w

        file = _relative(self.path, folder)
        bodies = self._bodies if self.interfaces else []
        loads = self._loads(self._bodies)
        if not bodies:
            name, = self._bodies
            tables = {"geometry": self._geometry(file, name),
                      "body": self._body(name),
                      "basis": {"modes": 20, "contact": [],
                                **_loaded(loads.named[name], self.meshes[name])}}
            if "points" not in tables["basis"]:
                tables["basis"]["B"] = self._far_point(name)
        else:
            tables = {"bodies": {_name(name): {
                "geometry": self._geometry(file, name), "body": self._body(name),
                "basis": {"modes": 10, "damping": 0.01,
                          **_loaded(loads.named[name], self.meshes[name])}}
                for name in bodies},
                "interfaces": {f"contact-{number}": self._interface(face, other)
                               for number, (face, other) in enumerate(self.interfaces, start=1)}}
        left = [name for name in self.meshes if bodies and name not in bodies]
        if loads.table:
            tables["load"] = loads.table
        tables["simulation"] = {"t_end": 1e-3, "outputs": 101}
        comments = [f"Written by fecontact import {self.path.name}. Units are SI: m, kg, s, N.",
                    *([f"Bodies without an interface are left out: {listed(left, len(left))}."]
                      if left else []),
                    *self.notes,
                    *([f"Loads and supports of the deck: {', '.join(self.contents.loads)}. This "
                       f"study takes supports at zero, forces at single points, pressure, and "
                       f"gravity and rotation of whole bodies. Add others as fixed in [body] and "
                       f"in [load]."]
                      if self.contents.loads else []),
                    *(["Replace the contact laws: they are placeholders, a stiff normal contact "
                       "and a friction coefficient of 0.3."] if bodies else
                      ["No contact: set contact in [basis] to a boundary, and add [normal] and "
                       "[friction]."]),
                    *(["B in [basis], whose motion is observed, is the node farthest from the "
                       "supports."] if "B" in tables.get("basis", {}) else [])]
        head = "".join(f"# {line}\n" for text in comments for line in text.splitlines())
        return f"{head}\n{tomli_w.dumps(tables)}"

    @property
    def _bodies(self) -> list[str]:
        """Bodies of the study: all with interfaces, or else the largest one."""
        if not self.interfaces:
            return [max(self.meshes, key=lambda one: len(self.meshes[one].cells))]
        touching = {face.partition(".")[0] for pair in self.interfaces for face in pair}
        return [name for name in self.meshes if name in touching]

    def lost_loads(self) -> list[str]:
        """Sentences on loads and supports of the file that the study does not hold."""
        return self._loads(self._bodies).notes

    def contradictions(self, name: str, who: str) -> Iterator[str]:
        """Sentences on constraints of a body that do not fit together, or to its supports."""
        mesh = self.meshes[name]
        if not mesh.constraints:
            return
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ModelWarning)
            try:
                fixed: Any = self._body(name).get("fixed", {})
                _ = ElasticBody(mesh, fixed=fixed).elimination
            except FecontactError as error:
                yield (f"The constraints and supports of {who} do not fit together, so that the "
                       f"study stops: {error}")
        yield from (f"{one.message}" for one in caught if issubclass(one.category, ModelWarning))

    def _geometry(self, file: str, name: str) -> dict[str, object]:
        return {"file": file, "scale": self.scale, **({"part": name} if self.has_parts else {})}

    def _body(self, body: str) -> dict[str, object]:
        """Material and supports; those on faces of interfaces are left out."""
        mesh = self.meshes[body]
        touching = {row for pair in self.interfaces for face in pair
                    if face.startswith(f"{body}.")
                    for row in _rows(mesh.boundaries[face[len(body) + 1:]])}
        known = {name.upper(): name for name in (*mesh.boundaries, *mesh.points)
                 if not touching & _rows(mesh.boundaries.get(name, np.empty((0, 2), np.int64)))}
        references = _references(mesh)
        held_at: dict[str, set[str]] = {}
        for given, components in self.contents.supports:
            word = self._within(given, body)
            name = references.get(word.upper()) or known.get(word.upper())
            held = {_in_plane(one) if mesh.dimension == 2 else one for one in components.split()}
            if name and (held := held - {""} if name in references.values() else held & {*"xyz"}):
                # A set may be named in several ways.
                held_at.setdefault(name, set()).update(held)
        fixed = {name: (" " if name in references.values() else "").join(
            one for one in (*COMPONENTS, "phi") if one in held) for name, held in held_at.items()}
        return {**({} if mesh.materials else {"material": "steel"}),
                **(self._plane() if mesh.dimension == 2 else {}),
                **({"fixed": fixed} if fixed else {}),
                **({"rotation": rotation} if (rotation := self._rotation(body)) else {})}

    def _plane(self) -> dict[str, object]:
        """State of plane bodies, and their thickness, one in units of the file if it has none."""
        found = self.contents
        if not found.planes:
            return {"plane": "strain"}
        return {"plane": min(found.planes, key=("stress", "strain").index),
                "thickness": self.scale * (found.thicknesses or (1.0,))[0]}

    def _far_point(self, body: str) -> list[float]:
        """Place of the node that is farthest from the supports of a body, or from its middle."""
        from scipy.spatial import KDTree

        mesh, fixed = self.meshes[body], self._body(body).get("fixed", {})
        held = [mesh.boundaries.get(name, mesh.points.get(name, np.empty(0, np.int64))).ravel()
                for name in (fixed if isinstance(fixed, dict) else ())]
        nodes = np.unique(np.concatenate([np.empty(0, np.int64), *held]))
        start = mesh.nodes[nodes] if len(nodes) else mesh.nodes.mean(axis=0, keepdims=True)
        away, _ = KDTree(start).query(mesh.nodes)
        # Of nodes at equal distances, up to rounding, the first.
        place: list[float] = mesh.nodes[first_largest(away)].tolist()
        return place

    def _loads(self, bodies: Sequence[str]) -> "_Loads":
        """Forces and moments at points, pressure and gravity of the first step."""
        found = _Loads({body: {} for body in bodies})
        several = len(bodies) > 1 or bool(self.interfaces)
        found.notes += self._lost_supports(bodies)
        for given, component, value in self.contents.forces:
            for body in bodies:
                mesh, word = self.meshes[body], self._within(given, body)
                single = {name.upper(): name for name, nodes in mesh.points.items()
                          if len(nodes) == 1}
                names = single | _references(mesh)
                name = names.get(word.upper()) or names.get(f"NODE {word}")
                if mesh.dimension == 2:
                    component = _in_plane(component)
                if name and component:
                    moment = component.startswith("phi")
                    found.add(body, name, "forces", {
                        "point": f"{_name(body)}." * several + name, "component": component,
                        "signal": value * (self.scale if moment else 1.0)})
                    break
                if component and not component.startswith("phi") and (
                        middle := self._middle(body, {word.upper(), f"NODE {word}"})):
                    name, place = middle
                    found.add(body, name, "forces", {
                        "point": f"{_name(body)}." * several + name, "component": component,
                        "signal": value}, place)
                    break
            else:
                found.notes.append(f"The force on {given} is left out: {given} is not a single "
                                   f"point of the bodies.")
        distributed = self.contents.distributed
        for surface, value in distributed.pressures:
            held = [(body, name) for body in bodies for name in self.meshes[body].boundaries
                    if name.upper() == self._within(surface, body).upper()]
            for body, name in held:
                found.add(body, name, "boundaries", {
                    "boundary": f"{_name(body)}." * several + name,
                    "pressure": value / self.scale**2})
            if not held:
                found.notes.append(f"The pressure on {surface} is left out: {surface} is not a "
                                   f"boundary of the bodies.")
        totals = {body: np.zeros(3) for body in bodies}
        for name, acceleration in distributed.gravity:
            whole = [body for body in bodies if self._whole(name, body)]
            for body in whole:
                totals[body] += self.scale * np.array(acceleration)
            if not whole:
                found.notes.append(f"Gravity on {name} is left out: gravity must act on all cells.")
        total = totals[bodies[0]]
        if any((one != total).any() for one in totals.values()):
            found.notes.append("Gravity is left out: it must be the same on all bodies.")
        elif total.any():
            d = self.meshes[bodies[0]].dimension
            found.table["gravity"] = total[:d].tolist()
            for body in bodies:
                found.named[body]["gravity"] = "gravity"
        for name, *_ in distributed.rotations:
            if not any(self._rotation(body) for body in bodies):
                found.notes.append(f"Centrifugal force on {name} is left out: this force must act "
                                   f"on all cells.")
        found.notes += distributed.notes
        for what in dict.fromkeys(distributed.unread):
            found.notes.append(f"{what} is left out: only {distributed.kinds} are read.")
        return found

    @cached_property
    def _places(self) -> dict[str, Array]:
        """Places of nodes with a name of their own [m]."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)
            return single_nodes(self.path, scale=self.scale)

    def _middle(self, body: str, words: set[str]) -> tuple[str, list[float]] | None:
        """Name and place of a node with one of some names in the middle of an edge of a body.

        Such nodes are no points of a mesh; a body has their displacements all the same.
        """
        mesh = self.meshes[body]
        for name, place in self._places.items():
            at = place[: mesh.dimension]
            if name.upper() in words and np.isfinite(at).all() and (
                    np.linalg.norm(mesh.edge_middles - at, axis=1).min()
                    <= _COINCIDENT * mesh.extent):
                return name, at.tolist()
        return None

    def _lost_supports(self, bodies: Sequence[str]) -> Iterator[str]:
        """Sentences on supports that hold displacements, but are fixed on none of the bodies."""
        taken: dict[str, set[str]] = {}
        for body in bodies:
            fixed = self._body(body).get("fixed", {})
            taken[body] = {name.upper() for name in fixed} if isinstance(fixed, dict) else set()
        axes = "xyz"[: self.meshes[bodies[0]].dimension]
        for given, components in self.contents.supports:
            number = given.rpartition(".")[2]
            # Nodes by their numbers are in groups of their own.
            numbered = number.isdigit() and any(
                name.startswith("BOUNDARY ") for names in taken.values() for name in names)
            held = any({self._within(given, body).upper(), f"NODE {number}"} & names
                       for body, names in taken.items())
            if not held and not numbered and {*components.split()} & {*axes}:
                yield (f"The support of {given} is left out: {given} is not a group of the bodies, "
                       f"or touches a face of an interface.")

    def _rotation(self, body: str) -> dict[str, object] | None:
        """Table of the rotation of a body by centrifugal force on all its cells."""
        mesh = self.meshes[body]
        for name, square, point, axis in self.contents.distributed.rotations:
            if square > 0.0 and self._whole(name, body) and (
                    mesh.dimension == 3 or not any(axis[:2])):
                return {"speed": float(np.sqrt(square)),
                        "centre": [self.scale * x for x in point[:mesh.dimension]],
                        **({"axis": list(axis)} if mesh.dimension == 3 else {})}
        return None

    def _whole(self, name: str, body: str) -> bool:
        """True if a set of elements, by name or none for all, holds all cells of a body."""
        mesh, own = self.meshes[body], self._within(name, body).upper()
        groups = {group.upper(): cells for group, cells in mesh.cell_groups.items()}
        return not name or own == body.upper() or len(groups.get(own, ())) == len(mesh.cells)

    def _within(self, word: str, body: str) -> str:
        """Name of a set of the deck within a body; empty for a set of the instance of another."""
        instance, _, name = word.rpartition(".")
        names = {instance.upper(), self.contents.instances.get(instance.upper(), "").upper()}
        own = {one.upper() for one in self.meshes} if self.has_parts else {
            *self.contents.instances}
        if not instance or not names & own:
            return self.contents.single.get(word, word)
        return name if not self.has_parts or body.upper() in names else ""

    def _interface(self, face: str, other: str) -> dict[str, object]:
        body, _, boundary = face.partition(".")
        mesh = self.meshes[body]
        area = float(np.linalg.norm(_vectors(mesh, mesh.boundaries[boundary]), axis=1).sum())
        faces = [f"{_name(name)}.{of}" for name, _, of in (
            one.partition(".") for one in (face, other))]
        return {"face": faces[0], "other": faces[1],
                "nodes": _contact_nodes(self.meshes, face, other),
                "normal": {"law": "linear", "stiffness": float(f"{_STIFFNESS * area:.3g}")},
                "friction": {"law": "constant", "friction_coefficient": 0.3,
                             "smoothing_slope": 1e4}}


@dataclass
class _Loads:
    """Table of loads, the points and boundaries of bodies that they load, and what is left out.

    ``named`` are, for each body, names of places with what a basis calls them: the name of a group,
    or coordinates.
    """

    named: dict[str, dict[str, str | list[float]]]
    table: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add(
        self, body: str, name: str, kind: str, row: dict[str, object],
        place: list[float] | None = None,
    ) -> None:
        """Add a row to the forces or boundaries of the table, of a named place of a body."""
        self.table.setdefault(kind, []).append(row)
        self.named[body][name] = place or name


def imported(path: str | Path, scale: float = 1.0) -> Imported:
    """Read a mesh file, and propose interfaces where its named surfaces face each other.

    Surfaces that ``*CONTACT PAIR`` of a deck names come first, then those whose facets look at
    facets of another body, or of another piece of the same, closer than their edges are long.
    Surfaces that are tied are left out. Only those that can be paired are
    proposed; the notes name the others.

    Parameters
    ----------
    path : str or Path
        The file, of a format of :func:`fecontact.read_mesh`.
    scale : float
        Metres per unit of the file.

    Raises
    ------
    InputError, MeshError
        As in :func:`fecontact.read_mesh`.
    """
    path = as_path(path, "a mesh")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        meshes = read_bodies(path, scale=scale)
        read = _CONTENTS.get(path.suffix.lower())
        contents = read(path) if read else DeckContents()
        notes = [f"{one.message}" for one in caught if issubclass(one.category, ModelWarning)]
        if has_parts := "" not in meshes:
            who = {name: f"body '{name}'" for name in meshes}
        else:
            meshes, who = {"body": meshes[""]}, {"body": "the body"}
        bodies = {name: ElasticBody(mesh, degree=1) for name, mesh in meshes.items()}
        for name, body in bodies.items():
            notes += [f"{sentence[:1].upper()}{sentence[1:]}"
                      for sentence in implausible_body(who[name], body)]
    if contents.elements or contents.properties:
        notes += [f"The deck gives {who[name]} no material. The study takes steel: correct [body]."
                  for name, mesh in meshes.items() if not mesh.materials]
    notes += [f"{number} {sentence.format(kind)}" for kind, number in contents.elements.items()
              for types, sentence in _OTHERWISE.items() if re.fullmatch(types, kind)]
    if any(mesh.dimension == 2 for mesh in meshes.values()):
        notes += _doubts_of_plane(contents)
    interfaces: list[tuple[str, str]] = []
    for face, other in _facing(meshes, contents):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ModelWarning)
                pair_faces(bodies, face, other, nodes=_contact_nodes(meshes, face, other))
        except FecontactError as error:
            notes.append(f"{face} and {other} do not become an interface: {error}")
            continue
        interfaces.append((face, other))
    found = Imported(path, scale, meshes, contents, tuple(interfaces), has_parts=has_parts)
    for name in meshes:
        notes += found.contradictions(name, who[name])
    notes += found.lost_loads()
    return replace(found, notes=tuple(dict.fromkeys(notes)))


def _contact_nodes(meshes: Mapping[str, Mesh], *faces: str) -> int:
    """Number of contact nodes of a proposed interface, at most that of facets of both faces."""
    return min(_MOST_NODES, *(len(meshes[body].boundaries[name])
                              for body, _, name in (face.partition(".") for face in faces)))


def _doubts_of_plane(contents: DeckContents) -> Iterator[str]:
    """Sentences on states and thicknesses of plane bodies that the file does not settle."""
    if len(contents.planes) > 1:
        yield ("The file has elements of plane stress and of plane strain. The study has plane "
               "stress for all: correct plane in [body].")
    if not contents.planes:
        yield ("The file does not tell plane stress from plane strain. The study has plane strain: "
               "correct plane, and give thickness, in [body].")
    if len(contents.thicknesses) > 1:
        sizes = ", ".join(f"{size:g}" for size in contents.thicknesses)
        yield (f"The sections of the file have the thicknesses {sizes}. The study has the first "
               f"one: correct thickness in [body].")
    if contents.planes and not contents.thicknesses:
        yield ("The file gives its plane bodies no thickness. The study has one unit of length: "
               "correct thickness in [body].")


def _facing(meshes: Mapping[str, Mesh], contents: DeckContents) -> Iterator[tuple[str, str]]:
    """Pairs of surfaces that face each other; none has a facet of a pair before it."""
    named = {f"{body}.{name}": (mesh, facets) for body, mesh in meshes.items()
             for name, facets in mesh.boundaries.items()}
    pieces = {key: {(key.partition(".")[0], int(one)) for one in np.unique(
        mesh.pieces[1][facets])} for key, (mesh, facets) in named.items()}
    used: dict[str, set[tuple[int, ...]]] = {}
    for body, mesh in meshes.items():
        tied = {name for one in mesh.constraints if isinstance(one, Tie) for name in one.groups}
        used[body] = {row for name in tied & mesh.boundaries.keys()
                      for row in _rows(mesh.boundaries[name])}
    by_end = {key.partition(".")[2].upper(): key for key in named}
    by_name = {key.upper(): key for key in named}

    def key_of(word: str) -> str | None:
        """Key of a surface of ``*CONTACT PAIR``, with the name of an instance or of its part."""
        instance, _, name = word.upper().rpartition(".")
        part = contents.instances.get(instance, "").upper()
        return (by_name.get(f"{instance}.{name}") or by_name.get(f"{part}.{name}")
                or by_end.get(name))

    given = [(a, b) for first, second in contents.pairs
             if (a := key_of(first)) and (b := key_of(second))]
    found = []
    for (a, one), (b, two) in combinations(named.items(), 2):
        if pieces[a] & pieces[b]:
            continue
        if (part := _facing_part(one, two)) >= _PART:
            # Of equal areas that of the fewest facets.
            found.append((-round(part, 3), len(one[1]) + len(two[1]), a, b))
    for a, b in (*given, *((a, b) for *_, a, b in sorted(found))):
        facets = {key: _rows(named[key][1]) for key in (a, b)}
        taken = [used[key.partition(".")[0]] for key in (a, b)]
        if not any(own & before for own, before in zip(facets.values(), taken, strict=True)):
            for own, before in zip(facets.values(), taken, strict=True):
                before |= own
            yield a, b


def _rows(facets: Integers) -> set[tuple[int, ...]]:
    """Nodes of each facet, without its orientation."""
    return {tuple(sorted(row)) for row in facets.tolist()}


def _facing_part(one: tuple[Mesh, Integers], other: tuple[Mesh, Integers]) -> float:
    """Part of the area of the smaller surface whose facets look at the other one from nearby."""
    from scipy.spatial import KDTree

    vectors = [_vectors(*one), _vectors(*other)]
    areas = [float(np.linalg.norm(each, axis=1).sum()) for each in vectors]
    (own, away), (mine, its) = (one, other), vectors
    if areas[1] < areas[0]:
        (own, away), (mine, its) = (other, one), vectors[::-1]
    places, partners = (mesh.nodes[facets] for mesh, facets in (own, away))
    reach = max(float(np.linalg.norm(np.ptp(some, axis=1), axis=1).max())
                for some in (places, partners))
    distance, nearest = KDTree(partners.mean(axis=1)).query(places.mean(axis=1))
    size, its_size = np.linalg.norm(mine, axis=1), np.linalg.norm(its, axis=1)
    cosine = np.einsum("ij,ij->i", mine, its[nearest]) / (size * its_size[nearest])
    return float(size[(cosine < _OPPOSITE) & (distance < reach)].sum() / size.sum())


def _vectors(mesh: Mesh, facets: Integers) -> Array:
    """Outward normals of faces (k, 3) times their area, of edges (k, 2) times their length."""
    places = mesh.nodes[facets]
    if mesh.dimension == 2:
        along = places[:, 1] - places[:, 0]
        return np.column_stack([along[:, 1], -along[:, 0]])
    return np.asarray(0.5 * np.cross(places[:, 2] - places[:, 0], places[:, -1] - places[:, 1])
                      if facets.shape[1] == 4 else 0.5 * np.cross(
                          places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]))


def _references(mesh: Mesh) -> dict[str, str]:
    """Names of reference points by the words of a deck, in capitals."""
    found = reference_points(mesh.constraints, mesh.points)
    return {word: name for name in found for word in (name.upper(), name.upper().removeprefix(
        "NODE "))}


def _loaded(places: Mapping[str, str | list[float]], mesh: Mesh) -> dict[str, object]:
    """Keys of a basis with places at which loads act, and with the temperature of the deck."""
    names, found = sorted(places), dict[str, object]()
    if names:
        points = [name for name in names if name not in mesh.boundaries and name != "gravity"]
        found |= {**({"points": {name: places[name] for name in points}} if points else {}),
                  "loads": names}
    if mesh.temperature is not None and any(
            getattr(one, "thermal_expansion", 0.0) for one in mesh.materials.values()):
        found["temperature"] = "mesh"
    return {**found, "reduction": "residual"} if found else found


def _in_plane(component: str) -> str:
    """Component of a plane body for one of a deck; empty for none."""
    return {"x": "x", "y": "y", "phi_z": "phi"}.get(component, "")


def _name(body: str) -> str:
    """Name of a body in a study, where dots part the names of keys."""
    return "the-ground" if body == "ground" else body.replace(".", "-")


def _relative(path: Path, folder: Path) -> str:
    """Path as seen from a folder where it lies in it, or else in full."""
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        return path.resolve().as_posix()
