"""Motion between the outputs of a run, kept so that pictures need not integrate again."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array


@read_only_arrays
@dataclass(frozen=True, eq=False)
class KeptSteps:
    """Motion at K times within and at the ends of steps, where these are shorter than the outputs.

    Attributes
    ----------
    time : (K,) array
        Ascending, none of them an output time [s].
    states : (K, 2 m + n s) array
        y = [q, q', z].
    work : (K, p) array
        Integrals of the powers :data:`fecontact.system.columns.POWERS` from the start [J].
    normal_force, friction_force : (K, n) arrays or None
        Forces [N] of set-valued contact, which do not follow from the state; friction in space
        (K, n, 2). Of a run from a file also those of laws, to 7 digits.
    contact_state : (K, n) array or None
        Values of :class:`fecontact.ContactState` in a run from a file.
    """

    time: Array
    states: Array
    work: Array
    normal_force: Array | None = None
    friction_force: Array | None = None
    contact_state: NDArray[np.int8] | None = None

    def part(self, rows: Any, work: Array | float = 0.0) -> "KeptSteps":
        """Some of the rows, with work counted from the given one."""
        return KeptSteps(self.time[rows], self.states[rows], self.work[rows] - work,
                         *(None if one is None else one[rows]
                           for one in (self.normal_force, self.friction_force, self.contact_state)))

    def before(self, end: float) -> "KeptSteps":
        """The rows before the end of a run, at which there is an output."""
        if not len(self.time) or self.time[-1] < end:
            return self
        return self.part(slice(int(np.searchsorted(self.time, end))))
