"""Compiled friction laws with one internal variable.

Each has the parameters of the class in :mod:`fecontact.laws.friction.bristle` that bears its name.
"""

import math

from fecontact.core.compiled import helper
from fecontact.laws.signatures import memory_friction_law

# Time constant [s] with which internal variables vanish without normal force.
_FADING = 1e-7


@helper
def _fade(z, rates):  # type: ignore[no-untyped-def]
    """The rate of one internal variable without normal force, when nothing drives it."""
    rates[0, 0] = -z[0] / _FADING
    rates[0, 1] = 0.0
    rates[0, 2] = 0.0
    rates[0, 3] = -1.0 / _FADING


@memory_friction_law
def dahl(v, F, z, p, force, rates):  # type: ignore[no-untyped-def]
    """R = F sigma z."""
    mu, stiffness, exponent = p[0], p[1], p[2]
    force[0] = F * stiffness * z[0]
    force[1] = 0.0
    force[2] = stiffness * z[0]
    force[3] = F * stiffness
    if F <= 0.0:
        _fade(z, rates)
        return
    sign = 1.0 if v >= 0.0 else -1.0
    left = 1.0 - sign * stiffness * z[0] / mu
    power = abs(left) ** (exponent - 1.0)
    rates[0, 0] = v * power * left
    rates[0, 1] = power * left
    rates[0, 2] = 0.0
    rates[0, 3] = -abs(v) * exponent * power * stiffness / mu


@memory_friction_law
def lugre(v, F, z, p, force, rates):  # type: ignore[no-untyped-def]
    """R = F [sigma_0 z + sigma_1(v) z' + sigma_2 v]."""
    static, kinetic, stribeck, exponent = p[0], p[1], p[2], p[3]
    stiffness, damping, viscous, decay = p[4], p[5], p[6], p[7]
    speed = abs(v)
    sign = 1.0 if v >= 0.0 else -1.0
    x = (speed / stribeck) ** exponent
    excess = (static - kinetic) * math.exp(-x)
    g = kinetic + excess
    u = stiffness * z[0] / g
    # |v| g' / g: finite at rest for every exponent.
    fall = -exponent * x * excess / g
    rate = v - speed * u
    rate_v = 1.0 - sign * u * (1.0 - fall)
    rate_z = -speed * stiffness / g
    fade = damping * math.exp(-((decay * v) ** 2))
    ratio = stiffness * z[0] + fade * rate + viscous * v
    force[0] = F * ratio
    force[1] = F * (fade * (rate_v - 2.0 * decay * decay * v * rate) + viscous)
    force[2] = ratio
    force[3] = F * (stiffness + fade * rate_z)
    if F <= 0.0:
        _fade(z, rates)
        return
    rates[0, 0] = rate
    rates[0, 1] = rate_v
    rates[0, 2] = 0.0
    rates[0, 3] = rate_z


@memory_friction_law
def bouc_wen(v, F, z, p, force, rates):  # type: ignore[no-untyped-def]
    """R = mu F z."""
    mu, yielding, beta, exponent = p[0], p[1], p[2], p[3]
    force[0] = mu * F * z[0]
    force[1] = 0.0
    force[2] = mu * z[0]
    force[3] = mu * F
    if F <= 0.0:
        _fade(z, rates)
        return
    size = abs(z[0])
    pull = 1.0 if v * z[0] >= 0.0 else -1.0
    share = beta * pull + 1.0 - beta
    power = size ** (exponent - 1.0)
    rates[0, 0] = v * (1.0 - share * power * size) / yielding
    rates[0, 1] = (1.0 - share * power * size) / yielding
    rates[0, 2] = 0.0
    side = 1.0 if z[0] >= 0.0 else -1.0
    rates[0, 3] = -v * share * exponent * power * side / yielding
