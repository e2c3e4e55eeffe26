"""Wedges, pyramids and meshes of several kinds of cells."""

import math
from dataclasses import replace
from itertools import combinations

import meshio
import numpy as np
import pytest
from solid_blocks import block_mesh, mixed_mesh

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    Load,
    Material,
    Mesh,
    MeshError,
    modal_basis,
    read_mesh,
    static_solution,
    write_mesh,
)
from fecontact.fem import BodyFields, Tie, stress_of
from fecontact.fem.body_forces import boundary_facets, boundary_forces
from fecontact.fem.contact_face import contact_groups
from fecontact.fem.elements.cell_geometry import sides_of
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    HEXAHEDRON,
    PYRAMID,
    QUADRILATERAL,
    TETRAHEDRON,
    WEDGE,
    blocks_of,
    padded,
    shape_functions,
)
from fecontact.fem.elements.quadrature import rule
from fecontact.fem.equations import facets_of_boundary
from fecontact.fem.faces.contact_patches import face_surface
from fecontact.fem.faces.moving_feet import DeformedFace
from fecontact.fem.faces.surface import Surface, triangular
from fecontact.fem.follower_pressure import follower_pressure
from fecontact.output.files.contact_facets import contact_facets
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.solvers.solid_solver import aspect_ratios
from fecontact.study.imported import imported

SIZE = (0.2, 0.03, 0.02)


def wedges(counts, size=SIZE):
    """Corners of wedges along x: the hexahedra of a block, cut along a diagonal of y and z."""
    block = block_mesh(counts, size)
    a, b, c, d, e, f, g, h = block.cells.T
    return block.nodes, np.concatenate([np.stack([a, d, h, b, c, g], axis=1),
                                        np.stack([a, h, e, b, g, f], axis=1)])


def second_order(nodes, cells, kind, bend=None):
    """All nodes and second-order cells, whose middles lie where ``bend`` takes straight ones."""
    ends = np.sort(cells[:, np.array(kind.edges)], axis=2)
    pairs, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = nodes[pairs].mean(axis=1)
    places = np.concatenate([nodes, middles])
    return (places if bend is None else bend(places),
            np.concatenate([cells, len(nodes) + number.reshape(len(cells), -1)], axis=1))


def deck(path, nodes, *blocks, extra=""):
    types = {4: "C3D4", 10: "C3D10", 5: "C3D5", 13: "C3D13", 6: "C3D6", 15: "C3D15", 8: "C3D8",
             20: "C3D20"}
    text = "*NODE\n" + "".join(f"{k}, {', '.join(map(repr, place))}\n"
                               for k, place in enumerate(nodes.tolist(), start=1))
    first = 1
    for cells in blocks:
        text += f"*ELEMENT, TYPE={types[cells.shape[1]]}, ELSET=E\n" + "".join(
            f"{k}, {', '.join(map(str, row))}\n"
            for k, row in enumerate((cells + 1).tolist(), start=first))
        first += len(cells)
    path.write_text(text + extra)
    return path


KINDS = pytest.mark.parametrize("kind", [TETRAHEDRON, PYRAMID, WEDGE, HEXAHEDRON],
                                ids=lambda kind: kind.name)
DEGREES = pytest.mark.parametrize("degree", [1, 2])
SERENDIPITY = {"degree": 2, "bricks": "serendipity"}
# Keys of ElasticBody.
ELEMENTS = pytest.mark.parametrize("elements", [{"degree": 1}, {"degree": 2}, SERENDIPITY],
                                   ids=["linear", "quadratic", "serendipity"])


def bend(places):
    return places + 0.006 * np.sin(60.0 * places[:, ::-1])


def linear(places):
    """A displacement with constant strain, and a rotation."""
    return places @ np.array([[0.3, -0.2, 0.5], [0.1, 0.4, -0.6], [-0.7, 0.2, 0.1]]).T + 0.05


