"""Continuation problem of tori by harmonic balance with two base frequencies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.problem import BranchStatus, Problem
from fecontact.bifurcation.harmonic.estimates import responses
from fecontact.bifurcation.harmonic.layout import Layout, SeriesUnknowns
from fecontact.bifurcation.harmonic.series import turned
from fecontact.bifurcation.harmonic.woodbury import BorderedEquations
from fecontact.bifurcation.orbits.same_orbit import shrunk
from fecontact.bifurcation.orbits.unknowns import beside, by_differences
from fecontact.bifurcation.tori.elements import Friction, TorusElements
from fecontact.bifurcation.tori.excitation import Excitation
from fecontact.bifurcation.tori.series import (
    complex_coefficients,
    means,
    on_lines,
    orders,
    products,
    projected,
)
from fecontact.bifurcation.tori.stability import (
    RESOLVED,
    TorusStability,
    fastest_change,
    intervals_for,
    stability_of,
)
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

# Part of their limits by which elements that do not slide are short of them.
_WITHIN = 1e-6
# Points per harmonic among which extremes are sought.
_FINE = 16
# Test function whose zero ends a branch of tori that shrink to an orbit.
_SHRINKS = "torus shrinks"


@dataclass(frozen=True, eq=False)
class TorusProblem(SeriesUnknowns, Problem):
    """Equations of a torus X(theta1, theta2), along which theta_i' = 2 pi f_i.

    With D = 2 pi (f1 d/dtheta1 + f2 d/dtheta2), displacements q and other states y are Fourier
    series, velocities are D q. The residuals D D q - f_v and D y - f_y have no part in the
    harmonics of the series. Each unknown frequency f_i has the phase condition <X, dX_0/dtheta_i> =
    0 with the torus X_0 before.

    The unknowns are ``u = [coefficients L b, unknown frequencies [Hz], parameter]``.

    Attributes
    ----------
    excitation : Excitation
        Field and prescribed frequencies.
    values : (k,) array
        Parameters; the free one is taken from u.
    free : int
        Index of the free parameter.
    orders, samples : (int, int)
        H1, H2 and N1, N2.
    reference : (L, b) array
        Coefficients of the torus that fixes the phases.
    scales : (d + 3,) array
        Scales in the step length: of each state, of both frequencies and of the parameter.
    layout : Layout
        How states become unknowns; internal variables are series, but those of elements.
    elements : TorusElements, optional
        Elastic Coulomb elements, whose deflections follow from the displacements.
    multipliers : bool
        Whether points have multipliers.
    tolerance : float
        Truncation error at which the branch ends.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow; None keeps them.
    """

    excitation: Excitation
    values: Array
    free: int
    orders: tuple[int, int]
    samples: tuple[int, int]
    reference: Array
    scales: Array
    layout: Layout
    multipliers: bool = True
    tolerance: float = 0.05
    limits: Array | None = None
    elements: TorusElements | None = None

    keeps_matrix: ClassVar[bool] = True
    polishes: ClassVar[bool] = True
    ends: ClassVar[Mapping[str, BranchStatus]] = {_SHRINKS: BranchStatus.SINGLE_FREQUENCY}

    @property
    def field(self) -> Any:
        """The field of the branch."""
        return self.excitation.field

    @cached_property
    def unknown(self) -> tuple[int, ...]:
        """Indices of the unknown frequencies, 0 and 1, in their order in u."""
        return tuple(i for i, f in enumerate(self.excitation.frequencies(self.values))
                     if f is None)

    @property
    def common(self) -> int:
        """Number of unknowns beside the series."""
        return 1 + len(self.unknown)

    @cached_property
    def pairs(self) -> Any:
        """Pairs (K, 2) of the harmonics."""
        return orders(*self.orders)

    def frequencies(self, u: Array) -> tuple[float, float]:
        """f1 and f2 [Hz]."""
        found = list(self.excitation.frequencies(self.parameters(u)))
        for place, i in enumerate(self.unknown):
            found[i] = float(u[self.size + place])
        first, second = found
        assert first is not None
        assert second is not None
        return first, second

    def ratio(self, frequencies: tuple[float, float]) -> float:
        """Ratio r of the lines on which the equations are evaluated; see `.series`."""
        # Without a second excitation the rates do not change across a torus but by its states.
        alone = self.excitation.shifted is None and self.elements is None
        return 0.0 if alone else frequencies[1] / frequencies[0]

    @cached_property
    def bare(self) -> Excitation:
        """Field and excitations without elements."""
        return self.excitation if self.elements is None else self.excitation.without_elements()

    def friction(self, u: Array, taus: Array, count: int, *, derivatives: bool = False) -> Friction:
        """Friction of the elements on lines; see :meth:`TorusElements.friction`."""
        assert self.elements is not None
        X = np.ascontiguousarray(self.coefficients(u)[:, : self.layout.displacements])
        return self.elements.friction(X, self.orders, self.frequencies(u), taus, count,
                                      self.parameters(u), derivatives=derivatives)

    def whole(self, X: Array, frequencies: tuple[float, float]) -> Array:
        """Coefficients (L, d - c) of all states but deflections of elements."""
        m = self.layout.displacements
        if not m:
            return X
        turns = 2.0 * np.pi * self.pairs @ np.array(frequencies)
        return np.concatenate([X[:, :m], turned(X[:, :m], turns), X[:, m:]], axis=1)

    def states(
        self, u: Array, taus: Array, count: int, ratio: float
    ) -> Array:
        """States (count, P, d - c) on lines at tau (P,), without deflections of elements."""
        c = complex_coefficients(self.whole(self.coefficients(u), self.frequencies(u)),
                                 *self.orders)
        return on_lines(c, taus, count, ratio)

    @property
    def common_scales(self) -> Array:
        """Scales of the unknown frequencies and the parameter."""
        return self.scales[[*(self.layout.states + i for i in self.unknown), -1]]

    @cached_property
    def phase_rows(self) -> Array:
        """Rows (a, L b) of the phase conditions."""
        return np.array([self.phase_row_of(turned(self.reference, self.pairs[:, i].astype(float)))
                         for i in self.unknown]).reshape(-1, self.size)

    def linearise(self, u: Array) -> "TorusLinearisation":
        """Residual and linearisation at u, each computed on demand."""
        if not min(self.frequencies(u)) > 0.0:
            raise AnalysisError("A frequency of the torus became negative.")
        return TorusLinearisation(self, u)

    def adapted(self, u: Array, tangent: Array) -> "tuple[TorusProblem, Array, Array]":
        """The problem for the next step, with the phase conditions at u."""
        return replace(self, reference=self.coefficients(u).copy(), values=self.parameters(u),
                       scales=self._grown(u)), u, tangent

    @cached_property
    def thinnest(self) -> Array:
        """Turns (K,) of the harmonics along the free angle in which the reference changes least.

        The angle is a combination c of those whose frequency is unknown, k.c of a harmonic k. Where
        the torus shrinks to an orbit, nothing changes along it, whatever angles describe the torus.
        """
        turns = self.pairs[:, self.unknown].astype(float)
        moved = np.array([turned(self.reference / self.sizes, one).reshape(-1) for one in turns.T])
        return np.asarray(turns @ np.linalg.eigh(moved @ moved.T)[1][:, 0])

    def point(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any]:
        """Frequencies, extremes of the states, errors and stability."""
        frequencies = self.frequencies(u)
        fine = [_FINE * H for H in self.orders]
        taus, memory = np.arange(fine[0]) / fine[0], linearisation.memory
        x = self.states(u, taus, fine[1], 0.0)
        if self.elements is not None:
            x = np.concatenate([x, on_lines(complex_coefficients(memory, *self.orders), taus,
                                            fine[1], 0.0)], axis=2)
        found = {"frequency_1": frequencies[0], "frequency_2": frequencies[1],
                 "minimum": x.min(axis=(0, 1)), "maximum": x.max(axis=(0, 1)),
                 "truncation_error": linearisation.truncation_error,
                 "sampling_error": linearisation.sampling_error}
        if self.elements is not None:
            found |= {"memory": memory}
        if self.multipliers:
            stability: TorusStability = linearisation.stability
            found |= {"multipliers": stability.multipliers, "stable": stability.stable,
                      "trivial_error": stability.trivial_error}
        return found

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
        """Test function of tori that shrink to an orbit."""
        if not self.unknown:
            return {}
        before, now = (turned(X / self.sizes, self.thinnest)
                       for X in (self.reference, self.coefficients(u)))
        return {_SHRINKS: shrunk(np.ones(1), now, before)} if before.any() else {}

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """At tori that their harmonics do not resolve."""
        return (BranchStatus.UNRESOLVED_TORUS
                if linearisation.truncation_error > self.tolerance else None)

    def note(self, points: Sequence[Any]) -> str:
        """Note on the errors of the tori of a branch; empty if they are small."""
        notes = []
        for name, most, remedy in (("truncation_error", 0.01, "harmonics"),
                                   ("sampling_error", 0.005, "samples")):
            worst = max((float(point.values[name]) for point in points), default=0.0)
            if worst > most:
                notes.append(f"The {name.replace('_', ' ')} of the tori reaches {worst:.2g} of "
                             f"their size; take more {remedy}.")
        if self.multipliers and any(float(point.values["trivial_error"]) > 0.05
                                    for point in points):
            notes.append("Multipliers that should be one are off by more than 0.05 at some points: "
                         "their stability is uncertain.")
        if self.multipliers and points:
            fastest = self.linearise(points[-1].u).fastest_change
            if fastest > RESOLVED:
                notes.append(f"The multipliers do not resolve modes of up to "
                             f"{fastest / (2.0 * np.pi):.3g} times the first frequency: check the "
                             f"stability by fecontact.simulate.")
        return " ".join(notes)


class TorusLinearisation(BorderedEquations):
    """Residual of the equations at u, and solutions of systems with their derivative."""

    def __init__(self, problem: TorusProblem, u: Array) -> None:
        self.problem, self.u = problem, u
        self.frequencies = problem.frequencies(u)
        self.ratio = problem.ratio(self.frequencies)

    @cached_property
    def _taus(self) -> Array:
        return np.arange(self.problem.samples[0]) / self.problem.samples[0]

    @cached_property
    def _states(self) -> Array:
        return self.problem.states(self.u, self._taus, self.problem.samples[1], self.ratio)

    def _evaluated(self, active: tuple[int, ...], derivatives: bool) -> tuple[Array, Array, Array]:
        return self.problem.bare.on_lines(
            self._taus, self._states, self.problem.parameters(self.u), self.frequencies[0], active,
            derivatives=derivatives)

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and derivatives at the samples; see :meth:`Excitation.on_lines`."""
        return self._evaluated((self.problem.free,), True)

    @cached_property
    def rates(self) -> Array:
        """Rates (N2, N1, b) of the equations at the samples."""
        f = (self.derivatives[0] if "derivatives" in self.__dict__
             else self._evaluated((), False)[0])
        found = f[:, :, self.problem.layout.rows]
        if self.problem.elements is not None:
            found = found - np.einsum("qpjt,jti->qpi", self._friction.forces, self._tangents)
        return found

    @cached_property
    def _friction(self) -> Friction:
        return self.problem.friction(self.u, self._taus, self.problem.samples[1])

    @property
    def _tangents(self) -> Array:
        """Rows (n, t, m) of the displacements of nodes along their tangents."""
        return np.asarray(self._axes[:, ::2])

    @property
    def _axes(self) -> Array:
        """Rows (n, d, m) of the displacements of nodes along their axes."""
        assert self.problem.elements is not None
        rows: Array = self.problem.elements.field.arrays(self.problem.parameters(self.u)).rows
        return rows

    @cached_property
    def memory(self) -> Array:
        """Coefficients (L, c) of the deflections of elements."""
        if self.problem.elements is None:
            return np.zeros((len(self.problem.reference), 0))
        return projected(self._friction.deflections, *self.problem.orders, self.ratio)

    @cached_property
    def _turns(self) -> Array:
        return np.asarray(2.0 * np.pi * self.problem.pairs @ np.array(self.frequencies))

    @cached_property
    def balance(self) -> Array:
        """Balance (L b,) of the harmonics."""
        problem, m = self.problem, self.problem.layout.displacements
        X = problem.coefficients(self.u)
        moved = turned(X, self._turns)
        moved[:, :m] = turned(moved[:, :m], self._turns)
        return np.asarray((moved - projected(self.rates, *problem.orders, self.ratio)).reshape(-1))

    @cached_property
    def residual(self) -> Array:
        """Residual (L b + a,): balance and phase conditions."""
        return np.append(self.balance, self.problem.phase_rows @ self.u[: self.problem.size])

    @cached_property
    def _blocks(self) -> tuple[Array, Array, Array]:
        """Derivatives (N2, N1, b, b) of the rates to q and y, (N2, N1, b, m) to velocities, and
        (N2, N1, b) to the parameter.
        """
        layout, m = self.problem.layout, self.problem.layout.displacements
        _, J, by_parameter = self.derivatives
        of = J[:, :, layout.rows]
        return (of[..., layout.columns], of[..., m : 2 * m],
                by_parameter[:, :, layout.rows, 0])

    @cached_property
    def matrix(self) -> Array:
        """Derivatives (L, b, L, b) of the balance to the coefficients."""
        problem, m, k = self.problem, self.problem.layout.displacements, self.problem.pairs
        by_state, by_velocity, _ = self._blocks
        twice = 2 * problem.orders[0], 2 * problem.orders[1]
        cc, cs, sc, ss = products(means(by_state, *twice, self.ratio), k)
        if m:
            turn = self._turns[None, :, None, None]
            vcc, vcs, vsc, vss = products(means(by_velocity, *twice, self.ratio), k)
            cc[..., :m] -= turn * vcs
            cs[..., :m] += turn * vcc
            sc[..., :m] -= turn * vss
            ss[..., :m] += turn * vsc
        L, b = problem.reference.shape
        out = np.empty((L, b, L, b))
        cosines, sines = np.append(0, np.arange(1, L, 2)), np.arange(2, L, 2)
        for rows, columns, part in ((cosines, cosines, cc), (cosines, sines, cs[:, 1:]),
                                    (sines, cosines, sc[1:]), (sines, sines, ss[1:, 1:])):
            out[rows[:, None], :, columns[None, :], :] = -part
        turns = self._turns[1:, None]
        q, y = np.arange(m), np.arange(m, b)
        for rows in (cosines[1:, None], sines[:, None]):
            out[rows, q, rows, q] -= turns**2
        out[cosines[1:, None], y, sines[:, None], y] += turns
        out[sines[:, None], y, cosines[1:, None], y] -= turns
        if problem.elements is not None:
            self._add_elements(out)
        return out

    def _add_elements(self, out: Array) -> None:
        """Add the derivatives of the forces of elements to those of the balance."""
        problem = self.problem
        L = len(problem.reference)
        friction = problem.friction(self.u, self._taus, problem.samples[1], derivatives=True)
        for rows, axes, tangents in zip(friction.rows, self._axes, self._tangents, strict=True):
            if rows.any():
                t = rows.shape[2]
                hat = projected(rows.reshape(*rows.shape[:2], -1), *problem.orders,
                                self.ratio).reshape(L, t, len(axes), L)
                out += np.einsum("ltak,ti,am->likm", hat, tangents, axes, optimize=True)

    @cached_property
    def _by_common(self) -> Array:
        """Derivatives (L b, a + 1) of the balance to unknown frequencies and the parameter."""
        problem, m = self.problem, self.problem.layout.displacements
        _, by_velocity, by_parameter = self._blocks
        X, columns = problem.coefficients(self.u), []
        if problem.elements is not None:
            # The lines turn with the frequencies, and limits may depend on any parameter.
            return np.array([by_differences(self._balance_at, self.u, place)
                             for place in range(-problem.common, 0)]).T
        for i in problem.unknown:
            moved = turned(X, 2.0 * np.pi * problem.pairs[:, i])
            speeds = on_lines(complex_coefficients(moved[:, :m], *problem.orders), self._taus,
                              problem.samples[1], self.ratio) if m else None
            moved[:, :m] = 2.0 * turned(moved[:, :m], self._turns)
            if speeds is not None:
                moved -= projected(np.einsum("qpij,qpj->qpi", by_velocity, speeds),
                                   *problem.orders, self.ratio)
            columns.append(moved.reshape(-1))
        more, less = map(problem.frequencies, beside(self.u))
        if more == less:
            columns.append(-projected(by_parameter, *problem.orders, self.ratio).reshape(-1))
        else:
            columns.append(by_differences(self._balance_at, self.u))
        return np.array(columns).T

    def _balance_at(self, u: Array) -> Array:
        return TorusLinearisation(self.problem, u).balance

    @cached_property
    def condensed(self) -> Array:
        """Derivatives (n, n + 1) of the residual."""
        problem, n = self.problem, self.problem.size
        found = np.zeros((n + len(problem.unknown), n + problem.common))
        found[:n, :n], found[:n, n:] = self.matrix.reshape(n, n), self._by_common
        found[n:, :n] = problem.phase_rows
        return found

    @cached_property
    def _size(self) -> float:
        """Root mean square of the torus without its mean, in the scales of its states."""
        scaled = self.problem.coefficients(self.u)[1:] / self.problem.sizes
        return float(np.sqrt((scaled**2).sum())) or 1.0

    @cached_property
    def truncation_error(self) -> float:
        """Estimate of the neglected harmonics, root mean square over that of the torus.

        They are x_k = (i k.w - J_0)^-1 f_k, with the harmonics f_k of the rates that the series
        leaves out, up to the samples, and the mean derivative J_0.
        """
        problem = self.problem
        (H1, H2), (N1, N2) = problem.orders, problem.samples
        K1, K2 = (N1 - 1) // 2, (N2 - 1) // 2
        f = means(self.rates, K1, K2, self.ratio)
        f[K1 - H1 : K1 + H1 + 1, K2 - H2 : K2 + H2 + 1] = 0.0
        k1, k2 = np.meshgrid(np.arange(-K1, K1 + 1), np.arange(-K2, K2 + 1), indexing="ij")
        turns = 2.0j * np.pi * (k1 * self.frequencies[0] + k2 * self.frequencies[1])
        by_state, by_velocity, _ = (part.mean(axis=(0, 1)) for part in self._blocks)
        if problem.elements is not None:
            by_state = by_state - np.einsum("jt,jti,jtm->im", self._friction.stiffness,
                                            self._tangents, self._tangents)
        added = responses(f, turns, by_state, by_velocity) / self.problem.sizes
        return float(np.sqrt(2.0 * (np.abs(added) ** 2).sum())) / self._size

    @cached_property
    def sampling_error(self) -> float:
        """Change of the torus at fixed parameter with twice the samples, relative to its size."""
        problem = self.problem
        finer = replace(problem, samples=(2 * problem.samples[0], 2 * problem.samples[1]))
        # The residual that Newton's method leaves is no error of the samples.
        residual = TorusLinearisation(finer, self.u).residual - self.residual
        change = self.solve(unit(len(self.u)), np.append(-residual, 0.0))
        scaled = problem.coefficients(change) / self.problem.sizes
        return float(np.sqrt((scaled**2).sum())) / self._size

    @cached_property
    def stability(self) -> TorusStability:
        """Multipliers of the torus, from motions along it."""
        problem = self.problem
        # Where elements switch within an interval, the error is of its length.
        least = 0 if problem.elements is None else problem.samples[0]
        return stability_of(self._jacobians, self.frequencies, self.fastest_change,
                            max(least, intervals_for(problem.orders)), problem.samples[1] | 1,
                            len(problem.unknown))

    @cached_property
    def fastest_change(self) -> float:
        """See :func:`fecontact.bifurcation.tori.stability.fastest_change`.

        The return of elements to their limits, which collocation damps, does not count.
        """
        return fastest_change(partial(self._jacobians, sliding=False), self.frequencies[0],
                              self.problem.orders)

    def _jacobians(self, taus: Array, count: int, *, sliding: bool = True) -> Array:
        """Derivatives of the rates on lines along the torus."""
        problem, (first, second) = self.problem, self.frequencies
        x = problem.states(self.u, taus, count, second / first)
        if problem.elements is not None:
            friction = problem.friction(self.u, taus, count)
            z = (friction.deflections + friction.sliding if sliding
                 else (1.0 - _WITHIN) * friction.deflections)
            x = np.concatenate([x, z], axis=2)
        return problem.excitation.on_lines(taus, x, problem.parameters(self.u), first)[1]
