"""Marks that tell computations apart: of numbers, arrays, and all that functions and objects hold.

A function is its code with what that names: defaults, closure, globals, attributes of modules. An
object is its class with the code of all its methods, and what pickle would keep of it. Libraries
count by their names alone.
"""

import functools
import hashlib
import inspect
import sys
import types
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from numbers import Integral, Real
from typing import Any

import numpy as np

from fecontact import __version__
from fecontact.bifurcation.fields.parametrised_system import ParametrisedSystem
from fecontact.core.compiled import CompiledLaw, source_digest
from fecontact.core.errors import InputError, shown
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.function_field import FunctionField
from fecontact.system.fields.in_time import Moving, state_size
from fecontact.system.fields.vector_field import VectorField

# Objects that a mark looks at, at most.
_MOST = 100_000
# Their code changes with the version of this package or of Python, or is taken to stay.
_LIBRARIES = frozenset({*sys.stdlib_module_names, "fecontact", "numpy", "scipy", "numba",
                        "llvmlite"}) - {"__main__"}
# The flag of classes that are not compiled into Python.
_HEAP = 1 << 9
# Descriptors that classes hold besides their code and values.
_SLOTS = (types.MemberDescriptorType, types.GetSetDescriptorType, types.WrapperDescriptorType,
          types.MethodDescriptorType, types.ClassMethodDescriptorType)


def mark_of(systems: Iterable[Moving], *settings: Any) -> str:
    """A mark that tells computations of other systems or settings apart.

    Numbers, arrays, functions and objects of the user are marked in full, with all that they call
    and hold: none by its name or a summary.

    Raises
    ------
    InputError
        For an object of a field, or of a function, that cannot be looked into.
    """
    marker = _Marker()
    parts = [marker.of(item) for item in (__version__, settings)]
    for moving in systems:
        facts = _of_system(moving) if isinstance(moving, ContactSystem) else _of_field(moving)
        parts.append(marker.of(facts))
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


def _of_system(system: ContactSystem) -> list[Any]:
    """Data on which the motion of a contact system depends."""
    facts: list[Any] = sorted(system.parameters().items())
    for kind in ("normal", "friction"):
        for nodes, share, law in system.law_groups(kind):
            facts += [kind, nodes.start, nodes.stop, type(law).__qualname__, law.table(share),
                      law.kernel, getattr(law, "planar_kernel", None)]
    facts += [one.kernel for one in (*system.drive.motions, *system.load.signals.values())]
    ground = system.ground
    facts += [ground.profile_kernel, ground.surface_kernel, ground.friction_scale_kernel]
    facts += [one.motion_kernel for one in system.prescribed_motion.motions]
    # Other integers are addresses of functions, and differ from process to process.
    return facts + [item for name, item in system.arrays._asdict().items()
                    if np.asarray(item).dtype.kind == "f"
                    or name in ("memory", "on_ground", "follows_surface")]


def _of_field(field: VectorField) -> list[Any]:
    """Data on which the motion of a field depends, and some of its rates."""
    whole = list(field.functions) if isinstance(field, FunctionField) else [field]
    # Effects of code in libraries show in the rates alone.
    places = np.random.default_rng(0).normal(size=(3, state_size(field)))
    scales = field.state_scales(field.values)
    rates = field.rates(np.array([0.0, 0.1, 0.2]), places * scales, field.values)
    return [field.state_names, list(field.parameters.items()), scales,
            field.forcing_period(field.values), [f"{rate:.9e}" for rate in rates.ravel()], *whole]


