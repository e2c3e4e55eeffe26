"""Places along the faces of several bodies, and the two sides of an interface."""

from dataclasses import replace

import numpy as np
import pytest
from joined_bodies import Touch, joined, moved, stack
from synthetic import basis

from fecontact.reduction.assembly.contact_faces import (
    contact_directions,
    contact_faces,
    contact_sides,
    mode_names,
    node_name,
)


def test_a_single_body_has_one_face_along_x():
    body = basis(contact_nodes=4)
    (face,) = contact_faces(body)
    assert (face.title, face.label, face.axis) == ("", "contact position x", "x")
    np.testing.assert_array_equal(face.abscissa, body.contact_x)
    assert node_name(body, 2) == "contact node 2"
    assert mode_names(body)[3] == "mode 3"
    tangents, normals = contact_directions(body)
    np.testing.assert_array_equal(np.hstack([tangents, normals]), [[1.0, 0.0, 0.0, 1.0]] * 4)


def test_faces_name_their_interface_and_its_bodies():
    shoe, foot = contact_faces(stack())
    assert (shoe.title, foot.title) == ("shoe: block and beam", "foot: beam and ground")
    assert (shoe.nodes, foot.nodes) == (slice(0, 8), slice(8, 29))
    assert shoe.axis == foot.axis == "x"
    np.testing.assert_allclose(shoe.abscissa, np.linspace(0.06, 0.11, 8))
    assert node_name(stack(), 7) == "shoe: node 7"
    assert node_name(stack(), 8) == "foot: node 8"
    assert mode_names(stack())[4:6] == ["block: mode 4", "beam: mode 0"]
    linked = replace(stack(), parts=tuple(replace(part, modes=(0, 0)) for part in stack().parts))
    assert mode_names(linked)[4:6] == ["mode 4", "mode 5"]
    assert contact_faces(linked)[0].title == "shoe: block and beam"
    assert dict(linked.summary())["bodies"] == "block, beam"


def test_a_inclined_face_is_measured_along_itself():
    (face,) = contact_faces(stack(angle=0.7))
    assert (face.axis, face.label) == ("s", "position along the face s")
    np.testing.assert_allclose(face.abscissa, np.linspace(0.0, 0.05, 8), atol=1e-15)


@pytest.mark.parametrize("backwards", [False, True])
def test_arc_length_of_a_circle(backwards):
    """Against radius times angle, on a face of few nodes that turns by 100 degrees."""
    radius, count = 0.03, 6
    angle = np.radians(np.linspace(-140.0, -40.0, count))
    out = np.column_stack([np.cos(angle), np.sin(angle)])
    if backwards:
        out, angle = out[::-1], angle[::-1]
    body = basis(columns=10, rows=3)
    nodes = body.mode_shapes.nodes.copy()
    nodes[:count] = radius * out
    body = replace(body, mode_shapes=replace(body.mode_shapes, nodes=nodes))
    step = radius * np.radians(20.0)
    shape = np.full(count, step)
    # Its inside touches the ground of no other body: normals to the centre of the circle.
    inner = joined({"ring": body}, [Touch("bush", "ring", np.arange(count), -out, shape)])
    object.__setattr__(inner, "on_ground", np.zeros(count, dtype=bool))
    (face,) = contact_faces(inner)
    expected = radius * (angle - angle.min()) + 0.5 * step
    np.testing.assert_allclose(face.abscissa, expected, rtol=1e-12)
    # Segments begin half a segment before the first node, nodes of a mesh at the end.
    shape[[0, -1]] *= 0.5
    ends = joined({"ring": body}, [Touch("bush", "ring", np.arange(count), -out, shape)])
    object.__setattr__(ends, "on_ground", np.zeros(count, dtype=bool))
    np.testing.assert_allclose(contact_faces(ends)[0].abscissa, expected - 0.5 * step, atol=1e-16)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_both_sides_of_an_interface_move_with_their_bodies(angle):
    body = stack(angle)
    own, feet = contact_sides(body)
    places = body.mode_shapes.nodes.ravel()
    np.testing.assert_allclose((own @ places).reshape(-1, 2), body.positions[2:], atol=1e-15)
    np.testing.assert_allclose((feet @ places).reshape(-1, 2)[:8], body.positions[2:10],
                               atol=1e-15)
    assert angle or not (feet @ places)[16:].any()
    field, q = body.mode_shapes, np.random.default_rng(1).normal(size=body.modes)
    q[:5] = 0.0  # the block stands still
    motion = (field.shapes @ q).ravel()
    assert not (own @ motion)[:16].any()
    tangents, normals = contact_directions(body)
    relative = (own @ motion - feet @ motion).reshape(-1, 2)
    for row, direction in enumerate((tangents, normals)):
        np.testing.assert_allclose((relative * direction).sum(axis=1),
                                   body.contact_T[:, row] @ q, atol=1e-13)


def test_a_body_that_touches_itself_has_two_sides():
    """Two rectangles of one mesh, the upper on the lower one, counted as one body."""
    body = stack()
    alone = replace(body, parts=(replace(body.parts[0], name="ring", modes=(0, 10),
                                         nodes=(0, len(body.mode_shapes.nodes))),))
    assert contact_faces(alone)[0].title == "shoe: ring with itself"
    for one, other in zip(contact_sides(alone), contact_sides(body), strict=True):
        assert abs(one - other).max() == 0.0


def test_bodies_keep_their_own_stress():
    body = stack()
    field = body.mode_shapes
    q = np.zeros(10)
    q[4] = 1.0  # the block stretches
    stress = field.stress @ q
    block = slice(*np.cumsum(body.parts[0].nodes))
    assert (stress[block, 0] != 0.0).all()
    assert not np.delete(stress, np.arange(block.start, block.stop), axis=0).any()
    assert moved(basis(), (1.0, 0.0)).mode_shapes.nodes[:, 0].min() == 1.0
