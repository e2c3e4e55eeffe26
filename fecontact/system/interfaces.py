"""Interfaces of several bodies as parts of a contact system, and the motion of their other sides.

The compiled right-hand side has one function of time for the prescribed motion of all contact
nodes, and a factor for each of them: ``V_tj(t) = factor_j V(t)``. In space there are two functions,
and factors for both tangents.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.core.units import listed, quantity
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.friction_contact import separated
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
    """Contact interface of two bodies, or of a body and the ground.

    Parameters
    ----------
    name : str
        Its laws are ``interfaces.NAME.normal`` and ``interfaces.NAME.friction``.
    pairing : Pairing, TwoPassPairing or PointPairing
        Contact nodes of one side, their feet on the other, normals and gaps; or those of both.
    normal : normal law
        Extensive parameters are totals of the interface. A
        :class:`~fecontact.laws.FrictionContact3D` is stored as both laws.
    friction : friction law, optional
        Required if its contact nodes can move along each other.
    sliding : SlidingTranslation or SlidingRotation, optional
        Prescribed motion of the other side; on the ground it replaces the ground's motion.
    gap : float, (n,) sequence, Crown, HeightMap or function of x
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
        for part, law in zip(("normal", "friction"),
                             separated(self.normal, self.friction, owner), strict=True):
            object.__setattr__(self, part, law)
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

    InputError as :func:`fecontact.reduction.assembled_basis`; for interfaces of the same name, and
    those that slide without friction law.
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
        if one.friction is None and slides(basis)[nodes].any():
            raise InputError(f"Interface '{name}' lacks friction, although its contact nodes can "
                             f"move along the other side: give a friction law with its "
                             f"coefficients, such as ExponentialFriction, or Frictionless().")
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
            names = ("x", "y", "rotation") if basis.dimension == 2 else (
                "x", "y", "z", "rotation", "rotation", "rotation")
            ways = [*dict.fromkeys(way for way, moved in zip(names, free, strict=True) if moved)]
            how = f" in {listed(ways)}" if ways else ""
            raise InputError(f"ContactSystem: body '{name}' is free{how}, but no "
                             f"interface and no link touches it; join it to another body, support "
                             f"it, or leave it out.")


def slides(basis: ModalBasis) -> NDArray[np.bool_]:
    """Whether each contact node (n,) can move along its tangents."""
    return np.asarray(basis.contact_T[:, : basis.dimension - 1].any(axis=(1, 2)))


@dataclass(frozen=True, eq=False)
class MotionSource:
    """Prescribed motion of the other side of some contact nodes, ``V_tj = along_j V(t)``.

    ``along`` is (k,), in space (k, 2), for k nodes.
    """

    what: str
    nodes: NDArray[np.bool_]
    along: Array
    speed: float
    motion: GroundMotion | None


@read_only_arrays
@dataclass(frozen=True, eq=False)
class PrescribedMotion:
    """Motion of the other sides of all contact nodes.

    Attributes
    ----------
    motions : tuple of Ground
        Flat ground of each motion: one in the plane, one or two in space.
    factors : (k, n) array
        Tangential velocity of the other side of each node by the speed of each motion; in space
        (k, n, 2), for both tangents.
    """

    motions: tuple[Ground, ...]
    factors: Array

    @property
    def constant(self) -> bool:
        """Whether no speed depends on time."""
        return all(one.motion is None for one in self.motions)

    def travel(self, time: float) -> Array:
        """Travel (n,), in space (n, 2), of the other side of each node at a time [m]."""
        return np.tensordot([one.travel(time) for one in self.motions], self.factors, 1)

    def velocity(self, time: float) -> Array:
        """Velocity (n,), in space (n, 2), of the other side of each node at a time [m/s]."""
        return np.tensordot([one.velocity(time) for one in self.motions], self.factors, 1)

    def largest_speed(self, t0: float, t1: float) -> float:
        """Upper bound of the speed of any node's other side from t0 to t1 [m/s]."""
        k, n, *_ = self.factors.shape
        largest = np.abs(self.factors.reshape(k, n, 1 if self.factors.ndim == 2 else 2))
        speeds = [one.largest_speed(t0, t1) for one in self.motions]
        found = np.tensordot(speeds, largest, 1)
        return float(np.linalg.norm(found, axis=-1).max(initial=0.0))


