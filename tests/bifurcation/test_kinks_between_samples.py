"""Contact that begins and ends between samples of harmonic balance: folds, derivatives, runs."""

from dataclasses import replace

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, Drive, basis_from_matrices, simulate
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    vector_field,
)
from fecontact.bifurcation.harmonic.balance import Linearised
from fecontact.bifurcation.harmonic.starts import problem_for
from fecontact.laws import BilateralPlay, ConstantFriction, LinearContact

# Angular frequencies of the folds of seven harmonics, the same to all digits with 1024 samples and
# more.
FOLDS = (8.56761, 6.99774)
BOUNDS = (2.0 / TURN, 15.0 / TURN)


def stop(w=2.0):
    """x'' + .632 x' + 40 x + 1000 max(0, x - 10) = 100 sin w t; x points at the ground."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    return ContactSystem(
        basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows}),
        normal=LinearContact(1000.0), gap=10.0,
        drive=Drive(stiffness_y=40.0, damping_y=0.632, amplitude_y=2.5, frequency_hz=w / TURN))


def response(system=None, bounds=BOUNDS, observe=("B", "y"), **method):
    return frequency_response(system or stop(), bounds, observe=observe,
                              method=HarmonicBalance(7, **method)).branches[0]


def turns(branch):
    """Number of points at which the parameter turns."""
    signs = np.sign(np.diff(branch.parameter))
    return np.count_nonzero(signs[1:] * signs[:-1] < 0.0)


@pytest.mark.parametrize("stability", [None, "transitions"])
def test_both_folds_are_found_by_default(stability):
    branch = response(stability=stability)
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert [TURN * point.parameter for point in branch.special] == pytest.approx(FOLDS, abs=1e-3)
    assert turns(branch) == 2
    assert branch.attributes["sampling_error"] < 5e-4


def test_wrong_stability_is_left_out_and_said():
    branch = response()
    assert "stable" not in branch.points[0].values
    assert "Stability is left out: at the fold at drive.frequency_hz = 1.363" in branch.message
    assert response(stability=None).message == ""


def test_enough_harmonics_give_stability():
    """One multiplier passes 1 at each fold, none does elsewhere; doublings but no riddles."""
    branch = frequency_response(stop(), BOUNDS, observe=("B", "y"),
                                method=HarmonicBalance(25)).branches[0]
    kinds = [point.kind for point in branch.special]
    assert kinds == ["period doubling", "period doubling", "fold", "fold"]
    assert branch.message == ""
    assert "unresolved" not in dict(branch.summary())


@pytest.mark.parametrize("samples", [16, 20, 31, 48, 56, 64, 100, 128, 256, 512, 2048])
def test_parameter_turns_twice_or_a_sentence_says_why_not(samples):
    branch = response(stability=None, samples=samples)
    assert branch.method.samples == samples
    assert turns(branch) == 2 or "take more samples" in branch.message
    assert sum(point.kind == "fold" for point in branch.points) == turns(branch)
    if samples >= 128:
        assert branch.message == ""
        assert [TURN * point.parameter for point in branch.special] == pytest.approx(
            FOLDS, abs=5e-4)


def _stop(t, x, p, out):
    out[0] = x[1]
    out[1] = (100.0 * np.cos(p[0] * t) - 0.632 * x[1] - 40.0 * x[0]
              - 1000.0 * max(0.0, x[0] - 10.0))


def test_corners_of_functions_are_folds():
    """Kinks of functions of users are not known; where the slope jumps the parameter turns too."""
    field = vector_field(_stop, {"W": 2.0}, ("x", "v"), period=lambda p: 2.0 * np.pi / p["W"])
    branch = response(field, (2.0, 15.0), (1.0, 0.0), stability=None, samples=2048)
    first, last = (point for point in branch.points if point.kind == "fold")
    assert [first.parameter, last.parameter] == pytest.approx(FOLDS, abs=4e-3)


def test_runs_beside_the_fold():
    """Below the fold a run stays on the upper branch, beyond it falls to the lower one."""
    branch = response(stability=None)
    fold = TURN * branch.special[0].parameter
    places = [k for k, point in enumerate(branch.points) if TURN * point.parameter > 8.3]
    upper = next(branch.points[k] for k in places)
    field = contact_field(stop(), ["drive.frequency_hz"])
    start = upper.orbit(field).states[0]
    peaks, known = {}, TURN * upper.parameter
    for w in (known, fold + 0.1):
        run = simulate(stop(w), 60.0, initial=start, outputs=6001)
        peaks[w] = np.abs(run.states[-600:, 0]).max()
    assert peaks[known] == pytest.approx(
        float(np.abs([upper.values["minimum"][0], upper.values["maximum"][0]]).max()), rel=0.01)
    # Linear amplitude 100 / |40 - w^2|, below the gap.
    w = fold + 0.1
    assert peaks[w] == pytest.approx(100.0 / np.hypot(40.0 - w * w, 0.632 * w), rel=1e-3)
    assert peaks[w] < 10.0


def sliding(**parts):
    """A mass on moving ground, with two coordinates and a dashpot in the contact."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    return ContactSystem(
        basis_from_matrices(np.eye(2), [[1.0, 0.2], [0.2, 3.0]],
                            {"contact": rows[None], "B": rows}),
        **{"normal": LinearContact(30.0, 0.8), "friction": ConstantFriction(0.4, 0.2), "gap": 0.2,
           "drive": Drive(stiffness_x=1.0, stiffness_y=1.0, damping_y=0.2, amplitude_y=1.0,
                          amplitude_x=0.3, frequency_hz=1.3 / TURN), **parts})


