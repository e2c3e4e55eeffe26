"""Whole faces welded to each other: the frequencies of the bodies meshed as one."""

import numpy as np
import pytest
from meshes_for_tests import rectangle

import fecontact as fc
from fecontact.fem import pair_both_faces, pair_faces
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import FaceWeld, assembled_basis, reduce_bodies

STEEL = fc.Material.named("steel")
LENGTH, HEIGHT = 0.10, 0.04


def block(y, height, columns, rows, **options):
    mesh = rectangle(LENGTH, height, columns, rows).placed((0.0, y))
    return fc.ElasticBody(mesh, STEEL, thickness=0.02, **options)


def halves(below, above, rows=2):
    return {"a": block(0.0, 0.5 * HEIGHT, below, rows),
            "b": block(0.5 * HEIGHT, 0.5 * HEIGHT, above, rows)}


def welded(bodies, modes, nodes="all", **options):
    """Frequencies of the elastic modes, and the basis."""
    weld = FaceWeld(pair_faces(bodies, "a.top", "b.bottom", nodes=nodes))
    basis = assembled_basis(reduce_bodies(bodies, links=[weld], modes=modes, **options), {},
                            [weld])
    assert basis.rigid_modes == 3
    assert (basis.angular_frequencies[:3] == 0.0).all()
    return basis.frequencies_hz[3:], basis


def whole(columns, rows, count=11):
    return fc.modal_basis(block(0.0, HEIGHT, columns, rows), count + 3, contact=()).frequencies_hz[
        3:]


@pytest.mark.parametrize(("reduction", "modes", "lowest", "all_of_them"), [
    ("residual", 20, 2e-4, 2e-3), ("residual", 60, 2e-6, 2e-5), ("craig-bampton", 57, 1e-4, 3e-4)])
def test_two_welded_blocks_vibrate_as_one(reduction, modes, lowest, all_of_them):
    """With matching meshes only the truncation of the modes is left: errors are positive."""
    found, _ = welded(halves(8, 8), modes, reduction=reduction)
    error = found[:11] / whole(8, 4) - 1.0
    assert error.min() > -1e-9
    assert error[:5].max() < lowest
    assert error.max() < all_of_them


def test_all_modes_give_the_frequencies_to_round_off():
    """Both halves with nearly all of their modes: nothing but the weld is left to be wrong."""
    bodies = halves(3, 3, 1)
    unknowns = 2 * len(bodies["a"].nodes)
    found, _ = welded(bodies, unknowns - 2)
    assert found[:6] == pytest.approx(whole(3, 2, 6), rel=1e-8)


def test_blocks_whose_meshes_do_not_match_converge():
    """Six elements on four, and twice and four times as many, against a fine mesh of the whole."""
    fine = whole(40, 16)[:5]
    errors = [np.abs(welded(halves(3 * k, 2 * k), 20)[0][:5] / fine - 1.0).max()
              for k in (2, 4, 8)]
    assert errors[0] < 0.03
    assert errors[1] < 0.15 * errors[0]
    assert errors[2] < 1e-3
    # At least as exact as the whole block with the coarse mesh.
    coarse = np.abs(whole(8, 4)[:5] / fine - 1.0).max()
    assert errors[1] < coarse


def test_segments_weld_in_the_mean():
    """Fewer constraints: softer than node by node, converging to the same."""
    fine = whole(40, 16)[:5]
    errors = [welded(halves(3 * k, 2 * k), 20, nodes=2 * k)[0][:5] / fine - 1.0 for k in (4, 8)]
    assert np.abs(errors[0]).max() < 2e-3
    assert np.abs(errors[1]).max() < 8e-4
    by_node, in_the_mean = (welded(halves(12, 8), 60, nodes=nodes)[0][:5] for nodes in ("all", 8))
    assert (in_the_mean < by_node * (1.0 + 1e-6)).all()
    assert in_the_mean[0] < 0.9999 * by_node[0]


def ring(inner, outer, columns, rows):
    """A quarter of a ring, straight-edged elements between nodes on circles."""
    mesh = rectangle(0.5 * np.pi, outer - inner, columns, rows)
    angle, radius = mesh.nodes[:, 0], outer - mesh.nodes[:, 1]
    nodes = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return fc.ElasticBody(fc.Mesh(nodes, mesh.cells, mesh.boundaries), STEEL, thickness=0.02)


