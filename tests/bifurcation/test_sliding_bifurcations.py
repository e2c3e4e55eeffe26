"""Orbits from event to event: saltation, borders of their contact states, curves of these.

References are closed forms, and runs that know nothing of phases.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from spectra import spectral_distance
from systems import TURN
from systems import belt_of_unit_mass as belt

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    DiscontinuityPoint,
    Shooting,
    codim2_curve,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.bifurcation.events.starts import orbit_from
from fecontact.integrate import ContactEvents, SetValued
from fecontact.io import read_branch, write_branch
from fecontact.laws import ConstantFriction, ExponentialFriction, LinearContact, PrescribedForce

STATIC, FILIPPOV, STOPS = (SetValued(static_coefficient=1.0), SetValued(),
                           SetValued(restitution=0.8))
ROW = [[1.0], [0.0], [0.0]]
DAMPING = 0.05  # damping ratio of the forced oscillators, of unit frequency


def last_speed(dashpot):
    """Belt speed at which the orbit that leaves stick comes back to v = V with no acceleration.

    About x = 1/2: z'' + c z' + z = 0, from z = 1/2 - c V (the spring balances the static limit).
    """
    w = np.sqrt(1.0 - 0.25 * dashpot**2)
    A = np.array([[0.0, 1.0], [-1.0, -dashpot]])

    def misses(speed):
        start = np.array([0.5 - dashpot * speed, speed])

        def slope(t):
            return (A @ expm(A * t) @ start)[1]

        # It falls at first, then grows to its next crest.
        times = np.linspace(0.0, 2.2 * np.pi / w, 100)
        slopes = np.array([slope(t) for t in times])
        last = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))[0]
        crest = brentq(slope, times[last], times[last + 1], xtol=1e-15)
        return (expm(A * crest) @ start)[1] - speed

    return brentq(misses, 0.12, 1.5, xtol=1e-13)


def forced(beta=0.4, speed=0.1, w=1.5):
    """x'' + 2 D x' + x = cos(w t) - friction beta against a belt."""
    basis = fc.basis_from_matrices([[1.0]], [[0.5]], {"contact": [ROW], "B": ROW, "C": ROW},
                                   damping=[[2.0 * DAMPING]])
    return fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction=ConstantFriction(beta),
        ground=fc.Ground(speed=speed),
        drive=fc.Drive(stiffness_x=0.5, amplitude_x=2.0, frequency_hz=w / TURN))


def impacting(w=0.8, amplitude=1.2, lift=2.0):
    """y'' + 2 D y' + y = lift + amplitude / 2 sin(w t) over a stop at y = 0, e = 0.8."""
    rows = [[0.0], [1.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[0.5]], {"contact": [rows], "B": rows, "C": rows},
                                   damping=[[2.0 * DAMPING]])
    return fc.ContactSystem(
        basis, normal=LinearContact(1e6), friction=ConstantFriction(0.0), load=fc.Load(-lift),
        drive=fc.Drive(stiffness_y=0.5, amplitude_y=amplitude, frequency_hz=w / TURN))


def gain(w):
    """Amplitude of the linear response to a unit force."""
    return 1.0 / np.abs(1.0 - w**2 + 2j * DAMPING * w)


def events_of(system, solver, periods=60):
    """Stick phases (begin, end) in one period of a settled run, from its events alone."""
    T = 1.0 / system.parameters()["drive.frequency_hz"]
    run = fc.simulate(system, (periods + 2) * T, solver=solver, rtol=1e-11,
                      events=ContactEvents(), outputs=2)
    begins = run.events.only("stick").time
    ends = run.events.only("slip").time if len(begins) else begins
    begins = begins[(begins > periods * T) & (begins <= (periods + 1) * T)]
    return [float(ends[ends > begin][0] - begin) for begin in begins]


@pytest.fixture(scope="module")
def over_speed():
    """One period of the forced oscillator over the speed of the belt, through three borders."""
    system = forced()
    field = contact_field(system, ["ground.speed", "drive.frequency_hz"])
    return field, orbit_branch(
        field, periodic_motion(system, solver=FILIPPOV, rtol=1e-9), "ground.speed",
        method=Shooting(1, solver=FILIPPOV), bounds=(0.1, 1.5),
        options=ContinuationOptions(step=0.02))


