"""Pairing of faces: exact gaps of circles, patch tests, balance of forces and moments, refusals."""

import numpy as np
import pytest
import scipy.sparse as sp
from meshes_for_tests import grid, rectangle

from fecontact import ElasticBody, FecontactError, InputError, Mesh, MeshError
from fecontact.fem import finer_face, pair_both_faces, pair_faces
from fecontact.fem.body_forces import boundary_forces
from fecontact.fem.contact_face import contact_nodes
from fecontact.fem.face_curve import Face

ANGLE = 0.7
TURN = np.array([[np.cos(ANGLE), -np.sin(ANGLE)], [np.sin(ANGLE), np.cos(ANGLE)]])


def moved(mesh, x=0.0, y=0.0, turned=False):
    nodes = mesh.nodes + np.array([x, y])
    return Mesh(nodes @ TURN.T if turned else nodes, mesh.cells, mesh.boundaries, mesh.points)


def ring(inner, outer, count, centre=(0.0, 0.0), aspect=1.0, layers=3):
    """Mesh between two circles (or ellipses), with boundaries hole and rim."""
    angle = 2.0 * np.pi * np.arange(count) / count
    radii = np.linspace(inner, outer, layers + 1)
    nodes = np.stack([np.multiply.outer(radii, np.cos(angle)),
                      aspect * np.multiply.outer(radii, np.sin(angle))], axis=-1).reshape(-1, 2)
    number = np.arange(len(nodes)).reshape(layers + 1, count)
    ahead = np.roll(number, -1, axis=1)
    cells = np.stack([number[:-1], number[1:], ahead[1:], ahead[:-1]], axis=-1).reshape(-1, 4)
    return Mesh(nodes + np.asarray(centre), cells,
                {name: np.column_stack([number[k], ahead[k]]) for name, k in
                 (("hole", 0), ("rim", -1))})


def two_blocks(above=5, below=5, gap=0.0, turned=False, triangles=False, degree=2, length=1.0,
               shift=0.0):
    """A block over another one, both as long, with so many cells along the faces."""
    upper = moved(rectangle(1.0, 0.4, above, 2, triangles=triangles), shift, gap, turned)
    lower = moved(rectangle(length, 0.5, below, 3, triangles=triangles), 0.0, -0.5, turned)
    return {"pad": ElasticBody(upper, degree=degree), "disc": ElasticBody(lower, degree=degree)}


def loads(pairing, force):
    """Nodal forces (N, 2) of contact forces (n, 2) [normal, tangential], on body and other."""
    normal, tangential = np.broadcast_to(force, (len(pairing.gaps), 2)).T
    both = normal[:, None] * pairing.normals + tangential[:, None] * pairing.tangents
    three = np.column_stack([both, np.zeros(len(both))]).ravel()
    return [(matrix.T @ (sign * three)).reshape(-1, 2)
            for matrix, sign in ((pairing.nodes, 1.0), (pairing.feet, -1.0))]


def resultant(places, forces):
    moment = (places[:, 0] * forces[:, 1] - places[:, 1] * forces[:, 0]).sum()
    return np.array([*forces.sum(axis=0), moment])


KINDS = pytest.mark.parametrize(("triangles", "degree"), [
    (False, 2), (True, 2), (False, 1), (True, 1)], ids=["Q2", "P2", "Q1", "P1"])


@KINDS
@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_uniform_pressure_through_matching_meshes_is_the_consistent_load(triangles, degree, gap):
    bodies = two_blocks(gap=gap, turned=True, triangles=triangles, degree=degree)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top")
    on_pad, on_disc = loads(pairing, pairing.tributary[:, None] * [1.0, 0.0])
    for body, face, got in (("pad", "bottom", on_pad), ("disc", "top", on_disc)):
        wanted = boundary_forces(bodies[body], face)[:, 0].reshape(-1, 2)
        assert got == pytest.approx(wanted, abs=1e-15)
    assert pairing.gaps == pytest.approx(np.full(len(pairing.gaps), gap), abs=1e-15)
    assert pairing.normals == pytest.approx(np.tile(TURN @ [0.0, 1.0], (len(pairing.gaps), 1)),
                                            abs=1e-14)
    assert pairing.tangents == pytest.approx(np.tile(TURN @ [1.0, 0.0], (len(pairing.gaps), 1)),
                                             abs=1e-14)
    assert pairing.report.unevenness < 1e-13
    assert dict(pairing.summary())["unevenness"] == "0 %"
    assert pairing.report.covered == pytest.approx(1.0, abs=1e-12)
    assert (pairing.body, pairing.other) == ("pad", "disc")


