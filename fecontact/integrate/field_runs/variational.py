r"""Derivatives of a motion to its start, carried along with the steps of a run.

.. math::

    \dot{Y} = J(t, x(t)) Y, \qquad Y(0) = I

over each step by the three-stage Radau IIA method of order five along the interpolant of the step.
It is linear, so that its stages are one system of 3 d equations.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.5.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put_rows
from fecontact.core.dense_lu import factorise, solve_rows
from fecontact.core.records import Block, Size
from fecontact.core.types import Array, Integers
from fecontact.integrate.collocation.tableau import integrals, radau_points
from fecontact.integrate.rodas5p import tableau
from fecontact.system.fields.one_place import derive_at

_STAGES = 3
_NODES = radau_points(_STAGES)
_WEIGHTS = integrals(_NODES)
# Change of differences over a part of a step, at most, and the most parts.
_LARGEST, _MOST_PARTS = 0.5, 64.0

STATES = Size("states")


class Varied(NamedTuple):
    """Derivatives that go with a run of d states, or nothing where they are empty.

    Attributes
    ----------
    columns
        Y since the last output time.
    transitions : (N, d, d) array
        Y from each output time to the next; the first is not used.
    J, slopes
        Jacobians at the stages, and J Y.
    factors, increments, pivots
        The system of the stages, and its solution.
    x, f
        A state of the step, and its rates.
    """

    columns: Annotated[Array, STATES, STATES]
    transitions: Block
    J: Annotated[Array, _STAGES, STATES, STATES]
    slopes: Annotated[Array, _STAGES, STATES, STATES]
    factors: Annotated[Array, _STAGES * STATES, _STAGES * STATES]
    increments: Annotated[Array, _STAGES * STATES, STATES]
    pivots: Annotated[Integers, _STAGES * STATES]
    x: Annotated[Array, STATES]
    f: Annotated[Array, STATES]


@helper
def steepest(J, sizes):
    """Bound of the growth rates of differences by a Jacobian, whatever the units of the states."""
    largest = 0.0
    for i in range(len(sizes)):
        total = 0.0
        for k in range(len(sizes)):
            total += abs(J[i, k]) * sizes[k]
        largest = max(largest, total / sizes[i])
    return largest


@helper
def _solve(h, varied):
    """Carry the columns over a step h with the Jacobians at its stages."""
    d, J, slopes, factors = len(varied.columns), varied.J, varied.slopes, varied.factors
    for stage in range(_STAGES):
        for i in range(d):
            for c in range(d):
                total = 0.0
                for k in range(d):
                    total += J[stage, i, k] * varied.columns[k, c]
                slopes[stage, i, c] = total
    for row in range(_STAGES):
        for i in range(d):
            for column in range(_STAGES):
                factor = h * _WEIGHTS[row, column]
                for k in range(d):
                    factors[row * d + i, column * d + k] = -factor * J[column, i, k]
            factors[row * d + i, row * d + i] += 1.0
            for c in range(d):
                varied.increments[row * d + i, c] = h * (
                    _WEIGHTS[row, 0] * slopes[0, i, c] + _WEIGHTS[row, 1] * slopes[1, i, c]
                    + _WEIGHTS[row, 2] * slopes[2, i, c])
    factorise(factors, _STAGES * d, varied.pivots)
    solve_rows(factors, varied.pivots, varied.increments)
    last = (_STAGES - 1) * d
    for i in range(d):
        for c in range(d):
            varied.columns[i, c] += varied.increments[last + i, c]


@routine
def propagate(step, field, progress, workspace, varied):
    """Carry the columns over an accepted step, whose last Jacobian is ``workspace.J_after``.

    A step over which differences may change much is divided: what shrinks has to be as accurate as
    what grows.
    """
    steep = max(steepest(progress.J, progress.sizes), steepest(workspace.J_after, progress.sizes))
    parts = int(min(max(np.ceil(step.h * steep / _LARGEST), 1.0), _MOST_PARTS))
    for part in range(parts):
        for stage in range(_STAGES):
            J = varied.J[stage]
            if part == parts - 1 and stage == _STAGES - 1:
                put_rows(workspace.J_after, J)
            else:
                at = (part + _NODES[stage]) / parts
                tableau.interpolated(at, progress.state, workspace.after, workspace.dense, varied.x)
                derive_at(field.derive)(step.t + at * step.h, varied.x, field, varied.f, J)
        _solve(step.h / parts, varied)