@KINDS
@ELEMENTS
def test_shape_functions_are_one_at_their_node_and_hold_polynomials(kind, elements):
    degree = elements["degree"]
    places = np.array(kind.places[: kind.count(degree, "bricks" in elements)], float)
    values, _ = shape_functions(3, len(places), places)
    assert values == pytest.approx(np.eye(len(places)), abs=1e-14)
    local, weights = rule(3, kind.corners, 4)
    at, slopes = shape_functions(3, len(places), local)
    for powers in np.ndindex(3, 3, 3):
        if sum(powers) <= degree:
            assert at @ np.prod(places**powers, axis=1) == pytest.approx(
                np.prod(local**powers, axis=1), abs=1e-13)
    step = 1e-6 * np.eye(3)
    differences = [(shape_functions(3, len(places), local + one)[0]
                    - shape_functions(3, len(places), local - one)[0]) / 2e-6 for one in step]
    assert slopes == pytest.approx(np.stack(differences, axis=-1), abs=1e-7)
    assert weights.sum() == pytest.approx({4: 1.0 / 6.0, 5: 1.0 / 3.0, 6: 0.5, 8: 1.0}[
        kind.corners], rel=1e-14)


@KINDS
@ELEMENTS
def test_faces_have_the_functions_of_triangles_or_quadrilaterals(kind, elements):
    """Elements of all kinds fit together: on a face others' nodes have no part."""
    (nodes,) = (np.array(kind.places[: kind.corners], float)[np.argsort(kind.order)],)
    body = ElasticBody(Mesh(nodes, [np.arange(kind.corners)]), **elements)
    (block,) = body.blocks
    for face in body.mesh.outline:
        ((_, own),) = blocks_of(body.facet_nodes(face[None]))
        local, _ = rule(2, 3, 4)
        flat, _ = shape_functions(2, own.shape[1], local)
        values, _ = shape_functions(3, block.nodes.shape[1], flat @ body.nodes[own[0]])
        whole = np.zeros((len(local), len(body.nodes)))
        whole[:, block.nodes[0]] = values
        assert whole[:, own[0]] == pytest.approx(flat, abs=1e-13)
        assert np.delete(whole, own[0], axis=1) == pytest.approx(0.0, abs=1e-13)


def test_serendipity_functions_are_the_published_ones():
    """Of bricks in Zienkiewicz's book, of pyramids G. Bedrosian, Int. J. Num. Meth. Eng. 35 (1992).

    With r, s from -1 to 1 over a brick, and from -w to w, w = 1 - t, over a pyramid.
    """
    local = np.random.default_rng(3).uniform(0.0, 0.3, (9, 3))
    r, s, t = 2.0 * local.T - 1.0
    places = 2.0 * np.array(HEXAHEDRON.places[:20]) - 1.0
    expected = []
    for a, b, c in places:
        if a * b * c:
            expected.append((1 + a * r) * (1 + b * s) * (1 + c * t) / 8
                            * (a * r + b * s + c * t - 2))
        else:
            squares = [1 - x**2 if k == 0.0 else 1 + k * x
                       for k, x in zip((a, b, c), (r, s, t), strict=True)]
            expected.append(np.prod(squares, axis=0) / 4)
    assert shape_functions(3, 20, local)[0] == pytest.approx(np.array(expected).T, abs=1e-14)
    t = local[:, 2]
    w = 1.0 - t
    r, s = 2.0 * local[:, :2].T - w
    expected = []
    for a, b, c in np.array(PYRAMID.places[:13]) * [2.0, 2.0, 1.0]:
        if c == 1.0:
            expected.append(t * (2 * t - 1))
        elif c == 0.5:  # half way between a corner and the top
            expected.append(t * (w + (2 * a - 1) * r) * (w + (2 * b - 1) * s) / w)
        elif 1.0 in (a, b):  # in the middle of a side of the base
            along, across, to = (r, s, b - 1) if a == 1.0 else (s, r, a - 1)
            expected.append((w**2 - along**2) * (w + to * across) / (2 * w))
        else:
            a, b = a - 1, b - 1
            expected.append((a * r + b * s - 1) * ((1 + a * r) * (1 + b * s) - t
                                                   + a * b * r * s * t / w) / 4)
    assert shape_functions(3, 13, local)[0] == pytest.approx(np.array(expected).T, abs=1e-14)
    r, s = 2.0 * local[:, :2].T - 1.0
    expected = []
    for a, b in 2.0 * np.array(QUADRILATERAL.places[:8]) - 1.0:
        if a * b:
            expected.append((1 + a * r) * (1 + b * s) * (a * r + b * s - 1) / 4)
        else:
            expected.append((1 - r**2) * (1 + b * s) / 2 if a == 0.0 else
                            (1 - s**2) * (1 + a * r) / 2)
    assert shape_functions(2, 8, local[:, :2])[0] == pytest.approx(np.array(expected).T, abs=1e-14)


