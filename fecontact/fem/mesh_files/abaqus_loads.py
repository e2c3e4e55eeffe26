"""Distributed loads of Abaqus and CalculiX decks: pressure, gravity, centrifugal force.

``*DLOAD`` names a set of elements or an element, a label and values:

    P1 ... P6     pressure on a side, positive into the element
    GRAV          acceleration, and its direction x, y, z
    CENTRIF       square of the angular speed, a point x, y, z of the axis, and its direction

``*DSLOAD`` names a surface, the label P and the pressure.
"""

import re
from collections.abc import Iterator, Sequence

from fecontact.core.checks import whole_number
from fecontact.core.errors import MeshError
from fecontact.fem.mesh_files.abaqus_constraints import number_of, words_of
from fecontact.fem.mesh_files.abaqus_keywords import Options
from fecontact.fem.mesh_files.distributed_loads import DistributedLoads

LOADS = ("DLOAD", "DSLOAD")
KINDS = "supports at zero, forces, P, P1 to P6, GRAV and CENTRIF without other options"
# Options that make values depend on time or on user subroutines, and parts of complex loads.
_REFUSED = ("AMPLITUDE", "LOAD CASE", "IMAGINARY", "REAL", "CYCLIC MODE", "SECTOR")
_SIDE = re.compile(r"P([1-6])")


def add_loads(
    loads: DistributedLoads, keyword: str, options: Options, lines: Sequence[str]
) -> dict[str, list[tuple[str, int]]]:
    """Add a block; return rows of element set and side, by the name of their surface.

    Sides of ``*DLOAD`` with one pressure are the surface DLOAD-1, with the next one DLOAD-2, ...

    Raises
    ------
    MeshError
        For missing values, and data that are no numbers.
    """
    if given := [option for option in _REFUSED if option in options]:
        loads.unread.append(f"*{keyword} with {given[0]}")
        return {}
    found: dict[str, list[tuple[str, int]]] = {}
    for line in lines:
        # An empty name means all elements, an empty value zero.
        name, label, *words = [*(word.strip() for word in line.rstrip(", ").split(",")), ""]
        label = label.upper()
        values = [number_of(word, f"*{keyword}") for word in words[:-1]] if words else []
        least = {"GRAV": 4, "CENTRIF": 7}.get(label, 1)
        if len(values) < least and (keyword == "DSLOAD" or label in ("GRAV", "CENTRIF")
                                    or _SIDE.fullmatch(label)):
            raise MeshError(f"*{keyword} has the line '{line}' with too few values; "
                            f"{label or 'it'} needs {least}.")
        if keyword == "DSLOAD" and label == "P":
            loads.pressures.append((name, values[0]))
        elif keyword == "DLOAD" and name and (side := _SIDE.fullmatch(label)):
            found.setdefault(loads.surface_of(values[0], keyword), []).append(
                (name, int(side[1])))
        elif keyword == "DLOAD" and label == "GRAV":
            size = sum(value * value for value in values[1:4]) ** 0.5
            x, y, z = (values[0] * value / (size or 1.0) for value in values[1:4])
            loads.gravity.append((name, (x, y, z)))
        elif keyword == "DLOAD" and label == "CENTRIF":
            x, y, z, *axis = values[1:7]
            loads.rotations.append((name, values[0], (x, y, z), (axis[0], axis[1], axis[2])))
        else:
            loads.unread.append(f"*{keyword} {label}".rstrip())
    return found


def node_of(word: str) -> tuple[str, str] | None:
    """Instance, perhaps none, and number of a node that a word names; None for a set."""
    instance, _, number = word.rpartition(".")
    return None if whole_number(number) is None else (instance, number)


def groups_of_nodes(keyword: str, lines: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Groups for the nodes that ``*BOUNDARY`` or ``*CLOAD`` name by their numbers, and these.

    Each with the instance of the node, empty where none is named. The group of a loaded node 60 is
    ``node 60``; held nodes are in ``BOUNDARY 1-3`` together, by the degrees of freedom or the name
    in their line.
    """
    for line in lines:
        word, *values = words_of(line)
        if found := node_of(word):
            instance, number = found
            ways = "-".join(dict.fromkeys(one for one in values[:2] if one))
            yield (f"node {number}" if keyword == "CLOAD" else f"BOUNDARY {ways}", number,
                   instance)
