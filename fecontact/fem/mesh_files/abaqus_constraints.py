"""Constraints of Abaqus and CalculiX decks: ties, couplings, rigid bodies, equations."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fecontact.core.checks import whole_number
from fecontact.core.errors import MeshError, shown
from fecontact.core.types import Array, Integers
from fecontact.fem.constraints import Constraint, Coupling, LinearEquation, Term, Tie
from fecontact.fem.mesh_files.abaqus_keywords import Options, as_number

Block = tuple[str, Options, list[str]]
# Keywords that constrain displacements, and those that go on with the one before.
SECTION = "PRE-TENSION SECTION"
READ = (SECTION, "EQUATION", "TIE", "COUPLING", "KINEMATIC COUPLING", "MPC", "RIGID BODY",
        "TRANSFORM", "KINEMATIC", "DISTRIBUTING")
_MPC = ("BEAM", "TIE", "PIN")
# Options that change what a keyword means.
_REFUSED = {"TIE": ("CYCLIC SYMMETRY",), "COUPLING": ("ORIENTATION", "INFLUENCE RADIUS"),
            "KINEMATIC COUPLING": ("ORIENTATION",), "RIGID BODY": ("ANALYTICAL SURFACE",)}


@dataclass(frozen=True, eq=False)
class Names:
    """Nodes and surfaces of a deck by its words.

    Attributes
    ----------
    places : (N, 3) array
        Places of all nodes, in the unit of the file.
    nodes : callable
        Nodes of a set, of an element set, or of a number; None for an unknown word.
    group : callable
        Name of the group of faces or of nodes that a surface or a set is; None for an unknown one.
    groups : dict
        Groups of nodes by name, to which those that constraints need are added.
    planar : bool
        Whether the body is plane.
    unsorted : set of str
        Names of sets whose order counts, in capitals.
    references : dict
        Names of reference nodes.
    axes : dict
        Local axes (3, 3), by rows, of nodes with some.
    """

    places: Array
    nodes: Callable[[str, str], Integers | None]
    group: Callable[[str, bool], str | None]
    groups: dict[str, Integers]
    planar: bool
    unsorted: set[str] = field(default_factory=set)
    references: dict[int, str] = field(default_factory=dict)
    axes: dict[int, Array] = field(default_factory=dict)

    def of(self, word: str, where: str, kind: str = "nodes") -> Integers:
        """Nodes of a word; MeshError, with ``where`` in front, if there are none."""
        found = self.nodes(kind, word)
        if found is None or not len(found):
            raise MeshError(f"{where} names {'the node or set' if kind == 'nodes' else 'the set'} "
                            f"'{word}', which holds no {kind} of the file; correct the name.")
        return found

    def group_of(self, word: str, where: str, faces: bool = False) -> str:
        """Name of the group of a word; MeshError if there is none."""
        found = self.group(word, faces)
        if found is None:
            what = "a surface of element faces" if faces else "a surface or node set"
            raise MeshError(f"{where} names '{word}', which is not {what} of the file; correct the "
                            f"name.")
        return found

    def reference(self, word: str, where: str) -> tuple[str, Array]:
        """Name and place of the one node that a word names."""
        nodes = self.of(word, where)
        if len(nodes) != 1:
            raise MeshError(f"{where} needs one reference node, but '{word}' holds {len(nodes)} "
                            f"nodes.")
        return self.name_of(int(nodes[0]), word), self.place(int(nodes[0]))

    def name_of(self, node: int, word: str) -> str:
        """Name of the group of one node, which is made if there is none.

        A node that a deck gives by its number has the name of a set of this node alone, if any.
        """
        if node not in self.references:
            name = word
            if whole_number(word) is not None:
                name = next((group for group, nodes in self.groups.items()
                             if len(nodes) == 1 and nodes[0] == node), f"node {word}")
            self.references[node] = name
            self.groups.setdefault(name, np.array([node]))
        return self.references[node]

    def place(self, node: int) -> Array:
        """Place (d,) of a node in the unit of the file."""
        return self.places[node, :2] if self.planar else self.places[node]


def constraints_of(blocks: list[Block], names: Names) -> tuple[list[Constraint], list[str]]:
    """Constraints of the blocks of a deck, and the keywords that are not read.

    Nodes in terms of equations are those of the file.

    Raises
    ------
    MeshError
        For unknown nodes, sets and surfaces, missing data, and options that are not read.
    """
    found: list[Constraint] = []
    unread: list[str] = []
    for keyword, options, lines in blocks:
        if keyword == "TRANSFORM":
            _transform(options, lines, names)
    for number, (keyword, options, lines) in enumerate(blocks):
        for option in _REFUSED.get(keyword, ()):
            if option in options:
                raise MeshError(f"The line *{keyword} holds {option}, which is not read; leave it "
                                f"out, or give the constraint beside the file.")
        match keyword:
            case "TIE":
                found += _ties(options, lines, names)
            case "COUPLING":
                found.append(_coupling(options, blocks[number + 1 : number + 2], names))
            case "KINEMATIC COUPLING":
                found += _kinematic_coupling(options, lines, names)
            case "RIGID BODY":
                found += _rigid_body(options, names)
            case "EQUATION":
                found += _equations(lines, names)
            case "PRE-TENSION SECTION" if "SURFACE" not in options:
                unread.append(f"*{SECTION} without SURFACE")
            case "MPC":
                for line in lines:
                    more = _mpc(line, names)
                    found += more
                    unread += [] if more else [f"*MPC {words_of(line)[0]}"]
    return found, unread


def sections_of(
    blocks: list[Block], names: Names
) -> Iterator[tuple[str, str, list[float] | None]]:
    """Surface, control node and direction (None for the normal) of each section of a bolt.

    Raises
    ------
    MeshError
        For unknown nodes and surfaces, and a direction of another number of components.
    """
    for keyword, options, lines in blocks:
        if keyword != SECTION or "SURFACE" not in options:
            continue
        where = f"*{SECTION} of '{options['SURFACE']}'"
        if "NODE" not in options:
            raise MeshError(f"{where} has no control node; give NODE= on its line.")
        surface = names.group_of(options["SURFACE"], where, True)
        control, _ = names.reference(options["NODE"], where)
        values = [number_of(word, where) for line in lines for word in words_of(line)]
        if values and len(values) < (2 if names.planar else 3):
            raise MeshError(f"{where} has a direction of {len(values)} components; give all of "
                            f"them, or none.")
        yield surface, control, values[: 2 if names.planar else 3] or None


def words_of(line: str) -> list[str]:
    """Words of a data line that are not empty."""
    return [word for word in (part.strip() for part in line.split(",")) if word]


def number_of(word: str, where: str) -> float:
    """Number that a word is; MeshError, with ``where`` in front, if it is none."""
    try:
        return as_number(word)
    except ValueError:
        raise MeshError(f"{where} holds {shown(word)} in place of a number.") from None


def _ties(options: Options, lines: list[str], names: Names) -> Iterator[Tie]:
    name = options.get("NAME", "tie")
    tolerance = options.get("POSITION TOLERANCE")
    if not lines:
        raise MeshError(f"The tie '{name}' names no surfaces; give the dependent and the "
                        f"independent one below *TIE.")
    for line in lines:
        words, where = words_of(line), f"The tie '{name}'"
        if len(words) < 2:
            raise MeshError(f"{where} has the line {shown(line)}; give the dependent and the "
                            f"independent surface.")
        yield Tie(names.group_of(words[0], where), names.group_of(words[1], where, True),
                  None if tolerance is None else number_of(tolerance, where), name)


def _coupling(options: Options, following: list[Block], names: Names) -> Coupling:
    name = options.get("CONSTRAINT NAME", "coupling")
    where = f"The coupling '{name}'"
    if not following or following[0][0] not in ("KINEMATIC", "DISTRIBUTING"):
        raise MeshError(f"{where} has neither a line *KINEMATIC nor *DISTRIBUTING after it; add "
                        f"one.")
    for option in ("REF NODE", "SURFACE"):
        if option not in options:
            raise MeshError(f"{where} has no {option.lower()}; give {option}= on its line.")
    kind, more, lines = following[0]
    reference, place = names.reference(options["REF NODE"], where)
    nodes = names.group_of(options["SURFACE"], where)
    if kind == "KINEMATIC":
        return Coupling(nodes, reference, tuple(place), axes=_axes(lines, where, names), name=name)
    if more.get("WEIGHTING METHOD", "UNIFORM").upper() != "UNIFORM":
        raise MeshError(f"{where} has WEIGHTING METHOD={more['WEIGHTING METHOD']}, which is not "
                        f"read; write UNIFORM.")
    return Coupling(nodes, reference, tuple(place), "distributing", name=name)


def _axes(lines: list[str], where: str, names: Names) -> list[list[float]] | None:
    """Directions (k, d) of the degrees of freedom first, last of each line; None for all."""
    d = 2 if names.planar else 3
    held: set[int] = set()
    for line in lines:
        words = [int(number_of(word, where)) for word in words_of(line)]
        held |= set(range(words[0], words[-1] + 1)) if words else set()
    chosen = [axis for axis in range(d) if axis + 1 in held]
    if held and not chosen:
        raise MeshError(f"{where} holds rotations alone, which the nodes of these elements do not "
                        f"have; give the degrees of freedom 1 to {d}.")
    return np.eye(d)[chosen].tolist() if held and len(chosen) < d else None


def _kinematic_coupling(
    options: Options, lines: list[str], names: Names
) -> Iterator[Coupling]:
    where = "*KINEMATIC COUPLING"
    if "REF NODE" not in options:
        raise MeshError(f"{where} has no ref node; give REF NODE= on its line.")
    reference, place = names.reference(options["REF NODE"], where)
    for line in lines:
        word, *numbers = words_of(line)
        yield Coupling(_node_group(word, where, names), reference, tuple(place),
                       axes=_axes([",".join(numbers)], where, names), name=word)


def _node_group(word: str, where: str, names: Names) -> str:
    """Name of the group of nodes of a set or of a number."""
    found = names.group(word, False)
    return names.name_of(int(names.of(word, where)[0]), word) if found is None else found


def _rigid_body(options: Options, names: Names) -> Iterator[Coupling]:
    where = "*RIGID BODY"
    if "REF NODE" not in options:
        raise MeshError(f"{where} has no ref node; give REF NODE= on its line.")
    reference, place = names.reference(options["REF NODE"], where)
    for option in ("ELSET", "NSET", "PIN NSET", "TIE NSET"):
        if option in options:
            word = options[option]
            group = f"{word} of rigid body"
            kind = "elements" if option == "ELSET" else "nodes"
            names.groups.setdefault(group, names.of(word, where, kind))
            yield Coupling(group, reference, tuple(place), name=f"rigid body {word}")


def _mpc(line: str, names: Names) -> list[Constraint]:
    """Constraints of one line; none for a kind that is not read."""
    words, where = words_of(line), f"The line {shown(line)} below *MPC"
    if words[0].upper() not in _MPC:
        return []
    if len(words) != 3:
        raise MeshError(f"{where} must name a node or set, and the node or set that it follows.")
    pairs = _paired([names.of(word, where) for word in words[1:]], words[1:], where, names)
    found: list[Constraint] = []
    for number, (first, second) in enumerate(pairs):
        if words[0].upper() == "BEAM":
            single = f"{words[1]} {number + 1} of MPC" if len(pairs) > 1 else words[1]
            other = f"{words[2]} {number + 1} of MPC" if len(pairs) > 1 else words[2]
            found.append(Coupling(names.name_of(first, single), names.name_of(second, other),
                                  tuple(names.place(second)), name=f"MPC {single}"))
            continue
        found += [LinearEquation(tuple(term_of(node, dof, sign, names)
                                       for node, sign in ((first, 1.0), (second, -1.0))),
                                 f"MPC {words[1]}") for dof in range(1, 3 if names.planar else 4)]
    return found


def _paired(
    sets: list[Integers], words: list[str], where: str, names: Names
) -> list[tuple[int, ...]]:
    """Nodes of several sets, one by one; a set of one node goes with all."""
    sizes = {len(nodes) for nodes in sets} - {1}
    if len(sizes) > 1:
        raise MeshError(f"{where} names sets of {' and '.join(map(str, sorted(sizes)))} nodes; "
                        f"give sets of one size, or of one node.")
    if sizes and any(word.upper() in names.unsorted for word in words):
        raise MeshError(f"{where} names a set that is UNSORTED, which is not read; write one line "
                        f"for each pair of nodes.")
    count = max(sizes, default=1)
    return [tuple(int(nodes[k if len(nodes) > 1 else 0]) for nodes in sets) for k in range(count)]


def _equations(lines: list[str], names: Names) -> Iterator[LinearEquation]:
    words = [word for line in lines for word in words_of(line)]
    at = 0
    while at < len(words):
        count = whole_number(words[at])
        given = words[at + 1 : at + 1 + 3 * (count or 0)]
        where = f"An *EQUATION that begins with {shown(', '.join(words[at : at + 4]))}"
        if not count or count < 0 or len(given) < 3 * count:
            raise MeshError(f"{where} must hold its number of terms and, for each, node or set, "
                            f"degree of freedom and coefficient.")
        at += 1 + 3 * count
        dofs = [int(number_of(word, where)) for word in given[1::3]]
        factors = [number_of(word, where) for word in given[2::3]]
        if not set(dofs) <= ({1, 2, 6} if names.planar else set(range(1, 7))):
            raise MeshError(f"{where} names the degree of freedom "
                            f"{max(dofs)}; these are 1 to 3 and, of reference nodes, 4 to 6.")
        for nodes in _paired([names.of(word, where) for word in given[::3]], given[::3], where,
                             names):
            yield LinearEquation(
                tuple(term_of(node, dof, factor, names)
                      for node, dof, factor in zip(nodes, dofs, factors, strict=True)),
                f"of {', '.join(given[::3])}")


def term_of(node: int, dof: int, factor: float, names: Names) -> Term:
    """One term, along local axes where *TRANSFORM gives them."""
    d = 2 if names.planar else 3
    axes = names.axes.get(node, np.eye(3))
    direction = factor * axes[(dof - 1) % 3]
    if dof <= 3:
        return Term(node, tuple(direction[:d].tolist()))
    return Term(node, (0.0,) * d, (factor,) if names.planar else tuple(direction.tolist()))


def _transform(options: Options, lines: list[str], names: Names) -> None:
    """Local axes of the nodes of a set."""
    where = "*TRANSFORM"
    kind = options.get("TYPE", "R").upper()
    values = [number_of(word, where) for line in lines for word in words_of(line)]
    if kind not in ("R", "C") or len(values) != 6 or "NSET" not in options:
        raise MeshError(f"{where} must give NSET=, TYPE=R or C, and six coordinates of two points; "
                        f"others are not read.")
    a, b = np.array(values[:3]), np.array(values[3:])
    for node in names.of(options["NSET"], where).tolist():
        first, second = a, b
        if kind == "C":  # r, theta, z about the line from a to b
            along = (b - a) / np.linalg.norm(b - a)
            arm = names.places[node] - a
            first = arm - (arm @ along) * along
            second = np.cross(along, first)
        third = np.cross(first, second)
        if not np.linalg.norm(third) > 1e-9 * np.linalg.norm(first) * np.linalg.norm(second):
            raise MeshError(f"{where} of the set '{options['NSET']}' spans no local axes; give two "
                            f"points off one line.")
        first, third = first / np.linalg.norm(first), third / np.linalg.norm(third)
        names.axes[node] = np.array([first, np.cross(third, first), third])
