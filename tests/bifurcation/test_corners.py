"""Branches with corners: where contact opens or closes, and where elements begin to slide."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from oscillators import one_mode
from scipy.optimize import brentq
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    nonlinear_mode,
)
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.harmonic.stalled import stall_reason
from fecontact.bifurcation.nonlinear_modes.linear_start import XI, unforced, with_mass_damping
from fecontact.laws import JenkinsFriction, LinearContact, PrescribedForce
from fecontact.system.columns import NORMAL_FORCE


class Polyline(Problem):
    """A polygon in the plane: x = p up to the corner at 1, then along a ray of some direction."""

    def __init__(self, turn):
        self.along = np.array([np.cos(0.25 * np.pi + turn), np.sin(0.25 * np.pi + turn)])

    def weights(self):
        return np.ones(2)

    def linearise(self, u):
        # Both sides of the kink: behind the line across the mean of both directions, and ahead.
        before = float((self.along + np.sqrt(0.5)) @ (u - 1.0)) < 0.0
        a = np.full(2, np.sqrt(0.5)) if before else self.along
        row = np.array([-a[1], a[0]])
        return SimpleNamespace(
            residual=np.array([row @ (u - 1.0)]), row=row,
            solve=lambda last, rhs: np.linalg.solve(np.stack([row, last]), rhs))

    def orientation(self, linearisation, tangent):
        return float(np.sign(np.linalg.det(np.stack([linearisation.row, tangent]))))

    def point(self, u, linearisation, tangent):
        return {"x": float(u[0])}


@pytest.mark.parametrize("degrees", [20, 50, 80, 100, 130, 160, -30, -95, -150])
def test_a_corner_of_any_angle_is_passed(degrees):
    problem = Polyline(np.radians(degrees))
    branch = continue_branch(problem, np.array([0.0, 0.0]), ContinuationOptions(
        points=60, bounds=(-20.0, 20.0), largest_step=0.2))
    away = np.array([point.u for point in branch.points]) - 1.0
    last = away[-1] / np.linalg.norm(away[-1])
    assert last == pytest.approx(problem.along, abs=1e-9)
    # The corner costs few points, and none is left between both sides.
    near = np.linalg.norm(away, axis=1) < 0.05
    assert np.count_nonzero(near) < 8
    steps = np.linalg.norm(np.diff(away, axis=0), axis=1)
    assert steps.max() < 0.5


def stop(stiffness, gap=1.0, weight=0.0):
    """A mass of 1 kg on a spring of 1 N/m with a stop below."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows})
    return fc.ContactSystem(basis, normal=LinearContact(stiffness, 0.0), gap=(gap,),
                            drive=fc.Drive(stiffness_y=1.0), load=fc.Load(normal=weight))


def stop_frequency(k, half_range):
    """Angular frequency of x'' + x + k max(0, -x - 1) = 0: half swings over and in the stop."""
    if half_range <= 1.0:
        return 1.0

    def deepest(A):
        return np.roots([1.0 + k, -2.0 * k, k - A * A]).real.max()

    A = brentq(lambda A: 0.5 * (A + deepest(A)) - half_range, 1.0, 2.0 * half_range)
    w = np.sqrt(1.0 + k)
    free = 2.0 * (np.pi - np.arccos(1.0 / A))
    inside = 2.0 * np.arctan2(np.sqrt(A * A - 1.0) / w, 1.0 / (1.0 + k)) / w
    return 2.0 * np.pi / (free + inside)


@pytest.mark.parametrize(("stiffness", "H", "samples", "within"), [
    (10.0, 15, 512, 5e-5), (100.0, 9, None, 2e-3), (100.0, 25, 1024, 2e-4),
    (1e4, 9, None, 2e-2), (1e4, 25, 2048, 4e-3), (1e6, 9, None, 2.5e-2)])
def test_mode_of_a_mass_above_a_stop(stiffness, H, samples, within):
    """From no contact past grazing, a corner of the branch, to ten times the gap."""
    mode = nonlinear_mode(stop(stiffness), (0.1, 10.0), observe=("B", "y"),
                          method=HarmonicBalance(H, samples))
    assert mode.branch.status is BranchStatus.BOUND
    assert mode.amplitude[-1] == pytest.approx(10.0, rel=1e-6)
    assert mode.conservative
    exact = np.array([stop_frequency(stiffness, X) for X in mode.amplitude])
    assert mode.angular_frequency == pytest.approx(exact, rel=within)
    assert exact[-1] > 1.4
    # Nothing is jumped over at grazing.
    assert np.diff(mode.angular_frequency).max() < 0.03


