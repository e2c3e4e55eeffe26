"""Continuation problem of folds, period doublings and Neimark-Sacker points of orbits.

An orbit by collocation with two free parameters, and a test function at zero.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import Solution
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.predictor import Predictor, Trail
from fecontact.bifurcation.continuation.problem import BranchStatus, Problem
from fecontact.bifurcation.continuation.rounding import RestingParameter, Rounding
from fecontact.bifurcation.linalg.bordered import Bordered
from fecontact.bifurcation.orbits.collocation import CollocationProblem, Intervals
from fecontact.bifurcation.orbits.collocation_equations import CollocationLinearisation
from fecontact.bifurcation.orbits.curves.codim2_forms import orbit_form
from fecontact.bifurcation.orbits.curves.singularity import (
    ContinuedSign,
    SecondDerivatives,
    Singularity,
    along_parameter,
    gradient,
    of_doubling,
    of_fold,
    of_torus,
    second_derivatives,
)
from fecontact.bifurcation.orbits.kinks import JacobianKinks
from fecontact.bifurcation.orbits.normal_forms import Expansion, Share
from fecontact.bifurcation.orbits.restored import rescaled, restored
from fecontact.bifurcation.orbits.same_orbit import (
    HALVING,
    VANISHED_ON_CURVES,
    VANISHING,
    halves_apart,
    vanishing,
)
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

_NORMAL_FORM_STEP = 1e-3  # step of the differences of normal forms, in ranges of the states
_NEAR_ZERO = 1e-4  # part of the terms of a coefficient above which its sign needs no better ones
_AT_RESONANCE = 1e-6  # distance of the cosine of the angle, or of a multiplier, from 1 or -1 there
_LEAST = 1e-200  # in place of zero
_CUSP_RATE = 1e-3  # relative change of both parameters in a step that counts as zero
# Points at which a pair beside the critical multipliers passes the unit circle, by the curve.
_PAIRS = {"fold": "fold-Neimark-Sacker", "period doubling": "flip-Neimark-Sacker",
          "Neimark-Sacker": "double Neimark-Sacker"}


@dataclass(frozen=True, eq=False)
class OrbitCurve(Problem):
    """Orbits on which a test function vanishes, with two free parameters.

    The test functions and their derivatives are those of
    :mod:`fecontact.bifurcation.orbits.curves.singularity`. For orbits of one period it is the
    difference of their period from that, relative to it.

    The unknowns are those of the orbit, ``u = [nodes, T if it is unknown, second, first]``.

    Attributes
    ----------
    orbit : CollocationProblem
        With a second free parameter.
    kind : str
        'fold', 'period doubling', 'Neimark-Sacker' or 'period'.
    period : float
        The period [s] of all orbits, for the kind 'period'.
    sign : ContinuedSign
        Sign of the test function, continued along the curve.
    has_kinks : bool
        True if second derivatives of the field jump along the first orbit of the curve. Their share
        in the coefficients of normal forms is then computed at every point.
    """

    orbit: CollocationProblem
    kind: str
    period: float = 1.0
    sign: ContinuedSign = field(default_factory=ContinuedSign)
    has_kinks: bool = False

    keeps_matrix: ClassVar[bool] = True
    polishes: ClassVar[bool] = True
    may_turn_back: ClassVar[bool] = True
    ends: ClassVar[Mapping[str, BranchStatus]] = {VANISHING: BranchStatus.HOPF,
                                                  HALVING: BranchStatus.CLOSED}

    def linearise(self, u: Array) -> "CurveLinearised":
        """The equations about u."""
        return CurveLinearised(self, u)

    def evaluate(self, u: Array) -> "CurveLinearised":
        """Residual at u, without derivatives."""
        return CurveLinearised(self, u, whole=False)

    def weights(self) -> Array:
        """Weights of the inner product, those of the orbit."""
        return self.orbit.weights()

    @property
    def predictor(self) -> Predictor:
        """Predictor of the orbits on the curve."""
        return self.orbit.predictor

    def adapted(self, u: Array, tangent: Array) -> "tuple[OrbitCurve, Array, Array]":
        """The problem for the next step, on a new mesh."""
        orbit, moved, turned = self.orbit.adapted(u, tangent)
        return replace(self, orbit=orbit), moved, turned

    def refined(
        self, u: Array, tangent: Array, ahead: Sequence[Solution | BranchPoint]
    ) -> "tuple[OrbitCurve, Array, Array] | None":
        """See :meth:`Problem.refined`: that of the orbits."""
        finer = self.orbit.refined(u, tangent, ahead)
        return None if finer is None else (replace(self, orbit=finer[0]), *finer[1:])

    def met_again(
        self, origin: Any, u: Array, tangent: Array, like: Array, heading: Array, within: float
    ) -> Array | None:
        """Start of the curve in the unknowns of its orbit; see :meth:`Problem.met_again`."""
        return self.orbit.met_again(origin.orbit, u, tangent, like, heading, within)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Both parameters and the values stored on a branch of orbits."""
        return {**self.orbit.named(u), **self.orbit.point_of(u, linearisation.orbit,
                                      lambda _, side: linearisation.orbit_change(side, tangent)),
                "unstable": 0}

    def tests(
        self, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, float | Callable[[], float]]:
        """Tests for points of codimension two, and for orbits that shrink or become single ones."""
        found = self._codimension_two(u, linearisation)
        if self.orbit.autonomous:
            found[VANISHING] = vanishing(self.orbit, u, VANISHED_ON_CURVES)
        # Orbits of an odd number of periods of the excitation have no halves that could be equal.
        if self.orbit.autonomous or self.orbit.periods % 2 == 0:
            found[HALVING] = halves_apart(self.orbit, u)
        return found

    def _codimension_two(
        self, u: Array, linearisation: "CurveLinearised"
    ) -> dict[str, float | Callable[[], float]]:
        if self.kind == "period":
            return {}
        floquet = linearisation.orbit.floquet
        flip, unit, pair = floquet.products(*linearisation.critical)
        if self.kind == "fold":
            return {"cusp": linearisation.bend, "resonance 1:1": unit, "fold-flip": flip,
                    "fold-Neimark-Sacker": pair}
        at = linearisation.singularity
        expansion = Expansion(self.orbit, u, linearisation.orbit, at)

        def coefficient(formula: Callable[[Sequence[SecondDerivatives]], Share]) -> float:
            """A coefficient, by better derivatives than are known where it is small."""
            value, size = formula(linearisation.second_derivatives)
            if abs(value) > _NEAR_ZERO * size and not self.has_kinks:
                return value
            return expansion.coefficient(formula, _NORMAL_FORM_STEP)[0].value

        tests: dict[str, float | Callable[[], float]]
        if self.kind == "period doubling":
            tests = {"resonance 1:2": flip, "fold-flip": unit, "flip-Neimark-Sacker": pair}
            # At a resonance 1:2 the coefficient has a pole, and rounding decides its sign.
            if abs(flip) > _AT_RESONANCE:
                tests["generalised period doubling"] = lambda: flip * coefficient(
                    expansion.doubling)
            return tests
        tests = {
            f"resonance 1:{order}": at.cosine - float(np.cos(2.0 * np.pi / order))
            for order in (1, 2, 3, 4)}
        # Next to the resonances 1:1 and 1:2 the coefficient grows beyond all numbers.
        if at.turns and abs(at.cosine) < 1.0 - _AT_RESONANCE:
            tests["Chenciner"] = lambda: coefficient(expansion.torus)
        return tests | {"fold-Neimark-Sacker": unit, "flip-Neimark-Sacker": flip,
                        "double Neimark-Sacker": pair}

    @property
    def rounding(self) -> Rounding:
        """Turns of the first parameter where it rests."""
        return RestingParameter(float(self.orbit.scales[-1]))

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """Confirm a point of codimension two; a fold is a cusp if both parameters turn."""
        if kind != "fold":
            floquet, pair = linearisation.orbit.floquet, _PAIRS.get(self.kind)
            # The product of two real multipliers may be one too.
            if kind == pair and floquet.turning(*linearisation.critical) is None:
                return None
            return orbit_form(kind, self.orbit, u, linearisation.orbit,
                              *self._pairs(linearisation, kind))
        both = np.abs(tangent[-2:]) / self.orbit.scales[-2:]
        return {"kind": "turning point"} if both.max() > _CUSP_RATE else None

    def _pairs(self, linearisation: "CurveLinearised", kind: str) -> tuple[complex, complex]:
        """Multipliers of the critical pair and of the one beside it, where there are any."""
        critical = linearisation.critical
        own = max(critical, key=lambda one: one.imag) if self.kind == "Neimark-Sacker" else 1.0
        if self.kind == "Neimark-Sacker" and kind in _PAIRS.values() and kind != _PAIRS[self.kind]:
            return 1.0, own
        others = linearisation.orbit.floquet.noncritical(*critical)
        turning = others[others.imag > 0.0]
        near = turning[np.argmin(np.abs(np.abs(turning) - 1.0))] if len(turning) else 1.0
        return own, complex(near)


