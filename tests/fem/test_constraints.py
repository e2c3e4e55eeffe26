"""Equations, ties and couplings of a body: patch tests, rigid modes, closed forms."""

import numpy as np
import pytest
from meshes_for_tests import joined, rectangle
from solid_blocks import block_mesh

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    MeshError,
    ModelWarning,
    PointLoad,
    modal_basis,
    static_solution,
)
from fecontact.fem import Coupling, LinearEquation, Rotation, Term, Tie
from fecontact.laws import Constant
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import eigenmodes, rigid_modes
from fecontact.reduction.solid_motions import rigid_motions

STEEL = Material()
TIE = Tie("one.right", "two.left")


def cut_block(first, second, *constraints, tetrahedra=False, gap=0.0, points=None):
    """A block 0.2 x 0.1 x 0.05, cut at x = 0.1, the halves ``gap`` apart."""
    halves = [block_mesh(counts, (0.1, 0.1, 0.05), tetrahedra=tetrahedra)
              for counts in (first, second)]
    return joined(halves[0], halves[1].placed((0.1 + gap, 0.0, 0.0)), constraints, points)


def cut_plate(first, second, *constraints):
    halves = [rectangle(0.1, 0.1, *counts) for counts in (first, second)]
    return joined(halves[0], halves[1].placed((0.1, 0.0)), constraints)


def linear_field(places):
    """Displacements of a uniform strain and a rotation."""
    d = places.shape[1]
    slope = 1e-3 * np.array([[1.0, 0.7, -0.4], [-0.2, 0.5, 0.9], [0.3, -0.8, 0.6]])[:d, :d]
    return (places @ slope.T).ravel()


BODIES = {
    "hexahedra, coarse to fine": cut_block((2, 2, 1), (3, 3, 2), TIE),
    "hexahedra, fine to coarse": cut_block((3, 3, 2), (2, 2, 1), TIE),
    "tetrahedra": cut_block((2, 3, 2), (2, 2, 1), TIE, tetrahedra=True),
    "plane": cut_plate((3, 3), (2, 2), TIE),
}


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("name", BODIES)
def test_a_tie_passes_linear_displacements(name, degree):
    """All nodes of a linear field follow from the independent ones, its stress is uniform."""
    body = ElasticBody(BODIES[name], STEEL, degree=degree)
    u, G = linear_field(body.nodes), body.expansion
    free = np.flatnonzero(np.diff(G.tocsr().indptr) == 1)
    q = np.zeros(G.shape[1])
    q[G.tocsr()[free].indices] = u[free]
    assert G @ q == pytest.approx(u, abs=1e-13)
    assert G.shape[1] < G.shape[0]


@pytest.mark.parametrize("name", BODIES)
def test_a_tied_pair_has_the_rigid_modes_of_one_body(name):
    body = ElasticBody(BODIES[name], STEEL, degree=1)
    w, shapes = eigenmodes(body, 8)
    count = 3 * (body.dimension - 1)
    assert (w[:count] == 0.0).all()
    assert w[count] > 1000.0
    motions = rigid_motions(body.nodes, body.nodes.mean(axis=0))
    assert np.abs(shapes[:, :count] - motions @ np.linalg.lstsq(
        motions, shapes[:, :count], rcond=None)[0]).max() < 1e-11 * np.abs(shapes).max()


def test_rigid_modes_strain_nothing_across_a_gap():
    """The rotation of the face carries nodes that lie off it."""
    tie = Tie("one.right", "two.left", tolerance=0.01)
    body = ElasticBody(cut_block((3, 3, 2), (2, 2, 1), tie, gap=0.005), STEEL)
    assert rigid_modes(body).shape[1] == 6
    w, _ = eigenmodes(body, 7)
    assert w[6] > 1000.0


