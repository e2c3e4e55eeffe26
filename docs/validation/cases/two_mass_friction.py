"""Bifurcations of two masses on a moving belt, section 4.4 of Sextro's book, with one command.

A chain of two masses, each pressed on the belt; friction falls with the slip velocity. Steady
sliding loses its stability at Hopf points, the vibrations that begin there turn at folds and
double their period again and again. Unstable orbits are part of the picture: the one between the
fold T1 and the Hopf point H1 parts the starts that come to rest from those that go on vibrating.

Usage: python two_mass_friction.py [--quick]   (a table; two minutes)

Time is scaled by sqrt(m2 / c2), B = F_N / c2 and D = d2 / (2 sqrt(c2 m2)). The equations are those
of the book with the constants that reproduce its figures: masses 2.5 and 1, stiffnesses 2 and 1,
equal dashpots and normal forces, mu = 0.14 (1 + 1.14 exp(-2 |v|)) arctan(100 v).
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact import ContactSystem, Ground, ModalBasis, simulate
from fecontact.bifurcation import (
    Axis,
    Basins,
    Branch,
    Collocation,
    ContactField,
    ContinuationOptions,
    amplitude,
    basins,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
)
from fecontact.integrate import Crossing
from fecontact.laws import PrescribedForce, ProductFriction
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import point_masses

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Amplitudes that count as one in the length of a step, for B below 10 and for B = 20.
SMALL, LARGE = np.full(4, 2.0), np.full(4, 8.0)


def basis(D: float = 0.1) -> ModalBasis:
    """The masses, moving along the belt only."""
    return point_masses({"1": 2.5, "2": 1.0}, {("1", None): 2.0, ("1", "2"): 1.0},
                        dashpots={("1", None): 2.0 * D, ("1", "2"): 2.0 * D},
                        components="x", contact=["1", "2"])


def oscillator(B: float = 1.0, v0: float = 1.0, D: float = 0.1) -> ContactField:
    """The oscillator as a function of B, v_0 and D."""
    system = ContactSystem(basis(D), normal=PrescribedForce((B, B)),
                           friction=ProductFriction(0.14, 1.14, 2.0, 100.0),
                           ground=Ground(speed=v0))
    return contact_field(system, {
        "B": (B, lambda given, value: given.with_({"normal.force": (value, value)})),
        "ground.speed": None,
        "D": (D, lambda given, value: given.with_(basis=basis(value))),
    })


def diagram_over_B() -> dict[str, Branch]:
    """Both branches of orbits, three doublings of the first, the coexisting orbits of the second.

    v_0 = 1, D = 0.1.
    """
    field, bounds = oscillator(B=0.3), (0.3, 10.0)
    sliding = equilibrium_branch(field, parameter="B", bounds=bounds)
    first_hopf, second_hopf = sliding.of_kind("Hopf")
    options = ContinuationOptions(step=0.005, largest_step=0.04)
    orbits = orbit_branch(field, first_hopf, method=Collocation(intervals=100), options=options,
                          bounds=bounds, scales=SMALL)
    branches = {"steady sliding": sliding, "orbits": orbits}
    near = ContinuationOptions(step=0.005, largest_step=0.03)
    for period in (2, 4, 8):
        orbits = orbit_branch(field, orbits.of_kind("period doubling")[0],
                              method=Collocation(intervals=100 * min(period, 6)), options=near,
                              bounds=bounds if period == 2 else (8.0, 9.6))
        branches[f"period {period}"] = orbits
    branches["second branch"] = orbit_branch(field, second_hopf, method=Collocation(intervals=100),
                                             options=options, bounds=bounds, scales=SMALL)
    return branches | doubled(field, branches["second branch"], bounds, "second branch, period 2")


def doubled(
    field: ContactField, orbits: Branch, bounds: tuple[float, float], name: str,
) -> dict[str, Branch]:
    """Orbits of twice the period from each doubling of a branch, those once that lie on several."""
    options = ContinuationOptions(step=0.005, largest_step=0.04, points=300)
    found: dict[str, Branch] = {}
    for point in orbits.of_kind("period doubling"):
        if not any(abs(place.parameter - point.parameter) < 1e-5
                   for other in found.values() for place in other.special):
            label = name + "'" * len(found)
            found[label] = orbit_branch(field, point, options=options, bounds=bounds)
    return found


def diagram_over_speed() -> dict[str, Branch]:
    """Orbits over v_0 from both Hopf points, B = 20, D = 0.1."""
    field, bounds = oscillator(B=20.0, v0=8.0), (1.2, 8.0)
    sliding = equilibrium_branch(field, parameter="ground.speed", bounds=bounds, direction=-1.0)
    options = ContinuationOptions(step=0.005, largest_step=0.04, points=600)
    branches = {"steady sliding": sliding}
    for name, point in zip(("orbits", "second branch"), sliding.of_kind("Hopf"), strict=True):
        branches[name] = orbit_branch(field, point, method=Collocation(intervals=100),
                                      options=options, bounds=bounds, scales=LARGE)
    return branches | doubled(field, branches["orbits"], bounds, "period 2")


def diagram_over_damping(B: float) -> dict[str, Branch]:
    """Orbits over D from both Hopf points, v_0 = 1."""
    field, bounds = oscillator(B=B, D=2.2), (0.06, 2.2)
    sliding = equilibrium_branch(field, parameter="D", bounds=bounds, direction=-1.0)
    names = ("orbits", "second branch")
    found = {"steady sliding": sliding}
    for name, point in zip(names, sliding.of_kind("Hopf"), strict=True):
        found[name] = orbit_branch(field, point, method=Collocation(intervals=100), bounds=bounds,
                                   options=ContinuationOptions(step=0.005, points=600),
                                   scales=LARGE)
    return found


def attractors(v0: float, diagram: dict[str, Branch]) -> list[tuple[str, np.ndarray]]:
    """Motions x_3, x_3' to which starts near the stable solutions at v_0 settle, B = 20.

    The starts are the orbits of the diagram nearest to v_0, a little disturbed, and steady
    sliding; the runs are long, and decide by themselves where they go.
    """
    field = oscillator(B=20.0, v0=v0)
    system, row = field.system(), field.displacement_row(1)
    modes = system.basis.modes
    rate = np.concatenate([np.zeros(modes), row[:modes]])
    stable = [point for point in diagram["orbits"].points if point.values["stable"]]
    starts: list[np.ndarray] = []
    for low, high in ((2.5, 7.6), (7.8, 20.0)):
        fits = [point for point in stable
                if low < amplitude(row)(point) < high and point.parameter < 4.2]
        nearest = min(fits, key=lambda point: abs(point.parameter - v0))
        starts.append(nearest.orbit().states[0])
    starts.append(find_equilibrium(field).state)
    found = []
    for start in starts:
        period = 9.7
        run = simulate(system, 400.0, initial=1.01 * start, rtol=1e-8,
                       outputs=np.concatenate([[0.0], np.linspace(400.0 - period, 400.0, 800)]))
        motion = np.stack([run.states[1:] @ row, run.states[1:] @ rate], axis=1)
        size = np.ptp(motion[:, 0]) / 2.0
        name = f"orbit, amplitude {size:.2f}" if size > 0.01 else "steady sliding"
        found.append((name, motion - [float(row @ starts[-1]), 0.0]))
    return found


def basins_of_attraction(v0: float, count: int = 60) -> tuple[Basins, list[np.ndarray]]:
    """Basins of starts of the second mass at v_0, B = 20; and the rows that give x_3 and x_3'.

    The first mass begins at its place in steady sliding, and at rest.
    """
    field = oscillator(B=20.0, v0=v0)
    system, sliding = field.system(), find_equilibrium(field).state
    place, speed = Axis(1, "x"), Axis(1, "x", "velocity")
    around = float(place.row(system) @ sliding) + np.linspace(-18.0, 18.0, count)
    found = basins(system, (place, around), (speed, np.linspace(-12.0, 8.0, count)), base=sliding,
                   transient=300.0, keep=16,
                   section=Crossing(1, "x", value=0.05, of="velocity", sense="falling"))
    return found, [axis.row(system) for axis in (place, speed)]


def phase_figure(
    motions: Sequence[tuple[str, np.ndarray]], v0: float, path: Path | None = None
) -> "Figure":
    """The attractors in the plane of x_3 and x_3'."""
    with new_figure(8.0, 4.8, path) as figure:
        axis = figure.subplots()
        for colour, (name, motion) in zip(COLOURS, motions, strict=False):
            if np.ptp(motion[:, 0]) > 0.01:
                axis.plot(motion[:, 0], motion[:, 1], color=colour, label=name)
            else:
                axis.plot(motion[-1, 0], motion[-1, 1], "o", color=colour, label=name)
        axis.axhline(v0, color="#8a8a8a", linewidth=0.8, linestyle=":")
        axis.annotate("belt", (axis.get_xlim()[0], v0), xytext=(4, 3), textcoords="offset points",
                      color="#6a6a6a", fontsize=9.0)
        axis.set_xlabel("x3 [m]")
        axis.set_ylabel("x3' [m/s]")
        figure.legend(loc="outside right upper")
    return figure


