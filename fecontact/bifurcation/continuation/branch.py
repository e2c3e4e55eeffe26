"""Branches: solutions in their order over a parameter."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint, as_field
from fecontact.bifurcation.continuation.points import (
    UNRESOLVED,
    UNRESOLVED_MEANING,
    CrossingPoint,
    FoldPoint,
    HopfPoint,
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    on_branch,
    require_no_family,
)
from fecontact.bifurcation.continuation.problem import (
    KINDS,
    BranchStatus,
    ContinuationOptions,
)
from fecontact.bifurcation.continuation.pseudo_arclength import continuation
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import AnalysisError, InputError, choices, require_finite, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed, span
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField


def _plain(kind: str) -> str:
    """A kind without capitals, hyphens and spaces."""
    return kind.lower().replace("-", "").replace(" ", "").replace("_", "")


# Relative distance within which a value of the parameter is reached.
_REACHED = 1e-9

__all__ = ["Branch", "BranchStatus"]


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Branch(Summarised):
    """Solutions over a parameter, in their order along the branch.

    Attributes
    ----------
    parameter_name : str
        Name of the parameter.
    points : tuple of BranchPoint
        All points, special ones in their places.
    status : BranchStatus
        How its forward end was reached.
    message : str
        Error of the last failed step, and further notes; empty if there are none.
    attributes : mapping
        Further data of the branch: numbers, texts, arrays.
    """

    parameter_name: str
    points: tuple[BranchPoint, ...]
    status: BranchStatus = BranchStatus.POINTS
    message: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        header = BranchHeader(self.parameter_name, self.attributes)
        object.__setattr__(self, "points",
                           tuple(on_branch(point, header) for point in self.points))

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[BranchPoint]:
        return iter(self.points)

    def summary(self) -> list[tuple[str, str]]:
        """Parameter and its range, special points, stability, and how the branch ended."""
        special = [f"{point.kind} at {point.parameter_text(5)}" for point in self.special]
        known = [bool(point.values["stable"]) for point in self.points
                 if point.kind is None and "stable" in point.values]
        return [
            ("parameter", self.parameter_name), ("range", span(self.parameter)),
            ("points", f"{len(self)}"),
            ("special", listed(special, 5)),
            *([(UNRESOLVED, UNRESOLVED_MEANING)]
              if any(point.kind == UNRESOLVED for point in self.points) else []),
            *([("stable", f"{sum(known)} of {len(known)} regular points")] if known else []),
            *self._accuracy(),
            ("end", self.status.name.lower()),
            *([("message", self.message)] if self.message else []),
        ]

    @property
    def end(self) -> str:
        """How the forward end was reached, in a sentence; where points ran out, how far it got."""
        return self.end_at(f"{self.parameter_name} = {self.points[-1].parameter:.6g}"
                           if self.points else "")

    def end_at(self, place: str) -> str:
        """The sentence of :attr:`end`, for another description of the last point."""
        regular = sum(point.kind is None for point in self.points)
        if self.status is not BranchStatus.POINTS or not regular:
            return self.status.value
        return (f"The branch has as many points as were asked for and ends at {place}: raise "
                f"points = {regular} to go on, or largest_step to go farther with each.")

    def _accuracy(self) -> list[tuple[str, str]]:
        """Error of the states and intervals of orbits by collocation."""
        found = [point.values for point in self.points if "state_error" in point.values]
        if not found:
            return []
        errors = np.array([float(values["state_error"]) for values in found])
        known = errors[np.isfinite(errors)]
        missing = len(errors) - len(known)
        text = f"{known.max():.1e} or less" if len(known) else "could not be estimated"
        if len(known) and missing:
            text += f", but could not be estimated at {missing} of {len(errors)} points"
        counts = [len(values["mesh"]) - 1 for values in found]
        few, many = min(counts), max(counts)
        return [("state error",
                 f"{text}, on {few if few == many else f'{few} to {many}'} intervals")]

    @property
    def parameter(self) -> Array:
        """Parameter (N,) of each point."""
        return np.array([point.parameter for point in self.points])

    @property
    def method(self) -> Any:
        """Options of the method of its orbits, such as Collocation; None if it has none."""
        return self.attributes.get("method")

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Name of the parameter, or of both along a curve over two: (first, second)."""
        return tuple(self.attributes.get("parameters", (self.parameter_name,)))

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
        """The special points of one kind, such as 'fold' or the name of an event.

        Raises
        ------
        InputError
            If there are none, and the kind is one of this package in another spelling.
        """
        if not isinstance(kind, str):
            raise InputError(f"Branch.of_kind: kind = {shown(kind)} must be a text.")
        written = next((name for name in KINDS if _plain(name) == _plain(kind)), kind)
        if written != kind and all(point.kind != kind for point in self.points):
            raise InputError(f"Branch.of_kind: kind = {kind!r} is written {written!r}.")
        return tuple(point for point in self.points if point.kind == kind)

    def column(self, name: str) -> NDArray[Any]:
        """One stored value (N, ...) of all points.

        Raises
        ------
        InputError
            If no such value is stored; it lists those that are. Or its length differs from point
            to point, as that of the mesh of special points may.
        """
        require_kind("Branch.column", str, name=name)
        known = self.points[0].values if self.points else {}
        if name not in known:
            raise InputError(f"The branch stores no value {name!r}; it has: {choices(known)}.")
        found = [point.values[name] for point in self.points]
        if len({np.shape(value) for value in found}) > 1:
            raise InputError(f"{name!r} differs in length from point to point; take it from each: "
                             f"point.values[{name!r}].")
        return np.array(found)

    @overload
    def at(
        self, field: VectorField | ContactSystem, value: float, which: int = 0
    ) -> BranchPoint: ...
    @overload
    def at(
        self, field: VectorField | ContactSystem, value: Sequence[float] | Array, which: int = 0
    ) -> tuple[BranchPoint, ...]: ...
    def at(
        self, field: VectorField | ContactSystem, value: float | Sequence[float] | Array,
        which: int = 0,
    ) -> BranchPoint | tuple[BranchPoint, ...]:
        """The solution at a value of the parameter, solved from the point of the branch beside it.

        Parameters
        ----------
        field : VectorField or ContactSystem
            Field or system of the branch.
        value : float or (k,) sequence
            The value; several give a tuple with the solution at each.
        which : int
            Number of the solution with this value, counted along the branch from 0; -1 is the last.

        Raises
        ------
        InputError
            If the branch does not pass the value so often, or is none of equilibria or orbits over
            one parameter.
        AnalysisError
            If no solution is found there.
        """
        field = as_field(field, self.attributes)
        if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
            values = as_floats(value, "The values of the parameter").ravel().tolist()
            return tuple(self.at(field, one, which) for one in values)
        require_finite("Branch.at", value=value)
        for point in self.points[:1]:
            require_no_family(point)
        passed = self._passed(float(value))
        if not (isinstance(which, int | np.integer) and -len(passed) <= which < len(passed)):
            raise InputError(f"{self.parameter_name} = {value:.6g}: {self._passages(passed)}"
                             f"{f', not which = {which!r}' if passed else ''}.")
        place, sign = passed[which]
        start = self.points[place]
        if start.parameter == value:
            return start
        bounds = (-np.inf, float(value)) if start.parameter < value else (float(value), np.inf)
        *_, found = self._continued(field, start, sign, ContinuationOptions(bounds=bounds,
                                                                            locate=False))
        if abs(found.parameter - value) > _REACHED * max(abs(value), abs(value - start.parameter)):
            raise AnalysisError(f"The solution at {self.parameter_name} = {value:.6g} was not "
                                f"found from that at {start.parameter:.6g}; follow the branch in "
                                f"shorter steps there.")
        return on_branch(found, BranchHeader(self.parameter_name, self.attributes))

    def _passages(self, passed: list[tuple[int, float]]) -> str:
        """Remedy for an error message: the values that can be asked for."""
        if passed:
            last = len(passed) - 1
            return (f"the branch passes this value {len(passed)} times; choose a whole number from "
                    f"0 to {last}" if last else "the branch passes this value once; choose 0")
        if not self.points:
            return "the branch has no point"
        low, high = self.parameter.min(), self.parameter.max()
        return (f"the branch lies between {low:.6g} and {high:.6g}; choose a value there, or "
                f"follow it further")

    def _passed(self, value: float) -> list[tuple[int, float]]:
        """Indices of points beside a value of the parameter, with the direction to it along the
        branch: 1 forwards, -1 backwards.
        """
        found = []
        for index, (here, there) in enumerate(pairwise([*self.points, None])):
            assert here is not None
            if here.parameter == value:
                found.append((index, 1.0))
            elif there is not None and (here.parameter - value) * (there.parameter - value) < 0.0:
                # A branch point has no unique tangent: start from its neighbour.
                found.append((index + 1, -1.0) if here.kind and not there.kind else (index, 1.0))
        return found

    def _continued(
        self, field: VectorField, point: BranchPoint, sign: float, options: ContinuationOptions
    ) -> Iterator[BranchPoint]:
        """Points from one of the branch on, forwards or backwards along it."""
        from fecontact.bifurcation.equilibria.problem import restored_equilibrium
        from fecontact.bifurcation.orbits.restored import continued

        if point.is_orbit:
            return continued(field, point, sign, options)
        width = float(np.ptp(self.parameter)) or abs(point.parameter) or 1.0
        problem, u, tangent = restored_equilibrium(field, point, width)
        return continuation(problem, u, options, tangent=sign * tangent)

    def reversed(self) -> "Branch":
        """The branch in the other direction."""
        turned = tuple(replace(point, tangent=-point.tangent) for point in self.points[::-1])
        return replace(self, points=turned)