@KINDS
@pytest.mark.parametrize("nodes", ["all", 4])
def test_forces_balance_and_moments_up_to_the_friction_times_the_gap(triangles, degree, nodes):
    bodies = two_blocks(7, 5, 0.03, True, triangles, degree, shift=0.013)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top", nodes=nodes)
    random = np.random.default_rng(1)
    normal, tangential = random.normal(size=(2, len(pairing.gaps)))
    for force, moment in ((np.column_stack([normal, 0.0 * normal]), 0.0),
                          (np.column_stack([normal, tangential]), -0.03 * tangential.sum())):
        one, two = (resultant(bodies[name].nodes, part) for name, part in zip(
            ("pad", "disc"), loads(pairing, force), strict=True))
        tolerance = 1e-13 if nodes == "all" else 1e-8
        assert one[:2] + two[:2] == pytest.approx([0.0, 0.0], abs=1e-13)
        assert one[2] + two[2] == pytest.approx(moment, abs=tolerance)


@KINDS
@pytest.mark.parametrize("nodes", ["all", 6])
def test_rigid_motions_and_linear_fields_are_those_of_the_feet(triangles, degree, nodes):
    bodies = two_blocks(5, 7, 0.03, True, triangles, degree)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top", nodes=nodes, nodes_on="face")
    field = np.array([[0.3, -1.2], [0.7, 0.4]])
    moved_feet = (pairing.feet @ (bodies["disc"].nodes @ field.T + [0.2, 0.1]).ravel())
    moved_feet = moved_feet.reshape(-1, 3)
    assert moved_feet[:, :2] == pytest.approx(pairing.feet_places @ field.T + [0.2, 0.1], abs=1e-8)
    assert moved_feet[:, 2] == pytest.approx(np.full(len(moved_feet), 0.95), abs=1e-11)
    weights = pairing.feet @ np.tile([1.0, 0.0], len(bodies["disc"].nodes))
    assert weights.reshape(-1, 3)[:, 0] == pytest.approx(np.ones(len(moved_feet)), abs=1e-14)
    arm = pairing.places - pairing.feet_places
    assert (arm * pairing.normals).sum(axis=1) == pytest.approx(pairing.gaps, abs=1e-13)
    assert (arm * pairing.tangents).sum(axis=1) == pytest.approx(0.0 * pairing.gaps, abs=1e-8)


@pytest.mark.parametrize(("below", "degree"), [(7, 1), (7, 2), (3, 2), (17, 2)])
def test_unevenness_is_the_error_of_the_nodal_loads(below, degree):
    bodies = two_blocks(5, below, degree=degree)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top", nodes_on="face")
    got = loads(pairing, pairing.tributary[:, None] * [1.0, 0.0])[1][:, 1]
    wanted = boundary_forces(bodies["disc"], "top")[:, 0].reshape(-1, 2)[:, 1]
    on_face = wanted != 0.0
    error = np.abs(got[on_face] / wanted[on_face] - 1.0).max()
    assert pairing.report.unevenness == pytest.approx(error, rel=1e-9)
    assert error > 0.01
    assert got.sum() == pytest.approx(-1.0, abs=1e-13)


@KINDS
def test_uniform_pressure_through_segments_is_the_consistent_load_of_any_meshes(triangles, degree):
    bodies = two_blocks(14, 9, 0.01, True, triangles, degree)
    assert pair_faces(bodies, "pad.bottom", "disc.top").report.unevenness > 0.1
    pairing = pair_faces(bodies, "pad.bottom", "disc.top", nodes=11)
    assert pairing.report.unevenness < 1e-7
    assert pairing.tributary == pytest.approx(np.full(11, 1.0 / 11.0), abs=1e-14)
    both = loads(pairing, pairing.tributary[:, None] * [1.0, 0.0])
    for body, face, got in zip(("pad", "disc"), ("bottom", "top"), both, strict=True):
        wanted = boundary_forces(bodies[body], face)[:, 0].reshape(-1, 2)
        assert got == pytest.approx(wanted, abs=1e-14)


