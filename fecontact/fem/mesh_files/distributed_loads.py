"""Distributed loads that a file of any format gives: pressure, gravity, centrifugal force."""

from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass
class DistributedLoads:
    """Distributed loads of the first step, in units of the file.

    Attributes
    ----------
    pressures : list of (str, float)
        Surfaces and the pressure on them, positive into the body.
    gravity : list of (str, (x, y, z))
        Element sets, all for an empty name, and the acceleration that acts on their mass.
    rotations : list of (str, float, (x, y, z), (x, y, z))
        Element sets, the square of their angular speed, a point of the axis, and its direction.
    unread : list of str
        Loads of other kinds.
    kinds : str
        Kinds of loads that are read, for messages.
    notes : list of str
        Sentences on supports and forces that are left out.
    """

    pressures: list[tuple[str, float]] = field(default_factory=list)
    gravity: list[tuple[str, Vector]] = field(default_factory=list)
    rotations: list[tuple[str, float, Vector, Vector]] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    kinds: str = ""
    notes: list[str] = field(default_factory=list)
    _sides: dict[float, str] = field(default_factory=dict)

    def surface_of(self, pressure: float, keyword: str) -> str:
        """Name of the surface of all sides with a pressure: DLOAD-1, then DLOAD-2, ..."""
        if pressure not in self._sides:
            self._sides[pressure] = f"{keyword}-{len(self._sides) + 1}"
            self.pressures.append((self._sides[pressure], pressure))
        return self._sides[pressure]
