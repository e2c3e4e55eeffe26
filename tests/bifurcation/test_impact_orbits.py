"""Orbits of the impact oscillator against runs that know nothing of derivatives."""


import impact_orbits
import numpy as np
import pytest
from systems import TURN

from fecontact import sensitivity, simulate
from fecontact.bifurcation import ContinuationOptions, Shooting, orbit_branch
from fecontact.integrate import ContactEvents, strobe

# States near orbits of one period, from which Newton's method finds them.
NEAR_SINGLE = np.array([5.1745e-5, 6.98e-7, -5.14e-4, -8.89e-4])    # 39.2 rad/s
NEAR_UNSTABLE = np.array([1.989e-5, -1.2e-6, 1.13e-3, 6.2e-4])     # 30.0166 rad/s
NEAR_GRAZING = np.array([4.49523e-5, -2.348e-7, -1.77e-3, -1.08e-3])    # 33.7077 rad/s


def rounds(w, y, count, transient=0, rtol=1e-10):
    """States after each of the last periods of a run, (count, 4)."""
    return strobe(impact_orbits.oscillator(w / TURN), transient_periods=transient, keep=count,
                  initial=y, rtol=rtol).states[0]


def orbit_at(w, y):
    """The orbit of one period at w near a state, and its multipliers, the largest first."""
    for _ in range(12):
        run = sensitivity(impact_orbits.oscillator(w / TURN), TURN / w, initial=y, rtol=1e-10)
        step = np.linalg.solve(np.eye(4) - run.monodromy, run.states[-1] - y)
        y = y + step
        if np.abs(step).max() < 1e-13:
            multipliers = np.linalg.eigvals(run.monodromy)
            return y, multipliers[np.argsort(-np.abs(multipliers))]
    pytest.fail(f"No orbit at {w} rad/s")


@pytest.fixture(scope="module")
def branch():
    """The orbit of one period about its last three doublings."""
    return impact_orbits.orbits(39.2 / TURN, (38.1 / TURN, 39.25 / TURN), initial=NEAR_SINGLE,
                                points=30)


def test_growth_beside_an_unstable_orbit_is_its_multiplier():
    w = 30.0166
    y, multipliers = orbit_at(w, NEAR_UNSTABLE)
    assert multipliers[0].real < -1.5
    one, other = (rounds(w, y + away, 10)[:, 0] for away in (0.0, np.array([1e-11, 0, 0, 0])))
    growth = (other - one)[1:] / (other - one)[:-1]
    assert growth[5:8] == pytest.approx(multipliers[0].real, rel=2e-3)
    # Runs from its neighbourhood end elsewhere.
    assert np.ptp(rounds(w, y + 1e-8, 4, transient=200, rtol=1e-6)[:, 0]) > 1e-6


def test_multipliers_are_continuous_at_a_grazing():
    """One more touch changes them by the power 3/2 of the distance: the law begins smoothly."""
    grazing = 33.70772511
    multipliers, touches = {}, {}
    for away in (-4e-3, -1e-3, -2.5e-4, 1e-5):
        w = grazing + away
        y, found = orbit_at(w, NEAR_GRAZING)
        multipliers[away] = found[0].real
        run = simulate(impact_orbits.oscillator(w / TURN), 2.0 * np.pi / w, initial=y, outputs=2,
                       rtol=1e-10, events=ContactEvents())
        touches[away] = len(run.events.only("touch-down"))
    assert touches == {-4e-3: 2, -1e-3: 2, -2.5e-4: 2, 1e-5: 1}
    change = [multipliers[away] - multipliers[1e-5] for away in (-4e-3, -1e-3, -2.5e-4)]
    assert change[2] < 0.003
    assert np.log(change[0] / change[1]) / np.log(4.0) == pytest.approx(1.5, abs=0.1)
    assert np.log(change[1] / change[2]) / np.log(4.0) == pytest.approx(1.5, abs=0.1)


def test_a_doubling_is_where_runs_double(branch):
    """Above it one period, below two, apart by the square root of the distance."""
    doubling = max(branch.of_kind("period doubling"), key=lambda point: point.parameter)
    # The branch of the example is as exact as its runs, of rtol = 1e-7.
    near = min(branch.points, key=lambda point: abs(TURN * point.parameter - 39.08))
    field = impact_orbits.field_at(39.08 / TURN)
    exact = orbit_branch(field, near.orbit(field, 400), method=Shooting(segments=1, rtol=1e-9),
                         bounds=(39.0 / TURN, 39.15 / TURN), direction=-1.0,
                         options=ContinuationOptions(step=0.05, largest_step=0.1, points=12))
    assert TURN * exact.of_kind("period doubling")[0].parameter == pytest.approx(
        39.0283286, abs=5e-6)
    twice = orbit_branch(impact_orbits.field_at(39.0 / TURN), doubling,
                         bounds=(38.9 / TURN, 39.1 / TURN), options=ContinuationOptions(
                             step=2e-3, largest_step=5e-3, points=20))
    end = twice.points[-1]
    assert end.parameter == pytest.approx(38.9 / TURN, rel=1e-12)
    assert end.values["stable"]
    states = end.u[:-1].reshape(2, 4)
    # The multiplier is 0.88: runs from beside come to the doubled orbit.
    run = rounds(38.9, states[0] + np.array([1e-6, 0.0, 0.0, 0.0]), 2, transient=200, rtol=1e-8)
    assert run[:, 0] == pytest.approx(states[:, 0], rel=1e-5)
    assert abs(run[1, 0] - run[0, 0]) > 5e-6
    off = TURN * (doubling.parameter - twice.parameter)
    squares = [np.ptp(impact_orbits.section(point))**2 / away
               for point, away in zip(twice.points, off, strict=True) if 5e-4 < away < 0.01]
    assert len(squares) >= 2
    assert max(squares) < 1.1 * min(squares)


def test_motions_of_one_and_of_more_periods_coexist(branch):
    """Above the doubling both draw runs; those from rest come to the other."""
    above = min(branch.points, key=lambda point: abs(TURN * point.parameter - 39.2))
    w, y = TURN * above.parameter, above.u[:4]
    single = rounds(w, y + np.array([1e-6, 0.0, 0.0, 0.0]), 2, transient=250, rtol=1e-8)
    assert single[:, 0] == pytest.approx(y[0], rel=1e-5)
    other = rounds(w, np.zeros(4), 8, transient=250, rtol=1e-6)[:, 0]
    assert other[4:] == pytest.approx(other[:4], rel=1e-4)
    assert np.ptp(other) > 5e-5


def test_a_loop_of_doubled_orbits_ends_where_it_is_single(branch):
    later, first, _ = sorted(branch.of_kind("period doubling"), key=lambda point: point.parameter)
    assert TURN * later.parameter == pytest.approx(38.18365, abs=1e-4)
    assert TURN * first.parameter == pytest.approx(38.48943, abs=1e-4)
    loop = orbit_branch(impact_orbits.field_at(38.3 / TURN), first,
                        bounds=(38.1 / TURN, 38.6 / TURN), options=ContinuationOptions(
                            step=2e-3, largest_step=0.02, points=30))
    end = loop.points[-1]
    assert end.kind == "period halving"
    assert TURN * end.parameter == pytest.approx(TURN * later.parameter, abs=1e-4)
    assert end.values["multipliers"][0] == pytest.approx(1.0, abs=1e-4)
    assert [point.kind for point in loop.special] == ["period halving"]
    one, other = end.u[:-1].reshape(2, 4)
    assert one == pytest.approx(other, rel=1e-12)
