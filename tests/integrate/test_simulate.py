"""Runs in time against closed forms, published values, and conservation of energy."""

import itertools

import numpy as np
import pytest
from meshes_for_tests import rectangle
from scipy.optimize import brentq
from systems import (
    DRIVEN,
    SURFACE,
    TURN,
    beam,
    friction_oscillator,
    impact_oscillator,
    mass_in_plane,
    mass_in_y,
)

from fecontact import (
    AnalysisError,
    ContactState,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    ModalBasis,
    RigidStart,
    Status,
    Trajectory,
    basis_from_matrices,
    equilibrium,
    modal_basis,
    simulate,
)
from fecontact.integrate import Rodas5P, Scipy, initial_state
from fecontact.laws import ExponentialFriction, RoughSurface

RTOL = 1e-6
BALANCE = 20.0 * RTOL


def at(system, x=0.0, y=0.0, x_rate=0.0, y_rate=0.0):
    """State of a mass with this place and velocity, on top of its equilibrium in y."""
    T = system.basis.T[2, :2]
    if system.basis.modes == 1:
        return np.array([y / T[1, 0], y_rate / T[1, 0]])
    q = equilibrium(system).modal_coordinates if y == 0.0 else np.zeros(2)
    return np.concatenate([q + np.linalg.solve(T, [x, y]), np.linalg.solve(T, [x_rate, y_rate])])


# Impacts -----------------------------------------------------------------------------------------

MASS, C, R, V0 = 0.1, 1e6, 1e-4, 0.05
DEEPEST = (3.0 * MASS * V0**2 * R / C) ** (1.0 / 3.0)


@pytest.mark.parametrize(("method", "tolerance"), [("Radau", 1e-6), ("BDF", 1e-4), ("LSODA", 1e-5)])
def test_contact_time_of_uniform_roughness(method, tolerance):
    """A run of 2 T ends at the height v0 T."""
    system = mass_in_y(MASS, normal=RoughSurface(C, R, 0.0))
    T = 2.8043642107 * DEEPEST / V0
    run = simulate(system, 2.0 * T, initial=at(system, y_rate=-V0), solver=Scipy(method),
                   outputs=201)
    assert run.status is Status.FINISHED
    height, rate = run.displacement(0)[-1, 1], run.velocity(0)[-1, 1]
    assert 2.0 * T - height / rate == pytest.approx(T, rel=tolerance)
    assert rate == pytest.approx(V0, rel=3.0 * tolerance)
    assert run.penetration.max() == pytest.approx(DEEPEST, rel=1e-4)
    assert run.energies.imbalance < (BALANCE if method != "BDF" else 10.0 * BALANCE)


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_contact_time_of_a_linear_contact():
    width = 1e-9
    system = mass_in_y(MASS, normal=RoughSurface(C, width, 0.0))
    T = np.pi * np.sqrt(MASS / C)
    run = simulate(system, 2.0 * T, initial=at(system, -0.5 * width, -0.5 * width, 0.0, -V0),
                   outputs=11)
    height, rate = run.displacement(0)[-1, 1] + 0.5 * width, run.velocity(0)[-1, 1]
    assert 2.0 * T - height / rate == pytest.approx(T, rel=2e-5)
    assert rate == pytest.approx(V0, rel=1e-5)
    assert run.energies.imbalance < BALANCE


@pytest.mark.parametrize(("b", "restitution"), [
    (0.02, 0.9569384399), (0.05, 0.8969657584), (0.1, 0.8081864188), (0.2, 0.6653065459),
    (0.5, 0.4095613395)])
def test_restitution_of_uniform_roughness(b, restitution):
    system = mass_in_y(MASS, normal=RoughSurface(C, R, b * DEEPEST / V0 * C))
    run = simulate(system, 4.5 * DEEPEST / V0, initial=at(system, y_rate=-V0), outputs=11)
    assert run.velocity(0)[-1, 1] == pytest.approx(restitution * V0, rel=1e-5)
    assert run.energies.imbalance < BALANCE
    lost = 0.5 * MASS * V0**2 * (1.0 - restitution**2)
    assert run.energies.contact_damping[-1] == pytest.approx(lost, rel=2e-5)


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
@pytest.mark.parametrize(("zeta", "restitution"), [
    (0.05, 0.8587581018), (0.1, 0.7440793977), (0.2, 0.5717400276)])
