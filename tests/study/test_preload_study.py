"""The section [preload] of a study, the command ``preload`` and runs that start at its end."""

import subprocess
import sys

import numpy as np
import pytest

from fecontact import InputError, LoadPath, Study, load_history
from fecontact.cli import execute
from fecontact.plot import plot_loop, plot_shear

BLOCK = """
geometry = { shape = "block", width = 0.1, height = 0.04, element_size = 0.01 }
body = { material = "steel", thickness = 0.02 }
basis = { modes = 8, contact_nodes = 9, damping = 0.01 }
normal = { law = "linear", stiffness = 2e8, damping = 2e3 }
friction = { law = "iwan", stiffness = 1e8, friction_coefficient = 0.4 }
drive = { stiffness_x = 1e9 }
load = { normal = 500.0 }

[preload]
motion_x = [0.0, 3e-6, -3e-6, 3e-6]
steps = 10
rtol = 1e-6

[simulation]
t_end = 1e-3
outputs = 11
initial = "preload"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "block.toml"
    path.write_text(BLOCK)
    return path


def test_the_section_is_the_path(file):
    study = Study.read(file)
    history = study.load_history()
    same = load_history(study.system(), LoadPath(motion_x=(0.0, 3e-6, -3e-6, 3e-6), steps=10))
    assert history.friction_force == pytest.approx(same.friction_force)
    assert history.status == "finished"
    assert Study.from_toml(study.to_toml(), study.path) == study
    assert abs(history.imbalance[-1]) < 1e-5 * history.work[-1]
    # The area is the loss and what the first cycle leaves stored, in the body and by the load.
    fine = study.with_(**{"preload.steps": 200}).load_history()
    first, last = fine.row(1), fine.row(3)
    stored = (fine.stored - fine.works[:, 0])[last] - (fine.stored - fine.works[:, 0])[first]
    assert fine.loop(1, 3).area == pytest.approx(fine.loop(1, 3).loss + stored, rel=1e-4)
    assert history.loop(1, 3).loss == pytest.approx(fine.loop(1, 3).loss, rel=1e-5)


def test_command_writes_table_and_plots(file, capsys):
    assert execute(["preload", str(file), "--modes"]) == 0
    said = capsys.readouterr().out
    assert "finished" in said
    assert "frequency [Hz]" in said
    results = file.parent / "results"
    table = np.genfromtxt(results / "block-preload.csv", delimiter=",", names=True)
    history = Study.read(file).load_history()
    assert len(table) == 31
    assert table["loss_J"] == pytest.approx(history.loss)
    assert table["friction_force_N_4"] == pytest.approx(history.friction_force[:, 4])
    for kind in ("shear", "loop"):
        assert (results / f"block-{kind}.png").stat().st_size > 10_000


def test_command_says_where_nothing_holds_the_body(file, capsys):
    file.write_text(file.read_text().replace("motion_x = [0.0, 3e-6, -3e-6, 3e-6]",
                                             "forces = [[0.0, 300.0]]").replace(
        "drive = { stiffness_x = 1e9 }", "").replace(
        "load = { normal = 500.0 }", "load = { normal = 500.0, forces = [{ point = \"C\", "
        "component = \"x\", signal = { law = \"constant\", value = 0.0 } }] }"))
    assert execute(["preload", str(file)]) == 1
    said = capsys.readouterr()
    assert "no equilibrium" in said.err
    assert "Traceback" not in said.err


def test_a_run_starts_at_the_end_of_the_path(file):
    study = Study.read(file)
    history = study.load_history()
    run = study.with_(**{"drive.motion_x": {"law": "constant", "value": 3e-6}}).run()
    assert run.modal_coordinates[0] == pytest.approx(history.modal_coordinates[-1])
    # Elements at their limits start a little below them, by 2e-8 of the limit.
    assert np.abs(run.modal_coordinates - run.modal_coordinates[0]).max() < 2e-8 * np.abs(
        run.modal_coordinates[0]).max()


def test_what_is_missing_is_told(file):
    file.write_text(file.read_text().split("[preload]")[0]
                    + "[simulation]\nt_end = 1e-3\ninitial = 'preload'\n")
    with pytest.raises(InputError, match=r"lacks the section \[preload\]"):
        Study.read(file).run()


def test_plots_check_what_they_draw(file):
    history = Study.read(file).load_history()
    with pytest.raises(InputError, match="vertex = 9"):
        plot_shear(history, 9)
    with pytest.raises(InputError, match="action = 'travvel'"):
        plot_loop(history, action="travvel")


SOLID = """
body = { material = "steel" }
basis = { modes = 12, contact_nodes = [3, 2], damping = 0.01 }
normal = { law = "linear", stiffness = 2e8, damping = 2e3 }
friction = { law = "jenkins", stiffness = 1e8, friction_coefficient = 0.4 }
drive = { stiffness_x = 1e9, stiffness_y = 1e9 }
load = { normal = 500.0 }

