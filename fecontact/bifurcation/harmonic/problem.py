"""Continuation problem of periodic orbits by harmonic balance."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.newton import weighted_norm
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.harmonic.balance import Balance, Linearised
from fecontact.bifurcation.harmonic.series import (
    basis_at,
    differentiated,
    shifted,
    uniform_basis,
)
from fecontact.bifurcation.harmonic.stability import by_hill, by_transitions
from fecontact.bifurcation.orbits.floquet import Floquet, FloquetTests
from fecontact.bifurcation.orbits.same_orbit import HALVING, same_place
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Points per harmonic, and at least, among which extremes are looked for.
_FINE, _LEAST_FINE = 12, 96
# Largest curvature correction of the predictor, in steps.
_MOST_BENT = 0.2
# Largest relative size of the odd harmonics of a doubled orbit that is a single one, and smallest
# part of the tangent that leads back to doubled ones.
_HALVES_MEET, _HALVES_PART = 0.02, 0.9


class HarmonicLinearisation(Linearised):
    """As :class:`Linearised`, with stability."""

    problem: "HarmonicProblem"

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability."""
        if self.problem.stability == "transitions":
            return by_transitions(self.problem, self.u, self.memory)
        return by_hill(self.problem, self.u, self.derivatives[1])

    @cached_property
    def neglected(self) -> tuple[float, float]:
        """Estimates of the error: of the orbit, and of its equations.

        The neglected harmonics k > H of the rates, f_k, would add x_k = (i k w - J_0)^-1 f_k to
        the orbit, J_0 the mean derivative. The first number is their root mean square over that of
        harmonics 1 to H of displacements and other states, in their scales; the second that of f_k,
        the residual in time, over that of x'.
        """
        problem, layout, H = self.problem, self.problem.layout, self.problem.harmonics
        end, m = layout.states - layout.memory, layout.displacements
        most = min(3 * H + 2, (problem.samples - 1) // 2)
        if most <= H:
            return np.nan, np.nan
        # Velocities are those of the series: no harmonics of q' are neglected.
        spectrum = 2.0 * np.fft.rfft(self.rates[:, :end], axis=0) / problem.samples
        left = spectrum[H + 1 : most + 1].copy()
        left[:, :m] = 0.0
        mean = self.derivatives[1][:, :end, :end].mean(axis=0)
        turns = 2.0j * np.pi / self.period * np.arange(H + 1, most + 1)
        try:
            added = np.linalg.solve(turns[:, None, None] * np.eye(end) - mean, left[:, :, None])
        except np.linalg.LinAlgError:
            return np.nan, np.nan
        sizes = problem.scales[layout.columns]
        kept = np.linalg.norm(problem.coefficients(self.u)[1:] / sizes)
        rate_sizes = np.abs(spectrum[1:, m:]).max(axis=0) + 1e-300
        return (float(np.linalg.norm(added[:, layout.columns, 0] / sizes) / (kept or 1.0)),
                float(np.linalg.norm(left[:, m:] / rate_sizes)
                      / np.linalg.norm(spectrum[1 : H + 1, m:] / rate_sizes)))


@dataclass(frozen=True, eq=False)
class HarmonicProblem(FloquetTests, Balance, Problem):
    """The problem of following orbits by harmonic balance; see :class:`Balance`.

    Attributes
    ----------
    stability : str
        'transitions' or 'Koopman-Hill', see :mod:`fecontact.bifurcation.harmonic.stability`.
    before : tuple of (n,) arrays
        u and tangent at the start of the last step, for the curvature of the predictor.
    bend : (n,) array, optional
        Derivative of the tangent along the branch.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow with the orbit; None keeps the
        scales constant.
    """

    stability: str = "transitions"
    before: tuple[Array, ...] = ()
    bend: Array | None = None
    limits: Array | None = None

    keeps_matrix: ClassVar[bool] = True

    def linearise(self, u: Array) -> HarmonicLinearisation:
        """Residual and linearisation at u, each computed on demand."""
        if self.autonomous and not u[-2] > 0.0:
            raise AnalysisError("The period became negative.")
        return HarmonicLinearisation(self, u)

    def predicted(self, u: Array, tangent: Array, step: float) -> Array:
        """Predictor along the tangent, with the curvature of the last step."""
        guess = u + step * tangent
        if self.bend is None:
            return guess
        aside = 0.5 * step * step * self.bend
        return guess if weighted_norm(self.weights(), aside) > _MOST_BENT * step else guess + aside

    def adapted(self, u: Array, tangent: Array) -> "tuple[HarmonicProblem, Array, Array]":
        """The problem for the next step, with the phase condition at u."""
        bend = None
        if self.before:
            start, direction = self.before
            length = float(self.weights() * direction @ (u - start))
            bend = (tangent - direction) / length if length > 0.0 else None
        return replace(self, reference=self.coefficients(u).copy(), values=self.parameters(u),
                       scales=self._grown(u), before=(u, tangent), bend=bend), u, tangent

    def _grown(self, u: Array) -> Array:
        """Scales of states, period and parameter, enlarged with the orbit."""
        if self.limits is None:
            return self.scales
        layout, found = self.layout, self.scales.copy()
        X = self.coefficients(u)[1:]
        found[layout.columns] = np.sqrt(np.einsum("ki,ki->i", X, X))
        found = np.clip(found, self.scales, np.append(self.limits, self.scales[-2:]))
        return found if (found > 1.5 * self.scales).any() else self.scales

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, the errors of the truncation and the extremes of the states."""
        stability = linearisation.floquet
        low, high = self.extremes(u, linearisation.memory)
        error, residual = linearisation.neglected
        return {"period": self.period(u), "multipliers": stability.multipliers,
                "unstable": stability.unstable, "stable": stability.stable,
                "trivial_error": stability.trivial_error, "truncation_error": error,
                "residual": residual, "minimum": low, "maximum": high,
                **({"memory": linearisation.memory} if self.layout.memory else {})}

    def extremes(self, u: Array, z: Array) -> tuple[Array, Array]:
        """Smallest and largest value (d,) of each state over the orbit."""
        fine = max(_LEAST_FINE, _FINE * self.harmonics)
        whole = self.whole(u, self.period(u))
        x = uniform_basis(fine, self.harmonics) @ whole
        found = []
        for sign in (-1.0, 1.0):
            best, place = _peaks(sign * x)
            # The series where the parabola has its peak: exact but for the square of its error.
            there = np.einsum("ik,ki->i", basis_at(place / fine, self.harmonics), whole)
            best = np.maximum(best, sign * there)
            found.append(sign * np.append(best, (sign * z).max(axis=0)))
        return found[0], found[1]

    def unstable_range(self, linearisation: Any, values: Any) -> tuple[int, int]:
        """Range of the number of unstable multipliers, given their errors."""
        found: tuple[int, int] = linearisation.floquet.unstable_range
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """The kind of a torus bifurcation; None for a neutral saddle.

        A branch point at which a doubled orbit becomes a single one is a period halving.
        """
        if kind == "branch point" and self._halves_meet(u, tangent):
            return {"kind": HALVING}
        found: dict[str, Any] | None = linearisation.floquet.confirmed(kind)
        return found

    def _halves_meet(self, u: Array, tangent: Array) -> bool:
        """Whether an orbit has even harmonics alone, while the branch adds odd ones."""
        sizes = self.scales[self.layout.columns]

        def odd_part(vector: Array) -> float:
            X = self.coefficients(vector)[1:] / sizes
            whole = np.linalg.norm(X)
            odd = np.linalg.norm(np.concatenate([X[0::4], X[1::4]]))
            return float(odd / whole) if whole > 0.0 else 1.0

        return odd_part(u) < _HALVES_MEET and odd_part(tangent) > _HALVES_PART

    def met_again(
        self, origin: "Problem", u: Array, tangent: Array, like: Array, heading: Array,
        within: float,
    ) -> Array | None:
        """See :meth:`Problem.met_again`: in the phase of ``like``."""
        if len(u) != len(like) or not same_place(self, (u, tangent), (like, heading), within):
            return None
        return self._in_phase(u, like)

    def _in_phase(self, u: Array, like: Array) -> Array:
        """An orbit shifted in time to match another one."""
        weights = self.weights()

        def moved(shift: float) -> Array:
            return np.append(shifted(self.coefficients(u), shift).reshape(-1), u[-self.common :])

        def apart(shift: float) -> float:
            return weighted_norm(weights, moved(shift) - like)

        if not self.autonomous:
            return moved(min((k / self.periods for k in range(self.periods)), key=apart))
        count = 8 * self.harmonics + 8
        shift = min((k / count for k in range(count)), key=apart)
        # Newton's method for the phase condition.
        for _ in range(5):
            X = shifted(self.coefficients(u), shift)
            slope = float(self.phase_row @ differentiated(X).reshape(-1))
            if slope == 0.0:
                break
            shift -= float(self.phase_row @ X.reshape(-1)) / slope
        return moved(shift)


def peaks(x: Array) -> tuple[Array, Array]:
    """Extremes (d,) of samples (N, d) around a period, on parabolas through three of them."""
    return -_peaks(-x)[0], _peaks(x)[0]


def _peaks(x: Array) -> tuple[Array, Array]:
    """Largest values (d,), and their places (d,) counted in samples."""
    place, columns = x.argmax(axis=0), np.arange(x.shape[1])
    here = x[place, columns]
    left, right = x[place - 1, columns], x[(place + 1) % len(x), columns]
    bend = left - 2.0 * here + right
    curved = bend < 0.0
    safe = np.where(curved, bend, -1.0)
    return (np.where(curved, here - (right - left) ** 2 / (8.0 * safe), here),
            np.where(curved, place - (right - left) / (2.0 * safe), place))
