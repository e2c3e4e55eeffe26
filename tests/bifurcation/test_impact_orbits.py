"""Orbits of the impact oscillator against runs that know nothing of derivatives."""

import sys
from pathlib import Path

import numpy as np
import pytest

from fecontact import ContactEvents, doubled_by_shooting, simulate, strobe
from fecontact.bifurcation.problem import Settings
from fecontact.integrate.sensitivity import sensitivity

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

import impact_orbits

# States near orbits of one period, from which Newton's method finds them.
NEAR_UNSTABLE = np.array([1.989e-5, -1.2e-6, 1.13e-3, 6.2e-4])     # 30.0166 rad/s
NEAR_GRAZING = np.array([4.49523e-5, -2.348e-7, -1.77e-3, -1.08e-3])    # 33.7077 rad/s


def rounds(w, y, count, transient=0, rtol=1e-10):
    """States after each of the last periods of a run, (count, 4)."""
    return strobe(impact_orbits.oscillator(w), transient=transient, keep=count, initial=y,
                  rtol=rtol).states[0]


def orbit_at(w, y):
    """The orbit of one period at w near a state, and its multipliers, the largest first."""
    for _ in range(12):
        run = sensitivity(impact_orbits.oscillator(w), 2.0 * np.pi / w, initial=y, rtol=1e-10)
        step = np.linalg.solve(np.eye(4) - run.monodromy, run.states[-1] - y)
        y = y + step
        if np.abs(step).max() < 1e-13:
            multipliers = np.linalg.eigvals(run.monodromy)
            return y, multipliers[np.argsort(-np.abs(multipliers))]
    pytest.fail(f"No orbit at {w} rad/s")


@pytest.fixture(scope="module")
def branch():
    """The orbit of one period about its last doubling."""
    return impact_orbits.orbits(39.2, (38.95, 39.25), points=14)


def test_growth_beside_an_unstable_orbit_is_its_multiplier():
    w = 30.0166
    y, multipliers = orbit_at(w, NEAR_UNSTABLE)
    assert multipliers[0].real < -1.5
    beside = rounds(w, y + np.array([1e-9, 0.0, 0.0, 0.0]), 10)
    away = beside[:, 0] - y[0]
    assert away[8] / away[7] == pytest.approx(multipliers[0].real, rel=2e-3)
    # It is lost in the end, to a motion of another size.
    assert np.ptp(rounds(w, y, 4, transient=200, rtol=1e-6)[:, 0]) > 1e-6


def test_multipliers_are_continuous_at_a_grazing():
    """One more touch changes them by the power 3/2 of the distance: the law begins smoothly."""
    grazing = 33.70772511
    multipliers, touches = {}, {}
    for away in (-4e-3, -1e-3, -2.5e-4, 1e-5):
        w = grazing + away
        y, found = orbit_at(w, NEAR_GRAZING)
        multipliers[away] = found[0].real
        run = simulate(impact_orbits.oscillator(w), 2.0 * np.pi / w, initial=y, outputs=2,
                       rtol=1e-10, events=ContactEvents())
        touches[away] = len(run.events.only("touch-down"))
    assert touches == {-4e-3: 2, -1e-3: 2, -2.5e-4: 2, 1e-5: 1}
    change = [multipliers[away] - multipliers[1e-5] for away in (-4e-3, -1e-3, -2.5e-4)]
    assert change[2] < 0.003
    assert np.log(change[0] / change[1]) / np.log(4.0) == pytest.approx(1.5, abs=0.1)
    assert np.log(change[1] / change[2]) / np.log(4.0) == pytest.approx(1.5, abs=0.1)


def test_a_doubling_is_where_runs_double(branch):
    """Above it one period, below two, apart by the square root of the distance."""
    doubling, = branch.of_kind("period doubling")
    assert doubling.parameter == pytest.approx(39.02833, abs=2e-5)
    field = impact_orbits.field_at(39.0)
    twice = doubled_by_shooting(field, branch, doubling, bounds=(39.0, 39.1),
                                settings=Settings(step=2e-3, largest_step=0.02, points=20))
    end = twice.points[-1]
    assert end.parameter == pytest.approx(39.0, rel=1e-12)
    assert end.values["stable"]
    states = end.u[:-1].reshape(2, 4)
    # A run from beside the doubled orbit comes to it: the multiplier is 0.96.
    run = rounds(39.0, states[0] + 1e-7 * np.array([1.0, 0.0, 0.0, 0.0]), 2, transient=298,
                 rtol=1e-8)
    assert run[-2:] == pytest.approx(states[[1, 0]], abs=2e-9, rel=1e-4)
    apart = {point.parameter: np.ptp(impact_orbits.section(point)) for point in twice.points}
    near = {w: size for w, size in apart.items() if 1e-4 < doubling.parameter - w < 8e-3}
    assert len(near) >= 2
    squares = [size**2 / (doubling.parameter - w) for w, size in near.items()]
    assert max(squares) < 1.15 * min(squares)
    # Above, the single orbit draws runs that begin beside it.
    above = next(point for point in branch.points if point.parameter > 39.15)
    y = above.u[:4]
    begun = rounds(above.parameter, y + np.array([1e-7, 0.0, 0.0, 0.0]), 1, transient=120,
                   rtol=1e-8)
    assert begun[-1] == pytest.approx(y, abs=2e-9, rel=1e-4)


def test_motions_of_one_and_two_periods_coexist():
    """At 39.5 rad/s runs stay on either."""
    w = 39.5
    single = rounds(w, np.zeros(4), 4, transient=250, rtol=1e-7)
    assert np.ptp(single[:, 0]) < 1e-9


def test_a_loop_of_doubled_orbits_ends_where_it_is_single():
    start = impact_orbits.orbits(39.2, (38.1, 39.25), points=30)
    later, = (point for point in start.of_kind("period doubling") if point.parameter < 38.3)
    first, = (point for point in start.of_kind("period doubling") if 38.4 < point.parameter < 38.6)
    loop = doubled_by_shooting(impact_orbits.field_at(38.3), start, first, bounds=(38.1, 38.6),
                               settings=Settings(step=2e-3, largest_step=0.02, points=30))
    end = loop.points[-1]
    assert end.kind == "period halving"
    assert end.parameter == pytest.approx(later.parameter, abs=1e-5)
    assert not loop.of_kind("fold")
    one, other = end.u[:-1].reshape(2, 4)
    assert one == pytest.approx(other, rel=1e-12)
