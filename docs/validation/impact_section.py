"""Section 4.2 of the source: the impact oscillator."""

from dataclasses import dataclass, replace
from pathlib import Path

import impact_figures
import impact_map
import numpy as np
from comparison import table
from impact_calibration import body_of, calibrate, modal_numbers, pendulum_basis
from impact_oscillator import (
    FREQUENCIES,
    Regime,
    driven,
    exponent,
    hertz,
    in_words,
    mesh_system,
    regime,
    settled,
    two_mode_system,
)
from pictures import save

from fecontact import ContactSystem

SHOWN = {  # by frequencies of the source [rad/s]
    64.32: "one closed curve with one contact; bending strong just after separation, all but "
           "gone before the next impact",
    30.84: "two loops that differ a little: period two",
    37.41: "large and small loops in turn, each split once more: period four",
    23.63: "a band that never closes; positive Lyapunov exponent",
    9.845: "one free swing, then rebounds that die away, then rest on the stop until the spring "
           "lifts the pendulum off, every period",
}


@dataclass(frozen=True)
class Row:
    """Motion of one model at one frequency of the source [rad/s]."""

    frequency: float
    modes: int
    found: Regime
    growth: str = ""


def measured(system: ContactSystem, frequency: float, with_exponent: bool) -> Row:
    """Settled motion of a model at a frequency of the source [rad/s]."""
    run = settled(driven(system, frequency))
    found = regime(run)
    return Row(frequency, system.basis.modes, found,
               in_words(*exponent(run, found)) if with_exponent else "")


def section(images: Path) -> str:
    """Text with tables; pictures into a folder."""
    models = (two_mode_system(), mesh_system(2), mesh_system(3), mesh_system(4))
    rows = [measured(system, frequency, number in (0, 3)) for frequency in FREQUENCIES
            for number, system in enumerate(models)]
    for name, figure in impact_figures.figures(mesh_system()).items():
        save(figure, images / f"impact-{name}.png")
    diagram = impact_map.bifurcation(two_mode_system(), impact_map.SWEPT)
    save(impact_map.bifurcation_figure(diagram), images / "impact-bifurcation.png")
    periods = impact_map.regime_map(impact_map.BENDINGS_HZ, impact_map.DAMPINGS)
    save(impact_map.map_figure(impact_map.BENDINGS_HZ, impact_map.DAMPINGS, periods),
         images / "impact-map.png")
    return TEXT.format(
        calibration=calibration_table(), regimes=regimes_table(rows),
        figures=table(("figure", "the source shows", "shown here"),
                      [(f"4.2-2, {both(w)}", reported, SHOWN[w])
                       for w, reported in FREQUENCIES.items()] + [
                          (f"4.2-3, {both(9.845)}",
                           "displacement, velocity and phase diagram of the chatter",
                           "the same three, and both close to the stop")]),
        impacts=impacts_table([row for row in rows if row.modes == 4]),
        window=window(periods), hysteresis=hysteresis(diagram))


def both(frequency: float) -> str:
    """A frequency of the source [rad/s] in both units."""
    return f"{hertz(frequency):.3f} Hz ({frequency:g} rad/s)"


def calibration_table() -> str:
    """The pendulum's numbers, on finer meshes too."""
    shape = calibrate().shape
    rows = []
    for size in (0.004, 0.002, 0.001):
        mass, bending, ratio = modal_numbers(
            pendulum_basis(body_of(replace(shape, element_size=size)), 2))
        rows.append((f"{1e3 * size:g}", f"{mass:.6f}", f"{bending:.4f}", f"{ratio:.6f}"))
    return (f"Arm {1e3 * shape.arm_length:.3f} mm x {1e3 * shape.arm_height:.3f} mm, bob "
            f"{1e3 * shape.bob_width:.3f} mm square, 19.6 mm thick:\n\n" + table(
                ("elements [mm]", "reduced mass [kg]", "bending [Hz]", "amplitude ratio"), rows))


def regimes_table(rows: list[Row]) -> str:
    """Regimes of all models at all frequencies."""
    lines = []
    for number, row in enumerate(rows):
        found = row.found
        lines.append((f"{hertz(row.frequency):.3f}", model(number, row), found.name,
                      f"{found.periodicity.misfit:.0e}", span(found.per_period),
                      f"{len(found.rests) / len(found.per_period):g}", row.growth))
    return table(
        ("drive [Hz]", "model", "found", "misfit of the repetition", "impacts a period",
         "rests a period", "largest Lyapunov exponent [1/s]"), lines)


def model(number: int, row: Row) -> str:
    """Name of a row's model; the two-mode model comes first at each frequency."""
    return "two modes from numbers" if number % 4 == 0 else f"mesh, {row.modes} modes"


def span(counts: np.ndarray) -> str:
    """One number, or the smallest and the largest."""
    low, high = counts.min(), counts.max()
    return f"{low}" if low == high else f"{low} to {high}"


