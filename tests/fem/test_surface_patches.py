"""Faces of solids in patches: areas, normals, mean motions, and loads that they carry."""

import numpy as np
import pytest
from solid_blocks import block_body, quadratic_grid

from fecontact import MeshError
from fecontact.core.errors import InputError
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.faces.contact_patches import contact_patches, face_surface
from fecontact.fem.faces.partition import partition, parts_of
from fecontact.fem.faces.surface import Surface, linear_facets

KINDS = pytest.mark.parametrize("tetrahedra", [False, True])
RADIUS = 0.5


def cap(n, *, triangles=False, half_angle=0.6):
    """Southern cap of a sphere, outward normals, as a square in equal-area azimuthal map."""
    def place(u, v):
        x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
        # A square onto a disc without folding at its corners.
        r, s = x * np.sqrt(1.0 - y**2 / 2.0), y * np.sqrt(1.0 - x**2 / 2.0)
        radius, angle = np.hypot(r, s), np.arctan2(s, r)
        polar = 2.0 * np.arcsin(radius * np.sin(half_angle / 2.0))
        # Mirrored in x, so that facets look out of the sphere.
        return (-RADIUS * np.sin(polar) * np.cos(angle), RADIUS * np.sin(polar) * np.sin(angle),
                -RADIUS * np.cos(polar))
    return quadratic_grid(place, n, n, triangles=triangles)


def bore(around, along, *, fraction=1.0):
    """Inner face of a cylinder about z, its outward normals towards the axis."""
    return quadratic_grid(
        lambda u, v: (RADIUS * np.cos(2 * np.pi * fraction * u),
                      -RADIUS * np.sin(2 * np.pi * fraction * u), 0.4 * v), around, along)


@pytest.mark.parametrize("triangles", [False, True])
def test_area_of_a_spherical_cap_converges_with_the_fourth_order(triangles):
    """2 pi R^2 (1 - cos a): second-order facets interpolate the sphere to the third order."""
    exact = 2.0 * np.pi * RADIUS**2 * (1.0 - np.cos(0.6))
    coarse, fine = (abs(cap(n, triangles=triangles).areas.sum() / exact - 1.0) for n in (4, 8))
    assert fine < 2e-5
    assert 3.0 < np.log2(coarse / fine) < 5.5


def test_normals_and_centroid_of_a_spherical_cap():
    """The mean normal of the whole is the axis, of a patch that towards its centroid."""
    surface = cap(8)
    whole = surface.patches(np.zeros(len(surface.facets), int))
    assert whole.normals[0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    # The centroid of a cap lies halfway between its rim and its pole.
    assert whole.centres[0] == pytest.approx([0.0, 0.0, -RADIUS * (1.0 + np.cos(0.6)) / 2.0],
                                             rel=1e-5, abs=1e-12)
    # The vector area is that of the rim's disc, whatever lies between.
    assert surface.area_vectors.sum(axis=0) == pytest.approx(
        [0.0, 0.0, -np.pi * (RADIUS * np.sin(0.6)) ** 2], rel=2e-4, abs=1e-12)
    patches = contact_patches(surface, "cap", 16)
    towards = patches.centres / np.linalg.norm(patches.centres, axis=1, keepdims=True)
    assert patches.normals == pytest.approx(towards, abs=1e-5)
    assert np.linalg.norm(patches.centres, axis=1) == pytest.approx(RADIUS, rel=0.02)


@pytest.mark.parametrize("surface", [cap(4), cap(4, triangles=True), bore(12, 3)])
@pytest.mark.parametrize("count", [1, 7, "all"])
def test_rigid_motions_of_patches_are_exact(surface, count):
    patches = contact_patches(surface, "face", count)
    shift, turn = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.1, -0.2])
    moved = shift + np.cross(turn, surface.places)
    found = (patches.rows() @ moved.ravel()).reshape(-1, 6)
    assert found[:, :3] == pytest.approx(shift + np.cross(turn, patches.centres), abs=1e-13)
    assert found[:, 3:] == pytest.approx(np.tile(turn, (patches.count, 1)), abs=1e-10)


