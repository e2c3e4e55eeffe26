"""Basins and diagrams in blocks: kept in a folder, ended and taken up again, on other processes."""

import concurrent.futures
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pytest
from systems import TURN, friction_oscillator, impact_oscillator

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import Axis, basins, poincare_scan
from fecontact.bifurcation.attractors import blocks as in_blocks
from fecontact.bifurcation.attractors.attractor import distinguished
from fecontact.bifurcation.attractors.blocks import Place, work_off
from fecontact.bifurcation.attractors.labels import Settled
from fecontact.integrate import strobe
from fecontact.laws import DahlFriction

FREQUENCY = "drive.frequency_hz"
# Impacts once in three periods, and a motion of one period, beside each other.
PLACES, SPEEDS = np.linspace(-4e-4, 2e-3, 12), np.linspace(-0.06, 0.06, 11)


def two_motions(**settings):
    return basins(impact_oscillator(1, 47.5), (Axis("B", "y"), PLACES),
                  (Axis("B", "y", "velocity"), SPEEDS), transient_periods=150, keep=8, **settings)


def sliding(**settings):
    """Motions of a mass on a belt whose friction has an internal variable, from 72 starts."""
    system = friction_oscillator(2, friction=DahlFriction(0.5, 1e5))
    return basins(system, (Axis("B", "x"), PLACES), (Axis("B", "x", "velocity"), SPEEDS[:6]),
                  transient_periods=5, keep=4, **settings)


def same(one, other):
    assert (one.label == other.label).all()
    assert [each.kind for each in one.attractors] == [each.kind for each in other.attractors]
    for each, twin in zip(one.attractors, other.attractors, strict=True):
        assert (each.points == twin.points).all()
        assert each.share == twin.share


