"""Interfaces of several bodies as parts of a contact system, and the motion of their other sides.

The compiled right-hand side has one function of time for the prescribed motion of all contact
nodes, and a factor for each of them: ``V_tj(t) = factor_j V(t)``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.core.units import listed
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.motion import GroundMotion
from fecontact.laws.ground.sliding import Sliding, SlidingRotation, SlidingTranslation
from fecontact.reduction.assembly.assembled_basis import assembled_basis
from fecontact.reduction.assembly.links import Link, Links
from fecontact.reduction.assembly.nonlinear_springs import nonlinear_springs
from fecontact.reduction.assembly.point_pairing import PointPairing
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.gap import Gap, gap_values

__all__ = ["Interface", "PointPairing", "PrescribedMotion", "Sliding", "SlidingRotation",
           "SlidingTranslation"]

_PARTS = ("normal", "friction", "sliding")


@dataclass(frozen=True, eq=False)
class Interface:
    """Where two bodies, or a body and the ground, may touch each other.

    Parameters
    ----------
    name : str
        Its laws are ``interfaces.NAME.normal`` and ``interfaces.NAME.friction``.
    pairing : Pairing, TwoPassPairing or PointPairing
        Contact nodes of one side, their feet on the other, normals and gaps; or those of both.
    normal : normal law
        Extensive parameters are totals of the interface.
    friction : friction law, optional
        Required if its contact nodes can move along each other.
    sliding : SlidingTranslation or SlidingRotation, optional
        Prescribed motion of the other side; on the ground instead of the ground's.
    gap : float, (n,) sequence, Crown or function of x
        Added to the gaps of the pairing, zero or above [m].

    Raises
    ------
    InputError
        For parts of another type, and sliding where the contact nodes lie on the side that slides.
    """

    name: str
    pairing: Pairing | TwoPassPairing | PointPairing
    normal: NormalLaw
    friction: FrictionLaw | None = None
    sliding: Sliding | None = None
    gap: Gap = 0.0

    def __post_init__(self) -> None:
        require_kind("Interface", str, name=self.name)
        owner = f"Interface '{self.name}'"
        require_kind(owner, (Pairing, TwoPassPairing, PointPairing), pairing=self.pairing)
        require_kind(owner, NormalLaw, normal=self.normal)
        require_kind(owner, (FrictionLaw, type(None)), friction=self.friction)
        require_kind(owner, (SlidingTranslation, SlidingRotation, type(None)),
                     sliding=self.sliding)
        if self.sliding is not None and isinstance(self.pairing, TwoPassPairing):
            raise InputError(f"{owner}: sliding is that of the other side, but with two passes "
                             f"contact nodes lie on it too; pair the faces in one pass, by "
                             f"pair_faces with nodes_on='face'.")
        if self.sliding is not None and isinstance(self.pairing, Pairing) and self.pairing.swapped:
            raise InputError(f"{owner}: sliding is that of the other side, but the contact nodes "
                             f"lie on it, the finer face '{self.pairing.report.face}'; pair the "
                             f"faces with nodes_on='face'.")


def system_fields(
    bodies: Mapping[str, ModalBasis] | None, interfaces: Sequence[Interface] | None,
    links: Links | None,
) -> dict[str, Any]:
    """Basis, laws, gap and sliding of a contact system of several bodies.

    Raises
    ------
    InputError
        As :func:`fecontact.reduction.assembled_basis`; for interfaces of the same name, and those
        that slide without friction law.
    """
    require_kind("ContactSystem", Mapping, bodies=bodies)
    require_kind("ContactSystem", (Sequence, type(None)), interfaces=interfaces)
    require_kind("ContactSystem", (Sequence, Mapping, type(None)), links=links)
    assert bodies is not None
    given: dict[str, Interface] = {}
    for one in interfaces or ():
        require_kind("ContactSystem", Interface, interface=one)
        if one.name in given:
            raise InputError(f"ContactSystem: two interfaces have the name '{one.name}'; give "
                             f"each its own.")
        given[one.name] = one
    basis = assembled_basis(bodies, {name: one.pairing for name, one in given.items()},
                            links or ())
    springs = nonlinear_springs(links or ())
    _require_joined(bodies, given, [*(links.values() if isinstance(links, Mapping) else links
                                      or ())])
    friction: dict[str, FrictionLaw] = {}
    gaps: list[Array] = []
    first = 0
    for name, count in basis.groups:
        nodes = slice(first, first + count)
        first += count
        if name in springs:
            friction[name] = ConstantFriction(0.0)
            gaps.append(np.zeros(count))
            continue
        one = given[name]
        if one.friction is None and basis.contact_T[nodes, 0].any():
            raise InputError(f"Interface '{name}' lacks friction, although its contact nodes can "
                             f"move along the other side: give a friction law with its "
                             f"coefficients, such as ConstantFriction(0.0) for no friction.")
        friction[name] = ConstantFriction(0.0) if one.friction is None else one.friction
        with located(f"Interface '{name}':"):
            gaps.append(np.asarray(one.pairing.gaps, dtype=float)
                        + np.asarray(gap_values(one.gap, basis.contact_places[nodes])))
    return {
        "basis": basis,
        "normal": {**{name: one.normal for name, one in given.items()},
                   **{name: one.law for name, one in springs.items()}},
        "friction": friction,
        "gap": np.concatenate([np.zeros(0), *gaps]),
        "sliding": {name: one.sliding for name, one in given.items() if one.sliding is not None},
    }


def _require_joined(
    bodies: Mapping[str, ModalBasis], interfaces: Mapping[str, Interface], links: Sequence[Link]
) -> None:
    """Raise InputError for a free body that neither interfaces nor links nor a drive touch."""
    ends = [end for one in interfaces.values() for end in (one.pairing.body, one.pairing.other)]
    ends += [(end or "").partition(".")[0] for one in links for end in (one.first, one.second)]
    for name, basis in bodies.items():
        if basis.rigid_modes and name not in ends and not basis.T[0].any():
            free = np.abs(basis.T[:, :, basis.angular_frequencies == 0.0]).max(axis=(0, 2))
            ways = [way for way, moved in zip(("x", "y", "rotation"), free, strict=True) if moved]
            how = f" in {listed(ways)}" if ways else ""
            raise InputError(f"ContactSystem: body '{name}' is free{how}, but no "
                             f"interface and no link touches it; join it to another body, support "
                             f"it, or leave it out.")


@dataclass(frozen=True, eq=False)
class MotionSource:
    """What moves the other side of some contact nodes, ``V_tj = along_j V(t)``."""

    what: str
    nodes: NDArray[np.bool_]
    along: Array
    speed: float
    motion: GroundMotion | None

    @property
    def moves(self) -> bool:
        """Whether its speed can differ from zero."""
        return self.motion is not None or self.speed != 0.0


@dataclass(frozen=True, eq=False)
class PrescribedMotion:
    """Motion of the other sides of all contact nodes.

    Attributes
    ----------
    base : Ground
        Flat ground of that motion.
    factors : (n,) array
        Tangential velocity of the other side of each node by this speed.
    """

    base: Ground
    factors: Array


def motion_sources(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> list[MotionSource]:
    """Ground, if it has nodes, and each sliding interface."""
    n, first = basis.contact_nodes, 0
    places = basis.positions[2 : 2 + n]
    tangents = np.stack([basis.normals[:, 1], -basis.normals[:, 0]], axis=1)
    on_ground = basis.ground_nodes.copy()
    sources = []
    for name, count in basis.groups:
        nodes = np.zeros(n, dtype=bool)
        nodes[first : first + count] = True
        first += count
        if name in sliding:
            one = sliding[name]
            on_ground &= ~nodes
            sources.append(MotionSource(f"the sliding of interface '{name}'", nodes,
                                        one.along(places[nodes], tangents[nodes]), one.speed,
                                        one.motion))
    if on_ground.any():
        along = np.ones(np.count_nonzero(on_ground))
        sources.insert(0, MotionSource("the ground", on_ground, along, ground.speed, ground.motion))
    return sources


def checked_sliding(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> Mapping[str, Sliding]:
    """The sliding by interface, read-only.

    Raises
    ------
    InputError
        For unknown interfaces, values of another type, and waves of the ground below contact nodes
        whose normal leans.
    """
    require_kind("ContactSystem", Mapping, sliding=sliding)
    names = [group for group, _ in basis.groups if group not in basis.springs]
    for group, one in sliding.items():
        if group not in names:
            raise InputError(f"ContactSystem: sliding names the interface {group!r}"
                             f"{nearest(group, names)}, but there are {choices(names)}.")
        require_kind(f"Interface '{group}'", (SlidingTranslation, SlidingRotation), sliding=one)
    leaning = basis.normals[basis.ground_nodes] != (0.0, 1.0)
    if ground.wavy and leaning.any():
        raise InputError("ContactSystem: waves of the ground need contact nodes whose normal is "
                         "(0, 1), but some on the ground have others; make the ground flat.")
    return MappingProxyType(dict(sliding))


def prescribed_motion(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> PrescribedMotion:
    """One function of time and the factors of the nodes.

    A single source keeps its own speed as the parameter. Several constant speeds become factors of
    a speed of one.

    Raises
    ------
    InputError
        If a speed varies in time beside others that are not zero.
    """
    sources = motion_sources(basis, ground, sliding)
    factors = np.zeros(basis.contact_nodes)
    if len(sources) < 2:
        for source in sources:
            factors[source.nodes] = source.along
        lead = sources[0] if sources else None
    else:
        moving = [source for source in sources if source.moves]
        varying = [source for source in moving if source.motion is not None]
        if varying and len(moving) > 1:
            raise InputError(f"ContactSystem: {varying[0].what} varies in time while "
                             f"{choices([one.what for one in moving if one is not varying[0]])} "
                             f"moves too; with a motion in time all other speeds must be zero.")
        lead = varying[0] if varying else None
        for source in moving:
            factors[source.nodes] = source.along * (1.0 if varying else source.speed)
        if not varying:
            return PrescribedMotion(Ground(speed=1.0), factors)
    if lead is None:
        return PrescribedMotion(Ground(), factors)
    return PrescribedMotion(Ground(speed=lead.speed, motion=lead.motion), factors)


def inner_name(name: str) -> str:
    """``normal.NAME.stiffness`` for ``interfaces.NAME.normal.stiffness`` or ``links.NAME...``."""
    first, _, rest = name.partition(".")
    if first == "links":
        return f"normal.{rest}"
    group, _, parameter = rest.partition(".")
    kind, _, last = parameter.partition(".")
    if first != "interfaces" or kind not in _PARTS:
        return name
    return f"{kind}.{group}.{last}" if last else f"{kind}.{group}"


def outer_name(system: Any, name: str) -> str:
    """The reverse, for laws and sliding of the interfaces of a system, and its springs."""
    kind, _, rest = name.partition(".")
    if kind not in _PARTS or not isinstance(getattr(system, kind), Mapping):
        return name
    group, _, last = rest.partition(".")
    if group not in getattr(system, kind):
        return name
    if group in system.basis.springs and kind == "normal":
        return f"links.{group}.{last}" if last else f"links.{group}"
    return f"interfaces.{group}.{kind}.{last}" if last else f"interfaces.{group}.{kind}"
