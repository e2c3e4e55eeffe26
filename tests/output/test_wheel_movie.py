"""Movies of whole wheels: what is drawn is the motion of all sectors."""

import imageio_ffmpeg
import numpy as np
import platform_damper as example
import pytest

from fecontact import ElasticBody, InputError
from fecontact.bifurcation.harmonic.wheel_orbits import WheelMotion
from fecontact.fem import CyclicSymmetry
from fecontact.output.render.wheel_movie import _of_mode, _of_response
from fecontact.plot import render_wheel, rendering_problem
from fecontact.reduction import sector_modes

rendering = pytest.mark.skipif(rendering_problem() is not None, reason=str(rendering_problem()))
N = example.N


@pytest.fixture(scope="module")
def modes():
    body = ElasticBody(example.blade_mesh(), thickness=0.03, fixed={"bore": "xy"})
    return sector_modes(body, CyclicSymmetry("low", "high", N), 2, diameters=[0, 3])


@pytest.fixture(scope="module")
def motion():
    """A response with three harmonics: of blades and dampers."""
    wheel = example.wheel(3)
    rng = np.random.default_rng(1)
    sizes = {h: len(wheel.of(-h * example.ORDER).stiffness) for h in (0, 1, 3)}
    return WheelMotion(wheel, example.ORDER, 1e-3, {
        h: rng.standard_normal(m) + (1j * rng.standard_normal(m) if h else 0.0)
        for h, m in sizes.items()})


def test_a_response_is_drawn_with_all_sectors_and_harmonics_but_its_mean(motion):
    drawn, words = _of_response(motion)
    assert words == "engine order 3, 1000 Hz"
    still = WheelMotion(motion.wheel, motion.order, motion.period, {0: motion.amplitudes[0]})
    for time in (0.0, 0.3e-3):
        expected = []
        for (places, moved), (_, mean) in zip(motion.on_wheel(time).values(),
                                              still.on_wheel(0.0).values(), strict=True):
            assert len(places) == N
            expected.append((moved - mean).reshape(-1, 2))
        found = drawn._moved(2.0 * np.pi * time / motion.period)
        expected = np.concatenate(expected)
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    largest, each = drawn._largest
    assert largest >= np.linalg.norm(expected, axis=1).max()
    assert (each >= np.abs(expected) - 0.01 * largest).all()


def test_a_mode_of_a_diameter_runs_around(modes):
    drawn, words = _of_mode(modes, 3, 0)
    assert words.startswith("diameter 3, 612.28")
    tips = np.linalg.norm(drawn.mode_shapes.nodes, axis=1) > 0.999 * example.TIP
    angle = np.arctan2(*drawn.mode_shapes.nodes[tips].T[::-1])
    around = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    # One wave of three lengths on the circle.
    waves = [((drawn._moved(phase)[tips] * around).sum(axis=1) * np.exp(-3j * angle)).sum()
             for phase in (0.0, 0.2)]
    assert abs(np.angle(waves[1] / waves[0])) == pytest.approx(0.2, abs=1e-3)
    wanted = modes.on_wheel(3, 0, 0.2).displacement
    assert np.abs(drawn._moved(0.2) - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_modes_that_are_not_there_are_named(modes, motion):
    with pytest.raises(InputError, match="diameter = 2 must be one of 0, 3"):
        render_wheel(modes, "m.mp4", 2)
    with pytest.raises(InputError, match="mode = 2 must be from 0 to 1"):
        render_wheel(modes, "m.mp4", 3, 2)
    with pytest.raises(InputError, match=r"h = 2 must be one of its harmonics, 0, 1 and 3|0, 1, 3"):
        motion.harmonic("blade", 2)


@rendering
def test_movies_have_their_frames(modes, motion, tmp_path):
    for wheel, arguments in ((modes, (3, 1)), (motion, ())):
        path = render_wheel(wheel, tmp_path / "wheel.mp4", *arguments, frames=4, periods=2,
                            size=(320, 320))
        assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 8
