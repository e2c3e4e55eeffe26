"""Pages in a headless Chromium, driven by Playwright; tests without these are skipped.

``apt-get install chromium``, ``pip install playwright``: no browser is downloaded.
"""

import io
import shutil

import numpy as np
import pytest
from matplotlib.image import imread

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = next(filter(None, map(shutil.which, (
    "chromium", "chromium-browser", "google-chrome"))), None)
if CHROMIUM is None:
    pytest.skip("there is no Chromium", allow_module_level=True)

SOFTWARE_WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
NO_WEBGL = ("--disable-gpu", "--disable-software-rasterizer")


def launched(started, *options):
    """A browser of a Playwright that has been started."""
    return started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", *options])


class Opened:
    """A page that is ready, and all that it asked for and complained of."""

    def __init__(self, browser, path, **context):
        self.asked, self.complaints, self.dialogs = [], [], []
        self._context = browser.new_context(viewport={"width": 1300, "height": 900}, **context)
        self.page = self._context.new_page()
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.dialogs.append(dialog.message),
                                               dialog.dismiss()))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-ready]", state="attached", timeout=30_000)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._context.close()

    @property
    def time(self):
        return float(self.page.evaluate("document.documentElement.dataset.time"))

    def scrub(self, part):
        self.page.evaluate("part => { const one = document.querySelector('.scrub');"
                           "one.value = 1000 * part; one.oninput(); }", part)

    def picture(self, selector=".stage"):
        """Pixels (height, width, 3) from 0 to 255 of the first element that is selected."""
        image = imread(io.BytesIO(self.page.locator(selector).first.screenshot()))
        return np.rint(255.0 * image[..., :3])

    def of_player(self, expression):
        return self.page.evaluate(f"(player => {expression})(document.querySelector('.stage')"
                                  ".player)")
