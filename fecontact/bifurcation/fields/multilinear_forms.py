"""Multilinear forms: second to fifth directional derivatives, by differences of Jacobians."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Central differences of order eight and six, of the third and fourth derivative six and four:
# weights of f(h k) - f(-h k) for odd and of f(h k) + f(-h k) - 2 f(0) for even ones, k = 1..4.
_FIRST = (np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280]), np.array([3 / 4, -3 / 20, 1 / 60, 0.0]))
_SECOND = (np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560]), np.array([3 / 2, -3 / 20, 1 / 90, 0.0]))
_THIRD = (np.array([-61 / 30, 169 / 120, -3 / 10, 7 / 240]), np.array([-13 / 8, 1.0, -1 / 8, 0.0]))
_FOURTH = (np.array([-122 / 15, 169 / 60, -2 / 5, 7 / 240]), np.array([-13 / 2, 2.0, -1 / 6, 0.0]))


# Trial steps, in units of the scales of the states.
_STEPS = 3.0 ** np.arange(3.0, -19.0, -1.0)
# Relative difference of both orders up to which the step with the best agreement is taken.
_AGREEMENT = 1e-3
_EPS = 2.2e-16


@dataclass(frozen=True)
class Bend:
    """Derivatives of the Jacobian along a direction e.

    Attributes
    ----------
    first : (d, d + a) array
        d/ds of [df/dx, df/dp] at x + s e: ``first @ y`` is the bilinear form B(e, y).
    second : (d, d + a) array
        d^2/ds^2 of the same: ``second @ y`` is the trilinear form C(e, e, y).
    higher : tuple of arrays
        Third and fourth derivative, where they were asked for: D(e, e, e, y), E(e, e, e, e, y).
    """

    first: Array
    second: Array
    higher: tuple[Array, ...] = ()


def bend(
    field: VectorField, x: Array, values: Array, direction: Array, scales: Array,
    active: tuple[int, ...] = (), shift: Array | None = None, *, every: int = 1,
    higher: bool = False,
) -> tuple[Bend, Bend]:
    """Derivatives of the Jacobian at x along a direction (d,), by formulas of order eight and six.

    Steps from 27 scales of the states down to 1e-9 of them are tried, and the one is taken at
    which both formulas agree best, to rounding; entries count in the scales of the states.
    ``shift`` (k,) moves the parameter values along with the states. ``every`` leaves steps out, for
    derivatives that need not be the best. Third and fourth derivatives, for ``higher``, are of
    order six and four.
    """
    size = float(np.linalg.norm(direction / scales))
    if shift is not None:
        size = max(size, float(np.abs(shift).max()))
    if size == 0.0:
        zero = np.zeros((field.dimension, field.dimension + len(active)))
        nothing = Bend(zero, zero, (zero, zero))
        return nothing, nothing
    h = _STEPS[::every] / size
    offsets = h[:, None] * np.arange(-4.0, 5.0)
    A = _jacobians(field, x, values, direction, offsets.ravel(), active, shift)
    A = A.reshape(len(h), 9, field.dimension, -1)
    odd = A[:, 5:] - A[:, 3::-1]
    even = A[:, 5:] + A[:, 3::-1] - 2.0 * A[:, 4:5]
    balance = np.append(scales, np.ones(len(active))) / scales[:, None]
    # Of the rows: entries may be what cancellation leaves.
    rounding = _EPS * (np.abs(A) * balance).max(axis=(1, 3))[:, :, None]
    wanted = [(odd, _FIRST), (even, _SECOND)] + [(odd, _THIRD), (even, _FOURTH)] * higher
    found = [_best(parts, weights, h**order, balance, rounding)
             for order, (parts, weights) in enumerate(wanted, start=1)]
    (first, coarse_first), (second, coarse_second), *rest = found
    return (Bend(first, second, tuple(fine for fine, _ in rest)),
            Bend(coarse_first, coarse_second, tuple(coarse for _, coarse in rest)))


def _jacobians(
    field: VectorField, x: Array, values: Array, direction: Array, offsets: Array,
    active: tuple[int, ...], shift: Array | None,
) -> Array:
    """[df/dx, df/dp] (N, d, d + a) at x + offset e."""
    places = x + offsets[:, None] * direction
    if shift is None or not shift.any():
        _, J, P = field.derivatives(np.zeros(len(places)), places, values, active)
        return np.concatenate([J, P], axis=2)
    found = []
    for place, offset in zip(places, offsets.tolist(), strict=True):
        try:
            _, J, P = field.derivatives(np.zeros(1), place[None], values + offset * shift, active)
            found.append(np.concatenate([J, P], axis=2))
        except InputError:  # out of the range of a parameter: this step is not taken
            found.append(np.full((1, field.dimension, field.dimension + len(active)), np.nan))
    return np.concatenate(found)


def _best(
    parts: Array, weights: tuple[Array, Array], power: Array, balance: Array, rounding: Array
) -> tuple[Array, Array]:
    fine, coarse = (np.einsum("k,skij->sij", w, parts) / power[:, None, None] for w in weights)
    with np.errstate(invalid="ignore", over="ignore"):
        error = (np.abs((fine - coarse) * balance) + rounding / power[:, None, None]).max(
            axis=(1, 2))
        size = np.abs(fine * balance).max(axis=(1, 2))
    error[~np.isfinite(error)] = np.inf
    relative = np.where(size > 0.0, error / np.where(size > 0.0, size, 1.0), np.inf)
    at = int(np.argmin(relative)) if relative.min() < _AGREEMENT else int(np.argmin(error))
    return fine[at], coarse[at]
