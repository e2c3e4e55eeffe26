"""The page of a run as a widget, shown by the ES module alone with a model that stands for Python.

Needs Chromium and Playwright, see ``browsing.py``, and anywidget.
"""

import base64
import io
import json

import numpy as np
import pytest
from browsing import SOFTWARE_WEBGL, launched, sync_api
from matplotlib.image import imread
from synthetic import run

from fecontact import InputError
from fecontact.io import report_widget
from fecontact.output.report import notebook

pytest.importorskip("anywidget")

# Stand-in for a notebook: loads the module, gives it a model and a place, and ends it.
HOST = """<!doctype html><title>notebook</title><body style="width: 1100px">
<p id="text">text of the notebook</p><div id="one"></div><div id="two"></div>
<script type="module">
const bytes = Uint8Array.from(atob("%(block)s"), (letter) => letter.charCodeAt(0));
window.model = (time) => {
  const values = { time, block: new DataView(bytes.buffer), styles: %(styles)s }, heard = {};
  return { values, saved: 0, get: (name) => values[name],
    set(name, value) { values[name] = value; },
    save_changes() { this.saved++; },
    on(name, call) { (heard[name] ??= []).push(call); },
    off(name, call) { heard[name] = heard[name].filter((one) => one !== call); },
    calls: () => Object.values(heard).flat().length,
    change(time) { values.time = time; for (const call of heard["change:time"]) call(); } };
};
const source = new Blob([%(esm)s], { type: "text/javascript" });
const module = await import(URL.createObjectURL(source));
window.open = async (place, model) => module.default.render(
  { model, el: document.getElementById(place) });
document.body.dataset.loaded = 1;
</script>"""


@pytest.fixture(scope="module")
def trajectory():
    return run(times=201)


@pytest.fixture(scope="module")
def widget(trajectory):
    return report_widget(trajectory, title="Beam in a notebook", points=["B"])


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as started:
        opened = launched(started, *SOFTWARE_WEBGL)
        yield opened
        opened.close()


@pytest.fixture
def cell(browser, widget, tmp_path):
    """A page with the module loaded, and what it complained of."""
    path = tmp_path / "notebook.html"
    # A text in a script must not end it.
    text = {name: json.dumps(value).replace("<", "\\u003c") for name, value in (
        ("styles", widget.styles), ("esm", widget._esm))}
    path.write_text(HOST % {"block": base64.b64encode(widget.block).decode(), **text},
                    encoding="utf-8")
    context = browser.new_context(viewport={"width": 1200, "height": 900})
    page, complaints, asked = context.new_page(), [], []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-loaded]", timeout=30_000)
    yield page
    assert not complaints
    assert not [url for url in asked if not url.startswith(("file:", "blob:"))]
    context.close()


def picture(page, place="one"):
    image = imread(io.BytesIO(page.locator(f"#{place} .stage").screenshot()))
    return np.rint(255.0 * image[..., :3])


def test_its_traits_hold_the_run(widget, trajectory):
    assert widget.time == trajectory.time[0]
    assert widget._esm.startswith("function") or "export default" in widget._esm
    assert isinstance(widget.block, bytes)
    assert {"block", "styles", "time", "_esm"} <= set(widget.traits(sync=True))
    with pytest.raises(InputError, match="run"):
        report_widget(3)


def test_it_plays_and_talks_to_python(cell, trajectory):
    cell.evaluate("async () => { window.one = model(0); window.end = await open('one', one); }")
    assert cell.locator("#one h1").inner_text() == "Beam in a notebook"
    first = picture(cell)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 30
    # From Python to the page.
    wanted = float(trajectory.time[77])
    cell.evaluate("time => one.change(time)", wanted)
    assert float(cell.evaluate("document.getElementById('one').dataset.time")) == wanted
    assert (np.abs(picture(cell) - first).max(axis=2) > 30).mean() > 0.01
    # And back: a click on a chart.
    box = cell.locator("#one .chart .plot").first.bounding_box()
    cell.locator("#one .chart .plot").first.click(
        position={"x": 52.0 + 0.5 * (box["width"] - 62.0), "y": 40.0})
    cell.wait_for_timeout(400)
    assert cell.evaluate("one.get('time')") == pytest.approx(0.5 * trajectory.time[-1], rel=0.01)
    assert cell.evaluate("one.saved") >= 1
    # Styles stay inside.
    assert cell.evaluate("getComputedStyle(document.getElementById('text')).fontSize") == "16px"


def test_closing_releases_graphics_and_listeners(cell):
    cell.evaluate("async () => { window.one = model(0); window.end = await open('one', one); }")
    cell.evaluate("window.gl = document.querySelector('#one').shadowRoot.querySelector('.stage')"
                  ".player.gl")
    assert not cell.evaluate("gl.isContextLost()")
    cell.evaluate("end()")
    assert cell.evaluate("gl.isContextLost()")
    assert cell.evaluate("one.calls()") == 0


def test_many_widgets_after_each_other_leave_room_for_the_next(cell):
    """A browser has 16 contexts; the seventeenth takes the first one away."""
    for _ in range(20):
        cell.evaluate("""async () => {
          const place = document.createElement("div");
          place.id = "next";
          document.body.append(place);
          const end = await open("next", model(0));
          end();
          place.remove();
        }""")
    cell.evaluate("async () => { window.two = model(0); await open('two', two); }")
    assert not cell.evaluate("document.querySelector('#two').shadowRoot.querySelector('.stage')"
                             ".player.gl.isContextLost()")
    assert len(np.unique(picture(cell, "two").reshape(-1, 3), axis=0)) > 30


def test_without_anywidget_the_remedy_is_told(trajectory, monkeypatch):
    notebook._widget_class.cache_clear()
    monkeypatch.setitem(__import__("sys").modules, "anywidget", None)
    with pytest.raises(InputError, match=r"pip install 'fecontact\[notebook\]'"):
        report_widget(trajectory)
    notebook._widget_class.cache_clear()
