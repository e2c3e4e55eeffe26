"""Contact phases against closed forms: restitution, momentum, contact times, bouncing to rest."""

import numpy as np
import pytest
from scipy.optimize import brentq
from systems import TURN

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    basis_from_matrices,
    simulate,
)
from fecontact.analysis import find_impacts, find_rests
from fecontact.integrate import SetValued
from fecontact.laws import (
    BilateralPolynomial,
    ExponentialFriction,
    LinearContact,
    PowerContact,
    RestitutionContact,
    RoughSurface,
)

MASS, C, R, V0 = 0.1, 1e6, 1e-4, 0.05
DEEPEST = (3.0 * MASS * V0**2 * R / C) ** (1.0 / 3.0)
HERTZ = (1.25 * MASS * V0**2 / 1e9) ** 0.4


def ball(normal, nodes=1, weight=0.0, **parts):
    """A mass that moves up and down, on one contact node or several side by side."""
    rows = np.zeros((nodes, 3, 1))
    rows[:, 1] = 1.0
    basis = basis_from_matrices([[MASS]], [[0.0]], {"contact": rows, "B": rows[0],
                                                    "C": rows[0]})
    return ContactSystem(basis, normal=normal, load=Load(weight), **parts)


def state(height, rate):
    return np.sqrt(MASS) * np.array([height, rate])


@pytest.mark.parametrize(("b", "restitution"), [
    (0.02, 0.9569384399), (0.05, 0.8969657584), (0.2, 0.6653065459), (0.5, 0.4095613395)])
@pytest.mark.parametrize("outputs", [60, 400])
def test_restitution_of_uniform_roughness(b, restitution, outputs):
    system = ball(RoughSurface(C, R, b * DEEPEST / V0 * C))
    begin = 0.37 * DEEPEST / V0
    run = simulate(system, 6.0 * DEEPEST / V0, initial=state(V0 * begin, -V0), outputs=outputs,
                   rtol=1e-8)
    found = find_impacts(run)
    assert len(found) == 1
    error = 1e-3 if outputs == 60 else 1e-5
    assert found.touch_down == pytest.approx([begin], rel=error)
    assert found.impact_velocity == pytest.approx([V0], rel=error)
    assert found.restitution == pytest.approx([restitution], rel=error)
    assert found.impulse == pytest.approx([MASS * V0 * (1.0 + restitution)], rel=error)
    taken = 0.5 * MASS * V0**2 * (1.0 - restitution**2)
    assert found.energy_taken == pytest.approx([taken], rel=20.0 * error)
    assert found.energy_taken == pytest.approx([run.energies.contact_damping[-1]], rel=20.0 * error)


@pytest.mark.parametrize(("law", "product", "deepest", "peak"), [
    (LinearContact(C), np.pi, V0 * np.sqrt(MASS / C), V0 * np.sqrt(MASS * C)),
    (PowerContact(1e9, 1.5), 2.9432751843, HERTZ, 1e9 * HERTZ**1.5),
    (RoughSurface(C, R, 0.0), 2.8043642107, DEEPEST, 0.5 * C * DEEPEST**2 / R)])
def test_duration_and_peak_of_elastic_impacts(law, product, deepest, peak):
    run = simulate(ball(law), 0.01, initial=state(1e-5, -V0), outputs=801, rtol=1e-8)
    found = find_impacts(run, 0)
    assert found.duration == pytest.approx([product * deepest / V0], rel=1e-5)
    assert found.restitution == pytest.approx([1.0], rel=1e-5)
    assert found.impulse == pytest.approx([2.0 * MASS * V0], rel=1e-5)
    assert found.energy_taken == pytest.approx([0.0], abs=1e-5 * 0.5 * MASS * V0**2)
    assert found.peak_force == pytest.approx([peak], rel=1e-3)


@pytest.mark.parametrize(("product", "restitution"), [
    (0.1, 0.9374755799), (0.5, 0.7484349316), (2.0, 0.4107196861)])
def test_restitution_of_hunt_crossley_contact(product, restitution):
    """Damping ends with the penetration, from where the node flies on."""
    system = ball(PowerContact(1e9, 1.5, damping_factor=product / V0))
    run = simulate(system, 0.002, initial=state(1e-5, -V0), outputs=401, rtol=1e-8)
    found = find_impacts(run)
    assert found.restitution == pytest.approx([restitution], rel=1e-4)
    taken = 0.5 * MASS * V0**2 * (1.0 - restitution**2)
    assert found.energy_taken == pytest.approx([taken], rel=2e-4)


