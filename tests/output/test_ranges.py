"""Ranges of motions over bodies and time, against all sums of modes at once."""

import numpy as np
import pytest

from fecontact.fem.von_mises import von_mises_of
from fecontact.output.render.ranges import Ranges


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("drifts", [False, True])
def test_ranges_are_those_of_all_sums(d, drifts):
    rng = np.random.default_rng(d)
    nodes, shapes = rng.uniform(0.0, 1e-3, (40, d)), rng.standard_normal((40, d, 5))
    stress = 1e9 * rng.standard_normal((40, 4 if d == 2 else 6, 7))
    q = 1e-3 * rng.standard_normal((300, 7)) * [1.0, 1.0, 5.0, 1e-3, 1.0, 2.0, 1.0]
    drift = drifts * 3.0 * rng.standard_normal((d - 1, 5))
    found = Ranges(nodes, shapes, stress, q, drift)
    moved = np.einsum("pcm,tm->tpc", shapes, q[:, :5])
    along = np.zeros((300, 1, d))
    along[:, 0, :-1] = q[:, :5] @ drift.T
    assert found.largest_displacement == pytest.approx(np.linalg.norm(moved, axis=2).max())
    assert found.largest_magnified == pytest.approx(np.linalg.norm(moved - along, axis=2).max())
    for scale in (1.0, 30.0):
        places = np.concatenate([nodes[None], nodes + scale * (moved - along) + along])
        assert found.box(scale) == pytest.approx(np.stack([places.min(axis=(0, 1)),
                                                           places.max(axis=(0, 1))]))
    largest = von_mises_of(np.einsum("pcm,tm->ctp", stress, q)).max(axis=0)
    assert found.largest_stress == pytest.approx(largest.max())
    assert found.peak_node == largest.argmax()


def test_von_mises_stress_of_shear_and_tension():
    """The square root of three times a shear; a tension itself; nothing under pressure alone."""
    for stress, wanted in (([0.0, 0.0, 0.0, 2.0], 2.0 * 3.0**0.5), ([0.0, -5.0, 0.0, 0.0], 5.0),
                           ([3.0, 3.0, 3.0, 0.0, 0.0, 0.0], 0.0),
                           ([0.0, 0.0, 0.0, 0.0, 1.0, 0.0], 3.0**0.5)):
        assert von_mises_of(np.array(stress)) == pytest.approx(wanted)
