"""Quasi-static loading under friction against closed forms, hand calculations and the balance."""

import numpy as np
import pytest

import fecontact as fc
from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    LoadPath,
    ModelWarning,
    PointLoad,
    basis_from_matrices,
    load_history,
)
from fecontact.laws import (
    Constant,
    ConstantFriction,
    DahlFriction,
    ExponentialFriction,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
    RoughSurface,
)

STIFF = 1e9


def block(friction, normal=None, spring=0.0, nodes=1, **parts):
    """A mass that moves along the ground and up and down, on some nodes at one place."""
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.diag([spring, 0.0]), {
        "contact": np.repeat(row[None], nodes, axis=0), "B": row, "C": row})
    return ContactSystem(basis, **{"normal": normal or LinearContact(1e6), "friction": friction,
                                   "load": Load(10.0), **parts})


def chain(k=1e4, friction=None, forces=0.0):
    """Two masses along the ground, joined by a spring, and a force on the second."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0] = np.eye(2)
    basis = basis_from_matrices(np.eye(2), [[k, -k], [-k, k]], {"contact": rows})
    return ContactSystem(basis, normal=PrescribedForce((10.0, 10.0)),
                         friction=friction or ConstantFriction(0.5),
                         load=Load(forces=(PointLoad(1, "x", signal=Constant(forces)),)))


def test_loop_of_a_jenkins_element():
    """The loss is 4 mu F (X - mu F / k) for any number of increments."""
    k, mu, F, X = 2e4, 0.4, 10.0, 5e-4
    losses = []
    for steps in (1, 7):
        history = load_history(
            block(JenkinsFriction(k, mu), drive=Drive(stiffness_x=STIFF)),
            LoadPath(motion_x=(0.0, X, -X, X), steps=steps), rtol=1e-12)
        amplitude = history.slip[-1, 0]
        exact = 4.0 * mu * F * (amplitude - mu * F / k)
        found = history.loop(1, 3)
        assert found.action == "motion_x"
        assert found.loss == pytest.approx(exact, rel=1e-11)
        assert np.abs(history.imbalance).max() < 1e-11 * history.work[-1]
        losses.append(found.loss)
    assert losses[0] == pytest.approx(losses[1], rel=1e-11)


def test_travel_of_the_ground_does_the_work():
    k, mu, F, X = 2e4, 0.4, 10.0, 5e-4
    history = load_history(block(JenkinsFriction(k, mu), spring=STIFF),
                           LoadPath(travel=(0.0, X, -X, X), steps=9), rtol=1e-12)
    found = history.loop(1, 3)
    amplitude = -history.slip[9, 0]
    assert found.action == "travel"
    assert found.loss == pytest.approx(4.0 * mu * F * (amplitude - mu * F / k), rel=1e-11)
    assert np.abs(history.imbalance).max() < 1e-11 * history.work[-1]


def test_iwan_first_loading_and_masing():
    """R = k x - (k x)^2 / (4 mu F) on first loading; unloading is its double."""
    k, mu, F, X = 1e5, 0.5, 10.0, 8e-5
    system = block(IwanFriction(k, mu, elements=80), spring=0.0, drive=Drive(stiffness_x=STIFF))
    history = load_history(system, LoadPath(motion_x=(0.0, X, -X), steps=(20, 40)), rtol=1e-11)
    x, R = history.slip[:, 0], history.friction_force[:, 0]
    first = slice(0, 21)
    assert R[first] == pytest.approx(k * x[first] - (k * x[first]) ** 2 / (4.0 * mu * F),
                                     abs=2e-4 * mu * F)
    # Masing's rule, by the curve of the elements themselves.
    part = mu * F * (2.0 * np.arange(80) + 1.0) / 80**2
    back = (x[20] - x[20:]) / 2.0
    doubled = 2.0 * np.minimum(k / 80 * back[:, None], part).sum(axis=1)
    assert R[20] - R[20:] == pytest.approx(doubled, rel=1e-6, abs=1e-8)
    assert np.abs(history.imbalance).max() < 1e-9 * history.work[-1]


def test_two_nodes_of_a_chain_slip_one_after_the_other():
    k, c, limit, Q = 1e4, 3e4, 5.0, 8.0
    system = chain(k)
    history = load_history(system, LoadPath(forces=((0.0, Q),), steps=40),
                           tangential_stiffness=(c, c), rtol=1e-12)
    force = np.linspace(0.0, Q, 41)
    begin = limit * (c + 2.0 * k) / (c + k)
    sticks = force <= begin
    second = np.where(sticks, force * (c + k) / (c * (c + 2.0 * k)),
                      (force - limit) / c + (force - limit) / k)
    firsts = np.where(sticks, k / (c + k) * second, (force - limit) / c)
    assert history.slip == pytest.approx(np.column_stack([firsts, second]), rel=1e-10, abs=1e-15)
    assert (history.contact_state[:, 0] == 1).all()
    assert ((history.contact_state[:, 1] == 2) == ~sticks).all()
    slid = second[-1] - limit / c
    assert history.loss[-1] == pytest.approx(limit * slid, rel=1e-11)
    assert np.abs(history.imbalance).max() < 1e-11 * history.work[-1]


def test_rigid_sticking_is_the_limit_of_a_stiff_spring():
    path = LoadPath(forces=((0.0, 8.0, -8.0, 3.0),), steps=5)
    rigid = load_history(chain(), path, tangential_ratio=np.inf, rtol=1e-10)
    stiff = load_history(chain(), path, tangential_stiffness=(1e12, 1e12), rtol=1e-10)
    assert rigid.friction_force == pytest.approx(stiff.friction_force, abs=1e-6)
    assert rigid.loss[-1] == pytest.approx(stiff.loss[-1], rel=1e-6)
    assert rigid.loss[-1] > 1e-3
    # By hand: at 8 N the second node holds 5 and the first 3, and it has slid by 3 / k.
    assert rigid.friction_force[5] == pytest.approx([3.0, 5.0], abs=1e-9)
    assert rigid.slip[5] == pytest.approx([0.0, 3e-4], abs=1e-12)
    assert np.abs(rigid.imbalance).max() < 1e-9 * rigid.work[-1]


def test_pressed_with_friction_or_before_it():
    """A surface whose stiffness grows with the load, on a path that presses and shears."""
    system = block(ExponentialFriction(0.6, 0.3, 1000.0, 1e6), RoughSurface(1e6, 1e-4, 0.0),
                   spring=2e5, nodes=3,
                   load=Load(10.0, (PointLoad("C", "x", signal=Constant(0.0)),)))
    path = LoadPath(load_scale=(0.05, 1.0, 0.4, 1.0), forces=((0.0, 7.0, -5.0, 6.0),), steps=4)
    coarse = load_history(system, path, rtol=1e-8)
    fine = load_history(system, LoadPath(path.load_scale, path.forces, steps=50), rtol=1e-8)
    assert coarse.friction_force[[4, 8, 12]] == pytest.approx(fine.friction_force[[50, 100, 150]],
                                                              rel=1e-5)
    assert coarse.loss[-1] == pytest.approx(fine.loss[-1], rel=1e-5)
    assert np.abs(coarse.imbalance).max() < 1e-5 * np.abs(coarse.work).max()
    # c_T = 0.82 c_N of the largest load: the slope of the surface where it carries 10 N.
    u = np.sqrt(2.0 * 10.0 * 1e-4 / 1e6)
    assert coarse.sliders.stiffness.sum() == pytest.approx(0.82 * 1e6 * u / 1e-4, rel=1e-9)


def test_frictionless_waves_give_back_what_they_take():
    system = block(ConstantFriction(0.0), spring=1e6, load=Load(10.0),
                   ground=Ground(amplitude=2e-5, wavelength=1e-2))
    history = load_history(system, LoadPath(travel=(0.0, 1e-2), steps=16), rtol=1e-8)
    assert np.abs(history.works[:, 2]).max() > 1e-4
    assert abs(history.work[-1]) < 1e-6 * np.abs(history.works[:, 2]).max()
    assert np.abs(history.imbalance).max() < 2e-6 * np.abs(history.works[:, 2]).max()


def test_a_body_that_nothing_holds_ends_the_path():
    system = block(ConstantFriction(0.5), load=Load(
        10.0, (PointLoad("C", "x", signal=Constant(0.0)),)))
    with pytest.warns(ModelWarning, match="no equilibrium beyond"):
        history = load_history(system, LoadPath(forces=((0.0, 10.0),), steps=10))
    assert history.status == "no-equilibrium"
    assert len(history) in (5, 6)  # 5 N is the limit itself
    with pytest.raises(InputError, match="was not reached"):
        history.row(1)


def test_loading_goes_on_from_a_state():
    whole = load_history(chain(), LoadPath(forces=((0.0, 8.0, -6.0, 2.0),)),
                         tangential_stiffness=2e4)
    first = load_history(chain(), LoadPath(forces=((0.0, 8.0),)), tangential_stiffness=2e4)
    second = load_history(chain(), LoadPath(forces=((8.0, -6.0, 2.0),)), start=first)
    assert second.friction_force[-1] == pytest.approx(whole.friction_force[-1], rel=1e-9)
    assert first.loss[-1] + second.loss[-1] == pytest.approx(whole.loss[-1], rel=1e-6)


def test_a_node_that_opens_forgets_its_friction():
    system = block(ConstantFriction(0.5), spring=1e4, drive=Drive(stiffness_y=1e5),
                   load=Load(10.0, (PointLoad("C", "x", signal=Constant(0.0)),)))
    history = load_history(system, LoadPath(
        forces=((0.0, 4.0, 4.0, 4.0),), motion_y=(0.0, 0.0, 1e-3, 0.0)), tangential_stiffness=1e5)
    assert history.friction_force[20, 0] > 3.0
    assert history.contact_state[40, 0] == 0
    assert history.friction_force[40, 0] == 0.0
    assert history.slip[40, 0] == pytest.approx(4e-4, rel=1e-9)
    # Where it comes down again nothing pulls at its spring.
    assert abs(history.friction_force[60, 0]) < 1e-6


@pytest.mark.parametrize(("change", "told"), [
    ({"system": block(DahlFriction(0.5, 1e5))}, "no quasi-static limit"),
    ({"system": chain()}, "give tangential_stiffness"),
    ({"tangential_ratio": -1.0}, "tangential_ratio = -1.0 must be"),
    ({"tangential_stiffness": (1.0, 2.0, 3.0)}, "tangential_stiffness"),
    ({"rtol": 1.0}, "rtol = 1.0 must be"),
    ({"path": LoadPath(forces=((0.0, 1.0),))}, "forces has 1 entries"),
])
def test_what_cannot_be_loaded_is_refused(change, told):
    given = {"system": block(ConstantFriction(0.5)), "path": LoadPath(travel=(0.0, 1e-4)), **change}
    with pytest.raises(InputError, match=told):
        load_history(given.pop("system"), given.pop("path"), **given)


@pytest.mark.parametrize(("values", "told"), [
    ({}, "two vertices"),
    ({"travel": (0.0, 1.0), "motion_x": (0.0, 1.0, 2.0)}, "travel has 2|motion_x has 3"),
    ({"travel": (0.0, 1.0), "steps": (3, 4)}, "steps has 2 values"),
    ({"travel": (0.0, np.nan)}, "must be finite"),
])
def test_paths_are_checked(values, told):
    with pytest.raises(InputError, match=told):
        LoadPath(**values)


def test_summary_is_short():
    history = load_history(chain(), LoadPath(forces=((0.0, 8.0),)), tangential_stiffness=2e4)
    assert "finished" in repr(history)
    assert len(repr(history)) < 300
    assert "1 stick" in repr(history.state())
    assert fc.load_history is load_history


def test_forces_by_name_are_those_of_the_system_or_further_ones():
    laws = ExponentialFriction(0.6, 0.3, 1000.0, 1e6), RoughSurface(1e6, 1e-4, 0.0)
    options = {"spring": 2e5, "nodes": 3}
    pulls, turn = (0.0, 7.0, -5.0, 6.0), (0.0, 1e-3, 0.0, 0.0)
    own = [PointLoad("C", "x", signal=Constant(3.0)), PointLoad("C", "y", signal=Constant(-2.0))]
    scale = (1.0, 1.0, 0.5, 1.0)
    listed = load_history(block(*laws, load=Load(10.0, own), **options), LoadPath(
        scale, forces=(pulls, tuple(-2.0 * one for one in scale)), steps=4))
    named = load_history(block(*laws, load=Load(10.0, own), **options),
                         LoadPath(scale, forces={"C.x": pulls}, steps=4))
    bare = load_history(block(*laws, load=Load(10.0), **options), LoadPath(
        scale, forces={"C.x": pulls, "C.y": tuple(-2.0 * one for one in scale)}, steps=4))
    for one in (named, bare):
        np.testing.assert_allclose(one.friction_force, listed.friction_force, rtol=1e-12)
        np.testing.assert_allclose(one.normal_force, listed.normal_force, rtol=1e-12)
    assert bare.loop(1, 3, "C.x").loss == listed.loop(1, 3).loss
    # Its system rests at the end of the path, which that of the user would not.
    assert bare.system.load.forces[0].signal == Constant(6.0)
    there = block(*laws, load=Load(10.0), **options)
    moved = load_history(there, LoadPath(forces={"0.x": turn}, steps=2)).modal_coordinates
    assert np.abs(moved).max() > 0.0
    for name, said in (("D.x", "no point 'D'"), ("C.u", "component 'u'"), ("C", "a point and a")):
        with pytest.raises(InputError, match=said):
            load_history(there, LoadPath(forces={name: turn}))


def elastic_block(nodes, stiffness, fixed=None, modes=20):
    """A block of aluminium on a flat ground, held at its top, or free and drawn by a spring."""
    body = fc.ElasticBody(
        fc.Mesh.grid(np.linspace(-0.02, 0.02, 17), np.linspace(0.0, 0.03, 9)),
        fc.Material(70e9, 0.3, 2700.0), 0.01, fixed=fixed or {})
    if fixed:
        return ContactSystem(fc.modal_basis(body, modes, contact="bottom", contact_nodes=nodes),
                             normal=LinearContact(stiffness, preload=2000.0),
                             friction=ConstantFriction(0.4))
    basis = fc.modal_basis(body, modes, contact="bottom", contact_nodes=nodes, C="top", B="left")
    return ContactSystem(basis, normal=LinearContact(stiffness), friction=ConstantFriction(0.4),
                         load=Load(2000.0), drive=Drive(stiffness_x=5e8))


def test_rigid_sticking_of_more_nodes_than_modes_tell_apart():
    """Forces and losses of runs by EventDriven at 20 Hz with rtol = 1e-5; a stiff spring."""
    system = elastic_block(8, 3e9)
    for amplitude, force, loss in ((1e-6, 243.13768, 7.05566e-6), (3e-6, 630.38091, 1.9982662e-4)):
        path = LoadPath(motion_x=(0.0, amplitude, -amplitude, amplitude), steps=20)
        rigid = load_history(system, path, tangential_ratio=np.inf)
        assert rigid.status == "finished"
        assert rigid.friction_force[20].sum() == pytest.approx(force, rel=1e-5)
        assert rigid.loop(1, 3).loss == pytest.approx(loss, rel=1e-3)
        stiff = load_history(system, path, tangential_ratio=1e6)
        assert stiff.friction_force.sum(axis=1) == pytest.approx(
            rigid.friction_force.sum(axis=1), abs=1e-3)


def test_stiff_springs_do_not_cut_increments_without_end():
    """Newton's method goes from one change of state to the next."""
    system = elastic_block(4, 3e9, {"top": "xy"})
    path = LoadPath(travel=(0.0, 1e-6, -1e-6, 1e-6), steps=10)
    stiff, rigid = (load_history(system, path, tangential_ratio=ratio) for ratio in (1e5, np.inf))
    assert stiff.loss[-1] == pytest.approx(rigid.loss[-1], rel=1e-4)
    assert max(stiff.statistics["solved"], rigid.statistics["solved"]) < 250


@pytest.mark.parametrize("stiffness", [1e8, 3e9])
def test_works_that_are_rounding_do_not_cut_increments(stiffness):
    """A block on one node turns about it: neither friction nor any work but rounding."""
    history = load_history(elastic_block(1, stiffness), LoadPath(motion_x=(0.0, 1e-6), steps=2))
    assert history.statistics == {"solved": 3, "cut": 0, "jumps": 0}
    assert np.abs(history.friction_force).max() < 1e-9
