"""Normal forms of period doublings and Neimark-Sacker points: sub- or supercritical.

On the centre manifold, with time in periods of the orbit and its phase moving with the flow,

    period doubling   xi' = c xi^3           v antiperiodic, v' = A v
    Neimark-Sacker    z' = i theta z + D z |z|^2        v' + i theta v = A v

where A = T df/dx along the orbit. The doubled orbit, or the torus, is stable and lies beyond the
point if c, or Re D, is negative (supercritical); else it is unstable and lies before it. The
coefficients follow from the terms up to third order (Kuznetsov, Govaerts, Doedel and Dhooge, SIAM
J. Numer. Anal. 43, 2005), with the adjoint functions as left null vectors of the collocation
equations. The second and third derivatives of f are differences of its Jacobian along directions.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linearised import Linearised

if TYPE_CHECKING:
    from fecontact.bifurcation.collocation import Collocation

Array = NDArray[Any]

# Steps of the differences, in ranges of the states over the orbit: the first two that agree count.
_STEPS = (1e-3, 1e-4, 1e-5, 1e-6)
_AGREEMENT = 0.02


def examined(
    kind: str, problem: "Collocation", u: Array, linearised: Linearised
) -> dict[str, Any] | None:
    """Details of a special point of a branch of orbits; None if it is none.

    'coefficient' is c or Re D for eigenfunctions of mean square one in the scaled states,
    'criticality' its meaning: 'supercritical', 'subcritical', or 'uncertain' where differences
    over smaller and smaller steps do not agree.
    """
    stability = linearised.floquet
    mu = stability.others
    if kind == "period doubling":
        nearest = mu[np.argmin(np.abs(mu + 1.0))]
        if abs(nearest + 1.0) > 1e-2:
            return None
        return _judged(Expansion(problem, u, linearised).doubling)
    if kind == "torus":
        complex_pairs = mu[mu.imag > 1e-6]
        if not len(complex_pairs):
            return None
        nearest = complex_pairs[np.argmin(np.abs(np.abs(complex_pairs) - 1.0))]
        if abs(abs(nearest) - 1.0) > 1e-2:
            return None
        angle = float(np.angle(nearest))
        return {"kind": "Neimark-Sacker", "angle": angle,
                **_judged(lambda step: Expansion(problem, u, linearised).torus(angle, step))}
    return {}


def _judged(coefficient: Any) -> dict[str, Any]:
    before = None
    for step in _STEPS:
        value = float(coefficient(step))
        if before is not None and abs(value - before) <= _AGREEMENT * abs(value):
            return {"coefficient": value,
                    "criticality": "supercritical" if value < 0.0 else "subcritical"}
        before = value
    return {"coefficient": float("nan"), "criticality": "uncertain"}


class Expansion:
    """The flow about an orbit, to third order, on the points of collocation."""

    def __init__(self, problem: "Collocation", u: Array, linearised: Linearised) -> None:
        self._problem, self._T = problem, linearised.period
        self._values = problem.parameters(u)
        self._times = problem.times * self._T
        nodes = problem.nodes(u)
        self._x, slopes = problem.at_gauss_points(nodes)
        scales = problem.scales[: nodes.shape[1]]
        size = np.ptp(nodes, axis=0) / scales
        self._range = np.maximum(size, 0.1 * size.max()) * scales
        self._f, J, _ = linearised.derivatives
        self._J = self._T * J
        self._h = np.repeat(problem.widths, problem.degree)[:, None]
        self._motion = slopes / self._h

    def doubling(self, step: float) -> float:
        """c of a period doubling, with differences over ``step``."""
        v, left = self._null_vectors(0.0, -1.0)
        V = self._at_points(v, -1.0).real
        bend = self._second(V, V, step)
        h2, drift = self._response(bend, 2.0)
        H = self._at_points(h2, 1.0).real
        third = self._third(V, V, V, step) / 6.0 + self._second(H, V, step) / 2.0
        third = third - drift * self._along(V, 0.0)
        return float((self._projected(left, third) / self._projected(left, V)).real)

    def torus(self, angle: float, step: float) -> float:
        """Re D of a Neimark-Sacker point with multipliers exp(+- i angle)."""
        v, left = self._null_vectors(1j * angle, 1.0)
        V = self._at_points(v, 1.0)
        W = V.conj()
        h11, drift = self._response(self._second(V, W, step), 1.0)
        h20 = self._solve(self._matrix(2j * angle, 1.0), self._h * self._second(V, V, step))
        third = (self._third(V, V, W, step) / 2.0
                 + self._second(self._at_points(h11, 1.0), V, step)
                 + self._second(self._at_points(h20, 1.0), W, step) / 2.0)
        third = third - drift * self._along(V, 1j * angle)
        return float((self._projected(left, third) / self._projected(left, V)).real)

    def _response(self, bend: Array, share: float) -> tuple[Array, float]:
        """Periodic h with h' - A h = bend - share a x', and a: how the phase is sped up."""
        matrix = self._matrix(0.0, 1.0)
        if not self._problem.autonomous:
            return self._solve(matrix, self._h * bend), 0.0
        _, left = self._null_vectors(0.0, 1.0)
        total = self._projected(left, bend) / self._projected(left, self._motion)
        rest = self._h * (bend - total * self._motion)
        shift = self._nodes_of_motion()
        return self._bordered_solve(matrix, left, shift, rest), float(total.real) / share

    def _nodes_of_motion(self) -> Array:
        """x' as nodal values, the kernel of the periodic equations."""
        v, _ = self._null_vectors(0.0, 1.0)
        return v

    def _along(self, V: Array, exponent: complex) -> Array:
        return np.einsum("cij,cj->ci", self._J, V) - exponent * V

    def _projected(self, left: Array, g: Array) -> complex:
        return complex(left.conj() @ (self._h * g).reshape(-1))

    def _matrix(self, exponent: complex, closing: float) -> Any:
        """Collocation rows of w' - A w + exponent w, with w(1) = closing w(0)."""
        from scipy.sparse import csc_matrix

        problem = self._problem
        rule, N, m, d = problem.rule, problem.intervals, problem.degree, self._x.shape[1]
        h = problem.widths[:, None, None, None, None]
        eye = np.eye(d)
        inner = exponent * eye - self._J.reshape(N, m, 1, d, d)
        blocks = (rule.slopes[None, :, :, None, None] * eye
                  + h * rule.values[None, :, :, None, None] * inner)
        blocks[-1, :, -1] *= closing
        j, c, k, i, l = np.indices(blocks.shape, sparse=True)
        rows = np.broadcast_to((j * m + c) * d + i, blocks.shape)
        columns = np.broadcast_to((j * m + k) % (N * m) * d + l, blocks.shape)
        return csc_matrix((blocks.reshape(-1), (rows.reshape(-1), columns.reshape(-1))),
                          shape=(N * m * d, N * m * d))

    def _null_vectors(self, exponent: complex, closing: float) -> tuple[Array, Array]:
        """Right (N m d,) and left null vector of the matrix, by bordering."""
        matrix = self._matrix(exponent, closing)
        size = matrix.shape[0]
        rng = np.random.default_rng(0)
        right, left = rng.normal(size=size) + 0j, rng.normal(size=size) + 0j
        for _ in range(3):
            factors = _factors(matrix, left, right)
            unit = np.zeros(size + 1, dtype=complex)
            unit[-1] = 1.0
            right, left = factors.solve(unit)[:-1], factors.solve(unit, trans="H")[:-1]
            right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
        points = self._at_points(right, closing)
        scales = self._problem.scales[: points.shape[1]]
        mean = np.sum(np.repeat(self._problem.widths, self._problem.degree)[:, None]
                      * np.abs(points / scales) ** 2
                      * np.tile(self._problem.rule.weights, self._problem.intervals)[:, None])
        if exponent == 0.0:
            right = right / (right[np.argmax(np.abs(right))] / np.abs(right).max())
        return right / np.sqrt(mean), left

    @staticmethod
    def _solve(matrix: Any, rhs: Array) -> Array:
        from scipy.sparse.linalg import splu

        return np.asarray(splu(matrix.astype(complex)).solve(rhs.reshape(-1).astype(complex)))

    @staticmethod
    def _bordered_solve(matrix: Any, left: Array, right: Array, rhs: Array) -> Array:
        side = np.append(rhs.reshape(-1), 0.0).astype(complex)
        return np.asarray(_factors(matrix, left, right).solve(side)[:-1])

    def _at_points(self, nodes: Array, closing: float) -> Array:
        problem = self._problem
        m = problem.degree
        shaped = nodes.reshape(-1, self._x.shape[1])
        closed = np.concatenate([shaped, closing * shaped[:1]])
        patches = closed[np.arange(problem.intervals)[:, None] * m + np.arange(m + 1)]
        return np.einsum("ck,jkd->jcd", problem.rule.values, patches).reshape(shaped.shape)

    def _jacobian(self, shift: Array) -> Array:
        x = np.ascontiguousarray(self._x + shift)
        _, J, _ = self._problem.field.derivatives(self._times, x, self._values, ())
        return self._T * J

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
        slope = (8.0 * (self._jacobian(h * a) - self._jacobian(-h * a))
                 - self._jacobian(2.0 * h * a) + self._jacobian(-2.0 * h * a)) / (12.0 * h)
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
        near = self._jacobian(h * a) + self._jacobian(-h * a)
        far = self._jacobian(2.0 * h * a) + self._jacobian(-2.0 * h * a)
        return np.asarray((16.0 * near - far - 30.0 * self._J) / (12.0 * h * h))


def _factors(matrix: Any, left: Array, right: Array) -> Any:
    """Factors of [[matrix, left], [right^H, 0]]."""
    from scipy.sparse import bmat
    from scipy.sparse.linalg import splu

    return splu(bmat([[matrix, left[:, None]], [right.conj()[None], None]],
                     format="csc").astype(complex))
