"""Set-valued friction: from event to event, by implicit steps, smoothed, and by Siconos.

Usage: python benchmarks/nonsmooth.py [b c r ...] [--quick]
With --quick the first part of each problem, at two tolerances.

(b) and (c) are those of `integrator_problems.py`, twenty periods of section 4. (r) is (c) on rigid
ground: its two modes along the belt under a constant normal force. All runs hold the energy
balance, as those of `simulate` do; their preparation in Python is not measured. Times are medians
of processor time of this process on one thread.

Errors of set-valued runs are relative to the event-driven run at rtol = 1e-11; those of smoothed
runs, with k_s = 1e6 s/m, to a smoothed one of that tolerance. So the error by smoothing itself,
which is much larger, is not counted: every method is measured by how well it solves its own
equations.

Siconos takes part where Debian's ``python3-siconos`` and a C compiler are installed: Moreau and
Jean's scheme with theta = 1/2, Coulomb friction on rigid ground and forces compiled in C, see
`nonsmooth_peer.py`. It is of order one at transitions and has no step control, and it knows no
compliant contact: it runs (b), whose normal force is given, and (r), not (c). Its time is that of
the loop over its steps in a process of its own; it stores states only.
"""

import sys
import time
from collections.abc import Callable

import nonsmooth_peer
import numpy as np
from integrator import time_at
from integrator_problems import Problem, friction_oscillator, shortened
from numpy.typing import NDArray
from usage import explain

from fecontact.integrate import EventDriven, SetValued, TimeStepping
from fecontact.integrate.nonsmooth import driver as set_valued
from fecontact.integrate.rodas5p import driver as smoothed
from fecontact.integrate.step_loop import RUNNING
from fecontact.integrate.task import Task

Array = NDArray[np.float64]
Prepared = Callable[[float], Callable[[], Array]]
Point = tuple[float, float, float]

LEVELS = (1e-3, 1e-4, 1e-5)
EVENTS, STEPPING, SMOOTHED, PEER = "event-driven", "time-stepping", "smoothed", "Siconos"
TOLERANCES = {EVENTS: np.arange(2.5, 9.01, 0.5), STEPPING: np.arange(2.0, 7.01, 0.5),
              SMOOTHED: np.arange(3.5, 9.01, 0.5)}
QUICK_PART, QUICK_TOLERANCES = 0.25, (4.0, 7.0)
# Tolerance of references, and the longest run of the peer [s].
FINEST, PATIENCE = 1e-11, 60.0


def by_method(problem: Problem, solver: SetValued) -> Prepared:
    """Set-valued runs."""

    def prepare(rtol: float) -> Callable[[], Array]:
        run = set_valued.start(Task(problem.system, problem.state, problem.times, rtol), solver)

        def solve() -> Array:
            while run.advance(10**9) == RUNNING:
                pass
            return run.output.states[:, : len(problem.state)]

        return solve

    return prepare


def by_smoothing(problem: Problem) -> Prepared:
    """Smoothed runs."""

    def prepare(rtol: float) -> Callable[[], Array]:
        run = smoothed.start(problem.system, problem.state, problem.times, rtol=rtol)

        def solve() -> Array:
            run.advance(10**9)
            return run.states

        return solve

    return prepare


def as_mass(problem: Problem) -> nonsmooth_peer.Mass:
    """A problem with a given normal force for the peer."""
    system, arrays = problem.system, problem.system.arrays
    drive, friction = system.drive, system.friction
    w, size = 2.0 * np.pi * drive.frequency_hz, drive.amplitude_x
    return nonsmooth_peer.Mass(
        arrays.stiffness, arrays.damping, arrays.rows[0, 0], arrays.drive_shapes[0],
        arrays.drive_stiffness[0] * size, arrays.drive_damping[0] * size * w, w,
        system.ground.speed, float(system.normal.force), friction.static_coefficient,
        friction.kinetic_coefficient, friction.decay)


def siconos(problem: Problem, wanted: Array, quick: bool) -> list[Point]:
    """Step [s], seconds and error of runs with shorter and shorter steps."""
    mass, rows, steps = as_mass(problem), [], 1
    while True:
        states, seconds = nonsmooth_peer.run(mass, problem.times, steps)
        rows.append((float(problem.times[1]) / steps, seconds, problem.error(states, wanted)))
        if quick or rows[-1][2] <= LEVELS[-1] or 2.0 * seconds > PATIENCE:
            return rows
        steps *= 2


def measure(problem: Problem, quick: bool) -> list[str]:
    """Print what was measured on a problem; rows of a table of times at equal errors."""
    solvers = {EVENTS: by_method(problem, EventDriven()),
               STEPPING: by_method(problem, TimeStepping()),
               SMOOTHED: by_smoothing(problem)}
    exact = solvers[EVENTS](FINEST)()
    wanted = {EVENTS: exact, STEPPING: exact, SMOOTHED: solvers[SMOOTHED](FINEST)()}
    points: dict[str, list[Point]] = {}
    for name, solve in solvers.items():
        points[name] = []
        for exponent in QUICK_TOLERANCES if quick else TOLERANCES[name]:
            times: list[float] = []
            while not times or (not quick and len(times) < 9 and sum(times) < 2.0):
                run = solve(10.0**-exponent)
                begin = time.process_time()
                states = run()
                times.append(time.process_time() - begin)
            points[name].append((10.0**-exponent, float(np.median(times)),
                                 problem.error(states, wanted[name])))
    if problem.name != "c" and nonsmooth_peer.available():
        points[PEER] = siconos(problem, exact, quick)
    for name, rows in points.items():
        for setting, seconds, error in rows:
            print(f"{problem.name} {name:14s} {'step' if name == PEER else 'rtol'} {setting:7.1e}"
                  f"  {seconds * 1e3:10.2f} ms  error {error:.1e}", flush=True)
    return [f"| ({problem.name}) | 1e-{round(-np.log10(level))} | " + " | ".join(
        _cell(points.get(name, []), level) for name in (EVENTS, STEPPING, SMOOTHED, PEER)) + " |"
        for level in LEVELS]


def _cell(rows: list[Point], level: float) -> str:
    if not rows:
        return "-"
    seconds = time_at(rows, level)
    if not np.isfinite(seconds):
        return f"> {rows[-1][1]:.3g} s"
    return f"{seconds * 1e3:.2f} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def main() -> None:
    """Measure the problems named on the command line, or all."""
    names = [name for name in sys.argv[1:] if not name.startswith("-")] or ["b", "c", "r"]
    quick, table = "--quick" in sys.argv, []
    for name in names:
        problem = friction_oscillator(name)
        table += measure(shortened(problem, QUICK_PART) if quick else problem, quick)
    print(f"\n| problem | error | {EVENTS} | {STEPPING} | {SMOOTHED}, 1e6 s/m | {PEER} |\n"
          f"|---|---|---|---|---|---|")
    print("\n".join(table))


if __name__ == "__main__":
    explain(__doc__)
    main()
