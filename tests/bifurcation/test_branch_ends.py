"""Branches of orbits that end by themselves: at Hopf points, at homoclinic orbits, closed.

For x'' = m + c x' + x^2 + x x' (Bogdanov and Takens) orbits are born at c = sqrt(-m) about
x = -sqrt(-m), and end at an orbit homoclinic to the saddle x = sqrt(-m), which is found here by
the two separatrices of the saddle, with scipy.
"""

import numpy as np
import pytest

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    codim2_curve,
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


def bautin(t, x, p, out):
    # r' = r (b + c r^2 - r^4): orbits turn at b = -c^2 / 4, c = 2 r^2.
    square = x[0] * x[0] + x[1] * x[1]
    growth = p[0] + p[1] * square - square * square
    out[0] = growth * x[0] - x[1] * (1.0 + 0.2 * x[0])
    out[1] = growth * x[1] + x[0] * (1.0 + 0.2 * x[0])


@pytest.mark.parametrize("largest", [0.02, 0.05, 0.1])
def test_a_curve_of_folds_ends_at_a_bautin_point(largest):
    """The curve does not run through the same orbits again."""
    field = vector_field(bautin, {"b": -1.0, "c": 1.0}, 2)
    hopf, = equilibrium_branch(field, parameter="b", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=16), bounds=(-2.0, 2.0))
    fold, = orbits.of_kind("fold")
    curve = codim2_curve(field, fold, "c", bounds={"b": (-2.0, 1.0), "c": (-1.0, 1.2)},
                         options=ContinuationOptions(largest_step=largest))
    assert curve.status is BranchStatus.HOPF
    b, c = curve.parameter, curve.column("c")
    assert c**2 == pytest.approx(-4.0 * b, abs=1e-10)
    assert (np.diff(c) < 0.0).all()
    radius = curve.points[-1].values["maximum"][0]
    assert 0.0 < radius < 0.02
    assert c[-1] == pytest.approx(2.0 * radius**2, rel=0.02)
    assert not curve.special


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_curve_of_folds_begins_at_a_bautin_point(sign, tmp_path):
    """The start is found from the curve of Hopf points b = 0, also from a file, on either side."""
    def turned(t, x, p, out):
        square = x[0] * x[0] + x[1] * x[1]
        growth = p[0] + sign * p[1] * square - square * square
        out[0] = growth * x[0] - x[1] * (1.0 + 0.2 * x[0])
        out[1] = growth * x[1] + x[0] * (1.0 + 0.2 * x[0])

    field = vector_field(turned, {"b": -1.0, "c": -0.3}, 2)
    box = {"b": (-2.0, 2.0), "c": (-1.5, 1.5)}
    hopf, = equilibrium_branch(field, parameter="b", bounds=box["b"]).of_kind("Hopf")
    border = read_branch(write_branch(tmp_path / "curve.h5",
                                      codim2_curve(field, hopf, "c", bounds=box)))
    point, = border.special
    curve = codim2_curve(field, point, "c", bounds=box)
    b, c = curve.parameter, sign * curve.column("c")
    assert c**2 == pytest.approx(-4.0 * b, abs=1e-10)
    assert sorted([c[0], c[-1]]) == pytest.approx([0.0, 1.5], abs=1e-3)
    assert curve.column("maximum")[[0, -1], 0].min() < 0.02
    with pytest.raises(InputError, match=r"parameter = 'b' must be the latter"):
        codim2_curve(field, point, "b")


def test_orbits_of_one_period_end_at_hopf_points():
    """r = sqrt(a) with the period 2 pi / (w + a): w + a = 2.5 ends at a = 0, w = 2.5."""
    def circle(t, x, p, out):
        square = x[0] * x[0] + x[1] * x[1]
        out[0] = (p[0] - square) * x[0] - (p[1] + square) * x[1]
        out[1] = (p[0] - square) * x[1] + (p[1] + square) * x[0]

    field = vector_field(circle, {"a": -0.5, "w": 2.0}, 2)
    hopf, = equilibrium_branch(field, parameter="a", bounds=(-0.5, 1.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=12), bounds=(-0.5, 1.0))
    curve = codim2_curve(field, orbits.at(field, 0.5), "w", keep="period", direction=-1.0,
                         both=False, bounds={"a": (-1.0, 1.0), "w": (0.0, 3.0)})
    assert curve.status is BranchStatus.HOPF
    assert [curve.parameter[-1], curve.column("w")[-1]] == pytest.approx([0.0, 2.5], abs=1e-4)
