"""Runs that still approach the motion on which they settle."""

import numpy as np
import pytest

from fecontact.bifurcation import Axis, basins, vector_field
from fecontact.bifurcation.attractors.attractor import distinguished
from fecontact.bifurcation.attractors.labels import Settled

RUNS, KEPT = 1000, 32


def labels_of(points):
    """Labels of runs (E, K, size), and their attractors."""
    rows, still = np.full(len(points), points.shape[1]), np.zeros(len(points), dtype=np.int64)
    sizes = np.abs(points).max(axis=(0, 1))
    return distinguished([lambda: Settled(points, rows, still)], sizes, 1e-3)


@pytest.mark.parametrize(("period", "decay"), [(1, 0.5), (1, 0.92), (3, 0.5), (3, 0.8)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_decay_to_a_motion_has_not_settled(period, decay, sign):
    k = np.arange(KEPT)
    orbit = np.resize(np.arange(1.0, period + 1.0), KEPT)
    left = 0.3 * (sign * decay) ** (k // period)
    labels, attractors = labels_of((orbit + left)[np.newaxis, :, np.newaxis])
    assert labels.tolist() == [-1]
    assert attractors == ()


@pytest.mark.parametrize(("decay", "label"), [(0.95, -1), (0.98, 0)])
def test_decay_of_less_than_a_third_in_a_third_of_the_states_counts_as_aperiodic(decay, label):
    """0.95^10 = 0.60 and 0.98^10 = 0.82: what the label of basins says of slow decay."""
    points = 1.0 + 0.3 * decay ** np.arange(KEPT)
    labels, attractors = labels_of(points[np.newaxis, :, np.newaxis])
    assert labels.tolist() == [label]
    assert [one.kind for one in attractors] == ["aperiodic"] * (label + 1)


def test_motions_that_do_not_settle_are_aperiodic():
    """Chaos of the logistic and the Henon map, and rotations by any angle."""
    rng = np.random.default_rng(1)
    x, y = 0.2 * rng.random((2, RUNS))
    u = rng.random(RUNS)
    henon, logistic = np.empty((RUNS, KEPT, 2)), np.empty((RUNS, KEPT, 1))
    for k in range(-200, KEPT):
        x, y, u = 1.0 - 1.4 * x**2 + y, 0.3 * x, 3.9 * u * (1.0 - u)
        if k >= 0:
            henon[:, k, 0], henon[:, k, 1], logistic[:, k, 0] = x, y, u
    angle = 2.0 * np.pi * rng.random(RUNS)[:, np.newaxis] * np.arange(KEPT)
    rotations = np.stack([np.cos(angle) + 0.2 * np.cos(2.0 * angle), np.sin(angle)], axis=-1)
    assert (labels_of(rotations)[0] >= 0).all()
    for chaos in (henon, logistic):
        labels, attractors = labels_of(chaos)
        assert (labels < 0).mean() < 0.005
        assert attractors[0].kind == "aperiodic"
        assert attractors[0].share > 0.9


def forced(t, x, p, out):
    out[0] = x[1]
    out[1] = np.cos(2.0 * t) - 2.0 * p[0] * x[1] - x[0]


def test_an_oscillator_needs_its_transient():
    """A free motion exp(-D t) is left beside the forced one until it is below the tolerance."""
    field = vector_field(forced, {"D": 0.02}, ("x", "v"), period=np.pi)
    starts = ((Axis("x"), [-1.0, 0.0, 2.0]), (Axis("v"), [0.0, 1.0]))
    early = basins(field, *starts, transient_periods=20)
    assert (early.label == -1).all()
    assert early.attractors == ()
    late = basins(field, *starts, transient_periods=150)
    assert (late.label == 0).all()
    (motion,) = late.attractors
    assert motion.kind == "periodic"
    # The forced motion at the phase zero of the excitation: Re and -2 Im of 1 / (1 - 4 + 4 i D).
    response = 1.0 / (-3.0 + 0.08j)
    assert motion.points[0] == pytest.approx([response.real, -2.0 * response.imag], abs=1e-3)
