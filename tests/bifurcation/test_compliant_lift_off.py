"""Set-valued friction on contact with a finite stiffness that opens, against linear responses."""

import numpy as np
import pytest
from systems import TURN
from test_borders_of_stops import (
    AMPLITUDE,
    BRIEF,
    FREQUENCY,
    check_multipliers,
    followed,
    nearest,
)

import fecontact as fc
from fecontact.bifurcation import BranchStatus, codim2_curve
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, LinearContact

FILIPPOV = SetValued()


def pressed(amplitude, friction, dashpot, w=1.3):
    """A mass on a contact of 6 N/m and a spring, pressed with 1.5 N, that slips on a fast belt."""
    rows = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    basis = fc.basis_from_matrices(np.eye(2), np.diag([2.0, 0.5]),
                                   {"contact": [rows], "B": rows, "C": rows},
                                   damping=0.2 * np.eye(2))
    return fc.ContactSystem(
        basis, normal=LinearContact(6.0, dashpot), friction=ConstantFriction(friction),
        ground=fc.Ground(speed=5.0), load=fc.Load(1.5),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=w / TURN))


def opening(w, dashpot):
    """Amplitude of the drive at which the normal force 6 u + d u' of the linear response is zero
    for a moment.
    """
    response = 0.5 / (7.0 - w**2 + 1j * w * (0.2 + dashpot))
    return 6.0 * 1.5 / 7.0 / np.abs((6.0 + 1j * w * dashpot) * response)


@pytest.mark.parametrize(("friction", "dashpot"), [
    (0.0, 0.4), (0.3, 0.0), pytest.param(0.0, 0.0, marks=pytest.mark.slow),
    pytest.param(0.3, 0.4, marks=pytest.mark.slow)])
def test_first_opening_of_a_contact_with_stiffness(friction, dashpot):
    field, branch = followed(pressed(1.8, friction, dashpot), FILIPPOV, AMPLITUDE, (1.5, 4.0),
                             [AMPLITUDE, FREQUENCY], largest_step=0.1)
    end = branch.points[-1]
    assert branch.status is BranchStatus.DISCONTINUITY
    assert (end.kind, end.persists, end.nodes) == ("lift-off", False, (0,))
    assert end.parameter == pytest.approx(opening(1.3, dashpot), rel=1e-10)
    across = np.exp(-0.5 * (0.2 + dashpot) * 2.0 * np.pi / 1.3)
    along = np.exp(-0.1 * 2.0 * np.pi / 1.3)
    assert np.sort(np.abs(branch.points[0].values["multipliers"])) == pytest.approx(
        sorted([across, across, along, along]), rel=1e-9)
    curve = codim2_curve(field, end, FREQUENCY, bounds={
        AMPLITUDE: (0.2, 20.0), FREQUENCY: (0.8 / TURN, 2.0 / TURN)}, options=BRIEF)
    w = TURN * curve.column(FREQUENCY)
    assert np.ptp(w) > 1.1
    assert curve.parameter == pytest.approx(opening(w, dashpot), rel=1e-7)


@pytest.mark.parametrize("friction", [0.3, 0.0])
def test_orbits_that_open_are_differenced(friction):
    """With a dashpot the force jumps where the contact closes, which multipliers must know."""
    field, branch = followed(pressed(2.8, friction, 0.4), FILIPPOV, AMPLITUDE, (2.6, 3.0),
                             points=3, tolerance=1e-9)
    assert branch.message == "The runs of the orbit were differenced: A compliant contact opens."
    check_multipliers(field, nearest(branch, 2.8), FILIPPOV, 1e-5, 3e-8)


def test_a_contact_that_opens_for_a_short_moment_is_seen():
    """The force is never below zero, and events between samples of the orbit may be brief."""
    value = (1.0 + 2e-4) * opening(1.3, 0.4)
    _, branch = followed(pressed(value, 0.3, 0.4), FILIPPOV, AMPLITUDE, (2.2, 3.0), points=1)
    assert "A compliant contact opens." in branch.message
