"""Fits that a study describes: its section, the command, and what goes wrong."""

import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from report_reading import Shown

import fecontact as fc
from fecontact.fitting import (
    FrequencyData,
    LoopData,
    fit_study,
    profile_likelihood,
    study_data,
)
from fecontact.study import FitParameter

STUDY = """
geometry = { shape = "beam", length = 0.1, height = 0.02, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 6, contact_nodes = 4, damping = 0.01 }
normal = { law = "linear", stiffness = 1e7, damping = 0.0 }
friction = { law = "jenkins", stiffness = 5e5, friction_coefficient = 0.2 }
load = { normal = 100.0 }
drive = { stiffness_x = 1e6 }

[fit]
starts = 2

[fit.parameters]
friction.friction_coefficient = { low = 0.05, high = 1.0 }
friction.stiffness = { low = 1e5, high = 1e7, scale = "log" }

[[fit.data]]
kind = "loop"
file = "loop.csv"
channel = "force"
against = "pull"
deviation = 0.5
"""
PULL = 1e-4 * np.concatenate([np.linspace(0.0, 1.0, 12), np.linspace(1.0, -1.0, 23)[1:]])


@pytest.fixture
def study(tmp_path):
    """A study whose friction is 0.4 and 1e6 N/m in the measurement."""
    path = tmp_path / "joint.toml"
    path.write_text(STUDY)
    truth = fc.Study.read(path).with_({"friction.friction_coefficient": 0.4,
                                       "friction.stiffness": 1e6}).system()
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0).predicted(truth)
    force = force + 0.5 * np.random.default_rng(1).standard_normal(len(force))
    rows = "\n".join(f"{k}, {1e3 * x:.9g}, {F:.9g}" for k, (x, F) in enumerate(
        zip(PULL, force, strict=True)))
    (tmp_path / "loop.csv").write_text(f"time [s], pull [mm], force [N]\n{rows}\n")
    return path


def test_a_study_is_fitted(study, cli, tmp_path):
    read = fc.Study.read(study)
    assert fc.Study.from_toml(read.to_toml(), study) == read
    data, = study_data(read)
    assert data.displacement == pytest.approx(PULL)
    found = fit_study(read)
    for name, truth in (("friction.friction_coefficient", 0.4), ("friction.stiffness", 1e6)):
        assert abs(found[name] - truth) < 4.0 * found.deviations[name]
        assert found.deviations[name] < 0.1 * truth
    folder = tmp_path / "found"
    code, out, _ = cli("fit", str(study), "-o", str(folder))
    assert code == 0
    assert "friction.stiffness" in out
    stored = json.loads((folder / "fit.json").read_text())
    assert stored["parameters"]["friction.stiffness"]["value"] == pytest.approx(
        found["friction.stiffness"])
    assert (folder / "fit.png").stat().st_size > 5000
    page = Shown(folder / "fit.html").header
    assert (page["title"], page["good"]) == ("joint", True)
    assert [row[0] for row in page["parameters"]] == list(found.names)
    assert {one["name"] for one in page["study"]} >= {"fit", "fit.parameters.friction.stiffness"}
    before = (folder / "start-0.jsonl").read_text()
    code, out, told = cli("fit", str(study), "-o", str(folder), "--posterior", "30")
    assert code == 0
    assert "posterior, in SI units" in out
    assert "shorter than 50 autocorrelation times" in told
    assert (folder / "posterior.png").stat().st_size > 5000
    assert len(Shown(folder / "fit.html").header["pairs"]) == 1
    chains = json.loads((folder / "fit.json").read_text())["posterior"]
    median = chains["parameters"]["friction.stiffness"]["median"]
    assert abs(median - found["friction.stiffness"]) < 4.0 * found.deviations["friction.stiffness"]
    assert cli("fit", str(study), "-o", str(folder))[0] == 0
    assert (folder / "start-0.jsonl").read_text() == before
    # Another start of the model is another fit.
    code, _, told = cli("fit", str(study), "-o", str(folder), "--set", "load.normal=120")
    assert code == 1
    assert "is of a fit of another model" in told
    assert cli("fit", str(study), "-o", str(folder), "--set", "load.normal=120",
               "--overwrite")[0] == 0


