"""Errors of the default integrator on random systems against an independent reference.

One to three modes, one or two contact nodes, in the plane and in space; each normal law with each
friction law in turn; ground that rests, creeps, slides or is wavy; start at a random place. The
equations of the reference are written here in plain Python from the formulas of the documentation,
and integrated by DOP853 at a tolerance of 1e-12, with steps that end where slip of an elastic
Coulomb element ends. Seeds are fixed: system NUMBER is always the same.

An error is the largest difference of a modal displacement from the reference, over the range of
that mode, at 201 output times. Listed besides: the difference between runs of two lengths, between
runs with many and few outputs, and the growth of a change of the start, by which errors grow too.

Usage: python benchmarks/random_systems.py [--quick] [--rtol R] [NUMBER ...]
"""

import argparse
import math
import sys
import time
import warnings
from dataclasses import dataclass
from functools import cache
from typing import Any

import numba
import numpy as np
from scipy.integrate import DOP853
from scipy.interpolate import PchipInterpolator

import fecontact as fc
from fecontact import laws
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Status
from fecontact.laws.registry import law_names

COUNT, QUICK = 300, 10
OUTPUTS = 201
# A change of the start, over the range of the motion, whose growth is measured.
CHANGE = 1e-7
# Largest penetration at the start, over that in which the normal law rises.
DEEPEST = 5.0
# Steps after which the reference gives up.
MOST_STEPS = 20_000_000
# The contact element is two other laws, and rigid stops need solvers of their own; a table of
# asperities is interpolated as the measured surface, parallel sliders have the kernel of Iwan's.
NORMAL = [name for name in law_names()[laws.NormalLaw]
          if name not in ("friction-contact-3d", "rigid-stop", "asperity")]
FRICTION = [name for name in law_names()[laws.FrictionLaw] if name != "parallel-sliders"]
# Time constant of memory that fades without force [s].
FADING = 1e-7
# Parts of a step at which excesses over limits are compared, parts of the largest deflection that
# an excess may fall unnoticed; shortest step that is divided, and longest step, over the time of
# the run.
LOOKS, FALL, SHORTEST, LONGEST = 8, 1e-13, 1e-13, 5e-5

(UNIFORM, PARABOLIC, COSINE, GAUSSIAN, MEASURED, LINEAR, POWER, EXPONENTIAL, GREENWOOD, STOP,
 PRESCRIBED, CUBIC, PLAY, PIECEWISE, POLYNOMIAL) = range(15)
(EXP, GAUSS, HYPERBOLIC, CONSTANT, GALVANETTO, CUBIC_FALL, PRODUCT, MAXWELL, DAHL, LUGRE,
 BOUC_WEN) = range(11)


# The equations.

@numba.njit(cache=True)
def bed(kind, s, p, knots, curve):
    """f(s) and h(s) of a bed of asperities, 0 < s < 1."""
    if kind == UNIFORM:
        return 0.5 * s * s, s
    if kind == PARABOLIC:
        return s**3 - 0.5 * s**4, 3.0 * s**2 - 2.0 * s**3
    if kind == COSINE:
        x = 2.0 * math.pi * s
        return s * s / 2.0 - (1.0 - math.cos(x)) / (4.0 * math.pi**2), s - math.sin(x) / (
            2.0 * math.pi)
    if kind == GAUSSIAN:
        # int_0^s N(z) dz and int_0^s (s - z) N(z) dz over the normal density about 1/2.
        d = p[3]
        a, b = -0.5 / d, (s - 0.5) / d
        area = math.erf(0.5 / d / math.sqrt(2.0))
        phi_a = math.exp(-0.5 * a * a) / math.sqrt(2.0 * math.pi)
        phi_b = math.exp(-0.5 * b * b) / math.sqrt(2.0 * math.pi)
        part = 0.5 * (math.erf(b / math.sqrt(2.0)) - math.erf(a / math.sqrt(2.0)))
        return d * (b * part + phi_b - phi_a) / area, part / area
    k = min(np.searchsorted(knots, s, side="right") - 1, len(knots) - 2)
    x, c = s - knots[k], curve[k]
    h = c[0] + x * (c[1] + x * (c[2] + x * c[3]))
    return c[4] + x * (c[0] + x * (c[1] / 2.0 + x * (c[2] / 3.0 + x * c[3] / 4.0))), h


