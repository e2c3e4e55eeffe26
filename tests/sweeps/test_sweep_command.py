"""``fecontact sweep``: from a study file to a table and plots, and what it says."""

import os
import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from sweep_study import STUDY, Serial, write_study

from fecontact import InputError, sweep
from fecontact.cli.commands import sweep as command
from fecontact.cli.run_files import read_study
from fecontact.core.progress import clock
from fecontact.io import read_table
from fecontact.plot import plot_sobol, plot_sweep
from fecontact.sweeps import Estimate, SobolIndices, SweepTable, executors, plots, sobol_indices
from fecontact.sweeps.case_key import flat
from fecontact.sweeps.sweep import note

SWEEP = """
[sweep]
summaries = ["amplitude_x", "stick_fraction", "own.py:failing"]
[sweep.axes]
ground.speed = { start = 1e-3, end = 4e-3, count = 8, spacing = "log" }
friction.static_coefficient = [0.6, 0.7, 0.8]
"""


@pytest.fixture
def cli(cli, monkeypatch):
    """Run a command line, sweeps in this process: exit code, stdout, stderr."""
    monkeypatch.setattr(executors, "Processes", lambda count: executors.Pool(Serial()))
    return cli


def test_cases_beyond_the_limits_of_the_model_are_named(cli, tmp_path):
    """14 N and 1.4 kN on 0.3e6 N/m: 9 and 900 roughness heights."""
    study = write_study(tmp_path, """
[sweep]
summaries = ["stick_fraction"]
[sweep.axes]
load.normal = [14.0, 1400.0]
""")
    code, _, err = cli("sweep", study, "--set", "simulation.t_end=1e-3")
    assert code == 0
    assert err.startswith("warning: 1 of the cases leave the limits of the model")
    assert "case 1: In this run contact node" in err
    table = read_table(tmp_path / "results/small-sweep/index.csv")
    assert [bool(one) for one in table.warnings] == [False, True]


def test_a_sweep_of_a_study_file(cli, tmp_path):
    study = write_study(tmp_path, SWEEP)
    folder = tmp_path / "results/small-sweep"
    code, out, err = cli("sweep", study, "--set", "simulation.t_end=0.05")
    assert code == 0
    assert "24 cases, 8 failed" in out
    assert re.search(r"amplitude_x \[µm\] +\d\d", out)
    assert err == ("failed: cases 2, 5, 8, 11, 14, 17, 20, 23: ZeroDivisionError: a case that "
                   f"fails\n  case 2 alone: fecontact run {study} --set simulation.t_end=0.05 "
                   f"--set ground.speed=0.001 --set friction.static_coefficient=0.8\n")
    assert f"wrote {folder}/index.csv" in out
    assert {path.name for path in folder.glob("*.png")} == {
        "amplitude_x.png", "stick_fraction.png", "own-py-failing.png"}
    code, out, err = cli("sweep", study, "--set", "simulation.t_end=0.05")
    assert code == 1
    assert err == (f"error: {folder} holds a sweep; go on with --resume (resume=True), start again "
                   f"with --overwrite (overwrite=True), or choose another folder.\n")
    assert cli("sweep", study, "--set", "simulation.t_end=0.05", "--resume")[0] == 0
    assert len(read_table(folder / "index.csv")) == 24


def test_tables_and_pages_of_the_user_are_not_replaced(cli, tmp_path):
    study = write_study(tmp_path, SWEEP)
    for name, message in (("index.csv", "is of no sweep; choose another folder"),
                          ("index.html", "exists and is no page of fecontact")):
        mine = tmp_path / "out" / name
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("mine\n")
        for more in (), ("--resume",):
            code, _, err = cli("sweep", study, "--set", "simulation.t_end=0.01", "-o",
                               mine.parent, *more)
            assert (code, err.count("\n")) == (1, 1)
            assert f"{name} " in err
            assert message in err
        assert {path.name: path.read_text() for path in mine.parent.iterdir()
                if path.name != ".lock"} == {name: "mine\n"}
        mine.unlink()