def test_profiles_and_the_posterior_distribution_of_a_study(study, cli, tmp_path):
    text = STUDY.replace("starts = 2", "profile = 5\nposterior = { steps = 6, walkers = 5 }")
    study.write_text(text)
    folder = tmp_path / "found"
    code, out, _ = cli("fit", str(study), "-o", str(folder))
    assert code == 0
    assert "profile likelihood, in SI units" in out
    stored = json.loads((folder / "fit.json").read_text())
    assert stored["posterior"]["walkers"] == 5
    assert stored["posterior"]["steps"] + stored["posterior"]["discarded"] == 6
    for one in stored["profiles"]:
        found, (low, high) = stored["parameters"][one["name"]], one["interval"]
        assert (low, high) == pytest.approx((found["low"], found["high"]),
                                            abs=0.1 * (found["high"] - found["low"]))
    page = Shown(folder / "fit.html").header
    assert (len(page["profiles"]), len(page["marginals"]), len(page["pairs"])) == (2, 2, 1)
    kept = (folder / "profile-friction.stiffness.jsonl").read_text()
    assert cli("fit", str(study), "-o", str(folder))[0] == 0
    assert (folder / "profile-friction.stiffness.jsonl").read_text() == kept
    (folder / "fit.html").write_text("a page of another program")
    code, _, said = cli("fit", str(study), "-o", str(folder))
    assert code == 1
    assert "exists and is no page of fecontact" in said


def test_assemblies_with_other_preloads_are_fitted_together(study, cli, tmp_path):
    """The normal load of the second one multiplies its limit of friction by 1.5."""
    truth = fc.Study.read(study).with_({"friction.friction_coefficient": 0.4, "load.normal": 150.0,
                                        "friction.stiffness": 1e6}).system()
    force = LoopData(PULL, np.zeros(len(PULL)), 1.0).predicted(truth)
    rows = "\n".join(f"{k}, {x:.9g}, {F:.9g}" for k, (x, F) in enumerate(
        zip(PULL, force, strict=True)))
    (tmp_path / "second.csv").write_text(f"time [s], pull [m], force [N]\n{rows}\n")
    second = STUDY.partition("[[fit.data]]")[2].replace("loop.csv", "second.csv")
    study.write_text(f"""{STUDY}name = "first"
[[fit.data]]{second}name = "second"
changes = {{ "load.normal" = 150.0 }}
""")
    found = fit_study(fc.Study.read(study))
    assert found["friction.friction_coefficient"] == pytest.approx(0.4, rel=0.02)
    assert found.chi_square < 1.5 * found.freedom
    study.write_text(study.read_text().replace('"load.normal"', '"load.norml"'))
    code, _, said = cli("fit", str(study))
    assert code == 1
    assert "did you mean 'normal'" in said


def test_material_and_support_from_frequencies(tmp_path):
    """A beam, fixed at one end, with a spring at the other: Young's modulus and the spring."""
    path = tmp_path / "beam.toml"
    text = STUDY.partition("[fit]")[0].replace(
        'material = "steel", thickness = 0.02', 'youngs_modulus = 2e11, poisson_ratio = 0.3, '
        'density = 7800.0, thickness = 0.02, fixed = { right = "xy" }').replace(
        "stiffness_x = 1e6", "stiffness_x = 1e6, stiffness_y = 2e6")
    path.write_text(text)
    truth = fc.Study.read(path)
    hertz = FrequencyData(np.ones(3), 1.0).predicted(truth.with_(
        {"body.youngs_modulus": 2.3e11, "drive.stiffness_y": 7e5}).system())
    found = fc.fit(truth, {"body.youngs_modulus": (1e11, 4e11), "drive.stiffness_y": FitParameter(
        1e5, 1e7, scale="log")}, FrequencyData(hertz, 0.5))
    assert found.estimates == pytest.approx([2.3e11, 7e5], rel=1e-5)