@KINDS
@pytest.mark.parametrize(("above", "below", "nodes"), [(6, 6, "all"), (9, 5, 8), (5, 9, 7)])
def test_uniform_stress_passes_from_one_body_to_the_other(triangles, degree, above, below, nodes):
    """Blocks on rollers, pressed together through compliant nodes: u_y = - p y / E - p / k."""
    pressure, stiffness = 3.0e6, 5.0e12
    bodies = two_blocks(above, below, triangles=triangles, degree=degree)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top", nodes=nodes)
    parts = {pairing.body: pairing.nodes, pairing.other: -pairing.feet}
    rows = np.zeros((len(pairing.gaps), 3 * len(pairing.gaps)))
    j = np.arange(len(pairing.gaps))
    rows[j, 3 * j], rows[j, 3 * j + 1] = pairing.normals.T
    W = rows @ sp.hstack([parts["pad"], parts["disc"]]).toarray()
    K = (sp.block_diag([bodies["pad"].stiffness, bodies["disc"].stiffness]).toarray()
         + W.T @ (stiffness * pairing.tributary[:, None] * W))
    load = pressure * np.concatenate([boundary_forces(bodies["pad"], "top")[:, 0],
                                      np.zeros(2 * len(bodies["disc"].nodes))])
    places = np.concatenate([bodies["pad"].nodes, bodies["disc"].nodes])
    fixed = np.column_stack([places[:, 0] < 1e-9, places[:, 1] < -0.5 + 1e-9]).ravel()
    u = np.zeros(len(load))
    u[~fixed] = np.linalg.solve(K[np.ix_(~fixed, ~fixed)], load[~fixed])
    E, nu = bodies["pad"].material.youngs_modulus, bodies["pad"].material.poisson_ratio
    x, y = places.T
    pad = np.arange(len(places)) < len(bodies["pad"].nodes)
    exact = np.column_stack([nu * pressure * x / E,
                             -pressure * (y + 0.5) / E - pad * pressure / stiffness])
    assert u.reshape(-1, 2) == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("nodes", ["all", 31])
def test_gap_of_a_cylinder_on_a_block(nodes):
    """The nodes of the mesh and the middles of its edges lie on the circle, and so do segments."""
    radius, aside = 0.05, 0.003
    bodies = {"cylinder": ElasticBody(ring(0.01, radius, 40, (aside, radius))),
              "block": ElasticBody(moved(rectangle(0.3, 0.1, 21, 3), -0.15, -0.1))}
    pairing = pair_faces(bodies, "cylinder.rim", "block.top", nodes=nodes, nodes_on="face")
    x = pairing.places[:, 0] - aside
    exact = radius - np.sqrt(radius**2 - x**2)
    near = np.abs(x) < 0.02
    assert near.sum() > 5
    if nodes == "all":
        # A mesh with straight sides would be off by h^2 / (8 R) = 1.5e-4 m.
        assert pairing.gaps[near] == pytest.approx(exact[near], abs=2e-9)
        assert pairing.gaps.min() == pytest.approx(0.0, abs=2e-5)
    else:
        # The mean over a segment of length h is higher by h^2 / (24 R).
        rise = pairing.tributary[0] ** 2 / (24.0 * radius)
        assert (pairing.gaps - exact)[near] == pytest.approx(np.full(near.sum(), rise), rel=0.5)
    assert pairing.normals == pytest.approx(np.tile([0.0, 1.0], (len(x), 1)), abs=1e-15)
    away = 0.5 * np.pi - np.arcsin(0.1)  # beyond, the cylinder does not look at the block
    assert np.abs(np.arctan2(x, radius - pairing.gaps)).max() <= away
    assert pairing.report.covered == pytest.approx(away / np.pi, rel=2e-3)


