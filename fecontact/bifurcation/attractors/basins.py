"""Basins of attraction on a plane of initial states."""

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from numbers import Real
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fecontact.bifurcation.attractors.attractor import Attractor, distinguished
from fecontact.bifurcation.attractors.blocks import Found, Place, work_off
from fecontact.bifurcation.attractors.fingerprint import fingerprint
from fecontact.bifurcation.attractors.labels import Settled
from fecontact.core.checks import as_count
from fecontact.core.errors import InputError
from fecontact.core.errors import shown as text_of
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.integrate.ensembles import ensemble, strobe
from fecontact.integrate.events import Crossing, quantity_row, require_quantity
from fecontact.integrate.solvers import AUTO, Solver
from fecontact.reduction.modal_basis import Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving, in_time, state_size

# Looks at the second half of a run, in parts of the first.
_LATE = (1.0 + 0.5 / np.sqrt(3.0), 1.0 + 1.0 / np.sqrt(2.0))
_LARGEST = 4096  # starts in a block


@dataclass(frozen=True)
class Axis:
    """A direction in the space of initial states: one displacement or velocity of a point.

    Of a vector field one of its states: ``Axis("x")``.

    Parameters
    ----------
    point : str or int
        'B', 'C' or a further named point; a contact node by its number from 0. The name of a state
        of a vector field.
    component : 'x', 'y' or 'phi', of solids also 'z', 'phi_x', 'phi_y', 'phi_z'
        Along the ground, away from it, counter-clockwise. None for a vector field.
    of : 'displacement' or 'velocity'
        Quantity of the component [m], [rad], [m/s], [rad/s]; not for a vector field.

    Raises
    ------
    InputError
        For other names.
    """

    point: str | int
    component: Component | None = None
    of: Literal["displacement", "velocity"] = "displacement"

    def __post_init__(self) -> None:
        require_quantity("Axis", self.component, self.of)

    def row(self, system: Moving) -> Array:
        """The quantity as a row (size,) that acts on states."""
        return quantity_row(in_time("Axis", system), self.point, self.component, self.of)


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Basins:
    """Attractor that the run from each start reaches.

    Attributes
    ----------
    first, second : (a,), (b,) arrays
        Values along the two axes of the plane.
    label : (a, b) array
        Index into ``attractors``; -1 where a run could not go on, or had not settled: its last
        states come ever closer to a periodic motion, but do not repeat within the tolerance. With
        32 states, 1 % of the chaotic runs of Duffing's oscillator had this label, and none of an
        impact oscillator. A run that nears a periodic motion by less than 30 % in a third of its
        states counts as aperiodic. Of the unsettled runs of Duffing's oscillator within 5 % of
        their motion 14 % did so, and half of those of the impact oscillator, whose free motion
        loses 1.5 % in a period. Longer transients settle these runs.
    attractors : tuple of Attractor
        In the order of their shares, the largest first.
    """

    first: Array
    second: Array
    label: Integers
    attractors: tuple[Attractor, ...]