@KINDS
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("count", [3, 8, "all"])
def test_equal_pressure_on_patches_is_the_consistent_load_of_the_face(tetrahedra, degree, count):
    body = block_body((4, 2, 1), tetrahedra=tetrahedra, degree=degree)
    face = contact_groups(body, "contact", count)
    assert face.tributary.sum() == pytest.approx(0.02, rel=1e-13)
    assert face.normals == pytest.approx(np.tile([0.0, 0.0, -1.0], (len(face.tributary), 1)))
    forces = np.zeros((len(face.tributary), 6))
    forces[:, 2] = face.tributary
    nodal = face.matrix.T @ forces.ravel()
    surface = face_surface(body, "contact")
    assert nodal == pytest.approx(surface.pressure_forces(), abs=1e-16)
    # Against integrals of shape functions by hand: quadratic triangles have none at corners.
    if degree == 2 and tetrahedra:
        corners = np.unique(surface.facets[:, :3])
        assert abs(nodal.reshape(-1, 3)[corners]).max() < 1e-16
    assert nodal.reshape(-1, 3).sum(axis=0) == pytest.approx([0.0, 0.0, 0.02], abs=1e-15)
    moment = np.cross(body.nodes, nodal.reshape(-1, 3)).sum(axis=0)
    assert moment == pytest.approx([0.05 * 0.02, -0.1 * 0.02, 0.0], abs=1e-16)


@pytest.mark.parametrize("surface", [cap(4), bore(12, 3, fraction=0.4)])
def test_forces_and_moments_of_patches_have_these_resultants(surface):
    patches = contact_patches(surface, "face", 5)
    force, moment = np.array([3.0, -1.0, 2.0]), np.array([0.2, 0.5, -0.1])
    for patch in range(5):
        load = np.zeros((5, 6))
        load[patch] = [*force, *moment]
        nodal = (patches.rows().T @ load.ravel()).reshape(-1, 3)
        assert nodal.sum(axis=0) == pytest.approx(force, abs=1e-12)
        arm = surface.places - patches.centres[patch]
        assert np.cross(arm, nodal).sum(axis=0) == pytest.approx(moment, abs=1e-12)


@KINDS
@pytest.mark.parametrize(("grid", "count"), [
    ((12, 4), 12), ((8, 8), 16), ((12, 6), 18), ((9, 9), 9), ((6, 4), 24), ((16, 2), 8)])
@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4])
def test_grids_are_cut_along_their_lines(tetrahedra, grid, count, angle):
    """Patches of a grid are equal rectangles, also of a face that is turned."""
    size = (0.01 * grid[0], 0.01 * grid[1], 0.01)
    body = block_body((*grid, 1), size, tetrahedra=tetrahedra, degree=1)
    surface = face_surface(body, "contact")
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0],
                     [0.0, 0.0, 1.0]])
    patches = Surface(surface.places @ turn.T, surface.facets)
    patches = patches.patches(partition(patches, count))
    area = size[0] * size[1] / count
    assert patches.areas == pytest.approx(np.full(count, area), rel=1e-12)
    # Principal second moments a b^3 / 12 and b a^3 / 12 of a rectangle: squares where they fit.
    moments = np.linalg.eigvalsh(patches.second_moments)[:, 1:]
    assert moments == pytest.approx(np.tile(moments[0], (count, 1)), rel=1e-9)
    assert moments[0].prod() == pytest.approx(area**4 / 144.0, rel=1e-9)
    assert moments[0, 1] / moments[0, 0] <= 4.01


def test_facets_of_any_mesh_make_compact_patches_of_about_equal_area():
    from scipy.spatial import Delaunay

    # A disc of 800 triangles of uneven size.
    k = np.arange(500)
    radius, angle = np.sqrt((k + 0.5) / 500), 2.0 * np.pi * k / 1.6180339887
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    triangles = Delaunay(flat).simplices
    surface = Surface(np.column_stack([flat, np.zeros(500)]), triangles)
    for count in (5, 12, 40):
        owner = partition(surface, count)
        patches = surface.patches(owner)
        mean = surface.areas.sum() / count
        assert patches.areas == pytest.approx(np.full(count, mean), rel=0.35 if count > 20 else 0.1)
        assert (np.ptp(partition(surface, count) - owner)) == 0
        # The polar second moment of a square is A^2 / 6, of a 1 : 3 rectangle 1.7 times that.
        polar = np.trace(patches.second_moments, axis1=1, axis2=2)
        assert (polar / (patches.areas**2 / 6.0)).mean() < 1.4
        for patch in range(count):
            assert parts_of(surface.only(owner == patch)).max() == 0
        # Facets in another order are the same patches.
        order = np.random.default_rng(1).permutation(len(triangles))
        again = partition(surface.only(order), count)
        assert surface.only(order).patches(again).areas == pytest.approx(patches.areas, rel=1e-12)


