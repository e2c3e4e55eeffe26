"""Runs of what moves, a contact system or a vector field."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from fecontact.core.types import Array
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.field_runs.field_run import FieldRun, field_state
from fecontact.integrate.initial_state import initial_state
from fecontact.integrate.rodas5p.driver import start
from fecontact.integrate.rodas5p.run import Run
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving

if TYPE_CHECKING:
    from fecontact.integrate.field_runs.stepper import FieldSteps


def start_state(moving: Moving, initial: Any, time: float) -> Array:
    """State (size,) for the start of a run; see ``initial`` of :func:`fecontact.simulate`."""
    if isinstance(moving, ContactSystem):
        if isinstance(initial, FieldRun):
            initial = initial.states[-1]
        return initial_state(moving, initial, time)
    return field_state(moving, initial)


def start_any(
    moving: Moving, state: Array, times: Array, *, rtol: float, max_step: float | None = None,
    vary: bool = False, events: Sequence[AnyEvent] = (), method: str = "rodas5p",
) -> "Run | FieldSteps":
    """A run before its first step, without powers, of a contact system or of a field."""
    if isinstance(moving, ContactSystem):
        return start(moving, state, times, rtol=rtol, max_step=max_step, work=False, vary=vary,
                     events=events, method=method)
    # Not before it is used: its kernels need not be there for contact systems.
    from fecontact.integrate.field_runs.stepper import start_field

    return start_field(moving, state, times, rtol=rtol, max_step=max_step, vary=vary, events=events)
