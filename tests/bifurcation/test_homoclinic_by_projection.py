"""Homoclinic orbits over two parameters, with ends on the linear subspaces of the saddle.

Against separatrices found by an independent integrator, closed forms, and systems in which the
special points of such curves lie at known parameters.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyfit
from test_branch_ends import homoclinic, takens

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    codim2_curve,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.homoclinic.starts import homoclinic_curve
from fecontact.io import read_branch, write_branch

BOX = {"m": (-4.0, 0.0), "c": (-2.0, 5.0)}


@pytest.fixture(scope="module")
def field():
    return vector_field(takens, {"m": -1.0, "c": 0.2}, 2)


@pytest.fixture(scope="module")
def near(field):
    """Last orbit of the branch over c, next to the homoclinic one."""
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-2.0, 2.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    return orbits.points[-1]


@pytest.fixture(scope="module")
def curve(field, near):
    return codim2_curve(field, near, "m", to="homoclinic", bounds=BOX)


def test_a_curve_agrees_with_separatrices(curve, near):
    assert curve.parameter_names == ("c", "m")
    assert not curve.special
    m, c = curve.column("m"), curve.column("c")
    assert np.max(m) > -5e-4
    assert np.min(m) == pytest.approx(-4.0, rel=1e-12)
    large = np.flatnonzero(m < -0.4)
    for place in large[:: len(large) // 5]:
        error = c[place] - homoclinic(m[place])
        # The curve is parametrised along itself, the error counts across it, in widths.
        assert abs(error) < 3e-8
        assert abs(error) < 5.0 * 7.0 * curve.points[place].values["truncation_error"]
    assert curve.column("truncation_error").max() < 1e-6
    # The branch of orbits itself is 5e-5 away.
    assert abs(near.parameter - homoclinic(-1.0)) > 1e-5


def test_the_curve_tends_to_the_bogdanov_takens_point(curve):
    """m = -(49/25) c^2 + O(c^3), as in Guckenheimer and Holmes, section 7.3."""
    m, c = curve.column("m"), curve.column("c")
    root = np.sqrt(-m)
    some = (root > 0.05) & (root < 0.8)
    tends, slope = polyfit(root[some], (c / root)[some], 4)[:2]
    assert tends == pytest.approx(5.0 / 7.0, abs=1e-6)
    assert 0.0299 < slope < 0.0301


def at_distance(problem, u, distance):
    """The homoclinic orbit at the same m on the interval that ends at such distances."""
    problem, u, _ = replace(problem, distance=distance, intervals=200).adapted(u, np.zeros_like(u))
    row = np.zeros_like(u)
    row[-2] = 1.0
    for _ in range(8):
        linearised = problem.linearise(u)
        u = u + linearised.solve(row, -np.append(linearised.residual, 0.0))
    return u[-1], problem.distances(u)[0]


def test_order_of_the_error_of_truncation(field, near):
    """With the rates l and m of the saddle, m < l, it falls as the distance to 2 + m / l.

    That is the square of the distance, by which the manifold leaves its tangent at the start,
    times the decay of the adjoint solution there.
    """
    problem, u, _ = homoclinic_curve(field, near, "m", {}, None)
    exact = at_distance(problem, u, 2e-5)[0]
    assert exact == pytest.approx(homoclinic(-1.0), abs=2e-10)
    found = [at_distance(problem, u, distance) for distance in (3e-2, 1e-2, 3e-3)]
    errors = np.array([value - exact for value, _ in found])
    order = np.diff(np.log(np.abs(errors))) / np.diff(np.log([away for _, away in found]))
    rates = sorted(abs(np.linalg.eigvals([[0.0, 1.0], [2.0, exact + 1.0]])))
    assert order == pytest.approx(np.full(2, 2.0 + rates[0] / rates[1]), abs=0.06)


def test_linearised_equations_are_derivatives(field, near):
    problem, u, _ = homoclinic_curve(field, near, "m", {}, None)
    rng = np.random.default_rng(5)
    for _ in range(3):
        direction, row = rng.normal(size=(2, len(u)))
        step = 1e-6
        up, down = (problem.linearise(u + sign * step * direction).residual
                    for sign in (1.0, -1.0))
        side = np.append((up - down) / (2.0 * step), row @ direction)
        assert problem.linearise(u).solve(row, side) == pytest.approx(direction, abs=1e-7)


def test_orbits_of_any_method_start_the_curve(field, near):
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=HarmonicBalance(harmonics=40), bounds=(-2.0, 2.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    curve = codim2_curve(field, orbits.points[-1], "m", to="homoclinic",
                         options=ContinuationOptions(points=2), bounds=BOX)
    c = curve.points[0].values["c"], codim2_curve(
        field, near, "m", to="homoclinic", options=ContinuationOptions(points=2),
        bounds=BOX).points[0].values["c"]
    assert c[0] == pytest.approx(homoclinic(-1.0), abs=2e-8)
    assert c[1] == pytest.approx(homoclinic(-1.0), abs=2e-8)


def test_points_of_the_curve_start_it_again(field, curve):
    point = curve.points[len(curve) // 2]
    values = point.orbit(field).parameter_values
    assert dict(zip(field.parameters, values, strict=True)) == pytest.approx(
        {"m": point.values["m"], "c": point.values["c"]}, rel=1e-12)
    again = codim2_curve(field, point, "m", to="homoclinic", bounds=BOX,
                         options=ContinuationOptions(points=2))
    assert again.points[0].is_homoclinic
    assert again.points[0].values["c"] == pytest.approx(point.values["c"], abs=1e-7)


def leaf(t, x, p, out):
    # Sandstede's model: for mu = tilde = 0 an orbit on x^2 (1 - x) = y^2, z = 0.
    a, b, c, alpha, beta, gamma, mu, tilde = p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]
    k = tilde - alpha * x[2]
    out[0] = a * x[0] + b * x[1] - a * x[0] * x[0] + k * x[0] * (2.0 - 3.0 * x[0])
    out[1] = (b * x[0] + a * x[1] - 1.5 * b * x[0] * x[0] - 1.5 * a * x[0] * x[1]
              - 2.0 * k * x[1])
    out[2] = (c * x[2] + mu * x[0] + gamma * x[0] * x[2]
              + alpha * beta * (x[0] * x[0] * (1.0 - x[0]) - x[1] * x[1]))


@pytest.fixture(scope="module")
def sandstede():
    field = vector_field(leaf, {"a": 0.25, "b": 1.0, "c": -2.0, "alpha": 0.0, "beta": 1.0,
                                "gamma": 0.0, "mu": 0.0, "tilde": -0.3}, 3)
    hopf, = equilibrium_branch(field, [0.6, 0.1, 0.0], "tilde", bounds=(-1.0, 1.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-1.0, 1.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    return field, orbits.points[-1]


def test_sandstedes_model(sandstede, tmp_path):
    """tilde = 0 for all a and alpha; the saddle has the eigenvalues a + b, a - b and c.

    AUTO-07p prints 9e-9 for tilde at a = 0.74.
    """
    field, near = sandstede
    box = {"tilde": (-1.0, 1.0), "a": (-0.9, 0.9), "alpha": (-1.0, 1.0), "mu": (-1.0, 1.0)}

    def over(name, start, **how):
        return codim2_curve(field, start, name, bounds={key: box[key] for key in ("tilde", name)},
                            **how)

    curve = over("a", near, to="homoclinic")
    assert np.abs(curve.parameter).max() < 2e-9
    a = curve.column("a")
    assert np.sort(a)[[0, -1]] == pytest.approx([-0.9, 0.9], rel=1e-12)
    eigenvalues = np.sort(curve.column("eigenvalues").real, axis=1)[:, ::-1]
    assert eigenvalues == pytest.approx(np.stack([a + 1.0, a - 1.0, np.full(len(a), -2.0)],
                                                 axis=1), abs=1e-7)
    point, = curve.special
    assert point.kind == "neutral saddle"
    assert point.values["a"] == pytest.approx(0.0, abs=1e-9)
    # With z, at mu = 0 too; from a file and on, also over another parameter.
    bent = read_branch(write_branch(tmp_path / "curve.h5", over("alpha", near, to="homoclinic")))
    assert np.abs(bent.parameter).max() < 2e-9
    moved = over("mu", bent.points[-1])
    assert np.sort(moved.column("mu"))[[0, -1]] == pytest.approx([-1.0, 1.0], rel=1e-12)
    at_zero = np.interp(0.0, moved.column("mu"), moved.parameter)
    assert at_zero == pytest.approx(0.0, abs=1e-2)
    assert moved.points[0].parameter * moved.points[-1].parameter < 0.0
    motion = curve.points[0].orbit()
    x, y, z = motion.states.T
    assert x * x * (1.0 - x) - y * y == pytest.approx(np.zeros(len(x)), abs=1e-6)
    assert x.max() == pytest.approx(1.0, abs=1e-4)
    assert np.abs(z).max() < 1e-8
    assert motion.times[-1] == curve.points[0].values["time"]


def tilted(t, x, p, out):
    # ``leaf`` with a part of z along the orbit.
    k = p[2] - 0.3 * x[2]
    out[0] = p[0] * x[0] + p[1] * x[1] - p[0] * x[0] * x[0] + k * x[0] * (2.0 - 3.0 * x[0])
    out[1] = (p[1] * x[0] + p[0] * x[1] - 1.5 * p[1] * x[0] * x[0] - 1.5 * p[0] * x[0] * x[1]
              - 2.0 * k * x[1])
    out[2] = -2.0 * x[2] + 0.5 * (x[0] * x[0] * (1.0 - x[0]) - x[1] * x[1])


def test_a_parameter_that_is_constant_along_the_curve_does_not_turn():
    """tilde = 0 for all b; rounding moves it by 1e-9 to and fro."""
    field = vector_field(tilted, {"a": -0.4, "b": 1.0, "tilde": -0.05}, 3)
    rest = equilibrium_branch(field, [2.0 / 3.0, 0.0, 0.0], "tilde", bounds=(-1.0, 1.0))
    orbits = orbit_branch(field, rest.of_kind("Hopf")[0], method=Collocation(intervals=50),
                          bounds=(-1.0, 1.0))
    curve = codim2_curve(field, orbits.points[-1], "b", to="homoclinic",
                         bounds={"tilde": (-1.0, 1.0), "b": (0.5, 2.0)})
    assert np.abs(curve.parameter).max() < 1e-8
    assert not curve.of_kind("turning point")


def koper(t, x, p, out):
    # Koper's van der Pol oscillator of three variables.
    out[0] = 10.0 * (p[1] * x[1] - x[0] * x[0] * x[0] + 3.0 * x[0] - p[0])
    out[1] = x[0] - 2.0 * x[1] + x[2]
    out[2] = x[1] - x[2]


def test_value_of_auto():
    """AUTO-07p's manual (demo kpr) prints lambda = -1.851185 at k = -0.15."""
    field = vector_field(koper, {"lam": -1.0, "k": -0.15}, 3)
    rests = equilibrium_branch(field, [1.8, 1.8, 1.8], "lam", bounds=(-6.0, 6.0), both=True)
    hopf = min(rests.of_kind("Hopf"), key=lambda at: at.parameter)
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=80), bounds=(-6.0, 6.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    curve = codim2_curve(field, orbits.points[-1], "k", to="homoclinic", both=False,
                         options=ContinuationOptions(points=10),
                         bounds={"lam": (-3.0, 0.0), "k": (-0.3, 0.0)})
    assert curve.points[0].values["k"] == pytest.approx(-0.15, rel=1e-12)
    assert curve.points[0].values["lam"] == pytest.approx(-1.851185, abs=6e-7)
    assert curve.column("truncation_error").max() < 1e-8


def well(t, x, p, out):
    # x'' = x - x^2 + a x' + b x x'
    out[0] = x[1]
    out[1] = x[0] - x[0] * x[0] + p[0] * x[1] + p[1] * x[0] * x[1]


def test_melnikovs_function():
    """a = -(6/7) b + O(b^3); the orbit at a = b = 0 is x = (3/2) / cosh(t / 2)^2, and neutral."""
    field = vector_field(well, {"a": -1.0, "b": 0.5}, 2)
    hopf, = equilibrium_branch(field, [1.0, 0.0], "a", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-2.0, 2.0))
    curve = codim2_curve(field, orbits.points[-1], "b", to="homoclinic",
                         bounds={"a": (-1.0, 1.0), "b": (-1.0, 1.0)})
    point, = curve.of_kind("neutral saddle")
    assert [point.values["a"], point.values["b"]] == pytest.approx([0.0, 0.0], abs=1e-8)
    motion = point.orbit(samples=2001)
    x, speed = motion.states.T
    top = np.flatnonzero((speed[:-1] > 0.0) & (speed[1:] <= 0.0) & (x[:-1] > 1.0))[0]
    t = motion.times - np.interp(0.0, -speed[top : top + 2], motion.times[top : top + 2])
    assert x == pytest.approx(1.5 / np.cosh(t / 2.0) ** 2, abs=2e-5)
    a, b = curve.parameter, curve.column("b")
    some = np.abs(b) > 0.05
    tends, bend = polyfit(b[some] ** 2, (a / b)[some], 4)[:2]
    assert tends == pytest.approx(-6.0 / 7.0, abs=1e-6)
    assert abs(bend) > 1e-4


