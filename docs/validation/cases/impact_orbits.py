"""Impacts over the frequency of excitation: stable and unstable orbits over runs by brute force.

The impact oscillator of W. Sextro, Dynamical Contact Problems with Friction, section 4.2: a
pendulum that strikes a stop, with its first bending mode. The source shows single motions. Here
runs over the frequency of the drive show what is found, up and down; orbits of one, two and four
periods are followed by shooting through what runs cannot see: the unstable orbit inside the chaos,
the folds between which motions coexist, and the doublings. Each doubled branch is followed too.

Printed are all folds, doublings and torus bifurcations, and how many of the repeating runs lie on
the branches; docs/impacts.md says what they mean.

Usage: python impact_orbits.py [FOLDER] [--quick]   (prints and draws; five to ten minutes)
"""

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import fecontact as fc
from fecontact import FecontactError
from fecontact.bifurcation import (
    Branch,
    BranchPoint,
    ContactField,
    ContinuationOptions,
    PoincareScan,
    Shooting,
    contact_field,
    orbit_branch,
    periodic_motion,
    poincare_scan,
)
from fecontact.laws import RoughSurface
from fecontact.plot import phase_inset, plot_branches

Array = NDArray[np.float64]

FREQUENCY = "drive.frequency_hz"
BENDING_HZ, BENDING_DAMPING, AMPLITUDE, MASS = 230.0, 0.03, 0.6, 0.092
# Amplitudes of an orbit, and Hz, that count as one in the length of a step. The bending vibration
# that an impact leaves turns by a radian within 0.015 to 0.05 Hz of the drive.
SIZE, WIDTH = 20.0, 4.0
RTOL = 1e-7
SAME, SAME_HZ = 2e-6, 1.5e-4  # m by which motions once a period may differ and be the same; Hz


class Start(NamedTuple):
    """A run, by its frequency and way, and how far the orbit on which it is is followed."""

    frequency_hz: float
    way: str
    bounds: tuple[float, float]
    points: int


# The first two are parts of one branch.
STARTS = (Start(6.68, "up", (3.74, 6.84), 400), Start(7.01, "up", (6.84, 12.75), 450),
          Start(4.76, "up", (4.14, 4.94), 170), Start(4.01, "up", (3.98, 4.62), 60))


def oscillator(frequency_hz: float = 10.24) -> fc.ContactSystem:
    """The rigid and the first bending mode of the pendulum, at its tip."""
    T = np.zeros((3, 3, 2))
    T[:, 1] = np.array([1.0, AMPLITUDE]) / np.sqrt(MASS)
    frequencies = np.array([0.0, 2.0 * np.pi * BENDING_HZ])
    basis = fc.ModalBasis(frequencies, np.diag(2.0 * BENDING_DAMPING * frequencies), T,
                          np.zeros((3, 2)), np.ones(1))
    return fc.ContactSystem(
        basis, normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
        drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                       frequency_hz=frequency_hz))


def field_at(frequency_hz: float) -> ContactField:
    """The oscillator as a function of the drive's frequency."""
    return contact_field(oscillator(frequency_hz), {FREQUENCY: frequency_hz})


def runs(quick: bool = False) -> PoincareScan:
    """States once per period, up and down; more values where motions change quickly."""
    values = np.concatenate([np.arange(79, 191, 8), np.arange(191, 731, 3),
                             np.arange(731, 1276, 8)]) / 100.0
    if quick:
        values = np.arange(7.0, 8.1, 0.3)
    return poincare_scan(oscillator(), FREQUENCY, values, transient_periods=100, keep=24,
                         initial=np.zeros(4))


def orbits(
    frequency_hz: float, bounds: tuple[float, float], *, initial: Array | None = None,
    points: int = 60,
) -> Branch:
    """The branch through the orbit on which a run settles, ``points`` to either side."""
    field = field_at(frequency_hz)
    motion = periodic_motion(
        field.system(), initial=np.zeros(4) if initial is None else initial,
        transient=None if initial is None else 1.0 / frequency_hz,
        longest_period=8.0 / frequency_hz)
    return orbit_branch(
        field, motion, method=Shooting(segments=motion.periods, rtol=RTOL), bounds=bounds,
        both=True, scales=SIZE * np.ptp(motion.states, axis=0) / 2.0, width=WIDTH,
        options=ContinuationOptions(step=1e-3, largest_step=0.01, points=2 * points))


