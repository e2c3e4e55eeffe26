"""Plots of runs of solids: what curves and maps show, and what is refused in a sentence."""

import numpy as np
import pytest
from test_solid_result_files import SIZE, moved, solid, stacked, system

import fecontact as fc
from fecontact.integrate import WearHistory
from fecontact.laws import EnergyWear
from fecontact.output.files.frames import contact_forces
from fecontact.output.plots.bodies import in_picture
from fecontact.output.plots.solids.plans import face_plans
from fecontact.output.plots.solids.surface import view_axes
from fecontact.plot import (
    plot_contact_map,
    plot_convergence,
    plot_energies,
    plot_friction_work,
    plot_history,
    plot_modes,
    plot_phase,
    plot_stress,
    plot_wear,
)
from fecontact.reduction import ModeConvergence
from fecontact.system.columns import POWERS


@pytest.fixture(scope="module")
def run():
    return moved(system(solid()), times=41)


@pytest.fixture(scope="module")
def two():
    return moved(stacked(), times=11)


def lines(axes):
    return {line.get_label(): np.asarray(line.get_ydata()) for line in axes.lines}


def panel(figure, words):
    (found,) = [axes for axes in figure.axes if words in axes.get_ylabel()]
    return found


def collections_of(axes, kind):
    return [one for one in axes.collections if type(one).__name__ == kind]


def test_history_has_three_directions_and_friction_along_both_axes(run):
    figure = plot_history(run, ["B", 2])
    z = lines(panel(figure, "displacement z"))
    assert z["B"] == pytest.approx(run.displacement("B")[:, 2], rel=1e-9)
    assert z["contact node 2"] == pytest.approx(run.displacement(2)[:, 2], rel=1e-9)
    friction = lines(panel(figure, "total friction on the body"))
    total = contact_forces(run)[..., :2].sum(axis=1)
    assert friction["size"] == pytest.approx(np.linalg.norm(total, axis=1), rel=1e-9, abs=1e-9)
    assert friction["x"] == pytest.approx(total[:, 0], rel=1e-9, abs=1e-9)
    assert friction["y"] == pytest.approx(total[:, 1], rel=1e-9, abs=1e-9)
    (normal,) = lines(panel(figure, "total normal force")).values()
    expected = run.normal_force.sum(axis=1)
    assert normal / normal.max() == pytest.approx(expected / expected.max())


def test_history_of_two_solids_names_relative_motion(two):
    figure = plot_history(two, ["upper.B" if "upper.B" in two.system.basis.extra else "B", 1])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[1] == "seam: node 1, relative (t, t2, n)"
    size = lines(panel(figure, "size of total friction"))["seam"]
    expected = np.linalg.norm((two.friction_forces.sum(axis=1)), axis=1)
    assert size / size.max() == pytest.approx(expected / expected.max())


def test_phase_portraits_of_all_directions_with_the_speed_of_the_ground(run):
    for row, (component, speed) in enumerate((("x", 0.02), ("y", 0.05), ("z", None))):
        axes = plot_phase(run, "B", component).axes[0]
        x = np.asarray(axes.lines[0].get_xdata())
        moved = run.displacement("B")[:, row]
        assert x / np.abs(x).max() == pytest.approx(moved / np.abs(moved).max())
        levels = [line.get_ydata()[0] for line in axes.lines if line.get_label() == "ground"]
        assert levels == ([] if speed is None else pytest.approx([speed]))
    with pytest.raises(fc.InputError, match="component = 'phi' is not known; choose from 'x', 'y'"):
        plot_phase(run, "B", "phi")


def test_contact_maps_show_pressure_state_friction_and_wear_at_chosen_times(run):
    times = [run.time[10], run.time[20]]
    law = EnergyWear(1e-9)
    figure = plot_contact_map(run, times=times, wear=law)
    maps = [axes for axes in figure.axes if collections_of(axes, "PathCollection")]
    assert len(maps) == 6
    first = [axes for axes in maps if axes.get_title()]
    assert [axes.get_title() for axes in first] == ["t = 2.5 ms", "t = 5 ms"]
    for column, index in enumerate((10, 20)):
        (patches,) = collections_of(maps[column], "PathCollection")
        shown = np.asarray(patches.get_array())
        scale = shown.max() / run.pressure[index].max()
        assert shown == pytest.approx(scale * run.pressure[index])
        assert min(abs(scale - 1.0), abs(1e3 * scale - 1.0)) < 1e-12
        (quiver,) = collections_of(maps[column], "Quiver")
        force = contact_forces(run)[index]
        assert np.allclose(np.column_stack([quiver.U, quiver.V]), force[:, :2], rtol=1e-12)
        (states,) = collections_of(maps[2 + column], "PathCollection")
        assert np.array_equal(states.get_array(), run.contact_state[index])
        (worn,) = collections_of(maps[4 + column], "PathCollection")
        depth = run.wear_depth(law)[index]
        assert np.asarray(worn.get_array()) == pytest.approx(
            depth * np.asarray(worn.get_array()).max() / depth.max())
    shares = panel(figure, "area [%]")
    assert len(collections_of(shares, "FillBetweenPolyCollection")) == 3 or (
        len(collections_of(shares, "PolyCollection")) == 3)


