"""Several solids in one basis: relative rows, links, and the compliance of their interfaces."""

import numpy as np
import pytest
from solid_blocks import block_body

from fecontact import ElasticBody, modal_basis
from fecontact.core.errors import InputError
from fecontact.fem import pair_faces
from fecontact.reduction import (
    Bushing,
    FaceWeld,
    Hinge,
    PointPairing,
    Spring,
    Weld,
    assembled_basis,
    interface_compliance,
    point_masses,
    reduce_bodies,
)
from fecontact.reduction.assembly.contact_faces import contact_sides


def stacked(*, turn=(0.0, 0.0, 0.0), tetrahedra=False, counts=(3, 2, 1)):
    """Two blocks of 0.1 x 0.06 x 0.03, one upon the other."""
    upper = block_body(counts, (0.1, 0.06, 0.03))
    lower = block_body(counts, (0.1, 0.06, 0.03), tetrahedra=tetrahedra)
    return {"a": ElasticBody(upper.mesh.placed(rotation=turn)),
            "b": ElasticBody(lower.mesh.placed(shift=(0.0, 0.0, -0.03)).placed(rotation=turn))}


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (40.0, 10.0, 0.0)])
def test_rows_are_relative_motions_in_the_frames_of_the_nodes(turn):
    bodies = stacked(turn=turn, tetrahedra=True)
    pairing = pair_faces(bodies, "a.contact", "b.top", nodes=6, nodes_on="face")
    bases = reduce_bodies(bodies, [pairing], modes=8)
    whole = assembled_basis(bases, {"seam": pairing})
    assert (whole.dimension, whole.groups, whole.contact_nodes) == (3, (("seam", 6),), 6)
    q = np.random.default_rng(0).standard_normal(whole.modes)
    parts = {part.name: q[part.modes[0] : sum(part.modes)] for part in whole.parts}
    moved = {name: bases[name].mode_shapes.shapes @ parts[name] for name in bodies}
    relative = (pairing.nodes @ moved["a"].ravel() - pairing.feet @ moved["b"].ravel()).reshape(
        6, 6)
    d = whole.contact_T @ q
    frames = np.concatenate([pairing.tangents, pairing.normals[:, None]], axis=1)
    for part in (slice(0, 3), slice(3, 6)):
        assert d[:, part] == pytest.approx(np.einsum("nij,nj->ni", frames, relative[:, part]),
                                           rel=1e-10, abs=1e-10 * abs(d[:, part]).max())
    assert whole.mode_shapes.restriction @ (
        whole.mode_shapes.shapes @ q).ravel() == pytest.approx((whole.T @ q).ravel(), abs=1e-9)
    assert (whole.tangents == pairing.tangents).all()
    here, there = contact_sides(whole)
    assert (here - there) @ (whole.mode_shapes.shapes @ q).ravel() == pytest.approx(
        relative[:, :3].ravel(), abs=1e-10)
    assert whole.mode_shapes.cells.shape[1] == 8
    assert whole.contact_areas.sum() == pytest.approx(0.006)


def test_compliance_of_an_interface_is_that_of_both_bodies_together():
    """Residual vectors of nodes and feet resolve it; few modes alone do not."""
    bodies = stacked()
    pairing = pair_faces(bodies, "a.contact", "b.top", nodes=6, nodes_on="face")
    whole = assembled_basis(reduce_bodies(bodies, [pairing], modes=8, tolerance=0.0),
                            {"seam": pairing})
    found = interface_compliance(whole, bodies)["seam"]
    assert found.nodes.shape == (6, 3)
    assert found.worst > 1.0 - 1e-8
    single = modal_basis(bodies["a"], 8, contact_nodes=6, reduction="residual", tolerance=0.0)
    alone = interface_compliance(single, bodies["a"])["contact"]
    assert alone.node_compliance == pytest.approx(single.quality.compliance[2:8], rel=1e-9)
    # Both bodies are mirror images: each gives half.
    assert found.node_compliance == pytest.approx(2.0 * alone.node_compliance, rel=1e-6)
    few = interface_compliance(modal_basis(bodies["a"], 12, contact_nodes=6), bodies["a"])
    assert not few["contact"].enough
    assert "Complete the modes" in few["contact"].recommendation
    text = str(found)
    assert "uniform traction along t2" in text


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_welded_blocks_vibrate_as_one(tetrahedra):
    bodies = stacked(tetrahedra=tetrahedra, counts=(4, 2, 2))
    pairing = pair_faces(bodies, "a.contact", "b.top", nodes_on="face")
    weld = FaceWeld(pairing)
    bases = reduce_bodies(bodies, [], [weld], modes=14)
    joined = assembled_basis(bases, {}, [weld])
    one = modal_basis(block_body((4, 2, 4), (0.1, 0.06, 0.06)), 10, contact=())
    assert joined.rigid_modes == 6
    assert joined.frequencies_hz[6:10] == pytest.approx(one.frequencies_hz[6:10], rel=0.03)


