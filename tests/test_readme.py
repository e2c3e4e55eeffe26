"""The README and the pages of docs: their examples run, their commands and links exist."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fecontact.cli import execute
from fecontact.cli.app import COMMANDS
from fecontact.output.probe import rendering_works
from fecontact.study import Study

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




DOCS = Path(__file__).parents[1] / "docs"
PAGES = {"README.md": README, **{path.name: path.read_text() for path in DOCS.glob("*.md")}}
TABLES = [(page, text) for page, content in PAGES.items()
          for text in re.findall(r"```toml\n(.*?)```", content, re.DOTALL)]


@pytest.mark.parametrize(("page", "text"), TABLES,
                         ids=[f"{page}-{number}" for number, (page, _) in enumerate(TABLES)])
def test_tables_of_the_pages_are_understood(page, text):
    shape = '[geometry]\nshape = "beam"\n'
    study = Study.from_toml(text if "[geometry]" in text else text + shape, "study.toml")
    given = tomllib.loads(text)
    written = study.tables()
    for section, keys in given.items():
        for key, value in keys.items():
            if not isinstance(value, dict | list):
                assert written[section][key] == value


def test_commands_of_the_pages_exist():
    names = {command.__name__ for command in COMMANDS}
    for content in PAGES.values():
        for name in re.findall(r"(?:^    |`)fecontact (\w+)", content, re.MULTILINE):
            assert name in names, name


def test_links_of_the_pages_lead_somewhere():
    for page, content in PAGES.items():
        folder = DOCS.parent if page == "README.md" else DOCS
        for target in re.findall(r"\]\(([^)#:]+)\)", content):
            assert (folder / target).exists(), (page, target)


def test_examples_of_the_page_on_runs():
    names = {}
    for code in re.findall(r"```python\n(.*?)```", PAGES["runs.md"], re.DOTALL):
        exec(compile(code, "runs.md", "exec"), names)
    assert names["run"].events.kind[0] == "touch-down"
    assert names["first"].status.name == "EVENT"
    assert names["found"].exponents[0] == pytest.approx(-6.254, abs=1.0)
    multipliers = abs(np.linalg.eigvals(names["one"].monodromy))
    assert np.log(multipliers.max()) / names["period"] == pytest.approx(-6.254, rel=1e-3)
    assert names["up"].shape == names["down"].shape == (9, 4)
    assert [one.kind for one in names["plane"].attractors] == ["periodic"]
