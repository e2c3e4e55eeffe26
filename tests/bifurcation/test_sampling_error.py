"""Errors that few samples a period make, against describing functions and finer sampling."""

from dataclasses import replace

import numpy as np
import pytest
from oscillators import duffing, jenkins, jenkins_amplitude, jenkins_system, unilateral

from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    frequency_response,
    nonlinear_mode,
)
from fecontact.bifurcation.harmonic import branches
from fecontact.bifurcation.harmonic.branches import sampling_error
from fecontact.bifurcation.harmonic.starts import corrected, problem_for
from fecontact.bifurcation.response_options import ResponseSettings
from fecontact.core.errors import AnalysisError, InputError


def orbit(field, harmonics, samples, **values):
    """The orbit that Newton's method finds from rest."""
    p = field.values_with(**values)
    problem = problem_for(field, p, 0, HarmonicBalance(harmonics, samples),
                          np.ones(field.dimension + 2))
    return corrected(problem, np.append(np.zeros(problem.size), p[0]))


def exact(w):
    """Complex amplitude X of x = Re(X exp(i w t)) under sin w t, by the describing function."""
    A = jenkins_amplitude(w)
    turned = np.arccos(1.0 - 4.0 / A)
    stiffness = 0.5 / np.pi * (turned - np.sin(2.0 * turned) / 2.0)
    loss = 4.0 / np.pi * (1.0 - 2.0 / A) / A
    return -1j / (1.0 - w * w + stiffness + 1j * (0.02 * w + loss))


@pytest.mark.parametrize("w", [1.05, 1.1, 1.2, 1.3])
@pytest.mark.parametrize("samples", [32, 64, 128, 512])
def test_it_is_the_distance_to_the_describing_function(w, samples):
    problem, u = orbit(jenkins(w), 1, samples)
    off = abs(u[1] - 1j * u[2] - exact(w)) / abs(exact(w))
    assert 0.5 * off < sampling_error(problem, u) < 2.0 * off


def test_it_is_that_of_a_contact_with_separation():
    """Against sixteen times as many samples; corners lie anywhere between two of them."""
    field = unilateral(1.3)
    for samples in (64, 128, 256):
        problem, u = corrected(problem_for(
            field, field.values, 0, HarmonicBalance(5, samples), np.ones(4)), np.append(
                [0.0, 0.0, 2.0, *np.zeros(8)], 1.3))
        _, fine = corrected(replace(problem, samples=16 * samples), u)
        off = np.sqrt(((u - fine)[1:-1] ** 2).sum() / (fine[1:-1] ** 2).sum())
        assert 0.3 * off < sampling_error(problem, u) < 3.0 * off


def test_smooth_forces_have_none_but_aliasing():
    """Products of three harmonics are exact above 4 H samples."""
    problem, u = orbit(duffing(), 5, 24, W=0.9)
    assert sampling_error(problem, u) < 1e-10
    problem, u = orbit(duffing(), 5, 14, W=0.9, P=2.0)
    _, fine = orbit(duffing(), 5, 64, W=0.9, P=2.0)
    off = np.sqrt(((u - fine)[1:-1] ** 2).sum() / (fine[1:-1] ** 2).sum())
    assert off > 1e-6
    assert sampling_error(problem, u) == pytest.approx(4.0 / 3.0 * off, rel=0.02)


@pytest.mark.parametrize("stability", [None, "transitions"])
def test_samples_are_doubled_until_a_response_is_accurate(stability):
    found = frequency_response(
        jenkins_system(), (1.05, 1.3), method=HarmonicBalance(
            1, 32, stability=stability, sampling_tolerance=1e-3),
        options=ContinuationOptions(points=60, largest_step=0.1)).branches[0]
    samples = found.attributes["samples"]
    assert samples in (128, 256)
    assert found.attributes["sampling_error"] < 1e-3
    off = [abs(point.u[1] - 1j * point.u[2] - exact(point.parameter)) / abs(exact(point.parameter))
           for point in found.points[::6]]
    assert max(off) < 1.5e-3
    assert max(off) > 0.3 * found.attributes["sampling_error"]
    # Half as many do not suffice, and a start with enough is kept.
    fewer, same = (frequency_response(
        jenkins_system(), (1.05, 1.3), method=HarmonicBalance(
            1, count, stability=stability, sampling_tolerance=tolerance),
        options=ContinuationOptions(points=60, largest_step=0.1)).branches[0]
        for count, tolerance in ((samples // 2, 0.5), (samples, 1e-3)))
    assert fewer.attributes["sampling_error"] > 1e-3
    assert same.attributes["samples"] == samples
    assert same.attributes["sampling_error"] == pytest.approx(
        found.attributes["sampling_error"], rel=0.3)


def test_harmonics_and_samples_grow_together():
    found = frequency_response(
        jenkins_system(), (1.15, 1.2), method=HarmonicBalance(
            1, 16, tolerance=2e-3, sampling_tolerance=5e-3, stability=None),
        options=ContinuationOptions(points=4)).branches[0]
    assert found.column("truncation_error").max() <= 2e-3
    assert found.attributes["sampling_error"] <= 5e-3
    assert found.attributes["harmonics"] > 2
    assert found.attributes["samples"] > 16 * found.attributes["harmonics"]


def test_modes_get_samples_enough_too():
    mode = nonlinear_mode(jenkins_system(), (2.5, 6.0), method=HarmonicBalance(
        1, 32, sampling_tolerance=2e-3), options=ContinuationOptions(points=60, largest_step=0.1))
    assert mode.branch.attributes["samples"] > 32
    assert mode.branch.attributes["sampling_error"] <= 2e-3


def test_what_cannot_be_met_is_told(monkeypatch):
    monkeypatch.setattr(branches, "MOST", 100)
    with pytest.raises(AnalysisError, match=r"from its 64 samples is .*, above "
                                            r"sampling_tolerance = 1e-12; raise the tolerance"):
        frequency_response(jenkins_system(), (1.1, 1.2), method=HarmonicBalance(
            1, 64, stability=None, sampling_tolerance=1e-12),
            options=ContinuationOptions(points=3))
    with pytest.raises(InputError, match="sampling_tolerance = -1"):
        HarmonicBalance(sampling_tolerance=-1.0)


def test_an_orbit_whose_friction_does_not_repeat_has_an_infinite_error(monkeypatch):
    problem, u = orbit(jenkins(1.1), 1, 64)

    def fails(self, u):
        raise AnalysisError("The internal variables do not come to repeat.")

    monkeypatch.setattr(branches, "replace", lambda problem, **changes: type(
        "Failing", (), {"linearise": fails})())
    assert sampling_error(problem, u) == np.inf


def test_study_files_have_the_same_key():
    settings = ResponseSettings(bounds=(1.0, 2.0), samples=40, sampling_tolerance=1e-3)
    assert settings.method() == HarmonicBalance(9, 40, sampling_tolerance=1e-3)
    assert settings.method().refines
    assert not replace(settings, sampling_tolerance=None).method().refines
