"""The page of a run in a browser: it moves, listens, is silent, and shows what the run holds.

Needs Chromium and Playwright; see ``browsing.py``.
"""

import io
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from browsing import NO_WEBGL, SOFTWARE_WEBGL, Opened, launched, sync_api
from joined_bodies import stack_run
from matplotlib import colormaps
from matplotlib.image import imread
from meshes_for_tests import rectangle
from report_reading import Shown
from synthetic import run
from test_report import EVIL, true_fields

from fecontact import ContactSystem, Drive, ElasticBody, Material, fit, modal_basis, simulate
from fecontact.fitting import FunctionData
from fecontact.io import report, report_fit, report_frame, report_sweep
from fecontact.reduction import LargeDeflections
from fecontact.sweeps import SweepTable


@pytest.fixture(scope="module")
def playwright():
    with sync_api.sync_playwright() as started:
        yield started


@pytest.fixture(scope="module")
def browser(playwright):
    opened = launched(playwright, *SOFTWARE_WEBGL)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def trajectory():
    return run(times=401)


@pytest.fixture(scope="module")
def path(trajectory, tmp_path_factory):
    return report(trajectory, tmp_path_factory.mktemp("report") / "run.html", points=["B"],
                  scale=100.0)


def test_it_draws_and_asks_for_nothing(browser, path):
    with Opened(browser, path) as opened:
        pictures = []
        for part in (0.1, 0.45, 0.8):
            opened.scrub(part)
            pictures.append(opened.picture())
        for picture in pictures:
            assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
        for one, other in pairwise(pictures):
            assert (np.abs(one - other).max(axis=2) > 30).mean() > 0.01
        assert opened.asked == [path.as_uri()]
        assert not opened.complaints


def test_what_is_computed_is_that_of_the_run(browser, path, trajectory):
    """Reader and evaluation of the browser, against the sum of the modes."""
    motion, stress = true_fields(trajectory)
    nodes = trajectory.system.basis.mode_shapes.nodes
    with Opened(browser, path) as opened:
        for part in (0.0, 0.31, 0.77, 1.0):
            opened.scrub(part)
            index = opened.of_player("player.clock.index")
            # Half of the last place of a slider.
            assert abs(opened.time - part * trajectory.time[-1]) < 1e-6
            opened.page.evaluate("time => document.querySelector('.stage').player.clock.set(time)",
                                 float(trajectory.time[index]))
            places = np.reshape(list(opened.of_player("Array.from(player.places)")), (-1, 3))
            shown = (places[:, :2] - nodes) / 100.0
            assert np.abs(shown - motion[index]).max() < 1e-4 * np.abs(motion).max()
            assert not places[:, 2].any()
            values = np.array(opened.of_player("Array.from(player.values)"))
            assert np.abs(values - stress[index]).max() < 1e-4 * stress.max()


def test_stress_of_large_deflections_is_that_of_the_run(browser, tmp_path):
    """Products of coordinates stand behind those of the modes, which alone move the body."""
    body = ElasticBody(rectangle(1.0, 0.004, 10, 1), Material(2e11, 0.3, 7800.0),
                       fixed={"left": "xy", "right": "xy"})
    basis = modal_basis(body, 1, contact=(), large_deflections=LargeDeflections(0.004))
    start = np.zeros(2 * basis.modes)
    start[0] = 0.9 * basis.large_deflections[0].ranges[0, 1]
    moving = simulate(ContactSystem(basis), 1e-3, initial=start, outputs=11)
    path = report(moving, tmp_path / "run.html", scale=1.0)
    with Opened(browser, path) as opened:
        for index in (0, 7):
            opened.page.evaluate("time => document.querySelector('.stage').player.clock.set(time)",
                                 float(moving.time[index]))
            fields = basis.fields(moving.modal_coordinates[index])
            places = np.reshape(list(opened.of_player("Array.from(player.places)")), (-1, 3))
            assert np.abs(places[:, :2] - fields.nodes - fields.displacement).max() < 1e-6
            values = np.array(opened.of_player("Array.from(player.values)"))
            assert np.abs(values - fields.von_mises).max() < 2e-4 * fields.von_mises.max()
        assert not opened.complaints


