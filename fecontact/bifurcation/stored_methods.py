"""Options of the methods of periodic orbits as texts for files."""

import json
from dataclasses import asdict, fields
from typing import Any

from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.orbit_methods import Collocation, Method, Shooting
from fecontact.core.errors import InputError
from fecontact.integrate.solvers import solver_by_name

_BY_NAME: dict[str, type[Any]] = {
    "collocation": Collocation, "shooting": Shooting, "harmonic balance": HarmonicBalance}
_NAMES = {kind: name for name, kind in _BY_NAME.items()}


def method_text(method: Method) -> str:
    """Name and options of a method, but for the wave of a wheel, which its branch has."""
    options: dict[str, Any] = {entry.name: getattr(method, entry.name) for entry in fields(method)
                               if entry.name != "repeats"}
    if "solver" in options:
        options["solver"] = {"name": options["solver"].name} | asdict(options["solver"])
    return json.dumps({"name": _NAMES[type(method)]} | options, default=int)


def method_from_text(text: str) -> Method:
    """The method of :func:`method_text`.

    Raises
    ------
    InputError
        If the text is not that of a method, or its options are out of range.
    """
    try:
        options = json.loads(text)
        kind = _BY_NAME[options.pop("name")]
        if solver := options.pop("solver", None):
            options["solver"] = solver_by_name(solver.pop("name"), solver)
        found: Method = kind(**options)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{text!r} is no method of periodic orbits.") from error
    return found
