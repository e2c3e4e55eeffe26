"""A bladed disc with underplatform dampers, from the mesh of one sector: amplitude over preload.

Each blade stands on its piece of the disc and has a platform. Between the platforms of two
neighbours lies a damper, a wedge that the centrifugal force P presses outwards against both. Under
engine order m the wheel answers with a wave, whose harmonic h belongs to the nodal diameter h m.
One sector stands for all: modes by nodal diameters, contact of the damper with the platform of its
own blade and with that of the next one. Each of the two faces carries the normal force
P / (2 cos(a)), with the angle a between its normal and the radius.

With a large load the damper sticks and stiffens the wheel, with a smaller one it slides and takes
energy. Below some 20 N here the centrifugal force no longer holds the wedge between the platforms:
contact opens, the branch of harmonic balance turns at corners, and beside small waves there are
large irregular motions, up to those of a wheel without dampers: its limit for a vanishing load.
``transient`` runs all sectors from rest.

Usage: python platform_damper.py [FOLDER] [--quick]
"""

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    frequency_response,
    wheel_system,
)
from fecontact.fem import CyclicSymmetry, pair_faces
from fecontact.laws import Harmonic, JenkinsFriction, LinearContact
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import CyclicBasis, WholeWheel, cyclic_basis

N, ORDER = 12, 3  # sectors, engine order
ALPHA, SPLIT = 2.0 * np.pi / N, 2e-5  # rad; of the gap between platforms
RADII = (0.18, 0.20, 0.215, 0.23, 0.245)  # disc, and blade up to the platform [m]
TOP, TIP, RISE = 0.275, 0.38, 0.02  # of the platform, of the blade, of its underside [m]
NORMAL, TANGENTIAL, COEFFICIENT = 4e7, 2e7, 0.3  # stiffness of a face [N/m], friction
DASHPOT = 50.0  # across a face [N s/m]
FORCE, RATIO = 2.0, 1e-3  # at the tip [N], modal damping
NAME = "load.forces.0.signal.frequency_hz"


def polar(radius: float, angle: float) -> np.ndarray:
    """Place at a radius and an angle from the x axis."""
    return radius * np.array([np.cos(angle), np.sin(angle)])


