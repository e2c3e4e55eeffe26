"""Cards of Nastran's bulk data and punch files: fields of 8 or 16 characters, or by commas."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fecontact.core.errors import InputError, MeshError
from fecontact.core.types import Integers


def cards(path: Path, name: str) -> Iterator[tuple[int, list[str]]]:
    """Line of its begin, and fields of each card of a name, with those of its continuations."""
    card: list[str] | None = None
    begin = 0
    text = path.read_text(encoding="utf-8", errors="replace")
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("$")[0].rstrip()
        if not line.strip():
            continue
        head, fields = _parted(line)
        if card is not None and head[:1] in ("", "+", "*"):
            card += fields
            continue
        if card is not None:
            yield begin, card
        card, begin = (fields if head.rstrip("*").upper() == name else None), number
    if card is not None:
        yield begin, card


def _parted(line: str) -> tuple[str, list[str]]:
    """First field of a line and its others: 4 wide ones after ``*``, else 8."""
    if "," in line:
        head, *fields = (word.strip() for word in line.split(","))
        count = 4 if "*" in head else 8
        return head, (fields + [""] * count)[:count]
    head = line[:8].strip()
    width, count = (16, 4) if "*" in head else (8, 8)
    return head, [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]


def whole(line: int, word: str) -> int:
    """A number of a point or component; InputError, with the line, for another word."""
    try:
        return int(word)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is no number of a point or "
                         f"component.") from None


def real(line: int, word: str) -> float:
    """A number, also with D for E, or without either, as 1.5-3; InputError for another word."""
    plain = word.upper().replace("D", "E")
    sign = max(plain.rfind("+"), plain.rfind("-"))
    if "E" not in plain and sign > 0:
        plain = f"{plain[:sign]}E{plain[sign:]}"
    try:
        return float(plain)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is not a number.") from None


def grid_rows(path: Path) -> dict[int, int]:
    """Rows of the grid points by their numbers, in the order of the cards GRID."""
    return {whole(line, fields[0]): row for row, (line, fields) in enumerate(cards(path, "GRID"))}


def point_rows(line: int, words: list[str], row: dict[int, int], card: str) -> Integers:
    """Rows of points, which may be ranges (THRU); words that are reals end them."""
    found: list[int] = []
    wanted = [word for word in words if word]
    while wanted:
        word = wanted.pop(0)
        if "." in word:
            break
        if word.upper() == "THRU":
            last = whole(line, wanted.pop(0)) if wanted else found[-1]
            found += [point for point in range(found[-1] + 1, last + 1) if point in row]
            continue
        found.append(whole(line, word))
    missing = [point for point in found if point not in row]
    if missing or not found:
        what = f"the point {missing[0]}, which the file does not hold" if missing else "no points"
        raise MeshError(f"The card {card} of line {line} names {what}; correct its numbers.")
    return np.array([row[point] for point in found], np.int64)
