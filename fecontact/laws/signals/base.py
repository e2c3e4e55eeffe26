"""Base class of signals."""

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.compiled import CompiledLaw, kernel
from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array, ArrayLike
from fecontact.laws.signatures import signal_at


@kernel
def _history(address: int, t: Vector, p: Vector, out: Matrix) -> None:
    for k in range(len(t)):
        out[k, 0], out[k, 1] = signal_at(address)(t[k], p)


@dataclass(frozen=True)
class Signal(InheritsDocumentation):
    """Base class of signals: a frozen dataclass with a :func:`~fecontact.laws.signal`.

    A user-defined signal sets ``kernel`` and overrides methods as required. The amplitude and the
    errors below are added to its docstring.

    Parameters
    ----------
    amplitude : float
        Amplitude A, in the unit of the quantity.

    Raises
    ------
    InputError
        For values outside these ranges, or that do not fit together.
    """

    kernel: ClassVar[CompiledLaw]

    def parameters(self) -> Array:
        """Parameters of the kernel, by default the fields in their order.

        They may be padded with zeros.
        """
        return np.array([getattr(self, entry.name) for entry in fields(self)], dtype=float)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Times between t0 and t1, both excluded, at which a step must end, ascending [s].

        There the signal, its rate or its second derivative jumps, or a steep piece begins or ends.
        """
        return ()

    @property
    def shortest_period(self) -> float | None:
        """Shortest period between breakpoints [s], which limits the step; or None.

        A signal that is smooth between breakpoints, where steps end, needs none.
        """
        return None

    @property
    def fundamental_hz(self) -> float | None:
        """Fundamental frequency of a periodic signal [Hz]; None of any other and of a constant."""
        return None

    @property
    def largest(self) -> float:
        """Upper bound of its magnitude; by default that of its ``amplitude``."""
        return abs(float(vars(self)["amplitude"]))

    def history(self, times: ArrayLike) -> Array:
        """Values and rates (N, 2) at N times [s]."""
        t = np.atleast_1d(as_floats(times, "The times of a signal"))
        out = np.empty((len(t), 2))
        _history(self.kernel.address, t, self.parameters(), out)
        return out


def value_at(given: float | Signal, time: float) -> float:
    """Value of a number or a signal at a time [s]."""
    return float(given.history(time)[0, 0]) if isinstance(given, Signal) else float(given)


def between(times: ArrayLike, t0: float, t1: float) -> tuple[float, ...]:
    """Distinct times between t0 and t1, ascending."""
    found = np.unique(np.asarray(times, dtype=float))
    return tuple(found[(found > t0) & (found < t1)].tolist())
