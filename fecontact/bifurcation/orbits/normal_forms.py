"""Normal forms of folds, and of period doublings and Neimark-Sacker points: sub- or supercritical.

On the centre manifold, with time in periods of the orbit and its phase moving with the flow,

    fold              xi' = b xi^2           v' = A v - a x', with the phase at the speed 1 + a xi
    period doubling   xi' = c xi^3           v antiperiodic, v' = A v
    Neimark-Sacker    z' = i theta z + D z |z|^2        v' + i theta v = A v

where A = T df/dx along the orbit. The doubled orbit, or the torus, is stable and lies beyond the
point if c, or Re D, is negative (supercritical); else it is unstable and lies before it. The
coefficients follow from the terms up to third order (Kuznetsov, Govaerts, Doedel and Dhooge, SIAM
J. Numer. Anal. 43, 2005), as those that make the collocation equations solvable. The second and
third derivatives of f are differences of its Jacobian along directions.
"""

from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linalg.bordered import Border, Bordered
from fecontact.bifurcation.linalg.condensation import condense, factors_for
from fecontact.bifurcation.orbits.collocation_kernels import to_nodes
from fecontact.bifurcation.orbits.curves.criticality import Term, at_points, of_doubling
from fecontact.bifurcation.orbits.discretisation import CollocationLinearisation, Discretisation

Array = NDArray[Any]

# Steps of the differences, in ranges of the states over the orbit; the first two that agree count.
_STEPS = (1e-3, 1e-4, 1e-5, 1e-6)
_AGREEMENT = 0.02
# Largest relative error of a coefficient whose sign is trusted.
_DECIDED = 0.25


def examined(
    kind: str, problem: Discretisation, u: Array, linearised: CollocationLinearisation,
    details: bool = True
) -> dict[str, Any] | None:
    """Details of a special point of a branch of orbits; None if it is not one.

    'coefficient' is c or Re D for eigenfunctions of unit mean square in the scaled states,
    'coefficient_error' the change between two difference steps, 'criticality' their conclusion,
    see :func:`verdict`; at folds |b|, without conclusion. Without ``details`` these are omitted.
    """
    found = linearised.floquet.confirmed(kind)
    if found is None or not details:
        return found
    if kind == "period doubling":
        found |= _judged(Expansion(problem, u, linearised).doubling)
    elif kind == "fold":
        found |= _judged(Expansion(problem, u, linearised).fold)
        del found["criticality"]
    elif kind == "torus":
        expansion = Expansion(problem, u, linearised)
        found |= _judged(partial(expansion.torus, found["angle"]))
    return found


def verdict(coefficient: float, error: float) -> dict[str, Any]:
    """A coefficient, its error, and 'supercritical', 'subcritical' or 'undecided'.

    It is undecided if the error exceeds a quarter of the coefficient or is unknown (NaN).
    """
    criticality = "undecided"
    if error <= _DECIDED * abs(coefficient) and coefficient != 0.0:
        criticality = "supercritical" if coefficient < 0.0 else "subcritical"
    return {"coefficient": coefficient, "coefficient_error": error, "criticality": criticality}


def _judged(coefficient: Any) -> dict[str, Any]:
    """The coefficient from the first two steps that agree, or else the best pair."""
    values: list[float] = []
    pairs: list[tuple[float, float]] = []
    for step in _STEPS:
        values.append(float(coefficient(step)))
        if len(values) > 1:
            pairs.append((abs(values[-1] - values[-2]), values[-1]))
            if pairs[-1][0] <= _AGREEMENT * abs(values[-1]):
                return verdict(values[-1], pairs[-1][0])
    error, value = min(pairs)
    return verdict(value, error)


