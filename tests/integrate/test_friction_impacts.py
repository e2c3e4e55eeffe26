"""Rigid stops with friction: impacts, sliding and sticking, against closed forms."""

import numpy as np
import pytest
from set_valued_runs import integrate_set_valued
from systems import TURN

from fecontact import (
    ContactSystem,
    Ground,
    InputError,
    Load,
    PointLoad,
    Status,
    Trajectory,
    basis_from_matrices,
)
from fecontact.integrate import ContactEvents, SetValued
from fecontact.laws import (
    Constant,
    ConstantFriction,
    Harmonic,
    HyperbolicFriction,
    LinearContact,
    RoughSurface,
)
from fecontact.system.powers import CONTACT_DAMPING

SPEEDS = slice(3, 6)


def body(places, friction, mass=1.0, inertia=1.0, **parts):
    """A rigid body that touches the ground at places (a, h): beside and below its centre."""
    rows = [[[1.0, 0.0, h], [0.0, 1.0, a], [0.0, 0.0, 1.0]] for a, h in places]
    basis = basis_from_matrices(np.diag([mass, mass, inertia]), np.zeros((3, 3)), {
        "contact": rows, "C": np.eye(3)})
    return ContactSystem(basis, **{"normal": RoughSurface(1e5, 1e-4),
                                   "friction": ConstantFriction(friction), **parts})


def go(system, place, speed, times, **options):
    """A run from place and speed [x, y, phi] of the centre, and these at all times."""
    C = system.basis.T[1]
    state = np.concatenate([np.linalg.solve(C, place), np.linalg.solve(C, speed)])
    run = integrate_set_valued(system, state, np.asarray(times, dtype=float),
                               **{"rtol": 1e-10, **options})
    m = system.basis.modes
    return run, np.hstack([run.states[:, :m] @ C.T, run.states[:, m:] @ C.T])


def imbalance(system, run):
    m = system.basis.modes
    return Trajectory(system, run.time, run.states[:, :m], run.states[:, m:],
                      run.work).energies.imbalance


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize(("along", "mu", "e"), [(2.0, 0.3, 0.5), (-2.0, 0.3, 0.0), (0.4, 0.3, 0.5),
                                               (-0.3, 0.5, 1.0)])
def test_oblique_impact_of_a_particle(law, along, mu, e):
    """The particle keeps slipping, or sticks where Coulomb's impulse would reverse it."""
    system = body([(0.0, 0.0)], mu, mass=2.0)
    run, motion = go(system, [0.0, 0.1, 0.0], [along, -1.0, 0.0], [0.0, 0.2], restitution=e,
                     impact_law=law)
    after = np.sign(along) * max(abs(along) - mu * (1.0 + e), 0.0)
    assert run.status is Status.FINISHED
    assert motion[-1, SPEEDS] == pytest.approx([after, e, 0.0], abs=1e-12)
    assert motion[-1, 0] == pytest.approx(0.1 * along + 0.1 * after, abs=1e-12)
    assert run.node_friction_work[-1, 0] == pytest.approx(along**2 - after**2, rel=1e-11)
    assert run.work[-1, CONTACT_DAMPING] == pytest.approx(1.0 - e**2, abs=1e-11)
    assert imbalance(system, run) < 1e-12


@pytest.mark.parametrize("gap", [0.0, 0.1])
@pytest.mark.parametrize(("along", "mu", "e"), [(2.0, 0.3, 0.5), (0.4, 0.3, 0.0), (1.0, 0.0, 1.0)])
def test_an_impact_at_the_start_is_an_event_like_others(along, mu, e, gap):
    system = body([(0.0, 0.0)], mu, mass=2.0, gap=gap)
    run, motion = go(system, [0.0, -gap, 0.0], [along, -1.0, 0.0], [0.0, 0.2], restitution=e,
                     events=[ContactEvents()])
    after = max(along - mu * (1.0 + e), 0.0)
    assert run.status is Status.FINISHED
    assert motion[0, SPEEDS] == pytest.approx([after, e, 0.0], abs=1e-12)
    assert (run.statistics["events"], run.statistics["impacts"]) == (1, 1)
    assert run.events.only("touch-down").time == pytest.approx([0.0], abs=0.0)
    for row in (0, -1):
        assert run.node_friction_work[row, 0] == pytest.approx(along**2 - after**2, rel=1e-11)
        assert run.work[row, CONTACT_DAMPING] == pytest.approx(1.0 - e**2, abs=1e-11)
    assert imbalance(system, run) < 1e-12
    resting, _ = go(system, [0.0, -gap, 0.0], [along, 0.0, 0.0], [0.0, 0.2], restitution=e)
    assert resting.statistics["impacts"] == 0


