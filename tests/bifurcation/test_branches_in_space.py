"""Branches, scans, basins, exponents and ensembles of systems in space, beside those of the plane.

The same masses are turned: what moves along x in the plane moves along y, what moves along y, along
z, and a further mode across the motion must neither disturb nor be disturbed.
"""

import numpy as np
import pytest
from systems import TURN, belt, impact_oscillator

from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    ModalBasis,
    basis_from_matrices,
    ensemble,
    simulate,
)
from fecontact.analysis import periodicity
from fecontact.bifurcation import (
    Axis,
    Collocation,
    ContinuationOptions,
    Shooting,
    basins,
    contact_field,
    equilibrium_branch,
    lyapunov_exponents,
    orbit_branch,
    periodic_motion,
    poincare_scan,
)
from fecontact.integrate import Crossing, Rodas5P
from fecontact.laws import ConstantFriction, ExponentialFriction, LinearContact, PrescribedForce

MASS = 5.632
SLOPE = 1e6


def belt_in_space(speed=12e-3):
    """The mass of ``belt`` on a belt that runs along y, held alike in both directions."""
    rows = np.zeros((1, 6, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    mass = basis_from_matrices(MASS * np.eye(2), np.zeros((2, 2)), {"contact": rows, "B": rows[0]},
                               dimension=3, contact_places=np.zeros((1, 3)), tributary=[1.0])
    return ContactSystem(
        mass, normal=PrescribedForce(14.0),
        friction=ExponentialFriction(0.8, 0.55, 1000.0, SLOPE), ground=Ground(speed_y=speed),
        drive=Drive(stiffness_x=5610.0, stiffness_y=5610.0, damping_x=0.768, damping_y=0.768))


def impacts_in_space(w=64.32):
    """The pendulum that strikes a stop below it, with a mode across."""
    plane = impact_oscillator(2, w)
    old = plane.basis
    T = np.zeros((3, 6, 3))
    T[:, 2, :2] = old.T[:, 1]
    T[:, 0, 2] = 3.0
    damping = np.zeros((3, 3))
    damping[:2, :2], damping[2, 2] = old.damping, 20.0
    basis = ModalBasis(np.append(old.angular_frequencies, 400.0), damping, T, np.zeros((3, 3)),
                       np.ones(1))
    drive = plane.drive
    return ContactSystem(basis, normal=plane.normal, friction=ConstantFriction(0.3), drive=Drive(
        stiffness_z=drive.stiffness_y, damping_z=drive.damping_y, amplitude_z=drive.amplitude_y,
        frequency_hz=w / TURN))


@pytest.fixture(scope="module")
def sliding():
    """Steady sliding over the belt's speed, in the plane and in space."""
    found = []
    for system, name in ((belt(SLOPE), "ground.speed"), (belt_in_space(), "ground.speed_y")):
        field = contact_field(system, [name])
        found.append((field, equilibrium_branch(field, parameter=name, bounds=(4e-3, 12e-3),
                                                direction=-1.0)))
    return found


def test_sliding_loses_stability_where_it_does_in_the_plane(sliding):
    """About where friction falls as fast as the dashpot grows: 3500 exp(-1000 V) = 0.768."""
    (_, plane), (_, space) = sliding
    (one,), (other,) = (branch.of_kind("Hopf") for branch in (plane, space))
    assert other.parameter == pytest.approx(one.parameter, rel=1e-9)
    assert other.angular_frequency == pytest.approx(one.angular_frequency, rel=1e-9)
    assert [point.kind for point in space.special] == ["Hopf"]
    assert other.criticality == one.criticality == "subcritical"
    assert one.parameter == pytest.approx(np.log(3500.0 / 0.768) / 1000.0, rel=0.02)


@pytest.mark.parametrize("method", [Collocation(60), Shooting()], ids=["collocation", "shooting"])
def test_orbits_are_those_of_the_plane(sliding, method):
    options = ContinuationOptions(points=20, step=1e-4, largest_step=1e-2)
    branches = [orbit_branch(field, branch.of_kind("Hopf")[0], method=method, bounds=(6e-3, 12e-3),
                             options=options) if isinstance(method, Collocation) else None
                for field, branch in sliding]
    if branches[0] is None:
        branches = []
        for system, name in ((belt(SLOPE, 4e-3), "ground.speed"),
                             (belt_in_space(4e-3), "ground.speed_y")):
            start = np.zeros(system.size)
            start[(system.size // 2) - 1] = 1e-3
            motion = periodic_motion(system, transient=20.0, longest_period=1.0,
                                     initial=start)
            field = contact_field(system, [name])
            branches.append(orbit_branch(field, motion, name, method=method, bounds=(4e-3, 4.5e-3)))
    plane, space = branches
    low, high = plane.parameter.min(), plane.parameter.max()
    assert high - low > 5e-5
    one, other = (np.interp(np.linspace(low, high, 5), *np.stack(
        [branch.parameter, branch.column("period")])[:, np.argsort(branch.parameter)])
        for branch in branches)
    assert other == pytest.approx(one, rel=1e-6)
    assert plane.column("stable")[-1] == space.column("stable")[-1]


def test_scan_of_impacts_is_that_of_the_plane():
    """Periods one and two over the frequency of the drive."""
    values = [30.84 / TURN, 64.32 / TURN]
    # Power series, which the plane's runs would take, leave no errors to share.
    plane = poincare_scan(impact_oscillator(2), "drive.frequency_hz", values,
                          transient_periods=200, keep=4, solver=Rodas5P())
    space = poincare_scan(impacts_in_space(), "drive.frequency_hz", values,
                          transient_periods=200, keep=4)
    for one, other in ((plane.up, space.up), (plane.down, space.down)):
        size = np.abs(one).max(axis=(0, 1))
        assert (np.abs(other[..., [0, 1, 3, 4]] - one) < 1e-4 * size).all()
        assert np.abs(other[..., [2, 5]]).max() < 1e-12
    for mine, theirs in zip(space.observed("B", "z"), plane.observed("B", "y"), strict=True):
        assert mine == pytest.approx(theirs, abs=1e-4 * np.abs(theirs).max())
    with pytest.raises(InputError, match=r"component 'phi' at 'B' must be one of .*'phi_x'.*'z'"):
        space.observed("B", "phi")
    with pytest.raises(InputError, match="component 'z' at 'B' must be one of 'phi', 'x', 'y'"):
        plane.observed("B", "z")
    # Two different states at the frequency of period two, one at the other.
    spread = np.ptp(space.up[..., 0], axis=1) / np.abs(space.up[..., 0]).max(axis=1)
    assert spread[0] > 0.01 > 100.0 * spread[1]


def test_crossings_and_periods_are_those_of_the_plane():
    """At 30.84 rad/s the motion repeats after two periods; nothing moves but along z."""
    w = 30.84
    period = 2.0 * np.pi / w
    found = []
    for system, axis in ((impact_oscillator(2, w), "y"), (impacts_in_space(w), "z")):
        section = Crossing("B", axis, of="velocity", sense="falling")
        found.append(simulate(system, 100 * period, initial=np.zeros(system.size),
                              outputs=4001, events=[section], rtol=1e-9))
    plane, space = found
    assert len(plane.events.only("event 0")) > 80
    assert space.events.only("event 0").time == pytest.approx(
        plane.events.only("event 0").time, abs=1e-5 * period)
    assert [periodicity(run, t_start=50 * period).periods for run in found] == [2, 2]
    with pytest.raises(InputError, match="component = 'w' must be one of"):
        Crossing("B", "w")
    with pytest.raises(InputError, match="component 'phi' at 'B' must be one of"):
        Crossing("B", "phi").row(impacts_in_space())
    assert Axis("B", "phi_z").row(impacts_in_space()).shape == (6,)


@pytest.mark.slow
def test_basins_are_those_of_the_plane():
    """Inside of an unstable cycle sliding, outside stick-slip."""
    v, x = np.array([0.0, 9e-3]), np.array([1.372e-3, 1.6e-3, 3.0e-3])
    found = []
    for system, axis in ((belt(SLOPE), "x"), (belt_in_space(), "y")):
        found.append(basins(system, (Axis("B", axis), x), (Axis("B", axis, "velocity"), v),
                            transient=300.0, keep=6, section=Crossing(
                                "B", axis, value=1e-4, of="velocity", sense="falling")))
    plane, space = found
    assert (space.label == plane.label).all()
    assert [one.kind for one in space.attractors] == [one.kind for one in plane.attractors]
    assert len(plane.attractors) == 2


def test_exponents_are_those_of_the_plane_and_of_the_mode_across():
    """Impacts at 64.32 rad/s contract at 6.254 1/s, the mode across decays with 10 1/s."""
    period = 2.0 * np.pi / 64.32
    found = lyapunov_exponents(impacts_in_space(), 200 * period, transient=50 * period,
                               initial=np.zeros(6))
    assert found.exponents[0] == pytest.approx(-6.254, abs=1.1)


@pytest.mark.filterwarnings("ignore:.*the body turns by")
def test_ensembles_in_space_are_single_runs():
    """A block on four corners, pressed askew on ground that turns."""
    places = np.array([(x, y, -0.02) for x in (-0.05, 0.05) for y in (-0.04, 0.04)])
    rows = np.tile(np.eye(6), (4, 1, 1))
    for row, (a, b, c) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]]
    mass = basis_from_matrices(
        np.diag([2.0] * 3 + [2e-3, 3e-3, 4e-3]), np.diag([2e4, 3e4, 0.0, 0.0, 0.0, 0.0]),
        {"contact": rows, "C": np.eye(6)}, dimension=3, contact_places=places,
        tributary=np.full(4, 1e-3), translations=np.eye(3, 6))
    base = ContactSystem(mass, normal=LinearContact(stiffness=1e6, damping=200.0),
                         friction=ConstantFriction(0.4, smoothing_slope=500.0),
                         ground=Ground(rotation_speed=4.0, centre=(0.01, 0.0)), load=Load(50.0))
    systems = [base.with_(**{"ground.rotation_speed": speed}) for speed in (2.0, 4.0, -3.0)]
    states = 1e-5 * np.random.default_rng(1).normal(size=(3, base.size))
    times = np.linspace(0.0, 0.05, 6)
    found = ensemble(systems, times, initial=states, workers=2, rtol=1e-8)
    assert found.finished.all()
    for system, state, got in zip(systems, states, found.states, strict=True):
        full = simulate(system, 0.05, initial=state, outputs=times, rtol=1e-8).states
        size = np.abs(full).reshape(6, 2, 6).max(axis=(0, 2)).repeat(6)
        assert (np.abs(got - full) < 1e-5 * size).all()
    # Ground that turns the other way drags the mass the other way.
    assert found.states[0, -1, 5] * found.states[2, -1, 5] < 0.0
