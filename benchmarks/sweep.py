"""Efficiency of a sweep of many short cases: ``python benchmarks/sweep.py [cases] [--quick]``.

Two times of all cases on one core, of :func:`simulate` alone and of all that belongs to a case
(its study, system, run, summaries), are compared with what all cores took together: in the wall
clock, after the first batches, when all workers have started, and as CPU time of the sweep and its
workers. The wall clock says something on idle cores alone.
"""

import os
import resource
import sys
import tempfile
import time

import numpy as np
from usage import explain

from fecontact import Study, simulate, sweep
from fecontact.study import Span, SweepSettings
from fecontact.sweeps.executors import cores, one_thread_each
from fecontact.sweeps.summaries import functions_for, summarise

STUDY = """
geometry = { shape = "block", element_size = 0.01 }
body = { thickness = 0.1 }
basis = { modes = 6, contact_nodes = 4, damping = 0.01 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
ground = { speed = 2e-3 }
load = { normal = 14.0 }
drive = { stiffness_x = 5610.0, damping_x = 0.768, amplitude_x = 0.5e-3, frequency_hz = 2.196 }
simulation = { t_end = 1.5, outputs = 201 }
"""


def cpu_seconds(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def main(cases: int = 10_000, quick: bool = False) -> None:
    if quick:
        cases = 20
    study = Study.from_toml(STUDY)
    study.modal_basis()
    axes = {"ground.speed": Span(1e-3, 4e-3, cases // 20),
            "friction.static_coefficient": Span(0.6, 0.9, 20)}
    # The first runs load the kernels.
    single: list[tuple[float, float]] = []
    rng = np.random.default_rng(0)
    names = SweepSettings().summaries
    first = 2 if quick else 10
    for _ in range(11 * first):
        begin = time.process_time()
        system = study.with_(**{
            "ground.speed": rng.uniform(1e-3, 4e-3),
            "friction.static_coefficient": rng.uniform(0.6, 0.9)}).system()
        middle = time.process_time()
        run = simulate(system, study.t_end, outputs=study.simulation.outputs)
        end = time.process_time()
        summarise(run, functions_for(names))
        single.append((end - middle, time.process_time() - begin))
    alone, whole = (float(value) for value in np.mean(single[first:], axis=0))
    print(f"one case: {1e3 * alone:.2f} ms for its run alone, {1e3 * whole:.2f} ms with its study, "
          f"its system and its summaries")
    ticks: list[tuple[float, int, float]] = []

    def tick(done: int, failed: int, total: int) -> None:
        ticks.append((time.perf_counter(), done, cpu_seconds(resource.RUSAGE_SELF)))

    with tempfile.TemporaryDirectory() as folder:
        before = cpu_seconds(resource.RUSAGE_CHILDREN)
        sweep(study, {"ground.speed": Span(1e-3, 4e-3, 2 * cores())}, folder=f"{folder}/few")
        starting = cpu_seconds(resource.RUSAGE_CHILDREN) - before - 2 * cores() * alone
        table = sweep(study, axes, folder=folder, progress=tick)
        children = cpu_seconds(resource.RUSAGE_CHILDREN) - before - 2.0 * starting
    assert not table.failed
    start = max(0, min(8, len(ticks) - 2))
    seconds, done = ticks[-1][0] - ticks[start][0], ticks[-1][1] - ticks[start][1]
    parent = ticks[-1][2] - ticks[0][2]
    print(f"{len(table)} cases on {cores()} cores: {ticks[-1][0] - ticks[0][0]:.1f} s with the "
          f"start of the workers, {len(table) / (ticks[-1][0] - ticks[0][0]):.0f} cases/s")
    print(f"wall clock after the start: {seconds:.2f} s for {done} cases, efficiency "
          f"{done * alone / cores() / seconds:.0%} of runs alone, "
          f"{done * whole / cores() / seconds:.0%} of whole cases")
    used = children + parent
    print(f"CPU time: runs alone {len(table) * alone:.1f} s, workers {children:.1f} s without "
          f"their start of {starting:.1f} s, parent {parent:.1f} s: efficiency "
          f"{len(table) * alone / used:.0%} of runs alone, "
          f"{len(table) * whole / used:.0%} of whole cases")


if __name__ == "__main__":
    explain(__doc__)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with one_thread_each():
        main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
             quick="--quick" in sys.argv)
