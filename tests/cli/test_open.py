"""Runs that commands find by their study, and ``fecontact open``."""

import os
import re
import time
import webbrowser

import pytest
from matplotlib.image import imread
from tiny_study import TINY

from fecontact.cli import viewers
from fecontact.cli.templates import template


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser is given; there is no ParaView."""
    monkeypatch.setattr(viewers, "paraview", lambda: None)
    found = []
    monkeypatch.setattr(webbrowser, "open", lambda address: found.append(address) or True)
    return found


def fake_paraview(folder, monkeypatch):
    """A program of that name on the path, which writes down what it is given."""
    program = folder / "bin" / "paraview"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nprintf "%s|" "$#" "$@" > "{folder}/part"\n'
                       f'mv "{folder}/part" "{folder}/given"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    return folder / "given"


def waited_for(file):
    end = time.monotonic() + 20.0
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.02)
    return file.read_text()


def test_what_run_wrote_elsewhere_is_found(cli, study, tmp_path):
    code, _, err = cli("plot", study, "history")
    assert (code, "run the study first" in err) == (1, True)
    assert cli("run", study, "-o", "far/out")[0] == 0
    assert cli("plot", study, "energies")[0] == 0
    assert (tmp_path / "far/out/tiny-energies.png").is_file()
    code, _, err = cli("render", study, "--set", "render.frames=1", "--size", 320, 180)
    assert (code, err) == (0, "")  # the same values: nothing to note
    assert (tmp_path / "far/out/tiny.mp4").stat().st_size > 500
    assert cli("export", "far/out", "--format", "csv")[0] == 0  # a folder of results
    # Two of them are not guessed at; the folder of results comes first.
    assert cli("run", study, "-o", "near", "--set", "load.normal=3.0")[0] == 0
    code, _, err = cli("plot", study, "history")
    assert code == 1
    assert "far/out/tiny.vtkhdf" in err
    assert "near/tiny.vtkhdf" in err
    assert cli("plot", study, "history", "--set", "output.folder=near")[0] == 0
    assert (tmp_path / "near/tiny-history.png").is_file()


def test_set_is_for_studies_alone(cli, study):
    assert cli("run", study, "--set", "load.normal=3.0")[0] == 0
    code, _, err = cli("plot", study, "phase", "--set", "load.normal=3.0")
    assert (code, err) == (0, "")
    assert "other values" in cli("plot", study, "phase")[2]
    for command in (["plot", "results/tiny.vtkhdf", "phase"], ["render", "results/tiny.vtkhdf"],
                    ["export", "results"], ["open", "results"]):
        code, _, err = cli(*command, "--set", "load.normal=3.0")
        assert (code, "name the study instead" in err) == (1, True), command


def test_sections_of_other_analyses_leave_a_run_current(cli, study):
    """Responses, branches and wear do not affect a run; a preload does where the run starts."""
    assert cli("run", study)[0] == 0
    for section in ("[response]\nbounds = [5.0, 20.0]", "[branch]\nbounds = [0.1, 0.2]",
                    "[wear]\ncoefficient = 1e-12", "[preload]\nload_scale = [0.0, 1.0]"):
        study.write_text(f"{TINY}\n{section}\n")
        code, _, err = cli("plot", study, "phase")
        assert (code, err) == (0, ""), section


def test_runs_of_files_that_have_changed_since(cli, study, tmp_path, opened):
    """Data of a law, read by the run itself and by its study, which is run again for a report."""
    data, run = tmp_path / "ground.csv", tmp_path / "results" / "tiny.vtkhdf"
    data.write_text("0.0, 0.0\n0.1, 1e-6\n0.2, 0.0\n")
    study.write_text(TINY.replace("ground = { speed = 0.1 }", (
        'ground = { speed = 0.1, profile = { law = "measured-profile", file = "ground.csv" } }')))
    assert cli("run", study)[0] == 0
    commands = [("plot", study, "history"), ("plot", run, "history"), ("export", "results"),
                ("open", run), ("render", run, "--frames", 1, "-o", "a.png")]
    for command in (*commands, ("report", study)):
        code, _, err = cli(*command)
        assert (code, err) == (0, ""), command
    data.write_text("0.0, 0.0\n0.1, 2e-6\n0.2, 0.0\n")
    for command in commands:
        code, _, err = cli(*command)
        assert code == 0
        assert err.count("\n") == 1
        assert ("other values than" if study in command else
                f"warning: ground.csv has changed since {run.relative_to(tmp_path)} was computed"
                ) in err.replace(f"{tmp_path}/", "")
    code, _, err = cli("report", study)
    assert (code, err) == (0, "")


def test_runs_of_bodies_from_mesh_files_are_current(cli, tmp_path, monkeypatch):
    """Meshes of several bodies are named relative to the study, not to its results."""
    monkeypatch.chdir(tmp_path)
    study, text = tmp_path / "s.toml", template("pad")
    study.write_text(text)
    assert cli("mesh", study, "-o", ".")[0] == 0
    block, pad = re.findall(r"\.geometry\]\n(.*?)\n\n", text, re.DOTALL)
    study.write_text(text.replace(block, 'file = "s-block.msh"').replace(
        pad, 'file = "s-pad.msh"'))
    run = ("run", study, "--set", "simulation.t_end=1e-4", "--set", "simulation.outputs=3")
    assert cli(*run)[0] == 0
    code, _, err = cli("plot", study, "energies", *run[2:])
    assert (code, err) == (0, "")
    (tmp_path / "s-pad.msh").write_text((tmp_path / "s-pad.msh").read_text() + "\n")
    code, _, err = cli("plot", study, "energies", *run[2:])
    assert code == 0
    assert err.startswith("warning: s-pad.msh has changed since ")


def test_plots_of_the_command_line_take_a_style(cli, study, tmp_path):
    assert cli("run", study)[0] == 0
    (tmp_path / "red.mplstyle").write_text("figure.facecolor: ff0000\n")
    assert cli("plot", study, "phase", "--style", "red.mplstyle", "-o", "red.png")[0] == 0
    assert imread(tmp_path / "red.png")[0, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
    code, _, err = cli("plot", study, "phase", "--style", "no-such")
    assert (code, "is no style of matplotlib" in err) == (1, True)


def test_a_run_is_opened_in_paraview_or_as_a_page(cli, study, tmp_path, monkeypatch, opened):
    assert cli("run", study)[0] == 0
    code, out, _ = cli("open", study)
    assert code == 0
    page = tmp_path / "results" / "tiny.html"
    assert opened == [page.as_uri()]
    assert "<html" in page.read_text()
    assert "is not found" in cli("open", study, "--with", "paraview")[2]
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    given = fake_paraview(tmp_path, monkeypatch)
    code, out, _ = cli("open", "results/tiny.vtkhdf")
    assert (code, "is opened in ParaView" in out) == (0, True)
    assert waited_for(given) == f"1|{tmp_path / 'results' / 'tiny.vtkhdf'}|"


def test_a_run_without_frames_is_no_matter_for_paraview(cli, study, tmp_path, opened, monkeypatch):
    assert cli("run", study, "--set", "output.frames=0")[0] == 0
    monkeypatch.setattr(viewers, "paraview", lambda: tmp_path / "paraview")
    assert "holds no fields over the body" in cli("open", "results", "--with", "paraview")[2]
    assert cli("open", "results")[0] == 0
    assert opened == [(tmp_path / "results" / "tiny.html").as_uri()]


def test_pages_of_the_user_are_not_replaced(cli, study, tmp_path, opened):
    """Pages of this package are."""
    assert cli("run", study)[0] == 0
    page = tmp_path / "results" / "tiny.html"
    commands = [("open", study), ("open", "results"), ("report", study)]
    for text in "<!doctype html>\n<p>mine</p>\n", "":
        page.write_text(text)
        for command in commands:
            code, _, err = cli(*command)
            assert (code, err.count("\n")) == (1, 1), command
            assert "tiny.html exists and is no page of fecontact; move it" in err
            assert page.read_text() == text
    page.unlink()
    page.symlink_to("nowhere.html")
    assert cli("report", study)[0] == 1
    assert page.is_symlink()
    page.unlink()
    for command in commands:
        assert cli(*command)[0] == 0
    page.write_text("mine")
    assert cli("report", study, "-o", page)[0] == 0  # named by the user


def test_nothing_that_may_hold_scripts_is_opened(cli, study, tmp_path, opened):
    for name in ("page.html", "picture.svg", "state.pvsm", "macro.py"):
        (tmp_path / name).write_text("<script>alert(1)</script>")
        code, _, err = cli("open", name)
        assert (code, "without running code" in err) == (1, True), name
    (tmp_path / "cut.vtkhdf").write_text("no HDF5")
    assert cli("open", "cut.vtkhdf")[0] == 1
    assert cli("open", "none.vtkhdf")[2].startswith("error: none.vtkhdf does not exist")
    assert cli("open", "none.toml")[0] == 1
    assert opened == []
    (tmp_path / "a.png").write_bytes(b"picture")
    assert cli("open", "a.png")[0] == 0
    assert opened == [(tmp_path / "a.png").as_uri()]
