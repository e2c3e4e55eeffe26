"""Finite rotations of kinematic couplings and hinges: rigid motion, derivatives, beams, torsion."""

import numpy as np
import pytest
from meshes_for_tests import joined, rectangle
from scipy.spatial.transform import Rotation
from solid_blocks import block_mesh

from fecontact import BoundaryLoad, ElasticBody, Load, Material, Mesh, ModelWarning, PointLoad
from fecontact.analysis import deflection_path
from fecontact.fem import Coupling, Tie
from fecontact.fem.finite_rotations import turning_nodes
from fecontact.fem.finite_strain import FiniteStrainModel

E, L, H, B = 2e11, 1.0, 1.0 / 250.0, 0.01
STEEL = Material(E, 0.3, 7800.0)
EI = E * B * H**3 / 12.0


def coupled(mesh, *constraints, **options):
    """Body of a mesh with constraints."""
    return ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, mesh.points,
                            constraints=constraints), STEEL, **options)


def block(**options):
    return block_mesh((3, 2, 2), (0.1, 0.04, 0.03))


BODIES = {
    "plane": lambda: coupled(rectangle(0.1, 0.04, 3, 2), Coupling("right", "hub", (0.13, 0.01)),
                             fixed={"left": "xy"}),
    "plane hinge": lambda: ElasticBody(rectangle(0.1, 0.04, 3, 2), STEEL,
                                       fixed={"left": "hinge", "right": "x"}),
    "solid": lambda: coupled(block(), Coupling("right", "hub", (0.12, 0.01, 0.02)),
                             fixed={"left": "xyz"}, degree=1),
    "solid hinge": lambda: ElasticBody(block(), STEEL, degree=1, bricks="incompatible",
                                       fixed={"left": "hinge_y", "right": "x"}),
    "across": lambda: coupled(block(), Coupling("right", "hub", (0.12, 0.01, 0.02), axes=(
        (0.0, 1.0, 0.0), (0.0, 0.3, 1.0))), fixed={"left": "xyz"}, degree=1),
}


@pytest.mark.parametrize("name", BODIES)
def test_forces_and_tangents_are_derivatives(name):
    """Derivatives of energy and forces, by central differences at rotations of half a radian."""
    body = BODIES[name]()
    model, rng = FiniteStrainModel(body), np.random.default_rng(2)
    q, v = rng.normal(size=(2, model.expansion.shape[1]))
    group = turning_nodes(body)[0]
    assert not group.shared
    turn = np.linalg.norm(group.rows @ (body.expansion @ q[: body.expansion.shape[1]]))
    q *= 0.5 / turn
    h = 1e-6 * np.linalg.norm(q) / np.linalg.norm(v)
    state, ahead, behind = (model.state(one) for one in (q, q + h * v, q - h * v))
    assert state.force @ v == pytest.approx((ahead.energy - behind.energy) / (2.0 * h), rel=1e-6)
    slope = (ahead.force - behind.force) / (2.0 * h)
    assert state.tangent @ v == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    assert abs(state.tangent - state.tangent.T).max() < 1e-12 * abs(state.tangent).max()


def test_nodes_turn_by_the_rotation_vector():
    """Against the rotation matrices of SciPy, for a reference point away from the face."""
    body = BODIES["solid"]()
    group, model = turning_nodes(body)[0], FiniteStrainModel(body)
    q = np.random.default_rng(3).normal(size=model.expansion.shape[1])
    linear = body.expansion @ q
    u, phi = (body.motion_rows("hub") @ linear).reshape(2, 3)
    q *= 1.2 / np.linalg.norm(phi)
    u, phi = (body.motion_rows("hub") @ (body.expansion @ q)).reshape(2, 3)
    hub = np.array([0.12, 0.01, 0.02])
    places = hub + u + (body.nodes[group.nodes] - hub) @ Rotation.from_rotvec(phi).as_matrix().T
    assert body.nodes[group.nodes] + model.displacement(q)[group.nodes] == pytest.approx(
        places, abs=1e-12)


