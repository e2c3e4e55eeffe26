"""A part of a run."""

from dataclasses import replace
from numbers import Real

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.integrate.trajectory import Trajectory


def window(
    trajectory: Trajectory, start: float | None = None, end: float | None = None
) -> Trajectory:
    """The output times of a run from ``start`` to ``end``, both included where they are times.

    Work and losses count from the first of them, as in a run that began there.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    start, end : float, optional
        [s]; the ends of the run by default.

    Raises
    ------
    InputError
        If there are fewer than two output times between them.
    """
    require_kind("window", Trajectory, trajectory=trajectory)
    t = trajectory.time
    for name, value in (("start", start), ("end", end)):
        if value is not None and not (isinstance(value, Real) and value == value):
            raise InputError(f"{name} = {value!r} must be a time of the run.")
    first = float(t[0]) if start is None else float(start)
    last = float(t[-1]) if end is None else float(end)
    rounding = 1e-12 * max(abs(float(t[0])), abs(float(t[-1])))
    chosen = slice(int(np.searchsorted(t, first - rounding, side="left")),
                   int(np.searchsorted(t, last + rounding, side="right")))
    if chosen.stop - chosen.start < 2:
        raise InputError(f"There are fewer than two output times from start = {first:g} s to end = "
                         f"{last:g} s; the run goes from {t[0]:g} s to {t[-1]:g} s.")
    begin = chosen.start

    def cut(name: str) -> np.ndarray | None:
        values = getattr(trajectory, name)
        return None if values is None else values[chosen]

    kept = {name: cut(name) for name in ("time", "modal_coordinates", "modal_velocities", "memory",
                                         "held_normal_force", "held_friction_force")}
    friction = trajectory.node_friction_work
    return replace(
        trajectory, work=trajectory.work[chosen] - trajectory.work[begin],
        node_friction_work=None if friction is None else friction[chosen] - friction[begin],
        **kept)  # type: ignore[arg-type]
