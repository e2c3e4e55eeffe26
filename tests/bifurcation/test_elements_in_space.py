"""Elastic Coulomb elements along two tangents that slide a little, and modes with them."""

import numpy as np
import pytest
from scipy.optimize import minimize, root
from test_followed_elements import T, in_space

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, nonlinear_mode
from fecontact.bifurcation.harmonic.elements import (
    Displacements,
    ElementForces,
    follow_elements,
)
from fecontact.bifurcation.harmonic.series import series
from fecontact.laws import JenkinsFriction, LinearContact

LIMIT = 1.0  # deflection at which the element of in_space slides [m]


def ellipses(excess, count=12):
    """Displacements X (3, 3), and deflections at displacement zero (2,), of so many elements.

    Were it never to slide, an element would be deflected to (1 + excess) of its limit.
    """
    rng, tau = np.random.default_rng(3), np.linspace(0.0, 2.0 * np.pi, 1000)
    for k in range(count):
        c, s = rng.normal(size=(2, 2)) * [[1.0], [0.05 if k % 2 else 1.0]]
        offset = (0.3 if k % 4 > 1 else 1e-3) * rng.normal(size=2)
        path = np.outer(np.cos(tau), c) + np.outer(np.sin(tau), s)
        low, high = 0.0, 100.0
        for _ in range(60):
            size = 0.5 * (low + high)
            over = np.linalg.norm(size * path + offset, axis=1).max() > (1.0 + excess) * LIMIT
            low, high = (low, size) if over else (size, high)
        X = np.zeros((3, 3))
        X[1, :2], X[2, :2] = low * c, low * s
        yield X, offset


def followed(X, offset, samples):
    """Friction (2, N) and deflections (N, 2) by the code under test."""
    system = in_space()
    X = X @ system.basis.contact_T[0, :3]  # coordinates of the modes of a mass of 1 kg
    found = ElementForces(np.zeros((2, samples)), np.zeros((samples, 2)), np.zeros((0, 0, 0)))
    assert follow_elements(Displacements(X, T, series(1, samples).values), system.arrays,
                           np.array([1]), offset, False, found)
    return found.friction, found.deflections