@pytest.mark.parametrize(("model", "e", "product"), [
    ("exact", 0.9, 0.16648195), ("exact", 0.5, 1.43275053),
    ("hunt-crossley", 0.9, 0.15), ("hunt-crossley", 0.5, 0.75),
    ("lankarani-nikravesh", 0.9, 0.1425), ("lankarani-nikravesh", 0.5, 0.5625),
    ("flores", 0.9, 0.17777777778), ("flores", 0.5, 1.6)])
def test_impact_with_each_damping_model(model, e, product):
    """The factor is the published one; the impact has the restitution that belongs to it."""
    law = RestitutionContact(1e9, e, V0, damping_model=model)
    assert law.damping_factor == pytest.approx(product / V0, rel=1e-7)
    got = brentq(lambda e: product * (1.0 + e) - np.log1p(product) + np.log1p(-product * e),
                 0.0, min(1.0, (1.0 - 1e-9) / product), xtol=1e-12)
    if model == "exact":
        assert got == pytest.approx(e, rel=1e-7)
    else:
        assert abs(got - e) > 5e-3
    run = simulate(ball(law), 0.002, initial=state(1e-5, -V0), outputs=801, rtol=1e-8)
    found = find_impacts(run)
    assert found.restitution == pytest.approx([got], rel=1e-4)
    assert found.impulse == pytest.approx([MASS * V0 * (1.0 + got)], rel=1e-4)
    assert found.energy_taken == pytest.approx([0.5 * MASS * V0**2 * (1.0 - got**2)], rel=1e-3)


ZETA, RESTITUTION, HEIGHT, WEIGHT = 0.2, 0.5717400276, 1e-3, 10.0


def bouncing(nodes=1, outputs=40001):
    """A ball that falls on a hard damped stop."""
    hard = 1e9
    system = ball(LinearContact(hard, 2.0 * ZETA * np.sqrt(hard * MASS)), nodes, WEIGHT * MASS)
    return simulate(system, 0.08, initial=state(HEIGHT, 0.0), outputs=outputs)


def test_bouncing_ball_comes_to_rest():
    """Flights last 2 v e^k / g, so that their sum ends at t0 (1 + e) / (1 - e)."""
    run = bouncing()
    found = find_impacts(run)
    fall = np.sqrt(2.0 * HEIGHT / WEIGHT)
    # The weight matters in contact as the impacts become slow: by 0.4 % in the fourth.
    speeds = WEIGHT * fall * RESTITUTION ** np.arange(5)
    assert found.touch_down[0] == pytest.approx(fall, rel=1e-6)
    assert found.impact_velocity[:4] == pytest.approx(speeds[:4], rel=5e-3)
    assert found.restitution[:3] == pytest.approx(RESTITUTION, rel=3e-3)
    flights = found.touch_down[1:4] - found.lift_off[:3]
    assert flights == pytest.approx(2.0 / WEIGHT * speeds[1:4], rel=6e-3)
    rests = find_rests(run, longer_than=0.01)
    assert len(rests) == 1
    assert rests[0].at_rest == pytest.approx(
        fall * (1.0 + RESTITUTION) / (1.0 - RESTITUTION), rel=1e-3)
    assert rests[0].touch_down <= rests[0].at_rest
    assert np.isnan(rests[0].lift_off)
    assert rests[0].impacts == len(found)
    assert find_rests(run, longer_than=0.08) == []


def test_face_of_several_nodes_is_one_impact():
    one, many = find_impacts(bouncing()), find_impacts(bouncing(5))
    for name in ("touch_down", "impact_velocity", "impulse", "peak_force"):
        assert getattr(many, name)[:4] == pytest.approx(getattr(one, name)[:4], rel=1e-4)
    node = find_impacts(bouncing(5), 3)
    assert node.impulse[:4] == pytest.approx(0.2 * one.impulse[:4], rel=1e-4)
    group = find_impacts(bouncing(5), "contact")
    assert group.peak_force == pytest.approx(many.peak_force)


