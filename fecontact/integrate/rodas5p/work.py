"""Work of the powers along a step, by quadrature over its dense output."""

import numpy as np

from fecontact.core.compiled import helper
from fecontact.integrate.rodas5p import tableau
from fecontact.system.contact_energy import powers

# Gauss-Lobatto points: both ends and two inside; exact for powers of degree five.
_INSIDE = 0.5 - 0.5 / np.sqrt(5.0)
_POINTS = np.array([0.0, _INSIDE, 1.0 - _INSIDE, 1.0])


def _lagrange_integral(k: int) -> np.ndarray:
    """Coefficients of s ... s^4 in the integral from 0 to s of the k-th Lagrange polynomial."""
    others = np.delete(_POINTS, k)
    polynomial = np.polynomial.polynomial.polyfromroots(others) / np.prod(_POINTS[k] - others)
    return np.polynomial.polynomial.polyint(polynomial)[1:]


_INTEGRALS = np.array([_lagrange_integral(k) for k in range(4)])


def _third_difference() -> np.ndarray:
    """Weights of the integral of the cubic through four powers less that of a parabola."""
    divided = np.array([1.0 / np.prod(_POINTS[k] - np.delete(_POINTS, k)) for k in range(4)])
    left = np.polynomial.polynomial.polyint(
        np.polynomial.polynomial.polyfromroots([0.0, _INSIDE, 1.0]))
    return divided * float(np.abs(np.polynomial.polynomial.polyval(1.0, left)))


_DIFFERENCE = _third_difference()


@helper
def work_error(h, power):  # type: ignore[no-untyped-def]
    """Estimated error of the work of the system's powers in a step, the largest of them [J]."""
    largest = 0.0
    for k in range(8):
        difference = 0.0
        for point in range(4):
            difference += _DIFFERENCE[point] * power[point, k]
        largest = max(largest, abs(difference))
    return h * largest


@helper
def add_up(t, h, latest, s, progress, room):  # type: ignore[no-untyped-def]
    """Fill ``room.power`` with the powers at the points of a step."""
    for k in range(len(progress.power)):
        room.power[0, k] = progress.power[k]
    for point in range(1, 4):
        if point < 3:
            tableau.interpolated(_POINTS[point], progress.state, room.after, room.dense, room.right)
            state = room.right
        else:
            state = room.after
        powers(min(t + _POINTS[point] * h, latest), state, s, room.power[point, :8],
               room.power[point, 8:])


@helper
def work_until(part, h, before, power, out):  # type: ignore[no-untyped-def]
    """Out = work ``before`` the step and in its part, by the cubic through the powers."""
    w0, w1, w2, w3 = _weight(0, part), _weight(1, part), _weight(2, part), _weight(3, part)
    for k in range(len(out)):
        out[k] = before[k] + h * (w0 * power[0, k] + w1 * power[1, k] + w2 * power[2, k]
                                  + w3 * power[3, k])


@helper
def _weight(k, part):  # type: ignore[no-untyped-def]
    c = _INTEGRALS[k]
    return part * (c[0] + part * (c[1] + part * (c[2] + part * c[3])))
