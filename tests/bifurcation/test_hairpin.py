"""Folds that are too sharp for steps along the branch: closed forms, and orbits that just stick."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from systems import belt
from test_continuation import Plane

from fecontact import InputError, sensitivity, simulate
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    Shooting,
    contact_field,
    equilibrium_branch,
    orbit_branch,
)
from fecontact.bifurcation.continuation.follow import continue_branch

MASS = 5.632


@pytest.mark.parametrize("sharpness", [1e4, 1e7, 1e9])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_hairpin_is_gone_round(sharpness, side):
    """1 - p = C (x - p)^2: the sheets are sqrt((1 - p) / C) from x = p, and turn within 1 / C."""
    hairpin = Plane(lambda x, p: 1.0 - p - sharpness * (x - p) ** 2,
                    lambda x, p: (-2.0 * sharpness * (x - p), 2.0 * sharpness * (x - p) - 1.0))
    start = np.array([0.2 + side * (0.8 / sharpness) ** 0.5, 0.2])
    branch = continue_branch(hairpin, start, ContinuationOptions(bounds=(0.0, 2.0)))
    assert branch.status is BranchStatus.BOUND
    assert branch.parameter[-1] == pytest.approx(0.0, abs=1e-12)
    fold, = branch.special
    assert fold.kind == "fold"
    assert fold.parameter == pytest.approx(1.0, abs=1e-10)
    sheet = np.sign(branch.column("x") - branch.parameter)
    at = branch.points.index(fold)
    assert (sheet[:at] == side).all()
    assert (sheet[at + 1:] == -side).all()
    assert len(branch) < 150


def closed_after_one_cycle(v, slip, slope):
    """Slip velocity at the next least one after ``slip``, and the logarithm of the multiplier.

    From m x'' + c x' + k x = N mu(s), s = v - x', alone; the multiplier is exp of the integral of
    the divergence.
    """
    c, k, N = 0.768, 5610.0, 14.0

    def mu(s):
        return (0.55 + 0.25 * np.exp(-1000.0 * abs(s))) * 2.0 / np.pi * np.arctan(slope * s)

    def mu_rate(s):
        fall, x = 0.25 * np.exp(-1000.0 * abs(s)), slope * s
        return 2.0 / np.pi * ((0.55 + fall) * slope / (1.0 + x * x)
                              - 1000.0 * fall * np.sign(s) * np.arctan(x))

    def rates(t, y):
        return [v - y[1], (c * (v - y[1]) + k * y[0] - N * mu(y[1])) / MASS,
                -(c + N * mu_rate(y[1])) / MASS]

    def least(t, y):
        return rates(t, y)[1]

    least.direction, least.terminal = 1.0, True
    state = [(N * mu(slip) - c * (v - slip)) / k, slip, 0.0]
    away = solve_ivp(rates, (0.0, 0.02), state, "DOP853", rtol=1e-12, atol=1e-15)
    cycle = solve_ivp(rates, (0.02, 1.0), away.y[:, -1], "DOP853", rtol=1e-12, atol=1e-15,
                      events=least)
    return cycle.y_events[0][0][1:]


def fold_speed(slope, speeds, slips):
    """Belt speed at which the orbit with multiplier one closes."""
    def speed(slip):
        return brentq(lambda v: closed_after_one_cycle(v, slip, slope)[0] - slip, *speeds,
                      xtol=1e-13)

    slip = brentq(lambda s: closed_after_one_cycle(speed(s), s, slope)[1], *slips, xtol=1e-9)
    return speed(slip)


@pytest.fixture(scope="module")
def folds():
    """The belt's folds of stick-slip and slipping orbits, by shooting, and independently."""
    found = {}
    for slope, start, speeds, slips in ((1e5, 0.205, (0.2, 0.215), (6e-5, 8e-5)),
                                        (1e6, 0.231, (0.23, 0.24), (1e-5, 2e-5))):
        system = belt(slope, start)
        run = simulate(system, 10.0, initial=MASS**0.5 * np.array([8.4 / 5610.0, start]),
                       outputs=10001, rtol=1e-9)
        field = contact_field(system, {"ground.speed": None})
        branch = orbit_branch(field, (run.time[-500:], run.states[-500:]), "ground.speed",
                              method=Shooting(), width=0.25, bounds=(start - 5e-3, 0.25),
                              scales=1.5 * MASS**0.5 * np.array([0.007, 0.23]),
                              options=ContinuationOptions(step=2e-3))
        found[slope] = branch, fold_speed(slope, speeds, slips)
    return found