@pytest.mark.parametrize("excess", [-1e-2, 1e-6, 1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("samples", [64, 256])
def test_an_element_gives_up_the_least_deflection_that_it_can(excess, samples):
    """An element that can stick in the end keeps the deflection nearest to its first one."""
    sticking = 0
    for X, offset in ellipses(excess):
        x = series(1, samples).values @ X[:, :2]
        held = minimize(lambda w, a=offset: ((w - a) ** 2).sum(), np.zeros(2), method="SLSQP",
                        constraints={"type": "ineq", "fun": lambda w, x=x: LIMIT**2 - (
                            (x + w) ** 2).sum(axis=1)}, options={"ftol": 1e-14})
        _, z = followed(X, offset, samples)
        assert np.linalg.norm(z, axis=1).max() < (1.0 + 1e-5) * LIMIT
        if held.success and np.linalg.norm(x + held.x, axis=1).max() < (1.0 + 1e-7) * LIMIT:
            sticking += 1
            assert z - x == pytest.approx(np.tile(held.x, (samples, 1)), abs=1e-4)
    assert sticking >= 3


def test_elements_that_slide_are_those_of_small_steps():
    """First harmonic of friction against returning to the limit at 2000 samples a period."""
    for X, offset in ellipses(0.5, 4):
        r, _ = followed(X, offset, 256)
        tau = np.arange(2000) / 2000
        x = series(1, 2000).values @ X[:, :2]
        z, friction = x[0] + offset, np.empty((2000, 2))
        for n in range(12 * 2000):
            z = z + x[n % 2000] - x[n % 2000 - 1]
            z = z * min(1.0, LIMIT / np.linalg.norm(z))
            friction[n % 2000] = 0.5 * z
        exact = 2.0 * (np.exp(-2j * np.pi * tau) @ friction) / 2000
        found = 2.0 * (r @ np.exp(-2j * np.pi * np.arange(256) / 256)) / 256
        assert found == pytest.approx(exact, abs=5e-3 * np.abs(exact).max())


TURNS = 0.0, 0.3, -0.2
K = np.array([[1.0, 0.3, 0.1], [0.3, 1.5, 0.2], [0.1, 0.2, 4.0]])
STIFFNESS, COEFFICIENT, NORMAL, PRELOAD = 1.0 / 3.0, 0.3, 1.0, 2.5 / 3.0


def rows_of_nodes():
    """Displacements (3, 3, 3) of three nodes along two tangents and the normal."""
    return np.array([[[1.0, turn, 0.0], [-turn, 1.0, 0.0], [turn, 0.0, 1.0]] for turn in TURNS])


def body():
    """A mass on springs with three elements in two directions, under varying normal forces."""
    rows = np.zeros((3, 6, 3))
    rows[:, :3] = rows_of_nodes()
    basis = fc.basis_from_matrices(np.eye(3), K, {"contact": rows, "B": rows[0], "C": rows[0]},
                                   dimension=3)
    return fc.ContactSystem(basis, LinearContact(3.0 * NORMAL, 0.0, preload=3.0 * PRELOAD),
                            JenkinsFriction(3.0 * STIFFNESS, COEFFICIENT))


def forces(X, samples=512, periods=6):
    """Harmonics (3, 3) of the contact forces on the mass by small steps; X (3, 3) by tau."""
    rows, values = rows_of_nodes(), series(1, samples).values
    d = np.einsum("jai,ni->nja", rows, values @ X)
    F = np.maximum(PRELOAD - NORMAL * d[:, :, 2], 0.0)
    z, acting = d[0, :, :2].copy(), np.empty((samples, 3))
    for n in range(periods * samples):
        here = n % samples
        z = z + d[here, :, :2] - d[here - 1, :, :2]
        limit = COEFFICIENT * F[here] / STIFFNESS
        z *= np.minimum(1.0, limit / np.maximum(np.linalg.norm(z, axis=1), 1e-300))[:, None]
        acting[here] = np.einsum("jai,ja->i", rows, np.column_stack(
            [-STIFFNESS * z, F[here]]))
    return values.T @ acting / samples * np.array([[1.0], [2.0], [2.0]])


@pytest.fixture(scope="module")
def mode():
    system = body()
    rest = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
    return nonlinear_mode(system, (0.1, 4.0), observe=("B", "x"), preload=rest,
                          method=HarmonicBalance(1, 256))


@pytest.mark.slow
def test_modes_run_through_first_slip(mode):
    assert mode.branch.status.name == "BOUND"
    assert mode.amplitude[-1] == pytest.approx(4.0, rel=1e-6)
    stuck = K + sum(STIFFNESS * one[:2].T @ one[:2] + NORMAL * np.outer(one[2], one[2])
                    for one in rows_of_nodes())
    lowest = np.sqrt(np.linalg.eigvalsh(stuck)[0]) / (2.0 * np.pi)
    assert mode.frequency_hz[0] == pytest.approx(lowest, rel=1e-6)
    assert mode.damping_ratio[0] == pytest.approx(0.0, abs=1e-6)
    assert mode.damping_ratio.max() > 0.05
    # One frequency for each amplitude, without jumps at first slip.
    assert (np.diff(mode.amplitude) > 0.0).all()
    assert np.abs(np.diff(mode.frequency_hz)).max() < 0.02 * lowest


@pytest.mark.parametrize("amplitude", [1.0, 3.0])
def test_modes_are_those_of_an_independent_harmonic_balance(mode, amplitude):
    """Mean and one harmonic by SciPy, with elements that return to their limits by small steps."""
    at = int(np.argmin(np.abs(mode.amplitude - amplitude)))
    shapes = body().basis.contact_T[0, :3]
    mean, first = (shapes @ mode.coordinates(k)[at] for k in (0, 1))
    start = np.array([mean.real, first.real, -first.imag])
    w, xi = 2.0 * np.pi * mode.frequency_hz[at], mode.xi[at]

    def left(u):
        X, w, xi = u[:9].reshape(3, 3), u[9], u[10]
        f = forces(X)
        return np.concatenate([
            K @ X[0] - f[0],
            K @ X[1] - w**2 * X[1] - xi * w * X[2] - f[1],
            K @ X[2] - w**2 * X[2] + xi * w * X[1] - f[2],
            [np.hypot(X[1, 0], X[2, 0]) - mode.amplitude[at], start[2, 0] * X[1, 0]
             - start[1, 0] * X[2, 0]]])

    found = root(left, np.concatenate([(1.02 * start).ravel(), [0.99 * w, 1.05 * xi]]), tol=1e-8)
    assert np.abs(left(found.x)).max() < 1e-6
    assert w == pytest.approx(found.x[9], rel=1e-3)
    assert xi == pytest.approx(found.x[10], rel=5e-3)
    assert np.abs(start - found.x[:9].reshape(3, 3)).max() < 5e-3 * amplitude
