"""Steps that end where forces change their character, against closed forms of the motions."""

import numpy as np
import pytest
from scipy.optimize import brentq
from systems import mass_in_plane, mass_in_y

from fecontact import Load
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.kinks import _BEYOND, _DOUBTS, _NEAREST, _SHORT
from fecontact.integrate.rodas5p.state import CAUTIOUS
from fecontact.integrate.rodas5p.step_length import LAST_STEP, REJECTED_LAST
from fecontact.integrate.step_loop import REJECTIONS, STEP, TIME
from fecontact.laws import ConstantFriction, Frictionless, LinearContact, PrescribedForce

# Angular frequency [rad/s] of the free mass.
W = 10.0


def ends_of_steps(system, state, reach, steps=1, caution=1.0, failed=True, before=0.0):
    """Ends of the first steps, all taken at once, after one of the length ``reach`` has failed.

    With ``caution`` -1 another one has failed that ended just beyond a kink. ``before`` is the
    length of the step that was taken before. Without ``failed`` steps were taken since.
    """
    run = driver.start(system, np.array(state), np.array([0.0, 10.0]), rtol=1e-2,
                       method="rodas5p")
    run.progress.numbers[STEP] = reach
    run.progress.numbers[CAUTIOUS] = caution * reach
    run.progress.numbers[REJECTED_LAST] = float(failed)
    run.progress.numbers[LAST_STEP] = before
    found = []
    for _ in range(steps):
        run.advance(1)
        found.append(run.progress.numbers[TIME])
    assert run.progress.counts[REJECTIONS] == 0
    return found


def falling(height, speed):
    """A mass on a spring above a stop, its state, and the time at which it touches."""
    def place(t):
        return height * np.cos(W * t) - speed / W * np.sin(W * t)

    system = mass_in_y(spring=W**2, normal=LinearContact(1e3, 2.0), friction=Frictionless())
    return system, [height, -speed], brentq(place, 0.0, np.pi / W, xtol=1e-15)


def test_a_step_ends_just_beyond_a_touch():
    system, state, touch = falling(0.001, 2.0)
    (end,) = ends_of_steps(system, state, 1.2 * touch)
    assert end / touch == pytest.approx(_BEYOND, abs=1e-7)


def gap_of_doubt(height, touch):
    """By how much a step ends before a touch: what a parabola errs by, squared, tells the doubt."""
    drop = W**2 * height
    parabola = (np.sqrt(2.0**2 + 2.0 * drop * height) - 2.0) / drop
    return _DOUBTS * (parabola - touch) ** 2 / touch


@pytest.mark.parametrize("caution", [1.0, -1.0])
def test_a_step_to_a_kink_in_doubt_ends_before_it_and_the_next_at_it(caution):
    # The third power of time counts much, so that the fourth does too.
    height = 0.15
    system, state, touch = falling(height, 2.0)
    reach, gap = 1.2 * touch, gap_of_doubt(height, touch)
    assert gap > 4.0 * _SHORT * reach
    first, second = ends_of_steps(system, state, reach, 2, caution)
    assert touch - 2.0 * gap < first < touch - 0.5 * gap
    assert second / touch == pytest.approx(1.0, abs=1e-6)


def test_where_that_is_too_far_it_ends_just_before_and_the_next_just_beyond():
    system, state, touch = falling(0.02, 2.0)
    reach = 1.2 * touch
    first, second = ends_of_steps(system, state, reach, 2, caution=-1.0)
    assert touch - 1.2 * _SHORT * reach < first < touch - 0.8 * _SHORT * reach
    assert 1.0 < second / touch < 1.0 + 1e-6


def test_steps_end_before_a_kink_only_where_one_has_just_been_too_far():
    system, state, touch = falling(0.001, 2.0)
    reach = 1.2 * touch
    (end,) = ends_of_steps(system, state, reach, caution=-1.0)
    assert end < touch - 0.8 * _SHORT * reach
    (end,) = ends_of_steps(system, state, reach, caution=-1.0, failed=False)
    assert end / touch == pytest.approx(_BEYOND, abs=1e-7)