def test_nodes_that_coincide_make_the_whole_block():
    """Matching meshes: the tied halves have the modes of the block meshed at once."""
    whole = ElasticBody(block_mesh((4, 2, 1)), STEEL)
    tied = ElasticBody(cut_block((2, 2, 1), (2, 2, 1), TIE), STEEL)
    assert eigenfrequencies_hz(tied, 12)[6:] == pytest.approx(
        eigenfrequencies_hz(whole, 12)[6:], rel=1e-10)
    assert tied.expansion.shape[1] == whole.expansion.shape[1]


@pytest.mark.parametrize("degree", [1, 2])
def test_plane_nodes_that_coincide_make_the_whole_plate(degree):
    whole = ElasticBody(rectangle(0.2, 0.1, 4, 2), STEEL, degree=degree)
    tied = ElasticBody(cut_plate((2, 2), (2, 2), TIE), STEEL, degree=degree)
    assert eigenfrequencies_hz(tied, 9)[3:] == pytest.approx(
        eigenfrequencies_hz(whole, 9)[3:], rel=1e-9)


def test_shares_of_a_plane_face_are_those_of_its_length():
    """The mean of u_y = x^2 over a side of two quadratic elements is L^2 / 3."""
    mesh = rectangle(0.1, 0.1, 2, 2)
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=[
        Coupling("top", "hub", (0.05, 0.1), "distributing")]), STEEL)
    moved = np.column_stack([0.0 * body.nodes[:, 0], body.nodes[:, 0] ** 2]).ravel()
    mean, turn = (body.motion_rows("hub") @ moved)[1:]
    assert mean == pytest.approx(0.1**2 / 3.0, rel=1e-12)
    # int (x - L/2) x^2 dx / int (x - L/2)^2 dx = L
    assert turn == pytest.approx(0.1, rel=1e-10)


def test_a_beam_cut_in_two_and_tied_across_other_cells_is_the_whole_one():
    """Fixed at one end: supports, dependent nodes and their independent ones together."""
    whole = ElasticBody(block_mesh((8, 4, 2)), STEEL, fixed={"left": "xyz"})
    cut = ElasticBody(cut_block((4, 3, 2), (4, 2, 1), TIE), STEEL, fixed={"one.left": "xyz"})
    assert eigenfrequencies_hz(cut, 6) == pytest.approx(eigenfrequencies_hz(whole, 6), rel=1e-2)


@pytest.mark.parametrize(("fine", "nested"), [((4, 4, 2), True), ((3, 3, 2), False)])
def test_static_deflection_of_a_tied_cantilever(fine, nested):
    """Pressure p on the end of a bar with nu = 0: u = p L / E, stress p everywhere.

    Exact where the cells of the one face divide those of the other; node by node otherwise.
    """
    body = ElasticBody(cut_block(fine, (2, 2, 1), TIE), Material(2.0e11, 0.0, 7800.0),
                       fixed={"one.left": "xyz"})
    found = static_solution(body, Load(boundaries=(BoundaryLoad("two.right", -1e6),)))
    end = np.unique(body.facet_nodes(body.mesh.boundaries["two.right"]))
    assert found.displacement[end, 0] == pytest.approx(1e6 * 0.2 / 2e11,
                                                       rel=1e-9 if nested else 5e-3)
    assert found.stress[:, 0] == pytest.approx(1e6, rel=1e-7 if nested else 0.3)


def test_a_tied_support_on_both_sides_is_no_contradiction():
    """Dependent nodes that are fixed as their independent ones are imply nothing new."""
    body = ElasticBody(cut_block((2, 3, 2), (2, 2, 1), TIE), STEEL,
                       fixed={"one.front": "xyz", "two.front": "xyz"})
    whole = ElasticBody(block_mesh((8, 4, 2)), STEEL, fixed={"front": "xyz"})
    assert eigenfrequencies_hz(body, 4) == pytest.approx(eigenfrequencies_hz(whole, 4), rel=2e-2)


