"""Friction with memory: loops, limits and energies that have closed forms."""

import math

import numpy as np
import pytest
from friction_conformance import check_memory_law, memory_outputs, parameters
from law_values import made
from scipy.integrate import solve_ivp

from fecontact import InputError
from fecontact.laws import (
    BoucWenFriction,
    DahlFriction,
    FourParameterIwanFriction,
    IwanFriction,
    JenkinsFriction,
    LuGreFriction,
    ParallelSliders,
)

LAWS = [
    JenkinsFriction(2e6, 0.4), JenkinsFriction((2e6, 1e6), (0.4, 0.7)),
    IwanFriction(2e6, 0.4, elements=5), IwanFriction(2e6, 0.4, elements=1),
    FourParameterIwanFriction(2e6, 0.4, -0.5, 0.1, elements=2),
    FourParameterIwanFriction((2e6, 1e6), 0.4, chi=-0.8, beta=0.0, elements=2, spacing_ratio=1.5),
    ParallelSliders((2e6, 1e6), 0.4, (1.0, 2.0), (1.0, 3.0)),
    DahlFriction(0.4, 2e5), DahlFriction((0.4, 0.5), 2e5, 1.5), DahlFriction(0.4, 2e5, 2.0),
    LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5), LuGreFriction(0.8, 0.5, 2e-3, 1.0, 1e5, 30.0, 20.0),
    LuGreFriction(0.8, 0.5, 2e-3, 0.7, 1e5, 30.0, 0.0, 10.0),
    BoucWenFriction(0.55, 5e-6), BoucWenFriction(0.4, (5e-6, 1e-5), 0.7, 2.0),
    BoucWenFriction(0.4, 5e-6, 1.0, 1.5),
]


def driven(law, speed, times, F=lambda t: 1.0, start=None, rtol=1e-9, **options):
    """Friction force R at times, and the internal variables, under a given slip velocity."""
    p = parameters(law)[0]

    def rate(t, z):
        return memory_outputs(law, speed(t), F(t), z, p)[1][:, 0]

    def jacobian(t, z):
        return memory_outputs(law, speed(t), F(t), z, p)[1][:, 3:]

    start = np.zeros(law.memory) if start is None else start
    solution = solve_ivp(rate, (times[0], times[-1]), start, method="BDF", jac=jacobian,
                         t_eval=times, rtol=rtol, atol=1e-2 * rtol * law.state_scale, **options)
    assert solution.success
    forces = [memory_outputs(law, speed(t), F(t), z, p)[0][0]
              for t, z in zip(times, solution.y.T, strict=True)]
    return np.array(forces), solution.y.T


def to_and_fro(law, X, F, cycles=2, points=4001):
    """Displacement and R over the last cycle of a harmonic displacement of amplitude X, 1 Hz."""
    w = 2.0 * math.pi
    times = np.linspace(0.0, cycles, (points - 1) * cycles + 1)
    R, z = driven(law, lambda t: X * w * math.sin(w * t), times, lambda t: F,
                  max_step=1.0 / 200.0)
    x = -X * np.cos(w * times)
    return x[-points:], R[-points:], z[-points:]


def loss(x, R):
    return float(np.sum(0.5 * (R[1:] + R[:-1]) * np.diff(x)))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_conformance(law):
    check_memory_law(law, 5e-3 if isinstance(law, LuGreFriction) else None)


# Jenkins and Iwan --------------------------------------------------------------------------------

@pytest.mark.parametrize("ratio", [1.2, 3.0, 20.0])
def test_loss_of_jenkins_element(ratio):
    k, mu, F = 2e6, 0.4, 25.0
    X = ratio * mu * F / k
    x, R, _ = to_and_fro(JenkinsFriction(k, mu), X, F)
    assert loss(x, R) == pytest.approx(4.0 * mu * F * (X - mu * F / k), rel=1e-4)
    assert np.abs(R).max() == pytest.approx(mu * F, rel=1e-12)


def test_jenkins_element_below_its_limit_is_a_spring():
    k, mu, F = 2e6, 0.4, 25.0
    X = 0.45 * mu * F / k
    x, force, _ = to_and_fro(JenkinsFriction(k, mu), X, F)
    assert force == pytest.approx(k * (x + X), abs=1e-6 * mu * F)
    assert abs(loss(x, force)) < 1e-6 * mu * F * X


