"""The table of the events that a run has located."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, choices
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers

# Events of contact nodes, in the order in which compiled functions number them; those of users
# follow.
CONTACT_EVENTS = ("touch-down", "lift-off", "stick", "slip")


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
        kinds, own = [int(kind) for kind in found[order, 1]], len(CONTACT_EVENTS)
        return cls(found[order, 0],
                   tuple(CONTACT_EVENTS[kind] if kind < own else f"event {kind - own}"
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
