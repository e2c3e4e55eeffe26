"""Special points and events on branches of orbits: their places, coefficients, and their errors."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from collocation_fields import settled, two_masses_field
from test_orbit_bifurcations import moebius, torus
from test_orbit_curves import ring

from fecontact import InputError
from fecontact.bifurcation import (
    Branch,
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.continuation.points import with_details
from fecontact.bifurcation.orbits import sharpening
from fecontact.bifurcation.orbits.normal_forms import verdict
from fecontact.cli.branch_results import branches_csv, special_table
from fecontact.io import read_branch, write_branch


def circle_branch(function, c, intervals, state_tolerance=None, **accuracy):
    field = vector_field(function, {"lam": -0.2, "c": c}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    return orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                        method=Collocation(intervals=intervals, state_tolerance=state_tolerance,
                                           **accuracy),
                        bounds=(-0.3, 0.3), scales=np.ones(3))


@pytest.mark.parametrize("intervals", [2, 3, 5])
@pytest.mark.parametrize(("function", "coefficient"), [
    (moebius, 0.4 * np.pi / 1.08), (torus, 0.8 * np.pi / (1.0 + (0.5 / 0.7) ** 2 / 2.0))])
def test_error_of_a_coefficient_in_closed_form(function, coefficient, intervals):
    """On two intervals of a circle already the errors stated hold, of coefficient and place."""
    point, = circle_branch(function, 0.4, intervals).special
    assert point.criticality == "subcritical"
    assert abs(point.coefficient - coefficient) <= 1.5 * point.coefficient_error
    assert point.coefficient_error < 0.02 * coefficient
    assert abs(point.parameter) <= 1.5 * point.parameter_error + 1e-10


@pytest.mark.parametrize(("coefficient", "error", "expected"), [
    (0.59, 0.1, "subcritical"), (-0.59, 0.1, "supercritical"), (0.59, 0.3, "undecided"),
    (-45.0, 100.0, "undecided"), (4e-18, 4e-18, "undecided"), (0.0, 0.0, "undecided"),
    (0.59, np.nan, "undecided"), (np.nan, np.nan, "undecided")])
def test_verdicts(coefficient, error, expected):
    assert verdict(coefficient, error)["criticality"] == expected


@pytest.fixture(scope="module")
def slow_doubling():
    """Stick-slip at B = 20, D = 0.045, followed down to its doubling, on different meshes."""
    field = two_masses_field(B=20.0, D=0.045)
    times, states = settled(field, 400.0, [1.0, 0.0, 8.0, 0.0], 15.0)

    def found(intervals):
        return orbit_branch(
            field, (times, states), "D",
            method=Collocation(intervals=intervals, state_tolerance=None), bounds=(0.03, 0.05),
            width=2.0, direction=-1.0, scales=np.full(4, 8.0),
            options=ContinuationOptions(step=0.002, largest_step=0.01, points=40,
                                        stop_at=["period doubling"]))

    return found


@pytest.mark.parametrize("intervals", [40, 50])
def test_a_mesh_that_is_too_coarse_claims_nothing_wrong(slow_doubling, intervals):
    """The doubling moves farther than it is looked for, or is found, or the branch stalls: that
    hangs on rounding.
    """
    branch = slow_doubling(intervals)
    assert branch.special or branch.status is BranchStatus.STALLED
    for point in branch.special:
        assert point.kind in ("unresolved", "period doubling")
        # A point met on this mesh alone may have no place on finer ones, hence no error.
        assert abs(point.parameter - 0.04009165) <= 1.2 * point.parameter_error + 1e-8 or (
            point.kind == "unresolved" and np.isnan(point.parameter_error))
        assert point.kind == "unresolved" or point.criticality in ("undecided", "subcritical")


@pytest.mark.parametrize("intervals", [60, 80, 100])
def test_criticality_is_that_of_finer_meshes_or_undecided(slow_doubling, intervals):
    """Multipliers of this orbit span many decades: on the finest meshes rounding spreads the
    coefficient with a standard deviation of 0.003; on 60 intervals it is -55, on 100 -1.1.

    The return map of runs gives 0.4620 (difference quotients over two sections, sizes 5e-3 to
    2e-2). A sixth of it, 0.074, comes from zero slip, where the second derivative of friction with
    exp(-2 |v|) jumps; with sqrt(v^2 + e^2) in place of |v| it is 0.4609 for e = 3e-3.
    """
    point, = slow_doubling(intervals).special
    assert abs(point.parameter - 0.04009165) <= 1.2 * point.parameter_error + 1e-8
    assert point.criticality in ("undecided", "subcritical")
    assert abs(point.coefficient - 0.462) <= point.coefficient_error + 0.006
    assert abs(point.coefficient - 0.462) < 0.03
    assert point.coefficient_error >= 0.002


@pytest.fixture(scope="module")
def second():
    """The second branch over v_0 at B = 20, from its Hopf point over the fold and two doublings."""
    field = two_masses_field(B=20.0, v0=8.0)
    sliding = equilibrium_branch(field, np.zeros(4), "v0", bounds=(0.05, 8.0), direction=-1.0)
    return orbit_branch(field, sliding.of_kind("Hopf")[1], method=Collocation(intervals=50),
                        bounds=(0.05, 8.0), scales=np.full(4, 8.0),
                        options=ContinuationOptions(step=0.005, largest_step=0.04, points=80))


def test_points_on_sharp_turns_are_found_again(second):
    """Beside a sharp turn one search misses the point; from 100 to 800 intervals it is this."""
    fold, = second.of_kind("fold")
    assert fold.parameter == pytest.approx(2.5394064336, abs=1e-9)
    doublings = second.of_kind("period doubling")
    for point, wanted in zip(doublings, (2.5385714591, 2.3468776149), strict=True):
        error = point.parameter_error
        # The steps before it double rounding again and again: its mesh, and with it the error on
        # 50 intervals, between 1e-10 and 3e-8, depends on the last digit of the scales.
        assert error < 1e-7
        assert abs(point.parameter - wanted) <= 1.2 * error + 1e-10
        assert point.criticality == "subcritical"
    assert all(point.located for point in second.special)


def test_points_that_are_not_found_again_say_so(tmp_path, monkeypatch):
    monkeypatch.setattr(sharpening, "_searched", lambda *_: None)
    field = two_masses_field(B=0.3)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 9.6))
    branch = orbit_branch(field, sliding.of_kind("Hopf")[0], bounds=(0.3, 9.6),
                          options=ContinuationOptions(step=0.005))
    for point, exact in zip(branch.special, (0.890686833, 8.0921923845), strict=True):
        assert not point.located
        assert abs(point.parameter - exact) < point.parameter_error
    assert [point.kind for point in branch.special] == ["unresolved", "unresolved"]
    assert [point.instead_of for point in branch.special] == ["fold", "period doubling"]
    loaded = read_branch(write_branch(tmp_path / "branch.h5", branch))
    for mine, theirs in zip(branch.special, loaded.special, strict=True):
        assert not theirs.located
        assert theirs.parameter_error == mine.parameter_error
    observed = [replace(point, values={**point.values, "observed_minimum": 0.0,
                                       "observed_maximum": 0.0, "observed_amplitude": 0.0})
                for point in branch.special]
    shown = Branch("B", tuple(observed))
    rows = list(csv.DictReader(branches_csv({"orbits": shown}).splitlines()))
    assert [float(row["parameter_error"]) for row in rows] == [
        point.parameter_error for point in branch.special]
    columns = [list(column.cells) for column in special_table(shown).columns]
    assert "period doubling on this mesh, not on finer ones" in columns[-1][1]


def test_doublings_of_a_mesh_too_coarse_are_marked():
    """On ten intervals there are three between B = 7.8 and 8.3; the one there is lies at 8.0922.

    How far the branch goes on this mesh depends on the phase of its first orbit.
    """
    field = two_masses_field(B=0.3)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 9.6))
    hopf, marked = sliding.of_kind("Hopf")[0], []
    for phase in (1.0, -1.0):
        branch = orbit_branch(field, with_details(hopf, eigenvector=phase * hopf.eigenvector),
                              method=Collocation(intervals=10, state_tolerance=None),
                              bounds=(0.3, 9.6), options=ContinuationOptions(step=0.005))
        fold, *others = branch.special
        assert fold.kind == "fold"
        assert abs(fold.parameter - 0.890686833041) <= 1.2 * fold.parameter_error < 1e-4
        for point in others:
            if point.kind == "period doubling":
                assert abs(point.parameter - 8.0921923845) <= 1.2 * point.parameter_error
            else:
                assert point.kind == "unresolved"
                assert point.instead_of == "period doubling"
        marked += others
    assert marked


def swirl(t, x, p, out):
    # Radius sqrt(r), angular frequency 1 + r.
    square = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - square) * x[0] - (1.0 + square) * x[1]
    out[1] = (p[0] - square) * x[1] + (1.0 + square) * x[0]


def test_events_on_orbits_are_as_sharp_as_on_equilibria():
    field = vector_field(swirl, {"r": -0.1}, 2)
    rest = equilibrium_branch(field, parameter="r", bounds=(-0.1, 1.0))
    events = {"period of 4.5 s": lambda values: values["period"] - 4.5,
              "radius of 0.7": lambda values: values["maximum"][0] - 0.7,
              "multiplier of 0.1": lambda values: np.log(np.abs(values["multipliers"]).min() / 0.1)}
    branch = orbit_branch(field, rest.special[0], method=Collocation(intervals=60),
                          bounds=(-0.1, 1.0), options=ContinuationOptions(events=events))

    def place(kind):
        return branch.of_kind(kind)[0].parameter

    assert place("period of 4.5 s") == pytest.approx(2.0 * np.pi / 4.5 - 1.0, abs=1e-10)
    assert place("radius of 0.7") == pytest.approx(0.49, abs=1e-9)
    # The exponent is -2 r.
    exact = place("multiplier of 0.1")
    assert exact == pytest.approx(np.log(10.0) * (1.0 + exact) / (4.0 * np.pi), abs=1e-10)


@pytest.mark.parametrize(("function", "kind"), [(moebius, "period doubling"),
                                                (torus, "Neimark-Sacker")])
def test_errors_of_special_points_in_closed_form(function, kind):
    """On coarse meshes the error stated is the error, to a few per cent; the points lie at zero."""
    shares = []
    for intervals in (4, 5, 6, 8):
        point, = circle_branch(function, 0.4, intervals, tolerance=1.0).special
        assert point.kind == kind
        assert len(point.values["mesh"]) == intervals + 1
        shares.append(abs(point.parameter) / point.parameter_error)
    assert shares == pytest.approx(np.ones(4), rel=0.05)


def test_special_points_get_as_many_intervals_as_their_tolerance_needs():
    meshes = []
    for tolerance in (1e-6, 1e-9, 1e-11):
        point, = circle_branch(moebius, 0.4, 4, tolerance=tolerance).special
        # The diagram is 0.6 wide.
        assert abs(point.parameter) <= 1.1 * point.parameter_error <= 1.1 * 0.6 * tolerance
        meshes.append(len(point.values["mesh"]) - 1)
    assert meshes == [4, 8, 16]
    point, = circle_branch(moebius, 0.4, 4, tolerance=1e-12, most_intervals=16).special
    assert len(point.values["mesh"]) - 1 == 8
    assert point.parameter_error > 0.6e-12


def test_checks_of_a_coefficient_end_at_16_times_the_least_intervals(monkeypatch):
    """If orbits needed more than the least intervals, at least one doubling is made."""
    made = []
    twice = sharpening._with_twice_the_intervals

    def counted(problem, u, tangent):
        made.append(2 * problem.intervals)
        return twice(problem, u, tangent)

    monkeypatch.setattr(sharpening, "_with_twice_the_intervals", counted)
    monkeypatch.setattr(sharpening, "_KNOWN", 0.0)
    for least, doublings in ((2, 1), (6, 2)):
        made.clear()
        _ = circle_branch(moebius, 0.4, least, tolerance=1.0, state_tolerance=1e-6).special
        first = made[0] // 2
        assert first > 2 * least
        assert made == [2**k * first for k in range(1, doublings + 1)]


def test_errors_of_folds_in_closed_form():
    """s' = p^2 + q^2 - 1/4 + s^2 + p s / 10 turns at 0.9975 p^2 + q^2 = 1/4."""
    field = vector_field(ring, {"p": 0.0, "q": 0.1}, 2)
    t = np.linspace(0.0, 2.0 * np.pi / np.sqrt(4.0 - 0.09 * 0.24), 600)
    circle = (1.0 - np.sqrt(0.24)) * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    exact = np.sqrt(0.24 / 0.9975)
    for tolerance, intervals in ((1.0, 4), (1e-7, 6)):
        branch = orbit_branch(
            field, PeriodicMotion(t, circle, period=float(t[-1])), "p", bounds=(-1.0, 1.0),
            method=Collocation(intervals=intervals, tolerance=tolerance), scales=np.ones(2))
        folds = branch.of_kind("fold")
        assert len(folds) == 2
        for fold in folds:
            error = abs(abs(fold.parameter) - exact)
            assert error == pytest.approx(fold.parameter_error, rel=0.05)
            assert error <= 2.0 * tolerance