def table(over_B: dict[str, Branch], over_speed: dict[str, Branch]) -> list[tuple[str, str, float]]:
    """Rows (what, printed in the book, computed here)."""
    sliding, orbits = over_B["steady sliding"], over_B["orbits"]
    first, second = sliding.of_kind("Hopf")
    rows = [("H1, Hopf", "1.12", first.parameter),
            ("T1, fold of the orbits", "0.88", orbits.of_kind("fold")[0].parameter),
            ("H2, Hopf", "7.09", second.parameter)]
    doublings = [orbits.of_kind("period doubling")[0]]
    doublings += [over_B[f"period {k}"].of_kind("period doubling")[0] for k in (2, 4, 8)]
    rows += [(f"period doubling {k + 1}, {point.criticality}", printed, point.parameter)
             for k, (point, printed) in enumerate(zip(doublings, ("8.09", "9.26", "9.36", "chaos"),
                                                      strict=True))]
    coexisting = over_B["second branch"].of_kind("period doubling")[-1]
    rows.append((f"coexisting orbits from, {coexisting.criticality} doubling", "7.25",
                 coexisting.parameter))
    folds = sorted(point.parameter for point in over_speed["orbits"].of_kind("fold"))
    rows += [("three attractors over v_0, from", "3.57", folds[0]),
             ("three attractors over v_0, to", "4.09", folds[1])]
    return rows


