"""Compiled code on disk that is cut short, empty or garbage: compiled again, never a crash."""

import os
import pickle
import shutil
import subprocess
import sys
from contextlib import nullcontext
from importlib import import_module
from itertools import product
from pathlib import Path
from unittest import mock

import numba
import pytest
from llvmlite.binding import parse_bitcode

from fecontact.core import compiled
from fecontact.core.simd import vectors
from fecontact.core.simd.vectors import WIDTH

MODULE = '''
from collections.abc import Callable
from fecontact.core.compiled import compile_law, kernel


@kernel
def doubled(x: float) -> float:
    return 2.0 * x


def halved(x):
    return 0.5 * x


LAW = compile_law(Callable[[float], float], "f(x) -> y", halved)
assert doubled(3.0) == 6.0
assert LAW.address
hits = sum(doubled.stats.cache_hits.values()), LAW._compiled.cache_hits
print(*hits)
'''


IMPORTS = """
import sys
for folder in sys.argv[1:]:
    sys.path[0] = folder
    sys.modules.pop("own_kernels", None)
    import own_kernels
"""


def without_folder_of_numba():
    """The environment of a process that stores code beside its source."""
    return {name: value for name, value in os.environ.items()
            if name not in ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES")}


def hits(*folders):
    """Output of a new process that imports the module of each folder: True if it was on disk."""
    done = subprocess.run([sys.executable, "-c", IMPORTS, *map(str, folders)], check=False,
                          capture_output=True, text=True, env=without_folder_of_numba())
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    said = [line.split() for line in done.stdout.splitlines()]
    assert len(said) == len(folders)
    return said[0] if len(folders) == 1 else said


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "cut at the end": lambda content: content[:-1],
    "head alone": lambda content: content[:3],
    "empty": lambda content: b"",
    "zeros": lambda content: bytes(len(content)),
    "text": lambda content: b"hello",
}


def test_damaged_code_is_compiled_again(tmp_path, stored):
    cases, others = [], []
    for damage, suffix in product(DAMAGES, (".nbi", ".nbc")):
        # With times of files, by which stored code is known to be that of the source.
        folder = Path(shutil.copytree(stored, tmp_path / f"{damage}{suffix}"))
        other = folder / "__pycache__" / f"mine{suffix}"
        other.write_bytes(b"of somebody else")
        own = [path for path in other.parent.glob(f"*{suffix}") if path != other]
        assert len(own) == 2
        for path in own:
            path.write_bytes(DAMAGES[damage](path.read_bytes()))
        cases.append(folder)
        others.append(other)
    found = zip(cases, hits(*cases), strict=True)
    assert not [folder.name for folder, said in found if said != ["0", "0"]]
    assert {other.read_bytes() for other in others} == {b"of somebody else"}
    # All of it is stored anew, and found by the same means.
    assert hits(*cases) == len(cases) * [["1", "1"]]


@pytest.mark.slow
def test_whole_code_is_found_and_damaged_code_stored_anew(tmp_path, stored):
    folder = Path(shutil.copytree(stored, tmp_path / "copy"))
    assert hits(folder) == ["1", "1"]
    for path in (folder / "__pycache__").glob("*.nbc"):
        path.write_bytes(b"")
    assert hits(folder) == ["0", "0"]
    assert hits(folder) == ["1", "1"]


def test_machine_code_is_stored_with_names_alone(stored, monkeypatch):
    """What numba could link other functions with takes ten times the memory when it is read."""
    monkeypatch.syspath_prepend(stored)
    for path in (stored / "__pycache__").glob("*.nbc"):
        (_, _, (_, source)), described, *_ = pickle.loads(path.read_bytes())
        functions = list(parse_bitcode(source).functions)
        # Laws are seen from outside by their entries alone.
        names = {described.mangled_name, described.llvm_cfunc_wrapper_name}
        assert names & {each.name for each in functions}
        assert {len(list(each.blocks)) for each in functions} == {1}
        assert {sum(1 for block in each.blocks for _ in block.instructions)
                for each in functions} == {1}


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = Path(tmp_path_factory.mktemp("kernels"))
    (folder / "own_kernels.py").write_text(MODULE)
    assert hits(folder) == ["0", "0"]
    assert hits(folder) == ["1", "1"]
    return folder


def test_code_that_cannot_be_stored_is_compiled_all_the_same(tmp_path, stored):
    """Folders stand where numba would put its index: neither read nor written."""
    folder = Path(shutil.copytree(stored, tmp_path / "copy"))
    for path in (folder / "__pycache__").glob("*.nbi"):
        path.unlink()
        path.mkdir()
    assert hits(folder) == ["0", "0"]


HELPERS = '''
from numba import njit

FACTOR = 2.0


@njit
def scaled(x):
    """Scale a number."""
    return FACTOR * x
'''
CALLING = '''
import helpers
from fecontact.core.compiled import helper, kernel


@helper
def shifted(x):
    return helpers.scaled(x) + 1.0


@kernel
def outer(x: float) -> float:
    return shifted(x)


value = outer(3.0)
print(*outer.stats.cache_hits.values() or [0], value)
'''


