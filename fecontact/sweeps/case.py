"""A case of a sweep, and its row of results."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NotRequired, TypedDict

BASIS_SECTIONS = ("geometry", "body", "basis")


class Row(TypedDict):
    """What is kept of a case: its summaries, or the reason why there are none."""

    case: str
    values: dict[str, float]
    reason: str
    points: NotRequired[list[float]]  # displacements once per period
    warning: NotRequired[str]  # where the run leaves the limits of the model


@dataclass(frozen=True)
class SweepCase:
    """A case of a sweep: its key, that of its modal basis, what it changes in the study."""

    key: str
    basis: str
    changes: Mapping[str, Any]

    @property
    def basis_changes(self) -> dict[str, Any]:
        """What of the changes the modal basis depends on."""
        return {name: value for name, value in self.changes.items()
                if name.partition(".")[0] in BASIS_SECTIONS}
