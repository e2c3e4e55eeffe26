"""Harmonic balance: unknowns, equations of a periodic orbit and their linearisation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.compiled.arrays import Equations
from fecontact.bifurcation.harmonic.compiled.balance import CompiledBalance
from fecontact.bifurcation.harmonic.compiled.kinks import SampledRates, add_kinks, kink_onsets
from fecontact.bifurcation.harmonic.elements import Displacements, ElementForces, follow_elements
from fecontact.bifurcation.harmonic.engine_order import Waves
from fecontact.bifurcation.harmonic.layout import Layout, SeriesUnknowns, all_coefficients, filled
from fecontact.bifurcation.harmonic.memory import LEAK, Kept, differences, march, solve_around
from fecontact.bifurcation.harmonic.series import (
    Series,
    differentiated,
    fill_blocks,
    rows_of,
    series,
)
from fecontact.bifurcation.harmonic.woodbury import (
    BorderedEquations,
    Factors,
    WoodburySolver,
    contact_directions,
)
from fecontact.bifurcation.orbits.unknowns import OrbitUnknowns, beside, by_differences
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, Integers
from fecontact.system.fields.vector_field import VectorField

UNREPEATED = ("The internal variables of friction do not come to repeat; take more samples a "
              "period.")
_NOTHING_KEPT = Kept(np.zeros((0, 0)), np.zeros(0), *np.zeros((2, 0), dtype=np.int64))


@dataclass(frozen=True, eq=False)
class Balance(SeriesUnknowns, OrbitUnknowns):
    """Equations of a periodic orbit of x' = f(t, x, p) with truncated Fourier series.

    With tau = t / T, displacements q and other states y are Fourier series with H harmonics,
    velocities follow from q. The residuals q'' - f_v and y' - f_y, at N samples a period, have no
    part in the harmonics 0..H (alternating frequency and time). Internal variables z of friction
    are marched around the period, see :mod:`fecontact.bifurcation.harmonic.memory`; elastic Coulomb
    elements are followed one by one, see :mod:`fecontact.bifurcation.harmonic.elements`, and f is
    that without them. If f does not
    depend on t, T is an unknown and the phase is fixed by int <x, y'> = 0 with the orbit y before;
    else T is ``periods`` times the period of the forcing.

    The unknowns are ``u = [coefficients (2 H + 1) b, T if it is unknown, parameter]``.

    Attributes
    ----------
    field : VectorField
    values : (k,) array
        Parameters; the free one is taken from u.
    free : int
        Index of the free parameter.
    harmonics, samples : int
        H and N.
    reference : (2 H + 1, b) array
        Coefficients of the orbit that fixes the phase.
    scales : (d + 2,) array
        Scales in the step length: of each state, of the period and of the parameter.
    layout : Layout
        How states become unknowns.
    periods : int
        Number of forcing periods in one period of the orbit.
    turn : float, optional
        Product of the period of the forcing and the parameter, where this is a frequency.
    fixed : float, optional
        Period of the forcing [s] where the parameter does not change it; see
        :func:`fecontact.bifurcation.harmonic.starts.timing_of`.
    kept : Kept
        Deflections of elements that never slide.
    compiled : CompiledBalance, optional
        Makes compiled equations.
    orders : tuple of int, optional
        Harmonics of the series where some of 0 to H are left out: these are zero.
    waves : Waves, optional
        Equations of one sector of a wheel.
    """

    field: VectorField
    values: Array
    free: int
    harmonics: int
    samples: int
    reference: Array
    scales: Array
    layout: Layout
    periods: int = 1
    turn: float | None = None
    fixed: float | None = None
    kept: Kept = _NOTHING_KEPT
    compiled: CompiledBalance | None = None
    orders: tuple[int, ...] | None = None
    waves: Waves | None = None

    def equations(self, value: float) -> Equations | None:
        """Compiled equations about a value of the parameter; None where there are none."""
        return None if self.compiled is None else self.compiled.equations(self, value)

    @cached_property
    def autonomous(self) -> bool:
        """Whether the period is an unknown."""
        return self.turn is None and self.fixed is None and super().autonomous

    @cached_property
    def series(self) -> Series:
        """Transforms between samples and coefficients."""
        return series(self.harmonics, self.samples)

    @cached_property
    def rows_kept(self) -> Integers:
        """Rows of the coefficients (2 H + 1, b) whose harmonics are not left out."""
        return rows_of(self.orders, self.harmonics)

    @property
    def harmonics_kept(self) -> Integers:
        """Harmonics of the series, ascending."""
        return np.unique((self.rows_kept + 1) // 2)

    @cached_property
    def left_out(self) -> Integers:
        """Indices of the coefficients that are zero because their harmonics are left out."""
        places = np.arange(self.size).reshape(self.reference.shape)
        left = np.delete(places, self.rows_kept, axis=0).reshape(-1)
        if self.waves is not None:
            left = np.union1d(left, self.waves.left_out(self.reference.shape))
        return left

    def period(self, u: Array) -> float:
        """Period T [s] of the orbit."""
        if self.turn is not None:
            return self.periods * self.turn / float(u[-1])
        return super().period(u) if self.fixed is None else self.periods * self.fixed

    @cached_property
    def onsets(self) -> Array:
        """Penetrations (k, n) at which normal forces of contact nodes have kinks."""
        if not isinstance(self.field, ContactField):
            return np.zeros((0, 0))
        return kink_onsets(self.field, self.values, self.free)

    def add_kinks(
        self, times: Array, states: Array, values: Array, period: float, rates: Array,
        derivatives: Array | None = None,
    ) -> Array:
        """Add to rates (N, d), and derivatives (N, d, d), what kinks between samples change.

        Returns ``widths`` (m, N), see
        :func:`fecontact.bifurcation.harmonic.compiled.kinks.add_kinks`.
        """
        widths = np.zeros((self.layout.displacements, len(rates)))
        if self.onsets.size and isinstance(self.field, ContactField):
            add_kinks(times, states, self.field.arrays(values), self.onsets, period / self.samples,
                      derivatives is not None, SampledRates(
                          rates, np.zeros((1, 1, 1)) if derivatives is None else derivatives,
                          widths))
        return widths

    @cached_property
    def bare(self) -> VectorField:
        """The field without elements that are followed one by one."""
        if not self.kept.exact:
            return self.field
        assert isinstance(self.field, ContactField)
        return self.field.without_elements()

    def bare_states(self, states: Array) -> Array:
        """States (N, d) without elements that are followed one by one."""
        return np.ascontiguousarray(states[:, : self.bare.dimension])

    def followed(
        self, u: Array, period: float, derivatives: bool = True
    ) -> ElementForces:
        """Friction of elements at the samples, their deflections, and derivatives.

        Raises
        ------
        AnalysisError
            If elements do not come to repeat.
        """
        assert isinstance(self.field, ContactField)
        laws, N = self.field.arrays(self.parameters(u)), self.samples
        n, d, _ = laws.rows.shape
        t, L = (d - 1) * n, 2 * self.harmonics + 1
        found = ElementForces(np.zeros((t, N)), np.zeros((N, self.layout.memory)),
                              np.zeros((t, N, d * L) if derivatives else (0, 0, 0)))
        x = Displacements(
            np.ascontiguousarray(self.coefficients(u)[:, : self.layout.displacements]), period,
            self.series.values)
        if not follow_elements(x, laws, self.kept.elements, self.kept.offsets, derivatives, found):
            raise AnalysisError(UNREPEATED)
        return found

    def rates(self, times: Array, states: Array, values: Array, period: float) -> Array:
        """Rates (N, d) at the samples, with kinks between them; those of :attr:`bare`."""
        found = self.bare.rates(times, self.bare_states(states), values)
        self.add_kinks(times, states, values, period, found)
        return found

    @cached_property
    def directions(self) -> Array | None:
        """Columns (m, r) of what contact nodes see, where these are few; see FewContacts."""
        return None if self.waves is not None else contact_directions(
            self.field, self.values, self.harmonics)

    @property
    def common_scales(self) -> Array:
        """Scales of the period, if it is unknown, and the parameter."""
        return self.scales[-self.common :]

    @cached_property
    def phase_row(self) -> Array:
        """Row (n,) of the phase condition over the coefficients."""
        return self.phase_row_of(differentiated(self.reference))

    def states(self, u: Array, period: float, z: Array) -> Array:
        """States (N, d) with z (N, c) at the samples."""
        return filled(self.layout, self.coefficients(u), z, period, self.series.values)

    def whole(self, u: Array, period: float) -> Array:
        """Coefficients (2 H + 1, d - c) of all states but z."""
        return all_coefficients(self.layout, self.coefficients(u), period)

    def times(self, period: float) -> Array:
        """Times (N,) [s] of the samples; zero for autonomous systems."""
        return np.zeros(self.samples) if self.autonomous else self.series.times * period

    def marched(self, u: Array, period: float) -> Array:
        """States (N, d) at the samples with differences as velocities, under which z repeats.

        Raises
        ------
        AnalysisError
            If internal variables do not come to repeat.
        """
        layout = self.layout
        m = layout.displacements
        x = self.states(u, period, np.zeros((self.samples, layout.memory)))
        if not layout.memory:
            return x
        assert isinstance(self.field, ContactField)
        x[:, m : 2 * m] = differences(x[:, :m]) / period
        z = np.empty((self.samples, layout.memory))
        if not march(self.times(period), x, self.field.arrays(self.parameters(u)), period,
                     self.kept.blocks, self.kept.at(x[:, :m]), z):
            raise AnalysisError(UNREPEATED)
        x[:, layout.internal] = z
        return x


class Linearised(BorderedEquations):
    """Residual at u, and solutions of systems with the derivative there.

    The residual holds the balance of the harmonics (n), and the phase condition where the period
    is unknown.
    """

    def __init__(self, problem: Balance, u: Array) -> None:
        self.problem, self.u = problem, u
        self.period = problem.period(u)
        self._widths: Array | None = None

    @cached_property
    def times(self) -> Array:
        """Times (N,) [s] of the samples; zero for autonomous systems."""
        return self.problem.times(self.period)

    @cached_property
    def marched(self) -> Array:
        """States (N, d) in which internal variables are marched."""
        return self.problem.marched(self.u, self.period)

    @cached_property
    def elements(self) -> ElementForces:
        """See :meth:`Balance.followed`."""
        return self.problem.followed(self.u, self.period)

    @cached_property
    def tangents(self) -> Array:
        """Rows (t n, m) of the displacements of nodes along their tangents."""
        assert isinstance(self.problem.field, ContactField)
        rows = self.problem.field.arrays(self.problem.parameters(self.u)).rows
        return np.asarray(rows[:, ::2].reshape(-1, rows.shape[2]))

    @cached_property
    def memory(self) -> Array:
        """Internal variables (N, c) at the samples."""
        layout = self.problem.layout
        if self.problem.kept.exact:
            return self.elements.deflections
        if not layout.memory:
            return np.zeros((self.problem.samples, 0))
        return np.ascontiguousarray(self.marched[:, layout.internal])

    @cached_property
    def states(self) -> Array:
        """States (N, d) at the samples."""
        return self.problem.states(self.u, self.period, self.memory)

    @cached_property
    def rates(self) -> Array:
        """Rates f at the samples, with all friction; elements followed one by one have none."""
        if "derivatives" in self.__dict__:
            found = self.derivatives[0]
        else:
            found = self.problem.rates(self.times, self.states, self.problem.parameters(self.u),
                                       self.period)
        if self.problem.kept.exact:
            found = found.copy()
            m = self.problem.layout.displacements
            found[:, m : 2 * m] -= self.elements.friction.T @ self.tangents
        return found

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates without elements, and their derivatives to states and parameter at the samples."""
        problem, values = self.problem, self.problem.parameters(self.u)
        f, J, P = problem.bare.derivatives(self.times, problem.bare_states(self.states), values,
                                           (problem.free,))
        if problem.onsets.size:
            self._widths = problem.add_kinks(self.times, self.states, values, self.period, f, J)

            def change(u: Array) -> Array:
                found = np.zeros_like(f)
                problem.add_kinks(self.times, self.states, problem.parameters(u), self.period,
                                  found)
                return found

            P[:, :, 0] += by_differences(change, self.u)
        return f, J, P

    @property
    def by_states(self) -> Array:
        """Derivatives (N, d, d) of the rates to all states at the samples, z among them."""
        problem = self.problem
        if not problem.kept.exact:
            return self.derivatives[1]
        values = problem.parameters(self.u)
        f, J, _ = problem.field.derivatives(self.times, self.states, values)
        problem.add_kinks(self.times, self.states, values, self.period, f, J)
        return J

    @cached_property
    def residual(self) -> Array:
        """Residual (n + 1,), without the last entry for forced systems."""
        problem = self.problem
        turned = self.free_balance.copy()
        if problem.waves is not None:
            problem.waves.residual(problem.coefficients(self.u), turned, self.period,
                                  float(self.u[-1]), problem.harmonics_kept)
        found = turned.reshape(-1)
        found[problem.left_out] = self.u[problem.left_out]
        if not problem.autonomous:
            return found
        return np.append(found, problem.phase_row @ self.u[: problem.size])

    @cached_property
    def free_balance(self) -> Array:
        """Balance (2 H + 1, b) of the harmonics, without the equations of waves."""
        return self._balance(self.u, self.period, self.rates)

    def _bare_balance(self, u: Array) -> Array:
        """Balance (2 H + 1, b) at other unknowns with the same z, without elements."""
        problem, T = self.problem, self.problem.period(u)
        return self._balance(u, T, problem.rates(
            problem.times(T), problem.states(u, T, self.memory), problem.parameters(u), T))

    def _balance(self, u: Array, period: float, rates: Array) -> Array:
        problem, layout = self.problem, self.problem.layout
        m = layout.displacements
        turned = differentiated(problem.coefficients(u)) / period
        if m:
            turned[:, :m] = differentiated(turned[:, :m]) / period
        turned -= problem.series.projection @ rates[:, layout.rows]
        return turned

    @cached_property
    def _common(self) -> Array:
        """Derivatives (n, e) of the balance to T, if it is unknown, and the parameter; z held."""
        problem, u, T = self.problem, self.u, self.period
        m = problem.layout.displacements
        _, J, P = self.derivatives
        if problem.autonomous:
            turned = differentiated(problem.coefficients(u)) / T**2
            turned[:, :m] = 2.0 * differentiated(turned[:, :m]) / T
            slowed = self._slowed(J, self.states)
            if self._widths is not None:
                slowed[:, m : 2 * m] += self._widths.T / T
            by_period = -turned.reshape(-1) + self._by_rates(slowed)
            return np.stack([by_period, self._by_rates(P[:, :, 0])], axis=1)
        if self._same_period:
            return self._by_rates(P[:, :, 0])[:, None]
        return by_differences(self._bare_balance, u).reshape(-1, 1)

    def _slowed(self, J: Array, x: Array) -> Array:
        """Derivatives (N, rows) of rates to T, through velocities q' / T, from J (N, rows, d)."""
        m = self.problem.layout.displacements
        if not m:
            return np.zeros(J.shape[:2])
        return np.asarray(-np.matmul(J[:, :, m : 2 * m], x[:, m : 2 * m, None])[:, :, 0]
                          / self.period)

    @property
    def _same_period(self) -> bool:
        """Whether the period stays where the parameter changes."""
        return all(self.problem.period(side) == self.period for side in beside(self.u))

    @property
    def _by_common(self) -> Array:
        """Derivatives (e,) of the period to the period, if it is unknown, and the parameter."""
        if self.problem.autonomous:
            return np.array([1.0, 0.0])
        return by_differences(self.problem.period, self.u).reshape(1)

    def _by_rates(self, change: Array) -> Array:
        """Change (n,) of the balance with a change (N, d) of the rates."""
        found = self.problem.series.projection @ change[:, self.problem.layout.rows]
        return -found.reshape(-1)

    @cached_property
    def matrix(self) -> Array:
        """Derivatives (n, n) of the balance of harmonics to the coefficients, z held."""
        problem, layout = self.problem, self.problem.layout
        J, transforms = self.derivatives[1], problem.series
        m, N = layout.displacements, problem.samples
        if m or layout.memory:
            by_state = J[:, layout.rows, layout.columns].reshape(N, -1)
            by_speed = J[:, layout.rows, m : 2 * m].reshape(N, -1)
        else:
            by_state, by_speed = J.reshape(N, -1), np.zeros((N, 0))
        out = np.empty((len(problem.reference), layout.harmonic) * 2)
        fill_blocks(transforms.cosines @ by_state, transforms.sines @ by_state,
                    transforms.cosines @ by_speed, transforms.sines @ by_speed, self.period, m,
                    layout.harmonic, out)
        return out.reshape(problem.size, problem.size)

    @cached_property
    def _followed(self) -> Array:
        """Derivatives (N, c, n + e) of z to coefficients and common unknowns."""
        problem, layout, x, T = self.problem, self.problem.layout, self.marched, self.period
        m, own = layout.displacements, layout.internal
        H, b, c, N = problem.harmonics, layout.harmonic, layout.memory, problem.samples
        _, J, P = problem.field.derivatives(self.times, x, problem.parameters(self.u),
                                            (problem.free,))
        J = J[:, own]
        J[:, :, :m] += LEAK / T * problem.kept.rows
        values = problem.series.values
        speeds = differences(values) / T
        found = np.empty((N, c, 2 * H + 1, b))
        np.multiply(values[:, None, :, None], J[:, :, None, layout.columns], out=found)
        found[..., :m] += speeds[:, None, :, None] * J[:, :, None, m : 2 * m]
        common = np.empty((N, c, problem.common))
        common[:, :, -1] = P[:, own, 0]
        if problem.autonomous:
            common[:, :, 0] = self._slowed(J, x) + differences(x[:, own]) / T**2
        elif not self._same_period:
            common[:, :, -1] = by_differences(self._marching, self.u)
        right = np.concatenate([found.reshape(N, c, -1), common], axis=2)
        # Variables of other nodes have no influence.
        s, nodes = c // layout.nodes, np.arange(layout.nodes)
        whole = J[:, :, own].reshape(N, layout.nodes, s, layout.nodes, s)
        solve_around(np.ascontiguousarray(np.moveaxis(whole[:, nodes, :, nodes], 0, 1)), T,
                     problem.kept.blocks, right)
        return right

    def _marching(self, u: Array) -> Array:
        """Residual (N, c) of the equations of z without leak, at other unknowns with the same z."""
        problem, T = self.problem, self.problem.period(u)
        m, own = problem.layout.displacements, problem.layout.internal
        x = problem.states(u, T, self.memory)
        x[:, m : 2 * m] = differences(x[:, :m]) / T
        rates = problem.field.rates(problem.times(T), x, problem.parameters(u))
        return np.asarray(rates[:, own] - differences(x[:, own]) / T)

    def _add_elements(self, found: Array) -> None:
        """Add what elements contribute to derivatives (n, n + e) of the balance."""
        problem, u, rows = self.problem, self.u, self.tangents
        assert isinstance(problem.field, ContactField)
        L, n = len(problem.reference), problem.size
        axes = problem.field.arrays(problem.parameters(u)).rows
        nodes, d, m = axes.shape
        change = (problem.series.projection @ self.elements.rows).reshape(nodes, d - 1, L, d, L)
        found[:n, :n].reshape(L, m, L, m)[:] += np.einsum(
            "jtlak,jti,jam->likm", change, axes[:, ::2], axes, optimize=True)
        for column in range(-problem.common, 0):
            change = by_differences(lambda end: problem.followed(
                end, problem.period(end), False).friction, u, column)
            found[:n, column] += (problem.series.projection @ (change.T @ rows)).reshape(-1)

    def _coupled(self, z: Array) -> Array:
        """Change (n, columns) of the balance with a change (N, c, columns) of z."""
        problem, layout, transforms = self.problem, self.problem.layout, self.problem.series
        by_memory = self.derivatives[1][:, layout.rows, layout.internal]
        # Few contact displacements take part: project before, not behind.
        directions = None if problem.autonomous else problem.directions
        if directions is not None:
            by_memory = directions.T @ by_memory
        L, columns = len(problem.reference), z.shape[2]
        weighted = np.einsum("kn,nic->kinc", transforms.projection, by_memory)
        found = weighted.reshape(L * by_memory.shape[1], -1) @ z.reshape(-1, columns)
        if directions is not None:
            found = directions @ found.reshape(L, -1, columns)
        return -np.asarray(found.reshape(problem.size, columns))

    @cached_property
    def condensed(self) -> Array:
        """Derivatives (n + 1, n + e) of the residual, without the last row for forced systems."""
        problem = self.problem
        n = problem.size
        found = np.empty((n + problem.autonomous, n + problem.common))
        found[:n, :n], found[:n, n:] = self.matrix, self._common
        if problem.kept.exact:
            self._add_elements(found)
        elif problem.layout.memory:
            found[:n] += self._coupled(self._followed)
        if problem.autonomous:
            found[n, :n], found[n, n:] = problem.phase_row, 0.0
        if problem.waves is not None:
            problem.waves.derivatives(found[:n], problem.coefficients(self.u), self.free_balance,
                                     self.period, float(self.u[-1]), self._by_common,
                                     problem.harmonics_kept)
        return zero_left_out(found, problem.left_out)

    def factorised(self, square: Array) -> Factors | WoodburySolver | None:
        """Factors of a square matrix; None where it is singular."""
        if len(self.problem.left_out):
            return Factors.without(square, self.problem.left_out)
        directions = None if self.problem.autonomous else self.problem.directions
        return Factors.of(square) if directions is None else WoodburySolver.of(square, directions)


def zero_left_out(matrix: Array, left: Integers) -> Array:
    """The derivatives (n, n + e) with the equations u_k = 0 for indices k that are left out."""
    if len(left):
        matrix[left], matrix[:, left] = 0.0, 0.0
        matrix[left, left] = 1.0
    return matrix
