"""Two layers clamped at one end and pressed together: what slip between them takes from a cycle.

Goodman and Klumpp's cantilever of two layers, each h high, b wide and L long, under the pressure p
and the end load +-P. In beam theory the shear stress in the interface is the same everywhere: it
slips as a whole at P_s = 4/3 F with F = mu p b h. Stuck, the end moves by L^3 / (2 E b h^3) per
load, slipping four times as much. Thus the end is a spring k = E b h^3 / (2 L^3) beside a slider of
the limit F on a spring 3 k, and a cycle loses

    W = 4 F (P - 4/3 F) / k = 8 F L^3 (P - 4/3 F) / (E b h^3)

with the maximum 3/2 P^2 L^3 / (E b h^3) where F = 3/8 P. Both layers bend alike, so the pressure
between them stays p: the normal law is a prescribed force.

Usage: python clamped_layers.py [OUTPUT_FOLDER] [--quick]

L. E. Goodman and J. H. Klumpp, Analysis of slip damping with reference to turbine-blade vibration,
Journal of Applied Mechanics 23 (1956).
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    Interface,
    Load,
    LoadPath,
    Material,
    Mesh,
    load_history,
)
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, PrescribedForce
from fecontact.reduction import reduce_bodies
from fecontact.system import LoadHistory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LENGTH, HEIGHT, WIDTH, MU, END_LOAD = 0.5, 0.01, 0.02, 0.3, 300.0
STUCK = 1e14  # tangential stiffness of stuck contacts [N/m^3]
STEEL = Material(210e9, 0.3, 7850.0)
STIFFNESS = STEEL.youngs_modulus * WIDTH * HEIGHT**3 / (2.0 * LENGTH**3)


def slip_theory(limit: np.ndarray | float) -> np.ndarray:
    """Loss per cycle [J] over F = mu p b h [N]."""
    F = np.asarray(limit)
    return np.maximum(4.0 * F * (END_LOAD - 4.0 / 3.0 * F) / STIFFNESS, 0.0)


def layer(y: float, columns: int, rows: int) -> ElasticBody:
    """A layer above y, clamped at x = 0."""
    mesh = Mesh.grid(np.linspace(0.0, LENGTH, columns + 1),
                     y + np.linspace(0.0, HEIGHT, rows + 1))
    return ElasticBody(mesh, STEEL, thickness=WIDTH, fixed={"left": "xy"})


def layers(columns: int = 40, nodes: Literal["all"] | int = 20) -> ContactSystem:
    """Both layers, pressed from above and below, with half of the end load at each."""
    bodies = {"upper": layer(HEIGHT, columns, 2), "lower": layer(0.0, columns, 2)}
    pairing = pair_faces(bodies, "upper.bottom", "lower.top", nodes=nodes)
    bases = reduce_bodies(
        bodies, [pairing], modes=4, tolerance=0.0, points={"end": "right"},
        each={"upper": {"loads": ["top", "end"]}, "lower": {"loads": ["bottom", "end"]}})
    return ContactSystem(
        bodies=bases,
        interfaces=[Interface("joint", pairing, PrescribedForce(1.0), ConstantFriction(MU))],
        load=Load(boundaries=tuple(BoundaryLoad(name, pressure=1.0)
                                   for name in ("upper.top", "lower.bottom"))))


def cycle(system: ContactSystem, limit: float, steps: int = 10) -> LoadHistory:
    """Loaded to P, then a cycle to -P and back, under the pressure with mu p b h = ``limit``.

    Stuck contacts are so stiff that the layers alone give way.
    """
    pressure = limit / (MU * WIDTH * HEIGHT)
    pressed = system.with_({"interfaces.joint.normal.force": pressure * LENGTH * WIDTH})
    half = [0.0, 0.5 * END_LOAD, -0.5 * END_LOAD, 0.5 * END_LOAD]
    ends = {"upper.end.y": half, "lower.end.y": half}
    path = LoadPath(load_scale=pressure, forces=ends, steps=steps)
    return load_history(pressed, path, tangential_stiffness=STUCK * LENGTH * WIDTH, rtol=1e-4)


def loss(history: LoadHistory) -> float:
    """Loss over the closed cycle [J]."""
    return float(history.loss[-1] - history.loss[history.row(1)])


def curve(parts: np.ndarray) -> np.ndarray:
    """Losses [J] at limits F that are these parts of the end load."""
    system = layers()
    return np.array([loss(cycle(system, part * END_LOAD)) for part in parts])


def figure(parts: np.ndarray, losses: np.ndarray, path: Path | None = None) -> "Figure":
    """Loss per cycle over the pressure, beside slip theory."""
    from fecontact.plot import COLOURS, new_figure

    fine = np.linspace(0.0, 0.8, 401)
    with new_figure(7.0, 4.2, path) as drawn:
        axis = drawn.subplots()
        axis.plot(fine, slip_theory(fine * END_LOAD), color=COLOURS[0], label="slip theory")
        axis.plot(parts, losses, "o", color=COLOURS[1], label="two bodies")
        axis.set(xlabel="µ p b h / P", ylabel="loss per cycle [J]", xlim=(0.0, 0.8))
        axis.set_ylim(bottom=0.0)
        axis.legend()
    return drawn


def main(folder: Path = Path("."), quick: bool = False) -> None:
    """Print losses over the pressure and draw them."""
    parts = np.array([0.2, 0.375, 0.6] if quick else [0.05, 0.125, 0.2, 0.3, 0.375, 0.45, 0.55,
                                                      0.65, 0.7, 0.75])
    losses = curve(parts)
    for part, found, wanted in zip(parts, losses, slip_theory(parts * END_LOAD), strict=True):
        print(f"mu p b h / P = {part:.3f}: {found:.4f} J, slip theory {wanted:.4f} J")
    folder.mkdir(parents=True, exist_ok=True)
    figure(parts, losses, folder / "clamped_layers.png")


if __name__ == "__main__":
    given = [value for value in sys.argv[1:] if value != "--quick"]
    main(Path(given[0]) if given else Path("."), "--quick" in sys.argv)
