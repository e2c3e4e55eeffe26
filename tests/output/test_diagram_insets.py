"""Diagrams with runs and phase planes, and maps of basins: what is drawn."""

from dataclasses import replace

import numpy as np
import pytest
from systems import TURN, impact_oscillator

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    Attractor,
    Axis,
    Basins,
    Branch,
    BranchPoint,
    Collocation,
    PoincareScan,
    basins,
    contact_field,
    poincare_scan,
)
from fecontact.plot import Inset, phase_inset, plot_basins, plot_branches, plot_poincare_scan


def orbit(p, section, stable=True):
    return BranchPoint(np.array([p]), np.array([1.0]),
                       {"stable": stable, "observed_section": np.array(section)})


BRANCH = Branch("w", (orbit(1.0, [1.0, 2.0]), orbit(2.0, [1.5, 2.5]), orbit(3.0, [1.0, 3.0])))
CURVE = np.linspace(0.0, 2.0 * np.pi, 50)


def test_sections_over_runs():
    system = impact_oscillator(2)
    r = system.basis.T[0, 1]
    up = np.zeros((3, 2, 4))
    up[..., 0] = np.array([[1.0, 2.0], [1.5, 2.5], [1.0, 3.0]]) / r[0]
    runs = PoincareScan(system, "w", np.array([1.0, 2.0, 3.0]), up, up[:0])
    axis = plot_branches([BRANCH], "observed_section", beneath=runs,
                         observe=("B", "y")).axes[0]
    dots, *curves = axis.lines
    assert dots.get_xdata().tolist() == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert dots.get_ydata() == pytest.approx([1.0, 2.0, 1.5, 2.5, 1.0, 3.0])
    assert [line.get_ydata().tolist() for line in curves] == [[1.0, 1.5, 1.0], [2.0, 2.5, 3.0]]
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["runs, up"]


def test_phase_planes_stand_in_the_order_of_their_places(tmp_path):
    insets = [Inset(orbit(p, [p + 0.5], p < 2.0), np.cos(CURVE) * 1e-3, np.sin(CURVE), f"w = {p:g}")
              for p in (3.0, 1.0)]
    figure = plot_branches([BRANCH], "observed_section", insets=insets)
    _, first, second = figure.axes
    assert [axis.get_title() for axis in (first, second)] == ["a: w = 1", "b: w = 3"]
    assert [axis.lines[0].is_dashed() for axis in (first, second)] == [False, True]
    assert first.lines[0].get_xdata().max() == pytest.approx(1.0)
    assert first.get_xlabel() == "displacement [mm]"
    # Letters join them to their points in the diagram: no line crosses the curves.
    letters = {text.get_text(): text.xy for text in figure.axes[0].texts}
    assert letters == {"a": (1.0, 1.5), "b": (3.0, 3.5)}
    assert not figure.artists
    plot_branches(BRANCH, "observed_section", insets=insets, path=tmp_path / "with_insets.png")
    assert (tmp_path / "with_insets.png").stat().st_size > 10_000


def test_phase_plane_of_an_orbit():
    """y = a cos(w t) is an ellipse with the half axes a and a w."""
    w, a = 10.0 * TURN, 2e-4
    field = contact_field(impact_oscillator(2), {"drive.frequency_hz": None})
    y = field.displacement_row("B", "y")[:2]
    t = 2.0 * np.pi / w * np.arange(80) / 80.0
    q = a * y / (y @ y)
    nodes = np.concatenate([np.cos(w * t)[:, None] * q, -w * np.sin(w * t)[:, None] * q], axis=1)
    values = {"mesh": np.linspace(0.0, 1.0, 21), "period": 2.0 * np.pi / w, "stable": False,
              "minimum": nodes.min(axis=0), "maximum": nodes.max(axis=0)}
    point = BranchPoint(np.append(nodes.ravel(), 10.0), np.zeros(nodes.size + 1), values)
    branch = Branch("drive.frequency_hz", (point,), attributes={
        "periods": 1, "method": Collocation(20), "parameter_values": np.array([10.0])})
    inset = phase_inset(field, branch.points[0], observe=("B", "y"))
    assert inset.title == "drive.frequency_hz = 10"
    assert inset.displacement[0] == pytest.approx(a, rel=1e-12)
    assert (inset.displacement / a)**2 + (inset.velocity / (a * w))**2 == pytest.approx(
        np.ones(len(inset.velocity)), abs=1e-5)
    # It turns clockwise, as every phase plane.
    assert (np.diff(inset.displacement) * (inset.velocity[:-1] + inset.velocity[1:]) >= 0.0).all()
    with pytest.raises(InputError, match=r"of an inset, stores no value 'observed_section'"):
        plot_branches(BRANCH, "observed_section", insets=[inset])
    with pytest.raises(InputError, match="is no periodic orbit"):
        phase_inset(field, BRANCH.points[0])


