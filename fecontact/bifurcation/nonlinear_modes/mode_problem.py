"""Continuation problems of a nonlinear mode, periodic motion under negative damping.

By harmonic balance, and by shooting.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.continuation.rounding import NoFolds, Rounding
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.estimates import observed_values
from fecontact.bifurcation.harmonic.layout import Layout
from fecontact.bifurcation.harmonic.problem import HarmonicLinearisation, HarmonicProblem
from fecontact.bifurcation.harmonic.series import differentiated, real_coefficients
from fecontact.bifurcation.nonlinear_modes.linear_start import XI, LinearStart
from fecontact.bifurcation.orbit_methods import Shooting
from fecontact.bifurcation.orbits.shooting import ShootingProblem
from fecontact.bifurcation.orbits.unknowns import OrbitUnknowns
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ComplexArray
from fecontact.system.fields.vector_field import VectorField

# Harmonics of what is observed, from the samples of runs.
_HARMONICS = 63
# Relative size of Newton steps that is rounding where elements stick: only the leak of memory holds
# their mean deflection, and so the mean of bodies that little else holds.
_ROUNDING_OF_MEANS = 1e-5
# Distance of a multiplier from the unit circle beyond which a perturbation grows.
_GROWS = 1e-6
# Relative size of sines up to which a motion is the same backwards in time.
_REVERSIBLE = 1e-6
# Scale of the period, relative to it, and ratio of the two from which it is renewed.
PERIOD_SCALE, _FOLLOWED = 0.2, 1.3
# Change of period and xi in a step, in their scales, up to which it may be longer than the largest
# one, and how many times as long.
_RESTS, _LONGER = 1e-4, 4.0
# Gauss points on each piece of the way from rest, and pieces, since contact forces have kinks.
_GAUSS, _PIECES = 4, 32


class ModeLinearisation(HarmonicLinearisation):
    """Linearisation of a nonlinear mode; means of coordinates that nothing holds are kept.

    The balance of these means has no stiffness and is satisfied identically, as it is for the
    forces within a free body.
    """

    problem: "ModeProblem"

    @cached_property
    def residual(self) -> Array:
        """Residual (n + 1,)."""
        found, loose = super().residual, self.problem.loose
        if len(loose):
            m = loose.shape[1]
            held = self._stiffness * loose.T @ (loose @ (self.u[:m] - self.problem.home))
            found = np.concatenate([found[:m] + held, found[m:]])
        return found

    @cached_property
    def condensed(self) -> Array:
        """Derivatives (n + 1, n + 2) of the residual."""
        found, loose = super().condensed, self.problem.loose
        m = loose.shape[1]
        found[:m, :m] += self._stiffness * loose.T @ loose
        return found

    @property
    def _stiffness(self) -> float:
        return float((2.0 * np.pi / self.problem.scales[-2]) ** 2)


class AlongMode(OrbitUnknowns):
    """Branches of orbits along a mode, whose multipliers and turns of xi say nothing of it."""

    @property
    def rounding(self) -> Rounding:
        """No folds: neither turns of xi nor multipliers belong to the mode."""
        return NoFolds(super().rounding.steps)  # type: ignore[misc]

    def note(self, points: Any) -> str:
        """Empty note: 'trivial_error' is the error of the multipliers."""
        return ""

    def _grown(self, u: Array) -> Array:
        """Scales enlarged with the motion; those of period and xi follow the frequency."""
        scales: Array = super()._grown(u)  # type: ignore[misc]
        ratio = PERIOD_SCALE * self.period(u) / scales[-2]
        if 1.0 / _FOLLOWED < ratio < _FOLLOWED:
            return scales
        return np.append(scales[:-2], [scales[-2] * ratio, scales[-1] / ratio])


@dataclass(frozen=True, eq=False)
class ModeProblem(AlongMode, HarmonicProblem):
    """Orbits of an autonomous system over xi, with what is observed and without stability.

    Multipliers of a damped system with -xi M q' say nothing of its own motion; those of a
    conservative one are stored.

    Attributes
    ----------
    conservative : bool
        Whether xi is zero within rounding where the mode begins, and no friction has memory.
    loose : (r, m) array
        Orthonormal directions of displacements without any stiffness: rigid motions.
    home : (m,) array
        Displacements at rest, where the means of these stay.
    """

    conservative: bool = False
    loose: Array = field(default_factory=lambda: np.zeros((0, 0)))
    home: Array = field(default_factory=lambda: np.zeros(0))

    def linearise(self, u: Array) -> ModeLinearisation:
        """Residual and linearisation at u, each computed on demand."""
        if not u[-2] > 0.0:
            raise AnalysisError("The period became negative.")
        return ModeLinearisation(self, u)

    @property
    def onsets(self) -> Array:
        """None: means over samples would reach a stiff stop before a mode grazes it."""
        return np.zeros((0, 0))

    @property
    def rounding(self) -> Rounding:
        """No folds; where elements stick, larger Newton steps than of other modes are rounding."""
        return NoFolds(_ROUNDING_OF_MEANS) if self.layout.memory else super().rounding

    def longest_step(self, tangent: Array, turn: float, options: ContinuationOptions) -> float:
        """Longer than the largest step where a smooth mode without losses keeps its period.

        Internal resonances lie where it changes. Kinks come without notice, and of a damping ratio
        small changes count too.
        """
        smooth = isinstance(self.field, ContactField) and not self.field.kinked
        if not (smooth and self.conservative):
            return options.largest_step
        # At the start of the next step, and where one of the largest length ends.
        bend = self.predictor.bend
        rate = max(float(np.sqrt(self.weights()[-2:] @ way[-2:] ** 2)) for way in (
            tangent, tangent if bend is None else tangent + options.largest_step * bend))
        if rate * _LONGER * options.largest_step <= _RESTS:
            return _LONGER * options.largest_step
        return max(options.largest_step, _RESTS / rate)

    def predicted(self, u: Array, tangent: Array, step: float) -> Array:
        """The predictor; that of a motion x(-t) = x(t) without losses is one too.

        Newton's method keeps to such motions then, past points where few samples in short contacts
        let others branch off.
        """
        guess = super().predicted(u, tangent, step)
        X = self.coefficients(guess)
        if self.conservative and np.abs(X[2::2]).max() <= _REVERSIBLE * np.abs(X[1::2]).max():
            X[2::2] = 0.0
        return guess

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Values of an orbit, and the mean square of the velocities."""
        T, X = self.period(u), self.coefficients(u)
        square = (mean_square_velocity(self.layout, X, T) if self.waves is None
                  else self.waves.mean_square_velocity(
                      X, linearisation.free_balance, T, float(u[-1]), self.harmonics_kept))
        return {**super().point(u, linearisation, tangent), "mean_square_velocity": square,
                **self._energy(u, linearisation)}

    def _energy(self, u: Array, linearisation: Any) -> dict[str, float]:
        """Energy of a conservative motion of modal coordinates, its mean over the period."""
        m = self.layout.displacements
        if not (self.conservative and m and self.waves is None):
            return {}
        states, force = linearisation.states, linearisation.rates[:, m : 2 * m]
        kinetic, near = 0.5 * (states[:, m : 2 * m] ** 2).sum(axis=1), nearest(states, self.home)
        power = np.fft.rfft((force * states[:, m : 2 * m]).sum(axis=1))
        power[0] = 0.0
        turns = 2j * np.pi / self.period(u) * np.maximum(np.arange(len(power)), 1)
        work = np.fft.irfft(power / turns, len(states))
        return {"energy": energy_at(self.field, self.parameters(u), states[near], self.home)
                + float(kinetic.mean() - kinetic[near] + work[near])}

    def _stability(self, linearisation: Any) -> dict[str, Any]:
        """Stability of conservative motions alone, for which multipliers of one count as stable."""
        if not self.conservative or self.stability is None:
            return {}
        return known_stability(linearisation.floquet.stored, 1 + len(self.loose))

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """A function that is zero at branch points, 1 / |M^-1 b| with the sign of det M.

        M are the equations with the tangent as last row, in the scales of the unknowns, b is a
        fixed vector. The sign stays the same along a branch, and differs on the branch beyond an
        internal resonance that a step has left out; such steps are refused.
        """
        weights = self.weights()
        row = weights * tangent
        # Each equation is divided by its largest coefficient in scaled unknowns.
        sizes = np.append(np.abs(linearisation.condensed * weights**-0.5).max(axis=1),
                          np.abs(row * weights**-0.5).max())
        found = linearisation.solve(row, sizes * np.cos(np.arange(len(row))))
        size = float(np.sqrt(weights @ found**2))
        return {"branch point": (linearisation.determinant_sign(row) / size
                                 if np.isfinite(size) else 0.0)}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """No data: test functions alone decide on special points."""
        return {}


