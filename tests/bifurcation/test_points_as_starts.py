"""Points of branches as starts of others, their kinds, and solutions at a value of the parameter.

The orbits z' = (r + i w) z - z |z|^2 have the radius sqrt(r) and the period 2 pi / w.
"""

from dataclasses import replace

import numpy as np
import pytest
from systems import lorenz_field, two_mass_field

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    HopfPoint,
    PeriodicMotion,
    Shooting,
    equilibrium_branch,
    observe,
    orbit_branch,
    periodic_motion,
    vector_field,
)
from fecontact.io import read_branch, write_branch


def landau(t, x, p, out):
    square = x[0] * x[0] + x[1] * x[1]
    out[0] = (p[0] - square) * x[0] - p[1] * x[1]
    out[1] = (p[0] - square) * x[1] + p[1] * x[0]


def cubic(t, x, p, out):
    out[0] = p[0] + x[0] - x[0] ** 3 / 3.0


@pytest.fixture(scope="module")
def field():
    return vector_field(landau, {"r": -0.5, "w": 2.0}, 2)


@pytest.fixture(scope="module")
def rest(field):
    return equilibrium_branch(field, parameter="r", bounds=(-0.5, 0.5))


@pytest.fixture(scope="module")
def orbits(field, rest):
    return orbit_branch(field, rest.of_kind("Hopf")[0], method=Collocation(intervals=12),
                        bounds=(-0.5, 0.4))


@pytest.fixture(params=["as found", "from a file"])
def kept(request, orbits, tmp_path):
    if request.param == "as found":
        return orbits
    return read_branch(write_branch(tmp_path / "orbits.h5", orbits))


def radius(point):
    return point.values["maximum"][0]


def test_special_points_have_what_is_known_of_them(rest, tmp_path):
    for branch in (rest, read_branch(write_branch(tmp_path / "rest.h5", rest))):
        point, = branch.special
        assert isinstance(point, HopfPoint)
        assert point.angular_frequency == pytest.approx(2.0, rel=1e-10)
        assert point.frequency_hz == pytest.approx(1.0 / np.pi, rel=1e-10)
        assert point.period == pytest.approx(np.pi, rel=1e-10)
        assert point.criticality == "supercritical"
        assert point.crossing_speed == pytest.approx(1.0, rel=1e-8)
        assert abs(point.eigenvector[1] / point.eigenvector[0]) == pytest.approx(1.0, rel=1e-8)
    with pytest.raises(AttributeError):
        _ = rest.points[0].angular_frequency
    unknown = type(point)(point.u, point.tangent, kind="Hopf")
    with pytest.raises(InputError, match=r"at the parameter = .* \(Hopf\) has no period"):
        _ = unknown.period
    with pytest.raises(InputError, match="belongs to no branch"):
        orbit_branch(lorenz_field(), unknown)


def test_a_branch_goes_on_from_its_end(field, kept):
    on = orbit_branch(field, kept.points[-1], bounds=(-0.5, 1.0))
    assert on.status is BranchStatus.BOUND
    assert on.points[0].parameter == pytest.approx(0.4, rel=1e-12)
    assert (np.diff(on.parameter) > 0.0).all()
    assert radius(on.points[-1]) == pytest.approx(1.0, rel=1e-7)
    assert on.points[-1].values["period"] == pytest.approx(np.pi, rel=1e-7)
    finer = orbit_branch(field, kept.points[-1], method=Collocation(intervals=30),
                         bounds=(-0.5, 1.0))
    assert len(finer.points[-1].values["mesh"]) == 31
    assert radius(finer.points[-1]) == pytest.approx(1.0, rel=1e-9)


def test_steps_go_on_in_the_size_of_orbits_that_have_grown(field, rest):
    """At r = 100 the radius is 10, and one the scale at the Hopf point."""
    wide = ContinuationOptions(bounds=(-0.5, 100.0), largest_step=0.3)
    orbits = orbit_branch(field, rest.special[0], method=Collocation(intervals=12), options=wide)
    assert orbits.attributes["scales"][0] == pytest.approx(1.0)
    on = orbit_branch(field, orbits.points[-1], bounds=(-0.5, 121.0))
    assert on.attributes["scales"][:2] == pytest.approx([10.0, 10.0], rel=1e-3)
    assert radius(on.points[-1]) == pytest.approx(11.0, rel=1e-6)


