"""Bifurcation diagrams: what is drawn, and how."""

import numpy as np
import pytest
from systems import mode_coupling, two_mass_field

from fecontact import InputError
from fecontact.bifurcation import (
    Branch,
    BranchPoint,
    contact_field,
    equilibrium_branch,
    stability_map,
)
from fecontact.plot import plot_branches, plot_eigenvalues, plot_stability_map


def point(p, x, stable, kind=None):
    return BranchPoint(np.array([x, p]), np.array([0.0, 1.0]),
                       {"state": np.array([x, -x]), "stable": stable, "size": 2.0 * x}, kind)


BRANCH = Branch("p", (point(0.0, 1.0, True), point(1.0, 2.0, True),
                      point(1.5, 2.5, True, "Hopf"), point(2.0, 3.0, False),
                      point(3.0, 4.0, False), point(2.5, 4.5, False, "fold"),
                      point(2.0, 5.0, True)))


def test_stable_parts_are_solid_unstable_ones_dashed():
    axis = plot_branches([BRANCH], 0).axes[0]
    lines = [line for line in axis.lines if line.get_linestyle() != "None"]
    assert [line.get_xdata().tolist() for line in lines] == [
        [0.0, 1.0, 1.5], [1.5, 2.0, 3.0, 2.5], [2.5, 2.0]]
    assert [line.is_dashed() for line in lines] == [False, True, False]
    assert lines[1].get_ydata().tolist() == [2.5, 3.0, 4.0, 4.5]
    marks = [line for line in axis.lines if line.get_linestyle() == "None"]
    assert [(line.get_marker(), line.get_xdata()[0], line.get_ydata()[0]) for line in marks] == [
        ("o", 1.5, 2.5), ("s", 2.5, 4.5)]
    assert [text.get_text() for text in axis.texts] == ["H", "F"]
    assert [text.get_text() for text in axis.get_legend().get_texts()] == [
        "stable", "unstable", "Hopf (H)", "fold (F)"]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("p", "state 0")


def test_quantities_and_numbers_of_points():
    twice = Branch("p", (*BRANCH.points, point(3.0, 7.0, True, "Hopf"), point(4.0, 8.0, True)))
    axis = plot_branches([twice, BRANCH], "size", x=lambda at: 10.0 * at.parameter,
                         x_label="ten p", names=["first", "second"]).axes[0]
    assert axis.lines[0].get_xdata().tolist() == [0.0, 10.0, 15.0]
    assert axis.lines[0].get_ydata().tolist() == [2.0, 4.0, 5.0]
    # The Hopf point at 1.5 is on both branches, and is marked once.
    assert [text.get_text() for text in axis.texts] == ["H1", "H2", "F"]
    assert axis.get_xlabel() == "ten p"
    assert axis.lines[0].get_color() != axis.lines[3].get_color()
    with pytest.raises(InputError, match=r"'state' is not one number .* 'size', 'stable'"):
        plot_branches([BRANCH], "state")


def test_orbits_are_drawn_by_the_largest_value_of_a_state():
    """Equilibria and the orbits born of them stand in one diagram."""
    orbits = Branch("p", tuple(
        BranchPoint(np.array([0.0, p]), np.array([0.0, 1.0]),
                    {"maximum": np.array([3.0 + p, 7.0]), "minimum": np.zeros(2), "stable": True})
        for p in (1.5, 2.0)))
    axis = plot_branches([BRANCH, orbits]).axes[0]
    assert [line.get_ydata().tolist() for line in axis.lines
            if line.get_linestyle() != "None"][-1] == [4.5, 5.0]
    assert axis.get_ylabel() == "state 0"
    assert plot_branches(orbits, np.int64(1)).axes[0].lines[0].get_ydata().tolist() == [7.0, 7.0]
    with pytest.raises(InputError, match="There is no state 2: the branch stores 2 states"):
        plot_branches([BRANCH, orbits], 2)


def test_branches_of_one_name_share_colour_and_entry():
    above = Branch("p", (point(0.0, 7.0, True), point(1.0, 8.0, True)))
    axis = plot_branches([BRANCH, above, above], 0, names=["a", "b", "a"]).axes[0]
    first, *_, other, again = (line.get_color() for line in axis.lines
                               if line.get_linestyle() != "None")
    assert first == again != other
    assert [text.get_text() for text in axis.get_legend().get_texts()][:3] == [
        "a", "b", "stable"]


# Colours as people without red or green cones see them: matrices for linear RGB of G. M.
# Machado, M. M. Oliveira and L. A. F. Fernandes (2009), doi 10.1109/TVCG.2009.113.
SEEN = [np.eye(3),
        np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                  [-0.003882, -0.048116, 1.051998]]),
        np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                  [-0.011820, 0.042940, 0.968881]])]
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]]) / [[0.95047], [1.0], [1.08883]]