def impacts_table(rows: list[Row]) -> str:
    """Impact velocities and restitution of the impacts until the motion repeats."""
    lines = []
    for row in rows:
        count = int(row.found.per_period[: row.found.periodicity.periods or 6].sum())
        impacts = row.found.impacts[np.isfinite(row.found.impacts.restitution)][:count]
        lines.append((f"{hertz(row.frequency):.3f}", " ".join(f"{v:.2f}" for v in
                                                    1e3 * impacts.impact_velocity),
                      " ".join(f"{e:.2f}" for e in impacts.restitution)))
    return table(("drive [Hz]", "impact velocities [mm/s]", "restitution of each"), lines)


def window(periods: dict[float, np.ndarray]) -> str:
    """In words, where in the map all five motions appear."""
    agree = np.all([found == (impact_map.EXPECTED[w] or 0) for w, found in periods.items()], axis=0)
    where = [f"{impact_map.BENDINGS_HZ[j]:g} Hz with D = {impact_map.DAMPINGS[i]:g}"
             for i, j in zip(*np.nonzero(agree), strict=True)]
    return (f"{agree.sum()} of {agree.size} combinations of the map give all five: "
            f"{', '.join(where)}.")


def hysteresis(diagram: impact_map.Diagram) -> str:
    """In words, where the ways up and down differ, above the chaos at low frequencies."""
    low, high = (np.stack([reduce(points[:, :, 0], axis=1) for points in
                           (diagram.up, diagram.down)]) for reduce in (np.min, np.max))
    apart = (np.abs(np.diff(low, axis=0)[0]) + np.abs(np.diff(high, axis=0)[0]) > 20e-6) & (
        diagram.frequencies > 4.3)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], apart.astype(int), [0]])))
    spans = [(diagram.frequencies[first], diagram.frequencies[last - 1])
             for first, last in zip(edges[::2], edges[1::2], strict=True) if last - first > 3]
    return ", ".join(f"{first:.2f} to {last:.2f} Hz" for first, last in spans)


TEXT = """## Section 4.2: impact oscillator

A pendulum hinged at one end strikes a stop, moved through a spring: `impact_oscillator.py`
and its study file, pictures by `impact_figures.py` and `impact_map.py`.

Data that the source does not give, and the values taken here:

- The bending mode. The source estimates it by beam theory and prints no value. Taken: 230.0 Hz, at
  the contact 0.600 times the amplitude of the rotation (both mass-normalised), D = 0.03. This is a
  fit to the reported motions, not an identification.
- The functions f* and h* of the rough surface. Taken: uniform asperity heights,
  f* = s^2 / 2 and h* = s up to s = 1.
- The pendulum's dimensions. An aluminium arm with a square bob is calibrated in finite elements
  (`impact_calibration.py`) to the reduced mass 0.092 kg and to the bending mode above. A
  strip of 6 mm touches the stop; if the whole bottom of the bob did, 5.954 Hz would give
  period two.

{calibration}

### Regimes

The regime follows from the states once per drive period. A motion is periodic if it repeats to
0.2 % of its size, or to 3 % if it comes to rest on the stop. The exponent of a periodic orbit is
that of its largest multiplier. An exponent with a standard error is the mean growth over 400
periods of a motion that does not repeat to 0.1 %.

{regimes}

At 1.567 Hz the rough contact has little damping at small penetrations. With the rotation and
one bending mode, some vibration is left when the spring lifts the pendulum off. This vibration
differs from period to period: periods agree to 1 or 2 % only. The exponent is uncertain: runs of
different lengths and tolerances give -0.3 to +1.4 1/s, the longest runs the smallest values.
The irregular transient lasts for tens of seconds, depending on round-off. After 80 s,
all of twelve starts at a tolerance of 1e-7, and eleven at 1e-9, were near a motion of six periods
(10, 11, 9, 14, 8, 13 impacts) that repeats to 0.3 %. With a third mode the periods repeat exactly.
"Rests" are contacts that last a tenth of a period or more, with velocities below a tenth of the
largest impact velocity.

### Figures

{figures}

![Phase diagrams](images/validation/impact-phase.png)

![Chatter](images/validation/impact-chatter.png)

Once a period, when the spring's end passes zero on its way up: the strange attractor, and the
points of the periodic motions.

![Poincaré sections](images/validation/impact-sections.png)

### Impacts

The impacts of the finite element model with four modes, over one period of the motion (six periods
of the chaotic one). Velocities are means over the contact. Restitution may exceed one, because
vibration can return energy of earlier impacts.

{impacts}

### How narrow it is

Runs of the two-mode model follow 601 frequencies upwards and downwards, with 80 periods at each.
Most of the range from 1.75 to 4.3 Hz is chaotic; below lies chatter. Different motions coexist
at {hysteresis}.

![Bifurcation diagram](images/validation/impact-bifurcation.png)

Frequency and damping of the bending mode around the fit (cross): periods found at the five
frequencies ("none" up to 8), and how many agree.
{window}
At 5.954 Hz the source says "higher periodic", which period four is taken for.

![Map of regimes](images/validation/impact-map.png)

`fecontact render examples/impact_oscillator.toml`, after `fecontact run`, shows an impact 250
times slower and the bending vibration that follows it.
"""
