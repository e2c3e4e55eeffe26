r"""Modes of the bodies of one sector by nodal diameters, with rows of contact nodes and points.

Motions of the nodal diameter k repeat from sector to sector with the phase k alpha,

.. math:: u_s = Re(u e^{i k s \alpha}), \qquad u = \Phi_k y

in coordinates that turn with the sector. A contact node between a body of the sector and one of
the next has the relative displacement

.. math:: d = (W_a \Phi_k - e^{i k \alpha} W_b R \Phi_k) y

with rows W_a and W_b of node and foot and the rotation R by alpha. All sectors together have one
such interface each, so that forces f at its nodes load the motion y with the conjugate rows.
"""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fecontact.core.checks import as_texts, require_kind
from fecontact.core.errors import InputError, ModelWarning, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.tables import located
from fecontact.core.types import Array, ComplexArray
from fecontact.core.units import Summarised, listed, span
from fecontact.fem.body_forces import boundary_forces
from fecontact.fem.cyclic_symmetry import NEXT, CyclicSymmetry, sector_nodes
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import BodyFields, stress_of
from fecontact.fem.pairing import Pairing
from fecontact.fem.points import Place
from fecontact.fem.rotation import Rotation, coriolis_matrix
from fecontact.fem.thermal import Temperature, held_stress
from fecontact.reduction.cyclic.constant_forces import (
    constant_forces,
    require_same_temperature,
    warmed,
    with_constant,
)
from fecontact.reduction.cyclic.sector_rows import SectorRows, known_bodies, owned
from fecontact.reduction.damping import Damping, modal_damping
from fecontact.reduction.eigenmodes import FreeSystem, free_modes, frequencies_of
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import BodyPart
from fecontact.reduction.prestress import geometric_stiffness
from fecontact.reduction.sector_modes import alike, chosen_diameters, modes_of_diameter
from fecontact.reduction.sector_rotation import (
    in_shapes,
    require_common_axis,
    stiffening_matrix,
)
from fecontact.reduction.static_modes.residual_vectors import completing

_OWNER = "cyclic_basis"
# Eigenvalues of a stiffness are negative beyond this part of the largest.
_NEGATIVE = 1e-9


