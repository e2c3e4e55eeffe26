"""Continuation problem of periodic orbits by harmonic balance."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.predictor import BENT, Predictor
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, Problem
from fecontact.bifurcation.continuation.rounding import RestingParameter, Rounding
from fecontact.bifurcation.fields.fast_modes import unresolved_modes
from fecontact.bifurcation.fields.jumps import missed_jumps
from fecontact.bifurcation.harmonic import estimates
from fecontact.bifurcation.harmonic.balance import UNREPEATED, Balance, Linearised, zero_left_out
from fecontact.bifurcation.harmonic.compiled.arrays import TOLERANCE, Equations
from fecontact.bifurcation.harmonic.compiled.balance import MOST_UNKNOWNS
from fecontact.bifurcation.harmonic.compiled.orbits import (
    DERIVATIVES,
    ORBIT,
    RESIDUAL,
    SOLUTION,
    evaluate,
)
from fecontact.bifurcation.harmonic.compiled.step_batches import StepBatches
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.series import differentiated, shifted
from fecontact.bifurcation.harmonic.stability import by_hill, by_transitions, stability_grid
from fecontact.bifurcation.harmonic.stored import ERRORS, StoredOrbits, StoredValues
from fecontact.bifurcation.orbits.floquet import Floquet, FloquetTests
from fecontact.bifurcation.orbits.multiplier_rounding import MultiplierRounding
from fecontact.bifurcation.orbits.same_orbit import (
    HALVING,
    VANISHING,
    near_saddle,
    same_place,
    shrunk,
)
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Largest relative size of the odd harmonics of a doubled orbit that is a single one, and smallest
# part of the tangent that leads back to doubled ones.
_HALVES_MEET, _HALVES_PART = 0.02, 0.9
_NONE = np.empty(0)


def orientation(matrix: Array, weights: Array, tangent: Array) -> float:
    """Sign of det [[matrix], [w tangent]], computed with scaled unknowns and rows."""
    square = np.vstack([matrix, weights * tangent]) * weights**-0.5
    return float(np.linalg.slogdet(square / np.abs(square).max(axis=1)[:, None])[0])


class HarmonicLinearisation(Linearised):
    """Residual and linear systems at u as in :class:`Linearised`, and stability."""

    problem: "HarmonicProblem"

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability."""
        if self.problem.stability != "Koopman-Hill":
            return by_transitions(self.problem, self.u, self.memory)
        return by_hill(self.problem, self.u, self.by_states)

    @cached_property
    def neglected(self) -> tuple[float, float]:
        """Estimates of the error: of the orbit, and of its equations; see :mod:`estimates`."""
        problem, (forces, mean) = self.problem, self._samples()
        X, sizes = problem.coefficients(self.u), problem.sizes
        if problem.waves is not None:
            return problem.waves.neglected(X, forces, self.period, float(self.u[-1]), sizes,
                                           problem.harmonics_kept), np.nan
        error, residual = estimates.neglected(
            X[None], forces[None], mean[None], np.array([self.period]), sizes,
            problem.orders)
        return float(error[0]), float(residual[0])

    def _samples(self) -> tuple[Array, Array]:
        """Rates (N, b) of velocities and other states, and their mean derivatives."""
        rows = self.problem.layout.rows
        return self.rates[:, rows], self.derivatives[1][:, rows, : rows.stop].mean(axis=0)


class CompiledLinearisation(HarmonicLinearisation):
    """Linearisation of forced contact systems, by compiled code."""

    def __init__(
        self, problem: "HarmonicProblem", u: Array, e: Equations, derivatives: bool
    ) -> None:
        super().__init__(problem, u)
        self._equations, self._derivatives = e, derivatives

    def _evaluated(self, derivatives: bool) -> tuple[Array, ...]:
        """Residual, z and forces at the samples; and derivatives, condensed and in the mean."""
        workspace, m = self._equations.workspace, self.problem.layout.displacements
        forces, mean = np.empty((self.problem.samples, m)), np.empty((m, 2 * m))
        # The parameter may lie beside the range of the equations, where they hold too.
        if not evaluate(np.ascontiguousarray(self.u), DERIVATIVES if derivatives else RESIDUAL,
                        self._equations, forces, mean, _NONE, _NONE, _NONE):
            raise AnalysisError(UNREPEATED)
        found = workspace.residual.copy(), workspace.z.copy(), forces
        n = len(workspace.residual)
        if not derivatives:
            return found
        condensed = workspace.condensed.reshape(n, n + 1).copy()
        return *found, zero_left_out(condensed, self.problem.left_out), mean

    @cached_property
    def _values(self) -> tuple[Array, ...]:
        if self._derivatives or "_whole" in self.__dict__:
            return self._whole
        return self._evaluated(False)

    @cached_property
    def _whole(self) -> tuple[Array, ...]:
        return self._evaluated(True)

    @property
    def residual(self) -> Array:
        """Residual (n,)."""
        return self._values[0]

    @property
    def memory(self) -> Array:
        """Internal variables (N, c) at the samples."""
        return self._values[1]

    @property
    def condensed(self) -> Array:
        """Derivatives (n, n + 1) of the residual."""
        return self._whole[3]

    def _samples(self) -> tuple[Array, Array]:
        return self._whole[2], self._whole[4]


