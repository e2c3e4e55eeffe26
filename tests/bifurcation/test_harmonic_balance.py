"""Harmonic balance against closed forms, collocation, runs in time and differences."""

from dataclasses import replace

import numpy as np
import pytest
from oscillators import (
    duffing,
    duffing_frequency,
    jenkins,
    jenkins_amplitude,
    unilateral,
)
from systems import two_mass_field

from fecontact import simulate
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    PeriodicMotion,
    Shooting,
    amplitude,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.harmonic.series import series, shifted
from fecontact.bifurcation.harmonic.stability import koopman_hill
from fecontact.bifurcation.harmonic.starts import converged_orbit, problem_for, restored
from fecontact.core.errors import AnalysisError, InputError
from fecontact.output.files.branches import read_branch, write_branch

TURN = 2.0 * np.pi


def orbit(field, guess, H, samples=None, scales=None, **values):
    """The orbit near coefficients that are given, with harmonics H."""
    method = HarmonicBalance(H, samples)
    p = field.values_with(**values)
    problem = problem_for(field, p, 0, method, np.ones(field.dimension + 2))
    X = np.zeros(problem.reference.shape)
    for place, value in guess.items():
        X[place] = value
    u = np.append(X.reshape(-1), [1.0] * (problem.common - 1) + [p[0]])
    return converged_orbit(problem, u)


def sine_motion(field, X, w):
    """A start with x = X cos w t."""
    t = np.linspace(0.0, TURN / w, 201)
    return PeriodicMotion(t, np.stack([X * np.cos(w * t), -X * w * np.sin(w * t)], axis=1))


def same(found, expected, within):
    """Whether multipliers are the same in any order."""
    return max(np.abs(np.asarray(found) - mu).min() for mu in expected) < within


def fundamental(point, states=2):
    X = point.u[: 3 * states].reshape(3, states)
    return float(np.hypot(X[1, 0], X[2, 0]))


@pytest.mark.parametrize("case", ["plain", "plain autonomous", "memory", "contact", "masses"])
def test_derivatives_are_those_of_the_residual(case):
    field = {"plain": duffing, "plain autonomous": lambda: vector_field(_van_der_pol, {"e": 1.0},
                                                                        2),
             "memory": jenkins, "contact": unilateral,
             "masses": two_mass_field}[case]()
    method = HarmonicBalance(3, 40)
    problem = problem_for(field, field.values, 0, method, np.ones(field.dimension + 2))
    rng = np.random.default_rng(1)
    tail = [6.0] if problem.autonomous else []
    u = np.concatenate([2.0 * rng.normal(size=problem.size), tail, field.values[:1]])
    problem = replace(problem, reference=rng.normal(size=problem.reference.shape))
    differences = np.empty((problem.size + problem.autonomous, len(u)))
    for k in range(len(u)):
        h = 1e-6 * np.eye(len(u))[k]
        differences[:, k] = (problem.linearise(u + h).residual
                             - problem.linearise(u - h).residual) / 2e-6
    found = problem.linearise(u).condensed
    assert found == pytest.approx(differences, abs=1e-7 * np.abs(found).max())


def _van_der_pol(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] ** 2) * x[1] - x[0]


def test_duffing_response_has_its_published_amplitudes_and_folds():
    field = duffing()
    motion = sine_motion(field, 0.475, 0.8)
    found = orbit_branch(field, motion, "W", method=HarmonicBalance(9), bounds=(0.8, 1.6))
    assert fundamental(found.at(field, 0.8)) == pytest.approx(0.4748720, abs=1e-7)
    assert fundamental(found.at(field, 1.0)) == pytest.approx(1.3053455, abs=1e-7)
    upper, lower = (fold.parameter for fold in found.of_kind("fold"))
    assert lower == pytest.approx(1.11570025, abs=1e-8)
    assert [found.at(field, 1.2, which).values["stable"] for which in range(3)] == [
        True, False, True]
    other = orbit_branch(field, motion, "W", method=Collocation(50), bounds=(0.8, 1.6))
    assert [fold.parameter for fold in other.of_kind("fold")] == pytest.approx(
        [upper, lower], abs=1e-11)
    for which in range(3):
        mine, theirs = (branch.at(field, 1.2, which) for branch in (found, other))
        assert same(mine.values["multipliers"], theirs.values["multipliers"], 1e-8)
        assert mine.values["maximum"] == pytest.approx(theirs.values["maximum"], rel=1e-6)
        assert amplitude([1.0, 0.0])(mine) == pytest.approx(amplitude([1.0, 0.0])(theirs), rel=1e-6)