def test_restitution_of_a_linear_contact(zeta, restitution):
    width = 1e-5 * V0 * np.sqrt(MASS / C)
    system = mass_in_y(MASS, normal=RoughSurface(C, width, 2.0 * zeta * np.sqrt(C * MASS)))
    run = simulate(system, 5.0 * np.sqrt(MASS / C), initial=at(system, y_rate=-V0), outputs=11)
    assert run.velocity(0)[-1, 1] == pytest.approx(restitution * V0, rel=1e-5)
    assert run.energies.imbalance < BALANCE


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_mass_on_an_elastic_stop():
    """Code_Aster SDND101; the load moves the spring's rest to where the stop's force begins."""
    width = 1e-8
    system = mass_in_y(100.0, 1e4, normal=RoughSurface(1e6, width, 0.0),
                       load=Load(1e4 * 0.5 * width))
    middles = np.array([0.015630008, 0.361049288])
    times = np.unique(np.concatenate([
        [0.0, 0.4], *(middle + np.linspace(-1e-3, 1e-3, 41) for middle in middles)]))
    run = simulate(system, 0.4, initial=at(system, 0.0, -0.5 * width, 0.0, -1.0), outputs=times,
                   rtol=1e-7)
    rate = run.velocity(0)[:, 1]
    turn = np.flatnonzero((rate[:-1] < 0.0) & (rate[1:] >= 0.0))
    found = times[turn] - rate[turn] * np.diff(times)[turn] / np.diff(rate)[turn]
    assert found == pytest.approx(middles, rel=1e-6)
    assert run.normal_force.max() == pytest.approx(9950.371902, rel=1e-6)


@pytest.mark.parametrize(("method", "tolerance"), [
    ("Radau", 5e-6), ("BDF", 5e-5), ("LSODA", 2e-5)])
def test_drop_on_a_spring(method, tolerance):
    """Code_Aster SDND108."""
    width = 1e-6
    system = mass_in_y(1.0, normal=RoughSurface(100.0, width, 0.0), load=Load(10.0),
                       gap=2.0 - 0.5 * width)
    times = [0.0, 0.54031242374324, 0.88545615307643, 1.0, 1.1]
    run = simulate(system, 1.1, initial=at(system, y_rate=-1.0), outputs=times,
                   solver=Scipy(method))
    assert run.displacement(0)[:, 1] == pytest.approx(
        [0.0, -2.0, -2.0, -1.332162981855, -0.856394405035], abs=tolerance)
    assert run.energies.load_work[-1] == pytest.approx(8.56394405, abs=1e-3)
    assert run.energies.imbalance < (BALANCE if method != "BDF" else 10.0 * BALANCE)


# Friction ----------------------------------------------------------------------------------------

def test_coulomb_decay():
    """Code_Aster SDND100; the smoothing creeps, its error falls with 1 / k_s."""
    exact = np.array([0.85, -0.65, 0.45, -0.25, 0.05, 0.05]) * 1e-3
    errors = []
    for slope in (1e4, 1e5, 1e6):
        system = mass_in_plane(1.0, 1e4, normal=RoughSurface(1e6, 1e-5, 10.0), load=Load(2.0),
                               friction=ExponentialFriction(0.5, 0.5, 0.0, slope))
        times = np.arange(6) * np.pi / 100.0
        run = simulate(system, times[-1], initial=at(system, x=0.85e-3), outputs=times)
        errors.append(np.abs(run.displacement(0)[:, 0] - exact)[1:].max())
        assert run.energies.imbalance < BALANCE
        # Released at 0.85 mm, caught at 0.05 mm: the difference of the spring's energy.
        assert run.energies.friction[-1] == pytest.approx(
            0.5e4 * (0.85e-3**2 - 0.05e-3**2), rel=1e-2)
    assert errors[0] < 4e-6
    assert errors[1] < 4e-7
    assert errors[2] < 4e-8


@pytest.mark.parametrize(("r", "beta", "amplitude", "tolerance"), [
    (0.8, 0.4, 2.5017878810, 1e-3), (1.25, 0.4, 1.4800496969, 1e-3),
    (2.0, 0.4, 4.0 / 15.0, 6e-3)])
def test_den_hartog(r, beta, amplitude, tolerance):
    """m = k = P = 1; the smoothing k_s = 1e3 changes the amplitude by some 1e-3."""
    system = mass_in_plane(1.0, normal=RoughSurface(1e4, 1e-4, 10.0), load=Load(1.0),
                           friction=ExponentialFriction(beta, beta, 0.0, 1e3),
                           drive=Drive(stiffness_x=1.0, amplitude_x=1.0, frequency_hz=r / TURN))
    period = 2.0 * np.pi / r
    times = np.concatenate([[0.0], np.linspace(29.0, 30.0, 401) * period])
    run = simulate(system, times[-1], outputs=times, solver=Scipy("LSODA"), rtol=1e-7)
    x = run.displacement("B")[1:, 0]
    assert 0.5 * np.ptp(x) == pytest.approx(amplitude, rel=tolerance)