@pytest.mark.parametrize("side", ["left", "right", "bottom", "top"])
def test_segments_go_on_where_the_numbering_of_a_closed_face_ends(side):
    """A cylinder beside each side of a block: one connected part has a partner."""
    centre = {"left": (-1.1, 0.5), "right": (2.1, 0.5), "bottom": (0.5, -1.1),
              "top": (0.5, 2.1)}[side]
    bodies = {"cylinder": ElasticBody(ring(0.3, 1.0, 64, centre)),
              "block": ElasticBody(moved(rectangle(1.0, 1.0, 4, 4)))}
    pairing = pair_faces(bodies, "cylinder.rim", f"block.{side}", nodes=9, nodes_on="face")
    angle = np.unwrap(np.arctan2(*(pairing.places - centre).T[::-1]))
    # The block's side of length 1 is seen under 60 degrees, from the surface of the cylinder.
    assert np.diff(angle) == pytest.approx(np.full(8, np.pi / 27.0), rel=2e-3)
    assert pairing.tributary.sum() == pytest.approx(np.pi / 3.0, rel=1e-3)
    assert pairing.gaps.min() == pytest.approx(0.1, abs=1e-3)


def pin_in_hole(count, aspect=1.0):
    """Errors of gaps and normals of a pin that lies aside in a larger hole."""
    offset = np.array([0.003, -0.009])
    bodies = {"pin": ElasticBody(ring(0.3, 1.0, 37, offset, layers=2)),
              "plate": ElasticBody(ring(1.02, 2.0, count, aspect=aspect, layers=2))}
    pairing = pair_faces(bodies, "pin.rim", "plate.hole", nodes_on="face")
    assert np.linalg.norm(pairing.places - offset, axis=1) == pytest.approx(
        np.ones(len(pairing.gaps)), abs=1e-8)
    distance = np.linalg.norm(pairing.places, axis=1)
    return (np.abs(pairing.gaps - (1.02 - distance)).max(),
            np.abs(pairing.normals + pairing.places / distance[:, None]).max(), pairing)


def test_gap_of_a_pin_in_a_hole_converges_with_the_sixth_power_of_the_edges():
    gaps, normals = np.array([pin_in_hole(count)[:2] for count in (20, 40, 80)]).T
    assert gaps[0] < 1e-7
    assert np.log2(gaps[:-1] / gaps[1:]) == pytest.approx([6.0, 6.0], abs=0.35)
    assert np.log2(normals[:-1] / normals[1:]) == pytest.approx([5.0, 5.0], abs=0.35)


def test_closed_faces_of_a_pin_balance():
    *_, pairing = pin_in_hole(33)
    assert pairing.report.nodes == 74
    assert not len(pairing.report.left_out)
    force = np.random.default_rng(2).normal(size=(74, 1)) * [1.0, 0.0]
    one, two = loads(pairing, force)
    assert one.sum(axis=0) + two.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-13)
    # Edges are straight where forces act, so that feet lie aside by a small part of the sagitta.
    assert 0.0 < pairing.report.largest_offset < 2e-4
    assert pairing.tributary.sum() == pytest.approx(2 * 37 * np.sin(np.pi / 37), abs=1e-12)


def test_faces_of_any_smooth_shape_converge_faster_than_their_chords():
    """Points of an ellipse, between its nodes: the third power of the edges, not the second."""
    errors = []
    for count in (24, 48, 96):
        face = Face(ElasticBody(ring(0.5, 1.0, count, aspect=0.6)), "rim", "body.rim")
        s = np.tile(np.linspace(0.0, 1.0, 9), count)
        x, y = face.at(np.repeat(np.arange(count), 9), s).T
        errors.append(np.abs(np.hypot(x, y / 0.6) - 1.0).max())
    rates = np.log2(np.array(errors)[:-1] / errors[1:])
    assert errors[0] < 1e-3
    assert (rates > 2.8).all()


