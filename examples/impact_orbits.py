"""Impacts over the frequency of excitation: stable and unstable orbits over runs by brute force.

The impact oscillator of W. Sextro, Dynamical Contact Problems with Friction, section 4.2: a
pendulum that strikes a stop, with its first bending mode. The source shows single motions; here the
periodic ones are followed over the frequency of the drive by shooting with the compiled integrator,
stable or not, and lie over the diagram that runs give. Where nothing is solid the motion is
chaotic, or has more periods.

From some 41 rad/s on, runs from rest all lead to one motion of one period. Its stability ends at a
grazing: the tip touches the stop once more, and a multiplier jumps instead of passing through the
unit circle. Such points are no folds and no doublings; between which
frequencies they lie is printed.

Usage: python examples/impact_orbits.py [FOLDER]      (prints and draws; a few minutes)
"""

import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

import fecontact as fc
from fecontact.bifurcation.contact_field import ContactField
from fecontact.bifurcation.problem import Settings
from fecontact.errors import AnalysisError

FREQUENCY = "drive.angular_frequency"
BENDING_HZ, BENDING_DAMPING, AMPLITUDE, MASS = 230.0, 0.03, 0.6, 0.092
# Amplitudes of an orbit that count as one in the length of a step: its phase turns quickly.
SIZE = 20.0


class Window(NamedTuple):
    """A range of the drive's angular frequency [rad/s], and where orbits are started."""

    low: float
    high: float
    starts: Sequence[float]


WINDOWS = {"fast": Window(55.0, 80.0, (64.32,)), "slow": Window(35.0, 46.0, (42.0, 36.5))}


def oscillator(w: float = 64.32) -> fc.ContactSystem:
    """The rigid and the first bending mode of the pendulum, at its tip."""
    T = np.zeros((3, 3, 2))
    T[:, 1] = np.array([1.0, AMPLITUDE]) / np.sqrt(MASS)
    frequencies = np.array([0.0, 2.0 * np.pi * BENDING_HZ])
    basis = fc.ModalBasis(frequencies, np.diag(2.0 * BENDING_DAMPING * frequencies), T,
                          np.zeros((3, 2)), np.ones(1))
    return fc.ContactSystem(
        basis, normal=fc.RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
        drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                       angular_frequency=w))


def field_at(w: float) -> ContactField:
    """The oscillator as a function of the drive's frequency."""
    return fc.contact_field(oscillator(w), {FREQUENCY: w})


def orbits(w: float, low: float, high: float, *, points: int = 60, step: float = 0.02) -> fc.Branch:
    """The branch through the orbit on which a run at w settles, to both sides."""
    field = field_at(w)
    motion = fc.settled_motion(field.system(), initial=np.zeros(4), longest_period=16 * 0.2)
    size = np.ptp(motion.states, axis=0) / 2.0
    return fc.orbits_by_shooting(
        field, FREQUENCY, motion.times, motion.states, periods=motion.periods,
        segments=2 * motion.periods, bounds=(low, high), both=True, scales=SIZE * size,
        settings=Settings(step=step, largest_step=0.05, points=points))


def jumps(branch: fc.Branch) -> list[tuple[float, float]]:
    """Neighbouring frequencies [rad/s] between which the stability changes at no special point."""
    return [(one.parameter, other.parameter)
            for one, other in pairwise(branch.points)
            if one.kind is None and other.kind is None
            and one.values["unstable"] != other.values["unstable"]]


def with_doublings(branch: fc.Branch, *, points: int = 30) -> list[fc.Branch]:
    """A branch, and those of twice the period that begin on it."""
    field = field_at(float(branch.attributes["parameter_values"][0]))
    found = [branch]
    low, high = branch.parameter.min(), branch.parameter.max()
    for doubling in branch.of_kind("period doubling"):
        try:
            found.append(fc.doubled_by_shooting(
                field, branch, doubling, bounds=(low, high),
                settings=Settings(step=2e-3, largest_step=0.05, points=points)))
        except AnalysisError as error:
            print(f"No doubled orbits from {doubling.parameter:.4f} rad/s: {error}")
    return found


def runs(low: float, high: float, count: int, keep: int = 32) -> fc.BruteForce:
    """States once per period, up and down."""
    return fc.brute_force(oscillator(low), FREQUENCY, np.linspace(low, high, count),
                          transient=150, keep=keep, initial=np.zeros(4))


def described(branch: fc.Branch) -> str:
    """Periods of the drive in one of the orbit."""
    return f"period {int(branch.attributes['periods'])}"


def main(folder: Path = Path("impact-orbits")) -> None:
    """Follow, print and draw the orbits of both windows."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, (low, high, starts) in WINDOWS.items():
        found: list[fc.Branch] = []
        for w in starts:
            try:
                found += with_doublings(orbits(w, low, high))
            except AnalysisError as error:
                print(f"No orbits from {w} rad/s: {error}")
        field = field_at(starts[0])
        shown = [fc.observe(field, branch, "B", "y") for branch in found]
        for branch in shown:
            print(f"\n{described(branch)}: {branch.parameter.min():.4f} to "
                  f"{branch.parameter.max():.4f} rad/s, {len(branch)} points. "
                  f"{branch.status.value}")
            for point in branch.special:
                print(f"  {point.kind} at {point.parameter:.5f} rad/s")
            for ends in jumps(branch):
                print(f"  stability jumps between {min(ends):.5f} and {max(ends):.5f} rad/s")
        insets: list[fc.Inset] = []
        for branch in shown:
            stable = [point for point in branch.points
                      if point.values["stable"] and point.kind is None]
            if stable and len(insets) < 4:
                middle = stable[len(stable) // 2]
                insets.append(fc.phase_inset(field, branch, middle,
                                          float(middle.values["observed_section"][0]),
                                          ("B", "y")))
        fc.plot_branches(shown, folder / f"impact_{name}.png", "observed_section",
                      x_label="angular frequency of the drive [rad/s]",
                      y_label="displacement once per period [m]",
                      names=[described(branch) for branch in shown],
                      beneath=runs(low, high, 201), observe=("B", "y"), insets=insets)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
