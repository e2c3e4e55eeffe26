import inspect
import struct
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.collections import TriMesh
from matplotlib.image import imread
from synthetic import basis, rectangle, run

import fecontact
from fecontact import InputError, Trajectory, basis_from_matrices
from fecontact.fem import BodyFields
from fecontact.integrate import Energies
from fecontact.output.diagrams.colours import ENERGY_COLOURS
from fecontact.output.diagrams.diagram import thinned
from fecontact.output.plots.bodies import draw_body
from fecontact.plot import (
    STATE_COLOURS,
    new_figure,
    plot_contact_map,
    plot_energies,
    plot_friction_work,
    plot_history,
    plot_modes,
    plot_phase,
    plot_stress,
    styled,
)
from fecontact.reduction.mode_shapes import BodyPart
from fecontact.system import columns, powers


def labels(figure):
    return [axis.get_ylabel() for axis in figure.axes]


def mesh_values(axis):
    return np.asarray(axis.collections[0].get_array())


def test_history_shows_each_point_in_suitable_units():
    trajectory = run(times=101)
    figure = plot_history(trajectory, ["B", 0, (0.2, 0.02)])
    assert labels(figure) == [
        "displacement x [µm]", "velocity x [mm/s]", "displacement y [µm]", "velocity y [mm/s]",
        "total normal force [N]", "total friction on the body, +x [mN]"]
    assert [axis.get_xlabel() for axis in figure.axes] == ["", "", "", "", "time [ms]", "time [ms]"]
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["B", "contact node 0", "(0.2, 0.02) m"]
    line = figure.axes[2].lines[1]
    np.testing.assert_allclose(line.get_xdata(), trajectory.time)
    np.testing.assert_allclose(line.get_ydata(), trajectory.displacement(0)[:, 1])
    np.testing.assert_allclose(figure.axes[4].lines[0].get_ydata(),
                               trajectory.normal_force.sum(axis=1))


def test_history_leaves_out_what_stays_zero():
    trajectory = run(times=101)
    still = trajectory.modal_coordinates.copy()
    still[:, [0, 2, 3, 4]] = 0.0  # up and down alone
    rate = trajectory.modal_velocities.copy()
    rate[:, [0, 2, 3, 4]] = 0.0
    system = trajectory.system.with_(**{"friction.static_coefficient": 0.0,
                                        "friction.kinetic_coefficient": 0.0})
    figure = plot_history(replace(trajectory, system=system, modal_coordinates=still,
                                  modal_velocities=rate), ["C"])
    assert labels(figure) == ["displacement y [µm]", "velocity y [mm/s]", "total normal force [N]"]
    assert figure.axes[2].get_xlabel() == "time [ms]"
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata(), still[:, 1])


def test_colours_of_a_stress_end_below_a_sharp_peak():
    nodes, cells, _ = rectangle(0.2, 0.1, 20, 10)
    stress = np.zeros((len(nodes), 4))
    stress[:, 0] = 1e6 * nodes[:, 0] / 0.2
    fields = BodyFields(nodes, cells, np.zeros_like(nodes), stress)
    figure = plot_stress(fields, component="xx")
    drawn = figure.axes[0].collections[0]
    assert drawn.get_clim() == (-1.0, 1.0)  # MPa
    assert not figure.legends
    stress[7, 0] = -5e6
    figure = plot_stress(fields, component="xx")
    usual = 1e-6 * np.percentile(np.abs(stress[:, 0]), 99.0)
    assert figure.axes[0].collections[0].get_clim() == pytest.approx((-usual, usual))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["peak -5 MPa"]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xydata()[0], nodes[7])
    assert figure.axes[0].get_xlabel() == "x [mm]"


