"""Equations between displacements, of hinges and constraints: rows of ``C u = 0``."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fecontact.core.errors import MeshError, ModelWarning
from fecontact.core.types import Array, Integers
from fecontact.fem.constraints import (
    Constraint,
    Coupling,
    LinearEquation,
    Tie,
    reference_place,
    reference_points,
)
from fecontact.fem.faces.facets import Facets
from fecontact.fem.faces.mean_motion import mean_motion
from fecontact.fem.mesh import Mesh
from fecontact.fem.supports import HingeSupport, held_components

_REACH = 0.05  # of a facet


class _Body(Protocol):
    """Parts of an elastic body that its equations need."""

    @property
    def mesh(self) -> Mesh: ...
    @property
    def nodes(self) -> Array: ...
    @property
    def fixed(self) -> Mapping[str, str]: ...
    @property
    def fixed_dofs(self) -> Integers: ...
    @property
    def hinges(self) -> list[HingeSupport]: ...
    @property
    def equations(self) -> Sequence[Constraint]: ...
    def facet_nodes(self, facets: Integers) -> Integers: ...
    def edge_nodes(self, edges: Integers) -> Integers: ...
    def group_nodes(self, name: str) -> Integers: ...


@dataclass(frozen=True, eq=False)
class Equations:
    """Rows C (m, n), sparse, of ``C u = 0``.

    ``dependent`` (m,) is the unknown that each row determines. Rows that are ``strict`` determine
    no other one.
    """

    matrix: Any
    dependent: Integers
    name: str
    strict: bool = True


class Unknowns:
    """Numbers of unknowns: displacements, angles of hinges, then motions of reference points.

    Attributes
    ----------
    angles : int
        Number of displacements, after which the angles follow.
    motions : dict of name to (integer array, integer array)
        Displacements and rotations of each reference point.
    held : integer array
        Unknowns that supports hold at zero.
    """

    def __init__(self, body: _Body) -> None:
        self.body = body
        self.d = body.nodes.shape[1]
        self.turns = 3 if self.d == 3 else 1
        self.angles = body.nodes.size
        points = body.mesh.points
        first = self.angles + len(body.hinges)
        self.motions: dict[str, tuple[Integers, Integers]] = {}
        for name in reference_points(body.equations, points):
            if len(points.get(name, ())) == 1:  # a node with rotations of its own
                shift = self.d * int(points[name][0]) + np.arange(self.d)
            else:
                shift = first + np.arange(self.d)
                first += self.d
            self.motions[name] = shift, first + np.arange(self.turns)
            first += self.turns
        self.count = first
        held = [body.fixed_dofs]
        for name, kind in body.fixed.items():
            if name in self.motions:
                both = np.concatenate(self.motions[name])
                held.append(both[list(held_components(self.d, name, kind))])
        self.held = np.unique(np.concatenate(held))

    def of_node(self, node: int | tuple[int, int]) -> list[Integers]:
        """Displacements of a node, or of the nodes whose mean is the middle of an edge."""
        nodes = np.atleast_1d(node)
        if len(nodes) == 2:
            self.body.mesh.edge_numbers(nodes[None], "constraints")
            nodes = self.body.edge_nodes(nodes[None])[0]
            nodes = nodes[1:2] if len(nodes) == 3 else nodes
        return [self.d * one + np.arange(self.d) for one in nodes]

    def place(self, name: str) -> Array:
        """Place (d,) of a reference point with one."""
        points = self.body.mesh.points
        if len(points.get(name, ())) == 1:
            return np.asarray(self.body.mesh.nodes[points[name][0]])
        return np.array(reference_place(self.body.equations, name))

    def rows(self, rows: Any, columns: Any, values: Any, count: int) -> Any:
        """Sparse rows (count, n)."""
        import scipy.sparse as sp

        found = sp.csr_array(sp.coo_array(
            (np.ravel(values), (np.ravel(rows), np.ravel(columns))), shape=(count, self.count)))
        found.eliminate_zeros()
        return found

    def describe(self, unknown: int) -> str:
        """Direction and place of an unknown, for messages."""
        if unknown < self.angles:
            node = unknown // self.d
            where = ", ".join(f"{x:g}" for x in self.body.nodes[node])
            mesh = self.body.mesh
            which = mesh.node_name(node) if node < len(mesh.nodes) else "the node between others"
            return f"the displacement in {'xyz'[unknown % self.d]} of {which} at ({where})"
        for name, (shift, turns) in self.motions.items():
            if unknown in shift or unknown in turns:
                kind = "displacement" if unknown in shift else "rotation"
                return f"the {kind} of the reference point '{name}'"
        return "the angle of a hinge"


def hinge_equations(unknowns: Unknowns) -> Iterator[Equations]:
    """U = angle axis x arm of the nodes of each hinge."""
    d = unknowns.d
    for index, (around, centre, axis) in enumerate(unknowns.body.hinges):
        arm = unknowns.body.nodes[around] - centre
        swept = (np.column_stack([-arm[:, 1], arm[:, 0]]) if d == 2 else np.cross(axis, arm))
        dependent = (d * around[:, None] + np.arange(d)).ravel()
        own = np.arange(len(dependent))
        columns = [dependent, np.full(len(own), unknowns.angles + index)]
        yield Equations(unknowns.rows([own, own], columns, [np.ones(len(own)), -swept.ravel()],
                                      len(own)), dependent, HINGE)


HINGE = "a hinge"


def constraint_equations(unknowns: Unknowns) -> Iterator[Equations]:
    """Rows of all constraints of a body."""
    for one in unknowns.body.equations:
        name = f"{type(one).__name__} '{one.name}'"
        if isinstance(one, Tie):
            yield _tied(unknowns, one, name)
        elif isinstance(one, LinearEquation):
            yield _equation(unknowns, one, name)
        elif one.kind == "kinematic":
            yield _kinematic(unknowns, one, name)
        else:
            yield _distributing(unknowns, one, name)


def _equation(unknowns: Unknowns, one: LinearEquation, name: str) -> Equations:
    columns: list[Integers] = []
    values: list[Array] = []
    for at, displacement, rotation in one.terms:
        shifts, turns = ([unknowns.motions[at][0]], unknowns.motions[at][1]) if (
            at in unknowns.motions) else (unknowns.of_node(
                int(unknowns.body.mesh.points[at][0]) if isinstance(at, str) else at), None)
        columns += shifts
        values += [np.asarray(displacement) / len(shifts)] * len(shifts)
        if len(rotation) and turns is not None:
            columns.append(turns)
            values.append(np.asarray(rotation, float))
    first = columns[0][np.argmax(np.abs(values[0]))] if np.any(values[0]) else None
    where, what = np.concatenate(columns), np.concatenate(values)
    return Equations(unknowns.rows(np.zeros(len(where), int), where, what, 1),
                     np.array([where[np.argmax(np.abs(what))] if first is None else first]), name,
                     False)


def _kinematic(unknowns: Unknowns, one: Coupling, name: str) -> Equations:
    """Axes . (u_i - u - phi x r_i) = 0."""
    from scipy.linalg import qr

    d, body = unknowns.d, unknowns.body
    shift, turns = unknowns.motions[one.reference]
    nodes = body.group_nodes(one.nodes)
    nodes = nodes[d * nodes != shift[0]]
    axes = np.eye(d) if one.axes is None else np.asarray(one.axes, float)
    if one.axes is not None:
        # Each row gets one direction of its own to determine.
        own = np.sort(qr(axes, pivoting=True)[2][:len(axes)])
        axes = np.linalg.solve(axes[:, own], axes)
    else:
        own = np.arange(d)
    arm = body.nodes[nodes] - unknowns.place(one.reference)
    if d == 2:
        swept = np.stack([-arm[:, 1], arm[:, 0]], axis=1)[:, :, None]
    else:
        swept = -np.cross(arm[:, :, None], np.eye(3), axisa=1, axisb=0, axisc=1)
    count, k = len(nodes), len(axes)
    values = np.concatenate([np.broadcast_to(axes, (count, k, d)),
                             np.broadcast_to(-axes, (count, k, d)), -axes @ swept], axis=2)
    columns = np.concatenate([
        d * nodes[:, None] + np.arange(d), np.broadcast_to(shift, (count, d)),
        np.broadcast_to(turns, (count, len(turns)))], axis=1)
    return Equations(
        unknowns.rows(np.repeat(np.arange(count * k), values.shape[2]),
                      np.repeat(columns[:, None], k, axis=1), values, count * k),
        (d * nodes[:, None] + own).ravel(), name)


def _distributing(unknowns: Unknowns, one: Coupling, name: str) -> Equations:
    """Mean motion of nodes as that of a reference point."""
    import scipy.sparse as sp

    d, body = unknowns.d, unknowns.body
    shift, turns = unknowns.motions[one.reference]
    nodes, weights = _weighted_nodes(body, one)
    mean, centre = mean_motion(len(body.nodes), nodes, body.nodes[nodes], weights)
    arm = unknowns.place(one.reference) - centre
    swept = (np.array([[-arm[1]], [arm[0]]]) if d == 2
             else -np.cross(arm, np.eye(3), axisb=0, axisc=0))
    rows = sp.csr_array(mean[:d] + sp.csr_array(swept) @ mean[d:])
    rows = sp.coo_array(sp.vstack([rows, mean[d:]]))
    dependent = np.concatenate([shift, turns])
    own = np.arange(len(dependent))
    return Equations(
        unknowns.rows(np.concatenate([own, rows.row]), np.concatenate([dependent, rows.col]),
                      np.concatenate([np.ones(len(own)), -rows.data]), len(own)), dependent, name,
        False)


def _weighted_nodes(body: _Body, one: Coupling) -> tuple[Integers, Array]:
    """Nodes of a coupling and their weights, by default shares of length or area, or equal ones."""
    name = one.nodes
    if one.weights is not None:
        return np.asarray(body.mesh.points[name]), np.array(one.weights)
    nodes = body.group_nodes(name)
    if name not in body.mesh.boundaries:
        return nodes, np.ones(len(nodes))
    face = facets_of_boundary(body, name)
    weights = np.zeros(len(body.nodes))
    np.add.at(weights, face.nodes, face.shape_integrals)
    return nodes, weights[nodes]


def facets_of_boundary(body: _Body, boundary: str) -> Facets:
    """Facets of a named boundary of a body."""
    facets = body.facet_nodes(body.mesh.boundaries[boundary])
    if body.nodes.shape[1] == 2:
        # Ends before the middle.
        facets = facets[:, [0, -1, *range(1, facets.shape[1] - 1)]]
    return Facets(body.nodes, facets)


def _tied(unknowns: Unknowns, one: Tie, name: str) -> Equations:
    d, body = unknowns.d, unknowns.body
    face = facets_of_boundary(body, one.independent)
    facets = face.nodes
    nodes = np.setdiff1d(body.group_nodes(one.dependent), facets)
    reach = one.tolerance or _REACH * float((face.shape_integrals.sum(axis=1) ** (1 / (d - 1))
                                             ).mean())
    facet, local, distance = face.closest(body.nodes[nodes])
    near = distance <= reach
    if not near.any():
        least = f"{distance.min():.4g} m away" if len(nodes) else "none, they share all nodes"
        raise MeshError(f"{name}: no node of '{one.dependent}' lies within tolerance = {reach:.4g} "
                        f"m of '{one.independent}', the closest is {least}; give faces that touch, "
                        f"or a larger tolerance.")
    if not near.all():
        where = ", ".join(f"{x:g}" for x in body.nodes[nodes[~near][0]])
        warnings.warn(f"{name}: {np.count_nonzero(~near)} of {len(nodes)} nodes of "
                      f"'{one.dependent}' lie farther than tolerance = {reach:.4g} m from "
                      f"'{one.independent}' and are left out, the first at ({where}).",
                      ModelWarning, stacklevel=2)
    nodes, facet, local = nodes[near], facet[near], local[near]
    weights = face.following(body.nodes[nodes], facet, local)
    count, k = weights.shape[:2]
    own = (d * nodes[:, None] + np.arange(d)).ravel()
    columns = d * facets[facet][:, None, :, None] + np.arange(d)
    columns = np.broadcast_to(columns, (count, d, k, d))
    each = np.arange(count * d)
    parts = [(each, own, np.ones(count * d)),
             (np.repeat(each, k * d), columns.ravel(), -np.swapaxes(weights, 1, 2).ravel())]
    if one.control is not None:
        nearer = np.full(count * d, unknowns.motions[one.control][0][0])
        parts.append((each, nearer, -np.tile(np.asarray(one.direction), count)))
    rows, columns, values = map(np.concatenate, zip(*parts, strict=True))
    return Equations(unknowns.rows(rows, columns, values, count * d), own, name)
