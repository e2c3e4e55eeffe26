"""Loads and supports of Nastran's bulk data.

    PLOAD4          pressure on a side of a solid element, positive into it
    GRAV            acceleration of the whole model; all three along the axes of any system
    FORCE, MOMENT   at a grid point
    SPC, SPC1       displacements held at zero

The first ``LOAD =`` and ``SPC =`` of the case control choose the set that acts, the only set does
without them. A card LOAD adds sets up with factors.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fecontact.core.errors import choices
from fecontact.core.types import Array
from fecontact.fem.elements.cell_kinds import CELL_KINDS
from fecontact.fem.mesh_files.deck_contents import COMPONENTS, DeckContents
from fecontact.fem.mesh_files.distributed_loads import DistributedLoads
from fecontact.fem.mesh_files.nastran_bulk import BulkData
from fecontact.fem.mesh_files.nastran_cards import Line, real, reals, whole
from fecontact.fem.mesh_files.raw import RawMesh

_READ, _SUPPORTS = ("FORCE", "MOMENT", "PLOAD4", "GRAV"), ("SPC", "SPC1")
_UNREAD = ("FORCE1", "FORCE2", "MOMENT1", "MOMENT2", "PLOAD", "PLOAD1", "PLOAD2", "RFORCE",
           "ACCEL", "ACCEL1", "SPCD", "SLOAD", "TEMP", "TEMPD")


def add_load_groups(bulk: BulkData, raw: RawMesh) -> None:
    """Add the sides, points and supports that :func:`nastran_contents` names to those of a file.

    Nodes of SPC and SPC1 are the group ``SPC 7`` of set 7; those of one of several combinations of
    components are ``SPC 7 123`` too. Components that cards GRID hold are in groups ``PS 123``.

    Raises
    ------
    MeshError, InputError
        For points that the file does not hold, and words that are no numbers.
    """
    found = _Loads(bulk)
    for name, sides in found.sides.items():
        for width in (3, 4):
            if held := [side for side in sides if len(side) == width]:
                raw.faces.setdefault(name, []).append(np.array(held, np.int64))
    for point in {point for point, *_ in found.forces}:
        raw.nodes.setdefault(f"point {point}", np.array([bulk.row[point]], np.int64))
    for name, (nodes, _) in found.supports.items():
        raw.nodes.setdefault(name, np.array(sorted(nodes), np.int64))


def nastran_contents(path: Path) -> DeckContents:
    """Loads and supports of a file of bulk data; empty if it has none.

    Raises
    ------
    MeshError, InputError
        As in :func:`add_load_groups`.
    """
    bulk = BulkData(path)
    found, shells = _Loads(bulk), [*bulk.cards["PSHELL"], *bulk.cards["PPLANE"]]
    return DeckContents(
        found.keywords, supports=tuple(
            (name, " ".join(COMPONENTS[int(k) - 1] for k in components))
            for name, (_, components) in found.supports.items() if components),
        forces=tuple((f"point {point}", component, value)
                     for point, component, value in found.forces),
        distributed=found.distributed,
        planes=tuple(sorted(bulk.planes | ({"stress"} if bulk.cards["PSHELL"] else set()))),
        thicknesses=tuple(dict.fromkeys(thickness for line, fields in shells if fields[2] and (
            thickness := real(line, fields[2])))),
        properties=bool(shells or bulk.cards["PSOLID"]))


class _Loads:
    """Loads of the set that acts, in units of the file.

    Attributes
    ----------
    forces : list of (int, str, float)
        Grid points, components and values.
    sides : mapping of str to list of tuples
        Rows of the points at the corners of the sides of each surface under pressure.
    supports : mapping of str to (set of int, str)
        Rows of nodes, and the digits of the components that are held; none if they do not act.
    """

    def __init__(self, bulk: BulkData) -> None:
        self._bulk = bulk
        self.keywords: Counter[str] = Counter()
        self.distributed = DistributedLoads(
            kinds="FORCE, MOMENT, GRAV and equal pressures of PLOAD4 on sides of solid elements")
        self.forces: list[tuple[int, str, float]] = []
        self.sides: dict[str, list[tuple[int, ...]]] = {}
        self._factors = self._chosen()
        for name, first in (("FORCE", 0), ("MOMENT", 3)):
            for line, fields, factor in self._acting(name):
                (row,) = bulk.rows(line, fields[1:2], name)
                vector = self._vector(line, fields[2:], bulk.points[row])
                for component, value in zip(COMPONENTS[first:first + 3], vector, strict=True):
                    if value:
                        self.forces.append((whole(line, fields[1]), component, factor * value))
        for line, fields, factor in self._acting("GRAV"):
            if bulk.systems.frame(whole(line, fields[1] or "0"))[0] != "R":
                self.distributed.unread.append(f"GRAV along the axes of the round system "
                                               f"{fields[1]}")
                continue
            x, y, z = self._vector(line, fields[1:], np.zeros(3))
            self.distributed.gravity.append(("", (factor * x, factor * y, factor * z)))
        self._add_pressures()
        for name in _UNREAD:
            if bulk.cards[name]:
                self.distributed.unread.append(name)
        self.supports = self._supports()

    def _chosen(self) -> dict[str, float]:
        """Factors of the sets that act."""
        sums: dict[str, dict[str, float]] = {}
        for line, fields in self._bulk.cards["LOAD"]:
            sums[fields[0]] = {of: real(line, fields[1]) * real(line, factor)
                               for factor, of in zip(fields[2::2], fields[3::2], strict=False)
                               if of}
        held = {fields[0] for name in _READ for _, fields in self._bulk.cards[name]}
        wanted = self._bulk.of_case("LOAD") or (
            next(iter(sums or held)) if len(sums or held) == 1 else None)
        if wanted is None and held:
            self.distributed.unread.append(
                f"Each of the sets of loads {choices(sorted(sums or held))}, of which no LOAD = of "
                f"the case control names the one that acts,")
        return sums.get(wanted, {wanted: 1.0}) if wanted is not None else {}

    def _acting(self, name: str) -> Iterator[tuple[Line, list[str], float]]:
        """Line, fields and factor of the cards of a name that act."""
        for line, fields in self._bulk.cards[name]:
            self.keywords[name] += 1
            if fields[0] in self._factors:
                yield line, fields, self._factors[fields[0]]

    def _vector(self, line: Line, words: list[str], place: Array) -> list[float]:
        """Components in the basic system of a vector by its system, scale and direction."""
        scale, *along = reals(line, words[1:], 4)
        axes = self._bulk.systems.along(whole(line, words[0] or "0"), place)
        return [float(scale * one) for one in np.array(along) @ axes]

    def _add_pressures(self) -> None:
        loads = [(line, [*fields, *[""] * 11], factor)
                 for line, fields, factor in self._acting("PLOAD4")]
        if not loads:
            return
        row, elements = self._bulk.row, self._bulk.corners(whole(line, fields[1])
                                                           for line, fields, _ in loads)
        for line, fields, factor in loads:
            values = [real(line, word) for word in fields[2:6] if word]
            corners = elements.get(whole(line, fields[1]), ())
            side = _side(corners, *(row.get(whole(line, word)) if word else None
                                    for word in fields[6:8])
                         ) if corners and fields[6].upper() != "THRU" else None
            if any(fields[9:12]) or not values or len({*values}) > 1:
                self.distributed.unread.append("PLOAD4 with a direction or a pressure that varies")
            elif side is None:
                self.distributed.unread.append(f"PLOAD4 on no side of a solid element (the element "
                                               f"{fields[1]})")
            elif values[0]:
                name = self.distributed.surface_of(factor * values[0], "PLOAD4")
                self.sides.setdefault(name, []).append(side)

    def _supports(self) -> dict[str, tuple[set[int], str]]:
        nodes: dict[str, dict[str, set[int]]] = {}
        moved = False
        for line, fields in self._bulk.cards["SPC1"]:
            self.keywords["SPC1"] += 1
            held = self._bulk.rows(line, fields[2:], "SPC1")
            self._bulk.require_basic(f"SPC1 of line {line}", held, fields[1])
            nodes.setdefault(fields[0], {}).setdefault(fields[1], set()).update(held.tolist())
        for line, fields in self._bulk.cards["SPC"]:
            self.keywords["SPC"] += 1
            for point, components, value in zip(fields[1::3], fields[2::3], fields[3::3],
                                                strict=False):
                if not point:
                    continue
                moved |= bool(value and real(line, value))
                held = self._bulk.rows(line, [point], "SPC")
                self._bulk.require_basic(f"SPC of line {line}", held, components)
                nodes.setdefault(fields[0], {}).setdefault(components, set()).update(
                    held.tolist())
        wanted = self._bulk.of_case("SPC") or (
            next(iter(nodes)) if len(nodes) == 1 else None)
        acting: set[str | None] = {of for _, (number, *sets) in self._bulk.cards["SPCADD"]
                  for of in sets if number == wanted} or {wanted}
        if moved:
            self.distributed.unread.append("SPC with displacements other than zero")
        found: dict[str, tuple[set[int], str]] = {}
        for number, by_components in nodes.items():
            acts = number in acting and not moved
            only = next(iter(by_components)) if len(by_components) == 1 else ""
            found[f"SPC {number}"] = (set().union(*by_components.values()),
                                      _digits(only) if acts else "")
            if len(by_components) > 1:
                found |= {f"SPC {number} {components}": (rows, _digits(components) if acts else "")
                          for components, rows in by_components.items()}
        for components, points in self._bulk.permanent.items():
            if {*"123"} & {*components}:
                self._bulk.require_basic("GRID", np.array(points), components)
                found[f"PS {components}"] = {*points}, _digits(components)
        return found


def _digits(components: str) -> str:
    """Components from 1 to 6, each once."""
    return "".join(sorted({*components} & {*"123456"}))


def _side(
    corners: tuple[int, ...], first: int | None, second: int | None
) -> tuple[int, ...] | None:
    """Corners of the side that PLOAD4 names by one or two of them; None if there is none.

    Of a tetrahedron the second point is the corner opposite to the side; of others it lies across
    the side from the first one, and triangles of wedges have none.
    """
    sides = [tuple(corners[k] for k in facet) for facet in CELL_KINDS[3, len(corners)].facets]
    if len(corners) == 4:
        held = [side for side in sides if first in side and second not in side]
    elif second is None:
        held = [side for side in sides if first in side and len(side) == 3]
    else:
        held = [side for side in sides if {first, second} <= {*side} and len(side) == 4
                and abs(side.index(first) - side.index(second)) == 2]
    return held[0] if len(held) == 1 else None
