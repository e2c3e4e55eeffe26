r"""Contact points of a body that deflects far, on flat ground or on faces that deform too.

A contact point is the mean of a patch of the body, or one of its nodes; it keeps its nodes. Its
distance from the other side, along the normal there, is n . (x - y) with the foot y, see
:mod:`fecontact.fem.faces.moving_feet`, corrected by a constant so that the gap of the undeformed
body is the given one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.tables import located
from fecontact.core.types import Array, Integers
from fecontact.core.units import listed
from fecontact.fem.body_forces import boundary_facets
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.faces.moving_feet import DeformedFace, FlatGround, Opposite
from fecontact.fem.pairing import Pairing
from fecontact.laws.base import FrictionLaw, NodeLaw, NormalLaw
from fecontact.laws.check import require_sound
from fecontact.system.arrays import LawGroup, groups_of_laws, law_table, require_laws
from fecontact.system.gap import Gap, gap_values
from fecontact.system.interfaces import Interface, PointPairing
from fecontact.system.node_forces import normal_values
from fecontact.system.quasistatic.sliders import friction_springs

NormalLaws = TypeAliasType("NormalLaws", NormalLaw | Mapping[str, NormalLaw])
FrictionLaws = TypeAliasType("FrictionLaws", FrictionLaw | Mapping[str, FrictionLaw])
# c_T / c_N of friction without springs of its own, as of quasi-static loading.
_TANGENTIAL = 0.82


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Contact points on one or several faces of a body with one opposite side.

    Attributes
    ----------
    rows : sparse (n d, d N) array
        Displacements of the points from those of the body, point by point.
    places : (n, d) array
        Places of the points in the undeformed body [m].
    gap : (n,) array
        Initial gaps [m].
    opposite : Opposite
        The other side.
    normal : sequence of (slice, (k,) array, NormalLaw)
        Points, their shares of the face, and their normal law.
    stiffness, limit : (n, e) arrays
        Springs of friction [N/m], and the limits of their sliders by the normal force.
    """

    rows: Any
    places: Array
    gap: Array
    opposite: Opposite
    normal: Sequence[LawGroup]
    stiffness: Array
    limit: Array

    def forces(self, penetration: Array) -> tuple[Array, Array]:
        """Normal forces (n,) [N] and their slopes (n,) [N/m]."""
        n = len(penetration)
        force, slope = np.empty(n), np.empty(n)
        if n:
            addresses, parameters = self._table
            normal_values(addresses, np.ascontiguousarray(penetration), np.zeros(n),
                          parameters, force, slope)
        return force, slope

    def stored_energy(self, penetration: Array) -> float:
        """Energy stored in the normal contacts [J]."""
        return float(sum(law.stored_energy(penetration[nodes], share).sum()
                         for nodes, share, law in self.normal))

    @cached_property
    def _table(self) -> tuple[Integers, Array]:
        return law_table(self.normal)


def ground_points(
    body: ElasticBody, boundaries: str | Sequence[str], counts: Count | Sequence[Count],
    normal: NormalLaws | None, friction: FrictionLaws | None, gap: Gap | None,
) -> list[ContactPoints]:
    """Contact points of boundaries above flat ground, none without boundaries.

    InputError, MeshError for laws, gaps and boundaries that do not fit.
    """
    face, d = contact_groups(body, boundaries, counts), body.dimension
    if not face.groups:
        for name, law in (("normal", normal), ("friction", friction)):
            if law is not None:
                raise InputError(f"deflection_path: {name} = {law!r} is a law of contact nodes, "
                                 f"but there are none; name boundaries by contact, or leave it "
                                 f"out.")
        return []
    if normal is None:
        raise InputError("deflection_path lacks normal, the law of the normal force at contact; "
                         "give one, such as LinearContact with its stiffness.")
    given = gap_values(gap, face.positions)
    count = len(face.tributary)
    if np.ndim(given) and np.size(given) != count:
        raise InputError(f"deflection_path: gap has {np.size(given)} values for {count} contact "
                         f"nodes; give one number or one per node.")
    return [_points(face.matrix, face.positions, np.broadcast_to(given, count), FlatGround(d),
                    _by_group("normal", NormalLaw, normal, face.groups),
                    _by_group("friction", FrictionLaw, friction, face.groups), face.tributary)]


