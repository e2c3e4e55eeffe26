"""Friction with memory inside a system: states, Jacobian, equilibria, runs."""

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, Drive, Ground, Load, basis_from_matrices, simulate
from fecontact.laws import (
    BoucWenFriction,
    DahlFriction,
    ExponentialFriction,
    FourParameterIwanFriction,
    IwanFriction,
    JenkinsFriction,
    LuGreFriction,
    ParallelSliders,
    PrescribedForce,
    RoughSurface,
)

LAWS = {
    "jenkins": JenkinsFriction(2e5, 0.4),
    "iwan": IwanFriction(2e5, 0.4, elements=5),
    "four-parameter-iwan": FourParameterIwanFriction(2e5, 0.4, chi=-0.3, elements=4, beta=0.1),
    "parallel-sliders": ParallelSliders(2e5, 0.4, (1.0, 2.0, 0.5), (1.0, 5.0, 1.0)),
    "dahl": DahlFriction(0.4, 2e4),
    "lugre": LuGreFriction(0.5, 0.4, 1e-3, 2.0, bristle_stiffness=2e4, bristle_damping=0.5),
    "bouc-wen": BoucWenFriction(0.4, 2e-5),
}


def basis(groups=None):
    """A block of 2 kg with tangential, normal and tilting motion on two nodes."""
    rows = {"B": [[1.0, 0, 0.02], [0, 1, 0], [0, 0, 1]], "C": [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]}
    nodes = np.array([[[1.0, 0, 0.01], [0, 1, -0.05], [0, 0, 1]],
                      [[1.0, 0, 0.01], [0, 1, 0.05], [0, 0, 1]]])
    contact = nodes if groups is None else dict(zip(groups, nodes[:, None], strict=True))
    return basis_from_matrices(np.diag([2.0, 2.0, 2e-3]), np.zeros((3, 3)),
                               {**rows, "contact": contact}, rigid=3)


def block(friction, **changes):
    parts = {
        "normal": RoughSurface(1e6, 10e-6, 20.0), "friction": friction,
        "ground": Ground(speed=5e-3), "load": Load(normal=20.0),
        "drive": Drive(stiffness_x=4000.0, damping_x=1.0, amplitude_x=1e-4,
                       frequency_hz=30.0 / TURN)} | changes
    return ContactSystem(basis(), **parts)


@pytest.mark.parametrize("name", LAWS)
def test_jacobian_of_the_whole_system(name):
    system = block(LAWS[name])
    law = LAWS[name]
    rng = np.random.default_rng(3)
    q = np.linalg.lstsq(system.basis.T[2:4, 1], [-12e-6, -16e-6], rcond=None)[0]
    assert system.size == 6 + 2 * law.memory
    for scale in (0.3, 3.0):  # inside and outside the limit
        z = scale * np.tile(law.state_scale, 2) * rng.uniform(0.5, 1.0, 2 * law.memory)
        if name == "bouc-wen":
            z = np.clip(z, -0.9, 0.9)
        y = np.concatenate([q, 1e-3 * rng.standard_normal(3), z])
        wanted = np.empty((system.size, system.size))
        for column in range(system.size):
            step = 1e-6 * max(abs(y[column]), 1e-7)
            up, down = y.copy(), y.copy()
            up[column] += step
            down[column] -= step
            wanted[:, column] = (system.rhs(0.1, up) - system.rhs(0.1, down)) / (2.0 * step)
        found = system.jacobian(0.1, y)
        size = np.abs(wanted).max(axis=1, keepdims=True)
        assert (np.abs(found - wanted) < 2e-5 * size).all()


@pytest.mark.parametrize("name", LAWS)
def test_steady_sliding_is_an_equilibrium_of_all_states(name):
    system = block(LAWS[name], drive=Drive(stiffness_x=4000.0, damping_x=1.0))
    start = simulate(system, 1e-3, initial="sliding", outputs=3)
    coefficient = float(np.atleast_1d(LAWS[name].steady_coefficient(-5e-3))[0])
    assert abs(start.friction_force[0].sum()) == pytest.approx(abs(coefficient) * 20.0, rel=2e-3)
    assert start.displacement("B")[0, 0] == pytest.approx(
        abs(coefficient) * 20.0 / 4000.0, rel=1e-2)
    rate = system.rhs(0.0, start.states[0])
    pull = abs(coefficient) * 20.0 / np.sqrt(2.0)
    assert np.abs(rate[:6]).max() < 1e-6 * pull
    assert np.abs(start.modal_velocities).max() < 1e-6


