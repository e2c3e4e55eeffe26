"""Orbits from event to event as points of branches: by one state on them, as by shooting."""

from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.events.orbit import EventOrbit
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.problem import STICK


def anchor(problem: EventOrbit, u: Array) -> tuple[int, float]:
    """Phase in which runs of an orbit start, and when in it [s].

    With an excitation at a multiple of the period, else in the middle of the longest phase, of
    those in which something slips or flies if there are any.
    """
    durations = problem.durations(u)
    if not problem.forced:
        moving = [any(status != STICK for status in phase.status) or not all(phase.closed)
                  for phase in problem.phases]
        i = int(np.argmax(durations * (1.0 + 1e6 * np.array(moving))))
        return i, 0.5 * float(durations[i])
    begins, T = problem.begins(u), problem.period(u)
    time = T * np.ceil(begins[0] / T)
    i = int(np.searchsorted(begins, time, side="right")) - 1
    if i >= problem.count:
        i, time = 0, begins[0]
    return i, float(time - begins[i])


def start_of_runs(problem: EventOrbit, u: Array) -> Array:
    """The state (d,) there."""
    i, after = anchor(problem, u)
    begin, start = float(problem.begins(u)[i]), problem.starts(u)[i]
    if after == 0.0:
        return start
    return problem.motion(u).run(begin, np.array([after]), start, problem.phases[i])[0][-1]


def reduced(problem: EventOrbit, point: BranchPoint) -> BranchPoint:
    """A point of a branch with unknowns and tangent as by shooting with one segment."""
    u, along, d, K = point.u, point.tangent, problem.dimension, problem.count
    i, after = anchor(problem, u)
    begin, start, phase = float(problem.begins(u)[i]), problem.starts(u)[i], problem.phases[i]
    states, moved = problem.motion(u).run(begin, np.array([after]), start, phase, True)
    rates = problem.motion(u).observed(np.array([begin + after]), states, phase)[1][0]
    taus = along[K * d : K * d + K]
    if problem.forced:
        begun = float(along[K * d + K] + taus[:i].sum())
        whole = np.ceil(problem.begins(u)[0] / problem.period(u))
        later = whole * taus.sum() - begun if after > 0.0 else 0.0
    else:
        begun, later = 0.0, 0.5 * taus[i]
    ahead = (moved[:, :d] @ along[i * d : (i + 1) * d] + moved[:, d] * begun
             + moved[:, d + 1] * along[-1] + rates * later)
    period = [] if problem.forced else [problem.period(u)]
    change = [] if problem.forced else [taus.sum()]
    return replace(point, u=np.concatenate([states[-1], period, u[-1:]]),
                   tangent=np.concatenate([ahead, change, along[-1:]]))
