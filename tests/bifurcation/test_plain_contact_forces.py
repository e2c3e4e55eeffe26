"""Contact forces law by law for all samples; folds and bounds within compiled steps; values."""

import gc
import pickle
import weakref

import numpy as np
import pytest
from oscillators import unilateral
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.bifurcation.fields.contact_field import field_between
from fecontact.bifurcation.harmonic.compiled.arrays import PLAIN
from fecontact.bifurcation.harmonic.compiled.evaluation import condense_sampled, evaluate_sampled
from fecontact.bifurcation.harmonic.compiled.step_batches import StepBatches
from fecontact.bifurcation.harmonic.starts import problem_for, restored
from fecontact.core.errors import InputError
from fecontact.laws import BilateralPolynomial, ConstantFriction, RoughSurface

BOUNDS = (0.6 / TURN, 1.8 / TURN)


def duffing_in_y():
    """X'' + .05 X' + X + .1 X^3 = .18 sin W t."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   damping=[[0.05]])
    return fc.ContactSystem(basis, normal=BilateralPolynomial(0.0, 0.1), drive=fc.Drive(
        stiffness_y=1.0, amplitude_y=0.18, frequency_hz=0.8 / TURN))


def pressed_masses():
    """Three coordinates, two nodes whose tangents and normals are mixtures of them, on a belt."""
    rows = np.zeros((2, 3, 3))
    rows[0, 0], rows[0, 1] = [1.0, 0.2, 0.0], [0.1, 1.0, -0.3]
    rows[1, 0], rows[1, 1] = [0.7, 0.0, 0.5], [0.0, 0.4, 1.0]
    B = np.zeros((3, 3))
    B[:2, :2] = np.eye(2)
    K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    basis = fc.basis_from_matrices(np.eye(3), K, {"contact": rows, "B": B, "C": B},
                                   damping=0.04 * K)
    return fc.ContactSystem(
        basis, normal=RoughSurface(2.0, 0.5, 0.3), gap=(0.1, 0.0),
        friction=ConstantFriction(0.3, smoothing_slope=3.0), ground=fc.Ground(speed=0.2),
        load=fc.Load(0.4), drive=fc.Drive(stiffness_x=1.0, damping_x=0.2, amplitude_x=0.8,
                                          frequency_hz=0.9 / TURN))


def test_they_are_those_of_the_samples_one_by_one():
    """Nodes that press, lift off and slide to and fro, with all derivatives."""
    field = contact_field(pressed_masses(), ["drive.frequency_hz"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(4, 64),
                          np.ones(field.dimension + 2))
    u = np.append(np.random.default_rng(5).normal(size=problem.size) / 2.0, 0.9 / TURN)
    e = problem.equations(0.9 / TURN)
    assert e.numbers[PLAIN] == 1.0
    states = problem.states(u, problem.period(u), np.zeros((64, 0)))
    force = field.system().contact_history(np.zeros(64), states)[:, :, 0]
    assert (np.count_nonzero(force == 0.0, axis=0) > 5).all()
    assert (np.count_nonzero(force > 0.0, axis=0) > 5).all()
    rows = problem.linearise(u)
    kept = rows.residual, rows.condensed, *rows._samples()
    e.numbers[PLAIN] = 0.0
    key, = problem.compiled.known
    problem.compiled.known[key] = e._replace(evaluate=evaluate_sampled.address,
                                             condense=condense_sampled.address)
    other = problem.linearise(u)
    for mine, theirs in zip(kept, (other.residual, other.condensed, *other._samples()),
                            strict=True):
        assert mine == pytest.approx(theirs, abs=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("make", [pressed_masses, duffing_in_y])
def test_on_waves_they_are_not_plain(make):
    system = make()
    wavy = system.with_(ground=fc.Ground(amplitude=1e-3, wavelength=1.0, speed=0.0))
    for one, plain in ((system, 1.0), (wavy, 0.0)):
        field = contact_field(one, ["drive.frequency_hz"])
        problem = problem_for(field, field.values, 0, HarmonicBalance(2),
                              np.ones(field.dimension + 2))
        assert problem.equations(0.9 / TURN).numbers[PLAIN] == plain


@pytest.mark.parametrize("largest", [0.01, 0.05])
def test_folds_and_bound_are_met_in_one_call(largest, monkeypatch):
    """Folds of Duffing's oscillator at the published place, whatever the steps are."""
    made, plain = [], StepBatches.batch

    def counted(self, *given):
        made.append(plain(self, *given))
        return made[-1]

    monkeypatch.setattr(StepBatches, "batch", counted)
    found = frequency_response(
        duffing_in_y(), BOUNDS, observe=("B", "y"), method=HarmonicBalance(9, stability=None),
        options=ContinuationOptions(points=2000, largest_step=largest)).branches[0]
    assert len(made) == 1 + (len(found) > 513)
    assert found.status is BranchStatus.BOUND
    assert found.parameter[-1] == BOUNDS[1]
    first, second = found.of_kind("fold")
    assert TURN * second.parameter == pytest.approx(1.11570025, abs=1e-8)
    places = [found.points.index(fold) for fold in (first, second)]
    for place, sign in zip(places, (1.0, -1.0), strict=True):
        # The first fold is the largest parameter nearby, the second the smallest.
        before, fold, behind = found.points[place - 1 : place + 2]
        assert abs(fold.tangent[-1]) < 1e-7
        assert sign * before.tangent[-1] > 0.0 > sign * behind.tangent[-1]
        assert sign * fold.parameter > max(sign * before.parameter, sign * behind.parameter)
    field = contact_field(duffing_in_y(), ["drive.frequency_hz"])
    for place in (*places, 5, len(found) // 2, len(found) - 1):
        problem, u, tangent = restored(field, found.points[place])
        here = problem.linearise(u)
        exact = place in (*places, len(found) - 1)
        assert np.abs(here.residual).max() < (1e-10 if exact else 1e-7)
        scaled = np.abs(here.condensed * tangent).sum(axis=1)
        # Tangents of other points are those at the prediction of the step.
        assert np.abs(here.condensed @ tangent).max() < (1e-8 if exact else 2e-3) * scaled.max()


@pytest.mark.parametrize("stability", [None, "transitions"])
def test_compiled_steps_that_end_just_behind_a_fold(stability, monkeypatch):
    """The point before the last is then the regular one at which the last step began."""
    made, own = [], StepBatches.batch

    def batch(self, problem, here, *given):
        found = own(self, problem, here, *given)
        made.append((problem, found))
        return found

    monkeypatch.setattr(StepBatches, "batch", batch)
    seen = 0
    method = HarmonicBalance(9, stability=stability)
    whole = frequency_response(duffing_in_y(), BOUNDS, observe=("B", "y"), method=method,
                               options=ContinuationOptions(points=500, largest_step=0.03))
    fold = next(k for k, point in enumerate(whole.branches[0]) if point.kind == "fold")
    for points in (fold + 2, fold + 3):
        made.clear()
        frequency_response(
            duffing_in_y(), BOUNDS, observe=("B", "y"), method=method,
            options=ContinuationOptions(points=points, largest_step=0.03))
        for problem, found in made:
            if found is None or len(found.points) < 3 or found.points[-2].kind != "fold":
                continue
            seen += 1
            before, _, last = found.points[-3:]
            assert np.array_equal(found.before.u, before.u)
            assert found.before.tests["fold"] == before.tangent[-1] > 0.0 > last.tangent[-1]
            if found.problem.predictor.bend is not None:
                length = np.sqrt(problem.weights() @ (last.u - before.u) ** 2)
                assert found.problem.predictor.bend == pytest.approx(
                    (last.tangent - before.tangent) / length, rel=1e-9)
    assert seen > 0


def test_a_branch_stops_at_a_fold():
    options = ContinuationOptions(points=500, largest_step=0.03, stop_at="fold")
    for stability in (None, "transitions"):
        found = frequency_response(
            duffing_in_y(), BOUNDS, observe=("B", "y"), options=options,
            method=HarmonicBalance(9, stability=stability)).branches[0]
        assert found.status is BranchStatus.STOPPED
        assert found.points[-1].kind == "fold"
        assert TURN * found.points[-1].parameter == pytest.approx(1.2696019555, abs=1e-8)


def test_stability_changes_at_the_folds_alone():
    """Between the folds the orbit is a saddle; folds within compiled steps carry multipliers."""
    branch = frequency_response(duffing_in_y(), BOUNDS, observe=("B", "y")).branches[0]
    places = [k for k, point in enumerate(branch) if point.kind == "fold"]
    unstable = branch.column("unstable")
    regular = [k for k, point in enumerate(branch) if point.kind is None]
    expected = [int(places[0] < k < places[1]) for k in regular]
    assert unstable[regular].tolist() == expected
    for fold in branch.of_kind("fold"):
        assert np.abs(fold.values["multipliers"] - 1.0).min() < 1e-5


@pytest.mark.parametrize(("harmonics", "samples"), [(5, 64), (9, 256)])
def test_steps_with_kinks_are_as_accurate_as_the_tolerance(harmonics, samples):
    """A mass on a one-sided spring: every point solves the equations to the tolerance.

    Where a sample comes to lie on the other side of the kink, a Newton step may be no shorter than
    the one before.
    """
    options = ContinuationOptions(points=400, largest_step=0.02, tolerance=1e-8)
    branch = frequency_response(
        unilateral().system(), (0.6 / TURN, 1.2 / TURN), observe=("B", "y"), options=options,
        method=HarmonicBalance(harmonics, samples=samples, stability=None)).branches[0]
    assert len(branch) > 100
    field = contact_field(unilateral().system(), ["drive.frequency_hz"])
    for point in branch:
        problem, u, _ = restored(field, point)
        assert problem.kinked
        row = problem.weights() * point.tangent
        step = problem.linearise(u).solve(row, np.append(-problem.linearise(u).residual, 0.0))
        size = np.sqrt(problem.weights() @ u**2)
        assert np.sqrt(problem.weights() @ step**2) < options.tolerance * (1.0 + size)


def test_values_are_a_mapping_made_when_asked_for():
    response = frequency_response(duffing_in_y(), (0.6 / TURN, 0.8 / TURN), observe=("B", "y"),
                                  method=HarmonicBalance(9, stability=None))
    point = response.branches[0].points[3]
    names = ["period", "truncation_error", "residual", "minimum", "maximum", "observed_minimum",
             "observed_maximum", "observed_amplitude", "observed_harmonics"]
    assert list(point.values) == names
    assert len(point.values) == len(names)
    assert "multipliers" not in point.values
    assert "period" in repr(point.values)
    with pytest.raises(KeyError):
        point.values["multipliers"]
    joined = {"period": 1.0, "more": 2.0} | point.values
    assert list(joined) == ["period", "more", *names[1:]]
    assert joined["period"] == point.values["period"] != 1.0
    joined = point.values | {"period": 1.0, "more": 2.0}
    assert list(joined) == [*names, "more"]
    assert joined["period"] == 1.0
    assert isinstance(joined, dict)
    with pytest.raises(InputError, match="it has: 'maximum', 'minimum'"):
        response.branches[0].column("stable")
    # The observed displacement is the first state.
    assert point.values["observed_maximum"] == pytest.approx(point.values["maximum"][0], rel=1e-6)
    assert point.values["period"] == pytest.approx(1.0 / point.parameter, rel=1e-14)


@pytest.mark.parametrize("stability", [None, "transitions"])
def test_a_point_is_stored_without_its_neighbours(stability):
    """Copies hold a dict; what values were made from is given up when all are made."""
    branch = frequency_response(duffing_in_y(), (0.6 / TURN, 0.8 / TURN), observe=("B", "y"),
                                method=HarmonicBalance(9, stability=stability)).branches[0]
    point = branch.points[5]
    orbits = point.values._orbits
    reached = len(orbits.periods)
    assert reached < len(branch) + 1
    for name in ("X", "z", "forces", "mean", "sizes"):
        kept = getattr(orbits, name)
        assert len(kept) == reached
        assert (kept if kept.base is None else kept.base).size <= reached * (kept[0].size + 1)
    text = pickle.dumps(point)
    assert len(text) < 5000
    again = pickle.loads(text)
    assert type(again.values) is dict
    assert list(again.values) == list(point.values)
    for name, value in point.values.items():
        assert np.array_equal(again.values[name], value)
    assert [len(getattr(orbits, name)) for name in ("X", "forces", "mean")] == [0, 0, 0]
    assert branch.column("maximum").shape == (len(branch), 2)


def test_responses_of_a_system_share_its_field():
    system, ranges = duffing_in_y(), (("drive.frequency_hz", BOUNDS),)
    assert field_between(system, ranges) is field_between(system, ranges)
    assert field_between(duffing_in_y(), ranges) is not field_between(system, ranges)
    one, other = (frequency_response(system, BOUNDS, observe=("B", "y")) for _ in range(2))
    assert one.amplitude() == pytest.approx(other.amplitude(), rel=1e-14)


def test_a_system_keeps_its_last_fields_as_long_as_it_lives():
    system = duffing_in_y()
    every = [(("drive.frequency_hz", (0.6, high)),) for high in (1.4, 1.5, 1.6, 1.7, 1.8)]
    made = [field_between(system, ranges) for ranges in every]
    assert field_between(system, every[1]) is made[1]
    assert field_between(system, every[0]) is not made[0]
    # The third was used least recently when the first was made again.
    assert field_between(system, every[1]) is made[1]
    assert field_between(system, every[2]) is not made[2]
    # A copy with another drive has fields of its own, over its own values.
    other = system.with_(**{"drive.amplitude_y": 0.3})
    field = field_between(other, every[1])
    assert field is not made[1]
    assert field.system().parameter("drive.amplitude_y") == 0.3
    gone = weakref.ref(system)
    del system, other, field, made
    gc.collect()
    assert gone() is None
