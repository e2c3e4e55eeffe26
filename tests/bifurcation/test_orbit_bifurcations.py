"""Special points of branches of orbits against published values and closed forms."""

import numpy as np
import pytest
from collocation_fields import lorenz_field, settled, two_masses_field

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.orbits.restored import restored
from fecontact.io import read_branch, write_branch


@pytest.fixture(scope="module")
def lorenz():
    return lorenz_field()


@pytest.fixture(scope="module")
def asymmetric(lorenz):
    """The asymmetric family, from rho = 280 down to 225."""
    times, states = settled(lorenz, 40.0, [1.0, 2.0, 250.0], 0.45)
    return orbit_branch(lorenz, (times, states), "rho", method=Collocation(intervals=60),
                        bounds=(225.0, 330.0), direction=-1.0,
                        options=ContinuationOptions(largest_step=0.03))


def test_lorenz_cascade(lorenz, asymmetric):
    assert asymmetric.parameter[0] == pytest.approx(280.0)
    assert asymmetric.points[0].values["period"] == pytest.approx(0.434522, abs=5e-7)
    branch = asymmetric
    for rho, period in ((229.407, 0.480867), (218.210, 0.987949), (215.966, 1.98675)):
        point, = branch.of_kind("period doubling")
        assert point.parameter == pytest.approx(rho, abs=6e-4)
        assert point.values["period"] == pytest.approx(period, rel=2e-6)
        assert point.criticality == "supercritical"
        assert point.values["trivial_error"] < 1e-10
        if rho > 217.0:
            branch = orbit_branch(lorenz, point, bounds=(215.0, 230.0),
                                  options=ContinuationOptions( step=0.01,
                                                              stop_at=("period doubling",)))
            assert branch.status is BranchStatus.STOPPED


def test_lorenz_symmetric_orbit_loses_its_symmetry(lorenz, asymmetric):
    values = lorenz.values_with(rho=330.0)
    times, states = settled(lorenz, 40.0, [1.0, 2.0, 250.0], 0.45, values)
    symmetric = orbit_branch(lorenz, PeriodicMotion(times, states, parameter_values=values), "rho",
                             method=Collocation(intervals=60), bounds=(300.0, 340.0),
                             direction=-1.0)
    point, = symmetric.of_kind("branch point")
    assert (point.form, point.coefficient, point.criticality) == (None, None, None)
    assert point.parameter == pytest.approx(312.97, abs=6e-3)
    regular = np.array([at.kind is None for at in symmetric.points])
    low, high = symmetric.column("minimum")[regular], symmetric.column("maximum")[regular]
    assert high[:, :2] == pytest.approx(-low[:, :2], rel=1e-6)
    # Either half of the crossing branch is the asymmetric family.
    for direction in (1.0, -1.0):
        half = orbit_branch(lorenz, point, bounds=(225.0, 330.0), direction=direction)
        doubling, = half.of_kind("period doubling")
        known, = asymmetric.of_kind("period doubling")
        assert doubling.parameter == pytest.approx(known.parameter, abs=1e-6)


@pytest.fixture(scope="module")
def masses():
    return two_masses_field()


@pytest.fixture(scope="module")
def sliding(masses):
    return equilibrium_branch(masses, np.zeros(4), "B", bounds=(0.3, 9.6))


@pytest.fixture(scope="module")
def first(masses, sliding):
    return orbit_branch(masses, sliding.of_kind("Hopf")[0], method=Collocation(intervals=100),
                        options=ContinuationOptions(step=0.005), bounds=(0.3, 9.6))


def test_two_masses_first_branch(first):
    fold, = first.of_kind("fold")
    assert fold.parameter == pytest.approx(0.891, abs=5e-4)
    doubling, = first.of_kind("period doubling")
    assert doubling.parameter == pytest.approx(8.09, abs=5e-3)
    # Values of AUTO-07p's accuracy, from 400 intervals.
    assert fold.parameter == pytest.approx(0.890686833, abs=1e-8)
    assert doubling.parameter == pytest.approx(8.0921923845, abs=2e-8)
    # The orbits between Hopf point and fold are unstable, those beyond stable up to the doubling.
    unstable = first.column("unstable")
    regular = np.array([point.kind is None for point in first.points])
    before = first.points.index(fold)
    after = first.points.index(doubling)
    index = np.arange(len(first))
    assert (unstable[regular & (index < before)] == 1).all()
    assert (unstable[regular & (index > before) & (index < after)] == 0).all()
    assert (unstable[regular & (index > after)] == 1).all()


def test_two_masses_multipliers_obey_liouville(masses, first):
    # The product of all multipliers is exp(int div f dt).
    stable = [at for at in first.points if at.values["unstable"] == 0]
    for B in (1.1, 1.4):
        point = min(stable, key=lambda at: abs(at.parameter - B))
        problem, u, _ = restored(masses, point)
        linearised = problem.linearise(u)
        divergence = np.trace(linearised.derivatives[1], axis1=1, axis2=2)
        weights = (problem.widths[:, None] * problem.rule.weights).reshape(-1)
        expected = linearised.period * weights @ divergence
        found = np.log(np.abs(point.values["multipliers"])).sum()
        assert found == pytest.approx(expected, rel=1e-4)
        assert expected < -8.0