def test_error_falls_exponentially_with_the_harmonics_and_is_estimated():
    field = duffing()
    exact, reference = orbit(field, {1: (3.0, 0.0)}, 31, W=1.0, P=2.0)
    whole = exact.coefficients(reference)
    errors, estimates = [], []
    for H in (1, 3, 5, 7, 9, 11):
        problem, u = orbit(field, {1: (3.0, 0.0)}, H, 128, W=1.0, P=2.0)
        X = np.zeros_like(whole)
        X[: 2 * H + 1] = problem.coefficients(u)
        errors.append(np.linalg.norm(X - whole) / np.linalg.norm(whole[1:]))
        estimates.append(problem.linearise(u).neglected[0])
    ratios = np.array(errors[1:]) / errors[:-1]
    assert (ratios < 0.15).all()
    assert errors[-1] < 1e-8
    assert np.log(estimates) == pytest.approx(np.log(errors), abs=0.7)


def test_tolerance_takes_as_many_harmonics_as_it_needs():
    field = duffing(P=2.0)
    motion = sine_motion(field, 2.0, 0.8)
    options = ContinuationOptions(points=12)
    found = orbit_branch(field, motion, "W", bounds=(0.8, 1.2), options=options,
                         method=HarmonicBalance(2, tolerance=1e-6))
    assert found.column("truncation_error").max() <= 1e-6
    assert 5 <= found.method.highest <= 20
    with pytest.raises(AnalysisError, match="most_harmonics"):
        orbit_branch(field, motion, "W", bounds=(0.8, 1.2), options=options,
                     method=HarmonicBalance(2, tolerance=1e-12, most_harmonics=4))


def test_third_harmonic_of_the_duffing_oscillator():
    """To leading order it is that of the linear oscillator under -.1 A^3 / 4 cos 3 W t."""
    problem, u = orbit(duffing(), {1: (0.0, 0.0)}, 9, W=0.6, P=0.01)
    X = problem.coefficients(u)[:, 0]
    A1, A3 = np.hypot(X[1], X[2]), np.hypot(X[5], X[6])
    leading = 0.1 * A1**3 / 4.0 / abs(1.0 - 9.0 * 0.36 + 0.15j * 0.6)
    assert pytest.approx(leading, rel=1e-3) == A3


def test_conservative_period_is_that_of_the_elliptic_integral():
    assert duffing_frequency(1.0) == pytest.approx(1.0367169071, abs=1e-10)

    def free(t, x, p, out):
        # The damping p is zero on the family, which is followed over its amplitude.
        out[0] = x[1]
        out[1] = -x[0] - 0.1 * x[0] ** 3 - p[0] * x[1]

    field = vector_field(free, {"c": 0.05}, 2)
    hopf = equilibrium_branch(field, parameter="c", bounds=(-0.1, 0.1),
                              direction=-1.0).of_kind("Hopf")[0]
    found = orbit_branch(field, hopf, method=HarmonicBalance(15), bounds=(-0.1, 0.1),
                         options=ContinuationOptions(points=30, largest_step=0.2,
                                                         tolerance=1e-10))
    for point in found.points:
        assert abs(point.parameter) < 1e-10
        assert TURN / point.values["period"] == pytest.approx(
            duffing_frequency(point.values["maximum"][0]), rel=1e-8)
    assert found.points[-1].values["maximum"][0] > 1.0


def test_van_der_pol():
    """Period 6.6632868593 at e = 1, amplitude 2.0086198609 (published to ten digits)."""
    field = vector_field(_van_der_pol, {"e": 1.0}, 2)
    t = np.linspace(0.0, 6.66, 200)
    motion = PeriodicMotion(t, np.stack([2.0 * np.cos(t), -2.0 * np.sin(t)], axis=1), 6.6)
    found = orbit_branch(field, motion, method=HarmonicBalance(35), bounds=(1.0, 1.5)).points[0]
    assert found.values["period"] == pytest.approx(6.6632868593, rel=1e-9)
    assert found.values["maximum"][0] == pytest.approx(2.0086198609, rel=1e-6)
    assert found.values["trivial_error"] < 1e-6


