"""The scripts of pages."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import fecontact
from fecontact.output.report.page import SCRIPTS, script


@pytest.mark.parametrize("kind", SCRIPTS)
def test_the_script_is_small(kind):
    assert len(script(kind).encode()) <= 51_500


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize("kind", SCRIPTS)
def test_scripts_are_modules_without_errors(kind, tmp_path):
    path = tmp_path / "script.mjs"
    path.write_text(script(kind))
    subprocess.run(["node", "--check", path], capture_output=True, check=True, timeout=60)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize(("low", "high"), [
    (-2.3e-17, 1.9e-17), (0.0, 4e-12), (1.0, 1.0 + 3e-9), (-3e7, 2e7), (-0.3, 0.2), (0.0, 250.0)])
def test_tick_labels_are_short_and_read_back(low, high, tmp_path):
    """The labels are those of their places, differ from each other, and have no idle digits."""
    chart = Path(fecontact.__file__).parent / "output" / "report" / "assets" / "chart.js"
    path = tmp_path / "ticks.mjs"
    path.write_text(f"globalThis.matchMedia = () => ({{}});\n{chart.read_text()}\n"
                    f"console.log(JSON.stringify(ticks({low!r}, {high!r}, 5)));\n")
    done = subprocess.run(["node", path], capture_output=True, check=True, timeout=60, text=True)
    found = json.loads(done.stdout)
    places, texts = zip(*found, strict=True)
    step = places[1] - places[0]
    assert len(found) >= 3
    assert len(set(texts)) == len(texts)
    assert [float(text) for text in texts] == pytest.approx(list(places), abs=0.01 * step)
    if max(abs(low), abs(high)) < 1e3 * step:
        assert max(map(len, texts)) <= 8
