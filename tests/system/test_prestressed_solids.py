"""Modes about rest of solids under friction: against springs as supports, and hand-made systems."""

import numpy as np
import pytest
from scipy.linalg import eigh
from solid_blocks import block_body
from space_systems import dragged, jenkins, node

import fecontact as fc
from fecontact import LoadPath, load_history
from fecontact.analysis import prestressed_modes
from fecontact.laws import Constant, ConstantFriction, IwanFriction, LinearContact, RoughSurface


@pytest.fixture(scope="module")
def block():
    """Body, basis with all its modes, and the system of a steel block on nine patches."""
    body = block_body((3, 3, 1), (0.06, 0.045, 0.03), material=fc.Material(2.1e11, 0.3, 7850.0))
    basis = fc.modal_basis(body, body.nodes.size, contact_nodes=(3, 3), C=(0.03, 0.0225, 0.03))
    system = fc.ContactSystem(
        basis, normal=RoughSurface(3e9, 1e-5, 0.0), friction=ConstantFriction(0.5),
        load=fc.Load(2e3, (fc.PointLoad("C", "x", signal=Constant(0.0)),
                           fc.PointLoad("C", "y", signal=Constant(0.0)))))
    return body, basis, system


@pytest.mark.parametrize("ratio", [0.82, 0.4])
def test_stuck_block_stands_on_springs(block, ratio):
    """The mesh with springs c_N of the pressed surface and c_T at its patches, by scipy."""
    body, basis, system = block
    history = load_history(system, LoadPath(forces=((0.0, 300.0), (0.0, -200.0)), steps=3),
                           tangential_ratio=ratio)
    assert (history.contact_state[-1] == 1).all()
    modes = prestressed_modes(system, history)
    # Of the uniform surface: F = c u^2 / (2 R_Z), dF/du = sqrt(2 c F / R_Z), c by share.
    share = basis.tributary / basis.tributary.sum()
    slope = [np.sqrt(2.0 * 3e9 * share * force / 1e-5) for force in history.normal_force[[0, -1]]]
    K, M = body.stiffness.toarray(), body.mass.toarray()
    rows = basis.mode_shapes.restriction.toarray().reshape(-1, 6, len(K))[2:11, :3]
    supports = np.stack([ratio * slope[0], ratio * slope[0], slope[1]], axis=1)
    whole = K + np.einsum("nki,nk,nkj->ij", rows, supports, rows, optimize=True)
    exact = np.sqrt(eigh(whole, M, eigvals_only=True)[:12]) / (2.0 * np.pi)
    assert modes.frequencies_hz[:12] == pytest.approx(exact, rel=1e-7)
    assert not modes.grows.any()


@pytest.mark.slow
def test_rigid_sticking_holds_both_tangents(block):
    """Modes agree with those of the mesh, its patches held along x and y by penalties, by scipy."""
    body, basis, system = block
    history = load_history(system, LoadPath(forces=((0.0, 300.0), (0.0, -200.0)), steps=2),
                           tangential_ratio=np.inf)
    modes = prestressed_modes(system, history)
    share = basis.tributary / basis.tributary.sum()
    slope = np.sqrt(2.0 * 3e9 * share * history.normal_force[-1] / 1e-5)
    K, M = body.stiffness.toarray(), body.mass.toarray()
    rows = basis.mode_shapes.restriction.toarray().reshape(-1, 6, len(K))[2:11, :3]
    held = 1e6 * K.diagonal().max()
    supports = np.stack([np.full(9, held), np.full(9, held), slope], axis=1)
    whole = K + np.einsum("nki,nk,nkj->ij", rows, supports, rows, optimize=True)
    exact = np.sqrt(eigh(whole, M, eigvals_only=True)[:6]) / (2.0 * np.pi)
    assert len(modes.eigenvalues) == basis.modes - 18
    assert modes.frequencies_hz[:6] == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.5, np.inf])
def test_a_slider_holds_across_its_way(ratio):
    """One mass at the limit along an angle: K + c (I - a a^T), and mu c_N a beside the normal."""
    angle, c_N, mu = 0.6, 8e4, 0.4
    a, across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    system = node(ConstantFriction(mu), held=2e5, normal=LinearContact(c_N))
    history = load_history(system, dragged([(0.0, 0.0), 1e-3 * a], steps=4),
                           tangential_ratio=ratio)
    assert history.contact_state[-1, 0] == 2
    c = ratio * c_N
    stuck = prestressed_modes(system, history)
    held = prestressed_modes(system, history, at_limit="slip")
    if np.isinf(ratio):
        assert stuck.frequencies_hz == pytest.approx([np.sqrt(c_N) / (2.0 * np.pi)])
        free = np.array([[2e5, -mu * c_N], [0.0, c_N]])  # along a, away
    else:
        assert stuck.frequencies_hz == pytest.approx(
            np.sqrt([c_N, 2e5 + c, 2e5 + c]) / (2.0 * np.pi), rel=1e-8)
        free = np.zeros((3, 3))
        free[:2, :2] = 2e5 * np.eye(2) + c * np.outer(across, across)
        free[:2, 2], free[2, 2] = -mu * c_N * a, c_N
    exact = np.sort(np.sqrt(np.linalg.eigvals(free).real)) / (2.0 * np.pi)
    assert held.frequencies_hz == pytest.approx(exact, rel=1e-8)
    # Growth depends on the shape: motion away from the ground drives motion along a.
    mode = int(np.argmin(np.abs(held.frequencies_hz - np.sqrt(c_N) / (2.0 * np.pi))))
    x, y, z = (system.basis.contact_T[0, :3] @ held.right[:3, mode])
    assert np.array([x, y]) / z == pytest.approx(mu * c_N / (2e5 - c_N) * a, rel=1e-6)


def test_iwan_elements_slide_each_along_its_own_force():
    """Behind a corner each element has its own direction; by differences of the loading itself."""
    system = node(IwanFriction(2e4, 0.4, elements=5), held=3e4)
    corner = dragged([(0.0, 0.0), (4e-4, 0.0), (4e-4, 2.5e-4)], steps=200)
    history = load_history(system, corner, rtol=1e-6)
    rest = history.state()
    assert 0 < rest.at_limit.sum() < 5
    modes = prestressed_modes(system, rest, at_limit="slip")
    directions = rest.slider_force[0] / np.linalg.norm(rest.slider_force[0], axis=1)[:, None]
    assert np.ptp(np.arctan2(directions[:, 1], directions[:, 0])) > 0.1
    springs = 3e4 * np.eye(2) + 2e4 / 5 * sum(
        np.eye(2) - slides * np.outer(one, one)
        for one, slides in zip(directions, rest.at_limit[0], strict=True))
    exact = np.sqrt(np.sort(np.append(np.linalg.eigvalsh(springs), 1e6))) / (2.0 * np.pi)
    assert modes.frequencies_hz == pytest.approx(exact, rel=1e-8)


def test_open_nodes_add_nothing():
    """Lifted off by the drive: the springs at B alone."""
    system = jenkins(held=2e5, drive=fc.Drive(stiffness_z=1e5))
    history = load_history(system, LoadPath(motion_z=(0.0, 1e-3)))
    assert history.contact_state[-1, 0] == 0
    for at_limit in ("stick", "slip"):
        modes = prestressed_modes(system, history, at_limit=at_limit)
        assert modes.frequencies_hz == pytest.approx(
            np.sqrt([1e5, 2e5, 2e5]) / (2.0 * np.pi), rel=1e-8)