@read_only_arrays
@dataclass(frozen=True, eq=False)
class DiameterModes:
    """Mass-normalised modes of one nodal diameter k: ``y'' + damping y' + stiffness y = T^H f``.

    Attributes
    ----------
    diameter : int
        k.
    stiffness, damping : (m, m) complex array
        Hermitian [1/s^2]; damping with a skew-Hermitian part of Coriolis forces [1/s].
    T : (P, 3, m) or (P, 6, m) complex array
        Rows of points and contact nodes, as :attr:`fecontact.ModalBasis.T` has them.
    boundary_rows : (b, d, m) complex array
        Forces of a pressure and shears of 1 Pa on the loaded boundaries.
    shapes : mapping of body to (N, d, m) complex array
        Displacements of its nodes.
    """

    diameter: int
    stiffness: ComplexArray
    damping: ComplexArray
    T: ComplexArray
    boundary_rows: ComplexArray
    shapes: Mapping[str, ComplexArray]

    @property
    def conjugate(self) -> "DiameterModes":
        """Modes of the diameter N - k."""
        return DiameterModes(-self.diameter, self.stiffness.conj(), self.damping.conj(),
                             self.T.conj(), self.boundary_rows.conj(),
                             {name: shape.conj() for name, shape in self.shapes.items()})


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class CyclicBasis(Summarised):
    """Modes of a wheel of equal sectors that touch each other, made by :func:`cyclic_basis`.

    Attributes
    ----------
    symmetry : CyclicSymmetry
    bodies : mapping of name to ElasticBody
        Bodies of one sector; none of
        :func:`~fecontact.reduction.cyclic_basis_from_bases`.
    diameters : tuple of DiameterModes
        Modes of the nodal diameters, ascending from 0.
    basis : ModalBasis
        Basis of the diameter 0, in which all sectors move alike: for preload and equilibria. Its
        constant load is the centrifugal force and that of a change of temperature.
    gaps : (n,) array
        Initial gaps of the contact nodes [m].
    loads : tuple of str
        Boundaries ``body.boundary`` on which loads may vary in time.
    temperature : mapping of name to (N,) array
        Changes of temperature at the nodes of bodies [K].
    """

    symmetry: CyclicSymmetry
    bodies: Mapping[str, ElasticBody]
    diameters: tuple[DiameterModes, ...]
    basis: ModalBasis
    gaps: Array
    loads: tuple[str, ...] = ()
    temperature: Mapping[str, Array] = field(default_factory=dict)

    def summary(self) -> list[tuple[str, str]]:
        """Sectors, bodies, nodal diameters and frequencies."""
        hertz = np.concatenate([np.sqrt(np.maximum(np.linalg.eigvalsh(one.stiffness), 0.0))
                                for one in self.diameters]) / (2.0 * np.pi)
        bodies = [part.name for part in self.basis.parts]
        return [("sectors", f"{self.symmetry.sectors}"), ("bodies", listed(bodies)),
                ("nodal diameters", listed([str(one.diameter) for one in self.diameters])),
                ("modes of each", listed([str(len(one.stiffness)) for one in self.diameters], 6)),
                ("frequencies", span(hertz, "Hz")),
                ("contact nodes", f"{self.basis.contact_nodes}"),
                ("points", listed(list(self.basis.extra)))]

    def of(self, diameter: int) -> DiameterModes:
        """Modes of any diameter, counted modulo N; beyond N / 2 conjugates of those of N - k.

        Raises
        ------
        InputError
            For a diameter that was left out.
        """
        N = self.symmetry.sectors
        k = int(diameter) % N
        folded = min(k, N - k)
        for one in self.diameters:
            if one.diameter == folded:
                return one if folded == k else one.conjugate
        raise InputError(f"CyclicBasis: there are no modes of the nodal diameter {folded}; it has "
                         f"{listed([str(one.diameter) for one in self.diameters])}. Make the basis "
                         f"with diameters = 'all', or with this one.")

    def fields(self, q: Array, body: str) -> BodyFields:
        """Displacement and stress of a body where all sectors move alike, as under preload.

        ``q`` (m,) are coordinates of :attr:`basis`, such as those of an equilibrium; these fields
        are the ``prestress`` of the next basis.
        """
        if body not in self.bodies:
            raise InputError(f"fields: there is no body {body!r}{nearest(body, self.bodies)}; the "
                             f"bodies are {choices(self.bodies)}.")
        one = self.bodies[body]
        moved = (self.of(0).shapes[body] @ np.asarray(q)).real
        stress, warm = stress_of(one, moved.reshape(-1, 1))[:, :, 0], self.temperature.get(body)
        if warm is not None:
            stress = stress + held_stress(one, warm)
        return BodyFields(one.nodes, one.elements, moved, stress, warm)


