"""Trees of branches from Python: what is followed, what is known already, and its names."""

import numpy as np
import pytest
from collocation_fields import lorenz_field, two_masses_field

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    BranchTree,
    Collocation,
    ContinuationOptions,
    branch_tree,
    codim2_curve,
    equilibrium_branch,
    find_equilibrium,
    vector_field,
)
from fecontact.io import read_branch, read_branches, write_branch, write_branches


def lens(t, x, p, out):
    # r^2 = p (1 - p): the orbits of both Hopf points are the same.
    growth = p[0] * (1.0 - p[0]) - x[0] * x[0] - x[1] * x[1]
    out[0] = growth * x[0] - 2.0 * x[1]
    out[1] = growth * x[1] + 2.0 * x[0]


def fork(t, x, p, out):
    # Equilibria z^2 = p about r = 0; orbits r^2 = 1 + p, with z = 0 or of the mean square p.
    growth = 1.0 + p[0] - x[0] * x[0] - x[1] * x[1]
    out[0] = growth * x[0] - 2.0 * x[1]
    out[1] = growth * x[1] + 2.0 * x[0]
    out[2] = (p[0] - x[2] * x[2]) * x[2]


def crossings(t, x, p, out):
    out[0] = x[0] * (p[0] - x[0]) * (p[0] + x[0] - 1.0)


def test_lorenz_from_a_file(tmp_path):
    """Both halves of the fork at rho = 1 have a Hopf point at 24.74, whose unstable orbits go back
    to the homoclinic explosion at 13.926 (Sparrow, The Lorenz Equations, 1982).
    """
    field = lorenz_field()
    path = write_branch(tmp_path / "rest.h5", equilibrium_branch(
        field, find_equilibrium(field, {"rho": 0.0}), "rho", bounds=(0.0, 40.0)))
    tree = branch_tree(field, {"rest": read_branch(path)}, depth=4,
                       method=Collocation(intervals=40))
    assert isinstance(tree, BranchTree)
    assert list(tree.found) == ["rest", "rest, crossing", "rest, crossing, orbits 1",
                                "rest, crossing, orbits 2"]
    assert tree.notes == []
    assert not tree.interrupted
    one, other = list(tree.found.values())[2:]
    for orbits in (one, other):
        assert orbits.status is BranchStatus.HOMOCLINIC
        assert orbits.parameter[0] == pytest.approx(470.0 / 19.0, rel=1e-5)
        assert orbits.parameter[-1] == pytest.approx(13.9265, abs=2e-3)
    # Each is the mirror image of the other.
    here, there = (branch.at(field, 20.0).values for branch in (one, other))
    assert here["maximum"][0] == pytest.approx(-there["minimum"][0], rel=1e-6)
    assert here["period"] == pytest.approx(there["period"], rel=1e-7)
    again = read_branches(write_branches(tmp_path / "tree.h5", tree.found))
    assert list(again) == list(tree.found)


def test_orbits_between_two_hopf_points_are_followed_once():
    field = vector_field(lens, {"p": -0.5}, 2)
    rest = equilibrium_branch(field, parameter="p", bounds=(-0.5, 1.5))
    tree = branch_tree(field, rest, depth=3, method=Collocation(intervals=12))
    assert list(tree.found) == ["first", "orbits 1"]
    assert tree.found["orbits 1"].status is BranchStatus.HOPF
    assert list(branch_tree(field, rest, depth=0).found) == ["first"]


def test_each_crossing_is_passed_once():
    """x = 0, x = p and x = 1 - p cross each other at p = 0, 1/2 and 1."""
    field = vector_field(crossings, {"p": -0.6}, 1)
    level = equilibrium_branch(field, [0.0], bounds=(-0.6, 1.6))
    assert [point.parameter for point in level.special] == pytest.approx([0.0, 1.0], abs=1e-9)
    tree = branch_tree(field, level, depth=5)
    assert list(tree.found) == ["first", "first, crossing 1", "first, crossing 2"]
    rising, falling = list(tree.found.values())[1:]
    for branch, line in ((rising, lambda p: p), (falling, lambda p: 1.0 - p)):
        state = branch.column("state")[:, 0]
        assert state == pytest.approx(line(branch.parameter), abs=1e-9)
        assert np.sort(branch.parameter)[[0, -1]] == pytest.approx([-0.6, 1.6], rel=1e-12)
        assert len(branch.of_kind("branch point")) == 2


def test_both_halves_of_a_fork_of_orbits():
    field = vector_field(fork, {"p": -2.0}, 3)
    rest = equilibrium_branch(field, parameter="p", bounds=(-2.0, 1.0))
    tree = branch_tree(field, rest, depth=2, method=Collocation(intervals=12))
    assert set(tree.found) == {"first", "orbits", "first, crossing", "orbits, crossing",
                               "orbits, crossing, other half"}
    up, down = (tree.found[f"orbits, crossing{which}"] for which in ("", ", other half"))
    z = up.column("maximum")[:, 2]
    assert z**2 == pytest.approx(up.parameter, abs=1e-7)
    assert z[-1] * down.column("maximum")[-1, 2] == pytest.approx(-1.0, rel=1e-6)
    assert "orbits" not in branch_tree(field, rest, switch="branch point").found


def test_a_cascade_of_doublings():
    """The doublings of section 4.4 over the normal force."""
    field = two_masses_field()
    sliding = equilibrium_branch(field, np.zeros(4), "B", bounds=(0.3, 9.6))
    tree = branch_tree(field, {"sliding": sliding}, depth=3, bounds=(0.3, 9.5),
                       switch=["Hopf", "period doubling"], method=Collocation(intervals=80),
                       options=ContinuationOptions(points=250))
    doublings = {name: [round(point.parameter, 4) for point in branch.of_kind("period doubling")]
                 for name, branch in tree.found.items()}
    assert doublings == {"sliding": [], "orbits 1": [8.0922], "orbits 2": [5.3835, 7.2487],
                         "orbits 1, doubled": [9.2619], "orbits 2, doubled 1": [8.9281],
                         "orbits 2, doubled 2": [], "orbits 1, doubled, doubled": [9.3651],
                         "orbits 2, doubled 1, doubled": []}
    assert tree.notes == []


def test_kind_errors():
    field = vector_field(lens, {"p": -0.5}, 2)
    rest = equilibrium_branch(field, parameter="p", bounds=(-0.5, 1.5))
    with pytest.raises(InputError, match="switch = 'hopf' is not known; choose from"):
        branch_tree(field, rest, switch=["hopf"])
    with pytest.raises(InputError, match=r"depth = -1 must be a whole number, 0 or above"):
        branch_tree(field, rest, depth=-1)
    with pytest.raises(InputError, match="branches over the same single parameter"):
        branch_tree(field, [])
    two = vector_field(fork, {"p": -2.0, "q": 0.0}, 3)
    hopf = equilibrium_branch(two, parameter="p", bounds=(-2.0, 1.0)).of_kind("Hopf")[0]
    curve = codim2_curve(two, hopf, "q", options=ContinuationOptions(points=3))
    with pytest.raises(InputError, match="branches over the same single parameter"):
        branch_tree(two, curve)
