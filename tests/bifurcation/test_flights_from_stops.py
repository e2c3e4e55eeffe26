"""Orbits at rest on a stop that lift off, fly and come to rest again, against closed forms."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.linalg import expm
from systems import TURN
from test_borders_of_stops import (
    AMPLITUDE,
    BRIEF,
    FREQUENCY,
    HALF,
    INELASTIC,
    check_multipliers,
    followed,
    lifting,
    nearest,
    pair,
    resting,
)
from test_event_branches import skew
from test_sliding_bifurcations import DAMPING, impacting

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    Shooting,
    codim2_curve,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.bifurcation.events.conditions import DURATION, RATE, PhaseSequence, of_phase
from fecontact.bifurcation.events.phases import Phase
from fecontact.bifurcation.events.starts import orbit_from
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import ConstantFriction, LinearContact

OVER = {AMPLITUDE: (0.5, 10.0), FREQUENCY: (1.0 / TURN, 2.0 / TURN)}


@pytest.mark.parametrize(("start", "bounds", "direction"), [
    (1.76, (1.5, 1.82), 1.0), (1.805, (1.76, 2.0), -1.0),
    (1.785, (1.76, 2.0), -1.0)])
def test_rest_turns_into_flight_and_back(start, bounds, direction):
    """Beyond the border the flight has four times the time by which lift-off comes earlier."""
    field, branch = followed(resting(start), INELASTIC, AMPLITUDE, bounds, [AMPLITUDE, FREQUENCY],
                             direction=direction, largest_step=0.05)
    border, = branch.special
    assert branch.status is BranchStatus.BOUND
    assert (border.kind, border.persists, border.nodes) == ("lift-off", True, (0,))
    assert border.parameter == pytest.approx(lifting(1.3), rel=1e-11)
    flying = [point for point in branch.points if point.parameter > 1.78]
    assert len(flying) > 1
    check_multipliers(field, nearest(branch, 1.805), INELASTIC)
    curve = codim2_curve(field, border, FREQUENCY, bounds=OVER, options=BRIEF)
    w = TURN * curve.column(FREQUENCY)
    assert np.ptp(w) > 0.9
    assert curve.parameter == pytest.approx(lifting(w), rel=1e-11)


def free(w, lift, amplitude, begin):
    """Height over time of a mass that leaves the stop at a moment, without speed."""
    forced = 0.5 * amplitude / (1.0 - w**2 + 2j * DAMPING * w) * np.exp(1j * w * begin)
    start = -np.array([lift + forced.imag, (1j * w * forced).imag])
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]])

    def height(after):
        return (lift + (forced * np.exp(1j * w * after)).imag
                + (expm(after * matrix) @ start)[0])

    return height


def test_a_mass_that_rests_all_the_time():
    """A system that does not move takes its scales from the loads on it."""
    field, branch = followed(impacting(2.5, 0.8, -0.5), INELASTIC, AMPLITUDE, (0.7, 1.2),
                             [AMPLITUDE, FREQUENCY], largest_step=0.1)
    border, = branch.special
    assert (branch.status, border.kind, border.persists) == (BranchStatus.BOUND, "lift-off", True)
    # It weighs 1/2, and the drive pulls with half its amplitude.
    assert border.parameter == pytest.approx(1.0, rel=1e-12)
    point = branch.points[-1]
    flight = free(2.5, -0.5, 1.2, np.arcsin(1.0 / 1.2) / 2.5)
    known = max(flight(after) for after in np.linspace(0.3, 1.2, 181))
    assert point.orbit(field, 2001).states[:, 0].max() == pytest.approx(known, rel=1e-4)
    assert np.abs(point.values["multipliers"]).max() < 1e-12
    curve = codim2_curve(field, border, FREQUENCY, bounds={
        AMPLITUDE: (0.5, 3.0), FREQUENCY: (1.0 / TURN, 3.0 / TURN)},
        options=replace(BRIEF, locate=False))
    assert TURN * np.ptp(curve.column(FREQUENCY)) > 1.9
    assert curve.parameter == pytest.approx(np.ones(len(curve.points)), rel=1e-10)


def held_down(amplitude):
    """Two coupled masses with friction on stops; one is thrown up while the other rests."""
    rows = np.zeros((2, 3, 4))
    rows[0, :2, :2] = rows[1, :2, 2:] = [[1.0, 0.2], [0.0, 1.0]]
    rows[1, 0, 3] = 0.319
    load = np.zeros((3, 4))
    load[1, 1::2] = 1.0, 1.2
    basis = fc.basis_from_matrices(
        np.eye(4), [[2.383, 0.0, -0.151, 0.0], [0.0, 0.999, 0.0, -0.24],
                    [-0.151, 0.0, 2.538, 0.0], [0.0, -0.24, 0.0, 0.646]],
        {"contact": rows, "B": rows[0], "C": load}, damping=0.226 * np.eye(4))
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.173),
        ground=fc.Ground(speed=0.468), load=fc.Load(1.294),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=0.4234 / TURN))


def flights_of(amplitude, periods=30):
    """Durations of the flights of the first mass in a period of a settled run."""
    T = 2.0 * np.pi / 0.4234
    run = fc.simulate(held_down(amplitude), (periods + 2) * T, initial=np.zeros(8), rtol=1e-11,
                      solver=INELASTIC, outputs=2, events=ContactEvents())
    here = run.events.node == 0
    times, kinds = run.events.time[here], np.array(run.events.kind)[here]
    begins, ends = times[kinds == "lift-off"], times[kinds == "touch-down"]
    found = [(float(begin), float(ends[ends > begin][0] - begin)) for begin in begins
             if begin > periods * T and (ends > begin).any()]
    first = next(begin for begin, duration in found if duration > 1.0) - 0.1 * T
    return [duration for begin, duration in found if first < begin < first + T]


def test_a_landing_at_which_the_force_turns_to_press():
    """Beyond it the mass is thrown up once more where it lands, for as long as it lacks force."""
    field, branch = followed(held_down(7.3), INELASTIC, AMPLITUDE, (7.2, 7.9),
                             initial=np.zeros(8), largest_step=0.1)
    border, = branch.of_kind("lift-off")
    assert border.persists
    for point in (branch.points[0], branch.points[-1]):
        check_multipliers(field, point, INELASTIC)
    at = border.parameter
    sides = {off: flights_of(at + off) for off in (-2e-3, -1e-3, 1e-3, 2e-3)}
    counts = {off: len(found) for off, found in sides.items()}
    assert sorted(counts.values()) == [1, 1, 2, 2]
    assert counts[-2e-3] == counts[-1e-3]
    far, near = sorted(min(found) for found in sides.values() if len(found) == 2)[::-1]
    assert far / near == pytest.approx(2.0, abs=0.02)


def sliding(amplitude):
    """A mass that slips on a fast belt, pressed with 3/2, while a drive of spring 1/2 lifts it."""
    rows = [[1.0, 0.3], [0.0, 1.0], [0.0, 0.0]]
    basis = fc.basis_from_matrices(np.eye(2), np.diag([2.0, 0.5]),
                                   {"contact": [rows], "B": rows, "C": rows},
                                   damping=0.2 * np.eye(2))
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.3),
        ground=fc.Ground(speed=5.0), load=fc.Load(1.5),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=1.3 / TURN))


def test_lift_off_of_a_contact_that_slips():
    """The row along the belt also moves with the mode across, which rests; friction slips on."""
    field, branch = followed(sliding(2.5), INELASTIC, AMPLITUDE, (2.0, 3.5),
                             initial=[0.0, 0.0, 0.0, 0.0], largest_step=0.1)
    border, = branch.special
    assert (branch.status, border.kind, border.persists) == (BranchStatus.BOUND, "lift-off", True)
    assert border.parameter == pytest.approx(3.0, rel=1e-11)
    for value in (3.1, 3.4):
        check_multipliers(field, nearest(branch, value), INELASTIC)


def test_with_rebound_no_orbit_of_few_impacts_follows():
    """A mass that lifts off strikes the stop without end before it rests: the branch ends."""
    _, branch = followed(impacting(2.5, 0.8, -0.5), HALF, AMPLITUDE, (0.7, 1.6))
    end = branch.points[-1]
    assert (branch.status, end.kind, end.persists) == (
        BranchStatus.DISCONTINUITY, "lift-off", False)
    assert end.parameter == pytest.approx(1.0, rel=1e-12)


def phases_of(system, solver, initial, periods=1):
    field = contact_field(system, [AMPLITUDE])
    motion = periodic_motion(system, solver=solver, initial=initial, rtol=1e-9)
    return orbit_from(field, field.values, 0, float(motion.times[-1]), motion.states[-1],
                      float(motion.times[-1] - motion.times[0]), motion.periods,
                      widths=np.append(motion.amplitudes, 1.0), rtol=1e-9, solver=solver)


def test_slip_that_rebounds_in_an_impact_goes_on():
    """Tangential restitution reverses the slip; nothing could stick after the impact."""
    problem, u = phases_of(skew(8.0), SetValued(restitution=0.0, tangential_restitution=0.3),
                           [0.0, 0.5, 0.0, 0.0])
    assert any(phase.strike is not None for phase in problem.phases)
    assert problem.linearise(u).least.left > 0.0


def test_multipliers_of_motions_that_rest_where_the_period_begins():
    """Chatter is differenced, over steps in sizes of the motion; it forgets how it began."""
    solver = SetValued(restitution=0.2)
    system = pair(1.5, lift=-0.3)
    field = contact_field(system, [AMPLITUDE])
    motion = periodic_motion(system, solver=solver, initial=[0.0, 0.0, 0.0, 0.0], rtol=1e-9)
    assert np.abs(motion.states[-1]).max() < 1e-9 * np.abs(motion.states).max()
    branch = orbit_branch(field, motion, method=Shooting(1, solver=solver), bounds=(1.4, 1.6),
                          options=ContinuationOptions(points=1))
    assert branch.message == ("The runs of the orbit were differenced: The motion has events that "
                              "follow each other too closely.")
    assert np.abs(branch.points[0].values["multipliers"]).max() < 1e-6


@pytest.mark.parametrize(("order", "left"), [(1, 3.0), (2, 0.75)])
def test_rates_at_the_ends_of_brief_phases(order, left):
    """A function c s^k (tau - s), s from the begin, has the rate -c tau^k at its end."""
    phase = Phase((), (0,), 0, order=order)
    for part in (2e-6, 9e-6, 1e-4):
        sequence = PhaseSequence(None, (phase,), np.zeros(1), np.zeros((1, 2)),
                                 np.array([part, 1.0 - part]), np.array([[4.0], [1.0]]))
        rate = -12.0 / order**2 * part**order
        (_, what, *_), found = islice(of_phase(sequence, 0, rate), 2)
        assert [what, found.what] == [DURATION, RATE]
        assert found.left == pytest.approx(left, rel=1e-12)