def test_words_of_a_stress_stay_within_the_figure():
    """A slender body, whose picture is low."""
    nodes, cells, _ = rectangle(1.0, 0.05, 20, 2)
    stress = np.zeros((len(nodes), 4))
    stress[:, 0] = np.linspace(0.0, 1e6, len(nodes)) + 1e7 * (np.arange(len(nodes)) == 3)
    for component in ("von_mises", "xx"):
        figure = plot_stress(BodyFields(nodes, cells, 1e-3 * nodes, stress),
                             component=component)
        figure.draw_without_rendering()
        renderer = figure.canvas.get_renderer()
        boxes = [figure.axes[0].title.get_window_extent(renderer),
                 figure.axes[0].xaxis.label.get_window_extent(renderer),
                 figure.axes[1].yaxis.label.get_window_extent(renderer)]
        width, height = figure.canvas.get_width_height()
        for box in boxes:
            assert 0.0 <= box.x0 < box.x1 <= width
            assert 0.0 <= box.y0 < box.y1 <= height


def test_slip_and_friction_have_colours_of_their_own():
    from fecontact.output.diagrams.runs import forces_on_body_diagram

    lines = forces_on_body_diagram(run(times=21)).curves
    assert {line.name: line.colour for line in lines}["friction on the body, +x"] not in (
        STATE_COLOURS.values())


