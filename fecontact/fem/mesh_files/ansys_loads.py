"""Loads and supports of Ansys archives: SFE, ACEL, OMEGA, F and D, alone or in blocks.

SFE gives a pressure on a face of a solid element, positive into it, ACEL the acceleration of the
frame, so that gravity acts the opposite way, OMEGA an angular velocity about the axes of the model,
F a force or moment at a node, D displacements that are held at zero.
"""

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.extras import optional
from fecontact.core.types import Array
from fecontact.fem.mesh_files.deck_contents import COMPONENTS, DeckContents, along_coordinates
from fecontact.fem.mesh_files.distributed_loads import DistributedLoads

# Node, label and value; element, face, label, and its values on this line or after R5.0.
_AT_NODE = re.compile(r"^\s*([DF])\s*,\s*(\d+)\s*,\s*(\w+)\s*,([^\n]*)",
                      re.MULTILINE | re.IGNORECASE)
_ON_FACE = re.compile(r"^\s*SFE\s*,\s*(\d+)\s*,\s*(\d+)\s*,\s*(\w+)\s*,\s*(\d*)\s*,([^\n]*)"
                      r"(?:(?=\n([^\n]*)))?", re.MULTILINE | re.IGNORECASE)
# Blocks of recent archives: a line of formats, then a row for each node, or face and kind of value.
_BLOCK = re.compile(r"^\s*(DBLOCK|FBLOCK|SFEBLOCK)\s*,([^\n]*)\n\([^\n]*\n((?:[ \t]*\d[^\n]*\n)*)",
                    re.MULTILINE | re.IGNORECASE)
_OF_ALL = re.compile(r"^\s*(ACEL|OMEGA)\s*,([^\n]*)", re.MULTILINE | re.IGNORECASE)
# Types of elements and their options 3; plane elements, and options of plane strain.
_TYPE = re.compile(r"^\s*ET\s*,\s*(\d+)\s*,\s*(?:PLANE)?(\d+)", re.MULTILINE | re.IGNORECASE)
_OPTION = re.compile(r"^\s*KEYOPT?\s*,\s*(\d+)\s*,\s*3\s*,\s*(\d+)", re.MULTILINE | re.IGNORECASE)
_PLANE, _STRAIN, _WITH_THICKNESS = ("2", "42", "82", "182", "183"), ("2", "5"), "3"
# Real constants, by a command or in a block; and elements, with their material, type and set of
# real constants first.
_REAL = re.compile(r"^\s*R\s*,\s*(\d+)\s*,([^\n]*)", re.MULTILINE | re.IGNORECASE)
_REALS = re.compile(r"^\s*RLBLOCK\s*,[^\n]*\n\([^\n]*\n\([^\n]*\n((?:[ \t]*[-\d][^\n]*\n)*)",
                    re.MULTILINE | re.IGNORECASE)
_ELEMENTS = re.compile(r"^\s*EBLOCK\s*,[^\n]*\n\([^\n]*\n((?:[ \t]*\d[^\n]*\n)*)",
                       re.MULTILINE | re.IGNORECASE)