DELTA = 0.5


def dragged(t, x, p, out):
    # x'' = x - x^2 + a x', and z that comes to rest more slowly than x.
    out[0] = x[1]
    out[1] = x[0] - x[0] * x[0] + p[0] * x[1]
    out[2] = -0.5 * x[2] + p[1] * x[0] * x[0] - x[0] * x[0] * x[0]


def dragged_back(t, x, p, out):
    # The same, time reversed.
    out[0] = -x[1]
    out[1] = -x[0] + x[0] * x[0] - p[0] * x[1]
    out[2] = 0.5 * x[2] - p[1] * x[0] * x[0] + x[0] * x[0] * x[0]


def spiral(t, x, p, out):
    # The leading eigenvalues are -1/2 +- sqrt(q): real ones become a pair at q = 0.
    out[0] = x[1]
    out[1] = x[0] - x[0] * x[0] + p[0] * x[1]
    out[2] = -0.5 * x[2] + x[3]
    out[3] = -0.5 * x[3] + p[1] * x[2]


def spiral_back(t, x, p, out):
    out[0] = -x[1]
    out[1] = -x[0] + x[0] * x[0] - p[0] * x[1]
    out[2] = 0.5 * x[2] - x[3]
    out[3] = 0.5 * x[3] - p[1] * x[2]