def test_bases_of_tied_bodies_have_the_compliance_of_the_whole_one():
    """Attachment modes at contact nodes beside the tie: none of their compliance is missing."""
    options = {"contact_nodes": "all", "reduction": "residual", "tolerance": 0.0}
    tied = modal_basis(ElasticBody(cut_block((2, 2, 1), (2, 2, 1), TIE), STEEL), 10,
                       contact="two.contact", **options)
    whole = ElasticBody(block_mesh((4, 2, 1)), STEEL)
    half = Mesh(whole.mesh.nodes, whole.mesh.cells, {"two.contact": whole.mesh.boundaries[
        "contact"][(whole.mesh.nodes[whole.mesh.boundaries["contact"]][:, :, 0] > 0.09
                    ).all(axis=1)]})
    one = modal_basis(ElasticBody(half, STEEL), 10, contact="two.contact", **options)
    compliance, places = [], []
    for basis in (tied, one):
        order = np.lexsort(basis.positions[2:].round(6).T)
        places.append(basis.positions[2:][order])
        compliance.append(basis.quality.compliance[2:][order])
        elastic = basis.angular_frequencies > 0.0
        own = basis.contact_T[:, :3, elastic] / basis.angular_frequencies[elastic]
        assert (own**2).sum(axis=2) == pytest.approx(basis.quality.compliance[2:], rel=1e-6)
    assert places[0] == pytest.approx(places[1], abs=1e-12)
    assert compliance[0] == pytest.approx(compliance[1], rel=1e-8)


# Couplings --------------------------------------------------------------------------------


# A bar of length L, G J with the torsion constant 0.1406 a^4 of a square cross-section.
L, A = 0.4, 0.02
BAR = Material(2.0e11, 0.3, 7800.0)


def bar(*constraints, points=None, fixed="left", cells=(20, 2, 2)):
    mesh = block_mesh(cells, (L, A, A))
    held = {name: int(np.argmin(np.linalg.norm(mesh.nodes - place, axis=1)))
            for name, place in (points or {}).items()}
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, held, constraints=constraints)
    return ElasticBody(mesh, BAR, fixed={fixed: "xyz"} if fixed else {})


def face_motion(body, boundary, displacement, centre):
    """Motion of the nodes of a face as a rigid body (6,), and what is left."""
    nodes = np.unique(body.facet_nodes(body.mesh.boundaries[boundary]))
    motions = rigid_motions(body.nodes[nodes], np.asarray(centre))
    moved = displacement[nodes].ravel()
    motion = np.linalg.lstsq(motions, moved, rcond=None)[0]
    return motion, np.abs(moved - motions @ motion).max()


def test_a_kinematic_coupling_makes_the_end_of_a_bar_rigid():
    centre = (L, A / 2, A / 2)
    body = bar(Coupling("right", "hub", (L + 0.1, 0.03, -0.01)))
    load = Load(forces=tuple(PointLoad("right", component, signal=Constant(value))
                             for component, value in (("x", 500.0), ("y", 20.0), ("phi_x", 3.0))))
    found = static_solution(body, load)
    motion, rest = face_motion(body, "right", found.displacement, centre)
    assert rest < 1e-12 * np.abs(found.displacement).max()
    E, G = 2.0e11, 2.0e11 / 2.6
    inertia = A**4 / 12
    shear = 20.0 * L / (5 / 6 * G * A**2)
    # Ends that cannot contract or warp stiffen less than a tenth of a width of the length each.
    assert motion[0] == pytest.approx(500.0 * L / (E * A**2), rel=1e-2)
    assert motion[1] == pytest.approx(20.0 * L**3 / (3 * E * inertia) + shear, rel=1e-2)
    assert motion[3] == pytest.approx(3.0 * L / (G * 0.1406 * A**4), rel=5e-2)


