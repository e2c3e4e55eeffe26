"""A pad on the rim of a turning disc: friction couples two modes until one of them grows.

The rim of a steel disc, fixed at its hub, turns under a brake pad that springs of a calliper hold
and press. Friction has a constant coefficient, so nothing falls with slip velocity. Complex modes
about steady sliding tell from which coefficient on the disc squeals and at which frequency; a run
from a small disturbance grows as they say, until the pad lifts off, and keeps a limit cycle.

Usage: python disc_and_pads.py [--quick]
"""

import sys

import numpy as np

import fecontact as fc
from fecontact.analysis import ComplexModes, amplitude_spectrum, complex_modes
from fecontact.bifurcation import contact_field, equilibrium_branch
from fecontact.fem import pair_faces
from fecontact.integrate import initial_state
from fecontact.laws import ConstantFriction, RoughSurface, SlidingRotation
from fecontact.reduction import Spring, reduce_bodies

HUB, RIM, BACK = 0.05, 0.15, 0.18  # radii of hub, rim and back of the pad [m]
HALF = 12.0  # half the angle that a pad covers [degrees]
FRICTION = "interfaces.pad1.friction.friction_coefficient"


def sector(inner: float, outer: float, start: float, end: float, columns: int,
           rows: int) -> fc.Mesh:
    """Quadrilaterals between two radii [m] and angles [degrees]; 360 degrees make a ring."""
    ring = abs(end - start - 360.0) < 1e-9
    angles = np.radians(np.linspace(start, end, columns + 1)[: columns if ring else None])
    radii = np.linspace(inner, outer, rows + 1)
    nodes = np.stack([radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)], axis=-1)
    at = np.arange(nodes[..., 0].size).reshape(nodes.shape[:2])
    at = np.hstack([at, at[:, :1]]) if ring else at
    cells = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1)
    faces = {"inner": at[0], "outer": at[-1]}
    return fc.Mesh(nodes.reshape(-1, 2), cells.reshape(-1, 4),
                   {name: np.column_stack([line[:-1], line[1:]]) for name, line in faces.items()},
                   {} if ring else {"start": at[-1, 0], "end": at[-1, -1],
                                    "back": at[-1, columns // 2]})


def brake(friction: float = 0.4, *, angles: tuple[float, ...] = (90.0,), speed: float = 0.4,
          press: float = 2000.0, turned: float = 0.0, tolerance: float = 0.1) -> fc.ContactSystem:
    """Pads at some angles [degrees] on the rim of a disc that turns at a speed [rad/s].

    Each pad is pressed on the rim by soft springs with preload [N], and held along the rim by a
    stiff one at its back. All of it can be ``turned`` by an angle. ``tolerance`` is that of the
    residual vectors.
    """
    lining = fc.Material(youngs_modulus=8e9, poisson_ratio=0.25, density=2500.0)
    disc = sector(HUB, RIM, turned, turned + 360.0, 72, 4)
    bodies = {"disc": fc.ElasticBody(disc, thickness=0.02, fixed={"inner": "xy"})}
    faces, links = {}, []
    for number, angle in enumerate(angles, start=1):
        name, angle = f"pad{number}", angle + turned
        pad = sector(RIM, BACK, angle - HALF, angle + HALF, 8, 2)
        bodies[name] = fc.ElasticBody(pad, lining, thickness=0.02)
        x, y = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        faces[name] = pair_faces(bodies, f"{name}.inner", "disc.outer", nodes=8, nodes_on="face")
        links += [Spring(f"{name}.{end}", direction=(x, y), stiffness=1e5, damping=2.0,
                         preload=0.5 * press) for end in ("start", "end")]
        links.append(Spring(f"{name}.back", direction=(y, -x), stiffness=5e7, damping=5.0))
    bases = reduce_bodies(bodies, list(faces.values()), links, modes=12, damping=0.002,
                          tolerance=tolerance)
    return fc.ContactSystem(bodies=bases, links=links, interfaces=[
        fc.Interface(name, face, RoughSurface(1e8, roughness_height=10e-6, damping=20.0),
                     ConstantFriction(friction, smoothing_slope=1e5),
                     sliding=SlidingRotation(speed)) for name, face in faces.items()])


def with_friction(system: fc.ContactSystem, friction: float) -> fc.ContactSystem:
    """The brake with another friction coefficient of all pads."""
    return system.with_({f"interfaces.{name}.friction.friction_coefficient": friction
                         for name, _ in system.basis.groups})


def flutter_mode(modes: ComplexModes) -> int:
    """The mode that grows fastest, or decays most slowly."""
    return int(np.argmax(modes.eigenvalues.real))


def disturbed(system: fc.ContactSystem, size: float) -> np.ndarray:
    """Steady sliding, and the fastest growing mode with this largest deflection of the pad [m]."""
    state = initial_state(system, "sliding", 0.0)
    modes = complex_modes(system, "sliding")
    shape = modes.right[:, flutter_mode(modes)]
    back = system.basis.T[system.basis.point_index("pad1.back"), :2]
    return state + (shape * size / np.abs(back @ shape[: system.basis.modes]).max()).real


def growth(system: fc.ContactSystem, cycles: int = 12) -> tuple[float, float]:
    """Growth rate [1/s] and frequency [Hz] of a small disturbance, from a run in time.

    Projected on the mode by its left eigenvector, the run is one complex exponential.
    """
    modes = complex_modes(system, "sliding")
    mode = flutter_mode(modes)
    rest = initial_state(system, "sliding", 0.0)
    end = cycles / modes.frequencies_hz[mode]
    run = fc.simulate(system, end, initial=disturbed(system, 1e-10), outputs=200, rtol=1e-9)
    share = (run.states - rest) @ modes.left[:, mode]
    rate, phase = np.polyfit(run.time, np.stack([np.log(np.abs(share)),
                                                 np.unwrap(np.angle(share))], axis=1), 1)[0]
    return float(rate), float(phase / (2.0 * np.pi))


def squeal(system: fc.ContactSystem, end: float) -> tuple[fc.Trajectory, float]:
    """A run from a disturbance of 1 um, and the frequency in its last third [Hz]."""
    run = fc.simulate(system, end, initial=disturbed(system, 1e-6), outputs=int(end * 1e5) + 1)
    late = run.between(2.0 * end / 3.0)
    velocity = late.velocity("pad1.back")[:, 0]
    return run, amplitude_spectrum(late.time, velocity).peaks(1)[0].frequency_hz


def main(quick: bool = False) -> None:
    """Prints flutter and limit cycle."""
    system = brake()
    branch = equilibrium_branch(contact_field(brake(0.0), [FRICTION]), parameter=FRICTION,
                                bounds=(0.0, 0.6))
    hopf = branch.of_kind("Hopf")[0]
    print(f"flutter from a friction coefficient of {hopf.parameter:.4f} on, "
          f"at {hopf.frequency_hz:.1f} Hz, {hopf.criticality}")

    modes = complex_modes(system, "sliding")
    mode = flutter_mode(modes)
    rate, frequency = growth(system)
    print(f"at 0.4: mode of {modes.frequencies_hz[mode]:.2f} Hz grows by "
          f"{modes.eigenvalues[mode].real:.2f} 1/s; a run by {rate:.2f} 1/s at {frequency:.2f} Hz")
    run, cycle = squeal(system, 0.012 if quick else 0.02)
    state = np.bincount(run.between(0.66 * run.time[-1]).contact_state.ravel(), minlength=3)
    opened, stuck, _ = state / state.sum()
    print(f"limit cycle at {cycle:.1f} Hz, nodes open {100.0 * opened:.0f}% and stuck "
          f"{100.0 * stuck:.0f}% of the time")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
