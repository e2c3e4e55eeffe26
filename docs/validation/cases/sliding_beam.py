"""A beam that slides over waves, excited at B and loaded at C: Sextro, section 4.1 in full.

How many contact nodes and modes does it take? Where along the face does friction work, and wear?
Contact nodes stand for equal lengths of the face, so that errors fall with the square of their
number. Modes carry the bending that the waves force upon the beam; residual vectors add what the
contact presses into it locally.

Usage: python sliding_beam.py [--quick]   (half a minute)
"""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fecontact as fc
from fecontact.laws import ArchardWear, ExponentialFriction, RoughSurface

Array = NDArray[np.float64]

LENGTH, HEIGHT, THICKNESS = 0.2, 0.01, 0.02
END_TIME = 0.06


def body(element_size: float = 2.5e-3) -> fc.ElasticBody:
    """The beam, of steel."""
    return fc.ElasticBody(fc.generate(fc.Beam(LENGTH, HEIGHT, element_size)),
                          fc.Material.named("steel"), THICKNESS)


def system(beam: fc.ElasticBody, nodes: int = 40, modes: int = 12, **basis: Any
           ) -> fc.ContactSystem:
    """The beam on moving waves, with numbers of contact nodes and modes."""
    return fc.ContactSystem(
        fc.modal_basis(beam, modes, contact_nodes=nodes, B=fc.Patch("B", 0.004),
                       C=fc.Patch("C", 0.01), points={"end": (LENGTH, HEIGHT / 2)},
                       damping=0.02, **basis),
        normal=RoughSurface(stiffness=5e7, roughness_height=20e-6, damping=2e3),
        friction=ExponentialFriction(static_coefficient=0.5, kinetic_coefficient=0.35,
                                        decay=2.0, smoothing_slope=1e4),
        ground=fc.Ground(speed=2.0, amplitude=30e-6, wavelength=0.12),
        drive=fc.Drive(stiffness_x=2e5, damping_x=50.0, amplitude_x=0.3e-3,
                       frequency_hz=60.0),
        load=fc.Load(normal=400.0),
    )


def run(sliding: fc.ContactSystem, outputs: int = 1201) -> fc.Trajectory:
    """Six hundredths of a second, in which one wave passes below and B swings 3.6 times."""
    return fc.simulate(sliding, END_TIME, outputs=outputs, rtol=1e-7)


def motion(one: fc.Trajectory) -> Array:
    """Displacements that are compared: x of B, y of C, y of the right end, (3, N) [m]."""
    return np.stack([one.displacement("B")[:, 0], one.displacement("C")[:, 1],
                     one.displacement("end")[:, 1]])


def wear(one: fc.Trajectory, parts: int | None = None) -> Array:
    """Friction work per length of the face [J/m], at each node or as means over equal parts."""
    density = one.friction_work[-1] / one.system.basis.tributary
    return density if parts is None else density.reshape(parts, -1).mean(axis=1)


def error(one: fc.Trajectory, reference: fc.Trajectory) -> tuple[float, float]:
    """Errors of the motion (root of the mean square over the swing, the worst) and of the wear."""
    wanted = motion(reference)
    off = np.sqrt(((motion(one) - wanted) ** 2).mean(axis=1)) / np.ptp(wanted, axis=1)
    nodes = one.system.basis.contact_nodes
    expected = wear(reference, nodes)
    return float(off.max()), float(np.abs(wear(one) - expected).mean() / expected.mean())


def main(quick: bool = False) -> None:
    """Print the convergence, energies and wear."""
    beam = body(5e-3 if quick else 2.5e-3)
    finest = run(system(beam, 20 if quick else 160))
    print("nodes   error of motion   of wear along the face")
    for nodes in (5, 10) if quick else (5, 10, 20, 40, 80):
        of_motion, of_wear = error(run(system(beam, nodes)), finest)
        print(f"{nodes:5d}   {of_motion:15.2%}   {of_wear:.2%}")

    complete = run(system(beam, modes=12 if quick else 30, reduction="residual", tolerance=0.02))
    print("\nmodes   error of motion   with residual vectors (coordinates)")
    for modes in (6,) if quick else (4, 6, 8, 12, 20, 30):
        plain = run(system(beam, modes=modes))
        residual = run(system(beam, modes=modes, reduction="residual", tolerance=0.05))
        print(f"{modes:5d}   {error(plain, complete)[0]:15.2%}   "
              f"{error(residual, complete)[0]:.2%} ({residual.system.basis.modes})")

    energies = complete.energies
    print(f"\nIn {END_TIME:g} s the belt's friction puts in "
          f"{energies.belt_friction_work[-1]:.3f} J, its waves {energies.belt_normal_work[-1]:.4f} "
          f"J, the drive {energies.drive_work[-1]:.3f} J; friction takes "
          f"{energies.friction[-1]:.3f} J. The balance is off by {energies.imbalance:.0e}.")
    density = wear(complete)
    x = complete.system.basis.contact_x
    print(f"Friction works {density.min():.1f} to {density.max():.1f} J/m, most at x = "
          f"{1e3 * x[np.argmax(density)]:.0f} mm.")
    # Steel on steel in mild wear.
    depth = complete.wear_depth(ArchardWear(1e-14), THICKNESS)[-1]
    print(f"In mild wear this takes off {1e9 * depth.min():.3f} to {1e9 * depth.max():.3f} nm.")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
