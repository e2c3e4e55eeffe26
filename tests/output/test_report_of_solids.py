"""The page of a run of solids: what it holds is the run, contact faces have its pressures.

Needs Chromium and Playwright; see ``browsing.py``.
"""

import numpy as np
import pytest
from browsing import SOFTWARE_WEBGL, Opened, launched, sync_api
from matplotlib import colormaps
from report_reading import Shown
from systems import TURN

import fecontact as fc
from fecontact.cli.templates import template
from fecontact.io import report

SCALE = 5.0
PAIR = """
[bodies.disc]
geometry = { shape = "ring", outer_radius = 0.06, inner_radius = 0.02, thickness = 0.01 }
body = { fixed = { contact = "xyz" } }
basis = { modes = 3 }
[bodies.pad]
geometry = { shape = "solid-block", length = 0.02, width = 0.02, height = 0.01 }
placement = { shift = [0.03, -0.01, 0.01] }
basis = { modes = 8, C = "top" }
[interfaces.lining]
face = "pad.contact"
other = "disc.top"
nodes = [2, 2]
normal = { law = "linear", stiffness = 2e7, damping = 200.0 }
friction = { law = "constant", friction_coefficient = 0.4, smoothing_slope = 100.0 }
sliding = { speed = 3.0, centre = [0.0, 0.0, 0.0] }
[links.stay]
kind = "spring"
first = "pad.C"
stiffness = 1e5
direction = [0.0, 1.0, 0.0]
[links.guide]
kind = "spring"
first = "pad.C"
stiffness = 1e5
direction = [1.0, 0.0, 0.0]
[load]
normal = 50.0
[simulation]
t_end = 2e-3
outputs = 21
"""


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as started:
        opened = launched(started, *SOFTWARE_WEBGL)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def trajectory():
    return fc.Study.from_toml(template("solid")).with_(**{
        "simulation.t_end": 0.03, "simulation.outputs": 151}).run()


@pytest.fixture(scope="module")
def path(trajectory, tmp_path_factory):
    return report(trajectory, tmp_path_factory.mktemp("solid") / "pad.html", points=["B"],
                  scale=SCALE)


@pytest.fixture(scope="module")
def pair():
    return fc.Study.from_toml(PAIR).run()


def surface(run, shown):
    """Mesh nodes of the points of a page, which lie on the surface of the bodies."""
    field = run.system.basis.mode_shapes
    points = shown.array("bodies", "points")
    away = np.linalg.norm(field.nodes[None] - points[:, None], axis=2)
    assert away.min(axis=1).max() < 1e-6
    outline = np.unique(field.outline)
    assert away[:, outline].min(axis=0).max() < 1e-6
    return outline[away[:, outline].argmin(axis=1)]


def test_what_is_stored_is_the_run(trajectory, path):
    shown, run = Shown(path), trajectory
    field, q = run.system.basis.mode_shapes, run.modal_coordinates
    nodes = surface(run, shown)
    motion = np.einsum("pcm,tm->tpc", field.shapes[nodes], q)
    size = np.linalg.norm(motion, axis=2).max()
    assert np.linalg.norm(shown.displacement - motion, axis=2).max() < 1e-4 * size
    own = np.concatenate([-run.friction_forces, run.normal_force[..., None]], axis=2)
    assert np.linalg.norm(shown.forces - own, axis=2).max() < 1e-4 * np.linalg.norm(
        own, axis=2).max()
    assert shown.header["contact"]["areas"] == pytest.approx(run.system.basis.tributary)
    charts = {chart["title"]: chart for chart in shown.header["charts"]}
    totals, friction = run.friction_forces.sum(axis=1), "total friction on the body"
    for title, column, expected in (
            (friction, 0, np.hypot(*totals.T)), (friction, 1, -totals[:, 0]),
            (friction, 2, -totals[:, 1]),
            ("displacement y", 0, run.displacement("B")[:, 1]),
            ("velocity z", 0, run.velocity("B")[:, 2])):
        k = list(charts).index(title)
        found = shown.array("charts", k, "lines", column, "y") * charts[title]["factor"]
        assert found == pytest.approx(expected, abs=2e-4 * np.abs(expected).max()), title
    travel, w = shown.array("ground", "travel"), TURN * 47.75
    assert travel[:, 0] == pytest.approx(0.05 * run.time, abs=1e-8)
    assert travel[:, 1] == pytest.approx(0.05 / w * (1.0 - np.cos(w * run.time)), abs=1e-8)
    assert not travel[:, 2].any()


