"""Runs and sweeps that are killed at random moments, over and over: nothing is lost.

Slow, so that it is left out by default: ``make test-slow``.
"""

import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from matplotlib.image import imread
from sweep_study import files_below, write_study
from test_cli import TINY

from fecontact import read_case, read_table

pytestmark = pytest.mark.slow

KILLS = 20
# A checkpoint after every piece of a run, instead of every minute.
OFTEN = """
import sys
from fecontact.integrate.checkpoint import Checkpoint
Checkpoint.keep = Checkpoint.write
from fecontact.cli import execute
sys.exit(execute(sys.argv[1:]))
"""
LONG = TINY.replace("t_end = 5e-4, outputs = 11", "t_end = 4.0, outputs = 2001").replace(
    "ground = { speed = 0.1 }", "ground = { speed = 0.1, amplitude = 1e-5, wavelength = 0.01 }")
SWEEP = """
[sweep]
batch = 2
summaries = ["own.py:slow", "amplitude_x"]
[sweep.axes]
ground.speed = { start = 1e-3, end = 4e-3, count = 60 }
"""


def start(*tokens):
    return subprocess.Popen([sys.executable, "-c", OFTEN, *map(str, tokens)],
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def killed(process, moment):
    """Whether a process was still at work at a moment, at which it was killed."""
    try:
        said = process.communicate(timeout=moment)[1]
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.communicate()
        return True
    assert process.returncode == 0, said
    return False


def finished(*tokens):
    begin = time.monotonic()
    process = start(*tokens)
    said = process.communicate()[1]
    assert process.returncode == 0, said
    return time.monotonic() - begin


def numbers(path):
    run = read_case(path).trajectory
    return [run.time, run.modal_coordinates, run.modal_velocities, run.work,
            run.node_friction_work]


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_a_killed_run(tmp_path, record_property):
    study = tmp_path / "tiny.toml"
    study.write_text(LONG)
    finished("run", study, "-o", tmp_path / "warm")
    lasts = finished("run", study, "-o", tmp_path / "whole")
    whole = numbers(tmp_path / "whole" / "tiny.vtkhdf")
    folder = tmp_path / "results"
    # An earlier run with other values, and files of the user's.
    finished("run", study, "--set", "ground.speed=0.2", "--set", "simulation.t_end=0.01")
    earlier = numbers(folder / "tiny.vtkhdf")
    mine = {folder / name: f"mine: {name}" for name in ("notes.txt", "tiny.txt", "tiny.part")}
    for path, text in mine.items():
        path.write_text(text)
    rng = random.Random(11)
    kills = resumed = 0
    while kills < KILLS:
        checkpoint = folder / "tiny.checkpoint"
        tokens = ["--resume"] if checkpoint.exists() else []
        resumed += bool(tokens)
        kills += killed(start("run", study, *tokens), rng.uniform(0.2, 1.0) * lasts)
        assert {path: path.read_text() for path in mine} == mine
        found = numbers(folder / "tiny.vtkhdf")
        assert same(found, earlier) or same(found, whole)
        for picture in folder.glob("*.png"):
            assert imread(picture).size
    while True:
        tokens = ["--resume"] if (folder / "tiny.checkpoint").exists() else []
        finished("run", study, *tokens)
        if not (folder / "tiny.checkpoint").exists():
            break
    assert same(numbers(folder / "tiny.vtkhdf"), whole)
    record_property("resumed", resumed)
    assert resumed > KILLS // 4


def test_a_killed_sweep(tmp_path):
    study = write_study(tmp_path, SWEEP)
    lasts = finished("sweep", study, "-o", tmp_path / "whole", "--workers", 2)
    whole = results(tmp_path / "whole")
    rng = random.Random(13)
    kills, round_ = 0, 0
    folder = tmp_path / "sweep0"
    (folder).mkdir()
    (folder / "notes.txt").write_text("mine")
    while kills < KILLS:
        if killed(start("sweep", study, "-o", folder, "--workers", 2, "--resume"),
                  rng.uniform(0.2, 1.0) * lasts):
            kills += 1
        else:
            assert results(folder) == whole
            round_ += 1
            folder = tmp_path / f"sweep{round_}"
            folder.mkdir()
            (folder / "notes.txt").write_text("mine")
        assert (folder / "notes.txt").read_text() == "mine"
        if (folder / "index.csv").exists():
            assert len(read_table(folder / "index.csv")) == 60
        for path in (folder / "shards").glob("*.json"):
            assert whole[str(path.relative_to(folder))] == path.read_bytes()
    finished("sweep", study, "-o", folder, "--workers", 2, "--resume")
    assert results(folder) == whole


def results(folder):
    """What a sweep keeps, apart from pictures and the user's notes."""
    return {name: content for name, content in files_below(folder).items()
            if name.split("/")[0] in ("shards", "bases", "cases", "index.csv", "sweep.toml")
            and name.endswith((".json", ".h5", ".vtkhdf", ".csv", ".toml"))}