def apart_in_python(points, rows, still, scale, tolerance):
    """Labels and numbers of points of the motions, distinguished step by step in Python."""
    labels, motions = [], []
    for each, count, rests in zip(points, rows, still, strict=True):
        labels.append(-1)
        if count < 0:
            continue
        x = each[:count] / scale
        period = next((p for p in range(1, count // 2 + 1)
                       if np.abs(x[p:] - x[:-p]).max() < tolerance), None)
        kind = "equilibrium" if rests else "periodic" if period else "aperiodic"
        own = x if rests or not period else x[-period:]
        for number, (other, known) in enumerate(motions):
            if other != kind:
                continue
            if kind == "aperiodic":
                allowed = 0.2 * np.maximum(np.ptp(own, axis=0), np.ptp(known, axis=0)) + tolerance
                alike = (np.abs(own.min(axis=0) - known.min(axis=0)) <= allowed).all() and (
                    np.abs(own.max(axis=0) - known.max(axis=0)) <= allowed).all()
            else:
                apart = np.abs(own[:, None] - known[None]).max(axis=2)
                alike = max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 2.0 * tolerance
            if alike:
                labels[-1] = number
                if kind == "periodic" and len(own) < len(known):
                    motions[number] = kind, own
                break
        else:
            labels[-1] = len(motions)
            motions.append((kind, own))
    return np.array(labels), motions


def test_motions_are_told_apart_as_step_by_step():
    """Motions of periods 1 to 4, chaos and rest in two states of very different size."""
    rng = np.random.default_rng(3)
    size, kept, runs = np.array([1e-4, 30.0]), 12, 400
    orbits = [rng.normal(size=(period, 2)) for period in (1, 2, 2, 3, 4)]
    points, rows = np.full((runs, kept, 2), np.nan), np.full(runs, kept)
    still = (rng.random(runs) < 0.1).astype(np.int64)
    for e in range(runs):
        kind = rng.integers(7)
        if kind < 5:
            orbit = np.roll(orbits[kind], rng.integers(4), axis=0)
            x = np.resize(orbit, (kept, 2)) + 1e-4 * rng.uniform(-1.0, 1.0, (kept, 2))
        else:
            x = rng.uniform(-1.0, 1.0, (kept, 2)) + (3.0 if kind == 6 else 0.0)
        if still[e]:
            x, rows[e] = x[:1], 1
        points[e, : len(x)] = size * x
    rows[rng.random(runs) < 0.05] = -1
    expected, motions = apart_in_python(points, rows, still, size, 1e-3)
    assert len(motions) > 10
    counts = np.bincount(expected[expected >= 0])
    order = np.argsort(-counts, kind="stable")
    for cuts in ([], [1, 150, 151]):
        parts = [lambda p=p, r=r, s=s: Settled(p, r, s) for p, r, s in zip(
            np.split(points, cuts), np.split(rows, cuts), np.split(still, cuts), strict=True)]
        labels, attractors = distinguished(parts, size, 1e-3)
        assert (np.where(labels < 0, -1, order[labels]) == expected).all()
        for rank, one in zip(order, attractors, strict=True):
            assert one.kind == motions[rank][0]
            assert one.points / size == pytest.approx(motions[rank][1], rel=1e-15)
            assert one.share == counts[rank] / runs


@pytest.mark.parametrize(("apart", "motions"), [(1.98e-3, 1), (2.02e-3, 2)])
def test_motions_are_the_same_within_twice_the_tolerance(apart, motions):
    x = np.ones((2, 8, 1))
    x[1] += apart
    labels, found = distinguished(
        [lambda: Settled(x, np.full(2, 8), np.zeros(2, dtype=np.int64))], np.ones(1), 1e-3)
    assert len(found) == motions
    assert labels.max() == motions - 1


def test_a_motion_has_its_least_period():
    """Runs that have not quite settled repeat after two periods; those that have, after one."""
    x = np.ones((3, 8, 1))
    x[0, ::2] += 1.5e-3
    labels, (motion,) = distinguished(
        [lambda: Settled(x, np.full(3, 8), np.zeros(3, dtype=np.int64))], np.ones(1), 1e-3)
    assert (labels == 0).all()
    assert motion.points.tolist() == [[1.0]]


@pytest.fixture(scope="module")
def pool():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as processes:
        yield processes


def test_blocks_of_runs_side_by_side_are_as_all_of_them(tmp_path):
    """Few runs with internal variables are computed one by one: all runs count, not those here."""
    whole = sliding()
    assert len(whole.attractors) >= 1
    same(whole, sliding(folder=tmp_path, workers=1))


@pytest.mark.slow
def test_a_folder_and_processes_change_nothing(tmp_path, pool):
    plain = two_motions(workers=1)
    assert len(plain.attractors) > 1
    assert (plain.label >= 0).all()
    told = []
    same(plain, two_motions(workers=2, folder=tmp_path / "own", progress=told.append))
    assert told[-1] == plain.label.size
    blocks = sorted((tmp_path / "own").glob("*.npz"))
    assert len(blocks) > 4
    written = [path.stat().st_mtime_ns for path in blocks]
    same(plain, two_motions(folder=tmp_path / "own"))
    assert [path.stat().st_mtime_ns for path in blocks] == written
    same(plain, two_motions(folder=tmp_path / "pool", executor=pool))
    for one, other in zip(blocks, sorted((tmp_path / "pool").glob("*.npz")), strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_labels_are_those_of_single_runs():
    """Runs from some starts end on the orbits of their labels, of three periods and of one."""
    system = impact_oscillator(1, 47.5)
    found = two_motions()
    assert [len(one.points) for one in found.attractors] == [3, 1]
    assert [one.share for one in found.attractors] == pytest.approx([0.64, 0.36], abs=0.05)
    shape = system.basis.T[0, 1, 0]
    for i, j in [*np.argwhere(found.label == 0)[::20], *np.argwhere(found.label == 1)[::20]]:
        state = np.array([PLACES[i], SPEEDS[j]]) / shape
        alone = strobe(system, transient_periods=150, keep=8, initial=state).states[0]
        orbit = found.attractors[found.label[i, j]].points
        off = np.abs(alone[:, None] - orbit[None]) / np.abs(orbit).max(axis=0)
        assert off.max(axis=2).min(axis=1).max() < 2e-3


KILLED = """
import sys
sys.path[:0] = {paths!r}
from test_runs_in_blocks import scanned, two_motions
two_motions(workers=1, folder=sys.argv[1] + "/basins")
scanned(workers=1, folder=sys.argv[1] + "/scan")
"""


def scanned(**settings):
    return poincare_scan(impact_oscillator(1), FREQUENCY, np.linspace(23.0, 33.0, 48) / TURN,
                         transient_periods=60, keep=6, initial=np.zeros(2), **settings)


@pytest.mark.slow
def test_what_was_killed_goes_on_to_the_same_result(tmp_path):
    """Killed three times, at blocks of basins and chains of a diagram: not a bit differs."""
    script = tmp_path / "script.py"
    script.write_text(KILLED.format(paths=[path for path in sys.path if path]))
    done, killed = 0, 0
    for wanted in (2, 5, 9):
        process = subprocess.Popen([sys.executable, str(script), str(tmp_path)],
                                   env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        while process.poll() is None and done < wanted:
            time.sleep(0.002)
            done = len(list(tmp_path.glob("*/*.npz")))
        killed += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert killed
    same(two_motions(), two_motions(folder=tmp_path / "basins"))
    one, other = scanned(), scanned(folder=tmp_path / "scan")
    assert (one.up == other.up).all()
    assert (one.down == other.down).all()
    assert not list(tmp_path.glob("*/.*.part"))


def test_a_diagram_does_not_depend_on_the_machine(monkeypatch, tmp_path, pool):
    """Chains are cut by the number of values alone, not by cores, threads or processes."""
    found = []
    for cores in (1, 7):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append(scanned())
    found.append(scanned(folder=tmp_path / "pool", executor=pool))
    for one in found[1:]:
        assert (one.up == found[0].up).all()
        assert (one.down == found[0].down).all()


class Broken:
    """Executes some calls, then breaks."""

    def __init__(self, calls):
        self.calls = calls

    def submit(self, function, argument):
        future = Future()
        self.calls -= 1
        if self.calls < 0:
            future.set_exception(BrokenProcessPool("a process ended."))
        else:
            future.set_result(function(argument))
        return future


def test_a_broken_executor_loses_only_its_own_blocks(tmp_path):
    with pytest.raises(AnalysisError, match=r"broke \(a process ended\); finished blocks are kept"):
        two_motions(folder=tmp_path / "a", executor=Broken(3))
    assert len(list((tmp_path / "a").glob("*.npz"))) == 3
    same(two_motions(), two_motions(folder=tmp_path / "a"))


def test_folders_of_others_are_refused(tmp_path):
    folder = tmp_path / "a"
    scanned(folder=folder)
    with pytest.raises(InputError, match="another system, grid or version"):
        two_motions(folder=folder)
    for changes in ({"rtol": 1e-7}, {"chains": 3}, {"down": False}):
        with pytest.raises(InputError, match="another system, grid or version"):
            scanned(folder=folder, **changes)
    block = folder / "000001.npz"
    content = block.read_bytes()
    block.write_bytes(content[:-40])
    with pytest.raises(InputError, match=r"000001\.npz is damaged; remove it, and its runs are"):
        scanned(folder=folder)
    block.unlink()
    scanned(folder=folder)
    assert block.read_bytes() == content
    (folder / "blocks.json").write_text("[]")
    with pytest.raises(InputError, match=r"blocks\.json is not of fecontact"):
        scanned(folder=folder)


def test_a_refused_call_leaves_a_folder_for_the_next(tmp_path):
    """The folder is marked before the runs check their settings; nothing is kept of the call."""
    for call in (two_motions, scanned):
        folder = tmp_path / call.__name__
        with pytest.raises(InputError, match=r"rtol = 1\.0 must be"):
            call(folder=folder, rtol=1.0)
        assert (folder / "blocks.json").exists()
        call(folder=folder, rtol=1e-4)
        with pytest.raises(InputError, match="another system, grid or version"):
            call(folder=folder, rtol=1e-5)


def test_blocks_serve_any_tolerance_of_labels(tmp_path):
    """Only on a section are runs themselves judged by the tolerance."""
    found = two_motions(folder=tmp_path / "a")
    again = two_motions(folder=tmp_path / "a", tolerance=2e-3)
    assert (again.label == found.label).all()


@pytest.mark.parametrize("kept", [False, True])
def test_progress_counts_all_runs_of_a_diagram(tmp_path, kept):
    """Up and down are blocks of their own."""
    told = []
    scanned(progress=told.append, folder=tmp_path / "a" if kept else None)
    assert told == sorted(told)
    assert told[-1] == 2 * 48


class Counted:
    """A block that finds its number, or fails."""

    runs, shapes = 1, {"number": (1,)}

    def __init__(self, number, fails):
        self.number, self.fails = number, fails

    def found(self, tell=None, workers=1):
        if self.fails:
            raise ArithmeticError(f"block {self.number}")
        return {"number": np.array([self.number])}


def test_what_ends_beside_a_failure_is_kept(monkeypatch, tmp_path):
    """Eight blocks end at once, four with an error: four are kept, the first error is raised."""
    monkeypatch.setattr(in_blocks, "wait", lambda futures, **_: concurrent.futures.wait(futures))
    some = [Counted(number, number % 2 == 0) for number in range(8)]
    with pytest.raises(ArithmeticError, match="block 0"):
        work_off(some, Place(tmp_path, None, 2), "mark", None)
    assert [path.name for path in sorted(tmp_path.glob("*.npz"))] == [
        f"{number:06d}.npz" for number in (1, 3, 5, 7)]


def test_functions_that_processes_cannot_import(tmp_path):
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        changes = (lambda system, f: system.with_(**{FREQUENCY: f})), renamed
        for number, change in enumerate(changes):
            with pytest.raises(InputError, match="at the top of a module; or leave out the exec"):
                poincare_scan(impact_oscillator(1), change, [9.5, 9.7], transient_periods=2,
                              keep=1, initial=np.zeros(2), folder=tmp_path / str(number),
                              executor=pool)


def _inner():
    def change(system, f):
        return system.with_(**{FREQUENCY: f})

    return change


renamed = _inner()


@pytest.mark.parametrize(("settings", "words"), [
    ({"executor": 3, "folder": "a"}, "executor = 3 must have the methods of"),
    ({"executor": Broken(1)}, "needs a folder"),
    ({"executor": Broken(1), "folder": "a", "workers": 2}, "workers = 2 has no effect"),
    ({"folder": 7}, "must be a text or Path"),
    *(({"folder": "a", "workers": workers}, "workers = .* must be a whole number, 1 or above")
      for workers in (-1, 0, "2")),
    ({"workers": 0}, "workers = 0 must be a whole number, 1 or above"),
])
def test_bad_places(settings, words):
    for call in (two_motions, scanned):
        with pytest.raises(InputError, match=words):
            call(**settings)