def test_painted_colours_are_those_of_the_stresses(browser, path, trajectory):
    _, stress = true_fields(trajectory)
    shown = Shown(path)
    limit = shown.header["bodies"]["largest"]["stress"]
    nodes = trajectory.system.basis.mode_shapes.nodes
    inner = np.flatnonzero((nodes[:, 1] > 0.004) & (nodes[:, 1] < 0.016)
                           & (nodes[:, 0] > 0.03) & (nodes[:, 0] < 0.17))[::7]
    with Opened(browser, path) as opened:
        opened.page.get_by_label("forces").uncheck()
        seen = set()
        for index in (57, 190, 333):
            opened.page.evaluate("time => document.querySelector('.stage').player.clock.set(time)",
                                 float(trajectory.time[index]))
            places = np.array(opened.of_player(
                f"{inner.tolist()}.map(p => player.project(...player.places.subarray(3*p, 3*p+3)))"
            ))
            picture = opened.picture()
            columns, rows = np.floor(places.T).astype(int)
            parts = np.clip(stress[index, inner] / limit, 0.0, 1.0)
            wanted = 255.0 * colormaps["cividis"](parts)[:, :3]
            assert np.abs(picture[rows, columns] - wanted).max() < 14.0
            seen |= set(np.round(5 * parts))
        assert len(seen) >= 3  # of the colour bar


def test_contact_nodes_have_the_colours_of_their_states(browser, path, trajectory):
    colours = {1: (0x00, 0x72, 0xb2), 2: (0xe6, 0x9f, 0x00)}
    with Opened(browser, path) as opened:
        opened.page.get_by_label("forces").uncheck()
        met = set()
        for index in range(5, 400, 23):
            opened.page.evaluate("time => document.querySelector('.stage').player.clock.set(time)",
                                 float(trajectory.time[index]))
            picture = opened.picture()
            for node in range(5):
                state = int(trajectory.contact_state[index, node])
                if state not in colours:
                    continue
                place = (np.array([0.02 + 0.04 * node, 0.0])
                         + 100.0 * trajectory.displacement(node)[index, :2])
                x, y = opened.of_player(f"player.project({place[0]}, {place[1]})")
                around = picture[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].reshape(-1, 3)
                assert np.abs(around - colours[state]).max(axis=1).min() < 10.0
                met.add(state)
        assert met == {1, 2}


