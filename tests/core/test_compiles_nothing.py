"""First commands with a package of all kernels: not one is compiled."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.registry import cpu_target

import fecontact
from fecontact.core import stored_code

ROOT = Path(__file__).resolve().parents[2]
SOURCES = Path(fecontact.__file__).parent

pytestmark = [pytest.mark.long, pytest.mark.skipif(
    "NUMBA_CPU_NAME" in os.environ or not (ROOT / ".ci").is_dir(),
    reason="the kernels are those of another processor, or there is no script")]


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A package of what this machine's cache has, which is complete then."""
    subprocess.run([sys.executable, "-m", "fecontact", "compile", "--all"], check=True,
                   capture_output=True)
    folder = tmp_path_factory.mktemp("package")
    family = folder / stored_code.PACKAGE / stored_code.own_families()[-1]
    for file in SOURCES.rglob("__pycache__/*.nb?"):
        place = family / file.parent.parent.relative_to(SOURCES) / file.name.partition(".")[0]
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, place)
    target = cpu_target.target_context.codegen().magic_tuple()
    (family / stored_code.MADE_WITH).write_text(
        json.dumps(stored_code.made_with() | {"target": target}), encoding="utf-8")
    return folder


def attempt(package, *names):
    known = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    path = os.pathsep.join([str(package), *filter(None, [known.get("PYTHONPATH")])])
    return subprocess.run([sys.executable, ROOT / ".ci/compiles-nothing", *names],
                          capture_output=True, text=True, check=False,
                          env=known | {"PYTHONPATH": path})


def test_first_commands_compile_nothing(package):
    done = attempt(package)
    assert (done.returncode, done.stdout) == (0, "Nothing was compiled.\n"), done.stderr


def test_kernels_that_are_missing_are_named(package):
    left_out = [*package.rglob("kernels.right_hand_side.*")]
    assert left_out
    for file in left_out:
        file.unlink()
    done = attempt(package, "mass")
    assert done.returncode == 1, done.stderr
    assert "mass compiled kernels.right_hand_side" in done.stdout
