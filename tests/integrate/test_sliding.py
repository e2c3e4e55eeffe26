"""Interfaces whose other sides slide: against the same bodies on moving ground, one by one."""

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    ContactSystem,
    Ground,
    InputError,
    Interface,
    Load,
    LoadPath,
    PointLoad,
    basis_from_matrices,
    load_history,
    simulate,
)
from fecontact.bifurcation import contact_field
from fecontact.integrate import EventDriven, SetValued, TimeStepping
from fecontact.laws import (
    Constant,
    ExponentialFriction,
    HarmonicSpeed,
    LinearContact,
    LuGreFriction,
    Sine,
    SlidingRotation,
    SlidingTranslation,
)
from fecontact.reduction import PointPairing

NORMAL = LinearContact(2e6, 150.0)
FRICTION = ExponentialFriction(0.5, 0.3, 4.0, smoothing_slope=1e5)
LUGRE = LuGreFriction(0.5, 0.3, 0.05, 2.0, 1e5)
WAVES = Sine(1e-5, 3e-3)
MASS, K_X, K_Y, DAMPING = 0.8, 4e4, 9e4, 0.03


def oscillator(angle=0.0):
    """A mass on springs along t, at ``angle`` from x, and n."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    K = turn @ np.diag([K_X, K_Y]) @ turn.T
    rows = np.zeros((3, 2))
    rows[:2] = np.eye(2)
    return basis_from_matrices(MASS * np.eye(2), K, {"p": rows}, damping=DAMPING)


def wall():
    """A body whose side does not move."""
    return basis_from_matrices([[1.0]], [[1e4]], {"side": np.zeros((3, 1))})


def pressing(name, angle):
    """Loads of 80 N against the normal."""
    return (PointLoad(f"{name}.p", "x", signal=Constant(80.0 * np.sin(angle))),
            PointLoad(f"{name}.p", "y", signal=Constant(-80.0 * np.cos(angle))))


def together(sliding, ground, friction=FRICTION, angle=0.7):
    """One oscillator on the ground, one turned by an angle on a side that slides."""
    normal = (-np.sin(angle), np.cos(angle))
    return ContactSystem(
        bodies={"a": oscillator(), "b": oscillator(angle), "wall": wall()},
        interfaces=[Interface("floor", PointPairing("a", "p"), NORMAL, friction),
                    Interface("side", PointPairing("b", "p", "wall", "side", normals=normal),
                              NORMAL, friction, sliding)],
        ground=ground, load=Load(0.0, (*pressing("a", 0.0), *pressing("b", angle))))


def alone(ground, friction=FRICTION):
    return ContactSystem(bodies={"a": oscillator()}, ground=ground, interfaces=[
        Interface("floor", PointPairing("a", "p"), NORMAL, friction)],
        load=Load(0.0, pressing("a", 0.0)))


def start(system, angles):
    """Every oscillator at 20 um inside its other side, at the velocity (0.1, -0.2) m/s."""
    basis, q, v = system.basis, [], []
    for name, angle in zip(("a", "b"), angles, strict=False):
        T = basis.T[basis.point_index(f"{name}.p"), :2]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        q.append(np.linalg.pinv(T) @ turn @ [0.0, -2e-5])
        v.append(np.linalg.pinv(T) @ turn @ [0.1, -0.2])
    return np.concatenate([sum(q), sum(v), np.zeros(system.size - 2 * basis.modes)])


def along(angle):
    return np.cos(angle), np.sin(angle)


SOLVERS = {"rodas5p": None, "events": EventDriven(),
           "stepping": TimeStepping(), "rigid": SetValued(restitution=0.6)}


@pytest.mark.parametrize("name", list(SOLVERS))
def test_each_side_slides_at_its_own_speed(name):
    """Two oscillators that know nothing of each other, at 0.4 m/s on waves and at -0.15 m/s."""
    angle, options = 0.7, {} if SOLVERS[name] is None else {"solver": SOLVERS[name]}
    ground, rtol = Ground(speed=0.4, profile=WAVES), 1e-7 if name == "stepping" else 1e-9
    both = together(SlidingTranslation(-0.15, along(angle)), ground)
    run = simulate(both, 0.04, initial=start(both, (0.0, angle)), rtol=rtol, **options)
    for column, own in ((0, ground), (1, Ground(speed=-0.15))):
        system = alone(own)
        single = simulate(system, 0.04, initial=start(system, (0.0,)), rtol=rtol, **options)
        assert np.abs(single.slip_velocity).max() > 0.1
        for quantity in ("slip_velocity", "penetration"):
            ours, theirs = getattr(run, quantity)[:, column], getattr(single, quantity)[:, 0]
            tolerance = 1e-3 if name == "stepping" else 2e-6
            assert ours == pytest.approx(theirs, abs=tolerance * np.abs(theirs).max())


@pytest.mark.parametrize("name", ["rodas5p", "events"])
def test_a_side_that_turns_unsteadily_is_a_belt_of_that_speed(name):
    """At the place r from the centre the side passes with r Omega(t); memory and waves beside."""
    angle, radius, omega = 0.7, 0.02, 15.0
    options = {} if SOLVERS[name] is None else {"solver": SOLVERS[name]}
    friction = LUGRE if name == "rodas5p" else FRICTION
    # The centre lies above the node: what turns counter-clockwise passes it along t.
    centre = (-radius * np.sin(angle), radius * np.cos(angle))
    both = together(SlidingRotation(omega, centre, HarmonicSpeed(6.0, 300.0 / TURN)),
                    Ground(profile=WAVES), friction)
    run = simulate(both, 0.04, initial=start(both, (0.0, angle)), rtol=1e-9, **options)
    belt = alone(Ground(speed=omega * radius,
                        motion=HarmonicSpeed(6.0 * radius, 300.0 / TURN)), friction)
    single = simulate(belt, 0.04, initial=start(belt, (0.0,)), rtol=1e-9, **options)
    for quantity in ("slip_velocity", "friction_force"):
        theirs = getattr(single, quantity)[:, 0]
        assert getattr(run, quantity)[:, 1] == pytest.approx(
            theirs, abs=5e-6 * np.abs(theirs).max())
    # The drive of the side does the work of the belt; the ground at rest does none.
    done = run.energies.belt_friction_work[-1]
    assert done == pytest.approx(single.energies.belt_friction_work[-1], rel=1e-5)
    assert abs(done) > 1e-3
    assert run.energies.imbalance < 1e-5


@pytest.mark.parametrize("friction", [FRICTION, LUGRE])
def test_derivatives_to_the_state_and_to_each_speed(friction):
    angle = 0.7
    system = together(SlidingTranslation(-0.15, along(angle)), Ground(speed=0.4, profile=WAVES),
                      friction)
    y = start(system, (0.0, angle))
    y[2 * system.basis.modes :] = 2e-7
    J = system.jacobian(0.013, y)
    scale = np.concatenate([np.full(5, 1e-7), np.full(5, 1e-5), np.full(system.size - 10, 1e-9)])
    for i, h in enumerate(scale):
        shift = np.zeros(len(y))
        shift[i] = h
        column = (system.rhs(0.013, y + shift) - system.rhs(0.013, y - shift)) / (2.0 * h)
        assert J[:, i] == pytest.approx(column, abs=2e-6 * np.abs(J).max(axis=1).max())
    names = ("ground.speed", "interfaces.side.sliding.speed")
    field = contact_field(system, names)
    values = np.array([0.4, -0.15])
    for k in range(2):
        given = field.derivatives(np.array([0.013]), y[None], values, (k,))[2][0, :, 0]
        move = 1e-6 * np.eye(2)[k]
        ahead, behind = (system.with_(**dict(zip(names, (values + sign * move).tolist(),
                                                 strict=True))).rhs(0.013, y)
                         for sign in (1.0, -1.0))
        assert given == pytest.approx((ahead - behind) / 2e-6, abs=1e-5 * np.abs(given).max())


def test_quasi_static_travel_is_that_of_the_side_that_slides():
    """A mass dragged along an inclined side moves as along the ground; the travel's work too."""
    angle, path = 0.7, LoadPath(travel=(0.0, 2e-3, -1e-3, 2e-3), steps=40)
    side = ContactSystem(
        bodies={"b": oscillator(angle), "wall": wall()},
        interfaces=[Interface("side", PointPairing(
            "b", "p", "wall", "side", normals=(-np.sin(angle), np.cos(angle))), NORMAL, FRICTION,
            SlidingTranslation(0.0, along(angle)))], load=Load(0.0, pressing("b", angle)))
    belt = load_history(alone(Ground()), path, tangential_ratio=0.5)
    found = load_history(side, path, tangential_ratio=0.5)
    # It sticks, slips, turns round and slips back.
    assert set(belt.contact_state[1:, 0].tolist()) == {1, 2}
    assert np.abs(belt.friction_force).max() > 30.0
    assert found.friction_force == pytest.approx(belt.friction_force, abs=1e-9 * 80.0)
    assert found.loss[-1] == pytest.approx(belt.loss[-1], rel=1e-9)
    assert found.work[-1] == pytest.approx(belt.work[-1], rel=1e-9)
    # The loop of the travel encloses what the cycle loses.
    cycle = found.loop(1, 3, action="travel")
    lost = found.loss[found.row(3)] - found.loss[found.row(1)]
    assert lost > 0.05
    assert cycle.area == pytest.approx(lost, rel=1e-3)
    both = together(SlidingTranslation(0.0, along(angle)), Ground())
    with pytest.raises(InputError, match="travel moves one side, but the system has the ground, "):
        load_history(both, path, tangential_ratio=0.5)
