"""Modal reduction of a finite-element body."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_choice,
    require_finite,
    shown,
)
from fecontact.core.tables import located
from fecontact.core.types import Array, Integers
from fecontact.fem.body_forces import boundary_forces, inertia_forces
from fecontact.fem.contact_face import ContactNodes, contact_groups
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_kinds import row_numbers, unordered
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.faces.surface import linear_facets
from fecontact.fem.fields import BodyFields, linear_cells, stress_of
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.fem.points import Place, Rows, place_rows
from fecontact.fem.rotation import Rotation
from fecontact.fem.thermal import Temperature, held_stress, nodal_temperatures, thermal_forces
from fecontact.reduction.assembly.face_weld import FaceWeld
from fecontact.reduction.assembly.links import Bushing, Link, Links, Weld
from fecontact.reduction.damping import (
    Damping,
    LossFactor,
    Rayleigh,
    material_damping_ratios,
    modal_damping,
)
from fecontact.reduction.eigenmodes import (
    FreeSystem,
    backward_error,
    free_modes,
    frequencies_of,
)
from fecontact.reduction.large_deflections.fit import condensed_body
from fecontact.reduction.large_deflections.options import LargeDeflections
from fecontact.reduction.large_deflections.with_forces import with_large_deflections
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes, NonlinearStress, ReductionQuality
from fecontact.reduction.prestress import (
    coupled,
    geometric_stiffness,
    resists_rotation,
)
from fecontact.reduction.rotating import modal_rotation
from fecontact.reduction.solvers.solid_solver import Eigensolver
from fecontact.reduction.static_modes.craig_bampton import craig_bampton
from fecontact.reduction.static_modes.flexibility import Flexibility
from fecontact.reduction.static_modes.residual_vectors import flexibility_of, residual_modes

Reduction = Literal["vibration", "residual", "craig-bampton"]
Names = TypeAliasType("Names", str | Sequence[str])
Counts = TypeAliasType("Counts", Count | Sequence[Count])


def modal_basis(
    body: ElasticBody,
    modes: int = 20,
    *,
    contact: Names = "contact",
    contact_nodes: Counts = "all",
    B: Place | None = None,
    C: Place | None = None,
    points: Mapping[str, Place] | None = None,
    damping: Damping = 0.0,
    reduction: Reduction = "vibration",
    tolerance: float = 0.1,
    loads: Sequence[Place] = (),
    rotation: Rotation | None = None,
    prestress: BodyFields | None = None,
    temperature: "Temperature | None" = None,
    large_deflections: LargeDeflections | None = None,
    rows: Any = (),
    eigensolver: Eigensolver = "auto",
) -> ModalBasis:
    """Mass-normalised modes of a plane body or solid, and T at B, C and the contact nodes.

    Parameters
    ----------
    body : ElasticBody
        The finite-element body.
    modes : int
        Number of modes, lowest first, rigid-body modes included.
    contact : str or sequence of str
        Boundary that touches the ground, facing -y, of solids -z; several interfaces; or none, ().
    contact_nodes : int or 'all', or one of them for each boundary
        Equal segments of a boundary, each a contact node with the mean displacement; 'all': every
        displacement node. Of solids patches of about equal area, or (n, m) along both tangents.
    B, C : place, optional
        Excitation and load point, "" for none. Default: the mesh's point of that name, if any.
    points : mapping of name to place, optional
        Further points. A place is a name, coordinates or a :class:`~fecontact.Patch`.
    damping : float, (m,) sequence, Rayleigh, LossFactor, 'materials' or (m, m) array
        See :mod:`fecontact.reduction.damping`; the last ratio holds; 'materials': loss factors.
    reduction : 'vibration', 'residual' or 'craig-bampton'
        Modes; with residual vectors for exact static deflections at points; or constraint modes.
    tolerance : float
        For 'residual': largest part missing of the static compliance there; zero keeps all vectors.
    loads : sequence of 'gravity' or place
        Adds static responses to gravity or loads (also moments at reference points).
    rotation : Rotation, optional
        Displacements are those in the frame that rotates with the body, modes those at rest.
    prestress, large_deflections : BodyFields and LargeDeflections, optional
        Stress that stiffens the body; forces of large deflections, see its own documentation.
        With both, displacements count from the stressed body, without the loads of the stress.
    temperature : float, (N,) array, function of the coordinates or 'mesh', optional
        Change [K], a constant load that completes the modes; see :mod:`fecontact.fem.thermal`.
    rows, eigensolver : sequence of sparse (k, d N) arrays; 'auto', 'direct' or 'iterative'
        Further motions with forces, see :func:`fecontact.reduction.reduce_bodies`; of solids, see
        :func:`fecontact.reduction.eigenmodes.eigenmodes`.

    Raises
    ------
    InputError, MeshError
        For unknown names, places outside the body, an upward contact face, too many modes or nodes.
    """
    import scipy.sparse as sp

    require_kind("modal_basis", ElasticBody, body=body)
    points = {} if points is None else points
    require_kind("points", Mapping, points=points)
    require_kind("modal_basis", (Rotation, type(None)), rotation=rotation)
    require_finite("modal_basis", tolerance=tolerance)
    for name in points:
        require_kind("points", str, name=name)
        if name in ("B", "C"):
            raise InputError(f"points: the name '{name}' is reserved; use {name}=... instead.")
    if reduction not in get_args(Reduction):
        raise InputError(f"reduction = {reduction!r} must be one of {choices(get_args(Reduction))}"
                         f"{nearest(str(reduction), get_args(Reduction))}.")
    if not 0.0 <= tolerance < 1.0:
        raise InputError(f"tolerance = {tolerance!r} must be zero or above, and below one.")
    d = body.dimension
    face = contact_groups(body, contact, contact_nodes)
    named = [_point(body, place, name) for name, place in (("B", B), ("C", C))]
    further = [place_rows(body, place, name) for name, place in points.items()]
    restriction = sp.csr_array(sp.vstack(
        [*(row.matrix for row in named), face.matrix, *(row.matrix for row in further)]))
    if loads and reduction == "vibration":
        raise InputError("loads complete the modes only with reduction = 'residual' or "
                         "'craig-bampton'; choose one of these, or leave loads out.")
    if large_deflections is not None:
        _check_large_deflections(large_deflections, reduction, rotation, temperature)
    warm = None if temperature is None else _warmed(body, temperature, reduction)
    expanding = None if warm is None else thermal_forces(body, warm)
    stress = None if prestress is None else geometric_stiffness(body, prestress)
    held = stress is not None and not resists_rotation(body, stress)
    system = FreeSystem.of(body, eigensolver, stress if held else None)
    completing = loading(body, system, loads, points, expanding)
    # At B, C and the contact nodes there are forces, but no moments.
    at_points = sp.csr_array(displacement_rows(restriction, d))
    require_kind("modal_basis", Sequence, rows=rows)
    further_rows = [_given_rows(body, given) for given in rows]
    vibration = None if reduction == "craig-bampton" else free_modes(system, modes)
    flexibility = flexibility_of(system, sp.csr_array(
        sp.vstack([at_points, *further_rows]) @ body.expansion),
        0.0 if vibration is None else tolerance, vibration)
    row = np.arange(len(flexibility.rows.indptr) - 1)
    is_point = row < at_points.shape[0]
    used = (row < d * (2 + len(face.tributary))) | ~is_point
    condensed = None if large_deflections is None else condensed_body(
        body, system, *flexibility.modes, large_deflections, stress)
    fields = None if condensed is None else condensed.independent_fields(
        system, flexibility.modes[1])
    w, free_shapes, own = _modes(flexibility.of_rows(used), modes, reduction, tolerance,
                                 completing, fields)
    shapes = body.expansion @ free_shapes
    elastic = w > 0.0
    w[elastic] = frequencies_of(body, shapes[:, elastic], stress if held else None)
    if isinstance(damping, str):
        require_choice("modal_basis", "damping", damping, ("materials",))
        damping = np.where(elastic, material_damping_ratios(body, shapes), 0.0)
    elif not isinstance(damping, Rayleigh | LossFactor | float | int):
        given = as_floats(damping, "The damping")
        if given.shape == (modes,) and len(w) > modes:
            damping = np.append(given, np.full(len(w) - modes, given[-1]))
    names = tuple(body.mesh.boundaries)
    forces = np.stack([inertia_forces(body), *(boundary_forces(body, name) for name in names)])
    rows = np.asarray(forces.transpose(0, 2, 1) @ shapes)
    elements = body.elements
    turning = None if rotation is None else modal_rotation(
        body, system, rotation, shapes, None if condensed is None else condensed.modes)
    springs, _, dashpots = body.springs
    rates = springs @ shapes
    basis = ModalBasis(
        angular_frequencies=w,
        damping=modal_damping(damping, w) + rates.T @ (dashpots[:, None] * rates),
        T=(restriction @ shapes).reshape(-1, 3 * (d - 1), len(w)),
        positions=np.array([*(row.position for row in named), *face.positions,
                            *(row.position for row in further)]),
        tributary=face.tributary,
        extra=tuple(points),
        mode_shapes=ModeShapes(
            nodes=body.nodes,
            cells=linear_cells(body.nodes, elements),
            outline=first_order(body, body.mesh.outline),
            shapes=shapes.reshape(-1, d, len(w)),
            stress=stress_of(body, shapes),
            restriction=restriction,
            elements=elements,
            outline_nodes=None if d == 2 else _nodes_of_outline(body, face),
            nonlinear_stress=None if warm is None else NonlinearStress(
                np.zeros((0, len(w))), np.zeros((1, 0), dtype=np.int64),
                held_stress(body, warm)[..., None]),
            temperature=warm,
        ),
        quality=_quality(body, system, flexibility.of_rows(is_point), w, free_shapes, own,
                         forces),
        groups=face.groups,
        thickness=body.thickness if d == 2 else None,
        inertia_rows=rows[0],
        boundaries=names,
        boundary_rows=rows[1:],
        rotation=None if turning is None else replace(turning, speed=0.0),
        stiffness=None if held or stress is None else coupled(w, shapes, stress),
        constant_load=None if expanding is None else expanding @ shapes,
    )
    if condensed is not None:
        assert large_deflections is not None
        projected = np.einsum("fk,fij->kij", system.mass @ free_shapes, condensed.fields)
        basis = with_large_deflections(basis, condensed, projected, large_deflections, own)
    return basis if turning is None else basis.with_rotation_speed(turning.speed)


def _warmed(body: ElasticBody, temperature: Temperature, reduction: Reduction) -> Array:
    """Changes of temperature (N,) at the nodes; InputError for modes without static responses."""
    if reduction == "vibration":
        raise InputError("temperature needs the static response to it: choose reduction = "
                         "'residual' or 'craig-bampton'.")
    return nodal_temperatures(body, temperature)


def _check_large_deflections(
    given: LargeDeflections, reduction: Reduction, rotation: Rotation | None,
    temperature: Temperature | None,
) -> None:
    """Raise InputError for options that do not go with large deflections."""
    require_kind("modal_basis", LargeDeflections, large_deflections=given)
    if reduction == "craig-bampton":
        raise InputError("large_deflections are those of vibration modes; choose reduction = "
                         "'vibration' or 'residual'.")
    if rotation is not None and rotation.frame == "standing":
        raise InputError("large_deflections go with a rotation in the rotating frame only; choose "
                         "frame = 'rotating', or leave one of them out.")
    if temperature is not None:
        raise InputError("large_deflections and temperature do not go together; leave one of them "
                         "out, or give the static solution with the temperature as prestress.")


def reduce_bodies(
    bodies: Mapping[str, ElasticBody],
    pairings: Sequence[Pairing | TwoPassPairing] = (),
    links: Links = (),
    *,
    modes: int | Mapping[str, int] = 20,
    each: Mapping[str, Mapping[str, Any]] | None = None,
    **options: Any,
) -> dict[str, ModalBasis]:
    """Modal bases of several bodies that can carry the forces between them.

    By default modes with residual vectors of forces at the nodes and feet of the pairings and on
    welded faces (bodies with these get all of them, tolerance = 0), and of forces and moments at
    the points of the links. B and C are those that ``each`` gives to one
    body, or of the one mesh that has points of that name.

    Parameters
    ----------
    bodies : mapping of name to ElasticBody
        The bodies.
    pairings : sequence of Pairing or TwoPassPairing
        Faces where the bodies may touch each other or the ground; the pairings name the bodies.
    links : sequence, or mapping of name to link
        Links between the bodies; points of the meshes need not be among ``points``.
    modes : int or mapping of name to int
        Number of modes of each body, rigid ones included, without residual vectors.
    each : mapping of name to mapping, optional
        Options of single bodies, as for :func:`~fecontact.modal_basis`: ``{"pad": {"damping":
        0.02}}``.
    **options : Any
        Options common to all bodies.

    Returns
    -------
    dict of str to ModalBasis

    Raises
    ------
    InputError, MeshError
        For names of bodies that are not there, and as :func:`~fecontact.modal_basis`.
    """
    require_kind("reduce_bodies", Mapping, bodies=bodies)
    each = {} if each is None else each
    counts = modes if isinstance(modes, Mapping) else dict.fromkeys(bodies, modes)
    named = {name for one in pairings for name in (one.body, one.other) if name is not None}
    for what, names in (("pairings", sorted(named)), ("modes", counts), ("each", each)):
        for name in names:
            if name not in bodies:
                raise InputError(f"reduce_bodies: {what} names the body '{name}'"
                                 f"{nearest(str(name), bodies)}; the bodies are "
                                 f"{choices(bodies)}.")
    found = {}
    passes = [part for one in pairings for part in one.passes]
    joints = [*links.values()] if isinstance(links, Mapping) else links
    ends = ends_of_bodies(bodies, {name: {**options, **each.get(name, {})} for name in bodies})
    for name, body in bodies.items():
        if name not in counts:
            raise InputError(f"reduce_bodies: modes lacks the body '{name}'.")
        rows = [one.nodes for one in passes if one.body == name]
        rows += [one.feet for one in passes if one.other == name]
        given: dict[str, Any] = {"contact": (), "reduction": "residual", **options,
                                 **each.get(name, {}), **ends[name]}
        with located(f"Body '{name}':"):
            given["points"], ending = _joints(name, body, given, joints)
            seams = [row for link in joints if isinstance(link, FaceWeld)
                     for row in link.rows(name)]
            if seams:
                # Faces that lack some of their motions could not follow each other.
                given["tolerance"] = 0.0
            rows = [displacement_rows(one, body.dimension) for one in rows] + ending + seams
            found[name] = modal_basis(body, counts[name], rows=rows, **given)
    return found


def ends_of_bodies(
    bodies: Mapping[str, ElasticBody], given: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Places of B and C of each of several bodies, of which one alone can have them.

    What the options ``given`` of a body name goes before the points of meshes, which count only if
    one mesh alone has them: generated shapes all have B and C.
    """
    found: dict[str, dict[str, Any]] = {name: {} for name in bodies}
    for end in ("B", "C"):
        places = {name: given.get(name, {}).get(end) for name in bodies}
        free = not any(place is not None and not _nowhere(place) for place in places.values())
        having = [name for name, body in bodies.items()
                  if places[name] is None and _has(body, end)]
        for name, place in places.items():
            found[name][end] = place if place is not None or (free and having == [name]) else ""
    return found


