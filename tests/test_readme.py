"""The examples of the README run as they stand."""

import re
from pathlib import Path

from fecontact.cli import execute
from fecontact.output.probe import rendering_works

README = (Path(__file__).parents[1] / "README.md").read_text()


def block(language: str) -> str:
    return re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)[1]


def test_python_example(tmp_path, monkeypatch, capsys):
    code = block("python")
    if rendering_works() is not None:
        code = code.replace('render(run, "beam.mp4", frames=100)', "")
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "The run reached its end." in printed
    assert "right to" in names["basis"].report().recommendation
    assert names["run"].energies.imbalance < 2e-5
    assert set(names["run"].contact_state.ravel().tolist()) == {0, 1, 2}
    assert (tmp_path / "contact.png").stat().st_size > 10_000


def test_study_example(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(block("toml"))
    assert execute(["modes", "study.toml"]) == 0
    assert execute(["run", "study.toml", "--set", "simulation.t_end=0.1"]) == 0
    assert (tmp_path / "results" / "study.vtkhdf").exists()
    assert "study.vtkhdf" in capsys.readouterr().out


