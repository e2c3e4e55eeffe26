"""Bodies that rotate: straight lines in the inertial frame, rods, beams, rings and pendulums."""

import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import (
    ContactSystem,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    Pendulum,
    Study,
    basis_from_matrices,
    equilibrium,
    generate,
    modal_basis,
    simulate,
)
from fecontact.analysis import complex_modes
from fecontact.bifurcation import contact_field, stability_map
from fecontact.fem import Rotation
from fecontact.io import read_basis, write_basis
from fecontact.laws import Constant, ConstantFriction, LinearContact
from fecontact.reduction import BasisReport

STEEL = Material(2.1e11, 0.3, 7850.0)


def apart(basis, **parts):
    """The body alone, far from any ground."""
    return ContactSystem(basis, normal=LinearContact(1.0), friction=ConstantFriction(0.0),
                         gap=100.0, **parts)


def clamped(length, height, columns, rows, modes, fixed="xy", **options):
    mesh = rectangle(length, height, columns, rows, points={"corner": (0.0, 0.0)})
    fix = {"left": fixed} if fixed == "xy" else {"left": fixed, "corner": "y"}
    body = ElasticBody(mesh, STEEL, fixed=fix)
    return body, modal_basis(body, modes, contact="bottom", contact_nodes=1,
                             points={"tip": (length, 0.5 * height)}, **options)


# Free bodies -------------------------------------------------------------------------------------

def test_free_body_moves_on_a_straight_line():
    """Translations alone are exact: in the frame that turns by W t a straight line turns by -W t.

    The first integral of the frame, kinetic energy less the centrifugal potential, is kept: the
    Coriolis forces do no work.
    """
    W, centre = 3.0, np.array([0.3, 0.1])
    body = ElasticBody(rectangle(1.0, 1.0, 2, 2), STEEL)
    basis = modal_basis(body, 3, contact="bottom", contact_nodes=1, C=(0.5, 0.5),
                        rotation=Rotation(W, tuple(centre))).select([0, 1])
    system = apart(basis)
    start, velocity = np.array([0.5, 0.5]) - centre, np.array([0.05, -0.08])
    T = basis.T[1, :2]
    seen = velocity - W * np.array([-start[1], start[0]])
    run = simulate(system, 2.0, initial=np.concatenate([[0.0, 0.0], np.linalg.solve(T, seen)]),
                   outputs=41, rtol=1e-10)
    angle = -W * run.time
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    line = start[:, None] + velocity[:, None] * run.time
    expected = np.einsum("ijk,jk->ki", turn, line) - start
    assert run.modal_coordinates @ T.T == pytest.approx(expected, abs=1e-8)
    energies = run.energies
    assert energies.imbalance < 1e-8
    assert np.abs(energies.modal_damping).max() < 1e-13 * energies.kinetic.max()
    assert (energies.circulatory_work == 0.0).all()
    # In the inertial frame, (u' + W x (X + u))^2 m / 2 is constant.
    mass = 7850.0
    place = run.modal_coordinates @ T.T + start
    speed = run.modal_velocities @ T.T + W * np.column_stack([-place[:, 1], place[:, 0]])
    kinetic = 0.5 * mass * (speed**2).sum(axis=1)
    assert kinetic == pytest.approx(np.full(41, 0.5 * mass * velocity @ velocity), rel=1e-6)


