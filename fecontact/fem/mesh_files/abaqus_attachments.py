"""Masses, springs and dashpots at nodes of Abaqus and CalculiX decks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.fem.attachments import Attachment, PointMass, PointSpring
from fecontact.fem.constraints import Term
from fecontact.fem.mesh_files.abaqus_constraints import Names, number_of, term_of, words_of
from fecontact.fem.mesh_files.abaqus_keywords import Options

# Types of elements with one or two nodes that each keyword gives values to.
TYPES = {"MASS": ("MASS",), "ROTARY INERTIA": ("ROTARYI",),
         "SPRING": ("SPRING1", "SPRING2", "SPRINGA"),
         "DASHPOT": ("DASHPOT1", "DASHPOT2", "DASHPOTA")}
# Options that change what a keyword means.
_REFUSED = {"MASS": ("TYPE", "ORIENTATION"), "ROTARY INERTIA": ("ORIENTATION",),
            "SPRING": ("NONLINEAR", "COMPLEX STIFFNESS", "ORIENTATION", "DEPENDENCIES"),
            "DASHPOT": ("NONLINEAR", "ORIENTATION", "DEPENDENCIES")}


@dataclass(frozen=True)
class PointElement:
    """An element of a mass, a spring or a dashpot.

    Attributes
    ----------
    type : str
        In capitals.
    number : int
    nodes : tuple of str
        Words of its nodes.
    """

    type: str
    number: int
    nodes: tuple[str, ...]


def is_point_element(element_type: str) -> bool:
    """Whether elements of a type in capitals are masses, springs or dashpots."""
    return any(element_type in types for types in TYPES.values())


def refused(keyword: str, options: Options, elements: Sequence[PointElement]) -> str:
    """Words of a block that is not read, of its kind or without elements; empty if it is read."""
    given = [option for option in _REFUSED[keyword] if option in options and options[option] != (
        "ISOTROPIC")]
    if not elements:
        given = [f"a set '{options.get('ELSET', '')}' without elements"]
    return f"*{keyword} with {given[0]}" if given else ""


def attachments_of(
    keyword: str, options: Options, lines: list[str], elements: Sequence[PointElement],
    names: Names,
) -> Iterator[Attachment]:
    """Masses and springs of one block, whose places are nodes of the file.

    Raises
    ------
    MeshError
        For data that are missing or no numbers, elements of another type, and unknown nodes.
    """
    where = f"*{keyword} of the set '{options.get('ELSET', '')}'"
    for one in elements:
        if one.type not in TYPES[keyword]:
            raise MeshError(f"{where} holds the element {one.number} of type {one.type}; its types "
                            f"are {', '.join(TYPES[keyword])}.")
        nodes = [int(names.of(word, where)[0]) for word in one.nodes]
        if len(nodes) != 1 + (one.type[-1] in "2A"):
            raise MeshError(f"{where} holds the element {one.number} with {len(nodes)} nodes; the "
                            f"type {one.type} has {1 + (one.type[-1] in '2A')}.")
        name = f"of element {one.number}"
        if keyword == "MASS":
            yield PointMass(nodes[0], _values(lines, where, 1)[0], name=name)
        elif keyword == "ROTARY INERTIA":
            J = (*_values(lines, where, 3 - 2 * names.planar), 0.0, 0.0, 0.0)
            yield PointMass(nodes[0], inertia=J[0] if names.planar else J[:6], name=name)
        else:
            terms = _terms(one.type[-1], lines, nodes, where, names)
            value = _values(lines[-1:], where, 1)[0]
            yield PointSpring(terms, **{"stiffness" if keyword == "SPRING" else "damping": value},
                              name=name)


def _values(lines: list[str], where: str, least: int) -> list[float]:
    """Numbers of all data lines."""
    found = [number_of(word, where) for line in lines for word in words_of(line)]
    if len(found) < least:
        raise MeshError(f"{where} has {len(found)} of at least {least} numbers; add them.")
    return found


def _terms(
    kind: str, lines: list[str], nodes: list[int], where: str, names: Names
) -> tuple[Term, ...]:
    """Elongation of a spring along degrees of freedom, or along the line between its nodes."""
    if kind == "A":
        first, second = (names.place(node) for node in nodes)
        length = float(np.linalg.norm(second - first))
        if not length > 0.0:
            raise MeshError(f"{where} has a spring between two nodes at one place; give it two "
                            f"degrees of freedom, by another type.")
        along = (second - first) / length
        return (Term(nodes[1], tuple(along.tolist())), Term(nodes[0], tuple((-along).tolist())))
    dofs = [int(one) for one in _values(lines[:1], where, len(nodes))[: len(nodes)]]
    most = {1, 2, 6} if names.planar else set(range(1, 7))
    if len(lines) < 2 or not set(dofs) <= most:
        raise MeshError(f"{where} must give the degree of freedom of each node, 1 to 3 and of "
                        f"reference nodes 4 to 6, and on the next line the value.")
    return tuple(term_of(node, dof, sign, names)
                 for node, dof, sign in zip(nodes, dofs, (1.0, -1.0), strict=False))