def undersides(side: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the line below half a platform: at the blade, and at the next platform."""
    return polar(RADII[-1], side * ALPHA / 8.0), polar(RADII[-1] + RISE, side * ALPHA / 2.0)


def blade_mesh() -> fc.Mesh:
    """Piece of the disc, blade and platform, with the x axis in its middle."""
    number, nodes, cells = {}, [], []
    columns = np.linspace(-0.5, 0.5, 9)

    def node(row: int, column: int, place: np.ndarray) -> None:
        number[row, column] = len(nodes)
        nodes.append(place)

    def fill(row: int, first: int, last: int) -> None:
        cells.extend([number[row, j], number[row + 1, j], number[row + 1, j + 1],
                      number[row, j + 1]] for j in range(first, last))

    for row, radius in enumerate(RADII[:-1]):
        for j in range(9) if row < 2 else (3, 4, 5):
            node(row, j, polar(radius, columns[j] * ALPHA))
    upper = len(RADII) - 1
    for row, outer in ((upper, False), (upper + 1, True)):
        for j, share in enumerate(columns):
            angle = share * (ALPHA - 2.0 * SPLIT)
            start, end = undersides(np.sign(share) or 1.0)
            along = max(0.0, (abs(share) - 0.125) / 0.375)
            if abs(share) == 0.5:
                along -= SPLIT / ALPHA
            inner = (polar(RADII[-1], angle) if abs(share) <= 0.125
                     else start + along * (end - start))
            node(row, j, polar(TOP, angle) if outer else inner)
    for row, radius in enumerate(np.linspace(TOP, TIP, 7)[1:], start=upper + 2):
        for j in (3, 4, 5):
            node(row, j, polar(radius, columns[j] * ALPHA * RADII[-1] / radius))
    fill(0, 0, 8)
    for row in range(1, upper):
        fill(row, 3, 5)
    fill(upper, 0, 8)
    for row in range(upper + 1, upper + 7):
        fill(row, 3, 5)

    def line(row: int, first: int, last: int) -> list[list[int]]:
        return [[number[row, j], number[row, j + 1]] for j in range(first, last)]

    return fc.Mesh(np.array(nodes), cells, {
        "low": [[number[0, 0], number[1, 0]]], "high": [[number[0, 8], number[1, 8]]],
        "bore": line(0, 0, 8), "under_left": line(upper, 0, 3), "under_right": line(upper, 5, 8)},
        {"tip": number[upper + 7, 4]})


def damper_mesh() -> fc.Mesh:
    """A wedge below the gap between this platform and the next one."""
    start, end = undersides(1.0)
    turn = np.array([[np.cos(ALPHA), -np.sin(ALPHA)], [np.sin(ALPHA), np.cos(ALPHA)]])
    left, other = start + 0.35 * (end - start), undersides(-1.0)[0]
    right = turn @ (other + 0.35 * (undersides(-1.0)[1] - other))
    middle = polar(RADII[-1] - 0.004, 0.5 * ALPHA)
    return fc.Mesh(np.array([left, middle, right, end]), [[0, 1, 3], [1, 2, 3]],
                   {"left": [[0, 3]], "right": [[3, 2]]}, {"middle": 1})


def wheel(
    modes: int = 8, damper: str = "rigid", diameters: Iterable[int] | None = None
) -> CyclicBasis:
    """Modes of the sector with its damper, 'rigid' or 'elastic'; diameters of the wave alone."""
    waves = sorted({min(h * ORDER % N, -h * ORDER % N) for h in (0, 1, 3)})
    symmetry = CyclicSymmetry("low", "high", N)
    bodies = {"blade": fc.ElasticBody(blade_mesh(), thickness=0.03, fixed={"bore": "xy"}),
              "damper": fc.ElasticBody(damper_mesh(), thickness=0.03)}
    every = {**bodies, **symmetry.next_sector(bodies)}
    faces = {"own": pair_faces(every, "damper.left", "blade.under_right", nodes=2, nodes_on="face"),
             "next": pair_faces(every, "damper.right", "next_blade.under_left", nodes=2,
                                nodes_on="face")}
    return cyclic_basis(
        bodies, symmetry, faces, modes={"blade": modes, "damper": 3},
        rigid=["damper"] if damper == "rigid" else (), damping=RATIO,
        points={"blade.tip": "tip", "damper.middle": "middle"},
        diameters=waves if diameters is None else diameters)


def system(basis: CyclicBasis, load: float, frequency_hz: float) -> fc.ContactSystem:
    """The sector with dampers pressed outwards by a load [N], excited at the tips."""
    return fc.ContactSystem(
        basis.basis, normal=dict.fromkeys(("own", "next"), LinearContact(NORMAL, damping=DASHPOT)),
        friction=dict.fromkeys(("own", "next"), JenkinsFriction(TANGENTIAL, COEFFICIENT)),
        gap=basis.gaps, load=fc.Load(forces=(
            fc.PointLoad("blade.tip", "y", signal=Harmonic(FORCE, frequency_hz)),
            fc.PointLoad("damper.middle", tuple(polar(1.0, 0.5 * ALPHA)), signal=load))))


def linear(basis: CyclicBasis, *, stuck: bool) -> tuple[float, float]:
    """Lowest resonance [Hz] and amplitude of a tip [m] with dampers that stick, or without any."""
    modes, kept = basis.of(ORDER), slice(None)
    K, C = modes.stiffness, modes.damping
    if not stuck:
        kept = slice(basis.basis.parts[0].modes[1])
        K, C = K[kept, kept], C[kept, kept]
    else:
        normal = np.zeros_like(C)
        rows = modes.T[2 : 2 + basis.basis.contact_nodes]
        for node, share in zip(rows, _shares(basis), strict=True):
            for row, stiffness in ((node[0], TANGENTIAL), (node[1], NORMAL)):
                K = K + share * stiffness * np.outer(row.conj(), row)
            normal = normal + share * np.outer(node[1].conj(), node[1])
        C = C + DASHPOT * normal
    w = np.sqrt(np.linalg.eigvalsh(K)[0])
    tip = modes.T[basis.basis.point_index("blade.tip"), 1, kept]
    dynamic = K - w**2 * np.eye(len(K)) + 1j * w * C
    return float(w) / (2.0 * np.pi), FORCE * abs(tip @ np.linalg.solve(dynamic, tip.conj()))


def transient(
    load: float | None, frequency_hz: float, periods: int, modes: int = 2
) -> np.ndarray:
    """Displacement (n,) of a tip of the whole wheel that starts at rest, 20 times a period.

    With None for the load the dampers are too far away to touch.
    """
    basis = wheel(modes, diameters=range(N // 2 + 1))
    sector = system(basis, load or 0.0, frequency_hz)
    if load is None:
        sector = sector.with_(gap=(np.asarray(basis.gaps) + 1.0).tolist())
    found = fc.simulate(wheel_system(sector, WholeWheel(basis), ORDER), periods / frequency_hz,
                        outputs=20 * periods + 1, rtol=1e-5)
    return np.asarray(found.displacement("0.blade.tip"))[:, 1]


def _shares(basis: CyclicBasis) -> np.ndarray:
    """Share of each contact node in the stiffness of its face."""
    lengths = basis.basis.tributary.reshape(2, -1)
    return (lengths / lengths.sum(axis=1)[:, None]).ravel()


def main(folder: Path = Path(), quick: bool = False) -> None:
    """Prints peaks over the load; a picture in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    basis = wheel()
    (free, without), (stuck, sticking) = (linear(basis, stuck=one) for one in (False, True))
    bounds = (0.99 * free, 1.015 * stuck)
    print(f"no damper: {1e6 * without:.2f} um at {free:.2f} Hz; "
          f"stuck: {1e6 * sticking:.2f} um at {stuck:.2f} Hz")
    loads = [100.0, 3000.0] if quick else [20.0, 30.0, 100.0, 300.0, 1000.0, 3000.0]
    wave, peaks = EngineOrder(basis, ORDER), []
    with new_figure(10.0, 4.4, folder / "platform_damper.png") as figure:
        left, right = figure.subplots(1, 2)
        for load, colour in zip(loads, COLOURS, strict=False):
            found = frequency_response(
                system(basis, load, bounds[0]), bounds, NAME, observe=("blade.tip", "y"),
                options=ContinuationOptions(points=400, largest_step=0.1),
                method=HarmonicBalance([0, 1, 3], 16 * N, stability=None, repeats=wave))
            peak = found.peak()
            peaks.append(1e6 * found.amplitude().max())
            print(f"{load:7.1f} N: peak {peaks[-1]:.2f} um at {peak.parameter:.2f} Hz")
            if not found.peak_reached():
                print(f"  not the whole response: {found.branches[0].status.value}")
            left.semilogy(found.branches[0].parameter, 1e6 * found.amplitude(), color=colour,
                          label=f"{load:g} N")
        left.set(xlabel="frequency [Hz]", ylabel="amplitude of a tip [µm]")
        left.legend(title="load of a damper", fontsize=7)
        right.loglog(loads, peaks, "o-", color=COLOURS[0])
        for amplitude, name in ((without, "without dampers"), (sticking, "stuck")):
            right.axhline(1e6 * amplitude, color=COLOURS[5], linewidth=0.8, linestyle=":")
            right.annotate(name, (loads[0], 1e6 * amplitude), va="bottom")
        right.set(xlabel="load of a damper [N]", ylabel="largest amplitude of a tip [µm]")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
