"""The site builds without warnings, links lead somewhere, tutorials run, examples have pages."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from site_modules import SITE, site_module

TUTORIALS = sorted(path.stem for path in (SITE.parent / "tutorials").glob("*.md")
                   if path.stem != "index")


def need_sphinx():
    for name in ("sphinx", "myst_parser", "furo", "jupytext"):
        pytest.importorskip(name, reason=f"the site needs {name}: pip install 'fecontact[docs]'")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site without what examples and tutorials give, which other tests run."""
    need_sphinx()
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run([sys.executable, str(SITE / "build.py"), str(folder), "--without-runs"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "html"


def test_site_builds_without_warnings_and_links_lead_somewhere(site):
    assert (site / "index.html").exists()
    assert list(site_module("check_links").problems(site)) == []


def test_equations_are_mathml(site):
    text = (site / "theory" / "contact.html").read_text(encoding="utf-8")
    assert text.count("<math") > 10
    assert "mathjax" not in text.lower()


def test_every_public_name_has_an_entry(site):
    names = site_module("public_names")
    for space in names.NAMESPACES:
        page = (site / "reference" / f"{space.rpartition('.')[2]}.html").read_text(encoding="utf-8")
        for name in names.names_of(space):
            assert f'id="{space}.{name}"' in page


def test_notebooks_are_offered(site):
    pytest.importorskip("nbformat", reason="needs nbformat")
    import nbformat

    found = sorted(path.stem for path in (site / "_downloads").rglob("*.ipynb"))
    assert found == TUTORIALS
    for path in (site / "_downloads").rglob("*.ipynb"):
        nbformat.validate(nbformat.read(path, as_version=4))


def test_gallery_shows_every_example():
    gallery = site_module("gallery")
    shown = [name for names in gallery.GROUPS.values() for name in names]
    assert sorted(shown) == sorted(path.stem for path in gallery.EXAMPLES.glob("*.py"))


def test_page_of_an_example_shows_what_it_gave(tmp_path):
    gallery, runs = site_module("gallery"), site_module("runs")
    job = next(job for job in gallery.jobs() if job.name == "stacked_blocks")
    told = []
    folder = runs.run(job, tmp_path, told.append)
    assert "matching meshes" in gallery.page("stacked_blocks", folder)
    assert len(told) == 1
    assert runs.run(job, tmp_path, told.append) == folder  # what is kept is not run again
    assert len(told) == 1


@pytest.mark.parametrize("name", TUTORIALS)
def test_tutorial_runs(name, tmp_path, monkeypatch):
    run_blocks, tutorials = site_module("run_blocks"), site_module("tutorials")
    page = SITE.parent / "tutorials" / f"{name}.md"
    monkeypatch.chdir(tmp_path)
    run_blocks.main(str(page), "results.json")
    given = tutorials.results(tmp_path)
    text = page.read_text(encoding="utf-8")
    shown = tutorials.with_results(text, given, name, tmp_path / "pictures")
    assert shown.count("](pictures/") == sum("png" in one for one in given)
    if name in SAYS:
        printed = "".join(one["printed"] + one.get("text", "") for one in given)
        SAYS[name](printed)
    pytest.importorskip("jupytext", reason="notebooks need jupytext")
    book = json.loads(tutorials.notebook(text, given))
    code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    assert len(code) == len(given) > 0


SAYS = {}


@pytest.mark.parametrize(("page", "problem"), [
    ('<a href="b.html">', "a.html: b.html is not there"),
    ('<a href="#x">', "a.html: #x has no such place"),
    ('<img src="https://example.org/x.png">', "a.html loads https://example.org/x.png"),
    ('<script src="//example.org/x.js"></script>', "a.html loads //example.org/x.js"),
    ('<link href="http://example.org/x.css">', "a.html loads http://example.org/x.css"),
    ('<a href="https://example.org">', None), ('<p id="x"><a href="a.html#x">', None),
])
def test_what_is_wrong_with_a_page_is_found(page, problem, tmp_path):
    Path(tmp_path / "a.html").write_text(page)
    assert list(site_module("check_links").problems(tmp_path)) == ([problem] if problem else [])


def test_stylesheets_from_elsewhere_are_found(tmp_path):
    (tmp_path / "a.css").write_text("@font-face { src: url(https://example.org/x.woff2) }")
    assert len(list(site_module("check_links").problems(tmp_path))) == 1
