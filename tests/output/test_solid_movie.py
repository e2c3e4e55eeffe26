"""Movies of solids: what is where in the picture, and that the camera stands still."""

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from matplotlib.quiver import Quiver
from solid_blocks import quadratic_grid
from test_solid_result_files import SIZE, moved, solid, stacked, system

import fecontact as fc
from fecontact.laws import ConstantFriction, EnergyWear, HeightMap, Sine
from fecontact.output.files.frames import contact_forces, frame_indices
from fecontact.output.plots.solids.plans import face_plans
from fecontact.output.render import offscreen
from fecontact.output.render.frames_data import Motion
from fecontact.output.render.run_overlay import RunOverlay
from fecontact.output.render.scene import NODE_COLOURS, Camera
from fecontact.output.render.scenes import scene_of
from fecontact.output.render.surfaces import borders, shaded_surface, sharp_edges
from fecontact.plot import picture, render_mode

rendering = pytest.mark.skipif(offscreen.rendering_problem() is not None,
                               reason=str(offscreen.rendering_problem()))


def motion_of(run, frames=9, **options):
    return Motion(run, frame_indices(run.time, frames), **options)


@pytest.fixture(scope="module")
def run():
    return moved(system(solid()))


def close_to(image, colour, tolerance=14):
    return (np.abs(image.astype(int) - np.round(255.0 * np.array(colour))) <= tolerance).all(-1)


def test_drawn_places_scale_the_displacements_and_stay_in_the_bounds(run):
    motion = motion_of(run, given_scale=200.0)
    field = run.system.basis.mode_shapes
    low, high = motion.bounds
    for frame, q in enumerate(run.modal_coordinates):
        places, _ = motion.body(frame)
        assert places == pytest.approx(field.nodes + 200.0 * field.shapes @ q, abs=1e-15)
        assert (low <= places.min(axis=0) + 1e-15).all()
        assert (places.max(axis=0) <= high + 1e-15).all()
    assert motion.ground_level == 0.0
    forces = contact_forces(run)
    assert np.array_equal(motion.forces, forces)
    tangential = forces * [1.0, 1.0, 0.0]
    assert motion.friction == pytest.approx(tangential, abs=1e-12)


def test_ground_travels_turns_and_waves():
    belt = motion_of(moved(system(solid(), ground=fc.Ground(speed=0.3, speed_y=-0.1))),
                     given_scale=10.0)
    travel, turn, _ = belt.ground_pose
    assert travel == pytest.approx(10.0 * belt.times[:, None] * [0.3, -0.1])
    assert not turn.any()
    assert belt.moving == "ground 316 mm/s at -18° from x"
    # A belt that turns and travels: marks move with the velocity of the ground at their place.
    ground = fc.Ground(speed=0.2, speed_y=0.1, rotation_speed=4.0, centre=(0.05, 0.02))
    both = motion_of(moved(system(solid(), ground=ground)), given_scale=1.0)
    travel, turn, centre = both.ground_pose
    place = np.array([0.15, 0.08])
    arm = place - centre
    rate = 4.0 * np.array([-arm[1], arm[0]])
    assert not travel.any()
    assert turn == pytest.approx(4.0 * both.times)
    assert both.ground_velocity(0, place[None])[0] == pytest.approx(rate)
    grid = HeightMap(2e-5 * np.random.default_rng(1).standard_normal((5, 5)), 0.05, 0.04)
    rough = motion_of(moved(system(solid(), ground=fc.Ground(speed=3.0, height_map=grid))),
                      given_scale=50.0)
    x, y = np.array([0.03, 0.17]), np.array([0.05, 0.01])
    expected = 50.0 * grid.shape(x - 3.0 * rough.times[4], y)[..., 0]
    assert rough.ground(4, np.column_stack([x, y])) == pytest.approx(expected)
    waves = motion_of(moved(system(solid(), ground=fc.Ground(
        speed_y=2.0, profile=Sine(1e-5, 0.03), wave_direction=(3.0, 4.0)))), given_scale=50.0)
    along = 0.6 * x + 0.8 * (y - 2.0 * waves.times[5])
    assert waves.ground(5, np.column_stack([x, y])) == pytest.approx(
        5e-4 * np.sin(2.0 * np.pi * along / 0.03))


