"""Runs of bodies in space: thrown across a belt, under dither, turned frames, energy."""

import numpy as np
import pytest
from scipy.special import ellipk
from systems import TURN

import fecontact as fc
from fecontact.integrate import Rodas5P, Scipy
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HarmonicSpeed,
    IwanFriction,
    LinearContact,
    LuGreFriction,
    Sine,
)
from fecontact.reduction import point_masses

MASS, G, MU = 2.0, 9.81, 0.3
SIDES = np.array([0.2, 0.3, 0.1])
INERTIA = MASS / 12.0 * ((SIDES**2).sum() - SIDES**2)
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])


def rigid_rows(places):
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block(stiffness=(0.0, 0.0, 0.0)):
    """A rigid block on four corners, held by springs at its centre."""
    return fc.basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), np.diag([*stiffness, 0.0, 0.0, 0.0]),
        {"contact": rigid_rows(CORNERS), "B": np.eye(6)}, dimension=3, contact_places=CORNERS,
        tributary=np.full(4, 0.015), translations=np.eye(3, 6), damping=0.0)


def mass_on_belt(friction, ground, velocity, depth):
    """A point mass on the ground, pressed by its weight, and its state at the start."""
    basis = point_masses({"a": MASS}, components="xyz", contact="a")
    system = fc.ContactSystem(basis, normal=LinearContact(stiffness=MASS * G / depth),
                              friction=friction, ground=ground,
                              load=fc.Load(gravity=(0.0, 0.0, -G)))
    rows = basis.contact_T[0, :3]
    state = np.concatenate([np.linalg.solve(rows, [0.0, 0.0, -depth]),
                            np.linalg.solve(rows, velocity)])
    return system, state


def test_mass_thrown_across_a_belt():
    # In the belt's frame it slides along a straight line and slows down at mu g.
    belt, thrown = np.array([0.4, 0.0]), np.array([0.0, 0.7])
    friction = ConstantFriction(MU, smoothing_slope=1e5)
    system, state = mass_on_belt(friction, fc.Ground(speed=belt[0]), [*thrown, 0.0], 1e-5)
    relative = thrown - belt
    stop = np.linalg.norm(relative) / (MU * G)
    run = fc.simulate(system, 1.5 * stop, initial=state, outputs=601, rtol=1e-8)
    t = np.minimum(run.time, stop)[:, None]
    way = relative / np.linalg.norm(relative)
    travelled = belt * run.time[:, None] + relative * t - 0.5 * MU * G * t**2 * way
    assert run.displacement(0)[:, :2] == pytest.approx(travelled, abs=2e-5)
    assert run.velocity(0)[run.time > 1.02 * stop, :2] == pytest.approx(
        np.tile(belt, (np.count_nonzero(run.time > 1.02 * stop), 1)), abs=2e-4)
    sliding = run.time < 0.98 * stop
    assert run.friction_forces[sliding, 0] == pytest.approx(
        np.tile(MU * MASS * G * way, (np.count_nonzero(sliding), 1)), rel=1e-3)
    # Friction loses the kinetic energy of the relative motion.
    assert run.friction_work[-1, 0] == pytest.approx(
        0.5 * MASS * relative @ relative, rel=1e-3)
    assert np.abs(run.energies.imbalance).max() < 1e-6 * 0.5 * MASS * relative @ relative
    # It slips until it rests on the belt.
    states = run.contact_state[:, 0]
    assert (states[sliding] == 2).all()
    assert (states[run.time > 1.02 * stop] == 1).all()


@pytest.mark.parametrize("friction", [
    ConstantFriction(MU, smoothing_slope=3e4),
    LuGreFriction(MU, 0.2, stribeck_velocity=0.05, bristle_stiffness=1e4, bristle_damping=3.0,
                  stribeck_exponent=2.0),
    IwanFriction(stiffness=2e5, friction_coefficient=MU, elements=3)])
def test_turned_belt_turns_the_motion(friction):
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = []
    for frame in (np.eye(2), turn):
        belt, thrown = frame @ [0.3, 0.0], frame @ [-0.1, 0.25]
        system, state = mass_on_belt(friction, fc.Ground(speed=belt[0], speed_y=belt[1]),
                                     [*thrown, 0.0], 2e-5)
        state = np.concatenate([state, np.zeros(system.size - len(state))])
        run = fc.simulate(system, 0.2, initial=state, outputs=101, rtol=1e-10)
        found.append((run.displacement(0)[:, :2], run.friction_forces[:, 0]))
    (path, force), (turned, turned_force) = found
    assert turned == pytest.approx(path @ turn.T, abs=1e-9)
    assert turned_force == pytest.approx(force @ turn.T, abs=1e-4)


