"""Exponential friction: force, derivatives, dissipation, limit of stick."""

import math

import numpy as np
import pytest
from law_values import made

from fecontact import InputError, basis_from_matrices
from fecontact.laws import ExponentialFriction

BOOK = (0.8, 0.55, 1000.0, 1e6)


def kernel(v, F, p=BOOK):
    return ExponentialFriction.kernel.python(v, F, np.array([*p, 0.0, 0.0]))


def formula(v, F, p=BOOK):
    """(4.1-21) to (4.1-23); works for complex v away from zero."""
    mu_0, mu_inf, decay, k_s = p
    speed = v if np.real(v) >= 0.0 else -v
    mu = (mu_0 - mu_inf) * np.exp(-decay * speed) + mu_inf
    return mu * F * 2.0 / np.pi * np.arctan(k_s * v)


@pytest.mark.parametrize("p", [BOOK, (0.3, 0.3, 0.0, 1e4), (0.2, 0.6, 50.0, 1e3),
                               (0.0, 0.0, 1.0, 1.0), (0.5, 0.0, 1e4, 1e5)])
@pytest.mark.parametrize("v", [-2.0, -1e-3, -4.6e-5, -1e-7, 1e-9, 1e-6, 3e-5, 1e-3, 0.7])
def test_force_and_derivatives(v, p):
    F = 14.0
    force, slope_v, slope_F = kernel(v, F, p)
    assert force == pytest.approx(formula(v, F, p), rel=1e-13, abs=1e-300)
    step = 1e-40
    assert slope_v == pytest.approx(formula(v + step * 1j, F, p).imag / step, rel=1e-11,
                                    abs=1e-12)
    assert slope_F == pytest.approx(formula(v, 1.0, p), rel=1e-13, abs=1e-300)


def test_values_by_hand():
    # v = 1 mm/s: mu = 0.25 / e + 0.55, (2/pi) arctan(1000) = 1 - 2/(1000 pi) + ...
    expected = (0.25 / math.e + 0.55) * (1.0 - 2.0 / (1000.0 * math.pi)) * 14.0
    assert kernel(1e-3, 14.0)[0] == pytest.approx(expected, rel=1e-9)
    assert kernel(-1e-3, 14.0)[0] == pytest.approx(-expected, rel=1e-9)
    # v = 1 um/s = 1 / k_s: half of mu.
    assert kernel(1e-6, 2.0)[0] == pytest.approx(0.25 * math.exp(-1e-3) + 0.55, rel=1e-12)


def test_at_rest():
    assert kernel(0.0, 14.0) == pytest.approx((0.0, 0.8 * 14.0 * 2.0 / math.pi * 1e6, 0.0))


def test_slope_is_continuous_at_rest():
    """|v| has a corner there, but its factor s(v) is zero."""
    slopes = [kernel(v, 14.0)[1] for v in (-1e-13, 0.0, 1e-13)]
    assert slopes == pytest.approx([slopes[1]] * 3, rel=1e-6)


def test_odd_and_linear_in_the_normal_force():
    for v in (1e-7, 3e-5, 2e-3):
        force, slope_v, slope_F = kernel(v, 5.0)
        assert kernel(-v, 5.0) == pytest.approx((-force, slope_v, -slope_F), rel=1e-15)
        assert kernel(v, 10.0)[:2] == pytest.approx((2.0 * force, 2.0 * slope_v), rel=1e-15)
    assert kernel(1e-3, 0.0)[:2] == (0.0, 0.0)


def test_friction_takes_energy():
    for v in np.concatenate([-np.geomspace(1e-12, 10.0, 50), np.geomspace(1e-12, 10.0, 50)]):
        assert kernel(v, 14.0)[0] * v > 0.0


def test_compiled_function_agrees_with_the_plain_one():
    from fecontact import ContactSystem, Ground
    from fecontact.laws import RoughSurface

    rows = np.zeros((1, 3, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows})
    system = ContactSystem(basis, normal=RoughSurface(1.0, 1e-6, 0.0),
                           friction=ExponentialFriction(*BOOK), ground=Ground(speed=1e-3))
    for v in (-1e-3, -3e-5, 0.0, 1e-6, 0.2):
        # Penetration 2 + R_Z / 2 gives F = 2.
        state = np.array([0.0, -2.0 - 0.5e-6, v + 1e-3, 0.0])
        force, friction = system.contact_history(np.zeros(1), state[None])[0, 0, :2]
        assert force == pytest.approx(2.0, rel=1e-14)
        assert friction == pytest.approx(kernel(v, 2.0)[0], rel=1e-9, abs=1e-9)