def test_default_settings_locate_a_doubling_to_a_tenmillionth_of_the_diagram(tmp_path):
    """With steps of a fifth of the amplitude too; files keep points of several meshes."""
    field = two_masses_field(B=0.3)
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 12.0))
    branch = orbit_branch(field, sliding.of_kind("Hopf")[0], bounds=(0.3, 12.0))
    fold, = branch.of_kind("fold")
    doubling, = branch.of_kind("period doubling")
    for point, exact in ((fold, 0.890686833041), (doubling, 8.0921923844629)):
        assert abs(point.parameter - exact) <= 1.2 * point.parameter_error + 1e-12
        assert point.parameter_error <= 1e-7 * 11.7
    assert len(doubling.values["mesh"]) > len(branch.points[0].values["mesh"])
    said = dict(branch.summary())["special"]
    assert said == (f"fold at 0.890686833041 +- {fold.parameter_error:.1g}, period doubling at "
                    f"{doubling.parameter_text()}")
    assert re.fullmatch(r"8\.0921923\d+ \+- \de-(0\d|10)", doubling.parameter_text())
    loaded = read_branch(write_branch(tmp_path / "branch.h5", branch))
    for mine, theirs in zip(branch, loaded, strict=True):
        assert theirs.u.tolist() == mine.u.tolist()
        assert theirs.tangent.tolist() == mine.tangent.tolist()
        assert theirs.values["mesh"].tolist() == mine.values["mesh"].tolist()
    with pytest.raises(InputError, match="'mesh' differs in length from point to point"):
        branch.column("mesh")
    # Orbits beyond have twice the intervals of the branch, not of the point.
    doubled = orbit_branch(field, loaded.of_kind("period doubling")[0], bounds=(0.3, 12.0),
                           options=ContinuationOptions(points=3))
    assert len(doubled.points[-1].values["mesh"]) == 101