def test_contact_faces_have_the_colours_of_pressure_and_state(browser, trajectory, path):
    """From below, with the light of the page taken off."""
    run, colours = trajectory, {1: (0x00, 0x72, 0xb2), 2: (0xe6, 0x9f, 0x00)}
    places, pressure = run.system.basis.contact_places, run.pressure
    limit = pressure.max()
    with Opened(browser, path) as opened:
        opened.page.wait_for_selector("html[data-whole]", state="attached")
        opened.page.get_by_label("forces").uncheck()
        opened.page.get_by_label("view").select_option("below")
        turn = np.reshape(opened.of_player("player.turn"), (3, 3)).T
        light = 0.5 + 0.5 * abs(turn @ [0.0, 0.0, -1.0] @ [0.2, 0.4, 0.9])
        met, spread = set(), []
        for index in (20, 61, 90, 149):
            opened.of_player(f"player.clock.set(player.clock.times[{index}])")
            moved = np.array([run.displacement(node)[index, :3] for node in range(len(places))])
            # Beside the dot of the node.
            seen = opened.of_player(f"{(places + SCALE * moved + [0.006, 0.006, 0]).tolist()}"
                                    ".map(p => player.project(...p))")
            for paint in ("contact pressure", "contact state"):
                opened.page.get_by_label("colour", exact=True).select_option(paint)
                picture = opened.picture()
                for node, (x, y) in enumerate(seen):
                    state = int(run.contact_state[index, node])
                    expected = np.array(colours[state]) if paint == "contact state" else (
                        255.0 * np.array(colormaps["viridis"](pressure[index, node] / limit)[:3]))
                    found = picture[int(y), int(x)] / light
                    assert np.abs(found - expected).max() < 16.0, (paint, index, node)
                    met.add(state)
            spread.append(np.ptp(pressure[index]) / limit)
        assert met == {1, 2}
        assert max(spread) > 0.1
        # The other sides are plain.
        opened.page.get_by_label("view").select_option("above")
        middle = opened.picture()[200:260, 250:350].reshape(-1, 3)
        assert np.ptp(middle, axis=0).max() < 10.0
        assert not opened.complaints


def test_faces_of_two_solids_are_painted_on_both_sides(browser, pair, tmp_path):
    path = report(pair, tmp_path / "pair.html")
    shown, run = Shown(path), pair
    surface(run, shown)
    owners = shown.array("bodies", "owners").astype(int)
    points = shown.array("bodies", "points")
    # At z = 0.01 lie the pad's bottom and what of the disc's top is below it.
    touching = points[owners >= 0]
    assert touching[:, 2] == pytest.approx(0.01, abs=1e-8)
    assert set(owners) == {-1, 0, 1, 2, 3}
    header = shown.header["contact"]
    assert header["slides"] == ["disc ↺ 3 rad/s"]
    (face,) = header["faces"]
    assert face["title"] == "lining: disc and pad"
    low_x, high_x, low_y, high_y = face["plan"]["box"]
    # The facets of the patches fill the face of 20 mm x 20 mm, not only the middles of its nodes.
    assert (high_x - low_x, high_y - low_y) == pytest.approx((0.02, 0.02), rel=1e-6)
    corners = shown.array("contact", "faces", 0, "plan", "corners")
    corners = corners.reshape(len(corners), -1, 2)
    x, y = corners[..., 0], corners[..., 1]
    areas = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(0.02**2, rel=1e-3)
    owner = shown.array("contact", "faces", 0, "plan", "owner").astype(int)
    assert np.bincount(owner, areas) == pytest.approx(face["sizes"], rel=1e-3)
    titles = [chart["title"] for chart in shown.header["charts"]]
    assert "total friction on the body, +t2" in titles
    with Opened(browser, path) as opened:
        opened.page.wait_for_selector("html[data-whole]", state="attached")
        opened.page.get_by_label("see-through").check()
        opened.page.get_by_label("colour", exact=True).select_option("contact pressure")
        opened.scrub(1.0)
        values = np.array(opened.of_player("Array.from(player.values)"))
        expected = np.where(owners >= 0, run.pressure[-1][owners], 0.0)
        assert values == pytest.approx(expected, abs=2e-4 * run.pressure.max())
        assert len(np.unique(opened.picture().reshape(-1, 3), axis=0)) > 100
        assert not opened.complaints


