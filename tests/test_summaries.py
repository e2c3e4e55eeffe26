"""Summaries of objects in consoles and notebooks: a short line, and a small table."""

from html.parser import HTMLParser

import numpy as np
import pytest
from synthetic import basis, run

import fecontact as fc
from fecontact.bifurcation import (
    Branch,
    BranchPoint,
    BranchTree,
    PeriodicMotion,
    StabilityMap,
    find_equilibrium,
    vector_field,
)
from fecontact.core.units import html_table, listed, span
from fecontact.integrate import Ensemble
from fecontact.laws import LinearContact
from fecontact.sweeps import SweepTable

TRICKY = "<b>\"left\" & 'right'</b>"
TOML = """
[geometry]
shape = "beam"
length = 0.2
height = 0.01
[basis]
modes = 6
contact_nodes = 4
[normal]
stiffness = 2e8
roughness_height = 2e-5
[friction]
static_coefficient = 0.6
kinetic_coefficient = 0.3
decay = 3.0
[ground]
speed = 1.2
[simulation]
t_end = 0.05
"""


class Table(HTMLParser):
    """Texts of the cells, row by row; open elements are closed in their order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.caption = [], [], ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attributes):
        assert tag in {"table", "caption", "thead", "tbody", "tr", "th", "td"}
        assert {name for name, _ in attributes} <= {"style"}
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("th", "td"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1] == "caption":
            self.caption += data
        else:
            assert self.open[-1] in ("th", "td")
            self.rows[-1][-1] += data


def branch(name="ground.speed", points=40):
    def at(p, kind=None):
        return BranchPoint(np.array([0.0, p]), np.array([0.0, 1.0]), {"stable": p < 1.0}, kind)

    several = [at(p) for p in np.linspace(0.5, 2.0, points)]
    return Branch(name, (*several[:10], at(1.0, "Hopf"), *several[10:], at(2.0, "fold")))


def table(name="load.normal"):
    return SweepTable(
        {name: tuple(np.linspace(1.0, 4.0, 20)), "friction.law": ("a", "b") * 10},
        {"friction_power": np.where(np.arange(20) == 3, np.nan, np.arange(20.0))},
        [f"{k}" for k in range(20)], ["fell <over>" if k == 3 else "" for k in range(20)])


def body():
    mesh = fc.generate(fc.Beam(length=0.2, height=0.01))
    return fc.ElasticBody(mesh, fc.Material.named("steel"), 0.02, fixed={"left": "xy"})


def stability_map():
    critical = np.array([[1.0 + 2.0j * np.pi * 50.0, -1.0 + 1.0j], [-1.0 + 2.0j, -1.0 + 1.0j]])
    return StabilityMap(("friction.friction_coefficient", "load.normal"), np.array([0.1, 0.6]),
                        np.array([2.0, 30.0]), np.zeros((2, 2, 4)), critical,
                        np.array([[2, 0], [0, -1]]))


def spiral():
    def rates(t, x, p, out):
        out[0] = p[0] * x[0] + 2.0 * np.pi * x[1]
        out[1] = p[0] * x[1] - 2.0 * np.pi * x[0]

    return vector_field(rates, {"a": 0.5}, ("x", "v"))


SHOWN = {
    "Trajectory": (lambda: run(times=41), ("finished", "20 ms", "41", "RoughSurface", "9000 Hz")),
    "Energies": (lambda: run(times=41).energies, ("stored: ", " at last; work: ", "lost: ",
                                                  "imbalance: ")),
    "ContactSystem": (lambda: run(times=11).system, (
        "RoughSurface", "ExponentialFriction", "20 mm/s", "contact nodes: 5", "9000 Hz")),
    "ContactEquilibrium": (lambda: fc.equilibrium(
        run(times=11).system.with_({"load.normal": 20.0})), (
        "kind: rest", "stable: yes", "in contact: 5 of 5", "normal force: 20 N",
        "friction force: 0 N")),
    "ModalBasis": (basis, ("modes: 5, 3 rigid", "2000, 9000 Hz", "ratios 0.01", "nodes: 5")),
    "ElasticBody": (body, ("80 quadrilaterals", "210 GPa", "0.02 m", "left in xy", "7850 kg/m³")),
    "Mesh": (lambda: body().mesh, ("nodes: 123", "0 ... 0.2 m", "0.002 m²",
                                   "boundary left: 2 edges")),
    "Branch": (branch, ("ground.speed", "0.5 ... 2", "42", "Hopf at 1", "fold at 2",
                        "13 of 40 regular")),
    "HopfPoint": (lambda: branch().of_kind("Hopf")[0], ("ground.speed: 1", "values: stable")),
    "BranchTree": (lambda: BranchTree({"sliding": branch()}, ["The branch 'b' fell."]), (
        "sliding: 0.5 ... 2, Hopf, fold, points", "note: The branch 'b' fell.")),
    "PeriodicMotion": (lambda: PeriodicMotion([0.0, 0.5, 1.0], [[0.0], [2.0], [0.0]], 1.0,
                                              state_names=["x"]), (
        "period: 1", "samples: 3", "x 0 ... 2")),
    "SweepTable": (table, ("cases: 20", "failed: 1", "load.normal 1 ... 4",
                           "friction.law of 2 values", "friction_power")),
    "Study": (lambda: fc.Study.from_toml(TOML), ("Beam", "modes: 6", "RoughSurface", "50 ms",
                                                 "1.2 m/s")),
    "Ensemble": (lambda: Ensemble(np.array([[0.0, 0.1, 0.2]] * 3), np.zeros((3, 3, 4)),
                                     (fc.Status.FINISHED, fc.Status.FAILED, fc.Status.FINISHED),
                                     np.array([7, 9, 8])),
                 ("runs: 3", "2 finished, 1 failed", "0 ... 0.2 s", "7 ... 9")),
    "FunctionField": (spiral, ("states: x, v", "parameters: a = 0.5")),
    "Equilibrium": (lambda: find_equilibrium(spiral()), (
        "parameters: a = 0.5", "stable: no", "growth rate: 0.5 1/s at 1 Hz")),
    "StabilityMap": (stability_map, ("load.normal: 2 ... 30", "unstable: 25 %", "50 Hz",
                                     "no equilibrium: 25 %")),
}


@pytest.mark.parametrize("name", SHOWN)
def test_what_matters_stands_in_a_short_line(name):
    make, facts = SHOWN[name]
    line = repr(make())
    assert len(line) < 400
    assert "\n" not in line
    assert line.startswith(f"<{name} ")
    assert [fact for fact in facts if fact not in line] == []


@pytest.mark.parametrize("name", SHOWN)
def test_notebooks_show_a_table(name):
    shown = SHOWN[name][0]()
    found = Table(shown._repr_html_())
    assert found.caption.startswith(name)
    assert len({len(row) for row in found.rows}) == 1
    if name != "SweepTable":
        assert found.rows == [list(pair) for pair in shown.summary()]


def test_a_sweep_shows_its_first_cases():
    found = Table(table()._repr_html_())
    assert found.rows[0] == ["case", "load.normal", "friction.law", "friction_power",
                             "failed because"]
    assert found.rows[4] == ["3", f"{1.0 + 9.0 / 19.0:.5g}", "b", "nan", "fell <over>"]
    assert "the first 12 are shown" in found.caption
    assert len(found.rows) == 13


def test_names_are_escaped_and_long_lists_cut():
    for shown in (branch(TRICKY), table(TRICKY)):
        text = shown._repr_html_()
        assert TRICKY not in text
        assert any(TRICKY in row for row in Table(text).rows)
    assert Table(html_table(TRICKY, [("a", "b")])).caption == TRICKY
    long = branch("a" * 5000)
    assert len(repr(long)) < 400
    assert repr(long).endswith("...>")
    nodes, cells = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]])
    assert len(repr(fc.Mesh(nodes, cells, {}, {f"point {k}": 0 for k in range(99)}))) < 400


def test_numbers_and_lists_for_people():
    assert span([0.3, np.nan, 9.6], "Hz") == "0.3 ... 9.6 Hz"
    assert span([2.0, 2.0]) == "2"
    assert span([]) == "none"
    assert listed(list("abcdef"), 2) == "a, b and 4 more"
    assert listed(list("ab"), 2) == "a, b"
    assert listed([]) == "none"


def test_matrices_and_groups_are_named():
    plain = basis()
    damped = plain.with_dashpots({"B": (10.0, 0.0)})
    assert "damping: full matrix" in repr(damped)
    rigid = plain.select([0, 1, 2])
    assert "modes: 3, 3 rigid; frequencies: none; damping: none" in repr(rigid)
    system = run(times=11).system
    both = fc.ContactSystem(
        fc.ModalBasis(plain.angular_frequencies, plain.damping, plain.T, plain.positions,
                      plain.tributary, groups=(("left", 2), ("right", 3))),
        normal={"left": system.normal, "right": LinearContact(stiffness=1e8)},
        friction=system.friction, load=fc.Load(normal=800.0),
        ground=fc.Ground(speed=-0.5, amplitude=1e-6, wavelength=0.01))
    line = repr(both)
    assert "contact nodes: 5 (2 left, 3 right)" in line
    assert "normal: RoughSurface (left), LinearContact (right)" in line
    assert "ground: -500 mm/s, 2 µm from valley to peak" in line
    assert "load: 800 N" in line


@pytest.mark.parametrize(("errors", "words"), [
    ((1e-6, 3e-6), "3.0e-06 or less, on 20 intervals"),
    ((1e-6, np.inf), "1.0e-06 or less, but could not be estimated at 1 of 2 points, "
                     "on 20 intervals"),
    ((np.inf, np.inf), "could not be estimated, on 20 intervals")])
def test_errors_that_could_not_be_estimated_are_said_in_words(errors, words):
    points = tuple(
        BranchPoint(np.array([0.0, p]), np.array([0.0, 1.0]),
                    {"state_error": error, "mesh": np.linspace(0.0, 1.0, 21)}, None)
        for p, error in enumerate(errors))
    assert ("state error", words) in Branch("ground.speed", points).summary()


def test_descriptions_show_what_differs_from_defaults():
    assert repr(fc.Drive()) == "Drive()"
    assert repr(fc.Ground(speed=1.0, centre=(0.0, 0.0))) == "Ground(speed=1.0)"
    load = fc.Load(5.0, forces=(fc.PointLoad("tip", signal=3.0),))
    assert repr(load) == f"Load(normal=5.0, forces=({load.forces[0]!r},))"
    assert repr(load.forces[0]).startswith("PointLoad(point='tip', signal=")
    assert eval(repr(fc.Ground(0.5, amplitude=1e-6)), {"Ground": fc.Ground}) == fc.Ground(
        0.5, amplitude=1e-6)


def test_a_stored_run_is_one_line(tmp_path):
    file = fc.write_case(tmp_path / "one.vtkhdf", run(), study=TOML)
    shown = repr(fc.read_case(file))
    assert shown.startswith("<Case ")
    assert "study: stored" in shown
    assert "speed" not in shown
    assert len(shown) < 1000
