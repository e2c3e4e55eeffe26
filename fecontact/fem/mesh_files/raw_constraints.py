"""Constraints and attachments of a file in the numbering and the unit of its mesh."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from fecontact.core.errors import MeshError, ModelWarning
from fecontact.core.types import Array, Integers
from fecontact.core.units import count
from fecontact.fem.attachments import Attachment, PointMass
from fecontact.fem.constraints import (
    Constraint,
    Coupling,
    LinearEquation,
    Term,
    Tie,
    reference_points,
)


class _Raw(Protocol):
    """The contents of a file that constraints refer to."""

    constraints: list[Constraint]
    attachments: list[Attachment]
    nodes: dict[str, Integers]
    chosen: str


def constraints_of_mesh(
    raw: _Raw, boundaries: Mapping[str, Integers], points: Mapping[str, Integers],
    number: Integers, middles: Mapping[int, tuple[int, int]], places: Array, scale: float,
) -> tuple[tuple[Constraint, ...], tuple[Attachment, ...]]:
    """Constraints between the nodes of a mesh, and masses and springs at them.

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
        Places of the nodes of the file [m]; not finite for those of other parts.
    scale : float
        Metres per unit of the file.

    Raises
    ------
    MeshError
        For a constraint of nodes or faces that are not on the body.

    Warns
    -----
    ModelWarning
        For constraints and attachments that reach beyond the part that was chosen, and for
        attachments at nodes that belong to nothing.
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
            if isinstance(own, Coupling) and own.weights is not None:
                own = _weighted(own, raw.nodes[own.nodes], number, middles)
        if not missing:
            found.append(own)
        elif raw.chosen:
            dropped.append(one.name)
        else:
            raise MeshError(f"{type(one).__name__} '{one.name}' needs {missing}, of which the "
                            f"body has none; correct the set or surface.")
    kept = _useful(found, points)
    fixed = _attached(raw, kept, points, number, middles, places, scale)
    if raw.chosen:
        dropped += [one.name for one in raw.attachments if one.name not in {
            each.name for each in fixed}]
    if dropped:
        one_alone = len(dropped) == 1
        warnings.warn(f"{count(len(dropped), 'constraint')} reach{'es' * one_alone} beyond the "
                      f"part '{raw.chosen}' and {'is' if one_alone else 'are'} left out, the first "
                      f"is '{dropped[0]}'.", ModelWarning, stacklevel=4)
    return tuple(kept), tuple(fixed)


def _attached(
    raw: _Raw, constraints: Sequence[Constraint], points: Mapping[str, Integers],
    number: Integers, middles: Mapping[int, tuple[int, int]], places: Array, scale: float,
) -> list[Attachment]:
    """Attachments at nodes of the mesh and at reference points of its constraints."""
    known = {name: name for name in reference_points(constraints, points)}
    # Nodes of the mesh that have rotations as reference points of couplings.
    turning = {int(points[name][0]): name for name in known if len(points.get(name, ())) == 1}
    free = {int(nodes[0]): name for name, nodes in raw.nodes.items() if len(nodes) == 1}

    def at(node: Any) -> Any:
        place: Any = int(number[node])
        if place >= 0:
            return turning.get(place, place)
        return middles.get(node, known.get(free.get(node, f"node {node}")))

    found: list[Attachment] = []
    lost = 0
    for one in raw.attachments:
        nodes: list[Any] = ([one.at] if isinstance(one, PointMass)
                            else [term.at for term in one.terms])
        ends = [at(node) for node in nodes]
        if None in ends:
            lost += all(np.isfinite(places[node]).all() for node in nodes)
            continue
        own = one.scaled(scale)
        found.append(replace(own, at=ends[0]) if isinstance(own, PointMass) else replace(
            own, terms=tuple(term._replace(at=end)
                             for term, end in zip(own.terms, ends, strict=True))))
    if lost:
        warnings.warn(f"{count(lost, 'mass or spring')} {'is' if lost == 1 else 'are'} at nodes "
                      f"that belong to no element, coupling or rigid body, and left out; model "
                      f"them as bodies of their own, by point_masses.", ModelWarning, stacklevel=5)
    return found


def _weighted(
    one: Coupling, rows: Integers, number: Integers, middles: Mapping[int, tuple[int, int]]
) -> Coupling:
    """Coupling whose weights, of nodes of the file in ``rows``, follow the nodes of the mesh."""
    if any(int(row) in middles for row in rows):
        raise MeshError(f"The coupling '{one.name}' has different weights and names nodes in the "
                        f"middles of edges, which is not read; write one weight for all its "
                        f"points.")
    nodes, place = np.unique(number[rows], return_inverse=True)
    weights = np.bincount(place.ravel(), one.weights)
    return replace(one, weights=tuple(weights[nodes >= 0].tolist()))


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