class BodyLinearisation(HarmonicLinearisation):
    """Linearisation of forced bodies with more modes than compiled code solves for together."""

    def __init__(self, problem: "HarmonicProblem", u: Array, e: Equations) -> None:
        super().__init__(problem, u)
        self._equations: Equations | None = e

    def solve(self, row: Array, rhs: Array) -> Array:
        """See :meth:`Linearised.solve`."""
        if self._equations is not None:
            m, found = self.problem.layout.displacements, np.array(rhs, dtype=float)
            forces, mean = np.empty((self.problem.samples, m)), np.empty((m, 2 * m))
            if evaluate(np.ascontiguousarray(self.u), SOLUTION, self._equations, forces, mean,
                        np.ascontiguousarray(row), self.problem.weights(), found):
                return found
            self._equations = None
        return super().solve(row, rhs)


@dataclass(frozen=True, eq=False)
class HarmonicProblem(FloquetTests, Balance, Problem):
    """The problem of following orbits by harmonic balance; see :class:`Balance`.

    Attributes
    ----------
    stability : str
        'transitions' or 'Koopman-Hill', see :mod:`fecontact.bifurcation.harmonic.stability`; None
        for none.
    predictor : Predictor
        Of the next orbit, from those before it.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow with the orbit; None keeps the
        scales constant.
    row : (d,) array, optional
        Row of the observed displacement of responses.
    """

    stability: str | None = "transitions"
    predictor: Predictor = BENT
    limits: Array | None = None
    row: Array | None = None

    keeps_matrix: ClassVar[bool] = True
    polishes: ClassVar[bool] = True
    ends: ClassVar[Mapping[str, BranchStatus]] = {VANISHING: BranchStatus.HOPF}

    @property
    def method(self) -> HarmonicBalance:
        """The options with which this is the problem of a branch."""
        return HarmonicBalance(self.orders or self.harmonics, self.samples,
                               stability=self.stability,
                               repeats=None if self.waves is None else self.waves.repeats)

    def attributes(self) -> dict[str, Any]:
        """Attributes of a branch from which the problem of its points is restored."""
        field, layout = self.field, self.layout
        found: dict[str, Any] = {} if self.limits is None else {"limits": self.limits}
        if self.waves is not None:
            found |= self.waves.repeats.attributes()
        return {**found, **attributes_of(field, self.values), "scales": self.scales,
                "method": replace(self.method, repeats=None), "periods": self.periods,
                "displacements": layout.displacements, "memory": layout.memory,
                "memory_nodes": layout.nodes,
                **({"kept_deflections": self.kept.offsets} if layout.memory else {})}

    @cached_property
    def rounding(self) -> Rounding:
        """Of the multipliers, if they are known."""
        width = float(self.scales[-1])
        return RestingParameter(width) if self.stability is None else MultiplierRounding(width)

    @property
    def kinked(self) -> bool:
        """See :attr:`Problem.kinked`; vector fields that are no contact systems count as smooth."""
        return self.compiled is not None and self.compiled.contact_field.kinked

    def linearise(self, u: Array) -> HarmonicLinearisation:
        """Residual and linearisation at u, each computed on demand."""
        return self._about(u, True)

    def evaluate(self, u: Array) -> HarmonicLinearisation:
        """Residual at u, for callers that need no derivatives."""
        return self._about(u, False) if type(self) is HarmonicProblem else self.linearise(u)

    def _about(self, u: Array, derivatives: bool) -> HarmonicLinearisation:
        if self.autonomous and not u[-2] > 0.0:
            raise AnalysisError("The period became negative.")
        e = self.equations(float(u[-1]))
        if e is None:
            return HarmonicLinearisation(self, u)
        if self.size > MOST_UNKNOWNS:
            return BodyLinearisation(self, u, e)
        return CompiledLinearisation(self, u, e, derivatives)

    def orientation(self, linearisation: Any, tangent: Array) -> float:
        """Sign of the determinant of the equations, in their scales, with the tangent below."""
        return orientation(linearisation.condensed, self.weights(), tangent)

    def adapted(self, u: Array, tangent: Array) -> "tuple[HarmonicProblem, Array, Array]":
        """The problem for the next step, with the phase condition at u."""
        return replace(
            self, reference=self.coefficients(u).copy(), values=self.parameters(u),
            scales=self._grown(u),
            predictor=self.predictor.after(self.weights(), u, tangent)), u, tangent

    def point(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any]:
        """Period, stability, the errors of the truncation and the extremes of the states."""
        known = dict(self._stability(linearisation))
        if self.waves is not None:
            known |= zip(ERRORS, linearisation.neglected, strict=True)
        forces, mean = linearisation._samples()
        return self.stored(u[None], linearisation.memory[None], forces[None], mean[None],
                           self.sizes[None],
                           {name: [value] for name, value in known.items()})[0]

    def _stability(self, linearisation: Any) -> dict[str, Any]:
        """Values of stability to store, if it is known."""
        found: dict[str, Any] = {} if self.stability is None else linearisation.floquet.stored
        return found

    def stored(
        self, u: Array, z: Array, forces: Array, mean: Array, sizes: Array, known: dict[str, Any]
    ) -> list[StoredValues]:
        """Values to store of K orbits u (K, n + 1), with those that are known; see StoredOrbits."""
        layout, count = self.layout, len(u)
        if self.turn is not None:
            periods = self.periods * self.turn / u[:, -1]
        else:
            periods = np.array([self.period(each) for each in u])
        orbits = StoredOrbits(layout, u[:, : self.size].reshape(count, -1, layout.harmonic), z,
                              periods, forces, mean, sizes, self.row, known, self.orders)
        return [StoredValues(orbits, k) for k in range(count)]

    def found(
        self, u: Array, row: Array, tolerance: float
    ) -> tuple[Array, ...] | None:
        """The orbit near u at right angles to a row, by compiled code; None where it finds none.

        With the direction x of the branch, ``row @ x = 1``, accelerations at the samples, their
        mean derivatives, and internal variables, as :meth:`stored` takes them.
        """
        e = self.equations(float(u[-1])) if type(self) is HarmonicProblem else None
        if e is None:
            return None
        m, u = self.layout.displacements, np.array(u, dtype=float)
        forces, mean, along = np.empty((self.samples, m)), np.empty((m, 2 * m)), np.empty_like(u)
        e.numbers[TOLERANCE] = tolerance
        if not (evaluate(u, ORBIT, e, forces, mean, row, self.weights(), along)
                and math.isfinite(weighted_norm(self.weights(), along))):
            return None
        return u, along, forces, mean, e.workspace.z.copy()

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of the multipliers, if known, and of orbits that shrink to rest."""
        found = {} if self.stability is None else super().tests(u, linearisation, tangent)
        if self.autonomous and self.reference[1:].any():
            found[VANISHING] = shrunk(np.ones(1), self.coefficients(u)[1:] / self.sizes,
                                      self.reference[1:] / self.sizes)
        return found

    def note(self, points: Sequence[BranchPoint]) -> str:
        """Note on multipliers that are lost, miss jumps of forces, or are of modes too fast.

        Empty without stability.
        """
        if self.stability is None:
            return ""
        missed, fast = missed_jumps(self.field, points), ""
        if self.stability == "transitions" and not self.layout.memory:
            grid = stability_grid(self)
            fast = unresolved_modes(self.field, points, lambda point: grid,
                                    f"take more than {self.samples} samples")
        return " ".join(filter(None, (self.rounding.note(points), missed, fast)))

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """At orbits that are homoclinic to a saddle, as far as numbers tell."""
        if self.autonomous and near_saddle(
                self, self.parameters(u), linearisation.states,
                np.full(self.samples, 1.0 / self.samples), tangent):
            return BranchStatus.HOMOCLINIC
        return None

    def fast_steps(self, options: ContinuationOptions) -> StepBatches | None:
        """Compiled steps, for forced orbits of contact systems."""
        return StepBatches.of(self, options) if type(self) is HarmonicProblem else None

    def extremes(self, u: Array, z: Array) -> tuple[Array, Array]:
        """Smallest and largest value (d,) of each state over the orbit."""
        low, high = estimates.extremes(self.whole(u, self.period(u))[None], z[None])
        return low[0], high[0]

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """The kind of a torus bifurcation; None for a neutral saddle.

        A branch point at which a doubled orbit becomes a single one is a period halving.
        """
        if kind == "branch point" and self._halves_meet(u, tangent):
            return {"kind": HALVING}
        return {} if kind == "fold" else super().examine(kind, u, linearisation, tangent)

    def _halves_meet(self, u: Array, tangent: Array) -> bool:
        """Whether an orbit has even harmonics alone, while the branch adds odd ones."""
        sizes = self.sizes

        def odd_part(vector: Array) -> float:
            X = self.coefficients(vector)[1:] / sizes
            whole = np.linalg.norm(X)
            odd = np.linalg.norm(np.concatenate([X[0::4], X[1::4]]))
            return float(odd / whole) if whole > 0.0 else 1.0

        return odd_part(u) < _HALVES_MEET and odd_part(tangent) > _HALVES_PART

    def met_again(
        self, origin: Any, u: Array, tangent: Array, like: Array, heading: Array, within: float
    ) -> Array | None:
        """See :meth:`Problem.met_again`: in the phase of ``like``."""
        if len(u) != len(like) or not same_place(self, (u, tangent), (like, heading), within):
            return None
        return None if self._apart_at_least(u, like) > within else self._in_phase(u, like)

    def _apart_at_least(self, u: Array, like: Array) -> float:
        """A bound of the distance of two orbits in any phase: that of their amplitudes."""
        weights = self.weights()[: self.size].reshape(self.reference.shape)
        X, Y = (np.hypot(Z[1::2], Z[2::2]) for Z in map(self.coefficients, (u, like)))
        return float(np.sqrt((np.minimum(weights[1::2], weights[2::2]) * (X - Y) ** 2).sum()))

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
