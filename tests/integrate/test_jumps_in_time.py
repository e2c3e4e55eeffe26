"""Signals that jump or turn steep, in runs with closed-form answers and few steps."""

import numpy as np
import pytest
from set_valued_runs import integrate_set_valued

import fecontact as fc
from fecontact import Trajectory
from fecontact.integrate import Rodas5P, Scipy, SetValued
from fecontact.laws import (
    ConstantFriction,
    PrescribedForce,
    RoughSurface,
    Step,
    Tabulated,
)

MASS, STIFFNESS, AT, FORCE = 2.0, 800.0, 0.3, 5.0


def point(dashpot=0.0, load=None, motion=None):
    """A mass on the drive's spring and dashpot, moving along x alone, without friction."""
    row = [[1.0], [0.0], [0.0]]
    basis = fc.basis_from_matrices([[MASS]], [[0.0]], {"contact": [row], "B": row, "C": row})
    loads = () if load is None else (fc.PointLoad("C", "x", signal=load),)
    return fc.ContactSystem(
        basis, normal=PrescribedForce(1e-12), friction=ConstantFriction(0.0),
        load=fc.Load(0.0, loads), drive=fc.Drive(stiffness_x=STIFFNESS, damping_x=dashpot,
                                                 motion_x=motion))


def response(times, dashpot):
    """Displacement over the static one after a step of the force."""
    w0 = np.sqrt(STIFFNESS / MASS)
    D = dashpot / (2.0 * MASS * w0)
    wd, s = w0 * np.sqrt(1.0 - D**2), np.maximum(times - AT, 0.0)
    return 1.0 - np.exp(-D * w0 * s) * (np.cos(wd * s) + D * w0 / wd * np.sin(wd * s))


TIMES = np.union1d(np.linspace(0.0, 1.0, 101), [AT])


@pytest.mark.parametrize("solver", [Rodas5P(), SetValued(), Scipy("Radau"),
                                    Scipy("BDF"), Scipy("LSODA")], ids=lambda s: s.name)
@pytest.mark.parametrize("dashpot", [0.0, 10.0])
@pytest.mark.parametrize("kind", ["load", "drive"])
def test_step_response(solver, dashpot, kind):
    """Without damping up to twice the static displacement."""
    static = FORCE / STIFFNESS
    system = point(dashpot, **({"load": Step(AT, FORCE)} if kind == "load" else
                               {"motion": Step(AT, static)}))
    ours = not isinstance(solver, Scipy)
    rtol = 1e-8 if ours else 1e-9
    run = fc.simulate(system, TIMES[-1], initial=np.zeros(2), outputs=TIMES, rtol=rtol,
                      solver=solver)
    x = run.displacement("B")[:, 0] / static
    assert x == pytest.approx(response(TIMES, dashpot), abs=1e-5 if rtol == 1e-9 else 1e-6)
    assert (TIMES <= AT).sum() == (np.abs(x) < 1e-12).sum()
    if dashpot == 0.0:
        assert x.max() == pytest.approx(2.0, rel=1e-2)
    if ours:
        assert run.statistics["steps"] < 400
    energies = run.energies
    assert np.abs(energies.imbalance).max() < 1e-4 * STIFFNESS * static**2


@pytest.mark.parametrize("method", ["event-driven", "time-stepping"])
def test_step_response_of_set_valued_schemes(method):
    system = point(10.0, load=Step(AT, FORCE))
    run = integrate_set_valued(system, np.zeros(2), TIMES, rtol=1e-6, method=method)
    x = run.states[:, 0] * system.basis.T[0, 0, 0] * STIFFNESS / FORCE
    assert x == pytest.approx(response(TIMES, 10.0), abs=1e-4)
    m = system.basis.modes
    whole = Trajectory(system, run.time, run.states[:, :m], run.states[:, m:], run.work)
    assert np.abs(whole.energies.imbalance).max() < 1e-4 * run.work[-1, 3]


def test_a_sticking_mass_breaks_away_at_the_step():
    """Held by friction of 1 N until a force of 3 N comes; then it slides with the rest of it."""
    row = [[1.0], [0.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [row], "B": row, "C": row})
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(2.0), friction=ConstantFriction(0.5),
        load=fc.Load(0.0, (fc.PointLoad("C", "x", signal=Step(AT, 3.0)),)))
    for method in ("event-driven", "time-stepping"):
        run = integrate_set_valued(system, np.zeros(2), TIMES, rtol=1e-8, method=method)
        since = np.maximum(TIMES - AT, 0.0)
        assert run.states[:, 0] == pytest.approx(since**2, abs=1e-8)
        assert run.statistics["steps"] < 300


@pytest.mark.parametrize("solver", [Rodas5P(), SetValued()], ids=lambda s: s.name)
def test_one_steep_piece_does_not_shorten_all_steps(solver):
    """A load that jumps within a microsecond, in a run of 100 s at rest."""
    force = Tabulated((0.0, 50.0, 50.000001, 100.0), (0.0, 0.0, FORCE, FORCE))
    smooth = Tabulated(np.append(np.linspace(0.0, 50.0, 51),
                                    np.linspace(50.000001, 100.0, 50)),
                          np.append(np.zeros(51), np.full(50, FORCE)), interpolation="cubic")
    for signal in (force, smooth):
        run = fc.simulate(point(20.0, load=signal), 100.0, initial=np.zeros(2), outputs=3,
                          rtol=1e-6, solver=solver)
        assert run.displacement("B")[-1, 0] == pytest.approx(FORCE / STIFFNESS, rel=1e-2)
        assert run.statistics["steps"] < 6000


def test_from_rest_under_point_loads():
    """A rough surface of nanometres, hardly touched, does not set the scale of the motion."""
    row = [[1.0], [0.0], [0.0]]
    basis = fc.basis_from_matrices([[1.0]], [[1e4]], {"contact": [row], "C": row},
                                   damping=[[5.0]])
    system = fc.ContactSystem(
        basis, normal=RoughSurface(1e6, 1e-9, 0.0), friction=ConstantFriction(0.5),
        load=fc.Load(0.0, (fc.PointLoad("C", "x", signal=Step(10.0, 3e3)),)))
    times = np.union1d(np.linspace(0.0, 100.0, 101), np.linspace(10.0, 11.0, 101))
    run = integrate_set_valued(system, np.zeros(2), times, rtol=1e-6)
    s, w = np.maximum(times - 10.0, 0.0), np.sqrt(1e4 - 2.5**2)
    wanted = 0.3 * (1.0 - np.exp(-2.5 * s) * (np.cos(w * s) + 2.5 / w * np.sin(w * s)))
    assert run.states[:, 0] == pytest.approx(wanted, abs=1e-5)
    assert run.statistics["steps"] < 5000
