"""Files of Nastran's bulk data: grid points, plane and solid elements by property, other cards."""

import re
from array import array
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.types import Array, Integers
from fecontact.fem.mesh_files.nastran_cards import Card, Line, all_cards, real, reals, whole
from fecontact.fem.mesh_files.nastran_systems import Systems
from fecontact.fem.mesh_files.raw import CORNERS, PLANE, SOLID, RawMesh

# Kind, corners and most nodes of each element. Bars without properties name lines.
_ELEMENTS = {
    **dict.fromkeys(("CBAR", "CBEAM", "CROD", "CTUBE"), ("line", 2, 2)),
    **dict.fromkeys(("CTRIA3", "CTRIAR", "CPLSTN3", "CPLSTS3"), ("triangle", 3, 3)),
    **dict.fromkeys(("CTRIA6", "CPLSTN6", "CPLSTS6"), ("triangle", 3, 6)),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CPLSTN4", "CPLSTS4"), ("quad", 4, 4)),
    **dict.fromkeys(("CQUAD8", "CPLSTN8", "CPLSTS8"), ("quad", 4, 8)),
    **dict.fromkeys(("CQUAD", "CQUAD9"), ("quad", 4, 9)),
    "CTETRA": ("tetra", 4, 10), "CPENTA": ("wedge", 6, 15), "CHEXA": ("hexahedron", 8, 20),
    **dict.fromkeys(("CPYRAM", "CPYRA"), ("pyramid", 5, 13)),
}
# Edges in the order of the nodes in their middles.
_EDGES = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    "wedge": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)),
    "hexahedron": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6),
                   (6, 7), (7, 4)),
}
# Other elements of bodies, and cards that stiffen a mesh of plane and solid elements.
_UNREAD = re.compile(r"C(?:TRI|TRAX|QUAD|HEX|PEN|TET|PYR|PLST|SHEAR|CONE|IHEX)\w*")
_STIFFENING = re.compile(
    r"PBARL?|PBE(?:AML?|AM3|ND)|PROD|CONROD|PTUBE|CBUSH(?:1D|2D)?|CELAS\d|CDAMP\d|CVISC|CGAP|CWELD|"
    r"CFAST|CSEAM|CMASS\d|CONM\d|GENEL|NSML?1?|NSMADD|RBE1|RBAR1?|RROD|RTRPLT1?|RSPLINE|RJOINT|MPCADD|DMIG")
_SHELLS = ("PSHELL", "PCOMP", "PCOMPG")
# Fields behind the number of a card that are not read: words that stand for none, and what they do.
_FIELDS: dict[str, dict[int, tuple[tuple[str, ...], str]]] = {
    "GRID": {7: (("", "0"), "SEID, which makes a superelement")},
    "PSHELL": {7: (("",), "NSM, a mass without stiffness"),
               10: (("", "0"), "MID4, which couples stretching and bending")},
    "PPLANE": {3: (("",), "NSM, a mass without stiffness")},
    "PSOLID": {6: (("", "SMECH"), "FCTN, which makes it a fluid")},
    "PLOAD4": {12: (("", "SURF"), "SORL, which puts the load on a line"),
               13: (("", "NORM"), "LDIR, a direction along the surface")},
}


