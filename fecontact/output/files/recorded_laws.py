"""Contact systems whose laws are replaced by their recorded values.

User-defined laws are code, which must not be executed when a run from another source is read. The
values recorded in its file suffice to draw and export the run.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.tables import from_table
from fecontact.core.types import Array
from fecontact.laws.registry import PART_CLASSES, UntrustedError
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.gap import gap_values
from fecontact.system.interfaces import checked_sliding
from fecontact.system.kernels import (
    FRICTION_ACROSS,
    FRICTION_FORCE,
    NORMAL_FORCE,
    PENETRATION,
    SLIP_ACROSS,
    SLIP_VELOCITY,
)
from fecontact.system.tables import law_tables, sliding_from_tables, system_parts

LAW_PARTS = ("normal", "friction")


class UnreadLaw:
    """A law whose code was not executed; every access raises InputError."""

    def __init__(self, table: Mapping[str, Any], needs: str) -> None:
        self._table, self._needs = dict(table), needs

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") and name != "__dataclass_fields__":
            raise AttributeError(name)
        raise InputError(self._needs)

    def __repr__(self) -> str:
        return f"UnreadLaw({self._table})"


class _Recorded:
    """A function of rows of numbers, tabulated at recorded rows."""

    def __init__(self, rows: Array, values: NDArray[Any], needs: str) -> None:
        self._values, self._needs = values, needs
        self._places = {row.tobytes(): place for place, row in enumerate(rows)}

    def __call__(self, rows: Array) -> NDArray[Any]:
        """Values at recorded rows; InputError for others."""
        try:
            return self._values[[self._places[row.tobytes()] for row in
                                 np.ascontiguousarray(rows)]].copy()
        except KeyError:
            raise InputError(self._needs) from None


@dataclass(frozen=True, eq=False)
class RecordedSystem(ContactSystem):
    """A system whose contact forces, states and energies are those of one run.

    Anything that does not follow from them raises InputError.

    Attributes
    ----------
    history : function
        Contact quantities (N, n, 6), in space (N, n, 8), of times and states.
    energy, sticking : functions
        Contact energy (N,) [J] of penetrations, and whether nodes stick, (N, n), of slip
        velocities, normal and friction forces.
    states : int
        Number of internal variables of a node.
    needs : str
        Error message for quantities that are not recorded.
    """

    history: Any = None
    energy: Any = None
    sticking: Any = None
    states: int = 0
    needs: str = ""

    def _check(self) -> None:
        object.__setattr__(self, "gap", gap_values(self.gap, self.basis.contact_places))
        object.__setattr__(self, "sliding", checked_sliding(self.basis, self.ground, self.sliding))

    @property
    def memory(self) -> int:
        """Number of internal variables of a node."""
        return self.states

    @property
    def arrays(self) -> Any:
        """Raise InputError: needs the compiled laws."""
        raise InputError(self.needs)

    def with_(
        self, changes: Mapping[str, Any] | None = None, /, **by_name: Any
    ) -> ContactSystem:
        """Raise InputError: needs the laws."""
        raise InputError(self.needs)

    def parameters(self) -> dict[str, Any]:
        """Raise InputError: needs the laws."""
        raise InputError(self.needs)

    def contact_history(self, times: Array, states: Array) -> Array:
        """Recorded contact quantities (N, n, 6), in space (N, n, 8)."""
        return np.asarray(self.history(np.column_stack([times, states])))

    def stored_energy(self, penetration: Array) -> Array:
        """Recorded energy in the contact (N,) [J]."""
        return np.asarray(self.energy(penetration))

    def sticks(
        self, slip_velocity: Array, normal_force: Array, friction_force: Array
    ) -> NDArray[np.bool_]:
        """Recorded flags (N, n) of sticking nodes."""
        return np.asarray(self.sticking(np.hstack([slip_velocity, normal_force, friction_force])))


def recorded_system(
    basis: ModalBasis, tables: Mapping[str, Any], where: str, state: Mapping[str, Any],
    contact: Array, contact_state: NDArray[Any], energy: Array, needs: str,
) -> RecordedSystem:
    """The system of a run with recorded contact quantities.

    Parameters
    ----------
    basis : ModalBasis
        Modal basis of the run.
    tables : mapping
        See :func:`fecontact.system.tables.system_tables`.
    where : str
        The file, for messages.
    state : mapping
        ``time``, ``modal_coordinates``, ``modal_velocities`` and, with memory, ``memory``.
    contact : (N, n, 6) array, in space (N, n, 8)
        See :meth:`ContactSystem.contact_history`.
    contact_state : (N, n) integer array
        Values of :class:`fecontact.ContactState`.
    energy : (N,) array
        Energy in the contact [J].
    needs : str
        Error message for quantities that are not recorded.

    Raises
    ------
    InputError
        If ground, drive, load or sliding also need user code.
    """
    parts = system_parts(tables, where, ("ground", "drive", "load"))
    laws = {part: _law(part, tables, where, needs) for part in LAW_PARTS}
    memory = state.get("memory")
    rows = np.column_stack([state["time"], state["modal_coordinates"], state["modal_velocities"],
                            *(() if memory is None else (memory,))])
    normal, friction, penetration, slip = (contact[:, :, k] for k in (
        NORMAL_FORCE, FRICTION_FORCE, PENETRATION, SLIP_VELOCITY))
    if basis.dimension == 3:
        # Contact states need magnitudes: friction and slip have two components in space.
        friction, slip = (np.linalg.norm(contact[:, :, [k, across]], axis=-1) for k, across in (
            (FRICTION_FORCE, FRICTION_ACROSS), (SLIP_VELOCITY, SLIP_ACROSS)))
    return RecordedSystem(
        basis, gap=tables.get("gap", 0.0), sliding=sliding_from_tables(tables, where), **parts,
        **laws,
        history=_Recorded(rows, contact, needs),
        energy=_Recorded(penetration, energy, needs),
        sticking=_Recorded(np.hstack([slip, normal, friction]), contact_state == 1, needs),
        states=0 if memory is None else memory.shape[1] // max(basis.contact_nodes, 1), needs=needs)


def _law(part: str, tables: Mapping[str, Any], where: str, needs: str) -> Any:
    """A law that needs no user code, or its placeholder; a mapping of interfaces to either."""
    groups = law_tables(tables, part, where)
    if groups:
        return {group: _read(part, table, f"{where}: [interfaces.{group}.{part}]", needs)
                for group, table in groups.items()}
    return _read(part, tables.get(part, {}), f"{where}: [{part}]", needs)


def _read(part: str, table: Mapping[str, Any], where: str, needs: str) -> Any:
    try:
        return from_table(PART_CLASSES[part], table, where)
    except UntrustedError:
        return UnreadLaw(table, needs)
