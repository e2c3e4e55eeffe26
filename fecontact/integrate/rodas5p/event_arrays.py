"""What is watched for, as the compiled integrator takes it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.integrate.events import (
    CONTACT_EVENTS,
    AnyEvent,
    ContactEvents,
    Crossing,
    direction_sign,
)
from fecontact.integrate.rodas5p.event_kernels import (
    FIRST_OWN,
    KINKS,
    NODES,
    PLACES,
    Watch,
    note_events,
)
from fecontact.system.contact_system import ContactSystem

# Slip velocities at which the friction of laws with memory in steady sliding is tabulated.
_CURVE = np.logspace(-9.0, 2.0, 441)


def watch_for(system: ContactSystem, events: Sequence[AnyEvent], kinks: bool) -> Watch:
    """Room for what is watched for, and nothing found yet.

    Raises
    ------
    InputError
        For what is no event.
    """
    n, states = system.basis.contact_nodes, system.size
    for one in events:
        if not isinstance(one, AnyEvent):
            raise InputError(f"events: {one!r} must be a ContactEvents, Crossing or Event.")
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
    if contact:
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
        np.zeros((places, 3)), np.zeros((places, states)), counts)


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
