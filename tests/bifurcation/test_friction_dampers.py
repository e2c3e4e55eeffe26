"""Elastic bodies with friction dampers by harmonic balance: closed form, symmetry, runs in time."""

import blade_pair
import friction_damper
import numpy as np
import pytest

from fecontact import Material, simulate
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)

TURN = 2.0 * np.pi
END = ("first.end", "y")
BEST = blade_pair.BEST


def orbit(field, parameter, seen, hz, method):
    """The orbit from rest at a frequency."""
    return frequency_response(
        field, (hz, 1.02 * hz), parameter, observe=seen, method=method,
        options=ContinuationOptions(points=1)).branches[0].points[0]


def last_of_run(field, point, hz, count):
    """States of the last of some periods of a run from an orbit, and how far it still moves."""
    system = field.system(point.parameter_values(field))
    ends = simulate(system, count / hz, initial=point.orbit(field).states[0], rtol=1e-8,
                    outputs=np.array([0.0, (count - 1) / hz, count / hz])).states
    run = simulate(system, 1.0 / hz, initial=ends[-1], rtol=1e-8, outputs=2001)
    return run.states, ends[-1] - ends[-2]


def blades(angle=np.pi, load=BEST, hz=357.0):
    system = blade_pair.blade_pair(load, angle)
    return contact_field(system, {blade_pair.FREQUENCY: (hz, blade_pair.excited_at)})


def test_best_load_of_blades_in_opposition_has_its_closed_form():
    """4 S (A - S / k) + pi c w A^2 = pi F A with the plate at rest, at S = pi F / 2."""
    response = blade_pair.responses([BEST], np.pi, (345.0, 370.0),
                                    HarmonicBalance(1, 512, stability=None))
    peak = response.peak()
    basis = blade_pair.blade_pair(BEST).basis
    # The first bending mode of a slender beam; both blades have it.
    L, h, steel = blade_pair.LENGTH, blade_pair.HEIGHT, Material()
    slender = 3.51602 / L**2 * np.sqrt(steel.youngs_modulus * h**2 / 12.0 / steel.density)
    near = np.abs(basis.angular_frequencies / slender - 1.0) < 5e-3
    first = int(np.argmax(np.abs(basis.point_row(*END)) * near))
    mass = 1.0 / basis.point_row(*END)[first] ** 2
    # The damping of the first mode of a free blade, c = 2 D w_1 m.
    w1 = basis.angular_frequencies[first]
    assert mass == pytest.approx(0.25 * steel.density * L * h * 0.02, rel=1e-2)
    w = TURN * peak.parameter
    loss = 2.0 * blade_pair.RATIO * w1 * mass * w
    F, k = blade_pair.FORCE, blade_pair.TANGENTIAL
    S = np.pi * F / 2.0
    exact = np.roots([np.pi * loss, 4.0 * S - np.pi * F, -4.0 * S**2 / k]).max()
    assert response.amplitude().max() == pytest.approx(exact, rel=5e-3)
    assert exact == pytest.approx(np.pi * F / k, rel=0.02)
    # Half of the stiffness of a sticking contact acts.
    assert w / w1 == pytest.approx(np.sqrt(1.0 + 0.5 * k / mass / w1**2), rel=0.02)


def test_plate_rests_between_blades_in_opposition_and_follows_equal_ones():
    method = HarmonicBalance(1, 128, stability=None)
    moved = {}
    for angle in (0.0, np.pi):
        field = blades(angle)
        states = orbit(field, None, END, 357.0, method).orbit(field).states
        rows = [field.displacement_row(f"{name}.{point}", "y")
                for name, point in (("first", "end"), ("second", "end"), ("plate", "back"))]
        moved[angle] = states @ np.stack(rows, axis=1)
    first, second, plate = moved[np.pi].T
    assert second == pytest.approx(-first, abs=1e-6 * np.abs(first).max())
    assert np.ptp(plate) < 1e-6 * np.ptp(first)
    first, second, plate = moved[0.0].T
    assert second == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert np.ptp(plate) > 0.9 * np.ptp(first)


@pytest.mark.slow
def test_blades_a_quarter_out_of_phase_are_followed_with_few_samples():
    """The plate moves and tilts, and what slides and sticks changes between samples."""
    field = blades(0.5 * np.pi, hz=380.0)
    response = frequency_response(
        field, (380.0, 430.0), observe=END, method=HarmonicBalance(
            3, 128, stability=None), options=ContinuationOptions(points=80, largest_step=0.1))
    branch = response.branches[0]
    assert branch.status is BranchStatus.BOUND
    assert (np.diff(branch.parameter) > 0.0).all()
    for k in (3, len(branch.parameter) // 2, -1):
        fine = orbit(field, None, END, branch.parameter[k], HarmonicBalance(3, 512, stability=None))
        assert response.amplitude()[k] == pytest.approx(fine.values["observed_amplitude"],
                                                        rel=2e-6)


@pytest.mark.slow
def test_blades_agree_with_a_run():
    field = blades()
    point = orbit(field, None, END, 357.0, HarmonicBalance(3, 1024, stability=None))
    row = field.displacement_row(*END)
    states, change = last_of_run(field, point, 357.0, 200)
    size = np.ptp(states @ row) / 2.0
    assert abs(change @ row) < 1e-6 * size
    assert point.values["observed_amplitude"] == pytest.approx(size, rel=3e-4)
    assert np.abs(point.orbit(field, 2001).states @ row - states @ row).max() < 2e-2 * size


def test_beam_with_a_damper_agrees_with_a_run():
    name, seen = "load.forces.0.signal.frequency_hz", ("beam.end", "y")
    system = friction_damper.damped_beam(friction_damper.BEST, 101.0).with_(
        **{"interfaces.damper.friction.smoothing_slope": 200.0})
    field = contact_field(system, [name])
    row = field.displacement_row(*seen)
    errors = []
    for H, samples in ((5, 256), (15, 512)):
        point = orbit(field, name, seen, 101.0, HarmonicBalance(H, samples, stability=None))
        if not errors:
            states, change = last_of_run(field, point, 101.0, 60)
            size = np.ptp(states @ row) / 2.0
            assert abs(change @ row) < 1e-5 * size
        errors.append(abs(point.values["observed_amplitude"] / size - 1.0))
    assert errors[0] < 1e-2
    assert errors[1] < 5e-5
