"""The friction oscillator of section 4.3: what the source reports of it."""

from pathlib import Path

import friction_oscillator as example
import numpy as np
import pytest

import fecontact as fc
from fecontact.analysis import periodicity
from fecontact.integrate import Rodas5P, Scipy


def lengths(run):
    return np.array([slip.distance for slip in example.slips(run)])


def test_two_modes_close_one_loop_after_four_periods():
    run = example.settled(example.oscillator(2), 40, 24)
    found = periodicity(run, t_start=run.time[0], largest=6)
    assert found.periods == 4
    assert found.misfit < 1e-3
    # One slip in these four periods, always the same.
    assert len(lengths(run)) in (5, 6)
    assert example.different(lengths(run), 1e-3) == 1
    # Between slips the mass travels with the belt: slip and drag balance over the loop.
    assert lengths(run)[-1] == pytest.approx(4.0 * example.PERIOD * example.BELT_SPEED, rel=2e-3)
    assert run.normal_force == pytest.approx(14.0, abs=1e-9)


def test_rigid_mode_across_the_belt_replaces_the_iteration_for_the_normal_force():
    iterated = example.prescribed()
    assert iterated.normal.force == pytest.approx(14.0, rel=1e-9)
    resting = example.oscillator(2)
    # Uniform roughness below R_Z: F = c u^2 / (2 R_Z).
    depth = -resting.basis.T[2, 1] @ fc.equilibrium(resting).modal_coordinates
    assert depth == pytest.approx(np.sqrt(2.0 * 14.0 * 10e-6 / 10e6), rel=1e-9)
    one, two = example.settled(iterated, 4, 6), example.settled(resting, 4, 6)
    swing = np.ptp(two.displacement("B")[:, 0])
    assert np.abs(one.displacement("B") - two.displacement("B"))[:, 0].max() < 2e-4 * swing


def test_third_mode_rings_at_the_drive_after_each_slip():
    run = example.settled(example.oscillator(3), 40, 12)
    peak = example.ringing(run)
    assert example.held_frequency() == pytest.approx(27.2, abs=0.05)
    assert peak.frequency_hz == pytest.approx(example.held_frequency(), rel=3e-3)
    assert peak.value > 3e-4
    # The contact sticks, and the third mode is not seen there.
    assert example.ringing(run, 0).value < 0.01 * peak.value
    assert example.ringing(example.settled(example.oscillator(2), 40, 12)).value < 0.01 * peak.value
    # Largest just after the slip has ended, then less and less.
    end = example.slips(run)[0]
    after = run.time > end.start + end.duration
    t, v = run.time[after], run.velocity("B")[after, 0]
    swings = [np.ptp(v[(t > t[0] + delay) & (t < t[0] + delay + 0.05)]) for delay in (0, 0.5, 1)]
    assert swings[0] > 1.5 * swings[1] > 1.5 * swings[2]


def test_waves_make_several_slip_loops():
    run = example.settled(example.oscillator(3, example.WAVY), 20, 80)
    assert periodicity(run, t_start=run.time[0], largest=16).periods is None
    assert example.different(lengths(run), 0.05) >= 3
    assert np.ptp(lengths(run)) > 0.2 * lengths(run).max()
    # The waves lift and lower the body: its normal force is the load in the mean alone.
    assert run.normal_force.mean() == pytest.approx(14.0, rel=2e-3)
    assert np.ptp(run.normal_force) > 8.0
    assert run.energies.imbalance < 2e-5


def test_inclined_contact_force_changes_the_motion_over_steep_waves():
    """Slopes of 0.5: the mass slides down them, the belt's normal force works, energy is kept."""
    vertical, inclined = (example.settled(example.oscillator(3, ground), 20, 40)
                         for ground in (example.WAVY, example.INCLINED))
    assert inclined.energies.imbalance < 2e-5
    swings = [np.ptp(run.displacement("B")[:, 0]) for run in (vertical, inclined)]
    assert swings[1] > 1.8 * swings[0]
    assert len(lengths(inclined)) > 2 * len(lengths(vertical))
    slope = (2.0 * np.pi * 200e-6 / 2.5e-3) * np.cos(2.0 * np.pi / 2.5e-3 * (
        inclined.displacement(0)[:, 0] - example.BELT_SPEED * inclined.time))
    work = inclined.energies.belt_normal_work
    assert work[-1] > 0.2 * inclined.energies.belt_friction_work[-1]
    # Between impacts the outputs resolve the force: the first wave's work by quadrature.
    part = slice(0, int(np.argmax(inclined.normal_force[:, 0] > 25.0)))
    if part.stop > 200:
        power = -inclined.normal_force[part, 0] * slope[part] * example.BELT_SPEED
        found = np.trapezoid(power, inclined.time[part])
        assert found == pytest.approx(work[part.stop - 1], rel=2e-2)