def test_orbits_that_just_touch_sticking(folds):
    for branch, expected in folds.values():
        assert branch.status is BranchStatus.BOUND
        fold, = branch.special
        assert fold.kind == "fold"
        assert fold.parameter == pytest.approx(expected, rel=1e-6)
        at = branch.points.index(fold)
        assert branch.column("stable")[:at].all()
        assert (branch.column("unstable")[at + 1:] == 1).all()


def test_the_fold_tends_to_grazing(folds):
    """Set-valued friction: the slipping orbit's largest velocity is that of the belt."""
    c, k, N = 0.768, 5610.0, 14.0

    def excess(v):
        def rates(t, y):
            mu = 0.55 + 0.25 * np.exp(-1000.0 * max(v - y[1], 0.0))
            return [y[1], (N * mu - c * y[1] - k * y[0]) / MASS]

        def largest(t, y):
            return rates(t, y)[1]

        largest.direction, largest.terminal = -1.0, True
        away = solve_ivp(rates, (0.0, 0.02), [(0.8 * N - c * v) / k, v], "DOP853", rtol=1e-12,
                         atol=1e-15)
        again = solve_ivp(rates, (0.02, 1.0), away.y[:, -1], "DOP853", rtol=1e-12, atol=1e-15,
                          events=largest)
        return again.y_events[0][0][1] - v

    grazing = brentq(excess, 0.23, 0.245, xtol=1e-13)
    distance = [grazing - branch.special[0].parameter for branch, _ in folds.values()]
    assert distance[1] < 0.04 * grazing
    # The smoothed law lacks 2 / (pi k_s s) of its value, where it acts at s ~ k_s^(-2/3).
    assert 3.5 < distance[0] / distance[1] < 10.0 ** (2.0 / 3.0)


def test_derivatives_to_the_speed_of_a_fast_belt():
    """Differences in the parameter must be fine beside friction that rises over 1 um/s."""
    v = 0.23348
    start = MASS**0.5 * np.array([v / 31.56 * np.cos(2.0) + 7.7 / 5610.0, -v * np.sin(2.0)])

    def end(speed):
        return simulate(belt(1e6, speed), 0.1991, initial=start, outputs=2, rtol=1e-12).states[-1]

    found = sensitivity(belt(1e6, v), 0.1991, initial=start, parameter="ground.speed", rtol=1e-9)
    assert found.parameter_derivative == pytest.approx((end(v + 1e-8) - end(v - 1e-8)) / 2e-8,
                                                       rel=1e-4)


def test_starts_outside_the_bounds():
    t = np.linspace(0.0, 0.2, 100)
    states = np.stack([np.sin(31.4 * t), 31.4 * np.cos(31.4 * t)], axis=1)
    with pytest.raises(InputError, match=r"starts? lies at 0.012, outside the bounds .*, 1 to 2"):
        orbit_branch(contact_field(belt(), {"ground.speed": None}),
                     PeriodicMotion(t, states, period=0.2), "ground.speed", method=Shooting(),
                     bounds=(1.0, 2.0))


def test_collocation_goes_round_where_friction_is_less_steep():
    """Slope 1e4 s/m: from the Hopf point to the fold and back, with nothing else on the way."""
    field = contact_field(belt(1e4, 0.12), {"ground.speed": None})
    sliding = equilibrium_branch(field, parameter="ground.speed", bounds=(2e-3, 0.12),
                                 direction=-1.0)
    hopf, = sliding.special
    branch = orbit_branch(field, hopf, method=Collocation(intervals=100), bounds=(2e-3, 0.12),
                          options=ContinuationOptions(step=5e-3, points=400))
    assert branch.status is BranchStatus.BOUND
    assert branch.parameter[-1] == pytest.approx(2e-3)
    fold, = branch.special
    assert fold.kind == "fold"
    # Runs that begin stuck go on sticking and slipping below it, and come to rest above.
    for speed, swings in ((0.99 * fold.parameter, True), (1.01 * fold.parameter, False)):
        start = MASS**0.5 * np.array([8.4 / 5610.0, speed])
        run = simulate(belt(1e4, speed), 60.0, initial=start, rtol=1e-8,
                       outputs=np.append(0.0, np.linspace(59.0, 60.0, 200)))
        assert (np.ptp(run.states[1:, 1]) > 0.5 * MASS**0.5 * speed) == swings