def test_partners_are_the_closest_places_of_the_other_face():
    """Two wavy faces: no place of a fine polygon along the other face is closer than the foot."""
    def waves(amplitude, number):
        def bend(nodes):
            x, y = nodes.T
            return np.column_stack([x, y + amplitude * np.sin(number * x) * (1.0 - np.abs(y))])
        return bend
    upper = grid(np.linspace(0.0, 2.0, 41), np.linspace(0.0, 1.0, 5), warp=waves(0.06, 9.0))
    lower = grid(np.linspace(-0.5, 2.5, 34), np.linspace(-1.0, 0.0, 5), warp=waves(0.1, 4.0))
    bodies = {"upper": ElasticBody(moved(upper, 0.0, 0.2)), "lower": ElasticBody(lower)}
    pairing = pair_faces(bodies, "upper.bottom", "lower.top")
    assert pairing.body == "upper"
    other = Face(bodies["lower"], "top", "lower.top")
    s = np.tile(np.linspace(0.0, 1.0, 201), 33)
    line = other.at(np.repeat(np.arange(33), 201), s)
    distance = np.linalg.norm(pairing.places[:, None] - line, axis=2).min(axis=1)
    assert pairing.gaps == pytest.approx(distance, abs=1e-6)
    assert (pairing.gaps <= distance + 1e-15).all()
    assert np.ptp(pairing.gaps) > 0.1
    assert not len(pairing.report.left_out)


