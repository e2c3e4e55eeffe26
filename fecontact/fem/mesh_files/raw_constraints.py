"""Constraints of a file in the numbering and the unit of its mesh."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from fecontact.core.errors import MeshError, ModelWarning
from fecontact.core.types import Array, Integers
from fecontact.core.units import count
from fecontact.fem.constraints import Constraint, Coupling, LinearEquation, Term, Tie


class _Raw(Protocol):
    """The contents of a file that constraints refer to."""

    constraints: list[Constraint]
    nodes: dict[str, Integers]
    chosen: str


def constraints_of_mesh(
    raw: _Raw, boundaries: Mapping[str, Integers], points: Mapping[str, Integers],
    number: Integers, middles: Mapping[int, tuple[int, int]], places: Array, scale: float,
) -> tuple[Constraint, ...]:
    """Constraints between the nodes of a mesh.

    Parameters
    ----------
    raw : RawMesh
        Contents of the file.
    boundaries, points
        Groups of the mesh.
    number : (N,) integer array
        Node of the mesh of each node of the file, -1 for none.
    middles : mapping
        Corners, in the mesh, of the edge on which a second-order node of the file lies.
    places : (N, d) array
        Of the nodes of the file [m]; not finite for those of other parts.
    scale : float
        Metres per unit of the file.

    Raises
    ------
    MeshError
        For a constraint of nodes or faces that are not on the body.

    Warns
    -----
    ModelWarning
        For constraints that reach beyond the part that was chosen.
    """
    found, dropped = [], []
    free = {int(nodes[0]): name for name, nodes in raw.nodes.items()
            if len(nodes) == 1 and number[nodes[0]] < 0 and int(nodes[0]) not in middles}
    for one in raw.constraints:
        if isinstance(one, LinearEquation):
            terms = [_term(term, number, middles, places, free, scale) for term in one.terms]
            missing = "a node of another part" if None in terms else ""
            own: Any = None if missing else replace(one, terms=tuple(
                term for term in terms if term is not None))
        else:
            missing, own = _missing(one, boundaries, points), one.scaled(scale)
        if not missing:
            found.append(own)
        elif raw.chosen:
            dropped.append(one.name)
        else:
            raise MeshError(f"{type(one).__name__} '{one.name}' needs {missing}, of which the "
                            f"body has none; correct the set or surface.")
    if dropped:
        one_alone = len(dropped) == 1
        warnings.warn(f"{count(len(dropped), 'constraint')} reach{'es' * one_alone} beyond the "
                      f"part '{raw.chosen}' and {'is' if one_alone else 'are'} left out, the first "
                      f"is '{dropped[0]}'.", ModelWarning, stacklevel=4)
    return tuple(_useful(found, points))


def _missing(
    one: Tie | Coupling, boundaries: Mapping[str, Integers], points: Mapping[str, Integers]
) -> str:
    """Nodes or faces of a constraint that the mesh lacks, in words; else empty."""
    name = one.nodes if isinstance(one, Coupling) else one.dependent
    if name not in boundaries and name not in points:
        return f"nodes of '{name}'"
    if isinstance(one, Tie) and one.independent not in boundaries:
        return f"faces of '{one.independent}' on the outline"
    return ""


def _term(
    term: Term, number: Integers, middles: Mapping[int, tuple[int, int]], places: Array,
    free: Mapping[int, str], scale: float,
) -> Term | None:
    """Term with a node of the mesh, the ends of an edge, or the name of a reference point."""
    node = term.at
    assert isinstance(node, int)
    at: Any = int(number[node])
    if at < 0:
        at = middles.get(node)
    if at is None:
        if not np.isfinite(places[node]).all():
            return None
        at = free.get(node, f"node {node}")
    return Term(at, term.displacement, tuple(scale * one for one in term.rotation))


def _useful(
    constraints: Sequence[Constraint], points: Mapping[str, Integers]
) -> list[Constraint]:
    """Constraints without equations of a free node that no other constraint names."""
    uses: dict[str, int] = {}
    for one in constraints:
        for name in {*one.groups} if not isinstance(one, Tie) else ():
            uses[name] = uses.get(name, 0) + (2 if isinstance(one, Coupling) else 1)
    return [one for one in constraints if not isinstance(one, LinearEquation)
            or all(name in points or uses[name] > 1 for name in one.groups)]
