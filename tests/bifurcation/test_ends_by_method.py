"""Branches by harmonic balance and by shooting that end by themselves, as by collocation."""

import numpy as np
import pytest
from systems import two_mass_field, two_mass_system, with_force
from test_branch_ends import homoclinic, lens, takens
from test_orbit_curves import ring

from fecontact import ContactSystem, Ground, basis_from_matrices
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    vector_field,
)
from fecontact.laws import BilateralPolynomial, CubicFriction


@pytest.mark.parametrize(("largest", "within"), [(0.01, 1e-9), (0.05, 1e-8), (0.2, 1e-7)])
def test_series_between_two_hopf_points(largest, within):
    """From p = 0 to p = 1, where the period is pi; once, not back as the same orbits."""
    field = vector_field(lens, {"p": -0.5}, 2)
    first, last = equilibrium_branch(field, parameter="p", bounds=(-0.5, 1.5)).of_kind("Hopf")
    orbits = orbit_branch(field, first, method=HarmonicBalance(harmonics=9), bounds=(-0.5, 1.5),
                          options=ContinuationOptions(largest_step=largest))
    assert orbits.status is BranchStatus.HOPF
    assert not orbits.special
    assert (np.diff(orbits.parameter) > 0.0).all()
    end = orbits.points[-1]
    assert end.parameter == pytest.approx(last.parameter, abs=within)
    assert end.values["period"] == pytest.approx(np.pi, abs=1e-8)
    radius = end.values["maximum"][0]
    assert 0.0 < radius < 1e-2 * largest
    assert 1.0 - end.parameter == pytest.approx(radius**2, rel=0.1)


def test_series_without_stability_end_too():
    field = vector_field(lens, {"p": -0.5}, 2)
    first, _ = equilibrium_branch(field, parameter="p", bounds=(-0.5, 1.5)).of_kind("Hopf")
    orbits = orbit_branch(field, first, bounds=(-0.5, 1.5),
                          method=HarmonicBalance(harmonics=9, stability=None))
    assert orbits.status is BranchStatus.HOPF
    assert orbits.points[-1].parameter == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("harmonics", [40, 60])
def test_series_that_end_homoclinic(harmonics):
    field = vector_field(takens, {"m": -1.0, "c": 0.2}, 2)
    hopf, = equilibrium_branch(field, [-1.0, 0.0], "c", bounds=(-2.0, 2.0)).of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=HarmonicBalance(harmonics=harmonics),
                          bounds=(-2.0, 2.0))
    assert orbits.status is BranchStatus.HOMOCLINIC
    assert not orbits.special
    end = orbits.points[-1]
    assert end.parameter == pytest.approx(homoclinic(-1.0), abs=3e-4)
    assert np.linalg.norm(end.orbit().states - [1.0, 0.0], axis=1).min() < 3e-3


@pytest.fixture(scope="module")
def between():
    """Two masses whose force rises from the Hopf point at p = 1 and comes back to it at p = 2."""
    sliding = equilibrium_branch(two_mass_field(), parameter="B", bounds=(0.3, 8.3))
    force = sliding.of_kind("Hopf")[0].parameter
    field = contact_field(two_mass_system(), {"p": (0.8, lambda system, p: with_force(
        system, force - 0.1 * (p - 1.0) * (2.0 - p)))})
    return field, equilibrium_branch(field, parameter="p", bounds=(0.7, 2.3)).of_kind("Hopf")


@pytest.mark.slow
@pytest.mark.parametrize("method", [Collocation(30), Shooting(1), Shooting(2), Shooting(4)])
def test_orbits_of_two_masses_between_two_hopf_points(between, method):
    field, (first, last) = between
    orbits = orbit_branch(field, first, method=method, bounds=(0.7, 2.3),
                          options=ContinuationOptions(largest_step=0.2))
    assert orbits.status is BranchStatus.HOPF
    assert not orbits.special
    end = orbits.points[-1]
    assert end.parameter == pytest.approx(last.parameter, abs=1e-4)
    assert end.values["period"] == pytest.approx(last.period, rel=1e-5)
    largest = max(np.ptp([at.values["minimum"][0], at.values["maximum"][0]]) for at in orbits)
    assert np.ptp([end.values["minimum"][0], end.values["maximum"][0]]) < 1e-2 * largest


