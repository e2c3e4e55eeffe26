"""Work and precision of time integrators: fecontact's own against scipy, numbalsoda and CVODE.

Usage: python benchmarks/integrator.py [a b b2 c d e ...] [--quick] [--tight]
With --quick the first part of each problem, at two tolerances, against odeint alone; with --tight
errors from 1e-6 to 1e-9, against LSODA in its two forms.

Errors are relative to a reference that is kept in the temporary directory; it is run by the
package's integrator at rtol = 1e-12, and its distance from LSODA at rtol = 1e-12 is printed. All
solvers run in this process on one thread, in turns, with the same compiled right-hand side and
Jacobian; times are those of the processor, medians. A solver that has taken twelve seconds for a
problem is not followed to smaller tolerances, but with --tight. numbalsoda and scikit-sundae take
part where they can be imported.
"""

import hashlib
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from integrator_peers import PEERS
from integrator_problems import PROBLEMS, Problem, shortened
from numpy.typing import NDArray
from usage import explain

from fecontact.integrate.rodas5p import driver

Array = NDArray[np.float64]

LEVELS, TIGHT = (1e-3, 1e-4, 1e-5, 1e-6), (1e-6, 1e-7, 1e-8, 1e-9)
TOLERANCES = [10.0**-k for k in np.arange(3.5, 9.01, 0.5)]
TIGHT_TOLERANCES = [10.0**-k for k in np.arange(6.0, 13.01, 0.5)]
# Smallest relative tolerance that a solver accepts.
LEAST = {"odeint": 1e-12, "numbalsoda": 1e-13}
QUICK_PART = 0.05
# Time that a solver gets for a problem [s]: then it is not followed to smaller tolerances.
PATIENCE = 12.0
SLOW = ("solve_ivp LSODA", "solve_ivp Radau", "solve_ivp BDF")


Prepared = Callable[[float], Callable[[], Array]]


def own(problem: Problem) -> Prepared:
    """The package's integrator; its preparation is not measured, as that of its peers is not."""

    def prepare(rtol: float) -> Callable[[], Array]:
        run = driver.start(problem.system, problem.state, problem.times, rtol=rtol, work=False)

        def solve() -> Array:
            run.advance(10**9)
            return run.states

        return solve

    return prepare


def prepared(solve: Callable[[float], Array]) -> Prepared:
    """A peer in the same form."""
    return lambda rtol: lambda: solve(rtol)


def reference(problem: Problem) -> Array:
    """Reference states (N, 2 m) at the output times."""
    mark = hashlib.sha256(b"1e-12")
    for item in (*problem.system.arrays[:18], problem.state, problem.times):
        mark.update(np.ascontiguousarray(item).tobytes())
    file = Path(tempfile.gettempdir()) / f"fecontact_reference_{mark.hexdigest()[:16]}.npz"
    if not file.exists():
        states = own(problem)(1e-12)()
        distance = problem.error(PEERS["odeint"](problem)(1e-12), states)
        np.savez(file, states=states, distance=distance)
    stored = np.load(file)
    print(f"reference: LSODA at rtol = 1e-12 differs by {stored['distance']:.1e}", flush=True)
    return np.asarray(stored["states"])


def measure(problem: Problem, quick: bool, tight: bool) -> None:
    """Print the table of a problem."""
    wanted = reference(problem)
    solvers: dict[str, Prepared] = {"fecontact": own(problem)}
    for name, of in PEERS.items():
        if (quick and name != "odeint") or (tight and name not in LEAST):
            continue
        try:
            solvers[name] = prepared(of(problem))
            solvers[name](1e-3)()
        except ImportError as missing:
            print(f"{name}: not installed ({missing.name})")
            solvers.pop(name, None)
    points: dict[str, list[tuple[float, float, float]]] = {name: [] for name in solvers}
    levels, tolerances = (TIGHT, TIGHT_TOLERANCES) if tight else (LEVELS, TOLERANCES)
    spent = dict.fromkeys(solvers, 0.0)
    for rtol in tolerances[3:8:4] if quick else tolerances:
        times: dict[str, list[float]] = {
            name: [] for name in solvers if tight or spent[name] < PATIENCE}
        errors = {}
        for repeat in range(1 if quick else 7):
            for name in times:
                if repeat and (sum(times[name]) > 2.0 or (name in SLOW and rtol < 1e-6)):
                    continue
                run = solvers[name](max(rtol, LEAST.get(name, 0.0)))
                begin = time.process_time()
                states = run()
                times[name].append(time.process_time() - begin)
                errors[name] = problem.error(states, wanted)
        for name in times:
            spent[name] += sum(times[name])
            points[name].append((rtol, float(np.median(times[name])), errors[name]))
    for name, rows in points.items():
        for rtol, seconds, error in rows:
            print(f"{problem.name:3s} {name:16s} rtol {rtol:7.1e}  {seconds * 1e3:10.2f} ms  "
                  f"error {error:.1e}")
    print(f"{problem.name:3s} ms at error of   " + "".join(f"{level:>22.0e}" for level in levels))
    ours = [time_at(points["fecontact"], level) for level in levels]
    for name, rows in points.items():
        cells = []
        for level, best in zip(levels, ours, strict=True):
            seconds = time_at(rows, level)
            cells.append(f"{seconds * 1e3:12.2f} ({seconds / best:6.1f} x)")
        print(f"{problem.name:3s} {name:16s} " + "".join(cells), flush=True)


def time_at(rows: list[tuple[float, float, float]], level: float) -> float:
    """Least time in which an error is reached, between measured points on logarithmic axes."""
    best = np.inf
    for (_, t0, e0), (_, t1, e1) in itertools.pairwise(rows):
        if e1 <= level < e0:
            part = np.log(e0 / level) / np.log(e0 / e1)
            best = min(best, float(np.exp((1.0 - part) * np.log(t0) + part * np.log(t1))))
    reached = [t for _, t, e in rows if e <= level]
    return min(best, *reached) if reached else best


def main() -> None:
    """Measure the problems named on the command line, or all."""
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        # Read when numpy is loaded.
        os.execve(sys.executable, [sys.executable, *sys.argv],
                  {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"})
    names = [name for name in sys.argv[1:] if not name.startswith("-")] or list(PROBLEMS)
    quick, tight = "--quick" in sys.argv, "--tight" in sys.argv
    for name in names:
        problem = PROBLEMS[name]()
        problem = shortened(problem, QUICK_PART) if quick else problem
        measure(problem, quick, tight)


if __name__ == "__main__":
    explain(__doc__)
    main()
