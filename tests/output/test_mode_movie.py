"""Movies of modes: real ones stand, complex ones travel."""

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.image import imread
from synthetic import basis
from systems import rotor

from fecontact import InputError
from fecontact.analysis import ComplexModes, complex_modes
from fecontact.output.render.mode_movie import ModeMotion
from fecontact.plot import render_mode, rendering_problem

rendering = pytest.mark.skipif(rendering_problem() is not None, reason=str(rendering_problem()))


def phases(count):
    return 2.0 * np.pi * np.arange(count) / count


def test_largest_displacement_is_one_and_drawn_visibly():
    """An ellipse too: x = 3 cos t + 4 sin t and y = sin t, the longer half-axis."""
    field = basis().mode_shapes
    shape = np.zeros((len(field.nodes), 2), dtype=complex)
    shape[3] = 3.0 - 4.0j, -1.0j
    motion = ModeMotion(field, {1: shape}, phases(3600))
    sizes = [motion.body(frame)[1].max() for frame in range(0, 3600)]
    assert max(sizes) == pytest.approx(1.0, abs=1e-6)
    moved = max(np.abs(motion.body(frame)[0] - field.nodes).max() for frame in range(0, 3600, 10))
    assert moved == pytest.approx(0.08 * np.hypot(0.2, 0.02), rel=0.02)


def test_a_real_mode_stands_and_a_complex_one_travels():
    field = basis().mode_shapes
    x = field.nodes[:, 0] / np.ptp(field.nodes[:, 0])
    wave = np.exp(-2j * np.pi * x)[:, None] * [0.0, 1.0]
    upper = field.nodes[:, 1] == field.nodes[:, 1].max()
    top = [[motion.body(frame)[0][upper, 1].argmax() for frame in range(8)]
           for motion in (ModeMotion(field, {1: shape}, phases(8) + 0.1)
                          for shape in (wave, wave.real + 0j))]
    assert len(set(top[0])) >= 7
    assert len(set(top[1])) == 2


@rendering
def test_movie_and_pictures_of_a_complex_mode(tmp_path):
    body = basis(columns=20, rows=4)
    m = body.modes
    rng = np.random.default_rng(1)
    K = np.diag(np.arange(1.0, m + 1.0)) * 1e6 + 1e5 * rng.standard_normal((m, m))
    modes = ComplexModes.of(np.block([[np.zeros((m, m)), np.eye(m)], [-K, -np.eye(m)]]))
    path = render_mode(body, tmp_path / "mode.mp4", 1, modes=modes, frames=6, periods=2,
                       size=(320, 180))
    assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 12
    first = render_mode(body, tmp_path / "mode.png", 1, modes=modes, frames=4, size=(320, 180))
    names = sorted(path.name for path in tmp_path.glob("*.png"))
    assert names == [f"mode_000{k}.png" for k in range(4)]
    assert first.name == names[0]
    images = [imread(tmp_path / name) for name in names]
    assert all((image != images[0]).any() for image in images[1:])


def test_what_cannot_be_drawn(tmp_path):
    body = basis()
    for options, words in (({"mode": 99}, "mode = 99 must be the number of one of"),
                           ({"frames": 1}, "frames = 1 must be a whole number, 2 or above"),
                           ({"periods": 0}, "periods = 0 must be a whole number, 1 or above"),
                           ({"modes": complex_modes(rotor(1.0))}, "complex modes have 4 states")):
        with pytest.raises(InputError, match=words):
            render_mode(body, tmp_path / "mode.mp4", **options)
    with pytest.raises(InputError, match="holds no shapes over the body"):
        render_mode(rotor(1.0), tmp_path / "mode.mp4")
