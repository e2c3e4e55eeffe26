"""Interface of continuation problems, options of a branch, and the status at its end."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, ClassVar, Protocol

import numpy as np

from fecontact.bifurcation.continuation.predictor import Predictor
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.core.checks import as_count, as_floats, as_texts, require_flags, require_kind
from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_finite,
    require_positive,
    shown,
)
from fecontact.core.types import Array, ArrayLike

_GROWTH = 1e4  # largest factor by which scales grow with the orbits of a branch
_NEARLY = 1.5  # factor to the size of an orbit up to which scales are kept
_ROUNDING = Rounding()
_TANGENT = Predictor()
_SAME_DIRECTION = 0.9  # cosine between directions that count as the same


class BranchStatus(Enum):
    """End of a branch; the value is a sentence to show."""

    POINTS = "The branch has as many points as were asked for."
    BOUND = "The branch reached a bound of its parameter."
    HOPF = ("The orbits shrink to an equilibrium: to a Hopf point on a branch, a Bautin point on a "
            "curve of folds, a Bogdanov-Takens point on a curve of homoclinic orbits.")
    HOMOCLINIC = ("The orbits approach a homoclinic orbit: their period grows without bound while "
                  "they stay ever longer near a saddle.")
    DISCONTINUITY = ("The orbit meets a border of its contact states, which the last point of a "
                     "branch names. No orbits were found beyond it; if motions go on there, "
                     "start a branch from one of them.")
    SADDLE_NODE = ("The curve ends where the saddle of the homoclinic orbits meets another "
                   "equilibrium in a fold.")
    SINGLE_FREQUENCY = ("The tori shrink to a periodic orbit: the branch ends at a Neimark-Sacker "
                        "point.")
    UNRESOLVED_TORUS = ("The harmonics no longer resolve the torus: take more harmonics, or check "
                        "by a run whether the torus breaks up here (frequency locking, chaos).")
    STOPPED = "The branch reached a point at which it was to stop."
    CLOSED = ("The branch returned to its start, or to a point from which it would repeat the same "
              "orbits.")
    STALLED = ("The steps became too small to continue; the points computed so far are kept. Check "
               "whether the solution changes abruptly here, or start with smaller steps.")
    INTERRUPTED = "The continuation was interrupted; the points computed so far are kept."


@dataclass(frozen=True, eq=False)
class Stride:
    """Plain steps of a branch that a problem makes at once, with folds among them alone.

    Attributes
    ----------
    points : list of BranchPoint
        One for each step, and the folds.
    count : int
        Number of the former.
    problem : Problem
        The problem for the next step.
    here, before : Solution
        Last point, with the tangent in the lengths of that problem, and the one before it.
    step : float
        Length of the next step.
    status : BranchStatus, optional
        Why the branch ends with the last point; None where it goes on.
    """

    points: list[Any]
    count: int
    problem: "Problem"
    here: Any
    before: Any
    step: float
    status: BranchStatus | None = None


class FastSteps(Protocol):
    """Compiled starts and steps of a problem."""

    def start(self, problem: Any, u: Array, row: Array) -> Any:
        """The :class:`~fecontact.bifurcation.continuation.newton.Solution` at right angles to a row
        near u; None where it is not found so.
        """

    def batch(
        self, problem: Any, here: Any, step: float, most: int, start: Any, header: Any = None
    ) -> Stride | None:
        """At most so many plain steps from a solution; None if the next step is none.

        ``header`` is that of the points.
        """


class Linearisation(Protocol):
    """The equations about some u."""

    @property
    def residual(self) -> Array:
        """The residual G(u) (N,)."""

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution (N + 1,) of ``[[dG/du], [row]] x = rhs``."""


