"""One sector of a wheel under engine order beside the whole wheel: time and difference, in one run.

The wheel has the 12 blades and the disc of docs/validation/cases/platform_damper.py. Friction
elements join the sides of the platforms under a constant normal force. The whole wheel has the
modes of all diameters, 12 times the contacts, and follows the same points by the same harmonic
balance.

Usage: python benchmarks/wheel.py [--quick]
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "validation" / "cases"))

import platform_damper as example
from usage import explain

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
    wheel_system,
)
from fecontact.fem import CyclicSymmetry, pair_faces
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.reduction import CyclicBasis, WholeWheel, cyclic_basis

FORCE, NORMAL = 2.0, 20.0  # at a tip, between platforms [N]


def wheel(modes: int) -> CyclicBasis:
    """Modes of the sector with the sides of its platforms paired with those of the next ones."""
    mesh, symmetry = example.blade_mesh(), CyclicSymmetry("low", "high", example.N)
    angles = np.arctan2(*mesh.nodes.T[::-1])[mesh.outline]
    outer = np.linalg.norm(mesh.nodes, axis=1)[mesh.outline].min(axis=1) > example.RADII[1]
    limit = 0.49 * example.ALPHA
    sides = {"left": mesh.outline[outer & (angles < -limit).all(axis=1)],
             "right": mesh.outline[outer & (angles > limit).all(axis=1)]}
    bodies = {"blade": fc.ElasticBody(fc.Mesh(
        mesh.nodes, mesh.cells, {**mesh.boundaries, **sides}, mesh.points), thickness=0.03,
        fixed={"bore": "xy"})}
    every = {**bodies, **symmetry.next_sector(bodies)}
    return cyclic_basis(
        bodies, symmetry, {"platforms": pair_faces(every, "blade.right", "next_blade.left",
                                                   nodes=1)},
        modes=modes, damping=1e-3, points={"blade.tip": "tip"})


def excited_at(system, frequency_hz):
    """The system with all harmonic forces at a frequency."""
    return system.with_({f"load.forces.{number}.signal.frequency_hz": frequency_hz
                         for number in range(example.N)})


def main(quick: bool = False) -> None:
    """Prints times of the same points by one sector and by the whole wheel."""
    basis = wheel(1 if quick else 4)
    free = float(np.sqrt(np.linalg.eigvalsh(basis.of(example.ORDER).stiffness)[0])) / (2.0 * np.pi)
    bounds = (1.01 * free, 1.03 * free)
    options = ContinuationOptions(points=2 if quick else 6, largest_step=0.1)
    harmonics, samples = [0, 1, 3], 48
    system = fc.ContactSystem(
        basis.basis, normal=PrescribedForce(NORMAL), friction=JenkinsFriction(2e7, 0.3),
        gap=basis.gaps, load=fc.Load(forces=(fc.PointLoad(
            "blade.tip", "y", signal=Harmonic(FORCE, bounds[0])),)))
    whole = WholeWheel(basis)
    every = contact_field(wheel_system(system, whole, example.ORDER),
                          {"frequency": (bounds[0], excited_at)})
    wave = EngineOrder(basis, example.ORDER)
    found, times = {}, {}
    for name, one, parameter, point, further in (
            ("one sector", system, example.NAME, "blade.tip", {"repeats": wave}),
            ("whole wheel", every, "frequency", "0.blade.tip", {})):
        method = HarmonicBalance(harmonics, samples, stability=None, **further)
        # Kernels compile in the first response.
        for again in (False, True):
            start = time.perf_counter()
            found[name] = frequency_response(
                one, bounds, parameter, observe=(point, "y"), method=method,
                options=options if again else ContinuationOptions(points=1))
            times[name] = time.perf_counter() - start
        points = len(found[name].branches[0])
        print(f"{name:12s} {points:3d} points {times[name]:8.2f} s")
    first = [abs(one.harmonic(1)[0]) for one in found.values()]
    print(f"ratio of times {times['whole wheel'] / times['one sector']:.1f}, N / 2 = "
          f"{example.N / 2:g}; difference of the first points "
          f"{abs(first[0] / first[1] - 1.0):.2e}; modes of the wheel {whole.modes}")
    assert np.isfinite(first).all()


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
