"""Normal form coefficients of folds, Hopf points and branch points of equilibria."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.multilinear_forms import Bend, bend
from fecontact.core.errors import AnalysisError
from fecontact.core.ties import first_largest, oriented
from fecontact.core.types import Array, ComplexArray
from fecontact.system.fields.vector_field import VectorField

# Rounding of l1: relative to the sum of its terms, and to the l1 of a Jacobian that changes by its
# own size over the scales.
_CANCELLATION, _JACOBIAN_ROUNDING = 1e-9, 1e-15
# Part of the terms of a coefficient of a branch point below which it is zero, and the product of
# null vectors below which zero is a double eigenvalue.
_ZERO, _DEFECTIVE = 1e-6, 1e-8


@dataclass(frozen=True)
class Hopf:
    """A Hopf point.

    Attributes
    ----------
    angular_frequency : float
        w of the pair +-iw [rad/s].
    eigenvector : (d,) complex array
        q with J q = i w q, of Euclidean length one.
    first_lyapunov : float
        l1, Kuznetsov's (5.62): negative where stable orbits are born (supercritical).
    error : float
        Difference of two formulas for the derivatives, and what rounding leaves of the terms that
        add up to l1: at a centre they cancel.
    """

    angular_frequency: float
    eigenvector: ComplexArray
    first_lyapunov: float
    error: float

    @property
    def criticality(self) -> str:
        """'supercritical', 'subcritical', or 'undecided' where the error is as large as l1."""
        if not abs(self.first_lyapunov) > self.error:
            return "undecided"
        return "supercritical" if self.first_lyapunov < 0.0 else "subcritical"

    @property
    def details(self) -> dict[str, Any]:
        """Data of the point by the names of :class:`fecontact.bifurcation.HopfPoint`."""
        return {
            "angular_frequency": self.angular_frequency,
            "frequency_hz": self.angular_frequency / (2.0 * np.pi),
            "period": 2.0 * np.pi / self.angular_frequency,
            "eigenvector": self.eigenvector,
            "first_lyapunov": self.first_lyapunov,
            "first_lyapunov_error": self.error,
            "criticality": self.criticality,
        }


def critical_pair(
    J: Array, near: complex | None = None
) -> tuple[complex, ComplexArray, ComplexArray]:
    """Eigenvalue with positive imaginary part, q, and p.

    ``J q = l q``, ``J^T p = conj(l) p``, ``|q| = 1``, ``conj(p) q = 1``; the largest component of q
    is real and positive. It is the one nearest to the imaginary axis, or nearest to a given number.

    Raises
    ------
    AnalysisError
        If all eigenvalues are real.
    """
    from scipy.linalg import eig

    eigenvalues, left, right = eig(J, left=True, right=True)
    pairs = np.flatnonzero(eigenvalues.imag > 0.0)
    if not len(pairs):
        raise AnalysisError("All eigenvalues are real; there is no Hopf point here.")
    distance = np.abs(eigenvalues[pairs].real if near is None else eigenvalues[pairs] - near)
    at = pairs[np.argmin(distance)]
    q, p = right[:, at], left[:, at]
    largest = q[first_largest(np.abs(q))]
    q = q * (largest.conj() / abs(largest)) / np.linalg.norm(q)
    return complex(eigenvalues[at]), q, p / np.conj(np.vdot(p, q))


def hopf(
    field: VectorField, x: Array, values: Array, scales: Array, near: complex | None = None
) -> Hopf:
    r"""Normal form at a Hopf point x for parameter values (k,).

    .. math:: l_1 = \frac{1}{2 w} \mathrm{Re}\, p^H \big[ C(q, q, \bar q)
        - 2 B(q, J^{-1} B(q, \bar q)) + B(\bar q, (2 i w - J)^{-1} B(q, q)) \big]

    with the second and third derivatives B and C from
    :func:`fecontact.bifurcation.fields.multilinear_forms.bend`, for the pair nearest to the
    imaginary axis or to ``near``.

    It describes a neighbourhood in which the friction law is close to its Taylor polynomial. For
    smoothed sign functions with slopes of 1e6 s/m and slow sliding that may be a few micrometres
    per second, and the orbit that is seen in practice, which sticks, is not the one that is born
    here: follow the orbits to know.

    References
    ----------
    Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed., section 5.4.
    """
    _, J, _ = field.derivatives(np.zeros(1), x[None], values)
    eigenvalue, q, p = critical_pair(J[0], near)
    w = eigenvalue.imag
    along, across = (bend(field, x, values, part, scales)
                     for part in (np.ascontiguousarray(q.real), np.ascontiguousarray(q.imag)))
    (fine, terms), (coarse, _) = (_first_lyapunov(J[0], w, q, p, one, other)
                                  for one, other in zip(along, across, strict=True))
    # A Jacobian is constant if it changes by less than its rounding over the scales.
    constant = (np.abs(J[0] * scales / scales[:, None]).max() / w
                * float(np.linalg.norm(q / scales)) ** 2)
    error = abs(fine - coarse) + _CANCELLATION * terms + _JACOBIAN_ROUNDING * float(constant)
    return Hopf(w, q, fine, error)


def _first_lyapunov(
    J: Array, w: float, q: ComplexArray, p: ComplexArray, along: Bend, across: Bend
) -> tuple[float, float]:
    """First Lyapunov coefficient, and the sum of the sizes of all terms in it."""
    B = along.first + 1j * across.first
    cubic = (along.second + across.second) @ q
    mean = np.linalg.solve(J, (B @ q.conj()).real)
    double = np.linalg.solve(2j * w * np.eye(len(J)) - J, B @ q)
    total = np.vdot(p, cubic - 2.0 * B @ mean + B.conj() @ double)
    size = np.abs(p) @ (np.abs(cubic) + np.abs(B) @ (2.0 * np.abs(mean) + np.abs(double)))
    return float(total.real) / (2.0 * w), float(size) / (2.0 * w)


def null_vectors(J: Array) -> tuple[Array, Array]:
    """Right and left singular vectors (d,) of the smallest singular value, of length one.

    The largest component of the right one is positive.
    """
    U, _, V = np.linalg.svd(J)
    return oriented(V[-1]), U[:, -1]


def fold_coefficient(field: VectorField, x: Array, values: Array, scales: Array) -> float:
    """Quadratic coefficient a = w B(v, v) / 2 of a fold, v and w the null vectors, w v = 1.

    It is NaN where zero is a double eigenvalue.
    """
    _, along = along_null_vector(field, x, values, scales)
    return 0.5 * along[0][0] if along else np.nan


def crossing_form(field: VectorField, x: Array, values: Array, scales: Array) -> dict[str, Any]:
    r"""Normal form of a branch point: a fork y' = k m y + c y^3 or transcritical, k m y + c y^2.

    .. math:: c = \tfrac12 w B(v, v) \quad \text{or} \quad
        \tfrac16 w \big[ C(v, v, v) - 3 B(v, J^+ B(v, v)) \big]

    with the null vectors v and w of J, |v| = 1, w v = 1, and y along v. It is a fork where the
    former is zero to the accuracy of its differences. Its bent branch is stable, besides the other
    eigenvalues, where c < 0 (supercritical).

    References
    ----------
    Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed., sections 5.4 and 7.4.
    """
    v, found = along_null_vector(field, x, values, scales)
    if not found:
        return {}
    (quadratic, cubic, size, terms), (coarse, coarse_cubic, *_) = found
    length = 1.0 / float(np.linalg.norm(v / scales))
    if abs(quadratic) > abs(quadratic - coarse) + _ZERO * (size + terms * length):
        return {"form": "transcritical", "coefficient": 0.5 * quadratic}
    decided = abs(cubic) > abs(cubic - coarse_cubic) + _ZERO * (terms + size / length)
    return {"form": "fork", "coefficient": cubic / 6.0, "criticality":
            ("supercritical" if cubic < 0.0 else "subcritical") if decided else "undecided"}


def along_null_vector(
    field: VectorField, x: Array, values: Array, scales: Array
) -> tuple[Array, list[tuple[float, float, float, float]]]:
    """Null vector v of J, and w B(v, v) and w [C(v, v, v) - 3 B(v, J^+ B(v, v))], each with the
    sum of the sizes of its terms, from two differences; none where zero is a double eigenvalue.
    """
    _, J, _ = field.derivatives(np.zeros(1), x[None], values)
    v, w = null_vectors(J[0])
    if abs(w @ v) < _DEFECTIVE:
        return v, []
    border, w = w, w / (w @ v)
    found = []
    for part in bend(field, x, values, v, scales):
        bent = part.first @ v
        inner = bordered(J[0], border, v, bent)
        sizes = np.abs(part.second) @ np.abs(v) + 3.0 * np.abs(part.first) @ np.abs(inner)
        found.append((float(w @ bent), float(w @ (part.second @ v - 3.0 * part.first @ inner)),
                      float(np.abs(w) @ np.abs(part.first) @ np.abs(v)),
                      float(np.abs(w) @ sizes)))
    return v, found


def branching_tangents(
    field: VectorField, x: Array, values: Array, index: int, scales: Array, tangent: Array
) -> Array | None:
    """Direction (d + 1,) of the other branch through a branch point, beside a given one.

    With the null space of [J, P] spanned by the given tangent t and a second vector s, the other
    branch goes along ``c t + s``, c = -psi D2F(s, s) / (2 psi D2F(t, s)); None where no second
    branch crosses at a finite angle.
    """
    _, J, P = field.derivatives(np.zeros(1), x[None], values, (index,))
    U, _, V = np.linalg.svd(np.concatenate([J[0], P[0]], axis=1))
    psi = U[:, -1]
    t = tangent / np.linalg.norm(tangent)
    t = V[-2:].T @ (V[-2:] @ t)
    t /= np.linalg.norm(t)
    rest = V[-2:] - np.outer(V[-2:] @ t, t)
    s = rest[np.argmax(np.linalg.norm(rest, axis=1))]
    s /= np.linalg.norm(s)

    def second(direction: Array) -> Array:
        shift = np.zeros(len(values))
        shift[index] = direction[-1]
        bent = bend(field, x, values, np.ascontiguousarray(direction[:-1]), scales, (index,), shift)
        return np.asarray(psi @ bent[0].first)

    mixed, own = float(second(s) @ t), float(second(s) @ s)
    if abs(mixed) <= 1e-9 * abs(own):
        return None
    other = -0.5 * own / mixed * t + s
    return np.asarray(other / np.linalg.norm(other))


def bordered(M: Array, column: Array, row: Array, rhs: Array) -> Any:
    """Solution h (d,) of [[M, column], [row, 0]] [h, s] = [rhs, 0]; all may be complex."""
    d = len(M)
    whole = np.zeros((d + 1, d + 1), dtype=np.result_type(M, column, row, rhs))
    whole[:d, :d], whole[:d, d], whole[d, :d] = M, column, row
    return np.linalg.solve(whole, np.append(rhs, 0.0))[:d]