class Expansion:
    """The flow about an orbit, to third order, on the points of collocation.

    ``doubling`` is the term of :func:`of_doubling`, where it is known.
    """

    def __init__(self, problem: Discretisation, u: Array,
                 linearised: CollocationLinearisation, doubling: Term | None = None) -> None:
        self._problem, self._linearised, self._u = problem, linearised, u
        self._T, self._doubling = linearised.period, doubling
        self._values = problem.parameters(u)
        self._times = problem.times * self._T
        nodes = problem.nodes(u)
        self._x, slopes = problem.at_gauss_points(nodes)
        self._scales = problem.scales[: nodes.shape[1]]
        size = np.ptp(nodes, axis=0) / self._scales
        self._range = np.maximum(size, 0.1 * size.max()) * self._scales
        self._f, J, _ = linearised.derivatives
        self._J = self._T * J
        self._h = np.repeat(problem.widths, problem.degree)[:, None]
        self._motion = slopes / self._h
        self._last: tuple[Array, float, list[Array]] | None = None

    def fold(self, step: float) -> float:
        """Size of the coefficient b of a fold; its sign is that of the direction of v."""
        V, drift = self._fold_function
        kernel = self._motion if self._problem.autonomous else V
        second = self._second(V, V, step) / 2.0 - drift * self._along(V)
        return abs(float(self._share(self._J, V[:, :, None], kernel, second)[0]))

    def doubling(self, step: float) -> float:
        """Coefficient c of a period doubling, with differences over ``step``."""
        left, V = self._doubling_functions
        bend, cubic = self._second(V, V, step), self._third(V, V, V, step)
        h2, drift = self._response(bend)
        third = (cubic / 6.0 + self._second(V, h2, step) / 2.0
                 - drift / 2.0 * self._along(V))
        return float((left * third).sum() / (left * V).sum())

    def torus(self, angle: float, step: float) -> float:
        """Coefficient Re D of a Neimark-Sacker point with multipliers exp(+- i angle)."""
        V = self._torus_function(angle)
        W = V.conj()
        h11, drift = self._response(self._second(V, W, step).real)
        h20 = self._oscillating(2.0 * angle, self._second(V, V, step))
        third = (self._third(V, V, W, step) / 2.0 + self._second(h11 + 0j, V, step)
                 + self._second(h20, W, step) / 2.0
                 - drift * (self._along(V) - 1j * angle * V))
        columns = np.stack([_split(V), _split(1j * V)], axis=2)
        return float(self._share(self._turned(angle), columns, _split(V), _split(third))[0])

    @cached_property
    def _fold_function(self) -> tuple[Array, float]:
        """Eigenfunction v of the multiplier 1 at a fold, at the points (N m, d), and a."""
        autonomous = self._problem.autonomous
        motion = self._motion[:, :, None] if autonomous else np.zeros((*self._x.shape, 0))
        rows = [np.append(self._problem.phase_row, 0.0)] if autonomous else []
        system = self._bordered(self._J, motion, rows)
        _, _, vectors = np.linalg.svd(system.matrix)
        found = system.expand(vectors[-1])
        V = self._at_points(found, self._x.shape[1])
        size = self._size(V)
        return V / size, float(found[-1]) / size if autonomous else 0.0

    @cached_property
    def _doubling_functions(self) -> tuple[Array, Array]:
        """Multiples (N m, d) of the equations at the points, and v at the points.

        The equations w' - A w = g of antiperiodic w are solvable if sum left g is zero.
        """
        term = self._doubling or of_doubling(self._linearised).terms[0]
        return self._h * term.left, self._normalised(term.states)

    def _torus_function(self, angle: float) -> Array:
        """Eigenfunction v of the multiplier exp(i angle) at the points, complex (N m, d)."""
        turned = self._turned(angle)
        system = self._bordered(turned, np.zeros((*turned.shape[:2], 0)), [])
        _, _, vectors = np.linalg.svd(system.matrix)
        nodes = system.expand(vectors[-1])
        return self._normalised(_joined(self._at_points(nodes, len(vectors[-1]))))

    def _normalised(self, V: Array) -> Array:
        return V / self._size(V)

    def _size(self, V: Array) -> float:
        """Root of the mean square of the scaled states."""
        weights = (np.tile(self._problem.rule.weights, self._problem.intervals)[:, None] * self._h)
        return float(np.sqrt(np.sum(weights * np.abs(V / self._scales) ** 2)))

    def _response(self, bend: Array) -> tuple[Array, float]:
        """Periodic h with h' - A h = bend - a x' at the points, and the phase acceleration a."""
        problem, rows = self._problem, self._at_rest
        side = np.zeros(len(self._u))
        side[: self._x.size] = (self._h * bend).reshape(-1)
        found = rows.solve(side)
        h = self._at_points(found, self._x.shape[1])
        return h, -float(found[problem.size]) / self._T if problem.autonomous else 0.0

    @cached_property
    def _at_rest(self) -> Bordered:
        return self._linearised.at_fixed_parameters()

    def _oscillating(self, angle: float, bend: Array) -> Array:
        """Periodic h with h' + i angle h - A h = bend at the points, complex."""
        turned = self._turned(angle)
        system = self._bordered(turned, np.zeros((*turned.shape[:2], 0)), [])
        found = system.solve(_split(self._h * bend).reshape(-1))
        return _joined(self._at_points(found, turned.shape[1]))

    def _share(self, A: Array, columns: Array, kernel: Array, g: Array) -> Array:
        """Coefficients c for which w' - A w = g - columns c is solvable.

        The equations without the columns have the solution ``kernel``.
        """
        problem, D = self._problem, A.shape[1]
        row = np.empty((len(A), D))
        to_nodes(np.ascontiguousarray(kernel), problem.rule.weights[:, None] * problem.rule.values,
                 problem.widths, row)
        count = columns.shape[2]
        both = [row] if count == 1 else [row, _split(1j * _joined(row))]
        rows = [np.append(one.reshape(-1), np.zeros(count)) for one in both]
        system = self._bordered(A, columns, rows)
        side = np.append((self._h * g).reshape(-1), np.zeros(len(rows)))
        return system.solve(side)[len(A) * D :]

    def _bordered(self, A: Array, columns: Array, rows: list[Array]) -> Bordered:
        """Equations of w' - A w + columns c for periodic w, with border rows."""
        problem = self._problem
        N, m, (_, D, q) = problem.intervals, problem.degree, columns.shape
        factors = factors_for(N, m, D, q)
        condense(np.ascontiguousarray(A), np.zeros((N * m, D)), np.ascontiguousarray(-columns),
                 problem.widths, 1.0, problem.rule.values, problem.rule.slopes, 0, factors)
        return Bordered(factors, [Border(factors, row) for row in rows], 1.0)

    def _turned(self, angle: float) -> Array:
        """A - i angle as a real matrix of twice the size."""
        n, d, _ = self._J.shape
        result = np.zeros((n, 2 * d, 2 * d))
        result[:, :d, :d] = result[:, d:, d:] = self._J
        result[:, :d, d:] = angle * np.eye(d)
        result[:, d:, :d] = -angle * np.eye(d)
        return result

    def _along(self, V: Array) -> Array:
        return np.einsum("cij,cj->ci", self._J, V)

    def _at_points(self, nodes: Array, D: int) -> Array:
        shaped = nodes[: len(self._x) * D].reshape(-1, D)
        return at_points(self._problem, shaped, shaped[0])

    def _jacobians(self, a: Array, h: float) -> list[Array]:
        """Jacobians at h, -h, 2 h and -2 h along a, shared by second and third derivatives."""
        if self._last is None or self._last[1] != h or self._last[0] is not a:
            x = np.concatenate([self._x + part * h * a for part in (1.0, -1.0, 2.0, -2.0)])
            _, J, _ = self._problem.field.derivatives(np.tile(self._times, 4), x, self._values, ())
            self._last = a, h, [*(self._T * J).reshape(4, *self._J.shape)]
        return self._last[2]

    def _scaled(self, direction: Array, step: float) -> float:
        return float(step / np.max(np.abs(direction) / self._range))

    def _second(self, a: Array, b: Array, step: float) -> Array:
        """T f''(a, b), bilinear in complex a and b."""
        if np.iscomplexobj(a):
            return (self._second(a.real.copy(), b, step)
                    + 1j * self._second(a.imag.copy(), b, step))
        if not a.any():
            return np.zeros_like(b)
        h = self._scaled(a, step)
        above, below, far_above, far_below = self._jacobians(a, h)
        slope = (8.0 * (above - below) - far_above + far_below) / (12.0 * h)
        return np.einsum("cij,cj->ci", slope, b)

    def _third(self, a: Array, b: Array, c: Array, step: float) -> Array:
        """T f'''(a, b, c), for a = b or a real and imaginary mixture of them."""
        if not np.iscomplexobj(a):
            return np.einsum("cij,cj->ci", self._curvature(a, step), c)
        p, q = a.real.copy(), a.imag.copy()
        mixed = (self._curvature(p + q, step) - self._curvature(p - q, step)) / 4.0
        total = self._curvature(p, step) - self._curvature(q, step) + 2j * mixed
        return np.einsum("cij,cj->ci", total, c)

    def _curvature(self, a: Array, step: float) -> Array:
        """Second derivative of the Jacobian along a real direction."""
        if not a.any():
            return np.zeros_like(self._J)
        h = self._scaled(a, step)
        above, below, far_above, far_below = self._jacobians(a, h)
        return np.asarray((16.0 * (above + below) - (far_above + far_below) - 30.0 * self._J)
                          / (12.0 * h * h))


def _split(V: Array) -> Array:
    """Real and imaginary parts side by side."""
    return np.concatenate([V.real, V.imag], axis=-1)


def _joined(V: Array) -> Array:
    half = V.shape[-1] // 2
    return V[..., :half] + 1j * V[..., half:]
