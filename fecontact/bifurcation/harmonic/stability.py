"""Floquet multipliers of orbits by harmonic balance."""

from functools import cache, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals, expm

from fecontact.bifurcation.harmonic.balance import Balance
from fecontact.bifurcation.harmonic.compiled.arrays import Equations
from fecontact.bifurcation.harmonic.compiled.orbits import derivatives_along
from fecontact.bifurcation.harmonic.layout import all_coefficients, around
from fecontact.bifurcation.harmonic.memory import LEAK
from fecontact.bifurcation.harmonic.series import basis_at
from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.linalg.motion_transitions import integrals, motion_transitions
from fecontact.bifurcation.linalg.transition_matrices import transitions
from fecontact.bifurcation.orbits.floquet import Floquet, by_falling_modulus, floquet_of_product
from fecontact.bifurcation.orbits.mesh import basis_at_points, rule
from fecontact.core.types import Array

# Collocation of the linearised equations: degree, intervals per harmonic, at least, and samples for
# each: who takes more samples, for kinks, gets more intervals too. Kinks of normal forces are means
# over four samples, which two intervals resolve.
_DEGREE, _INTERVALS, _LEAST, _PER_SAMPLE, _PER_KINK = 4, 3, 20, 4, 2
# From so many states on multipliers are those of the product of all transitions, which takes a
# fraction of the time, unless it has had entries of this size: smaller multipliers than 1e-12 of
# it are then rounding.
_MANY, _LARGEST = 16, 1e4
# Largest size of the derivatives of several orbits that are made at once.
_NUMBERS = 200_000


@cache
def _grid(intervals: int, radau: bool, harmonics: int) -> tuple[Array, Array]:
    """Times tau of the collocation points, and the series there."""
    tau = ((np.arange(intervals)[:, None] + _collocation(radau)[0]) / intervals).reshape(-1)
    return tau, basis_at(tau, harmonics)


@cache
def _collocation(radau: bool) -> tuple[Array, Array, Array]:
    """Points in (0, 1], and values and slopes there of polynomials through equal nodes."""
    if not radau:
        chosen = rule(_DEGREE)
        return chosen.points, chosen.values, chosen.slopes
    return radau_rule(2)


@cache
def radau_rule(degree: int) -> tuple[Array, Array, Array]:
    """Radau's points (s,) in (0, 1], the last of which is 1, and values and slopes (s, s + 1) there
    of polynomials through s + 1 equidistant nodes.
    """
    legendre = np.polynomial.legendre.Legendre
    roots = (legendre.basis(degree) - legendre.basis(degree - 1)).roots()
    points = np.sort((1.0 + np.real(roots)) / 2.0)
    return points, *basis_at_points(degree, points)


def by_transitions(problem: Balance, u: Array, z: Array) -> Floquet:
    """Multipliers from the linearised equations about the orbit, x' = J(t) x.

    They are solved by Gauss collocation of degree 4 on 3 H or N / 4 intervals; the multipliers are
    as accurate as the orbit, so that one that should be one shows its error. With friction that
    has memory, by Radau's of degree 2, which damps what is stiff, from sample to sample, with
    internal variables z (N, c) linear between these: kinks leave errors of the order of 1 / N. An
    element that never slides has the multiplier exp(-1e-6) of the leak that z is marched with.
    """
    T = problem.period(u)
    N, radau = _intervals(problem)
    tau, series = _grid(N, radau, problem.harmonics)
    x = np.concatenate([series @ problem.whole(u, T), around(z, tau)], axis=1)
    t = np.zeros(len(tau)) if problem.autonomous else tau * T
    values = problem.parameters(u)
    f, J, _ = problem.field.derivatives(t, x, values)
    problem.add_kinks(t, x, values, T, f, J)
    return _floquet(problem, T, J)


