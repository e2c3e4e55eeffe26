"""Friction with memory gives back the energy that it stores: no loss, and no wear."""

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    ContactSystem,
    Drive,
    Load,
    ModelWarning,
    PointLoad,
    basis_from_matrices,
    simulate,
)
from fecontact.laws import (
    BoucWenFriction,
    DahlFriction,
    ExponentialFriction,
    Harmonic,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    LuGreFriction,
    PrescribedForce,
)

MU, FORCE, K = 0.4, 20.0, 2e5
LIMIT = MU * FORCE / K
W = 2.0 * np.pi * 5.0
LAWS = {
    "jenkins": JenkinsFriction(K, MU),
    "iwan": IwanFriction(K, MU, elements=6),
    "dahl": DahlFriction(MU, K / FORCE),
    "lugre": LuGreFriction(0.5, MU, 1e-3, 2.0, bristle_stiffness=K / FORCE),
    "bouc-wen": BoucWenFriction(MU, LIMIT),
}


def guided(friction, amplitude, normal=None, **parts):
    """A light point that a stiff drive leads to and fro, amplitude sin(w t)."""
    x = [[1.0], [0.0], [0.0]]
    basis = basis_from_matrices([[1e-6]], [[0.0]], {"contact": [x], "B": x})
    return ContactSystem(basis, normal=normal or PrescribedForce(FORCE), friction=friction,
                         drive=Drive(stiffness_x=1e10, damping_x=10.0, amplitude_x=amplitude,
                                     frequency_hz=W / TURN), **parts)


def cycles(friction, amplitude, count=3, **options):
    run = simulate(guided(friction, amplitude), count * 2.0 * np.pi / W,
                   outputs=400 * count + 1, rtol=1e-8, **options)
    return run, np.diff(run.friction_work[::400, 0])


@pytest.mark.parametrize("amplitude", [2.0 * LIMIT, 10.0 * LIMIT])
def test_loop_of_a_jenkins_element(amplitude):
    """4 mu F (X - mu F / k) a cycle; the spring's energy is stored, at most (mu F)^2 / 2 k."""
    run, lost = cycles(LAWS["jenkins"], amplitude)
    expected = 4.0 * MU * FORCE * (amplitude - LIMIT)
    assert lost[1:] == pytest.approx([expected] * 2, rel=1e-4)
    assert run.energies.bristles.max() == pytest.approx(0.5 * MU * FORCE * LIMIT, rel=1e-4)
    assert (run.energies.bristle_work == pytest.approx(0.0, abs=1e-5 * expected))
    assert run.energies.imbalance < 1e-6


def test_loop_of_an_iwan_chain():
    """The sum of its elements' loops, k/N each, limits mu F (2 i + 1) / N^2."""
    law, amplitude = LAWS["iwan"], 1.2 * LIMIT
    _, lost = cycles(law, amplitude)
    limits = MU * FORCE * (2.0 * np.arange(6) + 1.0) / 36.0
    expected = (4.0 * limits * np.maximum(amplitude - limits / (K / 6.0), 0.0)).sum()
    assert lost[1:] == pytest.approx([expected] * 2, rel=1e-4)


@pytest.mark.parametrize("name", ["jenkins", "iwan"])
def test_below_the_limit_nothing_is_lost(name):
    """The weakest of six Iwan elements slides at a sixth of the deflection at the limit."""
    amplitude = (0.9 if name == "jenkins" else 0.9 / 6.0) * LIMIT
    run, _ = cycles(LAWS[name], amplitude)
    assert run.energies.bristles.max() == pytest.approx(0.5 * K * amplitude**2, rel=1e-4)
    assert np.abs(run.friction_work).max() < 1e-7 * 0.5 * K * amplitude**2
    assert run.creep_work == pytest.approx(np.zeros_like(run.friction_work))