def pushed(t, x, p, out):
    # z, which is zero, would push x: int exp(-t / 2) (q x - x^2) x' dt = 0 turns the manifold over.
    out[0] = x[1]
    out[1] = x[0] - x[0] * x[0] + p[0] * x[1] + (p[1] * x[0] - x[0] * x[0]) * x[2]
    out[2] = -0.5 * x[2]


def pushed_back(t, x, p, out):
    out[0] = -x[1]
    out[1] = -x[0] + x[0] * x[0] - p[0] * x[1] - (p[1] * x[0] - x[0] * x[0]) * x[2]
    out[2] = 0.5 * x[2]


@pytest.mark.parametrize(("function", "q", "states", "kind", "at"), [
    (pushed, 0.3, 3, "stable inclination flip", (16.0 - 4.0 * DELTA**2) / 20.0),
    (pushed_back, 0.3, 3, "unstable inclination flip", (16.0 - 4.0 * DELTA**2) / 20.0),
    (dragged, 0.9, 3, "stable orbit flip", 1.5 * (16.0 - 4.0 * DELTA**2) / 20.0),
    (dragged_back, 0.9, 3, "unstable orbit flip", 1.5 * (16.0 - 4.0 * DELTA**2) / 20.0),
    (spiral, 0.1, 4, "stable double eigenvalue", 0.0),
    (spiral_back, 0.1, 4, "unstable double eigenvalue", 0.0)])