@pytest.mark.parametrize("powers", [(2, 1, 1), (0, 4, 0), (1, 1, 3), (2, 2, 0)])
def test_rules_of_wedges_and_pyramids_are_exact(powers):
    """int x^a y^b z^c: over a pyramid B(a + b + 3, c + 1) / ((a + 1) (b + 1))."""
    a, b, c = powers
    local, weights = rule(3, 5, 5)
    beta = math.gamma(a + b + 3) * math.gamma(c + 1) / math.gamma(a + b + c + 4)
    assert weights @ np.prod(local**powers, axis=1) == pytest.approx(
        beta / ((a + 1) * (b + 1)), rel=1e-13)
    local, weights = rule(3, 6, 5)
    assert weights @ np.prod(local**powers, axis=1) == pytest.approx(
        math.factorial(a) * math.factorial(b) / math.factorial(a + b + 2) / (c + 1), rel=1e-13)


@pytest.mark.parametrize("elements", [
    {"degree": 1, "bricks": "full"}, {"degree": 1, "bricks": "incompatible"}, {"degree": 2},
    SERENDIPITY, {"degree": 1, "integration": "full"}, {"degree": 1, "integration": "reduced"},
    SERENDIPITY | {"integration": "full"}, SERENDIPITY | {"integration": "reduced"}])
def test_constant_strain_in_a_distorted_mixed_mesh(elements):
    """Patch test: no forces inside, the exact work, and the exact stress at all nodes."""
    mesh = mixed_mesh((2, 3, 3), bend=bend)
    assert min(mesh.cell_counts.values()) > 10
    body = ElasticBody(mesh, **elements)
    u = linear(body.nodes)
    forces = (body.stiffness @ u.ravel()).reshape(-1, 3)
    inside = np.ones(len(u), bool)
    inside[np.unique(body.facet_nodes(mesh.outline))] = False
    assert np.count_nonzero(inside) > 20
    assert np.abs(forces[inside]).max() < 1e-10 * np.abs(forces).max()
    gradient = np.array([[0.3, -0.2, 0.5], [0.1, 0.4, -0.6], [-0.7, 0.2, 0.1]])
    _, lateral, shear = body.elasticity[0]
    strain = 0.5 * (gradient + gradient.T)
    stress = lateral * np.trace(strain) * np.eye(3) + 2.0 * shear * strain
    assert u.ravel() @ forces.ravel() == pytest.approx(
        (stress * strain).sum() * mesh.volume, rel=1e-11)
    components = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    found = stress_of(body, u.reshape(-1, 1))[..., 0]
    assert found == pytest.approx(np.broadcast_to(components, found.shape), rel=1e-9)


@pytest.mark.parametrize("bricks", ["full", "serendipity"])
def test_bending_is_exact_at_second_order(bricks):
    """Energy of u = (x z, 0, -x^2 / 2), whose strain is xx = z: E h^3 L B / 24, if nu = 0."""
    size = (0.2, 0.1, 0.05)
    body = ElasticBody(mixed_mesh((1, 2, 2), size), Material(2e11, 0.0, 7850.0), bricks=bricks)
    x, _, z = body.nodes.T
    u = np.stack([x * z, 0.0 * x, -0.5 * x**2], axis=1).ravel()
    assert 0.5 * u @ (body.stiffness @ u) == pytest.approx(
        2e11 * size[0] * size[1] * size[2] ** 3 / 6.0, rel=1e-11)
    assert stress_of(body, u.reshape(-1, 1))[:, 0, 0] == pytest.approx(2e11 * z, abs=1.0)


