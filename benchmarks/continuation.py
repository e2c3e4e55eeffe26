"""Time to follow periodic orbits of the two-mass oscillator of section 4.4, beside AUTO-07p.

    python benchmarks/continuation.py [repetitions] [--quick]

The branch from the first Hopf point to B = 12, multipliers at each point, special points located,
in intervals of 4 collocation points, and from these the curves of folds and of period doublings
over the speed of the belt, also in the time of an orbit; so is a curve of tori across a circle, a
function of three states. Shown is the CPU time, the median of the
repetitions; where AUTO-07p is installed, also its own for the same branch and curves, one thread,
in the same run.
"""

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from continuation_peer import Auto, auto
from usage import explain

from fecontact import ContactSystem, Ground, basis_from_matrices
from fecontact.bifurcation import (
    Branch,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    VectorField,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.laws import PrescribedForce, ProductFriction

FOLD, DOUBLING = 0.890686833041, 8.0921923844629
# So few intervals place the period doubling as well as a hundred of AUTO-07p.
COARSE = 24
# Speed at which a curve ends, and the force there, from 400 intervals.
ENDS = {"fold": (2.0, 2.46586686513), "period doubling": (1.2, 11.28428136088)}


def two_masses() -> VectorField:
    """The oscillator, its parameters B, the normal forces, and the speed of the belt."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    basis = basis_from_matrices(
        np.diag([2.5, 1.0]), [[3.0, -1.0], [-1.0, 1.0]], {"contact": rows},
        damping=0.2 * np.array([[2.0, -1.0], [-1.0, 1.0]]))
    system = ContactSystem(basis, normal=PrescribedForce((1.0, 1.0)),
                           friction=ProductFriction(0.14, 1.14, 2.0, 100.0),
                           ground=Ground(speed=1.0))
    return contact_field(system, {"B": (1.0, lambda system, B: system.with_(
        **{"normal.force": (B, B)})), "ground.speed": None})


def chain(masses: int) -> VectorField:
    """A chain of masses in a row, each on the belt."""
    rows = np.zeros((masses, 3, masses))
    rows[:, 0] = np.eye(masses)
    K = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[-1, -1] = 1.0
    basis = basis_from_matrices(np.eye(masses), K, {"contact": rows}, damping=0.2 * K)
    system = ContactSystem(basis, normal=PrescribedForce(np.ones(masses)),
                           friction=ProductFriction(0.14, 1.14, 2.0, 100.0),
                           ground=Ground(speed=1.0))
    return contact_field(system, {"B": (0.5, lambda system, B: system.with_(
        **{"normal.force": np.full(masses, B)}))})


def turning(t, x, p, out):
    """A circle on which orbits take pi; across it w' = (lam - a^2 + 0.7 i) w - w |w|^2."""
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] * p[1] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def timed(task: Callable[[], Branch], repetitions: int) -> tuple[float, Branch]:
    """Median CPU time of a task, and its last result."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        branch = task()
        times.append(time.process_time() - start)
    return statistics.median(times), branch


def curves(
    field: VectorField, branch: Branch, orbit: float, repetitions: int,
    settings: ContinuationOptions, peer: Auto | None,
) -> None:
    """Print the lines of the curves from a branch whose orbits take so many seconds each."""
    intervals = int(branch.method.intervals)
    for kind, (speed, force) in ENDS.items():
        point = branch.of_kind(kind)[0]
        seconds, curve = timed(partial(
            codim2_curve, field, point, "ground.speed", both=False, options=settings,
            bounds={"B": (0.3, 12.0), "ground.speed": (0.9, speed)}), repetitions)
        error = curve.parameter[-1] / force - 1.0
        each = seconds / len(curve)
        print(f"{intervals:4} curve of {kind}s: {len(curve)} points, {1e3 * each:.2f} ms per "
              f"point, {each / orbit:.2f} of an orbit, error at its end {error:.1e}")
        if peer is not None:
            other = peer.curve(kind, intervals, speed, repetitions)
            theirs = other.seconds / other.points
            print(f"{intervals:4} the same by AUTO-07p: {other.points} points, {1e3 * theirs:.2f} "
                  f"ms per point, error {other.force / force - 1.0:.1e}; {each / theirs:.2f} of "
                  f"its time")


def tori(intervals: int, repetitions: int) -> None:
    """Print the line of a curve of tori, lam = a^2."""
    field = vector_field(turning, {"lam": -0.2, "a": 0.3}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    settings = ContinuationOptions(step=0.002, largest_step=0.01, points=61)
    follow = partial(orbit_branch, field, PeriodicMotion(t, circle, period=np.pi), "lam",
                     method=Collocation(intervals=intervals), bounds=(-0.5, 0.5),
                     scales=np.ones(3), options=settings)
    point = follow().of_kind("Neimark-Sacker")[0]
    trace = partial(codim2_curve, field, point, "a", both=False, direction=-1.0, options=settings,
                    bounds={"lam": (-0.1, 0.5), "a": (-0.5, 0.5)})
    trace()
    seconds, branch = timed(follow, repetitions)
    longer, curve = timed(trace, repetitions)
    orbit, each = seconds / len(branch), longer / len(curve)
    error = np.abs(curve.parameter - curve.column("a") ** 2).max()
    print(f"{intervals:4} curve of tori: {len(curve)} points, {1e3 * each:.2f} ms per point, "
          f"{each / orbit:.2f} of an orbit, error {error:.1e}")


def row(name: str, seconds: float, points: int, fold: float, doubling: float) -> str:
    """A line of the table."""
    return (f"{name:14} {points:7}  {seconds:6.3f} s  {1e3 * seconds / points:6.2f} ms"
            f"   {fold / FOLD - 1.0:9.1e} {doubling / DOUBLING - 1.0:9.1e}")


def main(repetitions: int = 5, quick: bool = False) -> None:
    """Print the table; quickly its first row once, and few points of the chain."""
    if quick:
        repetitions = 1
    field = two_masses()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 12.0))
    hopf = sliding.of_kind("Hopf")[0]
    settings = ContinuationOptions(step=0.002, largest_step=0.065, points=1000)
    with auto() as peer:
        print("intervals, by   points  CPU time  per point   error of fold, doubling   of its time")
        for intervals in (50,) if quick else (COARSE, 50, 70, 100, 200):
            task = partial(
                orbit_branch, field, hopf, method=Collocation(intervals, state_tolerance=None),
                options=settings, bounds=(0.3, 12.0), scales=np.ones(4))
            if not quick:
                task()
            seconds, branch = timed(task, repetitions)
            print(row(f"{intervals:4} fecontact", seconds, len(branch),
                      branch.of_kind("fold")[0].parameter,
                      branch.of_kind("period doubling")[0].parameter))
            if peer is not None:
                other = peer.branch(intervals, repetitions)
                print(row(f"{intervals:4} AUTO-07p", *other) + f"   {seconds / other.seconds:6.2f}")
            if intervals > COARSE:
                curves(field, branch, seconds / len(branch), repetitions, settings, peer)
                tori(intervals, repetitions)
    large = chain(20)
    sliding = equilibrium_branch(large, parameter="B", bounds=(0.1, 3.0))
    hopf = sliding.of_kind("Hopf")[0]
    settings = ContinuationOptions(step=0.002, largest_step=0.02, points=3 if quick else 20)
    seconds, branch = timed(lambda: orbit_branch(large, hopf, method=Collocation(intervals=100),
                                                 options=settings, bounds=(0.1, 3.0)), 1)
    print(f"40 states, 100 intervals: {len(branch)} points, {seconds / len(branch):.3f} s a point")


if __name__ == "__main__":
    explain(__doc__)
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
