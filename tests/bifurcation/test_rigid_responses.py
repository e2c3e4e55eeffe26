"""Frequency responses with rigid dry friction and rigid stops, against closed forms."""

import numpy as np
import pytest
from scipy.optimize import root
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    frequency_response,
)
from fecontact.integrate import EventDriven, SetValued
from fecontact.laws import (
    ConstantFriction,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)

FREQUENCY = "load.forces.0.signal.frequency_hz"


def oscillator(axis, loss=0.0, **parts):
    """A unit mass on a unit spring, the force sin w t along the axis of its contact."""
    row = np.zeros((3, 1))
    row["xy".index(axis), 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row, "force": row},
                                   damping=[[loss]])
    return fc.ContactSystem(basis, load=fc.Load(forces=(
        fc.PointLoad("force", axis, signal=Harmonic(1.0, 1.0)),)), **parts)


def test_dry_friction_of_den_hartog():
    """Without stops, x_max^2 = V^2 - (F U)^2 with V = 1 / (1 - r^2) and U of the ratio r."""
    friction = 0.4
    system = oscillator("x", normal=PrescribedForce(1.0), friction=ConstantFriction(friction))
    branch = frequency_response(
        system, (0.65 / TURN, 0.84 / TURN), FREQUENCY, method=Shooting(1, solver=EventDriven()),
        options=ContinuationOptions(step=0.1, largest_step=0.3)).branches[0]
    assert branch.status is BranchStatus.BOUND
    r = TURN * branch.parameter
    U = np.sin(np.pi / r) / (r * (1.0 + np.cos(np.pi / r)))
    exact = np.sqrt((1.0 - r * r)**-2 - (friction * U)**2)
    assert branch.column("observed_amplitude") == pytest.approx(exact, rel=1e-5)
    assert branch.column("stable").all()


def test_a_response_starts_at_the_other_bound_where_nothing_vibrates_at_one():
    """The force stands still at 0 Hz."""
    friction = 0.4
    system = oscillator("x", normal=PrescribedForce(1.0), friction=ConstantFriction(friction))
    branch = frequency_response(
        system, (0.0, 0.84 / TURN), FREQUENCY, method=Shooting(1, solver=EventDriven()),
        options=ContinuationOptions(step=0.1, largest_step=0.3, points=3)).branches[0]
    r = TURN * branch.parameter
    assert r[0] == pytest.approx(0.84, rel=1e-12)
    assert (np.diff(r) < 0.0).all()
    U = np.sin(np.pi / r) / (r * (1.0 + np.cos(np.pi / r)))
    exact = np.sqrt((1.0 - r * r)**-2 - (friction * U)**2)
    assert branch.column("observed_amplitude") == pytest.approx(exact, rel=1e-5)


def test_a_stiff_element_stands_for_dry_friction_in_harmonic_balance():
    """With an error of the order of 1 / H, that of any series of a force which jumps."""
    friction, r = 0.4, 0.75
    system = oscillator("x", normal=PrescribedForce(1.0), friction=JenkinsFriction(1e4, friction))
    U = np.sin(np.pi / r) / (r * (1.0 + np.cos(np.pi / r)))
    exact = np.sqrt((1.0 - r * r)**-2 - (friction * U)**2)
    off = []
    for harmonics in (5, 15, 45):
        branch = frequency_response(
            system, (r / TURN, 1.01 * r / TURN), FREQUENCY,
            method=HarmonicBalance(harmonics, 512, stability=None),
            options=ContinuationOptions(points=1)).branches[0]
        off.append(abs(float(branch.points[0].values["observed_amplitude"]) / exact - 1.0))
    assert off[0] < 2.5e-2
    assert off[2] < 5.5e-3
    assert off[2] < 0.6 * off[1] < 0.36 * off[0]


def test_extremes_of_a_motion_that_no_event_divides():
    """Harmonic motion below the stop: V sin and w V cos, which are largest between samples."""
    loss = 0.1
    system = oscillator("y", loss, normal=LinearContact(1e6), friction=ConstantFriction(0.0),
                        gap=5.0)
    branch = frequency_response(
        system, (1.6 / TURN, 1.85 / TURN), FREQUENCY, observe=("B", "y"),
        method=Shooting(1, rtol=1e-11, solver=SetValued(restitution=0.5)),
        options=ContinuationOptions(points=3)).branches[0]
    w = TURN * branch.parameter
    V = 1.0 / np.hypot(1.0 - w * w, loss * w)
    largest = np.stack([V, w * V], axis=1)
    assert branch.column("maximum") == pytest.approx(largest, rel=1e-8)
    assert branch.column("minimum") == pytest.approx(-largest, rel=1e-8)


def impacts(w, loss, restitution):
    """Largest displacements of all motions with one impact at -1 in a period of the force."""
    T, decay = TURN / w, 0.5 * loss
    own = np.sqrt(1.0 - decay**2)
    forced = 1.0 / (1.0 - w * w + 1j * loss * w)

    def motion(z, times):
        t0, v = z
        x0, v0 = (forced * np.exp(1j * w * t0) * np.array([1.0, 1j * w])).imag
        a = -1.0 - x0
        b = (-restitution * v - v0 + decay * a) / own
        fade, c, s = np.exp(-decay * times), np.cos(own * times), np.sin(own * times)
        free = fade * (a * c + b * s)
        rate = fade * ((own * b - decay * a) * c - (own * a + decay * b) * s)
        wave = forced * np.exp(1j * w * (t0 + times))
        return free + wave.imag, rate + (1j * w * wave).imag

    def returns(z):
        x, v = motion(z, T)
        return [x + 1.0, v - z[1]]

    found = []
    for t0 in np.linspace(0.0, T, 12, endpoint=False):
        for v in (-0.3, -1.0, -3.0):
            one = root(returns, [t0, v], tol=1e-12)
            x = motion(one.x, np.linspace(0.0, T, 2001))[0]
            if one.success and one.x[1] < -1e-6 and x.min() > -1.0 - 1e-9:
                found.append(x.max())
    return np.array(found)


@pytest.mark.slow
def test_rigid_stop_from_impacts_over_the_fold_to_free_motion():
    """Stable impacts up to a fold, unstable ones back to where they graze, then none."""
    loss, restitution = 0.1, 0.8
    system = oscillator("y", loss, normal=LinearContact(1e6), friction=ConstantFriction(0.0),
                        gap=1.0)
    branch = frequency_response(
        system, (1.4 / TURN, 1.85 / TURN), FREQUENCY, observe=("B", "y"),
        method=Shooting(1, solver=SetValued(restitution=restitution)),
        options=ContinuationOptions(step=0.05, largest_step=0.12)).branches[0]
    assert branch.status is BranchStatus.BOUND
    fold, = branch.of_kind("fold")[:1]
    touched, seen = [], set()
    for point in branch.points[::3]:
        w, top = TURN * point.parameter, point.values["observed_maximum"]
        free = 1.0 / np.hypot(1.0 - w * w, loss * w)
        if top == pytest.approx(free, rel=1e-5):
            assert free < 1.0
            continue
        assert np.abs(impacts(w, loss, restitution) / top - 1.0).min() < 5e-5
        touched.append(w)
        seen.add(bool(point.values["stable"]))
    assert seen == {True, False}
    assert len(touched) > 5
    assert max(touched) <= TURN * fold.parameter * (1.0 + 1e-9)
