"""Annotations of records and compiled functions, and the types of numba that they stand for.

A record is a ``NamedTuple`` whose annotated fields are numbers, arrays and other records. Compiled
functions take records by reference and read fields by name, see :mod:`fecontact.core.references`.

>>> NODES = Size("nodes")
>>> class Springs(NamedTuple):
...     stiffness: Annotated[Array, NODES]
...     ends: Annotated[Integers, NODES, 2]
...     preload: float
>>> allocate(Springs, {NODES: 3}).ends.shape
(3, 2)
>>> numba_type(Springs)
Springs(array(float64, 1d, C), array(int64, 2d, C), float64)
"""

import math
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from operator import add, attrgetter, mul, sub
from types import NoneType
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin

import numpy as np
from numba import types
from numba.core.typing import Signature
from numba.extending import typeof_impl
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from fecontact.core.cache_lines import FEW, lines, zeros_in_lines
from fecontact.core.references import Reference, reference_to
from fecontact.core.simd.kinds import WIDTH, has_eight, lane_array, lanes
from fecontact.core.types import Array, ComplexArray, Integers

Record = TypeVar("Record", bound=tuple[Any, ...])

Flags = TypeAliasType("Flags", NDArray[np.bool_])
ShortIntegers = TypeAliasType("ShortIntegers", NDArray[np.int32])
# Arrays of eight numbers each, which are their last axis; without other axes eight numbers.
Eights = TypeAliasType("Eights", NDArray[np.float64])


@dataclass(frozen=True, repr=False)
class Size:
    """A length that the annotations of records name, or a sum or product of such.

    ``Annotated[Array, NODES, 2 * MODES]`` is an array with a row for each node, if NODES and MODES
    are sizes.
    """

    name: str
    _value: Callable[[Mapping["Size", int]], int] | None = None

    def __repr__(self) -> str:
        return self.name

    def of(self, sizes: Mapping["Size", int]) -> int | None:
        """Value of the size for known ``sizes``; None if it depends on one that is not known."""
        try:
            return sizes[self] if self._value is None else self._value(sizes)
        except KeyError:
            return None

    def _combined(self, other: "Size | int", sign: str, of: Callable[[int, int], int]) -> "Size":
        def value(sizes: Mapping[Size, int]) -> int:
            first, second = _length(self, sizes), _length(other, sizes)
            if first is None or second is None:
                raise KeyError
            return of(first, second)

        return Size(f"({self.name} {sign} {getattr(other, 'name', other)})", value)

    def __add__(self, other: "Size | int") -> "Size":
        return self._combined(other, "+", add)

    def __sub__(self, other: "Size | int") -> "Size":
        return self._combined(other, "-", sub)

    def __mul__(self, other: "Size | int") -> "Size":
        return self._combined(other, "*", mul)

    __radd__, __rmul__ = __add__, __mul__


# A length that is another in every record.
ANY = Size("any")

# Arrays in C order, by their number of axes.
Vector = Annotated[Array, ANY]
Matrix = Annotated[Array, ANY, ANY]
Block = Annotated[Array, ANY, ANY, ANY]
Array4 = Annotated[Array, ANY, ANY, ANY, ANY]
IntegerVector = Annotated[Integers, ANY]
IntegerMatrix = Annotated[Integers, ANY, ANY]
IntegerBlock = Annotated[Integers, ANY, ANY, ANY]
ShortVector = Annotated[ShortIntegers, ANY]
ShortBlock = Annotated[ShortIntegers, ANY, ANY, ANY]
FlagVector = Annotated[Flags, ANY]
ComplexVector = Annotated[ComplexArray, ANY]
ComplexMatrix = Annotated[ComplexArray, ANY, ANY]

_NUMBERS: dict[Any, Any] = {
    float: types.float64, int: types.int64, bool: types.boolean, complex: types.complex128,
    NoneType: types.void, None: types.void,
}
_ENTRIES: dict[Any, Any] = {
    Array: types.float64, Integers: types.int64, ComplexArray: types.complex128,
    Flags: types.boolean, ShortIntegers: types.int32, Eights: lanes,
}


def numba_type(annotation: Any) -> Any:
    """The type that numba gives to values of an annotation.

    Raises
    ------
    TypeError
        For an annotation that stands for no compiled type.
    """
    if isinstance(annotation, types.Type):
        return annotation
    if annotation in _NUMBERS:
        return _NUMBERS[annotation]
    if is_record(annotation):
        return _record_type(annotation)
    if get_origin(annotation) is Annotated:
        entries, axes = _entries_and_axes(annotation)
        kind = types.Array(_ENTRIES[entries], len(axes), "C")
        return lane_array(kind.ndim) if kind.dtype == lanes else kind
    if get_origin(annotation) is tuple:
        return types.BaseTuple.from_types([numba_type(item) for item in get_args(annotation)])
    raise TypeError(f"{annotation!r} stands for no type of compiled functions")


