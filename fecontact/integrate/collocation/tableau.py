r"""Collocation at Radau points: a step of order nine from five stages, for equations q'' = f.

The acceleration over a step is the polynomial through its values at the points c_i, which obey

.. math::

    a_i = f(t + c_i h, q_i, v_i), \qquad v_i = v + h \sum_l A_{il} a_l, \qquad
    q_i = q + c_i h v + h^2 \sum_l (A^2)_{il} a_l

It is Radau IIA, which is L-stable. Within the step, velocities and displacements are integrals of
the polynomial through the acceleration at the begin too.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

import numpy as np
from numpy.polynomial import Polynomial, legendre

from fecontact.core.types import Array
from fecontact.integrate import bernstein

STAGES = 5
ORDER = 2 * STAGES - 1
# Powers of x = 2 s - 1, s the part of the step, of accelerations, velocities and displacements.
RATE_TERMS, SPEED_TERMS, PLACE_TERMS = STAGES + 1, STAGES + 2, STAGES + 3
# The error of a velocity over a step is proportional to this power of its length.
ERROR_POWER = STAGES + 2
# Places within a step at which the equations are examined.
LOOKS = 2


def radau_points(stages: int) -> Array:
    """Zeros (s,) in (0, 1] of P_s - P_(s-1), with Legendre's polynomials of 2 t - 1."""
    series = np.zeros(stages + 1)
    series[stages - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(series).real)
    for _ in range(3):
        x = x - legendre.legval(x, series) / legendre.legval(x, legendre.legder(series))
    x[-1] = 1.0
    return np.asarray(0.5 * (x + 1.0))


def integrals(points: Array) -> Array:
    """Integrals (s, s) from 0 to each of the points of their Lagrange polynomials."""
    columns = []
    for k in range(len(points)):
        others = np.delete(points, k)
        whole = (Polynomial.fromroots(others) / np.prod(points[k] - others)).integ()
        columns.append(whole(points))
    return np.ascontiguousarray(np.array(columns).T)


POINTS = radau_points(STAGES)
ONCE = integrals(POINTS)
TWICE = np.ascontiguousarray(ONCE @ ONCE)

# The begin of the step, and the points of its stages.
_ALL = np.concatenate([[0.0], POINTS])
_POLYNOMIAL = Polynomial.fromroots(_ALL)
_EXTREMES = np.sort(_POLYNOMIAL.deriv().roots().real)
# Where the polynomial through these values is far from other functions through them.
PLACES = np.array([_EXTREMES[STAGES // 3], _EXTREMES[2 * STAGES // 3]])


def _largest_errors() -> tuple[Array, Array]:
    """Largest errors of velocity and displacement in a step of length 1 for a unit defect there.

    A defect is that of a polynomial of one degree more, zero at the begin and at the stages.
    """
    s = np.linspace(0.0, 1.0, 2001)
    once = _POLYNOMIAL.integ()
    defect = np.abs(_POLYNOMIAL(PLACES))
    return np.abs(once(s)).max() / defect, np.abs(once.integ()(s)).max() / defect


SPEED_PART, PLACE_PART = _largest_errors()


def _powers() -> tuple[Array, Array, Array]:
    """Matrices from accelerations at the begin and the stages to coefficients of powers of x.

    Of the acceleration, and of its first and second integral over a step of length 1.
    """
    to_legendre = np.linalg.inv(legendre.legvander(2.0 * _ALL - 1.0, STAGES))
    tables = []
    for times, terms in enumerate((RATE_TERMS, SPEED_TERMS, PLACE_TERMS)):
        columns = [legendre.leg2poly(0.5**times * legendre.legint(one, times, lbnd=-1.0))
                   for one in np.eye(RATE_TERMS)]
        filled = np.array([np.pad(column, (0, terms - len(column))) for column in columns]).T
        tables.append(np.ascontiguousarray(filled @ to_legendre))
    return tables[0], tables[1], tables[2]


RATE_POWERS, SPEED_POWERS, PLACE_POWERS = _powers()
# From accelerations to those at the places.
AT_PLACES = np.ascontiguousarray(np.vander(2.0 * PLACES - 1.0, RATE_TERMS, True) @ RATE_POWERS)
# To the changes of velocities and displacements there, but for the velocity at the begin.
SPEEDS_AT, PLACES_AT = (
    np.ascontiguousarray(np.vander(2.0 * PLACES - 1.0, len(table), True) @ table)
    for table in (SPEED_POWERS, PLACE_POWERS))


def _to_bernstein() -> Array:
    s = np.linspace(0.0, 1.0, PLACE_TERMS)
    matrix = bernstein.fit(s)
    return np.ascontiguousarray(matrix @ np.vander(2.0 * s - 1.0, PLACE_TERMS, True))


# From powers of x to Bernstein coefficients over the step.
TO_BERNSTEIN = _to_bernstein()
