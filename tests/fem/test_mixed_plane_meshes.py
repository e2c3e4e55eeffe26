"""Plane meshes of triangles and quadrilaterals together."""

import numpy as np
import pytest
from meshes_for_tests import rectangle, skewed
from numpy.testing import assert_allclose

from fecontact import ElasticBody, Material, Mesh, MeshError, modal_basis, read_mesh, write_mesh
from fecontact.fem import BodyFields, stress_of
from fecontact.fem.body_forces import boundary_forces
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.elements.cell_kinds import padded
from fecontact.fem.faces.surface import as_triangles
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.follower_pressure import follower_pressure
from fecontact.reduction import eigenfrequencies_hz

DEGREES = pytest.mark.parametrize("degree", [1, 2])
ELEMENTS = pytest.mark.parametrize("elements", [
    {"degree": 1}, {"degree": 2}, {"degree": 2, "bricks": "serendipity"}])
GRADIENT = np.array([[0.3, -0.2], [0.1, 0.4]])


def mixed(columns=6, rows=4, size=(0.2, 0.1), **options):
    """Triangles in every other square of two by two cells."""
    def cut(centres):
        column, row = (centres / np.array(size) * [columns, rows] // 2).T
        return (column + row) % 2 == 1

    return rectangle(*size, columns, rows, triangles=cut, **options)


@ELEMENTS
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_constant_strain_in_a_distorted_mixed_mesh(elements, plane):
    """Patch test: no forces inside, the exact work, and the exact stress at all nodes."""
    mesh = mixed(warp=skewed)
    assert mesh.cell_counts == {"triangles": 24, "quadrilaterals": 12}
    body = ElasticBody(mesh, **elements, plane=plane, thickness=0.02)
    u = body.nodes @ GRADIENT.T
    forces = (body.stiffness @ u.ravel()).reshape(-1, 2)
    inside = np.ones(len(u), bool)
    inside[np.unique(body.facet_nodes(mesh.outline))] = False
    assert np.count_nonzero(inside) > 14
    assert np.abs(forces[inside]).max() < 1e-11 * np.abs(forces).max()
    direct, lateral, shear = body.elasticity[0]
    strain = 0.5 * (GRADIENT + GRADIENT.T)
    stress = np.array([direct * strain[0, 0] + lateral * strain[1, 1],
                       lateral * strain[0, 0] + direct * strain[1, 1], 2.0 * shear * strain[0, 1]])
    work = stress @ [strain[0, 0], strain[1, 1], 2.0 * strain[0, 1]]
    assert u.ravel() @ forces.ravel() == pytest.approx(work * mesh.area * 0.02, rel=1e-11)
    found = stress_of(body, u.reshape(-1, 1))[:, [0, 1, 3], 0]
    assert_allclose(found, np.broadcast_to(stress, found.shape), rtol=1e-9)


@DEGREES
def test_a_mixed_body_has_its_mass_and_three_rigid_motions(degree):
    body = ElasticBody(mixed(), degree=degree, thickness=0.5)
    assert body.total_mass == pytest.approx(7850.0 * 0.01, rel=1e-13)
    assert body.component_mass.sum() == pytest.approx(78.5, rel=1e-12)
    x, y = body.nodes.T
    if degree == 2:
        inertia = x @ (body.component_mass @ x) + y @ (body.component_mass @ y)
        assert inertia == pytest.approx(78.5 * (0.2**2 + 0.1**2) / 3.0, rel=1e-12)
    frequencies = eigenfrequencies_hz(body, 4)
    assert (frequencies[:3] == 0.0).all()
    assert frequencies[3] > 1000.0


@pytest.mark.parametrize(("elements", "order"), [
    ({"degree": 1}, 2), ({"degree": 2}, 4), ({"degree": 2, "bricks": "serendipity"}, 4)])
def test_frequencies_converge_as_the_order_of_the_elements(elements, order):
    """A rectangle with sliding edges: shear waves c_s / 2 |(l / a, m / b)|."""
    size, steel = (1.0, 0.8), Material()
    slide = {"left": "x", "right": "x", "bottom": "y", "top": "y"}
    speed = np.sqrt(steel.youngs_modulus / (2.0 * (1.0 + steel.poisson_ratio) * steel.density))
    exact = 0.5 * speed * np.hypot(1.0 / size[0], 1.0 / size[1])
    errors = []
    for count in (1, 2):
        mesh = mixed(8 * count, 8 * count, size)
        body = ElasticBody(mesh, steel, plane="strain", **elements, fixed=slide)
        errors.append(eigenfrequencies_hz(body, 1)[0] / exact - 1.0)
    assert 0.0 < errors[1] < errors[0]
    assert np.log2(errors[0] / errors[1]) > order - 0.2


@DEGREES
def test_pressure_on_edges_of_both_kinds_has_exact_force_and_moment(degree):
    body = ElasticBody(mixed(), degree=degree, thickness=0.3)
    forces = boundary_forces(body, "bottom")[:, 0].reshape(-1, 2)
    assert_allclose(forces.sum(axis=0), [0.0, 0.2 * 0.3], atol=1e-15)
    assert forces[:, 1] @ body.nodes[:, 0] == pytest.approx(0.06 * 0.1, rel=1e-13)
    follower, _ = follower_pressure(body, {"bottom": 1.0}, np.zeros(body.nodes.shape))
    assert_allclose(follower, forces.ravel(), atol=1e-15)


@DEGREES
@pytest.mark.parametrize("count", [5, "all"])
def test_contact_nodes_on_an_edge_of_both_kinds(degree, count):
    """They take the whole length, and move as a linear displacement where they are."""
    body = ElasticBody(mixed(), degree=degree)
    found = contact_groups(body, "bottom", count)
    assert found.tributary.sum() == pytest.approx(0.2, rel=1e-13)
    moved = (found.matrix @ (body.nodes @ GRADIENT.T).ravel()).reshape(len(found.positions), -1)
    assert_allclose(moved[:, :2], found.positions @ GRADIENT.T, atol=1e-14)


def test_quadratic_displacements_are_interpolated_in_both_kinds():
    body = ElasticBody(mixed(warp=skewed), plane="strain")

    def moved(places):
        x, y = places.T
        return np.column_stack([x**2 - x * y, 0.5 * y**2 + x])

    straight = Mesh(body.nodes, BodyFields(body.nodes, body.elements, body.nodes, np.zeros(
        (len(body.nodes), 4))).cells)
    assert straight.area == pytest.approx(body.mesh.area, rel=1e-12)
    body = ElasticBody(mixed(), plane="strain")
    u = moved(body.nodes)
    fields = BodyFields(body.nodes, body.elements, u, stress_of(body, u.reshape(-1, 1))[..., 0])
    for place in np.random.default_rng(1).uniform((0.0, 0.0), (0.2, 0.1), (40, 2)):
        assert_allclose(fields.at(place)[0], moved(place[None])[0], atol=1e-13)
    assert len(fields.outline) == 2 * 20
    corners = fields.nodes[as_triangles(fields.cells)]
    sides = corners[:, 1:] - corners[:, :1]
    assert 0.5 * np.linalg.det(sides).sum() == pytest.approx(0.02, rel=1e-12)


def test_large_rotations_of_a_mixed_body_have_no_forces():
    mesh = mixed(warp=skewed)
    for degree in (1, 2):
        body = ElasticBody(mesh, degree=degree, plane="strain")
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        model = FiniteStrainModel(body)
        turned = (body.nodes @ (turn - np.eye(2)).T).ravel()
        state = model.state(turned, tangent=False)
        linear = np.abs(body.stiffness @ turned).max()
        assert np.abs(state.force).max() < 1e-12 * linear


@pytest.mark.parametrize("curved", [False, True])
def test_refined_written_and_turned_meshes_stay_what_they_are(tmp_path, curved):
    mesh = mixed()
    if curved:
        top = mesh.boundaries["top"]
        middles = mesh.nodes[top].mean(axis=1) + np.array([0.0, 0.002])
        mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, {}, top, middles)
        assert mesh.area == pytest.approx(0.02 + 0.2 * 0.002 * 2.0 / 3.0, rel=1e-12)
    fine = mesh.refined()
    assert fine.cell_counts == {name: 4 * number for name, number in mesh.cell_counts.items()}
    assert fine.area == pytest.approx(mesh.area, rel=1e-9)
    assert len(fine.boundaries["bottom"]) == 12
    write_mesh(mesh, tmp_path / "a.msh")
    again = read_mesh(tmp_path / "a.msh")
    mirrored = mesh.placed((1.0, 2.0), 30.0, mirror="x")
    for one in (again, mirrored):
        assert one.cell_counts == mesh.cell_counts
        assert one.area == pytest.approx(mesh.area, rel=1e-12)
        assert len(one.outline) == len(mesh.outline) == 20
        assert len(one.curved_edges) == len(mesh.curved_edges)