def test_plots_take_a_style(tmp_path):
    trajectory = run(times=21)
    plain = plot_phase(trajectory)
    with styled({"font.size": 17.0, "axes.grid": False}):
        figure = plot_phase(trajectory, path=tmp_path / "large.png")
        with styled("grayscale"):
            grey = plot_phase(trajectory)
    assert figure.axes[0].xaxis.label.get_size() == 10.0  # set apart by the package's style
    assert figure.axes[0].xaxis.get_ticklabels()[0].get_size() > 1.5 * (
        plain.axes[0].xaxis.get_ticklabels()[0].get_size())
    assert not figure.axes[0].xaxis.get_gridlines()[0].get_visible()
    assert grey.get_facecolor() == (0.75, 0.75, 0.75, 1.0)
    assert plot_phase(trajectory).get_facecolor() == (1.0, 1.0, 1.0, 1.0)
    (tmp_path / "own.mplstyle").write_text("figure.facecolor: ff0000\n")
    with styled(tmp_path / "own.mplstyle"):
        figure = plot_phase(trajectory, path=tmp_path / "red.png")
    assert imread(tmp_path / "red.png")[0, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
    for wrong, message in (("sevborn-v0_8", "did you mean 'seaborn-v0_8"),
                           (tmp_path / "none.mplstyle", "does not exist"),
                           ({"font.sise": 3}, "font.sise"), ({"font.size": "big"}, "font.size"),
                           (7, "style = 7")):
        with pytest.raises(InputError, match=message), styled(wrong):
            pass


@pytest.mark.parametrize("times", [101, 9001])
def test_phase_plane_is_velocity_over_displacement_with_the_ground(times):
    trajectory = run(times=times)
    figure = plot_phase(trajectory, 2, "x")
    plane = figure.axes[0]
    assert (plane.get_xlabel(), plane.get_ylabel()) == ("displacement x [µm]", "velocity x [mm/s]")
    np.testing.assert_allclose(plane.lines[0].get_xdata(), trajectory.displacement(2)[:, 0])
    np.testing.assert_allclose(plane.lines[0].get_ydata(), trajectory.velocity(2)[:, 0])
    assert list(plane.lines[2].get_ydata()) == [0.02, 0.02]
    assert len(plot_phase(trajectory, "B", "y").axes[0].lines) == 2
    with pytest.raises(InputError, match="component = 'z'"):
        plot_phase(trajectory, "B", "z")
    with pytest.raises(InputError, match="no point 'Z'"):
        plot_phase(trajectory, "Z")


def test_contact_map_shows_pressure_and_states():
    trajectory = run(times=101)
    figure = plot_contact_map(trajectory)
    upper, lower = figure.axes[:2]
    assert upper.get_ylabel() == lower.get_ylabel() == "contact position x [mm]"
    assert lower.get_xlabel() == "time [ms]"
    assert "line load [N/m]" in labels(figure)
    np.testing.assert_allclose(mesh_values(upper), trajectory.line_load.T)
    assert np.array_equal(mesh_values(lower), trajectory.contact_state.T)
    thick = run(replace(basis(), thickness=1e-3), times=101)
    figure = plot_contact_map(thick)
    assert "contact pressure [kPa]" in labels(figure)
    np.testing.assert_allclose(mesh_values(figure.axes[0]), 1e3 * trajectory.line_load.T)
    figure = plot_contact_map(trajectory)
    names = [text.get_text() for axis in figure.axes if axis.get_ylabel() == "state"
             for text in axis.get_yticklabels()]
    assert names == ["open", "stick", "slip"]
    assert upper.get_ylim() == pytest.approx((0.0, 0.2))
    assert upper.get_xlim() == pytest.approx((0.0, 0.02))


def test_contact_map_of_a_long_run_keeps_short_impacts():
    trajectory = run(times=30_001)
    force = np.zeros((30_001, 5))
    force[12_345, 3] = 7.0
    trajectory.__dict__["_contact"] = np.stack([force] + [0 * force] * 5, axis=2)
    upper, lower = plot_contact_map(trajectory).axes[:2]
    assert mesh_values(upper).shape == (5, 1500)
    assert mesh_values(upper).max() == pytest.approx(7.0 / 0.04)
    assert np.flatnonzero(mesh_values(upper)[3]) == [12_345 * 1500 // 30_001]
    assert mesh_values(lower)[3, 12_345 * 1500 // 30_001] == 1  # sticks: no slip velocity
    assert np.count_nonzero(mesh_values(lower)) == 1


@pytest.mark.parametrize("times", [1, 2, 5])
def test_contact_map_of_one_node_and_few_times(times):
    trajectory = run(basis(contact_nodes=1), times=5)
    short = Trajectory(trajectory.system, *(values[:times] for values in (
        trajectory.time, trajectory.modal_coordinates, trajectory.modal_velocities,
        trajectory.work)))
    upper, lower = plot_contact_map(short).axes[:2]
    assert mesh_values(upper).shape == mesh_values(lower).shape == (1, times)
    assert upper.get_ylabel() == "contact node"


def placed(x_mm, length_mm, groups=()):
    """A run whose contact nodes have the given places and tributary lengths [mm]."""
    body = basis(contact_nodes=len(x_mm))
    positions = body.positions.copy()
    positions[2:, 0] = 1e-3 * np.asarray(x_mm)
    return run(replace(body, positions=positions, tributary=1e-3 * np.asarray(length_mm),
                       groups=groups), times=41)


def bands(trajectory):
    """Ends [mm] of the coloured rows of both maps and, in that order, the line loads shown."""
    found = []
    panels = [axis for axis in plot_contact_map(trajectory).axes
              if axis.get_label() != "<colorbar>"]
    several = len(trajectory.system.basis.groups) > 1
    for axis in panels:
        assert axis.get_ylabel() == "contact position x [mm]" or (several and axis in panels[1::2])
        mesh = axis.collections[0]
        edges = 1e3 * np.ma.getdata(mesh.get_coordinates())[:, 0, 1]
        values = np.ma.asarray(mesh.get_array())
        shown = ~np.ma.getmaskarray(values).any(axis=1)
        assert np.ma.getmaskarray(values)[~shown].all()
        found.append((np.column_stack([edges[:-1], edges[1:]])[shown], values[shown].data))
    loads, states = found[::2], found[1::2]
    for (ends, _), (same, _) in zip(loads, states, strict=True):
        np.testing.assert_array_equal(ends, same)
    return np.concatenate([ends for ends, _ in loads]), np.concatenate([load for _, load in loads])


def test_contact_map_leaves_places_without_contact_face_blank():
    # Faces at 0 to 50 and 150 to 200 mm, the right one given first.
    trajectory = placed([162.5, 187.5, 10.0, 35.0], [25.0, 25.0, 20.0, 30.0])
    ends, load = bands(trajectory)
    np.testing.assert_allclose(ends, [[0, 20], [20, 50], [150, 175], [175, 200]], atol=1e-9)
    np.testing.assert_allclose(load, trajectory.line_load.T[[2, 3, 0, 1]])


def test_contact_groups_of_one_body_have_panels_of_their_own():
    """No white space between faces that lie apart, here at 0 to 50 and 150 to 200 mm."""
    trajectory = placed([162.5, 187.5, 10.0, 35.0], [25.0, 25.0, 20.0, 30.0],
                        (("right", 2), ("left", 2)))
    axes = plot_contact_map(trajectory).axes
    assert [axis.get_title(loc="left") for axis in axes[:4:2]] == ["right", "left"]
    assert axes[0].get_ylim() == axes[1].get_ylim() == pytest.approx((0.15, 0.2))
    assert axes[2].get_ylim() == pytest.approx((0.0, 0.05))
    np.testing.assert_allclose(bands(trajectory)[1], trajectory.line_load.T)
    work = plot_friction_work(trajectory).axes
    assert [axis.get_title() for axis in work[:2]] == ["right", "left"]
    assert [len(axis.patches) for axis in work] == [2] * 4
    assert work[2].get_xlabel() == "contact position x [mm]"


@pytest.mark.parametrize(("x", "length", "groups", "ends"), [
    # One group in two parts, whose gap is as wide as a band.
    ([5, 15, 35, 45], [10, 10, 10, 10], (), [[0, 10], [10, 20], [30, 40], [40, 50]]),
    # A gap narrower than a band between groups, and nodes from right to left.
    ([45, 35, 20, 10], [10, 10, 10, 10], (("a", 2), ("b", 2)),
     [[30, 40], [40, 50], [5, 15], [15, 25]]),
    # An inclined face, along which x grows less than the length.
    ([5, 14, 23], [10, 10, 10], (), [[0, 9.5], [9.5, 18.5], [18.5, 28]]),
    # Displacement nodes of linear elements of 10, 20 and 10 mm, with nodes on the ends.
    ([0, 10, 30, 40], [5, 15, 15, 5], (), [[0, 5], [5, 20], [20, 35], [35, 40]]),
    # Nodes of quadratic elements of 60 mm; two groups touch at 60 mm, where each has a node.
    ([0, 30, 60, 60, 90, 120], [10, 40, 10, 10, 40, 10], (("a", 3), ("b", 3)),
     [[0, 10], [10, 50], [50, 60], [60, 70], [70, 110], [110, 120]]),
])
def test_bands_of_the_contact_map_are_as_wide_as_tributary_lengths(x, length, groups, ends):
    found, _ = bands(placed(x, length, groups))
    np.testing.assert_allclose(found, ends, atol=1e-9)


def test_contact_map_goes_by_numbers_where_nodes_share_a_place():
    upper = plot_contact_map(placed([50, 50, 80], [10, 10, 10])).axes[0]
    assert upper.get_ylabel() == "contact node"
    assert mesh_values(upper).shape == (3, 41)


def test_contact_map_without_friction_shows_contact():
    trajectory = run(times=41)
    contact = trajectory._contact.copy()
    contact[:, :, columns.FRICTION_FORCE] = 0.0
    smooth = replace(trajectory)
    smooth.__dict__["_contact"] = contact
    assert (smooth.contact_state == 2).any()
    figure = plot_contact_map(smooth)
    names = [text.get_text() for axis in figure.axes if axis.get_ylabel() == "state"
             for text in axis.get_yticklabels()]
    assert names == ["open", "contact"]
    np.testing.assert_array_equal(mesh_values(figure.axes[1]), smooth.normal_force.T != 0.0)


def test_energies_leave_out_what_is_zero():
    trajectory = run(times=101)
    work = np.zeros((101, len(powers.POWERS)))
    work[:, powers.FRICTION] = 1e-3 * np.linspace(0.0, 1.0, 101)
    figure = plot_energies(replace(trajectory, work=work))
    assert labels(figure) == ["stored energy [mJ]", "energy lost [mJ]"]  # nothing is put in
    shown = [[text.get_text() for text in axis.get_legend().get_texts()] for axis in figure.axes]
    assert shown == [["kinetic", "elastic", "contact", "total"], ["friction", "total"]]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata(),
                               trajectory.energies.kinetic)
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), work[:, powers.FRICTION])


