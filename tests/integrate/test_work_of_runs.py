"""Work that steps could lose: of jumps that coincide, of creep, of runs that begin at rest."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from systems import mass_in_plane

import fecontact as fc
from fecontact import Drive, Ground, simulate
from fecontact.integrate import CVODE, Radau, Rodas5P, Scipy, SetValued, TimeStepping
from fecontact.integrate.run_limits import energy_scale
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    PrescribedForce,
    Step,
    signal,
)

STEPS = Rodas5P()
LONG = Radau()
SOLVERS = [STEPS, LONG, SetValued(), TimeStepping(), SetValued(restitution=0.5),
           Scipy("Radau"), Scipy("LSODA"), CVODE()]
NAMES = ["rodas5p", "collocation", "events", "stepping", "stops", "radau", "lsoda", "cvode"]


# Jumps -------------------------------------------------------------------------------------------

def pulled(first, second):
    """A free mass on the drive's springs, whose other ends jump by 1 mm and 2 mm."""
    return mass_in_plane(
        2.0, normal=LinearContact(1e3), friction=ConstantFriction(0.0), gap=1.0,
        drive=Drive(stiffness_x=800.0, stiffness_y=200.0, motion_x=Step(first, 1e-3),
                    motion_y=Step(second, 2e-3)))


@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
@pytest.mark.parametrize(("first", "second", "begin", "end"), [
    (0.3, 0.3, 0.0, 1.0),
    (0.3, 0.1 + 0.2, 0.0, 1.0),
    (0.1 + 0.2, 0.3, 0.0, 1.0),
    (0.3 + 8 * np.spacing(0.3), 0.3, 0.0, 1.0),
    (0.3, 0.1 + 0.2, 0.3, 1.0),
    (0.1 + 0.2, 0.1 + 0.2, 0.3, 1.0),
    (0.3, 0.3, 0.3, 1.0),
    (0.3, 0.3 - np.spacing(0.3), 0.0, 0.3),
    (0.3, 0.3, 0.0, 0.1 + 0.2),
    (0.3, 0.3, 0.0, 0.3),
    (0.3, 0.5, 0.0, 0.1 + 0.2),
], ids=str)
@pytest.mark.parametrize("outputs", [[], [0.3], [0.1 + 0.2]], ids=["apart", "first", "second"])
def test_jumps_that_only_rounding_tells_apart_both_do_work(first, second, begin, end, solver,
                                                           outputs):
    """c a^2 / 2 each, as the mass is at rest before; then it swings about the new places.

    What has jumped when the run begins is no work of it.
    """
    system = pulled(first, second)
    times = np.union1d(np.linspace(begin, end, 21), [t for t in outputs if begin < t < end])
    run = simulate(system, end, t_start=begin, initial=np.zeros(4), outputs=times, rtol=1e-8,
                   solver=solver)
    wanted = sum(0.5 * c * shift**2 * ((times >= at) & (at > begin)) for c, shift, at in (
        (800.0, 1e-3, first), (200.0, 2e-3, second)))
    assert run.work[:, 0] == pytest.approx(wanted, rel=1e-12, abs=1e-16)
    close = 1e-7 if isinstance(solver, Rodas5P) else 1e-5
    assert run.energies.imbalance < close
    for axis, (at, shift, w) in enumerate(((first, 1e-3, 20.0), (second, 2e-3, 10.0))):
        since = np.maximum(times - at, 0.0)
        assert run.displacement("B")[:, axis] == pytest.approx(
            shift * (1.0 - np.cos(w * since)), abs=10.0 * close * shift)


@signal
def _later(t, p):
    return (p[1] if t > p[0] else 0.0), 0.0


class Later(Step):
    """A step that has not yet happened at its own time."""

    kernel = _later


@pytest.mark.parametrize("kind", [Step, Later])
@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_runs_do_not_depend_on_where_they_are_divided(kind, solver):
    """Jumps at 0.3 s while the mass moves: work, state and balance of one run and of two."""
    system = pulled(0.1, 0.3).with_(drive=Drive(
        stiffness_x=800.0, stiffness_y=200.0, motion_x=kind(0.3, 1e-3),
        motion_y=Step(0.1, 2e-3)))
    start = np.array([1e-3, 0.0, 0.02, 0.0])
    whole, first = (simulate(system, end, initial=start, outputs=4, rtol=1e-8, solver=solver)
                    for end in (0.9, 0.3))
    second = simulate(system, 0.9, t_start=0.3, initial=first.states[-1], outputs=3, rtol=1e-8,
                      solver=solver)
    close = 1e-6 if isinstance(solver, Rodas5P) else 2e-5
    scale = np.abs(whole.work).max()
    assert whole.work[1, 0] == pytest.approx(first.work[-1, 0], rel=1e-5)
    assert first.work[-1, 0] + second.work[-1, 0] == pytest.approx(
        whole.work[-1, 0], abs=close * scale)
    assert second.states[-1] == pytest.approx(
        whole.states[-1], abs=close * np.abs(whole.states).max())
    for run in (whole, first, second):
        assert run.energies.imbalance < close