def test_motion_along_a_line_is_that_of_the_plane():
    # The mass on a belt held by a spring sticks and slips.
    friction = ExponentialFriction(0.5, 0.2, decay=5.0, smoothing_slope=1e4)
    runs = []
    for components, drive in (("xy", fc.Drive(stiffness_x=800.0)),
                              ("xyz", fc.Drive(stiffness_x=800.0))):
        basis = point_masses({"B": MASS}, components=components, contact="B")
        system = fc.ContactSystem(
            basis, normal=LinearContact(stiffness=1e6), friction=friction, drive=drive,
            ground=fc.Ground(speed=0.2), load=fc.Load(gravity=(0.0, -G) if components == "xy"
                                                      else (0.0, 0.0, -G)))
        runs.append(fc.simulate(system, 1.0, initial="rest", outputs=501, rtol=1e-9,
                                solver=Rodas5P()))
    plane, space = runs
    assert space.displacement(0)[:, 0] == pytest.approx(plane.displacement(0)[:, 0], abs=1e-10)
    assert not space.displacement(0)[:, 1].any()
    assert np.ptp(plane.displacement(0)[500:, 0]) >= 0.0
    assert space.friction_force == pytest.approx(plane.friction_force, abs=1e-4)
    assert space.statistics["steps"] == pytest.approx(plane.statistics["steps"], rel=0.02)


def test_lateral_dither_reduces_friction():
    # R_x = mu F v / sqrt(v^2 + a^2 cos^2): its mean is a complete elliptic integral. The mass is so
    # heavy beside the force that presses it that it stays where it is.
    speed, amplitude, w = 0.02, 0.1, 2.0 * np.pi * 50.0
    basis = point_masses({"a": 1e9}, components="xyz", contact="a")
    system = fc.ContactSystem(
        basis, normal=LinearContact(stiffness=1e6), friction=ConstantFriction(MU, 1e6),
        ground=fc.Ground(speed=-speed, motion_y=HarmonicSpeed(amplitude, w / TURN)),
        load=fc.Load(gravity=(0.0, 0.0, -1e-8)))
    run = fc.simulate(system, 0.1, initial="rest", outputs=5001, rtol=1e-8)
    whole = run.time >= 0.02
    mean = np.trapezoid(run.friction_force[whole, 0], run.time[whole]) / 0.08
    k2 = amplitude**2 / (speed**2 + amplitude**2)
    expected = MU * 10.0 * 2.0 / np.pi * speed / np.hypot(speed, amplitude) * ellipk(k2)
    assert expected < 0.4 * MU * 10.0
    assert mean == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("ground", [
    fc.Ground(speed=0.1, speed_y=-0.05, rotation_speed=1.5, centre=(0.02, 0.0)),
    fc.Ground(speed=0.15, speed_y=0.1, profile=Sine(2e-5, 0.08), wave_direction=(1.0, 1.0))])
@pytest.mark.parametrize("friction", [
    ConstantFriction(MU, smoothing_slope=300.0),
    LuGreFriction(MU, 0.25, stribeck_velocity=0.05, bristle_stiffness=5e3, bristle_damping=3.0,
                  stribeck_exponent=2.0)])
def test_block_on_moving_ground_agrees_with_another_integrator(ground, friction):
    system = fc.ContactSystem(
        block((2e4, 1e4, 0.0)), normal=LinearContact(stiffness=4e6, damping=400.0),
        friction=friction, ground=ground, load=fc.Load(gravity=(0.0, 0.0, -G)))
    ours = fc.simulate(system, 0.05, initial="rest", outputs=51, rtol=1e-8)
    other = fc.simulate(system, 0.05, initial="rest", outputs=51, rtol=1e-9,
                        solver=Scipy("Radau"))
    size = np.abs(other.modal_coordinates).max()
    assert ours.modal_coordinates == pytest.approx(other.modal_coordinates, abs=1e-5 * size)
    energies = ours.energies
    assert np.abs(energies.imbalance).max() < 1e-5 * (
        energies.friction[-1] + np.abs(energies.kinetic).max())
    assert energies.friction[-1] > 0.0
