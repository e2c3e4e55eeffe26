"""Modes about states at rest under friction and about sliding, against small hand-made systems."""

import numpy as np
import pytest
from systems import mode_coupling

from fecontact import (
    ContactState,
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    LoadPath,
    PointLoad,
    basis_from_matrices,
    load_history,
)
from fecontact.analysis import complex_modes, prestressed_modes
from fecontact.laws import (
    Constant,
    ConstantFriction,
    ExponentialFriction,
    IwanFriction,
    LinearContact,
    PrescribedForce,
)


def mass(stiffness=((1e4, 0.0), (0.0, 0.0)), **parts):
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    basis = basis_from_matrices(2.0 * np.eye(2), stiffness, {
        "contact": row[None], "B": row, "C": row})
    return ContactSystem(basis, **{
        "normal": LinearContact(8e4, 16.0), "friction": ConstantFriction(0.5),
        "load": Load(10.0, (PointLoad("C", "x", signal=Constant(0.0)),)), **parts})


def hertz(stiffness, m=2.0):
    return np.sqrt(np.asarray(stiffness) / m) / (2.0 * np.pi)


def test_stuck_node_is_a_spring():
    system = mass()
    history = load_history(system, LoadPath(forces=((0.0, 2.0),)), tangential_ratio=0.5)
    modes = prestressed_modes(system, history)
    damped = np.sqrt(8e4 / 2.0 - (16.0 / 4.0) ** 2) / (2.0 * np.pi)
    assert modes.frequencies_hz == pytest.approx([hertz(1e4 + 4e4), damped], rel=1e-10)
    assert modes.damping_ratios == pytest.approx([0.0, 4.0 / np.sqrt(4e4)], abs=1e-10)
    assert history.contact_state[-1, 0] == ContactState.STICK
    # An undamped mode along x: its velocity is i w times its displacement.
    q, rate = np.split(modes.right[:, 0], 2)
    x, y, _ = system.basis.T_matrix[:3] @ q
    assert abs(y) < 1e-9 * abs(x)
    assert rate == pytest.approx(2j * np.pi * modes.frequencies_hz[0] * q, rel=1e-9)


def test_rigid_sticking_is_a_constraint():
    system = mass()
    history = load_history(system, LoadPath(forces=((0.0, 2.0),)), tangential_ratio=np.inf)
    modes = prestressed_modes(system, history)
    assert len(modes.eigenvalues) == 1
    assert abs(modes.eigenvalues[0]) == pytest.approx(np.sqrt(4e4), rel=1e-10)


def test_iwan_elements_at_their_limit_stick_or_slide():
    k, mu = 3e4, 0.5
    system = mass(friction=IwanFriction(k, mu, elements=10))
    history = load_history(system, LoadPath(forces=((0.0, 4.0),)))
    sliding = int(history.state().at_limit.sum())
    assert 0 < sliding < 10
    low = prestressed_modes(system, history, at_limit="slip")
    high = prestressed_modes(system, history)
    assert high.frequencies_hz[0] == pytest.approx(hertz(1e4 + k), rel=1e-10)
    # The sliding elements couple x to y by phi c_N only, which leaves x a triangular block.
    assert low.frequencies_hz[0] == pytest.approx(hertz(1e4 + k * (10 - sliding) / 10), rel=1e-10)


@pytest.mark.parametrize("sliding", [True, False])
@pytest.mark.parametrize("mu", [0.70, 0.76])
def test_mode_coupling(mu, sliding):
    """Hoffmann's two modes, K = [[2, 1 - 4 mu / 3], [1, 2]]: flutter at mu = 3/4, w = sqrt(2)."""
    system = mode_coupling(mu=mu)
    if sliding:
        modes = complex_modes(system, "sliding")
    else:
        # At rest, after the ground has travelled far enough for the node to slide.
        history = load_history(system, LoadPath(travel=(0.0, -50.0)), tangential_ratio=1.0)
        assert history.contact_state[-1, 0] == 2
        modes = prestressed_modes(system, history, at_limit="slip")
    growing = modes.eigenvalues.real.max()
    coupling = 1.0 - 4.0 * mu / 3.0
    exact = np.sqrt(-(2.0 + np.sqrt(complex(coupling))) + 0j).real
    assert growing == pytest.approx(abs(exact), abs=1e-6)
    assert (growing > 1e-3) == (mu > 0.75)
    assert modes.frequencies_hz * 2.0 * np.pi == pytest.approx(
        np.sort(np.abs(np.sqrt(-(2.0 + np.array([-1, 1]) * np.sqrt(complex(coupling))) + 0j).imag)),
        rel=1e-5)


def test_falling_friction_is_negative_damping():
    V, N, m, k, b = 2e-3, 0.3, 2.0, 1e4, 3.0
    law = ExponentialFriction(0.8, 0.55, 1000.0, 1e12)
    row = np.zeros((3, 1))
    row[0, 0] = 1.0
    basis = basis_from_matrices([[m]], [[0.0]], {"contact": row[None], "B": row})
    system = ContactSystem(basis, normal=PrescribedForce(N), friction=law,
                           ground=Ground(speed=V), drive=Drive(stiffness_x=k, damping_x=b))
    slope = -0.25 * 1000.0 * np.exp(-2.0)
    modes = complex_modes(system, "sliding")
    assert modes.eigenvalues[0].real == pytest.approx(-(b + slope * N) / (2.0 * m), rel=1e-6)
    assert modes.damping_ratios[0] < 0.0


def test_free_masses_are_rigid_modes():
    row = np.zeros((2, 3, 2))
    row[:, 0] = np.eye(2)
    basis = basis_from_matrices(np.eye(2), [[1e4, -1e4], [-1e4, 1e4]], {"contact": row})
    system = ContactSystem(basis, normal=PrescribedForce((0.0, 0.0)),
                           friction=ConstantFriction(0.5))
    history = load_history(system, LoadPath(travel=(0.0, 1.0)), tangential_stiffness=1e4)
    modes = prestressed_modes(system, history)
    assert modes.frequencies_hz == pytest.approx([hertz(2e4, 1.0)], rel=1e-9)
    assert modes.real_eigenvalues.tolist() == [0.0, 0.0]


def test_what_is_no_state_is_refused():
    with pytest.raises(InputError, match="must be a LoadHistory"):
        prestressed_modes(mass(), "sliding")
    with pytest.raises(InputError, match="at_limit"):
        prestressed_modes(mass(), "sliding", at_limit="free")
