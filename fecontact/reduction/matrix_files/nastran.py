"""Matrices of Nastran: DMIG in bulk data and punch files (.pch, .dmig, .bdf), OUTPUT4 and OUTPUT2.

A heading ``DMIG, NAME, 0, IFO, TIN`` says by IFO whether the matrix is square (1) or symmetric
(6), of which one triangle is given. Each column ``DMIG, NAME, GJ, CJ, , G1, C1, A1, B1, G2, ...``
holds the values A of rows (grid point G, component C); components of scalar points are 0. Fields
are 8 or, after ``*``, 16 characters wide, or parted by commas.

Files of OUTPUT4 (.op4) and OUTPUT2 (.op2) are read by pyYeti. They do not name the degrees of
freedom; those of an external superelement are named by the card EXTRN of the file that Nastran
punches beside it: points, each with digits of its components, 0 for scalar points.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.core.types import Integers
from fecontact.reduction.matrix_files.names import chosen_name

_SYMMETRIC, _SQUARE = "6", "1"
_COMPLEX = ("3", "4")
# Suffixes of files that Nastran punches beside an external superelement.
_PUNCHED = (".pch", ".asm")


def read_dmig(path: Path, name: str | None) -> tuple[Any, Integers]:
    """Sparse matrix (d, d) and the labels (d, 2) of its degrees of freedom, point and component.

    They are ordered by point and component.

    Raises
    ------
    InputError
        For a file without DMIG, an unknown name, complex or rectangular matrices, and fields that
        are no numbers, with the number of the line.
    """
    import scipy.sparse as sp

    headings: dict[str, list[str]] = {}
    entries: dict[str, list[tuple[int, int, int, int, float]]] = {}
    for line, fields in _cards(path, "DMIG"):
        own, rest = fields[0].upper(), fields[1:]
        if rest[0] == "0":
            headings[own] = rest
            continue
        entries.setdefault(own, []).extend(_column(line, rest))
    if not headings:
        raise InputError("The file holds no DMIG; write the matrices with EXTSEOUT(DMIGPCH) or "
                         "PARAM,EXTOUT,DMIGPCH.")
    chosen = chosen_name(headings, None if name is None else name.upper())
    form, kind = (*headings[chosen][1:3], "", "")[:2]
    if form not in (_SQUARE, _SYMMETRIC) or kind in _COMPLEX:
        what = "complex" if kind in _COMPLEX else f"of the form {form!r}"
        raise InputError(f"The matrix '{chosen}' is {what}; real square (1) and symmetric (6) ones "
                         f"are read.")
    rows = entries.get(chosen, [])
    if not rows:
        raise InputError(f"The matrix '{chosen}' has no columns.")
    pairs = np.array([one[:4] for one in rows], np.int64).reshape(-1, 2)
    labels, number = np.unique(pairs, axis=0, return_inverse=True)
    column, row = number.reshape(-1, 2).T
    values = np.array([one[4] for one in rows])
    size = len(labels)
    if len(np.unique(row * size + column)) < len(row):
        raise InputError(f"The matrix '{chosen}' gives an entry a second time.")
    if form == _SYMMETRIC:
        beside = row != column
        row, column, values = (np.concatenate([one, other[beside]]) for one, other in (
            (row, column), (column, row), (values, values)))
    return sp.csc_array((values, (row, column)), shape=(size, size)), labels


def read_op4(path: Path, name: str | None) -> tuple[Any, Integers | None]:
    """Sparse matrix, and the labels (d, 2) of its degrees of freedom if a file beside has them.

    Raises
    ------
    InputError
        For an unknown name, or a card EXTRN that cannot be read.
    MissingLibraryError
        If pyYeti is not installed.
    """
    op4 = optional("pyyeti.nastran.op4", "Reading OUTPUT4 of Nastran")
    found = {key.upper(): matrix for key, matrix in op4.read(str(path), sparse=True).items()}
    matrix = found[chosen_name(found, None if name is None else name.upper())]
    for suffix in _PUNCHED:
        beside = path.with_suffix(suffix)
        labels = _external(beside) if beside.is_file() else None
        if labels is not None and matrix.shape == (len(labels), len(labels)):
            return matrix, labels
    return matrix, None


def read_op2(path: Path, name: str | None) -> tuple[Any, None]:
    """Matrix of a file of OUTPUT2, without labels; errors as :func:`read_op4`."""
    op2 = optional("pyyeti.nastran.op2", "Reading OUTPUT2 of Nastran")
    with op2.OP2(str(path)) as file:
        found = file.rdop2mats()
    return found[chosen_name(found, None if name is None else name.upper())], None


def _external(path: Path) -> Integers | None:
    """Points and components (d, 2) of an external superelement; None without a card EXTRN."""
    for line, fields in _cards(path, "EXTRN"):
        words = [word for word in fields if word]
        if len(words) % 2:
            raise InputError(f"Card EXTRN of line {line} of {path} ends after a point.")
        points = [_whole(line, word) for word in words[::2]]
        return np.array([(point, int(digit)) for point, digits in zip(points, words[1::2],
                                                                     strict=True)
                         for digit in digits], np.int64)
    return None


def _column(line: int, fields: list[str]) -> Iterator[tuple[int, int, int, int, float]]:
    """Point and component of a column, then of a row, and the value, of one card."""
    point, component = (_whole(line, word) for word in fields[:2])
    # Rows have four fields: point, component, real and imaginary part.
    for start in range(3, len(fields), 4):
        group = fields[start : start + 3]
        if not any(group):
            continue
        if len(group) < 3:
            raise InputError(f"Card of line {line} ends within an entry of a DMIG, so the file may "
                             f"be cut off.")
        yield point, component, _whole(line, group[0]), _whole(line, group[1]), _real(
            line, group[2])


def _cards(path: Path, name: str) -> Iterator[tuple[int, list[str]]]:
    """Fields of each card of a name, with continuations, and the line of its begin."""
    card: list[str] | None = None
    begin = 0
    text = path.read_text(encoding="utf-8", errors="replace")
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("$")[0].rstrip()
        if not line.strip():
            continue
        head, fields = _fields(line)
        if card is not None and head[:1] in ("", "+", "*"):
            card += fields
            continue
        if card is not None:
            yield begin, card
        card, begin = (fields if head.rstrip("*").upper() == name else None), number
    if card is not None:
        yield begin, card


def _fields(line: str) -> tuple[str, list[str]]:
    """First field of a line and its others: 4 wide ones after ``*``, else 8."""
    if "," in line:
        head, *fields = (word.strip() for word in line.split(","))
        count = 4 if "*" in head else 8
        return head, (fields + [""] * count)[:count]
    head = line[:8].strip()
    width, count = (16, 4) if "*" in head else (8, 8)
    return head, [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]


def _whole(line: int, word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is no number of a point or "
                         f"component.") from None


def _real(line: int, word: str) -> float:
    """A number, also with D for E, or without either, as 1.5-3."""
    plain = word.upper().replace("D", "E")
    sign = max(plain.rfind("+"), plain.rfind("-"))
    if "E" not in plain and sign > 0:
        plain = f"{plain[:sign]}E{plain[sign:]}"
    try:
        return float(plain)
    except ValueError:
        raise InputError(f"Card of line {line}: {word[:40]!r} is not a number of a DMIG.") from None