def differences(colours):
    """CIE 1976 differences of all pairs as the colour-blind see them, the least of all."""
    rgb = np.array([[int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for colour in colours])
    rgb = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    least = np.inf
    for matrix in SEEN:
        f = np.cbrt(np.clip(rgb @ matrix.T, 0.0, 1.0) @ XYZ.T)
        lab = np.column_stack([116.0 * f[:, 1], 500.0 * (f[:, 0] - f[:, 1]),
                               200.0 * (f[:, 1] - f[:, 2])])
        apart = np.linalg.norm(lab[:, None] - lab[None], axis=2)
        least = min(least, apart[np.triu_indices(len(lab), 1)].min())
    return least


@pytest.mark.parametrize("count", [2, 8, 11, 30])
def test_no_two_branches_have_the_same_colour(count):
    several = [Branch("p", (point(0.0, k, True), point(1.0, k + 0.5, True),
                            point(2.0, k + 0.7, False))) for k in range(count)]
    axis = plot_branches(several, 0).axes[0]
    colours = [line.get_color() for line in axis.lines]
    # The stable and the unstable part of a branch are of one colour and two styles.
    assert colours[::2] == colours[1::2]
    assert [line.is_dashed() for line in axis.lines] == [False, True] * count
    assert len(set(colours)) == count
    assert differences(colours[::2]) > (14.0 if count < 12 else 0.0)
    entries = [text.get_text() for text in axis.get_legend().get_texts()]
    assert entries[:count] == [f"branch {k + 1}" for k in range(count)]
    shown = axis.get_legend().get_lines()[:count]
    assert [line.get_color() for line in shown] == colours[::2]


def test_letters_are_left_out_where_there_is_no_room():
    crowd = tuple(point(1.0 + 1e-4 * k, 2.0 + 1e-4 * k, True, "fold") for k in range(9))
    far = (point(0.0, 0.0, True), *crowd, point(3.0, 3.0, True, "fold"))
    axis = plot_branches([Branch("p", far)], 0).axes[0]
    assert len([line for line in axis.lines if line.get_marker() == "s"]) == 10
    letters = [text.get_text() for text in axis.texts]
    assert "F10" in letters
    assert 2 <= len(letters) <= 7


def boxes_of_letters(figure):
    axis = figure.axes[0]
    figure.draw_without_rendering()
    return [text.get_window_extent() for text in axis.texts], axis


def test_letters_keep_clear_of_curves_axes_and_each_other():
    """Folds on a curve that turns at them, and at the ends of the axes."""
    angle = np.linspace(0.0, 4.0 * np.pi, 161)
    wave = tuple(point(p, np.sin(p), True, "fold" if k % 20 == 0 else None)
                 for k, p in enumerate(angle))
    figure = plot_branches([Branch("p", wave)], 0)
    boxes, axis = boxes_of_letters(figure)
    assert len(boxes) == 9
    inside = axis.get_window_extent()
    dense = np.linspace(0.0, 4.0 * np.pi, 4001)
    curve = axis.transData.transform(np.column_stack([dense, np.sin(dense)]))
    for number, box in enumerate(boxes):
        assert not box.count_contains(curve)
        assert inside.x0 <= box.x0 < box.x1 <= inside.x1
        assert inside.y0 <= box.y0 < box.y1 <= inside.y1
        assert not box.count_overlaps(boxes[:number])


def test_ticks_of_both_axes_are_in_suitable_units():
    axis = plot_branches([BRANCH], lambda at: 1e-4 * at.parameter, y_label="amplitude [m]").axes[0]
    assert axis.get_ylabel() == "amplitude [µm]"
    axis.figure.draw_without_rendering()
    places = dict(zip(axis.get_yticks(), (text.get_text() for text in axis.get_yticklabels()),
                      strict=True))
    assert {round(1e6 * place): text for place, text in places.items()}[100] == "100"
    assert axis.yaxis.get_offset_text().get_text() == ""


def test_flutter_shows_frequencies_that_meet(tmp_path):
    field = contact_field(mode_coupling(0.1), ["friction.friction_coefficient"])
    branch = equilibrium_branch(field, parameter="friction.friction_coefficient", bounds=(0.0, 1.0))
    upper, lower = plot_eigenvalues(branch, path=tmp_path / "modes.png").axes
    modes = [line for line in upper.lines if len(line.get_xdata()) == len(branch)]
    mu = branch.parameter
    expected = np.emath.sqrt(1.0 - 4.0 * mu / 3.0)
    w = [np.sqrt(2.0 + sign * expected - 0.0025) for sign in (-1.0, 1.0)]
    before = mu < 0.7
    for line, exact in zip(sorted(modes, key=lambda line: line.get_ydata()[0]), w, strict=True):
        assert line.get_ydata()[before] == pytest.approx(exact.real[before] / (2.0 * np.pi),
                                                         rel=1e-6)
    growth = [line.get_ydata() for line in lower.lines if len(line.get_xdata()) == len(branch)]
    assert np.max(growth[0][-1:] + growth[1][-1:]) == pytest.approx(-0.1, rel=1e-6)
    assert [text.get_text() for text in upper.texts] == ["0.2251 Hz"]
    assert (tmp_path / "modes.png").stat().st_size > 10_000


def test_map_and_files(tmp_path):
    found = stability_map(two_mass_field(), {"B": np.linspace(0.5, 9.0, 12),
                                             "ground.speed": np.linspace(0.8, 2.0, 10)})
    axis = plot_stability_map(found, path=tmp_path / "map.pdf").axes[0]
    shown = np.ma.asarray(axis.collections[0].get_array()).reshape(10, 12)
    assert (shown.mask == (found.unstable == 0).T).all()
    assert shown.compressed() == pytest.approx(found.frequency_hz.T[~shown.mask])
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("B", "ground speed [m/s]")
    plot_branches(BRANCH, "size", path=tmp_path / "branch.svg")
    assert {path.name for path in tmp_path.iterdir()} == {"map.pdf", "branch.svg"}
    with pytest.raises(InputError, match="must end in"):
        plot_branches(BRANCH, path=tmp_path / "branch.gif")
