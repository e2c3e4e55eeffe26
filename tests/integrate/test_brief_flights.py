"""Lift-off from rest on rigid stops and flights shorter than places can tell, against closed forms.

    y'' + 2 D y' + y = -W + a sin(w t) over a stop at y = -GAP

presses with p - a sin(w t) while it rests there, p = W - GAP.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from systems import TURN

import fecontact as fc
from fecontact import Status
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import ConstantFriction, LinearContact

INELASTIC = SetValued(restitution=0.0)
GAP, DAMPING, W, PRESSING = 0.7, 0.05, 2.5, 0.5
PERIOD = 2.0 * np.pi / W


def mass(amplitude):
    rows = [[0.0], [1.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[0.5]], {"contact": [rows], "B": rows, "C": rows},
                                   damping=[[2.0 * DAMPING]])
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), gap=GAP,
        load=fc.Load(PRESSING + GAP),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=2.0 * amplitude, frequency_hz=W / TURN))


def two_masses(amplitude):
    """A mass on a stop, y_1 = 0, and one above it on a spring, which is driven."""
    rows = np.zeros((2, 3, 2))
    rows[:, 1] = np.eye(2)
    basis = fc.basis_from_matrices(
        np.diag([1.0, 0.5]), [[1.0, -1.0], [-1.0, 1.2]],
        {"contact": rows[:1], "B": rows[1], "C": rows[0]}, damping=[[0.2, -0.1], [-0.1, 0.2]])
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), load=fc.Load(1.0),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=1.3 / TURN))


def changes(run):
    """Kinds and times of the lift-offs and touch-downs of a run that came to its end."""
    assert run.status is Status.FINISHED
    found = [(str(kind), float(time)) for kind, time in zip(
        run.events.kind, run.events.time, strict=True) if kind in ("lift-off", "touch-down")]
    return [kind for kind, _ in found], np.array([time for _, time in found])


@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
@pytest.mark.parametrize(("part", "within"), [
    (1e-3, 2e-5), (1e-4, 1e-5), (1e-5, 1e-4), (3e-6, 1e-3), (1e-6, 0.05)])
def test_lift_off_where_the_force_nearly_stays(part, within, rtol):
    """If the stop would have to pull for a time 2 d, the flight takes 4 d (1 + O(d^2)).

    In the shortest one it would pull with 1e-12 of the largest force, little more than rounding.
    """
    before = 0.25 * part * PERIOD
    amplitude = PRESSING / np.cos(W * before)
    # The time that belongs to the rounded amplitude.
    before = np.arctan(np.sqrt((amplitude / PRESSING - 1.0) * (amplitude / PRESSING + 1.0))) / W
    run = fc.simulate(mass(amplitude), 3.0 * PERIOD, initial=[-GAP, 0.0], rtol=rtol,
                      solver=INELASTIC, outputs=2, events=ContactEvents())
    kinds, times = changes(run)
    assert kinds == ["lift-off", "touch-down"] * 3
    assert times[::2] == pytest.approx((0.25 + np.arange(3)) * PERIOD - before, rel=0.0,
                                       abs=max(1e-12, within * before))
    assert np.diff(times)[::2] == pytest.approx(4.0 * before, rel=within)


def landing(moment, amplitude, earlier):
    """State some time before the mass lands with a speed of one at a given moment."""
    forced = amplitude / (1.0 - W**2 + 2j * DAMPING * W) * np.exp(1j * W * moment)
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]])
    left = np.array([PRESSING - forced.imag, -1.0 - (1j * W * forced).imag])
    forced *= np.exp(-1j * W * earlier)
    return np.array([-GAP - PRESSING + forced.imag, (1j * W * forced).imag]) + expm(
        -earlier * matrix) @ left


@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
@pytest.mark.parametrize("part", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
def test_landing_just_before_the_force_turns_to_press(part, rtol):
    """With acceleration b - c t the flight after it takes 3 b / c (1 + O(b / c))."""
    amplitude, flight, earlier = 2.0 * PRESSING, part * PERIOD, 0.4
    turns = (np.pi - np.arcsin(PRESSING / amplitude)) / W
    lands = turns - flight / 3.0
    run = fc.simulate(mass(amplitude), lands + 0.4 * PERIOD, t_start=lands - earlier,
                      initial=landing(lands, amplitude, earlier), rtol=rtol, solver=INELASTIC,
                      outputs=2, events=ContactEvents())
    kinds, times = changes(run)
    assert kinds == ["touch-down", "lift-off", "touch-down"]
    off = max(10.0 * rtol, 1e-12)
    assert times[:2] == pytest.approx(lands, rel=0.0, abs=off)
    assert times[2] - times[1] == pytest.approx(flight, rel=part + 1e-5, abs=3.0 * off)


@pytest.mark.slow
@pytest.mark.parametrize("count", [300, pytest.param(1500, marks=pytest.mark.slow)])
def test_many_lift_offs_open_the_stop_once(count):
    """From rest or a little away from it, beyond the border of lift-off, at small tolerance."""
    random, period = np.random.default_rng(5), 2.0 * np.pi / 1.3
    briefest = period
    for _ in range(count):
        system = two_masses(random.uniform(1.77, 1.80))
        start = 10.0 ** random.uniform(-9.0, -3.0) * random.standard_normal(4)
        # Not in the ground.
        start[:2] *= np.copysign(1.0, (system.arrays.rows[:, 1] @ start[:2])[0])
        run = fc.simulate(system, 4.0 * period, initial=start, rtol=1e-12, solver=INELASTIC,
                          outputs=2, events=ContactEvents())
        kinds, times = changes(run)
        assert "lift-off" in kinds
        briefest = min(briefest, np.diff(times).min(initial=period))
    assert briefest > 1e-6 * period


def test_slip_that_begins_on_stops():
    """A mass on a belt, coupled along and across: no run gets stuck or gains energy.

    Work lost at all nodes is the work of friction, and none of it is negative.
    """
    random = np.random.default_rng(3)
    for _ in range(150):
        mu, speed, lean, amplitude, w = random.uniform(
            [0.1, 0.05, -0.6, 1.0, 0.5], [0.5, 0.5, 0.6, 6.0, 2.0])
        rows = [[1.0, lean], [0.0, 1.0], [0.0, 0.0]]
        basis = fc.basis_from_matrices(np.eye(2), np.diag([2.0, 0.5]), {
            "contact": [rows], "B": rows, "C": rows}, damping=0.2 * np.eye(2))
        system = fc.ContactSystem(
            basis, normal=LinearContact(1e6), friction=ConstantFriction(mu), load=fc.Load(1.0),
            ground=fc.Ground(speed=speed),
            drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=w / TURN))
        solver = SetValued(restitution=float(random.choice([0.0, 0.3, 0.6])))
        run = fc.simulate(system, 60.0, initial=[0.0, 0.5, 0.0, 0.0], rtol=1e-9, solver=solver,
                          outputs=31)
        assert run.status is Status.FINISHED
        assert np.diff(run.node_friction_work[:, 0]).min() >= -1e-9
