"""Cost of a time step with many contact nodes, all of them or a few in contact.

Usage: python benchmarks/many_contacts.py [--quick]

A free beam of 40 modes on a belt, with 400, 1000 and 4000 contact nodes. A level face touches with
all nodes, a crowned one with about a tenth of them. Processor time of one step, the median of
several pieces of a run, and what each further node costs.
"""

import os
import sys
import time
from itertools import pairwise

import numpy as np
from usage import explain

from fecontact import ContactSystem, Drive, Ground, Load, ModalBasis
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.run import Run
from fecontact.laws import Constant, ExponentialFriction, RoughSurface

LENGTH, MASS, MODES = 0.2, 1.24, 40
CROWN = 320e-6


def system(nodes: int, crown: float) -> ContactSystem:
    """A beam whose face rises parabolically by ``crown`` [m] towards its ends."""
    x = (np.arange(nodes) + 0.5) / nodes - 0.5
    rows = np.zeros((nodes + 2, 3, MODES))
    at = np.concatenate([[-0.5, 0.0], x])
    r = 1.0 / np.sqrt(MASS)
    rows[:, 0, 0], rows[:, 1, 1] = r, r
    rows[:, 1, 2] = r * np.sqrt(12.0) * at
    rows[:, 0, 2] = 0.1 * r
    rows[:, 2, 2] = r * np.sqrt(12.0) / LENGTH
    waves = np.arange(1, MODES - 2)
    rows[:, 1, 3:] = r * np.sqrt(2.0) * np.cos(np.pi * (waves + 0.5) * (at[:, None] + 0.5))
    rows[:, 0, 3:] = 0.1 * r * np.sqrt(2.0) * np.sin(np.pi * waves * (at[:, None] + 0.5))
    frequencies = np.concatenate([np.zeros(3), 3200.0 * (waves + 0.5) ** 2 / 2.25])
    basis = ModalBasis(frequencies, np.diag(0.02 * frequencies), rows,
                       np.column_stack([LENGTH * at, 0.0 * at]), np.full(nodes, LENGTH / nodes))
    return ContactSystem(
        basis, RoughSurface(20e6, 5.2e-6, 20.0), ExponentialFriction(0.8, 0.55, 1000.0, 1e4),
        gap=4.0 * crown * x**2, ground=Ground(speed=0.01), load=Load(14.0),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, motion_x=Constant(-9.5 / 5610.0)))


def run_of(tried: ContactSystem) -> Run:
    """A run that has begun."""
    start = np.zeros(2 * MODES)
    start[1] = -3e-6 * np.sqrt(MASS)
    run = driver.start(tried, start, np.array([0.0, 10.0]), rtol=1e-5, work=False)
    run.advance(10)
    return run


def step_time(nodes: int, crown: float, pieces: int, steps: int) -> tuple[float, float]:
    """Processor time of a step [us], and the part of the nodes that touch."""
    tried = system(nodes, crown)
    run = run_of(tried)
    found = []
    for _ in range(pieces):
        before, begin = run.attempts, time.process_time()
        run.advance(steps)
        found.append((time.process_time() - begin) / (run.attempts - before))
    force = tried.at(run.progress.state, time=run.time).normal_force
    return float(np.median(found)) * 1e6, float((force != 0.0).mean())


def main(quick: bool = False) -> None:
    """Print the table."""
    pieces, steps = (2, 5) if quick else (9, 20)
    sizes = (400, 1000) if quick else (400, 1000, 4000)
    print(f"{'nodes':>6s} {'all closed':>13s} {'few closed':>16s} {'closed':>10s} "
          f"{'ratio':>6s}")
    rows = []
    for nodes in sizes:
        (whole, part), (few, touching) = (
            step_time(nodes, crown, pieces, steps) for crown in (0.0, CROWN))
        assert part == 1.0
        rows.append((nodes, whole, few))
        print(f"{nodes:6d} {whole:10.1f} us {few:13.1f} us {touching:7.2f} {few / whole:6.2f}")
    for (n0, whole0, few0), (n1, whole1, few1) in pairwise(rows):
        print(f"us a node from {n0} to {n1}: {(whole1 - whole0) / (n1 - n0):.3f} all closed, "
              f"{(few1 - few0) / (n1 - n0):.3f} few closed")


if __name__ == "__main__":
    explain(__doc__)
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        # Read when numpy is loaded.
        os.execve(sys.executable, [sys.executable, *sys.argv],
                  {**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    main("--quick" in sys.argv)
