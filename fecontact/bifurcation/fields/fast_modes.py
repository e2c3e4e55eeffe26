"""Fast modes whose multipliers the intervals of an orbit do not resolve."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.linalg.motion_transitions import integrals
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

Grid: TypeAlias = Callable[[BranchPoint], tuple[Array, Array]]

# Times among which Jacobians are averaged, and the error of a modulus that is worth a note.
_SAMPLES, _MOST = 64, 0.02


def unresolved_modes(field: VectorField, points: Sequence[BranchPoint], grid: Grid,
                     remedy: str) -> str:
    """Note on multipliers of modes that are too fast for the intervals, if any.

    Collocation takes a mode of eigenvalue s over an interval h by its stability function R(h s).
    For Gauss points |R| approaches one beyond h |s| = 3, where |exp(h s)| may be small: the modulus
    of the multiplier is then too large, but on the right side of one. The error is estimated with
    the eigenvalues of the mean Jacobian along the orbit, at the ends and in the middle of a branch.
    Modes that hardly vibrate are left out: friction that sticks at times damps them in parts of the
    orbit only, of which the mean says nothing.

    Parameters
    ----------
    field, points
        Field and points of the branch.
    grid : function
        Widths (N,) of the intervals of a point, in periods, and points (s,) in each.
    remedy : str
        What gives more intervals.
    """
    chosen = sorted({0, len(points) // 2, len(points) - 1}) if points else []
    worst, place = max(((_error(field, points[k], *grid(points[k])), points[k].parameter)
                        for k in chosen), default=(0.0, 0.0))
    if not worst > _MOST:
        return ""
    return (f"Multipliers of fast modes are not resolved: near the parameter {place:.6g} the "
            f"modulus of one is too large by some {worst:.1g}, on the right side of one. For its "
            f"value {remedy}, or follow the orbits with method = Shooting().")


def _error(field: VectorField, point: BranchPoint, widths: Array, points: Array) -> float:
    """Largest excess of the modulus of a multiplier."""
    motion = point.orbit(field, samples=_SAMPLES)
    x = np.ascontiguousarray(motion.states)
    J = field.derivatives(np.ascontiguousarray(motion.times), x, point.parameter_values(field))[1]
    if not np.isfinite(J).all():
        return 0.0
    s = np.linalg.eigvals(J.mean(axis=0)) * (motion.times[-1] - motion.times[0])
    s = s[np.abs(s.imag) > np.abs(s.real)]
    with np.errstate(all="ignore"):
        excess = np.abs(np.prod(_stability_function(np.outer(widths, s), points), axis=0)) - np.abs(
            np.exp(s))
    return float(np.nanmax(excess, initial=0.0))


def _stability_function(z: Array, points: Array) -> Array:
    """R(z) of collocation at the points."""
    A, b = integrals(tuple(points.tolist()))
    stages = np.linalg.solve(np.eye(len(b)) - z[..., None, None] * A, np.ones((len(b), 1)))
    return np.asarray(1.0 + z * (stages[..., 0] @ b))
