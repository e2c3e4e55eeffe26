"""Distributed loads of Abaqus and CalculiX decks: pressure, gravity, centrifugal force.

``*DLOAD`` names a set of elements or an element, a label and values:

    P1 ... P6     pressure on a side, positive into the element
    GRAV          acceleration, and its direction x, y, z
    CENTRIF       square of the angular speed, a point x, y, z of the axis, and its direction

``*DSLOAD`` names a surface, the label P and the pressure.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from fecontact.core.errors import MeshError
from fecontact.fem.mesh_files.abaqus_constraints import number_of, words_of
from fecontact.fem.mesh_files.abaqus_keywords import Options

LOADS = ("DLOAD", "DSLOAD")
# Options that make values depend on time or on user subroutines, and parts of complex loads.
_REFUSED = ("AMPLITUDE", "LOAD CASE", "IMAGINARY", "REAL", "CYCLIC MODE", "SECTOR")
_SIDE = re.compile(r"P([1-6])")

Vector = tuple[float, float, float]


@dataclass
class DistributedLoads:
    """Distributed loads of the first step, in units of the file.

    Attributes
    ----------
    pressures : list of (str, float)
        Surfaces and the pressure on them. Sides of ``*DLOAD`` with one pressure are the surface
        DLOAD-1, with the next one DLOAD-2, and so on.
    gravity : list of (str, (x, y, z))
        Element sets and the acceleration that acts on their mass.
    rotations : list of (str, float, (x, y, z), (x, y, z))
        Element sets, the square of their angular speed, a point of the axis, and its direction.
    unread : list of str
        Loads of other kinds.
    """

    pressures: list[tuple[str, float]] = field(default_factory=list)
    gravity: list[tuple[str, Vector]] = field(default_factory=list)
    rotations: list[tuple[str, float, Vector, Vector]] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    _sides: dict[float, str] = field(default_factory=dict)

    def add(
        self, keyword: str, options: Options, lines: Sequence[str]
    ) -> dict[str, list[tuple[str, int]]]:
        """Add a block; return rows of element set and side, by the name of their surface.

        Raises
        ------
        MeshError
            For missing values, and data that are no numbers.
        """
        if given := [option for option in _REFUSED if option in options]:
            self.unread.append(f"*{keyword} with {given[0]}")
            return {}
        found: dict[str, list[tuple[str, int]]] = {}
        for line in lines:
            name, label, *words = [*words_of(line), "", ""]
            label = label.upper()
            values = [number_of(word, f"*{keyword}") for word in words if word]
            least = {"GRAV": 4, "CENTRIF": 7}.get(label, 1)
            if len(values) < least and (keyword == "DSLOAD" or label in ("GRAV", "CENTRIF")
                                        or _SIDE.fullmatch(label)):
                raise MeshError(f"*{keyword} has the line '{line}' with too few values; "
                                f"{label or 'it'} needs {least}.")
            if keyword == "DSLOAD" and label == "P":
                self.pressures.append((name, values[0]))
            elif keyword == "DLOAD" and (side := _SIDE.fullmatch(label)):
                if values[0] not in self._sides:
                    self._sides[values[0]] = f"DLOAD-{len(self._sides) + 1}"
                    self.pressures.append((self._sides[values[0]], values[0]))
                found.setdefault(self._sides[values[0]], []).append((name, int(side[1])))
            elif keyword == "DLOAD" and label == "GRAV":
                size = sum(value * value for value in values[1:4]) ** 0.5
                x, y, z = (values[0] * value / (size or 1.0) for value in values[1:4])
                self.gravity.append((name, (x, y, z)))
            elif keyword == "DLOAD" and label == "CENTRIF":
                x, y, z, *axis = values[1:7]
                self.rotations.append((name, values[0], (x, y, z), (axis[0], axis[1], axis[2])))
            else:
                self.unread.append(f"*{keyword} {label}".rstrip())
        return found
