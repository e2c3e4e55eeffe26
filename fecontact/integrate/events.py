"""Events to be located during a run, and the table of located events."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_flags
from fecontact.core.compiled import CompiledLaw, compile_law
from fecontact.core.errors import InputError, choices, nearest, require_choice, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p.event_kernels import EVENT, FIRST_OWN
from fecontact.reduction.modal_basis import COMPONENTS, Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import state_size
from fecontact.system.fields.vector_field import VectorField

CONTACT_EVENTS = ("touch-down", "lift-off", "stick", "slip")
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
            if name not in CONTACT_EVENTS:
                raise InputError(f"ContactEvents: stop = {name!r} must be one of "
                                 f"{choices(CONTACT_EVENTS)}{nearest(str(name), CONTACT_EVENTS)}.")
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
        """Parameters of the function for a system."""
        return np.atleast_1d(np.array(self.parameters, dtype=float))


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
    for name, value, names in (("component", component, COMPONENTS),
                               ("of", of, ("displacement", "velocity"))):
        if value not in names and not (name == "component" and value is None):
            raise InputError(f"{owner}: {name} = {value!r} must be one of {choices(names)}"
                             f"{nearest(str(value), names)}.")


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


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Events:
    """Events of a run in chronological order.

    Attributes
    ----------
    time : (K,) array
        [s], located to round-off on the dense output of the steps.
    kind : tuple of str
        'touch-down', 'lift-off', 'stick', 'slip', or 'event k' for the k-th user-defined one
        from 0.
    node : (K,) array
        Number of the contact node from 0; -1 for user-defined events.
    states : (K, size) array
        y = [q, q', z].
    """

    time: Array
    kind: tuple[str, ...]
    node: Integers
    states: Array

    @classmethod
    def of_rows(cls, found: Array, states: Array) -> "Events":
        """Make events of rows of time, index of the kind, and node."""
        order = np.argsort(found[:, 0], kind="stable")
        kinds = [int(kind) for kind in found[order, 1]]
        return cls(found[order, 0],
                   tuple(CONTACT_EVENTS[kind] if kind < FIRST_OWN else f"event {kind - FIRST_OWN}"
                         for kind in kinds),
                   found[order, 2].astype(np.int64), states[order])

    @classmethod
    def none(cls, size: int) -> "Events":
        """An empty table for states of ``size`` values."""
        return cls.of_rows(np.zeros((0, 3)), np.zeros((0, size)))

    def __len__(self) -> int:
        return len(self.time)

    def between(self, first: float, last: float) -> "Events":
        """Events from the time ``first`` to ``last`` [s], both included."""
        return self._kept((self.time >= first) & (self.time <= last))

    def only(self, kind: str | None = None, node: int | None = None) -> "Events":
        """Events of one kind, of one node, or both; InputError for an unknown kind."""
        own = isinstance(kind, str) and kind.startswith("event ") and kind[6:].isdecimal()
        if kind is not None and kind not in CONTACT_EVENTS and not own:
            raise InputError(f"kind = {kind!r} must be one of {choices(CONTACT_EVENTS)}, or "
                             f"'event k' for the k-th user-defined one.")
        keep = np.ones(len(self), dtype=bool)
        if kind is not None:
            keep &= np.array([one == kind for one in self.kind], dtype=bool)
        if node is not None:
            keep &= self.node == node
        return self._kept(keep)

    def _kept(self, keep: NDArray[np.bool_]) -> "Events":
        return Events(self.time[keep],
                      tuple(one for one, stays in zip(self.kind, keep, strict=True) if stays),
                      self.node[keep], self.states[keep])


AnyEvent = ContactEvents | Event | Crossing


def as_events(events: AnyEvent | Sequence[AnyEvent] | None) -> tuple[AnyEvent, ...]:
    """One, several or no events as a tuple."""
    if events is None:
        return ()
    return tuple(events) if isinstance(events, Sequence) else (events,)


def _require_sense(owner: str, sense: str) -> None:
    require_choice(owner, "sense", sense, _SENSES)


def direction_sign(watched: Event | Crossing) -> int:
    """1 for 'rising', -1 for 'falling', 0 for 'both'."""
    return _SENSES[watched.sense]
