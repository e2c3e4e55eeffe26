"""Contact systems in space: forces, derivatives, straight paths, turned frames."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import contact_field
from fecontact.laws import (
    BoucWenFriction,
    ConstantFriction,
    DahlFriction,
    ExponentialFriction,
    HarmonicSpeed,
    HeightMap,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    LuGreFriction,
    Sine,
)
from fecontact.reduction import point_masses

MASS, SIDES = 3.0, np.array([0.2, 0.3, 0.1])
INERTIA = MASS / 12.0 * ((SIDES**2).sum() - SIDES**2)
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])
FRICTION = {
    "exponential": ExponentialFriction(0.6, 0.4, smoothing_slope=300.0, decay=20.0),
    "dahl": DahlFriction(0.5, presliding_stiffness=2e4, exponent=1.0),
    "dahl 2.5": DahlFriction(0.5, presliding_stiffness=2e4, exponent=2.5),
    "lugre": LuGreFriction(0.8, 0.55, stribeck_velocity=0.01, bristle_stiffness=2e4,
                           bristle_damping=5.0, viscous_coefficient=0.4, damping_decay=10.0,
                           stribeck_exponent=2.0),
    "bouc-wen": BoucWenFriction(friction_coefficient=0.5, exponent=1.7, beta=0.7,
                                yield_displacement=5e-6),
    "jenkins": JenkinsFriction(stiffness=4e5, friction_coefficient=0.55),
    "iwan": IwanFriction(stiffness=4e5, elements=3, friction_coefficient=0.55),
}
GROUNDS = {
    "flat": fc.Ground(speed=0.1, speed_y=-0.2, rotation_speed=3.0, centre=(0.01, 0.02)),
    "waves": fc.Ground(speed=0.1, speed_y=0.07, profile=Sine(2e-4, 0.03), wave_direction=(1.0, 2.0),
                       friction_variation=Sine(0.2, 0.05)),
    "vertical": fc.Ground(speed=0.1, profile=Sine(2e-4, 0.03), normal="vertical",
                          wave_direction=(1.0, 2.0)),
    "map": fc.Ground(speed_y=0.1, height_map=HeightMap(
        2e-4 * np.random.default_rng(3).standard_normal((8, 6)), 0.01, 0.012)),
    "dither": fc.Ground(speed=0.1, motion_y=HarmonicSpeed(0.05, 900.0 / TURN)),
}


def rigid_rows(places):
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block(corners=CORNERS):
    return fc.basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), 2e4 * np.diag([1.0, 2.0, 1.0, 0.1, 0.1, 0.2]),
        {"contact": rigid_rows(corners), "B": rigid_rows([(0.02, 0.01, 0.05)])[0]}, dimension=3,
        contact_places=corners, tributary=np.full(len(corners), 0.015), translations=np.eye(3, 6))


def system(friction="exponential", ground="flat", **parts):
    return fc.ContactSystem(
        block(), normal=LinearContact(stiffness=4e6, damping=200.0), friction=FRICTION[friction],
        ground=GROUNDS[ground], drive=fc.Drive(stiffness_z=2e3, damping_y=3.0, amplitude_z=1e-4,
                                               frequency_hz=200.0 / TURN),
        load=fc.Load(gravity=(0.3, -0.2, -9.81)), **parts)


def pressed(system, seed=0):
    """A state in which all nodes touch and slip, with deflected friction."""
    rng = np.random.default_rng(seed)
    # Motion of B [x, y, z and turns], from which the coordinates of a rigid block follow.
    pose = [1e-5, -2e-5, -8e-4, *2e-4 * rng.standard_normal(3)]
    speed = [*0.05 * rng.standard_normal(2), -0.003, *0.05 * rng.standard_normal(3)]
    y = np.concatenate([np.linalg.solve(system.basis.T[0], motion) for motion in (pose, speed)])
    scale = system.memory_scales
    return np.concatenate([y, scale * rng.uniform(0.2, 0.9, len(scale))
                           * rng.choice([-1.0, 1.0], len(scale))])


def differences(function, y, steps):
    """Fourth-order differences of a function along each entry of y."""
    out = np.empty((len(function(y)), len(y)))
    for k, h in enumerate(steps):
        values = []
        for part in (-2.0, -1.0, 1.0, 2.0):
            moved = y.copy()
            moved[k] += part * h
            values.append(function(moved))
        out[:, k] = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * h)
    return out


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("friction", FRICTION)
def test_jacobian_is_the_derivative_of_the_rates(friction, ground):
    one = system(friction, ground)
    y, t = pressed(one), 0.003
    steps = np.concatenate([np.full(6, 1e-9), np.full(6, 1e-6), 1e-4 * one.memory_scales])
    expected = differences(lambda state: one.rhs(t, state), y, steps)
    found = one.jacobian(t, y)
    size = np.abs(expected).max(axis=1, keepdims=True) + 1e-9
    assert np.abs(found - expected) / size == pytest.approx(0.0, abs=2e-6)
    history = one.contact_history(np.array([t]), y[None])[0]
    assert (history[:, 0] > 0.0).all()
    assert np.abs(history[:, [1, 4, 6, 7]]).min() > 0.0


@pytest.mark.parametrize("friction", ["exponential", "dahl 2.5", "iwan"])
@pytest.mark.parametrize(("name", "ground"), [
    ("ground.speed_y", "flat"), ("ground.rotation_speed", "flat"), ("ground.speed", "waves"),
    ("ground.profile.amplitude", "waves"), ("ground.friction_variation.amplitude", "waves"),
    ("ground.motion_y.amplitude", "dither"), ("normal.stiffness", "waves"),
    ("drive.stiffness_z", "map"), ("friction", "map"), ("gap", "waves")])
def test_derivatives_to_parameters(friction, name, ground):
    one = system(friction, ground, gap=1e-5)
    if name == "friction":
        name = {"exponential": "friction.smoothing_slope", "dahl 2.5": "friction.exponent",
                "iwan": "friction.stiffness"}[friction]
    field = contact_field(one, [name])
    y, t = pressed(one), np.array([0.003])
    value = float(one.parameter(name))
    found = field.derivatives(t, y[None], np.array([value]), [0])[2][0, :, 0]
    step = 1e-3 * abs(value) if value else 1e-8

    def rates(by):
        return one.with_(**{name: float(by[0])}).rhs(0.003, y)

    expected = differences(rates, np.array([value]), [step])[:, 0]
    assert found == pytest.approx(expected, rel=2e-6, abs=1e-9 + 1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("friction", FRICTION)
def test_turned_frames_turn_the_forces(friction):
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    law = FRICTION[friction]
    rng = np.random.default_rng(5)

    def node(slip, z):
        """Friction (2,) and rates of z of a unit mass under 40 N that moves over the ground."""
        mass = point_masses({"a": 1.0}, components="xyz", contact="a")
        one = fc.ContactSystem(mass, normal=LinearContact(stiffness=1e6), friction=law)
        # The normal points along z, whatever the order of the modes.
        rows = mass.contact_T[0, :3]
        q, v = rows.T @ [0.0, 0.0, -40e-6], rows.T @ [*slip, 0.0]
        y = np.concatenate([q, v, z.ravel()])
        found = one.contact_history(np.zeros(1), y[None])[0, 0]
        return found[[1, 6]], one.rhs(0.0, y)[6:].reshape(-1, 2)

    for _ in range(5):
        slip = 0.02 * rng.standard_normal(2)
        z = law.state_scale[:, None] * rng.standard_normal((law.memory, 2)) if law.memory else (
            np.zeros((0, 2)))
        force, rate = node(slip, z)
        turned, turned_rate = node(turn @ slip, z @ turn.T)
        assert turned == pytest.approx(turn @ force, rel=1e-12)
        assert turned_rate == pytest.approx(rate @ turn.T, rel=1e-10, abs=1e-16)


@pytest.mark.parametrize("friction", FRICTION)
def test_straight_paths_are_those_of_the_plane(friction):
    law = FRICTION[friction]
    plane = fc.ContactSystem(point_masses({"a": 1.0}, components="xy", contact="a"),
                             normal=LinearContact(stiffness=1e6), friction=law,
                             ground=fc.Ground(speed=0.03))
    space = fc.ContactSystem(point_masses({"a": 1.0}, components="xyz", contact="a"),
                             normal=LinearContact(stiffness=1e6), friction=law,
                             ground=fc.Ground(speed=0.03))
    rows = plane.basis.contact_T[0, :2], space.basis.contact_T[0, :3]
    rng = np.random.default_rng(2)
    for _ in range(10):
        x, speed = 1e-5 * rng.standard_normal(), 0.05 * rng.standard_normal()
        z = law.state_scale * rng.standard_normal(law.memory) if law.memory else np.zeros(0)
        flat = np.concatenate([rows[0].T @ [x, -4e-5], rows[0].T @ [speed, 0.0], z])
        both = np.column_stack([z, 0.0 * z]).ravel()
        deep = np.concatenate([rows[1].T @ [x, 0.0, -4e-5], rows[1].T @ [speed, 0.0, 0.0], both])
        here, there = plane.rhs(0.1, flat), space.rhs(0.1, deep)
        assert rows[1] @ there[3:6] == pytest.approx(
            np.insert(rows[0] @ here[2:4], 1, 0.0), rel=1e-13, abs=1e-12)
        assert there[6::2] == pytest.approx(here[4:], rel=1e-12, abs=1e-18)
        assert not there[7::2].any()
        along = plane.jacobian(0.1, flat)[2:4], space.jacobian(0.1, deep)[3:6]
        # Tangential force by the velocity along x.
        assert rows[1][0] @ along[1][:, 3:6] @ rows[1][0] == pytest.approx(
            rows[0][0] @ along[0][:, 2:4] @ rows[0][0], rel=1e-12)


def test_ground_that_turns_slips_by_its_places():
    ground = fc.Ground(speed=0.2, speed_y=-0.1, rotation_speed=4.0, centre=(0.03, -0.02))
    one = fc.ContactSystem(block(), normal=LinearContact(stiffness=4e6),
                           friction=ConstantFriction(0.3), ground=ground)
    history = one.contact_history(np.zeros(1), np.zeros((1, 12)))[0]
    arms = CORNERS[:, :2] - [0.03, -0.02]
    assert history[:, 4] == pytest.approx(-(0.2 - 4.0 * arms[:, 1]), rel=1e-14)
    assert history[:, 7] == pytest.approx(-(-0.1 + 4.0 * arms[:, 0]), rel=1e-14)


def test_map_of_heights_passes_through_its_points():
    rng = np.random.default_rng(8)
    heights = rng.standard_normal((7, 5))
    ground = HeightMap(heights, 0.2, 0.3, origin_x=0.1, origin_y=-0.4)
    x, y = 0.1 + 0.2 * np.arange(7), -0.4 + 0.3 * np.arange(5)
    grid = np.meshgrid(x, y, indexing="ij")
    assert ground.shape(*grid)[..., 0] == pytest.approx(heights, abs=1e-13)
    assert ground.shape(grid[0] + 2.8, grid[1] - 1.5)[..., 0] == pytest.approx(heights, abs=1e-12)
    places = rng.uniform(-3.0, 3.0, (2, 20))
    found = ground.shape(*places)
    h = 1e-4
    for axis, (first, second) in enumerate((((1, 3), (1, 4)), ((2, 5), (2, 4)))):
        shift = h * np.eye(2)[axis][:, None]
        up, down = ground.shape(*(places + shift)), ground.shape(*(places - shift))
        assert (up[..., 0] - down[..., 0]) / (2 * h) == pytest.approx(
            found[..., first[0]], rel=1e-5, abs=1e-4)
        slopes = 1 if axis == 0 else 2
        assert (up[..., slopes] - down[..., slopes]) / (2 * h) == pytest.approx(
            found[..., first[1]], rel=1e-5, abs=1e-3)
        other = 2 if axis == 0 else 1
        assert (up[..., other] - down[..., other]) / (2 * h) == pytest.approx(
            found[..., second[1]], rel=1e-5, abs=1e-3)
    slope = np.hypot(found[..., 1], found[..., 2]).max()
    assert slope <= ground.steepest_slope
    low, high = ground.height_range
    assert low <= found[..., 0].min() < found[..., 0].max() <= high
