"""Multipliers of tori.

Deviations on the section theta1 = 0 grow in one period 1 / f1 by the transition matrices M(phi) of
the linearised equations along lines, and move on by the ratio r of the frequencies: xi(phi + r) =
M(phi) xi(phi). Their mean growth per period, exp of the Lyapunov exponents, are the moduli of the
multipliers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from fecontact.bifurcation.harmonic.stability import radau_rule, set_transitions
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers

Jacobians: TypeAlias = Callable[[Array, int], Array]

# Change over a period of modes beyond which they are not resolved.
RESOLVED = 600.0
# Collocation of the linearised equations by Radau's points, which damps what is stiff: degree,
# intervals per harmonic and at least, and changes of the fastest mode on an interval up to a most.
_DEGREE, _INTERVALS, _LEAST, _CHANGES = 4, 4, 24, 1.5
_MOST = int(RESOLVED / _CHANGES)
# Periods over which the growth is averaged, and before.
_PERIODS, _BEFORE = 2000, 200
# Distance from one within which a multiplier counts as one, at least.
_ROUNDING = 1e-8


@read_only_arrays
@dataclass(frozen=True, eq=False)
class TorusStability:
    """Stability of a torus.

    Attributes
    ----------
    multipliers : (d,) array
        Mean growth of deviations in one period 1 / f1, falling; one of them is one for each
        frequency that no excitation prescribes.
    trivial : (a,) array of int
        Indices of the multipliers that are one.
    """

    multipliers: Array
    trivial: Integers

    @property
    def trivial_error(self) -> float:
        """Largest deviation of the multipliers that are one."""
        return float(np.abs(self.multipliers[self.trivial] - 1.0).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether all other deviations decay."""
        others = np.delete(self.multipliers, self.trivial)
        return bool((others < 1.0 + max(_ROUNDING, self.trivial_error)).all())


def stability_of(
    jacobians: Jacobians, frequencies: tuple[float, float], fastest: float, least: int,
    lines: int, unknown: int,
) -> TorusStability:
    """Multipliers of a torus with a number of ``unknown`` frequencies.

    The linearised equations are solved on at least so many intervals, and on as many as the
    ``fastest`` change over the period 1 / f1 needs.
    """
    intervals = max(least, min(int(fastest / _CHANGES), _MOST))
    M = transition_matrices(jacobians, frequencies[0], intervals, lines)
    growth = np.exp(exponents(M, frequencies[1] / frequencies[0]))
    near = np.argsort(np.abs(np.log(np.maximum(growth, 1e-300))))
    return TorusStability(growth, near[:unknown])


def fastest_change(jacobians: Jacobians, frequency: float, orders: tuple[int, int]) -> float:
    """Largest modulus of the eigenvalues along the torus times the period 1 / f1."""
    few = jacobians(np.arange(2 * orders[0]) / (2.0 * orders[0]), 2 * orders[1] + 1)
    return float(np.abs(np.linalg.eigvals(few)).max()) / frequency


def intervals_for(orders: tuple[int, int]) -> int:
    """Intervals of the linearised equations that the harmonics of a torus need at least."""
    return max(_LEAST, _INTERVALS * orders[0])


def transition_matrices(
    jacobians: Jacobians, frequency: float, intervals: int, lines: int
) -> Array:
    """Transition matrices M (Q, d, d) over one period 1 / f1 along Q lines.

    Parameters
    ----------
    jacobians : function
        Derivatives (Q, P, d, d) of the rates at tau (P,) of Q motions, from equidistant phi.
    frequency : float
        f1 [Hz].
    intervals : int
        Equal intervals of a period.
    lines : int
        Q.
    """
    N = intervals
    points, basis, slopes = radau_rule(_DEGREE)
    J = jacobians(((np.arange(N)[:, None] + points) / N).reshape(-1), lines)
    d = J.shape[-1]
    M, steps = np.empty((lines, d, d)), np.empty((N, d, d))
    for along, whole in zip(J, M, strict=True):
        set_transitions(np.ascontiguousarray(along), 1.0 / frequency, basis, slopes, steps)
        whole[:] = np.eye(d)
        for step in steps:
            whole[:] = step @ whole
    return M


def exponents(M: Array, ratio: float) -> Array:
    """Lyapunov exponents (d,) per period, falling, of xi(phi + r) = M(phi) xi(phi).

    M (Q, d, d) at equidistant phi are interpolated by their Fourier series. The logarithms of the
    growth are averaged with weights that vanish smoothly at both ends of the run, so that the error
    falls faster than any power of its length where they are quasi-periodic.

    References
    ----------
    S. Das, Y. Saiki, E. Sander, J. A. Yorke, Nonlinearity 30, 4111-4140 (2017).
    """
    Q, d, _ = M.shape
    c = np.fft.fft(M, axis=0) / Q
    k = np.fft.fftfreq(Q, 1.0 / Q)
    phis = np.mod(ratio * np.arange(_BEFORE + _PERIODS), 1.0)
    along = np.exp(2.0j * np.pi * np.outer(phis, k))
    matrices = np.real(along @ c.reshape(Q, -1)).reshape(-1, d, d)
    s = (np.arange(_PERIODS) + 0.5) / _PERIODS
    weights = np.exp(-1.0 / (s * (1.0 - s)))
    basis, total = np.eye(d), np.zeros(d)
    for n, step in enumerate(matrices):
        basis, upper = np.linalg.qr(step @ basis)
        # The first and last weights are zero within rounding, and growth may be.
        if n >= _BEFORE and weights[n - _BEFORE] > 0.0:
            with np.errstate(divide="ignore"):
                total += weights[n - _BEFORE] * np.log(np.abs(np.diag(upper)))
    return np.sort(total / weights.sum())[::-1]
