"""Profiles of the ground: derivatives, closed forms, continuity, values out of range."""

import math
import pickle
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import ClassVar

import numpy as np
import pytest

from fecontact import Ground, InputError
from fecontact.laws import (
    Flat,
    FourierSeries,
    MeasuredProfile,
    Profile,
    RandomRoughness,
    Sine,
    ground_profile,
)

RNG = np.random.default_rng(3)
TRACE_X = np.cumsum(RNG.uniform(0.5e-4, 2e-4, 40)) - 1e-3
TRACE_Y = 1e-5 * RNG.standard_normal(40)
CLOSED_Y = np.append(TRACE_Y[:-1], TRACE_Y[0])

PROFILES = {
    "flat": Flat(),
    "sine": Sine(1e-4, 2.5e-3, 0.7),
    "fourier": FourierSeries(2.5e-3, (1e-4, 0.0, -3e-5, 1e-5), (0.3, 0.0, 2.0, -1.0)),
    "trace": MeasuredProfile(TRACE_X, TRACE_Y),
    "periodic trace": MeasuredProfile(TRACE_X, CLOSED_Y, periodic=True, remove_mean=True,
                                      scale=2.0),
    "random": RandomRoughness(1e-6, 0.8, 2e-3, 1e-4, 1e-2, seed=5),
}


@pytest.fixture(params=PROFILES.values(), ids=PROFILES.keys())
def profile(request):
    return request.param


def places(profile, count=400):
    """Abscissae over several periods, and for traces beyond the ends and on the knots."""
    length = getattr(profile, "wavelength", getattr(profile, "length", 1e-2))
    return np.concatenate([RNG.uniform(-2.0, 2.0, count) * length, TRACE_X,
                           RNG.uniform(-1.2e-3, 6e-3, count)])


def test_slope_and_curvature_are_derivatives(profile):
    xi = places(profile)
    wave = profile.shortest_wavelength or 1.0
    step = 1e-4 * min(wave, 1e-4)
    low, here, high = (profile.shape(xi + k * step) for k in (-1, 0, 1))
    for order in (0, 1):
        difference = (high[:, order] - low[:, order]) / (2.0 * step)
        scale = np.abs(here[:, order + 1]).max() or 1.0
        # Curvature has kinks on the knots of a trace.
        np.testing.assert_allclose(difference, here[:, order + 1], rtol=0, atol=2e-4 * scale)


def test_plain_and_compiled_agree(profile):
    xi = places(profile, 40)
    plain = [profile.kernel.python(x, profile.parameters()) for x in xi.tolist()]
    compiled = profile.shape(xi)
    for order in range(3):
        scale = np.abs(compiled[:, order]).max()
        np.testing.assert_allclose(np.array(plain)[:, order], compiled[:, order], rtol=0,
                                   atol=1e-13 * scale)
    np.testing.assert_array_equal(profile.height(xi.reshape(2, -1)),
                                  compiled[:, 0].reshape(2, -1))


def test_ranges_are_those_of_a_dense_sampling(profile):
    xi = np.linspace(-2e-3, 1.1e-2, 400_001)
    y, slope, _ = profile.shape(xi).T
    low, high = profile.height_range
    size = high - low or 1.0
    # Dense samples miss a top by little, and never exceed it.
    assert low <= y.min() + 1e-12 * size
    assert high >= y.max() - 1e-12 * size
    assert (low, high) == pytest.approx((y.min(), y.max()), abs=1e-5 * size)
    steepest = np.abs(slope).max()
    assert profile.steepest_slope >= steepest * (1.0 - 1e-12)
    assert profile.steepest_slope == pytest.approx(steepest, rel=1e-5)
    assert profile.flat == (y.max() == y.min())


def test_level_is_added(profile):
    raised = profile.parameters()
    raised[0] += 1.0
    for xi in (-3e-3, 0.0, 1.23e-3):
        height, *rest = profile.kernel.python(xi, profile.parameters())
        other, *same = profile.kernel.python(xi, raised)
        assert other - height == pytest.approx(1.0, abs=1e-15)
        assert same == rest


def test_profiles_are_values(profile):
    _ = profile.height_range
    again = pickle.loads(pickle.dumps(profile))
    assert again == profile == replace(profile)
    assert hash(again) == hash(profile)
    np.testing.assert_array_equal(again.shape([1e-3]), profile.shape([1e-3]))


