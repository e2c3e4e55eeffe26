"""Checkpoints: a long run in a file, from which it goes on bit for bit."""

import hashlib
import os
import time as clock
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError

if TYPE_CHECKING:
    from fecontact.integrate.control import Run

Array = NDArray[np.float64]


@dataclass
class Checkpoint:
    """The file of a run that is going on; ``mark`` tells runs of other systems apart."""

    path: Path
    run: "Run"
    mark: str
    period: float = 60.0
    _written: float = field(default_factory=clock.monotonic)

    @classmethod
    def of(cls, path: Path, run: "Run", state: Array) -> "Checkpoint":
        """The checkpoint of a run that has not begun, from a state."""
        mark = hashlib.sha256()
        for item in (*_leaves(run.arrays), *_leaves(run.control), run.times, state,
                     run.watch.own_parameters, run.watch.stick_speed):
            # Addresses of laws are integers, and differ from process to process.
            if np.asarray(item).dtype.kind == "f":
                mark.update(np.ascontiguousarray(item).tobytes())
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
        try:
            with np.load(self.path) as stored:
                if str(stored["mark"]) != self.mark:
                    raise InputError(f"{self.path} is the checkpoint of another run (other system, "
                                     f"start, output times or tolerance); remove it or name "
                                     f"another file.")
                for index, item in enumerate(self._parts()):
                    item[...] = stored[f"part{index}"]
                self.run.found.append((stored["found"], stored["found_states"]))
                for name in ("states", "work"):
                    getattr(self.run, name)[: self.run.outputs] = stored[name]
        except (OSError, KeyError, BadZipFile, EOFError) as error:
            raise InputError(f"{self.path} is not a checkpoint of fecontact "
                             f"({error}).") from None
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{self.path} is not a checkpoint of fecontact.") from None

    def _parts(self) -> list[Any]:
        """The arrays from which a run goes on."""
        watch = self.run.watch
        return [*_leaves(self.run.progress), watch.zones, watch.own_values]

    def keep(self) -> None:
        """Write the file if the last time was some while ago."""
        if clock.monotonic() - self._written > self.period:
            self.write()

    def write(self) -> None:
        """Write the file, whole or not at all."""
        part = self.path.with_name(f"{self.path.name}.part")
        try:
            with open(part, "wb") as file:
                done = self.run.outputs
                rows = [np.zeros((0, 3)), *(rows for rows, _ in self.run.found)]
                states = [self.run.states[:0], *(states for _, states in self.run.found)]
                np.savez(file, mark=self.mark, states=self.run.states[:done],
                         work=self.run.work[:done], found=np.vstack(rows),
                         found_states=np.vstack(states), **{
                             f"part{index}": item for index, item in enumerate(self._parts())})
            os.replace(part, self.path)
        except OSError as error:
            raise InputError(f"The checkpoint {self.path} cannot be written: "
                             f"{error.strerror or error}.") from None
        self._written = clock.monotonic()

    def remove(self) -> None:
        """Remove the file: the run has ended."""
        self.path.unlink(missing_ok=True)


def _leaves(arrays: Any) -> list[Any]:
    if isinstance(arrays, tuple):
        return [leaf for item in arrays for leaf in _leaves(item)]
    return [arrays]
