"""Branches that close, and branches on which the parameter rests: what is special on them."""

import numpy as np
import pytest
from systems import two_mass_field, two_mass_jacobian

from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    vector_field,
)
from fecontact.cli.branch_results import special_table
from fecontact.io import read_branch, write_branch


def island(t, x, p, out):
    # r' = r (1/4 - p^2 - (r^2 - 1)^2): circles with p^2 + (r^2 - 1)^2 = 1/4.
    square = x[0] * x[0] + x[1] * x[1]
    rise = 0.25 - p[0] * p[0] - (square - 1.0) * (square - 1.0)
    out[0] = rise * x[0] - (2.0 + 0.5 * x[0]) * x[1]
    out[1] = rise * x[1] + (2.0 + 0.5 * x[0]) * x[0]


def circle(radius, period):
    t = np.linspace(0.0, period, 800)
    return t, np.stack([radius * np.cos(2.0 * np.pi * t / period),
                        radius * np.sin(2.0 * np.pi * t / period)], axis=1)


@pytest.mark.parametrize("largest", [0.02, 0.05])
def test_an_island_of_orbits_is_gone_round_once(largest):
    """The phase has moved on when the branch comes back, and the mesh is another one."""
    field = vector_field(island, {"p": 0.1}, 2)
    square = 1.0 + np.sqrt(0.24)
    t, x = circle(np.sqrt(square), 2.0 * np.pi / np.sqrt(4.0 - 0.25 * square))
    branch = orbit_branch(field, PeriodicMotion(t, x, period=t[-1]), "p",
                          method=Collocation(intervals=20), bounds=(-1.0, 1.0),
                          options=ContinuationOptions(largest_step=largest))
    assert branch.status is BranchStatus.CLOSED
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert [point.parameter for point in branch.special] == pytest.approx([0.5, -0.5], abs=1e-8)
    assert branch.points[-1].parameter == pytest.approx(0.1, abs=1e-9)
    assert (branch.points[-1].u == branch.points[0].u).all()
    # Every size of orbit once: the radius goes down and up again.
    radius = branch.column("maximum")[:, 0]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(radius))))
    assert len(turns) == 2


def band(t, x, p, out):
    # A circle of radius one; across it, in axes that turn by half a turn per round,
    # xi' = (1/20 - q^2) xi - 0.7 xi^3 and eta' = -eta.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = a * a * (1.0 + C) / 2.0 + z * z * (1.0 - C) / 2.0 + a * z * S
    along = 0.05 - p[0] * p[0] - 0.7 * square
    mean, half = (along - 1.0) / 2.0, (along + 1.0) / 2.0
    radial = -z + mean * a + half * (C * a + S * z)
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = a + mean * z + half * (S * a - C * z)


def test_a_loop_of_doubled_orbits_ends_where_it_is_single():
    field = vector_field(band, {"q": -0.4}, 3)
    t, x = circle(1.0, np.pi)
    single = orbit_branch(field, PeriodicMotion(t, np.column_stack([x, 0.0 * t]), period=np.pi),
                          "q", method=Collocation(intervals=20), bounds=(-0.5, 0.5),
                          scales=np.ones(3))
    first, last = single.of_kind("period doubling")
    assert [first.parameter, last.parameter] == pytest.approx(np.array([-1.0, 1.0])
                                                              * np.sqrt(0.05), abs=1e-8)
    loop = orbit_branch(field, first, bounds=(-0.5, 0.5))
    assert loop.status is BranchStatus.CLOSED
    assert [point.kind for point in loop.special] == ["period halving"]
    assert loop.points[-1].kind == "period halving"
    assert loop.points[-1].parameter == pytest.approx(last.parameter, abs=1e-6)
    assert (np.diff(loop.parameter) > 0.0).all()


def fork(t, x, p, out):
    square = x[0] * x[0] + x[1] * x[1]
    out[0] = (1.0 - square) * x[0] - 2.0 * x[1]
    out[1] = (1.0 - square) * x[1] + 2.0 * x[0]
    out[2] = (p[0] - x[2] * x[2] + 0.1 * x[0]) * x[2]


