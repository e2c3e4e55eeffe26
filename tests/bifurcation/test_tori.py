"""Tori of the forced van der Pol and of a two-tone Duffing oscillator."""

import numpy as np
import pytest
from bifurcation.torus_fields import (
    SECOND,
    duffing,
    error_of_derivatives,
    first_torus,
    forced_van_der_pol,
    period_of_w,
    torus_problem,
    two_tone_duffing,
)
from numba import njit

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    PeriodicMotion,
    SecondExcitation,
    TorusBalance,
    orbit_branch,
    periodic_motion,
    torus_branch,
    torus_motion,
    vector_field,
)
from fecontact.bifurcation.tori.stability import TorusStability, exponents, stability_of
from fecontact.core.errors import AnalysisError, InputError

EPS = 0.1
CIRCLE = 2.0 * np.pi


def settled(field, initial, begin, end, outputs=8001):
    run = fc.simulate(field, end, initial=initial, rtol=1e-10,
                      outputs=np.append(0.0, np.linspace(begin, end, outputs)))
    return run.between(begin)


def without_second(field):
    """The orbit that the first excitation alone gives, as a guess for both."""
    found = periodic_motion(field.with_(second=0.0), initial=np.zeros(field.dimension))
    return PeriodicMotion(found.times, found.states, found.period)


def test_a_weakly_forced_oscillator_beats_as_adler_says():
    # Phase of the averaged equations: psi' = D - K sin psi, with D = w - w0, K = F / (2 a w0).
    force, free = 0.012, 1.0 - EPS**2 / 16.0
    locking = force / 4.0
    for detuning in (1.6 * locking, 4.0 * locking):
        field = forced_van_der_pol(EPS, force, free + detuning)
        point = first_torus(field, settled(field, [2.0, 0.0], 600.0, 8000.0, 6000), "w",
                    method=TorusBalance((6, 6)))
        beat = CIRCLE * (point.values["frequency_1"] - point.values["frequency_2"])
        assert beat == pytest.approx(np.sqrt(detuning**2 - locking**2), rel=0.02)
        assert point.values["stable"]
        # The relaxation of the amplitude, exp(-eps T).
        assert point.values["multipliers"] == pytest.approx(
            [1.0, np.exp(-EPS * CIRCLE / field.values[2])], rel=2e-2)
        assert abs(torus_motion(point).harmonic(0, 1)[0]) == pytest.approx(
            2.0 * averaged_part(detuning, locking), rel=0.02)


def averaged_part(detuning, locking):
    """Amplitude of the harmonic of frequency w - beat in exp(i (w t - psi))."""
    beat = np.sqrt(detuning**2 - locking**2)
    t = np.arange(4096) / 4096 * CIRCLE / beat
    # tan(psi / 2) = (K + beat tan(beat t / 2)) / D.
    psi = 2.0 * np.arctan2(locking * np.cos(beat * t / 2) + beat * np.sin(beat * t / 2),
                           detuning * np.cos(beat * t / 2))
    return abs(np.mean(np.exp(-1j * psi) * np.exp(1j * beat * t)))


@pytest.fixture(scope="module")
def orbits():
    field = forced_van_der_pol(EPS, 1.3, 1.3)
    begin = periodic_motion(field, initial=[1.0, 0.0])
    return field, {name: orbit_branch(field, begin, "force", method=method, bounds=(0.5, 1.4),
                                      direction=-1.0)
                   for name, method in (("collocation", Collocation()),
                                        ("harmonics", HarmonicBalance(7)))}


@pytest.mark.parametrize("by", ["collocation", "harmonics"])
def test_tori_leave_a_neimark_sacker_point(orbits, by):
    field, branches = orbits
    born = branches[by].of_kind("Neimark-Sacker")[0]
    # The averaged equations lose stability at an amplitude of sqrt 2.
    w = 1.3
    assert born.parameter == pytest.approx(
        np.sqrt(2.0 * ((1.0 - w**2) ** 2 + (EPS * w / 2.0) ** 2)), rel=0.01)
    branch = torus_branch(field, born, bounds=(0.3, 1.0), method=TorusBalance((4, 4)))
    first, last = branch.points[0], branch.points[-1]
    assert last.parameter == pytest.approx(0.3)
    assert all(point.values["stable"] for point in branch.points)
    # The second frequency begins as that of the pair, one of +- angle + 2 pi.
    assert first.values["frequency_2"] / first.values["frequency_1"] == pytest.approx(
        born.angle / CIRCLE, abs=1e-3)
    # Far away from the point the torus is that of a run.
    motion = torus_motion(last)
    there = forced_van_der_pol(EPS, 0.3, w)
    run = settled(there, motion.section(1)[0], 60.0 * CIRCLE / w, 61.0 * CIRCLE / w, 11)
    distance = np.abs(run.states[0] - motion.section(2000)).sum(axis=1).min()
    assert distance < 5e-3
    # Energy of all harmonics, that is the mean square, of a long run.
    long = settled(there, motion.section(1)[0], 300.0, 4000.0, 20001)
    assert np.mean(long.states**2, axis=0) == pytest.approx(
        (motion.grid() ** 2).mean(axis=(0, 1)), rel=1e-3)