def test_curved_faces_that_do_not_match_keep_the_rigid_modes():
    """Feet lie a little beside the nodes there, yet rotations strain nothing."""
    bodies = {"a": ring(0.08, 0.10, 14, 2), "b": ring(0.06, 0.08, 19, 2)}
    weld = FaceWeld(pair_faces(bodies, "a.top", "b.bottom"))
    assert weld.pairing.gaps.max() < 1e-4
    basis = assembled_basis(reduce_bodies(bodies, links=[weld], modes=60), {}, [weld])
    assert basis.rigid_modes == 3
    one = fc.modal_basis(ring(0.06, 0.10, 30, 6), 8, contact=())
    assert basis.frequencies_hz[3:8] == pytest.approx(one.frequencies_hz[3:], rel=2e-3)


def test_both_faces_move_together():
    """At a node, and in the momentum of the joined mass."""
    bodies = halves(8, 8)
    weld = FaceWeld(pair_faces(bodies, "a.top", "b.bottom"))
    place = {"points": {"p": (0.05, 0.02)}}
    bases = reduce_bodies(bodies, links=[weld], modes=12, each={"a": place, "b": place})
    basis = assembled_basis(bases, {}, [weld])
    a, b = (basis.T[basis.point_index(f"{name}.p"), :2] for name in "ab")
    assert a == pytest.approx(b, abs=1e-8 * np.abs(a).max())
    mass = 7850.0 * LENGTH * HEIGHT * 0.02
    assert (basis.inertia_rows[:, :3] ** 2).sum(axis=1) == pytest.approx(
        [mass, mass], rel=2e-2)
    assert (basis.inertia_rows**2).sum(axis=1) == pytest.approx([mass, mass], rel=1e-3)


def test_a_welded_block_rests_on_a_contact():
    """The load goes through the weld; static deflection as of the block meshed as one."""
    def system(bodies, links, top):
        face = pair_faces(bodies, "a.bottom", "ground")
        bases = reduce_bodies(bodies, [face], links, modes=12, tolerance=0.0,
                              each={top: {"C": "top"}})
        return fc.ContactSystem(bodies=bases, links=links, load=fc.Load(1e4), interfaces=[
            fc.Interface("floor", face, LinearContact(1e10), ConstantFriction(0.3))])

    bodies = halves(8, 8)
    two = system(bodies, [FaceWeld(pair_faces(bodies, "a.top", "b.bottom"))], "b")
    one = system({"a": block(0.0, HEIGHT, 8, 4)}, [], "a")
    deflections = []
    for made in (two, one):
        q = fc.equilibrium(made).modal_coordinates
        deflections.append(made.basis.T[1, 1] @ q)
        forces = made.at(np.append(q, 0.0 * q)).normal_force
        assert forces.sum() == pytest.approx(1e4, rel=1e-9)
    assert deflections[0] == pytest.approx(deflections[1], rel=1e-6)


def test_bad_welds_are_explained():
    bodies = halves(8, 8)
    pairing = pair_faces(bodies, "a.top", "b.bottom")
    weld = FaceWeld(pairing)
    with pytest.raises(fc.InputError, match=r"'a\.bottom' cannot be welded to the ground; fix"):
        FaceWeld(pair_faces(bodies, "a.bottom", "ground"))
    with pytest.raises(fc.InputError, match="FaceWeld: pairing"):
        FaceWeld(pair_both_faces(bodies, "a.top", "b.bottom"))
    apart = {"a": bodies["a"], "b": block(0.03, 0.02, 8, 2)}
    with pytest.raises(fc.InputError, match=r"'a\.top' is 0\.01 m apart from 'b\.bottom' at"):
        FaceWeld(pair_faces(apart, "a.top", "b.bottom"))
    bare = reduce_bodies(bodies, modes=12)
    with pytest.raises(fc.InputError, match=r"12 modes of body 'a' cannot follow the 34 displ"):
        assembled_basis(bare, {}, [weld])
    other = reduce_bodies({"a": block(0.0, 0.02, 5, 2), "b": bodies["b"]}, modes=12)
    with pytest.raises(fc.InputError, match="made for a mesh of body 'a' that is none"):
        assembled_basis(other, {}, [weld])
    with pytest.raises(fc.InputError, match="made for a mesh of body 'b' that is none"):
        assembled_basis({"a": reduce_bodies(bodies, links=[weld], modes=12)["a"]}, {}, [weld])
