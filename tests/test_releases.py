"""A release gives the same facts about itself in all places."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest

import fecontact

ROOT = Path(__file__).resolve().parents[1]
# Names of conda that differ from those of wheels.
CONDA = {"matplotlib-base": "matplotlib", "docstring_parser": "docstring-parser",
         "typing_extensions": "typing-extensions"}

pytestmark = pytest.mark.skipif(not (ROOT / ".ci").is_dir(), reason="not in a distribution")


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def recipe():
    return (ROOT / ".ci/conda/recipe.yaml").read_text(encoding="utf-8")


def test_the_version_is_the_same_everywhere(project, recipe):
    version = fecontact.__version__
    assert project["optional-dependencies"]["kernels"] == [f"fecontact-kernels=={version}"]
    assert f'version: "{version}"' in recipe
    assert f"version: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_recipe_requires_what_the_wheel_requires(project, recipe):
    lines = recipe.partition("  run:\n")[2].partition("\n\n")[0].splitlines()
    required = [line.removeprefix("    - ").replace(" ", "") for line in lines]
    assert required[0] == f"python{project['requires-python']}"
    # There are packages of conda for systems for which there are no wheels.
    everywhere = {entry.partition(";")[0] for entry in project["dependencies"]}
    assert {re.sub(r"^[\w-]+", lambda name: CONDA.get(name[0], name[0]), entry)
            for entry in required[1:]} == everywhere


@pytest.mark.parametrize("home", ["", "https://example.org/fecontact/"])
def test_links_of_the_readme_lead_to_the_home_that_is_named(monkeypatch, home):
    monkeypatch.setenv("FECONTACT_HOME", home)
    hook = runpy.run_path(str(ROOT / "hatch_build.py"))["Project"]
    metadata = {"version": "1.2"}
    hook(str(ROOT), {}).update(metadata)
    text = metadata["readme"]["text"]
    links = re.findall(r"\]\(([^)]+)\)", text)
    places = re.findall(r"\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(links) == len(places) > 20
    for link, place in zip(links, places, strict=True):
        kind = "raw" if place.endswith((".png", ".svg", ".gif")) else "blob"
        assert link == (f"{home}{kind}/v1.2/{place}" if home and ":" not in place else place)
    assert ("urls" in metadata) == bool(home)
