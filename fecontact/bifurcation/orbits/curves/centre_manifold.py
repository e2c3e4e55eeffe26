"""The flow about an orbit on its centre manifold, as a series in the critical amplitudes.

With time in periods, the phase s and amplitudes z,

    x = X(s, z) = sum h_n(s) z^n,  s' = 1 + sum a_n z^n,  z_i' = sum g_in z^n,  T f(X) = dX/dt

where X(s + 1, z) = X(s, M z) for the multipliers M: an amplitude does not turn while it stays
small, and h_n(1) = M^n h_n(0). Each h_n solves h' - A h = r - a x' - sum g v, A = T df/dx, with a
only where M^n = 1 in systems without excitation, and g where M^n is the multiplier of an amplitude
with the vector v: the terms of a normal form. (Kuznetsov, Govaerts, Doedel and Dhooge, SIAM J.
Numer. Anal. 43, 2005; De Witte, Della Rossa, Govaerts and Kuznetsov, SIAM J. Appl. Dyn. Syst. 12,
2013.) The right-hand sides r are Taylor coefficients of the residual of what is known already,
fitted to its values at amplitudes up to a radius.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linalg.bordered import open_side, open_solution
from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.curves.singularity import (
    at_points,
    balanced_ends,
    mean_size,
    ranges_of,
    widths_at_points,
)
from fecontact.core.ties import first_largest

Array = NDArray[Any]
Powers = tuple[int, ...]

# Distance of products of multipliers from a multiplier up to which they are the same.
_SAME = 1e-6
# Orders above that of the series in the fit of residuals, and values for each coefficient.
_MORE, _OVER = 3, 3
# Numbers in the states whose rates are evaluated at once.
_AT_ONCE = 2_000_000


class Linear(NamedTuple):
    """Solution h (N m, d) of linear equations at the Gauss points, its slope h', and a."""

    h: Array
    slope: Array
    drift: complex


class CentreManifold:
    """Critical vectors of an orbit; see :class:`Series` for what follows from them.

    Parameters
    ----------
    problem, u, linearised
        The orbit.
    multipliers : sequence of complex
        Of each amplitude; of complex ones a multiplier and its conjugate follow each other.
    chain : bool
        Whether the two amplitudes are those of a double multiplier with one vector: z0' = z1.

    Attributes
    ----------
    linear : list of Linear
        The critical vectors, as long as the range of the states allows, so that amplitudes up to
        one are those of the orbit's surroundings.
    sizes : (k,) array
        Root of the mean square of each in scaled states, of the first one along a chain.
    """

    def __init__(
        self, problem: CollocationEquations, u: Array, linearised: CollocationLinearisation,
        multipliers: Sequence[complex], chain: bool = False,
    ) -> None:
        self.problem, self.at, self.values = problem, linearised, problem.parameters(u)
        self.multipliers, self.chain = tuple(complex(one) for one in multipliers), chain
        self.x = problem.at_gauss_points(problem.nodes(u))[0]
        self.period, self.span = linearised.period, ranges_of(problem, u)
        rates, self.jacobian, _ = linearised.derivatives
        self.velocity = self.period * rates
        self.widths = widths_at_points(problem)
        self._known: dict[tuple[int, int], _Closing] = {}
        self.linear: list[Linear] = []
        for place, multiplier in enumerate(self.multipliers):
            if self.is_conjugate(place):
                h, slope, drift = self.linear[-1]
                self.linear.append(Linear(h.conj(), slope.conj(), drift.conjugate()))
            elif chain and place:
                self.linear.append(self.closing(multiplier).next_in_chain(-self.linear[0].h))
            else:
                self.linear.append(self.closing(multiplier).critical())
        self.sizes = np.array([self._size(self.linear[0 if chain else place].h, multiplier)
                               for place, multiplier in enumerate(self.multipliers)])

    def is_conjugate(self, place: int) -> bool:
        """Whether an amplitude is the conjugate of the one before."""
        one = self.multipliers[place]
        return (place > 0 and abs(one.imag) > _SAME
                and one.imag == -self.multipliers[place - 1].imag)

    def closing(self, multiplier: complex) -> "_Closing":
        """Equations for h(1) = multiplier h(0), made once."""
        key = round(multiplier.real / _SAME), round(multiplier.imag / _SAME)
        if key not in self._known:
            near = [one for one in self.multipliers if abs(one - multiplier) < _SAME]
            self._known[key] = _Closing(self, near[0] if near else multiplier, bool(near))
        return self._known[key]

    def _size(self, h: Array, multiplier: complex) -> float:
        problem = self.problem
        if self.closing(multiplier).drifts:
            # It is free along the orbit: at right angles to it, as in the phase condition.
            weights = np.tile(problem.rule.weights, problem.intervals)[:, None] * self.widths
            along = np.sum(weights * h * self.velocity) / np.sum(weights * self.velocity**2)
            h = h - along * self.velocity
        return mean_size(problem, h)


