"""Labels of parameters with their units, from the annotations of the classes that have them."""

import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from typing import Any, get_args, get_type_hints

from fecontact.core.units import Unit
from fecontact.laws.registry import is_kind, law_names
from fecontact.system.contact_system import ContactSystem


def parameter_label(name: str, owner: type = ContactSystem) -> str:
    """A parameter's name as the label of an axis, with its unit where there is one.

    ``ground.speed`` becomes ``ground speed [m/s]``. Names that are no parameters of ``owner``, a
    dataclass, and those whose unit differs from law to law, stay without.
    """
    inner = re.sub(r"^contact\.[^.]+\.", "", name)
    units = _units(owner).get(inner, frozenset())
    words = re.sub(r"\b(\w+) \1\b", r"\1", re.sub(r"[._]", " ", name.removeprefix("contact.")))
    return f"{words} [{next(iter(units))}]" if len(units) == 1 else words


@cache
def _units(owner: type) -> dict[str, frozenset[str]]:
    """Units of each dotted name; several or none where the laws do not agree on one."""
    found: dict[str, set[str]] = {"gap": {"m"}}
    for entry, hint in get_type_hints(owner).items():
        section = entry.removesuffix("_settings")
        for place, cls in _classes(hint, section):
            for name, unit in _units_of(cls).items():
                found.setdefault(f"{place}.{name}", set()).add(unit)
    return {place: frozenset(units) - {""} if "" not in units else frozenset()
            for place, units in found.items()}


def _units_of(cls: type) -> dict[str, str]:
    """Units that the annotations of a class's fields name; empty for fields without one."""
    return {name: next((item.symbol for item in getattr(hint, "__metadata__", ())
                        if isinstance(item, Unit)), "")
            for name, hint in get_type_hints(cls, include_extras=True).items()}


def _classes(hint: Any, place: str) -> Iterator[tuple[str, type]]:
    """Dotted names and classes of all parts of a type: dataclasses, what they hold, laws."""
    if is_kind(hint):
        for law in law_names()[hint].values():
            yield place, law
    elif is_dataclass(hint) and isinstance(hint, type):
        yield place, hint
        for name, inner in get_type_hints(hint).items():
            yield from _classes(inner, f"{place}.{name}")
    else:
        for part in get_args(hint):
            yield from _classes(part, place)