@pytest.mark.parametrize(("w", "published"), [(1.1, 5.70250434), (1.2, 3.88731412)])
def test_one_harmonic_of_a_jenkins_element(w, published):
    assert jenkins_amplitude(w) == pytest.approx(published, abs=1e-8)
    errors = []
    for N in (16, 32, 128):
        problem, u = orbit(jenkins(w), {}, 1, N)
        X = problem.coefficients(u)[:, 0]
        errors.append(abs(np.hypot(X[1], X[2]) / published - 1.0))
    # Kinks between samples are located: fourth order.
    assert errors[0] < 1.2e-4
    assert errors[2] < min(3e-8, errors[0] / 1000.0)


def test_jenkins_element_agrees_with_a_run_in_time_and_its_multipliers():
    field = jenkins(1.2)
    problem, u = orbit(field, {}, 25, 2000)
    system, T = field.system(), TURN / 1.2
    settled = simulate(system, 60.0 * T, rtol=1e-10, outputs=np.array([0.0, 60.0 * T]))
    settled = simulate(system, T, initial=settled.states[-1], rtol=1e-10, outputs=2001)
    x = settled.states[:, 0]
    low, high = problem.extremes(u, problem.linearise(u).memory)
    assert [low[0], high[0]] == pytest.approx([x.min(), x.max()], rel=1e-4)
    start, columns = settled.states[-1], []
    for k in range(3):
        ends = [simulate(system, T, initial=start + sign * 1e-4 * np.eye(3)[k], rtol=1e-11,
                         outputs=np.array([0.0, T])).states[-1] for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / 2e-4)
    exact = np.linalg.eigvals(np.array(columns).T)
    exact = exact[np.argsort(-np.abs(exact))][:2]
    found = problem.linearise(u).floquet.multipliers[:2]
    # Elements switch between samples, which multipliers see to first order.
    assert same(found, exact, 6e-3)


def test_element_that_never_slides_is_a_spring():
    problem, u = orbit(jenkins(0.5), {}, 3, 128)
    X = problem.coefficients(u)[:, 0]
    assert np.hypot(X[1], X[2]) == pytest.approx(1.0 / abs(1.5 - 0.25 + 0.01j), rel=1e-6)
    z = problem.linearise(u).memory[:, 0]
    assert abs(z.mean()) < 1e-7
    assert problem.linearise(u).floquet.stable


def test_separation_agrees_with_collocation_and_shooting():
    field = unilateral()
    problem, u = orbit(field, {}, 60, 1024)
    motion = PeriodicMotion(problem.series.times * TURN,
                            problem.states(u, TURN, np.zeros((1024, 0))))
    times = np.append(motion.times, TURN)
    motion = PeriodicMotion(times, np.vstack([motion.states, motion.states[:1]]))
    found = [orbit_branch(field, motion, method=method, bounds=(1.0 / TURN, 1.1 / TURN),
                          options=ContinuationOptions(points=2)).points[0]
             for method in (HarmonicBalance(60, 1024), Collocation(200), Shooting(2))]
    mine, collocated, shot = (point.values for point in found)
    assert 0.2 < mine["maximum"][0] < 5.0
    assert mine["minimum"][0] < -0.2
    assert mine["minimum"][0] == pytest.approx(collocated["minimum"][0], rel=1e-5)
    assert mine["maximum"][0] == pytest.approx(collocated["maximum"][0], rel=1e-5)
    assert collocated["maximum"][0] == pytest.approx(shot["maximum"][0], rel=1e-3)
    assert same(mine["multipliers"], shot["multipliers"], 3e-3)


def mathieu(a, q, samples=64):
    """Derivatives J (N, 2, 2) of x'' + (a - 2 q cos 2 t) x = 0 over pi."""
    t = np.pi * np.arange(samples) / samples
    J = np.zeros((samples, 2, 2))
    J[:, 0, 1], J[:, 1, 0] = 1.0, -(a - 2.0 * q * np.cos(2.0 * t))
    return J


