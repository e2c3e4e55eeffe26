"""Folds of orbits at which multipliers are lost in rounding."""

import numpy as np
import pytest
from collocation_fields import two_masses_field
from test_continuation import Plane

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    equilibrium_branch,
    orbit_branch,
)
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.rounding import Rounding


class Lost(Rounding):
    """Stability is lost where points say so, and turns may be rounding there."""

    def __init__(self, uncertain):
        super().__init__()
        self.uncertain = uncertain

    def lost(self, values):
        return values["near"]

    def turns(self, tangents, values):
        return self.uncertain and any(stored["near"] for stored in values)


class Steep(Plane):
    """p = x^2 with two multipliers that are lost where |x| < ``within``.

    One multiplier is 1 at x = 0 and changes by many decades beside it, so that it passes -1 next
    to the fold: as many directions are unstable on both sides. ``more`` are unstable for x > 0.
    """

    def __init__(self, within, more=0, function=lambda x, p: p - x * x, uncertain=True):
        super().__init__(function, lambda x, p: (-2.0 * x, 1.0))
        self.within, self.more, self.uncertain = within, more, uncertain

    def point(self, u, linearisation, tangent):
        return {"x": u[0], "unstable": 1 + self.more * int(u[0] > 0.0),
                "near": abs(float(u[0])) < self.within}

    @property
    def rounding(self):
        return Lost(self.uncertain)


def followed(problem, x=-0.5):
    return continue_branch(problem, np.array([x, x * x]),
                           ContinuationOptions(bounds=(-0.1, 0.3), step=0.02, largest_step=0.02),
                           direction=-1.0)


@pytest.mark.parametrize("within", [1e-9, 3e-3, 0.05])
@pytest.mark.parametrize("more", [-1, 0, 1])
@pytest.mark.parametrize("uncertain", [False, True])
def test_a_fold_explains_any_change_that_it_hides(within, more, uncertain):
    """Whether no, some or many regular points lie where multipliers are lost."""
    branch = followed(Steep(within, more, uncertain=uncertain))
    assert [point.kind for point in branch.special] == ["fold"]
    assert branch.special[0].parameter == pytest.approx(0.0, abs=1e-12)
    assert branch.column("unstable")[[0, -1]].tolist() == [1, 1 + more]
    # The steps are as long as they were.
    assert len(branch) < 70


@pytest.mark.parametrize(("within", "more"), [(1e-4, 3), (3e-3, 3), (0.05, 2), (0.05, -2)])
def test_a_fold_does_not_explain_many_changes(within, more):
    branch = followed(Steep(within, more))
    assert sorted(point.kind for point in branch.special) == ["fold", "unresolved"]
    mark, = branch.of_kind("unresolved")
    assert (mark.unstable_before, mark.unstable_after) == (1, 1 + more)


class Wavering(Steep):
    """p = 1e-3 x with an error of the slope where multipliers are lost."""

    def __init__(self, size):
        super().__init__(0.05, function=lambda x, p: p - 1e-3 * x)
        self.slopes = lambda x, p: (-1e-3 if abs(x) > self.within else size * np.sin(3e3 * x), 1.0)


@pytest.mark.parametrize("size", [1e-8, 1e-6, 1e-4, 1e-3])
def test_slopes_of_rounding_are_no_folds(size):
    branch = continue_branch(Wavering(size), np.array([-0.3, -3e-4]), ContinuationOptions(
        bounds=(-1.0, 3e-4), step=0.01, largest_step=0.01))
    assert branch.special == ()
    assert branch.parameter[-1] == pytest.approx(3e-4, rel=1e-9)


@pytest.mark.slow
def test_folds_of_doubled_orbits_of_the_friction_oscillator():
    """B = 20, doubled orbits over v_0 from 1.6079: five folds, four of them steep.

    Beside these a multiplier changes from -1e7 to 1e7 or back while v_0 changes by 1e-9. Their
    places on 400 to 1600 intervals, from a start beside each: they agree to 1e-11.
    """
    field, bounds = two_masses_field(B=20.0, v0=8.0), (0.93, 8.0)
    sliding = equilibrium_branch(field, np.zeros(4), "v0", bounds=bounds, direction=-1.0)
    orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=100),
                          bounds=bounds, scales=np.full(4, 8.0),
                          options=ContinuationOptions(step=0.005, largest_step=0.04, points=600))
    begin = min(orbits.of_kind("period doubling"), key=lambda at: abs(at.parameter - 1.6079))
    branch = orbit_branch(field, begin, bounds=bounds, options=ContinuationOptions(
        step=0.005, largest_step=0.04, points=520))
    assert not branch.of_kind("unresolved")
    expected = (1.46282218421, 1.52800204206, 1.48761642854, 1.50421307798, 0.94277053507,
                1.07560315344)
    for fold, place in zip(branch.of_kind("fold"), expected, strict=True):
        assert abs(fold.parameter - place) <= 1.5 * fold.parameter_error + 2e-11
        assert fold.parameter_error < 1e-8
    # Each is where the parameter turns; points next to it are known to 1e-10 alone.
    for index, point in enumerate(branch.points):
        if point.kind == "fold":
            before, after = (branch.points[at].parameter for at in (index - 3, index + 3))
            assert (before - point.parameter) * (after - point.parameter) > 0.0
    assert "Multipliers of " in branch.message
