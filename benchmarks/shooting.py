"""Cost of the derivatives of a run, and of a branch point by shooting, on the beam that sticks.

    python benchmarks/shooting.py [repetitions] [--quick]

A run over 50 ms, from the stuck state, and the same with derivatives to start and belt speed, for
3, 5 and 20 modes, without the check against differences of runs and with it. The problems (b),
(b2), (c) and (d) of benchmarks/integrator.py, of 1, 2 and 3 modes and one node, and 20 modes and
40 nodes: with derivatives to the start, and to the start and belt speed, at the steps of the run
and at those that the derivatives ask for, and these last with the check. Runs with and without
derivatives are by the same integrator, small systems by collocation at this tolerance.
Then points of the stick-slip branch of 20 modes. CPU time, the least of the repetitions.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "validation" / "cases"))

import beam_stick_slip as example
import integrator_problems as problems
from usage import explain

from fecontact import ContactSystem, sensitivity
from fecontact.core.types import Array
from fecontact.integrate.collocation.workspace import chosen_collocation
from fecontact.integrate.rodas5p import driver

SPEED, DURATION, RTOL = 0.05, 0.05, 1e-7
# Parts of the times of the problems.
PARTS = {"b": 0.5, "b2": 0.1, "c": 0.1, "d": 0.2}


def least(task: Callable[[], object], repetitions: int) -> float:
    """Least CPU time of a task [s]; it has run once before."""
    task()
    times = []
    for _ in range(repetitions):
        begin = time.process_time()
        task()
        times.append(time.process_time() - begin)
    return min(times)


def alone(system: ContactSystem, state: Array, end: float, rtol: float) -> None:
    """A run without derivatives, by itself, and by the integrator of runs with derivatives."""
    method = "rodas5p" if chosen_collocation(system, rtol, (), False) is None else "radau"
    run = driver.start(system, state, np.array([0.0, end]), rtol=rtol, work=False, method=method)
    run.advance(10**9)


def measure(modes: int, repetitions: int) -> list[float]:
    """Times of a run, with derivatives, with those to 1e-2 only, and with the check [s]."""
    system = example.beam(SPEED, modes=modes)
    start = example.stuck(system)

    def derivatives(rtol: float | None, check: bool = False) -> object:
        return sensitivity(system, DURATION, initial=start, parameter="ground.speed", rtol=RTOL,
                           derivative_rtol=rtol, check=check)

    return [least(task, repetitions) for task in (
        lambda: alone(system, start, DURATION, RTOL),
        lambda: derivatives(None), lambda: derivatives(1e-2), lambda: derivatives(None, True))]


def ratios(name: str, repetitions: int, part: float = 1.0) -> list[float]:
    """Time of a run [s]; that with derivatives to start, and to start and speed, relative to it.

    At the steps of the run, then at those that the derivatives ask for, then these with the check.
    """
    problem = problems.shortened(problems.PROBLEMS[name](), PARTS[name] * part)
    system, end = problem.system, float(problem.times[-1])
    run = least(lambda: alone(system, problem.state, end, 1e-8), repetitions)

    def cost(rtol: float | None, check: bool, parameter: str | None) -> float:
        return least(lambda: sensitivity(system, end, initial=problem.state, rtol=1e-8,
                                         derivative_rtol=rtol, parameter=parameter,
                                         check=check),
                     repetitions) / run

    return [run, *(cost(rtol, check, parameter)
                   for rtol, check in ((1.0, False), (None, False), (None, True))
                   for parameter in (None, "ground.speed"))]


def main(repetitions: int = 5, quick: bool = False) -> None:
    """Print the tables; quickly the first row, once, and no branch."""
    if quick:
        repetitions = 1
    print("modes     run   with derivatives   ratio   derivatives to 1e-2   ratio"
          "   checked   ratio")
    for modes in (3,) if quick else (3, 5, 20):
        run, tight, loose, checked = measure(modes, repetitions)
        print(f"{modes:5}  {1e3 * run:6.1f} ms  {1e3 * tight:9.1f} ms  {tight / run:12.1f}"
              f"  {1e3 * loose:12.1f} ms  {loose / run:12.1f}  {1e3 * checked:8.1f} ms"
              f"  {checked / run:4.1f}")
    print("problem     run   to start   to start and speed   to start*   to start and speed*"
          "   checked: to start*   to start and speed*")
    for name in ("b2",) if quick else PARTS:
        run, *costs = ratios(name, repetitions, 0.2 if quick else 1.0)
        print(f"({name})".ljust(7) + f"{1e3 * run:6.1f} ms  {costs[0]:7.1f}  {costs[1]:19.1f}"
              f"  {costs[2]:10.1f}  {costs[3]:20.1f}  {costs[4]:20.1f}  {costs[5]:20.1f}")
    print("* at the steps that the derivatives ask for")
    if quick:
        return
    motion = example.stick_slip(SPEED)
    begin = time.process_time()
    branch = example.orbits(motion, SPEED, bounds=(SPEED, 0.27), both=False)
    seconds = time.process_time() - begin
    print(f"{len(branch)} points from {SPEED:g} to {np.max(branch.parameter):.4g} m/s: "
          f"{seconds / len(branch):.2f} s a point")


if __name__ == "__main__":
    explain(__doc__)
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