@ELEMENTS
def test_a_mixed_body_has_its_mass_and_six_rigid_motions(elements):
    body = ElasticBody(mixed_mesh((1, 2, 2), bend=bend), **elements)
    assert body.mesh.volume == pytest.approx(1e-3, rel=1e-12)
    assert body.component_mass.sum() == pytest.approx(7.85, rel=1e-12)
    x, y, _ = body.nodes.T
    inertia = x @ (body.component_mass @ x) + y @ (body.component_mass @ y)
    exact = 7.85 * (0.2**2 + 0.1**2) / 3.0
    # Squares of places are no functions of distorted serendipity elements.
    assert inertia == pytest.approx(exact, rel=1e-12 if elements == {"degree": 2} else 1e-3)
    frequencies = eigenfrequencies_hz(body, 8)
    assert (frequencies[:6] == 0.0).all()
    assert frequencies[6] > 1000.0


@pytest.mark.parametrize(("elements", "order"), [
    ({"degree": 1}, 2), ({"degree": 2}, 4), (SERENDIPITY, 4)])
def test_frequencies_converge_as_the_order_of_the_elements(elements, order):
    """A box with sliding faces: shear waves c_s / 2 |(l / a, m / b, n / c)|."""
    size = (1.0, 0.8, 0.7)
    slide = {"left": "x", "right": "x", "front": "y", "back": "y", "contact": "z", "top": "z"}
    steel = Material()
    speed = np.sqrt(steel.youngs_modulus / (2.0 * (1.0 + steel.poisson_ratio) * steel.density))
    exact = 0.5 * speed * np.hypot(1.0 / size[0], 1.0 / size[1])
    errors = []
    for count in (1, 2):
        mesh = mixed_mesh((count, 3 * count, 3 * count), size)
        found = eigenfrequencies_hz(ElasticBody(mesh, steel, **elements, fixed=slide), 1)[0]
        errors.append(found / exact - 1.0)
    assert 0.0 < errors[1] < errors[0]
    assert np.log2(errors[0] / errors[1]) > order - 0.5


@pytest.mark.parametrize("bricks", ["full", "serendipity"])
def test_the_iterative_solver_finds_the_frequencies_of_the_direct_one(bricks):
    body = ElasticBody(mixed_mesh((1, 3, 3), bend=bend), fixed={"left": "xyz"}, bricks=bricks)
    assert np.ptp(aspect_ratios(body)) > 0.0
    assert eigenfrequencies_hz(body, 4, eigensolver="iterative") == pytest.approx(
        eigenfrequencies_hz(body, 4, eigensolver="direct"), rel=1e-7)


@ELEMENTS
def test_pressure_on_a_face_of_both_shapes_has_exact_force_and_moments(elements):
    """On z = 0, 0.2 x 0.1 m, of four quadrilaterals, triangles of wedges and of tetrahedra."""
    body = ElasticBody(mixed_mesh((1, 2, 2)), **elements)
    surface = face_surface(body, "contact")
    assert sorted(rows.shape[1] for _, rows in blocks_of(surface.facets)) == (
        [3, 4] if elements["degree"] == 1 else [6, 8 if "bricks" in elements else 9])
    assert surface.areas.sum() == pytest.approx(0.02, rel=1e-13)
    forces = surface.pressure_forces().reshape(-1, 3)
    assert forces.sum(axis=0) == pytest.approx([0.0, 0.0, 0.02], abs=1e-16)
    assert np.cross(body.nodes, forces).sum(axis=0) == pytest.approx(
        [0.02 * 0.05, -0.02 * 0.1, 0.0], abs=1e-16)
    follower, _ = follower_pressure(body, {"contact": 1.0}, np.zeros(body.nodes.shape))
    assert follower == pytest.approx(forces.ravel(), abs=1e-16)
    assert boundary_forces(body, "contact")[:, 0] == pytest.approx(forces.ravel(), abs=1e-16)