@pytest.fixture(scope="module")
def wells():
    """A mass between two wells, q - q^3, driven by friction that falls with velocity on a belt.

    Orbits about the left well end at one homoclinic to the saddle between them.
    """
    rows = np.zeros((2, 3, 1))
    rows[0, 0, 0] = rows[1, 1, 0] = 1.0
    basis = basis_from_matrices([[1.0]], [[1.0]], {"contact": rows}, damping=[[0.02]])
    system = ContactSystem(
        basis, normal=BilateralPolynomial(stiffness=(0.0, -2.0), cubic_stiffness=(0.0, 1.0),
                                     preload=(0.2, 0.0)),
        friction=CubicFriction(0.4, 0.2, minimum_velocity=1.0), ground=Ground(speed=1.0))
    field = contact_field(system, {"ground.speed": None, "basis.damping.0.0": None})
    rest = find_equilibrium(field, start=[-1.0, 0.0])
    hopf, = equilibrium_branch(field, rest, "ground.speed", bounds=(0.5, 1.2), both=True).of_kind(
        "Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(60), bounds=(0.5, 1.2),
                          scales=[1.0, 1.0], options=ContinuationOptions(largest_step=0.2))
    assert orbits.status is BranchStatus.HOMOCLINIC
    return field, orbits


@pytest.mark.parametrize("method", [pytest.param(Shooting(4), marks=pytest.mark.long),
                                    HarmonicBalance(harmonics=40)])
def test_stick_free_orbits_that_end_homoclinic(wells, method):
    """The belt's speed there is the same by all methods, and on the curve of homoclinic orbits."""
    field, orbits = wells
    near = next(at for at in orbits if at.values["period"] > 11.0)
    found = orbit_branch(field, near.orbit(field, 4000), "ground.speed", method=method,
                         bounds=(0.5, 1.2), scales=[1.0, 1.0],
                         direction=float(np.sign(near.tangent[-1])),
                         options=ContinuationOptions(largest_step=0.2))
    assert found.status is BranchStatus.HOMOCLINIC
    end = found.points[-1]
    assert end.parameter == pytest.approx(orbits.points[-1].parameter, abs=1e-6)
    curve = codim2_curve(field, end, "basis.damping.0.0", to="homoclinic",
                         bounds={"ground.speed": (0.5, 1.2), "basis.damping.0.0": (0.015, 0.025)},
                         options=ContinuationOptions(points=2))
    assert curve.points[0].parameter == pytest.approx(end.parameter, abs=1e-6)
    assert curve.points[0].values["truncation_error"] < 1e-7


@pytest.mark.parametrize("method", [Collocation(20), HarmonicBalance(harmonics=9)])
def test_closed_branches(method):
    """s^2 + p s / 10 + p^2 = 1/4 - q^2 about the circle: gone round once."""
    field = vector_field(ring, {"p": 0.0, "q": 0.1}, 2)
    t = np.linspace(0.0, 2.0 * np.pi / np.sqrt(4.0 - 0.09 * 0.24), 600)
    circle = (1.0 - np.sqrt(0.24)) * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    orbits = orbit_branch(field, (t, circle), "p", method=method, bounds=(-1.0, 1.0),
                          scales=np.ones(2))
    assert orbits.status is BranchStatus.CLOSED
    assert [at.kind for at in orbits.special] == ["fold", "fold"]
    assert sorted(at.parameter for at in orbits.special) == pytest.approx(
        [-np.sqrt(0.24 / 0.9975), np.sqrt(0.24 / 0.9975)], abs=1e-6)
