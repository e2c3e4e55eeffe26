"""Two spheres beside Hertz, Cattaneo and Mindlin, and beside increments without any time."""

import numpy as np
import pytest
import two_spheres as ts

import fecontact as fc

RINGS = 11


@pytest.fixture(scope="module")
def found():
    return ts.cycle(RINGS)


def increments(system, limits, travels):
    """Forces (k,) of the first loading: rings that slip carry their limits, others follow."""
    basis = system.basis
    n = len(limits)
    stiffness = basis.angular_frequencies**2
    elastic = stiffness > 0.0
    rows = np.einsum("nij,i->nj", basis.contact_T[:, :2], [np.cos(ts.ANGLE), np.sin(ts.ANGLE)])
    given = (rows[:, elastic] / stiffness[elastic]) @ rows[:, elastic].T
    forces = []
    for travel in travels:
        slips = limits == 0.0
        while True:
            force = limits.copy()
            held = ~slips
            force[held] = np.linalg.solve(
                given[np.ix_(held, held)], travel - given[np.ix_(held, slips)] @ limits[slips])
            more = slips | (force > limits * (1.0 + 1e-12))
            if (more == slips).all():
                break
            slips = more
        forces.append(force.sum())
    assert given.shape == (n, n)
    return np.array(forces)


def test_closed_forms_agree_with_each_other():
    """Masing: the loss is eight times the area between first loading and its chord."""
    exact = ts.ClosedForm(0.3)
    part = 1.0 - np.linspace(1.0, 0.5, 20001) ** 3
    place = np.array([exact.displacement(one) for one in part])
    force = ts.MU * exact.load * part
    area = np.trapezoid(force, place) - 0.5 * force[-1] * place[-1]
    assert exact.loss(part[-1]) == pytest.approx(8.0 * area, rel=1e-6)
    # Hertz with 1 / E* = 2 (1 - nu^2) / E and 1 / R = 2 / R_1.
    assert exact.load == pytest.approx(
        4.0 / 3.0 * exact.modulus * np.sqrt(0.5 * ts.RADIUS) * exact.approach**1.5, rel=1e-12)


def test_distances_of_discs():
    """In the middle 2 pi R, at the edge 4 R, far away the area over the distance."""
    assert ts.disc(np.array([0.0, 2.0, 2.0 - 1e-9, 400.0]), np.full(4, 2.0)) == pytest.approx(
        [4.0 * np.pi, 8.0, 8.0, 4.0 * np.pi / 400.0], rel=1e-5)


def test_normal_contact_is_that_of_hertz(found):
    """Eleven rings: the approach to 0.1 %, peak and width to 0.5 %."""
    peak, width = found.peak_and_width
    assert found.approach == pytest.approx(found.exact.approach, rel=1e-3)
    assert peak == pytest.approx(found.exact.peak, rel=2e-3)
    assert width == pytest.approx(ts.WIDTH, rel=5e-3)


def test_partial_slip_is_that_of_cattaneo_and_mindlin(found):
    """Eleven rings: the circle that sticks to 3 %, the force to 0.3 %, the loss to 1 %."""
    quarter = np.argmax(found.travel)
    assert found.force[quarter] == pytest.approx(0.75 * ts.MU * found.exact.load, rel=3e-3)
    assert found.sticking_part == pytest.approx(0.25 ** (1.0 / 3.0), rel=0.03)
    assert found.loss == pytest.approx(found.exact.loss(0.75), rel=0.01)
    # Friction is opposite to the motion, at 30 degrees to the x axis.
    across = found.run.friction_forces @ [-np.sin(ts.ANGLE), np.cos(ts.ANGLE)]
    assert np.abs(across).max() < 1e-9 * found.exact.load


def test_loop_is_that_of_increments_without_time(found):
    """Loop of the same rings without inertia, rates and springs, to 0.1 %; Masing's loss."""
    system = found.run.system
    travels = found.exact.displacement(0.75) * np.linspace(0.0, 1.0, 801)[1:]
    forces = increments(system, ts.MU * found.run.normal_force[0], travels)
    first = found.run.time <= 0.25
    assert found.force[first][1:] == pytest.approx(
        np.interp(found.travel[first][1:], travels, forces), abs=3e-4 * forces[-1])
    area = np.trapezoid([0.0, *forces], [0.0, *travels]) - 0.5 * forces[-1] * travels[-1]
    assert found.loss == pytest.approx(8.0 * area, rel=1e-3)
    whole = found.run.time >= 0.25
    loop = np.trapezoid(found.force[whole], found.travel[whole])
    assert loop == pytest.approx(found.loss, rel=5e-3)


def test_many_rings_converge():
    """Increments alone: the force to 1e-4, the loss to 0.15 % with 44 rings."""
    exact, system = ts.ClosedForm(ts.RATIO), ts.spheres(44)
    state = np.zeros(system.size)
    state[: system.basis.modes] = fc.equilibrium(system).modal_coordinates
    pressing = system.at(state).normal_force
    travels = exact.displacement(0.75) * np.linspace(0.0, 1.0, 801)[1:]
    forces = increments(system, ts.MU * pressing, travels)
    assert forces[-1] == pytest.approx(0.75 * ts.MU * exact.load, rel=1e-4)
    area = np.trapezoid([0.0, *forces], [0.0, *travels]) - 0.5 * forces[-1] * travels[-1]
    assert 8.0 * area == pytest.approx(exact.loss(0.75), rel=1.5e-3)


def test_elements_turn_back_all_at_once():
    """Rounding of deflections is no end of slip: the run ended there, or stood still."""
    finer = ts.cycle(22).run
    assert finer.status is fc.Status.FINISHED
    assert finer.statistics["steps"] < 40000