def test_a_distributing_coupling_has_the_mean_motion_of_its_face():
    """The reference point is where the mean motion of the face takes it; nothing is stiffer."""
    place = (L + 0.1, 0.03, -0.01)
    link = LinearEquation((Term("probe", (0, 0, 1)), Term("hub", (0, 0, -1))))
    free, coupled = bar(), bar(
        Coupling("right", "hub", place, "distributing"), Coupling("right", "probe", place,
                                                                  "distributing"), link)
    assert eigenfrequencies_hz(coupled, 4) == pytest.approx(eigenfrequencies_hz(free, 4), rel=1e-9)


def test_couplings_by_one_reference_point_join_bodies():
    """A kinematic and a distributing coupling: one face turns with the mean of the other."""
    pair = cut_block((2, 2, 1), (3, 3, 2), Coupling("one.right", "hub", (0.15, 0.05, 0.0)),
                     Coupling("two.left", "hub", kind="distributing"), gap=0.1)
    body = ElasticBody(pair, STEEL)
    w, shapes = eigenmodes(body, 8)
    assert np.count_nonzero(w == 0.0) == 6
    assert w[6] > 100.0
    centre = np.array([0.15, 0.05, 0.0])
    for mode in shapes.T[5:]:
        motion, rest = face_motion(body, "one.right", mode.reshape(-1, 3), centre)
        assert rest < 1e-9 * np.abs(mode).max()
        facets = body.facet_nodes(body.mesh.boundaries["two.left"])
        weights = np.zeros(len(body.nodes))
        np.add.at(weights, facets, np.tile(np.array([1, 1, 1, 1, 4, 4, 4, 4, 16]) / 36 / 6, (6, 1)))
        arm = body.nodes - weights @ body.nodes
        u = mode.reshape(-1, 3)
        spread = np.einsum("n,nx,ny->xy", weights, arm, arm)
        turn = np.linalg.solve(np.trace(spread) * np.eye(3) - spread,
                               weights @ np.cross(arm, u))
        mean = weights @ u + np.cross(turn, centre - weights @ body.nodes)
        assert np.concatenate([mean, turn]) == pytest.approx(motion, rel=1e-7, abs=1e-7 * np.abs(
            motion).max())


def test_a_sliding_joint_leaves_a_seventh_rigid_mode():
    """Reference points of two bodies that share all motions but one."""
    names = ("one", "two")
    couplings = [Coupling(f"{name}.{face}", name, (0.15, 0.05, 0.025), "distributing")
                 for name, face in zip(names, ("right", "left"), strict=True)]
    equations = [LinearEquation((Term("one", shift, turn), Term("two", *-np.array([shift, turn]))))
                 for shift, turn in (((0, 1, 0), (0, 0, 0)), ((0, 0, 1), (0, 0, 0)),
                                     ((0, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 1, 0)),
                                     ((0, 0, 0), (0, 0, 1)))]
    body = ElasticBody(cut_block((2, 2, 1), (2, 2, 1), *couplings, *equations, gap=0.1), STEEL)
    w, shapes = eigenmodes(body, 9)
    assert np.count_nonzero(w == 0.0) == 7
    assert w[7] > 100.0
    slide = shapes[:, 6].reshape(-1, 3)
    first = body.nodes[:, 0] < 0.15
    assert slide[:, 1:] == pytest.approx(0.0, abs=1e-9 * np.abs(slide).max())
    assert np.ptp(slide[first, 0]) < 1e-9 * np.abs(slide).max()
    assert slide[first, 0].mean() * slide[~first, 0].mean() < 0.0


def test_a_line_of_coupled_nodes_keeps_its_turn_about_itself():
    """Turns of the reference point about the line move no node and are no unknowns."""
    mesh = block_mesh((2, 2, 1))
    edge = np.flatnonzero((mesh.nodes[:, 0] == 0.2) & (mesh.nodes[:, 2] == 0.0))
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, {"edge": edge}, constraints=[
        Coupling("edge", "hub", (0.3, 0.0, 0.0))]), STEEL)
    nodes = body.group_nodes("edge")
    assert body.expansion.shape[1] == 3 * (len(body.nodes) - len(nodes)) + 5
    assert np.count_nonzero(eigenmodes(body, 7)[0] == 0.0) == 6


