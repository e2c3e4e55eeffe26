"""Right-hand side and Jacobian of a contact system: compiled kernels against vectorised numpy.

Usage: python benchmarks/contact_kernels.py [--quick]
"""

import sys
import timeit

import numpy as np
from usage import explain

from fecontact import ContactSystem, Drive, Ground, Load, ModalBasis
from fecontact.laws import ExponentialFriction, RoughSurface


def system(nodes: int, modes: int) -> ContactSystem:
    """Random modes; about half of the nodes are in contact."""
    rng = np.random.default_rng(0)
    basis = ModalBasis(np.linspace(0.0, 1e5, modes), np.eye(modes),
                       rng.normal(size=(nodes + 2, 3, modes)), np.zeros((nodes + 2, 2)),
                       np.ones(nodes))
    return ContactSystem(basis, RoughSurface(0.3e6, 5.2e-6, 6.0),
                         ExponentialFriction(0.8, 0.55, 1e3),
                         load=Load(10.0),
                         ground=Ground(0.1, 1e-6, 1e-2),
                         drive=Drive(stiffness_x=1e3, amplitude_x=1e-3, frequency_hz=1.6))


def numpy_rhs(system: ContactSystem, t: float, y: np.ndarray) -> np.ndarray:
    """Right-hand side of the same equations with numpy, all nodes at once."""
    s, m = system.arrays, system.basis.modes
    q, v = y[:m], y[m:]
    along, away = s.rows[:, 0], s.rows[:, 1]
    x, height, x_rate, height_rate = along @ q, away @ q, along @ v, away @ v
    ground, speed = system.ground, system.ground.speed
    k = 2.0 * np.pi / ground.wavelength
    xi = s.places[:, 0] + x - speed * t
    slip = x_rate - speed
    u = ground.amplitude * np.sin(k * xi) - height - s.gap
    tilt = ground.amplitude * k * np.cos(k * xi)
    rate = tilt * slip - height_rate
    c, R, b = s.normal_parameters.T
    z = u / R
    elastic = c * R * np.where(z <= 0.0, 0.0, np.where(z < 1.0, 0.5 * z * z, z - 0.5))
    F = np.maximum(0.0, elastic + b * np.clip(z, 0.0, 1.0) * rate)
    mu0, mu, decay, slope = s.friction_parameters[:, :4].T
    friction = ((mu0 - mu) * np.exp(-decay * np.abs(slip)) + mu) * F * (
        2.0 / np.pi) * np.arctan(slope * slip)
    drive, w = system.drive, 2.0 * np.pi * system.drive.frequency_hz
    pull = s.drive_stiffness[0] * drive.amplitude_x * np.sin(w * t)
    force = (s.constant_load + pull * s.drive_shapes[0] - s.stiffness @ q - s.damping @ v
             + away.T @ F - along.T @ (friction + F * tilt))
    return np.concatenate([v, force])


def main(quick: bool = False) -> None:
    """Print the table."""
    number, repeat = (20, 2) if quick else (200, 7)
    print(f"{'nodes':>6s} {'modes':>6s} {'numpy rhs [us]':>15s} {'rhs [us]':>9s} {'ratio':>6s} "
          f"{'Jacobian [us]':>14s}")
    for nodes, modes in ((1, 3), (40, 20), (400, 40)):
        tried = system(nodes, modes)
        y = 1e-6 * np.random.default_rng(1).normal(size=2 * modes)
        difference = np.abs(numpy_rhs(tried, 0.3, y) - tried.rhs(0.3, y)).max()
        assert difference < 1e-9 * np.abs(tried.rhs(0.3, y)).max()
        theirs, ours, jacobian = (
            min(timeit.repeat(call, number=number, repeat=repeat)) / number * 1e6
            for call in (lambda s=tried, y=y: numpy_rhs(s, 0.3, y),
                         lambda s=tried, y=y: s.rhs(0.3, y),
                         lambda s=tried, y=y: s.jacobian(0.3, y)))
        print(f"{nodes:6d} {modes:6d} {theirs:15.1f} {ours:9.1f} {theirs / ours:6.1f} "
              f"{jacobian:14.1f}")


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
