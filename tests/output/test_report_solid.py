"""Bodies in space on a page: what is stored and shown is what was computed, and can be seen.

Needs Chromium and Playwright; see ``browsing.py``.
"""

from time import process_time

import numpy as np
import pytest
from browsing import SOFTWARE_WEBGL, Opened, launched, sync_api
from report_reading import Shown
from solid_drawing import SIZE, box_surface, solid, write_solid

from fecontact.output.render.surfaces import sharp_edges
from fecontact.output.report.drawing import along_edges

SCALE = 50.0


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as started:
        opened = launched(started, *SOFTWARE_WEBGL)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def drawn():
    return solid(waviness=1e-5)


@pytest.fixture(scope="module")
def path(drawn, tmp_path_factory):
    return write_solid(drawn, tmp_path_factory.mktemp("solid") / "solid.html", SCALE)


def fields(drawn):
    """Displacements (N, P, 3) and von Mises stresses (N, P) by the definition of the latter."""
    bodies, q = drawn.motions.bodies, drawn.motions.coordinates
    motion = np.einsum("pcm,tm->tpc", bodies.shapes, q)
    s = np.einsum("pcm,tm->tpc", bodies.stress, q)
    tensor = s[..., [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(*s.shape[:2], 3, 3)
    deviator = tensor - np.trace(tensor, axis1=2, axis2=3)[..., None, None] / 3.0 * np.eye(3)
    return motion, np.sqrt(1.5 * (deviator**2).sum(axis=(2, 3)))


def at_instant(opened, drawn, index):
    opened.page.evaluate("time => document.querySelector('.stage').player.clock.set(time)",
                         float(drawn.time[index]))


def test_what_is_stored_is_the_motion(drawn, path):
    shown, (motion, stress) = Shown(path), fields(drawn)
    error = np.linalg.norm(shown.displacement - motion, axis=2).max()
    assert error < 1e-4 * np.linalg.norm(motion, axis=2).max()
    true = np.einsum("tni,nik->tnk", drawn.forces, drawn.axes)
    assert np.linalg.norm(shown.forces - true, axis=2).max() < 1e-4 * np.linalg.norm(
        true, axis=2).max()
    largest = shown.header["bodies"]["largest"]
    assert largest["displacement"] == pytest.approx(np.linalg.norm(motion, axis=2).max(), rel=1e-6)
    assert largest["peak"] == pytest.approx(stress.max(), rel=1e-6)
    # The drift along waves is not magnified.
    drift = drawn.motions.coordinates @ drawn.motions.drift[0]
    places = drawn.motions.bodies.nodes + SCALE * motion
    places[..., 0] += (1.0 - SCALE) * drift[:, None]
    box = np.reshape(shown.header["box"], (3, 2))
    assert (box[:, 0] <= places.min(axis=(0, 1)) + 1e-9).all()
    assert (box[:, 1] >= places.max(axis=(0, 1)) - 1e-9).all()
    assert (np.ptp(box, axis=1) < 1.3 * np.ptp(places, axis=(0, 1))).all()


def test_what_is_computed_and_drawn_is_the_motion(browser, drawn, path):
    motion, stress = fields(drawn)
    nodes = drawn.motions.bodies.nodes
    drift = drawn.motions.coordinates @ drawn.motions.drift[0]
    with Opened(browser, path) as opened:
        pictures = []
        for index in (3, 77, 160):
            at_instant(opened, drawn, index)
            places = np.reshape(opened.of_player("Array.from(player.places)"), (-1, 3))
            places[:, 0] -= (1.0 - SCALE) * drift[index]
            error = np.linalg.norm((places - nodes) / SCALE - motion[index], axis=1).max()
            assert error < 1e-4 * np.linalg.norm(motion, axis=2).max()
            values = np.array(opened.of_player("Array.from(player.values)"))
            assert np.abs(values - stress[index]).max() < 1e-4 * stress.max()
            pictures.append(opened.picture())
        for picture in pictures:
            assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
        assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 20).mean() > 0.005
        assert not opened.complaints
        assert opened.asked == [path.as_uri()]


def test_views_are_right_handed_and_show_the_ground_from_the_side(browser, drawn, path):
    with Opened(browser, path) as opened:
        def seen(x, y, z):
            return np.array(opened.of_player(f"player.project({x}, {y}, {z})"))

        for view in ("oblique", "front", "side", "above", "below"):
            opened.page.get_by_label("view").select_option(view)
            turn = np.reshape(opened.of_player("player.turn"), (3, 3)).T
            np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(turn) == pytest.approx(1.0)
            if view in ("front", "side"):  # the plane of the ground is a line, upright above it
                assert seen(0.0, 0.0, 0.0)[1] == pytest.approx(seen(0.1, 0.06, 0.0)[1], abs=1e-6)
                assert seen(0.0, 0.0, 0.01)[1] < seen(0.0, 0.0, 0.0)[1] - 10.0
            # The contact looks at who stands below.
            assert (turn[2, 2] < -0.5) == (view == "below")
        assert seen(0.1, 0.0, 0.0)[0] > seen(0.0, 0.0, 0.0)[0] + 50.0
        opened.page.get_by_label("view").select_option("front")
        before = opened.picture()
        box = opened.page.locator(".stage").bounding_box()
        opened.page.mouse.move(box["x"] + 300, box["y"] + 150)
        opened.page.mouse.down()
        opened.page.mouse.move(box["x"] + 350, box["y"] + 180, steps=4)
        opened.page.mouse.up()
        turned = np.reshape(opened.of_player("player.turn"), (3, 3))
        np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
        assert (np.abs(opened.picture() - before).max(axis=2) > 20).mean() > 0.02
        solid_body = opened.picture()
        opened.page.get_by_label("see-through").check()
        assert (np.abs(opened.picture() - solid_body).max(axis=2) > 20).mean() > 0.05


def test_contact_nodes_have_their_states_and_arrows_their_forces(browser, drawn, path):
    """From below, where neither the body nor its nodes hide each other."""
    colours = {1: (0x00, 0x72, 0xb2), 2: (0xe6, 0x9f, 0x00)}
    motion = drawn.motions
    met = set()
    with Opened(browser, path) as opened:
        opened.page.wait_for_selector("html[data-whole]", state="attached")
        opened.page.get_by_label("view").select_option("below")
        opened.page.get_by_label("forces").uncheck()
        for index in range(1, 200, 17):
            at_instant(opened, drawn, index)
            q = motion.coordinates[index]
            places = drawn.places + SCALE * drawn.rows @ q
            places[:, 0] += (1.0 - SCALE) * q @ motion.drift[0]
            seen = opened.of_player(f"{places.tolist()}.map(p => player.project(...p))")
            picture = opened.picture()
            for (x, y), state in zip(seen, drawn.states[index], strict=True):
                if state in colours:
                    around = picture[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2]
                    assert np.abs(around.reshape(-1, 3) - colours[state]).max(axis=1).min() < 12.0
                    met.add(int(state))
        assert met == {1, 2}
        # The largest force is an arrow of a fifth of the height, in the direction of the force.
        length = np.linalg.norm(drawn.forces, axis=2)
        index, node = np.unravel_index(length.argmax(), length.shape)
        at_instant(opened, drawn, index)
        without = opened.picture()
        opened.page.get_by_label("forces").check()
        changed = np.abs(opened.picture() - without).max(axis=2) > 40
        turn = np.reshape(opened.of_player("player.turn"), (3, 3)).T
        q = motion.coordinates[index]
        place = drawn.places[node] + SCALE * drawn.rows[node] @ q
        place[0] += (1.0 - SCALE) * q @ motion.drift[0]
        tip = np.array(opened.of_player(f"player.project({', '.join(map(str, place))})"))
        force = turn @ drawn.forces[index, node] / length.max()
        arrow = 0.2 * min(changed.shape) * np.array([force[0], -force[1]])
        for part in (0.2, 0.5, 0.9):
            x, y = np.round(tip - part * arrow).astype(int)
            assert changed[y - 2 : y + 3, x - 2 : x + 3].any()


def test_the_ground_moves_with_its_travel(browser, drawn, path):
    with Opened(browser, path) as opened:
        opened.page.get_by_label("view").select_option("above")
        wavy = Shown(path).header["ground"]
        assert wavy["wavy"]
        np.testing.assert_allclose(Shown(path).array("ground", "travel"), 0.5 * drawn.time,
                                   atol=1e-8)
        pictures = []
        for index in (0, 60, 120):
            at_instant(opened, drawn, index)
            pictures.append(opened.picture())
        assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 10).mean() > 0.002


