"""Events to be located during a run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from fecontact.core.checks import require_flags, require_within
from fecontact.core.compiled import CompiledLaw, compile_law
from fecontact.core.errors import InputError, choices, require_choice, require_finite
from fecontact.core.types import Array
from fecontact.integrate.event_table import CONTACT_EVENTS
from fecontact.integrate.rodas5p.event_kernels import EVENT
from fecontact.reduction.modal_basis import COMPONENTS, Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import state_size
from fecontact.system.fields.vector_field import VectorField

_SENSES = {"both": 0, "rising": 1, "falling": -1}


def event(function: Callable[..., Any]) -> CompiledLaw:
    """Compile ``g(t, y, p) -> value`` whose sign changes are events.

    ``y`` = [q, q', z] is the state, ``p`` the parameters of the :class:`Event`.

    Raises
    ------
    InputError
        For an object that is not a function; at its first use, if the function has another form.
    """
    if not callable(function):
        raise InputError(f"event needs a function g(t, y, p), not {function!r}.")
    return compile_law(EVENT, "g(t, y, p) -> value", function)


@dataclass(frozen=True)
class ContactEvents:
    """Changes of state of the contact nodes: touch-down, lift-off, stick and slip.

    A node touches down when its normal force begins and lifts off when that ends; for stick and
    slip see :attr:`fecontact.Trajectory.contact_state`. A node that sticks as it touches down has
    both events at the same time.

    Parameters
    ----------
    stop : str or sequence of str
        Events at whose first occurrence the run ends: 'touch-down', 'lift-off', 'stick', 'slip'.

    Raises
    ------
    InputError
        For other names.
    """

    stop: str | Sequence[str] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.stop, str | list | tuple):
            raise InputError(f"ContactEvents: stop = {self.stop!r} must be one or several of "
                             f"{choices(CONTACT_EVENTS)}, or () for none.")
        given = (self.stop,) if isinstance(self.stop, str) else tuple(self.stop)
        for name in given:
            require_choice("ContactEvents", "stop", name, CONTACT_EVENTS)
        object.__setattr__(self, "stop", given)


@dataclass(frozen=True)
class Event:
    """Sign changes of a function of time and state.

    Parameters
    ----------
    kernel : compiled function
        From :func:`event`.
    parameters : sequence of float
        Parameters ``p`` of the function.
    sense : 'both', 'rising' or 'falling'
        Direction of the sign changes.
    stop : bool
        Whether the run ends at the first.

    Raises
    ------
    InputError
        For an unknown sense, a function that is not compiled, or parameters that are not finite
        numbers.
    """

    kernel: CompiledLaw
    parameters: Sequence[float] = ()
    sense: Literal["both", "rising", "falling"] = "both"
    stop: bool = False

    def __post_init__(self) -> None:
        _require_sense("Event", self.sense)
        if not isinstance(self.kernel, CompiledLaw):
            raise InputError(f"Event: kernel = {self.kernel!r} must be a compiled function; put "
                             f"@fecontact.event before its definition.")
        try:
            usable = np.isfinite(np.atleast_1d(np.array(self.parameters, dtype=float))).all()
        except (TypeError, ValueError):
            usable = False
        if not usable:
            raise InputError(f"Event: parameters = {self.parameters!r} must be a list of finite "
                             f"numbers.")

    def row(self, system: ContactSystem | VectorField) -> Array:
        """Parameters of the function for a system.

        Raises
        ------
        InputError
            If the function uses states or parameters that there are not.
        """
        parameters, size = np.atleast_1d(np.array(self.parameters, dtype=float)), state_size(system)
        require_within("Event: the function", self.kernel.python,
                       f"states: {size}, parameters: {len(parameters)}", 1.0, np.ones(size),
                       parameters)
        return parameters


@event
def _plane(t, y, p):
    value = -p[0]
    for i in range(len(y)):
        value += p[1 + i] * y[i]
    return value


@dataclass(frozen=True)
class Crossing:
    """Passage of a displacement or velocity of a point through a value (Poincare section).

    Of a vector field that of one of its states: ``Crossing("x", value=1.0)``.

    Parameters
    ----------
    point : str or int
        'B', 'C' or a further named point; a contact node by its number from 0. The name of a state
        of a vector field.
    component : 'x', 'y' or 'phi', of solids also 'z', 'phi_x', 'phi_y', 'phi_z'
        Along the ground, away from it, or counter-clockwise; of solids along or about the axes.
        None for a vector field.
    value : float
        The value [m], [rad], [m/s] or [rad/s]; of a state in its unit.
    of : 'displacement' or 'velocity'
        Quantity; not for a vector field.
    sense : 'both', 'rising' or 'falling'
        Direction of the passages.
    stop : bool
        Whether the run ends at the first.

    Raises
    ------
    InputError
        For other names.
    """

    kernel: ClassVar[CompiledLaw] = _plane

    point: str | int
    component: Component | None = None
    value: float = 0.0
    of: Literal["displacement", "velocity"] = "displacement"
    sense: Literal["both", "rising", "falling"] = "both"
    stop: bool = False

    def __post_init__(self) -> None:
        _require_sense("Crossing", self.sense)
        require_quantity("Crossing", self.component, self.of)
        require_finite("Crossing", value=self.value)
        require_flags("Crossing", stop=self.stop)

    def row(self, system: ContactSystem | VectorField) -> Array:
        """Parameters of the function for a system: the value, and the row (size,) of the quantity.

        Raises
        ------
        InputError
            If there is no such point, component or state.
        """
        return np.append(self.value, quantity_row(system, self.point, self.component, self.of))


def require_quantity(owner: str, component: Any, of: Any) -> None:
    """Raise InputError unless these are a component, or None, and a displacement or velocity."""
    if component is not None:
        require_choice(owner, "component", component, COMPONENTS)
    require_choice(owner, "of", of, ("displacement", "velocity"))


def quantity_row(
    system: ContactSystem | VectorField, point: str | int, component: Component | None, of: str
) -> Array:
    """Row (size,) of a displacement or velocity of a point, or of a state of a vector field.

    Raises
    ------
    InputError
        If there is no such point, component or state.
    """
    row = np.zeros(state_size(system))
    if isinstance(system, VectorField):
        if component is not None or of != "displacement":
            raise InputError(f"A vector field has states, but no points: give the name of one "
                             f"alone, such as {system.state_names[0]!r}.")
        row[system.state_index(point)] = 1.0
        return row
    if component is None:
        raise InputError(f"component is missing: the direction in which {point!r} moves, one of "
                         f"{choices(COMPONENTS)}.")
    first = 0 if of == "displacement" else system.basis.modes
    row[first : first + system.basis.modes] = system.basis.point_row(point, component)
    return row


AnyEvent = ContactEvents | Event | Crossing


class WatchedEvents(tuple[AnyEvent, ...]):
    """Events to watch for; those up to the time ``after`` [s] do not count."""

    after = -np.inf


def as_events(events: AnyEvent | Sequence[AnyEvent] | None) -> WatchedEvents:
    """One, several or no events as a tuple."""
    if events is None or isinstance(events, WatchedEvents):
        return events or WatchedEvents()
    # A text is no sequence of events.
    if isinstance(events, Sequence) and not isinstance(events, str | bytes):
        return WatchedEvents(events)
    return WatchedEvents((events,))


def _require_sense(owner: str, sense: str) -> None:
    require_choice(owner, "sense", sense, _SENSES)


def direction_sign(watched: Event | Crossing) -> int:
    """1 for 'rising', -1 for 'falling', 0 for 'both'."""
    return _SENSES[watched.sense]
