"""Motions of the impact oscillator over the drive's frequency, and over the bending mode.

A bifurcation diagram from 0.8 to 12.8 Hz, followed upwards and downwards, shows which motions exist
side by side. A map over frequency and damping of the bending mode, which the source does not give,
shows how narrow the window is in which all five reported motions appear. Both take the two-mode
model and thousands of runs, on all cores.

Usage: python impact_map.py [FOLDER] [--quick]   (a minute and a half on two cores)
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from impact_oscillator import FREQUENCIES, driven, hertz, settled, start, two_mode_system
from matplotlib.colors import BoundaryNorm, ListedColormap

from fecontact import ContactSystem
from fecontact.analysis import count_periods
from fecontact.integrate import strobe
from fecontact.plot import COLOURS, new_figure

EXPECTED = {64.32: 1, 30.84: 2, 37.41: 4, 23.63: None, 9.845: 1}  # of the source [rad/s]
SWEPT = np.linspace(0.8, 12.8, 601)  # Hz
BENDINGS_HZ = np.arange(226.0, 234.1, 0.5)
DAMPINGS = np.arange(0.010, 0.0501, 0.005)
LARGEST = 8  # periods; more count as none
CLASSES = ("1", "2", "3", "4", "5 to 8", "none")
FINE, COARSE = 2e-3, 3e-2  # of the motion's range; the second where rest ends every period


@dataclass(frozen=True, eq=False)
class Diagram:
    """Contact once a period, drive at zero and rising.

    ``frequencies`` (F,) [Hz]; ``up`` and ``down`` (F, K, 2), heights [m] and velocities [m/s]
    of the contact on the way to higher and to lower frequencies.
    """

    frequencies: np.ndarray
    up: np.ndarray
    down: np.ndarray


def contact_states(system: ContactSystem, states: np.ndarray) -> np.ndarray:
    """Heights and velocities (..., 2) of the contact from states (..., 2 m)."""
    m = system.basis.modes
    row = system.basis.contact_T[:, 1].mean(axis=0)
    return np.stack([states[..., :m] @ row, states[..., m:] @ row], axis=-1)


def bifurcation(system: ContactSystem, frequencies: np.ndarray, *, transient: int = 50,
                keep: int = 30) -> Diagram:
    """Follow the motion upwards and downwards, each from the end of the one before."""
    systems = [system.with_({"drive.frequency_hz": float(one)}) for one in frequencies]
    # Two chains, one on each of two cores.
    found = strobe(systems + systems[::-1], transient_periods=transient, keep=keep,
                   initial=start(system, 1e-4), chain=len(systems), progress=True)
    if not found.finished.all():
        raise RuntimeError(f"{np.count_nonzero(~found.finished)} runs did not reach their end.")
    points = contact_states(system, found.states)
    return Diagram(frequencies, points[: len(systems)], points[len(systems) :][::-1])


def regime_map(bendings_hz: np.ndarray, dampings: np.ndarray, ratio: float = 0.600, *,
               transient: int = 120) -> dict[float, np.ndarray]:
    """Number of periods (damping, bending) at each frequency of the source [rad/s], 0 for none."""
    keep = LARGEST + 2 * LARGEST
    pairs = [(f, D) for D in dampings for f in bendings_hz]
    periods = {}
    for frequency in EXPECTED:
        systems = [driven(two_mode_system(f, ratio, D), frequency) for f, D in pairs]
        base = settled(driven(two_mode_system(), frequency), transient=100, periods=10)
        scale = np.ptp(contact_states(systems[0], base.states), axis=0)
        rests = frequency == 9.845
        found = strobe(systems, transient_periods=transient // 4 if rests else transient,
                       keep=keep, initial=start(systems[0], 1e-4), progress=True)
        points = contact_states(systems[0], found.states)
        counts = [count_periods(x, scale, largest=1 if rests else LARGEST,
                                tolerance=COARSE if rests else FINE) for x in points]
        periods[frequency] = np.array([count.periods or 0 for count in counts]).reshape(
            len(dampings), len(bendings_hz))
    return periods


def classes(periods: np.ndarray) -> np.ndarray:
    """Index into ``CLASSES`` of numbers of periods."""
    return np.select([periods == 0, periods > 4], [5, 4], periods - 1)


def bifurcation_figure(diagram: Diagram) -> Any:
    """Heights of the contact once a period over the frequency, upwards and downwards."""
    with new_figure(10.0, 6.2) as figure:
        for axes, points, words in zip(figure.subplots(2, 1, sharex=True, sharey=True),
                                       (diagram.up, diagram.down), ("upwards", "downwards"),
                                       strict=True):
            heights = 1e6 * points[:, :, 0]
            axes.plot(np.repeat(diagram.frequencies, heights.shape[1]), heights.ravel(), ".",
                      color=COLOURS[0], markersize=1.0, rasterized=True)
            for frequency in FREQUENCIES:
                axes.axvline(hertz(frequency), color=COLOURS[1], linewidth=0.8, alpha=0.7)
            axes.set_ylabel("height once a period [µm]")
            axes.set_title(f"{words}; lines: frequencies of the source", fontsize=9.5)
        axes.set_xlabel("frequency of the drive [Hz]")
    return figure


def map_figure(bendings_hz: np.ndarray, dampings: np.ndarray,
               periods: dict[float, np.ndarray]) -> Any:
    """Numbers of periods over frequency and damping of the bending mode."""
    with new_figure(10.0, 6.0) as figure:
        panels = figure.subplots(2, 3, sharex=True, sharey=True)
        colours = ListedColormap([*COLOURS[:5], "#303030"])
        norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
        agree = np.zeros((len(dampings), len(bendings_hz)), dtype=int)
        for axes, (frequency, found) in zip(panels.flat, periods.items(), strict=False):
            image = axes.pcolormesh(bendings_hz, dampings, classes(found), cmap=colours, norm=norm)
            expected = EXPECTED[frequency]
            agree += found == (expected or 0)
            axes.set_title(f"{hertz(frequency):.3f} Hz: {expected or 'none'} expected",
                           fontsize=9.5)
        bar = figure.colorbar(image, ax=panels[0], ticks=range(len(CLASSES)),
                              label="repeats after periods")
        bar.ax.set_yticklabels(CLASSES)
        both = panels[1, 2].pcolormesh(bendings_hz, dampings, agree, cmap="Greens", vmin=0, vmax=5)
        figure.colorbar(both, ax=panels[1], label="how many agree")
        panels[1, 2].set_title("frequencies that agree with the source", fontsize=9.5)
        for axes in panels.flat:
            axes.plot(230.0, 0.03, "x", color="white", markersize=7, markeredgewidth=2)
            axes.grid(False)
        for axes in panels[:, 0]:
            axes.set_ylabel("damping ratio")
        for axes in panels[1]:
            axes.set_xlabel("bending mode [Hz]")
    return figure


def main(folder: Path = Path("impact-map"), quick: bool = False) -> None:
    """Compute and draw both; with ``quick`` of few values, over few periods."""
    folder.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    diagram = (bifurcation(two_mode_system(), SWEPT[300::60], transient=20, keep=8) if quick
               else bifurcation(two_mode_system(), SWEPT))
    print(f"bifurcation diagram: {time.perf_counter() - begin:.0f} s", flush=True)
    begin = time.perf_counter()
    bendings, dampings, transient = BENDINGS_HZ, DAMPINGS, 120
    if quick:
        bendings, dampings, transient = bendings[7:10], dampings[3:5], 20
    periods = regime_map(bendings, dampings, transient=transient)
    print(f"map: {time.perf_counter() - begin:.0f} s", flush=True)
    agree = sum((found == (EXPECTED[w] or 0)).astype(int) for w, found in periods.items())
    print(f"up to {np.max(agree)} of {len(EXPECTED)} frequencies agree with the source")
    bifurcation_figure(diagram).savefig(folder / "impact-bifurcation.png", dpi=100)
    map_figure(bendings, dampings, periods).savefig(folder / "impact-map.png", dpi=100)


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