def test_sine_by_hand():
    # An eighth of the wavelength: 45 degrees.
    k, root = 2.0 * math.pi / 2.5e-3, math.sqrt(0.5)
    assert Sine(2e-4, 2.5e-3).shape(2.5e-3 / 8.0) == pytest.approx(
        np.array([2e-4 * root, 2e-4 * root * k, -2e-4 * root * k**2]), rel=1e-12)
    assert Sine(2e-4, 2.5e-3, math.pi / 2).height(0.0) == pytest.approx(2e-4, rel=1e-15)
    assert Sine(2e-4, 2.5e-3).shortest_wavelength == 2.5e-3


def direct_sum(wavelength, amplitudes, phases, xi):
    """Height, slope, curvature (N, 3) by sines and cosines of each wave."""
    k = 2.0 * np.pi / wavelength * np.arange(1, len(amplitudes) + 1)
    angle = np.outer(xi, k) + phases
    return np.stack([np.sin(angle) @ amplitudes, np.cos(angle) @ (k * amplitudes),
                     -np.sin(angle) @ (k**2 * amplitudes)], axis=1)


@pytest.mark.parametrize("count", [1, 7, 100])
def test_fourier_series_is_the_direct_sum(count):
    rng = np.random.default_rng(count)
    amplitudes, phases = rng.standard_normal(count), rng.uniform(-9, 9, count)
    series = FourierSeries(0.3, tuple(amplitudes), tuple(phases))
    # Within one period either way; further off the sum of sines is itself not so exact.
    xi = rng.uniform(-0.3, 0.3, 500)
    expected = direct_sum(0.3, amplitudes, phases, xi)
    got = series.shape(xi)
    for order in range(3):
        k = (2.0 * np.pi / 0.3 * np.arange(1, count + 1)) ** order
        np.testing.assert_allclose(got[:, order], expected[:, order], rtol=0,
                                   atol=1e-13 * np.abs(k * amplitudes).sum())
    assert series.rms_height == pytest.approx(math.sqrt((amplitudes**2).sum() / 2), rel=1e-14)
    assert series.shortest_wavelength == pytest.approx(0.3 / count, rel=1e-15)


@pytest.mark.parametrize("xi", [1234.56789, -98765.4321, 3.3e7])
def test_far_away_nothing_is_lost(xi):
    wavelength = 2.5e-3
    rest = Fraction(xi) % Fraction(wavelength)
    for profile in (Sine(1.0, wavelength, 0.4),
                    FourierSeries(wavelength, (1.0, 0.5, 0.25), (0.4, 1.0, 2.0))):
        difference = profile.shape(xi) - profile.shape(float(rest))
        k = 2.0 * math.pi / wavelength
        np.testing.assert_allclose(difference / [1.0, k, k**2], 0.0, atol=2e-14)


def test_extremes_of_a_known_sum():
    # sin x + sin(2 x) / 2 is largest at x = pi / 3: 3 sqrt(3) / 4; its slope at x = 0: 2.
    series = FourierSeries(2.0 * math.pi, (1.0, 0.5))
    top = 0.75 * math.sqrt(3.0)
    assert series.height_range == pytest.approx((-top, top), rel=1e-14)
    assert series.steepest_slope == pytest.approx(2.0, rel=1e-14)
    assert FourierSeries(1.0, (0.0,)).flat
    assert FourierSeries(1.0, (0.0,)).height_range == (0.0, 0.0)
    assert FourierSeries(1.0, (1.0, 0.2, 0.0)).shortest_wavelength == 0.5


def test_trace_goes_through_its_points():
    trace = MeasuredProfile(TRACE_X, TRACE_Y, scale=3.0, abscissa_scale=0.5)
    np.testing.assert_allclose(trace.height(0.5 * TRACE_X), 3.0 * TRACE_Y, rtol=0, atol=1e-19)


def test_spline_of_a_sine_is_the_sine():
    x = np.linspace(0.0, 1.0, 101)
    y = np.sin(2.0 * np.pi * x)
    trace = MeasuredProfile(x, y, periodic=True)
    xi = np.linspace(-3.0, 5.0, 997)
    k = 2.0 * np.pi
    # Errors of a cubic spline: 5/384 h^4 y'''', and h^2 / 12 of the curvature.
    np.testing.assert_allclose(trace.height(xi), np.sin(k * xi), atol=1.1 * 5 / 384 * (k / 100)**4)
    np.testing.assert_allclose(trace.shape(xi)[:, 2], -k**2 * np.sin(k * xi),
                               atol=k**2 * (k / 100) ** 2 / 8)
    assert trace.steepest_slope == pytest.approx(k, rel=1e-5)
    assert trace.shortest_wavelength == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("name", ["trace", "periodic trace"])