def test_cases_are_printed_with_the_command_that_runs_each(cli, tmp_path):
    """The printed command runs the very case: its study has the values of the case."""
    study = write_study(tmp_path, """
[sweep]
summaries = ["amplitude_x", "own.py:failing"]
[[sweep.cases]]
ground.speed = 1e-3
friction.static_coefficient = 0.5
[[sweep.cases]]
ground.speed = 2e-3
friction.static_coefficient = 0.9
""")
    assert cli("sweep", study, "--set", "simulation.t_end=0.05")[0] == 0
    code, out, _ = cli("sweep", study, "--cases", "failed")
    assert code == 0
    case, command = out.splitlines()
    assert case == "case 1: ZeroDivisionError: a case that fails"
    words = shlex.split(command)
    assert words[:3] == ["fecontact", "run", str(study)]
    found = read_study(Path(words[2]), words[4::2])
    assert (found.ground.speed, found.friction.static_coefficient) == (2e-3, 0.9)
    assert found.simulation.t_end == 0.05
    first = cli("sweep", study, "--cases", "0")[1]
    assert re.match(r"case 0: amplitude_x = \d[\d.]* .?m, own.py:failing = 1\n  fecontact run",
                    first)
    code, _, err = cli("sweep", study, "--cases", "0,2")
    assert code == 1
    assert "numbers of cases from 0 to 1, like 3,17" in err


def test_printed_commands_are_of_the_study_that_was_swept(cli, tmp_path):
    """Assignments of the sweep, those in lists of tables too, whatever the file says since."""
    study = write_study(tmp_path, """
[sweep.axes]
ground.speed = [1e-3, 2e-3]
""")
    text = study.read_text().replace("load = { normal = 14.0 }", """
load = { normal = 14.0, forces = [{ point = "B", component = "x", signal = { law = "harmonic",
amplitude = 1.0, frequency_hz = 8.0 } }] }""".replace(",\n", ", "))
    study.write_text(text)
    given = ["--set", "simulation.t_end=0.02", "--set", "load.forces.0.signal.amplitude=0.5",
             "--set", "friction.law=constant", "--set", "friction.friction_coefficient=0.7"]
    code, _, err = cli("sweep", study, *given)
    assert (code, err) == (0, "")
    swept = read_study(study, [*given[1::2], "ground.speed=0.002"])
    study.write_text(text.replace("normal = 14.0,", "normal = 15.0,"))
    code, out, err = cli("sweep", study, "--cases", "1")
    assert (code, err) == (0, "")
    words = shlex.split(out.partition("\n  fecontact run")[2])
    assert flat(read_study(study, words[2::2])) == flat(swept)
    another = '{ signal = { law = "constant", value = 1.0 } }'
    study.write_text(text.replace(" } }] }", f" }} }}, {another}] }}"))
    code, _, err = cli("sweep", study, "--cases", "1")
    assert code == 0
    assert "has changed since the sweep in keys that --set does not change back" in err


@pytest.mark.slow
def test_drawn_samples_show_statistics_and_sensitivities(cli, tmp_path):
    axes = """
[sweep]
summaries = ["friction_power"]
method = "latin-hypercube"
samples = 16
[sweep.axes]
"ground.speed" = { distribution = "uniform", low = 1e-3, high = 2e-3 }
"load.normal" = { distribution = "normal", mean = 14.0, std = 1.0 }
"""
    study = write_study(tmp_path, axes)
    code, out, _ = cli("sweep", study, "-o", tmp_path / "a")
    assert code == 0
    assert re.search(r"power \[\S?W\] +mean +-?\d\S* +-?\d\S* \.\.\. -?\d\S* *\n +std", out)
    code, out, _ = cli("sweep", study, "-o", tmp_path / "b", "--set", "sweep.method=sensitivity")
    assert code == 0
    assert "64 cases, 0 failed" in out
    assert re.search(r"ground\.speed +-?\d\.\d\d", out)
    assert (tmp_path / "b/sensitivity.png").stat().st_size > 5000


def test_what_goes_wrong_is_one_sentence(cli, tmp_path):
    plain = write_study(tmp_path, name="plain.toml")
    assert cli("sweep", plain)[2] == (f"error: {plain} has no section [sweep]; add one with the "
                                      f"parameters that change in [sweep.axes].\n")
    study = write_study(tmp_path, SWEEP)
    code, _, err = cli("sweep", study, "--dask", "tcp://127.0.0.1:1", "--workers", 2)
    assert (code, err.count("\n")) == (1, 1)
    assert "leave it out with --dask" in err
    code, _, err = cli("sweep", study, "--set", "sweep.axes={ground.spede=[1.0]}")
    assert code == 1
    assert "[ground] has no key 'spede' (did you mean 'speed'?)" in err
    all_fail = write_study(tmp_path, """
[sweep]
summaries = ["own.py:failing"]
[sweep.axes]
friction.static_coefficient = [0.8, 0.9]
""", name="bad.toml")
    code, out, err = cli("sweep", all_fail)
    assert code == 1
    assert "2 cases, 2 failed" in out
    assert err.startswith("failed: cases 0, 1: ZeroDivisionError: a case that fails\n")


