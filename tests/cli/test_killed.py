"""Runs and sweeps that are killed at random moments, over and over: nothing is lost.

Slow, so that it is left out by default: ``make test-slow``.
"""

import os
import random
import signal
import time
import traceback

import numpy as np
import pytest
from matplotlib.image import imread
from sweep_study import Serial, files_below, write_study
from tiny_study import TINY

from fecontact import read_case, sweep
from fecontact.cli import execute
from fecontact.integrate import step_runs
from fecontact.integrate.rodas5p.checkpoint import Checkpoint
from fecontact.io import read_table

pytestmark = [pytest.mark.slow,
              pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")]

KILLS = 12
# Driven, so that it never comes to rest: most of the time goes into steps.
LONG = TINY.replace("t_end = 5e-4, outputs = 11", "t_end = 0.6, outputs = 201").replace(
    "frames = 3", "frames = 0") + """
[drive]
stiffness_x = 1e5
amplitude_x = 1e-4
frequency_hz = 95.5
"""
SWEEP = """
[sweep]
batch = 2
summaries = ["own.py:slow", "amplitude_x"]
[sweep.axes]
ground.speed = { start = 1e-3, end = 4e-3, count = 60 }
"""


def start(work):
    """A process that has everything loaded, at work; it ends with 0 if all went well."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        # Checkpoints after every piece of a run, and short pieces.
        Checkpoint.keep = Checkpoint.write
        step_runs._SECONDS = 0.02
        code = work() or 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def ended(child):
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def killed(child, moment):
    """Whether a process was still at work after some time [s], when it was killed."""
    end = time.monotonic() + moment
    while time.monotonic() < end:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            assert os.waitstatus_to_exitcode(status) == 0
            return False
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


def time_of(work):
    begin = time.monotonic()
    ended(start(work))
    return time.monotonic() - begin


def numbers(path):
    run = read_case(path).trajectory
    return [run.time, run.modal_coordinates, run.modal_velocities, run.work,
            run.node_friction_work]


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_a_killed_run(tmp_path):
    study = tmp_path / "tiny.toml"
    study.write_text(LONG)
    folder = tmp_path / "results"

    def run(*tokens):
        return lambda: execute(["run", str(study), *map(str, tokens)])

    # An earlier run with other values, and files of the user's.
    ended(start(run("--set", "ground.speed=0.2", "--set", "simulation.t_end=0.01")))
    lasts = time_of(run("-o", tmp_path / "whole"))
    whole = numbers(tmp_path / "whole" / "tiny.vtkhdf")
    earlier = numbers(folder / "tiny.vtkhdf")
    mine = {folder / name: f"mine: {name}" for name in ("notes.txt", "tiny.txt", "tiny.part")}
    for path, text in mine.items():
        path.write_text(text)
    checkpoint = folder / "tiny.checkpoint"
    rng = random.Random(11)
    kills = resumed = 0
    while kills < KILLS:
        tokens = ["--resume"] if checkpoint.exists() else []
        resumed += bool(tokens)
        kills += killed(start(run(*tokens)), rng.uniform(0.0, 0.7) * lasts)
        assert {path: path.read_text() for path in mine} == mine
        found = numbers(folder / "tiny.vtkhdf")
        assert same(found, earlier) or same(found, whole)
        for picture in folder.glob("*.png"):
            assert imread(picture).size
    ended(start(run(*(["--resume"] if checkpoint.exists() else []))))
    assert not checkpoint.exists()
    assert same(numbers(folder / "tiny.vtkhdf"), whole)
    assert resumed >= KILLS // 4
    print(f"{kills} kills, {resumed} runs taken up again, {lasts:.1f} s each")


def test_a_killed_sweep(tmp_path):
    study = write_study(tmp_path, SWEEP)

    def swept(folder):
        return lambda: sweep(study, executor=Serial(), folder=folder, resume=True) is None

    lasts = time_of(swept(tmp_path / "whole"))
    whole = results(tmp_path / "whole")
    rng = random.Random(13)
    kills = rounds = 0
    folder = tmp_path / "sweep0"
    while kills < KILLS:
        folder.mkdir(exist_ok=True)
        (folder / "notes.txt").write_text("mine")
        if killed(start(swept(folder)), rng.uniform(0.0, 0.5) * lasts):
            kills += 1
        else:
            assert results(folder) == whole
            rounds += 1
        assert (folder / "notes.txt").read_text() == "mine"
        if (folder / "index.csv").exists():
            assert len(read_table(folder / "index.csv")) == 60
        for path in (folder / "shards").glob("*.json"):
            assert whole[str(path.relative_to(folder))] == path.read_bytes()
        folder = tmp_path / f"sweep{rounds}"
    ended(start(swept(folder)))
    assert results(folder) == whole
    print(f"{kills} kills, {rounds} sweeps whole before them, {lasts:.1f} s each")


def results(folder):
    """Files that a sweep stores, apart from pictures and the user's notes."""
    return {name: content for name, content in files_below(folder).items()
            if name.split("/")[0] in ("shards", "bases", "cases", "index.csv", "sweep.toml")
            and name.endswith((".json", ".h5", ".vtkhdf", ".csv", ".toml"))}
