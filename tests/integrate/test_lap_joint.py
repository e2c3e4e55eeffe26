"""The example of a bolted lap joint: clamping, microslip, Masing's rules, frequency shift."""

import lap_joint as example
import numpy as np
import pytest

from fecontact import LoadPath, load_history
from fecontact.analysis import prestressed_modes


@pytest.fixture(scope="module")
def along():
    return example.joint()


@pytest.fixture(scope="module")
def rest(along):
    return example.bolted(along)


def end_of(system, history):
    row = system.basis.T[system.basis.point_index("upper.end"), 0]
    return history.modal_coordinates @ row


def test_bolts_press_as_much_as_they_are_stretched(along, rest):
    basis, q = along.basis, rest.modal_coordinates[-1]
    tension = 0.0
    for k in (1, 2):
        head, nut = (basis.T[basis.point_index(name), 1] for name in (f"upper.head{k}",
                                                                     f"lower.nut{k}"))
        tension += example.BOLT * ((head - nut) @ q + 1e-5)
    assert rest.normal_force[-1].sum() == pytest.approx(tension, rel=1e-8)
    assert tension < 2.0 * example.BOLT * 1e-5
    assert np.abs(rest.friction_force[-1]).max() < 1e-3


def test_pressing_twice_as_much_is_twice_as_strong(along, rest):
    """Closed contacts on linear springs: all is proportional to the shortening."""
    twice = example.bolted(example.joint(2e-5))
    assert twice.normal_force[-1] == pytest.approx(2.0 * rest.normal_force[-1], rel=1e-8)
    one, two = (example.pulled(system, force).loop(1, 3).loss
                for system, force in ((along, 300.0), (example.joint(2e-5), 600.0)))
    assert two == pytest.approx(4.0 * one, rel=1e-5)


def test_loop_loses_its_area(along):
    losses = []
    for force in (300.0, 400.0, 500.0):
        loop = example.pulled(along, force, 200).loop(1, 3)
        assert loop.area == pytest.approx(loop.loss, rel=1e-3)
        losses.append(loop.loss)
    # Loss grows faster than the square of the force, as in microslip.
    exponents = np.diff(np.log(losses)) / np.diff(np.log([300.0, 400.0, 500.0]))
    assert (exponents > 2.5).all()


def firmer(factor):
    """Bolts that press more, with as much less friction: loads hardly change the pressure."""
    return example.joint(1e-5 * factor).with_(
        **{"interfaces.lap.friction.friction_coefficient": example.COEFFICIENT / factor})


def test_loops_follow_masing_under_constant_pressure():
    """Unloading is first loading, scaled by two, as far as the bolts press as before."""
    steps, force = 40, 400.0
    misfit = []
    for factor in (1.0, 100.0, 1000.0):
        system = firmer(factor)
        history = example.pulled(system, force, steps)
        x = end_of(system, history)
        first, down = x[: steps + 1] - x[0], x[steps] - x[steps : 2 * steps + 1]
        slip = np.abs(first - first[1] * np.arange(steps + 1)).max()
        misfit.append(np.abs(down - 2.0 * first).max() / slip)
    assert misfit[0] > 0.05
    assert misfit[1] < 0.02 * misfit[0]
    assert misfit[2] < 0.2 * misfit[1]


def test_friction_carries_the_load_within_its_limits(along):
    history = load_history(along, LoadPath(forces=((0.0, 900.0),), steps=90))
    assert history.status == "finished"
    carried = -history.friction_force.sum(axis=1)
    assert np.abs(carried) == pytest.approx(10.0 * np.arange(91), rel=1e-6, abs=1e-3)
    limit = example.COEFFICIENT * history.normal_force
    assert (np.abs(history.friction_force) <= limit * (1.0 + 1e-9)).all()
    slipping = (history.contact_state == 2).sum(axis=1)
    assert slipping[10] == 0
    assert slipping[-1] >= 5


def test_small_vibrations_are_those_of_stuck_contacts_and_large_ones_are_slower():
    system = example.joint(component="y")
    stuck = prestressed_modes(system, example.bolted(system)).frequencies_hz[0]
    found = np.array([example.struck(system, amplitude) for amplitude in (5e-5, 1e-3, 2e-3)])
    assert found[0, 0] == pytest.approx(stuck, rel=5e-5)
    assert found[0, 1] == pytest.approx(5e-5, rel=0.01)
    # Rigidly stuck faces and free ones bound the frequency; the joint slips and softens.
    shift = 1.0 - found[:, 0] / stuck
    assert 2e-3 < shift[1] < shift[2] < 1e-2
