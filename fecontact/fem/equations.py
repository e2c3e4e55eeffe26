"""Equations between displacements, of supports and constraints, and their elimination.

All displacements u follow from independent unknowns q, u = G q, with K_r = G^T K G and
M_r = G^T M G. Each equation determines one unknown; chains are resolved by substitution.
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, MeshError, ModelWarning
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

# Largest coefficient, relative to that of an equation, of what earlier equations imply.
_IMPLIED = 1e-7
# Eigenvalue, relative to the largest, of motions of reference points that move no node.
_UNSEEN = 1e-12
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


@dataclass(frozen=True, eq=False)
class Elimination:
    """All unknowns from those that are left where equations are substituted into each other.

    Attributes
    ----------
    matrix : sparse (n, p) array
        G: displacements, angles of hinges and motions of reference points from the p left.
    numbers : (p,) integers
        Number of each of these among all n.
    rest : sparse (m, p) array
        Rows R of the equations ``R p = 0`` between them, each with a largest coefficient of one:
        those that substitution does not solve, mostly of many unknowns.
    displacements : int
        Number of displacements, the first of the n unknowns.
    """

    matrix: Any
    numbers: Integers
    rest: Any
    displacements: int

    @cached_property
    def expansion(self) -> Any:
        """Displacements from independent unknowns, sparse (d N, f), which meet ``R p = 0`` too.

        They are displacements without a support or a constraint, then one angle per hinge, then
        displacements and rotations of reference points.
        """
        return self._independent[0]

    @property
    def spread(self) -> Any:
        """The p unknowns from the independent ones, sparse (p, f)."""
        return self._independent[1]

    @cached_property
    def _independent(self) -> tuple[Any, Any]:
        import scipy.sparse as sp

        G = sp.csr_array(self.matrix[:self.displacements])
        Z, numbers = sp.eye_array(len(self.numbers), format="csr"), self.numbers
        if self.rest.shape[0]:
            Z, kept = _null_space(self.rest)
            G, numbers = G @ Z, numbers[kept]
        turn = _seen(sp.csc_array(G), np.flatnonzero(numbers >= self.displacements))
        if turn is None:
            return sp.csc_array(G), sp.csr_array(Z)
        return sp.csc_array(G @ turn), sp.csr_array(Z @ turn)


def eliminated(body: _Body) -> Elimination:
    """Equations of supports and constraints, substituted into each other.

    Raises
    ------
    InputError
        For constraints that determine the same displacement in different ways.
    MeshError
        For a tie none of whose nodes are near its face.

    Warns
    -----
    ModelWarning
        For nodes of a tie that are not near its face.
    """
    unknowns = Unknowns(body)
    found = [*_hinge_equations(unknowns), *constraint_equations(unknowns)]
    return _substituted_equations(unknowns, found)


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


def _hinge_equations(unknowns: Unknowns) -> Iterator[Equations]:
    """U = angle axis x arm of the nodes of each hinge."""
    d = unknowns.d
    for index, (around, centre, axis) in enumerate(unknowns.body.hinges):
        arm = unknowns.body.nodes[around] - centre
        swept = (np.column_stack([-arm[:, 1], arm[:, 0]]) if d == 2 else np.cross(axis, arm))
        dependent = (d * around[:, None] + np.arange(d)).ravel()
        own = np.arange(len(dependent))
        columns = [dependent, np.full(len(own), unknowns.angles + index)]
        yield Equations(unknowns.rows([own, own], columns, [np.ones(len(own)), -swept.ravel()],
                                      len(own)), dependent, _HINGE)


_HINGE = "a hinge"


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


def _substituted_equations(unknowns: Unknowns, found: Sequence[Equations]) -> Elimination:
    import scipy.sparse as sp

    free = np.ones(unknowns.count, bool)
    free[unknowns.held] = False
    if not found:
        return Elimination(sp.csr_array(sp.eye_array(unknowns.count, format="csc")[:, free]),
                           np.flatnonzero(free), sp.csr_array((0, np.count_nonzero(free))),
                           unknowns.angles)
    ordered = sorted(found, key=lambda one: not one.strict)
    C = sp.csr_array(sp.vstack([one.matrix for one in ordered]))
    dependent = np.concatenate([one.dependent for one in ordered])
    owner = np.repeat(np.arange(len(ordered)), [len(one.dependent) for one in ordered])
    chosen = np.zeros(len(dependent), bool)
    chosen[np.unique(dependent, return_index=True)[1]] = True
    chosen &= free[dependent]
    chosen[chosen] = _acyclic(C[chosen], dependent[chosen])
    G, unknown = _substituted(C[chosen], dependent[chosen], free)
    left = np.flatnonzero(~chosen)
    rest = sp.csr_array(C[left] @ G)
    size = abs(C[left]).max(axis=1).toarray().ravel()
    implied = abs(rest).max(axis=1).toarray().ravel() <= _IMPLIED * size
    for row in np.flatnonzero(~implied):
        if ordered[owner[left[row]]].strict:
            raise _over_constrained(unknowns, ordered, owner, dependent, left[row])
    kept = np.flatnonzero(~implied)
    return Elimination(G, unknown, sp.csr_array(sp.diags_array(1.0 / size[kept]) @ rest[kept]),
                       unknowns.angles)


def _acyclic(C: Any, dependent: Integers) -> NDArray[np.bool_]:
    """Rows (m,) whose dependent unknown does not come back to them through other rows."""
    from scipy.sparse.csgraph import connected_components

    _, label = connected_components(abs(C[:, dependent]), connection="strong")
    return np.asarray(np.bincount(label)[label] == 1)


def _substituted(
    C: Any, dependent: Integers, free: NDArray[np.bool_]
) -> tuple[Any, Integers]:
    """All unknowns (n, f) from those that are free and not dependent, and numbers (f,) of these."""
    import scipy.sparse as sp

    own = C[:, dependent].diagonal()
    S = sp.csr_array(sp.diags_array(-1.0 / own) @ C)
    among = sp.csr_array(S[:, dependent])
    among.setdiag(0.0)
    among.eliminate_zeros()
    independent = free.copy()
    independent[dependent] = False
    total = term = sp.csr_array(S[:, independent])
    while (term := sp.csr_array(among @ term)).nnz:
        total = total + term
    spread = sp.csr_array((np.ones(len(dependent)), (dependent, np.arange(len(dependent)))),
                          shape=(len(free), len(dependent)))
    kept = np.flatnonzero(independent)
    identity = sp.csr_array((np.ones(len(kept)), (kept, np.arange(len(kept)))),
                            shape=(len(free), len(kept)))
    return sp.csr_array(identity + spread @ total), kept


def _null_space(R: Any) -> tuple[Any, Integers]:
    """Solutions q = Z p of ``R q = 0``, sparse; p are unknowns of q, with these numbers."""
    import scipy.sparse as sp
    from scipy.linalg import qr, solve_triangular

    used = np.unique(R.indices)
    triangle, order = qr(R[:, used].toarray(), mode="r", pivoting=True)
    rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > _IMPLIED * abs(triangle[0, 0])))
    pivots, others = used[order[:rank]], used[order[rank:]]
    values = -solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:])
    size = R.shape[1]
    kept = np.setdiff1d(np.arange(size), pivots)
    rows = np.concatenate([kept, np.repeat(pivots, len(others))])
    columns = np.concatenate([np.arange(len(kept)),
                              np.tile(np.searchsorted(kept, others), rank)])
    Z = sp.csr_array((np.concatenate([np.ones(len(kept)), values.ravel()]), (rows, columns)),
                     shape=(size, len(kept)))
    return Z, kept


def _seen(G: Any, extra: Integers) -> Any:
    """Unknowns, sparse (p, f), without what of those of points ``extra`` moves no node; or None.

    Such are turns about the line on which all nodes of a coupling lie. None stands for all of them.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    if not len(extra):
        return None
    motions = G[:, extra]
    gram = sp.csr_array(motions.T @ motions)
    parts, label = connected_components(gram, directed=False)
    size = G.shape[1]
    rest = np.setdiff1d(np.arange(size), extra)
    rows, columns, data = [rest], [np.arange(len(rest))], [np.ones(len(rest))]
    count = len(rest)
    for part in range(parts):
        which = np.flatnonzero(label == part)
        own = gram[which][:, which].toarray()
        scale = np.sqrt(np.diag(own))
        scale[scale == 0.0] = 1.0
        values, vectors = np.linalg.eigh(own / np.outer(scale, scale))
        seen = values > _UNSEEN * values[-1]
        turn = np.eye(len(which)) if seen.all() else vectors[:, seen] / scale[:, None]
        row, column = np.nonzero(turn)
        rows.append(extra[which[row]])
        columns.append(count + column)
        data.append(turn[row, column])
        count += turn.shape[1]
    return sp.csc_array(sp.coo_array(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))),
        shape=(size, count)))