@numba.njit(cache=True)
def normal_force(kind, u, v, p, knots, curve):
    """Normal force on the body from penetration and rate."""
    if kind <= MEASURED:
        s = u / p[1]
        if s <= 0.0:
            return 0.0
        if s < 1.0:
            f, h = bed(kind, s, p, knots, curve)
        else:
            f, h = s - (0.5 if kind != MEASURED else 1.0 - curve[-1, 4]), 1.0
        return max(0.0, p[0] * p[1] * f + p[2] * h * v)
    if kind == LINEAR:
        return max(0.0, p[0] * u + p[1] * v) if u > 0.0 else 0.0
    if kind == POWER:
        return p[0] * (u / p[1]) ** p[2] * max(0.0, 1.0 + p[3] * v) if u > 0.0 else 0.0
    if kind == EXPONENTIAL:
        return 0.0 if u < -50.0 * p[1] else p[0] * math.exp(u / p[1]) * max(0.0, 1.0 + p[2] * v)
    if kind == GREENWOOD:
        h = p[2] - u / p[1]
        if h >= 9.0:
            return 0.0
        # Cubic Hermite interpolation of the logarithm.
        width = knots[1] - knots[0]
        k = min(int((h - knots[0]) / width), len(knots) - 2)
        x = (h - knots[k]) / width
        rise = curve[k + 1, 0] - curve[k, 0]
        a, b = curve[k, 1] * width - rise, rise - curve[k + 1, 1] * width
        value = (1.0 - x) * curve[k, 0] + x * curve[k + 1, 0] + x * (1.0 - x) * (
            (1.0 - x) * a + x * b)
        return p[0] * math.exp(value) * max(0.0, 1.0 + p[3] * v)
    if kind == STOP:
        if u > 0.0:
            return p[0] * u * max(0.0, 1.0 + p[2] * v)
        return p[0] * (u + p[1]) * max(0.0, 1.0 - p[2] * v) if u < -p[1] else 0.0
    if kind == PRESCRIBED:
        return p[0]
    if kind == CUBIC:
        return p[0] * u + p[1] * u**3 + p[2] * v
    if kind == POLYNOMIAL:
        e, w = -u, -v
        return -(p[0] * e + p[1] * e**2 + p[2] * e**3 + p[3] * e**5
                 + p[4] * w + p[5] * abs(w) * w + p[6] * w**3)
    if kind == PLAY:
        side = 1.0 if u > 0.0 else -1.0
        return side * max(0.0, p[0] * (side * u - p[1]) + p[2] * side * v) if (
            side * u > p[1]) else 0.0
    return p[1] * v - np.interp(-u, knots, curve[:, 0]) - (
        (-u - knots[-1]) * p[2] if -u > knots[-1] else 0.0) - (
        (-u - knots[0]) * p[0] if -u < knots[0] else 0.0)


@numba.njit(cache=True)
def dry_friction(kind, v, F, p):
    """Friction force at a slip speed v >= 0, without memory."""
    if kind == PRODUCT:
        return F * p[0] * (1.0 + p[1] * math.exp(-p[2] * v)) * math.atan(p[3] * v)
    if kind == EXP:
        mu = p[1] + (p[0] - p[1]) * math.exp(-p[2] * v)
    elif kind == GAUSS:
        mu = p[1] + (p[0] - p[1]) * math.exp(-((v / p[2]) ** 2))
    elif kind == HYPERBOLIC:
        mu = p[1] + (p[0] - p[1]) / (1.0 + v / p[2])
    elif kind == CONSTANT:
        mu = p[0]
    elif kind == GALVANETTO:
        mu = p[1] + (p[0] - p[1]) / (1.0 + p[2] * v) + p[4] * v * v
    else:
        x = v / p[2]
        mu = p[0] - 1.5 * (p[0] - p[1]) * (x - x**3 / 3.0)
    return F * mu * 2.0 / math.pi * math.atan(p[3] * v)


@numba.njit(cache=True)
def memory_friction(kind, v, F, z, p, R, rate):
    """Fill friction forces R (d,) and rates of internal variables (k, d)."""
    speed, d = math.sqrt((v * v).sum()), len(v)
    if kind == MAXWELL:
        # z = n (l + distance of slip) follows the slip velocity; on the edge of the disc of radius
        # l, n turns at the rate of the velocity across n over l.
        R[:] = 0.0
        for i in range(len(z)):
            k, limit = p[2 * i], p[2 * i + 1] * F
            size, along = math.sqrt((z[i] * z[i]).sum()), 0.0
            for a in range(d):
                along += v[a] * z[i, a] / size if size > 0.0 else 0.0
            for a in range(d):
                rate[i, a] = v[a]
                if k * size > limit:
                    R[a] += limit * z[i, a] / size
                    if limit > 0.0 and d > 1:
                        radial = along * z[i, a] / size
                        rate[i, a] = radial + k * size / limit * (v[a] - radial)
                else:
                    R[a] += k * z[i, a]
        return
    if F <= 0.0:
        R[:] = 0.0
        rate[:] = -z / FADING
        return
    along = 0.0
    for a in range(d):
        along += v[a] * z[0, a]
    for a in range(d):
        if kind == DAHL:
            mu, sigma, exponent = p[0], p[1], p[2]
            s = sigma * along / speed / mu if speed > 0.0 else 0.0
            h = exponent if s == 0.0 else (
                1.0 - abs(1.0 - s) ** (exponent - 1.0) * (1.0 - s)) / s
            rate[0, a] = v[a] - speed * h * sigma * z[0, a] / mu
            R[a] = F * sigma * z[0, a]
        elif kind == LUGRE:
            g = p[1] + (p[0] - p[1]) * math.exp(-((speed / p[2]) ** 2))
            rate[0, a] = v[a] - p[3] * speed * z[0, a] / g
            R[a] = F * (p[3] * z[0, a] + p[4] * rate[0, a] + p[5] * v[a])
        else:
            mu, yielding, beta, exponent = p[0], p[1], p[2], p[3]
            size = math.sqrt((z[0] * z[0]).sum())
            fall = 0.0
            if size > 0.0:
                fall = size ** (exponent - 1.0) * (z[0, a] / size)
            rate[0, a] = (v[a] - (beta * abs(along) + (1.0 - beta) * along) * fall) / yielding
            R[a] = mu * F * z[0, a]