def two_masses(k, nodes=2, **parts):
    """Masses of 1 kg above one another, joined by a spring, of which so many touch the ground."""
    rows = np.zeros((2, 3, 2))
    rows[0, 1, 0] = rows[1, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), [[k, -k], [-k, k]], {
        "contact": rows[:nodes], "C": rows[0], "D": rows[1]})
    return ContactSystem(basis, **{"normal": RoughSurface(1e5, 1e-4),
                                   "friction": ConstantFriction(0.0), **parts})


def thrown(system, speeds, times, **options):
    """A run of two masses that start at the ground, and their speeds at all times."""
    rows = system.basis.T[[1, -1], 1]
    state = np.concatenate([np.zeros(2), np.linalg.solve(rows, speeds)])
    run = integrate_set_valued(system, state, np.asarray(times), events=[ContactEvents()],
                               **{"rtol": 1e-10, **options})
    return run, run.states[:, 2:] @ rows.T


@pytest.mark.parametrize(("speed", "contact"), [(-1.0, True), (0.5, False)])
@pytest.mark.parametrize("k", [1.3, 4.4e2, 1e5])
def test_a_spring_that_is_about_to_press_closes_a_stop(k, speed, contact):
    """Behind the impact there is neither force nor speed: the spring's rate decides."""
    w = np.sqrt(k)
    times = np.linspace(0.0, 3.0 / w, 4)
    run, speeds = thrown(two_masses(k, 1), [-1.0, speed], times, restitution=0.0)
    assert run.status is Status.FINISHED
    assert run.statistics["events"] < 10
    assert run.statistics["impacts"] == 1
    assert run.work[:, CONTACT_DAMPING] == pytest.approx(np.full(4, 0.5), abs=1e-9)
    if contact:
        assert speeds == pytest.approx(
            np.stack([np.zeros(4), speed * np.cos(w * times)], axis=1), abs=1e-6)
    else:
        turn = np.cos(np.sqrt(2.0) * w * times)
        assert speeds == pytest.approx(
            0.5 * speed * np.stack([1.0 - turn, 1.0 + turn], axis=1), abs=1e-6)


def test_a_stop_lets_go_where_the_spring_pulls():
    run, _ = thrown(two_masses(100.0, 1), [-1.0, -1.0], [0.0, 0.4], restitution=0.0)
    assert run.events.only("lift-off").time[-1] == pytest.approx(0.1 * np.pi, abs=1e-6)


@pytest.mark.parametrize("start", [0.0, 0.1])
@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("e", [(0.8, 0.3), {"contact": (0.8, 0.3)}])
def test_every_stop_has_its_own_restitution(e, law, start):
    system = two_masses(0.0, gap=start)
    run, speeds = thrown(system, [-1.0, -2.0], [0.0, 0.2], restitution=SetValued(e).restitution,
                         impact_law=law)
    assert speeds[-1] == pytest.approx([0.8, 0.6], abs=1e-12)
    assert run.work[-1, CONTACT_DAMPING] == pytest.approx(
        0.5 * (1.0 - 0.64) + 2.0 * (1.0 - 0.09), abs=1e-11)


def test_restitution_along_the_ground_of_each_node():
    rows = np.zeros((2, 3, 4))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 2] = rows[1, 1, 3] = 1.0
    basis = basis_from_matrices(np.eye(4), np.zeros((4, 4)), {"contact": rows, "C": rows[0]})
    system = ContactSystem(basis, normal=RoughSurface(1e5, 1e-4), friction=ConstantFriction(5.0))
    shapes = basis.T[2:4, :2].reshape(4, 4)
    state = np.concatenate([np.zeros(4), np.linalg.solve(shapes, [0.5, -1.0, 0.5, -1.0])])
    run = integrate_set_valued(system, state, np.array([0.0, 0.1]), restitution=(1.0, 0.5),
                               tangential_restitution=(1.0, 0.2))
    assert shapes @ run.states[-1, 4:] == pytest.approx([-0.5, 1.0, -0.1, 0.5], abs=1e-12)


