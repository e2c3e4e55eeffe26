"""Compiled code on disk: in the cache of this machine, and in the package ``fecontact-kernels``.

The package has the kernels of fecontact compiled for families of processors, so that nothing need
be compiled at first. Its code is found by the same marks of sources as that of the cache, and
used if versions agree and the processor has the features of the family.
"""

import hashlib
import inspect
import json
import os
import platform
import re
import warnings
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numba
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features, parse_assembly, parse_bitcode
from numba.core.caching import IndexDataCacheFile

from fecontact.core.errors import ModelWarning

# Families of processors, the newest first, and the features that older ones lack.
_V2 = ("cx16", "popcnt", "sahf", "sse3", "ssse3", "sse4.1", "sse4.2")
FAMILIES = {
    "x86-64-v3": (*_V2, "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"),
    "x86-64-v2": _V2,
    "arm64": (),
}
PACKAGE = "fecontact_kernels"
# Name of the file that says what code of a family was compiled with.
MADE_WITH = "made-with.json"
# Environment variables: compile for this very processor, and put compiled code into this folder.
NATIVE, FOLDER = "FECONTACT_NATIVE", "FECONTACT_KERNELS_FOLDER"


def own_families() -> list[str]:
    """Families of processors of the kind of this one, for which code can be compiled here."""
    arm = platform.machine().lower() in ("arm64", "aarch64")
    return [family for family in FAMILIES if (family == "arm64") == arm]


def serves(family: str) -> bool:
    """Whether this processor belongs to a family."""
    features = get_host_cpu_features()
    return family in own_families() and all(features.get(name) for name in FAMILIES[family])


def compiled_for(family: str) -> dict[str, str]:
    """Environment variables by which numba compiles for a family alone."""
    return {"NUMBA_CPU_NAME": "generic" if family == "arm64" else family, "NUMBA_CPU_FEATURES": ""}


class Prebuilt(NamedTuple):
    """Code of the package that serves this process: its folder, and numba's key of its target."""

    folder: Path
    target: tuple[str, ...]


def made_with() -> dict[str, Any]:
    """Versions that compiled code depends on."""
    from fecontact import __version__

    return {"fecontact": __version__, "numba": numba.__version__,
            "llvmlite": llvmlite.__version__}


@cache
def prebuilt() -> Prebuilt | None:
    """Code of the installed package for the newest family that this processor belongs to.

    None where ``FECONTACT_NATIVE`` is set, or ``NUMBA_CPU_NAME`` names another processor.
    """
    if any(os.environ.get(name) for name in (NATIVE, "NUMBA_CPU_NAME", FOLDER)):
        return None
    found = find_spec(PACKAGE)
    if found is None:
        return None
    for place in found.submodule_search_locations or ():
        for family in filter(serves, FAMILIES):
            file = Path(place, family, MADE_WITH)
            if not file.is_file():
                continue
            versions = json.loads(file.read_text(encoding="utf-8"))
            target = tuple(versions.pop("target"))
            if versions == made_with():
                return Prebuilt(file.parent, target)
    return None


