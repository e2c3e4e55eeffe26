"""Read-only arrays of results: NumPy raises ValueError where they are written to."""

from collections.abc import Callable
from copy import copy
from functools import cached_property, wraps
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

_Owner = TypeVar("_Owner", bound=type)
_PLAIN = (int, float, bool, str)
# Types of values that hold no array.
_WITHOUT_ARRAYS = frozenset({*_PLAIN, type(None), np.float64, np.bool_})


def read_only(value: Any) -> Any:
    """Return a read-only view of an array; in tuples, lists and mappings, of each array.

    A sparse matrix by rows, columns or blocks is returned with sorted indices, since SciPy sorts
    them in place. The array itself stays writeable, so that one given by a user is not frozen.
    """
    if type(value) in _WITHOUT_ARRAYS:
        return value
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            return value
        view = value.view()
        view.flags.writeable = False
        return view
    if isinstance(value, str | int | float):
        return value
    if type(value) in (dict, MappingProxyType):
        frozen, changed = {}, False
        for name, item in value.items():
            frozen[name] = read_only(item)
            changed = changed or frozen[name] is not item
        return type(value)(frozen) if changed else value
    if isinstance(value, tuple | list):
        items = [read_only(item) for item in value]
        if all(new is old for new, old in zip(items, value, strict=True)):
            return value
        return value._make(items) if hasattr(value, "_make") else type(value)(items)
    if type(value).__module__.startswith("scipy.sparse") and hasattr(value, "indptr"):
        return _read_only_sparse(value)
    return value


def _read_only_sparse(matrix: Any) -> Any:
    parts = ("data", "indices", "indptr")
    if not any(getattr(matrix, part).flags.writeable for part in parts):
        return matrix
    matrix = copy(matrix) if matrix.has_sorted_indices else matrix.sorted_indices()
    for part in parts:
        setattr(matrix, part, read_only(getattr(matrix, part)))
    return matrix


def read_only_arrays(owner: _Owner) -> _Owner:
    """Decorate a class so that the arrays of its objects are read-only.

    This covers fields, public properties and cached properties, also after copying and unpickling.
    Methods return new arrays, which stay writeable. Place the decorator above ``@dataclass``.
    """
    for name, member in list(vars(owner).items()):
        if name.startswith("_"):
            continue
        if isinstance(member, cached_property):
            member.func = _returning_read_only(member.func)
        elif (isinstance(member, property) and member.fget is not None
              and _may_hold_arrays(member.fget)):
            setattr(owner, name, property(_returning_read_only(member.fget), member.fset,
                                          member.fdel, member.__doc__))
    if "__init__" in vars(owner):
        made, restored = vars(owner)["__init__"], getattr(owner, "__setstate__", _set_state)
        for name, function in (("__init__", made), ("__setstate__", restored)):
            setattr(owner, name, _freezing(function))
    return owner


def _may_hold_arrays(function: Callable[..., Any]) -> bool:
    """Whether a property is not declared as a number or a text, which are read often."""
    return function.__annotations__.get("return") not in _PLAIN


def _returning_read_only(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    @wraps(function)
    def returned(self: Any) -> Any:
        return read_only(function(self))

    return returned


def _freezing(function: Callable[..., None]) -> Callable[..., None]:
    """Let a function that fills an object end with read-only arrays in it."""

    @wraps(function)
    def filled(self: Any, *args: Any, **kwargs: Any) -> None:
        function(self, *args, **kwargs)
        known = vars(self)
        for name, value in known.items():
            known[name] = read_only(value)

    return filled


def _set_state(self: Any, state: dict[str, Any]) -> None:
    vars(self).update(state)
