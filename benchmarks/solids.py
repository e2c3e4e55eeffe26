"""Cost of contact in space: a solid with many contact nodes beside a plane body with as many.

A plane beam and a solid bar of the same material lie on a belt, clamped at one end, pressed and
shaken. Time per accepted step with 40 modes and 400 (or given numbers of) contact nodes.

Usage: python benchmarks/solids.py [nodes ...] [--quick]
"""

import sys
import time

import numpy as np
from usage import explain

from fecontact import (
    Beam,
    ContactSystem,
    ElasticBody,
    Ground,
    Load,
    PointLoad,
    generate,
    modal_basis,
    simulate,
)
from fecontact.fem import SolidBlock
from fecontact.laws import ExponentialFriction, Harmonic, RoughSurface

LENGTH, HEIGHT, WIDTH = 0.2, 0.01, 0.05
PARTS = {"normal": RoughSurface(2e9, 20e-6, 1e4),
         "friction": ExponentialFriction(0.6, 0.3, decay=3.0, smoothing_slope=1e4)}


def plane(modes: int, nodes: int) -> ContactSystem:
    """The beam."""
    mesh = generate(Beam(length=LENGTH, height=HEIGHT, element_size=LENGTH / nodes))
    body = ElasticBody(mesh, thickness=WIDTH, fixed={"left": "xy"})
    basis = modal_basis(body, modes, contact_nodes=nodes, B="", C="top", damping=0.01)
    return ContactSystem(basis, ground=Ground(speed=0.5), load=Load(
        500.0, (PointLoad("C", "x", signal=Harmonic(100.0, 127.0)),)), **PARTS)


def solid(modes: int, nodes: int) -> ContactSystem:
    """The bar; four times as many nodes along it as across."""
    across = max(round(0.5 * np.sqrt(nodes)), 1)
    size = min(HEIGHT, LENGTH / (nodes // across))
    mesh = generate(SolidBlock(LENGTH, WIDTH, HEIGHT, element_size=size))
    body = ElasticBody(mesh, fixed={"left": "xyz"})
    basis = modal_basis(body, modes, contact_nodes=(nodes // across, across), B="", C="top",
                        damping=0.01)
    return ContactSystem(basis, ground=Ground(speed=0.5, speed_y=0.1), load=Load(
        500.0, (PointLoad("C", "x", signal=Harmonic(100.0, 127.0)),)), **PARTS)


def main(nodes: list[int], quick: bool = False) -> None:
    """Print the table: least processor time of a step in rounds of both in turn."""
    modes, t_end, rounds = (6, 2e-4, 1) if quick else (40, 2e-3, 5)
    print(f"{'modes':>5s} {'nodes':>5s} {'plane':>11s} {'solid':>14s} {'ratio':>9s}")
    for count in nodes or ([8] if quick else [40, 100, 400]):
        systems = (plane(modes, count), solid(modes, count))
        best = [np.inf, np.inf]
        for turn in range(rounds + 1):  # the first loads what is compiled
            for k, system in enumerate(systems):
                begin = time.process_time()
                run = simulate(system, t_end, outputs=2)
                spent = time.process_time() - begin
                if turn > 0:
                    best[k] = min(best[k], 1e6 * spent / run.statistics["steps"])
        size = systems[1].basis.contact_nodes
        print(f"{modes:5d} {size:5d} {best[0]:11.1f} us {best[1]:11.1f} us "
              f"{best[1] / best[0]:6.2f}", flush=True)


if __name__ == "__main__":
    explain(__doc__)
    main([int(word) for word in sys.argv[1:] if word != "--quick"], "--quick" in sys.argv)