def test_edges_are_those_of_the_block():
    """Twelve, of as many cells as lie along them; none across its faces."""
    nodes, triangles = box_surface((5, 4, 3))
    edges = sharp_edges(nodes, triangles)
    assert len(edges) == 4 * (5 + 4 + 3)
    on_faces = (np.abs(nodes[edges]) < 1e-12) | (np.abs(nodes[edges] - SIZE) < 1e-12)
    assert (on_faces.all(axis=1).sum(axis=1) == 2).all()


def test_a_walk_along_edges_changes_nothing_but_the_order(drawn):
    bodies = drawn.motions.bodies
    walked = along_edges(bodies)
    corners = np.sort(bodies.nodes[bodies.triangles].reshape(-1, 9), axis=0)
    np.testing.assert_array_equal(np.sort(walked.nodes[walked.triangles].reshape(-1, 9), axis=0),
                                  corners)
    steps = np.linalg.norm(np.diff(walked.nodes, axis=0), axis=1)
    assert np.median(steps) <= np.linalg.norm(SIZE / [10, 6, 4])
    label = walked.nodes[walked.labels[0][1]]
    np.testing.assert_array_equal(label, bodies.nodes[bodies.labels[0][1]])


def test_a_large_solid_is_small_and_opens_soon(browser, tmp_path):
    """20,000 surface points, 20 modes, 5000 instants, 400 contact nodes."""
    drawn = solid((106, 62, 22), times=5000, nodes=(20, 20), end=0.2)
    assert len(drawn.motions.bodies.nodes) > 20_000
    began = process_time()
    path = write_solid(drawn, tmp_path / "large.html")
    assert process_time() - began < 15.0
    assert path.stat().st_size < 8e6
    with Opened(browser, path) as opened:
        opened.page.wait_for_selector("html[data-whole]", state="attached", timeout=60_000)
        ready, whole = (float(opened.page.evaluate(f"document.documentElement.dataset.{name}"))
                        for name in ("ready", "whole"))
        index = 3021
        at_instant(opened, drawn, index)
        places = np.reshape(opened.of_player("Array.from(player.places)"), (-1, 3))
        nodes, q = drawn.motions.bodies.nodes, drawn.motions.coordinates[index]
        error = (places - nodes) / SCALE - drawn.motions.bodies.shapes @ q
        largest = drawn.motions.ranges.largest_displacement
        assert np.linalg.norm(error, axis=1).max() < 1e-4 * largest
        cost = opened.of_player("(player.draw(), player.cost)")
        print(f"first picture after {ready} ms, all data after {whole} ms, a frame takes {cost} ms")
        # Many times what a quiet computer takes.
        assert ready < 8000.0
        assert cost < 200.0
        assert not opened.complaints
