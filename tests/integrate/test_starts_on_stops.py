"""Runs that start on rigid stops at gap zero, against motions along the stop in closed form."""

import numpy as np
import pytest

import fecontact as fc
from fecontact import Status
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, LinearContact

DAMPING, END = 0.2, 0.5


def mass_on_stop(mass=1.0, lean=0.0, mu=0.3, load=0.0):
    """A damped mass on a rigid stop; the second coordinate moves the contact along it too."""
    rows = [[1.0, lean], [0.0, 1.0], [0.0, 0.0]]
    basis = fc.basis_from_matrices(mass * np.eye(2), np.zeros((2, 2)), {
        "contact": [rows], "B": rows, "C": rows}, damping=DAMPING * mass * np.eye(2))
    return fc.ContactSystem(basis, normal=LinearContact(1e6, 0.0), friction=ConstantFriction(mu),
                            load=fc.Load(load))


def run_on_stop(system, start, restitution=0.3):
    run = fc.simulate(system, END, initial=start, outputs=21,
                      solver=SetValued(restitution=restitution))
    assert run.status is Status.FINISHED
    return run


@pytest.mark.parametrize(("speed", "normal_speed"), [
    (0.021942657941673677, -1.3538270352436455e-18), (0.7, -9e-17), (0.7, 9e-17), (1e-3, 0.0)])
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_slides_without_load(speed, normal_speed, restitution):
    """x' = v exp(-d t): normal velocities within rounding of the slip velocity are none."""
    run = run_on_stop(mass_on_stop(lean=0.18), [0.0, 0.0, speed, normal_speed], restitution)
    x = speed * (1.0 - np.exp(-DAMPING * run.time)) / DAMPING
    assert run.states[:, 0] == pytest.approx(x, abs=1e-6 * speed)
    assert np.abs(run.states[:, 1]).max() < 1e-12 * speed
    assert run.statistics["events"] < 5


@pytest.mark.parametrize("load", [0.0, 10.0])
@pytest.mark.parametrize("lean", [0.0, 0.41])
def test_stays_at_rest(load, lean):
    """Nothing moves, and no energy is exchanged."""
    run = run_on_stop(mass_on_stop(lean=lean, load=load), [-1.2e-3, 0.0, 0.0, 0.0])
    assert run.states[:, 0] == pytest.approx(np.full(21, -1.2e-3), rel=1e-12)
    assert run.normal_force[:, 0] == pytest.approx(np.full(21, load), rel=1e-9)
    assert run.energies.imbalance < 1e-6


def test_comes_to_rest():
    """x'' = -d x' - mu N / m until x' = 0; then rest, with energies far below all numbers."""
    mass, speed, load, mu = 0.11574, 0.03920119508729802, 10.0, 0.3
    system = mass_on_stop(mass, mu=mu, load=load)
    size = np.sqrt(mass)
    run = run_on_stop(system, [0.0, 0.0, -size * speed, 0.0], 0.7)
    braking = mu * load / mass
    rest = np.log1p(DAMPING * speed / braking) / DAMPING
    distance = (speed - braking * rest) / DAMPING
    assert run.states[-10:, 0] / size == pytest.approx(np.full(10, -distance), rel=1e-5)
    assert np.abs(run.states[-1, 2:]).max() < 1e-12 * speed
    assert run.energies.imbalance < 1e-6


def test_small_imbalances_count_where_energies_are_small():
    """A thousandth of the energy of a vibration of 1e-9 m is more than rounding."""
    rows = [[0.0], [1.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[1e4]], {"contact": [rows], "C": rows})
    system = fc.ContactSystem(basis, normal=LinearContact(1e6, 0.0),
                              friction=ConstantFriction(0.0), load=fc.Load(10.0))
    run = fc.simulate(system, 0.1, initial=[-10.0 / 1.01e6, 1e-6], outputs=101)
    assert run.energies.rounding < 1e-3 * 0.5e-12
