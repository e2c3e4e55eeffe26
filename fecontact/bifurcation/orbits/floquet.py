"""Floquet multipliers and stability of a periodic orbit."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.bifurcation.linalg.periodic_schur import eigenvalues_of_product
from fecontact.bifurcation.linalg.transition_matrices import transitions
from fecontact.core.compiled import kernel
from fecontact.core.errors import AnalysisError, ModelWarning
from fecontact.core.read_only import read_only_arrays
from fecontact.core.records import ComplexVector, Vector
from fecontact.core.types import Array

# Smallest and largest uncertainty of the distance of a multiplier from the unit circle.
_ROUNDING, _WORST = 1e-8, 0.1
_NEAR = 1e-2  # distance of a critical multiplier from the circle at a coarsely located point
# Multipliers by differences to one side may be so far from those to both, in parts of the largest
# or of 1: where ends of runs are smooth they are to 1e-3, beside a jump anywhere.
_APART = 0.02
# Error of the trivial multiplier above which the mesh is too coarse for any conclusion.
_LOST = 0.5


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
        error = min(max(_ROUNDING, 2.0 * self.trivial_error), _WORST)
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
        doubling, unit, torus = self.products
        # A multiplier also passes one at a fold, but there the parameter turns.
        return {"period doubling": doubling, "torus": torus,
                "branch point": -unit if slope <= -FLAT else unit}

    @property
    def products(self) -> tuple[float, float, float]:
        """Functions that change sign where a multiplier passes -1, where one passes 1, and where
        a pair passes the unit circle, or the product of two real ones passes one (neutral saddle).
        """
        out = np.empty(3)
        multiplier_tests(self.multipliers, -1 if self.trivial is None else self.trivial, out)
        return float(out[0]), float(out[1]), float(out[2])

    def rest_products(self, *critical: complex) -> tuple[float, float, float]:
        """The :attr:`products` without the multipliers next to the critical ones."""
        rest, out = self.noncritical(*critical), np.empty(3)
        multiplier_tests(np.ascontiguousarray(rest), -1, out)
        return float(out[0]), float(out[1]), float(out[2])

    def noncritical(self, *critical: complex) -> NDArray[np.complex128]:
        """All multipliers but the trivial one and those next to the critical ones."""
        rest = self.others
        for one in critical:
            rest = np.delete(rest, np.argmin(np.abs(rest - one)))
        return rest

    def turning(self, *critical: complex) -> bool:
        """Whether a complex pair beside the critical multipliers lies on the unit circle."""
        rest = self.noncritical(*critical)
        pairs = rest[rest.imag > 1e-6]
        return bool(len(pairs)) and float(np.abs(np.abs(pairs) - 1.0).min()) <= _NEAR

    def confirmed(self, kind: str) -> dict[str, Any] | None:
        """Classify a zero of a test function by the multipliers; None if it is no special point.

        A torus bifurcation becomes 'Neimark-Sacker', with the angle of the pair.
        """
        mu = self.others
        if kind in ("period doubling", "torus") and self.trivial_error > _LOST:
            return None
        if kind == "period doubling":
            return {} if np.abs(mu + 1.0).min() <= _NEAR else None
        if kind != "torus":
            return {}
        pairs = mu[mu.imag > 1e-6]
        if not len(pairs) or np.abs(np.abs(pairs) - 1.0).min() > _NEAR:
            return None
        critical = pairs[np.argmin(np.abs(np.abs(pairs) - 1.0))]
        return {"kind": "Neimark-Sacker", "angle": float(np.angle(critical))}


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
    found = multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers)))]
    one, other = found[:-1], found[1:]
    with np.errstate(invalid="ignore"):
        turned = (one.imag < 0.0) & (np.abs(one - other.conj()) <= _PAIR * np.abs(one))
    for place in np.flatnonzero(turned).tolist():
        found[[place, place + 1]] = found[[place + 1, place]]
    return found


# Relative distance of a multiplier from the conjugate of another one up to which they are a pair.
_PAIR = 1e-6
# Slope of the parameter along a branch, in widths of the diagram, below which its sign is rounding,
# and below which it may be where multipliers are lost.
FLAT, _FLAT_LOST = 1e-8, 1e-4
# A multiplier differs from one if its distance exceeds this multiple of the trivial error.
_RESOLVED = 10.0


@kernel
def multiplier_tests(mu: ComplexVector, trivial: int, out: Vector) -> None:
    """Fill out (3,) with the products of mu + 1, mu - 1 and, over pairs, mu_i mu_k - 1, scaled.

    The multiplier ``trivial`` is excluded unless it is negative. The products change sign where a
    multiplier passes -1, where one passes 1, and where a complex pair crosses the unit circle.
    """
    minus, plus, pairs = 1.0 + 0.0j, 1.0 + 0.0j, 1.0 + 0.0j
    for i in range(len(mu)):
        if i == trivial:
            continue
        size = 1.0 + abs(mu[i])
        minus *= (mu[i] + 1.0) / size
        plus *= (mu[i] - 1.0) / size
        for k in range(i + 1, len(mu)):
            if k == trivial:
                continue
            both = mu[i] * mu[k]
            if abs(both) < np.inf:
                pairs *= (both - 1.0) / (abs(both) + 1.0)
    out[0], out[1], out[2] = minus.real, plus.real, pairs.real


def lost(stored: Mapping[str, Any]) -> bool:
    """Whether the multipliers of an orbit are lost in rounding, from its stored values.

    Differences that grow by more than the inverse of rounding along one part of the orbit, and
    shrink along another, as on canards, leave the trivial multiplier anywhere.
    """
    return float(stored.get("trivial_error", 0.0)) > _WORST


def unresolved(
    slopes: tuple[float, float],
    values: tuple[Mapping[str, Any], Mapping[str, Any]],
    tests: tuple[Mapping[str, float], Mapping[str, float]],
) -> set[str]:
    """Kinds of special points that may be due to round-off between two orbits of a branch.

    Towards a homoclinic orbit, on a canard and in a conservative family the parameter changes by
    less than round-off: its turns are no folds, and sign changes in the test for branch points no
    crossings. In a conservative family a second multiplier equals one throughout. Where multipliers
    are lost nothing of them counts; see :func:`uncertain_turn` for turns of the parameter.

    Parameters
    ----------
    slopes : pair of float
        Component of the tangents along the parameter, in widths of the diagram.
    values, tests : pairs of mappings
        Stored values of the two orbits, and their test functions.
    """
    flat = [abs(slope) < FLAT for slope in slopes]
    found: set[str] = {"fold"} if all(flat) else set()
    signs = [np.sign(test.get("branch point", 0.0)) * (-1.0 if slope <= -FLAT else 1.0)
             for slope, test in zip(slopes, tests, strict=True)]
    if any(flat) and signs[0] == signs[1]:
        found.add("branch point")
    if all(flat) and all(_near_one(stored) for stored in values):
        found.add("branch point")
    if any(lost(stored) for stored in values):
        found.add("branch point")
        if any(float(stored["trivial_error"]) > _LOST for stored in values):
            found |= {"period doubling", "torus"}
    return found


def uncertain_turn(
    slopes: tuple[float, float], values: tuple[Mapping[str, Any], Mapping[str, Any]]
) -> bool:
    """Return True if a sign change of the slope between two orbits may be due to round-off.

    Where multipliers are lost, tangents have errors that a small slope may not exceed.
    """
    return (any(lost(stored) for stored in values)
            and min(abs(slope) for slope in slopes) < _FLAT_LOST)


def resting(tangents: tuple[Array, Array], width: float) -> set[str]:
    """'fold' where the parameter, of this width, changes by less than round-off at both ends."""
    return {"fold"} if all(abs(float(each[-1])) / width < FLAT for each in tangents) else set()


def _near_one(stored: Mapping[str, Any]) -> bool:
    """Whether a second multiplier is indistinguishable from one."""
    off = np.sort(np.abs(np.asarray(stored["multipliers"]) - 1.0))
    error = max(float(stored["trivial_error"]), 1e-10)
    return len(off) > 1 and bool(off[1] <= _RESOLVED * error)


class FloquetTests:
    """Test functions of problems whose linearisations have multipliers, ``floquet``.

    The parameter comes last in the unknowns u and in their ``scales``.
    """

    scales: Array

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of 'period doubling', 'torus' and 'branch point'."""
        found: dict[str, float] = linearisation.floquet.tests(float(tangent[-1] / self.scales[-1]))
        return found

    def unstable_range(self, linearisation: Any, values: Any) -> tuple[int, int]:
        """Range of the number of unstable multipliers, given their errors."""
        found: tuple[int, int] = linearisation.floquet.unstable_range
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """The kind of a torus bifurcation; None for a neutral saddle."""
        found: dict[str, Any] | None = linearisation.floquet.confirmed(kind)
        return found

    def lost(self, values: Mapping[str, Any]) -> bool:
        """See :func:`fecontact.bifurcation.orbits.floquet.lost`."""
        return lost(values)

    def note(self, points: Sequence[BranchPoint]) -> str:
        """Note on lost multipliers; empty if there are none."""
        places = [point.parameter for point in points if lost(point.values)]
        folds = [f"{point.parameter:.10g}" for point in points
                 if point.kind == "fold" and lost(point.values)]
        if not places:
            return ""
        said = (f"Multipliers of {len(places)} orbit{'s' if len(places) > 1 else ''} are lost in "
                f"rounding, at parameters from {min(places):.10g} to {max(places):.10g}: nothing "
                f"is known of their stability, and of special points only folds are sought among "
                f"them.")
        return said if not folds else (
            f"{said} Beside the fold{'s' if len(folds) > 1 else ''} at {', '.join(folds)} a period "
            f"doubling may be hidden.")

    def unresolved(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """See :func:`fecontact.bifurcation.orbits.floquet.unresolved`."""
        return unresolved(self._slopes(tangents), values, tests)

    def uncertain_turn(self, tangents: Any, values: Any) -> bool:
        """See :func:`fecontact.bifurcation.orbits.floquet.uncertain_turn`."""
        return uncertain_turn(self._slopes(tangents), values)

    def _slopes(self, tangents: Any) -> tuple[float, float]:
        first, last = (float(tangent[-1] / self.scales[-1]) for tangent in tangents)
        return first, last


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
