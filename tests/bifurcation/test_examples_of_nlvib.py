"""The examples of NLvib (Krack and Gross) by their numbers, against harmonic balance by SciPy."""

from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest
from fourier import Structure, half_range
from scipy.optimize import root
from systems import TURN

from fecontact.bifurcation import HarmonicBalance, contact_field, nonlinear_mode

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def nlvib(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import nlvib

    return nlvib


def alone(example, law):
    """The structure of an example with forces of its elements in plain Python."""
    return Structure(example.M, example.C, example.K, example.rows, law)


def harmonics_at(example, branch, w, which=0):
    """Harmonics (H + 1,) of the observed displacement, and (H + 1, e) of the elements."""
    system = example.system()
    field = contact_field(system, ["load.forces.0.signal.frequency_hz"])
    point = branch.at(field, w / TURN, which)
    rows = np.array([system.basis.point_row(f"element{e}", "y")
                     for e in range(len(example.rows))])
    states = point.orbit(field, 1025).states[:-1, : system.basis.modes]
    found = np.fft.rfft(states @ rows.T, axis=0) / 512.0
    found[0] /= 2.0
    harmonics = branch.method.highest
    return point.values["observed_harmonics"][: harmonics + 1], found[: harmonics + 1]


# Responses ---------------------------------------------------------------------------------------

@pytest.mark.parametrize(("w", "amplitude"), [(0.8, 0.4748720), (1.0, 1.3053455)])
def test_1_duffing(nlvib, w, amplitude):
    """First harmonics on the upper branch that are published."""
    example = nlvib.duffing()
    found, _ = harmonics_at(example, example.branch(), w)
    assert abs(found[1]) == pytest.approx(amplitude, rel=1e-6)
    x, _ = alone(example, lambda u, v: 0.1 * u**3).response([-0.18j], w, 7, 64, seen=[1.0])
    assert found == pytest.approx(x, rel=1e-6, abs=1e-9)


def test_2_a_mass_with_an_absorber_and_cubic_springs(nlvib):
    example = nlvib.cubic_absorber()
    branch, other = example.branch(), alone(example, lambda u, v: u**3 * [1.0, 0.0042])
    for w in (0.85, 0.95, 1.35):
        x, _ = other.response([-0.11j, 0.0], w, 7, 64, seen=[1.0, 0.0])
        assert harmonics_at(example, branch, w)[0] == pytest.approx(x, rel=1e-6, abs=1e-9)


def test_3_a_unilateral_spring_at_one_of_two_masses(nlvib):
    """The largest displacement that NLvib finds, and motions of SciPy in contact."""
    example = nlvib.unilateral_spring()
    branch = example.branch()
    other = alone(example, lambda u, v: 100.0 * np.maximum(u - 1.0, 0.0))
    assert branch.column("observed_maximum").max() == pytest.approx(1.0716, abs=2e-4)
    for w in (0.6, 0.632933):
        found, elements = harmonics_at(example, branch, w, -1)
        x, _ = other.response([0.0, -0.1j], w, 21, 16384, seen=[1.0, 0.0], start=elements)
        # Contact begins between samples.
        assert np.abs(elements[:, 0] - x).max() < 1e-4
        assert np.abs(found - x[: len(found)]).max() < 1e-4


@pytest.mark.parametrize("level", [3e-4, 1e-3])
def test_6_two_springs_with_large_deflections(nlvib, level):
    example = nlvib.two_springs(level)

    def forces(u, v):
        (x, y), a, b = u.T, 1.13**2, 4.0
        r = 0.5 * (a + b) * (x**2 + y**2)
        return np.stack([1.5 * a * x**2 + b * x * y + 0.5 * a * y**2 + r * x,
                         0.5 * b * x**2 + a * x * y + 1.5 * b * y**2 + r * y], axis=1)

    branch, other = example.branch(), alone(example, forces)
    for w in (1.0, 1.1, 1.25):
        x, _ = other.response([-1j * level] * 2, w, 7, 64, seen=[1.0, 0.0])
        assert harmonics_at(example, branch, w)[0] == pytest.approx(x, rel=1e-6, abs=1e-10)


@numba.njit
def returned(u, stiffness, limit):
    """Forces (N,) of a Jenkins element over a period, after another one."""
    f, before, found = 0.0, u[-1], np.empty_like(u)
    for _ in range(2):
        for k in range(len(u)):
            f = min(max(f + stiffness * (u[k] - before), -limit), limit)
            before = u[k]
            found[k] = f
    return found


def test_7_three_masses_with_elements_of_all_kinds(nlvib):
    def forces(u, v):
        return np.stack([returned(u[:, 0], 20.0, 1.0), returned(u[:, 1], 20.0, 1.0), u[:, 2]**3,
                         u[:, 3]**3, np.maximum(u[:, 4] - 0.25, 0.0)], axis=1)

    example = nlvib.all_kinds()
    example = replace(example, bounds=(2.0, 1.4), method=HarmonicBalance(7, 512, stability=None))
    branch, other, slipped = example.branch(), alone(example, forces), []
    for w in (1.45, 1.7, 2.0):
        found, start = harmonics_at(example, branch, w, -1)
        x, u = other.response([0.0, -1j, 0.0], w, 7, 4096, seen=[0.0, 1.0, 0.0], start=start)
        # An element that does not slip keeps any mean.
        assert np.abs(found - x)[1:].max() < 2e-3 * np.abs(x).max()
        slipped.append(20.0 * half_range(u[:, 0]) > 1.5)
    assert any(slipped)


def test_8_a_beam_with_friction_at_a_node(nlvib):
    example = nlvib.beam_with_friction()
    slow = 0.5 * np.pi / example.laws["friction"].smoothing_slope
    branch, other = example.branch(), alone(example, lambda u, v: 1.5 * np.tanh(v / slow))
    first, last = example.bounds
    for w in (0.9 * first, 0.7 * first, 1.2 * last):
        x, _ = other.response(-1j * example.load, w, 13, 128, seen=example.seen)
        assert harmonics_at(example, branch, w)[0] == pytest.approx(
            x, rel=1e-5, abs=1e-7 * np.abs(x).max())


# Modes -------------------------------------------------------------------------------------------

def test_4_a_mode_of_two_masses_with_a_cubic_spring(nlvib):
    example = nlvib.cubic_mode()
    other, seen = alone(example, lambda u, v: 0.5 * u**3), np.array([1.0, 0.0])
    start = (1.0, 0.0, np.zeros((10, 2), complex))
    start[2][1] = 0.1
    for amplitude in (0.1, 0.3, 0.6, 1.0, 1.5, 2.0):
        start = other.mode(seen, amplitude, start, 64)
        if amplitude in (0.6, 2.0):
            mode = nonlinear_mode(example.system(), (1e-2, half_range(start[2][:, 0])), 1,
                                  observe=("B", "y"), method=example.method)
            assert mode.angular_frequency[-1] == pytest.approx(start[0], rel=1e-7)
            assert abs(start[1]) < 1e-9


def test_5_a_mode_of_two_masses_with_regularised_friction(nlvib):
    """The small mass sticks at small amplitudes and slides at large ones.

    Its 1024 samples tell of the phase at which they are taken, 4096 no more.
    """
    example, samples = nlvib.friction_mode(), 4096
    system, other = example.system(), alone(example, lambda u, v: 5.0 * np.tanh(v / 0.05))
    mode = nonlinear_mode(system, (1e-2, 0.5), 1, observe=("B", "y"),
                          method=replace(example.method, samples=samples))
    assert mode.angular_frequency[0] == pytest.approx(np.sqrt(640.0), rel=1e-4)
    rows = np.array([system.basis.point_row(name, "y") for name in ("element0", "B")])
    for index in range(5, len(mode), 8):
        x = np.array([rows @ mode.coordinates(k)[index] for k in range(22)])
        x *= np.exp(-1j * np.angle(x[1, 1]) * np.arange(22))[:, None]
        w, ratio = mode.angular_frequency[index], mode.damping_ratio[index]
        found = other.mode(np.array([0.0, 1.0]), abs(x[1, 1]), (w, 2.0 * ratio * w, x),
                           samples)
        assert found[0] == pytest.approx(w, rel=1e-9)
        assert found[1] / (2.0 * found[0]) == pytest.approx(ratio, rel=1e-7, abs=1e-9)
        assert half_range(found[2][:, 1]) == pytest.approx(mode.amplitude[index], rel=1e-5)
    # It is largest in between.
    assert mode.damping_ratio.max() > 1.5 * mode.damping_ratio[[0, -1]].max()


def test_9_a_mode_of_a_beam_with_a_cubic_spring_at_its_tip(nlvib):
    """Frequency and harmonics of the tip by its dynamic stiffness; at larger amplitudes than here
    five times the frequency comes near the second mode.
    """
    example = nlvib.beam_with_cubic_spring()
    M, K, tip = example.M, example.K, example.seen
    other, linear = alone(example, lambda u, v: 6e9 * u**3), nlvib.lowest(example.M, example.K)
    assert linear / TURN == pytest.approx(1.8751040687**2 / TURN / 0.7**2 * np.sqrt(
        2.05e11 * 0.014**2 / 12.0 / 7800.0), rel=1e-5)

    def stiffness(k, w):
        return 1.0 / (tip @ np.linalg.solve(K - (k * w)**2 * M, tip))

    z = np.array([1.0, 0.0, 0.0])
    for amplitude in (1e-4, 3e-4, 6e-4):
        def equations(z, amplitude=amplitude):
            u = np.zeros((6, 1), complex)
            u[[1, 3, 5], 0] = amplitude, amplitude * z[1], amplitude * z[2]
            f = other.forces(u, 1.0, 64)[:, 0].real
            return [(f[k] + stiffness(k, z[0] * linear) * u[k, 0].real)
                    / (stiffness(1, 0.0) * amplitude) for k in (1, 3, 5)]

        found = root(equations, z, tol=1e-14)
        assert np.abs(found.fun).max() < 1e-9
        z = found.x
    u = np.zeros(6, complex)
    u[[1, 3, 5]] = amplitude * np.array([1.0, *z[1:]])
    mode = nonlinear_mode(example.system(), (1e-6, half_range(u)), 1, observe=("B", "y"),
                          method=HarmonicBalance([1, 3, 5], stability=None))
    assert mode.angular_frequency[-1] == pytest.approx(z[0] * linear, rel=1e-6)
    assert z[0] > 1.1