def test_flat_faces_and_corners_stay_what_they_are():
    """A chamfer of 20 degrees and the straight parts beside an arc are not rounded."""
    xs = np.linspace(0.0, 1.0, 21)
    arc = np.where(xs < 0.5, 0.0, 0.5 - np.sqrt(0.25 - (np.clip(xs, 0.5, 1.0) - 0.5) ** 2 / 4.0))
    for bottom in (np.where(xs < 0.5, 0.0, (xs - 0.5) * np.tan(np.radians(20.0))), arc):
        def bend(nodes, bottom=bottom):
            x, y = nodes.T
            return np.column_stack([x, y + (1.0 - y) * np.interp(x, xs, bottom)])
        body = ElasticBody(grid(xs, np.linspace(0.0, 1.0, 4), warp=bend))
        face = Face(body, "bottom", "body.bottom")
        edges = np.repeat(np.flatnonzero(body.nodes[face.nodes[:, -1], 0] <= 0.5 + 1e-9), 5)
        s = np.tile(np.linspace(0.0, 1.0, 5), len(edges) // 5)
        assert face.at(edges, s) == pytest.approx(face.straight(edges, s), abs=1e-15)
        assert face.at(edges, s)[:, 1] == pytest.approx(np.zeros(len(s)), abs=1e-15)
    square = Face(ElasticBody(rectangle(1.0, 1.0, 1, 1)), "top", "body.top")
    assert square.outward(np.array([0]), np.array([0.3])) == pytest.approx(np.array([[0.0, 1.0]]))


def test_a_corner_is_closest_to_what_lies_between_its_normals():
    """The upper right corner of a block below a cylinder: normals from the corner to the nodes."""
    mesh = rectangle(0.2, 0.2, 2, 2)
    both = np.concatenate([mesh.boundaries["top"], mesh.boundaries["right"]])
    bodies = {"pin": ElasticBody(ring(0.2, 0.5, 48, (0.6, 0.6))),
              "block": ElasticBody(Mesh(mesh.nodes, mesh.cells, {"faces": both}))}
    pairing = pair_faces(bodies, "pin.rim", "block.faces", nodes_on="face")
    between = (pairing.places > 0.2 + 1e-9).all(axis=1)
    assert between.sum() == 5
    arm = pairing.places[between] - [0.2, 0.2]
    distance = np.linalg.norm(arm, axis=1)
    assert pairing.gaps[between] == pytest.approx(distance, abs=1e-14)
    assert pairing.normals[between] == pytest.approx(arm / distance[:, None], abs=1e-13)
    assert pairing.gaps.min() == pytest.approx(0.4 * np.sqrt(2.0) - 0.5, abs=1e-9)


@pytest.mark.parametrize("degree", [1, 2])
def test_nodes_beyond_the_other_face_are_left_out_and_told(degree):
    bodies = two_blocks(10, 6, degree=degree, shift=0.23)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top")
    report = pairing.report
    assert (report.left_out[:, 0] > 1.0).all()
    assert len(report.left_out) + report.nodes == 10 * degree + 1
    assert set(report.reasons) == {"is beyond the ends of disc.top"}
    assert report.covered == pytest.approx(0.77, abs=1e-6)
    # The length that has a partner is carried, by the nodes that have one.
    assert pairing.tributary.sum() == pytest.approx(0.77, abs=1e-6)
    assert (pairing.tributary > 0.0).all()
    assert "beyond the ends of disc.top" in dict(report.summary())["without partner"]
    in_segments = pair_faces(bodies, "pad.bottom", "disc.top", nodes=7)
    assert in_segments.tributary == pytest.approx(np.full(7, 0.11), abs=1e-6)
    assert in_segments.places[-1, 0] == pytest.approx(1.0 - 0.055, abs=1e-6)


@pytest.mark.parametrize("nodes", ["all", 6])
def test_faces_in_several_parts(nodes):
    """Two feet on one face, with the nodes on the feet or between them."""
    pad = ElasticBody(rectangle(1.0, 0.4, 10, 2, split=((0.0, 0.2), (0.6, 1.0))))
    for cells, carrier in ((7, "pad"), (23, "disc")):
        bodies = {"pad": pad, "disc": two_blocks(below=cells)["disc"]}
        pairing = pair_faces(bodies, "pad.feet", "disc.top", nodes=nodes)
        assert pairing.body == carrier
        x = pairing.places[:, 0]
        assert not ((x > 0.2 + 1e-9) & (x < 0.6 - 1e-9)).any()
        assert pairing.tributary.sum() == pytest.approx(0.6, abs=1e-6)
        assert pairing.tributary[x < 0.4].sum() == pytest.approx(0.2, abs=1e-6)
        if nodes != "all":
            assert pairing.tributary == pytest.approx(np.full(6, 0.1), abs=1e-6)
            assert pairing.report.unevenness < 1e-6
        if carrier == "disc":
            alone = pairing.report.left_out[:, 0]
            assert ((alone > 0.2) & (alone < 0.6)).all()


def test_reach_limits_the_distance_of_partners():
    wedge = grid(np.linspace(0.0, 1.0, 11), np.linspace(0.0, 1.0, 4),
                 warp=lambda nodes: nodes + np.outer(0.3 * nodes[:, 0], [0.0, 1.0]))
    bodies = {"wedge": ElasticBody(wedge), "disc": two_blocks()["disc"]}
    pairing = pair_faces(bodies, "wedge.bottom", "disc.top", reach=0.1)
    assert pairing.gaps.max() <= 0.1
    assert pairing.report.covered == pytest.approx(1.0 / 3.0, abs=1e-6)
    assert all("out of reach" in reason for reason in pairing.report.reasons)
    assert pair_faces(bodies, "wedge.bottom", "disc.top").report.covered == pytest.approx(1.0)
    far = two_blocks(gap=3.0)
    with pytest.raises(InputError, match=r"closest is 3 m away, beyond reach = 1 m"):
        pair_faces(far, "pad.bottom", "disc.top")
    assert pair_faces(far, "pad.bottom", "disc.top", reach=4.0).gaps == pytest.approx(
        np.full(11, 3.0))


def test_small_overlaps_are_closed_and_deep_ones_refused():
    bodies = two_blocks(gap=-0.001)
    pairing = pair_faces(bodies, "pad.bottom", "disc.top")
    assert (pairing.gaps == 0.0).all()
    assert pairing.report.closed_overlap == pytest.approx(0.001, abs=1e-12)
    with pytest.raises(InputError, match=r"'pad.bottom' starts 0.003 m inside disc.top at \(.*\) "
                                         r"m, deeper than overlap = 0.01 edges, 0.002 m; move"):
        pair_faces(two_blocks(gap=-0.003), "pad.bottom", "disc.top")
    deep = pair_faces(two_blocks(gap=-0.003), "pad.bottom", "disc.top", overlap=0.02)
    assert deep.report.closed_overlap == pytest.approx(0.003, abs=1e-12)
    with pytest.raises(InputError, match=r"starts 0.0002 m inside"):
        pair_faces(two_blocks(gap=-0.0002), "pad.bottom", "disc.top", overlap=0.0)


def test_nodes_stand_on_the_finer_face():
    bodies = two_blocks(5, 8)
    assert finer_face(bodies, "pad.bottom", "disc.top") == "disc.top"
    assert pair_faces(bodies, "pad.bottom", "disc.top").body == "disc"
    kept = pair_faces(bodies, "pad.bottom", "disc.top", nodes_on="face")
    assert (kept.body, kept.other, len(kept.gaps)) == ("pad", "disc", 11)
    assert finer_face(two_blocks(5, 5), "disc.top", "pad.bottom") == "disc.top"
    swapped = pair_faces(bodies, "pad.bottom", "disc.top")
    assert swapped.normals == pytest.approx(-np.tile([0.0, 1.0], (17, 1)), abs=1e-15)
    assert swapped.tangents == pytest.approx(-np.tile([1.0, 0.0], (17, 1)), abs=1e-15)


def test_two_passes_halve_the_lengths_and_even_the_loads():
    bodies = two_blocks(5, 7)
    one, two = pair_both_faces(bodies, "pad.bottom", "disc.top").passes
    assert (one.body, two.body) == ("pad", "disc")
    assert one.tributary.sum() == pytest.approx(0.5, abs=1e-14)
    assert two.tributary.sum() == pytest.approx(0.5, abs=1e-14)
    wanted = boundary_forces(bodies["disc"], "top")[:, 0].reshape(-1, 2)[:, 1]
    on_disc = (loads(one, one.tributary[:, None] * [1.0, 0.0])[1]
               + loads(two, two.tributary[:, None] * [1.0, 0.0])[0])[:, 1]
    face = wanted != 0.0
    error = np.abs(on_disc[face] / wanted[face] - 1.0).max()
    assert error == pytest.approx(0.5 * pair_faces(
        bodies, "pad.bottom", "disc.top", nodes_on="face").report.unevenness, rel=1e-2)


@pytest.mark.parametrize("width", [0.0, 0.01])
def test_a_body_touches_itself_in_a_slit(width):
    """A plate cut from its right side to the middle, the two sides of the cut a width apart."""
    xs, ys = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9)
    mesh = grid(xs, ys)
    number = np.arange(81).reshape(9, 9)
    line = number[4, 4:]  # the tip stays one node
    copy = {int(node): 81 + k for k, node in enumerate(line[1:])}
    cells = mesh.cells.copy()
    above = mesh.nodes[cells].mean(axis=1)[:, 1] > 0.5
    cells[above] = np.vectorize(lambda node: copy.get(node, node))(cells[above])
    nodes = np.concatenate([mesh.nodes, mesh.nodes[line[1:]] + [0.0, width]])
    upper = np.array([line[0], *copy.values()])
    body = ElasticBody(Mesh(nodes, cells, {
        "lower": np.column_stack([line[:-1], line[1:]]),
        "upper": np.column_stack([upper[:-1], upper[1:]])}))
    pairing = pair_faces({"plate": body}, "plate.upper", "plate.lower")
    assert (pairing.body, pairing.other) == ("plate", "plate")
    assert pairing.report.left_out == pytest.approx(np.array([[0.5, 0.5]]))
    assert pairing.report.reasons == ("is on both faces",)
    assert pairing.tributary.sum() == pytest.approx(np.hypot(0.125, width) + 0.375, abs=1e-12)
    assert pairing.gaps.max() == pytest.approx(width, abs=1e-12)
    one, two = loads(pairing, [1.0, 0.3])
    assert one.sum(axis=0) + two.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-13)
    with pytest.raises(InputError, match=r"'plate.upper' and 'plate.upper' share edges"):
        pair_faces({"plate": body}, "plate.upper", "plate.upper")


