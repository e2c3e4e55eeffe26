"""Contact systems whose laws are replaced by their recorded values.

User-defined laws are code, which must not be executed when a run from another source is read. The
values recorded in its file suffice to draw and export the run.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fecontact.core.errors import InputError
from fecontact.core.tables import from_table
from fecontact.laws.own_files import UntrustedError
from fecontact.laws.registry import PART_CLASSES
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.gap import gap_values
from fecontact.system.interfaces import checked_sliding
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


@dataclass(frozen=True, eq=False)
class RecordedSystem(ContactSystem):
    """A system whose laws are not known, of a run whose contact is recorded.

    Anything that needs the laws raises InputError.

    Attributes
    ----------
    states : int
        Number of internal variables of a node.
    needs : str
        Error message for quantities that are not recorded.
    """

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


def recorded_system(
    basis: ModalBasis, tables: Mapping[str, Any], where: str, memory: int, needs: str,
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
    memory : int
        Number of internal variables of all nodes.
    needs : str
        Error message for quantities that are not recorded.

    Raises
    ------
    InputError
        If ground, drive, load or sliding also need user code.
    """
    parts = system_parts(tables, where, ("ground", "drive", "load"))
    laws = {part: _law(part, tables, where, needs) for part in LAW_PARTS}
    return RecordedSystem(
        basis, gap=tables.get("gap", 0.0), sliding=sliding_from_tables(tables, where), **parts,
        **laws, states=memory // max(basis.contact_nodes, 1), needs=needs)


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
