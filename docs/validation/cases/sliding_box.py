"""A steel box whose faces slide: how fast the frequencies of solid elements converge.

Each of the six faces slides along a wall without friction: no displacement along its normal, no
shear. Standing waves with wave numbers k = pi |(i/a, j/b, l/c)| then fit in exactly, transverse
ones with w = c_T k and longitudinal ones with w = c_L k, and there are no singularities: relative
errors of frequencies fall like h^2 with linear elements and like h^4 with quadratic ones.

The supports of the thick plate NAFEMS FV52, in contrast, are lines, on which stresses are infinite:
its frequencies go on falling with finer meshes and are compared on a coarse one. The published ones
are those of Mindlin's plate whose edges do not move along themselves either. With sides held like
this the solid has standing Lamb waves, and its frequencies converge to those.

Usage: python sliding_box.py [OUTPUT_FOLDER] [--quick]
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.optimize import brentq

from fecontact import ElasticBody, Material, generate, modal_basis
from fecontact.fem import Plate, SolidBlock
from fecontact.reduction import eigenfrequencies_hz

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEEL = Material(youngs_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
SIDES = (0.3, 0.2, 0.1)  # m
WALLS = {"left": "x", "right": "x", "front": "y", "back": "y", "contact": "z", "top": "z"}
ELEMENTS: dict[str, tuple[Literal["tetrahedron", "hexahedron"], int]] = {
    "P1": ("tetrahedron", 1), "Q1": ("hexahedron", 1), "P2": ("tetrahedron", 2),
    "Q2": ("hexahedron", 2)}
PLATE_STEEL = Material(2e11, 0.3, 8000.0)
PLATE_SIDE, PLATE_HEIGHT = 10.0, 1.0  # m
# Supports of the plate: lines along its bottom edges, its sides along z, or these across too.
SUPPORTS = {"lines": {"bottom_edges": "z"},
            "sides": dict.fromkeys(("left", "right", "front", "back"), "z"),
            "walls": {"left": "yz", "right": "yz", "front": "xz", "back": "xz"}}
BENDING = ((1, 1), (1, 2), (2, 2), (1, 3))  # half waves of modes 4, 5 and 6, 7, 9 and 10
PLATE_HZ = (45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19)


@dataclass(frozen=True)
class Wave:
    """A standing wave with so many half waves along each side.

    Transverse ones move across the wave number; with waves along all three sides there are two.
    """

    halves: tuple[int, int, int]
    longitudinal: bool = False

    @property
    def wave_number(self) -> np.ndarray:
        """Wave numbers k (3,) along x, y and z [1/m]."""
        return np.pi * np.array(self.halves) / SIDES

    @property
    def frequency_hz(self) -> float:
        """Frequency c k / (2 pi) [Hz] with c^2 = G / rho, longitudinal (lambda + 2 G) / rho."""
        nu = STEEL.poisson_ratio
        modulus = STEEL.youngs_modulus / (2.0 * (1.0 + nu))
        if self.longitudinal:
            modulus *= (2.0 - 2.0 * nu) / (1.0 - 2.0 * nu)
        return float(np.sqrt(modulus / STEEL.density) * np.linalg.norm(self.wave_number)
                     / (2.0 * np.pi))

    def shapes(self, places: np.ndarray) -> np.ndarray:
        """Displacements (N, 3, s) of the s waves of this frequency at places (N, 3) [m]."""
        k = self.wave_number
        phase = places * k
        across = np.stack([np.prod([np.sin(phase[:, i]) if i == j else np.cos(phase[:, i])
                                    for i in range(3)], axis=0) for j in range(3)], axis=1)
        if self.longitudinal:
            return (across * k)[:, :, None]
        # Directions across k, along which the wave moves at all.
        moving = np.eye(3)[:, k > 0.0]
        _, _, turned = np.linalg.svd((k @ moving)[None])
        return across[:, :, None] * (moving @ turned[1:].T)


WAVES = {"transverse (1, 1, 0)": Wave((1, 1, 0)), "longitudinal (1, 0, 0)": Wave((1, 0, 0), True),
         "transverse (1, 1, 1)": Wave((1, 1, 1))}


def box(element: str, cells: int) -> ElasticBody:
    """The box with so many cells along its shortest side, an even number."""
    kind, degree = ELEMENTS[element]
    shape = SolidBlock(*SIDES, element_size=SIDES[2] / cells, element=kind)
    return ElasticBody(generate(shape), STEEL, degree=degree, fixed=WALLS)


def frequencies_hz(body: ElasticBody) -> dict[str, np.ndarray]:
    """Frequencies [Hz] of the modes that are most like each of the waves."""
    basis = modal_basis(body, 20, contact=())
    shapes = basis.mode_shapes
    assert shapes is not None
    modes = shapes.shapes.reshape(-1, basis.modes)
    found = {}
    for name, wave in WAVES.items():
        exact = wave.shapes(body.nodes).reshape(len(modes), -1)
        load = body.mass @ exact
        alike = ((modes.T @ load) ** 2 / (exact * load).sum(axis=0)).sum(axis=1)
        found[name] = np.sort(basis.frequencies_hz[np.argsort(-alike)[: exact.shape[1]]])
    return found


def errors(element: str, cells: Sequence[int]) -> dict[str, np.ndarray]:
    """Relative errors of the frequencies, the largest of equal ones, on each of the meshes."""
    found = [frequencies_hz(box(element, count)) for count in cells]
    return {name: np.array([one[name].max() / wave.frequency_hz - 1.0 for one in found])
            for name, wave in WAVES.items()}


def rate(cells: Sequence[int], values: np.ndarray) -> float:
    """Power of the element size with which errors fall between the last two meshes."""
    return float(np.log(values[-2] / values[-1]) / np.log(cells[-1] / cells[-2]))


def plate(size: float, layers: int, supports: str = "lines") -> ElasticBody:
    """The plate of NAFEMS FV52 for an element size [m] and supports."""
    return ElasticBody(generate(Plate(PLATE_SIDE, PLATE_SIDE, PLATE_HEIGHT, size, layers)),
                       PLATE_STEEL, fixed=SUPPORTS[supports])


def plate_hz(size: float, layers: int) -> np.ndarray:
    """Frequencies (7,) of NAFEMS FV52 after three rigid motions [Hz], for an element size [m]."""
    return eigenfrequencies_hz(plate(size, layers), 10)[3:]


def bending_hz(size: float, layers: int, supports: str) -> np.ndarray:
    """Frequencies (4,) of the modes ``BENDING`` [Hz]."""
    basis = modal_basis(plate(size, layers, supports), 16, contact=())
    shapes = basis.mode_shapes
    assert shapes is not None
    upwards = shapes.shapes[:, 2]
    phase = np.pi / PLATE_SIDE * shapes.nodes[:, :2]
    found = []
    for a, b in BENDING:
        waves = [np.sin(m * phase[:, 0]) * np.sin(n * phase[:, 1]) for m, n in ((a, b), (b, a))]
        part = sum((wave @ upwards) ** 2 for wave in waves) / (shapes.shapes**2).sum(axis=(0, 1))
        found.append(basis.frequencies_hz[np.argmax(part)])
    return np.array(found)


def lamb_hz(halves: tuple[int, int]) -> float:
    """Frequency of the plate between walls [Hz], the lowest root of Rayleigh's and Lamb's equation.

    With k = pi |(m, n)| / a, p^2 = k^2 - (w / c_L)^2, q^2 = k^2 - (w / c_T)^2 it is
    (q^2 + k^2)^2 tanh(p h / 2) = 4 k^2 p q tanh(q h / 2).
    """
    E, nu, rho = (PLATE_STEEL.youngs_modulus, PLATE_STEEL.poisson_ratio, PLATE_STEEL.density)
    slow = np.sqrt(E / (2.0 * (1.0 + nu)) / rho)
    fast = slow * np.sqrt((2.0 - 2.0 * nu) / (1.0 - 2.0 * nu))
    k, half = np.pi * np.hypot(*halves) / PLATE_SIDE, 0.5 * PLATE_HEIGHT

    def balance(w: float) -> float:
        p, q = np.sqrt(k**2 - (w / fast) ** 2), np.sqrt(k**2 - (w / slow) ** 2)
        return float((q**2 + k**2) ** 2 * np.tanh(p * half)
                     - 4.0 * k**2 * p * q * np.tanh(q * half))

    return float(brentq(balance, 0.1 * slow * k, (1.0 - 1e-12) * slow * k, xtol=1e-9)
                 / (2.0 * np.pi))


def mindlin_hz(halves: tuple[int, int]) -> float:
    """Frequency of the plate [Hz] by Mindlin's theory with his shear factor pi^2 / 12."""
    E, nu, rho = (PLATE_STEEL.youngs_modulus, PLATE_STEEL.poisson_ratio, PLATE_STEEL.density)
    h, k2 = PLATE_HEIGHT, (np.pi * np.hypot(*halves) / PLATE_SIDE) ** 2
    shear, bending = np.pi**2 / 12.0 * E / (2.0 * (1.0 + nu)), E * h**3 / (12.0 * (1.0 - nu**2))
    inertia = rho * h**3 / 12.0
    # (k^2 - rho w^2 / shear) (bending k^2 - inertia w^2) = rho h w^2
    roots = np.roots([rho / shear * inertia,
                      -(k2 * inertia + bending * k2 * rho / shear + rho * h), bending * k2**2])
    return float(np.sqrt(roots.min()) / (2.0 * np.pi))