def test_phases_at_the_ends_of_the_run_are_not_known_whole():
    system = ball(LinearContact(C))
    run = simulate(system, 3e-3, initial=state(-1e-5, 0.0), outputs=301)
    found = find_impacts(run)
    assert len(found) == 1
    assert np.isnan([found.touch_down[0], found.impact_velocity[0], found.restitution[0]]).all()
    # From the deepest point on: a quarter of the oscillation.
    assert found.lift_off[0] == pytest.approx(0.5 * np.pi * np.sqrt(MASS / C), rel=1e-5)
    assert found.impulse[0] == pytest.approx(1e-5 * np.sqrt(C * MASS), rel=1e-4)
    short = simulate(system, 3e-4, initial=state(-1e-5, 0.0), outputs=31)
    assert np.isnan([find_impacts(short).lift_off[0], find_impacts(short).separation_velocity[0]]
                    ).all()
    apart = simulate(system, 1e-3, initial=state(1e-3, 0.0), outputs=11)
    assert len(find_impacts(apart)) == 0
    assert find_rests(apart, longer_than=1e-4) == []


def test_flights_shorter_than_asked_for_are_passed_over():
    run = bouncing()
    found = find_impacts(run)
    flights = found.touch_down[1:] - found.lift_off[:-1]
    limit = 0.5 * (flights[2] + flights[3])
    assert limit < flights[:3].min()
    joined = find_impacts(run, shortest_flight=limit)
    assert len(joined) == 4
    assert joined.touch_down == pytest.approx(found.touch_down[:4])
    assert np.isnan(joined.restitution[3])
    assert joined.impulse.sum() == pytest.approx(found.impulse.sum())
    assert joined.impulse[3] == pytest.approx(found.impulse[3:].sum())
    assert joined.energy_taken[3] == pytest.approx(found.energy_taken[3:].sum())


@pytest.mark.parametrize("outputs", [101, 301, 1001])
def test_contacts_between_outputs_are_not_lost_silently(outputs):
    with pytest.raises(AnalysisError, match="began and ended between the output times"):
        find_impacts(bouncing(outputs=outputs))


def test_nodes_that_do_not_exist():
    with pytest.raises(InputError, match="no interface 'sole'"):
        find_impacts(bouncing(outputs=301), "sole")
    with pytest.raises(InputError, match="Contact node 1 does not exist"):
        find_impacts(bouncing(outputs=301), 1)


def test_systems_without_contact_have_no_impacts():
    linear = ContactSystem(basis_from_matrices([[1.0]], [[1.0]], {"B": [[0.0], [1.0], [0.0]]}))
    run = simulate(linear, 1.0, initial=[1e-3, 0.0], outputs=11)
    with pytest.raises(InputError, match="has no contact nodes"):
        find_impacts(run)
    with pytest.raises(InputError, match="has no contact nodes"):
        find_rests(run, longer_than=0.1)


def test_contacts_that_never_open_have_no_impacts():
    run = simulate(ball(BilateralPolynomial(1e5, 1e9)), 0.05, initial=state(1e-4, 0.0), outputs=101)
    with pytest.raises(InputError, match="contact node 0 presses and pulls"):
        find_impacts(run)


@pytest.mark.parametrize("nodes", [[0], (0,), 1.5, True])
def test_nodes_that_are_none(nodes):
    run = simulate(ball(LinearContact(1e5)), 0.01, initial=state(1e-2, 0.0), outputs=11)
    with pytest.raises(InputError, match="must be the number of a contact node"):
        find_impacts(run, nodes)


def test_a_run_with_rigid_stops_before_its_first_impact_is_refused():
    run = simulate(ball(LinearContact(1e5)), 0.01, initial=state(1e-2, 0.0), outputs=11,
                   solver=SetValued(restitution=0.5))
    with pytest.raises(InputError, match="rigid stops take no time"):
        find_impacts(run)


