"""Universal files (UFF, UNV) of modes, as test laboratories and preprocessors write them.

Read by pyuff: data sets 55 (data at nodes), 15 and 2411 (nodes), 2412 (elements), 164 (units),
2420 (coordinate systems). Set 55 carries six digits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.core.checks import as_path
from fecontact.core.errors import InputError
from fecontact.reduction.from_modes import basis_from_modes
from fecontact.reduction.matrix_files.uff_sets import (
    coordinates,
    data_sets,
    elements,
    modes_of,
    one_mode,
    require_displacements,
    units,
)

if TYPE_CHECKING:
    from fecontact.reduction.modal_basis import ModalBasis

Array = NDArray[np.float64]

_AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class UffModes:
    """Modes of a universal file, in SI units where the file says its own.

    Attributes
    ----------
    frequencies_hz : (m,) array
        Undamped eigenfrequencies [Hz].
    shapes : (N, 3, m) or (N, 6, m) array
        Displacements x, y, z (and rotations about x, y, z); zero at nodes that a mode leaves out.
    node_labels : (N,) integer array
        Ascending.
    coordinates : (N, 3) array
        Places of the nodes [m]; not a number where the file does not give them.
    damping_ratios : (m,) array
        Viscous damping ratios, half the hysteretic ones where only these are given.
    modal_masses : (m,) array or None
        None where the file does not give them for every mode.
    source : str
        The file, for messages.
    elements : mapping of int to (k, c) integer array
        Labels of the c nodes of the k elements that have as many; empty where the file has none.
    """

    frequencies_hz: Array
    shapes: Array
    node_labels: NDArray[np.int64]
    coordinates: Array
    damping_ratios: Array
    modal_masses: Array | None
    source: str
    elements: Mapping[int, NDArray[np.int64]] = field(default_factory=dict)

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
        """The modal basis with points of interest at nodes of the file.

        Parameters
        ----------
        contact : sequence of int
            Labels of the contact nodes.
        B, C : int, optional
            Labels of excitation and load point; without, they do not move.
        points : mapping of name to label, optional
            Further points.
        axes : (str, str)
            The file's directions that are x, along the ground, and y, away from it: 'x', 'y' or
            'z', with a minus sign for the opposite direction.
        modal_mass : float or (m,) array, optional
            In the place of the file's modal masses [kg].
        damping : float, (m,) sequence, Rayleigh or (m, m) array, optional
            In the place of the file's damping ratios.
        contact_x, tributary : (n,) arrays, optional
            As for :meth:`basis_from_modes`; the default for contact_x is the file's.

        Raises
        ------
        InputError
            For labels that are not there, axes that are not at right angles, and where neither
            the file nor the call gives modal masses.
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
        """Place of a node in the arrays; InputError if the file does not have it."""
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

    Complex modes are turned to the phase in which they are most nearly real, and what is then
    left of their imaginary part is dropped.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    MissingLibraryError
        If pyuff is not installed.
    InputError
        If there is no such file, it is damaged or holds no modes, or a mode is not in
        displacements, or far from real.
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
