"""Set-valued friction at many nodes of a finite-element beam."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from set_valued_runs import integrate_set_valued

from fecontact import (
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    Status,
    Trajectory,
    equilibrium,
    modal_basis,
    simulate,
)
from fecontact.integrate import Scipy
from fecontact.laws import ExponentialFriction, RoughSurface

TIMES = np.linspace(0.0, 0.01, 201)


@pytest.fixture(scope="module")
def basis():
    body = ElasticBody(rectangle(0.2, 0.02, 39, 4), Material(), 0.01)
    return modal_basis(body, 20, contact="bottom", contact_nodes=40, B=(0.0, 0.01), C=(0.1, 0.02),
                       damping=0.01)


def beam(basis, slope=1e6):
    """Free steel beam with 40 nodes on a belt, pulled back by a spring at its left end."""
    return ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0), load=Load(14.0),
        friction=ExponentialFriction(0.8, 0.55, 1e3, smoothing_slope=slope),
        ground=Ground(speed=0.01),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768))


def velocity_of_b(basis, states):
    return states[:, basis.modes : 2 * basis.modes] @ basis.T[0, 0]


@pytest.fixture(scope="module")
def reference(basis):
    system = beam(basis)
    state = equilibrium(system).state
    run = integrate_set_valued(system, state, TIMES, rtol=1e-6)
    return state, run


def test_run_and_balance(basis, reference):
    _, run = reference
    system, m = beam(basis), basis.modes
    assert run.status is Status.FINISHED
    assert run.statistics["method"] == "time-stepping"
    trajectory = Trajectory(system, run.time, run.states[:, :m], run.states[:, m:], run.work)
    assert trajectory.energies.imbalance < 1e-4
    # Friction is within the limit of stick, in its sense, and slip only takes energy.
    assert (np.abs(run.friction_force) <= 0.8 * run.normal_force * (1.0 + 1e-3)).all()
    assert (np.diff(run.node_friction_work, axis=0) > -1e-12).all()
    slip = trajectory.slip_velocity
    held = np.abs(run.friction_force) < 0.79 * run.normal_force
    pressed = run.normal_force > 1e-3
    late = run.time > 2e-4
    assert np.median(np.abs(slip[late][(held & pressed)[late]])) < 1e-3


def test_coarser_tolerance(basis, reference):
    state, run = reference
    coarse = integrate_set_valued(beam(basis), state, TIMES, rtol=1e-4)
    fine = velocity_of_b(basis, run.states)
    error = np.abs(velocity_of_b(basis, coarse.states) - fine).max() / np.abs(fine).max()
    assert error < 5e-3


def test_smoothed_runs_approach_it(basis, reference):
    state, run = reference
    exact, errors = velocity_of_b(basis, run.states), []
    for slope in (1e4, 1e5, 1e6):
        smooth = simulate(beam(basis, slope), TIMES[-1], initial=state, outputs=TIMES,
                          solver=Scipy("LSODA"))
        errors.append(np.abs(smooth.velocity("B")[:, 0] - exact).max() / np.abs(exact).max())
    assert errors[0] > 1.7 * errors[1] > 2.9 * errors[2]
    assert errors[2] < 3e-3


def test_events_need_independent_slip_velocities(basis, reference):
    with pytest.raises(InputError, match="40 different ones depend on fewer modes"):
        integrate_set_valued(beam(basis), reference[0], TIMES, method="event-driven")