@numba.njit(cache=True)
def pressed(t, y, model, j, slip):
    """Fill the slip velocities (d,) of node j; returns its normal force and the ground's slope."""
    (w, _, _, _, _, _, _, _, along, away, speed, height, number, normal, normal_p, knots, curve,
     _, _, _) = model
    m, d = len(w), along.shape[1]
    q, rate = y[:m], y[m : 2 * m]
    place, u, v = -speed[0] * t, 0.0, 0.0
    for a in range(d):
        slip[a] = -speed[a]
    for i in range(m):
        place += along[j, 0, i] * q[i]
        u -= away[j, i] * q[i]
        v -= away[j, i] * rate[i]
        for a in range(d):
            slip[a] += along[j, a, i] * rate[i]
    slope = height * number * math.cos(number * place)
    u += height * math.sin(number * place)
    v += slope * slip[0]
    return normal_force(normal, u, v, normal_p, knots, curve), slope


@numba.njit(cache=True)
def equations(t, y, model, out):
    """Rates of the state y = [q, q', z]."""
    (w, damping, B, stiffness, dashpot, amplitude, omega, load, along, away, _, _, _, _, _, _, _,
     friction, friction_p, states) = model
    m, (n, d, _) = len(w), along.shape
    q, rate = y[:m], y[m : 2 * m]
    for i in range(m):
        out[i] = rate[i]
        out[m + i] = load[i] - damping[i] * rate[i] - w[i] ** 2 * q[i]
    for axis in range(len(stiffness)):
        x, v = 0.0, 0.0
        for i in range(m):
            x += B[axis, i] * q[i]
            v += B[axis, i] * rate[i]
        force = -stiffness[axis] * (x - amplitude[axis] * math.sin(omega * t)) - dashpot[axis] * v
        for i in range(m):
            out[m + i] += B[axis, i] * force
    slip, R = np.empty(d), np.empty(d)
    for j in range(n):
        F, slope = pressed(t, y, model, j, slip)
        if friction < MAXWELL:
            size = math.sqrt((slip * slip).sum())
            force = dry_friction(friction, size, abs(F), friction_p)
            for a in range(d):
                R[a] = force * slip[a] / size if size > 0.0 else 0.0
        else:
            first, last = 2 * m + j * states * d, 2 * m + (j + 1) * states * d
            memory_friction(friction, slip, abs(F), y[first:last].reshape((states, d)),
                            friction_p, R, out[first:last].reshape((states, d)))
        R[0] += F * slope
        for i in range(m):
            out[m + i] += away[j, i] * F
            for a in range(d):
                out[m + i] -= along[j, a, i] * R[a]


# The reference.

@numba.njit(cache=True)
def excesses(t, y, model, out):
    """Fill out (n, k) with the deflections of elastic Coulomb elements beyond their limits."""
    (w, _, _, _, _, _, _, _, along, _, _, _, _, _, _, _, _, _, p, states) = model
    m, (n, d, _) = len(w), along.shape
    slip = np.empty(d)
    for j in range(n):
        F, _ = pressed(t, y, model, j, slip)
        for i in range(states):
            first = 2 * m + (j * states + i) * d
            z = y[first : first + d]
            out[j, i] = math.sqrt((z * z).sum()) - p[2 * i + 1] * abs(F) / p[2 * i]


@numba.njit(cache=True)
def return_to_limits(t, y, model, out):
    """Return the deflections to their limits."""
    m, d = len(model[0]), model[8].shape[1]
    excesses(t, y, model, out)
    n, states = out.shape
    for j in range(n):
        for i in range(states):
            if out[j, i] > 0.0:
                first = 2 * m + (j * states + i) * d
                z = y[first : first + d]
                z *= max(0.0, 1.0 - out[j, i] / math.sqrt((z * z).sum()))


