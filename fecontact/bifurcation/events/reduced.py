"""Orbits from event to event as points of branches: by one state on them, as by shooting."""

from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.events.orbit import EventOrbit, anchor


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
