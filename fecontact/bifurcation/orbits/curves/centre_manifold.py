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

import numpy as np

from fecontact.bifurcation.linalg.bordered import open_side, open_solution
from fecontact.bifurcation.orbits.curves.singularity import at_points
from fecontact.bifurcation.orbits.discretisation import CollocationLinearisation, Discretisation
from fecontact.core.types import Array, ComplexArray

# Distance of products of multipliers from a multiplier up to which they are the same.
_SAME = 1e-6
# Orders above that of the series in the fit of residuals, and values for each coefficient.
_MORE, _OVER = 3, 3
# Numbers in the states whose rates are evaluated at once.
_AT_ONCE = 2_000_000
# Least range of a state, in the largest one in the scales of the orbit.
_LEAST_RANGE = 0.1
# Range of an orbit at rest, in the scales of the states.
_AT_REST = 1e-6

Powers = tuple[int, ...]


class CentreManifold:
    """Critical vectors of an orbit, and the series in their amplitudes.

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
    sizes : (k,) array
        Root of the mean square of each vector in scaled states. Vectors are as long as the range
        of the states allows, so that amplitudes up to one are those of the orbit's surroundings.
    """

    def __init__(
        self, problem: Discretisation, u: Array, linearised: CollocationLinearisation,
        multipliers: Sequence[complex], chain: bool = False,
    ) -> None:
        self._problem, self._at, self._values = problem, linearised, problem.parameters(u)
        self.multipliers, self._chain = tuple(complex(one) for one in multipliers), chain
        self._x, self._T = problem.at_gauss_points(problem.nodes(u))[0], linearised.period
        rates, self._J, _ = linearised.derivatives
        self._velocity = self._T * rates
        self._h = np.repeat(problem.widths, problem.degree)[:, None]
        nodes = problem.nodes(u)
        scales = problem.scales[: nodes.shape[1]]
        size = np.ptp(nodes, axis=0) / scales
        # A forced orbit may be at rest.
        most = size.max() if size.max() > _AT_REST else 1.0
        self._span = np.maximum(size, _LEAST_RANGE * most) * scales
        self._known: dict[int, _Closing] = {}
        self._drive = _reduced(linearised, self._h * self._velocity)
        self.vectors: list[ComplexArray] = []
        self._linear: list[tuple[ComplexArray, ComplexArray, complex]] = []
        for place, multiplier in enumerate(self.multipliers):
            if place and self._is_conjugate(place):
                h, dh, a = self._linear[-1]
                self._linear.append((h.conj(), dh.conj(), a.conjugate()))
            elif chain and place:
                before = self._linear[0][0]
                self._linear.append(self._closing(multiplier).next_in_chain(self, -before))
            else:
                self._linear.append(self._closing(multiplier).critical(self))
        weights = np.tile(problem.rule.weights, problem.intervals)[:, None] * self._h
        sizes = []
        for place, multiplier in enumerate(self.multipliers):
            h = self._linear[0 if chain else place][0]
            if self._closing(multiplier).drifts:
                # It is free along the orbit: at right angles to it, as in the phase condition.
                along = np.sum(weights * h * self._velocity) / np.sum(weights * self._velocity**2)
                h = h - along * self._velocity
            sizes.append(np.sqrt(np.sum(weights * np.abs(h / scales) ** 2)))
        self.sizes = np.array(sizes)

    def series(self, order: int, radius: float) -> "Series":
        """The series up to an order, residuals being fitted over amplitudes up to a radius."""
        return Series(self, order, radius)

    def _is_conjugate(self, place: int) -> bool:
        """Whether an amplitude is the conjugate of the one before."""
        one = self.multipliers[place]
        return abs(one.imag) > _SAME and one.imag == -self.multipliers[place - 1].imag

    def _closing(self, closing: complex) -> "_Closing":
        """Equations for h(1) = closing h(0), made once."""
        key = hash(complex(round(closing.real / _SAME), round(closing.imag / _SAME)))
        if key not in self._known:
            near = [one for one in self.multipliers if abs(one - closing) < _SAME]
            self._known[key] = _Closing(self, near[0] if near else closing, bool(near))
        return self._known[key]


