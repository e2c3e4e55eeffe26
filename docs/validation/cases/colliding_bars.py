"""Two elastic bars collide end to end: longitudinal waves decide how they part.

A bar hits another one of the same section that rests. With equal lengths L they exchange their
velocities and touch for 2 L / c. A short bar that hits a long one stops as its wave returns, after
2 L_1 / c, and the long one goes on with a wave in it: the coefficient of restitution of the mean
velocities is L_1 / L_2, without any loss. A stiff spring between the ends makes all this last a
little longer, by parts of tau = Z / (2 k) with the impedance Z = E A / c of a bar.

Usage: python colliding_bars.py [--quick]
"""

import sys
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact import ContactSystem, ElasticBody, Interface, Material, Mesh, Trajectory, simulate
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import reduce_bodies

LENGTH, HEIGHT, SPEED = 1.0, 0.01, 1.0
# Without Poisson's ratio there is nothing but longitudinal waves.
STEEL = Material(210e9, 0.0, 7850.0)
WAVE_SPEED = float(np.sqrt(STEEL.youngs_modulus / STEEL.density))
IMPEDANCE = STEEL.youngs_modulus * HEIGHT / WAVE_SPEED


@dataclass(frozen=True)
class Collision:
    """The run of a bar that hits another one.

    Attributes
    ----------
    run : Trajectory
        From the first touch on.
    lengths : (float, float)
        [m]
    stiffness : float
        Of the spring between the ends, per thickness [N/m].
    """

    run: Trajectory
    lengths: tuple[float, float]
    stiffness: float

    @property
    def lag(self) -> float:
        """Time constant tau = Z / (2 k) of the force [s]."""
        return IMPEDANCE / (2.0 * self.stiffness)

    @cached_property
    def momenta(self) -> np.ndarray:
        """Momentum (N, 2) of both bars over that of the first one before."""
        basis = self.run.system.basis
        rows = basis.inertia_rows[0]
        put = [rows[part.modes[0] : sum(part.modes)]
               @ self.run.modal_velocities[:, part.modes[0] : sum(part.modes)].T
               for part in basis.parts]
        return np.transpose(put) / (STEEL.density * HEIGHT * self.lengths[0] * SPEED)

    @property
    def force(self) -> np.ndarray:
        """Contact force (N,) over Z v / 2."""
        return self.run.normal_force.sum(axis=1) / (0.5 * IMPEDANCE * SPEED)

    @property
    def contact_time(self) -> float:
        """From the first to the last touch [s]."""
        touching = np.flatnonzero(self.force > 0.0)
        return float(self.run.time[touching[-1]])

    @property
    def restitution(self) -> float:
        """Difference of the mean velocities after over that before."""
        first, second = self.momenta[-1]
        return float(second * self.lengths[0] / self.lengths[1] - first)


def bar(start: float, length: float, elements: int) -> ElasticBody:
    """A bar from ``start`` on, as a strip that cannot bend."""
    x = start + np.linspace(0.0, length, elements + 1)
    low = np.arange(elements + 1)
    high = low + elements + 1
    nodes = np.concatenate([np.column_stack([x, np.full_like(x, y)]) for y in (0.0, HEIGHT)])
    cells = np.column_stack([low[:-1], low[1:], high[1:], high[:-1]])
    sides = [np.column_stack([line[:-1], line[1:]]) for line in (low, high)]
    return ElasticBody(
        Mesh(nodes, cells, {"sides": np.concatenate(sides), "left": [[low[0], high[0]]],
                            "right": [[low[-1], high[-1]]]}),
        STEEL, fixed={"sides": "y"})


def collision(second: float = LENGTH, modes: int = 30, lag: float = 0.02) -> Collision:
    """A bar of length 1 m hits one of length ``second``; ``lag`` is tau over 2 L / c.

    The run ends two wave travels through the longer bar after the first touch.
    """
    period = 2.0 * LENGTH / WAVE_SPEED
    stiffness = IMPEDANCE / (2.0 * lag * period)
    elements = 2 * modes
    bodies = {"first": bar(0.0, LENGTH, elements),
              "second": bar(LENGTH, second, round(elements * second / LENGTH))}
    touch = pair_faces(bodies, "first.right", "second.left", nodes=1, nodes_on="face")
    bases = reduce_bodies(bodies, [touch], modes={
        "first": modes, "second": round(modes * second / LENGTH)}, tolerance=0.0)
    system = ContactSystem(bodies=bases, interfaces=[
        Interface("ends", touch, LinearContact(stiffness), ConstantFriction(0.0))])
    count = bases["first"].modes
    state = np.zeros(system.size)
    # The rigid motion of the first bar, with mass-normalised modes.
    state[system.basis.modes :][:count] = SPEED * bases["first"].inertia_rows[0]
    run = simulate(system, 2.4 * max(LENGTH, second) / WAVE_SPEED, initial=state, rtol=1e-8,
                   outputs=2001)
    return Collision(run, (LENGTH, second), stiffness)


def closed_form(collided: Collision) -> tuple[float, float | None]:
    """Coefficient of restitution and contact time [s] of waves, with the spring between the ends.

    With T = 2 L / c and exp(-T/tau) = 0, equal bars lose touch at T + a tau, (1 + a) exp(-a) = 1/2,
    and keep e = 1 - (4 exp(-a) + 2 a - 4) tau / T of their relative velocity. A bar twice as long
    or longer is left when its own wave comes back: e = r + (1 + r) tau / T, r = L_1 / L_2.
    """
    first, second = collided.lengths
    period = 2.0 * first / WAVE_SPEED
    if first == second:
        a = 1.6783469900166605
        return (1.0 - (4.0 * np.exp(-a) + 2.0 * a - 4.0) * collided.lag / period,
                period + a * collided.lag)
    ratio = first / second
    return ratio + (1.0 + ratio) * collided.lag / period, None


def main(quick: bool = False) -> None:
    """Print velocities, restitution and contact time beside those of waves."""
    for second in (LENGTH, 2.0 * LENGTH):
        found = collision(second, 20 if quick else 40)
        e, duration = closed_form(found)
        print(f"1 m on {second:g} m: restitution {found.restitution:.4f} (waves {e:.4f})")
        if duration is not None:
            print(f"contact time {1e6 * found.contact_time:.2f} us (waves {1e6 * duration:.2f})")
        print(f"momentum to {np.abs(found.momenta.sum(axis=1) - 1.0).max():.0e}, "
              f"energy to {found.run.energies.imbalance:.0e}")


if __name__ == "__main__":
    main("--quick" in sys.argv)
