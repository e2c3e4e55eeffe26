"""A bolted lap joint: microslip, its loop of force and displacement, and softening with amplitude.

Two beams overlap; two bolts, springs with a prescribed shortening, press them on each other. One
beam is clamped, the other is pulled at its end. Pulled slowly to and fro the ends of the overlap
slip first: the loop of force and displacement follows Masing's rules as long as the pressure stays.
Small vibrations are those with stuck contacts; large ones slip, are softer and die out faster.

Usage: python lap_joint.py [--quick]
"""

import sys
from typing import Any, Literal

import numpy as np

import fecontact as fc
from fecontact.fem import pair_faces
from fecontact.integrate import initial_state
from fecontact.laws import JenkinsFriction, LinearContact
from fecontact.reduction import Spring, reduce_bodies

LENGTH, HEIGHT, OVERLAP = 0.2, 0.01, 0.08  # of each beam [m]
STIFFNESS, RATIO = 2e9, 0.8  # of the interface [N/m], and that along it over that across
COEFFICIENT, BOLT = 0.3, 2e8  # of friction; stiffness of each bolt [N/m]


def joint(shortening: float = 1e-5, component: Literal["x", "y"] = "x",
          nodes: int = 8) -> fc.ContactSystem:
    """Two lapped beams and bolts that are tightened by a shortening [m]; loaded at the end."""
    beam = fc.generate(fc.Beam(LENGTH, HEIGHT, 0.5 * HEIGHT))
    start = LENGTH - OVERLAP
    bodies = {"lower": fc.ElasticBody(beam.placed((0.0, -HEIGHT)), thickness=0.02,
                                      fixed={"left": "xy"}),
              "upper": fc.ElasticBody(beam.placed((start, 0.0)), thickness=0.02)}
    face = pair_faces(bodies, "upper.contact", "lower.top", nodes=nodes)
    points = {"upper": {"end": (start + LENGTH, 0.5 * HEIGHT)}, "lower": {}}
    bolts = []
    for k, part in enumerate((0.25, 0.75), start=1):
        points["upper"][f"head{k}"] = (start + part * OVERLAP, HEIGHT)
        points["lower"][f"nut{k}"] = (start + part * OVERLAP, -HEIGHT)
        bolts.append(Spring(f"upper.head{k}", f"lower.nut{k}", stiffness=BOLT, damping=50.0,
                            shortening=shortening))
    bases = reduce_bodies(bodies, [face], bolts, modes=6, damping=0.001, each={
        name: {"points": given} for name, given in points.items()})
    return fc.ContactSystem(
        bodies=bases, links=bolts, interfaces=[fc.Interface(
            "lap", face, LinearContact(STIFFNESS, damping=100.0),
            JenkinsFriction(RATIO * STIFFNESS, COEFFICIENT))],
        load=fc.Load(forces=(fc.PointLoad("upper.end", component, signal=0.0),)))


def bolted(system: fc.ContactSystem) -> Any:
    """Equilibrium under the bolts alone."""
    return fc.load_history(system, fc.LoadPath(forces=((0.0, 0.0),), steps=1))


def pulled(system: fc.ContactSystem, force: float, steps: int = 40) -> Any:
    """Loading of the end by a force [N], there, to the other side, and back."""
    return fc.load_history(system, fc.LoadPath(forces=((0.0, force, -force, force),), steps=steps))


def struck(system: fc.ContactSystem, amplitude: float) -> tuple[float, float]:
    """Frequency [Hz] of the first bending vibration in one period, and its amplitude [m].

    The bolted joint starts with the velocity of its stuck mode; ``amplitude`` is that of the linear
    vibration.
    """
    rest = bolted(system)
    modes = fc.analysis.prestressed_modes(system, rest)
    m, basis = system.basis.modes, system.basis
    row = basis.point_row("upper.end", "y")
    shape = modes.right[m : 2 * m, 0].real
    state = initial_state(system, rest, 0.0)
    state[m : 2 * m] = shape * 2.0 * np.pi * modes.frequencies_hz[0] * amplitude / (row @ shape)
    run = fc.simulate(system, 1.3 / modes.frequencies_hz[0], initial=state, outputs=521)
    y = (run.modal_coordinates - rest.modal_coordinates[-1]) @ row
    k = np.flatnonzero(np.sign(y[2:]) != np.sign(y[1:-1])) + 1
    crossings = run.time[k] - y[k] * (run.time[k + 1] - run.time[k]) / (y[k + 1] - y[k])
    return float(1.0 / crossings[1]), float(0.5 * np.ptp(y))


def main(quick: bool = False) -> None:
    """Prints loops and frequencies."""
    along = joint()
    rest = bolted(along)
    limit = COEFFICIENT * rest.normal_force[-1].sum()
    print(f"the bolts press with {rest.normal_force[-1].sum():.0f} N; friction holds {limit:.0f} N")
    for force in (100.0, 200.0, 300.0, 500.0):
        history = pulled(along, force)
        loop = history.loop(1, 3)
        slipping = (history.contact_state[history.row(1)] == fc.ContactState.SLIP).sum()
        print(f"{force:.0f} N: {slipping} of {along.basis.contact_nodes} nodes slip, "
              f"{1e6 * loop.loss:.3f} uJ in a cycle")

    across = joint(component="y")
    stuck = fc.analysis.prestressed_modes(across, bolted(across)).frequencies_hz[0]
    amplitudes = np.array([0.1e-3, 2e-3] if quick else [0.1e-3, 0.3e-3, 0.5e-3, 0.7e-3, 1e-3,
                                                        1.5e-3, 2e-3, 3e-3])
    found = np.array([struck(across, amplitude) for amplitude in amplitudes])
    print(f"stuck: {stuck:.4f} Hz")
    for frequency, amplitude in found:
        print(f"struck, {1e3 * amplitude:.2f} mm: {frequency:.4f} Hz")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
