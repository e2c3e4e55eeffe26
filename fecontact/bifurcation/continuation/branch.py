"""A branch of solutions, and its file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed, span


class Status(Enum):
    """How a branch ended; the value is the sentence for people."""

    POINTS = "The branch has as many points as were asked for."
    BOUND = "The branch reached a bound of its parameter."
    STOPPED = "The branch reached a point at which it was to stop."
    CLOSED = ("The branch came back to its start, or to where it would run through the same orbits "
              "again.")
    STALLED = ("The steps became too small to go on; what was computed until then is kept. Look "
               "whether the solution changes abruptly here, or start with smaller steps.")
    INTERRUPTED = "The continuation was interrupted; what was computed until then is kept."


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """One solution on a branch.

    Attributes
    ----------
    u : (N + 1,) array
        Unknowns, the parameter last.
    tangent : (N + 1,) array
        Direction of the branch.
    values : mapping
        What the problem stores of each solution, such as states and stability.
    kind : str or None
        What is special about the point: 'fold', 'Hopf', ...; None for the others.
    details : mapping
        What is known of a special point, such as its normal form.
    """

    u: Array
    tangent: Array
    values: Mapping[str, Any] = field(default_factory=dict)
    kind: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def parameter(self) -> float:
        """Value of the parameter."""
        return float(self.u[-1])


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Summarised):
    """Solutions over a parameter, in their order along the branch.

    Attributes
    ----------
    name : str
        Name of the parameter.
    points : tuple of BranchPoint
        All points, special ones in their places.
    status : Status
        How its forward end was reached.
    message : str
        What the last failed step complained of; empty without.
    attributes : mapping
        What else belongs to the branch: numbers, texts, arrays.
    """

    name: str
    points: tuple[BranchPoint, ...]
    status: Status = Status.POINTS
    message: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[BranchPoint]:
        return iter(self.points)

    def summary(self) -> list[tuple[str, str]]:
        """Parameter and its range, special points, stability, and how the branch ended."""
        special = [f"{point.kind} at {point.parameter:.5g}" for point in self.special]
        known = [bool(point.values["stable"]) for point in self.points
                 if point.kind is None and "stable" in point.values]
        return [
            ("parameter", self.name), ("range", span(self.parameter)),
            ("points", f"{len(self)}"),
            ("special", listed(special, 5)),
            *([("stable", f"{sum(known)} of {len(known)} regular points")] if known else []),
            ("end", self.status.name.lower()),
        ]

    @property
    def parameter(self) -> Array:
        """Parameter (N,) of each point."""
        return np.array([point.parameter for point in self.points])

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The special points."""
        return tuple(point for point in self.points if point.kind is not None)

    def of_kind(self, kind: str) -> tuple[BranchPoint, ...]:
        """The special points of one kind."""
        return tuple(point for point in self.points if point.kind == kind)

    def column(self, name: str) -> NDArray[Any]:
        """One stored value (N, ...) of all points.

        Raises
        ------
        InputError
            If no such value is stored; it lists those that are.
        """
        known = self.points[0].values if self.points else {}
        if name not in known:
            raise InputError(f"The branch stores no value {name!r}; it has: {choices(known)}.")
        return np.array([point.values[name] for point in self.points])

    def reversed(self) -> "Branch":
        """The branch in the other direction."""
        turned = tuple(replace(point, tangent=-point.tangent) for point in self.points[::-1])
        return replace(self, points=turned)


def require_on_branch(owner: str, branch: object, point: object) -> None:
    """Raise :class:`InputError` unless these are a branch, and a point of one."""
    require_kind(owner, Branch, branch=branch)
    require_kind(owner, BranchPoint, point=point)
