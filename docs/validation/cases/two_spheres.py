"""Two equal spheres pressed together and moved to and fro: Hertz, Cattaneo and Mindlin.

Near the contact both spheres are half-spaces, whose mean displacements over rings under uniform
tractions on rings are known in closed form. Each ring is a contact node; what both spheres give way
along and normal to the contact makes the stiffness of a basis from matrices, without any mesh. As
the spheres are of one material, normal and tangential contact are not coupled. The mean over a ring
takes friction as parallel everywhere, as Cattaneo and Mindlin do; it turns a little, unless
Poisson's ratio is zero. Slow motion of the other side shows the quasi-static course of friction.

Under the load P the spheres touch within Hertz's radius a. A tangential force Q below mu P lets
them slip outside of the radius c = a q^(1/3), q = 1 - Q / (mu P), and displaces them by

    3 mu P S / (16 a) (1 - q^(2/3)),    S = 2 (2 - nu) / G.

A cycle of +-Q loses (Mindlin and Deresiewicz 1953)

    9 mu^2 P^2 S / (10 a) {1 - q^(5/3) - 5 Q / (6 mu P) (1 + q^(2/3))}.

This is what is left of two larger works, so that errors of the forces weigh up to thirty times.

Usage: python two_spheres.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ellipe, ellipk

import fecontact as fc
from fecontact.laws import HarmonicSpeed, JenkinsFriction, LinearContact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULUS, RADIUS, MU = 2.1e11, 0.05, 0.3  # of the spheres [Pa, m]
WIDTH = 1e-3  # Hertz's radius a of the contact [m]
ANGLE = np.pi / 6.0  # of the tangential motion to the x axis
PART, RATIO = 0.75, 0.3  # Q / (mu P), Poisson's ratio


@dataclass(frozen=True)
class ClosedForm:
    """Hertz, Cattaneo and Mindlin for spheres of a Poisson's ratio."""

    poisson_ratio: float

    @property
    def modulus(self) -> float:
        """E* of both spheres [Pa]."""
        return MODULUS / (2.0 * (1.0 - self.poisson_ratio**2))

    @property
    def load(self) -> float:
        """P = 4 E* a^3 / (3 R / 2) [N]."""
        return 8.0 * self.modulus * WIDTH**3 / (3.0 * RADIUS)

    @property
    def peak(self) -> float:
        """Hertz's p_0 = 3 P / (2 pi a^2) [Pa]."""
        return 1.5 * self.load / (np.pi * WIDTH**2)

    @property
    def approach(self) -> float:
        """Approach of distant points of the spheres, 2 a^2 / R [m]."""
        return 2.0 * WIDTH**2 / RADIUS

    @property
    def compliance(self) -> float:
        """The sum S = 2 (2 - nu) / G of both spheres [1/Pa]."""
        return (4.0 * (2.0 - self.poisson_ratio) * (1.0 + self.poisson_ratio)) / MODULUS

    def displacement(self, part: float) -> float:
        """Tangential displacement of distant points under Q = part mu P [m]."""
        scale = 3.0 * MU * self.load * self.compliance / (16.0 * WIDTH)
        return float(scale * (1.0 - (1.0 - part) ** (2.0 / 3.0)))

    def loss(self, part: float) -> float:
        """Work lost in a cycle of +-part mu P [J]."""
        q = 1.0 - part
        scale = 0.9 * (MU * self.load) ** 2 * self.compliance / WIDTH
        return float(scale * (1.0 - q ** (5.0 / 3.0) - 5.0 / 6.0 * part * (1.0 + q ** (2.0 / 3.0))))


