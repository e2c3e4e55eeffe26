"""Frequency and damping over amplitude, against oscillators that are known in closed form."""

import importlib

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal.windows import blackmanharris
from scipy.special import ellipk

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, nonlinear_mode, resonance_curve
from fecontact.measured import (
    AmplitudeCurve,
    backbone_curve,
    modal_mass_at,
    mode_curve,
    ring_down,
    swept_curve,
)
from fecontact.reduction import PolynomialSpring

F0, RATIO = 40.0, 0.03


def linear(order=0, ratio=RATIO, end=2.0, rate=1000.0):
    """Decay of a linear oscillator: times, values, and the amplitude of the displacement."""
    t = np.arange(0.0, end, 1.0 / rate)
    w = 2.0 * np.pi * F0
    s = w * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
    a = (1.0 + 0.5j) * 1e-3
    return t, np.real(a * s**order * np.exp(s * t)), lambda time: abs(a) * np.exp(s.real * time)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("overlap", [0.0, 0.5])
def test_a_linear_decay_is_found_exactly(order, overlap):
    t, x, amplitude = linear(order)
    found = ring_down(t, x, derivative=order, overlap=overlap)
    assert found.frequency_hz == pytest.approx(F0, rel=1e-10)
    assert found.damping_ratio == pytest.approx(RATIO, rel=1e-10)
    assert found.amplitude == pytest.approx(amplitude(found.time), rel=1e-9)
    # Half a window of ten periods has no points.
    assert found.time[0] >= 5.0 / F0 - 2e-3
    assert found.time[-1] <= t[-1] - 5.0 / F0 + 2e-3


def test_deviations_are_those_of_white_noise():
    t, x, _ = linear(ratio=0.002, end=2.0)
    rng = np.random.default_rng(3)
    off = []
    for _ in range(120):
        found = ring_down(t, x + 2e-5 * rng.standard_normal(len(t)), frequency_hz=F0)
        off.append([(found.frequency_hz - F0) / found.frequency_deviation_hz,
                    (found.damping_ratio - 0.002) / found.damping_deviation])
    off = np.array(off)
    # Some 1800 values of each, about a tenth of which are correlated.
    assert off.std(axis=(0, 2)) == pytest.approx([1.0, 1.0], abs=0.08)
    assert np.abs(off.mean(axis=(0, 2))).max() < 0.1


def test_errors_of_the_amplitude_count_where_the_frequency_depends_on_it():
    """A chirp with f = 40 Hz + 5 Hz log A, which local fits find exactly."""
    t = np.arange(0.0, 1.2, 1e-3)
    x = np.exp(-2.0 * t) * np.cos(2.0 * np.pi * (40.0 * t - 5.0 * t**2))
    rng = np.random.default_rng(7)
    off, alone = [], []
    for _ in range(200):
        found = ring_down(t, x + 0.03 * rng.standard_normal(len(t)), frequency_hz=36.0)
        error = found.frequency_hz - np.hypot(40.0 + 5.0 * np.log(found.amplitude), 1.0 / np.pi)
        both = found.covariance_at_amplitude()
        off.extend(error / np.sqrt(both[:, 0, 0]))
        alone.extend(error / found.frequency_deviation_hz)
        assert np.sqrt(both[:, 1, 1]) == pytest.approx(found.damping_deviation, rel=0.05)
    # Some 1400 values, between whose neighbours there is a correlation.
    assert np.std(off) == pytest.approx(1.0, abs=0.1)
    assert np.std(alone) > 1.3


