"""Exceptions of the package, and the checks of numbers that raise them.

Every message is one sentence that names the thing that is wrong, its value, what is allowed and
what to do about it.
"""

import difflib
from collections.abc import Iterable
from numbers import Real


class FecontactError(Exception):
    """Base class of every error raised on purpose by fecontact."""


class InputError(FecontactError, ValueError):
    """A value, key, name or option given by the user is not usable."""


class MeshError(FecontactError, ValueError):
    """A mesh, or a file that should hold one, is not usable."""


class MissingLibraryError(FecontactError):
    """A library of the system or an optional package is not installed; the message says how to."""


class AnalysisError(FecontactError, ArithmeticError):
    """A computation has no answer (no equilibrium, no convergence), and the message says why."""


class ModelWarning(UserWarning):
    """A result lies outside what the model holds for, and the message says where."""


def choices(names: Iterable[str]) -> str:
    """The given names, sorted and quoted, for a message: ``'a', 'b'``, or ``none``."""
    return ", ".join(f"'{name}'" for name in sorted(names)) or "none"


def nearest(name: str, names: Iterable[str]) -> str:
    """A hint `` (did you mean 'x'?)`` with the closest of ``names``, or an empty string."""
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=0.5)
    return f" (did you mean '{close[0]}'?)" if close else ""


# Beyond these, squares and products of a few values leave the range of floating-point numbers.
_LEAST, _MOST = 1e-60, 1e60


def require_positive(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a number from 1e-60 to 1e60."""
    for name, value in values.items():
        if not (_is_number(value) and 0.0 < value < float("inf")):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a finite number above "
                             f"zero.")
        if not _LEAST <= value <= _MOST:
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number from {_LEAST:g} "
                             f"to {_MOST:g}.")


def require_not_negative(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a finite number of at least zero."""
    for name, value in values.items():
        if not (_is_number(value) and 0.0 <= value < float("inf")):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a finite number, zero or "
                             f"above.")


def require_finite(owner: str, **values: float) -> None:
    """Raise :class:`InputError` unless every value is a finite number."""
    for name, value in values.items():
        if not _is_number(value):
            raise InputError(f"{owner}: {name} = {shown(value)} must be a number.")
        if not abs(value) < float("inf"):
            raise InputError(f"{owner}: {name} = {shown(value)} must be finite.")


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def shown(value: object) -> str:
    """A value in one line, cut to a length that fits into a sentence."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."
