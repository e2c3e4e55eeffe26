"""Constraints between displacements of a body: equations, ties of faces, couplings to a point."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fecontact.core.checks import as_direction, as_floats, as_place, require_kind
from fecontact.core.errors import (
    InputError,
    MeshError,
    choices,
    nearest,
    require_choice,
    require_positive,
    shown,
)
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.core.units import count


class Term(NamedTuple):
    """One term ``a . u + b . phi`` of a linear equation.

    Attributes
    ----------
    at : str, int or (int, int)
        A point of the mesh with one node or the reference point of a coupling, by name; or a node
        of the mesh; or two nodes, for the middle of the edge between them.
    displacement : d floats
        Coefficients a of the displacement u in x, y (, z).
    rotation : one float, of a solid three, or ()
        Coefficients b [m] of the rotation phi of a reference point.
    """

    at: str | int | tuple[int, int]
    displacement: Sequence[float]
    rotation: Sequence[float] = ()


Terms = Sequence[Term]


def check_terms(terms: Terms, what: str) -> tuple[Term, ...]:
    """Terms as tuples; InputError, with ``what`` in front, for other forms and zeros alone."""
    require_kind(what, Sequence, terms=terms)
    if not terms:
        raise InputError(f"{what}: terms is empty; give at least one.")
    for term in terms:
        if not isinstance(term, tuple) or len(term) not in (2, 3) or not isinstance(
                term[0], str | int | np.integer | tuple):
            raise InputError(f"{what}: {shown(term)} must be a Term: a point or node, and the "
                             f"coefficients of its displacement.")
    found = tuple(Term(*term) for term in terms)
    values = [np.concatenate([as_floats(term.displacement, f"{what}: displacement"),
                              as_floats(term.rotation, f"{what}: rotation")]) for term in found]
    if not all(np.isfinite(one).all() for one in values) or not any(map(np.any, values)):
        raise InputError(f"{what}: the coefficients must be finite, and one of them not zero.")
    return found


@dataclass(frozen=True)
class LinearEquation:
    """Linear equation between displacements, ``sum_j (a_j . u_j + b_j . phi_j) = 0``.

    The component of the first term with the largest coefficient is eliminated; where another
    constraint or a support determines it already, some other component is.

    Parameters
    ----------
    terms : sequence of Term
    name : str
        For messages.

    Raises
    ------
    InputError
        For no terms, or coefficients that are not finite or all zero.
    """

    terms: Terms
    name: str = "an equation"

    def __post_init__(self) -> None:
        terms = check_terms(self.terms, f"LinearEquation '{self.name}'")
        object.__setattr__(self, "terms", terms)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of points of the mesh or of reference points."""
        return tuple(term.at for term in self.terms if isinstance(term.at, str))

    def renamed(self, new: Mapping[str, str]) -> "LinearEquation":
        """Equation with new names of some points."""
        return replace(self, terms=[
            term._replace(at=new.get(term.at, term.at)) if isinstance(term.at, str) else term
            for term in self.terms])

    def refined(self, middle_node: Callable[[tuple[int, int]], int]) -> "LinearEquation":
        """Equation in a refined mesh, where the middles of edges are nodes."""
        return replace(self, terms=[
            term._replace(at=middle_node(term.at)) if isinstance(term.at, tuple) else term
            for term in self.terms])

    def turned(self, turn: Array, _: Array) -> "LinearEquation":
        """Equation of the body turned, and perhaps mirrored, by ``turn`` (d, d)."""
        terms = []
        for at, displacement, rotation in self.terms:
            # Rotations are axial vectors, which a mirror turns round.
            spin = np.linalg.det(turn) * (turn if len(turn) == 3 else np.eye(1))
            terms.append(Term(at, tuple(turn @ displacement),
                              tuple(spin @ rotation) if len(rotation) else ()))
        return replace(self, terms=terms)


