"""Matrices of Abaqus substructures: ``*SUBSTRUCTURE MATRIX OUTPUT`` as text.

The file describes a linear user element. After ``*USER ELEMENT, NODES=n, LINEAR`` comments below
``** ELEMENT NODES`` name the nodes, and data lines the degrees of freedom: those of the first node,
then, where they change, a node's position followed by its own. ``*MATRIX, TYPE=STIFFNESS`` and
``MASS`` hold the upper triangle by columns, each on lines of its own.
"""

import re

import numpy as np

from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array, Integers
from fecontact.reduction.matrix_files.names import chosen_name

HEADING = "USER ELEMENT"
# Matrices that are written as their upper triangles.
_SQUARE = ("STIFFNESS", "MASS", "DAMPING", "VISCOUS DAMPING", "STRUCTURAL DAMPING")


def read_substructure(text: str, name: str | None) -> tuple[Array, Integers]:
    """Matrix (d, d) and the labels (d, 2) of its degrees of freedom, node and direction.

    Generalised coordinates, which have no node, have the labels (0, 1), (0, 2) and on.

    Raises
    ------
    InputError
        For a file without matrices, an unknown name, and data of another length.
    """
    nodes, rows, matrices = _parts(text)
    labels = _labels(nodes, rows)
    if not matrices:
        raise InputError("The file of a substructure holds no *MATRIX; add MASS=YES, STIFFNESS=YES "
                         "to *SUBSTRUCTURE MATRIX OUTPUT.")
    chosen = chosen_name(matrices, None if name is None else name.upper())
    if chosen not in _SQUARE:
        raise InputError(f"The matrix '{chosen}' is none of {choices(_SQUARE)}; recovery matrices "
                         f"of Abaqus are not read from this file, so give them to Recovery as an "
                         f"array.")
    try:
        values = np.array([float(word) for line in matrices[chosen]
                           for word in line.replace(",", " ").split()])
    except ValueError as error:
        raise InputError(f"The matrix '{chosen}' holds something else than numbers: "
                         f"{error}.") from None
    size = len(labels)
    if len(values) != size * (size + 1) // 2:
        raise InputError(f"The matrix '{chosen}' of {size} degrees of freedom must have "
                         f"{size * (size + 1) // 2} numbers, its upper triangle, not "
                         f"{len(values)}; the file may be cut off.")
    matrix = np.zeros((size, size))
    column, row = np.tril_indices(size)
    matrix[row, column] = matrix[column, row] = values
    return matrix, labels


def _parts(text: str) -> tuple[list[int], list[list[int]], dict[str, list[str]]]:
    """Nodes, data of the user element, and the lines of each matrix."""
    nodes: list[int] = []
    rows: list[list[int]] = []
    matrices: dict[str, list[str]] = {}
    within, naming = "", False
    current: list[str] = []
    for line in text.splitlines():
        bare = line.strip()
        if bare.startswith("**"):
            words = bare.strip("* \t")
            if words.upper().startswith("ELEMENT NODES"):
                naming = True
            elif naming and re.fullmatch(r"[\d,\s-]+", words):
                nodes += [int(word) for word in words.replace(",", " ").split()]
            elif words:
                naming = False
        elif bare.startswith("*"):
            keyword, *options = (word.strip().upper() for word in bare[1:].split(","))
            within = " ".join(keyword.split())
            given = dict(option.replace(" ", "").partition("=")[::2] for option in options)
            if within == "MATRIX":
                current = matrices.setdefault(given.get("TYPE", "STIFFNESS"), [])
        elif bare and within == HEADING:
            rows.append([int(word) for word in bare.replace(",", " ").split()])
        elif bare and within == "MATRIX":
            current.append(bare)
    return nodes, rows, matrices


def _labels(nodes: list[int], rows: list[list[int]]) -> Integers:
    """Node and direction of each degree of freedom."""
    if not nodes or not rows:
        raise InputError("The file of a substructure does not name its nodes (** ELEMENT NODES) "
                         "and degrees of freedom (below *USER ELEMENT).")
    own, changes = rows[0], {row[0]: row[1:] for row in rows[1:]}
    found, generalised = [], 0
    for position, node in enumerate(nodes, start=1):
        own = changes.get(position, own)
        for direction in own:
            if node > 0:
                found.append((node, direction))
            else:
                generalised += 1
                found.append((0, generalised))
    return np.array(found, np.int64)