def test_set_valued_friction_has_impacts_and_rigid_stops_have_none():
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(MASS * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "B": rows})
    law = LinearContact(C, 2.0 * 0.2 * np.sqrt(C * MASS))
    q = np.linalg.solve(basis.T[2, :2], [0.0, 1e-4])
    system = ContactSystem(basis, normal=law, friction=ExponentialFriction(0.3, 0.3, 1000.0))
    run = simulate(system, 0.006, initial=np.concatenate([q, -V0 / 1e-4 * q]), outputs=601,
                   solver=SetValued())
    assert find_impacts(run).restitution == pytest.approx([RESTITUTION], rel=1e-3)
    assert find_impacts(run).impact_velocity == pytest.approx([V0], rel=1e-3)
    frictionless = ball(law, weight=1.0)
    rigid = simulate(frictionless, 0.05, initial=state(1e-4, 0.0), outputs=601,
                     solver=SetValued(restitution=0.5))
    with pytest.raises(InputError, match="rigid stops take no time"):
        find_impacts(rigid)


@pytest.mark.parametrize("outputs", [200, 2000])
def test_impact_on_ground_that_moves_up(outputs):
    """A mass in uniform flight above a wave that passes below: the root of the two heights."""
    height, wave, length, speed = 2e-3, 1e-3, 0.1, 2.0
    system = ball(LinearContact(C), ground=Ground(speed=speed, amplitude=wave, wavelength=length))
    run = simulate(system, 0.05, initial=state(height, -V0), outputs=outputs, rtol=1e-8)
    turn = 2.0 * np.pi * speed / length

    def gap(t):
        return height - V0 * t + wave * np.sin(turn * t)

    times = np.linspace(0.0, 0.05, 5001)
    first = np.flatnonzero(gap(times) < 0.0)[0]
    expected = brentq(gap, times[first - 1], times[first])
    found = find_impacts(run)
    error = 1e-5 if outputs == 2000 else 1e-3
    assert found.touch_down[0] == pytest.approx(expected, rel=error)
    assert found.impact_velocity[0] == pytest.approx(
        V0 - wave * turn * np.cos(turn * expected), rel=error)


def test_impacts_per_period_of_a_driven_mass():
    """The rigid mass of the impact oscillator: one impact a period at 64.32 rad/s."""
    w = 64.32
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = basis_from_matrices([[0.092]], [[0.0]], {"contact": rows[None], "B": rows})
    system = ContactSystem(basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0), drive=Drive(
        stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3, frequency_hz=w / TURN))
    period = 2.0 * np.pi / w
    run = simulate(system, 60.0 * period, outputs=60 * 400 + 1)
    found = find_impacts(run)
    counts = found.per_period(period, 40.0 * period, 60.0 * period)
    assert len(counts) == 20
    assert counts.sum() == np.count_nonzero(found.touch_down >= 40.0 * period)
    # Momentum from one flight to another: impulses of the stop against those of drive and dashpot.
    a, b = (np.flatnonzero((run.time > t * period) & (run.normal_force[:, 0] == 0.0))[0]
            for t in (40.0, 59.0))
    between = found[(found.touch_down > run.time[a]) & (found.touch_down < run.time[b])]
    y, rate = run.displacement("B")[:, 1], run.velocity("B")[:, 1]
    pull = 99.085 * (0.47e-3 * np.sin(w * run.time) - y) - 0.02046 * rate
    pulled = np.trapezoid(pull[a : b + 1], run.time[a : b + 1])
    assert between.impulse.sum() == pytest.approx(0.092 * (rate[b] - rate[a]) - pulled, rel=1e-4)
    assert (between.restitution < 1.0).all()


def test_chatter_of_the_pendulum_comes_to_rest_once_a_period():
    """The impact oscillator of section 3 at 9.845 rad/s, with its rigid and bending mode."""
    from systems import impact_oscillator

    period = 2.0 * np.pi / 9.845
    run = simulate(impact_oscillator(w=9.845), 10.0 * period, initial=np.zeros(4),
                   outputs=10 * 12000 + 1)
    late = run.between(5.0 * period)
    rests = find_rests(late)
    # The last rest may have been cut off by the end of the run.
    assert len(rests) in (5, 6)
    assert np.diff([rest.lift_off for rest in rests[:5]]) == pytest.approx(period, rel=0.04)
    for rest in rests[1:5]:
        assert rest.impacts >= 5
        assert rest.touch_down < rest.at_rest < rest.lift_off
        # The static force of drive and spring holds it down meanwhile.
        inside = (late.time > rest.at_rest) & (late.time < rest.lift_off)
        assert (late.normal_force[inside, 0] > 0.0).all()
        assert np.abs(late.velocity(0)[inside, 1]).max() < 0.15 * np.nanmax(
            find_impacts(late).impact_velocity)
