"""Contact systems of several bodies against one body, momentum and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from systems import TURN

from fecontact import (
    AnalysisError,
    ContactSystem,
    Ground,
    InputError,
    Interface,
    Load,
    basis_from_matrices,
    equilibrium,
    read_case,
    simulate,
    write_case,
)
from fecontact.integrate import PointStart, SetValued, TimeStepping, initial_state
from fecontact.laws import (
    ConstantFriction,
    HarmonicSpeed,
    LinearContact,
    PowerContact,
    RoughSurface,
    SlidingRotation,
    SlidingTranslation,
    SpeedRamp,
)
from fecontact.reduction import PointPairing, point_masses

NO_FRICTION = ConstantFriction(0.0)


def mass(m):
    """A free mass with x and y, at its point p."""
    return point_masses({"p": m}, components="xy")


def column(upwards, damping=0.02):
    """Four unequal masses over each other, the first of which touches with two nodes."""
    masses, springs = np.diag([1.0, 0.5, 0.7, 1.5]), (3e5, 2e5, 4e5)
    K = np.zeros((4, 4))
    for i, k in enumerate(springs):
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    rows = np.zeros((4, 3, 4))
    rows[:, 1] = np.eye(4) * (1.0 if upwards else -1.0)
    return basis_from_matrices(masses, K, {"left": rows[0], "right": rows[0], "top": rows[3]},
                               damping=damping)


def collision(a, b, normal, gap=1e-3, **options):
    """Body a above body b, which touches it from below."""
    pairing = PointPairing("a", "p", "b", "p", gaps=gap)
    return ContactSystem(bodies={"a": a, "b": b},
                         interfaces=[Interface("touch", pairing, normal, NO_FRICTION)], **options)


def velocities(run, point):
    basis = run.system.basis
    return run.modal_velocities @ basis.T[basis.point_index(point), 1]


@pytest.mark.parametrize("solver", [None, TimeStepping()])
def test_two_masses_with_a_hertz_spring_exchange_velocities(solver):
    system = collision(mass(1.0), mass(2.0), PowerContact(1e9))
    run = simulate(system, 5e-3, initial=PointStart(velocities={"a.p": (0.0, -1.0)}), rtol=1e-9,
                   **({} if solver is None else {"solver": solver}))
    assert velocities(run, "a.p")[-1] == pytest.approx(1.0 / 3.0, rel=1e-6)
    assert velocities(run, "b.p")[-1] == pytest.approx(-2.0 / 3.0, rel=1e-6)
    momentum = velocities(run, "a.p") + 2.0 * velocities(run, "b.p")
    assert momentum == pytest.approx(np.full(len(momentum), -1.0), rel=1e-13)


def test_rigid_stop_between_two_masses_has_the_restitution_asked_for():
    system = collision(mass(1.0), mass(2.0), LinearContact(1e6))
    run = simulate(system, 5e-3, initial=PointStart(velocities={"a.p": (0.0, -1.0)}),
                   solver=SetValued(restitution=0.5))
    # v_a' = v_a - (1 + e) m_b / (m_a + m_b) (v_a - v_b)
    assert velocities(run, "a.p")[-1] == pytest.approx(0.0, abs=1e-12)
    assert velocities(run, "b.p")[-1] == pytest.approx(-0.5, rel=1e-12)


@pytest.mark.parametrize("solver", [None, SetValued()])
def test_mirror_contact_is_that_of_one_body_on_a_rigid_plane(solver):
    """Twice the stiffness and damping, half the roughness and half the gap."""
    law, twice = RoughSurface(2e6, 4e-5, 300.0), RoughSurface(4e6, 2e-5, 600.0)
    options = {} if solver is None else {"solver": solver}
    pair = ContactSystem(
        bodies={"up": column(True), "down": column(False)},
        interfaces=[Interface("mirror", PointPairing("up", ["left", "right"], "down",
                                                     ["left", "right"], gaps=2e-4), law)])
    alone = ContactSystem(
        bodies={"up": column(True)},
        interfaces=[Interface("plane", PointPairing("up", ["left", "right"], gaps=1e-4), twice)])
    w = alone.basis.modes
    start = initial_state(alone, PointStart(velocities={"up.top": (0.0, -0.5)}), 0.0)
    both = np.concatenate([start[:w], start[:w], start[w:], start[w:]])
    run = simulate(alone, 0.02, initial=start, rtol=1e-10, **options)
    two = simulate(pair, 0.02, initial=both, rtol=1e-10, **options)
    assert (run.normal_force.max(axis=0) > 100.0).all()
    peak = run.normal_force.max()
    assert two.normal_force == pytest.approx(run.normal_force, abs=1e-6 * peak)
    for half in (two.modal_coordinates[:, :w], two.modal_coordinates[:, w:]):
        assert half == pytest.approx(run.modal_coordinates,
                                     abs=1e-7 * np.abs(run.modal_coordinates).max())


def test_contact_forces_act_reversed_at_the_foot():
    """On a tilted interface, with friction: total modal force has no resultant, and is oblique."""
    angle = 0.4
    normal = np.array([-np.sin(angle), np.cos(angle)])
    system = ContactSystem(
        bodies={"a": mass(1.0), "b": mass(2.0)},
        interfaces=[Interface("slope", PointPairing("a", "p", "b", "p", normals=normal),
                              LinearContact(1e5), ConstantFriction(0.3, smoothing_slope=1e4))])
    relative = -1e-4 * normal  # a enters b along the normal
    velocity = 0.2 * np.array([np.cos(angle), np.sin(angle)])  # and slides up
    basis = system.basis
    state = np.zeros(system.size)
    Ta = basis.T[basis.point_index("a.p"), :2]
    state[: basis.modes] = np.linalg.lstsq(Ta, relative, rcond=None)[0]
    state[basis.modes :] = np.linalg.lstsq(Ta, velocity, rcond=None)[0]
    acceleration = system.rhs(0.0, state)[basis.modes :]
    on_a = 1.0 * Ta @ acceleration
    on_b = 2.0 * basis.T[basis.point_index("b.p"), :2] @ acceleration
    tangent = np.array([normal[1], -normal[0]])
    assert on_a + on_b == pytest.approx([0.0, 0.0], abs=1e-12)
    friction = 0.3 * 10.0 * 2.0 / np.pi * np.arctan(1e4 * 0.2)
    assert on_a == pytest.approx(10.0 * normal - friction * tangent, rel=1e-12)


def sliding_system(sliding, ground=None, ring=False, on_ground=True):
    """One mass over the ground, another on a moving side at several places of a circle."""
    angles = np.radians([0.0, 90.0, 200.0]) if ring else np.zeros(2)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1) if ring else (0.0, 1.0)
    rows = np.zeros((len(angles), 3, 2))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    shaft = basis_from_matrices(np.eye(2), np.zeros((2, 2)), {
        "contact": rows}, contact_x=0.1 * np.cos(angles))
    nodes = list(range(len(angles)))
    law = LinearContact(1e5)
    given = [Interface("bush", PointPairing("shaft", nodes, "bearing", ["p"] * len(nodes),
                                            normals=normals), law, NO_FRICTION, sliding)]
    if on_ground:
        given.append(Interface("floor", PointPairing("bearing", "p"), law, NO_FRICTION))
    return ContactSystem(bodies={"shaft": shaft, "bearing": mass(1.0)}, interfaces=given,
                         ground=Ground() if ground is None else ground)


def test_sliding_translation_moves_the_other_side_along_the_tangent():
    system = sliding_system(SlidingTranslation(0.3, (3.0, 4.0)), ring=True, on_ground=False)
    t = system.basis.normals @ np.array([[0.0, -1.0], [1.0, 0.0]])
    assert system.prescribed_motion.motions[0] == Ground(speed=0.3)
    assert system.prescribed_motion.factors[0] == pytest.approx(t @ [0.6, 0.8], rel=1e-14)


def test_sliding_rotation_turns_about_its_centre():
    system = sliding_system(SlidingRotation(7.0, (0.1, -0.2)), on_ground=False)
    # Places (0.1, 0), tangents (1, 0): e_z x (0, 0.2) = (-0.2, 0).
    assert system.prescribed_motion.factors[0] == pytest.approx([-0.2, -0.2], rel=1e-14)
    assert system.prescribed_motion.motions[0] == Ground(speed=7.0)


def test_constant_speeds_are_combined():
    motion = sliding_system(SlidingTranslation(0.3), Ground(speed=2.0)).prescribed_motion
    assert motion.velocity(5.0) == pytest.approx([0.3, 0.3, 2.0], rel=1e-15)
    assert motion.travel(5.0) == pytest.approx(5.0 * motion.velocity(5.0))


def test_one_speed_may_vary_in_time_beside_others_at_rest():
    system = sliding_system(SlidingTranslation(0.3, motion=SpeedRamp(0.5, 1.0, 2.0)))
    motion = system.prescribed_motion
    assert motion.velocity(2.0) == pytest.approx([0.4, 0.4, 0.0], rel=1e-14)
    assert system.breakpoints(0.0, 10.0) == (1.0, 3.0)
    wave = sliding_system(SlidingTranslation(0.3, motion=HarmonicSpeed(0.1, 50.0 / TURN)))
    assert wave.shortest_period(0.0, 1.0) == pytest.approx(2.0 * np.pi / 50.0)
    with pytest.raises(InputError, match="'bush' varies in time while 'the ground' moves too"):
        sliding_system(SlidingTranslation(0.3, motion=SpeedRamp(0.5, 1.0, 2.0)), Ground(speed=1.0))


def test_one_body_on_ground_keeps_the_motion_of_the_ground():
    basis = basis_from_matrices(np.eye(2), np.eye(2), {"contact": np.eye(3, 2)[None]})
    for ground in (Ground(speed=0.5), Ground(), Ground(0.1, motion=HarmonicSpeed(0.2, 3.0 / TURN))):
        system = ContactSystem(basis, LinearContact(1e5), NO_FRICTION, ground)
        assert system.prescribed_motion.factors.tolist() == [[1.0]]
        base, = system.prescribed_motion.motions
        assert (base.speed, base.motion) == (ground.speed, ground.motion)


def test_parameters_of_interfaces_have_dotted_names():
    system = sliding_system(SlidingTranslation(0.3))
    assert system.parameter("interfaces.bush.sliding.speed") == 0.3
    assert system.parameter("interfaces.floor.normal.stiffness") == 1e5
    faster = system.with_(**{"interfaces.bush.sliding.speed": 0.6,
                             "interfaces.floor.normal.stiffness": 2e5})
    motion = faster.prescribed_motion
    assert motion.velocity(0.0)[0] == pytest.approx(0.6)
    assert faster.parameter("interfaces.floor.normal.stiffness") == 2e5
    assert faster.parameter("interfaces.bush.normal.stiffness") == 1e5
    assert [part.name for part in faster.basis.parts] == ["shaft", "bearing"]


def test_case_files_hold_several_bodies(tmp_path):
    system = sliding_system(SlidingRotation(7.0, (0.1, -0.2), SpeedRamp(9.0, 0.0, 0.01)), ring=True,
                            on_ground=False)
    run = simulate(system.with_(gap=1e-3), 1e-3, initial=np.zeros(system.size), outputs=5)
    write_case(tmp_path / "pair.h5", run)
    found = read_case(tmp_path / "pair.h5").trajectory
    assert found.system.parameters() == run.system.parameters()
    assert found.system.sliding == run.system.sliding
    assert found.system.basis.parts == run.system.basis.parts
    for name in ("contact_normals", "on_ground", "T", "positions"):
        assert (getattr(found.system.basis, name) == getattr(run.system.basis, name)).all()
    assert (found.states == run.states).all()
    factors = found.system.prescribed_motion.factors
    assert (factors == run.system.prescribed_motion.factors).all()


def test_bad_input_is_named():
    a, b, law = mass(1.0), mass(2.0), LinearContact(1e5)
    pairing = PointPairing("a", "p", "b", "p")
    touch = Interface("touch", pairing, law, NO_FRICTION)
    for message, arguments in (
        ("two interfaces have the name 'touch'", {"interfaces": [touch, touch]}),
        ("Interface 'touch' lacks friction", {"interfaces": [Interface("touch", pairing, law)]}),
        ("no body 'c'; the bodies are 'a', 'b'",
         {"interfaces": [Interface("touch", PointPairing("c", "p", "b", "p"), law)]}),
        ("no point 'q'",
         {"interfaces": [Interface("touch", PointPairing("a", "q", "b", "p"), law)]}),
        ("either basis", {"interfaces": [touch], "basis": a}),
        (r"'a\.b' of a body must be a text without dots",
         {"bodies": {"a.b": a}, "interfaces": [touch]}),
    ):
        with pytest.raises(InputError, match=message):
            ContactSystem(**{"bodies": {"a": a, "b": b}, **arguments})
    with pytest.raises(InputError, match="waves of the ground need"):
        ContactSystem(bodies={"a": a}, ground=Ground(amplitude=1e-6), interfaces=[
            Interface("wall", PointPairing("a", "p", normals=(1, 0)), law, NO_FRICTION)])
    with pytest.raises(InputError, match="no contact nodes"):
        ContactSystem(a, law)


def test_unknown_parameters_are_named_as_they_were_given():
    touch = Interface("touch", PointPairing("a", "p"), LinearContact(1e5), NO_FRICTION)
    system = ContactSystem(bodies={"a": mass(1.0)}, interfaces=[touch])
    for name, meant in (("interfaces.tuch.normal.stiffness", "interfaces.touch.normal.stiffness"),
                        ("interfaces.touch.normal.stifness", "interfaces.touch.normal.stiffness")):
        with pytest.raises(InputError, match=f"no parameter '{name}' .did you mean '{meant}'"):
            system.with_(**{name: 1e6})


def test_bodies_that_nothing_holds_are_named():
    law, a, b = LinearContact(1e5), mass(1.0), mass(2.0)
    touch = Interface("touch", PointPairing("a", "p"), law, NO_FRICTION)
    with pytest.raises(InputError, match="body 'b' is free in x, y, but no interface"):
        ContactSystem(bodies={"a": a, "b": b}, interfaces=[touch])
    unseen = replace(b, T=np.zeros_like(b.T))
    with pytest.raises(InputError, match="body 'b' is free, but no interface"):
        ContactSystem(bodies={"a": a, "b": unseen}, interfaces=[touch])
    up = ContactSystem(bodies={"a": a}, interfaces=[touch], load=Load(gravity=(1.0, -9.81)))
    with pytest.raises(AnalysisError, match="nothing holds body 'a' against a translation in x"):
        equilibrium(up)
    both = ContactSystem(bodies={"a": a, "b": b}, load=Load(gravity=(0.0, -9.81)), interfaces=[
        Interface("touch", PointPairing("a", "p", "b", "p"), law, NO_FRICTION)])
    with pytest.raises(AnalysisError, match="the bodies 'a', 'b' against a translation in y"):
        equilibrium(both)
