"""Special points within one step of a branch."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.crossings import counted, with_count
from fecontact.bifurcation.continuation.newton import Solution, norm
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import UNRESOLVED, special_point
from fecontact.bifurcation.continuation.step import Step

# Largest distance of a solution from the cubic through both ends of a step: part of the distance
# of the end from the tangent, and relative to the size of the solution.
_OFF_CUBIC, _ROUNDING = 0.2, 1e-7
# Part of a step to which a jump of the stability or of a slope is located.
_JUMP = 1e-3
# Part of a step to which a bound of the parameter is located.
_BOUND = 1e-12
# Part of a step to which the end of a branch is located.
_END = 1e-9
# Relative size of the last Newton step at solutions whose parameters are compared.
_EXACT = 1e-11
# Largest change of the number of unstable directions that one fold hides.
_HIDDEN_CHANGE = 2
# Slope of the parameter, in widths of the diagram, which rounding and errors of the mesh do not
# reach where multipliers are lost.
_STEEP = 1e-6
# Distance within which a fold belongs to a branch point, in the precision of either, and the kinds
# of such points.
_BESIDE, _FORKS = 30.0, ("branch point", "period halving")


def located_on(step: Step, strict: bool = True) -> tuple[Solution, list[BranchPoint]] | None:
    """The end of a step, and the special points before it, in order.

    The step ends on a bound of a parameter where it passes one; the last special point then lies
    there and has no kind. It also ends where a test function ends the branch; the last special
    point then has its name.

    Parameters
    ----------
    step : Step
        Between two regular points.
    strict : bool
        Refuse a step whose special points do not explain how the number of unstable directions
        changes, or that leads to another sheet of solutions: the orientation of the equations
        changes without a branch point. Otherwise a point 'unresolved' stands where the number
        changes.

    Returns
    -------
    (Solution, list of BranchPoint) or None
        None where the step is refused or leads nowhere, or a bound is passed that no solution on
        the step meets.
    """
    if not step.length > 0.0:
        return None
    ended = next((name for name in step.problem.ends if step.here.tests.get(name, -1.0) > 0.0
                  >= step.there.tests.get(name, 1.0)), None)
    if ended is not None:
        zero = step.zero(_test_value(ended), _END)
        if zero is None:
            return None
        step = replace(step, there=zero[0])
    found = _zeros(step, strict)
    met = _bound_met(step)
    if found is None or met is None:
        return None
    end, on_bound = met
    length, precision = step.along(end.u), step.problem.precision
    found = _without_turns(step, [point for point in found if step.along(point.u) <= length],
                           max(1e-4, _BESIDE * precision) * step.length)
    if step.options.locate:
        count = counted(step.problem, step.here, end, found, step.options.events)
        if count is None and _hidden_change(step, end, found):
            count = int(end.values["unstable"])
        if count is None and strict:
            return None
        if count is None:
            found.append(_jump_of_stability(replace(step, there=end)))
        else:
            turns = step.here.turns + sum(point.kind == "fold" for point in found)
            lost = step.problem.rounding.lost(end.values)
            end = replace(with_count(end, count), turns=turns if lost else 0)
            found += _change_behind(step, end, turns)
    found.sort(key=lambda point: step.along(point.u))
    if on_bound or ended is not None:
        found.append(BranchPoint(end.u, end.tangent, end.values, None if on_bound else ended))
    return end, found


def _zeros(step: Step, strict: bool) -> list[BranchPoint] | None:
    """Zeros of test functions, checked by the problem.

    None if the end is on another sheet, or lies where rounding hides a turn of the parameter.
    """
    problem, here, there = step.problem, step.here, step.there
    rounding = set(problem.rounding.kinds((here.tangent, there.tangent),
                                          (here.values, there.values), (here.tests, there.tests)))
    found = []
    for name in _changed(here, there):
        if name in rounding or name in problem.ends:
            continue
        if name == "fold" and not (turns := _parameter_turns(step)):
            if turns is None and strict:
                return None
            continue
        event = name in step.options.events
        zero = step.zero(_test_value(name), problem.event_precision if event else problem.precision,
                         remeshed=name in problem.confirms)
        if name == "branch point" and strict and _off_cubic(step, zero and zero[0]):
            return None
        if zero is None and name == "fold":
            zero = _turn(step)
        if zero is None:
            continue
        at, bracket = zero
        if name == "branch point":
            at = step.with_own_direction(at)
        details = {} if event else problem.examine(name, at.u, at.linearisation, at.tangent)
        if details is not None:
            kind = str(details.get("kind", name))
            rest = {key: value for key, value in details.items() if key != "kind"}
            if bracket > 0.0:
                rest |= {"located": False, "parameter_error": bracket * step.parameter_rate()}
            found.append(special_point(at.u, at.tangent, at.values, kind, rest))
    return found


def _parameter_turns(step: Step) -> bool | None:
    """Whether the parameter turns on a step on which its slope changes sign; None if unclear.

    Where that may be rounding, both ends are solved exactly. The change of the parameter on either
    side of the turn must then be s l / 2 to a factor of two, with the slope s at that end and the
    length l, and the larger slope must not be tiny. It is unclear where that holds on the longer
    side alone.
    """
    ends = step.here, step.there
    if not step.problem.rounding.turns((ends[0].tangent, ends[1].tangent),
                                       (ends[0].values, ends[1].values)):
        return True
    exact = replace(step, options=replace(step.options, tolerance=_EXACT))
    here, there = exact.solution(0.0), exact.solution(step.length)
    if here is None or there is None:
        return False
    first, last = (float(end.tangent[-1]) / float(step.row @ end.tangent) for end in (here, there))
    if first * last >= 0.0:
        return False
    at = step.length * first / (first - last)
    steep = max(abs(first), abs(last)) * np.sqrt(step.problem.weights()[-1]) > _STEEP
    turn = exact.solution(at) if steep else None
    if turn is None:
        return False
    expected = 0.5 * np.array([first * at, last * (step.length - at)])
    off = np.abs(np.diff([end.u[-1] for end in (here, turn, there)]) - expected)
    agrees = off <= 0.5 * np.abs(expected)
    if agrees.all():
        return True
    return None if agrees[np.argmax(np.abs(expected))] else False


def _turn(step: Step) -> tuple[Solution, float]:
    """The solution next to a corner at which the parameter turns, and the length around it.

    The slope of the parameter jumps there, so that it has no zero.
    """
    low, high, known = 0.0, step.length, [step.here, step.there]
    slope = step.here.tests["fold"]
    while high - low > _JUMP * step.length:
        reached = step.solution(0.5 * (low + high))
        if reached is None:
            break
        known.append(reached)
        if reached.tests["fold"] * slope > 0.0:
            low = 0.5 * (low + high)
        else:
            high = 0.5 * (low + high)
    return max(known, key=lambda at: float(np.sign(slope) * at.u[-1])), high - low


def _changed(here: Solution, there: Solution) -> list[str]:
    """Names of the test functions that change sign from one point to the next."""
    return [name for name, after in there.tests.items()
            if (before := here.tests.get(name, 0.0)) * after < 0.0
            or (after == 0.0 and before != 0.0)]


def _bound_met(step: Step) -> tuple[Solution, bool] | None:
    """The end of a step, and whether it lies on a bound; None if the bound is not met."""
    end, on_bound = step.there, False
    for sign, place, bound in ((sign, place, bound) for place, *bounds in step.options.box
                               for sign, bound in zip((-1.0, 1.0), bounds, strict=True)):
        before, after = (sign * (float(at.u[place]) - bound) for at in (step.here, end))
        if after < 0.0 or before > 0.0 or before == after:
            continue
        if before == 0.0:
            return None
        shorter = replace(step, there=end)
        met = shorter.meeting(place, bound)
        if met is None:
            zero = shorter.zero(_distance_to(place, bound), _BOUND)
            if zero is None:
                return None
            u = zero[0].u.copy()
            u[place] = bound
            met = replace(zero[0], u=u)
        end, on_bound = met, True
    return end, on_bound


def _change_behind(step: Step, end: Solution, turns: int) -> list[BranchPoint]:
    """A change of stability since it was last known, where it is known again; empty if none.

    At each of the ``turns``, the folds in between, the number of unstable directions may have
    changed by one.
    """
    problem, here = step.problem, step.here
    if not problem.rounding.lost(here.values) or problem.rounding.lost(end.values):
        return []
    before, after = (int(at.values["unstable"]) for at in (here, end))
    if abs(after - before) <= turns:
        return []
    error = abs(float(end.u[-1] - here.u[-1])) + step.length * step.parameter_rate()
    return [special_point(here.u, here.tangent, here.values, UNRESOLVED, {
        "unstable_before": before, "unstable_after": after, "parameter_error": error})]


def _hidden_change(step: Step, end: Solution, found: list[BranchPoint]) -> bool:
    """Return True if a fold at which multipliers are lost may hide a change of stability.

    Where a multiplier changes by many decades within rounding of the fold, it may pass -1 there
    besides 1: up to two more or fewer directions are then unstable after it.
    """
    change = int(end.values["unstable"]) - int(step.here.values["unstable"])
    return abs(change) <= _HIDDEN_CHANGE and any(
        point.kind == "fold" and step.problem.rounding.lost(point.values) for point in found)


def _jump_of_stability(step: Step) -> BranchPoint:
    """Change of the number of unstable directions, by bisection without any test function."""
    low, high = 0.0, step.length
    counts = [int(each.values["unstable"]) for each in (step.here, step.there)]
    at, precision = step.there, _JUMP * high
    while high - low > precision:
        middle = 0.5 * (low + high)
        reached = step.solution(middle)
        if reached is None:
            break
        count = int(reached.values["unstable"])
        if abs(count - counts[0]) < abs(count - counts[1]):
            low = middle
        else:
            high, at = middle, reached
    return special_point(at.u, at.tangent, at.values, UNRESOLVED, {
        "unstable_before": counts[0], "unstable_after": counts[1],
        "parameter_error": (high - low) * step.parameter_rate()})


def _off_cubic(step: Step, located: Solution | None) -> bool:
    """Whether both ends lie on different sheets: what was found between them is off the cubic."""
    if located is None:
        return True
    problem, here = step.problem, step.here
    off = norm(problem, located.u - step.cubic(step.along(located.u)))
    tangent = here.tangent / float(step.row @ here.tangent)
    bend = norm(problem, step.there.u - here.u - step.length * tangent)
    return off > _OFF_CUBIC * bend + _ROUNDING * (1.0 + norm(problem, here.u))


def _without_turns(step: Step, found: list[BranchPoint], near: float) -> list[BranchPoint]:
    """Without folds that lie on a branch point, where a bent branch turns but does not end."""
    forks = [point for point in found if point.kind in _FORKS]
    return [point for point in found if point.kind != "fold"
            or all(abs(step.along(point.u) - step.along(fork.u)) > near for fork in forks)]


def _test_value(name: str) -> Callable[[Solution], float]:
    return lambda at: at.tests[name]


def _distance_to(place: int, bound: float) -> Callable[[Solution], float]:
    return lambda at: float(at.u[place]) - bound