@pytest.mark.parametrize(("a", "multiplier"), [
    (-0.4551386041, 1.0), (-0.1102488170, -1.0), (1.8591080725, -1.0)])
def test_mathieu_by_the_koopman_hill_projection(a, multiplier):
    """At characteristic values both multipliers over pi are 1 or -1: the trace is 2 or -2."""
    errors = []
    for order in (4, 8, 16, 24):
        monodromy = koopman_hill(mathieu(a, 1.0), np.pi, order)
        errors.append(abs(np.trace(monodromy) - 2.0 * multiplier))
    assert errors[-1] < 1e-8
    assert errors[0] > 1e3 * errors[2] or errors[0] < 1e-8
    assert np.linalg.det(monodromy) == pytest.approx(1.0, abs=1e-9)


def test_koopman_hill_agrees_with_collocation_along_a_response():
    field = duffing()
    motion = sine_motion(field, 0.475, 0.8)
    found = [orbit_branch(field, motion, "W", method=method, bounds=(0.8, 1.4)) for method in
             (HarmonicBalance(12, stability="Koopman-Hill"), HarmonicBalance(12))]
    assert [point.kind for point in found[0].special] == ["fold", "fold"]
    for one, other in zip(*(branch.points for branch in found), strict=True):
        assert same(one.values["multipliers"], other.values["multipliers"], 1e-6)


@pytest.fixture(scope="module")
def two_masses():
    field = two_mass_field()
    hopf = equilibrium_branch(field, parameter="B", bounds=(0.3, 9.6)).of_kind("Hopf")[1]
    return field, {name: orbit_branch(field, hopf, method=method, bounds=(0.3, 9.0))
                   for name, method in (("harmonic", HarmonicBalance(40)),
                                        ("collocation", Collocation(100)))}


def test_orbits_born_at_a_hopf_point_agree_with_collocation(two_masses):
    _, found = two_masses
    kinds = [[(point.kind, point.parameter, point.values["period"]) for point in branch.special]
             for branch in found.values()]
    assert [kind for kind, *_ in kinds[0]] == ["fold", "period doubling", "period doubling"]
    for (kind, B, T), (other, B2, T2) in zip(*kinds, strict=True):
        assert kind == other
        assert pytest.approx(B2, rel=1e-5) == B
        assert pytest.approx(T2, rel=1e-6) == T


def test_an_orbit_in_another_phase_is_met_again_unless_its_amplitudes_differ(two_masses):
    """No shift in time brings two orbits closer than their amplitudes are."""
    field, found = two_masses
    here, there = found["harmonic"].points[3], found["harmonic"].points[6]
    problem, u, tangent = restored(field, here)
    _, v, _ = restored(field, there)
    weights = problem.weights()[: -problem.common]
    X, Y = problem.coefficients(u), problem.coefficients(v)

    def apart(shift):
        return np.sqrt(weights @ (shifted(X, shift) - Y).ravel() ** 2)

    least = min(map(apart, np.linspace(0.0, 1.0, 2001)))
    bound = problem._apart_at_least(u, v)
    assert 0.3 * least < bound <= least * (1.0 + 1e-12)
    later = np.append(shifted(X, 0.217).ravel(), u[-problem.common :])
    assert problem._apart_at_least(u, later) < 1e-12
    problem = replace(problem, reference=problem.coefficients(later).copy())
    again = problem.met_again(problem, u, tangent, later, tangent, 1e-6)
    assert again == pytest.approx(later, abs=1e-9 * np.abs(later).max())
    larger = later.copy()
    larger[: -problem.common] *= 1.1
    assert problem.met_again(problem, u, tangent, larger, tangent, 1e-6) is None


def test_doubled_orbits_agree_with_collocation(two_masses):
    field, found = two_masses
    ends = [orbit_branch(field, branch.of_kind("period doubling")[0], bounds=(5.0, 5.6),
                         direction=-1.0).points[-1].values for branch in found.values()]
    assert ends[0]["period"] == pytest.approx(ends[1]["period"], rel=1e-7)
    assert ends[0]["period"] == pytest.approx(9.6083519, rel=1e-7)
    assert ends[0]["maximum"] == pytest.approx(ends[1]["maximum"], rel=1e-4)


