"""Sweeps: the numbers of single runs, whatever computes them and whatever happens meanwhile."""

import math
import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from sweep_study import Serial, files_below, is_alive, write_study
from systems import TURN

from fecontact import AnalysisError, InputError, Study, read_case, sweep
from fecontact.core.files.atomic_write import _MARK
from fecontact.io import read_table
from fecontact.study import Span
from fecontact.sweeps.batch import UnwritableError, changed
from fecontact.sweeps.case import Row
from fecontact.sweeps.store import Store
from fecontact.sweeps.summaries import functions_for, summarise

AXES = {"ground.speed": [1e-3, 2e-3, 4e-3], "friction.static_coefficient": [0.6, 0.8]}


@pytest.fixture
def study(tmp_path):
    return Study.read(write_study(tmp_path))


@pytest.fixture
def counts(tmp_path, monkeypatch):
    """Speeds of the cases that were computed, one each time."""
    path = tmp_path / "counts"
    monkeypatch.setenv("SWEEP_COUNTS", str(path))

    def read():
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return sorted(float(line) for line in lines)

    return read


@pytest.mark.slow
def test_processes_give_the_numbers_of_single_runs_and_load_nothing_heavy(study, tmp_path):
    names = ("amplitude_x", "stick_fraction", "friction_power", "mean_normal_force")
    table = sweep(study, AXES, summaries=[*names, "own.py:heavy", "own.py:threads",
                                          "own.py:process"], workers=2)
    assert table.shape == (3, 2)
    assert table.parameters["ground.speed"] == (1e-3, 1e-3, 2e-3, 2e-3, 4e-3, 4e-3)
    functions = functions_for(names)
    for case in range(len(table)):
        alone = Study.read(tmp_path / "small.toml").with_(**table.changes(case)).run()
        assert summarise(alone, functions) == {name: table.values[name][case] for name in names}
    assert len(np.unique(table.values["amplitude_x"])) == 6
    assert (table.values["own.py:heavy"] == 0.0).all()
    assert (table.values["own.py:threads"] == 1.0).all()
    workers = {int(pid) for pid in table.values["own.py:process"]}
    assert os.getpid() not in workers
    assert not any(is_alive(pid) for pid in workers)
    again = read_table(tmp_path / "results/small-sweep/index.csv")
    assert again.parameters == table.parameters
    assert all((again.values[name] == table.values[name]).all() for name in table.values)


@pytest.mark.slow
def test_any_executor_gives_the_same_files(study, tmp_path):
    folders = {}
    with ThreadPoolExecutor(2) as threads:
        for name, executor in (("serial", Serial()), ("threads", threads), ("processes", None)):
            sweep(study, AXES, executor, folder=tmp_path / name, batch=2)
            folders[name] = files_below(tmp_path / name)
    assert len(folders["serial"]) == 3 + 1 + 2  # shards, basis, index and study
    assert folders["serial"] == folders["threads"] == folders["processes"]


def test_workers_know_the_places_of_loads(study, tmp_path):
    force = {"point": [0.05, 0.03], "signal": {"law": "constant", "value": -1.0}}
    loaded = study.with_(**{"load.forces": [force]})
    table = sweep(loaded, {"ground.speed": [1e-3, 2e-3]}, Serial(), folder=tmp_path / "f")
    assert not table.failed


def test_numbers_of_laws_change_as_they_do_in_the_study(study):
    for name, value in (("ground.speed", 3), ("friction.decay", 2.5), ("drive.damping_x", 0.5),
                        ("load.normal", 9.0), ("normal.stiffness", 1e6), ("simulation.rtol", 1e-5),
                        ("simulation.outputs", 7), ("basis.modes", 3), ("gap", 1e-6),
                        ("friction.law", "frictionless"), ("simulation.initial", "sliding")):
        assert changed(study, {name: value}) == study.with_(**{name: value}) != study


def test_members_of_lists_and_kept_bodies(study):
    force = {"point": "C", "component": "y", "signal": {"law": "harmonic", "amplitude": 1.0,
                                                        "frequency_hz": 5.0 / TURN}}
    loaded = study.with_(**{"load.forces": [force, force]})
    moved = loaded.with_(**{"load.forces.1.signal.amplitude": 3.0})
    assert [one.signal.amplitude for one in moved.load.forces] == [1.0, 3.0]
    with pytest.raises(InputError, match="'2' is none of the 2 members, counted from 0"):
        loaded.with_(**{"load.forces.2.signal.amplitude": 3.0})
    basis = study.modal_basis()
    assert study.with_(**{"ground.speed": 1.0}).modal_basis() is basis
    other = study.with_(**{"basis.modes": 3})
    assert other.elastic_body() is study.elastic_body()
    assert other.modal_basis() is not basis
    assert study.with_(**{"geometry.width": 0.13}).mesh() is not study.mesh()


