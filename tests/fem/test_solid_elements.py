"""Elements of solids, straight and curved: rigid modes, mass, patch test, known frequencies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from meshes_for_tests import grid
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh
from scipy.special import j0, j1, y0, y1
from solid_blocks import block_mesh

from fecontact import ElasticBody, InputError, Material, Mesh, generate
from fecontact.fem import Plate, Ring, SolidBlock, SphereSegment
from fecontact.fem.body_forces import boundary_forces, inertia_forces
from fecontact.fem.fields import BodyFields, stress_of
from fecontact.fem.points import Patch, place_rows

STEEL = Material(2.1e11, 0.3, 7850.0)
KINDS = [(tetrahedra, degree) for tetrahedra in (False, True) for degree in (1, 2)]


def distorted(tetrahedra, size=(0.3, 0.2, 0.1)):
    mesh = block_mesh((3, 3, 3), size, tetrahedra=tetrahedra)
    rng = np.random.default_rng(3)
    inner = ((mesh.nodes > 1e-9) & (mesh.nodes < np.array(size) - 1e-9)).all(axis=1)
    nodes = mesh.nodes + 0.006 * rng.standard_normal(mesh.nodes.shape) * inner[:, None]
    return Mesh(nodes, mesh.cells, mesh.boundaries, {"edge": np.flatnonzero(
        (nodes[:, 1] == 0.0) & (nodes[:, 2] == 0.0))})


def rigid(places):
    """Translations and rotations about the axes through the origin (3 N, 6)."""
    modes = np.zeros((len(places), 3, 6))
    modes[:, :, :3] = np.eye(3)
    for axis in range(3):
        modes[:, :, 3 + axis] = np.cross(np.eye(3)[axis], places)
    return modes.reshape(-1, 6)


ALL = [*KINDS, "hexahedron", "tetrahedron"]


def body_of(kind):
    """A distorted block of elements, or a curved body."""
    if isinstance(kind, str):
        return ElasticBody(generate(SphereSegment(element_size=0.01, element=kind)), STEEL)
    return ElasticBody(distorted(kind[0]), STEEL, degree=kind[1])


def frequencies(body, count, near):
    """Frequencies next to one [Hz], and shapes."""
    E = body.expansion
    K, M = (E.T @ matrix @ E for matrix in (body.stiffness, body.mass))
    values, vectors = eigsh(K.tocsc(), count, M.tocsc(), sigma=(2.0 * np.pi * near) ** 2,
                            v0=np.ones(K.shape[0]))
    return np.sqrt(np.abs(values)) / (2.0 * np.pi), E @ vectors


@pytest.mark.parametrize("kind", ALL)
def test_rigid_motions_need_no_force_and_carry_the_mass(kind):
    body = body_of(kind)
    modes = rigid(body.nodes)
    K, M = body.stiffness, body.mass
    # Against the sum of the magnitudes of what cancels.
    assert (np.abs(K @ modes) < 1e-12 * (np.abs(K) @ np.abs(modes)).max(axis=0)).all()
    inertia = modes.T @ (M @ modes)
    assert inertia[:3, :3] == pytest.approx(body.total_mass * np.eye(3), abs=1e-11)
    assert abs(K - K.T).max() == 0.0


@pytest.mark.parametrize(("tetrahedra", "degree"), KINDS)
def test_mass_and_moments_of_inertia_of_a_distorted_block_are_exact(tetrahedra, degree):
    body = ElasticBody(distorted(tetrahedra), STEEL, degree=degree)
    a, b, c = 0.3, 0.2, 0.1
    mass = 7850.0 * a * b * c
    assert body.total_mass == pytest.approx(mass, rel=1e-13)
    modes = rigid(body.nodes - np.array([a, b, c]) / 2)
    inertia = modes.T @ (body.mass @ modes)
    expected = np.diag([mass] * 3 + [mass / 12 * s for s in (b * b + c * c, a * a + c * c,
                                                             a * a + b * b)])
    assert inertia == pytest.approx(expected, abs=1e-12 * mass)
    assert inertia_forces(body).sum(axis=0) == pytest.approx([mass] * 3, rel=1e-12)


@pytest.mark.parametrize("kind", ALL)
def test_constant_strain_is_held_by_the_forces_on_the_faces_alone(kind):
    """The patch test: with distorted and curved cells, no inner node feels a force."""
    body = body_of(kind)
    gradient = 1e-4 * np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]])
    u = (body.nodes @ gradient.T).ravel()
    E, nu = 2.1e11, 0.3
    strain = 0.5 * (gradient + gradient.T)
    stress = E / (1 + nu) * (strain + nu / (1 - 2 * nu) * np.trace(strain) * np.eye(3))
    force = (body.stiffness @ u).reshape(-1, 3)
    outer = np.unique(body.facet_nodes(body.mesh.outline))
    inner = np.setdiff1d(np.arange(len(body.nodes)), outer)
    size = np.abs(force).max()
    assert np.abs(force[inner]).max() < 1e-10 * size
    # The work of the tractions is that of the stresses: sum f x = stress times volume.
    assert force.T @ body.nodes == pytest.approx(stress * body.mesh.volume, rel=1e-11)
    expected = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    got = stress_of(body, u[:, None])[:, :, 0]
    assert np.abs(got - expected).max() < 1e-11 * np.abs(stress).max()
    fields = BodyFields(body.nodes, body.elements, u.reshape(-1, 3), got)
    deviator = stress - np.trace(stress) / 3 * np.eye(3)
    assert fields.von_mises == pytest.approx(math.sqrt(1.5 * (deviator**2).sum()), rel=1e-10)
    place = body.mesh.nodes[body.mesh.cells[5]].mean(axis=0)
    moved, inside = fields.at(place)
    assert moved == pytest.approx(gradient @ place, rel=1e-10)
    assert inside == pytest.approx(expected, rel=1e-10)
    assert Mesh(body.nodes, fields.cells).volume == pytest.approx(
        body.mesh.volume, rel=0.01 if body.curved else 1e-12)


@pytest.mark.parametrize(("tetrahedra", "degree"), KINDS)
def test_points_take_part_in_rigid_motions(tetrahedra, degree):
    mesh = distorted(tetrahedra)
    body = ElasticBody(mesh, degree=degree)
    modes = rigid(body.nodes)
    for place in ("contact", "left", (0.13, 0.11, 0.042), tuple(mesh.nodes[7]),
                  Patch((0.3, 0.2, 0.1), 0.05)):
        rows = place_rows(body, place, "P")
        expected = np.eye(6)
        expected[:3, 3:] = np.cross(np.eye(3), rows.position).T
        assert (rows.matrix @ modes) == pytest.approx(expected, abs=1e-10)
    assert place_rows(body, "contact", "P").position == pytest.approx([0.15, 0.1, 0.0])
    # A line of nodes does not tell how the body turns about it.
    line = place_rows(body, "edge", "P").matrix @ modes
    assert line[3:, 3:] == pytest.approx(np.diag([0.0, 1.0, 1.0]), abs=1e-12)


def test_a_patch_in_a_face_has_the_area_and_the_lever_of_a_circle():
    body = ElasticBody(block_mesh((4, 4, 1), (1.0, 1.0, 0.2)))
    rows = place_rows(body, Patch((0.5, 0.5, 0.2), 0.19), "P")
    assert rows.position == pytest.approx([0.5, 0.5, 0.2], abs=1e-12)
    x, y, _ = body.nodes.T
    u = np.zeros_like(body.nodes)
    u[:, 2] = (x - 0.5) ** 2 + (y - 0.5) ** 2
    # The mean of r^2 over a circle is R^2 / 2.
    assert (rows.matrix @ u.ravel())[2] == pytest.approx(0.19**2 / 2, rel=0.01)


@pytest.mark.parametrize(("tetrahedra", "degree"), KINDS)
def test_pressure_and_shears_have_their_resultants(tetrahedra, degree):
    body = ElasticBody(distorted(tetrahedra), degree=degree)
    # Pressure along the inward normal n, shears along t and n x t.
    for face, area, n, t in (("contact", 0.06, (0, 0, 1), (1, 0, 0)),
                             ("top", 0.06, (0, 0, -1), (1, 0, 0)),
                             ("left", 0.02, (1, 0, 0), (0, 1, 0)),
                             ("back", 0.03, (0, -1, 0), (1, 0, 0))):
        forces = boundary_forces(body, face).reshape(-1, 3, 3).sum(axis=0)
        expected = np.stack([n, t, np.cross(n, t)], axis=1)
        assert forces == pytest.approx(area * expected, abs=1e-15), face


def test_pressure_on_a_curved_face_is_that_on_its_shadow():
    body = ElasticBody(generate(SphereSegment()))
    forces = boundary_forces(body, "contact").reshape(-1, 3, 3).sum(axis=0)
    assert forces[2, 0] == pytest.approx(math.pi * 0.02**2, rel=1e-5)
    assert np.abs(forces[:2, 0]).max() < 1e-12


def test_plane_pressure_on_a_curved_edge_is_that_on_its_shadow():
    ring = polar(8)
    forces = boundary_forces(ElasticBody(ring, thickness=0.5), "right").reshape(-1, 2, 2)
    # A quarter of the circle x = cos s, y = sin s: pressure pushes inwards.
    assert forces[..., 0].sum(axis=0) == pytest.approx([-0.5, -0.5], rel=1e-6)
    assert np.abs(forces[..., 1].sum(axis=0)) == pytest.approx([0.5, 0.5], rel=1e-6)


def polar(count, triangles=False):
    """A quarter of a ring, 0.5 < r < 1, with parabolas along the circumference."""
    def place(at):
        r, s = at.T
        return np.column_stack([r * np.cos(s), r * np.sin(s)])

    flat = grid(np.linspace(0.5, 1.0, count // 2 + 1), np.linspace(0.0, np.pi / 2, count + 1),
                triangles=triangles)
    ends = flat.edges[0]
    middles = place(flat.nodes[ends].mean(axis=1))
    rim = np.isin(flat.nodes[ends][..., 0], (0.5, 1.0)).all(axis=1) & (
        flat.nodes[ends[:, 0], 0] == flat.nodes[ends[:, 1], 0])
    return Mesh(place(flat.nodes), flat.cells, flat.boundaries, {}, ends[rim], middles[rim])


def ring_root(inner, outer, E, nu, rho, plane):
    """Lowest frequency [Hz] of a ring that breathes, in plane stress or plane strain."""
    mu = E / (2 * (1 + nu))
    lateral = E * nu / (1 - nu**2) if plane == "stress" else E * nu / ((1 + nu) * (1 - 2 * nu))
    direct = E / (1 - nu**2) if plane == "stress" else lateral + 2 * mu

    def traction(k, r, zeroth, first):
        return direct * (k * zeroth(k * r) - first(k * r) / r) + lateral * first(k * r) / r

    def determinant(k):
        return (traction(k, inner, j0, j1) * traction(k, outer, y0, y1)
                - traction(k, outer, j0, j1) * traction(k, inner, y0, y1))

    k = brentq(determinant, 0.5 / outer, 2.4 / outer)
    return k * math.sqrt(direct / rho) / (2 * np.pi)


def breathing(body, near):
    """Frequency [Hz] of the mode that looks most like radial motion."""
    found, shapes = frequencies(body, 3, near)
    radial = np.zeros_like(body.nodes)
    radial[:, :2] = body.nodes[:, :2] / np.linalg.norm(body.nodes[:, :2], axis=1)[:, None]
    return found[np.argmax(np.abs(shapes.T @ (body.mass @ radial.ravel())))]


@pytest.mark.parametrize("element", ["hexahedron", "tetrahedron"])
def test_frequency_of_a_ring_converges_fast_only_with_curved_elements(element):
    exact = ring_root(0.04, 0.1, 2.1e11, 0.3, 7850.0, "strain")
    errors = []
    for size in (0.03, 0.015):
        mesh = generate(Ring(0.1, 0.04, 0.02, size, 1, element))
        errors.append([
            breathing(ElasticBody(one, STEEL, fixed={"contact": "z", "top": "z"}), exact) / exact
            - 1.0 for one in (mesh, Mesh(mesh.nodes, mesh.cells, mesh.boundaries))])
    (coarse, coarse_straight), (fine, fine_straight) = errors
    assert 0.0 < fine < 1.5e-4
    assert coarse > 8.0 * fine  # fourth order: 16 in the limit
    assert 3.5 < coarse_straight / fine_straight < 5.0  # second order
    assert fine_straight > 1e-3


@pytest.mark.parametrize("triangles", [False, True])
def test_frequency_of_a_plane_ring_converges_fast_only_with_curved_elements(triangles):
    exact = ring_root(0.5, 1.0, 2.1e11, 0.3, 7850.0, "stress")
    errors = []
    for count in (6, 12):
        mesh = polar(count, triangles)
        supports = {"bottom": "y", "top": "x"}
        errors.append([breathing(ElasticBody(one, STEEL, fixed=supports), exact) / exact - 1
                       for one in (mesh, Mesh(mesh.nodes, mesh.cells, mesh.boundaries))])
    (coarse, coarse_straight), (fine, fine_straight) = errors
    assert 0.0 < fine < 2e-5
    assert coarse > 10.0 * fine
    assert 3.5 < coarse_straight / fine_straight < 4.5


@pytest.mark.parametrize("element", ["hexahedron", "tetrahedron"])
def test_cantilever_bends_as_beam_theory_says(element):
    L, b, h = 1.0, 0.05, 0.04
    body = ElasticBody(generate(SolidBlock(L, b, h, element_size=0.05, element=element)), STEEL,
                       fixed={"left": "xyz"})
    found, _ = frequencies(body, 2, 10.0)
    E, rho = 2.1e11, 7850.0
    for frequency, height in zip(np.sort(found), (h, b), strict=True):
        beam = 1.875104**2 / (2 * np.pi * L**2) * math.sqrt(E * height**2 / (12 * rho))
        # The clamped end holds the contraction across, which beams do not know.
        assert frequency == pytest.approx(beam, rel=0.006)


def test_rod_on_rollers_swings_along_as_a_string_of_waves():
    """Free along x, held across: P waves of c^2 = (lambda + 2 mu) / rho, f = n c / (2 L)."""
    body = ElasticBody(generate(SolidBlock(0.5, 0.05, 0.05, element_size=0.05)), STEEL, fixed={
        "contact": "z", "top": "z", "front": "y", "back": "y"})
    E, nu = 2.1e11, 0.3
    speed = math.sqrt(E * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / 7850.0)
    found, _ = frequencies(body, 3, 1.2 * speed)
    assert np.sort(found)[1:] == pytest.approx([speed, 2.0 * speed], rel=2e-4)


def test_thick_square_plate_of_nafems_fv52():
    """Simply supported along the bottom edges; a coarse mesh, since line supports do not converge.

    Of the tabled frequencies the first three are rigid motions.
    """
    body = ElasticBody(generate(Plate(10.0, 10.0, 1.0, 2.5)), Material(2e11, 0.3, 8000.0),
                       fixed={"bottom_edges": "z"})
    found = np.sort(frequencies(body, 10, 1.0)[0])
    assert found[:3].max() < 1e-3
    assert found[3:] == pytest.approx(
        [45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19], rel=0.05)


@pytest.mark.parametrize(("kind", "element"), [
    ("hinge", "hexahedron"), ("hinge_z", "tetrahedron")])
def test_a_disc_on_a_pin_turns_about_its_axis(kind, element):
    body = ElasticBody(generate(Ring(element=element)), STEEL, fixed={"inner": kind})
    (hinge,) = body.hinges
    assert np.abs(hinge.axis) == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert hinge.centre == pytest.approx([0.0, 0.0, 0.005], abs=1e-12)
    turn = np.cross([0.0, 0.0, 1.0], body.nodes).ravel()
    E = body.expansion
    free = E.T @ turn / np.asarray((E.multiply(E)).sum(axis=0)).ravel()
    assert E @ free == pytest.approx(turn, abs=1e-12)
    assert np.abs(E.T @ (body.stiffness @ turn)).max() < 1e-10 * abs(body.stiffness).max()
    mass = 7850.0 * math.pi * (0.1**2 - 0.04**2) * 0.01
    assert turn @ (body.mass @ turn) == pytest.approx(mass * (0.1**2 + 0.04**2) / 2, rel=1e-4)


@pytest.mark.parametrize(("options", "message"), [
    ({"thickness": 0.1}, "thickness and plane are those of plane bodies; leave them out"),
    ({"plane": "strain"}, "thickness and plane are those of plane bodies"),
    ({"fixed": {"left": "xw"}}, r"fixed\['left'\] = 'xw' must be one of 'hinge', 'hinge_x'"),
])
def test_options_of_plane_bodies_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        ElasticBody(block_mesh((1, 1, 1)), **options)


def test_hinges_without_an_axis_ask_for_one():
    body = ElasticBody(block_mesh((1, 1, 1)), fixed={"left": "hinge"})
    with pytest.raises(InputError, match="finds no axis, since 'left' is neither a round face"):
        _ = body.expansion


def test_solids_in_pieces_are_refused():
    from fecontact import MeshError

    one = block_mesh((1, 1, 1))
    both = Mesh(np.concatenate([one.nodes, one.nodes + 9.0]), np.concatenate([one.cells,
                                                                              one.cells + 8]))
    with pytest.raises(MeshError, match="consists of 2 pieces that share no node"):
        ElasticBody(both)
    assert replace(one) is not one
