"""Public namespaces: their names stand in a stub, and are loaded when they are first used."""

import sys
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import lazy_loader

_PACKAGE = "fecontact"
_ALIKE = 0.7  # likeness of names from which one is taken for the other, from 0 to 1


def namespace(
    name: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """``__getattr__``, ``__dir__`` and ``__all__`` of a module, of the names in its stub.

    A name that is not there raises an AttributeError that says where it is, or which is nearest.
    """
    package = name if Path(file).stem == "__init__" else name.rpartition(".")[0]
    load, listed, names = lazy_loader.attach_stub(package, file)

    def attribute(wanted: str) -> Any:
        if wanted not in names:
            raise AttributeError(_missing(name, wanted, names))
        found = load(wanted)
        if package != name:
            # The loader keeps what it finds in the package, of which it is no name.
            vars(sys.modules[package]).pop(wanted, None)
            setattr(sys.modules[name], wanted, found)
        return found

    return attribute, listed, names


def _missing(name: str, wanted: str, names: list[str]) -> str:
    sentence = f"{name} has no name '{wanted}'"
    if wanted.startswith("_"):
        return sentence
    places = {one: space for space in _spaces() for one in import_module(space).__all__}
    if wanted in places:
        return f"{sentence}; it is {places[wanted]}.{wanted}."
    close = (get_close_matches(wanted, names, 1, _ALIKE)
             or get_close_matches(wanted, places, 1, _ALIKE))
    return f"{sentence}; did you mean {places[close[0]]}.{close[0]}?" if close else f"{sentence}."


def _spaces() -> list[str]:
    """The package and its public namespaces."""
    below = (f"{_PACKAGE}.{one}" for one in import_module(_PACKAGE).__all__)
    return [_PACKAGE, *(space for space in below if find_spec(space) is not None)]
