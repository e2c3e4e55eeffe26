r"""Ground of varying speed in the stages of a step.

A stage holds velocities to a low power of the step only. With the ground as it is at the time of a
stage, the slip under it would be as wrong; friction in stick, steep in the slip, would drive the
motion with that. So the travel X and the speed V of the ground go along as states of the method,

.. math:: X' = V, \qquad V' = a(t)

and slip is as accurate as if the motion were counted from the ground. The accelerations a are those
of the polynomial through the speeds at some times of the step. Values and increments U_i of both
states are therefore fixed sums of these speeds.
"""

import numpy as np
from numpy.polynomial import Polynomial

from fecontact.core.compiled import helper
from fecontact.core.types import Array
from fecontact.integrate.rodas5p import tableau
from fecontact.system.nodes import GroundMotion, ground_motion

# Times at which the speed is taken, as parts of the step: places of Chebyshev's, both ends among
# them.
_TIMES = 0.5 - 0.5 * np.cos(np.pi * np.arange(6) / 5.0)
# Entries of a row of what is known of a stage: travel and speed of both motions, and increments.
TRAVEL, SPEED, SECOND_TRAVEL, SECOND_SPEED, INCREMENTS = range(5)
WIDTH = 2 * INCREMENTS


def _sums() -> tuple[Array, Array, Array, Array]:
    """Weights (STAGES, times) of the speeds.

    For speeds and their increments, and for travels and their increments, in units of the step.
    """
    stages, times = tableau.STAGES, len(_TIMES)
    accelerations, change = np.empty((stages, times)), np.empty(times)
    for k in range(times):
        others = np.delete(_TIMES, k)
        basis = Polynomial.fromroots(others) / np.prod(_TIMES[k] - others)
        accelerations[:, k] = basis.deriv()(tableau.NODES)
        change[k] = basis.deriv(2)(0.0)
    speeds, rises, travels, moves = np.zeros((4, stages, times))
    for i in range(stages):
        earlier = slice(0, i)
        speeds[i] = tableau.A[i, earlier] @ rises[earlier]
        speeds[i, 0] += 1.0
        rises[i] = tableau.GAMMA * (accelerations[i] + tableau.C[i, earlier] @ rises[earlier]
                                    + tableau.TIME[i] * change)
        travels[i] = tableau.A[i, earlier] @ moves[earlier]
        moves[i] = tableau.GAMMA * (speeds[i] + rises[i] + tableau.C[i, earlier] @ moves[earlier])
    return speeds, rises, travels, moves


_SPEEDS, _RISES, _TRAVELS, _MOVES = _sums()


@helper
def set_ground(step, moved, s, out):
    """Fill ``out`` (STAGES, WIDTH) for a step; ``moved`` is the motion just after its begin."""
    for i in range(tableau.STAGES):
        for entry in range(WIDTH):
            out[i, entry] = 0.0
        out[i, TRAVEL], out[i, SECOND_TRAVEL] = moved.travel, moved.second_travel
    for k in range(len(_TIMES)):
        now = moved
        if k > 0:
            now = ground_motion(min(step.t + _TIMES[k] * step.h, step.latest), s)
        for i in range(tableau.STAGES):
            travel, move = step.h * _TRAVELS[i, k], step.h * _MOVES[i, k]
            out[i, TRAVEL] += travel * now.speed
            out[i, SPEED] += _SPEEDS[i, k] * now.speed
            out[i, SECOND_TRAVEL] += travel * now.second_speed
            out[i, SECOND_SPEED] += _SPEEDS[i, k] * now.second_speed
            out[i, INCREMENTS + TRAVEL] += move * now.speed
            out[i, INCREMENTS + SPEED] += _RISES[i, k] * now.speed
            out[i, INCREMENTS + SECOND_TRAVEL] += move * now.second_speed
            out[i, INCREMENTS + SECOND_SPEED] += _RISES[i, k] * now.second_speed


@helper
def ground_in(i, ground):
    """Motion of the ground in stage i."""
    return GroundMotion(ground[i, TRAVEL], ground[i, SPEED], ground[i, SECOND_TRAVEL],
                        ground[i, SECOND_SPEED])


@helper
def increments_in(i, ground):
    """Increments of the motion of the ground in stage i."""
    return GroundMotion(
        ground[i, INCREMENTS + TRAVEL], ground[i, INCREMENTS + SPEED],
        ground[i, INCREMENTS + SECOND_TRAVEL], ground[i, INCREMENTS + SECOND_SPEED])
