"""Coefficients of folds of orbits, y' = b y^2 in a period, against normal forms about circles."""

import numpy as np
import pytest

from fecontact.bifurcation import Collocation, HarmonicBalance, orbit_branch, vector_field
from fecontact.io import read_branch, write_branch


def cusp(t, x, p, out):
    # s' = p + q s - s^3 with s = r - 1; the speed on the circle changes with s.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s = r - 1.0
    radial, speed = p[0] + p[1] * s - s * s * s, 2.0 + 0.7 * s
    out[0] = radial * x[0] / r - speed * x[1]
    out[1] = radial * x[1] / r + speed * x[0]


def forced(t, x, p, out):
    out[0] = p[0] + p[1] * x[0] - x[0] * x[0] * x[0]
    out[1] = np.cos(t) - x[1]


@pytest.mark.parametrize("size", [1.0, 2.0])
def test_folds_of_free_orbits(size, tmp_path):
    """At s^2 = q / 3 the coefficient is 3 |s| T for displacements of one."""
    field = vector_field(cusp, {"p": 0.2, "q": 0.3}, 2)
    s = np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
    t = np.linspace(0.0, 2.0 * np.pi / (2.0 + 0.7 * s), 400)
    circle = (1.0 + s) * np.stack([np.cos((2.0 + 0.7 * s) * t), np.sin((2.0 + 0.7 * s) * t)],
                                  axis=1)
    branch = orbit_branch(field, (t, circle), "p", method=Collocation(16), direction=-1.0,
                          bounds=(-0.3, 0.3), scales=np.full(2, size))
    branch = read_branch(write_branch(tmp_path / "orbits.h5", branch))
    assert [fold.parameter < 0.0 for fold in branch.of_kind("fold")] == [True, False]
    for fold in branch.of_kind("fold"):
        place = -np.copysign(np.sqrt(0.1), fold.parameter)
        period = 2.0 * np.pi / (2.0 + 0.7 * place)
        assert fold.values["period"] == pytest.approx(period, rel=1e-7)
        assert fold.coefficient == pytest.approx(3.0 * np.sqrt(0.1) * period * size, rel=1e-6)
        # The stated error is at least 1e-5 of the terms that make up the coefficient.
        assert 0.0 <= fold.coefficient_error < 2e-5 * fold.coefficient
        assert fold.criticality is None


def test_folds_of_driven_orbits():
    field = vector_field(forced, {"p": 0.2, "q": 0.3}, 2, period=lambda p: 2.0 * np.pi)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    x = np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
    motion = np.stack([np.full(400, x), (np.cos(t) + np.sin(t)) / 2.0], axis=1)
    branch = orbit_branch(field, (t, motion), "p", method=Collocation(16), direction=-1.0,
                          bounds=(-0.3, 0.3), scales=np.ones(2))
    assert [fold.coefficient for fold in branch.of_kind("fold")] == pytest.approx(
        [6.0 * np.pi * np.sqrt(0.1)] * 2, rel=1e-8)


def test_harmonic_balance_gives_no_coefficients():
    method = HarmonicBalance(9, 64, stability="transitions")
    field = vector_field(forced, {"p": 0.2, "q": 0.3}, 2, period=lambda p: 2.0 * np.pi)
    t = np.linspace(0.0, 2.0 * np.pi, 401)
    x = np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
    motion = np.stack([np.full(401, x), (np.cos(t) + np.sin(t)) / 2.0], axis=1)
    branch = orbit_branch(field, (t, motion), "p", method=method, direction=-1.0,
                          bounds=(-0.3, 0.3), scales=np.ones(2))
    assert len(branch.of_kind("fold")) == 2
    for fold in branch.of_kind("fold"):
        assert fold.coefficient is None
        assert fold.coefficient_error is None
        assert fold.criticality is None
