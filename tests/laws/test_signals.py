"""Signals: rates, closed forms, breakpoints, values out of range."""

import math
import pickle
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import quad
from systems import TURN

from fecontact import InputError
from fecontact.laws import (
    Constant,
    Harmonic,
    Harmonics,
    Pulse,
    Signal,
    Step,
    SweptSine,
    Tabulated,
    signal,
)

RNG = np.random.default_rng(4)
TIMES = np.cumsum(RNG.uniform(0.01, 0.1, 30)) - 0.3
VALUES = RNG.standard_normal(30)
CLOSED = np.append(VALUES[:-1], VALUES[0])

SIGNALS = {
    "constant": Constant(-3.0),
    "harmonic": Harmonic(0.5e-3, 13.8 / TURN, 0.4),
    "harmonics": Harmonics((1.0, -0.5, 0.2), (3.0 / TURN, 7.0 / TURN, 0.0), (0.1, 0.2, 0.3)),
    "linear sweep": SweptSine(2.0, 1.0, 20.0, 1.5),
    "falling sweep": SweptSine(2.0, 20.0, 0.0, 1.5),
    "logarithmic sweep": SweptSine(2.0, 1.0, 20.0, 1.5, "logarithmic"),
    "half-sine": Pulse("half-sine", 5.0, 0.4, 0.1),
    "haversine": Pulse("haversine", -5.0, 0.4, 0.1),
    "triangle": Pulse("triangle", 5.0, 0.4, 0.1),
    "rectangle": Pulse("rectangle", 5.0, 0.4, 0.1),
    "slow rectangle": Pulse("rectangle", 5.0, 0.4, 0.1, rise=0.2),
    "lines": Tabulated(TIMES, VALUES),
    "repeated lines": Tabulated(TIMES, CLOSED, outside="repeat"),
    "curve": Tabulated(TIMES, VALUES, interpolation="cubic", scale=0.1),
    "repeated curve": Tabulated(TIMES, CLOSED, interpolation="cubic", outside="repeat"),
}


@pytest.fixture(params=SIGNALS.values(), ids=SIGNALS.keys())
def given(request):
    return request.param


def test_rate_is_the_derivative_between_breakpoints(given):
    edges = (-1.0, *given.breakpoints(-1.0, 3.0), 3.0)
    scale = np.abs(given.history(np.linspace(-1.0, 3.0, 40_001))[:, 1]).max() or 1.0
    for left, right in pairwise(edges):
        step = 1e-5 * (right - left)
        t = np.linspace(left + 2.0 * step, right - 2.0 * step, 101)
        low, here, high = (given.history(t + k * step) for k in (-1, 0, 1))
        np.testing.assert_allclose((high[:, 0] - low[:, 0]) / (2.0 * step), here[:, 1], rtol=0,
                                   atol=5e-6 * scale)


def test_value_is_continuous_and_jumps_of_the_rate_are_breakpoints(given):
    points = given.breakpoints(-1.0, 3.0)
    t = np.linspace(-1.0, 3.0, 400_001)
    value, rate = given.history(t).T
    step = t[1] - t[0]
    assert np.abs(np.diff(value)).max() <= 1.0001 * step * np.abs(rate).max() + 1e-300
    # A smooth rate changes by little from sample to sample.
    jumps = np.abs(np.diff(rate)) > 5e-3 * np.ptp(rate)
    if jumps.any():
        where = t[:-1][jumps] + 0.5 * step
        distance = np.abs(where[:, None] - np.array(points)).min(axis=1)
        assert distance.max() <= step


def test_plain_and_compiled_agree_and_zeros_may_follow(given):
    t = RNG.uniform(-2.0, 4.0, 50)
    p = given.parameters()
    assert p.dtype == float
    padded = np.append(p, np.zeros(7))
    compiled = given.history(t)
    scale = np.abs(compiled).max(axis=0)
    for q in (p, padded):
        plain = np.array([given.kernel.python(x, q) for x in t.tolist()])
        np.testing.assert_allclose(plain, compiled, rtol=0, atol=1e-12 * scale.max())


def test_largest_is_a_bound_that_is_reached(given):
    value = np.abs(given.history(np.linspace(-1.0, 3.0, 400_001))[:, 0]).max()
    assert value <= given.largest * (1.0 + 1e-12)
    if not isinstance(given, Harmonics):
        assert value == pytest.approx(given.largest, rel=1e-4)