def doubled(branch: Branch, doubling: BranchPoint, points: int) -> Branch | None:
    """The branch of twice the period that begins at a doubling, if it is found."""
    # Close to the single orbit the runs are not exact enough, far from it the guess is not.
    for step in (2e-3, 1e-3, 5e-4, 2.5e-4):
        try:
            return orbit_branch(field_at(doubling.parameter), doubling, bounds=(3.98, 12.75),
                                options=ContinuationOptions(step=step, largest_step=0.02,
                                                            points=points))
        except FecontactError as error:
            why = error
    print(f"No doubled orbits from {doubling.parameter:.5f} Hz: {why}")
    return None


def periods(branch: Branch) -> int:
    """Periods of the drive in one of the orbit."""
    return int(branch.attributes["periods"])


def section(point: BranchPoint) -> Array:
    """Displacement (n,) of the tip [m] at the start of each period."""
    return point.u[:-1].reshape(-1, 4)[:, :2] @ np.array([1.0, AMPLITUDE]) / np.sqrt(MASS)


def place(point: BranchPoint) -> Array:
    """Frequency, and mean and extremes of the section, in units of what is the same."""
    y = section(point) / SAME
    return np.array([point.parameter / SAME_HZ, y.mean(), y.min(), y.max()])


def known(point: BranchPoint, others: Sequence[Array]) -> bool:
    """Whether the point is one of others, whatever the period in which each begins."""
    return any(bool((np.abs(place(point) - other) < 1.0).all()) for other in others)


def all_orbits(found: PoincareScan, starts: Sequence[Start] = STARTS) -> list[Branch]:
    """Branches from the starts, those that double there, and those that double on these."""
    def begun(start: Start) -> Branch | None:
        index = int(np.argmin(np.abs(found.values - start.frequency_hz)))
        states = found.up if start.way == "up" else found.down
        try:
            return orbits(float(found.values[index]), start.bounds, initial=states[index, -1],
                          points=start.points)
        except FecontactError as error:
            print(f"No orbits from the run at {start.frequency_hz} Hz: {error}")
            return None

    with ThreadPoolExecutor(2) as pool:
        branches = [branch for branch in pool.map(begun, starts) if branch is not None]
        latest = [branch for branch in branches if periods(branch) == 1]
        for points in (110, 40):
            latest = all_doubled(pool, latest, points)
            branches += latest
    return branches


def all_doubled(
    pool: ThreadPoolExecutor, branches: Sequence[Branch], points: int
) -> list[Branch]:
    """Branches from all doublings of others; inside the chaos below 4.14 Hz there are too many."""
    doublings: list[tuple[Branch, BranchPoint]] = []
    for branch in branches:
        for point in branch.of_kind("period doubling"):
            if point.parameter > 4.14 and not known(point, [place(one) for _, one in doublings]):
                doublings.append((branch, point))
    tried = pool.map(lambda pair: doubled(*pair, points), doublings)
    found: list[Branch] = []
    reached: list[Array] = []
    for (_, doubling), branch in zip(doublings, tried, strict=True):
        # A branch that ends at this doubling is the same.
        if branch is not None and not known(doubling, reached):
            found.append(branch)
            reached += [place(end) for end in branch.of_kind("period halving")]
    return found


def special(branches: Sequence[Branch]) -> Iterator[tuple[int, BranchPoint]]:
    """Periods and point of all special points, once each."""
    seen: list[Array] = []
    for branch in branches:
        for point in branch.special:
            if point.kind != "period halving" and not known(point, seen):
                seen.append(place(point))
                yield periods(branch), point


def covered(found: PoincareScan, branches: Sequence[Branch]) -> tuple[int, list[float]]:
    """Runs that repeat after up to 4 periods on an orbit that is known, and where others are."""
    count, others = 0, []
    for states in (found.up, found.down):
        for frequency, kept in zip(found.values, states, strict=True):
            y = kept[:, :2] @ np.array([1.0, AMPLITUDE]) / np.sqrt(MASS)
            n = next((n for n in (1, 2, 4) if np.abs(y[n:] - y[:-n]).max() < SAME / 10.0), None)
            if n is None:
                continue
            if any(_meets(branch, float(frequency), np.sort(y[-n:])) for branch in branches
                   if periods(branch) == n):
                count += 1
            else:
                others.append(float(frequency))
    return count, sorted(set(others))


