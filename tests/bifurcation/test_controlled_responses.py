"""Responses at held amplitudes and held phases, against closed forms and free responses."""

import csv

import numpy as np
import pytest
from oscillators import duffing, jenkins_amplitude, jenkins_system
from response_study import STUDY, linear_amplitude
from systems import TURN
from test_list_of_harmonics import hardening

from fecontact import Study
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    controlled_response,
    frequency_response,
    resonance_curve,
)
from fecontact.core.errors import AnalysisError, InputError
from fecontact.io import read_response

STEPS = ContinuationOptions(points=400, largest_step=0.1)


def controlled(system, bounds, amplitudes, **options):
    return controlled_response(system, bounds, amplitudes, "drive.amplitude_y", observe=("B", "y"),
                               **{"options": STEPS, **options})


def test_force_of_one_harmonic():
    """The force that holds an amplitude, in closed form, on both sides of two free folds."""
    found = controlled(hardening(), (0.7 / TURN, 1.6 / TURN), [0.5, 3.0], method=HarmonicBalance(1))
    assert found.level_name == "amplitude"
    assert found.force_name == "drive.amplitude_y"
    for level, a in enumerate((0.5, 3.0)):
        w, force = TURN * found.branches[level].parameter, found.force(level)
        assert found.branches[level].parameter[[0, -1]].tolist() == [0.7 / TURN, 1.6 / TURN]
        assert found.branches[level].status is BranchStatus.BOUND
        np.testing.assert_allclose(found.amplitude(level), a, rtol=1e-6)
        exact = a * np.hypot(1.0 - w**2 + 0.075 * a**2, 0.05 * w)
        np.testing.assert_allclose(force, exact, rtol=5e-6)
        assert found.peak_reached(level)
        # Smallest force: w^2 = 1 + .075 a^2 - .05^2 / 2.
        assert TURN * found.peak(level).parameter == pytest.approx(
            np.sqrt(1.0 + 0.075 * a**2 - 0.00125), abs=0.03)


def test_orbits_are_those_of_free_responses():
    """A held amplitude and a given force meet at the same frequencies, stable and unstable."""
    method, a, force = HarmonicBalance(7, 64), 2.5, 0.18

    def meets(name, wanted):
        return {"options": ContinuationOptions(
            points=600, largest_step=0.1, events={"met": lambda found: found[name] - wanted})}

    held = controlled(hardening(), (1.0 / TURN, 1.8 / TURN), [a], method=method,
                      **meets("drive.amplitude_y", force)).branches[0].of_kind("met")
    free = frequency_response(
        hardening(force=force), (0.8 / TURN, 1.6 / TURN), method=method, observe=("B", "y"),
        **meets("observed_amplitude", a)).branches[0].of_kind("met")
    assert len(held) == len(free) == 2
    for one, other in zip(sorted(held, key=lambda point: point.parameter),
                          sorted(free, key=lambda point: point.parameter), strict=True):
        assert one.parameter == pytest.approx(other.parameter, rel=1e-6)
        assert one.values["stable"] == other.values["stable"]
        np.testing.assert_allclose(np.sort(np.abs(one.values["multipliers"])),
                                   np.sort(np.abs(other.values["multipliers"])), rtol=1e-4)
    assert {bool(point.values["stable"]) for point in held} == {True, False}


@pytest.mark.slow
def test_force_of_a_friction_damper():
    """One harmonic of a Jenkins element, against its describing function."""
    found = controlled_response(
        jenkins_system(), (1.05 / TURN, 1.25 / TURN), [3.0, 6.0], options=STEPS,
        method=HarmonicBalance(1, 512, stability=None))
    for level, a in enumerate((3.0, 6.0)):
        for point in found.branches[level].points[::5]:
            force = point.values["drive.amplitude_x"]
            assert jenkins_amplitude(TURN * point.parameter, force) == pytest.approx(a, rel=1e-3)
        assert "stable" not in found.branches[level].points[0].values


def test_vector_fields_and_other_parameters():
    """Duffing's oscillator over its frequency, and a held amplitude over the damping."""
    found = controlled_response(duffing(), (0.7, 0.9), 0.474872, "P", "W", observe=[1.0, 0.0],
                                options=STEPS, start=0.8)
    there = found.branches[0].points[int(np.argmin(np.abs(found.branches[0].parameter - 0.8)))]
    assert there.parameter == 0.8
    assert there.values["P"] == pytest.approx(0.18, rel=2e-3)
    over = controlled(hardening(), (0.05, 0.2), [1.0], parameter="drive.damping_y",
                      method=HarmonicBalance(1))
    exact = np.hypot(1.0 - 0.64 + 0.075, 0.8 * over.branches[0].parameter)
    # The dashpot of the drive is moved with its spring.
    np.testing.assert_allclose(over.force(), exact, rtol=2e-6)


