"""Pseudo-arclength continuation of curves that are known."""

import numpy as np
import pytest

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import BranchStatus, ContinuationOptions
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.points import details_of
from fecontact.bifurcation.continuation.pseudo_arclength import Problem, continuation, start_of
from fecontact.bifurcation.continuation.step import Step
from fecontact.io import read_branch, write_branch


class Linear:
    def __init__(self, residual, matrix):
        self.residual, self.matrix = residual, matrix

    def solve(self, row, rhs):
        return np.linalg.solve(np.vstack([self.matrix, row]), rhs)


class Plane(Problem):
    """One equation g(x, p) = 0."""

    def __init__(self, function, slopes):
        self.function, self.slopes = function, slopes

    def linearise(self, u):
        return Linear(np.array([self.function(*u)]), np.array([self.slopes(*u)]))

    def weights(self):
        return np.ones(2)

    def point(self, u, linearisation, tangent):
        return {"x": u[0], "unstable": int(linearisation.matrix[0, 0] > 0.0)}


CUBIC = Plane(lambda x, p: p + x - x**3, lambda x, p: (1.0 - 3.0 * x * x, 1.0))
CIRCLE = Plane(lambda x, p: x * x + p * p - 1.0, lambda x, p: (2.0 * x, 2.0 * p))
FOLD = 2.0 / 27.0**0.5


def test_s_shaped_curve_and_its_folds():
    branch = continue_branch(CUBIC, np.array([-1.5, -1.87]),
                             ContinuationOptions(bounds=(-2.0, 2.0)), name="p")
    assert branch.status is BranchStatus.BOUND
    assert branch.parameter[-1] == pytest.approx(2.0, rel=1e-12)
    x, p = branch.column("x"), branch.parameter
    assert p == pytest.approx(x**3 - x, abs=1e-9)
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert [point.parameter for point in branch.special] == pytest.approx([FOLD, -FOLD], rel=1e-12)
    assert [point.u[0] for point in branch.special] == pytest.approx([-(3.0**-0.5), 3.0**-0.5],
                                                                     rel=1e-8)
    assert (np.diff(x) > 0.0).all()
    assert np.diff(x).max() < 0.06


def test_closed_curve_ends_at_its_start():
    branch = continue_branch(CIRCLE, np.array([1.0, 0.0]), ContinuationOptions(largest_step=0.1))
    assert branch.status is BranchStatus.CLOSED
    assert branch.points[-1].u == pytest.approx([1.0, 0.0], abs=1e-14)
    angle = np.unwrap(np.arctan2(branch.parameter, branch.column("x")))
    assert angle[-1] - angle[0] == pytest.approx(2.0 * np.pi, abs=1e-12)
    assert (np.diff(angle) > 0.0).all()


class Helix(Problem):
    """x = cos w, p = sin w, with w a third unknown: turn by turn 2 pi / 100,000 farther on."""

    def linearise(self, u):
        x, w, p = u
        return Linear(np.array([x - np.cos(w), p - np.sin(w)]),
                      np.array([[1.0, np.sin(w), 0.0], [0.0, -np.cos(w), 1.0]]))

    def weights(self):
        return np.array([1.0, 1e-10, 1.0])

    def point(self, u, linearisation, tangent):
        return {"w": u[1]}


def test_a_branch_that_passes_by_its_start_goes_on():
    """Much closer than the cubic between two of its points is accurate."""
    branch = continue_branch(Helix(), np.array([1.0, 0.0, 0.0]),
                             ContinuationOptions(largest_step=0.1, points=200))
    assert branch.status is BranchStatus.POINTS
    assert branch.points[-1].values["w"] > 4.0 * np.pi
    assert len(branch.of_kind("fold")) == round(branch.points[-1].values["w"] / np.pi)