def test_a_start_may_pass_a_bound_by_rounding(field, rest, kept):
    """A computed bound may be missed by rounding; branches themselves end exactly on theirs."""
    assert kept.points[-1].parameter == 0.4
    assert rest.points[-1].parameter == 0.5
    beyond = np.nextafter(0.4, 1.0)
    motion = replace(kept.points[-1].orbit(field), parameter_values=[beyond, 2.0])
    orbits = orbit_branch(field, motion, "r", direction=-1.0, bounds=(0.3, 0.4))
    assert orbits.parameter[[0, -1]] == pytest.approx([0.4, 0.3], abs=0.0)
    above = replace(kept.points[-1].orbit(field), parameter_values=[0.4 + 1e-9, 2.0])
    with pytest.raises(InputError, match="outside the bounds of the parameter"):
        orbit_branch(field, above, "r", bounds=(0.3, 0.4))


def test_a_branch_goes_back(field, kept):
    back = orbit_branch(field, kept.points[-1], direction=-1.0, bounds=(0.1, 0.4))
    assert back.parameter[-1] == pytest.approx(0.1, rel=1e-12)
    assert radius(back.points[-1]) == pytest.approx(np.sqrt(0.1), rel=1e-7)
    both = orbit_branch(field, kept.at(field, 0.25), both=True, bounds=(0.1, 0.4))
    assert both.parameter[[0, -1]] == pytest.approx([0.1, 0.4], rel=1e-12)


def test_orbits_at_a_value(field, kept):
    point = kept.at(field, 0.25)
    assert point.parameter == pytest.approx(0.25, rel=1e-12)
    assert radius(point) == pytest.approx(0.5, rel=1e-7)
    assert point.values["multipliers"][-1] == pytest.approx(np.exp(-2.0 * 0.25 * np.pi), rel=1e-6)
    motion = point.orbit(field, 41)
    assert np.hypot(*motion.states.T) == pytest.approx(np.full(41, 0.5), rel=1e-6)
    assert motion.times[-1] == motion.period == pytest.approx(np.pi, rel=1e-7)
    assert motion.parameter_values == pytest.approx([0.25, 2.0])
    assert kept.at(field, kept.points[3].parameter) is kept.points[3]
    with pytest.raises(InputError, match=r"= 0\.7: the branch lies between .*; choose a value"):
        kept.at(field, 0.7)
    several = kept.at(field, [0.09, 0.16, 0.36])
    assert [point.parameter for point in several] == pytest.approx([0.09, 0.16, 0.36], rel=1e-12)
    assert [radius(point) for point in several] == pytest.approx([0.3, 0.4, 0.6], rel=1e-7)
    assert kept.at(field, np.array([])) == ()
    with pytest.raises(InputError, match="The values of the parameter"):
        kept.at(field, ["some"])


def test_an_orbit_is_followed_over_another_parameter(field, kept):
    over = orbit_branch(field, kept.at(field, 0.25), "w", bounds=(2.0, 3.0))
    assert over.parameter_name == "w"
    assert over.points[-1].values["period"] == pytest.approx(2.0 * np.pi / 3.0, rel=1e-7)
    assert over.column("maximum")[:, 0] == pytest.approx(np.full(len(over), 0.5), rel=1e-6)


def test_equilibria_at_a_value_which_are_several():
    """a = x^3 / 3 - x has three solutions at a = 0."""
    field = vector_field(cubic, {"a": -2.0}, 1)
    branch = equilibrium_branch(field, [-3.0], bounds=(-2.0, 2.0))
    assert len(branch.of_kind("fold")) == 2
    states = [branch.at(field, 0.0, which).values["state"][0] for which in (0, 1, 2, -1)]
    assert states == pytest.approx(np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0, 1.0]), abs=1e-9)
    # Right beside a fold, from which the branch leaves at a right angle to the parameter.
    fold = branch.of_kind("fold")[0]
    near = [branch.at(field, fold.parameter - 1e-6, which).values["state"][0] for which in (0, 1)]
    assert near == pytest.approx(fold.u[0] + np.array([-1e-3, 1e-3]), abs=1e-5)
    assert [branch.at(field, 0.0, which).values["stable"] for which in range(3)] == [
        True, False, True]
    with pytest.raises(InputError, match="a = 0: the branch passes this value 3 times; choose a "
                                         "whole number from 0 to 2, not which = 3"):
        branch.at(field, 0.0, 3)
    with pytest.raises(InputError, match="is written 'fold'"):
        branch.of_kind("Fold")
    assert branch.of_kind("neutral saddle") == ()