@ELEMENTS
@pytest.mark.parametrize("count", [5, "all"])
def test_contact_nodes_on_a_face_of_both_shapes(elements, count):
    """They take the whole area, and move as a linear displacement at their centre."""
    body = ElasticBody(mixed_mesh((1, 2, 2)), **elements)
    found = contact_groups(body, "contact", count)
    assert found.tributary.sum() == pytest.approx(0.02, rel=1e-13)
    moved = (found.matrix @ linear(body.nodes).ravel()).reshape(-1, 6)
    assert moved[:, :3] == pytest.approx(linear(found.positions), abs=1e-13)
    basis = modal_basis(body, 8, contact="contact", contact_nodes=count)
    shapes = basis.mode_shapes
    # Facets of the outline are triangles, those of a contact node have its area.
    parts = Surface(shapes.nodes, shapes.outline)
    own = np.bincount(shapes.outline_nodes + 1, parts.areas)[1:]
    assert own == pytest.approx(basis.tributary, rel=1e-12)
    assert (contact_facets(basis).at_cells(shapes.cells, len(shapes.nodes)) >= 0).any()
    # Facets of pictures and files are sides of cells, or halves of four-sided ones.
    sides = {frozenset(three) for side in sides_of(shapes.cells, 3)[0].tolist()
             for three in combinations(side, 3)}
    assert {frozenset(facet) for facet in shapes.outline.tolist()} <= sides


@ELEMENTS
def test_places_follow_faces_of_both_shapes(elements):
    """As those of ties and of feet: linear displacements are exact, also beside the face."""
    body = ElasticBody(mixed_mesh((1, 2, 2)), **elements)
    face = facets_of_boundary(body, "contact")
    rng = np.random.default_rng(5)
    flat = rng.uniform((0.0, 0.0), (0.2, 0.1), (60, 2))
    on_face = np.column_stack([flat, np.zeros(60)])
    facet, local, distance = face.closest(on_face)
    assert distance == pytest.approx(0.0, abs=1e-12)
    assert {*triangular(face.nodes[facet]).tolist()} == {True, False}
    weights = face.following(on_face, facet, local)
    assert np.einsum("sndc,snc->sd", weights, linear(body.nodes)[face.nodes[facet]]) == (
        pytest.approx(linear(on_face), abs=1e-12))
    beside = on_face - [0.0, 0.0, 1e-3]
    feet = DeformedFace(boundary_facets(body, "contact")).feet(beside, body.nodes)
    assert feet.valid.all()
    assert feet.places == pytest.approx(on_face, abs=1e-12)
    assert feet.gaps == pytest.approx(1e-3, rel=1e-9)
    again = DeformedFace(boundary_facets(body, "contact")).feet(beside, body.nodes, feet.facet)
    assert (again.facet == feet.facet).all()


@pytest.mark.parametrize(("bricks", "dependent"), [("full", 49), ("serendipity", 40)])
def test_ties_to_a_face_of_both_shapes_hold_constant_strain(bricks, dependent):
    """The face of a block of other cells follows it; linear displacements meet the tie."""
    lower, upper = mixed_mesh((1, 2, 2)), block_mesh((3, 3, 2)).placed((0.0, 0.0, 0.05))
    mesh = Mesh(np.concatenate([lower.nodes, upper.nodes]),
                padded([lower.cells, upper.cells + len(lower.nodes)]), {
                    "low": lower.boundaries["top"],
                    "high": upper.boundaries["contact"] + len(lower.nodes)})
    body = ElasticBody(mesh, constraints=[Tie("high", "low")], bricks=bricks)
    E = body.expansion.toarray()
    assert E.shape[0] - E.shape[1] == 3 * dependent
    u = linear(body.nodes).ravel()
    assert E @ np.linalg.lstsq(E, u)[0] == pytest.approx(u, abs=1e-12)
    assert eigenfrequencies_hz(body, 7)[6] > 1000.0


