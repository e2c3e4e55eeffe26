"""Intervals along branches of orbits: errors of the states beside runs at tight tolerances."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from collocation_fields import settled, two_masses_field
from numba import njit
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from test_orbit_curves import circle_field, twisted

from fecontact import AnalysisError, ContactSystem, Drive, InputError, basis_from_matrices
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    periodic_motion,
    vector_field,
)
from fecontact.bifurcation.continuation import pseudo_arclength
from fecontact.bifurcation.orbits import by_collocation
from fecontact.bifurcation.orbits.collocation import CollocationProblem, Intervals
from fecontact.bifurcation.orbits.restored import restored
from fecontact.io import read_branch, write_branch
from fecontact.laws import RoughSurface


def vanderpol(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0]


def belt(t, x, p, out):
    # A mass on a belt of speed p[0]; friction of slope p[1] falls with the slip velocity.
    slip = x[1] - p[0]
    friction = 0.6 / np.pi * (1.0 + np.exp(-2.0 * np.abs(slip))) * np.arctan(p[1] * slip)
    out[0] = x[1]
    out[1] = -x[0] - 0.05 * x[1] - friction


def rossler(t, x, p, out):
    out[0] = -x[1] - x[2]
    out[1] = x[0] + 0.2 * x[1]
    out[2] = 0.2 + x[2] * (x[0] - p[0])


def driven(t, x, p, out):
    # Two wells; p = [force, frequency].
    out[0] = x[1]
    out[1] = p[0] * np.cos(p[1] * t) - 0.2 * x[1] - x[0] ** 3 + x[0]


def isola(t, x, p, out):
    # s' = 1/4 - p^2 - s^2 with s = r - 1; it turns evenly at p = -1/2, in jerks at p = 1/2.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s, speed = r - 1.0, 2.0 + 1.7 * (0.5 + p[0]) * x[0] / r
    radial = 0.25 - p[0] * p[0] - s * s
    out[0] = radial * x[0] / r - speed * x[1]
    out[1] = radial * x[1] / r + speed * x[0]


def counts(branch):
    return [len(point.values["mesh"]) - 1 for point in branch]


compiled_once = cache(njit)


class Through:
    """Dense output of DOP853, equal to scipy's, for many times at once."""

    def __init__(self, solution):
        parts = solution.interpolants
        self.begins = solution.ts[1:-1]
        self.t, self.h = (np.array([getattr(one, name) for one in parts])
                          for name in ("t_old", "h"))
        self.x, self.F = np.array([one.y_old for one in parts]), np.array([one.F for one in parts])

    def __call__(self, times):
        at = np.searchsorted(self.begins, times)
        x = ((times - self.t[at]) / self.h[at])[:, None]
        y = np.zeros((len(times), self.x.shape[1]))
        for i in reversed(range(self.F.shape[1])):
            y = (y + self.F[at, i]) * (x if i % 2 == 0 else 1.0 - x)
        return y + self.x[at]


def test_dense_output_is_that_of_scipy():
    run = solve_ivp(lambda t, x: [x[1], -np.sin(x[0])], (0.0, 9.0), [2.0, 0.0], method="DOP853",
                    rtol=1e-10, dense_output=True)
    times = np.append(np.linspace(9.0, 0.0, 200), run.t)
    assert Through(run.sol)(times) == pytest.approx(run.sol(times).T, abs=1e-14)


