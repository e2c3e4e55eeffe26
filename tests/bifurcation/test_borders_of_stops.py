"""Borders of orbits at rigid stops: lift-off, corners, and impacts that begin to stop the slip.

References are closed forms, and differences of runs that know nothing of phases.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from systems import TURN
from test_event_branches import skew
from test_sliding_bifurcations import DAMPING, STOPS, impact_orbit, impacting

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
from fecontact.bifurcation.events.borders import border_of, nodes_of
from fecontact.bifurcation.events.conditions import CROSSING, Condition
from fecontact.bifurcation.events.phases import Strike
from fecontact.bifurcation.events.starts import orbit_from
from fecontact.integrate import SetValued
from fecontact.integrate.nonsmooth.problem import STICK
from fecontact.laws import ConstantFriction, LinearContact

INELASTIC, HALF = SetValued(restitution=0.0), SetValued(restitution=0.5)
AMPLITUDE, FREQUENCY = "drive.amplitude_y", "drive.frequency_hz"
BRIEF = ContinuationOptions(step=0.1, largest_step=0.2)


def followed(system, solver, parameter, bounds, names=None, initial="rest", **options):
    how = {name: options.pop(name) for name in ("both", "direction") if name in options}
    field = contact_field(system, names or [parameter])
    motion = periodic_motion(system, solver=solver, initial=initial, rtol=1e-9)
    return field, orbit_branch(field, motion, parameter, method=Shooting(1, solver=solver),
                               bounds=bounds, options=ContinuationOptions(step=0.02, **options),
                               **how)


def check_multipliers(field, point, solver, within=1e-6, closes=1e-9):
    """A run closes, and its differences have the multipliers of the orbit."""
    d = field.dimension
    there, start = field.system(point.parameter_values(field)), point.u[:d]
    period = point.values["period"]

    def ends(state):
        return fc.simulate(there, period, initial=state, solver=solver, rtol=1e-12,
                           outputs=2).states[-1]

    assert ends(start) == pytest.approx(start, abs=closes)
    known = np.linalg.eigvals(np.array([(ends(start + away) - ends(start - away)) / 2e-6
                                        for away in 1e-6 * np.eye(d)]).T)
    assert np.sort(np.abs(point.values["multipliers"])) == pytest.approx(
        np.sort(np.abs(known)), rel=1e-5, abs=within)


def nearest(branch, value):
    regular = [point for point in branch.points if point.kind is None]
    return min(regular, key=lambda point: abs(point.parameter - value))


def last_coefficient(speed):
    """Friction from which the impacts of the skew oscillator stop its slip, in closed form.

    y = q_2 is that of one impact a period with the rebound 1/2, whatever friction does. The impulse
    P of friction changes q_1' by -P, which is periodic, and L - P / 2 = 3/2 y'- is the change of
    q_2'; without slip q_1'+ + y'+ / 2 is the speed of the belt.
    """
    period = np.pi
    strike = next(speed for speed, found in impact_orbit(2.0, 8.0, -1.0, 0.5)
                  if np.abs(found).max() < 1.0)
    matrix = expm(period * np.array([[0.0, 1.0], [-2.0, -2.0 * DAMPING]]))
    answer = np.linalg.inv(np.eye(2) - matrix)[1, 1]
    tangential = (0.25 * strike - speed) / answer
    return abs(tangential) / (1.5 * strike + 0.5 * tangential)


def test_impacts_that_begin_to_stop_the_slip():
    name = "friction.friction_coefficient"
    field, branch = followed(skew(8.0), HALF, name, (0.15, 0.35), [name, "ground.speed"],
                             initial=[0.0, 0.5, 0.0, 0.0], both=True)
    border, = branch.special
    assert (branch.status, border.kind, border.persists, border.nodes) == (
        BranchStatus.BOUND, "impact-sliding", True, (0,))
    assert border.parameter == pytest.approx(last_coefficient(0.3), rel=1e-8)
    for value in (0.17, 0.3):
        check_multipliers(field, nearest(branch, value), HALF)
    # Slip that each impact stops has no memory.
    assert np.abs(nearest(branch, 0.3).values["multipliers"]).min() < 1e-12
    assert np.abs(nearest(branch, 0.17).values["multipliers"]).min() > 0.1
    curve = codim2_curve(field, border, "ground.speed", bounds={
        name: (0.02, 1.0), "ground.speed": (0.05, 1.2)}, options=BRIEF)
    speeds = curve.column("ground.speed")
    assert np.ptp(speeds) > 1.0
    assert curve.parameter == pytest.approx([last_coefficient(v) for v in speeds], rel=1e-7)


def test_slip_that_restarts_behind_an_impact_that_stops_it():
    """The reversal there is an event of the slip alone, no coincidence with the impact."""
    field = contact_field(skew(8.0), [AMPLITUDE])
    motion = periodic_motion(field.in_time(), solver=INELASTIC, initial=[0.0, 0.5, 0.0, 0.0],
                             rtol=1e-9)
    problem, u = orbit_from(field, field.values, 0, float(motion.times[-1]), motion.states[-1],
                            np.pi, 1, widths=np.ones(5), rtol=1e-9, solver=INELASTIC)
    struck = next(i for i, phase in enumerate(problem.phases) if phase.strike is not None)
    assert problem.phases[struck].strike.modes == (STICK,)
    assert problem.phases[struck].cluster() is None
    # Friction holds there; an orbit on which it is just too weak slips in the contact.
    phases = list(problem.phases)
    phases[struck + 1] = replace(phases[struck + 1], status=(1,), event=0)
    slips = replace(problem, phases=tuple(phases))
    condition = Condition(0.0, CROSSING, struck + 1, 0, 0.0)
    kind = border_of(slips, u, condition)
    assert kind == "crossing-sliding"
    assert nodes_of(slips, slips.motion(u), condition, kind) == (0,)
    # Where the impact leaves the slip going, both events meet there by chance.
    phases[struck] = replace(phases[struck], strike=Strike((0,), (1,)))
    assert border_of(replace(slips, phases=tuple(phases)), u, condition) == "corner"


def test_friction_at_a_stop_that_is_only_touched():
    """An orbit of one impact more begins at grazing, by an impact that slips."""
    field, branch = followed(skew(8.0), HALF, AMPLITUDE, (6.4, 8.1),
                             initial=[0.0, 0.5, 0.0, 0.0], direction=-1.0)
    grazing, = branch.of_kind("grazing")
    assert grazing.persists
    assert branch.status is BranchStatus.BOUND
    check_multipliers(field, branch.points[-1], HALF, 2e-5)


def resting(amplitude, w=1.3):
    """A mass on a stop, y_1 = 0, and one above it on a spring, which is driven."""
    rows = np.zeros((2, 3, 2))
    rows[:, 1] = np.eye(2)
    basis = fc.basis_from_matrices(
        np.diag([1.0, 0.5]), [[1.0, -1.0], [-1.0, 1.2]],
        {"contact": rows[:1], "B": rows[1], "C": rows[0]}, damping=[[0.2, -0.1], [-0.1, 0.2]])
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), load=fc.Load(1.0),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=w / TURN))


def lifting(w):
    """Amplitude of the drive at which the stop carries nothing for a moment."""
    return np.abs(1.7 + 0.2j * w - 0.5 * w**2) / (0.5 * np.abs(1.0 + 0.1j * w))


def test_lift_off_from_a_stop():
    field, branch = followed(resting(1.5), INELASTIC, AMPLITUDE, (0.5, 1.8),
                             [AMPLITUDE, FREQUENCY], largest_step=0.1, stop_at="lift-off")
    end = branch.points[-1]
    assert branch.status is BranchStatus.STOPPED
    assert (end.kind, end.nodes) == ("lift-off", (0,))
    assert end.parameter == pytest.approx(lifting(1.3), rel=1e-11)
    # The held mass has neither place nor speed that could differ: 0.5 y'' + 0.2 y' + 1.7 y.
    known = np.exp(np.roots([0.5, 0.2, 1.7]) * 2.0 * np.pi / 1.3)
    assert np.sort(np.abs(end.values["multipliers"])) == pytest.approx(
        [0.0, 0.0, *np.abs(known)], rel=1e-8)
    curve = codim2_curve(field, end, FREQUENCY, bounds={
        AMPLITUDE: (0.5, 10.0), FREQUENCY: (1.0 / TURN, 2.0 / TURN)}, options=BRIEF)
    w = TURN * curve.column(FREQUENCY)
    assert np.ptp(w) > 0.9
    assert curve.parameter == pytest.approx(lifting(w), rel=1e-8)


def longest_flight(w, lift):
    """Amplitude at which a mass that lifts off the stop comes back as it would lift off again."""
    period = 2.0 * np.pi / w
    matrix = expm(period * np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]]))

    def height(amplitude):
        begin = np.arcsin(-2.0 * lift / amplitude) / w
        forced = 0.5 * amplitude * np.exp(1j * w * begin) / (1.0 - w**2 + 2j * DAMPING * w)
        place, speed = lift + forced.imag, (1j * w * forced).imag
        return place - matrix[0] @ [place, speed]

    return brentq(height, 8.0, 10.0, xtol=1e-14)


def test_a_mass_that_lands_where_it_lifts_off_at_once():
    """Beyond the border it does not rest between its flights."""
    field, branch = followed(impacting(2.5, 8.0, -0.5), INELASTIC, AMPLITUDE, (7.9, 11.0),
                             largest_step=0.05)
    border, = branch.special
    assert (border.kind, border.persists) == ("lift-off", True)
    assert border.parameter == pytest.approx(longest_flight(2.5, -0.5), rel=1e-9)
    assert branch.status is BranchStatus.BOUND
    for point in (nearest(branch, 8.2), branch.points[-1]):
        check_multipliers(field, point, INELASTIC)


def pair(amplitude, w=2.4, lift=0.5):
    """Two coupled masses over stops, lifted and driven alike but for the second one's lift."""
    rows, body, load = np.zeros((2, 3, 2)), np.zeros((3, 2)), np.zeros((3, 2))
    rows[:, 1], body[1], load[1] = np.eye(2), 1.0, [1.0, 1.2]
    basis = fc.basis_from_matrices(np.eye(2), [[0.6, -0.4], [-0.4, 0.7]],
                                   {"contact": rows, "B": body, "C": load},
                                   damping=2.0 * DAMPING * np.eye(2))
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), load=fc.Load(-lift),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=w / TURN))


