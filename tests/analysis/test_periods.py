"""The number of periods of known maps, of synthetic signals and of runs."""

import numpy as np
import pytest
from systems import TURN, belt

from fecontact import ContactSystem, Drive, InputError, ModalBasis, simulate
from fecontact.analysis import count_periods, periodicity, section_states, strobed_states
from fecontact.analysis.periodicity import drive_period
from fecontact.laws import ConstantFriction, RoughSurface


def logistic(r, count=400, start=0.3, skip=2000):
    x = np.empty(skip + count)
    x[0] = start
    for i in range(1, len(x)):
        x[i] = r * x[i - 1] * (1.0 - x[i - 1])
    return x[skip:]


@pytest.mark.parametrize(("r", "periods"), [
    (2.8, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.566, 16), (3.83, 3), (3.845, 6), (3.74, 5),
    (3.9, None), (3.7, None), (4.0, None)])
def test_logistic_map(r, periods):
    found = count_periods(logistic(r), 1.0)
    assert found.periods == periods
    assert found.settled
    assert (found.misfit < 1e-6) == (periods is not None)


@pytest.mark.parametrize(("a", "periods"), [(1.0, 4), (1.25, 7), (1.4, None)])
def test_henon_map(a, periods):
    points = np.empty((3000, 2))
    points[0] = [0.1, 0.1]
    for i in range(1, len(points)):
        x, y = points[i - 1]
        points[i] = [1.0 - a * x * x + y, 0.3 * x]
    assert count_periods(points[-200:], [2.5, 0.75]).periods == periods


def test_quasi_periodic_motion_has_no_period():
    turn = 2.0 * np.pi * 0.5 * (np.sqrt(5.0) - 1.0) * np.arange(300)
    assert count_periods(np.column_stack([np.cos(turn), np.sin(turn)]), 2.0).periods is None
    turn = 2.0 * np.pi * 5.0 / 13.0 * np.arange(300)
    assert count_periods(np.column_stack([np.cos(turn), np.sin(turn)]), 2.0).periods == 13


@pytest.mark.parametrize("periods", [1, 2, 3, 7, 16])
def test_noise_below_the_tolerance_is_passed_over(periods):
    random = np.random.default_rng(periods)
    # Between-cycle distances of ten tolerances and more.
    cycle = 0.03 * random.permutation(periods)
    points = np.resize(cycle, 200) + 8e-4 * random.uniform(-1.0, 1.0, 200)
    assert count_periods(points, 1.0).periods == periods
    louder = np.resize(cycle, 200) + 4e-3 * random.uniform(-1.0, 1.0, 200)
    assert count_periods(louder, 1.0).periods is None
    assert count_periods(louder, 1.0, tolerance=1e-2).periods == periods


@pytest.mark.parametrize(("factor", "expected"), [
    (-0.9, (1, True)), (-0.99, (None, False)), (-0.997, (None, False)), (-1.01, (None, False))])
def test_slow_approach_is_not_a_doubled_period(factor, expected):
    """Near a period doubling the motion swings about the single orbit, less and less, or more."""
    n = np.arange(100)
    points = 5e-3 * factor ** (n - 60.0)
    found = count_periods(points, 1.0)
    assert (found.periods, found.settled) == expected
    # Once it is close the single period is seen.
    assert count_periods(1e-4 * points, 1.0).periods == 1


def test_logistic_map_close_to_its_doubling():
    """The multiplier of the fixed point is 2 - r."""
    slow = count_periods(logistic(2.995, count=100, start=0.5, skip=400), 1.0)
    assert (slow.periods, slow.settled) == (None, False)
    assert count_periods(logistic(2.995, count=100, start=0.5, skip=4000), 1.0).periods == 1
    # Leaving the unstable fixed point.
    leaving = count_periods(logistic(3.05, count=60, start=1.0 - 1.0 / 3.05 + 1e-5, skip=10), 1.0)
    assert (leaving.periods, leaving.settled) == (None, False)
    assert count_periods(logistic(3.05), 1.0).periods == 2


def test_tolerance_is_relative_to_each_scale():
    points = np.column_stack([np.resize([0.0, 1e-3], 100), np.full(100, 5.0)])
    assert count_periods(points, [1.0, 1.0]).periods == 1
    assert count_periods(points, [1e-3, 1.0]).periods == 2
    assert count_periods(1e-6 * points, [1e-9, 1e-6]).periods == 2


