"""Errors that few samples a period make, against describing functions and finer sampling."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from oscillators import duffing, jenkins, jenkins_amplitude, jenkins_system, unilateral
from scipy.optimize import minimize_scalar
from systems import TURN
from test_nonlinear_modes import masses

from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    frequency_response,
    nonlinear_mode,
)
from fecontact.bifurcation.continuation import newton
from fecontact.bifurcation.harmonic import branches
from fecontact.bifurcation.harmonic.branches import sampling_error
from fecontact.bifurcation.harmonic.starts import converged_orbit, problem_for, restored
from fecontact.bifurcation.response_options import ResponseSettings
from fecontact.core.errors import AnalysisError, InputError

BOUNDS = (1.05 / TURN, 1.3 / TURN)


def orbit(field, harmonics, samples, **values):
    """The orbit that Newton's method finds from rest."""
    p = field.values_with(**values)
    problem = problem_for(field, p, 0, HarmonicBalance(harmonics, samples),
                          np.ones(field.dimension + 2))
    return converged_orbit(problem, np.append(np.zeros(problem.size), p[0]))


def fixed(u):
    """The direction along the parameter: at right angles to it this stays as it is."""
    return np.append(np.zeros(len(u) - 1), 1.0)


def distance(problem, u, tangent, samples):
    """From an orbit to the branch of so many samples, at right angles to the tangent."""
    b = problem.layout.harmonic
    weights = problem.weights().copy()
    weights[:b] = 0.0
    weights[: problem.size] /= weights[: problem.size] @ u[: problem.size] ** 2
    if problem.autonomous:
        weights[-2] = u[-2] ** -2
    found, _, _ = newton.newton(replace(problem, samples=samples), u, weights * tangent, 1e-13,
                                   20, exact=True)
    return np.sqrt(weights @ (found - u) ** 2)


def exact(w):
    """Complex amplitude X of x = Re(X exp(i w t)) under sin w t, by the describing function."""
    A = jenkins_amplitude(w)
    turned = np.arccos(1.0 - 4.0 / A)
    stiffness = 0.5 / np.pi * (turned - np.sin(2.0 * turned) / 2.0)
    loss = 4.0 / np.pi * (1.0 - 2.0 / A) / A
    return -1j / (1.0 - w * w + stiffness + 1j * (0.02 * w + loss))


@pytest.mark.parametrize("w", [1.05, 1.1, 1.2, 1.3])
@pytest.mark.parametrize("samples", [7, 8, 16, 32])
def test_it_is_the_distance_to_the_describing_function(w, samples):
    problem, u = orbit(jenkins(w), 1, samples)
    off = abs(u[1] - 1j * u[2] - exact(w)) / abs(exact(w))
    assert 0.5 * off < sampling_error(problem, u, fixed(u)) < 2.0 * off


@pytest.mark.slow
def test_along_a_branch_it_is_the_distance_at_right_angles():
    """From the curve of the describing function."""
    branch = frequency_response(
        jenkins_system(), BOUNDS, method=HarmonicBalance(1, 8, stability=None),
        options=ContinuationOptions(points=60, largest_step=0.1)).branches[0]
    turned = 0
    for point in branch.points[1:-1:7]:
        problem, u, tangent = restored(jenkins(), point)
        x = u[1] - 1j * u[2]

        at = TURN * point.parameter

        def away(w, x=x, at=at):
            return np.hypot(abs(exact(w) - x) / abs(x), (w - at) / 0.25)

        off = minimize_scalar(away, bounds=(at - 0.02, at + 0.02), method="bounded",
                              options={"xatol": 1e-7}).fun
        found = sampling_error(problem, u, tangent)
        assert 0.7 * off < found < 1.4 * off
        turned += found < 0.8 * sampling_error(problem, u, fixed(u))
    assert turned > 0