def interface_points(
    bodies: Mapping[str, ElasticBody], interfaces: Sequence[Interface]
) -> list[ContactPoints]:
    """Contact points of interfaces of bodies with each other, with themselves or the ground.

    One body alone, named '', may have any name in its pairings. InputError for interfaces of other
    bodies, of points, and those that slide.
    """
    require_kind("deflection_path", Sequence, interfaces=interfaces)
    found = []
    for one in interfaces:
        require_kind("deflection_path", Interface, interface=one)
        owner = f"deflection_path: interface '{one.name}'"
        if isinstance(one.pairing, PointPairing) or one.sliding is not None:
            what = "joins points" if isinstance(one.pairing, PointPairing) else "slides by itself"
            raise InputError(f"{owner} {what}, which a path with large deflections does not take; "
                             f"pair faces by pair_faces, without sliding.")
        passes = one.pairing.passes
        places = np.concatenate([each.places for each in passes])
        with located(f"{owner}:"):
            extra = np.broadcast_to(gap_values(one.gap, places), len(places))
        total, first = sum(float(each.tributary.sum()) for each in passes), 0
        for pairing in passes:
            nodes = slice(first, first := first + len(pairing.tributary))
            found.append(_paired(bodies, one, pairing, extra[nodes], total, owner))
    return found


def _paired(
    bodies: Mapping[str, ElasticBody], one: Interface, pairing: Pairing, extra: Array,
    total: float, owner: str,
) -> ContactPoints:
    import scipy.sparse as sp

    names = [pairing.body, *([] if pairing.other is None else [pairing.other])]
    if [*bodies] == [""] and len(set(names)) == 1:
        names = [""] * len(names)
    first = dict(zip(bodies, np.cumsum([0, *(len(body.nodes) for body in bodies.values())]),
                     strict=False))
    d = pairing.places.shape[1]
    for name, rows in zip(names, (pairing.nodes, pairing.feet), strict=False):
        if name not in bodies or rows.shape[1] != bodies[name].nodes.size:
            raise InputError(f"{owner} pairs faces of {listed(names)}, which are not the bodies of "
                             f"this path; give the same bodies to pair_faces and "
                             f"deflection_path.")
    opposite: Opposite = FlatGround(d)
    if len(names) > 1:
        boundary = pairing.report.other.partition(".")[2]
        opposite = DeformedFace(first[names[1]] + boundary_facets(bodies[names[1]], boundary))
    size = sum(body.nodes.size for body in bodies.values())
    before = d * int(first[names[0]])
    after = size - before - pairing.nodes.shape[1]
    matrix = sp.csr_array(sp.hstack([sp.csr_array((pairing.nodes.shape[0], before)), pairing.nodes,
                                     sp.csr_array((pairing.nodes.shape[0], after))]))
    count = len(pairing.tributary)
    return _points(matrix, pairing.places, pairing.gaps + extra, opposite, [(count, one.normal)],
                   [] if one.friction is None else [(count, one.friction)], pairing.tributary,
                   total)


def _points(
    matrix: Any, places: Array, gap: Array, opposite: Opposite,
    normal: Sequence[tuple[int, NodeLaw]], friction: Sequence[tuple[int, NodeLaw]],
    tributary: Array, total: float | None = None,
) -> ContactPoints:
    """Contact points from rows (n 3 (d - 1), d N) and laws with their numbers of points."""
    n, d = places.shape
    each = 3 * (d - 1)
    chosen = (each * np.arange(n)[:, None] + np.arange(d)).ravel()
    part = 1.0 if total is None else float(tributary.sum()) / total
    groups = [[(nodes, share * part, law) for nodes, share, law in groups_of_laws(own, tributary)]
              for own in (normal, friction)]
    for _, share, law in (one for own in groups for one in own):
        law.table(share)
        require_sound(law)
    found = ContactPoints(matrix.tocsr()[chosen], places, np.array(gap, dtype=float), opposite,
                          groups[0], np.zeros((n, 0)), np.zeros((n, 0)))
    if not groups[1]:
        return found
    stiffness, limit, plain = friction_springs(groups[1], n)
    scale = np.concatenate([np.full(nodes.stop - nodes.start, law.penetration_scale)
                            for nodes, _, law in groups[0]])
    stiffness[plain, 0] = _TANGENTIAL * found.forces(scale)[1][plain]
    return replace(found, stiffness=stiffness, limit=limit)


def _by_group(
    what: str, kind: type[Any], given: Any, groups: Sequence[tuple[str, int]]
) -> list[tuple[int, Any]]:
    """Number of points and law of each group, or of all with one law; none without laws."""
    if given is None:
        return []
    require_laws("deflection_path", what, kind, given, "face", [name for name, _ in groups])
    if isinstance(given, kind):
        return [(sum(count for _, count in groups), given)]
    return [(count, given[name]) for name, count in groups]
