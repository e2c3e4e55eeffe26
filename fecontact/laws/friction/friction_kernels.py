"""Compiled friction laws without memory.

Each has the parameters of the class in :mod:`fecontact.laws.friction.stribeck` that bears its name.
"""

import math

from fecontact.core.compiled import helper
from fecontact.laws.signatures import friction_law


@helper
def _smoothed_sign(v, slope, smoothing):  # type: ignore[no-untyped-def]
    """s(v) and s'(v); the smoothing is its index among the choices."""
    rise = 2.0 / math.pi * slope
    if smoothing == 0.0:
        x = slope * v
        return 2.0 / math.pi * math.atan(x), rise / (1.0 + x * x)
    x = rise * v
    if smoothing == 1.0:
        s = math.tanh(x)
        return s, rise * (1.0 - s) * (1.0 + s)
    root = 1.0 / math.sqrt(1.0 + x * x)
    return x * root, rise * root * root * root


@helper
def _force(v, F, coefficient, change, viscous, slope, smoothing):  # type: ignore[no-untyped-def]
    """R, dR/dv, dR/dF from mu and its derivative ``change`` to the speed."""
    s, rate = _smoothed_sign(v, slope, smoothing)
    sign = 1.0 if v >= 0.0 else -1.0
    ratio = coefficient * s + viscous * v
    return ratio * F, (coefficient * rate + sign * change * s + viscous) * F, ratio


@friction_law
def exponential(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu_inf + (mu_0 - mu_inf) exp(-lambda |v|)."""
    static, kinetic, decay = p[0], p[1], p[2]
    excess = (static - kinetic) * math.exp(-decay * abs(v))
    return _force(v, F, kinetic + excess, -decay * excess, p[4], p[3], p[5])


@friction_law
def gaussian(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu_inf + (mu_0 - mu_inf) exp(-(v/v_s)^2)."""
    static, kinetic, stribeck = p[0], p[1], p[2]
    x = abs(v) / stribeck
    excess = (static - kinetic) * math.exp(-x * x)
    return _force(v, F, kinetic + excess, -2.0 * x / stribeck * excess, p[4], p[3], p[5])


@friction_law
def hyperbolic(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu_inf + (mu_0 - mu_inf) / (1 + |v|/v_s)."""
    static, kinetic, stribeck = p[0], p[1], p[2]
    ratio = stribeck / (stribeck + abs(v))
    excess = (static - kinetic) * ratio
    return _force(v, F, kinetic + excess, -excess * ratio / stribeck, p[4], p[3], p[5])


@friction_law
def constant(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu."""
    return _force(v, F, p[0], 0.0, p[2], p[1], p[3])


@friction_law
def galvanetto(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu_k + (mu_s - mu_k) / (1 + gamma |v|) + eta v^2."""
    static, kinetic, decay, growth = p[0], p[1], p[2], p[3]
    speed = abs(v)
    ratio = 1.0 / (1.0 + decay * speed)
    excess = (static - kinetic) * ratio
    return _force(v, F, kinetic + excess + growth * speed * speed,
                  2.0 * growth * speed - decay * ratio * excess, 0.0, p[4], p[5])


@friction_law
def cubic(v, F, p):  # type: ignore[no-untyped-def]
    """Coefficient mu_s - 3/2 (mu_s - mu_m) (x - x^3/3) with x = |v|/v_m."""
    static, least, velocity = p[0], p[1], p[2]
    x = abs(v) / velocity
    depth = 1.5 * (static - least)
    return _force(v, F, static - depth * x * (1.0 - x * x / 3.0),
                  -depth * (1.0 - x * x) / velocity, 0.0, p[3], p[4])


@friction_law
def product(v, F, p):  # type: ignore[no-untyped-def]
    """R/F a_1 (1 + a_2 exp(-b_1 |v|)) arctan(b_2 v)."""
    factor, excess, decay, slope = p[0], p[1], p[2], p[3]
    fall = excess * math.exp(-decay * abs(v))
    sign = 1.0 if v >= 0.0 else -1.0
    x = slope * v
    bend = math.atan(x)
    ratio = factor * (1.0 + fall) * bend
    rate = factor * ((1.0 + fall) * slope / (1.0 + x * x) - sign * decay * fall * bend)
    return ratio * F, rate * F, ratio
