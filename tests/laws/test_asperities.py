"""Elastic-plastic asperities beside closed forms, and the friction that belongs to them."""

import numpy as np
import pytest
from scipy.integrate import quad

import fecontact as fc
from fecontact.laws import AsperityContact, IwanFriction, ParallelSliders

N, R, E, Z = 1e3, 1e-4, 1e11, 1e-5
SHARE = np.array([0.25, 0.75])


def forces(law, u, share=1.0):
    table = law.table(np.array([share]))[0]
    return np.array([law.kernel.python(one, 0.0, table) for one in u])


def test_elastic_asperities_of_uniform_gaps():
    """int_0^u 4/3 E* R^(1/2) d^(3/2) N / z_m dd = 8/15 E* R^(1/2) N / z_m u^(5/2)."""
    u = np.linspace(0.0, Z, 30)
    found = forces(AsperityContact(N, R, E, Z), u)
    exact = 8.0 / 15.0 * E * np.sqrt(R) * N / Z * u**2.5
    assert found[:, 0] == pytest.approx(exact, abs=1e-4 * exact[-1])
    assert found[:, 1] == pytest.approx(2.5 * exact / np.maximum(u, 1e-30), abs=1e-3 * (
        2.5 * exact[-1] / Z))
    light = Z * np.array([3e-3, 1e-2, 1e-1])
    assert forces(AsperityContact(N, R, E, Z), light)[:, 0] == pytest.approx(
        8.0 / 15.0 * E * np.sqrt(R) * N / Z * light**2.5, rel=1e-3)
    # Half of the face has half of the force.
    assert forces(AsperityContact(N, R, E, Z), u, 0.5)[:, 0] == pytest.approx(0.5 * found[:, 0])


def test_measured_density_against_quadrature():
    law = AsperityContact(N, R, E, Z, (0.0, 1.0, 3.0, 0.5), yield_stress=5e8)

    def rho(g):
        return np.interp(g, np.linspace(0.0, Z, 4), law.density)

    whole = quad(rho, 0.0, Z, points=[Z / 3.0, 2.0 * Z / 3.0])[0]
    for u in (2e-6, 6e-6, 1e-5, 1.5e-5):
        force = quad(lambda g, u=u: float(law.pair_force(u - g)) * rho(g), 0.0, min(u, Z),
                     limit=200)[0] * N / whole
        assert forces(law, [u])[0, 0] == pytest.approx(force, rel=2e-3)


def test_a_plastic_pair():
    """Hertz up to 1.9 d_y without a step there; then softer, and the pressure nears 2.84 S_y."""
    law = AsperityContact(N, R, E, Z, yield_stress=5e8, poisson_ratio=0.3)
    elastic = AsperityContact(N, R, E, Z)
    d_y = law.yield_approach
    # First yield of Hertz' contact: the largest pressure is C S_y.
    p_0 = 2.0 * E / (np.pi * R) * np.sqrt(R * d_y)
    assert p_0 == pytest.approx(1.295 * np.exp(0.736 * 0.3) * 5e8)
    d = d_y * np.array([0.5, 1.0, 1.89])
    assert law.pair_force(d) == pytest.approx(elastic.pair_force(d))
    below, above = law.pair_force(d_y * np.array([1.8999, 1.9001]))
    assert above == pytest.approx(below, rel=0.01)
    assert (law.pair_force(d_y * np.array([5.0, 50.0, 500.0]))
            < elastic.pair_force(d_y * np.array([5.0, 50.0, 500.0]))).all()
    # Area of Jackson and Green: pi R d (s / 1.9)^B.
    s = 1000.0
    area = np.pi * R * s * d_y * (s / 1.9) ** (0.14 * np.exp(23.0 * 5e8 / E))
    assert float(law.pair_force(s * d_y)) / area == pytest.approx(2.84 * 5e8, rel=0.15)


def test_flattened_asperities():
    law = AsperityContact(N, R, E, Z, (0.0, 1.0, 2.0, 0.5), yield_stress=5e8)
    flat = law.flattened(6e-6)
    assert forces(flat, [6e-6])[0, 0] == pytest.approx(forces(law, [6e-6])[0, 0], rel=2e-3)
    # Unloading is stiffer, and gives less work back than loading took.
    assert forces(flat, [6e-6])[0, 1] > 1.3 * forces(law, [6e-6])[0, 1]
    u = np.linspace(0.0, 6e-6, 400)
    assert np.trapezoid(forces(flat, u)[:, 0], u) < 0.8 * np.trapezoid(forces(law, u)[:, 0], u)
    # Elastic ones forget.
    elastic = AsperityContact(N, R, E, Z, law.density)
    assert forces(elastic.flattened(6e-6), u) == pytest.approx(forces(elastic, u), rel=2e-3,
                                                              abs=1e-3)


