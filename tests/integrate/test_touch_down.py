"""Touch-down of event-driven runs from penetrations of zero and its neighbours, against Rodas5P.

A stop without penetration is neither open nor closed by its sign: what the run does there may not
depend on the last digit of a penetration.
"""

import numpy as np
import pytest

import fecontact as fc
from fecontact import Status
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import ConstantFriction, LinearContact, RoughSurface

GAP, WEIGHT, STIFFNESS = 10e-3, 9.81, 1e7


def mass(gap=GAP, mu=0.3, normal=None, springs=(0.0, 0.0), slope=1e3):
    """A mass of 1 kg in the plane above the ground."""
    rows = np.eye(3)[:, :2]
    basis = fc.basis_from_matrices(np.eye(2), np.diag(springs), {"contact": [rows], "C": rows})
    return fc.ContactSystem(
        basis, normal=LinearContact(STIFFNESS, damping=300.0) if normal is None else normal,
        friction=ConstantFriction(mu, slope), load=fc.Load(WEIGHT), gap=gap)


def chain(gap):
    """Four masses in a row, of which the first and the last are above the ground."""
    K = np.zeros((8, 8))
    for i in range(3):
        for a, b in ((2 * i, 2 * i + 2), (2 * i + 1, 2 * i + 3)):
            K[[a, b], [a, b]] += 1e5
            K[[a, b], [b, a]] -= 1e5
    rows = np.zeros((2, 3, 8))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 6] = rows[1, 1, 7] = 1.0
    basis = fc.basis_from_matrices(np.eye(8), K, {"contact": rows, "C": rows[0]})
    return fc.ContactSystem(basis, normal=LinearContact(1e6), load=fc.Load(WEIGHT), gap=gap,
                            friction=ConstantFriction(0.3, 1e3))


def runs(system, sizes, count, **options):
    """Event-driven runs from rest in place with random velocities."""
    rng, m = np.random.default_rng(3), system.basis.modes
    for _ in range(count):
        start = np.concatenate([np.zeros(m), rng.normal(size=m) * sizes])
        yield start, fc.simulate(system, 0.3, initial=start, outputs=7, solver=SetValued(),
                                 **options)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("normal", [
    None, LinearContact(1e5), RoughSurface(1e5, 1e-4)], ids=["damped", "linear", "rough"])
def test_masses_that_fall_touch_down(normal, mu, rtol):
    for _, run in runs(mass(mu=mu, normal=normal), [1.0, 0.1], 15, rtol=rtol):
        assert run.status is Status.FINISHED
        assert run.energies.imbalance < 1e-3


@pytest.mark.parametrize(("system", "sizes"), [
    (mass(gap=2e-3, springs=(3e4, 2e3)), [1.0, 0.1]), (chain((5e-3, 7e-3)), 0.3)],
    ids=["springs", "chain"])
def test_masses_on_springs_touch_down(system, sizes):
    for _, run in runs(system, sizes, 15):
        assert run.status is Status.FINISHED


def test_touch_down_without_friction_agrees_with_the_stiff_integrator():
    system = mass(mu=0.0)
    for start, run in runs(system, [1.0, 0.1], 6, rtol=1e-10):
        smooth = fc.simulate(system, 0.3, initial=start, outputs=7, rtol=1e-10)
        assert run.states == pytest.approx(smooth.states, abs=1e-6)


def test_touch_down_of_a_rubbing_mass_agrees_with_the_closed_form():
    """The impulse of friction is mu times that of the normal force while the mass slips on."""
    mu, normal = 0.3, LinearContact(1e6)
    start = np.array([0.0, 0.0, 1.0, -0.5])
    run = fc.simulate(mass(mu=mu, normal=normal), 0.04, initial=start, outputs=5, rtol=1e-11,
                      solver=SetValued(), events=ContactEvents())
    fall = (-0.5 + np.sqrt(0.25 + 2.0 * WEIGHT * GAP)) / WEIGHT
    speed = 0.5 + WEIGHT * fall
    assert run.events.kind == ("touch-down", "lift-off")
    assert run.events.time[0] == pytest.approx(fall, abs=1e-11)
    assert run.events.states[1, 3] == pytest.approx(speed, rel=1e-6)
    impulse = 2.0 * speed + WEIGHT * (run.events.time[1] - fall)
    assert run.states[-1, 2] == pytest.approx(1.0 - mu * impulse, rel=1e-8)


@pytest.mark.parametrize("side", [-1, 0, 1])
@pytest.mark.parametrize("gap", [0.0, 10e-3, 1.0 / 3.0])
@pytest.mark.parametrize("slip", [0.0, 0.2])
@pytest.mark.parametrize("speed", [-0.5, 0.0, 0.5])
def test_neighbours_of_zero_have_one_future(speed, slip, gap, side):
    """Approaching, resting and leaving, at zero penetration and at both floating-point neighbours.

    All agree with the stiff integrator in the vertical motion, which has no friction.
    """
    system = mass(gap=gap, normal=LinearContact(1e5, damping=50.0))
    row = system.basis.T[-1, :2]
    place = -gap if side == 0 else np.nextafter(-gap, side * np.inf)
    start = np.linalg.solve(row, [[0.0, slip], [place, speed]]).T.ravel()
    run = fc.simulate(system, 0.05, initial=start, outputs=6, rtol=1e-9, solver=SetValued())
    assert run.status is Status.FINISHED
    smooth = fc.simulate(system, 0.05, initial=start, outputs=6, rtol=1e-9)
    assert run.penetration[:, 0] == pytest.approx(smooth.penetration[:, 0], abs=1e-8)
    assert run.penetration_rate[:, 0] == pytest.approx(smooth.penetration_rate[:, 0], abs=1e-5)
    # Friction takes mu times the impulse of the normal force, until slip has come to rest.
    impulse = -speed - run.penetration_rate[:, 0] + WEIGHT * run.time
    assert run.slip_velocity[:, 0] == pytest.approx(
        np.maximum(slip - 0.3 * impulse, 0.0), abs=1e-7)