def test_signals_are_values(given):
    _ = given.history(0.0)
    again = pickle.loads(pickle.dumps(given))
    assert again == given == replace(given)
    assert hash(again) == hash(given)


def test_frequency_is_that_of_repetition(given):
    if given.fundamental_hz is None:
        return
    t = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(given.history(t + 3.0 / given.fundamental_hz), given.history(t),
                               rtol=0, atol=1e-11 * np.abs(given.history(t)).max())


def test_harmonics_by_hand():
    assert Harmonic(2.0, 3.0 / TURN, 0.5).history(0.7)[0] == pytest.approx(
        (2.0 * math.sin(2.6), 6.0 * math.cos(2.6)), rel=1e-15)
    both = Harmonics((2.0, 0.5), (3.0 / TURN, 6.0 / TURN), (0.5, 0.0))
    t = np.linspace(-3.0, 3.0, 41)
    np.testing.assert_allclose(
        both.history(t),
        Harmonic(2.0, 3.0 / TURN, 0.5).history(t) + Harmonic(0.5, 6.0 / TURN).history(t),
        atol=1e-14)
    assert both.fundamental_hz == pytest.approx(3.0 / (2.0 * math.pi), rel=1e-15)
    assert both.shortest_period == pytest.approx(2.0 * math.pi / 6.0, rel=1e-15)
    assert both.largest == 2.5
    assert SIGNALS["harmonics"].fundamental_hz is None
    assert SIGNALS["harmonics"].shortest_period == pytest.approx(2.0 * math.pi / 7.0, rel=1e-15)
    assert Harmonics((1.0,), (5.0 / TURN,)) == Harmonics([1], np.array([5.0]) / TURN)
    for still in (Harmonic(1.0, 0.0, 0.3), Harmonic(0.0, 2.0 / TURN), Constant(1.0)):
        assert still.shortest_period is None
        assert still.fundamental_hz is None


@pytest.mark.parametrize("name", ["linear sweep", "falling sweep", "logarithmic sweep"])
def test_phase_of_a_sweep_is_the_integral_of_its_frequency(name):
    sweep = SIGNALS[name]
    for t in (-0.3, 0.2, 1.1, 1.5, 2.7):
        cycles = quad(sweep.instantaneous_frequency_hz, 0.0, t, points=[0.0, 1.5], epsabs=1e-13,
                      epsrel=1e-13)[0]
        value, rate = sweep.history(t)[0]
        assert value == pytest.approx(2.0 * math.sin(2.0 * math.pi * cycles), abs=1e-10)
        w = 2.0 * math.pi * float(sweep.instantaneous_frequency_hz(t))
        assert rate == pytest.approx(2.0 * w * math.cos(2.0 * math.pi * cycles), abs=1e-8)


def test_frequency_of_a_sweep():
    linear, logarithmic = SIGNALS["linear sweep"], SIGNALS["logarithmic sweep"]
    t = np.array([-1.0, 0.0, 0.75, 1.5, 9.0])
    assert linear.instantaneous_frequency_hz(t) == pytest.approx([1.0, 1.0, 10.5, 20.0, 20.0])
    assert logarithmic.instantaneous_frequency_hz(t) == pytest.approx(
        [1.0, 1.0, math.sqrt(20.0), 20.0, 20.0], rel=1e-14)
    for sweep in (linear, logarithmic):
        assert sweep.shortest_period == pytest.approx(0.05)
        assert sweep.breakpoints(-1.0, 2.0) == (0.0, 1.5)
        assert sweep.breakpoints(0.0, 1.5) == ()
    # Zero crossings of the signal itself: (t - 0) f_0 + (f_1 - f_0) t^2 / (2 T) = k / 2.
    crossing = (-1.0 + math.sqrt(1.0 + 4.0 * 19.0 / 3.0 * 6.5)) / (2.0 * 19.0 / 3.0)
    assert linear.history(crossing)[0, 0] == pytest.approx(0.0, abs=1e-13)
    still = SweptSine(1.0, 5.0, 5.0, 2.0, "logarithmic").history(np.linspace(0.0, 3.0, 31))
    np.testing.assert_allclose(
        still, Harmonic(1.0, 10.0 * math.pi / TURN).history(np.linspace(0.0, 3.0, 31)), atol=1e-12)


