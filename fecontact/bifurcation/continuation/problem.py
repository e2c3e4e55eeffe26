"""What is continued, how, and how it ended."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array

_PARALLEL = 0.9  # cosine between directions that count as the same


class BranchStatus(Enum):
    """How a branch ended; the value is the sentence for people."""

    POINTS = "The branch has as many points as were asked for."
    BOUND = "The branch reached a bound of its parameter."
    STOPPED = "The branch reached a point at which it was to stop."
    CLOSED = ("The branch came back to its start, or to where it would run through the same orbits "
              "again.")
    STALLED = ("The steps became too small to go on; what was computed until then is kept. Look "
               "whether the solution changes abruptly here, or start with smaller steps.")
    INTERRUPTED = "The continuation was interrupted; what was computed until then is kept."


class Linearisation(Protocol):
    """The equations about some u."""

    @property
    def residual(self) -> Array:
        """The residual G(u) (N,)."""

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution (N + 1,) of ``[[dG/du], [row]] x = rhs``."""


class Problem(Protocol):
    """What is continued. Subclass it to get the defaults of the optional methods.

    Attributes
    ----------
    keeps_matrix : bool
        Whether Newton's method goes on with the matrix that it has as long as that serves; for
        problems whose factorisation costs far more than a residual and a solution.
    precision : float
        Part of a step to which special points are located on it.
    event_precision : float
        The same for events.
    confirms : frozenset of str
        Test functions that jump a little where the mesh is renewed, and whose zeros
        :meth:`examine` confirms.
    """

    keeps_matrix: ClassVar[bool] = False
    precision: float = 1e-12
    event_precision: ClassVar[float] = 1e-12
    confirms: ClassVar[frozenset[str]] = frozenset()

    def linearise(self, u: Array) -> Linearisation:
        """The equations about u.

        A FecontactError or values that are not finite make the step fail, and be halved.
        """
        ...

    def evaluate(self, u: Array) -> Linearisation:
        """The equations about u, of which only the residual will be asked for."""
        return self.linearise(u)

    def weights(self) -> Array:
        """Weights w (N + 1,) of the inner product, positive."""
        ...

    def point(self, u: Array, linearisation: Linearisation, tangent: Array) -> Mapping[str, Any]:
        """What is stored of a solution: numbers, arrays; the same names for each.

        Where it holds 'unstable', a number of unstable directions, a step is halved whose special
        points do not explain the change of it.
        """
        ...

    def unstable_range(
        self, linearisation: Linearisation, values: Mapping[str, Any]
    ) -> tuple[int, int]:
        """Least and largest number of unstable directions that rounding leaves open."""
        count = int(values.get("unstable", 0))
        return count, count

    def tests(self, u: Array, linearisation: Linearisation, tangent: Array) -> Mapping[str, float]:
        """Functions whose zeros are special points, by kind; folds are found without."""
        return {}

    def examine(
        self, kind: str, u: Array, linearisation: Linearisation, tangent: Array
    ) -> Mapping[str, Any] | None:
        """Details of a special point that was located; None if it is none of that kind.

        The key 'kind' replaces the kind.
        """
        return {}

    @property
    def rounding(self) -> float:
        """Newton steps of this relative size that grow again are rounding."""
        return 1e-7

    def predicted(self, u: Array, tangent: Array, step: float) -> Array:
        """Where Newton's method begins, a step from u."""
        return u + step * tangent

    def adapted(self, u: Array, tangent: Array) -> "tuple[Problem, Array, Array] | None":
        """The problem on a better mesh, with u and tangent on it, after each step; None to stay."""
        return None

    def met_again(
        self, origin: "Problem", u: Array, tangent: Array, like: Array, heading: Array,
        within: float,
    ) -> Array | None:
        """The start u of the branch in the unknowns of this problem; None where it goes elsewhere.

        ``origin`` is the problem at the start, and ``tangent`` the direction there; ``like`` and
        ``heading`` are those of the point that was reached, on this problem. A start that is
        surely farther from ``like`` than ``within`` need not be given.
        """
        if len(u) != len(like) or float(self.weights() * heading @ tangent) < _PARALLEL:
            return None
        return u

    def unresolved(
        self, tangents: tuple[Array, Array], values: tuple[Mapping[str, Any], Mapping[str, Any]],
        tests: tuple[Mapping[str, float], Mapping[str, float]],
    ) -> Iterable[str]:
        """Kinds whose tests change sign between two neighbouring points by rounding alone."""
        return ()