def oscillator(speed=1e-3, amplitude=0.0, smoothing=1e6):
    return friction_oscillator(2, **{
        "ground.speed": speed, "drive.amplitude_x": amplitude,
        "friction.smoothing_slope": smoothing})


@pytest.mark.parametrize(("smoothing", "critical", "tolerance"), [
    (1e6, 8.336533e-3, 1e-7), (1e12, 8.424483793e-3, 1e-6)])
def test_hopf_point_of_steady_sliding(smoothing, critical, tolerance):
    def growth(speed):
        system = oscillator(speed, smoothing=smoothing)
        q = equilibrium(system, "sliding").modal_coordinates
        values = np.linalg.eigvals(system.jacobian(0.0, np.concatenate([q, np.zeros(2)])))
        # The pair of the motion along the ground; that of the contact lies near 970 rad/s.
        return values[np.abs(values.imag) < 100.0].real.max()

    assert brentq(growth, 7e-3, 10e-3, xtol=1e-12) == pytest.approx(critical, rel=tolerance)
    assert growth(0.9 * critical) > 0.0


@pytest.mark.long
@pytest.mark.parametrize(("method", "tolerance"), [("Radau", 5e-6), ("LSODA", 3e-4), ("BDF", 5e-4)])
def test_stick_slip_on_the_belt(method, tolerance):
    run = simulate(oscillator(), 6.0, outputs=12001, solver=Scipy(method))
    late = run.time > 3.0
    x, t = run.displacement("B")[late, 0], run.time[late]
    up = np.flatnonzero((x[:-1] < 1.4e-3) & (x[1:] >= 1.4e-3))
    passed = t[up] + (1.4e-3 - x[up]) * np.diff(t)[up] / np.diff(x)[up]
    assert np.diff(passed) == pytest.approx(1.264348, rel=tolerance)
    assert [1e3 * x.min(), 1e3 * x.max()] == pytest.approx([0.796592, 1.953714], rel=2e-4)
    assert run.energies.imbalance < (BALANCE if method != "BDF" else 10.0 * BALANCE)
    # Stick with the belt for most of the time, slip back in between.
    assert set(np.unique(run.contact_state)) == {ContactState.STICK, ContactState.SLIP}
    sticking = run.contact_state[late, 0] == ContactState.STICK
    assert 0.85 < sticking.mean() < 0.95
    assert np.abs(run.slip_velocity[late, 0][sticking]).max() < 4.6e-5 * 1.01
    assert run.velocity("B")[late, 0][sticking] == pytest.approx(1e-3, abs=4.7e-5)


def test_belt_with_two_coefficients_of_friction():
    """F_s = 1, F_k = 0.5, k = m = 1, V = 0.2, by a very steep fall and smoothing."""
    system = mass_in_plane(1.0, normal=RoughSurface(1e4, 1e-4, 10.0), load=Load(1.0),
                           friction=ExponentialFriction(1.0, 0.5, 1e3, 1e8),
                           ground=Ground(speed=0.2), drive=Drive(stiffness_x=1.0))
    run = simulate(system, 24.0, outputs=24001)
    late = run.time > 4.0
    x, t = run.displacement("B")[late, 0], run.time[late]
    up = np.flatnonzero((x[:-1] < 0.5) & (x[1:] >= 0.5))
    passed = t[up] + (0.5 - x[up]) * np.diff(t)[up] / np.diff(x)[up]
    assert np.diff(passed) == pytest.approx(8.902605414, rel=2e-3)
    assert x.max() == pytest.approx(1.038516481, rel=2e-3)


def test_driven_friction_oscillator_closes_after_four_periods():
    period = 2.0 * np.pi / 13.8
    times = np.concatenate([[0.0], np.linspace(28.0, 36.0, 8 * 100 + 1) * period])
    run = simulate(oscillator(amplitude=0.5e-3), times[-1], outputs=times)
    x = run.displacement("B")[1:, 0]

    def misses(periods):
        return np.abs(x[100 * periods:] - x[: -100 * periods]).max() / np.ptp(x)

    assert misses(4) < 3e-4
    assert min(misses(1), misses(2), misses(3)) > 0.2
    assert run.energies.imbalance < BALANCE


