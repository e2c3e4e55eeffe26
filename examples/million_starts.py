"""A million starts and a hundred thousand frequencies of an impact oscillator.

A mass on a spring strikes a rough stop, the rigid mode of the oscillator of section 4.2 in W.
Sextro, Dynamical Contact Problems with Friction. At 6.764 Hz an orbit of two periods with impacts
and one of one period lie beside each other; which one a run settles on depends on where it starts,
in ever finer threads towards the stop. Over the frequency the states once a period show periodic
motions as lines and chaos as shades, up and down.

Finished blocks of runs are kept in FOLDER: a computation that is ended, or killed, goes on from
there when it is started again. With --dask two workers of a Dask cluster do the work; here they are
processes on this machine.

Usage: python examples/million_starts.py [FOLDER] [--dask] [--quick]   (a quarter of an hour)
"""

import contextlib
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

import fecontact as fc
from fecontact.bifurcation import Axis, basins, poincare_scan
from fecontact.plot import plot_basins, plot_poincare_scan

FREQUENCY = "drive.frequency_hz"


def oscillator(frequency_hz: float = 6.764) -> fc.ContactSystem:
    """A mass on a spring that is moved to and fro beside a stop."""
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[0.092]], [[0.0]], {"contact": rows[None], "B": rows})
    return fc.ContactSystem(
        basis, normal=fc.laws.RoughSurface(0.3e6, 5.2e-6, 6.0),
        drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                       frequency_hz=frequency_hz))


@contextlib.contextmanager
def cluster() -> Iterator[Executor]:
    """Two Dask workers with a thread each."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as started, (
            fc.sweeps.dask_executor(started.scheduler_address)) as executor:
        yield executor


def map_of_starts(count: int, periods: int, **settings: Any) -> None:
    """Basins of count x count starts, and their picture."""
    begin = time.perf_counter()
    place, speed = Axis("B", "y"), Axis("B", "y", "velocity")
    found = basins(oscillator(), (place, np.linspace(-1e-4, 2e-3, count)),
                   (speed, np.linspace(-0.08, 0.08, count)), transient_periods=periods, keep=4,
                   **settings)
    print(f"{found.label.size} starts, {time.perf_counter() - begin:.0f} s")
    for one in found.attractors:
        print(f"  {one.kind}, {len(one.points)} states: {100.0 * one.share:.2f} %")
    plot_basins(found, x_label="y at the start [m]", y_label="y' at the start [m/s]",
                rows=[axis.row(oscillator()) for axis in (place, speed)],
                path="million_starts.png")


def diagram(count: int, periods: int, **settings: Any) -> None:
    """States once a period over the frequency, up and down, and their picture."""
    begin = time.perf_counter()
    found = poincare_scan(oscillator(), FREQUENCY, np.linspace(3.2, 8.0, count),
                          transient_periods=periods, keep=32, initial=np.zeros(2), **settings)
    up, down = found.observed("B", "y")
    print(f"{count} frequencies, {time.perf_counter() - begin:.0f} s")
    for way, y in (("up", up), ("down", down)):
        shares = [np.mean((np.abs(y[:, p:] - y[:, :-p]) < 1e-7).all(axis=1)) for p in (1, 2, 3, 4)]
        print(f"  {way}: repeats after 1, 2, 3 or 4 periods at "
              + ", ".join(f"{100.0 * share:.1f}" for share in shares) + " %")
    plot_poincare_scan(found, "B", "y", x_label="frequency of the drive [Hz]",
                       y_label="y once a period [m]", path="hundred_thousand_frequencies.png")


def main(folder: Path | None, on_dask: bool, quick: bool = False) -> None:
    """Both, on threads of this process or on a cluster."""
    with cluster() if on_dask else contextlib.nullcontext() as executor:
        for name, task, size, periods in (("starts", map_of_starts, 16 if quick else 1000, 100),
                                          ("frequencies", diagram, 80 if quick else 100_000, 60)):
            kept = {} if folder is None else {"folder": folder / name, "executor": executor}
            task(size, periods, progress=True, **kept)


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if not word.startswith("--")]
    if "--dask" in sys.argv and not given:
        sys.exit("--dask needs a FOLDER, where finished blocks are kept")
    main(Path(given[0]) if given else None, "--dask" in sys.argv, "--quick" in sys.argv)