def motion_sources(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> list[MotionSource]:
    """Ground, if it has nodes, and each sliding interface."""
    n, first = basis.contact_nodes, 0
    places, tangents = basis.contact_places, basis.tangents
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
        sources[:0] = _ground_sources(ground, on_ground, places[on_ground], tangents[on_ground])
    return sources


def _ground_sources(
    ground: Ground, nodes: NDArray[np.bool_], places: Array, tangents: Array
) -> list[MotionSource]:
    """The ground's motion along x; in space along y and its rotation too, if it has them."""
    if tangents.ndim == 2:
        return [MotionSource("the ground", nodes, np.ones(len(places)), ground.speed,
                             ground.motion)]
    found = [MotionSource("the ground", nodes, tangents[:, :, 0], ground.speed, ground.motion)]
    across = MotionSource("the ground along y", nodes, tangents[:, :, 1], ground.speed_y,
                          ground.motion_y)
    arms = places[:, :2] - np.array(ground.centre)
    turned = np.einsum("nkd,nd->nk", tangents[:, :, :2],
                       np.column_stack([-arms[:, 1], arms[:, 0]]))
    turning = MotionSource("the rotation of the ground", nodes, turned, ground.rotation_speed, None)
    return [*found, across, turning]


def checked_sliding(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> Mapping[str, Sliding]:
    """The sliding by interface, read-only.

    InputError for unknown interfaces, values of another type, and waves of the ground below contact
    nodes whose normal is not the vertical axis.
    """
    require_kind("ContactSystem", Mapping, sliding=sliding)
    names = [group for group, _ in basis.groups if group not in basis.springs]
    for group, one in sliding.items():
        if group not in names:
            raise InputError(f"ContactSystem: sliding names the interface {group!r}"
                             f"{nearest(group, names)}, but there are {choices(names)}.")
        require_kind(f"Interface '{group}'", (SlidingTranslation, SlidingRotation), sliding=one)
    upright = (0.0, 1.0) if basis.dimension == 2 else (0.0, 0.0, 1.0)
    tilted = basis.normals[basis.ground_nodes] != upright
    if ground.wavy and tilted.any():
        raise InputError(f"ContactSystem: waves of the ground need contact nodes whose normal is "
                         f"{(*upright[:-1], 1)}, but some on the ground have others; make the "
                         f"ground flat.")
    return MappingProxyType(dict(sliding))


def sliding_speed(sliding: Sliding) -> str:
    """Speed of a sliding side, for people."""
    return quantity(sliding.speed, "rad/s" if isinstance(sliding, SlidingRotation) else "m/s") + (
        "" if sliding.motion is None else " in time")


def prescribed_motion(
    basis: ModalBasis, ground: Ground, sliding: Mapping[str, Sliding]
) -> PrescribedMotion:
    """Functions of time and the factors of the nodes: one in the plane, up to two in space.

    A single source keeps its own speed as the parameter. Several constant speeds become factors of
    a speed of one. InputError if a speed varies in time beside others that are not zero.
    """
    sources = motion_sources(basis, ground, sliding)
    size = (basis.contact_nodes,) if basis.dimension == 2 else (basis.contact_nodes, 2)
    most = basis.dimension - 1
    if len(sources) < 2:
        factors = np.zeros((1, *size))
        for source in sources:
            factors[0, source.nodes] = source.along
            return PrescribedMotion((Ground(speed=source.speed, motion=source.motion),), factors)
        return PrescribedMotion((Ground(),), factors)
    varying = [source for source in sources if source.motion is not None]
    steady = [source for source in sources if source.motion is None]
    moving = [source for source in steady if source.speed != 0.0]
    if len(varying) + bool(moving) > most:
        others = [source.what for source in (*varying[1:], *moving)]
        raise InputError(f"ContactSystem: {varying[0].what} varies in time while {choices(others)} "
                         f"moves too; with {'a motion' if most == 1 else 'two motions'} in time "
                         f"all other speeds must be zero.")
    motions = [Ground(speed=source.speed, motion=source.motion) for source in varying]
    factors = np.zeros((len(varying), *size))
    for by, source in zip(factors, varying, strict=True):
        by[source.nodes] = source.along
    if len(varying) < most:
        # Whatever their values: which motions there are must not depend on a speed being zero.
        together = np.zeros(size)
        for source in steady:
            together[source.nodes] += source.speed * source.along
        motions.append(Ground(speed=1.0))
        factors = np.concatenate([factors, together[None]])
    return PrescribedMotion(tuple(motions), factors)


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


def names_of_laws(law: Any, without: tuple[str, ...]) -> str:
    """Class of a law, or those of the interfaces."""
    if isinstance(law, Mapping):
        return listed([f"{type(one).__name__} ({group})" for group, one in law.items()
                       if group not in without]) if set(law) - set(without) else ""
    return type(law).__name__
