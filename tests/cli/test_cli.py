"""The command line: the way from a new study to a movie, and what it says when things go wrong."""

import os
import re
import signal
import subprocess
import sys
import time
import tomllib

import numpy as np
import pytest
from tiny_study import TINY

from fecontact import InputError, Mesh, Status, Study, read_case, read_mesh, write_mesh
from fecontact.cli import doctor as examination
from fecontact.cli import execute
from fecontact.core import system_libraries
from fecontact.io import read_table, read_wear
from fecontact.laws import ArchardWear, EnergyWear


def heed_interrupts():
    """In a new process: shells make what runs in the background deaf to Ctrl-C."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_a_load_beyond_the_limits_of_the_model_is_warned_of(cli, study):
    """1 kN on 0.3e6 N/m: 3.3 mm, 640 times the roughness; at 100 N it is 65 times."""
    words = "warning: In this run contact node"
    code, _, err = cli("run", study, "--set", "load.normal=1000.0")
    assert code == 0
    assert err.count(words) == 1
    for command in (["plot", study, "history"], ["export", study, "--format", "csv"]):
        code, _, err = cli(*command)
        assert (code, err.count(words)) == (0, 1)
    code, _, err = cli("run", study, "--set", "load.normal=100.0", "-o", "less")
    assert (code, err) == (0, "")


def test_a_study_without_a_normal_law_is_told_what_to_give(cli, study):
    study.write_text("".join(line for line in TINY.splitlines(keepends=True)
                             if not line.startswith("normal")))
    assert cli("mesh", study)[0] == 0
    code, _, err = cli("run", study)
    assert code == 1
    assert "lacks the section [normal]" in err
    assert "`fecontact laws rough-surface` says how to choose" in err
    code, out, _ = cli("laws", "rough-surface")
    assert code == 0
    assert "How to choose." in out


def test_keys_of_the_law_before_are_left_out_with_a_note(cli, study):
    text = study.read_text()
    study.write_text(text.replace("static_coefficient = 0.8", "static_coefficient = 0.7"))
    code, out, err = cli("mesh", study, "--set", "friction.law=constant")
    assert code == 1
    assert "[friction] lacks the key 'friction_coefficient' of law = 'constant'" in err
    code, out, err = cli("mesh", study, "--set", "friction.law=constant",
                         "--set", "friction.friction_coefficient=0.3")
    assert (code, err) == (0, "")
    assert ("note: [friction]: the law constant has no static_coefficient, kinetic_coefficient, "
            "decay; these keys are left out.") in out


def test_from_a_new_study_to_a_movie(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli("init", "beam.toml")[0] == 0
    small = ["--set", "geometry.element_size=0.01", "--set", "basis.contact_nodes=5",
             "--set", "basis.modes=6", "--set", "simulation.t_end=1e-3",
             "--set", "simulation.outputs=21", "--set", "output.frames=4",
             "--set", "output.points=[\"B\", 2]"]

    code, out, _ = cli("mesh", "beam.toml", *small)
    assert code == 0
    assert re.search("boundary contact +20 edges", out)
    # Corners, middles of edges and centres of cells stand on a grid of 41 x 5.
    assert re.search(r"unknowns +410, quadratic elements \(degree = 2\)", out)
    assert len(read_mesh("results/beam.msh").nodes) == 63

    code, out, _ = cli("modes", "beam.toml", *small)
    assert code == 0
    assert out.count("rigid") == 3
    assert out.count("vibration") == 3
    # Euler-Bernoulli: first bending frequency of a free beam, 0.2 m x 4 mm of steel
    first = next(line for line in out.splitlines() if "vibration" in line)
    assert float(first.split()[1]) == pytest.approx(531.6, rel=5e-3)

    code, out, err = cli("run", "beam.toml", *small)
    assert (code, err) == (0, "")
    for word in ("energy imbalance", "largest displacement", "contact stick", "steps"):
        assert word in out
    case = read_case("results/beam.vtkhdf")
    assert case.trajectory.time[-1] == pytest.approx(1e-3)
    assert Study.from_toml(case.study, "x").basis.contact_nodes == 5

    code, out, _ = cli("export", "results/beam.vtkhdf", "--format", "pvd", "--frames", 2)
    assert code == 0
    assert len(list(tmp_path.glob("results/beam-pvd/**/*.vtu"))) == 2

    code, out, err = cli("render", "beam.toml", "--frames", 2, "--size", 320, 180,
                         "--colour", "displacement", "--scale", 10)
    assert code == 0
    assert "computed with other values than beam.toml" in err
    assert (tmp_path / "results/beam.mp4").stat().st_size > 1000
    code, _, err = cli("render", "results/beam.vtkhdf", "--frames", 1, "--size", 320, 180,
                       "-o", "pictures/p.png")
    assert (code, err) == (0, "")
    plots = {f"results/beam-{what}.png" for what in
             ("modes", "history", "phase", "contact_map", "energies")}
    assert plots <= files_below(tmp_path)
    assert not [name for name in files_below(tmp_path) if ".part" in name]


def test_a_run_without_observed_points_says_so(cli, tmp_path):
    """No amplitude of a point B that does not exist, and no plots of its motion."""
    write_mesh(Mesh.grid(np.linspace(0.0, 0.2, 11), [0.0, 0.01]), tmp_path / "bar.msh")
    (tmp_path / "bar.toml").write_text("""
