"""Tables of keys and values (TOML, HDF5) as dataclasses, and back."""

import json
import re
import sys
import tomllib
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from numbers import Integral, Real
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from fecontact.core.errors import FecontactError, InputError, choices, nearest

T = TypeVar("T")

_COMMA = re.compile(r"([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)")  # a number with a decimal comma
_COUNTS = {2: "two", 3: "three", 4: "four", 6: "six"}


@dataclass(frozen=True)
class Kinds:
    """Base classes whose subclasses are selected in tables by the key ``law``.

    Attributes
    ----------
    is_kind : function
        Whether a type is one of these classes.
    law_class : function
        The subclass of such a class by its name, which may be None; the last argument names the
        place in the file, for messages.
    name_of : function
        The name of an instance of a subclass; None for a default and for all other instances.
    default : function
        The name of the subclass that such a class stands for without a name, or None.
    """

    is_kind: Callable[[Any], bool]
    law_class: Callable[[type, Any, str], type]
    name_of: Callable[[Any], str | None]
    default: Callable[[type], str | None]


_kinds = Kinds(lambda hint: False, lambda kind, name, where: kind, lambda instance: None,
               lambda kind: None)


def register_kinds(kinds: Kinds) -> None:
    """Register the classes that tables refer to by name."""
    global _kinds
    _kinds = kinds


_DEEPEST = 30  # nesting depth; studies need less than ten