[geometry]
shape = "solid-block"
length = 0.06
width = 0.04
height = 0.02
element_size = 0.02

[preload]
motion_x = [0.0, 3e-6, 3e-6, -3e-6]
motion_y = [0.0, 0.0, 3e-6, 0.0]
motion_z = 0.0
travel_y = [0.0, 0.0, -1e-6, 0.0]
steps = 10
rtol = 1e-5

[simulation]
t_end = 1e-3
outputs = 11
initial = "preload"
"""


@pytest.fixture
def solid_file(tmp_path):
    path = tmp_path / "solid.toml"
    path.write_text(SOLID)
    return path


def test_a_solid_is_loaded_along_two_directions(solid_file, capsys):
    study = Study.read(solid_file)
    history = study.load_history()
    same = load_history(study.system(), LoadPath(
        motion_x=(0.0, 3e-6, 3e-6, -3e-6), motion_y=(0.0, 0.0, 3e-6, 0.0),
        travel_y=(0.0, 0.0, -1e-6, 0.0), steps=10), rtol=1e-5)
    assert history.friction_forces == pytest.approx(same.friction_forces)
    assert (np.abs(history.friction_forces.sum(axis=1))[20] > 20.0).all()
    assert Study.from_toml(study.to_toml(), study.path) == study
    assert execute(["preload", str(solid_file), "--modes"]) == 0
    said = capsys.readouterr().out
    assert "finished" in said
    results = solid_file.parent / "results"
    table = np.genfromtxt(results / "solid-preload.csv", delimiter=",", names=True)
    assert table["loss_J"] == pytest.approx(history.loss)
    assert table["travel_y_m"] == pytest.approx(history.travels[:, 1])
    for k, name in enumerate(("", "_across")):
        assert table[f"friction_force{name}_N_4"] == pytest.approx(history.friction_forces[:, 4, k])
        assert table[f"slip{name}_m_5"] == pytest.approx(history.slips[:, 5, k])
    for kind in ("shear", "loop"):
        assert (results / f"solid-{kind}.png").stat().st_size > 10_000


def test_a_run_of_a_solid_starts_at_the_end_of_the_path(solid_file):
    study = Study.read(solid_file)
    history = study.load_history()
    constant = {"law": "constant", "value": -3e-6}
    run = study.with_(**{"drive.motion_x": constant}).run()
    assert run.modal_coordinates[0] == pytest.approx(history.modal_coordinates[-1])
    assert np.abs(run.modal_coordinates - run.modal_coordinates[0]).max() < 1e-8 * np.abs(
        run.modal_coordinates[0]).max()


def test_keys_of_solids_are_refused_for_plane_bodies(file):
    file.write_text(file.read_text().replace(
        "steps = 10", "steps = 10\ntravel_y = [0.0, 1e-6, 0.0, 0.0]"))
    with pytest.raises(InputError, match=r"\[preload\]: travel_y is for solids"):
        Study.read(file).load_history()


# Refuses to start workers, and tells what was there before.
SWEPT = """
import sys
from fecontact import Study, sweep

class Refused(Exception):
    pass

def refuse(*given):
    raise Refused("fecontact.system.quasistatic.march" in sys.modules)

vars(sys.modules["fecontact.sweeps.sweep"])["opened"] = refuse
try:
    sweep(Study.read(sys.argv[1]), {"load.normal": [400.0, 500.0]})
except Refused as told:
    print(told)
"""


@pytest.mark.slow
def test_kernels_are_there_before_workers_of_a_sweep_start(file):
    """Otherwise each of them would compile them."""
    done = subprocess.run([sys.executable, "-c", SWEPT, str(file)], capture_output=True, text=True,
                          check=True)
    assert done.stdout == "True\n"
