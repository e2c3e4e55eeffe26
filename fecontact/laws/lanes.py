"""Common laws for eight contact nodes at once, one in each lane.

They serve runs of many small systems side by side (:mod:`fecontact.integrate.lanes`). Arguments and
results are those of :mod:`fecontact.laws.signatures`, eight of each, parameters ``p`` (k, 8); the
values are those of the law itself up to rounding. Laws that are not here are run one by one.
"""

import math
from collections.abc import Callable
from typing import Any

from numba import types

from fecontact.core.addresses import function_at
from fecontact.core.compiled import CompiledLaw, compile_law, helper
from fecontact.core.lanes.functions import (
    arctangent,
    exponential,
    hyperbolic_tangent,
    logarithm,
    reciprocal_root,
    sine_and_cosine,
)
from fecontact.core.lanes.vectors import bits, chosen, lanes, magnitude, read, root, spread
from fecontact.core.records import Matrix, numba_type
from fecontact.laws.friction import stribeck
from fecontact.laws.ground.motion import HarmonicSpeed, constant_speed
from fecontact.laws.normal import rough_surface
from fecontact.laws.normal.linear import LinearContact, PrescribedForce, TwoSidedStop
from fecontact.laws.normal.power import PowerContact
from fecontact.laws.signals.harmonic import Constant, Harmonic

_NODE = types.UniTuple(lanes, 3)(lanes, lanes, numba_type(Matrix))
_SIGNAL = types.UniTuple(lanes, 2)(lanes, numba_type(Matrix))
node_lanes_at = function_at(_NODE, only_reads=True)
signal_lanes_at = function_at(_SIGNAL, only_reads=True)

_LANE_LAWS: dict[CompiledLaw, CompiledLaw] = {}


def lane_law(law: CompiledLaw) -> CompiledLaw | None:
    """A law for eight nodes, or a signal at eight times, at once; None if there is none."""
    return _LANE_LAWS.get(law)


def _of(law: CompiledLaw) -> Callable[[Callable[..., Any]], CompiledLaw]:
    """Decorator of the function for eight lanes of a law."""

    def compile_(function: Callable[..., Any]) -> CompiledLaw:
        signature = _SIGNAL if law.form.startswith("f(t") else _NODE
        _LANE_LAWS[law] = compile_law(signature, f"{law.form}, eight of each", function)
        return _LANE_LAWS[law]

    return compile_


@helper
def _asperities(v, p, compression, bearing, density, touching):
    """As :func:`fecontact.laws.normal.rough_surface.bed_of_asperities`, where ``touching``."""
    stiffness, height, damping = read(p[0]), read(p[1]), read(p[2])
    force = stiffness * height * compression + damping * bearing * v
    pressed = touching & (force > 0.0)
    return (chosen(pressed, force, 0.0),
            chosen(pressed, stiffness * bearing + damping * density / height * v, 0.0),
            chosen(pressed, damping * bearing, 0.0))


@_of(rough_surface.uniform)
def _uniform(u, v, p):
    s = u / read(p[1])
    partly = s < 1.0
    return _asperities(v, p, chosen(partly, 0.5 * s * s, s - 0.5), chosen(partly, s, 1.0),
                       chosen(partly, spread(1.0), 0.0), s > 0.0)


@_of(rough_surface.parabolic)
def _parabolic(u, v, p):
    s = u / read(p[1])
    partly = s < 1.0
    return _asperities(v, p, chosen(partly, s * s * s * (1.0 - 0.5 * s), s - 0.5),
                       chosen(partly, s * s * (3.0 - 2.0 * s), 1.0),
                       chosen(partly, 6.0 * s * (1.0 - s), 0.0), s > 0.0)


@_of(LinearContact.kernel)
def _linear(u, v, p):
    stiffness, damping = read(p[0]), read(p[1])
    force = stiffness * u + damping * v
    pressed = (u > 0.0) & (force > 0.0)
    return (chosen(pressed, force, 0.0), chosen(pressed, stiffness, 0.0),
            chosen(pressed, damping, 0.0))


