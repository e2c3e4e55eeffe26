"""Floquet multipliers of orbits by harmonic balance."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from fecontact.bifurcation.harmonic.balance import Balance
from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.orbits.floquet import Floquet, floquet_of
from fecontact.bifurcation.orbits.mesh import rule
from fecontact.core.types import Array

# Collocation of the linearised equations: degree, and intervals per harmonic and at least.
_DEGREE, _INTERVALS, _LEAST = 4, 3, 20


def by_transitions(problem: Balance, u: Array) -> Floquet:
    """Multipliers from the linearised equations about the orbit, x' = J(t) x.

    They are solved by Gauss collocation of degree 4 on 3 H intervals, at least 20, with internal
    variables linear between their samples. The accuracy is that of the orbit, so that a multiplier
    that should be one shows its error.
    """
    T, values = problem.period(u), problem.parameters(u)
    chosen = rule(_DEGREE)
    N = max(_LEAST, _INTERVALS * problem.harmonics)
    widths = np.full(N, 1.0 / N)
    tau = ((np.arange(N)[:, None] + chosen.points) / N).reshape(-1)
    x = problem.states(u, T, tau)
    t = np.zeros(len(tau)) if problem.autonomous else tau * T
    f, J, _ = problem.field.derivatives(t, x, values)
    factors = condensation.factors_for(N, _DEGREE, x.shape[1], 1)
    condensation.condense(J, f, np.zeros((*f.shape, 1)), widths, T, chosen.values, chosen.slopes, 0,
                          factors)
    return floquet_of(factors, problem.autonomous)


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
    found = np.linalg.eigvals(koopman_hill(J, problem.period(u), 2 * problem.harmonics))
    found = found[np.argsort(-np.abs(found))].astype(complex)
    trivial = int(np.argmin(np.abs(found - 1.0))) if problem.autonomous else None
    return Floquet(found, trivial)
