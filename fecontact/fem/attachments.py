"""Masses and springs at points of a body: concentrated masses, springs and dashpots."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, MeshError, require_not_negative, shown
from fecontact.core.types import Array, Integers
from fecontact.core.units import count
from fecontact.fem.constraints import (
    Constraint,
    LinearEquation,
    Term,
    Terms,
    check_named_terms,
    check_terms,
    reference_points,
)

Place = str | int | tuple[int, int]


@dataclass(frozen=True)
class PointMass:
    """A rigid mass at a point of a body.

    It adds ``m |u'|^2 / 2 + phi' . J phi' / 2`` to the kinetic energy, with the displacement u and
    the rotation phi of the point.

    Parameters
    ----------
    at : str, int or (int, int)
        Point of the mesh with one node, reference point, node or middle of an edge, as in
        :class:`~fecontact.fem.Term`.
    mass : float
        m, zero or above [kg].
    inertia : float, of solids three or six floats
        J about the point [kg m^2]: J_xx, J_yy, J_zz, and J_xy, J_xz, J_yz, which are the elements
        of the matrix (J_xy = -int rho x y dV). One number in the plane, in space that about each
        axis. For reference points, which have a rotation.
    name : str
        For messages.

    Raises
    ------
    InputError
        For a negative mass, or an inertia that is not positive semi-definite.
    """

    at: Place
    mass: float = 0.0
    inertia: float | Sequence[float] = 0.0
    name: str = "a point mass"

    def __post_init__(self) -> None:
        what = f"PointMass '{self.name}'"
        require_kind(what, (str, int, np.integer, tuple), at=self.at)
        require_not_negative(what, mass=self.mass)
        values = as_floats(self.inertia, f"{what}: inertia")
        if values.shape not in ((), (3,), (6,)) or not np.isfinite(values).all():
            raise InputError(f"{what}: inertia = {shown(self.inertia)} must be one number, of "
                             f"solids three or six.")
        object.__setattr__(self, "inertia", float(values) if not values.ndim
                           else tuple(values.tolist()))
        least = float(np.linalg.eigvalsh(self.matrix(3)[3:, 3:])[0])
        if least < -1e-9 * float(np.abs(values).max()):
            raise InputError(f"{what}: inertia = {shown(self.inertia)} would make turning give "
                             f"energy; its matrix must be positive semi-definite.")

    @property
    def groups(self) -> tuple[str, ...]:
        """Name of the point, if it has one."""
        return (self.at,) if isinstance(self.at, str) else ()

    def matrix(self, dimension: int) -> Array:
        """Mass matrix of displacement and rotation of the point, (3, 3) or (6, 6)."""
        given = np.atleast_1d(self.inertia)
        if dimension == 2:
            return np.diag([self.mass, self.mass, given[0]])
        J = np.diag(np.broadcast_to(given[: 3], (3,)).astype(float))
        for value, (row, column) in zip(given[3:], ((0, 1), (0, 2), (1, 2)), strict=False):
            J[row, column] = J[column, row] = value
        found = np.zeros((6, 6))
        found[:3, :3], found[3:, 3:] = self.mass * np.eye(3), J
        return found

    def renamed(self, new: Mapping[str, str]) -> "PointMass":
        """Mass with a new name of its point."""
        return replace(self, at=new.get(self.at, self.at)) if isinstance(self.at, str) else self

    def refined(self, middle_node: Callable[[tuple[int, int]], int]) -> "PointMass":
        """Mass in a refined mesh, where the middles of edges are nodes."""
        return replace(self, at=middle_node(self.at)) if isinstance(self.at, tuple) else self

    def turned(self, turn: Array, _: Array) -> "PointMass":
        """Mass of the body turned, and perhaps mirrored, by ``turn`` (d, d)."""
        if len(turn) == 2 or isinstance(self.inertia, float):
            return self
        J = turn @ self.matrix(3)[3:, 3:] @ turn.T
        return replace(self, inertia=(*np.diag(J).tolist(), J[0, 1], J[0, 2], J[1, 2]))

    def scaled(self, scale: float) -> "PointMass":
        """Mass in SI units of one in a unit of length of ``scale`` metres, with forces in N."""
        return replace(self, mass=self.mass / scale, inertia=tuple(
            (scale * np.atleast_1d(self.inertia)).tolist()) if not isinstance(
                self.inertia, float) else scale * self.inertia)


@dataclass(frozen=True)
class PointSpring:
    """A spring and a dashpot between points of a body, or from a point to the base.

    Its elongation is ``e = sum_j (a_j . u_j + b_j . phi_j)`` and its force ``k e + c e'``. With one
    term it acts against the base, with two terms of opposite sign between two points.

    Parameters
    ----------
    terms : sequence of Term
        Terms of a :class:`~fecontact.fem.LinearEquation`.
    stiffness : float
        k, zero or above [N/m]; [N m] for an elongation that is an angle.
    damping : float
        c, zero or above [N s/m]; it becomes part of the modal damping matrix.
    name : str
        For messages.

    Raises
    ------
    InputError
        For values out of range, and terms as of a LinearEquation.
    """

    terms: Terms
    stiffness: float = 0.0
    damping: float = 0.0
    name: str = "a spring"

    def __post_init__(self) -> None:
        require_not_negative(f"PointSpring '{self.name}'", stiffness=self.stiffness,
                             damping=self.damping)
        object.__setattr__(self, "terms", check_terms(self.terms, f"PointSpring '{self.name}'"))

    @property
    def equation(self) -> LinearEquation:
        """The equation of no elongation."""
        return LinearEquation(self.terms, self.name)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of points of the mesh or of reference points."""
        return self.equation.groups

    def renamed(self, new: Mapping[str, str]) -> "PointSpring":
        """Spring with new names of some points."""
        return replace(self, terms=self.equation.renamed(new).terms)

    def refined(self, middle_node: Callable[[tuple[int, int]], int]) -> "PointSpring":
        """Spring in a refined mesh, where the middles of edges are nodes."""
        return replace(self, terms=self.equation.refined(middle_node).terms)

    def turned(self, turn: Array, shift: Array) -> "PointSpring":
        """Spring of the body turned, and perhaps mirrored, by ``turn`` (d, d)."""
        return replace(self, terms=self.equation.turned(turn, shift).terms)

    def scaled(self, scale: float) -> "PointSpring":
        """Spring in SI units of one in a unit of length of ``scale`` metres, with forces in N.

        Coefficients of rotations are lengths, unless there are no displacements.
        """
        if any(np.any(term.displacement) for term in self.terms):
            return replace(self, stiffness=self.stiffness / scale, damping=self.damping / scale,
                           terms=tuple(term._replace(rotation=tuple(
                               scale * one for one in term.rotation)) for term in self.terms))
        return replace(self, stiffness=scale * self.stiffness, damping=scale * self.damping)