@pytest.mark.parametrize("bricks", ["full", "serendipity"])
def test_displacements_are_interpolated_in_all_kinds_of_cells(bricks):
    body = ElasticBody(mixed_mesh((1, 2, 2), bend=bend), bricks=bricks)
    u = linear(body.nodes)
    fields = BodyFields(body.nodes, body.elements, u, stress_of(body, u.reshape(-1, 1))[..., 0])
    for place in np.random.default_rng(1).uniform((0.0, 0.0, 0.0), (0.2, 0.1, 0.05), (40, 3)):
        moved, stress = fields.at(place)
        assert moved == pytest.approx(linear(place[None])[0], abs=1e-11)
        assert stress == pytest.approx(fields.stress[0], rel=1e-8)
    area = Surface(fields.nodes, fields.outline).areas.sum()
    assert area == pytest.approx(2.0 * (0.2 * 0.1 + 0.2 * 0.05 + 0.1 * 0.05), rel=1e-12)
    assert Mesh(fields.nodes, fields.cells).volume == pytest.approx(1e-3, rel=1e-12)


def test_refined_meshes_keep_volume_faces_groups_and_curves():
    mesh = mixed_mesh((1, 1, 2), bend=bend)
    whole = np.arange(len(mesh.cells))
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, cell_groups={
        "first": whole[:3], "others": whole[3:]}, materials={"first": Material(density=1000.0),
                                                            "others": Material()})
    fine = mesh.refined()
    assert fine.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert ElasticBody(fine).total_mass == pytest.approx(ElasticBody(mesh).total_mass, rel=1e-12)
    for name in mesh.boundaries:
        coarse, parts = (Surface(one.nodes, one.boundaries[name]) for one in (mesh, fine))
        assert len(parts.facets) == 4 * len(coarse.facets)
        assert parts.area_vectors.sum(axis=0) == pytest.approx(
            coarse.area_vectors.sum(axis=0), abs=1e-14)
    assert fine.refined().volume == pytest.approx(mesh.volume, rel=1e-12)


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("bricks", ["full", "serendipity"])
def test_written_mixed_meshes_are_read_again(tmp_path, curved, bricks):
    mesh = replace(mixed_mesh((1, 2, 2), bend=bend), bricks=bricks)
    if curved:
        edges = mesh.edges[0]
        edges = edges[(mesh.nodes[edges][:, :, 2] == 0.05).all(axis=1)]
        middles = mesh.nodes[edges].mean(axis=1) + np.array([0.0, 0.0, 0.004])
        mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, mesh.points, edges, middles,
                    bricks=bricks)
        assert mesh.volume > 1.02e-3
    path = tmp_path / "a.msh"
    write_mesh(mesh, path)
    again = read_mesh(path)
    assert again.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert (again.cell_counts, again.bricks) == (mesh.cell_counts, bricks)
    for name in mesh.boundaries:
        one, other = (np.sort(where.nodes[where.boundaries[name]].sum(axis=(1, 2)))
                      for where in (mesh, again))
        assert other == pytest.approx(one, rel=1e-12)
    if not curved and bricks == "full":
        fine = meshio.read(path)
        assert sum(len(block.data) for block in fine.cells if block.dim == 3) == len(mesh.cells)


@pytest.mark.parametrize("bricks", ["full", "serendipity"])
def test_gmsh_integrates_the_volume_of_a_written_curved_mesh(tmp_path, bricks):
    """Nodes in the middles of edges, faces and cells stand in its order."""
    gmsh = pytest.importorskip("gmsh")
    mesh = mixed_mesh((1, 2, 2))
    edges = mesh.edges[0]
    edges = edges[(mesh.nodes[edges][:, :, 2] == 0.05).all(axis=1)]
    middles = mesh.nodes[edges].mean(axis=1) + np.array([0.0, 0.0, 0.004])
    mesh = Mesh(mesh.nodes, mesh.cells, {}, {}, edges, middles, bricks=bricks)
    write_mesh(mesh, tmp_path / "a.msh")
    volume, names = 0.0, set()
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        for kind in gmsh.model.mesh.getElementTypes(3):
            names.add(gmsh.model.mesh.getElementProperties(kind)[0])
            points, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss8")
            determinants = gmsh.model.mesh.getJacobians(kind, points)[1]
            assert determinants.min() > 0.0
            volume += (determinants.reshape(-1, len(weights)) * weights).sum()
    finally:
        gmsh.finalize()
    assert names == {"Tetrahedron 10", *(
        {"Hexahedron 27", "Prism 18", "Pyramid 14"} if bricks == "full" else
        {"Hexahedron 20", "Prism 15", "Pyramid 13"})}
    assert volume == pytest.approx(mesh.volume, rel=1e-11)


