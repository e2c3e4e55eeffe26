"""Fields that are not finite beside an orbit: errors are infinite, and coefficients avoid them."""

from dataclasses import replace

import numpy as np
import pytest
from test_orbit_curves import circle_field

from fecontact import AnalysisError
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.orbits import collocation
from fecontact.bifurcation.orbits.collocation import Intervals
from fecontact.bifurcation.orbits.curves import codim2_forms
from fecontact.bifurcation.orbits.mesh import rule
from fecontact.bifurcation.orbits.restored import restored
from fecontact.bifurcation.orbits.state_error import state_error

BOX = {"lam": (-0.3, 0.5), "k": (-0.5, 0.5)}
TURN = 2.0 * np.pi


def cusp(t, x, p, out):
    # a' = lam + k a - 2 a^3 with r = 1 + a + 0.2 z^2, z' = a^2 - z; the speed along all orbits is
    # that of a root, which ends at r = 1 - 1 / steep.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a, speed = r - 1.0 - 0.2 * z * z, np.sqrt(1.0 + p[2] * (r - 1.0))
    dz = a * a - z
    radial = speed * (p[0] + p[1] * a - 2.0 * a * a * a + 0.4 * z * dz)
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = speed * dz


def cusp_point(steep):
    field, t, circle = circle_field(cusp, lam=0.2, k=0.5, steep=steep)
    a = np.roots([-2.0, 0.0, 0.5, 0.2]).real.max()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + a) * circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3),
                          direction=-1.0)
    return codim2_curve(field, branch.of_kind("fold")[0], "k", bounds=BOX).of_kind("cusp")[0]


@pytest.mark.parametrize("steep", [0.8, 1.9])
def test_coefficients_of_a_field_that_ends_beside_the_orbit(steep):
    """At r = 0.47 the field ends: only amplitudes below half of the orbit's range are used."""
    point = cusp_point(steep)
    assert point.normal_form == pytest.approx({"c": -2.0 * np.pi}, rel=1e-6)
    assert abs(point.normal_form["c"] + 2.0 * np.pi) < point.normal_form_errors["c"] < 1e-5


def test_no_coefficients_where_no_amplitude_has_finite_rates(monkeypatch):
    monkeypatch.setattr(codim2_forms, "_RADII", (0.5, 0.45))
    point = cusp_point(1.9)
    assert point.normal_form == {}
    assert point.normal_form_errors == {}


def third(t, x, p, out):
    # w' = (e + i (f + 2 / 3)) w + (-1.3 + 0.7 i) w |w|^2 + 0.5 conj(w)^2 exp(i phi) across the
    # circle, w = a + i z with a = r - 1 - 0.2 z^2; no values where r < 1 - p[2].
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    c, s, z = x[0] / r, x[1] / r, x[2]
    a = r - 1.0 - 0.2 * z * z
    R, u, v = a * a + z * z, a * a - z * z, -2.0 * a * z
    k, m = 0.5 * c, 0.5 * s
    g, h = p[0] - 1.3 * R, p[1] + 2.0 / 3.0 + 0.7 * R
    dz = g * z + h * a + k * v + m * u
    none = 0.0 * np.sqrt(r - 1.0 + p[2])
    radial = g * a - h * z + k * u - m * v + 0.4 * z * dz + none
    out[0], out[1] = radial * c - 2.0 * r * s, radial * s + 2.0 * r * c
    out[2] = dz


def test_resonances_of_a_field_that_ends_beside_the_orbit(monkeypatch):
    box = {"e": (-0.3, 0.3), "f": (-0.3, 0.3)}
    field, t, circle = circle_field(third, e=-0.2, f=-0.1, workspace=0.05)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "e",
                          method=Collocation(intervals=16), bounds=box["e"], scales=np.ones(3))
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "f", bounds=box)
    point, = tori.of_kind("resonance 1:3")
    assert point.normal_form == pytest.approx(
        {"b": np.sqrt(2.0) * np.pi * 0.5, "c": -2.6 * np.pi}, rel=1e-6)
    saddles = orbit_branch(field, point, bounds=box["e"], options=ContinuationOptions(points=3))
    assert saddles.points[0].values["period"] == pytest.approx(3.0 * np.pi, rel=1e-9)
    monkeypatch.setattr(codim2_forms, "_RADII", (0.5, 0.45))
    with pytest.raises(AnalysisError, match=r"\(resonance 1:3\) has no normal form\. The "
                                            r"rates about the orbit are not finite at amplitudes"):
        orbit_branch(field, point, bounds=box["e"])


def driven(t, x, p, out):
    # x = p0 (cos t + sin t) / 2; no value within 1e-4 of the time p1.
    out[0] = p[0] * np.cos(t) - x[0]
    if np.abs(t - p[1]) < 1e-4:
        out[0] = np.nan