@pytest.mark.parametrize("height", [0.02, 0.04])
def test_the_way_to_a_touch_is_known_up_to_the_third_power_of_time(height):
    # What is left of the motion is a fourth derivative W^4 y: its part W^4 y t^4 / 24.
    system, state, touch = falling(height, 2.0)
    reach = 1.2 * touch
    (first,) = ends_of_steps(system, state, reach, caution=-1.0)
    gap = max(_SHORT * reach, gap_of_doubt(height, touch))
    speed = np.hypot(2.0, W * height)
    most = W**4 * height * touch**4 / 24.0 / speed
    assert abs(first + gap - touch) < 1.5 * most + 2e-5 * touch
    # Without the third power it would be W^2 v t^3 / 6.
    assert most + 2e-5 * touch < 0.2 * W**2 * 2.0 * touch**3 / 6.0 / speed


def test_a_kink_that_is_too_near_to_end_at_is_passed_by_a_short_step():
    system, state, touch = falling(1e-8, 2.0)
    reach = 3e4 * touch
    (end,) = ends_of_steps(system, state, reach, before=reach)
    assert end == pytest.approx(_NEAREST * reach, rel=1e-12)
    # The next one may be as long as the one before the kink, not only eight times as long.
    run = driver.start(system, np.array(state), np.array([0.0, 10.0]), rtol=1e-2,
                       method="rodas5p")
    run.progress.numbers[[STEP, CAUTIOUS, LAST_STEP]] = reach, reach, 0.5 * reach
    run.progress.numbers[REJECTED_LAST] = 1.0
    run.advance(1)
    assert run.progress.numbers[STEP] == 0.5 * reach


def test_only_a_step_that_was_longer_is_followed_by_such_a_short_one():
    system, state, touch = falling(1e-8, 2.0)
    reach = 3e4 * touch
    assert ends_of_steps(system, state, reach, before=5.0 * _NEAREST * reach) != [_NEAREST * reach]
    assert ends_of_steps(system, state, reach, before=reach, failed=False) != [_NEAREST * reach]


def test_a_step_ends_where_a_pressing_force_falls_to_zero():
    stiffness, damping, depth, speed, load = 400.0, 4.0, 1e-3, 0.08, 1.0
    decay, w = 0.5 * damping, np.sqrt(stiffness - 0.25 * damping**2)
    still = load / stiffness

    def motion(t):
        a, b = depth - still, (-speed + decay * (depth - still)) / w
        wave = a * np.cos(w * t) + b * np.sin(w * t)
        rate = w * (b * np.cos(w * t) - a * np.sin(w * t))
        return still + np.exp(-decay * t) * wave, np.exp(-decay * t) * (rate - decay * wave)

    def force(t):
        u, v = motion(t)
        return stiffness * u + damping * v

    zero = brentq(force, 0.0, 0.005, xtol=1e-15)
    assert motion(zero)[0] > 0.0
    system = mass_in_y(normal=LinearContact(stiffness, damping), friction=Frictionless(),
                       load=Load(load))
    reach = 1.5 * zero
    first, second = ends_of_steps(system, [-depth, speed], reach, 2)
    # The tangent at the begin would be 2 % off, so that the time is in doubt.
    rate = (force(1e-7) - force(0.0)) / 1e-7
    assert abs(-force(0.0) / rate / zero - 1.0) > 0.02
    assert (first + _SHORT * reach) / zero == pytest.approx(1.0, abs=2e-4)
    assert 1.0 < second / zero < 1.0 + 1e-7


def test_a_step_ends_where_slip_is_about_to_cease():
    # Friction slows the mass evenly, but for its smoothing: by 0.3 % less on the way.
    system = mass_in_plane(normal=PrescribedForce(2.0), friction=ConstantFriction(0.5, 1e4))
    run = driver.start(system, np.zeros(4), np.array([0.0, 1.0]), rtol=1e-2,
                       method="rodas5p")
    slow = float(run.problem.control.slow[0])
    (end,) = ends_of_steps(system, [0.0, 0.0, 0.02, 0.0], 0.03)
    assert end == pytest.approx((0.02 - slow) * _BEYOND, rel=4e-3)


def test_steps_that_have_not_failed_do_not_look_ahead():
    system, state, touch = falling(0.1, 2.0)
    assert ends_of_steps(system, state, 0.5 * touch, caution=0.0) == [0.5 * touch]
    assert ends_of_steps(system, state, 0.5 * touch) == [0.5 * touch]
