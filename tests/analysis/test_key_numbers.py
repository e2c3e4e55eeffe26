"""Key numbers and steadiness of motions that are known in closed form."""

import numpy as np
import pytest
from synthetic import basis

import fecontact as fc
from fecontact import ContactSystem, Ground
from fecontact.analysis import key_numbers, steadiness
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.system.columns import POWERS

TURN = 2.0 * np.pi


def moved(motion, rate, *, duration=1.0, outputs=2001, mode=0):
    """Run in which the block slides along x by a function of time, in contact throughout."""
    shapes = basis()
    system = ContactSystem(shapes, normal=LinearContact(stiffness=1e6),
                           friction=ConstantFriction(0.3, smoothing_slope=200.0),
                           ground=Ground(speed=50.0))
    t = np.linspace(0.0, duration, outputs)
    q, v = np.zeros((2, outputs, shapes.modes))
    q[:, mode], v[:, mode] = motion(t), rate(t)
    q[:, 1] = -1e-5
    work = np.zeros((outputs, len(POWERS)))
    work[:, POWERS.index("friction")] = 25.0 * t
    return fc.Trajectory(system, t, q, v, work)


def test_key_numbers_of_a_harmonic_motion():
    run = moved(lambda t: 1e-3 * np.cos(TURN * 40.0 * t),
                lambda t: -1e-3 * TURN * 40.0 * np.sin(TURN * 40.0 * t))
    found = key_numbers(run, ["B"])
    assert found.values["dominant_frequency@B"] == pytest.approx(40.0, rel=1e-3)
    assert found.values["amplitude_x@B"] == pytest.approx(1e-3, rel=1e-3)
    assert "amplitude_y@B" not in found.values or found.values["amplitude_y@B"] < 1e-12
    # Five nodes of a length of 0.2 m, pressed by 10 um; sliding at 50 m/s: R = mu F.
    normal = float(run.normal_force[0].sum())
    assert normal > 0.0
    assert found.values["mean_normal_force"] == pytest.approx(normal, rel=1e-9)
    assert found.values["peak_normal_force"] == pytest.approx(normal, rel=1e-9)
    assert abs(found.values["mean_friction_force"]) == pytest.approx(0.3 * normal, rel=1e-2)
    assert found.values["peak_friction_force"] == pytest.approx(0.3 * normal, rel=1e-2)
    assert found.values["friction_power"] == pytest.approx(25.0, rel=1e-9)
    assert found.steadiness.kind == "periodic"
    assert found.steadiness.period == pytest.approx(1.0 / 40.0, rel=1e-3)
    rows = dict(found.rows())
    assert rows["dominant frequency at B"] == "40 Hz"
    assert rows["amplitude x at B"] == "1 mm"
    assert rows["steady"] == "yes, periodic with 25 ms"
    assert found.interval == (0.5, 1.0)


def test_frequencies_need_five_periods():
    """The second half of the run has 4.5 or 5.5 periods."""
    for hertz, told in ((9.0, False), (11.0, True)):
        run = moved(lambda t, w=TURN * hertz: np.cos(w * t),
                    lambda t, w=TURN * hertz: -w * np.sin(w * t))
        found = key_numbers(run, ["B"])
        assert ("dominant_frequency@B" in found.values) is told
        row = dict(found.rows())["dominant frequency at B"]
        assert row.endswith("Hz") is told
        assert ("fewer than 5 periods" in row) is not told


def test_a_subharmonic_has_its_own_period():
    run = moved(lambda t: np.sin(TURN * 60.0 * t) + 0.2 * np.sin(TURN * 20.0 * t),
                lambda t: TURN * (60.0 * np.cos(TURN * 60.0 * t)
                                  + 4.0 * np.cos(TURN * 20.0 * t)))
    found = steadiness(run)
    assert found.kind == "periodic"
    assert found.period == pytest.approx(1.0 / 20.0, rel=1e-3)


@pytest.mark.parametrize(("rate", "kind"), [(0.01, "periodic"), (1.0, "not steady"),
                                            (-1.0, "not steady"), (-20.0, "at rest")])
def test_growth_and_decay(rate, kind):
    wave = TURN * 50.0
    run = moved(lambda t: 1e-3 * np.exp(rate * t) * np.cos(wave * t),
                lambda t: 1e-3 * np.exp(rate * t) * (rate * np.cos(wave * t)
                                                     - wave * np.sin(wave * t)))
    assert steadiness(run).kind == kind


def test_quasi_periodic_motion_is_not_steady():
    other = 50.0 * 0.5 * (np.sqrt(5.0) - 1.0)
    run = moved(lambda t: np.cos(TURN * 50.0 * t) + np.cos(TURN * other * t),
                lambda t: -TURN * (50.0 * np.sin(TURN * 50.0 * t)
                                   + other * np.sin(TURN * other * t)))
    assert steadiness(run).kind == "not steady"


def test_a_run_that_does_not_move_is_at_rest():
    run = moved(np.zeros_like, np.zeros_like)
    found = key_numbers(run)
    assert found.motion == "yes, at rest"
    assert not any("frequency" in name for name in found.values)


def test_coarse_outputs_tell_nothing():
    # 1.6 outputs for each period.
    run = moved(lambda t: np.sin(TURN * 612.0 * t), lambda t: TURN * 612.0 * np.cos(
        TURN * 612.0 * t), outputs=1001)
    assert steadiness(run).kind == "unknown"
    assert steadiness(moved(np.sin, np.cos, outputs=20)).kind == "unknown"


def test_uneven_outputs_have_no_frequency():
    run = moved(lambda t: np.sin(TURN * 40.0 * t), lambda t: TURN * 40.0 * np.cos(TURN * 40.0 * t))
    uneven = np.sort(np.random.default_rng(0).choice(2001, 1500, replace=False))
    part = fc.Trajectory(run.system, run.time[uneven], run.modal_coordinates[uneven],
                         run.modal_velocities[uneven], run.work[uneven])
    found = key_numbers(part)
    assert not any("frequency" in name for name in found.values)
    assert found.steadiness.period == pytest.approx(1.0 / 40.0, rel=1e-3)