def disc(r: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """The integral of 1 / distance over a disc, seen from the distance r from its centre."""
    inner, outer = np.minimum(r, radius), np.maximum(r, radius)
    k = (inner / outer) ** 2
    # The second term vanishes at the edge, where K is infinite.
    outside = ellipe(k) - np.where(k < 1.0, (1.0 - k) * ellipk(np.minimum(k, 1.0 - 1e-15)), 0.0)
    return 4.0 * outer * np.where(r < radius, ellipe(k), outside)


def compliance(edges: np.ndarray) -> np.ndarray:
    """Mean of 1 / distance (n, n) between points of each two rings between edges (n + 1,) [1/m]."""
    points, weights = np.polynomial.legendre.leggauss(40)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    r = middle[:, None] + half[:, None] * points
    # By area: weights are proportional to r.
    weights = r * weights / (r * weights).sum(axis=1, keepdims=True)
    discs = np.einsum("ip,ipj->ij", weights, disc(r[:, :, None], edges))
    given = np.diff(discs, axis=1) / (np.pi * np.diff(edges**2))
    return 0.5 * (given + given.T)


def spheres(rings: int, poisson_ratio: float = RATIO, part: float = PART, angle: float = ANGLE,
            frequency: float = 1.0) -> fc.ContactSystem:
    """The contact; the other side moves by the displacement that Q = part mu P needs.

    It goes to and fro at an angle [rad] to the x axis. Friction has springs ten thousand times as
    stiff as the spheres, which makes it independent of the speed.
    """
    exact = ClosedForm(poisson_ratio)
    edges = np.linspace(0.0, 1.1 * WIDTH, rings + 1)
    area = np.pi * np.diff(edges**2)
    # Twice, for two spheres; over a ring (1 - nu) / r + nu x^2 / r^3 has the mean (1 - nu/2) / r.
    shear = MODULUS / (2.0 * (1.0 + poisson_ratio))
    along = 2.0 * (1.0 - 0.5 * poisson_ratio) / (2.0 * np.pi * shear)
    normal = 2.0 * (1.0 - poisson_ratio**2) / (np.pi * MODULUS)
    n = rings
    stiffness = np.kron(np.linalg.inv(compliance(edges)), np.diag([1.0 / along, 1.0 / along,
                                                                   1.0 / normal]))
    # The last degree of freedom is the approach of all points far from the contact.
    moved = np.zeros((3 * n, 1))
    moved[2::3] = 1.0
    full = np.block([[stiffness, -stiffness @ moved],
                     [-moved.T @ stiffness, moved.T @ stiffness @ moved]])
    # So light that the load is slow for all modes.
    mass = np.linalg.eigvalsh(stiffness)[0] / (2.0 * np.pi * 1e4 * frequency) ** 2
    rows = np.zeros((n, 3, 3 * n + 1))
    rows[:, :, :-1] = np.eye(3 * n).reshape(n, 3, 3 * n)
    far = np.zeros((3, 3 * n + 1))
    far[2, -1] = 1.0
    basis = fc.basis_from_matrices(
        mass * np.eye(3 * n + 1), full, {"contact": rows, "C": far}, rigid=1, dimension=3,
        # The rings stand for their middles on the x axis.
        contact_places=np.column_stack([0.5 * (edges[1:] + edges[:-1]), np.zeros((n, 2))]),
        tributary=area, damping=0.5)
    # The face is so stiff that the spheres alone give way.
    face = 1e6 * exact.peak / WIDTH * area.sum()
    speed = 2.0 * np.pi * frequency * exact.displacement(part)
    sway = [HarmonicSpeed(speed * along, frequency, phase=0.5 * np.pi)
            for along in (np.cos(angle), np.sin(angle))]
    return fc.ContactSystem(
        basis, LinearContact(face), JenkinsFriction(
            stiffness=1e4 * MU * exact.load / exact.displacement(part), friction_coefficient=MU),
        ground=fc.Ground(motion=sway[0], motion_y=sway[1]),
        # The mean of r^2 over each ring.
        load=fc.Load(normal=exact.load), gap=(edges[1:]**2 + edges[:-1]**2) / (2.0 * RADIUS))


@dataclass(frozen=True)
class Cycle:
    """A quarter of a cycle and a whole one after it."""

    run: fc.Trajectory
    exact: ClosedForm
    part: float

    @cached_property
    def radii(self) -> np.ndarray:
        """Root mean square radii (n,) of the rings [m]."""
        return np.sqrt(np.asarray(self.run.system.gap) * RADIUS)

    @cached_property
    def pressure(self) -> np.ndarray:
        """Pressure (n,) [Pa]."""
        return self.run.normal_force[0] / self.run.system.basis.tributary

    @cached_property
    def shear(self) -> np.ndarray:
        """Shear (n,) at the end of the first quarter [Pa]."""
        quarter = np.argmin(np.abs(self.run.time - 0.25))
        force = np.linalg.norm(self.run.friction_forces[quarter], axis=1)
        return force / self.run.system.basis.tributary

    @property
    def peak_and_width(self) -> tuple[float, float]:
        """Peak and radius of the ellipse p^2 = p_0^2 (1 - r^2 / a^2)."""
        return _ellipse(self.radii, self.pressure, self.pressure > 0.3 * self.exact.peak)

    @property
    def sticking_part(self) -> float:
        """Radius of the circle that sticks over a: that of the ellipse mu p - q."""
        left = MU * self.pressure - self.shear
        return _ellipse(self.radii, left, left > 0.3 * left.max())[1] / WIDTH

    @property
    def approach(self) -> float:
        """Approach of distant points along the normal [m]."""
        return -float(self.run.displacement("C")[0, 2])

    @property
    def travel(self) -> np.ndarray:
        """Displacement (N,) of the other side along the motion [m]."""
        w = 2.0 * np.pi
        return self.exact.displacement(self.part) * np.sin(w * self.run.time)

    @property
    def force(self) -> np.ndarray:
        """Tangential force (N,) along the motion [N]."""
        along = np.array([np.cos(ANGLE), np.sin(ANGLE)])
        return -self.run.friction_forces.sum(axis=1) @ along

    @property
    def loss(self) -> float:
        """Work of friction in the whole cycle [J]."""
        work = self.run.friction_work.sum(axis=1)
        return float(work[-1] - work[np.argmin(np.abs(self.run.time - 0.25))])


def _ellipse(r: np.ndarray, values: np.ndarray, inner: np.ndarray) -> tuple[float, float]:
    slope, top = np.polyfit(r[inner] ** 2, values[inner] ** 2, 1)
    return float(np.sqrt(top)), float(np.sqrt(-top / slope))


def cycle(rings: int, part: float = PART) -> Cycle:
    """Pressed without friction first, then moved to and fro."""
    system = spheres(rings, part=part)
    state = np.zeros(system.size)
    state[: system.basis.modes] = fc.equilibrium(system).modal_coordinates
    run = fc.simulate(system, 1.25, initial=state, outputs=501, rtol=1e-4)
    return Cycle(run, ClosedForm(RATIO), part)


def figure(found: Cycle, path: Path | None = None) -> "Figure":
    """Pressure and shear over the radius, and the loop, beside the closed forms."""
    from fecontact.plot import COLOURS, new_figure

    exact = found.exact
    with new_figure(8.6, 4.0, path) as drawn:
        face, loop = drawn.subplots(1, 2)
        r = np.linspace(0.0, 1.1, 400)
        c = (1.0 - found.part) ** (1.0 / 3.0)
        outer, inner = (scale * np.sqrt(np.maximum(1.0 - (r / scale) ** 2, 0.0))
                        for scale in (1.0, c))
        peak = 1e-9 * exact.peak
        for colour, line, values, label in (
                (COLOURS[0], peak * outer, found.pressure, "pressure"),
                (COLOURS[1], peak * MU * (outer - inner), found.shear, "shear")):
            face.plot(r, line, color=colour)
            face.plot(found.radii / WIDTH, 1e-9 * values, "o", color=colour, markersize=4.0,
                      label=label)
        face.axvline(c, color=COLOURS[6], ls="--", label="sticks inside")
        face.set(xlabel="r / a", ylabel="pressure, shear [GPa]")
        face.legend()
        # Masing: branches of the loop are twice the first loading.
        q = np.linspace(0.0, found.part, 200)
        first = np.array([exact.displacement(part) for part in q])
        last = np.array([2.0 * exact.displacement(0.5 * part) for part in 2.0 * q])
        limit = exact.displacement(found.part)
        for sign in (-1.0, 1.0):
            loop.plot(sign * 1e6 * (limit - last), sign * (found.part - 2.0 * q), color=COLOURS[0])
        loop.plot(1e6 * first, q, color=COLOURS[0], label="closed form")
        loop.plot(1e6 * found.travel[::10], found.force[::10] / (MU * exact.load), "o",
                  color=COLOURS[1], markersize=3.5, label="run")
        loop.set(xlabel="displacement [µm]", ylabel="Q / (µ P)")
        loop.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print what is found beside the closed forms for two numbers of rings; draw the last."""
    for rings in (11,) if quick else (11, 22):
        found = cycle(rings)
        exact = found.exact
        peak, width = found.peak_and_width
        quarter = np.argmax(found.travel)
        print(f"{rings} rings: approach {1e6 * found.approach:.4f} um "
              f"(Hertz {1e6 * exact.approach:.4f}), p_0 = {1e-9 * peak:.4f} GPa "
              f"({1e-9 * exact.peak:.4f}), a = {1e3 * width:.4f} mm ({1e3 * WIDTH:.4f}), "
              f"c / a = {found.sticking_part:.4f} ({(1.0 - PART) ** (1.0 / 3.0):.4f}), "
              f"Q = {found.force[quarter] / (MU * exact.load):.5f} mu P ({PART:.5f}), "
              f"loss {1e3 * found.loss:.5f} mJ ({1e3 * exact.loss(PART):.5f})")
    folder.mkdir(parents=True, exist_ok=True)
    figure(found, folder / "two_spheres.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
