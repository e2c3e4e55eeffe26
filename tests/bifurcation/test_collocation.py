"""Periodic orbits by collocation: linear algebra, order, meshes, forced systems, belts."""

import math

import numpy as np
import pytest
from collocation_fields import settled

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.continuation.pseudo_arclength import continuation
from fecontact.bifurcation.linalg import condensation as elimination
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.mesh import (
    equidistributed,
    extremes,
    extremes_of_run,
    interpolate,
    node_times,
    rule,
)
from fecontact.bifurcation.orbits.starts import MotionStart, converged_orbit


def stuart_landau(t, x, p, out):
    s = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - s) * x[0] - p[1] * x[1]
    out[1] = p[1] * x[0] + (p[0] - s) * x[1]


def resonator(t, x, p, out):
    out[0] = x[1]
    out[1] = -x[0] - 2.0 * p[1] * x[1] + np.cos(p[0] * t)


def belt(t, x, p, out):
    v = x[1] - p[1]
    out[0] = x[1]
    out[1] = -x[0] - 2.0 / math.pi * math.atan(p[0] * v) / (1.0 + 3.0 * abs(v))


def drift(t, x, p, out):
    out[0] = 1.0 + p[0] * x[1] * x[1]
    out[1] = -x[1]


@pytest.fixture(scope="module")
def landau():
    return vector_field(stuart_landau, {"r": 0.5, "w": 2.0}, 2)


def orbit_on(field, mesh, degree, r=0.5):
    t = 2.0 * np.pi * node_times(mesh, degree)
    guess = 0.8 * np.stack([np.cos(t), np.sin(t)], axis=1)
    problem = CollocationProblem(field, field.values, 0, mesh, degree, guess, np.ones(4))
    u = np.concatenate([guess.reshape(-1), [3.0, r]])
    row = np.zeros(len(u))
    row[-1] = 1.0
    for _ in range(8):
        linearised = problem.linearise(u)
        u = u + linearised.solve(row, -np.append(linearised.residual, 0.0))
    return problem, u


def dense_system(problem, u):
    """The bordered matrix by differences of the residual."""
    n = len(u)
    G = np.empty((n - 1, n))
    for k in range(n):
        step = np.zeros(n)
        step[k] = 1e-4
        G[:, k] = (8.0 * (problem.linearise(u + step).residual
                          - problem.linearise(u - step).residual)
                   - problem.linearise(u + 2.0 * step).residual
                   + problem.linearise(u - 2.0 * step).residual) / 12e-4
    return G


def test_condensed_solution_is_that_of_the_whole_system(landau):
    rng = np.random.default_rng(2)
    mesh = np.array([0.0, 0.1, 0.3, 0.55, 0.8, 1.0])
    problem, u = orbit_on(landau, mesh, 3)
    u = u + 0.1 * rng.normal(size=len(u))
    row, rhs = rng.normal(size=len(u)), rng.normal(size=len(u))
    expected = np.linalg.solve(np.vstack([dense_system(problem, u), row]), rhs)
    found = problem.linearise(u).solve(row, rhs)
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-7 * np.abs(expected).max())