def test_third_mode_vibrates_at_the_drive_while_the_contact_sticks():
    """30 Hz, amplitudes 0.5 at B and -0.5 at the contact: with the contact held it has 27.2 Hz."""
    root = 1.0 / np.sqrt(5.632)
    w = 2.0 * np.pi * 30.0
    T = np.zeros((3, 3, 3))
    T[0, 0], T[2, 0] = [root, 0.0, 0.5 * root], [root, 0.0, -0.5 * root]
    T[:, 1] = [0.0, root, 0.0]
    basis = ModalBasis(angular_frequencies=[0.0, 0.0, w], damping=np.diag([0.0, 0.0, 0.02 * w]),
                       T=T, positions=np.zeros((3, 2)), tributary=[1.0])
    system = oscillator(amplitude=0.5e-3).with_(basis=basis)
    times = np.concatenate([[0.0], np.linspace(8.0, 12.0, 8001) * 2.0 * np.pi / 13.8])
    run = simulate(system, times[-1], outputs=times, solver=Scipy("LSODA"))
    state = run.contact_state[:, 0]
    runs = np.split(np.arange(len(state)), np.flatnonzero(np.diff(state)) + 1)
    longest = max((k for k in runs if state[k[0]] == ContactState.STICK), key=len)
    at_contact, at_drive = (run.velocity(point)[longest, 0] for point in (0, "B"))
    assert np.abs(at_contact - 1e-3).max() < 4.7e-5
    assert at_drive.max() > 3e-3
    # x = 0 at the contact leaves the direction (0.5, 1) of the modes in x.
    free = np.array([0.5, 1.0])
    stiffness = np.diag([0.0, w**2]) + 5610.0 * root**2 * np.outer([1.0, 0.5], [1.0, 0.5])
    expected = np.sqrt(free @ stiffness @ free / (free @ free)) / (2.0 * np.pi)
    swing = at_drive - at_drive.mean()
    up = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    t = times[longest]
    passed = t[up] - swing[up] * np.diff(t)[up] / np.diff(swing)[up]
    assert np.ptp(passed) / (len(passed) - 1) == pytest.approx(1.0 / expected, rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize(("w", "repeats"), [
    (64.32, 1), (30.84, 2), pytest.param(37.41, 4, marks=pytest.mark.slow)])
def test_regimes_of_the_impact_oscillator(w, repeats):
    period = 2.0 * np.pi / w
    times = np.concatenate([[0.0], np.linspace(52.0, 60.0, 8 * 200 + 1) * period])
    run = simulate(impact_oscillator(w=w), times[-1], outputs=times, solver=Scipy("LSODA"))
    y = run.displacement("B")[1:, 1]
    misses = [np.abs(y[200 * k:] - y[: -200 * k]).max() / np.ptp(y) for k in (1, 2, 3, 4)]
    assert int(np.argmax(np.array(misses) < 3e-3)) + 1 == repeats
    touching = run.normal_force[1:, 0] > 0.0
    assert 0.0 < touching.mean() < 0.2
    assert run.contact_state[1:, 0][~touching].max() == ContactState.OPEN


# Bodies ------------------------------------------------------------------------------------------

@pytest.mark.slow
def test_energy_balance_and_methods_agree_on_a_driven_beam():
    runs = {method: simulate(beam(**DRIVEN), 0.03, outputs=301, solver=Scipy(method))
            for method in ("Radau", "BDF", "LSODA")}
    place = {method: run.displacement("B") for method, run in runs.items()}
    size = np.abs(place["Radau"]).max(axis=0)
    for first, second in itertools.combinations(place.values(), 2):
        assert (np.abs(first - second).max(axis=0) < 1e-2 * size).all()
    assert np.abs(place["Radau"][:, 0] - place["LSODA"][:, 0]).max() < 1e-4 * size[0]
    for run in runs.values():
        energies = run.energies
        assert energies.imbalance < BALANCE
        for loss in (energies.modal_damping, energies.dashpots, energies.contact_damping,
                     energies.friction):
            assert loss[-1] > 0.0
            assert (np.diff(loss) > -1e-9 * energies.lost[-1]).all()
        assert energies.stored == pytest.approx(
            energies.stored[0] + energies.work - energies.lost, abs=1e-5 * energies.work.max())
        assert run.normal_force.min() >= 0.0
        assert (np.abs(run.friction_force) <= 0.4 * run.normal_force * (1.0 + 1e-12)).all()


def test_energy_balance_of_a_falling_beam():
    start = RigidStart((0.0, 2e-5, 1e-4), (0.01, -0.05, 0.0))
    run = simulate(beam(8, 10), 0.01, initial=start, outputs=201)
    assert run.energies.imbalance < BALANCE
    assert set(np.unique(run.contact_state)) == {0, 1, 2}
    kinetic = 0.5 * 7850.0 * 0.2 * 0.02 * 0.01 * (0.01**2 + 0.05**2)
    assert run.energies.kinetic[0] == pytest.approx(kinetic, rel=1e-9)
    assert run.energies.kinetic[-1] < 0.1 * kinetic


def test_energy_balance_on_waves():
    system = beam(ground=Ground(speed=0.2, amplitude=5e-6, wavelength=0.05),
                  drive=Drive(stiffness_x=1e5, damping_x=50.0))
    run = simulate(system, 0.05, outputs=101)
    assert run.energies.imbalance < BALANCE
    assert np.abs(run.energies.belt_normal_work).max() > 1e-5
    assert run.energies.belt_friction_work[-1] > 0.0


def test_rest_stays_at_rest():
    system = beam(ground=Ground(speed=0.0))
    run = simulate(system, 0.02, outputs=11)
    assert np.abs(run.displacement("C") - run.displacement("C")[0]).max() < 1e-11
    assert run.normal_force.sum(axis=1) == pytest.approx(np.full(11, 50.0), rel=1e-6)
    assert run.contact_state.tolist() == [[ContactState.STICK] * 4] * 11


def test_steady_sliding_stays_steady():
    system = beam(friction=ExponentialFriction(0.3, 0.3, 0.0, 1e4), ground=Ground(speed=0.05),
                  drive=Drive(stiffness_x=1e5))
    run = simulate(system, 0.02, outputs=11, initial="sliding")
    place = run.displacement("B")
    mu = 0.3 * 2.0 / np.pi * np.arctan(1e4 * 0.05)
    assert place[:, 0] == pytest.approx(np.full(11, mu * 50.0 / 1e5), rel=1e-6)
    assert run.contact_state.tolist() == [[ContactState.SLIP] * 4] * 11
    # The work of the belt is lost in friction.
    assert run.energies.belt_friction_work[-1] == pytest.approx(mu * 50.0 * 0.05 * 0.02, rel=1e-6)
    assert run.energies.friction[-1] == pytest.approx(run.energies.belt_friction_work[-1], rel=1e-6)


def test_free_flight_of_a_body():
    """No contact: the centre moves uniformly, the body turns, nothing deforms."""
    system = beam(load=Load(0.0))
    start = RigidStart((1e-3, 2e-3, 1e-3), (0.3, 0.1, 0.5))
    run = simulate(system, 0.01, initial=start, outputs=5)
    assert np.abs(run.modal_coordinates[:, 3:]).max() < 1e-12
    for point, (x, y) in {"B": (0.0, 0.01), "C": (0.1, 0.02), 1: (0.075, 0.0)}.items():
        first = [1e-3 - 1e-3 * y, 2e-3 + 1e-3 * x, 1e-3]
        rate = np.array([0.3 - 0.5 * y, 0.1 + 0.5 * x, 0.5])
        assert run.displacement(point) == pytest.approx(
            first + np.outer(run.time, rate), rel=1e-8, abs=1e-11)
        assert run.velocity(point) == pytest.approx(np.tile(rate, (5, 1)), rel=1e-8)


def test_nodes_and_field_points():
    system = beam(**DRIVEN)
    run = simulate(system, 0.002, outputs=5, initial=RigidStart((0.0, 1e-3, 0.0)))
    field = system.basis.mode_shapes
    node = int(np.argmin(np.linalg.norm(field.nodes - [0.2, 0.02], axis=1)))
    assert run.displacement((0.2, 0.02)) == pytest.approx(
        run.modal_coordinates @ field.shapes[node].T, abs=1e-18)
    with pytest.raises(InputError, match="outside the body"):
        run.displacement((0.5, 0.5))
    with pytest.raises(InputError, match="no point 'tip'"):
        run.displacement("tip")
    with pytest.raises(InputError, match="Contact node 4"):
        run.velocity(4)
    with pytest.raises(InputError, match="no mode shapes"):
        simulate(oscillator(), 0.01, outputs=2).displacement((0.0, 0.0))


def test_states_of_nodes():
    """Open without normal force, stick below the speed of the largest friction, else slip."""
    system = oscillator()
    limit = system.friction.stick_velocity(1)[0]
    slip = limit * np.array([0.0, 0.99, -0.99, 1.01, -1.01, 30.0, 0.0])
    root = np.sqrt(5.632)
    y = root * np.array([-1e-6, -1e-6, -1e-6, -1e-6, -1e-6, -1e-6, 1e-6])
    n = len(y)
    run = Trajectory(system, np.arange(float(n)), np.column_stack([np.zeros(n), y]),
                     np.column_stack([root * (1e-3 + slip), np.zeros(n)]), np.zeros((n, 10)))
    S, G, O = ContactState.STICK, ContactState.SLIP, ContactState.OPEN
    assert run.contact_state[:, 0].tolist() == [S, S, S, G, G, G, O]


def test_line_load_is_force_per_length_and_pressure_force_per_area():
    run = simulate(beam(), 0.001, outputs=2)
    assert run.line_load == pytest.approx(run.normal_force / 0.05, rel=1e-12)
    thickness = run.system.basis.thickness
    assert run.pressure == pytest.approx(run.normal_force / (0.05 * thickness), rel=1e-12)
    assert run.system.basis.select([0, 1, 3]).thickness == thickness


def test_without_thickness_there_is_no_pressure():
    run = simulate(oscillator(), 0.01, outputs=2)
    assert run.line_load == pytest.approx(run.normal_force)
    with pytest.raises(InputError, match=r"no thickness; give thickness=\.\.\. \[m\]"):
        _ = run.pressure


# Starts ------------------------------------------------------------------------------------------

def test_start_at_rest_on_wavy_ground():
    """The ground is taken where it stands at the start."""
    system = mass_in_plane(normal=RoughSurface(1e6, 1e-5, 10.0), load=Load(2.0),
                           ground=Ground(speed=1e-3, amplitude=1e-4, wavelength=0.02))
    y = initial_state(system, "rest", 4.0)
    history = system.contact_history(np.array([4.0]), y[None])[0, 0]
    assert history[2] == pytest.approx(np.sqrt(2.0 * 1e-5 * 2.0 / 1e6), rel=1e-8)
    assert (y[2:] == 0.0).all()


def test_rigid_start_about_a_hinge():
    body = ElasticBody(rectangle(0.2, 0.02, 12, 2), Material(), 0.01, fixed={"left": "hinge"})
    basis = modal_basis(body, 4, contact="bottom", contact_nodes=2, C=(0.2, 0.02))
    system = ContactSystem(basis, SURFACE, friction=ExponentialFriction(0.8, 0.55, 1e3))
    # The hinge at (0, 0.01) stays: the origin moves by (0.01 phi, 0).
    y = initial_state(system, RigidStart((1e-5, 0.0, 1e-3)), 0.0)
    assert basis.T[1] @ y[:4] == pytest.approx([-1e-5, 2e-4, 1e-3], rel=1e-9)
    with pytest.raises(InputError, match=r"not a motion that the body is free .* 1 rigid modes"):
        initial_state(system, RigidStart((0.0, 0.0, 1e-3)), 0.0)
    with pytest.raises(InputError, match="not a motion"):
        initial_state(system, RigidStart((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)), 0.0)


def test_restart_continues_the_same_motion():
    system = beam(**DRIVEN)
    whole = simulate(system, 0.012, outputs=[0.0, 0.006, 0.012], solver=Scipy("LSODA"), rtol=1e-8)
    first = simulate(system, 0.006, outputs=3, solver=Scipy("LSODA"), rtol=1e-8)
    second = simulate(system, 0.012, t_start=0.006, initial=first, outputs=3, solver=Scipy("LSODA"),
                      rtol=1e-8)
    assert second.time == pytest.approx([0.006, 0.009, 0.012], rel=1e-15)
    assert (second.states[0] == first.states[-1]).all()
    size = np.repeat([np.abs(whole.modal_coordinates).max(), np.abs(whole.modal_velocities).max()],
                     6)
    assert (np.abs(first.states[-1] - whole.states[1]) < 1e-6 * size).all()
    assert (np.abs(second.states[-1] - whole.states[2]) < 1e-5 * size).all()
    assert np.abs(second.displacement("B")[-1, 0] / whole.displacement("B")[-1, 0] - 1.0) < 1e-6


# Outputs and endings -----------------------------------------------------------------------------

def test_outputs():
    system = oscillator()
    run = simulate(system, 0.5, t_start=0.25, outputs=6)
    assert run.time == pytest.approx(np.linspace(0.25, 0.5, 6), rel=1e-15)
    assert run.states.shape == (6, 4)
    assert run.work.shape == (6, 10)
    assert (run.work[0] == 0.0).all()
    times = np.array([0.0, 0.01, 0.3, 0.5])
    assert simulate(system, 0.5, outputs=times).time.tolist() == times.tolist()
    assert simulate(system, 0.5, outputs=np.int64(3)).time.tolist() == [0.0, 0.25, 0.5]
    assert simulate(system, 0.1).time.shape == (1001,)
    assert run.statistics["steps"] > 0
    assert (run.statistics["solver"], run.statistics["method"]) == ("auto", "rodas5p")
    assert run.statistics["right_hand_sides"] > run.statistics["steps"]


def test_outputs_do_not_change_the_motion():
    system = oscillator(amplitude=0.5e-3)
    few = simulate(system, 2.0, outputs=[0.0, 1.3, 2.0])
    many = simulate(system, 2.0, outputs=np.unique([*np.linspace(0.0, 2.0, 777), 1.3]))
    assert few.states[-1] == pytest.approx(many.states[-1], rel=1e-12, abs=1e-20)
    assert few.states[1] == pytest.approx(many.states[many.time == 1.3][0], rel=1e-12, abs=1e-20)


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
def test_interrupted_runs_keep_what_they_have(method):
    seen = []

    def stop(time):
        seen.append(time)
        if time > 0.3:
            raise KeyboardInterrupt

    run = simulate(oscillator(), 1.0, outputs=101, solver=Scipy(method), progress=stop)
    assert run.status is Status.INTERRUPTED
    assert "interrupted" in run.status.value
    assert (np.diff(seen) > 0.0).all()
    assert run.time[-1] == seen[-1]  # the last state, though it is no output
    assert len(run.time) == len(run.states) == len(run.work) < 101
    whole = simulate(oscillator(), 1.0, outputs=101, solver=Scipy(method))
    kept = len(run.time) - 1
    assert (run.time[:kept] == whole.time[:kept]).all()
    assert run.states[:kept] == pytest.approx(whole.states[:kept], rel=1e-12, abs=1e-20)
    assert run.energies.imbalance < 1e-3


def test_interrupted_at_once():
    def stop(_):
        raise KeyboardInterrupt

    run = simulate(oscillator(), 100.0, outputs=3, progress=stop)
    assert run.status is Status.INTERRUPTED
    assert len(run.time) == 2
    assert run.time[0] == 0.0 < run.time[1] < 50.0
    assert run.energies.imbalance < 1e-3
    assert run.contact_state.shape == (2, 1)


def test_a_run_goes_on_where_it_was_interrupted():
    def stop(time):
        raise KeyboardInterrupt

    part = simulate(oscillator(), 10.0, outputs=3, progress=stop)
    assert part.status is Status.INTERRUPTED
    rest = simulate(oscillator(), 10.0, initial=part, outputs=3)
    assert 10.0 > rest.time[0] == part.time[-1] > 0.0
    whole = simulate(oscillator(), 10.0, outputs=3)
    assert rest.states[-1] == pytest.approx(whole.states[-1], rel=1e-4, abs=1e-9)


def test_a_checkpoint_goes_on_bit_for_bit(tmp_path):
    path = tmp_path / "run.checkpoint"

    def stop(time):
        raise KeyboardInterrupt

    part = simulate(oscillator(), 10.0, outputs=21, progress=stop, solver=Rodas5P(path))
    assert part.status is Status.INTERRUPTED
    assert 0.0 < part.time[-1] < 10.0
    with pytest.raises(InputError, match="checkpoint of another run"):
        simulate(oscillator(), 10.0, outputs=21, solver=Rodas5P(path), rtol=1e-5)
    rest = simulate(oscillator(), 10.0, outputs=21, solver=Rodas5P(path))
    whole = simulate(oscillator(), 10.0, outputs=21)
    assert (rest.states == whole.states).all()
    assert (rest.work == whole.work).all()
    assert not path.exists()
    path.write_text("no checkpoint")
    with pytest.raises(InputError, match="not a checkpoint"):
        simulate(oscillator(), 10.0, outputs=21, solver=Rodas5P(path))


def test_a_checkpoint_that_cannot_be_written_does_not_end_a_run(tmp_path, monkeypatch):
    from fecontact.integrate.rodas5p import checkpoint

    def full(path):
        raise InputError(f"{path} cannot be written (no space left on device).")

    def stop(time):
        raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint, "replaced", full)
    monkeypatch.setattr(checkpoint.Checkpoint, "period", -1.0)
    solver = Rodas5P(tmp_path / "run.checkpoint")
    whole = simulate(oscillator(), 10.0, outputs=21)
    assert (simulate(oscillator(), 10.0, outputs=21, solver=solver).states == whole.states).all()
    part = simulate(oscillator(), 10.0, outputs=21, progress=stop, solver=solver)
    assert part.status is Status.INTERRUPTED
    assert part.statistics["message"].endswith("cannot be written (no space left on device).")