class Problem(Protocol):
    """Equations G(u) = 0 to be continued. Subclass it; methods with a body are optional.

    Attributes
    ----------
    keeps_matrix : bool
        Whether the corrector reuses its factorised matrix (chord method with Broyden updates); for
        problems whose factorisation costs far more than a residual and a solve.
    polishes : bool
        Whether a solution found with such a matrix gets one more step with its own one.
    precision : float
        Part of a step to which special points are located.
    event_precision : float
        Part of a step to which events are located.
    confirms : frozenset of str
        Test functions that jump a little where the mesh is renewed, and whose zeros
        :meth:`examine` confirms.
    ends : mapping
        Test functions that end the branch where they become negative, and the status there.
    may_turn_back : bool
        Whether steps are compared with points passed before, in the opposite direction, to end a
        branch that goes back along itself.
    """

    keeps_matrix: ClassVar[bool] = False
    polishes: ClassVar[bool] = False
    precision: float = 1e-12
    event_precision: ClassVar[float] = 1e-12
    confirms: ClassVar[frozenset[str]] = frozenset()
    ends: ClassVar[Mapping[str, BranchStatus]] = {}
    may_turn_back: ClassVar[bool] = False

    @property
    def predictor(self) -> Predictor:
        """Predictor of the next point."""
        return _TANGENT

    @property
    def rounding(self) -> Rounding:
        """Uncertainty by rounding at points of the branch."""
        return _ROUNDING

    @property
    def kinked(self) -> bool:
        """Whether the equations may have kinks, where Newton's method suddenly converges slowly."""
        return False

    def longest_step(self, tangent: Array, turn: float, options: "ContinuationOptions") -> float:
        """Largest step from a point to which Newton's method converged at once.

        ``turn`` is the angle between the tangent there and at the point before [rad].
        """
        return options.largest_step

    def linearise(self, u: Array) -> Linearisation:
        """Linearise the equations at u.

        A FecontactError or values that are not finite make the step fail; it is then halved.
        """
        ...

    def evaluate(self, u: Array) -> Linearisation:
        """The equations at u, for the residual alone."""
        return self.linearise(u)

    def weights(self) -> Array:
        """Weights w (N + 1,) of the inner product, positive."""
        ...

    def point(self, u: Array, linearisation: Linearisation, tangent: Array) -> Mapping[str, Any]:
        """Values to store of a solution, numbers and arrays, with the same names for each.

        With 'unstable', the number of unstable directions, a step is halved unless its special
        points explain the change of that number.
        """
        ...

    def note(self, points: Any) -> str:
        """Notes on the points of a branch for its message, here that on their rounding."""
        return self.rounding.note(points)

    def tests(
        self, u: Array, linearisation: Linearisation, tangent: Array
    ) -> Mapping[str, float | Callable[[], float]]:
        """Test functions by kind; special points are their zeros. Folds need none.

        One that takes long may be given as a function without arguments, which is called at
        points of the branch alone, and where its own zero is sought.
        """
        return {}

    def ended(self, u: Array, linearisation: Linearisation, tangent: Array) -> BranchStatus | None:
        """Why the branch ends at a regular point; None where it goes on."""
        return None

    def examine(
        self, kind: str, u: Array, linearisation: Linearisation, tangent: Array
    ) -> Mapping[str, Any] | None:
        """Data of a located special point; None if it is not of that kind after all.

        The names are those of the attributes of the kind's class, such as ``criticality`` of
        :class:`fecontact.bifurcation.HopfPoint`; 'kind' replaces the kind.
        """
        return {}

    def orientation(self, linearisation: Any, tangent: Array) -> float:
        """Sign of det [[dG/du], [w tangent]], constant along a branch; 0 if unknown."""
        return 0.0

    def predicted(self, u: Array, tangent: Array, step: float) -> Array:
        """The guess a step ahead of u."""
        return self.predictor.ahead(self.weights(), u, tangent, step)

    def adapted(self, u: Array, tangent: Array) -> "tuple[Problem, Array, Array] | None":
        """Problem, u and tangent on a new mesh, asked for after each step; None to keep the old."""
        return None

    def refined(
        self, u: Array, tangent: Array, ahead: Sequence[Any]
    ) -> "tuple[Problem, Array, Array] | None":
        """Problem, u and tangent on a finer mesh, to make a step once more.

        ``ahead`` are the solutions and special points that it led to; None where all of them are
        accurate enough.
        """
        return None

    def fast_steps(self, options: "ContinuationOptions") -> FastSteps | None:
        """Compiled starts and steps; None where points are made one by one."""
        return None

    def met_again(
        self, origin: Any, u: Array, tangent: Array, like: Array, heading: Array, within: float
    ) -> Array | None:
        """The start u of the branch in the unknowns of this problem; None where it goes elsewhere.

        ``origin`` is this problem at the start, and ``tangent`` the direction there; ``like`` and
        ``heading`` are those of the point that was reached, on this problem. A start that is
        surely farther from ``like`` than ``within`` need not be given.
        """
        if len(u) != len(like) or float(self.weights() * heading @ tangent) < _SAME_DIRECTION:
            return None
        return u


