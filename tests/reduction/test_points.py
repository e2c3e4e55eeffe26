"""Points of interest and contact nodes: duality, rigid motions, beam shapes, lengths."""

import numpy as np
import pytest
from meshes_for_tests import grid, rectangle, skewed

from fecontact import ElasticBody, InputError, Material, Mesh, MeshError, Patch, modal_basis
from fecontact.fem.contact_face import contact_nodes
from fecontact.fem.points import place_rows
from fecontact.reduction.eigenmodes import eigenmodes

MATERIAL = Material(2.1e11, 0.3, 7850.0)
POINTS = {"corner": (0.0, 0.0), "node": (0.5, 0.2)}


def plate(triangles=False, degree=2, warp=None, **options):
    mesh = rectangle(1.0, 0.4, 5, 4, triangles=triangles, warp=warp, points=POINTS, **options)
    return ElasticBody(mesh, MATERIAL, degree=degree)


def all_rows(body):
    """Rows of every kind of place on the plate, with names for messages."""
    inside = body.mesh.nodes[body.mesh.cells[3]].mean(axis=0) + np.array([0.013, 0.007])
    places = {
        "corner": "corner", "inner node": "node", "boundary": "top", "two sides": "right",
        "inner place": tuple(inside), "middle of an edge": tuple(body.nodes[len(body.mesh.nodes)])
        if body.degree == 2 else tuple(body.mesh.nodes[1]),
        "patch": Patch("corner", 0.23), "patch within an edge": Patch(tuple(
            body.mesh.nodes[body.mesh.boundaries["top"][2]].mean(axis=0)), 0.03),
    }
    return {name: place_rows(body, place, name) for name, place in places.items()}


def rigid(places, about, motion):
    """Displacements (N, 2) of places that move by [x, y, phi] about a place."""
    arm = places - about
    return motion[:2] + motion[2] * np.column_stack([-arm[:, 1], arm[:, 0]])


KINDS = pytest.mark.parametrize(("triangles", "degree", "warp"), [
    (False, 2, None), (True, 2, skewed), (False, 2, skewed), (False, 1, skewed),
    (True, 1, skewed)], ids=["Q2", "P2 skewed", "Q2 skewed", "Q1 skewed", "P1 skewed"])


@KINDS
def test_rigid_motions_are_reproduced(triangles, degree, warp):
    body = plate(triangles, degree, warp)
    motion = np.array([0.3, -1.1, 0.7])
    for name, rows in all_rows(body).items():
        u = rigid(body.nodes, rows.position, motion).ravel()
        assert rows.matrix @ u == pytest.approx(motion, abs=1e-11), name


@KINDS
def test_force_at_a_point_keeps_its_resultant_and_moment(triangles, degree, warp):
    body = plate(triangles, degree, warp)
    force = np.array([2.0, -3.0, 0.4])
    for name, rows in all_rows(body).items():
        spread = (rows.matrix.T @ force).reshape(-1, 2)
        arm = body.nodes - rows.position
        moment = (arm[:, 0] * spread[:, 1] - arm[:, 1] * spread[:, 0]).sum()
        assert [*spread.sum(axis=0), moment] == pytest.approx(force, abs=1e-10), name


@KINDS
def test_rotation_of_linear_fields(triangles, degree, warp):
    """(dv/dx - du/dy) / 2 at nodes and inside; a straight patch turns with its own fibre."""
    body = plate(triangles, degree, warp)
    a, b, c, d = 0.2, -0.7, 0.4, 0.9
    x, y = body.nodes.T
    u = np.column_stack([a * x + b * y, c * x + d * y]).ravel()
    for name, rows in all_rows(body).items():
        px, py = rows.position
        got = rows.matrix @ u
        assert got[:2] == pytest.approx([a * px + b * py, c * px + d * py], abs=1e-11), name
        if "patch" not in name and name not in ("boundary", "two sides"):
            assert got[2] == pytest.approx(0.5 * (c - b), abs=1e-10), name
    if warp is None:
        rows = place_rows(body, "top", "B")
        assert (rows.matrix @ u)[2] == pytest.approx(c, abs=1e-11)
        rows = place_rows(body, "right", "B")
        assert (rows.matrix @ u)[2] == pytest.approx(-b, abs=1e-11)


