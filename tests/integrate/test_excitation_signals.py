"""Drives, loads and ground motions that are given in time, in runs with closed-form answers."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.integrate import Scipy
from fecontact.integrate.run_limits import longest_step
from fecontact.laws import (
    Constant,
    ConstantFriction,
    ExponentialFriction,
    Harmonic,
    PrescribedForce,
    Pulse,
    RoughSurface,
    Sine,
    SpeedRamp,
    SweptSine,
)

MASS, STIFFNESS, DASHPOT = 2.0, 800.0, 3.0


def point(**parts):
    """A mass on the drive's spring and dashpot, moving along x alone."""
    basis = fc.basis_from_matrices(
        [[MASS]], [[0.0]], {"contact": [[[1.0], [0.0], [0.0]]], "B": [[1.0], [0.0], [0.0]],
                            "C": [[1.0], [0.0], [0.0]]})
    options = {"normal": PrescribedForce(1e-12), "drive": fc.Drive(
        stiffness_x=STIFFNESS, damping_x=DASHPOT)} | parts
    return fc.ContactSystem(basis, **{"friction": ExponentialFriction(0.8, 0.55, 1e3), **options})


def oscillator(force, times, dashpot=DASHPOT):
    """Displacement of the oscillator under a force (function of time), by fine quadrature."""
    w0 = np.sqrt(STIFFNESS / MASS)
    D = dashpot / (2.0 * MASS * w0)
    wd = w0 * np.sqrt(1.0 - D**2)
    result = []
    for t in times:
        s, weights = np.polynomial.legendre.leggauss(60)
        total = 0.0
        for low, high in zip(np.linspace(0, t, 41)[:-1], np.linspace(0, t, 41)[1:], strict=True):
            tau = 0.5 * (high - low) * s + 0.5 * (high + low)
            impulse = np.exp(-D * w0 * (t - tau)) * np.sin(wd * (t - tau)) / (MASS * wd)
            total += 0.5 * (high - low) * (weights * impulse * force(tau)).sum()
        result.append(total)
    return np.array(result)


def run(system, times):
    return fc.simulate(system, times[-1], initial=np.zeros(2), outputs=times, rtol=1e-9)


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
def test_a_load_pulse_is_not_stepped_over(method):
    """A half-sine shock of 2 ms in the middle of a run of 2 s: Duhamel's integral."""
    pulse = Pulse("half-sine", amplitude=500.0, duration=2e-3, start=0.4)
    system = point(load=fc.Load(forces=(fc.PointLoad("C", "x", signal=pulse),)))
    times = np.array([0.0, 0.3, 0.401, 0.6, 1.0])
    found = fc.simulate(system, 1.0, initial=np.zeros(2), outputs=times, rtol=1e-8,
                        solver=Scipy(method)).displacement("B")[:, 0]
    s, weights = np.polynomial.legendre.leggauss(40)
    w0 = np.sqrt(STIFFNESS / MASS)
    D = DASHPOT / (2.0 * MASS * w0)
    wd = w0 * np.sqrt(1.0 - D**2)
    wanted = []
    for t in times:
        high = min(max(t, 0.4), 0.402)
        tau = 0.5 * (high - 0.4) * s + 0.5 * (high + 0.4)
        impulse = np.exp(-D * w0 * (t - tau)) * np.sin(wd * (t - tau)) / (MASS * wd)
        wanted.append(0.5 * (high - 0.4) * (
            weights * impulse * 500.0 * np.sin(np.pi * (tau - 0.4) / 2e-3)).sum())
    assert found == pytest.approx(wanted, abs=2e-5 * np.abs(wanted).max())


def test_sweep_of_the_drive():
    sweep = SweptSine(amplitude=1e-3, start_frequency_hz=1.0, end_frequency_hz=6.0, duration=2.0)
    system = point(drive=fc.Drive(stiffness_x=STIFFNESS, damping_x=DASHPOT, motion_x=sweep))
    times = np.linspace(0.0, 2.0, 9)
    wanted = oscillator(lambda t: STIFFNESS * 1e-3 * np.sin(
        2.0 * np.pi * (1.0 * t + 0.5 * 5.0 / 2.0 * t**2)), times)
    result = run(system, times)
    assert result.displacement("B")[:, 0] == pytest.approx(wanted, abs=1e-5 * 1e-3)
    assert np.abs(result.energies.imbalance).max() < 1e-6 * result.energies.dashpots[-1]