def test_errors_correlate_where_a_vibration_falls_much_within_a_window():
    t, x, _ = linear(ratio=0.08, end=0.3)
    clean = ring_down(t, x, frequency_hz=F0, window=6.0)
    rng = np.random.default_rng(5)
    off, said, spread = [], [], []
    for _ in range(400):
        found = ring_down(t, x + 2e-6 * rng.standard_normal(len(t)), frequency_hz=F0, window=6.0)
        off.append([np.log(found.amplitude[0] / clean.amplitude[0]),
                    found.frequency_hz[0] - clean.frequency_hz[0],
                    found.damping_ratio[0] - clean.damping_ratio[0]])
        said.append(found.correlation[0])
        spread.append([found.amplitude_deviation[0] / found.amplitude[0],
                       found.frequency_deviation_hz[0], found.damping_deviation[0]])
    known = np.mean(said, axis=0)
    assert abs(known[0, 2]) > 0.2
    # Deviations of 400 draws are off by 4 %, correlations by 0.05.
    assert np.corrcoef(np.array(off).T) == pytest.approx(known, abs=0.17)
    assert np.std(off, axis=0) == pytest.approx(np.sqrt(np.mean(np.square(spread), axis=0)),
                                                rel=0.15)


def test_another_mode_is_left_out():
    t, x, _ = linear()
    other = 2e-3 * np.exp(-2.0 * t) * np.cos(2.0 * np.pi * 95.0 * t)
    found = ring_down(t, x + other, frequency_hz=F0, t_end=0.6)
    assert found.frequency_hz == pytest.approx(F0, rel=1e-3)
    assert found.damping_ratio == pytest.approx(RATIO, rel=1e-2)