def test_free_rotation_has_no_stiffness():
    """The virial theorem: the stress stiffens a rotation by what the spin softens it."""
    body = ElasticBody(rectangle(0.4, 0.3, 6, 4), STEEL)
    basis = modal_basis(body, 3, contact="bottom", contact_nodes=1,
                        rotation=Rotation(1.0, (0.2, 0.15)))
    assert basis.rotation.stiffening == pytest.approx(np.diag([-1.0, -1.0, 0.0]), abs=1e-12)
    assert basis.rotation.coriolis == pytest.approx(
        np.array([[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), abs=1e-12)
    assert basis.centrifugal_load == pytest.approx(np.zeros(3), abs=1e-10)


def test_centrifugal_pendulum():
    """Hinged at the distance a from the centre it swings with W sqrt(a m l / I)."""
    mesh = generate(Pendulum(hinge_radius=0.002))
    body = ElasticBody(mesh, fixed={"pivot": "hinge"})
    _, hinge, *_ = body.hinges[0]
    ones, arm = np.eye(2)[np.arange(2 * len(body.nodes)) % 2], (body.nodes - hinge).ravel()
    moment = ones.T @ body.mass @ arm
    inertia = arm @ body.mass @ arm
    a = 0.7
    out = moment / np.linalg.norm(moment)
    centre = hinge - a * out
    basis = modal_basis(body, 1, contact_nodes=1, rotation=Rotation(5.0, tuple(centre)))
    expected = 25.0 * a * np.linalg.norm(moment) / inertia
    assert basis.stiffness[0, 0] == pytest.approx(expected, rel=1e-9)
    assert complex_modes(basis).frequencies_hz == pytest.approx([np.sqrt(expected) / 2.0 / np.pi])
    assert basis.centrifugal_load == pytest.approx([0.0], abs=1e-9)


# Supported bodies --------------------------------------------------------------------------------

def test_stretch_of_a_rotating_rod():
    """rho W^2 L^3 / (3 E) on the undeformed rod; with softening u = sin(k x) / (k cos(k L)) - x."""
    L, k = 1.0, 0.3
    W = k * np.sqrt(STEEL.youngs_modulus / STEEL.density)
    options = {"coriolis": False, "stress_stiffening": False}
    for softening, expected in ((False, k**2 * L**3 / 3.0), (True, np.tan(k * L) / k - L)):
        _, basis = clamped(L, 0.01, 20, 1, 200, "x", rotation=Rotation(
            W, (0.0, 0.005), spin_softening=softening, **options))
        q = equilibrium(apart(basis)).modal_coordinates
        assert basis.T[basis.point_index("tip"), 0] @ q == pytest.approx(expected, rel=1e-3)
    none = Rotation(W, centrifugal_load=False, spin_softening=False, **options)
    basis = clamped(L, 0.01, 20, 1, 10, "x", rotation=none)[1]
    assert (basis.stiffness == np.diag(basis.angular_frequencies**2)).all()
    assert not basis.damping.any()
    assert not basis.centrifugal_load.any()


def test_rotating_cantilever():
    """Wright and others (1982), flapwise: 4.1373 and 11.2023 at W = 2 and 10; in the plane of
    rotation W^2 less under the root, times sqrt(E I / (rho A L^4))."""
    L, h = 1.0, 0.02
    unit = np.sqrt(STEEL.youngs_modulus * h**2 / (12.0 * STEEL.density * L**4))
    body, still = clamped(L, h, 40, 2, 12)
    assert still.angular_frequencies[0] / unit == pytest.approx(3.51602, rel=2e-3)
    for speed, flap in ((2.0, 4.1373), (10.0, 11.2023)):
        lag = np.sqrt(flap**2 - speed**2)
        for coriolis, tolerance in ((False, 3e-3), (True, 1e-2)):
            basis = modal_basis(body, 12, contact="bottom", contact_nodes=1, rotation=Rotation(
                speed * unit, (0.0, 0.5 * h), coriolis=coriolis))
            found = 2.0 * np.pi * complex_modes(basis).frequencies_hz[0] / unit
            assert found == pytest.approx(lag, rel=tolerance)
    softened = modal_basis(body, 12, contact="bottom", contact_nodes=1, rotation=Rotation(
        2.0 * unit, coriolis=False, stress_stiffening=False))
    assert 2.0 * np.pi * complex_modes(softened).frequencies_hz == pytest.approx(
        np.sqrt(still.angular_frequencies**2 - 4.0 * unit**2), rel=1e-12)


def ring(R, h, count):
    """A thin ring of quadrilaterals about the origin, with a short contact face at its bottom."""
    angle = 2.0 * np.pi * np.arange(count) / count - 0.5 * np.pi
    nodes = np.concatenate([r * np.column_stack([np.cos(angle), np.sin(angle)])
                            for r in (R - 0.5 * h, R + 0.5 * h)])
    k = np.arange(count)
    cells = np.column_stack([k, k + count, (k + 1) % count + count, (k + 1) % count])
    return Mesh(nodes, cells, {"contact": [[count, count + 1]]})


def test_rotating_ring():
    """Inextensional ring: 2 n W / (n^2 + 1) +- sqrt(w_n^2 + (n (n^2 - 1) / (n^2 + 1))^2 W^2).

    Without bending stiffness the upper one is n W: a wave at rest in the inertial frame.
    """
    body = ElasticBody(ring(1.0, 0.04, 96), STEEL)
    still = modal_basis(body, 12, contact_nodes=1)
    w = {2: still.angular_frequencies[3], 3: still.angular_frequencies[5]}
    assert still.angular_frequencies[[4, 6]] == pytest.approx([w[2], w[3]], rel=1e-6)
    W = 0.6 * w[2]
    basis = modal_basis(body, 12, contact_nodes=1, rotation=Rotation(W))
    found = 2.0 * np.pi * complex_modes(basis).frequencies_hz
    for n in (2, 3):
        root = np.sqrt(w[n]**2 + (n * (n**2 - 1) / (n**2 + 1) * W) ** 2)
        for sign in (1.0, -1.0):
            expected = root + sign * 2.0 * n * W / (n**2 + 1)
            assert np.abs(found / expected - 1.0).min() < 3e-3


# Descriptions ------------------------------------------------------------------------------------

def test_speed_of_a_basis_is_a_parameter(tmp_path):
    """A basis at another speed is that made at it; it is saved, selected and mapped."""
    body, _ = clamped(1.0, 0.05, 10, 1, 6)
    options = {"contact": "bottom", "contact_nodes": 1, "damping": 0.01}
    made, other = (modal_basis(body, 6, rotation=Rotation(W), **options) for W in (300.0, 40.0))
    moved = other.with_rotation_speed(300.0)
    write_basis(tmp_path / "basis.h5", moved)
    read = read_basis(tmp_path / "basis.h5")
    for name in ("damping", "stiffness", "centrifugal_load"):
        expected = getattr(made, name)
        assert getattr(moved, name) == pytest.approx(
            expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())
        assert (getattr(read, name) == getattr(moved, name)).all()
    part = moved.select([0, 2])
    assert (part.stiffness == moved.stiffness[np.ix_([0, 2], [0, 2])]).all()
    assert (part.centrifugal_load == moved.centrifugal_load[[0, 2]]).all()
    assert "rotation: 300 rad/s" in str(moved)
    assert "at rest, the body rotates at 300 rad/s" in str(BasisReport(moved))
    system = apart(other)
    assert system.parameter("basis.rotation.speed") == 40.0
    name = "basis.rotation.speed"
    found = stability_map(contact_field(system, [name, "basis.damping.0.0"]),
                          {name: [40.0, 300.0], "basis.damping.0.0": [1.0]})
    alone = complex_modes(made).eigenvalues
    system = apart(made).with_(**{"basis.damping.0.0": 1.0})
    expected = complex_modes(system).eigenvalues
    assert not np.allclose(alone, expected)
    assert found.growth_rate[1, 0] == pytest.approx(expected.real.max(), rel=1e-9)


def test_rotation_in_a_study():
    text = """
geometry = { shape = "beam", length = 0.1, height = 0.01, element_size = 0.005 }
basis = { modes = 5, contact_nodes = 4 }
normal = { stiffness = 0.3e6, roughness_height = 5.2e-6, damping = 6.0 }
friction = { static_coefficient = 0.8, kinetic_coefficient = 0.55, decay = 1000.0 }
[body]
material = "steel"
thickness = 1.0
rotation = { speed = 200.0, centre = [0.05, 0.005], spin_softening = false }
"""
    study = Study.from_toml(text)
    assert study.body.rotation == Rotation(200.0, (0.05, 0.005), spin_softening=False)
    expected = modal_basis(study.elastic_body(), 5, contact_nodes=4, rotation=study.body.rotation)
    assert (study.modal_basis().stiffness == expected.stiffness).all()
    assert Study.from_toml(study.to_toml()) == study
    faster = study.with_(**{"body.rotation.speed": 300.0})
    assert faster.modal_basis().rotation.speed == 300.0
    with pytest.raises(InputError, match=r"\[body\.rotation\] lacks the key 'speed'"):
        Study.from_toml(text.replace("speed = 200.0, ", ""))


def test_bad_rotations_are_refused():
    for arguments, words in (((np.inf,), "speed = inf"), ((1.0, (0.0, np.nan)), "centre = "),
                             ((1.0, (0.0, 0.0), 1), "coriolis = 1 must be true or false")):
        with pytest.raises(InputError, match=words):
            Rotation(*arguments)
    basis = basis_from_matrices(np.eye(1), np.eye(1), {"contact": np.zeros((1, 3, 1))})
    with pytest.raises(InputError, match="does not rotate"):
        basis.with_rotation_speed(1.0)
    with pytest.raises(InputError, match=r"basis\.rotation\.speed'.* does not rotate"):
        apart(basis).parameter("basis.rotation.speed")


def test_loads_of_one_direction_in_space_are_refused():
    _, basis = clamped(1.0, 0.1, 4, 1, 4, rotation=Rotation(10.0))
    with pytest.raises(InputError, match=r"gravity = .* cannot act on a body that rotates"):
        apart(basis, load=Load(gravity=(0.0, -9.81)))
    with pytest.raises(InputError, match=r"base_acceleration_x .*rotates"):
        apart(basis, load=Load(base_acceleration_x=Constant(1.0)))