def _entries_and_axes(annotation: Any) -> tuple[Any, list[Any]]:
    """Entries of an annotated array, and the lengths of its axes."""
    entries, *axes = get_args(annotation)
    return entries, [axis for axis in axes if axis is not None]


@cache
def read_from_python(record: Any) -> None:
    """Let numba take records of Python for what their annotations say, whatever may be written to.

    Kernels must not write to read-only arrays that they are given.
    """
    typeof_impl.register(record, _typeof)


def _typeof(value: Any, context: Any) -> Any:
    return _declared(value, numba_type(type(value)), context)


def _declared(value: Any, kind: Any, context: Any) -> Any:
    """The type of a value of a record where ``kind`` is declared; None for what numba cannot read.

    Arrays may be written to.
    """
    if isinstance(kind, types.BaseNamedTuple) and isinstance(value, kind.instance_class):
        items = [_declared(item, inner, context) for item, inner in zip(value, kind, strict=True)]
        return None if None in items else types.BaseTuple.from_types(items, kind.instance_class)
    found = typeof_impl(value, context)
    if not isinstance(found, types.Array):
        return found
    found = found.copy(readonly=False)
    stored = types.Array(types.float64, found.ndim, "C")
    return kind if has_eight(kind) and found == stored and value.shape[-1] == WIDTH else found


def is_record(annotation: Any) -> bool:
    """Whether an annotation is a record."""
    return isinstance(annotation, type) and issubclass(annotation, tuple) and hasattr(
        annotation, "_fields")


@cache
def _fields(record: Any) -> dict[str, Any]:
    """Annotations by the names of the fields, in their order."""
    hints = typing.get_type_hints(record, include_extras=True)
    return {name: hints[name] for name in record._fields}


@cache
def _record_type(record: Any) -> Any:
    return types.BaseTuple.from_types(list(map(numba_type, _fields(record).values())), record)


def _length(axis: Size | int, sizes: Mapping[Size, int]) -> int | None:
    return axis.of(sizes) if isinstance(axis, Size) else axis


def allocate(record: type[Record], sizes: Mapping[Size, int], **given: Any) -> Record:
    """A record of zeros, arrays of these sizes, but for the fields that are ``given``.

    Raises
    ------
    TypeError
        If the length of an array that is not given is not among the sizes.
    """
    unknown = given.keys() - _fields(record).keys()
    if unknown:
        raise TypeError(f"{record.__name__} has no {', '.join(sorted(unknown))}")
    layout = _layout(record, frozenset(sizes.items()))
    room = zeros_in_lines(layout.length, np.uint8)
    return record(*(given[name] if name in given else make(room)
                    for name, make in layout.makers.items()))


class _Layout(NamedTuple):
    """Functions that make a record's fields, given room for its arrays; length of that [bytes]."""

    makers: Mapping[str, Callable[[Array], Any]]
    length: int


@cache
def _layout(record: Any, sizes: frozenset[tuple[Size, int]]) -> _Layout:
    known, length = dict(sizes), 0
    makers: dict[str, Callable[[Array], Any]] = {}
    for name, kind in _fields(record).items():
        if is_record(kind):
            makers[name] = partial(_within, kind, known)
        elif get_origin(kind) is not Annotated:
            makers[name] = partial(_zero, kind)
        else:
            entries, axes = _entries_and_axes(kind)
            lengths = [_length(axis, known) for axis in axes]
            shape = tuple(one for one in lengths if one is not None)
            if len(shape) < len(axes):
                makers[name] = partial(_refuse, f"the shape {axes} of {record.__name__}.{name} "
                                                f"does not follow from sizes")
                continue
            eight = entries is Eights
            stored = np.dtype(_ENTRIES[Array if eight else entries].name)
            if eight:
                shape = (*shape, WIDTH)
            size = math.prod(shape) * stored.itemsize
            if size <= FEW and not eight:
                makers[name] = partial(_zeros, shape, stored)
            else:
                makers[name] = partial(_part, shape, stored, length)
                length += lines(size)
    return _Layout(makers, length)


def _within(kind: Any, sizes: Mapping[Size, int], room: Array) -> Any:
    return allocate(kind, sizes)