# Creep -------------------------------------------------------------------------------------------

MASS, SPRING, FORCE, SPEED, LAW = 5.632, 5610.0, 14.0, 1e-3, (0.8, 0.55, 1000.0, 1e6)


def friction(v):
    static, kinetic, decay, slope = LAW
    mu = kinetic + (static - kinetic) * np.exp(-decay * abs(v))
    return mu * FORCE * 2.0 / np.pi * np.arctan(slope * v)


def creep_by_radau(times):
    """Work in creep at times: losses between the moments at which slip is that of most force."""
    rise = 1e-12
    limit = brentq(lambda v: friction(v + rise) - friction(v - rise), 1e-6, 1e-3, xtol=1e-12)

    def rates(t, y):
        slip = y[1] - SPEED
        return [y[1], (-SPRING * y[0] - friction(slip)) / MASS, friction(slip) * slip]

    def forth(t, y):
        return y[1] - SPEED - limit

    def back(t, y):
        return y[1] - SPEED + limit

    run = solve_ivp(rates, (times[0], times[-1]), np.zeros(3), "Radau", rtol=1e-10,
                    atol=[1e-15, 1e-15, 1e-15], events=(forth, back), dense_output=True)
    ends = np.concatenate([times[:1], *run.t_events, times])
    ends = np.unique(ends)
    inner = run.sol(0.5 * (ends[1:] + ends[:-1]))[1] - SPEED
    parts = np.diff(run.sol(ends)[2]) * (np.abs(inner) < limit)
    return np.append(0.0, np.cumsum(parts))[np.searchsorted(ends, times)], run.sol(times)[2]


@pytest.fixture(scope="module")
def creep():
    times = np.linspace(0.0, 2.6, 27)
    return times, *creep_by_radau(times)


def on_a_belt():
    row = [[1.0], [0.0], [0.0]]
    basis = fc.basis_from_matrices([[MASS]], [[SPRING]], {"contact": [row], "B": row, "C": row})
    return fc.ContactSystem(basis, normal=PrescribedForce(FORCE),
                            friction=ExponentialFriction(*LAW), ground=Ground(speed=SPEED))


@pytest.mark.parametrize(("solver", "rtol", "error"), [
    (STEPS, 1e-6, 1e-4), (STEPS, 1e-8, 1e-6), (LONG, 1e-8, 1e-6)])
def test_work_of_creep(creep, solver, rtol, error):
    """At stick-slip: by an integrator that ends its steps where creep begins and ends."""
    times, wanted, lost = creep
    run = simulate(on_a_belt(), times[-1], initial=np.zeros(2), outputs=times, rtol=rtol,
                   solver=solver)
    assert 0.001 < wanted[-1] / lost[-1] < 0.9
    assert run.node_friction_work[:, 0] == pytest.approx(lost, abs=error * lost[-1])
    assert run.node_creep_work[:, 0] == pytest.approx(wanted, abs=error * wanted[-1])
    assert (np.diff(run.node_creep_work[:, 0]) >= 0.0).all()


# Scale of energies -------------------------------------------------------------------------------

def test_energies_have_a_finite_scale():
    """At rest without loads that of the mass at the velocity scale of friction, 1 um/s."""
    system = on_a_belt()
    assert energy_scale(system, np.zeros(2)) == pytest.approx(0.5 * MASS * 1e-12)
    assert energy_scale(system, np.array([0.0, 1e-3])) == pytest.approx(0.5e-6)


@pytest.mark.parametrize("solver", [STEPS, LONG], ids=["rodas5p", "collocation"])
def test_work_from_rest_without_loads_is_controlled(solver):
    """A run that begins with no energy at all, and gets it from the belt."""
    run = simulate(on_a_belt(), 5.0, initial=np.zeros(2), outputs=2, rtol=1e-6, solver=solver)
    assert run.energies.growth < 3e-6
    assert run.statistics["steps"] < 400
