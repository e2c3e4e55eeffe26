"""Initial gaps: crowned faces from the circle, not from chords."""

import numpy as np
import pytest

from fecontact import (
    Beam,
    ContactSystem,
    Crown,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    basis_from_matrices,
    equilibrium,
    generate,
    modal_basis,
)
from fecontact.fem import Cylinder, SphereSegment, pair_faces
from fecontact.laws import Frictionless, LinearContact, RoughSurface
from fecontact.system.gap import gap_values


def rigid_mass(count, length):
    """A mass that moves in y alone, with contact nodes in the middle of equal segments."""
    row = np.array([[0.0], [1.0], [0.0]])
    middles = ((np.arange(count) + 0.5) / count - 0.5) * length
    return basis_from_matrices([[1.0]], [[0.0]], {"C": row, "contact": [row] * count},
                               contact_x=middles, tributary=np.full(count, length / count))


def test_crown_is_the_circle_to_the_last_digit():
    crown = Crown(radius=0.5, centre=0.1)
    x = np.array([0.1, 0.1 + 1e-7, 0.13, 0.6])
    # 1 - cos(t) = 2 sin^2(t / 2), which cancels nothing.
    angle = np.arcsin((x - 0.1) / 0.5)
    np.testing.assert_allclose(crown(x), 2.0 * 0.5 * np.sin(angle / 2) ** 2, rtol=1e-14)


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_pressed_cylinder_on_independent_springs():
    """F = 2/3 sqrt(8 R) k u^(3/2) for stiffness k per length under a parabola; R large."""
    radius, length, stiffness, load = 2.0, 0.02, 1e9, 50.0
    system = ContactSystem(
        rigid_mass(4000, length),
        normal=RoughSurface(stiffness=stiffness * length, roughness_height=1e-12, damping=0.0),
        load=Load(load), gap=Crown(radius))
    q = equilibrium(system).modal_coordinates
    approach = -(system.basis.T[1, 1] @ q)
    expected = (1.5 * load / stiffness / np.sqrt(8.0 * radius)) ** (2.0 / 3.0)
    assert approach == pytest.approx(expected, rel=2e-4)
    pressed = system.contact_history(np.zeros(1), np.concatenate([q, [0.0]])[None])[0, :, 0] > 0.0
    half_width = np.abs(system.basis.contact_x[pressed]).max()
    assert half_width == pytest.approx(np.sqrt(2.0 * radius * expected), rel=5e-3)


def test_chords_would_miss_the_circle_by_the_height_of_the_roughness():
    edge, radius = 0.005, 0.5
    crown = Crown(radius)
    ends = crown(np.array([0.0, edge]))
    sagitta = ends.mean() - crown(np.array([edge / 2]))[0]
    assert sagitta == pytest.approx(edge**2 / (8.0 * radius), rel=1e-4)
    assert sagitta > 5.2e-6


def test_functions_sequences_and_numbers_are_taken():
    x = np.linspace(0.0, 1.0, 3)
    assert gap_values(1e-6, x) == 1e-6
    assert gap_values([0.0, 1e-6, 2e-6], x) == (0.0, 1e-6, 2e-6)
    assert gap_values(lambda place: 2.0 * place, x) == (0.0, 1.0, 2.0)
    system = ContactSystem(rigid_mass(3, 0.01), RoughSurface(1e6, 1e-5),
                           gap=lambda place: np.abs(place))
    np.testing.assert_allclose(system.arrays.gap, [0.01 / 3, 0.0, 0.01 / 3], atol=1e-18)


def test_bad_gaps_are_refused():
    x = np.linspace(0.0, 1.0, 3)
    with pytest.raises(InputError, match="gap has 2 values for 3 contact nodes"):
        gap_values([0.0, 1.0], x)
    with pytest.raises(InputError, match=r"gap = -1.* must be finite and zero or above"):
        gap_values(-1e-6, x)
    with pytest.raises(InputError, match=r"radius = 0\.5 must be at least 1, the distance"):
        gap_values(Crown(0.5), x)
    with pytest.raises(InputError, match="radius = 0"):
        Crown(0.0)


