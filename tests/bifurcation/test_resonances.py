"""Resonances: from a single mode, and over parameters, against closed forms and responses."""

from dataclasses import replace

import numpy as np
import pytest
from oscillators import duffing, jenkins_system
from systems import TURN

import fecontact as fc
from fecontact import io, plot
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    mode_response,
    nonlinear_mode,
    resonance_curve,
)
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.forced_starts import rest_state
from fecontact.bifurcation.harmonic.starts import problem_for
from fecontact.bifurcation.nonlinear_modes.peak_problem import PeakProblem
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.laws import Harmonic
from fecontact.reduction import PolynomialSpring, point_masses

UP = (0.0, 1.0)
FREQUENCY = "load.forces.0.signal.frequency_hz"
RANGE = (0.7 / TURN, 1.5 / TURN)  # of the first peak
FINE = ContinuationOptions(points=3000, largest_step=0.01)


def hardening(damping=0.05, force=0.5):
    """x'' + damping x' + x + .1 x^3 = force sin w t as a contact system."""
    return fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0})},
        links={"a": PolynomialSpring("a.p", None, 1.0, 0.1, damping, UP)},
        load=fc.Load(forces=(fc.PointLoad("a.p", "y", signal=Harmonic(force, 1.0 / TURN)),)))


def describing(X):
    """Parts in phase and lost of one harmonic of the element of ``jenkins_system``."""
    angle = np.arccos(1.0 - 2.0 * np.minimum(2.0 / X, 1.0))
    return (0.5 * X / np.pi * (angle - 0.5 * np.sin(2.0 * angle)),
            4.0 / np.pi * (1.0 - np.minimum(2.0 / X, 1.0)))


def test_resonances_do_not_depend_on_the_points_of_the_mode():
    """Interpolated between these few points the largest amplitudes would be 2e-3 apart."""
    system, method = jenkins_system(), HarmonicBalance(3, 256)
    modes = [nonlinear_mode(system, (1.0, 12.0), method=method, options=options)
             for options in (ContinuationOptions(step=0.3, largest_step=0.5), FINE)]
    assert 5 * len(modes[0]) < len(modes[1])
    few, many = (mode_response(mode, system, levels={"drive.amplitude_x": [0.6, 1.0]})
                 for mode in modes)
    for level in range(2):
        one, other = few.peak(level), many.peak(level)
        assert one.amplitude == pytest.approx(other.amplitude, rel=1e-5)
        assert one.frequency_hz == pytest.approx(other.frequency_hz, rel=1e-6)
        assert one.damping_ratio == pytest.approx(other.damping_ratio, rel=1e-5)
        assert one.solved
        assert other.solved


def test_a_resonance_that_is_interpolated_says_so(monkeypatch):
    """Where no point of the mode is found beside it."""
    def fails(*_):
        raise FecontactError("no solution")

    system = jenkins_system()
    mode = nonlinear_mode(system, (1.0, 12.0), method=HarmonicBalance(3, 256),
                          options=ContinuationOptions(step=0.3, largest_step=0.5))
    right = mode_response(mode, system)
    monkeypatch.setattr("fecontact.bifurcation.nonlinear_modes.mode_response.with_point", fails)
    rough = mode_response(mode, system)
    assert rough.peak().amplitude == pytest.approx(right.peak().amplitude, rel=1e-2)
    assert not rough.peak().solved
    assert "interpolated" in repr(rough)
    assert "interpolated" not in repr(right)


def test_response_of_a_mode_that_sticks_is_linear():
    """F / (1.5 - w^2 + .02 i w), phase included."""
    system = jenkins_system(amplitude=0.02)
    mode = nonlinear_mode(system, (1e-3, 1.9), method=HarmonicBalance(1, 128))
    found = mode_response(mode, system)
    w = TURN * found.frequency_hz()
    linear = 0.02 / (1.5 - w**2 + 0.02j * w)
    assert found.amplitude() == pytest.approx(np.abs(linear), rel=1e-5)
    assert found.phase() == pytest.approx(np.angle(linear), abs=1e-5)
    assert (np.diff(w) > 0.0).all()
    assert w[0] < 0.5
    assert w[-1] > 3.0
    peak = found.peak()
    assert peak.amplitude == pytest.approx(0.02 / (0.02 * np.sqrt(1.5)), rel=1e-5)
    assert TURN * peak.frequency_hz == pytest.approx(np.sqrt(1.5), rel=1e-7)
    assert peak.damping_ratio == pytest.approx(0.01 / np.sqrt(1.5), rel=1e-5)


