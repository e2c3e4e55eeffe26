"""A pad on a belt tips: pressure moves to its leading edge, until the trailing edge lifts off.

Friction mu N below a pad and the springs that hold its top, at the height h above the belt, make
the moment mu N h. In steady sliding the resultant of the pressure therefore acts mu h ahead of the
middle, against the motion of the belt, whatever the pressure looks like. A rigid pad of length L on
a bed of springs has a linear pressure up to mu h = L / 6; beyond, its trailing edge lifts off and
the pressure is a triangle over the length 3 (L / 2 - mu h). A belt that runs askew presses a
corner. The pad is an elastic solid, and a run in time from rest settles where statics say.

Usage: python tipping_pad.py [FOLDER] [--quick]
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.fem import SolidBlock
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import COLOURS, new_figure

LENGTH, WIDTH, HEIGHT = 0.06, 0.036, 0.03  # along x, y, z [m]
LOAD, STIFFNESS, SPEED = 200.0, 2e7, 0.5  # pressing force [N], bed [N/m], belt [m/s]
PATCHES = 10, 6  # contact nodes along x and y


@cache
def pad(modes: int = 12) -> fc.ModalBasis:
    """A steel block, pressed and held at its top; with six modes it is rigid."""
    body = fc.ElasticBody(fc.generate(SolidBlock(LENGTH, WIDTH, HEIGHT, drive_height=HEIGHT,
                                                  element_size=0.006)))
    return fc.modal_basis(body, modes, contact_nodes="all", B="top", C="top", damping=0.01)


def system(friction: float, angle: float = 0.0, modes: int = 12) -> fc.ContactSystem:
    """The pad on a belt that runs at an angle [degrees] to x."""
    a = np.radians(angle)
    return fc.ContactSystem(
        pad(modes), normal=LinearContact(STIFFNESS, damping=3000.0),
        friction=ConstantFriction(friction, smoothing="tanh"),
        ground=fc.Ground(speed=SPEED * np.cos(a), speed_y=SPEED * np.sin(a)),
        drive=fc.Drive(stiffness_x=2e6, stiffness_y=2e6, damping_x=400.0, damping_y=400.0),
        load=fc.Load(normal=LOAD))


def forces(system: fc.ContactSystem) -> tuple[np.ndarray, np.ndarray]:
    """Normal forces (n,) and friction forces (n, 2) of the nodes in steady sliding [N]."""
    sliding = fc.equilibrium(system, "sliding")
    return sliding.normal_force, sliding.friction_forces


def resultant(normal: np.ndarray) -> np.ndarray:
    """Centre of the normal forces, from the middle of the pad (2,) [m]."""
    places = pad().contact_places[:, :2]
    return np.asarray(normal @ places / normal.sum() - [0.5 * LENGTH, 0.5 * WIDTH])


def bed(friction: float, angle: float = 0.0) -> np.ndarray:
    """Normal forces (n,) [N] below a rigid pad on springs that do not pull."""
    places = pad().contact_places[:, :2] - [0.5 * LENGTH, 0.5 * WIDTH]
    shape = np.column_stack([np.ones(len(places)), places])
    a = np.radians(angle)
    wanted = LOAD * np.array([1.0, *(-friction * HEIGHT * np.array([np.cos(a), np.sin(a)]))])
    closed = np.ones(len(places), dtype=bool)
    while True:
        share = STIFFNESS / len(places) * shape[closed]
        depth = shape @ np.linalg.solve(shape[closed].T @ share, wanted)
        if ((depth > 0.0) == closed).all():
            return np.asarray(STIFFNESS / len(places) * np.maximum(depth, 0.0))
        closed = depth > 0.0


def pressure(friction: float, x: np.ndarray) -> np.ndarray:
    """Mean pressure over the width [Pa] at x from the leading edge [m], in closed form."""
    shift, mean = friction * HEIGHT, LOAD / (LENGTH * WIDTH)
    if shift <= LENGTH / 6.0:
        return np.asarray(mean * (1.0 + 12.0 * shift / LENGTH**2 * (0.5 * LENGTH - x)))
    length = 3.0 * (0.5 * LENGTH - shift)
    return np.asarray(2.0 * LOAD / (WIDTH * length) * np.maximum(1.0 - x / length, 0.0))


def plot(frictions: tuple[float, ...], angle: float, path: Path) -> None:
    """Pressure along the pad for some coefficients of friction, and below an askew belt."""
    basis = pad()
    x, y = basis.contact_places[:, :2].T
    order = np.lexsort((y, np.round(x, 6)))
    columns = x[order].reshape(PATCHES)[:, 0]
    fine = np.linspace(0.0, LENGTH, 601)
    with new_figure(9.0, 3.6, path) as figure:
        left, right = figure.subplots(1, 2)
        for friction, colour in zip(frictions, COLOURS, strict=False):
            normal = (forces(system(friction))[0] / basis.tributary)[order].reshape(PATCHES)
            left.plot(1e3 * fine, 1e-3 * pressure(friction, fine), "-", color=colour, lw=1.0)
            left.plot(1e3 * columns, 1e-3 * normal.mean(axis=1), "o", color=colour, ms=4.0,
                      label=f"friction {friction:g}")
        left.set(xlabel="x [mm], belt runs to the right", ylabel="mean pressure [kPa]")
        left.set_ylim(bottom=0.0)
        left.legend()
        friction = frictions[-1]
        normal = forces(system(friction, angle))[0]
        grid = (1e-3 * normal / basis.tributary)[order].reshape(PATCHES).T
        grid = np.ma.masked_equal(grid, 0.0)  # lifted off
        edges = [1e3 * np.linspace(0.0, side, count + 1)
                 for side, count in zip((LENGTH, WIDTH), PATCHES, strict=True)]
        image = right.pcolormesh(*edges, grid, cmap="viridis", vmin=0.0)
        right.grid(visible=False)
        figure.colorbar(image, label="pressure [kPa]")
        middle = 1e3 * np.array([0.5 * LENGTH, 0.5 * WIDTH])
        start = 1e3 * np.array([0.8 * LENGTH, 0.6 * WIDTH])
        way = 8.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        right.annotate("", start + way, start, arrowprops={"arrowstyle": "->", "lw": 1.5})
        right.text(*start, "belt ", ha="right", va="center")
        right.plot(*(middle + 1e3 * resultant(normal)), "o", color="white", mec=COLOURS[0],
                   label="resultant")
        right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal",
                  title=f"belt at {angle:g} degrees, friction {friction:g}")
        right.legend()


def main(folder: Path = Path(), quick: bool = False) -> None:
    """Prints resultants, edges and the end of a run; a picture in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for friction, angle in ((0.1, 0.0), (0.25, 0.0), (0.45, 0.0), (0.45, 35.0)):
        normal, _ = forces(system(friction, angle))
        a = np.radians(angle)
        ahead = -1e3 * resultant(normal) @ [np.cos(a), np.sin(a)]
        misfit = np.abs(normal - bed(friction, angle)).max() / normal.max()
        print(f"friction {friction:g}, belt at {angle:g} degrees: resultant {ahead:.6f} mm ahead, "
              f"{(normal == 0.0).mean():.0%} lifted off, rigid pad to {misfit:.1e}")
    sliding = system(0.45, 35.0)
    run = fc.simulate(sliding, 0.1 if quick else 0.2, outputs=201)
    wanted = forces(sliding)[0]
    away = np.abs(run.normal_force - wanted).max(axis=1) / wanted.max()
    print(f"a run from rest ends {away[-1]:.1e} of the largest force away from statics")
    plot((0.1, 0.25, 0.45), 35.0, folder / "tipping_pad.png")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