@dataclass(frozen=True, eq=False)
class ShootingMode(AlongMode, ShootingProblem):
    """Orbits of an autonomous system over xi, with what is observed of them.

    Multipliers are stored of conservative motions alone; none makes a special point.

    Attributes
    ----------
    row : (d,) array
        Row of the observed displacement.
    conservative : bool
        Whether xi is zero within rounding where the mode begins.
    home : (m,) array
        Displacements at rest.
    """

    row: Array = field(default_factory=lambda: np.zeros(0))
    conservative: bool = False
    home: Array = field(default_factory=lambda: np.zeros(0))

    ends: ClassVar[Mapping[str, BranchStatus]] = {}

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, velocities, extremes, and what is observed; stability where nothing is lost."""
        found = super().point(u, linearisation, tangent)
        T, d = self.period(u), self.field.dimension
        samples = linearisation.paths[:, :-1].reshape(-1, d)
        m = d // 2
        H = min(_HARMONICS, len(samples) // 2 - 1)
        waves = 2.0 / len(samples) * np.fft.rfft(samples[:, :m], axis=0)[: H + 1]
        waves[0] *= 0.5
        layout, X = Layout(d, m), real_coefficients(waves)
        kept = {} if not self.conservative else known_stability(found, 1) | {"energy": energy_at(
            self.field, self.parameters(u), samples[nearest(samples, self.home)], self.home)}
        return {**{name: found[name] for name in ("mesh", "minimum", "maximum")}, **kept,
                "period": T,
                "mean_square_velocity": mean_square_velocity(layout, X, T),
                **observed_values(layout, X, T, self.row)}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """None."""
        return {}

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """None: a mode ends at its amplitudes."""
        return None


def leaving_by_shooting(
    start: LinearStart, shape: ComplexArray, scales: Array, row: Array, method: Shooting
) -> tuple[ShootingMode, Array, Array]:
    """Problem, unknowns and direction of the linear mode of a shape (d,), at its amplitude.

    ``scales`` (d + 2,) are those of the states, the period and xi.

    Raises
    ------
    InputError
        For a user's field, friction with memory, rigid motions, or a set-valued solver.
    """
    known = start.field
    if not isinstance(known, ContactField):
        raise InputError("nonlinear_mode: shooting is for contact systems; take HarmonicBalance() "
                         "for a vector field.")
    if known.dimension > 2 * start.displacements:
        raise InputError("nonlinear_mode: friction with memory sticks at any deflection, so that "
                         "its runs have no isolated periodic motion; take HarmonicBalance().")
    if len(start.loose):
        raise InputError("nonlinear_mode: nothing holds a rigid motion of the system, so that its "
                         "runs have no isolated periodic motion; take HarmonicBalance().")
    if not method.solver.smooth:
        raise InputError("nonlinear_mode: Shooting(solver=SetValued()) has no modes; take a "
                         "smoothed law and Auto().")
    mesh = np.linspace(0.0, 1.0, method.segments + 1)
    waves = (np.exp(2.0j * np.pi * mesh[:-1])[:, None] * shape).real
    first = start.state + waves
    problem = ShootingMode(
        known, start.values, start.free, mesh, first[0].copy(), scales, rtol=method.rtol,
        derivative_rtol=method.derivative_rtol, solver=method.solver,
        limits=np.full(known.dimension, np.inf), row=row, conservative=start.lossless,
        home=start.state[: start.displacements])
    u = np.concatenate([first.reshape(-1), [2.0 * np.pi / start.angular_frequency, start.xi]])
    leaving = np.append(waves.reshape(-1), [0.0, 0.0])
    return problem, u, leaving / np.sqrt(problem.weights() @ leaving**2)


def followed_by_shooting(
    start: LinearStart, begin: tuple[ShootingMode, Array, Array], method: Shooting,
    options: ContinuationOptions,
) -> Branch:
    """The branch of a mode from its start."""
    problem, u, leaving = begin
    return continue_branch(
        problem, u, options, name=XI, tangent=leaving,
        attributes=problem.attributes() | {"conservative": problem.conservative})


def mean_square_velocity(layout: Layout, X: Array, period: float) -> float:
    """Mean of q'^T q' over a period from coefficients X (2 H + 1, b); NaN without displacements.

    Of mass-normalised modes it is twice the mean kinetic energy.
    """
    m = layout.displacements
    return 0.5 * float((differentiated(X[:, :m] / period) ** 2).sum()) if m else np.nan


def nearest(states: Array, home: Array) -> int:
    """Index of the state (N, d) whose displacements are nearest to those (m,) of rest."""
    return int(((states[:, : len(home)] - home) ** 2).sum(axis=1).argmin())


def energy_at(field: VectorField, values: Array, state: Array, home: Array) -> float:
    """Kinetic energy of a state (d,), and the work against the forces on the way there from rest.

    Of mass-normalised modes without losses, by Gauss points on a straight line from the
    displacements ``home`` (m,).
    """
    m = len(home)
    way = state[:m] - home
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    parts = (np.arange(_PIECES)[:, None] + 0.5 * (1.0 + nodes)).ravel() / _PIECES
    states = np.zeros((len(parts), len(state)))
    states[:, :m] = home + parts[:, None] * way
    forces = field.rates(np.zeros(len(parts)), states, values)[:, m : 2 * m]
    work = np.tile(0.5 * weights / _PIECES, _PIECES) @ forces @ way
    return float(0.5 * state[m : 2 * m] @ state[m : 2 * m] - work)


def known_stability(stored: Mapping[str, Any], pairs: int) -> dict[str, Any]:
    """Stability to store of a conservative motion, from what an orbit stores.

    It is stable if no multiplier lies outside the unit circle, except so many ``pairs`` at one.
    They belong to phase and amplitude, and to rigid motions; rounding parts them.
    """
    multipliers = stored["multipliers"]
    rest = multipliers[np.argsort(np.abs(multipliers - 1.0))[2 * pairs :]]
    return {"multipliers": multipliers, "trivial_error": stored["trivial_error"],
            "stable": bool(np.abs(rest).max(initial=0.0) <= 1.0 + _GROWS)}