def true_error(point, function, *values, periods=1, samples=4001):
    """Period, and the largest error of the states in their ranges, beside a run from the orbit.

    The run takes some periods more, in which it settles to a strongly attracting cycle.
    """
    orbit, compiled, given = point.orbit(samples=samples), compiled_once(function), np.array(values)
    T = float(point.values["period"])
    at, out = np.argmax(orbit.states[:, 0]), np.empty(orbit.states.shape[1])

    def rates(t, x):
        compiled(t, x, given, out)
        return out.copy()

    def turns(t, x):
        return x[1]

    turns.direction = -1.0
    run = solve_ivp(rates, (0.0, (periods + 1.2) * T), orbit.states[at], method="DOP853",
                    rtol=1e-12, atol=1e-13, events=turns, dense_output=True)
    first, last = run.t_events[0][-2:]
    ranges, through = np.ptp(orbit.states, axis=0), Through(run.sol)

    def off(shift):
        phases = (orbit.times - orbit.times[at]) / T + shift
        times = first + np.mod(phases, 1.0) * (last - first)
        return float(np.max(np.abs(through(times) - orbit.states) / ranges))

    near = 2.0 / len(orbit.times)
    found = minimize_scalar(off, bounds=(-near, near), method="bounded", options={"xatol": 1e-12})
    return last - first, found.fun


@cache
def relaxation(tolerance):
    """Van der Pol's oscillator from nearly harmonic to relaxation oscillations."""
    field = vector_field(vanderpol, {"mu": 1.0}, 2)
    t, states = settled(field, 60.0, [2.0, 0.0], 8.0)
    return orbit_branch(field, (t, states), "mu", bounds=(0.5, 30.0), both=True,
                        method=Collocation(intervals=20, state_tolerance=tolerance))


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_errors_of_relaxation_oscillations(tolerance):
    """From mu = 0.5 to 30, against runs at tolerances of 1e-12."""
    branch = relaxation(tolerance)
    assert branch.status is BranchStatus.BOUND
    assert branch.message == ""
    assert branch.column("state_error").max() <= tolerance
    for mu in (0.5, 5.0, 12.0, 30.0):
        point = min(branch, key=lambda point, mu=mu: abs(point.parameter - mu))
        period, error = true_error(point, vanderpol, point.parameter)
        assert error <= tolerance
        assert 0.6 * error <= point.values["state_error"] <= 3.5 * error
        assert point.values["period"] == pytest.approx(period, rel=3e-8)


def test_intervals_rise_and_fall_along_a_branch():
    """To relaxation oscillations, and back to nearly harmonic ones from a point of the branch."""
    there = relaxation(1e-5)
    found = counts(there)
    assert min(found) < 50 < found[-1]
    field = vector_field(vanderpol, {"mu": 1.0}, 2)
    back = orbit_branch(field, there.points[-1], bounds=(0.05, 30.0), direction=-1.0,
                        options=ContinuationOptions(largest_step=0.01, points=1000))
    assert back.status is BranchStatus.BOUND
    assert back.method.state_tolerance == 1e-5
    assert back.column("state_error").max() <= 1e-5
    found = counts(back)
    assert found[0] > 50 > 40 >= found[-1]
    # The first terms of the series in mu.
    period = 2.0 * np.pi * (1.0 + 0.05**2 / 16.0 - 5.0 * 0.05**4 / 3072.0)
    assert back.points[-1].values["period"] == pytest.approx(period, rel=3e-8)


def stick_slip(slope, points=250, **method):
    field = vector_field(belt, {"speed": 1.0, "slope": slope}, 2)
    steady = equilibrium_branch(field, parameter="speed", bounds=(0.02, 3.0))
    return orbit_branch(field, steady.of_kind("Hopf")[0], bounds=(0.3, 3.0),
                        method=Collocation(**method),
                        options=ContinuationOptions(points=points))


def sticking(branch):
    return [point for point in branch if point.kind is None and bool(point.values["stable"])]


@pytest.mark.parametrize("slope", [100.0, 500.0])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-8])
def test_errors_of_stick_slip(slope, tolerance):
    """A mass that sticks on its belt, against runs at tolerances of 1e-12."""
    branch = stick_slip(slope, state_tolerance=tolerance)
    assert branch.status is BranchStatus.BOUND
    assert branch.message == ""
    assert branch.column("state_error").max() <= tolerance
    found = counts(branch)
    assert min(found) == 50
    assert (max(found) > 50) == (tolerance < 1e-5)
    for point in sticking(branch)[5::15]:
        period, error = true_error(point, belt, point.parameter, slope, periods=3)
        assert error <= 2.0 * tolerance
        assert 0.5 * error - 1e-9 <= point.values["state_error"] <= 4.0 * error
        assert point.values["period"] == pytest.approx(period, rel=max(1e-3 * tolerance, 3e-8))