def _meets(branch: Branch, frequency_hz: float, y: Array) -> bool:
    """Whether a branch has an orbit with this section there, by chords between its points."""
    for one, other in pairwise(branch.points):
        before, after = frequency_hz - one.parameter, other.parameter - frequency_hz
        if before * after >= -1e-14:
            part = before / ((other.parameter - one.parameter) or 1.0)
            first, last = np.sort(section(one)), np.sort(section(other))
            allowed = SAME + 0.1 * np.abs(last - first)
            if (np.abs(first + part * (last - first) - y) < allowed).all():
                return True
    return False


def pieces(branch: Branch, low: float, high: float, marked: bool) -> list[Branch]:
    """Pieces of a branch in a range, with their section; doublings stand on single orbits."""
    found: list[list[BranchPoint]] = [[]]
    for point in branch.points:
        inside = low <= point.parameter <= high
        if inside and (marked or point.kind in (None, "period halving")):
            found[-1].append(replace(
                point, kind=None if point.kind == "period halving" else point.kind,
                values={**point.values, "observed_section": section(point)}))
        elif not inside and found[-1]:
            found.append([])
    return [replace(branch, points=tuple(points)) for points in found if len(points) > 1]


def draw(
    path: Path, branches: Sequence[Branch], found: PoincareScan, low: float, high: float,
    chosen: Sequence[tuple[int, float]], marked: bool = False,
) -> None:
    """The diagram of a range, with phase planes of orbits of so many periods near some places."""
    shown = sorted((piece for branch in branches for piece in pieces(branch, low, high, marked)),
                   key=periods)
    insets = []
    for count, frequency in chosen:
        there = [point for branch in shown if periods(branch) == count
                 for point in branch.points if point.kind is None]
        if not there:
            continue
        point = min(there, key=lambda one: abs(one.parameter - frequency))
        kind = "" if point.values["stable"] else ", unstable"
        insets.append(phase_inset(field_at(frequency), point, ("B", "y"),
                                  f"{point.parameter:.3f} Hz{kind}"))
    part = (low <= found.values) & (found.values <= high)
    plot_branches(shown, "observed_section",
                  x_label="frequency of the drive [Hz]",
                  y_label="displacement once per period [m]",
                  names=[f"period {periods(branch)}" for branch in shown],
                  beneath=replace(found, values=found.values[part], up=found.up[part],
                                  down=found.down[part]),
                  observe=("B", "y"), insets=insets, path=path)


def main(folder: Path = Path("impact-orbits"), quick: bool = False) -> None:
    """Run, follow, print and draw; with ``quick`` a few orbits of one branch."""
    folder.mkdir(parents=True, exist_ok=True)
    found = runs(quick)
    branches = all_orbits(found, (Start(7.6, "up", (6.84, 8.28), 40),) if quick else STARTS)
    for branch in branches:
        print(f"period {periods(branch)}: {branch.parameter.min():.5f} to "
              f"{branch.parameter.max():.5f} Hz, {len(branch)} points. {branch.status.value}")
    print("\nperiods  kind                 Hz")
    for count, point in sorted(special(branches), key=lambda each: each[1].parameter):
        print(f"{count:7d}  {point.kind or '':16s} {point.parameter:9.6f}")
    count, others = covered(found, branches)
    print(f"\n{count} runs that repeat every 1, 2 or 4 periods are on these branches; others are "
          f"at {', '.join(f'{other:.2f}' for other in others) or 'no'} Hz.")
    draw(folder / "impact_orbits.png", branches, found, 0.8, 12.75,
         [(1, 4.14), (2, 5.73), (1, 7.16), (1, 10.24)])
    if quick:
        return
    draw(folder / "impact_doublings.png", branches, found, 5.4, 6.6,
         [(2, 5.73), (1, 5.95), (4, 6.21), (1, 6.29)], marked=True)


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
