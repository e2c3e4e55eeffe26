"""Sampled periodic motions, from runs and from orbits of branches."""

from dataclasses import dataclass

import numpy as np

from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.simulate import simulate
from fecontact.system.contact_system import ContactSystem

# Relative tolerance of the runs that sample an orbit by shooting.
_RTOL = 1e-7


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """A periodic motion over at least one period: a start for branches of orbits.

    Parameters
    ----------
    times, states : (k,) and (k, d) sequences
        Times [s] and states, y = [q, q', z] for contact systems. The last period is used.
    period : float, optional
        Period of the motion [s]. By default ``periods`` periods of the excitation, or for systems
        without excitation the time since the motion last passed its end point.
    periods : int
        Number of excitation periods in one period of the motion; 1 without excitation.
    parameter_values : (k,) sequence, optional
        Parameter values of the field for this motion; by default its base values.

    Raises
    ------
    InputError
        If values are not numbers, or the period is not positive.
    """

    times: Array
    states: Array
    period: float | None = None
    periods: int = 1
    parameter_values: Array | None = None

    def __post_init__(self) -> None:
        for name in ("times", "states", "parameter_values"):
            given: ArrayLike | None = getattr(self, name)
            if given is not None or name != "parameter_values":
                object.__setattr__(self, name, as_floats(given, name))
        if self.states.ndim != 2 or self.states.size == 0:
            raise InputError(f"states must be those of a motion (k, d), not of shape "
                             f"{self.states.shape}.")
        if self.period is not None:
            require_positive("PeriodicMotion", period=self.period)
        if not (isinstance(self.periods, int | np.integer) and self.periods >= 1):
            raise InputError(f"PeriodicMotion: periods = {self.periods!r} must be a whole number "
                             f"from 1 on.")

    @property
    def amplitudes(self) -> Array:
        """Half the range (d,) of each state, at least 1e-3 of the largest."""
        found = np.ptp(self.states, axis=0) / 2.0
        return np.asarray(np.maximum(found, 1e-3 * found.max()))


def nodes_on_mesh(u: Array, mesh: Array, states: int) -> tuple[Array, int]:
    """Nodes (N m, d) and degree m of an orbit by collocation on N intervals.

    Raises
    ------
    InputError
        If the orbit was computed by shooting.
    """
    # After the nodes come the period (autonomous systems only) and the parameter.
    intervals = len(mesh) - 1
    degree = (len(u) - 1) // (intervals * states)
    if degree < 2:
        raise InputError("The orbit was found by shooting, which keeps the states at the ends of "
                         "its segments only; run it from there with point.orbit(field).")
    return np.ascontiguousarray(u[: intervals * degree * states].reshape(-1, states)), degree


def collocated(u: Array, mesh: Array, states: int, period: float, samples: int) -> PeriodicMotion:
    """Sample an orbit by collocation over one period, both ends included."""
    nodes, _ = nodes_on_mesh(u, mesh, states)
    phases = np.linspace(0.0, 1.0, samples)
    return PeriodicMotion(phases * period, interpolate(mesh, nodes, phases), period)


def run_again(
    system: ContactSystem, u: Array, mesh: Array, period: float, samples: int
) -> PeriodicMotion:
    """Sample an orbit by shooting over one period by running each segment from its start.

    Gives at least the requested number of samples, both ends included.
    """
    count = len(mesh) - 1
    starts, ends = u[: count * system.size].reshape(count, -1), mesh * period
    each = max(2, -(-samples // count))
    runs = [simulate(system, float(end), t_start=float(begin), initial=start, outputs=each,
                     rtol=_RTOL)
            for start, begin, end in zip(starts, ends[:-1], ends[1:], strict=True)]
    return PeriodicMotion(np.concatenate([run.time for run in runs]),
                          np.concatenate([run.states for run in runs]), period)
