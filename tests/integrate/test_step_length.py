"""Lengths of steps by their errors, against the formula of predictive control."""

import numpy as np
import pytest

from fecontact.integrate.rodas5p.step_length import (
    LAST_ROOT,
    LAST_STEP,
    REJECTED_LAST,
    growth,
    length_beyond,
    next_length,
    root_of,
)


def lengths(steps, longest=1.0, rejected=()):
    """Lengths that follow accepted steps of given lengths and errors."""
    numbers, found = np.zeros(5), []
    for count, (h, error) in enumerate(steps):
        numbers[REJECTED_LAST] = float(count in rejected)
        found.append(next_length(h, root_of(error), longest, numbers))
        assert numbers[LAST_STEP] == h
        assert numbers[REJECTED_LAST] == 0.0
        assert numbers[LAST_ROOT] == pytest.approx(max(error, 1e-2) ** -0.2, rel=1e-12)
    return found


def test_first_step_is_followed_by_its_own_error():
    assert lengths([(1e-3, 0.5)]) == pytest.approx([0.9e-3 * 0.5**-0.2], rel=1e-12)


def test_errors_that_rise_are_foreseen():
    # Gustafsson: h (e_n)^(-1/5) (h_n / h_(n-1)) (e_n / e_(n-1))^(-1/5), if that is shorter.
    alone = 2e-3 * 0.9 * 0.8**-0.2
    assert lengths([(1e-3, 0.2), (2e-3, 0.8)])[1] == pytest.approx(
        min(alone, alone * 2.0 * (0.8 / 0.2) ** -0.2), rel=1e-12)
    alone = 0.5e-3 * 0.9 * 0.8**-0.2
    assert lengths([(1e-3, 0.2), (0.5e-3, 0.8)])[1] == pytest.approx(
        alone * 0.5 * (0.8 / 0.2) ** -0.2, rel=1e-12)


def test_steps_change_within_bounds():
    assert growth(root_of(0.0)) == 8.0
    assert growth(root_of(1e-6)) == 8.0
    assert growth(root_of(1e-4)) == pytest.approx(0.9 * 1e-4**-0.2, rel=1e-12)
    assert growth(root_of(1e6)) == pytest.approx(0.1, rel=1e-12)
    assert growth(root_of(np.inf)) == 0.1
    assert lengths([(1e-3, 1e-9)], longest=2e-3) == [2e-3]


def test_steps_do_not_grow_after_one_that_failed():
    assert lengths([(1e-3, 0.1)], rejected=(0,)) == [1e-3]
    assert lengths([(1e-3, 0.1), (1e-3, 0.1)], rejected=(0,))[1] > 1.2e-3


def test_steps_cut_at_a_kink_are_followed_by_what_their_error_allows():
    numbers = np.zeros(5)
    numbers[LAST_STEP], numbers[LAST_ROOT], numbers[REJECTED_LAST] = 1e-3, 1.0, 1.0
    # Neither the trend nor the failure before counts.
    assert length_beyond(1e-3, 1e-6, root_of(0.1), 1.0, numbers) == pytest.approx(
        0.9e-6 * 0.1**-0.2, rel=1e-12)
    assert numbers[REJECTED_LAST] == 0.0
    assert numbers[LAST_STEP] == 1e-6
    assert length_beyond(-3e-6, 1e-6, root_of(1e-5), 1.0, numbers) == 3e-6
    # The next step, much shorter and less accurate, is followed by its own error.
    assert length_beyond(0.0, 1e-8, root_of(0.5), 1.0, numbers) == pytest.approx(
        0.9e-8 * 0.5**-0.2, rel=1e-12)