@pytest.mark.parametrize(("given", "message"), [
    ({"stop": 0.5}, "names the interface 'stop', but the interfaces are: 'contact'"),
    ((0.5, 0.5, 0.5), "restitution has 3 values; give one number, or one for each of the 2"),
    ({"contact": (0.5, 0.5, 0.5)}, r"restitution\.contact has 3 values"),
])
def test_restitutions_that_no_stop_has_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        thrown(two_masses(1.0), [0.0, 0.0], [0.0, 0.1], restitution=given)


def test_nodes_that_move_along_the_ground_together_need_one_restitution_there():
    system = body([(-0.5, 0.0), (0.5, 0.0)], 0.3)
    with pytest.raises(InputError, match="must be equal, for both move along the ground"):
        go(system, np.zeros(3), np.zeros(3), [0.0, 0.1], restitution=0.5,
           tangential_restitution=(0.1, 0.2))


def test_bouncing_particle_slides_on_when_it_no_longer_bounces():
    """Every impact takes mu (1 + e) v; over all, friction takes mu g t of the speed."""
    system = body([(0.0, 0.0)], 0.1, load=Load(10.0))
    e, times = 0.5, np.linspace(0.0, 4.0, 801)
    run, motion = go(system, [0.0, 1.0, 0.0], [3.0, 0.0, 0.0], times, restitution=e)
    moment, speed, along = np.sqrt(0.2), 10.0 * np.sqrt(0.2), 3.0
    rates, x, last = np.full(len(times), 3.0), 3.0 * times, moment
    for _ in range(60):
        lost = 0.1 * (1.0 + e) * speed
        late = times > moment
        along -= lost
        rates[late] -= lost
        x[late] -= lost * (times[late] - moment)
        speed *= e
        moment, last = moment + 0.2 * speed, moment
    since = np.clip(times - last, 0.0, along)
    assert last + along == pytest.approx(3.0, rel=1e-12)
    late = times > last
    rates[late] -= since[late]
    x[late] -= 0.5 * since[late] ** 2 + since[late] * (times[late] - last - since[late])
    assert motion[:, 0] == pytest.approx(x, abs=1e-6)
    away = np.abs(times - last) > 0.01
    assert motion[away, 3] == pytest.approx(rates[away], abs=1e-6)
    assert run.friction_force[(times > 2.0) & (times < 2.99), 0] == pytest.approx(1.0, rel=1e-9)
    assert run.friction_force[-1, 0] == pytest.approx(0.0, abs=1e-9)
    assert imbalance(system, run) < 1e-9


def test_super_ball():
    """With both coefficients one, spin and speed change so that the slip velocity turns round."""
    system = body([(0.0, 0.5)], 5.0, inertia=0.1)
    run, motion = go(system, [0.0, 0.1, 0.0], [0.7, -1.0, 3.0], [0.0, 0.2], restitution=1.0,
                     tangential_restitution=1.0)
    slip = 0.7 + 0.5 * 3.0
    impulse = 2.0 * slip / (1.0 + 0.25 / 0.1)
    assert motion[-1, SPEEDS] == pytest.approx(
        [0.7 - impulse, 1.0, 3.0 - 0.5 * impulse / 0.1], abs=1e-11)
    assert run.states[-1, SPEEDS] @ run.states[-1, SPEEDS] == pytest.approx(
        0.7**2 + 1.0 + 0.1 * 9.0, rel=1e-12)
    assert run.status is Status.FINISHED


