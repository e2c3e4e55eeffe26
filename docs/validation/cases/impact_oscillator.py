"""A pendulum strikes a stop: periodic, chaotic and chattering motions of one oscillator.

Section 4.2 of W. Sextro, Dynamical Contact Problems with Friction: at five frequencies of the
spring's end the motion repeats after one, two or four periods, never, or after each period, in
which rebounds accumulate until the pendulum rests on the stop. The pendulum is the finite-element
body of impact_oscillator.toml, or its two first modes alone, given by four numbers.

Usage: python impact_oscillator.py [--quick]   (prints a table, in about a minute;
impact_figures.py and impact_map.py draw)
"""

import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fecontact import (
    ContactSystem,
    Drive,
    Study,
    Trajectory,
    basis_from_matrices,
    sensitivity,
    simulate,
)
from fecontact.analysis import Impacts, Periodicity, Rest, find_impacts, find_rests, periodicity
from fecontact.analysis.periodicity import drive_period
from fecontact.bifurcation import lyapunov_exponents
from fecontact.laws import Frictionless, RoughSurface

STUDY = Path(__file__).parents[3] / "examples" / "impact_oscillator.toml"
REDUCED_MASS = 0.092  # kg
FREQUENCIES = {  # of the source [rad/s], and what it reports
    64.32: "periodic, one contact",
    30.84: "period two",
    37.41: "higher periodic",
    23.63: "chaotic",
    9.845: "chatter, at rest once every period",
}
ORBIT = 1e-3  # of the motion's range; what repeats less exactly has no multipliers
OUTPUT_STEP = 4e-5  # s; an impact lasts 3 ms or more
LAW = RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0)
DRIVE = Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3, frequency_hz=10.24)


def hertz(of_source: float) -> float:
    """A frequency of the source [rad/s] in Hz."""
    return of_source / (2.0 * np.pi)


def driven(system: ContactSystem, of_source: float) -> ContactSystem:
    """The system at a frequency of the source [rad/s]."""
    return system.with_({"drive.frequency_hz": hertz(of_source)})


@cache
def mesh_system(modes: int = 4) -> ContactSystem:
    """The finite-element pendulum of the study file, with its first modes."""
    system = Study.read(STUDY).system()
    return system.with_(basis=system.basis.select(range(modes)))


def two_mode_system(bending_hz: float = 230.0, ratio: float = 0.600,
                    damping: float = 0.03) -> ContactSystem:
    """Rotation and one bending mode, spring and contact at one point.

    ``ratio`` is the amplitude of the bending mode there over that of the rotation, both
    mass-normalised.
    """
    row = np.array([1.0, ratio]) / np.sqrt(REDUCED_MASS)
    rows = np.zeros((3, 2))
    rows[1] = row
    basis = basis_from_matrices(
        np.eye(2), np.diag([0.0, (2.0 * np.pi * bending_hz) ** 2]), {"contact": rows[None],
                                                                    "B": rows},
        damping=(0.0, damping))
    return ContactSystem(basis, normal=LAW, friction=Frictionless(), drive=DRIVE)


def start(system: ContactSystem, height: float = 0.0, velocity: float = 0.0) -> np.ndarray:
    """State with the rotation alone: height [m] and velocity [m/s] of the contact."""
    m = system.basis.modes
    state = np.zeros(2 * m)
    state[[0, m]] = np.array([height, velocity]) / system.basis.contact_T[:, 1, 0].mean()
    return state


def settled(system: ContactSystem, initial: np.ndarray | None = None, *, transient: int = 300,
            periods: int = 40, per_period: int | None = None, **options: Any) -> Trajectory:
    """Whole periods of the motion after a transient, by default with resolved impacts."""
    period = drive_period(system)
    count = per_period or int(np.ceil(period / OUTPUT_STEP))
    options = {"rtol": 1e-7, **options}
    begun = simulate(system, transient * period, outputs=2,
                     initial=start(system) if initial is None else initial, **options)
    return simulate(system, (transient + periods) * period, initial=begun,
                    outputs=count * periods + 1, **options)


@dataclass(frozen=True)
class Regime:
    """Kind of a settled motion: its period, impacts and rests.

    Attributes
    ----------
    periodicity : Periodicity
        Number of drive periods after which it repeats, None if never; to within 0.2 % of its
        size, or 3 % if it comes to rest, where some vibration is left at lift-off.
    impacts : Impacts
    rests : list of Rest
    per_period : (k,) integer array
        Impacts in each period.
    """

    periodicity: Periodicity
    impacts: Impacts
    rests: list[Rest]
    per_period: np.ndarray

    @property
    def name(self) -> str:
        """In words."""
        periods = self.periodicity.periods
        words = "not periodic" if periods is None else f"period {periods}"
        return words + (", comes to rest" if self.rests else "")


def regime(run: Trajectory) -> Regime:
    """Periods, impacts and rests of a settled motion with resolved impacts."""
    period, begin = drive_period(run.system), float(run.time[0])
    impacts, rests = find_impacts(run), find_rests(run)
    found = periodicity(run, t_start=begin, largest=8, tolerance=0.03 if rests else 2e-3)
    return Regime(found, impacts, rests,
                  impacts.per_period(period, begin, float(run.time[-1])))


def exponent(run: Trajectory, found: Regime, periods: int = 400) -> tuple[float, float]:
    """Largest Lyapunov exponent [1/s] of a settled motion, and its standard error.

    That of an orbit is ln |mu| / T from its largest multiplier mu, without a standard error (nan);
    others are followed over some drive periods.
    """
    end, period = float(run.time[-1]), drive_period(run.system)
    repeats = found.periodicity.periods
    if repeats and found.periodicity.misfit < ORBIT:
        orbit = sensitivity(run.system, end + repeats * period, t_start=end,
                            initial=run.states[-1])
        largest = np.abs(np.linalg.eigvals(orbit.monodromy)).max()
        return float(np.log(largest) / (repeats * period)), float("nan")
    growth = lyapunov_exponents(run.system, periods * period, initial=run.states[-1])
    return float(growth.exponents[0]), float(growth.uncertainty[0])


def in_words(growth: float, error: float) -> str:
    """An exponent with its standard error, if it has one."""
    return f"{growth:+.3f}" if np.isnan(error) else f"{growth:+.1f} ± {error:.1f}"


def main(quick: bool = False) -> None:
    """Print what each frequency gives on the mesh and with two modes; quickly the first alone."""
    print("| drive [Hz] | in the source [rad/s] | it reports | modes | found | misfit | "
          "impacts a period | largest exponent [1/s] |\n" + 8 * "|---" + "|")
    options: dict[str, Any] = {"transient": 100, "periods": 24, "per_period": 400} if quick else {}
    for frequency, reported in list(FREQUENCIES.items())[: 1 if quick else None]:
        for system in (two_mode_system(), mesh_system()):
            run = settled(driven(system, frequency), **options)
            found = regime(run)
            growth, error = exponent(run, found)
            counts = found.per_period
            print(f"| {hertz(frequency):.3f} | {frequency:g} | {reported} | "
                  f"{system.basis.modes} | {found.name} | {found.periodicity.misfit:.0e} | "
                  f"{counts.min()} to {counts.max()} | {in_words(growth, error)} |", flush=True)


if __name__ == "__main__":
    main("--quick" in sys.argv)