def test_ctrl_c_says_how_to_go_on(cli, tmp_path, monkeypatch):
    study = write_study(tmp_path, SWEEP)

    class Interrupted(Serial):
        def submit(self, *_, **__):
            raise KeyboardInterrupt

    monkeypatch.setattr(executors, "Processes", lambda count: executors.Pool(Interrupted()))
    code, _, err = cli("sweep", study)
    assert code == 130
    assert err == (f"Finished cases are kept in {tmp_path}/results/small-sweep; go on with "
                   f"--resume.\nerror: interrupted.\n")


def test_example_of_stick_and_slip(cli, tmp_path):
    """Below ln(N (mu_0 - mu_inf) lambda / b) / lambda it sticks and slips, above it slides."""
    code, _, _ = cli("sweep", Path(__file__).parents[2] / "examples/sweep_stick_slip.toml",
                     "-o", tmp_path, "--set", 'sweep.axes={"ground.speed"=[6e-3, 11e-3], '
                     '"friction.static_coefficient"=[0.7, 0.8]}')
    assert code == 0
    table = read_table(tmp_path / "index.csv")
    assert (table.values["stick_fraction"][:2] > 0.2).all()
    assert (table.values["amplitude_x"][2:] < 2e-6).all()
    assert (table.values["stick_fraction"][2:] == 0.0).all()


def test_rate_and_time_left():
    assert note(0, 0, 100, 0, 3.0) == "starting"
    assert note(60, 2, 100, 40, 10.0) == "2 cases/s, 0:20 left, 2 failed"
    assert note(5, 0, 100, 0, 50.0) == "10 s a case, 15:50 left"
    assert clock(7384.2) == "2:03:04"


def grid_table():
    speed, load = np.meshgrid(np.linspace(4.0, 1.0, 10), np.geomspace(1.0, 100.0, 9), indexing="ij")
    power = (speed * load).ravel()
    power[13] = np.nan
    return SweepTable(
        {"ground.speed": tuple(speed.ravel().tolist()),
         "load.normal": tuple(load.ravel().tolist())},
        {"friction_power": power}, [f"{k}" for k in range(90)],
        ["" if k != 13 else "fell over" for k in range(90)], shape=(10, 9))


def test_tables_are_one_call_away_from_pandas_and_xarray(tmp_path):
    table = grid_table()
    frame = table.to_pandas()
    # 13th case: the second speed, the fifth load; its mean over loads leaves it out.
    assert frame.loc[12, ["ground.speed", "load.normal"]].tolist() == pytest.approx(
        [4.0 - 1.0 / 3.0, 100.0 ** (3 / 8)])
    assert frame["status"].value_counts().to_dict() == {"finished": 89, "failed": 1}
    means = frame.groupby("ground.speed")["friction_power"].mean()
    assert means[1.0] == pytest.approx(np.geomspace(1.0, 100.0, 9).mean(), rel=1e-12)
    grid = table.to_xarray()
    assert grid.friction_power.dims == ("ground.speed", "load.normal")
    assert grid.friction_power.attrs["units"] == "W"
    near = grid.friction_power.sel({"ground.speed": 2.1, "load.normal": 9.0}, method="nearest")
    assert float(near) == pytest.approx(2.0 * 10.0, rel=1e-12)
    again = read_table(table.write(tmp_path / "index.csv"))
    assert again.to_xarray().equals(grid)
    assert again.to_pandas().equals(frame)
    loose = SweepTable({"a.b": (1.0, 2.0, 3.0), "a.c": (1.0, 2.0, 1.0)},
                       {"amplitude_x": np.arange(3.0)}, ["0", "1", "2"], [""] * 3)
    with pytest.raises(InputError, match="is not a grid"):
        loose.to_xarray()
    assert loose.to_pandas().shape == (3, 7)