def parsed(text: str, title: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    InputError
        If it is not valid TOML, or nested too deeply.
    """
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError as error:
        meant = re.search(rf"^[^#=\n]*=\s*{_COMMA.pattern}\s*(?:#.*)?$", text, re.MULTILINE)
        hint = f"; write {meant[1]}.{meant[2]} with a decimal point" if meant else ""
        raise InputError(f"{title} is not valid TOML: {error}{hint}.") from None
    except RecursionError:
        raise _too_deep(title) from None
    except ValueError:  # Python refuses integers of thousands of digits
        raise InputError(f"{title} holds a whole number of more than "
                         f"{sys.get_int_max_str_digits()} digits; write it as 1e300, and not "
                         f"above 1.8e308.") from None


def require_readable(tables: Any, title: str) -> None:
    """Refuse tables nested too deeply, keys that are not strings, and null characters.

    Raises
    ------
    InputError
        Naming the key.
    """
    ahead: list[tuple[str, Any, int]] = [("", tables, 0)]
    while ahead:
        name, value, depth = ahead.pop()
        if depth > _DEEPEST:
            raise _too_deep(title)
        if isinstance(value, Mapping):
            for key, item in value.items():
                if not isinstance(key, str):
                    raise InputError(f"{title}: the key {key!r} must be a text.")
                _require_no_zero(key, f"a key{f' of {name}' if name else ''}", title)
                ahead.append((f"{name}.{key}" if name else key, item, depth + 1))
        elif isinstance(value, list | tuple):
            ahead += [(name, item, depth + 1) for item in value]
        elif isinstance(value, str):
            _require_no_zero(value, name, title)


def _require_no_zero(text: str, name: str, title: str) -> None:
    if "\0" in text:
        raise InputError(f"{title}: {name} = {shown(text)} holds the zero character \\u0000, which "
                         f"no name and no text may have; remove it.")


def _too_deep(title: str) -> InputError:
    return InputError(f"{title} has tables or lists nested more than {_DEEPEST} levels deep; "
                      f"studies need less than ten.")


def from_table(cls: type[T], table: Any, where: str) -> T:
    """An instance of a dataclass from a table whose keys are its fields.

    Parameters
    ----------
    cls : type
        A dataclass; fields that are dataclasses take sub-tables. A kind of law: the key ``law``
        names the law.
    table : mapping
        Keys and values; keys with defaults may be missing. Whole numbers serve as floats, lists
        as tuples.
    where : str
        Name of the table in messages: ``study.toml: [ground]``.

    Raises
    ------
    InputError
        For an unknown key (with the nearest valid one), a value of the wrong type or out of
        range, or a missing key.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table of keys and values, not {shown(table)}.")
    if _kinds.is_kind(cls):
        name = table.get("law")
        chosen = _kinds.law_class(cls, name, where)
        parameters = {key: value for key, value in table.items() if key != "law"}
        return cast(T, _from_table(chosen, parameters, where, name or _kinds.default(cls) or ""))
    return _from_table(cls, table, where)


def _from_table(cls: type[T], table: Mapping[str, Any], where: str, law: str = "") -> T:
    """Body of :func:`from_table` for a class that is no kind of law; ``law`` is its name."""
    hints = _hints(cast(Any, cls))
    entries = {entry.name: entry for entry in fields(cls)}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, value in table.items():
        require_known(key, [*entries, "law"] if law else entries, where)
        values[key] = convert(value, hints[key], where, key)
    missing = [name for name, entry in entries.items() if name not in values
               and entry.default is MISSING and entry.default_factory is MISSING]
    if missing:
        explained = f" of law = '{law}'; `fecontact laws {law}` explains this law" if law else ""
        raise InputError(f"{where} lacks {'the key' if len(missing) == 1 else 'the keys'} "
                         f"{choices(missing)}{explained}.")
    with located(f"{where}:", cls.__name__):
        return cls(**values)


@cache
def _hints(cls: Any) -> dict[str, Any]:
    return get_type_hints(cls)


class Unset(float):
    """Default number of a field that has to differ from the same number where it is given."""


def to_table(instance: Any, *, defaults: bool = True) -> dict[str, Any]:
    """The fields of a dataclass as a table for TOML.

    Parameters
    ----------
    instance : Any
        A dataclass instance.
    defaults : bool
        Whether to include fields that have their default value, also of dataclasses within; those
        that are None are left out.
    """
    name = _kinds.name_of(instance)
    table: dict[str, Any] = {} if name is None else {"law": name}
    for entry in fields(instance):
        value = getattr(instance, entry.name)
        default = entry.default_factory() if callable(entry.default_factory) else entry.default
        given = value != default or isinstance(value, Unset) != isinstance(default, Unset)
        if value is not None and (defaults or default is MISSING or given):
            table[entry.name] = plain(value, defaults=defaults)
    return table


def key_tree(table: Any) -> Any:
    """Return a table with None in place of values, also in tables and lists of tables within."""
    if isinstance(table, Mapping):
        return {str(key): key_tree(value) for key, value in table.items()}
    if isinstance(table, list | tuple) and any(isinstance(item, Mapping) for item in table):
        return [key_tree(item) for item in table]
    return None


def with_keys(some: Any, every: Any, keys: Any) -> Any:
    """Return table ``some`` with those further keys of table ``every`` that are in ``keys``.

    ``keys`` is what :func:`key_tree` returns; the order is that of ``every``.
    """
    if isinstance(every, dict) and isinstance(keys, Mapping):
        some = some if isinstance(some, dict) else {}
        return {name: with_keys(some.get(name), value, keys.get(name))
                for name, value in every.items() if name in some or name in keys}
    if isinstance(every, list) and isinstance(keys, list) and len(every) == len(keys):
        some = some if isinstance(some, list) else [None] * len(every)
        return [with_keys(*items) for items in zip(some, every, keys, strict=True)]
    return every if some is None else some


def require_known(key: str, valid: Mapping[str, Any] | Sequence[str], where: str) -> None:
    """Raise :class:`InputError` with the nearest valid key unless ``key`` is one of them."""
    if key not in valid:
        raise InputError(f"{where} has no key '{key}'{nearest(key, valid)}; "
                         f"its keys are: {choices(valid)}.")


def convert(value: Any, hint: Any, where: str, key: str) -> Any:
    """Convert a value of a table to the type of a field.

    Raises
    ------
    InputError
        ``study.toml: [friction]: decay = "high" must be a number or a list of numbers.``
    """
    try:
        return _converted(value, hint, f"{where[:-1]}.{key}]" if where.endswith("]")
                          else f"{where}: [{key}]")
    except _MismatchError:
        raise InputError(f"{where}: {key} = {shown(value)} must be {described(hint)}"
                         f"{_decimal_point(value)}.") from None
    except OverflowError:
        raise InputError(f"{where}: {key} = {shown(value)} is too large; numbers reach "
                         f"1.8e308, whole numbers 9.2e18.") from None


def convert_fields(instance: Any) -> None:
    """Convert the fields of a frozen dataclass to the types of their annotations.

    Raises
    ------
    InputError
        ``RenderSettings: frames = "many" must be a whole number.``
    """
    cls: Any = type(instance)
    hints = _hints(cls)
    # Class variables have annotations too, but are no fields.
    for entry in fields(cls):
        value = convert(getattr(instance, entry.name), hints[entry.name], cls.__name__, entry.name)
        object.__setattr__(instance, entry.name, value)


def _decimal_point(value: Any) -> str:
    """A hint at the number that a text with a decimal comma stands for, else an empty text."""
    meant = _COMMA.fullmatch(value.strip()) if isinstance(value, str) else None
    return f" (did you mean {meant[1]}.{meant[2]}?)" if meant else ""


@contextmanager
def located(where: str, *titles: str) -> Iterator[None]:
    """Begin the message of an error with ``where``, in place of the given titles."""
    try:
        yield
    except FecontactError as error:
        names = "|".join(re.escape(title) for title in titles) or "$"
        message = re.sub(rf"^({names})[ \w]*: ", "", str(error))
        if message.startswith(where):
            raise
        raise type(error)(f"{where} {message}") from error.__cause__


def shown(value: Any) -> str:
    """A value as written in a file, truncated to fit into a sentence."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError):
        try:
            text = repr(value)
        except ValueError:  # whole numbers of thousands of digits
            text = "a number of thousands of digits"
        except RecursionError:
            text = "[[...]]"
    text = " ".join(text.split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def described(hint: Any, *, plural: bool = False) -> str:
    """Description of a type in a message: ``a number or a list of numbers``."""
    words = list(dict.fromkeys(
        word for option in _options(hint) if option is not types.NoneType
        for word in _words(option, plural)))
    *most, last = words
    return f"{', '.join(most)} or {last}" if most else last


class _MismatchError(Exception):
    """A value is not of the required type."""


def _converted(value: Any, hint: Any, where: str) -> Any:
    options = _options(hint)
    if isinstance(value, Mapping):
        # Of several possible tables, take the one that shares the most keys.
        options = sorted(options, key=lambda option: -_shared_keys(option, value))
    for option in options:
        try:
            return _converted_to(value, option, where)
        except _MismatchError:
            continue
    raise _MismatchError


def _converted_to(value: Any, hint: Any, where: str) -> Any:
    origin, args = get_origin(hint), get_args(hint)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if hint is Any:
        return value
    if hint is float and isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if hint is int and isinstance(value, Integral) and not isinstance(value, bool):
        if abs(int(value)) >= 2**63:
            raise OverflowError
        return int(value)
    if hint in (str, bool, types.NoneType) and isinstance(value, hint):
        return value
    if origin is Literal and isinstance(value, str | int) and value in args and not (
            isinstance(value, bool)):
        return value
    if is_dataclass(hint):
        if isinstance(value, hint):  # type: ignore[arg-type]
            return value
        if isinstance(value, Mapping):
            return from_table(hint, value, where)  # type: ignore[arg-type]
    if origin is tuple and isinstance(value, list | tuple):
        if args[-1] is Ellipsis:
            return tuple(_converted(item, args[0], where) for item in value)
        if len(value) == len(args):
            return tuple(_converted(item, kind, where)
                         for item, kind in zip(value, args, strict=True))
    if origin in (dict, Mapping) and isinstance(value, Mapping):
        return {str(key): convert(item, args[1], where, str(key)) for key, item in value.items()}
    raise _MismatchError


def _shared_keys(hint: Any, table: Mapping[str, Any]) -> int:
    return sum(entry.name in table for entry in fields(hint)) if is_dataclass(hint) else 0


def _options(hint: Any) -> Sequence[Any]:
    hint = getattr(hint, "__value__", hint)  # of an alias
    if get_origin(hint) not in (Union, types.UnionType):
        return (hint,)
    return [option for part in get_args(hint) for option in _options(part)]


def _words(hint: Any, plural: bool) -> list[str]:
    simple = {float: ("a number", "numbers"), int: ("a whole number", "whole numbers"),
              str: ("a text in quotes", "texts in quotes"), bool: ("true or false",) * 2,
              Any: ("a value", "values")}
    origin, args = get_origin(hint), get_args(hint)
    if hint in simple:
        return [simple[hint][plural]]
    if origin is Literal:
        return [json.dumps(option) for option in args]
    if origin is tuple:
        number = "" if args[-1] is Ellipsis else f"{_COUNTS.get(len(args), len(args))} "
        return [f"{'lists' if plural else 'a list'} of {number}{described(args[0], plural=True)}"]
    content = ("a law and its parameters" if _kinds.is_kind(hint) else
               ", ".join(entry.name for entry in fields(hint)) if is_dataclass(hint)
               else f"names and {described(args[1], plural=True)}")
    return [f"{'tables' if plural else 'a table'} of {content}"]


def plain(value: Any, *, defaults: bool = True) -> Any:
    """A value for TOML: dataclasses and mappings as tables, sequences as lists.

    Without ``defaults``, fields of dataclasses that have their default value are left out.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return to_table(value, defaults=defaults)
    if isinstance(value, Mapping):
        return {str(key): plain(item, defaults=defaults) for key, item in value.items()
                if item is not None}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [plain(item, defaults=defaults) for item in value]
    return value