def test_cases_are_known_by_what_they_are(study, tmp_path):
    """The way of asking does not matter: the same speeds are not computed again."""
    folder = tmp_path / "f"
    first = sweep(study, {"ground.speed": [1e-3, 2e-3]}, Serial(), folder=folder)
    second = sweep(study.with_(**{"ground.speed": 0.5}),
                   {"friction.static_coefficient": [0.8], "ground.speed": [2e-3, 3e-3, 1e-3]},
                   Serial(), folder=folder, resume=True)
    assert [second.keys[2], second.keys[0]] == first.keys
    assert len(list((folder / "shards").iterdir())) == 3
    other = sweep(study, {"ground.speed": [1e-3]}, Serial(), folder=folder, resume=True,
                  summaries=["amplitude_y"])
    assert other.keys[0] != first.keys[0]


def test_resuming_repeats_nothing_and_gives_the_files_of_an_undisturbed_sweep(
        study, tmp_path, counts):
    speeds = [1e-3, 2e-3, 3e-3, 4e-3, 5e-3]

    def run(**options):
        return sweep(study, {"ground.speed": speeds}, Serial(), folder=tmp_path / "f", batch=1,
                     summaries=["own.py:counted", "amplitude_x"], **options)

    whole = run()
    assert counts() == speeds
    files = files_below(tmp_path / "f")
    for path in sorted((tmp_path / "f/shards").iterdir())[1:4]:
        path.unlink()
    half = tmp_path / "f/shards/.x.json.1.part"
    half.mkdir()
    (half / "lock").write_bytes(_MARK)
    (half / "content.json").write_text("half")
    again = run(resume=True)
    assert len(counts()) == 3
    assert files_below(tmp_path / "f") == files
    assert (again.values["amplitude_x"] == whole.values["amplitude_x"]).all()
    with pytest.raises(InputError, match=r"f holds a sweep; go on with --resume \(resume=True\)"):
        run()
    assert files_below(tmp_path / "f") == files
    assert counts() == []
    run(overwrite=True)
    assert counts() == speeds


def test_failed_cases_have_reasons_and_do_not_stop_the_others(study, tmp_path, counts):
    axes = {"friction.static_coefficient": [0.6, 0.7, 0.8, -0.1], "ground.speed": [1e-3]}

    def run(**options):
        return sweep(study, axes, Serial(), folder=tmp_path / "f",
                     summaries=["own.py:counted", "own.py:failing", "amplitude_x"], **options)

    table = run()
    assert table.failed == {
        2: "ZeroDivisionError: a case that fails",
        3: f"{tmp_path}/small.toml: [friction]: static_coefficient = -0.1 must be zero or "
           f"above."}
    assert (np.isnan(table.values["amplitude_x"]) == [False, False, True, True]).all()
    lines = (tmp_path / "f/index.csv").read_text().splitlines()
    assert lines[3].endswith(",failed,ZeroDivisionError: a case that fails,")
    assert read_table(tmp_path / "f/index.csv").failed == table.failed
    assert len(counts()) == 3
    run(resume=True)
    assert len(counts()) == 0
    run(resume=True, retry=True)
    assert len(counts()) == 1


def test_a_summary_that_ends_the_program_is_a_failed_case(study, tmp_path):
    table = sweep(study, {"friction.static_coefficient": [0.6, 0.8, 0.7]}, Serial(),
                  folder=tmp_path / "f", summaries=["own.py:leaving"])
    assert table.failed == {1: "SystemExit: 0"}


@pytest.mark.slow
def test_a_case_that_ends_its_process_is_found_and_the_others_go_on(study, tmp_path):
    table = sweep(study, {"friction.static_coefficient": [0.5, 0.6, 0.8, 0.7]},
                  folder=tmp_path / "f", batch=2, workers=2,
                  summaries=["own.py:deadly", "amplitude_x"])
    assert list(table.failed) == [2]
    assert "ended without a message" in table.failed[2]
    assert np.isfinite(table.values["amplitude_x"][[0, 1, 3]]).all()


