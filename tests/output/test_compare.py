"""Runs over each other: motions that are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from report_reading import Shown
from response_study import STUDY as RESPONSE_STUDY
from synthetic import basis
from test_report_branches import STUDY as BRANCH_STUDY

import fecontact as fc
from fecontact import ContactSystem, InputError
from fecontact.analysis import compare_runs
from fecontact.bifurcation.diagram import follow_branches
from fecontact.bifurcation.responses import follow_responses
from fecontact.cli import execute
from fecontact.io import report_runs, write_branches
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import plot_runs
from fecontact.system.columns import POWERS

TURN = 2.0 * np.pi
STUDIES = ("[ground]\nspeed = 0.1\n[output]\nframes = 3\n",
           "[ground]\nspeed = 0.2\n[output]\nframes = 5\n"
           "[sweep]\nkeep = 'histories'\n[sweep.axes]\n'ground.speed' = [0.1]\n"
           "[friction]\nlaw = 'constant'\nfriction_coefficient = 0.55\n")


def vibration(amplitude, hertz, outputs=1001, contact_nodes=5):
    shapes = basis(contact_nodes=contact_nodes)
    system = ContactSystem(shapes, normal=LinearContact(stiffness=1e6),
                           friction=ConstantFriction(0.3, smoothing_slope=200.0))
    t = np.linspace(0.0, 1.0, outputs)
    q, v = np.zeros((2, outputs, shapes.modes))
    q[:, 0], v[:, 0] = amplitude * np.cos(TURN * hertz * t), (
        -amplitude * TURN * hertz * np.sin(TURN * hertz * t))
    q[:, 1] = -1e-5
    return fc.Trajectory(system, t, q, v, np.zeros((outputs, len(POWERS))))


@pytest.fixture(scope="module")
def runs():
    return {"slow": vibration(1e-3, 20.0), "fast": vibration(1.5e-3, 25.0, outputs=801)}


def test_differences_of_parameters_and_numbers(runs):
    found = compare_runs(runs, ["B"], studies=STUDIES)
    assert found.parameters == {
        "ground.speed": ("0.1", "0.2"), "friction.law": ("", "constant"),
        "friction.friction_coefficient": ("", "0.55")}
    assert found.change("amplitude_x@B") == pytest.approx(0.5, rel=2e-2)
    assert found.change("dominant_frequency@B") == pytest.approx(0.25, rel=1e-2)
    assert found.change("mean_normal_force") == pytest.approx(0.0, abs=1e-9)
    rows = {row[0]: row[1:] for row in found.number_rows()}
    assert rows["steady"] == ("yes, periodic with 50 ms", "yes, periodic with 40 ms")
    assert rows["amplitude x at B"][0] == "1 mm"
    assert rows["amplitude x at B"][1].startswith("1.5 mm (+")


def test_pictures_of_runs_over_each_other(runs):
    upper, lower = plot_runs(runs, "displacement", "B", "x").axes
    assert [line.get_label() for line in upper.lines] == ["slow", "fast"]
    for line, amplitude in zip(upper.lines, (1e-3, 1.5e-3), strict=True):
        assert line.get_ydata().max() == pytest.approx(amplitude, rel=1e-2)
    for line, hertz in zip(lower.lines, (20.0, 25.0), strict=True):
        assert line.get_xdata()[line.get_ydata().argmax()] == pytest.approx(hertz, abs=0.3)


def test_the_page_of_a_comparison(runs, tmp_path):
    page = Shown(report_runs(runs, tmp_path / "two.html", studies=STUDIES))
    assert page.header["names"] == ["slow", "fast"]
    assert ["ground.speed", "0.1", "0.2"] in page.header["parameters"]
    curve = page.array("charts", 0, "lines", 0, "y") * page.header["charts"][0]["factor"]
    time = page.array("time")
    assert curve == pytest.approx(1e-3 * np.cos(TURN * 20.0 * time), abs=3e-5)
    spectrum = page.header["spectra"][0]
    assert spectrum["title"] == "velocity x of B"
    for number, hertz in enumerate((20.0, 25.0)):
        frequency, height = (page.array("spectra", 0, "lines", number, name) for name in "xy")
        assert frequency[height.argmax()] == pytest.approx(hertz, abs=0.3)


def test_what_cannot_be_compared(runs, tmp_path):
    with pytest.raises(InputError, match="1 run cannot be compared; give two or more"):
        compare_runs({"slow": runs["slow"]})
    with pytest.raises(InputError, match="1 studies do not match 2 runs"):
        compare_runs(runs, studies=[None])
    with pytest.raises(InputError, match="slow: Contact node 9 does not exist; there are 5"):
        compare_runs(runs, [9])
    q = runs["fast"].modal_coordinates.copy()
    q[80] = np.nan
    gap = replace(runs["fast"], modal_coordinates=q)
    with pytest.raises(InputError, match=r"fast has a motion that is not finite at t = 0\.1 s"):
        report_runs({**runs, "fast": gap}, tmp_path / "a.html")


def clamped(run, *points):
    """The run of a body whose first points do not move."""
    T = run.basis.T.copy()
    T[list(points)] = 0.0
    return replace(run, system=replace(run.system, basis=replace(run.basis, T=T)))


def test_different_bodies_are_compared_at_a_point_that_moves_in_both(runs, tmp_path):
    two = {"whole": runs["slow"], "clamped": clamped(runs["fast"], 0, 4)}
    assert "amplitude_x@C" in compare_runs(two).numbers[0].values
    assert plot_runs(two).axes[0].get_ylabel().startswith("velocity x of C")
    page = Shown(report_runs(two, tmp_path / "two.html"))
    assert page.header["spectra"][0]["title"] == "velocity x of C"


def test_bodies_without_a_common_point_are_refused_before_anything_is_written(
        runs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    few = vibration(1e-3, 20.0, contact_nodes=2)
    fc.write_case("many.vtkhdf", clamped(runs["slow"], 0, 1), frames=2)
    fc.write_case("few.vtkhdf", clamped(few, 0, 1), frames=2)
    assert execute(["compare", "many.vtkhdf", "few.vtkhdf"]) == 1
    said = capsys.readouterr()
    assert "few lacks the default point of many; name a point of all runs, on the command line " \
        "by --point: Contact node 2 does not exist; there are 2" in said.err
    assert said.out == ""
    assert execute(["compare", "many.vtkhdf", "few.vtkhdf", "--point", "0"]) == 0


def test_the_command(runs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for (name, run), study in zip(runs.items(), STUDIES, strict=True):
        fc.write_case(f"{name}.vtkhdf", run, frames=2, study=study)
    assert execute(["compare", "slow.vtkhdf", "fast.vtkhdf", "--point", "B"]) == 0
    out = capsys.readouterr().out
    assert "ground.speed" in out
    assert "dominant frequency at B" in out
    assert (tmp_path / "slow-compare.html").is_file()
    assert (tmp_path / "slow-compare.png").is_file()
    assert execute(["compare", "slow.vtkhdf"]) == 1
    assert "compare takes two files or more, not 1" in capsys.readouterr().err


@pytest.mark.parametrize("over", ["drive.frequency_hz", "ground.speed"])
def test_responses_and_branches_over_each_other(over, tmp_path, capsys):
    """Files of two studies: the value that differs stands in the table, the curves in a picture."""
    if over == "ground.speed":
        text = BRANCH_STUDY.replace("bounds = [7e-3, 12e-3]", "bounds = [11.9e-3, 12e-3]")
        found = fc.Study.from_toml(text)
        result = follow_branches(found.system(), found.branch)
        branches = result.found
    else:
        text = RESPONSE_STUDY.replace("[8.0, 13.0]", "[8.0, 8.1]")
        found = fc.Study.from_toml(text)
        response = follow_responses(found.system(), found.response).response
        branches = {str(level): one for level, one in enumerate(response.branches)}
    files = []
    for name, load in (("light", 14.0), ("heavy", 15.0)):
        files.append(tmp_path / f"{name}.h5")
        write_branches(files[-1], branches, system=found.system(), study=found.with_(
            **{"load.normal": load}).to_toml())
    assert execute(["compare", *map(str, files)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "parameter, in SI units light heavy" in out
    assert "load.normal 14 15" in out
    assert f"wrote {tmp_path}/light-compare.png" in out
    assert imread(tmp_path / "light-compare.png").std() > 0.02
