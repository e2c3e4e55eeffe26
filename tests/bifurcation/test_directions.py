"""Directions and signs at special points do not change with inputs by a relative 1e-15."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fecontact as fc
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.codim2_nearby import _across
from fecontact.bifurcation.events.branches import nothing_left
from fecontact.bifurcation.events.conditions import Condition
from fecontact.bifurcation.orbits.floquet import by_falling_modulus

RNG = np.random.default_rng(1)
# In the last case two components of the critical direction have the same size.
ANGLES = (0.3, -0.3, 2.0, -np.pi / 4.0)


def turned(t, x, p, out):
    """u' = p u - k u^3 - m u^2 (fork, or transcritical) and v' = u^2 - v, turned by an angle."""
    c, s = np.cos(p[3]), np.sin(p[3])
    u, v = c * x[0] + s * x[1], c * x[1] - s * x[0]
    du, dv = p[0] * u - p[1] * u * u * u - p[2] * u * u, u * u - v
    out[0], out[1] = c * du - s * dv, s * du + c * dv


def bent(t, x, p, out):
    """u' = p - u^2 and v' = u^2 - v, turned by an angle."""
    c, s = np.cos(p[1]), np.sin(p[1])
    u, v = c * x[0] + s * x[1], c * x[1] - s * x[0]
    du, dv = p[0] - u * u, u * u - v
    out[0], out[1] = c * du - s * dv, s * du + c * dv


def sign_of_larger(vector):
    """Sign of the component that is larger by more than rounding, the first one of equal ones."""
    return np.sign(vector[1] if abs(vector[1]) > abs(vector[0]) + 1e-9 else vector[0])


def perturbed(count=12):
    return [1.0, *(1.0 + 1e-15 * RNG.normal(size=count))]


@pytest.mark.parametrize("angle", ANGLES)
def test_the_other_branch_at_a_fork_leaves_along_its_largest_component(angle):
    field = vector_field(turned, {"p": -0.5, "k": 1.0, "m": 0.0, "angle": angle}, 2)
    unit = np.array([np.cos(angle), np.sin(angle)])
    for factor in perturbed():
        branch = equilibrium_branch(field.with_(angle=factor * angle), [0.0, 0.0], "p",
                                    bounds=(-0.5, 0.5))
        point, = branch.of_kind("branch point")
        assert point.form == "fork"
        assert point.null_vector == pytest.approx(sign_of_larger(unit) * unit, abs=1e-6)
        other = point.other_tangent
        assert other[:2] / np.linalg.norm(other[:2]) == pytest.approx(
            sign_of_larger(unit) * unit, abs=1e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_other_branch_at_a_transcritical_point_leaves_towards_larger_parameters(angle):
    field = vector_field(turned, {"p": -0.5, "k": 0.0, "m": 1.0, "angle": angle}, 2)
    signs = set()
    for factor in perturbed():
        branch = equilibrium_branch(field.with_(angle=factor * angle), [0.0, 0.0], "p",
                                    bounds=(-0.5, 0.5))
        point, = branch.of_kind("branch point")
        assert point.other_tangent[-1] > 0.0
        signs.add(np.sign(point.coefficient))
    # y' = p y + c y^2 with y along the null vector, whose larger component is positive.
    assert signs == {-sign_of_larger([np.cos(angle), np.sin(angle)])}


@pytest.mark.parametrize("angle", ANGLES)
def test_the_sign_of_a_fold_is_that_of_its_largest_component(angle):
    field = vector_field(bent, {"p": 0.5, "angle": angle}, 2)
    sign = sign_of_larger([np.cos(angle), np.sin(angle)])
    u, v = np.sqrt(0.5), 0.5
    start = [np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v]
    for factor in perturbed():
        branch = equilibrium_branch(field.with_(angle=factor * angle), start, "p",
                                    bounds=(-0.5, 0.6), direction=-1.0)
        fold, = branch.of_kind("fold")
        assert fold.null_vector @ [np.cos(angle), np.sin(angle)] == pytest.approx(sign, abs=1e-6)
        assert fold.coefficient == pytest.approx(-sign, rel=1e-6)


def circles(t, x, p, out):
    """r' = p r - r^3, z' = -z: components of the eigenvector have the same size."""
    square = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - square) * x[0] - p[1] * x[1]
    out[1] = p[1] * x[0] + (p[0] - square) * x[1]


def test_the_phase_of_an_eigenvector_is_that_of_its_first_component():
    field = vector_field(circles, {"p": -0.3, "w": 2.0}, 2)
    for factor in perturbed():
        branch = equilibrium_branch(field.with_(w=2.0 * factor), [0.0, 0.0], "p",
                                    bounds=(-0.3, 0.3))
        hopf, = branch.of_kind("Hopf")
        assert hopf.eigenvector == pytest.approx(np.array([1.0, -1j]) / np.sqrt(2.0), abs=1e-9)


def fork(t, x, p, out):
    """A circle of radius one, which becomes two of z = +- sqrt(p) for p > 0."""
    rise = 1.0 - x[0] * x[0] - x[1] * x[1]
    out[0] = rise * x[0] - 2.0 * x[1]
    out[1] = rise * x[1] + 2.0 * x[0]
    out[2] = (p[0] - x[2] * x[2]) * x[2]


@pytest.mark.parametrize("method", [Collocation(intervals=12), HarmonicBalance(3)])
def test_orbits_at_a_fork_leave_to_the_same_side(method):
    field = vector_field(fork, {"p": -0.4}, ["x", "y", "z"])
    run = fc.simulate(field, 10.0, initial=[1.0, 0.0, 0.0], outputs=2001)
    flat = orbit_branch(field, run, "p", bounds=(-0.5, 0.5), scales=np.ones(3), method=method)
    point, = flat.of_kind("branch point")
    options = ContinuationOptions(points=2)
    for factor in perturbed(6):
        moved = replace(point, u=point.u * factor, tangent=point.tangent / factor)
        for direction in (1.0, -1.0):
            half = orbit_branch(field, moved, options=options, bounds=(-0.5, 0.5),
                                direction=direction)
            z = half.column("maximum")[-1, 2]
            assert direction * z > 1e-3


def test_the_order_of_multipliers_is_that_of_moduli_and_signs():
    pair, other = 0.7 * np.exp(0.4j), 0.2 * np.exp(2.0j)
    wanted = np.array([1.5, pair, pair.conjugate(), -0.5, other, other.conjugate(), 0.0])
    for _ in range(50):
        given = RNG.permutation(wanted * (1.0 + 1e-15 * RNG.normal(size=len(wanted))))
        assert by_falling_modulus(given) == pytest.approx(wanted, rel=1e-13)
    assert len(by_falling_modulus(wanted[:0])) == 0


def test_a_curve_along_the_diagonal_is_crossed_over_the_first_parameter():
    for factor in perturbed():
        tangent = np.array([0.0, factor, -1.0])
        assert _across(tangent, "first", "second", {"first": 1.0, "second": 1.0}) == "first"
    assert _across(np.array([0.0, 0.5, 1.0]), "a", "b", {"a": 1.0, "b": 1.0}) == "b"
    assert _across(np.array([0.0, 1.0, 0.5]), "a", "b", {"a": 1.0, "b": 1.0}) == "a"


def test_conditions_of_a_symmetric_orbit_are_looked_at_in_their_order():
    first, second = Condition(1e-13, 2, 0, 1), Condition(-1e-13, 2, 1, 1)
    for factor in perturbed():
        for left in ((1e-13 * factor, -3e-14), (3e-14, 1e-13 * factor)):
            given = [condition._replace(left=value)
                     for condition, value in zip((first, second), left, strict=True)]
            problem = SimpleNamespace(linearise=lambda u, given=given: SimpleNamespace(
                conditions=given))
            assert nothing_left(problem, None) == given
    # The third one has a remainder above rounding.
    rest = Condition(2e-6, 2, 0, 0)
    problem = SimpleNamespace(linearise=lambda u: SimpleNamespace(conditions=[rest, first]))
    assert nothing_left(problem, None) == [first, rest]
