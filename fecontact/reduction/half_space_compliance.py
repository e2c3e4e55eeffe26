"""Local compliance of contact faces that the elements and the modes of a body lack.

Elements are too stiff under a load on a patch that is not much larger than they are. C_hs are the
mean displacements of the patches of a half-space (Boussinesq, Cerruti). C_e are those of the body's
own elements under the same loads, held at the displacements of the half-space a few elements deep:

    C = C_fe + (C_hs - C_e),

is the compliance of the contact nodes. Elements carry what is smooth, such as bending of the body,
the half-space what is local, and nothing is counted twice. What the modes, of rows T and
frequencies w, lack of it, ``C - T w^-2 T^T``, becomes further coordinates of the basis.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_not_negative, require_positive
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.frames import frames_of
from fecontact.fem.faces.surface import Patches, Surface, corners_of, drawn_facets
from fecontact.fem.material import Material
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.half_space.patches import PixelPatches
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.solvers.factorisation import factorised
from fecontact.reduction.static_modes.residual_vectors import flexibility_of, leading_patterns

# Depth at which elements are held, by their degree, in facets: errors of linear ones reach deeper.
_LAYERS = {1: 6.0, 2: 3.0}
_FLAT = 0.9  # least cosine of the normals of facets against the mean one
_FREE = 0.7  # least cosine of the normal of a facet on the surface of the half-space
_RANK = 1e-8  # of the rows of the contact nodes
_OWNER = "with_half_space"


@dataclass(frozen=True, eq=False)
class _Face:
    """Rows (3 n, 3 N) along x, y, z of the contact nodes, their patches, and the normal inwards."""

    rows: Any
    patches: Patches
    inward: Array


def with_half_space(
    basis: ModalBasis, body: ElasticBody, *,
    pairings: Sequence[Pairing | TwoPassPairing] = (), name: str = "",
    tolerance: float = 0.0, frequency: float | None = None, damping: float = 0.1,
) -> ModalBasis:
    r"""Complete a basis of a solid with the local compliance of its contact faces.

    .. math:: C = T \omega^{-2} T^T + \underbrace{C_\mathrm{fe} - T \omega^{-2} T^T}_{\text{modes}}
        + \underbrace{C_\mathrm{hs} - C_\mathrm{e}}_{\text{elements}}

    Contact nodes then have the static compliance of a fine mesh, for even loads on their patches.
    Further coordinates carry what is missing; preload, loading, runs and harmonic balance take them
    as they are. They have shapes at the contact nodes alone.

    Parameters
    ----------
    basis : ModalBasis
        Basis of one solid with contact nodes on the ground, or for the pairings.
    body : ElasticBody
        The solid; the material at the faces must be isotropic and one.
    pairings : sequence of Pairing or TwoPassPairing
        Faces of several bodies; give each body its own call, before the bodies are joined.
    name : str
        Name of the body in the pairings.
    tolerance : float
        Largest part that may be missing of the compliance of a contact node; zero keeps all.
    frequency : float, optional
        Natural frequency of the further coordinates [Hz]; by default ten times the largest one. It
        must be far above all motions of interest.
    damping : float
        Damping ratio of the further coordinates, zero or above.

    Raises
    ------
    InputError
        For plane bodies, faces that are not nearly flat, materials that are not isotropic, bases of
        other bodies, and more contact nodes than the nodes of the mesh can move one by one.
    """
    require_kind(_OWNER, ModalBasis, basis=basis)
    require_kind(_OWNER, ElasticBody, body=body)
    require_kind(_OWNER, Sequence, pairings=pairings)
    require_kind(_OWNER, str, name=name)
    require_not_negative(_OWNER, tolerance=tolerance, damping=damping)
    if tolerance >= 1.0:
        raise InputError(f"{_OWNER}: tolerance = {tolerance!r} must be zero or above, and below "
                         f"one.")
    if frequency is not None:
        require_positive(_OWNER, frequency=frequency)
    if body.dimension == 2:
        raise InputError(f"{_OWNER}: the body is plane, but half-spaces are solids; refine the "
                         f"mesh at the contact instead.")
    field = basis.mode_shapes
    if field is None or basis.parts or len(field.nodes) != len(body.nodes):
        raise InputError(f"{_OWNER}: the basis is not that of this body alone; complete the basis "
                         f"of each body before they are joined.")
    faces = _paired_faces(pairings, name) if pairings else _own_faces(basis, body)
    rows, lacking, whole = _lacking(basis, body, faces)
    return _completed(basis, rows, lacking, whole, tolerance, frequency, damping)


def _own_faces(basis: ModalBasis, body: ElasticBody) -> list[_Face]:
    """Faces of the contact nodes on the ground, one for each group."""
    import scipy.sparse as sp

    field = basis.mode_shapes
    assert field is not None
    if not basis.contact_nodes or field.outline_nodes is None:
        raise InputError(f"{_OWNER}: the basis has no contact nodes on faces of its solid; name "
                         f"the faces that touch by contact=..., or give pairings.")
    rows = sp.csr_array(field.restriction)[12 : 12 + 6 * basis.contact_nodes]
    surface = body.mesh.outline
    owner = field.outline_nodes[: len(surface)]
    found, first = [], 0
    for _, count in basis.groups:
        chosen = (owner >= first) & (owner < first + count)
        patches = _patches(body, body.facet_nodes(surface[chosen]), owner[chosen] - first)
        found.append(_Face(rows[6 * first : 6 * (first + count)][_displacements(count)], patches,
                           np.array([0.0, 0.0, 1.0])))
        first += count
    return found


def _patches(body: ElasticBody, facets: Integers, owner: Integers) -> Patches:
    return Surface(body.nodes, facets).patches(owner)


def _paired_faces(pairings: Sequence[Pairing | TwoPassPairing], name: str) -> list[_Face]:
    """Faces of a body in the pairings: its own contact nodes, and feet of others."""
    found = []
    for given in pairings:
        require_kind(_OWNER, (Pairing, TwoPassPairing), pairing=given)
        for one in given.passes:
            if one.patches is None:
                raise InputError(f"{_OWNER}: the pairing of '{one.report.face}' holds no patches; "
                                 f"make it by pair_faces.")
            chosen, inward = _displacements(len(one.places)), one.normals.mean(axis=0)
            inward = inward / np.linalg.norm(inward)
            if one.body == name:
                found.append(_Face(one.nodes.tocsr()[chosen], one.patches, inward))
            if one.other == name:
                found.append(_Face(one.feet.tocsr()[chosen], one.patches, -inward))
    if not found:
        raise InputError(f"{_OWNER}: name = '{name}' is no body of the pairings; give the name "
                         f"under which they know this body.")
    return found


def _displacements(count: int) -> Integers:
    """Rows of displacements among those of the motions (6 n) of contact nodes."""
    return (6 * np.arange(count)[:, None] + np.arange(3)).ravel()


def _lacking(
    basis: ModalBasis, body: ElasticBody, faces: Sequence[_Face]
) -> tuple[Any, Array, Array]:
    """Rows (3 n, 3 N) of all faces, the compliance that the basis lacks, and the whole one."""
    import scipy.linalg
    import scipy.sparse as sp

    field = basis.mode_shapes
    assert field is not None
    rows = sp.csr_array(sp.vstack([face.rows for face in faces]))
    w = basis.angular_frequencies
    elastic = np.divide(1.0, w, out=np.zeros_like(w), where=w > 0.0)
    own = np.asarray(rows @ field.shapes.reshape(-1, basis.modes)) * elastic
    meshed = flexibility_of(FreeSystem.of(body), rows @ body.expansion).compliance
    local = scipy.linalg.block_diag(*(_local(body, face) for face in faces))
    return rows, meshed - own @ own.T + local, meshed + local


def _local(body: ElasticBody, face: _Face) -> Array:
    """Compliance (3 n, 3 n) ``C_hs - C_e`` of one face, along x, y, z."""
    surface = face.patches.surface
    normals = surface.area_vectors / surface.areas[:, None]
    if (normals @ -face.inward).min() < _FLAT and (normals @ face.inward).min() < _FLAT:
        raise InputError(f"{_OWNER}: a contact face turns by more than "
                         f"{np.degrees(np.arccos(_FLAT)):.0f} degrees, but half-spaces are flat; "
                         f"give a part of it as the face that touches.")
    axes = frames_of(face.inward[None])[0]
    origin = face.patches.centres.mean(axis=0)
    corners, facet = drawn_facets(corners_of(surface.facets))
    polygons = ((surface.places - origin) @ axes.T)[corners]
    pixels = PixelPatches.of(polygons[..., :2], face.patches.owner[facet])
    places = (body.nodes - origin) @ axes.T
    free, beside, material = _region(body, face, places, pixels)
    n, loads = face.patches.count, np.asarray(face.rows.T.tocsr()[free].todense())
    moved = np.empty((len(beside), 3 * n))
    at = places[beside // 3]
    part = beside % 3
    for patch in range(n):
        found = axes.T @ pixels.displacements(patch, at, material) @ axes
        moved[:, 3 * patch : 3 * patch + 3] = found[np.arange(len(at)), part]
    K = body.stiffness.tocsr()[free]
    inside = factorised(K[:, free].tocsc(), free // 3).solve(loads - K[:, beside] @ moved)
    elements = face.rows[:, free] @ inside + face.rows[:, beside] @ moved
    half_space = np.einsum("ai,namb,bk->nimk", axes, pixels.compliance(material), axes)
    found = half_space.reshape(3 * n, 3 * n) - elements
    return np.asarray(0.5 * (found + found.T))


def _region(
    body: ElasticBody, face: _Face, places: Array, pixels: PixelPatches
) -> tuple[Integers, Integers, Material]:
    """Degrees of freedom that are free and held, and the material of the elements between them.

    Free are the nodes near the patches, but for those of walls: sides of the body that are no part
    of the surface of the half-space. ``places`` (N, 3) count from it into the body.
    """
    from scipy.spatial import cKDTree

    depth = _LAYERS[body.degree] * float(np.sqrt(face.patches.surface.areas.max()))
    surface = Surface(body.nodes, body.facet_nodes(body.mesh.outline))
    normals = surface.area_vectors / surface.areas[:, None]
    level = np.abs(places[surface.facets].mean(axis=1)[:, 2]) <= 0.5 * depth
    walls = surface.facets[~(level & (normals @ -face.inward >= _FREE))]
    near = (places[:, 2] <= depth) & (places[:, 2] >= -0.5 * depth)
    near[np.unique(walls)] = False
    tree = cKDTree(pixels.places[pixels.owner >= 0])
    chosen = np.flatnonzero(near)
    chosen = chosen[tree.query(places[chosen, :2])[0] <= depth]
    free = (3 * chosen[:, None] + np.arange(3)).ravel()
    used = np.unique(body.stiffness.tocsr()[free].indices)
    cells = np.isin(body.elements, chosen).any(axis=1)
    found = [body.materials[number] for number in np.unique(body.cell_materials[cells])]
    if len(found) != 1 or not isinstance(found[0], Material):
        kind = "an anisotropic material" if len(found) == 1 else "several materials"
        raise InputError(f"{_OWNER}: the elements at a contact face have {kind}, but a half-space "
                         f"has one that is isotropic.")
    return free, np.setdiff1d(used, free), found[0]


def _completed(
    basis: ModalBasis, rows: Any, lacking: Array, whole: Array, tolerance: float,
    frequency: float | None, damping: float,
) -> ModalBasis:
    """The basis with coordinates of one frequency that carry the lacking compliance."""
    import scipy.linalg

    field, m = basis.mode_shapes, basis.modes
    assert field is not None
    largest = float(basis.frequencies_hz.max())
    if frequency is None and largest == 0.0:
        raise InputError(f"{_OWNER}: the basis has rigid modes only, so that frequency has no "
                         f"default; give it, far above those of interest [Hz].")
    if frequency is not None and frequency <= largest:
        raise InputError(f"{_OWNER}: frequency = {frequency:g} Hz must be above that of the last "
                         f"mode, {largest:.5g} Hz.")
    w = 2.0 * np.pi * (10.0 * largest if frequency is None else frequency)
    patterns = leading_patterns(whole, whole - lacking, tolerance)
    moved = lacking @ patterns
    moved *= w / np.sqrt((patterns * moved).sum(axis=0))
    values, vectors = np.linalg.eigh((rows @ rows.T).toarray())
    if values[0] <= _RANK * values[-1]:
        raise InputError(f"{_OWNER}: {basis.contact_nodes or rows.shape[0] // 3} contact nodes are "
                         f"more than the nodes of the mesh can move one by one; take fewer contact "
                         f"nodes, or quadratic elements.")
    shapes = rows.T @ (vectors @ ((vectors.T @ moved) / values[:, None]))
    count = moved.shape[1]

    def widened(values: Array) -> Array:
        """Zeros of the further coordinates behind the last axis."""
        return np.concatenate([values, np.zeros((*values.shape[:-1], count))], axis=-1)

    def bordered(values: Array, last: float = 0.0) -> Array:
        return np.asarray(scipy.linalg.block_diag(values, last * np.eye(count)))

    turning, quality, stress = basis.rotation, basis.quality, field.nonlinear_stress
    further = np.asarray(field.restriction @ shapes).reshape(*basis.T.shape[:2], count)
    return replace(
        basis,
        angular_frequencies=np.append(basis.angular_frequencies, np.full(count, w)),
        damping=bordered(basis.damping, 2.0 * damping * w),
        T=np.concatenate([basis.T, further], axis=-1),
        inertia_rows=None if basis.inertia_rows is None else widened(basis.inertia_rows),
        boundary_rows=widened(basis.boundary_rows),
        stiffness=None if basis.stiffness is None else bordered(basis.stiffness, w * w),
        rotation=None if turning is None else replace(
            turning, coriolis=bordered(turning.coriolis), stiffening=bordered(turning.stiffening),
            load=widened(turning.load)),
        mode_shapes=replace(
            field, stress=widened(field.stress),
            shapes=np.concatenate([field.shapes, shapes.reshape(*field.shapes.shape[:2], count)],
                                  axis=-1),
            nonlinear_stress=None if stress is None else replace(
                stress, coordinates=widened(stress.coordinates))),
        constant_load=None if basis.constant_load is None else widened(basis.constant_load),
        large_deflections=tuple(one.in_modes(np.eye(m, m + count))
                                for one in basis.large_deflections),
        quality=None if quality is None else replace(
            quality, residuals=widened(quality.residuals)),
    )
