"""Compiled steps that may meet the start of their branch again, on known curves."""

from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.bifurcation import ContinuationOptions
from fecontact.bifurcation.harmonic.compiled.step_batches import StepBatches

# One harmonic of one displacement, and the parameter.
PROBLEM = SimpleNamespace(harmonics=1, periods=1, scales=np.ones(4), reference=np.zeros((3, 1)))


def before_start(curve, angles):
    """Number of points on a curve (c, p) at angles, from the first, before it meets that again."""
    points = np.array([[0.0, c, 0.0, p] for c, p in map(curve, angles)])
    first = SimpleNamespace(u=points[0])
    u = points[1:]
    weights = np.array([1.0, 0.5, 0.5, 1.0])
    lengths = np.sqrt((weights * np.diff(points, axis=0)**2).sum(axis=1))
    return StepBatches(ContinuationOptions())._before_start(
        PROBLEM, first, first, u, np.ones((len(u), 2)), lengths)


@pytest.mark.parametrize("first", [0.3, 1.6, 3.0, 4.0, 5.5])
@pytest.mark.parametrize("turns", [1.0, -1.0])
def test_a_loop_is_met_in_the_step_that_closes_it(first, turns):
    """Wherever it begins, with short steps at first, and with steps that grow from nothing."""
    for steps in (np.full(200, 0.05), np.minimum(1e-3 * 1.5 ** np.arange(200.0), 0.05)):
        way = np.append(0.0, np.cumsum(steps))
        closing = int(np.flatnonzero(way >= 2.0 * np.pi)[0]) - 1
        found = before_start(lambda a: (3.0 + np.cos(a), 2.0 + np.sin(a)), first + turns * way)
        assert closing - 4 <= found <= closing


def test_a_curve_that_goes_on_or_passes_elsewhere_does_not_meet_its_start():
    way = np.append(0.0, np.cumsum(np.minimum(1e-4 * 1.5 ** np.arange(150.0), 0.05)))
    assert before_start(lambda a: (np.sin(a), a), way) == 150
    # It turns, and comes back to the parameter of its start with another amplitude.
    assert before_start(lambda a: (a, np.sin(a)), way) == 150


def test_a_curve_that_turns_at_once_is_looked_at_from_there():
    """A loop in the first steps, and one that begins in a fold."""
    way = np.append(0.0, np.cumsum(np.full(30, 0.3)))
    assert before_start(lambda a: (np.cos(a), np.sin(a)), way) in range(17, 21)
    assert before_start(lambda a: (np.cos(a), np.sin(a)), 0.5 * np.pi + way) in range(17, 21)
