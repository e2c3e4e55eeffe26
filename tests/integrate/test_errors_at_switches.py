"""Errors of steps in which a normal force begins or ends, or friction forgets its memory."""

from pathlib import Path

import numpy as np
import pytest
from systems import mass_in_y

from fecontact import ContactSystem, Drive, Ground, Load, basis_from_matrices, ensemble, simulate
from fecontact.integrate import Rodas5P
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.trajectory import Status
from fecontact.laws import (
    ExponentialFriction,
    Frictionless,
    JenkinsFriction,
    LinearContact,
    RoughSurface,
)

FOLDER = Path(__file__).parents[2] / "benchmarks"
STEPS = Rodas5P()
GRAVITY = 9.81
# Error over the height of the drop.
BOUNCES = 5e-4


@pytest.fixture
def systems(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import random_systems

    return random_systems


def bouncing(w):
    """A unit mass over a spring without mass or damping."""
    return mass_in_y(normal=LinearContact(w**2, 0.0), friction=Frictionless(), load=Load(GRAVITY))


def height(t, w, drop):
    """Height of the mass: parabolas in flight, vibration about the static deflection in contact."""
    v = np.sqrt(2.0 * GRAVITY * drop)
    flight = 2.0 * v / GRAVITY
    contact = 2.0 / w * (np.pi - np.arctan(v * w / GRAVITY))
    since = (t - 0.5 * flight) % (flight + contact)
    pressed = since < contact
    deflection = GRAVITY / w**2 * (1.0 - np.cos(w * since)) + v / w * np.sin(w * since)
    free = since - contact
    return np.where(pressed, -deflection, v * free - 0.5 * GRAVITY * free**2)


def bounces(drop, count=20):
    return np.linspace(0.0, count * 2.0 * np.sqrt(2.0 * drop / GRAVITY), 401)


STARTS = [(w, drop) for w in (300.0, 1000.0, 3000.0) for drop in (1e-3, 3e-3, 1e-2)]


def test_bounces_of_a_mass():
    """Twenty impacts: each may change the energy by a few parts in a million."""
    for w, drop in STARTS:
        times = bounces(drop)
        run = simulate(bouncing(w), times[-1], initial=[drop, 0.0], outputs=times, solver=STEPS)
        assert run.states[:, 0] == pytest.approx(height(times, w, drop), abs=BOUNCES * drop)


def test_bounces_side_by_side():
    """SIMD lanes take the steps of single runs."""
    for w, drop in STARTS[::4]:
        times = bounces(drop)
        alone = driver.start(bouncing(w), np.array([drop, 0.0]), times, rtol=1e-6, work=False,
                             method="rodas5p")
        alone.advance(10**9)
        runs = ensemble(bouncing(w), times, initial=[[drop, 0.0]] * 3, solver=STEPS)
        for states, steps in zip(runs.states, runs.steps, strict=True):
            assert states[:, 0] == pytest.approx(height(times, w, drop), abs=BOUNCES * drop)
            assert steps == pytest.approx(alone.statistics["steps"], rel=0.02)


@pytest.mark.parametrize(("friction", "count", "rtol"), [
    (ExponentialFriction(0.8, 0.5, decay=20.0, smoothing_slope=2e3), 1024, 1e-7),
    (JenkinsFriction(2e4, 0.4), 1, 1e-6)])
def test_corner_of_a_rough_surface(friction, count, rtol):
    """Damping of a rough surface ceases to grow at the roughness height, within a step."""
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = basis_from_matrices(2.0 * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "B": rows, "C": rows})
    system = ContactSystem(
        basis, RoughSurface(2e5, 1e-4, 50.0), friction, ground=Ground(speed=0.05), load=Load(20.0),
        drive=Drive(stiffness_x=2e3, damping_x=1.0, amplitude_x=5e-3, stiffness_y=5e3,
                    damping_y=3.0, amplitude_y=3e-3, frequency_hz=4.0))
    generator = np.random.default_rng(5)
    parts = np.column_stack([generator.uniform(0.5, 2.5, count), generator.uniform(-1, 1, count)])
    if count == 1:
        parts = np.array([[1.8, 1.8]])
    starts = np.zeros((count, system.size))
    starts[:, :2] = np.sqrt(2.0) * parts[:, :1] * [1e-3, 2e-3]
    starts[:, 2] = np.sqrt(2.0) * parts[:, 1] * 0.02
    times = np.linspace(0.0, 0.06, 4)
    found, exact = (ensemble(system, times, initial=starts, rtol=tolerance, solver=STEPS).states
                    for tolerance in (rtol, 1e-10))
    sizes = np.ptp(exact, axis=(0, 1))[:4]
    assert (np.abs(found - exact)[..., :4] / sizes).max() < 5.0 * rtol


@pytest.mark.parametrize("number", [54, 55, 83])
def test_memory_after_lift_off(systems, number):
    """Internal variables fade within 1e-7 s once a contact has opened."""
    case = systems.random_case(number)
    times = np.append(np.linspace(0.0, 0.01, 41), 1.5)
    run = systems.fc.simulate(case.system, 1.5, initial=case.state, outputs=times, rtol=1e-8)
    assert run.status is Status.FINISHED
    wanted = systems.reference(case, times[:-1])
    assert systems.distance(case, run.states[:-1], wanted) < 1e-6
