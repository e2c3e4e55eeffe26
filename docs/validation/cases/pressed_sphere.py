"""An elastic sphere on a rigid plane, of finite elements: Hertz, Cattaneo and Mindlin.

The lowest part of a sphere of 50 mm is pressed on a rigid plane, without friction, and then sheared
to and fro by Q = 0.9 mu P, all without time. The plane is the one of symmetry between the two
spheres of `two_spheres.py`: half the approach, half the displacement and half the loss. With
Poisson's ratio near 1/2 a rigid plane couples normal and tangential contact no more than they do.

The body is five times as wide and high as the contact. Its forces are those of the half-space; but
it gives way a little less, by a compliance that belongs to the resultant force alone. That is taken
from uniform tractions on the contact face, whose mean displacements of a half-space are
16 (1 - nu^2) / (3 pi^2 a E) and 8 (2 - nu) (1 + nu) / (3 pi^2 a E) per force. What prevents tilting
is that the basis has no rigid rotations. The contact face ends where Hertz's contact does, so that
edges of elements lie there; outside of it the sphere has to stay clear of the plane. Radii of
contact and of the circle that sticks follow from second moments,

    integral of p r^2 = 2/5 P a^2,    integral of q r^2 = 2/5 mu P (a^2 - c^5 / a^3)

which feel where forces are, not the few elements at the edges. The loss, a small difference of
large works, needs elements that are small beside the ring that slips.

Cattaneo and Mindlin take friction as parallel everywhere; with Poisson's ratio some of it points
across the load. That makes the displacement 0.3 % smaller at Q = 0.9 mu P, nu = 0.49: squares of a
half-space under Hertz's pressure, `half_space`, show it without finite elements.

Usage: python pressed_sphere.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from two_spheres import MODULUS, MU, RADIUS, WIDTH, ClosedForm

import fecontact as fc
from fecontact.fem import SphereSegment
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.system import LoadHistory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATIO, PART = 0.49, 0.9  # Poisson's ratio, Q / (mu P)
SIZE = 5.0  # of the body, in radii of the contact
STEPS = 5


def sphere(elements: int) -> fc.ModalBasis:
    """The body, with so many elements along the radius of the contact, which cannot turn."""
    shape = SphereSegment(
        radius=RADIUS, base_radius=SIZE * WIDTH, height=SIZE * WIDTH, contact_radius=WIDTH,
        contact_element_size=WIDTH / elements, element_size=4.0 * WIDTH)
    body = fc.ElasticBody(fc.generate(shape), fc.Material(MODULUS, RATIO))
    basis = fc.modal_basis(body, 12, C="top", reduction="residual", tolerance=0.0)
    turns = np.abs(basis.T[1, 3:, : basis.rigid_modes]).max(axis=0)
    return basis.select([mode for mode in range(basis.modes)
                         if mode >= basis.rigid_modes or turns[mode] < 1e-6 * turns.max()])


@dataclass(frozen=True)
class PressedSphere:
    """First loading to Q and a cycle after it, beside the closed form of two such spheres."""

    history: LoadHistory
    exact: ClosedForm
    part: float

    @property
    def basis(self) -> fc.ModalBasis:
        """The body."""
        return self.history.system.basis

    @cached_property
    def radii(self) -> np.ndarray:
        """Distances (n,) of the contact nodes from the axis [m]."""
        return np.hypot(*self.basis.contact_places[:, :2].T)

    @cached_property
    def pressure(self) -> np.ndarray:
        """Pressure (n,) before shearing [Pa]."""
        return self.history.normal_force[0] / self.basis.tributary

    @cached_property
    def shear(self) -> np.ndarray:
        """Shear (n,) after the first loading [Pa]."""
        friction = self.history.friction_forces[STEPS]
        return np.linalg.norm(friction, axis=1) / self.basis.tributary

    @property
    def width(self) -> float:
        """Radius of contact [m]."""
        force = self.history.normal_force[0]
        return float(np.sqrt(2.5 * (force @ self.radii**2) / force.sum()))

    @property
    def peak(self) -> float:
        """Peak of the ellipse p^2 = p_0^2 (1 - r^2 / a^2) in the inner half of the area [Pa]."""
        inner = self.radii < np.sqrt(0.5) * WIDTH
        return float(np.sqrt(np.polyfit(self.radii[inner] ** 2, self.pressure[inner] ** 2, 1)[1]))

    @property
    def sticking_part(self) -> float:
        """Radius of the circle that sticks over a."""
        moment = abs(self.history.friction_forces[STEPS, :, 0] @ self.radii**2)
        left = WIDTH**2 - 2.5 * moment / (MU * self.exact.load)
        return float((WIDTH**3 * left) ** 0.2 / WIDTH)

    @property
    def clearance(self) -> float:
        """Least distance of the sphere from the plane outside of the contact face [m]."""
        field = self.basis.fields(self.history.modal_coordinates[0])
        away = np.hypot(*field.nodes[:, :2].T)
        low = RADIUS - np.sqrt(RADIUS**2 - away**2)
        outside = (np.abs(field.nodes[:, 2] - low) < 1e-6 * WIDTH) & (away > 1.001 * WIDTH)
        return float((field.nodes + field.displacement)[outside, 2].min())

    def beyond(self, axis: int) -> float:
        """Compliance of the body beyond a half-space under uniform traction on the face [m/N].

        Along the first tangent or, 2, the normal; its top is at rest.
        """
        w, area = self.basis.angular_frequencies, self.basis.tributary
        elastic = w > 0.0
        mean = area / area.sum() @ self.basis.contact_T[:, axis]
        moved = (mean - self.basis.point_row("C", "xyz"[axis]))[elastic] / w[elastic]
        scale = 16.0 / (3.0 * np.pi**2 * np.sqrt(area.sum() / np.pi) * MODULUS)
        half_space = scale * (1.0 - RATIO**2 if axis == 2
                              else 0.5 * (2.0 - RATIO) * (1.0 + RATIO))
        return float(moved @ moved - half_space)

    @property
    def approach(self) -> float:
        """Approach of a half-space [m]."""
        found = -float(self.basis.point_row("C", "z") @ self.history.modal_coordinates[0])
        return found - self.beyond(2) * self.exact.load

    @property
    def displacement(self) -> float:
        """Displacement of a half-space under Q [m]."""
        found = float(self.basis.point_row("C", "x") @ self.history.modal_coordinates[STEPS])
        return found - self.beyond(0) * self.part * MU * self.exact.load

    @property
    def first_loading(self) -> np.ndarray:
        """Q / (mu P) and displacement [m] of a half-space (2, n) of the first increments."""
        path, some = self.history.path, slice(1, STEPS + 1)
        force = path.at_points(path.forces[0])[some]
        moved = self.history.modal_coordinates[some] @ self.basis.point_row("C", "x")
        return np.stack([force / (MU * self.exact.load), moved - self.beyond(0) * force])

    @property
    def loss(self) -> float:
        """Loss of the cycle [J]."""
        return self.history.loop(1, 3).loss


def pressed(elements: int, part: float = PART) -> PressedSphere:
    """Pressed without friction first, then sheared to Q, to -Q and back."""
    exact, basis = ClosedForm(RATIO), sphere(elements)
    system = fc.ContactSystem(
        # So stiff that the body alone gives way.
        basis, LinearContact(1e5 * exact.peak / WIDTH * basis.tributary.sum()),
        ConstantFriction(MU),
        load=fc.Load(exact.load), gap=basis.contact_places[:, 2])
    Q = part * MU * exact.load
    history = fc.load_history(system, fc.LoadPath(forces={"C.x": (0.0, Q, -Q, Q)}, steps=STEPS),
                              rtol=1e-3)
    return PressedSphere(history, exact, part)


def half_space(cells: int, parts: np.ndarray, across: bool) -> np.ndarray:
    """Displacement over that of Cattaneo and Mindlin under the same force, for parts of mu P.

    Of a half-space under Hertz's pressure, with uniform friction on squares, so many across the
    contact; parallel to the force or, ``across``, in both directions. Cerruti's displacement along
    x under forces along x and y at the distance r is ((1 - nu) + nu x^2 / r^2) / r and nu x y /
    r^3, over 2 pi G, here in units of the radius, mu P and 1 / (2 pi G a).
    """
    side = 2.0 / cells
    line = (np.arange(cells) + 0.5) * side - 1.0
    x, y = (grid[np.hypot(*np.meshgrid(line, line)) < 1.0] for grid in np.meshgrid(line, line))
    # Integrals of 1 / r, x^2 / r^3 and x y / r^3 over each square.
    plain, along, twist = np.zeros((3, len(x), len(x)))
    for i, j in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        u, v = (np.subtract.outer(one, one) + 0.5 * sign * side for one, sign in ((x, i), (y, j)))
        r = np.hypot(u, v)
        plain += i * j * (u * np.log(v + r) + v * np.log(u + r))
        along += i * j * v * np.log(u + r)
        twist -= i * j * r
    if across:
        both = np.block([[along, twist], [twist, plain - along]])
        compliance = (1.0 - RATIO) * np.kron(np.eye(2), plain) + RATIO * both
    else:
        compliance = (1.0 - 0.5 * RATIO) * plain
    stiffness = np.linalg.inv(compliance / side**2)
    limit = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    limit /= limit.sum()
    shape = (2 if across else 1, len(x))
    step = 1.0 / np.linalg.eigvalsh(stiffness)[-1]
    slip, moved, found = np.zeros(shape), np.zeros(shape), []
    for part in parts:
        # Value of the closed form; 3 mu P S / (16 a) is 3 pi (2 - nu) / 4 of the unit for one body.
        moved[0] = 0.375 * np.pi * (2.0 - RATIO) * (1.0 - (1.0 - part) ** (2.0 / 3.0))
        before, guess, weight = slip.copy(), slip.copy(), 1.0
        # The work of slip and the elastic energy are least; by accelerated proximal gradients.
        for _ in range(20_000):
            force = (stiffness @ (moved - guess).ravel()).reshape(shape)
            way = guess + step * force - before
            size = np.maximum(np.linalg.norm(way, axis=0), 1e-300)
            new = before + way * np.maximum(1.0 - step * limit / size, 0.0)
            last, weight = weight, 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * weight**2))
            guess = new + (last - 1.0) / weight * (new - slip)
            change, slip = np.abs(new - slip).max(), new
            if change < 1e-10 * moved[0, 0]:
                break
        carried = (stiffness @ (moved - slip).ravel())[: len(x)].sum()
        found.append((1.0 - (1.0 - part) ** (2.0 / 3.0)) / (1.0 - (1.0 - carried) ** (2.0 / 3.0)))
    return np.array(found)


def displacement_figure(found: PressedSphere, path: Path | None = None) -> "Figure":
    """Displacement over that of the closed form, beside that of a half-space."""
    from fecontact.plot import COLOURS, new_figure

    parts = np.linspace(0.05, found.part, 18)
    across, parallel = (half_space(20, parts, both) for both in (True, False))
    force, moved = found.first_loading
    exact = np.array([0.5 * found.exact.displacement(one) for one in force])
    with new_figure(5.6, 4.0, path) as drawn:
        axes = drawn.subplots()
        axes.axhline(0.0, color=COLOURS[0], label="Cattaneo and Mindlin")
        axes.plot(parts, 100.0 * (across / parallel - 1.0), color=COLOURS[1],
                  label="half-space, friction in two directions")
        axes.plot(force, 100.0 * (moved / exact - 1.0), "o", color=COLOURS[2],
                  label="finite elements")
        axes.set(xlabel="Q / (µ P)", ylabel="displacement, difference [%]")
        axes.legend()
    return drawn


def figure(found: PressedSphere, path: Path | None = None) -> "Figure":
    """Pressure and shear over the radius, and the loop, beside the closed forms."""
    from fecontact.plot import COLOURS, new_figure

    exact, part = found.exact, found.part
    with new_figure(8.6, 4.0, path) as drawn:
        face, loop = drawn.subplots(1, 2)
        r = np.linspace(0.0, 1.1, 400)
        c = (1.0 - part) ** (1.0 / 3.0)
        outer, inner = (scale * np.sqrt(np.maximum(1.0 - (r / scale) ** 2, 0.0))
                        for scale in (1.0, c))
        peak = 1e-9 * exact.peak
        for colour, line, values, label in (
                (COLOURS[0], peak * outer, found.pressure, "pressure"),
                (COLOURS[1], peak * MU * (outer - inner), found.shear, "shear")):
            face.plot(r, line, color=colour)
            face.plot(found.radii / WIDTH, 1e-9 * values, "o", color=colour, markersize=3.0,
                      label=label)
        face.axvline(c, color=COLOURS[6], ls="--", label="sticks inside")
        face.set(xlabel="r / a", ylabel="pressure, shear [GPa]")
        face.legend()
        q = np.linspace(0.0, part, 200)
        first = np.array([0.5 * exact.displacement(one) for one in q])
        last = 2.0 * np.array([0.5 * exact.displacement(one) for one in q])
        limit = 0.5 * exact.displacement(part)
        for sign in (-1.0, 1.0):
            loop.plot(sign * 1e6 * (limit - last), sign * (part - 2.0 * q), color=COLOURS[0])
        loop.plot(1e6 * first, q, color=COLOURS[0], label="closed form")
        path_of = found.history.path
        force = path_of.at_points(path_of.forces[0])
        top = found.history.modal_coordinates @ found.basis.point_row("C", "x")
        moved = top - found.beyond(0) * force
        loop.plot(1e6 * moved, force / (MU * exact.load), "o", color=COLOURS[1], markersize=3.5,
                  label="finite elements")
        loop.set(xlabel="displacement [µm]", ylabel="Q / (µ P)")
        loop.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print what is found beside the closed forms for two meshes; draw the last."""
    from fecontact.plot import plot_shear

    for elements in (2,) if quick else (2, 4):
        found = pressed(elements)
        exact = found.exact
        print(f"{elements} elements: approach {1e6 * found.approach:.4f} um "
              f"(Hertz {0.5e6 * exact.approach:.4f}), p_0 = {1e-9 * found.peak:.4f} GPa "
              f"({1e-9 * exact.peak:.4f}), a = {1e3 * found.width:.4f} mm ({1e3 * WIDTH:.4f}), "
              f"c / a = {found.sticking_part:.4f} ({(1.0 - PART) ** (1.0 / 3.0):.4f}), "
              f"displacement {1e6 * found.displacement:.4f} um "
              f"({0.5e6 * exact.displacement(PART):.4f}), "
              f"loss {1e3 * found.loss:.4f} mJ ({0.5e3 * exact.loss(PART):.4f})")
    folder.mkdir(parents=True, exist_ok=True)
    figure(found, folder / "pressed_sphere.png")
    displacement_figure(found, folder / "pressed_sphere_displacement.png")
    plot_shear(found.history, 1, path=folder / "pressed_sphere_shear.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