def test_special_points_of_the_curve(function, q, states, kind, at):
    """The homoclinic orbit is that at a = 0, with x = (3/2) / cosh(t / 2)^2, for all q.

    z comes back along the slow direction but for int exp(t / 2) (q x^2 - x^3) dt = 0.
    """
    field = vector_field(function, {"a": -0.5, "q": q}, states)
    z = 2.0 * (q - 1.0) if "dragged" in function.__name__ else 0.0
    begin = np.array([1.0, 0.0, z, 0.0])[:states]
    hopf = equilibrium_branch(field, begin, "a", bounds=(-0.5, 0.5)).of_kind("Hopf")[0]
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-0.5, 0.5))
    assert orbits.status is BranchStatus.HOMOCLINIC
    curve = codim2_curve(field, orbits.points[-1], "q", to="homoclinic",
                         bounds={"a": (-0.5, 0.5), "q": (-0.3, 0.2 if states == 4 else 1.5)})
    assert np.abs(curve.parameter).max() < 1e-7
    point, = curve.special
    assert point.kind == kind
    assert point.values["q"] == pytest.approx(at, abs=2e-4)


def test_a_parameter_that_is_zero_at_the_orbit():
    """The width of the branch counts where no bounds give one, not the value of the parameter."""
    field = vector_field(dragged, {"a": -0.5, "q": 0.9}, 3)
    hopf = equilibrium_branch(field, [1.0, 0.0, -0.2], "a", bounds=(-0.5, 0.5)).of_kind("Hopf")[0]
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-0.5, 0.5))
    curve = codim2_curve(field, orbits.points[-1], "q", to="homoclinic",
                         options=ContinuationOptions(points=4))
    assert len(curve) >= 4
    assert np.abs(curve.parameter).max() < 1e-7


