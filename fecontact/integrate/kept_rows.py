"""Room for the motion that a run keeps between its outputs."""

from collections.abc import Callable
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.integrate.step_loop import HALVED, KEPT, PASSED

# Rows that a run has room for, and numbers in all of them: 16 MB.
_MOST_ROWS, _MOST_NUMBERS = 20_000, 2_000_000
_FEWEST_ROWS = 64


def workspace_for_rows(keep: bool, numbers: int) -> int:
    """Rows that a run has room for, of so many numbers each; none unless it keeps some."""
    if not keep:
        return 0
    return max(_FEWEST_ROWS, min(_MOST_ROWS, _MOST_NUMBERS // numbers))


def halve(kept: Any, counts: Integers) -> None:
    """Drop every second row of a record that has no room left; ``counts`` are those of the run."""
    count = int(counts[KEPT])
    for values in kept:
        values[: count // 2] = values[1:count:2]
    # An odd last row goes too: the places since it count on from the row before.
    counts[PASSED] += (count % 2) << int(counts[HALVED])
    counts[KEPT], counts[HALVED] = count // 2, counts[HALVED] + 1


class GrowingRows:
    """Rows of a run that is not compiled, with room for so many of them; none for no room."""

    def __init__(self, workspace: int) -> None:
        self._workspace, self._every, self._passed = workspace, 1, 0
        self._rows: list[tuple[float, Array]] = []

    def add(self, time: float, state_at: Callable[[float], Array]) -> None:
        """Keep the state at a time, unless it is one of those that are left out by now."""
        if not self._workspace or (self._rows and not time > self._rows[-1][0]):
            return
        self._passed += 1
        if self._passed >= self._every:
            self._rows.append((time, state_at(time)))
            self._passed = 0
        if len(self._rows) == self._workspace:
            self._rows, self._every = self._rows[1::2], 2 * self._every

    @property
    def time(self) -> Array:
        """Times (K,) [s]."""
        return np.array([time for time, _ in self._rows])

    @property
    def values(self) -> Array:
        """All states, one after the other."""
        return np.array([state for _, state in self._rows])
