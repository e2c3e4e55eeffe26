"""The section [branch] of a study: what is followed, written and said."""

import csv

import numpy as np
import pytest

from fecontact import InputError, Study, simulate
from fecontact.bifurcation import BranchSettings
from fecontact.bifurcation import tree as module
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.diagram import follow_branches
from fecontact.cli import execute
from fecontact.io import read_branch, read_branches, write_branches

# The friction oscillator of section 4.3 without excitation, as a block of 5.632 kg.
STUDY = """
[geometry]
shape = "block"
width = 0.12
height = 0.06
contact_length = 0.08
drive_height = 0.01
element_size = 0.02

[body]
material = "steel"
thickness = 0.0996461

[basis]
modes = 3
select = [0, 1]
contact_nodes = 1
B = "B"
C = "top"

[normal]
stiffness = 10e6
roughness_height = 10e-6
damping = 40.0

[friction]
static_coefficient = 0.8
kinetic_coefficient = 0.55
decay = 1000.0
smoothing_slope = 1e6

[ground]
speed = 12e-3

[drive]
stiffness_x = 5610.0
damping_x = 0.768

[load]
normal = 14.0

[branch]
parameter = "ground.speed"
bounds = [6e-3, 14e-3]
start = 14e-3
switch = ["Hopf"]
show = "amplitude"
"""


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "block.toml"
    path.write_text(STUDY)
    return path


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_sliding_and_the_orbits_of_its_hopf_point(study, capsys):
    assert execute(["branch", str(study)]) == 0
    said = capsys.readouterr().out
    results = study.parent / "results"
    found = read_branches(results / "block-branch.h5")
    assert list(found) == ["steady sliding", "orbits"]
    hopf, = found["steady sliding"].of_kind("Hopf")
    assert hopf.parameter == pytest.approx(8.336533e-3, rel=1e-5)
    assert f"{hopf.parameter:.7g}" in said
    assert read_branch(results / "block-branch.h5").parameter_name == "ground.speed"
    for name in ("block-branch.png", "block-stability.png"):
        assert (results / name).stat().st_size > 10_000
    rows = rows_of(results / "block-branch.csv")
    assert len(rows) == sum(len(branch) for branch in found.values())
    orbits = [row for row in rows if row["branch"] == "orbits"]
    assert float(orbits[-1]["parameter"]) == pytest.approx(14e-3, rel=1e-9)
    assert {row["stable"] for row in orbits} == {"0"}
    assert float(orbits[-1]["frequency_hz"]) == pytest.approx(5.0230, abs=2e-4)
    amplitude = [float(row["amplitude"]) for row in orbits]
    assert (np.diff(amplitude) > 0.0).all()


def test_the_unstable_orbit_parts_sliding_from_stick_slip(study):
    described = Study.read(study)
    result = follow_branches(described.system(), described.branch)
    branch = result.found["orbits"]
    end = branch.points[-1]
    states = end.orbit(result.contact_field).states
    system = described.system().with_(**{"ground.speed": end.parameter})
    rest = result.found["steady sliding"].points[0].values["state"]
    sizes = []
    for factor in (0.9, 1.1):
        run = simulate(system, 4.0, initial=rest + factor * (states[0] - rest), outputs=4001)
        x = run.displacement("B")[:, 0]
        sizes.append([np.ptp(part) / 2.0 for part in (x[:400], x[-400:])])
    (inside, inside_later), (outside, outside_later) = sizes
    border = end.values["observed_amplitude"]
    assert inside_later < inside < border < outside < outside_later


def test_stick_slip_of_a_run(study):
    """Period and range at 1 mm/s are known from an independent calculation."""
    options = ["branch.kind=orbits", "branch.bounds=[1e-3, 1.1e-3]", "branch.start=1e-3",
                "branch.method=shooting", "branch.transient=10", "branch.longest_period=2",
                "branch.segments=2", "branch.step=0.05", "branch.largest_step=0.5",
                "branch.points=4"]
    assert execute(["branch", str(study), *(f"--set={text}" for text in options)]) == 0
    first = rows_of(study.parent / "results" / "block-branch.csv")[0]
    assert float(first["period"]) == pytest.approx(1.264348, abs=2e-5)
    assert float(first["minimum"]) == pytest.approx(0.796592e-3, abs=1e-8)
    assert float(first["maximum"]) == pytest.approx(1.953714e-3, abs=2e-8)
    assert first["stable"] == "1"
    assert not (study.parent / "results" / "block-stability.png").exists()


def test_interruption_keeps_what_is_there(study, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "_beyond", interrupted)
    assert execute(["branch", str(study)]) == 130
    assert list(read_branches("results/block-branch.h5")) == ["steady sliding"]


def test_branches_that_cannot_be_followed_are_named(study, monkeypatch, capsys):
    def failing(*_):
        raise InputError("nothing there.")

    monkeypatch.setattr(module, "_beyond", failing)
    assert execute(["branch", str(study)]) == 1
    assert "note: The branch 'orbits' was not followed: nothing there." in capsys.readouterr().out