@pytest.mark.parametrize(("name", "middle", "impulse"), [
    ("half-sine", 5.0 * math.sin(0.375 * math.pi), 5.0 * 0.4 * 2.0 / math.pi),
    ("haversine", -5.0 * math.sin(0.375 * math.pi) ** 2, -5.0 * 0.4 / 2.0),
    ("triangle", 5.0 * 0.75, 5.0 * 0.4 / 2.0),
    ("rectangle", 5.0, 5.0 * (0.4 - 0.004)),
    ("slow rectangle", 5.0 * 0.75**2 * 1.5, 5.0 * (0.4 - 0.2)),
])
def test_pulses(name, middle, impulse):
    pulse = SIGNALS[name]
    assert (pulse.history([0.1, 0.5, 0.0, 0.7]) == 0.0).all()
    assert pulse.history([0.25])[0, 0] == pytest.approx(middle, rel=1e-14)
    assert pulse.history([0.35])[0, 0] == pytest.approx(middle, rel=1e-14)
    edges = (0.1, *pulse.breakpoints(0.1, 0.5), 0.5)
    total = math.fsum(quad(lambda t: pulse.history(t)[0, 0], *span, epsabs=1e-14)[0]
                      for span in pairwise(edges))
    assert total == pytest.approx(impulse, rel=1e-10)


def test_breakpoints_of_pulses():
    assert SIGNALS["half-sine"].breakpoints(0.0, 1.0) == pytest.approx((0.1, 0.5))
    assert SIGNALS["triangle"].breakpoints(0.0, 1.0) == pytest.approx((0.1, 0.3, 0.5))
    assert SIGNALS["rectangle"].breakpoints(0.0, 1.0) == pytest.approx((0.1, 0.104, 0.496, 0.5))
    assert SIGNALS["rectangle"].breakpoints(0.2, 0.499) == pytest.approx((0.496,))
    # Steps end where it begins and ends: it need not shorten those before and after.
    assert SIGNALS["triangle"].shortest_period is None


def test_tables_go_through_their_values():
    for name, values, scale in (("lines", VALUES, 1.0), ("repeated lines", CLOSED, 1.0),
                                ("curve", VALUES, 0.1), ("repeated curve", CLOSED, 1.0)):
        np.testing.assert_allclose(SIGNALS[name].history(TIMES)[:, 0], scale * values, atol=1e-13)


def test_tables_hold_or_repeat_outside():
    period = TIMES[-1] - TIMES[0]
    t = np.linspace(TIMES[0], TIMES[-1], 57)
    for name in ("lines", "curve"):
        table = SIGNALS[name]
        first, last = table.scale * VALUES[[0, -1]]
        np.testing.assert_array_equal(table.history([-9.0, TIMES[0] - 1e-9]), [[first, 0.0]] * 2)
        np.testing.assert_allclose(table.history([TIMES[-1] + 1e-9, 99.0]), [[last, 0.0]] * 2,
                                   rtol=1e-13)
        assert table.fundamental_hz is None
    for name in ("repeated lines", "repeated curve"):
        table = SIGNALS[name]
        for k in (-2, 5):
            np.testing.assert_allclose(table.history(t + k * period)[:, 0], table.history(t)[:, 0],
                                       atol=1e-11)
        assert table.fundamental_hz == pytest.approx(1.0 / period, rel=1e-15)


def test_lines_are_those_of_interpolation():
    t = RNG.uniform(-1.0, 3.0, 300)
    np.testing.assert_allclose(SIGNALS["lines"].history(t)[:, 0], np.interp(t, TIMES, VALUES),
                               atol=1e-13)


@pytest.mark.parametrize("name", ["curve", "repeated curve"])
def test_rate_of_a_curve_has_no_kinks(name):
    table, step = SIGNALS[name], 1e-9
    joints = np.concatenate([TIMES, TIMES + (TIMES[-1] - TIMES[0])])
    left, right = (table.history(joints + sign * step)[:, 1] for sign in (-1, 1))
    np.testing.assert_allclose(right, left, rtol=0, atol=1e-4)
    # Between the ends the second derivative has none either.
    inner = TIMES[1:-1]
    h = 1e-5
    bends = [(table.history(inner + 2 * s * h) - table.history(inner + s * h))[:, 1] / (s * h)
             for s in (-1, 1)]
    scale = np.abs(bends).max()
    np.testing.assert_allclose(bends[0], bends[1], rtol=0, atol=2e-2 * scale)


