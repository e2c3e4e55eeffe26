"""Poincare sections of runs over a parameter, swept up and down."""

import sys
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import chain
from numbers import Real
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fecontact.bifurcation.attractors.blocks import Found, Place, work_off
from fecontact.bifurcation.attractors.fingerprint import fingerprint
from fecontact.core.checks import as_count
from fecontact.core.errors import InputError
from fecontact.core.errors import shown as text_of
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.ensembles import ensemble, is_many, strobe
from fecontact.integrate.events import Crossing, quantity_row, require_quantity
from fecontact.integrate.field_runs.start import start_state
from fecontact.integrate.solvers import AUTO, Solver
from fecontact.reduction.modal_basis import Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving, in_time, state_size
from fecontact.system.forcing_period import forcing_period

# Chains each way where their number is not given, and the longest of many values.
_CHAINS, _LONGEST = 16, 1000
_TOGETHER = 8  # chains of a block

Change = str | Callable[[Any, float], Moving]


@read_only_arrays
@dataclass(frozen=True, eq=False)
class PoincareScan:
    """States once per period of the excitation, or on a section, over a parameter.

    Attributes
    ----------
    system : ContactSystem or VectorField
        The system before the parameter was changed.
    parameter : str
        Its name.
    values : (V,) array
        Its values, ascending.
    up, down : (V, K, size) arrays
        The last K states of each value, where it was approached from below and from above; NaN
        where a run could not go on, or met the section less often. ``down`` is empty if that was
        not asked for.
    """

    system: Moving
    parameter: str
    values: Array
    up: Array
    down: Array

    def observed(
        self, point: str | int = "B", component: Component | None = None,
        of: Literal["displacement", "velocity"] = "displacement",
    ) -> tuple[Array, Array]:
        """A displacement [m], [rad] or velocity of a point, or a state, (V, K) up and down.

        ``component`` is 'y' by default; a vector field has states by name, and no components.
        """
        require_quantity("PoincareScan", component, of)
        if component is None and isinstance(self.system, ContactSystem):
            component = "y"
        row = quantity_row(self.system, point, component, of)
        # States that are missing are so as a whole: 0 times NaN is no number.
        used = np.flatnonzero(row)
        return self.up[..., used] @ row[used], self.down[..., used] @ row[used]