@pytest.mark.long
def test_several_processes_give_the_same(study, tmp_path):
    read = fc.Study.read(study)
    alone, both = fit_study(read), fit_study(read, workers=2, folder=tmp_path / "both")
    assert both.estimates.tolist() == alone.estimates.tolist()
    assert both.covariance.tolist() == alone.covariance.tolist()
    assert [one.evaluations for one in both.starts] == [one.evaluations for one in alone.starts]
    # What other processes evaluated is stored: nothing is left to evaluate.
    again = fit_study(read, folder=tmp_path / "both")
    assert [one.evaluations for one in again.starts] == [0, 0]
    name = "friction.stiffness"
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        profiles = [profile_likelihood(alone, name, points=5),
                    profile_likelihood(alone, name, points=5, executor=pool)]
    assert profiles[0].chi_square.tolist() == profiles[1].chi_square.tolist()


def test_kinds_of_data_of_a_study(study, tmp_path):
    time = np.arange(0.0, 0.5, 1e-3)
    x = np.exp(-9.0 * time) * np.cos(250.0 * time)
    hertz = np.linspace(10.0, 60.0, 21)
    (tmp_path / "decay.csv").write_text("time [s], tip [mm]\n" + "\n".join(
        f"{t:.6f}, {v:.9g}" for t, v in zip(time, x, strict=True)))
    (tmp_path / "test.csv").write_text("f [Hz], H re [m/s^2/N], H im [m/s^2/N]\n" + "\n".join(
        f"{f:.6f}, 1.0, {f:.6f}" for f in hertz))
    text = STUDY.partition("[[fit.data]]")[0] + """
[[fit.data]]
kind = "ring-down"
file = "decay.csv"
t_end = 0.4
initial = [0.0, 1.0]

[[fit.data]]
kind = "backbone"
file = "decay.csv"
window = 8.0
frequency_hz = 40.0

[[fit.data]]
kind = "history"
file = "decay.csv"
deviation = 1e-5
t_start = 0.1
t_end = 0.105
units = { tip = "m" }
initial = { displacements = { B = { x = 2e-4 } } }

[[fit.data]]
kind = "frequencies"
frequencies_hz = [40.0, 90.0]
modes = [1, 3]

[[fit.data]]
kind = "receptance"
file = "test.csv"
excitation = "C"
excitation_component = "y"

[[fit.data]]
kind = "response"
file = "test.csv"
changes = { "drive.amplitude_x" = 1e-4 }
"""
    read = fc.Study.from_toml(text, study)
    assert fc.Study.from_toml(read.to_toml(), study) == read
    kinds = study_data(read)
    decay, backbone, history, frequencies, receptance, response = kinds
    assert decay.curve.frequency_hz == pytest.approx(
        np.full(len(decay.curve), np.hypot(250.0, 9.0) / (2.0 * np.pi)), rel=1e-6)
    assert decay.curve.amplitude.max() < 1e-3
    assert decay.initial.tolist() == [0.0, 1.0]
    assert backbone.curve.damping_ratio == pytest.approx(
        np.full(len(backbone.curve), 9.0 / np.hypot(250.0, 9.0)), rel=1e-5)
    assert history.time[0] == pytest.approx(0.1)
    assert np.abs(history.values).max() > 0.1
    assert history.predicted(read.system())[0] == pytest.approx(2e-4)
    assert frequencies.modes.tolist() == [1, 3]
    assert receptance.kind == "accelerance"
    assert receptance.excitation == ("C", "y")
    assert receptance.measured[21:] == pytest.approx(hertz)
    assert response.amplitude == pytest.approx(np.hypot(1.0, hertz))
    assert response.changes == {"drive.amplitude_x": 1e-4}