def test_it_is_that_of_a_contact_with_separation():
    """Against sixteen times as many samples; corners lie anywhere between two of them."""
    field = unilateral(1.3)
    for samples in (64, 128, 256):
        problem, u = converged_orbit(problem_for(
            field, field.values, 0, HarmonicBalance(5, samples), np.ones(4)), np.append(
                [0.0, 0.0, 2.0, *np.zeros(8)], 1.3 / TURN))
        _, fine = converged_orbit(replace(problem, samples=16 * samples), u)
        off = np.sqrt(((u - fine)[1:-1] ** 2).sum() / (fine[1:-1] ** 2).sum())
        assert 0.3 * off < sampling_error(problem, u, fixed(u)) < 3.0 * off


def test_smooth_forces_have_none_but_aliasing():
    """Products of three harmonics are exact above 4 H samples."""
    problem, u = orbit(duffing(), 5, 24, W=0.9)
    assert sampling_error(problem, u, fixed(u)) < 1e-10
    problem, u = orbit(duffing(), 5, 14, W=0.9, P=2.0)
    _, fine = orbit(duffing(), 5, 64, W=0.9, P=2.0)
    off = np.sqrt(((u - fine)[1:-1] ** 2).sum() / (fine[1:-1] ** 2).sum())
    assert off > 1e-6
    assert sampling_error(problem, u, fixed(u)) == pytest.approx(4.0 / 3.0 * off, rel=0.02)


def test_folds_have_errors_like_the_points_beside_them():
    """The parameter cannot be held there: the error is the distance of the branches."""
    field = duffing(0.6, 0.25)
    branch = frequency_response(
        field, (0.6, 1.8), "W", method=HarmonicBalance(5, 14, sampling_tolerance=1e-3)).branches[0]
    assert branch.method.samples == 14
    folds = branch.of_kind("fold")
    assert len(folds) == 2
    largest = 0.0
    for point in (*folds, *branch.points[::10]):
        found = sampling_error(*restored(field, point))
        largest = max(found, largest)
        # Newton's method leaves about 1e-8 of this distance.
        if found > 1e-6:
            assert found == pytest.approx(4.0 / 3.0 * distance(*restored(field, point), 56),
                                          rel=0.01)
    assert sampling_error(*restored(field, folds[0])) > 1e-6
    assert branch.attributes["sampling_error"] == pytest.approx(largest, rel=0.2)
    # Twice the samples are exact here, and move the folds by no more than the estimate.
    fine = frequency_response(field, (0.6, 1.8), "W", method=HarmonicBalance(
        5, 14, sampling_tolerance=1e-9)).branches[0]
    assert fine.method.samples == 28
    assert fine.attributes["sampling_error"] < 1e-12
    for coarse, better in zip(folds, fine.of_kind("fold"), strict=True):
        off = abs(coarse.parameter - better.parameter) / 1.2
        assert off <= 1.01 * distance(*restored(field, coarse), 28)


def test_branches_that_cross_have_an_error_too():
    """A pitchfork, where no last row makes the equations regular."""
    branch = frequency_response(duffing(0.5, 10.0), (0.5, 1.8), "W", method=HarmonicBalance(
        9, 40, sampling_tolerance=1e-9)).branches[0]
    assert branch.of_kind("branch point")
    assert branch.attributes["sampling_error"] < 1e-11
    assert branch.method.samples == 40


