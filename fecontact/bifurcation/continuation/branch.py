"""A branch of solutions."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.points import (
    BranchHeader,
    BranchPoint,
    CrossingPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    on_branch,
)
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array


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
class Branch:
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

    def __post_init__(self) -> None:
        header = BranchHeader(self.name, self.attributes)
        object.__setattr__(self, "points",
                           tuple(on_branch(point, header) for point in self.points))

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[BranchPoint]:
        return iter(self.points)

    @property
    def parameter(self) -> Array:
        """Parameter (N,) of each point."""
        return np.array([point.parameter for point in self.points])

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The special points."""
        return tuple(point for point in self.points if point.kind is not None)

    @overload
    def of_kind(self, kind: Literal["fold"]) -> tuple[FoldPoint, ...]: ...
    @overload
    def of_kind(self, kind: Literal["Hopf"]) -> tuple[HopfPoint, ...]: ...
    @overload
    def of_kind(self, kind: Literal["period doubling"]) -> tuple[PeriodDoublingPoint, ...]: ...
    @overload
    def of_kind(self, kind: Literal["Neimark-Sacker"]) -> tuple[NeimarkSackerPoint, ...]: ...
    @overload
    def of_kind(self, kind: Literal["branch point"]) -> tuple[CrossingPoint, ...]: ...
    @overload
    def of_kind(self, kind: str) -> tuple[BranchPoint, ...]: ...
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
