r"""Compiled solution of the conditions of unilateral contact with friction, at one moment.

The same conditions hold for impulses and velocities and for forces and accelerations. With normal
impulses L of n nodes, tangential ones P of k clusters of nodes, which act against slip, and y the
normal velocities and the negative slip velocities after them,

.. math::

    y = A \begin{pmatrix} L \\ P \end{pmatrix} + b, \qquad
    0 \le L_j - l_j \perp y_j \ge 0, \qquad P_c \in \lambda_c\, \mathrm{Sgn}(-y_c)

where lambda_c is the sum of mu_j L_j over the nodes of a cluster. A coefficient that is larger in
stick than in slip makes two of it. A cluster may also slip in a known sense, or not touch.

Each case of pressed nodes and sticking clusters is a linear system. Projected Gauss-Seidel sweeps
find the right case in most problems. If they do not, or if the solution must be known to be unique,
all cases are tried.

References
----------
C. Glocker, Set-Valued Force Laws, Springer 2001. R. I. Leine, N. van de Wouw, Stability and
Convergence of Mechanical Systems with Unilateral Constraints, Springer 2008.
"""

# Compiled functions: their types are those of their signatures for numba.

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.types import Array, Integers
from fecontact.integrate.nonsmooth.problem import OPEN, STICK

# Largest number of cases that are tried.
MOST_CASES = 8192
_SWEEPS = 2000
# Residual of the conditions in a solution, and smallest difference between distinct solutions,
# relative to the largest terms.
_RESIDUAL, _APART = 1e-13, 1e-6
# Accelerations or velocities that are the same, relative to the terms of b.
_SAME = 1e-10


class Conditions(NamedTuple):
    """The conditions at n nodes in k clusters.

    Attributes
    ----------
    matrix, given : (n + k, n + k), (n + k,) arrays
        A and b.
    least : (n,) array
        l, the least normal impulses of touching nodes.
    sticking, slipping : (n,) arrays
        Coefficients of friction.
    cluster : (n,) array
        Cluster of each node.
    touching : (n,) array
        Whether a node can be pressed.
    mode : (k,) array
        STICK for a cluster that may stick or slip, its sense for one that slips, OPEN for none.
    size : float
        Size of the terms of b; an entry of y within their rounding is zero.
    """

    matrix: Array
    given: Array
    least: Array
    sticking: Array
    slipping: Array
    cluster: Integers
    touching: NDArray[np.bool_]
    mode: Integers
    size: float


class Case(NamedTuple):
    """Pressed nodes, mode of each cluster, and the impulses and velocities that follow.

    Attributes
    ----------
    pressed : (n,) array
        Whether y_j = 0.
    mode : (k,) array
        STICK, +1, -1 or OPEN.
    x, y : (n + k,) arrays
        Impulses [L, P], and [normal velocities, negative slip velocities] after them.
    """

    pressed: NDArray[np.bool_]
    mode: Integers
    x: Array
    y: Array


@helper
def new_case(n, k):
    """A case to be filled."""
    return Case(np.zeros(n, np.bool_), np.zeros(k, np.int64), np.zeros(n + k), np.zeros(n + k))


@helper
def _follow(c, case):
    """Fill ``case.y`` from ``case.x``; returns the size of its terms."""
    size = c.size
    for r in range(len(c.given)):
        total, terms = c.given[r], abs(c.given[r])
        for s in range(len(c.given)):
            term = c.matrix[r, s] * case.x[s]
            total += term
            terms += abs(term)
        case.y[r] = total
        size = max(size, terms)
    return size


@helper
def friction_limit(k, coefficient, c, x):
    """Sum of mu L over the nodes of cluster k."""
    total = 0.0
    for j in range(len(c.cluster)):
        if c.cluster[j] == k and c.touching[j]:
            total += coefficient[j] * x[j]
    return total


