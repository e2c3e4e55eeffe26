"""Pages of frequency responses and nonlinear modes: their numbers, and a click shows a motion."""

import csv

import numpy as np
import pytest
from report_reading import Shown
from response_study import STUDY, study

from fecontact import InputError
from fecontact.bifurcation import HarmonicBalance, contact_field, nonlinear_mode
from fecontact.bifurcation.responses import follow_responses
from fecontact.cli.response_results import response_csv, response_table
from fecontact.io import report_modes, report_response
from fecontact.plot import plot_response

MICRO = 1e-6


@pytest.fixture(scope="module")
def system():
    return study().system()


@pytest.fixture(scope="module")
def response(system):
    return follow_responses(system, study().response).response


@pytest.fixture(scope="module")
def path(response, system, tmp_path_factory):
    return report_response(response, system, tmp_path_factory.mktemp("response") / "block.html",
                           study=STUDY)


@pytest.fixture(scope="module")
def mode(system):
    return nonlinear_mode(system, (5e-5, 1e-3), method=HarmonicBalance(3, 128))


@pytest.fixture(scope="module")
def mode_path(mode, system, tmp_path_factory):
    return report_modes(mode, system, tmp_path_factory.mktemp("mode") / "mode.html")


def test_diagrams_are_amplitude_and_phase_of_all_levels(response, path):
    shown = Shown(path)
    assert [table["name"] for table in shown.header["branches"]] == [
        "drive amplitude x 20 µm", "drive amplitude x 300 µm"]
    assert [(one["title"], one["unit"]) for one in shown.header["diagrams"]] == [
        ("amplitude of B x", "µm"), ("phase", "°")]
    assert shown.header["diagrams"][1]["xLabel"] == "drive frequency [Hz]"
    for level, branch in enumerate(response.branches):
        true = (response.amplitude(level) / MICRO, np.degrees(response.phase(level)))
        for which, curve in enumerate(true):
            x, y = (shown.array("diagrams", which, "lines", level, name) for name in "xy")
            np.testing.assert_allclose(x, branch.parameter, atol=1e-5 * np.ptp(branch.parameter))
            assert np.abs(y - curve).max() < 2e-5 * np.abs(curve).max()


def test_points_beyond_the_basis_are_marked(response, system, tmp_path):
    """In the table, the CSV file, the page and the picture, above 10 Hz of 8 to 13 Hz."""
    rows = list(csv.DictReader(response_csv(response, 10.0).splitlines()))
    assert {row["beyond_basis"] for row in rows} == {"0", "1"}
    assert all((float(row["frequency_hz"]) > 10.0) == (row["beyond_basis"] == "1") for row in rows)
    first, *_, remarks = (list(column.cells)
                                      for column in response_table(response, 10.0).columns)
    assert str(first[0]) == "20 µm"
    assert "beyond 10 Hz, where the basis ends" in " ".join(map(str, remarks))
    assert "beyond" not in " ".join(
        map(str, response_table(response, 14.0).columns[-1].cells))
    shown = Shown(report_response(response, system, tmp_path / "p.html", usable_hz=10.0)).header
    note, hertz = shown["columns"].index("note"), shown["columns"].index("frequency")
    for branch in shown["branches"]:
        for row in branch["rows"]:
            assert (float(row[hertz].split()[0]) > 10.0) == row[note].startswith("beyond 10 Hz")
    for usable, expected in ((10.0, True), (14.0, False)):
        legend = plot_response(response, usable_hz=usable).axes[0].get_legend()
        assert ("beyond the basis" in [one.get_text() for one in legend.get_texts()]) is expected