def test_a_map_shows_each_case_in_its_place():
    figure = plots.plot_sweep(grid_table(), "friction_power")
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        "ground speed [m/s]", "load normal [N]")
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    drawn = axes.collections[0].get_array()
    x, y = np.linspace(1.0, 4.0, 10), np.geomspace(1.0, 100.0, 9)
    assert drawn.shape == (9, 10)
    assert drawn.mask.sum() == 1
    assert drawn.mask[13 % 9, 9 - 13 // 9]
    assert np.abs(drawn - y[:, None] * x).max() < 1e-9
    corners = np.asarray(axes.collections[0].get_coordinates())
    assert corners[0, :, 0] == pytest.approx(np.linspace(1.0 - 1.0 / 6.0, 4.0 + 1.0 / 6.0, 11))
    assert corners[:, 0, 1] == pytest.approx(10.0 ** np.linspace(-0.125, 2.125, 10))


def test_grids_of_three_by_three_are_maps_and_can_be_curves():
    speed, load = np.meshgrid([1e-3, 2e-3, 3e-3], [10.0, 20.0, 30.0], indexing="ij")
    small = SweepTable(
        {"ground.speed": tuple(speed.ravel()), "load.normal": tuple(load.ravel())},
        {"friction_power": (speed * load).ravel()}, [f"{k}" for k in range(9)], [""] * 9,
        shape=(3, 3))
    axes = plots.plot_sweep(small, "friction_power").axes[0]
    assert axes.collections[0].get_array().shape == (3, 3)
    assert axes.get_xlabel() == "ground speed [mm/s]"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1", "2", "3"]
    lines = plots.plot_sweep(small, "friction_power", kind="curves").axes[0].lines
    assert sum(len(line.get_xdata()) == 3 for line in lines) == 3
    assert len(plots.plot_sweep(small, "friction_power", kind="scatter").axes) == 3
    with pytest.raises(InputError, match="kind = 'mep' must be one of"):
        plots.plot_sweep(small, "friction_power", kind="mep")
    loose = SweepTable(small.parameters, small.values, small.keys, small.reasons)
    with pytest.raises(InputError, match="needs a grid of two numeric parameters"):
        plots.plot_sweep(loose, "friction_power", kind="map")


def test_curves_scatter_and_names_on_axes():
    grid = grid_table()
    few = SweepTable(
        {"friction.law": ("a", "b") * 5, "ground.speed": tuple(np.repeat(np.arange(5.0), 2))},
        {"amplitude_x": np.arange(10.0)}, [f"{k}" for k in range(10)], [""] * 10, shape=(5, 2))
    figure = plots.plot_sweep(few, "amplitude_x")
    curves = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 5]
    assert [curve.get_label() for curve in curves] == ["a", "b"]
    assert curves[1].get_ydata().tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
    over = plots.plot_sweep(grid, "friction_power", ["load.normal"]).axes[0]
    assert over.lines[0].get_linestyle() == "None"  # ten speeds at each load are no curve
    assert curves[0].get_linestyle() == "-"
    loose = SweepTable(grid.parameters, grid.values, grid.keys, grid.reasons)
    figure = plots.plot_sweep(loose, "friction_power")
    assert [axes.get_xlabel() for axes in figure.axes] == [
        "ground speed [m/s]", "load normal [N]", "cases"]
    assert figure.axes[2].patches


def test_names_on_axes_stay_apart_and_numbers_of_modes_are_whole():
    laws = ("exponential", "aluminium") * 4
    table = SweepTable(
        {"basis.modes": (3, 4) * 4, "friction.law": laws, "basis.reduction": laws,
         "body.material": tuple(f"materials/measured-{law}.csv" for law in laws)},
        {"amplitude_x": np.arange(8.0)}, [f"{k}" for k in range(8)], [""] * 8)
    figure = plots.plot_sweep(table, "amplitude_x")
    figure.canvas.draw()
    modes, law, other, material = figure.axes[:4]
    assert all(label.get_text().isdecimal() for label in modes.get_xticklabels())
    names = [label.get_window_extent() for axes in (law, other) for label in axes.get_xticklabels()]
    assert all(left.x1 < right.x0 for left, right in pairwise(names))
    assert [label.get_rotation() for label in material.get_xticklabels()] == [30.0, 30.0]


