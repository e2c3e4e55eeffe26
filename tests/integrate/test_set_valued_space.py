"""Set-valued friction and rigid stops of solids: the disc of friction, impacts, order."""

import numpy as np
import pytest
from scipy.special import ellipk
from systems import TURN

import fecontact as fc
from fecontact import Interface
from fecontact.integrate import ContactEvents, EventDriven, SetValued, TimeStepping
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HarmonicSpeed,
    LinearContact,
    PrescribedForce,
    Sine,
)
from fecontact.reduction import PointPairing, point_masses

MASS, G, MU = 2.0, 9.81, 0.3
SIDES = np.array([0.2, 0.3, 0.1])
INERTIA = MASS / 12.0 * ((SIDES**2).sum() - SIDES**2)
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])
SOLVERS = {"compliant": SetValued(), "rigid": SetValued(restitution=0.5)}


def mass(ground, velocity, place=(0.0, 0.0, 0.0), friction=None, load=(0.0, 0.0, -G), **parts):
    """A point mass on the ground, pressed by its weight or bouncing, and its state at the start."""
    basis = point_masses({"a": MASS}, components="xyz", contact="a")
    friction = ConstantFriction(MU) if friction is None else friction
    system = fc.ContactSystem(basis, **{
        "normal": PrescribedForce(MASS * G), "friction": friction, "ground": ground,
        "load": fc.Load(gravity=load), **parts})
    rows = basis.contact_T[0, :3]
    return system, np.concatenate([np.linalg.solve(rows, place), np.linalg.solve(rows, velocity)])


def rigid_rows(places):
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block(ground, **parts):
    """A rigid block on its four corners."""
    basis = fc.basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), np.zeros((6, 6)),
        {"contact": rigid_rows(CORNERS), "B": np.eye(6)}, dimension=3, contact_places=CORNERS,
        tributary=np.full(4, 0.015), translations=np.eye(3, 6), damping=0.0)
    return fc.ContactSystem(basis, normal=LinearContact(4e6, 400.0), ground=ground,
                            load=fc.Load(gravity=(0.0, 0.0, -G)),
                            **{"friction": ConstantFriction(MU), **parts})


def state_of(system, pose, speed):
    return np.concatenate([np.linalg.solve(system.basis.T[0], motion) for motion in (pose, speed)])


def unexplained(run):
    """Energy at the end that the works and losses of the run leave open [J]."""
    energies = run.energies
    return (energies.stored - energies.stored[0] - energies.work + energies.lost)[-1]


@pytest.mark.parametrize("solver", SOLVERS)
def test_mass_thrown_across_a_belt(solver):
    # In the belt's frame it slides along a straight line and slows down at mu g.
    system, state = mass(fc.Ground(speed=0.5), [0.0, 1.0, 0.0])
    run = fc.simulate(system, 0.6, initial=state, outputs=601, rtol=1e-8, solver=SOLVERS[solver])
    relative = np.array([-0.5, 1.0])
    way = relative / np.linalg.norm(relative)
    stop = np.linalg.norm(relative) / (MU * G)
    assert stop == pytest.approx(0.3798960, abs=5e-8)
    t = np.minimum(run.time, stop)[:, None]
    path = [0.5, 0.0] * run.time[:, None] + relative * t - 0.5 * MU * G * t**2 * way
    assert run.status is fc.Status.FINISHED
    assert run.statistics["method"] == "time-stepping"
    assert run.displacement(0)[:, :2] == pytest.approx(path, abs=5e-6)
    assert run.displacement(0)[-1, 1] == pytest.approx(0.1899480, abs=5e-8)
    assert run.displacement(0)[-1, 0] - 0.5 * (0.6 - stop) == pytest.approx(0.0949740, abs=5e-8)
    slides, rests = run.time < 0.999 * stop, run.time > 1.001 * stop
    assert run.friction_forces[slides, 0] == pytest.approx(
        np.tile(MU * MASS * G * way, (slides.sum(), 1)), rel=1e-6)
    assert run.friction_forces[rests, 0] == pytest.approx(0.0, abs=1e-4)
    assert run.velocity(0)[rests, :2] == pytest.approx(
        np.tile([0.5, 0.0], (rests.sum(), 1)), abs=1e-8)
    assert (run.contact_state[slides] == 2).all()
    assert (run.contact_state[rests] == 1).all()
    lost = 0.5 * MASS * relative @ relative
    assert run.friction_work[-1, 0] == pytest.approx(lost, rel=1e-5)
    assert abs(unexplained(run)) < 1e-7


