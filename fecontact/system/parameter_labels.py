"""Labels of parameters with their meaning and unit, from the annotations of their classes."""

import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from typing import Any, ClassVar, Protocol, get_args, get_origin, get_type_hints

from fecontact.core.units import Unit
from fecontact.laws.base import NormalLaw
from fecontact.laws.excitation import Load
from fecontact.laws.registry import is_kind, law_names
from fecontact.system.contact_system import ContactSystem

_FORCE = re.compile(r"load\.forces\.(\d+)\.signal\.(\w+)")


_SIZES = ("amplitude", "value")  # of signals: the force itself


class Loaded(Protocol):
    """A contact system or a study, whose loads have places."""

    @property
    def load(self) -> Load:
        """Loads."""


def parameter_label(
    name: str, owner: type = ContactSystem, system: Loaded | None = None
) -> str:
    """Axis label of a parameter, with its unit if it has one.

    ``ground.speed`` becomes ``ground speed [m/s]``. Names that are not parameters of the dataclass
    ``owner``, or whose unit depends on the law, get no unit. With the system,
    ``load.forces.0.signal.amplitude`` becomes ``force at B x [N]``.
    """
    if found := _FORCE.fullmatch(name):
        return _force_label(int(found[1]), found[2], system)
    inner = re.sub(r"^links\.[^.]+\.", "links.", re.sub(r"^interfaces\.[^.]+\.", "", name))
    units = _units(owner).get(inner, frozenset())
    words = re.sub(r"\b(\w+) \1\b", r"\1", _words(name.removeprefix("interfaces.")))
    return f"{words} [{next(iter(units))}]" if len(units) == 1 else words


def _force_label(number: int, key: str, system: Loaded | None) -> str:
    """Label of a number of the signal of a force, by the place and direction of the force."""
    what, unit = f"force {number}", ""
    if system is not None and number < len(system.load.forces):
        force = system.load.forces[number]
        what = f"{'moment' if force.moment else 'force'} at {_place(force.point)} {force.along}"
        unit = "N m" if force.moment else "N"
    elif key in _SIZES:
        what = f"{key} of force {number}"
    if key not in _SIZES:
        units = _units(ContactSystem).get(f"load.forces.signal.{key}", frozenset())
        what = f"{_words(key)} of the {what}"
        unit = next(iter(units)) if len(units) == 1 else ""
    return f"{what} [{unit}]" if unit else what


def _words(name: str) -> str:
    """A dotted name as words; the unit is said beside them."""
    return re.sub(r"[._]", " ", re.sub(r"_hz\b", "", name))


def _place(point: Any) -> str:
    return f"contact node {point}" if isinstance(point, int) else str(point)


@cache
def _units(owner: type) -> dict[str, frozenset[str]]:
    """Units of each dotted name; several or none if laws differ."""
    found: dict[str, set[str]] = {"gap": {"m"}}
    laws: Any = law_names()[NormalLaw]
    for law in laws.values():
        if law.bilateral:
            found |= {f"links.{name}": {unit} for name, unit in _units_of(law).items()}
    for entry, hint in get_type_hints(owner).items():
        section = entry.removesuffix("_settings")
        for place, cls in _classes(hint, section):
            for name, unit in _units_of(cls).items():
                found.setdefault(f"{place}.{name}", set()).add(unit)
    return {place: frozenset(units) - {""} if "" not in units else frozenset()
            for place, units in found.items()}


def _units_of(cls: type) -> dict[str, str]:
    """Units from the annotations of a class's fields; empty strings for fields without one."""
    return {name: next((item.symbol for item in getattr(hint, "__metadata__", ())
                        if isinstance(item, Unit)), "")
            for name, hint in get_type_hints(cls, include_extras=True).items()
            if get_origin(hint) is not ClassVar}


def _classes(hint: Any, place: str) -> Iterator[tuple[str, type]]:
    """Dotted names and classes of all parts of a type: nested dataclasses and laws."""
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
