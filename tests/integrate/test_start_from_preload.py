"""Runs that start at rest under friction, where a path of loads ended."""

from dataclasses import replace

import numpy as np
import pytest

from fecontact import (
    ContactSystem,
    Ground,
    InputError,
    Load,
    LoadPath,
    PointLoad,
    basis_from_matrices,
    load_history,
    simulate,
)
from fecontact.analysis import prestressed_modes
from fecontact.integrate import EventDriven, SetValued, TimeStepping
from fecontact.laws import (
    Constant,
    ConstantFriction,
    DahlFriction,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
)

K = 1e4


def chain(friction, force, **parts):
    """Two masses that move along the ground and up and down, joined by a spring along it."""
    rows = np.zeros((2, 3, 4))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 2] = rows[1, 1, 3] = 1.0
    stiffness = np.zeros((4, 4))
    stiffness[::2, ::2] = [[K, -K], [-K, K]]
    basis = basis_from_matrices(np.eye(4), stiffness, {"contact": rows})
    forces = (*(PointLoad(k, "y", signal=Constant(-10.0)) for k in (0, 1)),
              PointLoad(1, "x", signal=Constant(force)))
    return ContactSystem(basis, normal=LinearContact(2e6, 50.0), friction=friction,
                         load=Load(forces=forces), **parts)


def loaded(friction, **options):
    """The chain under 6 N, after 8 N, at which its second node has slid."""
    path = LoadPath(forces=(-10.0, -10.0, (0.0, 8.0, 6.0)))
    return load_history(chain(friction, 6.0), path, **options)


@pytest.mark.parametrize("friction", [JenkinsFriction(6e4, 0.5), IwanFriction(6e4, 0.5)])
def test_springs_hold_what_they_held(friction):
    history = loaded(friction)
    assert (history.friction_force[-1] > 1.0).all()
    run = simulate(history.system, 0.2, initial=history, outputs=201)
    assert np.abs(run.modal_velocities).max() < 1e-8
    assert np.abs(run.modal_coordinates - history.modal_coordinates[-1]).max() < 1e-9
    assert run.friction_force[-1] == pytest.approx(history.friction_force[-1], rel=1e-6)


@pytest.mark.parametrize("ratio", [0.82, np.inf])
@pytest.mark.parametrize("solver", [EventDriven(), TimeStepping()])
def test_set_valued_friction_holds_what_it_held(ratio, solver):
    history = loaded(ConstantFriction(0.5), tangential_ratio=ratio)
    run = simulate(history.system, 0.2, initial=history.state(), outputs=101,
                   solver=solver)
    assert np.abs(run.modal_velocities).max() < 1e-8
    assert np.abs(run.modal_coordinates - history.modal_coordinates[-1]).max() < 1e-9
    assert run.friction_force[-1] == pytest.approx(history.friction_force[-1], rel=1e-6)


def test_the_same_place_without_memory_is_no_rest():
    history = loaded(JenkinsFriction(6e4, 0.5))
    system = history.system
    start = np.concatenate([history.modal_coordinates[-1],
                            np.zeros(system.size - system.basis.modes)])
    run = simulate(system, 0.02, initial=start, outputs=51)
    assert np.abs(run.modal_velocities).max() > 1e-3


def test_smoothed_friction_creeps_from_where_it_was():
    history = loaded(ConstantFriction(0.5, 1e6))
    run = simulate(history.system, 0.01, initial=history, outputs=51)
    start = history.modal_coordinates[-1]
    assert run.modal_coordinates[0] == pytest.approx(start)
    assert 1e-10 < np.abs(run.modal_coordinates[-1] - start).max() < 1e-7


def test_other_friction_and_other_ground_are_refused():
    history = loaded(JenkinsFriction(6e4, 0.5))
    with pytest.raises(InputError, match="cannot go on from this state"):
        simulate(chain(DahlFriction(0.5, 1e5), 6.0), 0.1, initial=history)
    path = LoadPath(forces=(-10.0, -10.0, 0.0), travel=(0.0, 1e-4))
    wavy = chain(JenkinsFriction(6e4, 0.5), 0.0, ground=Ground(amplitude=1e-6))
    moved = load_history(wavy, path)
    with pytest.raises(InputError, match="has travelled 0"):
        simulate(wavy, 0.1, initial=moved)


