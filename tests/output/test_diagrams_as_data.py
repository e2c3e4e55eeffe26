"""One diagram gives a picture and a part of a page with the same numbers."""

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex
from report_reading import stored_array, unpacked

from fecontact.output.diagrams.diagram import Band, Curve, Diagram, Level, Mark
from fecontact.output.diagrams.labels import in_unit
from fecontact.output.diagrams.maps import Map, Scale, borders
from fecontact.output.plots.drawing import colour_bar, draw, legend_entries
from fecontact.output.plots.figure import new_figure
from fecontact.output.report.charts import diagram_table
from fecontact.output.report.payload import Payload

X = np.geomspace(1e-6, 4e-4, 41)
STABLE = np.arange(40) < 25
DIAGRAM = Diagram(
    "amplitude [m]", "force [N]",
    (Curve("one", "#0072b2", X, 3e4 * X**0.5, 1.8, stable=STABLE),
     Curve("two", "", X, 5e4 * X, 0.0, 3.0)),
    marks=(Mark("fold", float(X[25]), float(3e4 * X[25] ** 0.5), "F"),),
    bands=(Band("beyond", 1e-4, 4e-4),), levels=(Level(200.0, name="limit", dashed=True),),
    heading="force", logarithmic="x", y_limits=(0.0, None))


def table_of(diagram, **how):
    payload = Payload()
    return unpacked(payload.block({"one": diagram_table(diagram, payload, **how)}))


def test_the_picture_has_the_values_in_si_units():
    with new_figure(5.0, 4.0) as figure:
        axes = figure.subplots()
        draw(axes, DIAGRAM)
        figure.draw_without_rendering()
    solid, dashed, dots, mark, level = axes.lines
    np.testing.assert_array_equal(np.append(solid.get_xdata(), dashed.get_xdata()[1:]), X)
    assert (solid.is_dashed(), dashed.is_dashed()) == (False, True)
    np.testing.assert_array_equal(dots.get_ydata(), 5e4 * X)
    assert (mark.get_xdata()[0], mark.get_marker()) == (X[25], "s")
    assert level.get_ydata()[0] == 200.0
    assert (axes.get_xscale(), axes.get_xlabel(), axes.get_ylabel()) == (
        "log", "amplitude [µm]", "force [N]")
    assert axes.get_ylim()[0] == 0.0
    ticks = dict(zip(axes.get_xticks(), (one.get_text() for one in axes.get_xticklabels()),
                     strict=True))
    assert {f"{place:.0e}": text for place, text in ticks.items()}["1e-05"] == "10"
    assert [one.get_label() for one in legend_entries([DIAGRAM])] == [
        "force", "one", "two", "stable", "unstable", "fold (F)", "beyond"]


def test_a_range_about_a_loop_is_shaded_where_it_goes_and_where_it_returns():
    x = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    loop = Curve("loop", "#0072b2", x, x**2, limits=(x**2 - 0.5, x**2 + 1.0), limits_name="95 %")
    with new_figure(4.0, 3.0) as figure:
        axes = figure.subplots()
        draw(axes, Diagram("u [m]", "F [N]", (loop,)))
    for shaded in axes.collections:
        inside = shaded.get_paths()[0].contains_points([[1.5, 2.5], [1.5, 4.0], [0.5, -0.3]])
        assert inside.tolist() == [True, False, False]
    assert [text.get_text() for text in axes.legend().get_texts()] == ["95 %", "loop"]


def test_bars_limits_and_levels_are_on_the_page_too():
    y = 3e4 * X**0.5
    one = Curve("one", "", X, y, 0.0, 3.0, bars=0.1 * y, limits=(0.5 * y, 2.0 * y))
    header, contents = table_of(Diagram("u [m]", "F [N]", (one,), levels=(Level(1e-5, "x"),),
                                        logarithmic="xy"))
    table = header["one"]
    line, = table["lines"]
    for name, factors in (("bars", (0.9, 1.1)), ("limits", (0.5, 2.0))):
        for end, factor in zip(line[name], factors, strict=True):
            assert 10.0 ** stored_array(end, contents) == pytest.approx(factor * y, rel=1e-4)
    (axis, value), = table["levels"]
    assert (axis, 1e-6 * 10.0**value) == ("x", pytest.approx(1e-5))
    assert (line["width"], line["marker"]) == (0.0, 3.0)