def test_what_newton_left_is_no_error_of_samples():
    branch = frequency_response(duffing(0.6, 0.5), (0.6, 1.8), "W", method=HarmonicBalance(
        5, 32, sampling_tolerance=1e-9)).branches[0]
    assert branch.method.samples == 32
    assert branch.attributes["sampling_error"] < 1e-11
    problem, u = orbit(duffing(), 5, 14, W=0.9, P=2.0)
    expected = sampling_error(problem, u, fixed(u))
    beside = u.copy()
    beside[1] += 1e-2 * expected
    assert sampling_error(problem, beside, fixed(u)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("bounds", [(0.0, 0.5), (-0.1, 0.1)])
def test_orbits_at_rest_have_no_error(bounds):
    """Over the force, which begins at nothing or goes through it."""
    branch = frequency_response(duffing(0.8), bounds, "P", method=HarmonicBalance(
        5, 14, sampling_tolerance=1e-6), start=0.0).branches[0]
    assert min(np.abs(point.u[:-1]).max() for point in branch.points) < 1e-12
    assert branch.method.samples == 14
    assert branch.attributes["sampling_error"] < 1e-6
    # Rounding of forces on a body that they do not move, beside a motion and alone.
    problem, _ = orbit(duffing(), 5, 14)
    u = np.append(np.zeros(problem.size), 0.8)
    assert sampling_error(problem, u, fixed(u), 1.0) < 1e-14
    still = replace(problem, values=problem.field.values_with(P=0.0))
    assert sampling_error(still, u, fixed(u)) == 0.0


@pytest.mark.parametrize("stability", [None, "transitions"])
def test_samples_are_doubled_until_a_response_is_accurate(stability):
    found = frequency_response(
        jenkins_system(), BOUNDS, method=HarmonicBalance(
            1, 4, stability=stability, sampling_tolerance=1e-3),
        options=ContinuationOptions(points=60, largest_step=0.1)).branches[0]
    samples = found.method.samples
    assert samples == 16
    assert found.attributes["sampling_error"] < 1e-3
    off = [abs((point.u[1] - 1j * point.u[2]) / exact(TURN * point.parameter) - 1.0)
           for point in found.points[::6]]
    assert max(off) < 1.5e-3
    assert max(off) > 0.3 * found.attributes["sampling_error"]
    # Half as many do not suffice, and a start with enough is kept.
    fewer, same = (frequency_response(
        jenkins_system(), BOUNDS, method=HarmonicBalance(
            1, count, stability=stability, sampling_tolerance=tolerance),
        options=ContinuationOptions(points=60, largest_step=0.1)).branches[0]
        for count, tolerance in ((samples // 2, 0.5), (samples, 1e-3)))
    assert fewer.attributes["sampling_error"] > 1e-3
    assert same.method.samples == samples
    assert same.attributes["sampling_error"] == pytest.approx(
        found.attributes["sampling_error"], rel=0.3)


def test_harmonics_and_samples_grow_together():
    found = frequency_response(
        jenkins_system(), (1.15 / TURN, 1.2 / TURN), method=HarmonicBalance(
            1, 4, tolerance=2e-3, sampling_tolerance=1e-4, stability=None),
        options=ContinuationOptions(points=4)).branches[0]
    assert found.column("truncation_error").max() <= 2e-3
    assert found.attributes["sampling_error"] <= 1e-4
    assert found.method.highest > 2
    assert found.method.samples > 4 * found.method.highest


def test_modes_get_samples_enough_too():
    mode = nonlinear_mode(jenkins_system(), (2.5, 6.0), method=HarmonicBalance(
        1, 4, sampling_tolerance=2e-3), options=ContinuationOptions(points=60, largest_step=0.1))
    assert mode.branch.method.samples > 4
    assert mode.branch.attributes["sampling_error"] <= 2e-3


def test_modes_without_losses_do_not_hold_the_parameter():
    """xi is zero along them, for any amplitude; the error has that of the period in it."""
    system = masses(between=0.5)
    few, fine = (nonlinear_mode(system, (1e-3, 2.0), 2, observe=("a.p", "y"),
                                method=HarmonicBalance(5, samples, sampling_tolerance=tolerance))
                 for samples, tolerance in ((12, 1e-2), (12, 1e-9)))
    assert few.branch.method.samples == 12
    assert fine.branch.method.samples == 24
    assert fine.branch.attributes["sampling_error"] < 1e-11
    assert fine.amplitude[-1] == pytest.approx(few.amplitude[-1], rel=1e-9)
    off = abs(fine.angular_frequency[-1] / few.angular_frequency[-1] - 1.0)
    assert 0.5 < off / few.branch.attributes["sampling_error"] < 1.0


def test_what_cannot_be_met_is_told(monkeypatch):
    monkeypatch.setattr(branches, "MOST", 100)
    with pytest.raises(AnalysisError, match=r"from its 64 samples is .*, above "
                                            r"sampling_tolerance = 1e-12; raise the tolerance"):
        frequency_response(jenkins_system(), (1.1 / TURN, 1.2 / TURN), method=HarmonicBalance(
            1, 64, stability=None, sampling_tolerance=1e-12),
            options=ContinuationOptions(points=3))
    with pytest.raises(InputError, match="sampling_tolerance = -1"):
        HarmonicBalance(sampling_tolerance=-1.0)


def test_an_orbit_whose_friction_does_not_repeat_has_an_infinite_error(monkeypatch):
    problem, u = orbit(jenkins(1.1), 1, 64)

    def fails(self, u):
        raise AnalysisError("The internal variables do not come to repeat.")

    monkeypatch.setattr(branches, "replace", lambda problem, **changes: type(
        "Failing", (), {"evaluate": fails})())
    assert sampling_error(problem, u, fixed(u)) == np.inf


@pytest.mark.parametrize("count", [1, 23, 25, 47, 48, 1000])
def test_some_points_of_a_branch_are_examined_first_and_up_to_24_in_doubt(count):
    """Few from its begin on, the largest and all folds; then those between them."""
    points = [SimpleNamespace(kind="fold" if number == count - 1 else None, number=number)
              for number in range(count)]
    first, others = ([point.number for point in some]
                     for some in branches._examined(points, count // 3))
    assert {0, count // 3, count - 1} <= set(first)
    assert len(first) <= 6
    assert not set(first) & set(others)
    every = sorted({*first, *others} - {count // 3, count - 1})
    assert min(count, 12) - 2 <= len(every) <= 24
    steps = np.diff([number for number in every if number < count // 3])
    assert (steps == steps[:1]).all()


def test_the_largest_motion_is_examined_not_the_largest_deflection(monkeypatch):
    problem, u = orbit(jenkins(1.1), 1, 64)
    deflected, moving = u.copy(), 1.01 * u
    deflected[0] += 100.0 * np.abs(u).max()
    points = [SimpleNamespace(kind=None, u=at) for at in [u] * 6 + [deflected, moving] + [u] * 16]
    examined = []
    monkeypatch.setattr(branches, "_largest_error", lambda problem, some, points: (
        examined.extend(some) or 0.0))
    branches._error_of_some(problem, points, 1.0)
    assert any(point.u is moving for point in examined)


def response_of_jenkins(lowest, highest):
    return frequency_response(
        jenkins_system(), (lowest / TURN, highest / TURN),
        method=HarmonicBalance(3, stability=None),
        options=ContinuationOptions(points=300, largest_step=0.1)).branches[0]


def test_slip_near_a_resonance_alone_is_found():
    """Far from the resonance the element sticks; the error is that of the resonance by itself."""
    whole, near = response_of_jenkins(0.3, 2.5), response_of_jenkins(1.05, 1.3)
    sizes = np.array([np.abs(point.u[1:3]).max() for point in whole.points])
    assert max(sizes[0], sizes[-1]) < 1.0
    assert sizes.max() > 4.0
    assert near.attributes["sampling_error"] > 1e-5
    assert whole.attributes["sampling_error"] == pytest.approx(
        near.attributes["sampling_error"], rel=0.5)


def test_fewer_points_are_examined_where_nothing_slips(monkeypatch):
    """Errors at rounding need no more than a sixth of the points."""
    examined = []
    monkeypatch.setattr(branches, "sampling_error", lambda problem, u, tangent, least: (
        examined.append(u[-1]) or sampling_error(problem, u, tangent, least)))
    found = response_of_jenkins(2.5, 3.5)
    assert found.attributes["sampling_error"] < 1e-10
    few = len(examined)
    assert 0 < few <= 6
    examined.clear()
    response_of_jenkins(1.05, 1.3)
    assert len(examined) > 2 * few


def test_study_files_have_the_same_key():
    settings = ResponseSettings(bounds=(1.0, 2.0), samples=40, sampling_tolerance=1e-3)
    assert settings.harmonic_balance() == HarmonicBalance(9, 40, sampling_tolerance=1e-3)
    assert settings.harmonic_balance().refines
    assert not replace(settings, sampling_tolerance=None).harmonic_balance().refines