def line(axes, speed, stiffness, rtol, solver):
    """A mass on a spring along x, on wavy ground that moves along x."""
    basis = point_masses({"a": MASS}, {("a", None): stiffness * np.eye(len(axes))[0]},
                         components=axes, contact="a")
    system = fc.ContactSystem(
        basis, normal=LinearContact(1e6, 100.0), friction=ExponentialFriction(0.5, 0.2, decay=5.0),
        ground=fc.Ground(speed=speed, profile=Sine(1e-6, 0.1)),
        load=fc.Load(gravity=(0.0, -G) if axes == "xy" else (0.0, 0.0, -G)))
    return fc.simulate(system, 1.0, initial="rest", outputs=401, rtol=rtol, solver=solver)


def test_straight_paths_are_those_of_the_plane():
    # While it slides, step for step.
    solver = TimeStepping()
    plane, space = (line(axes, 2.0, 800.0, 1e-7, solver) for axes in ("xy", "xyz"))
    assert set(np.unique(plane.contact_state)) == {2}
    assert space.statistics["steps"] == plane.statistics["steps"]
    size = np.abs(plane.displacement(0)[:, 0]).max()
    assert space.displacement(0)[:, 0] == pytest.approx(plane.displacement(0)[:, 0],
                                                        abs=1e-12 * size)
    assert not space.displacement(0)[:, 1].any()
    assert space.friction_force == pytest.approx(plane.friction_force, rel=1e-9)
    assert space.friction_work == pytest.approx(plane.friction_work, rel=1e-12)
    for name in ("belt_friction_work", "belt_normal_work", "contact_damping", "stored"):
        there, here = getattr(plane.energies, name), getattr(space.energies, name)
        assert here == pytest.approx(there, abs=1e-12 * np.abs(there).max() + 1e-15)


def test_straight_stick_and_slip_are_those_of_the_plane():
    # Transitions are of first order, and solids stick in a stiffer grip.
    solver = TimeStepping(static_coefficient=0.6)
    plane, space = (line(axes, 0.2, 800.0, 1e-7, solver) for axes in ("xy", "xyz"))
    assert {1, 2} == set(np.unique(plane.contact_state))
    assert space.statistics["steps"] == pytest.approx(plane.statistics["steps"], rel=2e-3)
    assert space.displacement(0)[:, 0] == pytest.approx(plane.displacement(0)[:, 0], abs=3e-6)
    assert space.friction_work == pytest.approx(plane.friction_work, rel=1e-4)


@pytest.mark.parametrize("solver", SOLVERS)
def test_turned_frames_turn_the_motion(solver):
    angle, found = 0.6, []
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for frame in (np.eye(2), turn):
        belt, thrown, pull = frame @ [0.3, 0.0], frame @ [-0.1, 0.25], frame @ [1.0, 2.0]
        system, state = mass(fc.Ground(speed=belt[0], speed_y=belt[1]), [*thrown, 0.0],
                             friction=ExponentialFriction(0.5, 0.3, decay=5.0), load=(*pull, -G))
        run = fc.simulate(system, 0.3, initial=state, outputs=101, rtol=1e-7,
                          solver=SOLVERS[solver])
        found.append((run.displacement(0)[:, :2], run.friction_forces[:, 0]))
    (path, force), (turned, turned_force) = found
    assert np.abs(np.diff(np.unwrap(np.arctan2(*force.T)))).max() > 1e-3
    assert turned == pytest.approx(path @ turn.T, abs=1e-8)
    assert turned_force == pytest.approx(force @ turn.T, abs=4e-2)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("ratio", "expected"), [(0.1, 0.2344157), (1.0, 0.8346268)])