@pytest.mark.parametrize("slope", [1e4, 5e4])
def test_steep_friction(slope):
    """Friction of slope 5e4, whose layers of a millionth of the period lie within intervals."""
    branch = stick_slip(slope)
    assert min(counts(branch)) == 50
    chosen = sticking(branch)[5::40]
    if slope == 1e4:
        assert branch.message == ""
        assert branch.column("state_error").max() <= 1e-5
    else:
        # 800 intervals do not suffice for all of them.
        worst = max(branch, key=lambda point: float(point.values["state_error"]))
        # Which orbit has an unlucky mesh hangs on rounding.
        assert np.quantile(branch.column("state_error"), 0.99) < 2e-5
        assert 1e-5 < worst.values["state_error"] < 5e-5
        assert len(worst.values["mesh"]) == 801
        assert "allow more than most_intervals = 800." in branch.message
        chosen.append(worst)
    for point in chosen:
        error = true_error(point, belt, point.parameter, slope, periods=3, samples=40001)[1]
        assert 0.5 * error - 3e-9 <= point.values["state_error"] <= 3.0 * error


def test_layers_between_the_points_of_an_interval_are_seen():
    """Friction of slope 5e4 on fixed intervals, beside runs at tolerances of 1e-12."""
    branch = stick_slip(5e4, state_tolerance=None)
    errors = []
    for point in sticking(branch)[5::16]:
        errors.append(true_error(point, belt, point.parameter, 5e4, periods=3, samples=40001)[1])
        assert 0.5 * errors[-1] <= point.values["state_error"] <= 3.0 * errors[-1]
    assert max(errors) > 1e-6


def driven_branch(method):
    field = vector_field(driven, {"P": 0.1, "W": 1.2}, 2, period=lambda p: 2.0 * np.pi / p["W"])
    period = 2.0 * np.pi / 1.2
    start = settled(field, 60.0 * period, [1.0, 0.0], 2.0 * period)
    return field, orbit_branch(field, start, "P", bounds=(0.05, 0.6), method=method)


def chaos_branch(method):
    field = vector_field(rossler, {"c": 2.5}, 3)
    return field, orbit_branch(field, settled(field, 400.0, [1.0, 1.0, 0.0], 15.0), "c",
                               bounds=(2.0, 6.0), method=method)


FINE = Collocation(400, state_tolerance=None, tolerance=1e-11)


@pytest.mark.parametrize("followed", [driven_branch, chaos_branch])
def test_doublings_beside_those_of_a_fine_mesh(followed):
    """A driven oscillator with two wells and Roessler's orbit, on 400 intervals exact."""
    _, exact = followed(FINE)
    reference, = exact.of_kind("period doubling")
    width = np.ptp(exact.parameter)
    for intervals in (8, 12, 20, 50):
        _, branch = followed(Collocation(intervals))
        assert branch.column("state_error").max() <= 1e-5
        doubling, = branch.of_kind("period doubling")
        off = abs(doubling.parameter - reference.parameter)
        assert off <= 1.2 * doubling.parameter_error + 2e-11
        assert doubling.parameter_error <= 1.01e-7 * width
        if off > 1e-9:
            assert off == pytest.approx(doubling.parameter_error, rel=0.2)