def test_camera_shows_every_place_of_all_frames():
    rng = np.random.default_rng(0)
    places = rng.uniform(-1.0, 3.0, (50, 3))
    camera = Camera.around(np.array([0.4, -0.8, 0.4]), np.array([0.0, 0.0, 1.0]), places, 1.5)
    rows, columns = np.array([camera.pixel(place, (400, 600, 3)) for place in places]).T
    assert rows.min() >= 0.04 * 400 <= 400 - rows.max() + 1
    assert columns.min() >= 0.04 * 600 <= 600 - columns.max() + 1
    assert min(np.ptp(rows) / 400, 1.0) == pytest.approx(0.9, abs=0.01) or (
        np.ptp(columns) / 600 == pytest.approx(0.9, abs=0.01))


def test_sharp_edges_divide_the_surface_and_smooth_ones_do_not():
    basis = solid()
    nodes, facets = basis.mode_shapes.nodes, basis.mode_shapes.outline
    edges = sharp_edges(nodes, facets)
    length = np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1).sum()
    assert length == pytest.approx(4.0 * sum(SIZE))
    surface = shaded_surface(nodes, facets)
    normals = surface.normals(nodes[surface.nodes])
    # All are along the axes: no edge is rounded.
    assert np.abs(normals).max(axis=1) == pytest.approx(1.0)
    # Over a cylinder they are radial.
    tube = quadratic_grid(lambda u, v: (np.cos(u), np.sin(u), v), 40, 2)
    cut = tube.facets[:, :4]
    round_one = shaded_surface(tube.places, cut)
    at = tube.places[round_one.nodes]
    inside = (at[:, 0] < 0.999) & (at[:, 1] < np.sin(1.0) - 1e-3)
    assert len(round_one.nodes) == len(np.unique(cut))
    assert np.abs((round_one.normals(at) * at).sum(axis=1)[inside]) == pytest.approx(1.0, abs=1e-3)


def test_borders_run_between_patches_and_around_them():
    """Four squares in two patches: eight sides around them and the two between the patches."""
    number = np.arange(9).reshape(3, 3)
    squares = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]],
                       axis=-1).reshape(-1, 4)
    found = borders(squares, np.array([0, 0, 1, 1]))
    around = [(0, 1), (1, 2), (2, 5), (5, 8), (7, 8), (6, 7), (3, 6), (0, 3)]
    assert set(map(tuple, found.tolist())) == {*around, (3, 4), (4, 5)}
    assert len(found) == 10


@rendering
@pytest.mark.parametrize("view", ["above", "below"])
def test_the_camera_stands_still_and_the_body_moves(run, view):
    motion = motion_of(run, given_scale=300.0, view=view)
    with scene_of(motion, 240, 180) as scene:
        before = (scene.plotter.camera.position, scene.plotter.camera.parallel_scale)
        images = [scene.image(frame) for frame in (0, 4, 8)]
        assert (scene.plotter.camera.position, scene.plotter.camera.parallel_scale) == before
        again = scene.image(0)
    assert np.array_equal(images[0], again)
    changed = (np.abs(images[0].astype(int) - images[1]) > 30).any(axis=2)
    assert 0.005 < changed.mean() < 0.5
    # Nothing is cut off: the border of the picture stays white.
    for image in images:
        for side in (image[:3], image[-3:], image[:, :3], image[:, -3:]):
            assert (side == 255).all()


@rendering
def test_patches_are_painted_with_their_pressures(run):
    """From below each patch has the colour of its pressure where the camera shows its middle."""
    motion = motion_of(run, given_scale=1.0, view="below")
    pressed = int(run.normal_force.sum(axis=1).argmax())
    with scene_of(motion, 480, 360) as scene:
        image = scene.image(pressed)
        for node, place in enumerate(run.system.basis.contact_places):
            # Beside the middle, where lines of the facets do not run.
            row, column = scene.camera.pixel(place + np.array([0.004, 0.003, 0.0]),
                                              image.shape)
            part = run.pressure[pressed, node] / run.pressure.max()
            assert close_to(image[row, column], colormaps["inferno"](part)[:3], 25), node
    assert len(set(np.round(run.pressure[pressed] / run.pressure.max(), 1))) > 1


