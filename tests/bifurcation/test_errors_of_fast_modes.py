"""Errors of orbits with modes as fast as the intervals are wide, or faster."""

from functools import cache

import numpy as np
import pytest
from collocation_fields import settled
from numba import njit
from test_intervals_along_branches import belt, true_error

import fecontact as fc
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.bifurcation.orbits.restored import restored
from fecontact.bifurcation.orbits.state_error import state_error
from fecontact.laws import Constant, ExponentialFriction, RoughSurface


def mode(t, x, p, out):
    # p = [force, angular frequency, damping ratio]; the force has the period 1.
    out[0] = x[1]
    out[1] = p[1] ** 2 * (p[0] / (1.2 + np.cos(2.0 * np.pi * t)) - x[0]) - 2.0 * p[2] * p[1] * x[1]


def response(times, frequency, damping):
    """Displacement and velocity (k, 2) from the Fourier series of the force."""
    grid, k = np.arange(4000) / 4000.0, np.arange(400)
    force = np.fft.rfft(1.0 / (1.2 + np.cos(2.0 * np.pi * grid)))[:400] / 4000.0
    turn = 2.0 * np.pi * k
    terms = force * frequency**2 / (frequency**2 - turn**2 + 2j * damping * frequency * turn)
    waves = np.exp(1j * np.outer(times, turn))
    return np.stack([2.0 * (waves * terms).real.sum(axis=1) - terms[0].real,
                     2.0 * (waves * terms * 1j * turn).real.sum(axis=1)], axis=1)


def stated_and_true(intervals, damping, turn):
    """Errors of a driven mode whose angular frequency is ``turn`` over the mean interval."""
    frequency = turn * intervals
    field = vector_field(mode, {"force": 1.0, "frequency": frequency, "damping": damping}, 2,
                         period=lambda p: 1.0)
    t = np.linspace(0.0, 1.0, 2001)
    point, = orbit_branch(
        field, PeriodicMotion(t, response(t, frequency, damping), period=1.0), "force",
        bounds=(0.5, 1.5), method=Collocation(intervals, state_tolerance=None),
        options=ContinuationOptions(points=1, locate=False, tolerance=1e-6)).points
    orbit = point.orbit(samples=10001)
    exact = response(orbit.times, frequency, damping)
    true = np.max(np.abs(orbit.states - exact) / np.ptp(orbit.states, axis=0))
    return point.values["state_error"], true


@pytest.mark.parametrize(("intervals", "damping", "most"), [
    (24, 0.001, 2.2), (24, 0.01, 2.1), (40, 0.01, 2.1), (40, 0.05, 1.5), (40, 0.2, 1.2),
    (24, 0.7, 1.2), (40, 0.001, 2.1)])
@pytest.mark.parametrize("turn", [1.0, 3.0, 10.0, 30.0, 100.0])
def test_errors_of_a_driven_mode(intervals, damping, most, turn):
    """Beside its Fourier series."""
    stated, true = stated_and_true(intervals, damping, turn)
    assert 0.5 * true <= stated <= most * true


@pytest.mark.parametrize("intervals", [24, 40, 41])
@pytest.mark.parametrize("damping", [0.0005, 0.002, 0.01, *(
    pytest.param(more, marks=pytest.mark.slow) for more in (0.001, 0.005, 0.05))])
def test_vibrations_that_are_left_are_in_step_or_not(intervals, damping):
    """Hardly damped, with a wrong phase, they would look up to 50 times as large."""
    for turn in (0.5, 1.3, 2.0, 2.5, 3.3, 4.0, 5.0, 6.28, 7.0, 8.0):
        stated, true = stated_and_true(intervals, damping, turn)
        assert 0.54 * true <= stated <= 2.1 * true


def on_halves(problem, u):
    """Largest error beside the orbit at the same parameter on twice the intervals."""
    halves = np.sort(np.concatenate([problem.mesh, (problem.mesh[1:] + problem.mesh[:-1]) / 2.0]))
    finer, fine, _ = problem.on_mesh(halves, u, np.zeros_like(u))
    row = np.zeros_like(fine)
    row[-1] = 1.0
    for _ in range(4):
        linearisation = finer.linearise(fine)
        fine = fine - linearisation.solve(row, np.append(linearisation.residual, 0.0))
    times = (problem.mesh[:-1, None] + problem.widths[:, None] * np.linspace(0.0, 1.0, 33)).ravel()
    times = times[times < 1.0]
    one, other = (interpolate(at.mesh, at.nodes(v), times) for at, v in ((problem, u),
                                                                         (finer, fine)))
    low = np.array([1e-2 * problem.scales[: problem.field.dimension], np.ptp(one, axis=0)])
    return float(np.max(np.abs(one - other) / low.max(axis=0)))