def displacement_rows(rows: Any, dimension: int) -> Any:
    """Rows of displacements among the rows of points, without those of rotations."""
    return rows[np.arange(rows.shape[0]) % (3 * (dimension - 1)) < dimension]


def _nowhere(place: Place) -> bool:
    return isinstance(place, str) and not place


def _has(body: ElasticBody, name: str) -> bool:
    return any(name in known for known in (body.mesh.points, body.mesh.boundaries,
                                           body.references))


def _given_rows(body: ElasticBody, given: Any) -> Any:
    import scipy.sparse as sp

    try:
        rows = sp.csr_array(given)
    except (TypeError, ValueError):
        raise InputError(f"modal_basis: rows holds {shown(given)}, which is no matrix.") from None
    if rows.ndim != 2 or rows.shape[1] != body.nodes.size:
        raise InputError(f"modal_basis: rows of shape {rows.shape} must be (k, "
                         f"{body.nodes.size}), motions from the displacements of the nodes of "
                         f"this body; pair the faces of the same bodies.")
    return rows


def _joints(
    name: str, body: ElasticBody, options: Mapping[str, Any], links: Sequence[Link]
) -> tuple[dict[str, Place], list[Any]]:
    """Points of a body with those of its links, and the rows on which their forces act."""
    known, rows = dict(options.get("points") or {}), []
    for link in links:
        if isinstance(link, FaceWeld):
            continue
        for end in (link.first, link.second):
            owner, _, point = (end or "").partition(".")
            if owner == name:
                place = options.get(point) if point in ("B", "C") else known.setdefault(
                    point, point)
                if place is not None and _nowhere(place) and _has(body, point):
                    raise InputError(f"a link names the point '{point}', which is that of no body, "
                                     f"as several meshes have one; name it, each={{'{name}': "
                                     f"{{'points': {{'end': '{point}'}}}}}}, and link "
                                     f"'{name}.end'.")
                where = point if place is None or _nowhere(place) else place
                matrix = place_rows(body, where, point).matrix
                rows.append(matrix if isinstance(link, Weld | Bushing)
                            else matrix[: body.dimension])
    return known, rows