def test_lateral_dither_reduces_friction(ratio, expected, solver):
    # The mean of mu F V / sqrt(V^2 + a^2 cos^2) is a complete elliptic integral.
    k2 = 1.0 / (1.0 + ratio**2)
    assert 2.0 / np.pi * ratio * np.sqrt(k2) * ellipk(k2) == pytest.approx(expected, abs=5e-8)
    amplitude, w, push = 0.1, 2.0 * np.pi * 50.0, 10.0
    # So heavy that it does not move; the weight presses it.
    basis = point_masses({"a": 1e6}, components="xyz", contact="a")
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(push), friction=ConstantFriction(MU),
        ground=fc.Ground(speed=-ratio * amplitude, motion_y=HarmonicSpeed(amplitude, w / TURN)),
        load=fc.Load(gravity=(0.0, 0.0, -push / 1e6)))
    run = fc.simulate(system, 0.04, initial=np.zeros(6), outputs=3, rtol=1e-8, max_step=2e-5,
                      solver=SOLVERS[solver])
    mean = -1e6 * (run.velocity(0)[-1, 0] - run.velocity(0)[1, 0]) / 0.02
    assert mean / (MU * push) == pytest.approx(expected, rel=2e-4)


def test_block_on_a_turntable():
    # Four corners, ground that shears and turns: friction lies in its discs, against the slip.
    ground = fc.Ground(speed=0.2, speed_y=-0.1, rotation_speed=2.0, centre=(0.05, 0.02))
    system = block(ground, friction=ExponentialFriction(0.5, 0.3, decay=5.0))
    with pytest.warns(fc.ModelWarning, match="the body turns by"):
        run = fc.simulate(system, 0.4, initial="rest", outputs=401, rtol=1e-6, solver=SetValued())
    assert run.status is fc.Status.FINISHED
    assert run.energies.imbalance < 1e-4
    force, slip, normal = run.friction_forces, run.slip_velocities, run.normal_force
    size = np.linalg.norm(force, axis=-1)
    assert (size <= 0.5 * normal * (1.0 + 1e-3)).all()
    speed = np.linalg.norm(slip, axis=-1)
    slides = (speed > 1e-3) & (normal > 0.0)
    assert slides.sum() > 100
    expected = (0.3 + 0.2 * np.exp(-5.0 * speed)) * normal
    assert size[slides] == pytest.approx(expected[slides], rel=1e-2)
    along = (force * slip).sum(axis=-1)[slides] / (size * speed)[slides]
    assert np.median(along) > 1.0 - 1e-6
    assert along.min() > 0.99
    assert (np.diff(run.friction_work, axis=0) > -1e-9).all()
    # All in space: a rotation of the whole arrangement about the axis of the ground.
    assert np.abs(run.displacement("B")[-1, 5]) > 0.05


def test_rest_of_a_bouncing_ball():
    # e = 0.5: flights shorten geometrically, and it rests after a finite time.
    e, height = 0.5, 0.1
    system, state = mass(fc.Ground(), [0.3, 0.4, 0.0], place=(0.0, 0.0, height),
                         friction=ConstantFriction(0.05), normal=LinearContact(1e6))
    fall = np.sqrt(2.0 * height / G)
    rest = fall * (1.0 + e) / (1.0 - e)
    run = fc.simulate(system, 1.2 * rest, initial=state, outputs=601, rtol=1e-6,
                      solver=SetValued(restitution=e))
    first = (run.time > fall) & (run.time < fall * (1.0 + 2.0 * e))
    t = run.time[first] - fall
    assert run.displacement(0)[first, 2] == pytest.approx(
        e * G * fall * t - 0.5 * G * t**2, abs=2e-6)
    assert run.displacement(0)[run.time > 1.01 * rest, 2] == pytest.approx(0.0, abs=2e-6)
    # Each impact takes mu (1 + e) of the approach velocity from the slip, in its direction.
    slip = 0.5 - 0.05 * 1.5 * G * fall
    assert run.velocity(0)[first][-1, :2] == pytest.approx([0.6 * slip, 0.8 * slip], rel=1e-5)
    # All in all mu times the momentum of the weight, from rest to rest.
    late = run.time > 1.05 * rest
    slip = 0.5 - 0.05 * G * run.time[late]
    assert run.velocity(0)[late, :2] == pytest.approx(np.outer(slip, [0.6, 0.8]), abs=1e-4)
    assert abs(unexplained(run)) < 1e-5 * MASS * G * height


