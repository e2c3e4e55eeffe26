"""Canard explosions: orbits that grow while the parameter stands still to within rounding."""

import time

import numpy as np
import pytest

from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)


def vanderpol(t, x, p, out):
    """Van der Pol's oscillator with a slow drift: its Hopf point is at a = 1."""
    out[0] = x[1] - (x[0] ** 3 / 3.0 - x[0])
    out[1] = p[1] * (p[0] - x[0])


def explosion(slowness, intervals, locate=True):
    field = vector_field(vanderpol, {"a": 1.2, "slowness": slowness}, ["x", "y"])
    resting = equilibrium_branch(field, [1.2, 1.2**3 / 3.0 - 1.2], "a", bounds=(0.5, 1.3),
                                 direction=-1.0)
    hopf = resting.of_kind("Hopf")[0]
    assert hopf.parameter == pytest.approx(1.0, abs=1e-10)
    begin = time.process_time()
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=intervals), bounds=(0.5, 1.3),
                          options=ContinuationOptions(points=500, locate=locate), width=0.1)
    return orbits, time.process_time() - begin


@pytest.mark.parametrize(("slowness", "intervals"),
                         [(0.05, 40), (0.03, 40), (0.03, 160), (0.02, 80), (0.01, 80), (0.01, 160)])
def test_explosions_have_no_false_folds(slowness, intervals):
    orbits, _ = explosion(slowness, intervals)
    # It ends at the bound, far beyond the explosion, without any special point.
    assert orbits.status is BranchStatus.BOUND
    assert orbits.special == ()
    assert orbits.column("stable").all()
    amplitude = np.ptp([orbits.column("minimum")[:, 0], orbits.column("maximum")[:, 0]], axis=0)
    steep = (amplitude > 1.6) & (amplitude < 3.6)
    assert steep.sum() > 15
    assert amplitude[-1] == pytest.approx(4.0, abs=0.05)
    # Steep part: 1 - e / 8 - 3 e^2 / 32 - 173 e^3 / 1024, and something of order e^4.
    e = slowness
    series = 1.0 - e / 8.0 - 3.0 * e**2 / 32.0 - 173.0 * e**3 / 1024.0
    at = np.median(orbits.parameter[steep])
    assert -0.65 < (at - series) / e**4 < -0.4
    # The message of the branch says so.
    lost = orbits.column("trivial_error") > 0.1
    assert f"Multipliers of {lost.sum()} orbits are lost in rounding" in orbits.message


@pytest.mark.slow
def test_location_costs_little_on_an_explosion():
    pairs = [[explosion(0.02, 80, locate)[1] for locate in (False, True)] for _ in range(3)]
    # Searches for special points that rounding feigns took some fifteen times as long.
    assert np.median([there / here for here, there in pairs]) < 2.5


def test_branches_with_sound_multipliers_have_no_note():
    field = vector_field(vanderpol, {"a": 0.0, "slowness": 1.0}, ["x", "y"])
    resting = equilibrium_branch(field, [0.0, 0.0], "a", bounds=(-0.5, 1.3))
    orbits = orbit_branch(field, resting.of_kind("Hopf")[0], bounds=(0.5, 1.3))
    assert orbits.message == ""


def fitzhugh_nagumo(t, x, p, out):
    out[0] = x[0] - x[0] ** 3 / 3.0 - x[1] + p[0]
    out[1] = p[1] * (x[0] + 0.7 - 0.8 * x[1])


def cycles_of_nerves(slowness):
    field = vector_field(fitzhugh_nagumo, {"I": 0.2, "slowness": slowness}, ["v", "w"])
    resting = equilibrium_branch(field, [-1.1, -0.5], "I", bounds=(0.1, 0.8))
    hopf = resting.of_kind("Hopf")[0]
    assert hopf.criticality == "subcritical"
    return hopf, orbit_branch(field, hopf, bounds=(0.1, 0.8), width=0.1,
                              options=ContinuationOptions(points=400))


def test_folds_that_rounding_leaves_are_found():
    hopf, orbits = cycles_of_nerves(0.25)
    (fold,) = orbits.of_kind("fold")
    assert fold.parameter < hopf.parameter
    assert fold.parameter == pytest.approx(min(orbits.parameter), abs=1e-8)
    stable = orbits.column("stable")
    amplitude = np.ptp([orbits.column("minimum")[:, 0], orbits.column("maximum")[:, 0]], axis=0)
    at = np.ptp([fold.values["minimum"][0], fold.values["maximum"][0]])
    assert not stable[amplitude < 0.99 * at].any()
    assert orbits.points[len(orbits) // 2].values["stable"]


def test_a_fold_lost_in_rounding_is_marked():
    # Of cycles of the slow nerve the parameter turns within 1e-9 of itself.
    hopf, orbits = cycles_of_nerves(0.08)
    (turn,) = orbits.special
    assert turn.kind == "unresolved"
    assert (turn.unstable_before, turn.unstable_after) == (1, 0)
    assert turn.parameter == pytest.approx(min(orbits.parameter), abs=1e-8)
    assert turn.parameter < hopf.parameter
    assert turn.parameter_error < 1e-8
    assert orbits.message.startswith("Multipliers of ")