def test_maps_of_basins(tmp_path):
    label = np.array([[0, 0, 1], [0, -1, 1]])
    found = Basins(np.array([0.0, 1.0]), np.array([0.0, 1.0, 2.0]), label, (
        Attractor("periodic", np.array([[0.5, 1.0], [0.6, 1.1]]), 0.5),
        Attractor("equilibrium", np.array([[0.2, 0.3]]), 1.0 / 3.0)))
    axis = plot_basins(found, x_label="x [m]", y_label="v [m/s]", rows=np.eye(2)).axes[0]
    drawn = axis.collections[0].get_array()
    assert np.array_equal(np.asarray(drawn).reshape(3, 2), label.T + 1)
    assert [text.get_text() for text in axis.get_legend().get_texts()] == [
        "periodic, 2 points, 50 %", "equilibrium, 33.3 %", "no end, 16.7 %", "its section"]
    assert axis.lines[0].get_xdata().tolist() == [0.5, 0.6]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("x [m]", "v [m/s]")
    with pytest.raises(InputError, match="must end in"):
        plot_basins(found, path=tmp_path / "basins.gif")


def test_densities_of_scans(tmp_path):
    """Cells are dark where the states of their values lie, whatever is missing."""
    system = impact_oscillator(1)
    shape = system.basis.T[0, 1, 0]
    y = np.array([[1e-4, 1e-4, 1e-4], [1e-4, 2e-4, 2e-4], [np.nan, np.nan, 3e-4]]) / shape
    up = np.stack([y, np.zeros((3, 3))], axis=2)
    found = PoincareScan(system, "drive.frequency_hz", np.array([60.0, 61.0, 63.0]), up,
                         up[:1, :0])
    for each in (replace(found, down=up), replace(found, down=up[:, :0])):
        axis = plot_poincare_scan(each, "B", "y", y_label="y [m]").axes[0]
        mesh = axis.collections[0]
        cells = np.ma.filled(mesh.get_array(), np.nan)
        corners = np.asarray(mesh.get_coordinates())
        edges, rows = corners[0, :, 0], corners[:, 0, 1]
        assert edges == pytest.approx([59.5, 60.5, 62.0, 64.0])
        column, height = np.nonzero(np.isfinite(cells).T)
        assert column.tolist() == [0, 1, 1, 2]
        middles = 0.5 * (rows[1:] + rows[:-1])[height]
        assert middles == pytest.approx([1e-4, 1e-4, 2e-4, 3e-4], abs=2e-7)
        assert cells.T[column, height] == pytest.approx([1.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])
        assert (axis.get_xlabel(), axis.get_ylabel()) == ("drive frequency [Hz]", "y [µm]")
    with pytest.raises(AnalysisError, match="no run of the diagram could go on"):
        plot_poincare_scan(replace(found, up=np.nan * up))
    with pytest.raises(InputError, match="must end in"):
        plot_poincare_scan(found, path=tmp_path / "scan.gif")


def test_columns_hold_several_of_many_values():
    """Five thousand values in 1600 columns at most; all states are counted."""
    system = impact_oscillator(1)
    values = np.linspace(60.0, 61.0, 5000)
    up = np.tile((values - 60.0)[:, None, None] / system.basis.T[0, 1, 0], (1, 2, 2))
    found = PoincareScan(system, "drive.frequency_hz", values, up, up[:, :0])
    mesh = plot_poincare_scan(found).axes[0].collections[0]
    cells = np.ma.filled(mesh.get_array(), 0.0)
    assert 800 < cells.shape[1] <= 1600
    assert cells.sum(axis=0) == pytest.approx(np.ones(cells.shape[1]))
    corners = np.asarray(mesh.get_coordinates())
    highest = corners[len(cells) - np.argmax(cells[::-1] > 0.0, axis=0), 0, 1]
    assert highest == pytest.approx(corners[0, 1:, 0] - 60.0, abs=3e-3)


def test_basins_of_a_system(tmp_path):
    found = basins(impact_oscillator(2), (Axis("B", "y"), [0.0, 4e-4]),
                   (Axis("B", "y", "velocity"), [-0.01, 0.02]), transient_periods=60, keep=4)
    plot_basins(found, path=tmp_path / "basins.png")
    assert (tmp_path / "basins.png").stat().st_size > 5_000
    runs = poincare_scan(impact_oscillator(2), "drive.frequency_hz", [10.2, 10.3],
                         transient_periods=60, keep=2, initial=np.zeros(4))
    assert len(plot_branches([BRANCH], "observed_section", beneath=runs,
                             observe=("B", "y")).axes[0].lines) == 4
