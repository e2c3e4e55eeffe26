"""Branches of orbits with friction without smoothing, against closed forms."""

import numpy as np
import pytest
from systems import TURN
from systems import belt_of_unit_mass as belt
from systems import last_speed_of_stick_slip as last_speed

import fecontact as fc
from fecontact import ModelWarning
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    Shooting,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.bifurcation.orbits.shooting import ShootingProblem
from fecontact.integrate import Scipy, SetValued
from fecontact.io import read_branch, write_branch
from fecontact.laws import ConstantFriction, LinearContact

# The start, where the mass is fastest, slips: beside a start that sticks static friction jumps.
STATIC = SetValued(static_coefficient=1.0)
METHOD = Shooting(1, solver=STATIC)


def motion(system):
    speed = system.parameters()["ground.speed"]
    return periodic_motion(system, initial=np.array([0.9, speed]), transient=40.0,
                           longest_period=20.0, solver=STATIC, rtol=1e-9)


def test_stick_slip_period_over_the_speed():
    """Without a dashpot stick lasts 1 / V, and slip 2 pi - 2 arctan(1 / (2 V))."""
    branch = orbit_branch(contact_field(belt(0.2), "ground.speed"), motion(belt(0.2)),
                          method=METHOD, bounds=(0.15, 0.25),
                          options=ContinuationOptions(step=0.05))
    assert branch.status is BranchStatus.BOUND
    assert branch.points[-1].parameter == pytest.approx(0.25, rel=1e-9)
    for point in branch.points:
        V = point.parameter
        wanted = 1.0 / V + 2.0 * np.pi - 2.0 * np.arctan(0.5 / V)
        assert point.values["period"] == pytest.approx(wanted, rel=1e-10)
        multipliers = np.sort(np.abs(point.values["multipliers"]))
        assert multipliers == pytest.approx([0.0, 1.0], abs=1e-9)
        assert multipliers[0] == 0.0
    assert branch.points[0].values["stable"]


def test_stick_slip_ends_where_slip_ends_no_more(tmp_path):
    """The next crest of the speed just reaches the belt's: no orbit beyond, and none invented."""
    dashpot = 0.1
    last = last_speed(dashpot)
    system = belt(0.97 * last, dashpot)
    field = contact_field(system, "ground.speed")
    branch = orbit_branch(field, motion(system), method=METHOD, bounds=(0.9 * last, 1.2 * last),
                          options=ContinuationOptions(step=0.02))
    assert branch.status is BranchStatus.DISCONTINUITY
    assert branch.points[-1].kind == "grazing-sliding"
    assert branch.points[-1].parameter == pytest.approx(last, rel=1e-7)
    assert max(point.parameter for point in branch.points) < (1.0 + 1e-7) * last
    # A branch from a file goes on with the same solver.
    write_branch(tmp_path / "branch.h5", branch)
    known = read_branch(tmp_path / "branch.h5")
    back = orbit_branch(field, known.points[0], direction=-1.0, bounds=(0.94 * last, last),
                        options=ContinuationOptions(step=0.02))
    assert back.status is BranchStatus.BOUND
    assert back.method.solver == branch.method.solver
    assert back.points[-1].parameter == pytest.approx(0.94 * last, rel=1e-9)


def test_other_solvers_are_refused():
    with pytest.raises(fc.InputError, match=r"Scipy.* is not one that carries derivatives"):
        Shooting(solver=Scipy("Radau"))


def above_stops(load):
    """Two masses that chatter into rest on their stops once in a period, and the orbit's start."""
    rows = np.zeros((2, 3, 2))
    rows[:, 1] = np.eye(2)
    along = np.zeros((3, 2))
    along[1] = 1.0
    basis = fc.basis_from_matrices(np.eye(2), [[1.0152, -0.4], [-0.4, 1.0399]],
                                   {"contact": rows, "B": rows[0], "C": along},
                                   damping=0.1119 * np.eye(2))
    system = fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), load=fc.Load(load),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=2.738, frequency_hz=1.0645 / TURN))
    field = contact_field(system, "load.normal")
    scales = np.array([0.06, 0.06, 0.2, 0.2, 2.0 * np.pi / 1.0645, 1.0])
    problem = ShootingProblem(field, np.array([load]), 0, np.array([0.0, 1.0]), np.zeros(4), scales,
                              solver=SetValued(restitution=0.3))
    return problem, np.array([0.0, 0.0, 0.0, 0.0, load])


def test_multipliers_beside_complete_chatter_say_that_they_are_uncertain():
    """A motion that rests on its stops forgets all; where lift-off begins, runs end apart.

    The drive lifts with 0.5 * 2.738 = 1.369: it moves nothing under a larger load.
    """
    for load in (1.25, 1.37):
        problem, u = above_stops(load)
        point = problem.point(u, problem.linearise(u), u)
        assert np.abs(point["multipliers"]).max() < 1e-6
    problem, u = above_stops(1.36899)
    assert np.abs(problem.linearise(u).residual).max() < 1e-9
    with pytest.warns(ModelWarning, match=r"load.normal = 1\.36899 the .* are uncertain"):
        problem.point(u, problem.linearise(u), u)