def test_branch_is_stored_and_continued(two_masses, tmp_path):
    field, found = two_masses
    branch = found["harmonic"]
    stored = read_branch(write_branch(tmp_path / "branch.h5", branch))
    one, other = branch.points[5], stored.points[5]
    assert other.orbit(samples=50).states == pytest.approx(one.orbit(samples=50).states)
    assert np.abs(np.diff(one.orbit().states, axis=0)[:, 0] / np.diff(one.orbit().times)
                  - one.orbit().states[:-1, 2]).max() < 0.05 * np.abs(
                      one.orbit().states[:, 2]).max()
    on = orbit_branch(field, other, bounds=(0.3, 9.0), options=ContinuationOptions(points=3))
    value = on.points[1].parameter
    assert on.points[1].values["period"] == pytest.approx(
        min((point.values["period"] for point in
             (branch.at(field, value, which) for which in range(1))),
            key=lambda T: abs(T - on.points[1].values["period"])), rel=1e-6)
    more = orbit_branch(field, other, method=HarmonicBalance(50), bounds=(0.3, 9.0),
                        options=ContinuationOptions(points=1))
    assert more.points[0].values["period"] == pytest.approx(one.values["period"], rel=1e-6)
    moved = orbit_branch(field, one, "ground.speed", bounds=(0.9, 1.1),
                         options=ContinuationOptions(points=2))
    assert moved.points[0].values["period"] == pytest.approx(one.values["period"], rel=1e-6)


@pytest.mark.parametrize("orders", [5, [1, 3, 5]])
@pytest.mark.parametrize("make", [duffing, unilateral])
def test_signs_of_determinants(make, orders):
    """Signs by the factors of a solution, also with another last row, against NumPy."""
    field = make()
    problem = problem_for(field, field.values, 0, HarmonicBalance(orders, 32),
                          np.ones(field.dimension + 2))
    rng, signs = np.random.default_rng(3), set()
    for _ in range(6):
        u = np.append(rng.normal(size=problem.size), field.values[0])
        u[problem.left_out] = 0.0
        linearised = problem.linearise(u)
        for _ in range(3):
            row = rng.normal(size=len(u))
            row[problem.left_out] = 0.0
            sign = np.linalg.slogdet(np.vstack([linearised.condensed, row]))[0]
            assert linearised.determinant_sign(row) == sign
            signs.add(sign)
            found = linearised.solve(row, np.arange(len(u)) * (row != 0.0))
            assert row @ found == pytest.approx(len(u) - 1.0)
    assert signs == {-1.0, 1.0}


def test_series_are_orthogonal():
    found = series(7, 24)
    assert found.projection @ found.values == pytest.approx(np.eye(15), abs=1e-14)


@pytest.mark.parametrize(("options", "told"), [
    ({"harmonics": 0}, "harmonics = 0 must be a whole number from 1"),
    ({"harmonics": [0]}, r"harmonics = \[0\] must be different whole numbers from 0"),
    ({"harmonics": []}, r"harmonics = \[\] must be different whole numbers"),
    ({"harmonics": [1, 1]}, r"harmonics = \[1, 1\] must be different"),
    ({"harmonics": [1, -3]}, "must be different whole numbers from 0 to 100000, at least one"),
    ({"harmonics": [1, 2.5]}, "must be different whole numbers"),
    ({"harmonics": "135"}, "harmonics = '135' must be a whole number from 1"),
    ({"harmonics": [1, 5], "samples": 11}, "samples = 11 must be a whole number from 12"),
    ({"harmonics": [1, 3], "tolerance": 1e-3}, "leave it out, or give harmonics = 3"),
    ({"harmonics": 9, "samples": 19}, "samples = 19 must be a whole number from 20"),
    ({"tolerance": 0.0}, "tolerance"),
    ({"stability": "Hill"}, "'transitions' or 'Koopman-Hill'")])
def test_bad_options(options, told):
    with pytest.raises(InputError, match=told):
        HarmonicBalance(**options)
