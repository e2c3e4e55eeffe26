"""A thin panel between bolted ends: hardening and slip in one nonlinear mode.

A steel strip, 0.3 m long and 1 mm thick, vibrates between two washers. Large deflections stretch
it: the frequency rises with the amplitude. The pull at its ends moves them in the washers, against
friction. Bolts that press hard hold the ends, and the panel hardens without loss. With less force
they slip inwards once, where the pull T reaches friction, T = mu N, and stay there: friction limits
the mean pull and with it the hardening. Where the pull varies by 2 mu N, at 2^(1/2) times that
amplitude, the ends slip in each cycle, which damps the vibration. The mode of a clamped beam
stretches it by 2.439 (a / L)^2, so that slip begins at

    a = L (mu N (1 / (E A) + 2 / (k L)) / 2.439)^(1/2).

The script takes one half of the strip, whose middle moves along y alone. The washers hold the end
along y; along x friction acts, of Jenkins elements with the bolt's force. It

1. reduces the strip with forces of large deflections of its first mode; and
2. follows the first mode over its amplitude for several forces of the bolts.

Usage: python bolted_panel.py [--quick]
"""

import sys

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    NonlinearMode,
    nonlinear_mode,
)
from fecontact.laws import JenkinsFriction, PrescribedForce
from fecontact.reduction import LargeDeflections

LENGTH, THICKNESS, WIDTH, WASHER = 0.3, 1e-3, 0.05, 0.02  # m
COEFFICIENT, STIFFNESS = 0.2, 5e7  # of friction, and tangential stiffness of one end [N/m]
RATIO = 1e-3  # damping ratio of the material
FORCES = (400.0, 800.0, 1600.0, 1e6)  # of the bolt of one end [N]; the last one holds
LARGEST = 2e-3  # amplitude [m]


def half_panel(columns: int) -> fc.ElasticBody:
    """From the washer's edge at x = -WASHER to the middle."""
    x = np.concatenate([np.linspace(-WASHER, 0.0, 5), np.linspace(0.0, 0.5 * LENGTH,
                                                                   columns + 1)[1:]])
    mesh = fc.Mesh.grid(x, np.linspace(0.0, THICKNESS, 3))
    pressed = {
        name: mesh.boundaries[side][mesh.nodes[mesh.boundaries[side], 0].max(axis=1) < 1e-9]
        for name, side in (("contact", "bottom"), ("washer", "top"))}
    mesh = fc.Mesh(mesh.nodes, mesh.cells, {**mesh.boundaries, **pressed}, mesh.points)
    return fc.ElasticBody(mesh, fc.Material.named("steel"), thickness=WIDTH,
                          fixed={"washer": "y", "right": "x"})


def panel(columns: int) -> fc.ModalBasis:
    """Three modes, residual vectors of friction at the end, and forces of large deflections."""
    return fc.modal_basis(
        half_panel(columns), 3, contact_nodes=2, B="", C="", reduction="residual", damping=RATIO,
        points={"middle": (0.5 * LENGTH, 0.5 * THICKNESS)},
        large_deflections=LargeDeflections(1.25 * LARGEST))


def bolted(basis: fc.ModalBasis, force: float) -> fc.ContactSystem:
    """The panel pressed by a bolt [N] at its end."""
    return fc.ContactSystem(basis, PrescribedForce(force),
                            JenkinsFriction(STIFFNESS, COEFFICIENT))


def backbone(system: fc.ContactSystem, samples: int) -> NonlinearMode:
    """The first mode over the amplitude of the middle."""
    return nonlinear_mode(
        system, (2e-5, LARGEST), observe=("middle", "y"),
        method=HarmonicBalance(4, samples, stability=None),
        options=ContinuationOptions(points=400, step=0.05, largest_step=0.15))


def first_slip(force: float) -> float:
    """Amplitude at which the ends begin to slip, in closed form [m]."""
    axial = fc.Material.named("steel").youngs_modulus * THICKNESS * WIDTH
    stretch = COEFFICIENT * force * (1.0 / axial + 2.0 / (STIFFNESS * LENGTH))
    return float(LENGTH * np.sqrt(stretch / 2.439))


def seen_slip(mode: NonlinearMode, held: NonlinearMode) -> tuple[float, float]:
    """Amplitudes [m] at which frequency and damping leave those of held ends."""
    found = []
    for own, other, least in ((-mode.frequency_hz, -held.frequency_hz, 0.2),
                              (mode.damping_ratio, held.damping_ratio, 5e-4)):
        away = own - np.interp(mode.amplitude, held.amplitude, other)
        first = int(np.argmax(away > least))
        found.append(np.interp(least, away[first - 1 : first + 1],
                               mode.amplitude[first - 1 : first + 1]))
    return found[0], found[1]


def main(quick: bool) -> None:
    """Prints frequency and damping at one thickness."""
    basis = panel(10 if quick else 24)
    print(basis.large_deflections[0])
    modes = {}
    for force in FORCES[::3] if quick else FORCES:
        mode = backbone(bolted(basis, force), 64 if quick else 256)
        modes[f"{force:g} N" if force < 1e5 else "held"] = mode
    held = modes["held"]
    hertz = np.interp(THICKNESS, held.amplitude, held.frequency_hz)
    print(f"held: {held.frequency_hz[0]:.2f} Hz, {hertz:.2f} Hz at an amplitude of one thickness")
    for name, mode in modes.items():
        if name != "held" and first_slip(float(name.split()[0])) < 0.6 * LARGEST:
            first, loss = seen_slip(mode, held)
            expected = first_slip(float(name.split()[0]))
            hertz, ratio = mode.frequency_hz[-1], mode.damping_ratio[-1]
            print(f"{name}: slips at {1e3 * first:.3f} mm (closed form {1e3 * expected:.3f} mm), "
                  f"in each cycle from {1e3 * loss:.3f} mm; at {1e3 * LARGEST:g} mm {hertz:.2f} Hz "
                  f"and a damping ratio of {100.0 * ratio:.2f} %")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
