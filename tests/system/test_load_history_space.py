"""Quasi-static loading of solids: friction in two directions along curves, beside the plane."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from space_systems import chain, circle, dragged, jenkins, node
from systems import TURN

import fecontact as fc
from fecontact import AnalysisError, InputError, LoadPath, load_history
from fecontact.core.records import allocate
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HeightMap,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    RoughSurface,
    Sine,
    SlidingRotation,
    SlidingTranslation,
)
from fecontact.system.nodes import GroundMotion
from fecontact.system.quasistatic.given import travelling
from fecontact.system.quasistatic.increment import evaluate
from fecontact.system.quasistatic.pose import Pose, Workspace, sizes_of
from fecontact.system.quasistatic.sliders import sliders_of

C, LIMIT = 2e4, 4.0  # of `jenkins()`


def rates_along(path, rate, end, start=0.0):
    """Force (2,) at the end of a path: c g' inside the disc, at its edge without what leads out.

    Beyond the first yield the force keeps its size, and its angle a follows L a' = c g'.n with n
    across the force; g'.e > 0 all along.
    """
    def leaves(t, _):
        return np.hypot(*(C * (path(t) - path(start)))) - LIMIT

    ts = np.linspace(start, end, 20001)
    outside = np.flatnonzero([leaves(t, None) > 0.0 for t in ts])[0]
    from scipy.optimize import brentq
    begin = brentq(leaves, ts[outside - 1], ts[outside], args=(None,), xtol=1e-15)
    first = C * (path(begin) - path(start))

    def turn(t, a):
        speed = rate(t)
        return [C / LIMIT * (speed[1] * np.cos(a[0]) - speed[0] * np.sin(a[0]))]

    found = solve_ivp(turn, (begin, end), [np.arctan2(first[1], first[0])], method="DOP853",
                      rtol=1e-12, atol=1e-12, dense_output=True)
    times = np.linspace(begin, end, 4001)
    angles = found.sol(times)[0]
    pushed = np.array([rate(t) for t in times])
    along = pushed[:, 0] * np.cos(angles) + pushed[:, 1] * np.sin(angles)
    assert (along > 0.0).all()
    # In sliding all of g'.e is that of the slider, as the force keeps its size.
    loss = LIMIT * np.trapezoid(along, times)
    return LIMIT * np.array([np.cos(angles[-1]), np.sin(angles[-1])]), loss


CURVES = {
    "circle": (lambda t: 1e-3 * np.array([1.0 - np.cos(t), np.sin(t)]),
               lambda t: 1e-3 * np.array([np.sin(t), np.cos(t)])),
    "eight": (lambda t: 1e-3 * np.array([np.sin(t), 0.7 * np.sin(2.0 * t)]),
              lambda t: 1e-3 * np.array([np.cos(t), 1.4 * np.cos(2.0 * t)])),
}


@pytest.mark.parametrize("curve", CURVES)
def test_curves_converge_to_the_rate_equation(curve):
    """The error of force and loss falls with the first order of the increments."""
    path, rate = CURVES[curve]
    end = 2.0 * np.pi
    force, loss = rates_along(path, rate, end)
    errors = []
    for count in (200, 400, 800):
        t = np.linspace(0.0, end, count + 1)
        history = load_history(jenkins(), dragged([path(one) for one in t]), rtol=1e-2)
        assert history.statistics["solved"] == count + 1 + 2 * history.statistics["cut"]
        assert history.statistics["cut"] < 3
        errors.append((np.linalg.norm(history.friction_forces[-1, 0] - force) / LIMIT,
                       abs(history.loss[-1] / loss - 1.0)))
        assert np.linalg.norm(history.friction_forces[-1, 0]) == pytest.approx(LIMIT, rel=1e-6)
    errors = np.array(errors)
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(1.0, abs=0.1)
    assert errors[-1].max() < 6e-3
    # Increments that are cut by themselves: the direction to about twice the root of rtol.
    history = load_history(jenkins(), dragged([path(one) for one in t[::8]]), rtol=1e-6)
    exact = rates_along(*polygon(path, t[::8]), len(t[::8]) - 1.0)
    assert np.linalg.norm(history.friction_forces[-1, 0] - exact[0]) < 2.5e-3 * LIMIT
    assert history.loss[-1] == pytest.approx(exact[1], rel=2.5e-3)
    assert np.abs(history.imbalance).max() < 1e-5 * history.work[-1]


def polygon(path, t):
    """The path in chords between times, and its rate."""
    places = np.array([path(one) for one in t])

    def at(s):
        k = min(int(s), len(t) - 2)
        return places[k] + (s - k) * (places[k + 1] - places[k])

    def rate(s):
        k = min(int(s), len(t) - 2)
        return places[k + 1] - places[k]

    return at, rate


def test_corner_of_a_path():
    """Behind a corner by b the force turns: tan(a / 2) = tan(b / 2) exp(-c s / L), in all nodes.

    Two nodes of one rigid body, each with its own spring and limit, move alike.
    """
    b, s = 1.2, 3e-4
    rows = np.repeat(np.eye(6, 3)[None], 2, axis=0)
    basis = fc.basis_from_matrices(np.eye(3), np.diag([1e12, 1e12, 0.0]), {
        "contact": rows, "C": np.eye(6, 3)}, dimension=3)
    system = fc.ContactSystem(basis, normal=LinearContact((1e6, 3e6)), load=fc.Load(16.0),
                              friction=JenkinsFriction((2e4, 5e4), (0.4, 0.3)))
    limits = np.array([0.4 * 4.0, 0.3 * 12.0])
    left = np.tan(0.5 * b) * np.exp(-np.array([2e4, 5e4]) * s / limits)
    exact = 2.0 * np.arctan(left)
    direction = np.array([np.cos(b), np.sin(b)])
    errors = []
    for steps in (250, 500):
        history = load_history(system, dragged(
            [(0.0, 0.0), (1e-3, 0.0), (1e-3, 0.0) + s * direction], steps=(1, steps)), rtol=1e-2)
        turned = history.friction_forces[-1]
        errors.append(np.abs(b - np.arctan2(turned[:, 1], turned[:, 0]) - exact))
        assert np.linalg.norm(turned, axis=1) == pytest.approx(limits, rel=1e-6)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.05)
    assert errors[1].max() < 3e-3


@pytest.mark.parametrize(("friction", "ratio"), [
    (JenkinsFriction(2e4, 0.5), 0.82), (IwanFriction(2e4, 0.5, elements=5), 0.82),
    (ConstantFriction(0.5), 0.82), (ConstantFriction(0.5), np.inf)])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.9])
def test_straight_paths_are_those_of_the_plane(friction, ratio, angle):
    e = np.array([np.cos(angle), np.sin(angle)])
    pulls = np.array([0.0, 6.5, -5.5, 3.0])
    pressing = (-8.0, -10.0, -7.0, -9.0)

    def path(dimension):
        along = [tuple(pulls)] if dimension == 2 else [tuple(pulls * part) for part in e]
        return LoadPath(forces=(pressing, pressing, *along), steps=7)

    plane, space = (load_history(chain(friction, dimension=d, angle=angle, force=1.0), path(d),
                                 tangential_ratio=ratio, rtol=1e-10) for d in (2, 3))
    assert plane.loss[-1] > 1e-4
    # A step may be cut once more or less by rounding.
    assert space.statistics == pytest.approx(plane.statistics, rel=0.1, abs=2)
    assert np.einsum("Nnk,k->Nn", space.friction_forces, e) == pytest.approx(
        plane.friction_force, rel=1e-10, abs=1e-10)
    assert np.einsum("Nnk,k->Nn", space.slips, e) == pytest.approx(plane.slip, rel=1e-9, abs=1e-15)
    assert space.node_loss == pytest.approx(plane.node_loss, rel=1e-10, abs=1e-14)
    assert space.works[:, 0] == pytest.approx(plane.works[:, 0], rel=1e-10, abs=1e-14)
    assert (space.contact_state == plane.contact_state).all()
    across = np.einsum("Nnk,k->Nn", space.friction_forces, [-e[1], e[0]])
    assert np.abs(across).max() < 1e-9


def test_two_nodes_of_a_chain_slip_one_after_the_other():
    """By hand, along any direction: the second node begins to slip at L (c + 2 k) / (c + k)."""
    k, c, limit, Q, angle = 1e4, 3e4, 5.0, 8.0, 1.1
    e = np.array([np.cos(angle), np.sin(angle)])
    history = load_history(
        chain(ConstantFriction(0.5), k, angle=angle, force=1.0),
        LoadPath(forces=(-10.0, -10.0, *(((0.0, Q * part)) for part in e)), steps=40),
        tangential_stiffness=(c, c), rtol=1e-12)
    force = np.linspace(0.0, Q, 41)
    begin = limit * (c + 2.0 * k) / (c + k)
    sticks = force <= begin
    second = np.where(sticks, force * (c + k) / (c * (c + 2.0 * k)),
                      (force - limit) / c + (force - limit) / k)
    firsts = np.where(sticks, k / (c + k) * second, (force - limit) / c)
    assert history.slips @ e == pytest.approx(np.column_stack([firsts, second]), rel=1e-9,
                                              abs=1e-14)
    assert ((history.contact_state[:, 1] == 2) == ~sticks).all()
    assert history.loss[-1] == pytest.approx(limit * (second[-1] - limit / c), rel=1e-10)


def test_rigid_sticking_holds_below_the_disc_and_slides_along_the_force():
    """A force that goes around within the disc moves nothing; beyond, the slip follows it."""
    system = chain(ConstantFriction(0.5), angle=0.6, force=1.0)
    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    around = [(0.0, *(4.9 * np.cos(angles))), (0.0, *(4.9 * np.sin(angles)))]
    held = load_history(system, LoadPath(forces=(-10.0, -10.0, *around), steps=1),
                        tangential_ratio=np.inf)
    assert np.abs(held.slips).max() < 1e-12
    assert held.loss[-1] < 1e-12
    assert held.friction_forces[:, 1] == pytest.approx(np.column_stack(around), abs=1e-9)
    # At 8 N the second node carries 5 and the first one 3; the spring has stretched by 3 / k.
    e = np.array([np.cos(0.6), np.sin(0.6)])
    slid = load_history(system, LoadPath(forces=(-10.0, -10.0, *((0.0, 8.0 * part)
                                                                 for part in e)), steps=3),
                        tangential_ratio=np.inf)
    assert slid.friction_forces[-1] == pytest.approx(np.outer([3.0, 5.0], e), abs=1e-9)
    assert slid.slips[-1] == pytest.approx(np.outer([0.0, 3e-4], e), abs=1e-12)
    assert slid.loss[-1] == pytest.approx(5.0 * 3e-4, rel=1e-6)


def test_turned_paths_turn_the_forces():
    """To rounding, for all increments are cut at the same places."""
    angle = 0.83
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    places = np.array([(0.0, 0.0), (3e-4, 1e-4), (1e-4, 4e-4), (-2e-4, -1e-4), (2e-4, 0.0)])
    for friction in (IwanFriction(2e4, 0.4, elements=6), ConstantFriction(0.4)):
        system = node(friction)
        first, second = (load_history(system, dragged(one, steps=5), rtol=1e-5)
                         for one in (places, places @ turn.T))
        assert first.loss[-1] > 1e-4
        assert second.friction_forces == pytest.approx(first.friction_forces @ turn.T, rel=1e-6,
                                                       abs=1e-6)
        assert second.loss == pytest.approx(first.loss, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.8, 0.0, -0.6), (1.0, 0.0, 0.0)])
def test_faces_of_any_direction(normal):
    """An interface slides along a direction in space; what counts are its tangents there."""
    from dataclasses import replace
    law = JenkinsFriction(2e4, 0.4)
    basis = node(law).basis
    travel = (0.0, 3e-4, -2e-4)
    inclined = replace(basis, contact_normals=np.array([normal]), on_ground=np.array([False]))
    direction = np.array([0.3, -0.5, 0.7])
    side = SlidingTranslation(0.0, tuple(direction))
    system = fc.ContactSystem(inclined, normal=LinearContact(1e6), friction=law, load=fc.Load(10.0),
                              sliding={"contact": side})
    history = load_history(system, LoadPath(travel=travel, steps=9), rtol=1e-9)
    along = inclined.tangents[0] @ (direction / np.linalg.norm(direction))
    flat = load_history(jenkins(), LoadPath(travel=tuple(along[0] * np.array(travel)),
                                            travel_y=tuple(along[1] * np.array(travel)), steps=9),
                        rtol=1e-9)
    assert history.friction_forces == pytest.approx(flat.friction_forces, rel=1e-10, abs=1e-12)
    loop, both = history.loop(action="travel"), flat.travels @ along / (along @ along)
    assert loop.force == pytest.approx(-flat.friction_forces[:, 0] @ along, rel=1e-10, abs=1e-12)
    assert loop.displacement == pytest.approx(both, rel=1e-10, abs=1e-18)
    assert np.abs(history.imbalance).max() < 1e-8 * history.work[-1]


def test_a_turning_side_drags_each_node_along_its_circle():
    """A moment of mu F r, and the loss of an angle: all nodes slide across their arms."""
    places = np.array([(0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (-0.15, -0.1, 0.0)])
    rows = np.repeat(np.eye(6, 3)[None], 3, axis=0)
    basis = fc.basis_from_matrices(np.eye(3), np.diag([1e12, 1e12, 0.0]), {
        "contact": rows, "C": np.eye(6, 3)}, dimension=3, contact_places=places)
    system = fc.ContactSystem(basis, normal=LinearContact(1e6), friction=ConstantFriction(0.3),
                              load=fc.Load(30.0), sliding={"contact": SlidingRotation(0.0)})
    stiffness = 1e5
    history = load_history(system, LoadPath(travel=(0.0, 5e-3), steps=10), rtol=1e-9,
                           tangential_stiffness=(stiffness,) * 3)
    arms = np.linalg.norm(places, axis=1)
    across = np.column_stack([-places[:, 1], places[:, 0]]) / arms[:, None]
    assert history.friction_forces[-1] == pytest.approx(-3.0 * across, abs=1e-5)
    loop = history.loop(action="travel")
    assert loop.force[-1] == pytest.approx(3.0 * arms.sum(), rel=1e-6)
    assert history.loss[-1] == pytest.approx(
        (3.0 * (5e-3 * arms - 3.0 / stiffness)).sum(), rel=1e-6)


GROUNDS = {
    "flat": fc.Ground(),
    "waves": fc.Ground(profile=Sine(2e-5, 0.01), wave_direction=(1.0, 2.0),
                       friction_variation=Sine(0.2, 0.015)),
    "vertical": fc.Ground(profile=Sine(2e-5, 0.01), wave_direction=(2.0, 1.0), normal="vertical"),
    "map": fc.Ground(height_map=HeightMap(
        1e-5 * np.random.default_rng(3).standard_normal((8, 6)), 4e-3, 5e-3)),
}


def table(ground, friction=None):
    """A rigid block on four nodes that lies on springs along the ground and can tip."""
    corners = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])
    points = np.vstack([corners, [(0.0, 0.0, 0.05)]])
    rows = np.tile(np.eye(6), (5, 1, 1))
    for row, (x, y, z) in zip(rows, points, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    basis = fc.basis_from_matrices(
        np.diag([3.0] * 3 + [0.03, 0.04, 0.05]), np.diag([3e5, 2e5, 0.0, 0.0, 0.0, 2e3]),
        {"contact": rows[:4], "C": rows[4], "B": rows[4]}, dimension=3, contact_places=corners)
    return fc.ContactSystem(
        basis, normal=RoughSurface(4e7, 2e-6, 0.0), friction=friction or ConstantFriction(0.4),
        ground=ground, load=fc.Load(100.0), drive=fc.Drive(stiffness_x=2e5, stiffness_y=1e5,
                                                           stiffness_z=1e5))


@pytest.mark.parametrize("ground", GROUNDS)
def test_work_is_stored_or_lost(ground):
    """Work of all actions along paths in space: drive in x, y, z, travel in x and y, the load."""
    path = LoadPath(load_scale=(1.0, 1.3, 0.8, 1.0), motion_x=(0.0, 2e-4, -1e-4, 1e-4),
                    motion_y=(0.0, -1e-4, 2e-4, 0.0), motion_z=(0.0, 1e-4, -2e-4, 1e-4),
                    travel=(0.0, 1e-4, 3e-4, -1e-4), travel_y=(0.0, 2e-4, -1e-4, 1e-4), steps=20)
    history = load_history(table(GROUNDS[ground]), path, rtol=1e-6)
    assert history.status == "finished"
    assert (np.diff(history.node_loss, axis=0) >= 0.0).all()
    assert history.loss[-1] > 1e-3
    turnover = np.abs(np.diff(history.works, axis=0)).sum()
    assert np.abs(history.imbalance).max() < 3e-6 * turnover
    for action in ("load", "motion_x", "motion_y", "motion_z", "travel", "travel_y"):
        loop = history.loop(action=action)
        assert len(loop.force) == 61
    if ground != "vertical":
        # Vertical contact forces do work themselves, as the ground lifts the nodes.
        parts = np.array([history.loop(action=action).area for action in (
            "motion_x", "motion_y", "motion_z", "travel", "travel_y")])
        works = history.works[-1]
        assert parts[:3].sum() == pytest.approx(works[1], rel=2e-3)
        assert parts[3:].sum() == pytest.approx(works[2], rel=2e-3)


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("friction", [JenkinsFriction(4e5, 0.4),
                                      IwanFriction(4e5, 0.4, elements=4)])
def test_the_matrix_is_the_derivative_of_the_balance(ground, friction):
    """Derivatives by differences, with nodes that stick and nodes that slide in any direction."""
    system = table(GROUNDS[ground], friction)
    arrays, n, m = travelling(system), 4, 6
    sliders = sliders_of(system, 0.82, None, np.full(n, 1e7))
    e = sliders.limit.shape[1]
    sizes = sizes_of(m, n, e, 2)
    pose, workspace = allocate(Pose, sizes), allocate(Workspace, sizes, scale=np.ones(m))
    rng = np.random.default_rng(4)
    body = np.array([1e-4, -2e-4, -4e-5, 5e-5, -4e-5, 1e-4])
    pose.q[:] = np.linalg.solve(system.basis.T[0], body)
    # Two nodes stick, two slide.
    pose.left[:] = np.tile(arrays.rows[:, ::2] @ pose.q, e)
    pose.left[:2] += 1e-7 * rng.standard_normal((2, 2 * e))
    pose.left[2:] += 2e-2 * rng.choice([-1.0, 1.0], (2, 2 * e))
    workspace.multiplier[:] = 0.1 * rng.standard_normal((n, 2 * e))
    given = np.zeros(m), GroundMotion(1e-5, 0.0, -2e-5, 0.0), sliders, arrays
    evaluate(*given, pose, workspace, 1)
    found, start = workspace.matrix.copy(), pose.q.copy()
    size = np.linalg.norm(pose.force.reshape(n, e, 2), axis=2)
    limits = sliders.limit * pose.node[:, 1, None]
    assert (size[:2] < 0.99 * limits[:2]).all()
    assert size[2:] == pytest.approx(limits[2:], rel=1e-12)
    expected = np.empty((m, m))
    for k in range(m):
        values = []
        for part in (-2.0, -1.0, 1.0, 2.0):
            pose.q[:] = start
            pose.q[k] += part * 1e-8
            evaluate(*given, pose, workspace, 0)
            values.append(workspace.residual.copy())
        expected[:, k] = -(values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / 12e-8
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())
    assert np.abs(found - found.T).max() > 1e-3 * np.abs(found).max()


def test_a_slow_run_gives_the_same_loop():
    """Jenkins elements in time, dragged around slowly, beside the increments without time."""
    from fecontact.laws import HarmonicSpeed
    radius, w = 4e-4, 2.0 * np.pi
    system = jenkins(held=1e9, normal=LinearContact(1e6, 200.0), ground=fc.Ground(
        motion=HarmonicSpeed(radius * w, w / TURN, phase=0.5 * np.pi),
        motion_y=HarmonicSpeed(radius * w, w / TURN)))
    state = np.zeros(system.size)
    state[:3] = fc.equilibrium(system).modal_coordinates
    run = fc.simulate(system, 1.0, initial=state, outputs=101)
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    x, y = radius * np.sin(t), radius * (1.0 - np.cos(t))
    history = load_history(system, LoadPath(travel=tuple(x), travel_y=tuple(y), steps=1))
    assert run.friction_forces[:, 0] == pytest.approx(history.friction_forces[::20, 0],
                                                      abs=3e-3 * LIMIT)
    assert run.friction_work[-1].sum() == pytest.approx(history.loss[-1], rel=3e-3)


def test_bristles_take_the_largest_load_for_their_stiffness():
    """c_T = 0.82 c_N under the largest load, from the normal problem in space."""
    system = node(ExponentialFriction(0.6, 0.3, 1000.0, 1e6), normal=RoughSurface(1e6, 1e-4, 0.0),
                  held=2e5)
    history = load_history(system, LoadPath(load_scale=(0.05, 1.0, 0.4), travel=(0.0, 1e-5, 2e-5)))
    u = np.sqrt(2.0 * 10.0 * 1e-4 / 1e6)
    assert history.sliders.stiffness.sum() == pytest.approx(0.82 * 1e6 * u / 1e-4, rel=1e-9)


@pytest.mark.parametrize(("system", "path", "told"), [
    (chain(ConstantFriction(0.5), dimension=2), {"motion_z": (0.0, 1.0)}, "motion_z is for solids"),
    (chain(ConstantFriction(0.5), dimension=2), {"travel_y": (0.0, 1.0)}, "travel_y is for solids"),
    (jenkins(sliding={"contact": SlidingTranslation(0.1)}), {"travel_y": (0.0, 1.0)},
     "travel_y is that of the ground"),
])
def test_motions_that_a_system_does_not_have_are_refused(system, path, told):
    with pytest.raises(InputError, match=told):
        load_history(system, LoadPath(**path))


@pytest.mark.parametrize(("angle", "way"), [(0.0, "along the ground .x."),
                                            (0.5 * np.pi, "along the ground .y.")])
def test_what_nothing_holds_at_the_first_vertex_is_named(angle, way):
    """A path begins without friction: a force along the ground moves free masses away."""
    with pytest.raises(AnalysisError, match=f"nothing holds the body against a translation {way}"):
        load_history(chain(ConstantFriction(0.5), angle=angle, force=1.0),
                     LoadPath(load_scale=(1.0, 2.0)))


def test_states_of_plane_bodies_and_solids_are_told_apart():
    from fecontact.analysis import prestressed_modes
    plane = load_history(chain(ConstantFriction(0.5), dimension=2), LoadPath(load_scale=(1.0, 2.0)))
    rows = np.zeros((2, 6, 4))
    rows[0, 0, 0] = rows[0, 2, 1] = rows[1, 0, 2] = rows[1, 2, 3] = 1.0
    solid = fc.ContactSystem(
        fc.basis_from_matrices(np.eye(4), np.eye(4), {"contact": rows}, dimension=3),
        normal=LinearContact(1e6), friction=ConstantFriction(0.5))
    with pytest.raises(InputError, match="of plane bodies, but the system has 4 and 2 of solids"):
        prestressed_modes(solid, plane)


def test_summaries_tell_vectors_by_their_size():
    history = load_history(jenkins(), dragged(circle(1e-3, 8)))
    assert "friction force: 4 N" in repr(history)
    assert "friction force: 4 N" in repr(history.state())
    assert history.travel == pytest.approx(-circle(1e-3, 8)[:, 0])
    assert history.state(2).travels == pytest.approx([0.0, -1e-3], abs=1e-12)


def test_two_solids_whose_interface_slides():
    """A block on a held one, dragged along (1, 2, 0): its springs hold what friction and load say.

    Both are elastic; all nodes slide in the end, and the limits of friction add up to mu N.
    """
    from solid_blocks import block_body, block_mesh

    from fecontact.fem import pair_faces
    from fecontact.reduction import reduce_bodies
    lower = fc.ElasticBody(block_mesh((3, 3, 1), (0.3, 0.3, 0.05)).placed(
        shift=(-0.05, -0.1, -0.05)), fixed={"contact": "xyz"})
    bodies = {"upper": block_body((2, 2, 1)), "lower": lower}
    pairing = pair_faces(bodies, "upper.contact", "lower.top", nodes=4, nodes_on="face")
    middle = {"C": (0.1, 0.05, 0.05), "B": (0.1, 0.05, 0.05)}
    bases = reduce_bodies(bodies, [pairing], modes=8, each={"upper": middle})
    mu, load = 0.3, 400.0
    system = fc.ContactSystem(
        bodies=bases, interfaces=[fc.Interface(
            "seam", pairing, normal=LinearContact(2e8), friction=ConstantFriction(mu),
            sliding=SlidingTranslation(0.0, (1.0, 2.0, 0.0)))],
        drive=fc.Drive(stiffness_x=5e6, stiffness_y=5e6), load=fc.Load(load))
    history = load_history(system, LoadPath(travel=(0.0, 1e-4), steps=10), rtol=1e-5)
    assert (history.contact_state[-1] == 2).all()
    limits = np.linalg.norm(history.friction_forces[-1], axis=1)
    assert limits == pytest.approx(mu * history.normal_force[-1], rel=1e-9)
    assert limits.sum() == pytest.approx(mu * load, rel=1e-6)
    pulled = 5e6 * (system.arrays.drive_shapes[:2] @ history.modal_coordinates[-1])
    assert -history.friction_forces[-1].sum(axis=0) == pytest.approx(pulled, rel=1e-6)
    along = np.array([1.0, 2.0]) / np.sqrt(5.0)
    assert pulled @ along == pytest.approx(mu * load, rel=2e-3)
    assert np.abs(history.imbalance).max() < 2e-5 * history.work[-1]
