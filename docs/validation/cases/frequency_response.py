"""Frequency responses of a mass with a friction damper, and of a hardening spring.

Left alone, the mass would resonate at 0.159 Hz; while its Jenkins element sticks, at 0.195 Hz. In
between lies a force level at which the element damps best. The spring that hardens bends its
resonance over: two stable responses at the same frequency, an unstable one between them.

Usage: python frequency_response.py [--quick]
"""

import sys

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    FrequencyResponse,
    HarmonicBalance,
    frequency_response,
    vector_field,
)


def damped_mass() -> fc.ContactSystem:
    """One mass, its spring driven by 1 m, and an element of 0.5 N/m that slides at 1 N."""
    along = np.array([[1.0], [0.0], [0.0]])
    return fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": along[None], "B": along}),
        normal=fc.laws.PrescribedForce(1.0),
        friction=fc.laws.JenkinsFriction(stiffness=0.5, friction_coefficient=1.0),
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=1.0, frequency_hz=0.16))


def hardening(t: float, x: np.ndarray, p: np.ndarray, out: np.ndarray) -> None:
    """A spring that hardens: x'' + .05 x' + x + .1 x^3 = P cos W t."""
    out[0] = x[1]
    out[1] = p[1] * np.cos(p[0] * t) - 0.05 * x[1] - x[0] - 0.1 * x[0] ** 3


def responses(quick: bool) -> tuple[FrequencyResponse, FrequencyResponse]:
    """Responses of the damped mass and of the hardening spring."""
    samples, forces = (256, [0.5, 1.0]) if quick else (512, [0.2, 0.3, 0.5, 0.75, 1.0])
    friction = frequency_response(
        damped_mass(), (0.11, 0.24), levels={"drive.amplitude_x": forces},
        method=HarmonicBalance(harmonics=3 if quick else 7, samples=samples))
    spring = vector_field(hardening, {"W": 0.8, "P": 0.18}, ["x", "v"],
                          period=lambda p: 2.0 * np.pi / p["W"])
    return friction, frequency_response(spring, (0.6, 1.6), "W",
                                        levels={"P": [0.05, 0.1, 0.18]})


def main() -> None:
    """Print the peaks of both responses."""
    quick = "--quick" in sys.argv
    friction, spring = responses(quick)
    print("friction damper: force, frequency [Hz] and amplitude of the peak over the force")
    for level, force in enumerate(friction.levels):
        peak = friction.peak(level)
        print(f"{force:6.2f} {peak.parameter:7.4f} {friction.amplitude(level).max() / force:7.3f}")
    print("hardening spring: force, W [rad/s] and amplitude of the peak, folds")
    for level, force in enumerate(spring.levels):
        folds = ", ".join(f"{point.parameter:.5f}" for point in spring.branches[level].special)
        print(f"{force:6.2f} {spring.peak(level).parameter:7.4f} "
              f"{spring.amplitude(level).max():7.4f}  {folds}")


if __name__ == "__main__":
    main()
