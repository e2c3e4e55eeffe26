"""Two layers clamped at one end and pressed together: what slip between them takes from a cycle.

Goodman and Klumpp's cantilever of two layers, each h high, b wide and L long, under the pressure p
and the end load +-P. In beam theory the shear stress in the interface is the same everywhere: it
slips as a whole at P_s = 4/3 F with F = mu p b h. Stuck, the end moves by L^3 / (2 E b h^3) per
load, slipping four times as much. Thus the end is a spring of stiffness k = E b h^3 / (2 L^3) beside
a slider of the limit F on a spring 3 k, and a cycle loses

    W = 4 F (P - 4/3 F) / k = 8 F L^3 (P - 4/3 F) / (E b h^3)

with the maximum 3/2 P^2 L^3 / (E b h^3) where F = 3/8 P.

Usage: python examples/clamped_layers.py [OUTPUT_FOLDER] [--quick]

L. E. Goodman and J. H. Klumpp, Analysis of slip damping with reference to turbine-blade vibration,
Journal of Applied Mechanics 23 (1956).
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

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
    PointLoad,
    load_history,
)
from fecontact.fem import pair_faces
from fecontact.laws import Constant, ConstantFriction, LinearContact
from fecontact.reduction import reduce_bodies
from fecontact.system.quasistatic.history import LoadHistory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LENGTH, HEIGHT, WIDTH, MU, END_LOAD = 0.5, 0.01, 0.02, 0.3, 300.0
STEEL = Material(210e9, 0.3, 7850.0)
STIFFNESS = STEEL.youngs_modulus * WIDTH * HEIGHT**3 / (2.0 * LENGTH**3)


def slip_theory(limit: np.ndarray | float) -> np.ndarray:
    """Loss per cycle [J] over F = mu p b h [N]."""
    F = np.asarray(limit)
    return np.maximum(4.0 * F * (END_LOAD - 4.0 / 3.0 * F) / STIFFNESS, 0.0)


def layer(y: float, columns: int, rows: int) -> ElasticBody:
    """A layer above y, clamped at x = 0."""
    x, y_of = np.linspace(0.0, LENGTH, columns + 1), y + np.linspace(0.0, HEIGHT, rows + 1)
    nodes = np.stack(np.meshgrid(x, y_of), axis=-1).reshape(-1, 2)
    at = np.arange(len(nodes)).reshape(rows + 1, columns + 1)
    cells = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    lines = {"bottom": at[0], "top": at[-1], "clamp": at[:, 0], "end": at[:, -1]}
    mesh = Mesh(nodes, cells, {name: np.column_stack([line[:-1], line[1:]])
                               for name, line in lines.items()})
    return ElasticBody(mesh, STEEL, thickness=WIDTH, fixed={"clamp": "xy"})


def layers(columns: int = 50, rows: int = 2) -> ContactSystem:
    """Both layers, pressed from above and below, with half of the end load at each."""
    bodies = {"upper": layer(HEIGHT, columns, rows), "lower": layer(0.0, columns, rows)}
    pairing = pair_faces(bodies, "upper.bottom", "lower.top")
    bases = reduce_bodies(
        bodies, [pairing], modes=4, tolerance=0.0, points={"end": "end"},
        each={"upper": {"loads": ["top", "end"]}, "lower": {"loads": ["bottom", "end"]}})
    return ContactSystem(
        bodies=bases,
        # So stiff that the layers do not part in bending.
        interfaces=[Interface("joint", pairing, LinearContact(1e13 * LENGTH * WIDTH),
                              ConstantFriction(MU))],
        load=Load(
            boundaries=tuple(BoundaryLoad(name, pressure=1.0)
                             for name in ("upper.top", "lower.bottom")),
            forces=tuple(PointLoad(f"{name}.end", "y", signal=Constant(0.0)) for name in bases)))


def cycle(system: ContactSystem, limit: float, steps: int = 20) -> LoadHistory:
    """Loaded to P, then a cycle to -P and back, under the pressure with mu p b h = ``limit``."""
    half = [0.0, 0.5 * END_LOAD, -0.5 * END_LOAD, 0.5 * END_LOAD]
    path = LoadPath(load_scale=limit / (MU * WIDTH * HEIGHT), forces=[half, half], steps=steps)
    return load_history(system, path, tangential_ratio=np.inf)


def loss(history: LoadHistory) -> float:
    """Loss over the closed cycle [J]."""
    return float(history.loss[-1] - history.loss[history.row(1)])