def cyclic_basis(
    bodies: Mapping[str, ElasticBody],
    symmetry: CyclicSymmetry,
    pairings: Mapping[str, Pairing] | None = None,
    *,
    modes: int | Mapping[str, int] = 20,
    rigid: Sequence[str] = (),
    points: Mapping[str, Place] | None = None,
    loads: Sequence[str] = (),
    damping: Any = 0.0,
    diameters: Iterable[int] | str = "all",
    rotation: Rotation | None = None,
    prestress: Mapping[str, BodyFields] | None = None,
    temperature: Mapping[str, Temperature] | None = None,
) -> CyclicBasis:
    """Modes of one sector by nodal diameters, with its contact to itself and to the next sector.

    Static responses to forces at contact nodes and points, rotation and heat are exact. A speed or
    stress beyond divergence or buckling warns (``ModelWarning``).

    Parameters
    ----------
    bodies : mapping of name to ElasticBody
        Bodies of one sector, such as a blade with its part of the disc, and a damper. Bodies that
        have neither of the boundaries of the symmetry do not go on into the next sector.
    symmetry : CyclicSymmetry
        N, the axis, and the boundaries at which bodies go on into the neighbours.
    pairings : mapping of interface to Pairing
        Faces that may touch each other, or ``next_NAME``, see :meth:`CyclicSymmetry.next_sector`.
    modes : int or mapping of body to int
        Vibration modes of each nodal diameter, rigid ones included, at most all.
    rigid : sequence of str
        Bodies without these boundaries that are rigid.
    points : mapping of 'body.name' to place
        Points for loads and results.
    loads : sequence of 'body.boundary'
        Boundaries on which pressures may vary in time.
    damping : float, Rayleigh, LossFactor, or mapping of body to one of them
        Damping of all modes of all diameters; residual vectors are modes too.
    diameters : sequence of int or 'all'
        Nodal diameters up to N / 2; 0 is always there. Engine order m needs those of all h m.
    rotation : Rotation, optional
        Rotation, with the stress of each body under its supports alone; where bodies touch,
        switch it off and give the common state as ``prestress``.
    prestress : mapping of body to BodyFields
        Fields whose stress stiffens the bodies; see :meth:`CyclicBasis.fields`.
    temperature : mapping of body to float, (N,) array, function of the coordinates or 'mesh'
        Change [K] from the state without stress, in all sectors alike; stiffens by ``prestress``.

    Raises
    ------
    InputError, MeshError
        For unknown names, faces or pairings that do not match.
    """
    require_kind(_OWNER, Mapping, bodies=bodies)
    require_kind(_OWNER, CyclicSymmetry, symmetry=symmetry)
    pairings, points, prestress = dict(pairings or {}), dict(points or {}), dict(prestress or {})
    rigid = known_bodies("rigid", rigid, bodies)
    known_bodies("prestress", prestress, bodies)
    warm = warmed(bodies, {} if temperature is None else temperature, rigid)
    constant = {name: constant_forces(body, rotation, warm.get(name))
                for name, body in bodies.items()}
    counts = modes if isinstance(modes, Mapping) else dict.fromkeys(bodies, modes)
    dampings = damping if isinstance(damping, Mapping) else dict.fromkeys(bodies, damping)
    for name, body in bodies.items():
        require_kind(f"cyclic_basis: body '{name}'", ElasticBody, body=body)
        if "." in name or name.startswith(NEXT):
            raise InputError(f"cyclic_basis: the name '{name}' of a body must have no dot and not "
                             f"begin with '{NEXT}', which is for bodies of the next sector.")
        for what, values in (("modes", counts), ("damping", dampings)):
            if name not in values:
                raise InputError(f"cyclic_basis: {what} lacks the body '{name}'.")
    if not bodies:
        raise InputError("cyclic_basis: bodies is empty; give at least one.")
    separate = _without_boundaries(bodies, symmetry)
    for name in rigid:
        if name not in separate:
            raise InputError(f"cyclic_basis: body '{name}' is rigid, but goes on into its "
                             f"neighbours; a rigid one has no boundaries '{symmetry.low}', "
                             f"'{symmetry.high}'.")
    chosen = sorted({0, *chosen_diameters(symmetry, diameters, _OWNER)})
    nodes = SectorRows.of(bodies, symmetry, pairings, points)
    parts = {}
    for name, body in bodies.items():
        with located(f"Body '{name}':"):
            given = _Terms.of(body, symmetry, rotation, prestress.get(name),
                              name in separate)
            if name in warm and given.nodes is not None:
                require_same_temperature(body, symmetry, given.nodes, warm[name])
            parts[name] = {k: _modes_of_body(
                body, symmetry, given, k, counts[name],
                with_constant(nodes.loaded(name, k), None if k else constant[name]),
                name in separate, name in rigid) for k in chosen}
        if name not in separate:
            _warn_beyond_divergence(name, parts[name])
    loaded = _loaded(bodies, loads)
    found = tuple(_diameter(k, {name: one[k] for name, one in parts.items()}, bodies, nodes,
                            dampings, loaded) for k in chosen)
    first = found[0]
    m, w = len(first.stiffness), np.concatenate([one[0].w for one in parts.values()])
    load = np.concatenate([parts[name][0].shapes.real.T @ forces
                           for name, forces in constant.items()])
    boundaries = {f"{name}.{boundary}": boundary_forces(body, boundary)
                  for name, body in bodies.items() for boundary in body.mesh.boundaries}
    rows = [np.zeros((0, nodes.dimension, m))]
    for boundary, forces in boundaries.items():
        owner = boundary.partition(".")[0]
        rows.append((forces.T @ np.hstack([
            (one[0].shapes if name == owner else np.zeros((len(forces), len(one[0].w))))
            for name, one in parts.items()]).real)[None])
    basis = ModalBasis(
        angular_frequencies=w, damping=first.damping.real, T=first.T.real,
        positions=nodes.positions, tributary=nodes.tributary, extra=tuple(points),
        groups=nodes.groups,
        thickness=next(iter(bodies.values())).thickness if nodes.dimension == 2 else None,
        boundaries=tuple(boundaries), boundary_rows=np.concatenate(rows),
        stiffness=None if not (rotation or prestress) else first.stiffness.real,
        contact_normals=nodes.normals, on_ground=nodes.on_ground,
        constant_load=load if load.any() else None, parts=_parts(parts))
    return CyclicBasis(symmetry, dict(bodies), found, basis, nodes.gaps, tuple(loads), warm)


