"""A wheel of blades from one sector: nodal diameters, rotation, friction between the blades.

The sector of a plane wheel is a piece of a ring with one blade. Its modes are those of the whole
wheel, by nodal diameters; at speed, waves that run forwards and backwards differ. Then blades
alone, clamped at the root, slide on each other at the tips under engine order m. Pressed hard they
stick: each mode of a blade feels the springs k_t of both contacts,

    4 k_t sin^2(pi m / N),

and between slip and stick friction takes most. One blade stands for the wheel.

Usage: python bladed_wheel.py [--quick]
"""

import sys

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    frequency_response,
)
from fecontact.fem import CyclicSymmetry, Rotation
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.reduction import (
    CyclicBasis,
    PointPairing,
    cyclic_basis_from_bases,
    sector_modes,
)

N, ORDER, SPEED = 12, 4, 900.0  # sectors, engine order, rad/s
INNER, OUTER, TIP = 0.175, 0.20, 0.32  # radii of the ring and of the tips [m]
LENGTH, HEIGHT, DEPTH = 0.12, 0.008, 0.02  # of a blade alone [m]
TANGENTIAL, COEFFICIENT, FORCE = 2e4, 0.4, 1.0  # N/m, friction, N


def sector(columns: int = 8) -> fc.ElasticBody:
    """A piece of the ring with a blade in its middle: the middle columns go on to the tip."""
    angles = np.linspace(0.0, 2.0 * np.pi / N, columns + 1)
    radii = np.concatenate([np.linspace(INNER, OUTER, 4), np.linspace(OUTER, TIP, 9)[1:]])
    number, nodes = {}, []
    inside = range(columns // 2 - 1, columns // 2 + 2)
    for i, r in enumerate(radii):
        for j, angle in enumerate(angles):
            if i < 4 or j in inside:
                number[i, j] = len(nodes)
                nodes.append((r * np.cos(angle), r * np.sin(angle)))
    cells = [[number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
             for i, j in number if {(i + 1, j), (i + 1, j + 1), (i, j + 1)} <= number.keys()]

    def side(j):
        return [[number[i, j], number[i + 1, j]] for i in range(3)]

    return fc.ElasticBody(fc.Mesh(np.array(nodes), cells, {
        "low": side(0), "high": side(columns)}), thickness=DEPTH)


def blades() -> CyclicBasis:
    """A wheel of blades that touch the next one at their tips."""
    mesh = fc.generate(fc.Beam(LENGTH, HEIGHT, 0.5 * HEIGHT))
    blade = fc.modal_basis(fc.ElasticBody(mesh, thickness=DEPTH, fixed={"left": "xy"}), 4,
                           contact=(), B="", C="", damping=2e-3,
                           points={"tip": (LENGTH, 0.5 * HEIGHT)})
    return cyclic_basis_from_bases({"blade": blade}, N, {"tips": PointPairing(
        "blade", "tip", "next_blade", "tip", normals=(1.0, 0.0))})


def system(wheel: CyclicBasis, load: float, frequency_hz: float) -> fc.ContactSystem:
    """The wheel with the tips pressed on each other [N]."""
    return fc.ContactSystem(
        wheel.basis, normal=PrescribedForce(load),
        friction=JenkinsFriction(TANGENTIAL, COEFFICIENT),
        load=fc.Load(forces=(fc.PointLoad("blade.tip", "y", signal=Harmonic(
            FORCE, frequency_hz)),)))


def stuck_hz(basis: fc.ModalBasis) -> float:
    """Frequency of a blade with the springs of both contacts, of the wave of the order."""
    row = basis.point_row("blade.tip", "y")
    stiffness = np.diag(basis.angular_frequencies**2) + (
        4.0 * TANGENTIAL * np.sin(np.pi * ORDER / N) ** 2 * np.outer(row, row))
    return float(np.sqrt(np.linalg.eigvalsh(stiffness)[0])) / (2.0 * np.pi)


def main(quick: bool = False) -> None:
    """Prints frequencies and peaks."""
    symmetry, diameters = CyclicSymmetry("low", "high", N), range(2, N // 2 + 1)
    wheel = sector_modes(sector(), symmetry, 3)
    print("first modes of 2 diameters and more:",
          *(f"{wheel.frequencies_hz[k, 0]:.1f}" for k in diameters), "Hz")
    turning = sector_modes(sector(), symmetry, 16, rotation=Rotation(SPEED)).rotation
    forward, backward = turning.frequencies_hz(SPEED)
    print(f"diameter {ORDER} at {SPEED:g} rad/s: {forward[ORDER, 0]:.1f} Hz forwards, "
          f"{backward[ORDER, 0]:.1f} Hz backwards")

    tips = blades()
    free, stuck = tips.basis.frequencies_hz.min(), stuck_hz(tips.basis)
    bounds = (0.93 * free, 1.04 * stuck)
    method = HarmonicBalance([0, 1, 3], 12 * N, stability=None, repeats=EngineOrder(
        tips, ORDER))
    name = "load.forces.0.signal.frequency_hz"
    loads = np.array([1.0, 4.0, 1000.0]) if quick else np.array(
        [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 1000.0])
    for load in loads:
        found = frequency_response(
            system(tips, load, bounds[0]), bounds, name, observe=("blade.tip", "y"),
            method=method, options=ContinuationOptions(points=1000, largest_step=0.03))
        print(f"{load:6.1f} N: peak {1e6 * found.amplitude().max():.2f} um at "
              f"{found.peak().parameter:.2f} Hz")
    print(f"free {free:.2f} Hz, stuck {stuck:.2f} Hz")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
