"""Random systems of the benchmark: their equations, written independently, and their errors."""

from pathlib import Path

import numpy as np
import pytest

import fecontact as fc
from fecontact.laws import FrictionLaw, NormalLaw, law_names

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def systems(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import random_systems

    return random_systems


def test_equations_are_those_of_the_package(systems):
    """Every law, in the plane and in space, against formulas in plain Python."""
    met = set()
    for number in range(64):
        case = systems.random_case(number)
        met |= set(case.names)
        m, rng = case.system.basis.modes, np.random.default_rng([1, number])
        for _ in range(4):
            y = case.state * rng.uniform(0.0, 2.0, len(case.state))
            y[:m] = 10.0 ** rng.uniform(-6.0, -4.5) * rng.standard_normal(m)
            y[2 * m :] = 0.3 * rng.standard_normal(len(y) - 2 * m) * case.scale[2 * m :]
            t = rng.uniform(0.0, case.end)
            expected = systems.rates(case, t, y)
            found = case.system.rhs(t, y)
            size = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max())
            assert (np.abs(found - expected) / size).max() < 1e-8, (number, case.names)
    assert met == {*systems.NORMAL, *systems.FRICTION, "cubic spring"}
    # Without the contact element of two laws, the rigid stop and the table of asperities; without
    # sliders of Iwan's kernel.
    assert len(systems.NORMAL) == len(law_names()[NormalLaw]) - 3
    assert len(systems.FRICTION) == len(law_names()[FrictionLaw]) - 1


def test_errors_at_the_default_tolerance(systems):
    """Errors stay below 1e-4 of the amplitude on four laws, with slip, stick and impacts."""
    for number in (0, 2, 4, 12):
        case = systems.random_case(number)
        times = np.linspace(0.0, 0.25 * case.end, 51)
        wanted = systems.reference(case, times)
        run = systems.fc.simulate(case.system, times[-1], initial=case.state, outputs=times)
        assert systems.distance(case, run.states, wanted) < 1e-4, number


@pytest.mark.parametrize("number", [8, 9, 10, 23, 24])
def test_elastic_elements(systems, number):
    """Jenkins' and Iwan's elements, in the plane and in space: reference, and runs against it."""
    case = systems.random_case(number)
    assert case.names[1] in ("jenkins", "iwan", "four-parameter-iwan")
    times = np.linspace(0.0, 0.25 * case.end, 51)
    wanted = systems.reference(case, times)
    assert systems.distance(case, systems.reference(case, times, tolerance=1e-9), wanted) < 1e-6
    run = systems.fc.simulate(case.system, times[-1], initial=case.state, outputs=times, rtol=1e-8)
    assert systems.distance(case, run.states, wanted) < 1e-5


@pytest.mark.parametrize("number", [51, 79, 107, 163, 247])
def test_elastic_elements_in_space_where_the_normal_force_vanishes(systems, number):
    """Runs pass touches and lift-offs; a tolerance of 1e-9 moves them by no more than their errors.

    The reference takes too many steps here, as elements turn infinitely fast.
    """
    case = systems.random_case(number)
    runs = [systems.fc.simulate(case.system, case.end, initial=case.state, outputs=201, rtol=rtol)
            for rtol in (1e-6, 1e-9)]
    assert [run.status for run in runs] == [systems.Status.FINISHED] * 2
    assert systems.distance(case, *(run.states for run in runs)) < 1e-5
    assert abs(runs[1].energies.imbalance) < 1e-5


@pytest.mark.parametrize(
    ("number", "begin", "end"), [(8, 0.025, 0.03), (8, 0.105, 0.11), (78, 0.01, 0.015),
                                 (78, 0.02, 0.03), (78, 0.12665, 0.127), (135, 0.002, 0.0025)])
def test_derivatives_of_elastic_elements(systems, number, begin, end):
    """Exponential normal law on a wavy ground, and play, against central differences of runs."""
    case = systems.random_case(number)
    m, span = case.system.basis.modes, {"t_start": begin, "outputs": 2}
    start = fc.simulate(case.system, begin, initial=case.state, outputs=2, rtol=1e-11).states[-1]
    found = fc.sensitivity(case.system, end, initial=start, rtol=1e-8, **span)
    moves = np.eye(2 * m, len(start)) * np.repeat([1e-10, 1e-7], m)[:, None]
    ends = np.array([fc.simulate(case.system, end, initial=start + move, rtol=1e-12,
                                 **span).states[-1, : 2 * m] for move in (*moves, *-moves)])
    # Displacements in millimetres, velocities in metres per second.
    units = np.repeat([1e-3, 1.0], m)
    scale = units / units[:, None]
    wanted = (ends[: 2 * m] - ends[2 * m :]).T / (2.0 * moves.max(axis=1)) * scale
    apart = found.monodromy[: 2 * m, : 2 * m] * scale - wanted
    assert np.abs(apart).max() < 3e-5 * np.abs(wanted).max()


@pytest.mark.filterwarnings("ignore::fecontact.ModelWarning")
def test_steps_that_end_just_short_of_slip_do_not_shrink_to_nothing(systems):
    case = systems.random_case(78)
    found = fc.sensitivity(case.system, case.end, initial=case.state, rtol=1e-8)
    run = fc.simulate(case.system, case.end, initial=case.state, outputs=2, rtol=1e-11)
    m = case.system.basis.modes
    assert np.abs(found.states[-1] - run.states[-1])[:m].max() < 1e-6 * np.abs(run.states).max()
    assert np.isfinite(found.monodromy).all()


@pytest.mark.parametrize(("rtol", "aside"), [
    (1e-6, 0), (1e-6, 3), (1e-6, 5), (1e-6, 7), (1e-8, 0), (1e-8, 7),
    pytest.param(1e-8, 3, marks=pytest.mark.slow), pytest.param(1e-8, 5, marks=pytest.mark.slow)])
def test_steps_with_derivatives_go_on_where_sliding_elements_lift_off_in_space(
    systems, rtol, aside,
):
    """Directions of slip turn ever faster there, but of forces that vanish.

    Where a contact begins, limits and deflections are far below their scale. How far depends on
    rounding: starts beside one another meet other numbers.
    """
    case = systems.random_case(107)
    start = (1.0 + 1e-13 * aside) * case.state
    # Runs at the tighter tolerance are long.
    end = 0.05 if rtol > 1e-7 else 0.02
    found = fc.sensitivity(case.system, end, initial=start, rtol=rtol,
                           outputs=np.linspace(0.0, end, 11))
    assert not found.note
    assert np.isfinite(found.monodromy).all()


def test_steps_with_derivatives_go_on_where_the_normal_force_passes_zero(systems):
    """Steps that end at its zero do not repeat without end; spans agree with differences."""
    case = systems.random_case(93)
    found = fc.sensitivity(case.system, case.end, initial=case.state, rtol=1e-8,
                           outputs=np.linspace(0.0, case.end, 41))
    assert not found.note
    assert np.isfinite(found.monodromy).all()