@_of(PrescribedForce.kernel)
def _prescribed(u, v, p):
    return read(p[0]), spread(0.0), spread(0.0)


@helper
def _lower_power(ratio, power):
    """Ratio^(power - 1) where the ratio is above zero."""
    positive = chosen(ratio > 1e-300, ratio, 1e-300)
    found = chosen(power == 1.5, root(positive), chosen(power == 1.0, spread(1.0), positive))
    other = ~((power == 1.0) | (power == 1.5) | (power == 2.0))
    if bits(other) != 0:
        found = chosen(other, exponential((power - 1.0) * logarithm(positive)), found)
    return found


@_of(PowerContact.kernel)
def _power(u, v, p):
    scale, length, power, factor = read(p[0]), read(p[1]), read(p[2]), read(p[3])
    damped = 1.0 + factor * v
    pressed = (u > 0.0) & (damped > 0.0)
    ratio = u / length
    lower = _lower_power(ratio, power)
    elastic = scale * lower * ratio
    return (chosen(pressed, elastic * damped, 0.0),
            chosen(pressed, power * scale * lower / length * damped, 0.0),
            chosen(pressed, elastic * factor, 0.0))


@_of(TwoSidedStop.kernel)
def _two_sided(u, v, p):
    stiffness, clearance, power, factor = read(p[0]), read(p[1]), read(p[2]), read(p[3])
    above = u > 0.0
    side = chosen(above, spread(1.0), -1.0)
    depth = chosen(above, u, -u - clearance)
    damped = 1.0 + factor * side * v
    pressed = (depth > 0.0) & (damped > 0.0)
    lower = _lower_power(depth, power)
    elastic = stiffness * lower * depth
    return (chosen(pressed, side * elastic * damped, 0.0),
            chosen(pressed, power * stiffness * lower * damped, 0.0),
            chosen(pressed, elastic * factor, 0.0))


@helper
def _smoothed_sign(v, slope, smoothing):
    """As in :mod:`fecontact.laws.friction.stribeck`; only what some lane needs is computed."""
    rise = 2.0 / math.pi * slope
    sign, rate = spread(0.0), spread(0.0)
    if bits(smoothing == 0.0) != 0:
        x = slope * v
        sign, rate = 2.0 / math.pi * arctangent(x), rise / (1.0 + x * x)
    by_tanh, by_root = smoothing == 1.0, smoothing == 2.0
    if bits(by_tanh) != 0:
        s = hyperbolic_tangent(rise * v)
        sign, rate = chosen(by_tanh, s, sign), chosen(by_tanh, rise * (1.0 - s) * (1.0 + s), rate)
    if bits(by_root) != 0:
        x = rise * v
        inverse = reciprocal_root(1.0 + x * x)
        sign = chosen(by_root, x * inverse, sign)
        rate = chosen(by_root, rise * inverse * inverse * inverse, rate)
    return sign, rate


@helper
def _rubbing(v, F, coefficient, change, viscous, slope, smoothing):
    """R, dR/dv, dR/dF from mu and ``change``, its derivative with respect to speed."""
    s, rate = _smoothed_sign(v, slope, smoothing)
    sign = chosen(v >= 0.0, spread(1.0), -1.0)
    ratio = coefficient * s + viscous * v
    return ratio * F, (coefficient * rate + sign * change * s + viscous) * F, ratio


@_of(stribeck.exponential)
def _exponential(v, F, p):
    static, kinetic, decay = read(p[0]), read(p[1]), read(p[2])
    excess = (static - kinetic) * exponential(-decay * magnitude(v))
    return _rubbing(v, F, kinetic + excess, -decay * excess, read(p[4]), read(p[3]), read(p[5]))


