"""Ground, drive and load: motions, profiles, values out of range."""

import math

import numpy as np
import pytest

from fecontact.errors import InputError
from fecontact.laws.drive import Drive, Load
from fecontact.laws.ground import Ground


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
    drive = Drive(10.0, 20.0, 1.0, 2.0, 0.5e-3, -0.47e-3, 13.8)
    for motion, amplitude in zip(drive.motions, (0.5e-3, -0.47e-3), strict=True):
        for t in (0.0, 0.1, 3.3):
            value, rate = motion.kernel.python(t, motion.parameters())
            assert value == pytest.approx(amplitude * math.sin(13.8 * t), abs=1e-18)
            assert rate == pytest.approx(amplitude * 13.8 * math.cos(13.8 * t), abs=1e-16)
    assert drive.frequency_hz == pytest.approx(13.8 / (2.0 * math.pi), rel=1e-15)


@pytest.mark.parametrize(("kind", "values", "message"), [
    (Ground, {"speed": float("nan")}, "Ground: speed = nan must be finite"),
    (Ground, {"amplitude": -1e-6}, "Ground: amplitude = -1e-06 must be a finite number, zero"),
    (Ground, {"amplitude": float("inf")}, "amplitude = inf"),
    (Ground, {"wavelength": 0.0}, r"Ground: wavelength = 0\.0 must be a finite number above"),
    (Ground, {"wavelength": float("nan")}, "wavelength = nan"),
    (Drive, {"stiffness_x": -1.0}, r"Drive: stiffness_x = -1\.0"),
    (Drive, {"stiffness_y": float("inf")}, "stiffness_y = inf"),
    (Drive, {"damping_x": -1e-3}, "damping_x"), (Drive, {"damping_y": -1e-3}, "damping_y"),
    (Drive, {"angular_frequency": -1.0}, "angular_frequency"),
    (Drive, {"amplitude_x": float("nan")}, "Drive: amplitude_x = nan must be finite"),
    (Drive, {"amplitude_y": float("inf")}, "amplitude_y = inf"),
    (Load, {"normal": float("nan")}, "Load: normal = nan must be finite"),
    (Ground, {"speed": "fast"}, "speed = 'fast'"),
    (Ground, {"wavelength": None}, "wavelength = None"),
    (Drive, {"stiffness_x": "stiff"}, "stiffness_x = 'stiff'"),
    (Drive, {"amplitude_x": "wide"}, "amplitude_x = 'wide'"),
    (Load, {"normal": "heavy"}, "normal = 'heavy'"),
])
def test_values_are_checked(kind, values, message):
    with pytest.raises(InputError, match=message):
        kind(**values)