DECKS = {
    "a.inp": ("*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,2,0\n*ELEMENT, TYPE=CPE4, ELSET=Q\n1,1,2,3,4\n"
              "*ELEMENT, TYPE=CPE3, ELSET=T\n2,2,5,3\n"),
    "b.inp": ("*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,2,0\n6,.5,0\n7,1,.5\n8,.5,1\n9,0,.5\n"
              "10,1.5,0\n11,1.5,.5\n*ELEMENT, TYPE=CPE8, ELSET=Q\n1,1,2,3,4,6,7,8,9\n"
              "*ELEMENT, TYPE=CPE6, ELSET=T\n2,2,5,3,10,11,7\n"),
    "a.bdf": ("BEGIN BULK\n" + "".join(f"GRID,{k},,{x},{y},0.\n" for k, (x, y) in enumerate(
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 0.0)], start=1))
              + "CQUAD4,1,1,1,2,3,4\nCTRIA3,2,2,2,5,3\nENDDATA\n"),
    "a.msh": ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n"
              "4 0 1 0\n5 2 0 0\n$EndNodes\n$Elements\n2\n1 3 2 1 1 1 2 3 4\n2 2 2 2 2 2 5 3\n"
              "$EndElements\n"),
}


@pytest.mark.parametrize("name", DECKS)
def test_files_with_both_kinds_are_read(tmp_path, name):
    (tmp_path / name).write_text(DECKS[name])
    mesh = read_mesh(tmp_path / name)
    assert mesh.cell_counts == {"triangles": 1, "quadrilaterals": 1}
    assert mesh.area == pytest.approx(1.5, rel=1e-14)
    assert len(mesh.outline) == 5
    assert len(mesh.curved_edges) == 0
    if name.endswith("inp"):
        assert {key: cells.tolist() for key, cells in mesh.cell_groups.items()} == {
            "Q": [0], "T": [1]}