@pytest.mark.parametrize("name", LAWS)
def test_loss_never_falls_and_covers_the_loop(name):
    """Over a closed loop the loss is the work of the friction force, by quadrature."""
    run, lost = cycles(LAWS[name], 3.0 * LIMIT)
    work = run.friction_work[:, 0]
    assert (np.diff(work) > -1e-9 * work[-1]).all()
    # Its spring's energy goes up and down meanwhile.
    power = run.friction_force[:, 0] * run.slip_velocity[:, 0]
    assert (np.diff(np.cumsum(power)) < 0.0).any()
    loop = np.trapezoid(power[800:], run.time[800:])
    assert lost[-1] == pytest.approx(loop, rel=1e-3)
    assert run.energies.imbalance < 1e-6


@pytest.mark.parametrize("name", LAWS)
def test_balance_under_a_varying_normal_force(name):
    """Changes of the bristles' stiffness do work on them."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(2.0 * np.eye(2), np.diag([1e5, 0.0]),
                                {"contact": rows[None], "B": rows, "C": rows}, damping=np.diag(
                                    [20.0, 100.0]))
    load = Load(FORCE, forces=(PointLoad("C", "y", signal=Harmonic(0.8 * FORCE, 3.0 * W / TURN)),
                               PointLoad("C", "x", signal=Harmonic(15.0, W / TURN))))
    system = ContactSystem(basis, normal=LinearContact(1e6), friction=LAWS[name], load=load)
    run = simulate(system, 0.6, outputs=2001, rtol=1e-8)
    assert np.ptp(run.normal_force) > FORCE
    energies, work = run.energies, run.friction_work[:, 0]
    assert energies.imbalance < 1e-6
    assert (np.diff(work) > -1e-8 * work[-1]).all()
    # By quadrature of z^2 a'(t) / 2, for stiffness a F; Jenkins springs do not change.
    z, F = run.memory[:, 0], run.normal_force[:, 0]
    if name in ("jenkins", "iwan"):
        assert energies.bristle_work == pytest.approx(0.0, abs=1e-7 * energies.bristles.max())
        return
    stiffness = {"dahl": K / FORCE, "lugre": K / FORCE, "bouc-wen": MU * LIMIT}[name]
    middle = 0.5 * (z[1:] ** 2 + z[:-1] ** 2)
    expected = np.cumsum(0.5 * stiffness * middle * np.diff(F))
    assert np.abs(energies.bristle_work[1:] - expected).max() < 1e-3 * np.abs(expected).max()
    assert np.abs(expected).max() > 1e-2 * energies.bristles.max()


def test_creep_of_smoothed_friction_is_reported_apart():
    """Held at half its limit the contact creeps: no loss in slip."""
    rows = np.zeros((3, 1))
    rows[0, 0] = 1.0
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "C": rows})
    load = Load(forces=(PointLoad("C", "x", signal=Harmonic(0.5 * MU * FORCE, 1e-3 / TURN,
                                                            phase=0.5 * np.pi)),))
    system = ContactSystem(basis, normal=PrescribedForce(FORCE), load=load,
                           friction=ExponentialFriction(MU, MU, 0.0, 1e4))
    run = simulate(system, 1.0, rtol=1e-8)
    # R = mu F (2 / pi) arctan(k v) = mu F / 2: v = 1 / k.
    assert run.friction_work[-1, 0] == pytest.approx(0.5 * MU * FORCE * 1e-4, rel=1e-3)
    assert run.creep_work == pytest.approx(run.friction_work, rel=1e-9)
    assert (run.energies.friction == pytest.approx(run.friction_work[:, 0], rel=1e-9))


def test_lugre_friction_that_gives_energy_is_warned_of():
    """Bristles deflected in stick slip back beyond the Stribeck velocity, at sigma_1 |v| > 4 g."""
    active = LuGreFriction(0.9, MU, 0.05, 8.0, bristle_stiffness=1e4, bristle_damping=400.0)
    system = guided(active, 0.0125).with_(**{"drive.stiffness_x": 1e6, "drive.damping_x": 300.0})
    with pytest.warns(ModelWarning, match=r"LuGreFriction gave .* J to the motion at contact no"):
        run = simulate(system, 0.06)
    work = run.friction_work[:, 0]
    assert (np.maximum.accumulate(work) - work).max() > 1e-3 * work.max()
    # Where sigma_1 |v| stays below 4 g nothing is said.
    simulate(system.with_(**{"friction.bristle_damping": 3.0}), 0.06)
