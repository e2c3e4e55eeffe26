"""Balance of the unstable directions along a branch.

The number of unstable eigenvalues or multipliers changes at special points alone: by one at a fold,
by two at a Hopf point. A step whose special points do not explain the change has missed some.
"""

from collections.abc import Container, Iterable
from dataclasses import replace

from fecontact.bifurcation.continuation.newton import Solution
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import Problem

_CHANGES_AT = {"fold": (-1, 1), "branch point": (-1, 0, 1), "period doubling": (-1, 1),
               "Hopf": (-2, 2), "Neimark-Sacker": (-2, 2)}
# Of kinds that a problem of the user defines.
_CHANGES_AT_OTHERS = (-2, -1, 0, 1, 2)


def counted(
    problem: Problem, here: Solution, there: Solution, special: Iterable[BranchPoint],
    events: Container[str],
) -> int | None:
    """Number of unstable directions at the second of two points; None if it is unexplained.

    It is the number at the first point plus the changes that the special points in between allow.
    Eigenvalues within rounding of the stability border may lie on either side of it; the admissible
    number nearest to the computed one is taken. Where the stability is unknown the number stays;
    after such a point it is the computed one.
    """
    if "unstable" not in here.values:
        return 0
    for side, known in ((there, here), (here, there)):
        if problem.rounding.lost(side.values):
            return int(known.values["unstable"])
    reached = {int(here.values["unstable"])}
    for point in special:
        if point.kind not in events:
            changes = _CHANGES_AT.get(str(point.kind), _CHANGES_AT_OTHERS)
            reached = {number + change for number in reached for change in changes}
    found = int(there.values["unstable"])
    least, most = problem.rounding.unstable(there.linearisation, there.values)
    fitting = [number for number in reached if least <= number <= most]
    return min(fitting, key=lambda number: abs(number - found)) if fitting else None


def with_count(at: Solution, count: int) -> Solution:
    """A solution with this number of unstable directions."""
    if "unstable" not in at.values or at.values["unstable"] == count:
        return at
    stable = {"stable": count == 0} if "stable" in at.values else {}
    return replace(at, values={**at.values, "unstable": count, **stable})