def poincare_scan(
    system: Moving,
    parameter: Change,
    values: ArrayLike,
    *,
    transient_periods: int | None = None,
    transient: float | None = None,
    section: Crossing | None = None,
    keep: int = 100,
    initial: Any = "rest",
    down: bool = True,
    chains: int | None = None,
    solver: Solver = AUTO,
    rtol: float = 1e-5,
    workers: int | None = None,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool | Callable[[int], None] | None = None,
) -> PoincareScan:
    """Move a parameter up and down in small steps; keep states once per period or on a section.

    The values are cut into chains that run side by side on all cores; within a chain each value
    starts where the one before it ended, so that coexisting motions show as a difference between
    up and down.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with one period at every value, unless there is a section.
    parameter : str or function
        Dotted name of a number of the system, ``"drive.frequency_hz"``, the name of one of
        the field, or a function that makes the system for a value, ``(system, value) -> system``;
        for an executor of processes one at the top of a module.
    values : (V,) array
        Ascending.
    transient_periods : int, optional
        Periods that are not kept of each value, 200 by default; not with a section.
    transient : float, optional
        Time before passages of the section count, and after that in which they do [s].
    section : Crossing, optional
        Poincare section, where states are kept in place of once per period.
    keep : int
        States that are kept of each value, the last ones.
    initial : any
        Start of the first value of each chain; see :func:`fecontact.ensemble`.
    down : bool
        Whether to go down again.
    chains : int, optional
        Number of chains each way; default sixteen, of 8 to 1000 values, and more of more values.
    solver, rtol, workers, progress, folder, executor
        As for :func:`fecontact.bifurcation.basins`.

    Raises
    ------
    InputError
        For values that do not ascend, for a folder that is in use or of other runs, or as
        :func:`fecontact.integrate.strobe`.
    AnalysisError
        If the executor broke; finished chains are kept.
    """
    moving = in_time("poincare_scan", system)
    keep = as_count(keep, "keep")
    if section is None and transient is not None:
        raise InputError("poincare_scan: transient is the time before passages of a section "
                         "count; give a section too, or transient_periods.")
    if section is not None and (transient_periods is not None or not (
            isinstance(transient, Real) and 0.0 < transient <= sys.float_info.max)):
        raise InputError(f"poincare_scan: transient = {text_of(transient)} must be a time above "
                         f"zero [s] before passages of the section count, without "
                         f"transient_periods.")
    try:
        points = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 1 or not len(points) or not np.isfinite(points).all() or (
            (np.diff(points) <= 0.0).any()):
        raise InputError("values must be finite numbers in ascending order.")
    if chains is not None:
        chains = as_count(chains, "chains")
    if not isinstance(parameter, str) and not callable(parameter):
        raise InputError(f"poincare_scan: parameter must be a text or a function, not "
                         f"{type(parameter).__name__}.")
    place = Place.checked("poincare_scan", folder, executor, workers)
    passes = None if section is None else (section, float(transient or 0.0))
    task = _Task(system, parameter, 200 if transient_periods is None else transient_periods,
                 passes, keep, initial, solver, rtol)
    ends = [task.system_at(float(value)) for value in points[[0, -1]]]
    if section is None:
        for made in ends:
            forcing_period(made)
    count = len(points)
    # States as they are read and as they are returned, and times of each run.
    require_memory("poincare_scan: keep", keep, 16.0 * count * (2 + 2 * state_size(moving)))
    most = chains or max(min(_CHAINS, count // 8), count // _LONGEST, 1)
    length = -(-count // min(most, count))
    # All chains have the same length; where the values do not divide, the last ones are run twice.
    order = np.arange(length * -(-count // length)).reshape(-1, length)
    order = np.minimum(order, count - 1)
    ways = [order] + ([count - 1 - order] if down else [])
    together = len(order) if folder is None else _TOGETHER
    places = [(way, chains_of_way[first : first + together])
              for way, chains_of_way in enumerate(ways)
              for first in range(0, len(order), together)]
    blocks = [_Chains(task, points[chosen], order.size * len(ways)) for _, chosen in places]
    known = "" if folder is None else task.fingerprint(points, ends, length, down)
    with shown(progress, lambda: progress_bar("Running", sum(one.runs for one in blocks))) as tell:
        readers = work_off(blocks, place, known, tell)
    states = np.empty((2, count, keep, state_size(moving)))
    for (way, chosen), read in zip(places, readers, strict=True):
        states[way, chosen.ravel()] = read()["states"]
    name = parameter if isinstance(parameter, str) else getattr(parameter, "__name__", "parameter")
    return PoincareScan(moving, name, points, states[0], states[1] if down else states[1, :0])


@dataclass(frozen=True, eq=False)
class _Task:
    """Settings of the run at each value; ``passes`` are a section and the time before it counts."""

    system: Any
    parameter: Change
    transient_periods: int
    passes: tuple[Crossing, float] | None
    keep: int
    initial: Any
    solver: Solver
    rtol: float

    def system_at(self, value: float) -> Moving:
        """The system at a value of the parameter."""
        made = (self.system.with_(**{self.parameter: value}) if isinstance(self.parameter, str)
                else self.parameter(self.system, value))
        return in_time("poincare_scan", made)

    def fingerprint(self, values: Array, ends: list[Moving], *settings: Any) -> str:
        """Fingerprint of all numbers that results depend on, from the systems at both ends."""
        name = self.parameter if isinstance(self.parameter, str) else None
        each = self.initial if is_many(self.initial) else [self.initial]
        starts = [start_state(made, one, 0.0) for made in ends for one in each]
        # A name tells what is between the ends, a function does not.
        between = values[1:-1] if name is None else values[:0]
        systems = chain(ends, (self.system_at(value) for value in between.tolist()))
        return fingerprint(systems, name, values, starts, self.transient_periods, self.passes,
                           self.keep, self.solver, self.rtol, *settings)


@dataclass(frozen=True, eq=False)
class _Chains:
    """Values (c, length), each row run one after the other from where the one before it ended.

    ``in_all`` is the number of runs of all blocks.
    """

    task: _Task
    values: Array
    in_all: int

    @property
    def runs(self) -> int:
        return self.values.size

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        size = state_size(in_time("poincare_scan", self.task.system))
        return {"states": (self.runs, self.task.keep, size)}

    def found(self, tell: Callable[[int], None] | None = None, workers: int | None = 1) -> Found:
        task = self.task
        runs = [task.system_at(float(value)) for value in self.values.ravel()]
        settings: dict[str, Any] = {
            "initial": task.initial, "solver": task.solver, "rtol": task.rtol, "workers": workers,
            "progress": tell, "chain": self.values.shape[1], "in_all": self.in_all}
        if task.passes is not None:
            return {"states": _passages(runs, *task.passes, task.keep, **settings)}
        return {"states": strobe(runs, transient_periods=task.transient_periods, keep=task.keep,
                                 **settings).states}


def _passages(
    runs: list[Moving], section: Crossing, transient: float, keep: int, **settings: Any
) -> Array:
    """The last states (E, keep, size) of each run on a section, after a transient; else NaN."""
    found = ensemble(runs, [0.0, transient, 2.0 * transient], events=section, **settings)
    kept = np.full((len(runs), keep, found.states.shape[2]), np.nan)
    for row, events, fine in zip(kept, found.events or (), found.finished, strict=True):
        late = events.states[events.time > transient][-keep:]
        if fine and len(late):
            row[-len(late) :] = late
    return kept