def _without_boundaries(
    bodies: Mapping[str, ElasticBody], symmetry: CyclicSymmetry
) -> tuple[str, ...]:
    """Bodies that have none of the boundaries; InputError if it is none that has both."""
    names = {symmetry.low, symmetry.high}
    found = tuple(name for name, body in bodies.items() if not names & set(body.mesh.boundaries))
    if len(found) == len(bodies):
        known = sorted({one for body in bodies.values() for one in body.mesh.boundaries})
        raise InputError(f"cyclic_basis: no body has the boundaries '{symmetry.low}' and "
                         f"'{symmetry.high}' at which sectors meet; there are {choices(known)}.")
    return found


def _warn_beyond_divergence(name: str, modes: Mapping[int, "_BodyModes"]) -> None:
    """Warn of diameters at which a body's stiffness, with rotation and stress, is not positive."""
    beyond = [str(k) for k, one in modes.items()
              if (squares := np.linalg.eigvalsh(one.stiffness))[0] < -_NEGATIVE * squares[-1]]
    if beyond:
        warnings.warn(f"Body '{name}': at the nodal diameters {listed(beyond)} the stiffness with "
                      f"rotation and stress is not positive, as beyond divergence or buckling; "
                      f"lower the speed or the load.", ModelWarning, stacklevel=3)


def _loaded(
    bodies: Mapping[str, ElasticBody], loads: Sequence[str]
) -> list[tuple[str, Array]]:
    """Owner and nodal forces (d N, d) of each boundary with loads in time."""
    found = []
    for name in as_texts(loads, "cyclic_basis: loads"):
        owner, boundary = owned("loads", name, bodies)
        found.append((owner, boundary_forces(bodies[owner], boundary)))
    return found


def _parts(parts: Mapping[str, Mapping[int, "_BodyModes"]]) -> tuple[BodyPart, ...]:
    found, first = [], 0
    for name, one in parts.items():
        count = len(one[0].w)
        found.append(BodyPart(name, (first, count), (0, 0)))
        first += count
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _BodyModes:
    """Frequencies at rest (m,), shapes (d N, m) complex, stiffness and Coriolis terms (m, m)."""

    w: Array
    shapes: ComplexArray
    stiffness: ComplexArray
    turning: ComplexArray


