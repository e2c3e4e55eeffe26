"""Compiled code on disk that is cut short, empty or garbage: compiled again, never a crash."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fecontact
from fecontact.core import compiled

MODULE = '''
from fecontact.core.compiled import compile_law, f8, kernel


@kernel(f8(f8))
def doubled(x):
    return 2.0 * x


def halved(x):
    return 0.5 * x


LAW = compile_law(f8(f8), "f(x) -> y", halved)
assert doubled(3.0) == 6.0
assert LAW.address
hits = sum(doubled.stats.cache_hits.values()), LAW._compiled.cache_hits
print(*hits)
'''


def hits(folder):
    """Whether kernel and law were found on disk by a new process."""
    done = subprocess.run([sys.executable, "-c", "import own_kernels"], cwd=folder, check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.split()


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "cut at the end": lambda content: content[:-1],
    "head alone": lambda content: content[:3],
    "empty": lambda content: b"",
    "zeros": lambda content: bytes(len(content)),
    "text": lambda content: b"hello",
}


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_code_is_compiled_again(tmp_path, stored, suffix, damage):
    # With times of files, by which stored code is known to be that of the source.
    folder = Path(shutil.copytree(stored, tmp_path / "copy"))
    other = folder / "__pycache__" / f"mine{suffix}"
    other.write_bytes(b"of somebody else")
    own = [path for path in other.parent.glob(f"*{suffix}") if path != other]
    assert len(own) == 2
    for path in own:
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
    assert hits(folder) == ["0", "0"]
    assert other.read_bytes() == b"of somebody else"


def test_whole_code_is_found_and_damaged_code_stored_anew(tmp_path, stored):
    folder = Path(shutil.copytree(stored, tmp_path / "copy"))
    assert hits(folder) == ["1", "1"]
    for path in (folder / "__pycache__").glob("*.nbc"):
        path.write_bytes(b"")
    assert hits(folder) == ["0", "0"]
    assert hits(folder) == ["1", "1"]


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = Path(tmp_path_factory.mktemp("kernels"))
    (folder / "own_kernels.py").write_text(MODULE)
    assert hits(folder) == ["0", "0"]
    assert hits(folder) == ["1", "1"]
    return folder


def test_code_that_cannot_be_stored_is_compiled_all_the_same(tmp_path):
    """Folders stand where numba would put its index: neither read nor written."""
    (tmp_path / "own_kernels.py").write_text(MODULE)
    assert hits(tmp_path) == ["0", "0"]
    assert hits(tmp_path) == ["1", "1"]
    for path in (tmp_path / "__pycache__").glob("*.nbi"):
        path.unlink()
        path.mkdir()
    assert hits(tmp_path) == ["0", "0"]


def test_compiled_code_is_known_by_all_sources_that_it_calls():
    """Else a changed law or helper would leave the code of kernels in other files as it was."""
    package = Path(fecontact.__file__).parent
    reached = compiled._imported(package / "system" / "kernels.py")
    assert {package / "laws" / "signatures.py", package / "core" / "compiled.py"} <= reached