# Kinds of special points of the branches and curves of this package.
KINDS = (
    "Hopf", "fold", "branch point", "period doubling", "period halving", "Neimark-Sacker",
    "unresolved", "cusp", "turning point", "extremum", "Bogdanov-Takens", "Bautin", "zero-Hopf",
    "double Hopf", "generalised period doubling", "Chenciner", "resonance 1:1", "resonance 1:2",
    "resonance 1:3", "resonance 1:4", "fold-flip", "fold-Neimark-Sacker", "flip-Neimark-Sacker",
    "double Neimark-Sacker", "neutral saddle", "stable double eigenvalue",
    "unstable double eigenvalue", "stable orbit flip", "unstable orbit flip",
    "stable inclination flip", "unstable inclination flip", "grazing", "grazing-sliding",
    "crossing-sliding", "switching-sliding", "adding-sliding", "impact-sliding", "lift-off",
    "corner")


@dataclass(frozen=True)
class ContinuationOptions:
    """Step control, bounds and events of a branch.

    Lengths are those of the problem's inner product; the problems of this package scale it so
    that one is the width of the diagram.

    Parameters
    ----------
    step, smallest_step, largest_step : float
        First step, and limits of the steps. On straight parts of branches of equilibria the largest
        step is the largest change of the parameter, in widths of the diagram; along a mode without
        losses, of polynomial springs, steps are up to four times as long where the frequency
        hardly changes.
    points : int
        Number of regular points after which the branch ends. To both sides they count together; if
        they do not suffice, each gets half of them, or what the other one leaves.
    bounds : tuple
        Least and largest value of the parameter; the last point lies on the bound.
    second_bounds : tuple
        Least and largest value of the second parameter of a curve over two.
    tolerance : float
        Newton's method ends with a step of this size relative to 1 + |u|; the remaining error is of
        the order of its square, where laws have kinks of the order of the tolerance. Special points
        and events are located to 1e-10.
    iterations : int
        Newton steps before a step counts as failed.
    largest_turn : float
        Largest angle between tangents of neighbouring points [rad].
    locate : bool
        Whether to locate special points, besides the events, check changes of stability, and end
        at Hopf points and homoclinic orbits.
    stop_at : sequence of str
        Kinds of special points, or names of events, at which the branch ends.
    events : mapping
        Functions by name of the stored values (and 'parameter'); their zeros become points of the
        kind of that name. Where one is NaN it has none; the message of the branch tells where it
        is NaN at all points.
    progress : bool or callable, optional
        True for a progress bar on a terminal or in a notebook; a function receives the number of
        points after each.
    """

    step: float = 0.01
    smallest_step: float = 1e-7
    largest_step: float = 0.05
    points: int = 400
    bounds: tuple[float, float] = (-np.inf, np.inf)
    second_bounds: tuple[float, float] = (-np.inf, np.inf)
    tolerance: float = 1e-7
    iterations: int = 7
    largest_turn: float = 0.6
    locate: bool = True
    stop_at: Iterable[str] = ()
    events: Mapping[str, Callable[[Mapping[str, Any]], float]] = field(default_factory=dict)
    progress: bool | Callable[[int], None] | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        require_positive("ContinuationOptions", step=self.step, smallest_step=self.smallest_step,
                         largest_step=self.largest_step, tolerance=self.tolerance,
                         points=self.points, iterations=self.iterations,
                         largest_turn=self.largest_turn)
        for name in ("points", "iterations"):
            as_count(getattr(self, name), f"ContinuationOptions: {name}")
        require_flags("ContinuationOptions", locate=self.locate)
        # An iterator gives them once.
        object.__setattr__(self, "stop_at", as_texts(self.stop_at, "ContinuationOptions: stop_at"))
        require_kind("ContinuationOptions", Mapping, events=self.events)
        for name, event in self.events.items():
            require_kind("ContinuationOptions: events", str, name=name)
            if not callable(event):
                raise InputError(f"ContinuationOptions: events: {name!r} = {shown(event)} must be "
                                 f"a function of the stored values.")
        if not self.smallest_step <= self.step <= self.largest_step:
            raise InputError(f"ContinuationOptions: step = {self.step:g} must lie between "
                             f"smallest_step = {self.smallest_step:g} and "
                             f"largest_step = {self.largest_step:g}.")
        for name in ("bounds", "second_bounds"):
            given = getattr(self, name)
            try:
                low, high = given
                fine = float(low) < float(high)
            except (TypeError, ValueError):
                fine = False
            if not fine:
                raise InputError(f"ContinuationOptions: {name} = {given!r} must be two values of "
                                 f"the parameter, the smaller one first.")

    @property
    def box(self) -> tuple[tuple[int, float, float], ...]:
        """Bounded unknowns: the place of each in u, its least and its largest value."""
        return tuple((place, *bounds) for place, bounds in
                     ((-1, self.bounds), (-2, self.second_bounds)) if np.isfinite(bounds).any())


