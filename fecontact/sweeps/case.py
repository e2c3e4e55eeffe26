"""A case of a sweep, and its row of results."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NotRequired, TypedDict

from fecontact.study.bodies_section import PAIRING_KEYS

_BASIS_SECTIONS = ("geometry", "body", "basis", "bodies", "links")


def of_basis(name: str, *, prestress: bool = False) -> bool:
    """Return True if the modal basis may depend on a dotted key of the study.

    It depends on the load if it is ``[basis] prestress``, about the static state under it.
    """
    first, _, rest = name.partition(".")
    if first == "load":
        return prestress
    if first != "interfaces":
        return first in _BASIS_SECTIONS
    key = rest.partition(".")[2].partition(".")[0]
    return not key or key in PAIRING_KEYS


class Row(TypedDict):
    """Stored result of a case: its summaries, or the reason of its failure."""

    case: str
    values: dict[str, float]
    reason: str
    points: NotRequired[list[float]]  # displacements once per period
    warning: NotRequired[str]  # where the run exceeds the limits of the model


@dataclass(frozen=True)
class SweepCase:
    """A case of a sweep: its key, the key of its modal basis, its changes to the study."""

    key: str
    basis: str
    changes: Mapping[str, Any]

    @property
    def basis_changes(self) -> dict[str, Any]:
        """Changes that affect the modal basis."""
        return {name: value for name, value in self.changes.items()
                if of_basis(name, prestress=True)}
