"""The example of a bolted plate: bolts, loops of microslip, and ring-downs beside them."""

import bolted_plate as example
import numpy as np
import pytest


@pytest.fixture(scope="module")
def mode():
    return example.stuck_mode()


def force_for(mode, deflection):
    return mode.angular_frequency**2 * deflection / abs(mode.end)


def test_bolts_press_as_much_as_they_are_stretched(mode):
    system = example.plate()
    basis, q = system.basis, mode.rest[: system.basis.modes]
    normal = system.at(mode.rest).normal_force
    heads, nuts = ([basis.T[basis.point_index(name), 2] @ q for name in names]
                   for names in (("upper.head1", "upper.head2"), ("lower.nut2", "lower.nut1")))
    tension = example.BOLT * (np.subtract(heads, nuts) + example.SHORTENING)
    assert normal.sum() == pytest.approx(tension.sum(), rel=1e-9)
    assert (normal > 0.0).all()
    # The resultant of the pressure lies between the bolts.
    middle = normal @ basis.contact_places[:, :2] / normal.sum()
    places = [basis.positions[basis.point_index(name), :2] for name in ("upper.head1",
                                                                        "upper.head2")]
    assert middle == pytest.approx(tension @ places / tension.sum(), abs=1e-9)


def test_small_loops_are_those_of_the_stuck_mode(mode):
    """The Jacobian of the system, and the equations of the loop, have the same stiffness."""
    small = example.loop(mode, force_for(mode, 1e-5), 4)
    frequency, ratio = small.damped(mode)
    assert frequency == pytest.approx(mode.angular_frequency / (2.0 * np.pi), rel=1e-8)
    assert ratio == pytest.approx(mode.damping_ratio, rel=1e-9)
    assert abs(small.area) < 1e-9 * small.force.max() * small.amplitude


def test_area_of_a_loop_is_the_work_of_friction(mode):
    losses = []
    for deflection in (0.6e-3, 1e-3, 3e-3):
        one = example.loop(mode, force_for(mode, deflection), 20)
        assert one.area == pytest.approx(one.loss, rel=1e-3)
        losses.append(one.loss)
    # Microslip grows faster than the square of the amplitude, macroslip more slowly.
    first, second = np.diff(np.log(losses)) / np.diff(np.log([0.6e-3, 1e-3, 3e-3]))
    assert first > 3.0
    assert 1.0 < second < 2.5


@pytest.mark.slow
def test_ring_down_follows_the_loops(mode):
    run, cycles = example.ring_down(mode, 1e-3 / abs(mode.end), 3)
    assert abs(run.energies.imbalance) < 1e-5
    stuck = mode.angular_frequency / (2.0 * np.pi)
    estimated = example.estimate(mode, np.linspace(0.9e-3, 1e-3, 3))
    assert estimated[0, 0] < cycles[:, 0].min() < cycles[:, 0].max() < estimated[-1, 0]
    frequency, ratio = (np.interp(cycles[:, 0], estimated[:, 0], estimated[:, k]) for k in (1, 2))
    # The loop leaves out the inertia of other modes than the one that rings.
    assert cycles[:, 1] == pytest.approx(frequency, rel=2e-4)
    assert stuck - cycles[:, 1] == pytest.approx(stuck - frequency, rel=0.08)
    assert cycles[:, 2] == pytest.approx(ratio, rel=0.06)
    assert (cycles[:, 2] > 10.0 * mode.damping_ratio).all()
