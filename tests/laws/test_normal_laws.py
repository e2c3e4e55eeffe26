"""Normal laws: the contract, values against their definitions, impacts, messages."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import normal_conformance as conformance
import numpy as np
import pytest
from normal_conformance import check_normal_law
from scipy.integrate import quad, solve_ivp

from fecontact.errors import InputError
from fecontact.laws.contract import NormalLaw, PerNode, normal_law
from fecontact.laws.normal import CosineSurface, GaussianSurface, ParabolicSurface, RoughSurface
from fecontact.laws.normal_measured import MeasuredSurface
from fecontact.laws.normal_power import PowerContact, PowerLawContact, RestitutionContact
from fecontact.laws.normal_statistical import ExponentialContact, GreenwoodWilliamson
from fecontact.laws.normal_stop import LinearContact, PrescribedForce, TwoSidedStop
from fecontact.laws.potential import stored_energy
from fecontact.laws.soundness import require_sound

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
    "hertz": (PowerContact(1e9, 1.5, 0.7), IMPACT),
    "power 1": (PowerContact(1e6, 1.0, 0.7), IMPACT),
    "power 2": (PowerContact(1e9, 2.0), IMPACT),
    "power 3.3": (PowerContact(1e12, 3.3, 2.0), IMPACT),
    "restitution": (RestitutionContact(1e9, 0.7, 0.2), IMPACT),
    "back-burdekin": (PowerLawContact(1e-3, 6e-10, 0.5, 0.3), (-2e-5, 1e-5)),
    "back-burdekin 0.4": (PowerLawContact(1e-3, 6e-9, 0.4), (-2e-5, 1e-5)),
    "exponential": (ExponentialContact(10.0, 1e-6, 0.3), (-6e-5, 2.5e-5)),
    "greenwood": (GreenwoodWilliamson(1e4, 1e-4, 1e11, 1e-6, 3.0, 0.3), (-8e-6, 1.6e-5)),
    "prescribed": (PrescribedForce(14.0), MICRO),
    "stop": (TwoSidedStop(1e6, 3e-5, 1.0, 0.4), (-1e-4, 6e-5)),
    "stop 1.5": (TwoSidedStop(1e9, 3e-5, 1.5, 0.4), (-1e-4, 6e-5)),
    "user": (TwoSlopes(), MICRO),
}


@pytest.mark.parametrize("name", LAWS)
def test_contract(name):
    law, u_range = LAWS[name]
    check_normal_law(law, u_range, (-5.0, 5.0), two_sided=isinstance(law, TwoSidedStop))


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
    np.testing.assert_allclose(stored_energy(law, u, share), law.stored_energy(u, share),
                               rtol=3e-4 if name == "measured" else 1e-6, atol=1e-18)


def test_energy_of_a_body_far_above_the_surface():
    """All that a Greenwood-Williamson contact can give back: C sigma F_5/2(h_0) / (5/2)."""
    law = GreenwoodWilliamson(1e4, 1e-4, 1e11, 1e-6, separation=0.5)
    scale = law.table(np.ones(1))[0, 0]
    expected = -scale * 1e-6 * _asperity_integral(2.5, 0.5) / 2.5
    energy = law.stored_energy(np.array([[-2e-5], [-1e-3], [-1.0]]), np.ones(1))
    assert energy == pytest.approx(np.full((3, 1), expected), rel=1e-8)
    energy = ExponentialContact(3.0, 1e-6).stored_energy(np.array([-1e-3]), np.ones(1))
    assert energy == pytest.approx([-3e-6], rel=1e-12)


def test_penetration_scales():
    assert LinearContact((1e6, 4e6)).penetration_scale == 2.5e-7
    assert PowerContact(1e9, 1.5).penetration_scale == pytest.approx(1e-6, rel=1e-12)
    assert PowerContact((1e9, 8e9), 1.5).penetration_scale == pytest.approx(2.5e-7, rel=1e-12)
    assert TwoSidedStop(1e9, 1.0, 1.5).penetration_scale == pytest.approx(1e-6, rel=1e-12)
    assert ExponentialContact(1.0, (3e-6, 2e-6)).penetration_scale == 2e-6
    assert GreenwoodWilliamson(1.0, 1.0, 1.0, 3e-6).penetration_scale == 3e-6


def force(law, u, v=0.0):
    return law.kernel.python(u, v, law.table(np.ones(1))[0])


# Rough surfaces ----------------------------------------------------------------------------------

def _gaussian(deviation):
    def density(z):
        return (math.exp(-0.5 * ((z - 0.5) / deviation) ** 2) / deviation
                / math.sqrt(2.0 * math.pi) / math.erf(0.5 / deviation / math.sqrt(2.0)))

    return density


DENSITIES = [
    (RoughSurface(1e6, R, 40.0), lambda z: 1.0),
    (ParabolicSurface(1e6, R, 40.0), lambda z: 6.0 * z * (1.0 - z)),
    (CosineSurface(1e6, R, 40.0), lambda z: 2.0 * math.sin(math.pi * z) ** 2),
    *((GaussianSurface(1e6, R, 40.0, s), _gaussian(s)) for s in (0.05, 1.0 / 6.0, 0.4, 1.0)),
]


@pytest.mark.parametrize(("law", "density"), DENSITIES)
@pytest.mark.parametrize("s", [1e-5, 1e-3, 0.01, 0.03, 0.079, 0.081, 0.2, 0.5, 0.77, 0.999, 1.0,
                               1.4, 30.0])
def test_force_is_that_of_the_density(law, density, s):
    """f and h by quadrature of p, F = c R f + d h v and its slopes c h + d p v / R and d h."""
    top = min(s, 1.0)
    options = {"epsabs": 0.0, "epsrel": 1e-12}
    f = quad(lambda z: (s - z) * density(z), 0.0, top, **options)[0]
    h = quad(density, 0.0, top, **options)[0]
    p = density(s) if s < 1.0 else 0.0
    assert force(law, s * R) == pytest.approx((1e6 * R * f, 1e6 * h, 40.0 * h), rel=1e-9)
    v = 0.02
    expected = (1e6 * R * f + 40.0 * h * v, 1e6 * h + 40.0 * p * v / R, 40.0 * h)
    assert force(law, s * R, v) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", [RoughSurface, ParabolicSurface, CosineSurface, GaussianSurface,
                                  MeasuredSurface])
def test_smooth_in_the_limit(kind):
    """A surface of vanishing roughness is the linear contact."""
    smooth, rough = LinearContact(1e6, 40.0), kind(1e6, 1e-13, 40.0)
    for u in (1e-8, 3e-6, 1e-4):
        for v in (-1.0, -1e-3, 0.0, 2e-3):
            assert force(rough, u, v) == pytest.approx(force(smooth, u, v), rel=2e-5, abs=1e-6)


def test_penetration_scale_of_a_surface_is_the_smallest_roughness():
    assert GaussianSurface(1e6, (R, 2 * R), 0.0).penetration_scale == R


# Measured profiles -------------------------------------------------------------------------------

def test_straight_flank_is_uniform():
    law = MeasuredSurface.from_heights(np.linspace(3e-6, 8e-6, 11), stiffness=1e6, damping=40.0)
    assert law.roughness_height == pytest.approx(R, rel=1e-12)
    for s in (0.1, 0.501, 0.99, 1.7):
        assert force(law, s * R, 0.01) == pytest.approx(
            force(RoughSurface(1e6, R, 40.0), s * R, 0.01), rel=1e-12)


def test_measured_sine():
    """A sine has the bearing curve arccos(1 - 2 s) / pi."""
    x = np.linspace(0.0, 3.0, 6001)
    law = MeasuredSurface.from_heights(R / 2.0 * np.cos(2.0 * np.pi * x), x, stiffness=1e6)
    for s in (0.005, 0.02, 0.1, 0.33, 0.5, 0.8, 0.97, 1.0):
        h = math.acos(1.0 - 2.0 * s) / math.pi
        f = quad(lambda z: math.acos(1.0 - 2.0 * z) / math.pi, 0.0, s, epsrel=1e-12)[0]
        load, slope, _ = force(law, s * R)
        assert slope == pytest.approx(1e6 * h, rel=1e-4 if s > 0.01 else 1e-3)
        assert load == pytest.approx(1e6 * R * f, rel=1e-3 if s > 0.01 else 5e-3)


@pytest.mark.parametrize("abscissa", [False, True])
def test_measured_trace_against_its_own_points(abscissa):
    """The bed of asperities at many points of the trace, each with its part of the length."""
    rng = np.random.default_rng(3)
    fine = np.convolve(rng.normal(size=4200), np.hanning(200), "valid") * 1e-7
    x = np.cumsum(rng.uniform(0.5, 1.5, len(fine))) if abscissa else np.arange(len(fine)) * 1.0
    law = MeasuredSurface.from_heights(fine, x if abscissa else None, stiffness=1e6, damping=40.0)
    between = np.interp(np.arange(0.0, len(x) - 1.0, 0.01), np.arange(len(x)), x)
    x, fine = between, np.interp(between, x, fine)
    weight = np.gradient(x)
    weight[[0, -1]] /= 2.0
    weight /= weight.sum()
    depth = fine.max() - fine
    height = np.ptp(fine)
    assert law.roughness_height == pytest.approx(height, rel=1e-12)
    for s in (0.1, 0.25, 0.5, 0.75, 1.0, 1.5):
        load, slope, damping = force(law, s * height)
        touching = weight * (depth < s * height)
        assert load == pytest.approx(1e6 * (touching @ (s * height - depth)), rel=3e-3)
        assert slope == pytest.approx(1e6 * touching.sum(), abs=4e-3 * 1e6)
        assert damping == pytest.approx(40.0 * touching.sum(), abs=4e-3 * 40.0)
    # At the depths that the curve is given for it is that of the trace.
    for k in (8, 20, 40):
        touching = weight @ (depth < law.depths[k] * height)
        assert law.bearing[k] == pytest.approx(touching, abs=5e-5)
    # All asperities in contact: the mean of the trace.
    expected = 1e6 * (1.5 * height - weight @ depth)
    assert force(law, 1.5 * height)[0] == pytest.approx(expected, rel=5e-4)


def test_plateau_of_a_trace():
    """A fifth of the length is a flat top: it bears at once, within one step of depth."""
    law = MeasuredSurface.from_heights([1e-6, 1e-6, 0.0], [0.0, 0.2, 1.0], stiffness=1e6)
    assert force(law, 0.5e-6)[1] == pytest.approx(1e6 * (0.2 + 0.8 * 0.5), rel=1e-9)


def test_files(tmp_path):
    x = np.linspace(0.0, 1.0, len(TRACE))
    one, two = tmp_path / "one.txt", tmp_path / "two.csv"
    one.write_text("# heights\n\n" + "\n".join(f"{z:.17g}" for z in TRACE))
    two.write_text("\n".join(f"{a:.17g}; {z * 1e6:.17g} # um"
                             for a, z in zip(x, TRACE, strict=True)))
    expected = MeasuredSurface.from_heights(TRACE)
    assert MeasuredSurface.from_file(one) == expected
    assert MeasuredSurface(file=str(one)) == expected
    scaled = MeasuredSurface.from_file(two, scale=1e-6)
    assert scaled.bearing == pytest.approx(expected.bearing, rel=1e-9, abs=1e-12)
    assert scaled.roughness_height == pytest.approx(expected.roughness_height, rel=1e-12)


@pytest.mark.parametrize(("text", "message"), [
    ("1.0\n2.0\nhigh\n", "line 3, 'high', must be a height"),
    ("1.0\n2.0 3.0\n", "line 2, '2.0 3.0', must be a height"),
    ("1 2 3\n", "line 1"), ("# nothing\n", "no heights"),
    ("0 1\n1 2\n1 3\n", r"abscissa\[2\] = 1 must be larger than the value before it, 1"),
    ("1\n1\n1\n", "all heights are 1"), ("1\n2\n", "2 values; a profile needs at least three"),
    ("1\nnan\n2\n", r"heights\[1\] = nan must be finite"),
])
def test_files_that_are_no_profile(tmp_path, text, message):
    file = tmp_path / "trace.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=rf"trace\.txt: .*{message}"):
        MeasuredSurface(file=str(file))


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"none\.txt: the profile cannot be read: No such file"):
        MeasuredSurface.from_file(tmp_path / "none.txt")


# Powers, exponentials, statistics ----------------------------------------------------------------

def test_values_of_simple_laws_by_hand():
    assert force(LinearContact(2e6, 50.0), 3e-6, 0.1) == (11.0, 2e6, 50.0)
    assert force(LinearContact(2e6, 50.0), 3e-6, -0.13) == (0.0, 0.0, 0.0)
    assert force(LinearContact(2e6, 50.0), -1e-9, 1.0) == (0.0, 0.0, 0.0)
    # K u^1.5 = 1e9 * 1e-9 = 1 N at 1 um.
    assert force(PowerContact(1e9, 1.5, 2.0), 1e-6, 0.1) == pytest.approx((1.2, 1.8e6, 2.0))
    # 6e-10 * (1e8 Pa)^0.5 = 6 um.
    law = PowerLawContact(1e-4, 6e-10, 0.5)
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


# Impacts -----------------------------------------------------------------------------------------

def impact(law, mass, speed):
    """Deepest penetration, duration and restitution of a mass that strikes a contact."""
    p = law.table(np.ones(1))[0]
    depth = quad_depth(law, p, mass, speed)
    time = depth / speed

    def rate(t, y):
        return [y[1], -law.kernel.python(y[0] * depth, y[1] * speed, p)[0] * time / mass / speed]

    def lost(t, y):
        # Just below zero where the clipped force is zero.
        return law.kernel.python(y[0] * depth, y[1] * speed, p)[0] - 1e-300 if t > 1e-3 else 1.0

    lost.terminal, lost.direction = True, -1
    # It starts just inside: a force that is zero at first contact would end the motion at once.
    result = solve_ivp(rate, (0.0, 20.0), [1e-13, 1.0], method="DOP853", rtol=1e-12, atol=1e-14,
                       events=lost, max_step=0.02)
    assert result.status == 1
    return depth, result.t_events[0][0] * time, -result.y_events[0][0][1]


def quad_depth(law, p, mass, speed):
    """Deepest penetration without damping."""
    from scipy.optimize import brentq

    energy = 0.5 * mass * speed**2

    def rest(u):
        return law.stored_energy(np.array([u]), np.ones(1))[0] - energy

    high = 1e-9
    while rest(high) < 0.0:
        high *= 2.0
    return brentq(rest, 0.0, high, xtol=1e-20, rtol=1e-14)


@pytest.mark.parametrize(("law", "product"), [
    (LinearContact(1e6), math.pi), (PowerContact(1e9, 1.5), 2.9432751843),
    (PowerContact(1e11, 2.0), 2.8043642107), (PowerContact(1e16, 3.0), 2.6220575543),
    (RoughSurface(1e6, 1e-2, 0.0), 2.8043642107), (TwoSidedStop(1e9, 1.0, 1.5), 2.9432751843),
    (PowerLawContact(1e-3, 6e-9, 1.0 / 3.0), 2.6220575543),
])
def test_duration_of_undamped_impacts(law, product):
    depth, duration, restitution = impact(law, 0.5, 0.2)
    assert duration * 0.2 / depth == pytest.approx(product, rel=1e-6)
    assert restitution == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(("zeta", "restitution"), [(0.05, 0.8587581018), (0.1, 0.7440793977),
                                                   (0.2, 0.5717400276)])
def test_restitution_of_the_linear_contact(zeta, restitution):
    mass, stiffness = 0.5, 1e6
    law = LinearContact(stiffness, 2.0 * zeta * math.sqrt(stiffness * mass))
    assert impact(law, mass, 0.2)[2] == pytest.approx(restitution, rel=1e-6)


@pytest.mark.parametrize(("b", "restitution"), [
    (0.02, 0.9569384399), (0.05, 0.8969657584), (0.1, 0.8081864188), (0.2, 0.6653065459),
    (0.5, 0.4095613395)])
def test_restitution_of_the_rough_surface(b, restitution):
    mass, speed, stiffness, height = 0.5, 0.2, 1e6, 1e-2
    depth = (3.0 * mass * speed**2 * height / stiffness) ** (1.0 / 3.0)
    law = RoughSurface(stiffness, height, b * depth / speed * stiffness)
    assert impact(law, mass, speed)[2] == pytest.approx(restitution, rel=1e-6)


HUNT_CROSSLEY = [(0.1, 0.9374755799), (0.5, 0.7484349316), (1.0, 0.5936242600),
                 (2.0, 0.4107196861)]


@pytest.mark.parametrize(("product", "restitution"), HUNT_CROSSLEY)
@pytest.mark.parametrize(("stiffness", "exponent"), [(1e6, 1.0), (1e9, 1.5), (1e14, 2.6)])
def test_restitution_of_hunt_crossley(product, restitution, stiffness, exponent):
    law = PowerContact(stiffness, exponent, product / 0.2)
    assert impact(law, 0.5, 0.2)[2] == pytest.approx(restitution, rel=1e-6)
    assert impact(TwoSidedStop(stiffness, 1.0, exponent, product / 0.2), 0.5, 0.2)[2] == (
        pytest.approx(restitution, rel=1e-6))


@pytest.mark.parametrize(("product", "restitution"), HUNT_CROSSLEY)
def test_damping_from_the_restitution(product, restitution):
    law = RestitutionContact(1e9, restitution, 0.2)
    assert law.damping_factor == pytest.approx(product / 0.2, rel=1e-8)


@pytest.mark.parametrize("e", [1e-4, 0.01, 0.3, 0.99, 0.9999, 1.0 - 2e-5, 1.0 - 1e-7, 1.0])
def test_hunt_crossley_over_all_restitutions(e):
    x = RestitutionContact(1e9, e, 1.0).damping_factor
    if e > 0.999:
        # Series of the logarithms for small x.
        assert x == pytest.approx(1.5 * (1.0 - e), rel=3.0 * (1.0 - e) + 1e-9, abs=0.0)
    elif e < 0.02:
        assert 1.0 - 1e-12 < x * e / (1.0 - math.exp(-x * (1.0 + e)) * (1.0 + x)) < 1.0 + 1e-12
    else:
        assert x * (1.0 + e) == pytest.approx(math.log((1.0 + x) / (1.0 - e * x)), rel=1e-10)


def test_damping_models_by_hand():
    e, v = 0.7, 0.5
    lankarani = RestitutionContact(1e9, e, v, damping_model="lankarani-nikravesh")
    flores = RestitutionContact(1e9, e, v, damping_model="flores")
    assert lankarani.damping_factor == pytest.approx(3 * 0.51 / 2.0, rel=1e-12)
    assert flores.damping_factor == pytest.approx(2.4 / 1.75, rel=1e-12)
    assert RestitutionContact(1e9, 0.0, v, damping_model="lankarani-nikravesh").damping_factor == (
        1.5)
    per_node = RestitutionContact(1e9, (0.7, 1.0), v, damping_model="flores")
    assert per_node.table(np.full(2, 0.5)).tolist() == [
        [5e8, 1.0, 1.5, flores.damping_factor], [5e8, 1.0, 1.5, 0.0]]


def test_models_agree_for_hard_impacts():
    """All three have chi v (1 - e) factors 3/2, 3/2 and 8/5 as e tends to one."""
    e = 0.9999
    product = {model: RestitutionContact(1e9, e, 1.0, damping_model=model).damping_factor / (1 - e)
               for model in RestitutionContact.choices["damping_model"]}
    assert list(product.values()) == pytest.approx([1.5, 1.5, 1.6], rel=2e-4)


# Messages ----------------------------------------------------------------------------------------

@pytest.mark.parametrize(("make", "message"), [
    (lambda: GaussianSurface(deviation=0.0),
     r"GaussianSurface: deviation = 0\.0 must be at least 0\.02 and at most 1"),
    (lambda: CosineSurface(stiffness=-1.0), r"CosineSurface: stiffness = -1\.0 must be above zero"),
    (lambda: MeasuredSurface(bearing=(0.0, 0.6, 0.5, 1.0)),
     r"MeasuredSurface: bearing = \[0\.0, 0\.6, 0\.5, 1\.0\] must be .*never fall"),
    (lambda: MeasuredSurface(bearing=(0.1, 1.0, 1.0)), "start with 0"),
    (lambda: MeasuredSurface(bearing=(0.0, 1.0)), "at least three"),
    (lambda: MeasuredSurface(damping=-1.0), r"MeasuredSurface: damping = -1\.0 must be zero or"),
    (lambda: MeasuredSurface(bearing=(0.0, 0.2, 1.0), file="x.txt"), "cannot stand beside"),
    (lambda: MeasuredSurface(bearing=(0.0, 0.2, 1.0), depths=(0.0, 1.0)),
     r"depths = \[0\.0, 1\.0\] must be as many numbers as bearing"),
    (lambda: MeasuredSurface(depths=(0.0, 1.5, 1.0)), "growing from 0 to 1"),
    (lambda: MeasuredSurface.from_heights([0.0, 1e-6, 0.0], [0.0, 1.0]), "2 values for 3 heights"),
    (lambda: MeasuredSurface.from_heights("abc"), "heights must be a list of numbers"),
    (lambda: LinearContact(0.0), r"LinearContact: stiffness = 0\.0 must be above zero"),
    (lambda: LinearContact(1.0, -1.0), "damping = -1.0 must be zero or above"),
    (lambda: PowerContact(1.0, 0.9), r"PowerContact: exponent = 0\.9 must be at least 1"),
    (lambda: PowerContact(1.0, 1.5, -1.0), "damping_factor"),
    (lambda: RestitutionContact(1.0, 0.0, 1.0),
     r"restitution = 0\.0 must be above zero and at most 1"),
    (lambda: RestitutionContact(1.0, 1.1, 1.0, damping_model="lankarani-nikravesh"),
     r"restitution = 1\.1 must be zero to 1"),
    (lambda: RestitutionContact(1.0, 0.5, 0.0), "reference_velocity"),
    (lambda: RestitutionContact(1.0, 0.5, 1.0, damping_model="floris"), "did you mean 'flores'"),
    (lambda: PowerLawContact(1.0, 1.0, 1.5), r"exponent = 1\.5 must be above zero and at most 1"),
    (lambda: PowerLawContact(-1.0, 1.0), "nominal_area"),
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
