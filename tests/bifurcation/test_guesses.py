"""Guesses of the next orbit from the last two, and what is saved where they are near enough."""

import numpy as np
import pytest

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.continuation.predictor import Trail
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.curves.codim2 import OrbitCurve
from fecontact.bifurcation.orbits.mesh import extremes, node_times, rule


def stuart_landau(t, x, p, out):
    s = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - s) * x[0] - p[1] * x[1]
    out[1] = p[1] * x[0] + (p[0] - s) * x[1]


MESH = np.linspace(0.0, 1.0, 31)
TIMES = 2.0 * np.pi * node_times(MESH, 4)
CIRCLE = np.stack([np.cos(TIMES), np.sin(TIMES)], axis=1).reshape(-1)


def orbit(radius):
    """The orbits are circles of radius sqrt(r)."""
    return np.concatenate([radius * CIRCLE, [np.pi, 2.0, radius**2]])


def tangent(radius):
    return np.concatenate([CIRCLE, [0.0, 0.0, 2.0 * radius]]) / np.sqrt(1.0 + 4.0 * radius**2)


def followed(step, last=0.7):
    """The problem behind four orbits whose radii differ by a step."""
    field = vector_field(stuart_landau, {"r": 0.5, "w": 2.0}, 2)
    problem = CollocationProblem(field, field.values, 0, MESH, 4, CIRCLE.reshape(-1, 2),
                                 np.ones(5), renewal=0, second=1, predictor=Trail())
    for k in (3, 2, 1, 0):
        radius = last - k * step
        problem, _, _ = problem.adapted(orbit(radius), tangent(radius))
    return problem


def missed(problem, guess, radius):
    """Distance of a guess from the orbit at right angles to the tangent at a radius."""
    row = problem.weights() * tangent(radius)
    low, high = radius, radius + 0.5
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if row @ (orbit(middle) - guess) < 0.0 else (low, middle)
    return float(np.sqrt(problem.weights() @ (guess - orbit(low)) ** 2))


def test_guess_by_two_points_is_of_fourth_order_and_tells_how_far_it_is_off():
    errors = []
    for step in (0.04, 0.02):
        problem = followed(step)
        length = step * np.sqrt(1.0 + 4.0 * 0.7**2)
        guess = problem.predicted(orbit(0.7), tangent(0.7), length)
        errors.append(missed(problem, guess, 0.7))
        assert problem.predictor.off(length) == pytest.approx(errors[-1], rel=0.4)
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_guess_lies_on_the_plane_of_the_step():
    problem = followed(0.05)
    guess = problem.predicted(orbit(0.7), tangent(0.7), 0.08)
    along = problem.weights() * tangent(0.7) @ (guess - orbit(0.7))
    assert along == pytest.approx(0.08, rel=1e-12)
    assert np.linalg.norm(guess - orbit(0.7) - 0.08 * tangent(0.7)) > 1e-4


def test_what_was_off_of_late_counts():
    """An orbit that lies beside the others spoils the next guesses."""
    problem = followed(0.04)
    beside = orbit(0.74)
    beside[:-3] += 1e-3 * np.roll(CIRCLE, 2)
    spoilt, _, _ = problem.adapted(beside, tangent(0.74))
    assert problem.predictor.off(0.01) < 1e-5
    assert spoilt.predictor.off(0.01) > 5e-4


def test_peaks_between_the_ends_of_an_interval_and_its_next_point():
    for shift in np.linspace(0.0, 2.0 * np.pi / 30.0, 101):
        turned = np.stack([np.cos(TIMES - shift), np.sin(TIMES - shift)], axis=1)
        low, high = extremes(turned, 4)
        assert np.abs(high - 1.0).max() < 1e-7
        assert np.abs(low + 1.0).max() < 1e-7
    assert len(rule(4).fine) == 33


def torus(t, x, p, out):
    # A circle of radius one; across it w' = (lam - a^2 + 0.7 i) w - w |w|^2, w = r - 1 + i z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] * p[1] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def test_a_point_of_a_curve_takes_one_step_where_the_guess_is_near(monkeypatch):
    """The point is as accurate: lam = a^2."""
    calls = {"linearise": [], "evaluate": []}
    for name, told in calls.items():
        made = getattr(OrbitCurve, name)
        monkeypatch.setattr(OrbitCurve, name, lambda self, u, made=made, told=told: told.append(
            1) or made(self, u))
    field = vector_field(torus, {"lam": -0.2, "a": 0.3}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=30), bounds=(-0.5, 0.5), scales=np.ones(3),
                          options=ContinuationOptions(step=0.02))
    curve = codim2_curve(
        field, branch.of_kind("Neimark-Sacker")[0], "a", both=False, direction=1.0,
        bounds={"lam": (-0.1, 0.8), "a": (-0.5, 0.9)},
        options=ContinuationOptions(step=0.002, largest_step=0.01, points=50))
    assert len(curve) == 50
    assert np.abs(curve.parameter - curve.column("a") ** 2).max() < 1e-9
    assert len(calls["linearise"]) < 1.15 * len(curve)
    assert len(calls["evaluate"]) < 0.45 * len(curve)
