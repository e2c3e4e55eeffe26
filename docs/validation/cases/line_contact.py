"""A cylinder on a rigid plane: Hertz's pressure, and partial slip under a tangential load.

The face of an elastic block in plane strain gets the gap x^2 / (2 R) of a cylinder of 50 mm and is
pressed with 1 MN per metre. Then the plane takes half of the tangential force at which everything
would slide: a strip in the middle sticks, its edges slip. With Poisson's ratio near 1/2, normal and
tangential contact on a rigid plane are not coupled, and Cattaneo's half-width b sqrt(1 - Q/(mu P))
holds; for steel they are, and the strip is wider.

Usage: python line_contact.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact import (
    ContactState,
    ContactSystem,
    ElasticBody,
    Load,
    LoadPath,
    Material,
    Mesh,
    ModalBasis,
    load_history,
    modal_basis,
)
from fecontact.laws import ConstantFriction, LinearContact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RADIUS, LINE_FORCE, MODULUS, MU = 0.05, 1e6, 210e9, 0.3


@dataclass(frozen=True)
class LineContact:
    """Pressures [Pa] over x [m] before and after shearing, the shear, and Hertz's b and p_0."""

    x: np.ndarray
    first_pressure: np.ndarray
    pressure: np.ndarray
    shear: np.ndarray
    sticks: np.ndarray
    half_width: float
    peak: float

    @property
    def found_peak_and_width(self) -> tuple[float, float]:
        """Peak and half-width of the ellipse p^2 = p_0^2 (1 - x^2 / b^2) before shearing."""
        inner = self.first_pressure > 0.3 * self.peak
        slope, top = np.polyfit(self.x[inner] ** 2, self.first_pressure[inner] ** 2, 1)
        return float(np.sqrt(top)), float(np.sqrt(-top / slope))

    @property
    def sticking_part(self) -> float:
        """Half-width of the strip that sticks over b, by extrapolation.

        What is left to the limit, (mu p - q)^2, falls like c - |x| towards the ends of the strip.
        """
        left = (MU * self.pressure - self.shear) ** 2
        ends = []
        for side in (-1.0, 1.0):
            near = self.sticks & (side * self.x > 0.35 * self.half_width)
            roots = np.roots(np.polyfit(side * self.x[near], left[near], 2))
            ends.append(min(root.real for root in roots if root.real > 0.35 * self.half_width))
        return float(np.mean(ends) / self.half_width)

    @property
    def uncoupled_part(self) -> float:
        """Half-width of stick over b, 1 - c / b = q(0) / (mu p_0), if p and q are not coupled."""
        middle = np.abs(self.x) < 0.3 * self.half_width
        q, p = (np.polyfit(self.x[middle] ** 2, values[middle], 2)[-1]
                for values in (self.shear, self.pressure))
        return float(1.0 - q / (MU * p))


def half_width(poisson_ratio: float) -> float:
    """Hertz's b = sqrt(4 P' R / (pi E*)) [m] on a rigid plane."""
    stiff = MODULUS / (1.0 - poisson_ratio**2)
    return float(np.sqrt(4.0 * LINE_FORCE * RADIUS / (np.pi * stiff)))


def mesh(b: float, elements: int, size: float) -> Mesh:
    """A block, ``size`` b high and twice as wide, with so many elements per b at the contact."""
    fine = b / elements
    wide = [fine * k for k in range(2 * elements + 1)]
    high, step = [0.0], fine
    while wide[-1] < size * b:
        step *= 1.25
        wide.append(wide[-1] + step)
    step = fine
    while high[-1] < size * b:
        high.append(high[-1] + step)
        step *= 1.25
    x, y = np.array([-value for value in wide[:0:-1]] + wide), np.array(high)
    columns, rows = len(x), len(y)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    first = (np.arange(columns - 1) + columns * np.arange(rows - 1)[:, None]).ravel()
    near = np.flatnonzero(np.abs(x[1:] + x[:-1]) < 3.2 * b)
    edges = np.column_stack([np.arange(columns - 1), np.arange(1, columns)])
    return Mesh(places, np.column_stack([first, first + 1, first + columns + 1, first + columns]),
                boundaries={"contact": edges[near], "top": edges + columns * (rows - 1)})


def without_rotation(basis: ModalBasis) -> ModalBasis:
    """The basis of a block that cannot tip, as the tangential force above the plane would do."""
    turning = np.abs(basis.contact_T[:, 2, : basis.rigid_modes]).max(axis=0)
    return basis.select([k for k in range(basis.modes) if k != int(np.argmax(turning))])


def pressed(poisson_ratio: float, elements: int = 12, size: float = 60.0) -> LineContact:
    """The contact pressed first, without friction, then sheared by Q = mu P / 2."""
    b = half_width(poisson_ratio)
    peak = 2.0 * LINE_FORCE / (np.pi * b)
    body = ElasticBody(mesh(b, elements, size), Material(MODULUS, poisson_ratio), plane="strain")
    basis = without_rotation(modal_basis(body, 6, C="top", reduction="residual", tolerance=0.0))
    system = ContactSystem(
        # So stiff that the body alone gives way.
        basis, LinearContact(1e6 * peak / b * basis.tributary.sum()),
        ConstantFriction(MU, smoothing_slope=1e6),
        load=Load(LINE_FORCE),
        gap=basis.contact_x**2 / (2.0 * RADIUS))
    path = LoadPath(forces={"C.x": (0.0, 0.5 * MU * LINE_FORCE)}, steps=10)
    history = load_history(system, path)
    area = basis.tributary
    first, last = history.normal_force[[0, -1]] / area
    return LineContact(basis.contact_x, first, last, history.friction_force[-1] / area,
                       history.contact_state[-1] == ContactState.STICK, b, peak)


def figure(contact: LineContact, path: Path | None = None) -> "Figure":
    """Pressure and shear over the face, with the closed forms."""
    from fecontact.plot import COLOURS, new_figure

    b, scale = contact.half_width, 1e-9
    x = np.linspace(-1.4, 1.4, 801)
    ellipse = np.sqrt(np.maximum(1.0 - x**2, 0.0))
    part = np.sqrt(0.5)
    inner = part * np.sqrt(np.maximum(1.0 - (x / part) ** 2, 0.0))
    order = np.argsort(contact.x)
    with new_figure(7.0, 4.2, path) as drawn:
        axis = drawn.subplots()
        axis.plot(x, scale * contact.peak * ellipse, color=COLOURS[0], label="Hertz")
        axis.plot(x, scale * contact.peak * MU * (ellipse - inner), color=COLOURS[1],
                  label="Cattaneo")
        for values, colour, label in ((contact.pressure, COLOURS[0], "pressure"),
                                      (contact.shear, COLOURS[1], "shear")):
            axis.plot(contact.x[order] / b, scale * values[order], "o", color=colour,
                      markersize=3.0, label=label)
        axis.set(xlabel="x / b", ylabel="pressure, shear [GPa]", xlim=(-1.4, 1.4))
        axis.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print peak, half-width and sticking part; draw them."""
    elements = 8 if quick else 16
    for ratio in (0.3, 0.49):
        found = pressed(ratio, elements)
        peak, width = found.found_peak_and_width
        print(f"nu = {ratio}: p_0 = {1e-9 * peak:.4f} GPa (Hertz {1e-9 * found.peak:.4f}), "
              f"b = {1e3 * width:.4f} mm (Hertz {1e3 * found.half_width:.4f}), "
              f"c / b = {found.sticking_part if ratio < 0.4 else found.uncoupled_part:.4f}")
    folder.mkdir(parents=True, exist_ok=True)
    figure(found, folder / "line_contact.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
