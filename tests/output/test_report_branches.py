"""The page of branches: its orbits are those of the branches, and a click shows them."""

import numpy as np
import pytest
from report_reading import Shown

from fecontact import InputError, Study
from fecontact.bifurcation.diagram import follow_branches
from fecontact.io import report_branches

STUDY = """
geometry = { shape = "block", contact_length = 0.08, element_size = 0.02 }
body = { material = "steel", thickness = 0.1 }
basis = { modes = 3, contact_nodes = 4, B = { at = "B", radius = 0.006 }, C = "top" }
normal = { stiffness = 10e6, roughness_height = 10e-6, damping = 40.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 12e-3 }
drive = { stiffness_x = 5610.0, damping_x = 0.768 }
load = { normal = 14.0 }
branch = { parameter = "ground.speed", bounds = [7e-3, 12e-3], start = 12e-3, switch = ["Hopf"] }
"""


@pytest.fixture(scope="module")
def found():
    study = Study.from_toml(STUDY)
    return follow_branches(study.system(), study.branch)


@pytest.fixture(scope="module")
def path(found, tmp_path_factory):
    return report_branches(found.found, found.contact_field,
                           tmp_path_factory.mktemp("branches") / "block.html",
                           observe=found.observe, study=STUDY)


def test_orbits_are_those_of_the_branches(found, path):
    shown = Shown(path)
    k, m = shown.header["samples"], found.contact_field.system().basis.modes
    q = shown.array("orbits", "coordinates").reshape(-1, k, m)
    periods = shown.array("orbits", "periods")
    moved = shown.array("orbits", "displacement").reshape(-1, k)
    factor = {"mm": 1e-3, "µm": 1e-6}[shown.header["orbits"]["units"][0]]
    row = found.contact_field.displacement_row("B", "x")
    orbits = 0
    for table in shown.header["branches"]:
        branch = found.found[table["name"]]
        for number, index in enumerate(table["kept"]):
            point, at = branch.points[index], table["first"] + number
            if not point.is_orbit:
                true = np.repeat(point.values["state"][None], k, 0)
            else:
                true = point.orbit(found.contact_field, k).states
                assert periods[at] == pytest.approx(point.values["period"], rel=1e-6)
                assert table["rows"][number][3] == f"{1.0 / point.values['period']:.6g} Hz"
                orbits += 1
            largest = np.abs(true @ row).max()
            assert np.abs(factor * moved[at] - true @ row).max() < 2e-4 * largest
            shapes = shown.array("bodies", "shapes")
            motion = np.einsum("pcm,tm->tpc", shapes, q[at] - true[:, :m])
            assert np.abs(motion).max() < 1e-4 * shown.header["bodies"]["largest"]["displacement"]
    assert orbits > 10


def test_the_diagram_is_that_of_the_branches(found, path):
    shown = Shown(path)
    for number, table in enumerate(shown.header["branches"]):
        branch = found.found[table["name"]]
        x, y = (shown.array("diagrams", 0, "lines", number, name) for name in "xy")
        np.testing.assert_allclose(1e-3 * x, branch.parameter,
                                   atol=1e-5 * np.ptp(branch.parameter))
        heights = branch.column("observed_maximum")
        np.testing.assert_allclose(1e-3 * y, heights, rtol=1e-4)
        special = {index for index, point in enumerate(branch.points) if point.kind is not None}
        assert special <= set(table["kept"])
    diagram, = shown.header["diagrams"]
    places = [(1e3 * point.parameter, 1e3 * point.values["observed_maximum"])
              for branch in found.found.values() for point in branch.points if point.kind]
    assert {mark[0] for mark in diagram["marks"]} == {place for place, _ in places}
    for x, y, letters in diagram["marks"]:
        assert any((x, y) == pytest.approx(place) for place in places)
        assert letters
    assert diagram["xLabel"] == "ground speed [mm/s]"
    assert (diagram["title"], diagram["unit"]) == ("largest displacement x of B", "mm")
    # The rigid block has no stress to paint.
    assert shown.header["bodies"]["paints"] == ["displacement", "none"]


@pytest.mark.slow
def test_a_point_that_is_clicked_shows_its_orbit(found, path):
    import browsing

    table = Shown(path).header["branches"][-1]
    branch = found.found[table["name"]]
    assert branch.points[-1].is_orbit
    with browsing.sync_api.sync_playwright() as started:
        browser = browsing.launched(started, *browsing.SOFTWARE_WEBGL)
        with browsing.Opened(browser, path) as opened:
            still = opened.picture(".diagram .plot")
            box = opened.page.locator(".diagram .plot").bounding_box()
            # The last orbit lies at the end of the range, as the highest point of the diagram.
            opened.page.mouse.click(box["x"] + box["width"] - 40, box["y"] + 20)
            index = opened.page.evaluate("+document.documentElement.dataset.orbit")
            place = index - table["first"]
            assert 0 <= place < len(table["kept"])
            point = branch.points[table["kept"][place]]
            assert point.parameter > 0.0115
            text = opened.page.locator("section", has_text="Point").first.inner_text()
            assert f"{1.0 / point.values['period']:.6g} Hz" in text
            assert np.abs(opened.picture(".diagram .plot") - still).max() > 30
            before = opened.picture()
            opened.scrub(0.25)
            assert opened.time == pytest.approx(0.25 * point.values["period"], rel=1e-3)
            assert np.abs(opened.picture() - before).max() > 30
            assert not opened.complaints
            assert opened.asked == [path.as_uri()]
        browser.close()


def test_branches_need_points_and_a_page(found, tmp_path):
    with pytest.raises(InputError, match="at least one point"):
        report_branches({}, found.contact_field, tmp_path / "a.html")
    with pytest.raises(InputError, match=r"must end in \.html"):
        report_branches(found.found, found.contact_field, tmp_path / "a.pdf")
    with pytest.raises(InputError, match="stores no value"):
        report_branches(found.found, found.contact_field, tmp_path / "a.html", y="width")