class TurnsBack(Plane):
    """x = p^2 - 0.1 p, whose tangent is turned by mistake beyond p = 0.2, once."""

    may_turn_back = True

    def __init__(self):
        super().__init__(lambda x, p: x - p * p + 0.1 * p, lambda x, p: (1.0, 0.1 - 2.0 * p))
        self.turned = False

    def adapted(self, u, tangent):
        turns, self.turned = not self.turned and u[-1] > 0.2, self.turned or u[-1] > 0.2
        return self, u, -tangent if turns else tangent


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_branch_that_goes_back_along_itself_ends_and_says_so(sign):
    branch = continue_branch(TurnsBack(), np.array([0.0, 0.0]),
                             ContinuationOptions(bounds=(-1.0, 1.0)), name="p", both=True,
                             direction=sign)
    assert branch.status is (BranchStatus.CLOSED if sign > 0.0 else BranchStatus.BOUND)
    turn = branch.parameter.max()
    assert 0.2 < turn < 0.3
    assert branch.message.startswith(f"At p = {turn:.6g} it turned back along itself: the points")
    # It ends with the first step that comes to a point passed before, and has its other side.
    assert 0.1 < branch.parameter[-1 if sign > 0.0 else 0] < 0.3
    assert branch.parameter.min() == -1.0


@pytest.mark.parametrize("turn", [0.3, 0.6])
def test_turns_between_points_are_limited(turn):
    branch = continue_branch(CIRCLE, np.array([1.0, 0.0]),
                             ContinuationOptions(step=1.0, largest_step=1.0, largest_turn=turn))
    turns = [np.arccos(min(1.0, before.tangent @ after.tangent))
             for before, after in zip(branch.points[:-1], branch.points[1:], strict=True)]
    assert 0.5 * turn < max(turns) <= turn