def test_a_coupling_in_some_directions_leaves_the_others_free():
    """Turned axes too: the face stays plane, and is free to contract."""
    along = Coupling("right", "hub", (L, A / 2, A / 2), axes=[(1.0, 0.0, 0.0)])
    body = bar(along)
    tension = Load(boundaries=(BoundaryLoad("right", -1e6),))
    found = static_solution(body, tension)
    moved = found.displacement[body.group_nodes("right")]
    assert np.ptp(moved[:, 0]) < 0.1 * np.ptp(moved[:, 1])
    turned = ElasticBody(body.mesh.placed((0.1, -0.2, 0.3), (10.0, -20.0, 70.0), "y"), BAR,
                         fixed=body.fixed)
    assert turned.mesh.constraints[0] != along
    assert eigenfrequencies_hz(turned, 5) == pytest.approx(eigenfrequencies_hz(body, 5), rel=1e-8)


def test_a_tie_to_a_rigid_face_follows_its_reference_point():
    """Dependent nodes of the tie through the dependent nodes of the coupling: a chain."""
    body = ElasticBody(cut_block((2, 3, 2), (2, 2, 1), TIE, Coupling(
        "two.left", "hub", (0.1, 0.0, 0.0))), STEEL, fixed={"one.left": "xyz"})
    found = static_solution(body, Load(boundaries=(BoundaryLoad("two.top", 1e6),)))
    both = [face_motion(body, face, found.displacement, (0.1, 0.0, 0.0))
            for face in ("one.right", "two.left")]
    assert both[0][0] == pytest.approx(both[1][0], rel=1e-9, abs=1e-15)
    assert max(rest for _, rest in both) < 1e-10 * np.abs(found.displacement).max()


def test_a_coupling_of_one_node_at_its_point_changes_nothing():
    body, plain = (bar(*constraints, points=TIPS) for constraints in (
        [Coupling("d", "hub", (L, A, A))], []))
    assert body.expansion.shape == plain.expansion.shape
    assert eigenfrequencies_hz(body, 4) == pytest.approx(eigenfrequencies_hz(plain, 4), rel=1e-9)


def test_rotation_takes_no_couplings():
    mesh = rectangle(0.1, 0.1, 2, 2)
    body = ElasticBody(mesh, constraints=[Coupling("top", "hub", (0.0, 0.0))])
    with pytest.raises(InputError, match=r"^rotation is that of bodies without couplings"):
        modal_basis(body, 6, contact=(), rotation=Rotation(10.0))


# Equations --------------------------------------------------------------------------------


TIPS = {"a": (L, 0.0, 0.0), "b": (L, A, 0.0), "c": (L, 0.0, A), "d": (L, A, A)}


def same(first, second, axis=0, factor=1.0, name="same"):
    unit = np.eye(3)[axis]
    return LinearEquation((Term(first, unit), Term(second, -factor * unit)), name)


def equal_frequencies(constraints, others):
    return eigenfrequencies_hz(bar(*constraints, points=TIPS), 5) == pytest.approx(
        eigenfrequencies_hz(bar(*others, points=TIPS), 5), rel=1e-9)


def test_chains_circles_and_implied_equations():
    chain = [same("a", "b"), same("b", "c"), same("c", "d")]
    body = bar(*chain, points=TIPS)
    nodes = [3 * int(body.mesh.points[name][0]) for name in "abcd"]
    rows = body.expansion.tocsr()[nodes].toarray()
    assert (rows == rows[0]).all()
    assert body.expansion.shape[1] == 3 * (len(body.nodes) - len(body.group_nodes("left"))) - 3
    # In any order, as a star, in a circle, and with one that follows from the others.
    assert equal_frequencies(chain, chain[::-1])
    assert equal_frequencies(chain, [same("a", "b"), same("a", "c"), same("a", "d")])
    assert equal_frequencies(chain, [*chain, same("d", "a")])
    assert equal_frequencies(chain, [*chain, same("a", "d"), same("b", "d")])