class _Marker:
    """Digests of values, each computed once."""

    def __init__(self) -> None:
        self._known: dict[int, bytes] = {}
        self._kept: list[Any] = []  # whose addresses are in use
        self._above: list[int] = []

    def of(self, value: Any) -> bytes:
        """Bytes that no other value has, the same in every process."""
        simple = _simple(value)
        if simple is not None:
            return _digest(simple)
        place = id(value)
        if place in self._known:
            return self._known[place]
        if place in self._above:
            # A circle, closed so many objects up.
            return _digest([f"circle {len(self._above) - self._above.index(place)}".encode()])
        if len(self._known) >= _MOST:
            raise _refused(value, f"it is one of more than {_MOST} objects")
        self._above.append(place)
        try:
            found = _digest(self._parts(value))
        except RecursionError:
            raise _refused(value, "objects hold each other without end") from None
        finally:
            self._above.pop()
        self._known[place] = found
        self._kept.append(value)
        return found

    def _parts(self, value: Any) -> Iterator[bytes]:
        if isinstance(value, CompiledLaw):
            yield source_digest(value.python).encode()
        elif callable(getattr(value, "py_func", None)):
            yield self.of(value.py_func)
        elif inspect.isfunction(value):
            yield from self._of_function(value)
        elif inspect.ismethod(value):
            yield from map(self.of, ("method", value.__func__, value.__self__))
        elif isinstance(value, functools.partial):
            yield from map(self.of, ("partial", value.func, value.args, value.keywords))
        elif isinstance(value, staticmethod | classmethod):
            yield from map(self.of, (type(value).__name__, value.__func__))
        elif isinstance(value, property):
            yield from map(self.of, ("property", value.fget, value.fset))
        elif isinstance(value, functools.cached_property):
            yield from map(self.of, ("property", value.func, None))
        elif inspect.isbuiltin(value):
            holder = value.__self__
            yield from map(self.of, (value.__qualname__, getattr(value, "__module__", None), None
                                     if inspect.ismodule(holder) else holder))
        elif isinstance(value, ParametrisedSystem):
            # Systems made of these are left out: they hold addresses, and grow with use.
            yield from map(self.of, ("systems", value.base, value.parameters, value.setters))
        elif isinstance(value, type):
            yield from self._of_class(value)
        elif inspect.ismodule(value):
            yield self.of(f"module {value.__name__}")
        elif isinstance(value, Mapping):
            yield self.of(list(value.items()))
        elif isinstance(value, set | frozenset):
            yield from (b"set", *sorted(map(self.of, value)))
        elif isinstance(value, list | tuple | np.ndarray):
            yield from (f"list {len(value)}".encode(), *map(self.of, list(value)))
        else:
            yield from self._of_object(value)

    def _of_function(self, function: Any) -> Iterator[bytes]:
        """Its code, and what that names."""
        yield self.of(f"{function.__module__}.{function.__qualname__}")
        yield self.of([function.__defaults__, function.__kwdefaults__])
        # A library may wrap a function of the user.
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (),
                              strict=True):
            try:
                yield self.of([name, cell.cell_contents])
            except ValueError:
                yield self.of([name])  # a cell that is not filled
        # Functions of "builtins" are not of Python: such a one is made without a module.
        if function.__module__ not in (None, "builtins") and _is_library(function.__module__):
            return
        codes = list(_codes(function.__code__))
        names = {name for code in codes for name in code.co_names}
        for code in codes:
            # Names of variables and line numbers have no effect.
            yield self.of([code.co_code, list(code.co_names), [
                item for item in code.co_consts
                if not inspect.iscode(item) and item != function.__doc__]])
        yield from self._named(function.__globals__, names)

    def _named(self, known: Mapping[str, Any], names: set[str]) -> Iterator[bytes]:
        """Values of names, and of the same names in modules among them."""
        for name in sorted(names & known.keys()):
            value = known[name]
            yield self.of([name, value])
            if inspect.ismodule(value) and not _is_library(value.__name__) and (
                    id(value) not in self._above):
                self._above.append(id(value))
                yield from self._named(vars(value), names)
                self._above.pop()

    def _of_class(self, kind: type) -> Iterator[bytes]:
        """Its code and values, and those of the classes above."""
        yield self.of(f"{kind.__module__}.{kind.__qualname__}")
        made_at_run_time = bool(kind.__flags__ & _HEAP)
        if _is_library(kind.__module__) and not (kind.__module__ == "builtins"
                                                 and made_at_run_time):
            return
        for name, value in sorted(vars(kind).items()):
            special = name.startswith("__") and name.endswith("__")
            if not ((special and not inspect.isfunction(value)) or name == "_abc_impl"
                    or isinstance(value, _SLOTS)):
                yield self.of([name, value])
        yield self.of(kind.__bases__)

    def _of_object(self, value: Any) -> Iterator[bytes]:
        """Its class, and what pickle would keep of it."""
        yield self.of(type(value))
        if is_dataclass(value):
            yield self.of([(one.name, getattr(value, one.name)) for one in fields(value)])
            return
        if hasattr(value, "__wrapped__"):
            # The cache of a function, not what it has kept.
            yield self.of(value.__wrapped__)
            return
        try:
            kept = value.__reduce_ex__(4)
        except Exception as error:  # of objects of any library
            raise _refused(value, str(error).rstrip(".") or type(error).__name__) from error
        if isinstance(kept, str):
            yield self.of(kept)
            return
        # Cached properties are there only after use.
        state = [{name: item for name, item in one.items() if not isinstance(
            inspect.getattr_static(type(value), name, None), functools.cached_property)}
                 if isinstance(one, dict) else one for one in kept[2:3]]
        # The last three are iterators over items, and a way to set the state.
        yield from map(self.of, (*kept[:2], *state, *(list(one or ()) for one in kept[3:5]),
                                 *kept[5:]))


def _simple(value: Any) -> list[bytes] | None:
    """A number, a text or an array of numbers as bytes; None for others."""
    if isinstance(value, np.ndarray) and value.dtype.kind not in "OV":
        return [f"{value.dtype.str} {value.shape}".encode(), value.tobytes()]
    if isinstance(value, str | bytes | bool | np.bool | None | types.EllipsisType):
        return [repr(value).encode()]
    if isinstance(value, Integral):
        return [str(int(value)).encode()]
    if isinstance(value, Real):
        return [float(value).hex().encode()]
    if isinstance(value, complex | np.dtype | slice | range):
        return [repr(value).encode()]
    return None


def _digest(parts: Iterable[bytes]) -> bytes:
    mark = hashlib.sha256()
    for part in parts:
        mark.update(len(part).to_bytes(8, "little") + part)
    return mark.digest()


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """A code object and those of the functions within."""
    yield code
    for value in code.co_consts:
        if inspect.iscode(value):
            yield from _codes(value)


def _is_library(name: str) -> bool:
    """Whether a module is one whose code is not looked at."""
    return name.partition(".")[0] in _LIBRARIES


def _refused(value: Any, why: str) -> InputError:
    return InputError(f"A folder of runs needs to know all that a field or function uses, but "
                      f"{shown(value)} cannot be looked into ({why}); leave out the folder, or "
                      f"let it use numbers, arrays, functions and objects of them.")
