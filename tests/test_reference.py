"""The reference of public names: examples run, and names without one do not become more."""

import doctest
import re

import pytest
from site_modules import SITE, site_module

from fecontact.plot import rendering_problem

public_names = site_module("public_names")
FOLDER = SITE.parent / "reference"
SPACES = {space.rpartition(".")[2]: space for space in public_names.NAMESPACES}
CODE = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Public names without an example: none at the top level; these are left elsewhere.
MOST_LEFT = 0


def examples(stem):
    return CODE.findall((FOLDER / f"{stem}.md").read_text(encoding="utf-8"))


def left(stem):
    """Public names of a namespace that occur in none of its examples."""
    text = "\n".join(examples(stem))
    return [name for name in public_names.names_of(SPACES[stem])
            if not re.search(rf"\b{name}\b", text)]


@pytest.mark.parametrize("stem", SPACES)
def test_examples_of_the_reference_run(stem, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "\n".join(examples(stem))
    if rendering_problem() is not None:
        text = re.sub(r"^>>> .*\b(?:render(?:_mode|_wheel)?|picture)\(.*\n(?:[^>].*\n)*", "", text,
                      flags=re.MULTILINE)
    test = doctest.DocTestParser().get_doctest(text, {"__name__": "__main__"}, f"{stem}.md",
                                               f"{stem}.md", 0)
    assert test.examples
    told = []
    doctest.DocTestRunner(verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE
                          | doctest.ELLIPSIS).run(test, out=told.append)
    assert not told, "".join(told)


def test_top_level_names_have_examples():
    assert left("fecontact") == []


def test_names_without_an_example_do_not_become_more():
    names = [f"{SPACES[stem]}.{name}" for stem in SPACES for name in left(stem)]
    assert len(names) <= MOST_LEFT, names


@pytest.mark.parametrize("stem", SPACES)
def test_headings_are_public_names(stem):
    text = (FOLDER / f"{stem}.md").read_text(encoding="utf-8")
    page = public_names.completed(text, SPACES[stem])
    for name in public_names.names_of(SPACES[stem]):
        assert len(re.findall(rf":: {re.escape(SPACES[stem])}\.{name}$", page, re.MULTILINE)) == 1


def test_every_namespace_has_a_page():
    assert {path.stem for path in FOLDER.glob("*.md")} == {*SPACES, "index"}
    shown = (FOLDER / "index.md").read_text(encoding="utf-8")
    for space in public_names.NAMESPACES:
        assert f"<!-- names of {space} -->" in shown
