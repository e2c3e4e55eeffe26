"""Annotations of records and compiled functions, and the types of numba that they stand for.

A record is a ``NamedTuple`` whose annotated fields are numbers, arrays and other records. Compiled
functions take records by reference and read fields by name, see :mod:`fecontact.core.references`.

>>> class Spring(NamedTuple):
...     stiffness: float
...     ends: Vector
>>> numba_type(Spring)
Spring(float64, array(float64, 1d, C))
>>> signature_of(Callable[[Spring, float], float])
(Reference(Spring, ...), float64) -> float64
"""

import typing
from collections.abc import Callable
from functools import cache
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

import numpy as np
from numba import types
from numba.core.typing import Signature
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from fecontact.core.references import Reference
from fecontact.core.types import Array, ComplexArray, Integers

Flags = TypeAliasType("Flags", NDArray[np.bool_])
ShortIntegers = TypeAliasType("ShortIntegers", NDArray[np.int32])

# Arrays in C order, by their number of axes.
Vector = Annotated[Array, 1]
Matrix = Annotated[Array, 2]
Block = Annotated[Array, 3]
Array4 = Annotated[Array, 4]
IntegerVector = Annotated[Integers, 1]
IntegerMatrix = Annotated[Integers, 2]
IntegerBlock = Annotated[Integers, 3]
ShortVector = Annotated[ShortIntegers, 1]
ShortBlock = Annotated[ShortIntegers, 3]
FlagVector = Annotated[Flags, 1]
ComplexVector = Annotated[ComplexArray, 1]
ComplexMatrix = Annotated[ComplexArray, 2]

_NUMBERS: dict[Any, Any] = {
    float: types.float64, int: types.int64, bool: types.boolean, complex: types.complex128,
    NoneType: types.void, None: types.void,
}
_ENTRIES: dict[Any, Any] = {
    Array: types.float64, Integers: types.int64, ComplexArray: types.complex128,
    Flags: types.boolean, ShortIntegers: types.int32,
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
        entries, axes = get_args(annotation)
        return types.Array(_ENTRIES[entries], axes, "C")
    if get_origin(annotation) is tuple:
        return types.BaseTuple.from_types([numba_type(item) for item in get_args(annotation)])
    raise TypeError(f"{annotation!r} stands for no type of compiled functions")


def is_record(annotation: Any) -> bool:
    """Whether an annotation is a record."""
    return isinstance(annotation, type) and issubclass(annotation, tuple) and hasattr(
        annotation, "_fields")


@cache
def _record_type(record: Any) -> Any:
    hints = typing.get_type_hints(record, include_extras=True)
    return types.BaseTuple.from_types([numba_type(hints[name]) for name in record._fields], record)


def signature_of(annotated: Any, *, by_reference: bool = True) -> Signature:
    """The signature of a function, or of a ``Callable[[...], ...]``, for numba.

    Functions that compiled code calls by their address get references to records with arrays.
    Those that Python calls get the records themselves.
    """
    if get_origin(annotated) is Callable:
        given, result = get_args(annotated)
    else:
        hints = typing.get_type_hints(annotated, include_extras=True)
        result = hints.pop("return")
        given = list(hints.values())
    arguments = [numba_type(item) for item in given]
    if by_reference:
        arguments = [Reference(kind) if isinstance(kind, types.BaseNamedTuple)
                     and holds_arrays(kind) else kind for kind in arguments]
    return Signature(numba_type(result), tuple(arguments), None)


def holds_arrays(kind: Any) -> bool:
    """Whether a type of numba is an array, or a tuple that has some."""
    return isinstance(kind, types.Array) or (
        isinstance(kind, types.BaseTuple) and any(map(holds_arrays, kind)))