def test_orbits_are_those_of_the_response(response, system, path):
    shown = Shown(path)
    k, m = shown.header["samples"], system.basis.modes
    q = shown.array("orbits", "coordinates").reshape(-1, k, m)
    moved = MICRO * shown.array("orbits", "displacement").reshape(-1, k)
    row = contact_field(system, ["drive.frequency_hz"]).displacement_row("B", "x")
    for level, table in enumerate(shown.header["branches"]):
        branch = response.branches[level]
        for number, index in enumerate(table["kept"]):
            point, at = branch.points[index], table["first"] + number
            true = point.orbit(samples=k).states
            assert np.abs(moved[at] - true @ row).max() < 1e-4 * np.abs(moved).max()
            assert np.abs(q[at] - true[:, :m]).max() < 1e-4 * np.abs(q).max()
            assert table["rows"][number][3] == f"{1.0 / point.values['period']:.6g} Hz"
            size = float(table["rows"][number][6].split()[0])
            assert size == pytest.approx(point.values["observed_amplitude"] / MICRO, rel=1e-4)


def test_motions_of_a_mode_are_magnified_to_the_same_size(mode, system, mode_path):
    shown = Shown(mode_path)
    table, = shown.header["branches"]
    x, frequency = (shown.array("diagrams", 0, "lines", 0, name) for name in "xy")
    assert 10.0**x * 1e-3 == pytest.approx(mode.amplitude, rel=1e-4)
    assert frequency == pytest.approx(mode.frequency_hz, rel=2e-5)
    assert shown.array("diagrams", 1, "lines", 0, "y") == pytest.approx(
        mode.damping_ratio, abs=2e-5 * mode.damping_ratio.max())
    assert [one["log"] for one in shown.header["diagrams"]] == ["x", "x"]
    extent = np.hypot(0.12, 0.06)
    for number, index in enumerate(table["kept"]):
        drawn = shown.header["orbits"]["scales"][number] * mode.amplitude[index]
        assert 0.03 * extent < drawn < 0.3 * extent
        ratio = float(table["rows"][number][3])
        assert ratio == pytest.approx(mode.damping_ratio[index], rel=1e-4)


@pytest.mark.slow
def test_a_click_shows_orbit_or_motion(response, mode, path, mode_path):
    import browsing

    with browsing.sync_api.sync_playwright() as started:
        browser = browsing.launched(started, *browsing.SOFTWARE_WEBGL)
        for page, branches in ((path, response.branches), (mode_path, (mode.branch,))):
            tables = Shown(page).header["branches"]
            with browsing.Opened(browser, page) as opened:
                diagrams = opened.page.locator(".diagram .plot")
                assert diagrams.count() == 2
                chosen = []
                for which in range(2):
                    other = f".diagram:nth-of-type({2 - which}) .plot"
                    still = opened.picture(other)
                    box = diagrams.nth(which).bounding_box()
                    opened.page.mouse.click(box["x"] + (0.4 + 0.3 * which) * box["width"],
                                            box["y"] + 12)
                    index = opened.page.evaluate("+document.documentElement.dataset.orbit")
                    table, = (one for one in tables
                              if 0 <= index - one["first"] < len(one["kept"]))
                    point = branches[tables.index(table)].points[
                        table["kept"][index - table["first"]]]
                    text = opened.page.locator("section", has_text="Point").first.inner_text()
                    assert f"{1.0 / point.values['period']:.6g} Hz" in text
                    assert table["name"] in text
                    # The point is marked in the other diagram too.
                    assert np.abs(opened.picture(other) - still).max() > 30
                    chosen.append(index)
                assert chosen[0] != chosen[1]
                before = opened.picture()
                opened.scrub(0.25)
                assert opened.time == pytest.approx(0.25 * point.values["period"], rel=1e-3)
                assert np.abs(opened.picture() - before).max() > 30
                assert not opened.complaints
                assert opened.asked == [page.as_uri()]
        browser.close()


def test_pages_need_their_own_kinds(response, mode, system, tmp_path):
    with pytest.raises(InputError, match=r"must end in \.html"):
        report_response(response, system, tmp_path / "a.pdf")
    with pytest.raises(InputError, match="at least one mode"):
        report_modes([], system, tmp_path / "a.html")
    with pytest.raises(InputError):
        report_modes(response, system, tmp_path / "a.html")