@pytest.mark.parametrize("name", LAWS)
def test_energy_balance_of_a_run(name):
    run = simulate(block(LAWS[name]), 0.3, rtol=1e-6)
    assert run.memory.shape == (len(run.time), 2 * LAWS[name].memory)
    energies = run.energies
    assert energies.imbalance < 1e-6
    assert np.ptp(run.friction_force.sum(axis=1)) > 2.0
    assert run.friction_work[-1].sum() == pytest.approx(energies.friction[-1], rel=1e-9)


@pytest.mark.parametrize(("name", "stiffness"), [
    ("jenkins", 2e5), ("iwan", 2e5), ("dahl", 2e4 * 20.0), ("lugre", 2e4 * 20.0),
    ("bouc-wen", 0.4 * 20.0 / 2e-5)])
def test_small_oscillation_on_the_contacts_own_stiffness(name, stiffness):
    """Before it slides, the contact is a spring: free motion has the frequency sqrt(k / m)."""
    law = LAWS[name] if name != "lugre" else LuGreFriction(
        0.5, 0.4, 1e-3, 2.0, bristle_stiffness=2e4, bristle_damping=0.0)
    point = basis_from_matrices([[2.0]], [[0.0]], {"contact": [[[1.0], [0.0], [0.0]]]})
    system = ContactSystem(point, normal=PrescribedForce(20.0), friction=law)
    w = np.sqrt(stiffness / 2.0)
    y = np.zeros(system.size)
    y[1] = 1e-9 * w
    run = simulate(system, 10.0 * 2.0 * np.pi / w, initial=y, outputs=4001, rtol=1e-9)
    x = run.modal_coordinates[:, 0]
    crossings = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    times = run.time[crossings] - x[crossings] * np.diff(run.time)[0] / (
        x[crossings + 1] - x[crossings])
    assert np.diff(times).mean() == pytest.approx(2.0 * np.pi / w, rel=2e-3)


def test_groups_have_laws_of_their_own():
    friction = {"left": JenkinsFriction(1e5, 0.4), "right": ExponentialFriction(0.8, 0.55, 1e3)}
    system = ContactSystem(
        basis(("left", "right")), normal=RoughSurface(1e6, 10e-6, 20.0), friction=friction,
        ground=Ground(speed=5e-3), load=Load(normal=20.0),
        drive=Drive(stiffness_x=4000.0, damping_x=1.0))
    assert system.basis.groups == (("left", 1), ("right", 1))
    assert (system.memory, system.size) == (1, 6 + 2)
    assert system.parameters()["interfaces.left.friction.stiffness"] == 1e5
    changed = system.with_(**{"interfaces.right.friction.static_coefficient": 0.9})
    assert changed.friction["right"].static_coefficient == 0.9
    assert changed.friction["left"] is friction["left"]
    # Each node of the whole is that of a system that has its law at both nodes.
    y = np.zeros(system.size)
    y[:3] = np.linalg.lstsq(system.basis.T[2:4, 1], [-12e-6, -16e-6], rcond=None)[0]
    y[3:6] = [1e-3, 2e-4, -1e-2]
    y[6:] = [2e-6, 3e-6]
    both = system.contact_history(np.zeros(1), y[None])[0]
    for node, law in enumerate(("left", "right")):
        # A group's total stiffness is that of its own face.
        alone = ContactSystem(
            basis(), normal=system.normal, ground=system.ground, load=system.load,
            friction=JenkinsFriction((1e5, 1e5), 0.4) if law == "left" else friction[law])
        state = y[: alone.size] if alone.memory == 0 else y
        assert both[node] == pytest.approx(
            alone.contact_history(np.zeros(1), state[None])[0][node], rel=1e-13)
    assert system.with_(**{"interfaces.left.friction.stiffness": 2e5}).contact_history(
        np.zeros(1), y[None])[0, 0, 1] == pytest.approx(2.0 * both[0, 1], rel=1e-12)


def test_a_group_without_a_law_is_named():
    with pytest.raises(ValueError, match="lacks a law for the interface 'right'"):
        ContactSystem(basis(("left", "right")), RoughSurface(1e6, 1e-5),
                      friction={"left": JenkinsFriction(1e5, 0.4)})
    with pytest.raises(ValueError, match="interface 'centre'"):
        ContactSystem(basis(), RoughSurface(1e6, 1e-5),
                      friction={"centre": JenkinsFriction(1e5, 0.4)})