def test_messages_of_branches_are_shown(study, monkeypatch, capsys):
    """A branch says there, for example, that a doubling may be hidden beside a fold."""
    hidden = "Beside the fold at 1.4876 a period doubling may be hidden."
    monkeypatch.setattr(Problem, "note", lambda *_: hidden)
    assert execute(["branch", str(study), "--set=branch.switch=[]"]) == 0
    assert f"note: {hidden}" in capsys.readouterr().out
    assert read_branch("results/block-branch.h5").message == hidden


@pytest.mark.parametrize(("arguments", "message"), [
    (["--set", "branch.bounds=[2, 1]"], "[branch]: bounds = [2.0, 1.0] must be two values"),
    (["--set", "branch.start=1.0"], "start = 1 must lie in the bounds, 0.006 to 0.014"),
    (["--set", 'branch.switch=["hopf"]'], "switch = 'hopf' is not known"),
    (["--set", "branch.point=D"], "'D'"),
    (["--set", "branch.parameter=ground.sped"], "did you mean 'ground.speed'"),
    (["--set", "branch.kind=orbits"], "give transient"),
    (["--set", "drive.damping_x=300.0", "--set", "branch.kind=orbits", "--set",
      "branch.transient=20.0", "--set",
      "branch.longest_period=1.0"], "comes to rest"),
    (["--set", "branch.poincare_scan=10"], "no time-dependent excitation"),
])
def test_errors_are_one_line(study, capsys, arguments, message):
    assert execute(["branch", str(study), *arguments]) == 1
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1


def test_settings_without_their_parts():
    with pytest.raises(InputError, match="lacks the key 'bounds'"):
        BranchSettings(parameter="ground.speed").checked_bounds  # noqa: B018
    with pytest.raises(InputError, match="lacks the key 'parameter'"):
        BranchSettings().checked_parameter  # noqa: B018
    assert BranchSettings(bounds=(1.0, 2.0)).first == 1.0


def test_no_branches_no_file(tmp_path):
    with pytest.raises(InputError, match="no branches to write"):
        write_branches(tmp_path / "none.h5", {})
    assert not list(tmp_path.iterdir())


def on_waves():
    """The oscillator on a wavy ground, with friction that falls more slowly, without branches."""
    text = STUDY[: STUDY.index("[branch]")]
    for old, new in (("decay = 1000.0", "decay = 50.0"), ("slope = 1e6", "slope = 1e3"),
                     ("speed = 12e-3", "speed = 20e-3\namplitude = 37e-6\nwavelength = 4.4e-3"),
                     ("damping_x = 0.768", "damping_x = 20.0")):
        assert old in text
        text = text.replace(old, new)
    return text


def test_a_study_follows_orbits_by_harmonic_balance(tmp_path):
    path, ranges = tmp_path / "waves.toml", []
    path.write_text(on_waves() + """
[branch]
parameter = "ground.amplitude"
bounds = [31e-6, 37e-6]
start = 37e-6
kind = "orbits"
transient = 60.0
points = 3
harmonics = 15
""")
    for method in ("collocation", "harmonic balance"):
        assert execute(["branch", str(path), "--set", f'branch.method="{method}"']) == 0
        found = read_branches(tmp_path / "results" / "waves-branch.h5")["orbits of the run"]
        assert (getattr(found.method, "harmonics", None) == 15) == (
            method == "harmonic balance")
        first = max(found.points, key=lambda point: point.parameter)
        ranges.append([first.values[f"observed_{end}"] for end in ("minimum", "maximum")])
    assert ranges[0] == pytest.approx(ranges[1], rel=1e-3)


@pytest.mark.slow
def test_a_study_follows_tori(tmp_path):
    path = tmp_path / "waves.toml"
    path.write_text(on_waves() + """
[simulation]
t_end = 20.0

[branch]
parameter = "ground.amplitude"
bounds = [31e-6, 37e-6]
start = 37e-6
kind = "orbits"
switch = ["Neimark-Sacker"]
transient = 60.0
step = 0.01
largest_step = 0.2
torus_harmonics = [6, 5]
""")
    assert execute(["branch", str(path)]) == 0
    found = read_branches(tmp_path / "results" / "waves-branch.h5")
    orbits, tori = found["orbits of the run"], found["orbits of the run, tori"]
    born, = orbits.of_kind("Neimark-Sacker")
    assert list(tori.attributes["torus_harmonics"]) == [6, 5]
    assert tori.points[0].parameter == pytest.approx(born.parameter, rel=1e-3)
    # Beside the point, tori and orbits have about the same range.
    assert tori.points[0].values["observed_maximum"] == pytest.approx(
        born.values["observed_maximum"], rel=0.02)
    rows = rows_of(tmp_path / "results" / "waves-branch.csv")
    assert sum(row["branch"] == "orbits of the run, tori" for row in rows) == len(tori)
    assert (tmp_path / "results" / "waves-branch.html").exists()
