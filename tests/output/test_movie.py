import os
import signal
from dataclasses import replace
from itertools import islice, pairwise

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.image import imread
from matplotlib.text import Text
from scipy.interpolate import CubicSpline
from synthetic import basis, run

from fecontact import (
    ContactSystem,
    InputError,
    MissingLibraryError,
    render,
    simulate,
)
from fecontact.analysis.sampling import between_outputs, coarse_frames_message
from fecontact.laws import ConstantFriction, Frictionless, RoughSurface
from fecontact.output.files.frames import frame_indices
from fecontact.output.render import encoder, movie
from fecontact.output.render import offscreen as probe
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.movie import frames_of
from fecontact.output.render.plane_parts import needed_height
from fecontact.output.render.run_overlay import RunOverlay
from fecontact.output.render.scene import NODE_COLOURS
from fecontact.output.render.scenes import scene_of
from fecontact.plot import STATE_COLOURS, picture

SMALL = (480, 270)

rendering = pytest.mark.skipif(probe.rendering_problem() is not None,
                               reason=str(probe.rendering_problem()))


def motion_of(trajectory, frames=50, **options):
    return Motion(trajectory, frame_indices(trajectory.time, frames), **options)


def still(q, **options):
    """A run of a small beam at given modal coordinates (F, 5)."""
    trajectory = run(basis(columns=20, rows=4), times=len(q), **options)
    q = np.asarray(q, dtype=float)
    return type(trajectory)(trajectory.system, trajectory.time, q, np.zeros_like(q),
                            trajectory.work)


def around(furniture, frame=0):
    """The whole picture around a white scene."""
    return furniture.around(np.full((1, 1, 3), 255, np.uint8), frame)


def footer(motion):
    return around(RunOverlay(motion, 960, 540))[-68:]


def texts(furniture):
    return [text.get_text() for text in furniture.figure.findobj(Text)]


def rgb(text):
    return np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)])


def close_to(image, colour, tolerance=12):
    return (np.abs(image.astype(int) - colour) <= tolerance).all(axis=-1)


def test_scale_is_round_and_makes_the_largest_motion_visible():
    for size in np.geomspace(1e-9, 1e-3, 13):
        trajectory = run(times=21, size=size)
        motion = motion_of(trajectory)
        digits = f"{motion.scale:.0e}"[0]
        assert digits in "125"
        field = trajectory.system.basis.mode_shapes
        moved = max(np.linalg.norm(field.shapes @ q, axis=1).max()
                    for q in trajectory.modal_coordinates)
        assert motion.largest_colour == pytest.approx(moved)
        extent = np.hypot(0.2, 0.02)
        assert 0.04 * extent <= motion.scale * moved <= 0.1 * extent
    assert motion_of(run(times=5, size=0.05)).scale == 1.0
    assert motion_of(run(times=5), given_scale=300.0).scale == 300.0
    assert motion_of(still(np.zeros((3, 5)))).scale == 1.0


def test_drawn_places_scale_the_displacements_and_stay_in_the_box():
    trajectory = run(times=21)
    motion = motion_of(trajectory, given_scale=400.0)
    field = trajectory.system.basis.mode_shapes
    (left, bottom), (right, top) = motion.bounds
    reached = []
    for frame, q in enumerate(trajectory.modal_coordinates):
        places, colours = motion.body(frame)
        np.testing.assert_allclose(places, field.nodes + 400.0 * field.shapes @ q, atol=1e-15)
        np.testing.assert_allclose(colours, np.linalg.norm(field.shapes @ q, axis=1), atol=1e-18)
        reached += [places.min(axis=0), places.max(axis=0)]
    low, high = np.min(reached, axis=0), np.max(reached, axis=0)
    np.testing.assert_allclose([left, right, bottom, top],
                               [min(low[0], 0.0), max(high[0], 0.2), min(low[1], 0.0),
                                max(high[1], 0.02)])