@pytest.mark.parametrize("triangles", [False, True])
def test_quadratic_fields_at_places_inside_and_on_patches(triangles):
    """Quadratic elements hold quadratic fields: the rows are those of the field itself."""
    body = plate(triangles)
    x, y = body.nodes.T
    u = np.column_stack([x**2 - 2.0 * x * y, 3.0 * y**2 + x * y]).ravel()
    px, py = 0.237, 0.119
    assert place_rows(body, (px, py), "B").matrix @ u == pytest.approx(
        [px**2 - 2 * px * py, 3 * py**2 + px * py, 0.5 * (py + 2.0 * px)], abs=1e-12)
    # At a node: the mean of the elements around it, all of which hold the field exactly.
    px, py = 0.4, 0.2
    assert place_rows(body, (px, py), "B").matrix @ u == pytest.approx(
        [px**2 - 2 * px * py, 3 * py**2 + px * py, 0.5 * (py + 2.0 * px)], abs=1e-12)
    # A piece 0.35 ... 0.65 of the top, y = 0.4: means of x^2 - 0.8 x and 0.48 + 0.4 x.
    rows = place_rows(body, Patch((0.5, 0.4), 0.15), "B")
    assert rows.position == pytest.approx([0.5, 0.4], abs=1e-15)
    mean_square = 0.25 + 0.3**2 / 12.0
    assert rows.matrix @ u == pytest.approx(
        [mean_square - 0.8 * 0.5, 0.48 + 0.4 * 0.5, 0.4], abs=1e-12)


def test_patch_round_a_corner():
    """0.1 of each side: a whole edge on the left, half an edge at the bottom."""
    body = plate()
    rows = place_rows(body, Patch("corner", 0.1), "B")
    assert rows.position == pytest.approx([0.025, 0.025], abs=1e-15)
    spread = (rows.matrix.T @ [1.0, 0.0, 0.0]).reshape(-1, 2)
    assert np.abs(spread[:, 1]).max() == 0.0
    # Integrals of the quadratic shape functions over 0 ... 1 and over 0 ... 1/2.
    for place, share in (((0.0, 0.0), 1 / 12 + 5 / 24), ((0.0, 0.05), 1 / 3), ((0.0, 0.1), 1 / 12),
                         ((0.1, 0.0), 1 / 3), ((0.2, 0.0), -1 / 24)):
        node = np.argmin(np.linalg.norm(body.nodes - place, axis=1))
        assert spread[node, 0] == pytest.approx(share, abs=1e-14), place
    assert np.count_nonzero(spread[:, 0]) == 5


def test_patch_moves_as_its_uniform_traction_works():
    """A force on a patch does the work of a uniform traction, a moment that of a rigid one."""
    body = plate()
    rng = np.random.default_rng(1)
    u = rng.standard_normal(2 * len(body.nodes))
    rows = place_rows(body, Patch((0.5, 0.4), 0.1), "B").matrix
    # The top's edges of length 0.2: the patch 0.4 ... 0.6 is exactly the third of them.
    edge = body.edge_nodes(body.mesh.boundaries["top"][2:3])[0]
    ux, uy = u.reshape(-1, 2)[edge].T
    simpson = np.array([1.0, 4.0, 1.0]) / 6.0
    first_moment = np.array([-1.0, 0.0, 1.0]) / 6.0 * 0.2 / 2.0
    assert rows @ u == pytest.approx(
        [simpson @ ux, simpson @ uy, (first_moment @ uy) / (0.2**2 / 12.0)], abs=1e-12)


