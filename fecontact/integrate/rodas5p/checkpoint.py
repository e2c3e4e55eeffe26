"""Checkpoints: a long run in a file, from which it goes on bit for bit."""

import hashlib
import time as clock
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import replaced
from fecontact.core.files.stored import DamagedError, npz_arrays, reading
from fecontact.core.types import Array
from fecontact.integrate.rodas5p.run import Run
from fecontact.integrate.step_loop import HALVED, KEPT, OUTPUTS

_COUNTS = 1  # place of the counts among the leaves of the progress
_MOST_HALVED = 62


@dataclass
class Checkpoint:
    """The file of a run that is going on; ``mark`` tells runs of other systems apart."""

    path: Path
    run: Run
    mark: str
    period: float = 60.0
    _written: float = field(default_factory=clock.monotonic)

    @classmethod
    def of(cls, path: Path, run: Run, state: Array) -> "Checkpoint":
        """The checkpoint of a run that has not begun, from a state."""
        mark = hashlib.sha256()
        for item in (*_leaves(run.problem), run.times, state,
                     run.watch.own_parameters, run.watch.stick_speed):
            # Addresses of laws are integers, and differ from process to process.
            if np.asarray(item).dtype.kind == "f":
                mark.update(np.ascontiguousarray(item).tobytes())
        kind = b"steps" if run.collocation is None else b"collocation"
        mark.update(kind if run.series is None else b"series")
        return cls(path, run, mark.hexdigest())

    def read(self) -> None:
        """Take the run up where the file left it, if there is one.

        Raises
        ------
        InputError
            If the file is of another run, or is not a checkpoint.
        """
        if not self.path.exists():
            return
        require_regular_file(self.path, "a checkpoint")
        with reading(self.path, "not a checkpoint of fecontact"):
            stored = npz_arrays(self.path)
            mark = str(stored["mark"])
        if mark != self.mark:
            raise InputError(f"{self.path} is the checkpoint of another run (other system, "
                             f"start, output times or tolerance); repeat the values of "
                             f"that run, remove the file or name another one.")
        with reading(self.path, "not a checkpoint of fecontact"):
            self._take(stored)

    def _take(self, stored: dict[str, NDArray[Any]]) -> None:
        run, parts = self.run, self._parts()

        def like(name: str, wanted: NDArray[Any], length: int | None = None) -> NDArray[Any]:
            """A stored array of the same type and shape, except for its length."""
            found = stored[name]
            shape = wanted.shape if length is None else (length, *wanted.shape[1:])
            if found.shape != shape or found.dtype.kind != wanted.dtype.kind:
                raise DamagedError(f"'{name}' has shape {found.shape} and type {found.dtype}, not "
                                   f"{shape} and {wanted.dtype}")
            return found

        kept = [like(f"part{index}", np.asarray(item)) for index, item in enumerate(parts)]
        done = int(kept[_COUNTS][OUTPUTS])
        if not 0 <= done <= len(run.times) or kept[_COUNTS].min() < 0:
            raise DamagedError(f"{done} outputs of {len(run.times)} are done")
        states, work = like("states", run.states, done), like("work", run.work, done)
        events = like("found", np.zeros((0, 3)), len(stored["found"]))
        if not np.isfinite(events).all() or (events[:, 1] < 0.0).any():
            raise DamagedError("events of no kind were found")
        rows = int(kept[_COUNTS][KEPT])
        if not rows <= len(run.kept.times) or kept[_COUNTS][HALVED] > _MOST_HALVED:
            raise DamagedError(f"{rows} rows are kept between outputs, with room for "
                               f"{len(run.kept.times)}")
        between = [like(f"kept{index}", values, rows) for index, values in enumerate(run.kept)]
        run.found.append((events, like("found_states", run.states, len(events))))
        for item, value in zip(parts, kept, strict=True):
            item[...] = value
        run.states[:done], run.work[:done] = states, work
        for values, stored_rows in zip(run.kept, between, strict=True):
            values[:rows] = stored_rows

    def _parts(self) -> list[Any]:
        """The arrays from which a run goes on."""
        watch = self.run.watch
        return [*_leaves(self.run.progress), watch.zones, watch.own_values, *self._contacts()]

    def _contacts(self) -> list[Any]:
        """States of the contacts of a run by power series, or what collocation hands on."""
        if self.run.collocation is not None:
            c = self.run.collocation
            return [c.flags, c.accelerations, c.before]
        return [] if self.run.series is None else [self.run.series.states]

    def keep(self) -> None:
        """Write the file if the last time was some while ago, and if it can be written.

        A full disk does not end the run.
        """
        if clock.monotonic() - self._written > self.period:
            self._written = clock.monotonic()
            with suppress(InputError):
                self.write()

    def write(self) -> None:
        """Write the file, whole or not at all."""
        done = self.run.outputs
        rows = [np.zeros((0, 3)), *(rows for rows, _ in self.run.found)]
        states = [self.run.states[:0], *(states for _, states in self.run.found)]
        with replaced(self.path) as part, part.open("wb") as file:
            parts = {f"part{index}": item for index, item in enumerate(self._parts())}
            parts |= {f"kept{index}": values[: self.run.kept_rows]
                      for index, values in enumerate(self.run.kept)}
            np.savez(file, mark=self.mark, states=self.run.states[:done],
                     work=self.run.work[:done], found=np.vstack(rows),
                     found_states=np.vstack(states), **parts)
        self._written = clock.monotonic()


def _leaves(arrays: Any) -> list[Any]:
    if isinstance(arrays, tuple):
        return [leaf for item in arrays for leaf in _leaves(item)]
    return [arrays]
