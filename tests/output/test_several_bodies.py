"""Pictures, plots and files of two bodies that touch each other."""

import csv
from dataclasses import replace
from io import StringIO

import h5py
import meshio
import numpy as np
import pytest
from joined_bodies import stack, stack_run, stack_system
from matplotlib.axes import Axes
from matplotlib.image import imread
from synthetic import run

from fecontact import InputError, Load, LoadPath, load_history, read_case, write_case
from fecontact.analysis import history
from fecontact.analysis.run_facts import contact_shares
from fecontact.cli import execute
from fecontact.cli.tables import preload_table, run_table, wear_table
from fecontact.integrate import WearHistory
from fecontact.io import export_pvd, to_xarray
from fecontact.laws import EnergyWear, SlidingRotation, SlidingTranslation
from fecontact.output.diagrams.runs import forces_on_body_diagram
from fecontact.output.files import export
from fecontact.output.files.frames import (
    body_numbers,
    contact_forces,
    frame_indices,
    nodal_contact_force,
)
from fecontact.output.plots.face_panels import scale_row
from fecontact.output.plots.figure import new_figure
from fecontact.output.render import offscreen
from fecontact.output.render.frames_data import Motion, body_labels
from fecontact.output.render.run_overlay import RunOverlay
from fecontact.output.render.scenes import scene_of
from fecontact.plot import (
    picture,
    plot_contact_map,
    plot_friction_work,
    plot_history,
    plot_modes,
    plot_shear,
    plot_wear,
    render_mode,
)

rendering = pytest.mark.skipif(offscreen.rendering_problem() is not None,
                               reason=str(offscreen.rendering_problem()))


def motion_of(trajectory, frames=20, **options):
    return Motion(trajectory, frame_indices(trajectory.time, frames), **options)


@pytest.fixture(scope="module")
def trajectory():
    return stack_run()


@pytest.fixture(scope="module")
def inclined():
    return stack_run(angle=0.7)