@pytest.mark.slow
def test_end_of_stick_slip_and_its_curve(tmp_path):
    speed = 0.97 * last_speed(0.1)
    system = belt(speed, 0.1)
    field = contact_field(system, {"ground.speed": None, "dashpot": (
        0.1, lambda system, c: system.with_(basis=belt(1.0, c).basis))})
    motion = periodic_motion(system, initial=np.array([0.9, speed]), transient=40.0,
                             longest_period=20.0, solver=STATIC, rtol=1e-9)
    branch = orbit_branch(field, motion, "ground.speed", method=Shooting(1, solver=STATIC),
                          bounds=(0.5, 0.7), options=ContinuationOptions(step=0.02))
    end = branch.points[-1]
    assert branch.status is BranchStatus.DISCONTINUITY
    assert isinstance(end, DiscontinuityPoint)
    assert (end.kind, end.nodes, end.persists, end.located) == ("grazing-sliding", (0,), False,
                                                                True)
    assert end.parameter == pytest.approx(last_speed(0.1), rel=1e-9)
    write_branch(tmp_path / "branch.h5", branch)
    again = read_branch(tmp_path / "branch.h5").points[-1]
    assert isinstance(again, DiscontinuityPoint)
    curve = codim2_curve(field, again, "dashpot", bounds={
        "ground.speed": (0.2, 1.0), "dashpot": (0.03, 0.4)},
        options=ContinuationOptions(step=0.1, largest_step=0.2))
    dashpots = curve.column("dashpot")
    assert curve.status is BranchStatus.BOUND
    assert np.ptp(curve.parameter) > 0.7
    assert curve.parameter == pytest.approx([last_speed(c) for c in dashpots], rel=1e-8)
    assert curve.points[0].values["period"] > 0.0


@pytest.mark.slow
def test_crossing_switching_and_grazing_sliding(over_speed):
    _, branch = over_speed
    found = [(point.kind, point.persists) for point in branch.special]
    assert found == [("crossing-sliding", True), ("switching-sliding", True),
                     ("grazing-sliding", True)]
    assert branch.status is BranchStatus.BOUND
    crossing, switching, grazing = (point.parameter for point in branch.special)
    # A stick phase appears and grows with the distance; at the end it vanishes with its root.
    assert events_of(forced(speed=crossing - 1e-3), FILIPPOV) == []
    short = [events_of(forced(speed=crossing + off), FILIPPOV) for off in (1e-3, 2e-3)]
    assert short[1][0] / short[0][0] == pytest.approx(2.0, abs=0.02)
    assert len(events_of(forced(speed=switching + 1e-3), FILIPPOV)) == 1
    last = [events_of(forced(speed=grazing - off), FILIPPOV)[0] for off in (1e-3, 4e-3)]
    assert last[1] / last[0] == pytest.approx(2.0, abs=0.02)
    assert events_of(forced(speed=grazing + 1e-3), FILIPPOV) == []


def test_only_slip_is_linear(over_speed):
    """Beyond the last border friction is constant: the response to a force, and its multipliers."""
    _, branch = over_speed
    point = branch.points[-1]
    values = point.values
    assert (values["maximum"][0] - values["minimum"][0]) / 2.0 == pytest.approx(gain(1.5),
                                                                                rel=5e-4)
    period = 2.0 * np.pi / 1.5
    assert np.abs(values["multipliers"]) == pytest.approx(np.full(2, np.exp(-DAMPING * period)),
                                                          rel=1e-9)


def test_curve_of_grazing_sliding(over_speed):
    """Slip touches rest where the greatest speed of the linear response is that of the belt."""
    field, branch = over_speed
    grazing = branch.of_kind("grazing-sliding")[0]
    assert grazing.parameter == pytest.approx(1.5 * gain(1.5), rel=1e-9)
    curve = codim2_curve(field, grazing, "drive.frequency_hz", bounds={
        "ground.speed": (0.5, 1.5), "drive.frequency_hz": (1.3 / TURN, 2.0 / TURN)},
        options=ContinuationOptions(step=0.1, largest_step=0.2))
    w = TURN * curve.column("drive.frequency_hz")
    assert np.ptp(w) > 0.5
    assert curve.parameter == pytest.approx(w * gain(w), rel=1e-8)