@numba.njit(cache=True)
def between(part, t, h, before, after, f0, f1, model, y, out):
    """Excesses at a part of a step, by cubic Hermite interpolation of the states."""
    a, b = part - 1.0, part
    for c in range(len(y)):
        change = after[c] - before[c]
        y[c] = -a * before[c] + b * after[c] + b * a * (
            -(2.0 * b - 1.0) * change + a * h * f0[c] + b * h * f1[c])
    excesses(t + part * h, y, model, out)


@numba.njit(cache=True)
def end_of_slip(t, h, before, after, f0, f1, model, allowed):
    """Part of a step at which the first excess is largest, 1 if all rise or none is above zero."""
    n, states = model[8].shape[0], model[19]
    y, found = np.empty(len(before)), np.empty((LOOKS + 1, n, states))
    out = np.empty((n, states))
    for k in range(LOOKS + 1):
        between(k / LOOKS, t, h, before, after, f0, f1, model, y, found[k])
    first = 1.0
    for j in range(n):
        for i in range(states):
            # The first maximum that may be above zero.
            some, k = found[:, j, i], 0
            reach = some.max() - some.min()
            while k < LOOKS and (some[k + 1] >= some[k] or some[k] + reach < 0.0):
                k += 1
            if k == LOOKS:
                continue
            low, high = max(k - 1, 0) / LOOKS, min(k + 1, LOOKS) / LOOKS
            for _ in range(40):
                one, two = low + 0.381966 * (high - low), low + 0.618034 * (high - low)
                between(one, t, h, before, after, f0, f1, model, y, out)
                at_one = out[j, i]
                between(two, t, h, before, after, f0, f1, model, y, out)
                if at_one >= out[j, i]:
                    high = two
                else:
                    low = one
            between(low, t, h, before, after, f0, f1, model, y, out)
            if out[j, i] - max(0.0, some[0], some[LOOKS]) > allowed:
                first = min(first, high)
    return first


A, B_WEIGHTS, C = (np.ascontiguousarray(one) for one in (DOP853.A, DOP853.B, DOP853.C))
E3, E5 = np.ascontiguousarray(DOP853.E3), np.ascontiguousarray(DOP853.E5)


@numba.njit(cache=True)
def dop853(y, times, model, scale, tolerance, A, B, C, E3, E5):
    """States (N, size) at the output times, where steps end."""
    size, stages = len(y), len(B)
    out, k, stage = np.empty((len(times), size)), np.empty((stages + 1, size)), np.empty(size)
    out[0] = y
    t, h = times[0], 1e-6 * (times[1] - times[0])
    largest = scale.copy()
    m, elastic = len(model[0]), model[17] == MAXWELL
    out_of = np.empty((model[8].shape[0], model[19]))
    equations(t, y, model, k[0])
    longest = LONGEST * times[-1]
    attempts, limit = 0, longest
    for row in range(1, len(times)):
        while t < times[row]:
            attempts += 1
            if attempts > MOST_STEPS:
                out[row:] = np.nan
                return out
            last = t + 1.01 * min(h, limit) >= times[row]
            step = times[row] - t if last else min(h, limit)
            for i in range(1, stages + 1):
                for c in range(size):
                    total = 0.0
                    for l in range(i):
                        total += (A[i, l] if i < stages else B[l]) * k[l, c]
                    stage[c] = y[c] + step * total
                equations(t + (C[i] if i < stages else 1.0) * step, stage, model, k[i])
            high, low = 0.0, 0.0
            for c in range(size):
                a, b = 0.0, 0.0
                for l in range(stages + 1):
                    a += E5[l] * k[l, c]
                    b += E3[l] * k[l, c]
                allowed = tolerance * max(largest[c], abs(stage[c]))
                high += (a / allowed) ** 2
                low += (b / allowed) ** 2
            error = 0.0
            if high > 0.0:
                error = step * high / math.sqrt((high + 0.01 * low) * size)
            # Stages that overflow have no error.
            if not error < 1e30:
                error = 1e30
            factor = min(5.0, max(0.2, 0.9 * max(error, 1e-10) ** -0.125))
            if error <= 1.0 and elastic and step > SHORTEST * times[-1]:
                part = end_of_slip(t, step, y, stage, k[0], k[stages], model,
                                   FALL * largest[2 * m :].max())
                if part < 1.0:
                    limit = step * max(part, 1e-3)
                    continue
            limit = longest
            if error <= 1.0:
                t = times[row] if last else t + step
                for c in range(size):
                    y[c] = stage[c]
                    largest[c] = max(largest[c], abs(y[c]))
                k[0] = k[stages]
                if elastic:
                    return_to_limits(t, y, model, out_of)
                    equations(t, y, model, k[0])
                if not (last and factor > 1.0):
                    h = step * factor
                else:
                    h = max(h, step * factor) if step > 0.5 * h else h
            else:
                h = step * min(factor, 1.0)
        out[row] = y
    return out


