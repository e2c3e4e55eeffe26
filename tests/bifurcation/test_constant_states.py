"""Floquet multipliers about constant states, against borders of stability that are known."""

import numpy as np
import pytest
from scipy.special import mathieu_a, mathieu_b

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import floquet_multipliers, vector_field
from fecontact.bifurcation.orbits import constant_state


def mathieu(t, x, p, out):
    # x'' + 2 c x' + (a - 2 q cos 2 t) (x - x0) = 0
    out[0] = x[1]
    out[1] = -(p[0] - 2.0 * p[1] * np.cos(2.0 * t)) * (x[0] - p[3]) - 2.0 * p[2] * x[1]


def mathieu_field(**parameters):
    return vector_field(mathieu, {"a": 1.0, "q": 0.5, "c": 0.0, "x0": 0.0} | parameters, 2,
                        period=np.pi)


@pytest.mark.parametrize(("border", "order", "side"), [
    (mathieu_a, 0, 1.0), (mathieu_b, 1, -1.0), (mathieu_a, 1, 1.0), (mathieu_b, 2, -1.0),
    (mathieu_a, 2, 1.0)])
@pytest.mark.parametrize("q", [0.5, 3.0])
def test_borders_of_mathieus_equation(border, order, side, q):
    """Solutions are bounded between a_m and b_(m + 1); on the borders a multiplier is 1 or -1."""
    at, sign = border(order, q), -1.0 if order % 2 else 1.0
    inside = floquet_multipliers(mathieu_field(a=at + side * 1e-3, q=q)).multipliers
    outside = floquet_multipliers(mathieu_field(a=at - side * 1e-3, q=q))
    assert np.abs(inside) == pytest.approx(np.ones(2), abs=1e-9)
    assert np.abs(inside.imag).min() > 1e-3
    assert outside.unstable == 1
    assert not outside.stable
    assert np.prod(outside.multipliers) == pytest.approx(1.0, abs=1e-9)
    met = floquet_multipliers(mathieu_field(a=at, q=q)).multipliers
    assert met == pytest.approx(np.full(2, sign), abs=1e-4)


def test_damping_another_state_and_two_periods():
    """Damping c turns multipliers mu of a + c^2 into mu exp(-c pi); two periods square them."""
    free = floquet_multipliers(mathieu_field(a=2.0, q=1.5)).multipliers
    damped = mathieu_field(a=2.0 + 0.01, q=1.5, c=0.1, x0=3.0)
    found = floquet_multipliers(damped, [3.0, 0.0])
    wanted = free * np.exp(-0.1 * np.pi)
    assert np.sort_complex(found.multipliers) == pytest.approx(np.sort_complex(wanted), abs=1e-8)
    assert found.stable == bool((np.abs(wanted) < 1.0).all())
    twice = floquet_multipliers(damped, [3.0, 0.0], periods=2)
    assert np.sort_complex(twice.multipliers) == pytest.approx(np.sort_complex(wanted**2), abs=1e-8)


def test_what_is_no_constant_state():
    with pytest.raises(InputError, match="the state is not at rest"):
        floquet_multipliers(mathieu_field(), [1.0, 0.0])
    with pytest.raises(InputError, match="must hold 2 numbers"):
        floquet_multipliers(mathieu_field(), [0.0])

    def still(t, x, p, out):
        out[0] = -p[0] * x[0]

    with pytest.raises(InputError, match="do not depend on time; take find_equilibrium"):
        floquet_multipliers(vector_field(still, {"k": 1.0}, 1))


def test_multipliers_that_do_not_converge_say_so(monkeypatch):
    monkeypatch.setattr(constant_state, "_apart", lambda one, other: 1.0)
    with pytest.raises(AnalysisError, match="still change on 2560 intervals"):
        floquet_multipliers(mathieu_field())