def _over_constrained(
    unknowns: Unknowns, found: Sequence[Equations], owner: Integers, dependent: Integers, row: int
) -> InputError:
    """Error of a displacement that two of supports and constraints determine."""
    unknown, name = int(dependent[row]), found[owner[row]].name
    earlier = owner[np.flatnonzero(dependent == unknown)[0]]
    alone = bool(unknown not in unknowns.held and earlier == owner[row])
    others = {name, "a support" if unknown in unknowns.held else found[earlier].name}
    if others <= {_HINGE, "a support"}:
        return InputError("Two supports share a node, and one of them is a hinge; separate them.")
    both = " and ".join(sorted(others, reverse=True))
    if alone:
        both = f"{name}, by itself or in a circle with others,"
    elif len(others) == 1:
        both = f"{name} and another one of this name"
    return InputError(f"{both} determine{'s' * alone} {unknowns.describe(unknown)} in different "
                      f"ways; leave the node out of one of them.")


def selects(G: Any) -> bool:
    """Whether each unknown is one displacement, as it is with fixed displacements alone."""
    return bool(G.nnz == G.shape[1] and (G.data == 1.0).all())


def least_squares(G: Any, displacements: Array) -> Array:
    """Unknowns q (f, k) with ``G q`` closest to displacements (d N, k)."""
    from scipy.sparse.linalg import splu

    right = np.asarray(G.T @ displacements)
    if selects(G):
        return right
    return np.asarray(splu((G.T @ G).tocsc()).solve(right))
