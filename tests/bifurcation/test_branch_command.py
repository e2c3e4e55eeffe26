"""The command `fecontact branch`: what it writes and says."""

from pathlib import Path

import pytest

from fecontact import Study
from fecontact.bifurcation import BranchStatus, periodic_motion
from fecontact.cli import execute
from fecontact.io import read_branch, read_branches

STUDY = """
geometry = { shape = "block", contact_length = 0.08, element_size = 0.02 }
body = { material = "steel", thickness = 0.1 }
basis = { modes = 3, contact_nodes = 4, B = { at = "B", radius = 0.006 }, C = "top" }
normal = { stiffness = 10e6, roughness_height = 10e-6, damping = 40.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 12e-3 }
drive = { stiffness_x = 5610.0, damping_x = 0.768 }
load = { normal = 14.0 }
"""


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


def test_block_on_a_belt(study, capsys):
    """Near the closed form of one mass, 8.3365 mm/s."""
    assert execute(["branch", str(study), "ground.speed", "--bounds", "7e-3", "12e-3", "--start",
                    "12e-3"]) == 0
    said = capsys.readouterr().out
    found = read_branch("results/block-branch.h5")
    hopf, = found.of_kind("Hopf")
    assert hopf.parameter == pytest.approx(8.3365e-3, rel=1e-3)
    assert f"{hopf.parameter:.7g}" in said
    assert "unstable orbits" in said
    assert "unstable in 2 directions" in said
    assert (study.parent / "results" / "block-branch.png").stat().st_size > 10_000


def test_a_changed_value_that_replaces_a_branch_is_told(study, capsys):
    """Once: the same values again replace no others."""
    short = ["branch", str(study), "ground.speed", "--bounds", "11e-3", "12e-3"]
    for changes, told in (([], 0), (["--set", "load.normal=15.0"], 1),
                          (["--set", "load.normal=15.0"], 0)):
        assert execute([*short, *changes]) == 0
        assert capsys.readouterr().err.count("block-branch.h5 has results of other val") == told


@pytest.mark.parametrize(("arguments", "message"), [
    (["ground.sped", "--bounds", "1", "2"], "did you mean 'ground.speed'"),
    (["ground.speed", "--bounds", "1", "1"], "bounds = [1.0, 1.0] must be two values"),
    (["ground.speed", "--bounds", "0.01", "0.02", "--set", "drive.amplitude_x=1e-3",
      "--set", "drive.frequency_hz=1.5"], "take the drive's amplitude"),
    ([], "block.toml: [branch] lacks the key 'parameter'"),
    (["ground.speed"], "block.toml: [branch] lacks the key 'bounds'"),
])
def test_errors_are_one_line(study, capsys, arguments, message):
    assert execute(["branch", str(study), *arguments]) != 0
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said
    assert not (study.parent / "results").exists()


def test_the_friction_oscillators_loop_is_one_branch(tmp_path, monkeypatch):
    """From the Hopf point by slipping orbits to their fold, and back as stick-slip to 2 mm/s."""
    study = tmp_path / "friction_branch.toml"
    study.write_text((Path(__file__).parents[2] / "examples" / study.name).read_text())
    monkeypatch.chdir(tmp_path)
    assert execute(["branch", str(study)]) == 0
    written, = tmp_path.rglob("*-branch.h5")
    found = read_branches(written)
    sliding, orbits = found.values()
    hopf, = sliding.special
    assert hopf.parameter == pytest.approx(8.336533e-3, rel=1e-7)
    assert orbits.status is BranchStatus.BOUND
    fold, = orbits.special
    assert fold.kind == "fold"
    # By integration of one degree of freedom, independently.
    assert fold.parameter == pytest.approx(0.23348510, rel=1e-6)
    at = orbits.points.index(fold)
    assert (orbits.column("unstable")[:at] == 1).all()
    assert orbits.column("stable")[at + 1:].all()
    assert orbits.parameter[-1] == pytest.approx(2e-3, rel=1e-9)
    run = periodic_motion(Study.read(study).system(), transient=10.0, longest_period=2.0)
    assert orbits.points[-1].values["period"] == pytest.approx(run.period, rel=1e-6)