def test_materials_by_kind_and_frequencies_beside_those_of_one_kind():
    """Halves of one material as two groups, and a mesh of quadrilaterals alone."""
    mesh = mixed(12, 8)
    three = np.array([len(set(row)) == 3 for row in mesh.cells.tolist()])
    groups = {"t": np.flatnonzero(three), "q": np.flatnonzero(~three)}
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, cell_groups=groups)
    body = ElasticBody(mesh, {"t": Material(), "q": Material()}, fixed={"left": "xy"})
    alone = ElasticBody(rectangle(0.2, 0.1, 12, 8), fixed={"left": "xy"})
    assert_allclose(eigenfrequencies_hz(body, 4), eigenfrequencies_hz(alone, 4), rtol=1e-3)


def test_a_contact_basis_has_triangles_of_the_whole_area():
    basis = modal_basis(ElasticBody(mixed()), 8, contact="bottom", contact_nodes=5)
    shapes = basis.mode_shapes
    corners = shapes.nodes[as_triangles(shapes.cells)]
    assert 0.5 * np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() == pytest.approx(0.02)


def test_bad_mixed_cells_are_named():
    nodes = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0)]
    with pytest.raises(MeshError, match="1 mesh cells have no area: they repeat corners, the first "
                                        "is cell 1"):
        Mesh(nodes, padded([np.array([[0, 1, 2, 3]]), np.array([[1, 4]])]))
    with pytest.raises(MeshError, match=r"1 mesh cells have no area, the first is cell 1 at "):
        Mesh([*nodes[:4], (3, 0)], padded([np.array([[0, 1, 2, 3]]), np.array([[0, 1, 4]])]))
