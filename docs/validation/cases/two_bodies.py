"""A cylinder on a block, both elastic: Hertz's pressure, and partial slip under a tangential load.

A cylinder of 50 mm is pressed on a block with 1 MN per metre in plane strain, steel on steel and
steel on aluminium. Then the steel cylinder is moved along the steel block by half of the tangential
force at which it slides: for equal materials normal and tangential contact are not coupled, and a
strip of half-width b sqrt(1 - Q/(mu P)) sticks. The gap between both faces is that of their
meshes.

Usage: python two_bodies.py [OUTPUT_FOLDER] [--quick]
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
    Interface,
    Load,
    LoadPath,
    Material,
    Mesh,
    ModalBasis,
    equilibrium,
    load_history,
)
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import reduce_bodies

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RADIUS, DEPTH, LINE_FORCE, MU = 0.05, 0.15, 1e6, 0.3
STEEL, ALUMINIUM = Material(210e9, 0.3, 7850.0), Material(70e9, 0.33, 2700.0)


@dataclass(frozen=True)
class HertzContact:
    """Pressure [Pa] over x [m], with Hertz's half-width b [m] and peak p_0 [Pa]."""

    x: np.ndarray
    pressure: np.ndarray
    half_width: float
    peak: float

    @property
    def found_peak_and_width(self) -> tuple[float, float]:
        """Peak and half-width of the ellipse p^2 = p_0^2 (1 - x^2 / b^2)."""
        inner = self.pressure > 0.3 * self.peak
        slope, top = np.polyfit(self.x[inner] ** 2, self.pressure[inner] ** 2, 1)
        return float(np.sqrt(top)), float(np.sqrt(-top / slope))


@dataclass(frozen=True)
class ShearedContact(HertzContact):
    """The contact after shearing, with the shear stress [Pa]."""

    shear: np.ndarray
    sticks: np.ndarray

    @property
    def sticking_part(self) -> float:
        """Half-width of the strip that sticks over b, by extrapolation.

        With c the half-width of the strip, mu p - q is an ellipse over it:
        (mu p - q)^2 = (mu p_0 c / b)^2 (1 - x^2 / c^2).
        """
        left = (MU * self.pressure - self.shear) ** 2
        near = self.sticks & (left > 0.1 * left.max())
        slope, top = np.polyfit(self.x[near] ** 2, left[near], 1)
        return float(np.sqrt(-top / slope) / self.half_width)


def hertz(cylinder: Material, block: Material) -> tuple[float, float]:
    """Hertz's b = sqrt(4 P' R / (pi E*)) [m] and p_0 = 2 P' / (pi b) [Pa]."""
    compliance = sum((1.0 - one.poisson_ratio**2) / one.youngs_modulus for one in (cylinder, block))
    b = float(np.sqrt(4.0 * LINE_FORCE * RADIUS * compliance / np.pi))
    return b, 2.0 * LINE_FORCE / (np.pi * b)


def graded(fine: float, even: float, end: float) -> np.ndarray:
    """Places from 0 to ``end``: equal steps up to about ``even``, then growing ones."""
    inner = fine * np.arange(round(even / fine) + 1)
    steps = [fine]
    while inner[-1] + sum(steps) < end:
        steps.append(1.25 * steps[-1])
    outer = np.cumsum(steps) * (end - inner[-1]) / sum(steps)
    return np.concatenate([inner, inner[-1] + outer])


def between(x: np.ndarray, low: np.ndarray, high: np.ndarray, parts: np.ndarray,
            near: float) -> Mesh:
    """Quadrilaterals between two curves over x, with the boundaries top, bottom, and near of both.

    ``parts`` (k,) from 0 to 1 are the places of the lines between the curves.
    """
    flat = Mesh.grid(x, parts)
    nodes = flat.nodes.copy()
    nodes[:, 1] = np.interp(nodes[:, 0], x, low) + nodes[:, 1] * np.interp(
        nodes[:, 0], x, high - low)
    lines = {name: flat.boundary(name) for name in ("bottom", "top")}
    lines |= {f"{name} near": edges[np.abs(nodes[edges, 0].mean(axis=1)) < near]
              for name, edges in tuple(lines.items())}
    return Mesh(nodes, flat.cells, lines)