class _Closing:
    """Linear equations h' - A h = r - a x' - g v with h(1) = c h(0) at one closing c."""

    def __init__(self, of: CentreManifold, closing: complex, critical: bool) -> None:
        factors, d = of._at.factors, len(of._at.factors.end)
        self.closing, self._of, self.critical_ = closing, of, critical
        self.drifts = of._problem.autonomous and abs(closing - 1.0) < _SAME
        self._balance = 1.0 / np.abs(factors.end[:, : 2 * d]).max(axis=1)
        matrix = factors.end[:, :d] + closing * factors.end[:, d : 2 * d]
        size = d + self.drifts
        base = np.zeros((size, size), dtype=complex)
        base[:d, :d] = matrix * self._balance[:, None]
        if self.drifts:
            base[:d, d] = of._drive[1] * self._balance
            row = of._velocity[0] / of._span**2
            base[d, :d] = row / np.linalg.norm(row)
            # As large as other columns.
            self._drift_unit = 1.0 / np.linalg.norm(base[:d, d])
            base[:d, d] *= self._drift_unit
        self._base = base
        self._null: Array | None = None
        self._left: Array | None = None
        if critical:
            lefts, _, rights = np.linalg.svd(base)
            self._null, self._left = rights[-1].conj(), lefts[:, -1]

    def critical(self, of: CentreManifold) -> tuple[ComplexArray, ComplexArray, complex]:
        """The critical vector, its slope and the change of the phase's speed with it."""
        assert self._null is not None
        if abs(self.closing.imag) < _SAME:
            place = int(np.argmax(np.abs(self._null)))
            self._null = self._null * np.exp(-1j * np.angle(self._null[place]))
        zero = np.zeros_like(of._x, dtype=complex)
        h, _, _ = self._expanded(of, zero, self._null, 0.0, None)
        self._null = self._null / np.abs(h / of._span).max()
        return self._expanded(of, zero, self._null, 0.0, None)

    def next_in_chain(
        self, of: CentreManifold, rhs: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, complex]:
        """The solution at right angles to the critical vector, where there is one."""
        assert self._left is not None
        found = self._solved(of, rhs, self._left)
        return self._expanded(of, rhs, found[:-1], 0.0, None)

    def solve(
        self, of: CentreManifold, rhs: ComplexArray, vector: ComplexArray | None
    ) -> tuple[ComplexArray, ComplexArray, complex, complex]:
        """h and h' at the Gauss points, a and g, the multiple of the vector."""
        if vector is None:
            found = np.linalg.solve(self._base, self._side(of, rhs))
            return *self._expanded(of, rhs, found, 0.0, None), 0.0
        column = self._side(of, vector)
        size = np.linalg.norm(column)
        found = self._solved(of, rhs, column / size)
        g = complex(found[-1] / size)
        return *self._expanded(of, rhs, found[:-1], g, vector), g

    def _solved(self, of: CentreManifold, rhs: ComplexArray, column: Array) -> ComplexArray:
        assert self._null is not None
        n = len(self._base)
        whole = np.zeros((n + 1, n + 1), dtype=complex)
        whole[:n, :n], whole[:n, n] = self._base, column
        whole[n, :n] = self._null.conj() / np.linalg.norm(self._null)
        return np.linalg.solve(whole, np.append(self._side(of, rhs), 0.0))

    def _side(self, of: CentreManifold, rhs: ComplexArray) -> ComplexArray:
        side = _reduced(of._at, of._h * rhs)[1] * self._balance
        return np.append(side, 0.0) if self.drifts else side

    def _expanded(
        self, of: CentreManifold, rhs: ComplexArray, found: ComplexArray, g: complex,
        vector: ComplexArray | None,
    ) -> tuple[ComplexArray, ComplexArray, complex]:
        """h, h' and a from the start of h, and a in its unit behind it."""
        d = len(self._balance)
        a = complex(found[d] * self._drift_unit) if self.drifts else 0.0j
        whole = rhs - a * of._velocity - (0.0 if vector is None else g * vector)
        reduced = _reduced(of._at, of._h * whole)[0]
        start = found[:d]
        nodes = open_solution(of._at.factors, reduced, start, self.closing * start)
        h = at_points(of._problem, nodes.reshape(of._x.shape), self.closing * start)
        return h, of._T * (of._J @ h[:, :, None])[:, :, 0] + whole, a


