"""Curves of folds, doublings and tori of orbits against branches at other parameters."""

from dataclasses import replace

import numpy as np
import pytest
from collocation_fields import two_masses_field

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    equilibrium_branch,
    orbit_branch,
    periodic_motion,
    vector_field,
)
from fecontact.bifurcation.orbits.curves import errors
from fecontact.bifurcation.orbits.curves.codim2 import OrbitCurve
from fecontact.bifurcation.orbits.normal_forms import Expansion


def first_branch(**changes):
    field = two_masses_field(**changes)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.2, 12.0))
    return field, orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=80),
                               bounds=(0.2, 12.0))


@pytest.fixture(scope="module")
def masses():
    return first_branch()


@pytest.mark.parametrize(("kind", "second", "tolerance"), [
    ("fold", "v0", 1e-9), ("period doubling", "D", 1e-8)])
def test_curve_agrees_with_branches(masses, kind, second, tolerance):
    field, branch = masses
    start, = branch.of_kind(kind)
    curve = codim2_curve(field, start, second, bounds={"B": (0.2, 20.0)}, both=False,
                         options=ContinuationOptions(step=0.005, largest_step=0.03, points=12))
    assert len(curve) == 12
    assert curve.parameter[0] == pytest.approx(start.parameter, rel=tolerance)
    end = curve.points[-1]
    assert abs(end.values[second] / field.parameters[second] - 1.0) > 0.1
    _, other = first_branch(**{second: end.values[second]})
    expected, = other.of_kind(kind)
    assert end.parameter == pytest.approx(expected.parameter, rel=tolerance)
    assert end.values["period"] == pytest.approx(expected.values["period"], rel=tolerance)


def test_curves_have_at_least_the_intervals_of_their_first_point(masses):
    field, fine = masses
    before = max((point for point in fine.points if point.parameter < 8.05),
                 key=lambda point: point.parameter)
    branch = orbit_branch(field, before.orbit(field), "B", method=Collocation(intervals=40),
                          bounds=(7.8, 8.2), options=ContinuationOptions(step=0.02))
    start, = branch.of_kind("period doubling")
    intervals = len(start.values["mesh"]) - 1
    assert intervals > branch.method.intervals
    curve = codim2_curve(field, start, "D", bounds={"B": (0.2, 20.0)}, both=False,
                         options=ContinuationOptions(points=2))
    assert curve.method.intervals == intervals == len(curve.points[0].values["mesh"]) - 1


@pytest.mark.parametrize("kind", ["fold", "period doubling"])
def test_a_point_takes_one_step_with_the_matrix_before_and_one_with_its_own(
        masses, kind, monkeypatch):
    """Residuals reach the tolerance squared, multipliers are critical within the tolerance."""
    field, branch = masses
    calls = {"linearise": [], "evaluate": []}
    for name, told in calls.items():
        made = getattr(OrbitCurve, name)
        monkeypatch.setattr(OrbitCurve, name, lambda self, u, made=made, told=told: told.append(
            made(self, u)) or told[-1])
    curve = codim2_curve(field, branch.of_kind(kind)[0], "v0", bounds={"B": (0.2, 20.0)},
                         both=False, options=ContinuationOptions(step=0.01, largest_step=0.03,
                                                                 points=15))
    assert len(curve) == 15
    # Along the doublings some steps are too long for the matrix before.
    most = len(curve) + 4 if kind == "fold" else 2 * len(curve)
    assert max(map(len, calls.values())) <= most
    critical = 1.0 if kind == "fold" else -1.0
    for point in curve.points:
        problem = calls["linearise"][0].problem
        orbit = replace(problem.orbit, mesh=point.values["mesh"], reference=point.u[:-3].reshape(
            problem.orbit.reference.shape))
        assert np.abs(OrbitCurve(orbit, kind).linearise(point.u).residual).max() < 1e-9
        assert np.sort(np.abs(point.values["multipliers"] - critical))[
            1 if kind == "fold" else 0] < 1e-5


