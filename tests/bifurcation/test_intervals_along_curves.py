"""Intervals along curves of orbits over two parameters: errors beside closed forms and runs."""

from dataclasses import replace

import numpy as np
import pytest
from collocation_fields import settled
from test_intervals_along_branches import apart, counts, true_error
from test_orbit_curves import circle_field, cusp, twisted

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
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.curves.codim2 import orbit_curve
from fecontact.bifurcation.orbits.curves.singularity import ContinuedSign, Singularity, of_fold
from fecontact.io import read_branch, write_branch


def oval(t, x, p, out):
    # s' = 1/4 - p^2 - q^2 - s^2 with s = r - 1; it turns evenly at p = -1/2, in jerks at p = 1/2.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s, speed = r - 1.0, 2.0 + 1.8 * (0.5 + p[0]) * x[0] / r
    radial = 0.25 - p[0] * p[0] - p[1] * p[1] - s * s
    out[0] = radial * x[0] / r - speed * x[1]
    out[1] = radial * x[1] / r + speed * x[0]


def on_the_circle(point):
    """Samples of an orbit of ``oval`` with s = 0, and its states there in closed form.

    The angle obeys a' = 2 + w cos a, so that tan(a / 2) = sqrt((2 + w) / (2 - w)) tan(Om t / 2)
    with Om^2 = 4 - w^2.
    """
    orbit, w = point.orbit(samples=2001), 1.8 * (0.5 + point.parameter)
    steep, half = np.sqrt((2.0 + w) / (2.0 - w)), np.sqrt(4.0 - w * w) / 2.0
    first = np.arctan(np.tan(np.arctan2(orbit.states[0, 1], orbit.states[0, 0]) / 2.0) / steep)
    phase = half * orbit.times + first
    a = 2.0 * np.arctan2(steep * np.sin(phase), np.cos(phase))
    return orbit.states, np.stack([np.cos(a), np.sin(a)], axis=1)


def oval_folds(tolerance):
    field = vector_field(oval, {"p": 0.0, "q": 0.1}, 2)
    branch = orbit_branch(field, settled(field, 60.0, [1.5, 0.0], 4.0), "p", bounds=(-1.0, 1.0),
                          scales=np.ones(2), method=Collocation(16, state_tolerance=tolerance))
    fold = min(branch.of_kind("fold"), key=lambda point: point.parameter)
    return field, codim2_curve(field, fold, "q", bounds={"p": (-1.0, 1.0), "q": (-1.0, 1.0)})


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_a_closed_curve_of_folds_on_changing_meshes(tolerance, tmp_path):
    """Folds at p^2 + q^2 = 1/4, s = 0, of orbits that turn evenly or in jerks."""
    _, curve = oval_folds(tolerance)
    assert curve.status is BranchStatus.CLOSED
    assert curve.message == ""
    found = counts(curve)
    assert found[0] == curve.method.intervals == min(found)
    assert max(found) >= 1.7 * min(found)
    assert (np.diff(found) < 0).any()
    p, q = curve.parameter, curve.column("q")
    assert p**2 + q**2 == pytest.approx(np.full(len(p), 0.25), abs=1e-3 * tolerance)
    exact = 2.0 * np.pi / np.sqrt(4.0 - (1.8 * (0.5 + p)) ** 2)
    assert curve.column("period") == pytest.approx(exact, rel=1e-3 * tolerance)
    for point in curve:
        states, closed = on_the_circle(point)
        error = np.max(np.abs(states - closed)) / 2.0
        assert error <= tolerance
        assert 0.9 * error <= point.values["state_error"] <= 1.4 * error
    turning = sorted(point.parameter for point in curve.special)
    assert turning == pytest.approx([-0.5, 0.5], abs=1e-9)
    # A file keeps the meshes, and a curve goes on from any of its points.
    loaded = read_branch(write_branch(tmp_path / "curve.h5", curve))
    assert counts(loaded) == found
    assert all(np.array_equal(one.u, other.u) for one, other in zip(loaded, curve, strict=True))


