"""Pseudo-arclength continuation of the solutions of N equations in N + 1 unknowns.

Solutions G(u) = 0 form branches. From a point on one, a step goes along the tangent and Newton's
method comes back to the branch at right angles to it. Sizes and angles are those of an inner
product ``<a, b> = sum w a b`` that the problem gives. The last unknown is the parameter.
"""

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.branch import BranchPoint, Status
from fecontact.errors import AnalysisError, FecontactError, InputError, require_positive

Array = NDArray[np.float64]

# Newton's method for special points goes on to steps of this relative size.
_EXACT = 1e-10


class Linearisation(Protocol):
    """The equations about some u.

    Attributes
    ----------
    residual : (N,) array
        G(u).
    """

    residual: Array

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution (N + 1,) of ``[[dG/du], [row]] x = rhs``."""


class Problem(Protocol):
    """What is continued. Subclass it to get the defaults of the optional methods."""

    # Whether Newton's method goes on with the matrix it has while that is good enough.
    keeps_matrix: bool = False

    def linearise(self, u: Array) -> Linearisation:
        """The equations about u.

        A FecontactError or values that are not finite make the step fail, and be halved.
        """
        ...

    def weights(self) -> Array:
        """Weights w (N + 1,) of the inner product, positive."""
        ...

    def point(self, u: Array, linearisation: Linearisation, tangent: Array) -> Mapping[str, Any]:
        """What is stored of a solution: numbers, arrays; the same names for each.

        Where it holds 'unstable', a number of unstable directions, a step is halved whose changes
        of it are more than two for each test function that changes sign.
        """
        ...

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

    def adapted(self, u: Array, tangent: Array) -> "tuple[Problem, Array, Array] | None":
        """The problem on a better mesh, with u and tangent on it, after each step; None to stay."""
        return None


@dataclass(frozen=True)
class Settings:
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
        then is of the order of its square. Special points are located to 1e-10.
    iterations : int
        Newton steps before a step counts as failed.
    largest_turn : float
        Largest angle between tangents of neighbouring points [rad].
    locate : bool
        Whether special points are located, besides the events.
    stop_at : sequence of str
        Kinds of special points, or events, at which the branch ends.
    events : mapping
        Functions of the stored values (and 'parameter') whose zeros are points of the kind by
        which they are called.
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

    def __post_init__(self) -> None:
        require_positive("Settings", step=self.step, smallest_step=self.smallest_step,
                         largest_step=self.largest_step, tolerance=self.tolerance,
                         points=self.points, iterations=self.iterations,
                         largest_turn=self.largest_turn)
        if not self.smallest_step <= self.step <= self.largest_step:
            raise InputError(f"Settings: step = {self.step:g} must lie between smallest_step = "
                             f"{self.smallest_step:g} and largest_step = {self.largest_step:g}.")
        low, high = self.bounds
        if not low < high:
            raise InputError(f"Settings: bounds = {self.bounds!r} must be two values of the "
                             f"parameter, the smaller one first.")


@dataclass(frozen=True, eq=False)
class _Solution:
    """A converged point, with all that was made there."""

    u: Array
    linearisation: Linearisation
    tangent: Array
    iterations: int
    values: Mapping[str, Any]
    tests: Mapping[str, float]


@dataclass(frozen=True)
class End:
    """How a continuation ended, and what the last failed step complained of."""

    status: Status
    message: str = ""


def continuation(
    problem: Problem,
    u: Array,
    settings: Settings,
    *,
    tangent: Array | None = None,
    direction: float = 1.0,
) -> Generator[BranchPoint, None, End]:
    """Points of a branch one by one, from a solution (or something near to one) on.

    Special points come in their places between the regular ones. The generator returns how the
    branch ended.

    Parameters
    ----------
    problem : Problem
        What is continued.
    u : (N + 1,) array
        Start; corrected at right angles to ``tangent``, or at the given parameter.
    settings : Settings
        How.
    tangent : (N + 1,) array, optional
        Direction of the first step.
    direction : float
        Sign of the first change of the parameter, where there is no tangent.

    Raises
    ------
    FecontactError
        If there is no solution near the start.
    """
    start = start_of(problem, u, settings, tangent, direction)
    yield BranchPoint(start.u, start.tangent, start.values)
    here, step, count, message, fixed_mesh = start, settings.step, 1, "", True
    stops = {settings.stop_at} if isinstance(settings.stop_at, str) else set(settings.stop_at)
    while count < settings.points:
        try:
            there = _step(problem, here, step, settings)
        except FecontactError as error:
            there, message = None, str(error)
        if there is None or not _believable(problem, here, there, step, settings):
            step *= 0.5
            if step < settings.smallest_step:
                return End(Status.STALLED, message)
            continue
        for located in _located(problem, here, there, settings):
            yield located
            if located.kind in stops:
                return End(Status.STOPPED)
            if located.kind is None:
                return End(Status.BOUND)
        if fixed_mesh and count > 2 and _passes(problem, here, there, start):
            yield BranchPoint(start.u, start.tangent, start.values)
            return End(Status.CLOSED)
        yield BranchPoint(there.u, there.tangent, there.values)
        count += 1
        step = _next_step(problem, here, there, step, settings)
        here = there
        adapted = problem.adapted(here.u, here.tangent)
        if adapted is not None:
            problem, moved, turned = adapted
            turned = turned / _norm(problem, turned)
            fixed_mesh = fixed_mesh and np.array_equal(moved, here.u)
            here = _Solution(moved, here.linearisation, turned, 0, here.values, here.tests)
    return End(Status.POINTS)


def start_of(
    problem: Problem, u: Array, settings: Settings, tangent: Array | None, direction: float
) -> _Solution:
    """The solution near u, with its tangent."""
    row = np.zeros(len(u))
    if tangent is None:
        row[-1] = 1.0 if direction >= 0.0 else -1.0
    else:
        row = problem.weights() * tangent / _norm(problem, tangent)
    found = _corrected(problem, np.array(u, dtype=float), row, settings.tolerance,
                       3 * settings.iterations)
    if found is None:
        raise InputError(f"There is no solution near the start at the parameter {u[-1]:.6g}; give "
                         f"a start that is closer to one.")
    return _finished(problem, *found, row, settings)


def _step(problem: Problem, here: _Solution, step: float, settings: Settings) -> _Solution | None:
    row = problem.weights() * here.tangent
    found = _corrected(problem, here.u + step * here.tangent, row, settings.tolerance,
                       settings.iterations)
    return None if found is None else _finished(problem, *found, row, settings)


def _corrected(
    problem: Problem, guess: Array, row: Array, tolerance: float, iterations: int
) -> tuple[Array, Linearisation, int] | None:
    """Newton's method at right angles to a row, from a guess; None where it does not converge."""
    u, before, kept = guess, np.inf, None
    for count in range(1, iterations + 1):
        linearisation = problem.linearise(u)
        rhs = np.append(-linearisation.residual, -(row @ (u - guess)))
        change = (kept or linearisation).solve(row, rhs)
        size = _norm(problem, change)
        if not np.isfinite(size) or (count > 2 and size > before):
            return None
        u = u + change
        scale = 1.0 + _norm(problem, u)
        # With a matrix that is kept the error falls by the same factor each time, not squared.
        if kept is not None and size * size / before <= max(1e-2 * tolerance, 1e-13) * scale:
            return u, problem.linearise(u), max(1, count - 2)
        if kept is None and size <= tolerance * scale:
            return u, linearisation, count
        if problem.keeps_matrix:
            kept = (kept or linearisation) if kept is None or size < 0.2 * before else None
        before = size
    return None