def test_trace_is_smooth_to_the_second_derivative(name):
    trace = PROFILES[name]
    joints = np.concatenate([
        TRACE_X, TRACE_X + (TRACE_X[-1] - TRACE_X[0]),
        TRACE_X[0] - (TRACE_X[1] - TRACE_X[0]) * np.array([1.0, 2.0]),
        TRACE_X[-1] + (TRACE_X[-1] - TRACE_X[-2]) * np.array([1.0, 2.0])])
    step = 1e-9 * (TRACE_X[1] - TRACE_X[0])
    left, right = trace.shape(joints - step), trace.shape(joints + step)
    scale = np.abs(trace.shape(np.linspace(-1e-3, 5e-3, 5000))).max(axis=0)
    np.testing.assert_allclose((right - left) / scale, 0.0, atol=1e-7)


def test_trace_is_level_beyond_its_ends():
    trace = PROFILES["trace"]
    first, last = TRACE_X[1] - TRACE_X[0], TRACE_X[-1] - TRACE_X[-2]
    rise, fall = trace.shape(TRACE_X[[0, -1]])[:, 1]
    before, after = trace.shape([TRACE_X[0] - 5 * first, TRACE_X[-1] + 5 * last])
    # The slope falls from its value at the end to zero, on average by half.
    assert before == pytest.approx(np.array([TRACE_Y[0] - rise * first, 0.0, 0.0]), rel=1e-12)
    assert after == pytest.approx(np.array([TRACE_Y[-1] + fall * last, 0.0, 0.0]), rel=1e-12)
    assert trace.shape(TRACE_X[[0, -1]])[:, 2] == pytest.approx(0.0, abs=1e-6)


def test_periodic_trace_repeats_and_has_no_mean():
    trace = PROFILES["periodic trace"]
    period = TRACE_X[-1] - TRACE_X[0]
    xi = np.linspace(TRACE_X[0], TRACE_X[-1], 20_001)
    y = trace.height(xi)
    assert np.trapezoid(y, xi) / period == pytest.approx(0.0, abs=1e-7 * np.ptp(y))
    np.testing.assert_allclose(trace.height(xi - 3 * period), y, atol=1e-12 * np.ptp(y))


def test_random_roughness_has_its_rms_and_spectrum():
    given = RandomRoughness(2e-6, 0.7, 1e-3, 1e-5, 2e-2, seed=11)
    count = 16384
    y = given.height(np.arange(count) * 2e-2 / count)
    assert math.sqrt((y**2).mean()) == pytest.approx(2e-6, rel=1e-12)
    assert y.mean() == pytest.approx(0.0, abs=1e-20)
    power = np.abs(np.fft.rfft(y)) ** 2
    # 20 waves per length up to the roll-off, 2000 at the cut-off.
    np.testing.assert_allclose(power[1:21] / power[1], 1.0, rtol=1e-9)
    slope = np.polyfit(np.log(np.arange(20, 2001)), np.log(power[20:2001]), 1)[0]
    assert slope == pytest.approx(-1.0 - 2.0 * 0.7, rel=1e-9)
    assert power[2001:].max() < 1e-20 * power[1]
    assert given.shortest_wavelength == pytest.approx(1e-5, rel=1e-12)


def test_random_roughness_is_normally_distributed():
    y = RandomRoughness(1.0, 0.5, 0.02, 0.001, 1.0, seed=2).height(np.linspace(0, 1, 4001)[:-1])
    assert (y**3).mean() == pytest.approx(0.0, abs=0.3)
    assert (y**4).mean() == pytest.approx(3.0, abs=0.3)


