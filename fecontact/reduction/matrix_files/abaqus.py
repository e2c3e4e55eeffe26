"""Matrices written by Abaqus as text: ``*MATRIX GENERATE``, ``*MATRIX OUTPUT``.

FORMAT=COORDINATE has lines ``row column value``, counted from 1, both triangles and no heading.
FORMAT=MATRIX INPUT, the default, has lines ``node, direction, node, direction, value`` and one
triangle; negative node numbers are internal nodes (such as Lagrange multipliers). Input files may
begin with a keyword line ``*MATRIX INPUT``.
"""

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.files.stored import LARGEST
from fecontact.core.types import Array, Integers
from fecontact.reduction.matrix_files.names import chosen_name

Ints = Integers

_LARGEST_LABEL = 999_999_999  # of a node, in Abaqus
_KEYWORD = re.compile(r"^[ \t]*\*(?!\*)(.*)$", re.MULTILINE)


@dataclass(frozen=True)
class _Block:
    """Lines of numbers after a keyword line, which is empty for files without keywords."""

    keyword: str
    options: dict[str, str]
    text: str
    first_line: int


def read_abaqus_matrix(path: Path, name: str | None) -> tuple[Any, Ints | None]:
    """Sparse matrix (d, d) and the labels (d, 2) of its degrees of freedom, node and direction.

    COORDINATE files have no labels. Labelled degrees of freedom are ordered by node and
    direction, those of internal nodes last.

    Raises
    ------
    InputError
        For an invalid line (with its number), a repeated entry, or another kind of file.
    """
    blocks = list(_blocks(path.read_text(encoding="utf-8", errors="replace")))
    block = _chosen(blocks, name)
    table = _table(block)
    width = table.shape[1]
    if width == 6:
        raise InputError("The file has six columns, one matrix for each element; leave out ELEMENT "
                         "BY ELEMENT in *MATRIX GENERATE.")
    if width not in (3, 5):
        raise InputError(f"Line {_line(block, 0)} has {width} columns; there must be three (row, "
                         f"column, value) or five (node, direction, node, direction, value).")
    numbers, values = table[:, :-1], table[:, -1]
    whole = (numbers == np.round(numbers)).all(axis=1)
    if not whole.all():
        raise InputError(f"Line {_line(block, int(np.argmin(whole)))} has a row, column, node or "
                         f"direction that is no whole number.")
    large = np.abs(numbers).max(axis=1) > (LARGEST if width == 3 else _LARGEST_LABEL)
    if large.any():
        raise InputError(f"Line {_line(block, int(np.argmax(large)))} has the number "
                         f"{np.abs(numbers).max():.6g}, which is too large for a row, column, node "
                         f"or direction.")
    places = numbers.astype(np.int64)
    labels = None
    if width == 3:
        if places.min() < 1:
            raise InputError(f"Line {_line(block, int(np.argmin(places.min(axis=1))))} has the row "
                             f"or column {places.min()}; they are counted from 1.")
        places -= 1
    else:
        places, labels = _numbered(places)
    factor = block.options.get("SCALE FACTOR", "")
    matrix = _matrix(places, values * float(factor or 1.0), block)
    return matrix, labels


def _blocks(text: str) -> Iterator[_Block]:
    """The blocks between keyword lines."""
    options: dict[str, str] = {}
    keyword, start = "", 0
    for found in [*_KEYWORD.finditer(text), None]:
        end = len(text) if found is None else found.start()
        content = text[start:end]
        if keyword or re.search(r"^[ \t]*[^\s*]", content, re.MULTILINE):
            yield _Block(keyword, options, content, 1 + text.count("\n", 0, start))
        if found is not None:
            words = [word.strip() for word in found[1].split(",")]
            keyword, start = " ".join(words[0].upper().split()), found.end()
            pairs = [word.partition("=") for word in words[1:]]
            options = {key.strip().upper(): value.strip() for key, _, value in pairs}


def _chosen(blocks: list[_Block], name: str | None) -> _Block:
    """The block to read, by name or as the only one."""
    for block in blocks:
        if block.keyword not in ("", "MATRIX INPUT"):
            kind = "loads" if block.keyword == "CLOAD" else "something else"
            raise InputError(f"The file holds {kind} (*{block.keyword}), not a matrix from *MATRIX "
                             f"OUTPUT.")
        if "INPUT" in block.options:
            raise InputError(f"The file refers to '{block.options['INPUT']}' (INPUT=); read that "
                             f"one.")
    named = {block.options.get("NAME", ""): block for block in blocks}
    if name is None and len(blocks) == 1:
        return blocks[0]
    if not blocks:
        raise InputError("The file holds no numbers.")
    return named[chosen_name([block.options.get("NAME", "") for block in blocks], name)]


def _table(block: _Block) -> Array:
    """All numbers of a block, a row for each line."""
    if next(_lines(block), None) is None:
        raise InputError("The file holds no numbers.")
    try:
        return np.loadtxt(io.StringIO(block.text.replace(",", " ")), comments="*", ndmin=2)
    except ValueError:
        width = 0
        for number, words in _lines(block):
            for word in words:
                try:
                    float(word)
                except ValueError:
                    raise InputError(f"Line {number}: {word[:40]!r} is not a number; write "
                                     f"matrices with FORMAT=COORDINATE or FORMAT=MATRIX "
                                     f"INPUT.") from None
            width = width or len(words)
            if len(words) != width:
                raise InputError(f"Line {number} has {len(words)} columns, but the lines before "
                                 f"it have {width}.") from None
        raise


def _lines(block: _Block) -> Iterator[tuple[int, list[str]]]:
    """Lines of numbers with their number in the file."""
    for number, line in enumerate(block.text.splitlines(), block.first_line):
        words = line.partition("*")[0].replace(",", " ").split()
        if words:
            yield number, words


def _line(block: _Block, row: int) -> int:
    """Number of the line that holds a row of the table."""
    return next(number for k, (number, _) in enumerate(_lines(block)) if k == row)


def _numbered(places: Ints) -> tuple[Ints, Ints]:
    """Rows and columns (e, 2) and labels (d, 2) from nodes and directions (e, 4)."""
    pairs = places.reshape(-1, 2)
    keys = np.column_stack([pairs[:, 0] < 0, np.abs(pairs[:, 0]), pairs[:, 1]])
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return number.reshape(-1, 2), pairs[first]


def _matrix(places: Ints, values: Array, block: _Block) -> Any:
    """Sparse matrix of entries; one triangle alone is mirrored."""
    import scipy.sparse as sp

    size = int(places.max()) + 1
    rows, columns = places.T
    keys = rows * size + columns
    order = np.argsort(keys, kind="stable")
    twice = order[1:][np.diff(keys[order]) == 0]
    if twice.size:
        raise InputError(f"Line {_line(block, int(twice[0]))} gives an entry a second time.")
    beside = rows != columns
    mirrored = (columns * size + rows)[beside]
    unsymmetric = block.options.get("TYPE", "").upper() == "UNSYMMETRIC"
    if not unsymmetric and not np.isin(mirrored, keys).any():
        rows, columns, values = (np.concatenate([one, other[beside]]) for one, other in (
            (rows, columns), (columns, rows), (values, values)))
    return sp.csc_array((values, (rows, columns)), shape=(size, size))
