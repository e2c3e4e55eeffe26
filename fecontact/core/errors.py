"""Exceptions of the package, and the checks of numbers that raise them.

Every message is one sentence that names the argument or key, its value, the allowed values and a
remedy.
"""

import difflib
import sys
from collections.abc import Iterable
from numbers import Real
from typing import Any


class FecontactError(Exception):
    """Base class of every error raised on purpose by fecontact."""


class InputError(FecontactError, ValueError):
    """A value, key, name or option given by the user is not usable."""


class MeshError(FecontactError, ValueError):
    """A mesh or mesh file is not usable."""


class MissingLibraryError(FecontactError):
    """A system library or optional package is missing; the message says how to install it."""


class AnalysisError(FecontactError, ArithmeticError):
    """A computation failed (no equilibrium, no convergence); the message says why."""


class ModelWarning(UserWarning):
    """A result lies outside the range of validity of the model; the message says where."""


def choices(names: Iterable[str]) -> str:
    """Names sorted and quoted for a message: ``'a', 'b'``, or ``none``."""
    return ", ".join(f"'{name}'" for name in sorted(names)) or "none"


def nearest(name: str, names: Iterable[str], likeness: float = 0.5) -> str:
    """A hint `` (did you mean 'x'?)`` with the closest of ``names``, or an empty string.

    ``likeness`` is the least ratio of equal letters, 1 for equal words.
    """
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=likeness)
    return f" (did you mean '{close[0]}'?)" if close else ""


# Beyond these limits, products of a few values may overflow or underflow.
_LEAST, LARGEST = 1e-60, 1e60


def require_positive(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a number from 1e-60 to 1e60."""
    for name, value in values.items():
        number = _of_python(value)
        if not (_is_number(number) and 0.0 < number <= sys.float_info.max):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a finite number above "
                             f"zero.")
        if not _LEAST <= number <= LARGEST:
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number from {_LEAST:g} "
                             f"to {LARGEST:g}.")


def require_not_negative(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a number from zero to 1e60."""
    for name, value in values.items():
        number = _of_python(value)
        if not (_is_number(number) and 0.0 <= number <= sys.float_info.max):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a finite number, zero or "
                             f"above.")
        if number > LARGEST:
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number from zero to "
                             f"{LARGEST:g}.")


def require_finite(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a number from -1e60 to 1e60."""
    for name, value in values.items():
        number = _of_python(value)
        if not _is_number(number):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number.")
        # Whole numbers may be larger than any other.
        if not abs(number) <= sys.float_info.max:
            raise InputError(f"{owner}: {name} = {shown(value)} must be finite.")
        if abs(number) > LARGEST:
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number from "
                             f"{-LARGEST:g} to {LARGEST:g}.")


def require_choice(owner: str, name: str, value: object, names: Iterable[str]) -> None:
    """Raise :class:`InputError` unless a value is one of the names."""
    known = tuple(names)
    if not isinstance(value, str) or value not in known:
        raise InputError(f"{owner}: {name} = {shown(value)} must be one of {choices(known)}"
                         f"{nearest(str(value), known)}.")


def _is_number(value: object) -> bool:
    # Asking an abstract class takes long.
    return type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))


def _of_python(value: Any) -> Any:
    """A number of numpy as one of Python, since numpy casts the limits to its own kinds."""
    if type(value) is not float and isinstance(value, Real) and hasattr(value, "item"):
        return value.item()
    return value


def shown(value: object) -> str:
    """One-line text of a value, truncated to fit into a sentence."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def require_docstrings() -> None:
    """Raise :class:`InputError` if Python runs without docstrings, which describe all keys."""
    if sys.flags.optimize > 1:
        raise InputError("Python was started with -OO, or with PYTHONOPTIMIZE=2, which removes the "
                         "docstrings that fecontact reads; start it with -O at most.")