def test_several_nodes_move_by_their_best_fitting_rigid_motion():
    mesh = rectangle(1.0, 0.4, 5, 4)
    body = ElasticBody(type(mesh)(mesh.nodes, mesh.cells, mesh.boundaries, {"set": [0, 5, 24]}))
    rows = place_rows(body, "set", "B")
    rng = np.random.default_rng(2)
    u = rng.standard_normal((len(body.nodes), 2))
    nodes = np.array([0, 5, 24])
    A = np.zeros((6, 3))
    A[0::2, 0] = A[1::2, 1] = 1.0
    arm = body.nodes[nodes] - body.nodes[nodes].mean(axis=0)
    A[0::2, 2], A[1::2, 2] = -arm[:, 1], arm[:, 0]
    fit = np.linalg.lstsq(A, u[nodes].ravel(), rcond=None)[0]
    assert rows.matrix @ u.ravel() == pytest.approx(fit, abs=1e-12)


# Beam shapes -------------------------------------------------------------------------------------

def free_free_shape(root, x):
    """Bending shape of a free-free beam of length one, mean square one, and its slope."""
    s = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
    z = root * x
    w = np.cosh(z) + np.cos(z) - s * (np.sinh(z) + np.sin(z))
    slope = root * (np.sinh(z) - np.sin(z) - s * (np.cosh(z) + np.cos(z)))
    return w, slope


def clamped_free_shape(root, x):
    """Bending shape of a beam clamped at x = 0, of length one, mean square one, and its slope."""
    s = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
    z = root * x
    w = np.cosh(z) - np.cos(z) - s * (np.sinh(z) - np.sin(z))
    slope = root * (np.sinh(z) + np.sin(z) - s * (np.cosh(z) - np.cos(z)))
    return w, slope


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize(("shape", "roots", "fixed"), [
    (free_free_shape, [4.7300407448627, 7.85320462409584], {}),
    (clamped_free_shape, [1.87510406871196, 4.69409113297417], {"left": "xy"}),
])
def test_rows_of_a_slender_beam_follow_its_bending_shapes(shape, roots, fixed, triangles):
    height, thickness = 0.01, 0.02
    material = Material(2.1e11, 0.0, 7850.0)
    body = ElasticBody(rectangle(1.0, height, 80, 2, triangles=triangles), material, thickness,
                       fixed=fixed)
    first = 0 if fixed else 3
    _, shapes = eigenmodes(body, first + 2)
    places = np.array([0.13, 0.305, 0.5, 0.7125, 0.88])
    scale = 1.0 / np.sqrt(7850.0 * thickness * height)
    for mode, root in enumerate(roots):
        w, slope = shape(root, places)
        rows = [place_rows(body, (x, height / 2), "B").matrix for x in places]
        got = np.array([row @ shapes[:, first + mode] for row in rows])
        got *= np.sign(got[0, 1] * w[0])
        # Shear and rotary inertia change the shape by a multiple of (root height)^2 / 12.
        bound = 0.45 * (root * height) ** 2 * scale
        assert got[:, 1] == pytest.approx(scale * w, abs=bound)
        assert got[:, 2] == pytest.approx(scale * slope, abs=root * bound)
        assert np.abs(got[:, 0]).max() < 0.01 * bound
        # On the upper edge u = -(height / 2) w'.
        above = np.array([place_rows(body, (x, height), "B").matrix @ shapes[:, first + mode]
                          for x in places])
        above *= np.sign(above[0, 1] * w[0])
        assert above[:, 0] == pytest.approx(-0.5 * height * scale * slope,
                                            abs=0.5 * height * root * bound)


# Contact nodes -----------------------------------------------------------------------------------

def face(n, **options):
    body = ElasticBody(rectangle(1.0, 0.2, 6, 2, **options), MATERIAL)
    return body, contact_nodes(body, "bottom", n)


@pytest.mark.parametrize("n", [1, 2, 3, 5, 7, 13])
def test_segments(n):
    body, nodes = face(n)
    assert nodes.tributary == pytest.approx(np.full(n, 1.0 / n), rel=1e-14)
    middles = (np.arange(n) + 0.5) / n
    assert nodes.positions == pytest.approx(np.column_stack([middles, np.zeros(n)]), abs=1e-14)
    # The mean of x^2 over each segment, and of a straight line its rotation.
    x = body.nodes[:, 0]
    u = np.column_stack([x**2, 0.3 * x]).ravel()
    got = (nodes.matrix @ u).reshape(n, 3)
    assert got[:, 0] == pytest.approx(middles**2 + 1.0 / (12.0 * n**2), abs=1e-13)
    assert got[:, 1] == pytest.approx(0.3 * middles, abs=1e-13)
    assert got[:, 2] == pytest.approx(np.full(n, 0.3), abs=1e-12)