def both_at_once(w, lift, e=0.8):
    """Amplitude at which both masses of the pair strike at once, in closed form.

    What is unknown enters linearly: the speeds behind the impact, and the drive's cosine and sine
    at it. Both places are zero a period later, where the speeds are -1/e times those behind.
    """
    stiffness = np.array([[1.1, 0.1], [0.1, 1.2]])
    still, eye = np.linalg.solve(stiffness, lift * np.array([1.0, 1.2])), np.eye(2)
    answer = np.linalg.solve(stiffness - w**2 * eye + 2j * DAMPING * w * eye, [0.5, 0.5])
    E = expm(2.0 * np.pi / w * np.block([[0.0 * eye, eye], [-stiffness, -2.0 * DAMPING * eye]]))
    # Forced places and speeds by cosine and sine.
    place = np.column_stack([answer.imag, answer.real])
    speed = w * np.column_stack([answer.real, -answer.imag])
    forced = np.vstack([place, speed])
    matrix = np.hstack([E[:, 2:], (np.eye(4) - E) @ forced])
    matrix[2:, :2] += eye / e
    found = np.linalg.solve(matrix, -(np.eye(4) - E)[:, :2] @ still)
    return float(np.hypot(*found[2:]))


def test_two_stops_that_are_struck_at_once():
    """Impacts that do not act on each other exchange their order."""
    field, branch = followed(pair(5.0), STOPS, AMPLITUDE, (4.4, 5.1),
                             initial=[2.0, 2.0, 0.0, 0.0], direction=-1.0)
    corner, = branch.of_kind("corner")
    assert (corner.nodes, corner.persists) == ((0, 1), True)
    assert corner.parameter == pytest.approx(both_at_once(2.4, 0.5), rel=1e-8)
    assert branch.status is BranchStatus.BOUND
    for value in (4.45, 4.8):
        check_multipliers(field, nearest(branch, value), STOPS)