def test_a_reference_point_amid_its_nodes_has_their_motion():
    """Arms on both sides add up to nothing; displacement and rotation belong together still."""
    body = coupled(rectangle(L, 0.1, 4, 2), Coupling("right", "hub", (L, 0.05)))
    centre, turn, shift = np.array([L, 0.05]), 1e-3, np.array([2e-3, -3e-3])
    arm = body.nodes - centre
    rigid = shift + turn * np.column_stack([-arm[:, 1], arm[:, 0]])
    assert body.motion_rows("hub") @ rigid.ravel() == pytest.approx([*shift, turn], abs=1e-15)


def test_a_force_on_a_kinematic_coupling():
    """The end of a cantilever under P L^2 / EI = 2 (Mattiasson), where it turns by 45 degrees."""
    mesh = rectangle(L, H, 48, 1)
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=(
        Coupling("right", "hub", (L, 0.5 * H)),)), Material(E, 0.0, 7800.0), fixed={"left": "xy"},
        thickness=B)
    path = deflection_path(body, Load(forces=(PointLoad("hub", "y", signal=2.0 * EI / L**2),)))
    x, y = path.displacement("hub")[-1]
    assert [-x, y] == pytest.approx([0.16064, 0.49346], rel=4e-3)


def test_a_moment_rolls_a_cantilever_up():
    """M = pi EI / L bends a rod to half a circle: its end lies at (0, 2 L / pi)."""
    mesh = rectangle(L, H, 64, 1)
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=(
        Coupling("right", "hub", (L, 0.5 * H)),)), Material(E, 0.0, 7800.0), fixed={"left": "xy"},
        thickness=B)
    path = deflection_path(body, Load(forces=(PointLoad("hub", "phi", signal=np.pi * EI / L),)))
    x, y = path.displacement("hub")[-1]
    assert [L + x, y] == pytest.approx([0.0, 2.0 * L / np.pi], abs=0.01 * L)


def test_hinged_faces_are_hinges_at_their_centres():
    """A beam stretches between hinges of its end faces as between points of its axis."""
    found = []
    for faces in (True, False):
        mesh = rectangle(L, H, 24, 2, points={"first": (0.0, 0.5 * H), "last": (L, 0.5 * H),
                                              "middle": (0.5 * L, 0.5 * H)})
        body = ElasticBody(mesh, Material(E, 0.0, 7800.0), thickness=B, fixed={
            "left": "hinge", "right": "hinge"} if faces else {"first": "xy", "last": "xy"})
        path = deflection_path(body, Load(boundaries=(BoundaryLoad("top", pressure=-5e3),)))
        found.append(path.displacement("middle")[-1, 1])
    assert found[1] > 1.5 * H
    assert found[0] == pytest.approx(found[1], rel=2e-3)


def test_torsion_of_a_square_bar():
    """phi = T L / (0.1406 G a^4), up to 0.35 rad, the end free to come closer."""
    a, length = 0.02, 0.5
    body = coupled(block_mesh((16, 2, 2), (length, a, a)), Coupling(
        "right", "hub", (length, 0.5 * a, 0.5 * a)), fixed={"left": "xyz"})
    G, phi = E / 2.6, 0.35
    torque = 0.1406 * G * a**4 * phi / length
    path = deflection_path(body, Load(forces=(PointLoad("hub", "phi_x", signal=torque),)))
    linear = body.expansion @ path.unknowns.T
    assert (body.motion_rows("hub")[3] @ linear)[-1] == pytest.approx(phi, rel=0.05)


def test_nodes_that_are_held_twice_are_told():
    """A coupling whose face is tied to another body keeps its linear equations."""
    first, second = rectangle(0.5 * L, H, 8, 1), rectangle(0.5 * L, H, 8, 1)
    mesh = joined(first, second.placed((0.5 * L, 0.0)), (
        Tie("two.left", "one.right"), Coupling("one.right", "hub", (0.5 * L, 0.5 * H))))
    body = ElasticBody(mesh, Material(E, 0.0, 7800.0), fixed={"one.left": "xy"}, thickness=B)
    assert turning_nodes(body)[0].shared
    with pytest.warns(ModelWarning, match="nodes of a coupling turn as a rigid body, but other"):
        deflection_path(body, Load(forces=(PointLoad("hub", "y", signal=0.3 * EI / L**2),)))
