"""Tables of keys and values (TOML, HDF5) as dataclasses, and back."""

from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any, TypeVar, get_type_hints

import msgspec

from fecontact.basis import ModalBasis
from fecontact.errors import InputError, choices, nearest
from fecontact.laws.drive import Drive, Load
from fecontact.laws.friction import ExponentialFriction
from fecontact.laws.ground import Ground
from fecontact.laws.normal import RoughSurface
from fecontact.system import PARTS, ContactSystem

T = TypeVar("T")

_PARTS = {"normal": RoughSurface, "friction": ExponentialFriction, "ground": Ground,
          "drive": Drive, "load": Load}


def from_table(cls: type[T], table: Mapping[str, Any], where: str) -> T:
    """An instance of a dataclass from a table whose keys are its fields.

    Parameters
    ----------
    cls : type
        A dataclass; fields that are dataclasses take sub-tables.
    table : mapping
        Keys and values; keys with defaults may be missing.
    where : str
        Where the table stands, for messages: ``study.toml: [ground]``.

    Raises
    ------
    InputError
        For an unknown key (with the nearest valid one), a value of the wrong type or out of
        range, or a missing key.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table of keys and values, not {table!r}.")
    hints = get_type_hints(cls)
    valid = [entry.name for entry in fields(cls)]  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in valid:
            raise InputError(f"{where} has an unknown key '{key}'{nearest(key, valid)}; "
                             f"its keys are: {choices(valid)}.")
        if isinstance(hints[key], type) and is_dataclass(hints[key]):
            values[key] = from_table(hints[key], value, f"{where[:-1]}.{key}]"
                                     if where.endswith("]") else f"{where} [{key}]")
            continue
        try:
            values[key] = msgspec.convert(value, hints[key], str_keys=True)
        except msgspec.ValidationError as error:
            raise InputError(f"{where}: {key} = {value!r} has the wrong type "
                             f"({_plain(str(error))}).") from None
    try:
        return cls(**values)
    except TypeError:
        missing = [entry.name for entry in fields(cls)  # type: ignore[arg-type]
                   if entry.name not in values and _required(entry)]
        raise InputError(f"{where} lacks the key {choices(missing)}.") from None
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def to_table(instance: Any) -> dict[str, Any]:
    """The fields of a dataclass as a table that TOML can hold: None left out, tuples as lists."""
    return {key: _plain_value(value) for key, value in asdict(instance).items()
            if value is not None}


def system_tables(system: ContactSystem) -> dict[str, Any]:
    """Laws, ground, drive, load and gap of a contact system as tables."""
    tables: dict[str, Any] = {part: to_table(getattr(system, part)) for part in PARTS}
    tables["gap"] = _plain_value(system.gap)
    return tables


def system_from_tables(
    basis: ModalBasis, tables: Mapping[str, Any], where: str = "The system"
) -> ContactSystem:
    """The contact system of a basis and tables ``normal``, ``friction``, ... , ``gap``."""
    parts: dict[str, Any] = {
        part: from_table(cls, tables.get(part, {}), f"{where}: [{part}]")
        for part, cls in _PARTS.items()
    }
    return ContactSystem(basis, gap=tables.get("gap", 0.0), **parts)


def _required(entry: Any) -> bool:
    from dataclasses import MISSING

    return entry.default is MISSING and entry.default_factory is MISSING


def _plain_value(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain_value(item) for key, item in value.items() if item is not None}
    if isinstance(value, tuple | list):
        return [_plain_value(item) for item in value]
    return value


def _plain(message: str) -> str:
    return message.replace("`", "").rstrip(".").replace("Expected", "expected")