def test_ground_that_turns_and_waves_across(browser, tmp_path):
    base = fc.Study.from_toml(template("solid")).with_(**{
        "simulation.t_end": 0.01, "simulation.outputs": 21, "ground": {
            "rotation_speed": 20.0, "centre": [0.05, 0.03]}})
    wavy = base.with_(**{"ground": {"speed_y": 0.4, "amplitude": 5e-5, "wavelength": 0.02,
                                    "wave_direction": [1.0, 2.0]}})
    for study in (base, wavy):
        run = study.run()
        path = report(run, tmp_path / "ground.html", scale=20.0)
        shown = Shown(path)
        travel = shown.array("ground", "travel")
        ground = study.ground
        assert travel == pytest.approx(np.outer(
            run.time, [0.0, ground.speed_y, ground.rotation_speed]), abs=1e-7)
        assert shown.header["ground"]["wavy"] == (study is wavy)
        if study is wavy:
            rows = np.reshape(shown.header["ground"]["drift"], (2, -1))
            mean = np.mean([run.displacement(node)[:, :2] for node in range(15)], axis=0)
            assert run.modal_coordinates @ rows.T == pytest.approx(mean, abs=1e-15)
        with Opened(browser, path) as opened:
            opened.page.get_by_label("view").select_option("above")
            pictures = []
            for part in (0.0, 0.5, 1.0):
                opened.scrub(part)
                pictures.append(opened.picture())
            assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 10).mean() > 0.003
            assert not opened.complaints


def test_maps_of_heights_lie_below_the_bodies(browser, tmp_path):
    """Heights of the map travel with the ground and repeat themselves; the net is bent by them."""
    x, y = np.meshgrid(0.01 * np.arange(8), 0.0075 * np.arange(6), indexing="ij")
    along, across = 2.0 * np.pi * x / 0.08, 2.0 * np.pi * y / 0.045
    heights = 4e-5 * np.cos(along) * np.sin(across) + 2e-5 * np.sin(2.0 * along)
    study = fc.Study.from_toml(template("solid")).with_(**{
        "simulation.t_end": 0.01, "simulation.outputs": 21, "ground": {
            "speed": 0.9, "speed_y": -0.4, "height_map": {
                "heights": heights.tolist(), "spacing_x": 0.01, "spacing_y": 0.0075,
                "origin_x": 0.004, "origin_y": -0.002}}})
    run = study.run()
    path = report(run, tmp_path / "map.html", scale=150.0)
    shown, ground = Shown(path), Shown(path).header["ground"]
    assert ground["wavy"]
    assert shown.header["notes"] == []
    stored = shown.array("ground", "heights")
    # Both periods are shorter than what is seen: all of the map is there, once.
    assert np.array(ground["steps"]) * stored.shape == pytest.approx([0.08, 0.045])
    with Opened(browser, path) as opened:
        opened.scrub(0.7)
        index = opened.of_player("player.clock.index")
        travel = np.array([0.9, -0.4]) * run.time[index]
        places = np.random.default_rng(0).uniform(-0.1, 0.2, (40, 2))
        level = ground["level"] - 150.0 * ground["gap"]
        expected = level + 150.0 * study.ground.height_map.shape(
            *(places - travel).T)[..., 0]
        found = opened.of_player(f"{places.tolist()}.map(p => player.groundNow().height(...p))")
        assert found == pytest.approx(expected, abs=0.01 * 150.0 * np.ptp(heights))
        pictures = [opened.picture()]
        opened.scrub(0.8)
        pictures.append(opened.picture())
        assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 10).mean() > 0.003
        assert not opened.complaints