class BulkData:
    """A file of bulk data.

    Attributes
    ----------
    case : str
        Case control, in capital letters.
    cards : mapping of str to list of (line, fields)
        Cards by their names, without those of grid points and elements.
    points : (N, 3) array
        Places of the grid points in the basic system.
    numbers, row : (N,) integer array and mapping of int to int
        Numbers of the grid points, and their rows. Middles of edges that elements leave out follow
        as further points.
    permanent : mapping of str to list of int
        Rows of the grid points whose cards hold components, by the digits of these.
    turned : mapping of int to str
        Systems of the displacements of grid points, by row, where they are not basic.
    angles : mapping of int to str
        Angles, or systems, of materials of plane elements by their numbers, where they are given.
    planes : set of str
        'stress' and 'strain' of elements that have such a state.

    Raises
    ------
    MeshError, InputError
        For a file that is cut off, elements of another number of nodes, or with nodes that the file
        does not hold, numbers given twice, and words that are no numbers.
    """

    def __init__(self, path: Path) -> None:
        case: list[str] = []
        self.cards: defaultdict[str, list[Card]] = defaultdict(list)
        self.row: dict[int, int] = {}
        self.permanent: defaultdict[str, list[int]] = defaultdict(list)
        self.turned: dict[int, str] = {}
        self.angles: dict[int, str] = {}
        self.planes: set[str] = set()
        self._uneven: Line | None = None
        self._places, self._systems = array("d"), list[str]()
        # Number, property and nodes of each element in turn.
        self._found: defaultdict[tuple[str, int], array[int]] = defaultdict(lambda: array("q"))
        self._numbers: set[int] = set()
        _require_end(path)
        for line, name, fields in all_cards(path, case):
            fields += [""] * (8 - len(fields))  # wide ones may end with the fourth
            for place, (none, what) in _FIELDS.get(name, {}).items():
                word = fields[place].upper() if place < len(fields) else ""
                if word not in none and not (what.startswith("NSM") and not real(line, word)):
                    raise MeshError(f"The card {name} of line {line} has {word} in the field "
                                    f"{what}; this is not read, remove it.")
            if name == "GRID":
                self._add_point(line, fields)
            elif name in _ELEMENTS:
                self._add_element(line, name, fields)
            else:
                self.cards[name].append((line, fields))
        self.case = "\n".join(case).upper()
        self.numbers = np.fromiter(self.row, np.int64, len(self.row))
        self.systems = Systems(self.cards, self._given_place)
        self.points = self._basic()
        self.elements = {key: self._rows(key[0], np.array(found).reshape(-1, 2 + key[1]))
                         for key, found in self._found.items()}

    def _add_point(self, line: Line, fields: list[str]) -> None:
        number, place = whole(line, fields[0]), reals(line, fields[2:], 3)
        row = self.row.setdefault(number, len(self.row))
        if row < len(self._systems):
            if self._places[3 * row : 3 * row + 3].tolist() != place:
                raise MeshError(f"Line {line} gives the grid point {number} a second time, at "
                                f"another place; remove one of the cards.")
            return
        self._places.extend(place)
        self._systems.append(str(whole(line, fields[1])) if fields[1] else "")
        if fields[5]:
            self.turned[row] = fields[5]
        if fields[6] not in ("", "0"):
            self.permanent[fields[6]].append(row)

    def _add_element(self, line: Line, name: str, fields: list[str]) -> None:
        kind, corners, most = _ELEMENTS[name]
        words = ["" if word == "0" else word for word in fields[2 : 2 + most]]
        held = sum(map(bool, words))
        if not all(words[:corners]) or len(words) < corners:
            raise MeshError(f"The {name} {fields[0]} of line {line} has {held} nodes; it must have "
                            f"{corners}, the first ones being its corners.")
        count = corners if held == corners else most
        words += [""] * (count - len(words))
        number = whole(line, fields[0])
        if number in self._numbers:
            raise MeshError(f"Line {line} gives the element {number} a second time; remove one of "
                            f"the cards, or renumber it.")
        self._numbers.add(number)
        # Behind the nodes, and the thicknesses at the corners of CQUAD8.
        at = 2 + most + 4 * (most == 8)
        if kind in PLANE and fields[at : at + 1] not in ([], [""]):
            self.angles[number] = fields[at]
        if name.startswith("CPLST"):
            self.planes.add("strain" if name[5] == "N" else "stress")
        elif kind in PLANE and self._uneven is None:
            # Corners have their thicknesses behind the nodes, or on the second line.
            first = 10 + (most != 8 and corners == 3) * (most == 3)
            if any(word not in ("", "0", "0.0", "0.") for word in fields[first : first + corners]):
                self._uneven = line
        # Middles that are left out are 0.
        self._found[kind + str(count) * (count > corners), count].extend(
            (number, whole(line, fields[1] or fields[0]), *(whole(line, one or "0")
                                                             for one in words[:count])))

    def corners(self, wanted: Iterable[int]) -> dict[int, tuple[int, ...]]:
        """Rows of the corners of solid elements among the given ones, by their numbers."""
        numbers, found = np.fromiter({*wanted}, np.int64), dict[int, tuple[int, ...]]()
        for (kind, _), rows in self.elements.items():
            if kind in SOLID:
                chosen = rows[np.isin(rows[:, 0], numbers)]
                found |= {number: tuple(nodes[: SOLID[kind]])
                          for number, _, *nodes in chosen.tolist()}
        return found

    def rows(self, line: Line, words: list[str], card: str) -> Integers:
        """Rows of points, which may be ranges (THRU); words that are reals end them.

        Raises
        ------
        MeshError
            For points that the file does not hold, or none.
        """
        found: list[int] = []
        wanted = [word for word in words if word]
        while wanted:
            word = wanted.pop(0)
            if "." in word:
                break
            if word.upper() == "THRU":
                last = whole(line, wanted.pop(0)) if wanted else found[-1]
                found += [point for point in range(found[-1] + 1, last + 1) if point in self.row]
                continue
            found.append(whole(line, word))
        missing = [point for point in found if point not in self.row]
        if missing or not found:
            what = f"the point {missing[0]}, which the file does not hold" if missing else (
                "no points")
            raise MeshError(f"The card {card} of line {line} names {what}; correct its numbers.")
        return np.array([self.row[point] for point in found], np.int64)

    def of_case(self, key: str) -> str | None:
        """Number of the first set of a key in the case control, if there is one."""
        found = re.search(rf"^\s*{key}\s*=\s*(\d+)", self.case, re.MULTILINE)
        return found[1] if found else None

    def require_basic(self, card: str, rows: Integers, components: str) -> None:
        """MeshError for points of which some displacements count along axes of their own."""
        if {*"123"} <= {*components} or not {*"123"} & {*components}:
            return
        for row in rows.tolist():
            if row in self.turned:
                raise MeshError(f"The card {card} holds the component {components} of the grid "
                                f"point {self.numbers[row]} along the axes of the system "
                                f"{self.turned[row]}, which is not read; give such points "
                                f"displacements in the basic system (CD).")

    def _given_place(self, line: Line, number: int) -> Array:
        """Place of a grid point that is given in the basic system."""
        row = self.row.get(number)
        if row is None or self._systems[row] not in ("", "0"):
            raise MeshError(f"The coordinate system of line {line} lies at the grid point "
                            f"{number}, which the file does not hold in the basic system.")
        return np.array(self._places[3 * row : 3 * row + 3])

    def _basic(self) -> Array:
        found = np.array(self._places).reshape(-1, 3)
        system = turned = held = ""
        for line, fields in self.cards["GRDSET"]:
            system, turned, held = str(whole(line, fields[1] or "0")), fields[5], fields[6]
        systems = np.array([word or system or "0" for word in self._systems], dtype=str)
        for word in np.unique(systems).tolist():
            which = np.flatnonzero(systems == word)
            found[which] = self.systems.basic(int(word), found[which])
        given = dict.fromkeys(range(len(found)), turned) if turned else {}
        self.turned = {row: word for row, word in (given | self.turned).items() if word != "0"}
        if held not in ("", "0"):
            own = {row for rows in self.permanent.values() for row in rows}
            self.permanent[held] += [row for row in range(len(found)) if row not in own]
        return found

    def _rows(self, kind: str, found: Integers) -> Integers:
        """Number, property and rows of the nodes of elements; edges without a middle get one."""
        nodes = found[:, 2:]
        order = np.argsort(self.numbers)
        known = np.append(self.numbers[order], -1)
        place = np.searchsorted(known[:-1], nodes)
        lost = (known[place] != nodes) & (nodes != 0)
        if lost.any():
            element = int(np.flatnonzero(lost.any(axis=1))[0])
            raise MeshError(f"The element {found[element, 0]} names the grid point "
                            f"{nodes[element][lost[element]][0]}, which the file does not hold; "
                            f"give its card GRID, or remove the element.")
        lacking = nodes == 0
        nodes[:] = np.append(order, -1)[place]
        for column in np.flatnonzero(lacking.any(axis=0)).tolist():
            which = np.flatnonzero(lacking[:, column])
            corners = CORNERS[kind]
            edges = _EDGES[kind.rstrip("0123456789")]
            ends = nodes[which][:, edges[column - corners]] if column - corners < len(edges) else (
                nodes[which, :corners])
            nodes[which, column] = len(self.points) + np.arange(len(which))
            self.points = np.concatenate([self.points, self.points[ends].mean(axis=1)])
        return found

    def raw(self) -> RawMesh:
        """Points and elements, with groups by the numbers of properties.

        Raises
        ------
        MeshError
            For elements that are not read, and those that stiffen the mesh.
        """
        is_solid = any(kind not in PLANE and kind != "line" for kind, _ in self.elements)
        for name in self.cards:
            if _UNREAD.fullmatch(name):
                raise MeshError(f"The file holds elements {name}, which are not read; mesh with "
                                f"triangles, quadrilaterals, tetrahedra, pyramids, wedges or "
                                f"hexahedra.")
            if _STIFFENING.fullmatch(name) or (is_solid and name in _SHELLS):
                raise MeshError(
                    f"The file holds {name}, which is not read and would stiffen the mesh or give "
                    f"it mass; mesh stiffeners with solid elements, or give a deck of Abaqus or "
                    f"CalculiX, which may have couplings, equations, springs and masses, or the "
                    f"matrices of a superelement (EXTSEOUT, read_matrix).")
        if self._uneven is not None and not is_solid:
            raise MeshError(f"The element of line {self._uneven} has thicknesses at its corners "
                            f"(T1, T2, ...), which are not read; give elements of one thickness "
                            f"each property (PSHELL).")
        raw = RawMesh(self.points, [], numbers=self.numbers)
        lines: defaultdict[str, list[Integers]] = defaultdict(list)
        for (kind, _), found in self.elements.items():
            if kind != "line":
                raw.cells.append((kind, found[:, 2:]))
            for of in np.unique(found[:, 1]).tolist():
                nodes = found[found[:, 1] == of, 2:]
                if kind == "line":
                    lines[str(of)].append(nodes)
                else:
                    raw.parts.setdefault(str(of), []).append((kind, nodes))
        raw.edges = {name: np.concatenate(nodes) for name, nodes in lines.items()}
        return raw


def _require_end(path: Path) -> None:
    """MeshError for a file without ENDDATA, but one that includes others, which may have it."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if not re.search(r"^\s*(?:ENDDATA|INCLUDE)\b", text, re.MULTILINE | re.IGNORECASE):
        raise MeshError("The file has no line ENDDATA, so it may be cut off; add one if it is "
                        "complete.")