def test_the_page_has_the_same_values_in_its_units():
    header, contents = table_of(DIAGRAM)
    table = header["one"]
    assert (table["title"], table["unit"], table["xLabel"], table["log"]) == (
        "force", "N", "amplitude [µm]", "x")
    for line, curve in zip(table["lines"], DIAGRAM.curves, strict=True):
        x, y = (stored_array(line[name], contents) for name in "xy")
        assert 1e-6 * 10.0**x == pytest.approx(curve.x, rel=1e-5)
        assert table["factor"] * y == pytest.approx(curve.y, abs=1e-5 * curve.y.max())
    assert [line["name"] for line in table["lines"]] == ["force one", "force two"]
    assert (stored_array(table["lines"][0]["solid"], contents) == STABLE).all()
    (x, y, letters), = table["marks"]
    assert (1e-6 * 10.0**x, y, letters) == (
        pytest.approx(X[25]), pytest.approx(3e4 * X[25] ** 0.5), "F")
    assert table["limits"] == {"y": [0.0, None]}


def test_curves_over_the_time_of_a_page_have_no_abscissae_of_their_own():
    time = np.linspace(0.0, 1.0, 21)
    header, contents = table_of(Diagram("time [s]", "gap [m]", (
        Curve("a", "", time, 1e-5 * time),), x_limits=(0.0, 1.0)), over_time=True)
    line, = header["one"]["lines"]
    assert "x" not in line
    assert header["one"]["limits"] == {}
    assert header["one"]["factor"] * stored_array(line["y"], contents) == pytest.approx(
        1e-5 * time, abs=1e-9)


def test_round_off_about_a_constant_is_not_magnified():
    values = 14.0 + 1e-12 * np.sin(np.arange(30.0))
    flat = Diagram("time [s]", "force [N]", (Curve("", "", np.arange(30.0), values),))
    assert flat.flat_range == pytest.approx((13.3, 14.7))
    bent = Diagram("time [s]", "force [N]", (Curve("", "", np.arange(30.0), 1e6 * values),
                                             Curve("", "", np.arange(30.0), 0.0 * values)))
    assert bent.flat_range is None


@pytest.mark.parametrize(("label", "largest", "expected"), [
    ("speed [m/s]", 4e-3, (1e-3, "speed [mm/s]")), ("moment [N m]", 2e-3, (1e-3, "moment [mN m]")),
    ("frequency [Hz]", 2e4, (1.0, "frequency [Hz]")), ("decay [s/m]", 3e4, (1.0, "decay [s/m]")),
    ("ratio", 5.0, (1.0, "ratio")), ("gap [m]", np.nan, (1.0, "gap [m]"))])
def test_units_suit_the_values(label, largest, expected):
    assert in_unit(label, np.array([0.0, largest])) == expected


def test_dashed_lines_say_nothing_of_stability():
    curves = Curve("whole", "#0072b2", X, X), Curve("thin", "", X, X, dashed=True)
    diagram = Diagram("x", "y", curves)
    with new_figure(5.0, 4.0) as figure:
        axes = figure.subplots()
        draw(axes, diagram)
        assert [line.is_dashed() for line in axes.lines] == [False, True]
    entries = legend_entries([diagram])
    assert [(one.get_label(), one.is_dashed()) for one in entries] == [
        ("whole", False), ("thin", True)]
    header, contents = table_of(diagram)
    whole, thin = header["one"]["lines"]
    assert "solid" not in whole
    assert not stored_array(thin["solid"], contents).any()


def test_borders_lie_half_way_between_points():
    assert borders(np.array([1.0, 2.0, 4.0])).tolist() == [0.5, 1.5, 3.0, 5.0]
    assert borders(np.array([1.0, 100.0]), logarithmic=True) == pytest.approx([0.1, 10.0, 1000.0])
    assert borders(np.array([4.0])).tolist() == [2.0, 6.0]