def _zero(kind: Any, room: Array) -> Any:
    return kind()


def _zeros(shape: tuple[int, ...], stored: Any, room: Array) -> Array:
    return np.zeros(shape, stored)


def _part(shape: tuple[int, ...], stored: Any, first: int, room: Array) -> Array:
    return np.ndarray(shape, stored, room, first)


def _refuse(why: str, room: Array) -> None:
    raise TypeError(why)


def shapes(sizes: Mapping[Size, int], *records: Any) -> dict[Any, dict[str, Any]]:
    """Shapes of arrays by record and field; None for lengths that do not follow from ``sizes``.

    Records within the given ones are among them.
    """
    found: dict[Any, dict[str, Any]] = {}
    for record in records:
        own = found.setdefault(record, {})
        for name, kind in _fields(record).items():
            if is_record(kind):
                found |= shapes(sizes, kind)
            elif get_origin(kind) is Annotated:
                shape = tuple(_length(axis, sizes) for axis in _entries_and_axes(kind)[1])
                if any(length is not None for length in shape):
                    own[name] = shape
    return found


def signature_of(annotated: Any) -> Signature:
    """The signature of a function, or of a ``Callable[[...], ...]``, for numba.

    Functions get references to records with arrays.
    """
    if get_origin(annotated) is Callable:
        given, result = get_args(annotated)
    else:
        hints = typing.get_type_hints(annotated, include_extras=True)
        result = hints.pop("return")
        given = list(hints.values())
    arguments = [reference_to(kind) if isinstance(kind, types.BaseNamedTuple)
                 and holds_arrays(kind) else kind for kind in map(numba_type, given)]
    return Signature(numba_type(result), tuple(arguments), None)


def holds_arrays(kind: Any) -> bool:
    """Whether a type of numba is an array, or a tuple that has some."""
    return isinstance(kind, types.Array) or (
        isinstance(kind, types.BaseTuple) and any(map(holds_arrays, kind)))


@cache
def reader(record: Any, *entries: Any) -> Callable[[Any], tuple[Any, ...]]:
    """Function that returns the numbers, or arrays, of these ``entries`` of a record, in order.

    ``reader(record, float, Array)`` reads all numbers, those of records within it too. There must
    be two at least.
    """
    return attrgetter(*_names(record, entries))


def _names(record: Any, entries: tuple[Any, ...]) -> list[str]:
    """Dotted names of the fields of these entries."""
    found: list[str] = []
    for name, kind in _fields(record).items():
        if is_record(kind):
            found += [f"{name}.{inner}" for inner in _names(kind, entries)]
        elif (_entries_and_axes(kind)[0] if get_origin(kind) is Annotated else kind) in entries:
            found.append(name)
    return found


@cache
def of_eight(record: Any) -> Any:
    """The record whose numbers are eight each, of eight systems that share all integers.

    Fields have the names that they have in ``record``, so that functions which take one take the
    other.
    """
    fields = [(name, _eight(kind)) for name, kind in _fields(record).items()]
    return NamedTuple(f"Eight{record.__name__}", fields)


def _eight(kind: Any) -> Any:
    if is_record(kind):
        return of_eight(kind)
    if kind is float:
        return Annotated[Eights, None]
    if get_origin(kind) is Annotated and get_args(kind)[0] is Array:
        return Annotated[Eights, *get_args(kind)[1:]]
    return kind


def eight_type(kind: Any) -> Any:
    """The type of what is eight numbers where ``kind`` is one; integers stay what they are."""
    if isinstance(kind, Signature):
        return Signature(eight_type(kind.return_type), tuple(map(eight_type, kind.args)), None)
    if isinstance(kind, Reference):
        return reference_to(eight_type(kind.tuple_type))
    if isinstance(kind, types.BaseNamedTuple):
        return numba_type(of_eight(kind.instance_class)) if holds_arrays(
            kind) else types.BaseTuple.from_types(list(map(eight_type, kind)), kind.instance_class)
    if isinstance(kind, types.BaseTuple):
        return types.BaseTuple.from_types(list(map(eight_type, kind)))
    if isinstance(kind, types.Array) and kind.dtype == types.float64:
        return lane_array(kind.ndim, kind.layout)
    return lanes if kind == types.float64 else kind


def is_eight(kind: Any) -> bool:
    """Whether a type is that of eight numbers, of arrays of them or of a record with such."""
    if isinstance(kind, Reference):
        return is_eight(kind.tuple_type)
    return any(map(is_eight, kind)) if isinstance(kind, types.BaseTuple) else has_eight(kind)