# The systems.

@dataclass(frozen=True)
class Case:
    """A random system, its start and length, and its equations as the reference takes them."""

    number: int
    names: tuple[str, str]
    ground: str
    system: fc.ContactSystem
    state: Array
    end: float
    model: tuple[Any, ...]
    scale: Array


@cache
def greenwood_table() -> tuple[Array, Array]:
    """Distances h, and logarithms of F_3/2(h) with their slopes.

    With s - h = x^2 the integrands are smooth and even: the trapezoidal rule converges fast. Where
    all heights are in contact, Gauss's rule is exact to rounding.
    """
    h = np.linspace(-1000.0, 9.0, 50451)
    s, weights = np.polynomial.hermite_e.hermegauss(30)
    deep = h < -12.0
    away = s - h[deep, None]
    weights = weights / math.sqrt(2.0 * math.pi)
    x = np.arange(1, 260) * 0.025
    density = np.exp(-0.5 * (h[~deep, None] + x**2) ** 2) * 0.025 / math.sqrt(2.0 * math.pi)
    force = np.concatenate([away**1.5 @ weights, density @ (2.0 * x**4)])
    fall = np.concatenate([-1.5 * away**0.5 @ weights, density @ (-3.0 * x**2)])
    return h, np.column_stack([np.log(force), fall / force])


def random_normal(name: str, rng: np.random.Generator, n: int, force: float) -> tuple[Any, ...]:
    """A normal law of a name, its kind, parameters and table for the reference."""
    c = 10.0 ** rng.uniform(4.5, 6.5)
    R = 10.0 ** rng.uniform(-5.3, -4.3)
    d, chi = 10.0 ** rng.uniform(-5.0, -3.5) * c, rng.uniform(0.0, 2.0)
    depth = 10.0 ** rng.uniform(-5.3, -4.3)
    empty = np.zeros(2), np.zeros((2, 5))

    def each(value: float) -> tuple[float, ...]:
        return (value,) * n

    beds = {"rough-surface": laws.RoughSurface, "parabolic-surface": laws.ParabolicSurface,
            "cosine-surface": laws.CosineSurface}
    if name in beds:
        return (beds[name](each(c), R, each(d)), list(beds).index(name), [c, R, d], *empty)
    if name == "gaussian-surface":
        width = rng.uniform(0.1, 0.4)
        return laws.GaussianSurface(each(c), R, each(d), width), GAUSSIAN, [c, R, d, width], *empty
    if name == "measured-surface":
        heights = R * np.cumsum(rng.standard_normal(200)) / 20.0
        law = laws.MeasuredSurface.from_heights(heights, stiffness=each(c), damping=each(d))
        found = PchipInterpolator(law.depths, law.bearing)
        table = np.column_stack([found.c[::-1].T, found.antiderivative()(found.x[:-1])])
        table = np.vstack([table, [0.0] * 4 + [found.antiderivative()(1.0)]])
        return law, MEASURED, [c, law.roughness_height, d], found.x, table
    if name == "linear":
        return laws.LinearContact(each(c), each(d)), LINEAR, [c, d], *empty
    if name == "power":
        return (laws.PowerContact(each(c * R**-0.5), 1.5, chi), POWER,
                [c * R**-0.5, 1.0, 1.5, chi], *empty)
    if name == "restitution":
        e = rng.uniform(0.5, 0.95)
        law = laws.RestitutionContact(each(c * R**-0.5), e, 0.1, damping_model="flores")
        return law, POWER, [c * R**-0.5, 1.0, 1.5, 8.0 * (1.0 - e) / (5.0 * e * 0.1)], *empty
    if name == "exponential":
        return laws.ExponentialContact(each(force), depth, chi), EXPONENTIAL, [
            force, depth, chi], *empty
    if name == "back-burdekin":
        area, C = 1e-4, 10.0 ** rng.uniform(-8.5, -7.5)
        return laws.BackBurdekinContact(each(area), C, 0.5, chi), POWER, [area, C, 2.0, chi], *empty
    if name == "greenwood-williamson":
        asperities, radius, modulus, sigma = 1e3, 1e-5, 1e10, 1e-6 * rng.uniform(4.0, 15.0)
        scale = 4.0 / 3.0 * modulus * math.sqrt(radius) * asperities * sigma**1.5
        return (laws.GreenwoodWilliamson(each(asperities), radius, modulus, sigma, 3.0, chi),
                GREENWOOD, [scale, sigma, 3.0, chi], *greenwood_table())
    if name == "two-sided-stop":
        clearance = 10.0 ** rng.uniform(-4.5, -3.0)
        return (laws.TwoSidedStop(each(c), clearance, 1.0, chi), STOP, [c, clearance, chi], *empty)
    if name == "prescribed-force":
        return laws.PrescribedForce(each(force)), PRESCRIBED, [force], *empty
    if name == "cubic spring":
        cubic = c / R**2 * 1e-2
        return laws.BilateralPolynomial(each(c), each(cubic), each(0.1 * d)), CUBIC, [
            c, cubic, 0.1 * d], *empty
    if name == "bilateral-polynomial":
        terms = [c, 0.1 * c / R, 0.01 * c / R**2, 1e-5 * c / R**4, 0.1 * d, d, 10.0 * d]
        names = ("stiffness", "quadratic_stiffness", "cubic_stiffness", "quintic_stiffness",
                 "damping", "quadratic_damping", "cubic_damping")
        law = laws.BilateralPolynomial(**dict(zip(names, map(each, terms), strict=True)))
        return law, POLYNOMIAL, terms, *empty
    if name == "bilateral-play":
        return laws.BilateralPlay(each(c), R, each(d)), PLAY, [c, R, d], *empty
    assert name == "bilateral-piecewise"
    elongations = np.array([-3.0, -1.0, 0.0, 2.0]) * R
    forces = c * R * np.array([-2.0, -0.5, 0.0, 0.8])
    slopes = np.diff(forces) / np.diff(elongations)
    # Extensive forces are those of the whole face.
    law = laws.BilateralPiecewise(tuple(elongations), tuple(n * forces), each(0.1 * d))
    table = np.zeros((4, 5))
    table[:, 0] = forces
    return law, PIECEWISE, [slopes[0], 0.1 * d, slopes[-1]], elongations, table


