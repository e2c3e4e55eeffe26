"""Runs that could not end are refused before they begin."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from set_valued_runs import start_set_valued
from systems import TURN, friction_oscillator, impact_oscillator

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.integrate import Auto, Radau, Rodas5P, Scipy, SetValued
from fecontact.integrate.step_loop import MINIMUM_STEP, RUNNING, STEP

SOLVERS = (Auto(), Rodas5P(), Radau(), Scipy("LSODA"))


@pytest.mark.parametrize("frequency", [1e12, 1e30, 1e60])
def test_periods_without_number_are_refused(frequency):
    for solver in (*SOLVERS, SetValued()):
        for system in (friction_oscillator(), impact_oscillator()):
            if isinstance(solver, SetValued) and not system.ground.speed:
                continue
            with pytest.raises(InputError, match=r"holds .*e\+\d+ periods of the fastest of drive"):
                fc.simulate(system.with_(**{"drive.frequency_hz": frequency / TURN}), 1.0,
                            solver=solver)


def test_waves_under_a_fast_belt_count_too():
    system = friction_oscillator(ground=fc.Ground(speed=1e3, amplitude=1e-9, wavelength=1e-9))
    with pytest.raises(InputError, match="of the fastest of drive, loads, ground and waves of"):
        fc.simulate(system, 1.0)


def test_steps_without_number_are_refused():
    for solver in SOLVERS:
        with pytest.raises(InputError, match=r"holds 1e\+12 steps of max_step of 1e-12 s, but can "
                                             r"have 1e\+09 at most; end it earlier or raise max"):
            fc.simulate(friction_oscillator(), 1.0, solver=solver, max_step=1e-12)


def test_ensembles_refuse_them():
    fast = friction_oscillator().with_(**{"drive.frequency_hz": 1e12 / TURN})
    with pytest.raises(InputError, match="periods of the fastest of drive"):
        fc.ensemble([friction_oscillator(), fast], [0.0, 1.0])


def test_short_runs_of_fast_drives_end():
    """Ten periods of the same drive: the block does not move yet."""
    system = friction_oscillator().with_(**{"drive.frequency_hz": 1e12 / TURN})
    run = fc.simulate(system, 20.0 * np.pi / 1e12, outputs=11)
    assert run.status is fc.Status.FINISHED
    assert np.abs(run.modal_coordinates - run.modal_coordinates[0]).max() < 1e-12


@pytest.mark.parametrize("method", ["event-driven", "time-stepping"])
def test_set_valued_runs_whose_steps_stay_too_short_end_with_a_status(method):
    """Steps of at most 1e-14 s, as where impacts follow each other ever closer."""
    system = friction_oscillator()
    run = start_set_valued(system, np.zeros(system.size), np.linspace(0.0, 1.0, 11), rtol=1e-6,
                       method=method)
    data, = run.loop.args
    slow = data._replace(limits=data.limits._replace(longest=1e-13))
    run = replace(run, loop=partial(run.loop.func, slow))
    run.progress.numbers[STEP] = 1e-13
    status = RUNNING
    while status == RUNNING:
        status = run.advance(7_000)
        assert run.attempts < 100_000
    assert status == MINIMUM_STEP
    assert run.time < 1e-8


def test_times_too_close_for_steps_are_refused():
    system = friction_oscillator()
    with pytest.raises(InputError, match="period = 5e-324 must be a number from 1e-60 to 1e"):
        fc.integrate.strobe([system], transient_periods=3, keep=2, period=5e-324)
    with pytest.raises(InputError, match="the last of the times = 5e-324 is too close to the "):
        fc.ensemble([system], [0.0, 5e-324])
    with pytest.raises(InputError, match="transient = 5e-324 is too close to the start = 0"):
        fc.bifurcation.lyapunov_exponents(system, 1.0, transient=5e-324)
    with pytest.raises(InputError, match=r"number of intervals in duration = 1e\+59 would need"):
        fc.bifurcation.lyapunov_exponents(system, 0.1, interval=1e-60)
