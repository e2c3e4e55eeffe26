"""States that runs keep between their outputs: independent of the pieces of the run."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from systems import friction_oscillator, impact_oscillator

import fecontact as fc
from fecontact.analysis.resolved import resolved
from fecontact.core.errors import InputError
from fecontact.integrate import (
    CVODE,
    Auto,
    EventDriven,
    PowerSeries,
    Radau,
    Rodas5P,
    Scipy,
    TimeStepping,
    kept_rows,
)
from fecontact.integrate.step_loop import COUNTS, HALVED, KEPT, PASSED
from fecontact.laws import JenkinsFriction

SOLVERS = [
    (friction_oscillator, Rodas5P(), 1e-7), (friction_oscillator, Radau(), 1e-8),
    (impact_oscillator, PowerSeries(), 1e-6), (friction_oscillator, EventDriven(), 1e-7),
    (friction_oscillator, TimeStepping(), 1e-7), (friction_oscillator, Scipy("Radau"), 1e-7),
    (friction_oscillator, CVODE(), 1e-7)]


def run(made, solver, rtol=1e-7, outputs=11, t_end=1.0, **options):
    return fc.simulate(made(2), t_end, initial=np.array([0.02, 0.01, 0.0, 0.1]), outputs=outputs,
                       solver=solver, rtol=rtol, **options)


@pytest.mark.parametrize(("made", "solver", "rtol"), SOLVERS)
def test_kept_states_are_those_of_the_motion(made, solver, rtol):
    if isinstance(solver, CVODE):
        pytest.importorskip("sksundae")
    sparse = run(made, solver, rtol)
    kept = sparse.kept
    assert len(kept.time) > 100
    assert (np.diff(kept.time) > 0.0).all()
    assert not np.isin(kept.time, sparse.time).any()
    assert (kept.time[0], kept.time[-1]) > (0.0, 0.9)
    # The outputs are those of a run that keeps nothing, to the last bit.
    bare = run(made, solver, rtol, keep_steps=False)
    assert bare.kept is None
    np.testing.assert_array_equal(bare.states, sparse.states)
    np.testing.assert_array_equal(bare.work, sparse.work)
    # A run with these times as outputs has the same states there.
    some = kept.part(slice(None, None, max(1, len(kept.time) // 60)))
    again = run(made, solver, rtol, np.concatenate([[0.0], some.time, [1.0]]))
    scale = np.abs(again.states).max(axis=0)
    assert (np.abs(again.states[1:-1] - some.states) < 3e-4 * scale).all()
    assert np.abs(again.work[1:-1] - some.work).max() < 3e-4 * np.abs(again.work).max()
    if some.normal_force is not None:
        near = np.abs(again.normal_force[1:-1] - some.normal_force)
        assert np.median(near) < 1e-4 * again.normal_force.max()


def test_steps_with_outputs_keep_none():
    """A place is kept if there is no output since the place before."""
    places = np.sort(np.append(run(friction_oscillator, Rodas5P(), outputs=2).kept.time, 0.0))
    dense = run(friction_oscillator, Rodas5P(), outputs=2001)
    shown = np.diff(np.searchsorted(dense.time, places, side="right")) > 0
    np.testing.assert_array_equal(dense.kept.time, places[1:][~shown])
    assert 0.1 < shown.mean() < 0.9


@pytest.mark.parametrize("solver", [Rodas5P(), PowerSeries(), EventDriven(), Scipy("Radau")])
def test_rows_without_room_are_halved(solver, monkeypatch):
    made = impact_oscillator if isinstance(solver, PowerSeries) else friction_oscillator
    whole = run(made, solver).kept
    monkeypatch.setattr(kept_rows, "_MOST_ROWS", 100)
    monkeypatch.setattr(kept_rows, "_FEWEST_ROWS", 100)
    few = run(made, solver).kept
    assert 40 <= len(few.time) <= 100
    # They are some of all, to the last bit, evenly spread over these but for outputs between them.
    places = np.flatnonzero(np.isin(whole.time, few.time))
    assert len(places) == len(few.time)
    np.testing.assert_array_equal(whole.states[places], few.states)
    np.testing.assert_array_equal(whole.work[places], few.work)
    assert np.diff(places).max() <= 2 * np.median(np.diff(places))


def test_an_odd_last_row_goes_too():
    """Every place is kept; after the seventh every second one is, and the eighth is the next."""
    counts = np.zeros(COUNTS, dtype=np.int64)
    counts[KEPT] = 7
    times = np.arange(1.0, 10.0)
    kept_rows.halve((times,), counts)
    assert times[: counts[KEPT]].tolist() == [2.0, 4.0, 6.0]
    assert (counts[PASSED], counts[HALVED]) == (1, 1)


def test_halved_rows_do_not_depend_on_the_pieces_of_a_run(monkeypatch):
    """Calls of the loop return by the clock; what is kept may not show that."""
    from fecontact.integrate import step_runs

    monkeypatch.setattr(kept_rows, "_MOST_ROWS", 101)
    monkeypatch.setattr(kept_rows, "_FEWEST_ROWS", 101)
    whole = run(friction_oscillator, Rodas5P()).kept
    for most in (1, 7):
        monkeypatch.setattr(step_runs, "_FEWEST", most)
        monkeypatch.setattr(step_runs, "_MOST_STEPS", most)
        pieces = run(friction_oscillator, Rodas5P()).kept
        np.testing.assert_array_equal(whole.time, pieces.time)
        np.testing.assert_array_equal(whole.states, pieces.states)


def test_runs_from_a_checkpoint_keep_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_rows, "_MOST_ROWS", 100)
    monkeypatch.setattr(kept_rows, "_FEWEST_ROWS", 100)
    monkeypatch.setattr("fecontact.integrate.step_runs._FEWEST", 20)
    monkeypatch.setattr("fecontact.integrate.step_runs._MOST_STEPS", 20)
    whole = run(friction_oscillator, Auto()).kept
    solver = Auto(checkpoint=tmp_path / "checkpoint")

    def interrupt(time):
        if time > 0.5:
            raise KeyboardInterrupt

    half = run(friction_oscillator, solver, progress=interrupt)
    assert half.status is fc.Status.INTERRUPTED
    assert 0.4 < half.kept.time[-1] < half.time[-1]
    found = run(friction_oscillator, solver).kept
    for name in ("time", "states", "work"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))


def test_parts_of_runs_have_the_parts_that_were_kept():
    whole = run(friction_oscillator, Rodas5P())
    part = whole.between(0.3, 0.6)
    assert part.time[0] < part.kept.time[0] < part.kept.time[-1] < part.time[-1]
    at = np.searchsorted(whole.kept.time, part.kept.time)
    np.testing.assert_array_equal(whole.kept.states[at], part.kept.states)
    np.testing.assert_allclose(part.kept.work, whole.kept.work[at] - whole.work[3])
    assert sum(len(whole.between(a, b).kept.time)
               for a, b in pairwise((0.0, 0.3, 0.6, 1.0))) == len(whole.kept.time)


def test_files_give_back_what_was_kept(tmp_path):
    for solver in (Rodas5P(), EventDriven()):
        written = run(friction_oscillator, solver)
        read = fc.read_case(fc.write_case(tmp_path / "case.h5", written)).trajectory
        for name in ("time", "states", "work"):
            one, other = getattr(written.kept, name), getattr(read.kept, name)
            assert (one is None) == (other is None)
            if one is not None:
                np.testing.assert_array_equal(one, other)
        # Pictures of stored runs need no laws: files hold forces too, with seven digits.
        fine = resolved(written).trajectory
        at = np.searchsorted(fine.time, written.kept.time)
        assert (fine.time[at] == written.kept.time).all()
        for name in ("normal_force", "friction_force"):
            one = getattr(written.kept, name)
            one = getattr(fine, name)[at] if one is None else one
            np.testing.assert_allclose(getattr(read.kept, name), one, rtol=2e-7,
                                       atol=2e-7 * np.abs(one).max())
    bare = fc.write_case(tmp_path / "case.h5", replace(written, kept=None))
    assert fc.read_case(bare).trajectory.kept is None


@pytest.mark.slow
@pytest.mark.parametrize("solver", [Auto(), Scipy("Radau")])
def test_energies_balance_between_the_outputs_too(solver):
    """With elastic Coulomb friction too, which stores what the integrator counts as lost."""
    elastic = friction_oscillator(2, friction=JenkinsFriction(1e4, 0.4))
    found = fc.simulate(elastic, 1.0, outputs=6, solver=solver,
                        initial=np.array([0.02, -2e-5, 0.0, 0.0, 1e-4]))
    fine = resolved(found).trajectory
    assert len(fine.time) > 100
    assert fine.energies.imbalance < 1e-4
    # Nothing has been put in or lost at the start, where the element is stretched.
    assert not found.work[0].any()
    assert found.energies.bristles[0] > 0.0


def test_what_is_no_choice_is_named():
    with pytest.raises(InputError, match="keep_steps"):
        run(friction_oscillator, Auto(), keep_steps="all")


def test_systems_without_contact_keep_their_motion():
    from fecontact.analysis.resolved import resolved

    basis = fc.basis_from_matrices(np.eye(1), [[100.0]], {"B": [[1.0], [0.0], [0.0]]})
    found = fc.simulate(fc.ContactSystem(basis), 3.0, initial=np.array([1.0, 0.0]), outputs=4)
    fine = resolved(found).trajectory
    np.testing.assert_allclose(fine.modal_coordinates[:, 0], np.cos(10.0 * fine.time), atol=1e-5)
    assert len(fine.time) > 100
    assert fine.friction_work.shape == (len(fine.time), 0)