def test_ground_travels_at_its_true_speed_and_its_waves_are_scaled():
    motion = motion_of(run(times=21, waviness=4e-6, speed=0.3), given_scale=100.0)
    np.testing.assert_allclose(motion.ground_pose[0], motion.times[:, None] * [0.3, 0.0])
    x, run_of = np.linspace(0.0, 0.2, 7), motion.trajectory
    drift = np.mean([run_of.displacement(node)[:, 0] for node in range(5)], axis=0)
    assert np.abs(drift).max() > 0.0
    for frame in (0, 5, 20):
        # Over waves, drawn in their true length, the drift along them is not magnified.
        moved = 100.0 * motion.mode_shapes.shapes @ run_of.modal_coordinates[frame]
        moved[:, 0] -= 99.0 * drift[frame]
        np.testing.assert_allclose(motion.body(frame)[0], motion.mode_shapes.nodes + moved,
                                   rtol=0.0, atol=1e-13)
        wave = 4e-6 * np.sin(2.0 * np.pi * (x - 0.3 * motion.times[frame]) / 0.03)
        np.testing.assert_allclose(motion.ground(frame, x[:, None]), 100.0 * wave, atol=1e-15)
    gap = run(times=3)
    gap = type(gap)(gap.system.with_(gap=2e-6), gap.time, gap.modal_coordinates,
                    gap.modal_velocities, gap.work)
    assert motion_of(gap, given_scale=100.0).ground_level == pytest.approx(-2e-4)


def test_flat_bodies_leave_room_for_a_chart_of_the_forces_with_a_cursor():
    motion = motion_of(run(times=21))
    furniture = RunOverlay(motion, 960, 540)
    assert furniture.chart_height >= 110
    assert furniture.scene_height >= needed_height(motion) * 960
    cursors = []
    for frame in range(21):
        image = around(furniture, frame)[furniture.header_height : furniture.scene_top]
        assert image.shape == (furniture.chart_height, 960, 3)
        red = (image == [178, 24, 43]).all(axis=2)
        assert red.any(axis=1).mean() > 0.5  # from top to bottom of the axes
        cursors.append(np.flatnonzero(red.any(axis=0)).mean())
    assert np.diff(cursors) == pytest.approx((cursors[-1] - cursors[0]) / 20, abs=1.0)
    assert cursors[-1] - cursors[0] > 0.85 * 960
    # A tall picture of the same body has more room, one of a tall body none.
    assert RunOverlay(motion, 480, 640).chart_height > 0
    tall = motion_of(still(np.zeros((3, 5))))
    object.__setattr__(tall, "bounds", np.array([[0.0, 0.0], [0.1, 0.1]]))
    assert RunOverlay(tall, 960, 540).chart_height == 0


@rendering
@pytest.mark.parametrize("size", [(960, 540), (1280, 720)])
def test_nothing_is_left_blank_between_chart_and_body(size):
    """Under a chart the scene begins with the body: less than a twelfth of the picture is blank."""
    motion = motion_of(run(basis(0.2, 0.012), times=21), frames=5)
    furniture = RunOverlay(motion, *size)
    assert furniture.chart_height > 0
    with scene_of(motion, size[0], furniture.scene_height) as scene:
        blank = min(int((scene.image(frame) == 255).all(axis=(1, 2)).argmin())
                    for frame in range(5))
    assert 0 < blank < 45 * size[1] / 540


