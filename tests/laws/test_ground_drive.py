"""Ground, drive and load: motions, profiles, values out of range."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from systems import TURN

from fecontact import Drive, Ground, InputError, Load, PointLoad
from fecontact.laws import (
    Constant,
    Flat,
    FourierSeries,
    Harmonic,
    Harmonics,
    HarmonicSpeed,
    RandomRoughness,
    Sine,
    SpeedRamp,
    SweptSine,
)


def profile(ground, xi):
    return ground.profile_kernel.python(xi, ground.profile_parameters())


def travel(ground, t):
    return ground.motion_kernel.python(t, ground.motion_parameters())


def test_sine_ground_by_hand():
    ground = Ground(speed=1e-3, amplitude=200e-6, wavelength=2.5e-3)
    # An eighth of the wavelength: 45 degrees.
    height, slope, curvature = profile(ground, 2.5e-3 / 8.0)
    k = 2.0 * math.pi / 2.5e-3
    root = math.sqrt(0.5)
    assert (height, slope, curvature) == pytest.approx(
        (200e-6 * root, 200e-6 * root * k, -200e-6 * root * k**2), rel=1e-12)
    assert ground.steepest_slope == pytest.approx(0.5026548245743669, rel=1e-14)
    assert profile(ground, 0.0)[:2] == pytest.approx((0.0, 0.5026548245743669), rel=1e-12)


@pytest.mark.parametrize("xi", [-0.7e-3, 0.0, 0.31e-3, 1.9e-3, 12.34e-3])
def test_slope_and_curvature_are_derivatives(xi):
    ground = Ground(amplitude=1e-4, wavelength=2.5e-3)
    step = 1e-6
    low, here, high = (profile(ground, xi + k * step) for k in (-1, 0, 1))
    assert here[1] == pytest.approx((high[0] - low[0]) / (2 * step), abs=1e-5 * 0.25)
    assert here[2] == pytest.approx((high[1] - low[1]) / (2 * step), abs=1e-5 * 640.0)


def test_ground_travels_at_its_speed():
    ground = Ground(speed=-0.3, amplitude=1e-4, wavelength=0.02)
    assert travel(ground, 0.25) == pytest.approx((-0.075, -0.3), rel=1e-15)
    x = np.linspace(-0.1, 0.1, 7)
    for t in (0.0, 0.4, 1.7):
        expected = [1e-4 * math.sin(2.0 * math.pi * (a + 0.3 * t) / 0.02) for a in x]
        assert ground.height(x, t) == pytest.approx(expected, abs=1e-16)
        kernel = [profile(ground, a - travel(ground, t)[0])[0] for a in x]
        assert ground.height(x, t) == pytest.approx(kernel, abs=1e-16)


def test_flat_ground():
    assert profile(Ground(), 0.123) == (0.0, 0.0, 0.0)
    assert (Ground(speed=1.0).height(np.linspace(0, 1, 5), 0.3) == 0.0).all()
    assert Ground().steepest_slope == 0.0


def test_drive():
    drive = Drive(10.0, 20.0, 1.0, 2.0, 0.5e-3, -0.47e-3, 13.8 / TURN)
    for motion, amplitude in zip(drive.motions, (0.5e-3, -0.47e-3, 0.0), strict=True):
        for t in (0.0, 0.1, 3.3):
            value, rate = motion.kernel.python(t, motion.parameters())
            assert value == pytest.approx(amplitude * math.sin(13.8 * t), abs=1e-18)
            assert rate == pytest.approx(amplitude * 13.8 * math.cos(13.8 * t), abs=1e-16)
    assert drive.fundamental_hz == pytest.approx(13.8 / TURN, rel=1e-15)


MOTIONS = [
    None,
    HarmonicSpeed(0.7, 5.0 / TURN, 0.4),
    HarmonicSpeed(0.2, 5.0 / TURN, -1.0),
    SpeedRamp(1.5, 0.5, 2.0),
    SpeedRamp(-0.6, -1.0, 1.7),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=str)
@pytest.mark.parametrize("time", [-2.0, 0.3, 1.2, 9.0])
def test_travel_is_the_integral_of_the_speed(motion, time):
    ground = Ground(speed=0.3, motion=motion)
    kinks = [t for t in ground.breakpoints(-99.0, 99.0) if min(0.0, time) < t < max(0.0, time)]
    expected = quad(ground.velocity, 0.0, time, points=kinks or None, epsabs=1e-13)[0]
    assert ground.travel(time) == pytest.approx(expected, abs=1e-11)
    assert travel(ground, time) == (ground.travel(time), ground.velocity(time))
    assert ground.travel(0.0) == 0.0


def test_speeds_by_hand():
    ramp = Ground(speed=0.3, motion=SpeedRamp(1.5, 0.5, 2.0))
    assert [ramp.velocity(t) for t in (0.0, 0.5, 1.0, 2.5, 7.0)] == pytest.approx(
        [0.3, 0.3, 0.6, 1.5, 1.5])
    assert ramp.travel(3.0) == pytest.approx(0.15 + 0.9 * 2.0 + 0.75, rel=1e-14)
    assert ramp.breakpoints(0.0, 9.0) == (0.5, 2.5)
    assert ramp.breakpoints(0.5, 2.0) == ()
    swing = Ground(speed=0.3, motion=HarmonicSpeed(0.7, 5.0 / TURN, 0.4))
    assert swing.velocity(0.1) == pytest.approx(0.3 + 0.7 * math.sin(0.9), rel=1e-15)
    # A small travel is not lost against the terms whose difference it is.
    slow = Ground(motion=HarmonicSpeed(1.0, 1e-6 / TURN, 0.5 * math.pi))
    assert slow.travel(1e-3) == pytest.approx(1e-3, rel=1e-12)


@pytest.mark.parametrize("motion", MOTIONS, ids=str)
@pytest.mark.parametrize("span", [(0.0, 0.1), (0.0, 0.5), (0.4, 1.1), (-3.0, 8.0)])
def test_largest_speed(motion, span):
    ground = Ground(speed=-0.3, motion=motion)
    speeds = [abs(ground.velocity(t)) for t in np.linspace(*span, 4001)]
    assert ground.largest_speed(*span) == pytest.approx(max(speeds), rel=1e-5)
    assert ground.largest_speed(*span) >= max(speeds) * (1.0 - 1e-15)


def test_ground_with_a_profile():
    wave = FourierSeries(2.5e-3, (1e-4, 2e-5), (0.0, 1.0))
    ground = Ground(speed=0.2, wavelength=9.0, profile=wave, motion=SpeedRamp(1.0, 0.0, 1.0))
    x = np.linspace(-0.01, 0.01, 9)
    np.testing.assert_array_equal(ground.height(x, 0.7), wave.height(x - ground.travel(0.7)))
    assert ground.height(0.003).shape == ()
    assert ground.wavy
    assert profile(ground, 1e-3) == pytest.approx(tuple(wave.shape(1e-3)), rel=1e-12)
    assert ground.steepest_slope == wave.steepest_slope
    assert ground.height_range == wave.height_range
    assert ground.shortest_wavelength == 1.25e-3
    sine = Ground(amplitude=1e-4, wavelength=0.02)
    assert sine.height_range == (-1e-4, 1e-4)
    assert sine.shortest_wavelength == 0.02
    np.testing.assert_array_equal(sine.height(x), Ground(profile=Sine(1e-4, 0.02)).height(x))
    for flat in (Ground(), Ground(profile=Flat()), Ground(profile=Sine(0.0, 1.0))):
        assert not flat.wavy
        assert flat.shortest_wavelength is None
        assert flat.height_range == (0.0, 0.0)


@pytest.mark.parametrize("variation", [
    Sine(0.5, 0.1), FourierSeries(0.1, (0.3, 0.3)), RandomRoughness(0.1, 0.8, 0.1, 0.01, 1.0)])
def test_friction_varies_along_the_ground(variation):
    ground = Ground(friction_variation=variation)
    for xi in (-0.03, 0.011, 2.34):
        factor, *rest = ground.friction_scale_kernel.python(xi, ground.friction_scale_parameters())
        height, *same = variation.shape(xi)
        assert factor == pytest.approx(1.0 + height, rel=1e-13)
        assert rest == pytest.approx(same, rel=1e-9)
    assert not ground.wavy
    assert ground.shortest_wavelength == variation.shortest_wavelength
    assert Ground(amplitude=1e-6, friction_variation=variation).shortest_wavelength == 2.5e-3
    assert Ground().friction_scale_kernel is None


def test_variation_that_reaches_zero_friction():
    assert Ground(friction_variation=Sine(1.0, 0.1)).friction_variation.amplitude == 1.0
    for variation in (Sine(1.01, 0.1), FourierSeries(0.1, (0.9, 0.5)),
                      RandomRoughness(0.5, 0.8, 0.1, 0.01, 1.0)):
        low = variation.height_range[0]
        assert low < -1.0
        with pytest.raises(InputError, match=r"variation falls to -1\..* negative; its lowest"):
            Ground(friction_variation=variation)


def test_motions_of_the_drive():
    shake = SweptSine(1e-3, 1.0, 50.0, 10.0)
    drive = Drive(10.0, 20.0, motion_x=shake, amplitude_y=1e-4, frequency_hz=6.0 / TURN)
    assert drive.motions == (shake, Harmonic(1e-4, 6.0 / TURN), Harmonic(0.0, 6.0 / TURN))
    assert drive.fundamental_hz == 6.0 / TURN
    assert Drive(motion_x=shake).fundamental_hz == 0.0
    # A frequency without an amplitude moves nothing beside a given motion.
    assert Drive(motion_x=shake, frequency_hz=6.0).fundamental_hz == 0.0
    assert Drive(motion_y=Harmonic(1.0, 3.0), frequency_hz=6.0).fundamental_hz == 3.0
    assert Drive(frequency_hz=6.0).fundamental_hz == 6.0
    assert Drive(motion_y=Harmonics((1.0, 1.0), (3.0, 6.0))).fundamental_hz == 3.0


def test_loads_at_points():
    force = PointLoad("B", "x", signal=Harmonic(2.0, 3.0 / TURN))
    load = Load(5.0, [force, PointLoad(3, "phi", signal=Constant(1.0))])
    assert load.forces[0] is force
    assert load == Load(5.0, (force, PointLoad(3, "phi", signal=Constant(1.0))))
    assert hash(load) == hash(Load(5.0, load.forces))
    usual = PointLoad(signal=Constant(1.0))
    assert (usual.point, usual.component) == ("C", "y")


@pytest.mark.parametrize(("kind", "values", "message"), [
    (Ground, {"speed": float("nan")}, "Ground: speed = nan must be finite"),
    (Ground, {"amplitude": -1e-6}, "Ground: amplitude = -1e-06 must be a finite number, zero"),
    (Ground, {"amplitude": float("inf")}, "amplitude = inf"),
    (Ground, {"wavelength": 0.0}, r"Ground: wavelength = 0\.0 must be a finite number above"),
    (Ground, {"wavelength": float("nan")}, "wavelength = nan"),
    (Drive, {"stiffness_x": -1.0}, r"Drive: stiffness_x = -1\.0"),
    (Drive, {"stiffness_y": float("inf")}, "stiffness_y = inf"),
    (Drive, {"damping_x": -1e-3}, "damping_x"), (Drive, {"damping_y": -1e-3}, "damping_y"),
    (Drive, {"frequency_hz": -1.0}, "frequency_hz"),
    (Drive, {"amplitude_x": float("nan")}, "Drive: amplitude_x = nan must be finite"),
    (Drive, {"amplitude_y": float("inf")}, "amplitude_y = inf"),
    (Load, {"normal": float("nan")}, "Load: normal = nan must be finite"),
    (Ground, {"speed": "fast"}, "speed = 'fast'"),
    (Ground, {"wavelength": None}, "wavelength = None"),
    (Drive, {"stiffness_x": "stiff"}, "stiffness_x = 'stiff'"),
    (Drive, {"amplitude_x": "wide"}, "amplitude_x = 'wide'"),
    (Load, {"normal": "heavy"}, "normal = 'heavy'"),
    (Ground, {"amplitude": 1e-3, "profile": Flat()}, r"amplitude = 0\.001 cannot be combined with"),
    (Ground, {"profile": "sine"}, "Ground: profile = 'sine' must be a Profile"),
    (Ground, {"motion": Constant(1.0)}, "motion = .* must be a GroundMotion"),
    (Ground, {"friction_variation": 0.1}, r"friction_variation = 0\.1 must be a Profile"),
    (HarmonicSpeed, {"amplitude": 1.0, "frequency_hz": 0.0}, r"frequency_hz = 0\.0"),
    (HarmonicSpeed, {"amplitude": None, "frequency_hz": 1.0 / TURN}, "amplitude = None"),
    (SpeedRamp, {"end_speed": 1.0, "start": 0.0, "duration": 0.0}, r"SpeedRamp: duration = 0\.0"),
    (SpeedRamp, {"end_speed": float("nan"), "start": 0.0, "duration": 1.0}, "end_speed = nan"),
    (Drive, {"amplitude_x": 1.0, "motion_x": Constant(1.0)}, r"amplitude_x = 1\.0 cannot be com"),
    (Drive, {"motion_y": 3.0}, r"Drive: motion_y = 3\.0 must be a Signal"),
    (Drive, {"motion_x": Constant(), "motion_y": Constant(), "frequency_hz": 2.0},
     r"frequency_hz = 2\.0 has no effect"),
    (PointLoad, {"component": "w", "signal": Constant()}, "component = 'w' must be one of 'phi'"),
    (PointLoad, {"component": (0.0, 0.0), "signal": Constant()},
     r"component = \(0\.0, 0\.0\) must be longer than zero"),
    (PointLoad, {"component": (1.0,), "signal": Constant()}, r"component = \(1\.0,\) must be"),
    (PointLoad, {"component": (1.0, np.nan), "signal": Constant()}, "PointLoad: component = "),
    (PointLoad, {"point": 1.5, "signal": Constant()}, r"point = 1\.5 must be the name"),
    (PointLoad, {"signal": "3"}, r"PointLoad: signal = '3' must be a Signal, .*, or a number"),
    (Load, {"forces": (Constant(),)}, "Load: forces = .* must be a list of PointLoad"),
])
def test_values_are_checked(kind, values, message):
    with pytest.raises(InputError, match=message):
        kind(**values)