@pytest.mark.parametrize(("old", "new", "told"), [
    ("[fit]\nstarts = 2", "[fit]\nstart = 2", "did you mean 'starts'"),
    ("starts = 2", "starts = 0", "starts = 0 must be at least 1"),
    ("low = 0.05", "low = 2.0", "high = 1 must lie above low = 2"),
    ('kind = "loop"', 'kind = "loops"', 'must be "loop"'),
    ("starts = 2", "profile = 3", "profile = 3 must be 0, for none, or at least 5 points"),
    ("starts = 2", "posterior = { steps = 1 }", "steps = 1 must be at least 2"),
    ("starts = 2", "posterior = { walkers = 3 }", "walkers = 3 must be at least 4"),
    ("starts = 2", "posterior = { step = 9 }", "did you mean 'steps'"),
    ("starts = 2", 'loss = "huber"\nposterior = {}', "a posterior distribution needs loss"),
    ('against = "pull"', "", "kind = 'loop' needs the key 'against'"),
    ('"loop.csv"', '"lop.csv"', "there is no such file"),
    ('"force"', '"forc"', "did you mean 'force'"),
    ("deviation = 0.5", "deviation = 0.0", "must be a finite number above zero"),
    ("friction.stiffness = {", "friction.stifness = {", "did you mean 'stiffness'"),
    ('kind = "loop"', 'kind = "history"\nquantity = "total_friction_force"\ninitial = "preload"',
     "needs the section [preload]"),
])
def test_what_is_wrong_in_a_study_is_told(old, new, told, study, cli):
    assert old in STUDY
    study.write_text(STUDY.replace(old, new))
    code, _, said = cli("fit", str(study))
    assert code == 1
    assert told in said
    assert said.count("\n") == 1
    assert not (study.parent / "results").exists()


def changed_table(study, change):
    path = study.parent / "loop.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(change(lines)) + "\n")


def test_channels_of_other_units_are_refused(study, cli):
    study.write_text(STUDY.replace('channel = "force"', 'channel = "pull"'))
    code, _, said = cli("fit", str(study))
    assert code == 1
    assert "channel 'pull' has the unit m, but N is needed here" in said
    study.write_text(STUDY)
    changed_table(study, lambda lines: [lines[0].replace("[mm]", "[km]"), *lines[1:]])
    assert "channel 'pull' has the unit km, but m is needed here" in cli("fit", str(study))[2]


def test_gaps_and_factors_of_a_thousand_are_told(study, cli):
    changed_table(study, lambda lines: [lines[0].replace("[N]", "[kN]"), *lines[1:8], *lines[12:]])
    code, _, said = cli("fit", str(study), "--set", "fit.starts=1")
    assert code == 0
    assert "The times have 1 gap, the first of 5 s after 6 s" in said
    assert "are they in a unit that is 1000 times the SI unit?" in said


def test_rows_without_numbers_are_left_out(study, cli):
    def broken(lines):
        return [lines[0].replace("pull [mm]", "pull"), *(
            line.rpartition(",")[0] + ", nan" if k == 5 else line
            for k, line in enumerate(lines[1:]))]

    changed_table(study, broken)
    code, out, said = cli("fit", str(study), "--set", 'fit.data.0.units.pull="mm"')
    assert code == 0
    assert "In 1 of 34 rows there is no number for 'force', 'pull'; the other rows" in said
    assert "friction.stiffness lies" not in said
    assert "chi square" in out


def test_cells_without_numbers_are_left_out(study, cli):
    """A channel that ends early, and a cell that says that it has none."""
    def broken(lines):
        return [lines[0], *(
            line.rpartition(",")[0] + end for line, end in zip(
                lines[1:], [", n/a", *(f",{line.rpartition(',')[2]}" for line in lines[2:30]),
                            *[","] * 5], strict=True))]

    changed_table(study, broken)
    code, out, said = cli("fit", str(study), "--set", "fit.starts=1")
    assert code == 0
    assert "In 6 of 34 rows there is no number for 'force', 'pull'; the other rows" in said
    assert "chi square" in out