def test_modes_are_titled_by_their_frequencies():
    body = basis(columns=12, rows=3)
    figure = plot_modes(body)
    titles = [axis.get_title() for axis in figure.axes if axis.get_title()]
    assert titles == ["mode 0: rigid", "mode 1: rigid", "mode 2: rigid", "mode 3: 2000 Hz",
                      "mode 4: 9000 Hz"]
    amplitude = mesh_values(figure.axes[4])
    stretch = np.abs(body.mode_shapes.nodes[:, 0] - 0.1) / 0.1
    np.testing.assert_allclose(amplitude, stretch, atol=1e-12)
    assert sum(bool(axis.get_title()) for axis in plot_modes(body, count=2).axes) == 2
    with pytest.raises(InputError, match="count = 0"):
        plot_modes(body, count=0)
    plain = basis_from_matrices(np.eye(1), np.eye(1), {"contact": np.ones((1, 3, 1))})
    with pytest.raises(InputError, match="no shapes"):
        plot_modes(plain)


def test_colours_of_energies_tell_where_they_are():
    named = {entry.name for entry in fields(Energies)} - {"rounding"}
    assert set(ENERGY_COLOURS) == named
    panels = (("kinetic", "elastic", "drive_spring", "contact", "bristles"),
              ("drive_work", "belt_normal_work", "belt_friction_work", "load_work",
               "circulatory_work", "bristle_work"),
              ("modal_damping", "dashpots", "contact_damping", "friction"))
    for names in panels:
        assert len({ENERGY_COLOURS[name] for name in names}) == len(names)


