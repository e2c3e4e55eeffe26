"""Continuation problems of folds and Hopf points of equilibria in two parameters.

Both are minimally augmented systems: f(x, p) = 0 and g = 0, with g from the bordered system

    [[J - l I, b], [c, 0]] [v, g] = [0, 1]      (states in units of their scales)

g vanishes where l is an eigenvalue: l = 0 at a fold, l = i w at a Hopf point. Its derivative is
``dg = -w (dJ) v`` with the left solution w.

References
----------
W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, chapters 3, 4.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.equilibria.codim2_forms import codim2_form
from fecontact.bifurcation.equilibria.equilibrium import DenseEquations
from fecontact.bifurcation.equilibria.normal_forms import hopf, null_vectors
from fecontact.bifurcation.equilibria.problem import pair_test
from fecontact.bifurcation.fields.multilinear_forms import bend
from fecontact.bifurcation.orbits.unknowns import FreeParameters
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, ComplexArray
from fecontact.system.complex_modes import sorted_eigenvalues
from fecontact.system.fields.vector_field import VectorField

# Smallest |w^2| in divisions by l, relative to w^2 at the start.
_NEAR_ZERO = 1e-12
# Least singular value of the Jacobian, in its largest entry, below which an eigenvalue is zero.
_AT_ZERO_HOPF = 1e-10


class PlaneCurve(FreeParameters, Problem):
    """Equilibria with a border at zero; u = [x, (w^2,) second parameter, first parameter].

    ``active`` are the indices of both parameters, in the order in which they stand in u.
    """

    def __init__(
        self, field: VectorField, values: Array, active: tuple[int, int], sizes: Array,
        limits: Array, b: Array, c: Array,
    ) -> None:
        self.field, (self.second, self.free) = field, active
        self.scales = sizes[: field.dimension]
        self._sizes, self._limits = sizes, limits
        self.values, self._b, self._c = values.copy(), b, c

    def weights(self) -> Array:
        """Weights of states, (w^2,) and parameters in the inner product."""
        return np.asarray(self._sizes**-2.0)

    def evaluated(self, u: Array) -> tuple[Array, Array, Array, Array]:
        """State, f, J and df/dp to both parameters."""
        x = np.ascontiguousarray(u[: self.field.dimension])
        f, J, P = self.field.derivatives(np.zeros(1), x[None], self.parameters(u), self.active)
        if not (np.isfinite(J).all() and np.isfinite(f).all()):
            raise AnalysisError("The rates are not finite there.")
        return x, f[0], J[0], P[0]

    def bordered(self, J: Array, shift: complex) -> tuple[Any, Any, Any]:
        """Right and left vectors v and w (d,), and g; the borders are in the scales of states."""
        d = len(J)
        M = np.zeros((d + 1, d + 1), dtype=complex if isinstance(shift, complex) else float)
        M[:d, :d] = scaled(J, self.scales) - shift * np.eye(d)
        M[:d, d], M[d, :d] = self._b, self._c
        unit = np.zeros(d + 1)
        unit[d] = 1.0
        right, left = np.linalg.solve(M, unit), np.linalg.solve(M.T, unit)
        return right[:d] * self.scales, left[:d] / self.scales, right[d]

    def curvature(self, x: Array, u: Array, direction: Array) -> Array:
        """Directional derivative (d, d + 2) of [J, P] along a direction (d,)."""
        return bend(self.field, x, self.parameters(u), np.ascontiguousarray(direction), self.scales,
                    self.active, every=4)[0].first

    def renewed(self, u: Array, b: Array, c: Array) -> "PlaneCurve":
        """Curve with new borders, and with scales that grow with the states."""
        larger = np.clip(np.abs(u), self._sizes, self._limits)
        sizes = np.where(larger > 1.5 * self._sizes, larger, self._sizes)
        active = self.active[0], self.active[1]
        return type(self)(self.field, self.values, active, sizes, self._limits, b, c)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any]:
        """State, parameters by name, and the values of :meth:`stored`."""
        return {"state": u[: self.field.dimension].copy(), **self.named(u),
                **self.stored(u, linearisation)}

    def form(self, kind: str, u: Array, w: float = 0.0, other: float = 0.0) -> dict[str, Any]:
        """Normal form of a point of codimension two with pairs of these angular frequencies."""
        x = np.ascontiguousarray(u[: self.field.dimension])
        return codim2_form(kind, self.field, x, self.parameters(u), self.scales, w, other)

    @abstractmethod
    def stored(self, u: Array, linearisation: Any) -> Mapping[str, Any]:
        """Values stored at points besides state and parameters."""


class FoldCurve(PlaneCurve):
    """f = 0, g(0) = 0."""

    def linearise(self, u: Array) -> DenseEquations:
        """The augmented equations about u."""
        x, f, J, P = self.evaluated(u)
        v, w, g = self.bordered(J, 0.0)
        curvature = self.curvature(x, u, v)
        matrix = np.vstack([np.hstack([J, P]), -w @ curvature])
        return DenseEquations(np.append(f, g), matrix, len(x),
                              {"v": v, "w": w, "curvature": curvature})

    def adapted(self, u: Array, tangent: Array) -> tuple[Problem, Array, Array]:
        """Curve with borders computed at u; u and the tangent are unchanged."""
        v, w = null_vectors(scaled(self.evaluated(u)[2], self.scales))
        return self.renewed(u, w if w @ self._b > 0.0 else -w,
                            v if v @ self._c > 0.0 else -v), u, tangent

    def stored(self, u: Array, linearisation: Any) -> Mapping[str, Any]:
        """Stability besides the critical eigenvalues."""
        others = _others(linearisation.jacobian, 0.0, 1)
        return {"unstable_besides": int((others.real > 0.0).sum())}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
        """Points of codimension two."""
        v, w = linearisation.made["v"], linearisation.made["w"]
        w = w / (np.linalg.norm(w * self.scales) * np.linalg.norm(v / self.scales))
        quadratic = linearisation.made["curvature"][:, : len(v)] @ v
        found = {"cusp": float(w @ quadratic), "Bogdanov-Takens": float(w @ v)}
        if len(v) > 2:
            found["zero-Hopf"] = pair_test(_others(linearisation.jacobian, 0.0, 1))
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> Mapping[str, Any] | None:
        """Data of a point of codimension two; None if it is none."""
        if kind == "zero-Hopf":
            w = _nearest_frequency(_others(linearisation.jacobian, 0.0, 1))
            return {"frequency_hz": w / (2.0 * np.pi), **self.form(kind, u, w)} if w else None
        return None if kind == "fold" else self.form(kind, u)


class HopfCurve(PlaneCurve):
    """f = 0 and, l = sqrt(-w^2), the even and the odd part of g(l): (g(l) +- g(-l)) / (2, 2 l)."""

    def linearise(self, u: Array) -> DenseEquations:
        """The augmented equations about u."""
        x, f, J, P = self.evaluated(u)
        d = len(x)
        least = _NEAR_ZERO * self._sizes[d]
        square = u[d] if abs(u[d]) > least else (least if u[d] >= 0.0 else -least)
        root = complex(np.sqrt(complex(-square)))
        g: list[Any] = []
        slope: list[Any] = []
        gradient: list[Any] = []
        for shift in (root, -root):
            if g and u[d] > 0.0:  # the conjugate, as the borders are real
                g.append(g[0].conj())
                slope.append(slope[0].conj())
                gradient.append(gradient[0].conj())
                break
            v, w, value = self.bordered(J, shift)
            bent = self.curvature(x, u, v.real) + 1j * self.curvature(x, u, v.imag)
            g.append(value)
            slope.append(w @ v)
            gradient.append(-w @ bent)
        rate = -0.5 / root  # of the root with w^2
        even, odd = 0.5 * (g[0] + g[1]), 0.5 * (g[0] - g[1]) / root
        even_slope = 0.5 * (slope[0] - slope[1]) * rate
        odd_slope = (0.5 * (slope[0] + slope[1]) - odd) / root * rate
        matrix = np.zeros((d + 2, d + 3))
        matrix[:d, :d], matrix[:d, d + 1 :] = J, P
        for row, part, its_slope in ((d, 0.5 * (gradient[0] + gradient[1]), even_slope),
                                     (d + 1, 0.5 * (gradient[0] - gradient[1]) / root, odd_slope)):
            matrix[row, :d], matrix[row, d + 1 :] = part.real[:d], part.real[d:]
            matrix[row, d] = its_slope.real
        return DenseEquations(np.append(f, [even.real, odd.real]), matrix, d)

    def adapted(self, u: Array, tangent: Array) -> tuple[Problem, Array, Array]:
        """Curve with borders computed at u; u and the tangent are unchanged."""
        J = scaled(self.evaluated(u)[2], self.scales)
        b, c = hopf_borders(J, float(u[self.field.dimension]))
        return self.renewed(u, b, c), u, tangent

    def stored(self, u: Array, linearisation: Any) -> Mapping[str, Any]:
        """Stability besides the critical eigenvalues."""
        square = float(u[self.field.dimension])
        others = _others(linearisation.jacobian, square, 2)
        return {"frequency_hz": float(np.sqrt(max(square, 0.0))) / (2.0 * np.pi),
                "first_lyapunov": self._lyapunov(u, linearisation),
                "unstable_besides": int((others.real > 0.0).sum())}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
        """Points of codimension two."""
        square = float(u[self.field.dimension])
        J = scaled(linearisation.jacobian, self.scales)
        J = J / np.abs(J).max()
        sign = np.linalg.slogdet(J)[0]
        found = {"Bogdanov-Takens": square, "Bautin": self._lyapunov(u, linearisation),
                 "double Hopf": pair_test(_others(linearisation.jacobian, square, 2))}
        # With two states a zero eigenvalue belongs to the pair.
        if len(J) > 2:
            zero = float(sign * np.linalg.svd(J, compute_uv=False)[-1])
            found["zero-Hopf"] = zero
            # At a zero-Hopf point the coefficient has a pole, and rounding decides its sign.
            found["Bautin"] *= zero
            if abs(zero) < _AT_ZERO_HOPF:
                del found["Bautin"]
        return found

    def _lyapunov(self, u: Array, linearisation: DenseEquations) -> float:
        """First Lyapunov coefficient, computed once; NaN beyond a Bogdanov-Takens point."""
        made = linearisation.made
        if "lyapunov" not in made:
            made["lyapunov"] = np.nan
            square = u[self.field.dimension]
            if square > 0.0 and (np.linalg.eigvals(linearisation.jacobian).imag > 0.0).any():
                x = np.ascontiguousarray(u[: self.field.dimension])
                made["lyapunov"] = hopf(self.field, x, self.parameters(u), self.scales,
                                        1j * np.sqrt(square)).first_lyapunov
        return float(made["lyapunov"])

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> Mapping[str, Any] | None:
        """Data of a point of codimension two; None if it is none."""
        square = float(u[self.field.dimension])
        others = _others(linearisation.jacobian, square, 2)
        if kind == "zero-Hopf" and square < 1e-3 * np.abs(others).max(initial=0.0) ** 2:
            return None  # the end at a Bogdanov-Takens point
        w = float(np.sqrt(max(square, 0.0)))
        if kind == "double Hopf":
            other = _nearest_frequency(others)
            return {"second_frequency_hz": other / (2.0 * np.pi),
                    **self.form(kind, u, w, other)} if other else None
        return None if kind == "fold" else self.form(kind, u, w)


def scaled(J: Array, scales: Array) -> Array:
    """Jacobian of the states in units of their scales."""
    return np.asarray(J * scales / scales[:, None])


def hopf_borders(J: Array, square: float) -> tuple[Array, Array]:
    """Real borders b and c (d,) for the eigenvalue sqrt(-w^2) of J."""
    from scipy.linalg import eig

    eigenvalues, left, right = eig(J, left=True, right=True)
    at = np.argmin(np.abs(eigenvalues - np.sqrt(complex(-square))))
    return _real(left[:, at]), _real(right[:, at])


def _real(vector: ComplexArray) -> Array:
    """Real part, of length one, in the phase in which it is largest."""
    turned = vector * np.exp(-0.5j * np.angle(vector @ vector))
    return np.asarray(turned.real / np.linalg.norm(turned.real))


def _others(J: Array, square: float, count: int) -> ComplexArray:
    """Eigenvalues without the ``count`` that are nearest to +-sqrt(-w^2)."""
    eigenvalues = sorted_eigenvalues(J)
    root = np.sqrt(complex(-square))
    chosen = np.argmin(np.abs(eigenvalues - root))
    rest = np.delete(eigenvalues, chosen)
    if count == 2 and len(rest):
        rest = np.delete(rest, np.argmin(np.abs(rest + root)))
    return np.asarray(rest)


def _nearest_frequency(eigenvalues: ComplexArray) -> float:
    """Angular frequency of the eigenvalue nearest to the imaginary axis; 0 if it is real."""
    if not len(eigenvalues):
        return 0.0
    return float(abs(eigenvalues[np.argmin(np.abs(eigenvalues.real))].imag))
