"""The command `fecontact response` and the section [response] of a study."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from response_study import STUDY, linear_amplitude, study
from systems import TURN

from fecontact import Study
from fecontact.bifurcation import BranchStatus, ResponseSettings, responses
from fecontact.bifurcation.responses import follow_responses
from fecontact.cli.console import INTERRUPTED
from fecontact.cli.orbit_files import OrbitChoice, stored_orbit_or_run
from fecontact.cli.response_results import keep_response
from fecontact.core.errors import InputError
from fecontact.io import read_mode, read_response, read_system


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


def test_response_of_a_block_held_by_friction(cli, file):
    code, said, _ = cli("response", file)
    assert code == 0
    results = file.parent / "results"
    found, described = read_response(results / "block-response.h5"), Study.read(file)
    assert found.level_name == "drive.amplitude_x"
    assert found.levels == pytest.approx([2e-5, 3e-4])
    assert found.observed == "B x"
    frequencies = found.branches[0].parameter
    assert frequencies[[0, -1]] == pytest.approx([8.0, 13.0])
    w = TURN * frequencies
    # The small drive never makes it slide.
    assert found.amplitude(0) == pytest.approx(linear_amplitude(w, 2e-5, described), rel=2e-4)
    assert found.amplitude(1).max() < 0.5 * linear_amplitude(w, 3e-4, described).max()
    for level in range(2):
        assert f"{found.peak(level).parameter:.7g}" in said
    with (results / "block-response.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert len(rows) == sum(map(len, found.branches))
    stored = [float(row["amplitude"]) for row in rows if float(row["level"]) == 2e-5]
    assert stored == pytest.approx(found.amplitude(0), rel=1e-12)
    stored = [float(row["frequency_hz"]) for row in rows if float(row["level"]) == 2e-5]
    assert stored == pytest.approx(frequencies, rel=1e-12)
    for ending in ("png", "html"):
        assert (results / f"block-response.{ending}").stat().st_size > 10_000
    assert read_system(results / "block-response.h5").drive.stiffness_x == 5610.0


@pytest.mark.slow
def test_template_of_responses(cli, file):
    """The smallest level sticks throughout; larger ones slide, at lower frequencies."""
    code, said, _ = cli("init", "held.toml", "--shape", "response")
    assert code == 0
    assert "next: fecontact response held.toml" in said
    described = Study.read(file.parent / "held.toml")
    assert described.response.levels["drive.amplitude_x"] == (5e-5, 2e-4, 4e-4, 8e-4)
    code, said, _ = cli("response", "held.toml", "--levels", "drive.amplitude_x=5e-5,4e-4")
    assert code == 0
    found = read_response(file.parent / "results" / "held-response.h5")
    frequencies = found.branches[0].parameter
    assert frequencies[[0, -1]] == pytest.approx([4.0, 13.0])
    w = TURN * frequencies
    assert found.amplitude(0) == pytest.approx(linear_amplitude(w, 5e-5, described), rel=2e-4)
    assert found.amplitude(1).max() < 0.4 * linear_amplitude(w, 4e-4, described).max()
    assert found.peak(1).parameter < 0.95 * found.peak(0).parameter
    assert all(branch.status is BranchStatus.BOUND for branch in found.branches)
    code, said, _ = cli("modes", "held.toml", "--nonlinear", 1, "--amplitudes", 1e-4, 5e-4)
    assert code == 0
    assert "10.7133" in said


def test_command_line_overrides_the_section(cli, file):
    code, _, _ = cli("response", file, "--bounds", 9, 10, "--levels", "load.normal=10,20",
                     "--harmonics", 1, "--samples", 64, "-o", "there")
    assert code == 0
    found = read_response(file.parent / "there" / "block-response.h5")
    assert found.level_name == "load.normal"
    assert found.levels == pytest.approx([10.0, 20.0])
    assert found.branches[0].method.highest == 1
    assert found.branches[0].method.samples == 64
    assert found.branches[0].parameter[[0, -1]] == pytest.approx([9.0, 10.0])


@pytest.mark.slow
def test_a_list_of_harmonics(cli, file):
    """The list is given by option, by the section, and for modes; the file holds the list."""
    for how in (["--harmonics", "0,1,3"], ["--set", "response.harmonics=[0,1,3]"]):
        assert cli("response", file, "--bounds", 9, 9.5, "--samples", 64, *how)[0] == 0
        found = read_response(file.parent / "results" / "block-response.h5")
        assert list(found.branches[0].method.orders) == [0, 1, 3]
        assert not found.harmonic(2).any()
        assert found.harmonic(3).any()
    assert cli("modes", file, "--nonlinear", 1, "--amplitudes", 1e-6, 1e-5, "--set",
               "response.harmonics=[0,1,3]")[0] == 0
    mode = read_mode(file.parent / "results" / "block-mode-1.h5")
    assert list(mode.branch.method.orders) == [0, 1, 3]


def test_another_parameter_than_the_frequency(cli, file):
    code, said, _ = cli("response", file, "drive.amplitude_x", "--bounds", 1e-5, 1e-4, "--set",
                        "response.levels={}")
    assert code == 0
    found = read_response(file.parent / "results" / "block-response.h5")
    exact = linear_amplitude(50.0, found.branches[0].parameter, Study.read(file))
    assert found.amplitude() == pytest.approx(exact, rel=2e-4)
    assert "drive.amplitude_x" in said


class _Interrupts:
    """A progress that presses Ctrl-C at a point of a level."""

    def __init__(self, title, points):
        self.title, self.points, self.count = title, points, 0

    def __call__(self, title, part):
        self.count += title == self.title
        if self.count > self.points:
            raise KeyboardInterrupt


@pytest.mark.parametrize("points", [0, 1, 5, 12])
def test_resumed_response_has_the_numbers_of_an_uninterrupted_one(points, file, cli):
    """Before the second level has a point, and in the middle of it."""
    described = study()
    system, wanted = described.system(), described.response
    parts = []
    found = follow_responses(system, wanted, _Interrupts("drive.amplitude_x = 0.0003", points),
                             keep=parts.append)
    assert found.interrupted
    assert len(found.response.branches) == (2 if points else 1)
    assert len(parts[0].branches) == 1
    if points:
        assert found.response.branches[1].status is BranchStatus.INTERRUPTED
        assert len(found.response.branches[1]) == points
    (file.parent / "results").mkdir()
    stored = keep_response(Study.read(file), found.response, file.parent / "results")
    before = found.response.branches[0]
    code, _, _ = cli("response", file, "--resume")
    assert code == 0
    resumed, whole = read_response(stored), follow_responses(system, wanted).response
    assert resumed.levels == pytest.approx(whole.levels)
    assert np.array_equal(resumed.branches[0].parameter, before.parameter)
    assert resumed.branches[1].status is BranchStatus.BOUND
    for one, other in zip(resumed.branches, whole.branches, strict=True):
        assert len(one) == len(other)
        for a, b in zip(one.points, other.points, strict=True):
            assert (a.u == b.u).all()
            assert (a.tangent == b.tangent).all()
            assert a.kind == b.kind
            assert all(np.array_equal(a.values[name], b.values[name]) for name in b.values)


def test_an_interrupted_response_tells_how_to_go_on(cli, file, monkeypatch):
    follow = responses.follow_responses

    def interrupted(system, wanted, progress, *rest):
        return follow(system, wanted, _Interrupts("drive.amplitude_x = 0.0003", 5), *rest)

    with monkeypatch.context() as patch:
        patch.setattr(responses, "follow_responses", interrupted)
        code, said, _ = cli("response", file)
    assert code == INTERRUPTED
    assert "was interrupted" in said
    assert "go on with --resume" in " ".join(said.split())
    code, said, _ = cli("response", file, "--resume")
    assert code == 0
    assert "was interrupted" not in said


def test_points_that_run_out_before_the_peak(cli, file):
    """The last point is no peak; a note says where the branch ends and how to go on."""
    few = ("--bounds", 9, 13, "--set", "response.points=4")
    code, said, _ = cli("response", file, *few)
    assert code == 0
    found = read_response(file.parent / "results" / "block-response.h5")
    assert not any(found.peak_reached(level) for level in range(2))
    rows = [line for line in said.splitlines() if "stable" in line]
    assert len(rows) == 2
    assert all("largest" in row and "peak" not in row for row in rows)
    for level, branch in zip(("2e-05", "0.0003"), found.branches, strict=True):
        assert f"note: drive.amplitude_x = {level}: {branch.end} Its peak may lie beyond." in said
        assert "raise points = 4 to go on" in branch.end
    summary = dict(found.summary())
    assert summary["peak"].startswith("perhaps not reached at 2e-05, 0.0003: ")
    assert cli("response", file, *few[:3], "--levels", "drive.amplitude_x=2e-5")[0] == 0
    whole = read_response(file.parent / "results" / "block-response.h5")
    assert whole.peak_reached()
    assert "peak" not in dict(whole.summary())
    # Beyond where a branch stops there may be a larger one.
    for status in (BranchStatus.STALLED, BranchStatus.POINTS):
        cut = replace(whole, branches=(replace(whole.branches[0], status=status),))
        assert not cut.peak_reached()
        assert dict(cut.summary())["peak"].startswith("perhaps not reached")


def test_going_on_needs_the_same_values(cli, file):
    assert cli("response", file, "--bounds", 9, 9.5)[0] == 0
    code, _, said = cli("response", file, "--bounds", 9, 9.5, "--set", "load.normal=15.0",
                        "--resume")
    assert code == 1
    assert "was computed with other values" in said
    assert "will be replaced" not in said
    code, _, said = cli("response", file, "--resume", "-o", "nowhere")
    assert code == 1
    assert "no interrupted response to go on with" in said
    for told in (1, 0):
        code, _, said = cli("response", file, "--bounds", 9, 9.5, "--set", "load.normal=15.0")
        assert code == 0
        assert said.count("-response.h5 has results of other values, which will") == told


MESHED = STUDY.replace('shape = "block", contact_length = 0.08, element_size = 0.02',
                       'file = "part.msh"')


@pytest.mark.slow
def test_results_are_of_the_files_that_the_study_named(cli, file):
    """Another mesh under the same name is not mixed with results of the first one."""
    results = file.parent / "results"
    assert cli("mesh", file, "-o", ".")[0] == 0
    mesh = file.with_name("block.msh").replace(file.with_name("part.msh"))
    file.write_text(MESHED)
    short = ("--bounds", 9, 9.5, "--harmonics", 1, "--samples", 64)
    of_mode = ("modes", file, "--nonlinear", 1, "--amplitudes", 1e-5, 2e-5)
    assert cli("response", file, *short)[0] == 0
    assert cli("response", file, *short, "--resume")[0] == 0
    assert cli(*of_mode)[0] == 0
    stored, mode = results / "block-response.h5", results / "block-mode-1.h5"
    commands = [("plot", stored, "response"), ("plot", stored, "phase", "--branch", 0),
                ("report", stored), ("plot", mode, "mode"), ("compare", stored, stored)]
    for command in commands:
        code, _, said = cli(*command)
        assert (code, said) == (0, ""), command
    before = stored.read_bytes()
    mesh.write_text(mesh.read_text() + "\n")
    for command in ("response", file, *short, "--resume"), (*of_mode, "--resume"):
        code, _, said = cli(*command)
        assert (code, said.count("\n")) == (1, 1)
        assert "was computed with another content of part.msh; leave out --resume" in said
    assert stored.read_bytes() == before
    for command in commands:
        code, _, said = cli(*command)
        assert code == 0
        assert set(said.splitlines()) == {
            f"warning: part.msh has changed since {command[1]} was computed; compute it again to "
            f"see what changes."}, command
    # Elsewhere there is no such file to compare with.
    moved = file.parent / "far" / "away" / "block-response.h5"
    moved.parent.mkdir(parents=True)
    stored.rename(moved)
    assert cli("plot", moved, "response")[::2] == (0, "")


def test_a_level_that_fails_leaves_the_others(monkeypatch):
    from fecontact.bifurcation import responses as module
    from fecontact.core.errors import AnalysisError

    described, follow = study(), module.frequency_response

    def fails(system, bounds, parameter, *, levels, **rest):
        if levels["drive.amplitude_x"] == [2e-5]:
            raise AnalysisError("No orbit was found.")
        return follow(system, bounds, parameter, levels=levels, **rest)

    monkeypatch.setattr(module, "frequency_response", fails)
    found = follow_responses(described.system(), described.response)
    assert found.response.levels == pytest.approx([3e-4])
    assert found.notes == ["drive.amplitude_x = 2e-05: no response was followed: No orbit was "
                           "found."]


@pytest.mark.parametrize(("arguments", "message"), [
    (["--bounds", "2", "1"], "[response]: bounds = [2.0, 1.0] must be two values"),
    (["--bounds", "0", "1"], "bounds = [0.0, 1.0] must be frequencies above zero [Hz]"),
    (["load.normal"], "block.toml: [response]: the bounds are those of drive.frequency_hz; give "
                      "those of load.normal by --bounds LOW HIGH"),
    (["drive.stifness_x", "--bounds", "1", "2"], "did you mean 'drive.stiffness_x'"),
    (["--levels", "load.normal"], "must have the form KEY=VALUE,VALUE"),
    (["--levels", "drive.frequency_hz=1"], "take another parameter for the levels"),
    (["--harmonics", "1,,3"], "--harmonics 1,,3 must be a whole number, or several with commas"),
    (["--harmonics", "1,3"], "harmonics = [1, 3] leave out the mean, but constant loads deflect"),
    (["--harmonics", "0"], "harmonics = 0 must be a whole number from 1"),
    (["--set", "response.harmonics=[0,0]"], "harmonics = [0, 0] must be different whole numbers"),
    (["--harmonics", "1,3", "--tolerance", "1e-3"], "leave it out, or give harmonics = 3"),
    (["--samples", "5"], "samples = 5 must be a whole number from 8"),
    (["--set", "response.point=D"], "'D'"),
    (["--set", "response.component=z"], "z"),
    (["--set", "drive.amplitude_x=0", "--set", "response.levels={}"], "excites"),
])
def test_errors_are_one_line(cli, file, arguments, message):
    code, _, said = cli("response", file, *arguments)
    assert code != 0
    assert message in said
    assert said.count("\n") == 1
    assert not list(file.parent.rglob("*.h5"))


def test_settings_are_written_and_read_again():
    described = study()
    assert Study.from_toml(described.to_toml()) == described
    changed = described.with_(**{"response.levels.drive.amplitude_x": [1.0]})
    assert changed.response.levels == {"drive.amplitude_x": (1.0,)}
    assert changed.response.checked_bounds == (8.0, 13.0)
    with pytest.raises(InputError, match="start = 20 must lie in the bounds, 8 to 13"):
        ResponseSettings(bounds=(8.0, 13.0), start=20.0)
    assert ResponseSettings(bounds=(8.0, 13.0), start=10.0).first == 10.0


@pytest.mark.slow
def test_orbits_of_the_file_are_drawn_and_reported(cli, file, monkeypatch):
    seen = ("--set", "response.point=C", "--set", "response.component=x")
    assert cli("response", file, *seen)[0] == 0
    stored = file.parent / "results" / "block-response.h5"
    for kind in ("phase", "energies", "response"):
        place = () if kind == "response" else ("--branch", 1, "--at", 9.8)
        assert cli("plot", stored, kind, *place)[0] == 0
        assert stored.with_name(f"block-response-{kind}.png").stat().st_size > 10_000
    run = stored_orbit_or_run(stored, False, None, OrbitChoice("1", 9.8))
    assert run.observed == ("C", "x")
    level = 1e6 * float(read_response(stored).levels[1])
    assert re.fullmatch(rf"drive amplitude x = {level:.5g} µm, 9\.\d+ Hz", run.settings.title)
    assert cli("report", stored, "-o", "page.html")[0] == 0
    shown = []
    monkeypatch.setattr("webbrowser.open", lambda url: shown.append(url) or True)
    stored.with_suffix(".html").unlink()
    assert cli("open", stored)[0] == 0
    assert shown == [stored.with_suffix(".html").resolve().as_uri()]
    page = stored.with_suffix(".html").read_text()
    assert len((file.parent / "page.html").read_text()) == pytest.approx(len(page), rel=0.05)
    for arguments, message in (
            (["phase"], "holds 2 branches of orbits; choose one with --branch: '0 "
                        "(drive.amplitude_x = 2e-05)'"),
            (["phase", "--branch", 2], "has no branch '2'"),
            (["phase", "--branch", 0, "--at", 99], "the branch lies between 8 and 13; choose"),
            (["mode"], "not that of a nonlinear mode"),
            (["phase", "--branch", 0, "--set", "load.normal=1"], "is a stored result")):
        code, _, said = cli("plot", stored, *arguments)
        assert code == 1
        assert message in said
    code, _, said = cli("render", file, "--at", 3)
    assert code == 1
    assert "choose an orbit of a file of branches" in said