class Series:
    """Coefficients of X, of the phase's speed and of the normal form up to an order.

    Attributes
    ----------
    powers : list of tuple of int
        Of the amplitudes, for each coefficient.
    """

    def __init__(self, of: CentreManifold, order: int, radius: float) -> None:
        self._of, self._order, k = of, order, len(of.multipliers)
        self.powers = _powers(k, order)
        self._place = {powers: place for place, powers in enumerate(self.powers)}
        shape = (len(self.powers), *of._x.shape)
        self._H, self._dH = np.zeros(shape, dtype=complex), np.zeros(shape, dtype=complex)
        self._a = np.zeros(len(self.powers), dtype=complex)
        self._g = np.zeros((k, len(self.powers)), dtype=complex)
        self._H[0], self._dH[0], self._a[0] = of._x, of._velocity, 1.0
        for place, (h, dh, a) in enumerate(of._linear):
            at = self._place[_unit(k, place)]
            self._H[at], self._dH[at], self._a[at] = h, dh, a
        if of._chain:
            self._g[0, self._place[_unit(k, 1)]] = 1.0
        self._fit(order, radius)

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
            if of._chain or degree != sum(self.powers[place - 1]):
                same = [at for at, one in enumerate(self.powers) if sum(one) == degree]
                rows = fit[[every.index(self.powers[at]) for at in same]] / radius**degree
                found = dict(zip(same, self._residual(radius * unit, rows), strict=True))
            self._solve_for(place, found[place])

    def _solve_for(self, place: int, rhs: ComplexArray) -> None:
        """Add the terms of some powers, for the coefficient of the residual."""
        of = self._of
        closing = complex(np.prod([one**power for one, power in
                                   zip(of.multipliers, self.powers[place], strict=True)]))
        equations = of._closing(closing)
        amplitude = None
        if equations.critical_:
            amplitude = max(at for at, one in enumerate(of.multipliers)
                            if abs(one - closing) < _SAME)
        vector = None if amplitude is None else of._linear[amplitude][0]
        h, dh, a, g = equations.solve(of, rhs, vector)
        self._H[place], self._dH[place], self._a[place] = h, dh, a
        if amplitude is not None:
            self._g[amplitude, place] = g

    def _residual(self, z: ComplexArray, rows: ComplexArray) -> ComplexArray:
        """Sums (n, N m, d) over amplitudes z (S, k), with weights (n, S), of T f(X) - dX/dt."""
        of, shape = self._of, self._of._x.shape
        out = np.zeros((len(rows), *shape), dtype=complex)
        step = max(1, _AT_ONCE // of._x.size)
        for first in range(0, len(z), step):
            some = slice(first, first + step)
            out += np.tensordot(rows[:, some], self._residual_at(z[some]), 1)
        return out

    def _residual_at(self, z: ComplexArray) -> Array:
        of, count = self._of, len(z)
        powers = _products(z, self.powers)
        x = np.ascontiguousarray(np.tensordot(powers, self._H, 1).real)
        times = np.tile(of._at.times, count)
        f = of._problem.field.rates(times, x.reshape(-1, x.shape[2]), of._values).reshape(x.shape)
        change = np.tensordot(powers, self._dH, 1) * (powers @ self._a)[:, None, None]
        for amplitude in range(z.shape[1]):
            slopes = _slopes(z, self.powers, amplitude)
            change = change + (np.tensordot(slopes, self._H, 1)
                               * (powers @ self._g[amplitude])[:, None, None])
        return np.asarray(of._T * f - change.real)


def _reduced(at: CollocationLinearisation, rows: Array) -> tuple[ComplexArray, ComplexArray]:
    return open_side(at.factors, rows.reshape(-1))


def _unit(count: int, place: int) -> Powers:
    return tuple(int(at == place) for at in range(count))


def _powers(count: int, order: int) -> list[Powers]:
    """All powers of so many amplitudes up to an order; along a chain the second one rises."""
    found = [one for one in product(range(order + 1), repeat=count) if sum(one) <= order]
    return sorted(found, key=lambda one: (sum(one), tuple(-power for power in one)))


def _products(z: ComplexArray, powers: list[Powers]) -> ComplexArray:
    """Products (S, n) of amplitudes (S, k) to their powers."""
    return np.prod(z[:, None, :] ** np.array(powers)[None], axis=2)


def _slopes(z: ComplexArray, powers: list[Powers], amplitude: int) -> ComplexArray:
    """Derivatives (S, n) of the products to one amplitude."""
    given = np.array(powers)
    lower = given.copy()
    lower[:, amplitude] = np.maximum(given[:, amplitude] - 1, 0)
    return np.asarray(given[:, amplitude] * np.prod(z[:, None, :] ** lower[None], axis=2))


def _samples(of: CentreManifold, terms: int) -> ComplexArray:
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
        if of._is_conjugate(place):
            z[:, place - 1] = real[:, place - 1] + 1j * real[:, place]
            z[:, place] = z[:, place - 1].conj()
    return z
