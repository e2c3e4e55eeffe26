"""Basins of attraction on a plane of initial states."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.integrate.ensemble import ensemble, strobe
from fecontact.integrate.events import Crossing, quantity_row, require_quantity
from fecontact.integrate.solvers import RODAS5P, Solver
from fecontact.reduction.modal_basis import Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import Moving, in_time, state_size

# Looks at the second half of a run, in parts of the first.
_LATE = (1.0 + 0.5 / np.sqrt(3.0), 1.0 + 1.0 / np.sqrt(2.0))


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
        Which of them [m], [rad], [m/s], [rad/s]; not for a vector field.

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


@dataclass(frozen=True, eq=False)
class Attractor:
    """A motion that others settle on.

    Attributes
    ----------
    kind : 'equilibrium', 'periodic' or 'aperiodic'
        The last where its section has more points than were kept, or none that repeat.
    points : (k, size) array
        States on its section, each once; its place for an equilibrium.
    share : float
        Part of the starts that lead to it.
    """

    kind: Literal["equilibrium", "periodic", "aperiodic"]
    points: Array
    share: float


@dataclass(frozen=True, eq=False)
class Basins:
    """Which attractor each start leads to.

    Attributes
    ----------
    first, second : (a,), (b,) arrays
        Values along the two axes of the plane.
    label : (a, b) array
        Index into ``attractors``; -1 where a run could not go on or had not settled.
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
    solver: Solver = RODAS5P,
    rtol: float = 1e-6,
    workers: int | None = None,
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
        States on the section that are looked at, at least 4.
    section : Crossing, optional
        Poincare section of a system that is not excited; motions that do not meet it in the last
        half of the run, or keep one place there, are equilibria.
    tolerance : float
        States that differ by less are the same, in parts of the largest modal displacement, and
        velocity, of all starts and sections; of a field each state in parts of its largest.
    solver, rtol, workers, progress
        As for :func:`fecontact.ensemble`.

    Raises
    ------
    InputError
        For values out of range, for two quantities that no state has independently, and as
        :func:`fecontact.ensemble`.
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
    wanted = np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2)
    states = start + (wanted - rows @ start) @ np.linalg.pinv(rows).T
    settings: dict[str, Any] = {"initial": states, "solver": solver, "rtol": rtol,
                                "workers": workers, "progress": progress}
    if section is None:
        if transient_periods is None or transient is not None:
            raise InputError("basins: without a section give transient_periods, the periods of "
                             "the excitation before states count, and no transient.")
        found = strobe(moving, transient_periods=transient_periods, keep=keep, **settings)
        sets: list[Array | None] = [
            points if fine else None
            for points, fine in zip(found.states, found.finished, strict=True)]
        still = [False] * len(sets)
    else:
        if transient_periods is not None or not (
                isinstance(transient, Real) and 0.0 < transient < np.inf):
            raise InputError(f"basins: transient = {transient!r} must be a time above zero [s] "
                             f"before passages of the section count, without "
                             f"transient_periods.")
        # At times without a common measure: no motion is at one place at all of them.
        late = float(transient) * np.array([0.0, 1.0, *_LATE, 2.0])
        found = ensemble(moving, late, events=section, **settings)
        sets, still, farthest = [], [], np.abs(states).max(axis=0)[np.newaxis]
        for events, ends, fine in zip(found.events or (), found.states, found.finished,
                                      strict=True):
            passed = events.states[events.time > transient][-keep:]
            kept = np.vstack([ends[1:], passed])
            still.append(len(passed) == 0 or bool(
                (np.ptp(kept, axis=0) < tolerance * _scale(moving, farthest, [kept])).all()))
            sets.append(None if not fine else ends[-1:] if still[-1] else passed)
    labels, attractors = _told_apart(sets, still, _scale(moving, states, sets), tolerance)
    return Basins(a, b, labels.reshape(len(a), len(b)), attractors)


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


def _scale(moving: Moving, starts: Array, sets: list[Array | None]) -> Array:
    """Size (size,) of displacements, velocities and internal variables, each the same for all.

    Of a field the size of each state.
    """
    size = np.abs(np.vstack([starts, *(points for points in sets if points is not None)])).max(
        axis=0)
    if not isinstance(moving, ContactSystem):
        return np.where(size > 0.0, size, 1.0)
    m, scale = moving.basis.modes, np.ones(len(size))
    for part in (slice(0, m), slice(m, 2 * m), slice(2 * m, None)):
        scale[part] = size[part].max(initial=0.0) or 1.0
    return scale


def _told_apart(
    sets: list[Array | None], still: list[bool], scale: Array, tolerance: float
) -> tuple[Integers, tuple[Attractor, ...]]:
    """Label of each set of points, and the attractors by frequency."""
    labels = np.full(len(sets), -1)
    kinds: list[Literal["equilibrium", "periodic", "aperiodic"]] = []
    prototypes: list[Array] = []
    for index, points in enumerate(sets):
        if points is None:
            continue
        period = None if still[index] else _period(points / scale, tolerance)
        kind: Literal["equilibrium", "periodic", "aperiodic"] = (
            "equilibrium" if still[index] else "aperiodic" if period is None else "periodic")
        own = points[-(period or len(points)) :]
        for label, (other, prototype) in enumerate(zip(kinds, prototypes, strict=True)):
            if other == kind and _same(own / scale, prototype / scale, kind, tolerance):
                labels[index] = label
                break
        else:
            labels[index] = len(kinds)
            kinds.append(kind)
            prototypes.append(own)
    counts = np.bincount(labels[labels >= 0], minlength=len(kinds))
    order = np.argsort(-counts, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    labels[labels >= 0] = rank[labels[labels >= 0]]
    return labels, tuple(Attractor(kinds[k], prototypes[k], counts[k] / len(sets)) for k in order)


def _period(points: Array, tolerance: float) -> int | None:
    """Number of points after which they repeat, or None if they do not."""
    for period in range(1, len(points) // 2 + 1):
        if np.abs(points[period:] - points[:-period]).max() < tolerance:
            return period
    return None


def _same(one: Array, other: Array, kind: str, tolerance: float) -> bool:
    """Whether two motions are the same: every point of each near one of the other.

    Aperiodic ones by the box that they fill, to a fifth of its size.
    """
    if kind == "aperiodic":
        size = np.maximum(np.ptp(one, axis=0), np.ptp(other, axis=0))
        low = np.abs(one.min(axis=0) - other.min(axis=0))
        high = np.abs(one.max(axis=0) - other.max(axis=0))
        return bool((np.maximum(low, high) <= 0.2 * size + tolerance).all())
    distance = np.abs(one[:, None] - other[None]).max(axis=2)
    return bool(max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 2.0 * tolerance)