def test_mode_of_a_mass_pressed_on_a_stiff_stop():
    """Lift-off at the static deflection: from the stiffness of the contact to flight."""
    k, load = 1e4, 100.0
    mode = nonlinear_mode(stop(k, 0.0, load), (1e-3, 1.0), observe=("B", "y"),
                          method=HarmonicBalance(25, 1024))
    assert mode.branch.status is BranchStatus.BOUND
    assert mode.angular_frequency[0] == pytest.approx(np.sqrt(1.0 + k), rel=1e-6)
    assert mode.coordinates(0)[0].real == pytest.approx(-load / (1.0 + k), rel=1e-4)
    pressed = mode.amplitude < 0.99 * load / (1.0 + k)
    assert mode.angular_frequency[pressed] == pytest.approx(np.sqrt(1.0 + k), rel=1e-6)
    # In flight with the height 2 X above the stop, but for the stop's own depth.
    top = mode.orbit(len(mode) - 1, 4001).states
    height, depth = top[:, 0].max(), -top[:, 0].min()
    w, rest = np.sqrt(1.0 + k), load
    speed = np.sqrt((height + rest) ** 2 - rest**2)
    flight = 2.0 * np.arctan2(speed, rest)
    inside = 2.0 * (np.pi - np.arctan2(speed / w, rest / (1.0 + k))) / w
    assert depth == pytest.approx(
        load / (1.0 + k) + np.hypot(speed / w, rest / (1.0 + k)), rel=1e-2)
    assert mode.angular_frequency[-1] == pytest.approx(2.0 * np.pi / (flight + inside), rel=2e-3)


def test_a_branch_that_stalls_in_stiff_contact_tells_why():
    system = stop(1e4)
    mode = nonlinear_mode(system, (0.9, 1.5), observe=("B", "y"), method=HarmonicBalance(3, 64))
    field = contact_field(unforced(system), {XI: (0.0, with_mass_damping)})
    stalled = replace(mode.branch, status=BranchStatus.STALLED)
    force = system.contact_history(np.zeros(64), mode.orbit(len(mode) - 1, 65).states[:-1])[
        :, 0, NORMAL_FORCE]
    touching = np.count_nonzero(force > 0.0)
    assert 0 < touching < 16
    told = stall_reason(field, stalled)
    assert f"opens and closes at 1 of 1 nodes, for {touching} of 64 samples" in told
    assert "Take samples = " in told
    assert stall_reason(field, mode.branch) == ""
    # Without contact there is nothing to tell.
    free = replace(stalled, points=stalled.points[:1])
    assert stall_reason(field, free) == ""


def stiff_jenkins():
    """A spring of 50 N/m that slides at 1 N, on a mass on a spring of 1 N/m."""
    return fc.ContactSystem(
        one_mode(), normal=PrescribedForce(1.0), friction=JenkinsFriction(50.0, 1.0),
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=1.0, frequency_hz=1.0 / TURN))


def test_few_samples_pass_the_onset_of_slip():
    """Coarse samples give a branch with corners, some of which lead back: none may stall it."""
    amplitudes, bounds = [], (0.5 / TURN, 10.0 / TURN)
    for samples in (64, 128, 1024):
        method = HarmonicBalance(5, samples, stability=None)
        branch = frequency_response(stiff_jenkins(), bounds, method=method).branches[0]
        assert branch.status is BranchStatus.BOUND
        assert len(branch) < 500
        # The largest amplitude by steps that do not depend on how the corners are passed.
        short = ContinuationOptions(largest_step=0.02, points=2000)
        amplitudes.append(frequency_response(
            stiff_jenkins(), bounds, method=method, options=short).amplitude().max())
    assert amplitudes[0] == pytest.approx(amplitudes[2], rel=1.2e-2)
    assert amplitudes[1] == pytest.approx(amplitudes[2], rel=5e-3)
