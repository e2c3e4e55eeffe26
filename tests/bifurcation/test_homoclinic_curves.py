"""Homoclinic orbits over two parameters, as orbits of a fixed large period.

Near a Bogdanov-Takens point, x'' = m + c x' + x^2 + x x', they lie at m = -(49/25) c^2 + O(c^3)
(Guckenheimer and Holmes, Nonlinear Oscillations, section 7.3).
"""

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyfit
from test_branch_ends import homoclinic, takens

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)

PERIOD = 60.0


@pytest.fixture(scope="module")
def field():
    return vector_field(takens, {"m": -1.0, "c": 0.2}, 2)


@pytest.fixture(scope="module")
def near(field):
    """The orbit of the period 60 over c, beyond the end of the branch."""
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-2.0, 2.0))
    options = ContinuationOptions(
        largest_step=0.3, locate=False, stop_at="long", bounds=(-2.0, 2.0),
        events={"long": lambda values: values["period"] - PERIOD})
    on = orbit_branch(field, orbits.points[-1], options=options)
    assert on.status is BranchStatus.STOPPED
    return on.points[-1]


def test_curve_of_homoclinic_orbits(field, near):
    assert near.values["period"] == pytest.approx(PERIOD, rel=1e-9)
    assert near.parameter == pytest.approx(homoclinic(-1.0), abs=1e-9)
    curve = codim2_curve(field, near, "m", keep="period", options=ContinuationOptions(
        largest_step=0.02), bounds={"m": (-4.0, -0.01), "c": (-2.0, 5.0)})
    assert (curve.status, curve.parameter_names) == (BranchStatus.BOUND, ("c", "m"))
    m, c = curve.column("m"), curve.column("c")
    assert np.sort(m)[[0, -1]] == pytest.approx([-4.0, -0.01], rel=1e-12)
    assert curve.column("period") == pytest.approx(np.full(len(m), PERIOD), rel=1e-12)
    assert not curve.special
    for k in (0, len(m) // 2, -1):
        assert c[k] == pytest.approx(homoclinic(m[k]), rel=1e-7)
    # c / sqrt(-m) tends to 5/7 at the Bogdanov-Takens point, m = -(49/25) c^2.
    root = np.sqrt(-m)
    tends, slope = polyfit(root[root < 0.8], (c / root)[root < 0.8], 4)[:2]
    assert tends == pytest.approx(5.0 / 7.0, abs=1e-7)
    assert 0.0299 < slope < 0.0301


def test_values_of_auto(field, near):
    """Printed by AUTO-07p with 60 intervals: c at m = -1 for two periods, at -2 and -4 for 60."""
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    options = ContinuationOptions(bounds=(-2.0, 2.0), locate=False, stop_at="15",
                                  events={"15": lambda values: values["period"] - 15.0})
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), options=options)
    assert orbits.points[-1].parameter == pytest.approx(0.743492, abs=6e-7)
    assert near.parameter == pytest.approx(0.743444, abs=6e-7)
    options = ContinuationOptions(largest_step=0.05, events={
        "-2": lambda values: values["m"] + 2.0})
    curve = codim2_curve(field, near, "m", keep="period", both=False, direction=1.0,
                         bounds={"m": (-4.0, -0.5), "c": (-2.0, 5.0)}, options=options)
    assert curve.of_kind("-2")[0].values["c"] == pytest.approx(1.06764, abs=6e-6)
    assert curve.points[-1].values["c"] == pytest.approx(1.54103, abs=6e-6)


def circle(t, x, p, out):
    # r = sqrt(a), with the period 2 pi / (w + a).
    square = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - square) * x[0] - (p[1] + square) * x[1]
    out[1] = (p[0] - square) * x[1] + (p[1] + square) * x[0]


def test_curve_of_one_period_in_closed_form():
    """w + a is constant, to both sides of any point of a branch."""
    field = vector_field(circle, {"a": -0.5, "w": 2.0}, 2)
    hopf, = equilibrium_branch(field, parameter="a", bounds=(-0.5, 1.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=12), bounds=(-0.5, 1.0))
    curve = codim2_curve(field, orbits.at(field, 0.5), "w", keep="period",
                         bounds={"a": (0.1, 1.0), "w": (0.0, 3.0)})
    assert curve.column("a") + curve.column("w") == pytest.approx(np.full(len(curve), 2.5),
                                                                  rel=1e-9)
    assert np.sort(curve.column("a"))[[0, -1]] == pytest.approx([0.1, 1.0], rel=1e-12)


def driven(t, x, p, out):
    out[0], out[1] = x[1], -p[0] * x[0] - 0.1 * x[1] + p[1] * np.cos(t)


def test_kind_errors(field, near):
    rest = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0))
    with pytest.raises(InputError, match=r"is no orbit, whose period keep='period' could keep"):
        codim2_curve(field, rest.points[0], "m", keep="period")
    with pytest.raises(InputError, match=r"'Bautin', .*, or an orbit with keep='period'"):
        codim2_curve(field, rest.points[0], "m")
    with pytest.raises(InputError, match="keep = 'amplitude' must be 'kind' or 'period'"):
        codim2_curve(field, near, "m", keep="amplitude")
    forced = vector_field(driven, {"k": 2.0, "b": 1.0}, 2, period=lambda p: 2.0 * np.pi)
    t = np.linspace(0.0, 2.0 * np.pi, 200)
    motion = PeriodicMotion(t, np.stack([np.cos(t), -np.sin(t)], axis=1))
    orbits = orbit_branch(forced, motion, "k", method=Collocation(intervals=10),
                          bounds=(1.5, 2.5), options=ContinuationOptions(points=2))
    with pytest.raises(InputError, match="has the period of the excitation, which keep='period'"):
        codim2_curve(forced, orbits.points[0], "b", keep="period")