def test_spring_between_masses_in_space_acts_along_its_direction():
    """sqrt(k (1 / m_a + 1 / m_b)) along (1, 2, 2) / 3; nothing across."""
    bases = {"a": point_masses({"p": 2.0}, components="xyz"),
             "b": point_masses({"p": 3.0}, components="xyz")}
    spring = Spring("a.p", "b.p", stiffness=600.0, direction=(1.0, 2.0, 2.0), preload=5.0)
    joined = assembled_basis(bases, {}, [spring])
    assert joined.angular_frequencies == pytest.approx(
        [0.0] * 5 + [np.sqrt(600.0 * (1 / 2.0 + 1 / 3.0))])
    pull = joined.T[joined.point_index("a.p"), :3, 5]
    assert pull / np.linalg.norm(pull) == pytest.approx(
        np.sign(pull[0]) * np.array([1.0, 2.0, 2.0]) / 3.0)
    with pytest.raises(InputError, match="must have 3 components"):
        assembled_basis(bases, {}, [Spring("a.p", "b.p", stiffness=1.0, direction=(1.0, 0.0))])


def test_points_of_blocks_are_joined_by_welds_hinges_and_bushings():
    bodies = {name: block_body((2, 1, 1)) for name in ("a", "b")}
    bases = {name: modal_basis(body, 6, contact=(), points={"p": "right"})
             for name, body in bodies.items()}
    for link, rigid in ((Weld("a.p", "b.p"), 6), (Hinge("a.p", "b.p"), 9)):
        assert assembled_basis(bases, {}, [link]).rigid_modes == rigid
    # Torsion about x on one stiffness: the block's moment of inertia about its own axis.
    mass = 7850.0 * 0.2 * 0.1 * 0.05
    inertia = mass * (0.1**2 + 0.05**2) / 12.0
    bushing = Bushing("a.p", stiffness=(0.0, 0.0, 0.0, 80.0, 0.0, 0.0))
    joined = assembled_basis({"a": bases["a"]}, {}, [bushing])
    assert joined.angular_frequencies[-1] == pytest.approx(np.sqrt(80.0 / inertia), rel=1e-9)
    with pytest.raises(InputError, match="has 3 stiffnesses, but its points have 6 motions"):
        assembled_basis(bases, {}, [Bushing("a.p", "b.p", stiffness=(1.0, 1.0, 1.0))])


def test_points_are_paired_with_the_ground_below_or_any_side():
    bases = {"a": point_masses({"p": 2.0}, components="xyz")}
    usual = assembled_basis(bases, {"foot": PointPairing("a", "p")})
    assert usual.normals.tolist() == [[0.0, 0.0, 1.0]]
    wall = assembled_basis(bases, {"foot": PointPairing("a", "p", normals=(2.0, 0.0, 0.0))})
    assert wall.contact_T[0, 2] == pytest.approx(bases["a"].T[bases["a"].point_index("p"), 0])
    with pytest.raises(InputError, match="normals must have 3 components"):
        assembled_basis(bases, {"foot": PointPairing("a", "p", normals=(1.0, 0.0))})
    flat = point_masses({"p": 2.0}, components="xy")
    with pytest.raises(InputError, match="all in the plane or all in space"):
        assembled_basis({"a": bases["a"], "b": flat}, {})