@pytest.mark.parametrize("largest", [0.01, 0.02, 0.03, 0.05])
def test_no_fold_beside_a_fork(largest):
    """The bent branch turns at the pitchfork, at p = 0 where the mean growth of z is zero."""
    from scipy.integrate import solve_ivp

    field = vector_field(fork, {"p": 0.5}, 3)
    run = solve_ivp(lambda t, x: field.rates(np.zeros(1), x[None], field.values)[0], (0.0, 60.0),
                    [1.0, 0.0, 0.7], rtol=1e-9, atol=1e-11, dense_output=True)
    t = np.linspace(50.0, 60.0, 3000)
    branch = orbit_branch(field, PeriodicMotion(t, run.sol(t).T, period=np.pi), "p",
                          method=Collocation(intervals=20), bounds=(-0.5, 0.6), direction=-1.0,
                          scales=np.ones(3), options=ContinuationOptions(largest_step=largest))
    assert [point.kind for point in branch.special] == ["branch point"]
    assert branch.special[0].parameter == pytest.approx(0.0, abs=1e-5)


def canard(t, x, p, out):
    out[0] = 100.0 * (x[1] - x[0] * x[0] * x[0] / 3.0 + x[0])
    out[1] = p[0] - x[0]


def test_no_folds_on_a_canard():
    """The whole explosion of van der Pol's orbits lies within 1e-9 of one parameter.

    Where its multipliers grow beyond what numbers hold, the branch may say that it has lost them.
    """
    field = vector_field(canard, {"a": 1.2}, 2)
    rest = equilibrium_branch(field, [1.2, 1.2**3 / 3.0 - 1.2], "a", bounds=(0.8, 1.3),
                              direction=-1.0)
    orbits = orbit_branch(field, rest.of_kind("Hopf")[0], method=Collocation(intervals=100),
                          bounds=(0.8, 1.3), options=ContinuationOptions(points=200))
    # Asymptotically 1 - eps / 8 - 3 eps^2 / 32, eps = 0.01 (Zvonkin and Shubin 1984).
    assert orbits.parameter[-1] == pytest.approx(1.0 - 0.01 / 8.0 - 3e-4 / 32.0, abs=2e-6)
    assert {point.kind for point in orbits.special} <= {"unresolved"}


def pendulum(t, x, p, out):
    out[0] = x[1]
    out[1] = -x[0] - 0.5 * np.sin(x[0]) + p[0] * x[1]


def assert_none_unmarked(orbits, folder):
    """Special points of the mesh alone are marked, in the table and in files too."""
    assert {point.kind for point in orbits.special} == {"unresolved"}
    marked = [point for point in read_branch(write_branch(folder / "branch.h5", orbits)).special
              if point.instead_of is not None]
    assert marked
    assert {point.instead_of for point in marked} <= {"fold", "branch point"}
    remarks = list(special_table(orbits).columns[-1].cells)
    assert sum("not on finer ones" in remark for remark in remarks) == len(marked)


@pytest.mark.parametrize(("bounds", "largest", "points"), [
    ((0.98, 1.02), 0.05, 80), ((0.0, 1.3), 0.2, 40), ((0.9, 1.1), 0.2, 40)])
def test_folds_of_a_mesh_too_coarse_for_a_canard_are_left_out(bounds, largest, points):
    field = vector_field(canard, {"a": 1.2}, 2)
    rest = equilibrium_branch(field, [1.2, 1.2**3 / 3.0 - 1.2], "a", bounds=(0.8, 1.3),
                              direction=-1.0)
    orbits = orbit_branch(field, rest.of_kind("Hopf")[0], method=Collocation(intervals=50),
                          bounds=bounds,
                          options=ContinuationOptions(points=points, largest_step=largest))
    assert orbits.special == ()
    assert "are lost in rounding" in orbits.message


# Trials far off, where angles are huge, may make the check of derivatives speak up.
@pytest.mark.filterwarnings("ignore:The complex step does not get:UserWarning")
@pytest.mark.parametrize("intervals", [15, 20, 30])
def test_special_points_of_a_mesh_too_coarse_for_a_pendulum_are_marked(intervals, tmp_path):
    field = vector_field(pendulum, {"a": 0.1}, 2)
    rest = equilibrium_branch(field, parameter="a", bounds=(-0.5, 0.5), direction=-1.0)
    orbits = orbit_branch(field, rest.of_kind("Hopf")[0],
                          method=Collocation(intervals=intervals, state_tolerance=None),
                          bounds=(-0.5, 0.5),
                          options=ContinuationOptions(points=90, largest_step=0.1))
    assert_none_unmarked(orbits, tmp_path)