def test_force_of_a_moving_dashpot_is_that_at_the_frequency_of_the_mode():
    """x'' + .2 x' + x = x0 (sin w t + .2 w cos w t): |P| = .2 w a at w = 1."""
    system = jenkins_system().with_(
        friction=fc.laws.ConstantFriction(0.0),
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.2, amplitude_x=0.02, frequency_hz=1.0 / TURN,
                       dashpots="relative"))
    mode = nonlinear_mode(system, (1e-2, 1.0), method=HarmonicBalance(1, 16))
    peak = mode_response(mode, system).peak()
    assert TURN * peak.frequency_hz == pytest.approx(1.0, rel=1e-7)
    assert peak.amplitude == pytest.approx(0.1 * np.sqrt(1.04), rel=1e-6)


def test_response_of_a_mode_obeys_the_describing_function():
    """[(1 - w^2) X + f_c]^2 + [.02 w X + f_s]^2 = F^2, on both sides of the peaks."""
    system = jenkins_system()
    mode = nonlinear_mode(system, (0.1, 60.0), method=HarmonicBalance(1, 512),
                          options=ContinuationOptions(points=400, largest_step=0.05))
    forces = [0.3, 1.0]
    found = mode_response(mode, system, levels={"drive.amplitude_x": forces})
    for level, force in enumerate(forces):
        w, X = TURN * found.frequency_hz(level), found.amplitude(level)
        elastic, lost = describing(X)
        off = ((1.0 - w**2) * X + elastic, 0.02 * w * X + lost)
        near = 0.3 * X.max() < X
        assert np.count_nonzero(near) > 50
        assert np.hypot(*off)[near] == pytest.approx(force, rel=3e-3)
        assert np.exp(1j * found.phase(level)[near]) == pytest.approx(
            np.exp(-1j * np.arctan2(off[1], off[0])[near]), abs=3e-3)
        # Phase resonance, where the force's work is the loss.
        peak = found.peak(level)
        elastic, lost = describing(np.array([peak.amplitude]))
        w = TURN * peak.frequency_hz
        assert w**2 == pytest.approx(1.0 + elastic[0] / peak.amplitude, rel=2e-5)
        assert 0.02 * w * peak.amplitude + lost[0] == pytest.approx(force, rel=2e-4)
        assert peak.amplitude == pytest.approx(X.max(), rel=1e-4)
    responses = frequency_response(
        system, (1.0 / TURN, 1.3 / TURN), levels={"drive.amplitude_x": forces},
        method=HarmonicBalance(1, 512), options=replace(FINE, locate=False))
    for level in range(2):
        assert found.peak(level).amplitude == pytest.approx(
            responses.amplitude(level).max(), rel=1e-4)


def test_response_of_a_hardening_mode_has_the_peak_of_all_harmonics():
    """The losses of higher harmonics count: without them it would be 0.5 % too high."""
    system = hardening()
    mode = nonlinear_mode(system, (1e-2, 20.0), observe=("a.p", "y"), method=HarmonicBalance(11))
    found = mode_response(mode, system, frequency=FREQUENCY)
    response = frequency_response(
        system, (0.8 / TURN, 2.5 / TURN), FREQUENCY, observe=("a.p", "y"),
        method=HarmonicBalance(11), options=FINE)
    peak, largest = found.peak(), response.amplitude().max()
    assert largest == pytest.approx(5.628, abs=1e-3)
    assert peak.amplitude == pytest.approx(largest, rel=2e-4)
    assert peak.frequency_hz == pytest.approx(response.peak().parameter, rel=3e-4)
    # Backbone and overhanging response: the amplitude turns over.
    w, top = TURN * found.frequency_hz(), int(np.argmax(found.amplitude()))
    assert w[top] > 1.7
    assert (np.diff(w[:top]) > 0.0).all()
    assert w[top:].min() < w[top] - 0.1
    field = contact_field(system, [FREQUENCY])
    upper = response.branches[0].at(field, 1.5 / TURN, 0)
    synthesised = np.interp(1.5, w[:top], found.amplitude()[:top])
    assert upper.values["maximum"][0] == pytest.approx(synthesised, rel=5e-3)


