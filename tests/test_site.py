"""The site builds without warnings, links lead somewhere, tutorials run, examples have pages."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from site_modules import SITE, site_module

TUTORIALS = sorted(path.stem for path in (SITE.parent / "tutorials").glob("*.md")
                   if path.stem != "index")

def need_sphinx():
    for name in ("sphinx", "myst_nb", "sphinx_gallery", "furo", "ziamath"):
        pytest.importorskip(name, reason=f"the site needs {name}: pip install 'fecontact[docs]'")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site without what examples and tutorials give, which other tests run."""
    need_sphinx()
    folder = tmp_path_factory.mktemp("site")
    if "PYTEST_XDIST_WORKER" in os.environ:
        # Processes that run tests share one folder: the first of them builds the site.
        folder = tmp_path_factory.getbasetemp().parent / "site"
        try:
            folder.mkdir()
        except FileExistsError:
            end = time.monotonic() + 900.0
            while not (folder / "ended").exists() and time.monotonic() < end:
                time.sleep(0.2)
            assert (folder / "ended").read_text() == "0", "the site was not built"
            return folder / "html"
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-D", "plot_gallery=0", "-D",
         "nb_execution_mode=off", "-d", str(folder / "doctrees"), str(SITE.parent),
         str(folder / "html")], capture_output=True, text=True)
    (folder / "ended").write_text(str(done.returncode))
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "html"


def test_site_builds_without_warnings_and_links_lead_somewhere(site):
    assert (site / "index.html").exists()
    assert list(site_module("check_links").problems(site)) == []


def test_equations_are_mathml(site):
    text = (site / "theory" / "contact.html").read_text(encoding="utf-8")
    assert text.count("<math") > 10
    assert not re.search(r"<script[^>]*(mathjax|katex)", text, re.IGNORECASE)


def test_every_public_name_has_an_entry(site):
    names = site_module("public_names")
    for space in names.NAMESPACES:
        page = (site / "reference" / f"{space.rpartition('.')[2]}.html").read_text(encoding="utf-8")
        for name in names.names_of(space):
            assert f'id="{space}.{name}"' in page


def test_notebooks_are_offered(site):
    pytest.importorskip("nbformat", reason="needs nbformat")
    import nbformat

    found = {path.stem for path in (site / "_downloads").rglob("*.ipynb")}
    # Some versions of the gallery offer its examples too.
    examples = {path.stem for path in (SITE.parents[1] / "examples").glob("*.py")}
    assert set(TUTORIALS) <= found <= {*TUTORIALS, *examples}
    for path in (site / "_downloads").rglob("*.ipynb"):
        nbformat.validate(nbformat.read(path, as_version=4))


def test_gallery_shows_every_example(site):
    need_sphinx()
    gallery = site_module("gallery")
    examples = {path.stem for path in (gallery.ROOT / "examples").glob("*.py")}
    assert sorted(gallery.ORDER) == sorted(examples)
    index = (site / "gallery" / "index.html").read_text(encoding="utf-8")
    for name in examples:
        assert f'href="{name}.html' in index


def test_pictures_of_an_example_end_on_its_page(tmp_path, monkeypatch):
    need_sphinx()
    gallery = site_module("gallery")
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    for name in ("first.png", "second.png", "film.mp4"):
        (tmp_path / name).write_bytes(b"-")
    pages = tmp_path / "pages"
    (pages / "images").mkdir(parents=True)
    numbered = iter([pages / "images" / "a_001.png", pages / "images" / "a_002.png"])
    shown = gallery.written(None, {"image_path_iterator": numbered}, {"src_dir": str(pages)})
    assert "a_001.png" in shown
    assert "a_002.png" in shown
    assert "film.mp4" in shown
    assert list(tmp_path.glob("*.*")) == []
    assert (pages / "_static" / "gallery" / "film.mp4").exists()