def test_what_cannot_be_counted():
    with pytest.raises(InputError, match="20 points cannot show 16 periods; 48 are needed"):
        count_periods(np.zeros(20), 1.0)
    with pytest.raises(InputError, match="largest = 0 must be a whole number"):
        count_periods(np.zeros(20), 1.0, largest=0)
    with pytest.raises(InputError, match="scale above zero"):
        count_periods(np.zeros(90), 0.0)


def linear_oscillator(w, damping=0.4):
    """One mass on the spring of the drive, far from the ground: x'' + 0.4 x' + x = sin w t."""
    T = np.zeros((3, 3, 1))
    T[0, 0] = T[2, 0] = 1.0
    basis = ModalBasis([0.0], [[0.0]], T, np.zeros((3, 2)), [1.0])
    return ContactSystem(basis, RoughSurface(1e6, 1e-5, 0.0), ConstantFriction(0.0), gap=1.0,
                         drive=Drive(stiffness_x=1.0, damping_x=damping, amplitude_x=1.0,
                                     frequency_hz=w / TURN))


@pytest.mark.parametrize("outputs", [2001, 2344])
def test_strobe_of_a_linear_oscillator(outputs):
    """Outputs on and beside the strobe times give the steady state of the closed form."""
    w = 0.7
    system = linear_oscillator(w)
    run = simulate(system, 40.0 * 2.0 * np.pi / w, outputs=outputs, rtol=1e-8)
    steady = 1.0 / (1.0 - w**2 + 0.4j * w)
    for phase in (0.0, 0.3):
        found = strobed_states(run, phase=phase)
        turn = steady * np.exp(2j * np.pi * phase)
        assert found.period == pytest.approx(2.0 * np.pi / w)
        assert np.diff(found.time) == pytest.approx(found.period)
        assert found.states[-1] == pytest.approx([turn.imag, (w * turn).real], abs=2e-5)
    assert periodicity(run, largest=4).periods == 1
    assert periodicity(run, largest=4, period=0.5 * found.period).periods == 2
    assert periodicity(run, largest=4, period=0.41 * found.period).periods is None


def test_strobe_says_what_it_lacks():
    still = linear_oscillator(0.0)
    run = simulate(still, 1.0, initial=np.array([0.0, 0.1]), outputs=11)
    with pytest.raises(InputError, match=r"has 0 maxima after 0\.5 s, too few for a section"):
        strobed_states(run.between(0.0, 0.6), t_start=0.5)
    with pytest.raises(InputError, match="has no period"):
        drive_period(still)
    with pytest.raises(InputError, match="run it for longer"):
        strobed_states(run, period=3.0)
    with pytest.raises(InputError, match=r"phase = 1\.5"):
        strobed_states(run, period=0.1, phase=1.5)
    with pytest.raises(InputError, match=r"t_start = 2\.0 must be a time of the run"):
        strobed_states(run, period=0.1, t_start=2.0)
    with pytest.raises(InputError, match="at least eight per period"):
        periodicity(run, period=0.1, largest=1)


def test_self_excited_motion_is_counted_by_its_maxima():
    """Stick-slip of the friction oscillator without a drive: one period, sampled coarsely too."""
    fine = simulate(belt(speed=5e-3), 6.0, outputs=6001)
    found = periodicity(fine, t_start=1.5, largest=4)
    assert found.periods == 1
    # The period by the times at which the spring is longest, apart from the section.
    late = fine.between(1.5, None)
    x = late.displacement("B")[:, 0]
    tops = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])) + 1
    assert found.period == pytest.approx(np.diff(late.time[tops]).mean(), rel=1e-3)
    section = section_states(fine, "B", "x", t_start=1.5)
    assert section.maxima_of == ("B", "x")
    m = fine.system.basis.modes
    assert np.abs(section.states[:, m:] @ fine._rows("B")[0]).max() < 1e-6
    sparse = simulate(belt(speed=5e-3), 6.0, outputs=121)
    again = section_states(sparse, "B", "x", t_start=1.5)
    assert again.period == pytest.approx(section.period, rel=1e-4)
