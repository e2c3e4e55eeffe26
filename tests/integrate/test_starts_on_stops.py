"""Runs that start on rigid stops at gap zero, against motions along the stop in closed form."""

import numpy as np
import pytest

import fecontact as fc
from fecontact import Status
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.system import columns

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


def two_nodes(seed, damping):
    """Four modes with no load on two stops with friction, and a start that touches both."""
    rng = np.random.default_rng(seed)
    spring, dashpot = rng.standard_normal((2, 4, 4))
    rows = np.concatenate([rng.standard_normal((2, 2, 4)), np.zeros((2, 1, 4))], axis=1)
    basis = fc.basis_from_matrices(
        np.eye(4), 1e6 * spring @ spring.T, {"contact": rows, "C": rows[0]},
        damping=damping * dashpot @ dashpot.T)
    system = fc.ContactSystem(basis, normal=LinearContact(1e6, 0.0),
                              friction=ConstantFriction(0.3))
    q, normal = rng.standard_normal(4), system.arrays.rows[:, 1]
    q -= np.linalg.pinv(normal) @ (normal @ q)
    return system, 1e-3 * np.append(q, np.zeros(4))


@pytest.mark.parametrize(("seed", "damping"), [(2, 10.0), (3, 1.0), (4, 100.0), (8, 10.0)])
def test_fades_on_stops(seed, damping):
    """Energy falls to nothing in few events, which do not stop the slip of other contacts."""
    system, start = two_nodes(seed, damping)
    calls = []

    def few_calls(time):
        calls.append(time)
        assert len(calls) < 200, f"crawls at t = {time:.9g} s"

    run = fc.simulate(system, 0.5, initial=start, outputs=101, solver=SetValued(restitution=0.5),
                      progress=few_calls)
    assert run.status is Status.FINISHED
    assert run.statistics["events"] < 3000
    q, rate = run.states[:, :4], run.states[:, 4:]
    energy = 0.5 * (np.einsum("ti,ij,tj->t", q, system.arrays.stiffness, q)
                    + (rate * rate).sum(axis=1))
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert energy[-1] < 1e-7 * energy[0]
    assert run.energies.imbalance < 1e-6
    penetration = system.contact_history(run.time, run.states)[:, :, columns.PENETRATION]
    assert penetration.max() < 1e-9 * np.abs(start).max()