def coupled(rng):
    """Two contact nodes with a mass matrix that couples all their motions, and that matrix."""
    root = rng.standard_normal((6, 6))
    inertia = root @ root.T + 0.5 * np.eye(6)
    rows = np.zeros((2, 6, 6))
    rows[0, :3, :3] = rows[1, :3, 3:] = np.eye(3)
    basis = fc.basis_from_matrices(inertia, np.zeros((6, 6)), {"contact": rows}, dimension=3,
                                   contact_places=np.array([[0.0, 0, 0], [1.0, 0, 0]]),
                                   tributary=np.ones(2), damping=0.0)
    return basis, inertia


@pytest.mark.parametrize(("e", "along"), [(0.0, 0.0), (0.6, 0.6), (0.5, 0.0)])
def test_impacts_of_two_coupled_nodes(e, along):
    rng, held = np.random.default_rng(7), []
    for _ in range(25):
        basis, inertia = coupled(rng)
        mu = rng.uniform(0.05, 0.9)
        system = fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(mu))
        before = rng.standard_normal((2, 3))
        before[:, 2] = -np.abs(before[:, 2])
        shapes = basis.contact_T[:, :3].reshape(6, 6)
        state = np.concatenate([np.zeros(6), np.linalg.solve(shapes, before.ravel())])
        run = fc.simulate(system, 1e-6, initial=state, outputs=3, solver=SetValued(
            restitution=e, tangential_restitution=along))
        after = np.array([run.velocity(j)[-1, :3] for j in range(2)])
        impulse = (inertia @ (after - before).ravel()).reshape(2, 3)
        normal, size = impulse[:, 2], np.linalg.norm(impulse[:, :2], axis=1)
        assert (normal > -1e-9).all()
        assert (after[:, 2] + e * before[:, 2] > -1e-9).all()
        assert normal * (after[:, 2] + e * before[:, 2]) == pytest.approx(0.0, abs=1e-8)
        assert (size <= mu * normal + 1e-9).all()
        # In the disc no other impulse takes more from what is left of the slip.
        slip = after[:, :2] + along * before[:, :2]
        assert -(impulse[:, :2] * slip).sum(axis=1) == pytest.approx(
            mu * normal * np.linalg.norm(slip, axis=1), abs=1e-8)
        held.append(np.linalg.norm(slip, axis=1) < 1e-8)
        energy = [0.5 * v.ravel() @ inertia @ v.ravel() for v in (before, after)]
        gained = energy[1] > energy[0] * (1.0 + 1e-9)
        assert not gained or (e != along and run.status is fc.Status.IMPACT_GAINED)
        lost = run.energies.lost[-1]
        assert lost == pytest.approx(energy[0] - energy[1], rel=1e-6, abs=1e-9)
    assert 0 < np.sum(held) < 50


def test_redundant_corners_come_to_rest():
    # A tilted block that falls on its corners, 12 conditions in six motions.
    system = block(fc.Ground(speed=0.1))
    state = state_of(system, [0.0, 0.0, 0.07, 0.05, 0.03, 0.0], [0.0, 0.3, 0.0, 0.0, 0.0, 0.5])
    run = fc.simulate(system, 1.5, initial=state, outputs=601, rtol=1e-5,
                      solver=SetValued(restitution=0.3, tangential_restitution=0.3))
    assert run.status is fc.Status.FINISHED
    assert run.penetration.max() < 1e-5
    assert run.penetration[-1] == pytest.approx(0.0, abs=1e-9)
    assert run.slip_velocities[-1] == pytest.approx(0.0, abs=1e-6)
    assert run.normal_force[-1].sum() == pytest.approx(MASS * G, rel=1e-6)
    assert abs(unexplained(run)) < 1e-3