def torus(t, x, p, out):
    # A circle of radius one; across it w' = (lam - a^2 + 0.7 i) w - w |w|^2, w = r - 1 + i z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] * p[1] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def test_curve_of_tori(monkeypatch):
    """With one coefficient, which tells Chenciner points, for each point of the curve."""
    formula, called = Expansion.torus, []
    field = vector_field(torus, {"lam": -0.2, "a": 0.3}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    point, = branch.of_kind("Neimark-Sacker")
    monkeypatch.setattr(Expansion, "torus",
                        lambda self, terms: called.append(1) or formula(self, terms))
    curve = codim2_curve(field, point, "a", direction=-1.0, both=False,
                         bounds={"lam": (-0.1, 0.5), "a": (-0.5, 0.5)},
                         options=ContinuationOptions(points=30))
    assert curve.parameter == pytest.approx(curve.column("a") ** 2, abs=1e-9)
    # It goes through the turning point a = 0, and on.
    assert curve.column("a").min() < -0.1
    turning, = curve.special
    assert turning.kind == "turning point"
    assert turning.values["a"] == pytest.approx(0.0, abs=1e-6)
    # Not where the turning point is sought; twice for its error, on the finer mesh.
    assert len(called) == len(curve) - 1 + 2


def circle_field(function, states=3, **parameters):
    """Orbits of the period pi on the circle of radius one and beside it."""
    field = vector_field(function, parameters, states)
    t = np.linspace(0.0, np.pi, 400)
    return field, t, np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)


def cusp(t, x, p, out):
    # s' = p + q s - s^3 with s = r - 1.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s = r - 1.0
    radial = p[0] + p[1] * s - s * s * s
    out[0] = radial * x[0] / r - 2.0 * x[1]
    out[1] = radial * x[1] / r + 2.0 * x[0]


def test_cusp_of_cycles():
    """Folds at q = 3 s^2, p = -2 s^3."""
    field = vector_field(cusp, {"p": 0.2, "q": 0.3}, 2)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    s = np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + s) * circle, period=np.pi), "p",
                          method=Collocation(intervals=16), direction=-1.0, bounds=(-0.3, 0.3),
                          scales=np.ones(2))
    folds = branch.of_kind("fold")
    assert sorted(at.parameter for at in folds) == pytest.approx(
        [-2.0 * 0.1**1.5, 2.0 * 0.1**1.5], rel=1e-8)
    curve = codim2_curve(field, folds[0], "q", bounds={"p": (-0.2, 0.2), "q": (-0.5, 0.5)},
                         options=ContinuationOptions(largest_step=0.03, points=60))
    p, q = curve.parameter, curve.column("q")
    assert p**2 == pytest.approx(4.0 * (q / 3.0) ** 3, abs=1e-9)
    assert p.min() < -0.1
    assert p.max() > 0.1
    found, = curve.special
    assert found.kind == "cusp"
    assert [found.parameter, found.values["q"]] == pytest.approx([0.0, 0.0], abs=1e-7)


def doubling(t, x, p, out):
    # Across the circle a' = a g, g = lam - 0.3 k + k a^2 - a^4, and b' = -b, where a + i b turns
    # by half a turn in a period: w = (a + i b) exp(i phi / 2).
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, u, v = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = (u * u + v * v + (u * u - v * v) * C + 2.0 * u * v * S) / 2.0
    g = p[0] - 0.3 * p[1] + p[1] * square - square * square
    low, high = (g - 1.0) / 2.0, (g + 1.0) / 2.0
    radial = low * u + high * (C * u + S * v) - v
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = low * v + high * (S * u - C * v) + u