def test_crown_of_a_solid_is_a_part_of_a_sphere():
    """Any section through the lowest point is the arc of the plane body, at any direction."""
    crown, arc = Crown(0.5, (0.1, -0.05)), Crown(0.5)
    away = np.linspace(0.0, 0.3, 7)
    for angle in (0.0, 1.0, 4.0):
        x, y = 0.1 + away * np.cos(angle), -0.05 + away * np.sin(angle)
        assert crown(x, y) == pytest.approx(arc(away), rel=1e-12, abs=1e-17)
    places = np.stack([0.1 + away, np.full(7, -0.05), np.full(7, 3.0)], axis=1)
    assert gap_values(crown, places) == pytest.approx(arc(away), rel=1e-12, abs=1e-17)
    # A single number is x; functions of solids take x and y.
    assert gap_values(Crown(0.5, 0.1), places * [1.0, 0.0, 1.0]) == pytest.approx(arc(away))
    assert gap_values(lambda x, y: x - y, places) == pytest.approx(places[:, 0] + 0.05)
    assert gap_values(arc, places[:, :2]) == pytest.approx(arc(places[:, 0]))
    for gap, message in ((crown, "is that of a solid"), (Crown(0.2), "must be at least 0.4")):
        with pytest.raises(InputError, match=message):
            gap_values(gap, places[:, 0])
    with pytest.raises(InputError, match="the function of x and y fails"):
        gap_values(lambda x: x, places)
    with pytest.raises(InputError, match="7 contact nodes"):
        gap_values((1.0, 2.0), places)
    with pytest.raises(InputError, match="centre"):
        Crown(0.5, (0.1, 0.2, 0.3))


def pressed(basis, gap):
    system = ContactSystem(basis, normal=LinearContact(1e10), friction=Frictionless(),
                           load=Load(normal=1e4), gap=gap)
    return equilibrium(system).normal_force


@pytest.mark.parametrize("shape", [
    Cylinder(0.02, 0.01, contact_angle=40.0, element_size=0.004),
    SphereSegment(radius=0.05, base_radius=0.02, height=0.02, contact_radius=0.01)])
def test_a_curved_face_on_the_ground_touches_it_where_it_is_lowest(shape):
    body = ElasticBody(generate(shape), Material.named("steel"))
    basis = modal_basis(body, 4, contact_nodes="all", C="top" if "top" in body.mesh.boundaries
                        else "C")
    heights = basis.contact_places[:, 2]
    system = ContactSystem(basis, normal=LinearContact(1e10), friction=Frictionless())
    np.testing.assert_allclose(system.gap, heights - heights.min(), rtol=0.0, atol=1e-17)
    assert max(system.gap) > 4e-4
    force = pressed(basis, None)
    assert force.sum() == pytest.approx(1e4)
    assert np.count_nonzero(force) <= len(force) / 2
    assert force[np.argmin(heights)] > 0.0
    # As the same body with the ground as an interface, whose height counts from z = 0.
    paired = pair_faces({"body": body}, "body.contact", "ground", nodes="all")
    np.testing.assert_allclose(np.sort(paired.gaps - paired.gaps.min()), np.sort(system.gap),
                               atol=1e-9)
    # All nodes touch where that is asked for.
    assert np.count_nonzero(pressed(basis, 0.0)) == len(force)


def arc(radius, count, rows=3):
    """Block over an arc, whose lowest place lies at the height of 3 m."""
    turn = np.linspace(-0.6, 0.6, count + 1)
    x, bottom = radius * np.sin(turn), radius * (1.0 - np.cos(turn))
    part = np.linspace(0.0, 1.0, rows + 1)[:, None]
    y = 3.0 + bottom + part * (radius - bottom)
    first = np.arange(rows)[:, None] * (count + 1) + np.arange(count)
    cells = np.stack([first, first + 1, first + count + 2, first + count + 1], axis=-1)
    ends = np.arange(count)
    top = rows * (count + 1) + ends
    return Mesh(np.stack([np.broadcast_to(x, y.shape), y], axis=-1).reshape(-1, 2),
                cells.reshape(-1, 4), {"contact": np.stack([ends, ends + 1], axis=1),
                                       "top": np.stack([top + 1, top], axis=1)})


def test_plane_faces_have_the_gap_of_their_arc():
    radius = 0.02
    body = ElasticBody(arc(radius, 24), thickness=0.01)
    basis = modal_basis(body, 4, contact_nodes="all", C="top")
    system = ContactSystem(basis, normal=LinearContact(1e10), friction=Frictionless())
    x = np.asarray(basis.contact_places)[:, 0]
    circle = radius - np.sqrt(radius**2 - x**2)
    # Contact nodes lie on chords.
    np.testing.assert_allclose(system.gap, circle, atol=1.2 * (1.2 * radius / 24) ** 2 / radius)
    assert min(system.gap) == 0.0
    assert np.count_nonzero(pressed(basis, None)) < 10


def test_flat_faces_have_no_gap():
    flat = modal_basis(ElasticBody(generate(Beam(0.04, 0.02, element_size=0.005)),
                                   thickness=0.01), 4, contact_nodes="all")
    assert ContactSystem(flat, normal=LinearContact(1e10), friction=Frictionless()).gap == 0.0
