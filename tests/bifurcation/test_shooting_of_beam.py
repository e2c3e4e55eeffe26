"""Shooting with many states: a beam of 20 modes on 40 contact nodes that sticks and slips."""


import beam_stick_slip as example
import numpy as np
import pytest

from fecontact import InputError, sensitivity, simulate
from fecontact.bifurcation import contact_field

SPEED = 0.05


@pytest.fixture(scope="module")
def motion():
    return example.stick_slip(SPEED)


def distance(found, wanted, modes):
    """Largest distance in units of the largest displacement and the largest velocity."""
    sizes = np.repeat([np.abs(wanted[:modes]).max(), np.abs(wanted[modes:]).max()], modes)
    return np.abs((found - wanted) / sizes).max()


def at(motion, phase):
    """State at a part of the period; about 0.9 to 1.2 the beam sticks."""
    return motion.states[np.searchsorted(motion.times, motion.times[0] + phase * motion.period)]


@pytest.mark.parametrize(("phase", "within"), [(0.05, 2e-5), (0.53, 1e-7), (0.25, 1e-5)],
                         ids=["stick", "slip", "letting go"])
def test_the_flow_carries_its_own_direction_along(motion, phase, within):
    system = example.beam(SPEED)
    found = sensitivity(system, 2e-3, initial=at(motion, phase), rtol=1e-9, derivative_rtol=1e-4)
    rates = contact_field(system, {}).rates(np.zeros(2), found.states, np.zeros(0))
    assert distance(found.monodromy @ rates[0], rates[1], system.basis.modes) < within


def test_derivatives_are_differences_of_runs(motion):
    start, t_end = at(motion, 0.53), 2e-3
    system = example.beam(SPEED)
    modes = system.basis.modes
    found = sensitivity(system, t_end, initial=start, parameter="load.normal", rtol=1e-10)

    def end(state, load=14.0):
        return simulate(system.with_(**{"load.normal": load}), t_end, initial=state, outputs=2,
                        rtol=1e-12).states[-1]

    frequencies = np.maximum(system.basis.angular_frequencies, 100.0)
    for seed in range(2):
        move = 1e-5 * np.random.default_rng(seed).normal(size=2 * modes)
        move[:modes] /= frequencies
        wanted = (end(start + move) - end(start - move)) / 2.0
        assert distance(found.monodromy @ move, wanted, modes) < 1e-4
    wanted = (end(start, 14.0 + 1e-3) - end(start, 14.0 - 1e-3)) / 2e-3
    assert distance(found.parameter_derivative, wanted, modes) < 1e-4


def test_loose_derivatives_keep_the_multipliers(motion):
    system = example.beam(SPEED)
    start = motion.states[-1]
    tight, loose = (sensitivity(system, motion.period, initial=start, rtol=1e-8,
                                derivative_rtol=rtol).monodromy for rtol in (None, 1e-2))
    largest, others = (np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1][:5]
                       for matrix in (tight, loose))
    assert others == pytest.approx(largest, rel=2e-5)
    assert others[0] == pytest.approx(1.0, abs=1e-4)
    with pytest.raises(InputError, match="derivative_rtol = 2"):
        sensitivity(system, 1.0, derivative_rtol=2.0)


def test_orbits_are_those_of_runs(motion):
    branch = example.orbits(motion, SPEED, bounds=(SPEED, 0.052), both=False)
    first, last = branch.points[0], branch.points[-1]
    assert last.parameter == pytest.approx(0.052, rel=1e-9)
    for point, run in ((first, motion), (last, example.stick_slip(0.052))):
        assert point.values["period"] == pytest.approx(run.period, rel=1e-6)
        assert point.values["stable"]
        assert point.values["trivial_error"] < 2e-4
    # Friction and damping take out the work that belt and spring put in over a period.
    run = simulate(example.beam(SPEED), first.values["period"], initial=first.u[:40], rtol=1e-8)
    energies = run.energies
    assert energies.work[-1] > np.ptp(energies.stored)
    assert energies.work[-1] == pytest.approx(energies.lost[-1], rel=1e-5)