def test_long_lines_are_thinned_without_losing_peaks():
    t = np.linspace(0.0, 1.0, 100_003)
    y = np.sin(2.0 * np.pi * 3.0 * t)
    y[77_777], y[50_001], y[-1] = 5.0, -4.0, 3.0
    x, kept = thinned(t, y)
    assert len(x) < 5000
    assert (kept.max(), kept.min()) == (5.0, -4.0)
    assert x[np.argmax(kept)] == t[77_777]
    assert (x[0], x[-1], kept[-1]) == (0.0, 1.0, 3.0)
    assert (np.diff(x) > 0.0).all()
    assert thinned(t[:100], y[:100])[0] is not None
    assert len(thinned(t[:7999], y[:7999])[0]) == 7999


@pytest.mark.parametrize("triangles", [False, True])
def test_files_are_pictures(tmp_path, triangles):
    body = basis(columns=8, rows=2, triangles=triangles)
    trajectory = run(body, times=41)
    made = [tmp_path / f"{what}.png" for what in ("history", "phase", "map", "energies", "modes")]
    plot_history(trajectory, path=made[0])
    plot_phase(trajectory, 0, path=made[1])
    plot_contact_map(trajectory, path=made[2])
    plot_energies(trajectory, path=made[3])
    plot_modes(body, path=made[4])
    for path in made:
        header = path.read_bytes()[:24]
        width, height = struct.unpack(">II", header[16:24])
        assert header[:8] == b"\x89PNG\r\n\x1a\n"
        assert width >= 900
        assert height >= 400
    plot_phase(trajectory, path=tmp_path / "phase.pdf")
    assert (tmp_path / "phase.pdf").read_bytes()[:5] == b"%PDF-"
    plot_phase(trajectory, path=tmp_path / "phase.svg")
    assert b"velocity x [mm/s]" in (tmp_path / "phase.svg").read_bytes()
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".pdf", *[".png"] * 5, ".svg"]