@_of(stribeck.gaussian)
def _gaussian(v, F, p):
    static, kinetic, stribeck_velocity = read(p[0]), read(p[1]), read(p[2])
    x = magnitude(v) / stribeck_velocity
    excess = (static - kinetic) * exponential(-x * x)
    return _rubbing(v, F, kinetic + excess, -2.0 * x / stribeck_velocity * excess, read(p[4]),
                    read(p[3]), read(p[5]))


@_of(stribeck.hyperbolic)
def _hyperbolic(v, F, p):
    static, kinetic, stribeck_velocity = read(p[0]), read(p[1]), read(p[2])
    ratio = stribeck_velocity / (stribeck_velocity + magnitude(v))
    excess = (static - kinetic) * ratio
    return _rubbing(v, F, kinetic + excess, -excess * ratio / stribeck_velocity, read(p[4]),
                    read(p[3]), read(p[5]))


@_of(stribeck.constant)
def _constant(v, F, p):
    return _rubbing(v, F, read(p[0]), spread(0.0), read(p[2]), read(p[1]), read(p[3]))


@_of(stribeck.galvanetto)
def _galvanetto(v, F, p):
    static, kinetic, decay, growth = read(p[0]), read(p[1]), read(p[2]), read(p[3])
    speed = magnitude(v)
    ratio = 1.0 / (1.0 + decay * speed)
    excess = (static - kinetic) * ratio
    return _rubbing(v, F, kinetic + excess + growth * speed * speed,
                    2.0 * growth * speed - decay * ratio * excess, spread(0.0), read(p[4]),
                    read(p[5]))


@_of(stribeck.cubic)
def _cubic(v, F, p):
    static, least, velocity = read(p[0]), read(p[1]), read(p[2])
    x = magnitude(v) / velocity
    depth = 1.5 * (static - least)
    return _rubbing(v, F, static - depth * x * (1.0 - x * x / 3.0),
                    -depth * (1.0 - x * x) / velocity, spread(0.0), read(p[3]), read(p[4]))


@_of(stribeck.product)
def _product(v, F, p):
    factor, excess, decay, slope = read(p[0]), read(p[1]), read(p[2]), read(p[3])
    fall = excess * exponential(-decay * magnitude(v))
    sign = chosen(v >= 0.0, spread(1.0), -1.0)
    x = slope * v
    bend = arctangent(x)
    ratio = factor * (1.0 + fall) * bend
    rate = factor * ((1.0 + fall) * slope / (1.0 + x * x) - sign * decay * fall * bend)
    return ratio * F, rate * F, ratio


@_of(Constant.kernel)
def _constant_signal(t, p):
    return read(p[0]), spread(0.0)


@_of(Harmonic.kernel)
def _harmonic_signal(t, p):
    amplitude, w, phase = read(p[0]), read(p[1]), read(p[2])
    sine, cosine = sine_and_cosine(w * t + phase)
    return amplitude * sine, amplitude * w * cosine


@_of(constant_speed)
def _constant_speed(t, p):
    speed = read(p[0])
    return speed * t, speed


@_of(HarmonicSpeed.kernel)
def _harmonic_speed(t, p):
    speed, amplitude, w, phase = read(p[0]), read(p[1]), read(p[2]), read(p[3])
    angle = 0.5 * w * t
    travel = 2.0 * sine_and_cosine(angle + phase)[0] * sine_and_cosine(angle)[0]
    return (speed * t + amplitude / w * travel,
            speed + amplitude * sine_and_cosine(w * t + phase)[0])


def lane_address(address: int) -> int | None:
    """Address of the function for eight lanes of the law at an address; None if there is none."""
    if address not in _ADDRESSES:
        _ADDRESSES.update({law.address: lane.address for law, lane in _LANE_LAWS.items()
                           if "_compiled" in vars(law)})
    return _ADDRESSES.get(address)


_ADDRESSES: dict[int, int] = {}