def _finished(
    problem: Problem, u: Array, linearisation: Linearisation, iterations: int, row: Array,
    settings: Settings,
) -> _Solution:
    unit = np.zeros(len(u))
    unit[-1] = 1.0
    tangent = linearisation.solve(row, unit)
    size = _norm(problem, tangent)
    if not (np.isfinite(size) and size > 0.0):
        raise AnalysisError("The branch has no direction there: its equations grow beyond all "
                            "numbers.")
    tangent = tangent / size
    values = problem.point(u, linearisation, tangent)
    return _Solution(u, linearisation, tangent, iterations, values,
                     _tests(problem, u, linearisation, tangent, values, settings))


def _tests(
    problem: Problem, u: Array, linearisation: Linearisation, tangent: Array,
    values: Mapping[str, Any], settings: Settings,
) -> dict[str, float]:
    found: dict[str, float] = {}
    if settings.locate:
        found |= {"fold": float(tangent[-1]), **problem.tests(u, linearisation, tangent)}
    known = {**values, "parameter": float(u[-1])}
    return found | {name: float(event(known)) for name, event in settings.events.items()}


def _believable(
    problem: Problem, here: _Solution, there: _Solution, step: float, settings: Settings
) -> bool:
    """Whether a step neither turns too much nor passes over more than its tests can tell."""
    turn = float(problem.weights() * here.tangent @ there.tangent)
    if turn < np.cos(settings.largest_turn):
        return False
    jump = abs(int(there.values.get("unstable", 0)) - int(here.values.get("unstable", 0)))
    if not settings.locate or step < 1e-3 * settings.step:
        return True
    return jump <= 2 * len(_changed(here, there))


