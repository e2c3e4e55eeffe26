"""Coefficients of orbits along which the second derivative of the field jumps, in closed form.

In z + k |y - 0.3|^3 instead of z the second derivatives of a smooth field jump at y = 0.3. The
coefficient keeps its value but for the mean square of the eigenfunction.
"""

import numpy as np
import pytest
from numba import njit
from test_codim2_orbit_forms import BOX, chenciner
from test_orbit_bifurcations import moebius, torus

from fecontact.bifurcation import (
    Collocation,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)

K, AT = 2.0, 0.3
_moebius, _torus, _chenciner = njit(moebius), njit(torus), njit(chenciner)


def bent_moebius(t, x, p, out):
    s, z = x[1] - AT, x[2]
    x[2] = z - K * abs(s) ** 3
    _moebius(t, x, p, out)
    x[2] = z
    out[2] += 3.0 * K * s * abs(s) * out[1]


def bent_torus(t, x, p, out):
    s, z = x[1] - AT, x[2]
    x[2] = z - K * abs(s) ** 3
    _torus(t, x, p, out)
    x[2] = z
    out[2] += 3.0 * K * s * abs(s) * out[1]


def bent_chenciner(t, x, p, out):
    s, z = x[1] - AT, x[2]
    x[2] = z - K * abs(s) ** 3
    _chenciner(t, x, p, out)
    x[2] = z
    out[2] += 3.0 * K * s * abs(s) * out[1]


def mean_square(a, along, z, angle):
    """Mean square of an eigenfunction with these parts across and along the circle."""
    y = a * np.sin(angle) + along * np.cos(angle)
    s = np.sin(angle) - AT
    bent = z + 3.0 * K * s * np.abs(s) * y
    return np.mean(np.abs(a) ** 2 + np.abs(along) ** 2 + np.abs(bent) ** 2)


ANGLE = (np.arange(20000) + 0.5) * np.pi / 10000.0
HALF = ANGLE / 2.0
EXPECTED = {
    bent_moebius: 0.4 * np.pi / mean_square(np.cos(HALF), 0.4 * np.sin(HALF), np.sin(HALF), ANGLE),
    bent_torus: 1.6 * np.pi / mean_square(np.ones(20000), -0.5j / 0.7, -1.0j, ANGLE)}


@pytest.mark.parametrize("intervals", [40, 50])
@pytest.mark.parametrize("function", [bent_moebius, bent_torus])
def test_coefficients_include_jumps_of_second_derivatives(function, intervals):
    """Without them they are 0.113 instead of 0.131 and 0.021 instead of 0.212."""
    field = vector_field(function, {"lam": -0.2, "c": 0.4}, 3)
    t = np.linspace(0.0, np.pi, 800)
    y = np.sin(2.0 * t)
    states = np.stack([np.cos(2.0 * t), y, K * np.abs(y - AT) ** 3], axis=1)
    point, = orbit_branch(field, PeriodicMotion(t, states, period=np.pi), "lam",
                          method=Collocation(intervals=intervals, state_tolerance=None),
                          bounds=(-0.3, 0.3), scales=np.ones(3)).special
    assert point.criticality == "subcritical"
    error = abs(point.coefficient - EXPECTED[function])
    assert error <= 1.5 * point.coefficient_error < 0.1 * EXPECTED[function]


@pytest.mark.slow
def test_points_of_codimension_two_include_jumps_and_their_forms_say_that_they_do_not():
    field = vector_field(bent_chenciner, {"lam": -0.2, "k": -0.4}, 3)
    t = np.linspace(0.0, np.pi, 800)
    y = np.sin(2.0 * t)
    states = np.stack([np.cos(2.0 * t), y, K * np.abs(y - AT) ** 3], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, states, period=np.pi), "lam",
                          method=Collocation(intervals=30), bounds=BOX["lam"], scales=np.ones(3))
    curve = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "k", bounds=BOX)
    point, = curve.of_kind("Chenciner")
    # Where the cubic coefficient vanishes; without the share of the jumps it does so nowhere here.
    assert point.values["k"] == pytest.approx(0.2, abs=3e-3)
    assert np.isfinite(point.normal_form["d"])
    assert point.normal_form_errors == {"d": np.inf}
