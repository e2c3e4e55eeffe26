"""Systems whose bifurcations are known, for the tests of this folder."""

import numpy as np

from fecontact import (
    ConstantFriction,
    ContactSystem,
    Drive,
    ExponentialFriction,
    Ground,
    LinearContact,
    Load,
    ModalBasis,
    PrescribedForce,
    ProductFriction,
    basis_from_matrices,
    vector_field,
)
from fecontact.bifurcation.fields.contact_field import contact_field


def lorenz(t, x, p, out):
    out[0] = p[1] * (x[1] - x[0])
    out[1] = x[0] * (p[0] - x[2]) - x[1]
    out[2] = x[0] * x[1] - p[2] * x[2]


def lorenz_field(**options):
    return vector_field(lorenz, {"rho": 2.0, "sigma": 10.0, "b": 8.0 / 3.0}, 3,
                        **options)


def two_masses(D=0.1, gamma=2.5, kappa=2.0, delta=1.0):
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    return basis_from_matrices(
        np.diag([gamma, 1.0]), [[1.0 + kappa, -1.0], [-1.0, 1.0]], {"contact": rows},
        damping=2.0 * D * np.array([[1.0 + delta, -1.0], [-1.0, 1.0]]))


def with_force(system, B):
    return system.with_(**{"normal.force": (B, B)})


def with_damping(system, D):
    return system.with_(basis=two_masses(D))


def two_mass_system(B=1.0, speed=1.0):
    return ContactSystem(two_masses(), normal=PrescribedForce((B, B)),
                         friction=ProductFriction(), ground=Ground(speed=speed))


def two_mass_field(B=1.0, speed=1.0):
    return contact_field(two_mass_system(B, speed),
                         {"B": (B, with_force), "ground.speed": None})


def friction_slope(v):
    """d mu / dv of (4.4-9) at v > 0."""
    fall = np.exp(-2.0 * v)
    return 0.14 * (-2.28 * fall * np.arctan(100.0 * v)
                   + (1.0 + 1.14 * fall) * 100.0 / (1.0 + (100.0 * v) ** 2))


def two_mass_jacobian(B, v0, D=0.1):
    """Of x1, x2, x3, x4, straight from the equations of section 4.4."""
    s = B * friction_slope(v0)
    return np.array([[0.0, 1.0, 0.0, 0.0],
                     [-3.0 / 2.5, (-4.0 * D - s) / 2.5, 1.0 / 2.5, 2.0 * D / 2.5],
                     [0.0, 0.0, 0.0, 1.0],
                     [1.0, 2.0 * D, -1.0, -2.0 * D - s]])


def belt(slope=1e6, speed=12e-3):
    """The friction oscillator of section 4 with one mode, constant normal force and no drive."""
    m = 5.632
    T = np.zeros((3, 3, 1))
    T[[0, 2], 0] = m**-0.5
    basis = ModalBasis(np.zeros(1), np.zeros((1, 1)), T, np.zeros((3, 2)), np.ones(1))
    return ContactSystem(basis, normal=PrescribedForce(14.0),
                         friction=ExponentialFriction(0.8, 0.55, 1000.0, slope),
                         ground=Ground(speed=speed),
                         drive=Drive(stiffness_x=5610.0, damping_x=0.768))


def mode_coupling(damping=0.0, mu=0.1):
    """Hoffmann's model as a contact system: x and y of one mass, a contact spring of 4/3."""
    rows = np.zeros((1, 3, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), [[2.0, 1.0], [1.0, 2.0 / 3.0]],
                                {"contact": rows, "C": rows[0]},
                                damping=damping * np.eye(2))
    return ContactSystem(basis, normal=LinearContact(4.0 / 3.0),
                         friction=ConstantFriction(mu, 1e9), ground=Ground(speed=-100.0),
                         load=Load(1.0))
