"""Contents of an Abaqus or CalculiX deck: keywords that are read, skipped, and element types."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.core.checks import whole_number
from fecontact.fem.mesh_files.abaqus_constraints import READ
from fecontact.fem.mesh_files.abaqus_keywords import Deck

# Keywords of the mesh and its materials, besides those of constraints.
_MESH = ("", "NODE", "ELEMENT", "SYSTEM", "NSET", "ELSET", "SURFACE", "PART", "END PART",
         "INSTANCE", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY", "SOLID SECTION", "MATERIAL",
         "ELASTIC", "DENSITY", "DAMPING", "ORIENTATION", "INCLUDE", "HEADING", "PREPRINT")
# Loads and supports, which a study gives.
_LOADS = ("BOUNDARY", "CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE", "INITIAL CONDITIONS")
_CONTACT = ("CONTACT PAIR", "CONTACT", "CONTACT INCLUSIONS", "CONTACT PROPERTY ASSIGNMENT",
            "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION", "CLEARANCE", "GAP")


@dataclass(frozen=True)
class DeckContents:
    """Contents of a deck beside its mesh.

    Attributes
    ----------
    keywords : Counter
        Number of blocks of each keyword.
    elements : Counter
        Number of elements of each type in the parts, once for each part.
    pairs : tuple of (str, str)
        Surfaces of ``*CONTACT PAIR``.
    supports : tuple of (str, str)
        Sets that ``*BOUNDARY`` holds up to the end of the first step, and the directions x, y, z
        in which it does.
    """

    keywords: Counter[str] = field(default_factory=Counter)
    elements: Counter[str] = field(default_factory=Counter)
    pairs: tuple[tuple[str, str], ...] = ()
    supports: tuple[tuple[str, str], ...] = ()

    @property
    def loads(self) -> dict[str, int]:
        """Keywords of loads and supports, which the study gives in its own sections."""
        return self._counts(_LOADS)

    @property
    def contact(self) -> dict[str, int]:
        """Keywords of contact, which the study gives as interfaces and laws."""
        return self._counts(_CONTACT)

    @property
    def skipped(self) -> dict[str, int]:
        """Keywords that neither the mesh nor constraints nor the two above use."""
        known = {*_MESH, *READ, *_LOADS, *_CONTACT}
        return {name: count for name, count in self.keywords.items() if name not in known}

    def _counts(self, names: tuple[str, ...]) -> dict[str, int]:
        return {name: self.keywords[name] for name in names if self.keywords[name]}


def deck_contents(path: Path) -> DeckContents:
    """Read the keywords of a deck.

    Raises
    ------
    MeshError
        If the deck includes itself or a missing file.
    """
    deck = Deck(path)
    elements: Counter[str] = Counter()
    pairs: list[tuple[str, str]] = []
    supports: dict[str, str] = {}
    for keyword, options, lines in deck.blocks():
        rows = [[word.strip() for word in line.split(",")] for line in lines] if (
            keyword in ("CONTACT PAIR", "BOUNDARY")) else []
        if keyword == "ELEMENT":
            # Data of an element go on after a comma at the end of a line.
            elements[options.get("TYPE", "").upper()] += sum(
                not line.endswith(",") for line in lines)
        elif keyword == "CONTACT PAIR":
            pairs += [(row[0], row[1]) for row in rows if len(row) > 1]
        elif keyword == "BOUNDARY" and not deck.keywords["END STEP"]:
            for name, *held in rows:
                ways = supports.get(name, "") + _directions(held)
                supports[name] = "".join(way for way in "xyz" if way in ways)
    return DeckContents(deck.keywords, elements, tuple(pairs),
                        tuple((name, ways) for name, ways in supports.items() if ways))


def _directions(held: list[str]) -> str:
    """Directions that the data of *BOUNDARY hold at zero: degrees of freedom, or a name."""
    if held and held[0].upper() in ("ENCASTRE", "PINNED"):
        return "xyz"
    first = whole_number(held[0]) if held else None
    last = whole_number(held[1]) if len(held) > 1 and held[1] else first
    if first is None or last is None or (len(held) > 2 and float(held[2] or 0.0)):
        return ""
    return "".join(way for number, way in enumerate("xyz", start=1) if first <= number <= last)