def test_equations_that_only_zero_satisfies_are_supports():
    circle = [same("a", "b"), same("b", "a", factor=0.5)]
    mesh = bar(points=TIPS).mesh
    held = ElasticBody(mesh, BAR, fixed={"left": "xyz", "a": "x", "b": "x"})
    assert eigenfrequencies_hz(bar(*circle, points=TIPS), 4) == pytest.approx(
        eigenfrequencies_hz(held, 4), rel=1e-9)
    fixed = ElasticBody(mesh, BAR, fixed={"left": "xyz", "b": "x"}, constraints=[same("b", "a")])
    assert eigenfrequencies_hz(fixed, 4) == pytest.approx(eigenfrequencies_hz(held, 4), rel=1e-9)


def test_a_middle_of_an_edge_is_a_node_or_the_mean_of_two():
    mesh = block_mesh((2, 2, 1))
    edge = mesh.outline[0][:2]
    equation = LinearEquation((Term(tuple(edge), (0, 0, 1)), Term(int(edge[0]), (0, 0, -1))))
    for degree in (1, 2):
        body = ElasticBody(mesh, STEEL, degree=degree, constraints=[equation])
        G = body.expansion.tocsr()
        middle = body.edge_nodes(edge[None])[0]
        own = G[[3 * int(edge[0]) + 2]].toarray()
        other = (G[[3 * int(middle[1]) + 2]].toarray() if degree == 2 else
                 0.5 * sum(G[[3 * int(node) + 2]].toarray() for node in edge))
        assert own == pytest.approx(other, abs=1e-15)
    finer = Mesh(mesh.nodes, mesh.cells, constraints=[equation]).refined()
    first = finer.constraints[0].terms[0]
    assert finer.nodes[first.at] == pytest.approx(mesh.nodes[edge].mean(axis=0), abs=1e-15)
    far = LinearEquation((Term((0, int(mesh.cells.max())), (0, 0, 1)),))
    with pytest.raises(MeshError, match=r"^Mesh constraints must be edges of cells"):
        eigenfrequencies_hz(ElasticBody(mesh, constraints=[far]), 1)


def test_own_constraints_of_a_body_replace_those_of_its_mesh():
    mesh = bar(same("a", "b"), points=TIPS).mesh
    assert ElasticBody(mesh).expansion.shape[1] == ElasticBody(
        mesh, constraints=()).expansion.shape[1] - 1
    assert mesh.refined().constraints == mesh.constraints
    assert ("constraints", "1 equation") in mesh.summary()
    assert ("constraints", "1 tie") in ElasticBody(mesh, constraints=[TIE_LEFT]).summary()


TIE_LEFT = Tie("left", "right", name="ends")


# Bad input --------------------------------------------------------------------------------


@pytest.mark.parametrize(("constraints", "message"), [
    ([TIE_LEFT], r"^Tie 'ends': no node of 'left' lies within tolerance = 0\.0005 m of 'right', "
                 r"the closest is 0\.4 m away; give faces that touch, or a larger tolerance\.$"),
    ([Coupling("right", "hub", (L, 0.0, 0.0), name="p"), Coupling("a", "rim", (L, 0, 0), name="q")],
     r"^Coupling 'q' and Coupling 'p' determine the displacement in x of node \d+ of the mesh at "
     r"\(0\.4, .*\) in different ways; leave the node out of one of them\.$"),
    ([Coupling("left", "hub", (0.0, 0.0, 0.0), name="p")],
     r"^a support and Coupling 'p' determine the displacement in x of node 0 of the mesh at "
     r"\(0, .*\) in different ways"),
])
def test_constraints_that_cannot_be_met(constraints, message):
    body = bar(*constraints, points=TIPS)
    with pytest.raises((InputError, MeshError), match=message):
        eigenfrequencies_hz(body, 3)


