"""Constraints of Nastran's bulk data: RBE2, RBE3 and MPC.

RBE2 lets nodes follow a grid point as a rigid body, RBE3 gives a grid point the mean motion of
nodes, MPC are linear equations.
"""

from collections.abc import Iterator

import numpy as np

from fecontact.core.errors import MeshError, choices
from fecontact.fem.constraints import Constraint, Coupling, LinearEquation, Term
from fecontact.fem.mesh_files.nastran_bulk import BulkData
from fecontact.fem.mesh_files.nastran_cards import Line, real, whole
from fecontact.fem.mesh_files.raw import RawMesh


def add_constraints(bulk: BulkData, raw: RawMesh) -> None:
    """Add constraints of a file to its contents, and groups of nodes that these name.

    Raises
    ------
    MeshError
        For points that the file does not hold, and constraints of kinds that are not read.
    """
    found = [*_rigid(bulk, raw), *_means(bulk, raw), *_equations(bulk, raw)]
    raw.constraints += found
    raw.apart = raw.apart or bool(found)


def _reference(bulk: BulkData, line: Line, word: str, raw: RawMesh, card: str) -> str:
    """Name of the group of a point that others follow."""
    node = bulk.rows(line, [word], card)
    raw.nodes.setdefault(f"point {word}", node)
    return f"point {word}"


def _axes(components: str) -> list[list[float]] | None:
    """Directions of the displacements among components, None for all three."""
    chosen = [k for k in range(3) if str(k + 1) in components]
    return None if len(chosen) == 3 else np.eye(3)[chosen].tolist()


def _rigid(bulk: BulkData, raw: RawMesh) -> Iterator[Constraint]:
    for line, fields in bulk.cards["RBE2"]:
        name, components = f"RBE2 {fields[0]}", fields[2]
        reference = _reference(bulk, line, fields[1], raw, name)
        if not set(components) & set("123"):
            raise MeshError(f"The card {name} of line {line} holds the components {components!r}, "
                            f"no displacements, which are 1, 2 and 3.")
        raw.nodes[name] = bulk.rows(line, fields[3:], name)
        bulk.require_basic(f"{name} of line {line}", raw.nodes[name], components)
        yield Coupling(name, reference, tuple(raw.points[raw.nodes[reference][0]]),
                       axes=_axes(components), name=name)


def _means(bulk: BulkData, raw: RawMesh) -> Iterator[Constraint]:
    for line, fields in bulk.cards["RBE3"]:
        name = f"RBE3 {fields[0]}"
        if not {*"123"} <= {*fields[3]}:
            raise MeshError(f"The card {name} of line {line} moves its reference point in the "
                            f"components {fields[3]!r} alone; REFC must hold 1, 2 and 3.")
        reference = _reference(bulk, line, fields[2], raw, name)
        parts: list[tuple[float, list[str]]] = []
        words = [word for word in fields[4:] if word]
        while words and words[0].upper() not in ("UM", "ALPHA"):
            word = words.pop(0)
            if "." in word:
                parts.append((real(line, word), []))
                if not words or not set("123") <= set(words.pop(0)):
                    raise MeshError(f"The card {name} of line {line} has weights of other "
                                    f"components than 1, 2, 3 together, which are not read.")
            elif parts:
                parts[-1][1].append(word)
        if not parts or "UM" in map(str.upper, words):
            raise MeshError(f"The card {name} of line {line} has no weight or a list UM, which is "
                            f"not read; give a weight such as 1.0, and leave UM out.")
        rows = [bulk.rows(line, points, name) for _, points in parts]
        weights = np.repeat([weight for weight, _ in parts], [len(one) for one in rows])
        raw.nodes[name] = np.concatenate(rows)
        yield Coupling(name, reference, tuple(raw.points[raw.nodes[reference][0]]), "distributing",
                       name=name, weights=None if np.ptp(weights) == 0.0 else tuple(weights))


def _equations(bulk: BulkData, raw: RawMesh) -> Iterator[Constraint]:
    wanted = bulk.of_case("MPC")
    sets: dict[str, Line] = {}
    for line, fields in bulk.cards["MPC"]:
        name = f"MPC of line {line}"
        sets.setdefault(fields[0], line)
        if fields[0] != (wanted or fields[0]):
            continue
        words = [word for k in range(0, len(fields), 8) for word in fields[k + 1 : k + 7]]
        terms = []
        for point, component, factor in zip(*(words[k::3] for k in range(3)), strict=False):
            if not point:
                continue
            (node,), way = bulk.rows(line, [point], name).tolist(), whole(line, component) - 1
            bulk.require_basic(name, np.array([node]), component)
            if not 0 <= way < 6:
                raise MeshError(f"The card {name} has the component {component}, which must be 1 "
                                f"to 6.")
            value = (real(line, factor) * np.eye(6)[way]).tolist()
            if way > 2:
                _reference(bulk, line, point, raw, name)
            terms.append(Term(node, tuple(value[:3]), tuple(value[3:]) if way > 2 else ()))
        yield LinearEquation(tuple(terms), name)
    if wanted is not None and sets and wanted not in sets:
        raise MeshError(f"The case control names the set {wanted} of MPC, but the file has the "
                        f"sets {choices(sets)}; correct MPC =.")
    if wanted is None and len(sets) > 1:
        raise MeshError(f"The file has the sets {choices(sets)} of MPC; name the one that acts by "
                        f"MPC = in the case control, or leave those out that do not act.")
