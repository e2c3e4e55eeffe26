"""Runs of vector fields: their results, and the run itself."""

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, choices, nearest, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.integrate.event_table import Events
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.step_runs import complete, until_end
from fecontact.integrate.trajectory import Status, output_part
from fecontact.system.fields.vector_field import VectorField


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class FieldRun(Summarised):
    """Motion of a vector field at N output times.

    Attributes
    ----------
    parameters : mapping
        Name and value of each parameter.
    state_names : tuple of str
        Names (d,) of the states.
    time : (N,) array
        [s].
    states : (N, d) array
    status : Status
        How the run ended.
    statistics : mapping
        Counts of the integrator, its name and tolerance, seconds.
    events : Events or None
        Located events in chronological order; None if none were requested.
    """

    parameters: Mapping[str, float]
    state_names: tuple[str, ...]
    time: Array
    states: Array
    status: Status = Status.FINISHED
    statistics: dict[str, Any] = field(default_factory=dict)
    events: Events | None = None

    def __getstate__(self) -> dict[str, Any]:
        # Views of mappings cannot be pickled.
        return vars(self) | {"parameters": dict(self.parameters)}

    def summary(self) -> list[tuple[str, str]]:
        """Status, time span, states and parameters."""
        return [
            ("status", self.status.name.lower().replace("_", " ")),
            ("time", f"{self.time[0]:.5g} ... {self.time[-1]:.5g}"),
            ("outputs", f"{len(self.time)}"),
            ("states", ", ".join(self.state_names)),
            ("parameters", ", ".join(f"{name} = {value:.6g}"
                                     for name, value in self.parameters.items()) or "none"),
            *([] if self.events is None else [("events", f"{len(self.events.time)}")]),
        ]

    def state(self, name: str) -> Array:
        """History (N,) of a state; InputError if there is none of this name."""
        if name not in self.state_names:
            raise InputError(f"The run has no state {name!r}{nearest(str(name), self.state_names)};"
                             f" its states are: {choices(self.state_names)}.")
        return self.states[:, self.state_names.index(name)]

    def between(self, t_start: float | None = None, t_end: float | None = None) -> "FieldRun":
        """Part of the run with the output times from ``t_start`` to ``t_end``, both included.

        Events are those from the first to the last of these times.

        Raises
        ------
        InputError
            If there are fewer than two output times between them.
        """
        chosen = output_part(self.time, t_start, t_end)
        time = self.time[chosen]
        events = None if self.events is None else self.events.between(time[0], time[-1])
        return replace(self, time=time, states=self.states[chosen], events=events)


def field_state(moving: VectorField, initial: Any) -> Array:
    """State (d,) for the start of a run of a field.

    Raises
    ------
    InputError
        For anything but a :class:`FieldRun`, which goes on from its end, and d finite numbers.
    """
    names = ", ".join(moving.state_names[:8])
    if isinstance(initial, str):
        raise InputError(f"initial = {initial!r}: a vector field has no place at rest; give its "
                         f"{moving.dimension} states at the start, {names}.")
    state = as_floats(initial.states[-1] if isinstance(initial, FieldRun) else initial, "initial")
    if state.shape != (moving.dimension,) or not np.isfinite(state).all():
        raise InputError(f"initial = {shown(initial)} must be {moving.dimension} finite numbers, "
                         f"{names}, or a run of the field.")
    return np.array(state)


def run_field(
    moving: VectorField, state: Array, times: Array, *, rtol: float, max_step: float | None,
    events: Sequence[AnyEvent], progress: Callable[[float], None] | None,
) -> FieldRun:
    """Integrate a field at its base values; see :func:`fecontact.simulate`."""
    # Not before it is used: its kernels need not be there for contact systems.
    from fecontact.integrate.field_runs.stepper import start_field

    begin = clock.perf_counter()
    run = start_field(moving, state, times, rtol=rtol, max_step=max_step, events=events)
    ended = complete(run, progress)
    reached, states = until_end(run, (run.states, run.progress.state))
    statistics = {"solver": "rodas5p", "rtol": rtol, "method": "rodas5p", **run.statistics,
                  "seconds": clock.perf_counter() - begin}
    return FieldRun(MappingProxyType(dict(moving.parameters)), moving.state_names, reached, states,
                    ended, statistics, run.events if events else None)