def test_breakpoints_of_tables():
    assert SIGNALS["lines"].breakpoints(-5.0, 5.0) == tuple(TIMES)
    assert SIGNALS["lines"].breakpoints(TIMES[3], TIMES[6]) == tuple(TIMES[4:6])
    # So few values that steps from one to the next are fewer than those of a smooth curve.
    assert SIGNALS["curve"].breakpoints(-5.0, 5.0) == tuple(TIMES)
    smooth = Tabulated(np.linspace(0.0, 3.0, 301), np.sin(np.linspace(0.0, 3.0, 301)),
                       interpolation="cubic")
    assert smooth.breakpoints(-5.0, 5.0) == (0.0, 3.0)
    period = TIMES[-1] - TIMES[0]
    points = SIGNALS["repeated lines"].breakpoints(TIMES[0] + 0.001, TIMES[0] + 2 * period + 0.001)
    expected = [*TIMES[1:], *(TIMES[1:] + period)]
    assert points == pytest.approx(expected, abs=1e-13)


def test_shortest_period_of_a_sampled_sine():
    t = np.linspace(0.0, 3.0, 301)
    values = 2.0 * np.cos(2.0 * np.pi * 4.0 * t)
    table = Tabulated(t, values, interpolation="cubic")
    assert table.shortest_period == pytest.approx(0.25, rel=1e-5)
    assert table.largest == pytest.approx(2.0, rel=1e-2)
    # Straight lines from one breakpoint to the next need no shorter steps.
    assert Tabulated(t, values).shortest_period is None
    flat = Tabulated((0.0, 1.0, 3.0), (2.0, 2.0, 2.0), interpolation="cubic")
    assert flat.shortest_period is None
    assert flat.breakpoints(-1.0, 4.0) == (0.0, 3.0)


@pytest.mark.parametrize("outside", ["hold", "repeat"])
def test_steps_end_with_the_steep_piece_of_a_smooth_curve(outside):
    """A jump within one of 300 pieces leaves the others the long steps of their sine."""
    t = np.linspace(0.0, 3.0, 301)
    values = np.sin(2.0 * np.pi * t) + 0.8 * (t > 1.495)
    if outside == "repeat":
        values = np.sin(2.0 * np.pi * t) + 0.8 * ((t > 1.495) & (t < 2.995))
    table = Tabulated(t, values, interpolation="cubic", outside=outside)
    points = table.breakpoints(-0.001, 2.999)
    assert {1.49, 1.5} <= {round(point, 9) for point in points}
    assert len(points) < 40
    assert 0.5 < table.shortest_period < 1.5
    again = table.breakpoints(2.999, 5.999)
    assert (outside == "repeat") == (len(again) == len(points))


def test_step():
    step = Step(0.4, 3.0)
    assert step.history([0.0, np.nextafter(0.4, 0.0), 0.4, 1.0])[:, 0].tolist() == [0, 0, 3, 3]
    assert step.breakpoints(0.0, 1.0) == (0.4,)
    assert step.breakpoints(0.4, 1.0) == ()
    assert (step.largest, step.shortest_period, step.fundamental_hz) == (3.0, None, None)
    with pytest.raises(InputError, match="Step: value = inf"):
        Step(0.0, float("inf"))


def test_table_from_a_file(tmp_path):
    path = tmp_path / "shaker.csv"
    path.write_text("t [s];x [mm]\n0,0;1,0\n0,5;2,0\n1,0;1,0\n", encoding="utf-8")
    table = Tabulated(file=str(path), outside="repeat", scale=1e-3)
    assert table == Tabulated((0.0, 0.5, 1.0), (1.0, 2.0, 1.0), outside="repeat", scale=1e-3)
    assert table.history(10.25)[0] == pytest.approx((1.5e-3, 2e-3), rel=1e-12)
    path.write_text("0 1\n1 2\n1 1\n")
    with pytest.raises(InputError, match=r"shaker.csv': times\[2\] = 1 must be larger than"):
        Tabulated(file=str(path))


@signal
def _square(t, p):
    return p[0] * t * t, 2.0 * p[0] * t


