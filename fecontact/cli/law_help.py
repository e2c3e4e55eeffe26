"""List of laws and their parameters for the terminal."""

import inspect
import json
from collections.abc import Collection
from dataclasses import MISSING, fields
from typing import Any, get_args, get_origin, get_type_hints

from fecontact.cli.tables import table
from fecontact.core.docstrings import summary
from fecontact.core.errors import InputError, choices, nearest
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.check import check_law
from fecontact.laws.registry import law_names, own_law
from fecontact.laws.synonyms import laws_called


def laws_table(only: Collection[type] | None = None) -> Any:
    """Table of all laws, or of some: kind, name in study files, short description."""
    return table("kind", "law", "", left=3, rows=[
        (_title(kind), name, summary(cls).rstrip("."))
        for kind, names in law_names().items() for name, cls in names.items()
        if only is None or cls in only])


def laws_meant(name: str) -> list[type]:
    """Laws that are called otherwise here, such as those with a Stribeck curve; else none."""
    laws = [cls for names in law_names().values() for cls in names.values()]
    known = {law for names in law_names().values() for law in names} | {
        cls.__name__.lower() for cls in laws}
    return [] if ".py:" in name or name.lower() in known else laws_called(name, laws)


def law_help(name: str) -> str:
    """Documentation of the laws of a given name, with an example for a study file.

    The name is that in study files or that of the class; capitals do not matter. A law of one's
    own, ``FILE.py:CLASS``, is checked too, see :func:`fecontact.laws.check_law`.

    Raises
    ------
    InputError
        If the law does not exist (the message lists those that do), or if a user-defined law
        fails its check.
    """
    if ".py:" in name:
        return _own(name)
    laws = [(kind, law, cls) for kind, names in law_names().items() for law, cls in names.items()]
    found = [(kind, law, cls) for kind, law, cls in laws
             if name.lower() in (law, cls.__name__.lower())]
    if not found:
        known = {law for _, law, _ in laws}
        own = "; a law of your own is FILE.py:CLASS" * (":" in name)
        raise InputError(f"There is no law '{name}'{nearest(name, known)}{own}; there are: "
                         f"{choices(known)}.")
    return "\n\n".join(f"{inspect.getdoc(cls)}\n\nIn a study file:\n\n{_example(kind, law, cls)}"
                       for kind, law, cls in found)


def _own(name: str) -> str:
    cls = own_law(tuple(law_names()), name, name)
    kind = next(kind for kind in law_names() if issubclass(cls, kind))
    text = f"{inspect.getdoc(cls)}\n\nIn a study file:\n\n{_example(kind, name, cls)}"
    if not issubclass(cls, NormalLaw | FrictionLaw):
        return text
    if any(entry.default is MISSING and entry.default_factory is MISSING for entry in fields(cls)):
        return f"{text}\n\nIt is not checked, because it has parameters without a default."
    check_law(cls())
    return f"{text}\n\nWith these values it keeps the contract of laws: derivatives, signs, energy."


def _example(kind: type, name: str, cls: type) -> str:
    lines = [f"    [{_SECTIONS[kind.__name__]}]", f'    law = "{name}"']
    hints = get_type_hints(cls)
    for entry in fields(cls):
        default = entry.default_factory() if callable(entry.default_factory) else entry.default
        if default is MISSING:
            lines.append(f"    {entry.name} =")
        elif default is None or default == ():
            lines.append(f"    # {entry.name} = {_hint(hints[entry.name])}")
        else:
            shown = list(default) if isinstance(default, tuple) else default
            lines.append(f"    {entry.name} = {json.dumps(shown)}")
    return "\n".join(lines)


def _hint(kind: Any) -> str:
    """Placeholder for the value of an optional key."""
    kind = getattr(kind, "__value__", kind)
    options = {get_origin(option) or option for option in (kind, *get_args(kind))}
    return "[...]" if tuple in options else '"..."' if str in options else "..."


def _title(kind: type) -> str:
    return _TITLES.get(kind.__name__, _SECTIONS[kind.__name__])


_SECTIONS = {"NormalLaw": "normal", "FrictionLaw": "friction", "Profile": "ground.profile",
             "GroundMotion": "ground.motion", "Signal": "drive.motion_x"}
_TITLES = {"Profile": "profile", "GroundMotion": "ground motion", "Signal": "signal"}
