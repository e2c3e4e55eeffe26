"""Pictures of the impact oscillator: phase diagrams, Poincaré sections and chatter.

Figures 4.2-2 and 4.2-3 of the source are phase diagrams at five frequencies, and displacement,
velocity and phase diagram of the chatter; here at the middle of the contact.

Usage: python impact_figures.py [FOLDER] [--quick]
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from impact_oscillator import (
    FREQUENCIES,
    driven,
    hertz,
    mesh_system,
    settled,
    two_mode_system,
)

from fecontact import ContactSystem, Trajectory
from fecontact.analysis.periodicity import drive_period
from fecontact.plot import COLOURS, new_figure

# By frequencies of the source [rad/s], as all of what is made for these.
SHOWN_PERIODS = {64.32: 4, 30.84: 4, 37.41: 4, 23.63: 25, 9.845: 2}
SECTION_POINTS = 3000


def contact_motion(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Height [um] and velocity [mm/s] of the middle of the contact above the stop."""
    node = run.system.basis.contact_nodes // 2
    return 1e6 * run.displacement(node)[:, 1], 1e3 * run.velocity(node)[:, 1]


def draw_phase(axes: Any, run: Trajectory) -> None:
    """Velocity over height, points once per period, and the stop."""
    height, velocity = contact_motion(run)
    period = drive_period(run.system)
    once = np.round(np.arange(run.time[0], run.time[-1] + 0.5 * period, period) - run.time[0], 9)
    marks = np.searchsorted(run.time - run.time[0], once - 1e-9).clip(max=len(run.time) - 1)
    axes.axvspan(min(-30.0, 1.3 * height.min()), 0.0, color="#e3e0da", linewidth=0.0)
    axes.plot(height, velocity, color=COLOURS[0], linewidth=0.6)
    axes.plot(height[marks], velocity[marks], ".", color=COLOURS[1], markersize=5)
    axes.set_xlim(left=-30.0)
    axes.set_xlabel("height [µm]")
    axes.set_ylabel("velocity [mm/s]")


def phase_figure(runs: dict[float, Trajectory]) -> Any:
    """Phase diagrams at the five frequencies, as Fig. 4.2-2."""
    with new_figure(10.0, 5.8) as figure:
        for axes, (frequency, run) in zip(figure.subplots(2, 3).flat, runs.items(), strict=False):
            draw_phase(axes, run)
            axes.set_title(f"{hertz(frequency):.3f} Hz: {FREQUENCIES[frequency]}", fontsize=9.5)
        empty = figure.axes[-1]
        empty.axis("off")
        empty.legend(handles=[
            empty.plot([], [], color=COLOURS[0], label="middle of the contact")[0],
            empty.plot([], [], ".", color=COLOURS[1],
                       label="once a period, drive at zero, rising")[0],
            empty.fill_between([], [], color="#e3e0da", label="stop")], loc="center")
    return figure


def chatter_figure(run: Trajectory) -> Any:
    """Displacement and velocity over a period, and their phase diagram, as Fig. 4.2-3."""
    with new_figure(10.0, 6.2) as figure:
        grid = figure.subplot_mosaic(
            [["height", "phase"], ["velocity", "phase"], ["close", "near"]])
        height, velocity = contact_motion(run)
        period = drive_period(run.system)
        part = (run.time - run.time[0]) / period
        for name, values, label in (("height", height, "height [µm]"),
                                    ("velocity", velocity, "velocity [mm/s]"),
                                    ("close", height, "height [µm], close")):
            grid[name].plot(part, values, color=COLOURS[0], linewidth=0.8)
            grid[name].set_xlabel("time / period of the drive")
            grid[name].set_ylabel(label)
        grid["close"].set_xlim(0.5, 1.05)
        grid["close"].set_ylim(-7.0, 42.0)
        grid["close"].axhspan(-7.0, 0.0, color="#e3e0da", linewidth=0.0)
        draw_phase(grid["phase"], run)
        draw_phase(grid["near"], run)
        grid["near"].set_xlim(-7.0, 42.0)
    return figure


def section_figure(points: dict[float, np.ndarray]) -> Any:
    """States at the middle of the contact once a period: heights [um], velocities [mm/s]."""
    with new_figure(10.0, 4.2) as figure:
        chaos, orbits = figure.subplots(1, 2)
        for axes, frequencies in ((chaos, [23.63]), (orbits, [w for w in points if w != 23.63])):
            for number, frequency in enumerate(frequencies):
                height, velocity = points[frequency]
                axes.plot(height, velocity, "." if axes is chaos else "o", color=COLOURS[number],
                          markersize=1.5 if axes is chaos else 5,
                          label=f"{hertz(frequency):.3f} Hz")
            axes.set_xlabel("height [µm]")
            axes.set_ylabel("velocity [mm/s]")
            axes.legend(loc="best", markerscale=5 if axes is chaos else 1)
    return figure


def strobed(system: ContactSystem, count: int, transient: int = 200) -> np.ndarray:
    """Heights [um] and velocities [mm/s] (2, count) of the contact, drive at zero, rising."""
    run = settled(system, transient=transient, periods=count, per_period=1, rtol=1e-6)
    return np.array(contact_motion(run))


def figures(system: ContactSystem, transient: int = 300,
            points: int = SECTION_POINTS) -> dict[str, Any]:
    """All pictures by name: ``phase``, ``chatter`` and ``sections``."""
    systems = {w: driven(system, w) for w in FREQUENCIES}
    runs = {w: settled(one, transient=transient, periods=SHOWN_PERIODS[w])
            for w, one in systems.items()}
    sections = {w: strobed(one, points if w == 23.63 else min(points, 40), min(transient, 200))
                for w, one in systems.items()}
    return {"phase": phase_figure(runs), "chatter": chatter_figure(runs[9.845]),
            "sections": section_figure(sections)}


def main(folder: Path = Path("impact-figures"), quick: bool = False) -> None:
    """Draw all pictures; with ``quick`` of two modes, and before the motions have settled."""
    folder.mkdir(parents=True, exist_ok=True)
    found = figures(two_mode_system(), 5, 10) if quick else figures(mesh_system())
    for name, figure in found.items():
        figure.savefig(folder / f"impact-{name}.png", dpi=100)
        print(f"{folder / f'impact-{name}.png'}: {len(figure.axes)} diagrams")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
