"""Running the scripts of a folder as a user does, in a folder of their own."""

import re
import runpy
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def files_of(folder):
    """Files below a folder, but for those of Python itself."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")
            if path.is_file() and "__pycache__" not in path.parts}


def run_script(script, arguments, folder, monkeypatch, capsys):
    """Output of ``python SCRIPT ARGUMENTS --quick``, and the files that it leaves in a folder.

    Temporary files must be gone, but for the references that the integrator's benchmark keeps;
    nothing is left beside the script.
    """
    script = ROOT / script
    home, scratch = folder / "home", folder / "scratch"
    home.mkdir()
    scratch.mkdir()
    before = files_of(script.parent)
    with monkeypatch.context() as patch:
        patch.chdir(home)
        patch.setattr(tempfile, "tempdir", str(scratch))
        patch.setenv("TMPDIR", str(scratch))
        patch.setattr(sys, "argv", [str(script), *arguments, "--quick"])
        patch.syspath_prepend(str(script.parent))
        capsys.readouterr()
        runpy.run_path(str(script), run_name="__main__")
        printed = capsys.readouterr().out
    assert files_of(script.parent) == before
    left = {name for name in files_of(scratch) if not name.startswith("fecontact_reference_")}
    assert left == set()
    return printed, files_of(home)


def check_numbers(printed, numbers):
    """Each pattern's first group, as a number, against what it should be and its tolerance."""
    for pattern, expected, tolerance in numbers:
        found = re.search(pattern, printed, re.MULTILINE)
        assert found, (pattern, printed)
        assert float(found[1]) == pytest.approx(expected, abs=tolerance), pattern