def test_maps_show_pressure_state_wear_and_friction(run):
    motion = motion_of(run, wear=EnergyWear(1e-9))
    overlay = RunOverlay(motion, 960, 540)

    def maps(frame):
        picture = overlay.around(np.full((1, 1, 3), 255, np.uint8), frame)
        return picture[overlay.scene_top :][: overlay.scene_height - overlay.chart_height,
                                            overlay.scene_width :]

    pressed = int(run.normal_force.sum(axis=1).argmax())
    shown = maps(pressed)
    # Each of the four patches that slips has a quarter of the map.
    counts = (run.contact_state == 2).sum(axis=1)
    amounts = np.array([close_to(maps(frame), to_rgb(NODE_COLOURS["slip"])).sum()
                        for frame in range(len(counts))])
    assert len(set(counts)) > 1
    assert amounts.max() > 500 * counts.max()
    assert amounts == pytest.approx(counts / counts.max() * amounts.max(), rel=0.05)
    # Of the pressed patches each has the colour of its pressure.
    largest = int(run.pressure[pressed].argmax())
    shade = colormaps["inferno"](run.pressure[pressed, largest] / run.pressure.max())[:3]
    assert max(shade) > 0.3
    assert close_to(shown, shade, 3).sum() > 500
    assert not np.array_equal(maps(0), shown)
    assert np.array_equal(maps(pressed), shown)
    (arrows,) = overlay.figure.findobj(Quiver)
    assert np.column_stack([arrows.U, arrows.V]) == pytest.approx(motion.friction[pressed, :, :2])
    titles = map_titles(overlay)
    assert titles[:2] == ["pressure and friction   → x  ↑ y", "state"]
    assert titles[2].startswith("worn, up to ")
    depth = run.wear_depth(EnergyWear(1e-9))
    assert motion.worn == pytest.approx(depth)


def map_titles(overlay):
    return [title for one in overlay.figure.findobj(Axes) if (title := one.get_title())]


def test_plans_of_faces_keep_areas_and_unroll_bushes(run):
    (plan,) = face_plans(run.system.basis, "map")
    assert plan.labels == ("x", "y")
    found, wanted = (places[np.lexsort(places.T.round(9))] for places in (
        plan.places, run.system.basis.contact_places[:, :2]))
    assert found == pytest.approx(wanted, abs=1e-12)
    assert plan.spacing**2 * 4 == pytest.approx(SIZE[0] * SIZE[1])
    vectors = np.array([[[1.0, 2.0, 3.0]] * 4])
    assert plan.directions(vectors) == pytest.approx(np.array([[[1.0, 2.0]] * 4]))
    (seam,) = face_plans(stacked().basis, "map")
    assert seam.face.name == "seam"
    assert seam.spacing**2 * 4 == pytest.approx(SIZE[0] * SIZE[1])
    # Point contacts have squares of their areas.
    corners = np.array([(x, y, 0.0) for x in (0.0, 0.2) for y in (0.0, 0.3)])
    rows = np.tile(np.eye(6), (4, 1, 1))
    rigid = fc.basis_from_matrices(
        np.diag([3.0] * 3 + [0.1] * 3), np.zeros((6, 6)), {"contact": rows, "B": np.eye(6)},
        dimension=3, contact_places=corners, tributary=np.full(4, 0.01))
    (squares,) = face_plans(rigid, "map")
    assert squares.spacing == pytest.approx(0.1)


@rendering
def test_movies_and_pictures_of_solids_are_written(run, tmp_path):
    path = fc.render(run, tmp_path / "solid.mp4", frames=3, size=(480, 270), view="below",
                     colour="von_mises", title="Block")
    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == 3
    two = moved(stacked())
    shown = imread(picture(two, tmp_path / "two.png", size=(480, 270), wear=EnergyWear(1e-12)))
    assert shown.shape[:2] == (270, 480)
    render_mode(run.system.basis, tmp_path / "mode.png", 7, frames=2, size=(320, 180))
    mode = imread(tmp_path / "mode_0000.png")[..., :3]
    assert 0.1 < (mode.min(axis=2) < 0.9).mean() < 0.8


def test_choices_for_solids_are_refused_elsewhere(run, tmp_path):
    from synthetic import run as plane

    with pytest.raises(fc.InputError, match="view = 'below' is for solids, but this run has plane"):
        picture(plane(times=3), tmp_path / "plane.png", view="below")
    with pytest.raises(fc.InputError, match="view = 'behind'"):
        picture(run, tmp_path / "solid.png", view="behind")
    still = moved(system(solid(), friction=ConstantFriction(0.0)))
    assert map_titles(RunOverlay(motion_of(still), 480, 270))[0].startswith("pressure   →")
