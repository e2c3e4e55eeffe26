"""The rough surface: force, derivatives, energy, parameters per node."""

import numpy as np
import pytest

from fecontact import InputError
from fecontact.laws import RoughSurface

C, R, D = 0.3e6, 5.2e-6, 6.0


def kernel(u, v, p=(C, R, D)):
    return RoughSurface.kernel.python(u, v, np.array(p, dtype=float))


def asperities(u, v, c=C, R=R, d=D, count=400_000):
    """The bed of asperities itself: heights in 0 ... 1, each a spring and a dashpot."""
    z = (np.arange(count) + 0.5) / count
    touching = np.maximum(u / R - z, 0.0)
    return max(0.0, c * R * touching.mean() + d * np.mean(touching > 0.0) * v)


def formula(u, v, c=C, R=R, d=D):
    """(4.1-16) for uniform heights; works for complex arguments."""
    s = u / R
    if np.real(s) <= 0.0:
        f, h = 0.0 * s, 0.0 * s
    elif np.real(s) < 1.0:
        f, h = s * s / 2.0, s
    else:
        f, h = s - 0.5, 1.0 + 0.0 * s
    F = c * R * f + d * h * v
    return F if np.real(F) > 0.0 else 0.0 * F


STATES = [(u * R, v) for u in (-3.0, -1e-9, 1e-9, 0.3, 0.999, 1.001, 4.0, 1e3)
          for v in (-0.3, -0.05, 0.0, 0.02, 1.0)]


@pytest.mark.parametrize(("u", "v"), STATES)
def test_force_and_derivatives(u, v):
    force, slope_u, slope_v = kernel(u, v)
    assert force == pytest.approx(formula(u, v), rel=1e-13, abs=1e-300)
    step = 1e-30
    assert slope_u == pytest.approx(formula(u + step * 1j, v).imag / step, rel=1e-13, abs=1e-300)
    assert slope_v == pytest.approx(formula(u, v + step * 1j).imag / step, rel=1e-13, abs=1e-300)


@pytest.mark.parametrize(("u", "v"), [(0.2 * R, 0.0), (0.7 * R, 0.1), (0.9 * R, -0.01),
                                      (2.5 * R, 0.05), (0.5 * R, -1.0)])
def test_force_is_that_of_the_asperities(u, v):
    assert kernel(u, v)[0] == pytest.approx(asperities(u, v), rel=1e-5)


def test_values_by_hand():
    # s = 1/2: c R / 8 = 0.195 N, damping 6 / 2 N s/m; s = 3: 2.5 c R = 3.9 N, 6 N s/m.
    assert kernel(2.6e-6, 0.0) == pytest.approx((0.195, 0.15e6, 3.0), rel=1e-12)
    assert kernel(2.6e-6, 0.1) == pytest.approx((0.495, 0.15e6 + 0.6 / 5.2e-6, 3.0), rel=1e-12)
    assert kernel(15.6e-6, -0.1) == pytest.approx((3.3, 0.3e6, 6.0), rel=1e-12)
    assert kernel(2.6e-6, -0.1) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("v", [-0.01, 0.0, 0.2])
@pytest.mark.parametrize("joint", [0.0, 1.0])
def test_joints(joint, v):
    """Force continuous at u = 0 and u = R_Z, one-sided slopes those of the two branches."""
    step = 1e-9 * R
    (low, low_u, low_v), (high, high_u, high_v) = kernel(joint * R - step, v), kernel(
        joint * R + step, v)
    at = kernel(joint * R, v)
    stiffest = C + D * abs(v) / R
    assert high - low == pytest.approx(0.0, abs=3.0 * step * stiffest)
    assert low_v == pytest.approx(high_v, abs=1e-8 * D)
    # Only the damping's slope jumps: by d v / R, at u = 0 if the force is not clipped.
    jump = D * v / R * (1.0 if joint == 0.0 else -1.0)
    if joint == 0.0 and v <= 0.0:
        jump = 0.0
    assert high_u - low_u == pytest.approx(jump, abs=1e-8 * stiffest)
    assert at[0] == pytest.approx(low, abs=3.0 * step * stiffest)
    assert min(low_u, high_u) * (1 - 1e-8) <= at[1] <= max(low_u, high_u) * (1 + 1e-8)


def test_never_tensile_and_growing():
    for u in np.linspace(-1.0, 3.0, 41) * R:
        forces = [kernel(u, v) for v in np.linspace(-2.0, 2.0, 41)]
        assert all(force >= 0.0 and slope_v >= 0.0 for force, _, slope_v in forces)
        assert (np.diff([force for force, _, _ in forces]) >= 0.0).all()
        for force, slope_u, slope_v in forces:
            if force == 0.0:
                assert slope_u == slope_v == 0.0


def test_damping_takes_energy():
    for u in (0.3 * R, 2.0 * R):
        for v in (-1.0, -0.1, -1e-4, 1e-4, 0.1):
            assert (kernel(u, v)[0] - kernel(u, 0.0)[0]) * v > 0.0