def test_adding_sliding():
    """Within stick a slip phase appears, that grows with the root of the distance."""
    system = forced(0.6, 0.05, 0.25)
    field = contact_field(system, ["drive.frequency_hz"])
    branch = orbit_branch(field, periodic_motion(system, solver=FILIPPOV, rtol=1e-9),
                          method=Shooting(1, solver=FILIPPOV), bounds=(0.2 / TURN, 0.3 / TURN),
                          direction=-1.0, options=ContinuationOptions(step=0.02, points=30))
    adding = branch.of_kind("adding-sliding")[0]
    assert adding.persists
    stick = [events_of(forced(0.6, 0.05, TURN * adding.parameter + off), FILIPPOV, 30)
             for off in (1e-4, -1e-4, -4e-4)]
    assert [len(each) for each in stick] == [2, 3, 3]
    free = [sum(stick[0]) - sum(each) for each in stick[1:]]
    assert free[1] / free[0] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("ratio", "limit"), [(1.5, 0.6465790873), (0.8, 0.8174063857)])
def test_den_hartogs_limit(ratio, limit):
    """The undamped oscillator at rest stops twice a period from this friction on, symmetrically."""
    basis = fc.basis_from_matrices([[1.0]], [[0.5]], {"contact": [ROW], "B": ROW, "C": ROW})
    system = forced(0.4, 0.0, ratio).with_(basis=basis)
    field = contact_field(system, ["friction.friction_coefficient"])
    branch = orbit_branch(field, periodic_motion(system, solver=FILIPPOV, rtol=1e-9),
                          method=Shooting(1, solver=FILIPPOV), bounds=(0.4, 0.9),
                          options=ContinuationOptions(step=0.02))
    assert [(point.kind, point.persists) for point in branch.special] == [
        ("crossing-sliding", True)]
    assert branch.special[0].parameter == pytest.approx(limit, abs=2e-10)


def impact_orbit(w, amplitude, lift, e=0.8):
    """Impact speed and multipliers of the orbit of one impact a period, in closed form.

    Between impacts y = lift + Re(Y exp(i (w t + p))) + free vibration; y = 0 at both ends of a
    period and y'(0) = -e y'(T) give the phase p of the impact.
    """
    T, response = 2.0 * np.pi / w, 0.5 * amplitude / (1.0 - w**2 + 2j * DAMPING * w)
    A = np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]])
    whole = expm(A * T)

    def speeds(p):
        forced = lift + (response * np.exp(1j * p)).real
        rate = (1j * w * response * np.exp(1j * p)).real
        # Free part: starts and ends at -forced.
        b = -forced * (1.0 - whole[0, 0]) / whole[0, 1]
        return b + rate, whole[1] @ [-forced, b] + rate

    def off(p):
        after, before = speeds(p)
        return after + e * before

    phases = np.linspace(0.0, 2.0 * np.pi, 20001)
    found = []
    for one, other in pairwise(phases):
        if off(one) * off(other) <= 0.0:
            p = brentq(off, one, other, xtol=1e-15)
            after, before = speeds(p)
            if before < 0.0:
                force = lift + 0.5 * amplitude * np.exp(1j * p).real
                rates = [force - 2.0 * DAMPING * v for v in (before, after)]
                jump = np.array([[-e, 0.0], [(rates[1] + e * rates[0]) / before, -e]])
                found.append((-before, np.linalg.eigvals(jump @ whole)))
    return found


