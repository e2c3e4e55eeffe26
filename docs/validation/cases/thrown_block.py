"""A block thrown across a belt: friction in two directions, and what smoothing does to it.

In the belt's frame a block slides along a straight line and slows down at mu g, whatever its size;
in the room its path is a parabola until it sticks, after |u| / (mu g) with the initial velocity u
over the belt. A rigid mass is compared with a block of finite elements, which tilts forwards as
friction acts below its centre of mass, so that its front carries more.

A smoothed friction law never quite sticks, and the block creeps a little further than

    d = |u|^2 / (2 mu g),

by the integral of v (1 / s(v) - 1) / (mu g) over all speeds with the smoothed sign s: 2 |u| / (pi
k_s mu g) with the arctan, but by the square of 1 / k_s with the tanh.

Usage: python thrown_block.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import quad

import fecontact as fc
from fecontact.fem import SolidBlock
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.laws.friction.base import Smoothing
from fecontact.reduction import point_masses

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MU, G = 0.3, 9.81
BELT, THROWN = np.array([0.5, 0.0]), np.array([0.0, 1.0])  # m/s
RELATIVE = THROWN - BELT
SPEED = float(np.linalg.norm(RELATIVE))
STOP = SPEED / (MU * G)  # s
PLACE = (BELT + 0.5 * RELATIVE) * STOP  # where it sticks, in the room [m]
SHAPE = SolidBlock(length=0.06, width=0.04, height=0.02, element_size=0.01)


def path(time: np.ndarray) -> np.ndarray:
    """Places (N, 2) in the room without smoothing [m]."""
    sliding = np.minimum(time, STOP)[:, None]
    return BELT * time[:, None] + RELATIVE * sliding * (1.0 - 0.5 * sliding / STOP)


@dataclass(frozen=True)
class Throw:
    """Motion of the centre of mass: places and velocities (N, 2) [m, m/s]."""

    run: fc.Trajectory
    places: np.ndarray
    velocities: np.ndarray

    @cached_property
    def stop(self) -> float:
        """Time at which it sticks, from the straight line of the speed over the belt [s]."""
        speed = np.linalg.norm(self.velocities - BELT, axis=1)
        sliding = (speed > 0.1 * SPEED) & (self.run.time > 0.05)
        slope, start = np.polyfit(self.run.time[sliding], speed[sliding], 1)
        return float(-start / slope)

    @property
    def stuck_at(self) -> np.ndarray:
        """Place in space where the mass sticks, from its place on the belt at the end [m]."""
        return self.places[-1] - BELT * (self.run.time[-1] - self.stop)

    @property
    def excess(self) -> float:
        """Way on the belt beyond d [m]."""
        end = self.places[-1] - BELT * self.run.time[-1]
        return float(end @ RELATIVE / SPEED - 0.5 * SPEED * STOP)


def friction(smoothing: Smoothing, slope: float) -> ConstantFriction:
    """The friction of the belt with the smoothing slope k_s [s/m]."""
    return ConstantFriction(MU, smoothing=smoothing, smoothing_slope=slope)


def thrown_mass(smoothing: Smoothing, slope: float) -> Throw:
    """The throw of a rigid mass."""
    mass = point_masses({"mass": 1.0}, components="xyz", contact="mass")
    system = fc.ContactSystem(mass, LinearContact(stiffness=1e6), friction(smoothing, slope),
                              ground=fc.Ground(speed=BELT[0]), load=fc.Load(gravity=(0.0, 0.0, -G)))
    rows = mass.contact_T[0, :3]
    rest = fc.equilibrium(system).modal_coordinates
    state = np.concatenate([rest, np.linalg.solve(rows, [*THROWN, 0.0])])
    run = fc.simulate(system, 1.5 * STOP, initial=state, outputs=301, rtol=1e-9)
    return Throw(run, run.displacement(0)[:, :2], run.velocity(0)[:, :2])


def thrown_block(slope: float = 1e4, modes: int = 12, nodes: int = 24) -> Throw:
    """The throw of a block of steel with so many modes and contact nodes."""
    body = fc.ElasticBody(fc.generate(SHAPE))
    basis = fc.modal_basis(body, modes, contact_nodes=nodes, damping=0.02)
    # The ground gives way by a micrometre under the weight, and damps its rocking.
    stiffness = body.total_mass * G / 1e-6
    system = fc.ContactSystem(
        basis, LinearContact(stiffness, damping=0.2 * np.sqrt(stiffness * body.total_mass)),
        friction("arctan", slope), ground=fc.Ground(speed=BELT[0]),
        load=fc.Load(gravity=(0.0, 0.0, -G)))
    rows = basis.inertia_rows / body.total_mass
    # Mass-normalised modes: the velocities of a translation are its products with them.
    rest = fc.equilibrium(system).modal_coordinates
    state = np.concatenate([rest, THROWN @ basis.inertia_rows[:2]])
    run = fc.simulate(system, 1.2 * STOP, initial=state, outputs=2401, rtol=1e-6)
    return Throw(run, run.modal_coordinates @ rows[:2].T, run.modal_velocities @ rows[:2].T)


def excess(smoothing: Smoothing, slope: float) -> float:
    """The integral of v (1 / s - 1) / (mu g) up to the initial speed [m]."""

    def lacking(x: float) -> float:
        """1 / s - 1 at x = 2 k_s v / pi."""
        if smoothing == "arctan":
            rest = 2.0 / np.pi * np.arctan(2.0 / (np.pi * x))
            return rest / (1.0 - rest)
        if smoothing == "tanh":
            return 2.0 / np.expm1(2.0 * x)
        return 1.0 / (x * x * (np.sqrt(1.0 + 1.0 / (x * x)) + 1.0))

    scale = 2.0 * slope / np.pi
    # The tanh has nothing left beyond 50.
    end = min(scale * SPEED, 50.0) if smoothing == "tanh" else scale * SPEED
    ends = np.concatenate([[0.0], np.geomspace(1e-3, end, 40)])
    parts = [quad(lambda x: x * lacking(x), *pair, epsabs=0.0, epsrel=1e-10)[0]
             for pair in pairwise(ends)]
    return sum(parts) / (scale**2 * MU * G)


def lean(throw: Throw) -> np.ndarray:
    """Distance of the centre of pressure (N, 2) from the middle of the block [m]."""
    force = throw.run.normal_force
    places = throw.run.system.basis.contact_places[:, :2]
    return force @ (places - places.mean(axis=0)) / force.sum(axis=1, keepdims=True)


def turn(throw: Throw) -> np.ndarray:
    """Rotation (N,) about the normal [rad]."""
    return throw.run.displacement("C")[:, 5]


def figure(block: Throw, errors: dict[Smoothing, list[tuple[float, float]]],
           file: Path | None = None) -> "Figure":
    """The path of the block from above, and the excess of smoothed laws over k_s."""
    from matplotlib.patches import Rectangle

    from fecontact.plot import COLOURS, new_figure

    with new_figure(8.6, 4.2, file) as drawn:
        room, smoothed = drawn.subplots(1, 2, width_ratios=(1.0, 1.3))
        time = np.linspace(0.0, block.run.time[-1], 400)
        sides = np.array([SHAPE.length, SHAPE.width])
        for at in np.linspace(0.0, block.run.time[-1], 5):
            place = 1e3 * block.places[np.argmin(np.abs(block.run.time - at))]
            room.add_patch(Rectangle(tuple(place - 500.0 * sides), *(1e3 * sides), fill=False,
                                     color=COLOURS[0], lw=0.8))
        room.plot(*(1e3 * path(time).T), color=COLOURS[6], label="closed form")
        room.plot(*(1e3 * block.places[::120].T), "o", color=COLOURS[0], label="block")
        room.plot(*(1e3 * PLACE), "x", color=COLOURS[1], markersize=9.0, label="sticks")
        room.set(xlabel="x [mm], along the belt", ylabel="y [mm]", aspect="equal")
        room.legend(loc="lower right")
        slopes = np.geomspace(1e2, 1e5, 40)
        for colour, (smoothing, found) in zip(COLOURS, errors.items(), strict=False):
            smoothed.loglog(slopes, [1e3 * excess(smoothing, slope) for slope in slopes],
                            color=colour)
            smoothed.loglog(*np.transpose([(slope, 1e3 * far) for slope, far in found]), "o",
                            color=colour, label=smoothing)
        smoothed.set(xlabel="smoothing slope $k_s$ [s/m]", ylabel="too far on the belt [mm]")
        smoothed.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print where mass and block stick and how far smoothing lets them creep; draw both."""
    print(f"closed form: sticks after {STOP:.7f} s at x = {PLACE[0]:.7f}, y = {PLACE[1]:.7f} m")
    thrown = {"mass": thrown_mass("arctan", 1e5), "block": thrown_block(1e4 if quick else 1e5)}
    for name, throw in thrown.items():
        print(f"{name}: sticks after {throw.stop:.7f} s at x = {throw.stuck_at[0]:.7f}, "
              f"y = {throw.stuck_at[1]:.7f} m")
    block = thrown["block"]
    middle = np.argmin(np.abs(block.run.time - 0.5 * STOP))
    print(f"centre of pressure of the block {1e3 * np.linalg.norm(lean(block)[middle]):.4f} mm "
          f"ahead (mu h / 2 = {500.0 * MU * SHAPE.height:.4f} mm), turned by at most "
          f"{np.abs(turn(block)).max():.0e} rad")
    slopes = (1e2, 1e3, 1e4) if quick else tuple(10.0 ** np.arange(2.0, 5.5, 0.5))
    errors: dict[Smoothing, list[tuple[float, float]]] = {}
    for smoothing in ("arctan", "tanh", "square-root"):
        errors[smoothing] = [(slope, thrown_mass(smoothing, slope).excess) for slope in slopes]
        print(f"{smoothing}, k_s = 1000 s/m: {dict(errors[smoothing])[1e3]:.5e} m too far "
              f"(closed form {excess(smoothing, 1e3):.5e})")
    folder.mkdir(parents=True, exist_ok=True)
    figure(block, errors, folder / "thrown_block.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
