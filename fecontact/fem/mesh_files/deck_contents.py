"""Contents of a deck beside its mesh: loads and supports, keywords, and element types."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fecontact.core.checks import whole_number
from fecontact.core.types import Array
from fecontact.fem.mesh_files.abaqus import local_axes
from fecontact.fem.mesh_files.abaqus_attachments import TYPES
from fecontact.fem.mesh_files.abaqus_constraints import READ, number_of
from fecontact.fem.mesh_files.abaqus_keywords import Deck, as_number
from fecontact.fem.mesh_files.abaqus_loads import (
    KINDS,
    LOADS,
    add_loads,
    groups_of_nodes,
    node_of,
)
from fecontact.fem.mesh_files.distributed_loads import DistributedLoads

# Keywords of the mesh and its materials, besides those of constraints.
_MESH = ("", "NODE", "ELEMENT", "SYSTEM", "NSET", "ELSET", "SURFACE", "PART", "END PART",
         "INSTANCE", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY", "SOLID SECTION", "MATERIAL",
         "ELASTIC", "DENSITY", "DAMPING", "EXPANSION", "ORIENTATION", "DISTRIBUTION",
         "DISTRIBUTION TABLE", "INCLUDE", "HEADING", "PREPRINT")
# Loads and supports, which a study gives, of Abaqus, Nastran and Ansys.
_LOADS = ("BOUNDARY", "CLOAD", *LOADS, "TEMPERATURE", "INITIAL CONDITIONS",
          "FORCE", "MOMENT", "PLOAD4", "GRAV", "SPC", "SPC1", "F", "D", "SFE", "ACEL", "OMEGA")
_CONTACT = ("CONTACT PAIR", "CONTACT", "CONTACT INCLUSIONS", "CONTACT PROPERTY ASSIGNMENT",
            "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION", "CLEARANCE", "GAP")


@dataclass(frozen=True)
class DeckContents:
    """Contents of a deck beside its mesh.

    Attributes
    ----------
    keywords : Counter
        Number of blocks of each keyword.
    elements : Counter
        Number of elements of each type in the parts, once for each part.
    pairs : tuple of (str, str)
        Surfaces of ``*CONTACT PAIR``.
    supports : tuple of (str, str)
        Sets that ``*BOUNDARY`` holds up to the end of the first step, and the components of their
        motion that it does, with spaces between them: x y z phi_x phi_y phi_z.
    forces : tuple of (str, str, float)
        Sets or nodes on which ``*CLOAD`` acts in the first step, the component and the value.
    single : mapping of str to str
        Sets of one node, by its number.
    distributed : DistributedLoads
        Pressure, gravity and centrifugal force of ``*DLOAD`` and ``*DSLOAD`` in the first step.
    planes : tuple of str
        States of the plane elements, 'stress', 'strain' or both; empty where nothing tells.
    thicknesses : tuple of float
        Thicknesses of the sections of plane elements, each once, in units of the file.
    properties : bool
        True if properties of elements, of a file of Nastran, name materials.
    instances : mapping of str to str
        Part of each instance, by its name in capitals.

    Files of Nastran and Ansys give supports, forces and distributed loads alike.
    """

    keywords: Counter[str] = field(default_factory=Counter)
    elements: Counter[str] = field(default_factory=Counter)
    pairs: tuple[tuple[str, str], ...] = ()
    supports: tuple[tuple[str, str], ...] = ()
    forces: tuple[tuple[str, str, float], ...] = ()
    single: Mapping[str, str] = field(default_factory=dict)
    distributed: DistributedLoads = field(default_factory=DistributedLoads)
    planes: tuple[str, ...] = ()
    thicknesses: tuple[float, ...] = ()
    properties: bool = False
    instances: Mapping[str, str] = field(default_factory=dict)

    @property
    def loads(self) -> dict[str, int]:
        """Keywords of loads and supports, which the study gives in its own sections."""
        return self._counts(_LOADS)

    @property
    def contact(self) -> dict[str, int]:
        """Keywords of contact, which the study gives as interfaces and laws."""
        return self._counts(_CONTACT)

    @property
    def skipped(self) -> dict[str, int]:
        """Keywords that neither the mesh nor constraints nor the two above use."""
        known = {*_MESH, *READ, *TYPES, *_LOADS, *_CONTACT}
        return {name: count for name, count in self.keywords.items() if name not in known}

    def _counts(self, names: tuple[str, ...]) -> dict[str, int]:
        return {name: self.keywords[name] for name in names if self.keywords[name]}


def deck_contents(path: Path) -> DeckContents:
    """Read the keywords of a deck.

    Raises
    ------
    MeshError
        If the deck includes itself or a missing file.
    """
    deck = Deck(path)
    elements: Counter[str] = Counter()
    pairs: list[tuple[str, str]] = []
    supports: dict[str, set[int]] = {}
    forces: list[tuple[str, str, float]] = []
    single: dict[str, str] = {}
    distributed = DistributedLoads(kinds=KINDS)
    thicknesses: list[float] = []
    instances: dict[str, str] = {}
    held_before = False  # true up to the first *BOUNDARY of a step, which OP=NEW concerns
    for keyword, options, lines in deck.blocks():
        rows = [[word.strip() for word in line.split(",")] for line in lines] if (
            keyword in ("CONTACT PAIR", "BOUNDARY", "CLOAD", "NSET")
            or (keyword == "NODE" and "NSET" in options)) else []
        if keyword == "ELEMENT":
            # Data of an element go on after a comma at the end of a line.
            elements[options.get("TYPE", "").upper()] += sum(
                not line.endswith(",") for line in lines)
        elif "NSET" in options and len(rows) == 1 and "GENERATE" not in options:
            words = rows[0][:1] if keyword == "NODE" else [word for word in rows[0] if word]
            # A name is that of another set, which this one holds.
            if len(words) == 1 and whole_number(words[0]) is not None:
                single.setdefault(words[0], options["NSET"])
        elif keyword == "INSTANCE":
            instances[options.get("NAME", "").upper()] = options.get("PART", "")
        elif keyword == "CONTACT PAIR":
            pairs += [(row[0], row[1]) for row in rows if len(row) > 1]
        elif keyword == "STEP":
            held_before = True
        elif keyword == "BOUNDARY" and not deck.keywords["END STEP"]:
            if held_before and options.get("OP", "").upper() == "NEW":
                supports.clear()
            held_before = False
            if any(len(row) > 3 and number_of(row[3], "*BOUNDARY") for row in rows):
                distributed.unread.append("*BOUNDARY with displacements other than zero")
            distributed.unread += _of_time(keyword, options)
            groups = [[name, *rows[k][1:]] for k, (name, *_) in zip(
                [k for k, row in enumerate(rows) if node_of(row[0])],
                groups_of_nodes(keyword, lines), strict=True)]
            for name, *held in (*rows, *groups):
                known = next((one for one in supports if one.upper() == name.upper()), name)
                supports.setdefault(known, set()).update(_held(held))
        elif keyword == "SOLID SECTION":
            thicknesses.append(_thickness(lines))
        elif keyword in LOADS and not deck.keywords["END STEP"]:
            add_loads(distributed, keyword, options, lines)
        elif keyword == "CLOAD" and not deck.keywords["END STEP"]:
            distributed.unread += _of_time(keyword, options)
            forces += [(name, COMPONENTS[dof - 1], size) for name, word, value, *_ in (
                (*row, "", "")[: max(len(row), 3)] for row in rows)
                if (dof := whole_number(word) or 0) in range(1, 7)
                and (size := number_of(value, "*CLOAD"))]
    found = DeckContents(
        deck.keywords, elements, tuple(pairs),
        tuple((name, " ".join(COMPONENTS[dof - 1] for dof in sorted(held)))
              for name, held in supports.items() if held), tuple(forces), single,
        distributed,
        tuple(sorted({"stress" if name.startswith("CPS") else "strain" for name in elements
                      if name.startswith(("CPS", "CPE"))})), tuple(dict.fromkeys(thicknesses)),
        instances=instances)
    if not deck.keywords["TRANSFORM"]:
        return found
    axes_of = local_axes(path)
    return along_coordinates(found, lambda word: axes_of(single.get(word, word)))


def along_coordinates(contents: DeckContents, axes_of: Callable[[str], Array]) -> DeckContents:
    """Contents of a file whose supports and forces act along local axes of their nodes.

    A force becomes its components along the coordinates. Supports hold those coordinates whose unit
    vectors e fulfil P e = e, where P = sum of n n^T over the local directions n that are held.
    Parts of supports along other directions, and forces on nodes with different axes, are left out
    and listed in ``distributed.notes``.

    Parameters
    ----------
    contents : DeckContents
        Supports and forces with components along local axes.
    axes_of : callable
        Local axes (k, 3, 3), by rows, of the k nodes of a set or a node.
    """
    notes = contents.distributed.notes
    supports: list[tuple[str, str]] = []
    for given, components in contents.supports:
        held: list[str] = []
        lost: list[str] = []
        for names in (COMPONENTS[:3], COMPONENTS[3:]):
            which = [k for k, name in enumerate(names) if name in components.split()]
            if len(which) == 3:
                held += names
                continue
            directions = axes_of(given)[:, which]
            if not len(directions):  # the file does not hold the nodes
                held += [names[k] for k in which]
                continue
            P = np.einsum("kia,kib->kab", directions, directions)
            along = [name for k, name in enumerate(names)
                     if np.abs(P[:, k] - np.eye(3)[k]).max() < _SAME_DIRECTION]
            held += along
            lost += [names[k] for k in which] * (len(along) < len(which))
        if held:
            supports.append((given, " ".join(held)))
        if lost:
            kept = f"held in {', '.join(held)} of the coordinates alone" if held else "left out"
            notes.append(f"The support of {given} in {', '.join(lost)} of its local axes is "
                         f"{kept}: a study holds displacements along the coordinates; give the "
                         f"nodes axes along these, or hold x, y and z.")
    forces: list[tuple[str, str, float]] = []
    for given, component, value in contents.forces:
        first = 3 * (COMPONENTS.index(component) // 3)
        vectors = axes_of(given)[:, COMPONENTS.index(component) - first]
        if not len(vectors):  # the file does not hold the nodes
            forces.append((given, component, value))
            continue
        if np.ptp(vectors, axis=0).max() > _SAME_DIRECTION:
            notes.append(f"The force on {given} is left out: local axes differ between its nodes; "
                         f"give each node its own force.")
            continue
        forces += [(given, name, value * part) for name, part in zip(
            COMPONENTS[first:first + 3], vectors[0].tolist(), strict=True)
            if abs(part) > _SAME_DIRECTION]
    return replace(contents, supports=tuple(supports), forces=tuple(forces))


def _of_time(keyword: str, options: Mapping[str, str]) -> list[str]:
    """Kinds of values that are read as if they were constant in time and space."""
    return [f"The option {name} of *{keyword}"
            for name in ("AMPLITUDE", "FOLLOWER", "LOAD CASE", "USER") if name in options]


def _thickness(lines: list[str]) -> float:
    """Thickness of a section of plane elements; one where its data say nothing."""
    try:
        return as_number(lines[0].split(",")[0]) or 1.0 if lines else 1.0
    except ValueError:
        return 1.0


_SAME_DIRECTION = 1e-6  # of a unit vector: files round coordinates and angles
COMPONENTS = ("x", "y", "z", "phi_x", "phi_y", "phi_z")
# Degrees of freedom that names hold.
_NAMED = {"ENCASTRE": range(1, 7), "PINNED": range(1, 4), "XSYMM": (1, 5, 6), "YSYMM": (2, 4, 6),
          "ZSYMM": (3, 4, 5), "XASYMM": (2, 3, 4), "YASYMM": (1, 3, 5), "ZASYMM": (1, 2, 6)}


def _held(words: list[str]) -> Iterable[int]:
    """Degrees of freedom that the data of *BOUNDARY hold at zero, by numbers or a name."""
    if words and words[0].upper() in _NAMED:
        return _NAMED[words[0].upper()]
    first = whole_number(words[0]) if words else None
    last = whole_number(words[1]) if len(words) > 1 and words[1] else first
    if first is None or last is None or (
            len(words) > 2 and number_of(words[2], "*BOUNDARY")):
        return ()
    return range(max(first, 1), min(last, 6) + 1)
