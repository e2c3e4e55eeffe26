"""The scripts of pages."""

import shutil
import subprocess

import pytest

from fecontact.output.report.page import SCRIPTS, script


@pytest.mark.parametrize("kind", SCRIPTS)
def test_the_script_is_small(kind):
    assert len(script(kind).encode()) <= 51_000


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize("kind", SCRIPTS)
def test_scripts_are_modules_without_errors(kind, tmp_path):
    path = tmp_path / "script.mjs"
    path.write_text(script(kind))
    subprocess.run(["node", "--check", path], capture_output=True, check=True, timeout=60)