def test_forces_act_along_the_directions_of_each_node(inclined):
    """Along the inclined face friction acts in -t, the normal force along n."""
    t, n = np.array([np.cos(0.7), np.sin(0.7)]), np.array([-np.sin(0.7), np.cos(0.7)])
    forces = contact_forces(inclined)
    assert np.abs(inclined.friction_force).max() > 1.0
    np.testing.assert_allclose(forces @ n, inclined.normal_force, rtol=1e-12)
    np.testing.assert_allclose(forces @ t, -inclined.friction_force, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_forces_on_the_two_bodies_cancel(angle):
    run = stack_run(angle)
    spread, body = nodal_contact_force(run), body_numbers(run.system.basis)
    block, beam = (spread[:, body == number].sum(axis=1) for number in (0, 1))
    forces = contact_forces(run)
    largest = np.abs(block).max()
    assert largest > 10.0
    np.testing.assert_allclose(block, forces[:, :8].sum(axis=1), atol=1e-12 * largest)
    ground = forces[:, 8:].sum(axis=1)
    np.testing.assert_allclose(beam, ground - block, atol=1e-12 * largest)
    # About the origin too: feet lie under their nodes.
    x, y = run.system.basis.mode_shapes.nodes.T
    moment = spread[..., 1] * x - spread[..., 0] * y
    outer = (forces[:, 8:, 1] * run.system.basis.contact_x[8:]).sum(axis=1)
    np.testing.assert_allclose(moment.sum(axis=1), outer, atol=1e-12 * largest)


def test_both_sides_are_drawn_with_opposite_forces(inclined):
    motion = motion_of(inclined, given_scale=50.0)
    assert not motion.has_ground
    assert len(motion.footed) == 8
    field = inclined.system.basis.mode_shapes
    for frame in (0, 7):
        places = motion.contact_places(frame)
        q = inclined.modal_coordinates[motion.indices[frame]].copy()
        own = field.nodes[:8] + 50.0 * (field.shapes[:8] @ q)  # the block's lowest row
        np.testing.assert_allclose(places[:8], own, atol=1e-14)
        # Feet lie on the drawn upper edge of the beam, whose cells are straight.
        q[:5] = 0.0
        upper = field.nodes[-21:] + 50.0 * (field.shapes[-21:] @ q)
        along = np.linspace(0.0, 1.0, 21)
        feet = np.column_stack([np.interp(np.linspace(0.3, 0.55, 8), along, upper[:, k])
                                for k in (0, 1)])
        np.testing.assert_allclose(places[8:], feet, atol=1e-14)
        np.testing.assert_array_equal(motion.forces[frame, 8:], -motion.forces[frame, :8])
        np.testing.assert_array_equal(motion.states[frame, 8:], motion.states[frame, :8])


def test_feet_on_the_ground_are_not_drawn(trajectory):
    motion = motion_of(trajectory)
    assert motion.has_ground
    assert motion.contact_places(0).shape == motion.forces[0].shape == (29 + 8, 2)
    # The ground lies under the beam, although the block's nodes are contact nodes too.
    assert motion.ground_level == pytest.approx(0.0)
    (left, _), (right, top) = motion.bounds
    assert left < 0.0 < 0.2 < right
    assert top > 0.04


def test_names_stand_inside_their_bodies():
    basis = stack()
    found = dict(body_labels(basis))
    nodes = basis.mode_shapes.nodes
    assert list(found) == ["block", "beam"]
    for name, (low, high) in (("block", ([0.06, 0.02], [0.11, 0.05])),
                              ("beam", ([0.0, 0.0], [0.2, 0.02]))):
        place = nodes[found[name]]
        assert (place > low).all() and (place < high).all()  # noqa: PT018
    assert body_labels(run().system.basis) == ()


@rendering
def test_pictures_of_two_bodies_show_arrows_in_their_directions(inclined, tmp_path):
    motion = motion_of(inclined)
    with scene_of(motion, 480, 270) as scene:
        corners = scene.parts[-1].force_corners(motion.contact_places(3), motion.forces[3])
    tails, tips = corners.reshape(-1, 7, 2)[:, [0, 3]].mean(axis=1), corners.reshape(-1, 7, 2)[:, 5]
    drawn, forces = tips - tails, motion.forces[3]
    drawn /= np.linalg.norm(drawn, axis=1)[:, None]
    np.testing.assert_allclose(
        drawn, forces / np.linalg.norm(forces, axis=1)[:, None], atol=1e-6)
    image = imread(picture(inclined, tmp_path / "a.png", size=(640, 360)))[..., :3]
    red = (np.abs(image - np.array([178, 24, 43]) / 255.0) < 0.05).all(axis=2)
    assert 100 < red.sum() < 0.05 * red.size
    render_mode(inclined.system.basis, tmp_path / "mode.png", 8, frames=2, size=(320, 180))


@rendering
def test_names_are_written_into_the_scene(trajectory):
    """Differences from the picture without names lie about the nodes that carry the names."""
    motion = motion_of(trajectory)
    with scene_of(motion, 960, 432) as scene:
        named = scene.image(4).astype(int)
        places = motion.body(4)[0][[node for _, node in motion.labels]]
        pixels = [scene.camera.pixel(place, named.shape) for place in places]
        scene.parts[0].labels = []
        plain = scene.image(4)
    changed = np.argwhere((named != plain).any(axis=2))
    near = np.min([np.abs(changed - pixel).max(axis=1) for pixel in pixels], axis=0)
    assert len(changed) > 200
    assert near.max() < 60
    for pixel in pixels:
        assert (np.abs(changed - pixel).max(axis=1) < 60).sum() > 100


def test_the_legend_names_what_slides(trajectory):
    def words(sliding):
        return motion_of(replace(trajectory, system=trajectory.system.with_(
            sliding={"shoe": sliding}))).sliding

    assert words(SlidingRotation(-3.0)) == ("beam ↻ 3 rad/s",)
    assert words(SlidingTranslation(-0.02, (0.0, 1.0))) == ("beam ↓ 20 mm/s",)
    assert words(SlidingTranslation(0.02, (1.0, 1.0))) == ("beam ↗ 20 mm/s",)
    assert motion_of(trajectory).sliding == ()


def test_the_chart_sums_the_forces_of_each_interface(trajectory):
    lines = {line.name: line.y for line in forces_on_body_diagram(trajectory).curves}
    assert list(lines) == ["shoe: normal", "shoe: friction", "foot: normal", "foot: friction"]
    np.testing.assert_allclose(lines["shoe: normal"], trajectory.normal_force[:, :8].sum(axis=1))
    np.testing.assert_allclose(lines["foot: friction"],
                               -trajectory.friction_force[:, 8:].sum(axis=1))
    motion = motion_of(trajectory)
    overlay = RunOverlay(motion, 640, 900)
    assert overlay.chart_height > 0
    (chart,) = (one for one in overlay.figure.findobj(Axes) if one.get_legend())
    assert [line.get_text() for line in chart.get_legend().get_texts()] == list(lines)


def test_contact_maps_have_a_row_an_interface(trajectory, inclined):
    figure = plot_contact_map(trajectory)
    axes = figure.axes
    assert [axis.get_title(loc="left") for axis in axes[:4]] == [
        "shoe: block and beam", "", "foot: beam and ground", ""]
    assert [axis.get_ylabel() for axis in (axes[0], axes[2])] == ["contact position x [mm]"] * 2
    assert axes[0].get_ylim() == pytest.approx((0.06, 0.11))
    assert axes[2].get_ylim() == pytest.approx((0.0, 0.2))
    loads = trajectory.line_load.T
    for axis, rows in ((axes[0], slice(0, 8)), (axes[2], slice(8, 29))):
        drawn = np.asarray(axis.collections[0].get_array())
        np.testing.assert_allclose(drawn, loads[rows], rtol=1e-9)
    states = np.asarray(axes[3].collections[0].get_array())
    np.testing.assert_array_equal(states, trajectory.contact_state[:, 8:].T)
    (row, _), *_ = [figure.axes[:2] for figure in [plot_contact_map(inclined)]]
    assert row.get_ylabel() == "position along the face s [mm]"
    assert row.get_ylim() == pytest.approx((0.0, 0.05))


def test_friction_work_has_a_column_an_interface(trajectory):
    """The shoe does thirty times the work of the foot: each has a scale of its own."""
    figure = plot_friction_work(trajectory)
    shoe, foot = figure.axes[:2]
    assert [shoe.get_title(), foot.get_title()] == ["shoe: block and beam", "foot: beam and ground"]
    work = trajectory.friction_work[-1] / trajectory.system.basis.tributary
    assert work[8:].max() < 0.2 * work[:8].max()
    for axis, nodes in ((shoe, slice(0, 8)), (foot, slice(8, 29))):
        name, _, unit = axis.get_ylabel().partition(" [")
        assert name == "friction work per length"
        factor = {"J/m": 1.0, "mJ/m": 1e-3, "µJ/m": 1e-6, "nJ/m": 1e-9}[unit[:-1]]
        heights = np.array([bar.get_height() for bar in axis.patches])
        np.testing.assert_allclose(heights * factor, work[nodes], rtol=1e-9)
        assert axis.get_ylim()[1] < 1.2 * heights.max()  # fills its panel


def test_panels_of_similar_values_share_a_scale():
    with new_figure(6.0, 3.0) as figure:
        near, far = figure.subplots(1, 2)
        assert scale_row([near, far], [3e-3, 9e-3], "slip", "m") == [1e-3, 1e-3]
        near.plot([0.0, 3.0])
        far.plot([0.0, 9.0])
    assert near.get_ylim() == far.get_ylim()
    assert (near.get_ylabel(), far.get_ylabel()) == ("slip [mm]", "")
    with new_figure(6.0, 3.0) as figure:
        axes = figure.subplots(1, 3)
        assert scale_row(axes, [3e-5, 9e-3, 0.0], "slip", "m") == [1e-6, 1e-3, 1.0]
        assert [axis.get_ylabel() for axis in axes] == ["slip [µm]", "slip [mm]", "slip [m]"]


def test_shear_has_a_column_an_interface():
    """A block pressed onto a beam on the ground: the shear of each face within its own limit."""
    basis = stack()
    T = basis.T.copy()
    T[1, 1, 1] = 1.0  # the load presses on the block
    system = stack_system().with_(basis=replace(basis, T=T), load=Load(100.0))
    history = load_history(system, LoadPath(load_scale=(1.0, 2.0), steps=2))
    figure = plot_shear(history)
    shoe, foot = figure.axes[:2]
    assert [shoe.get_title(), foot.get_title()] == ["shoe: block and beam", "foot: beam and ground"]
    assert [axis.get_ylabel() for axis in figure.axes[::2]] == [
        "friction force per length [N/mm]", "displacement relative\nto the other side [nm]"]
    lengths = 1e3 * basis.tributary
    for axis, nodes in ((shoe, slice(0, 8)), (foot, slice(8, 29))):
        np.testing.assert_allclose(
            axis.lines[2].get_ydata(), (history.friction_force[-1] / lengths)[nodes])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[0] == "limit"


def printed(table):
    from rich.console import Console

    console = Console(width=120, file=StringIO())
    console.print(table)
    return " ".join(console.file.getvalue().split())


def test_what_loading_leaves_is_told_by_interface():
    """Forces of faces that look different ways are not added; those of each carry the load."""
    basis = stack()
    T = basis.T.copy()
    T[1, 1, 1] = 1.0
    system = stack_system().with_(basis=replace(basis, T=T), load=Load(100.0))
    history = load_history(system, LoadPath(load_scale=(1.0, 2.0), steps=2))
    text = printed(preload_table(history, system.basis))
    assert "shoe: block and beam at the end 0 open, " in text
    shoe, foot = (history.normal_force[-1, nodes].sum() for nodes in (slice(0, 8), slice(8, 29)))
    assert f"shoe: forces normal {shoe:.4g} N, friction " in text
    assert f"foot: forces normal {foot:.4g} N, friction " in text
    assert f" {shoe + foot:.4g} N" not in text


def test_wear_is_told_by_interface(trajectory):
    basis = trajectory.system.basis
    n = basis.contact_nodes
    depth = np.outer([0.0, 2.0], np.arange(1.0, n + 1)) * 1e-6
    history = WearHistory(
        EnergyWear(1e-13), 0.01, 100.0, basis.contact_x, basis.tributary, np.zeros(n),
        np.array([0.0, 100.0]), np.arange(2.0), depth, np.ones((1, n)), np.ones((1, n)),
        np.zeros(3))
    text = printed(wear_table(history, basis))
    # Nodes 0 to 7 of the shoe end at x = 0.11 m, 8 to 28 of the foot at 0.2 m.
    assert "shoe: block and beam 2 µm ... 16 µm, most at x = 110 mm" in text
    assert "foot: beam and ground 18 µm ... 58 µm, most at x = 200 mm" in text


def test_wear_has_a_column_an_interface(trajectory):
    basis = trajectory.system.basis
    n = basis.contact_nodes
    depth = np.outer([0.0, 1.0, 2.0], np.arange(1.0, n + 1)) * 1e-6
    history = WearHistory(
        EnergyWear(1e-13), 0.01, 100.0, basis.contact_x, basis.tributary, np.zeros(n),
        np.array([0.0, 100.0, 200.0]), np.arange(3.0), depth, np.ones((2, n)), np.ones((2, n)),
        np.zeros(3))
    axes = plot_wear(history, basis=basis).axes
    assert [axis.get_title() for axis in axes[:2]] == ["shoe: block and beam",
                                                       "foot: beam and ground"]
    values, edges, _ = axes[1].patches[1].get_data()
    np.testing.assert_allclose(values, -2.0 * np.arange(9, n + 1))
    assert edges[0] == pytest.approx(-2.5)
    mean = axes[4].lines[1].get_ydata()
    share = basis.tributary[:8] / basis.tributary[:8].sum()
    np.testing.assert_allclose(mean, [0.0, *(1e6 * depth[1:, :8] @ share)])
    with pytest.raises(InputError, match="29 contact nodes, but the wear history 5"):
        plot_wear(replace(history, x=np.zeros(5)), basis=basis)


def test_histories_name_bodies_and_interfaces(trajectory):
    figure = plot_history(trajectory)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["shoe: node 4, relative (t, n)", "foot: node 18"]
    forces = [text.get_text() for text in figure.axes[4].get_legend().get_texts()]
    assert forces == ["shoe", "foot"]
    assert figure.axes[4].get_ylabel() == "total normal force [kN]"
    np.testing.assert_allclose(figure.axes[4].lines[1].get_ydata(),
                               trajectory.normal_force[:, 8:].sum(axis=1))
    assert history(trajectory, "velocity", 4, "y").title == (
        "relative velocity along n of shoe: node 4")
    assert history(trajectory, "displacement", 18).title == "displacement x of foot: node 18"
    assert history(trajectory, "normal_force", 9).title == "normal force of foot: node 9"


def test_points_of_bodies_are_known_by_their_names():
    basis = stack()
    tip = np.zeros((1, 3, 10))
    tip[0, 0, 5] = 1.0
    named = replace(basis, T=np.concatenate([basis.T, tip]), extra=("beam.tip",),
                    positions=np.vstack([basis.positions, [0.2, 0.01]]))
    found = stack_run(system=stack_system().with_(basis=named))
    shown = history(found, "displacement", "beam.tip", "x")
    assert shown.title == "displacement x of beam.tip"
    np.testing.assert_allclose(shown.values, found.modal_coordinates[:, 5])
    legend = plot_history(found, ["beam.tip"]).legends[0].get_texts()
    assert [text.get_text() for text in legend] == ["beam.tip"]
    assert "beam.tip displacement x [m]" in export.columns(found)


def test_modes_name_their_bodies_and_come_from_each(trajectory):
    titles = [axis.get_title() for axis in plot_modes(trajectory.system.basis, count=4).axes]
    assert titles[:4] == ["block: mode 0\nrigid", "block: mode 1\nrigid", "beam: mode 0\nrigid",
                          "beam: mode 1\nrigid"]


def test_summaries_and_tables_name_bodies_and_interfaces(trajectory):
    for shown in (trajectory.system.basis, trajectory.system, trajectory):
        rows = dict(shown.summary())
        assert rows["bodies"] == "block (5 modes), beam (5 modes)"
        assert rows["contact nodes"] == "29 (8 shoe, 21 foot)"
    from rich.console import Console

    console = Console(width=120, file=StringIO())
    console.print(run_table(trajectory))
    text = console.file.getvalue()
    assert "of block" in text
    shares = contact_shares(trajectory, slice(8, 29))
    assert f"foot: beam and ground   21 nodes, {100.0 * shares['open']:.1f} % open" in text
    assert sum(shares.values()) == pytest.approx(1.0)


def test_case_reads_back_and_holds_the_bodies_for_other_programs(trajectory, tmp_path):
    path = write_case(tmp_path / "stack.vtkhdf", trajectory, frames=4)
    again = read_case(path).trajectory
    basis, stored = trajectory.system.basis, again.system.basis
    assert stored.parts == basis.parts
    np.testing.assert_array_equal(stored.normals, basis.normals)
    np.testing.assert_array_equal(stored.ground_nodes, basis.ground_nodes)
    np.testing.assert_array_equal(again.normal_force, trajectory.normal_force)
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        body = group["PointData/body"][()]
        assert list(group["PointData/body"].attrs["names"]) == ["block", "beam"]
        np.testing.assert_array_equal(body, [0] * 40 + [1] * 105)
        np.testing.assert_array_equal(group["CellData/body"], [0] * 28 + [1] * 80)
        force = group["PointData/contact_force"][()].reshape(4, 145, 3)
        which = frame_indices(trajectory.time, 4)
        np.testing.assert_allclose(
            force[:, body == 0, :2].sum(axis=1),
            contact_forces(trajectory, which)[:, :8].sum(axis=1), rtol=1e-5, atol=1e-3)


def test_paraview_reads_bodies_at_every_time(trajectory, tmp_path):
    vtk = pytest.importorskip("vtkmodules.vtkIOHDF")
    reader = vtk.vtkHDFReader()
    path = write_case(tmp_path / "stack.vtkhdf", trajectory, frames=3)
    reader.SetFileName(str(path))
    for step in range(3):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutput()
        cells, points = (data.GetArray("body") for data in (grid.GetCellData(),
                                                            grid.GetPointData()))
        assert [cells.GetValue(k) for k in (0, 27, 28, 107)] == [0, 0, 1, 1]
        assert [points.GetValue(k) for k in (39, 40)] == [0, 1]


def test_pvd_frames_hold_the_bodies(trajectory, tmp_path):
    export_pvd(trajectory, tmp_path / "stack", frames=2)
    frame = meshio.read(tmp_path / "stack" / "stack_0001.vtu")
    np.testing.assert_array_equal(frame.point_data["body"], [0] * 40 + [1] * 105)


def test_tables_name_interfaces_and_hold_forces_in_global_axes(inclined, trajectory, tmp_path):
    import xarray

    data = to_xarray(inclined)
    assert data.node_interface.values.tolist() == ["shoe"] * 8
    assert data.mode_body.values.tolist() == ["block"] * 5 + ["beam"] * 5
    np.testing.assert_allclose(data.node_position, np.linspace(0.0, 0.05, 8), atol=1e-15)
    forces = contact_forces(inclined)
    for axis, name in enumerate(("contact_force_x", "contact_force_y")):
        np.testing.assert_array_equal(data[name], forces[..., axis])
    n = np.column_stack([data.node_normal_x, data.node_normal_y])
    np.testing.assert_allclose(data.contact_force_x * n[:, 0] + data.contact_force_y * n[:, 1],
                               inclined.normal_force, rtol=1e-12)
    relative = data.node_relative_displacement.sel(direction="n")
    np.testing.assert_allclose(relative, -inclined.penetration, atol=1e-18)
    with xarray.open_dataset(export.export_netcdf(inclined, tmp_path / "a.nc"),
                             engine="scipy") as stored:
        assert stored.node_interface.values.astype(str).tolist() == ["shoe"] * 8
    with export.export_csv(trajectory, tmp_path / "a.csv").open(newline="") as file:
        names, *rows = csv.reader(file)
    column = names.index("foot: node 9 friction force on the body in -t [N]")
    np.testing.assert_allclose(np.array(rows, dtype=float)[:, column],
                               trajectory.friction_force[:, 9], rtol=1e-12)
    assert export.export_mat(trajectory, tmp_path / "a.mat").is_file()


def test_commands_draw_and_export_several_bodies(trajectory, tmp_path, capsys):
    case = write_case(tmp_path / "stack.vtkhdf", trajectory, frames=2)
    assert execute(["plot", str(case), "contact_map", "-o", str(tmp_path / "map.png")]) == 0
    assert execute(["export", str(case), "--format", "csv"]) == 0
    capsys.readouterr()
