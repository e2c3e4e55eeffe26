"""Matrices of Nastran: DMIG in bulk data and punch files (.pch, .dmig, .bdf), OUTPUT4 and OUTPUT2.

A heading ``DMIG, NAME, 0, IFO, TIN`` says by IFO whether the matrix is square (1) or symmetric
(6), of which one triangle is given. Each column ``DMIG, NAME, GJ, CJ, , G1, C1, A1, B1, G2, ...``
holds the values A of rows (grid point G, component C); components of scalar points are 0. Fields
are 8 or, after ``*``, 16 characters wide, or parted by commas.

Files of OUTPUT4 (.op4) and OUTPUT2 (.op2) are read by pyYeti. They do not name the degrees of
freedom; those of an external superelement are named by the card EXTRN of the file that Nastran
punches beside it: points, each with digits of its components, 0 for scalar points. Record 2 of the
table DTI, TUG1 there names the rows of MUG1, which recovers displacements: type, point, number of
components and first row, in turn.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_regular_file
from fecontact.core.errors import InputError, require_positive
from fecontact.core.extras import optional
from fecontact.core.types import Array, Integers
from fecontact.fem.mesh_files.nastran_cards import Line, cards, real, whole
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
    for line, fields in cards(path, "DMIG"):
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
    """Sparse matrix, and the labels of its rows (k, 2) if a file beside has them.

    Raises
    ------
    InputError
        For an unknown name, or a card EXTRN that cannot be read.
    MissingLibraryError
        If pyYeti is not installed.
    """
    op4 = optional("pyyeti.nastran.op4", "Reading OUTPUT4 of Nastran")
    found = {key.upper(): matrix for key, matrix in op4.read(str(path), sparse=True).items()}
    chosen = chosen_name(found, None if name is None else name.upper())
    matrix = found[chosen]
    for suffix in _PUNCHED:
        beside = path.with_suffix(suffix)
        if not beside.is_file():
            continue
        square = matrix.shape[0] == matrix.shape[1]
        labels = _external(beside) if square else None
        if labels is None or len(labels) != matrix.shape[0]:
            labels = _recovered(beside, f"T{chosen[1:]}")
        if labels is not None and len(labels) == matrix.shape[0]:
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
    for line, fields in cards(path, "EXTRN"):
        words = [word for word in fields if word]
        if len(words) % 2:
            raise InputError(f"Card EXTRN of line {line} of {path} ends after a point.")
        points = [whole(line, word) for word in words[::2]]
        return np.array([(point, int(digit)) for point, digits in zip(points, words[1::2],
                                                                     strict=True)
                         for digit in digits], np.int64)
    return None


def _recovered(path: Path, table: str) -> Integers | None:
    """Points and components (k, 2) of the rows of a recovery matrix; None without its table."""
    for line, fields in cards(path, "DTI"):
        if [fields[0].upper(), fields[1]] != [table, "2"]:
            continue
        words = [word for word in fields[2:] if word]
        words = [word for word in words if word not in ("TYPE", "ID", "COMP", "ROW", "ENDREC")]
        if len(words) % 4:
            raise InputError(f"Card DTI, {table}, 2 of line {line} of {path} has no groups of "
                             f"type, point, components and row.")
        numbers = np.array([whole(line, word) for word in words], np.int64).reshape(-1, 4)
        labels = [(point, one + 1) for _, point, count, _ in numbers.tolist()
                  for one in range(count)]
        starts = np.concatenate([[0], np.cumsum(numbers[:, 2])])[:-1] + 1
        if (numbers[:, 3] != starts).any():
            raise InputError(f"Card DTI, {table}, 2 of line {line} of {path} gives rows that do "
                             f"not follow each other.")
        return np.array(labels, np.int64).reshape(-1, 2)
    return None


def grid_places(path: str | Path, scale: float = 1.0) -> dict[int, Array]:
    """Places of the grid points of a file of Nastran's, for :class:`~fecontact.reduction.Recovery`.

    Cards GRID of bulk data and punch files, with fields of 8 or 16 characters or parted by commas.

    Parameters
    ----------
    path : str or Path
        The file.
    scale : float
        Metres per unit of the file: 0.001 for millimetres.

    Returns
    -------
    dict of int to (3,) array
        Place of each point by its number [m].

    Raises
    ------
    InputError
        For a file without grid points, with a point twice at different places, and points whose
        places or displacements are in local coordinate systems.
    """
    path = as_path(path, "grid points")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    require_regular_file(path, "grid points")
    require_positive("grid_places", scale=scale)
    found: dict[int, Array] = {}
    try:
        for line, fields in cards(path, "GRID"):
            number, system, *place, displaced = (fields + [""] * 6)[:6]
            if {system or "0", displaced or "0"} != {"0"}:
                raise InputError(f"Card of line {line}: point {number} is in the local coordinate "
                                 f"system {displaced or system}; write places and displacements "
                                 f"in the basic one.")
            at = scale * np.array([real(line, word or "0.0") for word in place])
            point = whole(line, number)
            if np.abs(found.setdefault(point, at) - at).max() > 0.0:
                raise InputError(f"Card of line {line}: point {point} is given a second time, at "
                                 f"another place.")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if not found:
        raise InputError(f"{path}: the file holds no cards GRID.")
    return found


def _column(line: Line, fields: list[str]) -> Iterator[tuple[int, int, int, int, float]]:
    """Point and component of a column, then of a row, and the value, of one card."""
    point, component = (whole(line, word) for word in fields[:2])
    # Rows have four fields: point, component, real and imaginary part.
    for start in range(3, len(fields), 4):
        group = fields[start : start + 3]
        if not any(group):
            continue
        if len(group) < 3:
            raise InputError(f"Card of line {line} ends within an entry of a DMIG, so the file may "
                             f"be cut off.")
        yield point, component, whole(line, group[0]), whole(line, group[1]), real(
            line, group[2])
