"""Functions of the user's own, from their files."""

import importlib.util
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from fecontact.core.errors import InputError, nearest


def user_function(file: Path, name: str) -> Callable[[Any], float]:
    """A function of a Python file, as it is now.

    Raises
    ------
    InputError
        If the file cannot be loaded, or has no such function.
    """
    try:
        written = file.stat().st_mtime_ns
    except OSError as error:
        raise InputError(f"{file} cannot be loaded "
                         f"({(error.strerror or str(error)).lower()}).") from None
    return _function(file, name, written)


@cache
def _function(file: Path, name: str, written: int) -> Callable[[Any], float]:
    """The function as it was written then: processes may outlive a change of the file."""
    try:
        spec = importlib.util.spec_from_file_location(f"fecontact_summary_{file.stem}", file)
        module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
        spec.loader.exec_module(module)  # type: ignore[union-attr]
    except Exception as error:
        raise InputError(f"{file} cannot be loaded ({type(error).__name__}: {error}).") from None
    function = getattr(module, name, None)
    if not callable(function):
        raise InputError(f"{file} has no function '{name}'{nearest(name, vars(module))}.")
    return function