@cache
def beam_branch():
    """A steel beam on a belt, 10 nodes and 6 modes, friction of slope 1e4 s/m."""
    mesh = fc.Mesh.grid(np.linspace(0.0, 0.2, 10), np.linspace(0.0, 0.02, 5))
    basis = fc.modal_basis(fc.ElasticBody(mesh, fc.Material.named("steel"), 0.01), 6,
                           contact="bottom", contact_nodes=10, B=(0.0, 0.01), C=(0.1, 0.02),
                           damping=0.01)
    system = fc.ContactSystem(
        basis, normal=RoughSurface(0.3e6, 5.2e-6, 6.0),
        friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e4), ground=fc.Ground(speed=0.5),
        load=fc.Load(normal=14.0),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768, motion_x=Constant(-9.5 / 5610.0)))
    field = contact_field(system, {"ground.speed": 0.5})
    sliding = equilibrium_branch(field, bounds=(2e-3, 0.5), direction=-1.0,
                                 options=ContinuationOptions(step=5e-3, points=300))
    return field, basis.angular_frequencies, orbit_branch(
        field, sliding.of_kind("Hopf")[0], bounds=(2e-3, 0.5), method=Collocation(80),
        options=ContinuationOptions(step=0.01, largest_step=0.05, points=60, locate=False))


def test_errors_of_a_beam():
    """With and without stick; elastic modes turn once to some five or ten times in an interval."""
    field, frequencies, branch = beam_branch()
    # States are accurate, but multipliers of the fastest modes are not; see test_fast_modes.py.
    assert branch.message.startswith("Multipliers of fast modes are not resolved")
    assert branch.message.count(". ") == 1
    assert branch.column("state_error").max() <= 1e-5
    alone = []
    for point in branch.points[4::5]:
        problem, u, _ = restored(field, point)
        true = on_halves(problem, u)
        assert true <= 1e-5
        assert 0.6 * true <= point.values["state_error"] <= 1.9 * true
        alone.append(state_error(problem, u) / true)
        turns = frequencies[3:] * problem.period(u) * np.median(problem.widths)
        assert turns.min() > 0.8
        assert turns.max() > 4.0
    # Each interval for itself shows a third and less of it.
    assert min(alone) < 0.3
    assert max(alone) > 0.8


on_belt = njit(belt)


def carrier(t, x, p, out):
    # A mode on the mass that sticks on its belt: p = [speed, slope, angular frequency].
    on_belt(t, x, p, out)
    out[2] = x[3]
    out[3] = p[2] ** 2 * (x[0] - x[2]) - 0.04 * p[2] * x[3]


@pytest.mark.parametrize("frequency", [10.0, 30.0, 100.0, 300.0])
def test_errors_of_a_mode_that_stick_slip_excites(frequency):
    """Error estimate against twice the intervals; the mode turns 1 to 50 times in an interval."""
    values = {"speed": 1.0, "slope": 100.0, "frequency": frequency}
    field = vector_field(carrier, values, 4)
    t, states = settled(field, 60.0, [2.0, 0.0, 2.0, 0.0], 8.0)
    branch = orbit_branch(field, (t, states), "speed", bounds=(0.5, 1.5),
                          method=Collocation(50), options=ContinuationOptions(points=12))
    for point in branch.points[::4]:
        assert point.values["stable"]
        problem, u, _ = restored(field, point)
        true = on_halves(problem, u)
        assert 0.5 * true <= point.values["state_error"] <= 2.5 * true


def clock(t, x, p, out):
    # Van der Pol's oscillator with a stiffness, and a mode that it drives.
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - p[1] * x[0]
    out[2] = x[3]
    out[3] = 900.0 * (x[0] - x[2]) - 1.2 * x[3]


def test_errors_along_a_curve():
    """Orbits of one period; the mode turns thrice in the mean interval. Beside runs."""
    field = vector_field(clock, {"mu": 1.0, "k": 1.0}, 4)
    branch = orbit_branch(field, settled(field, 60.0, [2.0, 0.0, 2.0, 0.0], 8.0), "mu",
                          bounds=(0.5, 2.0), method=Collocation(60),
                          options=ContinuationOptions(points=1))
    curve = codim2_curve(field, branch.points[0], "k", keep="period", both=False,
                         bounds={"mu": (0.5, 4.0), "k": (0.1, 60.0)})
    assert curve.message == ""
    for point in curve.points[::4]:
        _, error = true_error(point, clock, point.parameter, point.values["k"], periods=12)
        assert error <= 1.1e-5
        assert 0.5 * error <= point.values["state_error"] <= 2.5 * error


def swing(t, x, p, out):
    # p = [force]; symmetric orbits cross a branch of others.
    out[0] = x[1]
    out[1] = p[0] * np.cos(t) - 0.2 * x[1] - x[0] ** 3


def test_error_where_branches_cross():
    """The equations are singular there; on a mesh without the symmetry the orbit is as accurate."""
    field = vector_field(swing, {"force": 0.5}, 2, period=lambda p: 2.0 * np.pi)
    branch = orbit_branch(
        field, settled(field, 60 * 2.0 * np.pi, [0.1, 0.0], 2.0 * np.pi), "force",
        bounds=(0.1, 12.0), method=Collocation(21),
        options=ContinuationOptions(points=150, step=0.02, largest_step=0.1))
    assert branch.message == ""
    crossing, = branch.of_kind("branch point")
    problem, u, _ = restored(field, crossing)
    assert crossing.values["state_error"] <= 2.0 * state_error(problem, u)
    assert branch.column("state_error").max() <= 1e-5
    for point in branch.points[::4]:
        problem, u, _ = restored(field, point)
        true = on_halves(problem, u)
        assert 0.5 * true <= point.values["state_error"] <= 2.0 * true