def options_of(
    options: ContinuationOptions | None, bounds: tuple[float, float] | None
) -> ContinuationOptions:
    """The options, default ones if None, with the bounds if given."""
    require_kind("A branch", (ContinuationOptions, type(None)), options=options)
    chosen = options or ContinuationOptions()
    known = (*KINDS, *chosen.events)
    for kind in chosen.stop_at:
        if kind not in known:
            raise InputError(f"ContinuationOptions: stop_at = {kind!r} is no kind of special point "
                             f"and no name of an event{nearest(kind, known)}; known are: "
                             f"{choices(known)}.")
    return chosen if bounds is None else replace(chosen, bounds=bounds)


def titled(
    options: ContinuationOptions, title: str, progress: Callable[[str, float], None] | None
) -> ContinuationOptions:
    """Options whose progress passes on the title and the part of the points that is done."""
    if progress is None:
        return options
    progress(title, 0.0)
    return replace(options, progress=lambda points: progress(title, points / options.points))


def sizes_of(given: ArrayLike | None, found: Array) -> tuple[Array, Array | None]:
    """Scales (d,) of the states, and their upper limits where they grow with the orbit."""
    if given is None:
        return found, _GROWTH * found
    sizes = as_floats(given, "scales")
    if sizes.shape != found.shape or not (sizes > 0.0).all():
        raise InputError(f"scales = {given!r} must hold {len(found)} numbers above zero, one for "
                         f"each state.")
    return sizes, None


def enlarged(scales: Array, sizes: Array, limits: Array | None) -> Array:
    """Scales of states, period and parameter, enlarged to the sizes (d,) of the states of an orbit.

    They grow up to ``limits`` (d,); scales that are nearly large enough, or without limits, are
    returned as they are.
    """
    if limits is None:
        return scales
    d = len(sizes)
    larger = np.clip(sizes, scales[:d], limits)
    if (larger <= _NEARLY * scales[:d]).all():
        return scales
    return np.concatenate([larger, scales[d:]])


def require_direction(owner: str, direction: float) -> None:
    """Raise :class:`InputError` unless a direction is a finite number other than zero."""
    require_finite(owner, direction=direction)
    if direction == 0.0:
        raise InputError(f"{owner}: direction = {direction!r} must be above zero, to go forward, "
                         f"or below zero, to go back.")


def width_of(
    given: float | None, options: ContinuationOptions, value: float, known: float | None = None
) -> float:
    """Width of the diagram in the parameter, by default that of the bounds.

    Without bounds it is ``known``, the width of the branch from which it starts, or the size of the
    value at the start.
    """
    if given is not None:
        require_positive("A branch", width=given)
        return given
    span = options.bounds[1] - options.bounds[0]
    if np.isfinite(span):
        return float(span)
    return abs(float(value)) or 1.0 if known is None else float(known)
