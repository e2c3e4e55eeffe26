"""Branches of orbits that end by themselves: at Hopf points, at homoclinic orbits, closed.

For x'' = m + c x' + x^2 + x x' (Bogdanov and Takens) orbits are born at c = sqrt(-m) about
x = -sqrt(-m), and end at an orbit homoclinic to the saddle x = sqrt(-m), which is found here by
the two separatrices of the saddle, with scipy.
"""

import numpy as np
import pytest

from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.io import read_branch, write_branch


def lens(t, x, p, out):
    # r^2 = p (1 - p), and a speed that depends on the angle.
    growth = p[0] * (1.0 - p[0]) - x[0] * x[0] - x[1] * x[1]
    out[0] = growth * x[0] - (2.0 + 0.3 * x[0]) * x[1]
    out[1] = growth * x[1] + (2.0 + 0.3 * x[0]) * x[0]


def takens(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] + p[1] * x[1] + x[0] * x[0] + x[0] * x[1]


def homoclinic(m):
    """c at which the separatrices of the saddle meet on x' = 0."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    saddle = np.sqrt(-m)

    def apart(c):
        slopes = np.roots([1.0, -(c + saddle), -2.0 * saddle])
        met = []
        for slope, sign in ((slopes.max(), 1.0), (slopes.min(), -1.0)):
            def rates(t, x, sign=sign):
                return [sign * x[1], sign * (m + c * x[1] + x[0] * x[0] + x[0] * x[1])]

            def turned(t, x):
                return x[1]

            turned.terminal = True
            start = [saddle - 1e-6, -1e-6 * slope]
            run = solve_ivp(rates, (0.0, 100.0), start, method="DOP853", rtol=1e-11, atol=1e-13,
                            events=turned)
            met.append(run.y[0, -1])
        return met[0] - met[1]

    return brentq(apart, 0.5 * saddle, 0.95 * saddle, xtol=1e-12)


@pytest.mark.parametrize(("largest", "within"), [(0.01, 1e-9), (0.05, 1e-8), (0.2, 1e-7)])
def test_orbits_between_two_hopf_points(largest, within):
    """From p = 0 to p = 1, where the period is pi; once, not back as the same orbits."""
    field = vector_field(lens, {"p": -0.5}, 2)
    first, last = equilibrium_branch(field, parameter="p", bounds=(-0.5, 1.5)).of_kind("Hopf")
    orbits = orbit_branch(field, first, method=Collocation(intervals=30), bounds=(-0.5, 1.5),
                          options=ContinuationOptions(largest_step=largest))
    assert orbits.status is BranchStatus.HOPF
    assert not orbits.special
    assert (np.diff(orbits.parameter) > 0.0).all()
    end = orbits.points[-1]
    assert end.parameter == pytest.approx(last.parameter, abs=within)
    assert end.parameter == pytest.approx(1.0, abs=within)
    assert end.values["period"] == pytest.approx(np.pi, abs=1e-8)
    radius = end.values["maximum"][0]
    assert 0.0 < radius < 1e-2 * largest
    assert 1.0 - end.parameter == pytest.approx(radius**2, rel=0.1)


def test_special_points_right_before_the_end_are_kept():
    """r^4 - r^2 / 10 = p: a fold at p = -1/400, within the last step to the Hopf point p = 0."""
    def twice(t, x, p, out):
        square = x[0] * x[0] + x[1] * x[1]
        growth = p[0] + 0.1 * square - square * square
        out[0] = growth * x[0] - 2.0 * x[1]
        out[1] = growth * x[1] + 2.0 * x[0]

    field = vector_field(twice, {"p": 0.5}, 2)
    t = np.linspace(0.0, np.pi, 300)
    radius = np.sqrt(0.05 + np.sqrt(0.0025 + 0.5))
    circle = radius * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    for largest in (0.02, 0.4):
        orbits = orbit_branch(field, (t, circle), "p", method=Collocation(intervals=16),
                              bounds=(-1.0, 1.0), direction=-1.0, scales=np.ones(2),
                              options=ContinuationOptions(largest_step=largest))
        assert orbits.status is BranchStatus.HOPF
        fold, = orbits.special
        assert (fold.kind, fold.parameter) == ("fold", pytest.approx(-0.0025, abs=1e-9))
        assert orbits.points[-1].parameter == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("intervals", [30, 60])
def test_orbits_that_end_homoclinic(intervals, tmp_path):
    field = vector_field(takens, {"m": -1.0, "c": 0.2}, 2)
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    assert hopf.parameter == pytest.approx(1.0, abs=1e-10)
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=intervals), bounds=(-2.0, 2.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    assert not orbits.special
    end, c = orbits.points[-1], homoclinic(-1.0)
    # exp(-l T) of the slower eigenvalue of the saddle.
    assert end.parameter == pytest.approx(c, abs=3e-4)
    nearest = np.linalg.norm(end.orbit().states - [1.0, 0.0], axis=1).min()
    assert nearest < 3e-3
    assert read_branch(write_branch(tmp_path / "orbits.h5", orbits)).status is orbits.status
    # Beyond, for those who ask: the parameter tends to that of the homoclinic orbit.
    on = orbit_branch(field, end, bounds=(-2.0, 2.0),
                      options=ContinuationOptions(locate=False, points=60))
    assert on.status is BranchStatus.POINTS
    assert on.points[-1].values["period"] > 1.5 * end.values["period"]
    assert on.points[-1].parameter == pytest.approx(c, abs=2e-7)