def test_back_at_the_orbit_the_branch_ends(orbits):
    field, branches = orbits
    born = branches["collocation"].of_kind("Neimark-Sacker")[0]
    out = torus_branch(field, born, bounds=(0.85, 1.0), method=TorusBalance((4, 3)))
    back = torus_branch(field, out.points[-1], bounds=(0.8, 1.2), direction=-1.0)
    assert back.status is BranchStatus.SINGLE_FREQUENCY
    assert back.points[-1].parameter == pytest.approx(born.parameter, rel=1e-4)


@pytest.mark.parametrize(("m", "direction", "end"), [(0.3, -1.0, 0.07), (0.1, 1.0, 0.5)])
def test_tori_end_where_either_radius_vanishes(m, direction, end):
    """A normal form of two oscillators: squared radii (2 m - 0.14) / 1.72, (0.2 - 0.4 m) / 1.72."""
    def pair(t, x, p, out):
        first, second = x[0] * x[0] + x[1] * x[1], x[2] * x[2] + x[3] * x[3]
        grows = p[0] - first - 0.7 * second, 0.2 - 0.4 * first - 2.0 * second
        out[0], out[1] = grows[0] * x[0] - x[1], grows[0] * x[1] + x[0]
        out[2], out[3] = grows[1] * x[2] - 2.7 * x[3], grows[1] * x[3] + 2.7 * x[2]

    times = np.linspace(0.0, 300.0, 6000)
    radii = np.sqrt([(2.0 * m - 0.14) / 1.72, (0.2 - 0.4 * m) / 1.72])
    waves = [r * wave(w * times) for r, w in zip(radii, (1.0, 2.7), strict=True)
             for wave in (np.cos, np.sin)]
    tori = torus_branch(vector_field(pair, {"m": m}, 4), (times, np.transpose(waves)), "m",
                        direction=direction, bounds=(-1.0, 1.0), method=TorusBalance(2))
    assert (tori.status, tori.special, tori.message) == (BranchStatus.SINGLE_FREQUENCY, (), "")
    assert tori.points[-1].parameter == pytest.approx(end, abs=1e-8)


def test_errors_fall_with_the_harmonics_and_are_estimated():
    field = forced_van_der_pol(0.4, 0.5, 1.6)
    run = settled(field, [1.0, 0.0], 200.0, 3000.0)
    exact = first_torus(field, run, "w", method=TorusBalance((13, 9)))
    errors, estimates = [], []
    for H in (2, 4, 6, 8):
        point = first_torus(field, run, "w", method=TorusBalance((H, H)))
        fine, coarse = torus_motion(exact), torus_motion(point)
        part = [fine.harmonic(*k)[0] - coarse.harmonic(*k)[0] for k in ((0, 1), (1, 0), (2, -1))]
        errors.append(np.abs(part).max() + abs(
            exact.values["frequency_2"] - point.values["frequency_2"]))
        estimates.append(point.values["truncation_error"])
    assert errors[3] < 1e-2 * errors[0]
    assert np.all(np.diff(estimates) < 0.0)
    assert point.values["sampling_error"] < 1e-3


@pytest.mark.parametrize("second", [None, SECOND])
def test_derivatives_are_those_of_differences(second):
    if second is None:
        field = forced_van_der_pol(EPS, 0.05, 1.2)
        start, name = settled(field, [2.0, 0.0], 300.0, 2000.0), "w"
    else:
        field, name = two_tone_duffing(), "w"
        start = without_second(field)
    problem, u = torus_problem(field, start, name, second=second, method=TorusBalance((2, 3)))
    assert error_of_derivatives(problem, u, 1e-6) < 1e-5