def test_generalised_period_doubling():
    """The multiplier is -exp(pi (lam - 0.3 k)), the cubic coefficient k."""
    field, t, circle = circle_field(doubling, lam=-0.4, k=-0.5)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    point, = branch.of_kind("period doubling")
    assert point.parameter == pytest.approx(-0.15, abs=1e-9)
    curve = codim2_curve(field, point, "k", bounds={"lam": (-0.3, 0.15), "k": (-0.6, 0.4)})
    assert curve.parameter_names == ("lam", "k")
    # It ends on the bounds of both parameters, one to each side.
    assert [curve.parameter[-1], curve.column("k")[0]] == pytest.approx([0.12, -0.6], rel=1e-9)
    assert curve.parameter == pytest.approx(0.3 * curve.column("k"), abs=1e-9)
    found, = curve.special
    assert found.kind == "generalised period doubling"
    assert found.values["k"] == pytest.approx(0.0, abs=1e-6)


def twisted(t, x, p, out):
    # ``torus`` with w' = (lam - nu + i nu) w - w |w|^2.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] - a * a - z * z
    radial = growth * a - p[1] * z
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = growth * z + p[1] * a


def test_strong_resonances():
    """The multipliers of the circle are exp(pi (lam - nu +- i nu))."""
    field, t, circle = circle_field(twisted, lam=0.7, nu=0.8)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(0.3, 0.9), scales=np.ones(3))
    point, = branch.of_kind("Neimark-Sacker")
    curve = codim2_curve(field, point, "nu", direction=-1.0, both=False,
                         bounds={"lam": (0.3, 0.9), "nu": (0.0, 1.0)})
    assert [(at.kind, at.values["nu"]) for at in curve.special] == [
        ("resonance 1:3", pytest.approx(2.0 / 3.0, abs=1e-8)),
        ("resonance 1:4", pytest.approx(0.5, abs=1e-8))]


def sheared(t, x, p, out):
    # Across the circle, (a, b)' = (p0 a - b, p1 a + p0 b).
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    cube = a * a + z * z
    radial = (p[0] - cube) * a - z
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = (p[0] - cube) * z + p[1] * a


def test_a_curve_of_tori_ends_where_neutral_saddles_begin():
    """Multipliers exp(pi (p0 +- i sqrt(p1))): tori at p0 = 0 for p1 > 0 alone."""
    field, t, circle = circle_field(sheared, growth=-0.2, shear=0.1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "growth",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3))
    point, = branch.of_kind("Neimark-Sacker")
    assert point.angle == pytest.approx(np.pi * np.sqrt(0.1), rel=1e-8)
    curve = codim2_curve(field, point, "shear", direction=-1.0,
                         bounds={"growth": (-0.3, 0.3), "shear": (-0.4, 0.4)})
    assert curve.parameter == pytest.approx(np.zeros(len(curve)), abs=1e-9)
    shear = curve.column("shear")
    ends = sorted([shear[0], shear[-1]])
    assert ends == pytest.approx([0.0, 0.4], abs=1e-8)
    assert curve.of_kind("resonance 1:4")[0].values["shear"] == pytest.approx(0.25, abs=1e-8)
    end, = curve.of_kind("resonance 1:1")
    assert end in (curve.points[0], curve.points[-1])


@pytest.mark.parametrize(("moves", "meshes"), [((1e-6, 0.0, 1e-6, 0.0), 2),
                                               ((1e-6, 1.1e-6, 1.1001e-6), 3)])
def test_a_point_that_rounding_moves_to_and_fro_needs_no_finer_mesh(moves, meshes, monkeypatch):
    """It stays where it was, with the distance as its error; one that converges goes on."""
    field, t, circle = circle_field(sheared, growth=-0.2, shear=0.1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "growth",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3))
    found, own = [], errors.found_near

    def moved(place, kind):
        there = own(place, kind)
        u = there.u.copy()
        u[-1] += moves[len(found)]
        found.append(place.problem.orbit.intervals)
        return replace(there, u=u)

    monkeypatch.setattr(errors, "found_near", moved)
    curve = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "shear", both=False,
                         direction=1.0, bounds={"growth": (-0.3, 0.3), "shear": (-0.4, 0.4)})
    point, = curve.special
    assert point.kind == "resonance 1:4"
    assert found == [32, 64, 128][:meshes]
    if meshes == 2:
        assert point.parameter == pytest.approx(0.0, abs=1e-10)
        assert point.parameter_error == pytest.approx(1e-6, rel=1e-3)
    else:
        assert point.parameter == pytest.approx(1.1e-6, abs=1e-10)
        assert point.parameter_error < 2e-8


