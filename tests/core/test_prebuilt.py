"""Kernels of the package ``fecontact-kernels``: used where they fit, else compiled here."""

import json
import os
import subprocess
import sys

import pytest

from fecontact.cli import kernels
from fecontact.core import stored_code

FAMILY = stored_code.own_families()[-1]

pytestmark = pytest.mark.skipif(not stored_code.serves(FAMILY), reason="for processors of a family")

CODE = """
import numpy as np
from fecontact.core.compiled import KERNELS
from fecontact.core.stored_code import prebuilt
from fecontact.system.node_forces import normal_values
normal_values.ready()
there = prebuilt()
print(sum(normal_values.stats.cache_hits.values()), sum(normal_values.stats.cache_misses.values()),
      there and there.folder.name)
"""


def ready(**variables):
    """Hits and misses of stored code in a new process, and the family of the package it uses."""
    without = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_CACHE_LOCATOR_CLASSES")
    known = {name: value for name, value in os.environ.items() if name not in without}
    done = subprocess.run([sys.executable, "-c", CODE], check=False, capture_output=True, text=True,
                          env=known | {name: str(value) for name, value in variables.items()})
    assert done.returncode == 0, done.stderr
    hits, misses, family = done.stdout.split()
    return int(hits), int(misses), family


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A folder with a package of one kernel, compiled for another processor than this one."""
    folder = tmp_path_factory.mktemp("package")
    family = folder / stored_code.PACKAGE / FAMILY
    found = ready(**stored_code.compiled_for(FAMILY), FECONTACT_KERNELS_FOLDER=family)
    assert found == (0, 1, "None")
    assert list(family.rglob("node_forces.normal_values.*.nbc"))
    kernels.say_made_with(family, FAMILY)
    return folder


def with_package(package, cache, **variables):
    path = os.pathsep.join(filter(None, [str(package), os.environ.get("PYTHONPATH")]))
    return ready(PYTHONPATH=path, NUMBA_CACHE_DIR=cache, **variables)


@pytest.mark.slow
def test_kernels_of_the_package_are_not_compiled(package, tmp_path):
    assert with_package(package, tmp_path) == (1, 0, FAMILY)
    assert not list(tmp_path.rglob("*.nbc"))


@pytest.mark.slow
@pytest.mark.parametrize("variables", [{"FECONTACT_NATIVE": "1"},
                                       stored_code.compiled_for(FAMILY)])
def test_native_code_is_compiled_on_request(package, tmp_path, variables):
    assert with_package(package, tmp_path, **variables) == (0, 1, "None")
    # Once; then it is there.
    assert with_package(package, tmp_path, **variables) == (1, 0, "None")


@pytest.mark.parametrize("name", ["fecontact", "numba", "llvmlite"])
def test_kernels_of_other_versions_are_not_used(package, tmp_path, name):
    file = package / stored_code.PACKAGE / FAMILY / stored_code.MADE_WITH
    before = file.read_text(encoding="utf-8")
    file.write_text(json.dumps(json.loads(before) | {name: "0.0.1"}), encoding="utf-8")
    try:
        assert with_package(package, tmp_path) == (0, 1, "None")
    finally:
        file.write_text(before, encoding="utf-8")


def test_damaged_kernels_are_compiled_again(package, tmp_path):
    files = [*package.rglob("*.nbc")]
    before = [file.read_bytes() for file in files]
    for file, content in zip(files, before, strict=True):
        file.write_bytes(content[: len(content) // 2])
    try:
        assert with_package(package, tmp_path) == (0, 1, FAMILY)
    finally:
        for file, content in zip(files, before, strict=True):
            file.write_bytes(content)
