"""Do contact forces converge as the mesh and the number of contact nodes grow?

A steel beam, 200 mm x 20 mm, is pressed on the ground with 5 kN at its top, mid-span, and drawn
along it. With loads and contact nodes spread over lengths of the outline, deflection, pressure
and the sliding and sticking parts of the face settle; with a load on a single mesh node the
deflection under it grows with every refinement, as that of the continuum is infinite.

Usage: python contact_convergence.py [--quick]   (prints the tables of docs/convergence.md)
"""

import sys
from dataclasses import dataclass

import numpy as np

from fecontact import (
    Beam,
    ContactState,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    Load,
    Patch,
    equilibrium,
    generate,
    modal_basis,
    simulate,
)
from fecontact.laws import ExponentialFriction, RoughSurface

LENGTH, HEIGHT = 0.2, 0.02


@dataclass(frozen=True)
class Row:
    """Results on one mesh; lengths in m, forces in N."""

    element_size: float
    nodes: int
    modes: int
    deflection: float
    peak_pressure: float  # [Pa]
    contact_share: float
    middle_force: float
    stick_share: float = float("nan")
    slipped: float = float("nan")


def system(element_size: float, nodes: int, *, spread: bool = True,
           tolerance: float = 0.0) -> ContactSystem:
    """The beam with a number of contact nodes; its load spread over 20 mm, or on one node."""
    body = ElasticBody(generate(Beam(LENGTH, HEIGHT, element_size)), thickness=0.01)
    basis = modal_basis(
        body, 10, contact_nodes=nodes, reduction="residual", tolerance=tolerance, damping=0.02,
        B=Patch("B", 0.005) if spread else "B", C=Patch("C", 0.01) if spread else "C")
    return ContactSystem(
        basis,
        normal=RoughSurface(stiffness=1e9, roughness_height=5e-6, damping=2e4),
        friction=ExponentialFriction(static_coefficient=0.5, kinetic_coefficient=0.4, decay=20.0,
                                     smoothing_slope=1e4),
        ground=Ground(speed=0.02),
        drive=Drive(stiffness_x=2e6, damping_x=200.0, amplitude_x=4e-4, frequency_hz=95.0),
        load=Load(normal=5000.0),
    )


def row(element_size: float, nodes: int, *, spread: bool = True, moving: bool = False) -> Row:
    """Steady sliding of the pressed beam, and with ``moving`` two periods of a drive of 95 Hz."""
    pressed = system(element_size, nodes, spread=spread)
    basis = pressed.basis
    sliding = equilibrium(pressed, "sliding")
    force = sliding.normal_force
    middle = np.abs(basis.contact_x - LENGTH / 2) < LENGTH / 10
    share = basis.tributary / LENGTH
    stick = slipped = float("nan")
    if moving:
        reduced = system(element_size, nodes, spread=spread, tolerance=0.05)
        run = simulate(reduced, 2.0 / 95.0, initial="sliding", outputs=801, rtol=1e-5)
        stick = float(((run.contact_state == ContactState.STICK).mean(axis=0) * share).sum())
        slipped = float(run.displacement("B")[:, 0].max())
    return Row(element_size, nodes, basis.modes, -float(sliding.displacement("C")[1]),
               float((force / basis.contact_areas).max()), float(share[force > 0.0].sum()),
               float(force[middle].sum()), stick, slipped)


def main(quick: bool = False) -> None:
    """Print the tables."""
    meshes = ((0.010, 10), (0.005, 20), (0.0025, 40), (0.00125, 80))[: 2 if quick else 4]
    print("| element [mm] | nodes | coordinates | deflection at the load [um] | peak pressure "
          "[MPa] | face in contact | force on the middle fifth [N] | sticking | "
          "largest x of B [um] |")
    print("|" + "---|" * 9)
    for size, nodes in meshes:
        r = row(size, nodes, moving=nodes <= (10 if quick else 40))
        print(f"| {1e3 * size:g} | {nodes} | {r.modes} | {1e6 * r.deflection:.3f} | "
              f"{1e-6 * r.peak_pressure:.3f} | {r.contact_share:.1%} | {r.middle_force:.1f} | "
              f"{r.stick_share:.1%} | {1e6 * r.slipped:.2f} |".replace("nan%", "-")
              .replace("nan", "-"))
    print("\n| element [mm] | deflection under a load on one node [um] |\n|---|---|")
    for size, _ in meshes:
        print(f"| {1e3 * size:g} | {1e6 * row(size, 20, spread=False).deflection:.3f} |")


if __name__ == "__main__":
    main("--quick" in sys.argv)
