"""Universal files (UFF, UNV) of modes, from modal tests and preprocessors.

Read by pyuff: data sets 55 (data at nodes), 15 and 2411 (nodes), 2412 (elements), 164 (units),
2420 (coordinate systems). Set 55 carries six digits.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import as_path, require_regular_file
from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.reduction.from_modes import basis_from_modes

if TYPE_CHECKING:
    from fecontact.reduction.modal_basis import ModalBasis


_AXES = ("x", "y", "z")


@read_only_arrays
@dataclass(frozen=True, eq=False)
class UffModes:
    """Modes of a universal file, in SI units if the file gives its units.

    Attributes
    ----------
    frequencies_hz : (m,) array
        Undamped eigenfrequencies [Hz].
    shapes : (N, 3, m) or (N, 6, m) array
        Displacements x, y, z (and rotations about x, y, z); zero at nodes that a mode omits.
    node_labels : (N,) integer array
        Ascending.
    coordinates : (N, 3) array
        Coordinates of the nodes [m]; NaN if the file does not give them.
    damping_ratios : (m,) array
        Viscous damping ratios; half the hysteretic ones if only these are given.
    modal_masses : (m,) array or None
        None unless the file gives them for every mode.
    source : str
        The file, for messages.
    elements : mapping of int to (k, c) integer array
        Labels of the nodes of the k elements with c nodes, by c; empty if the file has none.
    """

    frequencies_hz: Array
    shapes: Array
    node_labels: Integers
    coordinates: Array
    damping_ratios: Array
    modal_masses: Array | None
    source: str
    elements: Mapping[int, Integers] = field(default_factory=dict)

    def modal_basis(
        self,
        contact: Sequence[int],
        *,
        B: int | None = None,
        C: int | None = None,
        points: Mapping[str, int] | None = None,
        axes: tuple[str, str] = ("x", "y"),
        modal_mass: ArrayLike | None = None,
        damping: Any = None,
        contact_x: ArrayLike | None = None,
        tributary: ArrayLike | None = None,
    ) -> "ModalBasis":
        """Modal basis with points of interest at nodes of the file.

        Parameters
        ----------
        contact : sequence of int
            Labels of the contact nodes.
        B, C : int, optional
            Labels of excitation and load point; zero rows by default.
        points : mapping of name to label, optional
            Further points.
        axes : (str, str)
            Directions of the file for x, along the ground, and y, away from it: 'x', 'y' or 'z',
            with a minus sign for the opposite direction.
        modal_mass : float or (m,) array, optional
            Replaces the file's modal masses [kg].
        damping : float, (m,) sequence, Rayleigh or (m, m) array, optional
            Replaces the file's damping ratios.
        contact_x, tributary : (n,) arrays, optional
            See :meth:`basis_from_modes`; the default for contact_x is the file's.

        Raises
        ------
        InputError
            For unknown labels, axes that are not at right angles, and if neither the file nor the
            call gives modal masses.
        """
        from fecontact.reduction.restriction import rows_from_dofs

        (first, sign_x), (second, sign_y) = self._axis(axes[0]), self._axis(axes[1])
        if first == second:
            raise InputError(f"{self.source}: axes = {axes!r} must be two different directions.")
        masses = self.modal_masses if modal_mass is None else modal_mass
        if masses is None:
            raise InputError(f"{self.source}: the file does not give the modal masses; give "
                             f"modal_mass, 1 for mass-normalised shapes.")
        out_of_plane = 3 - first - second
        turn = sign_x * sign_y * (1.0 if (second - first) % 3 == 1 else -1.0)
        components = [sign_x * self.shapes[:, first], sign_y * self.shapes[:, second]]
        if self.shapes.shape[1] == 6:
            components.append(turn * self.shapes[:, 3 + out_of_plane])
        shapes = np.stack(components, axis=1)
        N, width, m = shapes.shape

        def dofs(label: int) -> list[int]:
            return [width * self.node(label) + k for k in range(width)]

        def place(label: int | None) -> list[int] | None:
            return None if label is None else dofs(label)

        rows = rows_from_dofs(
            N * width, [dofs(label) for label in contact], B=place(B), C=place(C),
            points={name: dofs(label) for name, label in (points or {}).items()})
        if contact_x is None:
            where = sign_x * self.coordinates[[self.node(label) for label in contact], first]
            contact_x = where if np.isfinite(where).all() else None
        return basis_from_modes(
            shapes.reshape(-1, m), rows, frequencies_hz=self.frequencies_hz, modal_mass=masses,
            damping=self.damping_ratios if damping is None else damping, contact_x=contact_x,
            tributary=tributary)

    def node(self, label: int) -> int:
        """Index of a node in the arrays; InputError if the file does not have it."""
        at = int(np.searchsorted(self.node_labels, label))
        if at == len(self.node_labels) or self.node_labels[at] != label:
            raise InputError(f"{self.source}: there is no node {label!r} in the modes; its nodes "
                             f"run from {self.node_labels[0]} to {self.node_labels[-1]}.")
        return at

    def _axis(self, name: str) -> tuple[int, float]:
        letter = str(name).removeprefix("-").removeprefix("+")
        if letter not in _AXES:
            raise InputError(f"{self.source}: axis {name!r} must be 'x', 'y' or 'z', with a minus "
                             f"sign for the opposite direction.")
        return _AXES.index(letter), -1.0 if str(name).startswith("-") else 1.0


def read_uff(path: str | Path) -> UffModes:
    """Read the modes of a universal file (.uff, .unv).

    Complex modes are rotated to the phase of smallest imaginary part, which is then dropped.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    MissingLibraryError
        If pyuff is not installed.
    InputError
        If the file does not exist, is damaged or holds no modes, or a mode is not in displacements
        or essentially complex.
    """
    path = as_path(path, "modes")
    sets = data_sets(path)
    try:
        return _modes(sets, str(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _modes(sets: list[dict[str, Any]], source: str) -> UffModes:
    modes = modes_of(sets)
    if not modes:
        raise InputError("The file holds no modes; they are read from data sets 55 of normal or "
                         "complex modes (not from 2414).")
    for number, mode in enumerate(modes, 1):
        require_displacements(mode, number)
    labels = np.unique(np.concatenate([mode["node_nums"] for mode in modes])).astype(np.int64)
    width = max(int(mode["n_data_per_node"]) for mode in modes)
    shapes = np.zeros((len(labels), width, len(modes)))
    scalars = np.zeros((3, len(modes)))
    for k, mode in enumerate(modes):
        values, scalars[:, k] = one_mode(mode, k + 1)
        shapes[np.searchsorted(labels, mode["node_nums"]), : values.shape[1], k] = values
    frequencies, ratios, masses = scalars
    length, force = units(sets)
    shapes[:, :3] /= length
    return UffModes(
        frequencies_hz=frequencies,
        shapes=shapes,
        node_labels=labels,
        coordinates=coordinates(sets, labels) / length,
        damping_ratios=ratios,
        modal_masses=masses / (force * length) if (masses > 0.0).all() else None,
        source=source,
        elements=elements(sets),
    )


_NORMAL_MODES, _COMPLEX_MODES = 2, (3, 7)
_DISPLACEMENTS = (0, 1, 8)  # unknown, general, displacement
_REAL_ENOUGH = 0.1
_BORDER = re.compile(rb"^ {4}-1\s*?$", re.MULTILINE)
_BINARY = re.compile(rb"^ {4}58b", re.MULTILINE)
_OF_MODES = (15, 55, 164, 2411, 2412, 2420)


def data_sets(path: Path, kinds: Collection[int] = _OF_MODES) -> list[dict[str, Any]]:
    """Data sets of some kinds, by default of modes, nodes and units; InputError if damaged."""
    pyuff = optional("pyuff", "Reading universal files")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    require_regular_file(path, "a universal file")
    try:
        # Each data set lies between two such lines; pyuff skips one without end. Binary data need
        # not end with a line.
        content = path.read_bytes()
        if not _BINARY.search(content) and len(_BORDER.findall(content)) % 2:
            raise InputError(f"{path}: the file ends within a data set; it is cut off.")
        file = pyuff.UFF(str(path))
        present = file.get_set_types()
        wanted = [k for k, kind in enumerate(present) if kind in kinds]
        # One at a time: pyuff's message for several does not say which one is damaged.
        sets = []
        for k in wanted:
            try:
                sets.append(file.read_sets(k))
            except Exception:
                raise InputError(f"{path}: data set {k + 1} of the file, of type {present[k]}, "
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


def elements(sets: list[dict[str, Any]]) -> dict[int, Integers]:
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


def coordinates(sets: list[dict[str, Any]], labels: Integers) -> Array:
    """Places (N, 3) of the nodes in the file's unit, NaN if it does not give them."""
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