def test_plots_of_sweeps_as_files(tmp_path):
    table = grid_table()
    plot_sweep(table, "friction_power", path=tmp_path / "m.png")
    assert (tmp_path / "m.png").stat().st_size > 5000
    plot_sweep(table, "friction_power", over=["load.normal"], path=tmp_path / "c.svg")
    with pytest.raises(InputError, match=r"no column 'friction_powr' \(did you mean"):
        plot_sweep(table, "friction_powr")
    with pytest.raises(InputError, match=r"'ground\.speed' is a parameter of the sweep"):
        plot_sweep(table, "ground.speed")
    one = Estimate(0.5, 0.4, 0.6)
    found = SobolIndices({"a": one, "b": one}, {"a": one, "b": one}, 64)
    plot_sobol({"f": found, "g": found}, path=tmp_path / "s.png")
    assert (tmp_path / "s.png").stat().st_size > 5000


def test_tables_read_from_files_know_the_places_of_forces(tmp_path):
    """In the folder of its sweep; a table that was moved has the names alone."""
    forces = 'forces = [{ point = "B", component = "y", signal = { law = "constant", value = 1 } }]'
    study = write_study(tmp_path, text=STUDY.replace("normal = 14.0", f"normal = 14.0, {forces}"))
    force = "load.forces.0.signal.value"
    sweep(study, {name: {"distribution": "uniform", "low": low, "high": low + 2.0}
                  for name, low in ((force, -2.0), ("load.normal", 10.0))},
          method="sensitivity", samples=8, summaries=["mean_normal_force"], executor=Serial(),
          folder=tmp_path / "found")
    table = read_table(tmp_path / "found/index.csv")
    assert plot_sweep(table, "mean_normal_force").axes[0].get_xlabel() == "force at B y [N]"
    axes = plot_sobol({"force": sobol_indices(table, "mean_normal_force")}).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["force at B y [N]",
                                                                      "load normal [N]"]
    (tmp_path / "found/sweep.toml").write_text("[geometry")
    moved = read_table(tmp_path / "found/index.csv")
    assert moved.label(force) == "value of force 0"
    assert moved.label("load.normal") == "load normal [N]"


def test_reading_a_table_runs_no_code(tmp_path):
    """The study beside it may name a law in a file, which a stranger may have written."""
    study = write_study(tmp_path)
    sweep(study, {"ground.speed": [1e-3, 2e-3]}, summaries=["mean_normal_force"],
          executor=Serial(), folder=tmp_path / "found")
    file = tmp_path / "found/stranger.py"
    file.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    stored = tmp_path / "found/sweep.toml"
    text = stored.read_text()
    assert "[friction]\n" in text
    foreign = f'[friction]\nlaw = "{file}:Law"\n'
    stored.write_text(re.sub(r"\[friction\]\n(law = .*\n)?", foreign, text))
    table = read_table(tmp_path / "found/index.csv")
    assert table.label("ground.speed") == "ground speed [m/s]"
    assert not (tmp_path / "ran").exists()


def test_names_of_files_are_safe_and_different():
    names = ["own.py:f", "amplitude_x@B", "amplitude_x@a/b", "amplitude_x@a:B", "n" * 400]
    assert command._file_names(names) == dict(zip(names, [
        "own-py-f", "amplitude_x-B", "amplitude_x-a-b", "amplitude_x-a-B-2", "n" * 120],
        strict=True))


@pytest.mark.slow
def test_a_script_without_main_guard_is_told(tmp_path):
    """Worker processes import the script; unguarded it would start sweeps of its own."""
    write_study(tmp_path)
    (tmp_path / "script.py").write_text(
        "import fecontact\n"
        "fecontact.sweep('small.toml', {'ground.speed': [1e-3, 2e-3]}, workers=1)\n")
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True,
                          text=True, timeout=180.0,
                          env={**os.environ,
                               "PYTHONPATH": str(Path(__file__).parents[2])})
    assert done.returncode == 1
    assert "must call sweep below if __name__ == '__main__'" in done.stderr.splitlines()[-1]


def test_tables_that_are_none(tmp_path):
    with pytest.raises(InputError, match="does not exist; run the sweep first"):
        read_table(tmp_path / "index.csv")
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"x\.csv is not the table of a sweep"):
        read_table(tmp_path / "x.csv")
    (tmp_path / "f/shards").mkdir(parents=True)
    (tmp_path / f"f/shards/{24 * 'a'}.json").write_text('{"rows": [{"case":')
    with pytest.raises(InputError, match=r"a\.json is damaged; remove it, and its cases"):
        sweep(write_study(tmp_path), {"ground.speed": [1.0]}, Serial(), folder=tmp_path / "f",
              resume=True)