def test_parameter_that_moves_the_period_of_the_forcing():
    field = vector_field(resonator, {"w": 0.8, "D": 0.1}, 2,
                         period=lambda p: 2.0 * np.pi / p["w"])
    rng = np.random.default_rng(4)
    nodes = rng.normal(size=(12, 2))
    problem = CollocationProblem(field, field.values, 0, np.linspace(0.0, 1.0, 5), 3, nodes,
                                 np.ones(4))
    u = np.append(nodes.reshape(-1), 0.8)
    row, rhs = rng.normal(size=len(u)), rng.normal(size=len(u))
    expected = np.linalg.solve(np.vstack([dense_system(problem, u), row]), rhs)
    assert problem.linearise(u).solve(row, rhs) == pytest.approx(
        expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(("degree", "coarse"), [(2, 16), (3, 10), (4, 6), (5, 5)])
def test_error_at_mesh_points_falls_with_order_2m(landau, degree, coarse):
    errors = []
    for intervals in (coarse, 2 * coarse):
        t = np.linspace(0.0, 1.0, intervals + 1)
        problem, u = orbit_on(landau, t + 0.3 / (2.0 * np.pi) * np.sin(2.0 * np.pi * t), degree)
        radius = np.linalg.norm(problem.nodes(u)[::degree], axis=1)
        errors.append([abs(problem.period(u) - np.pi), np.abs(radius - np.sqrt(0.5)).max(),
                       abs(problem.linearise(u).floquet.others[0] - np.exp(-np.pi))])
    rates = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert rates == pytest.approx(np.full(3, 2.0 * degree), abs=0.35)


def test_error_between_mesh_points_falls_with_order_m_plus_one(landau):
    errors = []
    for intervals in (12, 24):
        problem, u = orbit_on(landau, np.linspace(0.0, 1.0, intervals + 1), 3)
        t = np.linspace(0.0, 1.0, 1000)
        radius = np.linalg.norm(interpolate(problem.mesh, problem.nodes(u), t), axis=1)
        errors.append(np.abs(radius - np.sqrt(0.5)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.15)


def test_resonance_curve():
    D = 0.1
    field = vector_field(resonator, {"w": 0.5, "D": D}, 2,
                         period=lambda p: 2.0 * np.pi / p["w"])
    period = 4.0 * np.pi
    t = np.linspace(0.0, period, 400)
    X = 1.0 / np.hypot(1.0 - 0.25, 2.0 * D * 0.5)
    phase = 0.5 * t - np.arctan2(2.0 * D * 0.5, 1.0 - 0.25)
    states = np.stack([X * np.cos(phase), -0.5 * X * np.sin(phase)], axis=1)
    branch = orbit_branch(field, (t, states), "w", method=Collocation(intervals=24),
                          bounds=(0.5, 1.5), options=ContinuationOptions(largest_step=0.1))
    w = branch.parameter
    assert w[-1] == pytest.approx(1.5, abs=1e-12)
    assert branch.column("period") == pytest.approx(2.0 * np.pi / w, rel=1e-12)
    assert branch.column("maximum")[:, 0] == pytest.approx(
        1.0 / np.hypot(1.0 - w**2, 2.0 * D * w), rel=2e-6)
    # Both multipliers of the damped oscillator have the modulus exp(-D T).
    assert np.abs(branch.column("multipliers")) == pytest.approx(
        np.exp(-D * branch.column("period"))[:, None] * np.ones(2), rel=1e-7)
    assert not branch.special


def test_mesh_goes_where_the_solution_is_steep():
    def steep(t):
        return np.stack([np.tanh(40.0 * (t - 0.3)) - np.tanh(40.0 * (t - 0.7))], axis=1)

    mesh = np.linspace(0.0, 1.0, 41)
    t = np.linspace(0.0, 1.0, 5001)
    uniform = np.abs(interpolate(mesh, steep(node_times(mesh, 4)), t) - steep(t)).max()
    for _ in range(4):
        mesh = equidistributed(mesh, steep(node_times(mesh, 4)), 4, 40)
    adapted = np.abs(interpolate(mesh, steep(node_times(mesh, 4)), t) - steep(t)).max()
    assert adapted < uniform / 25.0
    assert mesh[0] == 0.0
    assert mesh[-1] == 1.0
    assert np.diff(mesh).min() > 0.0


def test_guess_is_bent_like_the_branch(landau):
    """Third order in the step, where the tangent alone is of second; circles of radius sqrt(r)."""
    mesh = np.linspace(0.0, 1.0, 31)
    problem, _ = orbit_on(landau, mesh, 4)
    t = 2.0 * np.pi * node_times(mesh, 4)
    circle = np.stack([np.cos(t), np.sin(t)], axis=1).reshape(-1)

    def orbit(radius):
        return np.concatenate([radius * circle, [np.pi, radius**2]])

    def tangent(radius):
        return np.concatenate([circle, [0.0, 2.0 * radius]]) / np.sqrt(1.0 + 4.0 * radius**2)

    def error(step, guess):
        radii = 0.7 + step * np.linspace(0.3, 1.2, 2001)
        return min(np.sqrt(problem.weights() @ (guess - orbit(radius)) ** 2) for radius in radii)

    bent, straight = [], []
    for step in (0.1, 0.05):
        first, _, _ = problem.adapted(orbit(0.7 - step), tangent(0.7 - step))
        here, _, _ = first.adapted(orbit(0.7), tangent(0.7))
        bent.append(error(step, here.predicted(orbit(0.7), tangent(0.7), step)))
        straight.append(error(step, orbit(0.7) + step * tangent(0.7)))
    assert bent[1] < bent[0] / 6.0
    assert straight[0] / 5.0 < straight[1] < straight[0] / 3.0
    assert bent[1] < 0.25 * straight[1]


def test_one_factorisation_an_orbit(landau, monkeypatch):
    """The matrix of the neighbour serves on the way to the next orbit."""
    made = []
    condense = elimination.condense

    def counted(*arguments):
        made.append(1)
        condense(*arguments)

    monkeypatch.setattr(elimination, "condense", counted)
    problem, u = orbit_on(landau, np.linspace(0.0, 1.0, 21), 4)
    made.clear()
    options = ContinuationOptions(step=0.02, largest_step=0.02, points=30, locate=False)
    points = list(continuation(problem, u, options))
    assert len(points) == 30
    for point in points:
        radius = np.linalg.norm(problem.nodes(point.u), axis=1)
        assert radius == pytest.approx(np.sqrt(point.parameter), rel=1e-5)
    assert len(made) <= 36


def test_extremes_of_runs_are_those_of_cubics():
    """Cubics turn within the first step, the second one, at a sample, or nowhere."""
    t = np.array([0.0, 1.0, 2.0])
    cubics = [np.polynomial.Polynomial(c) for c in (
        [0.0, 1.0, -1.0, 0.1], [1.0, -3.0, 0.0, 0.5], [0.0, 2.0, -1.0], [0.0, 1.0, 0.0, 1.0],
        [2.0])]
    low, high = extremes_of_run(np.stack([p(t) for p in cubics], axis=1),
                                np.stack([p.deriv()(t) for p in cubics], axis=1))
    fine = np.linspace(0.0, 2.0, 200001)
    assert low == pytest.approx([p(fine).min() for p in cubics], abs=1e-9)
    assert high == pytest.approx([p(fine).max() for p in cubics], abs=1e-9)


def test_extremes_lie_between_the_nodes():
    mesh = np.linspace(0.0, 1.0, 13)
    t = 2.0 * np.pi * (node_times(mesh, 4) + 0.0137)
    low, high = extremes(np.stack([np.cos(t), 3.0 + np.sin(t)], axis=1), 4)
    assert low == pytest.approx([-1.0, 2.0], abs=2e-6)
    assert high == pytest.approx([1.0, 4.0], abs=2e-6)


def test_rule_integrates_and_differentiates_polynomials():
    for degree in (2, 4, 7):
        given = rule(degree)
        nodes = np.linspace(0.0, 1.0, degree + 1)
        assert given.values @ nodes**degree == pytest.approx(given.points**degree, rel=1e-11)
        assert given.slopes @ nodes**degree == pytest.approx(
            degree * given.points ** (degree - 1), rel=1e-9)
        assert given.weights @ given.points ** (2 * degree - 1) == pytest.approx(
            1.0 / (2 * degree), rel=1e-12)
        assert given.top @ nodes**degree == pytest.approx(math.factorial(degree), rel=1e-8)


@pytest.mark.parametrize(("slope", "period", "largest"), [
    (100.0, 9.70968083, 0.91023681), (1e3, 11.29815066, 1.0670795093),
    (1e4, 11.80799363, 1.1158705968),
])
def test_mass_on_a_belt_with_steep_friction(slope, period, largest):
    field = vector_field(belt, {"slope": slope, "V": 0.2}, 2)
    times, states = settled(field, 60.0, [1.0, 0.2], period)
    start = MotionStart(field, field.values, 0, PeriodicMotion(times, states), np.ones(3))
    problem, u = converged_orbit(*start.on_mesh(200, 4))
    assert problem.period(u) == pytest.approx(period, abs=1e-8)
    assert extremes(problem.nodes(u), 4)[1][0] == pytest.approx(largest, abs=2e-9)


def test_kind_errors(landau):
    t = np.linspace(0.0, 10.0, 500)
    circle = 0.7 * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    with pytest.raises(InputError, match="cover 10 s, but the period is 20 s"):
        orbit_branch(landau, PeriodicMotion(t, circle, period=20.0), "r")
    with pytest.raises(InputError, match=r"times \(k,\) and states \(k, 2\)"):
        orbit_branch(landau, (t, circle[:, :1]), "r")
    with pytest.raises(InputError, match="do not come back"):
        orbit_branch(landau, (t, np.stack([t, t**2], axis=1)), "r")
    with pytest.raises(InputError, match="intervals = 1 must be"):
        orbit_branch(landau, (t, circle), "r", method=Collocation(intervals=1))
    with pytest.raises(InputError, match="degree = 9 must be"):
        orbit_branch(landau, (t, circle), "r", method=Collocation(degree=9))
    with pytest.raises(InputError, match=r"scales = .* must hold 2 numbers"):
        orbit_branch(landau, (t, circle), "r", scales=[1.0])
    with pytest.raises(AnalysisError, match=r"at r = -0\.5, from the period .*larger amplitude"):
        orbit_branch(landau, PeriodicMotion(t, circle, parameter_values=[-0.5, 2.0]), "r")
    drifting = vector_field(drift, {"r": 0.5}, 2)
    with pytest.raises(AnalysisError, match=r"at r = 0\.5, from the period 5 s: the "
                       r"iteration ends without any motion"):
        orbit_branch(drifting, PeriodicMotion(t, circle, period=5.0), "r",
                     method=Collocation(intervals=20))


def test_no_convergence_is_told_with_what_to_try():
    # Far too few intervals for friction that is steep.
    field = vector_field(belt, {"slope": 1e5, "V": 0.2}, 2)
    times, states = settled(field, 60.0, [1.0, 0.2], 12.0)
    with pytest.raises(AnalysisError, match=r"at slope = 100000, from the period 11\.\d+ s: "
                       r"Newton's method does not converge .* 3 intervals"):
        orbit_branch(field, (times, states), "slope", method=Collocation(intervals=3, degree=2))