def meshes(element: str, quick: bool = False) -> tuple[int, ...]:
    """Cells along the shortest side of the meshes that are compared."""
    if quick:
        return 2, 4
    return (2, 4, 8) if ELEMENTS[element][1] == 1 else (2, 4, 6)


def figure(found: dict[str, tuple[Sequence[int], dict[str, np.ndarray]]], path: Path | None = None
           ) -> "Figure":
    """Errors of the elements over the element size, with lines of the expected powers."""
    from fecontact.plot import COLOURS, new_figure

    with new_figure(8.0, 3.6, path) as drawn:
        axes = drawn.subplots(1, len(WAVES), sharey=True)
        for axis, name in zip(axes, WAVES, strict=True):
            for colour, (element, (cells, values)) in zip(COLOURS, found.items(), strict=False):
                sizes = 1e3 * SIDES[2] / np.array(cells)
                axis.loglog(sizes, values[name], "o", color=colour, label=element)
                power = 2 * ELEMENTS[element][1]
                axis.loglog(sizes, values[name][-1] * (sizes / sizes[-1]) ** power, color=colour,
                            lw=1.0)
            axis.set(title=name, xlabel="element size [mm]", xticks=[12.5, 25, 50],
                     xticklabels=["12.5", "25", "50"])
            axis.minorticks_off()
        axes[0].set_ylabel("relative error of the frequency")
        axes[2].legend(title="lines: h², h⁴", loc="lower right")
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print errors and rates, and the frequencies of the plate; draw the errors."""
    for name, wave in WAVES.items():
        print(f"{name}: {wave.frequency_hz:.3f} Hz")
    found = {}
    for element in ELEMENTS:
        cells = meshes(element, quick)
        found[element] = cells, errors(element, cells)
        for name, values in found[element][1].items():
            print(f"{element}, {name}: error {values[-1]:.2e} with elements of "
                  f"{1e3 * SIDES[2] / cells[-1]:.1f} mm, falls like h^{rate(cells, values):.2f}")
    found_hz = plate_hz(2.5, 1)
    worst = np.abs(found_hz / PLATE_HZ - 1.0).max()
    print("NAFEMS FV52, 4 x 4 x 1 elements:", *(f"{value:.2f}" for value in found_hz),
          f"Hz, at most {100.0 * worst:.1f} % off")
    if not quick:
        first = [plate_hz(size, layers)[0] for size, layers in ((2.5, 1), (1.25, 2), (0.625, 4))]
        print("finer meshes: the first one falls,", *(f"{value:.2f}" for value in first), "Hz")
        for supports in SUPPORTS:
            print(f"bending modes on {supports}:",
                  *(f"{value:.2f}" for value in bending_hz(1.25, 2, supports)), "Hz")
    print("Lamb waves:", *(f"{lamb_hz(halves):.2f}" for halves in BENDING), "Hz, Mindlin's plate:",
          *(f"{mindlin_hz(halves):.2f}" for halves in BENDING), "Hz")
    folder.mkdir(parents=True, exist_ok=True)
    figure(found, folder / "sliding_box.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
