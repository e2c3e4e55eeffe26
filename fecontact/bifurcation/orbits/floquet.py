"""Floquet multipliers and stability of a periodic orbit."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.rounding import FLAT, Rounding
from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.bifurcation.linalg.periodic_schur import eigenvalues_of_product
from fecontact.bifurcation.linalg.transition_matrices import transitions
from fecontact.bifurcation.orbits.multiplier_rounding import LOST, WORST, MultiplierRounding
from fecontact.core.compiled import kernel
from fecontact.core.errors import AnalysisError, ModelWarning
from fecontact.core.read_only import read_only_arrays
from fecontact.core.records import ComplexVector, Vector
from fecontact.core.types import Array

# Smallest uncertainty of the distance of a multiplier from the unit circle.
_ROUNDING = 1e-8
_NEAR = 1e-2  # distance of a critical multiplier from the circle at a coarsely located point
# Multipliers by differences to one side may be so far from those to both, in parts of the largest
# or of 1: where ends of runs are smooth they are to 1e-3, beside a jump anywhere.
_APART = 0.02

# Relative distance of a multiplier from the conjugate of another one up to which they are a pair.
_PAIR = 1e-6


@kernel
def sort_multipliers(mu: ComplexVector) -> None:
    """Sort multipliers as :func:`by_falling_modulus` says."""
    for i in range(1, len(mu)):
        value, place = mu[i], i
        size = abs(value)
        while place > 0:
            before = abs(mu[place - 1])
            if not (before < size or (before == size and mu[place - 1].imag < value.imag)):
                break
            mu[place] = mu[place - 1]
            place -= 1
        mu[place] = value
    place = 0
    while place + 1 < len(mu):
        one, other = mu[place], mu[place + 1]
        if one.imag < 0.0 and abs(one - other.conjugate()) <= _PAIR * abs(one):
            mu[place], mu[place + 1] = other, one
            place += 1
        place += 1


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Floquet:
    """Stability of an orbit.

    For each multiplier mu a perturbation of the orbit grows by the factor mu in one period.

    Attributes
    ----------
    multipliers : (d,) complex array
        All multipliers, including the trivial one, by falling modulus.
    trivial : int or None
        Index of the trivial multiplier, which is one because the orbit may be shifted in time;
        None for forced systems.
    """

    multipliers: NDArray[np.complex128]
    trivial: int | None

    @property
    def others(self) -> NDArray[np.complex128]:
        """All multipliers but the trivial one."""
        if self.trivial is None:
            return self.multipliers
        return np.delete(self.multipliers, self.trivial)

    @property
    def trivial_error(self) -> float:
        """Deviation of the trivial multiplier from one: a measure of the accuracy of the orbit."""
        if self.trivial is None:
            return 0.0
        return float(abs(self.multipliers[self.trivial] - 1.0))

    @cached_property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return sum(place != self.trivial and abs(multiplier) > 1.0
                   for place, multiplier in enumerate(self.multipliers.tolist()))

    @cached_property
    def unstable_range(self) -> tuple[int, int]:
        """Smallest and largest number of multipliers outside the unit circle, given their errors.

        The error of the trivial multiplier is known. Next to a fold another multiplier is close
        to it and has an error of the same size.
        """
        error = min(max(_ROUNDING, 2.0 * self.trivial_error), WORST)
        sizes = [abs(multiplier) for place, multiplier in enumerate(self.multipliers.tolist())
                 if place != self.trivial]
        return sum(size > 1.0 + error for size in sizes), sum(size > 1.0 - error for size in sizes)

    @property
    def stable(self) -> bool:
        """Whether all perturbations decay."""
        return self.unstable == 0

    @property
    def stored(self) -> dict[str, Any]:
        """Values that the points of branches store, by name."""
        return {"multipliers": self.multipliers, "unstable": self.unstable,
                "stable": self.stable, "trivial_error": self.trivial_error}

    def tests(self, slope: float) -> dict[str, float]:
        """Test functions of special points of a branch.

        ``slope`` is the derivative of the parameter along the branch, in widths of the diagram.
        """
        doubling, unit, torus = self.products()
        # A multiplier also passes one at a fold, but there the parameter turns.
        return {"period doubling": doubling, "torus": torus,
                "branch point": -unit if slope <= -FLAT else unit}

    def products(self, *critical: complex) -> tuple[float, float, float]:
        """Functions that change sign where a multiplier passes -1, where one passes 1, and where
        a pair passes the unit circle, or the product of two real ones passes one (neutral saddle).

        Multipliers next to the critical ones are left out.
        """
        out = np.empty(3)
        multiplier_tests(self.noncritical(*critical), out)
        return float(out[0]), float(out[1]), float(out[2])

    def noncritical(self, *critical: complex) -> NDArray[np.complex128]:
        """All multipliers but the trivial one and those next to the critical ones."""
        rest = self.others
        for one in critical:
            rest = np.delete(rest, np.argmin(np.abs(rest - one)))
        return rest

    def turning(self, *critical: complex) -> complex | None:
        """The multiplier beside the critical ones, with Im mu > 0, that lies on the unit circle."""
        rest = self.noncritical(*critical)
        pairs = rest[rest.imag > 1e-6]
        away = np.abs(np.abs(pairs) - 1.0)
        return complex(pairs[np.argmin(away)]) if away.min(initial=np.inf) <= _NEAR else None

    def confirmed(self, kind: str) -> dict[str, Any] | None:
        """Classify a zero of a test function by the multipliers; None if it is no special point.

        A torus bifurcation becomes 'Neimark-Sacker', with the angle of the pair.
        """
        if kind in ("period doubling", "torus") and self.trivial_error > LOST:
            return None
        if kind == "period doubling":
            return {} if np.abs(self.others + 1.0).min() <= _NEAR else None
        if kind != "torus":
            return {}
        critical = self.turning()
        return None if critical is None else {
            "kind": "Neimark-Sacker", "angle": float(np.angle(critical))}


def floquet_of(factors: CondensedFactors, autonomous: bool) -> Floquet:
    """Floquet multipliers from the condensed equations of a periodic orbit.

    They are the eigenvalues of the product of the transition matrices of the intervals, computed
    without forming it (see :mod:`fecontact.bifurcation.linalg.periodic_schur`), so that small and
    large multipliers are equally accurate.

    Raises
    ------
    AnalysisError
        If the eigenvalues do not converge.
    """
    d = factors.end.shape[0]
    M = np.empty((len(factors.local), d, d))
    transitions(factors, M)
    return floquet_of_product(M, autonomous)


def floquet_of_product(M: Array, autonomous: bool) -> Floquet:
    """Floquet multipliers from transition matrices M (N, d, d), which may be overwritten.

    Raises
    ------
    AnalysisError
        As :func:`floquet_of`.
    """
    try:
        multipliers = eigenvalues_of_product(M)
    except ArithmeticError as error:
        raise AnalysisError(f"The Floquet multipliers were not found ({error}); use more "
                            f"intervals.") from None
    multipliers = by_falling_modulus(multipliers)
    trivial = int(np.argmin(np.abs(multipliers - 1.0))) if autonomous else None
    return Floquet(multipliers, trivial)


def by_falling_modulus(multipliers: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Multipliers (d,), the largest modulus first; of a pair the one with Im mu > 0 first."""
    found = np.array(multipliers, dtype=np.complex128)
    sort_multipliers(found)
    return found