class PeriodCurve(OrbitCurve):
    """Orbits of one period, for whose test function Newton's method is as fast."""

    keeps_matrix: ClassVar[bool] = False


class CurveLinearised:
    """Residual of the curve's equations, and solutions of systems with their derivative."""

    def __init__(self, problem: OrbitCurve, u: Array, whole: bool = True) -> None:
        self.problem, self.u, self._whole = problem, u, whole
        self.orbit = CollocationLinearisation(problem.orbit, u, "all" if whole else "states")
        self._last: tuple[Array, Bordered] | None = None

    @cached_property
    def residual(self) -> Array:
        """Residual of the orbit, and the test function."""
        return np.append(self.orbit.residual, self.singularity.value)

    @cached_property
    def singularity(self) -> Singularity:
        """The test function, and what its derivative is made of."""
        kind = self.problem.kind
        if kind == "period":
            return Singularity(self.orbit.period / self.problem.period - 1.0, ())
        if kind == "Neimark-Sacker":
            return of_torus(self.orbit, whole=self._whole)
        found = of_fold(self.orbit) if kind == "fold" else of_doubling(self.orbit)
        return self.problem.sign.aligned(found, self.problem.orbit)

    @property
    def critical(self) -> tuple[complex, ...]:
        """The critical multipliers of the curve."""
        if self.problem.kind == "Neimark-Sacker":
            mean = self.singularity.cosine
            root = np.sqrt(complex(mean * mean - 1.0))
            return complex(mean) + root, complex(mean) - root
        return (1.0,) if self.problem.kind == "fold" else (-1.0,)

    @property
    def bend(self) -> float:
        """Curvature -w G_uu v v / w G_p of the first parameter over the orbits, at folds."""
        v = self.singularity.v
        assert v is not None
        # Zero where a curve of doubled orbits begins.
        slope = along_parameter(self.orbit, self.singularity.terms[0]) or _LEAST
        return float(self.gradient @ v / slope / (self.problem.weights() @ v**2))

    @cached_property
    def gradient(self) -> Array:
        """Derivative (n,) of the test function."""
        if self.problem.kind == "period":
            return unit(len(self.u), -3) / self.problem.period
        if self.problem.kind != "Neimark-Sacker":
            self.problem.sign.keep(self.singularity.terms[0], self.problem.orbit.times)
        return gradient(self.orbit, self.singularity.terms, self.second_derivatives)

    @cached_property
    def second_derivatives(self) -> list[SecondDerivatives]:
        """Derivatives along the vectors of the test function."""
        return second_derivatives(self.orbit, self.singularity.terms)

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs."""
        if self._last is None or self._last[0] is not row:
            self._last = row, self.orbit.with_rows([self.gradient, row])
        return self._last[1].solve(rhs)

    def orbit_change(self, side: Array, tangent: Array) -> Array:
        """Change (n,) of the orbit by a right-hand side, to the nearest one of the curve."""
        row = self.problem.weights() * tangent / (self.problem.weights() @ tangent**2)
        change = self.solve(row if self._last is None else self._last[0], side)
        if not np.isfinite(change).all():
            # The last row may be across the curve; where this one fails too, nothing is known.
            change = self.solve(row, side)
        with np.errstate(invalid="ignore"):
            return change - (row @ change) * tangent


def orbit_curve(
    field: VectorField, point: BranchPoint, second: str, widths: Mapping[str, float],
    scales: ArrayLike | None, kind: str,
) -> tuple[OrbitCurve, Array, dict[str, Any]]:
    """Problem, unknowns and attributes of the curve of some kind through a point of orbits.

    Its orbits have at least the intervals of the point.

    Parameters
    ----------
    field, point, second, scales
        As for :func:`fecontact.bifurcation.codim2_curve`.
    kind : str
        'fold', 'period doubling', 'Neimark-Sacker' or 'period'.
    widths : mapping
        Width of the diagram in each parameter by name; by default that of the branch for the first
        parameter and the magnitude of the second one.

    Raises
    ------
    InputError
        If the point is not on a branch of orbits by collocation, belongs to another field, or its
        period, which is to be kept, is that of the excitation.
    """
    # Earlier uses of the field do not choose how derivatives of the curve are formed.
    problem, u, _ = restored(field.as_new(), point)
    problem = rescaled(problem, scales, widths.get(point.branch.parameter_name))
    index = field.index(second)
    value = float(problem.values[index])
    width = widths.get(second, abs(value) or 1.0)
    orbit = replace(problem, second=index, scales=np.insert(problem.scales, -1, width),
                    sizes=Intervals.of(point.branch.method, problem.intervals), predictor=Trail())
    start = np.insert(u, -1, value)
    if kind == "period" and not orbit.autonomous:
        raise InputError(f"{point.place} has the period of the excitation, which keep='period' "
                         f"cannot keep; vary the frequency of the excitation instead.")
    kinked = kind in ("period doubling", "Neimark-Sacker") and bool(
        JacobianKinks(CollocationLinearisation(orbit, start)).passages)
    curve = (PeriodCurve if kind == "period" else OrbitCurve)(
        orbit, kind, problem.period(u), has_kinks=kinked)
    return curve, start, {**point.branch.attributes, "scales": orbit.scales, "method": replace(
        point.branch.method, intervals=problem.intervals)}