def test_faces_of_four_sides_do_not_meet_triangles():
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                     (0, 1, 1), (0.5, 0.5, 2.0)], float)
    with pytest.raises(MeshError, match=r"1 four-sided faces .* first at \(0\.5, 0\.5, 1\); put "
                                        "pyramids between"):
        Mesh(cube, padded([np.arange(8)[None], np.array([[4, 5, 6, 8], [4, 6, 7, 8]])]))


def test_pressure_on_bricks_of_twenty_nodes_bends_as_in_calculix(tmp_path):
    """A bar of 8 x 2 x 1 cells C3D20, clamped, 3e4 Pa on its top; CalculiX 2.20 by *DLOAD."""
    block = block_mesh((8, 2, 1), SIZE)
    nodes, cells = second_order(block.nodes, block.cells, HEXAHEDRON)
    surface = "*SURFACE, NAME=TOP\n" + "".join(f"{k}, S2\n" for k in range(1, len(cells) + 1))
    held = "*NSET, NSET=LEFT\n" + "".join(
        f"{k},\n" for k in np.flatnonzero(nodes[:, 0] < 1e-9) + 1)
    mesh = read_mesh(deck(tmp_path / "a.inp", nodes, cells, extra=surface + held))
    body = ElasticBody(mesh, fixed={"LEFT": "xyz"})
    moved = static_solution(body, Load(boundaries=[BoundaryLoad("TOP", pressure=3e4)]))
    tip = int(np.linalg.norm(mesh.nodes - SIZE, axis=1).argmin())
    assert moved.displacement[tip] == pytest.approx(
        [2.795006e-06, 4.039742e-10, -4.184652e-05], rel=1e-6, abs=1e-13)


def test_second_order_wedges_follow_curved_faces(tmp_path):
    """A quarter of a tube of 3 x 1 x 1 cells of wedges: the volume of parabolic edges."""
    def bend(places):
        turn, radius = 0.5 * np.pi * places[:, 0], 1.0 + places[:, 1]
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), places[:, 2]], axis=1)

    exact = 0.25 * np.pi * 3.0
    nodes, cells = wedges((3, 1, 1), (1.0, 1.0, 1.0))
    straight = read_mesh(deck(tmp_path / "a.inp", bend(nodes), cells))
    curved = read_mesh(deck(tmp_path / "a.inp", *second_order(nodes, cells, WEDGE, bend)))
    assert straight.volume < 0.96 * exact
    assert curved.volume == pytest.approx(exact, rel=1e-3)
    outline = ElasticBody(curved).facet_nodes(curved.outline)
    radius = np.linalg.norm(ElasticBody(curved).nodes[outline][:, :, :2], axis=2)
    outer = radius[(radius > 1.95).all(axis=1)]
    assert outer == pytest.approx(2.0, rel=5e-3)
    assert ElasticBody(curved).component_mass.sum() == pytest.approx(7850.0 * curved.volume,
                                                                     rel=1e-12)