def random_friction(name: str, rng: np.random.Generator, n: int) -> tuple[Any, int, list[float]]:
    """A friction law of a name, its kind and parameters for the reference."""
    low = rng.uniform(0.1, 0.5)
    high = low * rng.uniform(1.0, 1.6)
    slope, fall = 10.0 ** rng.uniform(3.0, 4.7), 10.0 ** rng.uniform(-3.0, -1.0)
    stiffness, slide = 10.0 ** rng.uniform(5.0, 6.5), 10.0 ** rng.uniform(-5.5, -4.5)
    exponent = float(rng.choice([1.0, 1.5, 2.0, 3.0]))
    springs: dict[str, dict[str, Any]] = {
        "jenkins": {}, "iwan": {"elements": 3},
        "four-parameter-iwan": {"chi": -0.5, "beta": 0.1, "elements": 3}}
    if name == "exponential":
        law = laws.ExponentialFriction(high, low, 1.0 / fall, slope)
        return law, EXP, [high, low, 1.0 / fall, slope]
    if name == "gaussian":
        return laws.GaussianFriction(high, low, fall, slope), GAUSS, [high, low, fall, slope]
    if name == "hyperbolic":
        return laws.HyperbolicFriction(high, low, fall, slope), HYPERBOLIC, [high, low, fall, slope]
    if name == "frictionless":
        return laws.Frictionless(), CONSTANT, [0.0, 0.0, 0.0, slope]
    if name == "constant":
        return laws.ConstantFriction(low, slope), CONSTANT, [low, 0.0, 0.0, slope]
    if name == "galvanetto":
        return (laws.GalvanettoFriction(high, low, 1.0 / fall, 0.1, slope), GALVANETTO,
                [high, low, 1.0 / fall, slope, 0.1])
    if name == "cubic":
        return laws.CubicFriction(high, low, 0.3, slope), CUBIC_FALL, [high, low, 0.3, slope]
    if name == "product":
        factor, excess = low / 2.0, high / low - 1.0
        return (laws.ProductFriction(factor, excess, 1.0 / fall, slope), PRODUCT,
                [factor, excess, 1.0 / fall, slope])
    if name in springs:
        kind = {"jenkins": laws.JenkinsFriction, "iwan": laws.IwanFriction,
                "four-parameter-iwan": laws.FourParameterIwanFriction}[name]
        law = kind(stiffness=(stiffness,) * n, friction_coefficient=low, **springs[name])
        parts, limits = law.shares
        return law, MAXWELL, np.column_stack([stiffness * parts, low * limits]).ravel().tolist()
    if name == "dahl":
        return laws.DahlFriction(low, low / slide, exponent), DAHL, [low, low / slide, exponent]
    if name == "lugre":
        sigma, damping, viscous = low / slide, rng.uniform(0.0, 5.0), 0.05
        return (laws.LuGreFriction(high, low, fall, 2.0, sigma, damping, viscous), LUGRE,
                [high, low, fall, sigma, damping, viscous])
    beta = rng.uniform(0.5, 0.9)
    assert name == "bouc-wen"
    return laws.BoucWenFriction(low, slide, beta, exponent), BOUC_WEN, [low, slide, beta, exponent]


