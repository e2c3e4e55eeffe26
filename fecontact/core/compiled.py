"""Compilation of kernels and laws by numba.

Laws reach a kernel as addresses of compiled functions. A kernel is then compiled once for all
laws, for this process and later ones, a call from a kernel costs a few nanoseconds, and calling
the kernel from Python spends no time on converting function objects.
"""

import dis
import gc
import hashlib
import inspect
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, cached_property, partial
from numbers import Number
from pathlib import Path
from types import CodeType
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numba import types
from numba.core import sigutils
from numba.core.ccallback import CFunc
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher

from fecontact.core.addresses import contract_signature
from fecontact.core.errors import InputError
from fecontact.core.kernel_parts import LawCompiler, PartCompiler, kernel_compiler, part
from fecontact.core.progress import said_if_slow
from fecontact.core.records import is_record, read_from_python, signature_of
from fecontact.core.stored_code import (
    keep_on_disk,
    note_seconds_to_compile,
    seconds_to_compile,
)

_FASTMATH = {"reassoc", "contract", "nsz", "arcp"}
_COMPILING = ("Compiling {}{}, once on this machine; 'fecontact compile --all' compiles everything "
              "ahead.")


@contextmanager
def _compiling() -> Iterator[None]:
    """Compile in one thread, and look for garbage rarely.

    Most of what numba makes stays, and going through it again takes a seventh of the time.
    """
    with global_compiler_lock:
        before = gc.get_threshold()
        gc.set_threshold(100_000, 10, 1000)
        try:
            yield
        finally:
            gc.set_threshold(*before)


def source_digest(function: Any) -> str:
    """Hash of all code and constants that a function is compiled from.

    It covers the functions that it calls, in whatever file they are, and the values of the
    globals that they name; comments, docstrings and times of files do not count. Numba by itself
    looks only at the file of the function.
    """
    marks: set[str] = set()
    seen: set[int] = set()
    ahead = [function]
    while ahead:
        item = ahead.pop()
        if id(item) not in seen:
            seen.add(id(item))
            mark, called = _own_digest(item)
            marks.add(mark)
            ahead += called
    return hashlib.sha256(" ".join(sorted(marks)).encode()).hexdigest()


@cache
def _own_digest(item: Any) -> tuple[str, tuple[Any, ...]]:
    """Hash of one function, compiled or plain, and the functions that it refers to."""
    called: list[Any] = []
    intrinsic_code = getattr(item, "_defn", None)
    function = intrinsic_code or getattr(item, "py_func", item)
    parts = [function.__module__, function.__qualname__,
             _written(getattr(item, "targetoptions", {}), called),
             _written(function.__defaults__, called)]
    names: set[str] = set()
    for code in _codes(function.__code__):
        names.update(code.co_names)
        # Names of variables and line numbers have no effect.
        parts.append(code.co_code.hex())
        parts += [_written(value, called) for value in code.co_consts
                  if not inspect.iscode(value) and value != function.__doc__]
        parts.append(" ".join(code.co_names))
    known = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        with suppress(ValueError):  # a cell that is not filled yet
            known[name] = cell.cell_contents
    for name, value in sorted(known.items()):
        parts.append(f"{name} = {_written(value, called)}")
        if inspect.ismodule(value) and not _is_library(value.__name__):
            parts += [f"{name}.{inner} = {_written(vars(value)[inner], called)}"
                      for inner in sorted(names & vars(value).keys())]
    if intrinsic_code is not None:
        # Overloads and data models beside an intrinsic are at work without being named.
        parts.append(hashlib.sha256(Path(inspect.getfile(function)).read_bytes()).hexdigest())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest(), tuple(called)


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object and those of the functions within."""
    yield code
    for value in code.co_consts:
        if inspect.iscode(value):
            yield from _codes(value)


def _written(value: Any, called: list[Any]) -> str:
    """A value as a text that is the same in every process; functions go to ``called``."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, Mapping):
        return str(sorted(f"{key}: {_written(item, called)}" for key, item in value.items()))
    if isinstance(value, tuple | list):
        return str([_written(item, called) for item in value])
    if isinstance(value, set | frozenset):
        return str(sorted(_written(item, called) for item in value))
    if isinstance(value, types.Type | Number | str | bytes | None):
        return f"{type(value).__name__} {value!s}"
    function = getattr(value, "_defn", None) or getattr(value, "py_func", value)
    name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', '')}"
    if inspect.isfunction(function) and not _is_library(name):
        called.append(value)
    return f"{type(value).__name__} {name}"