def along_orbits(
    problem: Balance, us: Array, zs: Array, e: Equations
) -> list[Floquet]:
    """Stability by :func:`by_transitions` of K forced orbits us (K, n + 1) with zs (K, N, c)."""
    intervals, radau = _intervals(problem)
    tau, series = _grid(intervals, radau, problem.harmonics)
    layout, d = problem.layout, problem.layout.states
    periods = np.array([problem.period(u) for u in us])
    X = all_coefficients(layout, us[:, : problem.size].reshape(len(us), -1, layout.harmonic),
                         periods[:, None, None])
    found: list[Floquet] = []
    most = max(1, _NUMBERS // (len(tau) * d * d))
    for first in range(0, len(us), most):
        some = slice(first, first + most)
        x = np.concatenate([series @ X[some], around(zs[some], tau)], axis=2)
        J = np.empty((*x.shape, d))
        derivatives_along(us[some, -1].copy(), x, tau, e, J)
        found += [_floquet(problem, T, each)
                  for T, each in zip(periods[some].tolist(), J, strict=True)]
    return found


def _intervals(problem: Balance) -> tuple[int, bool]:
    """Number of intervals, and whether Radau's collocation is taken."""
    if problem.layout.memory:
        return problem.samples, True
    per_sample = _PER_KINK if problem.onsets.size else _PER_SAMPLE
    return max(_LEAST, _INTERVALS * problem.harmonics, problem.samples // per_sample), False


def stability_grid(problem: Balance) -> tuple[Array, Array]:
    """Widths (N,) of the intervals of the linearised equations, in periods, and points in each."""
    N, radau = _intervals(problem)
    return np.full(N, 1.0 / N), _collocation(radau)[0]


def _floquet(problem: Balance, T: float, J: Array) -> Floquet:
    """Multipliers from derivatives (P, d, d) at the collocation points."""
    layout = problem.layout
    N, radau = _intervals(problem)
    points, basis, slopes = _collocation(radau)
    M = np.empty((N, layout.states, layout.states))
    if layout.displacements and not layout.memory:
        motion_transitions(J, T / N, points, *integrals(tuple(points.tolist())), M)
        return _of_transitions(problem, T, M, J)
    for k in range(layout.states - layout.memory, layout.states):
        J[:, k, k] -= LEAK / T
    set_transitions(J, T, basis, slopes, M)
    return _of_transitions(problem, T, M, J)


def set_transitions(J: Array, period: float, values: Array, slopes: Array, M: Array) -> None:
    """Fill M (N, d, d) with the transition matrices of x' = J x over N equal parts of a period.

    J (N s, d, d) is given at collocation points, where the basis has ``values`` and ``slopes``
    (s, s + 1).
    """
    factors, rates, nothing, widths = _workspace(len(M), len(values), M.shape[1])
    condensation.condense(J, rates, nothing, widths, period, values, slopes, 0, factors)
    transitions(factors, M)


def _of_transitions(problem: Balance, T: float, M: Array, J: Array) -> Floquet:
    """Multipliers from transition matrices M (N, d, d)."""
    layout = problem.layout
    if problem.autonomous or not layout.displacements or layout.states < _MANY:
        return floquet_of_product(M, problem.autonomous)
    # Velocities in the scale of displacements, by the stiffness of each coordinate.
    m, scale = layout.displacements, np.ones(layout.states)
    stiffness = -J[:, m : 2 * m, :m].mean(axis=0).diagonal()
    scale[m : 2 * m] = np.sqrt(np.maximum(stiffness, (2.0 * np.pi / T) ** 2))
    products = M * (scale / scale[:, None])
    for before, step in pairwise(products):
        step[:] = step @ before
    if not np.abs(products[1:]).max(initial=0.0) < _LARGEST:
        return floquet_of_product(M, False)
    found = np.asarray(eigvals(products[-1]), dtype=np.complex128)
    return Floquet(by_falling_modulus(found), None)


@lru_cache(maxsize=8)
def _workspace(
    intervals: int, points: int, states: int
) -> tuple[condensation.CondensedFactors, Array, Array, Array]:
    """Workspace for factors, and what they are made with: no rates, no parameters, and widths."""
    return (condensation.factors_for(intervals, points, states, 1),
            np.zeros((intervals * points, states)), np.zeros((intervals * points, states, 1)),
            np.full(intervals, 1.0 / intervals))


def hill_matrix(J: Array, period: float, order: int) -> NDArray[np.complex128]:
    """Hill's matrix ((2 K + 1) d, (2 K + 1) d), rows and columns k = -K..K, of x' = J(t) x.

    Its blocks are J_(k - l) - i k w delta_kl with the Fourier coefficients of J, from equidistant
    samples J (N, d, d) over one period.
    """
    N, d = len(J), J.shape[1]
    spectrum = np.fft.fft(J, axis=0) / N
    k = np.arange(-order, order + 1)
    apart = k[:, None] - k[None, :]
    blocks = np.where((np.abs(apart) <= (N - 1) // 2)[:, :, None, None], spectrum[apart % N], 0.0)
    whole = np.ascontiguousarray(blocks.transpose(0, 2, 1, 3)).reshape(len(k) * d, len(k) * d)
    turns = np.repeat(-2.0j * np.pi / period * k, d)
    return np.asarray(whole + np.diag(turns))


def koopman_hill(J: Array, period: float, order: int) -> NDArray[np.float64]:
    """Monodromy matrix (d, d) of x' = J(t) x by the Koopman-Hill projection.

    The functions z_k = exp(-i k w t) x obey z' = H z with Hill's matrix H, cut off at k = +-K; all
    begin as x(0), and z_0(T) = x(T). So no exponents need to be sorted. The error falls
    exponentially with K, beyond about |J| T times the highest harmonic of J.

    References
    ----------
    F. Bayer, R. I. Leine, Sorting-free Hill-based stability analysis of periodic solutions through
    Koopman analysis, Nonlinear Dynamics 111 (2023).
    """
    d = J.shape[1]
    whole = expm(hill_matrix(J, period, order) * period)
    middle = whole[order * d : (order + 1) * d].reshape(d, -1, d)
    return np.asarray(middle.sum(axis=1).real)


def by_hill(problem: Balance, u: Array, J: Array) -> Floquet:
    """Multipliers by the Koopman-Hill projection with K = 2 H; J (N, d, d) at the samples."""
    monodromy = koopman_hill(J, problem.period(u), 2 * problem.harmonics)
    return floquet_of_product(monodromy[None], problem.autonomous)