def test_rings_and_bores_are_cut_around_their_axis():
    ring = quadratic_grid(
        lambda u, v: ((0.8 + 0.2 * v) * np.cos(2 * np.pi * u),
                      (0.8 + 0.2 * v) * np.sin(2 * np.pi * u), np.zeros_like(u)), 48, 2)
    for surface, count in ((ring, 24), (bore(24, 6), 36)):
        patches = contact_patches(surface, "ring", count)
        assert patches.areas == pytest.approx(np.full(count, surface.areas.sum() / count),
                                              rel=1e-6)
        spread = np.trace(patches.second_moments, axis1=1, axis2=2)
        assert spread == pytest.approx(np.full(count, spread[0]), rel=1e-3)
    # Normals of a bore point to its axis.
    towards = -patches.centres[:, :2] / np.linalg.norm(patches.centres[:, :2], axis=1)[:, None]
    assert patches.normals[:, :2] == pytest.approx(towards, abs=1e-6)


def test_separate_parts_of_a_face_share_the_nodes_by_area():
    body = block_body((6, 2, 1), (0.6, 0.2, 0.1), degree=1)
    surface = face_surface(body, "contact")
    x = surface.centres[:, 0]
    # Two rows of columns with a gap of one: areas 1 to 4.
    parts = surface.only((x < 0.1) | (x > 0.2))
    owner = partition(parts, 5)
    sides = parts.centres[:, 0] < 0.1
    assert len(np.unique(owner[sides])) == 1
    assert len(np.unique(owner[~sides])) == 4
    with pytest.raises(InputError, match="from 2 to 10, the number of facets"):
        contact_patches(parts, "face", 1)


def test_several_faces_are_groups_and_bad_ones_are_named():
    body = block_body((4, 2, 1))
    mesh = body.mesh
    x = mesh.nodes[mesh.boundaries["contact"]].mean(axis=1)[:, 0]
    halves = type(mesh)(mesh.nodes, mesh.cells, {
        "one": mesh.boundaries["contact"][x < 0.1], "two": mesh.boundaries["contact"][x > 0.1],
        "top": mesh.boundaries["top"], "left": mesh.boundaries["left"]})
    body = type(body)(halves)
    face = contact_groups(body, ["two", "one"], [2, "all"])
    assert face.groups == (("two", 2), ("one", 4))
    assert (face.positions[:2, 0] > 0.1).all()
    assert (face.positions[2:, 0] < 0.1).all()
    assert face.owner.tolist() == [*face.owner[:4], 2, 3, 4, 5]
    assert set(face.owner[:4].tolist()) == {0, 1}
    for boundary, count, message in (
        ("top", 2, r"'top' does not face the ground, which lies below the body \(towards -z\)"),
        ("left", 2, "does not face the ground"),
        ("one", 5, "contact_nodes = 5 must be 'all' or a whole number from 1 to 4"),
        ("one", 0, "contact_nodes = 0 must be"),
        (["one", "one"], 2, "each once"),
    ):
        with pytest.raises(InputError, match=message):
            contact_groups(body, boundary, count)
    with pytest.raises(MeshError, match="no boundary named 'three'"):
        contact_groups(body, "three", 2)


@KINDS
def test_first_order_facets_cover_the_surface_with_its_orientation(tetrahedra):
    body = block_body((2, 1, 1), tetrahedra=tetrahedra)
    whole = Surface(body.nodes, body.facet_nodes(body.mesh.outline))
    facets, owner = linear_facets(whole.facets)
    assert (owner[: len(whole.facets)] == np.arange(len(whole.facets))).all()
    parts = Surface(body.nodes, facets)
    assert parts.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-13)
    assert parts.area_vectors.reshape(4, -1, 3).sum(axis=0) == pytest.approx(
        whole.area_vectors, abs=1e-16)
