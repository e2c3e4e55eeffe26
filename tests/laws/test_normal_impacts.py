"""Impacts of one mass: duration, restitution, damping from a coefficient of restitution."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fecontact.laws import (
    BackBurdekinContact,
    LinearContact,
    PowerContact,
    RestitutionContact,
    RoughSurface,
    TwoSidedStop,
)


def impact(law, mass, speed):
    """Deepest penetration, duration and restitution of a mass that strikes a contact."""
    p = law.table(np.ones(1))[0]
    depth = deepest(law, mass, speed)
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


def deepest(law, mass, speed):
    """Deepest penetration without damping."""
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
    (BackBurdekinContact(1e-3, 6e-9, 1.0 / 3.0), 2.6220575543),
    (PowerContact(1e9, "point"), 2.9432751843), (PowerContact(1e7, "line"), 3.0904878484),
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
def test_exact_damping_over_all_restitutions(e):
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
    """chi v / (1 - e) is 3/2 for all but Flores, 8/5, as e tends to one."""
    e = 0.9999
    product = {model: RestitutionContact(1e9, e, 1.0, damping_model=model).damping_factor / (1 - e)
               for model in RestitutionContact.choices["damping_model"]}
    assert list(product.values()) == pytest.approx([1.5, 1.5, 1.5, 1.6], rel=2e-4)