def test_files_of_cases_are_those_of_single_runs(study, tmp_path):
    one = study.with_(**{"output.frames": 3})
    table = sweep(one, AXES, Serial(), keep="fields", folder=tmp_path / "f")
    for case in (0, 5):
        alone = study.with_(**table.changes(case)).run()
        kept = read_case(table.file(case))
        assert (kept.trajectory.states == alone.states).all()
        assert (kept.trajectory.normal_force == alone.normal_force).all()
        assert Study.from_toml(kept.study).ground.speed == table.changes(case)["ground.speed"]
    import h5py

    with h5py.File(table.file(0)) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 3
    files = files_below(tmp_path / "f")
    table.file(3).unlink()
    sweep(one, AXES, Serial(), keep="fields", folder=tmp_path / "f", resume=True)
    assert files_below(tmp_path / "f") == files
    sweep(one, AXES, Serial(), keep="histories", folder=tmp_path / "h")
    kept = sorted((tmp_path / "h/cases").iterdir())
    assert len(kept) == 6
    with h5py.File(kept[0]) as file:
        assert "VTKHDF" not in file


def test_bases_about_a_loaded_state_depend_on_the_load(study):
    from fecontact.sweeps.case_key import case_keys

    for prestress in (False, True):
        bases = case_keys(study.with_(**{"basis.prestress": prestress}), ["load.normal"],
                          [[1.0], [2.0], [1.0]], {})[1]
        assert bases[0] == bases[2]
        assert (bases[0] == bases[1]) is not prestress


def test_bodies_that_change_are_computed_once_each(study, tmp_path, monkeypatch):
    from fecontact.study import BasisSettings

    made = []
    original = BasisSettings.modal_basis
    monkeypatch.setattr(BasisSettings, "modal_basis",
                        lambda self, body, *given: (made.append(body.thickness)
                                                    or original(self, body, *given)))
    axes = {"ground.speed": [1e-3, 2e-3, 3e-3], "body.thickness": [0.1, 0.11]}
    table = sweep(study, axes, Serial(), folder=tmp_path / "f", batch=2)
    assert sorted(made) == [0.1, 0.11]
    assert len(list((tmp_path / "f/bases").iterdir())) == 2
    made.clear()
    sweep(study, axes | {"body.thickness": [0.09, 0.115]}, Serial(), folder=tmp_path / "f",
          overwrite=True, batch=3)
    assert sorted(made) == [0.09, 0.115]  # each by the one batch that needs it
    assert not list((tmp_path / "f/bases").iterdir())
    alone = study.with_(**table.changes(5))
    values = summarise(alone.run(), functions_for(("friction_power",)))
    assert values["friction_power"] == table.values["friction_power"][5]
    broken = sweep(study, {"body.thickness": [0.1, -1.0], "ground.speed": [1e-3, 2e-3, 3e-3]},
                   Serial(), folder=tmp_path / "b", batch=1)
    assert list(broken.failed) == [3, 4, 5]
    assert "thickness = -1.0 must be" in broken.failed[4]