def _modes(
    flexibility: Flexibility, count: int, reduction: Reduction, tolerance: float, loads: Array,
    fields: Array | None,
) -> tuple[Array, Array, int]:
    """Frequencies, shapes and number of the eigenmodes among them."""
    system, (w, shapes) = flexibility.system, flexibility.modes
    if reduction == "craig-bampton":
        w, shapes = craig_bampton(system, flexibility.rows, count, loads)
        return w, shapes, system.rigid.shape[1]
    if reduction == "vibration":
        if fields is None:
            return w, shapes, count
        more, completing = residual_modes(
            flexibility.of_rows(np.zeros(flexibility.rows.shape[0], bool)), tolerance,
            np.zeros((len(shapes), 0)), fields)
        return np.concatenate([w, more]), np.hstack([shapes, completing]), count
    if count < system.rigid.shape[1]:
        raise InputError(f"modes = {count} must be at least the number of rigid modes, "
                         f"{system.rigid.shape[1]}, for reduction = 'residual'.")
    more, completing = residual_modes(flexibility, tolerance, loads, fields)
    return np.concatenate([w, more]), np.hstack([shapes, completing]), count


def _quality(
    body: ElasticBody, system: FreeSystem, flexibility: Flexibility, w: Array, shapes: Array,
    vibration: int, forces: Array,
) -> ReductionQuality:
    """``forces`` (1 + b, d N, d) are those of gravity and of the boundary loads."""
    d = body.dimension
    inertia = system.mass @ shapes
    free = np.hstack([body.expansion.T @ one for one in forces])
    return ReductionQuality(
        mass=body.total_mass,
        vibration_modes=vibration,
        residuals=backward_error(system.stiffness, system.mass, w**2, shapes),
        orthogonality=float(np.abs(shapes.T @ inertia - np.eye(len(w))).max()),
        compliance=np.maximum(np.diag(flexibility.compliance), 0.0).reshape(-1, d),
        load_compliance=(free * system.deflection(free)).sum(axis=0).reshape(-1, d)
        * _deforms(system, free).reshape(-1, d),
    )


