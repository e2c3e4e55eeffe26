"""Commands for a study of a solid, from the template to the page."""

import numpy as np
import pytest

from fecontact import Study, read_case
from fecontact.cli.templates import template

SHORT = ("--set", "simulation.t_end=2e-3", "--set", "simulation.outputs=21",
         "--set", "output.frames=2")


@pytest.fixture
def place(tmp_path):
    """A folder with the study of a solid."""
    (tmp_path / "pad.toml").write_text(template("solid"))
    return tmp_path


@pytest.mark.slow
def test_all_commands_take_a_solid(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = cli("init", "pad.toml", "--shape", "solid")
    assert (code, "next: fecontact run pad.toml" in out) == (0, True)
    assert Study.read("pad.toml") == Study.from_toml(template("solid"))
    code, out, _ = cli("mesh", "pad.toml")
    assert code == 0
    assert "60 faces" in out
    assert (tmp_path / "results" / "pad.msh").exists()
    code, out, err = cli("modes", "pad.toml", "--complex")
    assert code == 0, err
    assert "steady sliding" in out
    code, out, err = cli("run", "pad.toml", *SHORT)
    assert code == 0, err
    assert "z = " in out
    stored = read_case("results/pad.vtkhdf").trajectory
    again = Study.read("pad.toml").with_(**{"simulation.t_end": 2e-3,
                                            "simulation.outputs": 21}).run()
    for name in ("modal_coordinates", "friction_forces", "pressure"):
        assert (getattr(stored, name) == getattr(again, name)).all(), name
    run = "results/pad.vtkhdf"
    # The plots of the run.
    assert {path.name for path in (tmp_path / "results").glob("pad-*.png")} == {
        f"pad-{kind}.png" for kind in ("modes", "history", "phase", "contact_map", "energies")}
    assert cli("plot", run, "phase", "--component", "z")[0] == 0
    assert cli("plot", run, "history", "--point", "0.1,0.06,0.02")[0] == 0
    code, _, err = cli("plot", run, "phase", "--component", "phi")
    assert code == 1
    assert "'phi'" in err
    code, _, err = cli("plot", run, "history", "--point", "0.1,0.06,0.02,0")
    assert code == 1
    assert "of a solid x,y,z" in " ".join(err.split())
    code, _, err = cli("plot", run, "history", "--point", "0.1,0.06")
    assert code == 1
    assert "3 coordinates, x, y, z" in " ".join(err.split())
    assert cli("export", run, "--format", "csv")[0] == 0
    code, out, err = cli("report", run)
    assert code == 0, err
    assert (tmp_path / "results" / "pad.html").stat().st_size < 400_000


def test_a_solid_is_rendered_from_above_and_below(cli, place, monkeypatch):
    monkeypatch.chdir(place)
    code, _, err = cli("run", "pad.toml", *SHORT)
    assert code == 0, err
    pictures = []
    for view in ("above", "below"):
        code, _, err = cli("render", "results/pad.vtkhdf", "--frames", "1", "--view", view,
                           "--size", "320", "180", "-o", f"{view}.png")
        assert code == 0, err
        from matplotlib.image import imread

        (file,) = place.glob(f"{view}*.png")
        pictures.append(imread(file)[..., :3])
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.1).mean() > 0.05
    code, _, err = cli("render", "results/pad.vtkhdf", "--view", "left")
    assert code == 2
    assert "--view" in err


def test_keys_that_do_not_fit_are_one_sentence(cli, place, monkeypatch):
    monkeypatch.chdir(place)
    for change, words in (("body.thickness=0.1", "[body]: thickness = 0.1 is for plane bodies"),
                          ("load.gravity=[0, -9.81]", "[load]: gravity = [0.0, -9.81]"),
                          ("basis.contact_nodes=[20, 3]", "contact_nodes = [20, 3]"),
                          ("basis.contact=\"top\"", "does not face the ground")):
        code, _, err = cli("run", "pad.toml", "--set", change)
        assert code == 1
        assert words in err
        assert err.startswith("error: pad.toml: [")
        assert err.count("\n") == 1