def test_other_normal_laws_are_refused():
    history = loaded(JenkinsFriction(6e4, 0.5))
    other = history.system.with_(normal=LinearContact(1e6))
    for call in (lambda: simulate(other, 0.1, initial=history),
                 lambda: load_history(other, LoadPath(travel=(0.0, 1e-5)), start=history),
                 lambda: prestressed_modes(other, history)):
        with pytest.raises(InputError, match="where the normal law of the system has"):
            call()


def solid(friction, force, **parts):
    """Two masses in space, joined by equal springs along the ground, with a force on the second."""
    rows = np.zeros((2, 6, 6))
    rows[0, :3, :3] = rows[1, :3, 3:] = np.eye(3)
    springs = np.kron([[K, -K], [-K, K]], np.diag([1.0, 1.0, 0.0]))
    basis = basis_from_matrices(np.eye(6), springs, {"contact": rows}, dimension=3)
    forces = (*(PointLoad(k, "z", signal=Constant(-10.0)) for k in (0, 1)),
              *(PointLoad(1, axis, signal=Constant(value))
                for axis, value in zip("xy", force, strict=True)))
    return ContactSystem(basis, normal=LinearContact(2e6, 50.0), friction=friction,
                         load=Load(forces=forces), **parts)


def loaded_solid(friction, **options):
    """After 8 N along x, at which the second mass has slid, under 6 N in another direction."""
    path = LoadPath(forces=(-10.0, -10.0, (0.0, 8.0, 4.0), (0.0, 0.0, 4.0)))
    return load_history(solid(friction, (4.0, 4.0)), path, **options)


@pytest.mark.parametrize("friction", [JenkinsFriction(6e4, 0.5), IwanFriction(6e4, 0.5)])
def test_springs_of_solids_hold_what_they_held(friction):
    history = loaded_solid(friction)
    assert (np.abs(history.friction_forces[-1]) > 0.5).any(axis=0).all()
    run = simulate(history.system, 0.2, initial=history, outputs=201)
    assert np.abs(run.modal_velocities).max() < 1e-8
    assert np.abs(run.modal_coordinates - history.modal_coordinates[-1]).max() < 1e-9
    assert run.friction_forces[-1] == pytest.approx(history.friction_forces[-1], rel=1e-6,
                                                    abs=1e-9)


def test_rounding_of_sliders_at_their_limits_does_not_matter():
    """Sliders that rounding puts beyond their limits would slide, in many thousands of steps."""
    history = loaded_solid(IwanFriction(6e4, 0.5))
    rest = history.state()
    for part in (-2.0, 0.0, 1.0, 4.0):
        start = replace(rest, slider_force=rest.slider_force * (1.0 + part * 1.1e-16))
        run = simulate(history.system, 1e-2, initial=start, outputs=21)
        assert run.statistics["steps"] < 100


@pytest.mark.parametrize("ratio", [0.82, np.inf])
def test_set_valued_friction_of_solids_holds_what_it_held(ratio):
    history = loaded_solid(ConstantFriction(0.5), tangential_ratio=ratio)
    run = simulate(history.system, 0.2, initial=history.state(), outputs=101,
                   solver=SetValued())
    assert np.abs(run.modal_velocities).max() < 1e-8
    assert np.abs(run.modal_coordinates - history.modal_coordinates[-1]).max() < 1e-9
    assert run.friction_forces[-1] == pytest.approx(history.friction_forces[-1], rel=1e-6,
                                                    abs=1e-8)


def test_ground_below_solids_must_be_where_it_was():
    friction = JenkinsFriction(6e4, 0.5)
    wavy = solid(friction, (0.0, 0.0), ground=Ground(amplitude=1e-6, wave_direction=(0.0, 1.0)))
    path = LoadPath(forces=(-10.0, -10.0, 0.0, 0.0), travel_y=(0.0, 1e-4))
    with pytest.raises(InputError, match=r"has travelled 0, 0\.0001 m in the state at rest, but 0"):
        simulate(wavy, 0.1, initial=load_history(wavy, path))