def test_seeds_reproduce():
    options = (1e-6, 0.8, 2e-3, 1e-4, 1e-2)
    first, same, other = (RandomRoughness(*options, seed=seed) for seed in (7, 7, 8))
    xi = np.linspace(0.0, 1e-2, 50)
    np.testing.assert_array_equal(first.height(xi), same.height(xi))
    assert np.abs(first.height(xi) - other.height(xi)).max() > 1e-7
    assert RandomRoughness(*options, seed=np.int64(7)) == first
    # Numbers that numpy's manual prints for this seed.
    published = RandomRoughness(*options, seed=12345).series.phases[:3]
    assert np.array(published) / (2.0 * math.pi) == pytest.approx(
        [0.22733602, 0.31675834, 0.79736546], abs=5e-9)


@pytest.mark.parametrize(("content", "x", "y"), [
    ("0 1\n1 2\n2.5 -3e-1\n", (0, 1, 2.5), (1, 2, -0.3)),
    ("x [m],y [m]\n0,1\n1,2\n2.5,-0.3\n", (0, 1, 2.5), (1, 2, -0.3)),
    ("\ufeffWeg;Höhe\nmm;um\n0,0;1\n1;2,0\n2,5;-0,3;\n", (0, 1, 2.5), (1, 2, -0.3)),
    ("# a trace\n\n0\t1,0\n1\t2 # here\n2,5\t-0,3", (0, 1, 2.5), (1, 2, -0.3)),
    ("Made 2024\nx 1 y 2\n7\n1 2 3\n0 1\n1 2\n2.5 -0.3\n", (0, 1, 2.5), (1, 2, -0.3)),
    ('"x","y"\r\n"0","1"\r\n"1","2,0"\r\n"2,5","-0.3"\r\n', (0, 1, 2.5), (1, 2, -0.3)),
])
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_traces_from_files(tmp_path, monkeypatch, content, x, y, encoding):
    content = content if encoding == "utf-8" else content.removeprefix("\ufeff")
    (tmp_path / "trace.csv").write_bytes(content.encode(encoding))
    monkeypatch.chdir(tmp_path)
    for file in ("trace.csv", str(tmp_path / "trace.csv")):
        trace = MeasuredProfile(file=file)
        assert trace == MeasuredProfile(x, y)
        assert trace.file is None
    assert (replace(MeasuredProfile(file="trace.csv", scale=2.0), scale=3.0)
            == MeasuredProfile(x, y, scale=3.0))


@pytest.mark.parametrize(("content", "message"), [
    ("0 1\n1 2\n1 3\n", r"abscissa\[2\] = 1 must be larger than the value before it, 1; sort"),
    ("0 1\n1 nan\n2 3\n", "line 2, '1 nan', has a value that is no finite number; each line must"),
    ("0 1\n1 2x\n2 3\n", "line 2, '1 2x', has a value that is no finite number"),
    ("a b\n1\n2\n", "has no line of just the numbers abscissa and heights; it begins with 'a b'"),
    ("a b\n0 1\n1\n2\n", "line 3, '1', has 1 column; each line must hold abscissa and heights"),
    ("0 1\n1 2 3\n", "line 2, '1 2 3', has 3 columns"),
    ("0 1\n1 2\nend\n", "line 3, 'end', has 1 column"),
    ("nan 1\n1 2\n", "line 1, 'nan 1', has a value that is no finite number"),
    ("0 1 2\n", "no line of just the numbers abscissa and heights; it begins with '0 1 2'"),
    ("0 1\n1 2\n", "abscissa has 2 values; at least 3 are needed"),
    ("only words\n", "has no line of just the numbers abscissa and heights; it begins"),
    ("", r"has no line of just the numbers abscissa and heights\.$"),
])
def test_bad_files(tmp_path, content, message):
    path = tmp_path / "bad.txt"
    path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        MeasuredProfile(file=str(path))
    assert str(caught.value).startswith(f"MeasuredProfile: file = '{path}'")
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match=r"file = 'none\.csv' cannot be read: No such file"):
        MeasuredProfile(file="none.csv")
    with pytest.raises(InputError, match="cannot be read"):
        MeasuredProfile(file=str(tmp_path))
    (tmp_path / "picture").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(InputError, match="cannot be read: it is not a text file"):
        MeasuredProfile(file=str(tmp_path / "picture"))


