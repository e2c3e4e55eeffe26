"""Systems that several tests share: oscillators of the literature and a beam."""

import numpy as np
from meshes_for_tests import rectangle
from scipy.optimize import brentq

from fecontact import (
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    Load,
    Material,
    ModalBasis,
    basis_from_matrices,
    modal_basis,
)
from fecontact.bifurcation import contact_field, vector_field
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    PrescribedForce,
    ProductFriction,
    RoughSurface,
)

# Of angular frequencies over frequencies [Hz].
TURN = 2.0 * np.pi
SURFACE = RoughSurface(0.3e6, 5.2e-6, 6.0)


def mass_in_y(mass=1.0, spring=0.0, **parts):
    """A mass that moves up and down only."""
    rows = np.array([[0.0], [1.0], [0.0]])
    modes = basis_from_matrices([[mass]], [[spring]], {"contact": rows[None], "C": rows})
    return ContactSystem(modes, **{"normal": SURFACE,
                                   "friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


def mass_in_plane(mass=1.0, spring=0.0, **parts):
    """A mass that moves along the ground and up and down."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    modes = basis_from_matrices(mass * np.eye(2), np.diag([spring, 0.0]),
                                {"contact": rows[None], "B": rows, "C": rows})
    return ContactSystem(modes, **{"normal": SURFACE,
                                   "friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


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
        normal=SURFACE,
        drive=Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                    frequency_hz=w / TURN))


def friction_oscillator(modes=2, **changes):
    """A block on a belt: rigid modes x and y, and a third at 30 Hz for modes = 3."""
    r = 1.0 / np.sqrt(5.632)
    B = np.array([[r, 0.0, 0.5 * r], [0.0, r, 0.0]])[:, :modes]
    contact = np.array([[r, 0.0, -0.5 * r], [0.0, r, 0.0]])[:, :modes]
    system = ContactSystem(
        basis([0.0, 0.0, 30.0][:modes], [0.0, 0.0, 0.01][:modes], B, contact),
        normal=RoughSurface(10e6, 10e-6, 40.0),
        friction=ExponentialFriction(0.8, 0.55, 1e3, 1e6), ground=Ground(speed=1e-3),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                    frequency_hz=13.8 / TURN),
        load=Load(14.0))
    return system.with_(**changes) if changes else system


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
                         friction=ProductFriction(0.14, 1.14, 2.0, 100.0),
                         ground=Ground(speed=speed))


def two_mass_field(B=1.0, speed=1.0):
    return contact_field(two_mass_system(B, speed),
                         {"B": (B, with_force), "ground.speed": None})


def friction_slope(v):
    """d mu / dv of (4.4-9) at v > 0."""
    fall = np.exp(-2.0 * v)
    return 0.14 * (-2.28 * fall * np.arctan(100.0 * v)
                   + (1.0 + 1.14 * fall) * 100.0 / (1.0 + (100.0 * v) ** 2))


def two_mass_jacobian(B, v0, D=0.1):
    """Jacobian of x1, x2, x3, x4, straight from the equations of section 4.4."""
    s = B * friction_slope(v0)
    return np.array([[0.0, 1.0, 0.0, 0.0],
                     [-3.0 / 2.5, (-4.0 * D - s) / 2.5, 1.0 / 2.5, 2.0 * D / 2.5],
                     [0.0, 0.0, 0.0, 1.0],
                     [1.0, 2.0 * D, -1.0, -2.0 * D - s]])


def belt(slope=1e6, speed=12e-3):
    """The friction oscillator with one mode, constant normal force and no drive."""
    r = 1.0 / np.sqrt(5.632)
    return ContactSystem(basis([0.0], [0.0], [[r], [0.0]], [[r], [0.0]]),
                         normal=PrescribedForce(14.0),
                         friction=ExponentialFriction(0.8, 0.55, 1e3, slope),
                         ground=Ground(speed=speed),
                         drive=Drive(stiffness_x=5610.0, damping_x=0.768))


def mode_coupling(damping=0.0, mu=0.1):
    """Hoffmann's model as a contact system: x and y of one mass, a contact spring of 4/3."""
    rows = np.zeros((1, 3, 2))
    rows[0, 0, 0] = rows[0, 1, 1] = 1.0
    mass = basis_from_matrices(np.eye(2), [[2.0, 1.0], [1.0, 2.0 / 3.0]],
                               {"contact": rows, "C": rows[0]}, damping=damping * np.eye(2))
    return ContactSystem(mass, normal=LinearContact(4.0 / 3.0),
                         friction=ConstantFriction(mu, 1e9), ground=Ground(speed=-100.0),
                         load=Load(1.0))


def rotor(speed, stiffness=1e4, external=2.0, rotating=1.0):
    """A Jeffcott rotor in the fixed frame: damping that rotates is in part circulatory."""
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    circulatory = rotating * speed * np.array([[0.0, 1.0], [-1.0, 0.0]])
    return basis_from_matrices(np.eye(2), stiffness * np.eye(2) + circulatory,
                               {"contact": row[None], "B": row},
                               damping=(external + rotating) * np.eye(2), symmetric=False)


def beam(n=4, modes=6, **parts):
    """A steel beam on rough ground, and below what moves it there."""
    body = ElasticBody(rectangle(0.2, 0.02, 12, 2), Material(), 0.01)
    modal = modal_basis(body, modes, contact="bottom", contact_nodes=n, B=(0.0, 0.01),
                        C=(0.1, 0.02), damping=0.01)
    return ContactSystem(modal, **{
        "normal": RoughSurface(1e7, 1e-5, 100.0), "load": Load(50.0),
        "friction": ExponentialFriction(0.4, 0.2, 100.0, 1e4), **parts})


DRIVEN = {"ground": Ground(speed=0.05), "drive": Drive(
    stiffness_x=1e5, damping_x=5.0, amplitude_x=1e-4, frequency_hz=300.0 / TURN)}


def belt_of_unit_mass(speed=0.2, dashpot=0.0, **parts):
    """A unit mass on a unit spring, pressed on a belt; kinetic friction 1/2."""
    row = [[1.0], [0.0], [0.0]]
    modes = basis_from_matrices([[1.0]], [[1.0]], {"contact": [row], "B": row, "C": row},
                                damping=[[dashpot]])
    return ContactSystem(modes, **{"normal": PrescribedForce(1.0),
                                   "friction": ConstantFriction(0.5),
                                   "ground": Ground(speed=speed), **parts})


def last_speed_of_stick_slip(dashpot):
    """Belt speed above which slip no longer ends: the next crest of the speed just reaches it."""
    w = np.sqrt(1.0 - 0.25 * dashpot**2)

    def short(speed):
        z, v = 0.5 - dashpot * speed, speed
        times = np.linspace(0.5 * np.pi, 2.5 * np.pi, 20001)
        b = (v + 0.5 * dashpot * z) / w
        rate = np.exp(-0.5 * dashpot * times) * (
            v * np.cos(w * times) - (w * z + 0.5 * dashpot * b) * np.sin(w * times))
        return rate.max() - speed

    return brentq(short, 0.1, 2.0, xtol=1e-12)