def bodies(cylinder: Material, block: Material, elements: int) -> dict[str, ElasticBody]:
    """Lower half of a cylinder above a block, with so many elements per b at the contact."""
    b, _ = hertz(cylinder, block)
    fine = b / elements
    x, wide = (np.concatenate([-half[:0:-1], half]) for half in (
        graded(fine, 1.7 * b, 0.8 * RADIUS), graded(fine, 1.7 * b, DEPTH)))
    up, down = graded(fine, b, RADIUS), graded(fine, b, DEPTH)
    return {
        "cylinder": ElasticBody(
            between(x, RADIUS - np.sqrt(RADIUS**2 - x**2), np.full_like(x, RADIUS), up / up[-1],
                    1.4 * b), cylinder, plane="strain"),
        "block": ElasticBody(
            between(wide, np.full_like(wide, -DEPTH), np.zeros_like(wide), 1.0 - down[::-1] / DEPTH,
                    1.6 * b), block, plane="strain", fixed={"bottom": "xy"}),
    }


def without_rotation(basis: ModalBasis) -> ModalBasis:
    """The basis of a cylinder that cannot roll, as the tangential force above would make it."""
    turning = np.abs(basis.point_row("C", "phi")[: basis.rigid_modes])
    return basis.select([k for k in range(basis.modes) if k != int(np.argmax(turning))])


def contact(cylinder: Material, block: Material, elements: int) -> ContactSystem:
    """The cylinder pressed on the block by the force at its flat upper side."""
    b, peak = hertz(cylinder, block)
    parts = bodies(cylinder, block, elements)
    pairing = pair_faces(parts, "cylinder.bottom near", "block.top near", nodes_on="face")
    bases = reduce_bodies(parts, [pairing], modes=6, tolerance=0.0, each={"cylinder": {"C": "top"}})
    bases["cylinder"] = without_rotation(bases["cylinder"])
    # So stiff that the bodies alone give way.
    stiff = LinearContact(1e6 * peak / b * pairing.tributary.sum())
    return ContactSystem(
        bodies=bases,
        interfaces=[Interface("line", pairing, stiff, ConstantFriction(MU, smoothing_slope=1e6))],
        load=Load(LINE_FORCE))


def pressed(cylinder: Material, block: Material, elements: int = 12) -> HertzContact:
    """The contact under the line force alone."""
    system = contact(cylinder, block, elements)
    force = equilibrium(system).normal_force
    return HertzContact(system.basis.contact_x, force / system.basis.tributary,
                        *hertz(cylinder, block))


def sheared(elements: int = 12) -> ShearedContact:
    """Steel on steel pressed first, without friction, then sheared by Q = mu P / 2."""
    system = contact(STEEL, STEEL, elements)
    path = LoadPath(forces={"C.x": (0.0, 0.5 * MU * LINE_FORCE)}, steps=10)
    history = load_history(system, path)
    area = system.basis.tributary
    return ShearedContact(
        system.basis.contact_x, history.normal_force[-1] / area, *hertz(STEEL, STEEL),
        history.friction_force[-1] / area, history.contact_state[-1] == ContactState.STICK)


def figure(contact: ShearedContact, path: Path | None = None) -> "Figure":
    """Pressure and shear over the face, with the closed forms."""
    from fecontact.plot import COLOURS, new_figure

    b, scale = contact.half_width, 1e-9
    x = np.linspace(-1.4, 1.4, 801)
    ellipse = np.sqrt(np.maximum(1.0 - x**2, 0.0))
    inner = np.sqrt(np.maximum(0.5 - x**2, 0.0))
    with new_figure(7.0, 4.2, path) as drawn:
        axis = drawn.subplots()
        axis.plot(x, scale * contact.peak * ellipse, color=COLOURS[0], label="Hertz")
        axis.plot(x, scale * contact.peak * MU * (ellipse - inner), color=COLOURS[1],
                  label="Cattaneo")
        for values, colour, label in ((contact.pressure, COLOURS[0], "pressure"),
                                      (np.abs(contact.shear), COLOURS[1], "shear")):
            axis.plot(contact.x / b, scale * values, "o", color=colour, markersize=3.0, label=label)
        axis.set(xlabel="x / b", ylabel="pressure, shear [GPa]", xlim=(-1.4, 1.4))
        axis.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print peak, half-width and sticking part; draw them."""
    elements = 6 if quick else 12
    for name, block in (("steel", STEEL), ("aluminium", ALUMINIUM)):
        found = pressed(STEEL, block, elements)
        peak, width = found.found_peak_and_width
        print(f"steel on {name}: p_0 = {1e-9 * peak:.4f} GPa (Hertz {1e-9 * found.peak:.4f}), "
              f"b = {1e3 * width:.4f} mm (Hertz {1e3 * found.half_width:.4f})")
    last = sheared(elements)
    print(f"steel on steel, Q = mu P / 2: c / b = {last.sticking_part:.4f} "
          f"(Cattaneo {np.sqrt(0.5):.4f})")
    folder.mkdir(parents=True, exist_ok=True)
    figure(last, folder / "two_bodies.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
