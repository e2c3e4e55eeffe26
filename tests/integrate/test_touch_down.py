"""Touch-down of event-driven runs from penetrations of zero and its neighbours.

A stop without penetration is neither open nor closed by its sign: what the run does there may not
depend on the last digit of a penetration.
"""

from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm

import fecontact as fc
from fecontact import Status
from fecontact.integrate import ContactEvents, EventDriven, SetValued, TimeStepping
from fecontact.laws import ConstantFriction, LinearContact, PrescribedForce, RoughSurface

GAP, WEIGHT, STIFFNESS = 10e-3, 9.81, 1e7


def mass(gap=GAP, mu=0.3, normal=None, springs=(0.0, 0.0), slope=1e3):
    """A mass of 1 kg in the plane above the ground."""
    rows = np.eye(3)[:, :2]
    basis = fc.basis_from_matrices(np.eye(2), np.diag(springs), {"contact": [rows], "C": rows})
    return fc.ContactSystem(
        basis, normal=LinearContact(STIFFNESS, damping=300.0) if normal is None else normal,
        friction=ConstantFriction(mu, slope), load=fc.Load(WEIGHT), gap=gap)


def chain(gap):
    """Four masses in a row, of which the first and the last are above the ground."""
    K = np.zeros((8, 8))
    for i in range(3):
        for a, b in ((2 * i, 2 * i + 2), (2 * i + 1, 2 * i + 3)):
            K[[a, b], [a, b]] += 1e5
            K[[a, b], [b, a]] -= 1e5
    rows = np.zeros((2, 3, 8))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 6] = rows[1, 1, 7] = 1.0
    basis = fc.basis_from_matrices(np.eye(8), K, {"contact": rows, "C": rows[0]})
    return fc.ContactSystem(basis, normal=LinearContact(1e6), load=fc.Load(WEIGHT), gap=gap,
                            friction=ConstantFriction(0.3, 1e3))


def runs(system, sizes, count, **options):
    """Event-driven runs from rest in place with random velocities."""
    rng, m = np.random.default_rng(3), system.basis.modes
    for _ in range(count):
        start = np.concatenate([np.zeros(m), rng.normal(size=m) * sizes])
        yield start, fc.simulate(system, 0.3, initial=start, outputs=7, solver=SetValued(),
                                 **options)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("normal", [
    None, LinearContact(1e5), RoughSurface(1e5, 1e-4)], ids=["damped", "linear", "rough"])
def test_masses_that_fall_touch_down(normal, mu, rtol):
    for _, run in runs(mass(mu=mu, normal=normal), [1.0, 0.1], 15, rtol=rtol):
        assert run.status is Status.FINISHED
        assert run.energies.imbalance < 1e-3


@pytest.mark.parametrize(("system", "sizes"), [
    (mass(gap=2e-3, springs=(3e4, 2e3)), [1.0, 0.1]), (chain((5e-3, 7e-3)), 0.3)],
    ids=["springs", "chain"])
def test_masses_on_springs_touch_down(system, sizes):
    for _, run in runs(system, sizes, 15):
        assert run.status is Status.FINISHED


def test_touch_down_without_friction_agrees_with_the_stiff_integrator():
    system = mass(mu=0.0)
    for start, run in runs(system, [1.0, 0.1], 6, rtol=1e-10):
        smooth = fc.simulate(system, 0.3, initial=start, outputs=7, rtol=1e-10)
        assert run.states == pytest.approx(smooth.states, abs=1e-6)


def test_touch_down_of_a_rubbing_mass_agrees_with_the_closed_form():
    """The impulse of friction is mu times that of the normal force while the mass slips on."""
    mu, normal = 0.3, LinearContact(1e6)
    start = np.array([0.0, 0.0, 1.0, -0.5])
    run = fc.simulate(mass(mu=mu, normal=normal), 0.04, initial=start, outputs=5, rtol=1e-11,
                      solver=SetValued(), events=ContactEvents())
    fall = (-0.5 + np.sqrt(0.25 + 2.0 * WEIGHT * GAP)) / WEIGHT
    speed = 0.5 + WEIGHT * fall
    assert run.events.kind == ("touch-down", "lift-off")
    assert run.events.time[0] == pytest.approx(fall, abs=1e-11)
    assert run.events.states[1, 3] == pytest.approx(speed, rel=1e-6)
    impulse = 2.0 * speed + WEIGHT * (run.events.time[1] - fall)
    assert run.states[-1, 2] == pytest.approx(1.0 - mu * impulse, rel=1e-8)