def shares(found: Basins) -> str:
    """Part of the starts that lead to each attractor."""
    return ", ".join(f"{'steady sliding' if one.kind == 'equilibrium' else 'orbit'} {one.share:.1%}"
                     for one in found.attractors)


def quick_diagram() -> None:
    """The first branch over B, and its special points."""
    field, bounds = oscillator(B=0.3), (0.3, 10.0)
    sliding = equilibrium_branch(field, parameter="B", bounds=bounds)
    orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], bounds=bounds,
                          options=ContinuationOptions(step=0.01, largest_step=0.1), scales=SMALL)
    for point in (*sliding.special, *orbits.special):
        print(f"{point.kind} at B = {point.parameter:.4f}")


def main() -> None:
    """Compute and print everything."""
    over_B, over_speed = diagram_over_B(), diagram_over_speed()
    motions = attractors(3.8, over_speed)
    found, _ = basins_of_attraction(3.8)
    print(f"{'':48} printed  computed")
    for what, printed, value in table(over_B, over_speed):
        print(f"{what:48} {printed:>7}  {value:.4f}")
    print(f"attractors at v_0 = 3.8: {', '.join(name for name, _ in motions)}; share of the starts "
          f"that lead to each: {shares(found)}")


if __name__ == "__main__":
    (quick_diagram if "--quick" in sys.argv else main)()