def _is_library(name: str) -> bool:
    """Whether a module is one whose code changes with its version alone, which numba sees."""
    return name.partition(".")[0] in ("builtins", "cmath", "llvmlite", "math", "numba", "numpy",
                                      "operator")


class _Kernel(CPUDispatcher):
    """A function for Python, compiled for one signature when it is first called.

    Compiled functions that call it get the function itself as a part of theirs, see
    :func:`borrowing`, with references to records.
    """

    given: Any = None
    by_address = False
    options: Any = None

    @cached_property
    def signature(self) -> Any:
        """Arguments and result, as numba's types."""
        return self.given or signature_of(self.py_func)

    def for_values(self, constants: str) -> Any:
        """The kernel for records with values of :func:`fecontact.core.constants.constants`."""
        return kernel(self.py_func, constants=constants, signature=self.given,
                      by_address=self.by_address, **self.options)

    @property
    def _numba_type_(self) -> Any:
        return types.Dispatcher(self._inner)

    @cached_property
    def _inner(self) -> Any:
        return borrowing(self.py_func)

    def ready(self) -> Any:
        """Itself, compiled."""
        with _compiling():
            if not self.overloads:
                begin, last = time.perf_counter(), seconds_to_compile(self)
                about = "" if last is None else f", about {math.ceil(last)} s"
                name = f"{self.__module__}.{self.__name__}".removeprefix("fecontact.")
                # Code that is on disk is no miss.
                with said_if_slow(_COMPILING.format(name, about),
                                  lambda: bool(self._cache_misses)):
                    self.compile(self.signature)
                if self._cache_misses:
                    note_seconds_to_compile(self, time.perf_counter() - begin)
                self.disable_compile()
        return self

    @property
    def address(self) -> int:
        """Address of the compiled function, which takes arguments as compiled code gives them."""
        found = self.ready().overloads[self.signature.args]
        return int(found.library.get_pointer_to_function(found.fndesc.llvm_cfunc_wrapper_name))

    def _compile_for_args(self, *arguments: Any, **by_name: Any) -> Any:
        # Called before it is compiled only, and called again with what is returned.
        return self.ready()


# All kernels of the modules that have been imported.
KERNELS: list[_Kernel] = []


def kernel(
    function: Callable[..., Any] | None = None, *, signature: Any = None, by_address: bool = False,
    constants: str = "", **options: Any,
) -> Any:
    """Compile a function for the types of its annotations, at its first call; kept on disk.

    Records and arrays belong to the caller; the function only has references to them. Sums may be
    reordered, which lets them vectorise, but NaN and infinity keep their meaning. The stored code
    is renewed when the function changes, or anything that it is compiled from, see
    :func:`source_digest`. With ``constants`` of :func:`fecontact.core.constants.constants` the code
    is valid only for records with these values. ``signature`` gives types that annotations cannot
    express. A kernel ``by_address`` gets references from compiled functions, and has no entry for
    Python.
    """
    if function is None:
        return partial(kernel, signature=signature, by_address=by_address, constants=constants,
                       **options)
    function = getattr(function, "py_func", function)
    settings: dict[str, Any] = {
        "nopython": True, "boundscheck": None, "error_model": "numpy", "fastmath": _FASTMATH,
        "no_cpython_wrapper": by_address, "no_cfunc_wrapper": not by_address, **options,
    }
    for annotation in function.__annotations__.values():
        if is_record(annotation):
            read_from_python(annotation)
    made = _Kernel(function, targetoptions=settings, pipeline_class=kernel_compiler(constants))
    made.given, made.by_address, made.options = signature, by_address, options
    keep_on_disk(made, (source_digest(made), ""), function.__module__, constants)
    KERNELS.append(made)
    return made