@dataclass(frozen=True)
class Tie:
    """A face whose nodes move with another face, whose mesh need not match.

    The displacement of a dependent node is that of the closest place x of the independent face,

        u = sum_j (N_j + N_j,a a^a . r) u_j - (n . r) sum_j N_j,a a^a (n . u_j),

    with the shape functions N_j of the facet at x and their slopes N_j,a along its surface vectors,
    whose reciprocal ones are a^a. r goes from x to the node, n is the normal. Rigid motions strain
    nothing, also where r is not zero. With a ``control`` point the faces may approach each other by
    its displacement s in x, ``u = ... + s d``: the section of a bolt, whose force is that on the
    control point.

    Parameters
    ----------
    dependent : str
        Boundary or points of the mesh.
    independent : str
        Boundary of the mesh.
    tolerance : float, optional
        Largest distance of a node from the face [m]; by default a twentieth of the mean length of
        an edge, or of the root of the mean area of a face, on the independent boundary. Nodes that
        are farther away are left out with a warning.
    name : str
        For messages.
    control : str, optional
        Name of a reference point without a place, of which the displacement in x counts alone.
    direction : d floats, optional
        d, of any length: from the dependent face into the body beyond the independent one. With a
        control point only.
    """

    dependent: str
    independent: str
    tolerance: float | None = None
    name: str = "a tie"
    control: str | None = None
    direction: Coordinates | None = None

    def __post_init__(self) -> None:
        require_kind(f"Tie '{self.name}'", str, dependent=self.dependent,
                     independent=self.independent)
        if self.tolerance is not None:
            require_positive(f"Tie '{self.name}'", tolerance=self.tolerance)
        require_kind(f"Tie '{self.name}'", (str, type(None)), control=self.control)
        if (self.control is None) != (self.direction is None):
            raise InputError(f"Tie '{self.name}': control and direction belong together; give both "
                             f"or none.")
        if self.direction is not None:
            object.__setattr__(self, "direction", as_direction(
                self.direction, f"Tie '{self.name}': direction"))

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the boundaries or points of the mesh, and of the control point."""
        return (self.dependent, self.independent,
                *(() if self.control is None else (self.control,)))

    def refined(self, _: object) -> "Tie":
        """The tie itself."""
        return self

    def renamed(self, new: Mapping[str, str]) -> "Tie":
        """Tie with new names of some groups."""
        return replace(self, dependent=new.get(self.dependent, self.dependent),
                       independent=new.get(self.independent, self.independent),
                       control=None if self.control is None else new.get(self.control,
                                                                         self.control))

    def turned(self, turn: Array, _: Array) -> "Tie":
        """Tie of the body turned by ``turn`` (d, d)."""
        return self if self.direction is None else replace(
            self, direction=tuple((turn @ self.direction).tolist()))

    def scaled(self, scale: float) -> "Tie":
        """Tie of a body whose unit of length is ``scale`` of the new one."""
        return self if self.tolerance is None else replace(self, tolerance=scale * self.tolerance)


@dataclass(frozen=True)
class Coupling:
    """Nodes coupled to a reference point with displacement u and rotation phi.

    'kinematic': each node moves along the axes as the rigid body, ``u_i = u + phi x r_i`` with r_i
    from the reference point to the node. 'distributing': the reference point has the mean motion
    of the nodes,

        u = sum_i w_i u_i - phi x sum_i w_i r_i,      phi = J^-1 sum_i w_i (r_i - c) x u_i,

    with the weights w_i, of sum one, the centroid ``c = sum_i w_i r_i`` and
    ``J = sum_i w_i (|r_i - c|^2 1 - (r_i - c)(r_i - c)^T)``; forces on the point are spread
    accordingly.

    Parameters
    ----------
    nodes : str
        Boundary or points of the mesh. Weights are shares of the boundary's length or area, or
        equal for points.
    reference : str
        Name of the reference point, which other couplings and equations may use too.
    place : d floats, optional
        Place of the reference point [m]; None if ``reference`` is a point of the mesh.
    kind : 'kinematic' or 'distributing'
    axes : k sequences of d floats, optional
        Independent directions in which the nodes of a kinematic coupling follow; by default all.
    name : str
        For messages.
    weights : sequence of floats, optional
        Weights above zero of the points ``nodes`` of a distributing coupling, in their order in the
        mesh; middles of edges between them have none then.

    Raises
    ------
    InputError
        For an unknown kind, a place that is not finite, dependent axes, or weights that are not
        above zero or of another kind.
    """

    nodes: str
    reference: str
    place: Coordinates | None = None
    kind: str = "kinematic"
    axes: Sequence[Sequence[float]] | None = None
    name: str = "a coupling"
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        what = f"Coupling '{self.name}'"
        require_kind(what, str, nodes=self.nodes, reference=self.reference)
        require_choice(what, "kind", self.kind, ("kinematic", "distributing"))
        if self.place is not None:
            object.__setattr__(self, "place", as_place(self.place, f"{what}: place"))
        if self.weights is not None:
            weights = as_floats(self.weights, f"{what}: weights")
            if weights.ndim != 1 or not (np.isfinite(weights) & (weights > 0.0)).all():
                raise InputError(f"{what}: weights = {shown(self.weights)} must be numbers above "
                                 f"zero, one for each point.")
            if self.kind == "kinematic":
                raise InputError(f"{what}: weights are those of distributing couplings; leave them "
                                 f"out, or give kind = 'distributing'.")
            object.__setattr__(self, "weights", tuple(weights.tolist()))
        if self.axes is None:
            return
        axes = as_floats(self.axes, f"{what}: axes")
        if axes.ndim != 2 or np.linalg.matrix_rank(axes) < len(axes):
            raise InputError(f"{what}: axes must be independent directions (k, d), not "
                             f"{axes.tolist()}.")
        object.__setattr__(self, "axes", tuple(map(tuple, axes.tolist())))

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the nodes and of the reference point."""
        return self.nodes, self.reference

    def refined(self, _: object) -> "Coupling":
        """The coupling itself."""
        return self

    def renamed(self, new: Mapping[str, str]) -> "Coupling":
        """Coupling with new names of some groups."""
        return replace(self, nodes=new.get(self.nodes, self.nodes),
                       reference=new.get(self.reference, self.reference))

    def turned(self, turn: Array, shift: Array) -> "Coupling":
        """Coupling of the body turned by ``turn`` (d, d) and then shifted."""
        place = None if self.place is None else tuple(turn @ np.asarray(self.place) + shift)
        axes = None if self.axes is None else (np.asarray(self.axes) @ turn.T).tolist()
        return replace(self, place=place, axes=axes)

    def scaled(self, scale: float) -> "Coupling":
        """Coupling of a body whose unit of length is ``scale`` of the new one."""
        return self if self.place is None else replace(
            self, place=tuple(scale * np.asarray(self.place)))