@kernel
def multiplier_tests(mu: ComplexVector, out: Vector) -> None:
    """Fill out (3,) with the products of mu + 1, mu - 1 and, over pairs, mu_i mu_k - 1, scaled.

    They change sign where a multiplier passes -1, where one passes 1, and where a complex pair
    crosses the unit circle.
    """
    minus, plus, pairs = 1.0 + 0.0j, 1.0 + 0.0j, 1.0 + 0.0j
    for i in range(len(mu)):
        size = 1.0 + abs(mu[i])
        minus *= (mu[i] + 1.0) / size
        plus *= (mu[i] - 1.0) / size
        for k in range(i + 1, len(mu)):
            both = mu[i] * mu[k]
            if abs(both) < np.inf:
                pairs *= (both - 1.0) / (abs(both) + 1.0)
    out[0], out[1], out[2] = minus.real, plus.real, pairs.real


class FloquetTests:
    """Test functions of problems whose linearisations have multipliers, ``floquet``.

    The parameter comes last in the unknowns u and in their ``scales``.
    """

    scales: Array

    @property
    def rounding(self) -> Rounding:
        """Uncertainty of the multipliers by rounding."""
        return MultiplierRounding(float(self.scales[-1]))

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of 'period doubling', 'torus' and 'branch point'."""
        found: dict[str, float] = linearisation.floquet.tests(float(tangent[-1] / self.scales[-1]))
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """The kind of a torus bifurcation; None for a neutral saddle."""
        found: dict[str, Any] | None = linearisation.floquet.confirmed(kind)
        return found


def require_same(
    multipliers: NDArray[np.complex128], sided: Sequence[Array | None], where: str,
) -> None:
    """Warn unless derivatives by differences to either side have these multipliers too.

    ``sided`` are those of each segment, (2, 1, d, d), or None where runs are not differenced.
    """
    from scipy.optimize import linear_sum_assignment

    for side in range(2):
        product = np.eye(len(multipliers))
        for segment in sided:
            if segment is None:
                return
            with np.errstate(over="ignore", invalid="ignore"):
                product = segment[side, 0] @ product
        error = np.inf
        if np.isfinite(product).all() and np.isfinite(multipliers).all():
            apart = np.abs(np.linalg.eigvals(product)[:, None] - multipliers)
            error = float(apart[linear_sum_assignment(apart)].max())
        if not error <= _APART * max(1.0, float(np.abs(multipliers).max())):
            warnings.warn(f"At {where} the multipliers of the set-valued orbit are uncertain: by "
                          f"differences to one side they are {error:.1g} away, for an event "
                          f"appears or vanishes there, as beside complete chatter; take another "
                          f"value of the parameter.", ModelWarning, stacklevel=2)
            return