@pytest.mark.parametrize(("bounces", "order"), [(False, 2.0), (True, 1.0)])
def test_order_of_the_steps_of_impulses(bounces, order):
    # A curved path under a side force, of second order; with impacts of first order.
    system, state = mass(fc.Ground(speed=0.1), [0.5, 0.0, 0.0],
                         place=(0.0, 0.0, 0.02 if bounces else 0.0),
                         normal=LinearContact(1e6), load=(0.0, 2.0, -G))
    steps = 0.3 / np.array([75, 150, 300, 4800])
    ends = np.array([fc.simulate(system, 0.3, initial=state, outputs=2, rtol=1e-2, max_step=h,
                                 solver=SetValued(restitution=0.6)).displacement(0)[-1, :2]
                     for h in steps])
    errors = np.linalg.norm(ends[:3] - ends[3], axis=1)
    if bounces:
        # Where in a step an impact lies is chance.
        assert errors.max() < 3e-4
        tight = [fc.simulate(system, 0.3, initial=state, outputs=2, rtol=rtol, solver=SetValued(
            restitution=0.6)).displacement(0)[-1, :2] for rtol in (1e-4, 1e-6, 1e-8)]
        near = np.linalg.norm(np.array(tight[:2]) - tight[2], axis=1)
        assert near[0] < 1e-4
        assert near[1] < 1e-6
    else:
        assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("solver", SOLVERS)
def test_two_bodies_keep_their_momentum(solver):
    # One mass slides on the other until both move as one; or strikes it on a slant.
    bodies = {"upper": point_masses({"p": 1.0}, components="xyz"),
              "lower": point_masses({"p": 3.0}, components="xyz")}
    push, reduced, way = 5.0, 0.75, np.array([0.8, 0.6])
    system = fc.ContactSystem(bodies=bodies, interfaces=[Interface(
        "face", PointPairing("upper", "p", "lower", "p"),
        LinearContact(1e6) if solver == "rigid" else PrescribedForce(push), ConstantFriction(MU))])
    thrown = np.array([*0.5 * way, -0.2 if solver == "rigid" else 0.0])
    points = np.vstack([system.basis.T[system.basis.point_index(f"{name}.p"), :3]
                        for name in bodies])
    state = np.concatenate([np.zeros(6), np.linalg.solve(points, [*thrown, 0.0, 0.0, 0.0])])
    stop = 0.5 * reduced / (MU * push)
    run = fc.simulate(system, 1.5 * stop, initial=state, outputs=301, rtol=1e-7,
                      solver=SOLVERS[solver])
    upper, lower = (run.velocity(f"{name}.p")[:, :3] for name in bodies)
    assert upper + 3.0 * lower == pytest.approx(np.tile(thrown, (len(run.time), 1)), abs=1e-12)
    apart = upper - lower
    if solver == "rigid":
        # e = 0.5 in the normal direction, mu (1 + e) of it along the slip.
        assert apart[-1] == pytest.approx([*(0.5 - MU * 1.5 * 0.2) * way, 0.1], abs=1e-9)
    else:
        slip = np.maximum(0.5 - MU * push / reduced * run.time, 0.0)
        clear = np.abs(run.time / stop - 1.0) > 5e-2
        assert apart[clear, :2] == pytest.approx(np.outer(slip, way)[clear], abs=1e-7)
    assert abs(unexplained(run)) < 1e-5


def test_runs_are_read_as_they_were_written(tmp_path):
    system, state = mass(fc.Ground(speed=0.5), [0.0, 1.0, 0.0])
    run = fc.simulate(system, 0.1, initial=state, outputs=5, solver=SetValued())
    fc.write_case(tmp_path / "run.h5", run, frames=0)
    back = fc.read_case(tmp_path / "run.h5").trajectory
    assert back.held_friction_force.shape == (5, 1, 2)
    assert np.array_equal(back.friction_forces, run.friction_forces)


@pytest.mark.parametrize(("solver", "events", "message"), [
    (EventDriven(), None, r"EventDriven\(\) is for plane bodies.*take SetValued\(\)"),
    (EventDriven(restitution=0.5), None, "is for plane bodies"),
    (SetValued(restitution=0.5, impact_law="poisson"), None, "'poisson' is for plane bodies"),
    (SetValued(), ContactEvents(), "locates no events"),
    (SetValued(restitution=0.5), ContactEvents(), "locates no events")])
def test_what_solids_do_not_have_is_refused(solver, events, message):
    system, state = mass(fc.Ground(speed=0.5), [0.0, 1.0, 0.0])
    with pytest.raises(fc.InputError, match=message):
        fc.simulate(system, 0.1, initial=state, outputs=3, solver=solver, events=events)