def test_rocking_block():
    """Housner: each impact on the other corner leaves 1 - 3/2 sin(a)^2 of the angular velocity."""
    b, h = 0.5, 1.0
    around = 4.0 / 3.0 * (b * b + h * h)
    system = body([(-b, h), (b, h)], 1.0, inertia=(b * b + h * h) / 3.0, load=Load(10.0))
    pull, tilt, ratio = 10.0 * b / around, 0.02, 1.0 - 1.5 * b * b / (b * b + h * h)
    # About the left corner until the first impact, then half-swings about either.
    first = np.sqrt(2.0 * tilt / pull)
    speeds = pull * first * ratio ** np.arange(1, 4)
    moments = first + np.concatenate([[0.0], np.cumsum(2.0 * speeds / pull)])
    times = np.concatenate([[0.0, 0.5 * first], 0.5 * (moments[1:] + moments[:-1])])
    run, motion = go(system, [-h * tilt, b * tilt, tilt], np.zeros(3), times, restitution=0.0)
    assert run.status is Status.FINISHED
    assert motion[1, 5] == pytest.approx(-0.5 * pull * first, rel=1e-10)
    # In the middle of a swing the block is turned furthest and at rest.
    furthest = 0.5 * speeds**2 / pull * np.array([-1.0, 1.0, -1.0])
    assert motion[2:, 2] == pytest.approx(furthest, rel=1e-9)
    assert motion[2:, 5] == pytest.approx(0.0, abs=1e-9)
    # The pivot stays where it is, held by friction.
    assert motion[2:, 0] + h * motion[2:, 2] == pytest.approx(0.0, abs=1e-11)
    assert run.friction_force[2].sum() == pytest.approx(h * pull, rel=1e-9)
    assert run.normal_force[2] == pytest.approx([0.0, 10.0 - b * pull], abs=1e-9)
    assert imbalance(system, run) < 1e-11


def test_flat_block_comes_to_rest_on_both_corners():
    """With Housner's ratio below zero the corner that was the pivot is pressed too."""
    b, h = 1.0, 0.5
    system = body([(-b, h), (b, h)], 1.0, inertia=(b * b + h * h) / 3.0, load=Load(10.0))
    run, motion = go(system, [-h * 0.02, b * 0.02, 0.02], np.zeros(3), [0.0, 0.2, 0.5],
                     restitution=0.0)
    assert motion[-1] == pytest.approx(0.0, abs=1e-12)
    assert run.normal_force[-1] == pytest.approx(5.0, rel=1e-10)
    assert run.statistics["impacts"] == 1


def rod(mu, side=1.0, **parts):
    """A slender rod on its end at the angle at which it jams first, tan^2 = 4."""
    cos, sin = side * np.sqrt(0.2), np.sqrt(0.8)
    return body([(cos, sin)], mu, inertia=1.0 / 3.0, load=Load(10.0), **parts)


@pytest.mark.parametrize(("mu", "side"), [(0.5, 1.0), (1.3, 1.0), (1.3, -1.0), (3.0, -1.0)])
def test_sliding_rod(mu, side):
    run, motion = go(rod(mu, side), np.zeros(3), [1.0, 0.0, 0.0], [0.0, 5e-4], restitution=0.0)
    cos, sin = side * np.sqrt(0.2), np.sqrt(0.8)
    force = 10.0 / (1.0 + 3.0 * cos**2 - mu * 3.0 * sin * cos)
    assert run.status is Status.FINISHED
    assert run.normal_force[:, 0] == pytest.approx(force, rel=1e-9)
    assert run.friction_force[:, 0] == pytest.approx(mu * force, rel=1e-9)
    assert motion[-1, SPEEDS] == pytest.approx(
        [1.0 - 5e-4 * mu * force, 5e-4 * (force - 10.0),
         1.5e-3 * force * (cos - mu * sin)], rel=1e-9)


@pytest.mark.parametrize("upwards", [0.0, 15.0])
def test_painleve_paradox(upwards):
    """Above mu = 4/3 the sliding rod has no acceleration, or two under a force that lifts it."""
    lift = PointLoad("C", "y", signal=Constant(upwards))
    for mu, status in ((1.33, Status.FINISHED), (1.34, Status.PARADOX)):
        system = rod(mu)
        system = ContactSystem(system.basis, normal=system.normal, friction=system.friction,
                               load=Load(10.0, (lift,)))
        run, _ = go(system, np.zeros(3), [1.0, 0.0, 0.0], [0.0, 1e-4], restitution=0.0)
        assert run.status is status
        assert "Painleve" in Status.PARADOX.value


@pytest.mark.parametrize(("static", "period", "largest"), [
    (None, 12.0010312948, 1.1339446764),
    (1.0, 5.0 + 2.0 * np.pi - 2.0 * np.arctan(2.5), 1.038516481)])