# A cube with a pyramid on top, a wedge at its right side and a tetrahedron at the wedge's end.
PLACES = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                   (0, 1, 1), (0.5, 0.5, 2), (2, 0, 0), (2, 1, 0), (1.5, -1, 0)], float)
MIXED = [("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]]), ("pyramid", [[4, 5, 6, 7, 8]]),
         ("wedge", [[1, 9, 5, 2, 10, 6]]), ("tetra", [[1, 9, 5, 11]])]


@pytest.mark.parametrize("seed", [None, 0, 1])
@pytest.mark.parametrize("form", ["a.vtu", "a.msh", "a.inp", "second order"])
def test_mixed_files_are_read_as_they_are(tmp_path, form, seed):
    order = (np.arange(len(PLACES)) if seed is None
             else np.random.default_rng(seed).permutation(len(PLACES)))
    blocks = [(kind, np.argsort(order)[np.array(cells)]) for kind, cells in MIXED]
    nodes = PLACES[order]
    if form == "second order":
        done = []
        for _, cells in blocks:
            pairs = cells[:, np.array(CELL_KINDS[3, cells.shape[1]].edges)].reshape(-1, 2)
            done.append(np.concatenate([cells, len(nodes) + np.arange(len(pairs))[None]], axis=1))
            nodes = np.concatenate([nodes, nodes[pairs].mean(axis=1)])
        path = deck(tmp_path / "a.inp", nodes, *done)
    elif form == "a.inp":
        path = deck(tmp_path / form, nodes, *(cells for _, cells in blocks))
    else:
        path = tmp_path / form
        meshio.write(path, meshio.Mesh(nodes, blocks), **(
            {"file_format": "gmsh22", "binary": False} if form == "a.msh" else {}))
    mesh = read_mesh(path)
    assert mesh.cell_counts == {"tetrahedra": 1, "pyramids": 1, "wedges": 1, "hexahedra": 1}
    assert mesh.volume == pytest.approx(1.0 + 1.0 / 3.0 + 0.5 + 1.0 / 6.0, rel=1e-12)
    assert len(mesh.outline) == 4 + 4 + 3 + 3
    assert len(mesh.curved_edges) == 0
    assert mesh.bricks == ("serendipity" if form == "second order" else "full")


@pytest.mark.parametrize(("corners", "order", "kind", "note"), [
    (6, 1, "C3D6", "64 wedges C3D6 become second-order wedges. With degree = 1 they stay first"),
    (6, 2, "C3D15", None),
    (8, 1, "C3D8R", "32 bricks C3D8R (one point) become second-order hexahedra. With"),
    (8, 1, "C3D8I", "32 bricks C3D8I become second-order hexahedra, with nearly the same"),
    (8, 1, "C3D8", "32 bricks C3D8 become second-order hexahedra. With degree = 1 in [body] they"),
    (4, 1, "C3D4", "192 tetrahedra C3D4 become second-order tetrahedra. With degree = 1 they stay"),
])
def test_an_import_tells_elements_that_are_read_as_others(tmp_path, corners, order, kind, note):
    block = block_mesh((8, 2, 2), SIZE, tetrahedra=corners == 4)
    nodes, cells = wedges((8, 2, 2)) if corners == 6 else (block.nodes, block.cells)
    if order == 2:
        nodes, cells = second_order(nodes, cells, WEDGE)
    path = deck(tmp_path / "a.inp", nodes, cells, extra=(
        "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
        "*SOLID SECTION, ELSET=E, MATERIAL=STEEL\n"))
    path.write_text(path.read_text().replace("TYPE=C3D8", f"TYPE={kind}"))
    found = imported(path)
    assert dict(found.contents.elements) == {kind: len(cells)}
    assert [one.startswith(note) for one in found.notes] == ([True] if note else [])
    if note:
        assert f"# {note}" in found.toml(tmp_path)


def test_folded_wedges_and_pyramids_are_refused(tmp_path):
    nodes, cells = wedges((1, 1, 1))
    used, folded = np.unique(cells[:1], return_inverse=True)
    folded = folded.reshape(1, 6)
    folded[0, [0, 3]] = folded[0, [3, 0]]
    with pytest.raises(MeshError, match=r"1 mesh cells have no volume, or are folded or inverted, "
                                        r"the first is cell 0 at \(0\.1, "):
        read_mesh(deck(tmp_path / "a.inp", nodes[used], folded))
    places = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0)], float)
    with pytest.raises(MeshError, match=r"1 mesh cells have no volume"):
        Mesh(places, [np.arange(5)])
    with pytest.raises(MeshError, match=r"they repeat corners, the first is cell 1"):
        Mesh(np.vstack([places[:4], [(0.5, 0.5, 1.0)]]), [(0, 1, 2, 3, 4), (0, 1, 4, 4, 4)])