@pytest.mark.parametrize(("function", "states"), [(spiral, 4), (pushed, 3)])
def test_orbits_that_come_back_faster_than_the_leading_eigenvalue_says(function, states):
    """They have no part along its direction; that at a = 0 is found from any of long period."""
    field = vector_field(function, {"a": -0.5, "q": 0.1 if states == 4 else 0.3}, states)
    begin = np.array([1.0, 0.0, 0.0, 0.0])[:states]
    hopf = equilibrium_branch(field, begin, "a", bounds=(-0.5, 0.5)).of_kind("Hopf")[0]
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(-0.5, 0.5))
    long = [point for point in orbits.points if point.values["period"] > 10.0]
    assert len(long) > 20
    for point in long[::6]:
        problem, u, _ = homoclinic_curve(field, point, "q", {}, None)
        assert abs(u[-1]) < 1e-9
        assert problem.amplitude(u) == pytest.approx(1.5, rel=1e-4)


def pendulum(t, x, p, out):
    # phi'' + a phi' + sin(phi) = I on the circle x = cos(phi), y = sin(phi).
    growth = 1.0 - x[0] * x[0] - x[1] * x[1]
    out[0] = growth * x[0] - x[2] * x[1]
    out[1] = growth * x[1] + x[2] * x[0]
    out[2] = p[0] - p[1] * x[2] - x[1]


def left_over(a, drive):
    """Speed with which the pendulum leaves the saddle a turn before it comes back to it, squared.

    Back in time along the stable direction; negative where it turns before.
    """
    from scipy.integrate import solve_ivp

    saddle = np.pi - np.arcsin(drive)
    slope = -(a + np.sqrt(a * a - 4.0 * np.cos(saddle))) / 2.0
    run = solve_ivp(lambda phi, half: [drive - np.sin(phi) - a * np.sqrt(2.0 * max(half[0], 0.0))],
                    (saddle - 1e-5, saddle - 2.0 * np.pi), [0.5 * (slope * 1e-5) ** 2],
                    method="DOP853", rtol=1e-11, atol=1e-14)
    return run.y[0, -1]


@pytest.mark.slow
def test_rotations_of_a_pendulum():
    """I = (4 / pi) a + O(a^3), up to where the saddle meets the equilibrium below, I = 1."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    def rates(t, x):
        out = np.zeros(3)
        pendulum(t, x, [0.9, 0.3], out)
        return out

    field = vector_field(pendulum, {"I": 0.9, "a": 0.3}, 3)
    run = solve_ivp(rates, (0.0, 100.0), [1.0, 0.0, 3.0], rtol=1e-9, atol=1e-11,
                    t_eval=np.linspace(80.0, 100.0, 8000))
    orbits = orbit_branch(field, (run.t, run.y.T), "I", method=Collocation(intervals=60),
                          direction=-1.0, bounds=(0.0, 1.2))
    assert orbits.status is BranchStatus.HOMOCLINIC
    curve = codim2_curve(field, orbits.points[-1], "a", to="homoclinic",
                         bounds={"I": (0.0, 1.2), "a": (0.0, 2.0)})
    assert curve.status is BranchStatus.SADDLE_NODE
    drive, a = curve.parameter, curve.column("a")
    some = (a > 0.01) & (a < 0.5)
    small, ratio = a[some], drive[some] / a[some]
    assert polyfit(small**2, ratio, 3)[0] == pytest.approx(4.0 / np.pi, abs=1e-6)
    near = int(np.argmin(np.abs(a - 0.5)))
    assert drive[near] == pytest.approx(
        brentq(lambda value: left_over(a[near], value), 0.5, 0.7, xtol=1e-12), abs=1e-7)
    # The end, from the strong stable direction of the saddle-node.
    end = brentq(lambda value: left_over(value, 1.0), 1.0, 1.4, xtol=1e-10)
    assert a[-1] == pytest.approx(end, abs=1e-3)
    assert drive[-1] == pytest.approx(1.0, abs=1e-5)


def test_kind_errors(field, near, curve):
    rest = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0))
    with pytest.raises(InputError, match="no curve to = 'homoclinic' begins there"):
        codim2_curve(field, rest.points[0], "m", to="homoclinic")
    hopf, = rest.of_kind("Hopf")
    small = orbit_branch(field, hopf, options=ContinuationOptions(points=5), bounds=(-2.0, 2.0))
    with pytest.raises(InputError, match=r"passes no equilibrium, as orbits beside a homoclinic"):
        codim2_curve(field, small.points[-1], "m", to="homoclinic")
    with pytest.raises(InputError, match="to must be a text"):
        codim2_curve(field, near, "m", to=3)
    with pytest.raises(InputError, match="is no orbit, whose period keep='period' could keep"):
        codim2_curve(field, curve.points[0], "m", keep="period")