@pytest.mark.parametrize("n", [1, 4, 9, "all"])
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("triangles", [False, True])
def test_face_in_translation_and_tilt(n, degree, triangles):
    """Node springs c l_j: c L in translation; c L^3 / 12 (1 - 1 / n^2) in tilt about the middle."""
    c = 3e6
    mesh = grid(np.array([0.0, 0.1, 0.25, 0.45, 0.5, 0.8, 0.9, 1.0]), [0.0, 0.1, 0.2],
                triangles=triangles)
    body = ElasticBody(mesh, MATERIAL, degree=degree)
    if degree == 1 and n == 9:
        n = 8
    nodes = contact_nodes(body, "bottom", n)
    springs = c * nodes.tributary
    translation = nodes.matrix @ np.tile([0.0, 1.0], len(body.nodes))
    assert springs @ translation.reshape(-1, 3)[:, 1] ** 2 == pytest.approx(c, rel=1e-13)
    turn = rigid(body.nodes, np.array([0.5, 0.0]), np.array([0.0, 0.0, 1.0])).ravel()
    tilt = springs @ (nodes.matrix @ turn).reshape(-1, 3)[:, 1] ** 2
    if n != "all":
        expected = 1.0 / 12.0 * (1.0 - 1.0 / n**2)
    elif degree == 2:
        expected = 1.0 / 12.0  # Simpson's rule is exact for squares.
    else:
        expected = 1.0 / 12.0 + (np.diff(np.unique(mesh.nodes[:, 0])) ** 3).sum() / 6.0
    assert tilt == pytest.approx(c * expected, rel=1e-12)


def test_all_nodes_have_simpson_weights():
    body, nodes = face("all")
    h = 1.0 / 6.0
    expected = np.full(13, 2.0 * h / 6.0)
    expected[1::2] = 4.0 * h / 6.0
    expected[[0, -1]] = h / 6.0
    assert nodes.tributary == pytest.approx(expected, rel=1e-13)
    assert nodes.positions[:, 0] == pytest.approx(np.linspace(0.0, 1.0, 13), abs=1e-15)
    u = np.random.default_rng(3).standard_normal((len(body.nodes), 2))
    order = [int(np.argmin(np.linalg.norm(body.nodes - place, axis=1)))
             for place in nodes.positions]
    assert (nodes.matrix @ u.ravel()).reshape(-1, 3)[:, :2] == pytest.approx(u[order], abs=0.0)


def test_all_nodes_of_linear_elements_have_trapezoidal_weights():
    body = ElasticBody(rectangle(1.0, 0.2, 4, 2), MATERIAL, degree=1)
    nodes = contact_nodes(body, "bottom", "all")
    assert nodes.tributary == pytest.approx([0.125, 0.25, 0.25, 0.25, 0.125], rel=1e-13)


@pytest.mark.parametrize("n", [1, 4, 5, "all"])
def test_forces_of_contact_nodes_keep_resultant_and_moment(n):
    body, nodes = face(n, warp=lambda places: places + 0.02 * np.sin(5.0 * places[:, ::-1]))
    count = len(nodes.tributary)
    rng = np.random.default_rng(4)
    force = np.column_stack([rng.standard_normal((count, 2)), np.zeros(count)])
    spread = (nodes.matrix.T @ force.ravel()).reshape(-1, 2)
    assert spread.sum(axis=0) == pytest.approx(force[:, :2].sum(axis=0), abs=1e-12)
    moment = body.nodes[:, 0] @ spread[:, 1] - body.nodes[:, 1] @ spread[:, 0]
    expected = nodes.positions[:, 0] @ force[:, 1] - nodes.positions[:, 1] @ force[:, 0]
    assert moment == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("n", [1, 3, 8, "all"])