def test_jenkins_element_follows_a_falling_limit():
    """Held at its limit, the spring gives way as the normal force falls, and vanishes with it."""
    k, mu = 2e6, 0.4
    times = np.linspace(0.0, 1.5, 301)
    force, z = driven(JenkinsFriction(k, mu), lambda t: 0.0, times,
                      lambda t: max(0.0, 25.0 * (1.0 - t)), start=np.array([mu * 25.0 / k]),
                      max_step=0.01)
    limit = mu * 25.0 * np.maximum(0.0, 1.0 - times)
    assert force == pytest.approx(limit, rel=1e-9, abs=1e-9)
    # It lags by the return time of the rates: 25 mu tau / k.
    assert k * z[:, 0] == pytest.approx(limit, abs=1e-5)


def backbone(x, k, limit, count):
    parts = (2.0 * np.arange(count) + 1.0) / count**2 * limit
    return sum(np.clip(k / count * x, -part, part) for part in parts)


@pytest.mark.parametrize("count", [1, 4, 8])
def test_masing_rules_of_iwan(count):
    k, mu, F = 2e6, 0.4, 25.0
    law = IwanFriction(k, mu, elements=count)
    X = 0.8 * mu * F / k
    speed = 2.0 * X
    # First loading to X, unloading to -X, reloading to X: piecewise constant slip velocity.
    times = np.linspace(0.0, 0.5, 101)
    loading, z = driven(law, lambda t: speed, times, lambda t: F, max_step=0.005)
    x = speed * times
    assert loading == pytest.approx(backbone(x, k, mu * F, count), abs=1e-6 * mu * F)
    unloading, z = driven(law, lambda t: -2.0 * speed, times, lambda t: F, start=z[-1],
                          max_step=0.005)
    fallen = 2.0 * speed * times
    doubled = loading[-1] - 2.0 * backbone(fallen / 2.0, k, mu * F, count)
    assert unloading == pytest.approx(doubled, abs=1e-6 * mu * F)
    assert unloading[-1] == pytest.approx(-loading[-1], abs=1e-6 * mu * F)
    reloading, _ = driven(law, lambda t: 2.0 * speed, times, lambda t: F, start=z[-1],
                          max_step=0.005)
    assert reloading == pytest.approx(-doubled, abs=1e-6 * mu * F)


def test_many_iwan_elements_follow_the_parabola():
    k, limit = 2e6, 10.0
    law = IwanFriction(k, 0.4, elements=200)
    p, x = parameters(law)[0], np.linspace(0.0, 3.0 * limit / k, 50)
    R = [memory_outputs(law, 1.0, 25.0, np.full(200, value), p)[0][0] for value in x]
    smooth = np.where(x < 2.0 * limit / k, k * x - (k * x) ** 2 / (4.0 * limit), limit)
    np.testing.assert_allclose(R, smooth, atol=1e-4 * limit)


# Segalman's numbers: F_S = 3 N, K_T = 2 N/m, chi = -0.1, beta = 0.1.
CHI, BETA, PHI_MAX = -0.1, 0.1, 2.87614679


def joint(elements, spacing_ratio, chi=CHI, beta=BETA):
    return FourParameterIwanFriction(2.0, 0.6, chi=chi, beta=beta, elements=elements,
                                     spacing_ratio=spacing_ratio)


def first_loading(law, x, F=5.0):
    p = parameters(law)[0]
    return memory_outputs(law, 0.0, F, np.full(law.memory, x), p)[0][0]


def loss_of_elements(law, X, F=5.0):
    """Sum of 4 L (X - L / k) over the elements that slide, of limit L and stiffness k."""
    springs, limits = law.shares
    stiffness, limit = 2.0 * springs, 0.6 * F * limits
    return float((4.0 * limit * np.maximum(0.0, X - limit / stiffness)).sum())


@pytest.mark.parametrize(("elements", "ratio", "error"), [(50, 1.1, 2e-3), (400, 1.01, 1e-4)])
def test_four_parameter_iwan_follows_segalmans_closed_forms(elements, ratio, error):
    law = joint(elements, ratio)
    assert first_loading(law, 0.1 * PHI_MAX) == pytest.approx(0.540580035, rel=error)
    assert loss_of_elements(law, 0.5 * PHI_MAX) == pytest.approx(1.31650745, rel=error)
    # Macroslip begins at phi_max, from a kink: the delta is the last element that slides.
    springs, limits = law.shares
    assert 3.0 * limits[-1] / (2.0 * springs[-1]) == pytest.approx(PHI_MAX, rel=1e-8)
    for x in (PHI_MAX, 2.0 * PHI_MAX):
        assert first_loading(law, x) == pytest.approx(3.0, rel=1e-9)
    left = (3.0 - first_loading(law, 0.999 * PHI_MAX)) / (1e-3 * PHI_MAX)
    assert left == pytest.approx(2.0 * BETA / (1.0 + BETA), rel=1e-5)
    assert first_loading(law, 1e-6 * PHI_MAX) == pytest.approx(2e-6 * PHI_MAX, rel=1e-12)
    # The normal force scales F_S, and phi_max with it.
    assert first_loading(law, 0.2 * PHI_MAX, 10.0) == pytest.approx(
        2.0 * first_loading(law, 0.1 * PHI_MAX), rel=1e-12)