_HELPER: dict[str, Any] = {"error_model": "numpy", "fastmath": _FASTMATH, "forceinline": True}
# Options of numba's overloads that become part of kernels as helpers do.
OVERLOAD: dict[str, Any] = {**_HELPER, "no_cfunc_wrapper": True, "pipeline_class": PartCompiler}


def helper(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels share, and that becomes part of each of them."""
    return part(function, **_HELPER)


def routine(function: Callable[..., Any]) -> Any:
    """Compile a long function that kernels share: called instead of copied, optimised alone."""
    # Explicit, because the caller that is compiled first would otherwise set these options.
    return part(function, error_model="numpy", fastmath=_FASTMATH, forceinline=False)


def borrowing(function: Callable[..., Any]) -> Any:
    """Compile like :func:`routine`, without counting references to the arrays that are passed in.

    The function must not return any of these arrays.
    """
    return part(function, borrows=True, error_model="numpy", fastmath=_FASTMATH, forceinline=False)


@dataclass(frozen=True, eq=False)
class CompiledLaw:
    """A scalar function that kernels call by its address; compiled when that is asked for.

    Attributes
    ----------
    python : callable
        The function as written, for other compilers and for tests.
    form : str
        Arguments and results of the function, for messages.
    signature : Signature
        Its arguments and results, as numba's types.
    """

    python: Callable[..., Any]
    form: str
    signature: Any

    @property
    def address(self) -> int:
        """Address of the compiled function; valid as long as this object lives.

        Raises
        ------
        InputError
            If the function takes or returns something else than its form says, uses what cannot
            be compiled, or raises exceptions.
        """
        address = int(self._compiled.address)
        _LAWS[address] = self
        return address

    @cached_property
    def _compiled(self) -> Any:
        function = self.python
        raising = _raising(function)
        if raising is not None:
            raise InputError(f"The law {function.__name__}({_arguments(function)}) has a raise or "
                             f"assert statement{raising}, which a compiled law cannot have; check "
                             f"parameters in __post_init__ of the law's class, and return a "
                             f"finite value everywhere.")
        law = CFunc(function, sigutils.normalize_signature(self.signature), {},
                    {"error_model": "numpy"}, LawCompiler)
        # Functions typed into a console have no file beside which they could be stored.
        if Path(inspect.getfile(function)).is_file():
            keep_on_disk(law, (source_digest(function), function.__module__), function.__module__)
        try:
            with _compiling():
                law.compile()
        except (NumbaError, TypeError) as error:
            lines = [line.strip() for line in str(error).splitlines() if line.strip()]
            raise InputError(f"The law {function.__name__}({_arguments(function)}) is not one of "
                             f"the form {self.form}: "
                             f"{lines[1] if len(lines) > 1 else lines[0]}") from None
        return law


# Compiled laws by their addresses.
_LAWS: WeakValueDictionary[int, CompiledLaw] = WeakValueDictionary()


def law_at(address: int) -> CompiledLaw:
    """The law whose function has an address."""
    return _LAWS[address]


def compile_law(contract: Any, form: str, function: Callable[..., Any]) -> CompiledLaw:
    """A law of the types of ``contract``, a ``Callable[...]``; ``form`` is that for people."""
    return CompiledLaw(function, form, contract_signature(contract))


def _arguments(function: Callable[..., Any]) -> str:
    return ", ".join(inspect.signature(function).parameters)


def _raising(function: Callable[..., Any], seen: set[Any] | None = None) -> str | None:
    """Name the function that raises: "" for itself, " in NAME" for one it calls, None for none.

    Behind an address exceptions are printed and lost, and the function returns zeros. ``seen``
    are functions that need no second look; an attribute may have the name of one of them.
    """
    seen = set() if seen is None else seen
    seen.add(function)
    if any(step.opname == "RAISE_VARARGS" for step in dis.get_instructions(function)):
        return ""
    for name, value in inspect.getclosurevars(function).globals.items():
        called = getattr(value, "py_func", None)
        if called is not None and called not in seen and _raising(called, seen) is not None:
            return f" in {name}"
    return None
