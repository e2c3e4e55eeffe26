"""A point of any branch of orbits, by whichever method, starts a branch by any other."""

from functools import cache

import numpy as np
import pytest

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    periodic_motion,
)
from fecontact.integrate import SetValued
from fecontact.laws import (
    BilateralPolynomial,
    ConstantFriction,
    ExponentialFriction,
    PrescribedForce,
)

AMPLITUDE = "drive.amplitude_y"
METHODS = {"collocation": Collocation(), "shooting": Shooting(),
           "harmonic balance": HarmonicBalance(15, 128)}
# Orbits of twice the period need twice of each.
TWICE = {"collocation": Collocation(100), "shooting": Shooting(8),
         "harmonic balance": HarmonicBalance(30, 256)}
FRICTION = {"collocation": Collocation(100), "shooting": Shooting(),
            "harmonic balance": HarmonicBalance(25, 512),
            "event to event": Shooting(1, solver=SetValued())}


@cache
def hardening():
    """x'' + .1 x' + x / 2 + x^3 = P sin t: pitchforks at P 2.403 and 14.956, doubling at 14.004."""
    row = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": row[None], "B": row})
    return fc.ContactSystem(basis, normal=BilateralPolynomial(-0.5, 1.0), drive=fc.Drive(
        stiffness_y=1.0, damping_y=0.1, amplitude_y=1.0, frequency_hz=0.5 / np.pi))


@cache
def sliding():
    """A driven mass that sticks twice a period, with friction that is smoothed or not."""
    row = np.array([[1.0], [0.0], [0.0]])
    return fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": row[None], "B": row}),
        normal=PrescribedForce(1.0), friction=ConstantFriction(0.4, smoothing_slope=300.0),
        drive=fc.Drive(stiffness_x=1.0, amplitude_x=1.0, frequency_hz=0.3 / np.pi))


@cache
def field():
    return contact_field(hardening(), [AMPLITUDE])


@cache
def symmetric(how):
    """The symmetric orbits by a method, up to where they lose their symmetry."""
    return orbit_branch(field(), periodic_motion(hardening()), method=METHODS[how],
                        bounds=(0.9, 2.6))


@cache
def doubling(how):
    """The first doubling of orbits without symmetry, by a method."""
    whole = orbit_branch(field(), periodic_motion(hardening()), bounds=(0.9, 15.1),
                         options=ContinuationOptions(points=300))
    apart = orbit_branch(field(), whole.of_kind("branch point")[-1], method=METHODS[how],
                         bounds=(13.9, 16.0), options=ContinuationOptions(points=40))
    return apart.of_kind("period doubling")[0]


def extremes(branch, parameter):
    """Smallest and largest size of the displacement at a value of the parameter."""
    point = branch.at(field(), parameter)
    x = point.orbit(field(), 4001).states[:, 0]
    return np.sort(np.abs([x.min(), x.max()])), float(point.values["period"])


@pytest.mark.parametrize("to", METHODS)
@pytest.mark.parametrize("by", METHODS)
def test_orbits_without_symmetry_begin_at_a_branch_point(by, to):
    """Shooting finds them too, although its equations contain no other orbits."""
    point, = symmetric(by).of_kind("branch point")
    assert point.parameter == pytest.approx(2.4029, abs=2e-4)
    found = orbit_branch(field(), point, method=METHODS[to], bounds=(2.0, 2.45),
                         options=ContinuationOptions(points=60))
    assert found.status is BranchStatus.BOUND
    assert type(found.points[0].method) is type(METHODS[to])
    wanted = extremes(orbit_branch(field(), symmetric("collocation").of_kind("branch point")[0],
                                   bounds=(2.0, 2.45)), 2.44)
    sizes, period = extremes(found, 2.44)
    assert sizes == pytest.approx(wanted[0], rel=2e-5)
    assert period == pytest.approx(2.0 * np.pi, rel=1e-12)
    assert sizes[1] - sizes[0] > 0.02


@pytest.mark.parametrize("to", TWICE)
@pytest.mark.parametrize("by", TWICE)
def test_orbits_of_twice_the_period_begin_at_a_doubling(by, to):
    point = doubling(by)
    assert point.parameter == pytest.approx(14.0037, abs=5e-3)
    found = orbit_branch(field(), point, method=TWICE[to], bounds=(13.85, 16.0),
                         options=ContinuationOptions(points=60))
    assert found.status is BranchStatus.BOUND
    sizes, period = extremes(found, 13.9)
    assert period == pytest.approx(4.0 * np.pi, rel=1e-9)
    counted = {"collocation": "intervals", "shooting": "segments",
               "harmonic balance": "harmonics"}[to]
    assert getattr(found.method, counted) == getattr(TWICE[to], counted)
    exact, _ = extremes(orbit_branch(field(), doubling("collocation"), bounds=(13.85, 16.0)), 13.9)
    # Harmonic balance doubles .4 % early with 30 harmonics of twice the period.
    assert sizes == pytest.approx(exact, rel=3e-3 if to == "harmonic balance" else 1e-6)


@pytest.mark.parametrize("to", METHODS)
def test_orbits_are_born_at_a_hopf_point_by_each(to):
    row = np.array([[1.0], [0.0], [0.0]])
    system = fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row},
                               damping=[[0.1]]),
        normal=PrescribedForce(1.0), friction=ExponentialFriction(0.4, 0.2, 2.0, 50.0),
        ground=fc.Ground(speed=2.0))
    belt = contact_field(system, ["ground.speed"])
    rest = equilibrium_branch(belt, parameter="ground.speed", bounds=(0.3, 2.0), direction=-1.0)
    hopf = rest.of_kind("Hopf")[0]
    found = orbit_branch(belt, hopf, method=METHODS[to], options=ContinuationOptions(points=12))
    exact = orbit_branch(belt, hopf, options=ContinuationOptions(points=12))
    at = exact.points[8].parameter
    periods = [float(branch.at(belt, at).values["period"]) for branch in (found, exact)]
    assert periods[0] == pytest.approx(periods[1], rel=1e-6)
    assert hopf.period == pytest.approx(2.0 * np.pi, rel=1e-6)


@pytest.mark.parametrize("to", FRICTION)
@pytest.mark.parametrize("by", FRICTION)
def test_orbits_with_friction_go_on_by_any_other(by, to):
    """Smoothed by 300 s/m, and from event to event without smoothing."""
    over = contact_field(sliding(), ["drive.amplitude_x"])
    start = orbit_branch(over, periodic_motion(sliding(), initial=np.zeros(2), transient=60.0),
                         method=FRICTION[by], bounds=(0.9, 1.2),
                         options=ContinuationOptions(points=3)).points[1]
    found = orbit_branch(over, start, method=FRICTION[to], bounds=(0.9, 1.2),
                         options=ContinuationOptions(points=2))
    sizes = [np.abs(one.orbit(over, 2001).states[:, 0]).max() / one.parameter
             for one in (start, found.points[0])]
    assert sizes[1] == pytest.approx(sizes[0], rel=0.01 if by != to else 1e-9)
    assert (sizes[1] == pytest.approx(1.5148, rel=2e-3)) == (to == "event to event")


def test_too_few_harmonics_for_a_doubling_are_named():
    with pytest.raises(fc.FecontactError, match=r"is none with 2 harmonics; take more"):
        orbit_branch(field(), doubling("collocation"), method=HarmonicBalance(4, 64))