def test_growth_of_a_disturbance_is_that_of_the_linear_equation(tmp_path):
    """Through the whole way of a sweep: sigma = (N lambda (mu_0 - mu_inf) e^(-lambda V) - b)/2m."""
    path = write_study(tmp_path, text="""
geometry = { shape = "block", element_size = 0.06 }
body = { thickness = 0.1 }
basis = { modes = 2, contact_nodes = 1 }
normal = { stiffness = 10e6, roughness_height = 10e-6, damping = 40.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
load = { normal = 14.0 }
simulation = { initial = "sliding", t_end = 5.0, outputs = 2501 }
[drive]
stiffness_x = 5610.0
damping_x = 0.768
motion_x = { law = "pulse", kind = "haversine", amplitude = 1e-7, duration = 0.05 }
""")
    (tmp_path / "growth.py").write_text("""
import numpy as np
def rate(run):
    v = np.abs(run.velocity("B")[:, 0])
    peaks = 1 + np.flatnonzero((v[1:-1] > v[:-2]) & (v[1:-1] >= v[2:]))
    return np.polyfit(run.time[peaks], np.log(v[peaks]), 1)[0]
""")
    study = Study.read(path)
    table = sweep(study, {"ground.speed": [6e-3, 7e-3, 9e-3, 12e-3],
                          "friction.static_coefficient": [0.7, 0.8]}, Serial(), t_start=0.5,
                  summaries=["growth.py:rate", "dominant_frequency"])
    mass = 1.0 / study.modal_basis().T[0, 0, 0] ** 2
    assert mass == pytest.approx(7850.0 * 0.12 * 0.06 * 0.1, rel=1e-9)
    V, mu = table.column("ground.speed"), table.column("friction.static_coefficient")
    k = 1e6
    # with the smoothing (2/pi) arctan(k V), its slope included
    falling = 14.0 * ((mu - 0.55) * 1000.0 * np.exp(-1000.0 * V) * 2.0 / math.pi * np.arctan(k * V)
                      - ((mu - 0.55) * np.exp(-1000.0 * V) + 0.55) * 2.0 / math.pi * k
                      / (1.0 + (k * V) ** 2))
    expected = (falling - 0.768) / (2.0 * mass)
    assert table.values["growth.py:rate"] == pytest.approx(expected, abs=2e-4)
    assert (np.sign(expected) == [1, 1, 1, 1, -1, -1, -1, -1]).all()
    frequency = np.sqrt(5610.0 / mass - expected**2) / (2.0 * math.pi)
    assert table.values["dominant_frequency"] == pytest.approx(frequency, rel=2e-3)


def test_runs_that_an_event_stops_are_finished(study, tmp_path):
    """A free block falls from a height h and touches after sqrt(2 m h / F)."""
    falling = study.with_(**{
        "drive.stiffness_x": 0.0, "drive.amplitude_x": 0.0, "simulation.t_end": 0.2,
        "simulation.initial": {"displacement": [0.0, 1e-4, 0.0]}, "simulation.stop": ["touch-down"],
        "basis.modes": 3})
    loads = [7.0, 14.0, 28.0]
    table = sweep(falling, {"load.normal": loads}, Serial(), folder=tmp_path / "f",
                  summaries=["end_time"])
    assert not table.failed
    mass = 7850.0 * 0.12 * 0.06 * 0.1
    assert table.values["end_time"] == pytest.approx(
        np.sqrt(2.0 * mass * 1e-4 / np.array(loads)), rel=1e-3)


def test_two_sweeps_in_one_folder(study, tmp_path):
    """The lock keeps the second out; without locks shards of both fit together."""
    store = Store(tmp_path / "f")
    (tmp_path / "f").mkdir()
    with store.locked(), pytest.raises(InputError, match=r"Another sweep is at work in .*f; wait"):
        sweep(study, AXES, Serial(), folder=tmp_path / "f")
    sweep(study, AXES, Serial(), folder=tmp_path / "f")
    rows = [Row(case=f"{k:03}", values={"x": 0.1 * k}, reason="") for k in range(200)]

    def write():
        for k in range(200):
            store.add(rows[k : k + 1])

    pair = [threading.Thread(target=write) for _ in range(4)]
    for thread in pair:
        thread.start()
    for thread in pair:
        thread.join()
    found = store.rows()
    assert all(found[row["case"]] == row for row in rows)
    assert not list((tmp_path / "f/shards").glob("*.part"))


def test_a_full_disk_is_one_sentence_and_finished_cases_stay(study, tmp_path, monkeypatch):
    speeds = [1e-3, 2e-3, 3e-3]
    whole = sweep(study, {"ground.speed": speeds}, Serial(), folder=tmp_path / "w", batch=1)
    original, written = os.replace, []

    def replace(source, target):
        if str(target).endswith(".json"):
            written.append(target)
            if len(written) > 1:
                raise OSError(28, "No space left on device")
        return original(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(InputError, match=r"\.json cannot be written \(no space left on device\); "
                       r".* 1 of 3 cases are kept in .*; go on with --resume"):
        sweep(study, {"ground.speed": speeds}, Serial(), folder=tmp_path / "f", batch=1)
    monkeypatch.undo()
    assert len(read_table(tmp_path / "f/index.csv").missing) == 2
    table = sweep(study, {"ground.speed": speeds}, Serial(), folder=tmp_path / "f", batch=1,
                  resume=True)
    assert table.keys == whole.keys
    assert files_below(tmp_path / "f") == files_below(tmp_path / "w")


def test_a_case_that_cannot_be_written_stops_the_sweep(study, tmp_path, monkeypatch):
    from fecontact.output.files import case as store

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store, "write_case", full)
    with pytest.raises(UnwritableError, match=r"vtkhdf cannot be written \(no space left on "
                                              r"device\); .*\.$"):
        sweep(study, AXES, Serial(), keep="histories", folder=tmp_path / "f")


