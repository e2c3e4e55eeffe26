r"""Forces of contact points under large deflections, with their derivatives and their history.

With the foot y of a point x, the normal n there and F of the normal law, the point exerts

.. math::

    p = -F\,n + \sum_e t_e, \qquad \tau_e = c_e\,(1 - n n^T)(x - y_e), \qquad
    t_e = \tau_e \min(1,\ \phi_e |F| / |\tau_e|)

on the body, whose work is that on x less y: equal and opposite forces act at the foot. Friction is
that of springs c in series with sliders. Each is anchored in a place y_e that belongs to the other
side, moves with it, and stays where it is while the slider sticks. After a step in which it slid
the anchor is the place closest to x - t_e / c_e. Steps are those of a backward Euler method.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.faces.moving_feet import Feet
from fecontact.system.statics.contact_points import ContactPoints

# Gap of a point that touches, by the size of the bodies, and rounding of places.
_TOUCHING, _ROUNDING = 1e-12, 1e-15


@dataclass(frozen=True, eq=False)
class PointForces:
    """Forces of n contact points in one state.

    Attributes
    ----------
    penetration, normal_force : (n,) arrays
        Penetration [m], below zero the gap, and force [N].
    friction : (n, d) array
        Friction force on the points along x, y (, z) [N].
    elastic : float
        Energy in the springs of friction [J].
    slides : (n,) bool array
        Points that slide: all of their sliders do.
    slip, loss : (n,) arrays
        Path that the points have slid [m], and what friction has lost [J], since the undeformed
        state.
    """

    penetration: Array
    normal_force: Array
    friction: Array
    elastic: float
    slides: NDArray[np.bool_]
    slip: Array
    loss: Array


@dataclass(frozen=True, eq=False)
class ActingForces:
    """Forces of contact points on the bodies.

    Attributes
    ----------
    energy : float
        Energy stored in contacts and springs of friction [J].
    force : (d N,) array
        Forces that hold the points [N].
    slope : sparse (d N, d N) array
        Their derivative [N/m].
    status : bytes
        Closed points, and sliders that slide.
    rounding : float
        Error of the forces by rounding of places [N].
    """

    energy: float
    force: Array
    slope: Any
    status: bytes
    rounding: float


@dataclass(frozen=True, eq=False)
class _Anchors:
    """Places of the other side that hold e springs of n points.

    Attributes
    ----------
    nodes, weights : (n, e, k) arrays
        Nodes of the other side that move them, and how.
    fixed : (n, e, d) array
        Their places on the ground [m].
    """

    nodes: Integers
    weights: Array
    fixed: Array

    def places(self, displaced: Array) -> Array:
        """Places (n, e, d) of the anchors [m]."""
        return np.asarray(self.fixed + np.einsum("nek,nekx->nex", self.weights,
                                                 displaced[self.nodes]))


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """Forces of all points in one state, what they follow from, and their friction springs."""

    feet: Feet
    spring: Array
    trial: Array
    size: Array
    limit: Array
    part: Array
    slope: Array
    normal: Array
    depth: Array


class MovingContact:
    """Contact points of bodies with their history of friction.

    Parameters
    ----------
    places : (N, d) array
        Places of all nodes of the undeformed bodies [m].
    points : ContactPoints
        Contact points, and what is opposite to them.
    """

    def __init__(self, places: Array, points: ContactPoints) -> None:
        self._places, self._points = places, points
        self._anchors: _Anchors | None = None
        self._facet: Integers | None = None
        self._offset = np.zeros(len(points.gap))
        n = len(points.gap)
        self._slip, self._loss, self._limit = *np.zeros((2, n)), np.zeros(points.stiffness.shape)
        first = points.opposite.feet(points.places, places)
        self._offset = points.gap - first.gaps
        self.accept(np.zeros_like(places))

    def accept(self, displacement: Array) -> PointForces:
        """Keep the displacement (N, d) as the state from which the next one is loaded."""
        displaced = self._places + displacement
        found = self._evaluated(displacement)
        d, (n, e) = displaced.shape[1], self._points.stiffness.shape
        force = found.part[..., None] * found.trial
        stiffness = np.where(self._points.stiffness > 0.0, self._points.stiffness, 1.0)
        gone = np.maximum(found.size - found.limit, 0.0) / stiffness
        self._loss = self._loss + (0.5 * (found.limit + self._limit) * gone).sum(axis=1)
        slides = np.asarray((found.part < 1.0).all(axis=1) & (e > 0))
        self._slip = self._slip + np.where(slides, gone.min(axis=1, initial=np.inf), 0.0)
        self._limit = found.limit
        at = self._at(displacement)
        left = (at[:, None] - force / stiffness[..., None]).reshape(-1, d)
        feet = self._points.opposite.feet(left, displaced, np.repeat(found.feet.facet, e))
        k = feet.nodes.shape[1]
        new = _Anchors(feet.nodes.reshape(n, e, k), feet.values.reshape(n, e, k),
                       np.zeros((n, e, d)) if k else feet.places.reshape(n, e, d))
        if self._anchors is None:
            self._anchors = new
        else:
            moved = (found.part < 1.0)[..., None]
            self._anchors = _Anchors(*(np.where(moved, one, old) for one, old in (
                (getattr(new, name), getattr(self._anchors, name))
                for name in ("nodes", "weights", "fixed"))))
        elastic = float((0.5 * (force**2).sum(axis=2) / stiffness).sum())
        return PointForces(found.depth, found.normal, -force.sum(axis=1), elastic, slides,
                           self._slip, self._loss)

    def forces(self, displacement: Array) -> ActingForces:
        """Forces that hold the points at displacements (N, d) of all nodes."""
        import scipy.sparse as sp

        found, points = self._evaluated(displacement), self._points
        feet, e, d = found.feet, points.stiffness.shape[1], displacement.shape[1]
        k = feet.nodes.shape[1]
        w, w_along = feet.motions(e)
        moved, turned = feet.followed(w, w_along)
        normal = feet.normals
        push = -found.normal[:, None] * normal + (found.part[..., None] * found.trial).sum(axis=1)
        distance = np.einsum("nx,nxl->nl", normal, w)
        # dF = -F' n . w, as the penetration is the negative distance.
        change = -found.slope[:, None] * distance
        rate = -(normal[:, :, None] * change[:, None] + found.normal[:, None, None] * turned)
        for j in range(e):
            rate += self._friction_rate(found, j, turned, change, d, k)
        stiff = np.einsum("nxl,nxm->nlm", w, rate)
        stiff -= np.einsum("naxl,nx,nam->nlm", w_along, push, moved)
        force = np.einsum("nxl,nx->nl", w, push)
        rows, index = self._rows(found, d, k)
        size = stiff.shape[1]
        block = sp.csr_array((stiff.ravel(), (np.repeat(index, size, axis=1).ravel(),
                                              np.tile(index, size).ravel())),
                             shape=(rows.shape[0], rows.shape[0]))
        total = np.zeros(rows.shape[0])
        total[index] = force
        energy = points.stored_energy(found.depth) + float((
            0.5 * (found.part * found.size) ** 2 / np.where(
                points.stiffness > 0.0, points.stiffness, 1.0)).sum())
        status = np.column_stack([found.normal != 0.0, found.part < 1.0]).tobytes()
        stiffest = np.abs(found.slope) + points.stiffness.sum(axis=1)
        rounding = _ROUNDING * np.abs(self._places).max() * float(np.linalg.norm(stiffest))
        return ActingForces(energy, np.asarray(rows.T @ total),
                            sp.csc_array(rows.T @ block @ rows), status, rounding)

    def _at(self, displacement: Array) -> Array:
        """Places (n, d) of the points."""
        moved = (self._points.rows @ displacement.ravel()).reshape(-1, displacement.shape[1])
        return np.asarray(self._points.places + moved)

    def _evaluated(self, displacement: Array) -> _Evaluated:
        points, displaced = self._points, self._places + displacement
        at = self._at(displacement)
        feet = points.opposite.feet(at, displaced, self._facet)
        self._facet = feet.facet
        depth = -(feet.gaps + self._offset)
        normal, slope = points.forces(depth)
        # A point that just touches has the slope of one that is pressed.
        touching = np.abs(depth) <= _TOUCHING * np.ptp(self._places)
        if touching.any():
            slope = points.forces(np.where(touching, _TOUCHING * np.ptp(self._places), depth))[1]
        normal, slope = (np.where(feet.valid, one, 0.0) for one in (normal, slope))
        (n, e), d = points.stiffness.shape, displaced.shape[1]
        spring = np.zeros((n, e, d)) if self._anchors is None else (
            at[:, None] - self._anchors.places(displaced))
        across = (spring * feet.normals[:, None]).sum(axis=2, keepdims=True)
        trial = points.stiffness[..., None] * (spring - across * feet.normals[:, None])
        size = np.linalg.norm(trial, axis=2)
        limit = points.limit * np.abs(normal)[:, None]
        part = np.where(size > limit, limit / np.where(size > 0.0, size, 1.0), 1.0)
        return _Evaluated(feet, spring, trial, size, limit, part, slope, normal,
                          depth)

    def _friction_rate(
        self, found: _Evaluated, j: int, turned: Array, change: Array, d: int, k: int
    ) -> Array:
        """Derivative (n, d, l) of the force of spring j over local displacements."""
        points, normal, s = self._points, found.feet.normals, found.spring[:, j]
        n, size = turned.shape[0], turned.shape[2]
        own = np.zeros((n, d, size))
        eye, first = np.eye(d), d * (1 + k + j)
        own[:, :, :d], own[:, :, first : first + d] = eye, -eye
        tangent = eye - normal[:, :, None] * normal[:, None, :]
        rate = tangent @ own
        rate -= (normal * s).sum(axis=1)[:, None, None] * turned
        rate -= normal[:, :, None] * np.einsum("nx,nxl->nl", s, turned)[:, None]
        rate *= points.stiffness[:, j, None, None]
        length = np.where(found.size[:, j] > 0.0, found.size[:, j], 1.0)
        way = found.trial[:, j] / length[:, None]
        limited = (points.limit[:, j] * np.sign(found.normal))[:, None, None] * (
            way[:, :, None] * change[:, None])
        across = eye - way[:, :, None] * way[:, None, :]
        limited += (found.limit[:, j] / length)[:, None, None] * (across @ rate)
        return np.where((found.part[:, j] < 1.0)[:, None, None], limited, rate)

    def _rows(self, found: _Evaluated, d: int, k: int) -> tuple[Any, Integers]:
        """Rows of all local displacements from the nodes, sparse, and their numbers (n, l)."""
        import scipy.sparse as sp

        points, anchors = self._points, self._anchors
        (n, e), total = points.stiffness.shape, self._places.size
        axes = np.arange(d)

        def chosen(nodes: Integers, weights: Array) -> Any:
            """Rows of weighted sums of nodes (r, k) in each direction."""
            r, width = nodes.shape
            at = (d * np.arange(r)[:, None, None] + axes) + np.zeros((r, width, 1), int)
            columns = d * nodes[:, :, None] + axes
            data = weights[:, :, None] + np.zeros(d)
            return sp.csr_array((data.ravel(), (at.ravel(), columns.ravel())), shape=(d * r, total))

        nodes = found.feet.nodes.reshape(-1, 1)
        parts = [points.rows, chosen(nodes, np.ones(nodes.shape))]
        if e:
            assert anchors is not None
            parts.append(chosen(anchors.nodes.reshape(n * e, -1),
                                anchors.weights.reshape(n * e, -1)))
        numbers = np.concatenate([
            d * np.arange(n)[:, None] + axes,
            d * n + d * k * np.arange(n)[:, None] + np.arange(d * k),
            d * n * (1 + k) + d * e * np.arange(n)[:, None] + np.arange(d * e)], axis=1)
        return sp.csr_array(sp.vstack(parts)), numbers