def test_faces_tied_to_each_other_are_refused():
    body = ElasticBody(cut_block((2, 2, 1), (2, 2, 1), TIE, Tie("two.left", "one.right", name="t")))
    with pytest.raises(InputError, match=r"^Tie .* in a circle with others, determines the displ"):
        eigenfrequencies_hz(body, 3)


def test_nodes_out_of_reach_of_a_tie_are_named():
    mesh = cut_block((2, 4, 2), (2, 2, 1), TIE)
    nodes = mesh.nodes.copy()
    nodes[len(block_mesh((2, 4, 2)).nodes):, 1] *= 0.5
    body = ElasticBody(Mesh(nodes, mesh.cells, mesh.boundaries, constraints=[TIE]), degree=1)
    with pytest.warns(ModelWarning, match=r"^Tie 'a tie': 6 of 15 nodes of 'one\.right' lie "
                                          r"farther than tolerance = 0\.001768 m from 'two\.left' "
                                          r"and are left out, the first at \(0\.1, 0\.075, 0\)\.$"):
        assert eigenfrequencies_hz(body, 7)[6] > 100.0


@pytest.mark.parametrize(("constraints", "message"), [
    ([Tie("lift", "right")], r"^Tie 'a tie': the mesh has no boundary or points 'lift' "
                             r"\(did you mean 'left'\?\); it has: "),
    ([Tie("left", "a")], r"^Tie 'a tie': the mesh has no boundary 'a'; its boundaries are: "),
    ([Coupling("nowhere", "hub", (0, 0, 0), name="p")],
     r"^Coupling 'p': the mesh has no boundary or points 'nowhere'; it has: "),
    ([Coupling("right", "hub")], r"^The reference point 'hub' of a coupling must have one place, "
                                 r"but the couplings give it 0; give place in one of them\.$"),
    ([Coupling("right", "h", (0, 0, 0)), Coupling("left", "h", (1, 0, 0))], r"give it 2;"),
    ([Coupling("right", "hub", (0.0, 0.0))], r"place must have 3 coordinates"),
    ([Coupling("right", "hub", (0, 0, 0), axes=[(1, 0)])], r"axes must have 3 components each"),
    ([same("a", "hub")], r"^LinearEquation 'same': 'hub' is neither a point of the mesh with one "
                         r"node nor a reference point \(did you mean 'b'\?\); these are: "),
    ([LinearEquation((Term(-1, (1, 0, 0)),))], r"names the node -1 outside 0 \.\.\. \d+\.$"),
    ([LinearEquation((Term("a", (1, 0)),))], r"each term needs 3 coefficients of the displacement"),
    (["tie"], r"constraints must be LinearEquation, Tie or Coupling, not str"),
])
def test_constraints_name_what_the_mesh_has(constraints, message):
    with pytest.raises((InputError, MeshError), match=message):
        bar(*constraints, points=TIPS)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Tie("a", "b", -1.0), r"^Tie 'a tie': tolerance = -1\.0 must be"),
    (lambda: Coupling("a", "b", kind="rigid"), r"^Coupling 'a coupling': kind = 'rigid' must be"),
    (lambda: Coupling("a", "b", axes=[(1, 0, 0), (2, 0, 0)]), r"must be independent directions"),
    (lambda: LinearEquation(()), r"terms is empty; give at least one"),
    (lambda: LinearEquation((Term("a", (0, 0)),)), r"must be finite, and one of them not zero"),
])
def test_bad_constraints_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_pieces_that_no_constraint_joins_are_refused():
    with pytest.raises(MeshError, match=r"2 pieces that share no node, and no constraint joins"):
        ElasticBody(cut_block((1, 1, 1), (1, 1, 1), Coupling("one.left", "hub", (0, 0, 0))))