Constraint = LinearEquation | Tie | Coupling


def check_constraints(
    constraints: Sequence[Constraint], boundaries: Mapping[str, Integers],
    points: Mapping[str, Integers], dimension: int, nodes: int,
) -> None:
    """Raise unless all constraints name what the mesh has.

    Raises
    ------
    MeshError, InputError
        For unknown boundaries, points and nodes, a reference point without a place or with
        two, and coefficients, axes or places of another dimension.
    """
    for one in constraints:
        if not isinstance(one, LinearEquation | Tie | Coupling):
            raise InputError(f"constraints must be LinearEquation, Tie or Coupling, not "
                             f"{type(one).__name__}.")
    known = {*boundaries, *points}
    references = _reference_names(constraints, points)
    for one in constraints:
        what = f"{type(one).__name__} '{one.name}'"
        if isinstance(one, LinearEquation):
            check_named_terms(one.terms, what, references, points, dimension, nodes)
            continue
        group = one.nodes if isinstance(one, Coupling) else one.dependent
        if group not in known:
            raise MeshError(f"{what}: the mesh has no boundary or points '{group}'"
                            f"{nearest(group, known)}; it has: {choices(known)}.")
        if isinstance(one, Tie):
            if one.independent not in boundaries:
                raise MeshError(f"{what}: the mesh has no boundary '{one.independent}'"
                                f"{nearest(one.independent, boundaries)}; its boundaries are: "
                                f"{choices(boundaries)}.")
            if one.direction is not None and len(one.direction) != dimension:
                raise InputError(f"{what}: direction must have {dimension} components.")
            if one.control in known:
                raise InputError(f"{what}: control = '{one.control}' is a name of the mesh; choose "
                                 f"another one.")
            continue
        if one.weights is not None and len(points.get(one.nodes, ())) != len(one.weights):
            raise InputError(f"{what}: weights has {len(one.weights)} numbers, but '{one.nodes}' "
                             f"names {len(points.get(one.nodes, ()))} points; give one for each.")
        if one.axes is not None and np.shape(one.axes)[1] != dimension:
            raise InputError(f"{what}: axes must have {dimension} components each.")
        if one.place is not None and len(one.place) != dimension:
            raise InputError(f"{what}: place must have {dimension} coordinates.")
        if len(points.get(one.reference, ())) != 1:
            reference_place(constraints, one.reference)


