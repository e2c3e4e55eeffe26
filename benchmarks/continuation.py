"""Time to follow periodic orbits of the two-mass oscillator of section 4.4, beside AUTO-07p.

    python benchmarks/continuation.py [repetitions] [--quick]

The branch from the first Hopf point to B = 12, multipliers at each point, special points located.
AUTO-07p 0.9.3, compiled with gfortran -O, one thread, took on two shared cores of the same machine
0.13, 0.25 and 0.49 s for 139 points with 50, 100 and 200 intervals of 4 points; with 100 its fold
is good to 1e-11 and its doubling to 1e-8. CPU time of this process is shown, the median of the
repetitions, and per point.
"""

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from fecontact import ContactSystem, Ground, basis_from_matrices
from fecontact.bifurcation import (
    Branch,
    Collocation,
    ContinuationOptions,
    VectorField,
    contact_field,
    equilibrium_branch,
    orbit_branch,
)
from fecontact.laws import PrescribedForce, ProductFriction

AUTO = {50: 0.13, 100: 0.25, 200: 0.49}
AUTO_POINTS = 139
FOLD, DOUBLING = 0.890686833041, 8.0921923844629


def two_masses() -> VectorField:
    """The oscillator, its parameter B the normal forces."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    basis = basis_from_matrices(
        np.diag([2.5, 1.0]), [[3.0, -1.0], [-1.0, 1.0]], {"contact": rows},
        damping=0.2 * np.array([[2.0, -1.0], [-1.0, 1.0]]))
    system = ContactSystem(basis, normal=PrescribedForce((1.0, 1.0)), friction=ProductFriction(),
                           ground=Ground(speed=1.0))
    return contact_field(system, {"B": (1.0, lambda system, B: system.with_(
        **{"normal.force": (B, B)}))})


def chain(masses: int) -> VectorField:
    """As many masses in a row, each on the belt."""
    rows = np.zeros((masses, 3, masses))
    rows[:, 0] = np.eye(masses)
    K = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[-1, -1] = 1.0
    basis = basis_from_matrices(np.eye(masses), K, {"contact": rows}, damping=0.2 * K)
    system = ContactSystem(basis, normal=PrescribedForce(np.ones(masses)),
                           friction=ProductFriction(), ground=Ground(speed=1.0))
    return contact_field(system, {"B": (0.5, lambda system, B: system.with_(
        **{"normal.force": np.full(masses, B)}))})


def timed(task: Callable[[], Branch], repetitions: int) -> tuple[float, Branch]:
    """Median CPU time of a task, and its last result."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        branch = task()
        times.append(time.process_time() - start)
    return statistics.median(times), branch


def main(repetitions: int = 5, quick: bool = False) -> None:
    """Print the table; quickly its first row once, and few points of the chain."""
    if quick:
        repetitions = 1
    field = two_masses()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 12.0))
    hopf = sliding.of_kind("Hopf")[0]
    print("intervals  points  CPU time  per point   AUTO per point   error of fold, doubling")
    for intervals in (50,) if quick else (50, 70, 100, 200):
        settings = ContinuationOptions(step=0.002, largest_step=0.065, points=1000)

        def task(intervals: int = intervals, settings: ContinuationOptions = settings) -> Branch:
            return orbit_branch(field, hopf, method=Collocation(intervals=intervals),
                                options=settings, bounds=(0.3, 12.0), scales=np.ones(4))

        if not quick:
            task()
        seconds, branch = timed(task, repetitions)
        fold = branch.of_kind("fold")[0].parameter / FOLD - 1.0
        doubling = branch.of_kind("period doubling")[0].parameter / DOUBLING - 1.0
        each = 1e3 * seconds / len(branch)
        other = (f"{1e3 * AUTO[intervals] / AUTO_POINTS:11.2f} ms" if intervals in AUTO
                 else f"{'':14}")
        print(f"{intervals:9}  {len(branch):6}  {seconds:6.3f} s  {each:6.2f} ms   {other}"
              f"   {fold:9.1e} {doubling:9.1e}")
    large = chain(20)
    sliding = equilibrium_branch(large, parameter="B", bounds=(0.1, 3.0))
    hopf = sliding.of_kind("Hopf")[0]
    settings = ContinuationOptions(step=0.002, largest_step=0.02, points=3 if quick else 20)
    seconds, branch = timed(lambda: orbit_branch(large, hopf, method=Collocation(intervals=100),
                                                 options=settings, bounds=(0.1, 3.0)), 1)
    print(f"40 states, 100 intervals: {len(branch)} points, {seconds / len(branch):.3f} s a point")


if __name__ == "__main__":
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