def test_contacts_shorter_than_a_pixel_are_on_the_map(browser, tmp_path):
    """Ten contacts of one output each among 4001."""
    whole = run(times=4001)
    q = np.zeros_like(whole.modal_coordinates)
    q[:, 1] = 3e-5
    q[200::400, 1] = -4e-5
    path = report(replace(whole, modal_coordinates=q, modal_velocities=0.0 * q),
                  tmp_path / "short.html")
    with Opened(browser, path) as opened:
        opened.page.wait_for_selector("html[data-whole]", state="attached")
        picture = opened.picture(".map .plot")
    coloured = np.ptp(picture[len(picture) // 3], axis=1) > 60.0
    # The cursor stands at the first instant.
    assert np.count_nonzero(np.diff(coloured.astype(int)) > 0) == 11


def test_clicks_on_charts_move_the_time(browser, path, trajectory):
    with Opened(browser, path) as opened:
        for selector, width in ((".chart .plot", 0.25), (".map .plot", 0.75)):
            box = opened.page.locator(selector).first.bounding_box()
            left, right = 52.0, box["width"] - 10.0
            opened.page.mouse.click(box["x"] + left + width * (right - left),
                                    box["y"] + 0.5 * box["height"])
            assert opened.time == pytest.approx(width * trajectory.time[-1], rel=0.01)
        # In the phase plane the nearest point of the orbit is meant.
        before = opened.picture()
        plane = opened.page.locator(".phase .plot").first
        plane.scroll_into_view_if_needed()
        box = plane.bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 8.0
        opened.page.mouse.click(x, y)
        assert np.abs(trajectory.time - opened.time).min() < 1e-12
        speeds = trajectory.velocity("B")[:, 0]
        nearest = int(np.argmin(np.abs(trajectory.time - opened.time)))
        assert speeds[nearest] > 0.8 * speeds.max()
        assert np.abs(opened.picture() - before).max() > 30


def test_it_plays_at_a_readable_pace(browser, path):
    with Opened(browser, path) as opened:
        opened.page.get_by_role("button", name="play").click()
        opened.page.wait_for_timeout(1500)
        first = opened.time
        opened.page.wait_for_timeout(700)
        assert opened.time != first
        cost = float(opened.page.evaluate("document.documentElement.dataset.frame"))
        print(f"a frame takes {cost} ms")
        assert cost < 50.0
        opened.page.keyboard.press("Tab")
        opened.page.get_by_role("button", name="pause").click()
        still = opened.time
        opened.page.wait_for_timeout(200)
        assert opened.time == still


def test_a_part_of_the_time_can_be_seen_closer(browser, path, trajectory):
    with Opened(browser, path) as opened:
        opened.scrub(0.5)
        chart = opened.picture(".chart .plot")
        for _ in range(2):
            opened.page.get_by_role("button", name="+").click()
        end = trajectory.time[-1]
        assert opened.of_player("player.clock.range") == pytest.approx([0.375 * end, 0.625 * end])
        assert np.abs(opened.picture(".chart .plot") - chart).max() > 30
        opened.scrub(0.0)
        assert opened.time == pytest.approx(0.375 * end)
        for _ in range(3):
            opened.page.get_by_role("button", name="−").click()
        assert opened.of_player("player.clock.range") == pytest.approx([0.0, end])


def test_a_mode_shakes_in_its_shape(browser, path, trajectory):
    field = trajectory.system.basis.mode_shapes
    with Opened(browser, path) as opened:
        opened.page.get_by_role("button", name="shake").nth(3).click()
        opened.page.wait_for_timeout(400)
        opened.page.get_by_role("button", name="pause").click()
        assert opened.of_player("player.mode") == 3
        places = np.reshape(opened.of_player("Array.from(player.places)"), (-1, 3))[:, :2]
        moved, shape = (places - field.nodes).ravel(), field.shapes[:, :, 3].ravel()
        assert np.abs(moved).max() > 0.0
        likeness = moved @ shape / np.linalg.norm(moved) / np.linalg.norm(shape)
        assert abs(likeness) > 1.0 - 1e-6
        opened.page.get_by_role("button", name="stop").click()
        assert opened.of_player("player.mode") == -1


def test_zoom_and_drag_move_the_view(browser, path):
    with Opened(browser, path) as opened:
        stage = opened.page.locator(".stage").bounding_box()
        opened.page.mouse.move(stage["x"] + 200, stage["y"] + 100)
        world = opened.of_player("[200 - player.project(0.1, 0.01)[0], player.size]")
        opened.page.mouse.wheel(0, -400)
        opened.page.wait_for_timeout(100)
        closer = opened.of_player("[200 - player.project(0.1, 0.01)[0], player.size]")
        ratio = closer[1] / world[1]
        assert ratio > 1.5
        # The point under the pointer stays there.
        assert closer[0] == pytest.approx(ratio * world[0], rel=1e-6)
        opened.page.mouse.down()
        opened.page.mouse.move(stage["x"] + 230, stage["y"] + 110)
        opened.page.mouse.up()
        moved = opened.of_player("200 - player.project(0.1, 0.01)[0]")
        assert closer[0] - moved == pytest.approx(30.0, abs=0.5)


def test_texts_of_a_study_do_nothing(browser, tmp_path):
    path = report(stack_run(), tmp_path / "evil.html", title=EVIL,
                  study=f"[a]\nb = '''{EVIL}'''\n", versions={EVIL: "1"})
    with Opened(browser, path) as opened:
        assert opened.page.locator("h1").inner_text() == EVIL
        assert opened.page.title() == " ".join(EVIL.split())
        assert opened.page.locator("img").count() == 0
        assert not opened.dialogs
        assert not opened.complaints


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_in_light_and_dark_and_fits_a_phone(browser, path, scheme):
    with Opened(browser, path, color_scheme=scheme) as opened:
        colours = opened.page.evaluate(
            "[getComputedStyle(document.body).color, getComputedStyle(document.body)"
            ".backgroundColor].map(text => text.match(/\\d+/g).map(Number))")
        bright = [np.dot((np.array(one[:3]) / 255.0) ** 2.2, [0.2126, 0.7152, 0.0722])
                  for one in colours]
        assert (bright[0] < bright[1]) == (scheme == "light")
        assert (max(bright) + 0.05) / (min(bright) + 0.05) > 7.0
        opened.page.set_viewport_size({"width": 390, "height": 844})
        opened.page.wait_for_timeout(200)
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= 390


def test_without_webgl_there_is_a_message_and_the_rest(playwright, path, trajectory):
    browser = launched(playwright, *NO_WEBGL)
    try:
        with Opened(browser, path) as opened:
            assert "no WebGL 2" in opened.page.locator(".missing").inner_text()
            opened.scrub(0.5)
            assert opened.time == pytest.approx(0.5 * trajectory.time[-1])
            assert opened.page.locator(".chart").count() >= 4
    finally:
        browser.close()


def test_a_cell_of_a_sweep_shows_its_case(browser, tmp_path):
    speeds, loads = [1e-3, 2e-3, 4e-3, 5e-3], [5.0, 10.0, 15.0]
    pairs = [(speed, load) for speed in speeds for load in loads]
    values = np.arange(12.0)
    values[4] = np.nan
    table = SweepTable({"ground.speed": tuple(speed for speed, _ in pairs),
                        "load.normal": tuple(load for _, load in pairs)},
                       {"stick_fraction": values}, [str(k) for k in range(12)], [""] * 12,
                       shape=(4, 3))
    path = report_sweep(table, tmp_path / "sweep.html")
    with Opened(browser, path) as opened:
        box = opened.page.locator(".plot").bounding_box()
        # Cells stand for as much of the axes as lies between them.
        left, right, top, bottom = 52.0, box["width"] - 10.0, 6.0, box["height"] - 22.0
        half_x, half_y = 0.5 * 4e-3 / 3.0, 0.5 * 10.0 / 2.0
        picture = opened.picture(".plot")
        colours = 255.0 * colormaps["viridis"](np.linspace(0.0, 1.0, 64))[:, :3]
        for case, (speed, load) in enumerate(pairs):
            x = left + (right - left) * (speed - 1e-3 + half_x) / (4e-3 + 2.0 * half_x)
            y = bottom - (bottom - top) * (load - 5.0 + half_y) / (10.0 + 2.0 * half_y)
            opened.page.mouse.click(box["x"] + x + 4, box["y"] + y - 3)
            assert opened.page.evaluate("+document.documentElement.dataset.case") == case
            if case not in (0, 4):
                wanted = colours[round(63 * values[case] / 11.0)]
                assert np.abs(picture[int(y) - 12, int(x) - 12] - wanted).max() < 3.0
        text = opened.page.locator("section", has_text="Case").nth(1).inner_text()
        assert "0.005" in text
        assert not opened.complaints
        assert opened.asked == [path.as_uri()]


def test_a_point_of_a_fit_is_read(browser, tmp_path):
    places = np.linspace(0.0, 1.0, 5)
    data = FunctionData(along, 1e4 * places + 30.0, 40.0, places, ("place [m]", "force [N]"))
    held = run().system.with_(drive=Drive(stiffness_x=1e4))
    found = fit(held, {"drive.stiffness_x": (1e3, 1e5)}, data)
    path = report_fit(found, tmp_path / "fit.html", title=EVIL)
    with Opened(browser, path) as opened:
        box = opened.page.locator(".plot").first.bounding_box()
        # Abscissae begin and end 6 % of their range beside the ends of the axis.
        x = 52.0 + (box["width"] - 62.0) * (0.06 + 0.75) / 1.12
        opened.page.mouse.click(box["x"] + x, box["y"] + 0.3 * box["height"])
        assert opened.page.evaluate("+document.documentElement.dataset.point") == 3
        text = opened.page.locator("section", has_text="Point").first.inner_text()
        shown = dict(line.split("\t") for line in text.splitlines() if "\t" in line)
        assert float(shown["measured"]) == pytest.approx(7.53, abs=1e-3)
        assert float(shown["fitted"]) == pytest.approx(found.predicted[3] / 1e3, rel=1e-4)
        assert float(shown["residual / deviation"]) == pytest.approx(found.residuals[3], abs=1e-4)
        assert opened.page.locator("h1").inner_text() == EVIL
        # Dots, the line and its band: more colours than text and grid have.
        assert len(np.unique(opened.picture(".plot").reshape(-1, 3), axis=0)) > 50
        assert not opened.complaints
        assert opened.asked == [path.as_uri()]


def along(system):
    return system.drive.stiffness_x * np.linspace(0.0, 1.0, 5)


def test_a_notebook_shows_it_in_a_frame_of_its_own(browser, trajectory, tmp_path):
    frame = report_frame(trajectory, height=700, title=EVIL, scale=100.0)
    cell = tmp_path / "cell.html"
    cell.write_text(f"<!doctype html><title>cell</title><body>{frame._repr_html_()}</body>",
                    encoding="utf-8")
    context = browser.new_context(viewport={"width": 1300, "height": 900})
    opened, asked, complaints = context.new_page(), [], []
    opened.on("request", lambda request: asked.append(request.url))
    opened.on("console", lambda message: complaints.append(message.text))
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.goto(cell.as_uri())
    inner = opened.frame_locator("iframe")
    inner.locator("canvas").first.wait_for(timeout=30_000)
    assert inner.locator("h1").inner_text() == EVIL
    assert inner.locator("figure").count() >= 5
    assert opened.locator("iframe").bounding_box()["height"] == pytest.approx(700, abs=2)
    opened.wait_for_timeout(300)
    picture = imread(io.BytesIO(inner.locator(".stage").screenshot()))
    assert len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > 50
    assert opened.title() == "cell"
    assert [url for url in asked if url != "about:srcdoc"] == [cell.as_uri()]
    assert not complaints
    context.close()
