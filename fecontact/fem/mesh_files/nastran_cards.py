"""Cards of Nastran's bulk data and punch files: fields of 8 or 16 characters, or by commas."""

import re
from collections.abc import Iterator
from pathlib import Path

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import InputError, MeshError, shown

_INCLUDE = re.compile(r"\s*INCLUDE\s+['\"]?([^'\"]+)", re.IGNORECASE)

# Line of the begin of a card, in an included file with its name, and the fields behind its name.
Line = int | str
Card = tuple[Line, list[str]]


def all_cards(path: Path, case: list[str] | None = None) -> Iterator[tuple[Line, str, list[str]]]:
    """Line, name and fields of each card, with those of its continuations.

    With ``case`` the file is that of one body: lines before BEGIN BULK, the case control, are added
    to it.

    Raises
    ------
    MeshError
        For a file that includes itself or a missing one, and for one of a body with superelements.
    """
    begin: Line = 0
    name, card = "", list[str]()
    for place, line in _lines(path, (), case):
        head, fields = _parted(line)
        if name and head[:1] in ("", "+", "*"):
            card += fields
            continue
        if name:
            yield begin, name, card
        begin, name, card = place, head.rstrip("*").upper(), fields
        if name == "ENDDATA":
            break
    if name:
        yield begin, name, card


def cards(path: Path, name: str) -> Iterator[Card]:
    """Line and fields of each card of a name."""
    return ((line, fields) for line, of, fields in all_cards(path) if of == name)


def _lines(
    path: Path, outer: tuple[Path, ...], case: list[str] | None
) -> Iterator[tuple[Line, str]]:
    """Lines without comments; those of an included file stand in place of its INCLUDE."""
    rows = path.read_text(encoding="utf-8", errors="replace").splitlines()
    start = next((number for number, row in enumerate(rows)
                  if row[:40].strip().upper().startswith("BEGIN BULK")), -1)
    if case is not None:
        case += rows[: max(start, 0)]
    for number, row in enumerate(rows[start + 1 :], start=start + 2):
        line = row.partition("$")[0].rstrip().expandtabs()
        if not line.strip():
            continue
        if case is not None and row[:5].upper() == "BEGIN":
            raise MeshError(f"Line {number} begins a superelement ({shown(line)}), which is not "
                            f"read; give one file for each body.")
        if match := _INCLUDE.match(line):
            yield from _lines(_included(path, match[1].strip(), outer), (*outer, path),
                              None if case is None else [])
        else:
            yield f"{number} of {path.name}" if outer else number, line


def _included(path: Path, name: str, outer: tuple[Path, ...]) -> Path:
    found = path.parent / name.replace("\\", "/")
    if not found.is_file():
        raise MeshError(f"{path.name} includes the file {shown(name)}, but there is no file "
                        f"{found}; put it there, or correct the line INCLUDE.")
    require_regular_file(found, "a mesh")
    if any(found.samefile(one) for one in (*outer, path)):
        names = " -> ".join(one.name for one in (*outer, path, found))
        raise MeshError(f"The file includes itself, {names}; remove one of these lines INCLUDE.")
    return found


def _parted(line: str) -> tuple[str, list[str]]:
    """First field of a line and its others: 4 wide ones after ``*``, else 8."""
    if "," in line:
        head, *fields = (word.strip() for word in line.split(","))
        count = 4 if "*" in head else 8
        return head, (fields + [""] * count)[:count]
    head = line[:8].strip()
    width, count = (16, 4) if "*" in head else (8, 8)
    return head, [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]


def whole(line: Line, word: str) -> int:
    """A number of a point or component; InputError, with the line, for another word."""
    try:
        return int(word)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is no number of a point or "
                         f"component.") from None


def real(line: Line, word: str) -> float:
    """A number, also with D for E, or without either, as 1.5-3; InputError for another word."""
    plain = word.upper().replace("D", "E")
    sign = max(plain.rfind("+"), plain.rfind("-"))
    if "E" not in plain and sign > 0:
        plain = f"{plain[:sign]}E{plain[sign:]}"
    try:
        return float(plain)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is not a number.") from None


def reals(line: Line, words: list[str], count: int) -> list[float]:
    """So many numbers; words that are left out are zero."""
    return [real(line, word) if word else 0.0 for word in [*words, *[""] * count][:count]]