def test_two_tones_of_a_duffing_oscillator_meet_a_long_run():
    field = two_tone_duffing()
    point = first_torus(field, without_second(field), "second", second=SECOND,
                method=TorusBalance((7, 7)))
    motion = torus_motion(point)
    assert motion.frequencies == pytest.approx([1.7 / CIRCLE, field.values[5]])
    # Phases of both excitations are those of the run.
    times = np.linspace(900.0, 1000.0, 501)
    run = fc.simulate(field, 1000.0, initial=[0.0, 0.0], rtol=1e-10,
                      outputs=np.append(0.0, times)).between(900.0)
    assert np.abs(motion.states(run.time) - run.states).max() < 2e-3
    assert point.values["stable"]
    # The mean divergence of the field is that of the multipliers.
    assert np.log(point.values["multipliers"]).sum() == pytest.approx(
        -0.1 * CIRCLE / 1.7, rel=1e-6)


on_duffing = njit(duffing)


def duffing_and_fast_state(t, x, p, out):
    on_duffing(t, x, p, out)
    out[2] = x[0] - 3000.0 * x[2]


def test_modes_too_fast_for_the_multipliers_are_noted():
    slow = two_tone_duffing()
    field = vector_field(duffing_and_fast_state, dict(zip(slow.parameters, slow.values,
                                                          strict=True)), ["x", "v", "y"],
                         period=period_of_w)
    for tried, noted in ((slow, False), (field, True)):
        branch = torus_branch(tried, without_second(tried), "second", second=SECOND,
                              method=TorusBalance((5, 5)), options=ContinuationOptions(points=1))
        # 3000 / 1.7 times the frequency of the first excitation.
        assert ("up to 1.76e+03 times" in branch.message) is noted


def test_the_second_excitation_grows_from_nothing():
    field = two_tone_duffing(second=0.0)
    branch = torus_branch(field, without_second(field), "second", second=SECOND,
                          bounds=(0.0, 0.3), method=TorusBalance((5, 5)))
    assert branch.points[0].values["minimum"] == pytest.approx(
        without_second(field).states.min(axis=0), rel=1e-2)
    direct = first_torus(two_tone_duffing(), without_second(field), "second", second=SECOND,
                 method=TorusBalance((5, 5)))
    assert branch.points[-1].values["maximum"] == pytest.approx(direct.values["maximum"], rel=1e-6)


def test_an_orbit_without_the_second_excitation_gives_its_frequency_alone():
    """A linear oscillator: each amplitude is that of a frequency response."""
    def two_tones(t, x, p, out):
        out[0] = x[1]
        out[1] = (-0.2 * x[1] - x[0] + p[0] * np.cos(2.0 * t)
                  + p[1] * np.cos(CIRCLE * p[3] * t + p[2]))

    field = vector_field(two_tones, {"first": 1.0, "second": 0.5, "phase": 0.0, "f2": 0.25},
                         ["x", "v"], period=np.pi)
    bare = field.with_(second=0.0)
    orbit = periodic_motion(bare, initial=[0.0, 0.0])
    point = orbit_branch(bare, orbit, "first", bounds=(1.0, 1.2), method=Collocation(20)).points[-1]
    for start, first in ((orbit, 1.0), (point, 1.2)):
        torus = torus_motion(torus_branch(field, start, "f2", bounds=(0.2, 0.25),
                                          second=SecondExcitation("phase", "f2"),
                                          method=TorusBalance(2)).points[0])
        for pair, force, w in (((1, 0), first, 2.0), ((0, 1), 0.5, CIRCLE / 4.0)):
            assert abs(torus.harmonic(*pair)[0]) == pytest.approx(
                force / abs(1.0 - w**2 + 0.2j * w), rel=1e-6)


def test_a_run_finds_both_tones_too():
    field = two_tone_duffing()
    run = settled(field, [0.0, 0.0], 300.0, 1500.0)
    by_run = first_torus(field, run, "w", second=SECOND, method=TorusBalance((5, 5)))
    by_orbit = first_torus(field, without_second(field), "w", second=SECOND,
                   method=TorusBalance((5, 5)))
    assert by_run.u == pytest.approx(by_orbit.u, abs=1e-6)


def coupled(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0] + p[2] * (x[2] - x[0])
    out[2] = x[3]
    out[3] = p[1] * (1.0 - x[2] * x[2]) * x[3] - 2.0 * x[2] + p[2] * (x[0] - x[2])


