"""Runs by power series: many nodes, moving ground, stiff starts, stops without a clearance."""

import numpy as np
import pytest
from systems import impact_oscillator, mass_in_y

from fecontact import ContactSystem, Ground, Load, ModalBasis, Status, simulate
from fecontact.integrate import Auto, ContactEvents, PowerSeries, Rodas5P, step_loop
from fecontact.integrate.rodas5p import driver
from fecontact.laws import ConstantFriction, LinearContact, SpeedRamp, TwoSidedStop

SERIES, STEPS = PowerSeries(), Rodas5P()
FRICTIONLESS = ConstantFriction(0.0)


def bouncing(nodes):
    """A mass on nodes that share a linear spring."""
    T = np.zeros((2 + nodes, 3, 1))
    T[:, 1] = 1.0
    basis = ModalBasis(np.zeros(1), np.zeros((1, 1)), T, np.zeros((2 + nodes, 2)),
                       np.full(nodes, 1.0 / nodes))
    return ContactSystem(basis, normal=LinearContact(1e5), friction=FRICTIONLESS,
                         load=Load(normal=9.81))


def test_more_nodes_than_coefficients():
    times, start = np.linspace(0.0, 0.5, 51), np.array([0.01, 0.0])
    runs = [driver.start(bouncing(nodes), start, times, rtol=1e-8, method="power-series")
            for nodes in (1, 60)]
    assert runs[1].series.line.shape[1] >= 60
    for run in runs:
        assert run.advance(10**5) == step_loop.FINISHED
    assert runs[1].states == pytest.approx(runs[0].states, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("solver", [Auto(), STEPS])
def test_slip_on_ground_that_starts_late(solver):
    system = mass_in_y(normal=LinearContact(1e5), friction=FRICTIONLESS, load=Load(normal=9.81),
                       ground=Ground(speed=0.0, motion=SpeedRamp(1.0, 2.0, 0.5)))
    run = simulate(system, 4.0, solver=solver, events=ContactEvents(stop="slip"))
    assert run.status is Status.EVENT
    assert run.time[-1] == pytest.approx(2.0, abs=1e-3)
    # A run that ends before the ground moves has no slip to look for.
    still = simulate(system, 1.5, solver=SERIES, events=ContactEvents(stop="slip"))
    assert still.status is Status.FINISHED


@pytest.mark.parametrize("end", [400.0, 600.0, 1e5])
def test_a_first_step_that_is_short_for_the_run(end):
    """One gram, 1 mm deep in a stiff spring, leaves it with the speed that this stores."""
    mass, stiffness, depth = 1e-3, 1e6, 1e-3
    system = mass_in_y(mass, normal=LinearContact(stiffness), friction=FRICTIONLESS)
    start = np.array([-depth * np.sqrt(mass), 0.0])
    run = driver.start(system, start, np.array([0.0, end]), rtol=1e-8, method="power-series")
    assert run.advance(10**5) == step_loop.FINISHED
    speed = depth * np.sqrt(stiffness / mass) * np.sqrt(mass)
    assert run.states[-1, 1] == pytest.approx(speed, rel=1e-9)


def test_stops_without_a_clearance_are_a_spring():
    system = mass_in_y(normal=TwoSidedStop(1e4, 0.0), friction=FRICTIONLESS)
    times = np.linspace(0.0, 1.0, 101)
    for solver in (SERIES, STEPS):
        run = simulate(system, 1.0, initial=np.array([1e-3, 0.0]), outputs=times, solver=solver,
                       rtol=1e-10, events=ContactEvents())
        assert len(run.events) == 0
        assert run.states[:, 0] == pytest.approx(1e-3 * np.cos(100.0 * times), abs=1e-9)
    law = TwoSidedStop([1e4, 1e4], [0.0, 1e-5])
    assert law.pieces(np.ones(2)) is None
    assert TwoSidedStop(1e4, 1e-5).pieces(np.ones(1)).shape[1] == 3


def test_statistics_and_parts_of_runs():
    run = simulate(impact_oscillator(2), 1.0, initial=np.zeros(4), outputs=11, solver=SERIES,
                   events=ContactEvents())
    assert run.statistics["expansions"] >= run.statistics["steps"] > 0
    assert "series" not in run.statistics
    part = run.between(0.3, 0.7)
    kept = (run.events.time >= 0.3) & (run.events.time <= 0.7)
    assert 0 < len(part.events) < len(run.events)
    assert (part.events.time == run.events.time[kept]).all()
    assert (part.events.states == run.events.states[kept]).all()
    assert (part.events.node == run.events.node[kept]).all()
    assert len(part.events.kind) == kept.sum()
    assert simulate(impact_oscillator(2), 0.1, initial=np.zeros(4)).between(0.05).events is None