# Limit of stick ----------------------------------------------------------------------------------

def test_stick_velocity_of_the_friction_oscillator():
    v = ExponentialFriction(*BOOK).stick_velocity(1)
    assert v == pytest.approx([4.6e-5], rel=0.01)
    force = [kernel(s * v[0], 1.0)[0] for s in (0.99, 1.0, 1.01)]
    assert force[1] > force[0]
    assert force[1] > force[2]
    # The root of the slope, by an independent solver.
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(lambda s: -formula(s * 1e-6, 1.0), bounds=(1.0, 1e3),
                           method="bounded", options={"xatol": 1e-7})
    assert v[0] == pytest.approx(best.x * 1e-6, rel=1e-5)


@pytest.mark.parametrize("p", [(0.4, 0.4, 1000.0, 1e6), (0.3, 0.6, 10.0, 1e6),
                               (0.8, 0.55, 0.0, 1e4)])
def test_without_a_maximum_stick_ends_at_ten_widths(p):
    v = ExponentialFriction(*p).stick_velocity(2)
    assert v == pytest.approx(np.full(2, 10.0 / p[3]), rel=1e-12)


@pytest.mark.parametrize("decay", [1.0, 100.0, 1e5, 1e7, 1e9])
def test_stick_velocity_is_where_the_force_is_largest(decay):
    law = ExponentialFriction(0.8, 0.0, decay, 1e6)
    v = law.stick_velocity(1)[0]
    speeds = v * np.geomspace(1e-3, 1e3, 2001)
    force = np.array([formula(s, 1.0, (0.8, 0.0, decay, 1e6)) for s in speeds])
    assert force.max() <= formula(v, 1.0, (0.8, 0.0, decay, 1e6)) * (1.0 + 1e-12)


def test_stick_velocity_per_node():
    law = ExponentialFriction(static_coefficient=(0.8, 0.5, 0.8), kinetic_coefficient=0.5,
                              decay=(1000.0, 1000.0, 10.0))
    v = law.stick_velocity(3)
    single = [ExponentialFriction(mu, 0.5, decay).stick_velocity(1)[0]
              for mu, decay in ((0.8, 1000.0), (0.5, 1000.0), (0.8, 10.0))]
    assert v == pytest.approx(single, rel=1e-12)
    assert v[1] == pytest.approx(1e-5, rel=1e-12)


def test_velocity_scale_is_the_narrowest():
    assert ExponentialFriction(0.8, 0.55, 1e3,
                               smoothing_slope=(1e5, 1e6)).velocity_scale == pytest.approx(1e-6)


# Parameters --------------------------------------------------------------------------------------

def test_no_parameter_is_shared():
    share = np.array([0.25, 0.75])
    assert ExponentialFriction(*BOOK).table(share).tolist() == [[*BOOK, 0.0, 0.0]] * 2
    assert ExponentialFriction((0.8, 0.6), 0.55, 1000.0).table(share)[:, 0].tolist() == [0.8, 0.6]


@pytest.mark.parametrize(("values", "message"), [
    ({"static_coefficient": -0.1}, r"ExponentialFriction: static_coefficient = -0\.1 must be zero"),
    ({"kinetic_coefficient": -1.0}, "kinetic_coefficient"), ({"decay": -1.0}, "decay"),
    ({"smoothing_slope": 0.0}, "smoothing_slope = 0.0 must be above zero"),
    ({"smoothing_slope": (1e6, 0.0)}, "smoothing_slope"),
    ({"decay": float("inf")}, "decay = inf must be finite"),
    ({"static_coefficient": "dry"}, "static_coefficient = 'dry' must be a number"),
])
def test_values_are_checked(values, message):
    with pytest.raises(InputError, match=message):
        made(ExponentialFriction, **values)
