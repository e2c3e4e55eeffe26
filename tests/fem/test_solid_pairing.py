"""Faces of solids paired with each other and with the ground: feet, gaps, normals, loads."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_body, quadratic_grid

from fecontact import ElasticBody
from fecontact.core.errors import InputError
from fecontact.fem import pair_both_faces, pair_faces
from fecontact.fem.faces.contact_patches import face_surface
from fecontact.fem.faces.frames import tangents_of
from fecontact.fem.faces.solid_pairing import closest_places


def below(counts=(4, 2, 1), size=(0.2, 0.1, 0.05), *, shift=(0.0, 0.0, 0.0), turn=0.0, **options):
    """A block whose top lies at z = 0, moved."""
    body = block_body(counts, size, **options)
    return ElasticBody(body.mesh.placed(shift=(shift[0], shift[1], shift[2] - size[2])).placed(
        rotation=turn), degree=body.degree, bricks=body.bricks)


def turned(body, angles):
    return ElasticBody(body.mesh.placed(rotation=angles), degree=body.degree, bricks=body.bricks)


def rigid(places, about, shift, turn):
    return (shift + np.cross(turn, places - about)).ravel()


@pytest.mark.parametrize("cells", ["hexahedra", "tetrahedra", "serendipity"])
@pytest.mark.parametrize("nodes", ["all", 8])
@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.0, 90.0, 0.0), (30.0, 20.0, 70.0)])
def test_common_motion_of_both_bodies_moves_no_contact_node(cells, nodes, angles):
    """Meshes that do not match, a gap of 1 mm, any direction of the face."""
    tetrahedra = cells == "tetrahedra"
    upper = turned(block_body((4, 2, 1), tetrahedra=tetrahedra, bricks=(
        cells if cells == "serendipity" else "full")), angles)
    lower = turned(below((6, 3, 2), (0.3, 0.2, 0.1), shift=(-0.05, -0.05, -1e-3),
                         tetrahedra=not tetrahedra, degree=1), angles)
    pairing = pair_faces({"a": upper, "b": lower}, "a.contact", "b.top", nodes=nodes,
                         nodes_on="face")
    normal, n = pairing.normals[0], 16 if nodes == "all" and tetrahedra else 8
    assert pairing.normals == pytest.approx(np.tile(normal, (n, 1)), abs=1e-12)
    assert face_surface(upper, "contact").area_vectors.sum(axis=0) == pytest.approx(-0.02 * normal)
    assert pairing.tangents == pytest.approx(tangents_of(pairing.normals))
    assert pairing.gaps == pytest.approx(np.full(n, 1e-3), rel=1e-9)
    assert pairing.tributary.sum() == pytest.approx(0.02, rel=1e-12)
    assert pairing.report.covered == pytest.approx(1.0)
    assert pairing.places - pairing.feet_places == pytest.approx(1e-3 * pairing.normals, abs=1e-12)
    shift, spin = np.array([1.0, 2.0, -1.0]), np.array([0.2, -0.3, 0.4])
    moved = pairing.nodes @ rigid(upper.nodes, 0.0, shift, spin) - pairing.feet @ rigid(
        lower.nodes, 0.0, shift, spin)
    expected = np.cross(spin, pairing.places - pairing.feet_places)
    assert moved.reshape(-1, 6)[:, :3] == pytest.approx(expected, abs=1e-12)
    assert moved.reshape(-1, 6)[:, 3:] == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("elements", [
    {"degree": 1}, {"degree": 2}, {"degree": 1, "tetrahedra": True},
    {"degree": 2, "tetrahedra": True}, {"bricks": "serendipity"}])
def test_uniform_pressure_is_even_on_both_sides_of_matching_meshes(elements):
    """The patch test: one node a facet; on both sides the consistent loads of the faces."""
    upper, lower = block_body((4, 2, 1), **elements), below(**elements)
    pairing = pair_faces({"a": upper, "b": lower}, "a.contact", "b.top", nodes_on="face")
    force = np.zeros((len(pairing.tributary), 6))
    force[:, 2] = pairing.tributary
    assert pairing.nodes.T @ force.ravel() == pytest.approx(
        face_surface(upper, "contact").pressure_forces(), abs=1e-16)
    assert -(pairing.feet.T @ force.ravel()) == pytest.approx(
        face_surface(lower, "top").pressure_forces(), abs=1e-15)
    assert pairing.report.unevenness < 1e-11
    assert pairing.report.largest_offset < 1e-12


def test_forces_and_moments_balance_between_meshes_that_do_not_match():
    upper = block_body((3, 3, 1), (0.1, 0.1, 0.05), tetrahedra=True)
    lower = below((5, 4, 1), (0.2, 0.2, 0.05), shift=(-0.05, -0.03, 0.0), degree=1)
    pairing = pair_faces({"a": upper, "b": lower}, "a.contact", "b.top", nodes=9, nodes_on="face")
    force = np.zeros((9, 6))
    force[:, :3] = np.random.default_rng(3).standard_normal((9, 3))
    here, there = ((rows.T @ force.ravel()).reshape(-1, 3) for rows in (pairing.nodes,
                                                                         pairing.feet))
    assert here.sum(axis=0) == pytest.approx(there.sum(axis=0), abs=1e-13)
    assert np.cross(upper.nodes, here).sum(axis=0) == pytest.approx(
        np.cross(lower.nodes, there).sum(axis=0), abs=1e-13)


def test_feet_on_a_sphere_are_where_its_radii_meet_it():
    """Second-order facets follow the sphere to the third order of their size."""
    def place(u, v):
        polar, angle = 0.3 + 0.5 * u, 1.2 * v
        return (np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar))
    errors = []
    for n in (4, 8):
        sphere = quadratic_grid(place, n, n)
        rng = np.random.default_rng(0)
        polar, angle = rng.uniform(0.35, 0.75, 200), rng.uniform(0.05, 1.15, 200)
        radial = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle),
                           np.cos(polar)], axis=1)
        found = closest_places(sphere, 1.05 * radial, -radial)
        assert found.valid.mean() > 0.99
        on = found.valid
        assert found.gaps[on] == pytest.approx(0.05, abs=2e-5)
        errors.append(np.abs(found.gaps[on] - 0.05).max())
        assert found.normals[on] == pytest.approx(radial[on], abs=4e-3 / n)
        assert found.places[on] == pytest.approx(radial[on], abs=1e-4)
        assert found.weights[on].sum(axis=1) == pytest.approx(np.ones(on.sum()))
    assert np.log2(errors[0] / errors[1]) > 2.5


def test_a_face_that_hangs_over_counts_with_the_part_that_has_a_partner():
    upper = block_body((8, 2, 1))
    lower = below((4, 2, 1), shift=(0.1, 0.0, 0.0))
    pairing = pair_faces({"a": upper, "b": lower}, "a.contact", "b.top", nodes=4, nodes_on="face")
    assert pairing.tributary == pytest.approx(np.full(4, 0.0025))
    assert (pairing.places[:, 0] > 0.1).all()
    assert pairing.report.covered == pytest.approx(0.5)
    assert len(pairing.report.left_out) == 8
    assert set(pairing.report.reasons) == {"is beyond the ends of b.top"}
    assert "8 facets" in str(pairing)
    # The edge of the other face cuts facets: to their points of quadrature.
    cut = below((4, 2, 1), shift=(0.06, 0.0, 0.0))
    partly = pair_faces({"a": upper, "b": cut}, "a.contact", "b.top", nodes=4, nodes_on="face")
    assert partly.tributary.sum() == pytest.approx(0.014, rel=0.05)


def test_the_finer_face_has_the_nodes_and_two_passes_share_the_area():
    upper, lower = block_body((2, 2, 1)), below((6, 4, 1))
    bodies = {"a": upper, "b": lower}
    pairing = pair_faces(bodies, "a.contact", "b.top", nodes=6)
    assert (pairing.swapped, pairing.body, pairing.other) == (True, "b", "a")
    assert pairing.normals == pytest.approx(np.tile([0.0, 0.0, -1.0], (6, 1)))
    both = pair_both_faces(bodies, "a.contact", "b.top", nodes=4)
    assert both.first.tributary.sum() == pytest.approx(0.01)
    assert both.second.tributary.sum() == pytest.approx(0.01)
    assert both.second.normals[0] == pytest.approx(-both.first.normals[0])


def test_the_ground_lies_below_solids():
    body = ElasticBody(block_body((4, 2, 1)).mesh.placed(shift=(0.0, 0.0, 2e-3)))
    pairing = pair_faces({"a": body}, "a.contact", "ground", nodes=8)
    assert pairing.gaps == pytest.approx(np.full(8, 2e-3))
    assert pairing.normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (8, 1)))
    assert (pairing.feet_places[:, 2] == 0.0).all()
    tilted = ElasticBody(body.mesh.placed(rotation=(0.0, -5.0, 0.0)))
    near = pair_faces({"a": tilted}, "a.contact", "ground", nodes=8, reach=0.01)
    assert 0 < len(near.tributary) < 8
    assert near.gaps.max() <= 0.01
    assert set(near.report.reasons) == {"is out of reach"}


def test_faces_that_cannot_touch_are_named():
    upper = block_body((2, 1, 1))
    far = below((2, 1, 1), shift=(0.0, 0.0, -5.0))
    deep = below((2, 1, 1), shift=(0.0, 0.0, 0.01))
    aside = below((2, 1, 1), shift=(3.0, 0.0, 0.0))
    flat = ElasticBody(rectangle(1.0, 0.2, 6, 2))
    for lower, face, other, options, message in (
        (far, "a.contact", "b.top", {}, r"the closest is 5 m away, beyond reach"),
        (aside, "a.contact", "b.top", {}, "they lie beyond its ends"),
        (far, "a.contact", "b.contact", {}, "their outward normals point the same way"),
        (deep, "a.contact", "b.top", {}, r"starts 0.01 m inside b.top at \("),
        (far, "a.contact", "a.contact", {}, "share facets"),
        (far, "a.top", "ground", {}, "does not face the ground"),
        (flat, "a.contact", "b.top", {}, "is a face of a solid and"),
        (flat, "b.bottom", "a.contact", {}, "is a face of a solid and"),
        (below((2, 1, 1)), "a.contact", "b.top", {"nodes": 99}, "pair_faces: nodes = 99 must be"),
    ):
        with pytest.raises(InputError, match=message):
            pair_faces({"a": upper, "b": lower}, face, other, nodes_on="face", **options)