@pytest.mark.slow
def test_grazing_of_a_stop_and_the_orbits_with_impacts():
    system = impacting()
    field = contact_field(system, ["drive.amplitude_y", "drive.frequency_hz"])
    motion = periodic_motion(system, solver=STOPS, initial=[2.0, 0.0], rtol=1e-9)
    branch = orbit_branch(field, motion, "drive.amplitude_y", method=Shooting(1, solver=STOPS),
                          bounds=(1.0, 3.0),
                          options=ContinuationOptions(step=0.02, tolerance=1e-10))
    grazing = branch.of_kind("grazing")[0]
    assert grazing.parameter == pytest.approx(4.0 / gain(0.8), rel=1e-11)
    assert grazing.persists
    doubling = branch.of_kind("period doubling")[0]
    behind = [point for point in branch.points if point.parameter > 1.01 * grazing.parameter
              and point.kind is None]
    assert len(behind) > 10
    for point in behind:
        multipliers = point.values["multipliers"]
        orbits = impact_orbit(0.8, point.parameter, 2.0)
        misfits = [spectral_distance(multipliers, known) for _, known in orbits]
        assert min(misfits) < 1e-7 * (1.0 + np.abs(multipliers).max())
        assert np.prod(multipliers).real == pytest.approx(
            0.64 * np.exp(-2.0 * DAMPING * 2.0 * np.pi / 0.8), rel=1e-6)

    def critical(amplitude):
        return min(abs(known + 1.0).min() for _, known in impact_orbit(0.8, amplitude, 2.0))

    assert critical(doubling.parameter) < 1e-7
    curve = codim2_curve(field, grazing, "drive.frequency_hz", bounds={
        "drive.amplitude_y": (0.1, 8.0), "drive.frequency_hz": (0.7 / TURN, 1.2 / TURN)},
        options=ContinuationOptions(step=0.1, largest_step=0.2))
    w = TURN * curve.column("drive.frequency_hz")
    assert curve.parameter == pytest.approx(4.0 / gain(w), rel=1e-9)
    turning = curve.of_kind("turning point")[0]
    assert TURN * turning.values["drive.frequency_hz"] == pytest.approx(
        np.sqrt(1.0 - 2.0 * DAMPING**2), abs=1e-7)


def two_blocks(friction):
    """Two masses with falling friction on a belt, one of them driven."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    basis = fc.basis_from_matrices(
        np.diag([1.0, 1.5]), [[2.0, -1.0], [-1.0, 1.5]], {"contact": rows, "B": rows[0]},
        damping=[[0.1, 0.0], [0.0, 0.1]])
    return fc.ContactSystem(
        basis, normal=PrescribedForce((1.0, 1.0)), ground=fc.Ground(speed=0.2),
        friction=friction,
        drive=fc.Drive(stiffness_x=0.5, amplitude_x=1.5, frequency_hz=0.9 / TURN))


def two_blocks_from_event_to_event():
    system = two_blocks(ConstantFriction(0.3))
    field = contact_field(system, ["ground.speed"])
    motion = periodic_motion(system, solver=FILIPPOV, rtol=1e-10)
    return orbit_from(field, field.values, 0, motion.times[0], motion.states[0],
                      motion.times[-1] - motion.times[0], motion.periods,
                      widths=np.append(motion.amplitudes, 1.0), rtol=1e-10, solver=FILIPPOV)


def test_derivatives_of_the_equations():
    problem, u = two_blocks_from_event_to_event()
    assert problem.count >= 4
    matrix, step = problem.linearise(u).matrix, 1e-4
    for k in range(len(u)):
        away = np.zeros(len(u))
        away[k] = step
        slope = (problem.linearise(u + away).residual
                 - problem.linearise(u - away).residual) / (2.0 * step)
        assert matrix[:, k] == pytest.approx(slope, abs=1e-5 * (1.0 + np.abs(slope).max()))


@pytest.mark.parametrize("back", [False, True])
def test_phases_of_many_periods_are_refused(back):
    """A far guess of Newton's method may have one that is long, and one that goes back."""
    problem, u = two_blocks_from_event_to_event()
    first = problem.count * problem.dimension
    u[first] += 1e3 * problem.period(u)
    if back:
        u[first + 1] -= 0.999 * problem.period(u)
    with pytest.raises(fc.AnalysisError, match="longer than its period"):
        problem.linearise(u)