def normal_name(number: int) -> str:
    """Name of the normal law of a number: the next, so that tests keep the systems they name.

    The polynomial spring has its cubic term alone in every other turn.
    """
    turn, place = divmod(number, len(NORMAL))
    name = NORMAL[place]
    return "cubic spring" if name == "bilateral-polynomial" and turn % 2 == 0 else name


def random_case(number: int) -> Case:
    """The system of a number."""
    rng = np.random.default_rng([7, number])
    names = normal_name(number), FRICTION[number % len(FRICTION)]
    space = number % 4 == 3
    m, n, d = int(rng.integers(1, 4)), int(rng.integers(1, 3)), 3 if space else 2
    force = rng.uniform(5.0, 30.0)
    normal, kind, normal_p, knots, curve = random_normal(names[0], rng, n, force)
    friction, rubs, friction_p = random_friction(names[1], rng, n)
    w = 2.0 * np.pi * np.sort(10.0 ** rng.uniform(0.0, 2.2, m))
    damping = 2.0 * rng.uniform(0.0, 0.05, m) * w
    T = np.zeros((2 + n, 6 if space else 3, m))
    T[:, :d] = rng.standard_normal((2 + n, d, m))
    stiffness, amplitude = 10.0 ** rng.uniform(3.0, 4.5, d), 10.0 ** rng.uniform(-4.5, -3.0, d)
    dashpot, omega = rng.uniform(0.0, 3.0, d), rng.uniform(50.0, 300.0)
    drive = {f"{name}_{axis}": float(value) for name, values in (
        ("stiffness", stiffness), ("damping", dashpot), ("amplitude", amplitude))
        for axis, value in zip("xyz", values, strict=False)}
    kind_of_ground = ("resting", "slow", "fast", "wavy")[int(rng.integers(4))]
    speed = {"resting": 0.0, "slow": 1e-3, "fast": 0.3, "wavy": 0.05}[kind_of_ground]
    speed *= rng.uniform(0.5, 1.5) * float(rng.choice([-1.0, 1.0]))
    speed_y = 0.5 * speed if space else 0.0
    height = 10.0 ** rng.uniform(-5.0, -4.0) if kind_of_ground == "wavy" else 0.0
    length = rng.uniform(2e-3, 2e-2)
    basis = fc.ModalBasis(w, np.diag(damping), T, np.zeros((2 + n, d)), np.ones(n))
    system = fc.ContactSystem(
        basis, normal=normal, friction=friction,
        ground=fc.Ground(speed=speed, speed_y=speed_y, amplitude=height, wavelength=length),
        drive=fc.Drive(frequency_hz=omega / (2.0 * np.pi), **drive), load=fc.Load(force))
    place = 10.0 ** rng.uniform(-5.5, -3.5) * rng.standard_normal(m)
    deepest = -float((T[2:, d - 1] @ place).min())
    if deepest > DEEPEST * system.penetration_scale:
        place *= DEEPEST * system.penetration_scale / deepest
    state = np.concatenate([place, 10.0 ** rng.uniform(-2.5, -0.5) * rng.standard_normal(m),
                            np.zeros(system.size - 2 * m)])
    states = friction.memory if rubs >= MAXWELL else 0
    contact = T[2:]
    away, along = contact[:, d - 1].copy(), contact[:, : d - 1].copy()
    model = (w, damping, T[0, :d].copy(), stiffness, dashpot, amplitude, omega,
             -force * T[1, d - 1], along, away, np.array([speed, speed_y][: d - 1]), height,
             2.0 * np.pi / length, kind, np.array(normal_p, dtype=float),
             np.ascontiguousarray(knots, dtype=float), np.ascontiguousarray(curve, dtype=float),
             rubs, np.array(friction_p, dtype=float), states)
    scale = np.concatenate([np.full(m, 1e-6), np.full(m, 1e-3),
                            np.full(system.size - 2 * m, 1e-6 if rubs != BOUC_WEN else 1.0)])
    return Case(number, names, kind_of_ground, system, state, 0.2, model, scale)


def rates(case: Case, t: float, y: Array) -> Array:
    """The right-hand side of the reference."""
    out = np.empty_like(y)
    equations(t, y, case.model, out)
    return out


def reference(case: Case, times: Array, state: Array | None = None, tolerance: float = 1e-12,
              ) -> Array:
    """States (N, size) at the output times."""
    start = (case.state if state is None else state).copy()
    return np.asarray(dop853(start, times, case.model, case.scale, tolerance, A, B_WEIGHTS, C, E3,
                             E5))


