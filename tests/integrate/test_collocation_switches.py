"""Steps by collocation that must not become short: breaks, bilateral laws, nodes at rest, NaN."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from systems import TURN, friction_oscillator, mass_in_plane, mass_in_y

import fecontact as fc
from fecontact import ContactSystem, Drive, Ground, Load, PointLoad, simulate
from fecontact.integrate import Radau, Rodas5P, step_loop
from fecontact.integrate.collocation import tableau
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.state import WORST_NODE
from fecontact.integrate.step_loop import REJECTIONS
from fecontact.laws import (
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    NormalLaw,
    PerNode,
    PrescribedForce,
    Pulse,
    RoughSurface,
    Step,
    TwoSidedStop,
    normal_law,
)

NEVER = Rodas5P()
# Attempts after which a run counts as one that never ends.
ENOUGH = 20_000


def ended(system, state, times, rtol=1e-8, method="radau", **options):
    """A run that must end by itself, and how it did."""
    run = driver.start(system, np.array(state), np.array(times), rtol=rtol, method=method,
                       **options)
    return run, run.advance(ENOUGH)


# Breaks ------------------------------------------------------------------------------------------

def loaded(*begins):
    return friction_oscillator(2).with_(load=Load(14.0, forces=tuple(
        PointLoad("B", "x", signal=Step(begin, 1.0)) for begin in begins)))


@pytest.mark.parametrize("method", ["radau", "rodas5p"])
@pytest.mark.parametrize("later", [0.1 + 0.2, 0.3 + 8 * np.spacing(0.3)])
def test_breaks_a_rounding_apart_are_one(later, method):
    times = np.linspace(0.0, 0.6, 13)
    system = loaded(0.3, later)
    assert len(system.breakpoints(0.0, 1.0)) == 2
    run, status = ended(system, np.zeros(4), times, method=method)
    same, _ = ended(loaded(0.3, 0.3), np.zeros(4), times, method=method)
    assert status == step_loop.FINISHED
    scale = np.abs(same.states).max(axis=0)
    assert np.abs(run.states - same.states).max() < 1e-6 * scale.max()
    assert run.attempts < same.attempts + 100


@pytest.mark.parametrize("begin", [1e-16, 0.6 - np.spacing(0.5), 0.6 - 3e-15])
def test_breaks_at_both_ends(begin):
    run, status = ended(loaded(begin), np.zeros(4), np.linspace(0.0, 0.6, 4))
    same, _ = ended(loaded(0.0 if begin < 0.1 else 1.0), np.zeros(4), run.times)
    assert status == step_loop.FINISHED
    assert run.states == pytest.approx(same.states, rel=1e-6, abs=1e-9)


def test_breaks_beside_outputs_of_derivatives():
    """Steps with derivatives end at output times, one of which is 0.1 + 0.2 here."""
    times = np.linspace(0.0, 0.4, 5)
    assert 0.0 < times[3] - 0.3 < 1e-15
    found = []
    for begin in (0.3, times[3]):
        run = driver.start(loaded(begin), np.zeros(4), times, rtol=1e-6, vary=True)
        assert run.advance(ENOUGH) == step_loop.FINISHED
        found.append(run.variation.transitions[-1])
    assert found[0] == pytest.approx(found[1], rel=1e-4, abs=1e-4 * np.abs(found[1]).max())


def test_two_loads_that_begin_together():
    """A step of a rounding between two breaks took the length of all later ones with it."""
    system = friction_oscillator(2).with_(load=Load(14.0, forces=(
        PointLoad("B", "x", signal=Step(0.3, 1.0)),
        PointLoad("B", "x", signal=Pulse("rectangle", 2.0, 0.2, 0.1)))))
    run, status = ended(system, np.zeros(4), np.linspace(0.0, 1.0, 11))
    assert status == step_loop.FINISHED
    assert run.attempts < 8000


def test_steps_have_a_least_length():
    """At t = 1e10 s a period of 6e-5 s is no longer resolved to 1e-14 of the time."""
    system = mass_in_y(spring=1e10, normal=LinearContact(1e3), friction=ConstantFriction(0.0),
                       gap=1.0)
    run, status = ended(system, [1e-3, 0.0], [1e10, 1e10 + 1.0])
    assert status == step_loop.MINIMUM_STEP
    assert run.time < 1e10 + 0.1


# Switches ----------------------------------------------------------------------------------------

@pytest.mark.parametrize("law", [
    BilateralPolynomial(1e4, 1e10, 1.0, 3.0, 0.0), BilateralPiecewise((-1e-3, 1e-3), (-20.0, 20.0)),
    BilateralPiecewise((-1e-4, -1e-5, 0.0, 2e-5, 1e-4), (-50.0, -3.0, 0.0, 1.0, 30.0)),
])
def test_bilateral_laws(law):
    system = friction_oscillator(2).with_(normal=law)
    state, times = np.array([1e-3, 1e-3, 0.0, 0.05]), np.linspace(0.0, 0.3, 31)
    options = {"initial": state, "outputs": times}
    run, status = ended(system, state, times)
    assert status == step_loop.FINISHED
    steps = simulate(system, 0.3, rtol=1e-8, solver=NEVER, **options)
    tight = simulate(system, 0.3, rtol=1e-11, solver=NEVER, **options)
    assert run.attempts < steps.statistics["steps"]
    scale = np.abs(tight.states).max(axis=0)
    assert (np.abs(run.states - tight.states) / scale).max() < 1e-6


def rotated(angle=0.7, **parts):
    """A block whose two rigid modes are neither along the ground nor across."""
    T = np.zeros((3, 3, 2))
    T[:, 0] = 0.4 * np.cos(angle), -0.4 * np.sin(angle)
    T[:, 1] = 0.4 * np.sin(angle), 0.4 * np.cos(angle)
    basis = fc.ModalBasis(np.zeros(2), np.zeros((2, 2)), T, np.zeros((3, 2)), np.ones(1))
    return ContactSystem(basis, **{
        "friction": ExponentialFriction(0.8, 0.55, 1000.0, 1e4), "ground": Ground(),
        "load": Load(14.0), **parts})


RESTS = {
    "rough": (rotated(normal=RoughSurface(10e6, 10e-6, 40.0), drive=Drive(
        stiffness_x=500.0, damping_x=1.0, stiffness_y=500.0, damping_y=1.0)), np.zeros(4), 20.0),
    "springs": (rotated(normal=LinearContact(1e5, 10.0), drive=Drive(
        stiffness_x=500.0, stiffness_y=500.0)), np.zeros(4), 12.0),
    "shaken": (rotated(normal=LinearContact(1e5, 10.0), drive=Drive(
        stiffness_y=500.0, amplitude_y=1e-4, frequency_hz=100.0 / TURN)), np.zeros(4), 1.0),
    "prescribed": (rotated(normal=PrescribedForce(5.0), load=Load(), drive=Drive(
        stiffness_x=500.0, stiffness_y=500.0)), [1e-4, 0.0, 0.0, 0.01], 10.0),
    "open": (mass_in_y(normal=LinearContact(1e5, 100.0), friction=ConstantFriction(0.0)),
             [0.0, 0.0], 10.0),
}


@pytest.mark.parametrize("name", RESTS)
def test_rounding_does_not_switch(name):
    system, state, end = RESTS[name]
    times = np.linspace(0.0, end, 101)
    run, status = ended(system, state, times, method="radau")
    assert run.collocation is not None
    assert status == step_loop.FINISHED
    steps, _ = ended(system, state, times, method="rodas5p")
    assert run.attempts < 1.5 * steps.attempts + 20
    tight = simulate(system, end, initial=np.array(state), outputs=times, solver=NEVER, rtol=1e-11)
    scale = np.maximum(np.abs(tight.states).max(axis=0), 1e-12)
    assert (np.abs(run.states - tight.states) / scale).max() < 1e-5


# Failures ----------------------------------------------------------------------------------------

@pytest.mark.parametrize(("stiffness", "start"), [(1e5, -1e300), (1e5, -1e306), (1e10, -1e300)])
@pytest.mark.parametrize("work", [True, False])
def test_runs_beyond_all_numbers(stiffness, start, work):
    """Steps by collocation and of Rodas5P say the same of a motion beyond all numbers."""
    system = mass_in_y(normal=LinearContact(stiffness), load=Load(9.81),
                       friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e4))
    for method in ("radau", "rodas5p"):
        run, status = ended(system, [start, 0.0], np.linspace(0.0, 1e-3, 11), work=work,
                            method=method)
        assert (run.collocation is not None) == (method == "radau")
        assert status == step_loop.NOT_FINITE


def test_the_node_that_shortens_steps():
    """Only the second of two nodes is pressed."""
    T = np.zeros((4, 3, 2))
    T[:, 0, 0] = T[:, 1, 1] = 0.4
    basis = fc.ModalBasis(np.zeros(2), np.zeros((2, 2)), T, np.zeros((4, 2)), np.full(2, 0.5))
    drive = Drive(stiffness_x=500.0, amplitude_x=0.1, frequency_hz=20.0 / TURN)
    for forces in ((0.0, 5.0), (5.0, 0.0)):
        system = ContactSystem(basis, normal=PrescribedForce(forces), drive=drive,
                               friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e8))
        run, status = ended(system, np.zeros(4), np.linspace(0.0, 1.0, 11))
        assert status == step_loop.FINISHED
        assert run.progress.counts[REJECTIONS] > 0
        assert run.progress.numbers[WORST_NODE] == (forces[0] == 0.0)


@normal_law
def _torn(u, v, p):
    """No force, except that it is not a number in a gap between two stages of a step."""
    if p[0] < u < p[1]:
        return math.nan, 0.0, 0.0
    return 0.0, 0.0, 0.0


@dataclass(frozen=True)
class Torn(NormalLaw):
    kernel: ClassVar = _torn
    low: PerNode = 0.0
    high: PerNode = 0.0

    @property
    def penetration_scale(self):
        return 100.0


@pytest.mark.parametrize("work", [True, False])
def test_what_is_not_a_number_is_an_error(work):
    """A mass falls at 1 m/s; where the error of a step is looked for its force is NaN."""
    h, place = 0.01, tableau.PLACES[0]
    assert tableau.POINTS[0] < place - 0.01 < place + 0.01 < tableau.POINTS[1]
    times, quiet = [0.0, 2.0], mass_in_y(normal=Torn(9.0, 9.0), friction=ConstantFriction(0.0))
    run, _ = ended(quiet, [0.0, -1.0], times, work=work, max_step=h)
    assert run.progress.counts[REJECTIONS] == 0
    # Where a step in the middle of that run begins.
    part = driver.start(quiet, np.array([0.0, -1.0]), np.array(times), rtol=1e-8, work=work,
                        method="radau", max_step=h)
    part.advance(100)
    begin = part.time
    torn = quiet.with_(normal=Torn(begin + (place - 0.01) * h, begin + (place + 0.01) * h))
    run, _ = ended(torn, [0.0, -1.0], times, work=work, max_step=h)
    assert run.progress.counts[REJECTIONS] > 0


# Open nodes --------------------------------------------------------------------------------------

@pytest.mark.parametrize("normal", [LinearContact(1e5), TwoSidedStop(1e5, 2.0),
                                    TwoSidedStop(1e5, 2.0, 2.0, 0.1),
                                    BilateralPlay(1e5, 1.0, shortening=-1.0)],
                         ids=["open", "gap", "damped", "play"])
@pytest.mark.parametrize("speed", [0.0, 1e-3])
def test_nodes_in_a_gap_end_no_steps(normal, speed):
    """Two oscillators: slip that turns, and depths of a law that does not act, are no matter."""
    system = mass_in_plane(normal=normal, gap=1.0, ground=Ground(speed=speed), drive=Drive(
        stiffness_x=100.0, stiffness_y=100.0, amplitude_x=0.01, amplitude_y=0.01,
        frequency_hz=7.0 / TURN))
    run = simulate(system, 20.0, initial=np.array([0.1, 0.05, 0.0, 0.0]), outputs=21, rtol=1e-8,
                   solver=Radau())
    share = 0.01 * 100.0 / (100.0 - 49.0)
    for start, x in zip((0.1, 0.05), run.displacement("B").T, strict=False):
        wanted = (start * np.cos(10.0 * run.time) + share * (
            np.sin(7.0 * run.time) - 0.7 * np.sin(10.0 * run.time)))
        assert x == pytest.approx(wanted, abs=1e-8)
    assert run.statistics["rejected"] < 15
    assert run.statistics["steps"] < 550
