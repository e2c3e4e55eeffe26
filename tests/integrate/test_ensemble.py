"""Many runs in one call: the numbers of single runs, strobed motion, chains, bad input."""

import numpy as np
import pytest
from systems import TURN, impact_oscillator
from test_near_nodes import beam

from fecontact import InputError, Status, ensemble, simulate
from fecontact.integrate import ContactEvents, strobe
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.blocks import FEW
from fecontact.system import forcing_period

W = 64.32
PERIOD = 2.0 * np.pi / W


def test_runs_are_those_of_single_runs_bit_for_bit():
    base = impact_oscillator(modes=2)
    systems = [base.with_(**{"drive.frequency_hz": w / TURN}) for w in (30.84, 50.0, W)]
    states = 1e-4 * np.random.default_rng(1).normal(size=(3, base.size))
    times = np.linspace(0.0, 0.6, 7)
    found = ensemble(systems, times, initial=states, workers=2)
    assert found.states.shape == (3, 7, 4)
    assert found.finished.all()
    for system, state, got, steps in zip(systems, states, found.states, found.steps, strict=True):
        run = driver.start(system, state, times, rtol=1e-6, work=False)
        run.advance(10**9)
        assert (run.states == got).all()
        assert run.statistics["steps"] == steps
        # The energy balance of a full run shortens some steps.
        full = simulate(system, 0.6, initial=state, outputs=times, rtol=1e-9)
        off = np.abs(full.states[:3] - got[:3]).max(axis=0)
        assert (off < 3e-3 * np.abs(full.states).max(axis=0)).all()


def test_strobed_motion_repeats_where_the_motion_does():
    system = impact_oscillator(modes=2)
    assert forcing_period(system) == pytest.approx(PERIOD, rel=1e-14)
    states = 1e-4 * np.random.default_rng(2).normal(size=(4, system.size))
    found = strobe(system, transient_periods=150, keep=3, initial=states, rtol=1e-7)
    assert found.states.shape == (4, 3, 4)
    assert found.times[0] == pytest.approx(PERIOD * np.array([150, 151, 152]), rel=1e-14)
    # One attractor of period one at this frequency, from all four starts.
    size = np.abs(found.states).max(axis=(0, 1))
    assert (np.ptp(found.states, axis=(0, 1)) < 1e-4 * size).all()
    none = strobe(system, transient_periods=0, keep=2, initial=states)
    assert (none.states[:, 0] == states).all()


def test_a_chain_hands_on_its_states():
    base = impact_oscillator(modes=2)
    systems = [base.with_(**{"drive.frequency_hz": w / TURN}) for w in (60.0, 61.0, 62.0, 63.0)]
    start = np.full(4, 1e-4)
    found = strobe(systems, transient_periods=3, keep=1, initial=start, chain=2)
    last = start
    for index in (0, 1):
        w = TURN * systems[index].drive.frequency_hz
        run = driver.start(systems[index], last, np.arange(4) * 2.0 * np.pi / w, rtol=1e-6,
                           work=False)
        run.advance(10**9)
        last = run.states[-1]
        assert found.states[index, 0] == pytest.approx(last, rel=1e-6)
    alone = strobe(systems[2], transient_periods=3, keep=1, initial=start)
    assert (found.states[2] == alone.states[0]).all()


def test_a_run_that_cannot_go_on_leaves_the_others():
    system = impact_oscillator(modes=2)
    wild = np.array([0.0, 0.0, 1e50, 0.0])
    found = ensemble(system, [0.0, 0.1, 0.2], initial=np.vstack([wild, np.zeros(4)]))
    assert found.status[0] is not Status.FINISHED
    assert np.isnan(found.states[0, -1]).all()
    assert found.finished.tolist() == [False, True]


def test_runs_in_the_tables_of_another_are_those_of_fresh_ones():
    """Bit for bit, with nodes that are left out, also behind runs that failed."""
    system, state = beam()
    assert system.basis.contact_nodes > FEW
    tilted, fast, wild = state.copy(), state.copy(), state.copy()
    tilted[2], fast[9], wild[9] = 3e-6, 1e50, -9e59
    starts = np.vstack([state, fast, tilted, wild, state])
    times = np.linspace(0.0, 2e-3, 5)
    found = ensemble(system, times, initial=starts, workers=1)
    assert found.finished.tolist() == [True, False, True, False, True]
    for start, states, steps in zip(starts, found.states, found.steps, strict=True):
        run = driver.start(system, start, times, rtol=1e-6, work=False)
        run.advance(10**9)
        assert np.array_equal(states[: run.outputs], run.states[: run.outputs])
        assert steps == run.statistics["steps"]


@pytest.mark.parametrize("options", [
    {"vary": True, "work": False}, {"events": (ContactEvents(),), "work": False}, {"work": True}])
def test_runs_with_powers_derivatives_or_events_are_not_begun_again(options):
    system = impact_oscillator(modes=2)
    run = driver.start(system, np.zeros(4), np.array([0.0, 0.1]), rtol=1e-6, **options)
    with pytest.raises(AssertionError):
        driver.again(run, system, np.zeros(4))


@pytest.mark.parametrize(("change", "words"), [
    ({"times": [0.0, 0.0]}, "ascending"),
    ({"times": np.zeros((3, 2))}, "ascending"),
    ({"initial": np.zeros((2, 3))}, "must have 4 values"),
    ({"initial": np.full((2, 4), np.nan)}, "must be finite"),
    ({"rtol": 0.0}, "rtol = 0.0"),
    ({"chain": 0}, "chain = 0"),
    ({"workers": 1.5}, "workers = 1.5"),
])
def test_bad_input(change, words):
    settings = {"times": [0.0, 0.1], "initial": np.zeros((2, 4)), **change}
    with pytest.raises(InputError, match=words):
        ensemble(impact_oscillator(modes=2), **settings)


def test_bad_members():
    system = impact_oscillator(modes=2)
    with pytest.raises(InputError, match="not empty"):
        ensemble([], [0.0, 1.0])
    with pytest.raises(InputError, match=r"systems\[1\] = 3 must be a ContactSystem or a Vector"):
        ensemble([system, 3], [0.0, 1.0])
    with pytest.raises(InputError, match=r"events: 'stick' must be a ContactEvents, Crossing or"):
        ensemble(system, [0.0, 1.0], initial=np.zeros(4), events="stick")
    with pytest.raises(InputError, match="same size"):
        ensemble([system, impact_oscillator(modes=1)], [0.0, 1.0])
    with pytest.raises(InputError, match="3 initial states for 1 systems"):
        ensemble([system], [0.0, 1.0], initial=np.zeros((3, 4)))
    with pytest.raises(InputError, match="give period"):
        strobe(system.with_(**{"drive.amplitude_y": 0.0}), transient_periods=1, keep=1,
               initial=np.zeros(4))
    with pytest.raises(InputError, match="keep = 0"):
        strobe(system, transient_periods=1, keep=0)
    with pytest.raises(InputError, match="period = -1"):
        strobe(system, transient_periods=1, keep=1, period=-1.0, initial=np.zeros(4))
