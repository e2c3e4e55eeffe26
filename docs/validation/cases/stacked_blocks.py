"""A patch test: uniform pressure passes from one elastic block to another.

Two blocks stand on each other and are pressed from above, without friction. The stress must be the
pressure everywhere: to round-off where the meshes match, with an error that this prints where they
do not. Contact nodes at the nodes of a face load the other face unevenly then; segments with mean
displacements, fewer than either mesh has elements, load both evenly.

Usage: python stacked_blocks.py
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact import (
    BoundaryLoad,
    ContactSystem,
    ElasticBody,
    Interface,
    Load,
    Material,
    Mesh,
    equilibrium,
)
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import reduce_bodies

WIDTH, HEIGHT, PRESSURE = 0.10, 0.04, 1e7
STEEL = Material(210e9, 0.3, 7850.0)


@dataclass(frozen=True)
class Patch:
    """The pressed blocks at rest.

    Attributes
    ----------
    system : ContactSystem
        Both blocks.
    q : (m,) array
        Modal coordinates.
    force : (n,) array
        Normal forces of the contact nodes [N].
    stress_error : float
        Largest error of a stress component at a node, over the pressure.
    """

    system: ContactSystem
    q: np.ndarray
    force: np.ndarray
    stress_error: float


def block(y: float, columns: int, rows: int, **support: str) -> ElasticBody:
    """A block above y that may spread over x, of so many elements."""
    mesh = Mesh.grid(np.linspace(0.0, WIDTH, columns + 1),
                     y + np.linspace(0.0, HEIGHT, rows + 1))
    return ElasticBody(mesh, STEEL, thickness=0.02, fixed={"left": "x", **support})


def pressed(
    above: tuple[int, int], below: tuple[int, int], nodes: Literal["all"] | int = "all"
) -> Patch:
    """Blocks of so many elements in x and y, with contact nodes at mesh nodes or on segments."""
    bodies = {"upper": block(HEIGHT, *above), "lower": block(0.0, *below, bottom="y")}
    pairing = pair_faces(bodies, "upper.bottom", "lower.top", nodes=nodes)
    bases = reduce_bodies(bodies, [pairing], modes=4, tolerance=0.0,
                          each={"upper": {"loads": ["top"]}})
    system = ContactSystem(
        bodies=bases,
        interfaces=[Interface("joint", pairing, LinearContact(1e12), ConstantFriction(0.0))],
        load=Load(boundaries=(BoundaryLoad("upper.top", pressure=PRESSURE),)))
    rest = equilibrium(system)
    stress = system.basis.fields(rest.modal_coordinates).stress / PRESSURE
    # xx, yy, zz, xy
    error = np.abs(stress - [0.0, -1.0, 0.0, 0.0]).max()
    return Patch(system, rest.modal_coordinates, rest.normal_force, float(error))


CASES: tuple[tuple[str, tuple[int, int], tuple[int, int], Literal["all"] | int], ...] = (
    ("matching meshes", (8, 3), (8, 4), "all"),
    ("9 elements on 6, contact nodes at mesh nodes", (9, 3), (6, 3), "all"),
    ("9 elements on 6, 5 segments", (9, 3), (6, 3), 5))


def main() -> None:
    """Print the error of the stress."""
    for name, above, below, nodes in CASES:
        print(f"{name}: stress to {pressed(above, below, nodes).stress_error:.1e} of the pressure")


if __name__ == "__main__":
    main()
