"""Section 4.2 of the source: regimes of a pendulum that strikes a stop, on mesh and two modes."""

from dataclasses import replace
from pathlib import Path

import impact_calibration as calibration
import impact_oscillator as impact
import numpy as np
import pytest
from systems import TURN

from fecontact import ensemble, read_mesh, simulate
from fecontact.analysis import count_periods, periodicity, strobed_states
from fecontact.analysis.periodicity import drive_period
from fecontact.integrate import Scipy

MESH = Path(__file__).parents[2] / "meshes" / "impact_pendulum.msh"
PERIODS = {64.32: 1, 30.84: 2, 37.41: 4, 23.63: None, 9.845: 1}
STARTS = ((0.0, 0.0), (4e-4, 0.0), (1e-4, -0.02))  # height [m], velocity [m/s]


def driven(system, frequency):
    return system.with_(**{"drive.frequency_hz": frequency / TURN})


def settled_regime(system, height=0.0, velocity=0.0):
    period = drive_period(system)
    run = impact.settled(system, impact.start(system, height, velocity),
                         transient=round(18.0 / period), periods=26, per_period=int(period / 1e-4))
    return impact.regime(run), run


def assert_is_reported(found, run, frequency):
    chatters = frequency == 9.845
    assert len(found.rests) == (26 if chatters else 0)
    if chatters:
        # With one bending mode the ripple left at lift-off wanders for tens of seconds, and
        # rounding decides for how long: each period is like the one before, to within 3 %.
        assert periodicity(run, t_start=float(run.time[0]), largest=1).misfit < 0.03
        assert (found.per_period >= 7).all()
        return
    assert found.periodicity.periods == PERIODS[frequency]
    if PERIODS[frequency] is None:
        assert found.periodicity.misfit > 0.02
    if frequency == 64.32:
        assert (found.per_period == 1).all()


@pytest.mark.parametrize("frequency", PERIODS)
def test_two_modes_from_any_start(frequency):
    system = driven(impact.two_mode_system(), frequency)
    for begin in STARTS:
        assert_is_reported(*settled_regime(system, *begin), frequency)


@pytest.mark.parametrize("frequency", PERIODS)
def test_finite_elements_with_two_three_and_four_modes(frequency):
    for modes in (2, 3, 4):
        system = driven(impact.mesh_system(modes), frequency)
        assert system.basis.modes == modes
        found, run = settled_regime(system)
        assert_is_reported(found, run, frequency)
        if frequency == 9.845 and modes > 2:
            assert found.periodicity.periods == 1
            assert found.periodicity.misfit < 1e-4


def test_committed_mesh_is_calibrated():
    system = impact.mesh_system(4)
    numbers = calibration.modal_numbers(system.basis)
    assert numbers == pytest.approx([0.092, 230.0, 0.600], rel=1e-5)
    # The spring acts where the contact is.
    assert system.basis.T[0, 1, 0] == pytest.approx(1.0 / np.sqrt(0.092), rel=1e-5)
    assert system.basis.T[0, 1, 1] / system.basis.T[0, 1, 0] == pytest.approx(
        -0.600, rel=1e-4)
    assert np.ptp(system.basis.contact_x) + system.basis.tributary[0] == pytest.approx(0.006)


def test_calibration_finds_the_committed_mesh():
    found = calibration.calibrate()
    mesh = read_mesh(MESH)
    shape = found.shape
    assert mesh.points["C"].size == 1
    assert mesh.nodes[mesh.points["C"]][0] == pytest.approx(
        [shape.arm_length, shape.bob_height], abs=2e-8)
    assert mesh.area == pytest.approx(calibration.generate(shape).area, rel=1e-6)
    assert found.arm_mass == pytest.approx(0.122, rel=0.01)
    finer = calibration.modal_numbers(calibration.pendulum_basis(
        calibration.body_of(replace(shape, element_size=0.002)), 2))
    assert finer == pytest.approx([0.092, 230.0, 0.600], rel=1e-4)


@pytest.mark.parametrize(("frequency", "periods", "method"), [
    (64.32, 1, "Radau"), (64.32, 1, "LSODA"), (30.84, 2, "LSODA"), (37.41, 4, "LSODA")])
def test_other_integrators_keep_the_orbits(frequency, periods, method):
    """From the compiled integrator's orbit, one repetition later: the same state."""
    system = driven(impact.two_mode_system(), frequency)
    run = settled_regime(system)[1]
    period, scale = drive_period(system), np.ptp(run.states, axis=0)
    again = simulate(system, run.time[-1] + periods * period, initial=run, outputs=2,
                     solver=Scipy(method), rtol=1e-9)
    assert (np.abs(again.states[-1] - run.states[-1]) / scale).max() < 1e-4


@pytest.mark.slow
def test_another_integrator_finds_chaos_too():
    system = driven(impact.two_mode_system(), 23.63)
    run = settled_regime(system)[1]
    period, scale = drive_period(system), np.ptp(run.states, axis=0)
    times = run.time[-1] + period * np.arange(25)
    states = simulate(system, times[-1], initial=run, outputs=times, solver=Scipy("LSODA"),
                      rtol=1e-6).states
    assert count_periods(states, scale, largest=8).periods is None
    assert np.ptp(states, axis=0)[2] > 0.1 * scale[2]


def growth_of_pairs(system, state, periods, pairs, distance=1e-6):
    """Mean growth of the distance between neighbours that is put back each period (Benettin)."""
    period, scale = drive_period(system), np.ptp(state, axis=0)
    state = state[-pairs:]
    offset = distance * scale * np.random.default_rng(0).normal(size=state.shape)
    growths = np.empty((periods, pairs))
    for number in range(periods):
        ends = ensemble(system, [0.0, period], initial=np.vstack([state, state + offset]),
                        rtol=1e-9).states[:, 1]
        state, apart = ends[:pairs], ends[pairs:] - ends[:pairs]
        size = np.linalg.norm(apart / scale, axis=1)
        growths[number] = np.log(size / np.linalg.norm(offset / scale, axis=1)) / period
        offset = apart * (distance / size)[:, None]
    return growths[periods // 2:].mean()


@pytest.mark.slow
def test_exponent_of_chaos_is_the_growth_between_neighbours():
    chaotic = driven(impact.two_mode_system(), 23.63)
    found, run = settled_regime(chaotic)
    growth, error = impact.exponent(run, found, 400)
    assert 0.0 < error < 0.5
    assert growth == pytest.approx(6.0, abs=0.9)
    states = strobed_states(run, t_start=float(run.time[0])).states
    assert growth_of_pairs(chaotic, states, 48, 8) == pytest.approx(6.0, abs=1.2)


def test_exponent_of_an_orbit_is_that_of_its_floquet_multiplier():
    """Exponent by differences of neighbouring motions; at 30.84 rad/s the orbit has two periods."""
    for frequency, wanted in ((64.32, -6.254192), (30.84, -3.573516)):
        system = driven(impact.two_mode_system(), frequency)
        found, run = settled_regime(system)
        period, scale = drive_period(system) * PERIODS[frequency], np.ptp(run.states, axis=0)
        steps = 3e-5 * np.diag(scale)
        ends = ensemble(system, [0.0, period], rtol=1e-12,
                        initial=run.states[-1] + np.vstack([steps, -steps])).states[:, 1]
        multipliers = np.linalg.eigvals((ends[:4] - ends[4:]).T / (6e-5 * scale))
        growth, error = impact.exponent(run, found)
        assert growth == pytest.approx(np.log(np.abs(multipliers).max()) / period, rel=1e-4)
        assert growth == pytest.approx(wanted, rel=1e-4)
        assert np.isnan(error)