def test_belt_that_starts_and_oscillates():
    """Viscous friction R = d (x' - V(t)): a linear oscillator driven by the belt's speed."""
    d, N = 5.0, 10.0
    friction = ConstantFriction(friction_coefficient=0.0, viscous_coefficient=d / N)
    motion = SpeedRamp(end_speed=0.3, start=0.2, duration=0.5)
    system = point(normal=PrescribedForce(N), friction=friction,
                   ground=fc.Ground(speed=0.1, motion=motion))
    times = np.linspace(0.0, 1.5, 7)

    def speed(t):
        return 0.1 + 0.2 * np.clip((t - 0.2) / 0.5, 0.0, 1.0)

    wanted = oscillator(lambda t: d * speed(t), times, DASHPOT + d)
    result = run(system, times)
    assert result.displacement("B")[:, 0] == pytest.approx(wanted, abs=3e-4 * wanted.max())
    assert result.slip_velocity[:, 0] == pytest.approx(
        result.velocity("B")[:, 0] - speed(times), abs=1e-12)
    energies = result.energies
    assert np.abs(energies.imbalance).max() < 1e-5 * energies.friction[-1]


def test_friction_varies_along_the_ground():
    """Coulomb friction on ground whose coefficient is a sine of the place: work of one wave."""
    variation = Sine(amplitude=0.5, wavelength=0.01)
    law = ConstantFriction(friction_coefficient=0.4, smoothing_slope=1e6)
    system = point(normal=PrescribedForce(10.0), friction=law,
                   ground=fc.Ground(speed=0.1, friction_variation=variation))
    history = [system.contact_history(np.array([t]), np.zeros((1, 2)))[0, 0, 1]
               for t in np.linspace(0.0, 0.1, 21)]
    places = -0.1 * np.linspace(0.0, 0.1, 21)
    wanted = -4.0 * (1.0 + 0.5 * np.sin(2.0 * np.pi * places / 0.01))
    assert history == pytest.approx(wanted, rel=1e-5)


def test_moment_and_constant_loads_at_points():
    basis = fc.basis_from_matrices(
        np.diag([2.0, 2.0, 0.01]), np.diag([0.0, 0.0, 50.0]),
        {"contact": [[[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]],
         "C": [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]], "tip": [[1.0, 0, -0.2], [0, 1, 0.1], [0, 0, 1]]})
    system = fc.ContactSystem(basis, normal=RoughSurface(1e6, 1e-5, 500.0), load=fc.Load(
        normal=20.0, forces=(
            fc.PointLoad("tip", "phi", signal=Constant(0.5)),
            fc.PointLoad("tip", "y", signal=Constant(-3.0)))),
            friction=ExponentialFriction(0.8, 0.55, 1e3))
    start = fc.simulate(system, 1e-3, outputs=2)
    turn = (0.5 - 3.0 * 0.1) / 50.0
    assert start.displacement("C")[0, 2] == pytest.approx(turn, rel=1e-8)
    assert start.normal_force[0, 0] == pytest.approx(23.0, rel=1e-9)
    assert start.displacement("C")[1, 2] == pytest.approx(turn, rel=1e-8)


def test_longest_steps_resolve_what_is_given_in_time():
    """Parts of the shortest period, and of the time in which a wave passes; a given limit."""
    def loaded(signal):
        return fc.Load(forces=(fc.PointLoad(point="C", component="x", signal=signal),))

    times = np.array([0.0, 10.0])
    cases = {
        0.5: point(drive=fc.Drive(stiffness_x=1.0, amplitude_x=1e-3,
                                  frequency_hz=4.0 * np.pi / TURN)),
        0.25: point(drive=fc.Drive(stiffness_x=1.0, motion_x=Harmonic(1e-3, 8.0 * np.pi / TURN)),
                    load=loaded(Harmonic(1.0, np.pi / TURN))),
        0.2: point(load=loaded(Harmonic(1.0, 10.0 * np.pi / TURN))),
        0.1: point(ground=fc.Ground(speed=0.2, amplitude=1e-6, wavelength=0.02)),
        # The drive does not move: its frequency does not count.
        np.inf: point(drive=fc.Drive(stiffness_x=1.0, frequency_hz=4.0 * np.pi / TURN)),
    }
    for period, system in cases.items():
        for most, parts in ((0.06, (1.0, 4.0)), (0.02, (50.0, 20.0))):
            longest = min(10.0 / parts[0], period / parts[1])
            assert longest_step(system, times, None, *parts) == pytest.approx(longest)
            assert longest_step(system, times, most, *parts) == pytest.approx(min(most, longest))
    ramp = point(ground=fc.Ground(speed=0.2, amplitude=1e-6, wavelength=0.02,
                                  motion=SpeedRamp(0.8, start=1.0, duration=1.0)))
    assert ramp.shortest_period(0.0, 10.0) == pytest.approx(0.02 / 0.8)
    assert ramp.shortest_period(0.0, 1.0) == pytest.approx(0.1)