def test_two_resonances_of_a_damper_that_slides_on():
    """Above 4 mu N / pi the force cannot be balanced by sliding, but by the dashpot again."""
    system = jenkins_system(amplitude=1.5)
    mode = nonlinear_mode(system, (0.5, 3.0), method=HarmonicBalance(1, 512))
    found = mode_response(mode, system)
    assert found.resonances == ((),)
    with pytest.raises(InputError, match="follow it to larger ones"):
        found.peak()
    whole = nonlinear_mode(system, (0.5, 60.0), method=HarmonicBalance(1, 512))
    peak = mode_response(whole, system).peak()
    X = peak.amplitude
    assert (0.02 * TURN * peak.frequency_hz * X + describing(np.array([X]))[1][0]
            == pytest.approx(1.5, rel=1e-3))
    assert "resonances" in repr(found)


@pytest.mark.parametrize(("condition", "window"), [
    ("amplitude", 0.0), ("phase", 0.0), ("amplitude", 0.05)])
def test_derivatives_of_the_resonance_are_those_of_its_residual(condition, window):
    system = hardening()
    name, f = "load.forces.0.signal.amplitude", 1.3 / TURN
    field = contact_field(system, [FREQUENCY, name])
    orbit = problem_for(field, field.values_with(**{FREQUENCY: f}), 0, HarmonicBalance(3),
                        np.append(np.ones(field.dimension + 1), 1.0 / TURN))
    orbit = replace(orbit, row=field.displacement_row("a.p", "y"))
    rng = np.random.default_rng(2)
    u = np.concatenate([rng.normal(size=orbit.size), [f, 0.5]])
    problem = PeakProblem(orbit, 1, 1.0, condition,
                          rng.normal(size=orbit.size + 1), rest_state(field, field.values),
                          window=window)
    if window:
        # Both sides lie on the response, near which the orbit must be.
        y = starts.converged_orbit(orbit, np.append(np.zeros(orbit.size), f))[1]
        u[:-1], weights = y, orbit.weights()
        along = orbit.linearise(y).solve(np.eye(len(y))[-1], np.eye(len(y))[-1])
        problem = replace(problem, border=weights * along / np.sqrt(weights @ along**2))
    differences = np.empty((orbit.size + 1, len(u)))
    for k in range(len(u)):
        h = 1e-6 * np.eye(len(u))[k]
        differences[:, k] = (problem.linearise(u + h).residual
                             - problem.linearise(u - h).residual) / 2e-6
    found = problem.linearise(u).condensed
    assert found == pytest.approx(differences, abs=3e-7 * np.abs(differences).max())


def test_peaks_of_one_harmonic_of_a_hardening_spring():
    """dA/dW = 0 of [(1 - W^2) A + .075 A^3]^2 + (.05 W A)^2 = P^2: W^2 = 1 + .075 A^2 - .05^2 / 2.
    """
    found = resonance_curve(duffing(), (0.02, 0.5), "P", (0.6, 1.8), frequency="W",
                            method=HarmonicBalance(1))
    A, W = found.amplitude, TURN * found.frequency_hz
    assert found.parameter[[0, -1]] == pytest.approx([0.02, 0.5], rel=1e-12)
    assert pytest.approx(1.0 + 0.075 * A**2 - 0.00125, rel=1e-8) == W**2
    assert found.parameter == pytest.approx(A * np.hypot(0.00125, 0.05 * W), rel=3e-8)
    assert np.ptp(W) > 0.4


