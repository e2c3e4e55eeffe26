"""Check of derivatives of a run: one direction of them against differences of runs.

The direction moves every entry of the state, and the parameter, by as much as makes all of them
change the end of the run alike, so that no derivative hides behind another one.
"""

from collections.abc import Callable

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.ensembles import ensemble
from fecontact.integrate.run_limits import largest_motions
from fecontact.integrate.solvers import Solver
from fecontact.system.contact_system import ContactSystem

SystemAt = tuple[Callable[[float], ContactSystem], float]

# Changes of the end of a run for differences, in parts of the scales of the state.
_STEPS = (1e-5, 1e-4, 1e-6, 1e-3)
# Derivatives may differ so much from differences of runs, in parts of the largest, and by so many
# errors of runs; runs for differences are so much more accurate.
_APART, _ERRORS, _FINER, _FINEST = 0.02, 10.0, 1e-2, 1e-12


def doubts(
    system: ContactSystem, times: Array, states: Array, transitions: Array, forced: Array | None,
    at: SystemAt | None, *, solver: Solver, rtol: float, max_step: float | None,
) -> str:
    """Sentence on the spans between output times whose derivatives disagree with differences.

    Empty if all agree, within two percent of the largest derivative; spans beside which no run
    reaches its end are not judged. ``at`` is the system as a function of the parameter of
    ``forced``, and the value.
    """
    scales, spans = _scales(system, states), np.stack([times[:-1], times[1:]], axis=1)
    finer, size = max(_FINER * rtol, _FINEST), len(scales)
    value = None
    columns, most = transitions / scales[:, None], scales
    # A parameter that cannot be moved both ways is left out.
    if at is not None and forced is not None and at[1] not in perturbed_systems(
            *at, _STEPS[0] * (abs(at[1]) or 1.0))[2:]:
        value = at[1]
        columns = np.concatenate([columns, (forced / scales)[:, :, None]], axis=2)
        most = np.append(scales, abs(value) or 1.0)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], columns.shape[2])
    directions = signs * np.minimum(1.0 / np.maximum(np.abs(columns).max(axis=1), 1e-300), most)
    left, apart = np.arange(len(spans)), np.full(len(spans), np.inf)
    for step in _STEPS:
        moves = step * np.concatenate([directions[left], -directions[left]])
        systems = [system if at is None or value is None else at[0](value + float(move[-1]))
                   for move in moves]
        found = ensemble(systems, np.tile(spans[left], (2, 1)),
                         initial=np.tile(states[left], (2, 1)) + moves[:, :size], solver=solver,
                         rtol=finer, max_step=max_step)
        ends = found.states[:, -1].reshape(2, -1, size)
        quotients = (ends[0] - ends[1]) / (2.0 * step * scales)
        parts = columns[left] * directions[left, None]
        largest = np.maximum(np.abs(parts).sum(axis=2).max(axis=1), 1e-300)
        off = np.abs(quotients - parts.sum(axis=2)).max(axis=1) / largest
        # Errors of runs grow with the motion, and are divided by the step. NaN of runs that failed
        # agrees with nothing.
        growth = np.abs(columns[left][:, :, :size] * scales).max(axis=(1, 2))
        agrees = off <= _APART + _ERRORS * finer * np.maximum(growth, 1.0) / (step * largest)
        apart[left] = np.fmin(apart[left], off)
        left = left[~agrees]
        if not len(left):
            return ""
    left = left[np.isfinite(apart[left])]
    if not len(left):
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


def perturbed_systems(
    system_at: Callable[[float], ContactSystem], value: float, move: float,
) -> tuple[ContactSystem, ContactSystem, float, float]:
    """The systems above and below a value of the parameter, and their values below and above."""
    try:
        return system_at(value + move), system_at(value - move), value - move, value + move
    except InputError:
        # At a limit of the range, or an unknown parameter.
        try:
            return system_at(value + move), system_at(value), value, value + move
        except InputError:
            return system_at(value), system_at(value - move), value - move, value