def test_interrupted_and_impossible_plots_leave_nothing(tmp_path, monkeypatch):
    trajectory = run(times=11)
    with pytest.raises(InputError, match=r"must end in \.png, \.pdf or \.svg"):
        plot_energies(trajectory, path=tmp_path / "energies.jpg")
    with pytest.raises(InputError, match="does not exist"):
        plot_energies(trajectory, path=tmp_path / "nowhere" / "energies.png")

    def stop(self, *args, **options):
        args[0].write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", stop)
    with pytest.raises(KeyboardInterrupt):
        plot_energies(trajectory, path=tmp_path / "energies.png")
    assert not list(tmp_path.iterdir())


def test_plots_leave_matplotlib_as_it_was(tmp_path):
    import sys

    import matplotlib

    before = dict(matplotlib.rcParams)
    pyplot = "matplotlib.pyplot" in sys.modules
    plot_energies(run(times=11), path=tmp_path / "energies.png")
    assert dict(matplotlib.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) == pyplot


def test_every_plot_returns_its_figure_and_takes_a_path_by_name():
    names = [name for name in fecontact.plot.__all__ if name.startswith("plot_")]
    assert len(names) > 12
    for name in names:
        signature = inspect.signature(getattr(fecontact.plot, name))
        assert signature.return_annotation.strip('"') == "Figure"
        path = list(signature.parameters.values())[-1]
        assert (path.name, path.default, path.kind) == ("path", None, path.KEYWORD_ONLY)


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_a_figure_saved_later_is_the_one_in_the_file(tmp_path, monkeypatch, suffix):
    """Settings of the user between drawing and saving do not change its style."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    first, second = tmp_path / f"first.{suffix}", tmp_path / f"second.{suffix}"
    with rc_context({"svg.hashsalt": "one"}):
        figure = plot_phase(run(times=41), path=first)
        with rc_context({"grid.color": "red", "xtick.color": "red", "savefig.dpi": 40,
                         "svg.fonttype": "path", "pdf.fonttype": 3, "font.size": 20.0,
                         "axes.formatter.useoffset": True}):
            figure.savefig(second)
    assert second.read_bytes() == first.read_bytes()


def test_notebooks_show_the_figure_at_its_size():
    figure = plot_phase(run(times=41))
    picture, size = figure._repr_png_()
    width, height = struct.unpack(">II", picture[16:24])
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert (width, height) == (960, 780)  # 6.4 x 5.2 inches at 150 dots per inch
    assert size == {"width": 614, "height": 499}


def test_a_file_among_what_is_drawn_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"path='a\.png'"):
        plot_history(run(times=11), "a.png")
    with pytest.raises(TypeError):
        plot_energies(run(times=11), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("still", [0, 1])
def test_bodies_that_move_are_drawn_above_those_at_rest(still):
    """Two squares at one place, of which one has amplitudes of zero."""
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    bodies = SimpleNamespace(nodes=np.tile(square, (2, 1)), cells=np.arange(8).reshape(2, 4),
                             outline=np.array([(0, 1), (4, 5)]))
    values = np.ones(8)
    values[4 * still : 4 * still + 4] = 0.0
    parts = [BodyPart("one", (0, 1), (0, 4)), BodyPart("two", (1, 1), (4, 4))]
    with new_figure(3.0, 3.0) as figure:
        axes = figure.subplots()
        draw_body(axes, bodies, bodies.nodes, values, cmap="viridis", low=0.0, high=1.0,
                  parts=parts)
    below, above = (one for one in axes.collections if isinstance(one, TriMesh))
    owners = [4 * (one._triangulation.triangles.min() >= 4) for one in (below, above)]
    assert owners == [4 * still, 4 * (1 - still)]
