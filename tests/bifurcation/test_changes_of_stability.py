"""Along a branch the number of unstable directions changes at special points, and only there."""

import numpy as np
import pytest
from collocation_fields import two_masses_field
from scipy.optimize import brentq
from systems import (
    belt,
    lorenz_field,
    mode_coupling,
    two_mass_field,
    two_mass_jacobian,
)
from test_continuation import CUBIC

from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.plot import plot_eigenvalues

CHANGES = {"fold": {-1, 1}, "branch point": {-1, 0, 1}, "period doubling": {-1, 1},
           "Hopf": {-2, 2}, "Neimark-Sacker": {-2, 2}}


def assert_explained(branch, unresolved=0):
    """Each change of 'unstable' between regular points is that of the special points in between."""
    reached = None
    for point in branch.points:
        if point.kind == "unresolved":
            reached = {point.unstable_after}
        elif point.kind is not None:
            reached = {count + change for count in reached for change in CHANGES[point.kind]}
        else:
            count = point.values["unstable"]
            assert reached is None or count in reached, point.parameter
            assert point.values["stable"] == (count == 0)
            reached = {count}
    assert len(branch.of_kind("unresolved")) == unresolved


def twice(t, x, p, out):
    # The same oscillator two times: two pairs cross the axis at the same p.
    for k in (0, 2):
        square = x[k] * x[k] + x[k + 1] * x[k + 1]
        out[k] = (p[0] - square) * x[k] - x[k + 1]
        out[k + 1] = x[k] + (p[0] - square) * x[k + 1]


def reactor(t, x, p, out):
    out[0] = -x[0] + p[0] * (1.0 - x[0]) * np.exp(x[1])
    out[1] = -x[1] + p[0] * 17.0 * (1.0 - x[0]) * np.exp(x[1]) - 3.0 * x[1]


@pytest.mark.parametrize("longest", [0.05, 0.3])
@pytest.mark.parametrize(("field", "name", "bounds", "start"), [
    (two_mass_field(20.0, 0.05), "ground.speed", (0.05, 8.0), None),
    (two_mass_field(20.0, 8.0), "ground.speed", (0.05, 8.0), None),
    (two_mass_field(0.1), "B", (0.1, 30.0), None),
    (lorenz_field(), "rho", (0.5, 40.0), [1.0, 1.0, 1.0]),
    (vector_field(reactor, {"p": 0.0}, 2), "p", (0.0, 0.5), None),
    (contact_field(mode_coupling(0.05), ["friction.friction_coefficient"]),
     "friction.friction_coefficient", (0.0, 1.0), None),
    (contact_field(belt(1e6, 0.012), ["ground.speed"]), "ground.speed", (2e-3, 0.012), None),
])
def test_equilibria(field, name, bounds, start, longest):
    index = field.index(name)
    branch = equilibrium_branch(
        field, start, name,
        options=ContinuationOptions(bounds=bounds, step=min(0.05, longest), largest_step=longest),
        direction=1.0 if field.values[index] < bounds[1] else -1.0)
    assert branch.status is BranchStatus.BOUND
    assert branch.special
    assert_explained(branch)
    for point in branch.points:
        if point.kind is None:
            growth = np.asarray(point.values["eigenvalues"]).real
            assert point.values["unstable"] == (growth > 0.0).sum()


def test_two_masses_from_a_slow_belt():
    """From 0.05 m/s on two pairs cross close to each other, then back; from the plain Jacobian."""
    branch = equilibrium_branch(two_mass_field(20.0, 0.05), parameter="ground.speed",
                                bounds=(0.05, 8.0))

    def growth(rank):
        return lambda v: np.unique(np.linalg.eigvals(two_mass_jacobian(20.0, v)).real)[rank]

    expected = [brentq(growth(rank), *bracket, xtol=1e-14) for rank, bracket in (
        (-1, (0.08, 0.085)), (0, (0.085, 0.09)), (0, (1.4, 1.6)), (-1, (2.3, 2.5)))]
    assert [point.kind for point in branch.special] == ["Hopf"] * 4
    assert [point.parameter for point in branch.special] == pytest.approx(expected, rel=1e-9)
    for point in branch.points:
        eigenvalues = np.linalg.eigvals(two_mass_jacobian(20.0, point.parameter))
        if point.kind is None:
            assert point.values["unstable"] == (eigenvalues.real > 0.0).sum()


