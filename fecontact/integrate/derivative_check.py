"""Check of derivatives of a run: one direction of them against differences of runs.

The direction moves every entry of the state, and the parameter, by as much as makes all of them
change the end of the run alike, so that no derivative hides behind another one.
"""

from collections.abc import Callable

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.ensemble import ensemble
from fecontact.integrate.reference.scipy import largest_motions
from fecontact.integrate.solvers import Solver
from fecontact.integrate.trajectory import Status
from fecontact.system.contact_system import ContactSystem

SystemAt = tuple[Callable[[float], ContactSystem], float]

# Changes of the end of a run for differences, in parts of the scales of the state.
_STEPS = (1e-5, 1e-4, 1e-6, 1e-3)
# Derivatives may differ so much from differences of runs, in parts of the largest, and by so many
# errors of runs; runs for differences are so much more accurate.
_APART, _ERRORS, _FINER, _FINEST = 0.02, 10.0, 1e-2, 1e-12


def doubts(
    system: ContactSystem, times: Array, states: Array, transitions: Array, forced: Array | None,
    at: SystemAt | None, solver: Solver, rtol: float, max_step: float | None,
) -> str:
    """Sentence on the spans between output times whose derivatives disagree with differences.

    Empty if all agree, within two percent of the largest derivative. ``at`` is the system as a
    function of the parameter of ``forced``, and the value.
    """
    scales, spans = _scales(system, states), np.stack([times[:-1], times[1:]], axis=1)
    rng, finer = np.random.default_rng(0), max(_FINER * rtol, _FINEST)
    # A system without room to move the parameter is checked by its state alone.
    value = None if at is None or not _moves(at) else at[1]
    left, apart = list(range(len(spans))), np.zeros(len(spans))
    size = len(scales)
    directions = np.zeros((len(spans), size + 1))
    for k in left:
        columns = np.column_stack([transitions[k], np.zeros(size) if forced is None or value is None
                                   else forced[k]]) / scales[:, None]
        most = np.append(scales, 0.0 if value is None else abs(value) or 1.0)
        grown = np.abs(columns).max(axis=0)
        directions[k] = rng.choice([-1.0, 1.0], size + 1) * np.minimum(
            1.0 / np.maximum(grown, 1e-300), most)
    apart[:] = np.inf
    for step in _STEPS:
        if not left:
            break
        moves = step * directions[left]
        systems, starts = [], []
        for sign in (1.0, -1.0):
            for k, move in zip(left, moves, strict=True):
                systems.append(system if at is None or value is None else
                               at[0](value + sign * float(move[-1])))
                starts.append(states[k] + sign * move[:-1])
        found = ensemble(systems, np.tile(spans[left], (2, 1)), initial=np.array(starts),
                         solver=solver, rtol=finer, max_step=max_step)
        ended = np.array([one is Status.FINISHED for one in found.status]).reshape(2, -1).all(
            axis=0)
        ends = found.states[:, -1].reshape(2, len(left), size)
        for place, k in enumerate(list(left)):
            if not ended[place]:
                continue
            columns = np.column_stack([transitions[k], np.zeros(size) if forced is None
                                       else forced[k]]) * directions[k] / scales[:, None]
            difference = (ends[0, place] - ends[1, place]) / (2.0 * step * scales)
            largest = max(float(np.abs(columns).sum(axis=1).max()), 1e-300)
            off = float(np.abs(difference - columns.sum(axis=1)).max()) / largest
            # Errors of runs grow with the motion, and are divided by the step.
            growth = float(np.abs(transitions[k] * scales / scales[:, None]).max())
            apart[k] = min(apart[k], off)
            if off <= _APART + _ERRORS * finer * max(growth, 1.0) / (step * largest):
                left.remove(k)
    if not left:
        return ""
    where = ", ".join(f"{times[k]:.6g} to {times[k + 1]:.6g} s ({100.0 * apart[k]:.2g} %)"
                      for k in left)
    return (f"Derivatives differ from differences of runs from t = {where}: a node touches down, "
            f"lifts off or begins to slide just when it begins not to, or the motion is too "
            f"unstable; begin or end elsewhere, or lower rtol = {rtol:g}.")


def _scales(system: ContactSystem, states: Array) -> Array:
    """Scales (size,) of the entries of the states of a run."""
    m, largest = system.basis.modes, largest_motions(system)
    least = np.concatenate([system.penetration_scale / largest, system.velocity_scale / largest,
                            system.memory_scales])
    scales = np.maximum(least, np.abs(states).max(axis=0))
    scales[2 * m :] = least[2 * m :]
    return np.asarray(scales)


def _moves(at: SystemAt) -> bool:
    """True if the parameter can be moved both ways."""
    system_at, value = at
    step = _STEPS[0] * (abs(value) or 1.0)
    try:
        system_at(value + step), system_at(value - step)
    except InputError:
        return False
    return True