def test_contact_maps_refuse_times_out_of_the_run_and_plane_bodies(run):
    from synthetic import run as plane

    with pytest.raises(fc.InputError, match=r"times = \[1\.0\] must lie between 0 s and 0\.01 s"):
        plot_contact_map(run, times=[1.0])
    with pytest.raises(fc.InputError, match="must be one to 8 times of the run"):
        plot_contact_map(run, times=[])
    with pytest.raises(fc.InputError, match="is for solids, but this run has plane bodies"):
        plot_contact_map(plane(times=5), times=[0.0])


def test_friction_work_is_that_of_both_directions(run):
    figure = plot_friction_work(run)
    work, slip = [axes for axes in figure.axes if collections_of(axes, "PathCollection")]
    shown = np.asarray(collections_of(work, "PathCollection")[0].get_array())
    areas = run.system.basis.contact_areas
    expected = run.friction_work[-1] / areas
    assert shown / shown.max() == pytest.approx(expected / expected.max())
    speed = np.hypot(*np.moveaxis(run.slip_velocities, 2, 0)) * (run.normal_force > 0.0)
    expected = np.trapezoid(speed, run.time, axis=0)
    shown = np.asarray(collections_of(slip, "PathCollection")[0].get_array())
    assert shown / shown.max() == pytest.approx(expected / expected.max())


def test_wear_over_the_face_and_over_the_cycles(run):
    basis = run.system.basis
    depth = np.outer([0.0, 1.0, 2.0], [1e-6, 2e-6, 3e-6, 5e-6])
    history = WearHistory(
        EnergyWear(1e-12), 1.0, 100.0, x=basis.contact_x, tributary=basis.tributary,
        gap=np.zeros(4), cycles=np.array([0.0, 100.0, 200.0]), time=np.array([0.0, 0.1, 0.2]),
        depth=depth, normal_force=np.array([[1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0]]),
        slip_work=np.ones((2, 4)), state=np.zeros(16), status=fc.Status.FINISHED)
    figure = plot_wear(history, basis=basis)
    maps = [axes for axes in figure.axes if collections_of(axes, "PathCollection")]
    shown = [np.asarray(collections_of(axes, "PathCollection")[0].get_array()) for axes in maps]
    assert shown[0] == pytest.approx(depth[-1] / 1e-6)
    assert shown[1] / shown[1].max() == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert shown[2] / shown[2].max() == pytest.approx([1.0, 0.75, 0.5, 0.25])
    growth = lines(panel(figure, "worn depth [µm]"))
    assert growth["largest"] == pytest.approx([0.0, 5.0, 10.0])
    assert growth["mean"] == pytest.approx([0.0, 2.75, 5.5])


def test_modes_and_stress_are_drawn_on_what_is_seen_of_the_surface(run):
    """Three of the six faces of a block are seen, with their areas in the projection."""
    basis = run.system.basis
    figure = plot_modes(basis, count=3)
    assert [axes.get_title() for axes in figure.axes[:3]] == [
        f"mode {k}: rigid" for k in range(3)]
    zero = basis.fields(np.zeros(basis.modes))
    axes = plot_stress(zero, scale=1.0).axes[0]
    (surface,) = [one for one in axes.collections if type(one).__name__ == "PolyCollection"]
    corners = np.array([path.vertices[:-1] for path in surface.get_paths()])
    after = np.roll(corners, -1, axis=1)
    area = 0.5 * np.abs((corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]
                         ).sum(axis=1)).sum()
    back = np.abs(view_axes()[2])
    a, b, c = SIZE
    assert area == pytest.approx(back @ [b * c, a * c, a * b])
    assert in_picture(basis.mode_shapes.nodes).max(axis=0) == pytest.approx(
        corners.max(axis=(0, 1)))
    for component in ("yz", "xz", "von_mises"):
        plot_stress(basis.fields(run.modal_coordinates[3]), component=component)