@pytest.mark.slow
def test_duffing():
    """Light damping: the frequency is that of the undamped oscillator, by an elliptic integral."""
    c, damping = 0.4, 0.006
    t = np.linspace(0.0, 800.0, 16001)
    x = solve_ivp(lambda _, y: [y[1], -y[0] - c * y[0] ** 3 - damping * y[1]], (0.0, t[-1]),
                  [1.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    found = ring_down(t, x)
    fundamental = found.amplitude
    first_order = 1.0 + 3.0 * c * fundamental**2 / 8.0
    small = fundamental < 0.45
    assert small.sum() > 5
    assert 2.0 * np.pi * found.frequency_hz[small] == pytest.approx(first_order[small], rel=1.5e-3)
    # Half the range of the motion is larger than its first harmonic, by x^3 A^3 c / 32.
    half = fundamental + c * fundamental**3 / 32.0
    stiff = c * half**2
    exact = np.pi / 2.0 * np.sqrt(1.0 + stiff) / ellipk(stiff / (2.0 * (1.0 + stiff)))
    assert 2.0 * np.pi * found.frequency_hz == pytest.approx(exact, rel=1e-3)


def test_dry_friction_takes_4_F_over_k_a_cycle():
    """Exact solution: half cycles about +-F / k."""
    w, shift = 2.0 * np.pi, 0.002
    t = np.arange(0.0, 60.0, 0.01)
    half = np.floor(t / 0.5)
    amplitude = 1.0 - shift * (2.0 * half + 1.0)
    x = np.where(half % 2 == 0, 1.0, -1.0) * (
        shift + amplitude * np.cos(w * (t - 0.5 * half)))
    found = ring_down(t, x, frequency_hz=1.0)
    assert found.frequency_hz == pytest.approx(1.0, rel=1e-4)
    slope = np.polyfit(found.time, found.amplitude, 1)[0]
    assert slope == pytest.approx(-4.0 * shift, rel=5e-3)
    assert found.damping_ratio == pytest.approx(
        2.0 * shift / (np.pi * found.amplitude), rel=1e-2)


def test_quadratic_damping():
    """x'' + c |x'| x' + w^2 x = 0: A' = -4 c w A^2 / (3 pi)."""
    c, w = 0.02, 2.0 * np.pi
    t = np.arange(0.0, 60.0, 0.02)
    x = solve_ivp(lambda _, y: [y[1], -c * abs(y[1]) * y[1] - w**2 * y[0]], (0.0, t[-1]),
                  [1.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-11).y[0]
    found = ring_down(t, x)
    assert found.damping_ratio == pytest.approx(
        4.0 * c * found.amplitude / (3.0 * np.pi), rel=6e-3)


def hardening():
    """Mass of 2 kg on a spring 5e4 N/m + 2e9 N/m^3, damping ratio 2 %."""
    rows = np.array([[1.0], [0.0], [0.0]])
    body = fc.basis_from_matrices([[2.0]], [[5e4]], {"B": rows, "C": rows}, damping=[[12.6]])
    return fc.ContactSystem(bodies={"mass": body}, links={
        "spring": PolynomialSpring("mass.B", cubic_stiffness=2e9, direction=(1.0, 0.0))})


def test_a_run_and_a_nonlinear_mode_give_the_same_curve():
    system = hardening()
    state = np.zeros(system.size)
    state[0] = 4e-3 * np.sqrt(2.0)
    run = fc.simulate(system, 1.2, initial=state, outputs=4001)
    decay = ring_down(run, point="mass.B", component="x")
    mode = nonlinear_mode(system, (2e-4, 4.5e-3), observe=("mass.B", "x"),
                          method=HarmonicBalance(5))
    curve = mode_curve(mode)
    assert isinstance(curve, AmplitudeCurve)
    assert decay.unit == curve.unit == "m"
    frequency, ratio = curve.at(decay.amplitude[decay.amplitude > 3e-4])
    seen = decay.amplitude > 3e-4
    assert seen.sum() >= 4
    assert decay.frequency_hz[seen] == pytest.approx(frequency, rel=5e-3)
    assert decay.damping_ratio[seen] == pytest.approx(ratio, rel=2e-2)
    forced = system.with_(load=fc.Load(forces=[fc.PointLoad(
        "mass.B", "x", signal=fc.laws.Harmonic(1.0, 24.0))]))
    resonances = resonance_curve(
        forced, (0.5, 10.0), "load.forces.0.signal.amplitude", (19.0, 40.0),
        frequency="load.forces.0.signal.frequency_hz", observe=("mass.B", "x"),
        condition="phase", method=HarmonicBalance(5))
    backbone = backbone_curve(resonances, modal_mass=modal_mass_at(
        system.basis, 1, "mass.B", "x"))
    frequency, ratio = curve.at(backbone.amplitude)
    assert backbone.amplitude[-1] > 4.0 * backbone.amplitude[0]
    assert backbone.frequency_hz == pytest.approx(frequency, rel=1e-3)
    assert backbone.damping_ratio == pytest.approx(ratio, rel=3e-3)


def test_swept_responses_of_a_hardening_mode():
    """First harmonics of a Duffing oscillator, with damping that grows with the amplitude."""
    m, w0, c = 2.0, 300.0, 4e9
    A = np.concatenate([np.linspace(2e-4, 2e-3, 40), np.linspace(2e-3, 2e-4, 40)])
    square, ratio = w0**2 + 0.75 * c * A**2, 0.01 + 4.0 * A
    side = np.repeat([-1.0, 1.0], 40)
    w = np.sqrt(square) * (1.0 + 0.02 * side * np.linspace(1.0, 0.1, 40)[
        np.r_[0:40, 39:-1:-1]])
    own = np.sqrt(square)
    Z = m * (square - w**2 + 2j * ratio * own * w)
    X = A * np.exp(1j * np.linspace(0.0, 2.0, 80))
    for mass in (None, m):
        found = swept_curve(w / (2.0 * np.pi), X, Z * X, modal_mass=mass)
        assert found.frequency_hz == pytest.approx(own / (2.0 * np.pi), rel=1e-8)
        assert found.damping_ratio == pytest.approx(ratio, rel=1e-6)
    noisy = X * (1.0 + 0.005 * np.random.default_rng(1).standard_normal(80))
    found = swept_curve(w / (2.0 * np.pi), noisy, Z * X)
    assert found.frequency_hz == pytest.approx(own / (2.0 * np.pi), rel=5e-3)


@pytest.mark.parametrize(("call", "told"), [
    (lambda t, x: ring_down(t), "values are missing"),
    (lambda t, x: ring_down(t, x, window=1.0), "at least 4 periods"),
    (lambda t, x: ring_down(t, x, frequency_hz=400.0), "2.5 in a period"),
    (lambda t, x: ring_down(t, x, window=200.0), "take a shorter window"),
    (lambda t, x: ring_down(t, x, overlap=1.0), "from 0 to below 1"),
    (lambda t, x: ring_down(t, x, derivative=3), "must be 0 for displacements"),
    (lambda t, x: ring_down(t, x, point="B"), "point is not known here"),
    (lambda t, x: ring_down(np.append(t[:-1], 9.0), x), "a spectrum needs even ones"),
    (lambda t, x: ring_down(t, x, frequency_hz=120.0), "stands out from the rest"),
    (lambda t, x: ring_down(t, 0.0 * x, frequency_hz=40.0), "all values are zero"),
    (lambda t, x: swept_curve(t[1:20], x[1:20], 1.0, modal_mass=-1.0), "modal_mass = -1.0"),
    (lambda t, x: swept_curve(t[:3], x[:3], 1.0), "give at least 8 values"),
    (lambda t, x: AmplitudeCurve([1.0, 2.0], [1.0], [1.0]), "one value for each"),
    (lambda t, x: AmplitudeCurve([0.0], [1.0], [1.0]), "every amplitude must be above zero"),
])
def test_wrong_input_is_told_in_one_sentence(call, told):
    t, x, _ = linear(end=1.0)
    with pytest.raises(fc.FecontactError, match=told):
        call(t, x)


@pytest.mark.parametrize(("window", "times"), [(6.0, 4001), (10.0, 4001), (10.0, 8001)])
def test_degrees_of_freedom_of_the_deviations_are_those_of_their_scatter(window, times):
    """2 m^2 / v of the mean m and the variance v of an estimated variance, at both ends."""
    rng = np.random.default_rng(3)
    t = 2e-4 * np.arange(times)
    x = np.exp(-t) * np.cos(2.0 * np.pi * 33.0 * t)
    found = [ring_down(t, x + 0.01 * rng.standard_normal(times), derivative=0, window=window,
                       frequency_hz=33.0) for _ in range(200)]
    squares = np.array([one.frequency_deviation_hz for one in found]) ** 2
    freedom = 2.0 * squares.mean(axis=0) ** 2 / squares.var(axis=0)
    # Of 200 variances the scatter is known to about 15 %.
    assert freedom.min() == pytest.approx(found[0].deviation_freedom, rel=0.45)
    assert freedom.max() > freedom.min()


@pytest.mark.parametrize(("half", "apart", "windows"), [(60, 60, 1), (60, 60, 8), (90, 20, 12)])
def test_freedom_of_the_noise_is_that_of_many_draws(half, apart, windows):
    """Twice the squared mean over the variance of the noise power, from white noise itself."""
    module = importlib.import_module("fecontact.measured.ring_down")
    step, f = 1e-3, 40.0
    averaged = (min(module._AVERAGED, windows) + 1) // 2
    places = module._beside(f, 1.0 / (2.0 * half * step))
    turn = np.exp(-2j * np.pi * step * places[:, None] * np.arange(2 * half + 1))
    noise = np.random.default_rng(5).standard_normal((8000, 2 * half + 1 + apart * (averaged - 1)))
    power = np.mean([np.abs(noise[:, k * apart : k * apart + 2 * half + 1]
                            @ (turn * blackmanharris(2 * half + 1)).T) ** 2
                     for k in range(averaged)], axis=(0, 2))
    assert module._noise_freedom(half, step, f, apart, windows) == pytest.approx(
        2.0 * power.mean() ** 2 / power.var(), rel=0.08)