class _Closing:
    """Linear equations h' - A h = r - a x' - g v with h(1) = c h(0) at one closing c.

    ``resonant`` says whether c is the multiplier of an amplitude, where they are singular.
    """

    def __init__(self, of: CentreManifold, closing: complex, resonant: bool) -> None:
        start, end, self._balance = balanced_ends(of.at.factors)
        d = len(start)
        self._of, self._closing, self.resonant = of, closing, resonant
        self.drifts = of.problem.autonomous and abs(closing - 1.0) < _SAME
        base = np.zeros((d + self.drifts, d + self.drifts), dtype=complex)
        base[:d, :d] = start + closing * end
        if self.drifts:
            drive = _reduced(of.at, of.widths * of.velocity)[1] * self._balance
            # Scaled to the size of the other columns.
            self._drift_unit = 1.0 / np.linalg.norm(drive)
            base[:d, d] = drive * self._drift_unit
            row = of.velocity[0] / of.span**2
            base[d, :d] = row / np.linalg.norm(row)
        self._base = base
        if resonant:
            lefts, _, rights = np.linalg.svd(base)
            self._null, self._left = rights[-1].conj(), lefts[:, -1]

    def critical(self) -> Linear:
        """The critical vector."""
        if abs(self._closing.imag) < _SAME:
            place = first_largest(np.abs(self._null))
            self._null = self._null * np.exp(-1j * np.angle(self._null[place]))
        nothing = np.zeros_like(self._of.x, dtype=complex)
        h, _, _ = self._expanded(nothing, self._null)
        self._null = self._null / np.abs(h / self._of.span).max()
        return self._expanded(nothing, self._null)

    def next_in_chain(self, rhs: Array) -> Linear:
        """The solution at right angles to the critical vector, where there is one."""
        return self._expanded(rhs, self._bordered(rhs, self._left)[:-1])

    def solve(self, rhs: Array, vector: Array | None) -> tuple[Linear, complex]:
        """The solution, and the multiple g of the vector, if one is given."""
        if vector is None:
            return self._expanded(rhs, np.linalg.solve(self._base, self._side(rhs))), 0.0j
        column = self._side(vector)
        size = np.linalg.norm(column)
        found = self._bordered(rhs, column / size)
        g = complex(found[-1] / size)
        return self._expanded(rhs - g * vector, found[:-1]), g

    def _bordered(self, rhs: Array, column: Array) -> Array:
        """Solution with a multiple of a column, at right angles to the critical vector."""
        n = len(self._base)
        whole = np.zeros((n + 1, n + 1), dtype=complex)
        whole[:n, :n], whole[:n, n] = self._base, column
        whole[n, :n] = self._null.conj() / np.linalg.norm(self._null)
        return np.linalg.solve(whole, np.append(self._side(rhs), 0.0))

    def _side(self, rhs: Array) -> Array:
        side = _reduced(self._of.at, self._of.widths * rhs)[1] * self._balance
        return np.append(side, 0.0) if self.drifts else side

    def _expanded(self, rhs: Array, found: Array) -> Linear:
        """The solution from h at the start, and a in its unit behind that."""
        of, d = self._of, len(self._balance)
        a = complex(found[d] * self._drift_unit) if self.drifts else 0.0j
        whole, start = rhs - a * of.velocity, found[:d]
        reduced = _reduced(of.at, of.widths * whole)[0]
        end: Array = self._closing * start
        nodes: Array = open_solution(of.at.factors, reduced, start, end)
        h: Array = at_points(of.problem, nodes.reshape(of.x.shape), end)
        return Linear(h, of.period * (of.jacobian @ h[:, :, None])[:, :, 0] + whole, a)