@dataclass(frozen=True)
class ContinuationOptions:
    """How a branch is followed.

    Lengths are those of the problem's inner product; the problems of this package scale it so
    that one is the width of the diagram.

    Parameters
    ----------
    step, smallest_step, largest_step : float
        First step, and limits of the steps.
    points : int
        Number of regular points after which the branch ends.
    bounds : tuple
        Least and largest value of the parameter; the last point lies on the bound.
    tolerance : float
        Newton's method ends with a step of this size, relative to 1 + the size of u; what is left
        then is of the order of its square. Special points and events are located to 1e-10.
    iterations : int
        Newton steps before a step counts as failed.
    largest_turn : float
        Largest angle between tangents of neighbouring points [rad].
    locate : bool
        Whether special points are located, besides the events, and changes of stability explained.
    stop_at : sequence of str
        Kinds of special points, or events, at which the branch ends.
    events : mapping
        Functions of the stored values (and 'parameter') whose zeros are points of the kind by
        which they are called.
    progress : callable, optional
        Told the number of points after each.
    """

    step: float = 0.01
    smallest_step: float = 1e-7
    largest_step: float = 0.05
    points: int = 400
    bounds: tuple[float, float] = (-np.inf, np.inf)
    tolerance: float = 1e-7
    iterations: int = 7
    largest_turn: float = 0.6
    locate: bool = True
    stop_at: Iterable[str] = ()
    events: Mapping[str, Callable[[Mapping[str, Any]], float]] = field(default_factory=dict)
    progress: Callable[[int], None] | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        require_positive("ContinuationOptions", step=self.step, smallest_step=self.smallest_step,
                         largest_step=self.largest_step, tolerance=self.tolerance,
                         points=self.points, iterations=self.iterations,
                         largest_turn=self.largest_turn)
        if not self.smallest_step <= self.step <= self.largest_step:
            raise InputError(f"ContinuationOptions: step = {self.step:g} must lie between "
                             f"smallest_step = {self.smallest_step:g} and "
                             f"largest_step = {self.largest_step:g}.")
        try:
            low, high = self.bounds
            fine = float(low) < float(high)
        except (TypeError, ValueError):
            fine = False
        if not fine:
            raise InputError(f"ContinuationOptions: bounds = {self.bounds!r} must be two values of "
                             f"the parameter, the smaller one first.")


def options_of(
    options: ContinuationOptions | None, bounds: tuple[float, float] | None
) -> ContinuationOptions:
    """The options, with other bounds if these are given."""
    require_kind("A branch", (ContinuationOptions, type(None)), options=options)
    chosen = options or ContinuationOptions()
    return chosen if bounds is None else replace(chosen, bounds=bounds)


def sizes_of(given: ArrayLike | None, found: Array) -> tuple[Array, Array | None]:
    """Scales (d,) of the states, and up to where they grow with the orbit."""
    if given is None:
        return found, 100.0 * found
    sizes = as_floats(given, "scales")
    if sizes.shape != found.shape or not (sizes > 0.0).all():
        raise InputError(f"scales = {given!r} must hold {len(found)} numbers above zero, one for "
                         f"each state.")
    return sizes, None


def width_of(given: float | None, options: ContinuationOptions, value: float) -> float:
    """Width of the diagram in the parameter, by default that of the bounds."""
    if given is not None:
        require_positive("A branch", width=given)
        return given
    span = options.bounds[1] - options.bounds[0]
    return float(span) if np.isfinite(span) else abs(float(value)) or 1.0