Attachment = PointMass | PointSpring


class _Body(Protocol):
    """Parts of an elastic body to which attachments are fixed."""

    @property
    def nodes(self) -> Array: ...
    @property
    def added(self) -> Sequence[Attachment]: ...
    def motion_rows(self, at: Place) -> Any: ...


def check_attachments(
    attachments: Sequence[Attachment], constraints: Sequence[Constraint],
    points: Mapping[str, Integers], dimension: int, nodes: int,
) -> None:
    """Raise unless all attachments are at points that the mesh or its constraints have.

    Raises
    ------
    MeshError, InputError
        For unknown points and nodes, and coefficients or inertias of another dimension.
    """
    references = set(reference_points(constraints, points))
    zero = (0.0,) * dimension
    for one in attachments:
        if not isinstance(one, PointMass | PointSpring):
            raise InputError(f"attachments must be PointMass or PointSpring, not "
                             f"{type(one).__name__}.")
        what = f"{type(one).__name__} '{one.name}'"
        if isinstance(one, PointMass):
            terms: Terms = (Term(one.at, zero),)
            turning = [one.at] if np.any(one.inertia) else []
            if dimension == 2 and np.ndim(one.inertia):
                raise InputError(f"{what}: inertia of a plane body is one number, not "
                                 f"{shown(one.inertia)}.")
        else:
            terms, turning = one.terms, [term.at for term in one.terms if np.any(term.rotation)]
        check_named_terms(terms, what, references, points, dimension, nodes)
        for at in turning:
            if at not in references:
                raise MeshError(f"{what} turns with '{at}', which has no rotation of its own; "
                                f"couple nodes to a reference point there.")


def spring_rows(body: _Body) -> tuple[Any, Array, Array]:
    """Rows (k, d N), sparse, of the elongations of all springs, their stiffness and damping."""
    import scipy.sparse as sp

    d = body.nodes.shape[1]
    springs = [one for one in body.added if isinstance(one, PointSpring)]
    rows = [sp.csr_array((0, body.nodes.size))]
    for one in springs:
        total = sp.csr_array((1, body.nodes.size))
        for at, displacement, rotation in one.terms:
            given = np.zeros(3 * (d - 1))
            given[:d] = displacement
            given[d : d + len(rotation)] = rotation
            total = total + sp.csr_array(given[None]) @ body.motion_rows(at)
        if not total.nnz:
            raise InputError(f"PointSpring '{one.name}' has no effect, as its points cannot move "
                             f"along it; leave it out.")
        rows.append(total)
    return (sp.csr_array(sp.vstack(rows)), np.array([one.stiffness for one in springs]),
            np.array([one.damping for one in springs]))


def added_mass(body: _Body) -> Any:
    """Mass matrix of all point masses, sparse (d N, d N)."""
    import scipy.sparse as sp

    total = sp.csr_array((body.nodes.size, body.nodes.size))
    for one in body.added:
        if isinstance(one, PointMass):
            rows = body.motion_rows(one.at)
            total = total + rows.T @ sp.csr_array(one.matrix(body.nodes.shape[1])) @ rows
    return sp.csr_array(total)


def counted_attachments(attachments: Sequence[Attachment]) -> str:
    """Number of attachments of each kind, for summaries."""
    masses = sum(isinstance(one, PointMass) for one in attachments)
    springs = len(attachments) - masses
    return ", ".join([f"{masses} point mass{'es' * (masses > 1)}"] * bool(masses)
                     + [count(springs, "spring")] * bool(springs))
