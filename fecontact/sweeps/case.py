"""A case of a sweep, and its row of results."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NotRequired, TypedDict

BASIS_SECTIONS = ("geometry", "body", "basis")


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
                if name.partition(".")[0] in BASIS_SECTIONS}