@pytest.mark.parametrize("lag", [0.5 * np.pi, 0.25 * np.pi, 2.5])
def test_held_phases(lag):
    """w^2 and F of one harmonic whose displacement is an angle behind the force, closed forms."""
    curve = resonance_curve(
        hardening(force=0.02), (0.02, 0.3), "drive.amplitude_y", (0.7 / TURN, 1.6 / TURN),
        observe=("B", "y"), condition="phase", lag=lag, method=HarmonicBalance(1), options=STEPS)
    w, a, force = TURN * curve.frequency_hz, curve.amplitude, curve.parameter
    np.testing.assert_allclose(0.05 * w * a, force * np.sin(lag), rtol=1e-6)
    np.testing.assert_allclose((1.0 - w**2 + 0.075 * a**2) * a, force * np.cos(lag), rtol=0.0,
                               atol=1e-6)
    field = contact_field(hardening(), ["drive.frequency_hz", "drive.amplitude_y"])
    run = curve.branch.points[3].trajectory(field)
    assert run.time[-1] == pytest.approx(2.0 * np.pi / w[3])


@pytest.mark.parametrize(("change", "told"), [
    ({"amplitudes": []}, "must be one or several numbers above zero"),
    ({"amplitudes": [1.0, 0.0]}, "must be one or several numbers above zero"),
    ({"amplitudes": "a"}, "amplitudes"),
    ({"force": "drive.frequency_hz"}, "parameter and force are both"),
    ({"force": "drive.amplitud_y"}, "did you mean 'drive.amplitude_y'"),
    ({"force": 1}, "force"),
    ({"method": 3}, "method"),
])
def test_bad_arguments(change, told):
    known = {"system": hardening(), "bounds": (0.7 / TURN, 0.8 / TURN), "amplitudes": [0.5],
             "force": "drive.amplitude_y", "observe": ("B", "y")}
    with pytest.raises(InputError, match=told):
        controlled_response(**known | change)


def test_amplitudes_and_phases_that_are_not_reached():
    with pytest.raises(AnalysisError, match=r"0\.5 was not reached at drive\.frequency_hz"):
        controlled_response(hardening(), (0.7 / TURN, 0.8 / TURN), [0.5], "normal.stiffness",
                            observe=("B", "y"))
    with pytest.raises(InputError, match="lag = 4 must be an angle between 0 and pi rad"):
        resonance_curve(hardening(), (0.1, 0.2), "drive.amplitude_y", (0.7 / TURN, 1.4 / TURN),
                        lag=4, observe=("B", "y"))
    with pytest.raises(InputError, match="those of controlled_response are held"):
        frequency_response(hardening(), (0.7 / TURN, 0.8 / TURN), observe=("B", "y")).force()


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("how", ["options", "section"])
def test_command(cli, file, how):
    """The force that holds a small amplitude of a block that sticks, from a study."""
    if how == "options":
        code, said, _ = cli("response", file, "--amplitudes", "1e-6,2e-6")
    else:
        code, said, _ = cli("response", file, "--set", "response.levels={}", "--set",
                            "response.amplitudes=[1e-6,2e-6]", "--set",
                            'response.force="drive.amplitude_x"')
    assert code == 0
    assert "drive amplitude x" in said
    found = read_response(file.parent / "results" / "block-response.h5")
    w = TURN * found.branches[0].parameter
    assert found.levels.tolist() == [1e-6, 2e-6]
    exact = 1e-6 / linear_amplitude(w, 1.0, Study.read(file))
    assert found.force(0) == pytest.approx(exact, rel=5e-4)
    assert found.force(1)[0] == pytest.approx(2.0 * exact[0], rel=2e-4)
    with (file.parent / "results" / "block-response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[0]["force"]) == pytest.approx(exact[0], rel=2e-4)
    code, _, _ = cli("plot", file.parent / "results" / "block-response.h5", "phase", "--branch", 1)
    assert code == 0


@pytest.mark.parametrize(("changes", "told"), [
    (["--amplitudes", "1e-6,,2"], "--amplitudes 1e-6,,2 must be numbers with commas"),
    (["--amplitudes", "0"], "[response]: amplitudes = [0.0] must be a list of numbers above zero"),
    (["--amplitudes", "1", "--levels", "load.normal=1"], "are held, so that the force has no"),
    (["--amplitudes", "1", "--method", "shooting"], "cannot hold amplitudes; take 'harmonic bal"),
    (["--force", "drive.amplitude_x"], "is the level that is free where amplitudes are held"),
    (["--amplitudes", "1", "--force", "drive.frequency_hz"], "over which the responses go"),
    (["--amplitudes", "1e-6", "--force", "drive.amplitud_x"], "did you mean 'drive.amplitude_x'"),
])
def test_bad_settings(cli, file, changes, told):
    code, _, said = cli("response", file, *changes)
    assert code == 1
    assert told in said
    assert said.count("\n") == 1