@pytest.mark.parametrize(("chi", "beta"), [(-0.8, 0.0), (-0.5, 0.1), (-0.1, 1.0)])
def test_loss_exponent_is_three_plus_chi(chi, beta):
    law = joint(60, 1.1, chi, beta)
    arm = (chi + 1.0) / (chi + 2.0)
    largest = 3.0 * (1.0 + beta) / (2.0 * (beta + arm))
    r = 3.0 * (chi + 1.0) / (largest ** (chi + 2.0) * (beta + arm))
    sizes = largest * np.array([0.01, 0.03, 0.1, 0.3])
    losses = np.array([loss_of_elements(law, X) for X in sizes])
    exact = 4.0 * r * sizes ** (chi + 3.0) / ((chi + 2.0) * (chi + 3.0))
    assert losses == pytest.approx(exact, rel=0.01)
    assert np.polyfit(np.log(sizes), np.log(losses), 1)[0] == pytest.approx(3.0 + chi, abs=0.005)


def test_default_elements_keep_the_stated_error():
    law, fine = joint(16, 1.3), joint(2000, 1.005)
    for part in (0.02, 0.05, 0.1, 0.2, 0.5, 0.9):
        X = part * PHI_MAX
        assert loss_of_elements(law, X) == pytest.approx(loss_of_elements(fine, X), rel=0.06)


def test_cycle_of_four_parameter_iwan_loses_what_its_elements_do():
    """Loss by the rates of the law, over a harmonic cycle; the elements relax within tau."""
    law = joint(12, 1.5)
    x, R, _ = to_and_fro(law, 0.5 * PHI_MAX, 5.0, points=1001)
    assert loss(x, R) == pytest.approx(loss_of_elements(law, 0.5 * PHI_MAX), rel=1e-3)
    assert loss(x, R) == pytest.approx(1.31650745, rel=0.03)


def test_stiffness_is_shared_and_friction_does_not_depend_on_the_sharing():
    whole, F, z = JenkinsFriction(2e6, 0.4), 25.0, 3e-6
    share = np.array([0.25, 0.75])
    parts = [memory_outputs(whole, 0.0, s * F, np.array([z]), p)[0][0]
             for s, p in zip(share, whole.table(share), strict=True)]
    assert sum(parts) == pytest.approx(2e6 * z, rel=1e-12)


# Dahl --------------------------------------------------------------------------------------------

def test_dahls_curve():
    """First loading R = mu F (1 - exp(-sigma x / mu)), unloading from sliding its mirror image."""
    mu, sigma, F = 0.4, 2e5, 25.0
    law = DahlFriction(mu, sigma)
    times = np.linspace(0.0, 1.0, 201)
    x = 1e-5 * times
    force, _ = driven(law, lambda t: 1e-5, times, lambda t: F)
    assert force == pytest.approx(mu * F * -np.expm1(-sigma * x / mu), rel=1e-6, abs=1e-9)
    force, _ = driven(law, lambda t: -1e-5, times, lambda t: F, start=np.array([mu / sigma]))
    mirrored = mu * F * (2.0 * np.exp(-sigma * x / mu) - 1.0)
    assert force == pytest.approx(mirrored, rel=1e-6, abs=1e-6)
    # Exponent 2: u' = (1 - u)^2 with u = R / (mu F), so u = s / (1 + s).
    force, _ = driven(DahlFriction(mu, sigma, 2.0), lambda t: 1e-5, times, lambda t: F)
    s = sigma * x / mu
    assert force == pytest.approx(mu * F * s / (1.0 + s), rel=1e-6, abs=1e-9)


# LuGre -------------------------------------------------------------------------------------------

def test_lugre_before_sliding():
    """Stiffness sigma_0 F and damping (sigma_1 + sigma_2) F at rest."""
    law = LuGreFriction(0.8, 0.5, 2e-3, 2.0, 1e5, 30.0, 5.0)
    force, rates = memory_outputs(law, 0.0, 25.0, np.zeros(1), parameters(law)[0])
    assert force == pytest.approx([0.0, 25.0 * 35.0, 0.0, 25.0 * 1e5])
    assert rates.tolist() == [[0.0, 1.0, 0.0, 0.0]]
    # A slow pull by 2 % of the sliding deflection: R = F sigma_0 x but for 1 % of curvature.
    times = np.linspace(0.0, 1.0, 11)
    force, _ = driven(law, lambda t: 1.6e-7, times, lambda t: 25.0)
    x = 1.6e-7 * times
    exact = 0.8 * -np.expm1(-1e5 * x / 0.8) + 30.0 * 1.6e-7 * np.exp(-1e5 * x / 0.8) + 5.0 * 1.6e-7
    assert force == pytest.approx(25.0 * exact, rel=1e-6)