def test_stick_slip_on_a_rigid_belt(static, period, largest):
    """Leine's oscillator, and the belt with a jump from static to kinetic friction."""
    law = HyperbolicFriction(1.0, 0.0, 1.0 / 3.0) if static is None else ConstantFriction(0.5)
    row = np.eye(3)[:, :2]
    basis = basis_from_matrices(np.eye(2), np.diag([1.0, 0.0]), {"contact": row[None], "C": row})
    system = ContactSystem(basis, normal=RoughSurface(1e5, 1e-4), friction=law, load=Load(1.0),
                           ground=Ground(speed=0.2))
    C = basis.T[1, :2]
    state = np.concatenate([np.linalg.solve(C, [0.5, 0.0]), np.linalg.solve(C, [0.2, 0.0])])
    times = np.linspace(0.0, 40.0, 8001)
    run = integrate_set_valued(system, state, times, rtol=1e-11, static_coefficient=static,
                               restitution=0.0)
    x, rate = run.states[:, :2] @ C[0], run.states[:, 2:] @ C[0]
    resting = np.abs(rate - 0.2) < 1e-9
    passing = np.flatnonzero(resting[:-1] & resting[1:] & (x[:-1] < 0.5) & (x[1:] >= 0.5))
    found = np.diff(times[passing] + (0.5 - x[passing]) / 0.2)
    assert len(found) >= 2
    assert found == pytest.approx(period, rel=1e-9)
    assert x.max() == pytest.approx(largest, rel=1e-5)
    assert imbalance(system, run) < 1e-9


def test_slip_before_lift_off():
    """Pushed sideways while its weight is lifted, a mass slips at F = 4 N and lifts off at zero."""
    lift = PointLoad("C", "y", signal=Harmonic(20.0, frequency_hz=1.0 / TURN))
    system = body([(0.0, 0.0)], 0.5, load=Load(10.0, (
        lift, PointLoad("C", "x", signal=Constant(2.0)))))
    slips, lifts = np.arcsin(0.3), np.pi / 6.0
    times = np.array([0.0, 0.2, 0.4, lifts, 0.7])
    run, motion = go(system, np.zeros(3), np.zeros(3), times, restitution=0.3,
                     events=(ContactEvents(),))
    assert run.events.kind == ("slip", "lift-off")
    assert run.events.time == pytest.approx([slips, lifts], abs=1e-11)
    assert run.friction_force[:2, 0] == pytest.approx(2.0, rel=1e-12)
    assert run.normal_force[:3, 0] == pytest.approx(10.0 - 20.0 * np.sin(times[:3]), rel=1e-9)
    assert motion[1] == pytest.approx(0.0, abs=1e-14)
    # x'' = 2 - (10 - 20 sin t) / 2 until it lifts off, then 2.
    since = times[2:] - slips
    held = np.minimum(times[2:], lifts)
    speed = -3.0 * (held - slips) - 10.0 * (np.cos(held) - np.cos(slips)) + 2.0 * (
        times[2:] - held)
    assert (since > 0.0).all()
    assert motion[2:, 3] == pytest.approx(speed, abs=1e-10)
    assert imbalance(system, run) < 1e-10