def test_colours_of_stresses_end_below_a_sharp_peak():
    """One node of a hundred has fifty times the stress that it would have otherwise."""
    body = basis(columns=20, rows=4)
    stress = body.mode_shapes.stress.copy()
    plain = motion_of(run(body, times=21), colour="von_mises")
    assert plain.largest_colour == plain.peak
    node = int(np.argmax(np.max([plain.body(frame)[1] for frame in range(21)], axis=0)))
    stress[node] *= 50.0
    sharp = motion_of(run(replace(body, mode_shapes=replace(body.mode_shapes, stress=stress)),
                          times=21), colour="von_mises")
    each = np.max([sharp.body(frame)[1] for frame in range(21)], axis=0)
    assert sharp.peak == pytest.approx(each.max()) == each[node]
    assert sharp.largest_colour == pytest.approx(np.percentile(each, 99.0))
    assert sharp.largest_colour < 0.5 * sharp.peak
    drawn = RunOverlay(sharp, 960, 540)
    (label,) = (text for text in texts(drawn) if text.startswith("von Mises stress ["))
    unit = {"kPa": 1e3, "MPa": 1e6}[label[label.index("[") + 1 : label.index("]")]]
    (scale,) = drawn.footer.child_axes
    assert scale.get_xlim()[1] * unit == pytest.approx(sharp.largest_colour)
    assert label.endswith(f", peak {sharp.peak / unit:.3g}")
    # The scale ends in a point of its last colour where values lie beyond.
    last = 255.0 * np.array(colormaps["cividis"](1.0)[:3])
    seen = [close_to(footer(motion)[:, round(0.456 * 960)], last).any()
            for motion in (plain, sharp)]
    assert seen == [False, True]


def test_without_friction_nodes_are_open_or_in_contact():
    q = np.zeros((3, 5))
    q[:, 1] = [5e-6, -4e-6, -4e-6]
    trajectory = still(q, speed=0.02)
    smooth = type(trajectory)(
        trajectory.system.with_(friction=ConstantFriction(0.0)), trajectory.time,
        trajectory.modal_coordinates, trajectory.modal_velocities, trajectory.work)
    motion = motion_of(smooth)
    assert motion.state_names == ("open", "contact")
    assert motion.states.tolist() == [[0] * 5, [1] * 5, [1] * 5]
    assert close_to(footer(motion), rgb(STATE_COLOURS["contact"])).any()
    assert not close_to(footer(motion), rgb(STATE_COLOURS["stick"])).any()
    assert motion_of(trajectory).state_names == ("open", "stick", "slip")