def test_motion_along_the_ground_by_rounding_alone_does_not_stop_runs():
    """Coulomb's oscillator turns twelve times and loses 2 R / k each time; the other mode swings.

    Its component of the slip of 4e-14 is passed over.
    """
    force, stiffness, turns = 0.1, 9.0, np.arange(13)
    rows = np.array([[1.0, 4e-14], [0.0, 0.0], [0.0, 0.0]])
    system = fc.ContactSystem(
        fc.basis_from_matrices(np.eye(2), np.diag([stiffness, 1e4]), {"contact": [rows]}),
        normal=PrescribedForce(1.0), friction=ConstantFriction(force, 1e3))
    run = fc.simulate(system, 4.0 * np.pi, initial=[2.0, 1.0, 0.0, 0.0], rtol=1e-9,
                      outputs=turns * np.pi / 3.0, solver=SetValued())
    assert run.status is Status.FINISHED
    expected = (-1.0) ** turns * (2.0 - 2.0 * turns * force / stiffness)
    assert run.modal_coordinates[:, 0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("nodes", [3, 4])
def test_a_free_beam_falls_on_the_ground(nodes):
    """By symmetry the middle node moves along x in half of the modes, in the others by rounding."""
    body = fc.ElasticBody(fc.generate(fc.Beam(0.2, 0.01)), fc.Material.named("steel"), 0.02)
    basis = fc.modal_basis(body, 8, contact_nodes=nodes, C=fc.Patch("C", 0.01), damping=0.02)
    system = fc.ContactSystem(basis, normal=LinearContact(1e7, damping=300.0), gap=2e-4,
                              friction=ConstantFriction(0.3, 1e4), load=fc.Load(20.0))
    rng = np.random.default_rng(1)
    for _ in range(4):
        start = np.zeros(16)
        start[8:11] = 0.05 * rng.normal(size=3)
        run = fc.simulate(system, 0.04, initial=start, outputs=3, solver=SetValued())
        assert run.status is Status.FINISHED
        assert run.energies.imbalance < 1e-3


@pytest.mark.parametrize("side", [-1, 0, 1])
@pytest.mark.parametrize("gap", [0.0, 10e-3, 1.0 / 3.0])
@pytest.mark.parametrize("slip", [0.0, 0.2])
@pytest.mark.parametrize("speed", [-0.5, 0.0, 0.5])
def test_neighbours_of_zero_have_one_future(speed, slip, gap, side):
    """Approaching, resting and leaving, at zero penetration and at both floating-point neighbours.

    All agree with the stiff integrator in the vertical motion, which has no friction.
    """
    system = mass(gap=gap, normal=LinearContact(1e5, damping=50.0))
    row = system.basis.T[-1, :2]
    place = -gap if side == 0 else np.nextafter(-gap, side * np.inf)
    start = np.linalg.solve(row, [[0.0, slip], [place, speed]]).T.ravel()
    run = fc.simulate(system, 0.05, initial=start, outputs=6, rtol=1e-9, solver=SetValued())
    assert run.status is Status.FINISHED
    smooth = fc.simulate(system, 0.05, initial=start, outputs=6, rtol=1e-9)
    assert run.penetration[:, 0] == pytest.approx(smooth.penetration[:, 0], abs=1e-8)
    assert run.penetration_rate[:, 0] == pytest.approx(smooth.penetration_rate[:, 0], abs=1e-5)
    # Friction takes mu times the impulse of the normal force, until slip has come to rest.
    impulse = -speed - run.penetration_rate[:, 0] + WEIGHT * run.time
    assert run.slip_velocity[:, 0] == pytest.approx(
        np.maximum(slip - 0.3 * impulse, 0.0), abs=1e-7)


def pair(nodes, mu, load, gap, spring):
    """Two masses on springs, of which the first or both have a rigid stop; K and M (4, 4)."""
    M, K = np.diag([1.0, 1.0, 0.7, 0.7]), np.diag([200.0, 30.0, 150.0, 40.0])
    for a, b, k in ((0, 2, 300.0), (1, 3, spring)):
        K[[a, b], [a, b]] += k
        K[[a, b], [b, a]] -= k
    rows = np.zeros((2, 3, 4))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 2] = rows[1, 1, 3] = 1.0
    basis = fc.basis_from_matrices(M, K, {"contact": rows[:nodes], "C": rows[0], "D": rows[1]})
    return fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(mu, 1e3),
                            load=fc.Load(load), gap=gap), M, K


@pytest.mark.parametrize(("e", "mu", "load"), [
    *product([0.0, 0.5], [0.0, 0.3], [0.0, 10.0, 100.0]), (1.0, 0.0, 0.0), (1.0, 0.3, 100.0)])
def test_masses_that_start_at_their_stops(e, mu, load):
    """The masses' motion along the ground is that of the springs where there is no friction.

    The friction of point masses has no effect on their normal accelerations: no start is a paradox.
    """
    rng = np.random.default_rng(11)
    for nodes, gap, spring in product([1, 2], [0.0, 1.0 / 3.0], [10.0, 1e3]):
        system, M, K = pair(nodes, mu, load, gap, spring)
        speed = rng.normal(size=4) * (rng.random(4) < 0.6)
        place = np.zeros(4)
        place[1::2] = np.nextafter(-gap, -gap + rng.integers(-1, 2, 2))
        rows = np.vstack([system.basis.T[system.basis.point_index(name), :2] for name in "CD"])
        start = np.linalg.solve(rows, np.stack([place, speed], axis=1)).T.ravel()
        run = fc.simulate(system, 0.1, initial=start, outputs=5, rtol=1e-8,
                          solver=SetValued(restitution=e))
        assert run.status is Status.FINISHED
        assert run.energies.imbalance < 1e-6
        assert run.penetration.max() < 1e-9
        if mu == 0.0:
            A = np.zeros((4, 4))
            A[:2, 2:], A[2:, :2] = np.eye(2), -np.linalg.solve(M, K)[::2, ::2]
            along = expm(0.1 * A) @ np.concatenate([place[::2], speed[::2]])
            assert rows[::2] @ run.states[-1, 4:] == pytest.approx(along[2:], abs=1e-6)


