"""What laws there are, for the terminal."""

import inspect
import json
from dataclasses import MISSING, fields
from typing import Any

from fecontact.errors import InputError, choices, nearest
from fecontact.laws.names import law_names
from fecontact.report import table


def laws_table() -> Any:
    """Every law: its kind, its name in study files, and what it is."""
    from rich.markup import escape

    return table("kind", "law", "", left=3, rows=[
        (_title(kind), name, escape(_summary(cls)))
        for kind, names in law_names().items() for name, cls in names.items()])


def law_help(name: str) -> str:
    """The documentation of the laws of a name, and how they stand in a study file.

    Raises
    ------
    InputError
        If there is no such law, with those that there are.
    """
    found = [(kind, names[name]) for kind, names in law_names().items() if name in names]
    if not found:
        known = {law for names in law_names().values() for law in names}
        raise InputError(f"There is no law '{name}'{nearest(name, known)}; there are: "
                         f"{choices(known)}.")
    return "\n\n".join(f"{inspect.getdoc(cls)}\n\nIn a study file:\n\n{_example(kind, name, cls)}"
                       for kind, cls in found)


def _example(kind: type, name: str, cls: type) -> str:
    lines = [f"    [{_SECTIONS[kind.__name__]}]", f'    law = "{name}"']
    for entry in fields(cls):
        default = entry.default_factory() if callable(entry.default_factory) else entry.default
        if default is MISSING:
            lines.append(f"    {entry.name} =")
        elif default is not None:
            shown = list(default) if isinstance(default, tuple) else default
            lines.append(f"    {entry.name} = {json.dumps(shown)}")
    return "\n".join(lines)


def _title(kind: type) -> str:
    return _TITLES.get(kind.__name__, _SECTIONS[kind.__name__])


def _summary(cls: type) -> str:
    return (inspect.getdoc(cls) or "").split("\n\n")[0].replace("\n", " ").rstrip(".")


_SECTIONS = {"NormalLaw": "normal", "FrictionLaw": "friction", "Profile": "ground.profile",
             "GroundMotion": "ground.motion", "Signal": "drive.motion_x"}
_TITLES = {"Profile": "profile", "GroundMotion": "ground motion", "Signal": "signal"}
