"""All friction laws without memory: forces from independent formulas, limits, inverse questions."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest
from friction_conformance import check_friction_law
from law_values import made
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fecontact import InputError
from fecontact.laws import (
    Bound,
    ConstantFriction,
    CubicFriction,
    ExponentialFriction,
    Frictionless,
    GalvanettoFriction,
    GaussianFriction,
    HyperbolicFriction,
    PerNode,
    Positive,
    ProductFriction,
)
from fecontact.laws.friction.base import MemorylessFriction

SMOOTHINGS = ("arctan", "tanh", "square-root")

CURVES = {
    ExponentialFriction: ({"static_coefficient": 0.7, "kinetic_coefficient": 0.4, "decay": 300.0},
                          lambda a: 0.4 + 0.3 * np.exp(-300.0 * a)),
    GaussianFriction: ({"static_coefficient": 0.7, "kinetic_coefficient": 0.4,
                        "stribeck_velocity": 2e-3},
                       lambda a: 0.4 + 0.3 * np.exp(-((a / 2e-3) ** 2))),
    HyperbolicFriction: ({"static_coefficient": 0.7, "kinetic_coefficient": 0.4,
                          "stribeck_velocity": 2e-3},
                         lambda a: 0.4 + 0.3 / (1.0 + a / 2e-3)),
    ConstantFriction: ({"friction_coefficient": 0.6}, lambda a: 0.6 + 0.0 * a),
    GalvanettoFriction: ({"static_coefficient": 0.7, "kinetic_coefficient": 0.4, "decay": 300.0,
                          "growth": 50.0},
                         lambda a: 0.4 + 0.3 / (1.0 + 300.0 * a) + 50.0 * a * a),
    CubicFriction: ({"static_coefficient": 0.7, "minimum_coefficient": 0.4,
                     "minimum_velocity": 5e-3},
                    lambda a: 0.7 - 0.45 * (a / 5e-3) + 0.15 * (a / 5e-3) ** 3),
}
VISCOUS = (ExponentialFriction, GaussianFriction, HyperbolicFriction, ConstantFriction)


def sign_of(v, k, smoothing):
    x = 2.0 * k * v / np.pi
    return {"arctan": 2.0 / np.pi * np.arctan(k * v), "tanh": np.tanh(x),
            "square-root": x / np.sqrt(1.0 + x * x)}[smoothing]


def every_law():
    for kind, (values, _) in CURVES.items():
        for smoothing in SMOOTHINGS:
            viscous = {"viscous_coefficient": 3.0} if kind in VISCOUS else {}
            yield kind(smoothing_slope=2e5, smoothing=smoothing, **values, **viscous)
    yield ProductFriction(0.14, 1.14, 2.0, 100.0)
    yield Frictionless()
    yield ExponentialFriction(static_coefficient=(0.8, 0.5), smoothing="tanh",
                              kinetic_coefficient=0.55, decay=1000.0)


@pytest.mark.parametrize("law", list(every_law()), ids=lambda law: f"{type(law).__name__}")
def test_conformance(law):
    check_friction_law(law)


@pytest.mark.parametrize("smoothing", SMOOTHINGS)
@pytest.mark.parametrize("kind", CURVES, ids=lambda kind: kind.__name__)
def test_force_and_derivatives_by_complex_step(kind, smoothing):
    values, curve = CURVES[kind]
    k, viscous = 2e5, 3.0 if kind in VISCOUS else 0.0
    law = kind(smoothing_slope=k, smoothing=smoothing, **values,
               **({"viscous_coefficient": viscous} if viscous else {}))
    p = law.table(np.ones(1))[0]

    def formula(v):
        speed = v if np.real(v) >= 0.0 else -v
        return curve(speed) * sign_of(v, k, smoothing) + viscous * v

    F = 14.0
    for v in (-0.02, -2e-3, -4e-5, -1e-7, 1e-9, 5e-6, 3e-4, 6e-3):
        force, slope, ratio = law.kernel.python(v, F, p)
        assert force == pytest.approx(F * formula(v), rel=1e-12)
        assert slope == pytest.approx(F * formula(v + 1e-40j).imag / 1e-40, rel=1e-9, abs=1e-7)
        assert ratio == pytest.approx(formula(v), rel=1e-12)
        assert law.coefficient(v) == pytest.approx(formula(v), rel=1e-12)
        assert law.slope(v) == pytest.approx(slope / F, rel=1e-9, abs=1e-8)


@pytest.mark.parametrize("smoothing", SMOOTHINGS)
def test_all_smoothings_rise_with_the_same_slope(smoothing):
    law = ConstantFriction(0.5, smoothing_slope=1e4, smoothing=smoothing)
    assert law.slope(0.0) == pytest.approx(0.5 * 2.0 / math.pi * 1e4, rel=1e-12)


@pytest.mark.parametrize("smoothing", SMOOTHINGS)
@pytest.mark.parametrize("kind", CURVES, ids=lambda kind: kind.__name__)
def test_steep_smoothing_tends_to_the_sign(kind, smoothing):
    values, curve = CURVES[kind]
    law = kind(smoothing_slope=1e12, smoothing=smoothing, **values)
    for v in (1e-5, 1e-3, 8e-3):
        assert law.coefficient(v) == pytest.approx(curve(v), rel=1e-6)
        assert law.coefficient(-v) == pytest.approx(-curve(v), rel=1e-6)


# Values from elsewhere ---------------------------------------------------------------------------

def test_product_law_of_section_4_4():
    law = ProductFriction(0.14, 1.14, 2.0, 100.0)
    # mu(1) = 0.14 (1 + 1.14 e^-2) arctan(100).
    assert law.coefficient(1.0) == pytest.approx(
        0.14 * (1.0 + 1.14 * math.exp(-2.0)) * (math.pi / 2.0 - 0.01 + 1e-6 / 3.0), rel=1e-9)
    for v in (-4.0, -0.3, -1e-3, 2e-3, 0.05, 1.0):
        def formula(x):
            speed = x if np.real(x) >= 0.0 else -x
            return 0.14 * (1.0 + 1.14 * np.exp(-2.0 * speed)) * np.arctan(100.0 * x)

        assert law.coefficient(v) == pytest.approx(formula(v), rel=1e-12)
        assert law.slope(v) == pytest.approx(formula(v + 1e-40j).imag / 1e-40, rel=1e-10)


def test_hopf_point_of_the_friction_oscillator():
    """Steady sliding is neutral where N times the slope and the damping cancel."""
    law = ExponentialFriction(0.8, 0.55, 1e3)
    speed = brentq(lambda V: 14.0 * float(law.slope(V)) + 0.768, 5e-3, 12e-3, xtol=1e-14)
    assert speed == pytest.approx(8.336533e-3, abs=1e-9)
    steep = ExponentialFriction(0.8, 0.55, 1e3, smoothing="tanh")
    speed = brentq(lambda V: 14.0 * float(steep.slope(V)) + 0.768, 5e-3, 12e-3, xtol=1e-14)
    assert speed == pytest.approx(8.424483793e-3, abs=1e-11)


@pytest.mark.long
def test_period_of_leines_oscillator():
    law = HyperbolicFriction(1.0, 0.0, 1.0 / 3.0, smoothing_slope=1e3)
    p = law.table(np.ones(1))[0]
    force = law.kernel.python

    def rate(_, y):
        return [y[1], -y[0] - force(y[1] - 0.2, 1.0, p)[0]]

    def jacobian(_, y):
        return [[0.0, 1.0], [-1.0, -force(y[1] - 0.2, 1.0, p)[1]]]

    def upwards(_, y):
        return y[0]

    upwards.direction = 1.0
    solution = solve_ivp(rate, (0.0, 60.0), [1.0, 0.1], method="Radau", jac=jacobian,
                         rtol=1e-9, atol=1e-11, events=upwards)
    times = solution.t_events[0]
    assert np.diff(times)[-1] == pytest.approx(11.29815066, rel=1e-6)


# Inverse questions -------------------------------------------------------------------------------

@pytest.mark.parametrize("law", [
    ExponentialFriction(0.3, 0.5, 300.0, smoothing="tanh"),
    GaussianFriction(0.3, 0.5, 2e-3, smoothing="tanh"),
    HyperbolicFriction(0.3, 0.5, 2e-3, smoothing="tanh"),
    GalvanettoFriction(0.3, 0.5, 300.0, smoothing="tanh"),
], ids=lambda law: type(law).__name__)
def test_friction_that_rises_with_velocity(law):
    """A static coefficient below the kinetic one: from 0.3 up to 0.5, without a maximum."""
    check_friction_law(law)
    speeds = np.geomspace(1e-5, 1e3, 200)
    coefficient = law.coefficient(speeds)
    assert coefficient[0] == pytest.approx(0.3, rel=5e-3)
    assert coefficient[-1] == pytest.approx(0.5, rel=1e-5)
    assert (np.diff(coefficient) >= 0.0).all()
    largest, velocity = law.largest_coefficient()
    assert largest == pytest.approx(0.5, rel=1e-6)
    assert velocity == math.inf
    assert law.velocity_of_minimum() == math.inf


def test_largest_coefficient_and_minimum_of_the_cubic():
    law = CubicFriction(0.7, 0.4, 5e-3, smoothing_slope=1e7, smoothing="square-root")
    assert law.velocity_of_minimum() == pytest.approx([5e-3], rel=1e-6)
    assert law.coefficient(law.velocity_of_minimum()) == pytest.approx([0.4], rel=1e-6)
    coefficient, velocity = law.largest_coefficient()
    assert coefficient == pytest.approx([0.7], rel=0.01)
    speeds = np.geomspace(1e-9, 1e-3, 100_001)
    sampled = (0.7 - 0.45 * (speeds / 5e-3) + 0.15 * (speeds / 5e-3) ** 3) * sign_of(
        speeds, 1e7, "square-root")
    assert coefficient == pytest.approx([sampled.max()], rel=1e-7)
    assert velocity == pytest.approx([speeds[sampled.argmax()]], rel=1e-3)


def test_minimum_of_galvanettos_law():
    law = GalvanettoFriction(0.7, 0.4, 300.0, 50.0, smoothing_slope=1e8, smoothing="tanh")
    v = law.velocity_of_minimum()[0]
    assert 2.0 * 50.0 * v * (1.0 + 300.0 * v) ** 2 == pytest.approx(90.0, rel=1e-9)


def test_without_a_maximum():
    coefficient, velocity = ConstantFriction(0.5).largest_coefficient()
    assert coefficient == pytest.approx([0.5], rel=1e-12)
    assert velocity.tolist() == [math.inf]
    assert ConstantFriction(0.5).velocity_of_minimum().tolist() == [math.inf]
    assert ConstantFriction(0.5, smoothing="tanh").stick_velocity(2) == pytest.approx(
        [1e-5, 1e-5], rel=1e-12)
    assert ConstantFriction(0.5, viscous_coefficient=1.0).largest_coefficient()[0] == math.inf
    per_node = ConstantFriction(0.5, smoothing_slope=(1e5, 1e6)).stick_velocity(2)
    assert per_node == pytest.approx([1e-4, 1e-5], rel=1e-12)


def test_a_viscous_term_leaves_the_limit_of_stick():
    dry = ExponentialFriction(0.8, 0.55, 1e3).stick_velocity(1)[0]
    assert ExponentialFriction(0.8, 0.55, 1e3,
                               viscous_coefficient=0.1).stick_velocity(1)[0] == pytest.approx(
        dry, rel=1e-3)


def test_curves_per_node():
    law = ExponentialFriction(static_coefficient=(0.8, 0.7), smoothing_slope=(1e5, 1e6),
                              kinetic_coefficient=0.55, decay=1000.0)
    single = [ExponentialFriction(mu, 0.55, 1000.0, smoothing_slope=k) for mu,
              k in ((0.8, 1e5), (0.7, 1e6))]
    v = np.array([[1e-3], [2e-3], [-1e-4]])
    for question in ("coefficient", "slope"):
        expected = np.concatenate([getattr(one, question)(v) for one in single], axis=1)
        np.testing.assert_allclose(getattr(law, question)(v), expected, rtol=1e-13)
    assert law.coefficient(1e-3).shape == (2,)
    for answer, first, second in zip(law.largest_coefficient(), single[0].largest_coefficient(),
                                     single[1].largest_coefficient(), strict=True):
        assert answer == pytest.approx([first[0], second[0]], rel=1e-12)


# Parameters --------------------------------------------------------------------------------------

def test_smoothing_in_the_table():
    assert ConstantFriction(0.5, smoothing="square-root").table(np.ones(1)).tolist() == [
        [0.5, 1e6, 0.0, 2.0]]


@pytest.mark.parametrize(("kind", "values", "message"), [
    (ExponentialFriction, {"smoothing": "arctangent"},
     r"ExponentialFriction: smoothing = 'arctangent' must be one of 'arctan', 'square-root', "
     r"'tanh' \(did you mean 'arctan'\?\)"),
    (ConstantFriction, {"smoothing": 1}, "smoothing = 1 must be one of"),
    (ConstantFriction, {"friction_coefficient": -0.1}, "friction_coefficient = -0.1 must be zero"),
    (GaussianFriction, {"stribeck_velocity": 0.0}, "stribeck_velocity = 0.0 must be above zero"),
    (HyperbolicFriction, {"viscous_coefficient": -1.0}, "viscous_coefficient"),
    (HyperbolicFriction, {"stribeck_velocity": -1.0}, "stribeck_velocity"),
    (GalvanettoFriction, {"growth": -1.0}, "growth"),
    (CubicFriction, {"static_coefficient": 0.3},
     r"CubicFriction: static_coefficient = 0\.3 must be at least minimum_coefficient = 0\.55"),
    (CubicFriction, {"static_coefficient": (0.8, 0.3)}, "must be at least minimum_coefficient"),
    (ProductFriction, {"factor": -1.0}, "ProductFriction: factor"),
    (ProductFriction, {"smoothing_slope": 0.0}, "smoothing_slope"),
])
def test_values_are_checked(kind, values, message):
    with pytest.raises(InputError, match=message):
        made(kind, **values)


def test_ranges_in_annotations_hold_for_laws_of_ones_own():
    @dataclass(frozen=True)
    class Mine(MemorylessFriction):
        high: Positive = 1.0
        small: Annotated[PerNode, Bound("at most 2", lambda x: x <= 2.0)] = 1.0
        free: PerNode = -1.0

    assert Mine((1.0, 2.0), 2).high == (1.0, 2.0)
    with pytest.raises(InputError, match=r"Mine: high = \(1\.0, 0\.0\) must be above zero\."):
        Mine((1.0, 0.0))
    with pytest.raises(InputError, match=r"Mine: small = 2\.5 must be at most 2\."):
        Mine(small=2.5)

    @dataclass(frozen=True)
    class Unknown(MemorylessFriction):
        high: "Nowhere" = 1.0  # noqa: F821

    with pytest.raises(InputError, match=r"Unknown: an annotation .*'Nowhere' is not defined"):
        Unknown()