@pytest.mark.parametrize("ground", [example.fourier_waves, example.spectrum_of_waves,
                                    example.random_friction])
def test_other_explanations_make_slips_of_many_lengths(ground):
    run = example.settled(example.oscillator(3, ground()), 20, 60)
    assert example.different(lengths(run), 0.05) >= 4
    assert run.energies.imbalance < 2e-5


def test_random_friction_breaks_away_at_the_coefficient_of_the_place():
    ground = example.random_friction()
    run = example.settled(example.oscillator(2, ground), 20, 40)
    variation = ground.friction_variation
    slips = example.slips(run)
    assert len(slips) >= 10
    for slip in slips:
        k = int(np.searchsorted(run.time, slip.start))
        place = run.displacement(0)[k, 0] - example.BELT_SPEED * run.time[k]
        # The mass does not speed up yet: the spring's force is that of friction.
        force = 5610.0 * (run.displacement("B")[k, 0] - 0.5e-3 * np.sin(13.8 * run.time[k]))
        # Smoothing and the fall with velocity leave 0.778 of the static coefficient of 0.8; the
        # spring pulls harder by a percent in the time that the slip takes to begin.
        assert force == pytest.approx(14.0 * 0.778 * (1.0 + variation.height(place)), rel=0.015)


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "method", "rtol", "tolerance"), [
    (2, "Radau", 1e-6, 1e-4), (2, "LSODA", 1e-8, 1e-4), (3, "LSODA", 1e-8, 1e-4)])
def test_the_integrator_makes_no_difference(modes, method, rtol, tolerance):
    system = example.oscillator(modes)
    run, other = (example.settled(system, 12, 12, 200, **options) for options in (
        {"solver": Rodas5P()}, {"solver": Scipy(method), "rtol": rtol}))
    assert lengths(other) == pytest.approx(lengths(run), rel=tolerance)
    for point in ("B", 0):
        for end in (np.min, np.max):
            assert end(other.displacement(point)[:, 0]) == pytest.approx(
                end(run.displacement(point)[:, 0]), abs=tolerance * 1.8e-3)


def test_face_of_a_soft_block_slips_in_parts():
    block = example.soft_block(8).with_(**{"ground.speed": 1e-2})
    run = fc.simulate(block, 0.15, outputs=601, rtol=1e-5)
    assert run.status is fc.Status.FINISHED
    slipping = (run.contact_state == fc.ContactState.SLIP).mean(axis=1)
    assert ((slipping > 0.0) & (slipping < 1.0)).mean() > 0.5
    # Mass, load and frequencies of the body are those of its geometry.
    assert 1.0 / (block.basis.T[1, 1, :3] ** 2).sum() == pytest.approx(5.632, rel=1e-3)
    assert run.normal_force.sum(axis=1).mean() == pytest.approx(14.0, rel=0.02)
    assert run.friction_work[-1].sum() == pytest.approx(run.energies.friction[-1], rel=1e-6)
    # Nodes of a block of steel slip together, but for moments.
    stiff = example.soft_block(8, 2.1e11).with_(**{"ground.speed": 1e-2})
    rigid = fc.simulate(stiff, 0.15, outputs=601, rtol=1e-5)
    parts = (rigid.contact_state == fc.ContactState.SLIP).mean(axis=1)
    assert ((parts > 0.0) & (parts < 1.0)).mean() < 0.1


def test_study_file_runs(tmp_path):
    study = fc.Study.read(Path(__file__).parents[2] / "examples" / "friction_oscillator.toml")
    system = study.system()
    x = system.basis.T[1, 0]
    assert 1.0 / float(x[:1] @ x[:1]) == pytest.approx(5.632, rel=1e-4)
    run = study.with_(**{"simulation.t_end": 1.0, "simulation.outputs": 501}).run()
    assert run.status is fc.Status.FINISHED
    assert run.normal_force.sum(axis=1).mean() == pytest.approx(14.0, rel=1e-2)