def ring(t, x, p, out):
    # s' = p^2 + q^2 - 1/4 + s^2 + p s / 10 with s = r - 1.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s = r - 1.0
    radial = p[0] * p[0] + p[1] * p[1] - 0.25 + s * s + 0.1 * p[0] * s
    out[0] = radial * x[0] / r - (2.0 + 0.3 * x[0]) * x[1]
    out[1] = radial * x[1] / r + (2.0 + 0.3 * x[0]) * x[0]


def test_a_closed_curve_of_folds_is_gone_round_once():
    """s = -p / 20 and 0.9975 p^2 + q^2 = 1/4."""
    field = vector_field(ring, {"p": 0.0, "q": 0.1}, 2)
    t = np.linspace(0.0, 2.0 * np.pi / np.sqrt(4.0 - 0.09 * 0.24), 600)
    circle = (1.0 - np.sqrt(0.24)) * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=float(t[-1])), "p",
                          method=Collocation(intervals=20), bounds=(-1.0, 1.0), scales=np.ones(2))
    assert branch.status is BranchStatus.CLOSED
    curve = codim2_curve(field, branch.of_kind("fold")[0], "q",
                         bounds={"p": (-1.0, 1.0), "q": (-1.0, 1.0)})
    assert curve.status is BranchStatus.CLOSED
    p, q = curve.parameter, curve.column("q")
    assert 0.9975 * p**2 + q**2 == pytest.approx(np.full(len(p), 0.25), abs=1e-8)
    angle = np.unwrap(np.arctan2(q, p))
    assert abs(angle[-1] - angle[0]) == pytest.approx(2.0 * np.pi, rel=1e-6)
    assert [point.kind for point in curve.special] == ["turning point"] * 2


def mathieu(t, x, p, out):
    out[0] = x[1]
    out[1] = (-0.05 * x[1] - (p[0] + 0.3 * np.cos(t)) * x[0] - x[0] * x[0] * x[0]
              + p[1] * np.cos(t))


def test_a_curve_of_doublings_goes_on_where_the_forced_motion_vanishes():
    """The curve is even in A; its d at A = -0.05 and 0 are those of monodromies by DOP853."""
    field = vector_field(mathieu, {"d": 0.6, "A": 0.1}, 2, period=2.0 * np.pi)
    branch = orbit_branch(field, periodic_motion(field, initial=[0.0, 0.0]), "d", direction=-1.0,
                          method=Collocation(intervals=20), bounds=(0.3, 0.6))
    curve = codim2_curve(field, branch.of_kind("period doubling")[0], "A",
                         bounds={"d": (-0.5, 1.0), "A": (-0.05, 0.11)})
    assert curve.status is BranchStatus.BOUND
    assert np.sort(curve.column("A"))[[0, -1]] == pytest.approx([-0.05, 0.11], rel=1e-9)
    assert curve.parameter[np.argmin(curve.column("A"))] == pytest.approx(0.3727682553, abs=1e-8)
    turning, = curve.special
    assert [turning.parameter, turning.values["A"]] == pytest.approx([0.3857444190, 0.0], abs=1e-8)


def test_kind_errors(masses):
    field, branch = masses
    with pytest.raises(InputError, match="starts no curve; take a point of the kind 'fold'"):
        codim2_curve(field, branch.points[3], "v0")
    fold, = branch.of_kind("fold")
    with pytest.raises(InputError, match="no parameter 'speed'"):
        codim2_curve(field, fold, "speed")
    with pytest.raises(InputError, match="parameter = 'B' is that of the branch"):
        codim2_curve(field, fold, "B")