@pytest.mark.parametrize("intervals", [12, 16, 20, 30])
def test_errors_of_states_beside_those_of_a_fine_mesh(intervals):
    """Over the whole orbit at the same force, before the first fold."""
    field, rough = driven_branch(Collocation(intervals, state_tolerance=None))
    _, exact = driven_branch(FINE)
    ratios = []
    for point in rough.points[:12:3]:
        one, other = (each.orbit(samples=2001) for each in (point, exact.at(field,
                                                                            point.parameter)))
        error = np.max(np.abs(one.states - other.states) / np.ptp(other.states, axis=0))
        ratios.append(float(point.values["state_error"]) / error)
    assert min(ratios) >= 0.7
    assert max(ratios) <= 2.0
    # With fixed intervals nothing is said of the error but in the points.
    assert set(counts(rough)) >= {intervals}
    assert rough.message == ""


def isola_field():
    return vector_field(isola, {"p": 0.0}, 2)


def circles(method, points=200):
    field = isola_field()
    return orbit_branch(field, settled(field, 60.0, [1.5, 0.0], 4.0), "p", bounds=(-1.0, 1.0),
                        scales=np.ones(2), method=method,
                        options=ContinuationOptions(points=points))


def test_a_branch_says_where_the_intervals_do_not_suffice():
    branch = circles(Collocation(16, state_tolerance=1e-8, most_intervals=40))
    assert branch.status is BranchStatus.CLOSED
    assert max(counts(branch)) == 40
    poor = [point for point in branch.points if point.values["state_error"] > 1e-8]
    worst = max(poor, key=lambda point: point.values["state_error"])
    assert 1e-8 < worst.values["state_error"] < 1e-5
    assert branch.message == (
        f"The states of {len(poor)} of {len(branch)} orbits are less accurate than "
        f"state_tolerance = 1e-08, off by up to {worst.values['state_error']:.1e} at the parameter "
        f"{worst.parameter:.6g}: allow more than most_intervals = 40.")


def test_a_branch_says_where_newtons_method_fails_on_finer_meshes(monkeypatch):
    """The start stays on its mesh; to allow more intervals would not help."""
    started = pseudo_arclength.start_of

    def failing(problem, *rest):
        if problem.intervals > 16:
            raise AnalysisError("No convergence.")
        return started(problem, *rest)

    monkeypatch.setattr(pseudo_arclength, "start_of", failing)
    branch = circles(Collocation(16, state_tolerance=1e-8), points=1)
    point, = branch.points
    assert counts(branch) == [16]
    assert branch.message == (
        f"The states of 1 of 1 orbits are less accurate than state_tolerance = 1e-08, off by up to "
        f"{point.values['state_error']:.1e} at the parameter {point.parameter:.6g}: Newton's "
        f"method failed on finer meshes there; start with more intervals.")


def test_a_branch_tells_of_special_points_as_they_are_in_the_end(monkeypatch):
    """The points' own meshes decide, not those on which they were met."""
    monkeypatch.setattr(
        by_collocation, "_sharpened", lambda field, branch, index, accuracy: replace(
            branch.points[index],
            values={**branch.points[index].values, "state_error": 2e-5 * (index + 1)}))
    branch = circles(Collocation(16))
    folds = branch.of_kind("fold")
    worst = folds[-1]
    assert len(folds) == 2
    assert branch.message == (
        f"The states of 2 of {len(branch)} orbits are less accurate than state_tolerance = 1e-05, "
        f"off by up to {worst.values['state_error']:.1e} at the parameter {worst.parameter:.6g}: "
        f"take more than intervals = 16.")


