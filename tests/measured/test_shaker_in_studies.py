"""Shakers that a study describes, beside their closed form and the same in Python."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.analysis import receptance
from fecontact.io import read_measurement, report
from fecontact.measured import Shaker

STUDY = """
[bodies.beam]
geometry = { shape = "beam", length = 0.3, height = 0.01, element_size = 0.01 }
body = { material = "steel", thickness = 0.03, fixed = { left = "xy" } }
basis = { modes = 3, damping = 0.01, points = { tip = [0.3, 0.005], drive = [0.06, 0.0] } }

[links.shaker]
kind = "shaker"
first = "beam.drive"
armature_mass = 0.05
suspension_stiffness = 2e3
suspension_damping = 2.0
stinger_stiffness = 2e6
stinger_damping = 3.0
force_factor = 8.0
resistance = 3.0
inductance = 3e-4

[[load.forces]]
point = "shaker.coil"
component = "x"
signal = { law = "harmonic", amplitude = 2.0, frequency_hz = 60.0 }

[simulation]
t_end = 0.25
outputs = 4097
initial = "rest"

[measurement]
rate_hz = 2048.0

[[measurement.sensors]]
link = "shaker"
name = "force"
mass = 0.006

[[measurement.sensors]]
point = "beam.tip"
direction = "+y"
name = "tip"
"""
PLACES = [("drive", "y"), ("tip", "y")]


def frequencies(study):
    return study.reduced.basis.frequencies_hz


@pytest.fixture
def path(tmp_path):
    written = tmp_path / "shaken.toml"
    written.write_text(STUDY)
    return written


def test_a_voltage_moves_the_tip_as_in_closed_form(path):
    """Force on the beam U G / (1 + Z (H + 1 / k)), and the motion that it makes at the tip."""
    bare = path.with_name("bare.toml")
    bare.write_text(STUDY.partition("[measurement]")[0])
    study = fc.Study.read(bare)
    assert fc.Study.from_toml(study.to_toml(), bare) == study
    hertz = np.linspace(20.0, 400.0, 96)
    s = 2j * np.pi * hertz
    H, tip = receptance(study.modal_bases()["beam"], hertz, PLACES[:1],
                        PLACES).values[:, :, 0].T
    drive = 8.0 / (3.0 + 3e-4 * s)
    Z = 2e3 + 2.0 * s + 0.05 * s**2 + 8.0 * s * drive
    found = receptance(study.system(), hertz, [("shaker.coil", "x")], [("beam.tip", "y")])
    assert found.values[:, 0, 0] == pytest.approx(
        drive * tip / (1.0 + Z * (H + 1.0 / (2e6 + 3.0 * s))), rel=1e-7)


def test_a_current_is_that_of_python(path):
    changed = STUDY.replace("resistance = 3.0\ninductance = 3e-4\n", "")
    study = fc.Study.from_toml(changed, path)
    shaker = Shaker(0.05, 2e3, 2.0, 2e6, 3.0, force_factor=8.0)
    same = fc.ContactSystem(
        bodies={**study.modal_bases(), "shaker": shaker.basis()},
        links={"shaker": shaker.stinger("beam.drive")}, load=study.load)
    bare = fc.Study.from_toml(changed.partition("[measurement]")[0], path)
    assert frequencies(bare) == pytest.approx(same.basis.frequencies_hz)
    # The gauge at the stinger loads the beam.
    assert frequencies(study)[1] < 0.999 * same.basis.frequencies_hz[1]


def test_sensors_read_it(path, cli):
    code, out, _ = cli("measure", str(path))
    assert code == 0
    assert "force" in out
    found = read_measurement(path.parent / "results" / "shaken-measured.uff")
    assert found.names == ("force", "tip")
    assert np.ptp(found.values[:, 0]) > 1.0
    heavier = fc.Study.read(path).with_({"links.shaker.armature_mass": 0.2})
    # The charge of the coil has the first one, zero.
    assert frequencies(heavier)[1] < 0.999 * frequencies(fc.Study.read(path))[1]


def test_the_page_of_a_run_draws_the_bodies_that_have_a_mesh(path):
    run = fc.Study.read(path).run()
    text = report(run, path.with_suffix(".html")).read_text(encoding="utf-8")
    assert len(text) > 50_000


@pytest.mark.parametrize(("old", "new", "told"), [
    ('"beam.drive"', '"rod.drive"', "there is no body 'rod'"),
    ('"beam.drive"', '"beam.driv"', "no point or boundary 'driv'"),
    ("armature_mass = 0.05", "armature_mass = 0.0", "armature_mass = 0"),
    ("armature_mass = 0.05", "armature = 0.05", "did you mean 'armature_mass'"),
    ("armature_mass = 0.05", "", "lacks the key 'armature_mass'"),
    ("resistance = 3.0\n", "", "give the resistance too"),
    ("force_factor = 8.0", "direction = [0.0, 0.0, 1.0]", "must have 2 components"),
    ('"shaker.coil"', '"shaker.coli"', "did you mean 'shaker.coil'"),
    ('link = "shaker"', 'link = "stinger"', "link = 'stinger' is no linear spring"),
])
def test_what_is_wrong_is_told(old, new, told, path, cli):
    assert old in STUDY
    path.write_text(STUDY.replace(old, new))
    code, _, said = cli("measure", str(path))
    assert code == 1
    assert told in said
    assert said.count("\n") == 1