def _deforms(system: FreeSystem, forces: Array) -> Array:
    """Boolean mask (k,) of forces (f, k) that do more than accelerate the body as a whole."""
    rest = forces - system.inertia @ (system.rigid.T @ forces)
    return np.asarray(np.abs(rest).max(axis=0) > 1e-9 * np.abs(forces).max(axis=0))


def loading(
    body: ElasticBody, system: FreeSystem, loads: Sequence[Place], points: Mapping[str, Place],
    further: Array | None = None,
) -> Array:
    """Forces (f, k) on the free degrees of freedom of named loads, one along each axis.

    ``further`` are nodal forces (d N,) beside them.
    """
    require_kind("modal_basis", (list, tuple), loads=loads)
    found = [np.zeros((body.nodes.size, 0))]
    for load in loads:
        if str(load) == "gravity":
            found.append(inertia_forces(body))
        elif isinstance(load, str) and load in body.mesh.boundaries and load not in points:
            found.append(boundary_forces(body, load))
        else:
            place = points.get(load, load) if isinstance(load, str) else load
            rows = place_rows(body, place, f"of loads ({load})").matrix
            if place not in body.references:
                rows = rows[: body.dimension]  # moments act on reference points alone
            found.append(rows[rows.indptr[1:] > rows.indptr[:-1]].T.toarray())
    if further is not None:
        found.append(further[:, None])
    forces = np.asarray(body.expansion.T @ np.hstack(found))
    return forces[:, _deforms(system, forces)] if forces.shape[1] else forces


def _point(body: ElasticBody, place: Place | None, name: str) -> Rows:
    import scipy.sparse as sp

    if place is None and _has(body, name):
        return place_rows(body, name, name)
    if place is None or _nowhere(place):
        return Rows(sp.csr_array((3 * (body.dimension - 1), body.nodes.size)),
                    np.zeros(body.dimension))
    return place_rows(body, place, name)


def first_order(body: ElasticBody, facets: Integers) -> Integers:
    """First-order edges (k, 2), or facets of a solid, between the displacement nodes of some."""
    sides = body.facet_nodes(facets)
    if body.dimension == 3:
        return linear_facets(sides)[0]
    return np.concatenate([sides[:, i : i + 2] for i in range(sides.shape[1] - 1)])


def _nodes_of_outline(body: ElasticBody, face: ContactNodes) -> Integers:
    """Contact node of each first-order facet of the outline, -1 for none."""
    sides = body.mesh.outline
    groups = [body.mesh.boundaries[name] for name, _ in face.groups]
    found = np.full(len(sides), -1)
    if face.owner is not None:
        found[row_numbers(unordered(sides), unordered(np.concatenate(groups)))] = face.owner
    return np.asarray(found[linear_facets(body.facet_nodes(sides))[1]])