def test_special_points_within_a_step_ask_for_more_intervals_too(monkeypatch):
    """The mesh is made for the least accurate of the orbits ahead."""
    seen = []
    refined = CollocationProblem.refined

    def watched(problem, u, tangent, ahead):
        seen.append([getattr(point, "kind", None) for point in ahead])
        return refined(problem, u, tangent, ahead)

    monkeypatch.setattr(CollocationProblem, "refined", watched)
    branch = circles(Collocation(16))
    assert len(branch.of_kind("fold")) == 2
    assert sum(kinds.count("fold") for kinds in seen) >= 2
    assert all(kinds[-1] is None for kinds in seen)

    rest = branch.points[0]
    problem, u, tangent = restored(isola_field(), rest)
    problem = replace(problem, sizes=Intervals(16, 800, 1e-5))
    count = problem.intervals
    good, poor = (replace(point, values={**point.values, "state_error": error})
                  for point, error in ((rest, 1e-6), (rest, 1.1e-5)))
    assert refined(problem, u, tangent, [good]) is None
    for ahead in ([poor, good], [good, poor]):
        finer, _, _ = refined(problem, u, tangent, ahead)
        assert finer.intervals == Intervals(16, 800, 1e-5).after(count, 1.1e-5, 4) > count


def test_meshes_follow_an_impact_that_moves_along_the_branch():
    """Its phase changes with the frequency, so that the mesh of the orbit before misses it."""
    rows = np.array([[0.0], [1.0], [0.0]])
    system = ContactSystem(
        basis_from_matrices([[0.092]], [[0.0]], {"contact": rows[None], "B": rows}),
        normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        drive=Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                    frequency_hz=10.24))
    field = contact_field(system, {"drive.frequency_hz": None})
    motion = periodic_motion(system, initial=[0.0, 0.0])
    branch = orbit_branch(field, motion, "drive.frequency_hz", method=Collocation(60),
                          bounds=(10.2, 10.35), scales=20.0 * np.ptp(motion.states, axis=0),
                          options=ContinuationOptions(step=0.05, points=20))
    errors = branch.column("state_error")
    assert np.median(errors) < 1e-5
    assert (errors < 1e-5).mean() > 0.7


def test_fewer_intervals_wait_for_ten_steps_again():
    """A mesh that has become coarser is kept for as long as the one before."""
    rest = circles(Collocation(80, state_tolerance=None), points=1).points[0]
    problem, u, tangent = restored(isola_field(), rest)
    problem = replace(problem, sizes=Intervals(8, 800, 1e-2))
    found = []
    for _ in range(21):
        problem, u, tangent = problem.adapted(u, tangent)
        found.append(problem.intervals)
    assert found == 9 * [80] + 10 * [40] + 2 * [24]


def test_limits_below_the_intervals_are_raised_to_them():
    assert Collocation(1000).most_intervals == 1000
    assert Collocation(16, most_intervals=40).most_intervals == 40
    branch = circles(Collocation(24, state_tolerance=1e-11, most_intervals=16))
    assert set(counts(branch)) == {24}
    assert branch.method.most_intervals == 24
    assert branch.message.endswith(": allow more than most_intervals = 24.")


def test_curves_say_where_their_intervals_do_not_suffice():
    """Curves have the limit of the branch from which they start."""
    field, t, circle = circle_field(twisted, lam=0.7, nu=0.8)
    messages = []
    for intervals in (4, 16):
        branch = orbit_branch(
            field, PeriodicMotion(t, circle, period=np.pi), "lam", bounds=(0.3, 0.9),
            method=Collocation(intervals, most_intervals=intervals), scales=np.ones(3))
        curve = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "nu", direction=-1.0,
                             both=False, bounds={"lam": (0.3, 0.9), "nu": (0.0, 1.0)})
        messages.append(curve.message)
        errors = curve.column("state_error")
        if intervals == 4:
            worst = curve.points[int(np.argmax(errors))]
            told = (f"The states of {(errors > 1e-5).sum()} of {len(curve)} orbits are less "
                    f"accurate than state_tolerance = 1e-05, off by up to {errors.max():.1e} at "
                    f"the parameter {worst.parameter:.6g}: allow more than most_intervals = 4.")
    assert messages == [told, ""]