@pytest.mark.parametrize("name", TUTORIALS)
def test_tutorial_runs(name, tmp_path):
    need_sphinx()
    from myst_nb.core.read import read_myst_markdown_notebook
    from nbclient import NotebookClient

    text = (SITE.parent / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    book = read_myst_markdown_notebook(text)
    NotebookClient(book, timeout=900, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [one for cell in book.cells if cell.cell_type == "code" for one in cell.outputs]
    assert not any(one.get("name") == "stderr" for one in outputs)
    SAYS[name]("".join(one.get("text", "") + one.get("data", {}).get("text/plain", "")
                       for one in outputs))


def numbers(pattern, printed):
    return [float(text) for text in re.findall(pattern, printed)]


def says_own_mesh(printed):
    assert numbers(r"([\d.]+) mm2", printed) == [892.5]
    assert numbers(r"([\d.]+) N on the face", printed) == [500.0]
    assert "The run reached its end." in printed


def says_squeal(printed):
    predicted, found = numbers(r"([\d.]+) 1/s, a run grows by", printed) + numbers(
        r"grows by ([\d.]+) 1/s", printed)
    assert found == pytest.approx(predicted, rel=0.05)


def says_bifurcation_diagram(printed):
    # Sextro prints 7.09 and 8.09; a run outside of the unstable orbit meets the stable one.
    assert numbers(r"Hopf at B = ([\d.]+)", printed)[1] == pytest.approx(7.09, abs=0.005)
    assert numbers(r"doubling at B = ([\d.]+)", printed)[0] == pytest.approx(8.09, abs=0.005)
    stable, inside, outside = numbers(r"stable orbit ([\d.]+) m\n", printed) + numbers(
        r"amplitude ([\d.]+) m", printed)
    assert outside == pytest.approx(stable, rel=1e-3)
    assert inside < 0.1 * stable


def says_set_valued(printed):
    differences = numbers(r"differs by ([\d.]+)%", printed)
    assert len(differences) == 4
    assert differences == sorted(differences, reverse=True)
    assert differences[-1] < 2.0


def says_which_integrator(printed):
    errors = numbers(r"error ([\d.e-]+),", printed)
    assert len(errors) == 3
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]
    assert numbers(r"([\d.e-]+) of the range", printed)[0] < 1e-6


def says_friction_law(printed):
    ratios = numbers(r"damping ratio ([+-][\d.]+)", printed)
    assert len(ratios) == 4
    # Slow modes of a mass of 1 kg: (b + mu' F) / (2 sqrt(c m)).
    slopes = numbers(r"slope +(-?[\d.]+) s/m", printed)
    for ratio, slope in zip(ratios, slopes, strict=True):
        assert ratio == pytest.approx((4.0 + 20.0 * slope) / (2.0 * 4000.0**0.5), abs=2e-3)


def says_basis(printed):
    for tolerance, missing in zip((30.0, 10.0, 3.0), numbers(
            r"coordinates, ([\d.]+)% is missing", printed), strict=True):
        assert missing <= tolerance
    forces = numbers(r"modes: ([\d.]+) N", printed)
    assert forces == pytest.approx([forces[-1]] * 3, rel=1e-3)


def says_cluster(printed):
    assert "failed: 0" in printed
    assert "True" in printed


def says_contact_stiffness(printed):
    # u^2 = 2 R_Z F / c up to u = R_Z, F / c + R_Z / 2 above.
    assert numbers(r"approach ([\d.]+) um", printed) == pytest.approx([15.0, 4.47, 1.41], abs=0.005)


def says_fitted_joint(printed):
    (value, low, high), (deflection, *ends) = [
        numbers(r"([\d.]+)", line.partition(":")[2].replace("95 %", "")) for line in
        printed.splitlines() if ", 95 % from" in line]
    assert low < 0.3 < high < 1.03 * low
    assert ends[0] < 4e-4 < ends[1] < 1.06 * ends[0]
    assert low < value < high
    assert ends[0] < deflection < ends[1]
    assert "growing while" in printed
    linear, profiled = np.array(numbers(r"([\d.]+)", printed.splitlines()[-1])).reshape(2, 2)
    assert profiled == pytest.approx(linear, rel=2e-3)


SAYS = {"fitted-joint": says_fitted_joint, "own-mesh": says_own_mesh, "squeal": says_squeal,
        "basis": says_basis,
        "bifurcation-diagram": says_bifurcation_diagram, "friction-law": says_friction_law,
        "set-valued-or-smoothed": says_set_valued, "which-integrator": says_which_integrator,
        "cluster": says_cluster, "contact-stiffness": says_contact_stiffness}


def test_what_tutorials_say_is_checked():
    assert sorted(SAYS) == TUTORIALS


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


def test_every_picture_of_a_page_can_be_made_again():
    made = {name for names in site_module("page_images").MAKERS.values() for name in names}
    images = Path(__file__).parents[1] / "docs" / "images"
    # The example of the deck that is no part of the package makes these images.
    made |= {"brake_reuss_backbone", "brake_reuss_pressure"}
    assert made == {path.stem for path in images.glob("*.png")}
    assert max(path.stat().st_size for path in images.rglob("*.png")) < 250_000