@pytest.mark.parametrize("logarithmic", [False, True])
def test_maps_have_their_colours_blanks_and_a_bar_in_a_suitable_unit(logarithmic):
    values = np.array([[1e3, 2e4, np.nan], [5e4, 7e3, 1e5]])
    one = Map(np.array([0.0, 1e-3, 2e-3, 4e-3]), np.array([0.0, 1.0, 3.0]), values,
              Scale("pressure [Pa]", "inferno", logarithmic=logarithmic), "#123456")
    diagram = Diagram("gap [m]", "speed [m/s]", maps=(one,), y_limits=(0.0, 3.0))
    with new_figure(6.0, 4.0) as figure:
        axes = figure.subplots()
        (image,) = draw(axes, diagram)
        colour_bar(image, one, axes)
        figure.draw_without_rendering()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("gap [mm]", "speed [m/s]")
    assert axes.get_xlim() == (0.0, 4e-3)
    (bar,) = [other for other in figure.axes if other is not axes]
    assert bar.get_ylabel() == "pressure [kPa]"
    shown = {text.get_text() for text in bar.get_yticklabels()}
    assert {"20", "40", "100"} <= shown if not logarithmic else {"1", "10", "100"} <= shown
    # Colours of cells are those of the part of the range that their values take, by hand.
    part = [(np.log(v) - np.log(1e3)) / np.log(100.0) if logarithmic else (v - 1e3) / 99e3
            for v in values.ravel()]
    faces = image.to_rgba(image.get_array()).reshape(6, 4)
    for colour, at in zip(faces, part, strict=True):
        if np.isfinite(at):
            assert colour[:3] == pytest.approx(colormaps["inferno"](at)[:3], abs=0.01)
        else:
            assert colour[3] == 0.0
    assert to_hex(axes.get_facecolor()) == "#123456"


def test_maps_of_names_have_one_colour_each():
    one = Map(np.arange(4.0), np.arange(2.0), np.array([[0.0, 1.0, np.nan]]), Scale(
        "state", ("#ff0000", "#00ff00"), ("open", "stick")))
    with new_figure(6.0, 4.0) as figure:
        axes = figure.subplots()
        (image,) = draw(axes, Diagram("x", "y", maps=(one,)))
        colour_bar(image, one, axes)
    assert [to_hex(colour) for colour in image.to_rgba(image.get_array())[0, :2]] == [
        "#ff0000", "#00ff00"]
    assert [text.get_text() for text in figure.axes[1].get_yticklabels()] == ["open", "stick"]


@pytest.mark.parametrize("logarithmic", [False, True])
def test_a_page_has_the_colours_of_a_picture(logarithmic):
    values = np.array([[1e3, 2e4, np.nan], [5e4, 7e3, 1e5]])
    one = Map(np.array([0.0, 1e-3, 2e-3, 4e-3]), np.array([0.0, 1.0, 3.0]), values,
              Scale("pressure [Pa]", "inferno", logarithmic=logarithmic))
    diagram = Diagram("gap [m]", "speed [m/s]", maps=(one,))
    header, contents = table_of(diagram)
    (shown,) = header["one"]["maps"]
    assert stored_array(shown["x"], contents) == pytest.approx([0.0, 1.0, 2.0, 4.0], abs=1e-5)
    assert stored_array(shown["y"], contents) == pytest.approx([0.0, 1.0, 3.0], abs=1e-5)
    cells, shades = stored_array(shown["cells"], contents).astype(int), np.array(shown["shades"])
    assert (cells == 0).tolist() == [False, False, True, False, False, False]
    with new_figure(4.0, 3.0) as figure:
        (image,) = draw(figure.subplots(), diagram)
    expected = 255.0 * image.to_rgba(image.get_array()).reshape(6, 4)[:, :3]
    known = cells > 0
    assert np.abs(shades[cells[known] - 1] - expected[known]).max() < 6.0
    assert (shown["label"], shown["ends"]) == ("pressure [kPa]", ["1", "100"])


def test_a_page_has_the_names_of_a_map():
    one = Map(np.arange(4.0), np.arange(2.0), np.array([[0.0, 1.0, np.nan]]), Scale(
        "state", ("#ff0000", "#00ff00"), ("open", "stick")))
    header, contents = table_of(Diagram("x", "y", maps=(one,)))
    (shown,) = header["one"]["maps"]
    assert stored_array(shown["cells"], contents).tolist() == [1.0, 2.0, 0.0]
    assert (shown["shades"], shown["names"]) == ([[255, 0, 0], [0, 255, 0]], ["open", "stick"])