def test_an_executor_that_breaks(study, tmp_path):
    class Broken(Serial):
        calls = 0

        def submit(self, function, /, *arguments, **options):
            self.calls += 1
            if self.calls > 2:
                from concurrent.futures import BrokenExecutor

                raise BrokenExecutor
            return super().submit(function, *arguments, **options)

    with pytest.raises(AnalysisError, match=r"executor broke .* 2 of 3 cases are kept"):
        sweep(study, {"ground.speed": [1e-3, 2e-3, 3e-3]}, Broken(), folder=tmp_path / "f",
              batch=1)


def test_progress_is_told(study, tmp_path):
    told = []
    sweep(study, {"ground.speed": Span(1e-3, 4e-3, 4)}, Serial(), batch=2,
          folder=tmp_path / "f", progress=lambda *counts: told.append(counts))
    assert told == [(0, 0, 4), (2, 0, 4), (4, 0, 4)]


@pytest.mark.parametrize(("axes", "options", "message"), [
    ({"ground.spede": [1.0]}, {}, r"\[ground\] has no key 'spede' \(did you mean 'speed'\?\)"),
    ({"grund.speed": [1.0]}, {}, r"'grund' \(did you mean 'ground'\?\)"),
    ({"ground.speed": []}, {}, "ground.speed has no values; give at least one"),
    ({}, {}, "has no axes and no cases; name the parameters"),
    ({"ground.speed": 1.0}, {}, "ground.speed = 1.0 must be a table of start, end"),
    ({"ground.speed": Span(0.1, 1.0)}, {}, "lacks the key 'count'"),
    ({"ground.speed": [1.0, 2.0], "friction.decay": [1.0]}, {"method": "list"},
     "ground.speed has 2, friction.decay has 1"),
    ({"ground.speed": [1.0]}, {"method": "random"}, "needs samples"),
    ({"ground.speed": [1.0]}, {"method": "sensitivity", "samples": 12}, "power of two"),
    ({"ground.speed": [1.0]}, {"summaries": ["wear_depth"]},
     r"needs a wear law; give its coefficient in \[wear\]"),
    ({"ground.speed": [1.0]}, {"summaries": ["stick_part"]},
     r"no summary 'stick_part' \(did you mean 'stick_fraction'\?\)"),
    ({"ground.speed": [1.0]}, {"summaries": ["own.py:none"]}, "own.py has no function 'none'"),
    ({"ground.speed": [1.0]}, {"t_start": 1.0}, "t_start = 1 must lie before the end of the run"),
    ({"ground.speed": [1.0]}, {"sample": 3}, r"no key 'sample' \(did you mean 'samples'\?\)"),
    ({"ground.speed": [1.0]}, {"executor": 3}, "must have the methods of"),
    ({"ground.speed": [1.0]}, {"workers": 0}, "workers = 0 must be a whole number from 1"),
    ({"ground.speed": {"distribution": "normal", "mean": 1.0, "std": 0.1}}, {},
     "ground.speed is a distribution, which method = 'grid' cannot use"),
    ({"load.forces.0.point": ["B"]}, {}, "must be a list of tables of point"),
])
def test_bad_input_is_one_sentence(study, tmp_path, axes, options, message):
    with pytest.raises(InputError, match=message) as caught:
        sweep(study, axes, **{"executor": None if "workers" in options else Serial(),
                              "folder": tmp_path / "f", **options})
    assert "\n" not in str(caught.value)
    assert not list((tmp_path).glob("f/shards/*"))


def test_long_names_of_a_study_are_no_files(study, tmp_path):
    """No file has a name of more than 255 letters; systems report an error, not its absence."""
    name = "n" * 400
    table = sweep(study.with_(**{"basis.points": {name: "left"}}), {"ground.speed": [1e-3]},
                  executor=Serial(), folder=tmp_path / "long", summaries=[f"amplitude_x@{name}"])
    assert table.reasons == [""]
    assert table.values[f"amplitude_x@{name}"][0] > 0.0
