r"""Finite rotations of nodes that move as a rigid body: kinematic couplings and hinges.

The linear equations of a body move such a node, at r from the reference point, by
:math:`u + \varphi \times r`. Under large deflections the rotation vector :math:`\varphi` turns it
by the angle :math:`|\varphi|`, which adds

.. math::

    c = a\,\varphi \times r + b\,\varphi \times (\varphi \times r), \qquad
    a = \frac{\sin|\varphi|}{|\varphi|} - 1, \quad b = \frac{1 - \cos|\varphi|}{|\varphi|^2} .

Without it the nodes would move apart by :math:`|\varphi|^2 / 2`, a strain that soon exceeds that of
bending. Forces and moments work on u and on :math:`\varphi`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from fecontact.core.types import Array, Integers
from fecontact.fem.constraints import Coupling, LinearEquation, Tie
from fecontact.fem.elastic_body import ElasticBody

# a and b as series in s = |phi|^2, exact to rounding up to a whole turn, and their derivatives.
_TERMS = 24
_A = Polynomial([0.0, *((-1.0) ** k / factorial(2 * k + 1) for k in range(1, _TERMS))])
_B = Polynomial([(-1.0) ** k / factorial(2 * k + 2) for k in range(_TERMS)])
_SERIES = tuple((_A.deriv(n), _B.deriv(n)) if n else (_A, _B) for n in range(3))


@dataclass(frozen=True, eq=False)
class TurningNodes:
    """Nodes (k,) that turn as a rigid body, and how.

    Attributes
    ----------
    name : str
        For messages.
    nodes : (k,) integer array
        Displacement nodes.
    arms : (k, 3) array
        Vectors r from the reference point [m].
    rows : sparse (3, d N) array
        Rotation vector from displacements that meet the linear equations [rad].
    along : (d, d) array
        Projection on the directions in which the nodes follow.
    shared : bool
        True if another equation or support holds a node: then the equations stay linear.
    """

    name: str
    nodes: Integers
    arms: Array
    rows: Any
    along: Array
    shared: bool


def turning_nodes(body: ElasticBody) -> list[TurningNodes]:
    """Kinematic couplings and hinges of a body whose rotation is not held."""
    found = [one for one in (*_couplings(body), *_hinges(body)) if one.rows.nnz]
    counts = np.zeros(len(body.nodes), np.int64)
    for nodes in _held(body):
        counts[np.unique(nodes)] += 1
    return [one if (counts[one.nodes] == 1).all() else TurningNodes(
        one.name, one.nodes, one.arms, one.rows, one.along, True) for one in found]


def _couplings(body: ElasticBody) -> Iterator[TurningNodes]:
    from fecontact.fem.reference_motions import reference_position

    d = body.dimension
    for one in body.equations:
        if not isinstance(one, Coupling) or one.kind != "kinematic":
            continue
        nodes = body.group_nodes(one.nodes)
        arms = body.nodes[nodes] - reference_position(body, one.reference)
        along = np.eye(d) if one.axes is None else np.linalg.pinv(one.axes) @ np.asarray(one.axes)
        yield TurningNodes(one.name, nodes, _in_space(arms),
                           _in_space_rows(body.motion_rows(one.reference)[d:]), along, False)


def _hinges(body: ElasticBody) -> Iterator[TurningNodes]:
    import scipy.sparse as sp

    d = body.dimension
    for nodes, centre, axis in body.hinges:
        arms = _in_space(body.nodes[nodes] - centre)
        arms = arms - np.outer(arms @ axis, axis)
        turned = np.cross(axis, arms)[:, :d] / (arms**2).sum()
        angle = sp.csr_array((turned.ravel(), (np.zeros(turned.size, int), (
            d * nodes[:, None] + np.arange(d)).ravel())), shape=(1, body.nodes.size))
        yield TurningNodes("a hinge", nodes, arms, sp.csr_array(axis[:, None] * angle.toarray()),
                           np.eye(d), False)


def _held(body: ElasticBody) -> Iterator[Integers]:
    """Nodes of each constraint and support."""
    for one in body.equations:
        if isinstance(one, Coupling):
            yield body.group_nodes(one.nodes)
        elif isinstance(one, Tie):
            yield body.group_nodes(one.dependent)
            yield body.group_nodes(one.independent)
        elif isinstance(one, LinearEquation):
            for term in one.terms:
                if term.at not in body.references:
                    yield body.motion_rows(term.at).indices // body.dimension
    for name in body.fixed:
        if name not in body.references:
            yield body.group_nodes(name)


def _in_space(places: Array) -> Array:
    return places if places.shape[1] == 3 else np.column_stack([places, np.zeros(len(places))])


def _in_space_rows(rows: Any) -> Any:
    """Rows of a rotation vector from those of a rotation about z, or of three."""
    import scipy.sparse as sp

    return sp.csr_array(rows) if rows.shape[0] == 3 else sp.csr_array(sp.vstack(
        [sp.csr_array((2, rows.shape[1])), rows]))


@dataclass(frozen=True, eq=False)
class FiniteRotations:
    """Displacements by finite rotations beyond those of the linear equations of a body.

    Attributes
    ----------
    groups : sequence of TurningNodes
        Nodes that turn.
    expansion : sparse (d n, f) array
        Displacements from free unknowns.
    """

    groups: list[TurningNodes]
    expansion: Any

    @classmethod
    def of(cls, body: ElasticBody, expansion: Any) -> "FiniteRotations | None":
        """Rotations of the body over free unknowns, or None if nothing turns."""
        import scipy.sparse as sp

        groups = [one for one in turning_nodes(body) if not one.shared]
        if not groups:
            return None
        more = expansion.shape[0] - body.nodes.size
        return cls([TurningNodes(
            one.name, one.nodes, one.arms,
            sp.csr_array(sp.hstack([one.rows, sp.csr_array((3, more))]) @ expansion), one.along,
            False) for one in groups], expansion)

    def displacement(self, q: Array) -> Array:
        """Displacements c (d n,) at free unknowns (f,)."""
        found = np.zeros(self.expansion.shape[0])
        for one in self.groups:
            phi = one.rows @ q
            first = np.cross(phi, one.arms)
            (a, b), *_ = _factors(phi)
            d = len(one.along)
            moved = (a * first + b * np.cross(phi, first))[:, :d] @ one.along
            found[self._places(one)] += moved
        return found

    def slopes(self, q: Array) -> Any:
        """Derivative (d n, f), sparse, of the displacements."""
        import scipy.sparse as sp

        total = sp.csr_array(self.expansion.shape)
        for one in self.groups:
            phi, d = one.rows @ q, len(one.along)
            (a, b), (da, db), _ = _factors(phi)
            first = np.cross(phi, one.arms)
            second = np.cross(phi, first)
            columns = []
            for k, axis in enumerate(np.eye(3)):
                turned = np.cross(axis, one.arms)
                columns.append(2.0 * phi[k] * (da * first + db * second) + a * turned
                               + b * (np.cross(axis, first) + np.cross(phi, turned)))
            own = np.stack(columns, axis=2)[:, :d]
            own = np.einsum("kpc,pr->krc", own, one.along).reshape(-1, 3)
            rows = np.repeat(self._places(one).ravel(), 3)
            local = sp.csr_array((own.ravel(), (rows, np.tile(np.arange(3), len(own)))),
                                 shape=(self.expansion.shape[0], 3))
            total = total + local @ one.rows
        return total

    def curvature(self, q: Array, force: Array) -> Any:
        """Second derivative (f, f), sparse, of the work of fixed nodal forces (d n,) on c."""
        import scipy.sparse as sp

        size = self.expansion.shape[1]
        total = sp.csr_array((size, size))
        for one in self.groups:
            phi = one.rows @ q
            (_, b), (da, db), (dda, ddb) = _factors(phi)
            pulled = _in_space(force[self._places(one)] @ one.along)
            moment = np.cross(one.arms, pulled).sum(axis=0)
            T = pulled.T @ one.arms
            T = 0.5 * (T + T.T)
            T = T - np.trace(T) * np.eye(3)
            # a (phi . m) + b (phi . T phi)
            m, Q, g = float(phi @ moment), float(phi @ T @ phi), 2.0 * T @ phi
            outer = np.outer(phi, 2.0 * (da * moment + db * g))
            H = (4.0 * (dda * m + ddb * Q) * np.outer(phi, phi) + outer + outer.T
                 + 2.0 * (da * m + db * Q) * np.eye(3) + 2.0 * b * T)
            total = total + one.rows.T @ sp.csr_array(H) @ one.rows
        return total

    def _places(self, one: TurningNodes) -> Integers:
        d = len(one.along)
        return np.asarray(d * one.nodes[:, None] + np.arange(d))


def _factors(phi: Array) -> list[tuple[float, float]]:
    """The numbers a and b, and their first and second derivatives by ``s = phi . phi``."""
    s = float(phi @ phi)
    return [(float(a(s)), float(b(s))) for a, b in _SERIES]
