"""Periodic orbits by shooting: the belt with steep friction, and collocation as a check."""

from dataclasses import replace

import numpy as np
import pytest
from systems import TURN, belt, lorenz_field, two_mass_field

from fecontact import AnalysisError, InputError, simulate
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    Shooting,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    quantity_range,
)
from fecontact.bifurcation.continuation.point import BranchHeader
from fecontact.bifurcation.continuation.pseudo_arclength import continuation
from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.bifurcation.orbits.restored import restored
from fecontact.bifurcation.orbits.shooting import shooting_from


@pytest.fixture(scope="module")
def two_masses():
    field = two_mass_field()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 9.0))
    return field, orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=150),
                               bounds=(0.3, 9.0))


@pytest.mark.parametrize("kind", ["fold", "period doubling"])
def test_special_points_agree_with_collocation(two_masses, kind):
    field, branch = two_masses
    point, = branch.of_kind(kind)
    problem, u, tangent = restored(field, point)
    shot, v = shooting_from(problem, u, 3, 1e-11)
    along = np.append(interpolate(problem.mesh, problem.nodes(tangent), shot.mesh[:-1]).reshape(-1),
                      tangent[problem.size:])
    along /= np.sqrt(shot.weights() @ along**2)
    near = ContinuationOptions(step=2e-3, largest_step=2e-3, points=3)
    found, = [at for at in continuation(shot, v - 1e-3 * along, near, tangent=along)
              if at.kind == kind]
    assert found.parameter == pytest.approx(point.parameter, rel=1e-9)
    assert found.values["period"] == pytest.approx(point.values["period"], rel=1e-9)


def test_multipliers_agree_with_collocation(two_masses):
    field, branch = two_masses
    point = min((at for at in branch.points if at.values["stable"]),
                key=lambda at: abs(at.parameter - 1.5))
    problem, u, _ = restored(field, point)
    for segments in (1, 5):
        shot, v = shooting_from(problem, u, segments, 1e-10)
        linearised = shot.linearise(v)
        assert np.abs(linearised.residual).max() < 1e-7
        assert linearised.floquet.multipliers[:2] == pytest.approx(
            point.values["multipliers"][:2], rel=1e-6)


def test_belt_with_steep_friction():
    system = belt(speed=1e-3)
    field = contact_field(system, {"ground.speed": None})
    run = simulate(system, 12.0, initial=np.array([0.0, 0.0]), outputs=24001, rtol=1e-8)
    branch = orbit_branch(field, run.between(9.0), "ground.speed",
                          method=Shooting(segments=2), bounds=(1e-3, 4e-3))
    first = branch.points[0]
    row = field.displacement_row(0)
    assert first.values["period"] == pytest.approx(1.264348, abs=2e-6)
    assert branch.parameter[-1] == pytest.approx(4e-3, rel=1e-9)
    assert branch.column("stable").all()
    # Samples: the largest displacements are met to the square of their spacing.
    assert row @ first.values["maximum"] == pytest.approx(1.953714e-3, rel=5e-3)
    assert branch.column("trivial_error").max() < 1e-4


def test_driven_belt_closes_after_four_periods():
    # Section 4.3 with constant normal force.
    system = belt(speed=1e-3).with_(**{"drive.amplitude_x": 0.5e-3,
                                       "drive.frequency_hz": 13.8 / TURN})
    field = contact_field(system, {"drive.amplitude_x": None})
    period = 2.0 * np.pi / 13.8
    run = simulate(system, 40.0 * period, initial=np.zeros(2), rtol=1e-8,
                   outputs=np.linspace(0.0, 40.0 * period, 8001))
    branch = orbit_branch(field, PeriodicMotion(run.time, run.states, periods=4),
                          "drive.amplitude_x", method=Shooting(), bounds=(0.5e-3, 0.52e-3),
                          options=ContinuationOptions(points=4))
    first = branch.points[0]
    assert first.values["period"] == pytest.approx(4.0 * period, rel=1e-12)
    assert first.values["stable"]
    # It is the motion of the run, and none of one or two periods.
    start = first.u[:2]
    distance = np.abs(run.states[:-1:200] - start).max(axis=1)
    assert distance[36] < 1e-8
    assert (distance[37:40] > 1e-4).all()
    with pytest.raises(AnalysisError, match=r"No periodic orbit was found at drive\.amplitude_x"):
        orbit_branch(field, PeriodicMotion(run.time, run.states, periods=1), "drive.amplitude_x",
                     method=Shooting())


def test_kind_errors(two_masses):
    field, branch = two_masses
    problem, u, _ = restored(field, branch.points[5])
    with pytest.raises(InputError, match="segments = 0 must be"):
        shooting_from(problem, u, 0)
    t = np.linspace(0.0, 20.0, 400)
    states = np.stack([np.cos(t), -np.sin(t), np.sin(t), np.cos(t)], axis=1) * 50.0
    with pytest.raises(AnalysisError, match=r"at B = 1 near the motion: Newton.*4 segments"):
        orbit_branch(field, PeriodicMotion(t, states, period=1.0), "B", method=Shooting())
    lorenz = lorenz_field()
    with pytest.raises(InputError, match="contact_field, or stay with collocation"):
        orbit_branch(lorenz, PeriodicMotion(t, states[:, :3], period=2.0 * np.pi), "rho",
                     method=Shooting())
    shot = orbits_by_shooting_point(field, problem, u)
    with pytest.raises(InputError, match="found by shooting"):
        quantity_range(shot, field.displacement_row(0))


def orbits_by_shooting_point(field, problem, u):
    shot, v = shooting_from(problem, u, 3)
    row = np.zeros(len(v))
    row[-1] = 1.0
    point = next(continuation(shot, v, ContinuationOptions(points=1), tangent=row))
    return replace(point, header=BranchHeader("B", shot.attributes()))