@pytest.mark.parametrize("second", [0.2, -0.2])
def test_two_oscillators_that_do_not_feel_each_other(second, tmp_path):
    # Each has w = w0 - eps^2 / (16 w0) and decays to its cycle by exp(-eps t); backwards it grows.
    field = vector_field(coupled, {"first": 0.2, "second": second, "coupling": 0.0},
                         ["x", "vx", "y", "vy"])
    w = np.array([1.0, np.sqrt(2.0)])
    times = np.linspace(0.0, 400.0, 4001)
    guess = np.concatenate([[2.0 * np.cos(each * times), -2.0 * each * np.sin(each * times)]
                            for each in w]).T
    branch = torus_branch(field, (times, guess), "coupling", method=TorusBalance(5),
                          bounds=(0.0, 0.05))
    point, motion = branch.points[0], torus_motion(branch.points[0])
    assert np.sort(CIRCLE * motion.frequencies) == pytest.approx(w - 0.04 / 16.0 / w, rel=1e-4)
    period = 1.0 / motion.frequencies[0]
    assert point.values["multipliers"] == pytest.approx(
        np.sort([1.0, 1.0, np.exp(-0.2 * period), np.exp(-second * period)])[::-1], rel=1e-2)
    assert point.values["trivial_error"] < 1e-6
    assert point.values["stable"] == (second > 0.0)
    # What files hold goes on.
    fc.io.write_branch(tmp_path / "tori.h5", branch)
    last = fc.io.read_branch(tmp_path / "tori.h5").points[-1]
    on = torus_branch(field, last, bounds=(0.0, 0.06), method=TorusBalance((6, 5)))
    assert on.points[-1].parameter == pytest.approx(0.06)
    assert on.points[0].values["frequency_2"] == pytest.approx(last.values["frequency_2"], rel=1e-4)


def turning(t, x, p, out):
    grows = 1.0 + np.hypot(x[0], x[1]) * (np.cos(p[1] * t) - 1.0)
    out[0] = grows * x[0] - p[0] * x[1]
    out[1] = grows * x[1] + p[0] * x[0]


@pytest.mark.parametrize(("turn", "w"), [(1.0, 1.5), (np.sqrt(2.0), 0.9)])
def test_a_torus_in_closed_form(turn, w):
    """The plane turns, and r' = r + r^2 (cos w t - 1), so that 1 / r is linear.

    1 / r = 1 - a cos(w t - phase) with a^2 = 1 / (1 + w^2), and other values decay to it by
    exp(-t). Harmonics of r fall by b = (1 - sqrt(1 - a^2)) / a. For turn = 1, w = 1.5 see the
    tutorial on tori of COCO (H. Dankowicz, F. Schilder, Recipes for Continuation, SIAM 2013).
    """
    field = vector_field(turning, {"turn": turn, "w": w}, ["x", "y"], period=period_of_w)
    run = settled(field, [1.0, 0.0], 60.0, 260.0, 4001)
    a = 1.0 / np.sqrt(1.0 + w**2)
    root = np.sqrt(1.0 - a * a)
    b = (1.0 - root) / a
    for H in (6, 12):
        point = first_torus(field, run, "turn" if w < 1.0 else "w", method=TorusBalance((H, 1)))
        motion = torus_motion(point)
        bound = 3.0 * b**H
        assert CIRCLE * motion.frequencies == pytest.approx([w, turn], abs=1e-8 + bound**2)
        assert point.values["multipliers"] == pytest.approx(
            [1.0, np.exp(-CIRCLE / w)], abs=bound)
        # Extremes are those of a grid.
        assert point.values["maximum"] == pytest.approx(2 * [1.0 / (1.0 - a)], rel=1e-3 + bound)
        for k in (0, 1, -1, 2, -2, 3):
            assert abs(motion.harmonic(k, 1)) == pytest.approx(
                2 * [b ** abs(k) / root], rel=bound)


def subcritical(t, x, p, out):
    # r' = r (p + 0.4 r^2 - 0.5 r^4) about a forced motion.
    y = x[0] - 0.1 * np.cos(2.0 * np.pi * t)
    square = y * y + x[1] * x[1]
    grows = p[0] + 0.4 * square - 0.5 * square * square
    out[0] = grows * y - 1.1 * x[1] - 0.2 * np.pi * np.sin(2.0 * np.pi * t)
    out[1] = grows * x[1] + 1.1 * y