def test_uniform_pressure_is_the_same_for_any_number_of_nodes(n):
    """Equal forces per length on all nodes are the consistent load of a uniform pressure."""
    _, nodes = face(n)
    force = np.zeros((len(nodes.tributary), 3))
    force[:, 1] = 7.0 * nodes.tributary
    spread = (nodes.matrix.T @ force.ravel()).reshape(-1, 2)
    _, reference = face("all")
    expected = np.zeros((len(reference.tributary), 3))
    expected[:, 1] = 7.0 * reference.tributary
    assert spread == pytest.approx((reference.matrix.T @ expected.ravel()).reshape(-1, 2),
                                   abs=1e-13)


@pytest.mark.parametrize("n", [4, 5, "all"])
def test_reversed_and_shuffled_edges_make_no_difference(n):
    _, plain = face(n)
    _, other = face(n, reverse=("bottom",))
    assert other.positions == pytest.approx(plain.positions, abs=1e-15)
    assert other.tributary == pytest.approx(plain.tributary, rel=1e-14)
    assert np.abs((other.matrix - plain.matrix).toarray()).max() < 1e-12


def renumbered(mesh, seed=0):
    """Copy of the mesh with its nodes in another order."""
    number = np.random.default_rng(seed).permutation(len(mesh.nodes))
    nodes = np.empty_like(mesh.nodes)
    nodes[number] = mesh.nodes
    return type(mesh)(nodes, number[mesh.cells],
                      {name: number[edges] for name, edges in mesh.boundaries.items()},
                      {name: number[which] for name, which in mesh.points.items()})


def feet(n, seed=None, **options):
    """A body on two feet, x = 0 ... 0.3 and 0.6 ... 1."""
    mesh = rectangle(1.0, 0.2, 10, 2, split=((0.0, 0.3), (0.6, 1.0)), **options)
    if seed is not None:
        mesh = renumbered(mesh, seed)
    body = ElasticBody(mesh, MATERIAL)
    return body, contact_nodes(body, "feet", n)


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
@pytest.mark.parametrize("reverse", [(), ("feet",)])
def test_two_feet(reverse, seed):
    _, nodes = feet(7, seed, reverse=reverse)
    assert nodes.positions[:, 0] == pytest.approx(
        [0.05, 0.15, 0.25, 0.65, 0.75, 0.85, 0.95], abs=1e-14)
    assert nodes.tributary == pytest.approx(np.full(7, 0.1), rel=1e-13)
    _, nodes = feet(2, seed, reverse=reverse)
    assert nodes.positions[:, 0] == pytest.approx([0.15, 0.8], abs=1e-14)
    assert nodes.tributary == pytest.approx([0.3, 0.4], rel=1e-13)
    _, nodes = feet("all", seed, reverse=reverse)
    assert nodes.positions[:, 0] == pytest.approx(
        [*np.linspace(0.0, 0.3, 7), *np.linspace(0.6, 1.0, 9)], abs=1e-15)
    assert nodes.tributary.sum() == pytest.approx(0.7, rel=1e-13)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6, 11, 16])
def test_nodes_on_two_feet_are_shared_out_by_length(n):
    _, nodes = feet(n)
    assert len(nodes.tributary) == n
    assert nodes.tributary.sum() == pytest.approx(0.7, rel=1e-13)
    left = nodes.positions[:, 0] < 0.45
    assert nodes.tributary[left].sum() == pytest.approx(0.3, rel=1e-13)
    assert abs(np.count_nonzero(left) - n * 0.3 / 0.7) <= 1.0
    assert (np.diff(nodes.positions[:, 0]) > 0.0).all()


def test_curved_face_is_measured_along_its_arc():
    def bent(places):
        angle = places[:, 0] - 0.5
        radius = 1.0 - places[:, 1]
        return np.column_stack([radius * np.sin(angle), -radius * np.cos(angle)])

    body = ElasticBody(rectangle(1.0, 0.2, 40, 2, warp=bent), MATERIAL)
    nodes = contact_nodes(body, "bottom", 8)
    assert nodes.tributary == pytest.approx(np.full(8, 1.0 / 8), rel=1e-4)
    middles = (np.arange(8) + 0.5) / 8.0 - 0.5
    assert nodes.positions[:, 0] == pytest.approx(np.sin(middles), abs=1e-3)