@pytest.mark.parametrize("v", [-5e-3, -1e-4, 1e-6, 1e-3, 2e-3, 0.1])
def test_lugre_slides_along_its_stribeck_curve(v):
    law = LuGreFriction(0.8, 0.5, 2e-3, 2.0, 1e5, 30.0, 5.0)
    times = np.linspace(0.0, 3e-4 / abs(v), 3)
    force, _ = driven(law, lambda t: v, times, lambda t: 25.0)
    curve = (0.5 + 0.3 * math.exp(-((v / 2e-3) ** 2))) * math.copysign(1.0, v) + 5.0 * v
    assert force[-1] == pytest.approx(25.0 * curve, rel=1e-6)
    assert law.steady_coefficient(v) == pytest.approx(curve, rel=1e-12)


def test_lugre_break_away_needs_less_force_at_a_faster_pull():
    """The frictional lag of the law: the static peak falls with the rate of the force."""
    law = LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5)
    peaks = []
    for v in (1e-5, 1e-3, 1e-2):
        times = np.linspace(0.0, 1e-4 / v, 2001)
        peaks.append(driven(law, lambda t, v=v: v, times)[0].max())
    assert peaks[0] == pytest.approx(0.8, rel=1e-3)
    assert peaks[0] > peaks[1] > peaks[2]


@pytest.mark.parametrize("law", [
    LuGreFriction(0.8, 0.4, 1e-3, 2.0, 1e5, 300.0, 300.0),
    LuGreFriction(0.8, 0.4, 1e-3, 2.0, 1e5, 300.0, 0.0, 81.0),
])
def test_lugre_with_the_stated_bounds_is_passive(law):
    """Power less the growth of sigma_0 z^2 / 2 is never negative, wherever z can be."""
    p = parameters(law)[0]
    for v in np.geomspace(1e-6, 1.0, 61):
        for u in np.linspace(-0.8, 0.8, 41):
            force, rates = memory_outputs(law, v, 1.0, np.array([u / 1e5]), p)
            assert force[0] * v - u * rates[0, 0] >= -1e-15

# Bouc-Wen ----------------------------------------------------------------------------------------

@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_bouc_wen_curve_of_first_loading(exponent):
    """z' = 1 - z^n over x / u_s: 1 - exp(-x / u_s) for n = 1, tanh for n = 2."""
    law = BoucWenFriction(0.4, 5e-6, 0.7, exponent)
    times = np.linspace(0.0, 1.0, 101)
    s = 20.0 * times
    force, z = driven(law, lambda t: 1e-4, times, lambda t: 25.0)
    expected = -np.expm1(-s) if exponent == 1.0 else np.tanh(s)
    assert force == pytest.approx(10.0 * expected, rel=1e-6, abs=1e-8)
    assert np.abs(z).max() <= 1.0 + 1e-9


def test_bouc_wen_unloads_along_the_initial_stiffness():
    law = BoucWenFriction(0.4, 5e-6)
    times = np.linspace(0.0, 1.0, 11)
    force, _ = driven(law, lambda t: -5e-6, times, lambda t: 25.0, start=np.ones(1))
    assert force == pytest.approx(10.0 * (1.0 - times), abs=1e-6)


def test_bouc_wen_of_beta_one_is_dahl():
    bouc_wen, dahl = BoucWenFriction(0.4, 2e-6, 1.0), DahlFriction(0.4, 2e5)
    rng = np.random.default_rng(2)
    for v, u in zip(rng.normal(size=50), rng.uniform(-1.2, 1.2, 50), strict=True):
        a, a_rates = memory_outputs(bouc_wen, v, 25.0, np.array([u]), parameters(bouc_wen)[0])
        b, b_rates = memory_outputs(dahl, v, 25.0, np.array([u * 2e-6]), parameters(dahl)[0])
        assert a[0] == pytest.approx(b[0], rel=1e-12)
        assert a_rates[0, 0] * 2e-6 == pytest.approx(b_rates[0, 0], rel=1e-12)


# Coulomb's limit, stick, parameters --------------------------------------------------------------