def random_impact(rng, **options):
    """Kinetic energies before and after two nodes of a random system strike at once."""
    m = int(rng.integers(4, 7))
    rows = rng.normal(size=(2, 3, m))
    speed = rng.normal(size=m)
    rows[:, 1] *= -np.sign(rows[:, 1] @ speed)[:, None]
    basis = basis_from_matrices(np.eye(m), np.zeros((m, m)), {"contact": rows})
    system = ContactSystem(basis, normal=RoughSurface((1e5, 1e5), 1e-4),
                           friction=ConstantFriction(rng.uniform(0.0, 2.0)))
    T = basis.T[2:, :2].reshape(4, m)
    # The modes are any basis of the same space.
    turn = np.linalg.lstsq(T, rows[:, :2].reshape(4, m) @ speed, rcond=None)[0]
    state = np.concatenate([np.zeros(m), turn])
    run = integrate_set_valued(system, state, np.array([0.0, 1e-9]), **options)
    return 0.5 * turn @ turn, 0.5 * run.states[0, m:] @ run.states[0, m:], run


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_impacts_never_gain_energy(law):
    """Poisson's law, and Newton's with equal coefficients; two impacts at once."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        e = rng.uniform(0.0, 1.0)
        before, after, run = random_impact(rng, restitution=e, impact_law=law,
                                           tangential_restitution=e if law == "newton" else 0.0)
        assert after <= before * (1.0 + 1e-12)
        assert run.status in (Status.FINISHED, Status.PARADOX)


def test_newtons_law_without_tangential_restitution_says_when_it_gains_energy():
    rng = np.random.default_rng(8)
    gained = 0
    for _ in range(60):
        before, after, run = random_impact(rng, restitution=0.9)
        if run.status is not Status.PARADOX:
            assert (run.status is Status.IMPACT_GAINED) == (after > before * (1.0 + 1e-9))
        gained += after > before * (1.0 + 1e-9)
    assert gained > 5
    assert "impact_law = 'poisson'" in Status.IMPACT_GAINED.value


@pytest.mark.parametrize(("friction", "speed"), [(0.0, 0.0), (0.3, 0.0), (0.3, 0.5)])
def test_energy_of_bouncing_on_waves(friction, speed):
    """With e = 1 and no friction no energy is lost, whatever the slope where it strikes."""
    system = body([(0.0, 0.0)], friction, load=Load(10.0), ground=Ground(
        amplitude=0.05, wavelength=1.0, speed=speed))
    run, motion = go(system, [0.13, 0.3, 0.0], [0.2, 0.0, 0.0], np.linspace(0.0, 5.0, 501),
                     restitution=1.0, impact_law="poisson")
    assert run.status is Status.FINISHED
    assert run.statistics["impacts"] >= 5
    assert imbalance(system, run) < 1e-9
    energy = 0.5 * (motion[:, SPEEDS] ** 2).sum(axis=1) + 10.0 * motion[:, 1]
    assert np.ptp(motion[:, 3]) > 0.1
    if friction == 0.0:
        assert energy == pytest.approx(energy[0], rel=1e-9)
    else:
        assert (np.diff(run.node_friction_work[:, 0]) >= -1e-12).all()


def test_compliant_stops_approach_rigid_ones():
    """Contacts of a duration pi sqrt(m/c) delay the motion: a tenth of the stiffness, a third."""
    times, errors = np.linspace(0.0, 2.0, 21), []
    kinds = {"rtol": 1e-10}
    rigid = body([(0.0, 0.0)], 0.1, load=Load(10.0))
    _, exact = go(rigid, [0.0, 0.5, 0.0], [3.0, 0.0, 0.0], times, restitution=1.0, **kinds)
    for stiffness in (1e6, 1e8):
        soft = body([(0.0, 0.0)], 0.1, load=Load(10.0), normal=LinearContact(stiffness))
        _, motion = go(soft, [0.0, 0.5, 0.0], [3.0, 0.0, 0.0], times, method="event-driven",
                       **kinds)
        errors.append(np.abs(motion[:, 1] - exact[:, 1]).max())
        assert motion[-1, 3] == pytest.approx(exact[-1, 3], rel=1e-2)
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def test_stops_whose_forces_cannot_be_told_apart_are_refused():
    row = np.array([[1.0], [1.0], [0.0]])
    system = ContactSystem(basis_from_matrices([[1.0]], [[0.0]], {"contact": row[None]}),
                           normal=RoughSurface(1e5, 1e-4), friction=ConstantFriction(0.3))
    with pytest.raises(InputError, match="not independent in 1 modes"):
        integrate_set_valued(system, np.zeros(2), np.array([0.0, 1.0]), restitution=0.5)


@pytest.mark.parametrize(("options", "message"), [
    ({"restitution": 0.5, "impact_law": "poison"}, "mean 'poisson'"),
    ({"restitution": 0.5, "impact_law": "poisson", "tangential_restitution": 0.2}, "'newton'"),
    ({"restitution": 0.5, "tangential_restitution": 1.5}, r"tangential_restitution = 1\.5"),
    ({"tangential_restitution": 0.5}, "give a restitution"),
    ({"restitution": (0.5, 1.5)}, "must be a number from 0 to 1, one for each"),
    ({"restitution": {"stop": -0.5}}, r"restitution\.stop = -0\.5 must be a number from 0 to 1"),
])
def test_options_are_checked(options, message):
    with pytest.raises(InputError, match=message):
        SetValued(**options)