def test_equilibria_go_on_and_cross(tmp_path):
    """Equilibria of Lorenz' equations: x = y = sqrt(b (rho - 1)) beyond the pitchfork at 1."""
    field = lorenz_field()
    zero = equilibrium_branch(field, np.zeros(3), "rho", bounds=(0.5, 5.0), both=True)
    path = write_branch(tmp_path / "zero.h5", zero)
    for branch in (zero, read_branch(path)):
        fork, = branch.of_kind("branch point")
        other = equilibrium_branch(field, fork, bounds=(0.0, 5.0))
        b = field.parameters[next(name for name in field.parameters if name not in
                                  ("rho", "sigma"))]
        for end in (other.points[0], other.points[-1]):
            assert np.abs(end.u[:2]) == pytest.approx(np.full(2, np.sqrt(4.0 * b)), rel=1e-9)
        on = equilibrium_branch(field, other.points[-1], bounds=(0.0, 10.0))
        assert on.parameter[-1] == pytest.approx(10.0, rel=1e-12)
        assert np.abs(on.points[-1].u[0]) == pytest.approx(np.sqrt(9.0 * b), rel=1e-9)
        half = equilibrium_branch(field, fork, both=False, direction=-1.0, bounds=(0.0, 5.0))
        whole = equilibrium_branch(field, fork, both=False, bounds=(0.0, 5.0))
        assert half.points[-1].u[0] == pytest.approx(-whole.points[-1].u[0], rel=1e-9)


def test_shooting_goes_on_and_is_solved_at_a_value():
    """The period at a value of B is that of collocation."""
    field = two_mass_field()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 8.3))
    orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=100),
                          bounds=(0.3, 8.3))
    assert orbits.points[0].orbit().parameter_values is None
    start, wanted = orbits.at(field, 6.0, -1), orbits.at(field, 6.2, -1)
    few = ContinuationOptions(step=0.01, points=4)
    shot = orbit_branch(field, start, method=Shooting(segments=2, rtol=1e-10), options=few,
                        bounds=(5.9, 6.3))
    assert isinstance(shot.points[0].method, Shooting)
    with pytest.raises(InputError, match="give the field"):
        shot.points[0].orbit()
    on = orbit_branch(field, shot.points[-1], options=ContinuationOptions(step=0.05),
                      bounds=(5.9, 6.3))
    assert on.method.segments == 2
    assert on.parameter[-1] == pytest.approx(6.3, rel=1e-12)
    found = on.at(field, 6.2)
    assert found.values["period"] == pytest.approx(wanted.values["period"], rel=1e-7)
    assert found.orbit(field).states.max(axis=0) == pytest.approx(
        wanted.orbit().states.max(axis=0), rel=1e-4, abs=1e-4)
    other = orbit_branch(field, found, method=Collocation(intervals=100), options=few,
                         bounds=(5.9, 6.3))
    assert other.points[0].values["period"] == pytest.approx(wanted.values["period"], rel=1e-7)


def test_a_motion_gives_the_value_of_the_free_parameter_alone():
    """x'' + x'/5 + x = a cos(w t), from the motion with another a and w."""
    def forced(t, x, p, out):
        out[0] = x[1]
        out[1] = -0.2 * x[1] - x[0] + p[0] * np.cos(p[1] * t)

    field = vector_field(forced, {"a": 0.5, "w": 3.0}, ["x", "v"],
                         period=lambda p: 2.0 * np.pi / p["w"])
    motion = periodic_motion(field.with_(a=0.1, w=2.0), initial=[0.0, 0.0])
    branch = orbit_branch(field, motion, "w", bounds=(1.5, 2.5), method=HarmonicBalance(3))
    first = branch.points[0]
    assert first.parameter_values(field) == pytest.approx([0.5, 2.0])
    assert first.values["maximum"][0] == pytest.approx(0.5 / abs(1.0 - 4.0 + 0.4j), rel=1e-8)
    # A point of a branch keeps all its values.
    over = orbit_branch(field, first, "a", bounds=(0.4, 0.6)).points[0]
    assert over.parameter_values(field) == pytest.approx([0.5, 2.0])


def test_motions_are_checked():
    with pytest.raises(InputError, match="states must be those of a motion"):
        PeriodicMotion([0.0, 1.0], [0.0, 1.0])
    with pytest.raises(InputError, match="parameter_values of the motion must be 2 numbers"):
        orbit_branch(vector_field(landau, {"r": 0.5, "w": 2.0}, 2),
                     PeriodicMotion([0.0, 1.0], np.eye(2), parameter_values=[1.0]), "r")


def test_a_branch_of_another_field_is_not_observed(rest):
    with pytest.raises(InputError, match="that of another field, of 2 states and the parameters"):
        observe(two_mass_field(), rest, 0)