def test_both_directions_and_restart():
    options = ContinuationOptions(bounds=(-0.3, 0.2))
    branch = continue_branch(CUBIC, np.array([0.0, 0.0]), options, both=True)
    assert branch.parameter[[0, -1]] == pytest.approx([-0.3, 0.2], rel=1e-12)
    assert (np.diff(branch.parameter) > 0.0).all()
    middle = branch.points[len(branch) // 2]
    again = continue_branch(CUBIC, middle.u, options, tangent=-middle.tangent)
    assert again.parameter[-1] == pytest.approx(-0.3, rel=1e-12)
    assert (again.points[0].u == pytest.approx(middle.u, abs=1e-12))
    turned = branch.reversed()
    assert (turned.parameter == branch.parameter[::-1]).all()
    assert (turned.points[3].tangent == -branch.points[-4].tangent).all()


def test_events_and_stops():
    events = {"x = 0.1": lambda values: values["x"] - 0.1}
    start = np.array([-1.2, -1.2**3 + 1.2])
    branch = continue_branch(CUBIC, start, ContinuationOptions(events=events, stop_at=["x = 0.1"]))
    assert branch.status is BranchStatus.STOPPED
    assert branch.points[-1].kind == "x = 0.1"
    assert branch.points[-1].u == pytest.approx([0.1, 0.1**3 - 0.1], rel=1e-12)
    first = continue_branch(CUBIC, start, ContinuationOptions(stop_at="fold"))
    assert [point.kind for point in first.special] == ["fold"]
    once = continue_branch(CUBIC, start, ContinuationOptions(stop_at=iter(["fold"])))
    assert once.status is BranchStatus.STOPPED
    unknown = {"nowhere": lambda values: np.nan,
               "here": lambda values: values["x"] - 0.1 if values["x"] > 0.0 else np.nan}
    told = continue_branch(CUBIC, start, ContinuationOptions(events=unknown, bounds=(-2.0, 2.0)))
    assert told.message == ("The event 'nowhere' is nan at every point, so that it has no zeros; "
                            "let its function return a finite number.")
    plain = continue_branch(CUBIC, start, ContinuationOptions(locate=False, bounds=(-2.0, 2.0)))
    assert plain.special == ()


def test_the_tangent_at_a_crossing_is_that_of_the_branch():
    """Of x (x - p) = 0; at the crossing rounding alone gives the matrix, along the other line."""
    class Crossing(Plane):
        def linearise(self, u):
            found = super().linearise(u)
            if np.abs(u).max() < 1e-9:
                found.matrix = np.array([[1e-17, -1e-17]])
            return found

        def tests(self, u, linearisation, tangent):
            return {"branch point": 2.0 * u[0] - u[1]}

    lines = Crossing(lambda x, p: x * (x - p), lambda x, p: (2.0 * x - p, -x))
    branch = continue_branch(lines, np.array([0.0, -1.0]), ContinuationOptions(bounds=(-1.0, 1.0)))
    crossing, = branch.of_kind("branch point")
    assert crossing.u == pytest.approx([0.0, 0.0], abs=1e-9)
    assert crossing.tangent == pytest.approx([0.0, 1.0], abs=1e-6)


def test_poles_are_no_special_points():
    class Pole(Plane):
        def tests(self, u, linearisation, tangent):
            return {"pole": 1.0 / (u[0] - 0.123), "zero": u[0] + 0.321}

    branch = continue_branch(Pole(CUBIC.function, CUBIC.slopes), np.array([-1.0, 0.0]),
                             ContinuationOptions(bounds=(-2.0, 2.0)))
    assert sorted(point.kind for point in branch.special) == ["fold", "fold", "zero"]
    assert branch.of_kind("zero")[0].u[0] == pytest.approx(-0.321, rel=1e-12)


def test_crossings_that_hide_each_other_are_told_apart():
    """Two pairs cross in one long step: the test changes sign twice, the count of four tells."""
    class TwoPairs(Plane):
        def point(self, u, linearisation, tangent):
            return {"unstable": 2 * int(u[1] > 0.5) + 2 * int(u[1] > 0.52)}

        def tests(self, u, linearisation, tangent):
            return {"Hopf": (u[1] - 0.5) * (u[1] - 0.52)}

    line = TwoPairs(lambda x, p: x, lambda x, p: (1.0, 0.0))
    branch = continue_branch(
        line, np.zeros(2), ContinuationOptions(step=0.2, largest_step=0.2, bounds=(-1.0, 1.0)))
    assert [point.parameter for point in branch.special] == pytest.approx([0.5, 0.52], rel=1e-10)


def test_end_of_existence_keeps_the_branch():
    def root(x, p):
        if p > 0.5:
            raise AnalysisError("There is nothing beyond 0.5.")
        return x - p

    branch = continue_branch(Plane(root, lambda x, p: (1.0, -1.0)), np.zeros(2),
                             ContinuationOptions())
    assert branch.status is BranchStatus.STALLED
    assert branch.message == "There is nothing beyond 0.5."
    assert 0.4999 < branch.parameter[-1] <= 0.5
    assert "the points computed so far are kept" in branch.status.value


@pytest.mark.parametrize("step", [0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7])
def test_sharp_corner_is_not_jumped(step):
    """A hyperbola's two arms come within 0.02: the steps must not jump from one to the other."""
    near = Plane(lambda x, p: x * x - p * p - 1e-4, lambda x, p: (2.0 * x, -2.0 * p))
    options = ContinuationOptions(bounds=(-2.0, 1.0), step=step, largest_step=step)
    branch = continue_branch(near, np.array([1.0, -1.0]), options)
    assert (branch.column("x") > 0.0).all()
    assert branch.points[-1].u[0] == pytest.approx(np.sqrt(1.0001), rel=1e-12)


def test_corners_of_the_branch_itself_are_passed():
    """x = |p| / 2 turns by 0.93 rad, more than is believed of a step of ordinary size."""
    bent = Plane(lambda x, p: x - 0.5 * abs(p), lambda x, p: (1.0, -0.5 * np.sign(p)))
    branch = continue_branch(bent, np.array([0.5, -1.0]), ContinuationOptions(bounds=(-1.0, 1.0)))
    assert branch.status is BranchStatus.BOUND
    assert branch.column("x") == pytest.approx(0.5 * np.abs(branch.parameter), abs=1e-7)
    assert branch.parameter[-1] == pytest.approx(1.0, rel=1e-12)


def test_points_come_one_by_one():
    steps = continuation(CIRCLE, np.array([1.0, 0.0]), ContinuationOptions(points=5),
                         direction=-1.0)
    points = [next(steps) for _ in range(5)]
    assert all(point.u[1] < 0.0 for point in points[1:])
    with pytest.raises(StopIteration) as stop:
        next(steps)
    assert stop.value.value.status is BranchStatus.POINTS


def test_no_solution_near_the_start():
    with pytest.raises(InputError, match="at the parameter 3; give a 'start' that is closer to "
                                         "one, for orbits also more harmonics"):
        continue_branch(CIRCLE, np.array([0.1, 3.0]), ContinuationOptions())
    with pytest.raises(InputError, match=r"start lies at 1, outside the bounds .* 2 to 3"):
        continue_branch(CUBIC, np.array([0.1, 1.0]), ContinuationOptions(bounds=(2.0, 3.0)))


@pytest.mark.parametrize(("options", "message"), [
    ({"step": -1.0}, r"step = -1.0 must be a finite number above zero"),
    ({"step": 0.2}, "step = 0.2 must lie between"),
    ({"bounds": (1.0, 1.0)}, "the smaller one first"),
])
def test_options_are_checked(options, message):
    with pytest.raises(InputError, match=message):
        ContinuationOptions(**options)


def test_files(tmp_path):
    class Ragged(Plane):
        def point(self, u, linearisation, tangent):
            return {"x": u[0], "mesh": np.arange(3 + int(u[0] > 0.0)), "pair": u[0] + 1j}

        def examine(self, kind, u, linearisation, tangent):
            return {"null_vector": np.array([1.0, 2j]), "note": "as expected"}

    branch = continue_branch(Ragged(CUBIC.function, CUBIC.slopes), np.array([-1.2, -0.5]),
                             ContinuationOptions(bounds=(-1.0, 1.0)), name="p",
                             attributes={"who": ["a", "b"]})
    path = write_branch(tmp_path / "branch.h5", branch)
    found = read_branch(path)
    assert (found.parameter_name, found.status, len(found)) == ("p", branch.status, len(branch))
    for mine, theirs in zip(branch, found, strict=True):
        assert (mine.u == theirs.u).all()
        assert (mine.tangent == theirs.tangent).all()
        assert mine.kind == theirs.kind
        assert mine.values["pair"] == theirs.values["pair"]
        assert mine.values["mesh"].tolist() == theirs.values["mesh"].tolist()
        assert type(mine) is type(theirs)
        assert details_of(mine).keys() == details_of(theirs).keys()
    fold = found.of_kind("fold")[0]
    assert fold.null_vector.tolist() == [1.0, 2j]
    assert details_of(fold)["note"] == "as expected"
    assert found.attributes["who"] == ["a", "b"]
    with pytest.raises(InputError, match="stores no value 'y'; it has: 'mesh', 'pair', 'x'"):
        branch.column("y")
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match="not an HDF5 file"):
        read_branch(path)


