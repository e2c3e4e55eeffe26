"""Test functions of curves of orbits and their derivatives, against multipliers and differences."""

import numpy as np
import pytest
from test_orbit_curves import circle_field, cusp, doubling, sheared, torus

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.orbits.curves.codim2 import orbit_curve


def duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = -x[0] - x[0] ** 3 - 0.1 * x[1] + p[1] * np.cos(p[0] * t)


def driven():
    """Resonance of a Duffing oscillator over the frequency, which changes the period too."""
    field = vector_field(duffing, {"w": 0.8, "F": 0.3}, 2,
                         period=lambda p: 2.0 * np.pi / p["w"])
    from scipy.integrate import solve_ivp

    period = 2.0 * np.pi / 0.8
    run = solve_ivp(lambda t, x: field.rates(np.array([t]), x[None], field.values)[0],
                    (0.0, 60.0 * period), [1.0, 0.0], rtol=1e-9, atol=1e-11,
                    t_eval=np.linspace(58.0 * period, 60.0 * period, 801))
    return field, orbit_branch(field, PeriodicMotion(run.t, run.y.T, period=period), "w",
                               method=Collocation(intervals=20), bounds=(0.7, 2.2),
                               options=ContinuationOptions(largest_step=0.03))


def on_circle(function, start, bounds, states=3, radius=1.0, **parameters):
    field, t, circle = circle_field(function, states, **parameters)
    return field, orbit_branch(
        field, PeriodicMotion(t, radius * circle[:, :states], period=np.pi), start,
        method=Collocation(intervals=12), direction=-1.0 if states == 2 else 1.0, bounds=bounds,
        scales=np.ones(states))


def start_of_curve(case):
    """Problem and unknowns at the start of a curve."""
    kind, second = "period doubling", "k"
    if case == "doubling":
        field, branch = on_circle(doubling, "lam", (-0.5, 0.5), lam=-0.4, k=-0.5)
    elif case == "torus":
        field, branch = on_circle(torus, "lam", (-0.5, 0.5), lam=-0.2, a=0.3)
        kind, second = "Neimark-Sacker", "a"
    elif case == "driven":
        field, branch = driven()
        kind, second = "fold", "F"
    else:
        radius = 1.0 + np.roots([1.0, 0.0, -0.3, -0.2]).real.max()
        field, branch = on_circle(cusp, "p", (-0.3, 0.3), states=2, radius=radius, p=0.2, q=0.3)
        kind, second = "fold", "q"
    problem, u, _ = orbit_curve(field, branch.of_kind(kind)[0], second, {}, None, kind)
    return problem, u


def other_test(problem, u, direction):
    """A function of the multipliers, or of the tangent, that is zero on the curve."""
    orbit = problem.orbit.linearise(u)
    if problem.kind != "fold":
        minus, _, pairs = orbit.floquet.products()
        return minus if problem.kind == "period doubling" else pairs
    # The parameter's component in the tangent at a fixed second parameter.
    side = np.eye(len(u))[-2]
    return orbit.with_rows([problem.weights() * direction, side]).solve(side)[-1]


@pytest.mark.parametrize("case", ["doubling", "torus", "driven", "cusp"])
def test_derivatives_are_those_of_another_function_with_the_same_zeros(case):
    """At the zero their derivatives are proportional along all directions."""
    problem, u = start_of_curve(case)
    at = problem.linearise(u)
    v = at.singularity.v
    direction = None if v is None else v / (problem.weights() @ v**2)
    assert abs(at.residual[-1]) < 1e-6
    rng, d = np.random.default_rng(3), problem.orbit.field.dimension
    times = np.linspace(0.0, 2.0 * np.pi, problem.orbit.size // d, endpoint=False)
    directions = []
    for place in range(5):
        along = np.zeros(len(u))
        shape = np.cos((1 + place) * times[:, None] + rng.random(d)) * rng.standard_normal(d)
        along[: problem.orbit.size] = 0.1 * shape.ravel()
        directions.append(along)
    directions += [*np.eye(problem.orbit.common, len(u), problem.orbit.size)]
    mine = np.array([at.gradient @ along for along in directions])
    h = 1e-4

    def beside(along, h):
        return other_test(problem, u + h * along, direction)

    other = np.array([(8.0 * (beside(along, h) - beside(along, -h))
                       - beside(along, 2.0 * h) + beside(along, -2.0 * h)) / (12.0 * h)
                      for along in directions])
    scale = (mine @ other) / (mine @ mine)
    assert np.abs(mine).max() > 0.0
    assert other == pytest.approx(scale * mine, abs=2e-6 * np.abs(other).max())


def test_derivative_for_two_real_multipliers():
    """A neutral saddle, whose multipliers exp(+- pi sqrt(0.1)) have the product one."""
    field, branch = on_circle(sheared, "growth", (-0.3, 0.3), growth=-0.2, shear=0.1)
    point, = branch.of_kind("Neimark-Sacker")
    problem, u, _ = orbit_curve(field, point, "shear", {}, None, "Neimark-Sacker")
    u[-2:] = -0.1, 0.0
    at = problem.linearise(u)
    assert at.residual[-1] == pytest.approx(0.0, abs=1e-8)
    # The product is exp(2 pi growth).
    assert at.gradient[-2:] == pytest.approx([0.0, 2.0 * np.pi], abs=1e-6)
    assert np.abs(at.orbit.floquet.others.imag).max() < 1e-12


def test_folds_of_a_driven_oscillator_over_frequency_and_force():
    """The folds meet in a cusp, close to that of one harmonic.

    Its amplitude a satisfies a^2 ((3 a^2 / 4 - s)^2 + d^2) = F^2 with s = w^2 - 1, d = w / 10: a
    triple root in a^2 at s = sqrt(3) d, F^2 = 32 sqrt(3) d^3 / 27.
    """
    field, branch = driven()
    first, second = branch.of_kind("fold")
    curve = codim2_curve(field, first, "F", bounds={"w": (0.7, 2.2), "F": (0.02, 0.5)},
                         options=ContinuationOptions(largest_step=0.03))
    found, = curve.of_kind("cusp")
    w = (np.sqrt(3.0) / 10.0 + np.sqrt(4.03)) / 2.0
    assert found.parameter == pytest.approx(w, rel=2e-3)
    assert found.values["F"] == pytest.approx(np.sqrt(32.0 * np.sqrt(3.0) / 27.0 * (w / 10.0) ** 3),
                                              rel=6e-3)
    # Both folds of the branch lie on the curve.
    F, k = curve.column("F"), curve.points.index(found)
    for part in (slice(k), slice(k + 1, None)):
        order = np.argsort(F[part])
        beside = np.interp(0.3, F[part][order], curve.parameter[part][order])
        assert min(abs(beside - first.parameter), abs(beside - second.parameter)) < 2e-3