def clock(t, x, p, out):
    # Van der Pol's oscillator with a stiffness.
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - p[1] * x[0]


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_orbits_of_one_period_become_relaxation_oscillations(tolerance):
    """From mu = 0.5 to 30 at the period of mu = 1, against runs at tolerances of 1e-12."""
    field = vector_field(clock, {"mu": 1.0, "k": 1.0}, 2)
    branch = orbit_branch(field, settled(field, 60.0, [2.0, 0.0], 8.0), "mu", bounds=(0.5, 2.0),
                          method=Collocation(20, state_tolerance=tolerance),
                          options=ContinuationOptions(points=1))
    curve = codim2_curve(field, branch.points[0], "k", keep="period",
                         bounds={"mu": (0.5, 30.0), "k": (0.1, 60.0)})
    assert curve.status is BranchStatus.BOUND
    assert curve.message == ""
    assert curve.column("state_error").max() <= tolerance
    assert max(counts(curve)) > 1.5 * min(counts(curve))
    for mu in (0.5, 3.0, 10.0, 30.0):
        point = min(curve, key=lambda point, mu=mu: abs(point.parameter - mu))
        period, error = true_error(point, clock, point.parameter, point.values["k"])
        assert error <= tolerance
        assert 0.8 * error <= point.values["state_error"] <= 1.6 * error
        # Known from the series for small mu: 6.6632868593 at mu = 1.
        assert point.values["period"] == pytest.approx(6.6632868593, rel=1e-3 * tolerance + 3e-9)
        assert period == pytest.approx(6.6632868593, rel=1e-3 * tolerance + 3e-9)


def chain(t, x, p, out):
    # The two masses of section 4.4 with the slope of their friction as a parameter.
    slip, other = x[1] - 1.0, x[3] - 1.0
    rest = -0.14 * (1.0 + 1.14 * np.exp(-2.0)) * np.arctan(p[1])
    one = 0.14 * (1.0 + 1.14 * np.exp(-2.0 * np.abs(slip))) * np.arctan(p[1] * slip)
    two = 0.14 * (1.0 + 1.14 * np.exp(-2.0 * np.abs(other))) * np.arctan(p[1] * other)
    out[0] = x[1]
    out[1] = (-3.0 * x[0] - 0.4 * x[1] + x[2] + 0.2 * x[3] + p[0] * (rest - one)) / 2.5
    out[2] = x[3]
    out[3] = x[0] + 0.2 * x[1] - x[2] - 0.2 * x[3] + p[0] * (rest - two)


@pytest.mark.slow
def test_doublings_of_stick_slip_on_finer_meshes():
    """Over the slope of friction, beside orbits and a curve on 400 intervals."""
    field = vector_field(chain, {"B": 0.3, "slope": 100.0}, 4)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 9.0))
    curves, intervals = [], []
    for method, tolerance in ((Collocation(), 1e-7), (Collocation(400), None)):
        branch = orbit_branch(field, sliding.of_kind("Hopf")[0], bounds=(0.3, 9.0), method=method)
        doubling, = branch.of_kind("period doubling")
        doubling.branch.attributes["method"] = replace(
            doubling.branch.method, state_tolerance=tolerance)
        intervals += counts([doubling])
        curves.append(codim2_curve(
            field, doubling, "slope", both=False, direction=-1.0,
            bounds={"B": (0.3, 9.0), "slope": (20.0, 1000.0)},
            # By default the last step of Newton may leave 1e-7 of the width.
            options=ContinuationOptions(tolerance=1e-9)))
    curve, fine = curves
    assert curve.status is fine.status is BranchStatus.BOUND
    assert curve.message == ""
    assert curve.column("state_error").max() <= 1e-7
    assert max(counts(curve)) > intervals[0] <= min(counts(curve))
    # The orbits of the curve; an error may need one on twice the intervals.
    assert min(counts(fine)) == 400
    ends = [each.points[-1] for each in curves]
    assert [end.values["slope"] for end in ends] == pytest.approx(2 * [1000.0], rel=1e-11)
    assert ends[0].parameter == pytest.approx(ends[1].parameter, rel=1e-8)
    for point in curve.points[2::4]:
        orbit, at = point.orbit(), {"B": point.parameter, "slope": point.values["slope"]}
        exact = orbit_branch(vector_field(chain, at, 4),
                             PeriodicMotion(orbit.times, orbit.states, orbit.period), "B",
                             method=Collocation(400, state_tolerance=None),
                             options=ContinuationOptions(points=1, tolerance=1e-9)).points[0]
        true = apart(point, exact)
        assert true <= 1e-7
        # The distance of samples is accurate to 1e-8.
        assert 0.5 * true - 1e-8 <= point.values["state_error"] <= 4.0 * true