_LABELS = {"F": ("FX", "FY", "FZ", "MX", "MY", "MZ"),
           "D": ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")}


@dataclass
class ArchiveLoads:
    """Loads and supports in units of the file.

    Attributes
    ----------
    forces : list of (int, str, float)
        Numbers of nodes, components and values.
    sides : mapping of str to list of (int, int)
        Numbers of elements and of their faces, by the surface under pressure.
    supports : mapping of str to list of int
        Numbers of the nodes that are held in the same components, by their labels.
    counts : Counter
        Number of commands of each kind that act.
    """

    forces: list[tuple[int, str, float]] = field(default_factory=list)
    sides: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    supports: dict[str, list[int]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    distributed: DistributedLoads = field(default_factory=lambda: DistributedLoads(
        kinds="F, D of zero, equal PRES of SFE on faces of solid elements, ACEL and OMEGA"))


def archive_loads(text: str) -> ArchiveLoads:
    """Loads and supports in the text of an archive.

    Raises
    ------
    MeshError
        For values that are no numbers.
    """
    found = ArchiveLoads()
    held: dict[int, set[str]] = {}
    unread = found.distributed.unread
    at_nodes, on_faces = _AT_NODE.findall(text), [
        (element, face, label, key, following if rest.strip().upper().startswith("R") else rest)
        for element, face, label, key, rest, following in _ON_FACE.findall(text)]
    for command, head, rows in _BLOCK.findall(text):
        for row in map(str.split, rows.splitlines()):
            if command.upper() == "SFEBLOCK":
                on_faces.append((row[0], row[1], head.split(",")[1].strip(), row[2],
                                 ",".join(row[3:])))
            else:
                at_nodes.append((command[0], row[0], row[1], ",".join(row[2:])))
    for command, node, label, rest in at_nodes:
        found.counts[command.upper()] += 1
        value = (_numbers(command, rest) or [0.0])[0]
        known = _LABELS[command.upper()]
        if label.upper() not in (*known, *(["ALL"] if command.upper() == "D" else [])):
            unread.append(f"{command.upper()} {label.upper()}")
        elif command.upper() == "F" and value:
            found.forces.append((int(node), COMPONENTS[known.index(label.upper())], value))
        elif command.upper() == "D" and value:
            unread.append(f"D {label.upper()} other than zero")
        elif command.upper() == "D":
            held.setdefault(int(node), set()).update(
                known if label.upper() == "ALL" else [label.upper()])
    for point, labels in held.items():
        name = " ".join(["D", *(one for one in _LABELS["D"] if one in labels)])
        found.supports.setdefault(name, []).append(point)
    for element, face, label, key, rest in on_faces:
        values = _numbers("SFE", ",".join(rest.split()))
        if key == "2" and not any(values):  # the imaginary part
            continue
        found.counts["SFE"] += 1
        if label.upper() != "PRES" or key not in ("", "0", "1") or len({*values}) != 1:
            unread.append("SFE of another label, or with a pressure that varies")
        elif values[0]:
            found.sides.setdefault(found.distributed.surface_of(values[0], "SFE"), []).append(
                (int(element), int(face)))
    for command, rest in _OF_ALL.findall(text):
        x, y, z = (*_numbers(command, rest), 0.0, 0.0, 0.0)[:3]
        square = x * x + y * y + z * z
        found.counts[command.upper()] += bool(square)
        if command.upper() == "ACEL" and square:
            found.distributed.gravity.append(("", (-x, -y, -z)))
        elif square:
            found.distributed.rotations.append(("", square, (0.0, 0.0, 0.0), (x, y, z)))
    if body_loads := re.findall(r"^\s*BF(?:BLOCK)?\s*,", text, re.MULTILINE | re.IGNORECASE):
        found.counts["BF"] = len(body_loads)
        unread.append("BF")
    return found


def plane_states(text: str) -> set[str]:
    """Options 3 of the plane elements of an archive.

    '0' and '3' are plane stress, '1' is axisymmetry, '2' and '5' are plane strain.
    """
    options = dict(_OPTION.findall(text))
    return {options.get(kind, "0") for kind, name in _TYPE.findall(text) if name in _PLANE}


def thicknesses(text: str) -> tuple[float, ...]:
    """Real constants of the elements in plane stress with a thickness, each once.

    Raises
    ------
    MeshError
        For values that are no numbers.
    """
    options = dict(_OPTION.findall(text))
    kinds = {kind for kind, name in _TYPE.findall(text)
             if name in _PLANE and options.get(kind) == _WITH_THICKNESS}
    used = {row[2]: None for rows in _ELEMENTS.findall(text)
            for row in map(str.split, rows.splitlines()) if len(row) > 10 and row[1] in kinds}
    found = {number: _numbers("R", rest)[:1] for number, rest in _REAL.findall(text)}
    for rows in _REALS.findall(text):
        for row in map(str.split, rows.splitlines()):
            # Rows of a set that goes on hold values alone.
            if len(row) > 2 and row[0].isdigit() and row[1].isdigit():
                found[row[0]] = _numbers("RLBLOCK", row[2])
    return tuple(dict.fromkeys(value for number in used for value in found.get(number, ())
                               if value > 0.0))


def archive_contents(path: Path) -> DeckContents:
    """Loads and supports of an archive as those of a deck.

    F and D act along the axes of their nodes, which the angles of NBLOCK turn.

    Raises
    ------
    MeshError
        As in :func:`archive_loads`.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    found = archive_loads(text)
    contents = DeckContents(
        found.counts, supports=tuple(
            (name, " ".join(COMPONENTS[_LABELS["D"].index(label)] for label in name.split()[1:]))
            for name in found.supports),
        forces=tuple((f"node {node}", component, value)
                     for node, component, value in found.forces),
        distributed=found.distributed, planes=tuple(sorted({
            "strain" if state in _STRAIN else "stress" for state in plane_states(text)})),
        thicknesses=thicknesses(text))
    read = optional("mapdl_archive", "Reading Ansys archives").Archive(str(path), parse_vtk=False)
    if not read.node_angles.any():
        return contents
    angles = dict(zip(read.nnum.tolist(), read.node_angles, strict=True))

    def axes_of(name: str) -> Array:
        nodes = found.supports.get(name) or [int(name.removeprefix("node "))]
        return _turned_axes(np.array([angles.get(node, np.zeros(3)) for node in nodes]))

    return along_coordinates(contents, axes_of)


def _turned_axes(angles: Array) -> Array:
    """Axes (k, 3, 3), by rows, of nodes with the angles (k, 3) THXY, THYZ, THZX [degrees].

    These turn about z, then about the turned x, then about the turned y.
    """
    axes = np.tile(np.eye(3), (len(angles), 1, 1))
    for k, column in zip((2, 0, 1), np.radians(angles).T, strict=True):
        cosine, sine = np.cos(column)[:, None], np.sin(column)[:, None]
        first, second = axes[:, (k + 1) % 3].copy(), axes[:, (k + 2) % 3].copy()
        axes[:, (k + 1) % 3] = cosine * first + sine * second
        axes[:, (k + 2) % 3] = cosine * second - sine * first
    return axes


def _numbers(command: str, text: str) -> list[float]:
    """Numbers between commas, without empty places, and what follows them after spaces."""
    try:
        return [float(word.split()[0]) for word in text.split(",") if word.strip()]
    except ValueError:
        raise MeshError(f"A command {command.upper()} holds the values '{text.strip()[:60]}', "
                        f"which are no numbers.") from None
