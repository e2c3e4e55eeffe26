"""Input of solvers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from fecontact.core.types import Array
from fecontact.integrate.coefficients import Coefficient
from fecontact.integrate.events import AnyEvent
from fecontact.system.contact_system import ContactSystem


@dataclass(frozen=True, eq=False)
class Task:
    """Input of a solver.

    Attributes
    ----------
    system : ContactSystem
        The system.
    state : (2 m + n s,) array
        y = [q, q', z] at the first time.
    times : (N,) array
        Output times, ascending [s].
    rtol : float
        Relative tolerance.
    max_step : float or None
        Longest step [s].
    events : sequence of ContactEvents, Crossing and Event
        Events to locate; empty unless that is among its ``abilities``.
    keep_steps : bool
        Whether to keep what is between the outputs, see :class:`fecontact.integrate.KeptSteps`.
    progress : callable or None
        Called occasionally with the time reached [s].
    """

    system: ContactSystem
    state: Array
    times: Array
    rtol: float
    max_step: float | None = None
    events: Sequence[AnyEvent] = ()
    keep_steps: bool = False
    progress: Callable[[float], None] | None = None


@dataclass(frozen=True)
class SetValuedOptions:
    """Options of runs with set-valued friction, see :class:`fecontact.integrate.SetValued`."""

    restitution: Coefficient | None = None
    static_coefficient: Coefficient | None = None
    impact_law: str = "newton"
    tangential_restitution: Coefficient = 0.0

    method: ClassVar[str]