def basins(
    system: Moving,
    first: tuple[Axis, ArrayLike],
    second: tuple[Axis, ArrayLike],
    *,
    base: ArrayLike | None = None,
    transient_periods: int | None = None,
    transient: float | None = None,
    keep: int = 32,
    section: Crossing | None = None,
    tolerance: float = 1e-3,
    solver: Solver = AUTO,
    rtol: float = 1e-6,
    workers: int | None = None,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool | Callable[[int], None] | None = None,
) -> Basins:
    """Run from a grid of initial states, and classify the motions on which they settle.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with one period, or not excited at all; a field at its base values.
    first, second : (Axis, values)
        The plane: at each start these two quantities have these values, by the smallest change
        of the ``base`` state.
    base : (size,) array, optional
        State to start from; default zero.
    transient_periods : int, optional
        Periods of the excitation before states count; needed without a ``section``.
    transient : float, optional
        Time before passages of the ``section`` count [s]; needed with one.
    keep : int
        States on the section that are examined, at least 4.
    section : Crossing, optional
        Poincare section of a system that is not excited; motions that do not meet it in the last
        half of the run, or keep one place there, are equilibria.
    tolerance : float
        States that differ by less are the same, in parts of the largest modal displacement, and
        velocity, of all starts and sections; of a field each state in parts of its largest.
    solver, rtol, workers, progress
        As for :func:`fecontact.ensemble`.
    folder : path, optional
        Where finished blocks of runs are kept, some thousand starts each; a call that was ended
        or killed goes on from there, with the same result. Other numbers of the system or settings
        are refused; for other code of laws, functions or fields of your own name another folder.
    executor : concurrent.futures.Executor, optional
        Executor that computes the blocks in place of this process: processes, or a cluster by
        :func:`fecontact.sweeps.dask_executor`. Needs a folder.

    Raises
    ------
    InputError
        For values out of range, for two quantities that no state has independently, for a folder
        that is in use or of other runs, and as :func:`fecontact.ensemble`.
    AnalysisError
        If the executor broke; finished blocks are kept.
    """
    moving = in_time("basins", system)
    size = state_size(moving)
    if keep < 4:
        raise InputError(f"keep = {keep!r} must be at least 4.")
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"tolerance = {tolerance!r} must be between 0 and 1.")
    a, b = (_values(name, given) for name, given in (("first", first), ("second", second)))
    start = np.zeros(size) if base is None else np.array(base, dtype=float)
    if start.shape != (size,):
        values = "values [q, q', z]" if isinstance(moving, ContactSystem) else "values"
        raise InputError(f"base must have {size} {values}, not shape {start.shape}.")
    rows = np.array([axis.row(moving) for axis, _ in (first, second)])
    lengths = np.linalg.norm(rows, axis=1)
    if not lengths.all() or np.linalg.matrix_rank(rows / lengths[:, None], tol=1e-9) < 2:
        raise InputError(f"first = {first[0]} and second = {second[0]} cannot be chosen each by "
                         f"itself, as the modes of a body or the same state; take other axes.")
    # Of each start: its state, the values of both axes with their copies, and the kept states.
    require_memory("basins: the number of starts", len(a) * len(b), 8.0 * (8 + (3 + keep) * size))
    wanted = np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2)
    states = start + (wanted - rows @ start) @ np.linalg.pinv(rows).T
    place = Place.checked("basins", folder, executor, workers)
    if section is None:
        if transient_periods is None or transient is not None:
            raise InputError("basins: without a section give transient_periods, the periods of "
                             "the excitation before states count, and no transient.")
        as_count(transient_periods, "basins: transient_periods", 0)
    elif transient_periods is not None or not (
            isinstance(transient, Real) and 0.0 < transient <= sys.float_info.max):
        raise InputError(f"basins: transient = {text_of(transient)} must be a time above zero [s] "
                         f"before passages of the section count, without transient_periods.")
    settle = _Settle(moving, solver, rtol, keep, transient_periods, float(transient or 0.0),
                     section, tolerance, np.abs(states).max(axis=0), len(states))
    size_of_block = len(states) if folder is None else int(
        np.clip(len(states) // 64, 16, _LARGEST))
    blocks = [_Starts(settle, part) for part
              in np.split(states, range(size_of_block, len(states), size_of_block))]
    # Without a section the tolerance counts only in labels, which are not kept.
    known = "" if folder is None else fingerprint(
        [moving], solver, rtol, keep, transient_periods, settle.transient, section,
        None if section is None else tolerance, states)
    with shown(progress, lambda: progress_bar("Running", len(states))) as tell:
        readers = work_off(blocks, place, known, tell)
    parts = [partial(_settled, read) for read in readers]
    labels, attractors = distinguished(parts, _scale(moving, states, parts), tolerance)
    return Basins(a, b, labels.reshape(len(a), len(b)), attractors)


@dataclass(frozen=True, eq=False)
class _Settle:
    """Settings of runs that are followed until they settle.

    ``farthest`` (size,) is that of all starts, ``in_all`` their number.
    """

    moving: Moving
    solver: Solver
    rtol: float
    keep: int
    transient_periods: int | None
    transient: float
    section: Crossing | None
    tolerance: float
    farthest: Array
    in_all: int

    def settled(
        self, states: Array, tell: Callable[[int], None] | None, workers: int | None,
    ) -> Settled:
        """Last states of runs from some initial states, and whether they have settled."""
        settings: dict[str, Any] = {"initial": states, "solver": self.solver, "rtol": self.rtol,
                                    "in_all": self.in_all, "workers": workers, "progress": tell}
        rows, still = np.full(len(states), -1), np.zeros(len(states), dtype=np.int64)
        if self.section is None:
            found = strobe(self.moving, transient_periods=self.transient_periods or 0,
                           keep=self.keep, **settings)
            rows[found.finished] = self.keep
            return Settled(found.states, rows, still)
        # At times without a common measure: no motion is at one place at all of them.
        late = self.transient * np.array([0.0, 1.0, *_LATE, 2.0])
        found = ensemble(self.moving, late, events=self.section, **settings)
        points = np.full((len(states), self.keep, states.shape[1]), np.nan)
        for e, (events, ends, fine) in enumerate(zip(found.events or (), found.states,
                                                     found.finished, strict=True)):
            passed = events.states[events.time > self.transient][-self.keep :]
            kept = np.vstack([ends[1:], passed])
            size = np.vstack([self.farthest, kept])
            still[e] = len(passed) == 0 or bool(
                (np.ptp(kept, axis=0) < self.tolerance * _size(self.moving, size)).all())
            if fine:
                own = ends[-1:] if still[e] else passed
                points[e, : len(own)], rows[e] = own, len(own)
        return Settled(points, rows, still)


@dataclass(frozen=True, eq=False)
class _Starts:
    """A block of starts."""

    settle: _Settle
    states: Array

    @property
    def runs(self) -> int:
        return len(self.states)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        number, size = self.states.shape
        return {"points": (number, self.settle.keep, size), "rows": (number,), "still": (number,)}

    def found(self, tell: Callable[[int], None] | None = None, workers: int | None = 1) -> Found:
        return self.settle.settled(self.states, tell, workers)._asdict()


def _values(name: str, given: Any) -> Array:
    try:
        axis, values = given
        found = np.atleast_1d(np.array(values, dtype=float))
    except (TypeError, ValueError):
        axis, found = None, np.empty(0)
    if not (isinstance(axis, Axis) and found.ndim == 1 and len(found)
            and np.isfinite(found).all()):
        raise InputError(f"{name} = {given!r} must be an Axis and a list of finite values: "
                         f"(Axis('B', 'y'), [0.0, 1e-4]).")
    return found


def _settled(read: Callable[[], Found]) -> Settled:
    return Settled(**read())


def _scale(moving: Moving, starts: Array, parts: Sequence[Callable[[], Settled]]) -> Array:
    """Size (size,) of displacements, velocities and internal variables, each the same for all.

    Of a field the size of each state.
    """
    farthest = np.abs(starts).max(axis=0)
    for read in parts:
        found = read()
        settled = np.arange(found.points.shape[1]) < found.rows[:, None]
        farthest = np.maximum(farthest, np.abs(found.points[settled]).max(axis=0, initial=0.0))
    return _size(moving, farthest[np.newaxis])


def _size(moving: Moving, states: Array) -> Array:
    """Size (size,) of displacements, velocities and internal variables of states (N, size)."""
    size = np.abs(states).max(axis=0)
    if not isinstance(moving, ContactSystem):
        return np.where(size > 0.0, size, 1.0)
    m, scale = moving.basis.modes, np.ones(len(size))
    for part in (slice(0, m), slice(m, 2 * m), slice(2 * m, None)):
        scale[part] = size[part].max(initial=0.0) or 1.0
    return scale
