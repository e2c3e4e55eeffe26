"""Coordinate systems of Nastran's bulk data: CORD1R, CORD1C, CORD1S, CORD2R, CORD2C, CORD2S."""

from collections.abc import Callable, Mapping

import numpy as np

from fecontact.core.errors import MeshError, choices
from fecontact.core.types import Array
from fecontact.fem.mesh_files.coordinates import cartesian, directions
from fecontact.fem.mesh_files.nastran_cards import Card, Line, reals, whole

_PARALLEL = 1e-9  # sine of the angle between two axes that span no plane


class Systems:
    """Coordinate systems by their numbers.

    Parameters
    ----------
    cards : mapping of str to list of (line, fields)
        Cards of a file by their names.
    place_of : callable of (line, number)
        Place (3,) of a grid point in the basic system, for the cards CORD1.
    """

    def __init__(
        self, cards: Mapping[str, list[Card]], place_of: Callable[[Line, int], Array]
    ) -> None:
        self._place_of = place_of
        self._given: dict[int, tuple[str, Line, list[str]]] = {}
        for kind in "RCS":
            for line, fields in cards.get(f"CORD2{kind}", []):
                self._given[whole(line, fields[0])] = kind, line, fields
            for line, fields in cards.get(f"CORD1{kind}", []):
                for four in (fields[:4], fields[4:8]):
                    if four[0]:
                        self._given[whole(line, four[0])] = kind, line, four
        self._frames: dict[int, tuple[str, Array, Array]] = {0: ("R", np.zeros(3), np.eye(3))}

    def frame(self, number: int, outer: tuple[int, ...] = ()) -> tuple[str, Array, Array]:
        """Kind R, C or S of a system, its origin and its axes (rows) in the basic system.

        Raises
        ------
        MeshError
            For an unknown system, one that refers to itself, and points that span no plane.
        """
        if number in self._frames:
            return self._frames[number]
        if number not in self._given:
            raise MeshError(f"The file refers to the coordinate system {number}, which it does not "
                            f"hold; its systems are: {choices(map(str, sorted(self._given)))}.")
        kind, line, fields = self._given[number]
        if number in outer:
            raise MeshError(f"The coordinate system {number} of line {line} refers to itself.")
        if len(fields) == 4:
            points = np.array([self._place_of(line, whole(line, word)) for word in fields[1:]])
        else:
            at = np.array(reals(line, fields[2:], 9)).reshape(3, 3)
            points = self._basic(whole(line, fields[1] or "0"), at, (*outer, number))
        origin, z, x = points[0], points[1] - points[0], points[2] - points[0]
        y = np.cross(z, x)
        if not np.linalg.norm(y) > _PARALLEL * np.linalg.norm(z) * np.linalg.norm(x):
            raise MeshError(f"The three points of the coordinate system {number} of line {line} "
                            f"lie on one line; give a point beside the z axis.")
        y, z = y / np.linalg.norm(y), z / np.linalg.norm(z)
        self._frames[number] = kind, origin, np.array([np.cross(y, z), y, z])
        return self._frames[number]

    def basic(self, number: int, places: Array) -> Array:
        """Places (k, 3) in the basic system from coordinates in a system, angles in degrees."""
        return self._basic(number, places, ())

    def along(self, number: int, place: Array) -> Array:
        """Unit vectors (3, 3), by rows, of the axes of a system at a place (3,), both basic.

        Of a cylindrical system they point along r, theta, z, of a spherical one along r, theta from
        the z axis, phi about it.
        """
        kind, origin, axes = self.frame(number)
        own = directions(((place - origin) @ axes.T)[None], kind)[0]
        if kind == "S":
            own = np.array([own[0], -own[2], own[1]])
        return np.asarray(own @ axes)

    def _basic(self, number: int, places: Array, outer: tuple[int, ...]) -> Array:
        kind, origin, axes = self.frame(number, outer)
        if kind == "S":  # r, the angle from the z axis, and that about it
            places = np.column_stack([places[:, 0], places[:, 2], 90.0 - places[:, 1]])
        return np.asarray(origin + cartesian(places, kind) @ axes)
