"""A hundred runs with inputs that differ by a relative 1e-15, as other processors round them.

Stated errors cover the truth in 95 of them at least, and directions are the same in all.
"""

import numpy as np
import pytest
from collocation_fields import settled, two_masses_field
from test_codim2_switching import strong
from test_fields_without_values import BOX, TURN, cusp
from test_orbit_curves import circle_field

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
)

RUNS, FEW = 100, 25


def rounded(values, rng):
    """Numbers by name, each changed by a few units in the last place."""
    return {name: value * (1.0 + 1e-15 * rng.uniform(-1.0, 1.0)) for name, value in values.items()}


def covered(errors, stated):
    """Number of runs whose error is at most the stated one."""
    return int(np.count_nonzero(np.abs(errors) <= stated))


@pytest.mark.slow
@pytest.mark.parametrize("steep", [0.8, 1.9])
def test_errors_of_a_coefficient_cover_the_truth(steep):
    errors, stated = np.zeros((2, RUNS))
    for run in range(RUNS):
        rng = np.random.default_rng(run)
        given = rounded({"lam": 0.2, "k": 0.5, "steep": steep}, rng)
        field, t, circle = circle_field(cusp, **given)
        a = np.roots([-2.0, 0.0, given["k"], given["lam"]]).real.max()
        start = (1.0 + a) * circle * (1.0 + 1e-15 * rng.uniform(-1.0, 1.0, circle.shape))
        branch = orbit_branch(field, PeriodicMotion(t, start, period=np.pi), "lam",
                              method=Collocation(intervals=16), bounds=(-0.3, 0.3),
                              scales=np.ones(3), direction=-1.0)
        point, = codim2_curve(field, branch.of_kind("fold")[0], "k", bounds=BOX).of_kind("cusp")
        errors[run] = point.normal_form["c"] + TURN
        stated[run] = point.normal_form_errors["c"]
    assert covered(errors, stated) >= 0.95 * RUNS
    assert stated.max() < 1e-5


@pytest.mark.slow
def test_tori_from_a_resonance_1_1_go_to_their_side():
    """The tori lie at c < 0, for any direction that rounding makes of the double one."""
    box = {"b": (-0.3, 0.3), "c": (-0.8, 0.8)}
    for run in range(FEW):
        rng = np.random.default_rng(run)
        given = rounded({"b": -0.05, "c": -0.5}, rng)
        field, t, circle = circle_field(strong, **given)
        a = np.roots([1.0, given["c"], given["b"]]).min()
        start = (1.0 + a) * circle * (1.0 + 1e-15 * rng.uniform(-1.0, 1.0, circle.shape))
        branch = orbit_branch(field, PeriodicMotion(t, start, period=np.pi), "b",
                              method=Collocation(intervals=16), bounds=(-0.3, 0.3),
                              scales=np.ones(3))
        folds = codim2_curve(field, branch.of_kind("fold")[0], "c", bounds=box)
        point, = folds.of_kind("resonance 1:1")
        tori = codim2_curve(field, point, "c", to="Neimark-Sacker", bounds=box)
        assert np.sort(tori.column("c"))[[0, -1]] == pytest.approx([-0.8, 0.0], abs=1e-5), run


@pytest.mark.slow
def test_error_of_the_criticality_of_a_steep_orbit_covers_the_truth():
    """The doubling of `test_sharpening`, whose coefficient is 0.4620 +- 0.0001 by a return map."""
    errors, stated = np.zeros((2, RUNS))
    field = two_masses_field(B=20.0, D=0.045)
    times, states = settled(field, 400.0, [1.0, 0.0, 8.0, 0.0], 15.0)
    for run in range(RUNS):
        rng = np.random.default_rng(run)
        start = states * (1.0 + 1e-15 * rng.uniform(-1.0, 1.0, states.shape))
        point, = orbit_branch(
            field, (times, start), "D",
            method=Collocation(intervals=60, state_tolerance=None), bounds=(0.03, 0.05),
            width=2.0, direction=-1.0, scales=np.full(4, 8.0),
            options=ContinuationOptions(step=0.002, largest_step=0.01, points=40,
                                        stop_at=["period doubling"])).special
        errors[run] = point.coefficient - 0.462
        stated[run] = point.coefficient_error
    assert covered(errors, stated + 1e-4) >= 0.95 * RUNS
    assert np.median(stated) < 0.03
