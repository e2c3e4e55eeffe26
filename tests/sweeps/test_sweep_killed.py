"""Sweeps that are killed, interrupted, or lose workers, and go on to the same files."""

import os
import random
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from sweep_study import Serial, files_below, is_alive, write_study

from fecontact import sweep
from fecontact.cli import execute
from fecontact.io import read_table

pytest.importorskip("distributed")

SWEEP = """
[sweep]
batch = 2
summaries = ["own.py:slow", "amplitude_x"]
[sweep.axes]
ground.speed = { start = 1e-3, end = 4e-3, count = 60 }
"""


def wait_for(condition, seconds=180.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.02)


def children_of(pid):
    return [int(child) for child in
            Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@pytest.fixture
def undisturbed(tmp_path):
    path = write_study(tmp_path, SWEEP)
    sweep(path, executor=Serial(), folder=tmp_path / "whole")
    return files_below(tmp_path / "whole")


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks at processes in /proc")
def test_killed_at_random_times_it_goes_on_to_the_same_files(tmp_path, undisturbed):
    """The processes of a killed sweep end with it; Ctrl-C says how to go on."""
    folder = tmp_path / "f"
    shards = folder / "shards"
    command = [sys.executable, "-m", "fecontact", "sweep", str(tmp_path / "small.toml"),
               "-o", str(folder), "--resume", "--workers", "2"]
    rng = random.Random(7)
    for how in (signal.SIGKILL, signal.SIGKILL, signal.SIGINT):
        before = len(list(shards.glob("*.json")))
        # Shells make what runs in the background deaf to Ctrl-C.
        process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
        wait_for(lambda count=before: len(list(shards.glob("*.json"))) > count)
        time.sleep(rng.uniform(0.0, 0.25))
        workers = children_of(process.pid)
        assert len(workers) >= 2
        assert process.poll() is None
        if how == signal.SIGINT:
            os.killpg(process.pid, how)
        else:
            process.send_signal(how)
        said = process.communicate(timeout=90.0)[1]
        if how == signal.SIGINT:
            assert process.returncode == 130
            assert said == f"Finished cases are kept in {folder}; go on with --resume.\n" \
                           f"error: interrupted.\n"
            assert read_table(folder / "index.csv").missing
        wait_for(lambda pids=tuple(workers): not any(is_alive(pid) for pid in pids))
        assert before < len(list(shards.glob("*.json"))) < 30
    kept = {path: path.stat().st_mtime_ns for path in shards.glob("*.json")}
    assert subprocess.run(command, timeout=180.0).returncode == 0
    finished = {name: text for name, text in files_below(folder).items()
                if not name.endswith((".png", ".html"))}
    assert finished == undisturbed
    assert all(path.stat().st_mtime_ns == kept[path] for path in kept)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def cluster(tmp_path):
    """Address of a Dask scheduler, and its two workers, all processes of their own."""
    address = f"tcp://127.0.0.1:{free_port()}"
    quiet = {"cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL,
             "env": os.environ | {"OPENBLAS_NUM_THREADS": "1",
                                  "PYTHONPATH": str(Path(__file__).parents[2])}}
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port",
         address.rpartition(":")[2], "--no-dashboard"], **quiet)
    workers = [subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1",
         "--no-nanny", "--no-dashboard"], **quiet) for _ in range(2)]
    yield address, workers
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


def test_a_dask_worker_is_killed_and_nothing_is_lost(tmp_path, undisturbed, cluster, capsys):
    address, workers = cluster
    folder = tmp_path / "d"
    command = [sys.executable, "-m", "fecontact", "sweep", str(tmp_path / "small.toml"),
               "-o", str(folder), "--dask", address]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: process.poll() is not None
             or len(list((folder / "shards").glob("*.json"))) > 4)
    workers[0].kill()
    said = process.communicate(timeout=180.0)
    assert process.returncode == 0, said
    assert "60 cases, 0 failed" in said[0]
    finished = {name: text for name, text in files_below(folder).items()
                if not name.endswith((".png", ".html"))}
    assert finished == undisturbed


def test_a_scheduler_that_does_not_answer(tmp_path, monkeypatch, capsys):
    from fecontact.sweeps import executors

    path = write_study(tmp_path, SWEEP)
    monkeypatch.setattr(executors, "PATIENCE", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    assert execute(["sweep", str(path), "--dask", address]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"error: No Dask scheduler answers at {address} within 0.5 s; start one")
    assert said.count("\n") == 1
