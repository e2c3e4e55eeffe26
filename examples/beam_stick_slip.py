"""A steel beam on a belt, 40 contact nodes and 20 modes: from steady sliding to stick-slip.

Friction that falls with slip velocity makes steady sliding unstable below some belt speed. There a
stick-slip orbit is born unstable (the bifurcation is subcritical), so that stable stick-slip is
found by a run that begins stuck to the belt, also far above that speed. The orbit is then taken to
shooting with the compiled integrator, which has its multipliers.

A point of that branch takes some ten seconds: 40 states whose derivatives are carried along, over
thousands of steps. Below some 0.02 m/s more of them are needed than are worth it: elastic vibration
that is left from the slip before decides when the beam lets go, and the period wavers with the
speed. Runs do there: their periods are printed too.

Usage: python examples/beam_stick_slip.py      (prints; about a minute)
"""

import numpy as np
from numpy.typing import NDArray

import fecontact as fc
from fecontact.bifurcation.problem import Settings
from fecontact.integrate.initial import initial_state

SPEED = "ground.speed"
PULL = 9.5  # N, of the spring on the beam where it is not displaced


def beam(speed: float = 0.05, nodes: int = 40, modes: int = 20) -> fc.ContactSystem:
    """A free steel beam, pulled by a spring at its left end."""
    x, y = np.meshgrid(np.linspace(0.0, 0.2, nodes), np.linspace(0.0, 0.02, 5))
    number = np.arange(x.size).reshape(x.shape)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]],
                     axis=-1).reshape(-1, 4)
    mesh = fc.Mesh(np.column_stack([x.ravel(), y.ravel()]), cells,
                   {"contact": np.column_stack([number[0, :-1], number[0, 1:]])})
    body = fc.ElasticBody(mesh, fc.Material.named("steel"), 0.01)
    basis = body.modal_basis(modes, contact_nodes=nodes, B=(0.0, 0.01), C=(0.1, 0.02),
                             damping=0.01)
    return fc.ContactSystem(
        basis, normal=fc.RoughSurface(0.3e6, 5.2e-6, 6.0),
        friction=fc.ExponentialFriction(0.8, 0.55, 1000.0, 1e6),
        ground=fc.Ground(speed=speed), load=fc.Load(normal=14.0),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768,
                       motion_x=fc.Constant(-PULL / 5610.0)))


def sliding(lowest: float = 2e-3, highest: float = 0.5) -> fc.Branch:
    """Steady sliding over the speed of the belt, from fast to slow."""
    field = fc.contact_field(beam(highest), {SPEED: highest})
    return fc.equilibrium_branch(field, SPEED, bounds=(lowest, highest), direction=-1.0,
                                 settings=Settings(step=5e-3, points=300))


def stuck(system: fc.ContactSystem) -> NDArray[np.float64]:
    """State of the pressed body that moves with the belt."""
    modes = system.basis.modes
    state = np.zeros(system.size)
    state[:modes] = fc.static_equilibrium(system, friction=True)
    start = fc.RigidStart(velocity=(system.ground.speed, 0.0, 0.0))
    state[modes : 2 * modes] = initial_state(system, start, 0.0)[modes : 2 * modes]
    return state


def stick_slip(speed: float, transient: float = 2.0) -> fc.SettledMotion:
    """The motion on which a run that begins stuck settles."""
    system = beam(speed)
    return fc.settled_motion(system, initial=stuck(system), transient=transient,
                             longest_period=0.3, rtol=1e-7)


def orbits(motion: fc.SettledMotion, speed: float, points: int = 2) -> fc.Branch:
    """Stick-slip orbits by shooting, from that of a run towards faster belts."""
    field = fc.contact_field(beam(speed), {SPEED: speed})
    modes = field.system().basis.modes
    size = np.ptp(motion.states, axis=0) / 2.0
    scales = 10.0 * np.repeat([size[:modes].max(), size[modes:].max()], modes)
    return fc.orbits_by_shooting(
        field, SPEED, motion.times, motion.states, period=motion.period, segments=2, rtol=1e-7,
        bounds=(0.02, 0.4), scales=scales,
        settings=Settings(step=0.01, largest_step=0.1, points=points, locate=False))


def main() -> None:
    """Print where steady sliding ends, periods of stick-slip, and multipliers of its orbits."""
    hopf, = sliding().of_kind("Hopf")
    print(f"Steady sliding is stable above {1e3 * hopf.parameter:.4f} mm/s; there a vibration of "
          f"{hopf.details['frequency_hz']:.2f} Hz begins, {hopf.details['criticality']}.")
    for speed in (0.01, 0.02, 0.05, 0.1, 0.2):
        motion = stick_slip(speed)
        size = float(np.ptp(motion.states @ fc.contact_field(beam(speed), {}).displacement_row(
            "B"))) / 2.0
        print(f"Stick-slip at {speed:g} m/s: period {1e3 * motion.period:.4f} ms, "
              f"amplitude of B {1e3 * size:.4f} mm")
    for point in orbits(stick_slip(0.05), 0.05).points:
        largest = np.sort(np.abs(point.values["multipliers"]))[::-1][:3]
        print(f"Orbit at {point.parameter:.5f} m/s: period {1e3 * point.values['period']:.5f} ms, "
              f"largest multipliers {largest.round(4)}, "
              f"{'stable' if point.values['stable'] else 'unstable'}")


if __name__ == "__main__":
    main()