class _StoredCode(IndexDataCacheFile):
    """Compiled code on disk, made anew where it cannot be read.

    Power cuts and full disks leave files that are cut short, and numba stops at them. Only such
    files of this very function are removed. Code that cannot be stored is compiled again by the
    next process. What the cache does not have is looked for in the package.
    """

    package: IndexDataCacheFile | None = None

    @property
    def _times(self) -> Path:
        return Path(self._index_path).with_suffix(".seconds")

    @property
    def seconds(self) -> float | None:
        """Seconds that compiling took last on this machine; None if that is not known."""
        try:
            return float(self._times.read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None

    @seconds.setter
    def seconds(self, seconds: float) -> None:
        with suppress(OSError):
            self._times.write_text(f"{seconds:.3f}", encoding="ascii")

    def load(self, key: Any) -> Any:
        """The code of a key, or None."""
        found = super().load(key)
        there = prebuilt()
        if found is not None or self.package is None or there is None:
            return found
        signature, target, *rest = key
        if target[0] != there.target[0]:
            return None
        with suppress(Exception):  # unpickling damaged files fails in every way there is
            return self.package.load((signature, there.target, *rest))
        return None

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except OSError:
            return {}
        except Exception:  # unpickling damaged files fails in every way there is
            _remove(self._index_path)
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except OSError:
            raise  # which numba takes as not stored
        except Exception as error:
            path = self._data_path(name)
            _remove(path)
            raise FileNotFoundError(path) from error

    def save(self, key: Any, data: Any) -> None:
        """Store code under a key, if that is possible: machine code, and the names in it.

        Numba would store what other functions could be linked with. Nothing is linked with what
        is loaded, and reading it takes ten times the memory of machine code.
        """
        (name, kind, (machine_code, source)), *others = data
        with suppress(OSError):
            super().save(key, ((name, kind, (machine_code, _names_alone(source))), *others))


def _names_alone(bitcode: bytes) -> bytes:
    """Bitcode with what is defined in some bitcode, and nothing in it."""
    module, byte = ir.Module(), ir.IntType(8)
    defined = parse_bitcode(bitcode)
    for each in defined.functions:
        if not each.is_declaration:
            made = ir.Function(module, ir.FunctionType(ir.VoidType(), ()), each.name)
            ir.IRBuilder(made.append_basic_block()).ret_void()
    for each in defined.global_variables:
        if not each.is_declaration:
            ir.GlobalVariable(module, byte, each.name).initializer = byte(0)
    return bytes(parse_assembly(str(module)).as_bitcode())


def _remove(path: str) -> None:
    with suppress(OSError):
        Path(path).unlink()


def seconds_to_compile(compiled: Any) -> float | None:
    """Seconds that compiling a kernel took last on this machine; None if that is not known."""
    stored = getattr(compiled._cache, "_cache_file", None)
    return stored.seconds if isinstance(stored, _StoredCode) else None


def note_seconds_to_compile(compiled: Any, seconds: float) -> None:
    """Keep beside the code of a kernel how long it took to compile."""
    stored = getattr(compiled._cache, "_cache_file", None)
    if isinstance(stored, _StoredCode):
        stored.seconds = seconds


def size_on_disk(kernels: Iterable[Any]) -> int:
    """Bytes of the stored code of kernels."""
    folders = {Path(kernel._cache.cache_path) for kernel in kernels}
    return sum(file.stat().st_size for folder in folders for file in folder.glob("*.nb[ci]"))


def keep_on_disk(
    compiled: Any, stamp: tuple[str, str], module: str, variant: str = "",
) -> None:
    """Store compiled code of a module in a file, keyed by a stamp of what it is made from.

    Where no file can be written, the code is compiled in memory, and a warning says so once.
    """
    try:
        compiled.enable_caching()
    except RuntimeError:  # numba's, for a source whose code has no folder
        _warn_of_compilation()
        return
    stored: Any = getattr(compiled, "_cache", None)
    if not isinstance(getattr(stored, "_cache_file", None), IndexDataCacheFile):
        return
    mark = f".{hashlib.sha256(variant.encode()).hexdigest()[:16]}" if variant else ""
    # Without the number of the line, which says nothing of what is compiled.
    name = re.sub(r"-\d+(?=\.py)", "", stored._impl.filename_base) + mark
    if inspect.getclosurevars(stored._py_func).nonlocals:
        # The sources of enclosed functions are in the digest; numba would compare the objects.
        stored._index_key = lambda signature, codegen: (signature, codegen.magic_tuple())
    package, _, below = module.partition(".")
    own = package == __name__.partition(".")[0]
    if own and (folder := os.environ.get(FOLDER)):
        stored._cache_path = str(Path(folder, *below.split(".")))
        Path(stored._cache_path).mkdir(parents=True, exist_ok=True)
    stored._cache_file = _StoredCode(stored._cache_path, name, stamp)
    if own and (there := prebuilt()) is not None:
        stored._cache_file.package = IndexDataCacheFile(
            str(there.folder.joinpath(*below.split("."))), name, stamp)


@cache
def _warn_of_compilation() -> None:
    """Warn that compiled code is lost with the process; repeated calls do nothing."""
    warnings.warn("Compiled code cannot be stored, so that every process compiles it anew, which "
                  "takes minutes; name a writable folder in the environment variable "
                  "NUMBA_CACHE_DIR.", ModelWarning, stacklevel=4)
