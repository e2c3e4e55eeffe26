"""A steel beam on a belt, 40 contact nodes, 20 modes: steady sliding, stick-slip, what parts them.

Friction that falls with slip velocity makes steady sliding unstable below some belt speed. There
orbits without stick are born, unstable (the bifurcation is subcritical): a push that is larger
than theirs makes the beam stick. Stable stick-slip is found by a run that begins stuck to the belt,
and followed over the belt's speed by shooting with the compiled integrator. Its end on the fast
side is where the beam only just sticks: there the unstable orbits meet it. On the slow side elastic
vibration that is left from the slip before decides when the beam lets go; the branch folds twice,
and between the folds two stick-slip motions exist side by side.

Usage: python beam_stick_slip.py [FILE.png] [--quick]   (prints and draws; two minutes)
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fecontact as fc
from fecontact.bifurcation import (
    Branch,
    BranchPoint,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    Shooting,
    contact_field,
    equilibrium_branch,
    observe,
    orbit_branch,
    periodic_motion,
)
from fecontact.integrate import initial_state
from fecontact.laws import Constant, ExponentialFriction, RoughSurface
from fecontact.plot import COLOURS, new_figure

SPEED = "ground.speed"
PULL = 9.5  # N, of the spring on the beam where it is not displaced


def beam(speed: float = 0.05, nodes: int = 40, modes: int = 20) -> fc.ContactSystem:
    """A free steel beam, pulled by a spring at its left end."""
    mesh = fc.Mesh.grid(np.linspace(0.0, 0.2, nodes), np.linspace(0.0, 0.02, 5))
    body = fc.ElasticBody(mesh, fc.Material.named("steel"), 0.01)
    basis = fc.modal_basis(body, modes, contact="bottom", contact_nodes=nodes, B=(0.0, 0.01),
                           C=(0.1, 0.02), damping=0.01)
    return fc.ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e6),
        ground=fc.Ground(speed=speed), load=fc.Load(normal=14.0),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768,
                       motion_x=Constant(-PULL / 5610.0)))


def sliding(lowest: float = 2e-3, highest: float = 0.5) -> Branch:
    """Steady sliding over the speed of the belt, from fast to slow."""
    field = contact_field(beam(highest), {SPEED: highest})
    return equilibrium_branch(field, bounds=(lowest, highest), direction=-1.0,
                                 options=ContinuationOptions(step=5e-3, points=300))


def stuck(system: fc.ContactSystem) -> NDArray[np.float64]:
    """State of the pressed body that moves with the belt."""
    modes = system.basis.modes
    state = np.zeros(system.size)
    state[:modes] = fc.equilibrium(system, "sliding").modal_coordinates
    start = fc.RigidStart(velocity=(system.ground.speed, 0.0, 0.0))
    state[modes : 2 * modes] = initial_state(system, start, 0.0)[modes : 2 * modes]
    return state


def stick_slip(speed: float, transient: float = 2.0) -> PeriodicMotion:
    """The motion on which a run that begins stuck settles."""
    system = beam(speed)
    return periodic_motion(system, initial=stuck(system), transient=transient,
                              longest_period=0.3, rtol=1e-7)


def orbits(motion: PeriodicMotion, speed: float, bounds: tuple[float, float],
           points: int = 100, both: bool = True) -> Branch:
    """Stick-slip orbits by shooting from that of a run on, to slow and to fast belts."""
    return orbit_branch(
        contact_field(beam(speed), {SPEED: speed}), motion,
        method=Shooting(segments=1, rtol=1e-8, derivative_rtol=1e-2), bounds=bounds,
        scales=scales(motion), width=0.4, both=both, options=settings(points))


def slipping(branch: Branch, fastest: float, points: int = 200) -> Branch:
    """Orbits without stick that are born where steady sliding ends, by collocation.

    They are smooth, and by far too unstable to be run once round.
    """
    field = contact_field(beam(fastest), {SPEED: fastest})
    hopf, = branch.of_kind("Hopf")
    return orbit_branch(field, hopf, method=Collocation(intervals=60), bounds=(2e-3, fastest),
                           options=ContinuationOptions(step=0.01, largest_step=0.03, points=points))


def scales(motion: PeriodicMotion) -> NDArray[np.float64]:
    """Scales of the states: one for all displacements, one for all velocities."""
    size = np.ptp(motion.states, axis=0) / 2.0
    modes = len(size) // 2
    return 10.0 * np.repeat([size[:modes].max(), size[modes:].max()], modes)


def settings(points: int) -> ContinuationOptions:
    """Steps of the branches: short ones find the folds; they end where only tiny ones go on."""
    return ContinuationOptions(step=0.01, smallest_step=5e-4, largest_step=0.03, points=points,
                               locate=False)


def seen(branch: Branch) -> Branch:
    """The branch with the extremes of point B."""
    return observe(contact_field(beam(), {SPEED: 0.05}), branch, "B")


def amplitude(point: BranchPoint) -> float:
    """Half the way of point B [mm]."""
    values = point.values
    return 500.0 * (float(values["observed_maximum"]) - float(values["observed_minimum"]))


def run_amplitude(motion: PeriodicMotion) -> float:
    """Half the way of point B in a run [mm]."""
    row = contact_field(beam(), {}).displacement_row("B")
    return 500.0 * float(np.ptp(motion.states @ row))


def side_by_side(branch: Branch, speed: float) -> list[PeriodicMotion]:
    """Runs at a speed, begun on orbits before and behind the unstable part of the branch."""
    unstable = np.flatnonzero(~branch.column("stable").astype(bool))
    if len(unstable) == 0:
        return []
    parts = branch.points[: unstable[0]], branch.points[unstable[-1] + 1 :]
    starts = (min(part, key=lambda point: abs(point.parameter - speed)).u[:-2] for part in parts)
    return [periodic_motion(beam(speed), initial=np.ascontiguousarray(start), transient=3.0,
                               longest_period=0.3, rtol=1e-7) for start in starts]


def draw(path: Path, stuck_slip: Branch, free: Branch, hopf: BranchPoint,
         runs: list[tuple[float, PeriodicMotion]]) -> None:
    """Amplitude and period over the speed of the belt: stable solid, unstable dashed, runs dots."""
    with new_figure(11.0, 4.0, path) as figure:
        axes = figure.subplots(1, 3)
        for axis in axes:
            for branch, colour in ((stuck_slip, COLOURS[0]), (free, COLOURS[1])):
                speed = 1e3 * branch.parameter
                stable = np.array([point.values["stable"] for point in branch.points])
                y = np.array([amplitude(point) if axis is axes[0] else 1e3 * point.values["period"]
                              for point in branch.points])
                unstable = ~stable
                unstable[1:] |= ~stable[:-1]
                unstable[:-1] |= ~stable[1:]
                axis.plot(speed, np.where(stable, y, np.nan), color=colour,
                          label="stick-slip" if branch is stuck_slip else None)
                axis.plot(speed, np.where(unstable, y, np.nan), "--", color=colour,
                          label="without stick" if branch is free else None)
            values = [run_amplitude(run) if axis is axes[0] else 1e3 * run.period
                      for _, run in runs]
            axis.plot([1e3 * speed for speed, _ in runs], values, "k.", label="runs")
            axis.set_xlabel("speed of the belt [mm/s]")
            axis.set_ylabel("amplitude of B [mm]" if axis is axes[0] else "period [ms]")
        steady = 1e3 * hopf.parameter
        axes[0].plot([steady, 320.0], [0.0, 0.0], color=COLOURS[2], label="steady sliding")
        axes[0].plot([2.0, steady], [0.0, 0.0], "--", color=COLOURS[2])
        axes[0].legend()
        axes[2].set(xlim=(39.2, 40.9), ylim=(57.8, 60.6))


def main(path: Path = Path("beam_stick_slip.png"), quick: bool = False) -> None:
    """Print where steady sliding ends, orbits with their multipliers and periods of runs; draw."""
    points, speeds = (2, ()) if quick else (100, (0.03, 0.08, 0.12, 0.16, 0.2, 0.24, 0.27))
    steady = sliding()
    hopf, = steady.of_kind("Hopf")
    print(f"Steady sliding is stable above {1e3 * hopf.parameter:.4f} mm/s; there a vibration of "
          f"{hopf.frequency_hz:.2f} Hz begins, {hopf.criticality}.")
    first = stick_slip(0.05)
    branch = seen(orbits(first, 0.05, bounds=(0.025, 0.3), points=points, both=not quick))
    free = seen(slipping(steady, fastest=0.3, points=2 * points))
    runs = [(speed, stick_slip(speed)) for speed in speeds]
    runs += [(0.05, first), *((0.04, run) for run in side_by_side(branch, 0.04))]
    for name, each in (("Stick-slip", branch), ("Without stick", free)):
        print(f"{name}: {len(each)} points. {each.status.value}")
        for point in each.points:
            largest = np.sort(np.abs(point.values["multipliers"]))[::-1][:3]
            print(f"  {1e3 * point.parameter:9.4f} mm/s: {1e3 * point.values['period']:.5f} ms, B "
                  f"{amplitude(point):.4f} mm, multipliers {largest.round(4)}, "
                  f"{'stable' if point.values['stable'] else 'unstable'}")
    for speed, run in runs:
        print(f"A run at {1e3 * speed:g} mm/s: {1e3 * run.period:.4f} ms, B "
              f"{run_amplitude(run):.4f} mm")
    draw(path, branch, free, hopf, runs)


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