@pytest.mark.parametrize("nodes", ["all", 4])
def test_nodes_on_the_ground_are_those_of_a_single_body(nodes):
    body = ElasticBody(moved(rectangle(1.0, 0.4, 5, 2), y=0.02))
    pairing = pair_faces({"pad": body}, "pad.bottom", "ground", nodes=nodes)
    single = contact_nodes(body, "bottom", nodes)
    assert pairing.other is None
    assert pairing.feet is None
    assert abs(pairing.nodes - single.matrix).max() < 1e-15
    assert pairing.places == pytest.approx(single.positions, abs=1e-14)
    assert pairing.tributary == pytest.approx(single.tributary, abs=1e-15)
    assert pairing.gaps == pytest.approx(np.full(len(pairing.gaps), 0.02), abs=1e-15)
    assert (pairing.normals == [0.0, 1.0]).all()
    with pytest.raises(InputError, match=r"starts 0.02 m inside the ground, y = 0, at"):
        pair_faces({"pad": ElasticBody(moved(rectangle(1, 1, 4, 4), y=-0.02))}, "pad.bottom",
                   "ground")


@pytest.mark.parametrize("columns", [6, 11])
def test_gap_of_a_crowned_face_above_the_ground(columns):
    radius = 2.0

    def bend(nodes):
        x, y = nodes.T
        return np.column_stack([x, y + (1.0 - y) * (radius - np.sqrt(radius**2 - x**2))])
    xs = np.linspace(-0.5, 0.5, columns + 1)
    body = ElasticBody(grid(xs, np.linspace(0.0, 1.0, 4), warp=bend))
    pairing = pair_faces({"pad": body}, "pad.bottom", "ground")
    x = pairing.places[:, 0]
    assert pairing.gaps == pytest.approx(radius - np.sqrt(radius**2 - x**2), abs=2e-8)
    assert len(x) == 2 * columns + 1