def test_crossings_that_no_test_tells_apart_are_marked():
    field = vector_field(twice, {"p": -0.3}, 4)
    branch = equilibrium_branch(field, parameter="p", bounds=(-0.3, 0.4))
    assert_explained(branch, unresolved=1)
    mark, = branch.special
    assert (mark.unstable_before, mark.unstable_after) == (0, 4)
    assert abs(mark.parameter) <= mark.parameter_error < 1e-6


def test_undamped_flutter_is_marked():
    """Two modes without damping merge at mu = 3/4; rounding decides what is seen there."""
    name = "friction.friction_coefficient"
    branch = equilibrium_branch(contact_field(mode_coupling(), [name]), parameter=name,
                                bounds=(0.0, 1.0))
    mark, = branch.special
    assert mark.parameter == pytest.approx(0.75, abs=1e-4)
    assert mark.kind in ("Hopf", "unresolved")
    assert_explained(branch, unresolved=int(mark.kind == "unresolved"))


def round_a_circle(t, x, p, out):
    # A circle of radius one; two planes across it in which the same pair of multipliers turns.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    out[0] = (1.0 - r) * x[0] - 2.0 * x[1]
    out[1] = (1.0 - r) * x[1] + 2.0 * x[0]
    for k in (2, 4):
        square = x[k] * x[k] + x[k + 1] * x[k + 1]
        out[k] = (p[0] - square) * x[k] - 0.7 * x[k + 1]
        out[k + 1] = (p[0] - square) * x[k + 1] + 0.7 * x[k]


def test_orbits_whose_multipliers_cross_together():
    field = vector_field(round_a_circle, {"p": -0.2}, 6)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.zeros((400, 6))
    circle[:, 0], circle[:, 1] = np.cos(2.0 * t), np.sin(2.0 * t)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "p",
                          method=Collocation(intervals=10), bounds=(-0.3, 0.3), scales=np.ones(6))
    assert_explained(branch, unresolved=1)
    mark, = branch.special
    assert abs(mark.parameter) <= mark.parameter_error < 1e-6


@pytest.mark.parametrize(("values", "name", "bounds", "direction"), [
    ({"B": 0.3}, "B", (0.3, 9.6), 1.0),
    ({"B": 10.0, "D": 2.2}, "D", (0.06, 2.2), -1.0),
    ({"B": 20.0, "v0": 8.0}, "v0", (1.0, 8.0), -1.0),
])
def test_orbits_of_two_masses(values, name, bounds, direction):
    """From few intervals on, at folds too, where two multipliers are one."""
    field = two_masses_field(**values)
    sliding = equilibrium_branch(field, np.zeros(4), name, bounds=bounds, direction=direction)
    assert_explained(sliding)
    hopfs = sliding.of_kind("Hopf")
    assert len(hopfs) == 2
    for hopf in hopfs:
        branch = orbit_branch(field, hopf, method=Collocation(intervals=30), bounds=bounds,
                              options=ContinuationOptions(step=0.005, points=120))
        assert branch.special
        assert_explained(branch)


@pytest.mark.parametrize(("start", "direction"), [(0.2, 1.0), (-0.3, -1.0)])
def test_a_start_on_a_bound_that_heads_outwards_is_all(start, direction):
    options = ContinuationOptions(bounds=(-0.3, 0.2))
    x = brentq(lambda x: start + x - x**3, -0.5, 0.5, xtol=1e-15)
    # On this sheet dx/dp is negative, and the direction is that of the parameter.
    branch = continue_branch(CUBIC, np.array([x, start]), options, direction=direction)
    assert branch.status is BranchStatus.BOUND
    assert branch.parameter.tolist() == [start]
    inwards = continue_branch(CUBIC, np.array([x, start]), options, direction=-direction)
    both = continue_branch(CUBIC, np.array([x, start]), options, direction=direction, both=True)
    assert len(both) == len(inwards) > 5
    assert sorted(both.parameter[[0, -1]]) == pytest.approx([-0.3, 0.2], abs=1e-15)
    assert (np.diff(both.parameter) * direction > 0.0).all()


def test_equilibria_that_start_on_a_bound(tmp_path):
    field = two_mass_field(20.0, 0.05)
    out = equilibrium_branch(field, parameter="ground.speed", bounds=(0.05, 8.0), direction=-1.0)
    assert (len(out), out.status) == (1, BranchStatus.BOUND)
    plot_eigenvalues(out, path=tmp_path / "one.png")
    assert (tmp_path / "one.png").exists()
    there = equilibrium_branch(field, parameter="ground.speed", bounds=(0.05, 8.0), direction=-1.0,
                               both=True)
    assert there.parameter[[0, -1]] == pytest.approx([8.0, 0.05], rel=1e-12)