@pytest.mark.parametrize(("most", "intervals"), [(64, 16), (6, 6)])
def test_special_points_get_the_intervals_that_they_need(most, intervals):
    """Resonances in closed form from a branch on few intervals: errors at most 1e-9 widths."""
    field, t, circle = circle_field(twisted, lam=0.7, nu=0.8)
    branch = orbit_branch(
        field, PeriodicMotion(t, circle, period=np.pi), "lam", bounds=(0.3, 0.9),
        method=Collocation(4, most_intervals=most, tolerance=1.0), scales=np.ones(3))
    point = branch.of_kind("Neimark-Sacker")[0]
    point.branch.attributes["method"] = replace(point.branch.method, tolerance=1e-9)
    curve = codim2_curve(field, point, "nu", direction=-1.0, both=False,
                         bounds={"lam": (0.3, 0.9), "nu": (0.0, 1.0)})
    assert curve.message.endswith("" if most > 6 else ": allow more than most_intervals = 6.")
    assert bool(curve.message) == (most == 6)
    for special, exact in zip(curve.special, (2.0 / 3.0, 0.5), strict=True):
        assert special.kind.startswith("resonance")
        assert counts([special]) == [intervals]
        assert (special.parameter_error <= 0.6e-9) == (most > 6)
        assert abs(special.parameter - exact) == pytest.approx(
            special.parameter_error, rel=0.1, abs=2e-13)
        assert abs(special.values["nu"] - exact) == pytest.approx(
            special.second_parameter_error, rel=0.1, abs=2e-13)


@pytest.mark.parametrize("intervals", [16, 24, 11])
def test_the_sign_of_a_test_function_goes_over_to_other_meshes(intervals):
    """Vectors of either direction are turned to those before, on as many intervals or others."""
    field = vector_field(cusp, {"p": 0.2, "q": 0.3}, 2)
    t, s = np.linspace(0.0, np.pi, 400), np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
    circle = (1.0 + s) * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "p",
                          method=Collocation(16), direction=-1.0, bounds=(-0.3, 0.3),
                          scales=np.ones(2))
    curve, u, _ = orbit_curve(field, branch.of_kind("fold")[0], "q", {}, None, "fold")
    assert curve.orbit.intervals == 16
    u[-2] -= 0.01                                        # the test function is not zero here
    before = curve.linearise(u)
    assert before.gradient.any()                         # keeps the direction of its vectors
    value, kept = before.singularity.value, curve.sign
    assert abs(value) > 1e-3
    problem, moved, _ = curve.orbit.on_mesh(np.linspace(0.0, 1.0, intervals + 1) ** 1.1, u,
                                            np.zeros_like(u))
    assert isinstance(problem, CollocationProblem)
    found = of_fold(problem.linearise(moved))
    term, = found.terms
    for one in (1.0, -1.0):
        for other in (1.0, -1.0):
            turned = Singularity(one * other * found.value, (term._replace(
                left=one * term.left, states=other * term.states),), found.v)
            assert kept.aligned(turned, problem).value == pytest.approx(value, rel=1e-3)
    assert abs(ContinuedSign().aligned(found, problem).value) == pytest.approx(abs(value), rel=1e-3)