def test_a_single_flattened_pair_unloads_as_hertz_with_its_new_radius():
    """All gaps at once: a narrow range beside the approach."""
    law = AsperityContact(1.0, R, E, 1e-12, yield_stress=5e8)
    d = 2e-6
    ratio = float(law.pair_force(d)) / (4.0 / 3.0 * E * np.sqrt(R) * d**1.5)
    u = np.linspace(d * (1.0 - ratio), d, 20)[1:]
    found = law.flattened(d).curve(u, d)[0]
    assert found == pytest.approx(
        4.0 / 3.0 * E * np.sqrt(R / ratio) * (u - d * (1.0 - ratio)) ** 1.5, rel=1e-5)


@pytest.mark.parametrize("yield_stress", [0.0, 5e8])
def test_friction_has_the_stiffness_of_mindlin(yield_stress):
    law = AsperityContact(N, R, E, Z, (0.0, 1.0, 2.0, 0.5), yield_stress, poisson_ratio=0.25)
    u = np.array([6e-6, 4e-6])
    friction = law.friction(SHARE, u, 0.3, elements=5)
    for k in range(2):
        stiffness = law.flattened(float(u[k])).curve(u[k : k + 1], float(u[k]))[1][0]
        assert friction.stiffness[k] == pytest.approx(
            2.0 * 0.75 / 1.75 * stiffness * N * SHARE[k], rel=1e-9)
    assert sum(friction.limits) == pytest.approx(1.0)
    assert (np.diff(friction.limits) > 0.0).all()


def test_a_single_pair_slides_at_once():
    """Pairs of one approach slide together: all limits are equal."""
    law = AsperityContact(1.0, R, E, 1e-12)
    friction = law.friction(np.ones(1), np.array([1e-6]), 0.3, 4)
    assert friction.limits == pytest.approx((0.25,) * 4)
    # mu f over 8 G* a = mu d E* / (6 G*), and E* / G* = 4 (2 - nu) / (2 (1 - nu)).
    slip = 0.3 * float(law.pair_force(1e-6)) / friction.stiffness[0]
    assert slip == pytest.approx(0.3 * 1e-6 / 6.0 * 4.0 * 1.7 / 1.4, rel=1e-6)


def test_parallel_sliders_include_those_of_iwan():
    iwan = IwanFriction(2e6, 0.4, elements=3)
    given = ParallelSliders(2e6, 0.4, (7.0,) * 3, (1.0, 3.0, 5.0))
    assert given.memory == 3
    assert given.table(SHARE) == pytest.approx(iwan.table(SHARE))


@pytest.mark.parametrize(("call", "told"), [
    (lambda: AsperityContact(N, R, E, Z, (1.0,)), "at least two numbers"),
    (lambda: AsperityContact(N, R, E, Z, (1.0, -1.0)), "zero or above and not all zero"),
    (lambda: AsperityContact(N, R, E, Z, (0.0, 0.0)), "not all zero"),
    (lambda: AsperityContact(N, R, E, 0.0), "gap_range"),
    (lambda: AsperityContact(N, R, E, Z, poisson_ratio=0.6), "from 0 to 0.5"),
    (lambda: AsperityContact(N, R, E, Z, yield_stress=-1.0), "yield_stress"),
    (lambda: AsperityContact(N, R, E, Z).friction(SHARE, np.zeros(2), 0.3), "one above zero"),
    (lambda: AsperityContact(N, R, E, Z).friction(SHARE, np.ones(3), 0.3), "one for each node"),
    (lambda: AsperityContact(N, R, E, Z).friction(SHARE, 1e-6 * np.ones(2), -0.3), "coefficient"),
    (lambda: ParallelSliders(2e6, 0.4, (1.0, 2.0), (1.0,)), "lists of equal length"),
    (lambda: ParallelSliders(2e6, 0.4, (1.0, 0.0), (1.0, 1.0)), "above zero"),
])
def test_wrong_values(call, told):
    with pytest.raises(fc.InputError, match=told):
        call()