def driven_field(gap):
    return vector_field(driven, {"P": 1.0, "gap": gap}, 1, period=TURN,
                        differentiation="differences")


def driven_branch(gap, **method):
    t = np.linspace(0.0, TURN, 400)
    motion = PeriodicMotion(t, 0.5 * (np.cos(t) + np.sin(t))[:, None])
    return orbit_branch(driven_field(gap), motion, "P", bounds=(0.5, 2.0),
                        method=Collocation(16, **method), options=ContinuationOptions(points=1))


def test_error_of_an_orbit_without_rates_between_its_points(monkeypatch):
    """One of the Gauss points of half an interval lies where the field has no value."""
    whole, = driven_branch(-1.0).points
    problem, u, _ = restored(driven_field(-1.0), whole)
    assert 0.0 < state_error(problem, u) < 1e-4
    begin, width = problem.mesh[3], problem.widths[3]
    gap = TURN * float(begin + 0.5 * width * rule(problem.degree).points[1])
    assert np.abs(problem.times * TURN - gap).min() > 1e-3
    problem, u, _ = restored(driven_field(gap), whole)
    problem = replace(problem, values=np.array([1.0, gap]))
    assert np.isfinite(problem.linearise(u).residual).all()
    assert state_error(problem, u) == np.inf

    branch = driven_branch(gap, state_tolerance=None)
    assert branch.column("state_error").tolist() == [np.inf]
    said = ("The states of 1 of 1 orbits are less accurate than state_tolerance = 1e-05, and at "
            "the parameter 1 without bound, as the field is not finite between the Gauss points or "
            "the equations about the orbit are singular: allow more than "
            "most_intervals = 16.")
    with monkeypatch.context() as patched:
        patched.setattr(collocation, "_WORTH", 0.0)
        assert driven_branch(gap, most_intervals=16).message == said
    # Of as many intervals one other mesh is tried, if all have such points.
    tried = []
    with monkeypatch.context() as patched:
        patched.setattr(collocation, "_error_of", lambda point: tried.append(point) or np.inf)
        assert len(driven_branch(gap, most_intervals=16).points) == 1
    assert len(tried) < 12
    # On a finer mesh the points are others, and on another one of as many intervals.
    for most in (16, 800):
        branch = driven_branch(gap, most_intervals=most)
        assert branch.message == ""
        assert branch.points[0].values["state_error"] < 1e-5
    # So they are where a branch goes on from such an orbit.
    poor, = driven_branch(gap, state_tolerance=None).points
    on = orbit_branch(driven_field(gap), poor, method=Collocation(8), bounds=(0.5, 2.0),
                      options=ContinuationOptions(points=1))
    assert len(on.points) == 1


def layer(t, x, p, out):
    # A step of slope p0 at x = 0.
    out[0] = np.cos(t) - x[0] - 0.5 * np.tanh(p[0] * x[0])


def layer_slope(t, x, p, out):
    out[0, 0] = -1.0 - 0.5 * p[0] / np.cosh(p[0] * x[0]) ** 2
    if p[1] > 0.0:
        out[0, 0] = np.nan


@pytest.mark.long
def test_error_of_an_orbit_without_a_jacobian():
    """The error is infinite if the Jacobian with which it is solved for is not finite."""
    field = vector_field(layer, {"slope": 1e3, "none": 0.0}, 1, jacobian=layer_slope, period=TURN)
    t = np.linspace(0.0, 20.0 * TURN, 40001)
    x = np.zeros(len(t))
    for i in range(len(t) - 1):
        h = t[i + 1] - t[i]
        # Implicit steps.
        x[i + 1] = x[i]
        for _ in range(30):
            s = np.tanh(1e3 * x[i + 1])
            f = np.cos(t[i + 1]) - x[i + 1] - 0.5 * s
            slope = -1.0 - 500.0 * (1.0 - s * s)
            x[i + 1] -= (x[i + 1] - x[i] - h * f) / (1.0 - h * slope)
    last = t > 19.0 * TURN - 1e-9
    branch = orbit_branch(field, PeriodicMotion(t[last] - t[last][0], x[last, None]), "slope",
                          method=Collocation(20, state_tolerance=None), bounds=(500.0, 2e3),
                          options=ContinuationOptions(points=1))
    problem, u, _ = restored(field, branch.points[0])
    assert 0.0 < state_error(problem, u) < 0.1
    assert state_error(replace(problem, values=np.array([1e3, 1.0])), u) == np.inf


def test_numbers_of_intervals_where_errors_are_infinite():
    sizes = Intervals(50, 800, 1e-5)
    assert sizes.after(100, np.inf, 4) == 200
    assert sizes.after(500, np.inf, 4) == 800
    assert sizes.at_start(200, np.inf, 4) == 200
    assert sizes.at_start(50, np.inf, 4) == 50
