"""A sweep over a cluster: a Dask scheduler and two workers, one of which dies on the way.

On a cluster the scheduler and the workers are started by its queueing system; here they are three
processes on this machine. Whatever happens to workers, the table is that of an undisturbed sweep.

Usage: python examples/sweep_on_dask.py [--quick]
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.study import Span
from fecontact.sweeps import dask_executor

STUDY = Path(__file__).with_name("sweep_stick_slip.toml")
AXES = {"ground.speed": Span(1e-3, 12e-3, 12),
        "friction.static_coefficient": Span(0.6, 0.9, 5)}


def start(folder: str, *command: str) -> "subprocess.Popen[bytes]":
    """A process of Dask, without what it has to say; its own files go to the folder."""
    return subprocess.Popen([sys.executable, "-m", *command, "--no-dashboard"],
                            env={**os.environ, "TMPDIR": folder},
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main(quick: bool = False) -> None:
    """The map of stick and slip, by a cluster that loses a worker; quickly of four cases."""
    axes = {"ground.speed": [1e-3, 12e-3],
            "friction.static_coefficient": [0.6, 0.9]} if quick else AXES
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    folder = tempfile.mkdtemp()
    scheduler = start(folder, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port",
                      str(port))
    workers = [start(folder, "distributed.cli.dask_worker", address, "--nthreads", "1",
                     "--no-nanny") for _ in range(2)]
    study = fc.Study.read(STUDY).with_({"simulation.t_end": 12.0, "simulation.outputs": 1201,
                                        "sweep.t_start": 9.0})

    def show(done: int, failed: int, total: int) -> None:
        if done >= total // 3 and workers[0].poll() is None:
            workers[0].kill()
            workers[0].wait()
            print(f"{done} of {total} cases are done; one of the two workers is killed")

    try:
        with dask_executor(address, 30.0) as executor:
            table = fc.sweep(study, axes, executor, folder=f"{folder}/sweep", progress=show)
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
        # Workers that are killed leave theirs behind.
        shutil.rmtree(folder, ignore_errors=True)
    amplitude = table.grid("amplitude_x")
    print(f"{len(table)} cases, {len(table.failed)} failed")
    speeds = np.unique(table.column("ground.speed"))
    for coefficient, row in zip(np.unique(table.column("friction.static_coefficient")),
                                amplitude.T, strict=True):
        print(f"mu_0 = {coefficient:5.3f}: sticks and slips up to "
              f"{1e3 * speeds[row > 1e-4].max():4.1f} mm/s")


if __name__ == "__main__":
    main("--quick" in sys.argv)
