"""Compiled normal laws of rough surfaces; s is the penetration divided by the roughness height.

Each has the parameters of the class in :mod:`fecontact.laws.normal.rough_surface` that bears its
name.
"""

import math

from fecontact.core.compiled import helper
from fecontact.laws.signatures import normal_law

_TAU = 2.0 * math.pi
_ROOT_HALF = math.sqrt(0.5)
_DENSITY = 1.0 / math.sqrt(_TAU)


@helper
def bed_of_asperities(v, p, compression, bearing, density):  # type: ignore[no-untyped-def]
    """F, dF/du, dF/dv from f(s), h = f' and h'; p begins with c, R_Z and beta c."""
    stiffness, height, damping = p[0], p[1], p[2]
    force = stiffness * height * compression + damping * bearing * v
    if force <= 0.0:
        return 0.0, 0.0, 0.0
    return force, stiffness * bearing + damping * density / height * v, damping * bearing


@normal_law
def uniform(u, v, p):  # type: ignore[no-untyped-def]
    """Density 1."""
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if s < 1.0:
        return bed_of_asperities(v, p, 0.5 * s * s, s, 1.0)
    return bed_of_asperities(v, p, s - 0.5, 1.0, 0.0)


@normal_law
def parabolic(u, v, p):  # type: ignore[no-untyped-def]
    """Density 6 s (1 - s)."""
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    compression, bearing, density = s - 0.5, 1.0, 0.0
    if s < 1.0:
        compression = s * s * s * (1.0 - 0.5 * s)
        bearing = s * s * (3.0 - 2.0 * s)
        density = 6.0 * s * (1.0 - s)
    return bed_of_asperities(v, p, compression, bearing, density)


@normal_law
def cosine(u, v, p):  # type: ignore[no-untyped-def]
    """Density 1 - cos(2 pi s)."""
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    compression, bearing, density = s - 0.5, 1.0, 0.0
    if s < 1.0:
        x = _TAU * s
        cosine = math.cos(x)
        density = 1.0 - cosine
        if x > 0.5:
            bearing = s - math.sin(x) / _TAU
            compression = 0.5 * s * s - density / (_TAU * _TAU)
        else:
            # The differences above would lose their digits.
            y = x * x
            density = 2.0 * math.sin(0.5 * x) ** 2
            bearing = x * y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (
                1.0 - y / 110.0)))) / _TAU
            compression = y * y / 24.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0 * (
                1.0 - y / 132.0)))) / (_TAU * _TAU)
    return bed_of_asperities(v, p, compression, bearing, density)


@normal_law
def gaussian(u, v, p):  # type: ignore[no-untyped-def]
    """Density of a normal distribution within 0 <= s <= 1."""
    deviation, highest, first_moment, norm = p[3], p[4], p[5], p[6]
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    compression, bearing, density = s - 0.5, 1.0, 0.0
    if s < 1.0:
        t = (s - 0.5) / deviation
        y, b = s / deviation, 0.5 / deviation
        normal = _DENSITY * math.exp(-0.5 * t * t)
        density = norm * normal / deviation
        if y * (b + 1.0) > 0.1:
            part = 0.5 * math.erfc(-_ROOT_HALF * t)
            bearing = norm * (part - highest)
            compression = norm * (deviation * (t * part + normal - first_moment) - s * highest)
        else:
            # The differences above would lose their digits: series in Hermite polynomials.
            scale = norm * _DENSITY * math.exp(-0.5 * b * b)
            before, hermite, term = 0.0, 1.0, y
            bearing, compression = 0.0, 0.0
            for n in range(10):
                bearing += hermite * term
                compression += hermite * term * y / (n + 2.0)
                before, hermite = hermite, b * hermite - n * before
                term *= y / (n + 2.0)
            bearing *= scale
            compression *= scale * deviation
    return bed_of_asperities(v, p, compression, bearing, density)