def test_basis_holds_rows_in_the_books_order():
    body = ElasticBody(rectangle(1.0, 0.2, 6, 2, points={"C": (1.0, 0.2), "tip": (0.0, 0.2)}),
                       MATERIAL)
    basis = modal_basis(body, 6, contact="bottom", contact_nodes=3, B=(0.3, 0.1),
                        points={"tip": "tip", "far": Patch((1.0, 0.1), 0.05)})
    assert basis.T.shape == (7, 3, 6)
    assert basis.T_matrix.shape == (15, 6)
    w, shapes = eigenmodes(body, 6)
    assert (basis.angular_frequencies == w).all()
    places = {"B": (0.3, 0.1), "C": "C", "tip": "tip", "far": Patch((1.0, 0.1), 0.05)}
    for name, place in places.items():
        rows = place_rows(body, place, name)
        assert basis.T[basis.point_index(name)] == pytest.approx(rows.matrix @ shapes, abs=1e-12)
        assert basis.positions[basis.point_index(name)] == pytest.approx(rows.position)
    nodes = contact_nodes(body, "bottom", 3)
    assert basis.contact_T.reshape(9, 6) == pytest.approx(nodes.matrix @ shapes, abs=1e-12)
    assert (basis.T_matrix[6:15] == basis.contact_T.reshape(9, 6)).all()
    assert (basis.T_matrix[:3] == basis.T[basis.point_index("B")]).all()
    assert (basis.T_matrix[3:6] == basis.T[basis.point_index("C")]).all()
    assert basis.extra == ("tip", "far")
    assert [basis.point_index(j) for j in range(3)] == [2, 3, 4]
    assert basis.contact_x == pytest.approx([1 / 6, 1 / 2, 5 / 6])
    # The stored field gives the same rows, and its transpose spreads a force with its moment.
    field = basis.mode_shapes
    assert (field.restriction @ field.shapes.reshape(-1, 6)).reshape(-1, 3, 6) == pytest.approx(
        basis.T, abs=1e-12)
    force = np.zeros((7, 3))
    force[0] = [1.0, -2.0, 0.3]
    spread = (field.restriction.T @ force.ravel()).reshape(-1, 2)
    arm = field.nodes - [0.3, 0.1]
    assert [*spread.sum(axis=0), arm[:, 0] @ spread[:, 1] - arm[:, 1] @ spread[:, 0]] == (
        pytest.approx([1.0, -2.0, 0.3], abs=1e-11))


def test_missing_excitation_and_load_points_do_nothing():
    basis = modal_basis(
        ElasticBody(rectangle(1.0, 0.2, 6, 2), MATERIAL), 5, contact="bottom", contact_nodes=2)
    assert (basis.T[:2] == 0.0).all()


def test_modal_stress_of_a_linear_field():
    from fecontact.fem.fields import stress_of

    a, b, c, d = 1e-3, -4e-4, 7e-4, 2e-3
    E, nu = 2.1e11, 0.3
    shear = E / (2.0 * (1.0 + nu))
    for plane in ("stress", "strain"):
        body = ElasticBody(rectangle(1.0, 0.4, 5, 4, warp=skewed), MATERIAL, plane=plane)
        x, y = body.nodes.T
        u = np.column_stack([a * x + b * y, c * x + d * y]).reshape(-1, 1)
        lateral = -nu / (1.0 - nu) * (a + d) if plane == "stress" else 0.0
        strain = np.array([a, d, lateral])
        stress = 2.0 * shear * strain + E * nu / ((1 + nu) * (1 - 2 * nu)) * strain.sum()
        got = stress_of(body, u)[:, :, 0]
        expected = [stress[0], stress[1], stress[2], shear * (b + c)]
        assert got == pytest.approx(np.tile(expected, (len(x), 1)), abs=1e-3)


