"""Parameters of nested dataclasses by dotted names: ``ground.profile.amplitude``."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any


def parameters_of(whole: Any, prefix: str = "") -> dict[str, Any]:
    """Every value below a dataclass, a mapping or a tuple of dataclasses, by its dotted name.

    Parts that are None are left out.
    """
    result: dict[str, Any] = {}
    for name, value in _members(whole).items():
        title = f"{prefix}{name}"
        if _members(value):
            result |= parameters_of(value, f"{title}.")
        elif value is not None and not (isinstance(value, tuple) and not value):
            result[title] = value
    return result


def flattened(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values of nested tables by dotted names."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= flattened(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


def with_parameters(whole: Any, changes: Mapping[str, Any]) -> Any:
    """Copy with some values or parts replaced, by their dotted names.

    Raises
    ------
    KeyError
        Names the dotted name that does not exist.
    """
    members = _members(whole)
    direct: dict[str, Any] = {}
    below: dict[str, dict[str, Any]] = {}
    for name, value in changes.items():
        first, dot, rest = name.partition(".")
        if first not in members:
            raise KeyError(name)
        if dot:
            below.setdefault(first, {})[rest] = value
        else:
            direct[first] = value
    for first, inner in below.items():
        try:
            direct[first] = with_parameters(direct.get(first, members[first]), inner)
        except KeyError as error:
            raise KeyError(f"{first}.{error.args[0]}") from None
    if is_dataclass(whole) and not isinstance(whole, type):
        return replace(whole, **direct)
    if isinstance(whole, Mapping):
        return MappingProxyType({**whole, **direct})
    return tuple(direct.get(str(index), item) for index, item in enumerate(whole))


@cache
def _names(kind: Any) -> tuple[str, ...]:
    """Names of the arguments of a dataclass."""
    return tuple(entry.name for entry in fields(kind) if entry.init)


def _members(whole: Any) -> dict[str, Any]:
    if is_dataclass(whole) and not isinstance(whole, type):
        return {name: getattr(whole, name) for name in _names(type(whole))}
    if isinstance(whole, Mapping):
        return dict(whole)
    if isinstance(whole, tuple) and whole and all(is_dataclass(item) for item in whole):
        return {str(index): item for index, item in enumerate(whole)}
    return {}