@pytest.mark.parametrize(("delay", "why"), [(0.0, "leave that part out"),
                                            (0.1, "needs even ones")])
def test_the_rest_of_a_fit_goes_on_without_a_broken_decay(study, cli, delay, why):
    """A cell without a number, or a gap in the middle."""
    time = np.arange(0.0, 0.6, 2e-3)
    x = np.exp(-9.0 * time) * np.cos(250.0 * time)
    time[150:] += delay
    if not delay:
        x[150] = np.nan
    (study.parent / "decay.csv").write_text("time [s], tip [m]\n" + "\n".join(
        f"{t:.9f}, {v:.9g}" for t, v in zip(time, x, strict=True)))
    whole, decay = study.read_text(), """
[[fit.data]]
kind = "ring-down"
file = "decay.csv"
channel = "tip"
t_end = 0.6
"""
    study.write_text(whole + decay)
    code, out, said = cli("fit", str(study), "--set", "fit.starts=1")
    assert code == 0
    assert why in said
    assert "[[fit.data]] 1:" in said
    assert "The fit goes on without these data." in said
    assert "chi square" in out
    # Alone it ends the fit, as does a channel that does not exist.
    head, _, _ = whole.partition("[[fit.data]]")
    study.write_text(head + decay)
    assert cli("fit", str(study))[0] == 1
    study.write_text(whole + decay.replace('"tip"', '"tap"'))
    assert cli("fit", str(study))[0] == 1


def test_decays_with_uneven_times_are_resampled(study, cli):
    time = np.arange(0.0, 0.6, 2e-3) + 2e-4 * np.random.default_rng(1).random(300)
    x = np.exp(-9.0 * time) * np.cos(250.0 * time)
    (study.parent / "decay.csv").write_text("time [s], tip [m]\n" + "\n".join(
        f"{t:.9f}, {v:.9g}" for t, v in zip(time, x, strict=True)))
    study.write_text(STUDY.partition("[[fit.data]]")[0] + """
[[fit.data]]
kind = "ring-down"
file = "decay.csv"
t_end = 0.4
""")
    code, _, said = cli("fit", str(study))
    assert code == 1
    assert "or give resample = True" in said
    study.write_text(study.read_text() + "resample = true\n")
    (decay,) = study_data(fc.Study.read(study))
    assert decay.curve.frequency_hz == pytest.approx(
        np.full(len(decay.curve), np.hypot(250.0, 9.0) / (2.0 * np.pi)), rel=1e-4)


def test_displacements_in_another_unit_are_asked_about(study, cli):
    changed_table(study, lambda lines: [lines[0].replace("[mm]", "[m]"), *lines[1:]])
    code, _, said = cli("fit", str(study), "--set", "fit.starts=1")
    assert code == 0
    assert "The motion of 'loop' fits better if it is 0.001 times as large" in said
    changed_table(study, lambda lines: [lines[0].replace("[m]", ""), *lines[1:]])
    assert "channel 'pull' has no unit" in cli("fit", str(study), "--set", "fit.starts=1")[2]


def test_parameters_that_are_hardly_told_apart_are_named(study, cli):
    study.write_text(STUDY.replace("[fit.parameters]", '''[fit.parameters]
load.normal = { low = 30.0, high = 300.0, start = 100.0, scale = "log" }'''))
    code, _, said = cli("fit", str(study), "--set", "fit.starts=1")
    assert code == 0
    assert "load.normal and friction.friction_coefficient" in said


def test_a_study_without_the_section(study, cli):
    study.write_text(STUDY.partition("[fit]")[0])
    code, _, said = cli("fit", str(study))
    assert code == 1
    assert "has no section [fit]" in said