def test_stored_energy_is_the_integral_of_the_elastic_force():
    law = RoughSurface(C, R, D)
    for s in (0.4, 1.0, 1.7, 6.0):
        u = np.linspace(0.0, s * R, 20001)
        force = np.array([kernel(value, 0.0)[0] for value in u])
        work = np.sum((force[1:] + force[:-1]) * np.diff(u)) / 2.0
        stored = law.stored_energy(np.array([[s * R]]), np.ones(1))
        assert stored == pytest.approx(np.array([[work]]), rel=1e-7)
    assert law.stored_energy(np.array([-R, 0.0]), np.array([0.5, 0.5])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("s", [-0.5, 0.2, 0.9, 1.1, 3.0])
def test_slope_of_the_stored_energy_is_the_elastic_force(s):
    share = np.array([0.2, 0.3, 0.5])
    law = RoughSurface(C, (R, 2 * R, 0.5 * R), D)
    u = s * np.array([R, 2 * R, 0.5 * R])
    step = 1e-4 * R
    slope = (law.stored_energy(u + step, share) - law.stored_energy(u - step, share)) / (2 * step)
    expected = [kernel(u[j], 0.0, p)[0] for j, p in enumerate(law.table(share))]
    assert slope == pytest.approx(expected, rel=1e-6, abs=1e-20)


def test_stored_energy_of_many_times():
    law = RoughSurface(C, R, D)
    share = np.array([0.25, 0.75])
    u = np.linspace(-R, 3 * R, 14).reshape(7, 2)
    whole = law.stored_energy(u, share)
    assert whole.shape == (7, 2)
    assert whole[3] == pytest.approx(law.stored_energy(u[3], share), rel=1e-15)


def test_extensive_parameters_are_shared_and_lists_are_not():
    share = np.array([0.1, 0.2, 0.7])
    assert RoughSurface(10.0, 2.0, 3.0).table(share) == pytest.approx(
        np.array([[1.0, 2.0, 0.3], [2.0, 2.0, 0.6], [7.0, 2.0, 2.1]]), rel=1e-15)
    assert RoughSurface([4.0, 5.0, 6.0], (1.0, 2.0, 3.0), np.array([7.0, 8.0, 0.0])).table(
        share).tolist() == [[4.0, 1.0, 7.0], [5.0, 2.0, 8.0], [6.0, 3.0, 0.0]]
    assert RoughSurface((4.0, 5.0, 6.0), 1.0, 10.0).table(share) == pytest.approx(
        np.array([[4.0, 1.0, 1.0], [5.0, 1.0, 2.0], [6.0, 1.0, 7.0]]), rel=1e-15)


def test_table_can_be_written_and_is_contiguous():
    table = RoughSurface(1e6, R).table(np.array([0.5, 0.5]))
    assert table.flags.c_contiguous
    assert table.flags.writeable


def test_a_law_can_be_compared_and_hashed():
    assert RoughSurface([1.0, 2.0], R) == RoughSurface((1.0, 2.0), R)
    assert hash(RoughSurface([1.0, 2.0], R)) == hash(RoughSurface(np.array([1.0, 2.0]), R))
    assert RoughSurface(1e6, R, 1.0) != RoughSurface(1e6, R, 2.0)


@pytest.mark.parametrize(("values", "message"), [
    ({"stiffness": 0.0}, r"RoughSurface: stiffness = 0\.0 must be above zero"),
    ({"stiffness": -1.0}, "stiffness"), ({"roughness_height": 0.0}, "roughness_height"),
    ({"roughness_height": (1e-6, -1e-6)}, "roughness_height = .* must be above zero"),
    ({"damping": -1e-9}, "damping = -1e-09 must be zero or above"),
    ({"damping": float("nan")}, "damping = nan must be finite"),
    ({"stiffness": float("inf")}, "stiffness = inf must be finite"),
    ({"stiffness": (1.0, float("nan"))}, "stiffness = .*nan.* must be finite"),
    ({"stiffness": "stiff"}, "stiffness = 'stiff' must be a number"),
    ({"stiffness": 1j}, "stiffness = 1j must be a number"),
    ({"stiffness": None}, "stiffness = None must be a number"),
    ({"stiffness": ("a", "b")}, "must be a number"),
    ({"stiffness": ()}, "stiffness"),
    ({"stiffness": ((1.0, 2.0), (3.0, 4.0))}, "must be a number"),
    ({"stiffness": np.array(3.0)}, None),
])
def test_values_are_checked(values, message):
    values = {"stiffness": 1e6, "roughness_height": R, **values}
    if message is None:
        assert RoughSurface(**values).table(np.ones(1))[0, 0] == 3.0
        return
    with pytest.raises(InputError, match=message):
        RoughSurface(**values)


def test_number_of_values_per_node_is_checked():
    law = RoughSurface((1.0, 2.0, 3.0), R)
    with pytest.raises(InputError, match="stiffness has 3 values for 2 contact nodes"):
        law.table(np.array([0.5, 0.5]))
