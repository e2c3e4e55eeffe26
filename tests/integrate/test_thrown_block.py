"""A block thrown across a belt: closed forms without smoothing and with it, mass and solid."""

import numpy as np
import pytest
import thrown_block as tb


def test_closed_form_is_that_of_the_tables():
    assert pytest.approx(0.3798960, abs=5e-8) == tb.STOP
    assert pytest.approx([0.0949740, 0.1899480], abs=5e-8) == tb.PLACE
    assert tb.path(np.array([0.0, tb.STOP, 2.0 * tb.STOP])) == pytest.approx(
        np.array([[0.0, 0.0], tb.PLACE, tb.PLACE + tb.BELT * tb.STOP]), abs=1e-12)


@pytest.mark.parametrize("smoothing", ["arctan", "tanh", "square-root"])
def test_smoothing_lets_a_mass_creep_as_far_as_its_integral_says(smoothing):
    """1e-4 of what smoothing adds, at slopes a hundred times apart."""
    found = {slope: tb.thrown_mass(smoothing, slope).excess for slope in (1e2, 1e4)}
    for slope, far in found.items():
        assert far == pytest.approx(tb.excess(smoothing, slope), rel=1e-4, abs=5e-11)
    # The arctan's tail makes its error of the first order in 1 / k_s, others are of the second.
    rate = np.log(found[1e2] / found[1e4]) / np.log(100.0)
    assert rate == pytest.approx({"arctan": 1.0, "tanh": 2.0, "square-root": 1.867}[smoothing],
                                 abs=0.01)


def test_leading_terms_of_the_excess():
    """Written down by hand for large k_s: 2 |u| / (pi k_s mu g), pi^4 / (48 k_s^2 mu g)."""
    slope, weight = 1e5, tb.MU * tb.G
    assert tb.excess("arctan", slope) == pytest.approx(
        2.0 * tb.SPEED / (np.pi * slope * weight), rel=1e-4)
    assert tb.excess("tanh", slope) == pytest.approx(
        np.pi**4 / (48.0 * slope**2 * weight), rel=1e-8)
    y = 2.0 * slope * tb.SPEED / np.pi
    assert tb.excess("square-root", slope) == pytest.approx(
        0.5 * (np.pi / (2.0 * slope)) ** 2 * (np.log(2.0 * y) + 0.5) / weight, rel=1e-4)


def test_path_of_the_mass():
    throw = tb.thrown_mass("tanh", 1e4)
    assert throw.stop == pytest.approx(tb.STOP, rel=1e-8)
    assert throw.stuck_at == pytest.approx(tb.PLACE, abs=2e-8)
    assert throw.places == pytest.approx(tb.path(throw.run.time), abs=2e-8)


@pytest.fixture(scope="module")
def block():
    return tb.thrown_block(1e4)


def test_block_of_finite_elements_sticks_where_the_mass_does(block):
    """Equal to the mass with the same smoothed law; 4e-5 s and 3e-5 m from the unsmoothed law."""
    mass = tb.thrown_mass("arctan", 1e4)
    assert block.stop == pytest.approx(mass.stop, abs=2e-7)
    assert block.stuck_at == pytest.approx(mass.stuck_at, abs=5e-7)
    assert block.excess == pytest.approx(tb.excess("arctan", 1e4), rel=0.02)
    assert block.stop == pytest.approx(tb.STOP, abs=5e-5)
    assert block.stuck_at == pytest.approx(tb.PLACE, abs=3e-5)
    assert np.abs(block.places - tb.path(block.run.time)).max() < 4e-5


def test_front_of_the_block_carries_more(block):
    """Friction at the bottom tilts it: the centre of pressure runs ahead by mu h / 2."""
    sliding = (block.run.time > 0.1) & (block.run.time < 0.9 * tb.STOP)
    wanted = 0.5 * tb.MU * tb.SHAPE.height * tb.RELATIVE / tb.SPEED
    found = tb.lean(block)
    assert found[sliding] == pytest.approx(np.tile(wanted, (np.count_nonzero(sliding), 1)),
                                           rel=1e-3)
    assert found[-1] == pytest.approx([0.0, 0.0], abs=1e-5)
    assert np.abs(tb.turn(block)).max() < 2e-6


def test_energy_of_the_throw(block):
    """Friction loses the energy of the motion over the belt; the account closes."""
    body_mass = 7850.0 * 0.06 * 0.04 * 0.02
    energies = block.run.energies
    assert energies.friction[-1] == pytest.approx(0.5 * body_mass * tb.SPEED**2, rel=3e-4)
    assert energies.imbalance < 1e-6
    states = block.run.contact_state
    assert (states[block.run.time < 0.98 * tb.STOP] == 2).all()
    assert (states[block.run.time > 1.02 * tb.STOP] == 1).all()
