"""Dither makes sliding easier: mean friction under vibration across and along the motion.

A body slides at the speed V while its ground shakes with the velocity a cos w t. Friction keeps its
size mu N but not its direction. Vibration across turns it away from the motion and back; its mean
along the motion over mu N is

    2 / pi V / sqrt(V^2 + a^2) K(m),    m = a^2 / (V^2 + a^2)

with the complete elliptic integral K of the parameter m. Vibration along the motion turns friction
round whenever it is faster than V, and leaves 2 / pi arcsin(V / a) up to V = a, and everything
above. For slow motion both act like a dashpot.

Usage: python dithered_friction.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import ellipk

import fecontact as fc
from fecontact.laws import ConstantFriction, HarmonicSpeed, LinearContact
from fecontact.reduction import point_masses

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MU, NORMAL, AMPLITUDE, FREQUENCY = 0.3, 10.0, 1.0, 100.0  # -, N, m/s, Hz
# So heavy, beside the force that presses it, that friction does not change its motion.
MASS = 1e9
Direction = Literal["across", "along"]
DIRECTIONS: tuple[Direction, ...] = ("across", "along")


def closed_form(ratio: np.ndarray, direction: Direction) -> np.ndarray:
    """Mean friction along the motion over mu N, for V / a."""
    ratio = np.asarray(ratio, dtype=float)
    if direction == "along":
        return 2.0 / np.pi * np.arcsin(np.minimum(ratio, 1.0))
    rest = 1.0 / (1.0 + ratio**2)
    return 2.0 / np.pi * np.sqrt(1.0 - rest) * ellipk(rest)


def dithered(ratio: float, direction: Direction, slope: float = 1e6) -> fc.Trajectory:
    """One period of the dither while a mass slides at V = ratio a; k_s is the slope [s/m]."""
    shaking = HarmonicSpeed(AMPLITUDE, FREQUENCY)
    speed = ratio * AMPLITUDE
    # The ground runs backwards instead.
    ground = fc.Ground(speed=-speed, **{"motion_y" if direction == "across" else "motion": shaking})
    system = fc.ContactSystem(
        point_masses({"mass": MASS}, components="xyz", contact="mass"),
        normal=LinearContact(stiffness=1e6), friction=ConstantFriction(MU, smoothing_slope=slope),
        ground=ground, load=fc.Load(gravity=(0.0, 0.0, -NORMAL / MASS)))
    return fc.simulate(system, 1.0 / FREQUENCY, initial="rest", outputs=40001, rtol=1e-8)


def mean_friction(run: fc.Trajectory) -> float:
    """Mean friction along the motion over mu N, over the period."""
    mean = np.trapezoid(run.friction_force[:, 0], run.time) / run.time[-1]
    return float(mean) / (MU * NORMAL)


def figure(ratios: np.ndarray, found: dict[Direction, np.ndarray], runs: dict[str, fc.Trajectory],
           path: Path | None = None) -> "Figure":
    """Mean friction over V / a beside the closed forms, and friction within a period."""
    from fecontact.plot import COLOURS, new_figure

    fine = np.linspace(1e-4, ratios[-1], 500)
    with new_figure(8.6, 4.0, path) as drawn:
        means, within = drawn.subplots(1, 2)
        for colour, (direction, values) in zip(COLOURS, found.items(), strict=False):
            means.plot(fine, closed_form(fine, direction), color=colour)
            means.plot(ratios, values, "o", color=colour, label=direction)
        means.set(xlabel="V / a", ylabel="mean friction / (µ N)", ylim=(0.0, 1.05))
        means.legend(title="dither")
        for colour, (name, run) in zip(COLOURS[2:], runs.items(), strict=False):
            force = run.friction_force[:, 0] / (MU * NORMAL)
            within.plot(1e3 * run.time[::40], force[::40], color=colour)
            within.text(1e3 * run.time[len(force) // 4], force.min() - 0.02, name, ha="center",
                        va="top")
        within.set(title="dither across", xlabel="time [ms]", ylim=(0.0, 1.05),
                   ylabel="friction along the motion / (µ N)")
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print mean friction beside the closed forms; draw both."""
    ratios = np.array([0.1, 0.5, 1.0, 2.0]) if quick else np.array(
        [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0])
    found = {}
    for direction in DIRECTIONS:
        found[direction] = np.array([mean_friction(dithered(ratio, direction)) for ratio in ratios])
        for ratio, value in zip(ratios, found[direction], strict=True):
            if ratio in (0.1, 0.5, 1.0, 2.0):
                print(f"dither {direction}, V = {ratio:g} a: {value:.7f} "
                      f"(closed form {float(closed_form(ratio, direction)):.7f})")
    rough = mean_friction(dithered(0.1, "across", 1e4)) / float(closed_form(0.1, "across")) - 1.0
    print(f"k_s = 1e4 s/m at V = 0.1 a: {rough:.1e} off, a hundred times as much as with 1e6 s/m")
    folder.mkdir(parents=True, exist_ok=True)
    figure(ratios, found, {f"V = {ratio:g} a": dithered(ratio, "across")
                           for ratio in (0.1, 0.5, 1.0)}, folder / "dithered_friction.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