def test_peaks_are_those_of_responses():
    found = resonance_curve(duffing(), (0.02, 0.3), "P", (0.6, 1.8), frequency="W",
                            options=ContinuationOptions(points=100, largest_step=0.1))
    some = slice(None, None, 8)
    response = frequency_response(duffing(), (0.6, 1.8), "W",
                                  levels={"P": found.parameter[some]}, options=FINE)
    for level, (amplitude, frequency) in enumerate(zip(
            found.amplitude[some], TURN * found.frequency_hz[some], strict=True)):
        largest = response.amplitude(level).max()
        assert largest * (1.0 - 1e-7) < amplitude < largest * (1.0 + 3e-5)
        assert frequency == pytest.approx(response.peak(level).parameter, abs=3e-4)
    assert found.branch.points[0].orbit().period == pytest.approx(1.0 / found.frequency_hz[0])
    assert np.abs(found.harmonic(3)[-1]) > 0.02


@pytest.fixture(scope="module")
def damper():
    """A mass with a Jenkins element and no other damping, over its normal load."""
    system = jenkins_system().with_(**{"drive.damping_x": 0.0})
    return system, resonance_curve(
        system, (1.2, 3.0), "normal.force", RANGE, condition="phase",
        method=HarmonicBalance(1, 512), options=ContinuationOptions(points=60))


def test_optimal_load_of_a_friction_damper(damper):
    """4 S (X - S / k) = pi F X: the amplitude at resonance, least at S = pi F / 2."""
    system, found = damper
    S, X = found.parameter, np.abs(found.harmonic())
    assert pytest.approx(S**2 / (0.5 * (S - np.pi / 4.0)), rel=2e-4) == X
    best = found.optimum()
    assert best.kind == "extremum"
    assert best.parameter == pytest.approx(np.pi / 2.0, rel=2e-4)
    assert best.values["observed_amplitude"] == pytest.approx(2.0 * np.pi, rel=2e-4)
    some = slice(None, None, 8)
    response = frequency_response(
        system, (1.05 / TURN, 1.2 / TURN), levels={"normal.force": S[some]},
        method=HarmonicBalance(1, 512), options=replace(FINE, locate=False))
    for level, amplitude in enumerate(found.amplitude[some]):
        assert amplitude == pytest.approx(response.amplitude(level).max(), rel=1e-4)


@pytest.mark.parametrize("samples", [128, pytest.param(512, marks=pytest.mark.slow)])
def test_peak_with_memory_is_that_of_responses(damper, samples):
    """The closed form of the best load, and the largest amplitude of responses on its way."""
    system, _ = damper
    method = HarmonicBalance(1, samples)
    found = resonance_curve(system, (1.2, 3.0), "normal.force", RANGE, method=method,
                            options=ContinuationOptions(points=60))
    assert found.condition == "amplitude"
    assert found.parameter[-1] == pytest.approx(3.0, rel=1e-12)
    S, X = found.parameter, np.abs(found.harmonic())
    assert pytest.approx(S**2 / (0.5 * (S - np.pi / 4.0)), rel=10.0 / samples**1.5) == X
    assert found.optimum().parameter == pytest.approx(np.pi / 2.0, rel=3e-3)
    some = slice(None, None, 8)
    response = frequency_response(
        system, (1.05 / TURN, 1.2 / TURN), levels={"normal.force": S[some]},
        method=method, options=replace(FINE, locate=False))
    for level, (amplitude, f) in enumerate(zip(
            found.amplitude[some], found.frequency_hz[some], strict=True)):
        assert amplitude == pytest.approx(response.amplitude(level).max(), rel=2e-4)
        assert f == pytest.approx(response.peak(level).parameter, rel=6e-4)