@routine
def _solve_case(c, case):
    """Fill x and y of a case from what its pressed nodes and sticking clusters demand."""
    n, k = len(c.cluster), len(c.mode)
    unknown, x, y = np.empty(n + k, np.int64), case.x, case.y
    count = 0
    x[:] = 0.0
    for j in range(n):
        if c.touching[j]:
            if case.pressed[j]:
                unknown[count] = j
                count += 1
            else:
                x[j] = c.least[j]
    for d in range(k):
        if case.mode[d] == STICK:
            unknown[count] = n + d
            count += 1
        elif case.mode[d] != OPEN:
            x[n + d] = case.mode[d] * friction_limit(d, c.slipping, c, x)
    _follow(c, case)
    system, right, pivots = np.empty((count, count)), np.empty(count), np.empty(count, np.int64)
    for a in range(count):
        right[a] = -y[unknown[a]]
        for b in range(count):
            column = unknown[b]
            system[a, b] = c.matrix[unknown[a], column]
            if column < n:
                d = c.cluster[column]
                if case.mode[d] != STICK and case.mode[d] != OPEN:
                    drag = case.mode[d] * c.slipping[column]
                    system[a, b] += drag * c.matrix[unknown[a], n + d]
    factorise(system, count, pivots)
    solve(system, pivots, right)
    for a in range(count):
        x[unknown[a]] = right[a]
    for d in range(k):
        if case.mode[d] != STICK and case.mode[d] != OPEN:
            x[n + d] = case.mode[d] * friction_limit(d, c.slipping, c, x)


@routine
def _holds(c, sticking, case):
    """Whether x and y of a case meet the conditions; fills y."""
    n = len(c.cluster)
    x, y = case.x, case.y
    size, largest = _follow(c, case), 0.0
    for r in range(len(x)):
        if not math.isfinite(x[r]):
            return False
        largest = max(largest, abs(x[r]))
    slack, rest = _RESIDUAL * largest, _RESIDUAL * size
    holds = True
    for j in range(n):
        if c.touching[j]:
            if case.pressed[j]:
                holds = holds and x[j] >= c.least[j] - slack and abs(y[j]) <= rest
            else:
                holds = holds and y[j] >= -rest
    for d in range(len(c.mode)):
        if c.mode[d] == STICK:
            if case.mode[d] == STICK:
                limit = friction_limit(d, sticking, c, x)
                holds = holds and abs(x[n + d]) <= limit + slack and abs(y[n + d]) <= rest
            elif case.mode[d] != OPEN:
                holds = holds and case.mode[d] * y[n + d] <= rest
    return holds


@routine
def _sweep(c, case):
    """Fill a case with what projected Gauss-Seidel sweeps end at, a guess."""
    n, k = len(c.cluster), len(c.mode)
    x, y = case.x, case.y
    x[:] = 0.0
    for j in range(n):
        if c.touching[j]:
            x[j] = c.least[j]
    _follow(c, case)
    for _ in range(_SWEEPS):
        moved, scale = 0.0, 0.0
        for r in range(n + k):
            if (not c.touching[r]) if r < n else c.mode[r - n] == OPEN:
                continue
            if r < n:
                impulse = max(c.least[r], x[r] - y[r] / c.matrix[r, r])
            elif c.mode[r - n] == STICK:
                limit = friction_limit(r - n, c.sticking, c, x)
                impulse = x[r] - y[r] / c.matrix[r, r]
                if abs(impulse) > limit:
                    limit = friction_limit(r - n, c.slipping, c, x)
                    impulse = limit if impulse > 0.0 else -limit
            else:
                impulse = c.mode[r - n] * friction_limit(r - n, c.slipping, c, x)
            change = impulse - x[r]
            x[r] = impulse
            for q in range(n + k):
                y[q] += c.matrix[q, r] * change
            moved, scale = max(moved, abs(change)), max(scale, abs(impulse))
        if moved <= 1e-15 * scale:
            break
    for j in range(n):
        case.pressed[j] = c.touching[j] and x[j] > c.least[j]
    for d in range(k):
        case.mode[d] = c.mode[d]
        if c.mode[d] == STICK:
            limit = friction_limit(d, c.sticking, c, x)
            if limit == 0.0:
                case.mode[d] = OPEN
            elif abs(x[n + d]) >= min(limit, friction_limit(d, c.slipping, c, x)) * (1.0 - 1e-12):
                case.mode[d] = 1 if x[n + d] > 0.0 else -1
            # A cluster without slip at less than the limit sticks.
            if limit > 0.0 and abs(x[n + d]) < limit * (1.0 - 1e-12) and y[n + d] == 0.0:
                case.mode[d] = STICK


