"""Sequences of numbers and two-column files, checked."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError

Array = NDArray[np.float64]


def numbers(owner: str, name: str, given: Any, least: int = 0) -> tuple[float, ...]:
    """A sequence as a tuple of finite floats.

    Raises
    ------
    InputError
        For anything else, with the place of the value, or for fewer than ``least`` values.
    """
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.ndim != 1 or isinstance(given, str):
        raise InputError(f"{owner}: {name} = {_short(given)} must be a list of numbers.")
    if not np.isfinite(array).all():
        place = int(np.argmin(np.isfinite(array)))
        raise InputError(f"{owner}: {name}[{place}] = {array[place]} must be finite; repair or "
                         f"remove that value.")
    if len(array) < least:
        raise InputError(f"{owner}: {name} has {len(array)} value{'s' * (len(array) != 1)}; at "
                         f"least {least} are needed.")
    return tuple(array.tolist())


def require_growing(owner: str, name: str, values: tuple[float, ...]) -> None:
    """Raise :class:`InputError` at the first value that is not larger than the one before it."""
    steps = np.diff(values)
    if (steps <= 0.0).any():
        place = int(np.argmax(steps <= 0.0)) + 1
        raise InputError(f"{owner}: {name}[{place}] = {values[place]:g} must be larger than the "
                         f"value before it, {values[place - 1]:g}; sort the points and remove "
                         f"repeated ones.")


def require_closed(owner: str, name: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """The values with the last equal to the first, which they must be but for rounding."""
    if abs(values[-1] - values[0]) > 1e-9 * np.ptp(values):
        raise InputError(f"{owner}: {name} must end as it begins to be repeated, but begins with "
                         f"{values[0]:g} and ends with {values[-1]:g}; add the first value again "
                         f"at the end of the period.")
    return (*values[:-1], values[0])


def read_or_given(
    owner: str, file: str | None, *, least: int, **columns: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Two sequences of the same length, the first growing, from a file or as given.

    Raises
    ------
    InputError
        Unless exactly one of both is there, and can be used.
    """
    (first, x), (second, y) = columns.items()
    if file is not None:
        if np.size(x) or np.size(y):
            raise InputError(f"{owner}: file = {file!r} cannot stand beside {first} and {second}; "
                             f"give the file or the two lists.")
        if not isinstance(file, str):
            raise InputError(f"{owner}: file = {file!r} must be the name of a file.")
        x, y = (tuple(column.tolist()) for column in read_columns(owner, file, (first, second)))
        owner = f"{owner}: file = '{file}'"
    x, y = numbers(owner, first, x, least), numbers(owner, second, y)
    if len(x) != len(y):
        raise InputError(f"{owner}: {second} has {len(y)} values for {len(x)} {first}; give one "
                         f"for each.")
    require_growing(owner, first, x)
    return x, y


def read_columns(owner: str, file: str, names: tuple[str, str]) -> tuple[Array, Array]:
    """Two columns of numbers from a text or CSV file.

    Columns are separated by semicolons, tabs, commas or blanks; where semicolons or tabs
    separate them, a comma in a number is a decimal comma. Lines without any number at the
    beginning are a header; ``#`` starts a comment.

    Raises
    ------
    InputError
        For a file that cannot be read, with the line that is wrong.
    """
    try:
        lines = Path(file).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not a text file"
        raise InputError(f"{owner}: file = '{file}' cannot be read: {reason}.") from None
    rows: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        words = _words(line.partition("#")[0].strip())
        values = [_number(word) for word in words]
        if not words or (not rows and all(value is None for value in values)):
            continue
        if len(values) != 2 or None in values or not np.isfinite(np.array(values, float)).all():
            found = (f"has {len(values)} column{'s' * (len(values) != 1)}" if len(values) != 2
                     else "has a value that is no finite number")
            raise InputError(f"{owner}: file = '{file}', line {number}, {_short(line.strip())}, "
                             f"{found}; each line must hold two numbers, {names[0]} and "
                             f"{names[1]}.")
        rows.append((values[0], values[1]))  # type: ignore[arg-type]
    if not rows:
        raise InputError(f"{owner}: file = '{file}' holds no numbers; each line must hold two, "
                         f"{names[0]} and {names[1]}.")
    first, second = np.array(rows).T
    return first, second


def _words(line: str) -> list[str]:
    for separator in (";", "\t"):
        if separator in line:
            words = line.rstrip(separator).split(separator)
            return [word.strip().replace(",", ".") for word in words]
    return [word for word in re.split(r"\s*,\s*|\s+", line) if word]


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def _short(given: Any) -> str:
    text = repr(given)
    return text if len(text) <= 60 else f"{text[:57]}..."