def _changed(here: _Solution, there: _Solution) -> list[str]:
    return [name for name, value in there.tests.items()
            if here.tests.get(name, np.nan) * value < 0.0]


def _next_step(
    problem: Problem, here: _Solution, there: _Solution, step: float, settings: Settings
) -> float:
    """Longer after quick convergence on a straight piece, shorter after slow."""
    factor = {1: 2.0, 2: 2.0, 3: 1.5, 4: 1.1}.get(there.iterations, 0.7)
    turn = np.arccos(min(1.0, float(problem.weights() * here.tangent @ there.tangent)))
    if turn > 0.0:
        factor = min(factor, max(0.5, 0.5 * settings.largest_turn / turn))
    return min(factor * step, settings.largest_step)


def _passes(problem: Problem, here: _Solution, there: _Solution, start: _Solution) -> bool:
    """Whether the start of the branch lies on the step from here to there."""
    weights = problem.weights()
    if len(start.u) != len(here.u) or float(weights * here.tangent @ start.tangent) < 0.9:
        return False
    length = float(weights * here.tangent @ (there.u - here.u))
    along = float(weights * here.tangent @ (start.u - here.u))
    if not 0.0 < along <= length:
        return False
    aside = start.u - _between(problem, here, there, along)
    return _norm(problem, aside) < 1e-2 * length


def _between(problem: Problem, here: _Solution, there: _Solution, along: float) -> Array:
    """Cubic between two points of a branch, at a length along the first one's tangent."""
    row = problem.weights() * here.tangent
    length = float(row @ (there.u - here.u))
    x = along / length
    slope = there.tangent / float(row @ there.tangent)
    chord = there.u - here.u
    return np.asarray(
        here.u + length * x * (1.0 - x) ** 2 * here.tangent + x * x * (3.0 - 2.0 * x) * chord
        + length * x * x * (x - 1.0) * slope)


def _located(
    problem: Problem, here: _Solution, there: _Solution, settings: Settings
) -> list[BranchPoint]:
    """Special points between two regular ones, in order; one without a kind is on a bound."""
    row = problem.weights() * here.tangent
    found = []
    for name in _changed(here, there):
        located = _zero(problem, here, there, settings, _test_value(name),
                        here.tests[name], there.tests[name])
        if located is None:
            continue
        details = problem.examine(name, located.u, located.linearisation, located.tangent)
        if details is not None:
            kind = str(details.get("kind", name))
            rest = {key: value for key, value in details.items() if key != "kind"}
            found.append(BranchPoint(located.u, located.tangent, located.values, kind, rest))
    for bound in settings.bounds:
        before, after = here.u[-1] - bound, there.u[-1] - bound
        if before * after < 0.0 or (after == 0.0 and before != 0.0):
            located = (there if after == 0.0 else
                       _zero(problem, here, there, settings, _distance_to(bound), before, after))
            if located is not None:
                found.append(BranchPoint(located.u, located.tangent, located.values))
    return sorted(found, key=lambda point: float(row @ (point.u - here.u)))


def _test_value(name: str) -> Callable[[_Solution], float]:
    return lambda at: at.tests[name]


def _distance_to(bound: float) -> Callable[[_Solution], float]:
    return lambda at: float(at.u[-1]) - bound


def _zero(
    problem: Problem, here: _Solution, there: _Solution, settings: Settings,
    test: Callable[[_Solution], float], before: float, after: float,
) -> _Solution | None:
    """The solution between two others at which a test function is zero; None at a pole or jump."""
    from scipy.optimize import brentq

    row = problem.weights() * here.tangent
    length = float(row @ (there.u - here.u))
    best: list[tuple[float, _Solution]] = []

    def value(along: float) -> float:
        if along <= 0.0 or along >= length:
            return before if along <= 0.0 else after
        found = _corrected(problem, _between(problem, here, there, along), row, _EXACT,
                           2 * settings.iterations)
        if found is None:
            raise _LostError
        # The test functions are those of this very point, not of the last Newton step.
        u, _, count = found
        at = _finished(problem, u, problem.linearise(u), count, row, settings)
        result = test(at)
        best.append((abs(result), at))
        return result

    try:
        brentq(value, 0.0, length, xtol=1e-12 * length, rtol=1e-14, maxiter=60, disp=False)
    except (_LostError, FecontactError):
        if not best:
            return None
    size, at = min(best, key=lambda pair: pair[0])
    return at if size <= 1e-3 * max(abs(before), abs(after)) else None


class _LostError(Exception):
    pass


def _norm(problem: Problem, vector: Array) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.sqrt(problem.weights() * vector @ vector))
