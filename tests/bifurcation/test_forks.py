"""Both halves of the branches through a fork, or one where the other is its mirror image."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    branch_tree,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)


def fork(t, x, p, out):
    """A circle of radius one, which becomes two of z = +- sqrt(p) for p > 0."""
    rise = 1.0 - x[0] * x[0] - x[1] * x[1]
    out[0] = rise * x[0] - 2.0 * x[1]
    out[1] = rise * x[1] + 2.0 * x[0]
    out[2] = (p[0] - x[2] * x[2]) * x[2]


def flat_orbits():
    field = vector_field(fork, {"p": -0.4}, ["x", "y", "z"])
    run = fc.simulate(field, 10.0, initial=[1.0, 0.0, 0.0], outputs=2001)
    return field, orbit_branch(field, run, "p", bounds=(-0.5, 0.5), scales=np.ones(3),
                               method=Collocation(intervals=20))


def test_both_halves_are_one_branch():
    field, flat = flat_orbits()
    (point,) = flat.of_kind("branch point")
    assert point.parameter == pytest.approx(0.0, abs=1e-6)
    whole = orbit_branch(field, point, bounds=(-0.5, 0.5), both=True)
    height = whole.column("maximum")[:, 2]
    # From one end through the fork to the other: z^2 = p.
    assert np.sort(np.sign([height[0], height[-1]])).tolist() == [-1.0, 1.0]
    assert (whole.points[0].parameter, whole.points[-1].parameter) == pytest.approx((0.5, 0.5))
    assert (np.diff(height) * np.sign(height[-1] - height[0]) > 0.0).all()
    assert height**2 == pytest.approx(whole.parameter, abs=1e-4)
    assert len(whole) <= ContinuationOptions().points + 2
    # One half by choice.
    for direction in (1.0, -1.0):
        half = orbit_branch(field, point, bounds=(-0.5, 0.5), direction=direction)
        end = half.column("maximum")[-1, 2]
        assert abs(end) == pytest.approx(np.sqrt(0.5), abs=1e-4)
        assert np.sign(end) == np.sign(height[-1]) * direction


def test_trees_follow_one_half_by_choice():
    field, flat = flat_orbits()
    both = branch_tree(field, {"flat": flat})
    assert set(both.found) == {"flat", "flat, crossing", "flat, crossing, other half"}
    one = branch_tree(field, {"flat": flat}, both=False)
    assert set(one.found) == {"flat", "flat, crossing"}


def buckling(t, x, p, out):
    out[0] = p[0] * x[0] - x[0] ** 3


def test_trees_of_equilibria_follow_one_half_by_choice():
    field = vector_field(buckling, {"p": -1.0}, ["x"])
    straight = equilibrium_branch(field, [0.0], bounds=(-1.0, 1.0))
    for both, signs in ((True, {-1.0, 0.0, 1.0}), (False, None)):
        bent = branch_tree(field, {"rest": straight}, both=both).found["rest, crossing"]
        x = bent.column("state")[:, 0]
        assert x**2 == pytest.approx(bent.parameter, abs=1e-6)
        if both:
            assert set(np.sign(np.round(x, 6))) == signs
        else:
            assert abs(np.sign(np.round(x, 6)).sum()) == np.count_nonzero(np.round(x, 6)) > 5


def test_period_doublings_have_one_side():
    from fields_in_time import ROSSLER

    start = fc.simulate(ROSSLER.with_(c=2.5), 200.0, initial=[1.0, 1.0, 1.0], outputs=8001)
    orbits = orbit_branch(ROSSLER, start.between(185.0), "c", bounds=(2.4, 3.2))
    (doubling,) = orbits.of_kind("period doubling")
    with pytest.raises(fc.InputError, match="to one side"):
        orbit_branch(ROSSLER, doubling, both=True)