@dataclass(frozen=True, eq=False)
class _Terms:
    """Matrices, sparse (d N, d N), that rotation and stress add to stiffness and damping."""

    nodes: Any
    system: FreeSystem | None
    stiffness: Any
    turning: Any

    @classmethod
    def of(
        cls, body: ElasticBody, symmetry: CyclicSymmetry, rotation: Rotation | None,
        prestress: BodyFields | None, separate: bool,
    ) -> "_Terms":
        nodes = None if separate else sector_nodes(body, symmetry)
        system = FreeSystem.of(body) if separate else None
        extra, turning = 0.0 * body.mass, 0.0 * body.mass
        if rotation is not None:
            require_common_axis(body, symmetry, rotation, _OWNER)
            if nodes is not None:
                motions = alike(body, symmetry, nodes)
            else:
                assert system is not None
                motions = body.expansion, system
            extra = extra + rotation.speed**2 * stiffening_matrix(body, rotation, *motions)
            if rotation.coriolis:
                turning = rotation.speed * coriolis_matrix(body, rotation)
        if prestress is not None:
            extra = extra + geometric_stiffness(body, prestress)
        return cls(nodes, system, extra, turning)


def _modes_of_body(
    body: ElasticBody, symmetry: CyclicSymmetry, terms: _Terms, diameter: int, count: int,
    rows: Any, separate: bool, rigid: bool,
) -> _BodyModes:
    """Modes of a body in a nodal diameter, with residual vectors of forces along rows (p, d N)."""
    if not separate:
        w, shapes = modes_of_diameter(body, symmetry, terms.nodes, diameter, count, rows)
    else:
        assert terms.system is not None
        w, shapes = _separate_modes(body, terms.system, count, rows, rigid)
    flat = shapes.reshape(body.unknowns, -1)
    turning, stiffness = in_shapes(flat, terms.turning, terms.stiffness)
    return _BodyModes(w, flat, np.diag(w**2) + stiffness, turning)


def _separate_modes(
    body: ElasticBody, system: FreeSystem, count: int, rows: Any, rigid: bool
) -> tuple[Array, ComplexArray]:
    """Modes of a body that does not go on into its neighbours: those of any diameter."""
    if rigid:
        found = system.rigid
        if not found.shape[1]:
            raise InputError("cyclic_basis: the body is rigid, but its supports leave it no "
                             "motion; leave it out, or let it move.")
    else:
        _, found = free_modes(system, min(count, system.stiffness.shape[0]))
        if rows.shape[0]:
            # Rows of both components of a complex phase: real and imaginary part.
            forces = np.asarray((body.expansion.T @ rows.T.conj()).toarray())
            forces = np.hstack([forces.real, forces.imag])
            found = np.hstack([found, completing(system, found, system.deflection(forces))])
    shapes = np.asarray(body.expansion @ found)
    w = frequencies_of(body, shapes)
    w[: system.rigid.shape[1]] = 0.0
    return w, np.asarray(shapes, dtype=complex)


def _diameter(
    k: int, parts: Mapping[str, _BodyModes], bodies: Mapping[str, ElasticBody], nodes: SectorRows,
    dampings: Mapping[str, Damping], loaded: Sequence[tuple[str, Array]],
) -> DiameterModes:
    """All bodies of one nodal diameter, one after the other."""
    from scipy.linalg import block_diag

    d = nodes.dimension
    T = nodes.T({name: one.shapes for name, one in parts.items()}, k)
    rows = np.zeros((len(loaded), d, T.shape[2]), dtype=complex)
    for number, (owner, forces) in enumerate(loaded):
        first = 0
        for name, one in parts.items():
            if name == owner:
                rows[number, :, first : first + len(one.w)] = forces.T @ one.shapes
            first += len(one.w)
    shapes, first = {}, 0
    for name, one in parts.items():
        whole = np.zeros((len(one.shapes), T.shape[2]), dtype=complex)
        whole[:, first : first + len(one.w)] = one.shapes
        shapes[name] = whole.reshape(-1, d, T.shape[2])
        first += len(one.w)
    return DiameterModes(
        k, block_diag(*(one.stiffness for one in parts.values())),
        block_diag(*(modal_damping(dampings[name], one.w) + one.turning
                     for name, one in parts.items())),
        T, rows, shapes)