def test_a_jump_at_the_start_of_a_step_is_no_zero():
    """As of a test function that a new mesh changes; a zero right beside the start is one."""
    options = ContinuationOptions()
    ends = [start_of(CIRCLE, np.array([np.cos(w), np.sin(w)]), options, None, 1.0)
            for w in (0.3, 0.35)]
    step = Step(CIRCLE, *ends, options, CIRCLE.weights() * ends[0].tangent)
    for shift, offset in ((0.0, 1e-4), (0.0, 0.4), (0.0, 0.999), (0.5, 0.4)):
        found, _ = step.zero(
            lambda at, shift=shift, offset=offset: step.along(at.u) / step.length - offset
            + shift * (at is ends[1]), 1e-12)
        assert step.along(found.u) == pytest.approx(offset * step.length, rel=1e-8)
    calls = []

    def jumps(at):
        calls.append(at)
        return -0.3 if at is ends[0] else 0.5 + step.along(at.u) / step.length

    assert step.zero(jumps, 1e-12) is None
    assert sum(at not in ends for at in calls) < 12


def test_a_step_meets_a_value_of_an_unknown():
    """On a circle, both unknowns; beyond the step there is nothing to meet, nor where it turns."""
    options = ContinuationOptions()
    ends = [start_of(CIRCLE, np.array([np.cos(w), np.sin(w)]), options, None, 1.0)
            for w in (0.3, 0.35)]
    step = Step(CIRCLE, *ends, options, CIRCLE.weights() * ends[0].tangent)
    for place, value in ((0, np.cos(0.34)), (1, np.sin(0.31)), (1, np.sin(0.35))):
        met = step.meeting(place, value)
        assert met.u[place] == value
        assert met.u @ met.u == pytest.approx(1.0, abs=1e-14)
        assert 0.3 < np.arctan2(met.u[1], met.u[0]) < 0.35 + 1e-12
        assert met.values["x"] == met.u[0]
        assert met.tangent @ met.u == pytest.approx(0.0, abs=1e-9)
    assert step.meeting(1, np.sin(0.4)) is None
    assert step.meeting(0, 1.01) is None