def accelerations(places, height, mu, inertia):
    """Number of sets of normal forces of a body that slides on two nodes under 10 N.

    By trying all cases of which nodes are pressed.
    """
    normal = np.array([[0.0, 1.0, a] for a in places])
    pushing = normal - mu * np.array([1.0, 0.0, height])
    W = normal @ np.diag([1.0, 1.0, 1.0 / inertia]) @ pushing.T
    found = []
    for pressed in product([False, True], repeat=2):
        F, on = np.zeros(2), np.array(pressed)
        if on.any():
            F[on] = np.linalg.solve(W[np.ix_(on, on)], np.full(on.sum(), 10.0))
        if (F >= 0.0).all() and (W @ F - 10.0 >= -1e-9).all():
            found.append(F)
    return len(found)


@pytest.mark.filterwarnings("ignore:.*friction_coefficient = .* is above 2")
def test_a_paradox_has_no_acceleration_or_several():
    rng, counts = np.random.default_rng(5), []
    for _ in range(60):
        places, height = (rng.uniform(-1.0, 0.2), rng.uniform(-0.2, 1.0)), rng.uniform(-2.0, 2.0)
        mu, inertia = rng.uniform(0.0, 3.0), rng.uniform(0.05, 1.0)
        rows = [[[1.0, 0.0, height], [0.0, 1.0, a], [0.0, 0.0, 1.0]] for a in places]
        basis = fc.basis_from_matrices(np.diag([1.0, 1.0, inertia]), np.zeros((3, 3)), {
            "contact": rows, "C": np.eye(3)})
        system = fc.ContactSystem(basis, normal=LinearContact(1e6), load=fc.Load(10.0),
                                  friction=ConstantFriction(mu, 1e3))
        speed = np.linalg.solve(basis.T[basis.point_index("C")], [1.0, 0.0, 0.0])
        run = fc.simulate(system, 1e-6, initial=np.concatenate([np.zeros(3), speed]), outputs=2,
                          solver=SetValued(restitution=0.0))
        counts.append(accelerations(places, height, mu, inertia))
        assert (run.status is Status.PARADOX) == (counts[-1] != 1)
    assert {0, 1} <= set(counts)


@pytest.mark.parametrize("e", [0.0, 1.0])
@pytest.mark.parametrize("speed", [0.0, 1e-18, -1e-18])
def test_rounding_is_no_impact(speed, e):
    """A mass at rest on its stop, at a speed within rounding of its slip."""
    system = mass(gap=GAP, mu=0.0)
    row = system.basis.T[-1, :2]
    start = np.linalg.solve(row, [[0.0, 0.5], [-GAP, speed]]).T.ravel()
    run = fc.simulate(system, 0.1, initial=start, outputs=3, solver=SetValued(restitution=e))
    assert run.status is Status.FINISHED
    assert run.statistics["impacts"] == 0
    assert run.normal_force[:, 0] == pytest.approx(WEIGHT, rel=1e-9)


@pytest.mark.parametrize(("gap", "mu", "seed"), [
    (1e-4, 0.3, 1), (1e-4, 0.3, 2), (2e-4, 0.6, 3), (2e-4, 0.3, 1)])
def test_contacts_of_a_beam_that_let_go_together(gap, mu, seed):
    """Six contact nodes, whose rows are nearly dependent in eight modes; by implicit steps too."""
    body = fc.ElasticBody(fc.generate(fc.Beam(0.2, 0.01)), fc.Material.named("steel"), 0.02)
    basis = fc.modal_basis(body, 8, contact_nodes=6, C=fc.Patch("C", 0.01), damping=0.02)
    system = fc.ContactSystem(basis, normal=LinearContact(1e7, damping=300.0), load=fc.Load(20.0),
                              friction=ConstantFriction(mu, 1e4), gap=gap)
    start = np.zeros(16)
    start[8:11] = 0.05 * np.random.default_rng(seed).normal(size=3)
    run, steps = (fc.simulate(system, 0.04, initial=start, outputs=3,
                              solver=solver) for solver in (EventDriven(), TimeStepping()))
    assert run.status is Status.FINISHED
    assert run.statistics["events"] > 100
    for kind in (slice(0, 8), slice(8, 16)):
        one, other = run.states[-1, kind], steps.states[:, kind]
        assert one == pytest.approx(other[-1], abs=1e-3 * np.abs(other).max())