def test_other_errors_in_progress_are_passed_on():
    def fail(_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        simulate(oscillator(), 1.0, outputs=3, progress=fail)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
@pytest.mark.parametrize(("method", "tolerance"), [
    ("Radau", 3e-4), ("BDF", 1.5e-2), ("LSODA", 5e-3)])
def test_a_motion_that_grows_beyond_all_numbers(method, tolerance):
    rows = np.array([[[0.0], [1.0], [0.0]]])
    basis = basis_from_matrices([[1.0]], [[1.0]], {"contact": rows}, damping=[[-1e4]])
    run = simulate(ContactSystem(basis, SURFACE, friction=ExponentialFriction(0.8, 0.55, 1e3)), 1.0,
                   initial=np.array([1.0, 0.0]), outputs=10001, solver=Scipy(method))
    assert run.status is Status.FAILED
    assert "message" in run.statistics
    assert run.statistics["steps"] < 20000
    assert 0.01 < run.time[-1] < 0.1
    assert np.isfinite(run.states).all()
    # x'' - 1e4 x' + x = 0 from x = 1: x' = -(exp(1e4 t) - 1) / 1e4, near enough.
    early = run.time < 1e-3
    assert run.velocity(0)[early, 1] == pytest.approx(
        -1e-4 * np.expm1(1e4 * run.time[early]), rel=tolerance)


@pytest.mark.parametrize(("options", "message"), [
    ({"rtol": 0.0}, r"rtol = 0\.0"), ({"rtol": 0.1}, r"rtol = 0\.1"), ({"rtol": 1e-15}, "1e-15"),
    ({"rtol": float("nan")}, "rtol = nan"), ({"rtol": "fine"}, "rtol = 'fine'"),
    ({"solver": "radau"}, r"solver = 'radau' must be a solver with its options: one of Auto\(\), "),
    ({"solver": Scipy}, r"solver = Scipy must be"), ({"solver": None}, "solver = None"),
    ({"outputs": 1}, "outputs = 1"), ({"outputs": True}, "outputs"), ({"outputs": 2.5}, "outputs"),
    ({"outputs": [0.0, 0.5]}, "t_end"), ({"outputs": [0.1, 1.0]}, "outputs"),
    ({"outputs": [0.0, 0.5, 0.5, 1.0]}, "ascending"), ({"outputs": [[0.0, 1.0]]}, "outputs"),
    ({"outputs": [0.0, float("nan"), 1.0]}, "outputs"), ({"outputs": "many"}, "outputs"),
    ({"t_start": 1.0}, r"t_end = 1\.0 must be a finite time after t_start = 1\.0"),
    ({"t_start": float("-inf")}, "t_end"), ({"t_start": "now"}, "t_start = 'now'"),
    ({"initial": "resting"}, "did you mean 'rest'"), ({"initial": np.zeros(3)}, "4 values"),
    ({"initial": [0.0, 0.0, 0.0, float("nan")]}, "must be finite"),
    ({"initial": {}}, "initial = {}"),
    ({"initial": None}, "initial = None must be 'rest'"),
    ({"initial": np.full(4, 1j)}, r"initial = .* an array of real numbers"),
])
def test_options_are_checked(options, message):
    with pytest.raises(InputError, match=message):
        simulate(oscillator(), **{"t_end": 1.0, **options})


@pytest.mark.parametrize("motion", [(0.0, 0.0), "far", (0.0, float("inf"), 0.0), (1j, 0.0, 0.0)])
def test_rigid_starts_are_checked(motion):
    with pytest.raises(InputError, match=r"displacement = .* three finite numbers"):
        RigidStart(motion)
    with pytest.raises(InputError, match=r"velocity = .* three finite numbers"):
        RigidStart(velocity=motion)


def test_trajectories_of_another_system_do_not_start_this_one():
    run = simulate(mass_in_y(), 0.01, outputs=2)
    with pytest.raises(InputError, match="4 values"):
        simulate(oscillator(), 1.0, initial=run)


def test_no_equilibrium_to_start_from():
    with pytest.raises(AnalysisError, match="no static equilibrium"):
        simulate(mass_in_y(load=Load(-1.0)), 1.0)
    with pytest.raises(AnalysisError, match="wavy ground"):
        simulate(mass_in_y(ground=Ground(amplitude=1e-6)), 1.0, initial="sliding")