def test_smallest_and_largest_traces_have_curves():
    for scale in (1e-60, 1e59):
        for periodic in (False, True):
            trace = MeasuredProfile((0, 1, 2, 4), (0, 1, 2, 0), periodic=periodic, scale=scale,
                                    abscissa_scale=scale)
            assert np.isfinite(trace.parameters()).all()
            assert trace.height([scale]) == pytest.approx([scale], rel=1e-12)
            assert trace.shortest_wavelength > 0.0


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Sine(-1e-6, 1.0), "Sine: amplitude = -1e-06"),
    (lambda: Sine(1.0, 0.0), r"Sine: wavelength = 0\.0"),
    (lambda: Sine(1.0, 1.0, float("nan")), "Sine: phase = nan"),
    (lambda: FourierSeries(0.0, (1.0,)), "FourierSeries: wavelength"),
    (lambda: FourierSeries(1.0, ()), "amplitudes has 0 values; at least 1"),
    (lambda: FourierSeries(1.0, 1.0), r"amplitudes = 1\.0 must be a list of numbers"),
    (lambda: FourierSeries(1.0, "12"), "amplitudes = '12' must be a list of numbers"),
    (lambda: FourierSeries(1.0, (1.0, float("inf"))), r"amplitudes\[1\] = inf must be finite"),
    (lambda: FourierSeries(1.0, (1.0, 2.0), (0.0,)), "phases has 1 values for 2 amplitudes"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1)), "heights has 2 values for 3 abscissa"),
    (lambda: MeasuredProfile((0, 2, 1), (0, 1, 2)),
     r"MeasuredProfile: abscissa\[2\] = 1 must be larger"),
    (lambda: MeasuredProfile((0, 1, 2), (0, float("nan"), 2)),
     r"heights\[1\] = nan must be finite; repair"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), file="a.csv"),
     "cannot be combined with abscissa and heigh"),
    (lambda: MeasuredProfile(), "abscissa has 0 values; at least 3"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), periodic=True),
     "begins with 0 and ends with 2; add"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), abscissa_scale=0.0),
     "MeasuredProfile: abscissa_scale"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), abscissa_scale=1e-300),
     r"abscissa_scale = 1e-300 must be a number from 1e-60 to 1e\+60"),
    (lambda: MeasuredProfile((0, 1, 1 + 1e-15), (0, 1, 2), abscissa_scale=1e-59),
     "apart; their distances"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), abscissa_scale=1.7e308),
     "must be a number from 1e-60"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, -20), scale=1e308),
     r"scale = 1e\+308 must be a number from -1e\+60 to 1e\+60"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, -1e290), scale=1e50),
     r"scale = 1e\+50 reaches -inf; its va"),
    (lambda: MeasuredProfile((0, 1, 2), (0, 1, 2), periodic="yes"),
     "periodic = 'yes' must be True or Fal"),
    (lambda: MeasuredProfile(file=3), "file = 3 must be the name of a file"),
    (lambda: RandomRoughness(-1.0, 0.5, 0.1, 0.01, 1.0), "RandomRoughness: rms_height"),
    (lambda: RandomRoughness(1.0, 1.5, 0.1, 0.01, 1.0), r"hurst_exponent = 1\.5 must be from 0"),
    (lambda: RandomRoughness(1.0, 0.5, 0.001, 0.01, 1.0), r"roll_off_wavelength = 0\.001 must"),
    (lambda: RandomRoughness(1.0, 0.5, 2.0, 0.01, 1.0), r"roll_off_wavelength = 2\.0 must be fr"),
    (lambda: RandomRoughness(1.0, 0.5, 0.1, 1e-6, 1.0), "cut_off_wavelength = 1e-06 must be at"),
    (lambda: RandomRoughness(1.0, 0.5, 0.1, 0.01, 1.0, seed=-1), "seed = -1 must be a whole"),
    (lambda: RandomRoughness(1.0, 0.5, 0.1, 0.01, 1.0, seed=1.5), r"seed = 1\.5"),
])
def test_values_are_checked(make, message):
    with pytest.raises(InputError, match=message):
        make()


@ground_profile
def _unlevelled(xi, p):
    return p[1] * xi, p[1], 0.0


@dataclass(frozen=True)
class Slope(Profile):
    kernel: ClassVar = _unlevelled
    slope: float = 0.1
    height_range: ClassVar = (-0.1, 0.1)
    shortest_wavelength: ClassVar = 1.0


def test_profile_of_ones_own():
    assert Ground(profile=Slope()).height([2.0]) == pytest.approx([0.2])
    with pytest.raises(InputError, match="must add its first parameter to the height"):
        Ground(friction_variation=Slope())
