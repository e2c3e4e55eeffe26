"""Vector fields whose periodic orbits the tests follow."""

import math

import numpy as np
from numba import njit

from fecontact.bifurcation import vector_field


def lorenz(t, x, p, out):
    out[0] = p[1] * (x[1] - x[0])
    out[1] = x[0] * (p[0] - x[2]) - x[1]
    out[2] = x[0] * x[1] - p[2] * x[2]


def lorenz_field():
    return vector_field(lorenz, {"rho": 280.0, "sigma": 10.0, "b": 8.0 / 3.0}, 3)


@njit
def friction(v):
    return 0.14 * (1.0 + 1.14 * math.exp(-2.0 * abs(v))) * math.atan(100.0 * v)


@njit
def friction_slope(v):
    fall = 1.14 * math.exp(-2.0 * abs(v))
    sign = 1.0 if v >= 0.0 else -1.0
    return 0.14 * (-2.0 * sign * fall * math.atan(100.0 * v)
                   + (1.0 + fall) * 100.0 / (1.0 + 1e4 * v * v))


def two_masses(t, x, p, out):
    B, v, D = p[0], p[1], p[2]
    rest = friction(-v)
    out[0] = x[1]
    out[1] = (-3.0 * x[0] - 4.0 * D * x[1] + x[2] + 2.0 * D * x[3]
              + B * (rest - friction(x[1] - v))) / 2.5
    out[2] = x[3]
    out[3] = (x[0] + 2.0 * D * x[1] - x[2] - 2.0 * D * x[3] + B * (rest - friction(x[3] - v)))


def two_masses_jacobian(t, x, p, out):
    B, v, D = p[0], p[1], p[2]
    out[:] = 0.0
    out[0, 1], out[2, 3] = 1.0, 1.0
    out[1, 0], out[1, 2], out[1, 3] = -3.0 / 2.5, 1.0 / 2.5, 2.0 * D / 2.5
    out[1, 1] = (-4.0 * D - B * friction_slope(x[1] - v)) / 2.5
    out[3, 0], out[3, 1], out[3, 2] = 1.0, 2.0 * D, -1.0
    out[3, 3] = -2.0 * D - B * friction_slope(x[3] - v)


def two_masses_field(**changes):
    return vector_field(two_masses, {"B": 1.0, "v0": 1.0, "D": 0.1} | changes, 4,
                        jacobian=two_masses_jacobian)


def settled(field, end, start, period, values=None):
    """Samples of the last two and a half periods of a motion by an independent integrator."""
    from scipy.integrate import solve_ivp

    values, zero = field.values if values is None else values, np.zeros(1)
    run = solve_ivp(lambda t, x: field.rates(zero + t, x[None], values)[0], (0.0, end), start,
                    method="LSODA", rtol=1e-8, atol=1e-10, dense_output=True)
    t = np.linspace(end - 2.5 * period, end, 4000)
    return t, run.sol(t).T