def distance(case: Case, found: Array, wanted: Array) -> float:
    """Largest difference of a modal displacement, over the range of the mode."""
    m = case.system.basis.modes
    ranges = np.ptp(wanted[:, :m], axis=0)
    ranges = np.maximum(ranges, 1e-2 * ranges.max())
    return float((np.abs(found[:, :m] - wanted[:, :m]).max(axis=0) / ranges).max())


@dataclass(frozen=True)
class Result:
    """Findings on one system."""

    case: Case
    status: str
    error: float
    ends: float
    outputs: float
    growth: float
    steps: int
    seconds: float


def growth_of(case: Case, times: Array, wanted: Array) -> float:
    """Growth of a small change of the start."""
    m = case.system.basis.modes
    rng = np.random.default_rng([8, case.number])
    size = np.concatenate([np.ptp(wanted[:, :m], axis=0), np.ptp(wanted[:, m : 2 * m], axis=0)])
    moved = case.state.copy()
    moved[: 2 * m] += CHANGE * size * rng.choice([-1.0, 1.0], 2 * m)
    return distance(case, reference(case, times, moved), wanted) / CHANGE


def run_case(number: int, rtol: float = 1e-6, **options: Any) -> Result:
    """Run a system and compare."""
    case = random_case(number)
    times = np.linspace(0.0, case.end, OUTPUTS)
    part = times[: int(0.77 * OUTPUTS)]

    def run(outputs: Array) -> fc.Trajectory:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fc.ModelWarning)
            return fc.simulate(case.system, float(outputs[-1]), initial=case.state,
                               outputs=outputs, rtol=rtol, **options)

    wanted = reference(case, times)
    found = run(times)
    if found.status is not Status.FINISHED:
        return Result(case, found.status.name, np.inf, np.inf, np.inf, np.nan,
                      found.statistics["steps"], found.statistics["seconds"])
    shorter, few = run(part), run(times[::40])
    return Result(case, found.status.name, distance(case, found.states, wanted),
                  distance(case, shorter.states, found.states[: len(part)]),
                  distance(case, few.states, found.states[::40]),
                  growth_of(case, times, wanted), found.statistics["steps"],
                  found.statistics["seconds"])


def line(result: Result) -> str:
    """One line of a system."""
    case = result.case
    basis = case.system.basis
    return (f"{case.number:4d} {case.names[0]:21s} {case.names[1]:20s} {case.ground:8s} "
            f"{basis.dimension}D m {basis.modes} n {basis.contact_nodes}  error {result.error:.1e} "
            f"ends {result.ends:.1e} outputs {result.outputs:.1e} growth {result.growth:.1e} "
            f"steps {result.steps} {'' if result.status == 'FINISHED' else result.status}")


def summary(results: list[Result]) -> None:
    """Percentiles of errors, of all and by law."""
    def row(title: str, some: list[Result]) -> None:
        errors = np.array([one.error for one in some if not np.isnan(one.error)])
        if not len(errors):
            return
        low, middle, high = np.quantile(errors, [0.5, 0.9, 0.99], method="inverted_cdf")
        print(f"{title:32s} {len(some):4d}  {low:.1e}  {middle:.1e}  {high:.1e}  "
              f"{errors.max():.1e}")

    print(f"{'':32s} runs  50 %     90 %     99 %     largest")
    row("all", results)
    for title, space in (("plane", 2), ("space", 3)):
        if some := [one for one in results if one.case.system.basis.dimension == space]:
            row(title, some)
    for kind, names in enumerate((NORMAL, FRICTION)):
        for name in names:
            if some := [one for one in results if one.case.names[kind] == name]:
                row(name, some)
    worst = max(one.ends for one in results), max(one.outputs for one in results)
    print(f"\nlargest difference between runs of two lengths {worst[0]:.1e}, with many and few "
          f"outputs {worst[1]:.1e}")
    done = sum(one.status == "FINISHED" for one in results)
    print(f"finished {done} of {len(results)}")
    if unknown := sum(np.isnan(one.error) for one in results):
        print(f"without a reference {unknown}")


def main(numbers: list[int], rtol: float) -> list[Result]:
    """Run the systems of these numbers and print their errors."""
    results, begin = [], time.perf_counter()
    for number in numbers:
        results.append(run_case(number, rtol))
        one = results[-1]
        if len(numbers) <= QUICK or not one.error <= 1e-4 or not one.ends <= 1e-5:
            print(line(one), flush=True)
    summary(results)
    print(f"{time.perf_counter() - begin:.0f} s", file=sys.stderr)
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--rtol", type=float, default=1e-6)
    parser.add_argument("numbers", nargs="*", type=int)
    given = parser.parse_args()
    main(given.numbers or list(range(QUICK if given.quick else COUNT)), given.rtol)