@pytest.fixture(scope="module")
def calling(tmp_path_factory):
    folder = Path(tmp_path_factory.mktemp("calling"))
    (folder / "own_kernels.py").write_text(CALLING)
    (folder / "helpers.py").write_text(HELPERS)
    assert hits(folder) == ["0", "7.0"]
    assert hits(folder) == ["1", "7.0"]
    return folder


@pytest.mark.parametrize(("old", "new", "result"), [
    ("FACTOR = 2.0", "FACTOR = 3.0", ["0", "10.0"]),
    ("FACTOR * x", "FACTOR - x", ["0", "0.0"]),
    ("Scale a number.", "A longer docstring,\n\n    with lines.", ["1", "7.0"]),
    ("FACTOR = 2.0", "# A comment.\nFACTOR = 2.0", ["1", "7.0"]),
])
def test_code_is_compiled_again_if_anything_changes_that_it_calls(tmp_path, calling, old, new,
                                                                  result):
    """Else a changed helper would leave the code of kernels in other files as it was."""
    assert old in HELPERS
    folder = Path(shutil.copytree(calling, tmp_path / "copy"))
    (folder / "helpers.py").write_text(HELPERS.replace(old, new))
    for path in (folder / "__pycache__").glob("helpers.*.pyc"):
        path.unlink()  # Python would take it for that of the new file, of the same size and second
    assert hits(folder) == result


def _outer(x):
    return x + WIDTH


def test_digest_depends_on_options_and_is_that_of_any_copy():
    digest = compiled.source_digest(compiled.helper(_outer))
    assert compiled.source_digest(compiled.helper(_outer)) == digest
    assert compiled.source_digest(numba.njit(_outer)) != digest


def test_intrinsics_count_with_their_whole_file():
    """Operators on their values are overloads, which no kernel names."""
    digest = compiled.source_digest(vectors.read)
    source = Path(vectors.__file__).read_bytes()
    with mock.patch.object(Path, "read_bytes", return_value=source + b"# more"):
        compiled._own_digest.cache_clear()
        assert compiled.source_digest(vectors.read) != digest
    compiled._own_digest.cache_clear()


NOWHERE = """
import sys, warnings
from numba.core.caching import CacheImpl
CacheImpl._locator_classes = []  # as in folders without rights and without a home
warnings.simplefilter("always")
"""
OWN_KERNELS = """
sys.path[0] = sys.argv[1]
import own_kernels
"""
ONE_MASS = """
import numpy as np
from fecontact import ContactSystem, basis_from_matrices, simulate
from fecontact.integrate import Scipy
from fecontact.laws import ConstantFriction, LinearContact
rows = np.array([[0.0], [1.0], [0.0]])
modes = basis_from_matrices([[1.0]], [[1e4]], {"contact": rows[None], "C": rows})
mass = ContactSystem(modes, LinearContact(1e5), ConstantFriction(0.5))
print(simulate(mass, 0.01, outputs=3, solver=Scipy()).status.name)
"""


@pytest.mark.parametrize(("code", "output"), [
    (OWN_KERNELS, "0 0"), pytest.param(ONE_MASS, "FINISHED", marks=pytest.mark.slow)])
def test_code_is_compiled_in_memory_where_no_folder_can_store_it(tmp_path, code, output):
    (tmp_path / "own_kernels.py").write_text(MODULE)
    done = subprocess.run([sys.executable, "-c", NOWHERE + code, tmp_path], check=False,
                          capture_output=True, text=True, env=without_folder_of_numba())
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n") == [output, ""]
    assert done.stderr.count("Warning") == 1
    assert "ModelWarning: Compiled code cannot be stored" in done.stderr
    assert "environment variable NUMBA_CACHE_DIR" in done.stderr
    assert not list(tmp_path.rglob("*.nb?"))


def test_the_time_that_compiling_took_is_told_at_the_next_one(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text("from fecontact.core.compiled import kernel\n"
                                      "@kernel\n"
                                      "def double(x: float) -> float:\n"
                                      "    return 2.0 * x\n")
    monkeypatch.syspath_prepend(tmp_path)
    told = []
    monkeypatch.setattr(compiled, "said_if_slow",
                        lambda text, applies: told.append(text) or nullcontext())
    for seconds in (None, 8.2, "nonsense"):
        if seconds is not None:
            next(tmp_path.rglob("*.seconds")).write_text(str(seconds))
            for file in tmp_path.rglob("*.nbc"):
                file.unlink()
        sys.modules.pop("mine", None)
        assert import_module("mine").double(2.0) == 4.0
        assert 0.0 < float(next(tmp_path.rglob("*.seconds")).read_text()) < 60.0
    assert [text.partition(", once")[0] for text in told] == [
        "Compiling mine.double", "Compiling mine.double, about 9 s", "Compiling mine.double"]
