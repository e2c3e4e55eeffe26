"""Section 4.3 of the source: the friction oscillator."""

from pathlib import Path
from textwrap import fill

import friction_oscillator as friction
import numpy as np
from comparison import Comparison, comparisons, table
from pictures import save

from fecontact import Trajectory, simulate
from fecontact.analysis import periodicity
from fecontact.integrate import Scipy

INCLINED = "three modes, inclined force"
FIGURES = {
    "b: two modes": ("4.3-2 b", "one loop of stick and slip", "one loop with one slip, which "
                     "closes after four periods of the drive"),
    "c: three modes": ("4.3-2 c", "vibration of higher frequency after each transition from slip "
                       "to stick", "the same at B, where the elastic mode moves; the contact is "
                       "stuck and shows nothing"),
    "d: three modes, waves": ("4.3-2 d", "higher periodic, several different loops, close to the "
                              "measurement", "slips of several lengths; the passing of a wave "
                              "(2.5 s) and the drive (0.4553 s) have no common period"),
}


def section(images: Path) -> str:
    """Text with tables; a picture into a folder."""
    runs = {name: friction.settled(friction.CASES[name](), rtol=1e-7) for name in FIGURES}
    shown = {name: run.between(run.time[-1] - 16 * friction.PERIOD) for name, run in runs.items()}
    save(friction.figure(shown), images / "friction-phase.png")
    vertical, inclined = runs["d: three modes, waves"], friction.settled(
        friction.CASES[INCLINED](), rtol=1e-7)
    pair = {"vertical": vertical, "inclined": inclined}
    save(friction.side_by_side({name: run.between(run.time[-1] - 16 * friction.PERIOD)
                                for name, run in pair.items()}), images / "friction-inclined.png")
    return TEXT.format(
        verdict=verdict(vertical, inclined),
        inclined=table(("contact force", "slips in 100 periods", "lengths [mm]", "x of B [mm]",
                       "normal force [N]", "belt: friction [J]", "belt: normal force [J]",
                       "lost by friction [J]"),
                      [compared(name, run) for name, run in pair.items()]),
        figures=table(("figure", "the source shows", "shown here"), list(FIGURES.values())),
        slips=slips_table(runs), numbers=comparisons(vibration(runs) + solvers()))


def slips_table(runs: dict[str, Trajectory]) -> str:
    """Periods and slips of the runs."""
    rows = []
    for name, run in runs.items():
        lengths = 1e3 * np.array([slip.distance for slip in friction.slips(run)])
        found = periodicity(run, t_start=float(run.time[0]), largest=8)
        rows.append((name, found.periods or "none up to 8", f"{found.misfit:.0e}", len(lengths),
                     friction.different(lengths), f"{lengths.min():.3f} to {lengths.max():.3f}"))
    return table(("case", "repeats after periods", "misfit", "slips in 100 periods",
                  "different lengths", "lengths [mm]"), rows)


def compared(name: str, run: Trajectory) -> tuple[str, ...]:
    """Row of numbers of a run on waves."""
    lengths = 1e3 * np.array([slip.distance for slip in friction.slips(run)])
    x, force, energies = 1e3 * run.displacement("B")[:, 0], run.normal_force[:, 0], run.energies
    return (name, f"{len(lengths)}", f"{lengths.min():.3f} to {lengths.max():.3f}",
            f"{x.min():.2f} to {x.max():.2f}", f"{force.min():.1f} to {force.max():.1f}",
            f"{energies.belt_friction_work[-1]:.4f}", f"{energies.belt_normal_work[-1]:.4f}",
            f"{energies.friction[-1]:.4f}")


def verdict(vertical: Trajectory, inclined: Trajectory) -> str:
    """The differences in a sentence."""
    swings = [float(np.ptp(run.displacement("B")[:, 0])) for run in (inclined, vertical)]
    carried = inclined.energies.belt_normal_work[-1] / (
        inclined.energies.belt_normal_work[-1] + inclined.energies.belt_friction_work[-1])
    open_part = float((inclined.normal_force == 0.0).mean())
    return fill(
        f"With the inclined force the slopes carry the mass up to {swings[0] / swings[1]:.1f} "
        f"times as far, {carried:.0%} of the belt's work are its normal force's, and after long "
        f"slips across a wave the mass is thrown off ({open_part:.0%} of the time) and lands with "
        f"{inclined.normal_force.max() / friction.NORMAL_FORCE:.0f} times its load. The several "
        f"loops of the source are those of the vertical force.", 100)


def vibration(runs: dict[str, Trajectory]) -> list[Comparison]:
    """The vibration of B in stick, and the normal force of both kinds of model."""
    peak = friction.ringing(runs["c: three modes"])
    force = friction.prescribed().normal.force
    return [Comparison("three modes: vibration of B in stick [Hz], and that of the modes with the "
                       "contact held", friction.held_frequency(), peak.frequency_hz),
            Comparison("normal force without a rigid y mode, by the static equilibrium [N]",
                       friction.NORMAL_FORCE, float(force))]


def solvers() -> list[Comparison]:
    """Two modes by another integrator: the motion over four periods of its orbit."""
    run = friction.settled(friction.oscillator(2), skip=80, periods=8, rtol=1e-8)
    end = float(run.time[-1])
    rows = []
    for method in ("LSODA", "Radau"):
        again = simulate(run.system, end + 4.0 * friction.PERIOD, initial=run, outputs=1601,
                         solver=Scipy(method), rtol=1e-8)
        orbit = run.between(end - 4.0 * friction.PERIOD)
        rows.append(Comparison(f"two modes: largest x of the orbit by {method} [mm]",
                               1e3 * orbit.displacement("B")[:, 0].max(),
                               1e3 * again.displacement("B")[:, 0].max()))
        rows.append(Comparison(f"two modes: smallest x of the orbit by {method} [mm]",
                               1e3 * orbit.displacement("B")[:, 0].min(),
                               1e3 * again.displacement("B")[:, 0].min()))
    return rows


TEXT = """## Section 4.3: friction oscillator

A mass on a moving belt, pulled to and fro through a spring: `friction_oscillator.py`. The
source gives no third mode. The values taken are 30 Hz and D = 0.01, with amplitudes of 0.5 at B and
-0.5 at the contact relative to the rigid mode. With equal signs there is no visible vibration. In
stick only B vibrates, because the contact does not move.

{figures}

![Phase diagrams of the friction oscillator](images/validation/friction-phase.png)

{slips}

The waves have slopes of up to 0.50. In the source the contact force is vertical on them
(`ground.normal = "vertical"`). By default the contact force is normal to the sloping surface, as an
elastic contact needs to conserve energy; the table and the picture name this case "inclined". The
contact force then pushes the mass along the belt with up to half of the normal force, in addition
to a friction of at most 0.8 of it:

{inclined}

![Vertical and inclined contact force on the same waves](images/validation/friction-inclined.png)

{verdict}

{numbers}
"""
