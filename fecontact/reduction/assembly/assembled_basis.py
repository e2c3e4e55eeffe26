"""One modal basis of several bodies: their modes one block after the other, relative contact rows.

With the rows T_a of a contact node on body a, those T_b of its foot on body b and the node's frame
(t_j, n_j), its relative displacement is ``d_j = R_j (T_a q_a - T_b q_b)``: the contact rows of the
assembled basis, for which a system needs no knowledge of the bodies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.fem.faces.frames import frames_of
from fecontact.fem.faces.surface import triangles_if_mixed
from fecontact.fem.fields import of_one_width
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.reduction.assembly.links import Links, NonlinearSpring, linked
from fecontact.reduction.assembly.nonlinear_springs import nonlinear_springs, spring_row
from fecontact.reduction.assembly.point_pairing import PointPairing
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.modal_rotation import ModalRotation
from fecontact.reduction.mode_shapes import BodyPart, ModeShapes, NonlinearStress


@dataclass(frozen=True, eq=False)
class _Side:
    """Rows (3 n, m_k) of places of one body over its modes, and (3 n, 2 N_k) over its nodes.

    Those of solids are (6 n, m_k) and (6 n, 3 N_k).
    """

    body: str
    modal: Array
    nodal: Any


@dataclass(frozen=True, eq=False)
class _Contact:
    """Contact nodes of one interface and both sides; the other one is None on the ground.

    A nonlinear spring is one node, whose other side may be the base.
    """

    places: Array
    normals: Array
    tributary: Array
    side: _Side
    other: _Side | None
    spring: bool = False

    @property
    def frames(self) -> Any:
        """Sparse (3 n, 3 n): x, y, rotation to tangent, normal, rotation; springs: normal alone.

        In space (6 n, 6 n), to t, t2, n and rotations about these.
        """
        return node_frames(self.normals, spring=self.spring)


def node_frames(normals: Array, *, spring: bool = False) -> Any:
    """Frames of contact nodes with normals (n, d): see ``_Contact.frames``."""
    import scipy.sparse as sp

    if normals.shape[1] == 3:
        axes = frames_of(normals)
        whole = np.zeros((len(axes), 6, 6))
        whole[:, :3, :3] = axes * ([[0.0], [0.0], [1.0]] if spring else 1.0)
        whole[:, 3:, 3:] = axes * (0.0 if spring else 1.0)
        return sp.csr_array(sp.block_diag(list(map(sp.csr_array, whole)), format="csr"))
    x, y = normals.T
    zero, one = np.zeros_like(x), np.full_like(x, 0.0 if spring else 1.0)
    frames = np.array([[y * one, -x * one, zero], [x, y, zero],
                       [zero, zero, one]]).transpose(2, 0, 1)
    return sp.csr_array(sp.block_diag(list(map(sp.csr_array, frames)), format="csr"))


def assembled_basis(
    bases: Mapping[str, ModalBasis],
    pairings: Mapping[str, Pairing | TwoPassPairing | PointPairing],
    links: Links = (),
) -> ModalBasis:
    """One basis of several bodies, for a contact system of all of them.

    The modal coordinates are those of the bodies one after the other, damping and stiffness
    block-diagonal, so the frequencies ascend within each body only. Contact nodes follow the
    interfaces, which become the groups; their rows are relative motions along tangent and normal.
    Points are named ``body.point``, boundaries ``body.boundary``; B and C are those of the one body
    that has them. Contact nodes of the bases serve where a :class:`PointPairing` names them.

    Parameters
    ----------
    bases : mapping of name to ModalBasis
        The bodies, which do not rotate.
    pairings : mapping of name to Pairing, TwoPassPairing or PointPairing
        The interfaces.
    links : sequence, or mapping of name to link, optional
        Welds, hinges, bushings and springs; with any, the modes are those of the linked bodies
        instead of blocks, see :func:`fecontact.reduction.linked`. Nonlinear springs leave the modes
        as they are: each becomes a group of one node after the interfaces, with its name, or
        ``spring_1`` and on.

    Raises
    ------
    InputError
        For names that are not those of bodies and points, names with a dot or used twice, pairings
        of other meshes, bodies that rotate differently, and B or C at two bodies.
    """
    require_kind("Several bodies", Mapping, bodies=bases, interfaces=pairings)
    _check_bodies(bases)
    for name in pairings:
        _check_name("interface", name)
    contacts, counts, halves = [], [], []
    for name, pairing in pairings.items():
        with located(f"Interface '{name}':", "PointPairing"):
            made = [_contact(bases, one) for one in pairing.passes]
        contacts += made
        counts.append(sum(len(one.tributary) for one in made))
        if len(made) > 1:
            halves.append((name, len(made[0].tributary)))
    springs = nonlinear_springs(links)
    for name, spring in springs.items():
        _check_name("link", name)
        if name in pairings:
            raise InputError(f"The name '{name}' of a nonlinear spring is that of an interface "
                             f"too; give each its own.")
        contacts.append(_spring_contact(bases, name, spring))
        counts.append(1)
    places = _Places(bases)
    d = places.dimension
    each = 3 * (d - 1)
    named = [_named_point(bases, point) for point in ("B", "C")]
    extra = [(name, point) for name, basis in bases.items()
             for point in (*(end for end in ("B", "C") if _has(basis, end)), *basis.extra)]
    further = [_points(bases[name], name, [point]) for name, point in extra]
    T = [places.modal([(1.0, side)] if side else [], each) for side in named]
    nodal = [places.nodal([(1.0, side)] if side else [], each) for side in named]
    for contact in contacts:
        frames = contact.frames
        sides = [(frames, contact.side)]
        if contact.other is not None:
            sides.append((-frames, contact.other))
        T.append(places.modal(sides, frames.shape[0]))
        nodal.append(places.nodal(sides, frames.shape[0]))
    T += [places.modal([(1.0, side)], each) for side in further]
    nodal += [places.nodal([(1.0, side)], each) for side in further]
    sizes = [len(contact.tributary) for contact in contacts]
    whole = ModalBasis(
        angular_frequencies=np.concatenate([one.angular_frequencies for one in bases.values()]),
        damping=places.blocks([one.damping for one in bases.values()]),
        T=np.concatenate(T).reshape(-1, each, places.modes),
        positions=np.concatenate([
            *(_position(bases, side, point) for side, point in zip(named, ("B", "C"), strict=True)),
            *(contact.places for contact in contacts),
            *(bases[name].positions[[bases[name].point_index(point)]] for name, point in extra)]),
        tributary=np.concatenate([np.zeros(0), *(contact.tributary for contact in contacts)]),
        extra=tuple(f"{name}.{point}" for name, point in extra),
        mode_shapes=places.joined_shapes(nodal),
        groups=tuple(zip((*pairings, *springs), counts, strict=True)),
        thickness=_common([one.thickness for one in bases.values()]),
        inertia_rows=_side_by_side([one.inertia_rows for one in bases.values()]),
        boundaries=tuple(f"{name}.{boundary}" for name, basis in bases.items()
                         for boundary in basis.boundaries),
        boundary_rows=_boundary_rows(bases, places),
        stiffness=places.blocks([one.stiffness_matrix for one in bases.values()]) if any(
            one.stiffness is not None for one in bases.values()) else None,
        contact_normals=np.concatenate([np.zeros((0, d)), *(one.normals for one in contacts)]),
        on_ground=np.repeat([contact.other is None and not contact.spring for contact in contacts],
                            sizes).astype(bool),
        parts=places.parts,
        springs=tuple(springs),
        first_passes=tuple(halves),
        rotation=_rotation(bases, places),
        constant_load=_constant_loads(bases),
        large_deflections=tuple(
            forces.in_modes(np.eye(basis.modes, places.modes, places.columns(name).start))
            for name, basis in bases.items() for forces in basis.large_deflections),
    )
    joints = [link for link in (links.values() if isinstance(links, Mapping) else links)
              if not isinstance(link, NonlinearSpring)]
    return linked(whole, joints) if joints else whole


def _constant_loads(bases: Mapping[str, ModalBasis]) -> Array | None:
    """The constant modal forces (m,) of all bodies; None if there are none."""
    if all(one.constant_load is None for one in bases.values()):
        return None
    return np.concatenate([np.zeros(one.modes) if one.constant_load is None else one.constant_load
                           for one in bases.values()])


def _rotation(bases: Mapping[str, ModalBasis], places: "_Places") -> ModalRotation | None:
    """The rotation that all bodies have in common, or those of them that rotate."""
    common = next((one.rotation for one in bases.values() if one.rotation is not None), None)
    if common is None:
        return None
    given = [one.rotation or replace(
        common, coriolis=np.zeros((one.modes, one.modes)), load=np.zeros(one.modes),
        stiffening=np.zeros((one.modes, one.modes))) for one in bases.values()]
    return replace(common, coriolis=places.blocks([one.coriolis for one in given]),
                   stiffening=places.blocks([one.stiffening for one in given]),
                   load=np.concatenate([one.load for one in given]))


class _Places:
    """Blocks of the bodies in vectors of modal coordinates and of nodes."""

    def __init__(self, bases: Mapping[str, ModalBasis]) -> None:
        self.bases = bases
        self.dimension = next(iter(bases.values())).dimension
        mode = node = 0
        parts = []
        for name, basis in bases.items():
            nodes = 0 if basis.mode_shapes is None else len(basis.mode_shapes.nodes)
            parts.append(BodyPart(name, (mode, basis.modes), (node, nodes)))
            mode, node = mode + basis.modes, node + nodes
        self.parts, self.modes, self.nodes = tuple(parts), mode, node
        self._of = {part.name: part for part in parts}

    def columns(self, body: str) -> slice:
        """Modal coordinates of a body."""
        first, count = self._of[body].modes
        return slice(first, first + count)

    def modal(self, sides: Sequence[tuple[Any, _Side]], rows: int) -> Array:
        """Rows (rows, m): the sum of factors times those of sides."""
        found = np.zeros((rows, self.modes))
        for factor, side in sides:
            found[:, self.columns(side.body)] += factor * side.modal if isinstance(
                factor, float) else factor @ side.modal
        return found

    def nodal(self, sides: Sequence[tuple[Any, _Side]], rows: int) -> Any:
        """Sparse rows (rows, d N) over the nodes: the sum of factors times those of sides."""
        import scipy.sparse as sp

        found = sp.csr_array((rows, self.dimension * self.nodes))
        for factor, side in sides:
            first, count = self._of[side.body].nodes
            if not count:
                continue
            part = sp.coo_array(factor * side.nodal if isinstance(factor, float)
                                else factor @ side.nodal)
            found = found + sp.csr_array(sp.coo_array(
                (part.data, (part.row, part.col + self.dimension * first)), shape=found.shape))
        return found

    def blocks(self, matrices: Sequence[Array]) -> Array:
        """Matrices (m_k, m_k) along the diagonal."""
        found = np.zeros((self.modes, self.modes))
        for part, matrix in zip(self.parts, matrices, strict=True):
            columns = self.columns(part.name)
            found[columns, columns] = matrix
        return found

    def joined_shapes(self, restriction: Sequence[Any]) -> ModeShapes | None:
        """The shapes of all bodies, zero outside their own blocks; None if no body has any."""
        import scipy.sparse as sp

        given = [(part, shapes) for part in self.parts
                 if (shapes := self.bases[part.name].mode_shapes) is not None]
        if not given:
            return None
        d = self.dimension
        moved = np.zeros((self.nodes, d, self.modes))
        stress = np.zeros((self.nodes, 4 if d == 2 else 6, self.modes))
        for part, one in given:
            nodes = slice(part.nodes[0], sum(part.nodes))
            moved[nodes, :, self.columns(part.name)] = one.shapes
            stress[nodes, :, self.columns(part.name)] = one.stress
        bent = [(part, one.nonlinear_stress) for part, one in given
                if one.nonlinear_stress is not None]
        temperature = None
        if any(one.temperature is not None for _, one in given):
            temperature = np.concatenate([
                np.zeros(len(one.nodes)) if one.temperature is None else one.temperature
                for _, one in given])
        elements = [one.cells if one.elements is None else one.elements for _, one in given]
        cells = of_one_width([one.cells for _, one in given])
        outlines = triangles_if_mixed([one.outline for _, one in given])
        first = [part.nodes[0] for part, _ in given]

        def together(arrays: Sequence[Any]) -> Any:
            return np.concatenate([array + start for array, start in zip(arrays, first,
                                                                         strict=True)])

        return ModeShapes(
            nodes=np.concatenate([one.nodes for _, one in given]), cells=together(cells),
            outline=together(outlines), shapes=moved, stress=stress,
            restriction=sp.csr_array(sp.vstack(list(restriction))),
            elements=together(of_one_width(elements)),
            nonlinear_stress=self._joined_stress(bent) if bent else None,
            temperature=temperature)

    def _joined_stress(self, given: Sequence[tuple[BodyPart, NonlinearStress]]) -> NonlinearStress:
        """Nonlinear stress of all bodies, each of its own coordinates and nodes."""
        d, p = np.sum([one.powers.shape[::-1] for _, one in given], axis=0)
        coordinates, powers = np.zeros((d, self.modes)), np.zeros((p, d), dtype=np.int64)
        stress = np.zeros((self.nodes, given[0][1].stress.shape[1], p))
        row = term = 0
        for part, one in given:
            rows = slice(row, row := row + len(one.coordinates))
            terms = slice(term, term := term + len(one.powers))
            coordinates[rows, self.columns(part.name)] = one.coordinates
            powers[terms, rows] = one.powers
            stress[part.nodes[0] : sum(part.nodes), :, terms] = one.stress
        return NonlinearStress(coordinates, powers, stress)


def _contact(bases: Mapping[str, ModalBasis], pairing: Pairing | PointPairing) -> _Contact:
    for name in (pairing.body, pairing.other):
        if name is not None and name not in bases:
            raise InputError(f"there is no body '{name}'{nearest(str(name), bases)}; the bodies "
                             f"are {choices(bases)}.")
    body, other = pairing.body, pairing.other
    if isinstance(pairing, PointPairing):
        basis = bases[body]
        places = basis.positions[[basis.point_index(point) for point in pairing.points]]  # type: ignore[union-attr]
        side = _points(basis, body, pairing.points)
        feet = None if other is None else _points(bases[other], other, pairing.other_points)
    else:
        places = pairing.places
        side = _faces(bases[body], body, pairing.nodes)
        feet = None if other is None else _faces(bases[other], other, pairing.feet)
    d = bases[body].dimension
    normals = np.eye(d)[[-1] * len(places)] if pairing.normals is None else np.asarray(
        pairing.normals)
    if normals.shape[1] != d:
        raise InputError(f"normals must have {d} components, as body '{body}' is "
                         f"{'one of the plane' if d == 2 else 'a solid'}, not {normals.shape[1]}.")
    return _Contact(places, normals, np.asarray(pairing.tributary), side, feet)


def _spring_contact(
    bases: Mapping[str, ModalBasis], name: str, spring: NonlinearSpring
) -> _Contact:
    row = spring_row(bases, name, spring)
    side, *other = (_points(bases[body], body, [point]) for body, point in row.ends)
    return _Contact(row.place[None], row.direction[None], np.ones(1), side,
                    other[0] if other else None, spring=True)


def _points(basis: ModalBasis, name: str, points: Any) -> _Side:
    index = np.array([basis.point_index(point) for point in points])
    each = basis.T.shape[1]
    rows = (each * index[:, None] + np.arange(each)).ravel()
    shapes = basis.mode_shapes
    return _Side(name, basis.T[index].reshape(-1, basis.modes),
                 None if shapes is None else shapes.restriction.tocsr()[rows])


def _faces(basis: ModalBasis, name: str, rows: Any) -> _Side:
    shapes = basis.mode_shapes
    if shapes is None:
        raise InputError(f"the basis of body '{name}' holds no shapes over the body, which a "
                         f"pairing of faces needs; give a PointPairing between named points.")
    if rows.shape[1] != shapes.nodes.size:
        raise InputError(f"the pairing was made for another mesh of body '{name}', of "
                         f"{rows.shape[1] // basis.dimension} nodes, not "
                         f"{len(shapes.nodes)}; pair the faces of the same bodies.")
    return _Side(name, np.asarray(rows @ shapes.shapes.reshape(rows.shape[1], -1)), rows)


def _check_name(what: str, name: Any) -> None:
    if not isinstance(name, str) or not name or "." in name:
        raise InputError(f"The name {name!r} of {'an' if what[0] in 'aeiou' else 'a'} {what} must "
                         f"be a text without dots.")


def _check_bodies(bases: Mapping[str, ModalBasis]) -> None:
    if not bases:
        raise InputError("Several bodies: bodies is empty; give the modal basis of at least one.")
    for name, basis in bases.items():
        _check_name("body", name)
        require_kind(f"Body '{name}'", ModalBasis, basis=basis)
        if basis.parts:
            raise InputError(f"Body '{name}' consists of several bodies itself; give these one by "
                             f"one.")
    # In the frame at rest a body that rotates may touch others that do not.
    alike = [(name, basis) for name, basis in bases.items() if basis.rotation is not None]
    if not any(basis.rotation.standing for _, basis in alike if basis.rotation is not None):
        alike = list(bases.items())
    first, one = alike[0]
    for name, basis in alike:
        if (basis.rotation is None) != (one.rotation is None) or (
                basis.rotation is not None and one.rotation is not None
                and not basis.rotation.is_about_that_of(one.rotation)):
            raise InputError(f"Body '{name}' does not rotate as '{first}' does: rows in one frame "
                             f"would turn against those of the other. Give all bodies the same "
                             f"axis and speed; or prescribe the sliding of interfaces and leave "
                             f"out rotation, or give a body of revolution frame = 'standing'.")
        if basis.rotation is not None and basis.rotation.stressed and len(bases) > 1 and (
                not basis.rotation.standing):
            raise InputError(f"Body '{name}' rotates with the stress that its supports alone make, "
                             f"but bodies of an assembly pull on each other; give "
                             f"Rotation(..., stress_stiffening=False), and the stress of the "
                             f"common static state as prestress.")
    kinds = {name: basis.dimension for name, basis in bases.items()}
    if len(set(kinds.values())) > 1:
        plane, solid = (choices([name for name, d in kinds.items() if d == one]) for one in (2, 3))
        raise InputError(f"Several bodies must be all in the plane or all in space, but {plane} "
                         f"and {solid} are mixed; model them alike.")


def _has(basis: ModalBasis, point: str) -> bool:
    return bool(basis.T[basis.point_index(point)].any())


def _named_point(bases: Mapping[str, ModalBasis], point: str) -> _Side | None:
    """B or C of the one body that has it."""
    having = [name for name, basis in bases.items() if _has(basis, point)]
    if len(having) > 1:
        raise InputError(f"The bodies {choices(having)} all have a point {point}, but drive and "
                         f"load know one; leave it out of all bases but one, and name further "
                         f"points by points=.")
    return _points(bases[having[0]], having[0], [point]) if having else None


def _position(bases: Mapping[str, ModalBasis], side: _Side | None, point: str) -> Array:
    if side is None:
        return np.zeros((1, next(iter(bases.values())).dimension))
    return bases[side.body].positions[[bases[side.body].point_index(point)]]


def _common(values: Sequence[float | None]) -> float | None:
    return values[0] if len(set(values)) == 1 else None


def _side_by_side(rows: Sequence[Array | None]) -> Array | None:
    known = [one for one in rows if one is not None]
    return np.hstack(known) if len(known) == len(rows) else None


def _boundary_rows(bases: Mapping[str, ModalBasis], places: _Places) -> Array:
    d = places.dimension
    found = [np.zeros((0, d, places.modes))]
    for name, basis in bases.items():
        rows = np.zeros((len(basis.boundaries), d, places.modes))
        rows[:, :, places.columns(name)] = basis.boundary_rows
        found.append(rows)
    return np.concatenate(found)