def test_a_conservative_family_has_no_special_points():
    field = vector_field(pendulum, {"a": 0.1}, 2)
    rest = equilibrium_branch(field, parameter="a", bounds=(-0.5, 0.5), direction=-1.0)
    centre, = rest.of_kind("Hopf")
    assert centre.criticality == "undecided"
    orbits = orbit_branch(field, centre, method=Collocation(intervals=50), bounds=(-0.5, 0.5),
                          options=ContinuationOptions(points=100))
    assert np.abs(orbits.parameter).max() < 1e-8
    assert orbits.points[-1].values["maximum"][0] > 10.0
    assert not orbits.special


def lotka(t, x, p, out):
    out[0] = x[0] * (1.0 - x[1]) + p[0] * (x[0] - 1.0)
    out[1] = x[1] * (x[0] - 1.0)


def test_terms_that_cancel_decide_nothing():
    """Lotka's equations have closed orbits only: l1 is zero, its terms are of the order of one."""
    field = vector_field(lotka, {"a": -0.1}, 2)
    point, = equilibrium_branch(field, [1.0, 1.0], "a", bounds=(-0.3, 0.3)).of_kind("Hopf")
    assert abs(point.first_lyapunov) < 1e-12
    assert point.criticality == "undecided"


def takens(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] + p[1] * x[1] + x[0] * x[0] + x[0] * x[1]


@pytest.mark.parametrize("k", [39, 59])
def test_two_states_have_no_zero_hopf_point(k):
    field = vector_field(takens, {"b": -1.0 - 0.013 * k, "c": 1.5}, 2)
    rest = equilibrium_branch(field, [-np.sqrt(1.0 + 0.013 * k), 0.0], "c", bounds=(0.2, 1.9),
                              direction=-1.0)
    curve = codim2_curve(field, rest.of_kind("Hopf")[0], "b",
                         bounds={"c": (-2.0, 2.0), "b": (-3.0, 1.0)},
                         options=ContinuationOptions(points=200, largest_step=0.02 + 0.003 * k))
    assert [point.kind for point in curve.special] == ["Bogdanov-Takens"]


def test_orbits_of_a_strong_hopf_point():
    """l1 is 934: the orbits keep the eigenvector's shape at amplitudes of some 1e-4 only."""
    field = two_mass_field(20.0, 0.06)
    near = ContinuationOptions(step=0.005, largest_step=0.01)
    rest = equilibrium_branch(field, find_equilibrium(field), "ground.speed", bounds=(0.05, 0.12),
                              options=near)
    point = rest.of_kind("Hopf")[0]
    eigenvalues = np.linalg.eigvals(two_mass_jacobian(20.0, point.parameter))
    assert np.abs(eigenvalues.real).min() < 1e-8
    orbits = orbit_branch(field, point, method=Collocation(intervals=100), bounds=(0.05, 8.0),
                          options=ContinuationOptions(points=20))
    assert orbits.points[0].parameter == pytest.approx(point.parameter, rel=1e-3)
    assert orbits.points[0].values["period"] == pytest.approx(
        2.0 * np.pi / np.abs(eigenvalues[np.abs(eigenvalues.real).argmin()].imag), rel=3e-3)
    # Subcritical: unstable, on the side where sliding is stable.
    assert orbits.points[0].values["unstable"] == 1


def test_the_same_call_gives_the_same_branch():
    field = two_mass_field(20.0, 1.0)

    def branches():
        rest = equilibrium_branch(field, parameter="ground.speed", bounds=(0.3, 8.0))
        return rest, orbit_branch(field, rest.of_kind("Hopf")[0], bounds=(0.3, 8.0),
                                  options=ContinuationOptions(points=60))

    first, again = branches(), branches()
    x = np.zeros((1, 4))
    for value in (1e-3, 40.0, 1.0, 7.0):  # whatever is asked for in between
        field.derivatives(np.zeros(1), x, field.values * value, (0, 1))
    third = branches()
    for one, other, later in zip(first, again, third, strict=True):
        assert len(one) == len(other) == len(later)
        for a, b, c in zip(one, other, later, strict=True):
            assert (a.u == b.u).all()
            assert (a.u == c.u).all()