@dataclass(frozen=True)
class Parabola(Signal):
    kernel: ClassVar = _square
    factor: float


def test_signal_of_ones_own():
    assert Parabola(3.0).history([2.0]) == pytest.approx(np.array([[12.0, 12.0]]))
    assert Parabola(3.0).breakpoints(0.0, 1.0) == ()


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Constant(float("nan")), "Constant: value = nan"),
    (lambda: Constant("much"), "Constant: value = 'much'"),
    (lambda: Harmonic(1.0, -2.0), r"Harmonic: frequency_hz = -2\.0"),
    (lambda: Harmonic(1.0, 2.0 / TURN, None), "Harmonic: phase = None"),
    (lambda: Harmonics((), ()), "Harmonics: amplitudes has 0 values; at least 1"),
    (lambda: Harmonics((1.0, 2.0), (1.0,)), "frequencies_hz has 1 values for 2 amplitudes"),
    (lambda: Harmonics((1.0,), (1.0,), (1.0, 2.0)), "phases has 2 values for 1 amplitudes"),
    (lambda: Harmonics((1.0,), (-1.0,)), r"frequencies_hz\[0\] = -1\.0 must"),
    (lambda: SweptSine(1.0, -1.0, 2.0, 1.0), r"SweptSine: start_frequency_hz = -1\.0"),
    (lambda: SweptSine(1.0, 0.0, 2.0, 1.0, "logarithmic"), r"SweptSine: start_frequency_hz = 0\.0"),
    (lambda: SweptSine(1.0, 1.0, 2.0, 0.0), r"SweptSine: duration = 0\.0"),
    (lambda: SweptSine(1.0, 1.0, 2.0, 1.0, "log"), "kind = 'log' must be one of 'linear', 'logari"),
    (lambda: Pulse("sine", 1.0, 1.0), "Pulse: kind = 'sine' must be one of 'half-sine', 'haver"),
    (lambda: Pulse("triangle", float("inf"), 1.0), "Pulse: amplitude = inf"),
    (lambda: Pulse("triangle", 1.0, -1.0), r"Pulse: duration = -1\.0"),
    (lambda: Pulse("triangle", 1.0, 1.0, rise=0.1), r"rise = 0\.1 is for a rectangle"),
    (lambda: Pulse("rectangle", 1.0, 1.0, rise=0.6), r"rise = 0\.6 must be at most half of"),
    (lambda: Pulse("rectangle", 1.0, 1.0, rise=0.0), r"Pulse: rise = 0\.0"),
    (lambda: Tabulated((0, 1), (0, 1), interpolation="spline"), "interpolation = 'spline' must"),
    (lambda: Tabulated((0, 1), (0, 1), outside="zero"), "outside = 'zero' must be one of 'hold'"),
    (lambda: Tabulated((0, 1), (0, 1), outside="repeat"), "values must end as it begins to be"),
    (lambda: Tabulated((0, 1, 2), (0, 3, 3e-6), outside="repeat"), "values must end as it begins"),
    (lambda: Tabulated((0, 1), (0, 1), interpolation="cubic"), "times has 2 values; at least 3"),
    (lambda: Tabulated((0,), (0,)), "times has 1 value; at least 2 are needed"),
    (lambda: Tabulated((0, 1), (0, float("nan"))), r"values\[1\] = nan must be finite"),
    (lambda: Tabulated((0, 1), (0, 1), scale=float("nan")), "Tabulated: scale = nan"),
    (lambda: Tabulated((0, 1e-300, 1), (0, 1, 0)), "times has points 1e-300 apart"),
    (lambda: Tabulated((0, 1), (0, 1e9), scale=1e300), r"scale = 1e\+300 must be a number from"),
    (lambda: Tabulated((0, 1), (0, 1e9), scale=1e59), r"scale = 1e\+59 reaches 1e\+68"),
    (lambda: Tabulated(1.0, 2.0), r"times = 1\.0 must be a list of numbers"),
    (lambda: Tabulated((0, 1), (1, 2), file="a"), "file = 'a' cannot be combined with times"),
])
def test_values_are_checked(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_repeated_tables_close_but_for_rounding():
    table = Tabulated((0.0, 1.0, 2.0), (0.1, 3.1, 0.1 + 1e-12), outside="repeat")
    assert table.values == (0.1, 3.1, 0.1)
