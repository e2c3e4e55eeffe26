"""Dimensions of the pendulum of the impact oscillator, three found from three modal numbers.

The source gives the mass reduced to the contact, 0.092 kg, and no bending mode. Periodic, chaotic
and chattering motions come out as reported with a first bending mode at 230.0 Hz whose amplitude
at the contact is 0.600 times that of the rotation, both mass-normalised. Here the length and the
depth of an aluminium arm, 19.6 mm thick, and the side of its square bob are found that give these
three numbers in finite elements. A strip 6 mm long at the middle of the bob touches the stop; the
arm turns about a hole of 4 mm in it.

Usage: python impact_calibration.py [--quick]   (prints the dimensions and what they give)
"""

import sys
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root

from fecontact import ElasticBody, Material, ModalBasis, Pendulum, generate, modal_basis

THICKNESS = 0.0196
TARGET = np.array([0.092, 230.0, 0.600])
FIRST_GUESS = Pendulum(arm_length=0.3, arm_height=0.0077, bob_width=0.033, bob_height=0.033,
                       hinge_radius=0.002, contact_length=0.006)


@dataclass(frozen=True)
class Calibration:
    """A pendulum and its numbers; masses in kg."""

    shape: Pendulum
    reduced_mass: float
    bending_hz: float
    amplitude_ratio: float
    arm_mass: float
    bob_mass: float


def pendulum_basis(body: ElasticBody, modes: int = 4, nodes: int = 3) -> ModalBasis:
    """Modes of the pendulum: rotation, first bending and so on, damped by 3 %."""
    return modal_basis(body, modes, contact_nodes=nodes, damping=0.03)


def modal_numbers(basis: ModalBasis) -> np.ndarray:
    """Mass reduced to the contact [kg], first bending frequency [Hz], amplitude ratio there.

    At the contact a mass-normalised rotation moves by ``1 / sqrt(m)``.
    """
    rotation, bending = basis.contact_T[:, 1, :2].mean(axis=0)
    return np.array([1.0 / rotation**2, basis.frequencies_hz[1], abs(bending / rotation)])


def body_of(shape: Pendulum) -> ElasticBody:
    """The aluminium pendulum, its hole turning rigidly about its centre."""
    return ElasticBody(generate(shape), Material.named("aluminium"), THICKNESS,
                       fixed={"pivot": "hinge"})


def calibrate(target: np.ndarray = TARGET, guess: Pendulum = FIRST_GUESS) -> Calibration:
    """Length and depth of the arm and side of the bob that give three modal numbers."""

    def shape_of(factors: np.ndarray) -> Pendulum:
        length, height, side = factors * [guess.arm_length, guess.arm_height, guess.bob_width]
        return replace(guess, arm_length=length, arm_height=height, bob_width=side,
                       bob_height=side)

    def errors(factors: np.ndarray) -> np.ndarray:
        return modal_numbers(pendulum_basis(body_of(shape_of(factors)), 2, 1)) / target - 1.0

    found = root(errors, np.ones(3), tol=1e-10)
    if not found.success:
        raise RuntimeError(f"No pendulum has the modal numbers {target}: {found.message}")
    # Rounded to a hundredth of a micrometre, so that the dimensions can be written down.
    shape = shape_of(found.x)
    shape = replace(shape, **{name: round(getattr(shape, name), 8) for name in (
        "arm_length", "arm_height", "bob_width", "bob_height")})
    body = body_of(shape)
    area_mass = body.material.density * THICKNESS
    arm = area_mass * shape.arm_height * (shape.arm_length - shape.bob_width / 2)
    return Calibration(shape, *modal_numbers(pendulum_basis(body, 2, 1)), arm,
                       area_mass * shape.bob_width * shape.bob_height)


def main(quick: bool = False) -> None:
    """Print the calibrated pendulum, and how its numbers change with the mesh."""
    found = calibrate(guess=replace(FIRST_GUESS, element_size=0.006) if quick else FIRST_GUESS)
    shape = found.shape
    print(f"arm {1e3 * shape.arm_length:.5f} mm x {1e3 * shape.arm_height:.5f} mm, bob "
          f"{1e3 * shape.bob_width:.5f} mm square; arm up to the bob {found.arm_mass:.4f} kg, bob "
          f"{found.bob_mass:.4f} kg")
    for size in (0.004,) if quick else (0.004, 0.002, 0.001):
        mass, bending, ratio = modal_numbers(
            pendulum_basis(body_of(replace(shape, element_size=size)), 2, 3))
        print(f"elements of {1e3 * size:g} mm: {mass:.6f} kg, {bending:.4f} Hz, {ratio:.6f}")


if __name__ == "__main__":
    main("--quick" in sys.argv)