@pytest.mark.parametrize("law", [
    JenkinsFriction(1e9, 0.4), IwanFriction(1e9, 0.4), DahlFriction(0.4, 1e9),
    LuGreFriction(0.4, 0.4, 1e-3, 2.0, bristle_stiffness=1e9), BoucWenFriction(0.4, 4e-10),
], ids=lambda law: type(law).__name__)
def test_stiff_laws_lose_what_coulomb_friction_does(law):
    X, F = 1e-6, 1.0
    x, R, _ = to_and_fro(law, X, F, points=8001)
    assert loss(x, R) == pytest.approx(4.0 * 0.4 * F * X, rel=2e-3)


def test_stick_follows_the_force():
    law = LuGreFriction(static_coefficient=(0.8, 0.6), kinetic_coefficient=0.5,
                        stribeck_velocity=1e-3, bristle_stiffness=1e5, stribeck_exponent=2.0)
    v, F = np.array([[0.0, 1e-2]]), np.array([[10.0, 20.0]])
    assert law.sticks(v, F, np.array([[7.5, 9.4]])).tolist() == [[True, True]]
    assert law.sticks(v, F, np.array([[-7.7, -9.6]])).tolist() == [[False, False]]


def test_scales_are_those_of_the_pre_sliding_deflection():
    assert DahlFriction(0.4, 2e5).state_scale == pytest.approx([2e-6])
    assert LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5).state_scale == pytest.approx([5.5e-6])
    assert BoucWenFriction(0.4, (2e-6, 1e-6)).velocity_scale == pytest.approx(1e-5)
    assert JenkinsFriction(2e6, 0.4).state_scale == pytest.approx([2e-7])
    assert JenkinsFriction((1e6, 1e6), 0.4).state_scale == pytest.approx([2e-7])
    assert IwanFriction(2e6, 0.4, elements=2).state_scale == pytest.approx([1e-7, 3e-7])


@pytest.mark.parametrize(("kind", "values", "message"), [
    (JenkinsFriction, {"stiffness": 0.0}, "JenkinsFriction: stiffness = 0.0 must be above zero"),
    (JenkinsFriction, {"friction_coefficient": -1.0}, "friction_coefficient"),
    (IwanFriction, {"elements": 0}, "IwanFriction: elements = 0 must be a whole number"),
    (IwanFriction, {"elements": 2.5}, "elements = 2.5 must be a whole number"),
    (IwanFriction, {"elements": 1e9}, "elements = 1000000000.0 must be .* from 1 to 10000"),
    (FourParameterIwanFriction, {"elements": 10**9}, "must be a whole number from 1 to 10000"),
    (IwanFriction, {"elements": (2, 3)}, "elements"),
    (IwanFriction, {"elements": "many"}, "elements = 'many' must be a number"),
    (FourParameterIwanFriction, {"chi": -1.0}, "chi = -1.0 must be above -1 and at most 0"),
    (FourParameterIwanFriction, {"chi": 0.1}, "chi = 0.1 must be above -1 and at most 0"),
    (FourParameterIwanFriction, {"beta": -0.1}, "beta = -0.1 must be zero or above"),
    (FourParameterIwanFriction, {"beta": (0.1, 0.2)}, "must be a number"),
    (FourParameterIwanFriction, {"spacing_ratio": 0.9}, "spacing_ratio = 0.9 must be one or above"),
    (FourParameterIwanFriction, {"elements": 0}, "elements = 0 must be a whole number"),
    (DahlFriction, {"exponent": 0.5}, "DahlFriction: exponent = 0.5 must be one or above"),
    (DahlFriction, {"presliding_stiffness": 0.0}, "presliding_stiffness"),
    (LuGreFriction, {"static_coefficient": 0.2}, "must be at least kinetic_coefficient = 0.55"),
    (LuGreFriction, {"bristle_damping": -1.0}, "bristle_damping"),
    (BoucWenFriction, {"beta": 0.4}, "BoucWenFriction: beta = 0.4 must be 0.5 or above"),
    (BoucWenFriction, {"yield_displacement": 0.0}, "yield_displacement"),
])
def test_values_are_checked(kind, values, message):
    with pytest.raises(InputError, match=message):
        made(kind, **values)


def test_number_of_elements_is_whole():
    assert IwanFriction(1e7, 0.55, elements=4.0).memory == 4
    assert IwanFriction(1e7, 0.55).table(np.ones(1)).shape == (1, 17)
    assert FourParameterIwanFriction(1e7, 0.55, -0.5, 0.1, elements=3.0).memory == 4
    assert FourParameterIwanFriction(1e7, 0.55, -0.5, elements=3, beta=0.0).memory == 3
