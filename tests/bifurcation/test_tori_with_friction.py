"""Tori of a friction oscillator on wavy ground with a drive of another frequency."""

import numpy as np
import pytest
from systems import basis

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    TorusBalance,
    contact_field,
    orbit_branch,
    periodic_motion,
    torus_branch,
    torus_motion,
)
from fecontact.core.errors import InputError
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    JenkinsFriction,
    LuGreFriction,
    RoughSurface,
)

DRIVE_HZ, WAVES_HZ = np.sqrt(13.0), 2.5


def oscillator(amplitude, friction=None):
    """A block on wavy ground, held by a driven spring; it sticks at times from 0.4 mm on."""
    r = 1.0 / np.sqrt(5.632)
    shape = [[r, 0.0], [0.0, r]]
    return fc.ContactSystem(
        basis([0.0, 0.0], [0.0, 0.0], shape, shape), normal=RoughSurface(10e6, 10e-6, 40.0),
        friction=friction or ConstantFriction(0.4, 2e3),
        ground=fc.Ground(speed=10e-3, amplitude=3e-6, wavelength=4e-3),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=20.0, amplitude_x=amplitude,
                       frequency_hz=DRIVE_HZ), load=fc.Load(14.0))


LUGRE = LuGreFriction(0.4, 0.4, 1e-2, 1.0, bristle_stiffness=2e4, bristle_damping=10.0)


def steady(system, begin=25.0, time=10.0):
    run = fc.simulate(system, begin + time, rtol=1e-9,
                      outputs=np.append(0.0, np.linspace(begin, begin + time, 3001)))
    return run.between(begin)


def misfit(motion, run):
    """Largest difference of the motion from a run, at the same times, in the ranges of states."""
    return np.abs(motion.states(run.time) - run.states).max(axis=0) / np.ptp(run.states, axis=0)


@pytest.fixture(scope="module")
def sticking():
    system = oscillator(0.5e-3)
    return system, steady(system)


def test_harmonics_converge_to_a_long_run_that_sticks_and_slips(sticking):
    system, run = sticking
    slip = run.states[:, 2] / np.sqrt(5.632) - 10e-3
    assert np.abs(slip).min() < 0.02 * 10e-3 < 10e-3 < np.abs(slip).max()
    found = []
    for H in (5, 9):
        point = torus_branch(contact_field(system, ["drive.amplitude_x"]), run, second="drive",
                             method=TorusBalance((H, H)),
                             options=ContinuationOptions(points=1)).points[0]
        found.append((misfit(torus_motion(point), run).max(), point))
    assert found[1][0] < 0.03
    assert found[1][0] < 0.6 * found[0][0]
    point = found[1][1]
    assert point.values["stable"]
    assert [point.values[f"frequency_{k}"] for k in (1, 2)] == pytest.approx([WAVES_HZ, DRIVE_HZ])
    # Displacements have no kinks, and extremes over the torus are those of long runs.
    assert misfit(torus_motion(point), run)[:2].max() < 5e-3
    assert point.values["maximum"][0] == pytest.approx(run.states[:, 0].max(), rel=0.02)
    assert point.values["truncation_error"] < found[0][1].values["truncation_error"]


@pytest.mark.parametrize("name", ["drive.frequency_hz", "ground.speed"])
def test_tori_over_a_frequency(name):
    system = oscillator(0.2e-3)
    value = DRIVE_HZ if name.startswith("drive") else 10e-3
    end = 1.05 * value
    branch = torus_branch(contact_field(system, [name]), steady(system), second="drive",
                          method=TorusBalance((4, 4)), bounds=(value, end))
    last = branch.points[-1]
    assert last.parameter == pytest.approx(end)
    moved = system.with_({name: end})
    assert misfit(torus_motion(last), steady(moved)).max() < 0.02


def test_a_bristle_is_a_series_too():
    system = oscillator(0.6e-3, LUGRE)
    run = steady(system)
    assert np.ptp(run.states[:, 4]) > 1e-5
    point = torus_branch(contact_field(system, ["drive.amplitude_x"]), run, second="drive",
                         method=TorusBalance((9, 9)),
                         options=ContinuationOptions(points=1)).points[0]
    off = misfit(torus_motion(point), run)
    assert off[:2].max() < 0.02
    # The bristle turns over within a hundredth of a period, where its series overshoots.
    far = np.abs(torus_motion(point).states(run.time) - run.states)[:, 4].mean()
    assert far < 0.08 * np.ptp(run.states[:, 4])


def test_waves_that_entrain_a_friction_vibration_end_its_torus():
    r = 1.0 / np.sqrt(5.632)
    shape = [[r, 0.0], [0.0, r]]
    system = fc.ContactSystem(
        basis([0.0, 0.0], [0.0, 0.0], shape, shape), normal=RoughSurface(10e6, 10e-6, 40.0),
        friction=ExponentialFriction(0.8, 0.55, 50.0, 1e3),
        ground=fc.Ground(speed=20e-3, amplitude=31e-6, wavelength=4.4e-3),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=20.0), load=fc.Load(14.0))
    field = contact_field(system, ["ground.amplitude"])
    tori = torus_branch(field, steady(system, 60.0, 20.0), bounds=(30e-6, 38e-6),
                        method=TorusBalance((6, 6)))
    assert tori.status is BranchStatus.SINGLE_FREQUENCY
    high = contact_field(system.with_({"ground.amplitude": 35e-6}), ["ground.amplitude"])
    orbits = orbit_branch(high, periodic_motion(high, transient=60.0), bounds=(32e-6, 38e-6),
                          direction=-1.0)
    born, = orbits.of_kind("Neimark-Sacker")
    assert tori.points[-1].parameter == pytest.approx(born.parameter, rel=1e-4)


def test_the_ground_may_be_the_second_frequency_only_by_name():
    system = oscillator(0.2e-3)
    field = contact_field(system, ["drive.amplitude_x"])
    with pytest.raises(InputError, match="the ground is always the first"):
        torus_branch(field, steady(system, 1.0, 1.0), second="ground")
    with pytest.raises(InputError, match=r"'ground\.profile'"):
        torus_branch(field, steady(system, 1.0, 1.0), second="load")


@pytest.mark.parametrize(("amplitude", "most"), [(0.2e-3, 1e-6), (0.5e-3, 0.02)])
def test_an_element_slides_on_waves(amplitude, most):
    system = oscillator(amplitude, JenkinsFriction(1e5, 0.4))
    run = steady(system)
    point = torus_branch(contact_field(system, ["drive.amplitude_x"]), run, second="drive",
                         method=TorusBalance(9, 60),
                         options=ContinuationOptions(points=1)).points[0]
    assert misfit(torus_motion(point), run)[:4].max() < most
    assert point.values["truncation_error"] < most
    assert point.values["stable"]
