"""Normal laws: the contract, values against their definitions, impacts, messages."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import normal_conformance as conformance
import numpy as np
import pytest
from normal_conformance import check_normal_law, force
from scipy.integrate import quad

from fecontact import InputError
from fecontact.laws import (
    AsperityContact,
    BackBurdekinContact,
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
    CosineSurface,
    ExponentialContact,
    FrictionContact3D,
    GaussianSurface,
    GreenwoodWilliamson,
    LinearContact,
    MeasuredSurface,
    NormalLaw,
    ParabolicSurface,
    PerNode,
    PowerContact,
    PrescribedForce,
    RestitutionContact,
    RoughSurface,
    TwoSidedStop,
    normal_law,
)
from fecontact.laws.check import require_sound
from fecontact.laws.normal.bilateral import BilateralLaw
from fecontact.laws.sampling import stored_energy

R = 5e-6
TRACE = np.random.default_rng(5).normal(size=400).cumsum() * 1e-7


@normal_law
def _two_slopes(u, v, p):
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u <= p[1]:
        return p[0] * u, p[0], 0.0
    return p[0] * p[1] + 3.0 * p[0] * (u - p[1]), 3.0 * p[0], 0.0


@dataclass(frozen=True)
class TwoSlopes(NormalLaw):
    """A law as a user would write one."""

    kernel: ClassVar = _two_slopes
    extensive: ClassVar = frozenset({"stiffness"})

    stiffness: PerNode = 1e6
    joint: PerNode = 1e-6

    @property
    def penetration_scale(self):
        return float(np.min(self.joint))


MICRO, IMPACT = (-2e-5, 4e-5), (-0.3, 1e-3)
LAWS = {
    "uniform": (RoughSurface(1e6, R, 40.0), MICRO),
    "parabolic": (ParabolicSurface(1e6, R, 40.0), MICRO),
    "cosine": (CosineSurface(1e6, R, 40.0), MICRO),
    "gaussian": (GaussianSurface(1e6, R, 40.0), MICRO),
    "gaussian, narrow": (GaussianSurface(1e6, R, 40.0, 0.05), MICRO),
    "gaussian, wide": (GaussianSurface(1e6, R, 40.0, 1.0), MICRO),
    "measured": (MeasuredSurface.from_heights(TRACE, stiffness=1e6, damping=40.0), MICRO),
    "bearing": (MeasuredSurface(1e6, R, 40.0, (0.0, 0.1, 0.1, 0.7, 1.0)), MICRO),
    "bearing at depths": (MeasuredSurface(1e6, R, 40.0, (0.0, 0.1, 0.7, 1.0), (0.0, 0.3, 0.4, 1.0)),
                          MICRO),
    "linear": (LinearContact(1e6, 40.0), IMPACT),
    "linear, preloaded": (LinearContact(1e6, 40.0, 2.0), MICRO),
    "friction contact": (FrictionContact3D(1e6, 8e5, 0.4, 2.0), MICRO),
    "hertz": (PowerContact(1e9, 1.5, 0.7), IMPACT),
    "power 1": (PowerContact(1e6, 1.0, 0.7), IMPACT),
    "power 2": (PowerContact(1e9, 2.0), IMPACT),
    "power 3.3": (PowerContact(1e12, 3.3, 2.0), IMPACT),
    "restitution": (RestitutionContact(1e9, 0.7, 0.2), IMPACT),
    "back-burdekin": (BackBurdekinContact(1e-3, 6e-10, 0.5, 0.3), (-2e-5, 1e-5)),
    "back-burdekin 0.4": (BackBurdekinContact(1e-3, 6e-9, 0.4), (-2e-5, 1e-5)),
    "exponential": (ExponentialContact(10.0, 1e-6, 0.3), (-6e-5, 2.5e-5)),
    "greenwood": (GreenwoodWilliamson(1e4, 1e-4, 1e11, 1e-6, 3.0, 0.3), (-8e-6, 1.6e-5)),
    "asperities": (AsperityContact(1e3, 1e-4, 1e9, 1e-5, (0.0, 1.0, 2.0, 0.5)), MICRO),
    "flattened asperities": (AsperityContact(
        1e3, 1e-4, 1e9, 1e-5, (0.0, 1.0, 2.0, 0.5), 5e8, deepest=5e-6, damping_factor=0.3), MICRO),
    "prescribed": (PrescribedForce(14.0), MICRO),
    "stop": (TwoSidedStop(1e6, 3e-5, 1.0, 0.4), (-1e-4, 6e-5)),
    "stop 1.5": (TwoSidedStop(1e9, 3e-5, 1.5, 0.4), (-1e-4, 6e-5)),
    "cubic spring": (BilateralPolynomial(1e6, 1e14, 40.0, 3.0, 1e-5), (-1e-4, 6e-5)),
    "polynomial spring": (BilateralPolynomial(
        1e6, 1e14, 4.0, 3.0, 1e-5, quadratic_stiffness=2e9, quintic_stiffness=1e22,
        quadratic_damping=3.0, cubic_damping=0.5), (-1e-4, 6e-5)),
    "play": (BilateralPlay(1e6, 3e-5, 40.0), (-1e-4, 6e-5)),
    "preloaded play": (BilateralPlay(1e6, 3e-5, 40.0, 4.0, 1e-5), (-1e-4, 6e-5)),
    "table": (BilateralPiecewise((-2e-5, 0.0, 1e-5, 3e-5), (-30.0, 0.0, 1.0, 9.0), 40.0, 2.0, 5e-6),
              (-1e-4, 6e-5)),
    "user": (TwoSlopes(), MICRO),
}


@pytest.mark.parametrize("name", LAWS)
def test_contract(name):
    law, u_range = LAWS[name]
    check_normal_law(law, u_range, (-5.0, 5.0),
                     two_sided=isinstance(law, TwoSidedStop | BilateralLaw))


@pytest.mark.parametrize("law", [
    GaussianSurface((1e6, 2e6, 1e5), (R, 2 * R, R), 40.0, (0.1, 0.2, 0.3)),
    MeasuredSurface((1e6, 2e6, 1e5), (R, 2 * R, R), 40.0, (0.0, 0.1, 1.0)),
    RestitutionContact((1e9, 2e9, 3e9), (1.0, 0.5, 0.9), (0.1, 0.2, 0.3)),
    TwoSlopes((1e6, 3e6, 1e6), 1e-6),
])
def test_contract_with_parameters_per_node(law):
    check_normal_law(law, MICRO, (-5.0, 5.0), nodes=3)
    with pytest.raises(InputError, match=rf"{type(law).__name__}: \w+ has 3 values for 2 contact"):
        law.table(np.full(2, 0.5))


def _wrong_law(change):
    def function(u, v, p):
        if u <= 0.0:
            return 0.0, 0.0, 0.0
        return change(u, v, p)

    return normal_law(function)


@pytest.mark.parametrize(("function", "message"), [
    (lambda u, v, p: (p[0] * u * u, 2.02 * p[0] * u, 0.0), "derivative"),
    (lambda u, v, p: (p[0] * u + 1e-3 * v, p[0], 1e-3), None),
    (lambda u, v, p: (p[0] * u, p[0], -1e-9), None),
    (lambda u, v, p: (p[0] * u * (1.0 + 0.1 * v), p[0] * (1.0 + 0.1 * v), 0.101 * p[0] * u),
     "derivative"),
    (lambda u, v, p: (p[0] * u if u < 2e-6 else 1.02 * p[0] * u,
                      p[0] if u < 2e-6 else 1.02 * p[0], 0.0), None),
    (lambda u, v, p: (p[0] * u, math.nan, 0.0), None),
])
def test_wrong_laws_are_found(function, message):
    """Wrong slopes, tension, a dashpot that drives, a jump, no number."""
    from numba import njit

    @dataclass(frozen=True)
    class Wrong(TwoSlopes):
        kernel: ClassVar = _wrong_law(njit(function))

    with pytest.raises(AssertionError, match=message):
        conformance.check_forces(Wrong(), np.array([1e6, 1e-6]), MICRO, (-1.0, 1.0))


@pytest.mark.parametrize("name", LAWS)
def test_laws_pass_the_check_of_every_system(name):
    require_sound(LAWS[name][0])


@pytest.mark.parametrize("name", ["uniform", "gaussian", "measured", "linear", "hertz",
                                  "back-burdekin", "exponential", "prescribed"])
def test_energy_by_quadrature_agrees_with_the_closed_form(name):
    law, (low, high) = LAWS[name]
    u = np.linspace(max(low, -10.0 * law.penetration_scale),
                    min(high, 4.0 * law.penetration_scale), 42).reshape(7, 3, 2)
    share = np.array([0.3, 0.7])
    by_quadrature = stored_energy(law.kernel.address, u, law.table(share), law.penetration_scale)
    np.testing.assert_allclose(by_quadrature, law.stored_energy(u, share),
                               rtol=3e-4 if name == "measured" else 1e-6, atol=1e-18)


def test_penetration_scales():
    assert LinearContact((1e6, 4e6)).penetration_scale == 2.5e-7
    assert PowerContact(1e9, 1.5).penetration_scale == pytest.approx(1e-6, rel=1e-12)
    assert PowerContact((1e9, 8e9), 1.5).penetration_scale == pytest.approx(2.5e-7, rel=1e-12)
    assert TwoSidedStop(1e9, 1.0, 1.5).penetration_scale == pytest.approx(1e-6, rel=1e-12)
    assert ExponentialContact(1.0, (3e-6, 2e-6)).penetration_scale == 2e-6
    assert GreenwoodWilliamson(1.0, 1.0, 1.0, 3e-6).penetration_scale == 3e-6


def test_values_of_simple_laws_by_hand():
    assert force(LinearContact(2e6, 50.0), 3e-6, 0.1) == (11.0, 2e6, 50.0)
    assert force(LinearContact(2e6, 50.0), 3e-6, -0.13) == (0.0, 0.0, 0.0)
    assert force(LinearContact(2e6, 50.0), -1e-9, 1.0) == (0.0, 0.0, 0.0)
    # K u^1.5 = 1e9 * 1e-9 = 1 N at 1 um.
    assert force(PowerContact(1e9, 1.5, 2.0), 1e-6, 0.1) == pytest.approx((1.2, 1.8e6, 2.0))
    # 6e-10 * (1e8 Pa)^0.5 = 6 um.
    law = BackBurdekinContact(1e-4, 6e-10, 0.5)
    assert force(law, 6e-6)[:2] == pytest.approx((1e4, 2e4 / 6e-6), rel=1e-12)
    assert law.penetration_scale == pytest.approx(6e-7, rel=1e-12)
    law = ExponentialContact(3.0, 1e-6, 2.0)
    assert force(law, 2e-6, 0.1) == pytest.approx(
        (3.6 * math.e**2, 3.6e6 * math.e**2, 6.0 * math.e**2), rel=1e-12)
    assert force(law, -51e-6) == (0.0, 0.0, 0.0)
    assert force(law, 1.0)[0] == pytest.approx(3.0 * math.exp(60.0) * (1e6 - 59.0), rel=1e-12)
    assert force(PrescribedForce(14.0), -3.0, 5.0) == (14.0, 0.0, 0.0)


def test_two_sided_stop_by_hand():
    law = TwoSidedStop(1e6, 1e-3, 1.0, 2.0)
    assert force(law, 1e-5, 0.1) == pytest.approx((12.0, 1.2e6, 20.0), rel=1e-12)
    assert force(law, -5e-4, 0.1) == (0.0, 0.0, 0.0)
    # Moving up into the upper stop, v < 0, it pushes harder; moving off at 0.6 m/s it lets go.
    assert force(law, -1.01e-3, -0.1) == pytest.approx((-12.0, 1.2e6, 20.0), rel=1e-9)
    assert force(law, -1.01e-3, 0.6) == (0.0, 0.0, 0.0)


def _asperity_integral(n, h):
    """F_n(h), integral of (s - h)^n phi(s) over s > h."""
    def integrand(t):
        return 2.0 * t ** (2 * n + 1) * math.exp(-0.5 * (h + t * t) ** 2) / math.sqrt(2 * math.pi)

    centre = math.sqrt(max(-h, 0.0))
    ends = [0.0, *(e for e in (centre - 0.5, centre, centre + 0.5) if e > 0.0), centre + 6.0]
    return sum(quad(integrand, a, b, epsabs=0.0, epsrel=1e-13, limit=200)[0]
               for a, b in pairwise(ends))


@pytest.mark.parametrize("h", [-40.0, -12.0, -10.001, -9.999, -7.3, -3.01, -1.0, -0.2, 0.0, 0.26,
                               1.0, 2.5, 4.4, 6.0, 7.49, 8.99])
def test_greenwood_williamson_integrals(h):
    law = GreenwoodWilliamson(1.0, 1.0, 0.75, 1.0, separation=0.0)
    load, slope, _ = force(law, -h)
    assert load == pytest.approx(_asperity_integral(1.5, h), rel=1e-9)
    assert slope == pytest.approx(1.5 * _asperity_integral(0.5, h), rel=1e-8)


def test_greenwood_williamson_published():
    law = GreenwoodWilliamson(1.0, 1.0, 0.75, 1.0, separation=0.0)
    assert force(law, 0.0)[0] == pytest.approx(0.430019993662, rel=2e-11)
    assert force(law, -1.0)[0] == pytest.approx(0.075668177391, rel=2e-11)
    assert _asperity_integral(1.0, 0.0) == pytest.approx(0.398942280401, rel=2e-11)
    assert force(law, -9.0) == (0.0, 0.0, 0.0)
    assert 0.0 < force(law, np.nextafter(-9.0, 0.0))[0] < 1e-20


def test_greenwood_williamson_in_si_units():
    law = GreenwoodWilliamson(2e4, 5e-5, 1.1e11, 0.4e-6, separation=2.0)
    expected = 4 / 3 * 1.1e11 * math.sqrt(5e-5) * 2e4 * 0.4e-6**1.5 * 0.075668177391
    assert force(law, 0.4e-6)[0] == pytest.approx(expected, rel=1e-10)


def test_energy_of_a_body_far_above_the_surface():
    """Energy that a Greenwood-Williamson contact can give back: C sigma F_5/2(h_0) / (5/2)."""
    law = GreenwoodWilliamson(1e4, 1e-4, 1e11, 1e-6, separation=0.5)
    scale = law.table(np.ones(1))[0, 0]
    expected = -scale * 1e-6 * _asperity_integral(2.5, 0.5) / 2.5
    energy = law.stored_energy(np.array([[-2e-5], [-1e-3], [-1.0]]), np.ones(1))
    assert energy == pytest.approx(np.full((3, 1), expected), rel=1e-8)
    energy = ExponentialContact(3.0, 1e-6).stored_energy(np.array([-1e-3]), np.ones(1))
    assert energy == pytest.approx([-3e-6], rel=1e-12)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: GaussianSurface(1e6, R, deviation=0.0),
     r"GaussianSurface: deviation = 0\.0 must be at least 0\.02 and at most 1"),
    (lambda: CosineSurface(-1.0, R), r"CosineSurface: stiffness = -1\.0 must be above zero"),
    (lambda: MeasuredSurface(1e6), "lacks roughness_height"),
    (lambda: MeasuredSurface(1e6, R, bearing=(0.0, 0.6, 0.5, 1.0)),
     r"MeasuredSurface: bearing = \[0\.0, 0\.6, 0\.5, 1\.0\] must be .*never fall"),
    (lambda: MeasuredSurface(1e6, R, bearing=(0.1, 1.0, 1.0)), "start with 0"),
    (lambda: MeasuredSurface(1e6, R, bearing=(0.0, 1.0)), "at least three"),
    (lambda: MeasuredSurface(1e6, R, -1.0), r"MeasuredSurface: damping = -1\.0 must be zero or"),
    (lambda: MeasuredSurface(1e6, bearing=(0.0, 0.2, 1.0), file="x.txt"), "cannot be combined"),
    (lambda: MeasuredSurface(1e6, R, bearing=(0.0, 0.2, 1.0), depths=(0.0, 1.0)),
     r"depths = \[0\.0, 1\.0\] must be as many numbers as bearing"),
    (lambda: MeasuredSurface(1e6, R, depths=(0.0, 1.5, 1.0)), "growing from 0 to 1"),
    (lambda: MeasuredSurface.from_heights([0.0, 1e-6, 0.0], [0.0, 1.0], stiffness=1e6),
     "2 values for 3 heights"),
    (lambda: MeasuredSurface.from_heights("abc", stiffness=1e6),
     "heights = 'abc' must be a list of numbers"),
    (lambda: LinearContact(0.0), r"LinearContact: stiffness = 0\.0 must be above zero"),
    (lambda: LinearContact(1.0, -1.0), "damping = -1.0 must be zero or above"),
    (lambda: PowerContact(1.0, "lin"), "exponent = 'lin' must be .*did you mean 'line'"),
    (lambda: BackBurdekinContact(1.0, 1.0, "point"), "exponent = 'point' must be a number"),
    (lambda: RestitutionContact(1.0, -0.1, 1.0, damping_model="hunt-crossley"), "zero to 1"),
    (lambda: PowerContact(1.0, 0.9), r"PowerContact: exponent = 0\.9 must be one or above"),
    (lambda: PowerContact(1.0, 1.5, -1.0), "damping_factor"),
    (lambda: RestitutionContact(1.0, 0.0, 1.0),
     r"restitution = 0\.0 must be above zero and at most 1"),
    (lambda: RestitutionContact(1.0, 1.1, 1.0, damping_model="lankarani-nikravesh"),
     r"restitution = 1\.1 must be zero to 1"),
    (lambda: RestitutionContact(1.0, 0.5, 0.0), "reference_velocity"),
    (lambda: RestitutionContact(1.0, 0.5, 1.0, damping_model="floris"), "did you mean 'flores'"),
    (lambda: BackBurdekinContact(1.0, 1.0, 1.5),
     r"exponent = 1\.5 must be above zero and at most 1"),
    (lambda: BackBurdekinContact(-1.0, 1.0), "nominal_area"),
    (lambda: ExponentialContact(1.0, 0.0), "decay_length"),
    (lambda: ExponentialContact(0.0, 1.0), "ExponentialContact: force"),
    (lambda: GreenwoodWilliamson(0.0, 1.0, 1.0, 1.0), "asperities"),
    (lambda: GreenwoodWilliamson(1.0, 1.0, 1.0, 1.0, 3.0, -1.0), "damping_factor"),
    (lambda: TwoSidedStop(1.0, -1.0), r"TwoSidedStop: clearance = -1\.0 must be zero or above"),
    (lambda: TwoSidedStop(1.0, 1.0, 0.5), "exponent"),
    (lambda: PrescribedForce(-1.0), r"PrescribedForce: force = -1\.0 must be zero or above"),
])
def test_values_are_checked(make, message):
    with pytest.raises(InputError, match=message):
        make()