@helper
def count_cases(c):
    """Number of cases; MOST_CASES + 1 if there are more."""
    cases = 1
    for j in range(len(c.cluster)):
        if c.touching[j] and cases <= MOST_CASES:
            cases *= 2
    for d in range(len(c.mode)):
        if c.mode[d] == STICK and cases <= MOST_CASES:
            cases *= 3
    return min(cases, MOST_CASES + 1)


@helper
def _set_case(index, c, case):
    """Set a case by its number: first all pressed and all sticking; whether it is to be tried."""
    n = len(c.cluster)
    tried = True
    for j in range(n):
        case.pressed[j] = False
        if c.touching[j]:
            case.pressed[j] = index % 2 == 0
            index //= 2
    for d in range(len(c.mode)):
        case.mode[d] = c.mode[d]
        if c.mode[d] != STICK:
            continue
        digit = index % 3
        index //= 3
        gripped = False
        for j in range(n):
            if c.cluster[j] == d and c.touching[j] and (case.pressed[j] or c.least[j] > 0.0):
                gripped = gripped or c.slipping[j] > 0.0 or c.sticking[j] > 0.0
        if gripped:
            case.mode[d] = STICK if digit == 0 else (1 if digit == 1 else -1)
        else:
            # Without force nothing sticks, and there is only one case.
            case.mode[d] = OPEN
            tried = tried and digit == 0
    return tried


@helper
def _copy(case, other):
    put(case.pressed, other.pressed)
    put(case.mode, other.mode)
    put(case.x, other.x)
    put(case.y, other.y)


@routine
def _try_all(c, sticking, first_only, trial, case):
    """Number of solutions that differ, up to two; the first is put into ``case``.

    Solutions whose velocities or accelerations agree within rounding do not differ.
    """
    found = 0
    for index in range(count_cases(c)):
        if not _set_case(index, c, trial):
            continue
        _solve_case(c, trial)
        if not _holds(c, sticking, trial):
            continue
        if found == 0:
            _copy(trial, case)
            found = 1
            if first_only:
                break
        else:
            apart, scale = 0.0, 0.0
            for r in range(len(trial.x)):
                apart = max(apart, c.matrix[r, r] * abs(trial.x[r] - case.x[r]))
                scale = max(scale, c.matrix[r, r] * max(abs(trial.x[r]), abs(case.x[r])))
            if apart > max(_APART * scale, _SAME * c.size):
                found = 2
                break
    return found


@routine
def solve_conditions(c, case):
    """Fill a case with a solution of the conditions; whether one was found."""
    trial = new_case(len(c.cluster), len(c.mode))
    _sweep(c, trial)
    _solve_case(c, trial)
    if _holds(c, c.sticking, trial):
        _copy(trial, case)
        return True
    return count_cases(c) <= MOST_CASES and _try_all(c, c.sticking, True, trial, case) == 1


@routine
def solve_uniquely(c, case):
    """Fill a case as :func:`solve_conditions`, preferring stick, if it is the only solution.

    Uniqueness is tested with the coefficients of slip; a larger coefficient of stick makes no
    difference to it. With more than MOST_CASES cases the first solution that is found is taken.
    """
    if count_cases(c) > MOST_CASES:
        return solve_conditions(c, case)
    trial, other = new_case(len(c.cluster), len(c.mode)), new_case(len(c.cluster), len(c.mode))
    if _try_all(c, c.slipping, False, trial, other) > 1:
        return False
    return _try_all(c, c.sticking, True, trial, case) == 1