def sliding_in_space(along_y=1.0, **parts):
    """The same mass as a solid, which may also move along a second tangent."""
    rows = np.zeros((6, 3))
    rows[0, 0] = rows[2, 1] = rows[1, 2] = 1.0
    stiffness = np.array([[1.0, 0.2, 0.1 * along_y], [0.2, 3.0, 0.0], [0.1 * along_y, 0.0, 5.0]])
    return ContactSystem(
        basis_from_matrices(np.eye(3), stiffness, {"contact": rows[None], "B": rows}, dimension=3),
        **{"normal": LinearContact(30.0, 0.8), "friction": ConstantFriction(0.4, 0.2), "gap": 0.2,
           "drive": Drive(stiffness_x=1.0, stiffness_z=1.0, damping_z=0.2, amplitude_z=1.0,
                          amplitude_x=0.3, stiffness_y=along_y, amplitude_y=0.4 * along_y,
                          frequency_hz=1.3 / TURN), **parts})


def test_a_solid_that_moves_in_a_plane_is_a_plane_body():
    found, motion = [], 0.3 * np.random.default_rng(4).standard_normal((7, 2))
    for system in (sliding(), sliding_in_space(along_y=0.0)):
        field = contact_field(system, ["drive.frequency_hz"])
        m = system.basis.modes
        problem = problem_for(field, field.values, 0, HarmonicBalance(3, 40), np.ones(2 * m))
        assert len(problem.onsets) > 0
        u = np.zeros((7, m))
        u[:, :2] = motion
        u = np.append(u.ravel(), field.values[0])
        found += [np.array(one[: 7 * m]).reshape(7, m)[:, :2]
                  for one in (problem.linearise(u).residual, Linearised(problem, u).residual)]
    for one in found[1:]:
        assert one == pytest.approx(found[0], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("system", [sliding, sliding_in_space])
@pytest.mark.parametrize("parameter", ["drive.frequency_hz", "normal.stiffness"])
@pytest.mark.parametrize("law", [LinearContact(30.0, 0.8), BilateralPlay(20.0, 0.3)])
def test_derivatives_are_those_of_the_equations(law, parameter, system):
    """Derivatives by compiled code and one by one, against central differences of the residual."""
    field = contact_field(system(normal=law), [parameter])
    size = 2 * field.system().basis.modes
    problem = problem_for(field, field.values, 0, HarmonicBalance(3, 40), np.ones(size))
    assert len(problem.onsets) > 0
    u = np.append(0.3 * np.random.default_rng(4).standard_normal(problem.size), field.values[0])
    whole = problem.linearise(u)
    alone = Linearised(problem, u)
    assert whole.residual.copy() == pytest.approx(alone.residual, rel=1e-9, abs=1e-9)
    found = [alone.condensed, whole.condensed]
    differences = np.empty_like(found[0])
    for k in range(len(u)):
        ends = [u.copy(), u.copy()]
        ends[0][k] += 1e-6
        ends[1][k] -= 1e-6
        differences[:, k] = (Linearised(problem, ends[0]).residual
                             - Linearised(problem, ends[1]).residual) / 2e-6
    for one in found:
        assert one == pytest.approx(differences, abs=2e-4 * np.abs(differences).max())


def test_forces_between_samples_add_up_to_the_integral():
    """Mean force of a prescribed motion: third order in the distance of samples."""
    field = contact_field(stop(), ["drive.frequency_hz"])
    errors = []
    for samples in (40, 80, 160):
        off = []
        for turn in np.linspace(0.0, 2.0 * np.pi, 7, endpoint=False):
            problem = problem_for(field, field.values, 0, HarmonicBalance(1, samples), np.ones(4))
            # x = -12 cos(w t + turn) touches at 10.
            u = np.array([0.0, -12.0 * np.cos(turn), 12.0 * np.sin(turn), 2.0 / TURN])
            force = -Linearised(problem, u).residual[0]
            half = np.arccos(10.0 / 12.0)
            exact = 1000.0 * (12.0 * np.sin(half) - 10.0 * half) / np.pi
            off.append(abs(force - exact) / exact)
        errors.append(max(off))
    assert errors[0] < 0.02
    assert errors[1] < 0.15 * errors[0]
    assert errors[2] < 0.15 * errors[1]


def test_laws_without_kinks_have_no_onsets():
    from fecontact.laws import RoughSurface

    system = replace(stop(), normal=RoughSurface(1e6, 1e-5, 6.0))
    field = contact_field(system, ["drive.frequency_hz"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(3), np.ones(4))
    assert problem.onsets.size == 0


def test_samples_that_are_given_are_kept():
    branch = frequency_response(
        stop(), (2.0 / TURN, 6.0 / TURN), observe=("B", "y"), method=HarmonicBalance(3, samples=24),
        options=ContinuationOptions(largest_step=0.1)).branches[0]
    assert branch.method.samples == 24