def test_numbers_of_intervals():
    """Intervals go with the root of order m + 1 of the error, in eights, with a wide dead band."""
    sizes = Intervals(50, 800, 1e-5)
    assert sizes.after(100, 9.9e-6, 4) == sizes.after(100, 2e-7, 4) == 100
    # (1.1e-5 / 1e-6)^(1/5) = 1.615, (1e-9 / 1e-6)^(1/5) = 0.251, (1e-7 / 1e-6)^(1/5) = 0.631.
    assert sizes.after(100, 1.1e-5, 4) == 168
    assert sizes.after(100, 0.1, 4) == 200
    assert sizes.after(100, 1e-7, 4) == 64
    assert sizes.after(400, 1e-14, 4) == 200
    assert sizes.after(60, 1e-14, 4) == 50
    assert sizes.after(500, 1.0, 4) == 800
    assert sizes.after(900, 1.0, 4) == 900
    assert sizes.at_start(200, 1e-9, 4) == 50
    # On 50 intervals the error is 1e-7 * 4^5 = 1e-4; 200 (1e-7 / 1e-6)^(1/5) = 126.2.
    assert sizes.at_start(200, 1e-7, 4) == 128
    assert sizes.at_start(200, 1e-3, 4) == 200


def test_files_and_points_of_branches_on_several_meshes(tmp_path):
    branch = relaxation(1e-7)
    loaded = read_branch(write_branch(tmp_path / "branch.h5", branch))
    assert counts(loaded) == counts(branch)
    for mine, theirs in zip(branch, loaded, strict=True):
        assert theirs.u.tolist() == mine.u.tolist()
        assert theirs.values["state_error"] == mine.values["state_error"]
    said = dict(branch.summary())["state error"]
    assert said == (f"{branch.column('state_error').max():.1e} or less, on {min(counts(branch))} "
                    f"to {max(counts(branch))} intervals")
    # Between two points on different meshes, from a file.
    field = vector_field(vanderpol, {"mu": 1.0}, 2)
    places = np.flatnonzero(np.diff(counts(loaded)))
    middle = float(loaded.parameter[places[-1] : places[-1] + 2].mean())
    period, _ = true_error(loaded.at(field, middle), vanderpol, middle)
    assert loaded.at(field, middle).values["period"] == pytest.approx(period, rel=3e-8)


def test_closed_branches_on_changing_meshes():
    """Orbits over a circle of parameters, steep on one side: the end meets the start."""
    branch = circles(Collocation(16, state_tolerance=1e-7))
    assert branch.status is BranchStatus.CLOSED
    assert branch.message == ""
    assert branch.column("state_error").max() <= 1e-7
    assert (np.diff(counts(branch)) > 0).any()
    assert (np.diff(counts(branch)) < 0).any()
    folds = branch.of_kind("fold")
    assert sorted(fold.parameter for fold in folds) == pytest.approx([-0.5, 0.5], abs=1e-7)
    p = branch.parameter
    exact = 2.0 * np.pi / np.sqrt(4.0 - (1.7 * (0.5 + p)) ** 2)
    assert branch.column("period") == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("intervals", [4, 5, 6, 8])
def test_errors_of_points_of_codimension_two(intervals):
    """Resonances in closed form: the errors stated of both parameters are the errors."""
    field, t, circle = circle_field(twisted, lam=0.7, nu=0.8)
    branch = orbit_branch(
        field, PeriodicMotion(t, circle, period=np.pi), "lam", bounds=(0.3, 0.9),
        method=Collocation(intervals=intervals, state_tolerance=None, tolerance=1.0),
        scales=np.ones(3))
    curve = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "nu", direction=-1.0,
                         both=False, bounds={"lam": (0.3, 0.9), "nu": (0.0, 1.0)})
    assert curve.message == ""
    for point, exact in zip(curve.special, (2.0 / 3.0, 0.5), strict=True):
        assert point.kind.startswith("resonance")
        assert point.located
        assert abs(point.parameter - exact) == pytest.approx(point.parameter_error, rel=0.1)
        assert abs(point.values["nu"] - exact) == pytest.approx(
            point.second_parameter_error, rel=0.1)
        assert f"+- {point.parameter_error:.1g}" in point.parameter_text()
        assert point.values["state_error"] > 0.0


