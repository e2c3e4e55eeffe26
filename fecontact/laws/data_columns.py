"""Checked reading of sequences of numbers and two-column files."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array


def numbers(owner: str, name: str, given: Any, least: int = 0) -> tuple[float, ...]:
    """Convert a sequence to a tuple of finite floats.

    InputError for a value that is not finite, with its index, or fewer than ``least`` values.
    """
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.empty((0, 0))
    if array.ndim != 1 or isinstance(given, str):
        raise InputError(f"{owner}: {name} = {shown(given)} must be a list of numbers.")
    if not np.isfinite(array).all():
        place = int(np.argmin(np.isfinite(array)))
        raise InputError(f"{owner}: {name}[{place}] = {array[place]} must be finite; repair or "
                         f"remove that value.")
    if len(array) < least:
        raise InputError(f"{owner}: {name} has {len(array)} value{'s' * (len(array) != 1)}; at "
                         f"least {least} are needed.")
    return tuple(array.tolist())


def require_growing(owner: str, name: str, values: Sequence[float] | Array) -> None:
    """Raise :class:`InputError` at the first value that is not larger than the one before it."""
    steps = np.diff(values)
    if (steps <= 0.0).any():
        place = int(np.argmax(steps <= 0.0)) + 1
        raise InputError(f"{owner}: {name}[{place}] = {values[place]:g} must be larger than the "
                         f"value before it, {values[place - 1]:g}; sort the points and remove "
                         f"repeated ones.")


def require_resolved(owner: str, first: str, x: Array, second: str, y: Array) -> None:
    """Raise :class:`InputError` if curves through the points could overflow.

    x must increase by at least 1e-60 between points, and both be within -1e60 to 1e60.
    """
    for name, value in ((first, float(x[0])), (first, float(x[-1])),
                         (second, float(y[np.argmax(np.abs(y))]))):
        if not abs(value) <= 1e60:
            raise InputError(f"{owner}: {name} reaches {value:g}; its values must be within "
                             f"-1e60 to 1e60.")
    steps = np.diff(x)
    if not steps.min() >= 1e-60:
        raise InputError(f"{owner}: {first} has points {steps.min():g} apart; their distances "
                         f"must be at least 1e-60.")


def require_closed(owner: str, name: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """The values with the last set to the first, from which it may differ by rounding only."""
    if abs(values[-1] - values[0]) > 1e-9 * np.ptp(values):
        raise InputError(f"{owner}: {name} must end as it begins to be repeated, but begins with "
                         f"{values[0]:g} and ends with {values[-1]:g}; add the first value again "
                         f"at the end of the period.")
    return (*values[:-1], values[0])


def read_or_given(
    owner: str, file: str | None, *, least: int, **columns: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Two sequences of equal length, the first ascending, from a file or as given.

    InputError unless exactly one of both is given and valid.
    """
    (first, x), (second, y) = columns.items()
    if file is not None:
        if np.size(x) or np.size(y):
            raise InputError(f"{owner}: file = {file!r} cannot be combined with {first} and "
                             f"{second}; give the file or the two lists.")
        x, y = (tuple(column.tolist()) for column in read_columns(owner, file, (first, second)))
        owner = f"{owner}: file = '{file}'"
    x, y = numbers(owner, first, x, least), numbers(owner, second, y)
    if len(x) != len(y):
        raise InputError(f"{owner}: {second} has {len(y)} values for {len(x)} {first}; give one "
                         f"for each.")
    require_growing(owner, first, x)
    return x, y


def read_columns(
    owner: str, file: str | Path, names: tuple[str, ...], *, first_optional: bool = False
) -> tuple[Array, ...]:
    """Read columns of numbers from a text or CSV file, one for each name.

    Columns are separated by semicolons, tabs, commas or blanks; with semicolons or tabs, or in a
    quoted number, a comma is a decimal comma. Lines before the first line of numbers are a header;
    ``#`` starts a comment. Text that is not UTF-8 is read as Latin-1. With ``first_optional`` the
    file may lack the first column.

    Raises
    ------
    InputError
        For a file that cannot be read, with the faulty line.
    """
    lines = text_of(owner, file).splitlines()
    widths = {len(names), len(names) - first_optional}
    wanted = f"{' and '.join(names)}{f', or {names[-1]} alone' * first_optional}"
    rows: list[list[float]] = []
    for place, line in enumerate(lines, start=1):
        words = cells(line.partition("#")[0].strip())
        values = [value for word in words if (value := number(word)) is not None]
        if not words or (not rows and (len(values) < len(words) or len(words) not in widths)):
            continue
        widths = {len(rows[0])} if rows else widths
        if len(words) not in widths or len(values) < len(words) or not np.isfinite(values).all():
            found = (f"has {len(words)} column{'s' * (len(words) != 1)}"
                     if len(words) not in widths else "has a value that is no finite number")
            raise InputError(f"{owner}: file = '{file}', line {place}, {shown(line.strip())}, "
                             f"{found}; each line must hold {wanted}, like the first.")
        rows.append(values)
    if not rows:
        first = next((line.strip() for line in lines if line.strip()), None)
        begin = "" if first is None else f"; it begins with {shown(first)}"
        raise InputError(f"{owner}: file = '{file}' has no line of just the numbers {wanted}"
                         f"{begin}.")
    return tuple(np.array(rows).T)


def text_of(owner: str, file: str | Path) -> str:
    """Text of a file, UTF-8 or else Latin-1; InputError if it cannot be read or is no text."""
    if not isinstance(file, str | Path):
        raise InputError(f"{owner}: file = {file!r} must be the name of a file.")
    require_regular_file(Path(file), "a table of numbers", f"{owner}: ")
    try:
        content = Path(file).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{owner}: file = '{file}' cannot be read: {reason}.") from None
    if b"\0" in content:
        raise InputError(f"{owner}: file = '{file}' cannot be read: it is not a text file.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def cells(line: str) -> list[str]:
    """Cells of a line, parted by semicolons, tabs, commas or blanks, with decimal points."""
    line = re.sub(r'"([^"]*)"', lambda quoted: quoted[1].replace(",", "."), line)
    for separator in (";", "\t"):
        if separator in line:
            words = line.rstrip(separator).split(separator)
            return [word.strip().replace(",", ".") for word in words]
    return [word for word in re.split(r"\s*,\s*|\s+", line) if word]


def number(word: str) -> float | None:
    """Number that a cell stands for; None for a text."""
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None
