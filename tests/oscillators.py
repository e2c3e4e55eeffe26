"""The oscillators of sections 3 and 4 of the model, from their numbers."""

import numpy as np

from fecontact import (
    ContactSystem,
    Drive,
    ExponentialFriction,
    Ground,
    Load,
    ModalBasis,
    RoughSurface,
)


def basis(frequencies_hz, damping, B, contact):
    """One contact node; B and contact: (2, m) amplitudes in x and y for a unit mass."""
    w = 2.0 * np.pi * np.array(frequencies_hz)
    T = np.zeros((3, 3, len(w)))
    T[0, :2], T[1, :2], T[2, :2] = B, contact, contact
    return ModalBasis(w, np.diag(2.0 * np.array(damping) * w), T, np.zeros((3, 2)), np.ones(1))


def impact_oscillator(modes=2, w=64.32):
    """A pendulum that strikes a stop: rigid mode, and bending at 230 Hz for modes = 2."""
    shape = np.vstack([np.zeros(modes), np.array([1.0, 0.6])[:modes] / np.sqrt(0.092)])
    return ContactSystem(
        basis([0.0, 230.0][:modes], [0.0, 0.03][:modes], shape, shape),
        normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        drive=Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                    angular_frequency=w))


def friction_oscillator(modes=2, **changes):
    """A block on a belt: rigid modes x and y, and a third at 30 Hz for modes = 3."""
    r = 1.0 / np.sqrt(5.632)
    B = np.array([[r, 0.0, 0.5 * r], [0.0, r, 0.0]])[:, :modes]
    contact = np.array([[r, 0.0, -0.5 * r], [0.0, r, 0.0]])[:, :modes]
    system = ContactSystem(
        basis([0.0, 0.0, 30.0][:modes], [0.0, 0.0, 0.01][:modes], B, contact),
        normal=RoughSurface(10e6, 10e-6, 40.0),
        friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e6), ground=Ground(speed=1e-3),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                    angular_frequency=13.8),
        load=Load(14.0))
    return system.with_(**changes) if changes else system