def test_multipliers_against_differences_of_runs():
    """Friction that falls with the speed of slip; two masses that stick and slip."""
    system = two_blocks(ExponentialFriction(0.4, 0.25, 3.0))
    field = contact_field(system, ["ground.speed"])
    motion = periodic_motion(system, solver=FILIPPOV, rtol=1e-10)
    branch = orbit_branch(field, motion, method=Shooting(1, rtol=1e-10, solver=FILIPPOV),
                          bounds=(0.19, 0.21), options=ContinuationOptions(points=1))
    point = branch.points[0]
    start, period = point.u[:-1], point.values["period"]

    def ends(state):
        return fc.simulate(system, period, initial=state, solver=FILIPPOV, rtol=1e-12,
                           outputs=2).states[-1]

    assert ends(start) == pytest.approx(start, abs=1e-8)
    columns = []
    for k in range(len(start)):
        away = np.zeros(len(start))
        away[k] = 1e-6
        columns.append((ends(start + away) - ends(start - away)) / 2e-6)
    known = np.linalg.eigvals(np.array(columns).T)
    known = known[np.argsort(-np.abs(known))]
    found = point.values["multipliers"]
    assert np.abs(found[0]) > 1e-3
    assert np.abs(found) == pytest.approx(np.abs(known), abs=2e-5)
    assert (np.abs(found) == 0.0).any()


def test_orbits_beyond_a_doubling_of_impacts():
    """Runs settle on the orbits of twice the period, whose two impacts differ."""
    system = impacting(amplitude=2.2)
    field = contact_field(system, ["drive.amplitude_y"])
    motion = periodic_motion(system, solver=STOPS, initial=[2.0, 0.0], rtol=1e-9)
    branch = orbit_branch(field, motion, method=Shooting(1, solver=STOPS), bounds=(2.0, 2.3),
                          direction=-1.0, options=ContinuationOptions(step=0.02))
    doubling = branch.of_kind("period doubling")[0]
    beyond = orbit_branch(field, doubling, bounds=(1.9, 2.3),
                          options=ContinuationOptions(step=0.02, points=8)).points[-1]
    assert beyond.values["period"] == pytest.approx(2.0 * doubling.values["period"], rel=1e-9)
    assert beyond.values["stable"]
    settled = periodic_motion(field.system(np.array([beyond.parameter])), solver=STOPS,
                              initial=[2.0, 0.0], rtol=1e-9)
    assert settled.periods == 2
    assert settled.states[:, 1].min() == pytest.approx(beyond.orbit(field, 4001).states[:, 1].min(),
                                                       rel=1e-4)


def test_orbits_without_events_have_their_multipliers():
    system = impacting()
    field = contact_field(system, ["drive.amplitude_y"])
    motion = periodic_motion(system, solver=STOPS, initial=[2.0, 0.0], rtol=1e-9)
    branch = orbit_branch(field, motion, method=Shooting(1, solver=STOPS), bounds=(1.1, 1.3),
                          options=ContinuationOptions(step=0.05, points=3))
    assert np.abs(branch.points[0].values["multipliers"]) == pytest.approx(
        np.full(2, np.exp(-DAMPING * 2.0 * np.pi / 0.8)), rel=1e-9)


@pytest.mark.parametrize("amplitude", [0.2, 0.3])
def test_symmetric_orbits_pass_borders_that_both_halves_meet(amplitude):
    """Both turning points begin or cease to stick at once, where the motion is continuous."""
    basis = fc.basis_from_matrices([[1.0]], [[100.0]], {"contact": [ROW], "B": ROW, "C": ROW},
                                   damping=[[1.0]])
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(10.0), friction=ConstantFriction(0.5),
        drive=fc.Drive(stiffness_x=100.0, amplitude_x=amplitude, frequency_hz=1.0))
    motion = periodic_motion(system, initial=[0.0, 0.0], solver=FILIPPOV)
    branch = orbit_branch(contact_field(system, {"drive.amplitude_x": None}), motion,
                          "drive.amplitude_x", bounds=(0.15, 0.4), both=True,
                          method=Shooting(1, solver=FILIPPOV))
    assert branch.status is BranchStatus.BOUND
    assert (branch.parameter.min(), branch.parameter.max()) == pytest.approx((0.15, 0.4))
    borders = [point for point in branch.special if isinstance(point, DiscontinuityPoint)]
    assert [point.kind for point in borders] == ["switching-sliding", "grazing-sliding"]
    assert all(point.persists for point in borders)