def test_peak_with_memory_is_that_of_runs():
    """Runs at the frequency of the peak and beside it, of a damper with dashpot."""
    system = jenkins_system().with_(**{"drive.damping_x": 0.1})
    found = resonance_curve(system, (1.2, 1.4), "normal.force", RANGE,
                            method=HarmonicBalance(7, 512),
                            options=ContinuationOptions(points=60))
    amplitude, f = found.amplitude[-1], found.frequency_hz[-1]
    sizes = []
    for factor in (0.985, 1.0, 1.015):
        driven = system.with_(**{"normal.force": 1.4, "drive.frequency_hz": factor * f})
        T = 1.0 / (factor * f)
        run = fc.simulate(driven, 61.0 * T, rtol=1e-8, outputs=61 * 500 + 1)
        sizes.append(0.5 * np.ptp(run.displacement("B")[-501:, 0]))
    assert sizes[1] == pytest.approx(amplitude, rel=3e-4)
    # The peak of a parabola through the three runs.
    below, peak, above = sizes
    place = 0.5 * (below - above) / (below - 2.0 * peak + above)
    assert abs(place) * 0.015 < 2e-3
    assert max(below, above) < 0.9995 * peak


def test_backbone_of_phase_resonance_is_the_mode(damper):
    """Over the force, resonances of one harmonic have amplitude and frequency of the mode."""
    system = jenkins_system()
    method = HarmonicBalance(1, 512)
    backbone = resonance_curve(system, (0.1, 1.2), "drive.amplitude_x",
                               (0.8 / TURN, 1.5 / TURN), condition="phase", method=method)
    mode = nonlinear_mode(system, (0.5, 60.0), method=method,
                          options=ContinuationOptions(points=500, largest_step=0.03))
    # The phase is that of the driven end's force: also with the dashpot.
    expected = np.interp(backbone.amplitude, mode.amplitude, mode.frequency_hz)
    assert backbone.frequency_hz == pytest.approx(expected, rel=2e-4)
    assert np.ptp(backbone.frequency_hz) > 0.02


def test_files_and_pictures(damper, tmp_path):
    _, found = damper
    path = io.write_resonance_curve(tmp_path / "curve.h5", found)
    again = io.read_resonance_curve(path)
    assert repr(again) == repr(found)
    assert (again.amplitude == found.amplitude).all()
    assert again.optimum().parameter == found.optimum().parameter
    with pytest.raises(InputError, match="nonlinear mode"):
        io.read_mode(path)
    figure = plot.plot_resonance_curve([found, found], names=["a", "b"], path=tmp_path / "c.png")
    upper, lower = figure.axes
    assert upper.lines[0].get_ydata() == pytest.approx(found.amplitude)
    assert lower.get_xlabel().startswith("normal force")
    texts = [text.get_text() for text in upper.get_legend().get_texts()]
    assert texts == ["a", "b", "extremum"]
    with pytest.raises(InputError, match="no curves"):
        plot.plot_resonance_curve([])


@pytest.mark.parametrize(("changes", "told"), [
    ({"condition": "size"}, "condition"),
    ({"parameter": "W"}, "both 'W'"),
    ({"parameter": "Q"}, "Q"),
    ({"condition": "phase"}, "needs a contact system"),
    ({"start": 7.0}, "outside the bounds")])
def test_bad_arguments(changes, told):
    given = {"bounds": (0.02, 0.1), "parameter": "P", "frequencies": (0.6, 1.8),
             "frequency": "W", **changes}
    with pytest.raises(InputError, match=told):
        resonance_curve(duffing(), **given)


def test_what_has_no_peak_is_told():
    with pytest.raises(AnalysisError, match="no peak between"):
        resonance_curve(duffing(), (0.02, 0.1), "P", (0.3, 0.6), frequency="W")
    mode = nonlinear_mode(hardening(), (1e-2, 1.0), observe=("a.p", "y"))
    with pytest.raises(InputError, match="1 modal coordinates, but the system 2"):
        mode_response(mode, fc.ContactSystem(
            bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})},
            links={"a": PolynomialSpring("a.p", "b.p", 1.0, 0.1, direction=UP)}))
    with pytest.raises(InputError, match="Nothing excites"):
        mode_response(mode, hardening(force=0.0), frequency=FREQUENCY)
