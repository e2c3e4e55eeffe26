"""Data sets of universal files, and what :mod:`fecontact.reduction.matrix_files.uff` takes from each."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, MissingLibraryError

Array = NDArray[np.float64]

_NORMAL_MODES, _COMPLEX_MODES = 2, (3, 7)
_DISPLACEMENTS = (0, 1, 8)  # unknown, general, displacement
_REAL_ENOUGH = 0.1


def data_sets(path: Path) -> list[dict[str, Any]]:
    """The data sets of modes, nodes, elements and units; InputError if damaged."""
    try:
        import pyuff
    except ImportError:
        raise MissingLibraryError("Universal files are read by pyuff, which is not installed: "
                                  "pip install pyuff") from None
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    try:
        # Each data set lies between two such lines; pyuff passes over one that has no end.
        if len(re.findall(rb"^ {4}-1\s*?$", path.read_bytes(), re.MULTILINE)) % 2:
            raise InputError(f"{path}: the file ends within a data set; it is cut off.")
        file = pyuff.UFF(str(path))
        kinds = file.get_set_types()
        wanted = [k for k, kind in enumerate(kinds) if kind in (15, 55, 164, 2411, 2412, 2420)]
        # One at a time: what pyuff returns for one set is no list, and its message for several
        # does not say which one is damaged.
        sets = []
        for k in wanted:
            try:
                sets.append(file.read_sets(k))
            except Exception:
                raise InputError(f"{path}: data set {k + 1} of the file, of type {kinds[k]}, "
                                 f"cannot be read; it is damaged or in a form that pyuff does not "
                                 f"know.") from None
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path}: the file cannot be read as a universal file "
                         f"({error}).") from None
    return sets


def modes_of(sets: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The data sets that are modes."""
    return [one for one in sets
            if one["type"] == 55 and one["analysis_type"] in (_NORMAL_MODES, *_COMPLEX_MODES)]


def elements(sets: list[dict[str, Any]]) -> dict[int, NDArray[np.int64]]:
    """Labels of the nodes of the elements, by the number of nodes."""
    found: dict[int, list[list[int]]] = {}
    for one in sets:
        if one["type"] != 2412:
            continue
        for kind, elements in one.items():
            if not isinstance(kind, int):
                continue  # pyuff repeats triangles and quadrilaterals under their names
            for element in elements:
                nodes = element["nodes_nums"]
                if len(nodes) != element["num_nodes"]:
                    raise InputError(f"Element {element['element_nums']} of data set 2412 has "
                                     f"{len(nodes)} nodes where {element['num_nodes']} are "
                                     f"announced.")
                found.setdefault(len(nodes), []).append(nodes)
    return {count: np.array(nodes, dtype=np.int64) for count, nodes in sorted(found.items())}


def require_displacements(mode: Mapping[str, Any], number: int) -> None:
    """Raise :class:`InputError` unless a mode is given in displacements."""
    if mode["spec_data_type"] not in _DISPLACEMENTS:
        raise InputError(f"Mode {number} holds data of type {mode['spec_data_type']}, not "
                         f"displacements (8); export the mode shapes as displacements.")
    if mode["n_data_per_node"] not in (3, 6) or mode["data_ch"] not in (0, 2, 3):
        raise InputError(f"Mode {number} has {mode['n_data_per_node']} values at a node (data "
                         f"characteristic {mode['data_ch']}); there must be 3 displacements, or 3 "
                         f"displacements and 3 rotations.")


def one_mode(mode: Mapping[str, Any], number: int) -> tuple[Array, tuple[float, float, float]]:
    """Real shape (k, 3 or 6), and frequency [Hz], damping ratio and modal mass (0: unknown)."""
    columns = [mode[f"r{k + 1}"] for k in range(mode["n_data_per_node"])]
    if any(len(column) != len(mode["node_nums"]) for column in columns):
        raise InputError(f"Mode {number} has another number of values than "
                         f"{len(columns)} at each of its nodes.")
    values = np.stack(columns, axis=1)
    turn = 1.0 + 0.0j
    if np.iscomplexobj(values):
        # The phase that makes the sum of squares of the real parts largest.
        turn = np.exp(-0.5j * np.angle((values**2).sum()))
        values = values * turn
        rest = float(np.linalg.norm(values.imag)) / (float(np.linalg.norm(values)) or 1.0)
        if rest > _REAL_ENOUGH:
            raise InputError(f"Mode {number} is complex: its imaginary part is {rest:.2g} of it in "
                             f"the best phase, more than {_REAL_ENOUGH:g}; identify real (normal) "
                             f"modes.")
        values = values.real
    if mode["analysis_type"] == _NORMAL_MODES:
        ratio = mode["modal_damp_vis"] or 0.5 * mode["modal_damp_his"]
        return values, (mode["freq"], ratio, mode["modal_m"])
    root = complex(mode["eig"])
    w = abs(root)
    # Modal A of a proportionally damped system is 2 i w_d times the modal mass.
    mass = float((complex(mode["modal_a"]) * turn**2).imag) / (2.0 * abs(root.imag) or np.inf)
    return values, (w / (2.0 * np.pi), -root.real / w if w else 0.0, abs(mass))


def units(sets: list[dict[str, Any]]) -> tuple[float, float]:
    """Units of the file per metre and per newton; one without a data set 164."""
    for one in sets:
        if one["type"] == 164:
            length, force = float(one["length"]), float(one["force"])
            if not (length > 0.0 and force > 0.0):
                raise InputError(f"The units of the file (data set 164) are {length:g} per metre "
                                 f"and {force:g} per newton; both must be above zero.")
            return length, force
    return 1.0, 1.0


def coordinates(sets: list[dict[str, Any]], labels: NDArray[np.int64]) -> Array:
    """Places (N, 3) of the nodes in the file's unit, not a number where it does not give them."""
    for one in sets:
        if one["type"] == 2420 and not all(
                np.array_equal(matrix, np.eye(4, 3)) for matrix in one["CS_matrices"]):
            raise InputError("The file has local coordinate systems (data set 2420); export it in "
                             "the global one.")
    places = np.full((len(labels), 3), np.nan)
    for one in sets:
        if one["type"] in (15, 2411):
            numbers = np.asarray(one["node_nums"], dtype=np.int64)
            xyz = np.column_stack([one["x"], one["y"], one["z"]])
            known = np.isin(numbers, labels)
            places[np.searchsorted(labels, numbers[known])] = xyz[known]
    return places