class Series:
    """Coefficients of X, of the phase's speed and of the normal form up to an order.

    Residuals are fitted over amplitudes up to a radius.

    Attributes
    ----------
    powers : list of tuple of int
        Of the amplitudes, for each coefficient.
    """

    def __init__(self, of: CentreManifold, order: int, radius: float) -> None:
        self._of, k = of, len(of.multipliers)
        self.powers = _powers(k, order)
        self._place = {powers: place for place, powers in enumerate(self.powers)}
        shape = (len(self.powers), *of.x.shape)
        self._H, self._dH = np.zeros(shape, dtype=complex), np.zeros(shape, dtype=complex)
        self._a = np.zeros(len(self.powers), dtype=complex)
        self._g = np.zeros((k, len(self.powers)), dtype=complex)
        self._H[0], self._dH[0], self._a[0] = of.x, of.velocity, 1.0
        for place, vector in enumerate(of.linear):
            self._keep(self._place[_unit(k, place)], vector)
        if of.chain:
            self._g[0, self._place[_unit(k, 1)]] = 1.0
        self._fit(order, radius)

    @property
    def is_finite(self) -> bool:
        """Whether all coefficients are, as the rates at the amplitudes of the fit were."""
        return bool(np.isfinite(self._g).all() and np.isfinite(self._H).all())

    def term(self, amplitude: int, *powers: int) -> complex:
        """Coefficient of a normal form for amplitudes of vectors of unit mean square."""
        sizes = self._of.sizes
        size = sizes[amplitude] / np.prod(sizes ** np.array(powers))
        return complex(self._g[amplitude, self._place[powers]] * size)

    def states(self, amplitudes: Sequence[complex]) -> Array:
        """States (N m, d) over one period at amplitudes, of vectors of unit mean square."""
        z = np.array([amplitudes], dtype=complex) / self._of.sizes
        return np.tensordot(_products(z, self.powers)[0], self._H, 1).real

    def _fit(self, order: int, radius: float) -> None:
        of, k = self._of, len(self._of.multipliers)
        every = _powers(k, order + _MORE)
        unit = _samples(of, len(every))
        fit = np.linalg.pinv(_products(unit, every))
        for place, powers in enumerate(self.powers):
            degree = sum(powers)
            if degree < 2:
                continue
            # Terms of the same degree depend on each other along a chain alone.
            if of.chain or degree != sum(self.powers[place - 1]):
                same = [at for at, one in enumerate(self.powers) if sum(one) == degree]
                rows = fit[[every.index(self.powers[at]) for at in same]] / radius**degree
                found = dict(zip(same, self._residual(radius * unit, rows), strict=True))
            self._solve_for(place, found[place])

    def _solve_for(self, place: int, rhs: Array) -> None:
        """Add the terms of some powers, for the coefficient of the residual."""
        of = self._of
        closing = complex(np.prod([one**power for one, power in
                                   zip(of.multipliers, self.powers[place], strict=True)]))
        equations = of.closing(closing)
        amplitude = None
        if equations.resonant:
            amplitude = max(at for at, one in enumerate(of.multipliers)
                            if abs(one - closing) < _SAME)
        found, g = equations.solve(rhs, None if amplitude is None else of.linear[amplitude].h)
        self._keep(place, found)
        if amplitude is not None:
            self._g[amplitude, place] = g

    def _keep(self, place: int, found: Linear) -> None:
        self._H[place], self._dH[place], self._a[place] = found

    def _residual(self, z: Array, rows: Array) -> Array:
        """Sums (n, N m, d) over amplitudes z (S, k), with weights (n, S), of T f(X) - dX/dt."""
        of, shape = self._of, self._of.x.shape
        out = np.zeros((len(rows), *shape), dtype=complex)
        step = max(1, _AT_ONCE // of.x.size)
        for first in range(0, len(z), step):
            some = slice(first, first + step)
            out += np.tensordot(rows[:, some], self._residual_at(z[some]), 1)
        return out

    def _residual_at(self, z: Array) -> Array:
        of, count = self._of, len(z)
        powers = _products(z, self.powers)
        x = np.ascontiguousarray(np.tensordot(powers, self._H, 1).real)
        times = np.tile(of.at.times, count)
        f = of.problem.field.rates(times, x.reshape(-1, x.shape[2]), of.values).reshape(x.shape)
        change = np.tensordot(powers, self._dH, 1) * (powers @ self._a)[:, None, None]
        for amplitude in range(z.shape[1]):
            slopes = _slopes(z, self.powers, amplitude)
            change = change + (np.tensordot(slopes, self._H, 1)
                               * (powers @ self._g[amplitude])[:, None, None])
        return np.asarray(of.period * f - change.real)


def _reduced(at: CollocationLinearisation, rows: Array) -> tuple[Array, Array]:
    return open_side(at.factors, rows.reshape(-1))


def _unit(count: int, place: int) -> Powers:
    return tuple(int(at == place) for at in range(count))


def _powers(count: int, order: int) -> list[Powers]:
    """All powers of so many amplitudes up to an order; along a chain the second one rises."""
    found = [one for one in product(range(order + 1), repeat=count) if sum(one) <= order]
    return sorted(found, key=lambda one: (sum(one), tuple(-power for power in one)))


def _products(z: Array, powers: list[Powers]) -> Array:
    """Products (S, n) of amplitudes (S, k) to their powers."""
    return np.prod(z[:, None, :] ** np.array(powers)[None], axis=2)


def _slopes(z: Array, powers: list[Powers], amplitude: int) -> Array:
    """Derivatives (S, n) of the products to one amplitude."""
    given = np.array(powers)
    lower = given.copy()
    lower[:, amplitude] = np.maximum(given[:, amplitude] - 1, 0)
    return np.asarray(given[:, amplitude] * np.prod(z[:, None, :] ** lower[None], axis=2))


def _samples(of: CentreManifold, terms: int) -> Array:
    """Amplitudes (S, k) over the unit ball, conjugate where their vectors are."""
    k, rng = len(of.multipliers), np.random.default_rng(0)
    count = _OVER * terms
    real = rng.normal(size=(count, k))
    # Denser towards the edge, as Chebyshev's points are.
    real *= (np.cos(0.5 * np.pi * rng.random(count)) / np.linalg.norm(real, axis=1))[:, None]
    if k == 1:
        real = np.cos(np.pi * (np.arange(count) + 0.5) / count)[:, None]
    z = real.astype(complex)
    for place in range(1, k):
        if of.is_conjugate(place):
            z[:, place - 1] = real[:, place - 1] + 1j * real[:, place]
            z[:, place] = z[:, place - 1].conj()
    return z