def test_two_masses_further_doublings(masses, first):
    branch, intervals = first, 100
    for B in (9.26, 9.37):
        point = branch.of_kind("period doubling")[0]
        assert point.criticality == "supercritical"
        intervals = min(2 * intervals, 200)
        branch = orbit_branch(masses, point, method=Collocation(intervals=intervals),
                              bounds=(8.0, 9.6),
                              options=ContinuationOptions(step=0.005, stop_at=("period doubling",)))
        assert branch.special[-1].parameter == pytest.approx(B, abs=6e-3)


def test_two_masses_coexisting_branch(masses, sliding):
    hopf = sliding.of_kind("Hopf")[1]
    assert hopf.parameter == pytest.approx(7.09, abs=5e-3)
    branch = orbit_branch(masses, hopf, method=Collocation(intervals=80), bounds=(0.3, 9.6))
    doublings = branch.of_kind("period doubling")
    assert doublings[-1].parameter == pytest.approx(7.25, abs=5e-3)
    assert doublings[-1].criticality == "subcritical"
    # From there on the orbits are stable, beside those of the first branch.
    assert branch.points[-1].values["unstable"] == 0


def test_points_stay_where_they_are_when_the_mesh_doubles(masses, sliding, first):
    finer = orbit_branch(masses, sliding.of_kind("Hopf")[0], method=Collocation(intervals=200),
                         options=ContinuationOptions(step=0.005), bounds=(0.3, 9.6))
    for kind in ("fold", "period doubling"):
        assert finer.of_kind(kind)[0].parameter == pytest.approx(
            first.of_kind(kind)[0].parameter, abs=3e-9)


def test_branches_go_on_from_their_files(masses, first, tmp_path):
    loaded = read_branch(write_branch(tmp_path / "orbits.h5", first))
    assert [at.kind for at in loaded.points] == [at.kind for at in first.points]
    assert (loaded.column("multipliers") == first.column("multipliers")).all()
    doubled = [orbit_branch(masses, branch.of_kind("period doubling")[0],
                            options=ContinuationOptions(points=2), bounds=(8.0, 9.6)).points[-1]
               for branch in (first, loaded)]
    assert (doubled[0].u == doubled[1].u).all()


def moebius(t, x, p, out):
    # A circle of radius one; across it, in axes that turn by half a turn per round,
    # xi' = lam xi + c xi^3 and eta' = -eta. The speed along it depends on both.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = a * a * (1.0 + C) / 2.0 + z * z * (1.0 - C) / 2.0 + a * z * S
    along = p[0] + p[1] * square
    mean, half = (along - 1.0) / 2.0, (along + 1.0) / 2.0
    speed = 2.0 + 0.3 * square + 0.4 * a
    radial = -speed / 2.0 * z + mean * a + half * (C * a + S * z)
    out[0] = radial * C - r * S * speed
    out[1] = radial * S + r * C * speed
    out[2] = speed / 2.0 * a + mean * z + half * (S * a - C * z)


def torus(t, x, p, out):
    # A circle of radius one; across it w' = (lam + 0.7 i) w + (c + 0.2 i) w |w|^2 in curved
    # coordinates w = r - 1 + 0.3 z^2 + i z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a = r - 1.0 + 0.3 * z * z
    square = a * a + z * z
    turn = 0.7 + 0.2 * square
    speed = 2.0 + 0.5 * a + 0.3 * z * z
    rise = p[0] * z + turn * a + p[1] * square * z
    radial = p[0] * a - turn * z + p[1] * square * a - 0.6 * z * rise
    out[0] = radial * C - r * S * speed
    out[1] = radial * S + r * C * speed
    out[2] = rise


def circle_branch(function, c):
    field = vector_field(function, {"lam": -0.2, "c": c}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    return orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                        method=Collocation(intervals=20), bounds=(-0.3, 0.3), scales=np.ones(3))


# With eigenfunctions of mean square one; the speed's response to a adds to it: 0.4 a with
# frequency 1, 0.5 a with frequency 0.7, each a half of the time's mean square.
@pytest.mark.parametrize("c", [-0.7, 0.4])
def test_normal_form_of_a_doubling(c):
    branch = circle_branch(moebius, c)
    point, = branch.special
    assert point.kind == "period doubling"
    assert point.parameter == pytest.approx(0.0, abs=1e-10)
    assert point.coefficient == pytest.approx(c * np.pi / 1.08, rel=1e-4)
    assert point.criticality == ("supercritical" if c < 0.0 else "subcritical")


@pytest.mark.parametrize("c", [-0.7, 0.4])
def test_normal_form_of_a_torus(c):
    branch = circle_branch(torus, c)
    point, = branch.special
    assert point.kind == "Neimark-Sacker"
    assert point.parameter == pytest.approx(0.0, abs=1e-10)
    assert point.angle == pytest.approx(0.7 * np.pi, rel=1e-8)
    assert point.coefficient == pytest.approx(
        2.0 * c * np.pi / (1.0 + (0.5 / 0.7) ** 2 / 2.0), rel=1e-4)
    assert point.criticality == ("supercritical" if c < 0.0 else "subcritical")


def test_kind_errors(masses, sliding, first):
    fold = first.of_kind("fold")[0]
    with pytest.raises(InputError, match=r"B = 1 \(a regular point\) has no orbits to follow"):
        orbit_branch(masses, sliding.points[0])
    with pytest.raises(InputError, match=r"at B = 0\.890687 \(fold\) is no equilibrium"):
        equilibrium_branch(masses, fold)
    with pytest.raises(InputError, match="field has no parameter"):
        orbit_branch(lorenz_field(), fold)