def test_small_tori_of_a_subcritical_branch_are_unstable():
    """The multiplier is exp(2 r^2 (0.4 - r^2)): above 1 up to the fold at p = -0.08."""
    field = vector_field(subcritical, {"p": -0.2}, ["x", "y"], period=1.0)
    t = np.linspace(0.0, 1.0, 201)
    begin = PeriodicMotion(t, np.stack([0.1 * np.cos(2.0 * np.pi * t), 0.0 * t], axis=1), 1.0)
    orbits = orbit_branch(field, begin, "p", bounds=(-0.2, 0.2), scales=np.ones(2),
                          method=Collocation(intervals=20))
    branch = torus_branch(field, orbits.of_kind("Neimark-Sacker")[0], bounds=(-0.2, 0.2),
                          method=TorusBalance((2, 2)))
    p = branch.parameter
    turn = int(np.argmin(p))
    assert p[turn] == pytest.approx(-0.08, rel=1e-6)
    resolved = np.abs(p) > 1e-7
    stable = branch.column("stable").astype(bool)
    assert not stable[:turn][resolved[:turn]].any()
    assert stable[turn + 1 :].all()


def test_far_from_resonance_the_free_vibration_is_smaller():
    # Averaging about the forced vibration b: a^2 = 4 - 2 b^2.
    field = forced_van_der_pol(0.02, 0.3, 1.3)
    point = first_torus(field, settled(field, [2.0, 0.0], 1000.0, 2000.0), "w",
                        method=TorusBalance((4, 4)))
    b = 0.3 / (1.3**2 - 1.0)
    motion = torus_motion(point)
    assert abs(motion.harmonic(1, 0)[0]) == pytest.approx(b, rel=1e-2)
    assert abs(motion.harmonic(0, 1)[0]) == pytest.approx(np.sqrt(4.0 - 2.0 * b**2), rel=1e-3)


def test_a_torus_that_its_harmonics_do_not_resolve_ends_the_branch():
    field = forced_van_der_pol(EPS, 0.1, 1.2)
    branch = torus_branch(field, settled(field, [2.0, 0.0], 300.0, 2000.0), "w", direction=-1.0,
                          bounds=(1.0, 1.2), method=TorusBalance((3, 3), tolerance=0.02))
    # The frequencies lock at the detuning F / (2 a w).
    assert branch.status is BranchStatus.UNRESOLVED_TORUS
    assert branch.points[-1].parameter > 1.0 + 0.1 / 4.0


def test_multipliers_of_given_jacobians():
    # x' = (a + b cos theta2) x and y' = 0.2 cos(theta1) y, a triangle coupling them.
    f1, f2 = 2.0, 2.0 * np.sqrt(0.3)

    def jacobians(taus, count):
        phis = np.arange(count)[:, None] / count + f2 / f1 * taus
        J = np.zeros((count, len(taus), 2, 2))
        J[..., 0, 0] = -0.7 + 0.9 * np.cos(CIRCLE * phis)
        J[..., 1, 1], J[..., 0, 1] = 0.2 * np.cos(CIRCLE * taus), 0.5
        return J

    for unknown in (0, 1):
        found = stability_of(jacobians, (f1, f2), 0.0, 24, 15, unknown)
        assert found.multipliers == pytest.approx([1.0, np.exp(-0.7 / f1)], rel=1e-6)
        assert found.trivial.tolist() == [0][:unknown]
    assert TorusStability(np.array([1.01, 0.5]), np.array([0])).stable
    assert not TorusStability(np.array([1.01, 0.5]), np.array([], dtype=int)).stable


def test_what_is_no_torus_is_refused():
    field = forced_van_der_pol(EPS, 1.3, 1.3)
    orbit = periodic_motion(field, initial=[1.0, 0.0])
    with pytest.raises(InputError, match="second="):
        torus_branch(field, orbit, "force")
    with pytest.raises(AnalysisError, match=r"no second frequency|periodic orbit"):
        torus_branch(field, settled(field, orbit.states[0], 200.0, 1000.0), "force")
    with pytest.raises(InputError, match="harmonics = 0"):
        TorusBalance(0)
    with pytest.raises(InputError, match="contact system"):
        torus_branch(field, orbit, "force", second="drive")
    point = orbit_branch(field, orbit, "force", bounds=(1.2, 1.4)).points[0]
    with pytest.raises(InputError, match="no torus"):
        torus_motion(point)


def test_a_direction_that_dies_at_once_leaves_the_other_exponent_a_number():
    M = np.tile(np.diag([0.5, 0.0]), (8, 1, 1))
    first, second = exponents(M, 0.5 * (np.sqrt(5.0) - 1.0))
    assert first == pytest.approx(np.log(0.5), rel=1e-12)
    assert second == -np.inf