def check_named_terms(
    terms: Terms, what: str, references: set[str], points: Mapping[str, Integers],
    dimension: int, nodes: int,
) -> None:
    """Raise unless terms name points, nodes or reference points."""
    turns = 3 if dimension == 3 else 1
    for at, displacement, rotation in terms:
        if isinstance(at, str):
            if at not in references and len(points.get(at, ())) != 1:
                known = {name for name, held in points.items() if len(held) == 1} | references
                raise MeshError(f"{what}: '{at}' is neither a point of the mesh with one node nor "
                                f"a reference point{nearest(at, known)}; these are: "
                                f"{choices(known)}.")
        elif np.any(np.less(at, 0)) or np.any(np.greater_equal(at, nodes)):
            raise MeshError(f"{what} names the node {at} outside 0 ... {nodes - 1}.")
        if len(displacement) != dimension or len(rotation) not in (0, turns):
            raise InputError(f"{what}: each term needs {dimension} coefficients of the "
                             f"displacement, and {turns} or none of the rotation.")


def _reference_names(
    constraints: Iterable[Constraint], points: Mapping[str, Integers]
) -> set[str]:
    """Names of reference points: of couplings and ties, or in two equations and not of the mesh."""
    found = {one.reference for one in constraints if isinstance(one, Coupling)}
    found |= {one.control for one in constraints if isinstance(one, Tie) and one.control}
    seen: set[str] = set()
    for one in constraints:
        if isinstance(one, LinearEquation):
            named = {*one.groups} - points.keys()
            found |= named & seen
            seen |= named
    return found


def reference_place(constraints: Iterable[Constraint], name: str) -> Coordinates:
    """Place of a reference point; InputError if it has none or two."""
    places = {one.place for one in constraints
              if isinstance(one, Coupling) and one.reference == name and one.place is not None}
    if len(places) != 1:
        raise InputError(f"The reference point '{name}' of a coupling must have one place, but the "
                         f"couplings give it {len(places)}; give place in one of them.")
    return next(iter(places))


def reference_points(
    constraints: Sequence[Constraint], points: Mapping[str, Integers]
) -> tuple[str, ...]:
    """Names of all reference points, in the order in which the constraints name them."""
    names = _reference_names(constraints, points)
    return tuple(dict.fromkeys(
        name for one in constraints for name in one.groups if name in names))


def counted(constraints: Sequence[Constraint]) -> str:
    """Number of constraints of each kind, for summaries."""
    kinds = {LinearEquation: "equation", Tie: "tie", Coupling: "coupling"}
    counts = {title: sum(isinstance(one, kind) for one in constraints)
              for kind, title in kinds.items()}
    return ", ".join(count(number, title) for title, number in counts.items() if number)
