"""Harmonic balance: unknowns, equations of a periodic orbit and their linearisation."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import VectorField
from fecontact.bifurcation.harmonic.memory import differences, solve_around
from fecontact.bifurcation.harmonic.series import (
    Series,
    basis_at,
    differentiated,
    fill_blocks,
    series,
)
from fecontact.core.types import Array

# Relative step of differences in a parameter that changes the period.
_DIFFERENCE = 1e-5


@dataclass(frozen=True)
class Layout:
    """How states x = [q, q', y, z] become unknowns.

    Attributes
    ----------
    states : int
        Their number d.
    displacements : int
        Number m of displacements q, which come first and whose rates are the states behind them;
        only q is unknown.
    memory : int
        Number of internal variables z, the last states, which are unknown at the samples.
    nodes : int
        Number of contact nodes to which these belong.
    """

    states: int
    displacements: int = 0
    memory: int = 0
    nodes: int = 0

    @property
    def harmonic(self) -> int:
        """Number b of functions that are Fourier series: q and y."""
        return self.states - self.displacements - self.memory

    @cached_property
    def columns(self) -> Array:
        """Indices (b,) of q and y among the states."""
        m = self.displacements
        return np.append(np.arange(m), np.arange(2 * m, self.states - self.memory))

    @cached_property
    def rows(self) -> Array:
        """Indices (b,) of the equations of q and y among the rates."""
        m = self.displacements
        return np.arange(m, self.states - self.memory)


def layout_of(field: VectorField) -> Layout:
    """Layout of the states of a field: displacements and memory of contact systems alone."""
    if not isinstance(field, ContactField):
        return Layout(field.dimension)
    modes, nodes = field.system().basis.modes, field.system().basis.contact_nodes
    memory = field.dimension - 2 * modes
    return Layout(field.dimension, modes, memory, nodes if memory else 0)


@dataclass(frozen=True, eq=False)
class Balance:
    """Equations of a periodic orbit of x' = f(t, x, p) with truncated Fourier series.

    With tau = t / T, displacements q and other states y are Fourier series with H harmonics,
    velocities follow from q. The residuals q'' - f_v and y' - f_y, at N samples a period, have no
    part in the harmonics 0..H (alternating frequency and time). Internal variables z of friction
    are unknown at the samples; see :mod:`fecontact.bifurcation.harmonic.memory`. If f does not
    depend on t, T is an unknown and the phase is fixed by int <x, y'> = 0 with the orbit y before;
    else T is ``periods`` times the period of the forcing.

    The unknowns are ``u = [coefficients (2 H + 1) b, z (N c), T if it is unknown, parameter]``.

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

    @cached_property
    def autonomous(self) -> bool:
        """Whether the period is an unknown."""
        return self.field.forcing_period(self.values) is None

    @cached_property
    def series(self) -> Series:
        """Transforms between samples and coefficients."""
        return series(self.harmonics, self.samples)

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.reference.size

    @cached_property
    def common(self) -> int:
        """Number of unknowns beside functions of time."""
        return 1 + self.autonomous

    def coefficients(self, u: Array) -> Array:
        """Coefficients (2 H + 1, b) of q and y."""
        return u[: self.size].reshape(self.reference.shape)

    def memory(self, u: Array) -> Array:
        """Internal variables (N, c) at the samples."""
        return u[self.size : len(u) - self.common].reshape(self.samples, self.layout.memory)

    def period(self, u: Array) -> float:
        """Period T [s] of the orbit."""
        if self.autonomous:
            return float(u[-2])
        given = self.field.forcing_period(self.parameters(u))
        assert given is not None
        return self.periods * given

    def parameters(self, u: Array) -> Array:
        """Parameter values (k,)."""
        values = self.values.copy()
        values[self.free] = u[-1]
        return values

    @cached_property
    def _weights(self) -> Array:
        sizes = self.scales[self.layout.columns] ** -2.0
        over = np.full((2 * self.harmonics + 1, 1), 0.5)
        over[0] = 1.0
        memory = self.scales[: self.layout.states][self.layout.states - self.layout.memory :]
        return np.concatenate([
            (over * sizes).reshape(-1), np.tile(memory**-2.0 / self.samples, self.samples),
            self.scales[-self.common :] ** -2.0])

    def weights(self) -> Array:
        """Weights of the inner product: mean over the orbit of scaled q, y, z; T; parameter."""
        return self._weights

    @cached_property
    def phase_row(self) -> Array:
        """Row (n,) of the phase condition over the coefficients."""
        row = differentiated(self.reference) * self.scales[self.layout.columns] ** -2.0
        return np.asarray((row / (np.abs(row).max() or 1.0)).reshape(-1))

    def states(self, u: Array, period: float, times: Array | None = None) -> Array:
        """States (N, d) at the samples, or (k, d) at times tau (k,)."""
        if times is None:
            return filled(self.layout, self.coefficients(u), self.memory(u), period,
                          self.series.values)
        return series_states(self.layout, self.coefficients(u), self.memory(u), period, times)


def filled(layout: Layout, X: Array, z: Array, period: float, values: Array) -> Array:
    """States (N, d) from coefficients, internal variables (N, c) and the basis (N, 2 H + 1)."""
    m, end = layout.displacements, layout.states - layout.memory
    moved = np.asarray(values @ X)
    if end == layout.harmonic == layout.states:
        return moved
    x = np.empty((len(values), layout.states))
    x[:, :m], x[:, 2 * m : end], x[:, end:] = moved[:, :m], moved[:, m:], z
    x[:, m : 2 * m] = values @ (differentiated(X[:, :m]) / period)
    return x


def series_states(layout: Layout, X: Array, z: Array, period: float, times: Array) -> Array:
    """States (k, d) at times tau (k,); internal variables linear between their samples."""
    return filled(layout, X, around(z, times), period, basis_at(times, len(X) // 2))


def around(samples: Array, times: Array) -> Array:
    """Values (k, c) at times tau of a periodic function, linear between its samples (N, c)."""
    place = np.mod(times, 1.0) * len(samples)
    first = place.astype(int) % len(samples)
    part = (place - np.floor(place))[:, None]
    return np.asarray((1.0 - part) * samples[first] + part * samples[(first + 1) % len(samples)])


class Linearised:
    """Residual at u, and solutions of systems with the derivative there.

    The residual holds the balance of the harmonics (n), the rates of z at the samples, and the
    phase condition where the period is unknown.
    """

    def __init__(self, problem: Balance, u: Array) -> None:
        self.problem, self.u = problem, u
        self.period = problem.period(u)
        self._factors: tuple[Any, Array] | None = None

    @cached_property
    def times(self) -> Array:
        """Times (N,) [s] of the samples; zero for autonomous systems."""
        problem = self.problem
        return (np.zeros(problem.samples) if problem.autonomous
                else problem.series.times * self.period)

    @cached_property
    def states(self) -> Array:
        """States (N, d) at the samples."""
        return self.problem.states(self.u, self.period)

    @cached_property
    def rates(self) -> Array:
        """Rates f (N, d) at the samples."""
        if "derivatives" in self.__dict__:
            return self.derivatives[0]
        return self.problem.field.rates(self.times, self.states, self.problem.parameters(self.u))

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and their derivatives to states and parameter at the samples."""
        problem = self.problem
        return problem.field.derivatives(self.times, self.states, problem.parameters(self.u),
                                         (problem.free,))

    @cached_property
    def residual(self) -> Array:
        """Residual (n + N c + 1,), without the last entry for forced systems."""
        problem = self.problem
        found = self._balance(self.u, self.period, self.rates)
        if not problem.autonomous:
            return found
        return np.append(found, problem.phase_row @ self.u[: problem.size])

    def _balance(self, u: Array, period: float, rates: Array) -> Array:
        problem, layout = self.problem, self.problem.layout
        m = layout.displacements
        turned = differentiated(problem.coefficients(u)) / period
        if m:
            turned[:, :m] = differentiated(turned[:, :m]) / period
        turned -= problem.series.projection @ rates[:, m : layout.states - layout.memory]
        if not layout.memory:
            return turned.reshape(-1)
        first = layout.states - layout.memory
        z = differences(problem.memory(u)) / period - rates[:, first:]
        return np.concatenate([turned.reshape(-1), z.reshape(-1)])

    @cached_property
    def _common(self) -> Array:
        """Derivatives (n + N c, e) of the balance to T, if it is unknown, and the parameter."""
        problem, layout, u, T = self.problem, self.problem.layout, self.u, self.period
        m, first = layout.displacements, layout.states - layout.memory
        _, J, P = self.derivatives
        if problem.autonomous:
            # Velocities are q' / T.
            slowed = np.zeros_like(self.states)
            if m:
                slowed = -np.matmul(J[:, :, m : 2 * m],
                                    self.states[:, m : 2 * m, None])[:, :, 0] / T
            turned = differentiated(problem.coefficients(u)) / T**2
            turned[:, :m] = 2.0 * differentiated(turned[:, :m]) / T
            by_period = -turned.reshape(-1)
            if layout.memory:
                by_period = np.append(by_period, -differences(problem.memory(u)) / T**2)
            by_period += self._by_rates(slowed)
            return np.stack([by_period, self._by_rates(P[:, :, 0])], axis=1)
        h = _DIFFERENCE * max(abs(float(u[-1])), 1e-3)
        ends = [u.copy(), u.copy()]
        ends[0][-1], ends[1][-1] = u[-1] + h, u[-1] - h
        periods = [problem.period(end) for end in ends]
        if periods[0] == T == periods[1]:
            return self._by_rates(P[:, :, 0])[:, None]
        sides = [self._balance(end, period, problem.field.rates(
            problem.series.times * period, problem.states(end, period), problem.parameters(end)))
            for end, period in zip(ends, periods, strict=True)]
        return ((sides[0] - sides[1]) / (2.0 * h))[:, None]

    def _by_rates(self, change: Array) -> Array:
        """Change (n + N c,) of the balance with a change (N, d) of the rates."""
        problem, layout = self.problem, self.problem.layout
        first = layout.states - layout.memory
        found = problem.series.projection @ change[:, layout.displacements : first]
        return -np.concatenate([found.reshape(-1), change[:, first:].reshape(-1)])

    @cached_property
    def matrix(self) -> Array:
        """Derivatives (n, n) of the balance of harmonics to the coefficients, z held."""
        problem, layout = self.problem, self.problem.layout
        J, transforms = self.derivatives[1], problem.series
        m, N = layout.displacements, problem.samples
        if m or layout.memory:
            by_state = J[:, layout.rows[:, None], layout.columns].reshape(N, -1)
            by_speed = J[:, layout.rows[0] : layout.rows[-1] + 1, m : 2 * m].reshape(N, -1)
        else:
            by_state, by_speed = J.reshape(N, -1), np.zeros((N, 0))
        out = np.empty((len(problem.reference), layout.harmonic) * 2)
        fill_blocks(transforms.cosines @ by_state, transforms.sines @ by_state,
                    transforms.cosines @ by_speed, transforms.sines @ by_speed, self.period, m,
                    layout.harmonic, out)
        return out.reshape(problem.size, problem.size)

    @cached_property
    def _memory_slopes(self) -> Array:
        """Derivatives (N, n, s, s) of the rates of z to z, node by node."""
        layout, J = self.problem.layout, self.derivatives[1]
        first, s = layout.states - layout.memory, layout.memory // layout.nodes
        whole = J[:, first:, first:].reshape(len(J), layout.nodes, s, layout.nodes, s)
        nodes = np.arange(layout.nodes)
        return np.ascontiguousarray(np.moveaxis(whole[:, nodes, :, nodes], 0, 1))

    @cached_property
    def _followed(self) -> Array:
        """Derivatives (N, c, n + e) of z to coefficients and common unknowns, negative."""
        problem, layout, J = self.problem, self.problem.layout, self.derivatives[1]
        m, first = layout.displacements, layout.states - layout.memory
        H, b, c = problem.harmonics, layout.harmonic, layout.memory
        values = problem.series.values
        turned = differentiated(np.eye(2 * H + 1))
        speeds = values @ turned / self.period
        found = np.empty((problem.samples, c, 2 * H + 1, b))
        np.multiply(values[:, None, :, None], -J[:, first:, None, layout.columns], out=found)
        found[..., :m] -= speeds[:, None, :, None] * J[:, first:, None, m : 2 * m]
        common = self._common[problem.size :].reshape(problem.samples, c, -1)
        right = np.concatenate([found.reshape(problem.samples, c, -1), common], axis=2)
        solve_around(self._memory_slopes, self.period, right)
        return right

    def _coupled(self, z: Array) -> Array:
        """Change (n, columns) of the balance with a change (N, c, columns) of z."""
        layout, transforms = self.problem.layout, self.problem.series
        by_memory = self.derivatives[1][:, layout.displacements : layout.states - layout.memory,
                                        layout.states - layout.memory :]
        forces = np.matmul(by_memory, z)
        found = np.tensordot(transforms.projection, forces, axes=(1, 0))
        return -np.asarray(found.reshape(self.problem.size, -1))

    @cached_property
    def condensed(self) -> Array:
        """The equations without z: rows of the harmonics, and of the phase, over (n + e)."""
        problem = self.problem
        n = problem.size
        found = np.empty((n + problem.autonomous, n + problem.common))
        found[:n, :n], found[:n, n:] = self.matrix, self._common[:n]
        if problem.layout.memory:
            found[:n] -= self._coupled(self._followed)
        if problem.autonomous:
            found[n, :n], found[n, n:] = problem.phase_row, 0.0
        return found

    def condensed_row(self, row: Array) -> Array:
        """A row (n + N c + e,) without z (n + e,)."""
        problem = self.problem
        n, tail = problem.size, len(row) - problem.common
        short = np.append(row[:n], row[tail:])
        if problem.layout.memory:
            short -= np.tensordot(row[n:tail].reshape(problem.samples, -1), self._followed, axes=2)
        return short

    def expanded(self, short: Array) -> Array:
        """Unknowns (n + N c + e,) of a solution (n + e,) of the homogeneous equations."""
        problem = self.problem
        n = problem.size
        if not problem.layout.memory:
            return short
        return np.concatenate([short[:n], -(self._followed @ short).reshape(-1), short[n:]])

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        problem = self.problem
        n, middle = problem.size, len(row) - problem.common
        own = self.condensed_row(row)
        if not problem.layout.memory:
            return self._solved(own, rhs)
        z = rhs[n:middle].reshape(problem.samples, problem.layout.memory, 1).copy()
        solve_around(self._memory_slopes, self.period, z)
        short = np.concatenate([rhs[:n] - self._coupled(z)[:, 0], rhs[middle:]])
        short[-1] -= row[n:middle] @ z.reshape(-1)
        found = self._solved(own, short)
        whole = self.expanded(found)
        whole[n:middle] += z.reshape(-1)
        return whole

    def _solved(self, row: Array, rhs: Array) -> Array:
        if self._factors is None:
            square = np.empty((len(row), len(row)))
            square[:-1], square[-1] = self.condensed, row
            factors, pivots, failed = dgetrf(square.T, overwrite_a=1)
            if failed:
                return np.full(len(row), np.nan)
            self._factors = (factors, pivots), row
        (factors, pivots), first = self._factors
        found = dgetrs(factors, pivots, rhs, trans=1)[0]
        if first is row or np.array_equal(first, row):
            return np.asarray(found)
        # Another last row: add what solves the homogeneous equations.
        along = dgetrs(factors, pivots, np.append(np.zeros(len(row) - 1), 1.0), trans=1)[0]
        return np.asarray(found + (rhs[-1] - row @ found) / (row @ along) * along)
