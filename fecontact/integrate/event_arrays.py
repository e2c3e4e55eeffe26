"""Events of a run as arrays for the compiled integrator."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array
from fecontact.integrate.event_table import CONTACT_EVENTS
from fecontact.integrate.events import (
    AnyEvent,
    ContactEvents,
    Crossing,
    WatchedEvents,
    direction_sign,
)
from fecontact.integrate.rodas5p.event_kernels import (
    FIRST_OWN,
    FOUND,
    KINKS,
    NODES,
    PLACES,
    Watch,
    note_events,
)
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import state_size
from fecontact.system.fields.vector_field import VectorField

# Slip velocities at which the friction of laws with memory in steady sliding is tabulated.
_CURVE = np.logspace(-9.0, 2.0, 441)


def watch_for(
    system: ContactSystem | VectorField, events: Sequence[AnyEvent], kinks: bool
) -> Watch:
    """Arrays of the events to watch for, none found yet.

    Raises
    ------
    InputError
        For what is no event, and for contact events of a field, which has no contact nodes.
    """
    n, states = 0, state_size(system)
    if isinstance(system, ContactSystem):
        n = system.basis.contact_nodes
    for one in events:
        if isinstance(one, ContactEvents) and not isinstance(system, ContactSystem):
            raise InputError("events: a vector field has no contact nodes; watch for a Crossing "
                             "of one of its states, or for an Event.")
        if not isinstance(one, AnyEvent):
            raise InputError(f"events: {shown(one)} must be a ContactEvents, Crossing or Event.")
    own = [one for one in events if not isinstance(one, ContactEvents)]
    contact = [one for one in events if isinstance(one, ContactEvents)]
    stops = np.zeros(FIRST_OWN + len(own), dtype=np.int64)
    for nodes_watched in contact:
        for name in nodes_watched.stop:
            stops[CONTACT_EVENTS.index(name)] = 1
    stops[FIRST_OWN:] = [one.stop for one in own]
    rows = [one.row(system) for one in own]
    width = max((len(row) for row in rows), default=0)
    stick_speed = np.zeros(n)
    curve_speed, curve = np.zeros(0), np.zeros((n, 0))
    if contact and isinstance(system, ContactSystem):
        curve_speed, curve = _steady_friction(system)
        for nodes, _, law in system.law_groups("friction"):
            stick_speed[nodes] = law.stick_velocity(nodes.stop - nodes.start)
    # Room for the most that one step can hold, and for more where that is cheap.
    places = (32 * (3 * n + len(own)) + 64) if events else 0
    counts = np.zeros(3, dtype=np.int64)
    counts[NODES], counts[KINKS] = bool(contact), kinks
    return Watch(
        stick_speed, curve_speed, curve, np.zeros(n, dtype=np.int64),
        np.array([one.kernel.address for one in own], dtype=np.int64),
        np.array([np.pad(row, (0, width - len(row))) for row in rows]).reshape(len(own), width),
        np.zeros(len(own)), np.array([direction_sign(one) for one in own], dtype=np.int64),
        np.array([isinstance(one, Crossing) for one in own], dtype=np.int64),
        np.zeros((n + len(own), PLACES)), np.zeros(n + len(own), dtype=np.int64), np.zeros(64),
        note_events.address if events else 0, stops,
        np.zeros((places, 3)), np.zeros((places, states)), counts,
        events.after if isinstance(events, WatchedEvents) else -np.inf)


def take_events(watch: Watch, found: list[tuple[Array, Array]], time: float) -> None:
    """Move what was noted up to a time to a list of rows and states.

    Raises
    ------
    InputError
        If a user's function is not finite there.
    """
    count = int(watch.counts[FOUND])
    if count:
        found.append((watch.found[:count].copy(), watch.states[:count].copy()))
        watch.counts[FOUND] = 0
    if not np.isfinite(watch.own_values).all():
        number = int(np.argmin(np.isfinite(watch.own_values)))
        raise InputError(f"'event {number}' is not a finite number before t = {time:.6g} s; its "
                         f"function g(t, y, p) must be finite for every state.")


def _steady_friction(system: ContactSystem) -> Any:
    """Slip velocities (k,) and R/F (n, k) of steady sliding there, zero without memory."""
    if not system.memory:
        return np.zeros(0), np.zeros((system.basis.contact_nodes, 0))
    speeds = np.concatenate([-_CURVE[::-1], _CURVE])
    curve = np.zeros((system.basis.contact_nodes, len(speeds)))
    for nodes, _, law in system.law_groups("friction"):
        if hasattr(law, "steady_coefficient"):
            values = np.array([np.broadcast_to(law.steady_coefficient(v), nodes.stop - nodes.start)
                               for v in speeds])
            curve[nodes] = values.T
    return speeds, curve