def test_every_other_plot_takes_solids(run, two, tmp_path):
    for one in (run, two):
        plot_energies(one)
        plot_contact_map(one, path=tmp_path / "map.png")
        plot_friction_work(one)
    plot_modes(two.system.basis, count=2)
    found = ModeConvergence(
        unknowns=np.array([100, 200]), frequencies_hz=np.array([[100.0], [99.0]]),
        compliance=np.array([[1.0, 2.0, 3.0], [1.1, 2.1, 3.1]]), modes=np.array([5, 10]),
        residual_vectors=np.array([0, 0]), missing=np.array([[0.1, 0.2, 0.3], [0.01, 0.02, 0.03]]))
    labels = [text.get_text() for axes in plot_convergence(found).axes
              for text in axes.get_legend().get_texts()]
    assert {"contact compliance in z", "in z"} <= set(labels)


def test_contact_maps_show_phases_of_the_last_period():
    """Quarters of twelve whole periods would all be the same phase."""
    one = system(solid())
    t = np.linspace(0.0, 12.0, 481)
    q = np.zeros((len(t), one.basis.modes))
    rate = np.zeros_like(q)
    q[:, 2] = 1e-6 * np.sin(2.0 * np.pi * t)
    rate[:, 2] = 2e-6 * np.pi * np.cos(2.0 * np.pi * t)
    run = fc.Trajectory(one, t, q, rate, np.zeros((len(t), len(POWERS))))
    titles = [axes.get_title() for axes in plot_contact_map(run).axes if axes.get_title()]
    assert titles == ["t = 11.25 s", "t = 11.5 s", "t = 11.75 s", "t = 12 s"]


def test_shear_over_a_face_of_a_solid(tmp_path):
    """Arrows are the friction on the body; colours are its size over the areas, and the states."""
    from fecontact.plot import plot_loop, plot_shear

    one = system(solid(), load=fc.Load(100.0), drive=fc.Drive(stiffness_x=1e8, stiffness_y=1e8))
    path = fc.LoadPath(motion_x=(0.0, 3e-7, 6e-7), travel_y=(0.0, 5e-7, 5e-7), steps=4)
    history = fc.load_history(one, path)
    figure = plot_shear(history, path=tmp_path / "shear.png")
    shear = panel(figure, "friction")
    drawn = np.asarray(shear.collections[0].get_array())
    size = np.linalg.norm(history.friction_forces[-1], axis=1) / one.basis.contact_areas
    assert drawn / drawn.max() == pytest.approx(size / size.max(), rel=1e-9)
    (arrows,) = collections_of(shear, "Quiver")
    across = np.column_stack([arrows.U, arrows.V])
    force = -history.friction_forces[-1]
    assert across / np.abs(across).max() == pytest.approx(force / np.abs(force).max(), abs=1e-6)
    loop = plot_loop(history, action="travel_y", path=tmp_path / "loop.png")
    assert "along y" in loop.axes[0].get_xlabel()
    assert loop.axes[0].lines[0].get_ydata()[-1] != 0.0


def test_faces_around_an_axis_are_unrolled():
    """A bush of 16 facets: widths are arcs, the seam lies in the widest gap."""
    angle = np.linspace(0.0, 1.5 * np.pi, 16)
    places = np.column_stack([0.1 * np.cos(angle) + 0.3, np.zeros(16), 0.1 * np.sin(angle)])
    normals = np.column_stack([-np.cos(angle), np.zeros(16), -np.sin(angle)])
    basis = fc.ModalBasis(
        np.array([100.0]), np.zeros((1, 1)), np.ones((18, 6, 1)),
        np.vstack([np.zeros((2, 3)), places]), np.full(16, 1e-4), contact_normals=normals)
    (plan,) = face_plans(basis, "map")
    assert plan.labels == ("along the circumference", "along the axis")
    order = np.argsort(plan.places[:, 0])
    assert np.ptp(plan.places[:, 0]) == pytest.approx(0.15 * np.pi)
    assert np.abs(np.diff(order)).max() == 1
    assert np.ptp(plan.places[:, 1]) == pytest.approx(0.0, abs=1e-12)
    # Along the circumference everywhere.
    radial = np.einsum("kd,kd->k", plan.axes[:, 0], normals)
    assert radial == pytest.approx(0.0, abs=1e-12)
