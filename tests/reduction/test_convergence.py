"""Contact forces converge with mesh and nodes; loads on single nodes do not."""


import numpy as np
import pytest
from contact_convergence import row


@pytest.fixture(scope="module")
def rows():
    return [row(size, nodes) for size, nodes in ((0.01, 10), (0.005, 20), (0.0025, 40))]


@pytest.mark.parametrize("quantity", ["deflection", "middle_force", "peak_pressure"])
def test_spread_loads_converge(rows, quantity):
    values = np.array([getattr(r, quantity) for r in rows])
    steps = np.abs(np.diff(values))
    assert steps[1] < 0.4 * steps[0]
    assert steps[1] < 0.01 * abs(values[-1])


def test_contact_share_is_known_to_a_segment(rows):
    shares = np.array([r.contact_share for r in rows])
    assert np.abs(np.diff(shares)).max() <= 0.1
    assert abs(shares[2] - 0.587) < 0.025


def test_whole_load_is_carried_by_the_middle_of_the_beam(rows):
    assert 0.55 * 5000.0 < rows[-1].middle_force < 0.65 * 5000.0


def test_a_load_on_one_node_drifts_by_the_same_amount_with_every_refinement():
    deflections = np.array([row(size, 10, spread=False).deflection
                            for size in (0.01, 0.005, 0.0025)])
    steps = np.diff(deflections)
    # Flamant: u = 2 P ln(r) / (pi E t) + constant on the edge of a half-plane.
    assert steps[1] == pytest.approx(
        2.0 * 5000.0 * np.log(2.0) / (np.pi * 2.1e11 * 0.01), rel=0.02)


def test_motion_converges_too():
    coarse, fine = (row(size, nodes, moving=True) for size, nodes in ((0.01, 10), (0.005, 20)))
    assert coarse.slipped == pytest.approx(fine.slipped, rel=1e-3)
    assert coarse.stick_share == pytest.approx(fine.stick_share, abs=0.04)
    assert 0.3 < fine.stick_share < 0.7
