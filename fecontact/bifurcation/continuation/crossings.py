"""How many unstable directions a branch may have behind its special points.

Along a branch the number of unstable directions, eigenvalues or multipliers, changes at special
points alone: by one at a fold, by two at a Hopf point. A step whose special points do not explain
the change has passed over some.
"""

from collections.abc import Container, Iterable
from dataclasses import replace

from fecontact.bifurcation.continuation.newton import Solution
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import Problem

# Kind of a point at which the number changes though no test function has a zero.
UNRESOLVED = "unresolved"

_CHANGES = {"fold": (-1, 1), "branch point": (-1, 0, 1), "period doubling": (-1, 1),
            "Hopf": (-2, 2), "Neimark-Sacker": (-2, 2)}
# For the test functions of problems that are not known here.
_ANY = (-2, -1, 0, 1, 2)


def counted(
    problem: Problem, here: Solution, there: Solution, special: Iterable[BranchPoint],
    events: Container[str],
) -> int | None:
    """Number of unstable directions at the second of two points; None where it is unexplained.

    It is that of the first one, changed as the special points between the two may change it. Where
    eigenvalues are too close to the border for their side to be known, of the numbers that agree
    with them the one counts that is nearest to what was found.
    """
    if "unstable" not in here.values:
        return 0
    reached = {int(here.values["unstable"])}
    for point in special:
        if point.kind not in events:
            changes = _CHANGES.get(str(point.kind), _ANY)
            reached = {number + change for number in reached for change in changes}
    found = int(there.values["unstable"])
    least, most = problem.unstable_range(there.linearisation, there.values)
    fitting = [number for number in reached if least <= number <= most]
    return min(fitting, key=lambda number: abs(number - found)) if fitting else None


def with_count(at: Solution, count: int) -> Solution:
    """A solution with this number of unstable directions."""
    if "unstable" not in at.values or at.values["unstable"] == count:
        return at
    stable = {"stable": count == 0} if "stable" in at.values else {}
    return replace(at, values={**at.values, "unstable": count, **stable})