def test_strips_and_scene_fill_the_picture_and_say_scale_and_time():
    for size in ((960, 540), (1280, 720), (480, 640)):
        motion = motion_of(run(times=5))
        furniture = RunOverlay(motion, *size, "A title " * 30, 40.0)
        scene = np.full((furniture.scene_height, size[0], 3), 7, dtype=np.uint8)
        image = furniture.around(scene, 3)
        assert image.shape == (size[1], size[0], 3)
        header = image[: furniture.header_height]
        assert (header[:, : size[0] // 4] < 128).any()
        assert (header[:, -size[0] // 6 :] < 128).any()
        for edge in (image[0], image[-1], image[: furniture.header_height, 0]):
            assert (edge == 255).all()  # nothing is cut off
        place = slice(furniture.scene_top, furniture.scene_top + furniture.scene_height)
        assert np.array_equal(image[place], scene)
        words = " ".join(texts(furniture))
        assert f"deformation × {motion.scale:g}" in words
        assert "slowed down 40 ×" in words
        assert "t = 15 ms" in texts(furniture)


@rendering
def test_body_moves_by_the_scaled_displacement_and_has_the_colour_of_its_size():
    q = np.zeros((3, 5))
    q[:, 0] = [0.0, 1e-5, 2e-5]
    motion = motion_of(still(q), given_scale=500.0)
    with scene_of(motion, 960, 430) as scene:
        images = [scene.image(frame) for frame in range(3)]
    viridis = 255.0 * colormaps["viridis"]([0.0, 0.5, 1.0])[:, :3]
    spans = []
    for image, colour in zip(images, viridis, strict=True):
        assert image.shape == (430, 960, 3)
        columns = np.flatnonzero(close_to(image, colour).sum(axis=0) > 20)
        spans.append((columns[0], columns[-1] + 1))
    widths = np.diff(spans, axis=1)[:, 0]
    pixel = 0.2 / widths.mean()
    assert np.ptp(widths) <= 2
    assert widths.mean() > 0.7 * 960
    assert np.diff(np.mean(spans, axis=1)) == pytest.approx(500 * 1e-5 / pixel, abs=1.5)


@rendering
def test_contact_nodes_show_their_states_and_forces():
    q = np.zeros((3, 5))
    q[:, 1] = [5e-6, -4e-6, -4e-6]  # open, then pressed down
    trajectory = still(q, speed=0.02)
    speeds = trajectory.modal_velocities.copy()
    speeds[1, 0] = 0.02  # moves with the ground
    trajectory = replace(trajectory, modal_velocities=speeds)
    assert np.array_equal(trajectory.contact_state, [[0] * 5, [1] * 5, [2] * 5])
    motion = motion_of(trajectory)
    with scene_of(motion, 640, 300) as scene:
        images = [scene.image(frame) for frame in range(3)]
    forces = [(image[:, :, 0] > 150) & (image[:, :, 1] < 60) & (image[:, :, 2] < 80)
              for image in images]
    for frame, image in enumerate(images):
        for state, name in ((1, "stick"), (2, "slip")):
            seen = np.count_nonzero(close_to(image, rgb(NODE_COLOURS[name])))
            assert seen > 5 * 30 if state == frame else seen == 0
    assert not forces[0].any()
    upright, slanted = (np.argwhere(force) for force in forces[1:])
    assert len(upright) > 100
    # Slip against the ground's motion: friction drags the body along +x, the arrows lean right.
    top, bottom = slanted[:, 0].min(), slanted[:, 0].max()
    lean = slanted[slanted[:, 0] < top + 5][:, 1].mean() \
        - slanted[slanted[:, 0] > bottom - 5][:, 1].mean()
    assert lean > 4
    # Belt, arrow and number agree: slip back, R below zero, which in -x is a force in +x.
    assert motion.ground_speed == pytest.approx(0.02)
    assert (trajectory.slip_velocity[2] < 0.0).all()
    assert (trajectory.friction_force[2] < 0.0).all()
    assert (motion.forces[2, :, 0] == -trajectory.friction_force[2]).all()


def test_arrows_lean_with_the_slope_of_waves():
    """Without friction the contact force is normal to the wavy ground."""
    q = np.zeros((2, 5))
    q[:, 1] = -2e-4
    trajectory = still(q, waviness=1e-4)
    system = trajectory.system.with_(friction=ConstantFriction(0.0))
    for normal, factor in (("surface", 1.0), ("vertical", 0.0)):
        inclined = type(trajectory)(
            system.with_(ground=replace(system.ground, normal=normal)), trajectory.time,
            trajectory.modal_coordinates, trajectory.modal_velocities, trajectory.work)
        forces = motion_of(inclined).forces
        assert (forces[:, :, 1] > 0.0).all()
        k = 2.0 * np.pi / 0.03
        places = system.basis.contact_x - 0.02 * inclined.time[:, None]
        slope = 1e-4 * k * np.cos(k * places)
        np.testing.assert_allclose(forces[:, :, 0], -factor * slope * forces[:, :, 1],
                                   rtol=1e-6, atol=1e-12)


@rendering
@pytest.mark.parametrize(("length", "height"), [(0.2, 0.02), (0.02, 0.2), (0.1, 0.1)])
def test_body_fills_the_frame_whatever_its_shape(length, height):
    trajectory = run(basis(length, height, columns=10, rows=10), times=11, size=1e-6)
    with scene_of(motion_of(trajectory), 960, 430) as scene:
        for frame in range(11):
            coloured = np.ptp(scene.image(frame).astype(int), axis=2) > 50
            rows, columns = (np.flatnonzero(coloured.any(axis=k)) for k in (1, 0))
            assert rows[0] > 0
            assert rows[-1] < 429
            assert columns[0] > 0
            assert columns[-1] < 959
            assert len(rows) > 0.65 * 430 or len(columns) > 0.7 * 960


@rendering
def test_png_frames_have_the_size_and_the_body_moves(tmp_path):
    trajectory = run(basis(columns=20, rows=4), times=21)
    seen = []
    render(trajectory, tmp_path / "run.png", frames=6, size=SMALL)
    (tmp_path / "run_0009.png").write_bytes(b"of somebody else")
    first = render(trajectory, tmp_path / "run.png", frames=4, size=SMALL,
                   progress=lambda done, total: seen.append((done, total)))
    assert first == tmp_path / "run_0000.png"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *(f"run_{k:04d}.png" for k in range(4)), "run_0009.png"]
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    images = [imread(tmp_path / f"run_{k:04d}.png") for k in range(4)]
    assert all(image.shape[:2] == SMALL[::-1] for image in images)
    for before, after in pairwise(images):
        assert np.count_nonzero(np.abs(before - after).max(axis=2) > 0.1) > 500

    folder = render(trajectory, tmp_path / "frames", frames=2, size=SMALL, colour="von_mises")
    assert [path.name for path in sorted(folder.iterdir())] == ["frame_0000.png", "frame_0001.png"]


@rendering
def test_movie_has_its_frames_and_duration(tmp_path):
    trajectory = run(basis(columns=20, rows=4), times=31)
    path = render(trajectory, tmp_path / "run.mp4", frames=12, fps=8, size=SMALL, title="Bouncing",
                  t_start=0.005)
    assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (12, pytest.approx(1.5, abs=0.01))
    frames = imageio_ffmpeg.read_frames(str(path))
    facts = next(frames)
    assert facts["size"] == facts["source_size"] == SMALL
    assert facts["fps"] == 8
    assert facts["codec"] == "h264"
    assert facts["pix_fmt"].startswith("yuv420p")
    images = [np.frombuffer(frame, np.uint8).reshape(*SMALL[::-1], 3)
              for frame in islice(frames, 7)]
    frames.close()  # at the end of the movie it would leave its pipes open
    assert np.count_nonzero(np.abs(images[0].astype(int) - images[6]).max(axis=2) > 60) > 500
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.mp4"]


@rendering
def test_picture_is_the_frame_nearest_to_a_time(tmp_path):
    trajectory = run(basis(columns=20, rows=4), times=21)
    picture(trajectory, tmp_path / "late.png", size=SMALL)
    picture(trajectory, tmp_path / "early.png", time=0.0051, size=SMALL)
    late, early = (imread(tmp_path / f"{name}.png") for name in ("late", "early"))
    assert late.shape[:2] == SMALL[::-1]
    assert (late != early).any()
    picture(trajectory, tmp_path / "again.png", time=0.0049, size=SMALL)
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "early.png").read_bytes()


@rendering
@pytest.mark.parametrize("name", ["run.mp4", "run.png", "frames"])
def test_interrupted_rendering_leaves_nothing(tmp_path, name):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render(run(basis(columns=4, rows=2), times=5), tmp_path / name, size=SMALL, progress=stop)
    assert not list(tmp_path.iterdir())


def test_errors_say_what_is_wrong(tmp_path):
    trajectory = run(basis(columns=4, rows=2), times=5)
    for options, message in (
        ({"size": (961, 540)}, "even width"), ({"size": (100, 100)}, "at least 320 x 180"),
        ({"colour": "displacment"}, "did you mean 'displacement'"), ({"fps": 0}, "fps = 0"),
        ({"frames": 0}, "at least 1"), ({"scale": -1.0}, "scale = -1.0"),
    ):
        with pytest.raises(InputError, match=message):
            render(trajectory, tmp_path / "run.mp4", **options)
    with pytest.raises(InputError, match=r"\.mp4 for a movie"):
        render(trajectory, tmp_path / "run.gif")
    with pytest.raises(InputError, match=r"must end in \.png"):
        picture(trajectory, tmp_path / "run.jpg")
    for path in ("nowhere/run.mp4", "nowhere/run.png"):
        with pytest.raises(InputError, match="does not exist"):
            render(trajectory, tmp_path / path)


@pytest.mark.parametrize(("attempt", "reason"), [
    ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"),
    ("raise ImportError('libGL.so.1: cannot open shared object file')", r"libGL\.so\.1"),
])
def test_missing_graphics_libraries_are_named(tmp_path, monkeypatch, attempt, reason):
    monkeypatch.setattr(probe, "_ATTEMPT", attempt)
    probe._attempt.cache_clear()
    try:
        with pytest.raises(MissingLibraryError, match=reason) as error:
            movie.render(run(basis(columns=4, rows=2), times=5), tmp_path / "run.mp4")
        assert "apt-get install -y libegl1 libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 " \
            "libgomp1" in str(error.value)
        assert not list(tmp_path.iterdir())
    finally:
        probe._attempt.cache_clear()


@rendering
@pytest.mark.parametrize("rest", ["", "cat > /dev/null;"])
def test_movie_that_the_encoder_cut_short_is_not_kept(tmp_path, monkeypatch, rest):
    # An encoder that fails, as at a full disk, after its first bytes or at the end.
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\neval "file=\\${$#}"; head -c 100 > "$file"; '
                       f"{rest} exit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(encoder, "ffmpeg", lambda: str(program))
    with pytest.raises(InputError, match=r"run\.mp4 cannot be written"):
        render(run(basis(columns=4, rows=2), times=3), tmp_path / "run.mp4", size=SMALL)
    assert [entry.name for entry in tmp_path.iterdir()] == ["ffmpeg"]


def test_movies_are_encoded_by_the_program_of_the_system_if_it_can(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    for encoders, taken in (("libx264", str(program)), ("mpeg4", imageio_ffmpeg.get_ffmpeg_exe())):
        program.write_text(f"#!/bin/sh\necho ' V....D {encoders}'\n")
        program.chmod(0o755)
        assert encoder.ffmpeg.__wrapped__() == taken


def test_interrupt_while_a_frame_is_drawn_ends_the_movie(tmp_path):
    def interrupt(done, total):
        signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        render(run(), tmp_path / "a.mp4", frames=5, size=(320, 180), progress=interrupt)
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(signal.SIGINT) is before


def vibrating_bar(outputs):
    """A bar that swings freely at its first elastic mode over six periods, and this period [s]."""
    system = ContactSystem(basis(contact_nodes=3), RoughSurface(1e6, 1e-6), Frictionless(),
                           gap=4e-5)
    hertz = float(system.basis.frequencies_hz[system.basis.frequencies_hz > 0.0][0])
    start = np.zeros(2 * system.basis.modes)
    start[np.flatnonzero(system.basis.frequencies_hz > 0.0)[0]] = 1e-4
    return simulate(system, 6.0 / hertz, initial=start, outputs=outputs), 1.0 / hertz


def test_frames_between_outputs_that_are_too_far_apart():
    """Eight outputs in six periods; the frames are those of a run with outputs at their times."""
    coarse, _ = vibrating_bar(8)
    fine, _ = vibrating_bar(121)
    assert between_outputs(fine, 500) is fine
    assert between_outputs(coarse, 8) is coarse
    found, frames = frames_of(coarse, 121)
    assert len(frames) > 60
    expected = CubicSpline(fine.time, fine.modal_coordinates)(found.time)
    assert np.abs(expected).max() > 0.9e-4
    assert np.abs(found.modal_coordinates - expected).max() < 0.01 * np.abs(expected).max()


def test_a_movie_that_shows_motion_too_slow_or_backwards_has_a_note():
    run, period = vibrating_bar(121)
    note = coarse_frames_message(run, run.time[::15])
    assert note.startswith("frames lie ")
    assert "; draw at most" in note
    assert not coarse_frames_message(run, run.time[run.time <= 2.0 * period][::2])
    coarse, _ = vibrating_bar(8)
    assert "; run with outputs at most" in coarse_frames_message(coarse, coarse.time)