# Errors ------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("place", "message"), [
    ((1.2, 0.1), r"B: \(1\.2, 0\.1\) lies outside"), ((0.5, -1e-3), "lies outside"),
    ((0.5, float("nan")), "pair of coordinates"), ((0.5, 0.1, 0.2), "pair of coordinates"),
    (Patch((0.5, 0.1), 0.05), r"B: no part of the outline lies within 0\.05"),
])
def test_places_off_the_body(place, message):
    body = ElasticBody(rectangle(1.0, 0.2, 6, 2), MATERIAL)
    with pytest.raises(InputError, match=message):
        modal_basis(body, 4, contact="bottom", B=place)


@pytest.mark.parametrize("triangles", [False, True])
def test_place_in_a_notch_of_the_bounding_box(triangles):
    """The skewed plate does not fill its bounding box."""
    body = plate(triangles, warp=skewed)
    low, high = body.nodes.min(axis=0), body.nodes.max(axis=0)
    with pytest.raises(InputError, match="lies outside"):
        place_rows(body, (low[0] + 0.01, high[1] - 0.01), "B")


@pytest.mark.parametrize(("options", "kind", "message"), [
    ({"B": "tipp"}, MeshError, r"Point B: .*'tipp'.*did you mean 'tip'.*'bottom'"),
    ({"C": Patch("tipp", 0.1)}, MeshError, r"Point C: .*no point 'tipp'.*did you mean 'tip'"),
    ({"contact": "botom"}, MeshError, r"'botom'.*did you mean 'bottom'"),
    ({"contact": "top"}, InputError, "'top' does not face the ground"),
    ({"contact": "left"}, InputError, "'left' does not face the ground"),
    ({"contact": "right"}, InputError, "'right' does not face the ground"),
    ({"contact_nodes": 14}, InputError, r"contact_nodes = 14 .* 1 to 13"),
    ({"contact_nodes": 0}, InputError, "contact_nodes = 0"),
    ({"contact_nodes": -1}, InputError, "contact_nodes = -1"),
    ({"contact_nodes": True}, InputError, "contact_nodes = True"),
    ({"contact_nodes": 2.0}, InputError, r"contact_nodes = 2\.0"),
    ({"contact_nodes": "some"}, InputError, "contact_nodes = 'some'"),
    ({"points": {"B": "tip"}}, InputError, "'B'"),
])
def test_what_a_basis_is_asked_for_is_checked(options, kind, message):
    body = ElasticBody(rectangle(1.0, 0.2, 6, 2, points={"tip": (1.0, 0.0)}), MATERIAL)
    with pytest.raises(kind, match=message):
        modal_basis(body, 4, **{"contact": "bottom", **options})


def test_fewer_contact_nodes_than_feet():
    with pytest.raises(InputError, match=r"contact_nodes = 1 .* 2 to 16"):
        feet(1)


def test_patch_radius_is_checked():
    with pytest.raises(InputError, match="radius = 0"):
        Patch("tip", 0.0)


def test_face_that_looks_up_in_part():
    """A boundary with a part that faces up is refused, however short the part is."""
    mesh = rectangle(1.0, 0.2, 10, 2)
    both = np.concatenate([mesh.boundaries["bottom"], mesh.boundaries["top"][:2]])
    body = ElasticBody(type(mesh)(mesh.nodes, mesh.cells, {"contact": both}), MATERIAL)
    with pytest.raises(InputError, match="does not face the ground"):
        modal_basis(body, 4, contact_nodes=6)


def test_a_group_held_both_as_boundary_and_as_points_is_the_boundary():
    """Abaqus files give node sets, whose points lack the middles of the edges."""
    mesh = rectangle(1.0, 0.1, 10, 2)
    left = np.unique(mesh.boundaries["left"])
    both = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, {"left": left})
    plain = ElasticBody(mesh, fixed={"left": "xy"})
    doubled = ElasticBody(both, fixed={"left": "xy"})
    np.testing.assert_array_equal(plain.fixed_dofs, doubled.fixed_dofs)
    for one, other in zip(*(place_rows(body, "left", "B").matrix.toarray()
                            for body in (plain, doubled)), strict=True):
        np.testing.assert_array_equal(one, other)