def test_faces_on_the_wrong_sides_are_refused():
    bodies = two_blocks()
    with pytest.raises(InputError, match="outward normals point the same way"):
        pair_faces(bodies, "pad.top", "disc.top")
    with pytest.raises(InputError, match=r"starts 0.9 m inside disc.bottom at"):
        pair_faces(bodies, "pad.top", "disc.bottom")
    with pytest.raises(InputError, match=r"the closest lies 3.9 m behind it, so that the faces"):
        pair_faces(two_blocks(gap=3.0), "pad.top", "disc.bottom")
    with pytest.raises(InputError, match="they lie beyond its ends"):
        pair_faces(two_blocks(shift=1.5), "pad.bottom", "disc.top")


@pytest.mark.parametrize(("call", "error", "told"), [
    (("pad", "disc.top"), InputError, "face = 'pad' must be 'BODY.BOUNDARY'"),
    (("pad.bottom", "disk.top"), InputError, r"no body \(did you mean 'disc'\?\)"),
    (("ground", "disc.top"), InputError, "face = 'ground' must be 'BODY.BOUNDARY'"),
    (("pad.bottem", "disc.top"), MeshError, "did you mean 'bottom'"),
    (("pad.top", "ground"), InputError, "does not face the ground"),
    ((3, "disc.top"), InputError, "face must be a text"),
    (("pad.bottom", None), InputError, "other must be a text"),
])
def test_names_of_faces_are_checked(call, error, told):
    with pytest.raises(error, match=told):
        pair_faces(two_blocks(), *call)


@pytest.mark.parametrize("options", [
    {"nodes": 0}, {"nodes": 99}, {"nodes": True}, {"nodes": None}, {"nodes": "some"},
    {"nodes": 2.0}, {"nodes_on": "coarser"}, {"nodes_on": None}, {"reach": 0.0},
    {"reach": "far"}, {"overlap": -0.1}, {"overlap": None}, {"overlap": float("nan")}])
@pytest.mark.parametrize("other", ["disc.top", "ground"])
def test_options_out_of_range_are_refused_by_name(options, other):
    with pytest.raises(FecontactError, match=f"^pair_faces: {next(iter(options))} = ") as error:
        pair_faces(two_blocks(), "pad.bottom", other, **options)
    assert str(error.value).endswith(".")
    with pytest.raises(FecontactError):
        pair_faces(None, "pad.bottom", other)
    with pytest.raises(FecontactError):
        pair_faces({"pad": 3}, "pad.bottom", other)
