"""Poincare sections of runs over a parameter, swept up and down."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_choice
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.ensemble import strobe
from fecontact.integrate.solvers import RODAS5P, Solver
from fecontact.reduction.modal_basis import Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.forcing_period import forcing_period

Change = str | Callable[[ContactSystem, float], ContactSystem]



@dataclass(frozen=True, eq=False)
class PoincareScan:
    """States once per period of the excitation over a parameter.

    Attributes
    ----------
    system : ContactSystem
        The system before the parameter was changed.
    parameter : str
        Its name.
    values : (V,) array
        Its values, ascending.
    up, down : (V, K, size) arrays
        The last K states of each value, where it was approached from below and from above; NaN
        where a run could not go on. ``down`` is empty if that was not asked for.
    """

    system: ContactSystem
    parameter: str
    values: Array
    up: Array
    down: Array

    def observed(
        self, point: str | int = "B", component: Component = "y",
        of: Literal["displacement", "velocity"] = "displacement",
    ) -> tuple[Array, Array]:
        """A displacement [m], [rad] or velocity of a point, (V, K) up and down."""
        require_choice("PoincareScan", "of", of, ("displacement", "velocity"))
        basis = self.system.basis
        row = basis.point_row(point, component)
        first = 0 if of == "displacement" else basis.modes
        columns = slice(first, first + basis.modes)
        return self.up[..., columns] @ row, self.down[..., columns] @ row


def poincare_scan(
    system: ContactSystem,
    parameter: Change,
    values: ArrayLike,
    *,
    transient_periods: int = 200,
    keep: int = 100,
    initial: Any = "rest",
    down: bool = True,
    chains: int | None = None,
    solver: Solver = RODAS5P,
    rtol: float = 1e-5,
    workers: int | None = None,
    progress: bool | Callable[[int], None] | None = None,
) -> PoincareScan:
    """Move a parameter up and down in small steps and keep states once per period.

    The values are cut into chains that run side by side on all cores; within a chain each value
    starts where the one before it ended, so that coexisting motions show as a difference between
    up and down.

    Parameters
    ----------
    system : ContactSystem
        With an excitation of one period at every value.
    parameter : str or function
        Dotted name of a number of the system, ``"drive.angular_frequency"``, or a function that
        makes the system for a value, ``(system, value) -> system``.
    values : (V,) array
        Ascending.
    transient_periods, keep : int
        Periods that are not kept, and states that are, of each value.
    initial : any
        Start of the first value of each chain; see :func:`fecontact.ensemble`.
    down : bool
        Whether to go down again.
    chains : int, optional
        Number of chains each way; default eight a core, at least eight values long.
    solver, rtol, workers, progress
        As for :func:`fecontact.ensemble`.

    Raises
    ------
    InputError
        For values that do not ascend, or as :func:`fecontact.integrate.strobe`.
    """
    require_kind("poincare_scan", ContactSystem, system=system)
    try:
        points = np.array(values, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 1 or not len(points) or not np.isfinite(points).all() or (
            (np.diff(points) <= 0.0).any()):
        raise InputError("values must be finite numbers in ascending order.")
    if chains is not None and not (isinstance(chains, Integral) and chains >= 1):
        raise InputError(f"chains = {chains!r} must be a whole number from 1 on.")
    if isinstance(parameter, str):
        name, made = parameter, [system.with_(**{parameter: float(p)}) for p in points]
    else:
        if not callable(parameter):
            raise InputError(f"poincare_scan: parameter must be a text or a function, not "
                             f"{type(parameter).__name__}.")
        name = getattr(parameter, "__name__", "parameter")
        made = [parameter(system, float(p)) for p in points]
    for one in made:
        forcing_period(one)
    count = len(points)
    most = chains or min(8 * (os.cpu_count() or 1), max(count // 8, 1))
    length = -(-count // min(most, count))
    # All chains have the same length; where the values do not divide, the last ones are run twice.
    order = np.arange(length * -(-count // length))
    order = np.minimum(order, count - 1)
    both = [order] + ([count - 1 - order] if down else [])
    index = np.concatenate(both)
    found = strobe([made[k] for k in index], transient_periods=transient_periods, keep=keep,
                   initial=initial,
                   chain=length, solver=solver, rtol=rtol, workers=workers, progress=progress)
    states = np.empty((2, count, keep, system.size))
    for way, part in enumerate(both):
        states[way, part] = found.states[way * len(order) : (way + 1) * len(order)]
    return PoincareScan(system, name, points, states[0], states[1] if down else states[1, :0])