def test_points_of_codimension_two_that_finer_meshes_do_not_have(monkeypatch):
    field, t, circle = circle_field(twisted, lam=0.7, nu=0.8)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          bounds=(0.3, 0.9), method=Collocation(16), scales=np.ones(3))
    monkeypatch.setattr("fecontact.bifurcation.orbits.curves.errors.found_near", lambda *_: None)
    curve = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "nu", direction=-1.0,
                         both=False, bounds={"lam": (0.3, 0.9), "nu": (0.0, 1.0)})
    # They are as sharp as the curve, along which lam = nu; the longest search goes 0.03.
    for point in curve.special:
        assert point.located
        assert [point.parameter_error, point.second_parameter_error] == pytest.approx(
            2 * [3e-2 / np.sqrt(0.6**-2 + 1.0)], rel=1e-5)
    assert curve.message == ("On twice the intervals these special points are not found nearby: "
                             "resonance 1:3 at 0.666667, resonance 1:4 at 0.5.")


@pytest.mark.parametrize("given", [0.0, -1.0, float("nan"), "1e-5"])
def test_bad_tolerances(given):
    with pytest.raises(InputError, match="state_tolerance = "):
        Collocation(state_tolerance=given)


def apart(one, other):
    """Largest distance of two autonomous orbits, in any phase, in the ranges of the states."""
    mine, theirs = (point.orbit(samples=8001) for point in (one, other))
    closed = np.vstack([theirs.states[:-1], theirs.states[:1]])
    through = CubicSpline(theirs.times / theirs.times[-1], closed, bc_type="periodic")
    phases, ranges = mine.times[:-1] / mine.times[-1], np.ptp(theirs.states, axis=0)
    sides = [np.fft.rfft(states[:-1] - states[:-1].mean(axis=0), axis=0) / ranges
             for states in (mine.states, theirs.states)]
    fitting = np.fft.irfft((sides[1] * sides[0].conj()).sum(axis=1), len(phases))
    rough, near = np.argmax(fitting) / len(phases), 2.0 / len(phases)

    def off(shift):
        return float(np.max(np.abs(through(phases + shift) - mine.states[:-1]) / ranges))

    return minimize_scalar(off, bounds=(rough - near, rough + near), method="bounded",
                           options={"xatol": 1e-11}).fun


def masses_branch(method):
    field = two_masses_field(B=0.3)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 12.0))
    return field, orbit_branch(field, sliding.of_kind("Hopf")[0], method=method,
                               bounds=(0.3, 12.0))


@pytest.mark.parametrize(("followed", "doubling", "shown"), [
    (masses_branch, 8.0921923844629, 7.8e-6), (chaos_branch, 2.83244502786, 3.7e-8)])
def test_default_settings_reach_what_is_stated(followed, doubling, shown):
    """A hundred-thousandth of the ranges, a ten-millionth of the diagram: table of the docs."""
    field, branch = followed(Collocation())
    largest = branch.column("state_error").max()
    assert largest == pytest.approx(shown, rel=0.1)
    assert largest <= 1e-5
    found, = branch.of_kind("period doubling")
    assert found.parameter_error <= 1e-7 * np.ptp(branch.parameter)
    assert abs(found.parameter - doubling) <= 1.2 * found.parameter_error + 2e-11
    worst = max((point for point in branch if point.kind is None),
                key=lambda point: point.values["state_error"])
    fine = orbit_branch(field, worst.orbit(field), branch.parameter_name, method=FINE,
                        options=ContinuationOptions(points=1, tolerance=1e-9))
    assert fine.points[0].parameter == worst.parameter
    true = apart(worst, fine.points[0])
    assert true <= 1e-5
    assert 0.4 * true <= worst.values["state_error"] <= 3.0 * true