geometry = { file = "bar.msh" }
body = { thickness = 0.01, fixed = { left = "xy" } }
basis = { modes = 4, contact = [], reduction = "residual", loads = ["gravity"] }
load = { gravity = [0.0, -9.81] }
simulation = { t_end = 1e-3, outputs = 21, initial = { displacement = [0, 0, 0] } }
""")
    code, out, err = cli("run", tmp_path / "bar.toml", "-o", tmp_path / "out")
    assert code == 0, err
    assert "amplitude x at" not in out
    assert "note: No moving point of the body is observed" in out
    assert {path.name for path in (tmp_path / "out").glob("bar*")} == {
        "bar.vtkhdf", "bar-energies.png"}
    code, out, err = cli("report", tmp_path / "out" / "bar.vtkhdf")
    assert (code, "No moving point" in out) == (0, True), err
    code, _, err = cli("plot", tmp_path / "out" / "bar.vtkhdf", "history")
    assert (code, "points = { tip = [x, y] } of [basis]" in " ".join(err.split())) == (1, True)


def test_results_go_to_the_folder_asked_for(cli, study, tmp_path):
    assert cli("run", study, "-o", "a/b")[0] == 0
    assert "a/b/tiny.vtkhdf" in files_below(tmp_path)
    assert not (tmp_path / "results").exists()


def test_a_changed_value_that_replaces_results_is_told(cli, study, tmp_path):
    """Neither the first run nor one of the same values; another folder keeps both."""
    steps = (((), ""), (("--set", "ground.speed=0.2"), "-o FOLDER"),
             (("--set", "ground.speed=0.2"), ""), (("--set", "ground.speed=0.3", "-o", "b"), ""))
    for changes, told in steps:
        code, _, err = cli("run", study, *changes)
        assert code == 0
        assert told in err
        assert bool(err) is bool(told), err


@pytest.mark.slow
def test_a_run_that_is_up_to_date_is_drawn_without_a_note(cli, study, tmp_path):
    assert cli("run", study)[0] == 0
    study.write_text(TINY.replace("frames = 2", "frames = 1"))
    code, _, err = cli("render", study)
    assert (code, err) == (0, "")


@pytest.mark.slow
def test_steep_ground_is_noted(cli, study):
    steep = "--set", "ground.amplitude=1e-4", "--set", "ground.wavelength=1e-3"
    _, out, _ = cli("run", study, *steep)
    said = " ".join(out.split())
    assert "slope reaches 0.63; above 0.3 it is a rough assumption that friction acts" in said
    _, out, _ = cli("run", study, *steep, "--set", "ground.normal=vertical")
    said = " ".join(out.split())
    assert "assumption that the contact force is vertical and friction acts" in said


def test_wear_of_a_study(cli, study, tmp_path):
    """The section [wear], in blocks: stored, drawn, and as the same from Python."""
    options = ["--set", "wear.coefficient=1e-12", "--set", "wear.acceleration=100.0", "--set",
               "wear.blocks=3", "--set", "wear.period=0.002", "--set", "ground.speed=0.05"]
    code, out, err = cli("wear", study, *options, "-o", tmp_path / "worn")
    assert (code, err) == (0, "")
    assert "300, 100 per computed period" in out
    assert {"tiny-wear.h5", "tiny-wear.png"} <= files_below(tmp_path / "worn")
    stored = read_wear(tmp_path / "worn" / "tiny-wear.h5")
    again = Study.read(study).with_(**{
        "wear.coefficient": 1e-12, "wear.acceleration": 100.0, "wear.blocks": 3,
        "wear.period": 0.002, "ground.speed": 0.05}).wear_history()
    assert (stored.depth == again.depth).all()
    assert stored.law == EnergyWear(1e-12)
    assert stored.depth[-1].max() > 0.0
    code, _, err = cli("wear", study)
    assert code == 1
    assert "[wear] lacks the key 'coefficient'" in " ".join(err.split())
    archard = Study.read(study).with_(**{"wear.law": "archard", "wear.coefficient": 1e-15})
    assert archard.wear.law_if_any == ArchardWear(1e-15)


@pytest.mark.parametrize("shape", ["beam", "pendulum", "block"])
def test_init_writes_every_shape_and_never_overwrites(cli, shape, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli("init", "--shape", shape)[0] == 0
    text = (tmp_path / "study.toml").read_text()
    assert tomllib.loads(text)["geometry"]["shape"] == shape
    assert text.startswith("# ")
    (tmp_path / "study.toml").write_text("mine")
    code, _, err = cli("init", "--shape", shape)
    assert code == 1
    assert "study.toml exists" in err
    assert (tmp_path / "study.toml").read_text() == "mine"
    assert cli("init", "--force")[0] == 0
    assert (tmp_path / "study.toml").read_text() != "mine"
    (tmp_path / "link.toml").symlink_to("nowhere.toml")
    assert cli("init", "link.toml", "--shape", shape)[0] == 1
    assert (tmp_path / "link.toml").is_symlink()


def test_init_for_a_mesh_of_ones_own(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli("init", "beam.toml")[0] == 0
    assert cli("mesh", "beam.toml", "--set", "geometry.element_size=0.01")[0] == 0
    os.rename("results/beam.msh", "part.msh")
    code, out, _ = cli("init", "--shape", "mesh")
    assert code == 0
    assert "part.msh" in out
    code, out, _ = cli("mesh", "study.toml")
    assert code == 0
    assert re.search("boundary contact +20 edges", out)
    code, _, err = cli("mesh", "study.toml", "--set", "geometry.scale=1000", "-o", "of-metres")
    assert code == 0
    assert "the body has an extent of 200 m" in err
    short = ["--set", "simulation.t_end=1e-3", "--set", "simulation.outputs=21",
             "--set", "basis.contact_nodes=5", "--set", "output.frames=2"]
    assert cli("run", "study.toml", *short)[0] == 0
    # The load of the template presses the part down.
    force = read_case("results/study.vtkhdf").trajectory.normal_force.sum(axis=1)
    assert force[0] == pytest.approx(500.0, rel=1e-6)


@pytest.mark.slow
def test_init_for_a_sweep(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = cli("init", "--shape", "sweep")
    assert (code, "fecontact sweep study.toml" in out) == (0, True)
    wanted = Study.read("study.toml").sweep
    assert wanted.summaries == ("amplitude_x", "stick_fraction", "friction_power")
    axes = ["--set", "sweep.axes={'ground.speed'=[4e-3, 10e-3], "
                     "'friction.static_coefficient'=[0.8]}"]
    assert cli("sweep", "study.toml", "--workers", "1", *axes)[0] == 0
    slow, fast = read_table("results/study-sweep/index.csv").column("amplitude_x")
    # Steady sliding is unstable below 8.4 mm/s at 0.8; there the block sticks and slips.
    assert slow > 1e-4
    assert fast < 1e-5


MISTAKES = [
    (["run", "tyni.toml"], "tyni.toml does not exist (did you mean 'tiny.toml'?)"),
    (["run", "bad.toml"], "bad.toml is not valid TOML"),
    (["run", "."], "cannot be read as a study"),
    (["run", "tiny.toml", "--set", "ground.sped=1"], "did you mean 'speed'"),
    (["run", "tiny.toml", "--set", "ground.speed=fast"], 'speed = "fast" must be a number.'),
    (["run", "tiny.toml", "--set", "ground.speed"], "must have the form KEY=VALUE"),
    (["run", "tiny.toml", "--set", "basis.contact=botom"], "no boundary named 'botom'"),
    (["modes", "tiny.toml", "--set", "basis.modes=9999"], "number of unknowns"),
    (["run", "tiny.toml", "--set", "basis.contact_nodes=999"], "contact_nodes = 999"),
    (["run", "tiny.toml", "-o", "tiny.toml/x"],
     "The folder tiny.toml/x cannot be written (tiny.toml is a file, not a folder)"),
    (["run", "tiny.toml", "-o", "tiny.toml"], "The folder tiny.toml cannot be written"),
    (["mesh", "tiny.toml", "--set", "body.youngs_modulus=-1"], "youngs_modulus = -1"),
    (["mesh", "tiny.toml", "--set", "body.density=-1"], "density = -1.0 must be"),
    (["mesh", "tiny.toml", "--set", "body.thickness=-1"], "thickness = -1.0 must be"),
    (["mesh", "tiny.toml", "--set", "normal.roughness_height=-1"], "roughness_height = -1.0"),
    (["mesh", "text.toml"], "no complete section"),
    (["mesh", "absent.toml"], "there is no such file"),
    (["run", "tiny.toml", "--set", "simulation.solver=euler"], "solver = 'euler' must be"),
    (["render", "tiny.toml"], "run the study first: fecontact run tiny.toml"),
    (["render", "none.vtkhdf"], "none.vtkhdf does not exist"),
    (["render", "bad.toml"], "bad.toml is not valid TOML"),
    (["render", "text.msh"], "text.msh is not an HDF5 file"),
    (["export", "none.vtkhdf"], "none.vtkhdf does not exist"),
    (["plot", "histroy", "none.vtkhdf"], "`fecontact plot none.vtkhdf history`, and histroy is no"),
    (["plot", "history"], "takes the file first, then the kind of plot: `fecontact plot FILE his"),
    (["plot", "none.vtkhdf"], "fecontact plot none.vtkhdf KIND`, with one of 'contact_map', "),
    (["plot", "none-branch.h5"], "KIND`, with one of 'branches', 'mode', 'response' of the whole"),
    (["plot", "none-branch.h5", "--at", "3"], "KIND`, with one of 'contact_map', "),
    (["plot", "none-branch.h5", "branhces"], "(did you mean 'branches'?)"),
    (["plot", "none-branch.h5", "mode", "--at", "3"], "without --branch, --at and --which"),
    (["plot", "none.vtkhdf", "histroy"], "(did you mean 'history'?)"),
    (["plot", "none.vtkhdf", "response"], "is one of files NAME-branch.h5 and NAME-response.h5"),
    (["laws", "mine.txt:Own"], "a law of your own is FILE.py:CLASS"),
    (["report", "tiny.toml", "-o", f"{'m' * 300}.html"], "name too long); choose a shorter name"),
    (["run", "tiny.toml", "-o", "m" * 300], "cannot be written (file name too long); choose an"),
    (["init", f"{'m' * 300}.toml"], "cannot be written (file name too long); choose a shorter"),
    (["init", "study.txt"], "study.txt must end in .toml"),
    (["init", "tiny.toml/x.toml"], "The folder tiny.toml cannot be written"),
    (["demo", "tiny.toml/x"], "The folder tiny.toml/x cannot be written"),
]


@pytest.mark.parametrize(("tokens", "message"), MISTAKES, ids=lambda value: str(value)[:60])
def test_mistakes_are_one_sentence_and_leave_nothing_behind(tokens, message, cli, study, tmp_path):
    (tmp_path / "bad.toml").write_text("[ground]\nspeed = = 1\n")
    (tmp_path / "text.msh").write_text("hello")
    for name in ("text", "absent"):
        (tmp_path / f"{name}.toml").write_text(f'[geometry]\nfile = "{name}.msh"\n')
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    code, _, err = cli(*tokens)
    assert code == 1
    assert err.startswith("error: ")
    assert message in err
    assert err.count("\n") == 1
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_names_of_studies_leave_space_for_those_of_results(cli, study):
    long = study.rename(study.with_name(f"{'n' * 201}.toml"))
    for command in ("run", "init"):
        code, _, err = cli(command, long.name)
        assert code == 1
        assert "has 201 bytes, and those of its results would be longer still; rename" in err


def test_settings_of_a_movie_out_of_range(cli, study):
    assert cli("run", study)[0] == 0
    for option, message in ((["--fps", -1], "fps = -1.0 must be a number from 0.01"),
                            (["--frames", 0], "frames = 0 must be at least 1"),
                            (["--size", 5, 5], "must be an even width and height"),
                            (["--t-start", 7], "no output time"),
                            (["-o", "movie.avi"], "must end in .mp4")):
        code, _, err = cli("render", "results/tiny.vtkhdf", *option)
        assert code == 1
        assert message in err


@pytest.mark.parametrize("tokens", [["rnu"], ["run"], ["run", "a.toml", "--sett", "x=1"],
                                    ["init", "--shape", "bem"], ["render", "a", "--fps", "many"],
                                    ["branch", "a.toml", "--empty-bounds"],
                                    ["branch", "a.toml", "--bounds", "1"]])
def test_command_lines_that_cannot_be_understood(tokens, cli):
    code, _, err = cli(*tokens)
    assert code == 2
    assert err.startswith("error: ")
    assert err.count("\n") == 1


def test_debug_shows_where_an_error_comes_from(tmp_path):
    with pytest.raises(ValueError, match="does not exist"):
        execute(["--debug", "run", str(tmp_path / "none.toml")])


def test_errors_that_should_not_happen_are_said_in_one_sentence(cli, study, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(Study, "mesh", broken)
    code, _, err = cli("mesh", study)
    assert code == 1
    assert "ZeroDivisionError" in err
    assert "--debug" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("code", [
    "sys.exit(0)",
    "@dataclass(frozen=True)\nclass Law(LinearContact):\n    def __post_init__(self):\n"
    "        sys.exit(0)"])
def test_a_law_that_ends_the_program_is_an_error(cli, study, tmp_path, code):
    (tmp_path / "own.py").write_text("import sys\nfrom dataclasses import dataclass\n\n"
                                     f"from fecontact.laws import LinearContact\n\n\n{code}\n")
    study.write_text(TINY.replace("normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, "
                                  "damping = 6.0 }",
                                  'normal = { law = "own.py:Law", stiffness = 0.3e6 }'))
    code, _, err = cli("run", study)
    assert code == 1
    assert err.count("\n") == 1
    assert "SystemExit: 0" in err or "ended the program by sys.exit(0)" in err
    assert not (tmp_path / "results").exists()


def test_a_run_that_fails_is_written_and_reported(cli, study, monkeypatch):
    whole = Study.run

    def stopped(self, progress=None, checkpoint=None):
        trajectory = whole(self, progress, checkpoint)
        object.__setattr__(trajectory, "status", Status.FAILED)
        return trajectory

    monkeypatch.setattr(Study, "run", stopped)
    code, out, err = cli("run", study)
    assert code == 1
    assert "did not reach its end" in err
    assert "results/tiny.vtkhdf" in out
    assert read_case("results/tiny.vtkhdf").trajectory.status is Status.FAILED


def test_ctrl_c_while_drawing_leaves_nothing(cli, study, monkeypatch, tmp_path):
    from fecontact.output.plots import modes

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(modes, "plot_modes", interrupted)
    code, _, err = cli("modes", study)
    assert code == 130
    assert err == "error: interrupted.\n"
    assert files_below(tmp_path) == {"tiny.toml"}
    assert not (tmp_path / "results").exists()


def command(*tokens, **options):
    return subprocess.run([sys.executable, "-m", "fecontact", *tokens], capture_output=True,
                          text=True, check=False, timeout=120, **options)


def test_ctrl_c_writes_what_was_computed(cli, study, tmp_path):
    # Once before, so that everything is compiled.
    assert cli("run", study, "--set", "ground.amplitude=1e-5", "-o", tmp_path / "before")[0] == 0
    process = subprocess.Popen(
        [sys.executable, "-m", "fecontact", "run", str(study), "--set", "simulation.t_end=1e5",
         "--set", "simulation.outputs=100001", "--set", "ground.amplitude=1e-5"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heed_interrupts)
    # The folder is made when everything is loaded; the run begins right after.
    deadline = time.monotonic() + 90
    while not (tmp_path / "results").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(5.0)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "The run was interrupted" in out
    case = read_case(tmp_path / "results/tiny.vtkhdf")
    assert case.trajectory.status is Status.INTERRUPTED
    assert 0.0 < case.trajectory.time[-1] < 1e5


def test_an_interrupted_run_is_resumed(cli, study, monkeypatch, tmp_path):
    from fecontact.integrate.rodas5p.run import Run

    longer = ("--set", "simulation.t_end=0.05", "--set", "simulation.outputs=101")
    assert cli("run", study, "--resume")[0] == 1
    assert cli("run", study, *longer, "--output", tmp_path / "whole")[0] == 0
    whole = read_case(tmp_path / "whole" / "tiny.vtkhdf").trajectory
    advance, calls = Run.advance, []

    def interrupted(self, steps):
        calls.append(steps)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return advance(self, 100)

    monkeypatch.setattr(Run, "advance", interrupted)
    code, out, _ = cli("run", study, *longer)
    assert code == 130
    assert "interrupted" in out
    assert (f"next: fecontact run {study} --set simulation.t_end=0.05 --set simulation.outputs=101 "
            f"--resume") in " ".join(out.split())
    part = read_case("results/tiny.vtkhdf").trajectory
    assert 0.0 < part.time[-1] < 0.05
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    checkpoint = tmp_path / "results" / "tiny.checkpoint"
    kept = checkpoint.read_bytes()
    code, _, err = cli("run", study, *longer)
    assert (code, err) == (1, f"error: {checkpoint} holds an interrupted run; go on with --resume, "
                              f"start again with --overwrite, or choose another folder with -o.\n")
    assert cli("run", study, "--resume", "--overwrite")[0] == 1
    code, _, err = cli("run", study, "--resume", "--set", "ground.speed=0.3")
    assert code == 1
    assert "another run" in err
    assert "will be replaced" not in err
    assert "repeat the values of that run, remove the file or name another one" in err
    assert checkpoint.read_bytes() == kept
    assert cli("run", study, *longer, "--resume")[0] == 0
    resumed = read_case("results/tiny.vtkhdf").trajectory
    assert (resumed.states == whole.states).all()
    assert (resumed.friction_work == whole.friction_work).all()
    assert not checkpoint.exists()
    checkpoint.write_bytes(kept)
    assert cli("run", study, *longer, "--overwrite")[0] == 0
    assert not checkpoint.exists()


def test_a_run_that_cannot_be_written_is_kept_elsewhere(cli, study, monkeypatch, tmp_path):
    from fecontact.output.files import case
    from fecontact.output.plots import run as plots

    def full(path, *_, **__):
        raise InputError(f"{path} cannot be written (no space left on device).")

    write, other = case.write_case, tmp_path / "other"
    other.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(other))
    monkeypatch.setattr(case, "write_case", lambda path, *rest, **options: (
        write if other in path.parents else full)(path, *rest, **options))
    code, out, err = cli("run", study)
    kept, = other.rglob("tiny.vtkhdf")
    assert (code, out) == (1, "")
    assert err == (f"error: {tmp_path}/results/tiny.vtkhdf cannot be written (no space left on "
                   f"device); the run is kept in {kept}.\n")
    assert read_case(kept).trajectory.status is Status.FINISHED
    monkeypatch.setattr(case, "write_case", full)
    assert cli("run", study)[2].endswith("(no space left on device).\n")
    monkeypatch.setattr(case, "write_case", write)
    monkeypatch.setattr(plots, "plot_energies", lambda run, path: full(path))
    err = cli("run", study)[2]
    assert err.endswith(f"device); the run is in {tmp_path}/results/tiny.vtkhdf.\n")
    assert read_case(tmp_path / "results" / "tiny.vtkhdf").trajectory.status is Status.FINISHED


def test_help_comes_at_once_and_version_is_said():
    done = command("--help")
    assert done.returncode == 0
    assert "wavy ground" in done.stdout
    loaded = subprocess.run(
        [sys.executable, "-c", "import sys, fecontact.cli; print(*sys.modules)"],
        capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "numba", "scipy", "skfem", "gmsh", "vtk", "matplotlib"} & set(loaded)
    assert command("--version").stdout.strip().count(".") == 2
    failed = command("run", "none.toml")
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr == ("error: none.toml does not exist; fecontact init writes a study "
                             "to start from.\n")


@pytest.mark.parametrize(("tokens", "message"), [
    (["run"], "`fecontact run --help` lists"),
    (["mesh", "a.toml", "b"], "fecontact mesh takes no more arguments: b. `fecontact mesh --help`"),
    (["rum", "a.toml"], "`fecontact --help` lists"),
])
def test_invalid_command_lines_name_the_help(tokens, message, cli):
    code, _, err = cli(*tokens)
    assert code == 2
    assert message in err


def test_studies_without_preload_need_no_kernels_of_it():
    loaded = subprocess.run(
        [sys.executable, "-c", "import sys, fecontact.study.study; print(*sys.modules)"],
        capture_output=True, text=True, check=True).stdout.split()
    assert "fecontact.study.preload_section" in loaded
    assert "fecontact.system.quasistatic.march" not in loaded


def test_output_into_a_pipe_that_closes(study):
    done = subprocess.run(f"{sys.executable} -m fecontact --help | true", shell=True,
                          capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_doctor_finds_this_computer_well(cli):
    code, out, err = cli("doctor")
    assert (code, err) == (0, "")
    assert "All is well." in out
    for name in ("numpy", "(Gmsh)", "pictures (VTK)", "movies (ffmpeg)", "libGL.so.1"):
        assert name in out


def test_doctor_says_what_to_install(cli, monkeypatch):
    monkeypatch.setattr(examination, "_attempt", lambda code: "it is broken")
    monkeypatch.setattr(system_libraries, "PACKAGES", {"libnowhere.so.7": "libnowhere7"})
    monkeypatch.setattr(system_libraries.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system_libraries.os, "geteuid", lambda: 1000)
    code, out, _ = cli("doctor")
    assert code == 1
    assert "it is broken" in out
    assert "To repair: sudo apt-get install -y --no-install-recommends libnowhere7" in out


def test_completion_makes_bash_complete_commands_options_and_choices(cli, tmp_path):
    code, script, _ = cli("completion", "bash")
    assert code == 0
    (tmp_path / "completion.sh").write_text(script)

    def completed(*words):
        ask = (f"source completion.sh; complete -p fecontact >/dev/null || exit 1; "
               f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; "
               f'_fecontact; echo "${{COMPREPLY[@]}}"')
        done = subprocess.run(["bash", "-c", ask], cwd=tmp_path, capture_output=True, text=True,
                              check=True)
        return done.stdout.split()

    assert completed("fecontact", "mo") == ["modes"]
    assert completed("fecontact", "export", "--fo") == ["--format"]
    assert "csv" in completed("fecontact", "export", "x.toml", "--format", "''")


@pytest.mark.parametrize("shell", ["zsh", "fish", "powershell"])
def test_completion_names_every_command_to_the_shell(cli, shell):
    code, script, _ = cli("completion", shell)
    assert code == 0
    for command in ("init", "mesh", "modes", "run", "sweep", "branch", "completion"):
        assert command in script


@pytest.mark.slow
def test_demo_makes_all_studies(cli, tmp_path, monkeypatch):
    from fecontact.cli import demo

    full = demo.template

    def small(shape):
        study = Study.from_toml(full(shape)).with_(**{
            "simulation.t_end": 2e-3, "simulation.outputs": 21, "output.frames": 2,
            "render.frames": 1, "render.t_start": 0.0, "render.t_end": 1.0,
            "render.size": [320, 180]})
        return study.to_toml()

    monkeypatch.setattr(demo, "template", small)
    code, out, err = cli("demo", tmp_path / "d")
    assert code == 0, err
    assert "total" in out
    assert files_below(tmp_path / "d") == {
        f"{name}{end}" for name in ("beam_on_wavy_ground", "pendulum_on_stop", "pad_on_belt")
        for end in (".toml", ".msh", ".vtkhdf", ".mp4", "-modes.png", "-history.png",
                    "-phase.png", "-contact_map.png", "-energies.png")}


@pytest.mark.skipif(os.name != "posix", reason="the script is for Linux")
def test_script_for_system_libraries_agrees_with_the_doctor():
    from pathlib import Path

    script = Path(__file__).parents[2] / ".ci" / "system-libraries"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=False, env=os.environ | {"PATH": ""})
    assert done.returncode == (1 if system_libraries.missing() else 0)


def test_complex_modes_and_a_movie_of_one(cli, study, monkeypatch):
    from fecontact.output.render import mode_movie

    drawn = []

    def noted(basis, path, mode, *, modes, progress):
        drawn.append((path.name, mode, None if modes is None else len(modes.frequencies_hz)))
        return path

    monkeypatch.setattr(mode_movie, "render_mode", noted)
    spring = ("--set", "drive.stiffness_x=1e4")
    code, out, _ = cli("modes", study, "--complex", "--movie", "1", *spring)
    assert code == 0
    # On the spring, 1.57 kg/m over 0.1 m: sqrt(1e4 / 0.157) / (2 pi) = 40.17 Hz.
    assert re.search(r"steady sliding:\s+mode .*\s+\S+\s+0 +40\.1\d+ ", out)
    every = cli("modes", study, "--complex", "--all", *spring)[1]
    left_out = int(re.search(r"note: (\d+) modes above .* --all shows these modes", out)[1])
    assert left_out > 0
    assert "modes above" not in every
    table, whole = (len(text.partition("steady sliding:")[2].splitlines()) for text in (out, every))
    assert whole - table >= left_out - 2
    assert cli("modes", study, "--movie", "0")[0] == 0
    assert [name for name, _, _ in drawn] == ["tiny-complex-mode-1.mp4", "tiny-mode-0.mp4"]
    assert drawn[1][2] is None
